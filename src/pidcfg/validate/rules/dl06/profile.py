"""The steps of a ramp/soak profile: targets, slopes and soak times."""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING

from pidcfg.refs import DL06, Decision
from pidcfg.schemas.numbers import decimal_text
from pidcfg.validate.ideas.alarms import alarm_beyond
from pidcfg.validate.rule import Findings, error, info, per_loop, warning

if TYPE_CHECKING:
    from pidcfg.validate.rules.dl06.context import LoopView, Pair

TABLE = DL06.at("Ramp/Soak Table")
TROUBLE = DL06.at("Troubleshooting Tips")

D27 = Decision(
    27,
    "a slope should be stored within 1 %",
    "A slope whose counts per second, with two decimals, differ by more than 1 % from what is written is a warning; "
    "one that a single sample completes as well.",
    "Slow ramps on wide ranges have few digits left, and the length of the ramp goes with the slope.",
)
ROUNDING = Decimal("0.01")


def running(view: LoopView) -> list[Pair]:
    """The pairs up to the first slope of 0, which ends the profile."""
    pairs: list[Pair] = []
    for pair in view.pairs:
        if pair.slope == 0:
            break
        pairs.append(pair)
    return pairs


def steps_text(first: int, last: int) -> str:
    """Pairs by the manual's numbers: a ramp and its soak are two steps."""
    return f"steps {2 * first + 1} {'and' if first == last else 'to'} {2 * last + 2}"


@per_loop
@error(
    "DL282", TROUBLE, "ramp_to is {value}, outside the set point limits {low} to {high}: the loop stops at the limit"
)
def ramp_target_outside_setpoint_limits(view: LoopView) -> Findings:
    """A ramp ends outside the loop's set point limits.

    Why: the generator writes the set point, and the calculation applies the limits to it. "The SP upper limit value is
    too low" is among the causes of a generator that seems not to operate: the product never gets to the temperature.

    Fix: widen the set point limits, or correct the target.
    """
    limits = view.holds("setpoint_low", "setpoint_high") if view.pairs and view.setpoint_limited else []
    for pair in running(view) if limits else []:
        if pair.target is not None and not limits[0] <= pair.target <= limits[1]:
            yield view.at(
                "ramp_soak",
                "steps",
                pair.index,
                "ramp_to",
                value=view.text(pair.step.ramp_to, "sp", pair.target),
                low=view.shown("setpoint_low"),
                high=view.shown("setpoint_high"),
            )


@per_loop
@warning("DL283", TROUBLE, "the first ramp ends at {value}, which is the set point already: it takes no time")
def first_ramp_without_length(view: LoopView) -> Findings:
    """The first ramp ends at the set point that the loop has when it starts.

    Why: the first ramp begins at the present set point. If that is its end value, it has no slope and no duration, and
    the generator moves on to the soak: it looks as if the first ramp did not work.

    Fix: give the loop another starting set point, or begin the profile with the next ramp.
    """
    pairs, setpoint = running(view), view.loop.setpoint.value
    if pairs and setpoint is not None and pairs[0].target is not None and pairs[0].target == view.counts("setpoint"):
        value = view.text(pairs[0].step.ramp_to, "sp", pairs[0].target)
        yield view.at("ramp_soak", "steps", 0, "ramp_to", value=value)


@per_loop
@error("DL284", TABLE, "slope is 0, which ends the profile: {lost} never run")
def profile_ends_early(view: LoopView) -> Findings:
    """A slope of 0 stands before the end of the profile.

    Why: the generator ends the profile when it finds ramp slope = 0; the soak of that pair and all steps behind it
    never run, and the complete bit is set as if all were done. A pair of zeros at the end is an unused one and does no
    harm.

    Fix: to stay at a set point, soak there longer; to step to one, give a steep slope (up to 99.99 counts a second).
    """
    pairs = view.pairs
    used = [pair.index for pair in pairs if pair.slope != 0 or pair.target != 0 or pair.soak != 0]
    stop = len(running(view))
    if used and stop <= used[-1]:
        yield view.at("ramp_soak", "steps", stop, "slope", lost=steps_text(stop, used[-1]))


