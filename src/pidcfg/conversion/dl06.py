"""Neutral loops to a DL06 configuration: a loop table at V2000, gains as shares of both spans, alarms in groups."""

from __future__ import annotations

from decimal import Decimal
from itertools import pairwise
from typing import TYPE_CHECKING

from pidcfg.conversion import ConvertError, MissingField
from pidcfg.conversion.builder import (
    ZERO,
    SameField,
    TargetBuilder,
    apply_table,
    filter_factor,
    gain_limit,
    product,
    quotient,
    same_fields,
    target_file,
    width,
)
from pidcfg.conversion.from_dl06 import (
    FOLLOWS_PV,
    HARMLESS_FIELDS,
    OWN_SETTINGS,
    RAISES_PV,
    distance,
    operations,
    position,
    round_to_ten_digits,
    square_of_flow,
    to_neutral,
)
from pidcfg.encoders.codecs import round_to_integer
from pidcfg.encoders.dl06.image import make_scales
from pidcfg.encoders.image import file_quantity
from pidcfg.encoders.maps.dl06 import CPU, RESET
from pidcfg.schemas.base import SECONDS, Quantity, v_name
from pidcfg.schemas.numbers import decimal_text
from pidcfg.text.frozen import frozen
from pidcfg.text.paths import is_given
from pidcfg.text.references import Decision

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.conversion import TargetFile
    from pidcfg.conversion.builder import Table
    from pidcfg.conversion.operation import Operation
    from pidcfg.encoders.codecs import Scale
    from pidcfg.encoders.image import Settings
    from pidcfg.schemas.generic import GenericFile, Loop
    from pidcfg.text.paths import Data

__all__ = ["HARMLESS_FIELDS", "OWN_SETTINGS", "from_neutral", "operations", "to_neutral"]
"""What a vendor gives; the way to the neutral form has a module of its own."""

# --- A neutral loop with the scales of the DL06 loop that it becomes --------------------------------------------------


@frozen
class Dl06Target:
    """A neutral loop, its file, and what its DL06 gives."""

    file: GenericFile
    neutral: Loop
    plc: Settings
    """Settings of the CPU."""
    data_format: str
    """Data format of PV and output."""
    scales: dict[str, Scale]
    min_time: Decimal
    """The shortest sample time in s."""
    sample_time: Decimal
    """The sample time in s as its word will hold it."""


# --- The alarms of a neutral loop as those of a DL06, which enables them by groups and wants them in order ------------

D282 = Decision(
    282,
    "alarms that a group needs besides those that are wanted",
    "One bit enables all four PV alarms, another both deviation alarms. A point that is not wanted stands at the end "
    "of the scale, or one count beside its neighbour; a point at the very end of the scale, which no PV passes, makes "
    "room for it. A hysteresis of less than one count becomes one.",
    "The PLC wants low_low < low < high < high_high and yellow < red in counts, and compares with words of 0 too.",
)
PV_POINTS = ("low_low", "low", "high", "high_high")
MAX_HYSTERESIS = Decimal(0x200) / 4095
UNWANTED_POINT = "one bit enables the whole group: this point is not wanted and stands where it does least"
UNWANTED_INNER_POINT = f"{UNWANTED_POINT}: on only with the PV at the end of the scale, which also refuses Auto"
POINT_AT_SCALE_END = "at the end of the scale: no PV passes it"
POINT_BEFORE_ROOT = "a DL06 compares the differential pressure with it, not the root"


def put_alarms(b: TargetBuilder, t: Dl06Target) -> None:
    """All alarms of a loop."""
    are_pv_on = _pv_points(b, t)
    yellow = _deviations(b, t)
    _rate_of_change(b, t)
    _hysteresis(b, t, yellow, is_on=are_pv_on or yellow is not None)


