"""What every report of a conversion must be: a line for every field, exact lines that are, losses with their limits."""

from __future__ import annotations

import copy
import json
import math
import re
from dataclasses import replace
from decimal import Decimal
from functools import reduce
from itertools import permutations, product
from pathlib import Path
from types import SimpleNamespace

import pytest
from pydantic import ValidationError
from ruamel.yaml import YAML

import test_convert_click
import test_convert_dl06
import test_convert_dpide
import test_convert_ezlogix
import test_convert_nextopid
from conversion_measure import PAIRS, measure, unspoken
from nested import merged
from neutral_strategies import EVERYTHING
from pidcfg import api
from pidcfg.cli.formats import conversion as formats
from pidcfg.cli.main import main
from pidcfg.conversion import Change, MaxLoss, MaxLossError, json_value, judge_change, parse_max_loss, text_of
from pidcfg.conversion.builder import correct_lines
from pidcfg.conversion.operation import (
    KICK_NOTE,
    OVERSHOOT_ADVICE,
    Deadband,
    Filter,
    Hand,
    Interlock,
    Manual,
    Master,
    Operation,
    Rate,
    Smoothing,
    Start,
    Stopped,
    Transfer,
    Windup,
    WithoutIntegral,
    Zero,
    differing_rules,
)
from pidcfg.conversion.pipeline import (
    FIRST_OUTPUT_NOTE,
    UNKNOWN_FIELD_NOTE,
    convert,
    path_in_file,
    unreported_fields,
    unreported_items,
)
from pidcfg.schemas.generic import GenericFile
from pidcfg.text.paths import leaves, parse_path, set_value, value_at
from pidcfg.text.writer import yaml_text
from pidcfg.vendors import VENDORS
from standing_rig import SIDES

OVEN = {
    "name": "TIC1",
    "output_raises_pv": True,
    "sample_time": 0.5,
    "tuning": {"gain": 2.5, "integral_time": 60},
    "pv": {"range": [0, 400], "unit": "degC"},
    "setpoint": {"value": 180},
    "output": {"range": [0, 100], "unit": "%"},
}
PIDA = {
    "type": "PIDA_REAL",
    "SP": 50,
    "Kp": 2,
    "Ti_Ki": 30,
    "Td_Kd": 0,
    "MinMV": 0,
    "MaxMV": 100,
    "MinPV": 0,
    "MaxPV": 200,
}
ON_OFF = {"name": "FAN", "type": "ControlON_OFF", "SP": 50, "DeadBand": 2, "MinPV": 0, "MaxPV": 100}


def file_of(vendor, *loops, **sections):
    """A file as text."""
    return yaml_text({"pidcfg": 1, "vendor": vendor, **sections, "loops": list(loops)})


def oven(**changed):
    """A neutral file of one loop as text."""
    return file_of("generic", {**OVEN, **changed})


def lines_of(result, i=0):
    """The lines of a loop by field, the gravest of each."""
    return {row.field: row for row in sorted(result.loops[i].changes, key=lambda row: row.loss)}


def converted(source, vendor, target, **options):
    """A conversion of a model."""
    return convert(source, VENDORS[vendor], VENDORS[target], {}, **options)


# --- a line for every field ------------------------------------------------------------------------------------------

NEXTOPID = {
    "SP_CASC": 60, "PV": 3, "Tfd": 1, "BIAS": 2, "ManualMV": 20, "TRK_VAL": 5, "MaxVarMV": 1, "DeadBand": 1,
    "Indep": True, "DisableP": True, "DerivEr": True, "CASC": True, "TRK_IN": True, "Windup_H_IN": True,
    "Windup_L_IN": True, "OVERR": True, "Manual": True, "Direct": True, "description": "Oven", "sample_time": 0.5,
    "pv": {"unit": "C"}, "output": {"range": [0, 100], "unit": "%"}, "Td_Kd": 3, "AutoTune": True,
    "AutoTuneParam": {"PercAmpMV": 1, "PercHystPV": 1, "PercMaxPeakPV": 1, "NumCycles": 2, "Mode": "PI"},
}  # fmt: skip
CASES = {
    "click": (test_convert_click.click, test_convert_click.PLAIN, test_convert_click.EVERYTHING),
    "dl06": (test_convert_dl06.dl06, test_convert_dl06.LOOP, test_convert_dl06.EVERYTHING),
    "ezlogix": (test_convert_ezlogix.ezlogix, test_convert_ezlogix.PLAIN, test_convert_ezlogix.EVERYTHING),
    "dpide": (test_convert_dpide.dpide, test_convert_dpide.LOOP, test_convert_dpide.FULL),
    "nextopid": (test_convert_nextopid.nextopid, {**test_convert_nextopid.LOOP, "type": "PIDA_TUNE_REAL"}, NEXTOPID),
    "generic": (
        lambda *loops: GenericFile.model_validate({"pidcfg": 1, "vendor": "generic", "loops": loops}),
        OVEN,
        EVERYTHING,
    ),
}
"""Of each vendor: what makes a file of loops, a plain loop, and a loop with every field."""
TOGETHER = 7
"""Loops of one file: a DL06 has eight."""


def alone(vendor):
    """The plain loop with each field set alone; a field that needs its neighbours comes with its section."""
    file, plain, everything = CASES[vendor]
    for path, value, _ in leaves(everything):
        if path[0] in {"name", "registers", "discretes", "bits", "integers", "floats", "device"}:
            continue
        loop = copy.deepcopy(plain)
        set_value(loop, path, value)
        try:
            file(loop)
        except ValidationError:
            loop[path[0]] = {**loop.get(path[0], {}), **everything[path[0]]}
        yield ".".join(path), loop


def exact_lines(result):
    """The exact lines that name a key of the result: that key, its value in the file, and what the line says of it."""
    for j, i in enumerate(result.source_loops):
        for row in result.loops[i].changes:
            if row.kind == "exact" and row.target_field:
                held = value_at(result.data, path_in_file(j, row.target_field))
                yield row.target_field, json_value(held), json_value(row.target)


@pytest.mark.parametrize("source", CASES)
def test_every_field_of_each_source_has_a_line_in_all_targets(source):
    file, cases = CASES[source][0], list(alone(source))
    assert len(cases) > 15
    for start in range(0, len(cases), TOGETHER):
        some = cases[start : start + TOGETHER]
        config = file(*({**loop, "name": f"L{i}"} for i, (_, loop) in enumerate(some, start=1)))
        for target in VENDORS:
            if target != source:
                result = converted(config, source, target)
                silent = {
                    some[i][0]: paths
                    for i in result.source_loops
                    if (paths := unspoken(config, i, result.loops[i].changes))
                }
                assert silent == {}, target
                unknown = [row.field for loop in result.loops for row in loop.changes if row.note == UNKNOWN_FIELD_NOTE]
                assert unknown == [], target
                assert [row for row in exact_lines(result) if row[1] != row[2]] == [], target


def keys(vendor):
    """The keys of a vendor's loop and its sections, with the ends of what has two."""
    paths = [path for loop in CASES[vendor][1:] for path, _, _ in leaves(loop)]
    return {".".join(map(str, path[:n])) for path in paths for n in range(1, len(path) + 1)} | {
        f"{'.'.join(map(str, path))}.{end}" for path in paths for end in (0, 1)
    }


@pytest.mark.parametrize("source", CASES)
def test_each_line_of_a_source_has_the_value_of_its_key_and_names_neutral_ones(source):
    config = CASES[source][0](*({**loop, "name": f"L{i}"} for i, (_, loop) in enumerate(alone(source))))
    loops = VENDORS[source].load("to_neutral")(config)
    for loop, given in zip(loops, config.loops, strict=True):
        for field in loop.fields:
            value = value_at(given, parse_path(field.path))
            if isinstance(value, bool | int | str | Decimal) and field.path not in {"sample_rate", "remote_setpoint"}:
                assert str(field.value) == str(value), field.path
    fields = [field for loop in loops for field in loop.fields]
    assert {field.path for field in fields} - keys(source) <= {"plc.derivative", "plc.sample_time"}
    assert {name for field in fields for name in field.neutral} <= keys("generic")


@pytest.mark.parametrize("target", CASES)
def test_each_line_of_a_target_is_about_its_keys_and_neutral_ones(target):
    loops = [{**loop, "name": f"L{i}"} for i, (_, loop) in enumerate(alone("generic"))]
    for start in range(0, len(loops), TOGETHER):
        made = VENDORS[target].load("from_neutral")(CASES["generic"][0](*loops[start : start + TOGETHER]), {})
        fields = [field for loop in made.fields for field in loop]
        own = {field.path for field in fields if field.path and field.path != field.neutral and field.path[0] != "/"}
        assert own <= keys(target)
        assert {field.neutral for field in fields} - {None} <= keys("generic")


OFF = {
    "deadband", "error.deadband", "alarms.hysteresis", "pv.square_root", "output.pulse.min_on", "output.pulse.min_off",
    "Tfd", "BIAS", "DeadBand",
}  # fmt: skip


@pytest.mark.parametrize("target", ["click", "dl06", "ezlogix", "nextopid"])
def test_what_a_loop_does_not_use_is_not_written(target):
    off = {"deadband": 0, "alarms": {"hysteresis": 0}, "pv": {**OVEN["pv"], "square_root": False}}
    off["tuning"] = {**OVEN["tuning"], "derivative_filter": 0}
    off["output"] = {**OVEN["output"], "pulse": {"period": 10, "min_on": 0, "min_off": 0}}
    config = CASES["generic"][0](OVEN, {**OVEN, "name": "TIC2", **off})
    for loop in VENDORS[target].load("from_neutral")(config, {}).data["loops"]:
        assert not OFF & {".".join(map(str, path)) for path, _, _ in leaves(loop)}