@per_loop
@warning(
    "DL285",
    D27,
    "slope {value} is {exact} counts a second and is stored as {stored}: the ramp takes {percent} % {longer}",
)
def slope_rounded(view: LoopView) -> Findings:
    """A slope is stored more than 1 % off.

    Why: the word holds counts per second with two decimals. A slow ramp on a wide range has one or two digits left, and
    over hours the profile ends minutes early or late.

    Fix: use the 15-bit format (eight times the counts), or a slope that is a multiple of 0.01 counts a second.
    """
    for pair in running(view):
        exact = view.scales["sp"].distance(pair.step.slope)
        if not pair.slope or exact <= 0:
            continue
        change = exact / pair.slope - 1
        if abs(pair.slope - exact) > ROUNDING * exact:
            yield view.at(
                "ramp_soak",
                "steps",
                pair.index,
                "slope",
                value=f"{pair.step.slope}{_unit(view, pair)} a second",
                exact=f"{float(exact):.4g}",
                stored=pair.slope,
                percent=f"{abs(100 * float(change)):.1f}",
                longer="longer" if change > 0 else "less",
            )


def _unit(view: LoopView, pair: Pair) -> str:
    """The unit of a slope, with a blank before it."""
    return "" if pair.step.slope.counts or view.loop.pv.unit is None else f" {view.loop.pv.unit}"


@per_loop
@warning(
    "DL286",
    D27,
    "the ramp from {start} to {end} at {slope} counts a second takes {time} s, not more than one sample of "
    "{sample} s: it is a step",
)
def ramp_within_one_sample(view: LoopView) -> Findings:
    """A ramp is so steep that one sample completes it.

    Why: the generator moves the set point once per calculation. What was meant as a ramp reaches the process as a step.

    Fix: choose a smaller slope, or sample faster. The unit is per second: 5 degrees a minute is 0.083 a second.
    """
    at = None if view.loop.setpoint.value is None else view.counts("setpoint")
    for pair in running(view):
        start, at = at, pair.target
        if start is None or at is None or not pair.slope:
            continue
        time = abs(at - start) / float(pair.slope)
        if 0 < time <= float(view.loop.sample_rate):
            yield view.at(
                "ramp_soak",
                "steps",
                pair.index,
                "slope",
                start=view.eu(start, "sp"),
                end=view.eu(at, "sp"),
                slope=pair.slope,
                time=f"{time:.2g}",
                sample=decimal_text(view.loop.sample_rate),
            )


@per_loop
@info("DL287", TABLE, "soak is 0 min in {steps}; the manual's range begins at 0.1 min: the simulation soaks one sample")
def soak_of_zero(view: LoopView) -> Findings:
    """A step has no soak time.

    Why: the manual gives 000.1 to 999.9 minutes and does not say what 0 does. The simulated soak lasts one sample
    (D55).

    Fix: soak 0.1 min (6 s), if the PLC turns out to treat 0 differently.
    """
    for pair in running(view):
        if pair.soak == 0:
            yield view.at("ramp_soak", "steps", pair.index, "soak", steps=steps_text(pair.index, pair.index))


@per_loop
@warning(
    "DL288",
    DL06.at("PV Absolute Value Alarms"),
    "ramp_to is {value}, beyond the {alarm} alarm at {limit}: the profile drives the loop into it",
)
def ramp_target_in_alarm(view: LoopView) -> Findings:
    """A ramp ends beyond a PV alarm point.

    Why: the profile itself brings the PV into alarm and keeps it there for the soak; the alarm then tells nothing about
    the process. A loop that leaves Auto meanwhile is not let back while a PV alarm exists.

    Fix: move the alarm beyond the highest (or lowest) step of the profile.
    """
    for pair in running(view):
        alarm = None if pair.target is None else alarm_beyond(view, view.raw(pair.target))
        if alarm is not None:
            value = view.text(pair.step.ramp_to, "sp", pair.target)
            yield view.at(
                "ramp_soak", "steps", pair.index, "ramp_to", value=value, alarm=alarm, limit=view.shown(f"pv_{alarm}")
            )
