"""The registers of a PLC's loops, read until two readings say the same, and what a reading tells about itself."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, ClassVar, Protocol

from pidcfg.encoders.codecs import DecodeError
from pidcfg.encoders.contract import Encoder, tables_of
from pidcfg.encoders.image import Area, Image
from pidcfg.encoders.listing import Listing, Numbering, Place
from pidcfg.encoders.modbus_map import MapError, NamedNumbering, StatedNumbering, with_contents
from pidcfg.encoders.modbus_map import place_text as shown_place
from pidcfg.encoders.parameter_files import ParameterListing
from pidcfg.encoders.parameters import AnyImage, Program, register_content
from pidcfg.encoders.regmap import writer_of
from pidcfg.live.link import MAX_PER_REQUEST, Link, NoRegistersError, PlcError, Request
from pidcfg.schemas.iec import Wire
from pidcfg.text.paths import Data
from pidcfg.text.references import Decision
from pidcfg.validate.map_files import space_of
from pidcfg.vendors import Vendor

# --- What a reading tells about itself: contents that nobody has meant ------------------------------------------------

D880 = Decision(
    880,
    "numbers next to 0 are told as registers in the other order",
    "Where more of a PLC's single-precision numbers lie between 0 and 1e-30 than beyond, `pull` and `compare` say that "
    "the two registers of a number seem to stand in the other order. The contents are taken as they are.",
    "140.0 in the other order is 2.4e-41. No quantity of a loop is as small; a gateway that exchanges words is the "
    "usual cause, and each number for itself looks like a difference.",
)
TINY_NUMBER = 1e-30
MAX_NUMBERS = 3
"""Numbers that the remark names."""


def implausible_contents(image: AnyImage) -> Iterator[str]:
    """Remarks on what was read."""
    numbers = {cell.address: cell.single_value for cell in image.cells if cell.single_value}
    tiny = [f"{name} {value:.3g}" for name, value in numbers.items() if abs(value) < TINY_NUMBER]
    if len(tiny) > len(numbers) / 2 and len(tiny) > 1:
        more_text = f" and {len(tiny) - MAX_NUMBERS} more" if len(tiny) > MAX_NUMBERS else ""
        yield (
            f"{', '.join(tiny[:MAX_NUMBERS])}{more_text} are next to 0: the two registers of a number seem to stand in "
            "the other order; look at the set-up of the gateway, or state the order by --map"
        )


# --- What a vendor gives whose registers are read ---------------------------------------------------------------------


class RegisterEncoder(Encoder, Protocol):
    """``encoders.<vendor>.image`` of a PLC whose registers are read over Modbus."""

    @property
    def MODE_REGISTERS(self) -> tuple[str, ...]:  # noqa: N802 - a constant of the module
        """The registers that show the mode, which ``mode_of`` takes."""

    def areas(self, words: Mapping[int, int], like: Image | None, options: Mapping[str, object], /) -> list[Area]:
        """The blocks that are to be read, as far as ``words`` tell; raises `AreaError`."""


def register_encoder_of(vendor: Vendor) -> RegisterEncoder:
    """How a vendor's registers are read."""
    encoder: RegisterEncoder = vendor.module("encode")
    return encoder


# --- The registers of a PLC's loops, read until two readings say the same ---------------------------------------------

D872 = Decision(
    872,
    "blocks are read until their settings agree",
    "All blocks are read twice, and up to five times, until two readings in a row have the same settings; what runs is "
    "taken from the last one. Without that there is no result.",
    "Somebody may be downloading, or an auto-tune writing its gains, while the blocks are read one after the other.",
)
MAX_READINGS = 5
MAX_NAMES = 6