def test_a_field_that_no_conversion_knows_is_a_loss():
    given = [(("new_field",), 3), (("pv", "tag"), "IR1"), (("name",), "L1")]
    rows = list(unreported_fields(given, [], {"pv.tag": "a place"}, {"name": "L1"}))
    assert rows == [
        Change("new_field", "dropped", 3, None, note=UNKNOWN_FIELD_NOTE, loss=True),
        Change("pv.tag", "dropped", "IR1", None, note="a place"),
        Change("name", "exact", "L1", "L1", neutral=("name",), target_field="name"),
    ]
    assert list(unreported_fields(given[:1], [Change("new_field.0", "exact", 3, 3)], {}, {})) == []


# --- exact -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("one", "two"), PAIRS)
def test_what_is_called_exact_is_what_the_registers_hold(one, two):
    counts = measure(one, two, 3)
    assert counts["conversions"] + counts["refused"] > 0
    assert (counts["untrue"], counts["silent"]) == (0, 0), counts


def loop_of(**changed):
    """A neutral loop."""
    return GenericFile.model_validate({"pidcfg": 1, "vendor": "generic", "loops": [{**OVEN, **changed}]}).loops[0]


def test_an_exact_line_that_is_not_is_found_out():
    rows = [
        Change("gain", "exact", 2.5, 2, neutral=("tuning.gain",)),
        Change("mode", "exact", "auto", "auto", neutral=("mode",)),
        Change("sample", "exact", 0.5, 0.5, neutral=("sample_time",)),
    ]
    after = loop_of(tuning={"gain": 2, "integral_time": 60}, mode="manual")
    gain, mode, sample = correct_lines(rows, loop_of(), after)
    assert (gain.kind, gain.error_percent) == ("rounded", 20)
    assert (str(gain.terms.wanted), str(gain.terms.held), gain.terms.unit) == ("2.5", "2", "%/degC")
    assert (mode.kind, mode.loss, "manual" in mode.note) == ("dropped", True, True)
    assert sample == rows[2]
    dropped = Change("gain", "dropped", 2.5, None, loss=True, neutral=("tuning.gain",))
    assert list(correct_lines([dropped], loop_of(), after)) == [dropped]


@pytest.mark.parametrize(("gain", "kind"), [(0.999999, "exact"), (0.99999899, "rounded")])
def test_a_millionth_is_what_single_precision_makes(gain, kind):
    one, two = (loop_of(tuning={"gain": number, "integral_time": 60}) for number in (gain, 1))
    [line] = correct_lines([Change("gain", "exact", gain, 1, neutral=("tuning.gain",))], one, two)
    assert line.kind == kind


@pytest.mark.parametrize(("zero", "kind"), [(4e-7, "exact"), (4.1e-7, "rounded")])
def test_beside_zero_a_billionth_of_the_range_is_what_single_precision_makes(zero, kind):
    one, two = (loop_of(setpoint={"value": number}) for number in (0, zero))
    [line] = correct_lines([Change("setpoint", "exact", 0, 0, neutral=("setpoint.value",))], one, two)
    assert line.kind == kind


def test_a_line_about_a_section_has_the_worst_of_its_numbers():
    output = {"range": [0, 100], "unit": "%", "limits": [5, 85]}
    one, two = loop_of(output=output), loop_of(output={**output, "limits": [5, 80]})
    [line] = correct_lines([Change("limits", "exact", [5, 85], [5, 85], neutral=("output.limits",))], one, two)
    assert (line.kind, str(line.terms.wanted), str(line.terms.held)) == ("rounded", "85", "80")


@pytest.mark.parametrize(
    ("changed", "field", "unit"),
    [
        ({"tuning": {"gain": 2.5, "integral_time": 50}}, "tuning.integral_time", "s"),
        ({"setpoint": {"value": 170}}, "setpoint.value", "degC"),
        ({"sample_time": 0.4}, "sample_time", "s"),
    ],
)
def test_a_number_that_differs_has_the_unit_of_its_field(changed, field, unit):
    [line] = correct_lines([Change(field, "exact", 1, 1, neutral=(field,))], loop_of(), loop_of(**changed))
    assert (line.kind, line.terms.unit) == ("rounded", unit)


@pytest.mark.parametrize("target", ["click", "dl06"])
def test_a_number_of_another_kind_that_means_the_same_is_exact_and_told_as_the_file_has_it(target):
    """A filter of Td/10, and a change of one count of 4095 in a sample of 0.5 s."""
    tuning = {"gain": 0.02, "integral_time": 60, "derivative_time": 6, "derivative_filter": 0.6}
    text = oven(tuning=tuning, pv={"range": [0, 4095]}, alarms={"rate_of_change": 2})
    lines = lines_of(api.convert(text, target))
    told = [lines[key] for key in ("tuning.derivative_filter", "alarms.rate_of_change")]
    assert [(row.kind, row.target, row.error_percent) for row in told] == [("exact", 10, 0), ("exact", 1, 0)]


@pytest.mark.parametrize("target", CASES)
def test_a_range_stands_before_its_unit_in_a_result_and_its_report(target):
    result = converted(CASES["generic"][0](OVEN), "generic", target)
    (data,), rows = result.data["loops"], [row.target_field for row in result.loops[0].changes]
    for part in ("pv", "output"):
        assert [key for key in data.get(part, {}) if key in {"range", "unit"}] in (["range", "unit"], ["unit"])
        told = [row for row in rows if row in {f"{part}.range", f"{part}.unit"}]
        assert told == [key for key in (f"{part}.range", f"{part}.unit") if key in told]


@pytest.mark.parametrize("source", ["click", "dl06", "dpide", "ezlogix"])
def test_the_range_of_a_pv_stands_before_its_unit_in_a_report(source):
    file, plain, _ = CASES[source]
    loop = {**plain, "pv": {**plain.get("pv", {}), "unit": "bar"}}
    fields = [row.field for row in converted(file(loop), source, "generic").loops[0].changes]
    assert [field for field in fields if field in {"pv.range", "pv.unit"}] == ["pv.range", "pv.unit"]


def test_a_signal_has_one_line_whether_or_not_a_block_reads_it():
    block = {"name": "D", "type": "ControlDelay", "InVar": "Two", "DelayTime": 1}
    file = {"plc": {"sample_time": 0.1}, "signals": {"Two": 2, "Alone": 3, "PV": 4}, "blocks": [block]}
    loops = [{**PIDA, "name": name, "PV": "PV", "BIAS": bias} for name, bias in (("A", 0), ("B", "D.OutVar"))]
    result = api.convert(file_of("nextopid", *loops, **file), "dl06")
    told = [[row.field for row in loop.changes if row.field.startswith("signals.")] for loop in result.loops]
    assert sorted(told[0] + told[1]) == ["signals.Alone", "signals.PV", "signals.Two"]
    assert {"signals.Alone", "signals.PV"} <= {*told[0]}  # the first loop has what belongs to none


@pytest.mark.parametrize(("time", "told"), [(5, True), (0, False)])
def test_what_manual_does_with_a_rate_is_told_of_a_loop_that_has_one(time, told):
    result = api.convert(oven(tuning={"gain": 2.5, "integral_time": 60, "derivative_time": time}), "dl06")
    assert ("operation.rate" in lines_of(result)) is told


def target_notes():
    """The rows of the file: target, what differs from a plain loop, and the lines that are told of it."""
    text = (Path(__file__).parent / "data" / "target_notes.txt").read_text("utf-8")
    rows, target = [], ""
    for line in text.splitlines():
        if line.startswith("    "):
            rows[-1][2].append(line.strip())
        elif line.startswith("  "):
            rows.append((target, line.strip(), []))
        elif not line.startswith("#"):
            target = line
    return rows


@pytest.mark.parametrize(("target", "changed", "told"), target_notes())
def test_a_target_tells_what_it_does_with_a_field_that_it_has_otherwise_or_not_at_all(target, changed, told):
    plain, lines = (
        [
            f"{put.path or '-'} < {put.neutral or '-'}"
            + " (assumed)" * put.assumed
            + " (clamped)" * put.clamped
            + (put.note and f": {put.note}")
            for put in VENDORS[target].load("from_neutral")(CASES["generic"][0](merged(OVEN, loop)), {}).fields[0]
        ]
        for loop in ({}, YAML(typ="safe").load(changed))
    )
    assert [line for line in lines if line not in plain] == told


# --- losses and their limits -----------------------------------------------------------------------------------------


def test_a_gain_that_is_rounded_too_far_needs_leave():
    text = oven(tuning={"gain": 0.00375, "integral_time": 60})  # 0.015 of the spans
    row = lines_of(api.convert(text, "dl06"))["tuning.gain"]
    assert (row.kind, row.target, row.loss, round(row.error_percent, 3)) == ("rounded", 0.02, True, 33.333)
    assert (float(row.terms.wanted), float(row.terms.held), row.terms.unit) == (0.00375, 0.005, "%/degC")
    loose = lines_of(api.convert(text, "dl06", max_loss="gain=34 %"))["tuning.gain"]
    assert (loose.kind, loose.loss) == ("rounded", False)


def test_a_clamped_gain_says_how_far_it_is_off():
    row = lines_of(api.convert(oven(tuning={"gain": 50, "integral_time": 60}), "dl06"))["tuning.gain"]
    assert (row.kind, row.target, row.loss) == ("clamped", 99.99, True)
    assert row.error_percent == pytest.approx(100 * (1 - 99.99 / 200))


