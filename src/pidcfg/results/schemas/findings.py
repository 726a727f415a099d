"""Findings, as ``validate`` prints them, and the others when they cannot use a file."""

from __future__ import annotations

from pidcfg.diagnostics import Severity
from pidcfg.results.schemas.parts import VERSION, Schema, count, listing, or_null, record, text


def schema() -> Schema:
    """All findings, and how many there are."""
    return record(
        "What was found in all files.",
        version=VERSION,
        findings=listing("By file and place.", finding()),
        summary=record(
            "How many files were looked at, and how many findings of each kind are listed.",
            files=count("Files that were looked at."),
            errors=count("Findings that fail the run."),
            warnings=count("Findings that fail it under --strict."),
            infos=count("What is worth knowing."),
        ),
    )


def finding() -> Schema:
    """One finding."""
    return record(
        "One finding.",
        code={
            "description": "The rule; pidcfg rule CODE explains it.",
            "type": "string",
            "pattern": "^[A-Z]{2,3}[0-9]{3}$",
        },
        severity=text("How bad it is.", *(severity.label for severity in reversed(Severity))),
        message=text("What is wrong, with the value."),
        file=text("The file as it was named, with forward slashes; <stdin> for standard input."),
        line=count("Where the value is written; the first line is 1.", 1),
        column=count("The first column is 1; columns are Unicode code points.", 1),
        path=text("The key, such as loops[1].tuning.reset; empty for the file as a whole."),
        loop=text("The loop that it concerns; empty where it concerns none."),
        with_=listing("The other loops of the same fault; each has a finding that names this one.", text("A loop.")),
        plc_effect=or_null(text("What the PLC would do.")),
        reference=or_null(text("The place in the manual, or the decision, that the rule rests on.")),
        help=or_null(text("The cure.")),
    )
