"""The operands of DPIDE instructions back to a configuration."""

from pidcfg.encoders.maps.dpide import LOOPS

decode = LOOPS.decode
