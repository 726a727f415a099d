"""What lies where in a DL06: loop table, ramp/soak tables, auto transfer, and loops that run in Program mode."""

from __future__ import annotations

from decimal import Decimal
from itertools import permutations, product
from typing import TYPE_CHECKING

from pidcfg.encoders.dl06.image import (
    LOOP_SIZE,
    OUTSIDE_LOWER,
    OUTSIDE_UPPER,
    STRADDLES,
    TABLE_IN_SYSTEM,
    TABLE_OUTSIDE_LOWER,
    TABLE_OUTSIDE_UPPER,
    TOO_MANY,
    check_ramp_soak,
    loop_start,
)
from pidcfg.encoders.maps.dl06 import CPU, D03, LOOP_TABLE, RAMP_SOAK_SIZE
from pidcfg.schemas.base import v_name
from pidcfg.schemas.numbers import decimal_text
from pidcfg.text.diagnostics import Severity
from pidcfg.text.references import DL06, Decision
from pidcfg.validate.rule import Finding, Findings, checklist, error, info, make_finding, per_loop, warning
from pidcfg.validate.shared_checks import find_shared_keys, list_names, report_at_both

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.schemas.dl06 import Transfer
    from pidcfg.validate.rules.dl06.alarms import Dl06Context, LoopView

# --- Set-up of the CPU: where the loop table lies (V7640), how many loops run (V7641), and how fast -------------------

POINTER = DL06.cite("Loop Table and Number of Loops")
FLAGS = DL06.cite("PID Error Flags, V7642")
FEATURES = DL06.cite("PID Loop Feature Specifications")

D10 = Decision(
    10,
    "a table beyond V17777 is an error",
    "A loop table that begins in the upper range and ends past V17777 is refused, although no bit of V7642 shows it.",
    "Bit 3 only watches the boundary at V7577; memory ends at V17777, so the last loops would have no words.",
)
D11 = Decision(
    11,
    "loop tables do not belong into V7400 to V7577",
    "A table that reaches into these words is allowed with a warning.",
    "They are kept in non-volatile memory with a limited number of writes, and each calculation writes bias and "
    "output.",
)

TABLE_PATH = ("plc", "loop_table")
COUNT_PATH = ("plc", "number_of_loops")


def address_range_text(ends: tuple[int, int]) -> str:
    """A range of addresses as the manual prints it."""
    return f"{v_name(ends[0])}-{v_name(ends[1])}"


def loops_text(number: int) -> str:
    """``1 loop``, ``5 loops``."""
    return f"{number} loop{'' if number == 1 else 's'}"


@error(
    "DL201",
    POINTER,
    "the loop table starts at {start}, outside {allowed} (and below {upper}, where the upper range begins)",
)
def loop_table_outside_lower_memory(context: Dl06Context) -> Findings:
    """The loop table starts below V10000, but not in V1200-V7340.

    Why: the CPU checks V7640 when it goes from Program to Run. With an address outside its ranges it sets bit 0 of
    V7642 and calculates no loop at all; nothing else tells the operator. V7400-V7577 holds a table, but no table may
    start there.

    Fix: start the table between V1200 and V7340 (V2000 is the manual's example), or between V10000 and V17740.
    """
    if context.setup.flags & OUTSIDE_LOWER:
        start, upper = v_name(context.setup.start), v_name(CPU.upper[0])
        yield make_finding(
            *TABLE_PATH, plc_effect="V7642 bit 0", start=start, allowed=address_range_text(CPU.lower), upper=upper
        )


@error("DL202", POINTER, "the loop table starts at {start}, outside {allowed}")
def loop_table_outside_upper_memory(context: Dl06Context) -> Findings:
    """The loop table starts above V10000, but past V17740.

    Why: the CPU sets bit 1 of V7642 when it goes from Program to Run and calculates no loop. V17740 is the last start
    at which one loop's 32 words (to V17777) still exist.

    Fix: start the table between V10000 and V17740, low enough for all its loops (40 octal words each).
    """
    if context.setup.flags & OUTSIDE_UPPER:
        start = v_name(context.setup.start)
        yield make_finding(*TABLE_PATH, plc_effect="V7642 bit 1", start=start, allowed=address_range_text(CPU.upper))


