"""The loop that stands in for both sides of a conversion: it does what each PLC does, and no other rule does."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import fields, replace
from decimal import Decimal
from typing import get_type_hints

import pytest

from pidcfg.api import check_text, convert
from pidcfg.cli.formats.conversion import verdict_text
from pidcfg.conversion import Change, Terms
from pidcfg.conversion import operation as rules
from pidcfg.conversion.operation import (
    Deadband,
    Hand,
    Operation,
    Start,
    Transfer,
    Windup,
    Zero,
    first_output,
    source_of,
)
from pidcfg.output.conversion import verified_data
from pidcfg.study.verification.comparison import CountSizes
from pidcfg.study.verification.comparison import find_differences as compared
from pidcfg.study.verification.stand_in import Rules, make_stand_in
from pidcfg.study.verification.twin import _find_answer, _is_listed, drop_losses, replace_fields, replace_rules
from pidcfg.study.verification.verify import (
    Battery,
    hidden_fields,
    make_reference,
    make_side,
    tolerance_of,
    unreported_numbers,
    unreported_rules,
    verify,
)
from pidcfg.text.paths import set_value
from test_verify import BENCH, FEW, SWEPT, side
from verify_measure import PLCS, ROOT, Conversion, checked, of_vendor, spoils, verdict, wild_loop, wild_source

LOOP = {
    "name": "L1",
    "mode": "auto",
    "output_raises_pv": True,
    "sample_time": 1,
    "tuning": {"gain": 3.0, "integral_time": 20, "derivative_time": 4, "derivative_on": "error"},
    "pv": {"range": [0, 100], "unit": "degC"},
    "setpoint": {"value": 50},
    "output": {"range": [0, 100], "limits": [10, 90], "manual": 30},
    "deadband": 2,
}


def configured(vendor: str, **changes):
    """The loop of a vendor; None where it has no such loop."""
    loop = {**LOOP, **changes}
    return of_vendor([loop], vendor) or of_vendor([{key: loop[key] for key in loop if key != "deadband"}], vendor)


def differences(source, operation=None):
    """Where a configuration and its stand-in differ, with the rules of its PLC or with others."""
    side = make_side(source.vendor, source.config)
    own = source_of(source.vendor).operations(source.config)[0]
    held = make_stand_in(side.loops, [Rules.make(side, 0, operation or own)])
    reference = make_reference(held, 0, side.loop(0))
    tolerance = tolerance_of(held, 0, side, 0, reference.bench)
    yield from Battery(reference, side, 0, tolerance).find_differences()


@pytest.mark.parametrize("vendor", PLCS)
@pytest.mark.parametrize("number", [1, 2, 3, 7, 11])
def test_a_plc_does_what_its_stand_in_does(vendor, number):
    import random

    source = of_vendor([wild_loop(random.Random(f"stand-in/{number}"), 1)], vendor)
    if source is None:
        pytest.skip(f"{vendor} has no such loop")
    assert [(d.stage, d.signal) for d in differences(source)] == []


OTHERS = [
    ("start", Start.RUNS),
    ("start", Start.WAITS),
    ("hand", Hand.LIMITED),
    ("hand", Hand.FREE),
    ("transfer", Transfer.GOES_ON),
    ("transfer", Transfer.ON_TOP),
    *(("windup", windup) for windup in Windup if windup is not Windup.NONE),
    *(("deadband", rule) for rule in Deadband),
]
ALIKE = {
    frozenset({Start.WAITS, Start.RETURNS}),
    frozenset({Windup.WORKED_OUT, Windup.NONE}),
    frozenset({Windup.FROZEN_AT_ENDS, Windup.WITHIN_RANGE}),
    frozenset({Windup.PARTIAL, Windup.HELD_BEYOND}),
}
"""Rules that are one here: it begins from Manual both ways; the limits lie within the range; they are less than a
sample of the integral apart."""
NO_START = ("ezlogix", "nextopid")
"""PLCs that begin in Auto with the output that they would have in Manual."""


@pytest.mark.parametrize("vendor", PLCS)
def test_no_other_rule_stands_in_for_a_plc(vendor):
    source = configured(vendor)
    own = source_of(source.vendor).operations(source.config)[0]
    (loop,) = make_side(source.vendor, source.config).loops
    for rule, answer in OTHERS:
        present = getattr(own, rule)
        idle = (rule == "deadband" and not loop.deadband) or (rule == "start" and vendor in NO_START)
        if answer is present or frozenset({answer, present}) in ALIKE or idle:
            continue
        found = next(differences(source, replace(own, **{rule: answer})), None)
        assert found is not None, f"{vendor} with {rule} {answer}"


def test_every_answer_is_found_by_its_text():
    hints = get_type_hints(Operation, {**vars(rules), "Decimal": Decimal})
    for field in fields(Operation):
        kind = hints[field.name]
        if isinstance(kind, type) and issubclass(kind, rules.Answer):
            assert [_find_answer(field.name, answer.text) for answer in kind] == list(kind)
    assert _find_answer("windup", Start.RUNS.text) is None
    assert _find_answer("nothing", Start.RUNS.text) is None


def test_rules_are_those_that_lines_name_and_not_those_of_the_target():
    own = Operation(windup=Windup.FROZEN, transfer=Transfer.ON_TOP, has_edge=True)
    target = Operation(windup=Windup.ENDLESS, transfer=Transfer.GOES_ON, slowest_integral=Decimal(6000))
    line = Change("operation.windup", "assumed", own.windup.text, Windup.PARTIAL.text)
    found = replace_rules(own, [line], target, integral=True)
    assert (found.windup, found.transfer, found.has_edge) == (Windup.PARTIAL, Transfer.ON_TOP, False)
    slow = replace_rules(own, [], target, integral=False)
    assert (slow.windup, slow.transfer) == (Windup.ENDLESS, Transfer.GOES_ON)


TERMS = Terms("tuning.gain", Decimal(2), Decimal("2.02"))


@pytest.mark.parametrize(
    ("path", "before", "after", "row", "said"),
    [
        ("tuning.gain", 2, "2.02", {"kind": "rounded", "terms": TERMS}, True),
        ("tuning.gain", 2, "2.0203", {"kind": "rounded", "terms": TERMS}, False),
        ("tuning.gain", 2, "2.5", {"kind": "clamped", "terms": TERMS}, False),
        ("tuning.integral_time", 20, "20.4", {"kind": "rounded", "error_percent": 0.4}, True),
        ("tuning.integral_time", 20, "21", {"kind": "rounded", "error_percent": 0.4}, False),
        ("deadband", 2, "0", {"kind": "dropped"}, True),
        ("deadband", 2, "1", {"kind": "dropped"}, False),
        ("output.manual", None, "12.5", {"kind": "assumed", "target": 12.5}, True),
        ("output.manual", None, "13", {"kind": "assumed", "target": 12.5}, False),
        ("alarms.pv.low", 10, None, {"kind": "dropped"}, True),
        ("alarms.pv.low", 10, None, {"kind": "rounded"}, False),
    ],
)
def test_a_line_explains_the_number_that_it_says_and_no_other(path, before, after, row, said):
    change = Change(path, row.pop("kind"), before, row.pop("target", None), **row)
    one, two = (None if value is None else Decimal(value) for value in (before, after))
    assert _is_listed(path, one, two, two, change) is said


def test_a_choice_is_another_one_where_it_is_lost_alone():
    lost, assumed = (Change("DerivEr", kind, False, None) for kind in ("dropped", "assumed"))
    assert _is_listed("tuning.derivative_on", "pv", "error", "error", lost)
    assert not _is_listed("tuning.derivative_on", "pv", "error", "error", assumed)


def test_fields_of_a_neutral_loop_are_changed_and_taken_away():
    source = configured("nextopid")
    (loop,) = make_side(source.vendor, source.config).loops
    found = replace_fields(
        loop, {"output.limits.1": Decimal(80), "setpoint.limits.0": Decimal(5), "tuning.gain": Decimal(3)}
    )
    assert (found.output.limits, found.setpoint.limits, found.tuning.gain) == ((10, 80), (5, 100), 3)
    assert replace_fields(loop, {"setpoint.value": None}).setpoint.value is None
    assert replace_fields(loop, {}) is loop


HELD = """
pidcfg: 1
vendor: nextopid
plc: {sample_time: 0.5}
loops:
  - {name: L1, type: PIDA_REAL, SP: 40, Kp: 1, Ti_Ki: 30, Td_Kd: 0, MaxMV: 100, MinMV: 12.5, MaxPV: 100, MinPV: 0,
     Direct: false, Manual: true, pv: {unit: degC}, output: {range: [0, 100]}}
