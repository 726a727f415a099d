"""The neutral form: configurations to named parameters and back, and their files."""
