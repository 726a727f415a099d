"""Register maps: tables only, one module a vendor."""
