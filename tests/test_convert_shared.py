"""Conversions: what all of them share, their edges and limits, and every pair of vendors there and back."""

from __future__ import annotations

from collections import Counter
from decimal import Decimal
from importlib import resources
from itertools import permutations, product
from pathlib import Path
from types import SimpleNamespace
from types import SimpleNamespace as Facts

import pytest
from hypothesis import HealthCheck, given, settings

from generic_rig import configurations, file_of
from neutral_strategies import neutral_files
from pidcfg import api
from pidcfg.api import check_text
from pidcfg.conversion import (
    DEFAULT_MAX_LOSS,
    Change,
    ConvertError,
    MaxLossError,
    NeutralLoop,
    SourceField,
    TargetField,
    list_changes,
    parse_max_loss,
)
from pidcfg.conversion.builder import (
    NeutralBuilder,
    SameField,
    TargetBuilder,
    _is_within,
    apply_table,
    assign_addresses,
    assign_names,
    filter_factor,
    filter_time,
    flatten,
    rescale_outer_loops,
    without_unused_terms,
)
from pidcfg.conversion.dl06 import _derivative_filter
from pidcfg.conversion.generic import HARMLESS_FIELDS, RANGE_FIELDS, from_neutral, to_neutral
from pidcfg.conversion.operation import Smoothing, _smoothing_lines
from pidcfg.conversion.pipeline import _derivative_line, _is_default, convert, neutral_loops, read_back, validate_data
from pidcfg.encoders.codecs import EncodeError
from pidcfg.encoders.contract import encoder_of
from pidcfg.encoders.generic import CONVERT_OPTIONS
from pidcfg.schemas.base import BankRange
from pidcfg.schemas.generic import GenericFile, Loop
from pidcfg.study.verification.verify import verify
from pidcfg.text.writer import yaml_text
from pidcfg.vendors import VENDORS
from standing_rig import SIDES
from test_generic_encoding import leaves

LOOP = {
    "name": "TIC1",
    "output_raises_pv": True,
    "sample_time": 0.5,
    "tuning": {"gain": 2.5, "integral_time": 60},
    "pv": {"range": [0, 400], "unit": "degC"},
    "setpoint": {"value": 180},
    "output": {"range": [0, 100], "unit": "%"},
}


def neutral(**changed):
    """A neutral file of one loop."""
    return GenericFile.model_validate({"pidcfg": 1, "vendor": "generic", "loops": [{**LOOP, **changed}]})


# --- rows ------------------------------------------------------------------------------------------------------------

TABLE = (
    SameField("name"),
    SameField("text"),
    SameField("side.way", "raises", {"up": True, "down": False}),
    SameField("band", "deadband", skip_falsy=True, note="why"),
    lambda b, context: b.put("twice", context, "double", 2 * context),
)


def test_rows_and_steps_go_over_in_the_order_of_the_table():
    b = NeutralBuilder(0)
    loop = SimpleNamespace(name="A", text=None, side=SimpleNamespace(way="down"), band=3)
    apply_table(b, loop, 7, TABLE)
    assert b.loop.data == {"name": "A", "raises": False, "deadband": 3, "double": 14}
    assert b.loop.fields == [
        SourceField("name", "A", ("name",)),
        SourceField("side.way", "down", ("raises",)),
        SourceField("band", 3, ("deadband",), "why"),
        SourceField("twice", 7, ("double",)),
    ]


@pytest.mark.parametrize("band", [0, None, False])
def test_what_is_off_says_nothing_where_the_row_says_so(band):
    b = TargetBuilder()
    apply_table(b, SimpleNamespace(band=band), None, (SameField("band", skip_falsy=True),))
    assert (b.data, b.fields) == ({}, [])
    apply_table(b, SimpleNamespace(band=0), None, (SameField("band"),))
    assert b.data == {"band": 0}


# --- builders --------------------------------------------------------------------------------------------------------


def test_a_target_gets_plain_numbers_in_sections():
    b = TargetBuilder(3)
    b.put("pv.range", (Decimal(0), Decimal("0.1234567890123456")), "pv.range", "why", assumed=True)
    b.put_same(SameField("output.limits", is_pair=True), (Decimal(1), Decimal("2.50")))
    b.put_same(SameField("setpoint.limits", "SP.ends", note="both", is_pair=True), (Decimal(3), Decimal(4)))
    b.drop("output.max_rate", "by program")
    assert b.data == {"pv": {"range": [0, 0.123456789012]}, "output": {"limits": [1, 2.5]}, "SP": {"ends": [3, 4]}}
    assert b.fields == [
        TargetField("pv.range", "pv.range", "why", assumed=True),
        TargetField("output.limits.0", "output.limits.0"),
        TargetField("output.limits.1", "output.limits.1"),
        TargetField("SP.ends.0", "setpoint.limits.0", "both"),
        TargetField("SP.ends.1", "setpoint.limits.1", "both"),
        TargetField("", "output.max_rate", "by program"),
    ]
    with pytest.raises(ConvertError, match="no place") as refused:
        b.refuse("alarms.pv.high", "no place")
    assert refused.value.missing[0].path == ("loops", 3, "alarms", "pv", "high")