@pytest.mark.parametrize(
    ("target", "changed", "key", "held", "error", "note"),
    [
        ("click", {"tuning": {"gain": 0.001}}, "tuning.proportional_gain", 0.01, 900, "allowed is 0.01 to 10000"),
        ("click", {"tuning": {"gain": 20000}}, "tuning.proportional_gain", 10000, 50, "allowed is 0.01 to 10000"),
        ("click", {"tuning": {"integral_time": 0.001}}, "tuning.reset_time", 0.01, 900, "allowed is 0.01 to 6000"),
        ("click", {"tuning": {"derivative_time": 8000}}, "tuning.derivative_gain", 6000, 25, "allowed is 0 to 6000"),
        ("click", {"output": {"pulse": {"period": 0.5}}}, "output.pwm.period", 1, 100, "allowed is 1 to 600"),
        ("click", {"output": {"pulse": {"period": 800}}}, "output.pwm.period", 600, 25, "allowed is 1 to 600"),
        ("dl06", {"tuning": {"gain": 50}}, "tuning.gain", 99.99, 50.005, "DL06 holds 0 to 99.99"),
        ("dl06", {"setpoint": {"value": 500}}, "setpoint.value", 400, 20, "DL06 holds 0 to 400"),
        ("dl06", {"setpoint": {"value": -5}}, "setpoint.value", 0, 100, "DL06 holds 0 to 400"),
        ("dl06", {"output": {"limits": [5, 125]}}, "output.limits.1", 100, 20, "DL06 holds 0 to 100"),
        ("dl06", {"output": {"limits": [-5, 95]}}, "output.limits.0", 0, 100, "DL06 holds 0 to 100"),
        ("dl06", {"deadband": 500}, "error.deadband", 400, 20, "DL06 holds 0 to 400"),
        ("ezlogix", {"sample_time": 0.04}, "sample_rate", 0.05, 25, "allowed is 0.05 to 99.99"),
        ("ezlogix", {"sample_time": 199.98}, "sample_rate", 99.99, 50, "allowed is 0.05 to 99.99"),
        ("ezlogix", {"tuning": {"gain": 50}}, "tuning.proportional_gain", 99.99, 50.005, "allowed is 0 to 99.99"),
        ("ezlogix", {"tuning": {"integral_time": 8000}}, "tuning.integral_time", 6000, 25, "allowed is 0 to 6000"),
        ("ezlogix", {"tuning": {"derivative_time": 800}}, "tuning.derivative_time", 600, 25, "allowed is 0 to 600"),
        ("ezlogix", {"setpoint": {"value": 500}}, "setpoint.value", 400, 20, "EZLogix holds 0 to 400"),
    ],
)
def test_what_a_plc_does_not_take_is_brought_to_the_end_of_what_it_does(target, changed, key, held, error, note):
    """The limits are those of the manuals, or of registers on their scales; the others of the loop stay as they are."""
    result = converted(CASES["generic"][0](merged(OVEN, changed)), "generic", target)
    (row,) = (row for row in result.loops[0].changes if row.target_field == key and row.kind != "exact")
    assert (row.kind, row.loss, row.target) == ("clamped", True, held)
    assert row.error_percent == pytest.approx(error)
    assert row.note.endswith(note)
    assert {other.kind for other in result.loops[0].changes if other.target_field not in {key, ""}} <= {
        "exact",
        "assumed",
    }


@pytest.mark.parametrize(
    ("neutral", "error", "loss"),
    [
        ("tuning.gain", 2.0, False),
        ("tuning.gain", 2.1, True),
        ("sample_time", 4.9, False),
        ("tuning.derivative_time", 5.1, True),
        ("pv.filter", 10, False),
        ("tuning.derivative_filter", 31, True),
        ("alarms.hysteresis", 11, True),
        ("setpoint.value", 11, True),
        ("output.bias", 50, False),
    ],
)
def test_each_kind_of_number_has_its_limit(neutral, error, loss):
    row = Change("x", "rounded", 1, 2, error, neutral=(neutral,))
    assert judge_change(row, MaxLoss()).loss is loss


def test_limits_are_read_one_by_one():
    assert parse_max_loss("gain = 3 %, filter=0") == MaxLoss(gain=3, filter=0)
    for text in ("gain", "gain=-1", "gain=x", "speed=3", "", "time=inf"):
        with pytest.raises(MaxLossError, match="write limits such as"):
            parse_max_loss(text)


# --- what an operator sees -------------------------------------------------------------------------------------------

STARTS = {"dl06": "later begins in the mode that it had", "click": "it waits in Manual"}
"""The others begin in their mode."""
ON_TOP = {"dl06", "click", "ezlogix"}
"""With a set point that stays: the bias, or the integral, becomes the output, and the error acts on top of it."""


@pytest.mark.parametrize(("one", "two"), PAIRS)
def test_each_pair_names_how_start_and_transfers_differ(one, two):
    text = oven(setpoint={"value": 180, "follows_pv": False})
    source = text if one == "generic" else api.convert(text, one).text
    lines = lines_of(api.convert(source, two))
    start = lines.get("operation.start")
    assert (start is not None) == (STARTS.get(one) != STARTS.get(two))
    for vendor, text in ((one, start.source), (two, start.target)) if start is not None else ():
        assert text.endswith(STARTS.get(vendor, "it begins in its mode, with an integral of 0"))
    assert ("operation.transfer" in lines) == ((one in ON_TOP) != (two in ON_TOP))
    assert "operation.manual" not in lines


@pytest.mark.parametrize("source", ["dl06", "click", "ezlogix", "dpide", "generic"])
def test_a_nextopid_copies_mv_so_that_its_output_stays(source):
    text = oven(setpoint={"value": 180, "follows_pv": False})
    result = api.convert(text if source == "generic" else api.convert(text, source).text, "nextopid")
    name = result.data["loops"][0]["name"]
    held = {"move": f"{name}.MV", "to": f"{name}.ManualMV", "when": f"NOT {name}.Manual"}
    assert result.data["moves"] == [held]
    line = lines_of(result)["/moves.0.move"]
    assert (line.kind, line.loss) == ("assumed", False)


def test_a_nextopid_without_that_move_jumps_and_so_does_nobody_else():
    plain = file_of("nextopid", {"name": "TIC1", **PIDA}, plc={"sample_time": 0.1})
    line = lines_of(api.convert(plain, "generic"))["operation.manual"]
    assert (line.kind, line.loss) == ("assumed", False)
    assert api.convert(plain, "dpide").data["loops"][0]["MOUT_AUTO"] is False


@pytest.mark.parametrize(("given", "first"), [(None, 20), (50, 50), (95, 90)])
@pytest.mark.parametrize("is_manual", [True, False])
def test_a_loop_begins_in_manual_within_the_limits_that_hold_there_in_its_source(given, first, is_manual):
    """A NextoPID limits ManualMV, which is 0 if not given; of the others a DL06, a CLICK and an EZLogix do not."""
    loop = {"name": "TIC1", **PIDA, "MinMV": 20, "MaxMV": 90, "Manual": is_manual, "output": {"range": [0, 100]}}
    text = file_of("nextopid", loop | ({} if given is None else {"ManualMV": given}), plc={"sample_time": 0.1})
    output, is_assumed = first if is_manual else given, is_manual and first != given
    for target in ("dl06", "click"):
        result = api.convert(text, target)
        assert result.data["loops"][0].get("state", {}).get("output") == output
        lines = [line for line in result.loops[0].changes if line.target_field == "state.output"]
        told = [("assumed", FIRST_OUTPUT_NOTE) if is_assumed else ("exact", "")]
        assert [(line.kind, line.note) for line in lines] == told * (output is not None)
    line = lines_of(api.convert(text, "ezlogix")).get("ManualMV")
    counts = None if output is None else f"write {round(output * 40.95)} counts "
    assert line is counts is None or line.note.startswith(counts)
    assert api.convert(text, "dpide").data["loops"][0]["MOUT"] == (given or 0)
    kept = api.convert(text, "generic").data["loops"][0]["output"].get("manual")
    assert kept == (given or 0 if is_manual else given)


def test_a_set_point_that_follows_the_pv_is_a_move_and_comes_back():
    text = oven(setpoint={"value": 180, "follows_pv": True})
    result = api.convert(text, "nextopid")
    name = result.data["loops"][0]["name"]
    assert result.data["moves"][1] == {"move": f"{name}.PV", "to": f"{name}.SP", "when": f"{name}.Manual"}
    assert "setpoint.follows_pv" not in [c.field for c in result.loops[0].changes if c.loss]
    back = api.convert(result.text, "generic")
    assert back.data["loops"][0]["setpoint"]["follows_pv"] is True
    assert not [change for change in back.loops[0].changes if change.loss]


def test_moves_that_no_other_plc_has_are_lost_by_name():
    moves = [{"move": 5, "to": "TIC1.ManualMV", "when": "TIC1.Manual"}]
    text = file_of("nextopid", {"name": "TIC1", **PIDA}, plc={"sample_time": 0.1}, moves=moves)
    line = lines_of(api.convert(text, "generic"))["moves.0"]
    assert (line.kind, line.loss, line.source) == ("dropped", True, "5 to TIC1.ManualMV")
    assert line.note == "copy it in the program: when TIC1.Manual"


@pytest.mark.parametrize(
    ("target", "owner"), [("L1.ManualMV", 0), ("L2.ManualMV", 1), ("Two", 1), ("Raw", 0), ("Own", 0), ("F.Tc", 0)]
)
@pytest.mark.parametrize("blocks", [0, 1, 2])
def test_a_move_is_lost_with_the_loop_that_it_writes_or_that_reads_it_else_the_first(target, owner, blocks):
    kept = [{"name": name, "type": "ControlLowFilter", "InVar": "Raw", "Tc": 1.5} for name in "EF"[:blocks]]
    if target == "F.Tc" and blocks < 2:
        return
    loops = [{"name": "L1", **PIDA}, {"name": "L2", **PIDA, "SP": "Two"}]
    moves = [{"move": 5, "to": target, "when": "L2.Manual"}]
    file = {"plc": {"sample_time": 0.1}, "signals": {"Raw": 1, "Two": 2, "Own": 3}, "blocks": kept, "moves": moves}
    result = converted(VENDORS["nextopid"].model.model_validate(
        {"pidcfg": 1, "vendor": "nextopid", **file, "loops": loops}
    ), "nextopid", "generic")  # fmt: skip
    told = [[(row.source, row.loss) for row in loop.changes if row.field == "moves.0"] for loop in result.loops]
    assert told == [[(f"5 to {target}", True)] * (i == owner) for i in range(2)]