"""


def test_an_output_that_limits_hold_in_manual_goes_over_as_it_is():
    """MinMV is 12.5 %: a CLICK has no limits in Manual, and would begin at 0 %."""
    result = convert(HELD, "click", verify=True)
    assert result.data["loops"][0]["state"]["output"] == 12.5
    assert result.alike
    without = checked({**result.data, "loops": [{k: v for k, v in result.data["loops"][0].items() if k != "state"}]})
    one = Conversion.of(check_text(HELD), "click", "held")
    assert verdict(one, without, 0, 0).stage == "start"


@pytest.mark.parametrize(
    ("hand", "zero", "manual", "limits", "span", "wanted"),
    [
        (Hand.LIMITED, Zero.OF_UNIT, None, (10, 90), (0, 100), 10),
        (Hand.FREE, Zero.OF_RANGE, None, (10, 90), (0, 100), 0),
        (Hand.FREE, Zero.OF_RANGE, None, None, (4, 20), 4),
        (Hand.LIMITED, Zero.OF_UNIT, None, None, (-100, 100), 0),
        (Hand.FREE, Zero.OF_RANGE, None, None, (-100, 100), -100),
        (Hand.LIMITED, Zero.OF_UNIT, 95, (10, 90), (0, 100), 90),
        (Hand.FREE, Zero.OF_RANGE, 95, (10, 90), (0, 100), 95),
    ],
)
def test_the_output_with_which_a_loop_begins(hand, zero, manual, limits, span, wanted):
    output = {"range": list(span)} | ({} if limits is None else {"limits": list(limits)})
    output |= {} if manual is None else {"manual": manual}
    source = check_text(
        f"pidcfg: 1\nvendor: generic\nloops:\n  - {{name: L, output_raises_pv: true, sample_time: 1, "
        f"tuning: {{gain: 1, integral_time: 9}}, pv: {{range: [0, 9]}}, output: {output}}}\n"
    )
    operation = Operation(windup=Windup.NONE, hand=hand, zero=zero)
    assert first_output(operation, source.config.loops[0]) == wanted


@pytest.mark.parametrize("number", [4, 13, 22, 31, 50, 88, 102])
def test_a_wild_conversion_is_alike_and_with_another_action_or_gain_it_is_not(number):
    source, target = wild_source(number, "w1")
    one = Conversion.of(source, target, f"wild {number}")
    assert verdict(one, one.result, 0, 0, source=True) is None
    sides = one.sides(one.result)
    hidden = list(hidden_fields(make_reference(sides.target_model, 0, sides.target.loops[0]), sides.target_model, 0))
    tried = 0
    for path, change, result in spoils(one, 0, sides.target.loops[0]):
        name = path[-1]
        if name in {"action", "PID_DIR", "Direct", "controller_action"} or (
            name in {"gain", "proportional_gain", "Kp", "Kc_Kp"} and change.startswith("x")
        ):
            tried += 1
            found = verdict(one, result, 0, 0)
            assert found is not None or "tuning.gain" in hidden, (path, change)
    assert tried >= 2


@pytest.mark.parametrize(
    ("seed", "number"),
    [
        ("33101", 48),  # a bias that a limit bounds in one PLC and not in the other, without an integral
        ("33102", 46),
        ("33101", 19),  # an integral that comes to a limit a sample later on one side
        ("33101", 63),  # a filter that lets just as much of a step through as the dead band is wide
        ("33102", 94),  # set points that follow the PV in Manual, one of them a sample later
        ("33106", 3),
        ("33106", 42),  # an alarm point that a slow PV reaches four samples earlier, within a count
        ("33111", 279),  # a gain that the edge of the dead band lets move one side and not the other
        ("33111", 320),  # a slow change that comes to rest at the set point itself, where a dead band begins
        ("33106", 137),  # a derivative that the edge of the dead band kicks from limit to limit
    ],
)
def test_what_rounding_and_order_decide_is_no_difference(seed, number):
    source, target = wild_source(number, seed)
    one = Conversion.of(source, target, f"wild {number}")
    assert verdict(one, one.result, 0, 0, source=True) is None


ALIKE_THOUGH = {
    "P, I and D end at the limit": (
        "dpide",
        (
            "pidcfg: 1\nvendor: dl06\nplc: {loop_table: V2000, derivative: error}\nloops:\n  - {name: T1, mode: auto, "
            "sample_rate: 5, action: direct, bumpless: II, bias_freeze: false, "
            "tuning: {gain: 3, reset: 5, reset_unit: seconds, rate: 2}, derivative_gain_limit: 2, "
            "pv: {range: [0, 6.5], format: 12-bit unipolar}, setpoint: {value: 2.6}, "
            "output: {range: [4, 20], limits: [5.6, 16.8]}}\n"
        ),
    ),
    "an output of 0 in Manual": (
        "dl06",
        (
            "pidcfg: 1\nvendor: ezlogix\nloops:\n  - {name: T1, registers: R1, discretes: S1, mode: manual, "
            "algorithm: position, action: reverse, sample_rate: 0.1, anti_windup: true, "
            "tuning: {proportional_gain: 3, integral_time: 0, derivative_time: 0}, setpoint: {value: 2.641}, "
            "pv: {tag: IR1, range: [0, 6.5], counts: [0, 4095], square_root: true}, "
            "output: {tag: OR1, range: [-100, 100], offset: 0}}\n"
        ),
    ),
    "no proportional action, and another gain": (
        "dl06",
        (
            "pidcfg: 1\nvendor: dpide\nloops:\n  - {name: T1, device: D0, SV: 100, PID_MODE: 2, PID_MAN: true, "
            "MOUT_AUTO: true, CYCLE: 200, Kc_Kp: 0, Ti_Ki: 12, Td_Kd: 120, Tf: 0.25, PID_EQ: false, PID_DE: true, "
            "PID_DIR: false, ERR_DBW: 2, MV_MAX: 3200, MV_MIN: 400, pv: {range: [20, 220]}, "
            "output: {range: [0, 4000]}}\n"
        ),
    ),
    "a proportional action that cannot be switched off": (
        "click",
        (
            "pidcfg: 1\nvendor: nextopid\nplc: {sample_time: 0.2}\nloops:\n  - {name: T1, type: PIDA_REAL, SP: 480, "
            "Kp: 26.7, Td_Kd: 2, Ti_Ki: 1000, MaxMV: 4000, MinMV: 0, DeadBand: 12, MaxPV: 1200, MinPV: 0, "
            "DisableP: true, DerivEr: true, Direct: true, output: {range: [0, 4000]}}\n"
        ),
    ),
    "an output that moves slowly begins at 0, below its lower limit": (
        "generic",
        (
            "pidcfg: 1\nvendor: nextopid\nplc: {sample_time: 0.5}\nloops:\n  - {name: T1, type: PIDA_REAL, SP: 30, "
            "Kp: 3, Ti_Ki: 0.2, Td_Kd: 4.5, Tfd: 0.25, Indep: true, Direct: true, DerivEr: true, MinPV: -20, "
            "MaxPV: 80, MinMV: 5, MaxMV: 45, MaxVarMV: 0.5, output: {range: [0, 50]}}\n"
        ),
    ),
    "the middle of the range is half a count, which double precision misses by its last digit": (
        "ezlogix",
        (
            "pidcfg: 1\nvendor: nextopid\nplc: {sample_time: 0.5}\nloops:\n  - {name: T1, type: PIDA_INT, SP: 9000, "
            "Kp: 0.5, Ti_Ki: 12, Td_Kd: 1.5, MinPV: 0, MaxPV: 20000, MinMV: 0, MaxMV: 10000, DeadBand: 100}\n"
        ),
    ),
    "the middle of an INT's output is no whole number": (
        "dpide",
        (
            "pidcfg: 1\nvendor: nextopid\nplc: {sample_time: 0.4}\nloops:\n  - {name: T1, type: PIDA_TUNE_INT, "
            "SP: 10000, Kp: 0.055462, Ti_Ki: 3.876, Td_Kd: 0, MinPV: 0, MaxPV: 20000, MinMV: 0, MaxMV: 4095, "
            "Direct: true, DeadBand: 200}\n"
        ),
    ),
    "a block is called every fifth cycle of a task that the target has not": (
        "click",
        (
            "pidcfg: 1\nvendor: nextopid\nplc: {sample_time: 0.2}\nloops:\n  - {name: T1, type: PIDA_REAL, "
            "sample_time: 1, SP: 80, Kp: 2, Td_Kd: 0, Ti_Ki: 120, MinPV: 0, MaxPV: 200, MinMV: 0, MaxMV: 50}\n"
        ),
    ),
}


@pytest.mark.parametrize("why", ALIKE_THOUGH)
def test_a_correct_conversion_is_alike_though(why):
    target, text = ALIKE_THOUGH[why]
    (loop,) = convert(text, target, verify=True).verified
    assert loop.passed, loop


ONE_DEVICE = """
pidcfg: 1
vendor: dpide
loops:
  - {name: TIC, device: D500, devices: {MV: D100}, SV: 80, CYCLE: 1000, Kc_Kp: 2, Ti_Ki: 120, Td_Kd: 0, PID_EQ: true,
     PID_DE: true, PID_DIR: true, MV_MAX: 50, MV_MIN: 0, PID_MODE: 2, pv: {range: [0, 200]}, output: {range: [0, 50]}}
  - {name: FIC, device: D530, devices: {SV: D100}, SV: 20, CYCLE: 200, Kc_Kp: 1.5, Ti_Ki: 5, Td_Kd: 0, PID_EQ: true,
     PID_DE: true, PID_DIR: true, MV_MAX: 100, MV_MIN: 0, PID_MODE: 2, pv: {range: [0, 50]}, output: {range: [0, 100]}}
