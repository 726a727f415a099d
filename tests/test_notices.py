"""What a run tells beside its verdicts."""

from __future__ import annotations

import ast
import csv
import inspect
import re
from collections import defaultdict
from functools import reduce
from operator import or_
from pathlib import Path
from types import SimpleNamespace as Facts

import pytest
from click.testing import CliRunner

from command import run_text
from generic_rig import Rig as GenericRig
from pidcfg.api import decode, encode, simulate
from pidcfg.cli.main import cli
from pidcfg.encoders.maps.click import ERRORS
from pidcfg.schemas.expressions import parse
from pidcfg.sim.controllers.click import equation as click_autotune
from pidcfg.sim.controllers.click import equation as click_state
from pidcfg.sim.controllers.click import scan as click_operate
from pidcfg.sim.controllers.click import scan as click_report
from pidcfg.sim.controllers.click.equation import BIAS_ERROR, row_of
from pidcfg.sim.controllers.click.equation import State as ClickState
from pidcfg.sim.controllers.dl06 import autotune as dl06_autotune
from pidcfg.sim.controllers.dl06 import equation as dl06
from pidcfg.sim.controllers.dl06 import equation as dl06_state
from pidcfg.sim.controllers.dl06 import operate as dl06_operate
from pidcfg.sim.controllers.dl06 import operate as dl06_report
from pidcfg.sim.controllers.dl06.equation import State as Dl06State
from pidcfg.sim.controllers.dl06.plc import overruling_reason
from pidcfg.sim.controllers.dpide import equation as dpide_autotune
from pidcfg.sim.controllers.dpide import equation as dpide_state
from pidcfg.sim.controllers.dpide import scan as dpide_report
from pidcfg.sim.controllers.dpide.equation import Config as DpideConfig
from pidcfg.sim.controllers.dpide.equation import State as DpideState
from pidcfg.sim.controllers.ezlogix import equation as ezlogix_autotune
from pidcfg.sim.controllers.ezlogix import equation as ezlogix_state
from pidcfg.sim.controllers.ezlogix import scan as ezlogix_operate
from pidcfg.sim.controllers.ezlogix import scan as ezlogix_report
from pidcfg.sim.controllers.ezlogix.equation import Config as EzlogixConfig
from pidcfg.sim.controllers.ezlogix.equation import State as EzlogixState
from pidcfg.sim.controllers.generic import equation as generic_state
from pidcfg.sim.controllers.generic import scan as generic_operate
from pidcfg.sim.controllers.generic import scan as generic_report
from pidcfg.sim.controllers.kernels import add_notice, split_notices
from pidcfg.sim.controllers.nextopid import plc as nextopid_operate
from pidcfg.sim.controllers.nextopid import plc as nextopid_report
from pidcfg.sim.controllers.nextopid import terms as nextopid_state
from pidcfg.sim.engine.expressions import Pool
from pidcfg.sim.judgement.evidence import _selections

# --- The numbers by which controllers say why: two reasons never share one, or one would be told as the other ---------

TABLES = (
    (click_operate, "MODE_REASONS"),
    (click_autotune, "REASONS"),
    (dl06_operate, "MODE_REASONS"),
    (dl06_operate, "RAMP_SOAK_REASONS"),
    (dl06_autotune, "REASONS"),
    (dpide_autotune, "REASONS"),
    (ezlogix_operate, "REASONS"),
    (generic_operate, "REASONS"),
    (nextopid_operate, "REASONS"),
)


@pytest.mark.parametrize(("module", "name"), TABLES)
def test_every_reason_that_is_written_has_a_number_of_its_own(module, name):
    (written,) = (
        part.value
        for part in ast.parse(inspect.getsource(module)).body
        if isinstance(part, ast.Assign) and ast.unparse(part.targets[0]) == name
    )
    plain = [key for key in written.keys if key is not None]

    assert len(getattr(module, name)) >= len(plain) > 0
    assert len({eval(ast.unparse(key), vars(module)) for key in plain}) == len(plain)  # noqa: S307 - our own names


