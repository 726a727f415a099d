"""Parameters of a vendor that names them, blocks and signals: what the neutral form does not say of them.

Compared within one vendor only. A parameter that became a neutral field is compared there; a wire is compared here,
too, unless its neutral field differs already.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from pidcfg.conversion.ledger import overlap
from pidcfg.conversion.values import shown
from pidcfg.differences.result import Compared, Difference, ranked
from pidcfg.encoders.parameters import Program
from pidcfg.schemas.iec import Wire

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from pidcfg.conversion.ledger import NeutralLoop

SIGNALS = "signals"
"""Where values that belong to no block are listed."""
NAMES = frozenset(("loop", "block", "description"))
"""Settings that are no difference, or one of the neutral form."""


@dataclass(frozen=True, slots=True)
class Parameters:
    """The parameters of one side by owner (a loop, a block, the signals) and key, with what each became."""

    contents: Mapping[str, Mapping[str, Any]]
    neutral: Mapping[tuple[str, str], frozenset[tuple[int, str]]]
    """The neutral fields that a parameter became, each with the number of its loop."""

    def differs(self, owner: str, key: str, reported: Sequence[frozenset[str]]) -> bool | None:
        """Whether a neutral field that a parameter became is ``reported`` (by loop); None: it became none."""
        fields = self.neutral.get((owner, key))
        if not fields:
            return None
        return any(overlap(name, field) for i, field in fields for name in reported[i])

    def has(self, loop: str, field: str) -> bool:
        """Whether a field of a loop that became no neutral field is one of these parameters."""
        owner, key = _owner_and_key(field, loop, self.contents)
        name = field.partition(".")[2]
        return key in self.contents.get(owner, {}) or name in self.contents or name in self.contents.get(SIGNALS, {})


def parameters_of(image: object, names: Sequence[str], loops: Sequence[NeutralLoop]) -> Parameters | None:
    """The named parameters of an image; None: it has registers, which the neutral form has to explain."""
    if not isinstance(image, Program):
        return None
    contents: dict[str, dict[str, Any]] = {name: {} for name in names}
    for entry in image.settings:
        name = entry.get("loop") or entry.get("block") or ""
        is_neutral = name in names and not loops[names.index(name)].missing
        contents[name] = {k: v for k, v in entry.items() if k not in NAMES and (k == "type" or not is_neutral)}
    for address, content in image.words.items():
        owner = _owner(address, contents)
        contents.setdefault(owner, {})[address.removeprefix(f"{owner}.")] = content
    neutral: dict[tuple[str, str], frozenset[tuple[int, str]]] = {}
    for i, loop in enumerate(loops):
        for field in loop.fields:
            place = _owner_and_key(field.path, names[i], contents)
            neutral[place] = neutral.get(place, frozenset()) | {(i, name) for name in field.to}
    return Parameters(contents, neutral)


def _owner(address: str, owners: Mapping[str, object]) -> str:
    """The block that a parameter belongs to: the longest name that it begins with."""
    owner = address
    while "." in owner:
        owner = owner.rpartition(".")[0]
        if owner in owners:
            return owner
    return SIGNALS


def _owner_and_key(field: str, loop: str, owners: Mapping[str, object]) -> tuple[str, str]:
    """Of a field, which may be that of a block: ``blocks.FILTER.Tc``."""
    owner, _, key = field.partition(".")[2].partition(".")
    return (owner, key) if key and owner in owners else (loop, field)


class ParameterComparison:
    """The parameters of both sides, beside the neutral differences of their loops.

    ``reported``: by side and loop, the neutral fields that differ.
    """

    def __init__(
        self, before: Parameters, after: Parameters, reported: tuple[list[frozenset[str]], list[frozenset[str]]]
    ) -> None:
        self.before, self.after, self.reported = before, after, reported

    def of_owner(self, one: str, two: str, *, in_both: bool = False) -> Iterator[Difference]:
        """The differences of two loops, blocks or of the signals.

        ``in_both``: one of two loops has a neutral form, so that what only the other one lists is no difference.
        """
        before, after = self.before.contents.get(one, {}), self.after.contents.get(two, {})
        for key in {**before, **after}:
            a, b = before.get(key), after.get(key)
            if a == b or (in_both and (a is None or b is None)):
                continue
            differs = {
                self.before.differs(one, key, self.reported[0]),
                self.after.differs(two, key, self.reported[1]),
            }
            is_wired = isinstance(a, Wire) or isinstance(b, Wire)
            if True not in differs and (False not in differs or is_wired):
                yield Difference(key, "medium", _text(a), _text(b))

    def has(self, one: str, two: str, field: str) -> bool:
        """Whether a field of two loops is compared here."""
        return self.before.has(one, field) or self.after.has(two, field)

    def of_others(self, loops: Sequence[str]) -> list[Compared]:
        """Blocks and signals that differ, come or go: whatever is none of these loops."""
        before, after = self.before.contents, self.after.contents
        rows = []
        for name in {**before, **after}:
            if name in loops:
                continue
            if name != SIGNALS and (name not in before or name not in after):
                rows.append(Compared(name, "added" if name in after else "removed"))
            else:
                rows.append(ranked(name, self.of_owner(name, name)))
        return [row for row in rows if row.status != "same"]


def _text(content: Any) -> Any:
    return content.text if isinstance(content, Wire) else shown(content)
