"""The documentation of rules."""

from __future__ import annotations

from pidcfg.results.schemas.findings import finding
from pidcfg.results.schemas.parts import VERSION, Schema, listing, record, text


def schema() -> Schema:
    """One rule, or a list of them."""
    fields = finding()["properties"]
    one = record(
        "A rule.",
        code=fields["code"],
        name=text("A name in words."),
        severity=fields["severity"],
        title=text("What is wrong."),
        message=text("The message, with the names of its values in braces."),
        why=text("Why that matters."),
        fix=text("The cure."),
        reference=text("The manual's place or the decision."),
        since=text("The version that has it first."),
    )
    alone = {**one, "properties": {"version": VERSION, **one["properties"]}, "required": ["version", *one["required"]]}
    several = record("Several rules.", version=VERSION, rules=listing("By code.", one))
    return {"oneOf": [alone, several]}
