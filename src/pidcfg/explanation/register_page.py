"""The page of one register, bit or number."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from pidcfg.encoders.regmap import scale_of
from pidcfg.encoders.words import DecodeError
from pidcfg.explanation.page import Origin, Page, Point, Value
from pidcfg.explanation.texts import key_text
from pidcfg.explanation.values import UNKNOWN, Setting, choice_text, is_before_root, label, unit_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.encoders.meanings import Code
    from pidcfg.encoders.regmap import Access, Bits, RegisterMap, Word
    from pidcfg.explanation.find_register import RegisterBook, Series


class Found(NamedTuple):
    """A register that was found, and what is known of the loop that it belongs to."""

    table: RegisterMap
    word: Word
    loop: str | None = None
    raw: int | None = None
    """Its content in the configuration."""
    setting: Setting | None = None
    origins: tuple[Origin, ...] = ()


WRITERS: dict[Access, str] = {
    "setting": "you: it is a setting, which the PLC reads",
    "request": "you or the program, for a moment: it is a request to the PLC",
    "status": "the PLC: it is a status, only to be read",
    "reserved": "nobody: it is reserved, leave it 0",
}


def page_of(book: RegisterBook, found: Found, name: str, raw: int | None, bit: int | None = None) -> Page:
    """A register, or one bit of it, with its content where there is one."""
    word, table = found.word, found.table
    content = found.raw if raw is None else raw
    points = tuple(_points(book, found, content, bit))
    code = _code(book, word, content)
    value = None if content is None else _value(book, found, content, code, bits=bool(points))
    row = next((r for r in table.bits if r.offset == word.offset and bit in r.bits), None) if bit is not None else None
    key = (row.path if row else None) or word.path
    access = row.access if row else word.access
    meaning = None if row else code.meaning if code else book.words.get(word.name)
    basis = points[0].meaning.basis if row and points and points[0].meaning else meaning.basis if meaning else None
    return Page(
        kind="bit" if bit is not None else "register",
        name=f"{name}.{bit}" if bit is not None else name,
        title=(row.title if row else "Bit without a meaning") if bit is not None else word.title,
        vendor=book.key,
        vendor_title=book.title,
        value=value,
        meaning=meaning,
        points=points,
        holds=key_text(book.key, key) if key else "",
        unit=_unit(word, found.setting or UNKNOWN),
        notation=_notation(book, word, bits=bool(points)),
        access=access,
        by=_writer(book, word, access),
        key=key,
        reference=str(basis or word.basis),
        loop=found.loop if found.raw is not None else None,
        place=f"{table.at(word.offset)} of {found.loop}" if found.loop else "",
        origins=tuple(o for o in found.origins if row is None or o.key.endswith(row.path or "-")),
        notes=tuple(_notes(book, found, name, content)),
    )


def _unit(word: Word, known: Setting) -> str:
    """A register's unit; of a word before the root, that of what it is compared with."""
    return "the signal before the root" if is_before_root(word, known) else unit_of(word, known.units)


def _code(book: RegisterBook, word: Word, content: int | None) -> Code | None:
    """The row of a number that the register shows."""
    codes = (code for series in book.series for code in series.codes if code.register == word.name)
    return None if content is None else next((code for code in codes if code.number == content), None)


def _value(book: RegisterBook, found: Found, raw: int, code: Code | None, *, bits: bool) -> Value:
    """A content as it is shown, and what it says."""
    kind = next(bank.kind for bank in book.space.banks if bank.prefix == prefix_of(book, found.table))
    shown = kind.hex(raw) if book.hexadecimal else kind.text(raw)
    content = raw if book.hexadecimal else kind.show(raw)
    if bits:
        return Value(content, shown)
    known = found.setting or UNKNOWN
    if code is not None:
        return Value(content, shown, code.title)
    other = next((s.other for s in book.series if s.codes[0].register == found.word.name), "")
    if other:
        return Value(content, shown, "", other)
    try:
        text = book.says(found.word, raw, known)
    except DecodeError as error:
        return Value(content, shown, "", f"{error}: this is no value of the register")
    return Value(content, shown, f"{text} (decimal {raw})" if _binary(book, found.word) else text)


def _binary(book: RegisterBook, word: Word) -> bool:
    """Whether hexadecimal digits of a register are shown in decimal too."""
    return book.hexadecimal and scale_of(word.codec) is not None and "BCD" not in word.codec.notation


def prefix_of(book: RegisterBook, table: RegisterMap) -> str:
    """The bank that a block's registers are in."""
    return next((b.prefix for b in book.blocks if b.table.title == table.title), book.space.banks[0].prefix)


