"""Whether two configurations behave alike: the same battery of stages on the same plants, compared at every sample.

Design. `stages` make the plant of a loop from its gains and say what happens to it, `trial` runs one side through one
stage, `comparison` holds two sides against each other, `stand_in` is a neutral loop with the rules of a PLC, `twin` is
the source with the values that the report of a conversion names and what explains a difference, `verify` puts it
together. Each stage is a run of its own that begins at rest, so that what went wrong in one is not seen in the next.
"""
