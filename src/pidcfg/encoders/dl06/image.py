"""A DL06 configuration to its V-memory words and back, what the PLC checks of its set-up, and a loop's gains.

Each word, an alarm limit too, is encoded and decoded by its row in `pidcfg.encoders.maps.dl06`; here stands only what
no row says.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field, replace
from decimal import Decimal
from itertools import pairwise

from pidcfg.encoders.codecs import DecodeError, Scale, bcd_digits
from pidcfg.encoders.image import (
    Area,
    AreaError,
    Block,
    Decoded,
    Encoding,
    Image,
    LoopBlock,
    Settings,
    default_name,
    defaults_of,
    file_data,
    is_enabled,
    is_switched_on,
    read_settings,
    settings_of,
    settings_values,
    without_none,
)
from pidcfg.encoders.image import values_of as mapped
from pidcfg.encoders.maps.dl06 import (
    CPU,
    ERROR_FLAGS,
    FORMATS,
    LOOP_COUNT,
    LOOP_TABLE,
    LOOP_TABLES,
    RAMP_SOAK_PAIR,
    RAMP_SOAK_PAIRS,
    RAMP_SOAK_SIZE,
    RESET,
    SETUP_WORDS,
    SPACE,
    TABLE_POINTER,
    TUNING_NUMBERS,
)
from pidcfg.encoders.regmap import LoopTuning
from pidcfg.schemas.base import Quantity, v_name
from pidcfg.schemas.dl06 import (
    OFF_9999,
    Dl06File,
    Loop,
    LoopSettings,
    Plc,
    PlcSettings,
    RampSoak,
    RampSoakStep,
    Transfer,
)
from pidcfg.text.frozen import frozen
from pidcfg.text.paths import Data, Path

# --- The checks that the DL06 itself makes of its set-up words and pointers, as pure functions of 16-bit words --------
#
# The controller reports them as bits (V7642, +35, bit 10 of +06); the validator shows the same bits before the
# download.

OUTSIDE_LOWER, OUTSIDE_UPPER, TOO_MANY, STRADDLES = 1, 2, 4, 8
"""Bits of V7642."""
TABLE_OUTSIDE_LOWER, TABLE_OUTSIDE_UPPER, TABLE_IN_SYSTEM = 1, 2, 16
"""Bits of +35."""


@frozen
class Setup:
    """What the CPU makes of V7640 and V7641 when it goes from Program to Run."""

    start: int
    count: int
    """Number of loops; 0 when the word is no BCD number."""
    flags: int
    """V7642."""

    @property
    def is_running(self) -> bool:
        """Whether the loop task runs at all."""
        return self.flags == 0 and self.count > 0


def check_setup(pointer: int, count_word: int) -> Setup:
    """Bits 0 to 3 of V7642. A count that is no BCD number is reported as too many loops (D53)."""
    try:
        count = bcd_digits(count_word)
    except DecodeError:
        return Setup(pointer, 0, _start_flags(pointer) | TOO_MANY)
    flags = _start_flags(pointer)
    if count > CPU.loops:
        flags |= TOO_MANY
    last = pointer + count * LOOP_TABLE.size - 1
    if CPU.lower[0] <= pointer <= CPU.lower[1] and last > CPU.lower_end:
        flags |= STRADDLES
    return Setup(pointer, count, flags)


def _start_flags(pointer: int) -> int:
    if pointer < CPU.upper[0]:
        return 0 if CPU.lower[0] <= pointer <= CPU.lower[1] else OUTSIDE_LOWER
    return 0 if pointer <= CPU.upper[1] else OUTSIDE_UPPER


def check_ramp_soak(pointer: int) -> int:
    """Bits 0, 1 and 4 of +35 for a table at ``pointer``: one of them, unless it lies in user memory (D54)."""
    if CPU.system[0] <= pointer <= CPU.system[1]:
        return TABLE_IN_SYSTEM
    last = pointer + RAMP_SOAK_SIZE - 1
    if any(first <= pointer and last <= end for first, end in CPU.user):
        return 0
    return TABLE_OUTSIDE_LOWER if pointer < CPU.upper[0] else TABLE_OUTSIDE_UPPER


def is_alarm_order_broken(pv: Sequence[int] | None, deviation: Sequence[int] | None) -> bool:
    """Bit 10 of +06: low-low < low < high < high-high and yellow < red, for the groups that are on (None: off)."""
    return any(low >= high for group in (pv, deviation) if group is not None for low, high in pairwise(group))


# --- A DL06 configuration to its V-memory words -----------------------------------------------------------------------

TABLE = (LOOP_TABLES[1],)
LOOP_SIZE = LOOP_TABLES[1].size
OUTPUT_OFFSET = LOOP_TABLES[1].offset_of("output")
Range = tuple[Decimal, Decimal] | None
UNUSED_PAIR = RAMP_SOAK_PAIR.encode({}, {})
GIVEN_CHOICES = ("reset_decimals", "derivative")
ONE_COUNT = Quantity(Decimal(1), counts=True)


def loop_start(plc: Plc, index: int) -> int:
    """Address of the first word of a loop, counted from 0."""
    return plc.loop_table + index * LOOP_SIZE


def scales_of(loop: Loop) -> dict[str, Scale]:
    """The scales that the registers of a loop are on."""
    return make_scales(loop.pv.format, loop.output.format, (loop.pv.range, loop.output.range), root=loop.pv.square_root)


def make_scales(
    pv_format: str, output_format: str | None, ranges: tuple[Range, Range], *, root: bool
) -> dict[str, Scale]:
    """The scales ``pv``, ``sp`` and ``output`` from the formats and the ranges of PV and output."""
    return {
        "pv": Scale(FORMATS[pv_format], ranges[0]),
        "sp": Scale(FORMATS[pv_format], ranges[0], has_root=root),
        "output": Scale(FORMATS[output_format or pv_format], ranges[1]),
    }


def encode(config: Dl06File) -> Encoding:
    """All words: loop tables, ramp/soak tables, then the set-up words, which win where blocks overlap."""
    blocks = (*_loop_blocks(config), *_ramp_soak_blocks(config), _setup_block(config))
    settings = tuple(settings_of(LoopSettings, loop) for loop in config.loops)
    return Encoding("dl06", blocks, SPACE, settings, _plc_settings(config))


def _loop_blocks(config: Dl06File) -> list[Block]:
    table = LOOP_TABLES[config.plc.reset_decimals]
    return [
        Block(
            ("loops", i),
            loop_start(config.plc, i),
            table,
            table.encode(values_of(config, loop), scales_of(loop)),
            loop.name,
            scales=scales_of(loop),
        )
        for i, loop in enumerate(config.loops)
    ]


def _ramp_soak_blocks(config: Dl06File) -> list[Block]:
    blocks: list[Block] = []
    for i, loop in enumerate(config.loops):
        if loop.ramp_soak is not None and loop.ramp_soak.steps is not None:
            blocks += _ramp_soak_table(i, loop, loop.ramp_soak)
    return blocks


def _ramp_soak_table(i: int, loop: Loop, profile: RampSoak) -> list[Block]:
    scales, steps, pairs = scales_of(loop), profile.steps or (), []
    for j in range(RAMP_SOAK_PAIRS):
        values = dict(steps[j]) if j < len(steps) else {}
        place: Path = ("loops", i, "ramp_soak", "steps", j)
        start = profile.table + j * RAMP_SOAK_PAIR.size
        encoded = RAMP_SOAK_PAIR.encode(values, scales) if values else UNUSED_PAIR
        pairs.append(Block(place, start, RAMP_SOAK_PAIR, encoded, loop.name, f"ramp_soak[{j}].", scales))
    return pairs


def _setup_block(config: Dl06File) -> Block:
    count = config.plc.number_of_loops
    values = {
        "plc.loop_table": config.plc.loop_table,
        "plc.number_of_loops": Decimal(len(config.loops) if count is None else count),
    }
    return Block((), TABLE_POINTER, SETUP_WORDS, SETUP_WORDS.encode(values, {}))


def values_of(config: Dl06File, loop: Loop) -> Data:
    """Every register's value by path, with what follows from what is not given."""
    rate = loop.alarms.rate_of_change
    values = mapped(loop, TABLE, unset_values(loop))
    return values | {
        "tuning.reset": reset_word_value(config, loop),
        "remote_setpoint": remote_setpoint(config, loop),
        "pv.transfer": _transfer_value(loop.pv.transfer),
        "output.transfer": _transfer_value(loop.output.transfer),
        "alarms.rate_of_change": None if rate is None else rate.per_sample(loop.sample_rate),
    }


