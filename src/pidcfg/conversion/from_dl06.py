"""DL06 loops as neutral ones: scales, error term and alarms, and what they do when they are switched."""

from __future__ import annotations

from collections.abc import Sequence
from decimal import Decimal
from typing import Any

from pidcfg.conversion import NeutralLoop
from pidcfg.conversion.builder import (
    HUNDRED,
    ONE,
    ZERO,
    NeutralBuilder,
    SameField,
    Table,
    apply_table,
    filter_time,
    product,
    quotient,
    rescale_outer_loops,
    round_computed,
    same_fields,
    width,
)
from pidcfg.conversion.operation import (
    Hand,
    Interlock,
    Master,
    Operation,
    Start,
    Stopped,
    Transfer,
    VendorSettings,
    Windup,
    WithoutIntegral,
    Zero,
)
from pidcfg.encoders.codecs import Scale, is_raw
from pidcfg.encoders.dl06.image import (
    OUTPUT_OFFSET,
    deviation_alarms_on,
    loop_start,
    make_scales,
    pv_alarms_on,
    reset_value,
)
from pidcfg.encoders.image import is_switched_on
from pidcfg.encoders.maps.dl06 import RESET
from pidcfg.schemas.base import SECONDS, Quantity, v_name
from pidcfg.schemas.dl06 import Dl06File, Loop, RampSoak
from pidcfg.schemas.dl06 import Transfer as Dl06Transfer
from pidcfg.schemas.numbers import EXACT_CONTEXT, decimal_text
from pidcfg.text.frozen import frozen
from pidcfg.text.paths import Data
from pidcfg.text.references import Decision

# ----------------------------------------------------------------------------------------------------------------------
# DL06 quantities, which may be raw counts, as exact engineering values; what a square-root loop makes of alarms.

D284 = Decision(
    284,
    "alarms of a square-root loop become alarms of the flow",
    "A DL06 compares its absolute alarms with the raw PV; in a conversion a point is the flow whose square it is. Its "
    "deviation and rate-of-change alarms and its hysteresis are differences of squares and are dropped.",
    "The PV of the neutral loop is the root. A difference of squares is another flow at every set point.",
)


SIGNIFICANT_DIGITS = 10


def round_to_ten_digits(value: Decimal) -> Decimal:
    """What was worked out from a neutral number, which may itself be a quotient of `terms.DIGITS` digits."""
    return Decimal(f"{value:.{SIGNIFICANT_DIGITS}g}") if value else ZERO


def position(scale: Scale, value: Quantity) -> Decimal:
    """A value on a scale that has a range."""
    if not is_raw(value, scale) or scale.range is None:
        return value.value
    share = quotient(product(value.value - scale.zero_counts, scale.width), scale.full_counts)
    return round_computed(EXACT_CONTEXT.add(scale.range[0], share))


def distance(scale: Scale, value: Quantity) -> Decimal:
    """A difference on a scale that has a range."""
    if not is_raw(value, scale):
        return value.value
    return round_computed(quotient(product(value.value, scale.width), scale.full_counts))


def root_flow(scale: Scale, value: Quantity) -> Decimal:
    """The root of a raw PV, in units of the flow (D284); a negative PV has none."""
    low = scale.range[0] if scale.range else ZERO
    share = quotient(max(scale.position(value), ZERO), Decimal(scale.format.span))
    return round_computed(EXACT_CONTEXT.add(low, product(EXACT_CONTEXT.sqrt(share), scale.width)))


def square_of_flow(scale: Scale, value: Decimal) -> Decimal:
    """The value on the raw scale whose root is a flow (D284)."""
    low, span = scale.range[0] if scale.range else ZERO, Decimal(scale.format.span)
    share = max(quotient(value - low, scale.width), ZERO)
    counts = product(share, share, span) - scale.format.minimum
    return round_to_ten_digits(EXACT_CONTEXT.add(low, quotient(product(counts, scale.width), span)))


# --- A DL06 loop with its scales, and its values as its file writes them ----------------------------------------------

ZERO_COUNTS = Quantity(Decimal(0), counts=True)
"""What a word holds that is not given."""
SWITCHED_OFF_NOTE = "switched off here, so it is not carried over"


