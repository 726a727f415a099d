"""Tables with a header, as programs write them and spreadsheets save them again.

A header counts whatever its letters; commas, semicolons or tabs may stand between cells; columns may be in any order,
with empty ones behind them. Comment lines that a spreadsheet took for cells are put together again.
"""

from __future__ import annotations

import csv
from typing import TYPE_CHECKING

from pidcfg.encoders.listing import Listing, ListingError, settings_line

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

DELIMITERS = (",", ";", "\t")
COMMENT = ("#", '"#')
"""How a comment line begins; in quotes where a spreadsheet saved it."""


def first_line(text: str) -> str:
    """The first line that is neither blank nor a comment."""
    return next((s for line in text.splitlines() if (s := line.strip()) and not s.startswith(COMMENT)), "")


def delimiter(text: str) -> str:
    """What stands between the cells of a table, by its first line."""
    head = first_line(text)
    return max(DELIMITERS, key=head.count)


def columns(text: str) -> list[str]:
    """The cells of the first line that is not a comment, in small letters."""
    try:
        return [cell.strip().lower() for cell in next(csv.reader([first_line(text)], delimiter=delimiter(text)), [])]
    except csv.Error:
        return []


def table_rows(
    text: str, listing: Listing, required: tuple[str, ...], other_names: Mapping[str, str] | None = None
) -> Iterator[tuple[int, dict[str, str]]]:
    """The rows of a table with their line numbers; comment lines are read into ``listing``.

    ``required``: the columns that must be there, ``hex|value`` for one of two. ``other_names``: columns by names that
    count as well. Raises `ListingError`.
    """
    between = delimiter(text)
    header: list[str] | None = None
    for number, line in enumerate(text.splitlines(), start=1):
        if settings_line(_comment(line, between), number, listing):
            continue
        try:
            cells = [cell.strip() for cell in next(csv.reader([line], delimiter=between, strict=True))]
        except csv.Error as error:
            raise ListingError(f"not CSV: {error}", number) from None
        if header is None:
            known = other_names or {}
            header = _header([known.get(cell.lower(), cell) for cell in cells], required, number)
        elif any(cells):
            if len(cells) < len(header) or any(cells[len(header) :]):
                raise ListingError(f"{cells_stand(cells)} under a header of {len(header)} columns", number)
            yield number, dict(zip(header, cells, strict=False))


def cells_stand(cells: Sequence[str]) -> str:
    """How many cells stand somewhere, as a sentence begins."""
    return "1 cell stands" if len(cells) == 1 else f"{len(cells)} cells stand"


def _header(cells: list[str], required: tuple[str, ...], line: int) -> list[str]:
    """The names of the columns; nothing may stand twice, and the empty ones behind them do not count."""
    names = [cell.lower() for cell in cells]
    while names and not names[-1]:
        names.pop()
    missing = [name for name in required if not set(name.split("|")) & set(names)]
    if missing:
        raise ListingError(f"the header has no column {missing[0].replace('|', ' or ')}", line)
    twice = next((name for i, name in enumerate(names) if name and name in names[:i]), None)
    if twice is not None:
        raise ListingError(f"the header has the column {twice[:40]} twice", line)
    return names


def _comment(line: str, between: str) -> str:
    """A comment line as it was before a spreadsheet took it for cells; any other line as it is."""
    if not line.startswith(COMMENT):
        return line
    try:
        cells = next(csv.reader([line], delimiter=between)) if line.startswith('"') else [line]
    except csv.Error:
        return line
    return ",".join(cells).rstrip(between + ",")