def test_what_the_source_must_say_has_its_place():
    b = NeutralBuilder(2)
    b.require("pv.range", "add it")
    b.require("", "all of it")
    assert [entry.path for entry in b.loop.missing] == [("loops", 2, "pv", "range"), ("loops", 2)]


def test_a_field_that_goes_nowhere_is_dropped_and_one_that_comes_from_nowhere_assumed():
    source = [SourceField("a", 1, ("x",)), SourceField("b", 2, ("y",)), SourceField("c", 3, note="by program")]
    target = [TargetField("p", "x"), TargetField("q", None, "chosen")]
    assert list(list_changes(source, target, {})) == [
        Change("a", "exact", 1, None, neutral=("x",), target_field="p"),
        Change("b", "dropped", 2, None, note="the target has no such field", loss=True, neutral=("y",)),
        Change("c", "dropped", 3, None, note="by program", loss=True),
        Change("q", "assumed", None, None, note="chosen", target_field="q"),
    ]


def test_what_the_target_has_besides_is_told_unless_every_loop_is_like_that():
    target = [TargetField("p", "x"), TargetField("q", "y"), TargetField("r", None)]
    assert list(list_changes([], target, {}, lambda name: name == "x")) == [
        Change("q", "assumed", None, None, neutral=("y",), target_field="q"),
        Change("r", "assumed", None, None, target_field="r"),
    ]


# --- places ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("count", "given_addresses", "starts"),
    [
        (0, [], []),
        (3, [], [1, 11, 21]),
        (10, [], [*range(1, 100, 10)]),
        (11, [], "10 addresses from R101 on do not end by R100"),
        (1, ["R91"], [91]),
        (1, ["R92"], "10 addresses from R92 on do not end by R100"),
        (2, ["R91"], "10 addresses from R101 on do not end by R100"),
        (3, ["R21", "R5"], [21, 5, 31]),
        (4, ["R25", "R5"], [25, 5, 15, 35]),
        (3, ["R16", "R6"], [16, 6, 26]),
        (2, ["R16", "R6"], [16, 6]),
        (1, ["R16", "R6"], "R16, R6: that is 2 for 1 of the loops"),
    ],
)
def test_blocks_of_10_registers_follow_the_last_that_is_given_and_overlap_none(count, given_addresses, starts):
    bank = BankRange("R", 1, 100, "a register")
    if isinstance(starts, str):
        with pytest.raises(ConvertError, match=f"^{starts}$") as refused:
            assign_addresses(bank, 10, count, given_addresses)
        assert [entry.path for entry in refused.value.missing] == [("loops",)]
    else:
        assert assign_addresses(bank, 10, count, given_addresses) == starts


@pytest.mark.parametrize(
    ("count", "given_names", "names"),
    [
        (2, [], ["O1", "O2"]),
        (3, ["O2"], ["O2", "O1", "O3"]),
        (3, [None, "O1"], ["O2", "O1", "O3"]),
        (2, ["O9", "O8"], ["O9", "O8"]),
    ],
)
def test_names_that_are_not_given_are_the_first_free_ones(count, given_names, names):
    assert assign_names(given_names, count, "O{}".format) == names


# --- cascades by position --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("span", "scaled"),
    [
        ([0, 50], {"range": [0, 50], "unit": "%", "bias": 10, "manual": 20, "limits": [5, 45]}),
        ([0, 400], {"range": [0, 400], "bias": 80, "manual": 160, "limits": [40, 360]}),
        ([-100, 300], {"range": [-100, 300], "bias": -20, "manual": 60, "limits": [-60, 260]}),
    ],
)
def test_an_output_that_commands_a_pv_is_told_on_its_scale(span, scaled):
    """0 to 100 % of the output are 0 to 100 % of the inner PV, and the gain is as much larger (D305)."""
    data = {"name": "TIC", "tuning": {"gain": 2}, "pv": {"range": [0, 9]}}
    data["output"] = {"range": [0, 50], "unit": "%", "bias": 10, "manual": 20, "limits": [5, 45]}
    fields = [SourceField(key, 1, (key,)) for key in ("tuning.gain", "output.range", "output.unit", "output.limits")]
    outer = NeutralLoop(data, fields)
    inner = NeutralLoop({"name": "FIC", "pv": {"range": span}, "setpoint": {"source": "TIC"}})
    assert rescale_outer_loops([outer, inner]) == [outer, inner]
    assert (outer.data["tuning"]["gain"], outer.data["output"]) == (2 * (span[1] - span[0]) / 50, scaled)
    note = "it commands FIC: told in the units of its PV" if span != [0, 50] else ""
    assert [field.note for field in outer.fields] == ["", note, note, ""]


