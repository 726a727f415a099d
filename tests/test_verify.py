"""The battery of --verify: correct conversions pass, spoiled ones fail, and the verdict says where and why."""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from functools import cache
from types import SimpleNamespace

import pytest
from click.testing import CliRunner

from pidcfg.api import check_text, convert, diff, encode
from pidcfg.cli.main import cli
from pidcfg.conversion.operation import Smoothing
from pidcfg.sim.controllers.kernels import NEVER
from pidcfg.study.verification.comparison import (
    SAMPLE_SHIFTS,
    CountSizes,
    Tolerance,
    find_differences,
)
from pidcfg.study.verification.stages import (
    ALL_SIGNALS,
    CLOSED_LOOP,
    Act,
    Bench,
    Stage,
    begin_at_rest,
    bench_of,
    go_to_auto,
    stages_of,
)
from pidcfg.study.verification.trial import (
    Trial,
    analog_counts,
    finest_counts,
    loops_of,
    nearest_step,
    new_plc,
    root_step,
    round_setpoints,
    run_stage,
)
from pidcfg.study.verification.verify import (
    Battery,
    make_reference,
    make_side,
    tolerance_between,
    tolerance_of,
    verify,
)
from pidcfg.study.verification.verify import _make_result as verdict_of
from pidcfg.text.writer import yaml_text
from pidcfg.vendors import VENDORS
from verify_measure import Conversion, checked, measure, numbered

HIGH = "high limit"
CAUGHT = (69, 228, 236, 240, 289, 338, 385)
"""Of the measure's random conversions, those for which the battery has a rule or a stage of its own."""
KILN = """
pidcfg: 1
vendor: click
loops:
  - {name: KILN, bits: C1, integers: DS1, floats: DF1, mode: auto, action: direct, sample_rate: 500 ms, bumpless: 2,
     freeze_bias: true, tuning: {proportional_gain: 2.5, reset_time: 60}, pv: {range: [0, 100], input_range: [0, 100]},
     setpoint: {value: 30, lower_limit: 10, upper_limit: 90}, output: {limits: [5, 95]},
     alarms: {pv: {low_low: 5, low: 12, high: 88, high_high: 92}, hysteresis: 0.5}}
"""


def run(*arguments):
    """A command in this process."""
    return CliRunner().invoke(cli, list(arguments))


@pytest.fixture(scope="module")
def kiln():
    """A CLICK's loop for a NextoPID."""
    source = check_text(KILN)
    assert not source.failed
    return Conversion.of(source, "nextopid", "kiln")


def spoiled(conversion, **keys):
    """The result with other keys in its loop; None removes one."""
    data = {**conversion.outcome.data}
    loop = {**data["loops"][0], **keys}
    data["loops"] = [{key: value for key, value in loop.items() if value is not None}]
    return checked(data)


WIRED = """
pidcfg: 1
vendor: nextopid
plc: {sample_time: 0.5}
signals: {M1: false}
loops:
  - {name: L1, type: PIDA_REAL, SP: 40, Kp: 1, Ti_Ki: 30, Td_Kd: 0, MaxMV: 100, MinMV: 0, MaxPV: 100, MinPV: 0,
     Manual: M1, Direct: false, pv: {unit: degC}}
"""


FLOW = """
pidcfg: 1
vendor: generic
loops:
  - {name: L3, output_raises_pv: true, sample_time: 1, tuning: {gain: 1, integral_time: 20},
     pv: {range: [0, 100], square_root: true}, setpoint: {value: 30, follows_pv: false}, output: {range: [0, 100]}}
"""


@pytest.mark.parametrize("target", ["dl06", "ezlogix"])
def test_set_points_of_a_root_are_those_that_both_sides_hold(target):
    (loop,) = convert(FLOW, target, verify=True).verified
    assert loop.failures == ()
    spoiled = convert(FLOW.replace("gain: 1,", "gain: 1.1,"), target)
    (bad,) = diff(FLOW, spoiled.text, verify=True).verified
    assert not bad.passed


TRACKED = WIRED.replace("Manual: M1", "TRK_VAL: 30, TRK_IN: M1").replace("M1: false", "M1: true")
"""The program holds its output, whatever the operator asks for."""


def test_switches_that_are_wired_are_worked_by_the_battery():
    (loop,) = convert(WIRED, "dpide", verify=True).verified
    assert (loop.passed, loop.untried, len(loop.stages) > 10) == (True, (), True)
    (bad,) = diff(WIRED.replace("Direct: false", "Direct: true"), convert(WIRED, "dpide").text, verify=True).verified
    assert not bad.passed


def test_a_target_whose_switches_are_wired_is_operated_too():
    free = WIRED.replace("Manual: M1", "Manual: false")
    (loop,) = diff(convert(free, "generic").text, WIRED, verify=True).verified
    (same,) = diff(convert(free, "generic").text, free, verify=True).verified
    assert [row.difference.stage for row in loop.failures] == [row.difference.stage for row in same.failures]


def test_a_copy_that_the_target_does_not_have_is_never_made_by_the_twin():
    copied = WIRED.replace("M1: false", "M1: false, M2: false")
    copied += "moves:\n  - {move: L1.PV, to: L1.SP, when: L1.Manual AND NOT M2}\n"
    (loop,) = convert(copied, "dpide", verify=True).verified
    assert loop.passed
    assert "moves.0" in {row.field for row in loop.switched}


def test_stages_whose_mode_the_source_does_not_go_to_are_not_tried():
    (loop,) = diff(TRACKED, TRACKED, verify=True).verified
    assert (loop.passed, loop.stages) == (True, ("start", "manual"))
    assert {row.mode for row in loop.untried} == {"auto"}


def test_two_sides_that_cannot_be_operated_are_not_called_alike_in_every_stage(tmp_path):
    path = tmp_path / "n.yaml"
    path.write_text(TRACKED, encoding="utf-8")
    shown = run("diff", str(path), str(path), "--verify").output
    assert "alike in 2 stages" in shown
    assert "not tried: auto, step 5 %" in shown
    assert "does not go to auto" in shown


def test_a_correct_conversion_passes(kiln):
    assert kiln.unexplained(kiln.result, 0, 0) is None


@pytest.mark.parametrize(
    "keys",
    [
        {"SP": 90},
        {"MaxMV": 60},
        {"MaxPV": 70},
        {"Manual": True, "ManualMV": 0},
        {"MinMV": 40},
        {"Ti_Ki": 72},
        {"Kp": 3.125},
        {"Direct": True},
        {"Td_Kd": 5},
        {"DeadBand": 2},
        {"MaxVarMV": 0.5},
        {"sample_time": 1},
    ],
    ids=lambda keys: next(iter(keys)),
)
def test_a_key_that_was_spoiled_by_hand_is_found(kiln, keys):
    assert kiln.unexplained(spoiled(kiln, **keys), 0, 0) is not None


@pytest.mark.parametrize("number", CAUGHT)
def test_a_correct_conversion_that_once_failed_passes(number):
    one = numbered(number)
    assert one.unexplained(one.result, 0, 0) is None


def test_the_filter_of_a_derivative_has_a_line_and_the_twin_follows_it():
    one = numbered(240)
    (line,) = (row for row in one.outcome.loops[0].changes if row.field == "operation.smoothing")
    assert line.note == "67.1 % instead of 52.6 %; with 0.134 s it would be the same"
    sides = one.sides(one.result)
    assert "operation.smoothing" in {line.neutral for line in sides.lines[0]}
    assert [side.rules[0].operation.smoothing for side in (sides.source_model, sides.target_model)] == [
        Smoothing.BACKWARD,
        Smoothing.EXACT,
    ]


