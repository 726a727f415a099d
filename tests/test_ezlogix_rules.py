"""Rules for EZLogix configurations at their limits: at the limit nothing, one step beyond the finding."""

import json
from copy import deepcopy
from decimal import Decimal
from pathlib import Path

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from pidcfg.encoders.ezlogix.files import make_tags
from pidcfg.encoders.listing import UnwritableError
from pidcfg.encoders.maps.ezlogix import R_BLOCK, VARIABLES
from pidcfg.schemas.base import NAME
from pidcfg.sim.controllers.ezlogix.equation import STEP_COUNTS, Config, State, begin_cycle
from pidcfg.text.diagnostics import Severity
from pidcfg.text.references import Decision
from pidcfg.text.source import read_document
from pidcfg.validate.engine import check_document
from pidcfg.validate.rules.ezlogix import RULES
from pidcfg.validate.rules.ezlogix import tuning as autotune

ROOT = Path(__file__).parents[1]
LOOP = {
    "name": "A",
    "registers": "R1",
    "discretes": "S1",
    "algorithm": "position",
    "action": "reverse",
    "sample_rate": 1,
    "tuning": {"proportional_gain": 1, "integral_time": 60},
    "pv": {"tag": "IR1"},
    "output": {"tag": "OR1"},
}
P_ONLY = {"proportional_gain": 1}
OWN = "EZ4"


def changed(n=1, **values):
    """Loop ``n`` with other values: ``changed(**{"pv.unit": "bar"})``."""
    loop = deepcopy(LOOP) | {"name": "ABCDEFGHIJ"[n - 1], "registers": f"R{32 * n - 31}", "discretes": f"S{8 * n - 7}"}
    loop["pv"]["tag"], loop["output"]["tag"] = f"IR{n}", f"OR{n}"
    for path, value in values.items():
        *parents, key = path.split(".")
        place = loop
        for parent in parents:
            place = place.setdefault(parent, {})
        place[key] = value
    return loop


def checked(*loops, **plc):
    text = json.dumps({"pidcfg": 1, "vendor": "ezlogix", "plc": plc, "loops": loops}, default=float)
    result = check_document(read_document(text.encode(), "case.yaml"))
    assert result.config is not None, result.findings
    return result


def findings(*loops, **plc):
    result = checked(*loops, **plc)
    return (*result.findings, *result.to_check)


def codes(*loops, **plc):
    return {d.code for d in findings(*loops, **plc)}


def serious(*loops, **plc):
    """Codes of errors and warnings, each as often as it is found."""
    return sorted(d.code for d in findings(*loops, **plc) if d.severity > Severity.INFO)


def test_the_loop_that_the_tests_change_is_in_order():
    assert not codes(changed())
    assert not codes(*(changed(n) for n in range(1, 9)))


def times(cycle, **others):
    return {"tag": "O1", "cycle_time": cycle, **others}