def test_a_dpide_keeps_its_output_in_manual_unless_the_source_has_a_manual_value():
    assert api.convert(oven(), "dpide").data["loops"][0]["MOUT_AUTO"] is True
    jumping = file_of("nextopid", {"name": "TIC1", **PIDA, "ManualMV": 20}, plc={"sample_time": 0.1})
    result = api.convert(jumping, "dpide")
    assert (result.data["loops"][0]["MOUT_AUTO"], result.data["loops"][0]["MOUT"]) == (False, 20)
    assert "operation.manual" not in lines_of(result)


P_ONLY = {"gain": 2.5}


@pytest.mark.parametrize("target", ["ezlogix", "nextopid", "dpide", "generic"])
def test_the_output_that_a_bias_would_take_over_becomes_the_bias(target):
    output = {"range": [0, 100], "unit": "%", "manual": 33}
    text = api.convert(oven(tuning=P_ONLY, output=output), "dl06").text
    result = api.convert(text, target)
    back = api.convert(result.text, "generic") if target != "generic" else result
    assert back.data["loops"][0]["output"]["bias"] == pytest.approx(33, abs=0.02)
    assert lines_of(result)["operation.transfer"].loss


@pytest.mark.parametrize("target", ["dl06", "click"])
def test_a_constant_bias_is_the_output_that_a_loop_begins_with(target):
    result = api.convert(oven(tuning=P_ONLY, output={"range": [0, 100], "unit": "%", "bias": 40}), target)
    assert result.data["loops"][0]["state"] == {
        "bias": pytest.approx(40, abs=0.02),
        "output": pytest.approx(40, abs=0.02),
    }
    lines = lines_of(result)
    assert (lines["operation.transfer"].loss, lines["output.bias"].kind) == (True, "assumed")


DL06_BIPOLAR = {
    "name": "P2",
    "mode": "auto",
    "sample_rate": 1,
    "bumpless": "II",
    "action": "direct",
    "tuning": {"gain": 2, "reset": 60},
    "pv": {"range": [-50, 50], "format": "12-bit bipolar"},
    "setpoint": {"value": -5},
    "output": {"range": [-100, 100], "unit": "%"},
}
BIPOLAR = """\
pidcfg: 1
vendor: ezlogix
loops:
  - {name: L2, registers: R133, discretes: S109, mode: auto, algorithm: position, action: reverse, sample_rate: 2,
     tuning: {proportional_gain: 0.45}, pv: {tag: IR1, range: [0, 16]}, setpoint: {value: 3.2},
     output: {tag: OR1, range: [-100, 100], unit: "%"%s}}
"""


def test_an_offset_of_0_counts_is_what_a_dl06_has_without_a_bias():
    result = api.convert(BIPOLAR.replace("%s", ""), "dl06")
    row = lines_of(result)["output.offset"]
    assert (row.kind, row.loss) == ("assumed", False)
    back = api.convert(result.text, "generic")
    assert back.data["loops"][0]["output"]["bias"] == -100


def test_a_bias_of_0_counts_is_written_beside_another_output():
    output = {"range": [-100, 100], "unit": "%", "bias": -100, "manual": 20}
    result = api.convert(oven(tuning=P_ONLY, output=output), "dl06")
    assert result.data["loops"][0]["state"] == {"output": 20, "bias": -100}
    assert lines_of(result)["output.bias"].error_percent == 0


@pytest.mark.parametrize("target", ["ezlogix", "click"])
def test_a_bipolar_output_begins_in_the_middle(target):
    source = file_of("dl06", DL06_BIPOLAR, plc={"loop_table": "V2000"})
    result = api.convert(source, target)
    row = lines_of(result)["state.output"]
    assert "middle of its range" in row.note
    if target == "click":
        assert (row.kind, result.data["loops"][0]["state"]["output"]) == ("assumed", 50)
    else:
        assert (row.loss, "write 2048 counts" in row.note) == (True, True)


@pytest.mark.parametrize("field", ["output.offset", "state.output"])
def test_a_position_beside_zero_is_off_by_a_share_of_its_range(field):
    result = api.convert(BIPOLAR.replace("%s", ", offset: 2048 counts"), "dl06")
    row = lines_of(result)[field]
    assert (row.target, row.error_percent) == (0, pytest.approx(100 * 0.5 / 4095))


def test_a_set_point_beside_zero_is_no_loss():
    row = lines_of(api.convert(oven(pv={"range": [-50, 50]}, setpoint={"value": 0.01}), "dl06"))["setpoint.value"]
    assert (row.kind, row.loss, row.error_percent) == ("rounded", False, pytest.approx(0.01, abs=0.003))


@pytest.mark.parametrize("target", ["dl06", "click"])
def test_a_clamped_bias_is_not_told_as_0(target):
    output = {"range": [20, 50], "unit": "Hz", "bias": 3}
    row = lines_of(api.convert(oven(output=output), target))["output.bias"]
    assert row.terms is None or row.terms.held != 0
    assert target != "dl06" or (row.kind, row.target, row.error_percent) == ("clamped", 20, 0)


def test_a_freeze_that_can_never_act_is_a_loss():
    click = api.convert(oven(output={"range": [0, 100], "unit": "%", "limits": [5, 85]}), "click").text
    result = api.convert(click, "dl06")
    lines = lines_of(result)
    assert (lines["operation.windup"].kind, lines["operation.windup"].loss) == ("dropped", True)
    assert lines["freeze_bias"].kind == "assumed"
    assert any("bias_freeze" in d.where for d in result.faults)
    full = api.convert(api.convert(oven(), "click").text, "dl06")
    assert not lines_of(full)["operation.windup"].loss


RULES = {
    "start": Start, "stopped": Stopped, "manual": Manual, "hand": Hand, "zero": Zero, "transfer": Transfer,
    "without_integral": WithoutIntegral, "deadband": Deadband, "smoothing": Smoothing, "rate": Rate, "filter": Filter,
    "interlock": Interlock, "master": Master,
}  # fmt: skip
"""What a loop does where the neutral form says nothing; what the integral does at a limit has a test of its own."""
PLAIN = {"mode": "manual", "tuning": {"gain": 2}, "output": {"range": [0, 100]}, "setpoint": {}}
APART = [
    Operation(**{**{name: tuple(kind)[i] for name, kind in RULES.items()}, "windup": windup, "stopped": stopped})
    for i, (windup, stopped) in enumerate(((Windup.FROZEN, Stopped.STANDS), (Windup.ENDLESS, Stopped.GOES_ON)))
]
"""Two sides of which every rule differs."""
ALWAYS = {"stopped", "manual", "transfer", "interlock"}


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        ({}, set()),
        ({"mode": "auto"}, {"start"}),
        ({"output": {"range": [0, 100], "limits": [5, 100]}}, {"hand"}),
        ({"output": {"range": [0, 100], "limits": [0, 100]}}, set()),
        ({"output": {"range": [4, 20]}}, {"zero"}),
        ({"output": {"range": [4, 20], "manual": 5}}, set()),
        ({"output": {"range": [4, 20], "manual": 5}, "mode": "auto"}, {"start", "zero"}),
        ({"output": {"range": [0, 100], "bias": 3}}, set()),
        ({"output": {"range": [0, 100], "bias": 3}, "tuning": {"gain": 2, "integral_time": 9}}, {"zero", "windup"}),
        ({"tuning": {"gain": 2, "integral_time": 9}}, {"windup"}),
        ({"tuning": {"gain": 2, "derivative_time": 3}}, {"rate"}),
        ({"tuning": {"gain": 2, "derivative_filter": 1}}, set()),
        ({"tuning": {"gain": 2, "derivative_time": 3, "derivative_filter": 1}}, {"rate", "smoothing"}),
        ({"deadband": 1}, {"deadband"}),
        ({"pv": {"range": [0, 400], "filter": 2}}, {"filter"}),
    ],
)
def test_a_rule_is_told_of_a_loop_that_depends_on_it(changed, told):
    loop = loop_of(**{**PLAIN, **changed})
    for is_master in (False, True):
        for sides in (APART, APART[::-1]):
            rows = [row.field.removeprefix("operation.") for row in differing_rules(*sides, loop, is_master=is_master)]
            assert sorted(rows) == sorted(ALWAYS | told | ({"master"} if is_master else set()))
    assert list(differing_rules(APART[0], APART[0], loop, is_master=True)) == []


