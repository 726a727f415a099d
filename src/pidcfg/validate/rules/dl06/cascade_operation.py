"""Cascades in operation: modes that can never be reached, sample rates, and limits that work against each other."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.refs import DL06, Decision
from pidcfg.schemas.numbers import decimal_text
from pidcfg.validate.ideas.duplicates import at_both
from pidcfg.validate.rule import Findings, error, info, per_loop, warning
from pidcfg.validate.rules.dl06.cascade import link_key

if TYPE_CHECKING:
    from decimal import Decimal

    from pidcfg.validate.rules.dl06.context import Dl06Context, LoopView

OVERRIDE = DL06.at("Loop Mode Override")
CASCADED = DL06.at("Cascaded Loops in the DL06 CPU")
TUNING = DL06.at("Tuning Cascaded Loops")
INTRODUCTION = DL06.at("Cascade Control, Introduction")
SOURCES = DL06.at("Data Sources")

D26 = Decision(
    26,
    "a major loop should not ask for more than its minor loop takes",
    "Output limits of a major loop that reach beyond the minor loop's set point limits are a warning.",
    "The minor loop applies its limits internally; the major loop goes on integrating against them.",
)
RATIO = 10


@error(
    "DL265",
    OVERRIDE,
    "{name} has mode {mode}, but {major} is meant for {goal} and cannot leave Manual until {name} is in Cascade",
)
def major_loop_stuck_in_manual(context: Dl06Context) -> Findings:
    """A minor loop is not meant for Cascade although its major loop is meant to run.

    Why: a major loop cannot go from Manual to Auto until its minor loop is in Cascade mode, and goes back to Manual
    when the minor loop leaves it. With these modes the outer loop never controls.

    Fix: write `mode: cascade` for the minor loop, or `mode: manual` for the major loop.
    """
    for major, minor in context.cascades:
        if minor.loop.mode != "cascade" and major.loop.mode != "manual":
            effect = f"bit 0 of {major.v('mode_and_alarm_status')} ({major.name} in Manual) stays on"
            values = {"mode": minor.loop.mode, "name": minor.name, "major": major.name, "goal": major.loop.mode}
            at_minor, at_major = (view.at("mode", plc_effect=effect) for view in (minor, major))
            yield from at_both(minor, at_minor, major, at_major, **values)


@per_loop
@error(
    "DL266",
    DL06.at("Remote Setpoint (SP) Location"),
    "mode is cascade, but neither cascade_from nor remote_setpoint is given: the pointer in {word} is 0",
)
def cascade_mode_without_major(view: LoopView) -> Findings:
    """A loop is meant for Cascade mode and has no major loop.

    Why: in Cascade the set point comes from the word that +32 points at. Only inner loops run in Cascade; the outermost
    loop of a cascade runs in Auto.

    Fix: write `mode: auto` for the outermost loop, or name the major loop of an inner one in `cascade_from`.
    """
    if view.loop.mode == "cascade" and view.loop.cascade_from is None and view.loop.remote_setpoint is None:
        yield view.at("mode", word=view.v("remote_setpoint"))


@warning(
    "DL267",
    CASCADED,
    "{major} has mode manual, but {minor} is meant for cascade: its set point would be the manual output of {major}",
)
def major_loop_left_in_manual(context: Dl06Context) -> Findings:
    """The major loop of a running cascade is meant for Manual.

    Why: in normal operation the outermost loop is in Auto and all inner loops are in Cascade. With the major loop in
    Manual the minor loop follows a number that nobody calculates. Manual is also the default where `mode` is left out.

    Fix: write `mode: auto` for the outermost loop (`cascade` for one in between), or `mode: auto` for the minor loop.
    """
    for major, minor in context.cascades:
        if major.loop.mode == "manual" and minor.loop.mode == "cascade":
            values = {"major": major.name, "minor": minor.name}
            yield from at_both(major, major.at("mode"), minor, minor.at("mode"), **values)


@info(
    "DL268",
    CASCADED,
    "{name} has mode {mode}, so it keeps its own set point, and the output of {major} leads nowhere",
)
def idle_cascade(context: Dl06Context) -> Findings:
    """A minor loop is not meant for Cascade, and its major loop is meant for Manual.

    Why: the link is programmed but idle. That is how minor loops are tuned; in normal operation all inner loops run in
    Cascade and the outermost one in Auto. Mode is Manual where it is left out.

    Fix: after tuning, write `mode: cascade` for the inner loop and `mode: auto` for the outermost loop.
    """
    for major, minor in context.cascades:
        if minor.loop.mode != "cascade" and major.loop.mode == "manual":
            values = {"mode": minor.loop.mode, "name": minor.name, "major": major.name}
            yield from at_both(minor, minor.at("mode"), major, major.at("mode"), **values)


@warning("DL269", INTRODUCTION, "{major} samples every {fast} s, faster than its minor loop {minor} with {slow} s")
def major_loop_faster_than_minor(context: Dl06Context) -> Findings:
    """The major loop of a cascade is sampled more often than its minor loop.

    Why: for overall stability the minor loop must be the fastest responding loop of the two. Here the outer loop
    corrects several times before the inner one has moved once.

    Fix: sample the major loop about ten times as slowly as the minor loop.
    """
    for major, minor in context.cascades:
        slow, fast = minor.loop.sample_rate, major.loop.sample_rate
        if fast < slow:
            yield from _at_rates(major, minor, slow=slow, fast=fast)


@info(
    "DL270",
    TUNING,
    "{major} samples every {slow} s, {ratio} times its minor loop {minor} with {fast} s; the guideline is {limit}",
)
def cascade_rates_close(context: Dl06Context) -> Findings:
    """The major loop's sample rate is less than ten times the minor loop's.

    Why: the manual's starting point for tuning a cascade is a major loop that is slower by a factor of 10, so that the
    minor loop has settled before it is asked again.

    Fix: slow the major loop down, unless tuning has shown that it works.
    """
    for major, minor in context.cascades:
        slow, fast = major.loop.sample_rate, minor.loop.sample_rate
        if 0 < fast <= slow < RATIO * fast:
            ratio = f"{slow / fast:.3g}"
            yield from _at_rates(major, minor, slow=slow, fast=fast, ratio=ratio, limit=RATIO)


def _at_rates(major: LoopView, minor: LoopView, slow: Decimal, fast: Decimal, **values: object) -> Findings:
    """A finding at the sample rates of both loops."""
    values |= {"major": major.name, "minor": minor.name, "slow": decimal_text(slow), "fast": decimal_text(fast)}
    yield from at_both(major, major.at("sample_rate"), minor, minor.at("sample_rate"), **values)


@warning(
    "DL271",
    D26,
    "the output of {major} runs from {low} to {high}, but {minor} limits its set point to {least} to {most}: beyond it "
    "winds up",
)
def cascade_output_beyond_setpoint_limits(context: Dl06Context) -> Findings:
    """The output limits of a major loop reach beyond the set point limits of its minor loop.

    Why: the minor loop clips the set point silently. The major loop sees its output still moving and goes on
    integrating, and takes as long to come back.

    Fix: give the major loop's `output.limits` the values of the minor loop's `setpoint.limits`.
    """
    for major, minor in context.cascades:
        output, setpoint = major.holds("output_low", "output_high"), minor.holds("setpoint_low", "setpoint_high")
        if not minor.setpoint_limited or minor.loop.pv.square_root or not output or not setpoint:
            continue
        if output[0] < setpoint[0] or output[1] > setpoint[1]:
            values = {
                "major": major.name,
                "minor": minor.name,
                "low": major.eu(output[0], "output"),
                "high": major.eu(output[1], "output"),
                "least": minor.eu(setpoint[0], "sp"),
                "most": minor.eu(setpoint[1], "sp"),
            }
            at_major, at_minor = major.at("output", "limits"), minor.at("setpoint", "limits")
            yield from at_both(major, at_major, minor, at_minor, **values)


@warning(
    "DL272",
    SOURCES,
    "the output of {major} is the set point of {minor} and is also transferred to slot {slot}, channel {channel}",
)
def cascade_output_also_transferred(context: Dl06Context) -> Findings:
    """The output of a major loop also goes to an analog channel.

    Why: each of the main variables can have only one source or destination. The actuator belongs to the minor loop; a
    channel that the major loop writes is usually left over from a copied loop.

    Fix: remove `output.transfer` of the major loop.
    """
    for major, minor in context.cascades:
        transfer = major.loop.output.transfer
        if transfer is not None and transfer.slot is not None:
            where = {"slot": transfer.slot, "channel": transfer.channel}
            values = {"major": major.name, "minor": minor.name, **where}
            at_major, at_minor = major.at_key("output", "transfer"), minor.at(link_key(minor))
            yield from at_both(major, at_major, minor, at_minor, **values)