def unset_values(loop: Loop) -> Data:
    """What follows for words whose values are not given: the hysteresis of alarms that are on."""
    has_alarms = pv_alarms_on(loop) or deviation_alarms_on(loop)
    return unset_limits(scales_of(loop)) | ({"alarms.hysteresis": ONE_COUNT} if has_alarms else {})


def unset_limits(scales: Mapping[str, Scale]) -> Data:
    """The limits of a set point and an output that have none: the ends of their scales."""
    parts = {"setpoint": scales["sp"], "output": scales["output"]}
    return {f"{part}.limits.{i}": end for part, scale in parts.items() for i, end in enumerate(scale.ends)}


def pv_alarms_on(loop: Loop) -> bool:
    """Whether the bit of the four PV alarms is set."""
    return is_enabled(loop, "alarms.pv.enabled")


def deviation_alarms_on(loop: Loop) -> bool:
    """Whether the bit of the two deviation alarms is set."""
    return is_enabled(loop, "alarms.deviation.enabled")


def reset_word_value(config: Dl06File, loop: Loop) -> Decimal:
    """The reset time that its word holds: one of the two codes when it is off."""
    return RESET[config.plc.reset_decimals].high if loop.tuning.reset.is_9999 else reset_value(loop)


def reset_value(loop: Loop) -> Decimal:
    """The reset time in the unit of its word; 0 when it is off."""
    duration, unit = loop.tuning.reset.duration, loop.tuning.reset_unit
    if duration is None:
        return Decimal(0)
    if duration.unit is None:
        return duration.value
    return duration.seconds() / (60 if unit == "minutes" else 1)


