"""What a commissioning report says, as data: the page, the CSV files and the workbook read the same."""

from __future__ import annotations

from dataclasses import dataclass, field
from decimal import Decimal
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from pidcfg.diagnostics import Diagnostic
    from pidcfg.pictures.chart import Chart

Value = str | int | float | Decimal | bool | None
"""What a cell holds: numbers stay numbers until they are written."""
Owner = Literal["setting", "request", "status", "reserved"]
"""Who owns a word or bit: the engineer, a momentary request, the controller, nobody."""


@dataclass(frozen=True, slots=True)
class Title:
    """The title block; nothing in it comes from the clock or the computer."""

    title: str
    project: str | None = None
    customer: str | None = None
    plant: str | None = None
    document: str | None = None
    revision: str | None = None
    author: str | None = None
    date: str | None = None
    version: str = ""
    """Of pidcfg."""


@dataclass(frozen=True, slots=True)
class SourceFile:
    """A file that the report was made from."""

    name: str
    kind: str
    size: int
    """In bytes."""
    sha256: str


@dataclass(frozen=True, slots=True)
class Setting:
    """A value of a configuration in engineering units."""

    path: str
    value: Value
    unit: str
    meaning: str
    given: bool
    """Whether the file says it; otherwise it is the default."""
    place: str = ""
    """Where the PLC holds it."""


@dataclass(frozen=True, slots=True)
class Group:
    """Settings of one section of a configuration."""

    key: str
    title: str
    settings: tuple[Setting, ...]


@dataclass(frozen=True, slots=True)
class Bit:
    """One choice inside a bit word."""

    bits: str
    state: str
    value: str
    meaning: str
    owner: Owner


@dataclass(frozen=True, slots=True)
class Register:
    """A register with its content; a run of reserved ones stands as one."""

    address: str
    name: str
    hex: str
    decimal: Value
    value: Value
    unit: str
    meaning: str
    owner: Owner
    bits: tuple[Bit, ...] = ()
    by: str = ""
    """Who writes it, where it is no setting."""


@dataclass(frozen=True, slots=True)
class Block:
    """Registers that stand together."""

    title: str
    registers: tuple[Register, ...]


