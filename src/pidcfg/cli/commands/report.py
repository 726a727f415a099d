"""``pidcfg report``: the commissioning report as one HTML page, as CSV files and as a workbook."""

from __future__ import annotations

import os
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

import click

from pidcfg import __version__
from pidcfg.cli import options
from pidcfg.cli.extras import need
from pidcfg.cli.main import Exit
from pidcfg.cli.terminal.console import echo_xml, note, remark
from pidcfg.cli.terminal.progress import LINE

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from pidcfg.cli.files.report_inputs import Gathered
    from pidcfg.limits import Limits
    from pidcfg.report.content import Content
    from pidcfg.scenario.outcome import Outcome

STDOUT, PAGE, PDF = "-", "report.html", ".pdf"
NEEDS = {"page": ("jinja2",), "xlsx": ("xlsxwriter",)}
"""Packages of the extra ``report`` by what needs them."""
EPILOG = options.examples(
    "pidcfg report reactor.scenario.yaml",
    "pidcfg report loops/ scenarios/ -o handover.html --project 'Line 4' --document PID-0042 --revision B",
    "pidcfg report reactor.scenario.yaml -o reactor.pdf",
    "pidcfg report reactor.yaml --sheet -o door.pdf",
    "pidcfg report reactor.yaml --tables tables --xlsx tables.xlsx",
)


def _ending(*suffixes: str) -> Callable[[click.Context, click.Parameter, str | None], str | None]:
    """Refuses a file name that promises another kind of file; a page may go to standard output."""

    def checked(ctx: click.Context, param: click.Parameter, name: str | None) -> str | None:
        if name == STDOUT and PAGE.endswith(suffixes):
            return name
        if name is not None and Path(name or "").suffix.lower() not in suffixes:
            ends = f"{', '.join(suffixes[:-1])} or {suffixes[-1]}" if suffixes[1:] else suffixes[0]
            raise click.BadParameter(f"{name!r}; write a name that ends in {ends}", ctx, param)
        return name

    return checked


def _field(name: str, what: str) -> options.Decorator:
    """An option of the title block."""
    return click.option(f"--{name}", metavar="TEXT", help=f"{what}, for the title block.")


@click.command("report", epilog=EPILOG)
@click.argument("paths", nargs=-1, required=True, metavar="FILE...")
@click.option(
    "-o",
    "--output",
    "out",
    metavar="FILE",
    callback=_ending(".html", ".htm", ".pdf"),
    help=f"The page, or the PDF where the name ends so; {PAGE} unless --tables or --xlsx is given, - for standard "
    "output.",
)
@click.option("--full", is_flag=True, help="Print what is at its default, too, every word, and every signal.")
@click.option("--sheet", is_flag=True, help="Instead of the report one sheet with all loops, for the cabinet's door.")
@click.option(
    "--tables",
    "--csv",
    "csv",
    metavar="FOLDER",
    callback=options.only_file,
    help="Write the tables as CSV files into a folder.",
)
@click.option(
    "--xlsx", "xlsx", metavar="FILE", callback=_ending(".xlsx"), help="Write the tables as an Excel workbook."
)
@click.option("--title", metavar="TEXT", default="Commissioning report", show_default=True, help="Title of the report.")
@_field("project", "Project")
@_field("customer", "Customer")
@_field("plant", "Plant or machine; the names in the configurations when not given")
@_field("document", "Document number")
@_field("revision", "Revision")
@_field("author", "Who prepared it")
@_field("date", "Date")
@click.option("--exit-zero", is_flag=True, help="Exit 0 whenever the report was written.")
@options.EXCLUDE
@options.JOBS
@options.STRICT
@options.FORCE
@options.QUIET
@options.LIMITS
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
    exit_zero: bool,
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
    from pidcfg.cli.files.report_inputs import gathered
    from pidcfg.report.compose import compose, renamed
    from pidcfg.report.content import Title

    if out is None and csv is None and xlsx is None:
        out = PAGE
    if sheet and full:
        raise click.UsageError("--sheet and --full: a sheet for the door has no more than the main values")
    printed = _browser() if out is not None and Path(out).suffix.lower() == PDF else None
    _have("page" if out is not None else None, "xlsx" if xlsx is not None else None)
    pictures = out is not None and not sheet
    inputs = gathered(paths, limits, _progress, pictures=pictures, jobs=options.processes(jobs))
    block = Title(title, project, customer, plant, document, revision, author, date, __version__)
    complete = compose(block, list(inputs.files.values()), list(inputs.sheets.values()), inputs.runs, inputs.findings)
    content = renamed(complete, shortener([file.name for file in complete.files]))
    page: str | bytes | None = None if out is None else _page(content, sheet=sheet, full=full)
    if printed is not None and isinstance(page, str):
        page = _printed(page, printed)
    _write(content, page, (out, csv, xlsx), force=force)
    if not quiet:
        remark(summary(content, [name for name in (out, csv, xlsx) if name not in {None, STDOUT}]))
    for outcome in inputs.outcomes:
        if not outcome.passed:
            note(why_failed(outcome))
    click.get_current_context().exit(Exit.OK if exit_zero else exit_code(inputs, strict=strict))


