"""Listings whose words are no values of their format: they decode, each such word is named and counts as 0 (D50)."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from pidcfg.api import decode, encode, simulate

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
    assert any("encoded again, these words differ" in note and "V2010" in note for note in result.notes)


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
