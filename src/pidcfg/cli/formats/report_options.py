"""The options of commands that report: what is printed, and further formats that are written to files beside it."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import click

from pidcfg.cli.console import echo_json, echo_xml, show_ci_commands, show_lines, show_text, write_note
from pidcfg.cli.formats import Kind, formats_of, load_format
from pidcfg.cli.inputs import equal_file_fault, file_identity, was_read
from pidcfg.text.signs import to_printable

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from pidcfg.cli.options import Decorator

CONFIGURATION_ENDINGS = {".yaml", ".yml", ".toml"}
"""How files end that people write: a report never takes the place of one."""
PRINTERS = {
    Kind.PLAIN: show_text,
    Kind.LINES: show_lines,
    Kind.CI_COMMANDS: show_ci_commands,
    Kind.JSON: echo_json,
    Kind.XML: echo_xml,
}


class Report(NamedTuple):
    """A file that is to be written in a format."""

    fmt: str
    path: str


def report_format(command: str) -> Decorator:
    """``--format`` of a command; where none is named, the first one, or GitHub's in a job of GitHub Actions."""
    names = formats_of(command)
    has_github = "github" in names

    def choose_format(ctx: click.Context, param: click.Parameter, value: str | None) -> str:
        del ctx, param
        in_github = has_github and os.environ.get("GITHUB_ACTIONS") == "true"
        return value or ("github" if in_github else names[0])

    default = f"{names[0]}; github in GitHub Actions" if has_github else names[0]
    return click.option(
        "--format",
        "fmt",
        type=click.Choice(names),
        callback=choose_format,
        show_default=default,
        help="How the result is printed.",
    )


def report_files(command: str, *former_names: str) -> Decorator:
    """``--report-output FORMAT=PATH`` of a command, as often as wanted; ``former_names``: its old names."""
    names = formats_of(command)

    def parse_all(ctx: click.Context, param: click.Parameter, values: Sequence[str]) -> tuple[Report, ...]:
        try:
            return refuse_equal_paths([parse_report(text, names) for text in values])
        except ValueError as error:
            raise click.BadParameter(str(error), ctx, param) from None

    return click.option(
        "--report-output",
        *former_names,
        "reports",
        multiple=True,
        metavar="FORMAT=PATH",
        callback=parse_all,
        help=f"Also write {', '.join(names)} to a file, anew on every run; repeatable.",
    )


def parse_report(text: str, names: Sequence[str]) -> Report:
    """One value of the option; a ValueError says what is wrong with it."""
    from pidcfg.text.reader import is_stream

    fmt, equals, path = text.partition("=")
    if not equals or fmt not in names:
        raise ValueError(f"{text!r}; write FORMAT=PATH with one of {', '.join(names)}")
    if path in {"", "-"}:
        raise ValueError(f"{text!r} names no file; --format {fmt} prints")
    target = Path(path)
    if target.is_dir():
        raise ValueError(f"{path} is a folder; name a file")
    if is_stream(path) or (target.exists() and not target.is_file()):
        raise ValueError(f"{path} is no regular file; name one, or leave the option out: --format {fmt} prints")
    if not target.parent.is_dir():
        raise ValueError(f"the folder {target.parent} of {path} does not exist; make it first")
    if target.suffix.lower() in CONFIGURATION_ENDINGS and target.exists():
        raise ValueError(f"{path} exists and may be a configuration; give the report another name")
    return Report(fmt, path)


def refuse_equal_paths(reports: Sequence[Report]) -> tuple[Report, ...]:
    """The reports, if each goes to a file of its own."""
    problem = equal_file_fault([report.path for report in reports])
    if problem is not None:
        raise ValueError(problem)
    return tuple(reports)


def refuse_inputs(reports: Sequence[Report], names: Iterable[str], reason: str = "is a file that is read") -> None:
    """Ends the command when a report would take the place of one of these files."""
    if not reports:
        return
    input_files = {file_identity(name) for name in names}
    for report in reports:
        if file_identity(report.path) in input_files:
            raise click.UsageError(f"{report.path} {reason}; give the report another name")


def refuse_outputs(names: Iterable[str | None], inputs: Iterable[str] = ()) -> None:
    """Ends the command before it runs when an output would take the place of another one, or of one of its inputs."""
    outputs = [name for name in names if name is not None and name != "-"]
    input_files = {file_identity(name) for name in inputs}
    problem = equal_file_fault(outputs)
    if problem is not None:
        raise click.UsageError(problem)
    for name in outputs:
        if file_identity(name) in input_files or was_read(name):
            raise click.UsageError(f"{name} is a file that is read; give the output another name")


def refuse_missing_folder(names: Iterable[str | None]) -> None:
    """Ends the command before it runs where an output has no folder to lie in."""
    for name in names:
        if name not in {None, "-"} and not Path(str(name)).parent.is_dir():
            raise click.UsageError(f"{name}: there is no folder {Path(str(name)).parent.as_posix()}; make it first")


def write_reports(
    reports: Sequence[Report],
    render: Callable[[str], str],
    other_files: Mapping[str, str | bytes] | None = None,
    *,
    force: bool = False,
) -> None:
    """Writes the reports, all or none, and with them ``other_files``, which never replace a file that differs."""
    if not reports and not other_files:
        return
    from pidcfg.cli.outputs import write_files

    texts = {path: _report_text(fmt, render).encode("utf-8", "replace") for fmt, path in reports}
    write_files({**(other_files or {}), **texts}, force=force, rewritable=texts)


def _report_text(fmt: str, render: Callable[[str], str]) -> str:
    """A report without control characters; JSON and XML have their own ways."""
    return render(fmt) if load_format(fmt).kind in {Kind.JSON, Kind.XML} else to_printable(render(fmt))


def print_text(fmt: str, text: str, *, on_stderr: bool = False) -> None:
    """Prints a text that is in this format; ``on_stderr``: standard output has something else."""
    (write_note if on_stderr else PRINTERS[load_format(fmt).kind])(text)


def deliver_reports(
    fmt: str,
    reports: Sequence[Report],
    render: Callable[[str], str],
    other_files: Mapping[str, str | bytes] | None = None,
    *,
    force: bool = False,
    on_stderr: bool = False,
) -> None:
    """Prints one format and writes the others; what is printed is there even if a file cannot be written.

    ``on_stderr``: as `print_text` has it.
    """
    print_text(fmt, _report_text(fmt, render), on_stderr=on_stderr)
    write_reports(reports, render, other_files, force=force)
