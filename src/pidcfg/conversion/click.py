"""CLICK loops as neutral loops, what they do when they are switched, and neutral loops as CLICK ones."""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING

from pidcfg.conversion.builder import (
    HUNDRED,
    ONE,
    ZERO,
    NeutralBuilder,
    SameField,
    TargetBuilder,
    apply_table,
    assign_addresses,
    assign_names,
    filter_factor,
    filter_time,
    gain_limit,
    product,
    quotient,
    rescale,
    round_computed,
    same_fields,
    target_file,
    unmatched_fields,
    width,
)
from pidcfg.conversion.operation import (
    Deadband,
    Hand,
    Operation,
    Start,
    Transfer,
    VendorSettings,
    Windup,
    WithoutIntegral,
    Zero,
)
from pidcfg.encoders.click.image import deviation_alarms_on, pv_alarms_on
from pidcfg.encoders.codecs import round_to_integer
from pidcfg.encoders.image import is_switched_on
from pidcfg.encoders.maps.click import BLOCKS
from pidcfg.schemas.click import BITS, DERIVATIVE, FLOATS, GAIN, INTEGERS, RESET, SAMPLE_RATE
from pidcfg.schemas.numbers import decimal_text
from pidcfg.text.frozen import frozen
from pidcfg.text.paths import is_given
from pidcfg.text.references import Decision

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from pydantic import BaseModel

    from pidcfg.conversion import NeutralLoop, TargetFile
    from pidcfg.conversion.builder import Table
    from pidcfg.encoders.image import Settings
    from pidcfg.schemas.click import ClickFile
    from pidcfg.schemas.click import Loop as SourceLoop
    from pidcfg.schemas.generic import Deviation, GenericFile, Loop, Points

# --- CLICK loops as neutral ones: gains in % per unit of the PV become gains of a 0 to 100 % output -------------------

D285 = Decision(
    285,
    "a reset time of 6000 s is no integral",
    "6000 s, the longest reset time, becomes no integral, and no integral becomes 6000 s; every shorter time is one.",
    "The integral cannot be switched off, and the help advises 1000 s or so; but 1200 s is a time that a slow process "
    "can want, and nobody would miss the integral that 6000 s leaves.",
)
D286 = Decision(
    286,
    "a squared error has the gain of a full error",
    "Where the square has to be left out, the gain is multiplied by the PV's range, so that an error of the whole "
    "range moves the output as before, and the deadband is its root.",
    "The help squares the error in the PV's units. A controller that squares errors as a share of the range has the "
    "same effect with this gain.",
)
RAISES_PV = {"direct": True, "reverse": False}
"""Whether the PV rises with the output, by the word for the process's action."""
FOLLOWS_PV = {1: True, 2: False}
"""Whether Auto begins with the PV as the set point, by the bumpless mode."""
PERCENT_RANGE = (ZERO, HUNDRED)
"""The range of the output, in %."""
NO_INTEGRAL = Decimal(6000)
NO_FILTER = 100
SWITCHED_OFF_NOTE = "stored, but switched off"
SWITCHES = (
    *(f"{path}_enabled" for path in ("derivative_gain_limit", "pv.filter", "error.deadband", "alarms.rate_of_change")),
    *("setpoint.lower_limit_enabled", "setpoint.upper_limit_enabled", "alarms.pv.enabled", "alarms.deviation.enabled"),
)
ADDRESS_KEYS = ("bits", "integers", "floats", "output.pwm.bit")
HARMLESS_FIELDS = {
    **dict.fromkeys(ADDRESS_KEYS, "a place in this PLC, which means nothing elsewhere"),
    "action_verified": "the action is to be verified again in the new PLC",
    **dict.fromkeys(("state.raw_pv", "state.pv", "state.bias"), "the controller writes it"),
    **dict.fromkeys(SWITCHES, "it shows in what it switches"),
    **dict.fromkeys(("autotune.method", "autotune.type", "autotune.hysteresis"), "as every loop has it: the default"),
    "error.curve": "linear is the neutral form",
    "freeze_bias": "there is no integral that could wind up",
}
"""Fields that may come without a line of their own, and why nothing is lost with them."""


def to_neutral(config: ClickFile) -> list[NeutralLoop]:
    """The loops in neutral form, with what became of every field."""
    loops = []
    for i, loop in enumerate(config.loops):
        b = NeutralBuilder(i)
        if loop.pv.range[0] < loop.pv.range[1]:
            apply_table(b, loop, loop, NEUTRAL_FIELDS)
        else:
            b.require("pv.range", "the range of the process has no width (CK321)")
        loops.append(b.loop)
    return loops


