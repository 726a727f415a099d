"""Neutral loops as CLICK ones: gains in % of the output per unit of the PV, blocks from C1, DS1 and DF1 upward."""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING, Any

from pidcfg.conversion.arithmetic import (
    HUNDRED,
    ONE,
    ZERO,
    filter_share,
    gain_limit,
    number,
    product,
    quotient,
    rescaled,
    width,
)
from pidcfg.conversion.builder import Builder, chosen, given, starts
from pidcfg.conversion.ledger import Target
from pidcfg.conversion.to_neutral.click import FOLLOWS, NO_FILTER, NO_INTEGRAL, OUTPUT, RAISES
from pidcfg.encoders.maps.click import BLOCKS
from pidcfg.encoders.values import present
from pidcfg.encoders.words import nearest
from pidcfg.refs import Decision
from pidcfg.schemas.base import decimal_text
from pidcfg.schemas.click import BITS, DERIVATIVE, FLOATS, GAIN, INTEGERS, RESET, SAMPLE_RATE

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pidcfg.schemas.generic import Deviation, GenericFile, Loop, Points

D287 = Decision(
    287,
    "an alarm that is not wanted goes where the PV cannot get",
    "Of the PV's alarms the outer points go a range's width outside the range, of the deviation's the outer one to the "
    "width of the range; an inner point that is not wanted goes to the outer one.",
    "One bit enables all alarms of a group, and a register that is not given is compared like any other.",
)
D288 = Decision(
    288,
    "a loop without a proportional action gets the smallest gain",
    "The gain becomes the smallest that its register and those of the two times allow, and the times shrink or grow "
    "with it, so that integral and derivative act as strongly as before.",
    "The gain stands before all three terms and cannot be 0.",
)
BANKS = {"bits": BITS, "integers": INTEGERS, "floats": FLOATS}
ACTIONS = {raises: action for action, raises in RAISES.items()}
MODES = {follows: mode for mode, follows in FOLLOWS.items()}
LEAST_GAIN, LEAST_RESET = Decimal(str(GAIN.low)), Decimal(str(RESET.low))
MOST_RATE = Decimal(str(DERIVATIVE.high))
LEAST_SAMPLE, MOST_SAMPLE = Decimal(str(SAMPLE_RATE.low)), Decimal(str(SAMPLE_RATE.high))
SETPOINT, OUTPUT_REGISTER = 0, 8
"""Where set point and output stand in the block of floats."""


def from_neutral(file: GenericFile, options: Mapping[str, Any]) -> Target:
    """A CLICK file with these loops."""
    count = len(file.loops)
    blocks = {key: starts(BANKS[key], table.size, count, options.get(key) or ()) for key, (_, table) in BLOCKS.items()}
    pulses = chosen([entry and entry["bit"] for entry in options.get("pwm_bit") or ()], count, "Y{:03d}".format)
    builders = []
    for i, loop in enumerate(file.loops):
        b = Builder()
        b.put("name", loop.name, "name")
        if loop.description is not None:
            b.put("description", loop.description, "description")
        for key, (prefix, _) in BLOCKS.items():
            b.put(key, f"{prefix}{blocks[key][i]}", None, "" if key in options else "the next free block")
        _loop(b, loop, pulses[i])
        if loop.setpoint.source is not None:
            _cascade(b, loop, {other.name: blocks["floats"][j] for j, other in enumerate(file.loops)})
        builders.append(b)
    data = {"pidcfg": 1, "vendor": "click"} | present({"name": file.name, "description": file.description})
    return Target({**data, "loops": [b.data for b in builders]}, [b.puts for b in builders])


def _loop(b: Builder, loop: Loop, bit: str) -> None:
    b.put("mode", "manual" if loop.mode == "manual" else "auto", "mode")
    b.put("action", ACTIONS[loop.output_raises_pv], "output_raises_pv")
    held = min(max(loop.sample_time, LEAST_SAMPLE), MOST_SAMPLE)
    milliseconds = nearest(held.scaleb(3))
    b.put("sample_rate", f"{milliseconds} ms", "sample_time", exact=loop.sample_time, clamped=held != loop.sample_time)
    sample = Decimal(milliseconds).scaleb(-3)
    _bumpless(b, loop)
    b.put("freeze_bias", loop.anti_windup, "anti_windup")
    _tuning(b, loop)
    _derivative_filter(b, loop)
    _pv(b, loop, sample)
    _setpoint(b, loop)
    _output(b, loop, bit)
    if loop.deadband:
        b.put("error.deadband", number(loop.deadband), "deadband")
    _alarms(b, loop, sample)


