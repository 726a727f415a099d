"""A batch of samples: the result of `pidcfg.certify`, and its JSON."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import dataclass
from typing import TYPE_CHECKING

from pidcfg.results.findings import Data, finding_data, one_or_several

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from pidcfg.certification.fan import Fan
    from pidcfg.certification.outcome import Certification, Outcome
    from pidcfg.diagnostics import Diagnostic


@dataclass(frozen=True, slots=True)
class CertifyResult:
    """One scenario: its findings, and what its samples show when they could run."""

    outcome: Outcome

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


def batches_data(outcomes: Sequence[Outcome], files: Mapping[tuple[str, int], str] | None = None) -> Data:
    """The public layout, version 1: one object for one scenario, for several a list of them under ``batches``.

    ``files``: where samples were written, by scenario file and number.
    """
    known = files or {}
    return one_or_several("batches", [_batch(outcome, known) for outcome in outcomes])


def _batch(outcome: Outcome, files: Mapping[tuple[str, int], str]) -> Data:
    found = outcome.certification
    end = {"findings": [finding_data(d) for d in outcome.findings], "passed": outcome.passed}
    if found is None:
        nothing: Data = {"expectations": [], "metrics": {}, "standing": [], "uncertainties": [], "worst": []}
        counts: Data = {"samples": 0, "seed": None, "all_passed": 0, "failed_to_run": 0, "reasons": []}
        return {"scenario": None, "file": outcome.file, **counts, **nothing, **end}
    return {
        "scenario": found.scenario,
        "file": outcome.file,
        "samples": found.samples,
        "seed": found.seed,
        "all_passed": found.all_passed,
        "failed_to_run": found.failed_to_run,
        "reasons": list(found.reasons),
        "expectations": [
            {"text": e.text, "share": e.share, "bound": e.bound, "wanted": e.wanted, "passed": e.passed}
            for e in found.expectations
        ],
        "metrics": {loop: {name: dict(one) for name, one in row.items()} for loop, row in found.metrics.items()},
        "standing": [
            {
                "kind": s.kind,
                "loop": s.loop,
                "failed": s.samples - s.held,
                "judged": s.judged,
                "bound": s.bound,
                "passed": s.passed,
            }
            for s in found.standing
        ],
        "uncertainties": [
            {"name": e.label, "spread": e.text, "lowest_fifth": e.lowest, "highest_fifth": e.highest}
            for e in found.effects
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
            for w in found.worst
        ],
        **end,
    }