def _neutral_sample_rate(b: NeutralBuilder, loop: SourceLoop) -> None:
    b.put("sample_rate", f"{decimal_text(loop.sample_rate.scaleb(3))} ms", "sample_time", loop.sample_rate)


def _value_if_on(b: NeutralBuilder, model: BaseModel, path: str, default: Decimal) -> Decimal | None:
    """A value that has a switch, while it is on; ``default`` is what its register holds when it is not given."""
    key = path.rpartition(".")[2]
    value, bit = getattr(model, key), getattr(model, f"{key}_enabled")
    if is_switched_on(bit, value):
        return default if value is None else Decimal(value)
    if value is not None:
        b.drop(path, value, SWITCHED_OFF_NOTE)
    return None


# --- equation --------------------------------------------------------------------------------------------------------


def _is_squared(loop: SourceLoop) -> bool:
    return loop.error.curve == "squared"


def _neutral_tuning(b: NeutralBuilder, loop: SourceLoop) -> None:
    gain, reset = loop.tuning.proportional_gain, loop.tuning.reset_time
    if _is_squared(loop):
        b.put(
            "tuning.proportional_gain",
            gain,
            "tuning.gain",
            product(gain, width(loop.pv.range)),
            assumed=True,
            note="with the square left out, an error of the whole range moves the output as before",
        )
    else:
        b.put("tuning.proportional_gain", gain, "tuning.gain", gain)
    has_no_integral = reset >= NO_INTEGRAL
    b.put(
        "tuning.reset_time",
        reset,
        "tuning.integral_time",
        ZERO if has_no_integral else reset,
        "6000 s is taken for no integral" if has_no_integral else "",
    )


def _derivative(b: NeutralBuilder, loop: SourceLoop) -> None:
    time = loop.tuning.derivative_gain
    limit = _value_if_on(b, loop, "derivative_gain_limit", ZERO)
    if limit == 0:
        b.put("derivative_gain_limit", loop.derivative_gain_limit, "tuning.derivative_time", ZERO)
        if time:
            b.drop("tuning.derivative_gain", time, "the derivative gain limit is 0, which switches the derivative off")
        return
    b.put("tuning.derivative_gain", time, "tuning.derivative_time", time)
    if time:
        b.put("tuning.derivative_gain", time, "tuning.derivative_on", "error")
    if limit is None:
        return
    if not time:
        b.drop("derivative_gain_limit", limit, "there is no derivative to be limited")
        return
    constant = ZERO if limit >= NO_FILTER else round_computed(quotient(time, limit))
    b.put("derivative_gain_limit", limit, "tuning.derivative_filter", constant)


def _error(b: NeutralBuilder, loop: SourceLoop) -> None:
    if _is_squared(loop):
        b.drop(
            "error.curve",
            "squared",
            "square the error in the new controller, or tune it anew: small errors now count for more",
        )
    deadband = _value_if_on(b, loop.error, "error.deadband", ZERO)
    if deadband is not None and _is_squared(loop):
        note = "the root, since the error is no longer squared"
        b.put("error.deadband", deadband, "deadband", round_computed(deadband.sqrt()), note, assumed=True)
    elif deadband is not None:
        b.put("error.deadband", deadband, "deadband", deadband)


# --- PV, set point and output ----------------------------------------------------------------------------------------


def _pv_span(loop: SourceLoop) -> tuple[Decimal, Decimal]:
    """The range of the PV: the instrument's, where the file gives it."""
    return loop.pv.input_range or loop.pv.range


def _neutral_pv_range(b: NeutralBuilder, loop: SourceLoop) -> None:
    pv = loop.pv
    if pv.input_range is None:
        note = "the range of the process is taken for that of the instrument; pv.input_range gives the instrument's"
        b.put("pv.range", list(pv.range), "pv.range", list(pv.range), note, assumed=True)
    else:
        b.put("pv.input_range", list(pv.input_range), "pv.range", list(pv.input_range))
        if pv.range == pv.input_range:
            b.mark("pv.range", list(pv.range), "pv.range")
        else:
            b.drop("pv.range", list(pv.range), "what the process reaches matters to the autotune only")


