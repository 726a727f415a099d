"""``pidcfg compare``: configurations against the PLC that they are for."""

from __future__ import annotations

import time
from dataclasses import dataclass
from datetime import datetime
from typing import TYPE_CHECKING

import click

from pidcfg.cli import options
from pidcfg.cli.console import note, remark, show
from pidcfg.cli.formats import render, report_options
from pidcfg.cli.formats.findings import Findings
from pidcfg.cli.main import Exit
from pidcfg.cli.options import usage
from pidcfg.text.diagnostics import Severity

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from pidcfg.live.pull import CompareResult
    from pidcfg.text.diagnostics import Diagnostic
    from pidcfg.text.document import Document
    from pidcfg.text.reader import Limits

EPILOG = options.examples(
    "pidcfg compare reactor.yaml --plc modbus://10.0.0.5",
    "pidcfg compare line-1.yaml line-2.yaml --plc modbus://10.0.0.6 --report-output junit=compare.xml",
    "pidcfg compare reactor.yaml --plc modbus://10.0.0.5 --watch 60",
)
PEOPLE = ("text", "concise")
"""Formats in which a PLC that is not reached is one line on standard error."""


@click.command("compare", epilog=EPILOG)
@click.argument("files", nargs=-1, required=True, metavar="FILE…")
@options.PLC
@options.MAP
@report_options.report_format("compare")
@report_options.report_files("compare")
@click.option(
    "--watch",
    type=options.Real(min=0.1),
    metavar="SECONDS",
    help="Compare again and again, and print what changes with its time, until Ctrl-C.",
)
@click.option("--strict", is_flag=True, help="Exit 1 for settings that could not be read, too.")
@options.TIMEOUT
@options.RETRIES
@options.QUIET
@options.LIMITS
@options.exit_zero
def command(
    files: tuple[str, ...],
    plc: str,
    stated: str | None,
    fmt: str,
    reports: tuple[report_options.Report, ...],
    watch: float | None,
    strict: bool,
    timeout: float,
    retries: int,
    quiet: bool,
    limits: Limits,
) -> None:
    """Compare configurations with the PLC that they are for: exit 0 alike, 1 different, 2 not reached.

    Settings that no register has are named; they may differ.

    What runs is left out: PV, output, mode, status, requests, the bias of a loop with an integral. A set point that the
    operator has changed is told and is no difference. The PLC is only read.
    """
    options.require_packages(plc)
    from pidcfg.cli.findings import one_configuration
    from pidcfg.encoders.modbus_map import UnusableMapError
    from pidcfg.live.calls import compare

    documents = {doc.file: doc for doc in (one_configuration(name, limits) for name in files)}
    report_options.refuse_inputs(reports, files)

    registers = options.map_file(stated, limits)

    def compared() -> ComparisonRound:
        with usage():
            return compare_once(
                documents,
                lambda doc: compare(doc, plc, map=registers, timeout=timeout, retries=retries, limits=limits),
            )

    try:
        first = compared()
    except UnusableMapError as error:
        raise click.ClickException(str(error)) from None
    fails = Severity.WARNING if strict else Severity.ERROR
    shown = Findings(first.shown(fmt), documents, fails, command="compare")
    full = Findings(first.shown(), documents, fails, command="compare")
    if first.results or fmt not in PEOPLE:
        report_options.deliver(fmt, (), lambda name: render(name, shown))
    report_options.write_reports(reports, lambda name: render(name, full))
    for line in () if quiet else first.notes:
        remark(f"note: {line}")
    if fmt in PEOPLE:
        for fault in first.faults:
            remark(f"Error: {fault}")
        if first.results and not quiet:
            note(first.summary)
    code = first.code
    if watch is not None and code != Exit.UNUSABLE:
        code = _watch(compared, first, watch)
    if strict and code == Exit.OK and first.unread:
        code = Exit.FINDINGS
    click.get_current_context().exit(code)


