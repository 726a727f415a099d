"""`pidcfg.diff` within a vendor: keys, units, registers, words; listings; what runs; loops renamed or moved."""

from __future__ import annotations

import re
from itertools import combinations, permutations
from pathlib import Path
from types import SimpleNamespace as Facts

import pytest

import diff_spoil
import pidcfg
from pidcfg.cli.formats.conversion import differences_markdown as as_markdown
from pidcfg.cli.formats.conversion import differences_text as as_text
from pidcfg.cli.main import main
from pidcfg.conversion import text_of
from pidcfg.conversion.comparison import moved_loops
from pidcfg.conversion.terms import Item, Owner, add_faults, content_of, item_kind, leaves, move_content
from pidcfg.conversion.vendor_terms import _cell_content, raw_terms
from pidcfg.encoders.decoding import read_listing
from pidcfg.encoders.listing import Listing
from pidcfg.encoders.parameters import Entry, ParameterTable
from pidcfg.encoders.regmap import Writer
from pidcfg.schemas.iec import REAL, Wire
from pidcfg.text.reader import DEFAULT
from pidcfg.text.references import CLICK
from pidcfg.text.writer import yaml_text
from pidcfg.vendors import VENDORS
from spoiled_configurations import MILD, spoiled

EXAMPLES = Path(__file__).parents[1] / "examples"
FILES = {
    vendor: (EXAMPLES / vendor / f"{name}.yaml").read_text("utf-8")
    for vendor, name in {
        "dl06": "reactor",
        "click": "tank",
        "ezlogix": "oven",
        "dpide": "oven",
        "nextopid": "furnace",
        "generic": "boiler",
    }.items()
}
REACTOR = FILES["dl06"]


def edited(text, *pairs):
    """A text with places changed, each of which must be there."""
    for old, new in pairs:
        assert old in text, old
        text = text.replace(old, new)
    return text


def upload(text, name="text", **words):
    """The listing of a configuration, with other words at some addresses."""
    lines = pidcfg.encode(text, name).text.splitlines(keepends=True)
    for address, word in words.items():
        (row,) = (i for i, line in enumerate(lines) if line.startswith(f"{address} "))
        lines[row] = f"{address} {word}\n"
    return "".join(lines)


def loops(result):
    """Loops by name."""
    return {loop.loop: loop for loop in result.loops}


def rows(result, loop):
    """What differs in a loop: key, both values, unit, register with both contents."""
    return [
        (d.key, d.before, d.after, d.unit, d.address, d.word_before, d.word_after)
        for d in loops(result)[loop].differences
    ]


# --- keys, units, words ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("vendor", "old", "new", "loop", "row"),
    [
        ("dl06", "gain: 2.50", "gain: 3.1", "TIC-101", ("tuning.gain", 2.5, 3.1, "%/%", "V2050", "0250", "0310")),
        ("dl06", "filter: 0.5", "filter: 0.7", "TIC-101", ("pv.filter", 0.5, 0.7, "", "V2064", "0005", "0007")),
        ("dl06", "bumpless: II", "bumpless: I", "LIC-103", ("bumpless", "II", "I", "", "V2100.3", "1", "0")),
        (
            "dl06", "reset_unit: minutes", "reset_unit: seconds", "LIC-103",
            ("tuning.reset_unit", "minutes", "seconds", "", "V2101.4", "1", "0"),
        ),
        ("dl06", "reset: 180.0", "reset: off", "TIC-101", ("tuning.reset", 180, "off", "s", "V2051", "1800", "0000")),
        ("dl06", "reset: 180.0", "reset: 4 min", "TIC-101",
         ("tuning.reset", "180 s", "4 min", "", "V2051", "1800", "2400")),
        ("click", ", pwm: {bit: Y001, period: 5}", "", "TANK1",
         ("output.pwm.bit", "Y001", None, "", "", None, None)),
        ("dl06", "channel: 2}", "channel: 3}", "TIC-101",
         ("pv.transfer", "base 0, slot 1, channel 2", "base 0, slot 1, channel 3", "", "V2076", "0102", "0103")),
        ("dl06", "cascade_from: TIC-101", "cascade_from: LIC-103", "FIC-102",
         ("cascade_from", "TIC-101", "LIC-103", "", "V2032", "0425", "0445")),
        ("dl06", "slope: 0.10", "slope: 0.20", "TIC-101",
         ("ramp_soak.steps.0.slope", 0.1, 0.2, "degC/s", "V3001", "0205", "0410")),
        ("click", "sample_rate: 500 ms", "sample_rate: 1 s", "TANK1",
         ("sample_rate", 0.5, 1, "s", "DS106", "500", "1000")),
        ("click", "proportional_gain: 6", "proportional_gain: 8", "TANK1",
         ("tuning.proportional_gain", 6, 8, "%/degF", "DF106", "6.0", "8.0")),
        ("click", "action_verified: true ", "action_verified: false ", "TANK1",
         ("action_verified", True, False, "", "", None, None)),
        ("ezlogix", "proportional_gain: 8.00", "proportional_gain: 8.50", "OVEN1",
         ("tuning.proportional_gain", 8, 8.5, "", "R103", "800", "850")),
        ("ezlogix", "action: reverse", "action: direct", "OVEN1", ("action", "reverse", "direct", "", "", None, None)),
        ("dpide", "Kc_Kp: 40.0", "Kc_Kp: 30", "OVEN", ("Kc_Kp", 40, 30, "ms/degC", "D112", "40.0", "30.0")),
        ("dpide", "PID_DIR: true", "PID_DIR: false", "OVEN",
         ("PID_DIR", True, False, "", "OVEN.PID_DIR", "TRUE", "FALSE")),
        ("nextopid", "Tc: 2.0", "Tc: 3", "FILTER", ("Tc", 2, 3, "s", "FILTER.Tc", "2.0", "3.0")),
        ("generic", "high: 115", "high: 110", "TIC-1",
         ("alarms.pv.high", 115, 110, "degC", "TIC-1.alarms.pv.high", "115.0", "110.0")),
    ],
)  # fmt: skip
def test_a_key_is_told_in_the_words_of_the_file_and_of_the_plc(vendor, old, new, loop, row):
    result = pidcfg.diff(FILES[vendor], edited(FILES[vendor], (old, new)))
    assert rows(result, loop)[0] == row
    assert [name for name, entry in loops(result).items() if entry.status == "changed"] == [loop]


