"""A CLICK configuration to its C, DS and DF registers and back, and how a loop holds its gains."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from pidcfg.encoders.image import (
    Area,
    Block,
    Decoded,
    Encoding,
    Image,
    LoopBlock,
    LoopOption,
    Settings,
    defaults_of,
    file_data,
    is_enabled,
    is_switched_on,
    read_loops,
    read_settings,
    settings_of,
    settings_values,
    with_options,
    without_none,
)
from pidcfg.encoders.image import values_of as mapped
from pidcfg.encoders.maps.click import BANKS, BLOCKS, MODE_BITS, SPACE, TABLES, TUNING_NUMBERS, UNUSED_CONTENTS
from pidcfg.encoders.regmap import LoopTuning
from pidcfg.schemas.click import BITS, FLOATS, INTEGERS, ClickFile, Loop, LoopSettings, PlcSettings
from pidcfg.schemas.numbers import decimal_text
from pidcfg.text.paths import Data

# --- A CLICK configuration to its C, DS and DF registers --------------------------------------------------------------

EXPLICIT_FIELDS = frozenset({"output.pwm"})
"""No register holds whether the output is pulsed."""


def encode(config: ClickFile) -> Encoding:
    """The three blocks of every loop; requests and what the help does not name are 0."""
    blocks = tuple(block for i, loop in enumerate(config.loops) for block in _loop_blocks(i, loop))
    settings = tuple(settings_of(LoopSettings, loop, BANKS, EXPLICIT_FIELDS) for loop in config.loops)
    return Encoding(
        "click", blocks, SPACE, settings, without_none({"name": config.name, "description": config.description})
    )


def _loop_blocks(i: int, loop: Loop) -> Iterator[Block]:
    values = values_of(loop)
    for key, (prefix, table) in BLOCKS.items():
        start = SPACE.number_of(prefix, getattr(loop, key))
        yield Block(("loops", i), start, table, table.encode(values, {}), loop.name)


def values_of(loop: Loop) -> Data:
    """Every register's value by path; the rate-of-change alarm is that of one sample."""
    rate = loop.alarms.rate_of_change
    per_sample = None if rate is None else rate.per_sample(loop.sample_rate).value
    return {**mapped(loop, TABLES, UNUSED_CONTENTS), "alarms.rate_of_change": per_sample}


def pv_alarms_on(loop: Loop) -> bool:
    """Whether the bit of the four PV alarms is set."""
    return is_enabled(loop, "alarms.pv.enabled")


def deviation_alarms_on(loop: Loop) -> bool:
    """Whether the bit of the two deviation alarms is set."""
    return is_enabled(loop, "alarms.deviation.enabled")


# --- CLICK registers back to a configuration --------------------------------------------------------------------------
#
# The result is plain data in the order of a hand-written file, with everything left out that is a default, so that
# encoding it again gives the same registers. What cannot be carried is in the notes.

LOOP_OPTIONS = (
    LoopOption(("bits",), "bits", "where the C bits begin"),
    LoopOption(("integers",), "integers", "where the DS registers begin"),
    LoopOption(("floats",), "floats", "where the DF registers begin"),
    LoopOption(("output", "pwm"), "pwm_bit", "whether the output is pulsed (PWM), which no register holds"),
)
"""What options say when no settings stand beside the registers."""
ALWAYS_WRITTEN = frozenset({"mode", "tuning.derivative_gain", "output.pwm.period"})
"""Fields that are written even where they are defaults."""


def default_name(index: int) -> str:
    """What a loop is called whose listing does not say its name: a name that nicknames can be made of."""
    return f"LOOP{index + 1}"


def decode(
    words: Mapping[int, int],
    settings: Sequence[Mapping[str, object]] = (),
    plc: Settings | None = None,
    options: Mapping[str, object] | None = None,
) -> Decoded:
    """The configuration that these registers hold; raises `DecodeError` with the address of what is no value.

    ``settings`` and ``plc`` are what an encoder put beside the registers. ``options``: ``bits``, ``integers``,
    ``floats`` and ``pwm_bit``, each a list of one entry a loop.
    """
    entries = with_options(settings, options or {}, LOOP_OPTIONS, default_name)
    plc_settings = read_settings(PlcSettings, plc or {}, "plc")
    loops, notes = [], []
    for loop, blocks in read_loops(LoopSettings, entries, words, SPACE, BLOCKS):
        loops.append(_loop_data(loop, blocks))
        notes += [*_mode_notes(loop, blocks[0]), *(note for block in blocks for note in block.note_omitted(MODE_BITS))]
    data: Data = {"pidcfg": 1, "vendor": "click"}
    data |= without_none({"name": plc_settings.name, "description": plc_settings.description})
    return Decoded({**data, "loops": loops}, tuple(notes))