@pytest.mark.parametrize("left", [[(0, 1)], [(7, 511)], [(7, 511), (0, 1), (1, 511), (7, 1), (7, 511)]])
def test_notices_are_read_as_they_were_left(left):
    """Up to five of them, of any reason and request that have room."""
    number = 0
    for requested, reason in left:
        number = add_notice(number, requested, reason)
    assert split_notices(number) == left
    for _ in range(5 - len(left)):
        number = add_notice(number, 0, 3)
    assert split_notices(add_notice(number, 1, 2)) == [*left, *[(0, 3)] * (5 - len(left))], (
        "there is no room for a sixth"
    )


@pytest.mark.parametrize(
    ("leave", "state", "reason"),
    [
        (
            lambda s: click_autotune.fail_autotune(s, click_autotune.TUNE_NO_RESPONSE),
            ClickState,
            click_autotune.TUNE_NO_RESPONSE,
        ),
        (dpide_autotune.abandon_autotune, DpideState, dpide_autotune.ABANDONED),
        (lambda s: dpide_autotune.fail_autotune(DpideConfig(), s, 3), DpideState, 3),
        (
            lambda s: ezlogix_autotune.end_tune(EzlogixConfig(), s, ezlogix_autotune.NO_STEP),
            EzlogixState,
            ezlogix_autotune.REASON_BASE + ezlogix_autotune.NO_STEP,
        ),
        (lambda s: ezlogix_autotune.tell_moving(s, 0.0), EzlogixState, ezlogix_autotune.PV_MOVING),
        (lambda s: dl06_autotune.end_tune(s, dl06_autotune.TUNE_NO_SWING), Dl06State, dl06_autotune.TUNE_NO_SWING),
    ],
)
def test_the_end_of_an_autotune_leaves_what_was_told_before_it(leave, state, reason):
    s = state(notice=add_notice(0, 1, 5), tune_drift=9.0)
    leave(s)
    assert split_notices(s.notice) == [(1, 5), (0, reason)]


# --- The bits by which controllers remember: each is one bit, and no two of a word share it ---------------------------

STATES = (click_state, dl06_state, dpide_state, ezlogix_state, generic_state, nextopid_state)
REPORTS = (click_report, dl06_report, dpide_report, ezlogix_report, generic_report, nextopid_report)


def words(module):
    """The numbers that a module gives names, by the comment above them, which says the word; a mask comes last."""
    source = inspect.getsource(module).partition("\n@dataclass")[0]
    comments = [number for number, line in enumerate(source.splitlines(), start=1) if line.startswith("# ")]
    found = defaultdict(list)
    for statement in ast.parse(source).body:
        above = [number for number in comments if number < statement.lineno]
        if isinstance(statement, ast.Assign) and above:
            values = statement.value.elts if isinstance(statement.value, ast.Tuple) else [statement.value]
            found[above[-1]] += [value.value for value in values if type(getattr(value, "value", None)) is int]
    return list(found.values())


@pytest.mark.parametrize("module", STATES, ids=lambda module: module.__name__)
def test_no_two_bits_of_a_word_are_the_same(module):
    found = words(module)
    assert max(map(len, found)) >= 5
    for bits in found:
        masks = [bit for at, bit in enumerate(bits) if at and bit == reduce(or_, bits[:at]) and bit.bit_count() > 1]
        single = [bit for bit in bits if bit not in masks]
        assert len({*single}) == len(single)
        assert all(bit.bit_count() == 1 for bit in single), single


@pytest.mark.parametrize("report", REPORTS, ids=lambda report: report.__name__)
def test_modes_alarms_and_flags_share_no_bit(report):
    shown = [report.MODE_BITS, getattr(report, "ALARM_BITS", {}), report.FLAG_BITS]
    modes, alarms, flags = ([*one.values()] for one in shown)
    assert len({*modes, *alarms}) == len(modes) + len(alarms)
    assert not {*flags} & {*alarms}
    assert all(bit.bit_count() == 1 for bit in (*modes, *alarms, *flags))


# --- Which signals a `min` or `max` takes now, and which it leaves out, wherever it stands in an expression -----------

NAMES = {"a": 0, "b": 1, "c": 2, "d": 3}


