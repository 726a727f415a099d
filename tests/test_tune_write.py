"""`tune --write`: gains into a loop of a configuration, in its own terms, and not another byte."""

from __future__ import annotations

import io
import json
import math
import random
import re
import subprocess
from decimal import Decimal
from importlib import resources

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import pidcfg
from command import run_text
from pidcfg.cli.formats.tuning import tuning_text
from pidcfg.output.arguments import ArgumentError
from pidcfg.text.reader import DEFAULT
from pidcfg.tuning.identify import identify_record
from pidcfg.vendors import VENDORS
from record_rig import remembering
from scenario_rig import rows

KEYS = {
    "dl06": ("gain", "reset", "rate"),
    "click": ("proportional_gain", "reset_time", "derivative_gain"),
    "ezlogix": ("proportional_gain", "integral_time", "derivative_time"),
    "nextopid": ("Kp", "Ti_Ki", "Td_Kd"),
    "dpide": ("Kc_Kp", "Ti_Ki", "Td_Kd"),
    "generic": ("gain", "integral_time", "derivative_time"),
}
OPTIONAL = {"dl06": (1, 2), "click": (2,), "ezlogix": (1, 2), "nextopid": (), "dpide": (), "generic": (1, 2)}
"""Which of the three a file may leave out."""
OFF = {
    "dl06": ("off", "0"),
    "click": ("6000", "0"),
    "ezlogix": ("off", "off"),
    "nextopid": ("0", "0"),
    "dpide": ("0", "0"),
    "generic": ("off", "off"),
}
STEPS = {"dl06": (0.01, 0.1, 0.01), "ezlogix": (0.01, 0.1, 0.1)}
"""The last digits of the registers; the others hold floating point numbers."""


def starter(vendor):
    """The file that `pidcfg init` writes, with one loop; action for a PV that rises with the output."""
    text = (resources.files("pidcfg") / VENDORS[vendor].starter).read_text("utf-8")
    return "".join(line for line in text.splitlines(keepends=True) if not line.lstrip().startswith("#"))


def render(vendor, texts, style="block", added=()):
    """The starter with other texts of the three numbers; None: the key is missing; ``added``: lines without comment."""
    keys, text = KEYS[vendor], starter(vendor)
    rows = {key: re.search(rf"(?m)^( +){key}: ([^#\n]*?)( +#.*)?\n", text) for key in keys}
    if style == "block":
        for i, key in enumerate(keys):
            row = rows[key]
            comment = row[3] or ""
            new = "" if texts[i] is None else f"{row[1]}{key}: {texts[i]}{'' if i in added else comment}\n"
            text = text.replace(row[0], new)
        return _moved(text, [keys[i] for i in added], keys)
    quote = '"' if style == "json" else ""
    for key in keys[1:]:
        text = text.replace(rows[key][0], "")
    pairs = [f"{quote}{key}{quote}: {value}" for key, value in zip(keys, texts, strict=True) if value is not None]
    if vendor in {"nextopid", "dpide"}:
        raise AssertionError("these have no section")
    head = re.search(rf"(?m)^( +)tuning:\n +{keys[0]}: .*\n((?: {{6}}\w+: .*\n)*)", text)
    rest = [re.sub(r" *#.*", "", line).strip() for line in head[2].splitlines()]
    pairs += [f"{quote}{line.partition(':')[0]}{quote}:{line.partition(':')[2]}" for line in rest]
    return text.replace(head[0], f"{head[1]}tuning: {{{', '.join(pairs)}}}   # by hand\n")


def _moved(text, added, keys):
    """A line that is added stands below that of the key before it, or of the one before that."""
    lines = text.split("\n")
    for key in added:
        (line,) = [row for row in lines if re.match(rf" +{key}: ", row)]
        lines.remove(line)
        above = [
            i for before in keys[: keys.index(key)] for i, row in enumerate(lines) if re.match(rf" +{before}: ", row)
        ]
        lines.insert(above[-1] + 1, line)
    return "\n".join(lines)


numbers = st.floats(0.02, 60)
times = st.one_of(st.just(math.inf), st.floats(0.5, 900))
rates = st.one_of(st.just(0.0), st.floats(0.2, 90))


