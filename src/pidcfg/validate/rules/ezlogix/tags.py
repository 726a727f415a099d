"""The tags of PV, CV and control output: what they share with each other and with the blocks."""

from __future__ import annotations

from itertools import permutations
from typing import TYPE_CHECKING

from pidcfg.diagnostics import Severity
from pidcfg.refs import EZLOGIX, Decision
from pidcfg.validate.ideas.duplicates import at_both
from pidcfg.validate.rule import Findings, checklist, error, per_loop, warning
from pidcfg.validate.rules.ezlogix.context import PLACES, EzlogixContext, LoopView, register_number

if TYPE_CHECKING:
    from collections.abc import Iterator


PV_TAG = EZLOGIX.at("Process Variable (PV) Tag")
CV_TAG = EZLOGIX.at("Control Variable (CV) Tag")
OUTPUT_TAG = EZLOGIX.at("Control Output Tag")
STOPPED = EZLOGIX.at("Process PID when PLC is Stopped")
BASE = EZLOGIX.at("Base Register Tag")

D180 = Decision(
    180,
    "a CV in another loop's set point register is a cascade",
    "A CV tag in any other register of a block is an error; in the set point register of another loop it is an info, "
    "and a warning when the CV's limits go beyond that set point's.",
    "Blocks hold what a loop runs by, and the manual lets any R register be a CV tag. Beyond the inner limits the set "
    "point stands still while the outer loop, whose CV is neither 0 nor 4095, goes on integrating.",
)
CV = "CV tag"
NAMES = {offset: name for name, offset in PLACES.items()}


@error("EZ404", BASE, "the {what} tag {tag} of {loop} is the register {register} of {owner}: {consequence}")
def tag_in_register_block(context: EzlogixContext) -> Findings:
    """A PV or CV tag is one of the 32 registers of a loop.

    Why: a CV that is written there replaces a gain, a limit or a set point at every calculation. A PV there is a
    parameter, not a measurement, and the ladder program that stores a measurement in it overwrites the parameter. The
    registers that are reserved count as well. The set point of another loop means a cascade, and is reported as such.

    Fix: choose a register outside all blocks.
    """
    for view in context.loops:
        for what, tag, place in (("PV", view.loop.pv.tag, "pv"), ("CV", view.loop.output.tag, "output")):
            owner = context.owner(tag)
            if owner is None or (what == "CV" and context.inner(view) is not None):
                continue
            values = {
                "what": what,
                "tag": tag,
                "loop": view.name,
                "register": NAMES[owner[1]],
                "owner": owner[0].name,
                "consequence": "the loop overwrites it" if what == "CV" else "it is no measurement",
            }
            if owner[0] is view:
                yield view.at(place, "tag").quoting(**values)
            else:
                at_owner = owner[0].at(owner[0].extents[0].key)
                yield from at_both(view, view.at(place, "tag"), owner[0], at_owner, **values)


@checklist(
    "EZ405",
    D180,
    "the CV tag {tag} of {loop} is the set point register of {inner}: a cascade; the CV's limits are {low} and {high} "
    "counts, the set point's {inner_low} and {inner_high}",
)
def cv_writes_set_point(context: EzlogixContext) -> Findings:
    """The CV of a loop is the set point of another one.

    Why: the registers are one, so what the file says of the inner set point is overwritten. The CV arrives in counts.
    Where it may go beyond the inner set point's limits (a warning), the set point stands still and the outer loop winds
    up, since a CV saturates at 0 and 4095 only.

    Fix: make the CV's limits those of the inner set point, if a cascade is meant. Otherwise choose a register outside
    all blocks.
    """
    for view in context.loops:
        inner = context.inner(view)
        if inner is None:
            continue
        cv, sp = view.cv_limits, inner.setpoint_limits
        if cv is not None and sp is not None:
            beyond = cv[0] < sp[0] or cv[1] > sp[1]
            severity = Severity.WARNING if beyond else None
            names = {"loop": view.name, "tag": view.loop.output.tag, "inner": inner.name}
            limits = {"low": cv[0], "high": cv[1], "inner_low": sp[0], "inner_high": sp[1]}
            at_outer, at_inner = view.at("output", "tag", severity=severity), inner.at("setpoint", severity=severity)
            yield from at_both(view, at_outer, inner, at_inner, **names, **limits)


@error("EZ406", CV_TAG, "{tag} is also the {what} of {other}: two loops would write it")
def output_tag_shared(context: EzlogixContext) -> Findings:
    """Two loops have one CV tag, or one control output.

    Why: both write it, each at its own sample rate, and what the actuator sees is neither loop's output.

    Fix: give each loop outputs of its own. Where one actuator serves two loops, let the ladder program choose.
    """
    for (tag, (view, what)), (other_tag, (other, theirs)) in permutations(_written(context), 2):
        if tag == other_tag:
            place = ("output", "tag") if what == CV else ("output", "pulse", "tag")
            basis = None if what == CV else OUTPUT_TAG
            found = view.at(*place, basis=basis, tag=tag, what=theirs, other=other.name)
            yield found if other is view else found.shared_with(other.name)


def _written(context: EzlogixContext) -> Iterator[tuple[str, tuple[LoopView, str]]]:
    """The tags that loops write, with what they are."""
    for view in context.loops:
        output = view.loop.output
        yield output.tag, (view, CV)
        if output.pulse is not None:
            yield output.pulse.tag, (view, "control output")


@per_loop
@error("EZ407", PV_TAG, "{tag} is PV tag and CV tag of the loop: it would measure its own output")
def pv_is_own_cv(view: LoopView) -> Findings:
    """A loop's PV tag is its CV tag.

    Why: what the loop writes is what it reads next. It controls its own register, and the process not at all.

    Fix: give the PV the register that holds the measurement.
    """
    if view.loop.pv.tag == view.loop.output.tag:
        yield view.at("output", "tag", tag=view.loop.output.tag)


def logical(context: EzlogixContext, tag: str) -> bool:
    """Whether a tag is a register outside all blocks, which the ladder program fills or reads."""
    return register_number(tag) is not None and context.owner(tag) is None


@warning("EZ410", STOPPED, "the loop goes on while the PLC is stopped, but {tags}")
def logical_tag_while_stopped(context: EzlogixContext) -> Findings:
    """A loop is processed while the PLC is stopped, with tags that only the ladder program moves.

    Why: a stopped PLC executes no ladder. A PV in an R register stands still, and with any error left the integral runs
    the output to its end; a CV in an R register does not reach its actuator.

    Fix: use an IR tag for the PV, and an OR tag or the control output for the CV; or write
    `process_when_stopped: false` under `plc`.
    """
    if not context.config.plc.process_when_stopped:
        return
    outputs = {view.loop.output.tag for view in context.loops}
    for view in context.loops:
        pv, output = view.loop.pv.tag, view.loop.output
        frozen = logical(context, pv) and pv not in outputs
        unheard = logical(context, output.tag) and output.pulse is None and output.tag != pv
        parts = [f"its PV {pv} stands still"] * frozen + [f"its CV {output.tag} reaches no output"] * unheard
        if parts:
            yield view.at("pv" if frozen else "output", "tag", tags=" and ".join(parts))
