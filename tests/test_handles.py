"""`pidcfg.gains` and `pidcfg.change`: what registers hold, how robust it is, and other values in a file."""

from __future__ import annotations

from decimal import Decimal
from pathlib import Path

import pytest

import pidcfg

EXAMPLES = Path(__file__).parents[1] / "examples"
SCENARIOS = sorted(EXAMPLES.glob("*/*.scenario.yaml"))
HELD = {
    # file and loop            a wish for each number              what the register holds of it
    ("dl06/flow", "FIC-301"): ((0.614, 3.04, 0.004), ("0.61", "3", "0")),
    ("dl06/reactor", "LIC-103"): ((500, 2.06, 0.006), ("99.99", "2.1", "0.01")),
    ("click/brewery", "KETTLE"): ((0.1, 7000, 0.3), ("0.1", "6000", "0.3")),
    ("ezlogix/coldstore", "STORE"): ((12.006, 0.02, 3.17), ("12.01", "0", "3.2")),
    ("nextopid/ratio", "FIC_AIR"): ((0.1, 1.23456789, 0), ("0.1", "1.2345679", "0")),
    ("dpide/chiller", "TIC-21"): ((1e-3, 0.1, 5), ("0.001", "0.1", "5")),
    ("generic/boiler", "FIC-1"): ((0.1, 6.123456789, 0), ("0.1", "6.123456789", "0")),
}


def numbers(source, loop):
    """The three numbers of a loop."""
    return next(one for one in pidcfg.gains(source).loops if one.loop == loop).numbers


@pytest.mark.parametrize(("name", "loop"), HELD)
def test_a_number_is_what_the_register_holds_of_it(name, loop):
    wishes, held = HELD[name, loop]
    found = numbers(EXAMPLES / f"{name}.yaml", loop)
    assert [one.part for one in found] == ["gain", "integral", "derivative"]
    for one, wish, text in zip(found, wishes, held, strict=True):
        assert float(one.hold(wish)) == pytest.approx(float(text), rel=1e-8), one.key
        assert one.hold(float(one.hold(wish))) == one.hold(wish)


@pytest.mark.parametrize("path", SCENARIOS, ids=lambda path: path.stem.removesuffix(".scenario"))
def test_what_is_written_is_what_is_held_and_nothing_else_changes(path):
    config = path.parent / pidcfg.load(path).model.config
    text = config.read_text("utf-8")
    for loop in pidcfg.gains(config).loops:
        held = {one.path: one.hold(float(one.value) * 1.37 + 0.2) for one in loop.numbers}
        texts = {one.path: one.written(held[one.path]) for one in loop.numbers}
        if loop.loop.startswith("TIC-Z"):  # these share their numbers
            with pytest.raises(ValueError, match="shares what stands there"):
                pidcfg.change(config, texts)
            continue
        changed = pidcfg.change(config, texts)
        after = numbers(changed.document, loop.loop)
        assert [one.value for one in after] == [pytest.approx(held[one.path]) for one in loop.numbers]
        back = {one.path: one.text for one in loop.numbers if one.text is not None}
        if len(back) == len(texts):
            assert pidcfg.change(changed.document, back).text == text
        others = [one.numbers for one in pidcfg.gains(changed.document).loops if one.loop != loop.loop]
        assert [[one.value for one in row] for row in others] == [
            [one.value for one in row.numbers] for row in pidcfg.gains(config).loops if row.loop != loop.loop
        ]


def test_times_keep_the_unit_that_stands_there():
    found = {one.part: one for one in numbers(EXAMPLES / "dpide" / "dyeing.yaml", "VAT")}
    assert (found["integral"].text, found["integral"].value) == ("12 min", Decimal(720))
    assert found["integral"].written(Decimal(660)) == "11 min"
    assert numbers(EXAMPLES / "ezlogix" / "coldstore.yaml", "STORE")[2].written(Decimal(0)) == "off"


def test_a_loop_that_switches_has_no_numbers():
    fan = next(one for one in pidcfg.gains(EXAMPLES / "nextopid" / "furnace.yaml").loops if one.loop == "FAN")
    assert fan.numbers == ()


