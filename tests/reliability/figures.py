"""The figures of the programme, a file each part: what its last run found. The page is written from them alone."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).with_name("figures")


def kept() -> dict[str, Any]:
    """The figures of all parts that were run."""
    return {path.stem: json.loads(path.read_text("utf-8")) for path in sorted(FOLDER.glob("*.json"))}


def keep(part: str, found: object) -> None:
    """The figures of one part in place of its earlier ones."""
    FOLDER.mkdir(exist_ok=True)
    (FOLDER / f"{part}.json").write_text(json.dumps(found, indent=1, sort_keys=True) + "\n", "utf-8")
