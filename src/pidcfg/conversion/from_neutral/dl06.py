"""Neutral loops to a DL06 configuration: a loop table at V2000, gains as shares of the spans."""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING, Any

from pidcfg.conversion.arithmetic import ZERO, filter_share, gain_limit, number, product, quotient, width
from pidcfg.conversion.from_neutral.dl06_alarms import put_alarms
from pidcfg.conversion.from_neutral.dl06_loop import Writer
from pidcfg.conversion.ledger import Missing, Put, Target
from pidcfg.conversion.pipeline import ConvertError
from pidcfg.conversion.to_neutral.dl06 import FOLLOWS
from pidcfg.conversion.to_neutral.dl06_scales import position
from pidcfg.encoders.dl06.encode import scales
from pidcfg.encoders.maps.dl06 import CPU, RESET
from pidcfg.refs import Decision
from pidcfg.schemas.base import SECONDS, Quantity
from pidcfg.schemas.octal import v_name

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pidcfg.schemas.generic import GenericFile, Loop

D281 = Decision(
    281,
    "Bumpless Transfer I where nothing is said",
    "Type I where the set point follows the PV in manual or is set to it on the way to auto, type II where it stays; a "
    "loop of which neither is said gets type I.",
    "A loop that nobody has given a set point yet stays where it is; type II would drive it towards 0 counts.",
)
TYPES = {follows: kind for kind, follows in FOLLOWS.items()}
LOOP_TABLE = 0o2000
DATA_FORMAT = "12-bit unipolar"
SLOWEST, HUNDREDTH = Decimal("99.99"), Decimal("0.01")
LONGEST_RATE = Decimal("99.99")
STRONGEST = Decimal("0.1")
LIMITS = (1, 20)
LARGEST_DIGITS = 9998
"""Of a reset time: 9999 switches it off."""

ACTS = "/plc.derivative"
FREEZE = "it works at the ends of the data range only: inside the limits of the output the bias goes on"
NO_TERM = "the gain is 0, so it does nothing; a DL06 would let it act as with gain 1"
NO_RATE = "there is no derivative to filter"
IN_OTHERS = "a DL06 without a proportional action has gain 1: the gain is in reset and rate"
BIAS = "a change to Auto sets the bias to the output: bring the output there in Manual"
RATE_LIMIT = "a DL06 does not limit how fast its output moves: limit it in the program or at the actuator"
PULSE = "a DL06 loop has no pulse output: pulse a discrete output in the program, in proportion to the output word"


def from_neutral(file: GenericFile, options: Mapping[str, Any]) -> Target:
    """The configuration with the exact values, and where each neutral field was put."""
    if len(file.loops) > CPU.loops:
        message = f"the file has {len(file.loops)} loops; a {CPU.title} has {CPU.loops}: divide the file"
        raise ConvertError([Missing(("loops",), "loops", message)])
    start, form = options.get("loop_table"), options.get("data_format") or DATA_FORMAT
    start = LOOP_TABLE if start is None else start
    plc: dict[str, Any] = {"loop_table": v_name(start)}
    plc |= {key: options[key] for key in ("reset_decimals", "derivative") if options.get(key) is not None}
    writers = [_loop(file, i, plc, form) for i in range(len(file.loops))]
    if any(put.field == ACTS for w in writers for put in w.puts):
        plc.setdefault("derivative", "error")
    if writers:
        writers[0].puts.append(Put("/plc.loop_table", None, "V7640: where the loop table starts"))
    head = {"pidcfg": 1, "vendor": "dl06", "name": file.name, "description": file.description, "plc": plc}
    data = {key: value for key, value in head.items() if value is not None}
    return Target(data | {"loops": [w.data for w in writers]}, [w.puts for w in writers])


def _loop(file: GenericFile, index: int, plc: Mapping[str, Any], form: str) -> Writer:
    loop = file.loops[index]
    table = scales(form, None, (loop.pv.range, loop.output.range), root=loop.pv.square_root)
    least = Decimal(CPU.fast_rate if len(file.loops) <= CPU.fast_loops else CPU.slow_rate)
    sample = min(max(loop.sample_time, least), SLOWEST)
    w = Writer(index, loop, table, sample.quantize(HUNDREDTH))
    _identity(w, file)
    note = "" if sample == loop.sample_time else f"{len(file.loops)} loops are calculated every {least} to {SLOWEST} s"
    w.number("sample_rate", sample, "sample_time", note, clamped=bool(note))
    _form(w)
    _tuning(w, plc.get("reset_decimals", 1))
    _derivative(w, plc.get("derivative", "error"))
    _pv(w, form)
    _setpoint(w)
    _output(w)
    if loop.deadband:
        w.number("error.deadband", loop.deadband, "deadband")
    put_alarms(w)
    return w


def _identity(w: Writer, file: GenericFile) -> None:
    loop = w.loop
    w.put("name", loop.name, "name")
    if loop.description is not None:
        w.put("description", loop.description, "description")
    obstacle = _obstacle(file, loop)
    if loop.mode == "cascade" and (obstacle or loop.setpoint.source is None):
        w.put("mode", "auto", "mode", "cascade needs a loop that gives the set point", clamped=True)
    else:
        w.put("mode", loop.mode, "mode")
    if obstacle:
        w.lost("setpoint.source", obstacle)
    elif loop.setpoint.source is not None:
        w.put("cascade_from", loop.setpoint.source, "setpoint.source")


def _obstacle(file: GenericFile, loop: Loop) -> str:
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


