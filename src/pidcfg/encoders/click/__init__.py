"""CLICK configurations to C, DS and DF registers and back."""
