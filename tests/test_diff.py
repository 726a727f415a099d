"""`pidcfg diff`: key by key within a vendor, by meaning between two, ranked by risk, and against memory."""

from __future__ import annotations

import json
from decimal import Decimal
from pathlib import Path
from types import SimpleNamespace

import click
import pytest

import pidcfg as pidcfg_package
from command import run_text
from pidcfg.api import check_file, check_text
from pidcfg.cli.commands import diff
from pidcfg.conversion import ConvertError
from pidcfg.conversion.comparison import scale_width
from pidcfg.conversion.differences import RISKS, judge_difference, judge_key

EXAMPLES = Path(__file__).parents[1] / "examples"
TANK = (EXAMPLES / "click/tank.yaml").read_text("utf-8")
REACTOR = (EXAMPLES / "dl06/reactor.yaml").read_text("utf-8")


def loop_of(result):
    """The first loop of a comparison."""
    return next(loop for loop in result.loops if loop.loop)


def differences(before, after):
    """Fields that differ in the first loop, with their risks and notes."""
    return {d.field: (d.risk, d.note) for d in loop_of(pidcfg_package.diff(before, after)).differences}


def pidcfg(*args, cwd=EXAMPLES):
    return run_text("diff", *map(str, args), cwd=cwd, NO_COLOR="1")


def edited(text, old, new):
    """A text with one place changed, which must be there."""
    assert text.count(old) >= 1, old
    return text.replace(old, new, 1)


@pytest.mark.parametrize(
    ("old", "new", "field", "risk"),
    [
        ("action: direct", "action: reverse", "output_raises_pv", "critical"),
        (
            "setpoint: {value: 20.0, limits: [0, 45]}",
            "setpoint: {value: 20.0, limits: [0, 48]}",
            "setpoint.limits.1",
            "high",
        ),
        (
            "setpoint: {value: 20.0, limits: [0, 45]}",
            "setpoint: {value: 20.0, limits: [0, 40]}",
            "setpoint.limits.1",
            "medium",
        ),
        ("gain: 0.80", "gain: 0.40", "tuning.gain", "medium"),
        ("description: Jacket flow, inner loop", "description: Steam", "description", "cosmetic"),
        ("high_high: 45", "high_high: 46", "alarms.pv.high_high", "high"),
        ("high_high: 45", "high_high: 44", "alarms.pv.high_high", "low"),
    ],
)
def test_each_difference_has_the_rank_of_what_it_can_do(old, new, field, risk):
    found = differences(REACTOR, edited(REACTOR, old, new))
    assert found[field][0] == risk
    assert set(found) == {field}


def test_another_form_of_the_same_numbers_ranks_high():
    chiller = (EXAMPLES / "dpide" / "chiller.yaml").read_text("utf-8")
    found = differences(chiller, edited(chiller, "PID_EQ: false", "PID_EQ: true"))
    assert found["PID_EQ"][0] == "high"
    reset = differences(REACTOR, edited(REACTOR, "reset_unit: seconds", "reset_unit: minutes"))
    assert reset["tuning.reset_unit"][0] == "high"


def test_a_spelling_is_no_difference_and_neither_is_what_no_register_can_hold():
    assert differences(REACTOR, edited(REACTOR, "sample_rate: 0.2", "sample_rate: 200 ms")) == {}
    assert differences(REACTOR, edited(REACTOR, "setpoint: {value: 20.0", "setpoint: {value: 20.001")) == {}


def test_a_listing_without_names_is_compared_by_what_the_other_side_says(tmp_path):
    shown = pidcfg("dl06/reactor.yaml", "dl06/golden/reactor.hex", "--exit-code")
    assert shown.returncode == 0, shown.stdout + shown.stderr
    assert "the same: FIC-102, TIC-101, LIC-103" in shown.stdout
    (tmp_path / "b.yaml").write_text(edited(REACTOR, "gain: 0.80", "gain: 0.40"), "utf-8")
    shown = pidcfg(tmp_path / "b.yaml", "dl06/golden/reactor.hex", "--exit-code")
    assert shown.returncode == 1
    assert "medium    tuning.gain" in shown.stdout


