"""An EZLogix configuration to its registers and discretes and back, and how a loop holds its gains."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from pidcfg.encoders.codecs import DecodeError, Position, Scale
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
    read_loops,
    read_settings,
    settings_of,
    settings_values,
    values_of,
    with_options,
    without_none,
)
from pidcfg.encoders.maps.ezlogix import BANKS, BLOCKS, CV, MAP_SPACE, SPACE, TABLES, TUNING_NUMBERS, counts_format
from pidcfg.encoders.regmap import LoopTuning
from pidcfg.schemas.ezlogix import (
    CV_FULL,
    DISCRETES,
    REGISTERS,
    WORD_MAX,
    EzlogixFile,
    Loop,
    LoopSettings,
    OutputSettings,
    Plc,
    PlcSettings,
    PvSettings,
)
from pidcfg.schemas.ezlogix import Output as OutputSection
from pidcfg.schemas.ezlogix import Pv as PvSection
from pidcfg.schemas.numbers import EXACT_CONTEXT
from pidcfg.text.paths import Data

# --- An EZLogix configuration to its registers and discretes ----------------------------------------------------------

EXPLICIT_FIELDS = frozenset({"output.pulse"})
"""Without it the control output is not enabled, which no register holds."""


def encode(config: EzlogixFile) -> Encoding:
    """Both blocks of every loop; what the PLC itself writes, and the request to tune, are 0."""
    blocks = tuple(block for i, loop in enumerate(config.loops) for block in _loop_blocks(i, loop))
    settings = tuple(settings_of(LoopSettings, loop, BANKS, EXPLICIT_FIELDS) for loop in config.loops)
    return Encoding("ezlogix", blocks, SPACE, settings, _plc_settings(config))


def _loop_blocks(i: int, loop: Loop) -> Iterator[Block]:
    scales = scales_of(loop.pv, loop.output, root=loop.pv.square_root)
    values = values_of(loop, TABLES, unset_limits(scales))
    for key, (prefix, table) in BLOCKS.items():
        start = SPACE.number_of(prefix, getattr(loop, key))
        yield Block(("loops", i), start, table, table.encode(values, scales), loop.name, scales=scales)


def scales_of(pv: PvSection | PvSettings, output: OutputSection | OutputSettings, *, root: bool) -> dict[str, Scale]:
    """The scales ``pv``, ``sp`` and ``output`` of a loop's registers; ``root``: it extracts the root of its PV."""
    form = counts_format(*(pv.counts or (0, CV_FULL)))
    return {"pv": Scale(form, pv.range), "sp": Scale(form, pv.range, has_root=root), "output": Scale(CV, output.range)}


def unset_limits(scales: Mapping[str, Scale]) -> Data:
    """The limits of a set point that has none: the ends of its scale."""
    return {f"setpoint.limits.{i}": end for i, end in enumerate(scales["sp"].ends)}


def _plc_settings(config: EzlogixFile) -> dict[str, object]:
    """What no register holds for the whole file; that the PLC goes on when it is stopped, always."""
    names = config.plc.tag_names
    return without_none(
        {
            "name": config.name,
            "description": config.description,
            "process_when_stopped": config.plc.process_when_stopped,
            "tag_names": None if names == Plc.model_fields["tag_names"].default else names,
            "map": config.plc.map,
        }
    )


# --- EZLogix registers and discretes back to a configuration ----------------------------------------------------------
#
# A listing alone cannot tell a heating loop from a cooling one: action, algorithm and tags stand beside the
# registers, or are demanded. Everything that is a default is left out, so that encoding the result again gives the
# same registers.

LOOP_OPTIONS = (
    LoopOption(("registers",), "registers", "where the 32 registers begin"),
    LoopOption(("discretes",), "discretes", "where the 8 discretes begin"),
    LoopOption(("action",), "action", "the controller action (direct or reverse), which no register holds"),
    LoopOption(("algorithm",), "algorithm", "the algorithm (position or velocity), which no register holds"),
    LoopOption(("pv", "tag"), "pv_tag", "the tag of the PV"),
    LoopOption(("output", "tag"), "cv_tag", "the tag of the CV"),
    LoopOption(("output", "pulse"), "output_tag", "whether there is a control output", needed=False),
)
"""What options say when no settings stand beside the registers."""
TERM_TIMES = ("tuning.integral_time", "tuning.derivative_time")
"""Times of terms that 0 switches off."""
PV_WORDS = ("setpoint", "deadband", "setpoint_low", "setpoint_high")
"""Registers on the PV's scale."""
REGISTER_RANGE = (0, WORD_MAX)
"""Counts of a PV that is scaled by the ladder program."""
ALWAYS_WRITTEN = frozenset({"mode", *TERM_TIMES})
"""Fields that are written even where they are defaults."""


