"""Where a DL06 loop's set point comes from: cascades and the steps of a ramp/soak profile."""

from __future__ import annotations

import difflib
from decimal import ROUND_FLOOR, Decimal
from typing import TYPE_CHECKING

from pidcfg.encoders.dl06.image import OUTPUT_OFFSET, loop_start
from pidcfg.encoders.maps.dl06 import SLOPE
from pidcfg.schemas.base import v_name
from pidcfg.schemas.numbers import EXACT_CONTEXT, decimal_text
from pidcfg.text.diagnostics import Severity
from pidcfg.text.references import DL06, Decision
from pidcfg.text.signs import match_ignoring_case
from pidcfg.validate.rule import Findings, error, info, per_loop, warning
from pidcfg.validate.shared_checks import exceeded_alarm, find_circles, find_shared_keys, list_names, report_at_both

if TYPE_CHECKING:
    from pidcfg.schemas.dl06 import Output, Pv
    from pidcfg.validate.rules.dl06.alarms import Dl06Context, LoopView, RampSoakPair

# --- Cascade links: which loop gives which its set point, and whether the two words mean the same ---------------------

POINTER = DL06.cite("Remote Setpoint (SP) Location")
CASCADED_LOOPS = DL06.cite("Cascaded Loops in the DL06 CPU")
SOURCES = DL06.cite("Data Sources")

D24 = Decision(
    24,
    "a cascade passes raw counts",
    "The major loop's output range must equal the minor loop's PV range, and their data formats must agree.",
    "The minor loop reads the major loop's output word as its set point word; nothing converts it.",
)
D25 = Decision(
    25,
    "a minor loop takes no square root",
    "A cascade into a loop with square-root extract is an error unless the major loop's output limits stay within "
    "the root's scale.",
    "That loop's set point ends at the root of the span (64 counts for 12 bit), the output of a loop at the span "
    "(4095).",
)


@error("DL256", POINTER, "cascade_from names {name}, but no loop of the file has this name")
def unknown_major_loop(context: Dl06Context) -> Findings:
    """`cascade_from` names a loop that does not exist.

    Why: without the address of the major loop's output the pointer in +32 would be 0, and the loop would have no set
    point in Cascade.

    Fix: correct the name.
    """
    names = [loop.name for loop in context.config.loops]
    for view in context.loops:
        name = view.loop.cascade_from
        if name is not None and name not in names:
            near = difflib.get_close_matches(name, names, n=1, cutoff=0.6)
            cure = f"did you mean {near[0]}?" if near else None
            yield view.report("cascade_from", fix=cure, name=name).correct_to(match_ignoring_case(name, names))


@error("DL257", POINTER, "the remote set point of {name} is its own output in {word}")
def loop_cascaded_to_itself(context: Dl06Context) -> Findings:
    """A loop is its own major loop.

    Why: its output would become its set point: the loop chases itself to a limit.

    Fix: name the other loop, the one whose output is to be this loop's set point.
    """
    for view in context.loops:
        if context.majors[view.index] == view.index:
            yield view.report(link_key(view), name=view.name, word=view.address_of("output"))


def link_key(view: LoopView) -> str:
    """The key that makes a loop a minor loop."""
    return "cascade_from" if view.loop.cascade_from is not None else "remote_setpoint"


@error("DL258", CASCADED_LOOPS, "the cascade goes in a circle: {circle}")
def cascade_cycle(context: Dl06Context) -> Findings:
    """Loops give each other their set points in a circle.

    Why: a cascade has one outermost loop, which runs in Auto. In a circle there is none: each loop waits for its minor
    loop to be in Cascade, so none can leave Manual.

    Fix: remove one of the links.
    """
    for ring in find_circles(context.majors):
        if len(ring) > 1:
            names = [context.loops[i].name for i in ring]
            circle = " from ".join((*names, names[0]))
            for i in ring:
                view = context.loops[i]
                finding = view.report(link_key(view), circle=circle, plc_effect="the loops stay in Manual")
                yield finding.with_other_loops(*(name for name in names if name != view.name))