def test_across_vendors_and_in_every_format(tmp_path):
    from pidcfg.conversion.pipeline import convert
    from pidcfg.text.writer import yaml_text
    from pidcfg.vendors import VENDORS

    source = check_file(EXAMPLES / "click/tank.yaml")
    other = tmp_path / "tank.yaml"
    text = yaml_text(convert(source.config, source.vendor, VENDORS["dl06"], {}).data)
    other.write_text(text, "utf-8")
    before = EXAMPLES / "click/tank.yaml"
    same = json.loads(pidcfg(before, other, "--format", "json").stdout)
    assert not {d["risk"] for loop in same["loops"] for d in loop["differences"]} & {"critical"}
    other.write_text(edited(text, "action: direct", "action: reverse"), "utf-8")
    found = json.loads(pidcfg(before, other, "--format", "json").stdout)
    assert found["loops"][0]["differences"][0]["field"] == "output_raises_pv"
    assert found["loops"][0]["differences"][0]["key"] is None
    assert found["summary"]["critical"] == 1
    markdown = pidcfg(before, other, "--format", "markdown").stdout
    assert "| **critical** | output_raises_pv | true → false |" in markdown
    assert "critical  output_raises_pv: true → false" in pidcfg(before, other).stdout


def test_loops_that_come_and_go_are_told():
    less = REACTOR[: REACTOR.index("  - name: LIC-103")]
    for pair, status in (((REACTOR, less), "removed"), ((less, REACTOR), "added")):
        result = pidcfg_package.diff(*pair)
        assert [(c.loop, c.status) for c in result.loops][2] == ("LIC-103", status)
        assert [(d.key, d.address) for d in result.loops[-1].differences] == [("plc.number_of_loops", "V7641")]


@pytest.mark.parametrize(
    ("args", "code", "message"),
    [
        (("dl06/reactor.yaml", "nothing.yaml"), 2, "nothing.yaml"),
        (("dl06/golden/reactor.hex", "dl06/golden/reactor.csv"), 2, "name it with --vendor"),
        (("click/golden/tank.txt", "dl06/golden/reactor.txt"), 2, "name it with --vendor"),
        (("dl06/reactor.scenario.yaml", "dl06/reactor.yaml"), 2, "is a scenario"),
    ],
)
def test_what_cannot_be_compared_is_said(args, code, message):
    shown = pidcfg(*args)
    assert shown.returncode == code
    assert message in shown.stderr


@pytest.mark.parametrize(("name", "beside"), [("reactor.txt", "reactor.csv"), ("reactor.json", "reactor.hex")])
def test_a_listing_that_says_its_plc_needs_no_vendor(name, beside):
    shown = pidcfg(f"dl06/golden/{name}", f"dl06/golden/{beside}")
    assert (shown.returncode, shown.stdout.rpartition("\n\n")[2].strip()) == (0, "the same: FIC-102, TIC-101, LIC-103")


@pytest.mark.parametrize(
    ("name", "text", "code"),
    [
        ("missing", None, "PID040"),
        ("missing.yaml", None, "PID040"),
        ("notes.txt", "no listing\n", "PID041"),
        ("empty.yaml", "", "PID005"),
    ],
)
def test_json_is_a_document_also_when_a_side_cannot_be_used(tmp_path, name, text, code):
    if text is not None:
        (tmp_path / name).write_text(text, "utf-8")
    shown = pidcfg(str(EXAMPLES / "dl06/reactor.yaml"), name, "--format", "json", cwd=tmp_path)
    assert shown.returncode == 2
    (found,) = json.loads(shown.stdout)["findings"]
    assert (found["code"], found["file"], found["line"]) == (code, name, 1)
    assert "Error: " in shown.stderr


