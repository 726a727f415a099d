"""Every limit of a scenario's numbers at its edge: the last value that is taken, and the first that is not."""

from __future__ import annotations

import pytest

from pidcfg.sim.engine.run import prepare
from scenario_rig import Controller, problems, scenario

WIRED = "connect: {A.PV: 1, B.PV: 1}\n"
PLANT = "plants:\n  B: {model: dead_time}\n  A: "
LAG = PLANT + "{model: first_order, time_constant: 1, KEY: VALUE}\n"
DISTURBED = PLANT + "{model: MODEL}\nevents: [{at: 1, loop: A, disturb: {KEY: VALUE}}]\n"
LIMITS = [
    # scenario, path of the finding, values that are taken, values that are not
    ("events: [{at: VALUE, loop: A, mode: auto}]\n", "events.0.at", ["0", "10"], ["-0.001", "10.001"]),
    ("events: [{at: 1, loop: A, pv: 3, for: VALUE}]\n", "events.0.for", ["0.001"], ["0", "-1"]),
    ("expect: [{signal: A.PV, max: 3, share: VALUE}]\n", "expect.0.share", ["0.1 %", "99.9 %"], ["0 %", "100 %"]),
    ("expect: [{loop: A, alarm: high, at: VALUE}]\n", "expect.0.at", ["0", "10"], ["-0.001", "10.001"]),
    ("expect: [{loop: A, alarm: high, before: VALUE}]\n", "expect.0.before", ["0", "10"], ["-0.001", "10.001"]),
    ("expect: [{loop: A, alarm: high, after: VALUE}]\n", "expect.0.after", ["0", "10"], ["-0.001", "10.001"]),
    ("expect: [{signal: A.PV, max: 3, from: VALUE}]\n", "expect.0.from", ["0", "10"], ["-0.001", "10.001"]),
    ("expect: [{signal: A.PV, max: 3, until: VALUE}]\n", "expect.0.until", ["0", "10"], ["-0.001", "10.001"]),
    ("expect: [{signal: A.PV, max: 3, until: 5, from: VALUE}]\n", "expect.0.from", ["4.999", "5"], ["5.001"]),
    ("expect: [{signal: A.PV, max: 3, min: VALUE}]\n", "expect.0.min", ["2.999", "3"], ["3.001"]),
    (
        "expect: [{loop: A, metric: settling_time, max: 3, band: VALUE}]\n",
        "expect.0.band",
        ["0.1 %", "99.9 %"],
        ["0 %", "100 %"],
    ),
    ("signals: {x: VALUE}\n", "signals.x", ["1e12", "-1e12"], ["1000000000001", "-1000000000001"]),
    (
        "signals: {x: 1}\nevents: [{at: 1, set: {x: VALUE}}]\n",
        "events.0.set.x",
        ["1e12", "-1e12"],
        ["1000000000001", "-1000000000001"],
    ),
    *(
        (LAG.replace("KEY", key), f"plants.A.{key}", ["1e12", "-1e12"], ["1000000000001", "-1000000000001"])
        for key in ("gain", "load", "initial")
    ),
    *((LAG.replace("KEY", key), f"plants.A.{key}", ["0"], ["-0.001"]) for key in ("noise", "dead_time")),
    (PLANT + "{model: first_order, time_constant: VALUE}\n", "plants.A.time_constant", ["0.001", "1e12"], ["0", "-1"]),
    (PLANT + "{model: dead_time, dead_time: VALUE}\n", "plants.A.dead_time", ["1000000"], ["1000001"]),
    (
        PLANT + "{model: second_order, time_constants: [1, VALUE]}\n",
        "plants.A.time_constants",
        ["0.001", "1e12"],
        ["0", "1000000000001"],
    ),
    (
        PLANT + "{model: second_order, time_constant: 1, damping: VALUE}\n",
        "plants.A.damping",
        ["0", "1e12"],
        ["-0.001", "1000000000001"],
    ),
    (PLANT + "{model: lead_lag, lag: 1, lead: VALUE}\n", "plants.A.lead", ["0"], ["-0.001"]),
    (PLANT + "{model: lead_lag, lead: 1, lag: VALUE}\n", "plants.A.lag", ["0.001"], ["0"]),
    (PLANT + "{model: valve, stiction: VALUE}\n", "plants.A.stiction", ["0"], ["-0.001"]),
    (PLANT + "{model: valve, rate_limit: VALUE}\n", "plants.A.rate_limit", ["0.001"], ["0"]),
    (PLANT + "{model: dead_time, limits: [0, VALUE]}\n", "plants.A.limits", ["1e12"], ["1000000000001"]),
    *(
        (DISTURBED.replace("MODEL", model).replace("KEY", key), f"events.0.disturb.{key}", taken, refused)
        for model, key, taken, refused in (
            ("dead_time", "gain", ["1e12", "-1e12"], ["1000000000001", "-1000000000001"]),
            ("dead_time", "load", ["1e12", "-1e12"], ["1000000000001", "-1000000000001"]),
            ("dead_time, noise: 1", "noise", ["0"], ["-0.001"]),
            ("first_order, time_constant: 1", "time_constant", ["0.001"], ["0"]),
            ("second_order, time_constant: 1, damping: 1", "damping", ["0"], ["-0.001"]),
            ("lead_lag, lead: 1, lag: 1", "lead", ["0"], ["-0.001"]),
            ("lead_lag, lead: 1, lag: 1", "lag", ["0.001"], ["0"]),
            ("valve, stiction: 1", "stiction", ["0"], ["-0.001"]),
            ("valve, rate_limit: 1", "rate_limit", ["0.001"], ["0"]),
        )
    ),
]