@error("DL259", CASCADED_LOOPS, "{minor} reads {format}, but {major} writes its output to {word} as {other}")
def cascade_format_mismatch(context: Dl06Context) -> Findings:
    """Major and minor loop of a cascade use different data formats.

    Why: the minor loop reads the major loop's output word as its set point, count for count. 4095 is full scale in 12
    bit and an eighth of it in 15 bit. The manual demands the same data range and sign for both.

    Fix: give the minor loop's `pv.format` and the major loop's output the same format.
    """
    for major, minor in context.cascades:
        output, pv = major.scales["output"].format.name, minor.scales["pv"].format.name
        if output != pv:
            key = ("pv", "format") if "format" in minor.loop.pv.model_fields_set else (link_key(minor),)
            word = major.address_of("output")
            values = {"minor": minor.name, "format": pv, "major": major.name, "other": output, "word": word}
            yield from report_at_both(minor, minor.report(*key), major, major.report("output", "format"), **values)


@error("DL260", D24, "{minor} reads the output of {major} as {read}, but {major} writes it as {written}")
def cascade_range_mismatch(context: Dl06Context) -> Findings:
    """The major loop's output range differs from the minor loop's PV range.

    Why: counts pass, not engineering values. If the major loop's 100 % is 60 m3/h and the minor loop's is 50, a demand
    of 30 m3/h arrives as 25.

    Fix: give the major loop's `output.range` the values of the minor loop's `pv.range`.
    """
    for major, minor in context.cascades:
        output, pv = major.loop.output.range, minor.loop.pv.range
        same_unit = None in {major.loop.output.unit, minor.loop.pv.unit} or major.loop.output.unit == minor.loop.pv.unit
        if (output is None) != (pv is None):
            yield from _missing_range_findings(major, minor)
        elif output is not None and pv is not None and (output != pv or not same_unit):
            key = "range" if output != pv else "unit"
            values = _scale_texts(major, minor)
            yield from report_at_both(major, major.report("output", key), minor, minor.report("pv", key), **values)


def _missing_range_findings(major: LoopView, minor: LoopView) -> Findings:
    """Only one side has a scale: it cannot be compared, and the other side's values are raw counts."""
    values = _scale_texts(major, minor)
    at_major, at_minor = (
        view.report(part, "range", severity=Severity.WARNING) for view, part in ((major, "output"), (minor, "pv"))
    )
    yield from report_at_both(major, at_major, minor, at_minor, **values)


def _scale_texts(major: LoopView, minor: LoopView) -> dict[str, str]:
    """The two scales of a cascade as a message compares them."""
    texts = {"read": _scale_text(minor.loop.pv), "written": _scale_text(major.loop.output)}
    return {"minor": minor.name, "major": major.name, **texts}


def _scale_text(part: Pv | Output) -> str:
    return "raw counts" if part.range is None else _range_text(part.range, part.unit)


def _range_text(ends: tuple[Decimal, Decimal], unit: str | None) -> str:
    return f"[{decimal_text(ends[0])}, {decimal_text(ends[1])}]{f' {unit}' if unit else ''}"


@error(
    "DL261",
    D25,
    "{minor} takes the square root of its PV, so its set point ends at {top} counts; {major} writes up to {most}",
)
def cascade_into_square_root(context: Dl06Context) -> Findings:
    """The minor loop of a cascade extracts the square root of its PV.

    Why: the set point of such a loop runs from 0 to the root of the span, the output of the major loop over the whole
    span. From a sixty-fourth of its travel on, the minor loop is asked for more than full flow.

    Fix: take the root outside the loop (in the transmitter or the ladder program), so that PV and set point are linear.
    """
    for major, minor in context.cascades:
        max_output, max_setpoint = major.counts("output_high"), minor.scales["sp"].full_counts
        if minor.loop.pv.square_root and max_output is not None and max_output > round(max_setpoint):
            most_text = major.quote("output_high")
            values = {"minor": minor.name, "top": round(max_setpoint), "major": major.name, "most": most_text}
            at_minor, at_major = minor.report("pv", "square_root"), major.report("output", "limits")
            yield from report_at_both(minor, at_minor, major, at_major, **values)


