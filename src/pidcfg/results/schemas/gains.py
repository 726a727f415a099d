"""Gains by a tuning rule."""

from __future__ import annotations

from pidcfg.results.schemas.findings import finding
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
from pidcfg.tuning.methods import METHODS
from pidcfg.vendors import VENDORS

PROCESS = (
    "gain",
    "time_constant",
    "time_constant_2",
    "dead_time",
    "closed_loop",
    "sample_time",
    "ultimate_gain",
    "ultimate_period",
)
PLANT_KEYS = ("gain", "time_constant", "second_time_constant", "time_constant_2", "dead_time")
SURENESS = ("model", "fit", "confidence")
MODELS = ("first-order", "second-order", "integrating")


def schema() -> Schema:
    """What a rule made of a process."""
    return record(
        "Gains in engineering units and seconds.",
        ("for", "written", "robust"),
        version=VERSION,
        method=text("The rule.", *METHODS),
        title=text("The rule in words."),
        form=text("The controller.", "P", "PI", "PID"),
        basis=text("The manual's place or the decision."),
        process=process(),
        gain=number("Output units per PV unit."),
        integral_time=or_null(number("In s; null: no integral term.")),
        derivative_time=number("In s."),
        independent=record(
            "The same as independent gains.",
            kp=number("Proportional gain."),
            ki=number("Per s."),
            kd=number("In s."),
        ),
        ms=or_null(number("Maximum sensitivity; null where the loop is unstable or the process not known.")),
        gain_margin=or_null(number("A factor; null also where no gain makes the loop unstable.")),
        phase_margin=or_null(number("In degrees; null also where there is no limit.")),
        stable=or_null(switch("Whether the loop is stable; null where the process is not known.")),
        overshoot_percent=or_null(number("After a step of the set point, the derivative on the PV.")),
        iae_setpoint=or_null(number("Integral of the absolute error after a unit step of the set point.")),
        iae_disturbance=or_null(number("Integral of the absolute error after a unit step at the output.")),
        valid=switch("Whether the process is in the range of the rule."),
        valid_reason=text("The range, and the process's number."),
        heating=or_null(switch("Whether the PV rises with the output; null where the process's gain is not known.")),
        warnings=listing("What the rule's authors warn of.", text("A warning.")),
        identified=identified(),
        for_=for_vendor(),
        written=written(),
        robust=robust(),
    )


def process() -> Schema:
    """The numbers that the rule had, and of an identified process how sure they are."""
    return record(
        "What was given or identified; an integrator has no time constant.",
        (*PROCESS, *SURENESS),
        **{key: number("As given or identified.") for key in PROCESS},
        model=text("The kind of process.", *MODELS),
        fit=number("What the model explains of the answer, in %."),
        confidence=confidence(),
    )


def confidence() -> Schema:
    """How sure the numbers of a recorded step are."""
    return record(
        "95 % confidence, plus or minus so much.",
        gain=number("Of the gain."),
        time_constant=or_null(number("In s; null for an integrator.")),
        dead_time=number("In s; not less than half the time between samples."),
    )


def identified() -> Schema:
    """The process that --from-csv identifies."""
    found = record(
        "The process of a recorded step; null without --from-csv.",
        model=text("The kind of process.", *MODELS),
        gain=number("PV units per output unit; of an integrator, per s."),
        time_constant=or_null(number("In s; null for an integrator.")),
        dead_time=number("In s."),
        confidence=confidence(),
        drift=number("Of the PV, in its unit per s, taken out of the gain; 0 where none was found."),
        remarks=listing("Which column was taken for what, and what makes the numbers less sure.", text("A remark.")),
        step_at=number("When the output stepped, in s."),
        noise=number("Of the PV, in its unit."),
        misfit_percent=number("What the model leaves unexplained."),
    )
    return or_null(found)


def robust() -> Schema:
    """What holds on which plants."""
    ends = record("Amounts: a gain without its sign.", low=number("Lower end."), high=number("Upper end."))
    return record(
        "Of the method robust: the sampled loop, on every plant that was tried.",
        ms_limit=number("The limit of the maximum sensitivity."),
        plants=number("How many plants: the process, the combinations of ends, samples."),
        varies=record("What varies.", PLANT_KEYS, **dict.fromkeys(PLANT_KEYS, ends)),
        sample_time=number("Of the loop, in s."),
        pv_share=number("What the filter of the PV takes of a difference in each sample; 1: no filter."),
        worst_ms=number("The largest of all plants."),
        worst_ms_plant=plant(),
        gain_margin=or_null(number("On that plant; null: no limit.")),
        phase_margin=or_null(number("On that plant, in degrees; null: no limit.")),
        worst_iae=number("The largest integral of the absolute error after a unit step at the output."),
        worst_iae_plant=plant(),
        every_word=or_null(switch("Whether all words were tried; null: numbers in floating point.")),
        real=record(
            "The best real numbers.",
            gain=number("Output units per PV unit."),
            integral_time=number("In s."),
            derivative_time=number("In s."),
            worst_iae=number("The largest of all plants."),
            worst_ms=number("The largest of all plants."),
        ),
        cost_percent=number("What the words of the PLC cost against real numbers, in IAE."),
        assumed=listing("What nobody said.", text("In words.")),
        certified=or_null(certified()),
    )


def certified() -> Schema:
    """What the virtual PLC does with samples of the plants."""
    return record(
        "By certify; null: not asked for, or nothing varies.",
        plc=text("The virtual PLC.", *VENDORS),
        samples=number("Samples that ran."),
        held=number("Those with an IAE below the limit, and all standing expectations."),
        at_least_percent=number("What the share of all plants is at least, at 95 % confidence."),
        iae_limit=number("After the step of the load that was run, in PV units and s."),
        iae_max=or_null(number("The largest that was seen.")),
        passed=switch("Whether all samples hold."),
    )


def plant() -> Schema:
    """Numbers of a plant."""
    return record("A plant.", PLANT_KEYS, **{key: number("As tried, a gain without its sign.") for key in PLANT_KEYS})


def written() -> Schema:
    """What --write changes in a configuration."""
    value = record(
        "One of the three numbers.",
        key=text("Its key, seen from the loop."),
        unit=text("Its unit, where the file writes none."),
        old=or_null(text("As it was written; null: it was not given.")),
        new=or_null(text("As it is written now; null: it need not be given.")),
        changes=switch("Whether the text is another one."),
    )
    return record(
        "With --write.",
        file=text("The configuration."),
        loop=text("The name of the loop."),
        ok=switch("Whether no rule finds an error at the loop; else nothing was written."),
        action_compared=switch("Whether the loop's action was compared with the sign of the process's gain."),
        values=listing("Gain, integral and derivative.", value),
        findings=listing("Of the loop with these gains, and what is new elsewhere.", finding()),
    )


def for_vendor() -> Schema:
    """The gains as a PLC holds them, with --for, and with --write."""
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
        "With --for, and with --write.",
        vendor=text("The PLC family.", *VENDORS),
        action=or_null(text("The loop's action; null where the process's gain is not known.")),
        values=listing("One a parameter.", value),
    )
