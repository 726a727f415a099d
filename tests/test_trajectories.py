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
from math import sqrt
from pathlib import Path

import pytest
from ruamel.yaml import YAML

from nested import merged
from pidcfg.encoders.contract import encoder_of
from pidcfg.schemas.scenario import Scenario
from pidcfg.sim.engine.run import Settings, plc_options, simulate
from pidcfg.vendors import VENDORS

FOLDER = Path(__file__).with_name("trajectories")
KEYS = {
    "shows", "loop", "loops", "file", "places", "pv", "step", "plants", "scenario", "events", "samples", "within",
    "share", "notes", "tuned", "each",
}  # fmt: skip
"""What a case may have."""
EVENT_KEYS = {"mode", "autotune", "plc", "ramp_soak", "disturb", "pv"}
"""Keys of an event that are no parameters; with a mapping all but ``disturb`` are sections of parameters."""
BASIS = re.compile(r"\(.+\)$")
"""The end of what a case shows."""
SAMPLE_NAME = re.compile(r"(?:(L\d)\.)?(.+)")
"""A signal, mode, flag or alarm, with its loop or without."""
EXTRA_STEPS = 100
"""Base steps that a run goes on, since a scenario has ten samples of each loop at least."""


def read_cases():
    """Every case with what its file says of all of them; the variants of ``each`` are cases of their own."""
    for path in sorted(FOLDER.glob("*/*.yaml")):
        common = YAML(typ="safe").load(path.read_text("utf-8"))
        for case in common.pop("cases"):
            for number, variant in enumerate(case.get("each", [{}]), 1):
                end = f" ({number})" if "each" in case else ""
                whole = merged(merged(common, case), variant)
                yield pytest.param(path.parent.name, whole, id=f"{path.parent.name}: {case['shows']}{end}")


def make_configuration(vendor, case):
    """Loops L1, L2 … that differ from the file's by what the case says."""
    loops = [
        merged(case["loop"] | {key: names[i] for key, names in case["places"].items()}, {"name": f"L{i + 1}"} | given)
        for i, given in enumerate(case.get("loops", [{}]))
    ]
    return {"pidcfg": 1, "vendor": vendor, **case.get("file", {}), "loops": loops}


def list_measurements(case):
    """Measurements by loop, one a base step."""
    given = case.get("pv", [0])
    by_loop = given if isinstance(given, dict) else {"L1": given}
    return {loop: pvs if isinstance(pvs, list) else [pvs] for loop, pvs in by_loop.items()}


def make_event(given):
    """An event of a scenario, but for its time."""
    keys = {key for key in given.keys() & EVENT_KEYS if key == "disturb" or not isinstance(given[key], dict)}
    parameters = {key: value for key, value in given.items() if key not in keys | {"loop", "plant"}}
    target = {} if "plc" in given else {"plant": given["plant"]} if "plant" in given else {"loop": "L1"}
    if "loop" in given:
        target = {"loop": given["loop"]}
    return target | {key: given[key] for key in keys} | ({"set": parameters} if parameters else {})


def make_events(case, step):
    """Changes of measurements, and the events of the case; those of number k come before sample k."""
    for loop, pvs in list_measurements(case).items():
        for k, (before, pv) in enumerate(pairwise(pvs), 1):
            if pv != before:
                yield {"at": k * step, "set": {f"pv_{loop}": pv}}
    for k, given in case.get("events", {}).items():
        for event in given if isinstance(given, list) else [given]:
            yield {"at": k * step, **make_event(event)}


def make_scenario(case, count):
    """The scenario that runs so many base steps, and some more."""
    step = Decimal(str(case.get("step", "0.1")))
    pvs, plants = list_measurements(case), case.get("plants", {})
    loops = [f"L{i + 1}" for i, _ in enumerate(case.get("loops", [{}])) if f"L{i + 1}" not in plants]
    return Scenario.model_validate(
        {
            "pidcfg": 1,
            "scenario": case["shows"],
            "config": "none.yaml",
            "step": step,
            "duration": (count + EXTRA_STEPS) * step,
            "signals": {f"pv_{loop}": pvs.get(loop, [0])[0] for loop in loops},
            "connect": {f"{loop}.PV": f"pv_{loop}" for loop in loops},
            "plants": plants,
            "events": [*make_events(case, step)],
            **case.get("scenario", {}),
        }
    )