@dataclass(frozen=True)
class ComparisonRound:
    """One comparison of all files: their results, and why others have none."""

    results: Sequence[CompareResult]
    unreached: Mapping[str, str]

    @property
    def code(self) -> Exit:
        """A file that was not compared outweighs a difference."""
        if self.unreached or not all(result.ok for result in self.results):
            return Exit.UNUSABLE
        return Exit.OK if all(result.same for result in self.results) else Exit.FINDINGS

    @property
    def faults(self) -> list[str]:
        """What the line or the PLC refused."""
        return list(dict.fromkeys(self.unreached.values()))

    @property
    def notes(self) -> list[str]:
        """What is told beside the differences."""
        return [line for result in self.results for line in result.notes]

    @property
    def unread(self) -> int:
        """How many settings were not compared, since no register has them."""
        return sum(len(result.unread) for result in self.results if result.ok)

    def shown(self, fmt: str = "") -> list[Diagnostic]:
        """What differs or was not read, and in reports an error for each file that was not compared.

        People are told of these on stderr.
        """
        from pidcfg.live.pull import not_reached

        told = () if fmt in PEOPLE else (not_reached(name, said) for name, said in self.unreached.items())
        return [*(d for result in self.results for d in (*result.findings, *result.warnings)), *told]

    @property
    def summary(self) -> str:
        """How many files were compared, and in how many settings the PLC differs."""
        done = [result for result in self.results if result.ok]
        count, left = sum(len(result.findings) for result in done), len(self.results) + len(self.unreached) - len(done)
        missed = f"{_count_text(left, 'file')} not compared" if left else ""
        if not done:
            return missed
        found = _count_text(count, "difference") if count else "alike as far as read" if self.unread else "alike"
        files = f"{_count_text(len(done), 'file')} compared with {done[0].plc}: {found}"
        unsaid = f"{_count_text(self.unread, 'setting')} could not be read" if self.unread else ""
        return "; ".join(filter(None, (files, unsaid, missed)))


def compare_once(documents: Mapping[str, Document], compare: Callable[[Document], CompareResult]) -> ComparisonRound:
    """Every file with its PLC; one that does not answer is not asked for the next one."""
    from pidcfg.live.link import PlcError, SilentError

    results, unreached = [], {}
    dead = ""
    for name, doc in documents.items():
        try:
            if not dead:
                results.append(compare(doc))
        except PlcError as error:
            unreached[name] = str(error)
            dead = str(error) if isinstance(error, SilentError) else ""
        if dead:
            unreached[name] = dead
    return ComparisonRound(results, unreached)


def _count_text(count: int, what: str) -> str:
    return f"{count} {what}{'s' if count != 1 else ''}"


def _watch(compared: Callable[[], ComparisonRound], first: ComparisonRound, seconds: float) -> Exit:
    """Goes on comparing; prints what comes and goes with its time. The exit code is that of the last comparison."""
    seen, code, faults = {_row(d) for d in first.shown("text")}, first.code, first.faults
    note(f"comparing every {seconds:g} s; Ctrl-C ends")
    try:
        while True:
            time.sleep(seconds)
            now = compared()
            lines = [fault for fault in now.faults if fault not in faults]
            lines += ["reached again"] * (bool(faults) and not now.faults)
            code, faults = now.code, now.faults
            if not faults:
                rows = {_row(d) for d in now.shown()}
                lines += [f"differs: {row}" for row in sorted(rows - seen)]
                lines += [f"no longer: {row}" for row in sorted(seen - rows)]
                seen = rows
            show("".join(f"{_now()} {line}\n" for line in lines))
    except KeyboardInterrupt:
        note(f"stopped; the last comparison ended with exit code {code}")
    return code


def _row(d: Diagnostic) -> str:
    loop = f" [{d.loop}]" if d.loop else ""
    return f"{d.file}:{d.span.line}:{d.span.column}: {d.message}{loop}"


def _now() -> str:
    return datetime.now().astimezone().isoformat(" ", "seconds")
