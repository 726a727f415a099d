"""``pidcfg report``: the commissioning report; every file is read, checked and run once."""

from __future__ import annotations

import re
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from pidcfg.about import VERSION
from pidcfg.cli import options
from pidcfg.cli.console import echo_xml, write_note, write_remark
from pidcfg.cli.environment import require_extra
from pidcfg.cli.inputs import RECORDED_DISK, document_of_input, note_read, read_entries, read_input
from pidcfg.cli.terminal import LINE
from pidcfg.output.reporting import (
    ConfigurationInput,
    ReadInput,
    ReportInputs,
    RunInput,
    collect_inputs,
    configuration_input,
    content_of,
    named_input,
    processing_time,
    run_input,
)
from pidcfg.text.processes import WorkerPool
from pidcfg.validate.engine import Checked, check_document, is_scenario

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from pidcfg.cli.inputs import Input
    from pidcfg.cli.main import Exit
    from pidcfg.output.report import Content
    from pidcfg.study.outcome import Outcome
    from pidcfg.study.scenario import LoadedScenario
    from pidcfg.text.document import Document
    from pidcfg.text.reader import Limits

# --- The inputs of a report: every file is read, checked and run once, by this process or by several ------------------

SCENARIO_KEY = re.compile(rb"^scenario[ \t]*:", re.MULTILINE)
"""What a scenario looks like to whoever only counts them."""


@dataclass(frozen=True)
class InputReader:
    """Reads, checks and runs one file after the other."""

    limits: Limits
    names: frozenset[str]
    """The files of the command line."""
    runs: int
    """About how many of them are scenarios."""
    pictures: bool
    """Whether the runs are recorded for charts."""
    progress: Callable[[float], None] | None = None

    @cached_property
    def named_configurations(self) -> dict[str, ConfigurationInput]:
        """The configurations that scenarios have named, and that the command line does not."""
        return {}

    @cached_property
    def last_checked(self) -> dict[str, Checked]:
        """The configuration that was run last, checked; it often is the next file."""
        return {}

    def __call__(self, entry: Input) -> ReadInput:
        """One file of the command line; a file that cannot be opened ends the command."""
        if not entry.is_piped:
            entry = read_input(entry.name, self.limits)
        checked = self.last_checked.pop(entry.name, None)
        if checked is not None and checked.document.text.encode() == entry.data:
            return configuration_input((entry.name, entry.data), checked)
        doc = document_of_input(entry)
        if entry.problem is not None:
            raise click.ClickException(entry.problem)
        if is_scenario(doc):
            return self._run_scenario(entry, doc)
        return configuration_input((entry.name, entry.data), check_document(doc))

    def _run_scenario(self, entry: Input, doc: Document) -> RunInput:
        from pidcfg.sim.engine.run import Settings
        from pidcfg.study.scenario import load_scenario

        loaded = load_scenario(doc, RECORDED_DISK)
        settings = Settings(max_loop_steps=self.limits.loop_steps, progress=self.progress, runs=self.runs)
        run = run_input(
            (entry.name, entry.data), loaded, settings, self._configuration_of(loaded), pictures=self.pictures
        )
        self.last_checked.clear()
        if loaded.checked is not None:
            self.last_checked[loaded.config] = loaded.checked
        return run

    def _configuration_of(self, loaded: LoadedScenario) -> ConfigurationInput | None:
        """What a scenario runs; each is read once."""
        name = loaded.config
        if not name or name in self.names:
            return None
        if name not in self.named_configurations:
            entry = read_input(name, self.limits)
            configuration = None if entry.problem is not None else named_input((name, entry.data), loaded)
            if configuration is None:
                return None
            self.named_configurations[name] = configuration
        return self.named_configurations[name]


def gather_inputs(
    paths: Sequence[str], limits: Limits, progress: Callable[[float], None] | None, *, pictures: bool, jobs: int = 1
) -> ReportInputs:
    """All files of a command line, folders and patterns included; ``progress`` is told the share that is done."""
    entries, scenarios = [], 0
    for entry in read_entries(paths, limits):
        if entry.problem is not None:
            raise click.ClickException(entry.problem)
        scenarios += SCENARIO_KEY.search(entry.data) is not None
        entries.append(entry if entry.is_piped else replace(entry, data=b""))
    names = frozenset(entry.name for entry in entries)
    inputs = list(_read_inputs(entries, (limits, names, max(scenarios, 1), pictures), jobs, progress))
    return collect_inputs(inputs)


def _read_inputs(
    entries: Sequence[Input], arguments: tuple[object, ...], jobs: int, progress: Callable[[float], None] | None
) -> Iterator[ReadInput]:
    """The files one by one; what other processes have read counts as read here."""
    done_count = 0

    def show_share(share: float) -> None:
        if progress is not None:
            progress((done_count + share) / len(entries))

    def make_reader(*arguments: Any) -> InputReader:
        return replace(InputReader(*arguments), progress=show_share)

    for entry in WorkerPool(jobs, InputReader, arguments).adaptive_results(entries, processing_time, make_reader):
        done_count += 1
        show_share(0.0)
        if isinstance(entry, RunInput):
            note_read(entry.outcome.config)
        yield entry


