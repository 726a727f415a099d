"""Corrections: every byte outside of them stays, what has two readings is left, and nothing is written by half."""

from __future__ import annotations

import hashlib
import io
import json
import os
import re
import subprocess
import tempfile
from collections import Counter
from contextlib import chdir
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from living_rig import GOOD, TWICE, run
from pidcfg.schemas.document import models_of
from pidcfg.text.diagnostics import Diagnostic, Edit, Severity, Span
from pidcfg.text.document import Plain
from pidcfg.text.source import read_document
from pidcfg.validate import engine, rule
from pidcfg.validate.baseline import suppress
from pidcfg.validate.engine import check_document, scalar_text
from pidcfg.validate.fixes import Fixer, _KeyPlace, apply_edits, same_but_quotes, separate_findings
from pidcfg.validate.rules.dl06 import RULES
from pidcfg.validate.schema import all_keys, edit_distance, is_typo, keys_of, unambiguous_key
from pidcfg.vendors import VENDORS
from shell import captured, pidcfg

ROOT = Path(__file__).parents[1]
REACTOR = (ROOT / "examples/dl06/reactor.yaml").read_text("utf-8")
BREAKS = re.compile("\r\n|[\n\r\x85\u2028\u2029]")


def check(doc):
    return suppress(list(check_document(doc).findings), doc).findings


def fix(data, wanted=lambda _: True):
    data = data if isinstance(data, bytes) else data.encode()
    return Fixer(lambda new: read_document(new, "case.yaml"), check, wanted).fix(data)


TWO_PLACES = Diagnostic("PID020", Severity.ERROR, "unknown key", "a.yaml", Span(1, 1, 1, 2), ())

# --- splicing ---------------------------------------------------------------------------------------------------------

PIECE = st.text("ab \t#'é漢😀\u2028\x85", max_size=8)
BETWEEN = st.sampled_from(["\n", "\r\n", " ", "\t", "x"])


@given(st.lists(st.tuples(PIECE, BETWEEN, st.none() | PIECE), max_size=12))
def test_every_character_outside_of_the_edits_stays(pieces):
    text, expected, edits = "", "", []
    for old, between, new in pieces:
        start, text = len(text), text + old
        end = len(text)
        expected += old if new is None else new
        if new is not None and (old or new):
            edits.append((start, end, new))
        text, expected = text + between, expected + between

    def place(offset):
        rows = BREAKS.split(text[:offset])
        return len(rows), len(rows[-1]) + 1

    made = [Edit(Span(*place(start), *place(end)), new) for start, end, new in edits]
    assert apply_edits(text, made) == expected
    assert apply_edits(text, [*reversed(made), *made]) == expected, "in any order, each once"


@given(st.lists(st.tuples(st.integers(1, 30), st.integers(0, 6)), max_size=20))
def test_findings_whose_edits_touch_those_of_one_before_wait(places):
    findings = [replace(TWO_PLACES, edits=(Edit(Span(1, at, 1, at + size), "x"),)) for at, size in places]
    wanted, taken = [], []
    for finding, (at, size) in zip(findings, places, strict=True):
        end = at + size
        if not any((at, end) == (a, b) or max(at, a) < min(end, b) for a, b in taken):
            taken.append((at, end))
            wanted.append(finding)
    assert list(separate_findings(findings)) == wanted


def test_of_two_edits_that_overlap_one_is_made():
    assert apply_edits("abcd", [Edit(Span(1, 2, 1, 4), "X"), Edit(Span(1, 3, 1, 5), "Y")]) == "aXd"


SLIPS = (
    ("pidcfg: 1", 'pidcfg: "1"'),
    ("vendor: dl06", "vendor: DL06"),
    ("loop_table: V2000", "loop_table: v2000"),
    ("bias_freeze: true", "bias_freeze: yes"),
    ("sample_rate: 0.2 ", "smaple_rate: 0.2 "),
    ("algorithm: position", "algorithm: 'Position'"),
    ("gain: 0.80", 'gain: "0.80"'),
    ("square_root: false", "square_root: 'no'"),
    ("    setpoint: {value: 20.0", "    set-point: {value: 20.0"),
    ("high: 42.0", 'high: "42.0"'),
    ("hysteresis: 0.5", "hysterisis: 0.5"),
    ("sample_rate: 2.0", "sammple_rate: 2.0"),
    ("gain: 2.50", "gain: 02.50"),
    ("derivative_gain_limit: 10", "derivative_gain_limit: 0x0A"),
    ("value: 85.0", '"valeu": 85.0'),
    ("deadband: 0.2", "deadbnad: 0.2"),
    ("deviation: {yellow", "devaition: {yellow"),
)
"""Texts of the example, and slips that can be read in one way only."""
RESPELT = {
    "algorithm: 'Position'": "algorithm: position",
    '"valeu": 85.0': '"value": 85.0',
    "derivative_gain_limit: 0x0A": "derivative_gain_limit: 10",
}


@given(
    st.sets(st.sampled_from(SLIPS), min_size=1),
    st.sampled_from(["\n", "\r\n"]),
    st.booleans(),
    st.booleans(),
    st.text("é漢 \t#'\":", max_size=20),
)
def test_slips_in_a_real_file_are_mended_and_every_other_byte_stays(slips_made, end, bom, last, comment):
    right, wrong = f"# {comment}\n" + REACTOR.rstrip(), f"# {comment}\n" + REACTOR.rstrip()
    for good, bad in slips_made:
        assert good in right
        wrong = wrong.replace(good, bad, 1)
        right = right.replace(good, RESPELT.get(bad, good), 1)

    def encoded(text):
        whole = (text + "\n" * last).replace("\n", end)
        return whole.encode("utf-8-sig" if bom else "utf-8")

    outcome = fix(encoded(wrong))
    assert outcome.data == encoded(right)
    assert len(outcome.fixed) == len(slips_made)
    assert not [d for d in outcome.remaining if d.severity is Severity.ERROR]


