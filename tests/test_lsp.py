"""The language server: what it finds is what `validate` finds, where it stands is where the editor has it."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

import pidcfg
from pidcfg.cli.commands import lsp as lsp_command
from pidcfg.cli.main import cli

pytest.importorskip("pygls", reason="pygls is not installed: the extra lsp")

from lsprotocol import types

from lsp_client import Client
from pidcfg.cli.lsp import answers
from pidcfg.cli.lsp.completion import completions, cursor_in
from pidcfg.cli.lsp.files import Buffer, Files, difference_range, path_of, uri_of
from pidcfg.text.diagnostics import Severity, Span
from pidcfg.text.reader import DISK, Overlay
from pidcfg.text.source import read_document

ROOT = Path(__file__).parents[1]
CASES = sorted([*(ROOT / "tests/cases").rglob("*.yaml"), *(ROOT / "examples").rglob("*.yaml")])
REACTOR = ROOT / "examples/dl06/reactor.yaml"


def analysed(path, text=None, files=None):
    """What is found in a file, or in a text that stands for it."""
    files = files or Files()
    files.put_buffer(uri_of(path.as_posix()), 1, path.read_bytes().decode("utf-8", "replace") if text is None else text)
    return files.analyse(uri_of(path.as_posix()))


def at(text, word, more=0):
    """The position of a word, as an editor counts it with UTF-16."""
    before = text[: text.index(word) + more]
    line = before.rpartition("\n")[2]
    return types.Position(before.count("\n"), len(line.encode("utf-16-le")) // 2)


@pytest.fixture
def folder(tmp_path):
    """The reactor with its scenario."""
    for path in (ROOT / "examples/dl06").glob("reactor*.yaml"):
        shutil.copy(path, tmp_path)
    return tmp_path


# --- findings ---------------------------------------------------------------------------------------------------------


def told(analysis):
    """Code, place and first line of what the editor is told."""
    rows = zip(analysis.findings, answers.diagnostics(analysis), strict=True)
    return [
        (d.code, analysis.buffer.line_and_column(row.range.start), row.message.partition("\n")[0]) for d, row in rows
    ]


@pytest.mark.parametrize("letter", sorted({path.stem[:2] for path in CASES}))
def test_the_findings_are_those_of_check_in_every_case(letter):
    for path in (path for path in CASES if path.stem[:2] == letter):
        data = path.read_bytes()
        try:
            data.decode()
        except UnicodeDecodeError:
            continue  # an editor has text
        analysis = analysed(path)
        if "pidcfg" not in analysis.document.text:
            continue
        found = pidcfg.check(path).findings
        assert analysis.findings == found, path
        places = [(d.code, (d.span.line, d.span.column), d.message.partition("\n")[0]) for d in found]
        assert [row[0] for row in told(analysis)] == [row[0] for row in places]
        if "\r" not in analysis.document.text and not analysis.buffer.text.startswith("\ufeff"):
            last = len(analysis.document.lines)
            assert [row for row in told(analysis) if row[1][0] < last] == [row for row in places if row[1][0] < last]


def test_settings_a_baseline_and_comments_count_as_on_the_command_line(folder, monkeypatch):
    monkeypatch.chdir(folder)
    path = folder / "reactor.yaml"
    text = path.read_text("utf-8").replace(
        "reset: 4.0", "reset: 4.0, rate: 0 # pidcfg: ignore[DL211] measured\n    #", 1
    )
    path.write_text(text.replace("bumpless: I ", "bumpless: I  "), "utf-8")
    run = CliRunner().invoke
    assert run(cli, ["validate", "reactor.yaml", "--baseline", "known.json", "--create-baseline", "--select", "DL231"])
    (folder / "pidcfg.toml").write_text('ignore = ["DL222"]\nbaseline = "known.json"\nseverity = "warning"\n', "utf-8")
    result = run(cli, ["validate", "reactor.yaml", "--format", "json"])
    rows = [(one["code"], one["line"], one["column"]) for one in json.loads(result.stdout)["findings"]]
    found = [(d.code, d.span.line, d.span.column) for d in analysed(path).findings]
    assert found == rows
    assert {code for code, *_ in rows}.isdisjoint({"DL222", "DL231"})


def test_settings_that_cannot_be_read_are_told_once_and_do_not_count(folder):
    (folder / "pidcfg.toml").write_text("ignore = 3\n", "utf-8")
    analysis = analysed(folder / "reactor.yaml")
    assert "ignore must be a list of codes" in analysis.remark
    assert analysis.findings == pidcfg.check(folder / "reactor.yaml").findings


def test_other_yaml_files_are_left_alone_and_a_limit_is_one_finding(tmp_path):
    assert analysed(tmp_path / "compose.yaml", "services: {web: {image: a}}\n").findings == ()
    assert analysed(tmp_path / "empty.yaml", "").findings == ()
    large = "pidcfg: 1\nvendor: dl06\n" + "# more\n" * 500_000
    assert [d.code for d in analysed(tmp_path / "large.yaml", large).findings] == ["PID013"]


def test_buffers_come_before_files(folder):
    scenario, config = folder / "reactor.scenario.yaml", folder / "reactor.yaml"
    files = Files()
    assert analysed(scenario, files=files).findings == ()
    files.put_buffer(uri_of(config.as_posix()), 1, config.read_text("utf-8").replace("name: LIC-103", "name: LIC-104"))
    assert {d.code for d in analysed(scenario, files=files).findings} == {"PID050", "PID055"}
    files.drop_buffer(uri_of(config.as_posix()))
    assert analysed(scenario, files=files).findings == ()


# --- places -----------------------------------------------------------------------------------------------------------

SIGNS = "\ufeff# Öfen 🔥🔥\r\na: 'ä🔥' # x\rb: [1,\u20282]\n\n"


@pytest.mark.parametrize("unit", ["utf-8", "utf-16", "utf-32"])
def test_places_are_found_again_in_the_units_of_the_editor(unit):
    buffer = Buffer(SIGNS, unit)
    for offset in range(len(SIGNS) + 1):
        if SIGNS[offset - 1 : offset + 1] != "\r\n":
            assert buffer.offset(buffer.position(offset)) == offset
            line, column = buffer.line_and_column(buffer.position(offset))
            if offset:
                assert buffer.offset_of(line, column) == offset
    assert buffer.offset(types.Position(0, 99)) == SIGNS.index("\r")
    assert buffer.offset(types.Position(99, 0)) == len(SIGNS)


def test_columns_count_the_units_of_utf_16():
    text = "pidcfg: 1\nvendor: dl06\nplc: {loop_table: V2000}\nloops:\n  - {name: 🔥Ö, sample_rate: 1, gian: 2}\n"
    analysis = analysed(Path("/x/y.yaml"), text)
    row = next(row for row in answers.diagnostics(analysis) if "gian" in row.message)
    start = at(text, "gian")
    assert (row.range.start, row.range.end.character) == (start, start.character + 4)
    assert start.character == text.splitlines()[4].index("gian") + 1


def test_the_difference_of_two_texts_is_one_stretch():
    for before, after in (("", "a"), ("abc", "axc"), ("aa", "a"), ("a\n", "b\na\n"), ("x", "x"), ("aXa", "aa")):
        begin, end, text = difference_range(before, after)
        assert before[:begin] + text + before[end:] == after


def test_files_and_uris_are_each_other(tmp_path):
    for name in ("a b.yaml", "100 %.yaml", "ü#?.yaml"):
        path = (tmp_path / name).as_posix()
        assert path_of(uri_of(path)) == path
    assert path_of("untitled:Untitled-1") == "untitled:Untitled-1"


# --- what stands at a place -------------------------------------------------------------------------------------------


def shown(path, word, text=None):
    """The hover text at a word."""
    analysis = analysed(path, text)
    answer = answers.hover_text(analysis, at(analysis.buffer.text, word, len(word) - len(word.lstrip())))
    return "" if answer is None else answer.contents.value


def test_hover_tells_meaning_unit_limits_and_the_word():
    text = shown(REACTOR, "gain: 2.50")
    for part in ("**tuning.gain**", "Gain Kc", "Unit: %/%", "0 to 99.99 %/%", "`V2050` = `0250`", "decimal 592"):
        assert part in text
    assert "hexadecimal 0250" in text
    assert "DL06 manual ch. 8, Loop Table Word Definitions" in text
    assert "one of `linear`, `squared`" in shown(REACTOR, "curve: linear")
    assert "`V2040.4` = `0`" in shown(REACTOR, "action: direct\n    bumpless: I\n    tuning")
    assert "first_order" in shown(ROOT / "examples/dl06/reactor.scenario.yaml", "model: first_order")
    assert shown(REACTOR, "# direct: PV") == ""


@pytest.mark.parametrize(
    ("file", "word", "part"),
    [
        ("click/tank.yaml", "proportional_gain", "`DF1"),
        ("ezlogix/oven.yaml", "proportional_gain", "`R103`"),
        ("nextopid/furnace.yaml", "Kp", "`TIC_1.Kp`"),
        ("dpide/oven.yaml", "\n    Kc_Kp", "`D112`"),
        ("generic/boiler.yaml", "gain", "TIC-1.tuning.gain"),
    ],
)
def test_hover_tells_the_word_of_every_vendor(file, word, part):
    assert part in shown(ROOT / "examples" / file, f"{word}: ")


def test_hover_in_a_template_tells_the_words_of_all_its_loops_and_on_an_ignore_the_rule():
    head = "pidcfg: 1\nvendor: dl06\nplc: {loop_table: V2000}\n"
    body = "templates:\n  t: {sample_rate: 1, action: direct, tuning: {gain: 2, reset: 30}}\nloops:\n"
    text = head + body + "  - {name: A, use: t}\n  - {name: B, use: t}\n"
    assert all(part in shown(Path("/x/t.yaml"), "gain", text) for part in ("`V2010`", "`V2050`", "of A", "of B"))
    commented = REACTOR.read_text("utf-8").replace("bias_freeze: true", "bias_freeze: true # pidcfg: ignore[DL222] ok")
    assert "# DL222 " in shown(REACTOR, "ignore[DL222]", commented)
    assert "Why." in shown(REACTOR, "pidcfg: ignore[DL222]", commented)


def test_words_stand_behind_the_values_that_are_written():
    analysis = analysed(REACTOR)
    text = analysis.buffer.text
    line = at(text, "gain: 2.50").line
    place = types.Range(types.Position(line, 0), types.Position(line, 0))
    hints = {hint.label: hint.position for hint in answers.inlay_hints(analysis, place)}
    assert hints["⟶ V2050 0250"] == at(text, "2.50", 4)
    assert {label.split()[1] for label in hints} == {"V2050", "V2051", "V2052"}
    every = types.Range(types.Position(0, 0), types.Position(10**6, 0))
    assert not answers.inlay_hints(analysed(ROOT / "examples/nextopid/cascade.yaml"), every), (
        "the name is the key itself"
    )


def test_the_outline_has_the_loops_by_name():
    def names(rows):
        return {row.name: names(row.children or ()) for row in rows}

    found = names(answers.outline_symbols(analysed(REACTOR)))
    assert list(found["loops"]) == ["FIC-102", "TIC-101", "LIC-103"]
    assert {"tuning", "alarms"} <= set(found["loops"]["TIC-101"])
    scenario = names(answers.outline_symbols(analysed(ROOT / "examples/dl06/reactor.scenario.yaml")))
    assert list(scenario["plants"]) == ["FIC-102", "TIC-101", "LIC-103"]


# --- names ------------------------------------------------------------------------------------------------------------


def test_a_loop_is_found_and_renamed_in_its_configuration_and_its_scenarios(folder):
    config, scenario = folder / "reactor.yaml", folder / "reactor.scenario.yaml"
    files = Files(folders=[folder.as_posix()])
    analysis = analysed(scenario, files=files)
    position = at(analysis.buffer.text, "loop: TIC-101", 8)
    there = answers.find_definition(analysis, files, position)
    assert (path_of(there.uri), there.range.start) == (
        config.as_posix(),
        at(config.read_text("utf-8"), "TIC-101\n    desc"),
    )
    places = answers.all_references(analysis, files, position)
    assert [path_of(place.uri).endswith("scenario.yaml") for place in places] == [False] * 2 + [True] * 5
    assert answers.renameable_range(analysis, files, position).start.character == position.character - 2
    edit = answers.rename_loop(analysis, files, position, "TIC-7")
    for change in edit.document_changes:
        path = Path(path_of(change.text_document.uri))
        text = path.read_text("utf-8")
        buffer = Buffer(text)
        for one in reversed(change.edits):
            begin, end = buffer.offset(one.range.start), buffer.offset(one.range.end)
            assert text[begin:end] == "TIC-101"
            text = text[:begin] + one.new_text + text[end:]
        assert "TIC-101" not in re.sub("#.*", "", text), "comments stay"
        path.write_text(text, "utf-8")
    assert not [d for path in (config, scenario) for d in pidcfg.check(path).findings if d.severity.label == "error"]


def test_a_name_that_is_a_number_or_a_word_of_the_format_is_told_from_them():
    body = "sample_rate: 1, action: direct, mode: auto, tuning: {gain: 1, reset: 1}"
    config = f"pidcfg: 1\nvendor: dl06\nplc: {{loop_table: V2000}}\nloops:\n  - {{name: 1, {body}}}\n"
    config += "  - {name: auto, cascade_from: 1, " + body.replace("auto", "cascade") + "}\n"
    found = pidcfg.references(read_document(config.encode(), "c.yaml"), {"1", "auto"})
    assert [(one.loop, one.path[2:], one.defines) for one in found] == [
        ("1", ("name",), True),
        ("auto", ("name",), True),
        ("1", ("cascade_from",), False),
    ]
    scenario = "pidcfg: 1\nscenario: auto\nconfig: c.yaml\nduration: 1\nplants: {1: {model: first_order, gain: 1}}\n"
    scenario += "events: [{at: 1, loop: 1, mode: auto}]\nexpect: [{signal: 1.PV, max: 1}, {loop: auto, mode: auto}]\n"
    found = pidcfg.references(read_document(scenario.encode(), "s.yaml"), {"1", "auto"})
    paths = [".".join(map(str, one.path)) for one in found]
    assert paths == ["plants.1", "events.0.loop", "expect.0.signal", "expect.1.loop"]


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("FIC-102", "there is a loop FIC-102 already"),
        ("TIC 1: 2", "would not be read as a name"),
        ("", "would not be read as a name"),
        ("x" * 65, "cannot be its name"),
    ],
)
def test_a_name_that_would_be_wrong_anywhere_is_used_nowhere(folder, name, why):
    files = Files(folders=[folder.as_posix()])
    analysis = analysed(folder / "reactor.yaml", files=files)
    with pytest.raises(answers.RenamingError, match=why):
        answers.rename_loop(analysis, files, at(analysis.buffer.text, "cascade_from: TIC-101", 16), name)


def test_the_name_of_a_file_leads_to_it(folder):
    files = Files()
    analysis = analysed(folder / "reactor.scenario.yaml", files=files)
    there = answers.find_definition(analysis, files, at(analysis.buffer.text, "reactor.yaml"))
    assert path_of(there.uri) == (folder / "reactor.yaml").as_posix()


# --- corrections ------------------------------------------------------------------------------------------------------

WRONG = """\
pidcfg: 1
vendor: dl06
plc: {loop_table: v2000}
loops:
  - name: A
    sample_rate: "1"
    action: direct
    tuning: {gain: "2", reset: 30}