# fmt: off
STEPS = [
    # code      what is changed                                          at the limit  one step beyond
    ("EZ401", ("registers",), "R65504", "R65505"),
    ("EZ401", ("discretes",), "S65528", "S65529"),
    ("PID110", ("action", {"description": "heater"}), "reverse", "direct"),
    ("PID110", ("action", {"description": "chiller"}), "direct", "reverse"),
    ("EZ423", ("tuning.proportional_gain",), 0.01, 0),
    ("EZ424", ("tuning.proportional_gain", {"tuning.integral_time": 0}), 0.01, 0),
    ("EZ424", ("tuning.integral_time", {"tuning.proportional_gain": 0}), 0.1, 0),
    ("EZ425", ("output.offset", {"tuning": P_ONLY}), 1, 0),
    ("EZ426", ("tuning.integral_time",), 1, 0.9),
    ("EZ426", ("sample_rate", {"tuning.integral_time": 20}), 20, 20.01),
    ("EZ427", ("tuning.derivative_time",), 1, 0.9),
    ("EZ428", ("tuning", ), {"proportional_gain": 1, "integral_time": 0.3, "derivative_time": 0.2},
                             {"proportional_gain": 1, "integral_time": 0.3, "derivative_time": 0.3}),
    ("EZ429", ("tuning.derivative_time",), 410, 410.1),
    ("EZ429", ("tuning.derivative_time", {"tuning.proportional_gain": 0}), 410, 410.1),
    ("EZ429", ("tuning.proportional_gain", {"tuning.derivative_time": 100}), 4.10, 4.11),
    ("EZ430", ("sample_rate",), 0.05, 0),
    ("PID101", ("sample_rate", {"autotune.timeout": 5000}), 99.99, 100),
    ("PID101", ("sample_rate",), 0.05, 0.04),
    ("PID101", ("tuning.proportional_gain",), 99.99, 100),
    ("PID101", ("tuning.integral_time",), 6000, 6000.1),
    ("PID101", ("tuning.derivative_time",), 600, 600.1),
    ("PID103", ("tuning.proportional_gain",), 0.01, 0.004),
    ("PID103", ("tuning.integral_time",), 0.1, 0.04),
    ("PID103", ("tuning.derivative_time",), 0.1, 0.04),
    ("PID102", ("setpoint.value",), 4095, 4096),
    ("PID102", ("setpoint.limits",), [0, 4095], [0, 4096]),
    ("PID102", ("setpoint.value", {"pv.counts": [819, 4095]}), 819, 818),
    ("PID102", ("output.limits",), [0, 4095], [0, 4096]),
    ("PID102", ("output.offset",), 0, -1),
    ("EZ435", ("setpoint.limits",), [2000, 2001], [2001, 2000]),
    ("EZ436", ("setpoint.limits", {"setpoint.value": 1}), [0, 1], [0, 0]),
    ("EZ436", ("setpoint.value", {"setpoint.limits": [0, 0]}), 0, 1),
    ("EZ437", ("setpoint.limits",), [2000, 2001], [2000, 2000]),
    ("EZ438", ("setpoint.value", {"setpoint.limits": [1000, 2000]}), 1000, 999),
    ("EZ438", ("setpoint.value", {"setpoint.limits": [1000, 2000]}), 2000, 2001),
    ("EZ440", ("deadband",), 409, 410),
    ("EZ441", ("deadband",), 2, 1),
    ("EZ441", ("deadband", {"pv.range": [0, 4095]}), 1.51, 1.49),
    ("EZ446", ("pv.counts", {"pv.square_root": True}), [0, 4095], [1, 4095]),
    ("EZ447", ("pv.range", {"pv.square_root": True}), [0, 50], [0.1, 50]),
    ("EZ448", ("pv.counts",), [10, 8200], [10, 8201]),
    ("EZ455", ("output.limits",), [2000, 2001], [2000, 2000]),
    ("EZ456", ("output.limits",), [0, 4095], [1, 4095]),
    ("EZ456", ("output.limits",), [0, 4095], [0, 4094]),
    ("EZ457", ("output.limits",), [0, 4095], [1, 4095]),
    ("EZ458", ("output.offset", {"output.limits": [1000, 2000]}), 1000, 999),
    ("EZ458", ("output.offset", {"output.limits": [1000, 2000]}), 2000, 2001),
    ("EZ459", ("output.offset",), 0, 1),
    ("EZ461", ("output.limits",), [0, 101], [0, 100]),
    ("EZ465", ("output.pulse",), times(0.1), times(0)),
    ("EZ466", ("output.pulse",), times(20, min_on=10, min_off=10), times(20, min_on=10, min_off=10.1)),
    ("EZ467", ("output.pulse",), times(20, min_on=19.9), times(20, min_on=20)),
    ("EZ468", ("output.pulse", {"output.limits": [2048, 4095]}), times(20, min_off=10), times(20, min_off=10.1)),
    ("EZ469", ("output.pulse", {"output.limits": [1024, 4095]}), times(20, min_on=5), times(20, min_on=5.1)),
    ("EZ470", ("output.pulse", {"output.limits": [0, 3072]}), times(20, min_off=5), times(20, min_off=5.1)),
    ("EZ471", ("output.pulse", {"sample_rate": 15}), times(15), times(14.9)),
    ("EZ472", ("output.pulse",), times(60), times(60.1)),
    ("EZ473", ("output.pulse",), times(10), times(9.9)),
    ("EZ480", ("autotune.timeout", {"tuning.integral_time": 1}), 40, 0),
    ("EZ481", ("autotune.timeout",), 60, 59),
    ("EZ481", ("autotune.timeout",), 39, 40),
    ("EZ482", ("autotune.timeout",), 40, 39),
    ("EZ484", ("output.limits", {"autotune.type": "PID"}), [1000, 1410], [1000, 1409]),
]
# fmt: on


