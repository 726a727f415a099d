"""Delta AS rules at their limits, against the virtual instruction, and on files from outside."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings

from dpide_strategies import configurations
from pidcfg.encoders.dpide.files import FORMATS
from pidcfg.encoders.dpide.image import encode
from pidcfg.encoders.listing import UnwritableError
from pidcfg.schemas.dpide import DpideFile
from pidcfg.sim.controllers.dpide.scan import load
from pidcfg.text.diagnostics import Severity
from pidcfg.text.references import Decision
from pidcfg.text.source import read_document
from pidcfg.text.writer import yaml_text
from pidcfg.validate.engine import check_document
from pidcfg.validate.rules.dpide import RULES
from pidcfg.validate.rules.dpide.tuning import DpideContext
from pidcfg.validate.shared_checks import D955

ROOT = Path(__file__).parents[1]
LOOP = {
    "name": "L1",
    "device": "D500",
    "SV": 80,
    "CYCLE": 1000,
    "Kc_Kp": 12,
    "Ti_Ki": 180,
    "Td_Kd": 0,
    "PID_EQ": True,
    "PID_DIR": True,
    "MV_MAX": 4000,
    "MV_MIN": 0,
}


def findings(*loops: dict, **file):
    """The findings of a file of some loops, each a plain one with some keys changed."""
    entries = [{**LOOP, "name": f"L{i}", "device": f"D{500 + 30 * i}", **loop} for i, loop in enumerate(loops, start=1)]
    data = {"pidcfg": 1, "vendor": "dpide", **file, "loops": entries}
    checked = check_document(read_document(yaml_text(data).encode(), "loops.yaml"))
    return (*checked.findings, *checked.to_check)


def codes(*loops: dict, least: Severity = Severity.INFO, **file) -> list[str]:
    """Their codes."""
    return sorted(d.code for d in findings(*loops, **file) if d.severity >= least)


def dpide(**changes):
    """The virtual PLC of one plain loop with some keys changed, and the loop's number."""
    data = {"pidcfg": 1, "vendor": "dpide", "loops": [{**LOOP, **changes}]}
    return load(encode(DpideFile.model_validate(data)).image)


def test_a_plain_loop_has_no_finding():
    assert codes({}) == []


@pytest.mark.parametrize(
    "name",
    [
        "src/pidcfg/cli/starters/dpide",
        "examples/dpide/oven",
        "examples/dpide/chiller",
        "examples/dpide/dryer",
        "examples/dpide/dyeing",
    ],
)
def test_starter_and_examples_have_neither_errors_nor_warnings(name):
    checked = check_document(read_document((ROOT / f"{name}.yaml").read_bytes(), name))

    assert [d.code for d in checked.findings if d.severity > Severity.INFO] == []
    assert FORMATS["symbols"].write(checked.encoding.image, ())


@pytest.mark.parametrize(
    ("start", "found"), [(529, ["DP702"]), (530, []), (471, ["DP702"]), (470, []), (500, ["DP702"])]
)
def test_blocks_need_30_registers_between_their_starts(start, found):
    assert codes({"device": "D500"}, {"device": f"D{start}"}) == found * 2, "at both loops"


@pytest.mark.parametrize(("device", "found"), [("D499", ["DP702"]), ("D498", []), ("D529", ["DP702"]), ("D530", [])])
def test_a_number_needs_two_registers_outside_the_block(device, found):
    assert codes({"device": "D500", "devices": {"BIAS": device}}) == found


@pytest.mark.parametrize(
    ("bit", "found"), [("D499.15", []), ("D500.0", ["DP702"]), ("D529.15", ["DP702"]), ("M500", [])]
)
def test_a_bit_of_the_block_is_part_of_it(bit, found):
    assert codes({"device": "D500", "devices": {"PID_RUN": bit}}) == found