def _pv_points(b: TargetBuilder, t: Dl06Target) -> bool:
    """The four points of the PV; returns whether they are on."""
    points, scale = t.neutral.alarms.pv, t.scales["pv"]
    given_points = {key: value for key in PV_POINTS if (value := getattr(points, key)) is not None}
    if not given_points:
        return False
    values = {key: square_of_flow(scale, v) if t.neutral.pv.square_root else v for key, v in given_points.items()}
    bottom, top = scale.format.minimum, scale.format.maximum
    counts = {key: min(max(round_to_integer(scale.position(Quantity(v))), bottom), top) for key, v in values.items()}
    for key, end in (("low", bottom), ("high", top)):
        if counts.get(key) == end:
            b.drop(f"alarms.pv.{key}", POINT_AT_SCALE_END)
            del counts[key], values[key]
    if not counts:
        return False
    all_counts = _complete_points(counts, bottom, top)
    for low, high in pairwise(PV_POINTS):
        if all_counts[low] >= all_counts[high]:
            text = " and ".join(
                f"{key} {decimal_text(given_points[key])}" for key in (low, high) if key in given_points
            )
            b.refuse(f"alarms.pv.{high}", f"{t.neutral.name}: {text}: {low} must be at least one count below {high}")
    for key in PV_POINTS:
        if key in values:
            b.put(f"alarms.pv.{key}", values[key], f"alarms.pv.{key}")
        else:
            note = UNWANTED_INNER_POINT if all_counts[key] in {bottom + 1, top - 1} else UNWANTED_POINT
            b.put(f"alarms.pv.{key}", f"{all_counts[key]} counts", None, note)
    return True


def _complete_points(counts: dict[str, int], bottom: int, top: int) -> dict[str, int]:
    """All four points: those that are given, and the others out of the way (D282)."""
    all_counts = dict(counts)
    all_counts.setdefault("low_low", bottom)
    all_counts.setdefault("low", all_counts["low_low"] + 1)
    all_counts.setdefault("high_high", top)
    all_counts.setdefault("high", all_counts["high_high"] - 1)
    return all_counts


def _deviations(b: TargetBuilder, t: Dl06Target) -> int | None:
    """Yellow and red deviation; returns the counts of yellow when they are on."""
    deviation, scale = t.neutral.alarms.deviation, t.scales["pv"]
    given_points = {"yellow": deviation.high, "red": deviation.high_high}
    neutral = {"yellow": "alarms.deviation.high", "red": "alarms.deviation.high_high"}
    values = {key: value for key, value in given_points.items() if value is not None}
    top = scale.format.maximum
    counts = {key: min(round_to_integer(scale.distance(Quantity(v))), top) for key, v in values.items()}
    if t.neutral.pv.square_root or ("red" not in counts and counts.get("yellow") == top):
        for key in values:
            b.drop(neutral[key], POINT_BEFORE_ROOT if t.neutral.pv.square_root else POINT_AT_SCALE_END)
        return None
    if not counts:
        return None
    counts.setdefault("red", top)
    counts.setdefault("yellow", counts["red"] - 1)
    if not 0 <= counts["yellow"] < counts["red"]:
        text = " and ".join(f"{key} {decimal_text(value)}" for key, value in values.items())
        b.refuse("alarms.deviation.red", f"{t.neutral.name}: {text}: yellow must be at least one count below red")
    for key in ("yellow", "red"):
        if key in values:
            b.put(f"alarms.deviation.{key}", values[key], neutral[key])
        else:
            b.put(f"alarms.deviation.{key}", f"{counts[key]} counts", None, UNWANTED_POINT)
    return counts["yellow"]


def _rate_of_change(b: TargetBuilder, t: Dl06Target) -> None:
    rate, field = t.neutral.alarms.rate_of_change, "alarms.rate_of_change"
    if rate is None:
        return
    change = product(rate, t.sample_time)
    if t.neutral.pv.square_root:
        b.drop(field, POINT_BEFORE_ROOT)
    elif (counts := round_to_integer(t.scales["pv"].distance(Quantity(change)))) == 0:
        b.drop(
            field, "less than half a count a sample: sample more slowly, or compare over more samples in the program"
        )
    else:
        held = distance(t.scales["pv"], Quantity(Decimal(counts), counts=True))
        b.put(field, round_to_ten_digits(change), field, "per sample", exact=change, held=held)


def _hysteresis(b: TargetBuilder, t: Dl06Target, yellow: int | None, *, is_on: bool) -> None:
    """At least one count, at most 12.5 % of the span, and less than the yellow deviation."""
    hysteresis, scale, field = t.neutral.alarms.hysteresis, t.scales["pv"], "alarms.hysteresis"
    if t.neutral.pv.square_root:
        if hysteresis:
            b.drop(field, POINT_BEFORE_ROOT)
        return
    if not is_on:
        if hysteresis:
            b.put(field, hysteresis, field)
        return
    max_counts = round_to_integer(MAX_HYSTERESIS * scale.format.span)
    max_counts = max_counts if yellow is None else max(min(max_counts, yellow - 1), 1)
    counts = round_to_integer(scale.distance(Quantity(hysteresis)))
    if counts < 1:
        b.put(field, "1 counts", field, "a DL06 wants at least one count", assumed=True)
    elif counts > max_counts:
        held = file_quantity(scale.span_value(max_counts))
        b.put(field, held, field, "at most 12.5 % of the span and less than the yellow deviation", clamped=True)
    else:
        b.put(field, hysteresis, field)