@pytest.mark.parametrize(
    ("vendor", "form", "units"),
    [
        ("dpide", ("PID_EQ: true", "PID_EQ: true"), ["s", "s"]),
        ("dpide", ("PID_EQ: true", "PID_EQ: false"), ["ms/degC/s", "ms per degC/s"]),
        ("nextopid", ("MinMV: 0\n    MaxMV", "Indep: false\n    MinMV: 0\n    MaxMV"), ["s", "s"]),
        (
            "nextopid",
            ("Tfd: 3.0", "Tfd: 3.0\n    Indep: true\n    pv: {unit: degC}\n    output: {unit: '%'}"),
            ["%/degC/s", "% per degC/s"],
        ),
    ],
)
def test_two_of_the_terms_are_times_or_gains_by_the_form(vendor, form, units):
    before = edited(FILES[vendor], form)
    changed = re.sub(r"(Ti_Ki|Td_Kd): (\d)", r"\1: 1\2", before)
    (loop,) = [loop for loop in pidcfg.diff(before, changed).loops if loop.differences]
    told = {difference.key: difference.unit for difference in loop.differences}
    assert [told["Ti_Ki"], told["Td_Kd"]] == units


def test_a_wire_is_what_it_means_and_one_without_meaning_is_its_text():
    assert content_of(Wire("A.MV+1")) == content_of(Wire("(A.MV + 1)")) != content_of(Wire("A.MV + 2"))
    assert content_of(Wire("A.MV +")) == content_of(Wire("A.MV +")) != content_of(Wire("A.MV -"))
    assert content_of(1.5) == 1.5


def test_text_says_key_unit_and_register():
    result = pidcfg.diff(REACTOR, edited(REACTOR, ("gain: 2.50", "gain: 3.1")), names=("a.yaml", "b.yaml"))
    assert as_text(result).splitlines() == [
        "a.yaml → b.yaml",
        "",
        "TIC-101",
        "  medium    tuning.gain: 2.5 → 3.1 %/% (V2050 0250 → 0310)  +24 %",
        "",
        "the same: FIC-102, LIC-103",
    ]
    (difference,) = loops(result)["TIC-101"].differences
    assert result.to_json()["loops"][1]["differences"] == [
        {
            "field": difference.field, "key": "tuning.gain", "risk": "medium", "from": 2.5, "to": 3.1, "unit": "%/%",
            "address": "V2050", "word_from": "0250", "word_to": "0310", "note": "+24 %",
        }
    ]  # fmt: skip


def test_the_neutral_field_stays_the_field():
    result = pidcfg.diff(REACTOR, edited(REACTOR, ("action: reverse", "action: direct"), ("rate: 6.0", "rate: 7")))
    fields = {d.key: (d.field, d.risk) for loop in result.loops for d in loop.differences}
    assert fields["action"] == ("output_raises_pv", "critical")
    assert fields["tuning.rate"] == ("tuning.derivative_time", "medium")


def test_values_that_are_the_same_on_another_scale_are_one_line():
    result = pidcfg.diff(REACTOR, edited(REACTOR, ("range: [0, 200]", "range: [0, 250]")))
    assert "  high      pv.range.1: 200 → 250 degC" in as_text(result)
    assert "  same values, other words: setpoint.value V2042 06CC → 0570, " in as_text(result)
    assert {d.key for d in loops(result)["TIC-101"].differences if not d.other_word_only} == {"pv.range.1"}


def test_a_limit_of_0_counts_is_one_like_any_other():
    text = FILES["ezlogix"]
    scaled = edited(text, ("counts: [0, 4095]", "counts: [800, 4000]"))
    rows_of = [d for d in loops(pidcfg.diff(text, scaled))["OVEN1"].differences if d.key == "setpoint.limits.0"]
    assert [(d.before, d.after, d.other_word_only) for d in rows_of] == [(0, 0, True)]


NEXTOPID = """\
pidcfg: 1
vendor: nextopid
plc: {sample_time: 0.4}
loops:
  - {name: A, type: PIDA_REAL, SP: 30, Kp: 0.5, Ti_Ki: 9, Td_Kd: 0, MinMV: 4, MaxMV: 20, MinPV: 0, MaxPV: 99,
     pv: {unit: degC}, output: {unit: mA}}
"""
DPIDE = """\
pidcfg: 1
vendor: dpide
loops:
  - {name: A, device: D0, PID_EQ: true, SV: 30, Kc_Kp: 0.5, Ti_Ki: 20, Td_Kd: 0, MV_MAX: 20, MV_MIN: 4, CYCLE: 1000,
     PID_DIR: true, pv: {range: [0, 99], unit: degC}, output: {range: [4, 20], unit: mA}}
"""


@pytest.mark.parametrize(
    ("text", "key"),
    [
        (NEXTOPID, "Kp"),
        (NEXTOPID.replace("Td_Kd: 0", "Td_Kd: 0, Indep: true"), "Kp"),
        (DPIDE, "Kc_Kp"),
        (DPIDE.replace("PID_EQ: true", "PID_EQ: false"), "Kc_Kp"),
    ],
)
def test_a_gain_in_another_unit_is_no_action_that_is_switched(text, key):
    found = pidcfg.diff(text, edited(text, ("unit: mA", "unit: V"), (f"{key}: 0.5", f"{key}: 2")))
    assert [(d.before, d.after, d.risk, d.note) for d in loops(found)["A"].differences if d.key == key] == [
        ("0.5 mA/degC", "2 V/degC", "medium", "")
    ]
    off = pidcfg.diff(text, edited(text, (f"{key}: 0.5", f"{key}: 0")))
    risks = [d.risk for d in loops(off)["A"].differences if d.key == key]
    assert risks == ["high"]


def test_a_parameter_of_a_structure_has_the_unit_of_its_map_or_none():
    """A percentage of the MV, and a number of cycles."""
    tuned = edited(NEXTOPID, ("PIDA_REAL", "PIDA_TUNE_REAL"), ("Td_Kd: 0", "Td_Kd: 0, AutoTuneParam: {PARAM}"))
    sides = [
        tuned.replace("{PARAM}", f"{{PercAmpMV: {percent}, NumCycles: {cycles}}}")
        for percent, cycles in ((10, 2), (12.5, 3))
    ]
    assert rows(pidcfg.diff(*sides), "A") == [
        (f"AutoTuneParam.{key}", *values, unit, f"A.AutoTuneParam.{key}", *words)
        for key, values, unit, words in (
            ("PercAmpMV", (10, 12.5), "%", ("10.0", "12.5")),
            ("NumCycles", (2, 3), "", ("2", "3")),
        )
    ]


def test_a_value_is_given_where_the_file_says_it():
    loop = pidcfg.check_text(DPIDE.replace("Td_Kd: 0", "call: {EN: M1}, Td_Kd: 0")).config.loops[0]
    given = {leaf.text: leaf.is_given for leaf in leaves(loop)}
    assert {key: given[key] for key in ("SV", "PID_RUN", "call.EN", "pv.range")} == {
        "SV": True, "PID_RUN": False, "call.EN": True, "pv.range": True,
    }  # fmt: skip
    assert {leaf.is_given for leaf in leaves(loop, is_given=False)} == {False}


