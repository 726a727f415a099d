"""Batches of samples in the formats of ``pidcfg certify``: text for people, JSON, and JUnit's XML."""

from __future__ import annotations

from math import floor
from typing import TYPE_CHECKING

from pidcfg.cli.formats.findings import display_name
from pidcfg.cli.formats.findings import text as findings_text
from pidcfg.cli.formats.runs import FAILED, METRIC_UNITS, NOT_PROVEN, Case, document, entry, figure_text, table
from pidcfg.output.runs import batches_data
from pidcfg.text.diagnostics import Severity
from pidcfg.text.signs import to_one_line
from pidcfg.text.writer import json_text

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from pidcfg.study.certification.certify import BatchOutcome, Certification, Share

SampleFiles = dict[tuple[str, int], str]
"""Files of samples, by scenario file and number."""


def render_batches(name: str, outcomes: Sequence[BatchOutcome], written: SampleFiles, *, tables: bool = False) -> str:
    """The batches in one of the formats; ``tables``: the text has metrics, and the numbers of the worst samples."""
    if name == "json":
        return json_text(batches_data(outcomes, written), allow_nan=False)
    return junit(outcomes) if name == "junit" else batches_text(outcomes, written, tables=tables)


# --- Text that is read in ten seconds: shares and bounds, what mattered, what was worst -------------------------------

COLUMNS = ("mean", "p5", "p50", "p95", "p99", "max")
"""Of each metric; JSON has more."""
MOST_EFFECTS = 5
"""Of what varies, that the short text lists."""
VERBOSE_HINT = "-v has metrics, counts, and the numbers of every sample that is listed\n"


def batches_text(outcomes: Sequence[BatchOutcome], written: Mapping[tuple[str, int], str], *, tables: bool) -> str:
    """One section a scenario."""
    return "\n".join(_section(outcome, written, tables=tables) for outcome in outcomes)


def _section(outcome: BatchOutcome, written: Mapping[tuple[str, int], str], *, tables: bool) -> str:
    found = outcome.certification
    findings = findings_text(outcome.findings, outcome.documents, brief=not tables).rstrip("\n")
    if found is None:
        return f"{to_one_line(outcome.file)}: cannot run\n\n{findings}\n"
    head = (
        f"{to_one_line(found.scenario)}\n  {to_one_line(f'{outcome.file} runs {outcome.config}')}\n"
        f"  {found.samples:,} samples of seed {found.seed}; each bound holds by itself, at 95 % confidence\n"
    )
    parts = [
        head,
        findings and f"{findings}\n",
        _shares(found, tables=tables),
        _metrics(found) if tables else "",
        _effects(found, tables=tables),
        _worst(outcome.file, found, written, tables=tables),
        ("" if tables else VERBOSE_HINT) + batch_verdict_line(outcome, found) + "\n",
    ]
    return "\n".join(part for part in parts if part)


def figure(percent: float) -> str:
    """A share in %, cut off: what is less than 100 never reads 100."""
    return f"{floor(percent * 100) / 100:g}"


def _shares(found: Certification, *, tables: bool) -> str:
    """What is expected, then what is always checked: the share that holds, and its bound."""
    failing = [one for one in found.standing if not one.passed]
    held = [one for one in found.standing if one.passed and one.judged]
    rows = [("", "share", "at least", "wanted", "samples", ""), *map(_row, (*found.expectations, *failing))]
    if held:
        bound = figure(min(one.lower_bound for one in held))
        named = f"{len(held)} others that are" if failing else f"all {len(held)} that are"
        rows.append(("passed", "100 %", f"{bound} %", "all", "", f"{named} always checked"))
    said = _text_table([row if tables else (*row[:4], row[5]) for row in rows])
    unjudged = sum(one.passed and not one.judged for one in found.standing)
    remark = f"  {unjudged} more are judged in no sample\n" if unjudged else ""
    return said + remark + "".join(map(_shortfall, found.expectations))


def _text_table(rows: Sequence[Sequence[str]]) -> str:
    """Columns of numbers, and behind them a text of any length."""
    return table(rows, right=len(rows[0]) - 1)


def _row(one: Share) -> tuple[str, ...]:
    wanted = "all" if one.wanted is None else f"{one.wanted:g} %"
    judged = "passed" if one.passed else FAILED if one.failed else NOT_PROVEN
    count = f"{one.held:,} of {one.samples:,}"
    return judged, f"{figure(one.share)} %", f"{figure(one.lower_bound)} %", wanted, count, one.text


def _shortfall(one: Share) -> str:
    """What an expectation with a share lacks; nothing where it is proven."""
    if one.passed or one.wanted is None:
        return ""
    said = (
        f"{figure(one.share)} % of {one.samples:,} samples, so at least {figure(one.lower_bound)} %; {one.requirement}"
    )
    return f"  {to_one_line(f'{one.text}: {said}')}\n"