def load_plc(vendor, case, plan, controller):
    """The virtual PLC of a case, before it runs."""
    image = encoder_of(vendor).encode(vendor.model.model_validate(make_configuration(vendor.key, case))).image
    return controller.load(image, plc_options(plan, controller))


class Run:
    """What a case has done: its report, and every signal after each base step."""

    def __init__(self, vendor, case, count):
        vendor = VENDORS[vendor]
        plan, controller, sink = make_scenario(case, count), vendor.module("controller"), io.StringIO()
        plcs = [load_plc(vendor, case, plan, controller) for _ in range(2)]
        self.alarms = plcs[1].alarm_bits
        settings = Settings("python", trend=sink, with_verdicts=False)
        self.report = simulate(plan, lambda: plcs[0], controller, settings)
        self.rows = list(csv.DictReader(io.StringIO(sink.getvalue())))[:count]
        self.times = [float(row["time"]) for row in self.rows]

    def samples(self, name):
        """A signal, the mode, or an alarm or flag as 0 and 1."""
        loop, signal = SAMPLE_NAME.fullmatch(name).groups("L1")
        if f"{loop}.{signal}" in self.rows[0]:
            return [float(row[f"{loop}.{signal}"]) for row in self.rows]
        report = self.report.loops[loop]
        if signal == "mode":
            return [[report.first_mode, *(m.mode for m in report.modes if m.at <= time)][-1] for time in self.times]
        assert signal in {*self.alarms, *report.flags}, f"{name} is nothing that a run shows"
        spans = [(a.at, a.cleared) for a in report.alarms if a.alarm == signal]
        spans += [(c.at, c.until) for c in report.conditions if c.name == signal]
        return [int(any(on <= time and (off is None or time < off) for on, off in spans)) for time in self.times]

    @property
    def notes(self):
        """What the report tells, in the order of time: notes, and reasons of modes."""
        notes = [(note.at, note.text) for note in self.report.notes]
        notes += [(m.at, m.reason) for loop in self.report.loops.values() for m in loop.modes if m.reason]
        return [text for at, text in sorted(notes, key=lambda note: note[0]) if at <= self.times[-1]]


def list_samples(case):
    """Expected samples: name, number, value."""
    for name, values in case["samples"].items():
        for numbers, value in values.items() if isinstance(values, dict) else enumerate(values):
            first, _, last = str(numbers).partition("-")
            for k in range(int(first), int(last or first) + 1) if value is not None else ():
                yield name, k, value


@pytest.mark.parametrize(("vendor", "case"), [*read_cases()])
def test_a_run_shows_the_expected_samples(vendor, case):
    assert case.keys() <= KEYS, case.keys() - KEYS
    assert BASIS.search(case["shows"]), "the manual's place or the decision stands behind what a case shows"
    counts = [1 + k for _, k, _ in list_samples(case)]
    run = Run(vendor, case, max(*counts, *map(len, list_measurements(case).values())))
    samples, within = {name: run.samples(name) for name in case["samples"]}, case.get("within", 0)

    for name, k, value in list_samples(case):
        tolerance = within.get(name, 0) if isinstance(within, dict) else within
        expected = value if isinstance(value, str) else pytest.approx(value, rel=case.get("share", 0), abs=tolerance)
        assert samples[name][k] == expected, f"{name}, sample {k}"
    if "notes" in case:
        assert run.notes == case["notes"]
    if "tuned" in case:
        tuned, expected = run.report.loops["L1"].autotune, case["tuned"]
        assert (tuned and {key: tuned[key] for key in expected or tuned}) == expected


# --- What a virtual PLC says of its loops to those that judge a run: from the registers, in the unit of the signal ----

SPAN = {"pv": {"range": [0, 200]}, "output": {"range": [0, 100], "limits": [20, 80]}}
"""A tenth of the PV's span are 409.5 counts of 4095, for which 410 are written; limits at 819 and 3276 counts."""
TENTH = 410 * 200 / 4095
DEVIATION = {"alarms": {"deviation": {"high": 5, "high_high": 9}}}
FILES = dict.fromkeys(("dl06", "click", "ezlogix", "dpide"), "equation") | {
    "generic": "loops",
    "nextopid": "pid",
}


