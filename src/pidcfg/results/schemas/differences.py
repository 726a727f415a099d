"""Differences of two configurations."""

from __future__ import annotations

from typing import get_args

from pidcfg.differences.result import RISKS, Status
from pidcfg.results.schemas import findings
from pidcfg.results.schemas.parts import VERSION, Schema, anything, count, listing, record, text
from pidcfg.results.schemas.verification import verified


def schema() -> Schema:
    """Loops and their differences; or findings, when a file cannot be compared."""
    counts = {risk: count("Differences of this risk.") for risk in RISKS}
    counts |= {status: count("Loops of this status.") for status in get_args(Status)}
    report = record(
        "How two configurations differ.",
        ("verify",),
        version=VERSION,
        from_=text("The first file."),
        to=text("The second file."),
        loops=listing("One a loop.", loop()),
        summary=record("How many there are.", **counts),
        verify=listing("With --verify: the verdict of the battery.", verified()),
    )
    return {"oneOf": [report, findings.schema()]}


def loop() -> Schema:
    """A loop on both sides, or on one."""
    return record(
        "A loop.",
        loop=text("Its name."),
        status=text("The same, changed, or on one side only.", *get_args(Status)),
        differences=listing(
            "The gravest first.",
            record(
                "A field that differs.",
                field=text("Its key."),
                risk=text("What can go wrong.", *RISKS),
                from_=anything("The value before."),
                to=anything("The value after."),
                note=text("What it means; may be empty."),
            ),
        ),
    )