@pytest.mark.parametrize(("key", "value"), [("Tfd", 0.108), ("Td_Kd", 0.84), ("Kp", 0.95)])
def test_the_answer_of_the_loop_alone_tells_its_numbers(key, value):
    one = numbered(240)
    data = {**one.outcome.data, "loops": [{**one.outcome.data["loops"][0], key: value}]}
    sides = one.sides(checked(data))
    reference = make_reference(sides.target_model, 0, sides.target.loop(0))
    tolerance = tolerance_of(sides.target_model, 0, sides.target, 0, reference.bench)
    found = {difference.stage for difference in Battery(reference, sides.target, 0, tolerance).find_differences()}
    assert "answer" in found


def test_a_sample_of_the_measure():
    figures = measure(4, 16, seed=12, per_loop=4, examples=False, say=lambda _: None)
    assert figures.failed == []
    assert figures.spoiled >= 16
    assert figures.found >= 0.9 * figures.spoiled, figures.survivors


def test_the_verdict_names_stage_signal_time_and_key(kiln):
    source, other = (VENDORS["click"], check_text(KILN).config), (VENDORS["nextopid"], spoiled(kiln, MaxMV=60).config)
    found = verify(source, other, [(0, 0)], kiln.outcome.loops)[0]
    assert not found.passed
    failure = next(one for one in found.failures if (one.difference.stage, one.difference.signal) == (HIGH, "output"))
    assert failure.key == "MaxMV"
    assert failure.difference.at >= 0
    assert failure.difference.before > failure.difference.after == pytest.approx(0.6, abs=0.001)


def test_what_a_line_names_is_listed_with_it():
    result = convert(KILN, "nextopid", verify=True)
    assert result.alike
    named = {row.line.field: row.difference for loop in result.verified for row in loop.named}
    assert named["operation.transfer"].stage == "transfers"
    assert "operation.manual" not in named
    data = result.to_json()["verify"][0]
    assert data["passed"] is True
    assert data["differences"] == []
    assert {"stage", "signal", "at", "from", "to", "percent", "line", "note"} == {*data["named"][0]}


def test_two_files_of_one_vendor_are_alike_only_to_the_count():
    source = check_text(KILN)
    vendor = source.vendor
    one = verify((vendor, source.config), (vendor, source.config), [(0, 0)])[0]
    assert one.passed
    edited = check_text(KILN.replace("proportional_gain: 2.5", "proportional_gain: 2.52"))
    two = verify((vendor, source.config), (vendor, edited.config), [(0, 0)])[0]
    assert not two.passed
    assert two.failures[0].key == "tuning.proportional_gain"


def test_the_bench_stays_within_the_range(kiln):
    loop = loops_of(kiln.source.config, kiln.source.vendor)[0]
    bench = bench_of(loop, loop)
    assert bench.low < bench.alarm_free_range[0] < bench.rest_pv < bench.alarm_free_range[1] < bench.high
    assert 0 < abs(bench.gain) <= 3 * bench.span


def wrong_action(monkeypatch):
    """A conversion to NextoPID with the wrong action."""
    from pidcfg.conversion import nextopid

    right = nextopid.from_neutral

    def wrong(*arguments):
        file = right(*arguments)
        for loop in file.data["loops"]:
            loop["Direct"] = not loop["Direct"]
        return file

    monkeypatch.setattr(nextopid, "from_neutral", wrong)


def test_a_conversion_that_behaves_otherwise_is_not_written(tmp_path, monkeypatch):
    (tmp_path / "kiln.yaml").write_text(KILN)
    monkeypatch.chdir(tmp_path)
    wrong_action(monkeypatch)
    arguments = ("convert", "kiln.yaml", "--to", "nextopid", "-o", "out.yaml", "--allow-loss")
    result = run(*arguments, "--verify")
    assert result.exit_code == 1
    assert "KILN: NOT alike" in result.stderr
    assert "see Direct" in result.stderr
    assert result.stderr.count("○ kiln.yaml (click)") > 0, "a picture of what differs"
    assert "the result behaves otherwise than the report says: nothing was written" in result.stderr
    assert not (tmp_path / "out.yaml").exists()
    assert run(*arguments, "--verify=report").exit_code == 0
    assert (tmp_path / "out.yaml").exists()


@pytest.mark.parametrize("option", ["-v", "--report=text"])
def test_the_whole_report_and_the_pictures_are_there_for_who_asks(tmp_path, monkeypatch, option):
    (tmp_path / "kiln.yaml").write_text(KILN)
    monkeypatch.chdir(tmp_path)
    arguments = ("convert", "kiln.yaml", "--to", "nextopid", "-o", "out.yaml", "--allow-loss", "--verify", "--force")
    short, whole = run(*arguments).stderr, run(*arguments, option).stderr
    assert ("○ kiln.yaml" in short, "○ kiln.yaml" in whole) == (False, True)
    assert ("  assumed " in short, "  assumed " in whole) == (False, True)


def test_verify_takes_no_file_for_its_value(tmp_path, monkeypatch):
    (tmp_path / "kiln.yaml").write_text(KILN)
    monkeypatch.chdir(tmp_path)
    result = run("convert", "--to", "nextopid", "-o", "out.yaml", "--allow-loss", "--verify", "kiln.yaml")
    assert result.exit_code == 0, result.stderr


def test_verify_on_a_file_with_errors_says_which(tmp_path, monkeypatch):
    (tmp_path / "kiln.yaml").write_text(KILN.replace("reset_time: 60", "reset_time: -60"))
    monkeypatch.chdir(tmp_path)
    result = run("convert", "kiln.yaml", "--to", "nextopid", "-o", "out.yaml", "--verify")
    assert result.exit_code == 1
    assert "reset_time" in result.stderr
    assert "kiln.yaml:6" in result.stderr


def test_diff_verify_decides_the_exit_code(tmp_path, monkeypatch):
    (tmp_path / "a.yaml").write_text(KILN)
    (tmp_path / "b.yaml").write_text(KILN.replace("name: KILN,", "name: KILN, description: Tunnel,"))
    (tmp_path / "c.yaml").write_text(KILN.replace("reset_time: 60", "reset_time: 75"))
    monkeypatch.chdir(tmp_path)
    assert run("diff", "a.yaml", "b.yaml", "--verify").exit_code == 0
    assert run("diff", "a.yaml", "b.yaml", "--verify", "--exit-code").exit_code == 1
    result = run("diff", "--verify", "a.yaml", "c.yaml")
    assert result.exit_code == 1
    assert "KILN: NOT alike" in result.stdout
    assert "tuning.reset_time" in result.stdout
    assert run("diff", "a.yaml", "c.yaml", "--verify=report").exit_code == 0
    data = json.loads(run("diff", "a.yaml", "c.yaml", "--verify", "--format", "json").stdout)
    assert data["verify"][0]["passed"] is False
    assert data["verify"][0]["differences"][0]["key"] == "tuning.reset_time"