PLANT = "pidcfg: 1\nscenario: one plant\nconfig: loop.yaml\nduration: 1 h\nplants:\n  A: {plant}\n"
LOOP = """\
pidcfg: 1
vendor: generic
loops:
  - name: A
    sample_time: 1
    output_raises_pv: true
    tuning: {gain: GAIN, integral_time: TIME, derivative_time: off}
    pv: {range: [0, 100]}
    setpoint: {value: 50}
    output: {range: [0, 100]}
"""


@pytest.mark.parametrize(
    ("plant", "process"),
    [
        ("{model: first_order, gain: 2, time_constant: 100, dead_time: 10}", {"gain": 2, "time_constant": 100}),
        ("{model: integrator, gain: 0.02, dead_time: 10}", {"gain": 0.02, "model": "integrating"}),
    ],
)
def test_ms_is_that_of_the_rule_that_made_the_gains(plant, process):
    tuned = pidcfg.tune("simc", "PI", dead_time=10, sample_time=1, **process)
    gains = tuned.gains
    text = LOOP.replace("GAIN", f"{gains.gain:.12g}").replace("TIME", f"{gains.integral_time:.12g}")
    files = {"loop.yaml": text}
    (loop,) = pidcfg.gains(PLANT.replace("{plant}", plant), files=files).loops
    assert loop.margins.ms == pytest.approx(tuned.judgement.margins.ms, rel=1e-6)
    assert loop.to_json()["margins"]["ms"] == loop.margins.ms


@pytest.mark.parametrize(
    ("plant", "why"),
    [
        ("{model: first_order, gain: 2, time_constant: 100, input: A.OUT * 2}", "its plant reads A.OUT * 2"),
        ("{model: second_order, gain: 2, time_constant: 9, damping: 0.3}", "model second_order"),
        ("{model: first_order, gain: 2, time_constant: 100, dead_time: 900}", "unstable"),
    ],
)
def test_why_there_is_no_ms(plant, why):
    files = {"loop.yaml": LOOP.replace("GAIN", "20").replace("TIME", "20")}
    (loop,) = pidcfg.gains(PLANT.replace("{plant}", plant), files=files).loops
    assert loop.margins is None
    assert why in loop.why


def test_a_key_that_is_missing_comes_behind_the_last_one_beside_it():
    text = "a: {b: 1}  # one\nc:\n  d: 2\n  e: 3\nf: 4\n"
    assert pidcfg.change(text, {"a.x": 7, "c.d": "2.5", "c.y": 0.125}).text == (
        "a: {b: 1, x: 7}  # one\nc:\n  d: 2.5\n  e: 3\n  y: 0.125\nf: 4\n"
    )
    assert pidcfg.change(text, {}).text == text


@pytest.mark.parametrize(
    ("source", "values", "message"),
    [
        ("a: [", {"a": 1}, "`source`: <text> cannot be read"),
        ("a: 1\n", {"b.c": 1}, "`values`: <text> has no b.c"),
        ("a: 1\n", {3: 1}, "`values`: 3 is no path; write it like loops.0.name"),
        ("a: 1\n", {"a": float("nan")}, "`values`: a is nan; write a text or a number"),
        ("a: 1\n", {"a": True}, "`values`: a is True"),
        ("a: &x {b: 1}\nc: *x\n", {"a.b": 2}, "`values`: the file shares what stands there"),
        ("a: 1\n", {"a": "1, b: 2\nc: 3"}, "`values`: the file shares"),
    ],
)
def test_what_cannot_be_changed_is_a_value_error(source, values, message):
    with pytest.raises(ValueError, match=r".") as error:
        pidcfg.change(source, values)
    assert str(error.value).startswith(message)


def test_a_run_over_another_one():
    path = EXAMPLES / "dl06" / "flow.scenario.yaml"
    before = pidcfg.simulate(path, record=True)
    files = {"flow.yaml": (path.parent / "flow.yaml").read_text("utf-8").replace("gain: 0.60", "gain: 0.30")}
    after = pidcfg.simulate(path.read_text("utf-8"), name="flow.scenario.yaml", files=files, record=True)
    html = after.html(before, names=("old <b>", "new"))
    assert html.count("<figure") == 1
    for line in ("line pv before", "line pv after", "line output before", "line output after"):
        assert f'"{line}"' in html
    assert "line setpoint before" not in html  # it went the same way
    assert "before: <bdi>old &lt;b&gt;</bdi>" in html
    assert 'class="line pv only"' in after.html()
    assert after.html(loops=("none",)) == ""
    assert pidcfg.simulate(path).html() == ""
