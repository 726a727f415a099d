"""What the neutral form does not say of named parameters, as the vendor's own words say it: wires, blocks, signals.

Compared within one vendor only. A parameter that became a neutral field is compared there; a wire is compared here,
too, unless its neutral field differs already.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from pidcfg.encoders.parameters import Program

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from pidcfg.conversion.ledger import Neutral

SIGNALS = "signals"
"""Where values that belong to no block are listed."""
NAMES = frozenset(("loop", "block", "description"))
"""Settings that are no difference, or one of the neutral form."""


@dataclass(frozen=True, slots=True)
class Own:
    """The parameters of one side: by owner and key, and the neutral fields that each became, with their loop."""

    words: Mapping[str, Mapping[str, Any]]
    became: Mapping[tuple[str, str], frozenset[tuple[int, str]]]

    def differs(self, other: Own, one: str, two: str) -> Iterator[tuple[str, Any, Any]]:
        """Keys of two owners that differ, with both contents."""
        mine, theirs = self.words.get(one, {}), other.words.get(two, {})
        yield from (
            (key, mine.get(key), theirs.get(key)) for key in {**mine, **theirs} if mine.get(key) != theirs.get(key)
        )

    def became_differently(self, owner: str, key: str, reported: Sequence[frozenset[str]]) -> bool | None:
        """Whether a neutral field that a parameter became is ``reported`` (by loop); None: it became none."""
        fields = self.became.get((owner, key))
        if not fields:
            return None
        return any(
            name == field or name.startswith(f"{field}.") or field.startswith(f"{name}.")
            for i, field in fields
            for name in reported[i]
        )


def own_of(image: object, names: Sequence[str], loops: Sequence[Neutral]) -> Own | None:
    """The named parameters of an image; None: it has registers, which the neutral form has to explain."""
    if not isinstance(image, Program):
        return None
    words: dict[str, dict[str, Any]] = {name: {} for name in names}
    for entry in image.settings:
        name = entry.get("loop") or entry.get("block") or ""
        told = name in names and not loops[names.index(name)].missing
        words[name] = {key: value for key, value in entry.items() if key not in NAMES and (key == "type" or not told)}
    for address, content in image.words.items():
        owner = _owner(address, words)
        words.setdefault(owner, {})[address.removeprefix(f"{owner}.")] = content
    became: dict[tuple[str, str], frozenset[tuple[int, str]]] = {}
    for i, loop in enumerate(loops):
        for said in loop.said:
            place = _place(said.field, names[i], words)
            became[place] = became.get(place, frozenset()) | {(i, name) for name in said.to}
    return Own(words, became)


def _owner(address: str, words: Mapping[str, object]) -> str:
    """The block that a parameter belongs to: the longest name that it begins with."""
    owner = address
    while "." in owner:
        owner = owner.rpartition(".")[0]
        if owner in words:
            return owner
    return SIGNALS


def _place(field: str, loop: str, words: Mapping[str, Mapping[str, Any]]) -> tuple[str, str]:
    """The owner and key of a field, which may be that of a block: ``blocks.FILTER.Tc``."""
    _, _, rest = field.partition(".")
    owner, _, key = rest.partition(".")
    return (owner, key) if key and owner in words else (loop, field)


def is_own(field: str, loop: str, own: Own) -> bool:
    """Whether a field that no neutral field covers is compared here."""
    owner, key = _place(field, loop, own.words)
    _, _, rest = field.partition(".")
    return key in own.words.get(owner, {}) or rest in own.words or rest in own.words.get(SIGNALS, {})