@pytest.mark.parametrize(("text", "path", "taken", "refused"), LIMITS, ids=[row[0] for row in LIMITS])
def test_a_limit_itself_is_taken_and_what_is_beyond_it_is_not(text, path, taken, refused):
    rest = "" if "plants" in text else WIRED
    found = {value: problems(text.replace("VALUE", value) + rest) for value in (*taken, *refused)}
    assert [value for value in taken if found[value]] == []
    assert [value for value in refused if [where for where, _ in found[value]] != [path]] == []


@pytest.mark.parametrize(("key", "shortest"), [("duration", "1"), ("step", "0.000001")])
def test_a_time_is_above_0_and_at_most_1e12_s(key, shortest):
    for time, taken in ((shortest, True), ("1e12", True), ("0", False), ("1000000000001", False)):
        found = problems(WIRED, **{"duration": "1e12", "step": "1", key: time})
        refused = any(where == key and what.startswith(f"{key} is") for where, what in found)
        assert refused != taken, time


@pytest.mark.parametrize(
    ("duration", "told"),
    [
        ("10", None),
        ("9.999", "9.999 s are shorter than 10 samples of any loop, 10 s"),
        ("2", "2 s are shorter than 10 samples of any loop, 10 s"),
        ("1.999", "1.999 s are shorter than a sample of the slowest loop, 2 s"),
    ],
)
def test_a_run_has_a_sample_of_the_slowest_loop_and_ten_of_the_fastest(duration, told):
    plc = Controller.load()
    plc.cfg[1].period = 2_000_000
    found = [p.message for p in prepare(scenario(WIRED, duration=duration), plc).problems]
    assert found == ([told] if told else [])


def test_what_a_share_of_samples_means_is_told_for_either_end():
    cures = {}
    for share in ("0 %", "100 %"):
        text = WIRED + f"expect: [{{signal: A.PV, max: 3, share: {share}}}]\n"
        (problem,) = prepare(scenario(text), Controller.load()).problems
        cures[share] = problem.message, problem.help
    assert cures == {
        "0 %": ("samples cannot show a share of 0 %", "write it like 99 %"),
        "100 %": ("samples cannot show a share of 100 %", "without share no sample may fail"),
    }