@frozen
class Dl06Loop:
    """A loop, its file, and the scales of its quantities."""

    config: Dl06File
    loop: Loop
    scales: dict[str, Scale]


def keep_if_on(b: NeutralBuilder, path: str, value: object, bit: bool | None) -> bool:  # noqa: FBT001 - an enable bit
    """Whether a value with an enable bit is switched on; a value that is not is dropped."""
    on = is_switched_on(bit, value)
    if not on and value is not None:
        b.drop(path, quantity_text(value), SWITCHED_OFF_NOTE)
    return on


def put_limits(b: NeutralBuilder, path: str, pair: tuple[Quantity, Quantity], scale: Scale) -> None:
    """A pair of limits of the set point or the output."""
    low, high = (position(scale, end) for end in pair)
    if low >= high:
        b.require(path, f"correct {path}: {quantity_text(pair[0])} is not below {quantity_text(pair[1])}")
    b.put(path, [quantity_text(end) for end in pair], path, [low, high])


def quantity_text(value: object) -> Any:
    """A value as the file writes it."""
    if isinstance(value, Quantity):
        return f"{decimal_text(value.value)} counts" if value.counts else value.value
    if isinstance(value, tuple) and not hasattr(value, "_fields"):
        return [quantity_text(part) for part in value]
    return str(value) if isinstance(value, tuple) else value


# --- Error term and alarms of a DL06 loop, to the neutral form --------------------------------------------------------

PV_POINTS = ("low_low", "low", "high", "high_high")
DEVIATIONS = {"yellow": "high", "red": "high_high"}
ZERO_WORD_NOTE = "not given: the PLC compares with 0 counts"
ROOT_NOTE = "it compares the differential pressure, not its root: choose it anew for the flow"


def error_fields(b: NeutralBuilder, s: Dl06Loop) -> None:
    """Curve and deadband of the error."""
    error, scale = s.loop.error, s.scales["sp"]
    is_squared = error.curve == "squared"
    if is_squared:
        b.drop("error.curve", error.curve, "square the error, keeping its sign, before the loop, or retune it")
    if not keep_if_on(b, "error.deadband", error.deadband, error.deadband_enabled):
        return
    if error.deadband is None:
        b.drop("error.deadband_enabled", error.deadband_enabled, "on without a value: it ignores nothing")
        return
    size = distance(scale, error.deadband)
    note = ""
    if is_squared:  # D31: the deadband is applied to the square
        size = round_computed(EXACT_CONTEXT.sqrt(max(product(size, scale.width), ZERO)))
        note = "compared with the squared error here: its root"
    b.put("error.deadband", quantity_text(error.deadband), "deadband", size, note=note)


def alarm_fields(b: NeutralBuilder, s: Dl06Loop) -> None:
    """All alarms of a loop."""
    alarms = s.loop.alarms
    points = {key: getattr(alarms.pv, key) for key in PV_POINTS} if alarms.pv else {}
    for key, value in points.items():
        _point(b, s, f"alarms.pv.{key}", value, f"alarms.pv.{key}", on=pv_alarms_on(s.loop))
    points = {key: getattr(alarms.deviation, key) for key in DEVIATIONS} if alarms.deviation else {}
    for key, value in points.items():
        neutral = f"alarms.deviation.{DEVIATIONS[key]}"
        _point(b, s, f"alarms.deviation.{key}", value, neutral, on=deviation_alarms_on(s.loop))
    _rate_of_change(b, s)
    if alarms.hysteresis is not None:
        _span(b, s, "alarms.hysteresis", alarms.hysteresis, "alarms.hysteresis")


def _point(b: NeutralBuilder, s: Dl06Loop, field: str, value: Quantity | None, neutral: str, *, on: bool) -> None:
    """A point of a group that one bit enables: one that is not given is compared all the same (D20)."""
    if not on:
        if value is not None:
            b.drop(field, quantity_text(value), SWITCHED_OFF_NOTE)
        return
    quantity, note = (ZERO_COUNTS, ZERO_WORD_NOTE) if value is None else (value, "")
    if neutral.startswith("alarms.deviation"):
        _span(b, s, field, quantity, neutral, note=note)
    else:
        change = root_flow if s.loop.pv.square_root else position
        point = change(s.scales["pv"], quantity)
        b.put(field, quantity_text(value), neutral, point, note=note, assumed=value is None)