def _neutral_pv_filter(b: NeutralBuilder, loop: SourceLoop) -> None:
    constant = _value_if_on(b, loop.pv, "pv.filter", Decimal(NO_FILTER))
    if constant is not None:
        b.put("pv.filter", constant, "pv.filter", filter_time(quotient(constant, HUNDRED), loop.sample_rate))


def _setpoint_limits(b: NeutralBuilder, loop: SourceLoop) -> None:
    low = _value_if_on(b, loop.setpoint, "setpoint.lower_limit", ZERO)
    high = _value_if_on(b, loop.setpoint, "setpoint.upper_limit", ZERO)
    if low is None and high is None:
        return
    fields = {"setpoint.lower_limit": low, "setpoint.upper_limit": high}
    ends = [pv_end if end is None else end for end, pv_end in zip(fields.values(), _pv_span(loop), strict=True)]
    if ends[0] >= ends[1]:
        for path, value in fields.items():
            if value is not None:
                b.drop(path, value, "the limits leave no range of set points; limit it in the program")
        return
    b.set("setpoint.limits", ends)
    for i, (path, value) in enumerate(fields.items()):
        note = "not given: the end of the PV's range" if value is None else ""
        b.mark(path, value, f"setpoint.limits.{i}", note=note, assumed=value is None)


def _neutral_output(b: NeutralBuilder, loop: SourceLoop) -> None:
    output = loop.output
    unit = output.unit or "%"
    b.put("output.unit", unit, "output.range", list(PERCENT_RANGE))
    b.put("output.unit", unit, "output.unit", unit)
    low, high = output.limits
    if low >= high:
        b.require("output.limits", f"the output limits {low} and {high} do not ascend: write the lower one first")
    elif is_given(loop, ("output", "limits")):
        b.put("output.limits", [low, high], "output.limits", [low, high])


def _neutral_bias(b: NeutralBuilder, loop: SourceLoop) -> None:
    """The bias register of a loop without an integral (D283); Auto makes it of the output, which counts where alone."""
    bias, output = loop.state.bias, loop.state.output
    is_constant = loop.tuning.reset_time >= NO_INTEGRAL
    if bias is not None and is_constant:
        b.put("state.bias", bias, "output.bias", bias)
    elif output is not None and is_constant:
        b.put("state.output", output, "output.bias", output, "a change to Auto makes it the bias")


# --- alarms ----------------------------------------------------------------------------------------------------------


def _points(
    b: NeutralBuilder, path: str, points: Mapping[str, Decimal | None], *, on: bool, harmless: Mapping[str, bool]
) -> None:
    """The alarms that share a switch; one that is not given is compared with 0 all the same."""
    for key, value in points.items():
        if value is not None and on:
            b.put(f"{path}.{key}", value, f"{path}.{key}", value)
        elif value is not None:
            b.drop(f"{path}.{key}", value, SWITCHED_OFF_NOTE)
        elif on and not harmless[key]:
            b.drop(f"{path}.{key}", None, "not given: this PLC compares with 0, since one bit enables all")


def _pv_alarms(b: NeutralBuilder, loop: SourceLoop) -> None:
    pv, (low, high) = loop.alarms.pv, _pv_span(loop)
    if pv is None:
        return
    harmless = {"low_low": low >= 0, "low": low >= 0, "high": high <= 0, "high_high": high <= 0}
    points = {"low_low": pv.low_low, "low": pv.low, "high": pv.high, "high_high": pv.high_high}
    _points(b, "alarms.pv", points, on=pv_alarms_on(loop), harmless=harmless)


def _deviation_alarms(b: NeutralBuilder, loop: SourceLoop) -> None:
    deviation = loop.alarms.deviation
    if deviation is not None:
        points = {"high": deviation.high, "high_high": deviation.high_high}
        _points(b, "alarms.deviation", points, on=deviation_alarms_on(loop), harmless=dict.fromkeys(points, False))


def _rate_of_change(b: NeutralBuilder, loop: SourceLoop) -> None:
    rate = loop.alarms.rate_of_change
    if is_switched_on(loop.alarms.rate_of_change_enabled, rate):
        change = ZERO if rate is None else rate.per_sample(loop.sample_rate).value
        second = round_computed(quotient(change, loop.sample_rate))
        b.put("alarms.rate_of_change", ZERO if rate is None else str(rate), "alarms.rate_of_change", second)
    elif rate is not None:
        b.drop("alarms.rate_of_change", str(rate), SWITCHED_OFF_NOTE)


