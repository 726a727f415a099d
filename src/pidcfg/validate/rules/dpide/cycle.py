"""The sampling time: its limits, and the interrupt task that replaces it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.encoders.maps.dpide import REMARKS, TABLE
from pidcfg.refs import Decision
from pidcfg.schemas.dpide import LONGEST_CYCLE, SHORTEST_CYCLE
from pidcfg.validate.rule import Findings, per_loop, warning

if TYPE_CHECKING:
    from pidcfg.validate.rules.dpide.context import LoopView

D262 = Decision(
    262,
    "a CYCLE below 10 ms is a warning in a cyclic task",
    "The warning says that a bare number is ms. An interrupt task may be as fast as it likes.",
    "The instruction is only calculated when it is scanned, and a scan takes some ms; `CYCLE: 1` is likelier a second "
    "than a millisecond.",
)
SHORT_CYCLE = 10


@per_loop
@warning("DP731", TABLE, "CYCLE is {cycle} ms; the PLC counts it as {used} ms")
def cycle_out_of_range(view: LoopView) -> Findings:
    """The sampling time is outside 1 to 40000 ms.

    Why: the PLC takes the nearest end of the range. Integral and derivative are right for that time, not for the one in
    the file.

    Fix: write a time from 1 ms to 40000 ms. A bare number is ms.
    """
    cycle = view.loop.CYCLE
    used = min(max(cycle, SHORTEST_CYCLE), LONGEST_CYCLE)
    if used != cycle and view.held("CYCLE") and view.interrupt_task is None:
        yield view.at("CYCLE", cycle=cycle, used=used)


@per_loop
@warning(
    "DP732",
    REMARKS,
    "CYCLE is {cycle} ms, but the interrupt task calls the instruction every {interval} ms, which counts",
)
def cycle_overridden(view: LoopView) -> Findings:
    """The interval of the interrupt task is another one than CYCLE.

    Why: in a timed interrupt task the PLC takes its interval as the sampling time and does not look at CYCLE.

    Fix: write the interval as CYCLE too, so that both tell the same; or leave out `plc.interrupt_task` where the
    instruction stands in a cyclic task.
    """
    if view.interrupt_task is not None and view.interrupt_task != view.loop.CYCLE:
        yield view.at("CYCLE", cycle=view.loop.CYCLE, interval=view.interrupt_task)


@per_loop
@warning("DP733", D262, "CYCLE is {cycle} ms, about as short as a scan: was {cycle} s meant?")
def cycle_shorter_than_scan(view: LoopView) -> Findings:
    """The sampling time is shorter than the PLC can keep.

    Why: the instruction is calculated when it is scanned, so not more often than once a scan. Integral and derivative
    are worked out for the shorter time.

    Fix: write a time well above that of a scan, such as `1 s`; or call the instruction in a timed interrupt task and
    say so in `plc.interrupt_task`.
    """
    if SHORTEST_CYCLE <= view.loop.CYCLE < SHORT_CYCLE and view.interrupt_task is None:
        yield view.at("CYCLE", cycle=view.loop.CYCLE)