def _form(w: Writer) -> None:
    """Action and what depends on the form of the equation."""
    loop, output = w.loop, w.loop.output
    w.put("action", "direct" if loop.output_raises_pv else "reverse", "output_raises_pv")
    follows = loop.setpoint.follows_pv
    if follows is None:
        w.put("bumpless", TYPES[True], None, "a change to Auto sets the set point to the PV; II leaves it")
    else:
        w.put("bumpless", TYPES[follows], "setpoint.follows_pv")
    narrow = output.limits is not None and output.limits != output.range
    w.put("bias_freeze", loop.anti_windup, "anti_windup", FREEZE if loop.anti_windup and narrow else "")


def share(w: Writer) -> Decimal:
    """The gain as a share of the output's span for a share of the PV's."""
    span = width(w.loop.pv.range), width(w.loop.output.range)
    return quotient(product(w.loop.tuning.gain, span[0]), span[1])


def _tuning(w: Writer, decimals: int) -> None:
    tuning, gain = w.loop.tuning, share(w)
    time = tuning.integral_time
    if tuning.proportional:
        w.computed("tuning.gain", gain, "tuning.gain")
    else:
        w.number("tuning.gain", ZERO, "tuning.proportional")
        time = quotient(time, gain) if gain else ZERO
    if time and gain:
        _reset(w, time, decimals)
    else:
        w.put("tuning.reset", "off", "tuning.integral_time", NO_TERM if time else "")
    if not tuning.proportional:
        w.also("tuning.reset", "tuning.gain", IN_OTHERS)


def _reset(w: Writer, time: Decimal, decimals: int) -> None:
    """The reset time: in seconds where they hold it, else in minutes, at most one digit below the off code."""
    longest = LARGEST_DIGITS * RESET[decimals].step
    unit = "seconds" if time <= longest else "minutes"
    value = time if unit == "seconds" else quotient(time, SECONDS["min"])
    note = "" if value <= longest else f"the longest reset is {longest} min"
    w.computed("tuning.reset", min(value, longest), "tuning.integral_time", note, clamped=bool(note))
    w.data["tuning"]["reset_unit"] = unit


def _derivative(w: Writer, acts: str) -> None:
    """Rate and derivative gain limit N, whose filter has the time constant Td/N."""
    tuning, gain = w.loop.tuning, share(w)
    rate = tuning.derivative_time if tuning.proportional else product(tuning.derivative_time, gain)
    if not rate or not gain:
        w.number("tuning.rate", ZERO, "tuning.derivative_time", NO_TERM if tuning.derivative_time else "")
        if tuning.derivative_on == "error":  # "pv" is what a neutral loop is like anyway
            w.also(ACTS, "tuning.derivative_on")
        if tuning.derivative_filter:
            w.lost("tuning.derivative_filter", NO_RATE)
        return
    wrong = f"acts on the {acts}, not on the {tuning.derivative_on}" if acts != tuning.derivative_on else ""
    w.computed("tuning.rate", rate, "tuning.derivative_time", wrong)
    if wrong:
        kick = "a step of the set point kicks the output" if acts == "error" else "the set point does not move it"
        w.lost("tuning.derivative_on", f"the rate {wrong}: {kick}")
    elif acts == "error":
        w.also(ACTS, "tuning.derivative_on")
    if tuning.derivative_filter:
        _filter(w, min(rate, LONGEST_RATE))


def _filter(w: Writer, rate: Decimal) -> None:
    """The filter's time constant as the whole N that makes Td/N the nearest to it."""
    constant = w.loop.tuning.derivative_filter
    limit, ratio = gain_limit(rate, constant, LIMITS[1]), quotient(rate, constant)
    clamped = not LIMITS[0] <= ratio <= LIMITS[1]
    note = f"the filter is Td/N with N from {LIMITS[0]} to {LIMITS[1]}: {limit}" if clamped else f"Td/{limit}"
    w.means(
        "derivative_gain_limit",
        limit,
        "tuning.derivative_filter",
        note,
        exact=constant,
        held=quotient(rate, Decimal(limit)),
        clamped=clamped,
    )


def _pv(w: Writer, form: str) -> None:
    pv = w.loop.pv
    w.put("pv.range", [number(end) for end in pv.range], "pv.range")
    if pv.unit is not None:
        w.put("pv.unit", pv.unit, "pv.unit")
    w.put("pv.format", form, None, "the data format of the analog module; the output has it too")
    if pv.square_root:
        w.put("pv.square_root", pv.square_root, "pv.square_root")
    if pv.filter:
        k = filter_share(pv.filter, w.sample)
        note = "" if k >= STRONGEST else f"the strongest filter is {STRONGEST} a sample"
        w.computed("pv.filter", max(k, STRONGEST), "pv.filter", note, clamped=bool(note))


def _setpoint(w: Writer) -> None:
    setpoint = w.loop.setpoint
    if setpoint.value is not None:
        w.number("setpoint.value", setpoint.value, "setpoint.value")
    if setpoint.limits is not None:
        w.pair("setpoint.limits", setpoint.limits, "setpoint.limits")


def _output(w: Writer) -> None:
    output = w.loop.output
    w.put("output.range", [number(end) for end in output.range], "output.range")
    if output.unit is not None:
        w.put("output.unit", output.unit, "output.unit")
    if output.limits is not None:
        w.pair("output.limits", output.limits, "output.limits")
    if output.max_rate is not None:
        w.lost("output.max_rate", RATE_LIMIT)
    if output.pulse is not None:
        for key in type(output.pulse).model_fields:
            w.lost(f"output.pulse.{key}", PULSE)
    if output.manual is not None:
        w.number("state.output", output.manual, "output.manual")
    resting = position(w.scales["output"], Quantity(ZERO, counts=True))
    integral = w.data["tuning"]["reset"] != "off"
    if output.bias != (ZERO if integral else resting):
        w.number("state.bias", output.bias, "output.bias", BIAS)