@error("DL203", FLAGS, "V7641 would hold {count} loops; the {cpu} calculates at most {limit}")
def more_loops_than_the_cpu_has(context: Dl06Context) -> Findings:
    """The number of loops is greater than 8.

    Why: the CPU sets bit 2 of V7642 when it goes from Program to Run and calculates none of them, not even the first 8.

    Fix: remove loops, or move some to a second PLC. `number_of_loops` is best left out: it follows from the list.
    """
    if context.setup.flags & TOO_MANY:
        written = context.config.plc.number_of_loops is not None
        place = COUNT_PATH if written else ("loops",)
        yield make_finding(
            *place, key=not written, plc_effect="V7642 bit 2", count=context.count, cpu=CPU.title, limit=CPU.loops
        )


@error("DL204", FLAGS, "the loop table of {loops} occupies {words}, past the boundary at {limit}")
def loop_table_crosses_the_boundary(context: Dl06Context) -> Findings:
    """The loop table begins in the lower range and extends past V7577.

    Why: behind V7577 lie the system parameters, V7640 among them. The CPU sets bit 3 of V7642 when it goes from Program
    to Run and calculates no loop.

    Fix: use an address closer to V1200, as the manual says: n loops need 40 octal words each, so 8 loops start at V7200
    at the latest, 5 loops at V7340.
    """
    limit = v_name(CPU.lower_end)
    if context.setup.flags & STRADDLES:
        count, begin = context.count, v_name(context.table[0])
        words = address_range_text(context.counted_table) if count <= CPU.loops else f"words from {begin}"
        yield make_finding(*TABLE_PATH, plc_effect="V7642 bit 3", loops=loops_text(count), words=words, limit=limit)
    elif CPU.lower[0] <= context.table[0] <= CPU.lower[1] and context.table[1] > CPU.lower_end:
        effect = "not shown in V7642, which counts the loops of V7641"
        loops = f"the {len(context.loops)} listed loops"
        yield make_finding(
            *TABLE_PATH, plc_effect=effect, loops=loops, words=address_range_text(context.table), limit=limit
        )


@error("DL205", D10, "the loop table of {loops} occupies {words}, but memory ends at {limit}")
def loop_table_beyond_memory(context: Dl06Context) -> Findings:
    """The loop table begins in the upper range and extends past V17777, the last word there is.

    Why: V7642 has no bit for this: the quick check "V7642 is 0000, so all is well" passes while the last loops have no
    words to be read from.

    Fix: start the table lower: 8 loops fit from V17400, 2 loops from V17700, a single one from V17740.
    """
    start, last = max(context.counted_table, context.table)
    if CPU.upper[0] <= start <= CPU.upper[1] and last > CPU.upper_end:
        loops, words = loops_text(context.setup.count), address_range_text((start, last))
        yield make_finding(
            *TABLE_PATH, plc_effect="not shown in V7642", loops=loops, words=words, limit=v_name(CPU.upper_end)
        )


@warning("DL206", D11, "the loop table of {loops} occupies {words} and reaches into the non-volatile words {limit}")
def loop_table_in_non_volatile_memory(context: Dl06Context) -> Findings:
    """Words of the loop table lie in V7400-V7577, which are kept in non-volatile memory.

    Why: such memory takes a limited number of writes, and each calculation writes bias and output: at 0.1 s a loop
    makes 36,000 writes an hour. The CPU does not object, so the wear shows only when it is too late.

    Fix: start the table lower, so that it ends at V7377 or before (8 loops: V7000).
    """
    start, last = context.counted_table
    low, high = CPU.non_volatile
    if not context.setup.flags and start <= high and last >= low:
        yield make_finding(
            *TABLE_PATH,
            loops=loops_text(context.setup.count),
            words=address_range_text((start, last)),
            limit=address_range_text(CPU.non_volatile),
        )