@st.composite
def files(draw):
    """A vendor, the style and the old texts of a file, and the gains of a rule."""
    vendor = draw(st.sampled_from(sorted(KEYS)))
    style = "block" if vendor in {"nextopid", "dpide"} else draw(st.sampled_from(["block", "flow", "json"]))
    old = [draw(st.sampled_from(["1.5", "2", "+3.25", "12.50"]))]
    with_unit = [] if vendor in {"nextopid", "dpide"} else ["2.5 min", "45 s", "30000 ms"]
    for i, off in enumerate(OFF[vendor]):
        choices = ["12.5", "7", *with_unit, off, *([None] if i + 1 in OPTIONAL[vendor] else [])]
        if i == 1:
            choices = [text for text in choices if text != "2.5 min"]  # a rate that no register holds
        old.append(draw(st.sampled_from(choices)))
    gains = (draw(numbers), draw(times), draw(rates))
    ends = draw(st.sampled_from(["\n", "\r\n"]))
    return vendor, style, old, gains, ends, draw(st.booleans()), draw(st.booleans())


def process_for(gains):
    """A rule and a process that lead to a P, PI or PID controller; the gains are set afterwards."""
    form = "PID" if gains[2] else "PI" if math.isfinite(gains[1]) else "P"
    return {"method": "zn-closed", "form": form, "gain": 1, "ultimate_gain": 1, "ultimate_period": 1}


def written(data, gains, **more):
    """The result of `tune` with these gains in place of a rule's."""
    from pidcfg.output import gains as results
    from pidcfg.output import retune
    from pidcfg.tuning.rules import Gains

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(results, "_gains_of_form", lambda *_: ("PID", Gains(*gains)))
        patch.setattr(retune, "forecast_words", lambda *_: retune.Forecast("nobody asks for it"))
        return pidcfg.tune(**process_for(gains), into=data, into_name="f.yaml", **more).written


@settings(max_examples=100, deadline=None)
@given(files())
def test_only_the_three_places_change_and_they_hold_the_gains(case):
    vendor, style, old, gains, ends, mark, closed = case
    before = render(vendor, old, style).replace("\n", ends)
    before = before if closed else before.rstrip("\r\n")
    data = (b"\xef\xbb\xbf" if mark else b"") + before.encode()
    try:
        result = written(data, gains)
    except ValueError as error:
        assume("nothing was written" not in str(error))
        raise
    texts = [value.new for value in result.values]
    added = [i for i, value in enumerate(result.values) if value.old is None and value.new is not None]
    after = render(vendor, texts, style, added).replace("\n", ends)
    after = after if closed else after.rstrip("\r\n")
    assert result.data == (b"\xef\xbb\xbf" if mark else b"") + after.encode()
    holds(vendor, result.data, gains)


def holds(vendor, data, gains):
    """By another way back: the neutral loop of the new file has the gains, within the last digit of the registers."""
    loaded = pidcfg.load(data)
    assert loaded.ok, loaded.findings
    neutral = VENDORS[vendor].load("to_neutral")(loaded.model)[0].data
    tuning = neutral["tuning"]
    steps = STEPS.get(vendor, (0, 0, 0))
    spans = {"dl06": 4, "ezlogix": 4}.get(vendor, 1)  # a PV of 0 to 400 on an output of 0 to 100
    wanted = (gains[0], 0 if math.isinf(gains[1]) else gains[1], gains[2])
    found = (tuning["gain"], tuning.get("integral_time", 0), tuning.get("derivative_time", 0))
    for i, (a, b) in enumerate(zip(found, wanted, strict=True)):
        step = steps[i] / (spans if i == 0 else 1)
        short = 1 if re.search(rb"\d ?(min|ms)\b", data) else 0.5  # few digits of another unit make the same word
        assert float(a) == pytest.approx(b, rel=2e-7, abs=step * short * 1.0001), (i, found, wanted)


def test_every_vendor_gets_its_own_word_for_off():
    for vendor, (integral, derivative) in OFF.items():
        texts = ["1.5", "12.5", "3"]
        result = written(render(vendor, texts).encode(), (2.0, math.inf, 0.0))
        assert [value.new for value in result.values][1:] == [integral, derivative]


@pytest.mark.parametrize(("vendor", "switch"), [("nextopid", "Indep: false"), ("dpide", "PID_EQ: true")])
def test_independent_gains_are_ki_and_kd(vendor, switch):
    key, state = switch.split(": ")
    text = render(vendor, ["1", "2", "3"]).replace(switch, f"{key}: {'true' if state == 'false' else 'false'}")
    result = written(text.encode(), (4.0, 8.0, 0.5))
    assert [value.new for value in result.values] == ["4", "0.5", "2"]
    assert [value.unit for value in result.values][1] == "1/s"
    holds(vendor, result.data, (4.0, 8.0, 0.5))