def _bumpless(b: Builder, loop: Loop) -> None:
    """Mode 1 sets the set point to the PV; where nothing is said it stays, if there is one."""
    setpoint = loop.setpoint
    if setpoint.follows_pv is not None:
        b.put("bumpless", MODES[setpoint.follows_pv], "setpoint.follows_pv")
        return
    keeps = setpoint.value is not None or setpoint.source is not None
    b.put("bumpless", MODES[not keeps], None, "the set point stays" if keeps else "Auto begins with the present PV")


# --- equation --------------------------------------------------------------------------------------------------------


def _tuning(b: Builder, loop: Loop) -> None:
    tuning = loop.tuning
    per_cent = quotient(HUNDRED, width(loop.output.range))
    gain, reset, rate = product(tuning.gain, per_cent), tuning.integral_time, tuning.derivative_time
    if not tuning.proportional:
        share = quotient(_smallest_gain(gain, reset, rate), gain) if gain else ONE
        gain, reset, rate = product(gain, share), product(reset, share), quotient(rate, share)
        b.drop(
            "tuning.proportional",
            "P cannot be switched off: the gain is the smallest there is, and the times are changed with it",
        )
    b.put("tuning.proportional_gain", number(gain), "tuning.gain")
    longest = "6000 s is the longest reset time, and counts as no integral" if not reset or reset >= NO_INTEGRAL else ""
    b.put("tuning.reset_time", number(reset or NO_INTEGRAL), "tuning.integral_time", longest)
    b.put("tuning.derivative_gain", number(rate), "tuning.derivative_time")
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
    for_reset = quotient(product(gain, LEAST_RESET), reset) if reset else ZERO
    return max(LEAST_GAIN, for_reset, quotient(product(gain, rate), MOST_RATE))


def _derivative_filter(b: Builder, loop: Loop) -> None:
    constant, rate = loop.tuning.derivative_filter, loop.tuning.derivative_time
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


def _pv(b: Builder, loop: Loop, sample: Decimal) -> None:
    pv = loop.pv
    b.put(
        "pv.range",
        [number(end) for end in pv.range],
        "pv.range",
        assumed=True,
        note="that of the instrument: write what the process reaches at 0 and 100 % of the output",
    )
    b.put("pv.input_range", [number(end) for end in pv.range], "pv.range", "the range of the instrument")
    if pv.unit is not None:
        b.put("pv.unit", pv.unit, "pv.unit")
    if pv.filter:
        share = product(filter_share(pv.filter, sample), HUNDRED)
        if nearest(share) >= NO_FILTER:
            b.drop("pv.filter", f"with a sample rate of {decimal_text(sample)} s such a filter passes everything")
        else:
            b.put(
                "pv.filter",
                max(nearest(share), 1),
                "pv.filter",
                "% of the raw PV that each sample passes",
                exact=share,
                clamped=share < ONE,
            )
    if pv.square_root:
        b.drop("pv.square_root", "take the root in the program, before the raw PV (DFn+11)")


def _setpoint(b: Builder, loop: Loop) -> None:
    setpoint = loop.setpoint
    if setpoint.value is not None:
        b.put("setpoint.value", number(setpoint.value), "setpoint.value")
    if setpoint.limits is not None:
        for i, end in enumerate(("lower", "upper")):
            b.put(f"setpoint.{end}_limit", number(setpoint.limits[i]), f"setpoint.limits.{i}")