def test_markdown_is_a_table_with_what_is_grave_in_bold():
    after = edited(REACTOR, ("action: reverse", "action: direct"), ("name: FIC-102", "name: FIC-1"))
    lines = as_markdown(pidcfg.diff(REACTOR, after, names=("a.yaml", "b.yaml"))).splitlines()
    assert lines[0] == "### PID loops: `a.yaml` → `b.yaml`"
    assert "**FIC-1** renamed, was FIC-102" in lines
    assert (
        "| **critical** | action | reverse → direct | V2100.4 1 → 0 | "
        "the action is reversed: positive feedback on the same plant |"
    ) in lines


# --- listings --------------------------------------------------------------------------------------------------------

RUNNING = {"V2043": "0700", "V2044": "0400", "V2045": "0555", "V2046": "0002", "V2106": "0082", "V2105": "0123"}
"""PV, bias, output and status of a loop that runs."""


def test_what_runs_is_left_out_and_told():
    listing = upload(REACTOR, **RUNNING)
    result = pidcfg.diff(REACTOR, listing, names=(None, "upload.txt"))
    assert result.same
    assert loops(result)["TIC-101"].left_out == ("state.pv", "state.bias", "state.output", "mode_and_alarm_status")
    assert "left out, since it runs: state.pv, state.bias, state.output, mode_and_alarm_status (--live)" in as_text(
        result
    )
    live = pidcfg.diff(REACTOR, listing, names=(None, "upload.txt"), live=True)
    assert not live.same
    assert rows(live, "TIC-101")[0] == ("state.pv", None, 87.5, "degC", "V2043", "0000", "0700")


def test_another_set_point_is_the_operators_and_no_difference():
    result = pidcfg.diff(REACTOR, upload(REACTOR, V2102="0900"), names=(None, "upload.txt"))
    assert result.same
    (operated,) = loops(result)["LIC-103"].operated
    assert (operated.key, operated.before, operated.address, operated.word_after) == (
        "setpoint.value",
        "2048 counts",
        "V2102",
        "0900",
    )
    assert "operated  setpoint.value" in as_text(result)
    assert "| operated | setpoint.value |" in as_markdown(result)


def test_a_set_point_of_a_profile_or_of_another_loop_is_left_out():
    result = pidcfg.diff(REACTOR, upload(REACTOR, V2042="0900", V2002="0100"), names=(None, "upload.txt"))
    assert result.same
    for loop in ("TIC-101", "FIC-102"):
        assert (loops(result)[loop].operated, loops(result)[loop].left_out) == ((), ("setpoint.value",))


CASCADES = {
    "ezlogix": (
        """\
pidcfg: 1
vendor: ezlogix
loops:
  - {name: FIC, registers: R101, discretes: S101, mode: auto, algorithm: position, action: reverse, sample_rate: 0.5,
     tuning: {proportional_gain: 2, integral_time: 20.0, derivative_time: off},
     pv: {tag: IR1, range: [0, 100]}, setpoint: {value: 60}, output: {tag: OR1}}
  - {name: TIC, registers: R201, discretes: S201, mode: auto, algorithm: position, action: reverse, sample_rate: 5,
     tuning: {proportional_gain: 2, integral_time: 90.0, derivative_time: off},
     pv: {tag: IR2, range: [0, 100]}, setpoint: {value: 40}, output: {tag: R102}}
""",
        ("value: 60", "value: 70"),
        ("value: 40", "value: 45"),
        ("tag: R102", "tag: OR2"),
    ),
    "dpide": (
        """\
pidcfg: 1
vendor: dpide
loops:
  - {name: FIC, device: D500, SV: 60, CYCLE: 100, Kc_Kp: 2, Ti_Ki: 20, Td_Kd: 0, MV_MAX: 100, MV_MIN: 0, PID_EQ: true,
     devices: {SV: D602, PV: D610, MV: D612}}
  - {name: TIC, device: D540, SV: 40, CYCLE: 500, Kc_Kp: 2, Ti_Ki: 90, Td_Kd: 0, MV_MAX: 100, MV_MIN: 0, PID_EQ: true,
     devices: {SV: D600, PV: D614, MV: D602}}
""",
        ("SV: 60", "SV: 70"),
        ("SV: 40", "SV: 45"),
        ("MV: D602", "MV: D604"),
    ),
}


@pytest.mark.parametrize("vendor", CASCADES)
def test_a_set_point_in_the_register_of_another_loops_output_is_left_out(vendor):
    text, inner, outer, apart = CASCADES[vendor]
    for old in (text, edited(text, apart)):
        listing = pidcfg.encode(edited(old, inner, outer), allow_errors=True).text
        result = pidcfg.diff(old, listing, names=(None, "upload.txt"))
        told = {name: ([d.key for d in loop.operated], list(loop.left_out)) for name, loop in loops(result).items()}
        key = outer[0].partition(":")[0].replace("value", "setpoint.value")
        assert told == {"FIC": ([], [key]) if old == text else ([key], []), "TIC": ([key], [])}


@pytest.mark.parametrize(
    ("address", "word", "shown"),
    [("V2041", "4600", "4600"), ("V2073", "0080", "0080"), ("V2075", "0004", "0004"), ("V2046", "8000", "8000")],
)
def test_reserved_bits_that_differ_are_shown_between_listings(address, word, shown):
    """Bits 14 and 15 of +01 and +06, bit 7 of +33, bits 2, 3 and 5 to 15 of +35."""
    listing, other = upload(REACTOR), upload(REACTOR, **{address: word})
    held = next(line.split()[1] for line in listing.splitlines() if line.startswith(f"{address} "))
    result = pidcfg.diff(listing, other, names=("a.txt", "b.txt"), vendor="dl06")
    found = [d for d in loops(result)["TIC-101"].differences if d.key.endswith(".reserved")]
    assert [(d.address, d.word_before, d.word_after) for d in found] == [(address, held, shown)]
    assert f"({address} {held} → {shown})" in as_text(result)
    alone = pidcfg.diff(REACTOR, other, names=(None, "b.txt"))
    assert not [d for d in loops(alone)["TIC-101"].differences if d.key.endswith(".reserved")]


@pytest.mark.parametrize(("reset", "same"), [("180.0", True), ("off", False), ("999.9", False)])
def test_a_bias_is_compared_where_there_is_no_integral(reset, same):
    text = edited(REACTOR, ("reset: 180.0", f"reset: {reset}"))
    listing = pidcfg.encode(text, allow_errors=True).text.replace("V2044   0000      0", "V2044   0400   1024")
    result = pidcfg.diff(text, listing, names=(None, "upload.txt"))
    assert result.same is same
    assert bool(loops(result)["TIC-101"].left_out) is same