@pytest.mark.parametrize(
    ("first", "second", "found"),
    [
        ({"SV": "D0"}, {"SV": "D0"}, []),
        ({"SV": "D0"}, {"SV": "D1"}, ["DP703"]),
        ({"SV": "D0"}, {"SV": "D2"}, []),
        ({"PID_RUN": "M1"}, {"PID_RUN": "M1"}, []),
        ({"PID_RUN": "M1"}, {"PID_EQ": "M1", "PID_RUN": "M2"}, []),
        ({"PID_RUN": "M1"}, {"PID_DE": "M1"}, ["DP703"]),
        ({"PID_EQ": "D9.1"}, {"SV": "D8"}, ["DP703"]),
        ({"PID_EQ": "D9.1"}, {"SV": "D10"}, []),
        ({"MV": "D0"}, {"SV": "D0"}, []),
        ({"MV": "D0"}, {"BIAS": "D0"}, []),
        ({"SV": "D0"}, {"MV": "D0"}, []),
        ({"MV": "D0"}, {"PV": "D0"}, ["DP703"]),
        ({"PV": "D0"}, {"MV": "D0"}, ["DP703"]),
        ({"PV": "D0", "MV": "D0"}, {}, ["DP703"]),
        ({"PV": "D0"}, {"PV": "D0"}, []),
        ({"MV": "D0"}, {"MV": "D0"}, ["DP703"]),
        ({"MV": "D0"}, {"Ti_Ki": "D0"}, ["DP703"]),
        ({"MV": "D0", "MOUT": "D0"}, {}, []),
        ({"MV": "D0", "SV": "D0"}, {}, ["DP703"]),
        ({"PID_MODE": "D0"}, {"CYCLE": "D0"}, ["DP703"]),
        ({"MOUT": "D0"}, {"BIAS": "D0"}, []),
    ],
)
def test_devices_may_be_shared_where_they_can_hold_both(first, second, found):
    assert codes({"devices": first}, {"devices": second}) == found * (2 if second else 1), "at each loop"


TUNED = [
    ("PID_MODE", "are both written"),
    ("Kc_Kp", "are both written"),
    ("Ti_Ki", "are both written"),
    ("Td_Kd", "are both written"),
    ("Tf", "are both written"),
]


