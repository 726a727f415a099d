"""A run of a scenario: the result of `pidcfg.simulate`, and its JSON."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from pidcfg.results.findings import Data, finding_data, one_or_several
from pidcfg.sim.metrics import METRICS
from pidcfg.sim.report import rounded

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.diagnostics import Diagnostic
    from pidcfg.scenario.outcome import Outcome
    from pidcfg.sim.recording import Recording
    from pidcfg.sim.report import LoopReport, Report, Standing


@dataclass(frozen=True, slots=True)
class SimulateResult:
    """One scenario: its findings, and its report when it could run."""

    outcome: Outcome

    @property
    def findings(self) -> tuple[Diagnostic, ...]:
        """Of the scenario, and the errors of its configuration."""
        return tuple(self.outcome.findings)

    @property
    def report(self) -> Report | None:
        """Metrics, alarms, modes, signals and verdicts (`pidcfg.sim.report`); None: it could not run."""
        return self.outcome.report

    @property
    def recording(self) -> Recording | None:
        """The signals of the loops over time, where they were asked for."""
        return self.outcome.recording

    @property
    def passed(self) -> bool:
        """Whether it ran and everything that is expected of it holds."""
        return self.outcome.passed

    @property
    def ok(self) -> bool:
        """The same, under the name that every result has."""
        return self.passed

    def to_json(self) -> Data:
        """What ``pidcfg simulate --format json`` prints for one scenario."""
        return deepcopy(runs_data([self.outcome]))


def runs_data(outcomes: Sequence[Outcome]) -> Data:
    """The public layout, version 1: one object for one scenario, for several a list of them under ``runs``."""
    return one_or_several("runs", [_run(outcome) for outcome in outcomes])


def _run(outcome: Outcome) -> Data:
    report = outcome.report
    findings = {"findings": [finding_data(d) for d in outcome.findings], "passed": outcome.passed}
    if report is None:
        nothing: Data = {"plc_flags": {}, "loops": {}, "signals": {}, "expectations": [], "standing": [], "notes": []}
        return {"scenario": None, "file": outcome.file, "engine": None, **nothing, **findings}
    timing = report.scan_time
    scan = {} if timing is None else {"scan_time": dict(zip(timing._fields, map(rounded, timing), strict=True))}
    signals = report.signals.items()
    return {
        "scenario": report.scenario,
        "file": outcome.file,
        "engine": report.engine,
        "plc_flags": dict(report.plc_flags),
        "loops": {name: _loop(loop) for name, loop in report.loops.items()},
        "signals": {name: {"min": seen.low, "max": seen.high, "final": seen.final} for name, seen in signals},
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
        "judged": v.judged,
        "at": v.at,
        "text": v.text,
        "allowed": v.allowed,
    }


def _loop(loop: LoopReport) -> Data:
    data: dict[str, Any] = {
        "metrics": {name: loop.metrics.get(name) for name in METRICS},
        "time_in_control": loop.time_in_control,
        "alarms": [{"alarm": a.alarm, "at": a.at, "cleared": a.cleared} for a in loop.alarms],
        "modes": [{"at": m.at, "requested": m.requested, "mode": m.mode, "reason": m.reason} for m in loop.modes],
        "flags": dict(loop.flags),
        "unlisted": loop.unlisted,
    }
    if loop.autotune is not None:
        tuning = {key: loop.autotune[key] for key in ("done", "error", "status")}
        data["autotune"] = {**tuning, "results": dict(loop.autotune["results"])}
    return data
