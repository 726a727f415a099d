"""What is said about the DL06: its blocks, meanings and notation.

A register such as an alarm limit is a row of `pidcfg.encoders.maps.dl06`, which `pidcfg.output.explanation.registers`
explains; here stands only what no row says.
"""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING, Any

from pidcfg.encoders.codecs import DecodeError, Position, bcd_digits
from pidcfg.encoders.dl06.image import check_setup, make_scales, scales_of
from pidcfg.encoders.image import default_name, read_settings
from pidcfg.encoders.maps.dl06 import (
    ADDRESS,
    BIT_MEANINGS,
    CPU,
    D01,
    D16,
    ERROR_FLAGS,
    FILTER,
    FORMATS,
    LOOP_COUNT,
    LOOP_TABLE,
    LOOP_TABLES,
    LOWER,
    RAMP_SOAK_PAIR,
    RAMP_SOAK_PAIRS,
    READ_DELAYS,
    RECHECK_ADVICE,
    RESET,
    SETUP_WORDS,
    SPACE,
    TABLE_POINTER,
    UPPER,
    WORD_MEANINGS,
    WRITER_TEXTS,
    Source,
    SpanBcd,
)
from pidcfg.encoders.regmap import Meaning
from pidcfg.output.explanation.book import Direction, Start
from pidcfg.output.explanation.page import UNKNOWN_SCALING, Placement, Scaling, special_code
from pidcfg.output.explanation.registers import IN_FILE_TEXT, Block, RegisterBook
from pidcfg.schemas.base import RESET_UNIT, RESET_UNITS, limits_at, units_of, v_name
from pidcfg.schemas.dl06 import LoopSettings, PlcSettings, Transfer
from pidcfg.schemas.numbers import decimal_text

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from pidcfg.encoders.listing import Listing
    from pidcfg.encoders.regmap import Word
    from pidcfg.schemas.dl06 import Dl06File, Loop

PERCENT = 100
PV_TRANSFER = "pv_transfer"
RESET_DECIMALS = "reset_decimals"
MAX_FILTER_CONSTANT = Decimal(1)
"""The filter constant above which there is no filter."""


def word_text(word: Word, raw: int, _scaling: Scaling) -> str:
    """Words that hold an address or a channel."""
    if word in SETUP_WORDS.words:
        return _setup_text(word, raw)
    if word.codec is ADDRESS:
        return v_name(raw) if raw else "0: points nowhere"
    return (
        _transfer_text(word.codec.decode(raw), reads=word.name == PV_TRANSFER) if isinstance(word.codec, Source) else ""
    )


