"""The one key that a misspelt key can stand for; no valid key of any vendor is ever replaced by another."""

from __future__ import annotations

import re
from functools import cache
from typing import TYPE_CHECKING, Any, get_args

from pidcfg.schemas.names import folded, spoken

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from pydantic import BaseModel

WORDS = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+")
"""The words of a key: ``ControlON_OFF`` has three."""
LETTERS = 5
"""A word has so many before and after its slip: in shorter ones (``MaxMV``, ``MinMV``) one letter is a meaning."""
APART = 2
"""No other key of the place may be so near."""


def clear_match(key: str, known: Sequence[str]) -> str | None:
    """The only key that a misspelt one can stand for, or None.

    It differs from what is written in capitals, hyphens and underscores alone, or by one slip inside a long word with
    every other key of the place clearly further. A valid key of any vendor is never replaced.
    """
    same = [name for name in known if folded(name) == folded(key)]
    if same:
        return same[0] if len(same) == 1 and key not in all_keys() else None
    near = [name for name in known if is_slip(key, name)]
    if len(near) != 1 or any(slips(key, name) <= APART for name in known if name != near[0]):
        return None
    others = (name for name in all_keys() if name != near[0])
    return None if any(folded(name) == folded(key) or is_slip(key, name) for name in others) else near[0]


INSIDE, SETTABLE = "set", ("setpoint", "output")
"""The key of an event that takes settings by their names."""


def spoken_of(key: str, model: type[BaseModel]) -> str | None:
    """The key that a word of the field stands for at a place, or that stands one level below it; None: there is none.

    Only for the cure: whether the number means the same there (a time, a gain) is the writer's to say.
    """
    known = keys_of(model)
    below = [f"{name}: {{{key}: …}}" for name, inner in _inner(model) if key in keys_of(inner)]
    if below:
        return " or ".join(dict.fromkeys(below))
    events = [f"{INSIDE}: {{{name}: …}}" for name in SETTABLE] if {INSIDE, "at"} <= {*known} else []
    return spoken(key, [*known, *events]) or next((n for n in known if _words(n) == _words(key)), None)


def _words(key: str) -> list[str]:
    """The words of a key in an order of their own: people turn ``freeze_bias`` round."""
    return sorted(key.casefold().split("_"))


def places_of(key: str, root: type[BaseModel]) -> list[str]:
    """The only keys of a file below which a key is known, in words; empty: none, or more than one."""
    found = _places(root).get(key, ())
    return sorted(found) if len(found) == 1 else []


@cache
def _places(root: type[BaseModel]) -> Mapping[str, set[str]]:
    """The keys of a file by what stands below them."""
    places: dict[str, set[str]] = {}
    for name, inner in _below(root):
        for key in keys_of(inner):
            places.setdefault(key, set()).add(name)
    return places


def _below(root: type[BaseModel]) -> Iterator[tuple[str, type[BaseModel]]]:
    """The models inside of a model with the keys that they are the values of; at each place once."""
    waiting = [root]
    seen: set[type[BaseModel]] = set()
    while waiting:
        model = waiting.pop()
        seen.add(model)
        for name, field in model.model_fields.items():
            for inner in models_in(field.annotation):
                yield field.alias or name, inner
                waiting += [inner] if inner not in seen else []


@cache
def _inner(model: type[BaseModel]) -> tuple[tuple[str, type[BaseModel]], ...]:
    """The mappings inside of a model, by their keys; lists are none."""
    fields = [(field.alias or name, field.annotation) for name, field in model.model_fields.items()]
    return tuple((name, inner) for name, kind in fields if "tuple" not in str(kind) for inner in models_in(kind))


def is_slip(key: str, name: str) -> bool:
    """Whether a key is a name with one letter of a long word wrong, left out, doubled, or swapped with the next.

    A letter that is missing at an end of a word is none: ``limit`` and ``limits`` are two words.
    """
    longer = len(key) - len(name)
    at = next((i for i, (a, b) in enumerate(zip(key, name, strict=False)) if a != b), min(len(key), len(name)))
    if longer == 0 and at < len(name) and key[at].isalpha():
        swapped = key[at : at + 2] == name[at + 1 : at + 2] + name[at] and key[at + 2 :] == name[at + 2 :]
        wrong = key[at + 1 :] == name[at + 1 :]
        return (wrong and _in_word(name, at, at, LETTERS)) or (swapped and _in_word(name, at, at + 1, LETTERS))
    if longer == -1:
        return key[at:] == name[at + 1 :] and _in_word(name, at - 1, at + 1, LETTERS + 1)
    doubled = longer == 1 and at > 0 and key[at] == key[at - 1]
    return doubled and key[at + 1 :] == name[at:] and _in_word(name, at - 1, at - 1, LETTERS)


def _in_word(name: str, first: int, last: int, letters: int) -> bool:
    """Whether places of a name lie in one word of so many letters."""
    words = (match.span() for match in WORDS.finditer(name))
    return any(begin <= first and last < end and end - begin >= letters for begin, end in words)


@cache
def all_keys() -> frozenset[str]:
    """Every key of every vendor's files, and of scenarios, at every level."""
    from pidcfg.schemas.scenario import Scenario
    from pidcfg.vendors import VENDORS

    roots: list[type[BaseModel]] = [Scenario, *(vendor.model for vendor in VENDORS.values())]
    return frozenset(key for model in models_below(roots) for key in keys_of(model))


def models_below(roots: Sequence[type[BaseModel]]) -> Iterator[type[BaseModel]]:
    """Models with all that are inside of them, each once."""
    waiting, seen = list(roots), set()
    while waiting:
        model = waiting.pop()
        if model not in seen:
            seen.add(model)
            waiting += [inner for field in model.model_fields.values() for inner in models_in(field.annotation)]
            yield model


def models_in(annotation: Any) -> list[type[BaseModel]]:
    """The models inside an annotation such as ``tuple[Loop, ...] | None``."""
    from pydantic import BaseModel

    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [model for inner in get_args(annotation) for model in models_in(inner)]


def keys_of(model: type[BaseModel]) -> list[str]:
    """The keys of a model as files have them."""
    return [field.alias or name for name, field in model.model_fields.items()]


def slips(one: str, other: str) -> int:
    """How many letters were left out, added, changed or swapped with their neighbour."""
    last: list[int] = []
    row = list(range(len(other) + 1))
    for i, a in enumerate(one, start=1):
        before, last, row = last, row, [i]
        for j, b in enumerate(other, start=1):
            best = min(last[j] + 1, row[j - 1] + 1, last[j - 1] + (a != b))
            if i > 1 and j > 1 and a == other[j - 2] and b == one[i - 2]:
                best = min(best, before[j - 2] + 1)
            row.append(best)
    return row[-1]
