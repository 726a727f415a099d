"""Typed schemas of what a file may say: one module a vendor, and the field types they share."""
