"""The result of a tuning rule for people, what holds on which plants, and the picture of its margins."""

from __future__ import annotations

import sys
from math import isinf
from typing import TYPE_CHECKING

import click

from pidcfg.cli.plots import chart_text
from pidcfg.pictures import Chart, Line, Locus, Panel

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.output.gains import TuneResult
    from pidcfg.output.retune import Forecast, LoopConditions, RetunedFile
    from pidcfg.output.robust import Confirmation, RobustGains
    from pidcfg.text.paths import Data
    from pidcfg.tuning.identify import Identification
    from pidcfg.tuning.margins import Judgement
    from pidcfg.tuning.response import Record
    from pidcfg.tuning.rules import Gains

# --- ``tune --plot``: the margins of a loop in the complex plane, and what it does after steps ------------------------

MAX_POINT_DISTANCE = 12.0
"""Points of the curve that are farther out are in no picture."""


def margin_chart(result: TuneResult) -> Chart:
    """The picture of a loop; ends the command where its process is not known, or it is unstable."""
    from pidcfg.tuning.margins import step_curves, trace_curve

    judgement, gains = result.judgement, result.gains
    margins, plant = judgement.margins, judgement.plant
    if plant is None:
        raise click.ClickException("--plot needs the process: add its --gain")
    if margins is None:
        raise click.ClickException("--plot: with these gains the loop is unstable, there is nothing to be drawn")
    trace, step_answers = trace_curve(gains, plant), step_curves(gains, plant)
    points = tuple(point for point in trace.points if abs(point) < MAX_POINT_DISTANCE)
    locus = Locus(
        points, margins.ms, trace.nearest, margins.gain_margin, trace.crossing, margins.phase_margin, trace.crossover
    )
    step = Line("SP", "setpoint", (0.0, step_answers.times[-1]), (1.0, 1.0))
    panels = (
        Panel("PV, set point +1", "", (Line("PV", "pv", step_answers.times, step_answers.setpoint), step), (0.0, 1.0)),
        Panel("PV, output +1", "", (Line("PV", "pv", step_answers.times, step_answers.disturbance),), (0.0, 0.0)),
    )
    return Chart(_controller_title(gains), "", panels, locus=locus, notes=tuple(_chart_notes(result, locus)))


def _controller_title(gains: Gains) -> str:
    """The controller."""
    parts = [f"Kp {gains.gain:.4g}"]
    parts += [] if isinf(gains.integral_time) else [f"Ti {gains.integral_time:.4g} s"]
    parts += [f"Td {gains.derivative_time:.4g} s"] if gains.derivative_time else []
    return ", ".join(parts)


def _chart_notes(result: TuneResult, locus: Locus) -> list[str]:
    """What stands below the picture."""
    answer = result.judgement.answer
    figures = "" if answer is None else f"; overshoot {answer.overshoot:.3g} %"
    return [f"{locus.text}{figures}", *(f"warning: {text}" for text in result.warnings)]


# --- What holds on which plants, of robust gains, as lines for people -------------------------------------------------

TIME_KEYS = ("time_constant", "time_constant_2", "dead_time")


def robust_lines(gains: RobustGains, reason: str) -> Iterator[str]:
    """The loop, the plants, and what holds on them."""
    data, robust = gains.to_json(), gains.tuning
    filter_text = "no PV filter" if data["pv_share"] == 1 else f"PV filter {data['pv_share']:.4g} per sample"
    yield f"  rule         holds: {reason}"
    yield f"  loop         samples every {data['sample_time']:g} s, {filter_text}"
    yield f"  plants       {_plants_text(gains, data['plants'])}"
    ms_plant = _plant_text(data["worst_ms_plant"], gains)
    yield f"  worst Ms     {data['worst_ms']:.4f} of at most {data['ms_limit']:g}{ms_plant}"
    margin, angle = data["gain_margin"], data["phase_margin"]
    margin_text = "unlimited" if margin is None else f"{margin:.3g}"
    yield f"  there        gain margin {margin_text}  phase margin {'unlimited' if angle is None else f'{angle:.3g}°'}"
    iae_plant = _plant_text(data["worst_iae_plant"], gains)
    yield f"  worst IAE    {data['worst_iae']:.4g} after a step of 1 at the output{iae_plant}"
    if robust.has_words:
        yield from _grid_lines(data)
    if gains.confirmation is not None:
        yield f"  certified    {_confirmation_text(gains.confirmation)}"
    for text in gains.assumptions:
        yield f"  assumed      {text}"


def _plants_text(gains: RobustGains, count: int) -> str:
    """How many there are, and what they differ by."""
    spreads = gains.tuning.spreads
    if not spreads:
        return "the process alone; --vary says what is uncertain"
    corners = 2 ** len(spreads)
    ends = ", ".join(
        _spread_text(spread.name, spread.low, spread.high, negative=gains.is_negative) for spread in spreads
    )
    return f"{count}: the process, {corners} combinations of ends, {count - corners - 1} samples between; {ends}"


