"""``pidcfg compare``: configurations against the PLC that they are for."""

from __future__ import annotations

import time
from datetime import datetime
from typing import TYPE_CHECKING

import click

from pidcfg.cli import options, plc_options
from pidcfg.cli.arguments import usage
from pidcfg.cli.formats import render, report_options
from pidcfg.cli.formats.findings import Findings
from pidcfg.cli.main import Exit
from pidcfg.cli.terminal.console import note, show

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from pidcfg.diagnostics import Diagnostic
    from pidcfg.document import Document
    from pidcfg.limits import Limits
    from pidcfg.live.compare import CompareResult

EPILOG = options.examples(
    "pidcfg compare reactor.yaml --plc modbus://10.0.0.5",
    "pidcfg compare line-1.yaml line-2.yaml --plc modbus://10.0.0.6 --report-output junit=compare.xml",
    "pidcfg compare reactor.yaml --plc modbus://10.0.0.5 --watch 60",
)
PEOPLE = ("text", "concise")
"""Formats in which a PLC that is not reached is one line on standard error."""


@click.command("compare", epilog=EPILOG)
@click.argument("files", nargs=-1, required=True, metavar="FILE…")
@plc_options.PLC
@options.MAP
@report_options.report_format("compare")
@report_options.report_files("compare")
@click.option(
    "--watch",
    type=click.FloatRange(min=0.1),
    metavar="SECONDS",
    help="Compare again and again, and print what changes with its time, until Ctrl-C.",
)
@plc_options.TIMEOUT
@plc_options.RETRIES
@options.QUIET
@options.LIMITS
def command(
    files: tuple[str, ...],
    plc: str,
    stated: str | None,
    fmt: str,
    reports: tuple[report_options.Report, ...],
    watch: float | None,
    timeout: float,
    retries: int,
    quiet: bool,
    limits: Limits,
) -> None:
    """Compare configurations with the PLC that they are for: exit 0 alike, 1 different, 2 not reached.

    What runs is left out: PV, output, mode, status, requests, the bias of a loop with an integral. A set point that the
    operator has changed is told and is no difference. The PLC is only read.
    """
    plc_options.needed(plc)
    from pidcfg.cli.findings.collect import one_configuration
    from pidcfg.encoders.map_rows import UnusableMapError
    from pidcfg.live.calls import compare
    from pidcfg.live.errors import PlcError

    documents = {doc.file: doc for doc in (one_configuration(name, limits) for name in files)}
    report_options.refuse_inputs(reports, files)

    registers = plc_options.map_file(stated, limits)

    def compared() -> list[CompareResult]:
        with usage():
            return [
                compare(doc, plc, map=registers, timeout=timeout, retries=retries, limits=limits)
                for doc in documents.values()
            ]

    try:
        results = compared()
    except UnusableMapError as error:
        raise click.ClickException(str(error)) from None
    except PlcError as error:
        raise _not_reached(error, documents, fmt, reports) from None
    findings = [d for result in results for d in result.findings]
    shown = Findings(findings, documents, command="compare")
    report_options.deliver(fmt, reports, lambda name: render(name, shown))
    for line in () if quiet else (line for result in results for line in result.notes):
        note(f"note: {line}")
    if fmt in PEOPLE and not quiet:
        note(_summary(results))
    code = exit_code(results)
    if watch is not None and code != Exit.UNUSABLE:
        code = _watched(compared, findings, watch)
    click.get_current_context().exit(code)


def exit_code(results: Sequence[CompareResult]) -> Exit:
    """A file that cannot be compared outweighs a difference."""
    if not all(result.ok for result in results):
        return Exit.UNUSABLE
    return Exit.OK if all(result.same for result in results) else Exit.FINDINGS


def _not_reached(
    error: Exception, documents: Mapping[str, Document], fmt: str, reports: Sequence[report_options.Report]
) -> click.exceptions.Exit | click.ClickException:
    """A PLC that is not reached: one line for people, and in reports an error of each file."""
    from pidcfg.live.compare import not_reached

    shown = Findings([not_reached(name, str(error)) for name in documents], documents, command="compare")
    if fmt in PEOPLE:
        report_options.write_reports(reports, lambda name: render(name, shown))
        return click.ClickException(str(error))
    report_options.deliver(fmt, reports, lambda name: render(name, shown))
    return click.exceptions.Exit(Exit.UNUSABLE)


def _summary(results: Sequence[CompareResult]) -> str:
    count = sum(len(result.findings) for result in results)
    files = f"{len(results)} file{'s' if len(results) > 1 else ''} compared with {results[0].plc}"
    return f"{files}: {count} difference{'s' if count > 1 else ''}" if count else f"{files}: alike"


def _watched(compared: Callable[[], Sequence[CompareResult]], findings: Sequence[Diagnostic], seconds: float) -> Exit:
    """Goes on comparing; prints what comes and goes with its time. The exit code is that of the last comparison."""
    from pidcfg.live.errors import PlcError

    seen = {_row(d) for d in findings}
    code, fault = (Exit.FINDINGS if findings else Exit.OK), ""
    note(f"comparing every {seconds:g} s; Ctrl-C ends")
    try:
        while True:
            time.sleep(seconds)
            try:
                results = compared()
            except PlcError as error:
                if str(error) != fault:
                    show(f"{_now()} {error}\n")
                code, fault = Exit.UNUSABLE, str(error)
                continue
            now = {_row(d) for result in results for d in result.findings}
            lines = [f"{_now()} reached again\n"] if fault else []
            lines += [f"{_now()} differs: {row}\n" for row in sorted(now - seen)]
            lines += [f"{_now()} no longer: {row}\n" for row in sorted(seen - now)]
            show("".join(lines))
            seen, code, fault = now, exit_code(results), ""
    except KeyboardInterrupt:
        note(f"stopped; the last comparison ended with exit code {code}")
    return code


def _row(d: Diagnostic) -> str:
    loop = f" [{d.loop}]" if d.loop else ""
    return f"{d.file}:{d.span.line}:{d.span.column}: {d.message}{loop}"


def _now() -> str:
    return datetime.now().astimezone().isoformat(" ", "seconds")