DL06_ANSWERS = {
    "start": Start.RETURNS, "hand": Hand.FREE, "zero": Zero.OF_RANGE, "transfer": Transfer.ON_TOP,
    "without_integral": WithoutIntegral.TAKEN_OVER, "windup": Windup.FROZEN_AT_ENDS, "has_edge": True,
    "master": Master.MANUAL,
}  # fmt: skip
"""A bumpless transfer II, with bias freeze (D31, D39, D41, D45)."""
CLICK_ANSWERS = {
    "start": Start.WAITS, "hand": Hand.FREE, "zero": Zero.OF_RANGE, "transfer": Transfer.ON_TOP,
    "without_integral": WithoutIntegral.TAKEN_OVER, "windup": Windup.FROZEN, "has_edge": True,
    "deadband": Deadband.ONLY_BIAS, "slowest_integral": Decimal(6000),
}  # fmt: skip
"""In bumpless mode 2, with freeze bias (D111 to D113, D119, D285)."""
EZLOGIX_ANSWERS = {
    "hand": Hand.FREE, "zero": Zero.OF_RANGE, "transfer": Transfer.ON_TOP, "windup": Windup.CONDITIONAL_AT_ENDS,
    "limits_master": True, "smoothing": None, "stopped": Stopped.AS_GIVEN,
}  # fmt: skip
"""With anti-windup (D165, D167, D170)."""
DPIDE_ANSWERS = {"deadband": Deadband.CROSSED, "windup": Windup.WORKED_OUT, "manual": Manual.JUMPS}
"""In PID_MODE 2, MOUT_AUTO off (D268 to D274)."""
NEXTOPID_ANSWERS = {
    "manual": Manual.JUMPS, "windup": Windup.PARTIAL, "deadband": Deadband.HELD, "follows_output": True,
    "keeps_following": True, "smoothing": Smoothing.EXACT, "rate": Rate.KEPT_UP,
}  # fmt: skip
"""Without moves (D221, D222, D229)."""
NEUTRAL_ANSWERS = {
    "moves_by_hand": True, "windup": Windup.CONDITIONAL, "smoothing": Smoothing.EXACT, "rate": Rate.KEPT_UP,
    "master": Master.FOLLOWS, "stopped": Stopped.UNSAID,
}  # fmt: skip
"""With anti-windup (D300, D301)."""
OF_VENDOR = {
    "dl06": DL06_ANSWERS, "click": CLICK_ANSWERS, "ezlogix": EZLOGIX_ANSWERS, "dpide": DPIDE_ANSWERS,
    "nextopid": NEXTOPID_ANSWERS, "generic": NEUTRAL_ANSWERS,
}  # fmt: skip
TYPE_1 = {"transfer": Transfer.GOES_ON, "leads_master": True}


@pytest.mark.parametrize(
    ("vendor", "loop", "answers"),
    [
        ("dl06", {"bumpless": "II", "bias_freeze": True}, {}),
        ("dl06", {"bumpless": "II", "bias_freeze": False}, {"windup": Windup.WITHIN_RANGE}),
        ("dl06", {"bumpless": "I", "bias_freeze": True}, TYPE_1),
        (
            "dl06", {"bumpless": "II", "algorithm": "velocity", "bias_freeze": True},
            {"windup": Windup.NONE, "transfer": Transfer.GOES_ON},
        ),
        (
            "dl06", {"bumpless": "II", "independent_of_cpu_mode": True, "bias_freeze": True},
            {"stopped": Stopped.GOES_ON},
        ),
        ("dl06", {"bumpless": "II", "error": {"curve": "squared"}, "bias_freeze": True}, {"squares_error": True}),
        (
            "dl06", {"bumpless": "II", "alarms": {"pv": {"high": 150}}, "bias_freeze": True},
            {"interlock": Interlock.REFUSED},
        ),
        (
            "dl06", {"bumpless": "II", "alarms": {"pv": {"high": 150, "enabled": False}}, "bias_freeze": True}, {},
        ),
        ("click", {"bumpless": 2, "freeze_bias": True}, {}),
        ("click", {"bumpless": 2, "freeze_bias": False}, {"windup": Windup.WITHIN_LIMITS}),
        ("click", {"bumpless": 1, "freeze_bias": True}, {"transfer": Transfer.GOES_ON}),
        ("click", {"bumpless": 2, "freeze_bias": True, "error": {"curve": "squared"}}, {"squares_error": True}),
        ("ezlogix", {"anti_windup": True}, {}),
        ("ezlogix", {"anti_windup": False}, {"windup": Windup.ENDLESS}),
        ("dpide", {"PID_MODE": 2, "MOUT_AUTO": False}, {}),
        ("dpide", {"PID_MODE": 0, "MOUT_AUTO": False}, {"windup": Windup.HELD_BEYOND}),
        ("dpide", {"PID_MODE": 1, "MOUT_AUTO": False}, {"windup": Windup.HELD_BEYOND}),
        ("dpide", {"PID_MODE": 2, "MOUT_AUTO": True}, {"manual": Manual.STAYS}),
        ("dpide", {"MOUT_AUTO": False, "devices": {"MV": "D900", "MOUT": "D900"}}, {"manual": Manual.STAYS}),
        ("dpide", {"MOUT_AUTO": False, "devices": {"MV": "D900", "MOUT": "D902"}}, {}),
        ("dpide", {"MOUT_AUTO": False, "devices": {"MV": "D900"}}, {}),
        ("nextopid", {}, {}),
        ("nextopid", {"ManualMV": "L2.MV"}, {"manual": Manual.STAYS}),
        ("nextopid", {"sample_time": 0.1}, {}),
        ("nextopid", {"sample_time": 0.5}, {"filter": Filter.CYCLIC}),
        ("nextopid", {"TRK_IN": "Run"}, {"master": Master.FOLLOWS}),
        ("nextopid", {"TRK_IN": True}, {}),
        ("generic", {"anti_windup": True}, {}),
        ("generic", {"anti_windup": False}, {"windup": Windup.ENDLESS}),
    ],
)  # fmt: skip
def test_a_vendor_answers_for_each_of_its_loops(vendor, loop, answers):
    file, plain, _ = CASES[vendor]
    found = VENDORS[vendor].load("operation")(file(plain, {**plain, "name": "L2", **loop}))
    assert found[1] == Operation(**OF_VENDOR[vendor] | answers)


@pytest.mark.parametrize(
    ("plc", "stopped"),
    [({}, "AS_GIVEN"), ({"process_when_stopped": True}, "GOES_ON"), ({"process_when_stopped": False}, "STANDS")],
)
def test_an_ezlogix_goes_on_by_itself_or_as_somebody_asked(plc, stopped):
    config = test_convert_ezlogix.ezlogix({}, **plc)
    (found,) = VENDORS["ezlogix"].load("operation")(config)
    assert found.stopped is Stopped[stopped]


@pytest.mark.parametrize(
    ("target", "row", "kind"),
    [
        (None, ("mode", "auto", "manual"), "dropped"),
        ("auto", ("mode", "auto", "manual"), "dropped"),
        (None, ("setpoint.follows_pv", False, None), "exact"),
        (False, ("setpoint.follows_pv", False, None), "dropped"),
        (None, ("setpoint.follows_pv", True, None), "dropped"),
    ],
)
def test_a_choice_without_a_place_is_exact_where_nothing_acts_otherwise_without_it(target, row, kind):
    key, *values = row
    sides = (
        loop_of(**({key: value} if key == "mode" else {"setpoint": {"value": 180, "follows_pv": value}}))
        for value in values
    )
    [line] = correct_lines([Change(key, "exact", values[0], target, neutral=(key,))], *sides)
    assert (line.kind, line.loss) == (kind, kind == "dropped")


FULL_LOOP = {
    "mode": "auto", "deadband": 1, "tuning": {"gain": 2, "derivative_time": 3, "derivative_filter": 1},
    "output": {"range": [4, 20], "limits": [5, 20]}, "pv": {"range": [0, 400], "filter": 2}, "setpoint": {},
}  # fmt: skip
LOSSES = {
    "stopped": (Stopped.GOES_ON, None), "manual": (None, Manual.JUMPS), "transfer": (None, Transfer.AS_BEFORE),
    "without_integral": (None, None), "master": (None, Master.INTEGRATES),
}  # fmt: skip
"""Rules by which something is lost: by which answer of the source, or of the target; None: by any."""


@pytest.mark.parametrize("rule", RULES)
def test_what_is_lost_by_a_rule_follows_from_its_answers(rule):
    integral = {} if rule == "without_integral" else {"integral_time": 9}
    loop = loop_of(**{**FULL_LOOP, "tuning": {**FULL_LOOP["tuning"], **integral}})
    name = "transfer" if rule == "without_integral" else rule
    for before, after in product(RULES[rule], repeat=2):
        sides = (Operation(windup=Windup.NONE, **{rule: answer}) for answer in (before, after))
        rows = list(differing_rules(*sides, loop, is_master=True))
        is_lost = rule in LOSSES and all(
            lost in {None, answer} for lost, answer in zip(LOSSES[rule], (before, after), strict=True)
        )
        goes_on = {Stopped.GOES_ON, Stopped.AS_GIVEN}
        is_told = (before in goes_on) != (after in goes_on) if rule == "stopped" else before is not after
        line = Change(f"operation.{name}", "dropped" if is_lost else "assumed", before.text, after.text, loss=is_lost)
        line = replace(line, neutral=("output.bias",) if rule == "without_integral" else ())
        if rule == "smoothing":
            rows = [replace(row, note="") for row in rows]
        assert rows == [replace(line, note=after.advice)] * is_told


def test_a_derivative_filter_that_is_worked_out_otherwise_has_another_time_for_the_same():
    """A sample of 0.5 s lets 1 - e^(-0.5/1) of a change through in one way, and 0.5/(0.5 + 1) in the other."""
    exact, backward = 1 - math.exp(-0.5), 0.5 / 1.5
    times = {Smoothing.BACKWARD: 0.5 / exact - 0.5, Smoothing.EXACT: -0.5 / math.log(1 - backward)}
    shares = {Smoothing.EXACT: exact, Smoothing.BACKWARD: backward}
    for before, after in permutations(Smoothing):
        sides = (Operation(windup=Windup.NONE, smoothing=answer) for answer in (before, after))
        (line,) = differing_rules(*sides, loop_of(**FULL_LOOP), is_master=False)
        percent, was, alike = (float(number) for number in re.findall(r"\d+\.?\d*", line.note))
        assert (percent, was) == pytest.approx((100 * shares[after], 100 * shares[before]), abs=0.05)
        assert alike == pytest.approx(times[after], abs=0.005)


