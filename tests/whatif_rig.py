"""A file as `python tasks.py whatif-runtime` makes it, with nothing in it that runs."""

from __future__ import annotations

import zipfile

from pidcfg.output.browser.page import runtime_entries

VERSIONS = {"pyodide": "1.2.3", "python": "3.4.5"}


def make_runtime(path):
    """Writes the file, which pages can be made with that nobody opens."""
    with zipfile.ZipFile(path, "w") as archive:
        for name, data in runtime_entries(VERSIONS, {"pyodide.mjs": b"//"}, {}).items():
            archive.writestr(name, data)
    return path