def test_diff_verify_lists_the_changes_that_no_stage_shows():
    pulses = (
        "pidcfg: 1\nvendor: generic\nloops:\n  - {name: T, output_raises_pv: true, sample_time: 1, "
        "tuning: {gain: 1, integral_time: 60}, pv: {range: [0, 100]}, output: {range: [0, 100], pulse: {period: 10}}}\n"
    )
    (loop,) = diff(pulses, pulses.replace("period: 10", "period: 20"), verify=True).verified
    assert (loop.passed, loop.hidden) == (True, ("output.pulse.period",))
    (loop,) = diff(pulses, pulses.replace("name: T,", "name: T, description: Tunnel,"), verify=True).verified
    assert loop.hidden == ()


def test_yaml_of_a_spoiled_result_is_what_is_checked(kiln):
    assert "SP: 90" in yaml_text({"SP": 90})
    assert spoiled(kiln, SP=90).config.loops[0].SP == 90


def test_diff_from_python_asks_the_same():
    assert diff(KILN, KILN).alike, "nothing was asked"
    result = diff(KILN, KILN.replace("reset_time: 60", "reset_time: 75"), verify=True)
    assert not result.alike
    assert [(loop.loop, loop.passed) for loop in result.verified] == [("KILN", False)]


def test_what_cannot_be_run_is_not_alike():
    """Two listings of which nothing says the ranges hold the same words, and nobody knows how they behave."""
    words = "".join(line for line in encode(KILN, "text").text.splitlines(True) if not line.startswith("#"))
    result = diff(words, words, vendor="click", verify=True, names=("monday.txt", "friday.txt"))
    assert result.same
    assert result.verified == ()
    assert not result.alike
    assert any(note.startswith("not compared: ") for note in result.notes)


SLOW = """
pidcfg: 1
vendor: generic
loops:
  - {name: L3, output_raises_pv: true, sample_time: 1, tuning: {gain: 1, integral_time: 200, derivative_time: 40},
     pv: {range: [0, 100]}, setpoint: {value: 30}, output: {range: [0, 100]}}
"""


@pytest.mark.parametrize(("key", "value"), [("integral_time: 200", "integral_time: 240"), ("gain: 1,", "gain: 1.04,")])
def test_a_strong_derivative_hides_no_other_number(key, value):
    result = convert(SLOW, "ezlogix")
    (good,) = diff(SLOW, result.text, verify=True).verified
    (bad,) = diff(SLOW.replace(key, value), result.text, verify=True).verified
    shown = [{row.difference.stage for row in one.failures} for one in (good, bad)]
    assert "slow answer" in shown[1] - shown[0]


PAIR = """
pidcfg: 1
vendor: generic
loops:
  - {name: M, output_raises_pv: true, sample_time: 1, tuning: {gain: 2, integral_time: 30}, pv: {range: [0, 100]},
     setpoint: {value: 30}, output: {range: [0, 100]}}
  - {name: L, output_raises_pv: true, sample_time: 1, mode: cascade, pv: {range: [0, 200], filter: 2},
     tuning: {gain: 2, integral_time: 30, derivative_time: 5, derivative_filter: 1},
     setpoint: {value: 90, source: M, limits: [20, 180]}, deadband: 4, output: {range: [0, 50], manual: 20},
     alarms: {pv: {low: 30, high: 150}, deviation: {high: 20, high_high: 25}, rate_of_change: 8, hysteresis: 3}}
"""
BENCH = Bench(
    low=0.0, high=200.0, sample=1.0, gain=100.0, time_constant=20.0, dead_time=1.0, rest_out=0.5, rest_pv=100.0,
    alarm_free_range=(30.0, 150.0), sp_width=160.0, watch_time=100.0, settling_time=10.0, manual_time=6.0,
    slowest_sample=2.0, limits=(0.1, 0.9),
)  # fmt: skip
BATTERY = {
    "start": "0 to 100; at 80, 40",
    "cascade": "16 to 32; at 100, 50; 0 master 0.5; 8 mode cascade; 10 master 0.5; 20 master 0.54",
    "manual": "5 to 36; at 100, 50; 6 output 0.42; 16 output 0.58",
    "auto": "5 to 56; at 96, 46; 6 mode auto",
    "step 5 %": "18 to 118; at 100, 50; 18 setpoint 108",
    "step 50 %": "18 to 168; at 100, 50; 18 setpoint 140; 68 setpoint 60",
    "high limit": "11 to 151; swept at 100, 0; 11 moved -90; 31 moved 2.5; 91 moved 0",
    "low limit": "11 to 151; swept at 100, 0; 11 moved 90; 31 moved -2.5; 91 moved 0",
    "disturbance": "18 to 118; at 100, 50; 18 load 26",
    "set point limits": "18 to 28; at 100, 50; 18 setpoint 200; 23 setpoint 0",
    "answer": "11 to 51; swept at 100, 0; 11 moved 8; 31 moved 0",
    "slow answer": "11 to 81; swept at 100, 0; 11 load -0.177778; 31 load 0; 51 load 0.182222; 71 load 0",
    "alarms": "11 to 812; swept at 100, 0; 11 load 0.5; 210 load -0.5; 608 load 0.5; 807 load 0",
    "rate of change": "11 to 53.5; swept at 100, 0; 11 load 7.2; 18.5 load -7.2; 26 load 8.8; 33.5 load -8.8; "
    "41 load 0",
    "hysteresis": "11 to 152; swept at 100, 0; 11 moved 44; 13 load 0.18; 80 load -0.18; 147 load 0",
    "dead band": "11 to 151; swept at 100, 0; 11 moved 3.6; 31 moved 0; 51 moved -3.6; 71 moved -4.48; 91 moved 4.48; "
    "111 moved 3.6; 131 moved 0",
    "transfers": "11 to 111; swept at 100, 0; 11 moved -6; 31 mode manual; 35 output 0.42; 51 mode auto; "
    "52 setpoint 100; 71 moved -8.35; 91 moved 0",
    "sensor": "18 to 118; at 100, 50; 18 lost 1; 23 lost 0",
    "set point": "11 to 91; swept at 100, 0; 11 setpoint 104.7; 31 setpoint 100; 51 setpoint 200; 51 moved 75.3; "
    "71 setpoint 0; 71 moved -75.3",
}
"""What the battery does to the loop L on a bench of round numbers: when, PV and load of the plant, and the acts."""


def lower_loop(changes):
    """The loop L, with other text in places."""
    return lower_loop_once(tuple(changes))


@cache
def lower_loop_once(changes):
    """The same, read once."""
    text = PAIR
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    checked_text = check_text(text)
    return loops_of(checked_text.config, checked_text.vendor)[1]


ACT_WORDS = {"pv_offset": "moved", "sensor_lost": "lost", "master_output": "master"}


def told(stage, bench):
    """A stage in words, without what goes before it."""
    bench = bench if stage.output is None else replace(bench, rest_out=stage.output)
    ahead = next((a for a in (go_to_auto(bench), begin_at_rest(bench)) if stage.acts[: len(a)] == a), ())
    parts = [f"{stage.begin:g} to {stage.end:g}; {'swept ' * stage.is_swept}at {stage.pv:g}, {stage.load:g}"]
    for act in stage.acts[len(ahead) :]:
        done = {ACT_WORDS.get(key, key): v for key, v in asdict(act).items() if key != "at" and v is not None}
        parts += [f"{act.at:g} {key} {value if key == 'mode' else f'{value:g}'}" for key, value in done.items()]
    return "; ".join(parts)


def battery(bench=BENCH, changes=(), *, other=None, in_cascade=True):
    """The stages of the loop L by their names."""
    loop = lower_loop(changes)
    stages = stages_of(bench, loop, lower_loop(other) if other else loop, 0.1, in_cascade=in_cascade)
    return {stage.name: stage for stage in stages}