def test_what_an_autotune_writes_is_compared_and_named():
    result = pidcfg.diff(REACTOR, upload(REACTOR, V2050="0310"), names=(None, "upload.txt"))
    (difference,) = loops(result)["TIC-101"].differences
    assert (difference.after, difference.note) == (3.1, "+24 %; written by an auto-tune, too")


def test_a_word_that_is_no_value_hides_no_other():
    listing = upload(REACTOR, V2050="02A0", V2051="0900", V2110="0777")
    result = pidcfg.diff(REACTOR, listing, names=(None, "upload.txt"))
    (bad, reset) = sorted(loops(result)["TIC-101"].differences, key=lambda d: d.address)
    assert (bad.before, bad.after, bad.word_after) == (2.5, None, "02A0")
    assert bad.note == "no value: 0x02A0 has a digit above 9; it is 672 (typed in decimal? 6.72 would be 0672)"
    assert (reset.before, reset.after, reset.unit) == (180, 90, "s")
    assert [d.after for d in loops(result)["LIC-103"].differences] == [7.77]
    assert "tuning.gain: 2.5 → word 02A0 (V2050 0250 → 02A0)" in as_text(result)
    both = pidcfg.diff(listing, upload(REACTOR), names=("a.txt", "b.txt"), vendor="dl06")
    assert {d.address for loop in both.loops for d in loop.differences} == {"V2050", "V2051", "V2110"}


@pytest.mark.parametrize("like", [None, REACTOR])
def test_two_uploads_are_compared_raw_or_like_a_file(like):
    old = pidcfg.encode(REACTOR, "ihex").text
    new = pidcfg.encode(edited(REACTOR, ("high: 130", "high: 120")), "ihex").text
    result = pidcfg.diff(old, new, names=("a.hex", "b.hex"), vendor="dl06", like=like)
    (row,) = rows(result, "LOOP-2" if like is None else "TIC-101")
    values = (2662, 2457, "counts") if like is None else (130, 120, "degC")
    assert row == ("alarms.pv.high", *values, "V2055", "0A66", "0999")


def test_a_file_of_another_vendor_names_no_loops():
    listing = pidcfg.encode(REACTOR, "ihex").text
    with pytest.raises(ValueError, match="`like` is a file of AutomationDirect CLICK, not of `vendor`"):
        pidcfg.diff(listing, listing, names=("a.hex", "b.hex"), vendor="dl06", like=FILES["click"])


@pytest.mark.parametrize("formats", [("ihex", "text"), ("text", "ihex")])
def test_a_listing_without_names_takes_them_from_the_other(formats):
    texts = [pidcfg.encode(REACTOR, name).text for name in formats]
    result = pidcfg.diff(*texts, names=("a.lst", "b.lst"), vendor="dl06")
    assert result.same
    assert list(loops(result)) == ["FIC-102", "TIC-101", "LIC-103"]


def test_a_set_point_that_the_file_leaves_to_the_operator_is_left_out():
    text = edited(REACTOR, ('    setpoint: {value: "2048 counts"}        # raw counts are always possible\n', ""))
    result = pidcfg.diff(text, upload(text, V2102="0900"), names=(None, "upload.txt"))
    assert (loops(result)["LIC-103"].operated, loops(result)["LIC-103"].left_out) == ((), ("setpoint.value",))


@pytest.mark.parametrize(("value", "address"), [(0, ""), ('"2048 counts"', "V2102")])
def test_a_set_point_that_one_side_leaves_to_the_operator_has_one_key_in_both_directions(value, address):
    line = '    setpoint: {value: "2048 counts"}        # raw counts are always possible\n'
    left, given = (edited(REACTOR, (line, other)) for other in ("", f"    setpoint: {{value: {value}}}\n"))
    for sides in ((left, given), (given, left)):
        told = [(d.key, d.address) for d in loops(pidcfg.diff(*sides))["LIC-103"].differences]
        assert told == [("setpoint.value", address)]


def test_a_table_that_the_file_leaves_alone_is_no_difference_to_a_listing():
    bare = REACTOR[: REACTOR.index("      steps:")] + REACTOR[REACTOR.index("  - name: LIC-103") :]
    assert pidcfg.diff(bare, pidcfg.encode(REACTOR, "ihex").text, names=(None, "upload.hex")).same


def test_what_stands_beside_the_words_is_compared_also_where_a_listing_says_nothing_of_it():
    bare = edited(FILES["dpide"], ("    pv: {range: [0, 400], unit: degC}\n", ""), (", unit: ms}", "}"))
    listing = pidcfg.encode(edited(bare, ("    output: {range: [0, 4000]}\n", "")), "csv").text
    assert [d.key for d in loops(pidcfg.diff(bare, listing, names=(None, "upload.csv")))["OVEN"].differences] == [
        "output.range.0", "output.range.1"
    ]  # fmt: skip
    nameless = "".join(line for line in listing.splitlines(keepends=True) if not line.startswith("#"))
    assert pidcfg.diff(bare, nameless, names=(None, "upload.csv")).same


def test_listings_whose_loops_nobody_knows_are_compared_by_address():
    views = [
        pidcfg.encode(text, "cdv").text.encode("utf-16-le")
        for text in (FILES["click"], edited(FILES["click"], ("proportional_gain: 6", "proportional_gain: 8")))
    ]
    result = pidcfg.diff(*views, names=("a.cdv", "b.cdv"), vendor="click")
    assert rows(result, "") == [("DF106", 6, 8, "", "DF106", "6.0", "8.0")]
    assert "name a configuration" in result.notes[0]


@pytest.mark.parametrize(
    ("vendor", "more", "loop", "row"),
    [
        ("nextopid", "TIC_1.MV REAL 17.0", "TIC_1", ("MV", None, 17, "", "TIC_1.MV", None, "17.0")),
        ("nextopid", "FILTER.OutVar REAL 1.5", "FILTER", ("OutVar", None, 1.5, "", "FILTER.OutVar", None, "1.5")),
        ("nextopid", "TIC_1.Foo REAL 1.0", "TIC_1", ("Foo", None, 1, "", "TIC_1.Foo", None, "1.0")),
        ("dpide", "OVEN.MV REAL 5.0", "OVEN", ("MV", None, 5, "", "OVEN.MV", None, "5.0")),
        (
            "generic", "TIC-1.output.pulse.min_on LREAL 5.0", "TIC-1",
            ("output.pulse.min_on", None, 5, "", "TIC-1.output.pulse.min_on", None, "5.0"),
        ),
        (
            "generic", "TIC-1.output.pulse.period LREAL 5.0", "TIC-1",
            ("output.pulse.period", None, 5, "s", "TIC-1.output.pulse.period", None, "5.0"),
        ),
    ],
)  # fmt: skip
def test_a_parameter_that_the_file_does_not_have_has_the_unit_of_its_key_if_any(vendor, more, loop, row):
    """An output of a block and a name that no schema knows have no key, a section that is not there no unit."""
    result = pidcfg.diff(FILES[vendor], f"{upload(FILES[vendor])}{more}\n", names=(None, "upload.txt"), live=True)
    assert rows(result, loop)[0] == row