@pytest.mark.parametrize(("code", "what", "inside", "outside"), STEPS, ids=[f"{row[0]}-{row[1][0]}" for row in STEPS])
def test_one_step_beyond_the_limit_is_found_and_the_limit_is_not(code, what, inside, outside):
    key, *others = what
    given_too = others[0] if others else {}

    assert code not in codes(changed(**given_too, **{key: inside}))
    assert code in codes(changed(**given_too, **{key: outside}))


ONE = [
    # what is changed, and all errors and warnings that it makes
    ({"sample_rate": 0}, ["EZ430"]),
    ({"output.pulse": times(0)}, ["EZ465"]),
    ({"output.pulse": times(20, min_on=21, min_off=21)}, ["EZ467"]),
    ({"output.pulse": times(20, min_off=25)}, ["EZ466"]),
    ({"output.pulse": times(10), "tuning.integral_time": 0.5}, ["EZ426"]),
    ({"output.pulse": times(10), "tuning.integral_time": 0.3, "tuning.derivative_time": 0.3}, ["EZ428"]),
    ({"tuning": {"proportional_gain": 0}}, ["EZ424"]),
    ({"tuning.proportional_gain": 0}, ["EZ423"]),
    ({"setpoint.limits": [0, 0], "setpoint.value": 100}, ["EZ436"]),
    ({"setpoint.limits": [0, 0], "mode": "auto"}, ["EZ436"]),
    ({"setpoint.limits": [2000, 1000], "setpoint.value": 3000}, ["EZ435"]),
    ({"setpoint.value": 5000, "setpoint.limits": [0, 4000]}, ["PID102"]),
    ({"output.limits": [0, 100]}, ["EZ461"]),
    ({"output.limits": [0, 0]}, ["EZ455"]),
    ({"output.limits": [3000, 2000], "output.offset": 100}, ["EZ455"]),
    ({"pv.square_root": True, "pv.counts": [819, 4095], "pv.range": [0, 50], "setpoint.value": 10}, ["EZ446"]),
    ({"pv.tag": "R1"}, ["EZ404"]),
    ({"output.tag": "R32"}, ["EZ404"]),
    ({"pv.tag": "R500", "output.tag": "R500"}, ["EZ407"]),
    ({"autotune.timeout": 0}, ["EZ480"]),
]


@pytest.mark.parametrize(("values", "expected"), ONE, ids=[f"{row[1][0]}-{i}" for i, row in enumerate(ONE)])
def test_one_fault_is_one_finding(values, expected):
    assert serious(changed(**values)) == expected


# --- blocks and tags -------------------------------------------------------------------------------------------------


@given(st.integers(1, 200), st.integers(1, 200), st.integers(1, 40), st.integers(1, 40))
def test_blocks_overlap_where_they_have_an_address_in_common(r1, r2, s1, s2):
    first = changed(1, registers=f"R{r1}", discretes=f"S{s1}")
    second = changed(2, registers=f"R{r2}", discretes=f"S{s2}")
    shared = bool({*range(r1, r1 + 32)} & {*range(r2, r2 + 32)}) + bool({*range(s1, s1 + 8)} & {*range(s2, s2 + 8)})

    assert serious(first, second).count("EZ402") == 2 * shared


