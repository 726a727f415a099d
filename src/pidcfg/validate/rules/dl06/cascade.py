"""Cascade links: which loop gives which its set point, and whether the two words mean the same."""

from __future__ import annotations

import difflib
from typing import TYPE_CHECKING

from pidcfg.diagnostics import Severity
from pidcfg.encoders.dl06.encode import OUTPUT_OFFSET, loop_start
from pidcfg.refs import DL06, Decision
from pidcfg.schemas.numbers import decimal_text
from pidcfg.schemas.octal import v_name
from pidcfg.validate.ideas.cascades import rings
from pidcfg.validate.ideas.duplicates import at_both, in_words, sharing
from pidcfg.validate.rule import Findings, error, warning

if TYPE_CHECKING:
    from decimal import Decimal

    from pidcfg.schemas.dl06 import Output, Pv
    from pidcfg.validate.rules.dl06.context import Dl06Context, LoopView

POINTER = DL06.at("Remote Setpoint (SP) Location")
CASCADED = DL06.at("Cascaded Loops in the DL06 CPU")
SOURCES = DL06.at("Data Sources")

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
            yield view.at("cascade_from", fix=f"did you mean {near[0]}?" if near else None, name=name)


@error("DL257", POINTER, "the remote set point of {name} is its own output in {word}")
def loop_cascaded_to_itself(context: Dl06Context) -> Findings:
    """A loop is its own major loop.

    Why: its output would become its set point: the loop chases itself to a limit.

    Fix: name the other loop, the one whose output is to be this loop's set point.
    """
    for view in context.loops:
        if context.majors[view.index] == view.index:
            yield view.at(link_key(view), name=view.name, word=view.v("output"))


def link_key(view: LoopView) -> str:
    """The key that makes a loop a minor loop."""
    return "cascade_from" if view.loop.cascade_from is not None else "remote_setpoint"


@error("DL258", CASCADED, "the cascade goes in a circle: {circle}")
def cascade_cycle(context: Dl06Context) -> Findings:
    """Loops give each other their set points in a circle.

    Why: a cascade has one outermost loop, which runs in Auto. In a circle there is none: each loop waits for its minor
    loop to be in Cascade, so none can leave Manual.

    Fix: remove one of the links.
    """
    for ring in rings(context.majors):
        if len(ring) > 1:
            names = [context.loops[i].name for i in ring]
            circle = " from ".join((*names, names[0]))
            for i in ring:
                view = context.loops[i]
                finding = view.at(link_key(view), circle=circle, plc_effect="the loops stay in Manual")
                yield finding.shared_with(*(name for name in names if name != view.name))


@error("DL259", CASCADED, "{minor} reads {format}, but {major} writes its output to {word} as {other}")
def cascade_format_mismatch(context: Dl06Context) -> Findings:
    """Major and minor loop of a cascade use different data formats.

    Why: the minor loop reads the major loop's output word as its set point, count for count. 4095 is full scale in 12
    bit and an eighth of it in 15 bit. The manual demands the same data range and sign for both.

    Fix: give the minor loop's `pv.format` and the major loop's output the same format.
    """
    for major, minor in context.cascades:
        written, read = major.scales["output"].format.name, minor.scales["pv"].format.name
        if written != read:
            key = ("pv", "format") if "format" in minor.loop.pv.model_fields_set else (link_key(minor),)
            word = major.v("output")
            values = {"minor": minor.name, "format": read, "major": major.name, "other": written, "word": word}
            yield from at_both(minor, minor.at(*key), major, major.at("output", "format"), **values)


@error("DL260", D24, "{minor} reads the output of {major} as {read}, but {major} writes it as {written}")
def cascade_range_mismatch(context: Dl06Context) -> Findings:
    """The major loop's output range differs from the minor loop's PV range.

    Why: counts pass, not engineering values. If the major loop's 100 % is 60 m3/h and the minor loop's is 50, a demand
    of 30 m3/h arrives as 25.

    Fix: give the major loop's `output.range` the values of the minor loop's `pv.range`.
    """
    for major, minor in context.cascades:
        written, read = major.loop.output.range, minor.loop.pv.range
        same_unit = None in {major.loop.output.unit, minor.loop.pv.unit} or major.loop.output.unit == minor.loop.pv.unit
        if (written is None) != (read is None):
            yield from _one_range(major, minor)
        elif written is not None and read is not None and (written != read or not same_unit):
            key = "range" if written != read else "unit"
            values = _scales(major, minor)
            yield from at_both(major, major.at("output", key), minor, minor.at("pv", key), **values)


def _one_range(major: LoopView, minor: LoopView) -> Findings:
    """Only one side has a scale: it cannot be compared, and the other side's values are raw counts."""
    values = _scales(major, minor)
    at_major, at_minor = (
        view.at(part, "range", severity=Severity.WARNING) for view, part in ((major, "output"), (minor, "pv"))
    )
    yield from at_both(major, at_major, minor, at_minor, **values)


def _scales(major: LoopView, minor: LoopView) -> dict[str, str]:
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
        most, top = major.counts("output_high"), minor.scales["sp"].full
        if minor.loop.pv.square_root and most is not None and most > round(top):
            most_text = major.shown("output_high")
            values = {"minor": minor.name, "top": round(top), "major": major.name, "most": most_text}
            at_minor, at_major = minor.at("pv", "square_root"), major.at("output", "limits")
            yield from at_both(minor, at_minor, major, at_major, **values)


@warning("DL262", SOURCES, "{major} is also the major loop of {others}; {name} takes the same output as its set point")
def shared_major_loop(context: Dl06Context) -> Findings:
    """Two minor loops have the same major loop.

    Why: each of them takes the major loop to Manual when it leaves Cascade, and each, on going to Cascade with Bumpless
    I, overwrites the major loop's output with its own PV. The manual draws one minor loop per major loop.

    Fix: give each minor loop a major loop of its own, or split the output in the ladder program.
    """
    for index, minor, others in sharing((major.index, minor) for major, minor in context.cascades):
        major = context.loops[index].name
        finding = minor.at(link_key(minor), major=major, others=in_words(others), name=minor.name)
        yield finding.shared_with(*others)


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
                yield view.at(
                    "remote_setpoint",
                    address=v_name(loop.remote_setpoint),
                    major=loop.cascade_from,
                    word=view.v("remote_setpoint"),
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
            yield view.at("remote_setpoint", address=v_name(address), table=f"{v_name(first)}-{v_name(last)}")