@pytest.mark.parametrize("block", ["PIDA_REAL", "PIDA_INT", "PIDA_TUNE_REAL", "PIDA_TUNE_INT"])
def test_every_pid_block_of_a_nextopid_takes_gains(block):
    text = render("nextopid", ["1", "2", "3"]).replace("type: PIDA_REAL", f"type: {block}")
    assert f"type: {block}" in text
    assert [value.new for value in written(text.encode(), (4.0, 8.0, 0.5)).values] == ["4", "8", "0.5"]


@pytest.mark.parametrize(
    ("unit", "old", "new"),
    [
        ("seconds", "120.0", "900"),
        ("seconds", "2 min", "15 min"),
        ("seconds", '"2 min"', '"15 min"'),
        ("minutes", "2.5", "15"),
        ("minutes", "150 s", "900 s"),
        ("minutes", "2.5 min", "15 min"),
    ],
)
def test_the_reset_of_a_dl06_is_in_its_own_unit(unit, old, new):
    text = (
        starter("dl06").replace("reset_unit: seconds ", f"reset_unit: {unit} ").replace("reset: 120.0", f"reset: {old}")
    )
    result = written(text.encode(), (1.0, 900.0, 0.0))
    assert result.data.decode() == text.replace(f"reset: {old}", f"reset: {new}").replace("gain: 2.00", "gain: 4")
    holds("dl06", result.data, (1.0, 900.0, 0.0))


def test_the_decimals_of_a_dl06_reset_count():
    text = starter("dl06").replace("  loop_table: V2000", "  reset_decimals: 2\n  loop_table: V2000")
    result = written(text.encode(), (1.0, 12.345, 0.0))
    assert result.values[1].new == "12.34"
    says = (
        r"tuning\.reset: 120 is outside the word's range; with `reset_unit: minutes` it is 2 min; nothing was written"
    )
    with pytest.raises(ValueError, match=says):
        written(text.encode(), (1.0, 120.0, 0.0))


@pytest.mark.parametrize(
    ("unit", "seconds", "says"),
    [
        ("seconds", 9000.0, "9000 is outside the word's range; with `reset_unit: minutes` it is 150 min; nothing"),
        (
            "minutes",
            2.0,
            "0.033333 rounds to 0.0, which switches it off; with `reset_unit: seconds` it is 2 s; nothing",
        ),
        ("minutes", 60000.0, "1000 is outside the word's range; nothing"),
    ],
)
def test_the_unit_that_holds_the_reset_of_a_dl06_is_named(unit, seconds, says):
    text = starter("dl06").replace("reset_unit: seconds ", f"reset_unit: {unit} ")
    with pytest.raises(ValueError, match=re.escape(says)):
        written(text.encode(), (1.0, seconds, 0.0))


@pytest.mark.parametrize(
    ("old", "seconds", "new"),
    [
        ("6.0 min", 63.7, "1.062 min"),
        ("6.0 min", 60.0, "1 min"),
        ("6min", 63.6, "1.06min"),
        ("360 s", 63.7, "63.7 s"),
        ("0.1 h", 63.7, "0.0177 h"),
        ("360", 63.7, "63.7"),
    ],
)
def test_the_unit_in_which_the_file_states_a_time_stays(old, seconds, new):
    data = render("dl06", ("1", old, "0")).encode()
    found = written(data, (1.0, seconds, 0.0))
    assert found.values[1].new == new
    holds("dl06", found.data, (1.0, seconds, 0.0))


def test_9999_stays_where_the_integral_is_off():
    text = starter("dl06").replace("reset: 120.0", "reset: off 9999")
    assert b"reset: off 9999 " in written(text.encode(), (1.0, math.inf, 0.0)).data


def test_a_loop_that_has_the_gains_stays_as_it_is_written():
    text = starter("dl06")
    result = written(text.encode(), (0.5, 120.0, 0.0))  # 2.00 as a share of the spans
    assert result.data == text.encode()
    assert not any(value.is_changed for value in result.values)


def test_counts_below_the_whole_scale_of_an_ezlogix_count():
    """The PV's range on 820 to 4095 counts is less than what one count of gain is of."""
    text = starter("ezlogix").replace("unit: degC", "counts: [820, 4095]\n      unit: degC", 1)
    result = written(text.encode(), (1.0, 100.0, 0.0))
    assert result.values[0].new == "5"  # 400 degC on 3275 counts are 500.2 degC on 4095
    loaded = VENDORS["ezlogix"].load("to_neutral")(pidcfg.load(result.data).model)[0].data
    assert float(loaded["tuning"]["gain"]) == pytest.approx(1, abs=0.002)


# --- what is refused --------------------------------------------------------------------------------------------------


LIVELY = (1.0, 100.0, 0.0)


