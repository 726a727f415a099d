"""Structured Text (IEC 61131-3) as far as every vendor has it: words, statements, literals and comments."""
