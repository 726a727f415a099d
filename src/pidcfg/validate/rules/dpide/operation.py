"""Running, manual and autotune: what PID_RUN, PID_MODE and PID_MAN do together."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.encoders.maps.dpide import TABLE, WRITTEN_BY_AUTOTUNE
from pidcfg.refs import DPIDE, Decision
from pidcfg.schemas.numbers import decimal_text
from pidcfg.validate.rule import Findings, checklist, error, info, per_loop, warning

if TYPE_CHECKING:
    from pidcfg.validate.rules.dpide.context import LoopView

MODES = range(3)
AUTOTUNE = 1
D259 = Decision(
    259,
    "an operand without a device is a number in the program",
    "PID_MODE 1 without `devices.PID_MODE` is an error, tuned coefficients without devices a warning; PID_RUN "
    "FALSE and PID_MAN TRUE without devices are warnings.",
    "A number in the program cannot change: neither the autotune's end nor an operator can write it.",
)


@per_loop
@error("DP704", TABLE, "PID_MODE is {mode}; there are 0 (automatic), 1 (autotune) and 2 (automatic, with I_MV)")
def unknown_mode(view: LoopView) -> Findings:
    """PID_MODE is none of the three modes.

    Why: the manual does not say what the instruction does with another number.

    Fix: write 0, 1 or 2.
    """
    if view.held("PID_MODE") and view.loop.PID_MODE not in MODES:
        yield view.at("PID_MODE", mode=view.loop.PID_MODE)


@per_loop
@error("DP705", TABLE, "PID_MODE 1 needs a device, where the PLC writes 0 after tuning")
def autotune_as_a_number(view: LoopView) -> Findings:
    """The autotune is chosen by a number in the program.

    Why: when it is done, the PLC sets PID_MODE to 0. It cannot write a number of the program: the software refuses it,
    or the loop tunes for ever.

    Fix: give PID_MODE a device: `devices: {PID_MODE: D104}`.
    """
    if view.loop.PID_MODE == AUTOTUNE and not view.has_device("PID_MODE"):
        yield view.at("PID_MODE")


@per_loop
@warning("DP706", D259, "the autotune writes {names}, which {have} no device")
def tuned_coefficients_without_devices(view: LoopView) -> Findings:
    """The autotune is chosen, but what it finds has no place to go.

    Why: it writes Kc_Kp, Ti_Ki, Td_Kd and Tf. As numbers in the program they stay what they are; in registers that are
    not latched they are gone after a loss of power.

    Fix: give the four operands devices, in a latched range.
    """
    bare = [name for name in WRITTEN_BY_AUTOTUNE[1:] if not view.has_device(name)]
    if view.loop.PID_MODE == AUTOTUNE and bare:
        yield view.at("PID_MODE", names=", ".join(bare), have="has" if len(bare) == 1 else "have")


@per_loop
@checklist("DP707", TABLE, "PID_MODE 1: the loop tunes as soon as it runs, and swings MV between {low} and {high}")
def tunes_at_once(view: LoopView) -> Findings:
    """The file starts an autotune.

    Why: the instruction switches the output to find out how the process answers, without a ramp. That is right for an
    oven, and wrong for a motor.

    Fix: see that the plant may be moved at that moment. Otherwise write 0.
    """
    if view.loop.PID_MODE == AUTOTUNE and view.loop.PID_RUN and view.limits is not None:
        low, high = view.limits
        yield view.at("PID_MODE", low=view.mv(low), high=view.mv(high))


@per_loop
@warning("DP708", D259, "PID_RUN is FALSE and has no device: MV stays 0")
def never_runs(view: LoopView) -> Findings:
    """The algorithm is switched off, and nothing can switch it on.

    Why: with PID_RUN FALSE the instruction writes 0 into MV in every scan.

    Fix: leave PID_RUN out, which is TRUE, or give it a device: `devices: {PID_RUN: M10}`.
    """
    if not view.loop.PID_RUN and not view.has_device("PID_RUN"):
        yield view.at("PID_RUN")


@per_loop
@warning("DP709", D259, "PID_MAN is TRUE and has no device: the loop stays in manual, MV is {mout}")
def always_in_manual(view: LoopView) -> Findings:
    """The loop is in manual, and nothing can take it out.

    Why: MV is MOUT within the limits; the PV has no effect at all.

    Fix: write `PID_MAN: false`, or give it a device: `devices: {PID_MAN: M11}`.
    """
    if view.loop.PID_MAN and view.loop.PID_MODE != AUTOTUNE and not view.has_device("PID_MAN"):
        low, high = view.limits or (view.loop.MOUT, view.loop.MOUT)
        yield view.at("PID_MAN", mout=decimal_text(min(max(view.loop.MOUT, low), high)))


@per_loop
@warning("DP710", DPIDE.at("PID_MAN"), "PID_MAN TRUE has no effect while PID_MODE is 1: the autotune drives MV")
def manual_during_autotune(view: LoopView) -> Findings:
    """Manual and the autotune are chosen together.

    Why: somebody may rely on manual to hold the output. The autotune does not look at PID_MAN.

    Fix: write `PID_MODE: 0` to hold the output, or `PID_MAN: false` to tune.
    """
    if view.loop.PID_MAN and view.loop.PID_MODE == AUTOTUNE:
        yield view.at("PID_MAN")


def may_be_manual(view: LoopView) -> bool:
    """Whether somebody can put the loop in manual."""
    return view.loop.PID_MAN or view.has_device("PID_MAN")


@per_loop
@info(
    "DP718",
    DPIDE.at("PID_MODE"),
    "Ti_Ki is {value}: when PID_MAN becomes FALSE, MV jumps from MOUT to the gain times the error and BIAS",
)
def bump_after_manual(view: LoopView) -> Findings:
    """The change from manual to automatic bumps.

    Why: with an integral I_MV takes over the MV of manual, so that MV goes on from there. Without one nothing can.

    Fix: give a Ti_Ki, or bring MOUT to where the algorithm begins before the change.
    """
    if view.loop.Ti_Ki <= 0 and may_be_manual(view) and not view.has_device("Ti_Ki"):
        yield view.at("Ti_Ki", value=decimal_text(view.loop.Ti_Ki))


@per_loop
@info("DP719", DPIDE.at("MOUT_AUTO"), "MOUT_AUTO is FALSE: when PID_MAN becomes TRUE, MV jumps to MOUT")
def bump_into_manual(view: LoopView) -> Findings:
    """The change from automatic to manual bumps.

    Why: MOUT is whatever was written last. With MOUT_AUTO TRUE, or in the device of MV, it follows MV, and manual
    begins where automatic ended.

    Fix: write `MOUT_AUTO: true`, unless MOUT is meant as a fixed output.
    """
    follows = view.loop.MOUT_AUTO or view.has_device("MOUT_AUTO") or view.mout_is_mv
    if view.has_device("PID_MAN") and not follows:
        yield view.at("MOUT_AUTO")
