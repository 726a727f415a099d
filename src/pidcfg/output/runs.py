"""Runs of a scenario and batches of samples: the results of `pidcfg.simulate` and `pidcfg.certify`, and their JSON."""

from __future__ import annotations

import csv
import io
from array import array
from copy import deepcopy
from typing import TYPE_CHECKING

from pidcfg.output.findings import finding_data, scenarios_data, short_repr
from pidcfg.sim.judgement.meters import METRICS
from pidcfg.sim.judgement.report import ten_digits
from pidcfg.text.frozen import frozen

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Mapping, Sequence

    from pidcfg.sim.engine.recording import Recording
    from pidcfg.sim.judgement.report import LoopReport, Report, Standing
    from pidcfg.study.certification.certify import BatchOutcome, Certification
    from pidcfg.study.certification.samples import Fan
    from pidcfg.study.outcome import Outcome
    from pidcfg.text.diagnostics import Diagnostic
    from pidcfg.text.paths import Data


# --- A run of a scenario: the result of `pidcfg.simulate`, and its JSON -----------------------------------------------


class Columns:
    """Takes a trend as CSV, and keeps the numbers by the names of their columns."""

    def __init__(self) -> None:
        self.values: dict[str, array[float]] = {}

    def write(self, text: str) -> None:
        """Whole lines: the head first."""
        rows = list(csv.reader(io.StringIO(text)))
        if not self.values:
            self.values = {name: array("d") for name in rows.pop(0)}
        for column, values in zip(self.values.values(), zip(*rows, strict=True), strict=False):
            column.extend(map(float, values))


@frozen
class SimulateResult:
    """One scenario: its findings, and its report when it could run."""

    __repr__ = short_repr

    outcome: Outcome
    columns: Columns | None = None
    """The trend, where it was to be kept (``trend=True``)."""

    @property
    def findings(self) -> tuple[Diagnostic, ...]:
        """Of the scenario, and the errors of its configuration."""
        return tuple(self.outcome.findings)

    @property
    def report(self) -> Report | None:
        """Metrics, alarms, modes, signals and verdicts (`pidcfg.sim.judgement.report`); None: it could not run."""
        return self.outcome.report

    @property
    def recording(self) -> Recording | None:
        """The signals of the loops over time, where they were asked for."""
        return self.outcome.recording

    @property
    def accepted(self) -> str | None:
        """The file that this run was to be accepted as; None: it was not to be, or has failed."""
        return self.outcome.accepted_text

    @property
    def passed(self) -> bool:
        """Whether it ran and everything that is expected of it holds."""
        return self.outcome.passed

    @property
    def ok(self) -> bool:
        """The same, under the name that every result has."""
        return self.passed

    def to_frame(self) -> dict[str, list[float]]:
        """The trend as columns, ``time`` in s first and then a column a signal, as the CSV of `pidcfg simulate` has it.

        A data frame is made of it by ``pandas.DataFrame(run.to_frame())``, and so by polars. Raises `ValueError` where
        the trend was not kept.
        """
        if self.columns is None:
            raise ValueError("the trend was not kept; call simulate with trend=True (and every=N for fewer rows)")
        return {name: list(values) for name, values in self.columns.values.items()}

    def _repr_html_(self) -> str:
        """What notebooks show."""
        from pidcfg.output.notebook import run_html

        return run_html(self)

    def html(
        self,
        before: SimulateResult | None = None,
        loops: Collection[str] = (),
        names: tuple[str, str] = ("before", "after"),
    ) -> str:
        """The trends as HTML, a figure a loop, of a run with ``record``; empty: there is none.

        ``before``: another run of these loops, dashed behind it; ``names``: what the two are called. ``loops``: only
        these. The styles of the figures, and the script that zooms them, are those of ``simulate --plot run.html``.
        """
        from pidcfg.pictures.page import render_figures
        from pidcfg.study.outcome import charts_of, overlay_charts

        if before is None:
            return render_figures(charts_of(self.outcome, loops))
        return render_figures(overlay_charts(before.outcome, self.outcome, names, loops))

    def to_json(self) -> Data:
        """What ``pidcfg simulate --format json`` prints for one scenario."""
        return deepcopy(runs_data([self.outcome]))


def accepted_difference(before: bytes, after: str) -> str:
    """What another accepted run has in the place of the one in a file, in words."""
    from pidcfg.schemas.scenario import AcceptedError, run_of_data
    from pidcfg.study.accepted import differences_text

    try:
        accepted = run_of_data(before, len(before))
    except AcceptedError as error:
        return str(error)
    differences = differences_text(accepted, run_of_data(after.encode(), len(after.encode())))
    return f"differs: {differences}" if differences else "differs, within the tolerances"


def signal_rows(outcome: Outcome, text: Callable[[float], str]) -> Iterator[tuple[str, ...]]:
    """Each signal with its ends as texts: an output without a range, and its bias, in per cent of the counts."""
    signals = {} if outcome.report is None else outcome.report.signals
    counts = {name: a.output_counts for loop, a in outcome.axes.items() for name in (a.output, f"{loop}.BIAS")}
    for name, extremes in signals.items():
        values = (extremes.low, extremes.high, extremes.final)
        if scale := counts.get(name):
            yield name, *(f"{100 * (value - scale[0]) / (scale[1] - scale[0]):.4g} %" for value in values)
        else:
            yield name, *map(text, values)


def runs_data(outcomes: Sequence[Outcome]) -> Data:
    """The public layout, version 1: one object for one scenario, for several a list of them under ``runs``."""
    return scenarios_data("runs", [_run_data(outcome) for outcome in outcomes])