def test_what_each_stage_does():
    stages = battery()
    assert {name: told(stage, BENCH) for name, stage in stages.items()} == BATTERY
    assert {name for name, stage in stages.items() if stage.with_master} == {"start", "cascade"}
    assert {name for name, stage in stages.items() if stage.output != BENCH.rest_out} == {"start", HIGH, "low limit"}
    alone = battery(in_cascade=False)["manual"].acts[-2:]
    assert [(act.at, act.output) for act in alone] == [(26, 0.0), (31, 1.0)]
    assert {name: stage.slack for name, stage in stages.items() if stage.slack} == {"cascade": 2}
    assert {name for name, stage in stages.items() if stage.loses_sensor} == {"sensor"}
    assert {name: stage.signals for name, stage in stages.items() if stage.signals != CLOSED_LOOP} == {
        "start": {"mode"},
        "set point limits": {"setpoint", "mode"},
        "answer": ALL_SIGNALS,
        **{name: ALL_SIGNALS - {"output"} for name in ("alarms", "rate of change", "hysteresis")},
    }
    assert [(act.at, act.mode, act.setpoint, act.output) for act in go_to_auto(BENCH)] == [
        (0, "auto", None, None),
        (0, "manual", None, None),
        (0, None, None, 0.5),
        (1, None, 100, None),
        *((k, None, None, 0.5) for k in range(1, 6)),
        (6, "auto", None, None),
        (7, None, 100, None),
    ]


@pytest.mark.parametrize(
    ("bench", "changes", "differ"),
    [
        (
            {"gain": -100.0},
            (),
            {
                "start": "0 to 100; at 100, 140",
                "auto": "5 to 56; at 104, 154; 6 mode auto",
                "high limit": "11 to 151; swept at 100, 0; 11 moved 90; 31 moved -2.5; 91 moved 0",
                "low limit": "11 to 151; swept at 100, 0; 11 moved -90; 31 moved 2.5; 91 moved 0",
                "disturbance": "18 to 118; at 100, 150; 18 load 174",
                "answer": "11 to 51; swept at 100, 0; 11 moved -8; 31 moved 0",
            },
        ),
        (
            {"rest_out": 0.85},
            (),
            {
                "high limit": "11 to 151; swept at 100, 0; 11 moved -90; 31 moved 2.5; 91 moved 0",
                "disturbance": "18 to 118; at 100, 15; 18 load 39",
                "answer": "11 to 51; swept at 100, 0; 11 moved -8; 31 moved 0",
                "slow answer": "11 to 81; swept at 100, 0; 11 load 0.333333; 31 load 0; 51 load -0.341667; 71 load 0",
            },
        ),
        (
            {"sample": 2.0},
            (),
            {
                "start": "0 to 100; at 80, 40",
                "cascade": "18 to 34; at 100, 50; 0 master 0.5; 10 mode cascade; 12 master 0.5; 22 master 0.54",
                "manual": "4 to 66; at 100, 50; 6 output 0.42; 26 output 0.58",
                "auto": "4 to 56; at 96, 46; 6 mode auto",
                "step 50 %": "20 to 170; at 100, 50; 20 setpoint 140; 70 setpoint 60",
                "set point limits": "20 to 40; at 100, 50; 20 setpoint 200; 30 setpoint 0",
                "answer": "16 to 96; swept at 100, 0; 16 moved 8; 56 moved 0",
                "slow answer": "16 to 116; swept at 100, 0; 16 load -0.137143; 36 load 0; 76 load 0.144; 96 load 0",
                "alarms": "16 to 1618; swept at 100, 0; 16 load 0.25; 414 load -0.25; 1210 load 0.25; 1608 load 0",
                "rate of change": "16 to 63.5; swept at 100, 0; 16 load 7.2; 23.5 load -7.2; 31 load 8.8; "
                "38.5 load -8.8; 46 load 0",
                "hysteresis": "16 to 298; swept at 100, 0; 16 moved 44; 20 load 0.09; 154 load -0.09; 288 load 0",
                "transfers": "16 to 216; swept at 100, 0; 16 moved -6; 56 mode manual; 64 output 0.42; 96 mode auto; "
                "98 setpoint 100; 136 moved -8.35; 176 moved 0",
                "sensor": "20 to 120; at 100, 50; 20 lost 1; 30 lost 0",
            },
        ),
        ({"rest_out": 0.12}, (), {"answer": "11 to 51; swept at 100, 0; 11 moved -8; 31 moved 0"}),
        ({"gain": 600.0}, (), {"disturbance": "18 to 118; at 100, -200; 18 load -300"}),
        ({"alarm_free_range": (85.0, 88.0)}, (), {"start": "0 to 100; at 85, 45"}),
        ({"alarm_free_range": (30.0, 75.0)}, (), {"start": "0 to 100; at 75, 35"}),
        ({}, [("deadband: 4", "deadband: 0")], {"answer": "11 to 51; swept at 100, 0; 11 moved 4.03292; 31 moved 0"}),
        (
            {"rest_out": 0.15},
            [("deadband: 4", "deadband: 0")],
            {"answer": "11 to 51; swept at 100, 0; 11 moved -7.56173; 31 moved 0"},
        ),
        (
            {},
            [("deadband: 4", "deadband: 0"), ("integral_time: 30, d", "integral_time: 100, d"), ("e: 5", "e: 0.1")],
            {"answer": "11 to 111; swept at 100, 0; 11 moved 5.33333; 61 moved 0"},
        ),
        (
            {},
            [("deadband: 4", "deadband: 1"), ("gain: 2, integral_time: 30, d", "gain: 0.1, integral_time: 0, d")],
            {"answer": "11 to 51; swept at 100, 0; 11 moved 40; 31 moved 0"},
        ),
        ({}, [("filter: 2", "filter: 5")], {"answer": "11 to 71; swept at 100, 0; 11 moved 8; 41 moved 0"}),
        ({}, [("filter: 2", "filter: 40")], {"answer": "11 to 491; swept at 100, 0; 11 moved 8; 251 moved 0"}),
        (
            {},
            [("hysteresis: 3", "hysteresis: 2"), ("low: 30, high: 150", "low: 5, high: 197")],
            {"hysteresis": "11 to 124; swept at 100, 0; 11 moved -99; 13 load 0.15; 66 load -0.15; 119 load 0"},
        ),
        (
            {},
            [("low: 30, high: 150", "low: 1, high: 195")],
            {"hysteresis": "11 to 152; swept at 100, 0; 11 moved 14; 13 load 0.18; 80 load -0.18; 147 load 0"},
        ),
        (
            {"rest_pv": 90.0},
            [("high: 20, high_high: 25", "high: 2, high_high: 3")],
            {"alarms": "11 to 2008; swept at 90, 0; 11 load 0.2; 559 load -0.2; 1555 load 0.2; 2003 load 0"},
        ),
        ({}, [("value: 90, ", "")], {"start": "0 to 100; at 90, 50"}),
        ({}, [("mode: cascade", "mode: auto")], {"start": "6 to 100; at 80, 40"}),
        ({}, [("mode: cascade", "mode: manual"), (", manual: 20", "")], {"start": "6 to 100; at 80, 70"}),
        ({"slowest_sample": 1.0}, [("mode: cascade", "mode: auto")], {"start": "3 to 100; at 80, 40"}),
        ({}, [(", manual: 20", ", manual: 48")], {"start": "0 to 100; at 80, -10"}),
        ({}, [("range: [0, 50], manual: 20", "range: [10, 60], manual: 35")], {"start": "0 to 100; at 80, 30"}),
        ({}, [("rate_of_change: 8", "rate_of_change: 2")], {
            "rate of change": "11 to 56; swept at 100, 0; 11 load 1.8; 19 load -1.8; 27 load 2.2; 35 load -2.2; "
            "43 load 0"
        }),
    ],
)  # fmt: skip
def test_what_a_stage_does_on_another_bench(bench, changes, differ):
    bench = replace(BENCH, **bench)
    stages = battery(bench, changes)
    assert {name: told(stages[name], bench) for name in differ} == differ


