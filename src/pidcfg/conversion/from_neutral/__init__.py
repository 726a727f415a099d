"""Neutral loops as each vendor's configuration, one module a vendor with those that it needs."""
