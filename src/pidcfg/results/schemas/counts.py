"""Findings counted by their rules."""

from __future__ import annotations

from pidcfg.results.schemas.findings import finding
from pidcfg.results.schemas.findings import schema as findings
from pidcfg.results.schemas.parts import VERSION, Schema, count, listing, record, text


def schema() -> Schema:
    """How often each rule has something to say."""
    fields = finding()["properties"]
    row = record(
        "A rule, with one severity.",
        code=fields["code"],
        severity=fields["severity"],
        title=text("What is wrong."),
        count=count("Findings.", 1),
        fixable=count("Those that --fix corrects."),
    )
    return record(
        "Findings by rule.",
        version=VERSION,
        statistics=listing("The most frequent first.", row),
        summary=findings()["properties"]["summary"],
    )