class Registers:
    """Where a vendor's loops are in a PLC, and how they are read from there.

    ``like``: the image of a configuration, which gives names, and places that the PLC does not tell; ``options``: those
    of the vendor's decoder.
    """

    kind: ClassVar[type[Listing]] = Listing
    """What the words of a reading are put into."""

    def __init__(self, vendor: Vendor, numbering: Numbering, like: Image | None, options: Mapping[str, object]) -> None:
        self.vendor, self.numbering, self.like, self.options = vendor, numbering, like, options
        self.areas: list[Area] = []
        self.max_per_request: Mapping[str, int] = MAX_PER_REQUEST
        self._find_areas = register_encoder_of(vendor).areas
        self.space = space_of(vendor)

    async def read_image(self, link: Link) -> Image:
        """Every register of the loops, in address order; raises `PlcError`."""
        words = await self.read(link)
        cells = {cell.number: cell for area in self.areas for cell in area.make_cells(self.space, words)}
        image = Image(self.vendor.key, tuple(cell for _, cell in sorted(cells.items())))
        if isinstance(self.numbering, StatedNumbering):
            try:
                self.numbering.check_places(image)
            except MapError as error:
                raise PlcError(f"{link.address}: line {error.line} of the map: {error}") from None
        return image

    def listing(self, image: AnyImage) -> Listing:
        """The words of an image, and nothing that stands beside them."""
        return self.kind(dict(image.words), shown_addresses={cell.number: cell.address for cell in image.cells})

    async def read(self, link: Link) -> dict[int, int]:
        """Raw contents by plain number; raises `PlcError`."""
        before = await self._read_once(link)
        for _ in range(MAX_READINGS - 1):
            words = await self._read_once(link)
            changed = [n for n in {**before, **words} if not self._is_same_setting(n, before, words)]
            if not changed:
                return words
            before = words
        names = ", ".join(self._name_with_loop(n) for n in sorted(changed)[:MAX_NAMES])
        message = f"settings changed during each of {MAX_READINGS} readings: {names}"
        raise PlcError(f"{link.address}: {message}; look who writes them: a download, an auto-tune, the ladder program")

    def _name_with_loop(self, number: int) -> str:
        loop = self.owners().get(number)
        return f"{self.name(number)} of {loop}" if loop else self.name(number)

    def _is_same_setting(self, number: int, before: Mapping[int, int], after: Mapping[int, int]) -> bool:
        if number not in before or number not in after:
            return False
        mask = self._setting_bits[number]
        return before[number] & mask == after[number] & mask

    async def _read_once(self, link: Link) -> dict[int, int]:
        """One reading; blocks may say where others are."""
        words: dict[int, int] = {}
        absent_starts: set[int] = set()
        while True:
            try:
                areas = self._find_areas(words, self.like, self.options)
            except DecodeError as error:
                raise PlcError(f"{link.address}: {error}") from None
            self.areas = [area for area in areas if area.start not in absent_starts]
            missing = [area for area in self.areas if any(n not in words for n in area.numbers)]
            if not missing:
                break
            try:
                words |= await self.read_words(link, (n for area in missing for n in area.numbers if n not in words))
            except NoRegistersError:
                if not all(area.prefix for area in missing):
                    raise
                absent_starts |= {area.start for area in missing if not await self._is_there(link, area)}
        writers = tables_of(self.vendor).WRITERS
        self._setting_bits = {n: mask for area in self.areas for n, mask in area.kept_masks(writers).items()}
        return words

    async def _is_there(self, link: Link, area: Area) -> bool:
        """Whether a PLC has the registers of a block: a pointer to a table may hold anything."""
        try:
            await self.read_words(link, area.numbers)
        except NoRegistersError:
            return False
        return True

    async def read_words(self, link: Link, numbers: Iterable[int]) -> dict[int, int]:
        """Some registers of the loops, as they are now."""
        words: dict[int, int] = {}
        for request, places in self._requests(numbers):
            words |= join_contents(places, request.first, await link.read(request))
        return words

    def _requests(self, numbers: Iterable[int]) -> Iterator[tuple[Request, dict[int, Place]]]:
        """Registers that follow each other, as many at once as the protocol allows."""
        owners = self.owners()
        try:
            places = {n: self.numbering.place(n) for n in dict.fromkeys(numbers)}
        except LookupError as error:
            raise PlcError(str(error)) from None
        remaining = sorted(places, key=lambda n: (places[n].table, places[n].register))
        while remaining:
            first, group = places[remaining[0]], [remaining[0]]
            end = first.register + first.width
            for n in remaining[1:]:
                place = places[n]
                if place.table != first.table or place.register > end:
                    break
                if place.register + place.width - first.register > self.max_per_request[first.table]:
                    break
                group.append(n)
                end = max(end, place.register + place.width)
            loops = dict.fromkeys(owners[n] for n in group if owners.get(n))
            description = self._span_text(group) + (f" of {', '.join(loops)}" if loops else "")
            yield Request(first.table, first.register, end - first.register, description), {n: places[n] for n in group}
            remaining = remaining[len(group) :]

    def name(self, number: int) -> str:
        """A register as messages name it."""
        return str(self.space.name(number))

    def owners(self) -> Mapping[int, str]:
        """The loop that each register is of."""
        return {n: area.loop for area in self.areas for n in area.numbers}

    def _span_text(self, numbers: Sequence[int]) -> str:
        first, last = self.name(numbers[0]), self.name(numbers[-1])
        return first if len(numbers) == 1 else f"{first} to {last}"


