"""What a bit, a number or a state means for the plant, and what to do about it: rows beside the register tables."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from pidcfg.refs import Basis


class Meaning(NamedTuple):
    """What happens while a bit is on or a number is shown, what to do, and which rules find it before the download."""

    effect: str
    cure: str = ""
    rules: tuple[str, ...] = ()
    basis: Basis | None = None


class Code(NamedTuple):
    """A number that a PLC shows: the register that shows it, what it stands for, and what that means."""

    register: str
    number: int
    title: str
    meaning: Meaning