def _run_data(outcome: Outcome) -> Data:
    report = outcome.report
    findings = {"findings": [finding_data(d) for d in outcome.findings], "passed": outcome.passed}
    if report is None:
        empty: Data = {"plc_flags": {}, "loops": {}, "signals": {}, "expectations": [], "standing": [], "notes": []}
        return {"scenario": None, "file": outcome.file, "engine": None, **empty, **findings}
    timing = report.scan_time
    scan = {} if timing is None else {"scan_time": dict(zip(timing._fields, map(ten_digits, timing), strict=True))}
    signals = report.signals.items()
    return {
        "scenario": report.scenario,
        "file": outcome.file,
        "engine": report.engine,
        "plc_flags": dict(report.plc_flags),
        "loops": {name: _loop_data(loop) for name, loop in report.loops.items()},
        "signals": {
            name: {"min": extremes.low, "max": extremes.high, "final": extremes.final} for name, extremes in signals
        },
        "expectations": [{"text": v.text, "passed": v.passed, "value": v.value} for v in report.expectations],
        "standing": [standing_data(v) for v in report.standing],
        "notes": [{"at": n.at, "loop": n.loop, "text": n.text, "error": n.error} for n in report.notes],
        **findings,
        **scan,
    }


def standing_data(v: Standing) -> Data:
    """A standing expectation: what is not judged has passed, but says nothing."""
    return {
        "kind": v.kind,
        "loop": v.loop,
        "passed": v.passed,
        "judged": v.is_judged,
        "verdict": v.verdict,
        "at": v.at,
        "text": v.text,
        "allowed": v.allowed,
    }


def _loop_data(loop: LoopReport) -> Data:
    data: Data = {
        "verdict": loop.verdict,
        "missing": loop.missing or None,
        "metrics": {name: loop.metrics.get(name) for name in METRICS},
        **({} if loop.until is None else {"until": loop.until}),
        "time_in_control": loop.time_in_control,
        "alarms": [{"alarm": a.alarm, "at": a.at, "cleared": a.cleared} for a in loop.alarms],
        "modes": [{"at": m.at, "requested": m.requested, "mode": m.mode, "reason": m.reason} for m in loop.modes],
        "flags": dict(loop.flags),
        "unlisted": loop.unlisted,
    }
    if loop.autotune is not None:
        done, error, status = loop.autotune["done"], loop.autotune["error"], loop.autotune["status"]
        results = dict(loop.autotune["results"])
        data["autotune"] = {"done": done, "error": error, "status": status, "results": results}
    return data


# --- A batch of samples: the result of `pidcfg.certify`, and its JSON -------------------------------------------------


@frozen
class CertifyResult:
    """One scenario: its findings, and what its samples show when they could run."""

    __repr__ = short_repr

    outcome: BatchOutcome

    @property
    def findings(self) -> tuple[Diagnostic, ...]:
        """Of the scenario, and the errors of its configuration."""
        return tuple(self.outcome.findings)

    @property
    def certification(self) -> Certification | None:
        """Shares with their bounds, distributions and the worst samples; None: nothing ran."""
        return self.outcome.certification

    @property
    def fan(self) -> Fan | None:
        """How far the signals of the loops spread over time, where that was asked for."""
        return self.outcome.fan

    @property
    def passed(self) -> bool:
        """Whether every bound reaches what is wanted."""
        return self.outcome.passed

    @property
    def ok(self) -> bool:
        """The same, under the name that every result has."""
        return self.passed

    def to_json(self) -> Data:
        """What ``pidcfg certify --format json`` prints for one scenario."""
        return deepcopy(batches_data([self.outcome]))


def batches_data(outcomes: Sequence[BatchOutcome], files: Mapping[tuple[str, int], str] | None = None) -> Data:
    """The public layout, version 1: one object for one scenario, for several a list of them under ``batches``.

    ``files``: where samples were written, by scenario file and number.
    """
    known = files or {}
    return scenarios_data("batches", [_batch_data(outcome, known) for outcome in outcomes])


def _batch_data(outcome: BatchOutcome, files: Mapping[tuple[str, int], str]) -> Data:
    certification = outcome.certification
    ending = {"findings": [finding_data(d) for d in outcome.findings], "passed": outcome.passed}
    if certification is None:
        empty: Data = {"expectations": [], "metrics": {}, "standing": [], "uncertainties": [], "worst": []}
        counts: Data = {"samples": 0, "seed": None, "all_passed": 0, "failed_to_run": 0, "reasons": []}
        return {"scenario": None, "file": outcome.file, **counts, **empty, **ending}
    return {
        "scenario": certification.scenario,
        "file": outcome.file,
        "samples": certification.samples,
        "seed": certification.seed,
        "all_passed": certification.all_passed,
        "failed_to_run": certification.failed_to_run,
        "reasons": list(certification.reasons),
        "expectations": [
            {"text": e.text, "share": e.share, "bound": e.bound, "wanted": e.wanted, "passed": e.passed}
            for e in certification.expectations
        ],
        "metrics": {
            loop: {name: dict(values) for name, values in row.items()} for loop, row in certification.metrics.items()
        },
        "standing": [
            {
                "kind": s.kind,
                "loop": s.loop,
                "failed": s.samples - s.held,
                "not_proven": s.unproven,
                "judged": s.judged,
                "bound": s.bound,
                "passed": s.passed,
            }
            for s in certification.standing
        ],
        "uncertainties": [
            {"name": e.label, "spread": e.text, "lowest_fifth": e.lowest, "highest_fifth": e.highest}
            for e in certification.effects
        ],
        "worst": [
            {
                "sample": w.sample,
                "margin": w.margin,
                "failed": w.failed,
                "expectation": w.expectation,
                "values": dict(w.numbers),
                "file": files.get((outcome.file, w.sample)),
            }
            for w in certification.worst
        ],
        **ending,
    }