@given(st.integers(1, 200), st.integers(1, 200), st.sampled_from(["pv.tag", "output.tag"]))
def test_a_tag_in_any_block_is_found_unless_it_is_the_set_point_of_another_loop(base, number, key):
    assume(base > 32)
    loops = changed(1, **{key: f"R{number}"}), changed(2, registers=f"R{base}")
    inside = number <= 32 or base <= number < base + 32
    cascade = key == "output.tag" and number == base + R_BLOCK.offset_of("setpoint")
    found = codes(*loops, process_when_stopped=False)

    assert ("EZ404" in found) == (inside and not cascade)
    assert ("EZ405" in found) == cascade


def test_input_and_output_registers_are_in_no_block():
    assert not codes(changed(1, **{"pv.tag": "IR2", "output.tag": "OR2"}))


@pytest.mark.parametrize(
    ("limits", "severity"),
    [
        ([1000, 3000], Severity.INFO),
        ([999, 3000], Severity.WARNING),
        ([1000, 3001], Severity.WARNING),
    ],
)
def test_a_cascade_whose_outer_cv_goes_beyond_the_inner_limits_is_a_warning(limits, severity):
    outer = changed(1, **{"output.tag": "R34", "output.limits": limits})
    found = findings(outer, changed(2, **{"setpoint.limits": [1000, 3000]}))

    assert [d.severity for d in found if d.code == "EZ405"] == [severity] * 2, "at both loops"


def test_a_cascade_into_a_square_root_loop_ends_at_the_root_of_the_span():
    inner = changed(2, **{"pv.square_root": True})
    severities = [
        next(
            d.severity
            for d in findings(changed(1, **{"output.tag": "R34", "output.limits": [0, high]}), inner)
            if d.code == "EZ405"
        )
        for high in (64, 65)
    ]

    assert severities == [Severity.INFO, Severity.WARNING]


def test_the_inner_loop_of_a_cascade_needs_no_set_point_of_its_own():
    inner = changed(2, mode="auto")

    assert "EZ439" in codes(changed(1), inner)
    assert "EZ439" not in codes(changed(1, **{"output.tag": "R34"}), inner)


@pytest.mark.parametrize(
    ("pv", "output", "pulse", "found"),
    [
        ("IR1", "OR1", False, False),
        ("R500", "OR1", False, True),
        ("IR1", "R501", False, True),
        ("IR1", "R501", True, False),
        ("R500", "R501", True, True),
    ],
)
@pytest.mark.parametrize("goes_on", [True, False])
def test_only_logical_tags_stand_still_in_a_stopped_plc(pv, output, pulse, found, goes_on):
    extra = {"output.pulse": times(20)} if pulse else {}
    loop = changed(**{"pv.tag": pv, "output.tag": output, **extra})

    assert serious(loop, process_when_stopped=goes_on) == (["EZ410"] if found and goes_on else [])


def test_a_pv_that_another_loop_writes_moves_while_the_plc_is_stopped():
    writer, reader = changed(1, **{"output.tag": "R500", "output.pulse": times(20)}), changed(2, **{"pv.tag": "R500"})
    assert serious(writer, reader) == ["EZ413", "EZ413"], "a warning at both, and none about a PV that stands still"


@given(st.integers(0, 4095), st.integers(0, 4095), st.booleans())
def test_heating_above_cooling_is_found_whichever_loop_comes_first(heat, cool, cooling_first):
    actions = ["direct", "reverse"] if cooling_first else ["reverse", "direct"]
    values = {"reverse": heat, "direct": cool}
    loops = [
        changed(n, action=action, **{"pv.tag": "IR1", "setpoint.value": values[action]})
        for n, action in enumerate(actions, 1)
    ]

    assert ("EZ409" in codes(*loops)) == (heat > cool)