@pytest.mark.parametrize(
    ("vendor", "change", "gains", "says"),
    [
        ("dl06", ("direct  ", "reverse "), LIVELY, "needs action direct, and the loop has the other one"),
        ("ezlogix", ("action: reverse", "action: direct "), LIVELY, "needs action reverse"),
        ("dpide", ("PID_DIR: true", "PID_DIR: false"), LIVELY, "needs action PID_DIR TRUE"),
        ("nextopid", ("Direct: false", "Direct: true"), LIVELY, "needs action Direct FALSE"),
        (
            "generic",
            ("output_raises_pv: true", "output_raises_pv: false"),
            LIVELY,
            "needs action output_raises_pv: true",
        ),
        ("click", ("action: direct", "action: reverse"), LIVELY, "needs action direct"),
        ("dl06", ("", ""), (0.0001, 100, 0), "tuning.gain: 0.0004 rounds to 0"),
        ("dl06", ("", ""), (30, 100, 0), "tuning.gain: 120 is outside"),
        ("dl06", ("", ""), (1, 5000, 0), "tuning.reset: 5000 is outside"),
        ("dl06", ("", ""), (1, 100, 0.001), "tuning.rate: 0.001 rounds to 0"),
        ("click", ("", ""), (1, 7000, 0), "tuning.reset_time: 7000 is outside 0.01 to 6000"),
        ("ezlogix", ("", ""), (1, 100, 700), "tuning.derivative_time: 700 is outside 0 to 600"),
        ("nextopid", ("", ""), (1e-60, 100, 0), "Kp: 0 rounds to 0"),
        ("dl06", ("    pv:\n", "    error: {curve: squared}\n    pv:\n"), LIVELY, "it squares its error"),
        ("click", ("    pv:\n", "    error: {curve: squared}\n    pv:\n"), LIVELY, "it squares its error"),
        (
            "dl06",
            ("    pv:\n", "    derivative_gain_limit_enabled: true\n    pv:\n"),
            (1, 9, 2),
            "removes the derivative",
        ),
        ("click", ("    pv:\n", "    derivative_gain_limit: 0\n    pv:\n"), (1, 9, 2), "removes the derivative"),
        ("nextopid", ("DerivEr: false", "DisableP: true "), LIVELY, "without its proportional term"),
        ("generic", ("proportional: true", "proportional: false"), LIVELY, "without its proportional term"),
        ("nextopid", ("Kp: 0.8", "Kp: FT_101"), LIVELY, "Kp is the expression FT_101"),
        ("nextopid", ("Indep: false", "Indep: Manual_1"), LIVELY, "Indep is wired"),
        ("dl06", ("      range: [0, 400]", "      square_root: false"), LIVELY, "has no pv.range"),
        ("dl06", ("gain: 2.00", "gain: two"), LIVELY, "'two' is not a number (PID022); correct the file first"),
    ],
)
def test_what_would_not_act_as_the_rule_means_is_refused(vendor, change, gains, says):
    text = starter(vendor)
    assert change[0] in text
    with pytest.raises(ValueError, match=r"(?s).*") as error:
        written(text.replace(*change, 1).encode(), gains)
    assert says in str(error.value)


def test_an_action_that_nobody_can_compare_is_said():
    text = starter("dl06").encode()
    result = pidcfg.tune("zn-closed", ultimate_gain=2, ultimate_period=60, into=text).written
    assert (result.action, result.to_json()["action_compared"]) == (None, False)
    result = pidcfg.tune("zn-closed", ultimate_gain=2, ultimate_period=60, gain=3, into=text).written
    assert result.action == "direct"


def test_a_missing_range_may_be_given_and_another_one_may_not():
    text = starter("dl06").replace("      range: [0, 400]", "      square_root: false").encode()
    given_range = written(text, LIVELY, pv_range=(0, 400))
    assert given_range.values[0].new == "4"
    with pytest.raises(ValueError, match=r"`pv_range` is 300 wide, and that of f\.yaml: TIC-101 400"):
        written(starter("dl06").encode(), LIVELY, pv_range=(0, 300))
    with pytest.raises(ValueError, match="`output_range` is 50 wide"):
        written(starter("dl06").encode(), LIVELY, output_range=(0, 50))
    assert written(starter("click").encode(), LIVELY, output_range=(0, 50)).values[0].new == "2.0"
    assert written(starter("click").encode(), LIVELY, output_range=(0, 25)).values[0].new == "4"


