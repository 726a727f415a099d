"""What `explain` says: five questions checked against the manuals, and everything that the tables hold."""

from __future__ import annotations

import json
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

import explained
import pidcfg
from pidcfg.cli.commands.explain import command
from pidcfg.cli.main import cli
from pidcfg.encoders.maps import click as click_meanings
from pidcfg.encoders.maps import dl06 as dl06_meanings
from pidcfg.encoders.maps import dpide as dpide_meanings
from pidcfg.encoders.maps import ezlogix as ezlogix_meanings
from pidcfg.encoders.maps import nextopid as nextopid_meanings
from pidcfg.encoders.maps.click import ERRORS
from pidcfg.encoders.maps.dl06 import LOOP_TABLE, SETUP_WORDS
from pidcfg.encoders.maps.nextopid import BLOCK_TYPES
from pidcfg.encoders.parameters import ParameterTable
from pidcfg.encoders.regmap import Meaning, RegisterMap
from pidcfg.output.explanation import QuestionError, as_text
from pidcfg.output.explanation import explanation_data as as_data
from pidcfg.output.explanation.lookup import all_decisions, explain_question, explain_things
from pidcfg.output.explanation.page import Question
from pidcfg.schemas.base import unit_text, units_of
from pidcfg.schemas.document import models_in
from pidcfg.sim.controllers.ezlogix import equation as ezlogix_autotune
from pidcfg.text.source import read_document
from pidcfg.validate import rule_page as page_text
from pidcfg.validate.catalog import find_rules, text_of
from pidcfg.vendors import VENDORS

EXAMPLES = Path(__file__).parents[1] / "examples"
STARTERS = Path(__file__).parents[1] / "src/pidcfg/cli/starters"
ALL = list(VENDORS)


def pages(text, *, vendor=None, loop=False, starts=()):
    """The explanations of a thing."""
    return explain_question(
        Question.parse(text, at_example=loop, starts=tuple(starts)), [vendor] if vendor else ALL, all_decisions
    )


def run(*args):
    """The command in this process."""
    return CliRunner().invoke(command, list(args))


def active(page):
    """The bits that are on."""
    return [(point.label, point.title) for point in page.points if point.active]


# --- the five questions, checked against the manuals ---------------------------------------------------------------


def test_v7642_tells_its_four_bits():
    (page,) = pages("V7642")
    assert (page.vendor, page.title, page.access) == ("dl06", "Loop error flags", "status")
    assert [point.label for point in page.points] == ["bit 0", "bit 1", "bit 2", "bit 3"]
    assert all(point.meaning and point.meaning.effect and point.meaning.cure for point in page.points)
    assert [point.meaning.rules for point in page.points] == [("DL201",), ("DL202",), ("DL203",), ("DL204",)]
    assert page.reference == "DL06 manual ch. 8, PID Error Flags, V7642"
    assert "below V10000 that is not within V1200 to V7340" in page.points[0].meaning.effect


@pytest.mark.parametrize("value", ["0008", "8", "0x0008", "0x8", "8h"])
def test_v7642_with_bit_3(value):
    (page,) = pages(f"V7642={value}")
    assert page.value.shown == "0008"
    assert active(page) == [("bit 3", "The loop table extends past V7577")]
    (point,) = [p for p in page.points if p.active]
    assert "no loop is calculated" in point.meaning.effect
    assert "closer to V1200" in point.meaning.cure


def test_a_word_of_the_loop_table():
    result = run("V2006=0x0402", "--loop")
    assert result.exit_code == 0
    assert "V2006 = 0402: Loop mode and alarm status" in result.output
    (page,) = pages("V2006=0x0402", loop=True)
    assert active(page) == [("bit 1", "Automatic mode"), ("bit 10", "Alarm value programming error")]
    assert page.place == "+06 of loop 1 of a table at V2000"
    assert "DL242" in page.points[10].meaning.rules
    (other,) = pages("V3046=0402", starts=("V3000",))
    assert other.place == "+06 of loop 2 of a table at V3000"
    assert active(other) == active(page)


def test_click_error_27_is_the_reset_time():
    (page,) = pages("CK27")
    assert (page.vendor, page.name) == ("click", "PID error 27")
    assert page.title == "reset time (DFn+06) is not within 0.01 to 6000 s"
    assert "Manual" in page.meaning.effect
    assert page.reference == "CLICK help CL248, CLICK PID Errors"


def test_an_offset_is_octal_and_its_bit_decimal():
    (page,) = pages("addr+06.10")
    assert (page.title, page.kind) == ("Alarm value programming error", "bit")
    assert page.reference == "DL06 manual ch. 8, Alarm Programming Error"
    assert pages("addr+10")[0].title == "Gain (proportional)", "octal: the ninth word"
    assert pages("Addr + 06=0402")[0].points[10].state == "on"


# --- everything that the tables hold ---------------------------------------------------------------------------------


@pytest.mark.parametrize("vendor", ALL)
def test_every_address_and_parameter_is_explained(vendor):
    book = VENDORS[vendor].load("explainer")
    for block in getattr(book, "blocks", ()):
        start = book.space.parse(block.start)
        for word in block.table.words:
            for value in ("", "=0"):
                name = book.space.name(start + word.offset)
                thing = f"{name}{value}" if block.is_in_loop else f"ramp+{word.offset:o}{value}"
                (page,) = pages(thing, vendor=vendor, loop=True)
                assert page.title == word.title
                assert page.reference
                assert word.access in {"reserved", "status", "request"} or page.holds or page.points, word.name
                assert word.access == "reserved" or page.holds or page.meaning or page.points, word.name
                as_text([page])
    for key, table in getattr(book, "tables", {}).items():
        for row in table.rows:
            found = pages(f"{key}.{row.name}", vendor=vendor)
            assert found, row.name
            assert all(page.title for page in found), row.name


@pytest.mark.parametrize("vendor", VENDORS)
def test_every_name_is_explained_as_somebody_has_read_it(vendor):
    assert explained.pages(vendor) == (explained.FOLDER / f"{vendor}.txt").read_text("utf-8")


def test_all_tables_of_all_vendors_are_in_their_books():
    for key, vendor in VENDORS.items():
        book = vendor.load("explainer")
        for table in vendor.load("registers"):
            if isinstance(table, RegisterMap):
                assert table in [block.table for block in book.blocks], (key, table.title)
            else:
                assert isinstance(table, ParameterTable)
                assert table in book.tables.values(), (key, table.title)