def decode(
    words: Mapping[int, int],
    settings: Sequence[Mapping[str, object]] = (),
    plc: Settings | None = None,
    options: Mapping[str, object] | None = None,
) -> Decoded:
    """The configuration that these registers hold; raises `DecodeError` with the address of what is no value.

    ``settings`` and ``plc`` are what an encoder put beside the registers. ``options``: one list for each row of
    `LOOP_OPTIONS`, of one entry a loop.
    """
    entries = with_options(settings, options or {}, LOOP_OPTIONS)
    plc_settings = read_settings(PlcSettings, plc or {}, "plc")
    loops, notes = [], []
    for loop_settings, (registers, discretes) in read_loops(LoopSettings, entries, words, SPACE, BLOCKS):
        _require_pulses(loop_settings, registers)
        loop, count_notes = _complete_counts(loop_settings, registers, discretes)
        notes += count_notes
        loops.append(_loop_data(loop, registers, discretes))
        notes += [*registers.note_omitted(), *discretes.note_omitted()]
    data: Data = {"pidcfg": 1, "vendor": "ezlogix"}
    data |= without_none({"name": plc_settings.name, "description": plc_settings.description})
    section = file_data(Plc, dict(plc_settings))
    if not plc:
        notes.append("process_when_stopped is taken as true, the dialog's default; no register holds it")
    return Decoded({**data, **({"plc": section} if section else {}), "loops": loops}, tuple(notes))


def _require_pulses(settings: LoopSettings, registers: LoopBlock) -> None:
    """A cycle time without a word on the control output could be either."""
    if registers.raw_word("cycle_time") and "pulse" not in settings.output.model_fields_set:
        raise DecodeError(
            f"{settings.loop}: {registers.address('cycle_time')} holds a cycle time, but the listing does not say "
            "whether the control output is enabled; give --output-tag (none: it is not)",
            registers.start + registers.table.offset_of("cycle_time"),
        )


def _complete_counts(
    settings: LoopSettings, registers: LoopBlock, discretes: LoopBlock
) -> tuple[LoopSettings, list[str]]:
    """The settings with all counts that a register holds where the PV's registers go beyond 4095 (D951), and a note."""
    top = scales_of(settings.pv, settings.output, root=bool(discretes.raw_word("square_root")))["sp"].top_counts
    largest = max(PV_WORDS, key=registers.raw_word)
    if settings.pv.counts is not None or registers.raw_word(largest) <= top:
        return settings, []
    held = registers.raw_word(largest)
    problem = f"{settings.loop}: {registers.address(largest)} ({largest}) holds {held}, more than {top}"
    if settings.pv.range is not None:
        return settings, [f"{problem}, the end of pv.range: say in pv.counts which counts its ends are"]
    assumption = f"pv.counts is taken as {[*REGISTER_RANGE]}, all that a register holds (D951)"
    pv = settings.pv.model_copy(update={"counts": REGISTER_RANGE})
    advice = "write what it holds at the ends of its range, which is what runs are judged by"
    return settings.model_copy(update={"pv": pv}), [f"{problem}: {assumption}; {advice}"]


def _loop_data(settings: LoopSettings, registers: LoopBlock, discretes: LoopBlock) -> Data:
    choices = discretes.read_values({})
    scales = scales_of(settings.pv, settings.output, root=choices["pv.square_root"])
    values = settings_values(settings, BANKS) | choices | registers.read_values(scales)
    if settings.output.pulse is None:
        values["output.pulse"] = None
    for path in TERM_TIMES:
        values[path] = values[path] or "off"
    unset = registers.table.read_back(defaults_of(Loop, [registers.table], unset_limits(scales)), scales)
    return file_data(Loop, values, unset, ALWAYS_WRITTEN | {"setpoint.value"} if settings.setpoint else ALWAYS_WRITTEN)


# --- The two blocks of each EZLogix loop: no register says where they are, so a configuration or options do -----------

ADDRESS_OPTIONS = tuple(row for row in LOOP_OPTIONS if row.option in BANKS)
BLOCK_BANKS = {"registers": REGISTERS, "discretes": DISCRETES}
MODE_REGISTERS = ("mode",)
"""The discrete that tells a loop's mode."""


def mode_of(raw: int) -> str:
    """The mode that the discrete tells."""
    return "auto" if raw else "manual"


def areas(_words: Mapping[int, int], like: Image | None, options: Mapping[str, object]) -> list[Area]:
    """The blocks of all loops; raises `DecodeError` naming the option that is missing."""
    entries = with_options(() if like is None else like.settings, options, ADDRESS_OPTIONS)
    return [
        Area(SPACE.number_of(prefix, BLOCK_BANKS[key].parse(entry[key])), table, str(entry["loop"]))
        for entry in entries
        for key, (prefix, table) in BLOCKS.items()
    ]


def tag_positions(entry: Settings) -> Iterator[tuple[str, int, Position]]:
    """PV and output of a loop, which stand outside of its blocks: the signal, its register, and what it is on."""
    for signal, key, scale in (("PV", "pv", "pv"), ("OUT", "output", "output")):
        number = MAP_SPACE.parse(str(entry[key]["tag"]))
        if number is not None:
            yield signal, number, Position(scale)


# --- How an EZLogix loop holds its gains: counts of the CV per count of the PV, and seconds ---------------------------


def tuning_of(_: EzlogixFile, loop: Loop) -> LoopTuning:
    """The three numbers of a loop; 0 to 4095 counts are more than the PV's range where its counts are fewer."""
    tuning, pv, output = loop.tuning, loop.pv.range, loop.output.range
    counts = scales_of(loop.pv, loop.output, root=loop.pv.square_root)["sp"].format.span
    return LoopTuning(
        TUNING_NUMBERS,
        raises_pv=loop.action == TUNING_NUMBERS.heating,
        pv_span=None if pv is None else EXACT_CONTEXT.divide((pv[1] - pv[0]) * CV_FULL, counts),
        output_span=None if output is None else output[1] - output[0],
        current_values=(tuning.proportional_gain, tuning.integral_time, tuning.derivative_time),
        off_texts=("off", "off"),
        sample_time=float(loop.sample_rate),
    )