@warning("DL207", POINTER, "V7641 would hold {count}, but {listed} are listed: {names} would never be calculated")
def listed_loop_never_calculated(context: Dl06Context) -> Findings:
    """`number_of_loops` is smaller than the list of loops.

    Why: the CPU uses loops in ascending order and stops at the number in V7641. The loops behind it have words in the
    table, but no calculation, no alarms and no mode.

    Fix: remove `number_of_loops`; it follows from the list. To keep a loop for later, put it at the end of a file of
    its own.
    """
    listed = len(context.config.loops)
    if 0 < context.count < listed:
        names = ", ".join(loop.name for loop in context.config.loops[context.count :])
        yield make_finding(*COUNT_PATH, count=context.count, listed=loops_text(listed), names=names)


@error(
    "DL208",
    POINTER,
    "V7641 would hold {count}, but only {listed} listed: the CPU takes {words} for loop tables as well",
)
def counted_loop_not_listed(context: Dl06Context) -> Findings:
    """`number_of_loops` is greater than the list of loops.

    Why: the CPU attempts to control the full number of loops in V7641. It would read whatever stands behind the table
    as gains and pointers, and write bias and output words there.

    Fix: remove `number_of_loops`; it follows from the list.
    """
    listed = len(context.config.loops)
    if listed < context.count <= CPU.loops:
        words = address_range_text((loop_start(context.config.plc, listed), context.counted_table[1]))
        verb = "is" if listed == 1 else "are"
        yield make_finding(*COUNT_PATH, count=context.count, listed=f"{loops_text(listed)} {verb}", words=words)


@warning("DL209", POINTER, "V7641 would hold 0: the loop task is off, and nothing is calculated ({listed} listed)")
def loop_task_off(context: Dl06Context) -> Findings:
    """`number_of_loops` is 0 while loops are listed.

    Why: 0 turns the loop controller off during the ladder scan. There is no error flag, and outputs keep their values.

    Fix: remove `number_of_loops`; it follows from the list.
    """
    listed = len(context.config.loops)
    if context.count == 0 and listed:
        yield make_finding(*COUNT_PATH, listed=loops_text(listed))


@error(
    "DL210",
    FEATURES,
    "sample_rate is {value} s; with {loops} the CPU calculates no loop more often than every {limit} s",
)
def sample_rate_too_fast_for_loop_count(context: Dl06Context) -> Findings:
    """A sample rate under 0.1 s with five or more loops.

    Why: the CPU reaches 0.05 s with 1 to 4 loops only. If it samples less often than the gains assume, integral and
    derivative act with the wrong time step.

    Fix: sample every 0.1 s or slower, or bring the number of loops down to 4.
    """
    limit = Decimal(CPU.slow_rate)
    if context.count <= CPU.fast_loops:
        return
    for view in context.loops:
        if Decimal(CPU.fast_rate) <= view.loop.sample_rate < limit:
            yield view.report(
                "sample_rate", value=decimal_text(view.loop.sample_rate), loops=loops_text(context.count), limit=limit
            )


# --- The ramp/soak generator: its table's place in memory, and whether it can run -------------------------------------

ERRORS = DL06.cite("Ramp/Soak Programming Errors")
RAMP_SOAK_TABLE = DL06.cite("Ramp/Soak Table")
ENABLE = DL06.cite("Ramp/Soak Generator Enable")
CONTROLS = DL06.cite("Ramp/Soak Controls")
TROUBLE_TIPS = DL06.cite("Troubleshooting Tips")

