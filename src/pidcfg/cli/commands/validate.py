"""``pidcfg validate``: all findings of all files."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from pidcfg.cli import options, settings, watch
from pidcfg.cli.console import Detail, echo, note, remark
from pidcfg.cli.formats import findings as findings_format
from pidcfg.cli.formats import render, report_options
from pidcfg.cli.formats.findings import Findings, summary
from pidcfg.cli.inputs import STDIN, excluded_text, exclusion_reasons, gather
from pidcfg.cli.settings import EXCLUDE_REASON
from pidcfg.cli.terminal import progress
from pidcfg.text.diagnostics import Diagnostic, Severity

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.cli.inputs import Input
    from pidcfg.cli.policy import Triage
    from pidcfg.text.document import Document
    from pidcfg.text.reader import Limits

EPILOG = options.examples(
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
@options.EXCLUDE
@options.SELECT
@options.IGNORE
@options.SEVERITY
@options.STRICT
@settings.baseline_options
@settings.FIX
@settings.DIFF
@settings.CONFIG
@settings.ISOLATED
@settings.SHOW
@click.option("--no-cache", is_flag=True, envvar="PIDCFG_NO_CACHE", help="Check every file anew.")
@findings_format.OPTION
@options.STDIN_FILENAME
@watch.OPTION
@options.VERBOSE
@options.QUIET
@options.LIMITS
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
    from pidcfg.cli.policy import Rules, count, triage

    ctx = click.get_current_context()
    detail = Detail(ctx, wanted=verbose, quiet=quiet)
    if show_settings:
        echo(settings.describe(ctx))
        return
    detail.say(f"settings: {settings.current(ctx).file or 'none'}")
    documents: dict[str, Document] = {}
    findings: list[Diagnostic] = []
    gathered = list(gather(paths, limits, skip_foreign=skip_foreign))
    inputs = [entry for entry in gathered if not entry.foreign]
    skipped = [entry.name for entry in gathered if entry.foreign and entry.remark is entry.left_out is None]
    report_options.refuse_inputs(reports, (entry.name for entry in inputs))
    read = [name for name in (baseline["baseline"], settings.current(ctx).file) if name is not None]
    report_options.refuse_inputs(reports, read)
    printed = findings_format.fmt_of(ctx, fmt) if counted else fmt
    if fix or diff:
        from pidcfg.cli.policy import fix_inputs, refuse_options

        refuse_options(ctx, reports)
        inputs = fix_inputs(inputs, Rules(select, ignore), ctx)
    for doc, of_file in progress(check_all(inputs, limits, cached=not no_cache), "checking", len(inputs)):
        documents[doc.file] = doc
        findings += of_file
        detail.say(f"read {doc.file}: {count(len(of_file), 'finding')}")
    left = triage(findings, documents, settings.current(ctx), Rules(select, ignore, **baseline))
    fails = Severity.WARNING if strict else Severity.ERROR
    hidden = left.suppressed(Severity[severity.upper()])
    shown = Findings(options.severe(left.kept, severity, fails), documents, fails, hidden, brief=not verbose)
    piped = fix and STDIN in paths  # standard output is the corrected text
    if counted:
        report_options.put(printed, findings_format.render(printed, shown), aside=piped)
        report_options.write_reports(reports, lambda name: render(name, shown))
    else:
        report_options.deliver(fmt, reports, lambda name: render(name, shown), aside=piped)
    remarks = [f"{entry.name}: {entry.remark}" for entry in gathered if entry.remark is not None]
    for text in () if quiet else (*remarks, *left.remarks):
        remark(text)
    detail.listed("left out, without a pidcfg key:", skipped)
    detail.say(*exclusion_reasons(gathered))
    detail.listed("not reported:", left.reasons)
    detail.end()
    if not quiet or _hides(ctx, left, shown, gathered):
        opened = sum(entry.problem is None for entry in inputs)
        note(_summary_line(ctx, left, opened, len(skipped), gathered))
    _next_step(list(documents.values()), left.kept, quiet=quiet, fmt=fmt)
    ctx.exit(exit_code(left.kept, strict=strict))


def _summary_line(ctx: click.Context, left: Triage, opened: int, skipped: int, gathered: Sequence[Input]) -> str:
    """How it went, what was left out, and which settings are in force."""
    line = summary(left.kept, opened, skipped, excluded_text(gathered))
    return line + left.counts + settings.current(ctx).mention


def _hides(ctx: click.Context, left: Triage, shown: Findings, gathered: Sequence[Input]) -> bool:
    """Whether even a quiet run says what was left out: findings, or files by a settings file."""
    less = settings.current(ctx).file is not None and len(shown.reported) < len(left.kept)
    return left.hides or less or any((entry.left_out or "").startswith(EXCLUDE_REASON) for entry in gathered)


def _next_step(documents: Sequence[Document], findings: Sequence[Diagnostic], *, quiet: bool, fmt: str) -> None:
    """After one file: what its first error means, or how it behaves."""
    from pidcfg.cli.console import next_step

    worst = next((d for d in findings if d.severity is Severity.ERROR), None)
    if worst is not None:
        next_step("rule", worst.code, quiet=quiet, fmt=fmt)
    elif len(documents) == 1 and documents[0].file != STDIN:
        next_step("simulate", documents[0].file, quiet=quiet, fmt=fmt)
