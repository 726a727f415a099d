"""Differences of two configurations."""

from __future__ import annotations

from typing import get_args

from pidcfg.differences.result import RISKS, Status
from pidcfg.results.schemas import findings
from pidcfg.results.schemas.parts import VERSION, Schema, anything, count, listing, or_null, record, text
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
        loops=listing("One a loop; one without a name is the rest of the file.", loop()),
        summary=record("How many there are.", **counts),
        notes=listing("What a listing did not say, or could not be read of it.", text("A note.")),
        verify=listing("With --verify: the verdict of the battery.", verified()),
    )
    return {"oneOf": [report, findings.schema()]}


def loop() -> Schema:
    """A loop on both sides, or on one."""
    place = record("Where its registers begin.", from_=text("Before."), to=text("After."))
    return record(
        "A loop.",
        loop=text("Its name; empty: what belongs to no loop."),
        status=text("What became of it; one that is renamed or moved may have differences.", *get_args(Status)),
        was=or_null(text("Its name before, where it is another one.")),
        moved=or_null(place),
        differences=listing("The gravest first.", difference()),
        operated=listing("What the operator sets; no difference.", difference()),
        left_out=listing("Keys of words that differ and that the PLC or the process writes.", text("A key.")),
        missing=listing("Keys that a listing does not hold.", text("A key.")),
    )


def difference() -> Schema:
    """A key that differs."""
    return record(
        "A key that differs.",
        field=text("The field of the neutral form, else the key."),
        key=or_null(text("The key of the file; null between two vendors.")),
        risk=text("What can go wrong.", *RISKS),
        from_=anything("The value before; null: not given."),
        to=anything("The value after; null: not given."),
        unit=text("The unit of both values; may be empty."),
        address=or_null(text("The register; null: none holds it.")),
        word_from=or_null(text("The content of the register before, as the PLC shows it.")),
        word_to=or_null(text("The content after.")),
        note=text("What it means; may be empty."),
    )