# --- ``pidcfg report``: the commissioning report as one HTML page, as CSV files and as a workbook ---------------------

STDOUT, DEFAULT_PAGE, PDF_SUFFIX = "-", "report.html", ".pdf"
PACKAGES_NEEDED = {"page": ("jinja2",), "xlsx": ("xlsxwriter",)}
"""Packages of the extra ``report`` by what needs them."""
EPILOG = options.examples_text(
    "pidcfg report reactor.scenario.yaml",
    "pidcfg report loops/ scenarios/ -o handover.html --project 'Line 4' --document PID-0042 --revision B",
    "pidcfg report reactor.scenario.yaml -o reactor.pdf",
    "pidcfg report reactor.yaml --sheet -o door.pdf",
    "pidcfg report reactor.yaml --tables tables --xlsx tables.xlsx",
)


def _suffix_check(*suffixes: str) -> Callable[[click.Context, click.Parameter, str | None], str | None]:
    """Refuses a file name that promises another kind of file; a page may go to standard output."""

    def check(ctx: click.Context, param: click.Parameter, name: str | None) -> str | None:
        if name == STDOUT and DEFAULT_PAGE.endswith(suffixes):
            return name
        if name is not None and Path(name or "").suffix.lower() not in suffixes:
            ends = f"{', '.join(suffixes[:-1])} or {suffixes[-1]}" if suffixes[1:] else suffixes[0]
            raise click.BadParameter(f"{name!r}; write a name that ends in {ends}", ctx, param)
        return name

    return check


def _title_option(name: str, help_text: str) -> options.Decorator:
    """An option of the title block."""
    return click.option(f"--{name}", metavar="TEXT", help=f"{help_text}, for the title block.")


@click.command("report", epilog=EPILOG)
@click.argument("paths", nargs=-1, required=True, metavar="FILE...")
@click.option(
    "-o",
    "--output",
    "out",
    metavar="FILE",
    callback=_suffix_check(".html", ".htm", ".pdf"),
    help=f"The page, or the PDF where the name ends so; {DEFAULT_PAGE} unless --tables or --xlsx is given, - for "
    "standard output.",
)
@click.option("--full", is_flag=True, help="Print what is at its default, too, every word, and every signal.")
@click.option("--sheet", is_flag=True, help="Instead of the report one sheet with all loops, for the cabinet's door.")
@click.option(
    "--tables",
    "--csv",
    "csv",
    metavar="FOLDER",
    callback=options.refuse_dash,
    help="Write the tables as CSV files into a folder.",
)
@click.option(
    "--xlsx", "xlsx", metavar="FILE", callback=_suffix_check(".xlsx"), help="Write the tables as an Excel workbook."
)
@click.option("--title", metavar="TEXT", default="Commissioning report", show_default=True, help="Title of the report.")
@_title_option("project", "Project")
@_title_option("customer", "Customer")
@_title_option("plant", "Plant or machine; the names in the configurations when not given")
@_title_option("document", "Document number")
@_title_option("revision", "Revision")
@_title_option("author", "Who prepared it")
@_title_option("date", "Date")
@options.EXCLUDE_OPTION
@options.JOBS_OPTION
@options.STRICT_OPTION
@options.FORCE_OPTION
@options.QUIET_OPTION
@options.LIMITS_OPTION
@options.exit_zero
def command(
    paths: tuple[str, ...],
    out: str | None,
    csv: str | None,
    xlsx: str | None,
    full: bool,
    sheet: bool,
    title: str,
    project: str | None,
    customer: str | None,
    plant: str | None,
    document: str | None,
    revision: str | None,
    author: str | None,
    date: str | None,
    jobs: int | None,
    strict: bool,
    force: bool,
    quiet: bool,
    limits: Limits,
) -> None:
    """Write a commissioning report on every FILE: scenarios, configurations, and folders of them.

    A scenario brings its configuration along. The report has a page for each loop, with what the file says, the words,
    and a column for the as-left values, the findings, the trends and verdicts of the runs, and the SHA-256 of every
    file. Nothing in it comes from the clock or the user's account: the same files give the same bytes.

    Exit codes: 0 no error and no failed expectation, 1 some (they are in the report), 2 unusable input.
    """
    from pidcfg.output.report import Title

    if out is None and csv is None and xlsx is None:
        out = DEFAULT_PAGE
    if sheet and full:
        raise click.UsageError("--sheet and --full: a sheet for the door has no more than the main values")
    browser_path = _find_browser() if out is not None and Path(out).suffix.lower() == PDF_SUFFIX else None
    _require_packages("page" if out is not None else None, "xlsx" if xlsx is not None else None)
    pictures = out is not None and not sheet
    inputs = gather_inputs(paths, limits, _show_progress, pictures=pictures, jobs=options.process_count(jobs))
    title_block = Title(title, project, customer, plant, document, revision, author, date, VERSION)
    content = content_of(inputs, title_block)
    page: str | bytes | None = None if out is None else _render_page(content, sheet=sheet, full=full)
    if browser_path is not None and isinstance(page, str):
        page = _print_pdf(page, browser_path)
    _write_all(content, page, (out, csv, xlsx), force=force)
    if not quiet:
        write_remark(summary_line(content, [name for name in (out, csv, xlsx) if name not in {None, STDOUT}]))
    for outcome in inputs.outcomes:
        if not outcome.passed:
            write_note(failure_text(outcome))
    click.get_current_context().exit(exit_code(inputs, strict=strict))


