"""Results in the formats that people, CI systems and editors read; what a format is: pure functions to text."""

from __future__ import annotations

from enum import Enum, auto
from importlib import import_module
from typing import TYPE_CHECKING

from pidcfg.text.frozen import frozen

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from pidcfg.cli.formats.findings import Findings
    from pidcfg.study.outcome import Outcome
    from pidcfg.text.diagnostics import Severity

# --- Results in the formats that people, CI systems and editors read: pure functions to text --------------------------
#
# A new format is a `Format` in `reports`, or in a module that it imports, and a row of `FORMATS`. Options, help,
# settings, golden files, the pages of docs/ and the tests follow.

# fmt: off
FORMATS = {
    # module    commands that report in it
    "text":     ("validate", "compare", "simulate", "certify", "diff", "convert"),
    "concise":  ("validate", "compare"),
    "json":     ("validate", "compare", "simulate", "certify", "diff", "convert"),
    "sarif":    ("validate", "compare", "simulate"),
    "github":   ("validate", "compare", "simulate"),
    "gitlab":   ("validate", "compare", "simulate"),
    "rdjson":   ("validate", "compare", "simulate"),
    "junit":    ("validate", "compare", "simulate", "certify"),
    "markdown": ("validate", "compare", "diff", "convert"),
}
# fmt: on
"""Every format by its name, in the order of the help; the first one is the default."""


def formats_of(command: str) -> tuple[str, ...]:
    """The names of the formats that a command reports in; no format is imported."""
    return tuple(name for name, commands in FORMATS.items() if command in commands)


def load_format(name: str) -> Format:
    """A format, whose module is imported only now."""
    module = "runs" if name == "junit" else "reports"
    row: Format = getattr(import_module(f"{__name__}.{module}"), name.upper())
    return row


def render_findings(name: str, findings: Findings) -> str:
    """The findings in one of the formats."""
    write = load_format(name).findings
    if write is None:
        raise ValueError(f"no findings are written as {name}")
    return write(findings)


# --- What an output format is: what it is for, what its text is, and what writes it -----------------------------------


class Kind(Enum):
    """What a format's text is, which decides how it reaches the terminal."""

    PLAIN = auto()
    """Read by people: in colour where that is wanted."""
    LINES = auto()
    """Text that a program takes from a log: never coloured."""
    CI_COMMANDS = auto()
    """Lines that a CI system takes from a log and obeys."""
    JSON = auto()
    XML = auto()


@frozen
class Format:
    """A format; `reports`, or `runs` for JUnit, has one for each row of `FORMATS`, under its name in capitals."""

    purpose: str
    """Who reads it, for the table of docs/output-formats.md."""
    ending: str
    """How files of it end, without the first dot."""
    kind: Kind
    findings: Callable[[Findings], str] | None = None
    """Writes findings; None where no command reports findings in it."""
    runs: Callable[[Sequence[Outcome], Severity], str] | None = None
    """Writes simulated runs, of which findings from this severity on fail; None: the runs' findings are written."""
