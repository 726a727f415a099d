"""EZLogix loops as neutral loops, what they do when they are switched, and neutral loops as EZLogix ones."""

from __future__ import annotations

from dataclasses import dataclass
from decimal import ROUND_FLOOR, Decimal
from typing import TYPE_CHECKING

from pidcfg.conversion import ConvertError, MissingField
from pidcfg.conversion.builder import (
    HUNDRED,
    ONE,
    ZERO,
    NeutralBuilder,
    SameField,
    Span,
    TargetBuilder,
    apply_table,
    assign_addresses,
    assign_names,
    product,
    quotient,
    rescale,
    rescale_outer_loops,
    round_computed,
    same_fields,
    target_file,
    unmatched_fields,
    width,
)
from pidcfg.conversion.operation import (
    ADDED_ANTI_WINDUP,
    Hand,
    Operation,
    Stopped,
    Transfer,
    VendorSettings,
    Windup,
    Zero,
)
from pidcfg.encoders.codecs import is_raw, round_to_integer
from pidcfg.encoders.ezlogix.image import scales_of
from pidcfg.encoders.maps.ezlogix import BLOCKS, DUTY_COUNTS, R_BLOCK
from pidcfg.schemas.ezlogix import CV_FULL, DISCRETES, REGISTERS, WORD_MAX, parse_counts
from pidcfg.schemas.numbers import EXACT_CONTEXT, decimal_text, plain_number
from pidcfg.text.frozen import frozen
from pidcfg.text.paths import is_given
from pidcfg.text.references import Decision

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.conversion import NeutralLoop, TargetFile
    from pidcfg.conversion.builder import Table
    from pidcfg.encoders.codecs import Scale
    from pidcfg.encoders.image import Settings
    from pidcfg.schemas.base import Quantity
    from pidcfg.schemas.ezlogix import EzlogixFile
    from pidcfg.schemas.ezlogix import Loop as SourceLoop
    from pidcfg.schemas.generic import GenericFile, Loop, Pulse

# --- EZLogix loops as neutral ones: counts become engineering units, and the controller's action the process's --------

D289 = Decision(
    289,
    "gain 0 is a gain of one count per count without the proportional term",
    "Gain 0 becomes no proportional action, with one count of the CV per count of the PV before the other two; a loop "
    "without a proportional action gets gain 0, and its gain goes into the times.",
    "By the manual's text 0 removes the proportional term alone; its formula then leaves Ts/Ti and Td/Ts of an error "
    "in counts.",
)
D290 = Decision(
    290,
    "a CV tag that is a set point register is a cascade",
    "It becomes the source of that loop's set point, and a set point's source becomes the CV tag of the other loop, "
    "where both scales are 0 to 4095 counts. Without the square root in the loop that follows.",
    "Both are one register, in counts.",
)
RAISES_PV = {"reverse": True, "direct": False}
"""Whether the PV rises with the output, by the word for the controller's action: reverse is heating."""
DERIVATIVE_ON = {"position": "error", "velocity": "pv"}
"""What the derivative acts on, by the algorithm."""
PERCENT_RANGE: Span = (ZERO, HUNDRED)
"""The output's range when the file gives none."""
FULL_COUNTS = Decimal(CV_FULL)
SP_OFFSET = R_BLOCK.offset_of("setpoint")
PLACE_REASON = "a place in this PLC, which means nothing elsewhere"
HARMLESS_FIELDS = {
    **dict.fromkeys(("registers", "discretes", "pv.tag", "output.tag", "output.pulse.tag"), PLACE_REASON),
    "pv.counts": "values are engineering units",
    "pv.square_root": "off: the PV is taken as it is",
    "autotune.type": "as every loop has it: the default",
    "autotune.timeout": "as every loop has it: the default",
    "output.offset": "at the low end of the output it adds nothing",
    "plc.process_when_stopped": "see operation.stopped where the target does something else",
    "plc.tag_names": "names in this PLC's project",
    "plc.map": "where this PLC's registers are",
}
"""Fields that may come without a line of their own, and why nothing is lost with them."""