def _span(b: NeutralBuilder, s: Dl06Loop, field: str, value: Quantity, neutral: str, note: str = "") -> None:
    """A difference of PVs."""
    if s.loop.pv.square_root:
        b.drop(field, quantity_text(value), ROOT_NOTE)
    else:
        b.put(field, quantity_text(value), neutral, distance(s.scales["pv"], value), note=note, assumed=bool(note))


def _rate_of_change(b: NeutralBuilder, s: Dl06Loop) -> None:
    alarms, field = s.loop.alarms, "alarms.rate_of_change"
    rate = alarms.rate_of_change
    if not keep_if_on(b, field, rate, alarms.rate_of_change_enabled):
        return
    change = ZERO_COUNTS if rate is None else rate.per_sample(s.loop.sample_rate)
    if s.loop.pv.square_root:
        b.drop(field, quantity_text(rate), ROOT_NOTE)
        return
    value = round_computed(quotient(distance(s.scales["pv"], change), s.loop.sample_rate))
    if rate is None:
        b.put("alarms.rate_of_change_enabled", alarms.rate_of_change_enabled, field, value, note=ZERO_WORD_NOTE)
    else:
        b.put(field, str(rate), field, value)


# --- A DL06 configuration to neutral loops ----------------------------------------------------------------------------
#
# Gains are shares of spans and become engineering units with the two ranges; what a word's bit switches off is not
# carried over.

D283 = Decision(
    283,
    "the bias is a constant only without an integral",
    "`state.bias`, else `state.output`, becomes the neutral bias of a DL06 or CLICK loop without an integral (of a "
    "DL06 0 counts without both); with one it is a running value and is not carried over. The other way a bias is "
    "written to the bias word, and where the file gives none, 0 of the output's range, which may be a word above 0.",
    "The bias word is the integrator. A change to Auto sets it to the output, whatever it was.",
)

HARMLESS_FIELDS = {
    "algorithm": "position is the neutral form; velocity is reported",
    "independent_of_cpu_mode": "see operation.stopped where the target does something else",
    "tuning.reset_unit": "times are seconds",
    "derivative_gain_limit_enabled": "a value that is switched off is reported",
    "pv.format": "values are engineering units",
    "pv.filter_enabled": "a value that is switched off is reported",
    "setpoint.limits_enabled": "a value that is switched off is reported",
    "output.format": "values are engineering units",
    "error.curve": "linear is the neutral form; squared is reported",
    "error.deadband_enabled": "a value that is switched off is reported",
    "alarms.pv.enabled": "points that are switched off are reported",
    "alarms.deviation.enabled": "points that are switched off are reported",
    "alarms.rate_of_change_enabled": "a value that is switched off is reported",
    "autotune.method": "a choice that differs from the default is reported",
    "autotune.type": "a choice that differs from the default is reported",
    "autotune.start": "reported when it is on",
    "state.pv": "the controller writes it",
    "state.bias": "the controller writes it; without an integral it is reported (D283)",
    "plc.loop_table": "a place in this PLC, which means nothing elsewhere",
    "plc.reset_decimals": "how a word is written; the reset time is reported",
    "plc.derivative": "of no effect without a derivative",
    "plc.number_of_loops": "the target counts its own",
    "pv.square_root": "off: the PV is taken as it is",
}
"""Fields that may come without a line in the report, and why."""

RAISES_PV = {"direct": True, "reverse": False}
"""Whether the PV rises with the output, by the word for the process's action."""
FOLLOWS_PV = {"I": True, "II": False}
"""Whether a change to Auto sets the set point to the PV, by the type of the transfer."""


def to_neutral(config: Dl06File) -> list[NeutralLoop]:
    """The loops of a file, each with what became of its fields."""
    return rescale_outer_loops([_neutral_loop(config, i, loop) for i, loop in enumerate(config.loops)])


def _neutral_loop(config: Dl06File, index: int, loop: Loop) -> NeutralLoop:
    b = NeutralBuilder(index)
    if loop.pv.range is None:
        b.require("pv.range", "add pv.range: the engineering values at 0 % and 100 %; the gain depends on its span")
    if not loop.sample_rate:
        b.require("sample_rate", "correct sample_rate: a loop with 0 s is not calculated")
    if not b.loop.missing:
        out_range = loop.output.range or (ZERO, HUNDRED)
        scales = make_scales(loop.pv.format, loop.output.format, (loop.pv.range, out_range), root=loop.pv.square_root)
        apply_table(b, loop, Dl06Loop(config, loop, scales), FIELDS)
    return b.loop


