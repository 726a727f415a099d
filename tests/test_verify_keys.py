"""The key that a verdict names: of the file that is wrong, and also where it does not give that key."""

from copy import deepcopy
from dataclasses import replace
from decimal import Decimal
from types import SimpleNamespace

import pytest
from pydantic_core import PydanticCustomError

from pidcfg.conversion.comparison import is_same_value
from pidcfg.conversion.pipeline import convert
from pidcfg.sim.controllers.plc import TICKS
from pidcfg.sim.judgement.report import Alarm, LoopReport, ModeChange
from pidcfg.study.verification.comparison import SignalDifference as Difference
from pidcfg.study.verification.comparison import differing_fields, running_means
from pidcfg.study.verification.stages import Act, Stage
from pidcfg.study.verification.trial import _alarm_by_sample as alarm_of
from pidcfg.study.verification.trial import _companion_events as other_events
from pidcfg.study.verification.trial import _modes_by_sample as modes_of
from pidcfg.study.verification.trial import _sample_at as sample_at
from pidcfg.study.verification.trial import _square_root as root_of
from pidcfg.study.verification.trial import companion_loops, loops_of, master_of, names_of, scenario_data, slaves_of
from pidcfg.study.verification.twin import explaining_key, field_of
from pidcfg.study.verification.verify import make_side
from pidcfg.vendors import VENDORS
from test_verify import BENCH, lower_loop
from verify_measure import checked

EZLOGIX = {
    "pidcfg": 1,
    "vendor": "ezlogix",
    "plc": {"process_when_stopped": True},
    "loops": [
        {
            "name": "OVEN",
            "registers": "R101",
            "discretes": "S101",
            "mode": "auto",
            "algorithm": "velocity",
            "action": "reverse",
            "sample_rate": 1.0,
            "tuning": {"proportional_gain": 4.0, "integral_time": 60.0, "derivative_time": "off"},
            "pv": {"tag": "IR1", "range": [0, 400], "unit": "degC", "counts": [0, 4095]},
            "setpoint": {"value": 170.0, "limits": [20, 320]},
            "output": {"tag": "OR1", "range": [0, 100], "unit": "%", "limits": [10, 90]},
            "anti_windup": True,
        }
    ],
}
CASES = [
    ("dl06", "bias_freeze", None, ("step 50 %", "pv", 0.5, 0.4), "bias_freeze"),
    ("dl06", "bumpless", None, ("transfers", "pv", 0.5, 0.4), "bumpless"),
    ("dl06", "setpoint.value", None, ("start", "setpoint", 170.0, 0.0), "setpoint.value"),
    ("click", "freeze_bias", None, ("step 50 %", "pv", 0.5, 0.4), "freeze_bias"),
    ("click", "action", "reverse", ("high limit", "pv", 0.5, 0.4), "action"),
    ("click", "tuning.proportional_gain", 5.0, ("auto", "output", 0.5, 0.4), "tuning.proportional_gain"),
    ("dl06", "output.limits.1", 95, ("step 50 %", "output", 0.9, 0.95), "output.limits"),
    ("dl06", "output.range.1", 105, ("step 50 %", "output", 0.9, 0.857), "output.range"),
    ("dpide", "CYCLE", 1200, ("start", "sample time", 1.0, 1.2), "CYCLE"),
    ("dpide", "Kc_Kp", 1.25, ("start", "pv", 0.5, 0.4), "Kc_Kp"),
    ("dpide", "PID_MAN", True, ("start", "mode", "auto", "manual"), "PID_MAN"),
    ("nextopid", "MaxPV", 380, ("set point limits", "setpoint", 400.0, 380.0), "MaxPV"),
    ("nextopid", "Kp", 1.25, ("start", "pv", 0.5, 0.4), "Kp"),
    ("nextopid", "Manual", None, ("start", "mode", "manual", "auto"), "Manual"),
]


