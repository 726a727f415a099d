"""``pidcfg pull``, ``compare`` and ``serve``: what a PLC holds, a PLC against its files, and one that is simulated."""

from __future__ import annotations

import time
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime
from ipaddress import ip_address
from typing import TYPE_CHECKING

import click

from pidcfg.cli import options
from pidcfg.cli.commands.decode import tell_notes, vendor_options
from pidcfg.cli.console import echo, echo_json, show_text, write_note, write_remark
from pidcfg.cli.environment import require_extra
from pidcfg.cli.formats import render_findings, report_options
from pidcfg.cli.formats.findings import Findings
from pidcfg.cli.main import Exit
from pidcfg.cli.terminal import LINE
from pidcfg.text.diagnostics import Severity
from pidcfg.vendors import VENDORS, format_names

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from pidcfg.live.pull import CompareResult
    from pidcfg.text.diagnostics import Diagnostic
    from pidcfg.text.document import Document
    from pidcfg.text.reader import Limits

# --- Options of the commands that speak to a PLC ----------------------------------------------------------------------

PLC_OPTION = click.option(
    "--plc",
    required=True,
    metavar="URL",
    envvar="PIDCFG_PLC",
    help="Where the PLC is: modbus://HOST[:502][?unit=1] or modbus+rtu:///DEVICE?baud=9600&parity=odd.",
)
LIKE_OPTION = click.option("--like", metavar="FILE", help="A configuration that gives names, ranges, units and places.")
VENDOR_OPTION = click.option(
    "--vendor", type=click.Choice(list(VENDORS)), help="The PLC family, where no file says it."
)
TIMEOUT_OPTION = click.option(
    "--timeout",
    type=options.NUMBER_TYPE,
    default=2.0,
    show_default=True,
    metavar="SECONDS",
    help="How long an answer may take.",
)
RETRIES_OPTION = click.option(
    "--retries",
    type=options.Integer(),
    default=2,
    show_default=True,
    metavar="COUNT",
    help="How often a request without an answer is sent again.",
)


OPTION_NAMES = {"seconds": "--for"}
"""An option that the calls have by another name."""


def require_packages(url: str) -> None:
    """Ends the command where a package is missing that reaches this PLC."""
    require_extra("pymodbus", "live")
    if url.startswith("modbus+rtu"):
        require_extra("serial", "live")


@contextmanager
def report_plc_errors() -> Iterator[None]:
    """Ends the command with one line where the PLC cannot be reached or an option makes no sense."""
    from pidcfg.encoders.modbus_map import UnusableMapError
    from pidcfg.live.link import PlcError

    try:
        with options.usage_errors(OPTION_NAMES):
            yield
    except (PlcError, UnusableMapError) as error:
        raise click.ClickException(str(error)) from None


# --- ``pidcfg pull``: what a PLC holds, as a configuration or a memory listing ----------------------------------------

PULL_EXAMPLES = options.examples_text(
    "pidcfg pull --plc modbus://10.0.0.5 --like reactor.yaml -o running.yaml",
    "pidcfg pull --plc modbus://10.0.0.5 --vendor dl06 --format csv",
    "pidcfg pull --plc modbus://10.0.0.6 --vendor click --bits C101 --integers DS101 --floats DF101 --pwm-bit none",
    "pidcfg pull --plc 'modbus+rtu:///dev/ttyUSB0?baud=9600&parity=odd' --vendor dl06",
)


@click.command("pull", epilog=PULL_EXAMPLES)
@PLC_OPTION
@options.MAP_OPTION
@LIKE_OPTION
@VENDOR_OPTION
@options.output_format("yaml", *format_names())
@vendor_options
@options.OUTPUT_OPTION
@options.FORCE_OPTION
@TIMEOUT_OPTION
@RETRIES_OPTION
@options.QUIET_OPTION
@options.LIMITS_OPTION
def pull(
    plc: str,
    map_path: str | None,
    like: str | None,
    vendor: str | None,
    fmt: str,
    out: str | None,
    force: bool,
    timeout: float,
    retries: int,
    quiet: bool,
    limits: Limits,
    **vendor_texts: str | None,
) -> None:
    """Read the loops of a PLC. Nothing is written to it: there is no command that does.

    A DL06 tells its own loop table by V7640 and V7641; of other PLCs --like FILE or options say where the loops are.
    """
    require_packages(plc)
    from pidcfg.cli.findings import load_configuration, show_errors
    from pidcfg.cli.outputs import write_files
    from pidcfg.live import pull as plc_memory

    like_document = None if like is None else load_configuration(like, limits)
    with report_plc_errors():
        result = plc_memory.pull(
            plc,
            like=like_document,
            vendor=vendor,
            format=fmt,
            options=vendor_texts,
            map=options.map_file(map_path, limits),
            timeout=timeout,
            retries=retries,
            limits=limits,
        )
    if not result.ok:
        show_errors(result.findings, like_document, fmt)
        click.get_current_context().exit(Exit.UNUSABLE)
    if out is None:
        echo(result.text)
    else:
        write_files({out: result.text}, force=force)
    tell_notes(result.notes, result.warnings, quiet=quiet)