PLANT = {
    "low": 0, "high": 200, "sample": 1, "gain": 400, "time_constant": 256, "dead_time": 1, "rest_out": 0.5,
    "rest_pv": 90, "alarm_free_range": (30, 150), "sp_width": 160, "watch_time": 160, "settling_time": 80,
    "manual_time": 24, "slowest_sample": 1, "limits": (0, 1), "band_crossing": 2.0, "min_move": 0.0,
}  # fmt: skip
"""The bench of the loop L: it crosses over at 1/16 rad/s, a quarter of 1 in 2 samples and the filter of 2 s."""


@pytest.mark.parametrize(
    ("changes", "other", "slowest", "differ"),
    [
        ((), (), 0.0, {}),
        ((), (), 5.0, {"manual_time": 40, "slowest_sample": 5}),
        ((), [("filter: 2", "filter: 6")], 0.0,
         {"time_constant": 512, "watch_time": 320, "settling_time": 160, "manual_time": 72}),
        ([("e: 5, derivative_filter: 1", "e: 50")], (), 0.0,
         {"time_constant": 2000, "watch_time": 800, "settling_time": 400}),
        ((), [("derivative_filter: 1", "derivative_filter: 3")], 0.0, {"manual_time": 36}),
        (
            [("me: 1, mode", "me: 2, mode")], (), 0.0,
            {"sample": 2, "dead_time": 2, "time_constant": 384, "watch_time": 240, "settling_time": 120,
             "slowest_sample": 2},
        ),
        (
            [("me: 1, mode", "me: 2, mode"), ("gain: 2, integral_time: 30, d", "gain: 0.01, integral_time: 0, d")],
            (),
            0.0,
            {"sample": 2, "dead_time": 2, "slowest_sample": 2, "gain": 600, "time_constant": 20, "rest_out": 0,
             "watch_time": 1600, "settling_time": 800},
        ),
        ([("l_time: 30, d", "l_time: 300, d")], (), 0.0,
         {"time_constant": 1200, "watch_time": 750, "settling_time": 375}),
        ([("l_time: 30, d", "l_time: 100, d")], (), 0.0,
         {"time_constant": 400, "watch_time": 250, "settling_time": 125}),
        ([("l_time: 30, d", "l_time: 30, proportional: false, d")], (), 0.0,
         {"gain": 25, "time_constant": 1, "watch_time": 300, "settling_time": 150}),
        ([("gain: 2, integral_time: 30, d", "gain: 0.01, integral_time: 30, d")], (), 0.0,
         {"gain": 600, "time_constant": 30, "watch_time": 800, "settling_time": 400}),
        ([("limits: [20, 180]", "limits: [60, 120]")], (), 0.0, {"alarm_free_range": (60, 120), "sp_width": 60}),
        ([(", limits: [20, 180]", "")], (), 0.0, {"sp_width": 200}),
        ([("low: 30, high: 150", "low_low: 10, low: 44, high: 160, high_high: 190")], (), 0.0,
         {"alarm_free_range": (44, 160), "rest_pv": 102}),
        ([("pv: {low: 30, high: 150}, ", ""), (", limits: [20, 180]", "")], (), 0.0,
         {"alarm_free_range": (4, 196), "rest_pv": 100, "sp_width": 200}),
        ([("low: 30, high: 150", "high: 15")], (), 0.0, {"alarm_free_range": (20, 180), "rest_pv": 100}),
        ([("manual: 20", "manual: 20, limits: [5, 40]")], (), 0.0, {"rest_out": 0.45, "limits": (0.1, 0.8)}),
        ([("l_time: 30, d", "l_time: 0, d"), ("manual: 20", "bias: 20")], (), 0.0, {"rest_out": 0.4}),
        ([("output_raises_pv: true, sample_time: 1, mode", "output_raises_pv: false, sample_time: 1, mode")], (), 0.0,
         {"gain": -400}),
        ([("filter: 2}", "filter: 0}")], (), 0.0,
         {"time_constant": 200, "watch_time": 125, "settling_time": 63, "manual_time": 12}),
        ([("filter: 2}", "filter: 0}"), ("derivative_filter: 1", "derivative_filter: 0")], (), 0.0,
         {"time_constant": 200, "watch_time": 125, "settling_time": 63, "manual_time": 6}),
    ],
)  # fmt: skip
def test_the_bench_fits_the_loop(changes, other, slowest, differ):
    loop = lower_loop(changes)
    found = asdict(bench_of(loop, lower_loop(other) if other else loop, slowest))
    assert {key: pytest.approx(value) for key, value in (PLANT | differ).items()} == found


def test_what_a_bench_says_of_itself():
    assert (BENCH.span, BENCH.sign, replace(BENCH, gain=-1.0).sign, BENCH.load_for(100.0, 0.25)) == (
        200.0,
        1.0,
        -1.0,
        75.0,
    )


@pytest.mark.parametrize(
    ("value", "wanted"), [(0, 0), (10, 10), (3.4, 3), (3.6, 4), (9.9, 9.9), (-1, -1), (9.2, 9), (11, 11)]
)
def test_set_points_on_the_counts_of_a_root(value, wanted):
    assert nearest_step(value, 0.0, 1.0, 9.5 if value == 9.9 else 10.0) == wanted
    stage = round_setpoints(Stage("x", "x", (Act(1.0, setpoint=value), Act(2.0, load=3.3)), 3.0), 0.0, 1.0, 10.0)
    assert value == 9.9 or [(act.setpoint, act.load) for act in stage.acts] == [(wanted, None), (None, 3.3)]


FEW = Tolerance(
    response_share=0.01,
    closed_loop=CountSizes(2.0, 0.02),
    open_loop=CountSizes(1.0, 0.01),
    setpoint=2.0,
    limit=0.02,
    shifts=SAMPLE_SHIFTS,
)
PLAIN = Stage(
    "x", "x", (Act(10.0, load=1.0), Act(20.0, load=0.0)), end=29.0, begin=10.0, signals=ALL_SIGNALS, output=0.5
)
AS_CONFIGURED = replace(PLAIN, name="start", output=None)
SWEPT = replace(PLAIN, is_swept=True)


def course(*parts, count=30):
    """Thirty samples: a value, and others from a sample on."""
    values = []
    for (first, value), end in zip(parts, [first for first, _ in parts[1:]] + [count], strict=True):
        values += [value] * (end - first)
    return values


def side(**columns):
    """A trial in which nothing happens but this."""
    at_rest = {"pv": 50.0, "setpoint": 50.0, "output": 0.5, "modes": "auto"}
    parts = {name: columns.pop(name, [(0, value)]) for name, value in at_rest.items()}
    alarms = {name: course(*states) for name, states in columns.pop("alarms", {}).items()}
    shown = {name: course(*changes) for name, changes in parts.items()}
    return Trial(**shown, period=columns.get("period", 1.0), has_cascade=columns.get("cascades", True), alarms=alarms)