def collisions(*loops: dict) -> list[str]:
    """The ends of the messages of DP703, which stand at each of the loops."""
    found = [d for d in findings(*loops) if d.code == "DP703"]
    names = [f"L{i}" for i in range(1, len(loops) + 1)]
    assert [d.loop for d in found] == names * (len(found) // len(names))
    return [d.message.rpartition(" to D1 ")[2] for d in found[:: len(names)]]


@pytest.mark.parametrize(("operand", "reason"), TUNED)
def test_two_loops_that_tune_do_not_share_what_the_autotune_writes(operand, reason):
    tuning = {"PID_MODE": 1, "devices": {"PID_MODE": "D2", operand: "D0"}}
    other = {**tuning, "devices": {"PID_MODE": "D4", operand: "D0"}}
    later = {"devices": other["devices"]}

    assert collisions(tuning, other) == [reason]
    assert collisions(later, {"devices": tuning["devices"]}) == [reason]
    assert collisions({"devices": {operand: "D0"}}, {**tuning, "devices": {operand: "D0"}}) == (
        [reason] if operand == "PID_MODE" else [f"would be an operand that {operand} overwrites"]
    )


@pytest.mark.parametrize("operand", ["Kc_Kp", "Ti_Ki", "Td_Kd", "Tf", "MOUT"])
def test_loops_that_cannot_tune_or_follow_share_what_they_only_read(operand):
    assert collisions({"devices": {operand: "D0"}}, {"devices": {operand: "D0"}}) == []


@pytest.mark.parametrize("switch", [{"MOUT_AUTO": True}, {"devices": {"MOUT_AUTO": "M1"}}])
def test_a_mout_that_follows_mv_is_alone_in_its_device(switch):
    follows, reads = ({**given, "devices": {**given.get("devices", {}), "MOUT": "D0"}} for given in (switch, {}))

    assert collisions(follows, follows) == ["are both written"]
    assert collisions(follows, reads) == collisions(reads, follows) == ["would be an operand that MOUT overwrites"]
    assert collisions({"devices": {"MV": "D0"}}, follows) == ["are both written"]
    assert collisions({**follows, "devices": {**follows["devices"], "MV": "D0"}}) == []
    assert collisions(follows, {"MV_MIN": 0, "devices": {"BIAS": "D0"}}) == ["would be an operand that MOUT overwrites"]


def test_a_mout_in_its_own_mv_is_that_mv_for_other_loops_and_for_the_change_to_manual():
    own = {"MV": "D0", "MOUT": "D0"}

    assert collisions({"devices": own}, {"devices": {"SV": "D0"}}) == []
    assert collisions({"devices": own}, {"devices": own}) == ["are both written"]
    assert collisions({"devices": own}, {"devices": {"MV_MAX": "D0"}}) == ["would be an operand that MV overwrites"]
    for devices, found in (
        (own, []),
        ({**own, "MOUT": "D2"}, ["DP719"]),
        ({"MV": "D0"}, ["DP719"]),
        ({}, ["DP719"]),
    ):
        assert codes({"PID_MODE": 2, "devices": {**devices, "PID_MAN": "M0"}}) == found


def test_two_tuned_operands_of_one_loop_need_two_devices():
    devices = {"PID_MODE": "D2", "Ti_Ki": "D0", "Td_Kd": "D0"}

    assert collisions({"Td_Kd": 180, "devices": devices}) == ["are both written"]
    assert collisions({"Td_Kd": 180, "devices": {k: v for k, v in devices.items() if k != "PID_MODE"}}) == []


@pytest.mark.parametrize(("limits", "found"), [((100, 0), ["DP741"]), ((50, 50), ["DP742"]), ((0, 100), [])])
def test_limits_are_swapped_equal_or_right(limits, found):
    assert codes({"MV_MIN": limits[0], "MV_MAX": limits[1]}) == found


def test_swapped_limits_are_those_that_the_virtual_instruction_uses():
    message = next(d.message for d in findings({"MV_MIN": 100, "MV_MAX": 20, "MOUT": 50}) if d.code == "DP741")
    config = dpide(MV_MIN=100, MV_MAX=20).configs[0]

    assert "MV goes from 20 to 100" in message
    assert (config.lowest_mv, config.highest_mv) == (20.0, 100.0)


@pytest.mark.parametrize(("cycle", "used"), [(0, 1), (-5, 1), (40_001, 40_000), (2_000_000_000, 40_000)])
def test_the_sampling_time_that_a_finding_names_is_the_virtual_instructions(cycle, used):
    message = next(d.message for d in findings({"CYCLE": cycle}) if d.code == "DP731")

    assert message.endswith(f"as {used} ms")
    assert dpide(CYCLE=cycle).states[0].sampling_time == pytest.approx(used / 1000)


@pytest.mark.parametrize("operand", ["Kc_Kp", "Ti_Ki", "Td_Kd", "Tf"])
def test_coefficients_below_0_act_as_0_in_the_virtual_instruction(operand):
    below, zero = (dpide(**{operand: value, "PID_EQ": False}) for value in (-3, 0))

    assert "DP713" in codes({operand: -3, "PID_EQ": False})
    assert "DP713" not in codes({operand: 0, "PID_EQ": False})
    for name in ("kp", "ki", "kd", "filter_share"):
        assert getattr(below.states[0], name) == getattr(zero.states[0], name)


def test_a_dead_controller_is_told_once():
    assert codes({"Kc_Kp": 0}) == ["DP711"]
    assert codes({"Kc_Kp": -1, "Ti_Ki": 0, "PID_EQ": False}) == ["DP712"]
    assert codes({"Kc_Kp": -1, "Ti_Ki": 0.1, "PID_EQ": False}) == ["DP713"]


def test_a_time_in_the_independent_form_is_an_error_and_a_bare_one_that_is_too_fast_a_warning():
    assert codes({"Ti_Ki": "180 s", "PID_EQ": False}) == ["DP715"]
    assert codes({"Ti_Ki": 180, "PID_EQ": False}) == ["DP716"]
    assert codes({"Ti_Ki": "180 s"}) == []


def test_a_derivative_time_in_the_independent_form_is_a_warning():
    independent = {"Ti_Ki": 0.1, "Td_Kd": "200 s", "Tf": "2 s", "PID_DE": True, "PID_EQ": False}
    (found,) = findings(independent)

    assert (found.code, found.severity) == ("DP715", Severity.WARNING)
    assert found.message.endswith("with PID_EQ FALSE it is the gain Kd: Kp times the derivative time in s")
    assert codes({**independent, "Td_Kd": 200}) == []
    assert codes({**independent, "Ti_Ki": 180, "Td_Kd": "20 s", "PID_EQ": True}) == []
    both = [d.severity for d in findings({**independent, "Ti_Ki": "180 s"}) if d.code == "DP715"]
    assert both == [Severity.ERROR, Severity.WARNING]


def test_what_is_not_given_is_told_for_direction_and_form():
    loop = {key: value for key, value in LOOP.items() if key not in {"PID_EQ", "PID_DIR"}} | {"Ti_Ki": 0.01}
    data = {"pidcfg": 1, "vendor": "dpide", "loops": [loop]}
    found = check_document(read_document(yaml_text(data).encode(), "x.yaml")).findings

    assert [d.code for d in found] == ["DP781", "DP781"]
    assert {d.span.line for d in found} == {4}


@pytest.mark.parametrize(
    ("forward", "name", "found"),
    [
        (True, "OVEN", []),
        (False, "OVEN", ["PID110"]),
        (True, "CHILLER", ["PID110"]),
        (False, "CHILLER", []),
        (False, "LOOP", []),
        (True, "LOOP", []),
    ],
)
def test_the_direction_goes_with_the_name(forward, name, found):
    assert codes({"PID_DIR": forward, "name": name}) == found


def test_the_direction_that_rules_call_heating_is_that_of_the_virtual_instruction():
    for forward, word in ((True, "heating"), (False, "cooling")):
        plc = dpide(PID_DIR=forward)
        assert plc.output_raises_pv == [forward]
        other = next(
            d.message
            for d in findings({"name": "OVEN" if word == "heating" else "CHILLER", "PID_DIR": not forward})
            if d.code == "PID110"
        )
        assert f"({word}), which needs PID_DIR: {str(forward).lower()}" in other


def test_an_interrupt_task_replaces_cycle_for_the_rules_too():
    assert codes({"CYCLE": 50_000}, plc={"interrupt_task": 100}) == ["DP732"]
    assert codes({"CYCLE": 100}, plc={"interrupt_task": 100}) == []
    assert "DP716" in codes({"Ti_Ki": 2, "CYCLE": 5000}, plc={"interrupt_task": 5000})
    assert "DP716" not in codes({"Ti_Ki": 2, "CYCLE": 5000}, plc={"interrupt_task": 1000})
    assert codes({"CYCLE": 1000}, plc={"interrupt_task": 0}) == ["DP732", "PID101"]


def test_the_derivative_of_the_error_kicks_and_that_of_the_pv_does_not():
    assert codes({"Td_Kd": 10, "Tf": 1}) == ["DP725"]
    assert codes({"Td_Kd": 10, "Tf": 1, "PID_DE": True}) == []
    kick, jump = (
        next(d.message for d in findings({"Td_Kd": 10, "Tf": 1, "PID_DE": de, "ERR_DBW": 2}) if d.code == "DP763")
        for de in (False, True)
    )
    assert "derivative kicks" in kick
    assert "derivative" not in jump


@pytest.mark.parametrize("key", ["SV", "BIAS", "MV_MAX", "ERR_DBW", "Ti_Ki"])
def test_a_number_that_no_real_holds_is_an_error_and_nothing_worse(key):
    assert "its word holds -3.40282e+38 to 3.40282e+38" in next(
        d.message for d in findings({key: 1e200}) if d.code == "PID102"
    )
    assert "PID103" in codes({key: 1e-60})


def test_a_number_just_beyond_the_largest_real_is_told_in_digits_that_differ():
    found = [d.message for d in findings({"SV": 3.4028236e38}) if d.code == "PID102"]

    assert found == ["SV is 3.40282360e+38, but its word holds -3.40282347e+38 to 3.40282347e+38"]


def test_a_double_integer_that_is_too_large_is_an_error():
    assert "PID102" in codes({"CYCLE": 10**12})
    assert "PID102" in codes({"PID_MODE": 2**31})


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(configurations())
def test_rules_judge_any_configuration_and_symbols_are_written_when_they_say_so(config):
    encoding = encode(config)
    context = DpideContext(config, encoding)
    found = {code: list(rule.check(context)) for code, rule in RULES.items()}
    try:
        FORMATS["symbols"].write(encoding.image, ())
    except UnwritableError:
        assert found["DP771"] or found["DP772"]
    else:
        assert not found["DP771"]
        assert not found["DP772"]
    for code, entries in found.items():
        for entry in entries:
            assert RULES[code].fields <= set(entry.values), code


def test_decisions_of_rules_have_numbers_of_their_own():
    numbers = {r.basis.number for code, r in RULES.items() if code.startswith("DP") and isinstance(r.basis, Decision)}

    assert numbers
    assert all(250 <= number <= 279 or 600 <= number <= 619 for number in numbers - {D955.number})


TERMS = {"DP711", "DP712", "DP713", "DP714", "DP717"}


@pytest.mark.parametrize(
    ("loop", "code"),
    [
        ({"Kc_Kp": 0}, "DP711"),
        ({"Kc_Kp": 0, "Ti_Ki": 0, "PID_EQ": False}, "DP712"),
        ({"Ti_Ki": 0}, "DP714"),
        ({"Kc_Kp": 0, "Ti_Ki": 0.1, "PID_EQ": False}, "DP717"),
    ],
)
def test_terms_that_are_off_are_told_unless_the_autotune_replaces_them(loop, code):
    assert TERMS & {d.code for d in findings(loop)} == {code}
    assert not TERMS & {d.code for d in findings({**loop, "PID_MODE": 1})}


@pytest.mark.parametrize(
    ("loop", "code"),
    [
        ({"Kc_Kp": 0, "Ti_Ki": 0}, "DP711"),
        ({"Kc_Kp": -1}, "DP711"),
        ({"Kc_Kp": 0, "Ti_Ki": 0, "PID_EQ": False}, "DP712"),
        ({"Kc_Kp": 1e39, "Ti_Ki": 0, "PID_EQ": False}, "DP714"),
        ({"Kc_Kp": 1e39}, None),
    ],
)
def test_a_term_that_is_off_is_told_once(loop, code):
    """1e39 fits no REAL: whether it is 0 cannot be said."""
    assert TERMS & {d.code for d in findings(loop)} == ({code} if code else set())


@pytest.mark.parametrize(("low", "high", "found"), [(-4000, -1, 1), (-4000, 0, 0), (0, 4000, 0), (1, 4000, 1)])
def test_the_zero_of_a_stopped_loop_may_be_one_of_its_limits(low, high, found):
    assert codes({"MV_MIN": low, "MV_MAX": high}).count("DP746") == found


@pytest.mark.parametrize("mode", [0, 2])
@pytest.mark.parametrize("integral", [0, 0.5, 1, 60])
@pytest.mark.parametrize("bias", [0, 9.9, 10, 100, 100.1])
def test_a_bias_outside_the_limits_is_told_where_no_integral_takes_it_up(mode, integral, bias):
    loop = {"PID_MODE": mode, "Ti_Ki": integral, "BIAS": bias, "MV_MIN": 10, "MV_MAX": 100}
    loop |= {"devices": {"MV": "D232", "PV": "D234"}}
    is_taken_up = mode == 2 and integral > 0
    assert ("DP744" in codes(loop)) == (not 10 <= bias <= 100 and not is_taken_up)