def _setup_text(word: Word, raw: int) -> str:
    """What the CPU makes of V7640 for a single loop, and of V7641 with a table in its place; V7642 says the same."""
    is_pointer = word.offset == SETUP_WORDS.offset_of("loop_table")
    setup = check_setup(raw, 1) if is_pointer else check_setup(CPU.lower[0], raw)
    digits = f"{raw:04X}".lstrip("0") or "0"
    shown_word = v_name(raw) if is_pointer else digits
    if setup.flags:
        bit = setup.flags.bit_length() - 1
        flag = next(row.title for row in SETUP_WORDS.bits if bit in row.bits)
        effect = f"no loop runs; bit {bit} of {v_name(ERROR_FLAGS)} goes on"
        is_number = is_pointer or setup.count
        return f"{shown_word}: {effect} ({flag})" if is_number else f"{shown_word}, no BCD number: {effect}"
    if not is_pointer:
        return "0: no loop runs" if setup.count == 0 else shown_word
    max_loops = min(CPU.loops, ((CPU.lower_end if raw < CPU.upper[0] else CPU.upper_end) + 1 - raw) // LOOP_TABLE.size)
    limit_text = "" if max_loops == CPU.loops else f"; more than {max_loops} do not fit"
    flag_text = f" and set bit 3 of {v_name(ERROR_FLAGS)}" if limit_text and raw < CPU.upper[0] else ""
    return f"{shown_word}, room for {max_loops} loop{'' if max_loops == 1 else 's'}{limit_text}{flag_text}"


def _transfer_text(source: tuple[int, int, int] | int | None, *, reads: bool) -> str:
    """Where an auto transfer goes, and what is wrong with that."""
    if source is None:
        return "0: no transfer"
    if isinstance(source, int):
        if not reads:
            return f"{v_name(source)}: not allowed, the output goes to a slot and channel only"
        if any(first <= source <= last for first, last in CPU.transfer_sources):
            return f"{v_name(source)}: the CPU reads this word"
        allowed = ", ".join(f"{v_name(first)} to {v_name(last)}" for first, last in CPU.transfer_sources)
        return f"{v_name(source)}: not allowed, only {allowed}"
    parts = dict(zip(("base", "slot", "channel"), source, strict=True))
    limits = {key: bound for key in parts if (bound := limits_at(Transfer, key)) is not None}
    texts = [
        f"{key} {bound.low}" + (f" to {bound.high}" if bound.high != bound.low else "")
        for key, bound in limits.items()
        if not bound.holds(Decimal(parts[key]))
    ]
    effect = f"not allowed, only {', '.join(texts)}" if texts else f"the CPU {'reads' if reads else 'writes'} it itself"
    return f"{', '.join(f'{key} {value}' for key, value in parts.items())}: {effect}"


def word_remark(word: Word, raw: int, scaling: Scaling) -> str:
    """A reset time that may have another decimal, and filter constants that switch the filter off."""
    if word.codec is FILTER and FILTER.decode(raw) > MAX_FILTER_CONSTANT:
        return "above 1 the filter is switched off"
    if word.codec is RESET[1] and not special_code(RESET[1], raw) and RESET_DECIMALS not in scaling.chosen_readings:
        alternative = f"{decimal_text(RESET[2].decode(raw))} {scaling.units.get(RESET_UNIT, '')}".rstrip()
        return f"{alternative} if the word has two decimals: D{D01.number:02d}"
    return ""


def unscaled_counts(word: Word, raw: int) -> str:
    """Counts without a data format: what they are in each format that can hold them."""
    if not isinstance(word.codec, Position):
        if not isinstance(word.codec, SpanBcd):
            return f"{raw} counts"
        code = special_code(word.codec.bcd, raw)
        return f"{decimal_text(word.codec.bcd.decode(raw))} counts of the data format a second" + (code and f": {code}")
    shares = []
    for form in FORMATS.values():
        try:
            counts = form.codec.decode(raw)
        except DecodeError:
            continue
        if form.minimum <= counts <= form.maximum:
            shares.append(f"{form.name} {PERCENT * (counts - form.minimum) / form.span:.4g} %")
    return f"of the data format's range: {', '.join(shares)}"


def scaling_of(loop: Loop, config: Dl06File) -> Scaling:
    """The scales and units of a loop of a configuration."""
    return Scaling(scales_of(loop), _units(loop, loop.tuning.reset_unit), frozenset(config.plc.model_fields_set))


def _units(loop: object, reset: str) -> dict[str, str]:
    """The loop's own units; that of the reset time is a choice of bits."""
    return {**units_of(loop), RESET_UNIT: RESET_UNITS[reset]}


def placements(listing: Listing, options: Mapping[str, Any]) -> Iterator[tuple[int, Placement]]:
    """What each address of a listing is: set-up words, loop tables, then the ramp/soak tables they point at.

    Where they overlap, the first counts: a pointer that is wrong hides no loop.
    """
    for word in SETUP_WORDS.words:
        yield TABLE_POINTER + word.offset, Placement(SETUP_WORDS, word, "", UNKNOWN_SCALING)
    words = listing.words
    loops = [read_settings(LoopSettings, entry, f"settings[{i}]") for i, entry in enumerate(listing.settings)]
    pointer = options.get("loop_table", words.get(TABLE_POINTER))
    if pointer is None:
        return
    plc = read_settings(PlcSettings, listing.plc or {}, "plc")
    decimals = options.get(RESET_DECIMALS)
    chosen_readings = frozenset(plc.model_fields_set | ({RESET_DECIMALS} if decimals else set()))
    table = LOOP_TABLES[int(decimals or plc.reset_decimals)]
    profiles = []
    for i in range(_loop_count(words, loops, options)):
        settings = loops[i] if i < len(loops) else LoopSettings(loop=default_name(i))
        start = pointer + i * table.size
        raw = [words.get(start + n, 0) for n in range(table.size)]
        scaling = _scaling(raw, settings)._replace(chosen_readings=chosen_readings)
        for word in table.words:
            yield start + word.offset, Placement(table, word, settings.loop, scaling)
        profiles.append(_ramp_soak(raw[table.offset_of("ramp_soak_table")], settings.loop, scaling))
    for profile in profiles:
        yield from profile


def _loop_count(words: Mapping[int, int], loops: list[LoopSettings], options: Mapping[str, Any]) -> int:
    """How many loops a listing holds; a count that is no BCD number is taken for the CPU's most."""
    try:
        stored_count = bcd_digits(words.get(LOOP_COUNT, 0))
    except DecodeError:
        stored_count = CPU.loops
    number = options.get("number_of_loops")
    return int(number) if number is not None else len(loops) or stored_count


def _scaling(raw: list[int], settings: LoopSettings) -> Scaling:
    bits = {
        path: LOOP_TABLE.find_bits(path).decode(raw[LOOP_TABLE.find_bits(path).offset])
        for path in ("pv.format", "output.format", "pv.square_root", "tuning.reset_unit")
    }
    ranges = settings.pv.range, settings.output.range
    loop_scales = make_scales(bits["pv.format"], bits["output.format"], ranges, root=bits["pv.square_root"])
    return Scaling(loop_scales, _units(settings, bits["tuning.reset_unit"]))


def _ramp_soak(table: int, loop: str, scaling: Scaling) -> Iterator[tuple[int, Placement]]:
    if not table:
        return
    for step in range(RAMP_SOAK_PAIRS):
        for word in RAMP_SOAK_PAIR.words:
            number = table + step * RAMP_SOAK_PAIR.size + word.offset
            yield number, Placement(RAMP_SOAK_PAIR, word, loop, scaling, prefix=f"ramp_soak[{step}].")


READ_WHEN_TEXTS = {
    key: f"{text}, and Program mode stops the machine" if "Program" in text else text
    for key, text in (*READ_DELAYS.items(), ("program-to-run", "is not read until the CPU changes from Program to Run"))
}
USER_MEMORY = "a word of user V-memory in which loop tables may lie"
REGIONS = (
    (*CPU.non_volatile, "a word of user V-memory that is kept without power (few writes)"),
    (CPU.lower[0], CPU.lower_end, USER_MEMORY),
    (CPU.upper[0], CPU.upper_end, USER_MEMORY),
    (*CPU.system, "a word of the system's parameters"),
    (0, 0o177777, "a word of V-memory"),
)
UNSTORED_KEYS = dict.fromkeys(
    (
        *("plc.reset_decimals", "plc.derivative", "name", "description", "mode"),
        *("pv.range", "pv.unit", "output.range", "output.unit"),
    ),
    IN_FILE_TEXT,
)
"""Keys that no word holds."""

SETUP_MEANINGS = {
    "loop_table": Meaning(
        f"Where the loop table begins: {LOWER}, or {UPPER}. Elsewhere bit 0 or 1 of {v_name(ERROR_FLAGS)} goes on, "
        "with a table that is too long bit 3, and no loop runs.",
        f"Write the address. {RECHECK_ADVICE}",
        ("DL201", "DL202", "DL204"),
    ),
    "number_of_loops": Meaning(
        f"How many loops are calculated, from the first on: 0 to {CPU.loops}. 0: no loop runs. More, or no BCD number: "
        f"bit 2 of {v_name(ERROR_FLAGS)} goes on, and no loop runs either.",
        f"Write the number. {RECHECK_ADVICE}",
        ("DL203", "DL207", "DL208", "DL209"),
    ),
}

EXPLAINER = RegisterBook(
    key="dl06",
    space=SPACE,
    blocks=(
        Block("V", SETUP_WORDS, v_name(TABLE_POINTER), (), is_fixed=True),
        Block("V", LOOP_TABLE, "V2000", ("", "addr", "v"), repetitions=CPU.loops),
        Block("V", RAMP_SOAK_PAIR, "V3000", ("ramp", "rs", "rampsoak"), repetitions=RAMP_SOAK_PAIRS, is_in_loop=False),
    ),
    words=WORD_MEANINGS | SETUP_MEANINGS,
    bits=BIT_MEANINGS,
    examples=(
        ("a word, hexadecimal content", "V7642=0008"),
        ("its bit", "V7642.3"),
        ("a word of a loop table", "V2006=0x0402 --loop"),
        ("an octal offset in the loop table, decimal bit", "addr+06.10"),
        ("a word of a ramp/soak table", "ramp+02"),
        ("a register by its name or key", "gain"),
    ),
    scaling=scaling_of,
    direction=Direction("action", "the process's", {"direct": "direct", "reverse": "reverse"}),
    unstored_keys=UNSTORED_KEYS,
    aliases={"cascade_from": "remote_setpoint"},
    starts=(Start("loop_table", "V", "V2000", TABLE_POINTER), Start("number_of_loops", "V", "1", LOOP_COUNT)),
    placements=placements,
    word_text=word_text,
    unscaled_text=unscaled_counts,
    remark=word_remark,
    root_basis=D16,
    writers=WRITER_TEXTS,
    read_when_texts=READ_WHEN_TEXTS,
    hexadecimal=True,
    regions=REGIONS,
)