# --- what registers hold ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("loops", 0, "tuning", "gain"), Decimal("2.25")),
        (("loops", 0, "sample_time"), Decimal(120)),
        (("loops", 0, "pv", "range", 1), Decimal(300)),
        (("loops", 0, "tuning", "integral_time"), Decimal(0)),
        (("loops", 0, "setpoint", "value"), None),
        (("loops", 0, "nothing"), None),
    ],
    ids=lambda case: str(case[-1]) if isinstance(case, tuple) else "",
)
def test_a_field_is_read_back_as_its_own_type_and_by_its_default(path, value):
    data = {
        "loops": [{**LOOP, "sample_time": "2 min", "tuning": {"gain": 2.25}, "pv": {"range": [0, 300]}, "setpoint": {}}]
    }
    assert read_back(neutral(), data, path) == value


def test_a_field_is_read_back_whatever_is_wrong_beside_it():
    data = {"loops": [{**LOOP, "mode": "no mode", "tuning": {"gain": 2.25, "integral_time": -1}}]}
    assert read_back(neutral(), data, ("loops", 0, "tuning", "gain")) == Decimal("2.25")


@pytest.fixture
def counts(monkeypatch):
    """How often each vendor's files are validated and encoded."""
    counts = Counter()

    def counting(kind, key, call):
        def counted(*args, **kwargs):
            counts[kind, key] += 1
            return call(*args, **kwargs)

        return counted

    for vendor in VENDORS.values():  # a module that is imported under the counter would keep it
        vendor.load("from_neutral")
        vendor.load("to_neutral")
    for key, vendor in VENDORS.items():
        image = encoder_of(vendor)
        monkeypatch.setattr(image, "encode", counting("encoded", key, image.encode))
        monkeypatch.setattr(vendor.model, "model_validate", counting("validated", key, vendor.model.model_validate))
    return counts


@pytest.mark.parametrize("target", [key for key in VENDORS if key != "generic"])
def test_a_target_is_validated_and_encoded_once_and_once_more_as_it_is_written(counts, target):
    source = neutral()
    converted = convert(source, VENDORS["generic"], VENDORS[target], {})
    assert (counts["validated", target], counts["encoded", target]) == (1, 1)
    checked = check_text(yaml_text(converted.data))
    assert not checked.failed
    assert (counts["validated", target], counts["encoded", target]) == (2, 2)
    assert converted.config == checked.config
    assert converted.encoding.image == checked.encoding.image


@pytest.mark.parametrize(
    ("loop", "key", "text"),
    [({}, "name", "Field required"), ({**LOOP, "sample_time": "2 x"}, "sample_time", "'2 x' is not a time")],
)
def test_what_a_model_refuses_of_a_result_is_told_by_its_key(loop, key, text):
    with pytest.raises(ConvertError) as refused:
        validate_data(GENERIC, {"pidcfg": 1, "vendor": "generic", "loops": [LOOP, loop]})
    assert [(entry.path, entry.message) for entry in refused.value.missing] == [
        (("loops", 1, key), f"loops.1.{key}: {text}")
    ]


def test_what_is_clamped_is_encoded_again(counts):
    converted = convert(neutral(tuning={"gain": 2, "derivative_time": 7000}), VENDORS["generic"], VENDORS["click"], {})
    assert converted.has_losses
    assert (counts["validated", "click"], counts["encoded", "click"]) == (2, 2)


# --- Pieces of conversions at their edges -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("rate", "n", "clamped"),
    [("10", 1, False), ("9.9", 1, True), ("200", 20, False), ("200.1", 20, True), ("100", 10, False)],
)
def test_a_filter_of_td_through_1_to_20_is_exact_or_the_nearest(rate, n, clamped):
    """The filter's time constant is 10 s."""
    put = []
    b = Facts(put=lambda *given, **more: put.append((given, more)))
    _derivative_filter(b, Decimal(10), Decimal(rate))
    (((path, limit, of, note), more),) = put

    assert (path, limit, of) == ("derivative_gain_limit", n, "tuning.derivative_filter")
    assert (more["clamped"], more["exact"], more["held"]) == (clamped, 10, Decimal(rate) / n)
    assert note == (f"the filter is Td/N with N from 1 to 20: {n}" if clamped else f"Td/{n}")