def _remote_setpoint(b: NeutralBuilder, s: Dl06Loop) -> None:
    """A pointer that is the output word of another loop is a cascade."""
    if s.loop.remote_setpoint is None:
        return
    outputs = {loop_start(s.config.plc, i) + OUTPUT_OFFSET: other.name for i, other in enumerate(s.config.loops)}
    address = s.loop.remote_setpoint
    name = v_name(address)
    if s.loop.cascade_from is not None:
        b.drop("remote_setpoint", name, "cascade_from stands in its place")
    elif address in outputs:
        b.put("remote_setpoint", name, "setpoint.source", outputs[address])
    else:
        b.drop("remote_setpoint", name, f"give the loop the set point that stands in {name} here")


def _velocity(b: NeutralBuilder, s: Dl06Loop) -> None:
    if s.loop.algorithm == "velocity":
        note = "the target calculates positions: an output that something else has moved is not continued from there"
        b.drop("algorithm", s.loop.algorithm, note)


def _anti_windup(b: NeutralBuilder, s: Dl06Loop) -> None:
    freeze, note = s.loop.bias_freeze, ""
    if s.loop.algorithm == "velocity":
        freeze, note = True, "the velocity form does not wind up"
    elif freeze and s.loop.output.limits is not None:
        note = "stops the bias only at the ends of the data range here"
    b.put("bias_freeze", s.loop.bias_freeze, "anti_windup", freeze, note)


def _tuning(b: NeutralBuilder, s: Dl06Loop) -> None:
    tuning = s.loop.tuning
    spans = width(s.scales["output"].range or ()), width(s.scales["pv"].range or ())
    gain = round_computed(quotient(product(tuning.gain or ONE, spans[0]), spans[1]))
    if tuning.gain:
        b.put("tuning.gain", tuning.gain, "tuning.gain", gain)
    else:
        note = "gain 0 takes the proportional action out; the others act as with gain 1"
        b.set("tuning.gain", gain)
        b.mark("tuning.gain", tuning.gain, "tuning.gain", "tuning.proportional", note=note)
        b.set("tuning.proportional", value=False)
    b.put("tuning.reset", _reset_text(s.loop), "tuning.integral_time", integral_time(s))


def integral_time(s: Dl06Loop) -> Decimal:
    """The reset time in s; 0: off, as the codes 0000 and 9999 are."""
    value, codec = reset_value(s.loop), RESET[s.config.plc.reset_decimals]
    if any(value == digits * codec.step for digits in codec.off):
        return ZERO
    return product(value, SECONDS["min"]) if s.loop.tuning.reset_unit == "minutes" else value


def _reset_text(loop: Loop) -> str:
    duration = loop.tuning.reset.duration
    if duration is None or duration.unit is not None:
        return str(loop.tuning.reset)
    return f"{decimal_text(duration.value)} {'min' if loop.tuning.reset_unit == 'minutes' else 's'}"


def _derivative(b: NeutralBuilder, s: Dl06Loop) -> None:
    """The rate and its gain limit N: a filter of Td/N; a limit of 0 is no derivative."""
    rate, limit = s.loop.tuning.rate, s.loop.derivative_gain_limit
    has_limit = keep_if_on(b, "derivative_gain_limit", limit, s.loop.derivative_gain_limit_enabled)
    if has_limit and not limit:
        _drop_derivative(b, s)
        return
    b.put("tuning.rate", rate, "tuning.derivative_time", rate)
    if rate:
        acts = s.config.plc.derivative
        b.put("plc.derivative", acts, "tuning.derivative_on", acts)
    if has_limit and limit:
        if rate:
            b.put("derivative_gain_limit", limit, "tuning.derivative_filter", round_computed(quotient(rate, limit)))
        else:
            b.drop("derivative_gain_limit", limit, "without a rate it does nothing")


