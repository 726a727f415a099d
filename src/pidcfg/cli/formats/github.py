"""Format ``github``: workflow commands, which GitHub shows as annotations beside the lines of a pull request."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.cli.formats.findings import STDIN, details, display_name
from pidcfg.cli.formats.format import Format, Kind
from pidcfg.control_characters import printable
from pidcfg.diagnostics import Diagnostic, Severity

if TYPE_CHECKING:
    from pidcfg.cli.formats.findings import Findings

COMMANDS = {Severity.ERROR: "error", Severity.WARNING: "warning", Severity.INFO: "notice"}
DATA = {"%": "%25", "\r": "%0D", "\n": "%0A"}
PROPERTY = {**DATA, ":": "%3A", ",": "%2C"}


def findings_github(findings: Findings) -> str:
    """One command a finding."""
    return "".join(f"{_command(d)}\n" for d in findings.reported)


def _command(d: Diagnostic) -> str:
    loop = f" [{d.loop}]" if d.loop else ""
    values = {} if d.file == STDIN else _place(d)
    values["title"] = f"pidcfg {d.code}{loop}"
    properties = ",".join(f"{key}={escaped(value, PROPERTY)}" for key, value in values.items())
    place = f"{d.file}:{d.span.line}:{d.span.column}: " if d.file == STDIN else ""
    return f"::{COMMANDS[d.severity]} {properties}::{escaped(place + chr(10).join(details(d)), DATA)}"


def _place(d: Diagnostic) -> dict[str, str]:
    """GitHub takes a column only together with a single line."""
    values = {"file": display_name(d.file), "line": str(d.span.line), "endLine": str(d.span.end_line)}
    return values | ({"col": str(d.span.column)} if d.span.line == d.span.end_line else {})


def escaped(text: str, table: dict[str, str]) -> str:
    """Text whose special characters are written as GitHub's runner reads them back; other control characters go."""
    return printable("".join(table.get(c, c) for c in text))


FORMAT = Format("annotations in GitHub Actions; the default there", "github", Kind.ORDERS, findings_github)
