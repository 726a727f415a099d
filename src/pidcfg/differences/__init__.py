"""Two configurations compared by meaning."""
