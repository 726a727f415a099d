"""``pidcfg diff``: two configurations, or a configuration and a memory listing, compared by meaning."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import click

from pidcfg.cli import options
from pidcfg.cli.files import plots
from pidcfg.cli.formats import report_options
from pidcfg.cli.main import Exit
from pidcfg.cli.terminal.console import echo_json, note
from pidcfg.diagnostics import Diagnostic, Severity, Span
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from pidcfg.differences.meaning import Compared, Difference, Side
    from pidcfg.limits import Limits
    from pidcfg.vendors import Vendor

EPILOG = options.examples(
    "pidcfg diff main.yaml branch.yaml",
    "pidcfg diff reactor.yaml upload.hex --vendor dl06",
    "pidcfg diff reactor.yaml reactor-click.yaml --format markdown",
    "pidcfg diff main.yaml branch.yaml --output markdown=changes.md --output json=changes.json",
    "pidcfg diff main.yaml branch.yaml --plot before-after.svg",
)


@click.command("diff", epilog=EPILOG)
@click.argument("before")
@click.argument("after")
@click.option(
    "--vendor",
    type=click.Choice(list(VENDORS)),
    help="The PLC family of a memory listing, where the other side does not tell.",
)
@report_options.report_format("diff")
@report_options.report_files("diff")
@plots.OVERLAY
@options.FORCE
@click.option("--exit-code", "exits", is_flag=True, help="Exit 1 when there are differences.")
@options.LIMITS
def command(
    before: str,
    after: str,
    vendor: str | None,
    fmt: str,
    reports: tuple[report_options.Report, ...],
    plot: tuple[str, ...],
    force: bool,
    exits: bool,
    limits: Limits,
) -> None:
    """Compare BEFORE and AFTER, configurations of any vendors or memory listings, in engineering units.

    Loops are matched by name, then by their order. Differences are ranked by what can go wrong.
    """
    from pidcfg.differences.meaning import compare
    from pidcfg.scenario import diff_charts

    report_options.refuse_outputs((*plot, *(report.path for report in reports)), (before, after))
    if fmt != "text" and plots.TERMINAL in plot:
        raise click.UsageError(f"--plot - and --format {fmt} would both go to standard output; name a file")
    sides, sources = read_sides((before, after), vendor, limits, fmt)
    found = compare(*sides)
    charts = diff_charts.charts_of(sides, sources, (before, after)) if plot else []
    pictures = plots.drawn(plot, charts, f"{Path(before).name} and {Path(after).name}")
    writers = {"text": as_text, "json": as_json, "markdown": as_markdown}
    report_options.deliver(fmt, reports, lambda name: writers[name](before, after, found), pictures, force=force)
    if plots.TERMINAL in plot:
        plots.show(charts)
    if exits and any(entry.status != "same" for entry in found):
        click.get_current_context().exit(Exit.FOUND)


def read_sides(
    names: tuple[str, str], vendor: str | None, limits: Limits, fmt: str
) -> tuple[tuple[Side, Side], list[tuple[Any, Vendor]]]:
    """Both sides, and the configurations they were made of.

    A listing is of the vendor that is named, or of the other side's.
    """
    configurations = [_configuration(name, limits, fmt) for name in names]
    told = [found[1] for found in configurations if found is not None]
    known = VENDORS[vendor] if vendor else told[0] if told else None
    beside = next((found[0] for found in configurations if found is not None), None)
    sources = [
        found if found is not None else _listing(name, known, beside, limits, fmt)
        for name, found in zip(names, configurations, strict=True)
    ]
    one, two = (_side(name, *source, fmt) for name, source in zip(names, sources, strict=True))
    return (one, two), sources


def _configuration(name: str, limits: Limits, fmt: str) -> tuple[Any, Vendor] | None:
    """A YAML file's configuration; None for a file of another kind."""
    from pidcfg.cli.files.inputs import STDIN
    from pidcfg.cli.findings.collect import one_configuration, show_errors

    if name != STDIN and Path(name).suffix.lower() not in {".yaml", ".yml"}:
        return None
    checked = one_configuration(name, limits)
    if checked.vendor is None or checked.encoding is None or not checked.encoding.whole:
        show_errors(checked, fmt)
        raise click.ClickException(f"{name} cannot be compared")
    return checked.config, checked.vendor


def _refuse(fmt: str, name: str, message: str, found: Sequence[Diagnostic]) -> NoReturn:
    """Ends the command with what is wrong with a side: as the result where JSON was asked for."""
    from pidcfg.cli.formats.reporters import json_v1
    from pidcfg.source import Document, Node

    if fmt == "json":
        echo_json(json_v1(found, {name: Document(name, "", None, Node(None))}))
    raise click.ClickException(message)