def test_a_listing_that_holds_less_says_so():
    listing = "".join(line for line in upload(REACTOR).splitlines(keepends=True) if not line.startswith("V3"))
    result = pidcfg.diff(REACTOR, listing, names=(None, "upload.txt"))
    assert result.same
    assert "ramp_soak.steps.0.ramp_to" in loops(result)["TIC-101"].missing
    assert "not in the listing: ramp_soak.steps.0.ramp_to" in as_text(result)


def test_a_table_that_a_listing_does_not_name_is_missing_but_for_the_words_that_it_holds():
    bare = REACTOR[: REACTOR.index("      steps:")] + REACTOR[REACTOR.index("  - name: LIC-103") :]
    steps = [f"ramp_soak.steps.{i}.{key}" for i in (0, 1) for key in ("ramp_to", "slope", "soak", "deviation")]
    for more, held in (("", 0), ("V3000 0005 5\nV3001 0777 1911\n", 2)):
        result = pidcfg.diff(REACTOR, upload(bare) + more, names=(None, "upload.txt"))
        found = loops(result)["TIC-101"]
        assert [(d.key, d.address) for d in found.differences] == list(
            zip(steps[:held], ("V3000", "V3001")[:held], strict=True)
        )
        assert list(found.missing) == steps[held:]


def test_decode_takes_names_ranges_and_units_from_a_file():
    listing = pidcfg.encode(edited(REACTOR, ("gain: 2.50", "gain: 3.1")), "ihex").text
    result = pidcfg.decode(listing, "dl06", like=REACTOR)
    assert pidcfg.diff(REACTOR, result.text).summary["changed"] == 1
    loop = result.data["loops"][1]
    assert (loop["name"], loop["tuning"]["gain"], loop["pv"]["unit"]) == ("TIC-101", 3.1, "degC")
    with pytest.raises(ValueError, match="`like` is a file of AutomationDirect CLICK"):
        pidcfg.decode(listing, "dl06", like=FILES["click"])


def test_a_loop_that_the_file_does_not_know_gets_a_name_of_its_own():
    less = REACTOR[: REACTOR.index("  - name: LIC-103")]
    listing = pidcfg.encode(REACTOR, "ihex").text
    assert [loop["name"] for loop in pidcfg.decode(listing, "dl06", like=less).data["loops"]][2] == "LOOP-3"
    statuses = {loop.loop: loop.status for loop in pidcfg.diff(less, listing, names=(None, "u.hex")).loops}
    assert statuses == {"": "changed", "FIC-102": "same", "TIC-101": "same", "LOOP-3": "added"}


# --- loops as a whole ------------------------------------------------------------------------------------------------


def test_a_table_that_is_left_alone_differs_from_one_of_zeros():
    bare = REACTOR[: REACTOR.index("      steps:")] + REACTOR[REACTOR.index("  - name: LIC-103") :]
    zeros = edited(bare, ("table: V3000\n", "table: V3000\n      steps: []\n"))
    assert rows(pidcfg.diff(bare, zeros), "TIC-101") == [
        ("ramp_soak.steps", None, "the table is written", "", "", None, None)
    ]
    assert {d.key.rpartition(".")[0] for d in loops(pidcfg.diff(bare, REACTOR))["TIC-101"].differences} == {
        "ramp_soak.steps.0", "ramp_soak.steps.1"
    }  # fmt: skip


PLACES = {
    "click": ("TANK1", {"C101": "C301", "DS101": "DS301", "DF101": "DF301"}),
    "ezlogix": ("EXHAUST", {"R133": "R333", "S109": "S309"}),
    "dpide": ("OVEN", {"D500": "D700"}),
}


@pytest.mark.parametrize(("vendor", "edit"), [(vendor, edit) for vendor in PLACES for edit in (False, True)])
def test_a_loop_with_another_name_and_place_is_the_same_loop_where_all_else_is(vendor, edit):
    """The place itself is no setting that differs (D346)."""
    name, places = PLACES[vendor]
    moved = edited(FILES[vendor], (name, "NEW"), *places.items())
    before, behind = moved.split("NEW", 1)
    other = re.sub(r"(proportional_gain|Kc_Kp): [0-9.]+", r"\1: 3.3", behind, count=1)
    moved = f"{before}NEW{other}" if edit else moved
    statuses = {loop.loop: (loop.status, loop.was) for loop in pidcfg.diff(FILES[vendor], moved).loops}
    assert statuses["NEW"] == (("added", "") if edit else ("renamed", name))
    assert statuses.get(name) == (("removed", "") if edit else None)


@pytest.mark.parametrize(("steps", "status"), [("", "renamed"), ("      steps: []\n", "added")])
def test_a_loop_that_moved_is_a_renamed_one_where_all_of_it_is_the_same(steps, status):
    """Whether a table is written belongs to it, if only with zeros (D346)."""
    at, end = REACTOR.index("  - name: TIC-101"), REACTOR.index("  - name: LIC-103")
    bare = REACTOR[at : REACTOR.index("      steps:")]
    moved = (REACTOR[:at] + REACTOR[end:] + bare + steps).replace("TIC-101", "TIC-7")
    statuses = {loop.loop: loop.status for loop in pidcfg.diff(REACTOR[:at] + bare + REACTOR[end:], moved).loops}
    assert (statuses["TIC-7"], statuses.get("TIC-101")) == (status, "removed" if status == "added" else None)


def test_a_renamed_loop_is_told_as_that_and_what_points_at_it_is_no_difference():
    result = pidcfg.diff(REACTOR, edited(REACTOR, ("TIC-101", "TIC-7")))
    assert {loop.loop: (loop.status, loop.was, loop.differences) for loop in result.loops} == {
        "FIC-102": ("same", "", ()),
        "TIC-7": ("renamed", "TIC-101", ()),
        "LIC-103": ("same", "", ()),
    }
    assert "TIC-7: renamed, was TIC-101" in as_text(result)


@pytest.mark.parametrize(
    ("vendor", "old", "new"),
    [
        ("nextopid", "TIC_1", "TIC_9"),
        ("generic", "TIC-1", "TIC-9"),
        ("click", "TANK1", "TANK2"),
        ("dpide", "OVEN", "KILN"),
    ],
)
def test_wires_to_a_renamed_loop_are_the_same(vendor, old, new):
    wires = {"nextopid": [(f" {old}.MV", f" {new}.MV")], "generic": [(f"source: {old}", f"source: {new}")]}
    after = edited(FILES[vendor], (f"name: {old}\n", f"name: {new}\n"), *wires.get(vendor, ()))
    result = pidcfg.diff(FILES[vendor], after)
    assert {loop.status for loop in result.loops} <= {"renamed", "same"}
    assert [(loop.was, loop.differences) for loop in result.loops if loop.status == "renamed"] == [(old, ())]