D348 = Decision(
    348,
    "user memory for ramp/soak tables",
    "V400-V677, V1200-V7577 and V10000-V17777. A table below V1200 or beyond V7377 is a warning.",
    "The data areas of the PV transfer contain V400-V677 and end at V7377; the lower range of V7640 begins at V1200, "
    "and bit 3 of V7642 speaks of the boundary at V7577.",
)
CERTAIN_AREAS = tuple(area for area in CPU.transfer_sources if area[0] >= CPU.lower[0])
BELOW_V1200_TEXT = (
    "a data area of the PV transfer (V400-V677), but below the lower memory of V7640, which begins at V1200: bit 0 of "
    "+35 may come on"
)
BEYOND_V7377_TEXT = (
    "up to V7577 by the flags of V7642, but the data area of the PV transfer ends at V7377: bit 0 of +35 may come on"
)

ERROR_BITS = {TABLE_OUTSIDE_LOWER: 0, TABLE_OUTSIDE_UPPER: 1, TABLE_IN_SYSTEM: 4}


def ramp_soak_tables(context: Dl06Context) -> Iterator[tuple[LoopView, int, int]]:
    """Each loop with a ramp/soak table that is used or written: the table's first and last word."""
    for view in context.loops:
        profile = view.loop.ramp_soak
        if profile is not None and (profile.enabled or profile.steps is not None):
            yield view, profile.table, profile.table + RAMP_SOAK_SIZE - 1


def error_bit(view: LoopView, flags: int) -> str:
    """How findings name a bit of +35."""
    return (
        f"bit {ERROR_BITS[flags]} of {view.address_of('ramp_soak_errors')} when the profile is started: it does not run"
    )


@error("DL274", ERRORS, "the ramp/soak table occupies {words}, outside user memory ({user})")
def ramp_soak_table_outside_user_memory(context: Dl06Context) -> Findings:
    """The 32 words of a ramp/soak table do not all lie in user memory.

    Why: when the generator is started, the CPU sets bit 0 or bit 1 of +35 and the profile does not run; until then
    nothing shows. The table needs its 32 words whatever the number of steps.

    Fix: place it in V1200-V7377 or V10000-V17777, all 32 words (40 octal).
    """
    for view, first, last in ramp_soak_tables(context):
        flags = check_ramp_soak(first)
        if flags and flags != TABLE_IN_SYSTEM:
            yield view.report(
                "ramp_soak",
                "table",
                plc_effect=error_bit(view, flags),
                words=address_range_text((first, last)),
                user=", ".join(address_range_text(ends) for ends in CPU.user),
            )


