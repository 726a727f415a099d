"""The battery of --verify: correct conversions pass, spoiled ones fail, and the verdict says where and why."""

from __future__ import annotations

import json

import pytest
from click.testing import CliRunner

from pidcfg import check_text, convert, diff, encode
from pidcfg.cli.main import cli
from pidcfg.vendors import VENDORS
from pidcfg.verification.battery import Battery, reference_of, side_of, tolerance_of
from pidcfg.verification.bench import bench_of
from pidcfg.verification.verify import verify
from pidcfg.writer import yaml_text
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
    assert "moves.0" in {row.line.field for row in loop.named if row.line is not None}


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
    assert "operation.smoothing" in {line.neutral for line in one.twin.followed[0]}
    assert one.side.loop(0).tuning.derivative_filter < one.result.config.loops[0].Tfd


@pytest.mark.parametrize(("key", "value"), [("Tfd", 0.108), ("Td_Kd", 0.84), ("Kp", 0.95)])
def test_the_answer_of_the_loop_alone_tells_its_numbers(key, value):
    one = numbered(240)
    data = {**one.outcome.data, "loops": [{**one.outcome.data["loops"][0], key: value}]}
    side = side_of(one.result.vendor, checked(data).config)
    reference = reference_of(one.side, 0, side.loop(0))
    tolerance = tolerance_of(one.side, 0, side, 0, reference.bench)
    found = {difference.stage for difference in Battery(reference, side, 0, tolerance).differences()}
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
    assert failure.difference.at > 0
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
    bench = bench_of(kiln.side.loop(0), kiln.side.loop(0))
    assert bench.low < bench.quiet[0] < bench.start < bench.quiet[1] < bench.high
    assert 0 < abs(bench.gain) <= 3 * bench.span


def wrong_action(monkeypatch):
    """A conversion to NextoPID with the wrong action."""
    from pidcfg.conversion.from_neutral import nextopid

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
    assert "the result behaves otherwise than the report says: nothing was written" in result.stderr
    assert not (tmp_path / "out.yaml").exists()
    assert run(*arguments, "--verify=report").exit_code == 0
    assert (tmp_path / "out.yaml").exists()


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
