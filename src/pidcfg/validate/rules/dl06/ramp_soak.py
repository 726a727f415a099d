"""The ramp/soak generator: its table's place in memory, and whether it can run."""

from __future__ import annotations

from itertools import permutations
from typing import TYPE_CHECKING

from pidcfg.diagnostics import Severity
from pidcfg.encoders.dl06.setup import TABLE_IN_SYSTEM, TABLE_OUTSIDE_LOWER, TABLE_OUTSIDE_UPPER, check_ramp_soak
from pidcfg.encoders.maps.dl06 import CPU, RAMP_SOAK_SIZE
from pidcfg.refs import DL06, Decision
from pidcfg.schemas.octal import v_name
from pidcfg.validate.rule import Findings, error, info, per_loop, warning
from pidcfg.validate.rules.dl06.setup import between

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.validate.rules.dl06.context import Dl06Context, LoopView

ERRORS = DL06.at("Ramp/Soak Programming Errors")
TABLE = DL06.at("Ramp/Soak Table")
ENABLE = DL06.at("Ramp/Soak Generator Enable")
CONTROLS = DL06.at("Ramp/Soak Controls")
TROUBLE = DL06.at("Troubleshooting Tips")

D348 = Decision(
    348,
    "user memory for ramp/soak tables",
    "V400-V677, V1200-V7577 and V10000-V17777. A table below V1200 or beyond V7377 is a warning.",
    "The data areas of the PV transfer contain V400-V677 and end at V7377; the lower range of V7640 begins at V1200, "
    "and bit 3 of V7642 speaks of the boundary at V7577.",
)
UNDISPUTED = tuple(area for area in CPU.transfer_sources if area[0] >= CPU.lower[0])
BELOW_LOWER = (
    "a data area of the PV transfer (V400-V677), but below the lower memory of V7640, which begins at V1200: bit 0 of "
    "+35 may come on"
)
BEYOND_SOURCES = (
    "up to V7577 by the flags of V7642, but the data area of the PV transfer ends at V7377: bit 0 of +35 may come on"
)

BITS = {TABLE_OUTSIDE_LOWER: 0, TABLE_OUTSIDE_UPPER: 1, TABLE_IN_SYSTEM: 4}


def tables(context: Dl06Context) -> Iterator[tuple[LoopView, int, int]]:
    """Each loop with a ramp/soak table that is used or written: the table's first and last word."""
    for view in context.loops:
        profile = view.loop.ramp_soak
        if profile is not None and (profile.enabled or profile.steps is not None):
            yield view, profile.table, profile.table + RAMP_SOAK_SIZE - 1


def error_bit(view: LoopView, flags: int) -> str:
    """How findings name a bit of +35."""
    return f"bit {BITS[flags]} of {view.v('ramp_soak_errors')} when the profile is started: it does not run"


@error("DL274", ERRORS, "the ramp/soak table occupies {words}, outside user memory ({user})")
def ramp_soak_table_outside_user_memory(context: Dl06Context) -> Findings:
    """The 32 words of a ramp/soak table do not all lie in user memory.

    Why: when the generator is started, the CPU sets bit 0 or bit 1 of +35 and the profile does not run; until then
    nothing shows. The table needs its 32 words whatever the number of steps.

    Fix: place it in V1200-V7377 or V10000-V17777, all 32 words (40 octal).
    """
    for view, first, last in tables(context):
        flags = check_ramp_soak(first)
        if flags and flags != TABLE_IN_SYSTEM:
            yield view.at(
                "ramp_soak",
                "table",
                plc_effect=error_bit(view, flags),
                words=between((first, last)),
                user=", ".join(between(ends) for ends in CPU.user),
            )


@error("DL275", ERRORS, "the ramp/soak table starts at {start}, among the system parameters {system}")
def ramp_soak_table_in_system_memory(context: Dl06Context) -> Findings:
    """A ramp/soak table starts among the system parameters V7600-V7777.

    Why: V7640 to V7642, the set-up of all loops, lie there. Downloading the table would overwrite them; the CPU sets
    bit 4 of +35 when the profile is started.

    Fix: place the table in user memory, V1200-V7377 or V10000-V17777.
    """
    for view, first, _ in tables(context):
        if check_ramp_soak(first) == TABLE_IN_SYSTEM:
            yield view.at(
                "ramp_soak",
                "table",
                plc_effect=error_bit(view, TABLE_IN_SYSTEM),
                start=v_name(first),
                system=between(CPU.system),
            )