LOOPS = """\
pidcfg: 1
vendor: generic
loops:
  - {name: A, mode: auto, output_raises_pv: true, sample_time: 1 s, pv: {range: [0, 100]}, output: {range: [0, 100]},
     anti_windup: true, setpoint: {value: 5}, tuning: &slow {gain: &g 2, integral_time: 100}}
  - {name: B, mode: auto, output_raises_pv: true, sample_time: 1 s, pv: {range: [0, 100]}, output: {range: [0, 100]},
     anti_windup: true, setpoint: {value: 5}, tuning: *slow}
  - {name: C, mode: auto, output_raises_pv: true, sample_time: 1 s, pv: {range: [0, 100]}, output: {range: [0, 100]},
     anti_windup: true, setpoint: {value: 5}, tuning: {gain: *g, integral_time: &t 50}}
"""


def test_what_an_anchor_shares_is_changed_at_one_place_or_not_at_all():
    for loop in ("A", "B"):
        with pytest.raises(ValueError, match=rf"{loop}: the file shares what stands there .* an anchor .* by hand"):
            written(LOOPS.encode(), LIVELY, loop=loop)
    section = LOOPS.replace("&g ", "").replace("*g", "2")  # only the whole section is shared
    for loop in ("A", "B"):
        with pytest.raises(ValueError, match="by a template or an anchor"):
            written(section.encode(), LIVELY, loop=loop)
    alone = written(LOOPS.encode(), (3.0, 70.0, 0.0), loop="C").data.decode()
    assert alone == LOOPS.replace("gain: *g, integral_time: &t 50", "gain: 3, integral_time: &t 70")


def test_what_a_template_shares_is_not_changed_for_one_loop():
    head = LOOPS.partition("loops:\n")[0]
    body = "".join(f"  - {{name: {name}, use: oven}}\n" for name in "AB")
    keys = "mode: auto, output_raises_pv: true, sample_time: 1 s, pv: {range: [0, 100]}, output: {range: [0, 100]}"
    rest = "anti_windup: true, setpoint: {value: 5}, tuning: {gain: 2, integral_time: 100}"
    text = f"{head}templates:\n  oven: {{{keys}, {rest}}}\nloops:\n{body}"
    with pytest.raises(ValueError, match=r"B: .* by a template or .* by hand, there or in the loop itself"):
        written(text.encode(), (3.0, 70.0, 0.0), loop="B")
    own = text.replace("B, use: oven", "B, use: oven, tuning: {gain: 2, integral_time: 90}")
    alone = written(own.encode(), (3.0, 70.0, 0.0), loop="B").data.decode()
    assert alone == own.replace("{gain: 2, integral_time: 90}", "{gain: 3, integral_time: 70}")


def test_loops_that_are_not_there_are_listed():
    with pytest.raises(ValueError, match=r"`loop` 'c': f\.yaml has A, B, C$"):
        written(LOOPS.encode(), LIVELY, loop="c")
    with pytest.raises(ValueError, match=r"several loops, say which with `loop`: A, B, C"):
        written(LOOPS.encode(), LIVELY)
    with pytest.raises(ValueError, match="`loop` is for `into`"):
        pidcfg.tune("zn-closed", ultimate_gain=2, ultimate_period=3, loop="A")
    with pytest.raises(ValueError, match=r"`vendor` is click, and f\.yaml is for generic"):
        written(LOOPS.encode(), LIVELY, loop="A", vendor="click")


def test_findings_are_of_the_loop_and_what_is_new():
    """A second loop's own warnings are not told; an ignored finding stays ignored."""
    text = LOOPS.replace("integral_time: &t 50}", "integral_time: &t 50, derivative_time: 0}")
    result = written(text.encode(), (3.0, 70.0, 2.0), loop="C")
    assert [(d.code, d.loop) for d in result.findings] == [("GN822", "C")]
    assert result.ok


# --- the command ------------------------------------------------------------------------------------------------------


RULE = ["--method", "simc", "--gain", "1.3", "--time-constant", "200", "--dead-time", "20"]


def run(*args, cwd):
    return run_text("tune", *args, cwd=cwd)


@pytest.fixture
def oven(tmp_path):
    path = tmp_path / "oven.yaml"
    path.write_bytes(starter("dl06").encode())
    return path


def test_the_command_writes_and_tells_old_and_new(oven):
    before = oven.read_text("utf-8")
    result = run(*RULE, "--write", "oven.yaml", "--loop", "TIC-101", cwd=oven.parent)
    assert result.returncode == 0, result.stderr
    assert "oven.yaml, TIC-101: written\n  tuning.gain: 2.00 → 14.65\n  tuning.reset: 120.0 → 168\n" in result.stdout
    assert "tuning.gain: 14.65 %/%  (-0.0137 % of 14.652)" in result.stdout
    assert "findings of TIC-101 with these gains:" in result.stdout
    assert oven.read_text("utf-8") == before.replace("2.00 ", "14.65 ").replace("120.0", "168")
    again = run(*RULE, "--write", "oven.yaml", cwd=oven.parent)
    assert "oven.yaml, TIC-101: has these gains already" in again.stdout


