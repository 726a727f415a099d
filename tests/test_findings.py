"""Which findings there are: one a loop, of loops that can be read, of files that cannot."""

from __future__ import annotations

import json
import re
from collections import Counter
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from ruamel.yaml import YAML

import one_loop
import pidcfg
from case_messages import FOLDER
from good_plants import good_files, text_lines
from living_rig import GOOD, run
from pidcfg.cli.formats import render_findings
from pidcfg.cli.formats.findings import (
    MAX_PLACES,
    VERBOSE_HINT,
    VERBOSE_HINT_OF_INFOS,
    VERBOSE_HINT_OF_LONG,
    Findings,
    findings_text,
)
from pidcfg.text.diagnostics import Diagnostic, Severity, Span
from pidcfg.text.document import LINE_BREAK
from pidcfg.text.signs import MAGIC
from pidcfg.text.source import read_document
from pidcfg.validate.engine import check_document
from test_rules import CASES

# --- One loop, one finding: in data each stands alone, what concerns several loops at each of them; text alone groups -

SCREEN = 15
"""Lines."""
FIRST_OF_BLOCKS = {"NX602"}
"""Rules about a ring that may go through blocks, which are no loops and cannot be named as such."""


def checked(content, name="case.yaml"):
    doc = read_document(content.encode(), name)
    return doc, check_document(doc)


@pytest.fixture(scope="module")
def cases():
    return [checked(case.read_text("utf-8"), case.name) for case in CASES]


def test_a_rule_yields_one_finding_for_each_loop_and_key(cases):
    for _, outcome in cases:
        places = Counter((d.code, d.path) for d in (*outcome.findings, *outcome.to_check) if d.code[:4] != "PID0")
        assert [place for place, count in places.items() if count > 1] == []


def test_what_concerns_several_loops_is_reported_at_each_of_them(cases):
    shared = 0
    for doc, outcome in cases:
        rows = (*outcome.findings, *outcome.to_check)
        for d in rows:
            assert not d.loop or d.loop not in d.with_loops, (doc.file, d)
            for name in d.with_loops:
                shared += 1
                other = [e for e in rows if (e.code, e.loop) == (d.code, name)]
                assert any(d.loop in e.with_loops or d.code in FIRST_OF_BLOCKS or not d.loop for e in other), (
                    doc.file,
                    d,
                )
    assert shared > 100


def test_what_concerns_no_loop_has_an_empty_one(cases):
    for doc, outcome in cases:
        names = {loop.name for loop in outcome.config.loops} if outcome.config else None
        for d in outcome.findings:
            assert isinstance(d.loop, str)
            assert (d.loop != "") == (d.path[:1] == ("loops",) and len(d.path) > 1) or names is None
            assert names is None or d.loop in {"", *names}, (doc.file, d)


SHARED = (
    GOOD
    + """\
    output: {transfer: {slot: 2, channel: 1}}
  - name: B
    sample_rate: 2
    action: direct
    tuning: {gain: 1}
    output: {transfer: {slot: 2, channel: 1}}
"""
)


def test_every_format_but_text_has_each_finding():
    doc, outcome = checked(SHARED, "a.yaml")
    findings = [d for d in outcome.findings if d.code == "DL292"]
    assert [(d.loop, d.with_loops, d.key) for d in findings] == [
        ("A", ("B",), "output.transfer"),
        ("B", ("A",), "output.transfer"),
    ]
    shown = Findings(findings, {"a.yaml": doc})
    data = json.loads(render_findings("json", shown))["findings"]
    assert [(row["loop"], row["with"], row["line"]) for row in data] == [("A", ["B"], 9), ("B", ["A"], 14)]
    results = json.loads(render_findings("sarif", shown))["runs"][0]["results"]
    assert [row["locations"][0]["physicalLocation"]["region"]["startLine"] for row in results] == [9, 14]
    assert [row["location"]["lines"]["begin"] for row in json.loads(render_findings("gitlab", shown))] == [9, 14]
    assert re.findall(r"line=(\d+)", render_findings("github", shown)) == ["9", "14"]
    assert re.findall(r"a\.yaml:(\d+):", render_findings("concise", shown)) == ["9", "14"]
    assert re.findall(r'<failure message="(\d+):', render_findings("junit", shown)) == ["9", "14"]
    assert render_findings("text", shown).count("error DL292") == 1
    assert "      = also: 14:14: slot 2, channel 1 is also the output of A [B]\n" in render_findings("text", shown)


