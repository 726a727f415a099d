"""Findings of files, and what settings, comments and a baseline leave of them."""