def recorded(gain=1.8, step=15.0, scale=1.0, shift=0.0):
    """A record of a step: the PV in other units by ``scale`` and ``shift``."""
    rows = ["time [s],output,pv"]
    for t in range(600):
        pv = 50 + (0 if t < 80 else gain * step * -math.expm1(-(t - 80) / 60)) + 0.1 * (t % 2)
        rows.append(f"{t},{0.4 * step if t < 60 else 1.4 * step},{pv * scale + shift:.4f}")
    return "\n".join(rows)


@pytest.mark.parametrize("vendor", VENDORS)
@pytest.mark.parametrize(
    ("record", "says"),
    [
        (recorded(scale=20.0, shift=30000.0), "the PV goes from"),
        (recorded(gain=100.0, step=0.15), "the output steps by 0.15, 0.15 %"),
        (recorded(gain=0.4, step=600.0), "the output steps by 600, 600 %"),
    ],
    ids=["counts of the PV", "a share of 1", "counts of the output"],
)
def test_a_record_in_other_units_is_refused(tmp_path, vendor, record, says):
    text = starter(vendor).replace("MV_MAX: 4000", "MV_MAX: 100")
    (tmp_path / "loop.yaml").write_text(text, "utf-8")
    (tmp_path / "step.csv").write_text(record, "utf-8")
    with remembering():
        identify_record(record.encode(), "step.csv", DEFAULT)
        result = run("--method", "simc", "--from-csv", "step.csv", "--write", "loop.yaml", cwd=tmp_path)
    assert result.returncode != 0
    assert "step.csv is in other units" in result.stderr
    assert says in result.stderr
    assert (tmp_path / "loop.yaml").read_text("utf-8") == text


@pytest.mark.parametrize(
    ("header", "says"),
    [
        ("time [s],output [mA],pv [°C]", "its header has mA for the output, which is in % there"),
        ("time [s],output [%],pv [degF]", "its header has degF for the PV, which is in degC there"),
        ("time [s],output [percent],pv [%]", "its header has % for the PV, which is in degC there"),
        ("time [s],output [%],pv [Celsius]", ""),
        ("time [s],output [%],pv [Grad]", ""),
        ("time [s],output,pv", ""),
    ],
)
def test_units_of_a_header_that_the_loop_contradicts_are_refused(oven, header, says):
    (oven.parent / "step.csv").write_text(recorded().replace("time [s],output,pv", header), "utf-8")
    command = "--method", "simc", "--from-csv", "step.csv", "--columns", "time=1,output=2,pv=3", "--write", "oven.yaml"
    before = oven.read_text("utf-8")
    result = run(*command, cwd=oven.parent)
    assert (result.returncode, says in result.stderr) == (2 if says else 0, True), result.stderr
    assert (oven.read_text("utf-8") == before) is bool(says)


def test_diff_shows_a_patch_and_writes_nothing(oven):
    before = oven.read_bytes()
    result = run(*RULE, "--write", "oven.yaml", "--diff", cwd=oven.parent)
    assert result.returncode == 1
    assert oven.read_bytes() == before
    patched = subprocess.run(["patch", "-p0"], cwd=oven.parent, input=result.stdout, text=True, check=True)
    assert patched.returncode == 0
    assert b"gain: 14.65 " in oven.read_bytes()
    assert run(*RULE, "--write", "oven.yaml", "--diff", cwd=oven.parent).returncode == 0


def test_the_json_has_what_was_written(oven):
    found = json.loads(run(*RULE, "--write", "oven.yaml", "--format", "json", cwd=oven.parent).stdout)["written"]
    assert (found["file"], found["loop"], found["ok"], found["action_compared"]) == ("oven.yaml", "TIC-101", True, True)
    assert found["values"][0] == {"key": "tuning.gain", "unit": "%/%", "old": "2.00", "new": "14.65", "changes": True}
    assert {d["loop"] for d in found["findings"]} == {"TIC-101"}


def test_an_error_of_the_loop_keeps_the_file_as_it_is(oven):
    text = oven.read_text("utf-8").replace("limits: [20, 300]", "limits: [300, 20]")
    oven.write_text(text, "utf-8", newline="")
    result = run(*RULE, "--write", "oven.yaml", cwd=oven.parent)
    assert result.returncode == 1
    assert "oven.yaml, TIC-101: NOT WRITTEN, for its errors" in result.stdout
    assert oven.read_text("utf-8") == text