def remote_setpoint(config: Dl06File, loop: Loop) -> int | None:
    """The pointer in +32: the output word of the major loop, or the address that is written."""
    for i, other in enumerate(config.loops):
        if other.name == loop.cascade_from:
            return loop_start(config.plc, i) + OUTPUT_OFFSET
    return loop.remote_setpoint


def _transfer_value(transfer: Transfer | None) -> tuple[int, int, int] | int | None:
    if transfer is None or transfer.address is not None:
        return None if transfer is None else transfer.address
    return transfer.base, transfer.slot or 0, transfer.channel or 0


def _plc_settings(config: Dl06File) -> dict[str, object]:
    """What no register holds for the whole file; a choice only when the file has made it."""
    choices = {key: getattr(config.plc, key) for key in GIVEN_CHOICES if key in config.plc.model_fields_set}
    return without_none({"name": config.name, "description": config.description}) | choices


# --- The mode that a DL06 loop is meant to run in, as its status word and what stands beside its words tell -----------

MODES = {1: "manual", 2: "auto", 4: "cascade"}
MODE_BITS = 0b111


def intended_mode(status: int, default: str) -> str:
    """From the status word (+06), or the requests (+00): where no bit or several are on, ``default``."""
    return MODES.get(status & MODE_BITS) or default


# --- One loop's V-memory words back to a configuration, with everything left out that is a default --------------------

ALWAYS_WRITTEN = frozenset({"mode", "tuning.reset", "tuning.rate", "pv.format"})
"""Fields that are written even where they are defaults."""
MODE_TITLES = {"Manual mode", "Automatic mode", "Cascade mode"}


