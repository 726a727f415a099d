"""A batch of samples as text that is read in ten seconds: shares and bounds, what mattered, what was worst."""

from __future__ import annotations

from math import floor
from typing import TYPE_CHECKING

from pidcfg.cli.formats.reporters import text as findings_text
from pidcfg.cli.formats.simulation_text import FAILED, METRIC_UNITS, table
from pidcfg.control_characters import one_line

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from pidcfg.certification.outcome import Certification, Outcome, Share

COLUMNS = ("mean", "p5", "p50", "p95", "p99", "max")
"""Of each metric; JSON has more."""
NEVER_FAILED = "-"


def text(outcomes: Sequence[Outcome], written: Mapping[tuple[str, int], str]) -> str:
    """One section a scenario."""
    return "\n".join(_section(outcome, written) for outcome in outcomes)


def _section(outcome: Outcome, written: Mapping[tuple[str, int], str]) -> str:
    found = outcome.certification
    findings = findings_text(outcome.findings, outcome.documents).rstrip("\n")
    if found is None:
        return f"{one_line(outcome.file)}: cannot run\n\n{findings}\n"
    head = (
        f"{one_line(found.scenario)}\n  {one_line(f'{outcome.file} runs {outcome.config}')}\n"
        f"  {found.samples:,} samples of seed {found.seed}; each bound holds by itself, at 95 % confidence\n"
    )
    parts = [
        head,
        findings and f"{findings}\n",
        _expectations(found),
        _standing(found),
        _metrics(found),
        _effects(found),
        _worst(outcome.file, found, written),
        verdict_line(outcome, found) + "\n",
    ]
    return "\n".join(part for part in parts if part)


def figure(percent: float) -> str:
    """A share in %, cut off: what is less than 100 never reads 100."""
    return f"{floor(percent * 100) / 100:g}"


def _row(one: Share) -> tuple[str, ...]:
    wanted = "all" if one.wanted is None else f"{one.wanted:g} %"
    judged = "passed" if one.passed else FAILED
    count = f"{one.held:,} of {one.samples:,}"
    return judged, one.text, f"{figure(one.share)} %", f"{figure(one.bound)} %", wanted, count


def _expectations(found: Certification) -> str:
    if not found.expectations:
        return ""
    rows = [("", "", "share", "at least", "wanted", "samples"), *map(_row, found.expectations)]
    return "Expectations\n" + table(rows, left=2)


def _standing(found: Certification) -> str:
    failing = [one for one in found.standing if not one.passed]
    held = [one for one in found.standing if one.passed and one.judged]
    rows = [_row(one) for one in failing]
    if held:
        bound = figure(min(one.bound for one in held))
        rows.append(
            ("passed", f"{len(held)} others" if failing else f"all {len(held)}", "100 %", f"{bound} %", "all", "")
        )
    unjudged = sum(one.passed and not one.judged for one in found.standing)
    remark = f"  {unjudged} more are judged in no sample\n" if unjudged else ""
    return "Standing expectations\n" + (table(rows, left=2) if rows else "") + remark


def _metrics(found: Certification) -> str:
    rows: list[tuple[str, ...]] = [("", *COLUMNS)]
    for loop, metrics in found.metrics.items():
        for name, one in metrics.items():
            if one["count"]:
                unit = METRIC_UNITS.get(name, "")
                fewer = "" if one["count"] == found.samples else f" ({one['count']:,} samples)"
                rows.append((f"{loop} {name}{fewer}", *(f"{one[column]:.4g}{unit}" for column in COLUMNS)))
    return "Metrics\n" + table(rows, left=1) if len(rows) > 1 else ""


def _effects(found: Certification) -> str:
    if not found.effects:
        return ""
    rows: list[tuple[str, ...]] = [("", "varies", "lowest fifth", "highest fifth")]
    rows += [(e.label, e.text, *(_or_none(share) for share in (e.lowest, e.highest))) for e in found.effects]
    return "What matters: samples in which everything holds\n" + table(rows, left=2)


def _or_none(share: float | None) -> str:
    return "-" if share is None else f"{figure(share)} %"


def _worst(file: str, found: Certification, written: Mapping[tuple[str, int], str]) -> str:
    rows = []
    for one in found.worst:
        values = ", ".join(f"{name} {value:.4g}" for name, value in one.numbers.items())
        about = one.expectation or ("fails" if one.failed else "no number tells")
        near = "" if one.margin is None else f"{abs(one.margin) * 100:.3g} % {'beyond' if one.failed else 'within'} "
        rows.append((f"sample {one.sample}", f"{near}{about}", values))
    names = [written[file, one.sample] for one in found.worst if (file, one.sample) in written]
    files = f"  as {', '.join(names)}\n" if names else ""
    return "Worst samples\n" + table(rows) + files if rows else ""


def verdict_line(outcome: Outcome, found: Certification) -> str:
    """How a batch went, in one line."""
    if outcome.unjudged:
        return f"{FAILED}: the configuration has errors, and nothing is expected of the runs"
    failed, total = sum(not one.passed for one in found.expectations), len(found.expectations)
    standing = sum(not one.passed for one in found.standing)
    parts = [f"{failed} of {total} expectations not shown"] * (failed > 0)
    parts += [f"{standing} standing ones failed"] * (standing > 0)
    parts += [f"{found.failed_to_run:,} samples cannot run, {reason}" for reason in found.reasons[:1]]
    if parts:
        return f"{FAILED}: {'; '.join(parts)}"
    return f"passed: {total} of {total} expectations shown, and all standing ones, in {found.samples:,} samples"