"""


def applied(analysis, title):
    """The text after the action of a title."""
    everywhere = types.Range(types.Position(0, 0), types.Position(99, 0))
    found = answers.code_actions(analysis, Files(), everywhere, lazy=False)
    action = next(action for action in found if action.title.startswith(title))
    (change,) = action.edit.document_changes
    (edit,) = change.edits
    text = analysis.buffer.text
    begin, end = analysis.buffer.offset(edit.range.start), analysis.buffer.offset(edit.range.end)
    return text[:begin] + edit.new_text + text[end:]


def test_a_correction_is_that_of_fix_for_one_for_a_kind_and_for_all():
    analysis = analysed(Path("/x/y.yaml"), WRONG)
    assert applied(analysis, "Write V2000") == WRONG.replace("v2000", "V2000")
    codes = {d.code for d in analysis.findings if '"2" is text' in d.message}
    assert applied(analysis, f"Correct every {codes.pop()}") == WRONG.replace('"1"', "1").replace('"2"', "2")
    assert applied(analysis, "Correct everything") == pidcfg.fix(WRONG).text != WRONG
    with_mark = analysed(Path("/x/y.yaml"), f"\ufeff{WRONG}")
    assert applied(with_mark, "Write V2000") == f"\ufeff{WRONG}".replace("v2000", "V2000")


SPOILED = [
    # example                      what stands there      spoiled                   the action that mends it
    ("dl06/oven.yaml", "gain:", "gian:", "Write gain"),
    ("dl06/reactor.yaml", "action: direct", "action: dierct", "Write direct"),
    ("dl06/kettle.yaml", "sample_rate: 1.0", "sample_rate: 1,0", "Write 1.0"),
    ("ezlogix/dosing.yaml", "name: Dosing", "naem: Dosing", "Write name"),
    ("ezlogix/oven.yaml", "setpoint:", "setpiont:", "Write setpoint"),
    ("click/tank.yaml", "bits: C101", "bits: c0101", "Write C101"),
    ("click/tank.yaml", "sample_rate: 500 ms", "sample_rate: 500", "Write 500 ms"),
    ("nextopid/pump.yaml", "vendor: nextopid", "vendor: nextpid", "Write nextopid"),
    ("dpide/dryer.yaml", "vendor: dpide", "vendor: dpdie", "Write dpide"),
    ("dpide/chiller.scenario.yaml", "signal: TIC-21.PV", "signal: TIC-12.PV", "Write TIC-21.PV"),
    ("generic/boiler.yaml", "vendor: generic", "vendor: genric", "Write generic"),
]


@pytest.mark.parametrize(("file", "good", "bad", "title"), SPOILED, ids=[row[2] for row in SPOILED])
def test_what_a_cure_asks_for_is_written_by_its_action(file, good, bad, title):
    path = ROOT / "examples" / file
    text = path.read_text("utf-8")
    analysis = analysed(path, text.replace(good, bad, 1))
    assert good in text
    assert any(d.severity is Severity.ERROR for d in analysis.findings)
    assert applied(analysis, title) == text


@pytest.mark.parametrize(
    ("file", "good", "bad"),
    [
        ("dpide/dryer.yaml", "Kc_Kp:", "gain:"),  # another unit
        ("dl06/oven.yaml", "loop_table: V", "loop_table: W"),  # no word is asked for
        ("nextopid/cascade.yaml", "Kp:", "P:"),
    ],
)
def test_a_cure_that_says_more_than_a_word_is_for_a_person(file, good, bad):
    path = ROOT / "examples" / file
    analysis = analysed(path, path.read_text("utf-8").replace(good, bad, 1))
    everywhere = types.Range(types.Position(0, 0), types.Position(10_000, 0))
    assert any(d.severity is Severity.ERROR for d in analysis.findings)
    assert not [
        one for one in answers.code_actions(analysis, Files(), everywhere, lazy=False) if one.title[:6] == "Write "
    ]


def test_an_action_ignores_a_finding_and_asks_for_the_reason():
    analysis = analysed(REACTOR)
    text = applied(analysis, "Ignore DL222")
    assert "bias_freeze: true  # pidcfg: ignore[DL222]\n" in text
    left = {d.code for d in pidcfg.check(text).findings}
    assert "DL222" not in left
    assert "PID046" in left, "no reason is given"


# --- completion -------------------------------------------------------------------------------------------------------

CURSORS = {
    "": ((), True, ""),
    "pid": ((), True, "pid"),
    "loops:\n  - name: A\n    tun": (("loops", 0), True, "tun"),
    "loops:\n- name: A\n  tun": (("loops", 0), True, "tun"),
    "loops:\n  - name: A\n    tuning: {gain: 2, re": (("loops", 0, "tuning"), True, "re"),
    "loops:\n  - name: A\n    tuning: {gain: 2, reset: 3": (("loops", 0, "tuning", "reset"), False, "3"),
    "loops:\n  - name: A\n    alarms:\n      pv: {low: 3}\n      ": (("loops", 0, "alarms"), True, ""),
    "loops:\n  - name: A\n    alarms:\n      pv: {low: 3}\n    ": (("loops", 0), True, ""),
    "loops:\n  - name: A\n\n  # B: {\n  - ": (("loops", 1), True, ""),
    "loops:\n  - name: A\n    pv:\n      range: [0, ": (("loops", 0, "pv", "range", 1), False, ""),
    "loops:\n  - name: A\n    tuning: {\n      gain: 2,\n      re": (("loops", 0, "tuning"), True, "re"),
    "loops:\n  - {name: 'A: {', mode: ": (("loops", 0, "mode"), False, ""),
    "a: 'it''s' # {\nb: ": (("b",), False, ""),
    "plants:\n  ": (("plants",), True, ""),
    "a: 1 # comm": None,
    "# pid": None,
}


@pytest.mark.parametrize("text", CURSORS)
def test_the_cursor_is_found_by_brackets_and_indentation(text):
    cursor = cursor_in(text)
    assert (cursor and (cursor.path, cursor.is_key, cursor.prefix)) == CURSORS[text]


def offered(text, path=REACTOR):
    """What is offered at the sign ┃ of a text, by label: the text that is put there."""
    before, _, after = text.partition("┃")
    whole = before + after
    files = Files()
    files.put_buffer(uri_of(path.as_posix()), 1, path.read_text("utf-8"))
    files.analyse(uri_of(path.as_posix()))
    files.put_buffer(uri_of(path.as_posix()), 2, whole)
    files.analyse(uri_of(path.as_posix()))
    opened = files.buffers[uri_of(path.as_posix())]
    found = completions(opened.buffer, opened.buffer.position(len(before)), opened.last_doc, files.reader)
    for item in found:
        assert opened.buffer.offset(item.text_edit.range.end) == len(before)
    return {item.label: item.text_edit.new_text for item in found}


def test_a_scenario_is_offered_the_configurations_beside_it():
    path = ROOT / "examples/dl06/reactor.scenario.yaml"
    text = path.read_text("utf-8").replace("config: reactor.yaml", "config: ┃")
    assert {"reactor.yaml", "oven.yaml"} <= {*offered(text, path)}
    assert not [name for name in offered(text, path) if "scenario" in name]


def test_keys_are_offered_that_the_mapping_may_have_and_has_not():
    text = REACTOR.read_text("utf-8")
    assert set(offered(text.replace("reset_unit: seconds, rate: 0}", "┃"))) == {"reset_unit", "rate"}
    assert set(offered(text.replace("reset: 4.0, reset_unit: seconds,", "┃"))) == {"reset", "reset_unit"}
    half = text.replace("    derivative_gain_limit: 10\n", "    deri┃\n")
    assert {"derivative_gain_limit", "independent_of_cpu_mode"} <= set(offered(half))
    assert "sample_rate" not in offered(half)


@pytest.mark.parametrize(
    ("before", "after", "labels"),
    [
        ("curve: linear", "curve: ┃", {"linear", "squared"}),
        ("sample_rate: 2.0", "sample_rate: ┃", {"250 ms", "2 min"}),
        ("bias_freeze: true", "bias_freeze: ┃", {"true", "false"}),
        ("cascade_from: TIC-101", "cascade_from: T┃", {"FIC-102", "TIC-101", "LIC-103"}),
        ("cascade_from: TIC-101", "cascade_from: {┃", set()),
    ],
)
def test_values_are_offered_with_their_units_and_loops_by_name(before, after, labels):
    assert labels <= set(offered(REACTOR.read_text("utf-8").replace(before, after, 1)))


def test_a_scenario_is_offered_the_loops_and_signals_of_its_configuration():
    path = ROOT / "examples/dl06/reactor.scenario.yaml"
    text = path.read_text("utf-8")
    assert {"FIC-102", "TIC-101"} <= set(offered(text.replace("loop: TIC-101", "loop: ┃", 1), path))
    assert {"FIC-102.PV", "TIC-101.SP"} <= set(offered(text.replace("input: FIC-102.PV", "input: F┃", 1), path))
    assert offered(text.replace("  LIC-103: {model", "  ┃: {model", 1), path)["LIC-103"] == "LIC-103: "


def test_a_parameter_is_offered_what_it_may_be_wired_to():
    path = ROOT / "examples/nextopid/cascade.yaml"
    text = path.read_text("utf-8")
    assert {"TIC_1.MV", "FIC_3.TRK_OUT"} <= set(offered(text.replace("SP_CASC: TIC_1.MV", "SP_CASC: ┃", 1), path))
    assert "TIC_1.MV" not in offered(text.replace("type: PIDA_REAL", "type: ┃", 1), path)
    assert not [name for name in offered(REACTOR.read_text("utf-8").replace("gain: 2.50", "gain: ┃")) if "." in name]


def test_an_empty_file_is_offered_what_begins_one(tmp_path):
    path = tmp_path / "new.yaml"
    path.write_text("", "utf-8")
    assert set(offered("┃", path)) == {"pidcfg", "vendor", "scenario"}
    assert set(offered("pidcfg: 1\nvendor: ┃", path)) == set(pidcfg.vendors.VENDORS)
    assert {"plc", "loops"} <= set(offered("pidcfg: 1\nvendor: dl06\n┃", path))


def test_nothing_is_offered_or_listed_in_other_yaml_files(tmp_path):
    path = tmp_path / "compose.yaml"
    path.write_text("services: {web: {image: a}}\n", "utf-8")
    assert offered("services: {web: {image: a}}\n┃", path) == {}
    analysis = analysed(path)
    assert answers.outline_symbols(analysis) == answers.code_lenses(analysis) == []
    assert answers.hover_text(analysis, types.Position(0, 2)) is None


# --- the server as an editor has it -----------------------------------------------------------------------------------


def test_an_editor_is_served(folder):
    uri, other = (uri_of((folder / name).as_posix()) for name in ("reactor.yaml", "reactor.scenario.yaml"))
    text = (folder / "reactor.yaml").read_text("utf-8")
    with Client(folder) as client:
        client.open(uri, text)
        assert [row["code"] for row in client.found(uri)] == [d.code for d in pidcfg.check(text).findings]
        place = {"textDocument": {"uri": uri}}
        everything = {"start": {"line": 0, "character": 0}, "end": {"line": 99, "character": 0}}
        assert client.ask("textDocument/inlayHint", {**place, "range": everything})
        assert client.ask("textDocument/documentSymbol", place)
        lenses = client.ask("textDocument/codeLens", place)
        assert [lens["command"]["arguments"][1] for lens in lenses] == ["FIC-102", "TIC-101", "LIC-103"]
        command = lenses[1]["command"]
        words = client.ask("workspace/executeCommand", {key: command[key] for key in ("command", "arguments")})
        assert "V2050                  0250  Gain (proportional)" in words
        client.open(other, (folder / "reactor.scenario.yaml").read_text("utf-8"))
        (lens,) = client.ask("textDocument/codeLens", {"textDocument": {"uri": other}})
        told = client.ask("workspace/executeCommand", {key: lens["command"][key] for key in ("command", "arguments")})
        assert "passed: 4 of 4 expectations" in told
        assert told in client.shown
        position = {"position": {"line": 10, "character": 20}, "newName": "FIC-102"}
        assert "already" in client.answer("textDocument/rename", {**place, **position})["error"]["message"]


def test_only_the_newest_version_counts_however_fast_somebody_types(folder):
    uri, text = uri_of((folder / "reactor.yaml").as_posix()), (folder / "reactor.yaml").read_text("utf-8")
    with Client(folder) as client:
        client.open(uri, text)
        for version in range(2, 40):
            client.change(uri, text.replace("gain: 2.50", f"gain: 2.{version}" + "x" * (version < 39)), version)
        assert [row["code"] for row in client.found(uri, 39)] == [d.code for d in pidcfg.check(text).findings]


def test_a_save_looks_at_the_settings_again_and_tells_what_is_wrong_with_them_once(folder):
    uri, text = uri_of((folder / "reactor.yaml").as_posix()), (folder / "reactor.yaml").read_text("utf-8")
    with Client(folder) as client:
        client.open(uri, text)
        assert "DL211" in {row["code"] for row in client.found(uri)}
        for line, codes in (('ignore = ["DL2"]', set()), ("ignore = 3", {"DL211", "DL222", "DL231"})):
            (folder / "pidcfg.toml").write_text(line, "utf-8")
            for _ in range(2):
                client.findings.clear()
                client.tell("textDocument/didSave", {"textDocument": {"uri": uri}})
                assert {row["code"] for row in client.found(uri)} == codes
        client.at("hover", uri, 0, 0)
        assert len(client.shown) == 1


def test_words_beside_values_can_be_turned_off(folder):
    uri, text = uri_of((folder / "reactor.yaml").as_posix()), (folder / "reactor.yaml").read_text("utf-8")
    everything = {"start": {"line": 0, "character": 0}, "end": {"line": 99, "character": 0}}
    with Client(folder, options={"inlayHints": False}) as client:
        client.open(uri, text)
        assert client.ask("textDocument/inlayHint", {"textDocument": {"uri": uri}, "range": everything}) == []


BROKEN = """
from pidcfg.cli.lsp import answers, server
from pidcfg.output import findings