@frozen
class LoopReader:
    """One loop's words on their way to a mapping."""

    block: LoopBlock
    settings: LoopSettings
    loop_table: range
    """The words of all loops."""
    notes: list[str] = field(default_factory=list)

    @property
    def requested_mode(self) -> str:
        """What stands beside the words; else the one mode that is requested (+00), as before the first run."""
        is_stated = "mode" in self.settings.model_fields_set
        return (
            self.settings.mode
            if is_stated
            else intended_mode(self.block.raw_word("mode_setting_1"), self.settings.mode)
        )

    def read_data(self, words: Mapping[int, int], names: Mapping[int, str]) -> Data:
        """The loop as a mapping, in the order of a hand-written file; ``names``: loops by their output words."""
        scales = self.read_scales()
        values = settings_values(self.settings) | self.block.read_values(scales)
        self.note_status()
        always_written = set(ALWAYS_WRITTEN)
        if self.settings.setpoint:
            always_written.add("setpoint.value")
        if values["alarms.pv.enabled"] or values["alarms.deviation.enabled"]:
            always_written.add("alarms.hysteresis")
        values |= {
            "mode": intended_mode(self.block.raw_word("mode_and_alarm_status"), self.requested_mode),
            **_setpoint_source(values["remote_setpoint"], names),
            "tuning.reset": reset_of(self.block.raw_word("reset"), values["tuning.reset"]),
            "pv.transfer": _transfer_data(values["pv.transfer"]),
            "output.transfer": _transfer_data(values["output.transfer"]),
            "ramp_soak": self.read_ramp_soak(values, words, scales),
        }
        return file_data(Loop, values, self.unset_values(scales), frozenset(always_written))

    def read_scales(self) -> dict[str, Scale]:
        """The scales, from the format bits and the ranges beside the words."""
        bits = self.block.read_choices()
        ranges = self.settings.pv.range, self.settings.output.range
        return make_scales(bits["pv.format"], bits["output.format"], ranges, root=bits["pv.square_root"])

    def unset_values(self, scales: Mapping[str, Scale]) -> Data:
        """What the words mean where the file gives no values; the reset time is always given."""
        table = self.block.table
        return table.read_back(defaults_of(Loop, [table], unset_limits(scales)) | {"tuning.reset": None}, scales)

    def note_status(self) -> None:
        """Says which bits are not carried: momentary requests, flags that the controller writes, reserved bits."""
        for row in self.block.table.bits:
            word = self.block.raw[row.offset]
            if row.path is None and word & row.mask and row.title not in MODE_TITLES:
                address = v_name(self.block.start + row.offset)
                self.notes.append(f"{self.block.loop}: {address} {word:04X}: {row.title} is not carried over")

    def read_ramp_soak(self, values: Data, words: Mapping[int, int], scales: Mapping[str, Scale]) -> Data | None:
        """The section ``ramp_soak``, with the steps when the listing holds the whole table."""
        table, on, request = values["ramp_soak.table"], values["ramp_soak.enabled"], values["ramp_soak.request"]
        if not table and not on and request == "none":
            return None
        data: Data = {"table": v_name(table)}
        if not on:
            data["enabled"] = False
        if request != "none":
            data["request"] = request
        addresses = range(table, table + RAMP_SOAK_SIZE)
        missing = next((a for a in addresses if a not in words), None)
        if addresses[0] < self.loop_table.stop and addresses[-1] >= self.loop_table.start:
            self.notes.append(
                f"{self.block.loop}: the ramp/soak table at {v_name(table)} lies over the loop table: its words are no "
                "steps"
            )
        elif missing is None:
            data["steps"] = self.read_steps([words[a] for a in addresses], table, scales)
        else:
            self.notes.append(
                f"{self.block.loop}: {v_name(missing)} of the ramp/soak table is missing; its steps are left out"
            )
        return data

    def read_steps(self, raw: Sequence[int], table: int, scales: Mapping[str, Scale]) -> list[Data]:
        """The pairs of a ramp/soak table without the unused ones at its end."""
        size, unset = RAMP_SOAK_PAIR.size, RAMP_SOAK_PAIR.read_back({}, scales)
        pairs = [tuple(raw[j * size : (j + 1) * size]) for j in range(RAMP_SOAK_PAIRS)]
        while pairs and not any(pairs[-1]):
            pairs.pop()
        blocks = (
            LoopBlock(self.block.loop, SPACE, table + j * size, RAMP_SOAK_PAIR, pair) for j, pair in enumerate(pairs)
        )
        return [file_data(RampSoakStep, block.read_values(scales), unset, frozenset({"soak"})) for block in blocks]


