"""Batches of samples."""

from __future__ import annotations

from pidcfg.certification.outcome import QUANTILES
from pidcfg.results.schemas.findings import finding
from pidcfg.results.schemas.parts import (
    Schema,
    by_name,
    count,
    listing,
    number,
    one_or_several,
    or_null,
    record,
    switch,
    text,
)
from pidcfg.sim.metrics import METRICS
from pidcfg.sim.report import STANDING_KINDS


def schema() -> Schema:
    """One batch, or a list of them when several scenarios were named."""
    return one_or_several("batch", "batches", batch(), metric=metric(), finding=finding())


def batch() -> Schema:
    """One batch; what has not run has nulls and empty lists."""
    return record(
        "One scenario; shares and bounds are in %.",
        scenario=or_null(text("Its title; null: it could not run.")),
        file=text("Its file."),
        samples=count("How many were run."),
        seed=or_null({"type": "integer", "description": "Of the row of samples."}),
        all_passed=count("Samples in which everything holds."),
        failed_to_run=count("Samples that could not run, or had an error on their way; they count as failed."),
        reasons=listing("Why the first of them could not run.", text("Sample and reason.")),
        expectations=listing("In the scenario's order.", expectation()),
        metrics=by_name(
            "By the loop's name.",
            record("By metric.", **{name: {"$ref": "#/$defs/metric"} for name in METRICS}),
        ),
        standing=listing("What is expected of every sample.", standing()),
        uncertainties=listing("Those first that matter most.", uncertainty()),
        worst=listing("The samples nearest to their limits or beyond, the worst first.", worst()),
        findings=listing("In the scenario and its configuration.", {"$ref": "#/$defs/finding"}),
        passed=switch("Whether every bound reaches what is wanted."),
    )


def expectation() -> Schema:
    """An expectation of the scenario."""
    return record(
        "One expectation.",
        text=text("In words."),
        share=number("Samples that keep it."),
        bound=number("What the share is at least, at 95 % confidence."),
        wanted=or_null(number("What the bound must reach; null: no sample may fail.")),
        passed=switch("Whether it does."),
    )


def metric() -> Schema:
    """A metric over all samples in which it was measured."""
    values = {name: or_null(number("Quantile, as the upper edge of its bin.")) for name in QUANTILES}
    return record(
        "In s, % of the step or the PV's unit; null where no sample measured it.",
        count=count("Samples that measured it."),
        mean=or_null(number("Mean.")),
        min=or_null(number("Smallest.")),
        **values,
        max=or_null(number("Largest.")),
    )


def standing() -> Schema:
    """A standing expectation."""
    return record(
        "One standing expectation.",
        kind=text("Its kind.", *STANDING_KINDS),
        loop=text("The loop; empty: the PLC."),
        failed=count("Samples that fail it."),
        judged=count("Samples in which it was judged."),
        bound=number("What the share of samples that keep it is at least, at 95 % confidence."),
        passed=switch("Whether no sample fails."),
    )


def uncertainty() -> Schema:
    """What varies."""
    share = "Share of samples that pass where it lies in its {} fifth; null: none lies there."
    return record(
        "One uncertain number.",
        name=text("Plant or loop, and key."),
        spread=text("How it is spread."),
        lowest_fifth=or_null(number(share.format("lowest"))),
        highest_fifth=or_null(number(share.format("highest"))),
    )


def worst() -> Schema:
    """A sample near a limit, or beyond it."""
    return record(
        "One sample.",
        sample=count("Its number, from 0."),
        margin=or_null(number("(limit - value) / |limit|, the smallest; null where no number says it.")),
        failed=switch("Whether it fails."),
        expectation=text("The nearest one; empty: a standing one, or it could not run."),
        values=by_name("By plant or loop and key.", number("As drawn.")),
        file=or_null(text("Where its scenario was written.")),
    )