def join_contents(places: Mapping[int, Place], first: int, content: Sequence[int]) -> dict[int, int]:
    """Raw contents of registers that were read from ``first`` on, of two in the order of their place."""
    return {
        n: sum(content[place.register - first + part] << place.shift(part) for part in range(place.width))
        if place.bit is None
        else content[place.register - first] >> place.bit & 1
        for n, place in places.items()
    }


# --- The registers of a PLC whose parameters have names, read until two readings say the same -------------------------
#
# A program's structure is no register: block types, wires and literals are those of the configuration that is read
# like.


class NamedRegisters(Registers):
    """Where a program's parameters are in a PLC, by a map, and how they are read from there."""

    kind: ClassVar[type[Listing]] = ParameterListing

    def __init__(self, vendor: Vendor, numbering: NamedNumbering, like: Any) -> None:
        self.vendor, self.named_numbering = vendor, numbering
        self.numbering: Any = numbering
        self.max_per_request = getattr(vendor.module("points"), "MAX_PER_REQUEST", MAX_PER_REQUEST)
        self.program: Program = like
        cells = [cell for cell in self.program.cells if not isinstance(cell.raw, Wire)]
        self.names: list[Any] = [cell.address for cell in cells if cell.address in numbering.places]
        table = tables_of(vendor).WRITERS
        self._setting_bits: Any = {}
        for cell in cells:
            writer = writer_of(table, cell.field, _loop_values(self.program, cell.loop))
            self._setting_bits[cell.address] = -1 if writer is None or writer.kind == "compared" else 0

    def name(self, number: object) -> str:
        """A parameter as messages name it."""
        return str(number)

    def owners(self) -> Mapping[Any, str]:
        """The loop that each parameter is of."""
        return {name: point.loop or "" for name, point in self.named_numbering.points.items()}

    async def read_image(self, link: Link) -> Any:
        """The program with the contents of the PLC; raises `PlcError`."""
        words: Mapping[Any, int] = await self.read(link)
        return with_contents(self.program, {name: self.parameter_value(name, words[name], link) for name in self.names})

    async def _read_once(self, link: Link) -> dict[int, int]:
        return await self.read_words(link, self.names)

    def parameter_value(self, name: str, raw: int, link: Link) -> Any:
        """The content of a parameter; raises `PlcError` where its registers hold no value of its type."""
        kind = self.named_numbering.points[name].type
        try:
            return register_content(kind, raw)
        except DecodeError as error:
            place = shown_place(self.named_numbering.place(name))
            raise PlcError(f"{link.address}: {name}, {place}, is no {kind.name}: {error}") from None


def _loop_values(program: Program, loop: str | None) -> Data:
    return {cell.field: cell.raw for cell in program.cells if cell.loop == loop}
