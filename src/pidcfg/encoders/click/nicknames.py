"""The nicknames of a loop's registers: a name each, its initial value, and a comment that says what it is."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from pidcfg.encoders.files import UnwritableError
from pidcfg.encoders.maps.click import BLOCKS, SPACE, SUFFIXES
from pidcfg.encoders.words import FLAG, Choice
from pidcfg.refs import Decision

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from pidcfg.encoders.image import Cell, Image
    from pidcfg.encoders.regmap import Word

D104 = Decision(
    104,
    "a nickname that CLICK would refuse is not written",
    "At most 24 characters, which are letters, digits, blanks and _ (ASCII), each nickname once whatever its case. "
    "A loop whose nicknames break this has no nickname CSV, and no shortened names; the message says what fits.",
    "A name cut to size would no longer say which register it is, and no import reports what it leaves out.",
)
D105 = Decision(
    105,
    "initial values go to settings only, and retention stays the bank's own",
    "Switches and registers that a configuration sets have its value as initial value; what the controller writes, "
    "requests and Cn+10 have a nickname and the initial value 0, which is how CLICK writes that there is none. DS and "
    "DF are retentive, C is not.",
    "An initial value in a request would start it, and one in a status would show what never was.",
)

D106 = Decision(
    106,
    "a nickname list of the user's keeps what it says",
    "A row whose address or nickname stands there with another partner is left as it is and reported. Where both agree "
    "the row is the loop's own: its initial value becomes the configuration's, and nothing else of it changes. A row "
    "with neither nickname nor comment nor initial value is nobody's, and becomes the loop's.",
    "A list that kept the old initial values of a loop would be written into the PLC as if they were the new ones. An "
    "export of all addresses has a row of each, used or not.",
)
D107 = Decision(
    107,
    "a loop is found by the nickname of its Cn+09",
    "In a nickname list a name is that of a loop when `<name>_SEL_DirectReverse` is one of its nicknames; the blocks "
    "begin where all its other nicknames say, and where they disagree the list is refused. A name without it, of which "
    "three nicknames or more agree on where a block begins, is told and not read.",
    "Short suffixes (_P, _SP) are common in nicknames that have nothing to do with a loop.",
)

LONGEST = 24
LONGEST_COMMENT = 128
LEGAL = frozenset("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_ ")
UNITS = {"s": "s", "%": "%"}


class Named(NamedTuple):
    """A register with a nickname of its own."""

    bank: str
    offset: int
    word: Word
    suffix: str


def _named() -> Iterator[Named]:
    for bank, table in BLOCKS.values():
        for word in table.words:
            # C alone has a reserved bit with a nickname; the other banks call registers by the same name
            if word.name in SUFFIXES and (word.access != "reserved" or bank == "C"):
                yield Named(bank, word.offset, word, SUFFIXES[word.name])


NAMED = tuple(_named())
BY_FIELD = {(row.bank, row.word.name): row for row in NAMED}
LONGEST_LOOP = LONGEST - max(len(row.suffix) for row in NAMED)
"""Characters of the longest loop name that all nicknames have room for."""
ACTION = BY_FIELD["C", "action"]


class Nickname(NamedTuple):
    """One row of a nickname list; ``value`` is empty where there is no initial value."""

    address: str
    nickname: str
    value: str
    comment: str


def nicknames(image: Image) -> list[Nickname]:
    """The nicknames of all loops in address order; raises `UnwritableError` for one that CLICK would refuse."""
    units = {entry["loop"]: entry for entry in image.settings}
    rows = []
    for cell in image.cells:
        bank, _ = SPACE.place(cell.number)
        named = BY_FIELD.get((bank.prefix, cell.field))
        if named is not None and cell.loop is not None:
            name = _legal(cell.loop, cell.loop + named.suffix)
            value = initial_value(cell) if cell.access == "setting" else ""
            rows.append(Nickname(cell.address, name, value, _comment(named.word, units.get(cell.loop, {}))))
    _once(rows)
    return rows


def _legal(loop: str, nickname: str) -> str:
    wrong = sorted(set(nickname) - LEGAL)
    if wrong:
        raise UnwritableError(
            f"loop {loop}: CLICK allows no {' '.join(map(repr, wrong))} in the nickname {nickname!r}; rename the loop "
            "with letters, digits, blanks and _"
        )
    if nickname.startswith("_"):
        raise UnwritableError(f"loop {loop}: the nickname {nickname!r} begins with _, which CLICK keeps for its own")
    if len(nickname) > LONGEST:
        raise UnwritableError(
            f"loop {loop}: the nickname {nickname!r} has {len(nickname)} characters, CLICK allows {LONGEST}; "
            f"the longest loop name that fits has {LONGEST_LOOP}"
        )
    return nickname


def _once(rows: Sequence[Nickname]) -> None:
    seen: dict[str, Nickname] = {}
    for row in rows:
        other = seen.setdefault(row.nickname.casefold(), row)
        if other is not row:
            raise UnwritableError(
                f"{other.address} and {row.address} would both be called {row.nickname!r}, whose case CLICK ignores; "
                "rename one of the loops"
            )


def initial_value(cell: Cell) -> str:
    """The content as CLICK writes an initial value: shortest decimals, ``1E-05`` with a large E."""
    text = cell.text.upper()
    return text.removesuffix(".0")


def _comment(word: Word, entry: Mapping[str, object]) -> str:
    """What the register is; a switch begins with what 0 means (D100)."""
    if isinstance(word.codec, Choice):
        text = word.title if word is ACTION.word else f"{_states(word.codec)}: {word.title}"
    else:
        unit = "" if " in " in word.title else _unit(word.unit, entry)
        text = f"{word.title}, {unit}" if unit else word.title
    return text if len(text) <= LONGEST_COMMENT else word.title


def _states(codec: Choice) -> str:
    """Both states of a switch, that of 0 first."""
    if codec == FLAG:
        return "Off or on"
    first, second = (str(codec.decode(bit)) for bit in (0, 1))
    return f"{first[0].upper()}{first[1:]} or {second}"


def _unit(unit: str, entry: Mapping[str, object]) -> str:
    pv = entry.get("pv")
    text = pv.get("unit") if isinstance(pv, dict) else None
    shown = " ".join(str(text).split()) if text else ""
    if unit == "pv":
        return shown
    if unit == "pv/sample":
        return f"{shown} per sample".strip()
    return UNITS.get(unit, "")