def _mode_notes(settings: LoopSettings, bits: LoopBlock) -> Iterator[str]:
    """A note on the mode that the bits of a loop tell, if D952 is right, and on what the file has."""
    modes = [name for name in MODE_BITS if bits.raw_word(name)]
    if modes:
        shown = " and ".join(f"{name.partition('_')[0].title()} by {bits.address(name)}" for name in modes)
        advice = f"if these bits mean something else, nothing tells the mode; it stays {settings.mode} in the file"
        yield f"{settings.loop}: {shown}, unconfirmed (D952): {advice}"


def _loop_data(settings: LoopSettings, blocks: Sequence[LoopBlock]) -> Data:
    values = settings_values(settings, BANKS) | {"mode": settings.mode}
    unset: Data = {}
    for block in blocks:
        values |= block.read_values({})
        unset |= block.table.read_back(defaults_of(Loop, [block.table], UNUSED_CONTENTS), {})
    if settings.output.pwm is None:
        values["output.pwm"] = None
    values["sample_rate"] = f"{decimal_text(values['sample_rate'].scaleb(3))} ms"
    return file_data(Loop, values, unset, ALWAYS_WRITTEN | {"setpoint.value"} if settings.setpoint else ALWAYS_WRITTEN)


# --- The three blocks of each CLICK loop: no register says where they are, so a configuration or options do -----------

ADDRESS_OPTIONS = tuple(row for row in LOOP_OPTIONS if row.option in BANKS)
BLOCK_BANKS = {"bits": BITS, "integers": INTEGERS, "floats": FLOATS}

MODE_REGISTERS = MODE_BITS
"""What tells a loop's mode, unconfirmed (D952)."""
MODE_IS_CONFIRMED = False


def mode_of(manual: int, auto: int) -> str:
    """The mode that the two bits tell, as unconfirmed; empty: they tell none."""
    return {(1, 0): "manual (unconfirmed)", (0, 1): "auto (unconfirmed)"}.get((manual, auto), "")


def areas(_words: Mapping[int, int], like: Image | None, options: Mapping[str, object]) -> list[Area]:
    """The blocks of all loops; raises `DecodeError` naming the option that is missing."""
    entries = with_options(() if like is None else like.settings, options, ADDRESS_OPTIONS, default_name)
    return [
        Area(SPACE.number_of(prefix, BLOCK_BANKS[key].parse(entry[key])), table, str(entry["loop"]))
        for entry in entries
        for key, (prefix, table) in BLOCKS.items()
    ]


# --- How a CLICK loop holds its gains: % of the output per PV unit, and seconds ---------------------------------------

NO_FILTER_PERCENT = 100
"""The derivative gain limit that filters nothing."""


def tuning_of(_: ClickFile, loop: Loop) -> LoopTuning:
    """The three numbers of a loop; its integral cannot be switched off, the longest reset time is as good."""
    tuning = loop.tuning
    limit = loop.derivative_gain_limit
    has_limit = is_switched_on(loop.derivative_gain_limit_enabled, limit)
    has_filter = is_switched_on(loop.pv.filter_enabled, loop.pv.filter)
    return LoopTuning(
        TUNING_NUMBERS,
        raises_pv=loop.action == TUNING_NUMBERS.heating,
        current_values=(tuning.proportional_gain, tuning.reset_time, tuning.derivative_gain),
        obstacle="it squares its error (error.curve)" if loop.error.curve == "squared" else "",
        no_derivative="its derivative_gain_limit of 0 removes the derivative" if has_limit and not limit else "",
        off_texts=(f"{TUNING_NUMBERS.no_integral}", "0"),
        sample_time=float(loop.sample_rate),
        pv_share=float(loop.pv.filter or 100) / 100 if has_filter else 1.0,
        derivative_limit=float(limit) if has_limit and limit and limit < NO_FILTER_PERCENT else None,
    )