@pytest.mark.parametrize("is_narrow", [True, False])
def test_an_integral_that_runs_further_is_a_loss_and_another_way_to_stop_it_is_not(is_narrow):
    """Without limits within the range, its ends are the limits."""
    loop = loop_of(output={"range": [0, 100], "limits": [5, 95] if is_narrow else [0, 100]})
    steps = [
        {Windup.NONE, Windup.FROZEN, Windup.HELD_BEYOND, Windup.CONDITIONAL, Windup.PARTIAL, Windup.WORKED_OUT},
        {Windup.WITHIN_LIMITS},
        {Windup.FROZEN_AT_ENDS, Windup.CONDITIONAL_AT_ENDS},
        {Windup.WITHIN_RANGE},
        {Windup.ENDLESS},
    ]
    if not is_narrow:
        steps = [steps[0] | steps[2], steps[1] | steps[3], steps[4]]
    ranks = {answer: i for i, answers in enumerate(steps) for answer in answers}
    for before, after in product(Windup, repeat=2):
        sides = (Operation(windup=answer) for answer in (before, after))
        found = [(row.loss, row.note) for row in differing_rules(*sides, loop, is_master=False)]
        is_lost = ranks[after] > ranks[before]
        assert found == [(is_lost, OVERSHOOT_ADVICE if is_lost else "")] * (before is not after), (before, after)


@pytest.mark.parametrize(
    ("tuning", "kicks"),
    [
        ({"derivative_time": 3, "derivative_on": "error"}, True),
        ({"derivative_time": 3, "derivative_on": "pv"}, False),
        ({"derivative_time": 0, "derivative_on": "error"}, False),
    ],
)
def test_a_kick_of_the_derivative_goes_into_an_integral_that_is_worked_out_of_the_output(tuning, kicks):
    loop = loop_of(tuning={"gain": 2, "integral_time": 9, **tuning})
    for before, after in permutations((Windup.WORKED_OUT, Windup.FROZEN, Windup.ENDLESS), 2):
        sides = (Operation(windup=answer) for answer in (before, after))
        (line,) = differing_rules(*sides, loop, is_master=False)
        side = {before: "source's", after: "target's"}.get(Windup.WORKED_OUT)
        told = [KICK_NOTE.format(side=side)] if kicks and side else []
        assert line.note == "; ".join([OVERSHOOT_ADVICE] * (after is Windup.ENDLESS) + told)
        assert line.neutral == ("anti_windup",)


@pytest.mark.parametrize("target", ["ezlogix", "generic"])
def test_an_integral_that_has_an_end_does_not_get_one_without(target):
    dl06 = api.convert(oven(anti_windup=False), "dl06").text
    result = api.convert(dl06, target)
    assert result.data["loops"][0]["anti_windup"] is True
    assert lines_of(result)["bias_freeze"].kind == "assumed"


def test_a_cascade_that_cannot_be_is_not_exact():
    inner = {**OVEN, "name": "IN1", "mode": "cascade", "setpoint": {"value": 3, "source": "TIC1"}}
    text = file_of("generic", {**OVEN, "output": {"range": [0, 400]}}, inner)
    row = lines_of(api.convert(text, "click"), 1)["mode"]
    assert (row.kind, row.loss) == ("clamped", True)
    for target, mode in (("ezlogix", "auto"), ("dpide", False)):
        linked = lines_of(api.convert(text, target), 1)["mode"]
        assert (linked.kind, linked.target) == ("exact", mode)


def test_an_output_in_per_cent_is_the_same_output_on_another_scale():
    lines = lines_of(api.convert(oven(output={"range": [0, 3000], "unit": "rpm"}), "click"))
    for key in ("unit", "range"):
        line = lines[f"output.{key}"]
        assert (line.kind, line.loss, "0 to 100 % of the output are 0 to 3000 rpm" in line.note) == (
            "assumed",
            False,
            True,
        )


# --- loops that cannot go --------------------------------------------------------------------------------------------


def test_one_loop_that_cannot_go_does_not_stop_the_others():
    text = file_of("nextopid", ON_OFF, {"name": "TIC1", **PIDA}, plc={"sample_time": 0.1})
    result = api.convert(text, "dl06")
    fan, tic = result.to_json()["loops"]
    assert (fan["status"], fan["changes"]) == ("dropped", [])
    assert "FAN switches on and off" in fan["reason"]
    assert (tic["status"], tic["reason"]) == ("converted", None)
    assert [loop["name"] for loop in result.data["loops"]] == ["TIC1"]
    assert (result.ok, result.losses, result.pairs) == (True, True, ((1, 0),))
    assert [d.code for d in result.findings if d.severity.label == "error"] == ["PID042"]


def test_without_any_loop_left_nothing_is_converted():
    result = api.convert(file_of("nextopid", ON_OFF, plc={"sample_time": 0.1}), "dl06")
    assert (result.ok, result.text, result.data) == (False, "", None)
    assert "FAN" in result.to_json()["findings"][-1]["message"]


def test_a_loop_that_the_target_refuses_is_dropped_with_its_reason():
    points = {"alarms": {"pv": {"low": 10, "high": 10.001}}}
    text = file_of("generic", {**OVEN, **points}, {**OVEN, "name": "TIC2"})
    first, second = api.convert(text, "dl06").loops
    assert (first.status, second.status) == ("dropped", "converted")
    assert "low must be at least one count below high" in first.reason


def test_the_reason_names_the_key_of_the_source():
    refused = {**OVEN, "name": "L2", "alarms": {"pv": {"low": 10, "high": 10.001}}}
    config = CASES["generic"][0]({**OVEN, "name": "L0"}, {**OVEN, "name": "L1"}, refused)
    result = convert(config, VENDORS["generic"], VENDORS["dl06"], {}, excluded={0: "no"})
    assert [entry.path for entry in result.missing] == [("loops", 0), ("loops", 2, "alarms", "pv", "high")]


def test_a_master_tells_what_it_does_while_its_slave_has_another_set_point():
    slave = {**OVEN, "name": "FIC1", "mode": "cascade", "pv": {"range": [0, 100], "unit": "%"}}
    config = CASES["generic"][0](OVEN, {**slave, "setpoint": {"source": "TIC1"}})
    told = [
        [(row.source, row.target) for row in loop.changes if row.field == "operation.master"]
        for loop in converted(config, "generic", "dl06").loops
    ]
    assert told == [[("its output follows the inner loop", "it goes to Manual")], []]


def test_addresses_stay_with_the_loops_that_go():
    loops = [
        {**OVEN, "name": f"L{i}", **({"alarms": {"pv": {"low": 9, "high": 9.001}}} if i == 2 else {})}
        for i in (1, 2, 3)
    ]
    config = GenericFile.model_validate({"pidcfg": 1, "vendor": "generic", "loops": loops})
    result = convert(
        config, VENDORS["generic"], VENDORS["dpide"], {"device": ["D0", "D100", "D200"]}, excluded={1: "no"}
    )
    assert [loop["device"] for loop in result.data["loops"]] == ["D0", "D200"]
    assert result.loops[1].reason == "no"
    only = convert(config, VENDORS["generic"], VENDORS["dpide"], {"device": ["D300"]}, excluded={0: "no", 1: "no"})
    assert [loop["device"] for loop in only.data["loops"]] == ["D300"]  # one alone is where all begin


# --- the command -----------------------------------------------------------------------------------------------------


@pytest.fixture
def command(tmp_path, monkeypatch, capsys):
    """Runs ``pidcfg convert`` in a folder."""
    monkeypatch.chdir(tmp_path)

    def run(text, *args):
        (tmp_path / "in.yaml").write_text(text, "utf-8")
        monkeypatch.setattr("sys.argv", ["pidcfg", "convert", "in.yaml", *args])
        with pytest.raises(SystemExit) as end:
            main()
        out, err = capsys.readouterr()
        return SimpleNamespace(code=int(end.value.code or 0), out=out, err=err, made=(tmp_path / "out.yaml").exists())

    return run


ROUGH = oven(tuning={"gain": 0.00375, "integral_time": 60})


def test_a_rounding_beyond_its_limit_is_not_written_without_leave(command):
    run = command(ROUGH, "--to", "dl06", "-o", "out.yaml")
    assert (run.code, run.made) == (1, False)
    said = " !rounded  tuning.gain: 0.00375 -> 0.02 (33.3 % off: 0.00375 becomes 0.005\n               %/degC)\n"
    assert said in run.err
    run = command(ROUGH, "--to", "dl06", "-o", "out.yaml", "--max-loss", "gain=40%")
    assert (run.code, run.made) == (0, True)


@pytest.mark.parametrize(("options", "width"), [((), 79), (("-v",), 100)])
@pytest.mark.parametrize("source", SIDES)
def test_no_line_is_left_to_the_terminal_to_break(source, options, width, command):
    for target in SIDES:
        lines = command(SIDES[source].config, "--to", target, "-o", "out.yaml", "--force", *options).err.splitlines()
        assert [line for line in lines if line[:1] == " " and len(line) > width] == []


def test_a_wrong_limit_is_a_usage_error(command):
    run = command(ROUGH, "--to", "dl06", "--max-loss", "speed=3")
    assert run.code == 2
    assert "speed=3" in run.err


def test_findings_of_the_target_stand_in_every_report(command):
    click = api.convert(oven(output={"range": [0, 100], "unit": "%", "limits": [5, 85]}), "click").text
    args = ("--to", "dl06", "-o", "out.yaml", "--allow-loss", "--report-output", "markdown=r.md")
    run = command(click, *args)
    code = api.convert(click, "dl06").faults[0].code
    assert f"warning {code}" in run.err
    run = command(click, *args[:-2], "--report", "json", "--force")
    assert code in {finding["code"] for finding in json.loads(run.out)["findings"]}