NAMES = st.one_of(
    st.sampled_from(["Oven", "OVEN", "oven_1", "1", "_A", "FIC-101", "Oven 2", "Ofen_ä"]),
    st.text("Aa1_ -", min_size=1, max_size=4).filter(lambda text: NAME.fullmatch(text) and "  " not in text),
)
TEMPLATES = st.sampled_from(["PID{loop}_{variable}", "{name}_{variable}", "{name}{variable}", "{variable}_{name}"])


@given(st.lists(NAMES, min_size=1, max_size=4, unique=True), TEMPLATES)
def test_a_tag_list_can_be_written_exactly_when_no_rule_of_names_finds_anything(names, template):
    result = checked(*(changed(n, name=name) for n, name in enumerate(names, 1)), tag_names=template)
    found = {d.code for d in result.findings} & {"EZ411", "EZ412"}

    if found:
        with pytest.raises(UnwritableError):
            make_tags(result.encoding.image)
    else:
        assert len(make_tags(result.encoding.image)) == len(names) * (len(VARIABLES) - 3)


def test_loops_are_numbered_from_1_in_the_tags_that_collide():
    """``A`` of loop 11 and ``A1`` of loop 1 have the same tags where the number follows the name."""
    names = ["A1", *(f"Zone {letter}" for letter in "BCDEFGHIJ"), "A"]
    loops = [
        changed(min(n, 10), name=name, registers=f"R{32 * n}", discretes=f"S{8 * n}") for n, name in enumerate(names, 1)
    ]
    found = [d for d in checked(*loops, tag_names="{name}{loop}_{variable}").findings if d.code == "EZ412"]

    assert sorted(d.message for d in found) == [
        "the tag A11_SampleRate of this loop is also one of loop A",
        "the tag A11_SampleRate of this loop is also one of loop A1",
    ]


# --- action ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "words",
    [
        "Oven 2",
        "OVEN2",
        "oven_2",
        "Pre-heater",
        "preheater",
        "TIC HEATER",
        "Heating zone",
        "kiln",
        "furnace",
        "burner",
    ],
)
def test_words_of_heating_want_reverse(words):
    assert serious(changed(description=words, action="direct")) == ["PID110"]
    assert serious(changed(description=words, action="reverse")) == []


@pytest.mark.parametrize("words", ["cooling", "Cooler", "chilled water", "cold store", "freezer", "air-conditioning"])
def test_words_of_cooling_want_direct(words):
    assert serious(changed(description=words, action="reverse")) == ["PID110"]
    assert serious(changed(description=words, action="direct")) == []


@pytest.mark.parametrize(
    "words",
    [
        "flow",
        "wheat",
        "cheater",
        "coolant",
        "cooling water heater",
        "heat exchanger",
        "oven exhaust fan",
        "heater, air-to-close valve",
        "cooling, normally open",
        "heater (fail open)",
        "inverse heater",
        "Provence",
        "scold",
    ],
)
@pytest.mark.parametrize("action", ["direct", "reverse"])
def test_other_words_tell_nothing_of_the_action(words, action):
    assert serious(changed(description=words, action=action)) == []


@pytest.mark.parametrize(
    ("unit", "found"),
    [
        ("degC", True),
        ("°C", True),
        ("C", True),
        ("degF", True),
        ("K", True),
        (None, True),
        ("bar", False),
        ("m3/h", False),
        ("%", False),
    ],
)
def test_only_temperatures_are_heated(unit, found):
    loop = changed(name="OVEN", action="direct", **({"pv.unit": unit} if unit else {}))

    assert serious(loop) == (["PID110"] if found else [])


# --- terms and set point ---------------------------------------------------------------------------------------------


