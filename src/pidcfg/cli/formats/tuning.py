"""The result of a tuning rule for people, with a picture of what was fitted to a record."""

from __future__ import annotations

import sys
from math import isinf
from typing import TYPE_CHECKING, Any

from pidcfg.cli.files.plots import in_characters
from pidcfg.cli.formats.robust import robust_lines

if TYPE_CHECKING:
    from pidcfg.pictures.chart import Chart
    from pidcfg.results.gains import TuneResult
    from pidcfg.results.retune import Written
    from pidcfg.tuning.identify import Identified
    from pidcfg.tuning.judgement import Judgement
    from pidcfg.tuning.samples import Record

UNITS = {"gain": "", "ultimate_gain": ""}
PER_S = {"gain": " per s"}
"""Of an integrating process."""


def as_text(tuned: TuneResult) -> str:
    """Everything as lines."""
    result, lines = tuned.to_json(), []
    if tuned.identified is not None and tuned.record is not None:
        chart = chart_of(tuned.identified, tuned.record)
        lines += [_identified(tuned.identified), "", in_characters(chart, sys.stdout), ""]
    units = {**UNITS, **PER_S} if tuned.model == "integrating" else UNITS
    process = ", ".join(f"{k.replace('_', ' ')} {v:.6g}{units.get(k, ' s')}" for k, v in tuned.numbers.items())
    kind = "" if tuned.model in {None, "first-order"} else f"{tuned.model}: "
    lines += [f"{result['method']}, {result['form']}: {result['title']} ({result['basis']})", f"  {kind}{process}", ""]
    integral = result["integral_time"]
    independent = result["independent"]
    times = "no integral term" if integral is None else f"Ti {integral:.6g} s"
    lines += [
        f"  dependent    Kp {result['gain']:.6g}  {times}  Td {result['derivative_time']:.6g} s",
        f"  independent  Kp {independent['kp']:.6g}  Ki {independent['ki']:.6g} /s  Kd {independent['kd']:.6g} s",
    ]
    judged = _robustness(tuned.judgement)
    if tuned.robust is not None:  # the margins are those of the sampled loop, on the worst plant
        judged[:2] = robust_lines(tuned.robust, tuned.judgement.reason)
    lines += ["", *judged]
    if "for" in result:
        lines += ["", *_for_vendor(result["for"])]
    lines += [f"warning: {text}" for text in result["warnings"]]
    text = "\n".join(lines) + "\n"
    return text if tuned.written is None else text + "\n" + _written(tuned.written)


def _written(written: Written) -> str:
    """What changed in a file, and the findings of the loop."""
    from pidcfg.cli.formats import reporters

    is_new = written.data != written.before
    state = "written" if written.ok else "NOT WRITTEN, for its errors"
    lines = [f"{written.file}, {written.loop}: {state if is_new else 'has these gains already'}"]
    for value in written.values:
        if value.changes:
            lines.append(f"  {value.key}: {value.old or 'not given'} → {value.new}")
        else:
            lines.append(f"  {value.key}: {value.old or 'not given'}, as before")
    if written.action is None:
        lines.append("  action not compared: the sign of the process's gain is not known; add --gain")
    found = reporters.text(written.findings, {written.file: written.document})
    title = f"findings of {written.loop} with these gains:" if found else f"no findings of {written.loop}"
    return "\n".join(lines) + f"\n\n{title}\n" + found.rstrip("\n")


def _robustness(judgement: Judgement) -> list[str]:
    """Range, margins and figures of the closed loop."""
    held = "holds" if judgement.valid else "DOES NOT HOLD"
    lines = [f"  rule         {held}: {judgement.reason}"]
    margins, answer = judgement.margins, judgement.answer
    if margins is None:
        return [*lines, "  closed loop  UNSTABLE"] if judgement.known else lines
    gain, phase = _limit(margins.gain_margin, ""), _limit(margins.phase_margin, "°")
    lines.append(f"  robustness   Ms {margins.ms:.2f}  gain margin {gain}  phase margin {phase}")
    if answer is not None:
        figures = [f"overshoot {answer.overshoot:.3g} %"]
        if answer.iae_setpoint is not None:
            figures += [f"IAE {answer.iae_setpoint:.4g} (set point), {answer.iae_disturbance:.4g} (disturbance)"]
        lines.append(f"  closed loop  {'; '.join(figures)}")
    return lines


def _limit(value: float, unit: str) -> str:
    return "unlimited" if isinf(value) else f"{value:.3g}{unit}"


def _for_vendor(gains: dict[str, Any]) -> list[str]:
    action = gains["action"] or "that of the process, which is not known without --gain"
    lines = [f"for {gains['vendor']}: action {action}"]
    for value in gains["values"]:
        if value["stored"] is None:
            lines.append(f"  {value['key']}: {value['problem']}")
            continue
        off = f"  ({value['error_percent']:+.3g} % of {value['value']:.6g})" if value["error_percent"] else ""
        unit = f" {value['unit']}" if value["unit"] else ""
        lines.append(f"  {value['key']}: {value['stored']:.9g}{unit}{off}")
    return lines


def _identified(fit: Identified) -> str:
    process, (gain, constant, dead) = fit.process, fit.confidence
    numbers = [
        f"gain {process.gain:.5g} ± {gain:.2g}" + (" per s (integrating)" if fit.integrating else ""),
        *([] if fit.integrating else [f"time constant {process.time_constant:.5g} ± {constant:.2g} s"]),
        f"dead time {process.dead_time:.5g} ± {dead:.2g} s",
    ]
    change = f"change of {fit.step:.5g} at {fit.at:g} s; noise {fit.noise:.3g}"
    left = f"what is left is {fit.misfit * 100:.2g} % of the answer; ± is 95 % confidence"
    lines = [f"identified: {', '.join(numbers)}", f"  {change}; {left}", *(f"  {remark}" for remark in fit.remarks)]
    return "\n".join(lines)


def chart_of(fit: Identified, record: Record) -> Chart:
    """Recorded and fitted PV over time."""
    from pidcfg.pictures.chart import Chart, Line, Panel

    times = tuple(record.time)
    lines = (
        Line("PV", "pv", times, tuple(record.pv), "before"),
        Line("PV", "pv", times, fit.fitted, "after"),
    )
    return Chart("", "", (Panel("PV", "", lines),), sides=("recorded", "fitted"))
