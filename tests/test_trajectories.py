"""Runs of the virtual PLCs against samples that manuals and decisions tell, as `simulate` runs them.

A file of `trajectories/VENDOR` has ``cases`` and, beside them, what all of its cases have. A case has

shows    one line, with the manual's place or the decision behind it
loop     keys of the configuration that differ from the file's; ``loops`` for more than one: L1, L2 …
file     keys of the configuration beside its loops; ``places``: addresses of the first loop, the second one …
pv       measurements of L1, one a base step of ``step`` s, or of each loop by its name; the last one stays
plants   what answers instead, as in a scenario; ``scenario``: its other keys
events   by the number of the sample that they come before: parameters that are set, or an event of a scenario
samples  expected signals, modes, flags, alarms of L1, or as L2.PV: from sample 0 on, null for any, or by number: 3, 3-9
within   absolute tolerance, of all or by signal; ``share`` of the value; 0 unless given
notes    everything that the report tells until then; ``tuned``: what it tells of the auto-tune of L1 at the end
each     variants, each of which differs from the case by its keys

Expected samples come from the manual or by hand, never from the engine.
"""

from __future__ import annotations

import csv
import io
import re
from decimal import Decimal
from itertools import pairwise
from pathlib import Path

import pytest
from ruamel.yaml import YAML

from nested import merged
from pidcfg.schemas.scenario import Scenario
from pidcfg.sim.engine.run import Settings, options, simulate
from pidcfg.vendors import VENDORS

FOLDER = Path(__file__).with_name("trajectories")
OWN = {"mode", "autotune", "plc", "ramp_soak", "disturb", "pv"}
"""Keys of an event that are no parameters; as a section of parameters some of them are."""
BASIS = re.compile(r"\(.+\)$")
"""The end of what a case shows."""
OF_LOOP = re.compile(r"(?:(L\d)\.)?(.+)")
"""A name of a sample, with its loop or without."""
AFTER = 100
"""Base steps that a run goes on, since a scenario has ten samples at least."""


def cases():
    """Every case with what its file says of all of them; the variants of ``each`` are cases of their own."""
    for path in sorted(FOLDER.glob("*/*.yaml")):
        common = YAML(typ="safe", pure=True).load(path.read_text("utf-8"))
        for case in common.pop("cases"):
            for number, variant in enumerate(case.get("each", [{}]), 1):
                end = f" ({number})" if "each" in case else ""
                whole = merged(merged(common, case), variant)
                yield pytest.param(path.parent.name, whole, id=f"{path.parent.name}: {case['shows']}{end}")


def configuration(vendor, case):
    """The configuration: loops L1, L2 … that differ from the file's by what the case says."""
    loops = [
        merged(case["loop"] | {key: names[i] for key, names in case["places"].items()}, {"name": f"L{i + 1}"} | own)
        for i, own in enumerate(case.get("loops", [{}]))
    ]
    return {"pidcfg": 1, "vendor": vendor, **case.get("file", {}), "loops": loops}


def measurements(case):
    """Measurements by loop, one a base step; the last one stays."""
    given = case.get("pv", [0])
    by_loop = given if isinstance(given, dict) else {"L1": given}
    return {loop: pvs if isinstance(pvs, list) else [pvs] for loop, pvs in by_loop.items()}


def events(case, step):
    """Events of a scenario; those of number k come before sample k, the first of which is 0."""
    for loop, pvs in measurements(case).items():
        for k, (before, pv) in enumerate(pairwise(pvs), 1):
            if pv != before:
                yield {"at": k * step, "set": {f"pv_{loop}": pv}}
    for k, given in case.get("events", {}).items():
        for event in given if isinstance(given, list) else [given]:
            own = {key for key in event.keys() & OWN if key == "disturb" or not isinstance(event[key], dict)}
            what = {key: event[key] for key in own}
            values = {key: value for key, value in event.items() if key not in own | {"loop", "plant"}}
            what |= {"set": values} if values else {}
            of = {key: event[key] for key in ("plant",) if key in event} or {"loop": event.get("loop", "L1")}
            yield {"at": k * step, **({} if "plc" in event else of), **what}