@warning("DL262", SOURCES, "{major} is also the major loop of {others}; {name} takes the same output as its set point")
def shared_major_loop(context: Dl06Context) -> Findings:
    """Two minor loops have the same major loop.

    Why: each of them takes the major loop to Manual when it leaves Cascade, and each, on going to Cascade with Bumpless
    I, overwrites the major loop's output with its own PV. The manual draws one minor loop per major loop.

    Fix: give each minor loop a major loop of its own, or split the output in the ladder program.
    """
    for index, minor, others in find_shared_keys((major.index, minor) for major, minor in context.cascades):
        major = context.loops[index].name
        finding = minor.report(link_key(minor), major=major, others=list_names(others), name=minor.name)
        yield finding.with_other_loops(*others)


@error("DL263", POINTER, "remote_setpoint is {address}, but cascade_from {major} points {word} at {output}")
def two_remote_setpoints(context: Dl06Context) -> Findings:
    """`cascade_from` and `remote_setpoint` name different words.

    Why: there is one pointer (+32). The loop can follow one of them only, and the file says both.

    Fix: keep `cascade_from`; `remote_setpoint` is for a pointer that is not known by a loop's name.
    """
    for view in context.loops:
        loop, major = view.loop, context.majors[view.index]
        if loop.cascade_from is not None and loop.remote_setpoint is not None and major is not None:
            output = loop_start(context.config.plc, major) + OUTPUT_OFFSET
            if output != loop.remote_setpoint:
                yield view.report(
                    "remote_setpoint",
                    address=v_name(loop.remote_setpoint),
                    major=loop.cascade_from,
                    word=view.address_of("remote_setpoint"),
                    output=v_name(output),
                )


@error("DL264", POINTER, "remote_setpoint {address} is not the output word (+05) of a loop of the table {table}")
def remote_setpoint_not_an_output(context: Dl06Context) -> Findings:
    """The remote set point pointer does not point at the output of another loop.

    Why: the pointer must be the address of the major loop's output: start of its table plus 5. With another word, mode
    requests and overrides of the cascade have no major loop to work on, and the set point is whatever stands there.

    Fix: write `cascade_from` with the major loop's name; the address then follows from the table.
    """
    outputs = {loop_start(context.config.plc, view.index) + OUTPUT_OFFSET for view in context.loops}
    for view in context.loops:
        address = view.loop.remote_setpoint
        if address is not None and view.loop.cascade_from is None and address not in outputs:
            first, last = context.table
            yield view.report("remote_setpoint", address=v_name(address), table=f"{v_name(first)}-{v_name(last)}")


# ----------------------------------------------------------------------------------------------------------------------
# Cascades in operation: modes that can never be reached, sample rates, and limits that work against each other.

OVERRIDE = DL06.cite("Loop Mode Override")
TUNING = DL06.cite("Tuning Cascaded Loops")
CASCADE_INTRO = DL06.cite("Cascade Control, Introduction")

D26 = Decision(
    26,
    "a major loop should not ask for more than its minor loop takes",
    "Output limits of a major loop that reach beyond the minor loop's set point limits are a warning.",
    "The minor loop applies its limits internally; the major loop goes on integrating against them.",
)
MIN_RATE_RATIO = 10


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
            effect = f"bit 0 of {major.address_of('mode_and_alarm_status')} ({major.name} in Manual) stays on"
            values = {"mode": minor.loop.mode, "name": minor.name, "major": major.name, "goal": major.loop.mode}
            at_minor, at_major = (view.report("mode", plc_effect=effect) for view in (minor, major))
            yield from report_at_both(minor, at_minor, major, at_major, **values)


@per_loop
@error(
    "DL266",
    DL06.cite("Remote Setpoint (SP) Location"),
    "mode is cascade, but neither cascade_from nor remote_setpoint is given: the pointer in {word} is 0",
)
def cascade_mode_without_major(view: LoopView) -> Findings:
    """A loop is meant for Cascade mode and has no major loop.

    Why: in Cascade the set point comes from the word that +32 points at. Only inner loops run in Cascade; the outermost
    loop of a cascade runs in Auto.

    Fix: write `mode: auto` for the outermost loop, or name the major loop of an inner one in `cascade_from`.
    """
    if view.loop.mode == "cascade" and view.loop.cascade_from is None and view.loop.remote_setpoint is None:
        yield view.report("mode", word=view.address_of("remote_setpoint"))