@pytest.mark.parametrize(
    ("args", "says"),
    [
        (["--diff"], "--diff needs --write FILE"),
        (["--write", "oven.yaml", "--diff", "--format", "json"], "it takes no --format"),
        (["--write", "-"], "not standard input"),
        (["--loop", "TIC-101"], "--loop is for --write"),
        (["--write", "none.yaml"], "none.yaml"),
        (["--write", "oven.yaml", "--for", "click"], "--for is click, and oven.yaml is for dl06"),
        (["--write", "oven.yaml", "--loop", "TIC-1"], "--loop 'TIC-1': oven.yaml has TIC-101; did you mean TIC-101?"),
    ],
)
def test_options_that_make_no_sense_are_refused(oven, args, says):
    result = run(*RULE, *args, cwd=oven.parent)
    assert result.returncode == 2
    assert says in result.stderr
    assert "Traceback" not in result.stderr


def test_a_protected_file_is_not_replaced(oven):
    (oven.parent / "other.yaml").hardlink_to(oven)
    before = oven.read_bytes()
    result = run(*RULE, "--write", "oven.yaml", cwd=oven.parent)
    assert result.returncode == 2
    assert "hard links" in result.stderr
    assert oven.read_bytes() == before


def test_decimals_of_a_float_are_those_of_its_register():
    """A single-precision register holds what is written: the shortest decimal of its number."""
    result = written(starter("click").encode(), (1 / 3, 100 / 3, 0.0))
    assert [value.new for value in result.values[:2]] == ["0.33333334", "33.333332"]
    assert Decimal(result.values[0].new) != Decimal(1) / 3


# --- What `tune --write` forecasts, against a run of the written file on the same process -----------------------------


FILES = {
    "dl06": (
        "pidcfg: 1\nvendor: dl06\nplc: {loop_table: V2000, reset_decimals: 1}\nloops:\n  - name: A\n    mode: auto\n"
        "    sample_rate: TS\n    action: ACTION\n    tuning: {gain: 1, reset: 100}\n"
        "    pv: {range: [0, 400], filter: 0.5}\n    setpoint: {value: 85}\n    output: {range: [0, 100]}\n"
    ),
    "generic": (
        "pidcfg: 1\nvendor: generic\nloops:\n  - name: A\n    mode: auto\n    output_raises_pv: RAISES\n"
        "    sample_time: TS\n    tuning: {gain: 1, integral_time: 50}\n    pv: {range: [0, 400], filter: 4}\n"
        "    setpoint: {value: 85}\n    output: {range: [0, 100], limits: [0, 100]}\n"
    ),
}


def file_of(vendor, sample=5, *, raises=True):
    text = FILES[vendor].replace("TS", str(sample)).replace("RAISES", str(raises).lower())
    return text.replace("ACTION", "direct" if raises else "reverse").encode()


def of_simulate(data, process, step, length):
    """Overshoot, and IAE per unit of the step, as a person would measure them with a scenario."""
    gain, integrates = process["gain"], process.get("model") == "integrating"
    text = f"gain: {gain!r}, dead_time: {process['dead_time']!r}, initial: 85"
    if integrates:
        plant = f"{{model: integrator, {text}, load: {-gain * 50!r}}}"
    elif "second_time_constant" in process:
        lags = [process["time_constant"], process["second_time_constant"]]
        plant = f"{{model: second_order, time_constants: {lags}, {text}, load: {85 - gain * 50!r}}}"
    else:
        lag = process["time_constant"]
        plant = f"{{model: first_order, time_constant: {lag!r}, {text}, load: {85 - gain * 50!r}}}"
    scenario = (
        f"pidcfg: 1\nscenario: step\nconfig: c.yaml\nduration: {length + 50}\n"
        f"initial: {{A: 50}}\nplants: {{A: {plant}}}\n"
        f"events:\n  - {{at: 50, loop: A, set: {{setpoint: {85 + step!r}}}}}\n"
    )
    trend = io.StringIO()
    ran = pidcfg.simulate(scenario.encode(), name="s.yaml", files={"c.yaml": data}, trend=trend, reference=False)
    found = rows(trend.getvalue())
    dt = found["time"][1] - found["time"][0]
    errors = [abs(a - b) for t, a, b in zip(found["time"], found["A.SP"], found["A.PV"], strict=True) if t >= 50]
    return ran.report.loops["A"].metrics["overshoot"], sum(errors[:-1]) * dt / step