@error("DL275", ERRORS, "the ramp/soak table starts at {start}, among the system parameters {system}")
def ramp_soak_table_in_system_memory(context: Dl06Context) -> Findings:
    """A ramp/soak table starts among the system parameters V7600-V7777.

    Why: V7640 to V7642, the set-up of all loops, lie there. Downloading the table would overwrite them; the CPU sets
    bit 4 of +35 when the profile is started.

    Fix: place the table in user memory, V1200-V7377 or V10000-V17777.
    """
    for view, first, _ in ramp_soak_tables(context):
        if check_ramp_soak(first) == TABLE_IN_SYSTEM:
            yield view.report(
                "ramp_soak",
                "table",
                plc_effect=error_bit(view, TABLE_IN_SYSTEM),
                start=v_name(first),
                system=address_range_text(CPU.system),
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
    for view, first, last in ramp_soak_tables(context):
        if not check_ramp_soak(first) and not any(low <= first and last <= high for low, high in CERTAIN_AREAS):
            below = last < CPU.lower[0]
            yield view.report(
                "ramp_soak",
                "table",
                words=address_range_text((first, last)),
                doubt=BELOW_V1200_TEXT if below else BEYOND_V7377_TEXT,
            )


@error("DL276", RAMP_SOAK_TABLE, "the ramp/soak table {words} overlaps the loop table {table}")
def ramp_soak_table_in_loop_table(context: Dl06Context) -> Findings:
    """A ramp/soak table overlaps the loop table.

    Why: one of the two overwrites the other: set points and slopes would be read as gains and pointers of a loop.

    Fix: move the ramp/soak table behind the loop table or anywhere else in user memory (32 words).
    """
    start, end = context.table
    for view, first, last in ramp_soak_tables(context):
        if first <= end and last >= start:
            yield view.report(
                "ramp_soak", "table", words=address_range_text((first, last)), table=address_range_text((start, end))
            )


@error("DL277", RAMP_SOAK_TABLE, "the ramp/soak table {words} overlaps that of {other}, {theirs}")
def ramp_soak_tables_overlap(context: Dl06Context) -> Findings:
    """The ramp/soak tables of two loops overlap.

    Why: each table takes 32 words regardless of the number of segments programmed; words that two profiles share make
    one of them run the other's steps.

    Fix: place the tables at least 40 octal words apart.
    """
    for (view, first, last), (other, start, end) in permutations(ramp_soak_tables(context), 2):
        if first <= end and last >= start:
            words, theirs = address_range_text((first, last)), address_range_text((start, end))
            yield view.report("ramp_soak", "table", words=words, other=other.name, theirs=theirs).with_other_loops(
                other.name
            )


@per_loop
@warning("DL278", RAMP_SOAK_TABLE, "the generator is on, but {what}")
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
        yield view.report("ramp_soak", place, severity=severity, what=what)


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
        yield view.report(
            "ramp_soak", "enabled", word=view.address_of("mode_setting_1"), flags=view.address_of("ramp_soak_flags")
        )


@warning("DL280", TROUBLE_TIPS, "the ramp/soak generator is on, but mode is cascade: the set point comes from {source}")
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
            source = view.address_of("remote_setpoint") if major is None else context.loops[major].loop.name
            yield view.report_key("ramp_soak", source=source)


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
        yield view.report("ramp_soak", "request", request=profile.request, word=view.address_of("ramp_soak_flags"))


# --- Auto transfer of PV and output, and loops that run while the CPU is in Program mode ------------------------------

MODES = DL06.cite("CPU Modes and Loop Modes")
TRANSFER = DL06.cite("Auto Transfer to Analog I/O")
FROM_MEMORY = DL06.cite("PV Auto Transfer (Addr + 36) from V-memory Option")
SOURCES = DL06.cite("Data Sources")
MODULE_SELECTION = DL06.cite("Step 4: Select I/O Modules")

D660 = Decision(
    660,
    "loops that read one channel",
    "Two loops may fetch their PV from one channel or word: a heating and a cooling loop do. Two of the same action "
    "are an info.",
    "The manual forbids two sources of one variable, not two readers of one source.",
)


def channel_of(transfer: Transfer | None) -> tuple[int, int] | None:
    """Slot and channel of a transfer that goes to a module."""
    if transfer is None or transfer.slot is None or transfer.channel is None:
        return None
    return transfer.slot, transfer.channel


def source_of(transfer: Transfer | None) -> str | None:
    """Where a transfer fetches the PV, in words."""
    if transfer is not None and transfer.address is not None:
        return v_name(transfer.address)
    place = channel_of(transfer)
    return None if place is None else f"slot {place[0]}, channel {place[1]}"


@warning(
    "DL289", MODES, "the loop is independent of the CPU mode, but {missing}: in Program mode nothing moves {words}"
)
def independent_loop_without_transfer(context: Dl06Context) -> Findings:
    """A loop is to run while the CPU is in Program mode, without direct access to the channels of PV and output.

    Why: in Program mode the ladder program stands still, and with it the copying of analog values. The loop would go on
    calculating from a frozen PV, or into a word that no module reads. A PV fetched from V-memory is frozen as well: the
    ladder program, or the pointer method that it runs, writes that word. The output of a major loop needs no transfer.

    Fix: add `pv.transfer` and `output.transfer` (slot and channel), or remove `independent_of_cpu_mode`.
    """
    majors = set(context.majors)
    for view in context.loops:
        loop = view.loop
        if not loop.independent_of_cpu_mode:
            continue
        missing = [] if loop.pv.transfer else ["pv"]
        if loop.output.transfer is None and view.index not in majors:
            missing.append("output")
        absent = " and ".join(f"{key}.transfer" for key in missing)
        reasons = [f"{absent} {'is' if len(missing) == 1 else 'are'} not given"] if missing else []
        if loop.pv.transfer and loop.pv.transfer.address is not None:
            reasons.append(f"pv.transfer reads {v_name(loop.pv.transfer.address)}, which the ladder program writes")
            missing.insert(0, "pv")
        if reasons:
            words = " and ".join(view.address_of(key) for key in missing)
            yield view.report("independent_of_cpu_mode", missing=" and ".join(reasons), words=words)


@per_loop
@error("DL290", FROM_MEMORY, "the PV's source {address} is outside {allowed}")
def transfer_source_outside_memory(view: LoopView) -> Findings:
    """The PV is transferred from a V-memory word that the manual does not allow.

    Why: the transfer reads V400-V677, V1200-V7377 and V10000-V17777 only; elsewhere lie timers, system words and words
    kept in non-volatile memory. An address that is read wrongly is a PV that stands still.

    Fix: copy the value to a word inside these ranges and transfer it from there.
    """
    transfer = view.loop.pv.transfer
    if transfer is None or transfer.address is None:
        return
    if not any(low <= transfer.address <= high for low, high in CPU.transfer_sources):
        yield view.report(
            "pv",
            "transfer",
            "address",
            address=v_name(transfer.address),
            allowed=", ".join(address_range_text(ends) for ends in CPU.transfer_sources),
        )


@per_loop
@error("DL291", TRANSFER, "output.transfer names {address}, but {word} holds slot and channel only")
def output_transferred_to_memory(view: LoopView) -> Findings:
    """The output is to be transferred to a V-memory word.

    Why: a V-memory address is an option of the PV's word (+36) alone. In the output's word (+37) its digits would be
    read as base, slot and channel.

    Fix: give slot and channel, or leave the transfer out and let the ladder program read the output word.
    """
    transfer = view.loop.output.transfer
    if transfer is not None and transfer.address is not None:
        yield view.report(
            "output", "transfer", "address", address=v_name(transfer.address), word=view.address_of("output_transfer")
        )


@error("DL292", SOURCES, "slot {slot}, channel {channel} is also the output of {others}")
def output_channel_written_twice(context: Dl06Context) -> Findings:
    """Two loops transfer their outputs to the same channel.

    Why: the loop that is calculated last wins; the actuator jumps between two outputs, and neither loop controls.

    Fix: correct the slot or channel of one of them.
    """
    rows = ((channel_of(view.loop.output.transfer), view) for view in context.loops)
    for (slot, channel), view, others in find_shared_keys((place, view) for place, view in rows if place is not None):
        finding = view.report_key("output", "transfer", slot=slot, channel=channel, others=list_names(others))
        yield finding.with_other_loops(*others)


@info("DL520", D660, "{place} is also the PV of {others}, and both are {action}-acting")
def channel_read_twice(context: Dl06Context) -> Findings:
    """Two loops read their PV from the same channel or word and act in the same direction.

    Why: two integral terms on one PV share the work in any proportion, and drift against each other. Often the transfer
    was copied with the rest of the loop, and one of them controls what it does not measure.

    Fix: give each loop its own channel. A direct-acting and a reverse-acting loop on one PV are not reported.
    """
    rows = ((source_of(view.loop.pv.transfer), view) for view in context.loops)
    keyed = (((place, view.loop.action), view) for place, view in rows if place is not None)
    for (place, action), view, others in find_shared_keys(keyed):
        finding = view.report_key("pv", "transfer", place=place, action=action, others=list_names(others))
        yield finding.with_other_loops(*others)


@info(
    "DL293",
    MODULE_SELECTION,
    "slot {slot}, channel {channel} is the PV of {reader} and the output of {writer}: right only for a combined "
    "input/output module",
)
def channel_read_and_written(context: Dl06Context) -> Findings:
    """An output goes to the slot and channel from which a PV is read.

    Why: a module either measures or drives, except for the combination modules, which count inputs and outputs from 1
    each. With any other module one of the two transfers reaches nothing.

    Fix: check the module in this slot.
    """
    for reader, writer in product(context.loops, repeat=2):
        channel = channel_of(reader.loop.pv.transfer)
        if channel is None or channel != channel_of(writer.loop.output.transfer):
            continue
        values = {"slot": channel[0], "channel": channel[1], "reader": reader.name, "writer": writer.name}
        at_writer, at_reader = writer.report_key("output", "transfer"), reader.report_key("pv", "transfer")
        if reader is writer:
            yield at_writer.with_values(**values)
        else:
            yield from report_at_both(writer, at_writer, reader, at_reader, **values)


@warning("DL294", SOURCES, "the PV's source {address} is {what}")
def pv_source_in_pid_table(context: Dl06Context) -> Findings:
    """The PV is transferred from a word of the loop table or of a ramp/soak table.

    Why: those words are settings or results of loops, not measurements. Usually the word that the analog module writes
    was meant; its own +03 as a source would leave the PV as it is for ever.

    Fix: give the word that holds the measured value, or slot and channel.
    """
    for view in context.loops:
        transfer = view.loop.pv.transfer
        if transfer is not None and transfer.address is not None and (what := _table_text(context, transfer.address)):
            yield view.report("pv", "transfer", "address", address=v_name(transfer.address), what=what)


def _table_text(context: Dl06Context, address: int) -> str:
    """Which word of which table an address is; empty when it is outside them."""
    first, last = context.table
    if first <= address <= last:
        index, offset = divmod(address - first, LOOP_SIZE)
        word = next(word for word in LOOP_TABLE.words if word.offset == offset)
        return f"word +{offset:02o} ({word.title}) of loop {index + 1}"
    owner = next((view for view, start, end in ramp_soak_tables(context) if start <= address <= end), None)
    return "" if owner is None else f"in the ramp/soak table of {owner.name}"


@per_loop
@checklist(
    "DL295",
    D03,
    "{word} holds {digits}: slot {slot} by the manual's table (1 to 4), but its text counts slots from 0{hexadecimal}",
)
def slot_counted_two_ways(view: LoopView) -> Findings:
    """The manual counts the slots of the option cards in two ways.

    Why: its table says 1 to 4; its text says that slot 1 is the second slot and slot 0 is adjacent to the CPU. The file
    is encoded by the table. Channels from 10 on are stored as hexadecimal digits, which the manual leaves open.
    All channels of a module that is used this way are closed to the pointer method.

    Fix: see that the PV follows the right terminal.
    """
    if _channels(view):
        yield _slot_finding(view)


def _channels(view: LoopView) -> list[tuple[str, tuple[int, int]]]:
    """What of a loop is transferred from or to a channel, with its slot and channel."""
    transfers = (("pv", view.loop.pv.transfer), ("output", view.loop.output.transfer))
    return [(key, channel) for key, transfer in transfers if (channel := channel_of(transfer)) is not None]


def _slot_finding(view: LoopView) -> Finding:
    """What the word of a loop's first channel holds."""
    key, (slot, channel) = _channels(view)[0]
    word = view.block.encoded.words[LOOP_TABLE.offset_of(f"{key}_transfer")]
    shown = "" if channel <= 9 else f", and channel {channel} is stored as {channel:02X} hex"
    return view.report_key(
        key, "transfer", word=view.address_of(f"{key}_transfer"), digits=f"{word:04X}", slot=slot, hexadecimal=shown
    )