@pytest.mark.parametrize(
    ("asked", "title"), [("TIC_101_SP", "Setpoint (SP)"), ("SEL_DirectReverse", "Forward (direct) or reverse action")]
)
def test_a_tag_is_explained_with_the_name_of_its_loop_or_without_the_underscore(asked, title):
    assert [(page.vendor, page.title) for page in pages(asked)] == [("click", title)]
    with pytest.raises(QuestionError, match="nothing is known"):
        pages("TIC_101_nothing")


@pytest.mark.parametrize("vendor", ALL)
def test_every_name_that_is_offered_is_explained_in_both_spellings(vendor):
    book = VENDORS[vendor].load("explainer")
    for small, name in book.spellings.items():
        assert [page.title for page in pages(small, vendor=vendor)] == [
            page.title for page in pages(name, vendor=vendor)
        ]


@pytest.mark.parametrize(
    ("unit", "text", "divided"),
    [
        ("pv", "m3/h", "m3/h"),
        ("pv/s", "m3/h/s", "m3/h per s"),
        ("output/pv", "%/m3/h", "% per m3/h"),
        ("output per pv/s", "% per m3/h/s", "% per m3/h per s"),
        ("s, or min by reset_unit", "s, or min by reset_unit", "s, or min by reset_unit"),
        ("", "", ""),
    ],
)
def test_a_unit_is_told_in_the_words_of_the_loop(unit, text, divided):
    units = units_of({"pv": {"unit": "m3/h"}, "output": {"unit": "%"}, "setpoint": {"unit": "x"}})
    assert units == {"pv": "m3/h", "output": "%"}
    assert unit_text(unit, units, "/") == text
    assert unit_text(unit, units) == divided


@pytest.mark.parametrize(
    ("unit", "pv", "output", "text"),
    [
        ("pv/s", "", "%", "per s"),
        ("output/cycle", "degC", "", "per cycle"),
        ("output/pv", "degC", "", "per degC"),
        ("output/pv", "", "kg/h", "kg/h"),
        ("output/pv", "", "", ""),
        ("output per pv/s", "", "%", "% per s"),
    ],
)
def test_a_part_without_a_unit_is_left_out(unit, pv, output, text):
    assert unit_text(unit, {"pv": pv, "output": output}) == text


def test_units_are_those_of_a_model_too_and_none_where_none_is_said():
    path = EXAMPLES / "click/tank.yaml"
    (loop,) = VENDORS["click"].model.model_validate(read_document(path.read_bytes(), path.name).data).loops
    assert units_of(loop) == {"pv": "degF", "output": "%"}
    assert units_of({"pv": {}, "output": "OR1"}) == {}


def test_every_status_bit_of_the_dl06_has_a_meaning():
    rows = [
        (table, row) for table in (SETUP_WORDS, LOOP_TABLE) for row in table.bits if row.access in {"status", "request"}
    ]
    names = {(w.name, row.bits[0]) for t, row in rows for w in t.words if w.offset == row.offset}
    names -= {("mode_setting_2", 7)}
    assert names | {("mode_setting_2", 7)} == set(dl06_meanings.BIT_MEANINGS)


@pytest.mark.parametrize(
    ("bit", "places"),
    [
        (("error_flags", 0), "V7640 V10000 V1200 V7340 V7640 V1200 V7340 V10000 V17740"),
        (("error_flags", 1), "V7640 V17740 V7640 V10000 V17740 V1200 V7340"),
        (("error_flags", 2), "V7641 V7641"),
        (("error_flags", 3), "V7577 V1200 V7640 V7641"),
        (("ramp_soak_errors", 0), "V10000"),
        (("ramp_soak_errors", 1), "V10000"),
        (("ramp_soak_errors", 4), "V7600 V7777"),
    ],
)
def test_what_a_flag_of_the_dl06_says_of_places_is_what_the_manual_says(bit, places):
    """Appendix of reserved memory: V1200 to V7577 and V10000 to V17777 are the user's, V7600 to V7777 the system's."""
    meaning = dl06_meanings.BIT_MEANINGS[bit]
    text = f"{meaning.effect} {meaning.cure}".replace(dl06_meanings.RECHECK_ADVICE, "")
    assert re.findall(r"V[0-7]+", text) == places.split()
    assert (" above " in meaning.effect) == (bit[1] == 1)


@pytest.mark.parametrize("module", [click_meanings, dl06_meanings, ezlogix_meanings, nextopid_meanings])
def test_every_meaning_is_a_sentence_about_the_effect(module):
    tables = [table.values() for table in vars(module).values() if isinstance(table, dict)]
    rows = [row for table in tables for row in table if isinstance(row, Meaning)]
    assert rows
    assert all(row.effect.endswith(".") for row in rows)


def test_every_error_number_and_status_has_a_meaning():
    assert [code.number for code in click_meanings.CODES] == [0, *(error.number for error in ERRORS)]
    assert [code.number for code in ezlogix_meanings.CODES] == list(range(11))
    assert ezlogix_meanings.CODES[ezlogix_autotune.NO_MEMORY].title == "low memory"
    assert ezlogix_meanings.CODES[ezlogix_autotune.NO_STEP].title == "the CV could not be incremented"
    assert [(code.register, code.number) for code in dpide_meanings.CODES] == [("PID_MODE", mode) for mode in (0, 1, 2)]
    for prefix, codes in (("CK", click_meanings.CODES), ("AT", ezlogix_meanings.CODES)):
        for code in codes:
            (page,) = pages(f"{prefix}{code.number}")
            assert page.title == code.title
            assert page.meaning.effect
    never_written = [code.number for code in click_meanings.CODES if click_meanings.UNWRITTEN_TEXT in code.meaning.cure]
    assert never_written == [error.number for error in ERRORS if error.low is not None and error.low > 0]
    states = {(name, on) for name, _ in nextopid_meanings.STATES for on in (True, False)}
    assert states == set(nextopid_meanings.STATES)
    for start, effect in (
        ("ErrBits.", nextopid_meanings.STOPPED_TEXT),
        ("AutoTuneResult.Bad_", nextopid_meanings.ENDED_TEXT),
    ):
        rows = [meaning for name, meaning in nextopid_meanings.BITS.items() if name.startswith(start)]
        assert {row.effect for row in rows} == {effect}
    bits = {r.name for kind in BLOCK_TYPES.values() for r in kind.outputs if "." in r.name and r.type.kind == "bool"}
    assert bits == set(nextopid_meanings.BITS)
    assert {name for name, _ in dpide_meanings.STATES} == {
        row.name for row in VENDORS["dpide"].load("registers")[0].rows if row.type.kind == "bool"
    }