"""


@pytest.mark.parametrize("target", ["nextopid", "generic"])
def test_a_cascade_by_one_device_is_alike_there_and_back(target):
    there = convert(ONE_DEVICE, target, verify=True)
    back = convert(there.text, "dpide", verify=True)

    for result in (there, back):
        assert [(loop.loop, loop.passed) for loop in result.verified] == [("TIC", True), ("FIC", True)]
    assert [loop["devices"] for loop in back.data["loops"]] == [{"MV": "D60"}, {"SV": "D60"}]


def test_an_output_in_manual_is_told_where_a_dead_band_could_switch_it():
    source, target = wild_source(20, "33103")
    one = Conversion.of(source, target, "wild 20")
    spoiled = [result for path, _, result in spoils(one, 0, source.config.loops[0]) if path == ("ManualMV",)]
    assert len(spoiled) == 3
    assert [verdict(one, result, 0, 0).signal for result in spoiled] == ["output"] * 3


def test_a_number_that_no_stage_can_tell_is_listed():
    """An error as large as the dead band makes 25 times the output's range: its width is hard to tell."""
    source = check_text(
        "pidcfg: 1\nvendor: ezlogix\nloops:\n  - {name: L1, registers: R1, discretes: S1, mode: auto, "
        "algorithm: position, action: reverse, sample_rate: 1.0, deadband: 112, anti_windup: true, "
        "setpoint: {value: 170.0}, tuning: {proportional_gain: 90.0, integral_time: 60.0, derivative_time: off}, "
        "pv: {tag: IR1, range: [0, 400], counts: [0, 4095]}, output: {tag: OR1, range: [0, 100]}}\n"
    )
    assert not source.failed, source.findings
    result = convert(source.document.text, "click", verify=True)
    (loop,) = result.verified
    assert loop.passed
    assert loop.hidden == ("deadband",)
    assert result.to_json()["verify"][0]["not_shown"] == list(loop.hidden)
    assert "operation.windup" in {row["line"] for row in result.to_json()["verify"][0]["run_with"]}


