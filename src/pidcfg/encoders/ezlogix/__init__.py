"""EZLogix configurations to registers and discretes and back."""