def apart_at(stage, one, two, **tolerance):
    """The signals that differ, each with the samples from which and up to which."""
    found = find_differences(stage, side(**one), side(**two), BENCH, replace(FEW, **tolerance))
    return {d.signal: (d.samples[0], d.samples[-1]) for d in found}


UP = [(0, 50.0), (15, 90.0)]


@pytest.mark.parametrize(
    ("stage", "one", "two", "tolerance", "wanted"),
    [
        (PLAIN, {}, {}, {}, {}),
        (PLAIN, {}, {"pv": [(0, 50.0), (12, 52.0)]}, {}, {}),
        (PLAIN, {}, {"pv": [(0, 50.0), (12, 52.01)]}, {}, {"pv": (13, 29)}),
        (PLAIN, {}, {"pv": [(0, 99.0), (10, 50.0)]}, {}, {}),
        (PLAIN, {}, {"pv": [(0, 99.0), (12, 50.0)]}, {}, {"pv": (10, 10)}),
        (SWEPT, {}, {"pv": [(0, 50.0), (12, 51.5)]}, {}, {"pv": (13, 29)}),
        (SWEPT, {}, {"pv": [(0, 50.0), (12, 51.0)]}, {"band": 4.0}, {}),
        (PLAIN, {}, {"pv": [(0, 50.0), (12, 53.9)]}, {"band": 4.0}, {}),
        (PLAIN, {}, {"pv": [(0, 50.0), (12, 54.1)]}, {"band": 4.0}, {"pv": (13, 29)}),
        (PLAIN, {"pv": UP}, {"pv": [(0, 50.0), (15, 92.3)]}, {}, {}),
        (PLAIN, {"pv": UP}, {"pv": [(0, 50.0), (15, 92.5)]}, {}, {"pv": (15, 29)}),
        (PLAIN, {"pv": [(0, 0.0), (5, 50.0)]}, {"pv": [(0, 50.0), (12, 52.1)]}, {}, {"pv": (13, 29)}),
        (PLAIN, {"pv": UP}, {"pv": [(0, 50.0), (16, 90.0)]}, {}, {}),
        (PLAIN, {"pv": UP}, {"pv": [(0, 50.0), (14, 90.0)]}, {}, {}),
        (PLAIN, {"pv": UP}, {"pv": [(0, 50.0), (17, 90.0)]}, {}, {"pv": (15, 15)}),
        (AS_CONFIGURED, {"pv": UP}, {"pv": [(0, 50.0), (16, 90.0)]}, {}, {}),
        (AS_CONFIGURED, {"pv": UP}, {"pv": [(0, 50.0), (18, 90.0)]}, {}, {"pv": (16, 16)}),
        (replace(PLAIN, slack=2), {"pv": UP}, {"pv": [(0, 50.0), (18, 90.0)]}, {}, {}),
        (replace(PLAIN, slack=2), {"pv": UP}, {"pv": [(0, 50.0), (22, 90.0)]}, {}, {"pv": (18, 18)}),
        (replace(PLAIN, signals=ALL_SIGNALS - {"pv"}), {}, {"pv": [(0, 99.0)]}, {}, {}),
        (PLAIN, {}, {"output": [(0, 0.5), (12, 0.519)]}, {}, {}),
        (PLAIN, {}, {"output": [(0, 0.5), (12, 0.521)]}, {}, {"output": (13, 29)}),
        (SWEPT, {}, {"output": [(0, 0.5), (12, 0.511)]}, {"switching": 0.1}, {"output": (13, 29)}),
        (PLAIN, {}, {"output": [(0, 0.5), (12, 0.61)]}, {"switching": 0.1}, {}),
        (PLAIN, {}, {"output": [(0, 0.5), (12, 0.63)]}, {"switching": 0.1}, {"output": (13, 29)}),
        (replace(PLAIN, name="dead band 2"), {}, {"output": [(0, 0.5), (12, 0.61)]}, {"switching": 0.1},
         {"output": (13, 29)}),
        (replace(PLAIN, signals=ALL_SIGNALS - {"output"}), {}, {"output": [(0, 0.9)]}, {}, {}),
        (PLAIN, {}, {"setpoint": [(0, 50.0), (12, 52.0)]}, {}, {}),
        (PLAIN, {}, {"setpoint": [(0, 50.0), (12, 52.1)]}, {}, {"setpoint": (14, 29)}),
        (PLAIN, {"setpoint": UP}, {"setpoint": [(0, 50.0), (17, 90.0)]}, {}, {}),
        (PLAIN, {"setpoint": UP}, {"setpoint": [(0, 50.0), (20, 90.0)]}, {}, {"setpoint": (17, 17)}),
        (replace(PLAIN, slack=3), {"setpoint": UP}, {"setpoint": [(0, 50.0), (20, 90.0)]}, {}, {}),
        (replace(PLAIN, signals=ALL_SIGNALS - {"setpoint"}), {}, {"setpoint": [(0, 99.0)]}, {}, {}),
        (PLAIN, {"modes": [(0, "manual")]}, {"setpoint": [(0, 99.0)], "modes": [(0, "manual")]}, {}, {}),
        (PLAIN, {"modes": [(0, "manual")], "pv": [(0, 60.0)]},
         {"setpoint": [(0, 99.0)], "modes": [(0, "manual")], "pv": [(0, 60.0)]}, {}, {"setpoint": (10, 29)}),
        (PLAIN, {"modes": [(0, "auto")]}, {"setpoint": [(0, 99.0)], "modes": [(0, "manual")]}, {},
         {"setpoint": (10, 29), "mode": (10, 29)}),
        (AS_CONFIGURED, {"modes": [(0, "manual")], "pv": [(0, 60.0)]},
         {"setpoint": [(0, 99.0)], "modes": [(0, "manual")], "pv": [(0, 60.0)]}, {}, {}),
        (AS_CONFIGURED, {"pv": [(0, 60.0)]}, {"setpoint": [(0, 99.0)], "pv": [(0, 60.0)]}, {},
         {"setpoint": (10, 29)}),
        (PLAIN, {}, {"modes": [(0, "auto"), (20, "manual"), (22, "auto")]}, {}, {}),
        (PLAIN, {}, {"modes": [(0, "auto"), (20, "manual"), (23, "auto")]}, {}, {"mode": (20, 22)}),
        (replace(PLAIN, slack=1), {}, {"modes": [(0, "auto"), (20, "manual"), (23, "auto")]}, {}, {}),
        (PLAIN, {}, {"modes": [(0, "manual"), (10, "auto")]}, {}, {}),
        (replace(PLAIN, signals=ALL_SIGNALS - {"mode"}), {}, {"modes": [(0, "manual")]}, {}, {}),
        (PLAIN, {"modes": [(0, "cascade")]}, {}, {}, {"mode": (10, 29)}),
        (PLAIN, {"modes": [(0, "cascade")]}, {"cascades": False}, {}, {}),
        (PLAIN, {"cascades": False}, {"modes": [(0, "cascade")]}, {}, {}),
        (PLAIN, {"alarms": {"high": [(0, False), (12, True)]}}, {"alarms": {"high": [(0, False)]}}, {},
         {"high": (12, 29)}),
        (PLAIN, {"alarms": {"high": [(0, True)]}}, {}, {}, {}),
        (replace(PLAIN, signals=ALL_SIGNALS - {"alarms"}), {"alarms": {"high": [(0, True)]}},
         {"alarms": {"high": [(0, False)]}}, {}, {}),
        (AS_CONFIGURED, {"period": 1.0}, {"period": 1.02}, {}, {"sample time": (0, 0)}),
        (AS_CONFIGURED, {"period": 2.0}, {"period": 2.015}, {}, {}),
        (PLAIN, {"period": 1.0}, {"period": 2.0}, {}, {}),
    ],
)  # fmt: skip
def test_where_two_trials_differ(stage, one, two, tolerance, wanted):
    assert apart_at(stage, one, two, **tolerance) == wanted


