"""What `pidcfg explain` says of every name of each vendor's tables; ``generated`` writes it anew."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from pidcfg import api
from pidcfg.output.explanation import as_text
from pidcfg.output.explanation.book import book_of
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from collections.abc import Callable

FOLDER = Path(__file__).parent / "data" / "explained"
SWITCHES = ("PID_RUN", "PID_MAN", "MOUT_AUTO", "PID_EQ", "PID_DE", "PID_DIR")
CONTENTS = {"dpide": [*(f"{name}={state}" for name in SWITCHES for state in (0, 1)), *(f"I_MV+{i}" for i in range(15))]}
"""Questions beside the names."""


def pages(vendor: str) -> str:
    """The pages of all names, each once."""
    names = [*sorted(book_of(vendor).spellings.values()), *CONTENTS.get(vendor, ())]
    return "\n".join({as_text(api.explain(name, vendor=vendor).pages): 0 for name in names})


def golden_files(wanted: Callable[[str], bool] = bool) -> dict[Path, bytes]:
    """Those of all vendors, or of those that are wanted."""
    return {FOLDER / f"{vendor}.txt": pages(vendor).encode() for vendor in VENDORS if wanted(vendor)}