def test_json_says_what_a_comparison_lacks(monkeypatch, capsys):
    lacking = SimpleNamespace(message="it has no range", path=("loops", 0, "pv"))

    def refuse(*_):
        raise ConvertError([lacking])

    monkeypatch.setattr("pidcfg.output.differences.neutral_side", refuse)
    result = pidcfg_package.diff(REACTOR, TANK, names=("a.yaml", "b.yaml"))
    with pytest.raises(click.ClickException, match=r"a\.yaml does not say what its values mean"):
        diff.refuse_result(result, "json")
    (found,) = json.loads(capsys.readouterr().out)["findings"]
    assert (found["code"], found["message"], found["path"]) == ("PID042", "it has no range", "loops[0].pv")


@pytest.mark.parametrize("turned", [False, True])
def test_a_scale_without_a_range_cannot_be_compared_with_another_vendors(turned):
    sides = [edited(REACTOR, 'pv: {range: [0, 100], unit: "%"}', "pv: {}"), TANK]
    result = pidcfg_package.diff(*(sides[::-1] if turned else sides))
    (found,) = result.findings
    assert (found.code, found.path, found.message) == (
        "PID042",
        ("loops", 2, "pv", "range"),
        "add pv.range: the engineering values at 0 % and 100 %; the gain depends on its span",
    )
    assert not result.loops


FURNACE = (EXAMPLES / "nextopid/furnace.yaml").read_text("utf-8")
NETWORK = (EXAMPLES / "nextopid/cascade.yaml").read_text("utf-8")

MORE = "  - {name: MORE, type: ControlLowFilter, InVar: Sensor, Tc: 9}"


def compared(before, after):
    """Everything that is not the same: status, or fields with their risks and both values."""
    return {
        c.loop: [(d.key or d.field, d.risk, d.before, d.after) for d in c.differences] or c.status
        for c in pidcfg_package.diff(before, after).loops
        if c.status != "same"
    }


@pytest.mark.parametrize("listing", ["furnace.txt", "furnace.st"])
def test_a_loop_without_a_neutral_form_is_no_obstacle(listing):
    shown = pidcfg("nextopid/furnace.yaml", f"nextopid/golden/{listing}", "--exit-code")
    assert shown.returncode == 0, shown.stdout + shown.stderr
    assert "the same: TIC_1, FAN" in shown.stdout


@pytest.mark.parametrize(
    ("text", "old", "new", "found"),
    [
        (FURNACE, "DeadBand: 2.0", "DeadBand: 3.0", {"FAN": [("DeadBand", "medium", 2, 3)]}),
        (FURNACE, "Direct: true", "Direct: false", {"FAN": [("Direct", "critical", True, False)]}),
        (FURNACE, "pv: {unit: degC}", "pv: {unit: K}", {"FAN": [("pv.unit", "cosmetic", "degC", "K")]}),
        (FURNACE, "Sensor: 0.0", "Sensor: 1.0", {"signals": [("Sensor", "medium", 0, 1)]}),
        (FURNACE, "InVar: Sensor", "InVar: Sensor * 2", {"FILTER": [("InVar", "medium", "Sensor", "Sensor * 2")]}),
        (FURNACE, "Tc: 2.0", "Tc: 4.0", {"FILTER": [("Tc", "medium", 2, 4)]}),
        (FURNACE, "Kp: 4.0", "Kp: 8.0", {"TIC_1": [("Kp", "medium", 4, 8)]}),
        (
            FURNACE,
            "PV: FILTER.OutVar",
            "PV: Sensor",
            {"TIC_1": [("PV", "medium", "FILTER.OutVar", "Sensor")]},
        ),
        (FURNACE, "  - {name: FILTER,", f"{MORE}\n  - {{name: FILTER,", {"MORE": "added"}),
        (FURNACE.replace("  - {name: FILTER,", f"{MORE}\n  - {{name: FILTER,"), MORE, "", {"MORE": "removed"}),
        (
            NETWORK,
            "    Windup_H_IN: TIC_2.Windup_H_OUT",
            "    Windup_H_IN: TIC_2.Windup_L_OUT",
            {"TIC_1": [("Windup_H_IN", "medium", "TIC_2.Windup_H_OUT", "TIC_2.Windup_L_OUT")]},
        ),
        (NETWORK, "TRK_VAL: FIC_3.PV", "TRK_VAL: FIC_3.SP", {"TIC_2": [("TRK_VAL", "medium", "FIC_3.PV", "FIC_3.SP")]}),
        (NETWORK, "CASC: Cascade_3", "CASC: Cascade_2", {"FIC_3": [("CASC", "high", "Cascade_3", "Cascade_2")]}),
    ],
)
def test_what_no_neutral_field_says_is_compared_in_the_vendor_s_own_words(text, old, new, found):
    assert compared(text, edited(text, old, new)) == found