def _have(*wanted: str | None) -> None:
    """Ends the command, before anything runs, where a package is not installed."""
    for what in wanted:
        for package in NEEDS.get(what or "", ()):
            need(package, "report")


def _progress(share: float) -> None:
    """What the line on the terminal shows."""
    LINE.update("simulating", share)


def shortener(names: Sequence[str]) -> Callable[[str], str]:
    """Names as a report shows them: those that are absolute from the folder that they have in common.

    On several drives there is none: then names stay as they are.
    """
    whole = [str(Path(name).parent) for name in names if Path(name).is_absolute()]
    try:
        base = os.path.commonpath(whole) if whole else ""
    except ValueError:
        return lambda name: Path(name).as_posix()
    return lambda name: Path(os.path.relpath(name, base)).as_posix() if Path(name).is_absolute() else name


def _browser() -> str:
    """The browser that prints; ends the command, before anything runs, where there is none."""
    from pidcfg.report.pdf import PdfError, browser

    try:
        return browser()
    except PdfError as error:
        raise click.ClickException(str(error)) from None


def _page(content: Content, *, sheet: bool, full: bool) -> str:
    from pidcfg.report.page import door_sheet, page

    return door_sheet(content) if sheet else page(content, full=full)


def _printed(html: str, path: str) -> bytes:
    from pidcfg.report.pdf import PdfError, pdf

    try:
        return pdf(html, path)
    except PdfError as error:
        raise click.ClickException(str(error)) from None


def _write(
    content: Content, page: str | bytes | None, names: tuple[str | None, str | None, str | None], *, force: bool
) -> None:
    """All files or none; the page goes to standard output last. ``names``: of the page, the folder, the workbook."""
    from pidcfg.cli.files.outputs import write_files
    from pidcfg.report.tables import tables_of

    out, csv, xlsx = names
    files: dict[str, str | bytes] = {}
    if csv is not None:
        from pidcfg.report.csv_files import csv_files

        files |= {(Path(csv) / name).as_posix(): text for name, text in csv_files(tables_of(content)).items()}
    if xlsx is not None:
        from pidcfg.report.workbook import workbook

        files[xlsx] = workbook([table for table in tables_of(content) if table.rows], content.title)
    if out not in {None, STDOUT} and page is not None:
        files[str(out)] = page
    with _folder(csv):
        write_files(files, force=force)
    if isinstance(page, str) and out == STDOUT:
        echo_xml(page)


@contextmanager
def _folder(name: str | None) -> Iterator[None]:
    """A folder that is made where there is none, with those above it; what was made goes when nothing is written."""
    missing = [] if name is None else [path for path in (Path(name), *Path(name).parents) if not path.exists()]
    written = False
    try:
        for path in reversed(missing):
            path.mkdir()
        yield
        written = True
    except OSError as error:
        raise click.ClickException(f"cannot make the folder {name}: {error.strerror}") from None
    finally:
        for path in () if written else missing:
            with suppress(OSError):
                path.rmdir()


def summary(content: Content, names: Sequence[str]) -> str:
    """One line on what was written."""
    from pidcfg.report.page import counts

    passed, total = content.verdicts
    loops, runs = len(content.loops), len(content.runs)
    parts = [f"{loops} loop{'' if loops == 1 else 's'}", f"{runs} run{'' if runs == 1 else 's'}"]
    parts += [f"{n} {label}{'' if n == 1 else 's'}" for label, n in counts(content).items()]
    parts += [f"{passed} of {total} expectations passed"] if total else []
    return f"{', '.join(names) or 'report'}: {', '.join(parts)}"


def why_failed(outcome: Outcome) -> str:
    """Which expectations of a run failed, the standing ones included, and how it was judged."""
    from pidcfg.cli.formats.simulation_text import failures, in_a_line

    return ("" if outcome.report is None else failures(outcome.report)) + in_a_line(outcome)


def exit_code(content: Gathered, *, strict: bool) -> Exit:
    """As validate and simulate would end; what is unusable outweighs what was found."""
    from pidcfg.cli.commands import simulate, validate

    return max(validate.exit_code(content.findings, strict=strict), simulate.exit_code(content.outcomes, strict=strict))