@pytest.mark.parametrize(
    ("text", "choices"),
    [
        ("min(a, b)", [("a", "b")]),
        ("max(a, b)", [("b", "a")]),
        ("min(b, a)", [("a", "b")]),
        ("max(b, a)", [("b", "a")]),
        ("min(a, a + 0)", [("a", "a")]),
        ("max(a * 5, b)", [("a", "b")]),
        ("max(a, d - 8)", [("a", "d")]),
        ("min(a, d - 8)", [("a", "d")]),
        ("max(d - 8, a)", [("d", "a")]),
        ("min(-a, b)", [("a", "b")]),
        ("max(abs(c), b)", [("c", "b")]),
        ("min(sqrt(d), b)", [("b", "d")]),
        ("1 + 2 * min(a - d, b) - 3", [("a d", "b")]),
        ("min(a, b, c)", [("a", "b"), ("c", "a b")]),
        ("max(min(a, b), c + d)", [("a", "b"), ("c d", "a b")]),
        ("min(7, a) + max(b, 1)", [("a", ""), ("b", "")]),
        ("(a + b) * c", []),
    ],
)
def test_a_choice_is_between_what_its_two_sides_read(text, choices):
    pool = Pool()
    pool.add(parse("d + 1", NAMES))
    first, last = pool.add(parse(text, NAMES))
    e = Facts(net=Facts(pool=pool), signal_values=[1.0, 2.0, -3.0, 9.0])

    wanted = [
        ({NAMES[name] for name in taken.split()}, {NAMES[name] for name in lost.split()}) for taken, lost in choices
    ]
    assert list(_selections(e, first, last)) == wanted


# --- Listings whose words are no values of their format: they decode, each such word is named and counts as 0 (D50) ---

EXAMPLES = Path(__file__).parents[1] / "examples"
REACTOR = EXAMPLES / "dl06" / "reactor.yaml"
TANK = EXAMPLES / "click" / "tank.yaml"
PROFILE = """\
pidcfg: 1
vendor: dl06
plc: {loop_table: V2000, reset_decimals: 1}
loops:
  - name: L1
    mode: auto
    sample_rate: 2
    action: direct
    tuning: {gain: 0.5, reset: 20, rate: 1.2}
    ramp_soak: {table: V3000, steps: [{ramp_to: 100, slope: 2, soak: 1}]}
"""


def listing(source, contents):
    """The listing of a configuration with other hexadecimal contents at some addresses."""
    lines = str(encode(source).text).splitlines()
    for address, content in contents.items():
        (at,) = (i for i, line in enumerate(lines) if line.startswith(f"{address} "))
        lines[at] = f"{address} {content}"
    return "\n".join(lines) + "\n"


def test_all_words_of_a_listing_that_are_no_values_are_named_and_count_as_0():
    wrong = {"V2010": "00AF", "V2012": "F0F0", "V2007": "0A00", "V2002": "8000", "V3001": "B000"}
    result = decode(listing(PROFILE, wrong), "dl06")

    assert result.findings == ()
    (loop,) = result.data["loops"]
    assert (float(loop["tuning"]["gain"]), loop["tuning"]["reset"], float(loop["tuning"]["rate"])) == (0, 20, 0)
    assert float(loop["ramp_soak"]["steps"][0]["slope"]) == 0
    named = [re.match(r"L1, (V\d+): .*; it counts as 0 \(D50\)$", note) for note in result.notes]
    assert {m.group(1) for m in named if m} == {*wrong}
    assert result.warnings == tuple(note for note, m in zip(result.notes, named, strict=True) if m)
    assert any("encoded again, these words differ" in note and "V2010" in note for note in result.notes)


def test_a_number_that_the_listing_does_not_hold_is_told_in_quiet_too(tmp_path):
    (tmp_path / "upload.txt").write_text(listing(PROFILE, {"V2010": "00AF"}), "utf-8")
    result = run_text("decode", "upload.txt", "--vendor", "dl06", "--quiet", cwd=tmp_path)
    assert "gain: 0," in result.stdout
    (line,) = result.stderr.splitlines()
    assert line.startswith("warning: L1, V2010: gain (+10): 0x00AF has a digit above 9")


@pytest.mark.parametrize("content", ["00A1", "FFFF"])
def test_a_loop_count_that_is_no_number_is_told_and_can_be_said_otherwise(content):
    words = [line for line in listing(PROFILE, {"V7641": content}).splitlines() if not line.startswith("#")]
    (finding,) = decode("\n".join(words) + "\n", "dl06").findings
    assert "--number-of-loops says how many loops to read" in finding.message
    result = decode("\n".join(words) + "\n", "dl06", options={"number_of_loops": 1})
    assert len(result.data["loops"]) == 1
    assert any("bit 2 of V7642" in note for note in result.notes)