@pytest.mark.parametrize(
    ("key", "name", "inside"),
    [
        ("pv", "pv", True),
        ("pv.range", "pv", True),
        ("pv", "pv.range", False),
        ("pvs", "pv", False),
        ("pv", "pvs", False),
    ],
)
def test_a_key_is_within_its_name(key, name, inside):
    assert _is_within(key, name) == inside


@pytest.mark.parametrize("rules", [*product([None, Smoothing.EXACT, Smoothing.BACKWARD], repeat=2)])
@pytest.mark.parametrize("filter_time", [None, Decimal(0), Decimal(1)])
@pytest.mark.parametrize("derivative_time", [None, Decimal(0), Decimal(5)])
def test_a_derivative_filter_is_told_where_it_is_worked_out_otherwise(rules, filter_time, derivative_time):
    tuning = Facts(derivative_filter=filter_time, derivative_time=derivative_time)
    lines = [*_smoothing_lines(*rules, Facts(tuning=tuning, sample_time=Decimal(1)))]
    assert len(lines) == bool(None not in rules and rules[0] is not rules[1] and filter_time and derivative_time)


# --- What a conversion takes along and leaves behind, at the limits of its conditions ---------------------------------


EXAMPLES = Path(__file__).parents[1] / "examples"

DL06 = """\
pidcfg: 1
vendor: dl06
plc: {loop_table: V2000, reset_decimals: 1}
loops:
  # of A
  - name: A
    sample_rate: 1
    action: direct
    tuning: {gain: 1, reset: 10, rate: 5}
    derivative_gain_limit: 0
    derivative_gain_limit_enabled: true
    pv: {range: [0, 100]}
  # of B
  - name: B
    sample_rate: 1
    action: direct
    tuning: {gain: 1, reset: off, rate: 5}
    state: {output: 1000}
    derivative_gain_limit_enabled: true
    pv: {range: [0, 100]}
  # of C
  - name: C
    sample_rate: 1
    action: direct
    tuning: {gain: 1, reset: 10}
    pv: {range: [0, 100]}
"""
DPIDE = """\
pidcfg: 1
vendor: dpide
loops:
  - {name: A, device: D500, SV: 80, CYCLE: 1000, Kc_Kp: 12, Ti_Ki: 180, Td_Kd: 0, PID_EQ: true, PID_DIR: true,
     MV_MAX: 4000, MV_MIN: 0, pv: {range: [0, 100]}}
"""
PLAIN = "output_raises_pv: true, sample_time: 1, tuning: {gain: 1}"
CASCADE = """\
pidcfg: 1
vendor: generic
loops:
  - {name: M, mode: auto, PLAIN, pv: {range: [0, 100]}, output: {range: [0, 50], unit: kg}}
  - {name: S, mode: cascade, PLAIN, pv: {range: [0, 50]UNIT}, output: {range: [0, 100]}, setpoint: {source: M}}
""".replace("PLAIN", PLAIN)


@pytest.mark.parametrize(("target", "held"), [("dl06", 0), ("click", 50)])
@pytest.mark.parametrize("mode", ["manual", "auto"])
def test_the_output_with_which_a_loop_begins_in_manual_is_written_where_the_target_has_another(target, held, mode):
    """A neutral loop begins at 0 in its unit, these at 0 % of the range."""
    loop = f"{{name: A, mode: {mode}, {PLAIN}, pv: {{range: [0, 100]}}, output: {{range: [-50, 50]}}}}"
    text = f"pidcfg: 1\nvendor: generic\nloops:\n  - {loop}\n".replace("gain: 1", "gain: 1, integral_time: 30")
    result = api.convert(text, target)
    outputs = [change.target for change in result.loops[0].changes if change.target_field == "state.output"]
    assert outputs == [held] * (mode == "manual")


@pytest.fixture(scope="module")
def result():
    return api.convert(DL06, "generic", name="a.yaml")


def changed_fields(result, loop):
    """The lines of a loop by the field they begin with."""
    return {change.field: change for change in result.loops[loop].changes}