# --- what is corrected and what is not --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("pidcfg: 1", "pidcgf: 1"),
        ("reset: 10}", "rseet: 10}"),
        ("gain: 1,", "GAIN: 1,"),
        ("gain: 1,", 'gain: "1",'),
        ("gain: 1,", "gain: 01,"),
        ("gain: 8,", "gain: 08,"),
        ("gain: 8.5,", "gain: 08.5,"),
        ("reset: 1000", "reset: 1_000"),
        ("reset: 10", "reset: 0b1010"),
        ("reset: 10", "reset: 0o12"),
        ("action: direct", "action: DIRECT"),
        ("V2000", "v2000"),
        ("tuning: {", "tunign: {"),
        ("plc: {loop_table: V2000", "plc: {loop_tabel: V2000"),
        ("sample_rate: 1", "sample-rate: 1"),
    ],
)
def test_what_can_be_read_in_one_way_is_written_that_way(right, wrong):
    key = right.partition(":")[0]
    base = GOOD if right in GOOD else re.sub(rf"{key}: [0-9]+,?", right, GOOD)
    assert right in base
    assert fix(base.replace(right, wrong)).data.decode() == base


@pytest.mark.parametrize("wrong", ['["0", 200]', "[0, 0b11001000]", "[0, '200']"])
def test_an_end_of_a_pair_is_written_that_way_and_the_other_one_stays(wrong):
    pair = GOOD + "    pv: {range: [0, 200]}\n"

    assert fix(pair.replace("[0, 200]", wrong)).data.decode() == pair


CLICK = (ROOT / "examples/click/tank.yaml").read_text("utf-8")


@pytest.mark.parametrize("wrong", ["ds101", "DS 101", "DS0101", "ds00101", "' ds 101 '"])
def test_decimal_addresses(wrong):
    assert "integers: DS101" in CLICK
    assert fix(CLICK.replace("integers: DS101", f"integers: {wrong}")).data.decode() == CLICK


BEYOND = {
    "click": ["bits: C0", "bits: c0", "bits: C 00", "bits: C02001", "integers: ds4501", "floats: DF000"],
    "ezlogix": ["registers: R0", "registers: r00", "discretes: S0", "discretes: S 65536"],
    "dl06": ["loop_table: v777777", "loop_table: V0200000"],
    "dpide": ["device: d30000", "device: D 30000"],
}


@pytest.mark.parametrize(
    ("vendor", "wrong"), [(vendor, wrong) for vendor, wrongs in BEYOND.items() for wrong in wrongs]
)
def test_an_address_that_does_not_exist_is_told_so_and_never_counted_as_correctable(vendor, wrong):
    starter = (ROOT / "src/pidcfg" / VENDORS[vendor].starter).read_text("utf-8")
    key = wrong.partition(":")[0]
    text = re.sub(rf"\b{key}: *[A-Z]+[0-9]+", wrong, starter, count=1)
    assert text != starter
    outcome = fix(text)
    assert outcome.data.decode() == text
    (told,) = (d for d in outcome.remaining if d.code == "PID029")
    assert told.edits == ()
    assert "does not exist" in told.message or "is beyond" in told.message
    address = wrong.partition(": ")[2]
    assert (told.help or "") != f"write {address}"


@pytest.mark.parametrize("wrong", ["DS10 1", "DS1 01", "D S101", "DS 10 1"])
def test_a_blank_inside_an_address_may_stand_for_anything(wrong):
    text = CLICK.replace("integers: DS101", f"integers: {wrong}")
    assert fix(text).data.decode() == text


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("reset: 10", "reset: 010"),  # octal 8 or decimal 10
        ("V2000", "02000"),
        ("V2000", "2000"),
        ("V2000", "V2008"),
        ("V2000", "vv2000"),
        ("V2000", '"2000"'),
        ("action: direct", "action: dierct"),  # a word that turns the control round is not guessed
        ("action: direct", "acttion: reversed"),  # the value is wrong for the key
        ("gain: 1, reset", "gain: 1, reste: 2, reset"),  # the key is there
        ("gain: 1, reset", "resett: 1, rseet"),  # two for one key
        ("gain: 1, reset", "gian: 1, reset"),  # too short
        ("reset: 10", "rsete_: 10"),
        ("reset: 10", "reste_: 10"),
        ("reset: 10", "rxxet: 10"),  # too far
        ("reset: 10", "rseet: "),  # no value
        ("gain: 1,", "gain: 1.2.3,"),
        ("gain: 1,", "gain: 60:30,"),
        ("gain: 1,", "gain: 1_0,"),
        ("gain: 1,", "gain: .inf,"),
        ("gain: 1,", 'gain: "010",'),
        ("gain: 1,", 'gain: "1e999",'),
        ("reset: 10", "reset: 0x0180"),
        ("reset: 10", "reset: 0x10"),  # a number, or a word in BCD
        ("reset: 10", 'reset: "08 min"'),
        ("sample_rate: 1", "sample_rate: 08 s"),  # the unit would be lost
        ("name: A", "nam: "),
        ("vendor: dl06", "vendor: dl05"),
        ("pidcfg: 1", "pidcfg: 2"),
    ],
)
def test_what_takes_a_decision_is_left_alone(old, new):
    assert old in GOOD
    text = GOOD.replace(old, new)
    outcome = fix(text)
    assert outcome.data.decode() == text
    assert outcome.fixed == ()
    assert any(d.severity is Severity.ERROR for d in outcome.remaining)


UNIT = GOOD + "    output: {range: [0, 100], unit: %, limits: [0, 90]}\r\n    pv: {unit: %/m}  # 5 %\n"