def test_a_source_without_what_is_lost_keeps_what_it_cannot_be_without():
    source = check_text(HELD.replace("Ti_Ki: 30,", "Ti_Ki: 30, MaxVarMV: 2,"))
    lost = [Change(key, "dropped", 1, None, loss=True) for key in ("MaxVarMV", "Kp", "nothing", "blocks.X.Y")]
    report = [type("Report", (), {"changes": lost})]
    found = drop_losses(source.config, source.vendor, report)
    assert (found.loops[0].MaxVarMV, found.loops[0].Kp) == (0, 1)
    harmless = [replace(row, loss=False) for row in lost]
    assert drop_losses(source.config, source.vendor, [type("Report", (), {"changes": harmless})]) is source.config


@pytest.mark.parametrize(
    ("file", "target"),
    [
        ("dl06/flow", "dpide"),
        ("ezlogix/coldstore", "click"),
        ("nextopid/heatexchanger", "dl06"),
        ("nextopid/ratio", "generic"),
        ("generic/boiler", "nextopid"),
    ],
)
def test_examples_are_alike_with_what_they_lose(file, target):
    """A root in whole counts, a tag of integers, a count between two, a ratio instead of a master, cascades."""
    result = convert((ROOT / f"examples/{file}.yaml").read_text("utf-8"), target, verify=True)
    assert [(loop.loop, loop.failures) for loop in result.verified if not loop.passed] == []
    assert result.verified


