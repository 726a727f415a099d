"""CLICK loops as neutral ones, and what they do when they are switched."""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING

from pidcfg.conversion.builder import (
    HUNDRED,
    ZERO,
    NeutralBuilder,
    Same,
    apply_table,
    filter_time,
    product,
    quotient,
    round_computed,
    same_fields,
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
from pidcfg.encoders.image import switched_on
from pidcfg.schemas.numbers import decimal_text
from pidcfg.text.paths import is_given
from pidcfg.text.references import Decision

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pydantic import BaseModel

    from pidcfg.conversion.builder import Table
    from pidcfg.conversion.ledger import NeutralLoop
    from pidcfg.schemas.click import ClickFile, Loop

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
RAISES = {"direct": True, "reverse": False}
"""Whether the PV rises with the output, by the word for the process's action."""
FOLLOWS = {1: True, 2: False}
"""Whether Auto begins with the PV as the set point, by the bumpless mode."""
OUTPUT = (ZERO, HUNDRED)
"""The range of the output, in %."""
NO_INTEGRAL = Decimal(6000)
NO_FILTER = 100
SWITCHED_OFF = "stored, but switched off"
SWITCHES = (
    *(f"{path}_enabled" for path in ("derivative_gain_limit", "pv.filter", "error.deadband", "alarms.rate_of_change")),
    *("setpoint.lower_limit_enabled", "setpoint.upper_limit_enabled", "alarms.pv.enabled", "alarms.deviation.enabled"),
)
PLACES = ("bits", "integers", "floats", "output.pwm.bit")
NOTHING_LOST = {
    **dict.fromkeys(PLACES, "a place in this PLC, which means nothing elsewhere"),
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
            apply_table(b, loop, loop, FIELDS)
        else:
            b.require("pv.range", "the range of the process has no width (CK321)")
        loops.append(b.loop)
    return loops


def _sample_rate(b: NeutralBuilder, loop: Loop) -> None:
    b.put("sample_rate", f"{decimal_text(loop.sample_rate.scaleb(3))} ms", "sample_time", loop.sample_rate)


def _value_if_on(b: NeutralBuilder, model: BaseModel, path: str, unused: Decimal) -> Decimal | None:
    """A value that has a switch, while it is on; ``unused`` is what its register holds when it is not given."""
    key = path.rpartition(".")[2]
    value, bit = getattr(model, key), getattr(model, f"{key}_enabled")
    if switched_on(bit, value):
        return unused if value is None else Decimal(value)
    if value is not None:
        b.drop(path, value, SWITCHED_OFF)
    return None


# --- equation --------------------------------------------------------------------------------------------------------


def _squared(loop: Loop) -> bool:
    return loop.error.curve == "squared"


def _tuning(b: NeutralBuilder, loop: Loop) -> None:
    gain, reset = loop.tuning.proportional_gain, loop.tuning.reset_time
    if _squared(loop):
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
    off = reset >= NO_INTEGRAL
    b.put(
        "tuning.reset_time",
        reset,
        "tuning.integral_time",
        ZERO if off else reset,
        "6000 s is taken for no integral" if off else "",
    )


def _derivative(b: NeutralBuilder, loop: Loop) -> None:
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


def _error(b: NeutralBuilder, loop: Loop) -> None:
    if _squared(loop):
        b.drop(
            "error.curve",
            "squared",
            "square the error in the new controller, or tune it anew: small errors now count for more",
        )
    deadband = _value_if_on(b, loop.error, "error.deadband", ZERO)
    if deadband is not None and _squared(loop):
        note = "the root, since the error is no longer squared"
        b.put("error.deadband", deadband, "deadband", round_computed(deadband.sqrt()), note, assumed=True)
    elif deadband is not None:
        b.put("error.deadband", deadband, "deadband", deadband)


# --- PV, set point and output ----------------------------------------------------------------------------------------


def _pv_span(loop: Loop) -> tuple[Decimal, Decimal]:
    """The range of the PV: the instrument's, where the file gives it."""
    return loop.pv.input_range or loop.pv.range


def _pv_range(b: NeutralBuilder, loop: Loop) -> None:
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


def _pv_filter(b: NeutralBuilder, loop: Loop) -> None:
    constant = _value_if_on(b, loop.pv, "pv.filter", Decimal(NO_FILTER))
    if constant is not None:
        b.put("pv.filter", constant, "pv.filter", filter_time(quotient(constant, HUNDRED), loop.sample_rate))


def _setpoint_limits(b: NeutralBuilder, loop: Loop) -> None:
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


def _output(b: NeutralBuilder, loop: Loop) -> None:
    output = loop.output
    unit = output.unit or "%"
    b.put("output.unit", unit, "output.range", list(OUTPUT))
    b.put("output.unit", unit, "output.unit", unit)
    low, high = output.limits
    if low >= high:
        b.require("output.limits", f"the output limits {low} and {high} do not ascend: write the lower one first")
    elif is_given(loop, ("output", "limits")):
        b.put("output.limits", [low, high], "output.limits", [low, high])


def _bias(b: NeutralBuilder, loop: Loop) -> None:
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
            b.drop(f"{path}.{key}", value, SWITCHED_OFF)
        elif on and not harmless[key]:
            b.drop(f"{path}.{key}", None, "not given: this PLC compares with 0, since one bit enables all")


def _pv_alarms(b: NeutralBuilder, loop: Loop) -> None:
    pv, (low, high) = loop.alarms.pv, _pv_span(loop)
    if pv is None:
        return
    harmless = {"low_low": low >= 0, "low": low >= 0, "high": high <= 0, "high_high": high <= 0}
    points = {"low_low": pv.low_low, "low": pv.low, "high": pv.high, "high_high": pv.high_high}
    _points(b, "alarms.pv", points, on=pv_alarms_on(loop), harmless=harmless)


def _deviation_alarms(b: NeutralBuilder, loop: Loop) -> None:
    deviation = loop.alarms.deviation
    if deviation is not None:
        points = {"high": deviation.high, "high_high": deviation.high_high}
        _points(b, "alarms.deviation", points, on=deviation_alarms_on(loop), harmless=dict.fromkeys(points, False))


def _rate_of_change(b: NeutralBuilder, loop: Loop) -> None:
    rate = loop.alarms.rate_of_change
    if switched_on(loop.alarms.rate_of_change_enabled, rate):
        change = ZERO if rate is None else rate.per_sample(loop.sample_rate).value
        second = round_computed(quotient(change, loop.sample_rate))
        b.put("alarms.rate_of_change", ZERO if rate is None else str(rate), "alarms.rate_of_change", second)
    elif rate is not None:
        b.drop("alarms.rate_of_change", str(rate), SWITCHED_OFF)


# --- the loop ---------------------------------------------------------------------------------------------------------


def _autotune(b: NeutralBuilder, loop: Loop) -> None:
    b.drop_choices("autotune", loop.autotune, "choose it when the new controller is tuned")


FIELDS: Table[NeutralBuilder, Loop] = (
    *same_fields("name", "description", "mode"),
    Same("action", "output_raises_pv", RAISES),
    _sample_rate,
    _tuning,
    _derivative,
    _pv_range,
    Same("pv.unit"),
    _pv_filter,
    Same("setpoint.value"),
    _setpoint_limits,
    _output,
    Same("output.pwm.period", "output.pulse.period"),
    Same("state.output", "output.manual"),
    _bias,
    _error,
    _pv_alarms,
    _deviation_alarms,
    _rate_of_change,
    Same("alarms.hysteresis"),
    Same("freeze_bias", "anti_windup"),
    Same("bumpless", "setpoint.follows_pv", FOLLOWS),
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
            squared=_squared(loop),
            slowest_integral=NO_INTEGRAL,
            has_edge=True,
            deadband=Deadband.ONLY_BIAS,
        )
        for loop in config.loops
    ]
