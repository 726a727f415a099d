"""NextoPID configurations and the neutral loop, both ways."""

from __future__ import annotations

from pidcfg.convert.nextopid_from import CONVERT_OPTIONS, from_neutral
from pidcfg.convert.nextopid_to import NOTHING_LOST, to_neutral

__all__ = ["CONVERT_OPTIONS", "NOTHING_LOST", "from_neutral", "to_neutral"]
