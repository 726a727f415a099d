"""Loops whose process is part of the file: the direction of control, and the sample time."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.refs import NEXTOPID, Decision
from pidcfg.validate.rule import Findings, error, warning
from pidcfg.validate.rules.nextopid.known import value_text
from pidcfg.validate.rules.nextopid.paths import Ring
from pidcfg.validate.views import number_text

if TYPE_CHECKING:
    from pidcfg.validate.rules.nextopid.context import NextopidContext

GAIN = NEXTOPID.at("chapter 10: Gs, and chapter 2: Direct")
SAMPLE_TIME = NEXTOPID.at("chapter 17: Maximum Sample Time of Controller")

D212 = Decision(
    212,
    "the direction of control is judged where the process is in the file",
    "A ring from a loop's MV through ControlLag or ControlDelayLag back to its PV has a sign: of all gains, of the "
    "expressions and of split ranges on the way. PV rising with MV needs Direct FALSE, PV falling needs Direct TRUE.",
    "The manual's notes on Gs. Without a process in the file nobody can know.",
)


@error(
    "NX622",
    GAIN,
    "Direct is {direct}, but PV {moves} when MV rises, through {process} with Gs {gain}: it must be {wanted}",
)
def wrong_direction_of_control(context: NextopidContext) -> Findings:
    """The direction of control does not fit the process that is wired to the loop.

    Why: the loop drives its PV away from the set point, and MV to one of its limits: a heater runs to full power and
    stays there. Direct TRUE means that MV rises with PV (cooling), FALSE that it falls when PV rises (heating).

    Fix: change Direct; or correct the sign of Gs, if the process is the one that is written wrong.
    """
    rings = {view.number: Ring(context, view) for view in context.pids}
    wrong = {number: ring for number, ring in rings.items() if _is_wrong(ring)}
    for number, ring in wrong.items():
        if any(other in wrong and number not in wrong[other].passed for other in ring.passed):
            continue  # the loop inside is wrong; what that makes of this one is its echo
        view, direct = ring.loop, ring.loop.is_on("Direct")
        process = next((block for block in ring.processes if (block.number_of("Gs") or 0) < 0), ring.processes[0])
        yield view.at(
            "Direct",
            direct=view.shown("Direct"),
            moves="falls" if direct is False else "rises",
            process=process.name,
            gain=process.shown("Gs"),
            wanted=value_text(not direct),
        )


def _is_wrong(ring: Ring) -> bool:
    """Whether the loop drives its PV away: it falls with MV and Direct is FALSE, or rises and Direct is TRUE."""
    sign, direct = ring.sign(), ring.loop.is_on("Direct")
    return bool(ring.processes) and sign in {1, -1} and direct is not None and direct == (sign == 1)


@warning(
    "NX623",
    SAMPLE_TIME,
    "a sample time of {sample} s is not below a tenth of the time constant {constant} s of {process}",
)
def sample_time_long_for_the_process(context: NextopidContext) -> Findings:
    """The loop is calculated too seldom for the process that is wired to it.

    Why: the manual asks for less than a tenth of the time constant. With a longer sample time the loop sees its own
    effect late, as if the process had more dead time, and swings.

    Fix: shorten `sample_time`.
    """
    for view in context.pids:
        ring = Ring(context, view)
        ring.sign()
        slowest = max(ring.processes, key=lambda block: block.number_of("Tc") or 0, default=None)
        constant = None if slowest is None else slowest.number_of("Tc")
        if slowest is not None and constant is not None and 0 < constant <= 10 * view.sample_time:
            yield view.at(
                "sample_time",
                sample=number_text(view.sample_time),
                constant=number_text(constant),
                process=slowest.name,
            )
