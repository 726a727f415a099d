"""What each vendor's loops do when they are switched, one module a vendor."""