# --- ``pidcfg compare``: configurations against the PLC that they are for ---------------------------------------------

COMPARE_EXAMPLES = options.examples_text(
    "pidcfg compare reactor.yaml --plc modbus://10.0.0.5",
    "pidcfg compare line-1.yaml line-2.yaml --plc modbus://10.0.0.6 --report-output junit=compare.xml",
    "pidcfg compare reactor.yaml --plc modbus://10.0.0.5 --watch 60",
)
FORMATS_FOR_PEOPLE = ("text", "concise")
"""Formats in which a PLC that is not reached is one line on standard error."""


@click.command("compare", epilog=COMPARE_EXAMPLES)
@click.argument("files", nargs=-1, required=True, metavar="FILE…")
@PLC_OPTION
@options.MAP_OPTION
@report_options.report_format("compare")
@report_options.report_files("compare")
@click.option(
    "--watch",
    type=options.Real(min=0.1),
    metavar="SECONDS",
    help="Compare again and again, and print what changes with its time, until Ctrl-C.",
)
@click.option("--strict", is_flag=True, help="Exit 1 for settings that could not be read, too.")
@TIMEOUT_OPTION
@RETRIES_OPTION
@options.QUIET_OPTION
@options.LIMITS_OPTION
@options.exit_zero
def compare(
    files: tuple[str, ...],
    plc: str,
    map_path: str | None,
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
    require_packages(plc)
    from pidcfg.cli.findings import load_configuration
    from pidcfg.encoders.modbus_map import UnusableMapError
    from pidcfg.live import pull as plc_memory

    documents = {doc.file: doc for doc in (load_configuration(name, limits) for name in files)}
    report_options.refuse_inputs(reports, files)

    map_data = options.map_file(map_path, limits)

    def compare_again() -> ComparisonRound:
        with options.usage_errors():
            return compare_once(
                documents,
                lambda doc: plc_memory.compare(doc, plc, map=map_data, timeout=timeout, retries=retries, limits=limits),
            )

    try:
        first_round = compare_again()
    except UnusableMapError as error:
        raise click.ClickException(str(error)) from None
    threshold = Severity.WARNING if strict else Severity.ERROR
    printed = Findings(first_round.findings(fmt), documents, threshold, command="compare")
    full = Findings(first_round.findings(), documents, threshold, command="compare")
    if first_round.results or fmt not in FORMATS_FOR_PEOPLE:
        report_options.deliver_reports(fmt, (), lambda name: render_findings(name, printed))
    report_options.write_reports(reports, lambda name: render_findings(name, full))
    for line in () if quiet else first_round.notes:
        write_remark(f"note: {line}")
    if fmt in FORMATS_FOR_PEOPLE:
        for fault in first_round.faults:
            write_remark(f"Error: {fault}")
        if first_round.results and not quiet:
            write_note(first_round.summary)
    code = first_round.exit_code
    if watch is not None and code != Exit.UNUSABLE:
        code = _watch_plc(compare_again, first_round, watch)
    if strict and code == Exit.OK and first_round.unread_count:
        code = Exit.FINDINGS
    click.get_current_context().exit(code)


@dataclass(frozen=True)
class ComparisonRound:
    """One comparison of all files: their results, and why others have none."""

    results: Sequence[CompareResult]
    errors_by_file: Mapping[str, str]

    @property
    def exit_code(self) -> Exit:
        """A file that was not compared outweighs a difference."""
        if self.errors_by_file or not all(result.ok for result in self.results):
            return Exit.UNUSABLE
        return Exit.OK if all(result.same for result in self.results) else Exit.FINDINGS

    @property
    def faults(self) -> list[str]:
        """What the line or the PLC refused."""
        return list(dict.fromkeys(self.errors_by_file.values()))

    @property
    def notes(self) -> list[str]:
        """What is told beside the differences."""
        return [line for result in self.results for line in result.notes]

    @property
    def unread_count(self) -> int:
        """How many settings were not compared, since no register has them."""
        return sum(len(result.unread) for result in self.results if result.ok)

    def findings(self, fmt: str = "") -> list[Diagnostic]:
        """What differs or was not read, and in reports an error for each file that was not compared.

        People are told of these on stderr.
        """
        from pidcfg.live.pull import unreached_finding

        unreached_findings = (
            ()
            if fmt in FORMATS_FOR_PEOPLE
            else (unreached_finding(name, message) for name, message in self.errors_by_file.items())
        )
        return [*(d for result in self.results for d in (*result.findings, *result.warnings)), *unreached_findings]

    @property
    def summary(self) -> str:
        """How many files were compared, and in how many settings the PLC differs."""
        compared = [result for result in self.results if result.ok]
        count, uncompared = (
            sum(len(result.findings) for result in compared),
            len(self.results) + len(self.errors_by_file) - len(compared),
        )
        uncompared_text = f"{_count_text(uncompared, 'file')} not compared" if uncompared else ""
        if not compared:
            return uncompared_text
        verdict = (
            _count_text(count, "difference") if count else "alike as far as read" if self.unread_count else "alike"
        )
        files = f"{_count_text(len(compared), 'file')} compared with {compared[0].plc}: {verdict}"
        unread_text = f"{_count_text(self.unread_count, 'setting')} could not be read" if self.unread_count else ""
        return "; ".join(filter(None, (files, unread_text, uncompared_text)))


def compare_once(documents: Mapping[str, Document], compare: Callable[[Document], CompareResult]) -> ComparisonRound:
    """Every file with its PLC; one that does not answer is not asked for the next one."""
    from pidcfg.live.link import PlcError, SilentError

    results, errors_by_file = [], {}
    silent_line = ""
    for name, doc in documents.items():
        try:
            if not silent_line:
                results.append(compare(doc))
        except PlcError as error:
            errors_by_file[name] = str(error)
            silent_line = str(error) if isinstance(error, SilentError) else ""
        if silent_line:
            errors_by_file[name] = silent_line
    return ComparisonRound(results, errors_by_file)


def _count_text(count: int, noun: str) -> str:
    return f"{count} {noun}{'s' if count != 1 else ''}"


def _watch_plc(compare_again: Callable[[], ComparisonRound], first: ComparisonRound, seconds: float) -> Exit:
    """Goes on comparing; prints what comes and goes with its time. The exit code is that of the last comparison."""
    rows_before, code, faults = ({_row_text(d) for d in first.findings("text")}, first.exit_code, first.faults)
    write_note(f"comparing every {seconds:g} s; Ctrl-C ends")
    try:
        while True:
            time.sleep(seconds)
            comparison = compare_again()
            lines = [fault for fault in comparison.faults if fault not in faults]
            lines += ["reached again"] * (bool(faults) and not comparison.faults)
            code, faults = comparison.exit_code, comparison.faults
            if not faults:
                rows = {_row_text(d) for d in comparison.findings()}
                lines += [f"differs: {row}" for row in sorted(rows - rows_before)]
                lines += [f"no longer: {row}" for row in sorted(rows_before - rows)]
                rows_before = rows
            show_text("".join(f"{_time_text()} {line}\n" for line in lines))
    except KeyboardInterrupt:
        write_note(f"stopped; the last comparison ended with exit code {code}")
    return code


def _row_text(d: Diagnostic) -> str:
    loop = f" [{d.loop}]" if d.loop else ""
    return f"{d.file}:{d.span.line}:{d.span.column}: {d.message}{loop}"


def _time_text() -> str:
    return datetime.now().astimezone().isoformat(" ", "seconds")


# --- ``pidcfg serve``: the virtual PLC of a scenario behind its vendor's register map, in real time -------------------

SERVE_EXAMPLES = options.examples_text(
    "pidcfg serve reactor.scenario.yaml",
    "pidcfg serve reactor.scenario.yaml --speed 10 --listen 127.0.0.1:1502",
    "pidcfg serve oven.scenario.yaml --map oven-map.csv --unit 3",
    "pidcfg serve reactor.scenario.yaml tank.scenario.yaml --unit 1,7",
    "pidcfg serve tank.scenario.yaml --listen 'modbus+rtu:///dev/ttyUSB0?baud=38400&parity=odd'",
)
DEFAULT_LISTEN = "127.0.0.1:5020"


class UnitsType(click.ParamType[tuple[int, ...]]):
    """Whole numbers from 1 on with commas between."""

    name = "units"

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> tuple[int, ...]:
        """The numbers."""
        if isinstance(value, tuple):
            return value
        return tuple(options.LimitedInteger(1).convert(part.strip(), param, ctx) for part in str(value).split(","))


@click.command("serve", epilog=SERVE_EXAMPLES)
@click.argument("scenario", nargs=-1, required=True)
@options.MAP_OPTION
@click.option(
    "--listen",
    default=DEFAULT_LISTEN,
    show_default=True,
    metavar="HOST:PORT",
    help="Where to listen, or modbus+rtu:///DEVICE.",
)
@click.option(
    "--unit",
    type=UnitsType(),
    metavar="N,N…",
    help="The Modbus unit of each scenario, which it alone answers as; 1, 2, 3 … unless --listen says another one.",
)
@click.option(
    "--speed",
    type=options.NUMBER_TYPE,
    default=1.0,
    show_default=True,
    metavar="FACTOR",
    help="How many times as fast as the clock.",
)
@click.option(
    "--for",
    "seconds",
    type=options.NUMBER_TYPE,
    metavar="SECONDS",
    help="End by itself after so many seconds of the clock.",
)
@options.output_format("text", "json")
@options.QUIET_OPTION
@options.LIMITS_OPTION
def serve(
    scenario: tuple[str, ...],
    map_path: str | None,
    listen: str,
    unit: tuple[int, ...] | None,
    speed: float,
    seconds: float | None,
    fmt: str,
    quiet: bool,
    limits: Limits,
) -> None:
    """Serve the virtual PLC of SCENARIO over Modbus until Ctrl-C, which prints the report of the run.

    An HMI, a SCADA driver or a script reads it, writes set points, modes and outputs as an operator does, and sees the
    loops answer. The events of the scenario happen; its duration and its expectations do not count. Several scenarios
    are as many PLCs at one address, each with its unit, as behind a gateway.
    """
    require_packages(listen)
    from pidcfg.cli.findings import show_errors
    from pidcfg.cli.formats.runs import simulations_text
    from pidcfg.cli.inputs import read_inputs
    from pidcfg.live import serving
    from pidcfg.text.writer import json_text

    documents = [list(read_inputs((name,), limits)) for name in scenario]
    for name, matches in zip(scenario, documents, strict=True):
        if len(matches) != 1:
            raise click.ClickException(f"{name} stands for {len(matches)} files; name one scenario")
        if matches[0].data is not None and "vendor" in matches[0].data:
            message = f"{name} is a configuration, and serve runs scenarios; 'pidcfg init --scenario {name}' writes one"
            raise click.UsageError(message)
    units = _units_of(unit, scenario, map_path)
    LINE.silence()

    def write_ready(address: str) -> None:
        if not quiet:
            write_note(
                f"serving {_served_text(scenario, units)} at {address}, {_exposure_text(address)}, "
                f"{speed:g} times real time; Ctrl-C ends with the report"
            )

    with report_plc_errors(), options.usage_errors({"others": "--unit", "seconds": "--for"}):
        result = serving.serve(
            documents[0][0],
            listen=listen,
            unit=units[0],
            others={number: matches[0] for number, matches in zip(units[1:], documents[1:], strict=True) if number},
            map=options.map_file(map_path, limits),
            speed=speed,
            seconds=seconds,
            ready=write_ready,
            tell=write_note,
            limits=limits,
        )
    if not result.ok:
        show_errors(result.findings, documents[0][0], fmt)
        click.get_current_context().exit(Exit.UNUSABLE)
    if fmt == "json":
        echo_json(json_text(result.to_json()))
    else:
        show_text(simulations_text([*result.outcomes], tables=True))


def _units_of(option: tuple[int, ...] | None, names: tuple[str, ...], map_path: str | None) -> tuple[int | None, ...]:
    """The unit of each scenario; None: what --listen says, or 1."""
    if len(names) == 1 and option is None:
        return (None,)
    if len(names) > 1 and map_path is not None:
        raise click.UsageError("--map is of one PLC; name the map of each in its configuration")
    units = option or tuple(range(1, len(names) + 1))
    if len(units) != len(names):
        raise click.UsageError(f"--unit names {len(units)} units for {len(names)} scenarios; name one for each")
    if len(set(units)) < len(units):
        raise click.UsageError("--unit names a unit twice; each PLC has one of its own")
    return units


def _served_text(scenarios: tuple[str, ...], units: tuple[int | None, ...]) -> str:
    """What is served, with the units where there are several."""
    if len(scenarios) == 1:
        return scenarios[0]
    return ", ".join(f"{name} as unit {unit}" for name, unit in zip(scenarios, units, strict=True))


def _exposure_text(address: str) -> str:
    """Who can come: a server that reaches further than this machine says so."""
    host = address.rpartition(":")[0].strip("[]")
    try:
        is_local = ip_address(host).is_loopback
    except ValueError:
        is_local = host == "localhost"
    if address.startswith("/") or not host:
        return "for whoever is on the line"
    return "for this machine only" if is_local else "FOR EVERYBODY WHO REACHES THIS ADDRESS: Modbus knows no password"