def edited(data, path, value):
    """A file's data with one key of its first loop changed, or taken out for None."""
    data = deepcopy(data)
    *above, last = [int(part) if part.isdecimal() else part for part in path.split(".")]
    here = data["loops"][0]
    for part in above:
        here = here[part]
    if value is None:
        del here[last]
    else:
        here[last] = value
    return data


@pytest.mark.parametrize(("target", "path", "value", "seen", "key"), CASES)
def test_key_is_the_one_that_was_spoiled(target, path, value, seen, key):
    base = edited(EZLOGIX, "mode", "manual") if path == "Manual" else EZLOGIX
    source = checked(base)
    outcome = convert(source.config, source.vendor, VENDORS[target], {})
    result = checked(edited(outcome.data, path, value))
    assert not result.failed
    (loop,) = loops_of(source.config, source.vendor)
    stage, signal, before, after = seen
    difference = Difference(stage, signal, 1.0, before, after, (1,))
    assert explaining_key(difference, loop, make_side(result.vendor, result.config), 0) == key


GAIN = ("gain: 2, integral_time: 30, d", "gain: 3, integral_time: 30, d")
NO_INTEGRAL = ("gain: 2, integral_time: 30, d", "gain: 2, integral_time: 0, d")
LIMITS = ("manual: 20", "manual: 20, limits: [5, 40]")
MODE, VALUE, MANUAL = ("mode: cascade", "mode: manual"), ("value: 90", "value: 80"), ("manual: 20", "manual: 25")


@pytest.mark.parametrize(
    ("stage", "signal", "changes", "field"),
    [
        ("start", "sample time", [GAIN, ("me: 1, mode", "me: 2, mode")], "sample_time"),
        ("start", "mode", [GAIN, MODE], "mode"),
        ("step 5 %", "mode", [MODE], ""),
        ("start", "setpoint", [GAIN, VALUE], "setpoint.value"),
        ("step 5 %", "setpoint", [GAIN, VALUE], ""),
        ("step 5 %", "setpoint", [GAIN, ("limits: [20, 180]", "limits: [30, 180]")], "setpoint.limits.0"),
        ("start", "pv", [GAIN, VALUE], "setpoint.value"),
        ("start", "pv", [GAIN, MANUAL], "tuning.gain"),
        ("step 5 %", "pv", [GAIN, VALUE, MODE, MANUAL], "tuning.gain"),
        ("step 5 %", "pv", [GAIN, ("range: [0, 200]", "range: [0, 210]")], "pv.range.1"),
        ("step 5 %", "output", [GAIN, ("range: [0, 200]", "range: [0, 210]")], "pv.range.1"),
        ("step 5 %", "pv", [GAIN, ("filter: 2}", "filter: 3}")], "pv.filter"),
        ("step 5 %", "output", [GAIN, ("filter: 2}", "filter: 3}")], "tuning.gain"),
        ("step 5 %", "pv", [GAIN, LIMITS], "tuning.gain"),
        ("high limit", "pv", [GAIN, LIMITS], "output.limits.0"),
        ("low limit", "output", [GAIN, LIMITS], "output.limits.0"),
        ("low limit", "high", [GAIN, LIMITS], ""),
        ("manual", "output", [GAIN, LIMITS], "output.limits.0"),
        ("manual", "output", [GAIN, ("range: [0, 50]", "range: [0, 60]")], "output.range.1"),
        ("auto", "output", [GAIN, ("range: [0, 50]", "range: [0, 60]")], "tuning.gain"),
        ("dead band", "pv", [GAIN, ("deadband: 4", "deadband: 5")], "deadband"),
        ("dead band 2", "output", [GAIN, ("deadband: 4", "deadband: 5")], "deadband"),
        ("step 5 %", "pv", [GAIN, ("deadband: 4", "deadband: 5")], "tuning.gain"),
        ("alarms", "high", [GAIN, ("high: 150", "high: 140")], "alarms.pv.high"),
        ("alarms", "high", [("{high: 20", "{high: 19"), ("hysteresis: 3", "hysteresis: 4")], "alarms.hysteresis"),
        ("alarms", "deviation_high", [("high: 150", "high: 140"), ("{high: 20", "{high: 19")], "alarms.deviation.high"),
        ("alarms", "rate_of_change", [GAIN, ("rate_of_change: 8", "rate_of_change: 9")], "alarms.rate_of_change"),
        ("alarms", "low", [GAIN, ("filter: 2}", "filter: 3}")], "pv.filter"),
        ("step 5 %", "pv", [("gain: 2, integral_time: 30, d", "gain: 2.005, integral_time: 30, d")], ""),
        ("step 5 %", "pv", [("gain: 2, integral_time: 30, d", "gain: 2.015, integral_time: 30, d")], "tuning.gain"),
        ("start", "setpoint", [("value: 90", "value: 90.9")], ""),
        ("start", "setpoint", [("value: 90", "value: 91.1")], "setpoint.value"),
        (
            "step 5 %",
            "pv",
            [("name: L,", "name: L, description: other,"), ("range: [0, 50],", "range: [0, 50], unit: x,")],
            "",
        ),
    ],
)
def test_the_field_that_explains_a_difference(stage, signal, changes, field):
    difference = Difference(stage, signal, 0.0, 0.5, 0.4, ())
    assert field_of(difference, lower_loop(()), lower_loop(changes)) == field
    assert not field or field_of(difference, lower_loop(()), lower_loop(changes), [field.removesuffix(".0")]) != field