# --- Neutral loops to a DL06 configuration: a loop table at V2000, gains as shares of the spans -----------------------

D281 = Decision(
    281,
    "Bumpless Transfer I where no set point is given",
    "Type I where the set point follows the PV in manual or is set to it on the way to auto, type II where it stays; a "
    "loop of which neither is said gets type II if it has a set point, else type I.",
    "A loop that nobody has given a set point yet stays where it is; type II would drive it towards 0 counts.",
)
ACTIONS = {raises: action for action, raises in RAISES_PV.items()}
TRANSFERS = {follows: kind for kind, follows in FOLLOWS_PV.items()}
DEFAULT_LOOP_TABLE = 0o2000
DEFAULT_DATA_FORMAT = "12-bit unipolar"
LONGEST_SAMPLE, SAMPLE_STEP = Decimal("99.99"), Decimal("0.01")
LONGEST_RATE = Decimal("99.99")
SMALLEST_FILTER = Decimal("0.1")
GAIN_LIMITS = (1, 20)
LARGEST_RESET_DIGITS = 9998
"""Of a reset time: 9999 switches it off."""

DERIVATIVE_KEY = "/plc.derivative"
FREEZE_NOTE = "it works at the ends of the data range only: inside the limits of the output the bias goes on"
GAIN_ZERO_NOTE = "the gain is 0, so it does nothing; a DL06 would let it act as with gain 1"
NO_DERIVATIVE_NOTE = "there is no derivative to filter"
GAIN_IN_TIMES_NOTE = "a DL06 without a proportional action has gain 1: the gain is in reset and rate"
BIAS_NOTE = "a change to Auto sets the bias to the output: bring the output there in Manual"
RATE_LIMIT_NOTE = "a DL06 does not limit how fast its output moves: limit it in the program or at the actuator"
PULSE_NOTE = "a DL06 loop has no pulse output: pulse a discrete output in the program, in proportion to the output word"


def from_neutral(
    file: GenericFile,
    options: Settings,
    operations: Sequence[Operation] = (),
) -> TargetFile:
    """The configuration with the exact values, and where each neutral field was put."""
    if len(file.loops) > CPU.loops:
        message = f"the file has {len(file.loops)} loops; a {CPU.title} has {CPU.loops}: divide the file"
        raise ConvertError([MissingField(("loops",), message)])
    start, data_format = options.get("loop_table"), options.get("data_format") or DEFAULT_DATA_FORMAT
    start = DEFAULT_LOOP_TABLE if start is None else start
    plc: Data = {"loop_table": v_name(start)}
    plc |= {key: options[key] for key in ("reset_decimals", "derivative") if options.get(key) is not None}
    builders = [_fill_loop(file, i, plc, data_format) for i in range(len(file.loops))]
    if any(field.path == DERIVATIVE_KEY for b in builders for field in b.fields):
        plc.setdefault("derivative", "error")
    if builders:
        builders[0].mark("/plc.loop_table", None, "V7640: where the loop table starts")
    return target_file("dl06", file, builders, plc=plc)


def _fill_loop(file: GenericFile, index: int, plc: Settings, data_format: str) -> TargetBuilder:
    loop = file.loops[index]
    scales = make_scales(data_format, None, (loop.pv.range, loop.output.range), root=loop.pv.square_root)
    min_time = Decimal(CPU.fast_rate if len(file.loops) <= CPU.fast_loops else CPU.slow_rate)
    sample = min(max(loop.sample_time, min_time), LONGEST_SAMPLE).quantize(SAMPLE_STEP)
    b = TargetBuilder(index)
    apply_table(b, loop, Dl06Target(file, loop, plc, data_format, scales, min_time, sample), FIELDS)
    return b


def _mode(b: TargetBuilder, t: Dl06Target) -> None:
    """The mode, and where the set point comes from."""
    loop, obstacle = t.neutral, _cascade_obstacle(t.file, t.neutral)
    if loop.mode == "cascade" and (obstacle or loop.setpoint.source is None):
        b.put("mode", "auto", "mode", "cascade needs a loop that gives the set point", clamped=True)
    else:
        b.put("mode", loop.mode, "mode")
    if obstacle:
        b.drop("setpoint.source", obstacle)
    elif loop.setpoint.source is not None:
        b.put("cascade_from", loop.setpoint.source, "setpoint.source")