def _drop_derivative(b: NeutralBuilder, s: Dl06Loop) -> None:
    """A gain limit of 0 leaves no derivative, whatever the rate is."""
    rate, limit = s.loop.tuning.rate, s.loop.derivative_gain_limit
    note = "a derivative gain limit of 0 leaves no derivative"
    if rate:
        b.drop("tuning.rate", rate, note)
    else:
        b.put("tuning.rate", rate, "tuning.derivative_time", rate)
    field = "derivative_gain_limit_enabled" if limit is None else "derivative_gain_limit"
    b.drop(field, s.loop.derivative_gain_limit_enabled if limit is None else limit, note)


def _pv_filter(b: NeutralBuilder, s: Dl06Loop) -> None:
    pv = s.loop.pv
    if keep_if_on(b, "pv.filter", pv.filter, pv.filter_enabled):
        k = pv.filter or ZERO
        time = filter_time(k, s.loop.sample_rate) if k else ZERO
        b.put("pv.filter", k, "pv.filter", time, "" if ZERO < k <= ONE else "outside 0.1 to 1.0 it does nothing")
    _transfer(b, "pv.transfer", pv.transfer, "the CPU reads the PV by itself: lead it to the loop from")


def _transfer(b: NeutralBuilder, path: str, transfer: Dl06Transfer | None, advice: str) -> None:
    if transfer is None:
        return
    if transfer.address is None:
        location = f"slot {transfer.slot}, channel {transfer.channel}"
    else:
        location = v_name(transfer.address)
    b.drop(path, location, f"{advice} {location}")


def _setpoint(b: NeutralBuilder, s: Dl06Loop) -> None:
    setpoint, scale = s.loop.setpoint, s.scales["sp"]
    if setpoint.value is not None:
        b.put("setpoint.value", quantity_text(setpoint.value), "setpoint.value", position(scale, setpoint.value))
    if not keep_if_on(b, "setpoint.limits", setpoint.limits, setpoint.limits_enabled):
        return
    if setpoint.limits is not None:
        put_limits(b, "setpoint.limits", setpoint.limits, scale)
    else:
        ends = list(s.scales["pv"].range or ())
        note = "not given: the ends of the range"
        b.put("setpoint.limits_enabled", setpoint.limits_enabled, "setpoint.limits", ends, note=note)


def _output(b: NeutralBuilder, s: Dl06Loop) -> None:
    output, scale = s.loop.output, s.scales["output"]
    ends = list(scale.range or ())
    if output.range is None:
        note = "no output.range: 0 to 100 % is assumed"
        b.put("output.range", None, "output.range", ends, note=note, assumed=True)
    else:
        b.put("output.range", ends, "output.range", ends)
    if output.unit is not None:
        b.put("output.unit", output.unit, "output.unit", output.unit)
    if output.limits is not None:
        put_limits(b, "output.limits", (_output_value(s, output.limits[0]), _output_value(s, output.limits[1])), scale)
    _transfer(b, "output.transfer", output.transfer, "the CPU writes the output by itself: lead it to")


def _output_value(s: Dl06Loop, value: Quantity) -> Quantity:
    """A value of the output; without a range of its own it is counts."""
    return Quantity(value.value, counts=True) if s.loop.output.range is None else value


def _state(b: NeutralBuilder, s: Dl06Loop) -> None:
    """The words of bias and output as they stand at the start."""
    state, scale = s.loop.state, s.scales["output"]
    if state.output is not None:
        value = _output_value(s, state.output)
        b.put("state.output", quantity_text(value), "output.manual", position(scale, value))
    elif position(scale, ZERO_COUNTS) > (scale.range or (ZERO,))[0]:
        note = "the output begins with 0 counts, in the middle of its range"
        b.put("state.output", None, "output.manual", position(scale, ZERO_COUNTS), note=note, assumed=True)
    if integral_time(s):
        return
    word = state.output if state.bias is None else state.bias
    bias = position(scale, ZERO_COUNTS if word is None else _output_value(s, word))
    if state.bias is None and state.output is not None:
        b.set("output.bias", bias)
        b.mark(
            "state.output",
            quantity_text(_output_value(s, state.output)),
            "output.bias",
            note="a change to Auto makes it the bias",
        )
    elif state.bias is not None:
        b.put("state.bias", quantity_text(_output_value(s, state.bias)), "output.bias", bias)
    elif bias:
        note = "without an integral the output stands at 0 counts when there is no error"
        b.put("state.bias", None, "output.bias", bias, note=note, assumed=True)