def test_a_loop_with_another_name_and_place_is_known_by_its_settings():
    text = FILES["generic"]
    first, second = (text.index(f"  - name: {name}\n") for name in ("TIC-1", "TIC-2"))
    last = text[second:].rstrip().replace("TIC-2", "TIC-9")
    result = pidcfg.diff(text, text[:first] + last + "\n\n" + text[first:second])
    assert {loop.loop: (loop.status, loop.was) for loop in result.loops} == {
        "TIC-9": ("renamed", "TIC-2"), "TIC-1": ("same", ""), "FIC-1": ("same", "")
    }  # fmt: skip


def test_a_loop_in_front_moves_the_others():
    loop = REACTOR[REACTOR.index("  - name: LIC-103") :]
    after = edited(REACTOR, ("loops:\n", "loops:\n" + loop.replace("LIC-103", "LIC-1")))
    result = pidcfg.diff(REACTOR, after)
    assert {name: entry.status for name, entry in loops(result).items()} == {
        "": "changed", "LIC-1": "added", "FIC-102": "moved", "TIC-101": "moved", "LIC-103": "moved"
    }  # fmt: skip
    assert loops(result)["TIC-101"].moved == ("V2040", "V2100")
    assert "TIC-101: moved V2040 → V2100" in as_text(result)
    assert [d.key for d in loops(result)["FIC-102"].differences] == ["cascade_from"]
    assert all(d.other_word_only for d in loops(result)["FIC-102"].differences)


def test_a_loop_without_addresses_moves_in_the_order_of_the_file():
    text = FILES["generic"]
    first, second = (text.index(f"  - name: {name}\n") for name in ("TIC-1", "TIC-2"))
    after = text[:first] + text[second:].rstrip() + "\n\n" + text[first:second]
    moved = {loop.loop: loop.moved for loop in pidcfg.diff(text, after).loops if loop.status != "same"}
    assert moved == {"TIC-2": ("loop 3", "loop 1")}


def test_a_removed_loop_stands_where_it_was():
    text = FILES["generic"]
    first, second = (text.index(f"  - name: {name}\n") for name in ("TIC-1", "FIC-1"))
    order = [(loop.loop, loop.status) for loop in pidcfg.diff(text, text[:first] + text[second:]).loops]
    assert order == [("TIC-1", "removed"), ("FIC-1", "same"), ("TIC-2", "same")]


def test_as_few_loops_as_possible_have_moved():
    """Those that stay ascend, and no larger number of them would."""
    for order in (order for n in range(1, 6) for order in permutations(range(1, n + 1))):
        pairs = [(Owner(str(one), number=one), Owner(str(one), number=two)) for two, one in enumerate(order, 1)]
        moved = {int(owner.name): places for owner, places in moved_loops(pairs)}
        assert moved == {one: (f"loop {one}", f"loop {two}") for two, one in enumerate(order, 1) if one in moved}
        kept = [one for one in order if one not in moved]
        assert kept == sorted(kept)
        assert not [some for some in combinations(order, len(kept) + 1) if list(some) == sorted(some)]


def test_loops_of_which_one_name_begins_as_a_key_of_the_other_are_told_apart():
    """`A.b.pv.range.1` is of the loop A.b, also beside a loop A.b.pv."""
    loop = {"output_raises_pv": True, "sample_time": 1, "tuning": {"gain": 1}, "output": {"range": [0, 100]}}

    def file(*ends):
        named = zip(("A.b", "A.b.pv"), ends, strict=True)
        loops = [{"name": name, **loop, "pv": {"range": [0, end]}} for name, end in named]
        return yaml_text({"pidcfg": 1, "vendor": "generic", "loops": loops})

    old = file(20, 30)
    for name, new, after in (("A.b", file(10, 30), 10), ("A.b.pv", file(20, 20), 20)):
        address = f"{name}.pv.range.1"
        for result in (pidcfg.diff(old, new), pidcfg.diff(old, upload(new), names=(None, "upload.txt"))):
            told = [(entry.loop, d.key, d.address, d.after) for entry in result.loops for d in entry.differences]
            assert told == [(name, "pv.range.1", address, after)]
        assert words(pidcfg.encode(new, changed_from=upload(old)).text, "generic") == {address: after}


def test_loops_of_one_name_are_matched_in_their_order():
    text = edited(REACTOR, ("LIC-103", "FIC-102"))
    assert pidcfg.diff(text, text).same
    (changed,) = [loop for loop in pidcfg.diff(text, edited(text, ("gain: 1.20", "gain: 1.3"))).loops if not loop.same]
    assert [d.address for d in changed.differences] == ["V2110"]


def test_another_loop_at_the_same_place_is_no_renamed_one():
    after = REACTOR[: REACTOR.index("  - name: LIC-103")] + (
        "  - {name: PIC-9, mode: manual, sample_rate: 0.1, action: direct, tuning: {gain: 9, reset: 3, rate: 1},\n"
        "     pv: {range: [0, 16], unit: bar, format: 15-bit unipolar}, output: {range: [0, 10]}}\n"
    )
    statuses = {loop.loop: loop.status for loop in pidcfg.diff(REACTOR, after).loops}
    assert (statuses["LIC-103"], statuses["PIC-9"]) == ("removed", "added")


# --- what is written in part -----------------------------------------------------------------------------------------


def words(text, vendor):
    """The words of a listing."""
    return read_listing(text.encode(), VENDORS[vendor], DEFAULT).words


EDITS = {
    "dl06": [("gain: 2.50", "gain: 3.1"), ("bumpless: II", "bumpless: I"), ("value: 85.0", "value: 80")],
    "click": [("proportional_gain: 6", "proportional_gain: 8"), ("sample_rate: 500 ms", "sample_rate: 1 s")],
    "ezlogix": [("proportional_gain: 8.00", "proportional_gain: 8.50"), ("anti_windup: true", "anti_windup: false")],
    "dpide": [("Kc_Kp: 40.0", "Kc_Kp: 30"), ("PID_DE: true", "PID_DE: false")],
    "nextopid": [("Tc: 2.0", "Tc: 3"), ("InVar: Sensor", "InVar: Sensor * 2"), ("Kp: 4.0", "Kp: 5")],
    "generic": [("gain: 1.2", "gain: 1.3"), ("high: 115", "high: 110")],
}  # fmt: skip


