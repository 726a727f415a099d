"""BCD words that somebody seems to have typed in decimal: how they read both ways, and a listing that suggests BCD."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

from pidcfg.encoders.codecs import Bcd, typed_digits
from pidcfg.encoders.image import Cell, Encoding, Image
from pidcfg.encoders.listing import PLC, Listing, write_text
from pidcfg.text.references import Decision

D950 = Decision(
    950,
    "a BCD word that seems typed in decimal is told and never changed",
    "A word with a digit above 9 counts as 0 (D50), and the number that it is in decimal is told with the digits that "
    "would mean it: 00FA is 250, 0250 would be 2.50. Beside such a word the other BCD words of its loop are told with "
    "both readings. `decode --suggest FILE` writes the listing with digits in place of the words that are no BCD; "
    "words that are BCD keep their content, and have both readings beside them.",
    "A memory view takes words in decimal, too, and the manual's loop table has binary and BCD words side by side. "
    "Of a word that is BCD nobody can know which reading was meant.",
)


class Suspect(NamedTuple):
    """A BCD word that was perhaps typed in decimal, and what it means either way."""

    address: str
    number: int
    loop: str | None
    raw: int
    word: int
    """The four BCD digits of the number that it is in decimal."""
    as_bcd: str
    """What it means as it stands; empty: it is no BCD."""
    as_decimal: str

    @property
    def readings(self) -> str:
        """Both readings."""
        if not self.as_bcd:
            return f"{self.raw:04X} is no BCD; {self.as_decimal} if {self.raw} was typed in decimal"
        return f"{self.raw:04X} is {self.as_bcd}, or {self.as_decimal} if {self.raw} was typed in decimal"


def suspects(words: Mapping[int, int], encoding: Encoding) -> tuple[Suspect, ...]:
    """Words that are no BCD but would be a number typed in decimal, and the other BCD words of the same loops."""
    found = {suspect.number: suspect for suspect in _bcd_words(words, encoding)}
    loops = {suspect.loop for suspect in found.values() if not suspect.as_bcd}
    return tuple(found[number] for number in sorted(found) if found[number].loop in loops)


def _bcd_words(words: Mapping[int, int], encoding: Encoding) -> Iterator[Suspect]:
    """The BCD words of all loops that mean something else typed in decimal; where blocks overlap the later wins."""
    for block in encoding.blocks:
        for row in block.table.words:
            number, codec = block.start + row.offset, getattr(row.codec, "bcd", row.codec)
            raw = words.get(number, 0)
            typed = typed_digits(raw)
            if isinstance(codec, Bcd) and typed is not None and typed != raw:
                as_bcd = codec.shown(raw) if f"{raw:04X}".isdecimal() else ""
                name = encoding.space.name(number)
                yield Suspect(name, number, block.loop, raw, typed, as_bcd, codec.shown(typed))


def beside(found: tuple[Suspect, ...]) -> Iterator[str]:
    """A note a loop on BCD words that stand beside one that is none."""
    for loop in dict.fromkeys(suspect.loop for suspect in found):
        own = [suspect for suspect in found if suspect.loop == loop]
        first = ", ".join(suspect.address for suspect in own if not suspect.as_bcd)
        others = [f"{suspect.address} {suspect.readings}" for suspect in own if suspect.as_bcd]
        if others:
            yield f"{loop}: beside {first} these may be typed in decimal, too: {'; '.join(others)}"


def suggested(listing: Listing, encoding: Encoding, found: tuple[Suspect, ...]) -> str:
    """The listing as text with BCD in place of the words that are none, and all readings beside them."""
    by_number = {suspect.number: suspect for suspect in found}
    known = {cell.number: cell for cell in encoding.image.cells}
    cells = []
    for number, held in sorted(listing.words.items()):
        suspect, cell = by_number.get(number), known.get(number)
        raw = suspect.word if suspect is not None and not suspect.as_bcd else held
        field, loop = ("-", None) if cell is None else (cell.field, cell.loop)
        cells.append(Cell(encoding.space.name(number), number, raw, field, loop, encoding.space.kind(number)))
    text = write_text(Image(encoding.vendor, tuple(cells), listing.settings, listing.plc))
    return "".join(f"{_with_readings(line, found)}\n" for line in _described(text, listing))


def _described(text: str, listing: Listing) -> Iterator[str]:
    """The lines, with what was done above them; a listing that says nothing beside its words still says nothing."""
    first, *others = text.splitlines()
    yield first
    yield "# suggested: the words marked 'no BCD' have digits instead; compare every marked word with the PID dialog"
    yield from (line for line in others if listing.described or not line.startswith(PLC))


def _with_readings(line: str, found: tuple[Suspect, ...]) -> str:
    suspect = next((suspect for suspect in found if line.startswith(f"{suspect.address} ")), None)
    return line if suspect is None else f"{line}  # {suspect.readings}"
