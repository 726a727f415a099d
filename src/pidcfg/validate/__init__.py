"""Rules over configurations and their images."""