@dataclass(slots=True)
class ScaledLoop:
    """A loop with its scales in engineering units."""

    loop: SourceLoop
    sp: Scale
    cv: Scale
    pv_range: Span
    cv_range: Span

    def setpoint(self, value: Quantity) -> Decimal:
        """A value on the PV's scale."""
        return position(value, self.sp, self.pv_range)

    def output(self, value: Quantity) -> Decimal:
        """A value on the output's scale."""
        return position(value, self.cv, self.cv_range)

    @property
    def unit_gain(self) -> Decimal:
        """Output units per PV unit that are one count of the CV per count of the PV."""
        counts = product(Decimal(self.sp.format.span), width(self.cv_range))
        return quotient(counts, product(FULL_COUNTS, width(self.pv_range)))


def position(value: Quantity, scale: Scale, span: Span) -> Decimal:
    """A value on a scale, in engineering units of ``span``."""
    if not is_raw(value, scale):
        return value.value
    share = quotient(product(value.value - scale.zero_counts, width(span)), scale.full_counts)
    return round_computed(EXACT_CONTEXT.add(span[0], share))


def distance(value: Quantity, scale: Scale, span: Span) -> Decimal:
    """A difference on a scale, in engineering units of ``span``."""
    if not is_raw(value, scale):
        return value.value
    return round_computed(quotient(product(value.value, width(span)), scale.full_counts))


def to_neutral(config: EzlogixFile) -> list[NeutralLoop]:
    """The loops in neutral form, with what became of every field."""
    sources = {loop.output.tag: loop for loop in config.loops}
    loops = []
    for i, loop in enumerate(config.loops):
        b = NeutralBuilder(i)
        apply_table(b, loop, loop, NEUTRAL_HEAD)
        if loop.pv.range is None:
            low, high = loop.pv.counts or (0, CV_FULL)
            ends = f"the engineering values at {low} and {high} counts of the PV"
            b.require("pv.range", f"add pv.range: [low, high], {ends}")
        else:
            scales = scales_of(loop.pv, loop.output, root=loop.pv.square_root)
            s = ScaledLoop(loop, scales["sp"], scales["output"], loop.pv.range, loop.output.range or PERCENT_RANGE)
            apply_table(b, loop, s, NEUTRAL_FIELDS)
        outer = sources.get(f"{REGISTERS.prefix}{loop.registers + SP_OFFSET}")
        if outer is not None:
            _cascade(b, loop, outer)
        loops.append(b.loop)
    return rescale_outer_loops(loops)


def _cascade(b: NeutralBuilder, loop: SourceLoop, outer: SourceLoop) -> None:
    """The set point register is another loop's CV tag (D290)."""
    tag = outer.output.tag
    if loop.pv.square_root or (loop.pv.counts or (0, CV_FULL)) != (0, CV_FULL):
        b.drop("registers", tag, f"{outer.name} writes its CV into the set point, in counts: program it with its scale")
        return
    b.put("registers", tag, "setpoint.source", outer.name, f"the CV tag of {outer.name} is the set point")
    if loop.mode == "auto":
        b.set("mode", "cascade")


def _gain(b: NeutralBuilder, s: ScaledLoop) -> None:
    tuning = s.loop.tuning
    gain = round_computed(product(tuning.proportional_gain or ONE, s.unit_gain))
    b.put("tuning.proportional_gain", tuning.proportional_gain, "tuning.gain", gain)
    if not tuning.proportional_gain:
        b.put(
            "tuning.proportional_gain",
            tuning.proportional_gain,
            "tuning.proportional",
            neutral_value=False,
            note="0 removes the proportional term; before the others stands 1 count per count",
        )


def _deadband(b: NeutralBuilder, s: ScaledLoop) -> None:
    b.put("deadband", _quantity_text(s.loop.deadband), "deadband", distance(s.loop.deadband, s.sp, s.pv_range))


def _neutral_setpoint(b: NeutralBuilder, s: ScaledLoop) -> None:
    setpoint = s.loop.setpoint
    if setpoint.value is not None:
        b.put("setpoint.value", _quantity_text(setpoint.value), "setpoint.value", s.setpoint(setpoint.value))
    if setpoint.limits is None:
        return
    texts, ends = [_quantity_text(end) for end in setpoint.limits], [s.setpoint(end) for end in setpoint.limits]
    if ends[0] < ends[1]:
        b.put("setpoint.limits", texts, "setpoint.limits", ends)
    elif ends[0] == ends[1]:
        b.drop("setpoint.limits", texts, "both are one value: hold the set point in the program")
    else:
        b.require("setpoint.limits", f"the set point limits {texts[0]} and {texts[1]} do not ascend")