def boom(*_):
    raise ZeroDivisionError("a bug")

answers.hover_text = boom
judge = findings.check_with_words
findings.check_with_words = lambda doc, reader: boom() if "BUG" in doc.text else judge(doc, reader)
server.start_server()
"""


def test_a_bug_answers_one_request_with_an_error_and_the_server_lives_on(folder):
    uri, text = uri_of((folder / "reactor.yaml").as_posix()), (folder / "reactor.yaml").read_text("utf-8")
    with Client(folder, command=(sys.executable, "-c", BROKEN)) as client:
        client.open(uri, text)
        place = {"textDocument": {"uri": uri}, "position": {"line": 3, "character": 1}}
        assert "a bug" in json.dumps(client.answer("textDocument/hover", place)["error"])
        assert client.ask("textDocument/documentSymbol", {"textDocument": {"uri": uri}})
        client.change(uri, f"{text}# BUG\n", 2)
        assert "error" in client.answer("textDocument/documentSymbol", {"textDocument": {"uri": uri}})
        client.change(uri, text, 3)
        assert len(client.found(uri, 3)) == len(pidcfg.check(text).findings)


TYPED = """\
pidcfg: 1
vendor: dl06  # Ö 🔥
plc: {loop_table: V2000, "x": [1, 'a'}
loops:
  - name: A
    sample_rate: 200 ms
    tuning: {gain: 2, reset: &r 3, rate: *r}
    description: |
      text: {
"""


def test_no_keystroke_is_answered_with_an_error(tmp_path):
    uri = uri_of((tmp_path / "typed.yaml").as_posix())
    with Client(tmp_path) as client:
        client.open(uri, "", 0)
        for version in range(1, len(TYPED) + 1, 3):
            text = TYPED[:version]
            client.change(uri, text, version)
            end = Buffer(text).position(len(text))
            client.at("completion", uri, end.line, end.character)
            client.at("hover", uri, end.line, max(end.character - 1, 0))
        assert client.shown == []


needs_neovim = pytest.mark.skipif(shutil.which("nvim") is None or os.name != "posix", reason="Neovim is not installed")
PAGE = (ROOT / "docs/editors.md").read_text("utf-8")
SESSION = """
local function out(text) io.stdout:write(text .. "\\n") end
local function ask(method, params)
  local id = vim.lsp.get_active_clients()[1].id
  local answer = (vim.lsp.buf_request_sync(0, method, params, 100000) or {})[id] or { error = "nothing" }
  if answer.error then out("error " .. vim.inspect(answer.error)) end
  return answer.result
end
vim.cmd("filetype on | edit reactor.yaml")
vim.wait(100000, function() return #vim.diagnostic.get(0) > 0 end, 50)
out("findings " .. #vim.diagnostic.get(0))
vim.api.nvim_win_set_cursor(0, { 35, 14 })
out("hover " .. ask("textDocument/hover", vim.lsp.util.make_position_params(0)).contents.value)
out("items " .. #ask("textDocument/completion", vim.lsp.util.make_position_params(0)))
local params = vim.lsp.util.make_range_params(0)
params.range = { start = { line = 15, character = 0 }, ["end"] = { line = 15, character = 0 } }
params.context = { diagnostics = {} }
local action = ask("textDocument/codeAction", params)[1]
action = action.edit and action or ask("codeAction/resolve", action)
vim.lsp.util.apply_workspace_edit(action.edit, "utf-16")
out("line " .. vim.api.nvim_buf_get_lines(0, 15, 16, false)[1])
vim.cmd("qa!")
"""


@needs_neovim
def test_neovim_is_served_as_the_page_says(folder):
    lua = re.search(r"```lua\n(.+?)```", PAGE, re.DOTALL)[1]
    (folder / "init.lua").write_text(lua, "utf-8")
    (folder / "session.lua").write_text(SESSION, "utf-8")
    program = folder / "bin/pidcfg"
    program.parent.mkdir()
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m pidcfg "$@"\n', "utf-8")
    program.chmod(0o755)
    found = subprocess.run(
        ["nvim", "--headless", "-u", "init.lua", "-c", "luafile session.lua"],
        cwd=folder,
        env={**os.environ, "PATH": f"{program.parent}{os.pathsep}{os.environ['PATH']}", "HOME": str(folder)},
        capture_output=True,
        text=True,
        check=True,
        timeout=400,
    )
    assert "error" not in found.stdout
    assert f"findings {len(pidcfg.check(folder / 'reactor.yaml').findings)}" in found.stdout
    assert "`V2050` = `0250`" in found.stdout
    assert re.search(r"^items [1-9]", found.stdout, re.MULTILINE)
    assert "line     bias_freeze: true  # pidcfg: ignore[DL222]" in found.stdout
    assert "exit code" not in found.stdout + found.stderr


# --- the command ------------------------------------------------------------------------------------------------------


def test_without_the_extra_one_line_says_how_to_get_it(monkeypatch):
    monkeypatch.setattr(lsp_command, "find_spec", lambda _: None)
    result = CliRunner().invoke(cli, ["lsp"])
    assert result.exit_code
    assert 'pip install "pidcfg[lsp]"' in result.output
    assert result.output.count("\n") == 1


# --- what it is made of, for other programs ---------------------------------------------------------------------------


def test_a_document_says_what_stands_at_a_place():
    doc = read_document(REACTOR.read_bytes(), "r.yaml")
    for path in (("loops", 1, "tuning", "gain"), ("loops", 0, "pv", "range", 1), ("vendor",)):
        span = doc.locate(path)
        assert doc.at(span.line, span.column) == doc.at(span.end_line, span.end_column) == (path, False, span)
        if isinstance(path[-1], str):
            key = doc.locate(path, key=True)
            assert doc.at(key.line, key.column) == (path, True, key)
    assert doc.at(1, 1) is None
    assert doc.at(999, 1) is None


def test_an_overlay_stands_before_the_disk(folder):
    path = (folder / "reactor.yaml").as_posix()
    reader = Overlay({f"{folder.as_posix()}/sub/../reactor.yaml": "vendor: click"})
    assert reader.read(path, 99) == b"vendor: click"
    other = (folder / "reactor.scenario.yaml").as_posix()
    assert reader.read(other, 99) == DISK.read(other, 99)


def test_what_holds_a_key_is_what_is_encoded():
    for path in (ROOT / "examples").glob("*/*.yaml"):
        if ".scenario." in path.name:
            continue
        checked = pidcfg.check_file(path)
        words = checked.encoding.image.words
        held = list(pidcfg.held_words(checked))
        assert len({one.path for one in held}) == len(held)
        for one in held:
            if one.raw is not None:
                number = checked.encoding.space.parse(one.address.partition(".")[0])
                assert words[number] == one.raw, (path, one)


def test_a_comment_that_ignores_goes_where_it_changes_nothing():
    doc = read_document(REACTOR.read_bytes(), "r.yaml")
    for finding in pidcfg.check(REACTOR).findings:
        edit = pidcfg.ignore_edit(doc, finding, "tried on the plant")
        assert edit is not None
    with_comment = REACTOR.read_text("utf-8").replace("bias_freeze: true", "bias_freeze: true  # windup")
    result = pidcfg.check(with_comment)
    finding = next(d for d in result.findings if d.code == "DL222")
    edit = pidcfg.ignore_edit(result.document, finding, "")
    assert (edit.span, edit.text) == (Span(16, 1, 16, 1), "    # pidcfg: ignore[DL222]\n")
    error = next(d for d in pidcfg.check(WRONG).findings if d.code == "PID029")
    assert pidcfg.ignore_edit(pidcfg.load(WRONG).document, error, "") is None, "a file that cannot be read is corrected"


def test_check_takes_what_settings_say(folder, monkeypatch):
    monkeypatch.chdir(folder)
    every = pidcfg.check(REACTOR).findings
    assert [d.code for d in pidcfg.check(REACTOR, select=["dl21", "DL222"]).findings] == [
        "DL222",
        "DL211",
        "DL211",
        "DL211",
    ]
    assert not [d for d in pidcfg.check(REACTOR, ignore=["DL2"]).findings if d.code.startswith("DL2")]
    unreadable = pidcfg.check("pidcfg: 1\nvendor: [", ignore=["PID"])
    assert not unreadable.ok, "what keeps a file from being used cannot be ignored"
    (folder / "sub").mkdir()
    CliRunner().invoke(cli, ["validate", "reactor.yaml", "--baseline", "sub/known.json", "--create-baseline"])
    result = pidcfg.check(folder / "reactor.yaml", baseline=Path("sub/known.json"))
    assert (result.findings, [d.code for d in result.known]) == ((), [d.code for d in every])
    assert pidcfg.check(REACTOR, name="other.yaml", baseline=(folder / "sub/known.json").read_bytes()).known == ()
    with pytest.raises(pidcfg.ArgumentError, match="`baseline`: 1:1: not a baseline"):
        pidcfg.check(REACTOR, baseline="{}")


def test_a_schema_is_that_of_the_command():
    for name in ("dl06", "scenario", "output-validate"):
        assert pidcfg.schema(name) == json.loads(CliRunner().invoke(cli, ["schema", name]).stdout)