def test_what_a_difference_says():
    pv, output, setpoint = find_differences(
        PLAIN,
        side(pv=UP),
        side(pv=[(0, 50.0), (15, 93.0), (20, 100.0)], output=[(0, 0.5), (12, 0.6)], setpoint=[(0, 50.0), (25, 60.0)]),
        BENCH,
        FEW,
    )
    assert (pv.stage, pv.signal, pv.at, pv.before, pv.after) == ("x", "pv", 5.0, 90.0, 93.0)
    assert (pv.worst, pv.allowed) == (0.05, pytest.approx(2.4))
    assert (output.worst, output.allowed, output.at) == (pytest.approx(0.1), 0.02, 3.0)
    assert (setpoint.worst, setpoint.allowed, setpoint.at) == (0.05, 2.0, 17.0)


@pytest.mark.parametrize(
    ("one", "two", "held"),
    [
        ([(0, 0.5), (12, 0.9)], [(0, 0.5), (12, 0.85)], range(16, 30)),
        ([(0, 0.5), (12, 0.1)], [(0, 0.5), (12, 0.15)], range(16, 30)),
        ([(0, 0.5), (12, 0.9)], [(0, 0.5), (12, 0.881)], ()),
        ([(0, 0.5), (12, 0.89)], [(0, 0.5), (12, 0.8)], ()),
        ([(0, 0.5), (12, 0.11)], [(0, 0.5), (12, 0.2)], ()),
        ([(0, 0.5), (12, 0.9)], [(0, 0.5), (11, 0.7), (12, 0.6)], ()),
        ([(0, 0.5), (12, 0.1)], [(0, 0.5), (11, 0.3), (12, 0.4)], ()),
        ([(0, 0.5), (12, 0.9), (20, 0.6)], [(0, 0.5), (12, 0.85), (18, 0.7)], (16, 17)),
        ([(0, 0.9)], [(0, 0.85)], range(14, 30)),
    ],
)
def test_two_outputs_that_are_held_by_different_limits(one, two, held):
    found = list(find_differences(PLAIN, side(output=one), side(output=two), BENCH, replace(FEW, response_share=1.0)))
    assert [(d.signal, set(d.at_limits)) for d in found if d.at_limits] == ([("output", set(held))] if held else [])
    assert not any(d.at_limits for d in find_differences(AS_CONFIGURED, side(output=one), side(output=two), BENCH, FEW))


@pytest.mark.parametrize(
    ("pv", "output", "found"),
    [(54.0, 0.55, False), (56.0, 0.55, False), (52.0, 0.55, False), (57.0, 0.55, True), (51.0, 0.55, True),
     (54.0, 0.63, True), (46.0, 0.55, False)],
)  # fmt: skip
def test_a_derivative_may_kick_at_the_edge_of_a_dead_band(pv, output, found):
    """The band is 4, a PV is near its edge within 2; twice the kick of 0.05 is allowed there."""
    shown = apart_at(PLAIN, {"pv": [(0, pv)]}, {"pv": [(0, pv)], "output": [(0, 0.5), (25, output)]},
                     band=4.0, kick=0.05)  # fmt: skip
    assert shown == ({"output": (26, 29)} if found else {})
    assert apart_at(SWEPT, {"pv": [(0, pv)]}, {"pv": [(0, pv)], "output": [(0, 0.5), (25, output)]},
                    band=4.0, kick=0.05)  # fmt: skip


def test_means_of_outputs_tell_what_a_kick_hides():
    """0.2 more in one of two samples: within what one sample may differ by, but 0.1 in the mean."""
    kicked = {"output": [(k, 0.5 + 0.1 * (k % 2)) for k in range(30)]}
    wide = {"open_loop": CountSizes(1.0, 0.2)}
    assert apart_at(SWEPT, {}, kicked, mean=0.04, **wide) == {"output": (10, 29)}
    assert apart_at(SWEPT, {}, kicked, mean=0.06, **wide) == {}
    assert apart_at(SWEPT, {}, kicked, **wide) == {}
    assert apart_at(SWEPT, {}, kicked, mean=0.04, band=1.0, **wide) == {}
    assert apart_at(PLAIN, {}, kicked, mean=0.04, closed_loop=CountSizes(2.0, 0.2)) == {}


AUTO_AT_15 = replace(PLAIN, acts=(Act(5.0, mode="auto"), Act(15.0, mode="auto")))
AUTO_TWICE = replace(PLAIN, acts=(Act(12.0, mode="auto"), Act(20.0, mode="auto")))
MANUAL_AT_15 = replace(PLAIN, acts=(Act(15.0, mode="manual"),))
STEP = replace(PLAIN, name="step 5 %")
BY_HAND = [("mode: cascade", "mode: manual")]
WITHOUT_INTEGRAL = [("gain: 2, integral_time: 30, d", "gain: 2, integral_time: 0, d")]
ON = [(0, False), (16, True), (17, False)]


def alone(*changes):
    """The loop L without its master, as a side that runs."""
    text = PAIR.replace(", source: M", "").replace("mode: cascade", "mode: auto")
    for old, new in changes:
        text = text.replace(old, new)
    found = check_text(text)
    return make_side(found.vendor, found.config)


def test_how_far_two_plcs_may_lie_apart():
    """The filter lets 39.35 % of a count through; share 8 of the span; kick of the derivative 5 / (1 + 1)."""
    one = alone()
    count, output, fine, fine_output = 200 / 4095, 1 / 4095, 200 / 2**20, 1 / 2**20
    pv = count / 0.39346934 + output * 100
    found = tolerance_between(one, 1, one, 1, BENCH)
    wanted = Tolerance(
        response_share=0.01,
        closed_loop=CountSizes(2 * pv, 2 * (output + pv / 200 * 8 * (1 + 2.5))),
        open_loop=CountSizes(2 * fine / 0.39346934, 2 * (fine_output + fine / 200 * 8 * (1 / 0.39346934 + 2.5))),
        setpoint=2 * count,
        limit=2 * output + 2e-3,
        band=4.0,
        switching=8 * 4 / 200,
        kick=8 * 4 / 200 * 5,
        shifts=SAMPLE_SHIFTS,
        mean=fine_output + fine / 200 * 8 * (1 + 1 / 0.39346934 + 2.5 / 60),
    )
    for one_part, other in zip(asdict(found).values(), asdict(wanted).values(), strict=True):
        assert one_part == other or one_part == pytest.approx(other, rel=1e-6)
    plain = alone(("filter: 2}", "filter: 0}"), ("e_time: 5", "e_time: 0"), ("deadband: 4", "deadband: 0"))
    found = tolerance_between(plain, 1, alone(("derivative_filter: 1", "derivative_filter: 0")), 1, BENCH)
    assert (found.closed_loop.pv, found.open_loop.pv) == (
        pytest.approx(2 * (count + output * 100)),
        pytest.approx(2 * fine),
    )
    assert (found.mean, found.band, found.switching, found.kick) == (0.0, 4.0, pytest.approx(0.16), 0.0)
    sharp = tolerance_between(one, 1, alone(("derivative_filter: 1", "derivative_filter: 0")), 1, BENCH)
    assert sharp.closed_loop.output == pytest.approx(2 * (output + pv / 200 * 8 * (1 + 5)), rel=1e-6)