def test_a_comment_stays_with_its_loop(result):
    lines = result.text.splitlines()
    for name in "ABC":
        assert lines[lines.index(f"  - name: {name}") - 1] == f"  # of {name}"
    assert result.text.count("# of") == 3


def test_a_comment_behind_a_value_keeps_its_value_and_the_starters_own_stay_behind():
    tank = (EXAMPLES / "click" / "tank.yaml").read_text("utf-8")
    lines = api.convert(tank, "ezlogix", name="a.yaml").text.splitlines()
    assert "    action: reverse" in lines  # of the controller; the comment is of the process's
    assert "  # action: direct  # more heat, warmer water" in lines
    starter = resources.files("pidcfg").joinpath(VENDORS["click"].starter).read_text("utf-8")
    assert "#" not in api.convert(starter, "ezlogix", name="a.yaml").text


def test_a_derivative_that_a_limit_of_nothing_switches_off_is_left_by_the_key_that_does_it(result):
    given, missing = changed_fields(result, 0), changed_fields(result, 1)
    assert given["derivative_gain_limit"].source == 0
    assert missing["derivative_gain_limit_enabled"].source is True
    assert {given["tuning.rate"].kind, missing["tuning.rate"].kind} == {"dropped"}


def test_the_output_at_the_start_of_a_loop_without_an_integral_is_its_bias_as_it_was_written(result):
    change = changed_fields(result, 1)["state.output"]
    assert change.source == "1000 counts"
    assert "output: {range: [0, 100], bias: 24.42002442, manual: 24.42002442}" in result.text


def test_an_instruction_that_holds_its_integral_at_its_limits_is_one_with_anti_windup():
    assert "anti_windup: true" in api.convert(DPIDE, "generic", name="a.yaml").text


@pytest.mark.parametrize(("vendor", "field"), [("ezlogix", "deadband"), ("dl06", "error.deadband")])
def test_a_band_of_no_count_is_lost_wholly(vendor, field):
    found = convert(neutral(deadband=0.01), VENDORS["generic"], VENDORS[vendor], {})
    (change,) = [change for change in found.loops[0].changes if change.field == "deadband"]
    assert (change.kind, change.target_field, change.target) == ("rounded", field, 0)
    assert (change.error_percent, change.loss) == (100, True)


@pytest.mark.parametrize(("unit", "linked"), [(", unit: kg", True), ("", True), (", unit: l", False)])
def test_loops_are_linked_where_their_units_do_not_differ(unit, linked):
    text = api.convert(CASCADE.replace("UNIT", unit), "dl06", name="a.yaml").text
    assert ("cascade_from: M" in text) is linked


@pytest.mark.parametrize(
    ("changed", "field", "is_default"),
    [
        ({}, "setpoint.limits.0", True),
        ({"setpoint": {"limits": [0, 400]}}, "setpoint.limits.0", False),
        ({"setpoint": {"limits": [0, 400]}}, "setpoint.limits", False),
        ({}, "pv.range.0", False),
        ({}, "output.bias", True),
        ({"output": {"range": [0, 100], "bias": 1}}, "output.bias", False),
        ({}, "output.pulse.period", True),
        ({"output": {"range": [0, 100], "pulse": {"period": 1}}}, "output.pulse.period", False),
        ({"output": {"range": [0, 100], "pulse": {"period": 1}}}, "output.pulse.min_on", True),
        ({"setpoint": {"follows_pv": False}}, "setpoint.follows_pv", True),
        ({"setpoint": {"follows_pv": True}}, "setpoint.follows_pv", False),
        ({}, "alarms.hysteresis", True),
        ({"alarms": {"hysteresis": 1}}, "alarms.hysteresis", True),
        ({"alarms": {"hysteresis": 1, "pv": {"high": 9}}}, "alarms.hysteresis", False),
        ({}, "sample_time", False),
        ({}, "no.such.field", False),
    ],
)
def test_nothing_is_lost_with_a_field_that_says_what_every_loop_is_like(changed, field, is_default):
    assert _is_default(neutral(**changed).loops[0], field) is is_default


def test_a_configuration_without_a_neutral_form_says_what_all_of_its_loops_lack():
    plain = {"sample_rate": 1, "action": "direct", "tuning": {"gain": 1}}
    loops = [{"name": name, **plain, "pv": pv} for name, pv in (("A", {}), ("B", {"range": [0, 9]}), ("C", {}))]
    config = VENDORS["dl06"].model.model_validate(
        {"pidcfg": 1, "vendor": "dl06", "plc": {"loop_table": "V2000"}, "loops": loops}
    )
    with pytest.raises(ConvertError, match=r"add pv.range.*; add pv.range") as refused:
        neutral_loops(config, VENDORS["dl06"])
    assert [entry.path for entry in refused.value.missing] == [("loops", i, "pv", "range") for i in (0, 2)]


