"""The base step in one piece, for CPython."""