def test_every_switch_that_tells_what_true_is_has_both_states():
    books = [book for key in ALL if hasattr(book := VENDORS[key].load("explainer"), "tables")]
    assert books
    for book in books:
        switches = [(table, row) for table, rows in book.tables.items() for row in rows.rows if row.type.kind == "bool"]
        names = {row.name for table, row in switches if book.parameter_text(table, row).startswith(("TRUE", "FALSE"))}
        assert names
        assert {(name, state) for name in names for state in (True, False)} <= set(book.states)
    assert {page.title.partition(" [")[0] for page in pages("Direct=FALSE")} == {"a switch"}
    result = run("Direct=FALSE", "PID_MAN=1", "PID_DIR=0", "PID_MODE=2")
    assert not re.search(r"TRUE: TRUE|FALSE: TRUE|\n  off ", result.output)


# --- what must not mislead -------------------------------------------------------------------------------------------

DIRECTION = re.compile(r"wrong way round|the controller action is the wrong one|a wrong controller action")


def test_no_meaning_sends_people_to_turn_the_direction_round():
    for meaning in every_meaning():
        assert not DIRECTION.search(f"{meaning.effect} {meaning.cure}")
    (output,) = pages("addr+05")
    assert "right while the PV of a heating loop is above its SP" in output.meaning.effect
    assert "Never change bit 4 before" in output.meaning.cure


def test_a_cure_that_stops_the_machine_says_so():
    cures = [meaning.cure for meaning in every_meaning() if "Program to Run" in meaning.cure]
    assert len(cures) == 7
    assert all("This stops the machine" in cure and "in Manual" in cure for cure in cures)
    assert pages("addr+31")[0].writer.endswith("changes between Program and Run, and Program mode stops the machine")


def test_a_reading_that_no_manual_prints_says_so():
    for name in ("Cn+06=1", "Cn+07", "Cn+09=1"):
        (page,) = pages(name)
        assert "inferred, not printed" in page.meaning.effect
        assert "D100" in page.reference
    assert (
        "Forward/Reverse in the PID window before the first Auto" in pages("action", vendor="click")[0].meaning.effect
    )
    assert pages("action", vendor="click")[0].meaning.rules == ("CK308",)


def test_the_start_of_the_autotune_is_told_as_by_the_rule():
    (page,) = pages("addr+06.13")
    cure = page.points[0].meaning.cure
    assert "at least 205 counts" in cure
    assert "below the SP of a direct-acting loop, above that of a reverse-acting one (D28)" in cure
    assert page.points[0].meaning.rules == ("DL299", "DL501")
    assert "the gains are new all the same (D29)" in page.points[0].meaning.effect


def test_after_an_auto_tuning_nothing_controls():
    results = {name: m for name, m in nextopid_meanings.BITS.items() if name.startswith("AutoTuneResult.")}
    assert len(results) == 14
    for meaning in results.values():
        assert "nothing controls until AutoTune is FALSE" in meaning.effect
        assert "Switch AutoTune off" in meaning.cure


def test_the_dead_band_of_the_switch_has_no_zero():
    (own,) = pages("ControlON_OFF.ErrBits.DeadBand")
    assert own.meaning.cure.startswith("Set DeadBand above 0")
    (group,) = pages("ControlON_OFF.ErrBits=3")
    assert "Set DeadBand above 0" in " ".join(p.meaning.cure for p in group.points)
    both = pages("ErrBits.DeadBand")
    assert [("ControlON_OFF" in p.title, "above 0" in p.meaning.cure) for p in both] == [(False, False), (True, True)]


def test_a_limit_is_no_first_thing_to_widen():
    (page,) = pages("AT5")
    assert page.meaning.cure.index("Bring the CV") < page.meaning.cure.index("only if the plant bears it")
    assert "put it back" in page.meaning.cure


@pytest.mark.parametrize(
    ("thing", "by"),
    [
        ("addr+03", "the ladder program, or the PLC by auto transfer (+36)"),
        ("addr+04", "the PLC; the program too, for feedforward"),
        ("addr+05", "the PLC in Automatic and Cascade; in Manual the operator or the program"),
        ("addr+06", "the PLC: it is a status, only to be read"),
        ("DFn+11", "the program"),
        ("DFn+08", "the PLC in Auto; in Manual the operator or the program"),
        ("DPIDE.I_MV", "the PLC; the program may read, clear or change it"),
    ],
)
def test_who_writes_a_word(thing, by):
    assert [page.writer for page in pages(thing)] == [by]


def test_errors_of_the_click_name_what_can_be_their_cause():
    codes = {code.number: code for code in click_meanings.CODES}
    never = {number for number, code in codes.items() if "never written" in code.meaning.cure}
    assert never == {10, 12, 13, 26, 27, 200}, "their 0 is not allowed"
    assert "100 to 30000 ms" in codes[10].title
    assert codes[21].meaning.rules == codes[22].meaning.rules == ()
    assert codes[23].meaning.rules == ("CK311", "CK312")
    assert "an upper bound too, which is not known" in codes[30].meaning.cure


def test_a_block_by_its_name():
    (page,) = pages("PIDA_REAL")
    assert (page.kind, page.holds.partition(",")[0]) == ("structure", "SP")


def every_meaning():
    """All meanings of all vendors."""
    return [
        *dl06_meanings.BIT_MEANINGS.values(),
        *dl06_meanings.WORD_MEANINGS.values(),
        *click_meanings.WORD_MEANINGS.values(),
        *ezlogix_meanings.WORD_MEANINGS.values(),
        *nextopid_meanings.BITS.values(),
        *nextopid_meanings.GROUPS.values(),
        *nextopid_meanings.BLOCK_BITS.values(),
        *(c.meaning for m in (click_meanings, ezlogix_meanings, dpide_meanings) for c in m.CODES),
    ]


ADVICE = frozenset(
    (
        *("Bring", "Call", "Compare", "End", "Let", "Look", "Lower", "Make", "Open", "Put", "Raise", "See", "Set"),
        *("Start", "Stay", "Switch", "Try", "Tune", "Wait,", "Wait.", "Watch", "Write"),
    )
)
"""How a cure begins."""