def reset_of(word: int, time: Decimal) -> Decimal | str:
    """A reset time, or which of the two words that switch the integral off stands there."""
    return {0x0000: "off", 0x9999: OFF_9999}.get(word, time)


def _setpoint_source(pointer: int, names: Mapping[int, str]) -> Data:
    """Where the remote set point comes from: a loop's output, or an address."""
    return {
        "cascade_from": names.get(pointer),
        "remote_setpoint": v_name(pointer) if pointer and pointer not in names else None,
    }


def _transfer_data(value: tuple[int, int, int] | int | None) -> Data | None:
    if value is None or isinstance(value, int):
        return None if value is None else {"address": v_name(value)}
    base, slot, channel = value
    return {**without_none({"base": base or None}), "slot": slot, "channel": channel}


# --- V-memory words back to a DL06 configuration ----------------------------------------------------------------------
#
# The result is plain data in the order of a hand-written file, with everything left out that is a default, so that
# encoding it again gives the same words. What cannot be carried (status flags, requests, reserved bits) is in the
# notes.


def decode(
    words: Mapping[int, int],
    settings: Sequence[Mapping[str, object]] = (),
    plc: Settings | None = None,
    options: Settings | None = None,
) -> Decoded:
    """The configuration that these words hold.

    ``settings`` and ``plc`` are what an encoder put beside the words. ``options``: ``loop_table`` and
    ``number_of_loops`` for a listing without set-up words, ``reset_decimals``; ``names_only``: the settings are those
    of another image, so that the words say how many loops there are. Raises `DecodeError` naming the address of a word
    that is missing or is no value.
    """
    options = options or {}
    entries = [read_settings(LoopSettings, entry, f"settings[{i}]") for i, entry in enumerate(settings)]
    plc_settings = read_settings(PlcSettings, plc or {}, "plc")
    pointer = _option_value(
        options,
        "loop_table",
        words.get(TABLE_POINTER),
        v_name(TABLE_POINTER),
    )
    count = _loop_count(options, words, entries)
    decimals = int(options.get("reset_decimals") or plc_settings.reset_decimals)
    table = range(pointer, pointer + count * LOOP_SIZE)
    loops = [_loop_reader(words, entries, table, i, decimals) for i in range(count)]
    names = {loop.block.start + OUTPUT_OFFSET: loop.block.loop for loop in loops}
    data: Data = {"pidcfg": 1, "vendor": "dl06"}
    data |= without_none({"name": plc_settings.name, "description": plc_settings.description})
    choices = {key: getattr(plc_settings, key) for key in GIVEN_CHOICES if key in plc_settings.model_fields_set}
    if options.get("reset_decimals"):
        choices["reset_decimals"] = decimals
    data["plc"] = _plc_data(pointer, words, count) | choices
    data["loops"] = [loop.read_data(words, names) for loop in loops]
    notes = [note for loop in loops for note in loop.notes]
    if _is_no_count(words.get(LOOP_COUNT)):
        notes.append(f"{v_name(LOOP_COUNT)} is no BCD number: the PLC sets bit 2 of V7642 and calculates no loop (D53)")
    if words.get(LOOP_COUNT) == 0:
        notes.append(_no_loop_text(count))
    if empty := [loop.block.loop for loop in loops if not any(loop.block.raw)]:
        notes.append(f"every word of {', '.join(empty)} is 0: nothing was written there, or a save wrote zeros over it")
    if "reset_decimals" not in choices and any(loop.block.raw_word("reset") for loop in loops):
        notes.append("the reset words are read with 1 decimal (decision D01); --reset-decimals 2 reads them with two")
    if flags := words.get(ERROR_FLAGS):
        notes.append(f"{v_name(ERROR_FLAGS)} {flags:04X}: the PLC's error flags of the set-up are not carried over")
    return Decoded(data, tuple(notes), status=(ERROR_FLAGS,))