def _neutral_output(b: NeutralBuilder, s: ScaledLoop) -> None:
    output, span = s.loop.output, list(s.cv_range)
    if output.range is None:
        b.put("output.range", None, "output.range", span, "no output.range: 0 to 100 % is assumed", assumed=True)
    else:
        b.put("output.range", span, "output.range", span)
    unit = "%" if output.unit is None and output.range is None else output.unit
    if unit is not None:
        b.put("output.unit", output.unit, "output.unit", unit, assumed=output.unit is None)
    if is_given(s.loop, ("output", "limits")):
        texts, ends = [_quantity_text(end) for end in output.limits], [s.output(end) for end in output.limits]
        if ends[0] >= ends[1]:
            b.require("output.limits", f"the CV limits {texts[0]} and {texts[1]} do not ascend")
        else:
            b.put("output.limits", texts, "output.limits", ends)
    offset = s.output(output.offset)
    if offset != span[0] or (span[0] and not s.loop.tuning.integral_time):
        b.put("output.offset", _quantity_text(output.offset), "output.bias", offset)


def _autotune(b: NeutralBuilder, s: ScaledLoop) -> None:
    b.drop_choices("autotune", s.loop.autotune, "choose it when the new controller is tuned")


def _quantity_text(value: Quantity) -> int | float | str:
    """A quantity as the file writes it."""
    return f"{value.value} counts" if value.counts else plain_number(value.value)


NEUTRAL_HEAD = (
    *same_fields("name", "description", "mode"),
    SameField("action", "output_raises_pv", RAISES_PV),
    SameField("sample_rate", "sample_time"),
)
NEUTRAL_FIELDS: Table[NeutralBuilder, ScaledLoop] = (
    _gain,
    *same_fields("tuning.integral_time", "tuning.derivative_time"),
    SameField("algorithm", "tuning.derivative_on", DERIVATIVE_ON),
    *same_fields("pv.range", "pv.unit"),
    SameField("pv.square_root", skip_falsy=True),
    _deadband,
    _neutral_setpoint,
    _neutral_output,
    SameField("output.pulse.cycle_time", "output.pulse.period"),
    *same_fields("output.pulse.min_on", "output.pulse.min_off", "anti_windup"),
    _autotune,
)
"""Every field in the order of the report."""

# --- EZLogix loops: the mode is a bit that stays; a change to auto makes the integral of the CV (PID Loop Mode) -------


def _pv_counts_options(config: EzlogixFile, source_loops: Sequence[int]) -> dict[str, object]:
    """How the PVs are counted."""
    return {"pv_counts": [config.loops[i].pv.counts or (0, CV_FULL) for i in source_loops]}


OWN_SETTINGS = VendorSettings(
    ("registers", "discretes", "pv.tag", "output.tag", "output.pulse.tag"),
    {"/plc.process_when_stopped": ""},
    _pv_counts_options,
    hand=Hand.FREE,
    zero=Zero.OF_RANGE,
)
"""Its registers and tags, and whether its loops go on while the PLC is stopped, of which no option speaks."""


def operations(config: EzlogixFile) -> list[Operation]:
    """Of each loop (D165, D167, D170); anti-windup looks at 0 and 4095 counts, not at the CV limits."""
    asked = Stopped.GOES_ON if "process_when_stopped" in config.plc.model_fields_set else Stopped.AS_GIVEN
    stopped = asked if config.plc.process_when_stopped else Stopped.STANDS
    return [
        Operation(
            hand=OWN_SETTINGS.hand,
            zero=OWN_SETTINGS.zero,
            limits_master=True,
            transfer=Transfer.ON_TOP,
            windup=Windup.CONDITIONAL_AT_ENDS if loop.anti_windup else Windup.ENDLESS,
            smoothing=None,
            stopped=stopped,
        )
        for loop in config.loops
    ]


# --- Whether the loops of a converted EZLogix go on while their PLC is stopped ----------------------------------------

