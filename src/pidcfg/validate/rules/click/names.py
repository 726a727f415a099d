"""Names of loops as the beginning of nicknames."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

from pidcfg.encoders.maps.click import SUFFIXES
from pidcfg.refs import Decision
from pidcfg.validate.rule import Findings, per_loop, warning

if TYPE_CHECKING:
    from pidcfg.validate.rules.click.context import ClickContext, LoopView

D131 = Decision(
    131,
    "what the PLC accepts as a nickname",
    "At most 24 characters, no underscore at the beginning, none of % \" < > ! # $ & ' ( ) * + - . / : ; = ? @ [ \\ ] "
    "^ ` { | } ~ and nothing but ASCII anywhere; capital and small letters are one. A name that breaks "
    "this is a warning.",
    "The topic is silent; these are the limits of the programming software as pyclickplc, which writes its files, "
    "knows them. Registers need no nickname, so the loop itself works.",
)

LONGEST = 24
FORBIDDEN = frozenset("%\"<>!#$&'()*+-./:;=?@[\\]^`{|}~")
LEAST_LEFT = LONGEST - max(map(len, SUFFIXES.values()))
"""How long a name may be so that every nickname fits."""


@cache
def by_length() -> tuple[str, ...]:
    """The suffixes, the longest first."""
    return tuple(sorted(SUFFIXES.values(), key=lambda suffix: (-len(suffix), suffix)))


@per_loop
@warning(
    "CK305",
    D131,
    "the name has {length} characters: {count} of its nicknames would have more than 24, as {example} with {longest}",
)
def nickname_too_long(view: LoopView) -> Findings:
    """The name of a loop is too long for its nicknames.

    Why: a nickname is the loop's name and a suffix such as `_SEL_DirectReverse`, and may have 24 characters. The
    software refuses longer ones, or two that are cut off become the same.

    Fix: choose a name of at most 6 characters.
    """
    name = view.name
    too_long = [suffix for suffix in by_length() if len(name) + len(suffix) > LONGEST]
    if too_long:
        example = name[:LEAST_LEFT] + "…" if len(name) > LONGEST else name
        yield view.at(
            "name",
            length=len(name),
            count=len(too_long),
            example=example + too_long[0],
            longest=len(name) + len(too_long[0]),
        )


@per_loop
@warning("CK306", D131, "nicknames cannot be made of {name}: {reason}")
def name_not_usable_in_nicknames(view: LoopView) -> Findings:
    """The name of a loop has characters that the PLC does not allow in nicknames.

    Why: tags such as FIC-101 are common on drawings, but a nickname may contain none of - . / #, and may not begin with
    an underscore. The software refuses the whole list of nicknames.

    Fix: write the tag with letters, digits, blanks and underscores: `FIC101`. The tag on the drawing can stand in
    `description`.
    """
    name = view.name
    wrong = sorted(c for c in set(name) if c in FORBIDDEN or not c.isascii())
    if wrong:
        yield view.at("name", name=name, reason=f"{' '.join(wrong)} {'is' if len(wrong) == 1 else 'are'} refused")
    elif name.startswith("_"):
        yield view.at("name", name=name, reason="it begins with an underscore")


@warning("CK307", D131, "{mine} of this loop and {theirs} of loop {other} are one nickname")
def nicknames_collide(context: ClickContext) -> Findings:
    """Two loops have nicknames that are the same for the PLC.

    Why: it does not tell capital from small letters, so `Oven` and `OVEN` have all nicknames in common; and `T1_EN` has
    a nickname of `T1`. A list of nicknames with one twice is refused.

    Fix: rename one of the loops.
    """
    owners: dict[str, dict[str, str]] = {}
    for view in context.loops:
        for suffix in SUFFIXES.values():
            nickname = view.name + suffix
            owners.setdefault(nickname.lower(), {})[view.name] = nickname
    for view in context.loops:
        shared = (owners[(view.name + suffix).lower()] for suffix in SUFFIXES.values())
        pairs = {other: (group[view.name], group[other]) for group in shared for other in group if other != view.name}
        for other, (mine, theirs) in pairs.items():
            yield view.at("name", mine=mine, theirs=theirs, other=other).shared_with(other)
