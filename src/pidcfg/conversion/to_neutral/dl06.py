"""A DL06 configuration to neutral loops.

Gains are shares of spans and become engineering units with the two ranges; what a word's bit switches off is not
carried over.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.conversion.arithmetic import HUNDRED, ONE, ZERO, filter_time, product, quotient, rounded, width
from pidcfg.conversion.cascades import told_in_inner_units
from pidcfg.conversion.ledger import Neutral
from pidcfg.conversion.to_neutral.dl06_alarms import read_alarms, read_error
from pidcfg.conversion.to_neutral.dl06_loop import NOTHING, Reader, shown
from pidcfg.conversion.to_neutral.dl06_scales import position
from pidcfg.encoders.dl06.encode import (
    OUTPUT_OFFSET,
    loop_start,
    reset_value,
    scales,
)
from pidcfg.encoders.maps.dl06 import RESET
from pidcfg.refs import Decision
from pidcfg.schemas.base import SECONDS, Quantity, decimal_text
from pidcfg.schemas.dl06 import Autotune
from pidcfg.schemas.octal import v_name

if TYPE_CHECKING:
    from decimal import Decimal

    from pidcfg.encoders.scales import Scale
    from pidcfg.schemas.dl06 import Dl06File, Loop, RampSoak, Transfer

D283 = Decision(
    283,
    "the bias is a constant only without an integral",
    "`state.bias` becomes the neutral bias of a loop whose reset is off (0 counts where it is not given); with an "
    "integral it is a running value and is not carried over. The other way a bias is written to the bias word.",
    "The bias word is the integrator. A change to Auto sets it to the output, whatever it was.",
)

NOTHING_LOST = {
    "algorithm": "position is the neutral form; velocity is reported",
    "independent_of_cpu_mode": "reported when it is on",
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
}
"""Fields that may come without a line in the report, and why."""

FOLLOWS = {"I": True, "II": False}
"""Whether a change to Auto sets the set point to the PV, by the type of the transfer."""


def to_neutral(config: Dl06File) -> list[Neutral]:
    """The loops of a file, each with what became of its fields."""
    return told_in_inner_units([_loop(config, i, loop) for i, loop in enumerate(config.loops)])


def _loop(config: Dl06File, index: int, loop: Loop) -> Neutral:
    out_range = loop.output.range or (ZERO, HUNDRED)
    table = scales(loop.pv.format, loop.output.format, (loop.pv.range, out_range), root=loop.pv.square_root)
    reader = Reader(config, index, loop, table, Neutral({}))
    if loop.pv.range is None:
        reader.lacks("pv.range", "add pv.range: the engineering values at 0 % and 100 %; the gain depends on its span")
    if not loop.sample_rate:
        reader.lacks("sample_rate", "correct sample_rate: a loop with 0 s is not calculated")
    if not reader.out.missing:
        for part in (_identity, _form, _tuning, _derivative, _pv, _setpoint, _output, read_error, read_alarms, _extras):
            part(reader)
    return reader.out


def _identity(r: Reader) -> None:
    loop = r.loop
    r.carry("name", loop.name, loop.name, "name")
    if loop.description is not None:
        r.carry("description", loop.description, loop.description, "description")
    r.carry("mode", loop.mode, loop.mode, "mode")
    if loop.cascade_from is not None:
        r.carry("cascade_from", loop.cascade_from, loop.cascade_from, "setpoint.source")
    if loop.remote_setpoint is not None:
        _remote(r, loop.remote_setpoint)
    r.carry("sample_rate", loop.sample_rate, loop.sample_rate, "sample_time")


def _remote(r: Reader, address: int) -> None:
    """A pointer that is the output word of another loop is a cascade."""
    outputs = {loop_start(r.config.plc, i) + OUTPUT_OFFSET: other.name for i, other in enumerate(r.config.loops)}
    name = v_name(address)
    if r.loop.cascade_from is not None:
        r.drop("remote_setpoint", name, "cascade_from stands in its place")
    elif address in outputs:
        r.carry("remote_setpoint", name, outputs[address], "setpoint.source")
    else:
        r.drop("remote_setpoint", name, f"give the loop the set point that stands in {name} here")


def _form(r: Reader) -> None:
    """Action, form of the equation and what depends on it."""
    loop = r.loop
    r.carry("action", loop.action, loop.action == "direct", "output_raises_pv")
    if loop.algorithm == "velocity":
        note = "the target calculates positions: an output that something else has moved is not continued from there"
        r.drop("algorithm", loop.algorithm, note)
    r.carry("bumpless", loop.bumpless, FOLLOWS[loop.bumpless], "setpoint.follows_pv")
    freeze, note = loop.bias_freeze, ""
    if loop.algorithm == "velocity":
        freeze, note = True, "the velocity form does not wind up"
    elif freeze and loop.output.limits is not None:
        note = "stops the bias only at the ends of the data range here"
    r.carry("bias_freeze", loop.bias_freeze, freeze, "anti_windup", note=note)
    if loop.independent_of_cpu_mode:
        note = "the loop also runs while the CPU is in Program mode: see what the target does"
        r.drop("independent_of_cpu_mode", loop.independent_of_cpu_mode, note)


def _tuning(r: Reader) -> None:
    tuning = r.loop.tuning
    spans = width(r.scales["output"].range or ()), width(r.scales["pv"].range or ())
    gain = rounded(quotient(product(tuning.gain or ONE, spans[0]), spans[1]))
    if tuning.gain:
        r.carry("tuning.gain", tuning.gain, gain, "tuning.gain")
    else:
        note = "gain 0 takes the proportional action out; the others act as with gain 1"
        r.carry("tuning.gain", tuning.gain, gain, "tuning.gain", "tuning.proportional", note=note)
        r.out.loop["tuning"]["proportional"] = False
    r.carry("tuning.reset", _shown_reset(r.loop), integral_time(r), "tuning.integral_time")


def integral_time(r: Reader) -> Decimal:
    """The reset time in s; 0: off, as the codes 0000 and 9999 are."""
    value, codec = reset_value(r.loop), RESET[r.config.plc.reset_decimals]
    if any(value == digits * codec.step for digits in codec.off):
        return ZERO
    return product(value, SECONDS["min"]) if r.loop.tuning.reset_unit == "minutes" else value


def _shown_reset(loop: Loop) -> str:
    duration = loop.tuning.reset.duration
    if duration is None or duration.unit is not None:
        return str(loop.tuning.reset)
    return f"{decimal_text(duration.value)} {'min' if loop.tuning.reset_unit == 'minutes' else 's'}"


def _derivative(r: Reader) -> None:
    """The rate and its gain limit N: a filter of Td/N; a limit of 0 is no derivative."""
    rate, limit = r.loop.tuning.rate, r.loop.derivative_gain_limit
    limited = r.active("derivative_gain_limit", limit, r.loop.derivative_gain_limit_enabled)
    if limited and not limit:
        _no_derivative(r)
        return
    r.carry("tuning.rate", rate, rate, "tuning.derivative_time")
    if rate:
        acts = r.config.plc.derivative
        r.carry("plc.derivative", acts, acts, "tuning.derivative_on")
    if limited and limit:
        if rate:
            r.carry("derivative_gain_limit", limit, rounded(quotient(rate, limit)), "tuning.derivative_filter")
        else:
            r.drop("derivative_gain_limit", limit, "without a rate it does nothing")


def _no_derivative(r: Reader) -> None:
    """A gain limit of 0 leaves no derivative, whatever the rate is."""
    rate, limit = r.loop.tuning.rate, r.loop.derivative_gain_limit
    note = "a derivative gain limit of 0 leaves no derivative"
    if rate:
        r.drop("tuning.rate", rate, note)
    else:
        r.carry("tuning.rate", rate, rate, "tuning.derivative_time")
    field = "derivative_gain_limit_enabled" if limit is None else "derivative_gain_limit"
    r.drop(field, r.loop.derivative_gain_limit_enabled if limit is None else limit, note)


def _pv(r: Reader) -> None:
    pv = r.loop.pv
    r.carry("pv.range", list(pv.range or ()), list(pv.range or ()), "pv.range")
    if pv.unit is not None:
        r.carry("pv.unit", pv.unit, pv.unit, "pv.unit")
    r.carry("pv.square_root", pv.square_root, pv.square_root, "pv.square_root")
    if r.active("pv.filter", pv.filter, pv.filter_enabled):
        k = pv.filter or ZERO
        time = filter_time(k, r.loop.sample_rate) if k else ZERO
        note = "" if ZERO < k <= ONE else "outside 0.1 to 1.0 it does nothing"
        r.carry("pv.filter", k, time, "pv.filter", note=note)
    _transfer(r, "pv.transfer", pv.transfer, "the CPU reads the PV by itself: lead it to the loop from")


def _transfer(r: Reader, field: str, transfer: Transfer | None, what: str) -> None:
    if transfer is None:
        return
    if transfer.address is None:
        place = f"slot {transfer.slot}, channel {transfer.channel}"
    else:
        place = v_name(transfer.address)
    r.drop(field, place, f"{what} {place}")


def _setpoint(r: Reader) -> None:
    setpoint, scale = r.loop.setpoint, r.scales["sp"]
    if setpoint.value is not None:
        r.carry("setpoint.value", shown(setpoint.value), position(scale, setpoint.value), "setpoint.value")
    if not r.active("setpoint.limits", setpoint.limits, setpoint.limits_enabled):
        return
    if setpoint.limits is not None:
        r.limits("setpoint.limits", setpoint.limits, scale)
    else:
        ends = list(r.scales["pv"].range or ())
        note = "not given: the ends of the range"
        r.carry("setpoint.limits_enabled", setpoint.limits_enabled, ends, "setpoint.limits", note=note)


def _output(r: Reader) -> None:
    output, scale = r.loop.output, r.scales["output"]
    ends = list(scale.range or ())
    if output.range is None:
        note = "no output.range: 0 to 100 % is assumed"
        r.carry("output.range", None, ends, "output.range", note=note, assumed=True)
    else:
        r.carry("output.range", ends, ends, "output.range")
    if output.unit is not None:
        r.carry("output.unit", output.unit, output.unit, "output.unit")
    if output.limits is not None:
        r.limits("output.limits", (_raw(r, output.limits[0]), _raw(r, output.limits[1])), scale)
    _transfer(r, "output.transfer", output.transfer, "the CPU writes the output by itself: lead it to")
    _words(r, scale)


def _raw(r: Reader, value: Quantity) -> Quantity:
    """A value of the output; without a range of its own it is counts."""
    return Quantity(value.value, counts=True) if r.loop.output.range is None else value


def _words(r: Reader, scale: Scale) -> None:
    """The words of bias and output as they stand at the start."""
    state = r.loop.state
    if state.output is not None:
        value = _raw(r, state.output)
        r.carry("state.output", shown(value), position(scale, value), "output.manual")
    if integral_time(r):
        return
    bias = position(scale, NOTHING if state.bias is None else _raw(r, state.bias))
    if state.bias is not None:
        r.carry("state.bias", shown(_raw(r, state.bias)), bias, "output.bias")
    elif bias:
        note = "without an integral the output stands at 0 counts when there is no error"
        r.carry("state.bias", None, bias, "output.bias", note=note, assumed=True)


def _extras(r: Reader) -> None:
    """What no other PLC of the project has in its loop: profiles, and the choices of auto-tune."""
    if r.loop.ramp_soak is not None:
        text = profile_text(r.loop.ramp_soak)
        r.drop("ramp_soak", text, f"program the profile of the set point: {text}")
    for key, row in Autotune.model_fields.items():
        value = getattr(r.loop.autotune, key)
        if value != row.default:
            r.drop(f"autotune.{key}", value, "choose it when the target's auto-tune is started")


def profile_text(profile: RampSoak) -> str:
    """A ramp/soak profile in words."""
    state = "" if profile.enabled else " (switched off)"
    if profile.steps is None:
        return f"table at {v_name(profile.table)}, which the file does not hold{state}"
    steps = [
        f"ramp to {shown(s.ramp_to)} at {shown(s.slope)} /s, soak {decimal_text(s.soak)} min"
        + (f" within {shown(s.deviation)}" if s.deviation is not None else "")
        for s in profile.steps
    ]
    return ("; ".join(steps) or "no steps") + state