D760 = Decision(
    760,
    "an EZLogix that stands for another PLC goes on while it is stopped only where the source's does",
    "`process_when_stopped` is written in a conversion: true where a loop of the source is independent of its CPU's "
    "mode, else false. A file of the same vendor keeps what it has. The check box is one for all loops.",
    "The dialog's default is to go on (manual, Process PID when PLC is Stopped). The other families' loops stand still "
    "with their PLC, and a heater that goes on behind a STOP is what nobody looks for.",
)


def stopped_section(builders: list[TargetBuilder], operations: Sequence[Operation]) -> dict[str, object]:
    """Whether the loops go on while the PLC is stopped (D760); nothing for loops that come from an EZLogix file."""
    answers = {operation.stopped for operation in operations}
    if not answers or Stopped.AS_GIVEN in answers:
        return {}
    goes_on = Stopped.GOES_ON in answers
    note = "the dialog's check box" if goes_on else "clear the dialog's check box: its default is to go on"
    builders[0].mark("/plc.process_when_stopped", None, note)
    return {"process_when_stopped": goes_on}


# --- Neutral loops as EZLogix ones: gains in counts per count, blocks from R1 and S1 upward, tags from IR1, OR1, O1 ---

D291 = Decision(
    291,
    "a converted PV is 0 to 4095 counts",
    "`pv.counts` of a converted loop is [0, 4095], unless --pv-counts says otherwise; the gain is worked out with it.",
    "No other controller tells how many counts the new input module makes, and the gain is in counts per count.",
)
PLACE_OPTIONS = ("registers", "discretes", "pv_tag", "cv_tag", "output_tag")


def _counts(text: str) -> tuple[int, int]:
    low, _, high = text.partition("-")
    return parse_counts([int(low), int(high)])


PULSE_TIME_STEP = Decimal("0.1")
"""Of a second: the last digit of the pulse's times."""
MAX_PULSE_TIME = WORD_MAX * PULSE_TIME_STEP
BANKS = {"registers": REGISTERS, "discretes": DISCRETES}
ACTIONS = {raises: action for action, raises in RAISES_PV.items()}
PROGRAM_ADVICE = {
    "setpoint.follows_pv": "copy the PV into the set point in the program while the loop is in Manual",
    "output.max_rate": "limit the change of the output in the program, between the CV and its output",
    "alarms.hysteresis": "switch alarms off in the program when the PV is back by {back}",
}
"""Neutral fields that a loop does not have, with what to program instead."""
ERROR_OFFSET = R_BLOCK.offset_of("error")
NO_BIAS_NOTE = "without an integral the output is gain x error + offset, and an offset of 0 counts is the low end"
ALGORITHMS = {what: algorithm for algorithm, what in DERIVATIVE_ON.items()}


@frozen
class EzlogixLoop:
    """A neutral loop, and where it goes in the PLC."""

    neutral: Loop
    counts: tuple[int, int]
    """Of the PV at both ends of its range."""
    pv_tag: str
    cv_tag: str
    pulse_tag: str
    """The discrete output, if it pulses."""


def from_neutral(file: GenericFile, options: Settings, operations: Sequence[Operation] = ()) -> TargetFile:
    """An EZLogix file with these loops."""
    count = len(file.loops)
    blocks = {
        key: assign_addresses(BANKS[key], table.size, count, options.get(key) or ())
        for key, (_, table) in BLOCKS.items()
    }
    outputs = [entry and entry["tag"] for entry in options.get("output_tag") or ()]
    pv_tags = assign_names(options.get("pv_tag") or (), count, "IR{}".format)
    cv_tags = assign_names(options.get("cv_tag") or (), count, "OR{}".format)
    pulse_tags = assign_names(outputs, count, "O{}".format)
    counts = _pv_counts(options.get("pv_counts") or (), count)
    builders = []
    for i, loop in enumerate(file.loops):
        b = TargetBuilder(i)
        apply_table(b, loop, loop, EZLOGIX_HEAD)
        for key, (prefix, _) in BLOCKS.items():
            b.put(key, f"{prefix}{blocks[key][i]}", None, "" if key in options else "the next free block")
        b.data["mode"] = "manual" if loop.mode == "manual" else "auto"
        apply_table(b, loop, EzlogixLoop(loop, counts[i], pv_tags[i], cv_tags[i], pulse_tags[i]), EZLOGIX_FIELDS)
        _anti_windup(b, loop, operations[i] if operations else None)
        builders.append(b)
    wired = len(options.get("cv_tag") or ())
    _link_cascades(builders, file.loops, [int(start) for start in blocks["registers"]], counts, wired)
    return target_file("ezlogix", file, builders, plc=stopped_section(builders, operations))


