"""What a commissioning report says, as data: the page, the CSV files and the workbook read the same."""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.diagnostics import Diagnostic
    from pidcfg.report.run_content import RunSheet

Value = str | int | float | Decimal | bool | None
"""What a cell holds: numbers stay numbers until they are written."""
Owner = Literal["setting", "request", "status", "reserved"]
"""Who owns a word or bit: the engineer, a momentary request, the controller, nobody."""
COMPARED = {"setting", "request"}
"""Whose contents are those of the configuration as long as nobody changes them."""


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
    counted: bool = True
    """Whether its decimal number says something: not of BCD digits, bits and addresses."""


@dataclass(frozen=True, slots=True)
class Block:
    """Registers that stand together."""

    title: str
    registers: tuple[Register, ...]


def contents_of(blocks: Sequence[Block]) -> dict[str, str]:
    """What an engineer compares with the PLC, by address: four digits where words are BCD, numbers elsewhere."""
    rows = [register for block in blocks for register in block.registers]
    digits = not all(row.counted for row in rows)
    return {row.address: row.hex if digits else f"{row.decimal:g}" for row in rows if row.owner in COMPARED}


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
    anchor: str = ""
    """What links lead to: known once its place in the report is."""
    groups: tuple[Group, ...] = ()
    blocks: tuple[Block, ...] = ()
    parameters: tuple[Parameter, ...] = ()
    outside: tuple[tuple[str, str], ...] = ()
    """What no register holds."""


@dataclass(frozen=True, slots=True)
class Fact:
    """Something that a reader looks for first; ``place``: where the PLC holds it, with what stands there."""

    title: str
    text: str
    place: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class LoopSheet(Sheet):
    """Everything about one loop of a configuration."""

    facts: tuple[Fact, ...]
    """Mode, ranges, direction, set point, the three terms, pulses."""
    findings: tuple[Diagnostic, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class PlcSheet(Sheet):
    """One configuration: what holds for the PLC, and its loops."""

    file: str
    vendor: str
    checklist: tuple[str, ...] = ()
    loops: tuple[LoopSheet, ...] = ()


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