@given(
    gain=st.sampled_from([0, 0.01, 1]),
    integral=st.sampled_from(["off", 0.1, 60]),
    derivative=st.sampled_from(["off", 0.1, 5]),
)
def test_every_set_of_terms_is_judged_once(gain, integral, derivative):
    terms = {"proportional_gain": gain, "integral_time": integral, "derivative_time": derivative}
    found = codes(changed(tuning=terms)) & {"EZ423", "EZ424", "EZ425"}
    on = gain != 0, integral != "off"

    assert found == {(False, False): {"EZ424"}, (False, True): {"EZ423"}, (True, False): {"EZ425"}}.get(on, set())


@given(st.integers(0, 4095), st.integers(0, 4095), st.integers(0, 4095))
def test_a_set_point_is_reported_exactly_when_its_limits_move_it(value, low, high):
    found = codes(changed(**{"setpoint.value": value, "setpoint.limits": [low, high]}))
    kept = min(max(value, low), high)
    zero = low == high == 0 and value != 0

    assert ("EZ435" in found) == (low > high)
    assert ("EZ436" in found) == zero
    assert ("EZ437" in found) == (low == high and not zero)
    assert ("EZ438" in found) == (low <= high and kept != value and not zero)


@given(st.integers(0, 4095), st.integers(0, 4095), st.integers(1, 4095))
def test_a_deadband_that_no_error_reaches_is_an_error(low, high, deadband):
    assume(0 < low <= high)
    found = [
        d.severity
        for d in findings(changed(deadband=deadband, **{"setpoint.limits": [low, high]}))
        if d.code == "EZ440"
    ]
    reached = any(abs(sp - pv) >= deadband for sp in (low, high) for pv in (0, 4095))

    assert found == ([Severity.WARNING if reached else Severity.ERROR] if deadband >= 410 or not reached else [])


def test_auto_without_a_set_point_names_what_the_loop_controls_to():
    loop = changed(mode="auto", **{"setpoint.limits": [20, 240], "pv.range": [0, 400], "pv.unit": "degC"})

    assert "controls to 20 degC" in next(d.message for d in findings(loop) if d.code == "EZ439")
    assert "EZ439" not in codes({**loop, "mode": "manual"})


# --- output ----------------------------------------------------------------------------------------------------------


@given(
    cycle=st.integers(1, 300),
    min_on=st.integers(0, 310),
    min_off=st.integers(0, 310),
    limits=st.tuples(st.integers(0, 4094), st.integers(1, 4095)).filter(lambda pair: pair[0] < pair[1]),
)
def test_rules_of_pulses_agree_with_the_virtual_control_output(cycle, min_on, min_off, limits):
    low, high = limits
    given_times = {"cycle_time": cycle / 10, "min_on": min_on / 10, "min_off": min_off / 10}
    found = codes(changed(**{"output.limits": [low, high], "output.pulse": {"tag": "O1", **given_times}}))
    ons = [on_time(cv, cycle, min_on, min_off) for cv in range(low, high + 1)]
    never_on, never_off = all(on <= 0 for on in ons), all(on >= cycle for on in ons)
    between = any(0 < on < cycle for on in ons)
    sound = between and not never_on and not never_off

    assert ("EZ467" in found) == never_on
    assert ("EZ468" in found) == never_off
    assert ("EZ466" in found) == (not between and not never_on and not never_off)
    assert ("EZ469" in found) == (sound and low > 0 and ons[0] <= 0)
    assert ("EZ470" in found) == (sound and high < 4095 and ons[-1] >= cycle)


def on_time(cv, cycle, min_on, min_off):
    """The on-time of the virtual controller, in tenths of a second: its clock counts them."""
    config, state = Config(), State()
    config.cycle, config.min_on, config.min_off = cycle, min_on, min_off
    state.out = float(cv)
    begin_cycle(0, config, state)
    return state.on_time


def test_a_low_limit_whose_pulses_are_left_out_does_not_keep_the_output_on():
    limits = {"output.limits": [1024, 4095]}

    assert "EZ457" in codes(changed(**limits, **{"output.pulse": times(20, min_on=5)}))
    assert "EZ457" not in codes(changed(**limits, **{"output.pulse": times(20, min_on=5.1)}))


