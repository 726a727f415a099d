"""The verdict of the battery."""

from __future__ import annotations

from pidcfg.results.schemas.parts import Schema, anything, listing, number, or_null, record, switch, text


def verified() -> Schema:
    """One loop's verdict."""
    return record(
        "A loop.",
        loop=text("Its name."),
        passed=switch("Whether everything that differs is named by a line of the report."),
        pv_percent=number("The PVs at most apart in the step and the disturbance, in % of the range."),
        output_percent=number("The outputs at most."),
        iae_ratio=or_null(number("Integral of the absolute error, after to before.")),
        stages=listing("Those that were run.", text("Its name.")),
        not_tried=listing(
            "Those in which the source does not go to a mode that is asked of it.",
            record("A stage.", stage=text("Its name."), mode=text("The mode.")),
        ),
        differences=listing("What nothing explains.", difference(key=or_null(text("The key that explains it.")))),
        named=listing(
            "What a line of the report explains.",
            difference(
                line=or_null(text("The field of the line; null where several lines do it together.")),
                note=text("What it says; may be empty."),
            ),
        ),
    )


def difference(**more: Schema) -> Schema:
    """A signal that differs in a stage."""
    return record(
        "A signal in a stage.",
        stage=text("Its name."),
        signal=text("pv, output, setpoint, mode, run, or the name of an alarm."),
        at=number("The first time, in s from the beginning of the stage."),
        from_=anything("What the first side shows then; outputs as shares of the range."),
        to=anything("What the second side shows."),
        percent=or_null(number("How far a number lies apart at most, in % of its range.")),
        **more,
    )
