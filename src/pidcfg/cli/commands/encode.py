"""``pidcfg encode``: a configuration to the PLC's memory."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from pidcfg.cli import options
from pidcfg.cli.console import echo, echo_json, echo_xml, write_note, write_remark
from pidcfg.cli.main import Exit
from pidcfg.cli.options import refuse_all, usage_errors
from pidcfg.vendors import format_names

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from pidcfg.cli.inputs import Input
    from pidcfg.encoders.listing import FileKind
    from pidcfg.text.document import Document
    from pidcfg.text.reader import Limits

EPILOG = options.examples_text(
    "pidcfg encode reactor.yaml",
    "pidcfg encode reactor.yaml --format ihex -o reactor.hex --checklist",
    "pidcfg encode reactor.yaml --format json | jq '.words[0]'",
    "pidcfg encode tank.yaml --format nickname-csv --into project.csv -o merged.csv",
    "pidcfg encode reactor.yaml --format modbus --changed-from upload.csv -o changes.csv",
    "pidcfg encode reactor.yaml --changed-from reactor-before.yaml",
    "pidcfg encode kiln.yaml --format modbus --map kiln-map.csv",
)


PRINTERS = {"json": echo_json, "plcopen": echo_xml}
"""Formats that say in which encoding they are, and how they are printed on another one."""


@click.command("encode", epilog=EPILOG)
@click.argument("file")
@options.output_format(*format_names())
@options.OUTPUT_OPTION
@options.FORCE_OPTION
@click.option(
    "--allow-errors", is_flag=True, help="Encode although validate reports errors, to see what the PLC would do."
)
@click.option(
    "--into",
    metavar="FILE",
    help="A file of yours that the format adds to, such as a tag list. It is not changed itself.",
)
@click.option(
    "--changed-from",
    metavar="OLD",
    help="Write only what differs from this listing, without what the PLC or the process writes, or configuration.",
)
@click.option(
    "--checklist", "whole_checklist", is_flag=True, help="List what a person checks after the download, on stderr."
)
@click.option("--live", is_flag=True, help="With --changed-from: also words that the PLC or the process writes.")
@options.MAP_OPTION
@options.STDIN_FILENAME_OPTION
@options.QUIET_OPTION
@options.LIMITS_OPTION
def command(
    file: str,
    fmt: str,
    out: str | None,
    force: bool,
    allow_errors: bool,
    into: str | None,
    changed_from: str | None,
    whole_checklist: bool,
    live: bool,
    map_path: str | None,
    quiet: bool,
    limits: Limits,
) -> None:
    """Write the PLC's memory for the configuration FILE (- for standard input): every word with its address."""
    from pidcfg.api import encode
    from pidcfg.cli.findings import exit_code, show_errors
    from pidcfg.cli.options import map_file
    from pidcfg.encoders.listing import CONFLICT, ListingError, UnwritableError
    from pidcfg.encoders.modbus_map import UnusableMapError

    configuration, others = _read_inputs(file, (into, changed_from), fmt, limits)
    (data, name), (old, old_name) = others
    try:
        with usage_errors():
            result = encode(
                configuration,
                fmt,
                into=data,
                into_name=name,
                changed_from=old,
                changed_from_name=old_name,
                live=live,
                allow_errors=allow_errors,
                map=map_file(map_path, limits),
                limits=limits,
            )
    except (UnwritableError, ListingError) as error:
        raise click.ClickException(f"{file}: {error}") from None
    except UnusableMapError as error:
        raise click.ClickException(str(error)) from None
    if result.kind is None:
        show_errors(result.findings, result.document, fmt)
        write_note("nothing was written")
        click.get_current_context().exit(exit_code(result.findings))
    if not result.ok:
        finding = result.findings[-1]
        raise click.ClickException(f"{finding.file}:{finding.span.line}:{finding.span.column}: {finding.message}")
    names = _put_files(result.kind, result.files, out, force=force)
    conflicts = [line for line in result.merged if line.startswith(CONFLICT)]
    for line in conflicts if quiet else result.merged:
        write_note(line)
    has_mention = changed_from is None and (out is not None or not result.kind.carries_checklist)
    tell_checklist(result.checklist, full=whole_checklist, mention=has_mention and not quiet)
    if not quiet:
        tell_written(result.kind, names, len(result.image.cells))
    if conflicts:
        click.get_current_context().exit(Exit.FINDINGS)


def _read_inputs(
    file: str, others: Sequence[str | None], fmt: str, limits: Limits
) -> tuple[Document, list[tuple[bytes, str] | tuple[None, None]]]:
    """The configuration, and the files that the format adds to or that are compared with.

    What is wrong with any of them ends the command, in order.
    """
    from pidcfg.api import encode
    from pidcfg.cli.findings import load_configuration, show_errors
    from pidcfg.cli.inputs import read_input

    configuration, faults = None, []
    try:
        configuration = load_configuration(file, limits)
    except click.UsageError:
        raise
    except click.ClickException as error:
        faults.append(error.message)
    inputs = [None if name is None else read_input(name, limits) for name in others]
    problems = [problem for entry in inputs if entry is not None and (problem := _input_problem(entry)) is not None]
    if problems:
        faults += problems
        if configuration is not None and not (encoded := encode(configuration, limits=limits)).ok:
            show_errors(encoded.findings, encoded.document, fmt)
    if faults or configuration is None:
        refuse_all(faults)
    return configuration, [(None, None) if entry is None else (entry.data, entry.name) for entry in inputs]


def _input_problem(entry: Input) -> str | None:
    """Why a file cannot be used."""
    if entry.problem is None and len(entry.data) > entry.limits.listing_bytes:
        return f"{entry.name} is larger than {entry.limits.listing_bytes} bytes; raise it with --limit"
    return entry.problem


def tell_checklist(checklist: Sequence[str], *, full: bool, mention: bool) -> None:
    """What a person has to check after the download; ``mention``: how much that is, in one line."""
    if full:
        for item in checklist or ("nothing",):
            write_remark(f"check after the download: {item}")
    elif mention and checklist:
        count_text = "1 thing" if len(checklist) == 1 else f"{len(checklist)} things"
        write_remark(f"{count_text} to check after the download: see --checklist")


def tell_written(kind: FileKind, names: list[str], values: int) -> None:
    """What was written."""
    if names:
        count = f"{values} values" if kind.is_complete else kind.title
        write_remark(f"{', '.join(names)}: {count}")


def _put_files(kind: FileKind, parts: Mapping[str, str], out: str | None, *, force: bool) -> list[str]:
    """Writes the texts, to standard output without ``out``; returns the names of the files."""
    from pidcfg.cli.outputs import write_files

    if parts and out is not None:
        files = {part_name(out, suffix): text.encode(kind.encoding) for suffix, text in parts.items()}
        write_files(files, force=force)
        return list(files)
    if not parts:
        write_note("nothing differs")
        return []
    if len(parts) > 1 or kind.encoding != "utf-8":
        raise click.UsageError(f"{kind.name} is not for a terminal; name its file with -o")
    PRINTERS.get(kind.name, echo)(next(iter(parts.values())))
    return []


def part_name(path: str, suffix: str) -> str:
    """The name of one file of several: the suffix before the extension."""
    if not suffix:
        return path
    stem, dot, extension = path.rpartition(".")
    return f"{stem}-{suffix}.{extension}" if dot and "/" not in extension else f"{path}-{suffix}"
