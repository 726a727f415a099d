"""Standing expectations: what is expected of every run, whether a scenario writes it down or not."""