def test_text_names_every_finding_and_quotes_every_warning_and_error(cases):
    for doc, outcome in cases:
        shown = findings_text(outcome.findings, {doc.file: doc})
        for d in outcome.findings:
            assert re.search(rf"(?:{d.file}:|\b|line ){d.span.line}\b", shown)
            assert d.loop in shown
            alike = d.message if d.with_loops or not d.loop else None
            assert d.severity is Severity.INFO or alike is None or alike in shown, d
            for detail in (d.help, d.reference):
                assert detail is None or detail in shown


def row(line, loop="", message="stands still", severity=Severity.WARNING, **more):
    return Diagnostic("DL211", severity, message, "a.yaml", Span(line, 3, line, 4), loop=loop, help="move it", **more)


def test_findings_that_say_the_same_are_named_in_a_line():
    shown = findings_text([row(2, "A", "A is off"), row(5, "B", "B is off"), row(9, "C", "C is off")], {})
    assert (
        shown
        == "a.yaml:2:3: warning DL211: A is off [A]\n      = cure: move it\n      = also: B (line 5), C (line 9)\n\n"
    )


def test_a_warning_that_says_something_else_is_quoted_and_an_info_named():
    shown = findings_text([row(2, "A", "is 3"), row(5, "B", "is 4"), row(6, "C", "is 4"), row(7, "D", "is 3")], {})
    assert shown.splitlines()[2:4] == ["      = also: D (line 7)", "      = also: 5:3: is 4 [B], and C (line 6)"]
    infos = [row(n, loop, f"is {n}", Severity.INFO) for n, loop in ((2, "A"), (5, "B"), (6, ""))]
    assert findings_text(infos, {}).splitlines()[2:3] == ["      = also: B (line 5), line 6"]


def test_a_warning_about_the_loops_own_register_or_a_name_made_of_its_own_is_said_once():
    same = [row(2, "A", "C10 of A_PV"), row(5, "B", "C50 of B_PV")]
    assert findings_text(same, {}).splitlines()[2:] == ["      = also: B (line 5)", ""]
    errors = [row(d.span.line, d.loop, d.message, Severity.ERROR) for d in same]
    assert findings_text(errors, {}).splitlines()[2:] == ["      = also: 5:3: C50 of B_PV [B]", ""]


def test_findings_of_several_files_that_say_the_same_are_one_block_below_an_error():
    rows = [row(2, "A"), replace(row(5, "B"), file="b.yaml"), replace(row(6, "C", "is 4"), file="b.yaml")]
    assert findings_text(rows, {}).splitlines()[2:4] == [
        "      = also: B (b.yaml:5)",
        "      = also: b.yaml:6:3: is 4 [C]",
    ]
    errors = [replace(d, severity=Severity.ERROR) for d in rows[:2]]
    assert findings_text(errors, {}).count("DL211") == 2


def test_an_info_of_several_loops_is_one_line_in_the_brief_text():
    infos = [row(n, f"L{n}", f"is {n}", Severity.INFO) for n in range(2, 10)]
    alone = replace(row(2, "A", severity=Severity.INFO), code="DL999")
    shown = findings_text([*infos, alone, row(3, "B")], {}, brief=True)
    loops = ", ".join(f"L{n}" for n in range(2, 10))
    assert shown.splitlines()[-2:] == [f"a.yaml:2:3: info DL211: is 2 [{loops}]", VERBOSE_HINT.rstrip()]
    assert shown.count("= cure: move it") == 2
    many = [row(n, f"L{n}", severity=Severity.INFO) for n in range(2, 20)]
    assert findings_text(many, {}, brief=True).splitlines()[0].endswith("L8, L9, 10 more]")
    assert VERBOSE_HINT not in findings_text([alone], {}, brief=True)