def _cascade_obstacle(file: GenericFile, loop: Loop) -> str:
    """Why a loop cannot have its set point from another as a DL06 does it: count for count; empty: it can."""
    source = loop.setpoint.source
    major = next((other for other in file.loops if other.name == source and other is not loop), None)
    if source is None:
        return ""
    if major is None:
        return f"no other loop of the file is called {source}: write the set point in the program"
    units = {major.output.unit, loop.pv.unit} - {None}
    if major.output.range != loop.pv.range or len(units) > 1:
        return f"counts pass from {source}, and its output's range or unit is not that of this PV: scale it by program"
    if loop.pv.square_root:
        return f"the set point of a square-root loop ends at the root of the span: scale {source}'s output by program"
    if major.mode != "manual" and loop.mode != "cascade":
        return f"{source} cannot leave Manual before this loop is in Cascade: add cascade_from and `mode: cascade`"
    return ""


def _sample_rate(b: TargetBuilder, t: Dl06Target) -> None:
    wanted = t.neutral.sample_time
    time = min(max(wanted, t.min_time), LONGEST_SAMPLE)
    note = (
        "" if time == wanted else f"{len(t.file.loops)} loops are calculated every {t.min_time} to {LONGEST_SAMPLE} s"
    )
    b.put("sample_rate", time, "sample_time", note, clamped=bool(note))


def _bumpless(b: TargetBuilder, t: Dl06Target) -> None:
    """Type I sets the set point to the PV; where nothing is said it stays, if there is one (D281)."""
    setpoint = t.neutral.setpoint
    if setpoint.follows_pv is not None:
        b.put("bumpless", TRANSFERS[setpoint.follows_pv], "setpoint.follows_pv")
        return
    keeps = setpoint.value is not None or setpoint.source is not None
    b.put("bumpless", TRANSFERS[not keeps], None, "the set point stays" if keeps else "Auto begins with the present PV")


def _anti_windup(b: TargetBuilder, t: Dl06Target) -> None:
    loop, output = t.neutral, t.neutral.output
    narrow = output.limits is not None and output.limits != output.range
    b.put("bias_freeze", loop.anti_windup, "anti_windup", FREEZE_NOTE if loop.anti_windup and narrow else "")


def normalized_gain(loop: Loop) -> Decimal:
    """The gain as a share of the output's span for a share of the PV's."""
    return quotient(product(loop.tuning.gain, width(loop.pv.range)), width(loop.output.range))


def _tuning(b: TargetBuilder, t: Dl06Target) -> None:
    tuning, gain = t.neutral.tuning, normalized_gain(t.neutral)
    time = tuning.integral_time
    if tuning.proportional:
        b.put("tuning.gain", round_to_ten_digits(gain), "tuning.gain")
    else:
        b.put("tuning.gain", ZERO, "tuning.proportional")
        time = quotient(time, gain) if gain else ZERO
    if time and gain:
        _reset(b, time, t.plc.get("reset_decimals", 1))
    else:
        b.put("tuning.reset", "off", "tuning.integral_time", GAIN_ZERO_NOTE if time else "")
    if not tuning.proportional:
        b.mark("tuning.reset", "tuning.gain", GAIN_IN_TIMES_NOTE)


def _reset(b: TargetBuilder, time: Decimal, decimals: int) -> None:
    """The reset time in seconds or minutes, whichever is nearer, at most one digit below the off code."""
    step = RESET[decimals].step
    longest, minutes = LARGEST_RESET_DIGITS * step, quotient(time, SECONDS["min"])
    note = f"the longest reset is {longest} min" if minutes > longest else ""
    error = ZERO if note else abs(minutes.quantize(step) * SECONDS["min"] - time)
    unit, value = ("seconds", time) if time - longest <= error else ("minutes", minutes)
    held = round_to_ten_digits(min(value, longest))
    b.put("tuning.reset", held, "tuning.integral_time", note, exact=round_to_ten_digits(value), clamped=bool(note))
    b.data["tuning"]["reset_unit"] = unit