def test_a_unit_that_needs_quotes_gets_them():
    outcome = fix(UNIT)
    assert outcome.data.decode() == UNIT.replace("unit: %,", 'unit: "%",').replace("unit: %/m}", 'unit: "%/m"}')
    assert [d.code for d in outcome.fixed] == ["PID001", "PID001"]
    assert fix(UNIT, lambda d: d.code != "PID001").fixed == ()


@pytest.mark.parametrize("value", ["% %", "%a b", '%"', "%, %: 3", "[%", "*%", "%: 3", "a\n  %", "@@'"])
def test_what_needs_more_than_quotes_around_a_word_is_left_alone(value):
    text = GOOD + f"    pv: {{unit: {value}}}\n"
    outcome = fix(text)
    assert outcome.data.decode() == text
    assert outcome.fixed == ()


def test_quotes_do_not_help_a_text_that_is_broken_elsewhere():
    text = GOOD + "    pv: {unit: %}\n    output: [\n"
    assert fix(text).data.decode() == text


def test_quotes_must_leave_the_same_text_whatever_is_in_them():
    assert same_but_quotes({"a": ["%", Plain("1")]}, {"a": [Plain("xxx"), Plain("1")]})
    for twin in ({"a": [Plain("xx"), Plain("1")]}, {"a": [Plain("xxx"), Plain("2")]}, {"b": []}, {"a": [Plain("xxx")]}):
        assert not same_but_quotes({"a": ["%", Plain("1")]}, twin)


def test_keys_of_opposite_meaning_are_never_chosen_between():
    assert unambiguous_key("of_delay", ["on_delay", "off_delay"]) is None
    assert unambiguous_key("MaxMX", ["MaxMV", "MaxPV", "MinMV"]) is None
    assert unambiguous_key("MaxMX", ["MaxMV"]) is None, "in short words a letter is a meaning"
    assert unambiguous_key("mni", ["min", "max"]) is None
    assert unambiguous_key("tunign", ["tuning", "name"]) == "tuning"
    assert unambiguous_key("tunign", ["tuning", "turning"]) is None, "two are near"
    assert unambiguous_key("MinMv", ["MaxMV", "MinMV"]) == "MinMV"
    assert unambiguous_key("Min-MV", ["Min_MV", "min_mv"]) is None


MODELS = sorted(
    {m for vendor in VENDORS.values() for m in models_of(vendor.model)}, key=lambda model: model.__qualname__
)
ALPHABET = "aeioustdnrPIDMXV12"


def test_no_key_of_any_vendor_is_ever_taken_for_another():
    assert {"Disable", "DisableP", "MV_MAX", "MaxPV", "bias_freeze", "reset", "expect"} <= all_keys()
    renamed = {(key, unambiguous_key(key, keys_of(model))) for model in MODELS for key in all_keys()}
    assert {meant for _, meant in renamed} == {None}


@pytest.mark.parametrize("key", ["PV_MAX", "PV_MIN", "SV_MAX", "ManualSP", "ManualPV", "bias_free", "preset", "loop"])
def test_words_of_manuals_are_no_misspellings(key):
    assert {unambiguous_key(key, keys_of(model)) for model in MODELS if key not in keys_of(model)} == {None}


def test_no_beginning_and_no_extension_of_a_key_is_taken_for_it():
    for model in MODELS:
        known = keys_of(model)
        for key in known:
            shorter = [word for n in range(1, len(key)) if (word := key[:-n])[-1] != "_"] + [key[1:]]
            longer = [key + c for c in ALPHABET if c != key[-1]] + [c + key for c in ALPHABET if c != key[0]]
            assert {unambiguous_key(word, known) for word in shorter + longer if word not in known} <= {None}, key