def test_what_fills_more_than_a_screen_is_short_but_for_errors():
    shared = [row(n, f"L{n}", severity=Severity.INFO) for n in range(2, 5)]
    single = [replace(row(n, f"L{n}", severity=Severity.INFO), code=f"DL{900 + n}") for n in range(12)]
    few = findings_text([*shared, *single[:9]], {}, brief=True)
    assert few.count("= cure: move it") == 9
    lines = findings_text([*shared, *single, row(3, "B", plc_effect="stops")], {}, brief=True).splitlines()
    assert [" info " in line for line in lines] == [False] * 4 + [True] * 13 + [False]
    assert [line for line in lines if "=" in line] == ["      = PLC: stops", "      = cure: move it"]
    assert lines[-1] == VERBOSE_HINT_OF_INFOS.rstrip()
    kinds = [replace(row(n, f"L{n}", f"is {n}", plc_effect="stops"), code=f"DL{900 + n % 12}") for n in range(24)]
    error = row(99, "E", severity=Severity.ERROR, plc_effect="stops")
    lines = findings_text([*kinds, error], {}, brief=True).splitlines()
    assert lines[:3] == ["a.yaml:99:3: error DL211: stands still [E]", "      = PLC: stops", "      = cure: move it"]
    assert lines[4:7] == [
        "a.yaml:0:3: warning DL900: is 0 [L0]",
        "      = cure: move it",
        "      = also: L12 (line 12)",
    ]
    assert lines[-1] == VERBOSE_HINT_OF_LONG.rstrip()
    assert len(lines) == 4 + 12 * 4 + 1
    assert (
        findings_text([replace(d, severity=Severity.ERROR) for d in kinds], {}, brief=True).count("= PLC: stops") == 12
    )