FINE = replace(FEW, response_share=0.0, open_loop=CountSizes(1.0, 0.004), shifts=(0,))


@pytest.mark.parametrize(
    ("flips", "kicks", "wanted"),
    [
        ([15], [15], []),
        ([15], [16], []),
        ([15], [17], [17]),
        ([12, 15, 18, 21], [21], []),
        ([12, 15, 18, 21, 24], [21], [21]),
        ([], [15], [15]),
    ],
)
def test_a_pv_that_is_rounded_the_other_way_moves_the_output_of_its_sample_and_the_next(flips, kicks, wanted):
    """A count of the PV is 0.5 here, and an output may be 0.004 apart."""
    one, two = side(), side()
    for k in flips:
        two.pv[k] += 0.5
    for k in kicks:
        two.output[k] += 0.01
    found = [difference for difference in compared(SWEPT, one, two, BENCH, FINE) if difference.signal == "output"]
    assert [list(difference.samples) for difference in found] == ([wanted] if wanted else [])


RANGED = """
pidcfg: 1
vendor: click
loops:
  - {name: L1, bits: C1, integers: DS1, floats: DF1, mode: manual, action: reverse, sample_rate: 100 ms, bumpless: 1,
     tuning: {proportional_gain: 1.658, reset_time: 7}, pv: {range: [-50, 150], unit: degC}, setpoint: {value: 99},
     output: {limits: [20, 80]}}
"""


