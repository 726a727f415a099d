"""Which loops of two sides belong together: by name, then as renamed ones; and which of them moved."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from pidcfg.refs import Decision

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from pidcfg.differences.terms import Owner

D346 = Decision(
    346,
    "a loop with another name at the same place is the same loop",
    "A loop is renamed when its registers begin where they did (in a vendor without addresses: when it has the same "
    "position) and at least half of what it has set is the same, or when all of it is the same elsewhere. Otherwise "
    "one loop was removed and another one added.",
    "A name is changed in an afternoon, and the gains with it; a loop of which most differs is another loop.",
)

ALIKE = 0.5
"""The share of what is set that must be the same for a loop at the same place to be the same one."""

Pair = tuple["Owner | None", "Owner | None"]


def pairs_of(before: Sequence[Owner], after: Sequence[Owner]) -> list[Pair]:
    """Owners that belong together, in the order of the second side, what was removed behind the one it followed."""
    named = dict(zip(_keys(before), before, strict=True))
    partners = {id(two): named[key] for key, two in zip(_keys(after), after, strict=True) if key in named}
    for is_same in (_same_place, _same_content):
        _rename(before, after, partners, is_same)
    pairs: list[Pair] = [(partners.get(id(two)), two) for two in after]
    found = {id(one) for one in partners.values()}
    for i, one in enumerate(before):
        if id(one) not in found:
            at = next((k for k, pair in enumerate(pairs) if i and pair[0] is before[i - 1]), len(pairs) - 1)
            pairs.insert(at + 1, (one, None))
    return pairs


def _rename(
    before: Sequence[Owner],
    after: Sequence[Owner],
    partners: dict[int, Owner],
    is_same: Callable[[Owner, Owner, int, int], bool],
) -> None:
    """Adds pairs of loops that have no partner yet."""
    for j, two in enumerate(after):
        taken = {id(one) for one in partners.values()}
        free = ((i, one) for i, one in enumerate(before) if id(one) not in taken and one.kind == two.kind)
        if id(two) not in partners:
            one = next((one for i, one in free if is_same(one, two, i, j)), None)
            if one is not None:
                partners[id(two)] = one


def _keys(owners: Sequence[Owner]) -> list[tuple[str, str, int]]:
    """What owners are called; of several with one name the first belongs to the first of the other side, and so on."""
    seen: Counter[tuple[str, str]] = Counter()
    keys: list[tuple[str, str, int]] = []
    for owner in owners:
        seen[owner.kind, owner.name] += 1
        keys.append((owner.kind, owner.name, seen[owner.kind, owner.name]))
    return keys


def _same_place(one: Owner, two: Owner, i: int, j: int) -> bool:
    """At the same address, or position, and much alike."""
    at_place = one.place == two.place if one.place or two.place else i == j
    return at_place and likeness(one, two) >= ALIKE


def _same_content(one: Owner, two: Owner, i: int, j: int) -> bool:
    del i, j
    return likeness(one, two) == 1


def likeness(one: Owner, two: Owner) -> float:
    """The share of settings that are the same, of those that one of two loops has set."""
    keys = [key for key in {**one.items, **two.items} if _is_set(one, key) or _is_set(two, key)]
    same = sum(1 for key in keys if _content(one, key) == _content(two, key))
    return same / len(keys) if keys else 1.0


def _content(owner: Owner, key: str) -> object:
    item = owner.items.get(key)
    return None if item is None else item.content


def _is_set(owner: Owner, key: str) -> bool:
    """Whether a setting that is not about the place is something other than nothing."""
    item = owner.items.get(key)
    return item is not None and item.kind == "setting" and bool(item.content) and not is_place(item.value, owner)


def is_place(value: object, owner: Owner) -> bool:
    """Whether a value is where the registers of a loop begin."""
    return isinstance(value, str) and value in owner.place.split()


def moved(pairs: Sequence[Pair]) -> Iterator[tuple[Owner, tuple[str, str]]]:
    """Loops of the second side that have another place than on the first, with both places.

    That is where its registers begin; where a vendor gives loops no addresses, its number, if its order has changed.
    """
    both = [(one, two) for one, two in pairs if one is not None and two is not None and two.kind == "loop"]
    for one, two in both:
        if one.place != two.place:
            yield two, (one.place, two.place)
    bare = [(one, two) for one, two in both if not (one.place or two.place)]
    numbers = [one.number for one, _ in bare]
    kept = _longest_rise(numbers)
    for i, (one, two) in enumerate(bare):
        if i not in kept:
            yield two, (f"loop {one.number}", f"loop {two.number}")


def _longest_rise(numbers: Sequence[int]) -> frozenset[int]:
    """The places of as many numbers as possible of which each is larger than the one before."""
    rises: list[tuple[int, ...]] = [()]
    for i, number in enumerate(numbers):
        below = [rise for rise in rises if not rise or numbers[rise[-1]] < number]
        rises.append((*max(below, key=len), i))
    longest = max(rises, key=len)
    return frozenset(longest)