def test_an_effect_is_no_advice_and_no_text_is_both():
    texts = [(meaning.effect, meaning.cure) for meaning in every_meaning()]
    assert not [effect for effect, _ in texts if effect.split()[0] in ADVICE]
    assert not {effect for effect, _ in texts} & {cure for _, cure in texts}
    plain = [cure for _, cure in texts if cure and cure.split()[0] not in ADVICE]
    assert {" ".join(cure.split()[:3]) for cure in plain} == {
        *("A broken sensor", "If it stays", "Normal after a", "Normal for a", "Right while a", "The loop does"),
        *("The wrong direction", "To control, set"),
    }, "what to think of it"


def test_every_rule_that_a_meaning_names_exists():
    assert {rule for meaning in every_meaning() for rule in meaning.rules} <= set(find_rules())


@pytest.mark.parametrize(
    ("vendor", "example"), [(key, row[1]) for key in ALL for row in VENDORS[key].load("explainer").examples]
)
def test_every_form_that_is_offered_works(vendor, example):
    args = example.split()
    result = run(*args, "--vendor", vendor)
    assert result.exit_code == 0, result.output
    assert VENDORS[vendor].title in result.output
    assert example in run().output


# --- contents --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("thing", "says"),
    [
        ("gain=0125", "1.25 %/%"),
        ("gain=0000", "0 %/%: switched off"),
        ("loop_table=0400", "V2000, room for 8 loops"),
        ("pv_transfer=0102", "base 0, slot 1, channel 2: the CPU reads it itself"),
        ("pv_transfer=8400", "V2000: the CPU reads this word"),
        ("DFn+05=2.5", "2.5"),
        ("DSn+05=500", "0.5 s"),
        ("Cn+09=1", "reverse (inferred, not printed: compare the PID window, D100)"),
        ("Cn+06=0", "open (inferred, not printed: compare the PID window, D100)"),
        ("output_transfer=0102", "base 0, slot 1, channel 2: the CPU writes it itself"),
        ("output_transfer=8100", "V400: not allowed, the output goes to a slot and channel only"),
        ("pv_transfer=0910", "base 0, slot 9, channel 16: not allowed, only slot 1 to 4"),
        ("pv_transfer=0A20", "base 0, slot 10, channel 32: not allowed, only slot 1 to 4, channel 1 to 16"),
        ("pv_transfer=1102", "base 1, slot 1, channel 2: not allowed, only base 0"),
        ("pv_transfer=8200", "V1000: not allowed, only V400 to V677, V1200 to V7377, V10000 to V17777"),
        ("addr+24=0010", "1"),
        ("addr+24=0020", "2 (above 1 the filter is switched off)"),
        ("addr+25=0020", "20"),
        ("addr+25=0030", "30 (not within 0 to 20)"),
        ("V7641=0008", "8"),
        ("V7641=0009", "9: no loop runs; bit 2 of V7642 goes on (The number of loops is greater than 8)"),
        (
            "V7641=00A1",
            "A1, no BCD number: no loop runs; bit 2 of V7642 goes on",
        ),
        ("V7641=0000", "0: no loop runs"),
        ("V7640=0EE0", "V7340, room for 5 loops; more than 5 do not fit and set bit 3 of V7642"),
        (
            "V7640=0EE1",
            "V7341: no loop runs; bit 0 of V7642 goes on (The loop table starts outside the lower V-memory range)",
        ),
        (
            "V7640=2000",
            "V20000: no loop runs; bit 1 of V7642 goes on (The loop table starts outside the upper V-memory range)",
        ),
        ("V7640=1FE0", "V17740, room for 1 loop; more than 1 do not fit"),
        ("addr+07=0000", "0 s (not within 0.05 to 99.99)"),
        ("addr+11=1500", "150 s, or min by reset_unit (15 if the word has two decimals: D01)"),
        ("addr+11=9999", "999.9 s, or min by reset_unit: switched off"),
        ("ramp+01=0205", "2.05 counts of the data format a second"),
        ("ramp+01=0000", "0 counts of the data format a second: ends the profile"),
        ("integral_time=60001", "6000.1 s (not within 0 to 6000)"),
        ("PID_MODE=3", "3 (no mode; the modes are 0, 1, 2)"),
        ("PID_MODE=-1", "-1 (no mode; the modes are 0, 1, 2)"),
        ("CYCLE=0", "0 ms (the PLC takes 1 ms)"),
        ("CYCLE=40000", "40000 ms"),
        ("CYCLE=50000", "50000 ms (the PLC takes 40000 ms)"),
        ("Kc_Kp=-2", "-2 (counts as 0: no proportional term, in the dependent form no control at all)"),
        ("Ti_Ki=0", "0 (no integral)"),
        ("PIDA_REAL.Direct=FALSE", "reverse: MV falls when PV rises (heating)"),
        ("ControlON_OFF.Direct=TRUE", "direct: MV rises when PV rises (cooling)"),
        ("TANK1_PID_ErrorCode=0", "no PID error"),
        ("Base+12=9", "a gain or time is out of range"),
        ("integral_time=125", "12.5 s"),
        ("error=65535", "-1 counts of the PV"),
        ("PID_MODE=1", "autotune"),
        ("PID_DIR=FALSE", "reverse, E = PV - SV: MV rises while PV is above SV (cooling)"),
        ("AutoTuneParam.Mode=PI", "AUTOTUNE_PI"),
    ],
)
def test_contents_in_words(thing, says):
    assert says in [page.value.text for page in pages(thing)]


def test_counts_without_a_data_format_are_told_for_each():
    (page,) = pages("setpoint=0800", vendor="dl06")
    assert page.value.text == (
        "of the data format's range: 12-bit unipolar 50.01 %, 12-bit bipolar 75.01 %, 15-bit unipolar 6.25 %, "
        "15-bit bipolar 53.13 %, 16-bit unipolar 3.125 % (decimal 2048)"
    )


@pytest.mark.parametrize(
    ("thing", "problem"),
    [("gain=12A5", "digit above 9"), ("reset=FFFF", "digit above 9"), ("CK29", None), ("DSn+00=29", "does not list")],
)
def test_contents_that_say_nothing_say_why(thing, problem):
    page = pages(thing)[0]
    assert problem is None or problem in page.value.problem
    assert problem is not None or "does not list" in page.title


