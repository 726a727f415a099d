"""The report of a conversion."""

from __future__ import annotations

from pidcfg.conversion.ledger import WORST
from pidcfg.results.schemas import findings
from pidcfg.results.schemas.parts import (
    VERSION,
    Schema,
    anything,
    listing,
    number,
    or_null,
    record,
    switch,
    text,
)
from pidcfg.results.schemas.verification import verified
from pidcfg.vendors import VENDORS


def schema() -> Schema:
    """What became of every field; or findings, when the file cannot be converted."""
    report = record(
        "What became of every field.",
        ("verify",),
        version=VERSION,
        from_=text("The PLC family of the file.", *VENDORS),
        to=text("The PLC family that it was converted to.", *VENDORS),
        loops=listing(
            "One a loop.",
            record(
                "A loop.",
                loop=text("Its name."),
                status=text("Whether it went over.", "converted", "dropped"),
                reason=or_null(text("Why it was dropped.")),
                changes=listing("Of all fields.", change()),
            ),
        ),
        findings=listing("What the target's own rules find at fault in the result.", findings.finding()),
        verify=listing("With --verify: the verdict of the battery.", verified()),
    )
    return {"oneOf": [report, findings.schema()]}


def change() -> Schema:
    """What became of a field."""
    return record(
        "What became of a field.",
        field=text("Its key; in the source where that has one, else in the result."),
        target_field=or_null(text("Its key in the result.")),
        kind=text("From harmless to harmful.", *WORST),
        from_=anything("The value before."),
        to=anything("The value after."),
        error_percent=number("How far the value that acts is off."),
        loss=switch("Whether it needs leave: dropped, clamped, or rounded beyond --max-loss."),
        neutral=or_null(
            record(
                "A number that is not exact, both sides in one unit.",
                field=text("Its neutral field."),
                from_=number("What was wanted."),
                to=number("What the target holds."),
                unit=text("Of both; may be empty."),
            )
        ),
        note=text("What it means; may be empty."),
    )
