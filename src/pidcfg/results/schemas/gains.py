"""Gains by a tuning rule."""

from __future__ import annotations

from pidcfg.results.schemas.parts import (
    VERSION,
    Schema,
    listing,
    number,
    or_null,
    record,
    switch,
    text,
)
from pidcfg.tuning.rules import METHODS
from pidcfg.vendors import VENDORS

PROCESS = ("gain", "time_constant", "dead_time", "closed_loop", "sample_time", "ultimate_gain", "ultimate_period")


def schema() -> Schema:
    """What a rule made of a process."""
    return record(
        "Gains in engineering units and seconds.",
        ("for",),
        version=VERSION,
        method=text("The rule.", *METHODS),
        title=text("The rule in words."),
        form=text("The controller.", "P", "PI", "PID"),
        basis=text("The manual's place or the decision."),
        process=record("What was given or identified.", PROCESS, **{key: number("As given.") for key in PROCESS}),
        gain=number("Output units per PV unit."),
        integral_time=or_null(number("In s; null: no integral term.")),
        derivative_time=number("In s."),
        independent=record(
            "The same as independent gains.",
            kp=number("Proportional gain."),
            ki=number("Per s."),
            kd=number("In s."),
        ),
        heating=or_null(switch("Whether the PV rises with the output; null where the process's gain is not known.")),
        warnings=listing("What the rule's authors warn of.", text("A warning.")),
        identified=identified(),
        for_=for_vendor(),
    )


def identified() -> Schema:
    """The process that --from-csv identifies."""
    process = record(
        "The process of a recorded step; null without --from-csv.",
        gain=number("PV units per output unit."),
        time_constant=number("In s."),
        dead_time=number("In s."),
        step_at=number("When the output stepped, in s."),
        noise=number("Of the PV, in its unit."),
        misfit_percent=number("What the model leaves unexplained."),
    )
    return or_null(process)


def for_vendor() -> Schema:
    """The gains as a PLC holds them."""
    value = record(
        "A parameter.",
        key=text("Its key in the file."),
        unit=text("Its unit."),
        value=number("What was wanted."),
        stored=or_null(number("What the PLC holds; null where it cannot.")),
        error_percent=number("How far that is off."),
        problem=or_null(text("Why it cannot.")),
    )
    return record(
        "With --for.",
        vendor=text("The PLC family.", *VENDORS),
        action=or_null(text("The loop's action; null where the process's gain is not known.")),
        values=listing("One a parameter.", value),
    )