@pytest.mark.parametrize(
    ("stage", "before", "after", "field"),
    [
        ("step 5 %", 0.8, 0.95, "output.limits.1"),
        ("step 5 %", 0.8015, 0.95, "output.limits.1"),
        ("step 5 %", 0.8025, 0.95, "tuning.gain"),
        ("step 5 %", 0.8025, 0.9, "output.limits.1"),
        ("step 5 %", 0.5, 0.1, "tuning.gain"),
        ("step 5 %", 0.5, 0.2, "output.limits.1"),
    ],
)
def test_an_output_that_stands_at_a_limit_is_explained_by_that(stage, before, after, field):
    """The first side's limits are 10 and 80 %, the other's 20 and 90 %."""
    one = lower_loop([("manual: 20", "manual: 20, limits: [5, 40]")])
    two = lower_loop([GAIN, ("manual: 20", "manual: 20, limits: [10, 45]")])
    found = field_of(Difference(stage, "output", 0.0, before, after, ()), one, two)
    assert found.replace("limits.0", "limits.1") == field


def test_what_only_some_loops_have_explains_nothing_in_others():
    bias = ("manual: 20", "manual: 20, bias: 5")
    derivative_on = ("derivative_time: 5", "derivative_time: 5, derivative_on: error")
    pv, output = (Difference("step 5 %", signal, 0.0, 0.5, 0.4, ()) for signal in ("pv", "output"))
    assert field_of(pv, lower_loop(()), lower_loop([bias])) == ""
    assert field_of(pv, lower_loop([NO_INTEGRAL]), lower_loop([NO_INTEGRAL, bias])) == "output.bias"
    stronger = ("gain: 2, integral_time: 30, d", "gain: 3, integral_time: 0, d")
    assert field_of(output, lower_loop([NO_INTEGRAL]), lower_loop([stronger, bias])) == "output.bias"
    assert field_of(output, lower_loop(()), lower_loop([derivative_on])) == "tuning.derivative_on"
    without = ("derivative_time: 5", "derivative_time: 0")
    changed = lower_loop([("derivative_time: 5", "derivative_time: 0, derivative_on: error")])
    assert field_of(output, lower_loop([without]), changed) == ""
    start = Difference("start", "output", 0.0, 0.5, 0.4, ())
    assert field_of(start, lower_loop(()), lower_loop([MANUAL])) == ""
    assert field_of(start, lower_loop([MODE]), lower_loop([MODE, MANUAL])) == "output.manual"
    assert field_of(start, lower_loop(()), lower_loop([MODE, MANUAL])) == "mode"


