"""YAML text to data with places, and back; what files, records and messages are made of."""