@pytest.mark.parametrize(
    ("vendor", "name"),
    [
        (vendor, kind.name)
        for vendor in EDITS
        for kind in VENDORS[vendor].load("formats").values()
        if kind.may_be_partial
    ],
)
def test_the_changed_words_over_the_old_ones_are_the_new_ones(vendor, name):
    before, after = FILES[vendor], edited(FILES[vendor], *EDITS[vendor])
    old, new = (pidcfg.encode(text, name, allow_errors=True).text for text in (before, after))
    part = pidcfg.encode(after, name, changed_from=old, allow_errors=True).text
    changed = words(part, vendor)
    assert words(old, vendor) | changed == words(new, vendor)
    assert all(words(old, vendor)[address] != raw for address, raw in changed.items())
    assert changed


@pytest.mark.parametrize("vendor", EDITS)
def test_what_a_listing_does_not_hold_is_written(vendor):
    whole = words(upload(FILES[vendor]), vendor)
    lines = upload(FILES[vendor]).splitlines(keepends=True)
    for start in range(3):
        gone = {row for row in lines[start::3] if not row.startswith("#") and "reserved" not in row}
        old = "".join(row for row in lines if row not in gone)
        part = pidcfg.encode(FILES[vendor], changed_from=old, live=True, allow_errors=True)
        assert words(part.text, vendor).items() == whole.items() - words(old, vendor).items()
        assert part.merged == ()


@pytest.mark.parametrize("vendor", EDITS)
def test_what_no_loop_has_any_more_stays_as_it_is(vendor):
    listing = upload(FILES[vendor])
    more = {"dl06": "V3777", "click": "DS4499", "ezlogix": "R999"}.get(vendor, "TIC_9.Kp")
    row = f"{more} {'REAL 2.5' if '.' in more else '0001'}\n"
    part = pidcfg.encode(FILES[vendor], changed_from=listing + row)
    assert part.merged == (f"stays as it is, since no loop has it any more: {more}",)
    assert pidcfg.encode(FILES[vendor], changed_from=listing).merged == ()


def test_what_a_whole_program_has_besides_is_no_loop_of_old():
    view = pidcfg.encode(edited(FILES["click"], ("C101", "C301")), "cdv").text
    assert pidcfg.encode(FILES["click"], changed_from=view.encode("utf-16-le")).merged == ()


@pytest.mark.parametrize(("vendor", "name", "able"), [
    ("click", "nickname-csv", "text, csv, json, modbus, cdv"), ("ezlogix", "tags", "text, csv, json"),
    ("dpide", "operands", "text, csv, json"), ("nextopid", "st", "text, csv, json"),
])  # fmt: skip
def test_a_format_that_cannot_be_partial_names_those_that_can(vendor, name, able):
    with pytest.raises(ValueError, match=f"{name} is not written in part .*; {able} are"):
        pidcfg.encode(FILES[vendor], name, changed_from="anything")


def test_what_runs_is_not_written_and_a_set_point_is_named():
    listing = upload(edited(REACTOR, ("gain: 2.50", "gain: 2")), **RUNNING, V2102="0900")
    result = pidcfg.encode(REACTOR, changed_from=listing)
    assert words(result.text, "dl06") == {0o2050: 0x0250, 0o2102: 0x0800}
    assert result.merged[0] == "written, although it may be set while the PLC runs: LIC-103 setpoint.value"
    assert result.merged[1].startswith("left out, since the PLC or the process writes it: TIC-101 state.pv")
    whole = pidcfg.encode(REACTOR, changed_from=listing, live=True)
    assert words(listing, "dl06") | words(whole.text, "dl06") == words(upload(REACTOR), "dl06")


def test_nothing_that_differs_is_no_file():
    result = pidcfg.encode(FILES["click"], "cdv", changed_from=pidcfg.encode(FILES["click"]).text)
    assert (result.ok, dict(result.files), result.image.cells) == (True, {}, ())
    unread = pidcfg.encode(FILES["click"], "cdv", changed_from="nothing", changed_from_name="upload.txt")
    assert (unread.ok, [(d.code, d.file) for d in unread.findings][-1]) == (False, ("PID041", "upload.txt"))


def test_the_command_says_that_nothing_differs_and_writes_no_file(tmp_path, capsys, monkeypatch):
    (tmp_path / "upload.txt").write_text(pidcfg.encode(FILES["click"]).text, "utf-8")
    out = tmp_path / "part.cdv"
    args = [
        "encode",
        str(EXAMPLES / "click/tank.yaml"),
        "--format",
        "cdv",
        "--changed-from",
        str(tmp_path / "upload.txt"),
    ]
    monkeypatch.setattr("sys.argv", ["pidcfg", *args, "-o", str(out)])
    with pytest.raises(SystemExit) as end:
        main()
    assert (end.value.code or 0, out.exists()) == (0, False)
    assert "nothing differs" in capsys.readouterr().err


def test_live_needs_a_listing():
    with pytest.raises(ValueError, match="`live` is for `changed_from` only"):
        pidcfg.encode(REACTOR, live=True)


# --- tables and measures ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("vendor", VENDORS.values(), ids=list(VENDORS))
def test_who_writes_what_is_about_registers_that_there_are(vendor):
    beside = {"mode", "signals"}
    names = set()
    for table in vendor.load("registers"):
        names |= {row.name for row in (table.rows if isinstance(table, ParameterTable) else table.words)}
    table = vendor.load("written")
    assert {row.name for row in table} <= names | beside
    assert all(row.writer and str(row.basis) for row in table)


@pytest.mark.parametrize("vendor", diff_spoil.STRATEGIES)
def test_every_changed_key_of_random_files_is_seen(vendor):
    """Of a DL06 more files are drawn: in the first ones a change hardly ever leaves a file that can be used."""
    score = diff_spoil.score_of(vendor, 6 if vendor == "dl06" else 3, 4)
    assert score.changes
    assert (dict(score.unseen), dict(score.untrue)) == ({}, {})


def test_a_move_that_is_written_in_another_way_is_the_same():
    one = {"move": "-203", "to": "A.Kp", "when": "NOT (((0.0174 + X) < 1))", "at": "start"}
    two = {"move": -203.0, "to": "A.Kp", "when": "NOT (0.0174 + X < 1.0)", "at": "start"}
    assert move_content(one) == move_content(two)
    for change in ({"move": "-203.5"}, {"to": "A.Ki"}, {"when": "NOT (0.0174 + Y < 1)"}, {"at": "end"}):
        assert move_content(one | change) != move_content(two)