# --- the loop ---------------------------------------------------------------------------------------------------------


def _autotune(b: NeutralBuilder, loop: SourceLoop) -> None:
    b.drop_choices("autotune", loop.autotune, "choose it when the new controller is tuned")


NEUTRAL_FIELDS: Table[NeutralBuilder, SourceLoop] = (
    *same_fields("name", "description", "mode"),
    SameField("action", "output_raises_pv", RAISES_PV),
    _neutral_sample_rate,
    _neutral_tuning,
    _derivative,
    _neutral_pv_range,
    SameField("pv.unit"),
    _neutral_pv_filter,
    SameField("setpoint.value"),
    _setpoint_limits,
    _neutral_output,
    SameField("output.pwm.period", "output.pulse.period"),
    SameField("state.output", "output.manual"),
    _neutral_bias,
    _error,
    _pv_alarms,
    _deviation_alarms,
    _rate_of_change,
    SameField("alarms.hysteresis"),
    SameField("freeze_bias", "anti_windup"),
    SameField("bumpless", "setpoint.follows_pv", FOLLOWS_PV),
    _autotune,
)
"""Every field in the order of the report."""

# --- CLICK loops: each starts in manual, and a change to auto makes the bias of the output (help CL246) ---------------

OWN_SETTINGS = VendorSettings(("bits", "integers", "floats"), hand=Hand.FREE, zero=Zero.OF_RANGE)
"""Its blocks."""


def operations(config: ClickFile) -> list[Operation]:
    """Of each loop (D111 to D113, D119); mode 1 sets the set point to the PV, so that there is no error on top."""
    return [
        Operation(
            start=Start.WAITS,
            hand=OWN_SETTINGS.hand,
            zero=OWN_SETTINGS.zero,
            transfer=Transfer.GOES_ON if loop.bumpless == 1 else Transfer.ON_TOP,
            without_integral=WithoutIntegral.TAKEN_OVER,
            windup=Windup.FROZEN if loop.freeze_bias else Windup.WITHIN_LIMITS,
            squares_error=_is_squared(loop),
            slowest_integral=NO_INTEGRAL,
            has_edge=True,
            deadband=Deadband.ONLY_BIAS,
        )
        for loop in config.loops
    ]


# --- Alarms of a neutral loop as CLICK ones, which one bit enables for a whole group ----------------------------------

D287 = Decision(
    287,
    "an alarm that is not wanted goes where the PV cannot get",
    "Of the PV's alarms the outer points go a range's width outside the range, of the deviation's the outer one to the "
    "width of the range; an inner point that is not wanted goes to the outer one.",
    "One bit enables all alarms of a group, and a register that is not given is compared like any other.",
)


def pv_alarms(b: TargetBuilder, loop: Loop) -> None:
    """The four points of the PV."""
    _put_group(b, "alarms.pv", dict(loop.alarms.pv), _pv_points(loop.alarms.pv, loop.pv.range))


def deviation_alarms(b: TargetBuilder, loop: Loop) -> None:
    """The two points of the deviation."""
    deviation = loop.alarms.deviation
    _put_group(b, "alarms.deviation", dict(deviation), _deviation_points(deviation, loop.pv.range))


def _put_group(
    b: TargetBuilder, path: str, given_points: Mapping[str, Decimal | None], points: Mapping[str, Decimal]
) -> None:
    """All points of a group, when one of them is wanted."""
    if all(value is None for value in given_points.values()):
        return
    for key, value in points.items():
        if given_points[key] is None:
            b.put(f"{path}.{key}", value, None, "not wanted: one bit enables all of them")
        else:
            b.put(f"{path}.{key}", value, f"{path}.{key}")


def _pv_points(points: Points, span: tuple[Decimal, Decimal]) -> dict[str, Decimal]:
    """The four points with those that are not wanted out of reach (D287)."""
    reach = width(span)
    low, high = _inner_point(points.low, points.low_low), _inner_point(points.high, points.high_high)
    lowest = span[0] - reach if low is None else min(span[0] - reach, low)
    highest = span[1] + reach if high is None else max(span[1] + reach, high)
    return {
        "low_low": lowest if points.low_low is None else points.low_low,
        "low": lowest if low is None else low,
        "high": highest if high is None else high,
        "high_high": highest if points.high_high is None else points.high_high,
    }


