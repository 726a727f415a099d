"""A configuration to the parameters of neutral loops."""

from pidcfg.encoders.maps.generic import LOOPS

encode = LOOPS.encode