def _derivative(b: TargetBuilder, t: Dl06Target) -> None:
    """Rate and derivative gain limit N, whose filter has the time constant Td/N."""
    tuning, gain, acts_on = t.neutral.tuning, normalized_gain(t.neutral), t.plc.get("derivative", "error")
    rate = tuning.derivative_time if tuning.proportional else product(tuning.derivative_time, gain)
    if not rate or not gain:
        b.put("tuning.rate", ZERO, "tuning.derivative_time", GAIN_ZERO_NOTE if tuning.derivative_time else "")
        if tuning.derivative_on == "error":  # "pv" is what a neutral loop is like anyway
            b.mark(DERIVATIVE_KEY, "tuning.derivative_on")
        if tuning.derivative_filter:
            b.drop("tuning.derivative_filter", NO_DERIVATIVE_NOTE)
        return
    mismatch = f"acts on the {acts_on}, not on the {tuning.derivative_on}" if acts_on != tuning.derivative_on else ""
    b.put("tuning.rate", round_to_ten_digits(rate), "tuning.derivative_time", mismatch)
    if mismatch:
        kick = "a step of the set point kicks the output" if acts_on == "error" else "the set point does not move it"
        b.drop("tuning.derivative_on", f"the rate {mismatch}: {kick}")
    elif acts_on == "error":
        b.mark(DERIVATIVE_KEY, "tuning.derivative_on")
    if tuning.derivative_filter:
        _derivative_filter(b, tuning.derivative_filter, min(rate, LONGEST_RATE))


def _derivative_filter(b: TargetBuilder, constant: Decimal, rate: Decimal) -> None:
    """The filter's time constant as the whole N that makes Td/N the nearest to it."""
    limit, ratio = gain_limit(rate, constant, GAIN_LIMITS[1]), quotient(rate, constant)
    clamped = not GAIN_LIMITS[0] <= ratio <= GAIN_LIMITS[1]
    note = f"the filter is Td/N with N from {GAIN_LIMITS[0]} to {GAIN_LIMITS[1]}: {limit}" if clamped else f"Td/{limit}"
    held = quotient(rate, Decimal(limit))
    field = "tuning.derivative_filter"
    b.put("derivative_gain_limit", limit, field, note, exact=constant, held=held, clamped=clamped)


def _format(b: TargetBuilder, t: Dl06Target) -> None:
    b.put("pv.format", t.data_format, None, "the data format of the analog module; the output has it too")


def _pv_filter(b: TargetBuilder, t: Dl06Target) -> None:
    if t.neutral.pv.filter:
        k = filter_factor(t.neutral.pv.filter, t.sample_time)
        note = "" if k >= SMALLEST_FILTER else f"the strongest filter is {SMALLEST_FILTER} a sample"
        b.put("pv.filter", round_to_ten_digits(max(k, SMALLEST_FILTER)), "pv.filter", note, clamped=bool(note))


def _bias(b: TargetBuilder, t: Dl06Target) -> None:
    zero_output = position(t.scales["output"], Quantity(ZERO, counts=True))
    output, has_integral = t.neutral.output, b.data["tuning"]["reset"] != "off"
    bias, manual = output.bias, output.manual
    if bias != (ZERO if has_integral else zero_output):
        b.put("state.bias", bias, "output.bias", BIAS_NOTE, assumed=True)
        if not has_integral and manual is None:
            b.put("state.output", bias, None, "a change to Auto sets the bias to the output, which begins there")
    elif not has_integral and manual not in {None, bias} and is_given(t.neutral, ("output", "bias")):
        b.put("state.bias", bias, "output.bias", BIAS_NOTE, assumed=True)
    elif not has_integral:
        b.mark("state.bias", "output.bias", "0 counts, as the output begins")


def _drop_unmatched(b: TargetBuilder, t: Dl06Target) -> None:
    """What the program does in place of the loop."""
    output = t.neutral.output
    if output.max_rate is not None:
        b.drop("output.max_rate", RATE_LIMIT_NOTE)
    if output.pulse is not None:
        for key in type(output.pulse).model_fields:
            b.drop(f"output.pulse.{key}", PULSE_NOTE)


FIELDS: Table[TargetBuilder, Dl06Target] = (
    *same_fields("name", "description"),
    _mode,
    _sample_rate,
    SameField("output_raises_pv", "action", ACTIONS),
    _bumpless,
    _anti_windup,
    _tuning,
    _derivative,
    *same_fields("pv.range", "pv.unit"),
    _format,
    SameField("pv.square_root", skip_falsy=True),
    _pv_filter,
    SameField("setpoint.value"),
    SameField("setpoint.limits", is_pair=True),
    *same_fields("output.range", "output.unit"),
    SameField("output.limits", is_pair=True),
    SameField("output.manual", "state.output"),
    _bias,
    SameField("deadband", "error.deadband", skip_falsy=True),
    put_alarms,
    _drop_unmatched,
)
"""Every field in the order of the file."""