def _pv_counts(pairs: list[tuple[int, int]] | tuple[()], count: int) -> list[tuple[int, int]]:
    """The counts of each loop's PV: one pair for all, or one of each (D291)."""
    if len(pairs) not in {0, 1, count}:
        raise ConvertError([MissingField(("loops",), f"{len(pairs)} ranges of counts for {count} loops")])
    return list(pairs) if len(pairs) == count else [pairs[0] if pairs else (0, CV_FULL)] * count


# --- equation --------------------------------------------------------------------------------------------------------


def _algorithm(b: TargetBuilder, e: EzlogixLoop) -> None:
    tuning = e.neutral.tuning
    if tuning.derivative_time or is_given(tuning, ("derivative_on",)):
        b.put("algorithm", ALGORITHMS[tuning.derivative_on], "tuning.derivative_on")
    else:
        b.put("algorithm", "position", None, "without a derivative both algorithms are the same")
    if tuning.derivative_filter and tuning.derivative_time:
        b.drop("tuning.derivative_filter", "filter the PV in the program: the derivative has no filter")
    elif tuning.derivative_filter:
        b.drop("tuning.derivative_filter", "there is no derivative to be filtered")


def _tuning(b: TargetBuilder, e: EzlogixLoop) -> None:
    tuning, span = e.neutral.tuning, Decimal(e.counts[1] - e.counts[0])
    normalized_gain = quotient(product(tuning.gain, width(e.neutral.pv.range)), width(e.neutral.output.range))
    gain = quotient(product(normalized_gain, FULL_COUNTS), span)
    integral, derivative = tuning.integral_time, tuning.derivative_time
    if not gain:
        note = "gain 0 switches the proportional term off only: the times are off as well"
        b.put("tuning.proportional_gain", 0, "tuning.gain", note)
        integral = derivative = ZERO
    elif tuning.proportional:
        b.put("tuning.proportional_gain", gain, "tuning.gain", "counts per count")
    else:
        b.put("tuning.proportional_gain", 0, "tuning.proportional")
        integral, derivative = quotient(integral, gain), product(derivative, gain)
        note = "gain 0 counts as 1 for the other terms: the gain is in the times"
        b.mark("tuning.integral_time" if integral else "tuning.derivative_time", "tuning.gain", note)
    b.put("tuning.integral_time", integral, "tuning.integral_time")
    b.put("tuning.derivative_time", derivative, "tuning.derivative_time")


# --- PV and output ---------------------------------------------------------------------------------------------------


def _pv_tag(b: TargetBuilder, e: EzlogixLoop) -> None:
    b.put("pv.tag", e.pv_tag, None, "where the PV stands")


def _pv_counts_of_loop(b: TargetBuilder, e: EzlogixLoop) -> None:
    b.put("pv.counts", e.counts, None, "counts of the input at both ends of the range: the gain depends on them")


def _pv_filter(b: TargetBuilder, e: EzlogixLoop) -> None:
    if e.neutral.pv.filter:
        time = f"a time constant of {e.neutral.pv.filter:.4g} s"
        register = "the R register with the result becomes the PV's tag"
        b.drop("pv.filter", f"filter {e.pv_tag} in the program with {time}; {register}")


def _setpoint(b: TargetBuilder, e: EzlogixLoop) -> None:
    """Within its limits, which every PLC of the set controls to: this one refuses nothing and overwrites it (EZ438)."""
    value, limits = e.neutral.setpoint.value, e.neutral.setpoint.limits
    if value is None:
        return
    held = value if limits is None else max(min(value, limits[1]), limits[0])
    note = "" if held == value else "the limit is what the loop controls to"
    b.put("setpoint.value", held, "setpoint.value", note, exact=value, clamped=held != value)


def _cv_tag(b: TargetBuilder, e: EzlogixLoop) -> None:
    b.put("output.tag", e.cv_tag, None, "where the CV goes")