def _extras(b: NeutralBuilder, s: Dl06Loop) -> None:
    """What no other PLC of the project has in its loop: profiles, and the choices of auto-tune."""
    if s.loop.ramp_soak is not None:
        text = profile_text(s.loop.ramp_soak)
        b.drop("ramp_soak", text, f"program the profile of the set point: {text}")
    b.drop_choices("autotune", s.loop.autotune, "choose it when the target's auto-tune is started")


def profile_text(profile: RampSoak) -> str:
    """A ramp/soak profile in words."""
    state = "" if profile.enabled else " (switched off)"
    if profile.steps is None:
        return f"table at {v_name(profile.table)}, which the file does not hold{state}"
    steps = [
        f"ramp to {quantity_text(s.ramp_to)} at {quantity_text(s.slope)} /s, soak {decimal_text(s.soak)} min"
        + (f" within {quantity_text(s.deviation)}" if s.deviation is not None else "")
        for s in profile.steps
    ]
    return ("; ".join(steps) or "no steps") + state


FIELDS: Table[NeutralBuilder, Dl06Loop] = (
    *same_fields("name", "description", "mode"),
    SameField("cascade_from", "setpoint.source"),
    _remote_setpoint,
    SameField("sample_rate", "sample_time"),
    SameField("action", "output_raises_pv", RAISES_PV),
    _velocity,
    SameField("bumpless", "setpoint.follows_pv", FOLLOWS_PV),
    _anti_windup,
    _tuning,
    _derivative,
    *same_fields("pv.range", "pv.unit", "pv.square_root"),
    _pv_filter,
    _setpoint,
    _output,
    _state,
    error_fields,
    alarm_fields,
    _extras,
)
"""Every field in the order of the report."""

# ----------------------------------------------------------------------------------------------------------------------
# DL06 loops: new ones begin in Manual, Run brings back the mode of before (manual, PLC Modes' Effect on Loop Modes).
# A change to Auto makes the bias of the output (manual, Bumpless Transfers).

FORMAT_OPTIONS = ("reset_decimals", "derivative")
"""Keys of ``plc``, and options, that say what words mean."""


def _format_options(config: Dl06File, source_loops: Sequence[int]) -> dict[str, object]:
    """The data format where all loops have the same, and how reset and rate words are read."""
    formats = {config.loops[i].pv.format for i in source_loops}
    own: Data = {"data_format": formats.pop()} if len(formats) == 1 else {}
    return own | {key: getattr(config.plc, key) for key in FORMAT_OPTIONS if key in config.plc.model_fields_set}


OWN_SETTINGS = VendorSettings(
    ("/plc.loop_table",),
    {"pv.transfer": "", "output.transfer": "", **{f"/plc.{key}": key for key in FORMAT_OPTIONS}},
    _format_options,
    hand=Hand.FREE,
    zero=Zero.OF_RANGE,
)
"""Its table, its auto transfers, and how its words are read."""


def operations(config: Dl06File) -> list[Operation]:
    """Of each loop (D35, D39, D41 to D43, D45, D49); type I sets the set point to the PV: no error is on top."""
    rules = []
    for loop in config.loops:
        is_velocity = loop.algorithm == "velocity"
        windup = Windup.FROZEN_AT_ENDS if loop.bias_freeze else Windup.WITHIN_RANGE
        rules.append(
            Operation(
                start=Start.RETURNS,
                stopped=Stopped.GOES_ON if loop.independent_of_cpu_mode else Stopped.STANDS,
                hand=OWN_SETTINGS.hand,
                zero=OWN_SETTINGS.zero,
                transfer=Transfer.GOES_ON if is_velocity or loop.bumpless == "I" else Transfer.ON_TOP,
                without_integral=WithoutIntegral.TAKEN_OVER,
                windup=Windup.NONE if is_velocity else windup,
                squares_error=loop.error.curve == "squared",
                leads_master=loop.bumpless == "I",
                has_edge=True,
                interlock=Interlock.REFUSED if pv_alarms_on(loop) else Interlock.GRANTED,
                master=Master.MANUAL,
            )
        )
    return rules