def one_slip(name):
    """Every word that is one slip of a long word away: spelled out again, from the name's side."""
    for found in re.finditer(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+", name):
        begin, end = found.span()
        if end - begin < 5:
            continue
        for i in range(begin, end):
            yield from (name[:i] + c + name[i + 1 :] for c in "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ")
            yield name[: i + 1] + name[i:]
            if begin < i < end - 1 and end - begin > 5:
                yield name[:i] + name[i + 1 :]
            if i + 1 < end:
                yield name[:i] + name[i + 1] + name[i] + name[i + 2 :]


NAMES = sorted(all_keys())
MANGLED = st.tuples(
    st.sampled_from(NAMES), st.lists(st.tuples(st.integers(0, 30), st.sampled_from("-~xeDP_ ")), min_size=1, max_size=2)
)


@given(MANGLED, st.sampled_from(MODELS))
def test_a_renamed_key_was_one_slip_of_a_long_word_away_or_spelled_with_other_capitals_and_hyphens(made, model):
    word, changes = made
    for place, how in changes:
        at = place % (len(word) + 1)
        swapped = word[:at] + word[at : at + 2][::-1] + word[at + 2 :]
        word = swapped if how == "~" else word[:at] + word[at + 1 :] if how == "-" else word[:at] + how + word[at:]
    meant = unambiguous_key(word, keys_of(model))
    if meant is not None:
        spelled = re.sub("[-_ ]", "", word).casefold() == re.sub("[-_ ]", "", meant).casefold()
        assert spelled or word in set(one_slip(meant))


@pytest.mark.parametrize("name", ["sample_rate", "DeadBand", "DisableP", "ControlON_OFF", "deadband", "PV_MAX"])
def test_one_slip_is_told_from_more(name):
    near = {word for word in one_slip(name) if word != name}
    assert all(is_typo(word, name) for word in near)
    wrong = {word[:i] + "z" + word[i:] for word in near for i in range(len(word) + 1)} - near
    assert not [word for word in wrong if is_typo(word, name) and word != name]


AUTOTUNE = (ROOT / "examples/nextopid/autotune.yaml").read_text("utf-8")


@pytest.mark.parametrize("key", ["Disabled", "Disable", "DisableI1", "Disabl", "disabled"])
def test_a_switch_of_the_whole_loop_never_becomes_one_of_a_part(key):
    text = re.sub(r"^( +)(type: PIDA.*)$", rf"\1\2\n\1{key}: true", AUTOTUNE, count=1, flags=re.MULTILINE)
    assert text != AUTOTUNE
    outcome = fix(text)
    assert outcome.data.decode() == text
    assert any(d.code == "PID020" for d in outcome.remaining)


def test_a_word_that_may_be_a_signal_is_never_made_a_constant():
    pida = re.sub(r"^( +)(type: PIDA.*)$", r"\1\2\n\1Manual: N", AUTOTUNE, count=1, flags=re.MULTILINE)
    assert pida != AUTOTUNE
    for word in ("N", "Y", "no", "off", '"true"', '"FALSE"'):
        text = pida.replace("Manual: N", f"Manual: {word}")
        assert fix(text).data.decode() == text


@pytest.mark.parametrize(
    ("one", "other", "number"),
    [
        ("gain", "gain", 0),
        ("gian", "gain", 1),
        ("gan", "gain", 1),
        ("gaain", "gain", 1),
        ("goin", "gain", 1),
        ("", "ab", 2),
        ("ab", "", 2),
        ("reset", "preset", 1),
        ("smaple_rat", "sample_rate", 2),
        ("abc", "xyz", 3),
    ],
)
def test_slips_are_counted(one, other, number):
    assert edit_distance(one, other) == number


def test_a_value_that_an_alias_shares_is_left_alone_and_a_shared_mapping_is_mended_once():
    both = GOOD.replace("tuning: {gain: 1, reset:", "tuning: &t {gain: 1, rseet:") + (
        "  - {name: B, sample_rate: 1, action: direct, tuning: *t}\n"
    )
    assert fix(both).data.decode() == both.replace("rseet:", "reset:")
    shared = GOOD.replace("gain: 1,", 'gain: &g "1",') + (
        "  - {name: B, sample_rate: 1, action: direct, tuning: {gain: *g, reset: 10}}\n"
    )
    assert fix(shared).data.decode() == shared


def test_comments_and_values_that_look_like_the_mistake_stay():
    text = GOOD.replace("name: A", 'name: A\n    description: "rseet: v2000 yes"  # rseet: 01')
    text = text.replace(" reset:", " rseet:")
    assert fix(text).data.decode() == text.replace("1, rseet", "1, reset")


def test_a_correction_that_uncovers_another_is_followed():
    text = GOOD.replace("vendor: dl06", "vendor: DL06").replace("reset:", "rseet:")
    assert fix(text).data.decode() == GOOD


def test_a_correction_may_show_findings_that_were_hidden_but_bring_no_error_of_the_same_kind():
    outcome = fix(TWICE.replace("reset:", "rseet:"))
    assert outcome.data.decode() == TWICE
    assert {d.code for d in outcome.remaining} == {"DL242", "DL254"}


def test_many_unknown_keys_cost_no_more_than_a_few_readings(monkeypatch):
    from pidcfg.validate import schema as edits

    tries = []
    monkeypatch.setattr(edits, "_has_fewer_faults", lambda *args: bool(tries.append(args)))
    text = GOOD + "".join(f"  - {{name: L{i}, smaple_rate: 1, action: direct, tunign: 3}}\n" for i in range(300))
    fix(text)
    assert 0 < len(tries) <= edits.MAX_TRIES


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("gain: 1,", "gain: 1, rate: 3,"),  # says more than the correction
        ("reset: 10", 'reset: "10"'),  # the same text, but quoted: another value
        ("name: A", 'name: "A"'),  # says the same, but not by the correction
        ("sample_rate: 1", "sample_rat: 1"),  # brings an error
        ("gain: 1,", "gain: 1.0,"),  # changes a value that nothing is wrong with
        ("loops:", "loops: ["),  # cannot be read
        ("loops:", "# loops:"),  # takes data away
    ],
)
def test_a_correction_that_does_more_than_it_says_is_not_made(old, new):
    """Whatever a rule offers, the text is read again: here a finding about the address has an edit elsewhere."""
    text = GOOD.replace("V2000", "v2000")

    def offering(doc):
        places = [(n, line.index(old) + 1) for n, line in enumerate(doc.lines, 1) if old in line]
        if not places:
            return check(doc)
        ((row, column),) = places
        edit = Edit(Span(row, column, row, column + len(old)), new)
        return [replace(d, edits=(*d.edits, edit)) if d.code == "PID029" else d for d in check(doc)]

    outcome = Fixer(lambda data: read_document(data, "case.yaml"), offering, lambda _: True).fix(text.encode())
    assert outcome.data.decode() == text
    assert outcome.fixed == ()


def test_one_correction_that_fails_does_not_hold_up_the_others():
    text = GOOD.replace("V2000", "v2000").replace("reset:", "rseet:")

    def offering(doc):
        return [
            replace(d, edits=(replace(d.edits[0], text="V2009"),)) if d.code == "PID029" and d.edits else d
            for d in check(doc)
        ]

    outcome = Fixer(lambda data: read_document(data, "case.yaml"), offering, lambda _: True).fix(text.encode())
    assert outcome.data.decode() == GOOD.replace("V2000", "v2000")


def test_unused_ignores_are_deleted_and_used_ones_stay():
    lines = GOOD.splitlines()
    lines[5] += "\t # pidcfg: ignore[DL242] why"
    lines[6] += "  # heating # pidcfg: ignore[DL242] why"
    text = "\n".join([*lines[:7], "    # pidcfg: ignore[DL242] why", *lines[7:], "# pidcfg: ignore[PID101] why"])
    wanted = "\n".join(
        [*GOOD.splitlines()[:5], GOOD.splitlines()[5] + "\t # why", lines[6], "    # why", *lines[7:], "# why"]
    )
    assert fix(text).data.decode() == wanted, "what stands behind another comment is left to its writer"
    used = TWICE.rstrip() + "  # pidcfg: ignore[DL242, PID101, DL254] why\n"
    assert fix(used).data.decode() == used.replace("DL242, PID101, DL254", "DL242, DL254")


