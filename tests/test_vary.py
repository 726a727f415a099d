"""What a scenario's ``vary`` may say: every mistake at its line, and what each number then spreads over."""

from __future__ import annotations

from math import inf

import pytest

import pidcfg
from certify_rig import CONFIG, PASSES, loaded_of, scenario
from pidcfg.schemas.scenario import Amount, parse_amount, parse_spread
from pidcfg.text.document import Plain
from pidcfg.vendors import VENDORS
from test_vendors import starter


def checked(vary, config=CONFIG, expect=PASSES):
    """The findings of a scenario with this ``vary``."""
    files = {"run.scenario.yaml": scenario(vary, expect), "loop.yaml": config}
    return pidcfg.check(files["run.scenario.yaml"], name="run.scenario.yaml", files=files).findings


def plants(text):
    """``vary`` of the plant."""
    return f"  plants:\n    TIC-1: {{{text}}}"


def loops(text):
    """``vary`` of the loop."""
    return f"  loops:\n    TIC-1: {{{text}}}"


@pytest.mark.parametrize(
    ("vary", "message", "column"),
    [
        (plants("gain: 30 %"), "gain: '30 %' does not say how the number is spread", 19),
        (plants("gain: ±0 %"), "gain: ±0 % leaves nothing to vary", 19),
        (plants("gain: ±-3 %"), "gain: '±-3 %' does not say how the number is spread", 19),
        (plants("gain: {uniform: [3, 2]}"), "gain: uniform [3, 2] does not ascend", 19),
        (plants("gain: {uniform: [2, 2]}"), "gain: uniform [2, 2] does not ascend", 19),
        (plants("gain: {uniform: 3}"), "gain: a pair of ends is wanted: a list of two values", 19),
        (plants("gain: {normal: [2, 0]}"), "gain: the standard deviation 0 is not above 0", 19),
        (plants("gain: {normal: [2, -1]}"), "gain: the standard deviation -1 is not above 0", 19),
        (plants("gain: {limits: [2, 3]}"), "gain: limits does not say how a number varies", 19),
        (
            plants("gain: {uniform: [2, 3], limits: [2, 3]}"),
            "gain: uniform, limits does not say how a number varies",
            19,
        ),
        (plants("gain: {normal: [2, 1], limits: [3, 1]}"), "gain: limits [3, 1] does not ascend", 19),
        (plants("dead_time: {uniform: [1 s, 2]}"), "dead_time: 1 s and 2 are not in one unit", 24),
        (
            plants("dead_time: {normal: [1 s, 2 s], limits: [0, 2]}"),
            "dead_time: normal is in s, limits in another unit",
            24,
        ),
        (plants("dead_time: {uniform: [1 kg, 2 kg]}"), "1 kg is not a time", 24),
        (plants("gain: {uniform: [1 s, 2 s]}"), "gain is a plain number, not 1 s", 19),
        (plants("gian: ±3 %"), "'gian' is no number of TIC-1 that can vary", 19),
        (plants("time_constant: ±3 %"), "'time_constant' is no number of TIC-1 that can vary", 28),
        (plants("load: ±3 %"), "±3 % of 0 is 0", 19),
        (plants("initial: ±3 %"), "TIC-1 has no initial, of which ±3 % could be a share", 22),
        (plants("noise: {uniform: [-1, 1]}"), "noise must be at least 0, and -1 to 1 goes down to -1", 20),
        (plants("dead_time: {normal: [3, 1]}"), "dead_time must be at least 0, and a normal spread without limits", 24),
        (plants("gain: {uniform: [1, 2e12]}"), "gain goes beyond 1e+12", 19),
        ("  plants:\n    TIC-2: {gain: ±3 %}", "'TIC-2' is no plant of the scenario", 5),
        ("  loops:\n    TIC-2: {tuning.gain: ±3 %}", "'TIC-2' is no loop", 5),
        (loops("tuning.gian: ±3 %"), "'tuning.gian' is nothing that can be set in a running loop", 26),
        (loops("tuning.gian: {uniform: [1, 2]}"), "'tuning.gian' is nothing that can be set in a running loop", 26),
        (loops("mode: {uniform: [1, 2]}"), "mode is an event of its own", 19),
        (loops("pv.range.0: {uniform: [1, 2]}"), "pv.range.0 cannot be set", 25),
        (
            loops("tuning.derivative_time: ±3 %"),
            "gives TIC-1 no number at tuning.derivative_time",
            37,
        ),
        (loops("tuning.integral_time: {uniform: [-1, 2]}"), "-1: tuning.integral_time is -1; it is at least 0", 35),
        (loops("tuning.integral_time: {normal: [-1, 2]}"), "-1: tuning.integral_time is -1; it is at least 0", 35),
        (loops("tuning.integral_time: {uniform: [1 kg, 2 kg]}"), "1 kg: '1 kg' is not a time", 35),
        ("  seeds: 3", "unknown key", 3),
    ],
)
def test_a_mistake_is_reported_where_it_stands(vary, message, column):
    found = [d for d in checked(vary) if d.severity.label == "error"]
    assert len(found) == 1
    assert message in found[0].message
    assert found[0].span.column == column
    assert found[0].span.line == 9 + vary.count("\n")
    ran = pidcfg.simulate(scenario(vary), name="run.scenario.yaml", files={"loop.yaml": CONFIG})
    assert [d.message for d in ran.findings if d.severity.label == "error"] == [found[0].message]
    assert ran.report is None