@pytest.mark.parametrize(
    ("vendor", "loop", "facts"),
    [
        ("dl06", SPAN, {"output_limits": (20, 80), "dead_band": 0, "inner_deviation": None, "integrates": False}),
        ("dl06", SPAN | {"alarms": {"deviation": {"yellow": 20, "red": 40}}}, {"inner_deviation": TENTH}),
        ("dl06", {"pv": {"square_root": True}, "alarms": {"deviation": {"yellow": 20}}}, {"inner_deviation": None}),
        ("dl06", SPAN | {"error": {"deadband": 20}}, {"dead_band": TENTH}),
        ("dl06", SPAN | {"error": {"deadband": 20, "curve": "squared"}}, {"dead_band": sqrt(410 / 4095) * 200}),
        ("dl06", {"tuning": {"reset": 10}}, {"integrates": True}),
        ("click", DEVIATION, {"inner_deviation": 5, "output_limits": (0, 100), "dead_band": 0}),
        ("click", {"alarms": {"deviation": {"high": 5, "enabled": False}}}, {"inner_deviation": None}),
        ("click", {"setpoint": {"value": 33}, "output": {"limits": [20, 80]}}, {"output_limits": (20, 80)}),
        ("click", {"setpoint": {"value": 33}}, {"given_set_point": 33}),
        ("click", {"error": {"deadband": 4}}, {"dead_band": 4}),
        ("click", {"error": {"deadband": 4, "curve": "squared"}}, {"dead_band": 2}),
        ("click", {"error": {"deadband": 4, "deadband_enabled": False}}, {"dead_band": 0}),
        ("click", {"tuning": {"reset_time": 6000}}, {"integrates": False}),
        ("click", {"tuning": {"reset_time": 5000}}, {"integrates": True}),
        ("click", {"output": {"pwm": {"bit": "Y001", "period": 20}}}, {"pulse_cycle": 20}),
        ("ezlogix", SPAN, {"output_limits": (20, 80), "dead_band": 0, "inner_deviation": None, "pulse_cycle": 0}),
        ("ezlogix", SPAN | {"deadband": 20}, {"dead_band": TENTH}),
        ("dpide", {"MV_MIN": 10, "MV_MAX": 90}, {"output_limits": (10, 90), "dead_band": 0, "inner_deviation": None}),
        ("dpide", {"ERR_DBW": 3, "Ti_Ki": 4}, {"dead_band": 3}),
        ("generic", DEVIATION, {"inner_deviation": 5, "dead_band": 0, "pulse_cycle": 0, "integrates": False}),
        ("generic", {"deadband": 3, "tuning": {"integral_time": 4}}, {"dead_band": 3, "integrates": True}),
        ("generic", {}, {"inner_deviation": None}),
        ("generic", {"setpoint": {"value": 33}, "output": {"limits": [20, 80]}}, {"output_limits": (20, 80)}),
        ("generic", {"setpoint": {"value": 33, "limits": [40, 60]}}, {"given_set_point": 33}),
        ("nextopid", {"MinMV": 10, "MaxMV": 90, "DeadBand": 3}, {"output_limits": (10, 90), "dead_band": 3}),
        ("nextopid", {"SP": 50, "Ti_Ki": 0.0005}, {"given_set_point": 50, "integrates": True}),
        ("nextopid", {"Indep": False, "Ti_Ki": 0.0009}, {"integrates": False}),
        ("nextopid", {"Indep": False, "Ti_Ki": 0.001}, {"integrates": True}),
    ],
)
def test_a_plc_says_of_a_loop_what_its_registers_say(vendor, loop, facts):
    plc = plc_of_facts(vendor, {"setpoint": {"value": 100}} if vendor == "dl06" else {}, loop)

    for fact, expected in facts.items():
        signals = () if fact in {"inner_deviation", "pulse_cycle"} else (plc.signal_values,)
        assert getattr(plc, fact)(0, *signals) == (expected if expected is None else pytest.approx(expected)), fact


def plc_of_facts(vendor, *loops, file=None):
    """The virtual PLC of a loop that differs from its file's by all of these keys."""
    case = YAML(typ="safe", pure=True).load((FOLDER / vendor / f"{FILES[vendor]}.yaml").read_text("utf-8"))
    for loop in loops:
        case = merged(case, {"shows": "facts", "loop": loop, "file": file or {}})
    plan, controller = make_scenario(case, 1), VENDORS[vendor].module("controller")
    return load_plc(VENDORS[vendor], case, plan, controller)


def test_the_mode_inputs_of_a_loop_are_the_signals_that_are_wired_to_them():
    signals = {"hand": False, "wanted": 50.0}
    plc = plc_of_facts("nextopid", {"SP": "wanted", "Manual": "hand"}, file={"signals": signals})
    assert [plc.signals[slot] for slot in plc.mode_inputs(0)] == ["hand"]
