"""What decides whether a loop runs at all, and which way: its action, and the PID errors that its values cause."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.refs import CLICK
from pidcfg.schemas.click import D100, EFFECT
from pidcfg.validate.rule import Findings, error, info, per_loop, warning

if TYPE_CHECKING:
    from pidcfg.validate.rules.click.context import LoopView

ERRORS = CLICK.at("CLICK PID Errors")
MANUAL = CLICK.at("Manual Mode")
FORWARD = {"direct": "Forward", "reverse": "Reverse"}
RISES = {"direct": "rises", "reverse": "falls"}


def effect(number: int) -> str:
    """What the PLC reports."""
    return f"{EFFECT}{number}"


@per_loop
@warning(
    "CK308",
    D100,
    "action {action} is written as {bit} to {register}, which the help does not confirm: verify "
    "Forward/Reverse in the PID window before Auto; it must show {shown} (the PV {moves} when the output rises)",
)
def action_not_verified(view: LoopView) -> Findings:
    """The action of a loop rests on a reading of the bit that has not been compared with the PLC.

    Why: the help does not print which state of Cn+09 is forward and which is reverse. The wrong one turns every
    correction round: the loop drives its output to a limit and stays there, which is a runaway heater.

    Fix: before the first Auto, compare Forward/Reverse in the PID window with `action`, then write
    `action_verified: true`; the warning goes away with it.
    """
    action = view.loop.action
    if not view.loop.action_verified:
        yield view.at(
            "action",
            register=view.register("action"),
            bit=int(action == "reverse"),
            action=action,
            shown=FORWARD[action],
            moves=RISES[action],
        )


@per_loop
@error(
    "CK309",
    ERRORS,
    "{register} shows {shown} alone; once that is cured it shows {others}, and until then the loop stays in Manual",
)
def several_pid_errors(view: LoopView) -> Findings:
    """A loop has more than one PID error, of which the PLC shows one.

    Why: the error register holds the lowest number that is active; the next one appears only when it is cleared. Who
    cures what is shown and believes to be done meets the next error.

    Fix: correct all values that are reported for this loop before the download.
    """
    if len(view.errors) > 1:
        first, *more = view.errors
        others = ", then ".join(str(error.number) for error in more)
        yield view.at_key(
            plc_effect=effect(first.number),
            register=view.register("error_code"),
            shown=f"error {first.number} ({first.title})",
            others=others,
        )


@per_loop
@info("CK310", MANUAL, "mode is auto, but error {number} ({title}) in {register} keeps the loop in Manual")
def auto_with_pid_error(view: LoopView) -> Findings:
    """A loop that is meant for Auto has a value that causes a PID error.

    Why: a PID error puts the loop into Manual, and the request for Auto is granted only when there is none.

    Fix: correct the value that is reported for this loop.
    """
    if view.loop.mode == "auto" and len(view.errors) == 1:
        error = view.errors[0]
        yield view.at(
            "mode",
            plc_effect=effect(error.number),
            number=error.number,
            title=error.title,
            register=view.register("error_code"),
        )


@per_loop
@info("CK320", MANUAL, "mode is auto, but every start of the PLC leaves the loop in Manual until {register} is set")
def auto_is_not_downloaded(view: LoopView) -> Findings:
    """A loop is meant for Auto, which no download can bring about.

    Why: the change from STOP to RUN puts all loops into Manual, and the request for Auto is a momentary bit, so it is
    written as 0. After a power failure the loops stay in Manual until somebody notices.

    Fix: let the ladder program set the request once the plant is ready, or tell the operators.
    """
    if view.loop.mode == "auto" and not view.errors:
        yield view.at("mode", register=view.register("auto_request"))