def _no_loop_text(count: int) -> str:
    """What a number of loops of 0 does, and how to read the loop table all the same."""
    cure = "" if count else "; --number-of-loops reads the table all the same"
    return f"{v_name(LOOP_COUNT)} is 0: the PLC calculates no loop{cure}"


def _option_value(options: Settings, key: str, stored: int | None, title: str) -> int:
    value = stored if options.get(key) is None else options[key]
    if value is None:
        raise DecodeError(f"the listing does not hold {title}; give it with --{key.replace('_', '-')}")
    return int(value)


def _loop_count(options: Settings, words: Mapping[int, int], settings: Sequence[LoopSettings]) -> int:
    """How many loops to read; the listing of a set-up that is wrong on purpose says so in its settings."""
    stored = words.get(LOOP_COUNT)
    if options.get("number_of_loops") is not None:
        return int(options["number_of_loops"])
    if settings and (stored is None or not options.get("names_only")):
        return len(settings)
    if _is_no_count(stored):
        cure = "--number-of-loops says how many loops to read"
        raise DecodeError(f"{v_name(LOOP_COUNT)}: 0x{stored:04X} has a digit above 9; {cure}", LOOP_COUNT)
    digits = None if stored is None else bcd_digits(stored)
    return _option_value(options, "number_of_loops", digits, v_name(LOOP_COUNT))


def _is_no_count(stored: int | None) -> bool:
    """Whether V7641 holds something that is no BCD number."""
    return stored is not None and not f"{stored:04X}".isdecimal()


def _plc_data(pointer: int, words: Mapping[int, int], count: int) -> Data:
    data: Data = {"loop_table": v_name(pointer)}
    stored = words.get(LOOP_COUNT)
    if stored is not None and not _is_no_count(stored) and bcd_digits(stored) != count:
        data["number_of_loops"] = bcd_digits(stored)
    return data


def _octal_cure(words: Mapping[int, int], table: range) -> str:
    """What to do where V7640 holds the octal digits of the table's address as if they were hexadecimal ones."""
    digits = f"{table.start:04X}"
    if words.get(TABLE_POINTER) != table.start or set("89ABCDEF") & set(digits) or int(digits, 8) not in words:
        return ""
    address = v_name(int(digits, 8))
    return f": V7640 is {digits}, hexadecimal; {address} is {int(digits, 8):04X} (or --loop-table {address})"


def _loop_reader(
    words: Mapping[int, int], settings: Sequence[LoopSettings], table: range, index: int, decimals: int
) -> LoopReader:
    start = table[index * LOOP_SIZE]
    missing = next((a for a in range(start, start + LOOP_SIZE) if a not in words), None)
    if missing is not None:
        raise DecodeError(f"the listing does not hold {v_name(missing)} of loop {index + 1}{_octal_cure(words, table)}")
    loop_settings = settings[index] if index < len(settings) else LoopSettings(loop=default_name(index))
    raw = tuple(words[a] for a in range(start, start + LOOP_SIZE))
    return LoopReader(LoopBlock(loop_settings.loop, SPACE, start, LOOP_TABLES[decimals], raw), loop_settings, table)


# ----------------------------------------------------------------------------------------------------------------------
# The blocks of a DL06: V7640 and V7641 say where its loop table is, and each loop where its ramp/soak table is.

MODE_REGISTERS = ("mode_and_alarm_status",)
"""What tells a loop's mode."""


def mode_of(raw: int) -> str:
    """The mode that +06 tells; empty: none yet."""
    return intended_mode(raw, "")


def areas(words: Mapping[int, int], like: Image | None, options: Settings) -> list[Area]:
    """The blocks that are known from the words that have been read; at first the set-up words alone.

    ``like``: the image of a configuration, which says names, and where the table is that the PLC itself does not tell.
    ``options``: those of `decode`. Raises `AreaError` where nothing says where the loops are.
    """
    blocks = [Area(TABLE_POINTER, SETUP_WORDS)]
    if TABLE_POINTER not in words:
        return blocks
    start = _table_start(words, like, options)
    names = [str(entry["loop"]) for entry in like.settings] if like is not None else []
    table = LOOP_TABLES[int(options.get("reset_decimals") or 1)]
    for i in range(_stored_loop_count(words, like, options)):
        name = names[i] if i < len(names) else default_name(i)
        blocks.append(Area(start + i * LOOP_SIZE, table, name))
        blocks += _ramp_soak_areas(words.get(start + i * LOOP_SIZE + LOOP_TABLE.offset_of("ramp_soak_table"), 0), name)
    return blocks


