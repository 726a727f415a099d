"""What became of every field: the two halves of a conversion, and the report that they make together.

An adapter's `to_neutral` says of each field of its vendor which neutral fields it went to (`Said`), its `from_neutral`
of each neutral field where it was put (`Put`). `changes` joins them: a field that went nowhere is dropped, and nobody
can forget one without a test noticing.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping
    from decimal import Decimal

    from pidcfg.paths import Path

Kind = Literal["exact", "rounded", "clamped", "dropped", "assumed"]
WORST: tuple[Kind, ...] = ("exact", "rounded", "assumed", "clamped", "dropped")
"""From harmless to harmful."""
LOSSES = frozenset(("clamped", "dropped"))
"""What needs leave."""


@dataclass(frozen=True, slots=True)
class Said:
    """A field of the source: its path below the loop, its value as people write it, and the neutral fields it became.

    Without any it is dropped, and ``note`` says what to program by hand instead; ``assumed``: the file does not say it.
    """

    field: str
    value: Any
    to: tuple[str, ...] = ()
    note: str = ""
    assumed: bool = False


@dataclass(frozen=True, slots=True)
class Put:
    """A field of the target: its path below the loop (after ``/``: of the file), and the neutral field it came from.

    ``of`` None: nothing of the source says it, so it is assumed. An empty ``field``: the target has no such thing, the
    neutral field is dropped, and ``note`` says what to program by hand instead.
    """

    field: str
    of: str | None
    note: str = ""
    assumed: bool = False
    exact: Decimal | None = None
    """What was wanted, where the file holds less: a whole number, or a text with a unit that is rounded already."""
    clamped: bool = False
    """Brought within what the target allows by the adapter."""
    held: Decimal | None = None
    """What the file then means, in the unit of ``exact``, where its own number does not say it."""


@dataclass(frozen=True, slots=True)
class Missing:
    """What the source must say before it can be converted: the key to add, where, and why."""

    path: Path
    key: str
    message: str


@dataclass(slots=True)
class Neutral:
    """One loop on its way: its neutral data, and what each of its fields became."""

    loop: dict[str, Any]
    said: list[Said] = field(default_factory=list)
    missing: list[Missing] = field(default_factory=list)


@dataclass(slots=True)
class Target:
    """A vendor's file as plain data, and where the neutral fields of each loop were put."""

    data: dict[str, Any]
    puts: list[list[Put]]
    items: list[Path] = field(default_factory=list)
    """Where each loop stands in ``data``; as a rule ``("loops", i)``."""


@dataclass(frozen=True, slots=True)
class Change:
    """A line of the report."""

    field: str
    kind: Kind
    source: Any
    target: Any
    error_percent: float = 0.0
    note: str = ""


@dataclass(frozen=True, slots=True)
class Stored:
    """What the target holds of a field: the value in the file, and how it came to differ from what was wanted."""

    value: Any
    kind: Kind = "exact"
    error_percent: float = 0.0
    note: str = ""


CARRIED = ("name", "description")
"""What goes with every loop, without a word from the adapters."""


def changes(
    said: list[Said], puts: list[Put], stored: Mapping[str, Stored], idle: Callable[[str], bool] = lambda _: False
) -> Iterator[Change]:
    """Every field of the source, then what the target has beside them.

    ``idle`` tells of a neutral field whether it is what a loop is like without it: nothing is lost with it.
    """
    by_neutral: dict[str, list[Put]] = {}
    for put in puts:
        by_neutral.setdefault(put.of or "", []).append(put)
    for entry in said:
        if entry.field not in CARRIED or entry.field in by_neutral:
            yield from _of_field(entry, by_neutral, stored, idle)
    spoken = {name for entry in said for name in entry.to}
    for name, found in by_neutral.items():
        if not any(_same(name, other) for other in spoken):
            for put in found:
                if put.field and (put.assumed or not (name in CARRIED or (put.of is not None and idle(put.of)))):
                    held = stored.get(put.field, Stored(None))
                    note = "; ".join(text for text in (put.note, held.note) if text)
                    kind = _worst("assumed", held.kind, _own(put))
                    yield Change(put.field, kind, None, held.value, held.error_percent, note)


def _of_field(
    entry: Said, by_neutral: Mapping[str, list[Put]], stored: Mapping[str, Stored], idle: Callable[[str], bool]
) -> Iterator[Change]:
    if not entry.to:
        yield Change(entry.field, "dropped", entry.value, None, note=entry.note)
        return
    places = [put for name in entry.to for of, found in by_neutral.items() if _same(name, of) for put in found]
    if not places:
        kind: Kind = "exact" if all(idle(name) for name in entry.to) else "dropped"
        note = entry.note or ("" if kind == "exact" else "the target has no such field")
        yield Change(entry.field, kind, entry.value, None, note=note)
    for put in places:
        held = stored.get(put.field, Stored(None)) if put.field else Stored(None, "dropped")
        assumed: Kind = "assumed" if entry.assumed or put.assumed else "exact"
        note = "; ".join(text for text in (entry.note, put.note, held.note) if text)
        yield Change(
            entry.field, _worst(assumed, held.kind, _own(put)), entry.value, held.value, held.error_percent, note
        )


def _own(put: Put) -> Kind:
    return "clamped" if put.clamped else "exact"


def _same(name: str, other: str) -> bool:
    """Whether two neutral fields are one, or one is an end of the other: ``output.limits`` and ``output.limits.0``."""
    return name == other or f"{name}.".startswith(f"{other}.") or f"{other}.".startswith(f"{name}.")


def _worst(*kinds: Kind) -> Kind:
    return max(kinds, key=WORST.index)