def _points(book: RegisterBook, found: Found, raw: int | None, bit: int | None) -> Iterator[Point]:
    """The bits of a register, or the rows of the one that was asked for."""
    for row in found.table.bits:
        if row.offset != found.word.offset or (bit is not None and bit not in row.bits):
            continue
        if row.access == "reserved" and (raw is None or not raw & row.mask) and bit is None:
            continue
        yield _point(book, found.word, row, raw)


def _point(book: RegisterBook, word: Word, row: Bits, raw: int | None) -> Point:
    meaning = book.bits.get((word.name, row.bits[0]))
    key = row.path
    if raw is None:
        return Point(label(row), f"{row.title}{_choices(row)}", "", active=False, meaning=meaning, key=key)
    try:
        state, active = choice_text(row, raw)
    except DecodeError:
        code = raw & row.mask
        return Point(label(row), row.title, f"0x{code:04X} means nothing here", active=True, meaning=None, key=key)
    return Point(label(row), row.title, state, active, meaning if active else None, key)


def _choices(row: Bits) -> str:
    """What the codes of a row choose, where it is not just on or off."""
    values = [value for value in row.in_place if value is not None]
    if len(values) > 5 or all(isinstance(value, bool) for value in values) or not values:
        return ""
    texts = [f"{row.in_place[value] >> row.bits[0]} {value}" for value in values]
    return f": {', '.join(texts)}" if len(row.bits) == 1 else f": {', '.join(map(str, values))}"


def _notation(book: RegisterBook, word: Word, *, bits: bool) -> str:
    if bits:
        return "16 bits" + (", shown in hexadecimal" if book.hexadecimal else "")
    scaled = scale_of(word.codec)
    if scaled and book.hexadecimal and "BCD" not in word.codec.notation:
        return f"{word.codec.notation} in binary"
    counted = word.codec.notation.endswith("of 0.001") and word.unit
    return f"{word.codec.notation} {word.unit}" if counted else word.codec.notation


def _writer(book: RegisterBook, word: Word, access: Access) -> str:
    own = (book.writers or {}).get(word.name)
    if own is not None:
        return own
    late = (book.late or {}).get(word.read, "")
    return WRITERS[access] + (f"; a new value {late}" if late and access == "setting" else "")


def _notes(book: RegisterBook, found: Found, name: str, content: int | None) -> Iterator[str]:
    """What would make the answer better, and what the file and the given content have to do with each other."""
    if found.setting is None and content is not None and scale_of(found.word.codec):
        yield "with --in FILE the value is shown in engineering units"
    if is_before_root(found.word, found.setting or UNKNOWN) and book.root is not None:
        yield f"the loop takes the PV's root; this word and its number in the file are about the PV before: {book.root}"
    if found.raw is not None and content is not None and content != found.raw and not book.hexadecimal:
        yield f"the file sets {name} to {found.raw}"
    if found.raw is not None and content is not None and content != found.raw and book.hexadecimal:
        yield f"the file sets {name} to {found.raw:04X}"


def code_page(book: RegisterBook, series: Series, number: int) -> Page:
    """A number that the PLC shows."""
    code = next((c for c in series.codes if c.number == number), None)
    register = series.codes[0].register
    word, table = next((w, b.table) for b in book.blocks for w in b.table.words if w.name == register)
    if code is None:
        known = ", ".join(str(c.number) for c in series.codes)
        title = f"{series.name} {number}: {series.other}"
        return Page(
            "number",
            f"{series.name} {number}",
            title,
            book.key,
            book.title,
            reference=str(word.basis),
            notes=(f"numbers that are known: {known}",),
        )
    return Page(
        kind="number",
        name=f"{series.name} {number}",
        title=code.title,
        vendor=book.key,
        vendor_title=book.title,
        meaning=code.meaning,
        by=f"the PLC, into {table.at(word.offset)} ({word.title})",
        access="status",
        reference=str(code.meaning.basis or word.basis),
    )


def unknown_page(book: RegisterBook, name: str, number: int, raw: int | None) -> Page:
    """An address of which only the part of the memory is known."""
    bank, n = book.space.place(number)
    region = next((text for first, last, text in book.regions if first <= n <= last), "")
    examples = ", ".join(b.start for b in book.blocks if b.prefix == bank.prefix and not b.fixed and b.mentioned)
    shown = "" if raw is None else bank.kind.hex(raw) if book.hexadecimal else bank.kind.text(raw)
    hint = (
        f"what it holds depends on where the loops begin: --loop takes {examples}, --block ADDRESS another start, "
        "--in FILE a configuration"
    )
    said = f"decimal {raw}" if book.hexadecimal else shown
    return Page(
        kind="register",
        name=name,
        title=region or f"a register of bank {bank.prefix}",
        vendor=book.key,
        vendor_title=book.title,
        value=None if raw is None else Value(bank.kind.show(raw), shown, said),
        notation=bank.kind.holds,
        notes=() if "system" in region else (hint,),
    )
