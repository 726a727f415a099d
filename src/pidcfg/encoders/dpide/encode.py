"""A configuration to the operands of DPIDE instructions."""

from pidcfg.encoders.maps.dpide import LOOPS

encode = LOOPS.encode