@pytest.mark.parametrize(
    ("path", "value", "number"),
    [
        (("pv", "range", 1), 160, "pv.range.1"),
        (("pv", "range", 0), -40, "pv.range.0"),
        (("output", "range", 1), 105, "output.limits.1"),
        (("output", "range", 0), -5, "output.limits.0"),
        (("tuning", "proportional_gain"), 3.4, "tuning.gain"),
        (("tuning", "integral_time"), 7.2, "tuning.integral_time"),
        (("sample_rate",), 0.2, "sample_time"),
        (("deadband",), 9, "deadband"),
        (("setpoint", "value"), 90, "setpoint.value"),
    ],
)
def test_a_number_that_no_line_makes_another_one_is_told_whatever_the_stages_show(path, value, number):
    one = Conversion.of(check_text(RANGED), "ezlogix", "ranged")
    sides = one.sides(one.result)
    assert list(unreported_numbers(sides.target_model.loops[0], sides.target.loops[0])) == []
    data = deepcopy(one.outcome.data)
    set_value(data, ("loops", 0, *path), value)
    sides = one.sides(checked(data))
    found = [row.signal for row in unreported_numbers(sides.target_model.loops[0], sides.target.loops[0])]
    assert number in found


@pytest.mark.parametrize(
    ("target", "path", "value", "rule"),
    [
        ("ezlogix", ("anti_windup",), False, "operation.windup"),
        ("dl06", ("bumpless",), "I", ""),
        ("nextopid", ("Kp",), 3, ""),
    ],
)
def test_a_rule_that_no_line_names_is_told(target, path, value, rule):
    one = Conversion.of(check_text(RANGED), target, "ranged")
    assert list(unreported_rules(one.sides(one.result), 0, 0)) == []
    data = deepcopy(one.outcome.data)
    set_value(data, ("loops", 0, *path), value)
    found = [row.signal for row in unreported_rules(one.sides(checked(data)), 0, 0)]
    assert found == ([rule] if rule else [])