@warning(
    "DL267",
    CASCADED_LOOPS,
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
            yield from report_at_both(major, major.report("mode"), minor, minor.report("mode"), **values)


@info(
    "DL268",
    CASCADED_LOOPS,
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
            yield from report_at_both(minor, minor.report("mode"), major, major.report("mode"), **values)


@warning("DL269", CASCADE_INTRO, "{major} samples every {fast} s, faster than its minor loop {minor} with {slow} s")
def major_loop_faster_than_minor(context: Dl06Context) -> Findings:
    """The major loop of a cascade is sampled more often than its minor loop.

    Why: for overall stability the minor loop must be the fastest responding loop of the two. Here the outer loop
    corrects several times before the inner one has moved once.

    Fix: sample the major loop about ten times as slowly as the minor loop.
    """
    for major, minor in context.cascades:
        slow, fast = minor.loop.sample_rate, major.loop.sample_rate
        if fast < slow:
            yield from _rate_findings(major, minor, slow=slow, fast=fast)


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
        if 0 < fast <= slow < MIN_RATE_RATIO * fast:
            ratio = (slow / fast).quantize(Decimal("0.01"), ROUND_FLOOR).normalize()
            yield from _rate_findings(major, minor, slow=slow, fast=fast, ratio=ratio, limit=MIN_RATE_RATIO)


def _rate_findings(major: LoopView, minor: LoopView, slow: Decimal, fast: Decimal, **values: object) -> Findings:
    """A finding at the sample rates of both loops."""
    values |= {"major": major.name, "minor": minor.name, "slow": decimal_text(slow), "fast": decimal_text(fast)}
    yield from report_at_both(major, major.report("sample_rate"), minor, minor.report("sample_rate"), **values)


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
        output, setpoint = (
            major.register_values("output_low", "output_high"),
            minor.register_values("setpoint_low", "setpoint_high"),
        )
        if not minor.setpoint_limit_on or minor.loop.pv.square_root or not output or not setpoint:
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
            at_major, at_minor = major.report("output", "limits"), minor.report("setpoint", "limits")
            yield from report_at_both(major, at_major, minor, at_minor, **values)


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
            at_major, at_minor = major.report_key("output", "transfer"), minor.report(link_key(minor))
            yield from report_at_both(major, at_major, minor, at_minor, **values)


# --- The steps of a ramp/soak profile: targets, slopes and soak times -------------------------------------------------

TABLE = DL06.cite("Ramp/Soak Table")
TROUBLE_TIPS = DL06.cite("Troubleshooting Tips")

D27 = Decision(
    27,
    "a slope should be stored within 1 %",
    "A slope whose counts per second, with two decimals, differ by more than 1 % from what is written is a warning; "
    "one that a single sample completes as well.",
    "Slow ramps on wide ranges have few digits left, and the length of the ramp goes with the slope.",
)
MAX_SLOPE_ERROR = Decimal("0.01")


def pairs_until_end(view: LoopView) -> list[RampSoakPair]:
    """The pairs up to the first slope of 0, which ends the profile."""
    pairs: list[RampSoakPair] = []
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
    "DL282",
    TROUBLE_TIPS,
    "ramp_to is {value}, outside the set point limits {low} to {high}: the loop stops at the limit",
)
def ramp_target_outside_setpoint_limits(view: LoopView) -> Findings:
    """A ramp ends outside the loop's set point limits.

    Why: the generator writes the set point, and the calculation applies the limits to it. "The SP upper limit value is
    too low" is among the causes of a generator that seems not to operate: the product never gets to the temperature.

    Fix: widen the set point limits, or correct the target.
    """
    limits = view.register_values("setpoint_low", "setpoint_high") if view.pairs and view.setpoint_limit_on else []
    for pair in pairs_until_end(view) if limits else []:
        if pair.target is not None and not limits[0] <= pair.target <= limits[1]:
            yield view.report(
                "ramp_soak",
                "steps",
                pair.index,
                "ramp_to",
                value=view.text(pair.step.ramp_to, "sp", pair.target),
                low=view.quote("setpoint_low"),
                high=view.quote("setpoint_high"),
            )


@per_loop
@warning("DL283", TROUBLE_TIPS, "the first ramp ends at {value}, which is the set point already: it takes no time")
def first_ramp_without_length(view: LoopView) -> Findings:
    """The first ramp ends at the set point that the loop has when it starts.

    Why: the first ramp begins at the present set point. If that is its end value, it has no slope and no duration, and
    the generator moves on to the soak: it looks as if the first ramp did not work.

    Fix: give the loop another starting set point, or begin the profile with the next ramp.
    """
    pairs, setpoint = pairs_until_end(view), view.loop.setpoint.value
    if pairs and setpoint is not None and pairs[0].target is not None and pairs[0].target == view.counts("setpoint"):
        value = view.text(pairs[0].step.ramp_to, "sp", pairs[0].target)
        yield view.report("ramp_soak", "steps", 0, "ramp_to", value=value)


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
    stop = len(pairs_until_end(view))
    if used and stop <= used[-1]:
        yield view.report("ramp_soak", "steps", stop, "slope", lost=steps_text(stop, used[-1]))


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

    Fix: write one of the two nearest slopes that the word holds, a multiple of 0.01 counts a second; or use the 15-bit
    format, which has eight times the counts.
    """
    for pair in pairs_until_end(view):
        exact = view.scales["sp"].distance(pair.step.slope)
        if not pair.slope or exact <= 0:
            continue
        change = exact / pair.slope - 1
        if abs(pair.slope - exact) > MAX_SLOPE_ERROR * exact:
            yield view.report(
                "ramp_soak",
                "steps",
                pair.index,
                "slope",
                value=f"{pair.step.slope}{_slope_unit(view, pair)} a second",
                exact=f"{float(exact):.4g}",
                stored=pair.slope,
                percent=f"{abs(100 * float(change)):.1f}",
                longer="longer" if change > 0 else "less",
                fix=f"write {_nearest_slopes(view, exact, pair)}{_finer_format_hint(view)}",
            )


def _nearest_slopes(view: LoopView, exact: Decimal, pair: RampSoakPair) -> str:
    """The two nearest slopes that the word holds, in the unit of the file."""
    step, scale = SLOPE.step, view.scales["sp"]
    below = exact // step * step
    counts = [slope for slope in (below, below + step) if 0 < slope <= SLOPE.high]
    is_raw = pair.step.slope.counts or scale.range is None
    values = [slope if is_raw else EXACT_CONTEXT.divide(slope * scale.width, scale.full_counts) for slope in counts]
    unit = " counts" if pair.step.slope.counts else _slope_unit(view, pair)
    return " or ".join(
        f"{float(value):.4g}{unit} a second ({slope} counts)" for value, slope in zip(values, counts, strict=True)
    )


def _finer_format_hint(view: LoopView) -> str:
    """What else has more counts; empty: nothing."""
    finer = "; or use the 15-bit format, which has eight times the counts"
    return finer if view.loop.pv.format.startswith("12") else ""


def _slope_unit(view: LoopView, pair: RampSoakPair) -> str:
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
    target = None if view.loop.setpoint.value is None else view.counts("setpoint")
    for pair in pairs_until_end(view):
        start, target = target, pair.target
        if start is None or target is None or not pair.slope:
            continue
        time = abs(target - start) / float(pair.slope)
        if 0 < time <= float(view.loop.sample_rate):
            yield view.report(
                "ramp_soak",
                "steps",
                pair.index,
                "slope",
                start=view.eu(start, "sp"),
                end=view.eu(target, "sp"),
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
    for pair in pairs_until_end(view):
        if pair.soak == 0:
            yield view.report("ramp_soak", "steps", pair.index, "soak", steps=steps_text(pair.index, pair.index))


@per_loop
@warning(
    "DL288",
    DL06.cite("PV Absolute Value Alarms"),
    "ramp_to is {value}, beyond the {alarm} alarm at {limit}: the profile drives the loop into it",
)
def ramp_target_in_alarm(view: LoopView) -> Findings:
    """A ramp ends beyond a PV alarm point.

    Why: the profile itself brings the PV into alarm and keeps it there for the soak; the alarm then tells nothing about
    the process. A loop that leaves Auto meanwhile is not let back while a PV alarm exists.

    Fix: move the alarm beyond the highest (or lowest) step of the profile.
    """
    for pair in pairs_until_end(view):
        alarm = None if pair.target is None else exceeded_alarm(view, view.pv_counts_at(pair.target))
        if alarm is not None:
            value = view.text(pair.step.ramp_to, "sp", pair.target)
            yield view.report(
                "ramp_soak", "steps", pair.index, "ramp_to", value=value, alarm=alarm, limit=view.quote(f"pv_{alarm}")
            )
