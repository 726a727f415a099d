"""Whether two configurations behave alike: the same battery of stages on the same plants, compared at every sample.

Design. `bench` makes the plant of a loop from its gains, `stages` say what happens to it, `trial` runs one side through
one stage, `twin` is the source with the values that the report of a conversion names, `comparison` holds two sides
against each other, `lines` says what a line of the report explains, `battery` puts it together, and `verdict` is the
result. Each stage is a run of its own that begins at rest, so that what went wrong in one is not seen in the next.
"""
