"""The virtual controller of neutral loops: the ideal PID."""