def _metrics(found: Certification) -> str:
    rows: list[tuple[str, ...]] = [("", *COLUMNS)]
    for loop, metrics in found.metrics.items():
        for name, one in metrics.items():
            if one["count"]:
                unit = METRIC_UNITS.get(name, "")
                fewer = "" if one["count"] == found.samples else f" ({one['count']:,} samples)"
                rows.append((f"{loop} {name}{fewer}", *(f"{figure_text(one[column])}{unit}" for column in COLUMNS)))
    return "Metrics\n" + table(rows, left=1) if len(rows) > 1 else ""


def _effects(found: Certification, *, tables: bool) -> str:
    if not found.effects:
        return "Only the noise varies: the plants are those of the file, and nothing is shown of others (vary)\n"
    shown = found.effects[: None if tables else MOST_EFFECTS]
    rows: list[tuple[str, ...]] = [("lowest fifth", "highest fifth", "of what varies")]
    rows += [(*map(_share_text, (e.lowest, e.highest)), f"{e.label}, {e.text}") for e in shown]
    more = len(found.effects) - len(shown)
    others = f"  {more} more vary and matter less\n" if more else ""
    return "What matters: samples in which everything holds\n" + _text_table(rows) + others


def _share_text(share: float | None) -> str:
    return "-" if share is None else f"{figure(share)} %"


def _worst(file: str, found: Certification, written: Mapping[tuple[str, int], str], *, tables: bool) -> str:
    """The worst samples; with their numbers where they are asked for, or where one has failed that should not."""
    rows: list[tuple[str, ...]] = []
    lines = tables or not found.passed
    for one in found.worst:
        about = one.expectation or ("fails" if one.failed else "no number tells")
        near = "" if one.margin is None else f"{abs(one.margin) * 100:.3g} % {'beyond' if one.failed else 'within'} "
        rows.append((f"sample {one.sample}", f"{near}{about}"))
        if lines and one.numbers:
            rows.append(("", ", ".join(f"{name} {value:.4g}" for name, value in one.numbers.items())))
    names = [written[file, one.sample] for one in found.worst if (file, one.sample) in written]
    files = f"  as {', '.join(names)}\n" if names else ""
    return "Worst samples\n" + table(rows) + files if rows else ""


def batch_verdict_line(outcome: BatchOutcome, found: Certification) -> str:
    """How a batch went, in one line."""
    if outcome.unjudged:
        return f"{FAILED}: the configuration has errors, and nothing is expected of the runs"
    failed, total = sum(one.failed for one in found.expectations), len(found.expectations)
    open_ones, checked = sum(not one.passed for one in found.expectations) - failed, len(found.standing)
    broken = sum(one.failed for one in found.standing)
    unproven = sum(not one.passed for one in found.standing) - broken
    parts = [f"{failed} of {total} expectations failed"] * (failed > 0)
    parts += [f"{open_ones} of {total} expectations not proven"] * (open_ones > 0)
    parts += [f"{broken} of {checked} always checked failed"] * (broken > 0)
    parts += [f"{unproven} of {checked} always checked not proven"] * (unproven > 0)
    parts += [f"{found.failed_to_run:,} samples cannot run, {reason}" for reason in found.reasons[:1]]
    if parts:
        return f"{FAILED if failed or broken or found.failed_to_run else NOT_PROVEN}: {'; '.join(parts)}"
    return f"passed: {total} of {total} expectations, and all that is always checked, in {found.samples:,} samples"


# --- JUnit: a suite a scenario ----------------------------------------------------------------------------------------


def junit(outcomes: Sequence[BatchOutcome]) -> str:
    """A suite a scenario: whether all samples ran, then each expectation, the standing ones last."""
    return document("pidcfg certify", {display_name(one.file): list(_cases(one)) for one in outcomes})


def _cases(outcome: BatchOutcome) -> Iterator[Case]:
    found = outcome.certification
    errors = [d for d in outcome.findings if d.severity is Severity.ERROR]
    if found is None:
        yield Case("the samples run", errors=tuple(entry(d) for d in errors))
        return
    failures = tuple(entry(d) for d in errors) if outcome.unjudged else ()
    if found.failed_to_run:
        message = f"{found.failed_to_run:,} of {found.samples:,} samples cannot run"
        failures += (("error PID062", message, "\n".join(found.reasons)),)
    yield Case("the samples run", failures)
    for one in (*found.expectations, *found.standing):
        yield _batch_case(one, found)


def _batch_case(one: Share, found: Certification) -> Case:
    said = f"{one.held:,} of {one.samples:,} samples, so at least {figure(one.lower_bound)} %"
    if one.judged == 0 and not found.failed_to_run:
        return Case(one.text, skipped="not judged in any sample")
    if one.passed:
        return Case(one.text, output=said)
    return Case(one.text, (("error PID061" if one.failed else "not-proven", f"{said}; {one.requirement}", said),))