def cascaded(*sources):
    """Loops A, B, C and so on, each with the loop that gives its set point; None stands for a block."""
    return [
        None if source is None else SimpleNamespace(name=name, setpoint=SimpleNamespace(source=source or None))
        for name, source in zip("ABCDE", sources, strict=False)
    ]


@pytest.mark.parametrize(
    ("sources", "slaves", "masters", "alone", "with_master"),
    [
        (("", "A", "B"), [(1,), (2,), ()], [None, 0, 1], [(2, 1), (2,), ()], [(2, 1), (0, 2), (1,)]),
        (("", "A", "A"), [(1, 2), (), ()], [None, 0, 0], [(2, 1), (), ()], [(2, 1), (0,), (0,)]),
        (("B", "A"), [(1,), (0,)], [1, 0], [(1,), (0,)], [(1,), (0,)]),
        (("A", None, "Z"), [(), (), ()], [None, None, None], [(), (), ()], [(), (), ()]),
    ],
)
def test_the_loops_of_a_cascade(sources, slaves, masters, alone, with_master):
    loops = cascaded(*sources)
    real = [i for i, loop in enumerate(loops) if loop is not None]
    assert [slaves_of(loops, i) for i in real] == [slaves[i] for i in real]
    assert [master_of(loops, i) for i in range(len(loops))] == masters
    assert [companion_loops(loops, i, with_master=False) for i in real] == [alone[i] for i in real]
    assert [companion_loops(loops, i, with_master=True) for i in real] == [with_master[i] for i in real]


def counting():
    """A PLC of two loops, of which the second counts output and set point in whole numbers."""

    def check_set(i, _path, value):
        if value < 0 or (i == 1 and value != round(value)):
            raise PydanticCustomError("whole", "no")

    return SimpleNamespace(
        loops=("A", "B"),
        modes=("manual", "auto", "cascade"),
        out_ranges=None,
        base_ticks=TICKS // 2,
        signals=("A.PV", "A.SP", "A.OUT", "B.PV", "B.SP", "B.OUT"),
        scales=[(0.0, 100.0, 4095), (0.0, 7.0, 4095)],
        configs=[
            SimpleNamespace(period=TICKS * 2, sp_slot=1, out_slot=2),
            SimpleNamespace(period=TICKS, sp_slot=4, out_slot=5),
        ],
        pv_inputs={"A": "A.InVar"},
        check_set=check_set,
    )


def test_what_other_loops_of_a_cascade_do_meanwhile():
    plc = counting()
    assert other_events(plc, 0, 2, (0.0, 60.0), is_master=True) == [{"at": 0, "loop": "A", "mode": "manual"}]
    assert other_events(plc, 0, 2, (0.0, 61.0), is_master=False) == [
        {"at": 12, "loop": "A", "mode": "manual"},
        {"at": 12, "loop": "A", "set": {"output": 30.5}},
        {"at": 14, "loop": "A", "mode": "auto"},
        {"at": 14, "loop": "A", "set": {"setpoint": 50}},
        {"at": 16, "loop": "A", "mode": "cascade"},
    ]
    plc.modes = ("manual", "auto")
    assert other_events(plc, 1, 0, (0.0, 5.0), is_master=False)[1:] == [
        {"at": 0, "loop": "B", "set": {"output": 2}},
        {"at": 1, "loop": "B", "mode": "auto"},
        {"at": 1, "loop": "B", "set": {"setpoint": 4}},
    ]