def _deviation_points(points: Deviation, span: tuple[Decimal, Decimal]) -> dict[str, Decimal]:
    """Both points, the one that is not wanted out of reach or at the other (D287)."""
    high = _inner_point(points.high, points.high_high) or ZERO
    return {"high": high, "high_high": max(width(span), high) if points.high_high is None else points.high_high}


def _inner_point(point: Decimal | None, outer: Decimal | None) -> Decimal | None:
    return outer if point is None else point


# --- Neutral loops as CLICK ones: gains in % of the output per unit of the PV, blocks from C1, DS1 and DF1 upward -----

D288 = Decision(
    288,
    "a loop without a proportional action gets the smallest gain",
    "The gain becomes the smallest that its register and those of the two times allow, and the times shrink or grow "
    "with it, so that integral and derivative act as strongly as before.",
    "The gain stands before all three terms and cannot be 0.",
)
BANKS = {"bits": BITS, "integers": INTEGERS, "floats": FLOATS}
ACTIONS = {raises: action for action, raises in RAISES_PV.items()}
PROGRAM_ADVICE = {
    "pv.square_root": "take the root in the program, before the raw PV (DFn+11)",
    "output.max_rate": "limit the change of the output in the program",
}
"""Neutral fields that a loop does not have, with what to program instead."""
TRANSFERS = {follows: mode for mode, follows in FOLLOWS_PV.items()}
MIN_GAIN, MIN_RESET, MAX_RATE = (Decimal(str(end)) for end in (GAIN.low, RESET.low, DERIVATIVE.high))
MIN_SAMPLE, MAX_SAMPLE = Decimal(str(SAMPLE_RATE.low)), Decimal(str(SAMPLE_RATE.high))
SP_OFFSET, OUTPUT_OFFSET = 0, 8
"""Where set point and output stand in the block of floats."""


@frozen
class ClickLoop:
    """A neutral loop, and where it goes in the PLC."""

    neutral: Loop
    pulse_bit: str
    """Its discrete output, if it pulses."""
    sample_ms: int
    """Its sample rate."""
    setpoint_register: str
    """The register of its set point."""
    outputs: Mapping[str, str]
    """The registers of the outputs of all loops, by their names."""

    @property
    def sample_time(self) -> Decimal:
        """The sample rate in s."""
        return Decimal(self.sample_ms).scaleb(-3)


def from_neutral(
    file: GenericFile,
    options: Settings,
    operations: Sequence[Operation] = (),
) -> TargetFile:
    """A CLICK file with these loops."""
    count = len(file.loops)
    blocks = {
        key: assign_addresses(BANKS[key], table.size, count, options.get(key) or ())
        for key, (_, table) in BLOCKS.items()
    }
    pulses = assign_names([entry and entry["bit"] for entry in options.get("pwm_bit") or ()], count, "Y{:03d}".format)
    outputs = {loop.name: f"DF{blocks['floats'][i] + OUTPUT_OFFSET}" for i, loop in enumerate(file.loops)}
    builders = []
    for i, loop in enumerate(file.loops):
        b = TargetBuilder(i)
        apply_table(b, loop, loop, CLICK_HEAD)
        for key, (prefix, _) in BLOCKS.items():
            b.put(key, f"{prefix}{blocks[key][i]}", None, "" if key in options else "the next free block")
        rate = round_to_integer(min(max(loop.sample_time, MIN_SAMPLE), MAX_SAMPLE).scaleb(3))
        apply_table(
            b, loop, ClickLoop(loop, pulses[i], rate, f"DF{blocks['floats'][i] + SP_OFFSET}", outputs), CLICK_FIELDS
        )
        builders.append(b)
    return target_file("click", file, builders)


def _sample_rate(b: TargetBuilder, c: ClickLoop) -> None:
    time = c.neutral.sample_time
    clamped = not MIN_SAMPLE <= time <= MAX_SAMPLE
    b.put("sample_rate", f"{c.sample_ms} ms", "sample_time", exact=time, clamped=clamped)


def _mode(b: TargetBuilder, c: ClickLoop) -> None:
    """There is no cascade."""
    cascade = c.neutral.mode == "cascade"
    note = "a loop has no cascade: the program writes its set point in auto" if cascade else ""
    b.put("mode", "auto" if cascade else c.neutral.mode, "mode", note, clamped=cascade)