def _require_packages(*outputs: str | None) -> None:
    """Ends the command, before anything runs, where a package is not installed."""
    for output in outputs:
        for package in PACKAGES_NEEDED.get(output or "", ()):
            require_extra(package, "report")


def _show_progress(share: float) -> None:
    """What the line on the terminal shows."""
    LINE.update("simulating", share)


def _find_browser() -> str:
    """The browser that prints; ends the command, before anything runs, where there is none."""
    from pidcfg.output.report.formats import PdfError, find_browser

    try:
        return find_browser()
    except PdfError as error:
        raise click.ClickException(str(error)) from None


def _render_page(content: Content, *, sheet: bool, full: bool) -> str:
    from pidcfg.output.report.formats import door_sheet, report_page

    return door_sheet(content) if sheet else report_page(content, full=full)


def _print_pdf(html: str, path: str) -> bytes:
    from pidcfg.output.report.formats import PdfError, print_pdf

    try:
        return print_pdf(html, path)
    except PdfError as error:
        raise click.ClickException(str(error)) from None


def _write_all(
    content: Content, page: str | bytes | None, names: tuple[str | None, str | None, str | None], *, force: bool
) -> None:
    """All files or none; the page goes to standard output last. ``names``: of the page, the folder, the workbook."""
    from pidcfg.cli.outputs import write_files
    from pidcfg.output.report.formats import tables_of

    out, csv, xlsx = names
    files: dict[str, str | bytes] = {}
    if csv is not None:
        from pidcfg.output.report.formats import csv_files

        files |= {(Path(csv) / name).as_posix(): text for name, text in csv_files(tables_of(content)).items()}
    if xlsx is not None:
        from pidcfg.output.report.formats import write_workbook

        files[xlsx] = write_workbook([table for table in tables_of(content) if table.rows], content.title)
    if out not in {None, STDOUT} and page is not None:
        files[str(out)] = page
    with _make_folder(csv):
        write_files(files, force=force)
    if isinstance(page, str) and out == STDOUT:
        echo_xml(page)


@contextmanager
def _make_folder(name: str | None) -> Iterator[None]:
    """A folder that is made where there is none, with those above it; what was made goes when nothing is written."""
    missing_folders = [] if name is None else [path for path in (Path(name), *Path(name).parents) if not path.exists()]
    is_written = False
    try:
        for path in reversed(missing_folders):
            path.mkdir()
        yield
        is_written = True
    except OSError as error:
        raise click.ClickException(f"cannot make the folder {name}: {error.strerror}") from None
    finally:
        for path in () if is_written else missing_folders:
            with suppress(OSError):
                path.rmdir()


def summary_line(content: Content, names: Sequence[str]) -> str:
    """One line on what was written."""
    from pidcfg.output.report.formats import severity_counts

    passed, total = content.verdicts
    loops, runs = len(content.loops), len(content.runs)
    parts = [f"{loops} loop{'' if loops == 1 else 's'}", f"{runs} run{'' if runs == 1 else 's'}"]
    parts += [f"{n} {label}{'' if n == 1 else 's'}" for label, n in severity_counts(content).items()]
    parts += [f"{passed} of {total} expectations passed"] if total else []
    return f"{', '.join(names) or 'report'}: {', '.join(parts)}"


def failure_text(outcome: Outcome) -> str:
    """Which expectations of a run failed, the standing ones included, and how it was judged."""
    from pidcfg.cli.formats.runs import failures_text, outcome_line

    return ("" if outcome.report is None else failures_text(outcome.report)) + outcome_line(outcome)


def exit_code(content: ReportInputs, *, strict: bool) -> Exit:
    """As validate and simulate would end; what is unusable outweighs what was found."""
    from pidcfg.cli import findings
    from pidcfg.cli.commands import simulate

    return max(findings.exit_code(content.findings, strict=strict), simulate.exit_code(content.outcomes, strict=strict))