def test_dropped_loops_are_written_around_with_leave(command):
    text = file_of("nextopid", ON_OFF, {"name": "TIC1", **PIDA}, plc={"sample_time": 0.1})
    run = command(text, "--to", "dl06", "-o", "out.yaml")
    assert (run.code, run.made) == (1, False)
    assert "FAN: dropped: FAN switches on and off" in run.err
    run = command(text, "--to", "dl06", "-o", "out.yaml", "--allow-loss")
    assert (run.code, run.made) == (0, True)


# --- within a vendor -------------------------------------------------------------------------------------------------

DL06_OWN = """\
pidcfg: 1
vendor: dl06
plc: {loop_table: V3000, reset_decimals: 2}
loops:
  - name: TANK
    sample_rate: 0.5
    action: direct
    bumpless: %s
    tuning: {gain: 2.00, reset: 20.55, rate: 0}
    pv: {range: [0, 100], format: 15-bit unipolar, transfer: {address: V1400}}
    setpoint: {value: 60}
    output: {range: [0, 100], transfer: {slot: 1, channel: 2}}
"""
EZLOGIX_OWN = """\
pidcfg: 1
vendor: ezlogix
loops:
  - {name: FIC, registers: R201, discretes: S201, mode: auto, algorithm: position, action: reverse, sample_rate: 0.5,
     tuning: {proportional_gain: 2, integral_time: 20.0, derivative_time: off},
     pv: {tag: IR7, range: [0, 100], counts: [0, 4000]}, setpoint: {value: 60},
     output: {tag: OR9, range: [0, 100], pulse: {tag: O3, cycle_time: 5}}}
"""


@pytest.mark.parametrize("kind", ["I", "II"])
def test_a_dl06_keeps_its_transfers_and_the_decimals_of_its_reset_within_the_vendor(kind):
    result = api.convert(DL06_OWN % kind, "dl06")
    loop = result.data["loops"][0]
    assert (loop["pv"]["transfer"], loop["output"]["transfer"]) == ({"address": "V1400"}, {"slot": 1, "channel": 2})
    assert result.data["plc"] == {"loop_table": "V3000", "reset_decimals": 2}
    assert (loop["bumpless"], float(loop["tuning"]["reset"])) == (kind, 20.55)
    assert not result.losses
    told = {row.field: row.kind for row in result.loops[0].changes}
    assert {told[key] for key in ("pv.transfer", "/plc.loop_table", "/plc.reset_decimals")} == {"exact"}
    assert not {"plc.loop_table", "plc.reset_decimals"} & told.keys()
    assert api.encode(result.text).image.words == api.encode(DL06_OWN % kind).image.words


def test_options_move_a_loop_within_its_vendor_and_its_transfers_stay():
    result = api.convert(DL06_OWN % "II", "dl06", options={"loop_table": "V2000", "reset_decimals": "1"})
    assert {key: str(value) for key, value in result.data["plc"].items()} == {
        "loop_table": "V2000",
        "reset_decimals": "1",
    }
    assert result.data["loops"][0]["pv"]["transfer"] == {"address": "V1400"}


def test_an_ezlogix_keeps_its_registers_and_tags_within_the_vendor():
    result = api.convert(EZLOGIX_OWN, "ezlogix")
    assert api.encode(result.text).image.words == api.encode(EZLOGIX_OWN).image.words
    loop = result.data["loops"][0]
    assert (loop["pv"]["tag"], loop["output"]["tag"], loop["output"]["pulse"]["tag"]) == ("IR7", "OR9", "O3")
    moved = api.convert(EZLOGIX_OWN, "ezlogix", options={"registers": "R101"}).data["loops"][0]
    assert (moved["registers"], moved["pv"]["tag"], moved["pv"]["counts"]) == ("R101", "IR1", [0, 4000])
    assert float(moved["tuning"]["proportional_gain"]) == 2


@pytest.mark.parametrize(("given", "counts"), [("", [0, 4095]), (", counts: [0, 4000]", [0, 4000])])
def test_an_ezlogix_keeps_how_its_pv_is_counted_and_the_gain_that_depends_on_it(given, counts):
    text = EZLOGIX_OWN.replace(", counts: [0, 4000]", given)
    loop = api.convert(text, "ezlogix", options={"registers": "R101"}).data["loops"][0]
    assert (loop["pv"]["counts"], loop["tuning"]["proportional_gain"]) == (counts, 2)


@pytest.mark.parametrize("goes_on", [True, False])
def test_an_ezlogix_goes_on_while_the_plc_is_stopped_as_before_within_the_vendor(goes_on):
    other = {"FIC": "TIC", "R201": "R301", "S201": "S301", "IR7": "IR8", "OR9": "OR10", "O3": "O4"}
    loop = EZLOGIX_OWN.partition("loops:\n")[2]
    two = EZLOGIX_OWN + reduce(lambda text, item: text.replace(*item), other.items(), loop)
    text = two.replace("loops:", f"plc: {{process_when_stopped: {str(goes_on).lower()}}}\nloops:")
    result = api.convert(text, "ezlogix", options={"registers": "R101"})
    assert result.data["plc"]["process_when_stopped"] is goes_on
    assert not result.losses
    rows = [row for loop in result.loops for row in loop.changes if "process_when_stopped" in row.field]
    assert {row.kind for row in rows} == {"exact"}
    elsewhere = [row for row in api.convert(text, "dl06").loops[0].changes if "stopped" in row.field]
    told = [("dropped", True, "it stands still")] * goes_on + [("dropped", False, None)]
    assert [(row.kind, row.loss, row.target) for row in elsewhere] == told
    assert "see operation.stopped" in elsewhere[-1].note


def test_a_loop_that_goes_on_in_both_plcs_while_they_are_stopped_loses_nothing():
    text = (DL06_OWN % "II").replace("action: direct", "independent_of_cpu_mode: true\n    action: direct")
    rows = {vendor: lines_of(api.convert(text, vendor)).get("operation.stopped") for vendor in ("ezlogix", "click")}
    assert (rows["ezlogix"], rows["click"].loss) == (None, True)
    by_default = lines_of(api.convert(EZLOGIX_OWN, "click"))["operation.stopped"]
    assert (by_default.kind, by_default.loss) == ("assumed", False)


@pytest.mark.parametrize("source", ["dl06", "click", "nextopid", "dpide", "generic"])
def test_an_ezlogix_does_not_go_on_behind_a_stop_where_the_source_stands_still(source):
    result = api.convert(SIDES[source].config, "ezlogix")
    assert result.data["plc"]["process_when_stopped"] is False
    line = lines_of(result)["/plc.process_when_stopped"]
    assert (line.kind, line.loss, line.target) == ("assumed", False, False)
    assert "operation.stopped" not in lines_of(result)
    assert "clear 'Process PID when PLC is Stopped'" in " ".join(api.encode(result.text).checklist)


def test_one_loop_that_is_independent_of_its_cpu_lets_all_go_on():
    own = DL06_OWN % "II"
    alone = own.partition("loops:\n")[2].replace("action: direct", "independent_of_cpu_mode: true\n    action: direct")
    text = own + alone.replace("TANK", "PUMP").replace("V1400", "V1401").replace("channel: 2", "channel: 3")
    result = api.convert(text, "ezlogix")
    assert result.data["plc"]["process_when_stopped"] is True
    lines = [lines_of(result, i).get("operation.stopped") for i in range(2)]
    assert [line and (line.kind, line.target) for line in lines] == [("assumed", "it goes on controlling"), None]


@pytest.mark.parametrize("vendor", ["click", "dpide"])
def test_addresses_stay_within_a_vendor(vendor):
    text = SIDES[vendor].config.replace("C101", "C301").replace("DF101", "DF51").replace("D500", "D700")
    image = api.encode(api.convert(text, vendor).text).image
    assert [(c.address, getattr(c, "device", None)) for c in image.cells] == [
        (c.address, getattr(c, "device", None)) for c in api.encode(text).image.cells
    ]


@pytest.mark.parametrize(
    ("source", "target", "places"),
    [
        ("dl06", "click", {"plc.loop_table": "V2000"}),
        ("click", "dl06", {"bits": "C101", "integers": "DS101", "floats": "DF101"}),
        ("ezlogix", "dl06", {"registers": "R101", "discretes": "S101"}),
        ("dpide", "dl06", {"device": "D500"}),
    ],
)
def test_a_place_is_told_as_the_file_writes_it(source, target, places):
    (loop,) = api.convert(SIDES[source].config, target).to_json()["loops"]
    told = {row["field"]: row["from"] for row in loop["changes"] if row["kind"] == "dropped"}
    assert places.items() <= told.items()


@pytest.mark.parametrize("source", ["dpide", "nextopid"])
@pytest.mark.parametrize(
    ("terms", "is_lost"), [(("Ti_Ki: 20.0", "Ti_Ki: 20.0"), False), (("Ti_Ki: 20.0", "Ti_Ki: 0"), True)]
)
def test_no_bias_of_an_output_that_does_not_reach_0_is_lost_without_an_integral_alone(source, terms, is_lost):
    text = SIDES[source].config.replace("MV_MIN: 0", "MV_MIN: 20").replace("MinMV: 0.0", "MinMV: 20").replace(*terms)
    text = text.replace("    SV:", "    BIAS: 0\n    SV:").replace("    SP:", "    BIAS: 0\n    SP:")
    (loop,) = api.convert(text, "ezlogix").to_json()["loops"]
    assert [row["field"] for row in loop["changes"] if row["target_field"] == "output.offset" and row["loss"]] == (
        ["output.offset"] * is_lost
    )


def test_a_line_names_the_key_of_the_result_too():
    rows = [row for row in api.convert(DL06_OWN % "I", "click").loops[0].changes if row.target_field]
    fields = {(row.field, row.target_field) for row in rows}
    assert {
        ("tuning.gain", "tuning.proportional_gain"),
        ("pv.range", "pv.input_range"),
        ("pv.range", "pv.range"),
    } <= fields
    text = api.convert(DL06_OWN % "I", "click")
    (loop,) = text.to_json()["loops"]
    assert "tuning.proportional_gain" in {row["target_field"] for row in loop["changes"]}


