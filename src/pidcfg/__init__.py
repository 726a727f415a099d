"""PID loops of small PLCs as text: check them, encode them, see them run."""

__version__ = "0.1.0"