def test_eight_loops_with_a_word_on_each_fit_on_a_screen(monkeypatch, capsysbinary, tmp_path):
    """A line that is longer than 80 columns takes several rows."""
    file = tmp_path / "extruder.yaml"
    converted = pidcfg.convert(EXAMPLES / "dl06" / "extruder.yaml", "click")
    file.write_text(converted.text, "utf-8")
    monkeypatch.chdir(tmp_path)
    shown = run(monkeypatch, capsysbinary, file.name)
    assert shown.code == 0
    assert len({d.code for d in converted.target_findings}) == 7
    assert sum(-(-max(len(line), 1) // 80) for line in shown.out.splitlines()) <= 40
    for code in {d.code for d in converted.target_findings}:
        assert f" {code}: " in shown.out


def test_verbose_shows_what_the_brief_text_leaves_out(monkeypatch, capsysbinary, tmp_path):
    file = tmp_path / "a.yaml"
    good = GOOD + "    alarms: {pv: {low_low: 5, low: 15, high: 75, high_high: 90}}\n"  # the info DL254
    loop = good[good.index("  - name: A") :]
    file.write_text(good + loop.replace("name: A", "name: B"), "utf-8")
    brief = run(monkeypatch, capsysbinary, file).out
    whole = run(monkeypatch, capsysbinary, file, "-v").out
    assert VERBOSE_HINT.rstrip() in brief
    assert len(whole.splitlines()) > len(brief.splitlines())
    assert VERBOSE_HINT.rstrip() not in whole


@pytest.mark.parametrize("other", [{"severity": Severity.ERROR}, {"plc_effect": "stops"}, {"reference": "ch. 1"}])
def test_what_differs_in_more_than_its_words_stands_alone(other):
    assert findings_text([row(2, "A"), row(5, "B", **other)], {}).count("DL211") == 2


def test_very_many_places_are_counted():
    shown = findings_text([row(n, f"L{n}") for n in range(1, MAX_PLACES + 12)], {})
    assert f"L{MAX_PLACES + 1} (line {MAX_PLACES + 1}), 10 more (--format concise" in shown


# --- names, which everything hangs on ---------------------------------------------------------------------------------


def test_nothing_covers_two_loops_of_one_name(monkeypatch, capsysbinary, tmp_path):
    twice = SHARED.replace("name: B", "name: A").replace("channel: 1", "channel: 2", 1)
    lines = [f"{line}  # pidcfg: ignore[PID106] x" if "name:" in line else line for line in twice.split("\n")]
    file, known = tmp_path / "a.yaml", tmp_path / "known.json"
    file.write_text("\n".join(lines), "utf-8")
    (tmp_path / "pidcfg.toml").write_text("ignore = ['PID106']\n[per-file-ignores]\n'*.yaml' = ['PID1']\n", "utf-8")
    for options in ((), ("--ignore", "PID106"), ("--select", "DL"), ("--baseline", known)):
        if options[:1] == ("--baseline",):
            run(monkeypatch, capsysbinary, file, "--baseline", known, "--create-baseline")
        found = run(monkeypatch, capsysbinary, file, *options)
        assert (found.code, found.out.count("error PID106"), found.out.count("(line 10)")) == (1, 1, 1), options
    assert "PID106" not in known.read_text("utf-8")


@pytest.mark.parametrize("name", ["", "name: ''", "name:"])
def test_a_loop_without_a_name_is_an_error_that_nothing_covers(monkeypatch, capsysbinary, tmp_path, name):
    file = tmp_path / "a.yaml"
    file.write_text(GOOD.replace("  - name: A\n    ", f"  - {name}\n    " if name else "  - "), "utf-8")
    found = run(monkeypatch, capsysbinary, file, "--ignore", "PID", "--format", "json")
    assert found.code == 1
    assert {d["path"] for d in json.loads(found.out)["findings"]} == {"loops[0].name"}


# --- noise ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("vendor", "plant", "content"), good_files(), ids=lambda value: str(value)[:12])
def test_a_good_file_of_eight_loops_fits_on_a_screen(vendor, plant, content):
    lines, findings = text_lines(content)
    assert len(lines) <= SCREEN
    assert not [d for d in findings if d.severity is Severity.ERROR]
    assert len({d.loop for d in findings}) <= 9


def test_no_cure_is_nothing():
    from pidcfg.validate.catalog import find_rules

    assert [code for code, rule in find_rules().items() if rule.doc_part("Fix").lower().startswith("nothing")] == []


@pytest.mark.parametrize(("text", "told"), [("Line #4", 1), ("Line  # 4", 0), ("Line#4", 0), ("Line # pidcfg: x", 0)])
def test_a_text_that_is_cut_off_is_found_where_the_file_has_no_other_comment(text, told):
    findings = check_document(
        read_document(f"pidcfg: 1\nvendor: generic\nname: {text}\nloops: []\n".encode(), "a")
    ).findings
    assert [d.code for d in findings].count("PID019") == told


# --- A ring of masters is told at each of its loops, with the others alone --------------------------------------------


def test_each_loop_of_a_ring_is_told_with_the_others():
    case = FOLDER / "GN833.yaml"
    found = check_document(read_document(case.read_bytes(), case.name)).findings
    rings = {d.loop: sorted(d.with_loops) for d in found if d.code == "GN833"}
    assert rings == {"A": ["B", "C"], "B": ["A", "C"], "C": ["A", "B"]}


# --- A loop that cannot be read hides nothing that is wrong with the others, and makes nothing up ---------------------

EXAMPLES = Path(__file__).parents[1] / "examples"
REMARK = "PID038"


@cache
def json_of(path: Path) -> str:
    """A file as JSON."""
    return json.dumps(YAML(typ="safe", pure=True).load(path))


def plain(path: Path) -> dict[str, Any]:
    """A file's data, to be changed."""
    data: dict[str, Any] = json.loads(json_of(path))
    return data


def loops_of(path: Path) -> int:
    """How many loops a configuration has, by the dashes below its key."""
    text = path.read_text("utf-8")
    below = re.split(r"^loops:.*\n", text, flags=re.MULTILINE)[-1]
    own = re.split(r"^[a-z]", below, maxsplit=1, flags=re.MULTILINE)[0]
    return own.count("\n  - ") + 1 if "\nvendor:" in text else 0


CONFIGS = [path for path in sorted(EXAMPLES.glob("*/*.yaml")) if loops_of(path) > 1]


def findings(data: dict[str, Any]) -> tuple[pidcfg.Finding, ...]:
    """Those of a configuration in memory."""
    return pidcfg.check(Path("x.yaml"), files={"x.yaml": json.dumps(data)}).findings


def known(rows: tuple[pidcfg.Finding, ...]) -> set[tuple[str, str, str]]:
    """What identifies findings of the rules at loops."""
    return {(d.code, d.loop, d.key) for d in rows if d.loop and not d.code.startswith("PID0")}


@pytest.mark.parametrize("path", CONFIGS, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_what_is_found_beside_a_broken_loop_is_true(path: Path) -> None:
    whole = known(findings(plain(path)))
    for i in range(len(plain(path)["loops"])):
        data = plain(path)
        name = data["loops"][i]["name"]
        data["loops"][i]["nonsense"] = 1
        rows = findings(data)
        assert [d.code for d in rows if d.code == REMARK] == [REMARK]
        assert known(rows) <= {row for row in whole if row[1] != name}
        alone = {row for row in whole if row[1] != name} & without(path, name)
        assert alone <= known(rows)


def without(path: Path, name: str) -> set[tuple[str, str, str]]:
    """What is found in the file without a loop: what is gone with it waits for it."""
    data = plain(path)
    data["loops"] = [loop for loop in data["loops"] if loop["name"] != name]
    return known(findings(data))


def test_an_error_of_another_loop_is_told_at_once() -> None:
    data = plain(EXAMPLES / "dl06" / "reactor.yaml")
    data["loops"][1]["pv"]["range"] = [0, "x"]
    data["loops"][2]["tuning"]["gain"] = 120.2
    assert {(d.code, d.loop) for d in findings(data) if d.severity.label == "error"} == {
        ("PID022", "TIC-101"),
        ("PID101", "LIC-103"),
    }


def test_what_two_loops_make_together_waits() -> None:
    """The minor loop names a major loop that cannot be read: it is there all the same."""
    data = plain(EXAMPLES / "dl06" / "reactor.yaml")
    data["loops"][1]["nonsense"] = 1
    assert not [d for d in findings(data) if "cascade" in d.key]


def test_two_sound_loops_of_one_name_are_told_beside_a_broken_one() -> None:
    data = plain(EXAMPLES / "dl06" / "reactor.yaml")
    data["loops"][1]["nonsense"] = 1
    data["loops"][2]["name"] = "FIC-102"
    assert "PID106" in {d.code for d in findings(data)}


@pytest.mark.parametrize("broken", [{"loops": [{"name": "A"}]}, {"plc": {"nonsense": 1}}])
def test_nothing_is_judged_where_no_loop_stands_by_itself(broken: dict[str, Any]) -> None:
    rows = findings({**plain(EXAMPLES / "dl06" / "reactor.yaml"), **broken})
    assert {d.code for d in rows} <= {"PID020", "PID021"}


# --- Bytes and lines that are no YAML: what they are, where, and how to cure them -------------------------------------

PLANT = (
    one_loop.PLANT.replace("    action", "    # a comment\n    action")
    .replace("    tuning", "\n    tuning")
    .replace("pv: {range: [0, 400], unit: degC}", "pv:\n      range: [0, 400]\n      unit: degC")
)


def problem(data):
    (d,) = read_document(data if isinstance(data, bytes) else data.encode(), "a.yaml").problems
    return d


def test_the_plant_is_read():
    assert read_document(PLANT.encode(), "a.yaml").problems == ()


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be"])
@pytest.mark.parametrize(
    "text",
    [
        PLANT,
        PLANT.replace("degC", "\N{CYRILLIC SMALL LETTER GHE}" * 30),
        "# Печь\n" + PLANT,
        "Печь: 1\n" + PLANT,
        "pidcfg: 1",
    ],
)
def test_utf_16_is_named_with_and_without_its_mark(encoding, text):
    d = problem(text.encode(encoding))
    assert (d.code, d.message, d.help) == ("PID002", "the file is UTF-16, not UTF-8", "save the file as UTF-8")


def test_zero_bytes_in_every_place_are_no_utf_16():
    d = problem(b"\0" * 40)
    assert (d.code, d.message) == ("PID003", "control character U+0000")


def test_a_zero_byte_alone_is_a_control_character():
    d = problem(PLANT.replace("degC", "\0").encode())
    assert (d.code, d.message, d.span.line) == ("PID003", "control character U+0000", 13)


@pytest.mark.parametrize(("begins", "kind", "cure"), MAGIC)
def test_other_kinds_of_file_are_named(begins, kind, cure):
    d = problem(begins + b"\x00\x01 rest")
    assert (d.code, d.message, d.help) == ("PID002", f"the file is {kind}, not text", cure)


@pytest.mark.parametrize(
    ("before", "after", "place", "message", "cure"),
    [
        (
            "    tuning",
            "   tuning",
            (10, 4),
            "'tuning' begins in column 4, between 'loops' (line 4, column 1) and 'action' (line 8, column 5)",
            "line it up with one of them",
        ),
        (
            "    tuning",
            "     tuning",
            (10, 6),
            "'tuning' begins in column 6, 'action' of line 8 in column 5",
            "line them up: take 1 space away here, or move the other",
        ),
        (
            "  - name",
            " - name",
            (6, 5),
            "'sample_rate' begins in column 5, 'name' of line 5 in column 4",
            "line them up: take 1 space away here, or move the other",
        ),
        (
            "      unit",
            "     unit",
            (13, 6),
            "'unit' begins in column 6, between 'pv' (line 11, column 5) and 'range' (line 12, column 7)",
            "line it up with one of them",
        ),
        (
            "      unit",
            "        unit",
            (13, 9),
            "'unit' begins in column 9, 'range' of line 12 in column 7",
            "line them up: take 2 spaces away here, or move the other",
        ),
        (
            "vendor",
            " vendor",
            (2, 2),
            "'vendor' begins in column 2, 'pidcfg' of line 1 in column 1",
            "line them up: take 1 space away here, or move the other",
        ),
        (
            "    tuning",
            "\N{NO-BREAK SPACE}   tuning",
            (10, 1),
            "U+00A0, a no-break space, stands where a space belongs",
            "replace it with a space",
        ),
        (
            "gain: 2.5",
            "gain:\N{NO-BREAK SPACE}2.5",
            (10, 19),
            "U+00A0, a no-break space, stands where a space belongs",
            "replace it with a space",
        ),
        (
            "sample_rate: 2",
            "sample_rate:\N{ZERO WIDTH SPACE}2",
            (6, 17),
            "U+200B, a zero width space, stands where a space belongs",
            "replace it with a space",
        ),
        (
            "a comment",
            "a\N{NO-BREAK SPACE}comment\n    : x",
            (8, 5),
            "did not find expected key",
            "check the indentation",
        ),
    ],
)
def test_lines_that_the_parser_does_not_understand(before, after, place, message, cure):
    assert PLANT.count(before) == 1
    d = problem(PLANT.replace(before, after))
    assert d.code == "PID001"
    assert (d.message, (d.span.line, d.span.column)) == (f"not YAML: {message}", place)
    assert cure is None or d.help.startswith(cure)


@pytest.mark.parametrize("line", range(5, 15))
@pytest.mark.parametrize("spaces", [-2, -1, 1, 2])
def test_no_line_that_is_moved_is_told_to_stand_where_it_stood_wrong(line, spaces):
    """Every line of the loop moved alone: where it is refused for its column, the cure brings it back."""
    lines = PLANT.splitlines()
    text = lines[line - 1]
    moved = " " * (len(text) - len(text.lstrip()) + spaces) + text.lstrip()
    problems = read_document("\n".join([*lines[: line - 1], moved, *lines[line:], ""]).encode(), "a.yaml").problems
    if problems and "column" in problems[0].message and problems[0].span.line == line:
        columns = [int(number) for number in re.findall(r"column (\d+)", problems[0].message)[1:]]
        assert len(text) - len(text.lstrip("- ")) + 1 in columns


SIGNS = "{}[]:,;=-'\"#&*!%@ \n\t\N{NO-BREAK SPACE}\N{FULLWIDTH COLON}\N{LEFT DOUBLE QUOTATION MARK}x"


@given(st.lists(st.tuples(st.integers(0, len(PLANT)), st.integers(0, 3), st.sampled_from([*SIGNS, ""])), max_size=3))
def test_a_text_that_is_spoilt_anywhere_has_a_place_inside_of_it(places):
    text = PLANT
    for at, length, sign in places:
        text = text[:at] + sign + text[at + length :]
    lines = LINE_BREAK.split(text)
    for d in read_document(text.encode(), "a.yaml").problems:
        assert 1 <= d.span.line <= len(lines)
        assert 1 <= d.span.column <= len(lines[d.span.line - 1]) + 1
        assert d.message


@pytest.mark.parametrize("text", ["pidcfg: [", "pidcfg: {", 'pidcfg: "', "pidcfg: [1, ", "- {a: 'b", "{"])
def test_what_is_open_at_the_end_of_a_file_without_a_line_end(text):
    d = problem(text)
    assert d.code == "PID001"
    assert d.help


def test_a_key_with_an_odd_blank_is_named():
    from pidcfg.validate.engine import check_document

    text = PLANT.replace("2.5, reset", "2.5,\N{NO-BREAK SPACE}reset")
    (d,) = (d for d in check_document(read_document(text.encode(), "a.yaml")).findings if d.code == "PID020")
    assert d.message == r"unknown key '\xa0reset': U+00A0 in it is a no-break space, not a space"
    assert d.help == "did you mean reset?"


# --- What is said of a file that is not as the schema wants it, and how to mend it: each kind of fault once -----------


HEAD = "pidcfg: 1\nvendor: generic\n"
LOOP = """\
loops:
  - name: A
    output_raises_pv: true
    sample_time: 1
    tuning: {gain: 1}
    pv: {range: [0, 1]}
    output: {range: [0, 1]}
"""
TUNING = "gain, integral_time, derivative_time, proportional, derivative_on, derivative_filter"
WORDS = [
    # a text of the file, what stands in its place, line and column, message, cure
    ("pidcfg: 1\n", "", (1, 1), "the format version is missing", "write 'pidcfg: 1'"),
    ("pidcfg: 1", "pidcfg: 2", (1, 9), "the format version '2' is not one that this pidcfg reads", "write 'pidcfg: 1'"),
    (LOOP, "", (1, 1), "loops is missing", "add loops: The loops"),
    (LOOP, "loops: 5\n", (3, 8), "loops must be a list, not '5'", "begin each item of loops with a dash: '- name: …'"),
    (
        LOOP,
        "loops: {A: {name: A}}\n",
        (3, 8),
        "loops must be a list, not a mapping",
        "begin each item of loops with a dash: '- name: A'",
    ),
    (
        LOOP,
        "loops: {name: A}\n",
        (3, 8),
        "loops must be a list, not a mapping",
        "begin each item of loops with a dash: '- name: …'",
    ),
    (
        "{gain: 1}",
        "5",
        (7, 13),
        "tuning must be a mapping of keys, not '5'",
        f"write 'tuning: {{gain: …}}'; known keys here: {TUNING}",
    ),
    (
        "{gain: 1}",
        "[1]",
        (7, 13),
        "tuning must be a mapping of keys, not a list",
        f"write 'tuning: {{gain: …}}'; known keys here: {TUNING}",
    ),
    ("gain: 1", "gain: {x: 1}", (7, 20), "gain: a mapping stands where a number is wanted", None),
    ("gain: 1", "gain: 1, zzz: 1", (7, 23), "unknown key 'zzz'", f"known keys here: {TUNING}"),
    ("gain: 1", "gain: 1, integral: 1", (7, 23), "unknown key 'integral'", "did you mean integral_time?"),
    ("gain: 1", "", (7, 5), "tuning.gain is missing", "add gain: Output units per PV unit"),
    (
        "    sample_time: 1\n",
        "",
        (4, 5),
        "sample_time is missing",
        "add sample_time: Time between two calculations in s",
    ),
    (
        "raises_pv: true",
        "raises_pv: maybe",
        (5, 23),
        "output_raises_pv: 'maybe' is not true or false",
        "write true or false; true: the PV rises when the output rises (heating); false: it falls (cooling)",
    ),
    (
        "    tuning",
        "    mode: atuo\n    tuning",
        (7, 11),
        "mode is 'atuo', not one of manual, auto, cascade",
        "did you mean auto?",
    ),
    (
        "    tuning",
        "    mode: xyz\n    tuning",
        (7, 11),
        "mode is 'xyz', not one of manual, auto, cascade",
        "The mode that the loop is meant to run in",
    ),
    (
        "pv: {range: [0, 1]}",
        "pv: {range: 3}",
        (8, 17),
        "range: a range is wanted: a list of two values",
        "write [low, high]",
    ),
    (
        "pv: {range: [0, 1]}",
        "pv: {range: [1]}",
        (8, 17),
        "range: a range is wanted: a list of two values, not of 1",
        "write [low, high]",
    ),
    (
        "pv: {range: [0, 1]}",
        "pv: {range: [1, 2, 3]}",
        (8, 17),
        "range: a range is wanted: a list of two values, not of 3",
        "write [low, high]; if a comma was to be a decimal sign: that is a point",
    ),
    (
        "    output_raises_pv",
        "  - output_raises_pv",
        (5, 5),
        "name is missing",
        "add name: Name of the loop, unique in the file; if the keys belong to what stands above, take the dash away",
    ),
    ("    output: ", "    gain: 2\n    output: ", (9, 5), "unknown key 'gain'", "did you mean tuning: {gain: …}?"),
]


@pytest.mark.parametrize(("text", "instead", "place", "message", "cure"), WORDS, ids=[row[3] for row in WORDS])
def test_a_fault_is_told_with_its_place_and_its_cure(text, instead, place, message, cure):
    assert text in HEAD + LOOP
    found = check_document(read_document((HEAD + LOOP).replace(text, instead, 1).encode(), "a.yaml")).findings
    assert (place, message, cure) in [((d.span.line, d.span.column), d.message, d.help) for d in found]


def test_the_file_itself_has_no_fault():
    assert [
        d
        for d in check_document(read_document((HEAD + LOOP).encode(), "a.yaml")).findings
        if d.severity.label != "info" and d.code < "PID1"
    ] == []
