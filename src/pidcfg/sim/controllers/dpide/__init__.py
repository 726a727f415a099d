"""The virtual DPIDE instruction of the Delta AS."""