@pytest.mark.parametrize(
    ("thing", "says"),
    [
        ("+8=1000", "Min Duty Cycle 24.41 %"),
        ("+9=4095", "Max Duty Cycle 99.98 %"),
        ("+8=0", "Min Duty Cycle 0 %"),
        ("+9=4096", "4096 counts (not within 0 to 4095, the range of the CV)"),
    ],
)
def test_a_cv_limit_shows_the_duty_cycle_of_the_dialog(thing, says):
    """((CV_LowLimit/4096)*100), as the manual prints it."""
    (page,) = pages(thing, vendor="ezlogix")
    assert says in page.value.text
    assert "Duty" not in pages("+10=1000", vendor="ezlogix")[0].value.text


def test_a_number_that_no_list_has_says_its_name_once():
    for thing in ("CK29", "AT11"):
        (page,) = pages(thing)
        first = as_text([page]).partition("\n")[0]
        assert first.startswith(f"{page.name}: a number that the ")
        assert first.count(page.name) == 1


@pytest.mark.parametrize(
    ("vendor", "thing", "name"),
    [
        ("click", "26", "PID error 26"),
        ("click", "200", "PID error 200"),
        ("click", "29", "PID error 29"),
        ("ezlogix", "5", "autotune status 5"),
        ("ezlogix", "11", "autotune status 11"),
        ("ezlogix", "+12=5", "Base+12"),
    ],
)
def test_a_number_alone_is_the_one_that_the_plc_shows(vendor, thing, name):
    (page,) = pages(thing, vendor=vendor)
    assert (page.vendor, page.name) == (vendor, name)


@pytest.mark.parametrize(("thing", "vendors"), [("26", {"click"}), ("5", {"ezlogix"}), ("10", {"click", "ezlogix"})])
def test_a_number_alone_is_explained_by_every_vendor_that_lists_it(thing, vendors):
    assert {page.vendor for page in pages(thing)} == vendors


def test_a_number_that_no_vendor_lists_is_nothing_unless_one_vendor_is_asked():
    with pytest.raises(QuestionError, match="nothing is known of '29'"):
        pages("29")
    with pytest.raises(QuestionError, match="nothing is known of '26'"):
        pages("26", vendor="dl06")


def test_a_structure_counts_its_bits_in_the_order_of_its_members():
    found = pages("ErrBits=0x0005")
    assert [active(page) for page in found] == [
        [
            ("bit 0", "MaxMinMV: MaxMV is not above MinMV"),
            ("bit 2", "Kp: Kp is not above 0 (dependent form), or negative (independent form)"),
        ],
    ]
    assert "ControlON_OFF" not in found[0].title, "it has two bits only"
    assert "D325" in found[0].reference
    (page,) = pages("AutoTuneResult=32")
    assert [label for label, _ in active(page)] == ["bit 5"]
    assert active(page)[0][1].startswith("MV_TOO_HIGH")


def test_a_name_that_several_vendors_have_is_explained_for_each():
    found = pages("sample_rate")
    assert [page.vendor for page in found] == ["dl06", "click", "ezlogix"]
    assert [page.vendor for page in pages("sample_rate", vendor="click")] == ["click"]


# --- what cannot be explained ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("thing", "message"),
    [
        ("V2008", "V2008 is no address of the AutomationDirect DirectLOGIC DL06: octal digits, V0 to V177777"),
        ("DF600", "DF1 to DF500"),
        ("V7642.16", "a word has the bits 0 to 15"),
        ("C102.3", "a bit has no bits"),
        ("V7642=", "has no value"),
        ("V7642=10000", "up to 4 hexadecimal digits"),
        ("V7642=zz", "the value is not up to 4 hexadecimal digits"),
        ("addr+08", "octal; 08 has a digit above 7"),
        ("addr+40", "the block ends at +37"),
        ("Cn+40", "the block ends at Cn+39"),
        ("Cn+09=2", "true or false"),
        ("DFn+05=nan", "finite single-precision"),
        ("ErrBits=0x10000", "whole number of 9 bits"),
        ("PID_MODE=1.5", "DINT"),
        ("PID_DIR=perhaps", "TRUE and FALSE"),
        ("I_MV+15", "+0 to +14"),
        ("PID999", "no rule PID999; did you mean"),
        ("ErrBts", "did you mean ErrBits?"),
        ("ControlLag.ErrBits", "nothing is known of 'ControlLag.ErrBits'"),
        ("ControlLag.ErrBits=3", "nothing is known of 'ControlLag.ErrBits'"),
        ("=3", "is not a name"),
        ("x" * 3000, "is not a name"),
        ("\x1b[31m", "is not a name"),
        ("nothing at all", "nothing is known of 'nothing at all'"),
    ],
)
def test_what_cannot_be_explained_is_one_clear_error(thing, message):
    with pytest.raises(QuestionError) as error:
        pages(thing)
    assert message in str(error.value)
    result = run(thing)
    assert result.exit_code == 2
    assert result.stdout == ""


def test_a_block_must_be_an_address_and_hold_the_thing():
    assert run("V2006", "--block", "nonsense").exit_code == 2
    result = run("V3006", "--loop")
    assert result.exit_code == 2
    assert "V3006 lies outside the registers of the loops (V2000 to V2377)" in result.stderr
    assert "depends on where the loops begin" in run("V2006").output


# --- rules, decisions, JSON ------------------------------------------------------------------------------------------


def test_rules_and_decisions():
    assert run("dl242").output == page_text(text_of(find_rules()["DL242"]))
    assert run("D46").output.startswith("# D46 alarms are strict\n\nOn when the PV is beyond")
    assert run("D1000").output.startswith("# D1000 Ms of a loop of a scenario\n")
    assert run("d9999").exit_code == 2


