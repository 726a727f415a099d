"""Batches of samples of a scenario: what is drawn, how each is judged, and how sure one may be."""
