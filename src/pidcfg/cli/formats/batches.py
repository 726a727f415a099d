"""Batches of samples in the formats of ``pidcfg certify``: text for people, JSON, and JUnit's XML."""

from __future__ import annotations

from math import floor
from typing import TYPE_CHECKING

from pidcfg.cli.formats.findings import display_name, findings_text
from pidcfg.cli.formats.runs import (
    FAILED,
    METRIC_UNITS,
    NOT_PROVEN,
    TestCase,
    align_columns,
    failure_entry,
    four_digits,
    junit_document,
)
from pidcfg.output.runs import batches_data
from pidcfg.text.diagnostics import Severity
from pidcfg.text.signs import to_one_line
from pidcfg.text.writer import json_text

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from pidcfg.study.certification.certify import BatchOutcome, Certification, Share

SampleFiles = dict[tuple[str, int], str]
"""Files of samples, by scenario file and number."""


def render_batches(
    name: str, outcomes: Sequence[BatchOutcome], sample_files: SampleFiles, *, tables: bool = False
) -> str:
    """The batches in one of the formats; ``tables``: the text has metrics, and the numbers of the worst samples."""
    if name == "json":
        return json_text(batches_data(outcomes, sample_files), allow_nan=False)
    return batches_junit(outcomes) if name == "junit" else batches_text(outcomes, sample_files, tables=tables)


# --- Text that is read in ten seconds: shares and bounds, what mattered, what was worst -------------------------------

METRIC_COLUMNS = ("mean", "p5", "p50", "p95", "p99", "max")
"""Of each metric; JSON has more."""
MAX_EFFECTS = 5
"""Of what varies, that the short text lists."""
VERBOSE_HINT = "-v has metrics, counts, and the numbers of every sample that is listed\n"


def batches_text(outcomes: Sequence[BatchOutcome], sample_files: Mapping[tuple[str, int], str], *, tables: bool) -> str:
    """One section a scenario."""
    return "\n".join(_batch_text(outcome, sample_files, tables=tables) for outcome in outcomes)


def _batch_text(outcome: BatchOutcome, sample_files: Mapping[tuple[str, int], str], *, tables: bool) -> str:
    batch = outcome.certification
    findings = findings_text(outcome.findings, outcome.documents, brief=not tables).rstrip("\n")
    if batch is None:
        return f"{to_one_line(outcome.file)}: cannot run\n\n{findings}\n"
    head = (
        f"{to_one_line(batch.scenario)}\n  {to_one_line(f'{outcome.file} runs {outcome.config}')}\n"
        f"  {batch.samples:,} samples of seed {batch.seed}; each bound holds by itself, at 95 % confidence\n"
    )
    parts = [
        head,
        findings and f"{findings}\n",
        _shares_table(batch, tables=tables),
        _metrics_table(batch) if tables else "",
        _effects_table(batch, tables=tables),
        _worst_table(outcome.file, batch, sample_files, tables=tables),
        ("" if tables else VERBOSE_HINT) + batch_verdict_line(outcome, batch) + "\n",
    ]
    return "\n".join(part for part in parts if part)


def share_figure(percent: float) -> str:
    """A share in %, cut off: what is less than 100 never reads 100."""
    return f"{floor(percent * 100) / 100:g}"


def _shares_table(batch: Certification, *, tables: bool) -> str:
    """What is expected, then what is always checked: the share that holds, and its bound."""
    failing = [share for share in batch.standing if not share.passed]
    passed = [share for share in batch.standing if share.passed and share.judged]
    rows = [("", "share", "at least", "wanted", "samples", ""), *map(_share_row, (*batch.expectations, *failing))]
    if passed:
        bound = share_figure(min(share.bound for share in passed))
        names_text = f"{len(passed)} others that are" if failing else f"all {len(passed)} that are"
        rows.append(("passed", "100 %", f"{bound} %", "all", "", f"{names_text} always checked"))
    table_text = _text_table([row if tables else (*row[:4], row[5]) for row in rows])
    unjudged = sum(share.passed and not share.judged for share in batch.standing)
    remark = f"  {unjudged} more are judged in no sample\n" if unjudged else ""
    return table_text + remark + "".join(map(_shortfall_line, batch.expectations))


def _text_table(rows: Sequence[Sequence[str]]) -> str:
    """Columns of numbers, and behind them a text of any length."""
    return align_columns(rows, right=len(rows[0]) - 1)


def _share_row(share: Share) -> tuple[str, ...]:
    wanted_text = "all" if share.wanted is None else f"{share.wanted:g} %"
    verdict = "passed" if share.passed else FAILED if share.failed else NOT_PROVEN
    count = f"{share.held:,} of {share.samples:,}"
    return (
        verdict,
        f"{share_figure(share.share)} %",
        f"{share_figure(share.bound)} %",
        wanted_text,
        count,
        share.text,
    )


def _shortfall_line(share: Share) -> str:
    """What an expectation with a share lacks; nothing where it is proven."""
    if share.passed or share.wanted is None:
        return ""
    held, bound = share_figure(share.share), share_figure(share.bound)
    shortfall = f"{held} % of {share.samples:,} samples, so at least {bound} %; {share.requirement}"
    return f"  {to_one_line(f'{share.text}: {shortfall}')}\n"