def test_two_selectors_of_one_name_differ_by_their_type():
    text = (EXAMPLES / "nextopid/override.yaml").read_text("utf-8")
    kind = "ControlSelectMin" if "ControlSelectMin" in text else "ControlSelectMax"
    other = {"ControlSelectMin": "ControlSelectMax", "ControlSelectMax": "ControlSelectMin"}[kind]
    (changed,) = compared(text, edited(text, f"type: {kind}", f"type: {other}")).values()
    assert changed == [("type", "medium", kind, other)]


@pytest.mark.parametrize("example", ["dpide/oven", "dpide/chiller", "generic/boiler", "nextopid/heatexchanger"])
def test_named_parameters_are_the_same_as_themselves(example):
    text = (EXAMPLES / f"{example}.yaml").read_text("utf-8")
    assert compared(text, text) == {}


def test_a_loop_that_lost_its_neutral_form_differs_in_the_parameter_that_did_it():
    found = compared(NETWORK, edited(NETWORK, "    MinPV: 0.0", "    MinPV: FIC_3.MV - 5"))
    assert found == {"TIC_1": [("MinPV", "high", 0, "FIC_3.MV - 5")]}


def test_a_loop_without_a_neutral_form_is_no_pid_of_another_vendor():
    name = check_text(TANK).config.loops[0].name
    before = edited(FURNACE, "name: FAN", f"name: {name.replace('-', '_')}")
    found = compared(before, TANK)
    assert found[name] == [("type", "high", "no PID", "PID")]
    assert compared(TANK, before)[name.replace("-", "_")] == [("type", "high", "PID", "no PID")]


def test_loops_that_come_and_go_between_vendors_are_told():
    names = {REACTOR: ["FIC-102", "TIC-101", "LIC-103"], TANK: ["TANK1"]}
    for before, after in ((TANK, REACTOR), (REACTOR, TANK)):
        told = [(row.loop, row.status) for row in pidcfg_package.diff(before, after).loops]
        assert told == [(n, "removed") for n in names[before]] + [(n, "added") for n in names[after]]


def test_the_risks_are_in_order():
    assert RISKS == ("critical", "high", "medium", "low", "cosmetic")


OVEN = (EXAMPLES / "ezlogix/oven.yaml").read_text("utf-8")


@pytest.mark.parametrize(
    ("old", "new", "field", "risk"),
    [("tag: IR1", "tag: IR7", "pv.tag", "high"), ("registers: R101", "registers: R201", "registers", "low")],
)
def test_what_no_neutral_field_says_is_a_difference_too(old, new, field, risk):
    found = differences(OVEN, edited(OVEN, old, new))
    assert {key: value[0] for key, value in found.items()} == {field: risk}