def test_an_output_that_the_target_cannot_hold_begins_as_the_target_does():
    """NextoPID begins at 0 of its unit, an EZLogix at 0 % of the range, and has no register for an output by hand."""
    source = check_text(
        HELD.replace("range: [0, 100]}}", "range: [-100, 100]}, ManualMV: -30}").replace("MinMV: 12.5", "MinMV: -40")
    )
    result = convert(source.document.text, "ezlogix", verify=True)
    assert [row.kind for row in result.loops[0].changes if row.field == "ManualMV"] == ["dropped"]
    assert result.alike


@pytest.mark.parametrize(
    ("changes", "wanted"),
    [
        ({15: 0.019}, []),
        ({15: 0.021}, [15]),
        ({15: 0.019, 17: 0.019}, []),
        ({15: 0.019, 16: 0.019}, [15, 16]),
    ],
)
def test_a_single_sample_at_the_edge_of_a_limit_is_no_difference(changes, wanted):
    """An output may be 0.01 apart here."""
    one, two = side(), side()
    for k, by in changes.items():
        two.output[k] += by
    fine = replace(FEW, closed_loop=CountSizes(1.0, 0.01), shifts=(0,))
    found = [row for row in compared(replace(SWEPT, is_swept=False), one, two, BENCH, fine) if row.signal == "output"]
    assert [list(row.samples) for row in found] == ([wanted] if wanted else [])


def test_the_verdict_tells_what_no_line_names_in_words_and_json():
    one = Conversion.of(check_text(RANGED), "ezlogix", "ranged")
    data = deepcopy(one.outcome.data)
    set_value(data, ("loops", 0, "pv", "range", 1), 160)
    set_value(data, ("loops", 0, "anti_windup"), value=False)
    result = checked(data)
    sides = (one.source.vendor, one.source.config), (result.vendor, result.config)
    (found,) = verify(*sides, one.pairs, one.outcome.loops)
    assert not found.passed
    text = verdict_text([found])
    assert "pv.range.1 is 150 in the source and 160 in the result, and no line says so" in text
    assert "operation.windup is " in text
    shown = [(row["signal"], row["from"], row["to"]) for row in verified_data(found)["differences"] if not row["at"]]
    assert ("pv.range.1", 150.0, 160.0) in shown