@pytest.mark.parametrize("end", ["", "\n", "\n\n"])
@pytest.mark.parametrize(
    ("comment", "left"),
    [
        ("# pidcfg: ignore[DL242]", ""),
        ("# pidcfg: ignore[DL242, DL254]", ""),
        ("# pidcfg: ignore[DL242] seen by A", "# seen by A"),
    ],
)
def test_an_unused_ignore_goes_with_its_line_or_leaves_its_reason(comment, left, end):
    """Behind a value the blanks before the comment go, too; a last line without an end stays, empty."""
    lines = GOOD.rstrip().splitlines()
    for row in (5, 7, len(lines) - 1):
        beside = [*lines[:row], f"{lines[row]}  {comment}", *lines[row + 1 :]]
        kept = [*lines[:row], f"{lines[row]}  {left}".rstrip(), *lines[row + 1 :]]
        assert fix("\n".join(beside) + end).data.decode() == "\n".join(kept) + end
        above = [*lines[:row], f"    {comment}", *lines[row:]]
        kept = [*lines[:row], *([f"    {left}"] if left else []), *lines[row:]]
        assert fix("\n".join(above) + end).data.decode() == "\n".join(kept) + end
    for indent in ("", "    "):
        last = [f"{indent}{left}"] if left else [] if end else [""]
        assert fix("\n".join([*lines, f"{indent}{comment}"]) + end).data.decode() == "\n".join([*lines, *last]) + end


@pytest.mark.parametrize("folder", ["examples/*/*.yaml", "tests/cases/*.yaml", "src/pidcfg/cli/starters/*.yaml"])
def test_no_file_that_can_be_used_is_ever_changed(folder):
    """Warnings are decisions, and so are most errors of rules: nothing that a plant does is changed unasked."""
    files = [path for path in ROOT.glob(folder) if "scenario" not in path.name]
    assert files
    for path in files:
        findings = check(read_document(path.read_bytes(), path.name))
        assert {d.severity for d in findings if d.edits} <= {Severity.ERROR}, path
        if not any(d.severity is Severity.ERROR for d in findings):
            assert fix(path.read_bytes()).data == path.read_bytes()


CASCADE = (ROOT / "tests/cases/DL256.yaml").read_text("utf-8")


@pytest.mark.parametrize(
    ("code", "before", "wrong", "right"),
    [
        # what the rule's case has, what stands there instead, and what --fix makes of it
        ("DL256", "cascade_from: TIC-11 ", "cascade_from: tic-101 ", "cascade_from: TIC-101 "),
        ("DL256", "cascade_from: TIC-11 ", "cascade_from: 'Tic-101' ", "cascade_from: TIC-101 "),
        ("GN831", "source: TIC-l}", "source: tic-1}", "source: TIC-1}"),
    ],
)
def test_the_error_of_a_rule_with_one_reading_is_corrected(code, before, wrong, right):
    text = (ROOT / f"tests/cases/{code}.yaml").read_text("utf-8")
    assert before in text
    outcome, wanted = fix(text.replace(before, wrong)), fix(text.replace(before, right))
    assert right in outcome.data.decode()
    assert outcome.data == wanted.data
    assert sorted(d.code for d in outcome.fixed) == sorted([code, *(d.code for d in wanted.fixed)])


@pytest.mark.parametrize("code", ["DL256", "GN831"])
def test_another_name_is_a_decision(code):
    text = (ROOT / f"tests/cases/{code}.yaml").read_bytes()
    assert fix(text).data == text


def test_a_name_that_two_loops_have_in_other_capitals_is_left():
    text = CASCADE.replace("cascade_from: TIC-11 ", "cascade_from: tic-101 ").replace("FIC-103", "Tic-101")
    assert fix(text).data.decode() == text


NUMBERED = CASCADE.replace("name: TIC-101", 'name: "TIC #1"').replace("from: TIC-101", 'from: "TIC #1"')


def test_a_name_that_yaml_would_cut_off_is_written_in_quotes():
    right = NUMBERED.replace("TIC-11 ", '"TIC #1" ')
    assert right.count('"TIC #1"') == 3
    assert fix(NUMBERED.replace("TIC-11 ", "'tic #1' ")).data == fix(right).data == right.encode()


@pytest.mark.parametrize(
    "text",
    [
        *(
            "%",
            "@1",
            "- a",
            "a: b",
            "a #b",
            " a",
            "a ",
            "a, b",
            "a]",
            "'a'",
            '"a"',
            "",
            "*a",
            "&a",
            "!a",
            "|",
            "? a",
            "{a}",
        ),
        *("TIC-101", "TIC #1", "TIC#1", "A.b/c", "µ", "1.5 s", "50 %", "degC/min"),
    ],
)
@pytest.mark.parametrize("place", ["name: {}\n", "{{name: {}}}\n", "name: [{}, 1]\n"])
def test_a_text_is_written_so_that_it_is_read_as_it_was(text, place):
    doc = read_document(place.format(scalar_text(text)).encode(), "a.yaml")
    found = doc.data["name"]
    assert (found[0] if isinstance(found, list) else found) == text


def test_a_warning_is_never_corrected():
    doc = read_document(CASCADE.encode(), "case.yaml")
    found = rule.make_finding("loops", 1, "cascade_from", name="TIC-11").correct_to("TIC-101")

    def edits(label, *findings):
        return engine.make_diagnostic(label, findings, doc, engine.QuotedNumbers(doc)).edits

    assert [edit.text for edit in edits(RULES["DL256"], found)] == ["TIC-101"]
    assert not edits(replace(RULES["DL256"], severity=Severity.WARNING), found)
    assert not edits(RULES["DL256"], found, found.with_values(name="x")), "two texts at one key"