def test_what_is_wrong_with_all_loops_is_no_problem_of_one():
    loops = [{**LOOP, "name": f"L{i}"} for i in range(9)]
    config = GenericFile.model_validate({"pidcfg": 1, "vendor": "generic", "loops": loops})
    with pytest.raises(ConvertError, match="the file has 9 loops; a DL06 has 8: divide the file") as refused:
        convert(config, GENERIC, VENDORS["dl06"], {})
    assert [entry.path for entry in refused.value.missing] == [("loops",)]
    assert len(convert(config, GENERIC, VENDORS["dl06"], {}, excluded={3: "no"}).source_loops) == 8


@pytest.mark.parametrize(("on", "then_on"), [*product(("pv", "error"), repeat=2)])
@pytest.mark.parametrize(("time", "later"), [(1, 1), (0, 1), (1, 0)])
def test_a_derivative_of_something_else_is_told_where_both_have_one(on, then_on, time, later):
    before, after = (
        neutral(tuning={"gain": 1, "derivative_time": seconds, "derivative_on": acts_on}).loops[0]
        for seconds, acts_on in ((time, on), (later, then_on))
    )
    told = [change.note for change in _derivative_line([], before, after)]
    assert told == (
        [f"the derivative acts on the {then_on}, not on the {on}"] if on != then_on and time and later else []
    )


@pytest.mark.parametrize(
    ("proportional", "derivative", "terms"),
    [(False, 2, (1, 5, 8, "pv")), (True, 2, (4, 20, 2, "pv")), (False, 0, (1, 5, 0, None))],
)
def test_without_a_proportional_action_the_times_are_those_of_a_gain_of_1(proportional, derivative, terms):
    tuning = {"gain": 4, "proportional": proportional, "integral_time": 20, "derivative_on": "pv"}
    values = without_unused_terms(flatten(neutral(tuning=tuning | {"derivative_time": derivative}).loops[0]))
    keys = ("gain", "integral_time", "derivative_time", "derivative_on")
    assert tuple(values.get(f"tuning.{key}") for key in keys) == terms


def test_a_filter_is_a_share_of_a_sample_or_a_time_and_none_takes_all_of_it():
    half = filter_time(Decimal("0.5"), Decimal(2))
    assert float(half) == pytest.approx(2 / 0.6931471805599453)
    assert filter_factor(half, Decimal(2)) == Decimal("0.5")
    assert [filter_factor(Decimal(time), Decimal(2)) for time in (0, -1)] == [1, 1]
    assert [filter_time(Decimal(share), Decimal(2)) for share in (1, 2)] == [0, 0]


def test_a_loss_may_be_limited_to_none():
    assert parse_max_loss("gain=0%").gain == 0
    assert parse_max_loss("time=5").time == 5
    assert parse_max_loss("time=5").gain == DEFAULT_MAX_LOSS.gain
    for text in ("gain=-1%", "gain=inf", "gain=nan", "gain=x", "other=1%"):
        with pytest.raises(MaxLossError):
            parse_max_loss(text)


# --- The neutral form converted to itself and to others: nothing of it is lost on the way in --------------------------


GENERIC = VENDORS["generic"]
FULL = {
    "description": "x",
    "mode": "cascade",
    "tuning": {
        "gain": 2,
        "integral_time": 60,
        "derivative_time": 5,
        "proportional": False,
        "derivative_on": "error",
        "derivative_filter": 1,
    },
    "pv": {"range": [0, 40], "unit": "bar", "filter": 1, "square_root": True},
    "setpoint": {"value": 20, "limits": [1, 30], "source": "L1", "follows_pv": True},
    "output": {
        "range": [0, 100],
        "unit": "%",
        "limits": [5, 95],
        "bias": 10,
        "manual": 20,
        "max_rate": 3,
        "pulse": {"period": 10, "min_on": 1, "min_off": 1},
    },
    "deadband": 0.5,
    "anti_windup": False,
    "alarms": {
        "pv": {"low_low": 1, "low": 2, "high": 30, "high_high": 35},
        "deviation": {"high": 3, "high_high": 4},
        "rate_of_change": 2,
        "hysteresis": 0.1,
    },
}