def _listing(name: str, vendor: Vendor | None, other: Any, limits: Limits, fmt: str) -> tuple[Any, Vendor]:
    """A memory listing's configuration; names and ranges that it does not carry are those of the ``other`` side."""
    from pidcfg.cli.files.inputs import document, read_input
    from pidcfg.cli.files.listings import decode_listing, read_listing
    from pidcfg.encoders.listing import ListingError

    if vendor is None:
        raise click.UsageError("neither file says the PLC family; name it with --vendor")
    entry = read_input(name, limits)
    if entry.problem is not None:
        _refuse(fmt, name, entry.problem, document(entry, limits).problems)
    try:
        listing = read_listing(entry, vendor, limits)
        if other is not None:
            image = vendor.encoder(other).image
            listing.settings, listing.plc = _completed(listing.settings, image.settings), {**image.plc, **listing.plc}
        decoded = decode_listing(listing, vendor, {})
    except ListingError as error:
        cure = f"decode it first: pidcfg decode {name} --vendor {vendor.key}"
        span = Span(error.line, error.column, error.line, error.column + 1)
        found = Diagnostic("PID041", Severity.ERROR, str(error), entry.name, span, help=cure)
        _refuse(fmt, name, f"{name}:{error.line}: {error}; {cure}", [found])
    return vendor.model.model_validate(decoded.data), vendor


def _completed(settings: Sequence[Mapping[str, Any]], other: Sequence[Mapping[str, Any]]) -> Any:
    """Settings of a listing with what only the other side says of the loop with the same name."""
    if not settings:
        return other
    by_name = {entry.get("loop"): entry for entry in other}
    return tuple(_merged(by_name.get(entry.get("loop"), {}), entry) for entry in settings)


def _merged(under: Mapping[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    found = {**under, **over}
    for key in under.keys() & over.keys():
        if isinstance(under[key], dict) and isinstance(over[key], dict):
            found[key] = _merged(under[key], over[key])
    return found


def _side(name: str, config: Any, vendor: Vendor, fmt: str) -> Side:
    from pidcfg.conversion.pipeline import ConvertError
    from pidcfg.differences.meaning import side_of

    try:
        return side_of(config, vendor)
    except ConvertError as error:
        for entry in error.missing:
            note(f"{name}: {entry.message}")
        missing = [Diagnostic("PID042", Severity.ERROR, row.message, name, path=row.path) for row in error.missing]
        _refuse(fmt, name, f"{name} does not say what its values mean", missing)


# --- output ----------------------------------------------------------------------------------------------------------


def summary(found: list[Compared]) -> dict[str, int]:
    """Differences by risk, and loops by status."""
    from pidcfg.differences.meaning import RISKS

    count = Counter(difference.risk for entry in found for difference in entry.differences)
    statuses = Counter(entry.status for entry in found)
    return {risk: count[risk] for risk in RISKS} | {s: statuses[s] for s in ("same", "changed", "added", "removed")}


def as_json(before: str, after: str, found: list[Compared]) -> str:
    """The layout of the public interface, version 1."""
    loops = [
        {
            "loop": entry.loop,
            "status": entry.status,
            "differences": [
                {"field": d.field, "risk": d.risk, "from": d.before, "to": d.after, "note": d.note}
                for d in entry.differences
            ],
        }
        for entry in found
    ]
    document = {"version": 1, "from": before, "to": after, "loops": loops, "summary": summary(found)}
    return json.dumps(document, indent=2, ensure_ascii=False) + "\n"


def as_text(before: str, after: str, found: list[Compared]) -> str:
    """Loops that differ, the gravest difference first."""
    lines = [f"{before} -> {after}"]
    for entry in found:
        if entry.status in {"added", "removed"}:
            lines += ["", f"{entry.loop}: {entry.status}"]
        elif entry.differences:
            lines += ["", entry.loop, *(_row(d) for d in entry.differences)]
    same = [entry.loop for entry in found if entry.status == "same"]
    if same:
        lines += ["", f"the same: {', '.join(same)}"]
    return "\n".join(lines) + "\n"


def _row(d: Difference) -> str:
    from pidcfg.conversion.pipeline import text_of

    note_text = f"  ({d.note})" if d.note else ""
    return f"  {d.risk:<8}  {d.field}: {text_of(d.before)} -> {text_of(d.after)}{note_text}"


def as_markdown(before: str, after: str, found: list[Compared]) -> str:
    """Tables for a pull request."""
    from pidcfg.cli.formats.markdown import cell
    from pidcfg.conversion.pipeline import text_of

    lines = [f"### PID loops: `{before}` to `{after}`"]
    for entry in found:
        if entry.status in {"added", "removed"}:
            lines += ["", f"**{entry.loop}** {entry.status}"]
        elif entry.differences:
            lines += ["", f"**{entry.loop}**", "", "| risk | field | before | after | |", "|---|---|---|---|---|"]
            lines += [
                "| "
                + " | ".join(cell(t) for t in (d.risk, d.field, text_of(d.before), text_of(d.after), d.note))
                + " |"
                for d in entry.differences
            ]
    if all(entry.status == "same" for entry in found):
        lines += ["", "No difference."]
    return "\n".join(lines) + "\n"