@pytest.mark.parametrize(
    ("low", "message"),
    [
        ("0", "time_constant must be above 0, and 0 s to 1 s goes down to 0"),
        ("1e-13", "time_constant goes below 1e-12"),
        ("1e-12", None),
    ],
)
def test_a_time_constant_stays_above_what_the_arithmetic_loses(low, message):
    text = scenario(plants(f"time_constant: {{uniform: [{low} s, 1 s]}}")).replace(
        "model: dead_time, gain: 2", "model: first_order, time_constant: 1 s"
    )
    found = pidcfg.check(text, name="run.scenario.yaml", files={"loop.yaml": CONFIG}).findings
    assert [d.message for d in found if d.severity.label == "error"] == ([message] if message else [])


@pytest.mark.parametrize("share", ["0 %", "100 %", "120", "-5 %"])
def test_a_share_that_no_samples_can_show_is_refused(share):
    (found,) = checked(plants("gain: ±3 %"), expect=PASSES.replace("90 %", share))
    assert found.message.startswith("samples cannot show a share of")
    assert found.path == ("expect", 0, "share")


def ends(vary, config=CONFIG):
    """The ends of the one number that varies."""
    loaded = loaded_of(scenario(vary), config)
    ((one,), problems) = loaded.uncertainties(loaded.new_plc())
    assert problems == []
    return one


@pytest.mark.parametrize(
    ("vary", "wanted"),
    [
        (plants("gain: ±30 %"), (1.4, 2.6)),
        (plants("gain: +-30%"), (1.4, 2.6)),
        (plants("gain: +/-90 %"), (0.2, 3.8)),
        (plants("dead_time: {uniform: [500 ms, 2000 ms]}"), (0.5, 2.0)),
        (plants("dead_time: {uniform: [0 min, 2 min]}"), (0.0, 120.0)),
        (plants("load: {normal: [1, 2], limits: [-3, 3]}"), (-3.0, 3.0, 1.0, 2.0)),
        (plants("load: {normal: [1, 2]}"), (-inf, inf, 1.0, 2.0)),
        (loops("tuning.gain: ±10 %"), (2.25, 2.75)),
        (loops("setpoint: ±10 %"), (45.0, 55.0)),
        (loops("setpoint.limits.1: ±10 %"), (180.0, 220.0)),
        (loops("tuning.integral_time: ±50 %"), (1.0, 3.0)),
    ],
)
def test_a_spread_has_its_ends(vary, wanted):
    found = ends(vary).spread
    assert (found.low, found.high) == pytest.approx(wanted[:2])
    if len(wanted) > 2:
        assert (found.mean, found.sigma) == wanted[2:]
    else:
        assert found.sigma is None


def test_a_share_of_a_negative_number_is_of_its_amount():
    text = scenario(plants("gain: ±30 %")).replace("gain: 2}", "gain: -2}")
    loaded = loaded_of(text)
    ((one,), _) = loaded.uncertainties(loaded.new_plc())
    assert (one.spread.low, one.spread.high) == pytest.approx((-2.6, -1.4))


def test_a_number_keeps_the_unit_of_the_file():
    one = ends(loops("tuning.integral_time: ±50 %"))
    assert one.unit == "min"
    assert one.number_text(1.23456789012) == "1.23456789 min"
    assert ends(plants("gain: ±30 %")).number_text(1e-7) == "0.0000001"


