"""The virtual CLICK."""
