"""``pidcfg validate``: all findings of all files."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from pidcfg.cli import options, settings, watch
from pidcfg.cli.console import VerboseLog, echo, write_note, write_remark
from pidcfg.cli.formats import findings as findings_format
from pidcfg.cli.formats import render_findings, report_options
from pidcfg.cli.formats.findings import Findings, summary_line
from pidcfg.cli.inputs import STDIN, excluded_text, exclusion_reasons, gather_inputs
from pidcfg.cli.settings import EXCLUDE_REASON
from pidcfg.cli.terminal import progress
from pidcfg.text.diagnostics import Diagnostic, Severity

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.cli.inputs import Input
    from pidcfg.cli.policy import Triage
    from pidcfg.text.document import Document
    from pidcfg.text.reader import Limits

EPILOG = options.examples_text(
    "pidcfg validate reactor.yaml",
    "pidcfg validate loops/ --severity warning --strict",
    "pidcfg validate *.yaml --format json --ignore DL220",
    "pidcfg validate loops/ --report-output sarif=pidcfg.sarif",
)


@click.command("validate", cls=watch.WatchCommand, epilog=EPILOG)
@click.argument("paths", nargs=-1, required=True, is_eager=True, callback=settings.apply_settings)
@report_options.report_format("validate")
@report_options.report_files("validate", "--output")
@click.option("--skip-foreign", is_flag=True, help="Leave out named files without a pidcfg key, as folders do.")
@options.EXCLUDE_OPTION
@options.SELECT_OPTION
@options.IGNORE_OPTION
@options.SEVERITY_OPTION
@options.STRICT_OPTION
@settings.baseline_options
@settings.FIX_OPTION
@settings.DIFF_OPTION
@settings.CONFIG_OPTION
@settings.ISOLATED_OPTION
@settings.SHOW_OPTION
@click.option("--no-cache", is_flag=True, envvar="PIDCFG_NO_CACHE", help="Check every file anew.")
@findings_format.STATISTICS_OPTION
@options.STDIN_FILENAME_OPTION
@watch.WATCH_OPTION
@options.VERBOSE_OPTION
@options.QUIET_OPTION
@options.LIMITS_OPTION
@options.exit_zero
def command(
    paths: tuple[str, ...],
    fmt: str,
    reports: tuple[report_options.Report, ...],
    select: list[str],
    ignore: list[str],
    skip_foreign: bool,
    severity: str,
    strict: bool,
    verbose: bool,
    quiet: bool,
    limits: Limits,
    fix: bool,
    diff: bool,
    show_settings: bool,
    no_cache: bool,
    count_only: bool,
    **baseline: Any,
) -> None:
    """Find every mistake in PATHS: configurations, scenarios, folders of them, or - for standard input."""
    from pidcfg.cli.findings import check_all, exit_code
    from pidcfg.cli.policy import Rules, count_text, triage_findings

    ctx = click.get_current_context()
    log = VerboseLog(ctx, verbose=verbose, quiet=quiet)
    if show_settings:
        echo(settings.describe_settings(ctx))
        return
    log.write_lines(f"settings: {settings.current_settings(ctx).file or 'none'}")
    documents: dict[str, Document] = {}
    findings: list[Diagnostic] = []
    gathered = list(gather_inputs(paths, limits, skip_foreign=skip_foreign))
    inputs = [entry for entry in gathered if not entry.is_foreign]
    skipped_names = [entry.name for entry in gathered if entry.is_foreign and entry.remark is entry.reason is None]
    report_options.refuse_inputs(reports, (entry.name for entry in inputs))
    names_read = [name for name in (baseline["baseline"], settings.current_settings(ctx).file) if name is not None]
    report_options.refuse_inputs(reports, names_read)
    stats_fmt = findings_format.statistics_format(ctx, fmt) if count_only else fmt
    if fix or diff:
        from pidcfg.cli.policy import fix_inputs, refuse_options

        refuse_options(ctx, reports)
        inputs = fix_inputs(inputs, Rules(select, ignore), ctx)
    for doc, file_findings in progress(check_all(inputs, limits, use_cache=not no_cache), "checking", len(inputs)):
        documents[doc.file] = doc
        findings += file_findings
        log.write_lines(f"read {doc.file}: {count_text(len(file_findings), 'finding')}")
    triage = triage_findings(findings, documents, settings.current_settings(ctx), Rules(select, ignore, **baseline))
    threshold = Severity.WARNING if strict else Severity.ERROR
    entries = options.select_severe(triage.reported, severity, threshold)
    result = Findings(entries, documents, threshold, triage.suppressed(Severity[severity.upper()]), brief=not verbose)
    is_piped = fix and STDIN in paths  # standard output is the corrected text
    if count_only:
        report_options.print_text(stats_fmt, findings_format.render_statistics(stats_fmt, result), on_stderr=is_piped)
        report_options.write_reports(reports, lambda name: render_findings(name, result))
    else:
        report_options.deliver_reports(fmt, reports, lambda name: render_findings(name, result), on_stderr=is_piped)
    remarks = [f"{entry.name}: {entry.remark}" for entry in gathered if entry.remark is not None]
    for text in () if quiet else (*remarks, *triage.remarks):
        write_remark(text)
    log.write_names("left out, without a pidcfg key:", skipped_names)
    log.write_lines(*exclusion_reasons(gathered))
    log.write_names("not reported:", triage.reasons)
    log.write_time()
    if not quiet or _hides_findings(ctx, triage, result, gathered):
        read_count = sum(entry.problem is None for entry in inputs)
        write_note(_summary_line(ctx, triage, read_count, len(skipped_names), gathered))
    _next_step(list(documents.values()), triage.reported, quiet=quiet, fmt=fmt)
    ctx.exit(exit_code(triage.reported, strict=strict))


def _summary_line(ctx: click.Context, triage: Triage, read_count: int, skipped: int, gathered: Sequence[Input]) -> str:
    """How it went, what was left out, and which settings are in force."""
    line = summary_line(triage.reported, read_count, skipped, excluded_text(gathered))
    return line + triage.counts_text + settings.current_settings(ctx).mention


def _hides_findings(ctx: click.Context, triage: Triage, result: Findings, gathered: Sequence[Input]) -> bool:
    """Whether even a quiet run says what was left out: findings, or files by a settings file."""
    has_hidden = settings.current_settings(ctx).file is not None and len(result.reported) < len(triage.reported)
    return (
        triage.hides_findings
        or has_hidden
        or any((entry.reason or "").startswith(EXCLUDE_REASON) for entry in gathered)
    )


def _next_step(documents: Sequence[Document], findings: Sequence[Diagnostic], *, quiet: bool, fmt: str) -> None:
    """After one file: what its first error means, or how it behaves."""
    from pidcfg.cli.console import suggest_next_step

    worst = next((d for d in findings if d.severity is Severity.ERROR), None)
    if worst is not None:
        suggest_next_step("rule", worst.code, quiet=quiet, fmt=fmt)
    elif len(documents) == 1 and documents[0].file != STDIN:
        suggest_next_step("simulate", documents[0].file, quiet=quiet, fmt=fmt)
