"""Configurations of tests: a plain one with some keys replaced."""

from __future__ import annotations


def merged(below: dict, above: dict) -> dict:
    """A mapping with another one on top of it, at any depth."""
    both = {k: merged(below[k], v) for k, v in above.items() if isinstance(v, dict) and isinstance(below.get(k), dict)}
    return {**below, **above, **both}