def test_a_module_has_twelve_bits_at_least_and_a_root_steps_of_counts():
    fine, coarse = new_plc(alone(), (1,)), check_text(KILN)
    assert finest_counts(fine, 1) == (200 / 2**20, 1 / 2**20)
    assert analog_counts(fine, 1) == (200 / 4095, 1 / 4095)
    assert [(c.halt, s.due == NEVER) for c, s in zip(fine.configs, fine.states, strict=True)] == [(1, True), (0, False)]
    assert root_step(make_side(coarse.vendor, coarse.config), 0) == 0.0
    flow = convert(FLOW, "dl06")
    rooted = check_text(flow.text)
    assert root_step(make_side(rooted.vendor, rooted.config), 0) == pytest.approx(100 / 4095**0.5)


def verdict_on(stages, ones, twos, refused=()):
    """The verdict on trials that are given, by the names of their stages."""
    by_name = {stage.name: (one, two) for stage, one, two in zip(stages, ones, twos, strict=True)}
    possible = tuple(stage for stage in stages if stage.name not in refused)
    reference = SimpleNamespace(
        stages=stages, possible_stages=possible, bench=BENCH, refused_mode=lambda s: "" if s in possible else "auto"
    )
    original = SimpleNamespace(run_trial=lambda stage: by_name[stage.name][0])
    battery_of = SimpleNamespace(run_trial=lambda stage: by_name[stage.name][1])
    sides = SimpleNamespace(source=SimpleNamespace(loop=lambda _: lower_loop(())), names=("one", "two"))
    return verdict_of(sides, 1, reference, original, battery_of, ["failure"], ["named"])


def test_the_figures_and_the_picture_of_a_verdict():
    stages = (AS_CONFIGURED, replace(PLAIN, name="step 5 %"), replace(PLAIN, name="disturbance", begin=20.0))
    one, two = side(setpoint=[(0, 52.0)]), side(pv=[(0, 51.0)], output=[(0, 0.5), (25, 0.45)])
    far = side(pv=[(0, 99.0)])
    found = verdict_on(stages, [far, one, one], [far, two, two])
    assert (found.loop, found.pv_percent, found.output_percent) == ("L", 0.5, pytest.approx(5.0))
    assert (found.iae_ratio, found.failures, found.named, found.untried) == (0.5, ("failure",), ("named",), ())
    assert found.stages == ("start", "step 5 %", "disturbance")
    chart = found.chart
    assert (chart.title, chart.loop, chart.sides) == ("L", "L", ("one", "two"))
    assert [(mark.label, mark.time) for mark in chart.marks] == [("step of the set point", 0.0), ("disturbance", 20.0)]
    setpoint, before, after = chart.panels[0].lines
    assert (list(setpoint.times), [setpoint.name, before.name]) == (list(range(30)), ["SP", "PV"])
    assert (setpoint.values, before.values, after.values) == ([52.0] * 30, [50.0] * 30, [51.0] * 30)
    assert (before.side, after.side, before.role, setpoint.role) == ("before", "after", "pv", "setpoint")
    assert [line.values[-1] for line in chart.panels[1].lines] == [50.0, 45.0]
    assert [(line.name, line.role) for line in chart.panels[1].lines] == [("OUT", "output")] * 2
    assert (chart.panels[0].title, chart.panels[1].title, chart.panels[1].unit) == ("PV, SP", "OUT", "%")


def test_a_verdict_without_the_stages_of_its_picture_shows_the_first_one():
    stages = (AS_CONFIGURED, replace(PLAIN, name="disturbance"))
    at_rest_there = side(pv=[(0, 60.0)], setpoint=[(0, 60.0)])
    trials = [at_rest_there, side(pv=[(0, 99.0)])]
    found = verdict_on(stages, trials, trials, refused={"disturbance"})
    assert (found.iae_ratio, found.pv_percent, found.stages) == (None, 0.0, ("start",))
    assert [(row.stage, row.mode) for row in found.untried] == [("disturbance", "auto")]
    assert [mark.time for mark in found.chart.marks] == [0.0, 0.0]
    assert len(found.chart.panels[0].lines[0].times) == 20


RAMP = {"pv": [(0, 50.0), (8, 50.2)]}
"""A PV that moves by 0.2 with the sample at 16 s: 0.1 a second."""


def test_where_two_trials_differ_with_a_sample_of_half_a_second():
    stage = replace(PLAIN, begin=5.0, acts=(Act(8.0, load=1.0),))
    one, two = side(pv=[(0, 50.0), (16, 90.0)]), side(pv=[(0, 99.0), (10, 50.0), (17, 90.0), (20, 95.0)])
    (found,) = find_differences(stage, one, two, replace(BENCH, sample=0.5), FEW)
    assert (found.samples[0], found.at) == (19, 4.5)
    late = side(pv=[(0, 50.0), (15, 90.0)])
    assert list(find_differences(stage, one, late, replace(BENCH, sample=0.5), FEW)) == []


def test_a_stage_as_one_side_goes_through_it():
    """Dead time 1 s, time constant 20 s; the PV is shown as the loop's own filter of 2 s gives it."""
    one, stages = alone(), battery()
    manual = run_stage(one, 1, stages["manual"], BENCH, before_root=False)
    assert (len(manual.pv), manual.period, manual.has_cascade, {*manual.modes}) == (37, 1.0, False, {"manual"})
    ends = course((0, 0.5), (6, 0.42), (16, 0.58), count=37)
    assert manual.output == [pytest.approx(share) for share in ends]
    assert manual.setpoint == course((0, 90.0), (1, 100.0), count=37)
    assert (manual.pv[7], manual.pv[17] < 97.3, manual.pv[26] > manual.pv[17]) == (pytest.approx(100.0), True, True)
    sensor = run_stage(one, 1, stages["sensor"], BENCH, before_root=False)
    assert (len(sensor.pv), sensor.modes[5:7]) == (119, ["manual", "auto"])
    assert [round(sensor.pv[k] / sensor.pv[k - 1], 4) for k in (19, 23)] == [0.6065, 0.6065]
    assert [k for k, on in enumerate(sensor.alarms["low"]) if on] == [21, 22, 23]
    answer = run_stage(one, 1, stages["answer"], BENCH, before_root=False)
    assert (len(answer.pv), round(answer.pv[31], 2), round(answer.pv[51], 2)) == (52, 108.0, 100.0)
    rooted = run_stage(alone(("filter: 2}", "filter: 0}")), 1, stages["answer"], BENCH, before_root=True)
    assert rooted.pv[20] == pytest.approx(108.0**2 / 200, rel=1e-3)


def test_set_points_of_a_battery_are_those_that_a_coarse_register_holds():
    one = alone()
    reference = make_reference(one, 1, one.loop(1), 3.0)
    points = {act.setpoint for stage in reference.stages for act in stage.acts if act.setpoint is not None}
    assert reference.bench.rest_pv == 90
    assert {point for point in points if point % 3} == {200}
    assert make_reference(one, 1, one.loop(1)).bench.rest_pv == 90
