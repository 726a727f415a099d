"""Delta AS: configurations to the operands of DPIDE instructions and back, and their files."""
