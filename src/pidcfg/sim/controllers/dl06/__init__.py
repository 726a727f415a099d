"""The virtual DL06."""