def _grid_lines(data: Data) -> Iterator[str]:
    """What the grid of the PLC costs."""
    real = data["real"]
    search_text = "the best of all words" if data["every_word"] else "the best words around the best real numbers"
    rate = f", Td {real['derivative_time']:.5g} s" if real["derivative_time"] else ""
    yield f"  words        {search_text}; they cost {_cost_text(data['cost_percent'])} against real numbers"
    yield f"               (Kp {real['gain']:.5g}, Ti {real['integral_time']:.5g} s{rate}: IAE {real['worst_iae']:.4g})"


def _confirmation_text(confirmation: Confirmation) -> str:
    """What the samples show."""
    from pidcfg.cli.formats.batches import share_figure

    samples_text = (
        f"{confirmation.held_count} of {confirmation.samples} samples on a virtual {confirmation.plc} keep the IAE"
    )
    bound_text = (
        f"so at least {share_figure(confirmation.bound)} % of the plants between these ends, at 95 % confidence"
    )
    return f"{'' if confirmation.passed else 'NOT CONFIRMED: '}{samples_text}, {bound_text}"


def _cost_text(percent: float) -> str:
    """A share of the IAE; what is below the search's own steps counts as nothing."""
    return "nothing" if percent < 0.005 else f"{percent:.2f} % IAE"


def _spread_text(name: str, low: float, high: float, *, negative: bool) -> str:
    unit = " s" if name != "gain" else ""
    if name == "gain" and negative:
        low, high = -high, -low
    return f"{name.replace('_', ' ')} {low:.5g} to {high:.5g}{unit}"


def _plant_text(plant: dict[str, float], gains: RobustGains) -> str:
    """The numbers of a plant that vary."""
    names = {spread.name.replace("second_time_constant", "time_constant_2") for spread in gains.tuning.spreads}
    signed_plant = {**plant, "gain": -plant["gain"]} if gains.is_negative else plant
    numbers = [
        f"{k.replace('_', ' ')} {v:.5g}{' s' if k in TIME_KEYS else ''}" for k, v in signed_plant.items() if k in names
    ]
    return f" ({', '.join(numbers)})" if numbers else ""


# --- The result of a tuning rule for people, with a picture of what was fitted to a record ----------------------------

NUMBER_UNITS = {"gain": "", "ultimate_gain": ""}
INTEGRATING_UNITS = {"gain": " per s"}
"""Of an integrating process."""


def tuning_text(tuning: TuneResult) -> str:
    """Everything as lines."""
    result, lines = tuning.to_json(), []
    if tuning.identified is not None and tuning.record is not None:
        chart = chart_of(tuning.identified, tuning.record)
        lines += [_identified_text(tuning.identified), "", chart_text(chart, sys.stdout), ""]
    units = {**NUMBER_UNITS, **INTEGRATING_UNITS} if tuning.model == "integrating" else NUMBER_UNITS
    process = ", ".join(f"{k.replace('_', ' ')} {v:.6g}{units.get(k, ' s')}" for k, v in tuning.numbers.items())
    kind = "" if tuning.model in {None, "first-order"} else f"{tuning.model}: "
    lines += [f"{result['method']}, {result['form']}: {result['title']} ({result['basis']})", f"  {kind}{process}", ""]
    integral = result["integral_time"]
    independent = result["independent"]
    times = "no integral term" if integral is None else f"Ti {integral:.6g} s"
    lines += [
        f"  dependent    Kp {result['gain']:.6g}  {times}  Td {result['derivative_time']:.6g} s",
        f"  independent  Kp {independent['kp']:.6g}  Ki {independent['ki']:.6g} /s  Kd {independent['kd']:.6g} s",
    ]
    robustness = _robustness_lines(tuning.judgement)
    if tuning.forecast is not None and tuning.around is not None:
        robustness[-1:] = [robustness[-1], *_forecast_lines(tuning.around, tuning.forecast)]
    if tuning.robust is not None:  # the margins are those of the sampled loop, on the worst plant
        robustness[:2] = robust_lines(tuning.robust, tuning.judgement.reason)
    lines += ["", *robustness]
    if "for" in result:
        lines += ["", *_vendor_lines(result["for"])]
    lines += [f"warning: {text}" for text in result["warnings"]]
    text = "\n".join(lines) + "\n"
    return text if tuning.written is None else text + "\n" + _retuned_text(tuning.written)


