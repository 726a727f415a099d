"""Each vendor's configuration as neutral loops, one module a vendor with those that it needs."""
