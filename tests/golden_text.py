"""Committed texts beside the tests; ``PIDCFG_GOLDEN=write`` writes them anew."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path


def same(path: Path, text: str) -> None:
    """Whether a text is the committed one."""
    if os.environ.get("PIDCFG_GOLDEN") == "write":
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, "utf-8", newline="\n")
    assert path.read_text("utf-8") == text
