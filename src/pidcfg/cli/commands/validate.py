"""``pidcfg validate``: all findings of all files."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from pidcfg.cli import options, settings, watch
from pidcfg.cli.console import Detail, echo, write_note, write_remark
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
@click.argument("paths", nargs=-1, required=True, is_eager=True, callback=settings.apply)
@report_options.report_format("validate")
@report_options.report_files("validate", "--output")
@click.option("--skip-foreign", is_flag=True, help="Leave out named files without a pidcfg key, as folders do.")
@options.EXCLUDE_OPTION
@options.SELECT_OPTION
@options.IGNORE_OPTION
@options.SEVERITY_OPTION
@options.STRICT_OPTION
@settings.baseline_options
@settings.FIX
@settings.DIFF
@settings.CONFIG
@settings.ISOLATED
@settings.SHOW
@click.option("--no-cache", is_flag=True, envvar="PIDCFG_NO_CACHE", help="Check every file anew.")
@findings_format.STATISTICS_OPTION
@options.STDIN_FILENAME_OPTION
@watch.OPTION
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
    counted: bool,
    **baseline: Any,
) -> None:
    """Find every mistake in PATHS: configurations, scenarios, folders of them, or - for standard input."""
    from pidcfg.cli.findings import check_all, exit_code
    from pidcfg.cli.policy import Rules, count_text, triage_findings

    ctx = click.get_current_context()
    detail = Detail(ctx, wanted=verbose, quiet=quiet)
    if show_settings:
        echo(settings.describe(ctx))
        return
    detail.write_lines(f"settings: {settings.current(ctx).file or 'none'}")
    documents: dict[str, Document] = {}
    findings: list[Diagnostic] = []
    gathered = list(gather_inputs(paths, limits, skip_foreign=skip_foreign))
    inputs = [entry for entry in gathered if not entry.is_foreign]
    skipped = [entry.name for entry in gathered if entry.is_foreign and entry.remark is entry.left_out is None]
    report_options.refuse_inputs(reports, (entry.name for entry in inputs))
    names_read = [name for name in (baseline["baseline"], settings.current(ctx).file) if name is not None]
    report_options.refuse_inputs(reports, names_read)
    printed = findings_format.statistics_format(ctx, fmt) if counted else fmt
    if fix or diff:
        from pidcfg.cli.policy import fix_inputs, refuse_options

        refuse_options(ctx, reports)
        inputs = fix_inputs(inputs, Rules(select, ignore), ctx)
    for doc, file_findings in progress(check_all(inputs, limits, cached=not no_cache), "checking", len(inputs)):
        documents[doc.file] = doc
        findings += file_findings
        detail.write_lines(f"read {doc.file}: {count_text(len(file_findings), 'finding')}")
    triaged = triage_findings(findings, documents, settings.current(ctx), Rules(select, ignore, **baseline))
    fails = Severity.WARNING if strict else Severity.ERROR
    severe = options.select_severe(triaged.reported, severity, fails)
    shown = Findings(severe, documents, fails, triaged.suppressed(Severity[severity.upper()]), brief=not verbose)
    piped = fix and STDIN in paths  # standard output is the corrected text
    if counted:
        report_options.print_text(printed, findings_format.render_statistics(printed, shown), on_stderr=piped)
        report_options.write_reports(reports, lambda name: render_findings(name, shown))
    else:
        report_options.deliver_reports(fmt, reports, lambda name: render_findings(name, shown), on_stderr=piped)
    remarks = [f"{entry.name}: {entry.remark}" for entry in gathered if entry.remark is not None]
    for text in () if quiet else (*remarks, *triaged.remarks):
        write_remark(text)
    detail.write_names("left out, without a pidcfg key:", skipped)
    detail.write_lines(*exclusion_reasons(gathered))
    detail.write_names("not reported:", triaged.reasons)
    detail.write_time()
    if not quiet or _hides(ctx, triaged, shown, gathered):
        opened = sum(entry.problem is None for entry in inputs)
        write_note(_summary_line(ctx, triaged, opened, len(skipped), gathered))
    _next_step(list(documents.values()), triaged.reported, quiet=quiet, fmt=fmt)
    ctx.exit(exit_code(triaged.reported, strict=strict))


def _summary_line(ctx: click.Context, triaged: Triage, opened: int, skipped: int, gathered: Sequence[Input]) -> str:
    """How it went, what was left out, and which settings are in force."""
    line = summary_line(triaged.reported, opened, skipped, excluded_text(gathered))
    return line + triaged.counts_text + settings.current(ctx).mention


def _hides(ctx: click.Context, triaged: Triage, shown: Findings, gathered: Sequence[Input]) -> bool:
    """Whether even a quiet run says what was left out: findings, or files by a settings file."""
    is_less = settings.current(ctx).file is not None and len(shown.reported) < len(triaged.reported)
    return (
        triaged.hides_findings
        or is_less
        or any((entry.left_out or "").startswith(EXCLUDE_REASON) for entry in gathered)
    )


def _next_step(documents: Sequence[Document], findings: Sequence[Diagnostic], *, quiet: bool, fmt: str) -> None:
    """After one file: what its first error means, or how it behaves."""
    from pidcfg.cli.console import next_step

    worst = next((d for d in findings if d.severity is Severity.ERROR), None)
    if worst is not None:
        next_step("rule", worst.code, quiet=quiet, fmt=fmt)
    elif len(documents) == 1 and documents[0].file != STDIN:
        next_step("simulate", documents[0].file, quiet=quiet, fmt=fmt)