def _bumpless(b: TargetBuilder, c: ClickLoop) -> None:
    """Mode 1 sets the set point to the PV; where nothing is said it stays, if there is one."""
    setpoint = c.neutral.setpoint
    if setpoint.follows_pv is not None:
        b.put("bumpless", TRANSFERS[setpoint.follows_pv], "setpoint.follows_pv")
        return
    keeps = setpoint.value is not None or setpoint.source is not None
    b.put("bumpless", TRANSFERS[not keeps], None, "the set point stays" if keeps else "Auto begins with the present PV")


# --- equation --------------------------------------------------------------------------------------------------------


def _terms(loop: Loop) -> tuple[Decimal, Decimal, Decimal]:
    """Gain, reset time and derivative time as they are written."""
    tuning, percent_per_unit = loop.tuning, quotient(HUNDRED, width(loop.output.range))
    gain, reset, rate = product(tuning.gain, percent_per_unit), tuning.integral_time, tuning.derivative_time
    if tuning.proportional or not gain:
        return gain, reset, rate
    factor = quotient(_smallest_gain(gain, reset, rate), gain)
    return product(gain, factor), product(reset, factor), quotient(rate, factor)


def _tuning(b: TargetBuilder, c: ClickLoop) -> None:
    tuning = c.neutral.tuning
    gain, reset, rate = _terms(c.neutral)
    if not tuning.proportional:
        b.drop(
            "tuning.proportional",
            "P cannot be switched off: the gain is the smallest there is, and the times are changed with it",
        )
    b.put("tuning.proportional_gain", gain, "tuning.gain")
    note = "6000 s is the longest reset time, and counts as no integral" if not reset or reset >= NO_INTEGRAL else ""
    b.put("tuning.reset_time", reset or NO_INTEGRAL, "tuning.integral_time", note)
    b.put("tuning.derivative_gain", rate, "tuning.derivative_time")
    if tuning.derivative_on == "error":
        b.mark("tuning.derivative_gain", "tuning.derivative_on", "it acts on the error")
    elif rate:
        b.drop(
            "tuning.derivative_on",
            "the derivative acts on the error, so a step of the set point kicks the output: "
            "ramp the set point in the program",
        )


def _smallest_gain(gain: Decimal, reset: Decimal, rate: Decimal) -> Decimal:
    """The smallest gain with which integral and derivative keep their strength (D288)."""
    for_reset = quotient(product(gain, MIN_RESET), reset) if reset else ZERO
    return max(MIN_GAIN, for_reset, quotient(product(gain, rate), MAX_RATE))


def _derivative_filter(b: TargetBuilder, c: ClickLoop) -> None:
    constant, (_, _, rate) = c.neutral.tuning.derivative_filter, _terms(c.neutral)
    if not constant:
        return
    if not rate:
        b.drop("tuning.derivative_filter", "there is no derivative to be filtered")
        return
    limit = gain_limit(rate, constant, NO_FILTER)
    if limit >= NO_FILTER:
        b.drop("tuning.derivative_filter", "shorter than a hundredth of the derivative time, which is the shortest")
        return
    b.put(
        "derivative_gain_limit",
        limit,
        "tuning.derivative_filter",
        f"a filter of derivative time / {limit}",
        exact=constant,
        held=quotient(rate, Decimal(limit)),
        clamped=constant > rate,
    )


# --- PV, set point and output ----------------------------------------------------------------------------------------


def _pv_range(b: TargetBuilder, c: ClickLoop) -> None:
    span = c.neutral.pv.range
    note = "that of the instrument: write what the process reaches at 0 and 100 % of the output"
    b.put("pv.range", span, "pv.range", note, assumed=True)
    b.put("pv.input_range", span, "pv.range", "the range of the instrument")


def _pv_filter(b: TargetBuilder, c: ClickLoop) -> None:
    if not c.neutral.pv.filter:
        return
    percent = product(filter_factor(c.neutral.pv.filter, c.sample_time), HUNDRED)
    if round_to_integer(percent) >= NO_FILTER:
        b.drop("pv.filter", f"with a sample rate of {decimal_text(c.sample_time)} s such a filter passes everything")
    else:
        note = "% of the raw PV that each sample passes"
        b.put("pv.filter", max(round_to_integer(percent), 1), "pv.filter", note, exact=percent, clamped=percent < ONE)


