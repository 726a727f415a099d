"""Verdicts on a run: meters, expectations of the scenario, and those of every run."""
