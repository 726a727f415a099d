"""Results in the formats that people, CI systems and editors read: pure functions to text.

A new format is a module here, which says everything about it, and a row of `FORMATS`. Options, help, settings, golden
files, the pages of docs/ and the tests follow.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pidcfg.cli.formats.findings import Findings
    from pidcfg.cli.formats.format import Format

# fmt: off
FORMATS = {
    # module    commands that report in it
    "text":     ("validate", "compare", "simulate", "certify", "diff", "convert"),
    "concise":  ("validate", "compare"),
    "json":     ("validate", "compare", "simulate", "certify", "diff", "convert"),
    "sarif":    ("validate", "compare", "simulate"),
    "github":   ("validate", "compare", "simulate"),
    "gitlab":   ("validate", "compare", "simulate"),
    "junit":    ("validate", "compare", "simulate", "certify"),
    "markdown": ("validate", "compare", "diff", "convert"),
}
# fmt: on
"""Every format by its name, in the order of the help; the first one is the default."""


def formats_of(command: str) -> tuple[str, ...]:
    """The names of the formats that a command reports in; no format is imported."""
    return tuple(name for name, commands in FORMATS.items() if command in commands)


def load(name: str) -> Format:
    """A format, whose module is imported only now."""
    loaded: Format = import_module(f"{__name__}.{name}").FORMAT
    return loaded


def render(name: str, findings: Findings) -> str:
    """The findings in one of the formats."""
    write = load(name).findings
    if write is None:
        raise ValueError(f"no findings are written as {name}")
    return write(findings)
