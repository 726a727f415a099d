"""The comparison of the engine with the references, case by case and base step by base step."""

from __future__ import annotations

import argparse
import json
import random
import sys
import time
from collections import Counter
from dataclasses import dataclass, field
from importlib import import_module

from reference.engine import trace

STEADY = 0.08
"""Share of the cases that begin steady."""
SHOWN = 5
"""Differences that are printed of a vendor."""


@dataclass
class Outcome:
    """What a comparison has found."""

    cases: int = 0
    loop_samples: int = 0
    """Loops times base steps."""
    steady: int = 0
    """Cases that began with a pre-roll to a steady state."""
    reached: Counter = field(default_factory=Counter)
    """How often the cases came by each of the vendor's ``FEATURES``, as the reference counted."""
    differences: list[str] = field(default_factory=list)
    """One text a case that differs: where it does first."""


def vendors():
    """The vendors that have a reference."""
    return [name for name in ("dl06", "click", "ezlogix", "nextopid", "dpide", "rates") if _module(name) is not None]


def _module(vendor):
    """A vendor's reference; None where there is none.

    It has ``random_case(rng)``, which returns a configuration and a scenario as plain data; ``run(configuration,
    scenario, inputs, reached)``, which returns of each row of ``inputs`` a mapping of signals as `engine.trace` names
    them, and counts in ``reached``; ``FEATURES``, what cases have to reach; ``TOLERANCE``, by how much a signal may
    differ relative to its size, by the part of its name behind the dot, else 0; ``COUNT``, the cases of a long run.
    """
    try:
        return import_module(f"reference.{vendor}")
    except ModuleNotFoundError as error:
        if error.name != f"reference.{vendor}":
            raise
        return None


def case_of(vendor, seed, number):
    """The configuration and the scenario of a case; some begin steady."""
    configuration, scenario = _module(vendor).random_case(random.Random(f"{seed}/{vendor}/{number}"))
    if random.Random(f"{seed}/{vendor}/{number}/start").random() < STEADY:
        scenario["initial"] = "steady"
    return configuration, scenario


def compare(vendor, numbers, seed=0):
    """Compares the cases of some numbers."""
    outcome = Outcome()
    for number in numbers:
        try:
            text = compare_case(vendor, *case_of(vendor, seed, number), outcome)
        except Exception as error:
            error.add_note(f"in {vendor} --seed {seed} --case {number}")
            raise
        if text:
            outcome.differences.append(f"--seed {seed} --case {number}: {text}")
    return outcome


def compare_case(vendor, configuration, scenario, outcome):
    """Where a case differs first, in words; empty when it does not."""
    module = _module(vendor)
    inputs, shown = trace(configuration, scenario)
    expected = module.run(configuration, scenario, inputs, outcome.reached)
    outcome.cases += 1
    outcome.steady += inputs.lead > 0
    outcome.loop_samples += len(configuration["loops"]) * len(shown)
    if len(expected) != len(shown):
        return f"{len(shown)} base steps, reference {len(expected)}"
    for row, (theirs, ours) in enumerate(zip(shown, expected, strict=True)):
        for name, value in ours.items():
            if not alike(theirs[name], value, module.TOLERANCE.get(name.rpartition(".")[2], 0)):
                at = (row - inputs.lead) * inputs.step / 1e6
                return f"at {at:g} s (row {row}) {name} is {theirs[name]!r}, reference {value!r}"
    return ""


def alike(one, other, tolerance):
    """Whether two values agree; what is no number agrees with nothing but itself."""
    if one == other or (one != one and other != other):  # noqa: PLR0124 - not a number
        return True
    if isinstance(other, str):
        return False
    return abs(one - other) <= tolerance * max(abs(one), abs(other))


def show_case(vendor, seed, number):
    """Prints a case, and the base steps around its first difference."""
    module = _module(vendor)
    configuration, scenario = case_of(vendor, seed, number)
    print(json.dumps({"configuration": configuration, "scenario": scenario}, indent=1))
    text = compare_case(vendor, configuration, scenario, Outcome())
    print(text or "no difference")
    if text:
        inputs, shown = trace(configuration, scenario)
        expected = module.run(configuration, scenario, inputs, Counter())
        row = int(text.partition("row ")[2].partition(")")[0])
        for k in range(max(0, row - 3), min(row + 2, len(shown))):
            print(f"row {k}, {(k - inputs.lead) * inputs.step / 1e6:g} s, measured {inputs.rows[k]}")
            for name, value in expected[k].items():
                print(f"  {name:20} {shown[k][name]!r:24} reference {value!r}")


def main(arguments=None):
    """Compares, and prints what was compared and reached; 1 where something differs or was not reached."""
    parser = argparse.ArgumentParser(prog="reference", description=__doc__)
    parser.add_argument("vendors", nargs="*", metavar="VENDOR", help=", ".join(vendors()))
    parser.add_argument("--count", type=int, help="cases of each vendor")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--case", type=int, help="show the case of this number")
    chosen = parser.parse_args(arguments)
    failed = False
    for vendor in chosen.vendors or vendors():
        if chosen.case is not None:
            show_case(vendor, chosen.seed, chosen.case)
            continue
        begin = time.perf_counter()
        outcome = compare(vendor, range(chosen.count or _module(vendor).COUNT), chosen.seed)
        seconds = time.perf_counter() - begin
        print(
            f"{vendor}: {outcome.cases} configurations, {outcome.loop_samples} loop-samples, "
            f"{outcome.steady} begin steady, {len(outcome.differences)} differ, {seconds:.0f} s"
        )
        missed = [name for name in _module(vendor).FEATURES if not outcome.reached[name]]
        print("  reached: " + ", ".join(f"{n} {outcome.reached[n]}" for n in _module(vendor).FEATURES))
        print("".join(f"  never reached: {name}\n" for name in missed), end="")
        print("".join(f"  {text}\n" for text in outcome.differences[:SHOWN]), end="")
        failed = failed or bool(outcome.differences or missed)
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