def _metrics_table(batch: Certification) -> str:
    rows: list[tuple[str, ...]] = [("", *METRIC_COLUMNS)]
    for loop, metrics in batch.metrics.items():
        for name, values in metrics.items():
            if values["count"]:
                unit = METRIC_UNITS.get(name, "")
                count_text = "" if values["count"] == batch.samples else f" ({values['count']:,} samples)"
                rows.append(
                    (
                        f"{loop} {name}{count_text}",
                        *(f"{four_digits(values[column])}{unit}" for column in METRIC_COLUMNS),
                    )
                )
    return "Metrics\n" + align_columns(rows, left=1) if len(rows) > 1 else ""


def _effects_table(batch: Certification, *, tables: bool) -> str:
    if not batch.effects:
        return "Only the noise varies: the plants are those of the file, and nothing is shown of others (vary)\n"
    effects = batch.effects[: None if tables else MAX_EFFECTS]
    rows: list[tuple[str, ...]] = [("lowest fifth", "highest fifth", "of what varies")]
    rows += [(*map(_share_text, (e.lowest, e.highest)), f"{e.label}, {e.text}") for e in effects]
    more = len(batch.effects) - len(effects)
    others = f"  {more} more vary and matter less\n" if more else ""
    return "What matters: samples in which everything holds\n" + _text_table(rows) + others


def _share_text(share: float | None) -> str:
    return "-" if share is None else f"{share_figure(share)} %"


def _worst_table(file: str, batch: Certification, sample_files: Mapping[tuple[str, int], str], *, tables: bool) -> str:
    """The worst samples; with their numbers where they are asked for, or where one has failed that should not."""
    rows: list[tuple[str, ...]] = []
    has_numbers = tables or not batch.passed
    for sample in batch.worst:
        expectation = sample.expectation or ("fails" if sample.failed else "no number tells")
        margin = (
            ""
            if sample.margin is None
            else f"{abs(sample.margin) * 100:.3g} % {'beyond' if sample.failed else 'within'} "
        )
        rows.append((f"sample {sample.sample}", f"{margin}{expectation}"))
        if has_numbers and sample.numbers:
            rows.append(("", ", ".join(f"{name} {value:.4g}" for name, value in sample.numbers.items())))
    names = [sample_files[file, sample.sample] for sample in batch.worst if (file, sample.sample) in sample_files]
    files = f"  as {', '.join(names)}\n" if names else ""
    return "Worst samples\n" + align_columns(rows) + files if rows else ""


def batch_verdict_line(outcome: BatchOutcome, batch: Certification) -> str:
    """How a batch went, in one line."""
    if outcome.lacks_expectations:
        return f"{FAILED}: the configuration has errors, and nothing is expected of the runs"
    failed, total = sum(share.failed for share in batch.expectations), len(batch.expectations)
    not_proven, checked = sum(not share.passed for share in batch.expectations) - failed, len(batch.standing)
    standing_failed = sum(share.failed for share in batch.standing)
    standing_not_proven = sum(not share.passed for share in batch.standing) - standing_failed
    parts = [f"{failed} of {total} expectations failed"] * (failed > 0)
    parts += [f"{not_proven} of {total} expectations not proven"] * (not_proven > 0)
    parts += [f"{standing_failed} of {checked} always checked failed"] * (standing_failed > 0)
    parts += [f"{standing_not_proven} of {checked} always checked not proven"] * (standing_not_proven > 0)
    parts += [f"{batch.failed_to_run:,} samples cannot run, {reason}" for reason in batch.reasons[:1]]
    if parts:
        return f"{FAILED if failed or standing_failed or batch.failed_to_run else NOT_PROVEN}: {'; '.join(parts)}"
    return f"passed: {total} of {total} expectations, and all that is always checked, in {batch.samples:,} samples"


# --- JUnit: a suite a scenario ----------------------------------------------------------------------------------------


def batches_junit(outcomes: Sequence[BatchOutcome]) -> str:
    """A suite a scenario: whether all samples ran, then each expectation, the standing ones last."""
    return junit_document("pidcfg certify", {display_name(one.file): list(_junit_cases(one)) for one in outcomes})


def _junit_cases(outcome: BatchOutcome) -> Iterator[TestCase]:
    batch = outcome.certification
    errors = [d for d in outcome.findings if d.severity is Severity.ERROR]
    if batch is None:
        yield TestCase("the samples run", errors=tuple(failure_entry(d) for d in errors))
        return
    failures = tuple(failure_entry(d) for d in errors) if outcome.lacks_expectations else ()
    if batch.failed_to_run:
        message = f"{batch.failed_to_run:,} of {batch.samples:,} samples cannot run"
        failures += (("error PID062", message, "\n".join(batch.reasons)),)
    yield TestCase("the samples run", failures)
    for share in (*batch.expectations, *batch.standing):
        yield _batch_case(share, batch)


def _batch_case(share: Share, batch: Certification) -> TestCase:
    result = f"{share.held:,} of {share.samples:,} samples, so at least {share_figure(share.bound)} %"
    if share.judged == 0 and not batch.failed_to_run:
        return TestCase(share.text, skipped="not judged in any sample")
    if share.passed:
        return TestCase(share.text, output=result)
    return TestCase(
        share.text, (("error PID061" if share.failed else "not-proven", f"{result}; {share.requirement}", result),)
    )