TEXT = {"type": ["string", "null"]}
LAYOUT = {
    "type": "object",
    "additionalProperties": False,
    "required": ["version", "explanations"],
    "properties": {
        "version": {"const": 1},
        "forms": {"type": "array"},
        "explanations": {
            "type": "array",
            "items": {
                "type": "object",
                "additionalProperties": False,
                "required": [
                    "kind",
                    "vendor",
                    "name",
                    "title",
                    "value",
                    "meaning",
                    "cure",
                    "rules",
                    "basis",
                    "bits",
                    "holds",
                    "unit",
                    "notation",
                    "access",
                    "written_by",
                    "key",
                    "loop",
                    "place",
                    "set_by",
                    "reference",
                    "notes",
                    "page",
                ],
                "properties": {
                    "kind": {
                        "enum": ["register", "bit", "number", "structure", "parameter", "rule", "decision", "symptom"]
                    },
                    "vendor": {"enum": [*ALL, None]},
                    "name": {"type": "string"},
                    "title": {"type": "string"},
                    "value": {
                        "anyOf": [
                            {"type": "null"},
                            {
                                "type": "object",
                                "additionalProperties": False,
                                "required": ["raw", "shown", "text", "problem"],
                                "properties": {"raw": {}, "shown": {"type": "string"}, "text": TEXT, "problem": TEXT},
                            },
                        ]
                    },
                    "meaning": TEXT,
                    "cure": TEXT,
                    "rules": {"type": "array", "items": {"type": "string"}},
                    "basis": TEXT,
                    "bits": {
                        "type": "array",
                        "items": {
                            "type": "object",
                            "additionalProperties": False,
                            "required": ["bit", "title", "state", "active", "key", "meaning", "cure", "rules", "basis"],
                            "properties": {
                                "bit": {"type": "string"},
                                "title": {"type": "string"},
                                "state": TEXT,
                                "active": {"type": "boolean"},
                                "key": TEXT,
                                "meaning": TEXT,
                                "cure": TEXT,
                                "rules": {"type": "array"},
                                "basis": TEXT,
                            },
                        },
                    },
                    "holds": TEXT,
                    "unit": TEXT,
                    "notation": TEXT,
                    "access": TEXT,
                    "written_by": TEXT,
                    "key": TEXT,
                    "loop": TEXT,
                    "place": TEXT,
                    "reference": TEXT,
                    "notes": {"type": "array"},
                    "set_by": {
                        "type": "array",
                        "items": {"type": "object", "required": ["file", "line", "column", "loop", "key", "text"]},
                    },
                    "page": {"type": ["object", "null"]},
                },
            },
        },
    },
}


@pytest.mark.parametrize(
    "things", [["V7642=0008"], ["CK27", "ErrBits=5"], ["DL242", "D46"], ["gain"], ["addr+06.10"], ["windup"], []]
)
def test_the_layout_of_the_json(things):
    result = run(*things, "--format", "json")
    assert result.exit_code == 0
    pytest.importorskip("jsonschema").validate(json.loads(result.output), LAYOUT)


def test_json_keeps_every_field():
    (page,) = as_data(pages("V7642=0008"))["explanations"]
    assert page["value"] == {"raw": 8, "shown": "0008", "text": None, "problem": None}
    assert [(b["bit"], b["state"], b["active"]) for b in page["bits"]][2:] == [
        ("bit 2", "off", False),
        ("bit 3", "on", True),
    ]
    assert page["bits"][3]["rules"] == ["DL204"]


# --- with a configuration --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("vendor", "changes", "thing", "base"),
    [
        ("dl06", {"loop_table: V2000": "loop_table: V177770"}, "gain", "V177770"),
        ("ezlogix", {"registers: R101": "registers: R65530"}, "proportional_gain", "R65530"),
    ],
)
def test_registers_of_a_block_that_leaves_the_memory_are_refused_by_name(tmp_path, vendor, changes, thing, base):
    text = (STARTERS / f"{vendor}.yaml").read_text(encoding="utf-8")
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "far.yaml"
    path.write_text(text, encoding="utf-8")

    result = run(thing, "--in", str(path))

    assert result.exit_code == 2, result.output
    assert f"at {base} goes on behind the last register; 'pidcfg validate" in result.stderr
    assert run("DL242", "--in", str(path)).exit_code == 0, "what needs no address is explained"


def test_a_configuration_tells_loop_line_and_value():
    result = run("V2013", "TIC-101.gain", "--in", str(EXAMPLES / "dl06/reactor.yaml"), "--format", "json")
    assert result.exit_code == 0, result.output
    alarm, gain = json.loads(result.output)["explanations"]
    assert (alarm["loop"], alarm["value"]["text"], alarm["set_by"][0]["line"]) == ("FIC-102", "1 m3/h (decimal 82)", 27)
    assert (gain["name"], gain["value"]["text"], gain["set_by"][0]["key"]) == (
        "V2050",
        "2.5 %/%",
        "loops[1].tuning.gain",
    )


@pytest.mark.parametrize(
    ("thing", "file", "text", "key"),
    [
        ("DF106", "click/tank.yaml", "6", "loops[0].tuning.proportional_gain"),
        ("R102", "ezlogix/oven.yaml", "180 degC", "loops[0].setpoint.value"),
        ("OVEN.SV", "dpide/oven.yaml", "80 degC", "loops[0].SV"),
        ("D100", "dpide/oven.yaml", "80 degC", "loops[0].SV"),
        ("TIC_1.Kp", "nextopid/override.yaml", "2 %/degC", "loops[0].Kp"),
        ("TIC-1.tuning.gain", "generic/boiler.yaml", "1.2 m3/h/degC", "loops[0].tuning.gain"),
    ],
)
def test_configurations_of_every_vendor(thing, file, text, key):
    result = run(thing, "--in", str(EXAMPLES / file), "--format", "json")
    assert result.exit_code == 0, result.output
    page = json.loads(result.output)["explanations"][-1]  # D100 is a decision too
    assert (page["value"]["text"], page["set_by"][0]["key"]) == (text, key)


@pytest.mark.parametrize(
    ("thing", "file", "text"),
    [
        ("V10013", "flow.yaml", "2.491 % of the signal before the root (18.94 m3/h) (decimal 102)"),
        ("V10014", "flow.yaml", "6.667 % of the signal before the root (30.98 m3/h) (decimal 273)"),
        ("V10015", "flow.yaml", "87.5 % of the signal before the root (112.2 m3/h) (decimal 3583)"),
        ("V10016", "flow.yaml", "95.82 % of the signal before the root (117.5 m3/h) (decimal 3924)"),
        ("V10022", "flow.yaml", "1.661 % of the signal before the root (decimal 68)"),
        ("V10002", "flow.yaml", "75 m3/h (decimal 40)"),
        ("V10003=0640", "flow.yaml", "39.07 % of the signal before the root (75.01 m3/h) (decimal 1600)"),
        ("V10011", "flow.yaml", "3 s (0.3 s if the word has two decimals: D01)"),
    ],
)
def test_words_about_the_pv_before_the_root_are_no_flow(thing, file, text):
    result = run(thing, "--in", str(EXAMPLES / "dl06" / file), "--format", "json")
    (page,) = json.loads(result.output)["explanations"]
    assert page["value"]["text"] == text
    assert ("before the root" in text) == any("decision D16" in note for note in page["notes"])