def _table_start(words: Mapping[int, int], like: Image | None, options: Settings) -> int:
    """Where the loop table begins: as an option says, as the PLC says, else as the file says."""
    option = options.get("loop_table")
    start = int(words[TABLE_POINTER] if option is None else option)
    if _in_user_memory(start):
        return start
    if like is not None:
        return like.words[TABLE_POINTER]
    problem = f"{v_name(TABLE_POINTER)} holds 0x{start:04X}, which is no place of a loop table"
    raise AreaError(f"{problem}; give it with --loop-table", TABLE_POINTER)


def _stored_loop_count(words: Mapping[int, int], like: Image | None, options: Settings) -> int:
    """How many loops there are, in the same order of who says so."""
    if options.get("number_of_loops") is not None:
        return min(int(options["number_of_loops"]), CPU.loops)
    try:
        count = bcd_digits(words[LOOP_COUNT])
    except DecodeError:
        count = 0
    if 0 < count <= CPU.loops:
        return count
    if like is not None:
        return len(like.settings)
    content = f"{v_name(LOOP_COUNT)} holds 0x{words[LOOP_COUNT]:04X}"
    problem = (
        f"{content}, which is no number of loops from 1 to {CPU.loops}"
        if words[LOOP_COUNT]
        else f"{content}: the PLC calculates no loop"
    )
    raise AreaError(f"{problem}; --number-of-loops reads the table all the same", LOOP_COUNT)


def _ramp_soak_areas(start: int, loop: str) -> Iterator[Area]:
    """The pairs of a loop's ramp/soak table; none where its pointer names no user memory."""
    size = RAMP_SOAK_PAIR.size
    if start and _in_user_memory(start) and _in_user_memory(start + RAMP_SOAK_PAIRS * size - 1):
        for k in range(RAMP_SOAK_PAIRS):
            yield Area(start + k * size, RAMP_SOAK_PAIR, loop, f"ramp_soak[{k}].")


def _in_user_memory(number: int) -> bool:
    return any(first <= number <= last for first, last in CPU.user)


# --- How a DL06 loop holds its gains: shares of both spans, the reset in its own unit and decimals --------------------


def tuning_of(config: Dl06File, loop: Loop) -> LoopTuning:
    """The three numbers of a loop, and what they are counted in."""
    tuning, pv, output = loop.tuning, loop.pv.range, loop.output.range
    reset, codec = reset_value(loop), RESET[config.plc.reset_decimals]
    is_off = any(reset == digits * codec.step for digits in codec.off)
    limit = loop.derivative_gain_limit
    has_limit = is_switched_on(loop.derivative_gain_limit_enabled, limit)
    has_filter, filter_factor = is_switched_on(loop.pv.filter_enabled, loop.pv.filter), float(loop.pv.filter or 0)
    return LoopTuning(
        replace(TUNING_NUMBERS, table=LOOP_TABLES[config.plc.reset_decimals]),
        raises_pv=loop.action == TUNING_NUMBERS.heating,
        pv_span=None if pv is None else pv[1] - pv[0],
        output_span=None if output is None else output[1] - output[0],
        minutes=tuning.reset_unit == "minutes",
        current_values=(tuning.gain, Decimal(0) if is_off else reset, tuning.rate),
        obstacle="it squares its error (error.curve)" if loop.error.curve == "squared" else "",
        no_derivative="its derivative_gain_limit of 0 removes the derivative" if has_limit and not limit else "",
        off_texts=("off", "0"),
        sample_time=float(loop.sample_rate),
        pv_share=filter_factor if has_filter and 0 < filter_factor <= 1 else 1.0,
        derivative_limit=float(limit) if has_limit and limit else None,
    )