def test_every_field_that_is_given_says_where_it_goes():
    (loop,) = to_neutral(file_of(FULL))
    pairs = {f"{path}.{i}" for path in RANGE_FIELDS for i in range(2)}

    assert sorted(entry.path for entry in loop.fields) == sorted(
        {*leaves(Loop), *RANGE_FIELDS} - pairs - {*HARMLESS_FIELDS}
    )
    assert all(entry.neutral == (entry.path,) for entry in loop.fields)
    assert not loop.missing


@settings(max_examples=40)
@given(configurations())
def test_it_is_converted_to_itself(config):
    assert neutral_loops(config, GENERIC)[0] == config
    assert GenericFile.model_validate(from_neutral(config, {}).data) == config


def test_a_conversion_to_itself_is_exact_and_complete():
    config = file_of({}, FULL)

    result = convert(config, GENERIC, GENERIC, {})

    assert not result.has_losses
    assert {change.kind for loop in result.loops for change in loop.changes} == {"exact"}
    assert GenericFile.model_validate(result.data) == config
    assert CONVERT_OPTIONS == ()


def test_what_a_vendor_does_not_have_is_dropped():
    result = convert(file_of({"output": {"range": [0, 100], "max_rate": 3}}), GENERIC, VENDORS["dpide"], {})

    assert [change.field for loop in result.loops for change in loop.changes if change.loss] == ["output.max_rate"]


@pytest.mark.parametrize(("vendor", "edit"), [("dl06", ("bumpless: II", "bumpless: I")), ("click", ("ss: 2", "ss: 1"))])
def test_a_set_point_that_follows_the_pv_does_so_in_the_neutral_form_too(vendor, edit):
    result = api.convert(SIDES[vendor].config.replace(*edit), "generic", verify=True)
    assert result.data["loops"][0]["setpoint"]["follows_pv"] is True
    (found,) = result.verified
    assert found.stages
    assert found.passed, found.failures


# --- Every ordered pair of vendors: the action, the gains and the answer of a loop survive, there and back again ------


PLCS = [key for key in VENDORS if key != "generic"]
PAIRS = list(permutations(PLCS, 2))
OVEN = {
    "name": "TIC1",
    "output_raises_pv": True,
    "sample_time": 0.5,
    "tuning": {"gain": 2.5, "integral_time": 60, "derivative_time": 0},
    "pv": {"range": [0, 400], "unit": "degC"},
    "setpoint": {"value": 180},
    "output": {"range": [0, 100], "unit": "%"},
}


def checked(data):
    """A configuration as anybody would check it, without an error."""
    found = check_text(yaml_text(data))
    assert not found.failed, [(d.code, d.message) for d in found.findings]
    return found


def of_vendor(loops, vendor):
    """Neutral loops as a vendor's configuration."""
    from pidcfg.conversion.pipeline import fit_to_registers

    file = GenericFile.model_validate({"pidcfg": 1, "vendor": "generic", "loops": loops})
    made = VENDORS[vendor].load("from_neutral")(file, {})
    fit_to_registers(made, VENDORS[vendor])
    return checked(made.data)


def apart(source, target):
    """The verdicts on two checked configurations with the same loops."""
    pairs = [(i, i) for i in range(len(source.config.loops))]
    return verify((source.vendor, source.config), (target.vendor, target.config), pairs)


def converted(source, target):
    """A checked configuration for another vendor."""
    return checked(convert(source.config, source.vendor, VENDORS[target], {}).data)


@pytest.mark.parametrize(("one", "two"), PAIRS)
@pytest.mark.parametrize("range_of_pv", [[1000, 1010], [20, 21]])
def test_a_scale_far_from_zero_keeps_the_digits_of_its_values(one, two, range_of_pv):
    low, high = range_of_pv
    share = Decimal("0.537")
    source = of_vendor([{**OVEN, "pv": {"range": range_of_pv}, "setpoint": {"value": low + share * (high - low)}}], one)
    target = converted(source, two)
    values = [neutral_loops(side.config, side.vendor)[0].loops[0].setpoint.value for side in (source, target)]
    assert all(abs((value - low) / (high - low) - share) <= Decimal("0.0003") for value in values)


@pytest.mark.parametrize("heats", [True, False], ids=["heating", "cooling"])
@pytest.mark.parametrize(("one", "two"), PAIRS)
def test_both_sides_hold_the_same_plant_alike(one, two, heats):
    """Where cooling, the sign is held of every pair, and the plant of each vendor as source and as target once."""
    source = of_vendor([{**OVEN, "output_raises_pv": heats}], one)
    target = converted(source, two)
    if heats or two == PLCS[PLCS.index(one) - 1]:
        found = apart(source, target)[0]
        assert found.pv_percent < 0.5
        assert found.iae_ratio == pytest.approx(1, abs=0.05)
    loop = neutral_loops(target.config, target.vendor)[0].loops[0]
    assert loop.output_raises_pv is heats
    assert float(loop.tuning.gain) == pytest.approx(2.5, rel=0.005)