def test_a_dpide_keeps_the_mode_that_holds_its_integral_within_the_vendor():
    text = """
pidcfg: 1
vendor: dpide
loops:
  - {name: A, device: D0, PID_MODE: 0, SV: 30, Kc_Kp: 2, Ti_Ki: 20, Td_Kd: 0, MV_MAX: 100, MV_MIN: 0, CYCLE: 1000,
     PID_DIR: true, PID_RUN: true, pv: {range: [0, 100]}}
"""
    modes = {mode: api.convert(text.replace("MODE: 0", f"MODE: {mode}"), "dpide") for mode in (0, 2)}
    assert {mode: result.data["loops"][0]["PID_MODE"] for mode, result in modes.items()} == {0: 0, 2: 2}


def test_quiet_tells_only_what_is_lost():
    result = api.convert(Path(__file__).parents[1] / "examples/click/tank.yaml", "dl06")
    told, whole = (
        formats.conversion_report(result, changes=changes, losses=True).splitlines() for changes in (False, True)
    )
    lines = [line for line in told if line.startswith(" !")]
    assert len(lines) == len({change.field for change in result.loops[0].changes if change.loss})
    assert set(lines) < set(whole)
    assert told[0].startswith("TANK1: ")
    assert not any("exact " in line or "assumed " in line for line in told[1:])


def unfolded(text):
    """The lines of a report, each with what hangs below it."""
    return re.sub(r"\n(?: {15}| {4}(?=\S))", " ", text).splitlines()


def test_the_short_report_has_what_is_lost_and_says_the_rest_in_numbers():
    result = api.convert(Path(__file__).parents[1] / "examples/dl06/reactor.yaml", "click")
    short, whole = (unfolded(formats.conversion_report(result, full=whole)) for whole in (False, True))
    assert [row for row in short if row.startswith(" !")] == [row for row in whole if row.startswith(" !")] != []
    assert not any(row.startswith(("  assumed", "  exact")) for row in short)
    assert "LIC-103: 15 exact, 6 assumed" in short
    assert "-v lists what is assumed" in short
    assert len(short) < len(whole) / 2


def test_the_short_report_says_once_what_is_the_same_of_several_loops():
    head, loop = COUNTED.format(value=50).split("loops:\n")
    text = f"{head}loops:\n" + "".join(loop.replace("name: T", f"name: {name}") for name in ("T", "B0", "B1"))
    result = api.convert(text, "click", verify=True)
    short = formats.conversion_report(result, full=False).splitlines()
    assert [row.startswith("T, B0, B1: ") for row in short].count(True) == 1
    assert [row.partition(";")[0] for row in short if "alike" in row] == [
        f"  {loop.loop}: alike in {len(loop.stages)} stages" for loop in result.verified
    ]
    assert sum(row.startswith("  run by the target's rules: ") for row in short) == 1
    assert not any("│" in row for row in short)


def test_the_report_of_a_verified_conversion_fits_on_a_screen():
    """A line that is longer than 80 columns takes several rows."""
    result = api.convert(Path(__file__).parents[1] / "examples/generic/boiler.yaml", "dl06", verify=True)
    short = formats.conversion_report(result, full=False).splitlines()
    assert sum(-(-max(len(line), 1) // 80) for line in short) <= 38
    codes = sorted({d.code for d in result.faults})
    assert " ".join(row.strip() for row in short).count(
        f"the rules of dl06 warn of {len(result.faults)} things ({', '.join(codes)}); -v and `validate` say of which"
    )
    pulse = [i for i, row in enumerate(short) if "output.pulse." in row and row.startswith(" !dropped")]
    assert pulse == [pulse[0], pulse[0] + 1, pulse[0] + 2]
    assert short[pulse[2] + 1].strip().startswith("a DL06 loop has no pulse output")


def test_few_findings_of_the_target_are_told_in_words():
    result = api.convert(Path(__file__).parents[1] / "examples/click/tank.yaml", "dl06")
    short = unfolded(formats.conversion_report(result, full=False))
    [start] = [i for i, row in enumerate(short) if row == "what the rules of dl06 say about the result:"]
    assert [row.split()[1].rstrip(":") for row in short[start + 1 :]] == [d.code for d in result.faults]


@pytest.mark.parametrize(
    ("note", "told"), [("", "the result has manual there"), ("x", "x; the result has manual there")]
)
def test_what_the_result_has_instead_stands_behind_the_note(note, told):
    rows = [Change("mode", "exact", "auto", "auto", neutral=("mode",), note=note)]
    [line] = correct_lines(rows, loop_of(), loop_of(mode="manual"))
    assert line.note == told


def test_the_parameters_of_a_block_that_no_line_is_about_are_lost():
    block = {"name": "D", "type": "ControlDelay", "InVar": 3, "DelayTime": 1}
    file = {"plc": {"sample_time": 0.1}, "blocks": [block], "loops": [{**PIDA, "name": "A"}]}
    config = VENDORS["nextopid"].model.model_validate({"pidcfg": 1, "vendor": "nextopid", **file})
    lost = {row.field: row.loss for row in unreported_items(config, [], {})}
    assert lost == dict.fromkeys((f"blocks.D.{key}" for key in block), True)
    assert list(unreported_items(config, [Change("blocks.D", "dropped", None, None)], {})) == []


@pytest.mark.parametrize("state", [{}, {"limits_enabled": False}])
def test_limits_in_counts_are_shown_as_the_file_has_them(state):
    loop = {"name": "A", "sample_rate": 1, "action": "direct", "tuning": {"gain": 1, "reset": 10}}
    setpoint = {"value": "2000 counts", "limits": ["100 counts", "4000 counts"], **state}
    text = file_of("dl06", {**loop, "pv": {"range": [0, 100]}, "setpoint": setpoint}, plc={"loop_table": "V2000"})
    result = api.convert(text, "generic")
    assert lines_of(result)["setpoint.limits"].source == ["100 counts", "4000 counts"]


@pytest.mark.parametrize(
    ("number", "text"),
    [(1e19, "1" + 19 * "0"), (1e20, "1e+20"), (1e-18, "0." + 17 * "0" + "1"), (1e-19, "1e-19"), (None, "-")],
)
def test_a_number_of_up_to_20_signs_is_shown_without_an_exponent(number, text):
    assert text_of(number) == text


FREQUENCY = """
pidcfg: 1
vendor: generic
loops:
  - {name: P1, output_raises_pv: true, sample_time: 1, tuning: {gain: 1, integral_time: 9}, pv: {range: [0, 10]},
     setpoint: {value: 5, follows_pv: false}, output: {range: [0, 50], unit: Hz}, alarms: {hysteresis: 0.1}}
"""


@pytest.mark.parametrize("target", ["dl06", "ezlogix", "click", "nextopid", "dpide"])
def test_nothing_is_lost_where_nothing_is(target):
    """Another scale of the output, and a hysteresis on which no alarm depends."""
    result = api.convert(FREQUENCY, target)
    windup = {"operation.windup"}
    assert {row.field for loop in result.loops for row in loop.changes if row.loss} <= windup
    alarmed = api.convert(FREQUENCY.replace("hysteresis: 0.1", "hysteresis: 0.1, pv: {high: 8}"), "ezlogix")
    assert "alarms.hysteresis" in {row.field for loop in alarmed.loops for row in loop.changes if row.loss}


# --- Words that hold the same number, and are less than a count apart -------------------------------------------------

COUNTED = """
pidcfg: 1
vendor: dl06
plc: {{loop_table: V2000}}
loops:
  - {{name: T, sample_rate: 1 s, action: reverse, tuning: {{gain: 2, reset: 60, rate: 0}},
     pv: {{range: [0, 200], unit: degC}}, setpoint: {{value: {value}}}, output: {{range: [0, 100], limits: [10, 90]}}}}
"""
FULL = 4095


def nearest_share(value, full, width):
    """What counts make of a number, as a share of its scale."""
    return Decimal(round(Decimal(value) * full / width)) / full


@pytest.mark.parametrize("value", ["0", "41", "66.6", "99.4", "123.4", "200"])
@pytest.mark.parametrize(("target", "options", "counts"), [
    ("click", {}, None), ("nextopid", {}, None), ("dpide", {}, None), ("generic", {}, None), ("ezlogix", {}, FULL),
    ("ezlogix", {"pv_counts": "0-1000"}, 1000),
])  # fmt: skip
def test_an_exact_line_says_how_many_counts_the_words_are_apart(value, target, options, counts):
    result = api.convert(COUNTED.format(value=value), target, options=options)
    (row,) = [row for row in result.loops[0].changes if row.field == "setpoint.value"]
    one = nearest_share(value, FULL, 200)
    two = Decimal(value) / 200 if counts is None else nearest_share(value, counts, 200)
    assert (row.kind, row.counts_apart) == ("exact", pytest.approx(float(abs(one - two) * (counts or FULL)), abs=6e-4))
    assert row.counts_apart == round(row.counts_apart, 3)
    shown = result.to_json()["loops"][0]["changes"]
    assert row.counts_apart in [line["counts_apart"] for line in shown if line["field"] == "setpoint.value"]


def test_the_ends_of_limits_are_apart_each_by_its_own_count():
    result = api.convert(COUNTED.format(value=0), "click")
    ends = {row.target_field: row.counts_apart for row in result.loops[0].changes if row.field == "output.limits"}
    assert ends == {"output.limits.0": 0.5, "output.limits.1": 0.5}
    text = formats.conversion_text(result).splitlines()[2]
    assert text.endswith("(2 of the exact ones up to 0.5 counts apart)")
