"""The parameters of neutral loops back to a configuration."""

from pidcfg.encoders.maps.generic import LOOPS

decode = LOOPS.decode