@pytest.mark.parametrize("content", ["7FC00000", "7F800000", "FF800000"])
def test_a_click_float_that_is_no_number_counts_as_0(content):
    result = decode(listing(TANK, {"DF106": content, "DF105": content}), "click")
    assert result.findings == ()
    (loop,) = result.data["loops"]
    assert float(loop["tuning"]["proportional_gain"]) == 0
    named = [note for note in result.notes if note.endswith("it counts as 0 (D50)")]
    assert [note.partition(":")[0] for note in named] == ["TANK1, DF105", "TANK1, DF106"]


@pytest.mark.parametrize("content", ["7FC00000 nan", "7F800000 inf", "FF800000 -inf"])
def test_the_decimal_column_may_say_that_a_float_is_no_number(content):
    assert decode(listing(TANK, {"DF106": content}), "click").findings == ()


@pytest.mark.parametrize(("address", "error"), [("DF101", 20), ("DF102", 21), ("DF103", 22), ("DF105", 25)])
def test_errors_of_floats_that_are_no_numbers_can_be_loaded_and_seen(address, error):
    scenario = (
        "pidcfg: 1\nscenario: nan\nconfig: c.txt\nduration: 60\n"
        "plants:\n  TANK1: {model: first_order, time_constant: 10, initial: 100}\n"
    )
    result = simulate(scenario, files={"c.txt": listing(TANK, {address: "7FC00000"})})
    assert result.report is not None
    assert result.report.plc_flags == {"DS101": str(error)}


def test_a_listing_of_the_dl06_with_such_words_runs_and_names_them():
    scenario = (
        "pidcfg: 1\nscenario: words\nconfig: c.txt\nduration: 60\n"
        "plants:\n  L1: {model: first_order, time_constant: 10}\n"
    )
    result = simulate(scenario, files={"c.txt": listing(PROFILE, {"V2010": "00AF", "V2012": "F0F0"})})
    notes = [note.text for note in result.report.notes if "word without a value" in note.text]
    assert len(notes) == 2
    assert "+10 Gain" in notes[0]
    assert "+12 Rate" in notes[1]


def test_the_error_flags_of_a_listing_belong_to_the_set_up():
    text = str(encode(PROFILE).text)
    quiet, flagged = (decode(f"{text}V7642 {word}\n", "dl06") for word in ("0000", "0004"))
    assert not any("V7642" in note for note in quiet.notes)
    assert [note for note in flagged.notes if "V7642" in note] == [
        "V7642 0004: the PLC's error flags of the set-up are not carried over"
    ]


# --- What the signals of a loop are that takes the root of its PV, beside every file that has them --------------------

CONFIG = """\
pidcfg: 1
vendor: dl06
plc: {loop_table: V2000}
loops:
  - name: FIC
    sample_rate: 1
    action: direct
    mode: auto
    tuning: {gain: 0.5, reset: 5}
    pv: {range: [0, 100], unit: m3/h, square_root: ROOT}
    setpoint: {value: 50}
  - {name: TIC, sample_rate: 1, action: direct, tuning: {gain: 0.5}}
"""
SCENARIO = """\
pidcfg: 1
scenario: Flow
config: c.yaml
duration: 30
plants: {FIC: {model: first_order, time_constant: 2, gain: 0.03}, TIC: {model: first_order, time_constant: 2}}
"""
REMARK = "PV and SP are before the root: 25.01 at the end stands for 50.01 m3/h"


@pytest.fixture
def run(tmp_path, monkeypatch):
    """A command in a folder with the scenario; `root` says whether FIC takes the root of its PV."""
    monkeypatch.chdir(tmp_path)

    def run(*args, root="true"):
        Path("c.yaml").write_text(CONFIG.replace("ROOT", root), "utf-8")
        Path("s.yaml").write_text(SCENARIO, "utf-8")
        return CliRunner().invoke(cli, args, catch_exceptions=False)

    return run


def test_a_trend_comes_with_a_note(run):
    assert f"t.csv: FIC: {REMARK}\n" in run("simulate", "s.yaml", "--trend", "t.csv").stderr
    assert "root" not in run("simulate", "s.yaml", "--trend", "t.csv", "--force", root="false").stderr
    assert "root" not in run("simulate", "s.yaml", "--trend", "t.csv", "--force", "--quiet").stderr