@pytest.mark.parametrize(
    ("line", "changed", "word"),
    [
        ("ramp_to: 60.0", "ramp_to: 61.0", "ramp_soak[0].ramp_to"),
        ("slope: 0.05", "slope: 0.06", "ramp_soak[1].slope"),
        ("soak: 30.0", "soak: 31.0", "ramp_soak[1].soak"),
        (
            "ramp_to: 85.0, slope: 0.05, soak: 30.0, deviation: 2.0",
            "ramp_to: 85.0, slope: 0.05, soak: 30.0, deviation: 3.0",
            "ramp_soak[1].deviation",
        ),
    ],
)
def test_a_changed_step_of_a_profile_is_the_one_word_written(line, changed, word):
    old = upload(REACTOR)
    result = pidcfg.encode(edited(REACTOR, (line, changed)), "csv", changed_from=old)
    assert [row.rpartition(",")[2] for row in result.text.splitlines() if row.startswith("V")] == [word]


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (2.3721e-41, "2.3721e-41"),
        (-1e300, "-1e+300"),
        (0.000001, "0.000001"),
        (1234567.5, "1234567.5"),
        (10**19, "1" + "0" * 19),
    ],
)
def test_numbers_are_short(value, text):
    assert text_of(value) == text
    assert float(text_of(value)) == value


def test_a_move_at_the_start_has_no_place_among_those_at_the_end():
    """A program has the moves before all blocks first, wherever the file has them."""
    text = (EXAMPLES / "nextopid/cascade.yaml").read_text("utf-8").split("\nmoves:")[0]
    to = (("TIC_1", ""), ("TIC_2", ", at: start"), ("FIC_3", ""), ("TIC_1", ", at: start"))
    moves = [f"{{move: {i}, to: {name}.ManualMV, when: {name}.Manual{at}}}" for i, (name, at) in enumerate(to)]
    same, other = ([moves[i] for i in order] for order in ((1, 3, 0, 2), (3, 0, 1, 2)))
    one, two, three = (f"{text}\nmoves:\n" + "".join(f"  - {move}\n" for move in rows) for rows in (moves, same, other))
    assert pidcfg.diff(one, two).same
    assert not pidcfg.diff(one, three).same


@pytest.mark.parametrize("vendor", [vendor for vendor in FILES if vendor != "generic"])
def test_what_differs_from_a_configuration_are_the_words_that_differ(tmp_path, vendor):
    """An edit a line of the example: exactly the words of which both files have other contents, set points too."""
    before = {cell.address: cell.raw for cell in pidcfg.encode(FILES[vendor]).image.cells}
    old, new, counts = tmp_path / "old.yaml", tmp_path / "new.yaml", []
    old.write_text(FILES[vendor], "utf-8")
    for change in spoiled(FILES[vendor], 40, 0.5, MILD):
        after = pidcfg.encode(change.text, name="new.yaml")
        if not after.ok:
            continue
        new.write_text(change.text, "utf-8")
        part = pidcfg.encode(new, "json", changed_from=old)
        wanted = {cell.address for cell in after.image.cells if before.get(cell.address) != cell.raw}
        assert {cell.address for cell in part.image.cells} == wanted, change[0]
        counts.append(len(wanted))
    assert sum(map(bool, counts)) > 5


def test_a_configuration_to_compare_with_that_is_wrong_is_told(tmp_path):
    (tmp_path / "old.yaml").write_text(FILES["click"], "utf-8")
    with pytest.raises(
        ValueError, match="`changed_from` is a file of AutomationDirect CLICK, not of AutomationDirect Dir"
    ):
        pidcfg.encode(REACTOR, changed_from=tmp_path / "old.yaml")
    (tmp_path / "old.yaml").write_text("pidcfg: 1\nvendor: dl06\nloops: 3\n", "utf-8")
    result = pidcfg.encode(REACTOR, changed_from=tmp_path / "old.yaml")
    assert not result.ok
    assert result.findings[-1].file == str(tmp_path / "old.yaml")
    assert result.findings[-1].message == "plc is missing"


# --- Pieces of a comparison key by key --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("access", "plain"), [("setting", "setting"), ("reserved", "reserved"), ("status", "live"), ("request", "live")]
)
def test_a_register_is_whose_the_writers_say_or_its_access(access, plain):
    assert item_kind(access, None) == plain
    for kind, whose in (("live", "live"), ("operated", "operated"), ("compared", "setting")):
        assert item_kind(access, Writer("sp", kind, "the program", CLICK)) == whose


def test_what_is_refused_is_told_at_its_keys_or_as_one_of_its_own():
    items = {key: Item(key) for key in ("pv.range.0", "pv.range.1", "gain")}
    found = add_faults(items, {"pv.range": "it does not ascend", "output.unit": "it is missing"})
    assert {key: item.fault for key, item in found.items()} == {
        "pv.range.0": "it does not ascend",
        "pv.range.1": "it does not ascend",
        "gain": "",
        "output.unit": "it is missing",
    }
    assert add_faults(items, {}) == items


@pytest.mark.parametrize("fault", ["", "line 3 is no row"])
@pytest.mark.parametrize("partial", [False, True])
def test_a_listing_holds_a_parameter_that_it_has_or_that_is_not_there_in_a_whole_one(partial, fault):
    cell = Entry("A.SV", REAL, 5.0, "SV", "A")

    def content(**words):
        listing = Facts(words={f"A.{name}": word for name, word in words.items()})
        return _cell_content(cell, Facts(listing=listing, partial=partial, fault=fault, unreadable={"A.SV": "no"}))

    assert _cell_content(cell, None) == (5.0, "", True)
    assert content(PV=3.0) == (5.0, "", not partial and not fault)
    assert content(SV=7.0) == (7.0, "no", True)
    assert content(SV=True) == (True, "no", True)


def test_a_listing_that_no_configuration_places_has_its_words_and_what_stands_beside_them():
    plc = {"name": "Oven", "scan": {"time": 2, "free": None}}
    listing = Listing(words={"OVEN.SV": 80.0}, shown_addresses={"OVEN.SV": "OVEN.SV"}, plc=plc)
    terms = raw_terms(listing, VENDORS["dpide"])
    (owner,) = terms.owners
    assert {key: item.value for key, item in owner.items.items()} == {
        "OVEN.SV": 80.0,
        "plc.name": "Oven",
        "plc.scan.time": 2,
    }
    assert terms.is_listing
    assert terms.has_address("OVEN.SV")
    assert not terms.has_address("OVEN.PV")


def test_a_field_has_its_neutral_name_also_where_a_scale_has_no_range():
    text = """\
pidcfg: 1
vendor: dl06
plc: {loop_table: V2000}
loops:
  - {name: A, sample_rate: 1, action: direct, tuning: {gain: 2, reset: 10, rate: 1}, error: {deadband: 3 counts}}
"""
    changed = edited(
        text, ("rate: 1,", "rate: 2,"), ("reset: 10, rate: 1", "reset: 11, rate: 3"), ("3 counts", "4 counts")
    )
    (loop,) = pidcfg.diff(text.encode(), changed.encode()).loops
    assert {difference.field: difference.key for difference in loop.differences} == {
        "sample_time": "sample_rate",
        "tuning.integral_time": "tuning.reset",
        "tuning.derivative_time": "tuning.rate",
        "deadband": "error.deadband",
    }