@warning("DL505", D348, "the ramp/soak table occupies {words}; {doubt}")
def ramp_soak_table_in_disputed_memory(context: Dl06Context) -> Findings:
    """A ramp/soak table lies where one passage of the manual has user memory and another has not.

    Why: a table "may be anywhere in user memory", and no list says what that is. The data areas of the PV transfer are
    V400-V677, V1200-V7377 and V10000-V17777; the pointer of the loop table begins at V1200; the error flags of V7642
    know a boundary at V7577. Where the CPU sees it otherwise, it sets bit 0 of +35 when the profile is started, and the
    profile does not run.

    Fix: place the table in V1200-V7377 or V10000-V17777, which no passage contradicts.
    """
    for view, first, last in tables(context):
        if not check_ramp_soak(first) and not any(low <= first and last <= high for low, high in UNDISPUTED):
            below = last < CPU.lower[0]
            yield view.at(
                "ramp_soak", "table", words=between((first, last)), doubt=BELOW_LOWER if below else BEYOND_SOURCES
            )


@error("DL276", TABLE, "the ramp/soak table {words} overlaps the loop table {table}")
def ramp_soak_table_in_loop_table(context: Dl06Context) -> Findings:
    """A ramp/soak table overlaps the loop table.

    Why: one of the two overwrites the other: set points and slopes would be read as gains and pointers of a loop.

    Fix: move the ramp/soak table behind the loop table or anywhere else in user memory (32 words).
    """
    start, end = context.table
    for view, first, last in tables(context):
        if first <= end and last >= start:
            yield view.at("ramp_soak", "table", words=between((first, last)), table=between((start, end)))


@error("DL277", TABLE, "the ramp/soak table {words} overlaps that of {other}, {theirs}")
def ramp_soak_tables_overlap(context: Dl06Context) -> Findings:
    """The ramp/soak tables of two loops overlap.

    Why: each table takes 32 words regardless of the number of segments programmed; words that two profiles share make
    one of them run the other's steps.

    Fix: place the tables at least 40 octal words apart.
    """
    for (view, first, last), (other, start, end) in permutations(tables(context), 2):
        if first <= end and last >= start:
            words, theirs = between((first, last)), between((start, end))
            yield view.at("ramp_soak", "table", words=words, other=other.name, theirs=theirs).shared_with(other.name)


@per_loop
@warning("DL278", TABLE, "the generator is on, but {what}")
def ramp_soak_without_steps(view: LoopView) -> Findings:
    """The ramp/soak generator is on and has no profile.

    Why: with an empty list the table is all zeros, and slope 0 ends the profile at once. Without a list (an info) the
    table is not part of the file, and something else has to write it.

    Fix: list the `steps`, or remove `ramp_soak`.
    """
    profile = view.loop.ramp_soak
    if profile is not None and profile.enabled and not profile.steps:
        empty = profile.steps is not None
        what = "its profile is empty" if empty else f"the file does not write the table at {v_name(profile.table)}"
        place, severity = ("steps", None) if empty else ("table", Severity.INFO)
        yield view.at("ramp_soak", place, severity=severity, what=what)


@per_loop
@info("DL279", ENABLE, "a profile is written, but bit 11 of {word} is off: the controls in {flags} will not operate")
def ramp_soak_switched_off(view: LoopView) -> Findings:
    """A ramp/soak profile is given, and the generator's enable bit is off.

    Why: the start, hold, resume and jog bits do nothing unless the enable bit is 1 during the entire process. It is the
    first thing that the troubleshooting section asks for.

    Fix: remove `enabled: false`, unless the ladder program sets the bit.
    """
    profile = view.loop.ramp_soak
    if profile is not None and profile.steps and not profile.enabled:
        yield view.at("ramp_soak", "enabled", word=view.v("mode_setting_1"), flags=view.v("ramp_soak_flags"))


@warning("DL280", TROUBLE, "the ramp/soak generator is on, but mode is cascade: the set point comes from {source}")
def ramp_soak_in_cascade(context: Dl06Context) -> Findings:
    """The ramp/soak generator is on in a loop that is meant for Cascade mode.

    Why: the generator writes the loop's own set point (+02), and in Cascade the loop reads the remote one. The profile
    does not operate, as the troubleshooting section says.

    Fix: put the profile on the outermost loop of the cascade.
    """
    for view in context.loops:
        profile = view.loop.ramp_soak
        if profile is not None and profile.enabled and view.loop.mode == "cascade":
            major = context.majors[view.index]
            source = view.v("remote_setpoint") if major is None else context.loops[major].loop.name
            yield view.at_key("ramp_soak", source=source)


@per_loop
@warning("DL281", CONTROLS, "request is {request}: the bit is already 1 in {word} when the program is downloaded")
def ramp_soak_control_preset(view: LoopView) -> Findings:
    """A control bit of the ramp/soak generator is set in the download.

    Why: the normal state of the control bits is all zeros, and each acts on a change from 0 to 1 while the CPU is in
    Run. A bit that is already on can start a profile that nobody asked for, or keep it from starting.

    Fix: remove `request`; let the ladder program or the operator set the bit.
    """
    profile = view.loop.ramp_soak
    if profile is not None and profile.request != "none":
        yield view.at("ramp_soak", "request", request=profile.request, word=view.v("ramp_soak_flags"))