def _output(b: TargetBuilder, e: EzlogixLoop) -> None:
    output, integral = e.neutral.output, e.neutral.tuning.integral_time
    is_nothing = integral and not output.bias and not output.range[0] <= ZERO <= output.range[1]
    if is_given(output, ("bias",)) and not is_nothing:  # 0 mA on 4 to 20 mA: no bias, which an integral makes up for
        b.put("output.offset", output.bias, "output.bias")
    elif not integral and output.bias != output.range[0]:
        b.put("output.offset", output.bias, "output.bias", NO_BIAS_NOTE, assumed=True)
    if output.manual is not None:
        counts = round_to_integer(rescale(output.manual, output.range, (ZERO, FULL_COUNTS)))
        if counts:
            b.drop("output.manual", f"write {counts} counts into {e.cv_tag} while the loop is in Manual")
        else:
            b.mark("output.tag", "output.manual", "a loop starts with 0 counts")
    if output.pulse is not None:
        b.put("output.pulse.tag", e.pulse_tag, None, "the discrete output")
        _min_pulse(b, output.pulse)


def _min_pulse(b: TargetBuilder, pulse: Pulse) -> None:
    """The minimum on time; one of the whole cycle becomes the longest pulse, since full output is 4095 / 4096 of it."""
    if not pulse.min_on:
        return
    period, min_on = (min(time, MAX_PULSE_TIME) for time in (pulse.period, pulse.min_on))
    longest = product(period, quotient(FULL_COUNTS, Decimal(DUTY_COUNTS)))
    if longest < min_on.quantize(PULSE_TIME_STEP) and pulse.min_on <= pulse.period:
        held = longest.quantize(PULSE_TIME_STEP, ROUND_FLOOR)
        note = f"the longest pulse is {CV_FULL}/{DUTY_COUNTS} of the cycle: it would never switch on"
        b.put("output.pulse.min_on", held, "output.pulse.min_on", note, exact=pulse.min_on, clamped=True)
    else:
        b.put("output.pulse.min_on", pulse.min_on, "output.pulse.min_on")


# --- what the program does -------------------------------------------------------------------------------------------


def _alarms(b: TargetBuilder, e: EzlogixLoop) -> None:
    """There are none: what the program compares instead, in counts as its registers have them."""
    alarms = e.neutral.alarms
    for key, point in dict(alarms.pv).items():
        if point is not None:
            b.drop(f"alarms.pv.{key}", _point_advice(e, point, is_high=key.startswith("high")))
    for key, point in dict(alarms.deviation).items():
        if point is not None:
            b.drop(f"alarms.deviation.{key}", _deviation_advice(e, point))
    if alarms.rate_of_change is not None:
        per_sample = _distance_counts(e, product(alarms.rate_of_change, e.neutral.sample_time))
        apart = "" if e.neutral.pv.square_root or not per_sample else f": {per_sample} counts apart"
        b.drop("alarms.rate_of_change", f"compare {e.pv_tag} with what it was a sample before in the program{apart}")
    hysteresis = alarms.hysteresis
    back = _amount_text(e, hysteresis) if e.neutral.pv.square_root else f"{_distance_counts(e, hysteresis)} counts"
    b.drop_all((path, note.format(back=back)) for path, note in unmatched_fields(e.neutral, PROGRAM_ADVICE))


def _point_advice(e: EzlogixLoop, point: Decimal, *, is_high: bool) -> str:
    """What to compare the PV with, unless its register cannot come beyond that."""
    raw, limit = _raw(e.neutral, point, e.counts), WORD_MAX if e.pv_tag.startswith(REGISTERS.prefix) else CV_FULL
    text = f"{'above' if is_high else 'below'} {raw} counts"
    if raw >= limit if is_high else raw <= 0:
        return f"{e.pv_tag} is never {text}, so that it never trips: nothing to program"
    return f"compare {e.pv_tag} in the program: {text}"


def _deviation_advice(e: EzlogixLoop, point: Decimal) -> str:
    """What to compare the error with; beside a square root the manual does not say in which counts it is kept."""
    text = _amount_text(e, point)
    if e.neutral.pv.square_root:
        return f"compare set point and PV in the program: {text} apart; the counts of the register Error are not known"
    counts = f"{_distance_counts(e, point)} counts ({text})"
    return f"compare the register Error (Base+{ERROR_OFFSET}) in the program: beyond {counts}, above 0 or below"


