"""Second implementations of the PLCs' algorithms, written from manuals and decisions alone, to compare the engine with.

They are slow and plain on purpose. ``python -m reference [VENDOR…] [--count N] [--seed S]``, run in ``tests``, draws
random configurations with events, runs each on the engine and on its reference, and compares every base step.
"""