@given(st.integers(0, 4095), st.integers(101, 4095), st.booleans(), st.booleans())
def test_anti_windup_and_limits(low, high, anti_windup, integral):
    assume(low < high)
    tuning = {**P_ONLY, "integral_time": 60 if integral else 0}
    given_too = {"output.limits": [low, high], "autotune.type": "PID"}
    found = codes(changed(anti_windup=anti_windup, tuning=tuning, **given_too))

    assert ("EZ456" in found) == (integral and anti_windup and (low, high) != (0, 4095))
    assert ("EZ460" in found) == (integral and not anti_windup)
    assert ("EZ484" in found) == (low + 410 > high)


def test_the_step_of_the_autotune_is_that_of_the_virtual_controller():
    assert autotune.TENTH_OF_CV == STEP_COUNTS


def test_limits_in_counts_or_with_a_range_are_no_percentages():
    assert "EZ461" not in codes(changed(**{"output.limits": [0, "100 counts"]}))
    assert "EZ461" not in codes(changed(**{"output.limits": [0, 100], "output.range": [0, 100]}))


# --- all of them -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "name",
    [
        "src/pidcfg/cli/starters/ezlogix",
        "examples/ezlogix/oven",
        "examples/ezlogix/coldstore",
        "examples/ezlogix/dosing",
        "examples/ezlogix/greenhouse",
    ],
)
def test_starter_and_examples_have_neither_errors_nor_warnings(name):
    text = (ROOT / f"{name}.yaml").read_bytes()

    assert [d.code for d in check_document(read_document(text, name)).findings if d.severity > Severity.INFO] == []


def test_an_oven_with_its_action_swapped_is_a_warning():
    text = (
        (ROOT / "src/pidcfg/cli/starters/ezlogix.yaml").read_text("utf-8").replace("action: reverse", "action: direct")
    )

    assert [d.code for d in check_document(read_document(text.encode(), "oven.yaml")).findings] == ["PID110"]


def test_decisions_of_rules_have_numbers_of_their_own():
    decisions = {
        rule.basis for rule in RULES.values() if isinstance(rule.basis, Decision) and rule.code.startswith(OWN)
    }
    own = sorted(decision.number for decision in decisions if decision.number >= 180)
    first = [number for number in own if number < 200]

    assert first == [number for number in range(180, 181 + len(first)) if number != 183]
    assert own[len(first) :] == [621, 622]


def test_a_vendor_with_one_chapter_has_more_than_fifty_rules():
    assert sum(code.startswith(OWN) for code in RULES) >= 55


@given(
    st.decimals("-10000", "10000", places=3),
    st.sampled_from(
        [
            "sample_rate",
            "setpoint.value",
            "tuning.proportional_gain",
            "tuning.integral_time",
            "tuning.derivative_time",
            "deadband",
            "output.offset",
            "output.pulse.cycle_time",
            "output.pulse.min_on",
            "output.pulse.min_off",
        ]
    ),
)
def test_no_number_makes_a_rule_fail(value, key):
    assume(value >= 0 or key in {"setpoint.value", "deadband", "output.offset"})
    whole = changed(**{"output.pulse": times(20, min_on=1, min_off=1), "pv.range": [-50, 400], key: Decimal(value)})

    assert checked(whole).encoding is not None


def test_nothing_is_said_about_an_autotune_that_the_file_does_not_speak_of():
    faults = {
        "EZ481": {"tuning.integral_time": 601},
        "EZ482": {"sample_rate": 16},
        "EZ484": {"output.limits": [1000, 1400]},
        "EZ485": {},
    }
    for code, values in faults.items():
        assert code not in codes(changed(**values))
        assert code in codes(changed(**values, **{"autotune.type": "PID"}))


