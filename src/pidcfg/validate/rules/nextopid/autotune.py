"""What the auto-tuning would do."""

from __future__ import annotations

from decimal import ROUND_HALF_EVEN
from typing import TYPE_CHECKING

from pidcfg.refs import NEXTOPID, Decision
from pidcfg.validate.rule import Findings, error, info, warning
from pidcfg.validate.views import number_text

if TYPE_CHECKING:
    from decimal import Decimal

    from pidcfg.validate.rules.nextopid.context import NextopidContext
    from pidcfg.validate.rules.nextopid.program import BlockView

START = NEXTOPID.at("chapter 4: AutoTune")
PARAMETERS = NEXTOPID.at("chapter 4: AutoTuneParam")
RESULT = NEXTOPID.at("chapter 4: MV_TOO_HIGH, MV_TOO_LOW")
MODE = NEXTOPID.at("chapter 4: Mode")
WHOLE = "PIDA_TUNE_INT"

D217 = Decision(
    217,
    "the peaks of an auto-tuning need room",
    "PercMaxPeakPV up to twice PercHystPV is a warning, and so is a step of an INT's MV that is not whole.",
    "PEAK_TOO_LOW is set below twice the hysteresis, PEAK_TOO_HIGH beyond PercMaxPeakPV; an INT has no half steps.",
)


def tuning(context: NextopidContext) -> list[BlockView]:
    """The loops with auto-tuning."""
    return context.of("PIDA_TUNE_REAL", WHOLE)


def wanted_step(view: BlockView) -> Decimal | None:
    """The step of MV to either side, as PercAmpMV gives it."""
    percent, mv = view.number_of("AutoTuneParam.PercAmpMV"), view.mv_limits
    return None if percent is None or mv is None else percent * (mv[1] - mv[0]) / 100


def step_of(view: BlockView) -> Decimal | None:
    """The step of MV to either side: an INT controller rounds it, half to even."""
    step = wanted_step(view)
    return step if step is None or view.type != WHOLE else step.to_integral_value(ROUND_HALF_EVEN)


@error("NX656", PARAMETERS, "AutoTune is {how}, but AutoTuneParam is not given: all of it is 0")
def auto_tuning_without_parameters(context: NextopidContext) -> Findings:
    """The auto-tuning can be started, and has no parameters.

    Why: amplitude, hysteresis, safety limit and cycles are 0 then, which are all out of range: it ends at once with an
    error.

    Fix: give AutoTuneParam, for a start PercAmpMV 5, PercHystPV 0.1, PercMaxPeakPV 10, NumCycles 3.
    """
    for view in tuning(context):
        if view.item.AutoTuneParam is None and view.may_be_on("AutoTune"):
            how = "wired" if view.is_wired("AutoTune") else "TRUE"
            yield view.at("AutoTune", "AutoTuneResult.Bad_PercAmpMV", how=how)


@warning("NX657", START, "AutoTune is {value}: the auto-tuning begins with the first cycle")
def auto_tuning_at_start(context: NextopidContext) -> Findings:
    """The auto-tuning starts with the program.

    Why: a process that has just been started is not steady, and MV is switched up and down before anybody looks.
    While AutoTune is TRUE the controller does not control.

    Fix: write `false`, or wire a command of the operator.
    """
    for view in tuning(context):
        if view.is_on("AutoTune") and view.item.AutoTuneParam is not None:
            yield view.at("AutoTune", value=view.shown("AutoTune"))


@warning("NX658", RESULT, "from ManualMV {start} the auto-tuning would step to {target}{unit}, beyond {limit} {end}")
def auto_tuning_step_beyond_limits(context: NextopidContext) -> Findings:
    """The step of the auto-tuning does not fit between MV and its limit.

    Why: MV is switched between both sides of where it stood. Where one of them is beyond a limit, the auto-tuning ends
    with an error.

    Fix: lower PercAmpMV, or bring ManualMV nearer to the middle.
    """
    for view in tuning(context):
        step, start, mv = step_of(view), view.number_of("ManualMV"), view.mv_limits
        if step is None or start is None or mv is None or view.is_on("Manual") is not True:
            continue
        start = min(max(start, mv[0]), mv[1])
        for target, limit, bit in ((start - step, "MinMV", "LOW"), (start + step, "MaxMV", "HIGH")):
            if target < mv[0] or target > mv[1]:
                yield view.at(
                    "AutoTuneParam.PercAmpMV",
                    f"AutoTuneResult.MV_TOO_{bit}",
                    start=view.shown("ManualMV"),
                    target=number_text(target),
                    unit=view.unit("MV"),
                    limit=limit,
                    end=view.shown(limit),
                )


@warning(
    "NX659",
    D217,
    "PercMaxPeakPV {peak} % is not above twice PercHystPV {hysteresis} %: the peaks are too low or too high",
)
def auto_tuning_peaks_without_room(context: NextopidContext) -> Findings:
    """The peaks of PV can only be too low or too high.

    Why: below twice the hysteresis the peaks cannot be trusted, and beyond PercMaxPeakPV the auto-tuning is aborted.

    Fix: raise PercMaxPeakPV as far as the process allows, or lower PercHystPV to the noise of PV.
    """
    for view in tuning(context):
        most, least = (view.number_of(f"AutoTuneParam.{key}") for key in ("PercMaxPeakPV", "PercHystPV"))
        if most is not None and least is not None and 0 < most <= 2 * least:
            peak, hysteresis = number_text(most), number_text(least)
            yield view.at(
                "AutoTuneParam.PercMaxPeakPV", "AutoTuneResult.PEAK_TOO_LOW", peak=peak, hysteresis=hysteresis
            )


@warning("NX660", D217, "PercAmpMV {percent} % is a step of {step}, and MV is an INT: {effect}")
def auto_tuning_step_not_whole(context: NextopidContext) -> Findings:
    """The step of the auto-tuning is none that an INT can make.

    Why: MV has whole numbers only. The step is rounded to the nearest one, and a step that rounds to 0 ends the
    auto-tuning with an error.

    Fix: raise PercAmpMV, or give MV a larger scale such as 0 to 30000.
    """
    for view in context.of(WHOLE):
        step, rounded = wanted_step(view), step_of(view)
        if step is not None and rounded is not None and step != rounded:
            effect = f"the step is {number_text(rounded)}" if rounded else "the auto-tuning ends with an error"
            yield view.at(
                "AutoTuneParam.PercAmpMV",
                None if rounded else "AutoTuneResult.Bad_PercAmpMV",
                percent=view.shown("AutoTuneParam.PercAmpMV"),
                step=number_text(step),
                effect=effect,
            )


@info("NX661", MODE, "the auto-tuning tunes a {mode} controller, and the loop has {terms}")
def auto_tuning_of_other_terms(context: NextopidContext) -> Findings:
    """The auto-tuning tunes another kind of controller than the loop is.

    Why: a gain that was made for P alone is too high beside an integral; a result for PI says nothing of the
    derivative that stays. Mode is P when it is not given.

    Fix: give the Mode of the loop, or clear the terms that are not tuned.
    """
    for view in tuning(context):
        param = view.item.AutoTuneParam
        if param is not None and view.integral and "I" not in param.Mode:
            terms = "an integral and a derivative" if view.derivative else "an integral"
            yield view.at("AutoTuneParam.Mode", mode=param.Mode, terms=terms)
        elif param is not None and view.derivative and "D" not in param.Mode:
            yield view.at("AutoTuneParam.Mode", mode=param.Mode, terms="a derivative")