def _retuned_text(retuned: RetunedFile) -> str:
    """What changed in a file, and the findings of the loop."""
    from pidcfg.cli.formats import findings as findings_format

    is_new = retuned.data != retuned.before
    state = "written" if retuned.ok else "NOT WRITTEN, for its errors"
    lines = [f"{retuned.file}, {retuned.loop}: {state if is_new else 'has these gains already'}"]
    for value in retuned.values:
        if value.is_changed:
            lines.append(f"  {value.key}: {value.old or 'not given'} → {value.new}")
        else:
            lines.append(f"  {value.key}: {value.old or 'not given'}, as before")
    if retuned.action is None:
        lines.append("  action not compared: the sign of the process's gain is not known; add --gain")
    findings = findings_format.findings_text(retuned.findings, {retuned.file: retuned.document})
    title = f"findings of {retuned.loop} with these gains:" if findings else f"no findings of {retuned.loop}"
    return "\n".join(lines) + f"\n\n{title}\n" + findings.rstrip("\n")


def _robustness_lines(judgement: Judgement) -> list[str]:
    """Range, margins and figures of the closed loop."""
    validity = "holds" if judgement.valid else "DOES NOT HOLD"
    lines = [f"  rule         {validity}: {judgement.reason}"]
    margins, answer = judgement.margins, judgement.answer
    if margins is None:
        return [*lines, "  closed loop  UNSTABLE"] if judgement.known else lines
    gain, phase = _limit_text(margins.gain_margin, ""), _limit_text(margins.phase_margin, "°")
    lines.append(f"  robustness   Ms {margins.ms:.2f}  gain margin {gain}  phase margin {phase}")
    if answer is not None:
        figures = [f"overshoot {answer.overshoot:.3g} %"]
        if answer.iae_setpoint is not None:
            figures += [f"IAE {answer.iae_setpoint:.4g} (set point), {answer.iae_disturbance:.4g} (disturbance)"]
        lines.append(f"  closed loop  {'; '.join(figures)}")
    return lines


def _forecast_lines(conditions: LoopConditions, forecast: Forecast) -> Iterator[str]:
    """For which loop the gains are, and what its words do."""
    if forecast.why:
        yield f"               of a continuous loop: {forecast.why}"
    else:
        (low, high), (out_low, out_high) = forecast.pv_range, forecast.limits
        before, after = forecast.step
        yield f"               run with these words: set point {before:.6g} to {after:.6g}"
        yield f"               up to steps of {forecast.largest_step:.3g} the output stays within its limits"
        if forecast.hunts:
            error = forecast.final_error
            yield f"               the PV stays {error:.3g} from its set point: a longer run has a larger IAE"
    facts = [] if conditions.sample_time is None else [f"samples every {conditions.sample_time:g} s"]
    facts.append(f"PV filter {conditions.filter_time:.3g} s" if conditions.filter_time else "no PV filter")
    facts += [] if conditions.action is None else [f"action {conditions.action}"]
    if not forecast.why:
        facts += [f"PV {low:g} to {high:g}", f"output {out_low:g} to {out_high:g}"]
    yield f"  loop         {', '.join(facts)}"


def _limit_text(value: float, unit: str) -> str:
    return "unlimited" if isinf(value) else f"{value:.3g}{unit}"


def _vendor_lines(gains: Data) -> list[str]:
    action = gains["action"] or "that of the process, which is not known without --gain"
    lines = [f"for {gains['vendor']}: action {action}"]
    for value in gains["values"]:
        if value["stored"] is None:
            lines.append(f"  {value['key']}: {value['problem']}")
            continue
        error = f"  ({value['error_percent']:+.3g} % of {value['value']:.6g})" if value["error_percent"] else ""
        unit = f" {value['unit']}" if value["unit"] else ""
        lines.append(f"  {value['key']}: {value['stored']:.9g}{unit}{error}")
    return lines


def _identified_text(fit: Identification) -> str:
    process, (gain, constant, dead) = fit.process, fit.confidence
    numbers = [
        f"gain {process.gain:.5g} ± {gain:.2g}" + (" per s (integrating)" if fit.integrating else ""),
        *([] if fit.integrating else [f"time constant {process.time_constant:.5g} ± {constant:.2g} s"]),
        *([f"second {second:.5g} ± {fit.second_confidence:.2g} s"] if (second := process.second_time_constant) else []),
        f"dead time {process.dead_time:.5g} ± {dead:.2g} s",
    ]
    change = f"change of {fit.step:.5g} at {fit.step_time:g} s; noise {fit.noise:.3g}"
    misfit_text = f"what is left is {fit.misfit * 100:.2g} % of the answer; ± is 95 % confidence"
    lines = [
        f"identified: {', '.join(numbers)}",
        f"  {change}; {misfit_text}",
        *(f"  {remark}" for remark in fit.remarks),
    ]
    return "\n".join(lines)


def chart_of(fit: Identification, record: Record) -> Chart:
    """Recorded and fitted PV over time."""
    from pidcfg.pictures import Chart, Line, Panel

    times = tuple(record.time)
    lines = (
        Line("PV", "pv", times, tuple(record.pv), "before"),
        Line("PV", "pv", times, fit.fitted_pv, "after"),
    )
    return Chart("", "", (Panel("PV", "", lines),), sides=("recorded", "fitted"))