def random_case(seed):
    """A vendor, a rule, a form and a process."""
    rng = random.Random(seed)
    constant = 10 ** rng.uniform(1, 1.8)
    sign = rng.choice([1, -1])
    process = {"gain": sign * 10 ** rng.uniform(0, 0.6), "dead_time": constant * 10 ** rng.uniform(-1, 0)}
    kind = rng.choice(["lag", "lags", "integrator"])
    if kind == "integrator":
        process |= {"model": "integrating", "gain": process["gain"] / constant}
    else:
        process["time_constant"] = constant
        process |= {"second_time_constant": constant * rng.uniform(0.1, 0.8)} if kind == "lags" else {}
    return rng.choice(["dl06", "generic"]), rng.choice(["simc", "lambda", "amigo"]), rng.choice([1, 2, 5]), process


@pytest.mark.parametrize("seed", range(8))
def test_the_forecast_is_what_simulate_shows(seed):
    vendor, rule, sample, process = random_case(seed)
    data = file_of(vendor, sample, raises=process["gain"] > 0)
    found = pidcfg.tune(rule, "PI", **process, into=data, into_name="c.yaml", loop="A")
    assert found.forecast.why == ""
    step = min(40.0, 0.9 * found.forecast.largest_step)
    ti = found.gains.integral_time
    past, error = of_simulate(found.written.data, process, step, int(12 * max(ti, 100)))
    assert found.judgement.answer.overshoot == pytest.approx(past, abs=3)
    assert found.forecast.hunts or found.judgement.answer.iae_setpoint == pytest.approx(error, rel=0.1)


def test_the_loop_s_own_sample_time_and_filter_are_used_and_told():
    process = {"gain": 2.0, "time_constant": 60.0, "dead_time": 8.0}
    alone, slow, fast = (
        pidcfg.tune("simc", "PI", **process),
        pidcfg.tune("simc", "PI", **process, into=file_of("generic", 5), into_name="c.yaml"),
        pidcfg.tune("simc", "PI", **process, into=file_of("generic", 1), into_name="c.yaml"),
    )
    assert alone.gains.gain == pytest.approx(60 / (2 * 16))
    assert slow.gains.gain == pytest.approx(62 / (2 * 2 * (8 + 2 + 2.5)))
    assert fast.gains.gain == pytest.approx(62 / (2 * 2 * (8 + 2 + 0.5)))
    assert (
        "  loop         samples every 5 s, PV filter 4 s, action output_raises_pv: true, PV 0 to 400, output 0 to 100\n"
        in tuning_text(slow)
    )
    assert json.loads(json.dumps(slow.to_json()))["loop"]["filter_time"] == pytest.approx(4)
    assert slow.to_json()["forecast"]["of"] == "words"
    assert "loop" not in alone.to_json()


def test_another_sample_time_than_the_loop_s_is_refused():
    with pytest.raises(ArgumentError, match="the loop samples every 5 s: leave it out"):
        pidcfg.tune(
            "simc", gain=2, time_constant=60, dead_time=8, sample_time=2, into=file_of("generic"), into_name="c.yaml"
        )


@pytest.mark.parametrize("vendor", ["dl06", "click", "ezlogix", "nextopid", "dpide", "generic"])
def test_the_words_of_every_vendor_run(vendor):
    found = pidcfg.tune(
        "simc", "PI", gain=2, time_constant=60, dead_time=8, into=starter(vendor).encode(), into_name="c"
    )
    assert found.forecast.why == ""
    assert found.forecast.settles
    assert 0 <= found.judgement.answer.overshoot < 40
    assert 10 < found.judgement.answer.iae_setpoint < 60


@pytest.mark.parametrize(
    ("process", "why"),
    [
        ({"transfer": "2(3s+1)exp(-8s)/((60s+1)(5s+1))"}, "zeros"),
        ({"gain": 2, "time_constant": 1e6, "dead_time": 0.5}, "too long"),
    ],
)
def test_where_nothing_runs_the_forecast_says_why(process, why):
    found = pidcfg.tune("simc", "PI", **process, into=file_of("generic", 1), into_name="c.yaml")
    assert why in found.forecast.why
    assert found.to_json()["forecast"] == {"of": "continuous loop", "why": found.forecast.why}
    assert f"of a continuous loop: {found.forecast.why}" in tuning_text(found)


def test_lags_in_a_row_run_too():
    chain = "2 exp(-8s)/((60s+1)(9s+1)(3s+1))"
    found = pidcfg.tune("simc", "PI", transfer=chain, into=file_of("generic", 1), into_name="c.yaml")
    assert found.forecast.why == ""
    assert found.judgement.answer.iae_setpoint == pytest.approx(2 * (8 + 7.5 + 0.5 + 4.5), rel=0.4)
