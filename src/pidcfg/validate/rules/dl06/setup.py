"""Set-up of the CPU: where the loop table lies (V7640), how many loops run (V7641), and how fast."""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING

from pidcfg.encoders.dl06.encode import loop_start
from pidcfg.encoders.dl06.setup import OUTSIDE_LOWER, OUTSIDE_UPPER, STRADDLES, TOO_MANY
from pidcfg.encoders.maps.dl06 import CPU
from pidcfg.refs import DL06, Decision
from pidcfg.schemas.numbers import decimal_text
from pidcfg.schemas.octal import v_name
from pidcfg.validate.rule import Findings, error, finding, warning

if TYPE_CHECKING:
    from pidcfg.validate.rules.dl06.context import Dl06Context

POINTER = DL06.at("Loop Table and Number of Loops")
FLAGS = DL06.at("PID Error Flags, V7642")
FEATURES = DL06.at("PID Loop Feature Specifications")

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

TABLE = ("plc", "loop_table")
COUNT = ("plc", "number_of_loops")


def between(ends: tuple[int, int]) -> str:
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
        yield finding(*TABLE, plc_effect="V7642 bit 0", start=start, allowed=between(CPU.lower), upper=upper)


@error("DL202", POINTER, "the loop table starts at {start}, outside {allowed}")
def loop_table_outside_upper_memory(context: Dl06Context) -> Findings:
    """The loop table starts above V10000, but past V17740.

    Why: the CPU sets bit 1 of V7642 when it goes from Program to Run and calculates no loop. V17740 is the last start
    at which one loop's 32 words (to V17777) still exist.

    Fix: start the table between V10000 and V17740, low enough for all its loops (40 octal words each).
    """
    if context.setup.flags & OUTSIDE_UPPER:
        start = v_name(context.setup.start)
        yield finding(*TABLE, plc_effect="V7642 bit 1", start=start, allowed=between(CPU.upper))


@error("DL203", FLAGS, "V7641 would hold {count} loops; the {cpu} calculates at most {limit}")
def more_loops_than_the_cpu_has(context: Dl06Context) -> Findings:
    """The number of loops is greater than 8.

    Why: the CPU sets bit 2 of V7642 when it goes from Program to Run and calculates none of them, not even the first 8.

    Fix: remove loops, or move some to a second PLC. `number_of_loops` is best left out: it follows from the list.
    """
    if context.setup.flags & TOO_MANY:
        written = context.config.plc.number_of_loops is not None
        place = COUNT if written else ("loops",)
        yield finding(
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
        count, begin = context.setup.count, v_name(context.table[0])
        words = between(context.counted) if count <= CPU.loops else f"words from {begin}"
        yield finding(*TABLE, plc_effect="V7642 bit 3", loops=loops_text(count), words=words, limit=limit)
    elif CPU.lower[0] <= context.table[0] <= CPU.lower[1] and context.table[1] > CPU.lower_end:
        effect = "not shown in V7642, which counts the loops of V7641"
        loops = f"the {len(context.loops)} listed loops"
        yield finding(*TABLE, plc_effect=effect, loops=loops, words=between(context.table), limit=limit)


@error("DL205", D10, "the loop table of {loops} occupies {words}, but memory ends at {limit}")
def loop_table_beyond_memory(context: Dl06Context) -> Findings:
    """The loop table begins in the upper range and extends past V17777, the last word there is.

    Why: V7642 has no bit for this: the quick check "V7642 is 0000, so all is well" passes while the last loops have no
    words to be read from.

    Fix: start the table lower: 8 loops fit from V17400, 2 loops from V17700, a single one from V17740.
    """
    start, last = max(context.counted, context.table)
    if CPU.upper[0] <= start <= CPU.upper[1] and last > CPU.upper_end:
        loops, words = loops_text(context.setup.count), between((start, last))
        yield finding(*TABLE, plc_effect="not shown in V7642", loops=loops, words=words, limit=v_name(CPU.upper_end))


@warning("DL206", D11, "the loop table of {loops} occupies {words} and reaches into the non-volatile words {limit}")
def loop_table_in_non_volatile_memory(context: Dl06Context) -> Findings:
    """Words of the loop table lie in V7400-V7577, which are kept in non-volatile memory.

    Why: such memory takes a limited number of writes, and each calculation writes bias and output: at 0.1 s a loop
    makes 36,000 writes an hour. The CPU does not object, so the wear shows only when it is too late.

    Fix: start the table lower, so that it ends at V7377 or before (8 loops: V7000).
    """
    start, last = context.counted
    low, high = CPU.non_volatile
    if not context.setup.flags and start <= high and last >= low:
        yield finding(
            *TABLE, loops=loops_text(context.setup.count), words=between((start, last)), limit=between(CPU.non_volatile)
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
        yield finding(*COUNT, count=context.count, listed=loops_text(listed), names=names)


@error(
    "DL208",
    POINTER,
    "V7641 would hold {count}, but only {listed} are listed: the CPU takes {words} for loop tables as well",
)
def counted_loop_not_listed(context: Dl06Context) -> Findings:
    """`number_of_loops` is greater than the list of loops.

    Why: the CPU attempts to control the full number of loops in V7641. It would read whatever stands behind the table
    as gains and pointers, and write bias and output words there.

    Fix: remove `number_of_loops`; it follows from the list.
    """
    listed = len(context.config.loops)
    if listed < context.count <= CPU.loops:
        words = between((loop_start(context.config.plc, listed), context.counted[1]))
        yield finding(*COUNT, count=context.count, listed=loops_text(listed), words=words)


@warning("DL209", POINTER, "V7641 would hold 0: the loop task is off, and nothing is calculated ({listed} listed)")
def loop_task_off(context: Dl06Context) -> Findings:
    """`number_of_loops` is 0 while loops are listed.

    Why: 0 turns the loop controller off during the ladder scan. There is no error flag, and outputs keep their values.

    Fix: remove `number_of_loops`; it follows from the list.
    """
    listed = len(context.config.loops)
    if context.count == 0 and listed:
        yield finding(*COUNT, listed=loops_text(listed))


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
            yield view.at(
                "sample_rate", value=decimal_text(view.loop.sample_rate), loops=loops_text(context.count), limit=limit
            )