@pytest.mark.parametrize("page", [(), ("-o", "r.html")])
def test_the_table_of_signals_has_a_remark(run, page):
    run("report", "s.yaml", "--tables", "t", *page)
    with Path("t/signals.csv").open(encoding="utf-8-sig", newline="") as file:
        remarks = {row["Signal"]: row["Remark"] for row in csv.DictReader(file)}
    assert remarks == {
        "FIC.PV": REMARK,
        "FIC.SP": REMARK,
        "FIC.OUT": "",
        "FIC.BIAS": "",
        "TIC.PV": "",
        "TIC.SP": "",
        "TIC.OUT": "",
        "TIC.BIAS": "",
    }


# --- Why something that an event writes has no effect, or soon none any more: each reason, and what is next to it -----

OUTPUT, BIAS, SETPOINT = "state.output", "state.bias", "setpoint.value"
OVERWRITTEN = "the next calculation overwrites +05, only in Manual it stays"
NO_BIAS = "the velocity form has no bias: +04 does nothing"
IN_CASCADE = "in Cascade the set point is the output of the major loop, +02 waits"
EFFECT_PROFILE = "a ramp/soak profile runs: its next ramp overwrites +02"


@pytest.mark.parametrize(
    ("path", "config", "state", "reason"),
    [
        (OUTPUT, {}, {"status": dl06.MANUAL}, None),
        (OUTPUT, {}, {"status": dl06.AUTO}, OVERWRITTEN),
        (OUTPUT, {}, {"status": dl06.CASCADE}, OVERWRITTEN),
        (OUTPUT, {"halt": 1}, {"status": dl06.AUTO}, None),
        (OUTPUT, {}, {"status": dl06.AUTO, "pending": dl06.STOPPED}, None),
        (OUTPUT, {}, {"status": dl06.AUTO, "pending": dl06.PROGRAM}, OVERWRITTEN),
        (BIAS, {}, {"status": dl06.AUTO}, None),
        (BIAS, {"velocity": 1}, {"status": dl06.AUTO}, NO_BIAS),
        (BIAS, {"velocity": 1}, {"status": dl06.MANUAL}, NO_BIAS),
        (SETPOINT, {"major": 0}, {"status": dl06.CASCADE}, IN_CASCADE),
        (SETPOINT, {"major": -1}, {"status": dl06.CASCADE}, None),
        (SETPOINT, {"major": 0}, {"status": dl06.AUTO}, None),
        (SETPOINT, {}, {"status": dl06.AUTO, "rs_step": 1}, EFFECT_PROFILE),
        (SETPOINT, {}, {"status": dl06.AUTO, "rs_step": 2, "aux_status": dl06.RS_HELD}, None),
        (SETPOINT, {"velocity": 1}, {"status": dl06.AUTO}, None),
        ("tuning.gain", {"velocity": 1, "major": 0}, {"status": dl06.CASCADE, "rs_step": 1}, None),
    ],
)
def test_a_word_of_a_dl06_is_overruled(path, config, state, reason):
    assert overruling_reason(dl06.Config(**config), dl06.State(**state), path) == reason


@pytest.mark.parametrize(
    ("loop", "key", "value", "reason"),
    [
        (
            {},
            "output.manual",
            20,
            "output.manual acts in manual only, which keeps the output when it begins",
        ),
        ({"mode": "manual"}, "output.manual", 20, None),
        ({}, "setpoint.value", 20, None),
        ({}, "tuning.gain", 2, None),
    ],
)
def test_a_field_of_a_neutral_loop_acts_or_says_why_not(loop, key, value, reason):
    assert GenericRig(loop).set(key, value) == reason


def test_the_set_point_of_a_neutral_slave_is_its_masters_output():
    slave = {"mode": "cascade", "setpoint": {"value": 0, "source": "L1"}}
    rig = GenericRig({}, slave)
    assert rig.set("setpoint.value", 20, 1) == "in cascade the set point is the master's output"
    assert rig.set("setpoint.value", 20, 0) is None


def test_a_pid_error_of_a_click_is_held_by_its_row():
    assert [row_of(error.number) for error in ERRORS] == list(range(1, len(ERRORS) + 1))
    assert (ERRORS[BIAS_ERROR - 1].number, ERRORS[BIAS_ERROR - 1].register) == (25, "bias")