def _output(b: TargetBuilder, c: ClickLoop) -> None:
    output, span = c.neutral.output, c.neutral.output.range
    is_percent = span == PERCENT_RANGE
    range_text = " to ".join(decimal_text(end) for end in span)
    note = f"0 to 100 % of the output are {range_text} {output.unit or ''}".rstrip()
    exact = [rescale(end, span, PERCENT_RANGE) for end in output.limits or span]
    output_limits = [min(max(end, ZERO), HUNDRED) for end in exact]
    b.put("output.limits", output_limits, "output.range" if is_percent else None, "" if is_percent else note)
    if not is_percent:
        b.mark("output.limits", "output.range", f"the output is in %: {note}", assumed=True)
    if output.limits is not None:
        for i in range(2):
            b.mark(f"output.limits.{i}", f"output.limits.{i}", exact=exact[i], clamped=output_limits[i] != exact[i])
    if output.unit is not None and is_percent:
        b.put("output.unit", output.unit, "output.unit")
    elif output.unit is not None:
        b.mark("output.limits", "output.unit", f"the output is in %: {note}", assumed=True)
    if output.manual is not None:
        b.put("state.output", rescale(output.manual, span, PERCENT_RANGE), "output.manual")
    _bias(b, c.neutral, rescale(output.bias, span, PERCENT_RANGE), output_limits)


def _bias(b: TargetBuilder, loop: Loop, bias: Decimal, limits: Sequence[Decimal]) -> None:
    """The output in Manual becomes the bias in Auto: without an integral it begins with the wanted one."""
    given, limited_bias = is_given(loop, ("output", "bias")), min(max(bias, limits[0]), limits[1])
    if given and loop.tuning.integral_time:
        b.put("state.bias", bias, "output.bias", "Auto begins with the output as it stands in Manual", assumed=True)
    if loop.tuning.integral_time or not (given or bias or limited_bias or loop.output.manual):
        return
    note = "Auto makes the bias of the output, which begins there"
    if loop.output.manual is not None:
        note = f"bring the output to {decimal_text(limited_bias)} % in Manual before going to Auto: it becomes the bias"
    b.put("state.bias", limited_bias, "output.bias", note, assumed=limited_bias == bias, clamped=limited_bias != bias)
    if loop.output.manual is None:
        b.put("state.output", limited_bias, None, "Auto makes the bias of the output")


def _pulse(b: TargetBuilder, c: ClickLoop) -> None:
    pulse = c.neutral.output.pulse
    if pulse is None:
        return
    b.put("output.pwm.bit", c.pulse_bit, None, "the dialog alone holds it")
    b.put("output.pwm.period", pulse.period, "output.pulse.period")
    for key, what in (("min_on", "pulses"), ("min_off", "gaps")):
        time = getattr(pulse, key)
        if time:
            b.drop(f"output.pulse.{key}", f"leave {what} shorter than {decimal_text(time)} s out in the program")


def _alarms(b: TargetBuilder, c: ClickLoop) -> None:
    pv_alarms(b, c.neutral)
    deviation_alarms(b, c.neutral)
    rate = c.neutral.alarms.rate_of_change
    if rate is not None:
        b.put("alarms.rate_of_change", product(rate, c.sample_time), "alarms.rate_of_change", "per sample")


def _drop_unmatched(b: TargetBuilder, c: ClickLoop) -> None:
    """What the program does in place of the loop."""
    b.drop_all(unmatched_fields(c.neutral, PROGRAM_ADVICE))
    source = c.neutral.setpoint.source
    if source is not None:
        low, high = (decimal_text(end) for end in c.neutral.pv.range)
        output = f"{c.outputs[source]} of {source}" if source in c.outputs else f"the output of {source}"
        note = f"scale {output}, 0 to 100 %, to {low} to {high} in the program, and write it to {c.setpoint_register}"
        b.drop("setpoint.source", note)


CLICK_HEAD = same_fields("name", "description")
CLICK_FIELDS = (
    _mode,
    SameField("output_raises_pv", "action", ACTIONS),
    _sample_rate,
    _bumpless,
    SameField("anti_windup", "freeze_bias"),
    _tuning,
    _derivative_filter,
    _pv_range,
    SameField("pv.unit"),
    _pv_filter,
    SameField("setpoint.value"),
    SameField("setpoint.limits.0", "setpoint.lower_limit"),
    SameField("setpoint.limits.1", "setpoint.upper_limit"),
    _output,
    _pulse,
    SameField("deadband", "error.deadband", skip_falsy=True),
    _alarms,
    SameField("alarms.hysteresis", skip_falsy=True),
    _drop_unmatched,
)
"""Every field in the order of the file."""