def test_a_scale_of_the_output_that_a_vendor_does_not_know_is_no_difference():
    text = (EXAMPLES / "dpide/oven.yaml").read_text("utf-8").replace("PID_DE: true", "PID_DE: false")
    source = check_text(text)
    from pidcfg.conversion.pipeline import convert
    from pidcfg.text.writer import yaml_text
    from pidcfg.vendors import VENDORS

    copy = yaml_text(convert(source.config, source.vendor, VENDORS["click"], {}).data)
    found = differences(text, copy)
    assert not {field for field, (risk, _) in found.items() if risk in {"critical", "high"}}
    assert "tuning.gain" not in found
    doubled = differences(text, edited(copy, "proportional_gain: 1,", "proportional_gain: 3,"))
    assert doubled["tuning.gain"][0] == "high"


def test_two_ways_to_say_an_integral_controller_are_the_same():
    from pidcfg.conversion.builder import flatten, without_unused_terms
    from pidcfg.schemas.generic import GenericFile

    loops = [
        {
            "name": "L",
            "output_raises_pv": True,
            "sample_time": 1,
            "pv": {"range": [0, 1]},
            "output": {"range": [0, 1]},
            "tuning": {"gain": gain, "integral_time": time, "derivative_on": on, "proportional": False},
        }
        for gain, time, on in ((1, 20, "pv"), (0.04, 0.8, "error"))
    ]
    file = GenericFile.model_validate({"pidcfg": 1, "vendor": "generic", "loops": loops})
    one, two = (without_unused_terms(flatten(loop)) for loop in file.loops)
    assert one == two


@pytest.mark.parametrize(
    ("before", "after", "cosmetic"),
    [("2", "2.002", True), ("2", "1.998", True), ("2", "2.0021", False), ("2", "-2", False), ("-2", "-2.002", True)],
)
def test_a_thousandth_is_the_registers_rounding_on_either_side(before, after, cosmetic):
    found = judge_difference("tuning.gain", Decimal(before), Decimal(after))
    assert (found.risk == "cosmetic", found.note == "the registers' rounding") == (cosmetic, cosmetic)


@pytest.mark.parametrize(
    ("before", "after", "risk", "percent"),
    [
        ("10", "20", "medium", 100),
        ("10", "20.1", "high", 101),
        ("10", "5", "medium", -50),
        ("10", "4.9", "high", -51),
        ("10", "0", "high", -100),
        ("10", "-10", "high", -200),
        ("-10", "-20", "medium", 100),
        ("-10", "-4.9", "high", -51),
        ("0", "10", "medium", None),
        ("0.1", "0.15", "medium", 50),
    ],
)
def test_a_gain_of_more_than_twice_or_less_than_half_is_another_controller(before, after, risk, percent):
    for field, wanted in (("tuning.gain", risk), ("tuning.integral_time", "medium")):
        found = judge_difference(field, Decimal(before), Decimal(after))
        number, _, unit = found.note.partition(" ")
        assert (found.risk, float(number) if unit else None) == (wanted, percent)


UPPER = [f"alarms.{key}" for key in ("pv.high", "pv.high_high", "deviation.high", "deviation.high_high")]
ENDS = [f"{section}.limits.{end}" for section in ("setpoint", "output") for end in (0, 1)]


@pytest.mark.parametrize("field", ["alarms.pv.low_low", "alarms.pv.low", *UPPER, "alarms.rate_of_change", *ENDS])
@pytest.mark.parametrize("is_up", [True, False])
def test_an_alarm_that_comes_later_and_a_limit_that_is_wider_can_do_harm(field, is_up):
    is_limit, is_low = field in ENDS, field.endswith((".0", ".low", ".low_low"))
    outward = ("high", "the limit is wider" if is_limit else "the alarm comes later")
    inward = ("medium", "the limit is narrower") if is_limit else ("low", "the alarm comes earlier")
    for one in (Decimal(10), Decimal(-10)):
        found = judge_difference(field, one, one + (1 if is_up else -1))
        assert (found.risk, found.note) == (outward if is_up != is_low else inward)
    if not is_limit:
        gone, new = (judge_difference(field, *pair) for pair in ((Decimal(1), None), (None, Decimal(1))))
        assert [(d.risk, d.note) for d in (gone, new)] == [("high", "the alarm is gone"), ("low", "a new alarm")]