LISTED = """\
pidcfg: 1
scenario: listed
config: words.txt
duration: 10
vary: {loops: {TIC-101: {SPREAD}}}
"""


@pytest.mark.parametrize(
    ("spread", "config", "wanted"),
    [
        ("gain: ±10 %", "starter.yaml", []),
        ("tuning.gain: ±10 %", "starter.yaml", []),
        ("tuning.gain: ±10 %", "words.txt", ["the configuration file gives TIC-101 no number at tuning.gain"]),
        ("tuning.gain: {uniform: [2, 3]}", "words.txt", []),
    ],
)
def test_a_listing_has_no_value_of_which_to_take_a_share(spread, config, wanted):
    text = starter(VENDORS["dl06"])
    files = {"starter.yaml": text, "words.txt": pidcfg.encode(text, "text").text}
    scenario = LISTED.replace("{SPREAD}", f"{{{spread}}}").replace("words.txt", config)
    findings = pidcfg.check(scenario, name="run.scenario.yaml", files=files).findings
    found = [d for d in findings if d.path[:1] == ("vary",)]
    assert [d.message.partition(",")[0] for d in found] == wanted
    assert all(d.help == "write uniform: [low, high]" for d in found)


def test_a_register_of_whole_numbers_takes_whole_numbers():
    text = """\
pidcfg: 1
scenario: whole
config: starter.yaml
duration: 10
vary: {loops: {OVEN1: {pv.filter: {uniform: [1, 9]}}}}
"""
    loaded = loaded_of(text, starter(VENDORS["click"]), "starter.yaml")
    ((one,), problems) = loaded.uncertainties(loaded.new_plc())
    assert problems == []
    assert one.is_integer
    assert [one.number_text(value) for value in (1.2, 2.5, 3.5, 8.8)] == ["1", "2", "4", "9"]


def test_an_amount_is_a_number_with_or_without_a_unit():
    assert parse_amount(Plain("40")) == Amount(40)
    assert parse_amount(Plain("-2.5 min")) == Amount(parse_amount(Plain("-2.5")).value, "min")
    assert parse_amount(Plain("120 /min")) == Amount(120, "/min")
    assert str(parse_amount(Plain("2.50 min"))) == "2.5 min"


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("±30 %", "±30 %"),
        ({"uniform": [40, 90]}, "40 to 90"),
        ({"normal": [8, 2]}, "8, deviation 2"),
        ({"normal": [8, 2], "limits": [4, 14]}, "8, deviation 2 within 4 to 14"),
    ],
)
def test_a_spread_in_words(text, shown):
    assert str(parse_spread(Plain(text) if isinstance(text, str) else text)) == shown


def test_the_file_s_values_run_in_simulate():
    report = pidcfg.simulate(scenario(), name="run.scenario.yaml", files={"loop.yaml": CONFIG}).report
    assert report.signals["TIC-1.PV"].final == 100
    assert report.expectations[0].passed


def test_a_gain_whose_sign_may_change_is_a_warning():
    (found,) = checked(plants("gain: ±130 %"))
    assert (found.code, found.severity.label) == ("PID053", "warning")
    assert found.message == "the gain of TIC-1 goes from -0.6 to 4.6: with the other sign the loop runs away"
    assert checked(plants("gain: ±99 %")) == ()
    assert "-1 to 5" in checked(plants("gain: {normal: [2, 1]}"))[0].message
    assert checked(plants("gain: {normal: [2, 1], limits: [0.1, 4]}")) == ()
    assert pidcfg.simulate(
        scenario(plants("gain: ±130 %")), name="run.scenario.yaml", files={"loop.yaml": CONFIG}
    ).report


def test_events_may_set_a_key_in_its_own_unit():
    config = CONFIG.replace("pv: {range: [0, 200]}", "pv: {range: [0, 200], unit: degC}")
    events = "events: [{{at: 1, loop: TIC-1, set: {{setpoint: 60 {}, alarms: {{pv: {{high: 150 °C}}}}}}}}]\n"

    def ran(unit):
        text = scenario(plants("gain: ±3 %")) + events.format(unit)
        return pidcfg.simulate(text, name="run.scenario.yaml", files={"loop.yaml": config})

    result = ran("°C")
    assert [d.message for d in result.findings] == []
    assert result.report.signals["TIC-1.SP"].final == 60
    assert [d.message for d in ran("bar").findings] == ["setpoint: '60 bar' is not a number"]