@dataclass(frozen=True, slots=True)
class Parameter:
    """A named parameter with its content, or the expression that it is wired to."""

    name: str
    type: str
    content: str
    unit: str
    meaning: str
    device: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Sheet:
    """What a loop and a PLC have in common."""

    name: str
    description: str
    anchor: str
    groups: tuple[Group, ...] = ()
    blocks: tuple[Block, ...] = ()
    parameters: tuple[Parameter, ...] = ()
    outside: tuple[tuple[str, str], ...] = ()
    """What no register holds."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LoopSheet(Sheet):
    """Everything about one loop of a configuration."""

    facts: tuple[tuple[str, str], ...]
    """What a reader wants to see first: mode, action, set point, the three terms."""
    findings: tuple[Diagnostic, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class PlcSheet(Sheet):
    """One configuration: what holds for the PLC, and its loops."""

    file: str
    vendor: str
    checklist: tuple[str, ...] = ()
    loops: tuple[LoopSheet, ...] = ()


@dataclass(frozen=True, slots=True)
class Happening:
    """Something of a run: an event, an alarm, a mode, a remark."""

    at: float
    loop: str
    kind: str
    text: str
    until: float | None = None
    error: bool = False


@dataclass(frozen=True, slots=True)
class Expectation:
    """What was expected of a run, and what came."""

    text: str
    passed: bool
    value: str


@dataclass(frozen=True, slots=True)
class StandingRow:
    """A standing expectation of a run: what is expected of every loop, whether the scenario says so or not."""

    loop: str
    """Empty: the PLC."""
    kind: str
    verdict: str
    """``passed``, ``FAILED``, ``allowed``, or ``not judged``."""
    at: float | None
    """Since when, in s."""
    text: str


@dataclass(frozen=True, slots=True)
class RunSheet:
    """One scenario's run; without facts it could not run, and the findings say why."""

    file: str
    config: str
    anchor: str
    title: str
    ran: bool
    passed: bool
    verdict: str
    facts: tuple[tuple[str, str], ...] = ()
    happenings: tuple[Happening, ...] = ()
    unlisted: int = 0
    """Changes of modes and alarms that the run has counted only."""
    metrics: Mapping[str, Mapping[str, float | None]] = field(default_factory=dict)
    metric_titles: Mapping[str, str] = field(default_factory=dict)
    """The columns of the metrics; those of swings only where a loop swings."""
    before_root: tuple[tuple[str, str], ...] = ()
    """Loops that take the root of their PV, and what their signals are."""
    signals: tuple[tuple[str, float, float, float], ...] = ()
    flags: tuple[tuple[str, str], ...] = ()
    """Loops and the flags that were on at any time."""
    autotunes: tuple[tuple[str, str, tuple[tuple[str, float], ...]], ...] = ()
    """Loop, status and the gains found."""
    expectations: tuple[Expectation, ...] = ()
    standing: tuple[StandingRow, ...] = ()
    in_control: Mapping[str, float] = field(default_factory=dict)
    """How long each loop was in Auto or Cascade, in s."""
    duration: float = 0.0
    """In s."""
    charts: Sequence[Chart] = ()

    def count(self, verdict: str) -> int:
        """How many standing expectations have this verdict."""
        return sum(row.verdict == verdict for row in self.standing)

    @property
    def judged(self) -> int:
        """How many standing expectations are judged."""
        return len(self.standing) - self.count("not judged")

    @property
    def remarkable(self) -> tuple[tuple[str, str, tuple[str, ...], float | None, str], ...]:
        """What does not simply hold: verdict, loop, kinds for the same reason, since when, why."""
        rows: dict[tuple[str, str, float | None, str], list[str]] = {}
        for row in self.standing:
            if row.verdict != "passed":
                rows.setdefault((row.verdict, row.loop, row.at, row.text), []).append(row.kind)
        return tuple(
            (verdict, loop, self._in_short(kinds), at, why) for (verdict, loop, at, why), kinds in rows.items()
        )

    @property
    def left_out(self) -> tuple[tuple[str, tuple[str, ...]], ...]:
        """Loops with standing expectations that are not judged, and which."""
        rows: dict[str, list[str]] = {}
        for row in self.standing:
            if row.verdict == "not judged":
                rows.setdefault(row.loop, []).append(row.kind)
        return tuple((loop, self._in_short(kinds)) for loop, kinds in rows.items())

    def _in_short(self, kinds: Sequence[str]) -> tuple[str, ...]:
        """Kinds of a loop; all of them are the loop as a whole."""
        return tuple(kinds) if len(kinds) < len({row.kind for row in self.standing}) else ("as a whole",)


@dataclass(frozen=True, slots=True)
class Content:
    """The whole report."""

    title: Title
    files: tuple[SourceFile, ...]
    plcs: tuple[PlcSheet, ...]
    runs: tuple[RunSheet, ...]
    findings: tuple[Diagnostic, ...]

    @property
    def loops(self) -> tuple[tuple[PlcSheet, LoopSheet], ...]:
        """Every loop with its configuration."""
        return tuple((plc, loop) for plc in self.plcs for loop in plc.loops)

    @property
    def vendors(self) -> tuple[str, ...]:
        """The PLC families."""
        return tuple(dict.fromkeys(plc.vendor for plc in self.plcs))

    @property
    def verdicts(self) -> tuple[int, int]:
        """Expectations that hold, and all."""
        every = [expectation for run in self.runs for expectation in run.expectations]
        return sum(expectation.passed for expectation in every), len(every)

    @property
    def standing(self) -> dict[str, int]:
        """How many standing expectations have which verdict."""
        return {
            word: sum(run.count(word) for run in self.runs) for word in ("passed", "FAILED", "allowed", "not judged")
        }