@pytest.mark.parametrize(
    ("gain", "note"),
    [("1", "-50 %"), ("3", "+50 %"), ("2.5", "+25 %"), ("2.01", "+0.5 %"), ("90", "+4400 %"), ("4e9", "+2e+11 %")],
)
def test_a_change_in_percent_reads_alike_within_a_vendor_and_across(gain, note):
    numbers = Decimal(2), Decimal(gain)
    assert judge_difference("tuning.gain", *numbers).note == note
    assert judge_key("tuning.gain", ["tuning.gain"], *numbers)[2] == note


P_SWITCHED = ("tuning.proportional", "high", "the proportional action is switched")
GAIN_AND_P = ["tuning.gain", "tuning.proportional"]


@pytest.mark.parametrize(
    ("key", "fields", "values", "told"),
    [
        ("tuning.gain", GAIN_AND_P, (2, 0), ("tuning.gain", "high", "-100 %")),
        ("tuning.gain", GAIN_AND_P, (0, 2), P_SWITCHED),
        ("tuning.gain", GAIN_AND_P, (2, 3), ("tuning.gain", "medium", "+50 %")),
        ("tuning.gain", GAIN_AND_P, (2, 5), ("tuning.gain", "high", "+150 %")),
        ("algorithm", ["anti_windup"], ("position", "velocity"), (
            "anti_windup", "high", "the integral behaves otherwise at the limits",
        )),
        ("PID_MODE", ["anti_windup"], (1, 2), ("PID_MODE", "medium", "+100 %")),
        ("freeze", ["anti_windup"], (True, False), (
            "anti_windup", "high", "the integral behaves otherwise at the limits",
        )),
    ],
)  # fmt: skip
def test_a_number_is_a_switch_where_it_is_switched_on_or_off_and_a_word_always(key, fields, values, told):
    assert judge_key(key, fields, *values) == told


NEUTRAL = """\
pidcfg: 1
vendor: generic
loops:
  - name: A
    mode: auto
    output_raises_pv: true
    sample_time: 1 s
    tuning: {{gain: 2, integral_time: 2 min}}
    pv: {{range: {range}}}
    setpoint: {{value: {value}}}
    output: {{range: [0, 100]}}
"""


@pytest.mark.parametrize(
    ("range_of_pv", "value", "risk"),
    [
        ("[1000, 1010]", "1005.4", "medium"),
        ("[1000, 1010]", "1005.375", "cosmetic"),
        ("[0, 1010]", "1005.4", "cosmetic"),
    ],
)
def test_rounding_is_small_beside_the_scale_too(range_of_pv, value, risk):
    text, other = (NEUTRAL.format(range=range_of_pv, value=number) for number in ("1005.37", value))
    other_text = pidcfg_package.convert(other, "ezlogix").text
    (found,) = [d for d in loop_of(pidcfg_package.diff(text, other_text)).differences if d.field == "setpoint.value"]
    assert found.risk == risk


@pytest.mark.parametrize(
    "field", ["setpoint.value", "setpoint.limits.1", "alarms.pv.high", "output.limits.0", "output.bias"]
)
def test_each_point_of_a_scale_is_held_to_the_width_of_its_own(field):
    loop = {"pv.range.0": Decimal(1000), "pv.range.1": Decimal(1010)}
    loop |= {"output.range.0": Decimal(0), "output.range.1": Decimal(400)}
    assert scale_width(field, loop) == (400 if field.startswith("output") else 10)
    assert scale_width("alarms.hysteresis", loop) is None
    assert scale_width(field, {}) is None
