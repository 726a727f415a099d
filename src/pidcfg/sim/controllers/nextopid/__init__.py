"""The virtual NextoPID: a program of function blocks, executed as the PLC's task does."""
