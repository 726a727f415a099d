"""A memory listing with a meaning beside every word: where its loops lie, and the lines in columns."""

from __future__ import annotations

from textwrap import wrap
from typing import TYPE_CHECKING, Any, NamedTuple

from pidcfg.control_characters import printable
from pidcfg.display_width import to_left, to_right, width_of
from pidcfg.encoders.words import DecodeError
from pidcfg.explanation.values import Placement

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from pidcfg.encoders.listing import Listing
    from pidcfg.encoders.regmap import RegisterMap
    from pidcfg.encoders.spaces import Space
    from pidcfg.explanation.values import Scaling

WIDTH = 120
NARROWEST = 40
"""Columns that a meaning has at least."""
RIGHT = frozenset({"hex", "value"})
"""Columns of numbers."""


class Start(NamedTuple):
    """An option that says where the loops of a listing begin: the bank of their registers, and an example."""

    option: str
    prefix: str
    example: str
    held: int | None = None
    """The address that says it too."""


class Line(NamedTuple):
    """A word of a listing with its meaning."""

    address: str
    hex: str
    value: str
    loop: str
    register: str
    meaning: str


def block_claims(
    blocks: Mapping[str, tuple[str, RegisterMap]],
    space: Space,
    unnamed: str,
    scaling_of: Callable[[Mapping[str, Any], Mapping[str, int], Mapping[int, int]], Scaling],
    listing: Listing,
    options: Mapping[str, Any],
) -> Iterator[tuple[int, Placement]]:
    """The registers of each loop's blocks that begin where an option says, or what stands beside the listing.

    ``scaling_of``: of what the listing says of a loop, of the starts of the loop's blocks, and of all words.
    """
    count = len(listing.settings) or max((len(options.get(key) or ()) for key in blocks), default=0)
    for i in range(count):
        settings = listing.settings[i] if listing.settings else {}
        loop = str(settings.get("loop", unnamed.format(i + 1)))
        starts = {}
        for key in blocks:
            named = list(options.get(key) or ())
            text = named[0] if len(named) == 1 and count > 1 else named[i] if i < len(named) else settings.get(key)
            start = space.parse(text) if isinstance(text, str) else None
            if start is not None:
                starts[key] = start
            elif text is not None:
                raise DecodeError(f"settings[{i}]: {key}: {text!r} is not the address of a block")
        scaling = scaling_of(settings, starts, listing.words)
        for key, start in starts.items():
            table = blocks[key][1]
            yield from ((start + word.offset, Placement(table, word, loop, scaling)) for word in table.words)


def unclaimed(prefix: str, missing: Sequence[Start]) -> str:
    """A word that no loop has, or of which that cannot be known."""
    if all(start.prefix != prefix for start in missing):
        return "belongs to no loop"
    options = " ".join(f"--{start.option.replace('_', '-')} {start.example}" for start in missing)
    return f"where the loops begin is not said: give {options}"


def as_text(lines: Sequence[Line], heads: Sequence[str]) -> str:
    """The lines in columns, the meaning wrapped within its own."""
    rows = [(line.address, line.hex, line.value, line.loop, line.register) for line in lines]
    widths = [max(map(width_of, column)) for column in zip(heads, *rows, strict=True)]
    shown = [i for i in range(len(heads)) if any(row[i] for row in rows)]
    at = sum(widths[i] + 2 for i in shown)
    out = ["  ".join([*(f"{heads[i]:<{widths[i]}}" for i in shown), "meaning"])]
    for row, line in zip(rows, lines, strict=True):
        cells = [(to_right if heads[i] in RIGHT else to_left)(row[i], widths[i]) for i in shown]
        first, *rest = wrap(line.meaning, max(WIDTH - at, NARROWEST), break_on_hyphens=False) or [""]
        out.append("  ".join([*cells, first]).rstrip())
        out += [" " * at + text for text in rest]
    return printable("\n".join(out) + "\n")