def _cascade(b: Builder, loop: Loop, floats: Mapping[str, int]) -> None:
    """What the program does for a loop whose set point is another one's output."""
    source, own = str(loop.setpoint.source), floats[loop.name]
    low, high = (decimal_text(end) for end in loop.pv.range)
    outer = f"DF{floats[source] + OUTPUT_REGISTER} of {source}" if source in floats else f"the output of {source}"
    b.drop(
        "setpoint.source",
        f"scale {outer}, 0 to 100 %, to {low} to {high} in the program, and write it to DF{own + SETPOINT}",
    )


def _output(b: Builder, loop: Loop, bit: str) -> None:
    output, span = loop.output, loop.output.range
    percent = span == OUTPUT
    shown = " to ".join(decimal_text(end) for end in span)
    note = "" if percent else f"0 to 100 % of the output are {shown} {output.unit or ''}".rstrip()
    exact = [rescaled(end, span, OUTPUT) for end in output.limits or span]
    held = [min(max(end, ZERO), HUNDRED) for end in exact]
    b.put("output.limits", [number(end) for end in held], "output.range", note)
    if output.limits is not None:
        for i in range(2):
            b.mark(f"output.limits.{i}", f"output.limits.{i}", exact=exact[i], clamped=held[i] != exact[i])
    if output.unit is not None and percent:
        b.put("output.unit", output.unit, "output.unit")
    elif output.unit is not None:
        b.mark("output.limits", "output.unit", note)
    if output.manual is not None:
        b.put("state.output", number(rescaled(output.manual, span, OUTPUT)), "output.manual")
    if given(loop, "output", "bias"):
        share = number(rescaled(output.bias, span, OUTPUT))
        if loop.tuning.integral_time:
            b.put("state.bias", share, "output.bias", "Auto begins with the output as it stands in Manual")
        else:
            b.drop("output.bias", f"set the output to {share} % in Manual before going to Auto: it becomes the bias")
    if output.max_rate is not None:
        b.drop("output.max_rate", "limit the change of the output in the program")
    if output.pulse is not None:
        _pulse(b, loop, bit)


def _pulse(b: Builder, loop: Loop, bit: str) -> None:
    pulse = loop.output.pulse
    if pulse is None:
        return
    b.put("output.pwm.bit", bit, None, "the dialog alone holds it")
    b.put("output.pwm.period", number(pulse.period), "output.pulse.period")
    for key, what in (("min_on", "pulses"), ("min_off", "gaps")):
        time = getattr(pulse, key)
        if time:
            b.drop(f"output.pulse.{key}", f"leave {what} shorter than {decimal_text(time)} s out in the program")


# --- alarms ----------------------------------------------------------------------------------------------------------


def _alarms(b: Builder, loop: Loop, sample: Decimal) -> None:
    alarms, span = loop.alarms, loop.pv.range
    _group(b, "alarms.pv", dict(alarms.pv), _pv_points(alarms.pv, span))
    _group(b, "alarms.deviation", dict(alarms.deviation), _deviation_points(alarms.deviation, span))
    if alarms.rate_of_change is not None:
        b.put(
            "alarms.rate_of_change",
            number(product(alarms.rate_of_change, sample)),
            "alarms.rate_of_change",
            "per sample",
        )
    if alarms.hysteresis:
        b.put("alarms.hysteresis", number(alarms.hysteresis), "alarms.hysteresis")


def _group(b: Builder, path: str, wanted: Mapping[str, Decimal | None], points: Mapping[str, Decimal]) -> None:
    """All points of a group, when one of them is wanted."""
    if all(value is None for value in wanted.values()):
        return
    for key, value in points.items():
        if wanted[key] is None:
            b.put(f"{path}.{key}", number(value), None, "not wanted: one bit enables all of them")
        else:
            b.put(f"{path}.{key}", number(value), f"{path}.{key}")


def _pv_points(points: Points, span: tuple[Decimal, Decimal]) -> dict[str, Decimal]:
    """The four points with those that are not wanted out of reach (D287)."""
    reach = width(span)
    low, high = _inner(points.low, points.low_low), _inner(points.high, points.high_high)
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
    high = _inner(points.high, points.high_high) or ZERO
    return {"high": high, "high_high": max(width(span), high) if points.high_high is None else points.high_high}


def _inner(point: Decimal | None, outer: Decimal | None) -> Decimal | None:
    return outer if point is None else point
