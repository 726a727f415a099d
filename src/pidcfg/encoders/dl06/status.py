"""The mode that a DL06 loop is meant to run in, as its status word and what stands beside its words tell."""

from __future__ import annotations

MODES = {1: "manual", 2: "auto", 4: "cascade"}
MODE_BITS = 0b111


def intended_mode(status: int, otherwise: str) -> str:
    """From the status word (+06); a listing made before the first run has none: then ``otherwise``."""
    return MODES.get(status & MODE_BITS) or otherwise
