"""DL06 configurations to V-memory words and back."""