@pytest.mark.parametrize(
    ("counts", "cure"),
    [
        ([-2000, 2000], "let the ladder program add 2000 to the measurement, and write [0, 4000]"),
        ([-1, 65534], "let the ladder program add 1 to the measurement, and write [0, 65535]"),
        ([-2, 65534], "let the ladder program scale the measurement"),
        ([0, 65536], "let the ladder program scale the measurement"),
        ([4095, 0], "write the lower end first; a signal that falls as the PV rises is for the ladder program"),
    ],
)
def test_counts_that_no_register_holds_are_told_what_to_do_and_never_another_scale(counts, cure):
    text = json.dumps({"pidcfg": 1, "vendor": "ezlogix", "loops": [changed(**{"pv.counts": counts})]})
    (found,) = check_document(read_document(text.encode(), "case.yaml")).findings
    assert (found.code, found.where) == ("PID034", "loops[0].pv.counts")
    assert found.help.startswith(cure)


def test_a_cycle_is_not_held_against_the_times_of_the_dialog():
    pulse = {"output.pulse": {"tag": "O1", "cycle_time": 20}, "sample_rate": 0.1}
    assert "EZ472" in codes(changed(**pulse, **{"tuning.integral_time": 0.4}))
    at_defaults = {"tuning.integral_time": 0.3, "tuning.derivative_time": 0.3}
    assert {"EZ428", "EZ472"} & codes(changed(**pulse, **at_defaults)) == {"EZ428"}


def test_a_cv_that_is_written_over_the_loops_own_set_point_is_no_cascade():
    own = f"R{1 + R_BLOCK.offset_of('setpoint')}"

    assert [d.code for d in findings(changed(**{"output.tag": own})) if d.code in {"EZ404", "EZ405"}] == ["EZ404"]
    assert "EZ439" in codes(changed(mode="auto", **{"output.tag": own}))


def test_a_root_of_counts_from_zero_leaves_the_set_point_to_the_rule_for_its_word():
    found = [
        codes(changed(**{"pv.square_root": True, "pv.counts": [low, 4095], "setpoint.value": 100})) for low in (0, 100)
    ]

    assert [{"PID102", "EZ446"} & each for each in found] == [{"PID102"}, {"EZ446"}]


def test_counts_of_the_pv_in_a_square_root_loop_are_told_the_root():
    root = {"pv.square_root": True}
    bare, scaled = (
        next(d for d in findings(changed(**root, **{"setpoint.value": value}, **more)) if d.code == "PID102")
        for value, more in ((2000, {}), ("2000 counts", {"pv.range": [0, 100]}))
    )

    assert bare.help.endswith("write 45 for a PV of 2000, or give `pv.range`, which converts values")
    assert scaled.help.endswith("write 45 for a PV of 2000 counts, or write it in the unit of `pv.range`")
    assert "PID102" not in codes(changed(**root, **{"setpoint.value": 45}))
    assert "PID102" not in codes(changed(**root, **{"setpoint.value": 50, "pv.range": [0, 100]}))


def test_more_counts_are_no_cure_of_a_negative_value():
    (found,) = [d for d in findings(changed(**{"setpoint.value": -1})) if d.code == "PID102"]

    assert found.help == "write a value that the word holds"


def test_a_value_beyond_4095_names_the_key_that_says_more_counts():
    bare, scaled = (
        next(d for d in findings(changed(**{"setpoint.value": 5500, **more})) if d.code == "PID102")
        for more in ({}, {"pv.range": [0, 100]})
    )
    (output,) = [d for d in findings(changed(**{"output.offset": 5000})) if d.code == "PID102"]

    assert bare.help.endswith("or set `pv.counts`, what the register of the PV holds at both ends: at most [0, 65535]")
    assert "or set `pv.range` or `pv.counts`, " in scaled.help
    assert output.help == "write a value that the word holds"
    assert "data format" not in bare.help + scaled.help + output.help
    assert "PID102" not in codes(changed(**{"setpoint.value": 5500, "pv.counts": [0, 65535]}))