def test_a_stage_is_a_scenario_in_the_words_of_a_side():
    """An output of 4 to 20 and a gain of 100 of its whole range: 6.25 a unit, of which 25 stand in its zero."""
    loops = cascaded("", "A")
    loops[1].output = loops[0].output = SimpleNamespace(range=(4.0, 20.0))
    names = names_of(counting(), loops, 1, "Plant * 2", (0,), as_configured=False)
    acts = (
        Act(1.0, mode="auto", setpoint=20.4, output=0.5),
        Act(2.0, load=40.0, master_output=0.25),
        Act(3.0, sensor_lost=True),
        Act(4.0, pv_offset=1.5, mode="off"),
    )
    stage = Stage("x", "x", acts, end=9.0, pv=55.0, load=30.0)
    data = scenario_data(stage, BENCH, names)
    assert data["plants"] == [
        {"name": "Plant", "model": "first_order", "input": "B.OUT", "initial": 55.0, "gain": 6.25,
         "time_constant": 20.0, "dead_time": 1.0, "load": 5.0, "limits": [0.0, 200.0]}
    ]  # fmt: skip
    assert (data["scenario"], data["duration"], data["signals"]) == ("x", 9.0, {"lost": 0, "moved": 0})
    assert data["connect"] == {"B.PV": "Plant * 2", "A.InVar": "A.SP"}
    assert data["events"] == [
        {"at": 0, "loop": "A", "mode": "manual"},
        {"at": 1.0, "loop": "B", "mode": "auto"},
        {"at": 1.0, "loop": "B", "set": {"setpoint": 20}},
        {"at": 1.0, "loop": "B", "set": {"output": 12}},
        {"at": 2.0, "loop": "A", "set": {"output": 8.0}},
        {"at": 2.5, "plant": "Plant", "disturb": {"load": 15.0}},
        {"at": 3.5, "set": {"lost": 1}},
        {"at": 4.5, "set": {"moved": 1.5}},
    ]
    swept = scenario_data(replace(stage, is_swept=True), BENCH, names)
    assert swept["plants"] == [
        {"name": "Plant", "model": "integrator", "input": "0", "gain": 1, "load": 0, "initial": 55.0,
         "limits": [0.0, 200.0]}
    ]  # fmt: skip
    assert swept["events"][5] == {"at": 2.5, "plant": "Plant", "disturb": {"load": 40.0}}
    assert names_of(counting(), loops, 1, "Plant", (0,), as_configured=True).events == []


def test_means_of_what_a_signal_has_shown():
    assert running_means([1.0, 2.0, 6.0], 1) == [1.5, 3.0]
    assert running_means([1.0] * 60 + [61.0, 1.0], 59) == [1.0, 2.0, 2.0]


def test_when_a_sample_first_shows_what_has_happened():
    assert [sample_at(at, 0.5) for at in (0.0, 0.4, 0.5, 0.5000001, 0.51, 1.0)] == [0, 1, 1, 1, 2, 2]
    assert [root_of(value, 10.0, 40.0, zero) for value, zero in ((20.0, 0.0), (0.0, 0.0), (10.0, 0.25))] == [30, 10, 30]
    modes = [ModeChange(1.0, None, "auto", None), ModeChange(9.0, None, "off", None)]
    alarms = [Alarm("high", 0.5, 1.0), Alarm("low", 0.0), Alarm("high", 2.0, 2.0), Alarm("high", 3.0), Alarm("x", 9.0)]
    report = LoopReport(first_mode="manual", modes=modes, alarms=alarms)
    assert modes_of(report, 4, 0.5) == ["manual", "manual", "auto", "auto"]
    assert alarm_of(report, "high", 8, 0.5) == [False, True, False, False, True, False, True, True]
    assert alarm_of(report, "x", 8, 0.5) == [False] * 8


@pytest.mark.parametrize(
    ("a", "b", "alike"),
    [(1000, Decimal("1000.001"), True), (1000, Decimal("1000.0011"), False), (0, Decimal("1e-9"), False),
     ("x", "x", True), ("x", "y", False), (None, 0, False), (True, True, True), (-1000, Decimal("-1000.0009"), True)],
)  # fmt: skip
def test_neutral_values_that_count_as_equal(a, b, alike):
    assert is_same_value(a, b) is is_same_value(b, a) is alike


def test_fields_on_which_others_depend_come_first():
    one, two = {"x": 1, "tuning.gain": 2, "same": 3}, {"x": 2, "sample_time": 1, "tuning.gain": 3, "same": 3, "new": 1}
    assert differing_fields(one, two) == ["sample_time", "tuning.gain", "x", "new"]
