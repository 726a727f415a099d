"""What an output format is: what it is for, what its text is, and what writes it."""

from __future__ import annotations

from enum import Enum, auto
from typing import TYPE_CHECKING

from pidcfg.frozen import frozen

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from pidcfg.cli.formats.findings import Findings
    from pidcfg.diagnostics import Severity
    from pidcfg.scenario.outcome import Outcome


class Kind(Enum):
    """What a format's text is, which decides how it reaches the terminal."""

    PLAIN = auto()
    """Read by people: in colour where that is wanted."""
    LINES = auto()
    """Text that a program takes from a log: never coloured."""
    ORDERS = auto()
    """Lines that a CI system takes from a log and obeys."""
    JSON = auto()
    XML = auto()


@frozen
class Format:
    """A format; each module of this package that stands in `FORMATS` has one, as ``FORMAT``."""

    purpose: str
    """Who reads it, for the table of docs/output-formats.md."""
    ending: str
    """How files of it end, without the first dot."""
    kind: Kind
    findings: Callable[[Findings], str] | None = None
    """Writes findings; None where no command reports findings in it."""
    runs: Callable[[Sequence[Outcome], Severity], str] | None = None
    """Writes simulated runs, of which findings from this severity on fail; None: the runs' findings are written."""
