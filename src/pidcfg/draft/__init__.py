"""A scenario drafted for a configuration: plants that suit its loops, steps of the set points, expectations."""