def _amount_text(e: EzlogixLoop, amount: Decimal) -> str:
    return f"{decimal_text(amount)} {e.neutral.pv.unit}" if e.neutral.pv.unit else decimal_text(amount)


def _distance_counts(e: EzlogixLoop, amount: Decimal) -> int:
    """An amount of the PV in counts."""
    return round_to_integer(product(quotient(amount, width(e.neutral.pv.range)), Decimal(e.counts[1] - e.counts[0])))


def _raw(loop: Loop, point: Decimal, counts: tuple[int, int]) -> int:
    """A PV in counts of its register, which with the square root holds the square."""
    share = quotient(point - loop.pv.range[0], width(loop.pv.range))
    if loop.pv.square_root:
        return round_to_integer(product(share, share, Decimal(counts[1] - counts[0])))
    return round_to_integer(rescale(point, loop.pv.range, (Decimal(counts[0]), Decimal(counts[1]))))


def _anti_windup(b: TargetBuilder, loop: Loop, operation: Operation | None) -> None:
    """On, too, where the source's integral has an end without it (D342)."""
    ends = not loop.anti_windup and operation is not None and operation.bounds_integral
    b.put("anti_windup", loop.anti_windup or ends, "anti_windup", ADDED_ANTI_WINDUP if ends else "", assumed=ends)


# --- cascade ---------------------------------------------------------------------------------------------------------


def _link_cascades(
    builders: list[TargetBuilder],
    loops: tuple[Loop, ...],
    registers: list[int],
    counts: list[tuple[int, int]],
    assigned_count: int,
) -> None:
    """Set points that are another loop's output: its CV tag becomes their register (D290)."""
    numbers = {loop.name: i for i, loop in enumerate(loops)}
    linked_masters = set(range(assigned_count))
    for i, loop in enumerate(loops):
        source = loop.setpoint.source
        if source is None:
            _mode(builders[i], loop, linked=False)
            continue
        register, outer = f"{REGISTERS.prefix}{registers[i] + SP_OFFSET}", numbers.get(source)
        has_same_range = outer is not None and loops[outer].output.range == loop.pv.range
        if (
            outer is None
            or not has_same_range
            or outer in linked_masters
            or loop.pv.square_root
            or counts[i] != (0, CV_FULL)
        ):
            builders[i].drop("setpoint.source", f"scale the CV of {source} in the program and write it to {register}")
            _mode(builders[i], loop, linked=False)
            continue
        linked_masters.add(outer)
        fields = builders[outer].fields
        fields.remove(next(field for field in fields if field.path == "output.tag"))
        builders[outer].put("output.tag", register, None, f"the set point of {loop.name}")
        builders[i].mark("registers", "setpoint.source", f"{register} is the CV tag of {source}")
        _mode(builders[i], loop, linked=True)


def _mode(b: TargetBuilder, loop: Loop, *, linked: bool) -> None:
    """Auto with a linked set point is cascade, without one it is auto."""
    note = ""
    if loop.mode == "cascade" and not linked:
        note = "a loop has no cascade: the program writes its set point in auto"
    elif loop.mode == "auto" and linked:
        note = "its set point is always the CV of the other loop"
    b.mark("mode", "mode", note, clamped=bool(note))


EZLOGIX_HEAD = same_fields("name", "description")
EZLOGIX_FIELDS: Table[TargetBuilder, EzlogixLoop] = (
    _algorithm,
    SameField("output_raises_pv", "action", ACTIONS),
    SameField("sample_time", "sample_rate"),
    _tuning,
    _pv_tag,
    *same_fields("pv.range", "pv.unit"),
    _pv_counts_of_loop,
    SameField("pv.square_root", skip_falsy=True),
    _pv_filter,
    _setpoint,
    SameField("setpoint.limits", is_pair=True),
    _cv_tag,
    *same_fields("output.range", "output.unit"),
    SameField("output.limits", is_pair=True),
    _output,
    SameField("output.pulse.period", "output.pulse.cycle_time"),
    *same_fields("output.pulse.min_off", "deadband", skip_falsy=True),
    _alarms,
)
"""Every field in the order of the file."""