def test_a_reset_time_whose_decimals_are_stated_is_not_doubted(tmp_path):
    text = (EXAMPLES / "dl06/flow.yaml").read_text("utf-8")
    path = tmp_path / "flow.yaml"
    path.write_text(text.replace("plc:\n", "plc:\n  reset_decimals: 1\n"), "utf-8")
    result = run("V10011", "--in", str(path), "--format", "json")
    assert json.loads(result.output)["explanations"][0]["value"]["text"] == "3 s"


def test_a_configuration_decides_the_vendor():
    result = run("D502", "--in", str(EXAMPLES / "dpide/oven.yaml"))
    assert "I_MV+1 of OVEN" in result.output
    result = run("V2000", "--in", str(EXAMPLES / "dl06/reactor.yaml"), "--vendor", "click")
    assert (result.exit_code, "is of vendor dl06" in result.stderr) == (2, True)
    assert run("V2000", "--in", "none.yaml").exit_code != 0


# --- the direction, and keys that no register holds ------------------------------------------------------------------

RISES = {"dl06": "direct", "click": "direct", "ezlogix": "reverse", "nextopid": "reverse", "dpide": "forward"}
"""The word for heating, from the manuals."""


def test_the_action_is_told_for_every_vendor_with_who_means_the_opposite():
    found = pages("action")
    assert [*dict.fromkeys(page.vendor for page in found)] == ALL
    own = next(page for page in found if page.vendor == "ezlogix")
    assert (own.writer, own.key) == ("stands in no register: set it in the PID dialog", "action")
    assert "`reverse` is heating" in own.holds
    assert own.notes[1] == (
        "the same word means the opposite with AutomationDirect DirectLOGIC DL06, AutomationDirect CLICK, Delta AS; "
        "the same: Altus NextoPID"
    )
    assert found[0].notes[1].startswith("the same word means the opposite with EZAutomation EZLogix, Altus NextoPID;")


@pytest.mark.parametrize(("vendor", "heating"), RISES.items())
def test_each_word_for_the_direction_says_whether_it_is_heating(vendor, heating):
    others = [word for word in ("direct", "reverse", "forward") if pages_or_none(word, vendor)]
    assert heating in others
    for word in others:
        for page in pages(f"action={word}", vendor=vendor):
            rises = RISES[vendor] == word or (vendor, word) == ("click", "forward")
            assert page.value.text == f"the PV {'rises with the output (heating)' if rises else COOLING}"
            assert page.points == ()


COOLING = "falls when the output rises (cooling)"


def pages_or_none(thing, vendor):
    """The explanations; none where there is none."""
    try:
        return pages(thing, vendor=vendor)
    except QuestionError:
        return []


@pytest.mark.parametrize(
    ("vendor", "thing", "names"),
    [
        ("click", "+09", ["Cn+09", "DSn+09", "DFn+09"]),
        ("click", "+09=1", ["Cn+09", "DSn+09", "DFn+09"]),
        ("click", "+09=2.5", ["DFn+09"]),
        ("click", "+24", ["Cn+24", "DFn+24"]),
        ("click", "+39", ["Cn+39"]),
        ("ezlogix", "+12=5", ["Base+12"]),
        ("ezlogix", "+1", ["Base+1", "Base+1"]),
        ("dl06", "+05", ["+05"]),
        (None, "+05", ["+05", "Cn+05", "DSn+05", "DFn+05", "Base+5", "Base+5"]),
        (None, "+06.10", ["+06.10"]),
    ],
)
def test_an_offset_without_a_block_is_one_in_each_block_where_nothing_else_has_the_name(vendor, thing, names):
    assert [page.name for page in pages(thing, vendor=vendor)] == names


def test_an_offset_beyond_every_block_names_where_they_end():
    with pytest.raises(QuestionError, match=r"Cn\+39; .*DSn\+14; .*DFn\+24"):
        pages("+99", vendor="click")


def test_direct_and_reverse_lead_to_the_action_of_every_vendor_that_has_the_word():
    assert {page.vendor for page in pages("reverse")} == set(RISES)
    assert {page.vendor for page in pages("direct")} == set(RISES) - {"dpide"}
    assert {page.vendor for page in pages("forward")} == {"click", "dpide"}


def test_the_action_of_a_loop_of_a_file():
    result = run("OVEN1.action", "--in", str(EXAMPLES / "ezlogix/oven.yaml"), "--format", "json")
    (page,) = json.loads(result.output)["explanations"]
    assert (page["loop"], page["set_by"][0]["line"]) == ("OVEN1", 14)
    assert page["value"]["text"] == "the PV rises with the output (heating)"
    result = run("action", "--in", str(EXAMPLES / "ezlogix/oven.yaml"), "--format", "json")
    shown = [(page["loop"], page["value"]["shown"]) for page in json.loads(result.output)["explanations"]]
    assert shown == [("OVEN1", "reverse"), ("EXHAUST", "direct")]


def leaves(model, before=""):
    """The paths of all keys of a model."""
    for key, field in model.model_fields.items():
        below = [m for m in models_in(field.annotation) if m is not model]
        for inner in below:
            yield from leaves(inner, f"{before}{key}.")
        if not below:
            yield f"{before}{key}"


ELSEWHERE = ("pidcfg", "vendor", "plc.map", "cascade_from", "ramp_soak.")
"""The head of the file, and keys that several registers hold together."""


@pytest.mark.parametrize("vendor", [key for key in ALL if hasattr(VENDORS[key].load("explainer"), "unstored_keys")])
def test_every_key_is_in_a_register_or_told(vendor):
    book = VENDORS[vendor].load("explainer")
    held = {row.path for block in book.blocks for row in block.table.points if row.path}
    for path in {leaf.removeprefix("loops.") for leaf in leaves(VENDORS[vendor].model)}:
        in_register = any(f"{p}.".startswith(f"{path}.") or path.startswith(f"{p}.") for p in held)
        assert in_register != (path in book.unstored_keys) or path.startswith(ELSEWHERE), path
    for path in book.unstored_keys:
        assert [page.holds for page in pages(path, vendor=vendor) if page.holds], path