def test_a_wrong_sign_would_be_seen():
    source = of_vendor([OVEN], "click")
    data = convert(source.config, source.vendor, VENDORS["nextopid"], {}).data
    data["loops"][0]["Direct"] = True
    target = checked(data)
    found = apart(source, target)[0]
    assert not found.passed
    assert found.pv_percent > 10


def close(a, b, error):
    """Whether two numbers differ by no more than the reported error, in %."""
    a, b = (Decimal(0) if x is None else Decimal(str(x)) for x in (a, b))
    return abs(a - b) <= max(abs(a), abs(b)) * Decimal(str(error / 100 + 2e-6))


def actions_of(loop):
    """P, I and D in shares of both ranges: CLICK knows its output in % only, and without P no gain stands alone."""
    low, high = loop.output.range
    tuning = loop.tuning
    share = tuning.gain * (loop.pv.range[1] - loop.pv.range[0]) / (high - low)
    integral = share / tuning.integral_time if tuning.integral_time else Decimal(0)
    return {"P": share if tuning.proportional else Decimal(0), "I": integral, "D": share * tuning.derivative_time}


@pytest.mark.parametrize(("one", "two"), PAIRS)
@settings(max_examples=8, deadline=None, suppress_health_check=list(HealthCheck))
@given(file=neutral_files())
def test_there_and_back_gives_the_same_loop_up_to_the_reported_rounding(one, two, file):
    try:
        source = of_vendor([loop.model_dump(mode="python", exclude_none=True) for loop in file.loops], one)
        there = convert(source.config, source.vendor, VENDORS[two], {})
        back = convert(checked(there.data).config, VENDORS[two], VENDORS[one], {})
    except (ConvertError, AssertionError, EncodeError):
        return  # one of the two cannot hold the loop, and says so
    if len(there.source_loops) < len(there.loops) or len(back.source_loops) < len(back.loops):
        return  # a loop cannot go, and its report says why
    before, _ = neutral_loops(source.config, source.vendor)
    after, _ = neutral_loops(checked(back.data).config, source.vendor)
    for i, (a, b) in enumerate(zip(before.loops, after.loops, strict=True)):
        rows = [*there.loops[i][1], *back.loops[i][1]]
        error = sum(change.error_percent for change in rows)
        lost = any(change.kind in {"dropped", "clamped"} for change in rows)
        assert a.output_raises_pv is b.output_raises_pv
        if not lost:
            was, now = actions_of(a), actions_of(b)
            assert all(close(was[key], now[key], error) for key in was), (was, now, rows)
            assert close(a.sample_time, b.sample_time, error)
            if a.setpoint.value is not None:  # else one is chosen, and reported
                assert close(a.setpoint.value, b.setpoint.value, error)


def test_a_kick_of_the_derivative_does_not_go_into_the_integral_of_a_dpide():
    kicking = {**OVEN, "tuning": {**OVEN["tuning"], "derivative_time": 10, "derivative_on": "error"}}
    source = of_vendor([kicking], "ezlogix")
    target = converted(source, "dpide")
    assert target.config.loops[0].PID_MODE == 0
    assert apart(source, target)[0].pv_percent < 0.1


@pytest.mark.parametrize("target", ["generic", "nextopid"])
def test_the_output_of_an_outer_loop_is_in_the_units_of_the_inner_pv(target):
    text = """
pidcfg: 1
vendor: dl06
plc: {loop_table: V2000}
loops:
  - {name: OUTER, mode: auto, sample_rate: 1, action: direct, tuning: {gain: 2.0, reset: 60}, setpoint: {value: 50},
     pv: {range: [0, 200]}, output: {range: [0, 100], limits: [10, 90]}}
  - {name: INNER, mode: cascade, cascade_from: OUTER, sample_rate: 1, action: direct, tuning: {gain: 1.0, reset: 9},
     setpoint: {value: 10}, pv: {range: [0, 50]}}
"""
    source = check_text(text)
    loop = neutral_loops(source.config, source.vendor)[0].loops[0]
    assert [float(end) for end in loop.output.range] == [0, 50]
    assert [float(end) for end in loop.output.limits] == [5, 45]
    assert float(loop.tuning.gain) == 0.5  # 2.0 of the spans: 2.0 * 50 / 200
    result = converted(source, target)
    assert max(found.pv_percent for found in apart(source, result)) < 0.1
