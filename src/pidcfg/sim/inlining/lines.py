"""Lines of the text that is being written, and what stands among them until all fields are known."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from pidcfg.sim.inlining.facts import Record, Records


@dataclass(slots=True)
class Block:
    """A statement with a body: ``if``, ``else``, ``while``, ``for``."""

    head: str
    body: Lines


@dataclass(frozen=True, slots=True)
class Leave:
    """The end of a piece that was put in the place of a call, or of a turn of a loop that is written out."""

    piece: object


@dataclass(frozen=True, slots=True)
class Sync:
    """Fields from their local variables into the records (``store``), or from the records."""

    touched: Sequence[Record | Records] | None
    """None: all."""
    fields: frozenset[str] | None
    store: bool


Line = str | Block | Leave | Sync
Lines = list[Line]


def leaves(lines: Lines, piece: object) -> bool:
    """Whether a piece is left anywhere in the lines."""
    return any(
        leaves(line.body, piece) if isinstance(line, Block) else isinstance(line, Leave) and line.piece is piece
        for line in lines
    )


def ends(lines: Lines) -> bool:
    """Whether what follows the lines is never reached."""
    return bool(lines) and (isinstance(lines[-1], Leave) or lines[-1] in ("break", "continue"))


def drop_last_leaves(lines: Lines, piece: object) -> None:
    """Takes out where the end of a piece leaves it, since there it ends anyway."""
    if not lines:
        return
    last = lines[-1]
    if isinstance(last, Leave) and last.piece is piece:
        lines.pop()
        return
    for branch in lines[-2:] if isinstance(last, Block) and last.head == "else:" else [last]:
        if isinstance(branch, Block) and branch.head.startswith(("if ", "else:")):
            drop_last_leaves(branch.body, piece)


def once(lines: Lines, piece: object) -> Lines:
    """The lines of a piece, in a loop of one turn if they leave it before their end."""
    drop_last_leaves(lines, piece)
    return [Block("while True:", [*lines, "break"])] if leaves(lines, piece) else lines


@dataclass(slots=True)
class Fields:
    """The fields of records that live in local variables while the kernel runs."""

    names: dict[tuple[Record, str], str] = field(default_factory=dict)
    stored: set[tuple[Record, str]] = field(default_factory=set)
    held: dict[Record, None] = field(default_factory=dict)
    """The records that the text names."""

    def name(self, record: Record, attr: str) -> str:
        """The variable of a field."""
        self.held[record] = None
        return self.names.setdefault((record, attr), f"{record.name}_{attr}")

    def lines(self, sync: Sync) -> Iterator[str]:
        """What a `Sync` stands for."""
        for (record, attr), name in self.names.items():
            if sync.fields is not None and attr not in sync.fields:
                continue
            if sync.touched is not None and record not in sync.touched and record.records not in sync.touched:
                continue
            if not sync.store:
                yield f"{name} = {record.name}.{attr}"
            elif (record, attr) in self.stored:
                yield f"{record.name}.{attr} = {name}"


def rendered(lines: Lines, fields: Fields, indent: str = "    ") -> Iterator[str]:
    """The lines as text."""
    for line in lines:
        if isinstance(line, Block):
            yield indent + line.head
            body = list(rendered(line.body, fields, indent + "    "))
            yield from body or [f"{indent}    pass"]
        elif isinstance(line, Sync):
            yield from (indent + text for text in fields.lines(line))
        else:
            yield indent + ("break" if isinstance(line, Leave) else line)
