"""The PLC's memory."""

from __future__ import annotations

from pidcfg.encoders.parameters import TYPES
from pidcfg.results.schemas import findings
from pidcfg.results.schemas.parts import VERSION, Schema, listing, or_null, record, text
from pidcfg.vendors import VENDORS

CONTENT: Schema = {"description": "As the vendor shows it.", "type": ["boolean", "number"]}
OPEN: Schema = {"description": "In the terms of the vendor.", "type": "object", "additionalProperties": True}


def schema() -> Schema:
    """Every word; or findings, when the file cannot be encoded."""
    image = record(
        "The PLC's memory for a configuration.",
        version=VERSION,
        vendor=text("The PLC family.", *VENDORS),
        words=listing("In the order of addresses.", {"oneOf": [register(), parameter(), wired()]}),
        settings=listing("What no register holds, an object a loop.", OPEN),
        plc=OPEN,
        checklist=listing("What a person should check after the download.", text("An item.")),
    )
    return {"oneOf": [image, findings.schema()]}


def register() -> Schema:
    """A register with an address."""
    return record(
        "A register.",
        address=text("As the vendor writes it."),
        value=CONTENT,
        hex=text("The raw content in hexadecimal digits."),
        loop=or_null(text("The loop that it belongs to.")),
        field=text("What it holds."),
    )


def parameter() -> Schema:
    """A parameter with a name."""
    return record("A parameter.", ("device",), **_named(), value={**CONTENT, "type": ["boolean", "number", "string"]})


def wired() -> Schema:
    """A parameter that follows an expression."""
    return record("A parameter that follows others.", ("device",), **_named(), expression=text("What it follows."))


def _named() -> dict[str, Schema]:
    return {
        "address": text("Its name."),
        "type": text("Its type.", *TYPES),
        "device": text("Its place in the PLC, where it has one."),
        "loop": or_null(text("The loop or block that it belongs to.")),
        "field": text("What it holds."),
    }
