"""Scenarios with everything they need, and the two sides of a conversion on the same plants."""
