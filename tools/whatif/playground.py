"""Write the playground into build/playground, a folder for any static server: `python tasks.py playground`."""

from __future__ import annotations

import sys
from pathlib import Path

from pidcfg.output.browser.page import RUNTIME_FILE, RuntimeFileError, playground_page, read_runtime

ROOT = Path(__file__).resolve().parents[2]
VENDORS = ("dl06", "click", "ezlogix", "nextopid", "dpide", "generic", "mistakes")
"""Folders of examples, in the order of the list."""


def main() -> None:
    """Makes the folder."""
    try:
        runtime = read_runtime(ROOT / "build" / "whatif" / RUNTIME_FILE)
    except RuntimeFileError as error:
        sys.exit(str(error))
    folder = ROOT / "build" / "playground"
    folder.mkdir(parents=True, exist_ok=True)
    text = playground_page([ROOT / "examples" / name for name in VENDORS], runtime)
    (folder / "index.html").write_text(text, "utf-8")
    print(f"{folder}: {len(text.encode()) / 1e6:.1f} MB; python -m http.server --directory {folder}")


if __name__ == "__main__":
    main()