def scenario(case, count):
    """The scenario that runs so many base steps."""
    step = Decimal(str(case.get("step", "0.1")))
    pvs, plants = measurements(case), case.get("plants", {})
    loops = [f"L{i + 1}" for i, _ in enumerate(case.get("loops", [{}])) if f"L{i + 1}" not in plants]
    return Scenario.model_validate(
        {
            "pidcfg": 1,
            "scenario": case["shows"],
            "config": "none.yaml",
            "step": step,
            "duration": (count + AFTER) * step,
            "signals": {f"pv_{loop}": pvs.get(loop, [0])[0] for loop in loops},
            "connect": {f"{loop}.PV": f"pv_{loop}" for loop in loops},
            "plants": plants,
            "events": [*events(case, step)],
            **case.get("scenario", {}),
        }
    )


class Run:
    """What a case has done: its report, and every signal after each base step."""

    def __init__(self, vendor, case, count):
        vendor = VENDORS[vendor]
        plan, controller, sink = scenario(case, count), vendor.module("controller"), io.StringIO()
        image = vendor.encoder(vendor.model.model_validate(configuration(vendor.key, case))).image
        settings = Settings("python", trend=sink, judged=False)
        self.report = simulate(plan, lambda: controller.load(image, options(plan, controller)), controller, settings)
        self.rows = list(csv.DictReader(io.StringIO(sink.getvalue())))[:count]

    def samples(self, name):
        """A signal, the mode, or an alarm or flag as 0 and 1."""
        loop, what = split(name)
        if f"{loop}.{what}" in self.rows[0]:
            return [float(row[f"{loop}.{what}"]) for row in self.rows]
        found, times = self.report.loops[loop], [float(row["time"]) for row in self.rows]
        if what == "mode":
            return [[found.first_mode, *(m.mode for m in found.modes if m.at <= time)][-1] for time in times]
        spans = [(a.at, a.cleared) for a in found.alarms if a.alarm == what]
        spans += [(c.at, c.until) for c in found.conditions if c.name == what]
        return [int(any(at <= time and (end is None or time < end) for at, end in spans)) for time in times]

    @property
    def notes(self):
        """What the report tells, in the order of time: notes, and reasons of modes."""
        said = [(note.at, note.text) for note in self.report.notes]
        said += [(m.at, m.reason) for loop in self.report.loops.values() for m in loop.modes if m.reason]
        return [text for at, text in sorted(said, key=lambda item: item[0]) if at <= float(self.rows[-1]["time"])]


def split(name):
    """The loop and the signal of a name; L1 where it has no loop."""
    loop, what = OF_LOOP.fullmatch(name).groups()
    return loop or "L1", what


def expected(case):
    """Expected values: name, number of the sample, value."""
    for name, told in case["samples"].items():
        for numbers, value in told.items() if isinstance(told, dict) else enumerate(told):
            first, _, last = str(numbers).partition("-")
            for k in range(int(first), int(last or first) + 1) if value is not None else ():
                yield name, k, value


@pytest.mark.parametrize(("vendor", "case"), [*cases()])
def test_a_run_shows_the_samples_that_are_told(vendor, case):
    assert BASIS.search(case["shows"]), "the manual's place or the decision stands behind what a case shows"
    count = 1 + max(k for _, k, _ in expected(case))
    run, within = Run(vendor, case, max(count, *map(len, measurements(case).values()))), case.get("within", 0)
    found = {name: run.samples(name) for name in case["samples"]}

    for name, k, value in expected(case):
        near = within.get(name, 0) if isinstance(within, dict) else within
        told = value if isinstance(value, str) else pytest.approx(value, rel=case.get("share", 0), abs=near)
        assert found[name][k] == told, f"{name}, sample {k}"
    if "notes" in case:
        assert run.notes == case["notes"]
    if "tuned" in case:
        tuned, told = run.report.loops["L1"].autotune, case["tuned"]
        assert (tuned and {key: tuned[key] for key in told or tuned}) == told
