"""``validate --statistics``: how often each rule has something to say, in place of what it says."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from pidcfg.results.findings import findings_data
from pidcfg.writer import json_text

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.cli.formats.findings import Findings

OPTION = click.option(
    "--statistics",
    "counted",
    is_flag=True,
    help="Print how many findings each rule has (text or json), not the findings.",
)


def fmt_of(ctx: click.Context, fmt: str) -> str:
    """The format of the counts: ``text`` or ``json``; another one that was asked for is refused."""
    if fmt in {"text", "json"}:
        return fmt
    if ctx.get_parameter_source("fmt") is ParameterSource.DEFAULT:  # that of GitHub's jobs
        return "text"
    raise click.UsageError(f"--statistics is printed as text or json, not as {fmt}", ctx)


def render(fmt: str, findings: Findings) -> str:
    """The counts as text or as JSON."""
    rows = list(_rows(findings))
    if fmt == "json":
        summary = findings_data(findings.reported, len(findings.documents))["summary"]
        return json_text({"version": 1, "statistics": rows, "summary": summary})
    width = max((len(str(row["count"])) for row in rows), default=0)
    return "".join(
        f"{row['count']:>{width}}  {row['code']:<6}  {row['severity']:<7}  {row['title']}"
        + (f" ({row['fixable']} correctable with --fix)" if row["fixable"] else "")
        + "\n"
        for row in rows
    )


def _rows(findings: Findings) -> Iterator[dict[str, Any]]:
    """A row a rule and severity, the most frequent first."""
    from pidcfg.validate.catalog import rule_of

    tally = Counter((d.code, d.severity) for d in findings.reported)
    fixable = Counter((d.code, d.severity) for d in findings.reported if d.edits)
    for (code, severity), number in sorted(tally.items(), key=lambda row: (-row[1], -row[0][1], row[0][0])):
        yield {
            "code": code,
            "severity": severity.label,
            "title": rule_of(code).title,
            "count": number,
            "fixable": fixable[code, severity],
        }
