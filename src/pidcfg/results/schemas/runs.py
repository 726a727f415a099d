"""Runs of scenarios."""

from __future__ import annotations

from pidcfg.results.schemas.findings import finding
from pidcfg.results.schemas.parts import (
    Schema,
    anything,
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
from pidcfg.sim.report import STANDING_KINDS, ScanTime


def schema() -> Schema:
    """One run, or a list of them when several scenarios were named."""
    return one_or_several("run", "runs", run(), loop=loop(), finding=finding())


def run() -> Schema:
    """One run; what has not run has nulls and empty lists."""
    extreme = {key: number(f"Signal's {key}.") for key in ("min", "max", "final")}
    return record(
        "One scenario.",
        ("scan_time",),
        scenario=or_null(text("Its title; null: it could not run.")),
        file=text("Its file."),
        engine=or_null(text("What calculated it.", "python", "numba")),
        plc_flags=by_name("Error registers of the PLC in its notation.", text("Content.")),
        loops=by_name("By the loop's name.", {"$ref": "#/$defs/loop"}),
        signals=by_name("By the signal's name, such as TIC-101.PV.", record("How far it went.", **extreme)),
        expectations=listing("In the scenario's order.", expectation()),
        standing=listing("What is expected of every run.", standing()),
        notes=listing("What happened and needs saying.", note()),
        findings=listing("In the scenario and its configuration.", {"$ref": "#/$defs/finding"}),
        passed=switch("Whether it ran and everything expected of it holds."),
        scan_time=record(
            "The PLC's scan with these loops, where the scenario states a scan time.",
            **{name: number("In s.") for name in ScanTime._fields},
        ),
    )


def loop() -> Schema:
    """What became of a loop."""
    measured = "In s, % of the step or the PV's unit; null where there is none."
    return record(
        "What became of a loop.",
        ("autotune",),
        metrics=record("How well it did.", **{name: or_null(number(measured)) for name in METRICS}),
        time_in_control=number("How long it was in Auto or Cascade, in s."),
        alarms=listing("In order of time.", alarm()),
        modes=listing("Modes reached, and requests refused.", mode()),
        flags=by_name("Whether a flag was on at any time.", switch("On at any time.")),
        unlisted=count("Changes that the lists leave out."),
        autotune=record(
            "Where a tuning was started.",
            done=switch("Whether it came to its end."),
            error=switch("Whether it failed."),
            status=text("In the PLC's words."),
            results=by_name("By the vendor's names.", number("What was found.")),
        ),
    )


def alarm() -> Schema:
    """An alarm of a loop."""
    return record(
        "An alarm.",
        alarm=text("Its name."),
        at=number("When it came, in s."),
        cleared=or_null(number("When it went; null: still on at the end.")),
    )


def mode() -> Schema:
    """A change of mode, or its refusal."""
    return record(
        "A mode reached; after a refusal the old one.",
        at=number("When, in s."),
        requested=or_null(text("What was asked for.")),
        mode=text("What is."),
        reason=or_null(text("Why.")),
    )


def expectation() -> Schema:
    """An expectation and its verdict."""
    return record(
        "An expectation.",
        text=text("In words."),
        passed=switch("Whether it holds."),
        value=anything("What was measured."),
    )


def standing() -> Schema:
    """A standing expectation and its verdict."""
    return record(
        "A standing expectation.",
        kind=text("What it is about.", *STANDING_KINDS),
        loop=text("The loop; empty: the PLC."),
        passed=switch("Whether it holds; true where nothing is known."),
        judged=switch("Whether the run tells."),
        at=or_null(number("Since when, in s.")),
        text=text("In words; of what is not judged, why not."),
        allowed=or_null(text("The reason for which the scenario allows it to fail.")),
    )


def note() -> Schema:
    """A remark on a run."""
    return record(
        "A remark.",
        at=number("When, in s."),
        loop=or_null(text("The loop that it concerns.")),
        text=text("In words."),
        error=switch("Whether it fails the run."),
    )