def test_a_correction_that_brings_another_error_is_not_made():
    """The two loops would give each other their set points."""
    text = CASCADE.replace("cascade_from: TIC-11 ", "cascade_from: fic-103 ").replace("TIC-101  # ok", "FIC-102  # ok")
    assert [d.code for d in check(read_document(text.encode(), "a.yaml")) if d.edits] == ["DL256"]
    assert fix(text).data.decode() == text


# --- the command ------------------------------------------------------------------------------------------------------

WRONG = GOOD.replace("reset:", "rseet:").replace("V2000", "v2000").replace("\n", "\r\n")


@pytest.fixture
def validate(monkeypatch, capsysbinary, tmp_path):
    """``pidcfg validate`` in a folder with one wrong file."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.yaml").write_bytes(WRONG.encode())
    return lambda *args: run(monkeypatch, capsysbinary, *args)


def test_fix_writes_and_the_exit_code_is_that_of_what_remains(validate, tmp_path):
    assert "2 correctable with --fix" in validate("a.yaml").err
    (tmp_path / "b.yaml").write_text(TWICE.replace("reset:", "rseet:"), "utf-8")
    found = validate(".", "--fix")
    assert (tmp_path / "a.yaml").read_bytes() == GOOD.replace("\n", "\r\n").encode()
    assert (tmp_path / "b.yaml").read_bytes() == TWICE.encode()
    assert found.code == 1
    assert "a.yaml: corrected 1 x PID020, 1 x PID029\n" in found.err
    assert "3 findings in 2 files corrected" in found.err
    assert "PID020" not in found.out
    assert validate("a.yaml", "--fix", "--strict").code == 0


def test_diff_writes_nothing_and_what_it_prints_is_a_patch(validate, tmp_path):
    (tmp_path / "c.yaml").write_text(GOOD, "utf-8")
    (tmp_path / "d.yaml").write_bytes(WRONG.rstrip().encode())
    found = validate("a.yaml", "c.yaml", "d.yaml", "--diff")
    assert found.code == 1
    assert "4 findings in 2 files would be corrected" in found.err
    assert (tmp_path / "a.yaml").read_bytes() == WRONG.encode()
    subprocess.run(["git", "apply", "-p0", "-"], input=found.raw, cwd=tmp_path, check=True)
    assert (tmp_path / "a.yaml").read_bytes() == GOOD.replace("\n", "\r\n").encode()
    assert (tmp_path / "d.yaml").read_bytes() == GOOD.replace("\n", "\r\n").rstrip().encode()
    after = validate("a.yaml", "--diff")
    assert (after.code, after.out) == (0, "")


def test_diff_of_what_cannot_be_read_is_unusable_input(validate, tmp_path):
    (tmp_path / "b.yaml").write_text("pidcfg: [", "utf-8")
    assert validate("b.yaml", "--diff").code == 2
    assert validate("none.yaml", "--diff").code == 2
    found = validate("a.yaml", "b.yaml", "--fix")
    assert found.code == 2
    assert (tmp_path / "b.yaml").read_text("utf-8") == "pidcfg: ["
    assert (tmp_path / "a.yaml").read_bytes() == GOOD.replace("\n", "\r\n").encode()


def test_select_and_ignore_choose_what_is_corrected(validate, tmp_path):
    validate("a.yaml", "--fix", "--ignore", "PID020")
    assert (tmp_path / "a.yaml").read_bytes() == WRONG.replace("v2000", "V2000").encode()
    validate("a.yaml", "--fix", "--select", "DL2")
    assert b"rseet" in (tmp_path / "a.yaml").read_bytes()
    (tmp_path / "pidcfg.toml").write_text("[per-file-ignores]\n'a.yaml' = ['PID02']\n", "utf-8")
    validate("a.yaml", "--fix")
    assert b"rseet" in (tmp_path / "a.yaml").read_bytes()


def test_standard_input_is_printed_corrected_and_its_findings_go_to_stderr(validate, monkeypatch):
    def piped(data):
        return io.TextIOWrapper(io.BytesIO(data))

    monkeypatch.setattr("sys.stdin", piped(WRONG.encode("utf-8-sig")))
    found = validate("-", "--fix")
    assert found.raw == GOOD.replace("\n", "\r\n").encode("utf-8-sig")
    assert found.code == 0
    monkeypatch.setattr("sys.stdin", piped(b"pidcfg: ["))
    broken = validate("-", "--fix")
    assert (broken.code, broken.raw) == (2, b"pidcfg: ["), "an editor that pipes its text loses nothing"
    assert "PID001" in broken.err
    assert validate("-", "a.yaml", "--fix").code == 2
    assert validate("-", "--fix", "--format", "json").code == 2
    monkeypatch.setenv("GITHUB_ACTIONS", "true")
    monkeypatch.setattr("sys.stdin", piped(WRONG.encode()))
    assert validate("-", "--fix").raw == GOOD.replace("\n", "\r\n").encode()


@pytest.mark.skipif(os.name != "posix", reason="rights and links of POSIX")
def test_rights_stay_and_links_are_written_through(validate, tmp_path):
    (tmp_path / "a.yaml").chmod(0o640)
    (tmp_path / "link.yaml").symlink_to("a.yaml")
    assert validate("link.yaml", "--fix").code == 0
    assert (tmp_path / "link.yaml").is_symlink()
    assert (tmp_path / "a.yaml").read_bytes() == GOOD.replace("\n", "\r\n").encode()
    assert (tmp_path / "a.yaml").stat().st_mode & 0o777 == 0o640
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.yaml", "link.yaml"]


def test_a_file_that_somebody_saves_meanwhile_is_left_alone(validate, tmp_path, monkeypatch):
    from pidcfg.cli import policy

    real = policy._fix_input

    def slow(*args):
        outcome = real(*args)
        (tmp_path / "a.yaml").write_text("# saved\n", "utf-8")
        return outcome

    monkeypatch.setattr(policy, "_fix_input", slow)
    found = validate("a.yaml", "--fix")
    assert (found.code, found.out) == (2, "")
    assert "a.yaml has changed since it was read; nothing was written" in found.err
    assert (tmp_path / "a.yaml").read_text("utf-8") == "# saved\n"


def test_a_scenario_is_corrected_too(validate, tmp_path):
    text = (ROOT / "examples/dl06/reactor.scenario.yaml").read_text("utf-8")
    (tmp_path / "reactor.yaml").write_text(REACTOR, "utf-8")
    assert "duration:" in text
    (tmp_path / "s.scenario.yaml").write_text(text.replace("duration:", "duraton:"), "utf-8")
    assert validate("s.scenario.yaml", "--fix").code == 0
    assert (tmp_path / "s.scenario.yaml").read_text("utf-8") == text


def test_json_of_what_remains(validate):
    found = validate("a.yaml", "--fix", "--format", "json")
    assert json.loads(found.out)["summary"]["errors"] == 0


# --- what else a correction must not do -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "option",
    [
        ("--format", "json"),
        ("--output", "json=r.json"),
        ("--baseline", "k.json", "--create-baseline"),
        ("--baseline", "k.json", "--shrink-baseline"),
    ],
)
def test_diff_prints_a_patch_alone(validate, tmp_path, option):
    found = validate("a.yaml", "--diff", *option)
    assert (found.code, found.out) == (2, "")
    assert "--diff prints a patch" in found.err
    assert [path.name for path in tmp_path.iterdir()] == ["a.yaml"]
    (tmp_path / "pidcfg.toml").write_text('format = "json"\n', "utf-8")
    assert validate("a.yaml", "--diff").out.startswith("--- a.yaml"), "a settings file asks for no report"


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ((), None),
        (("--create-baseline",), '{"version": 2, "findings": []}'),
        ((), "{bad"),
        (("--shrink-baseline",), ""),
    ],
)
def test_nothing_is_corrected_before_a_baseline_that_cannot_be_used(validate, tmp_path, options, text):
    if text is not None:
        (tmp_path / "k.json").write_text(text, "utf-8")
    before = (tmp_path / "a.yaml").read_bytes()
    found = validate("a.yaml", "--fix", "--baseline", "k.json", *options)
    assert (found.code, found.out) == (2, "")
    assert "k.json" in found.err
    assert (tmp_path / "a.yaml").read_bytes() == before


@pytest.mark.skipif(os.name != "posix", reason="rights and links of POSIX")
def test_protected_and_linked_files_are_not_replaced(validate, tmp_path):
    (tmp_path / "b.yaml").write_bytes(WRONG.encode())
    (tmp_path / "b.yaml").chmod(0o444)
    found = validate("a.yaml", "b.yaml", "--fix")
    assert (found.code, found.out) == (2, "")
    assert "b.yaml is read-only; nothing was written" in found.err
    (tmp_path / "b.yaml").chmod(0o644)
    os.link(tmp_path / "b.yaml", tmp_path / "other")
    found = validate("a.yaml", "b.yaml", "--fix")
    assert found.code == 2
    assert "b.yaml has more than one name" in found.err
    assert (tmp_path / "a.yaml").read_bytes() == (tmp_path / "other").read_bytes() == WRONG.encode()


@pytest.mark.skipif(not Path("/proc/self").is_dir(), reason="needs a folder in which nobody can write")
def test_nothing_is_corrected_when_the_report_cannot_be_written(validate, tmp_path):
    found = validate("a.yaml", "--fix", "--output", "json=/proc/self/r.json")
    assert found.code == 2
    assert "cannot write /proc/self/r.json" in found.err
    assert (tmp_path / "a.yaml").read_bytes() == WRONG.encode()


@pytest.mark.skipif(os.name != "posix", reason="names that Windows has not")
@pytest.mark.parametrize("name", ["a b.yaml", "a\n+++ x.yaml", 'a"b\\c.yaml', "a\tb.yaml", "café.yaml", "a\udce9.yaml"])
def test_patches_of_files_with_odd_names(validate, tmp_path, name):
    (tmp_path / "a.yaml").unlink()
    (tmp_path / name).write_bytes(WRONG.encode())
    patch = validate(".", "--diff").raw
    assert len(re.findall(rb"^\+\+\+ ", patch, re.MULTILINE)) == 1
    subprocess.run(["git", "apply", "-p0", "-"], input=patch, cwd=tmp_path, check=True)
    assert (tmp_path / name).read_bytes() == GOOD.replace("\n", "\r\n").encode()


def test_the_patch_of_standard_input_names_it_as_other_programs_do(validate, monkeypatch):
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(WRONG.encode())))
    assert validate("-", "--diff").out.startswith("--- -\n+++ -\n@@")


def test_a_reason_that_would_ignore_something_itself_is_left_alone():
    text = GOOD.rstrip() + "  # pidcfg: ignore[DL242] #pidcfg: ignore[PID101] why\n"
    assert "ignore[PID101]" in fix(text).data.decode()
    text = GOOD.rstrip() + "  # pidcfg: ignore[DL242] pidcfg: ignore[PID101] why\n"
    assert fix(text).data.decode() == text


# --- ``validate --fix`` does what its count says: so many findings go, none comes back, and no other byte changes -----


STARTERS = Path(__file__).parents[1] / "src/pidcfg/cli/starters"
MENDED = {
    "dl06": [
        ("V2000 ", "v2000 "),
        ("sample_rate:", "smaple_rate:"),
        ("gain: 2.00 ", 'gain: "2.00" '),
        ("bias_freeze: true ", "bias_freeze: yes "),
        ("action: direct ", "action: DIRECT "),
        ("hysteresis:", "hysterisis:"),
    ],
    "click": [
        ("bits: C101 ", "bits: c0101 "),
        ("derivative_gain:", "derivative-gain:"),
        ("filter: 80 ", 'filter: "80" '),
        ("freeze_bias: true ", "freeze_bias: on "),
        ("hysteresis: 2.0", 'hysteresis: "2.0"'),
    ],
    "ezlogix": [
        ("registers: R101 ", "registers: r101 "),
        ("algorithm: position ", "algorithm: Position "),
        ("integral_time:", "integral time:"),
        ("anti_windup: true", "anti_windup: yes"),
    ],
    "nextopid": [("sample_time: 100 ms", "sampel_time: 100 ms"), ("  - name: FIC_101\n", "  - Name: FIC_101\n")],
    "dpide": [("device: D500 ", "device: d500 "), ("PID_RUN: true ", "PID_RUN: yes "), ("MV_MAX:", "MVMAX:")],
    "generic": [("integral_time:", "integarl_time:"), ("proportional: true ", "proportional: 'true' ")],
}
"""Texts of each starter file, and slips that have one reading."""
LEFT = {
    "dl06": [("limits: [20, 300]", "limits: [020, 300]"), ("rate: 0 ", "rate: high ")],
    "click": [("reset_time: 120 ", "reset_time: 0120 "), ("integers: DS101 ", "integers: DS0 ")],
    "ezlogix": [("proportional_gain: 2.00 ", "proportional_gain: 0x180 "), ("tag: IR1 ", "tag: XR1 ")],
    "nextopid": [("MaxMV: 100.0", "MaxMV: 0100")],
    "dpide": [("CYCLE: 1000 ", "CYCLE: 01000 "), ("PID_DIR: true ", "PID_DIR: forward ")],
    "generic": [("gain: 2.5 ", "gain: 2,5 "), ("derivative_on: pv ", "derivative_on: level ")],
}
"""Slips that a person has to decide."""
CASES = st.sampled_from([*VENDORS]).flatmap(
    lambda key: st.tuples(
        st.just(key), st.sets(st.sampled_from(MENDED[key])), st.sets(st.sampled_from(LEFT[key])), st.booleans()
    )
)


def spoilt(vendor, slips):
    """A starter file with slips in it."""
    text = (STARTERS / f"{vendor}.yaml").read_text("utf-8")
    for good, bad in slips:
        assert text.count(good) >= 1, good
        text = text.replace(good, bad, 1)
    return text


def findings(*arguments):
    """Code and place of each finding that a run reports, and what it says to people."""
    code, both, out = captured(pidcfg, ["validate", "a.yaml", "--format", "json", *arguments])
    assert code in {0, 1}, both
    rows = json.loads(out)["findings"]
    return Counter((row["code"], row["line"], row["message"]) for row in rows), both.replace(out, "")


def number(text, pattern):
    """The number that a text names; 0 where it names none."""
    match = re.search(pattern, text)
    return int(match[1]) if match else 0


@settings(max_examples=25, deadline=None)
@given(CASES)
def test_the_number_that_fix_names_is_that_of_the_findings_gone(case):
    vendor, mended, left, windows = case
    end = "\r\n" if windows else "\n"
    wrong, right = (spoilt(vendor, slips).replace("\n", end).encode() for slips in ([*mended, *left], left))
    with tempfile.TemporaryDirectory() as folder, chdir(folder):
        Path("a.yaml").write_bytes(wrong)
        before, said = findings()
        after, corrected = findings("--fix")
        assert Path("a.yaml").read_bytes() == right
        named = number(corrected, r"(\d+) findings? in \d+ files? corrected")
        assert named == number(said, r"(\d+) correctable with --fix") == len(mended)
        assert (before - after).total() == named
        assert {row[0] for row in (before - after)} == {*re.findall(r"x ([A-Z]+\d+)", corrected)}
        assert after == findings()[0], "what is left is named"
        assert sum(after.values()) >= len(left)
        again, said = findings("--fix")
        assert "0 findings in 0 files corrected" in said
        assert (again, Path("a.yaml").read_bytes()) == (after, right)


@pytest.mark.parametrize("vendor", VENDORS)
def test_every_slip_is_one(vendor):
    for slip in (*MENDED[vendor], *LEFT[vendor]):
        with tempfile.TemporaryDirectory() as folder, chdir(folder):
            Path("a.yaml").write_text(spoilt(vendor, [slip]), "utf-8")
            assert findings()[0], slip


@pytest.mark.parametrize("line_end", ["\n", "\r\n"])
@pytest.mark.parametrize(
    ("text", "put"),
    [
        ("a:\n  b: 1\n", "a:\n  b: 1\n  c: 2\n"),
        ("a:\n  'b': 1\n", "a:\n  'b': 1\n  'c': 2\n"),
        ('a:\n  "b": 1  # one\n', 'a:\n  "b": 1  # one\n  "c": 2\n'),
        ("a: {b: 1}\n", "a: {b: 1, c: 2}\n"),
        ('a: {"b": 1}\n', 'a: {"b": 1, "c": 2}\n'),
    ],
)
def test_another_key_is_written_as_the_one_beside_it(text, put, line_end):
    document = read_document(text.replace("\n", line_end).encode(), "a.yaml")
    target = _KeyPlace.find(document, ("a", "b"))
    place, rest = target.end_span(document), document.lines
    at = sum(len(line) + len(line_end) for line in rest[: place.line - 1]) + place.column - 1
    whole = text.replace("\n", line_end)
    assert whole[:at] + target.sibling_text(document, "c", "2") + whole[at:] == put.replace("\n", line_end)


def test_a_long_value_is_told_by_16_digits_of_its_hash():
    assert rule.shorten_value("v" * 80) == "v" * 80
    digits = hashlib.sha256(b"v" * 81).hexdigest()
    assert rule.shorten_value("v" * 81) == f"sha256:{digits[:16]}"
