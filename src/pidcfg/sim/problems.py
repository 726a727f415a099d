"""What is wrong with a scenario: data with a path, so that the command line can point at the line.

A kind is a row of `KINDS`; the command line gives it its code.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from pidcfg.schemas.names import nearest

if TYPE_CHECKING:
    from collections.abc import Iterable

    from pidcfg.paths import Path

KINDS = (
    "unknown_name",
    "expression",
    "combination",
    "value",
    "limit",
    "too_late",
    "missing_plant",
    "rounded",
    "set_up",
    "no_steady_state",
    "wrong_action",
    "idle_allowance",
)
"""Kinds of problems; the last seven do not keep a scenario from running."""


@dataclass(frozen=True, slots=True)
class Problem:
    """One fault: where it stands, what it is, and the cure. ``offset`` is the character within an expression."""

    path: Path
    message: str
    kind: str = "combination"
    severity: str = "error"
    help: str | None = None
    key: bool = False
    offset: int = 0
    loop: str | None = None


class NoValue(NamedTuple):
    """A word or parameter whose content is no value of its format, and what is taken for it.

    ``loop`` is its loop's number. A ``setting`` that is none is an error of the set-up; what the PLC writes itself,
    such as the output, only begins the run.
    """

    loop: int
    text: str
    setting: bool = True


def unknown(path: Path, what: str, name: object, known: Iterable[str], *, key: bool = False) -> Problem:
    """A name that is unknown here, with the nearest known one as help."""
    names = list(known)
    near = nearest(str(name), names)
    few = ", ".join(names[:12]) + (", …" if len(names) > 12 else "")
    cure = f"did you mean {near}?" if near else f"known: {few}" if names else f"there is no {what} here to be named"
    return Problem(path, f"{str(name)[:60]!r} is no {what}", "unknown_name", help=cure, key=key)
