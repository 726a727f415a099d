"""The neutral form: configurations to named parameters and back; a listing of them says everything."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pidcfg.encoders import Option

# --- A listing of neutral parameters says everything, and there are no places to choose -------------------------------

FORMATS = ("text", "csv", "json")
DECODE_OPTIONS: tuple[Option, ...] = ()
CONVERT_OPTIONS = DECODE_OPTIONS