@pytest.mark.parametrize(
    ("thing", "keys"),
    [
        ("tag", ["pv.tag", "output.tag", "output.pulse.tag"]),
        ("pulse", ["output.pulse.tag"]),
        ("pwm.bit", ["output.pwm.bit"]),
    ],
)
def test_keys_that_no_register_holds(thing, keys):
    found = pages(thing)
    assert [page.key for page in found] == keys
    assert {page.writer for page in found} == {"stands in no register: set it in the PID dialog"}
    with pytest.raises(QuestionError, match="stands in no register"):
        pages(f"{thing}=1")


def test_a_question_about_one_vendor_imports_no_other_and_no_rule():
    code = """
import sys
from pidcfg.cli.main import main
sys.argv = ["pidcfg", "explain", "V7642=0008", "--vendor", "dl06"]
try:
    main()
finally:
    print(*(name for name in sys.modules if name.startswith("pidcfg.")), file=sys.stderr)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    modules = done.stderr.splitlines()[-1].split()
    assert "pidcfg.output.explanation.dl06" in modules
    others = [*(vendor for vendor in VENDORS if vendor != "dl06"), "parameters", "find_parameter"]
    assert not {f"pidcfg.output.explanation.{name}" for name in others} & set(modules)
    assert not [name for name in modules if name.startswith("pidcfg.validate.rules")]


# --- several readings ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("thing", "titles"),
    [
        ("Base+0=50", ["Sample Rate"]),
        ("Base+3=125", ["Integral (Reset) Time"]),
        ("Base+3=60001", ["Integral (Reset) Time"]),
        ("Base+3=on", ["Saturation"]),
        ("Base+3=1", ["Integral (Reset) Time", "Saturation"]),
        ("anti_windup", ["Anti-Windup", "No integration further into a limit"]),
    ],
)
def test_a_content_takes_the_readings_that_it_fits_and_each_once(thing, titles):
    assert [page.title for page in pages(thing)] == titles


def test_a_content_that_fits_no_reading_is_an_error():
    with pytest.raises(QuestionError, match=r"a word of 0 to 65535; .*true or false"):
        pages("Base+3=70000")


@pytest.mark.parametrize(
    ("thing", "name", "place"),
    [
        ("D202", "TIC-21.PV", "D202 of TIC-21"),
        ("D203", "TIC-21.PV", "D202 of TIC-21; D203 is its second register"),
        ("D201", "TIC-21.SV", "D200 of TIC-21; D201 is its second register"),
        ("TIC-21.MV", "TIC-21.MV", "D204 of TIC-21"),
    ],
)
def test_a_device_of_the_file_is_no_decision(thing, name, place):
    result = run(thing, "--vendor", "dpide", "--in", str(EXAMPLES / "dpide/chiller.yaml"), "--format", "json")
    (page,) = json.loads(result.output)["explanations"]
    assert (page["kind"], page["name"], page["place"]) == ("parameter", name, place)
    assert pages("D202")[0].kind == "decision"


@pytest.mark.parametrize(
    ("thing", "note"),
    [
        ("R102=0026", "read as decimal; the listing's hex 0026 is 38: write 0x0026"),
        ("DS105=8000", "read as decimal; the listing's hex 8000 is -32768: write 0x8000"),
        ("DF106=42400000", "read as decimal; the listing's hex 42400000 is 48.0: write 0x42400000"),
        ("R102=5", ""),
        ("R102=0x0026", ""),
        ("C102=1", ""),
        ("DF106=120", ""),
        ("V2002=0666", ""),
    ],
)
def test_the_base_of_a_content_is_said_where_it_matters(thing, note):
    (page,) = pages(thing, loop=True)
    assert [text for text in page.notes if "read as" in text] == [note] * bool(note)


# --- the how-to ------------------------------------------------------------------------------------------------------

PAGE = (Path(__file__).parents[1] / "docs" / "explain.md").read_text("utf-8")
RUNS = re.findall(r"```console\n\$ pidcfg ([^\n]*)\n(.*?)```", PAGE, re.DOTALL)


@pytest.mark.parametrize(("line", "shown"), RUNS, ids=[line for line, _ in RUNS])
def test_what_the_how_to_shows_is_true(line, shown, monkeypatch):
    monkeypatch.chdir(EXAMPLES / "dl06")
    result = CliRunner().invoke(cli, shlex.split(line), prog_name="pidcfg")
    assert result.exit_code == 0, result.stderr
    whole, _, cut = shown.partition("...\n")
    assert result.stdout.startswith(whole) if "...\n" in shown and not cut else result.stdout == shown


def test_the_how_to_shows_the_five_questions():
    asked = " ".join(line for line, _ in RUNS)
    for question in ("V7642=0008", "V2006=0x0402 --loop", "CK27", "addr+06.10", "--annotate", "--in"):
        assert question in asked


@pytest.mark.parametrize(
    ("question", "says"),
    [
        ("NumCycles=11", "11 (not within 1 to 10: AutoTuneResult.Bad_NumCycles)"),
        ("NumCycles=10", "10"),
        ("PercHystPV=0.01", "0.01 %"),
        ("ControlSplitRange.Mode=5", "5 (not within 1 to 4: Error)"),
        ("Td_Kd=-1", "-1 (not allowed: below 0: ErrBits.Td_Kd)"),
    ],
)
def test_a_parameter_of_a_block_is_held_against_its_limits(question, says):
    assert {page.value.text for page in pages(question, vendor="nextopid")} == {says}


def test_a_bit_of_v7642_that_the_manual_does_not_list_is_named():
    out = run("V7642=0010").output
    assert "bits 4-15    Reserved: 0x0010 means nothing here" in out


def test_a_key_may_be_asked_for_with_blanks():
    found, other = (
        explain_question(Question.parse(name), list(VENDORS), all_decisions) for name in ("bias freeze", "bias_freeze")
    )
    assert found[: len(other)] == other
    with pytest.raises(QuestionError, match="nothing is known of 'no such thing'"):
        explain_question(Question.parse("no such thing"), list(VENDORS), all_decisions)


@pytest.mark.parametrize("vendor", [None, "click"])
def test_a_code_alone_is_answered_as_by_all_who_are_asked(vendor):
    for code in find_rules():
        assert pidcfg.explain(code, vendor=vendor).pages == explain_things([code], vendor, (), None, loop=False).pages
