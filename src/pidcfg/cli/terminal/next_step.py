"""What is usually done next: one line for a person at a terminal, never for a file, a pipe or CI."""

from __future__ import annotations

import os
import re
import sys

from pidcfg.cli.terminal.console import remark

SAFE = re.compile(r"[\w@%+=:,./-]+")
"""A word that a shell takes as it is."""


def next_step(*words: str, quiet: bool = False, fmt: str = "text") -> None:
    """Names the command that is usually next, ``words`` behind ``pidcfg``."""
    if quiet or fmt != "text" or "CI" in os.environ or not sys.stderr.isatty():
        return
    remark(f"next: pidcfg {' '.join(word if SAFE.fullmatch(word) else _quoted(word) for word in words)}")


def _quoted(word: str) -> str:
    """In double quotes, which every shell knows."""
    return '"' + word.replace('"', '\\"') + '"'
