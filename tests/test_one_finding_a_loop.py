"""One loop, one finding: in data each stands alone, what concerns several loops at each of them; text alone groups."""

from __future__ import annotations

import json
import re
from collections import Counter

import pytest

from good_plants import good_files, text_lines
from living_rig import GOOD, run
from pidcfg.cli.formats import render
from pidcfg.cli.formats.findings import MOST_PLACES, Findings, text
from pidcfg.text.diagnostics import Diagnostic, Severity, Span
from pidcfg.text.source import read_document
from pidcfg.validate.engine import check_document
from test_rules import CASES

SCREEN = 25
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
    data = json.loads(render("json", shown))["findings"]
    assert [(row["loop"], row["with"], row["line"]) for row in data] == [("A", ["B"], 9), ("B", ["A"], 14)]
    results = json.loads(render("sarif", shown))["runs"][0]["results"]
    assert [row["locations"][0]["physicalLocation"]["region"]["startLine"] for row in results] == [9, 14]
    assert [row["location"]["lines"]["begin"] for row in json.loads(render("gitlab", shown))] == [9, 14]
    assert re.findall(r"line=(\d+)", render("github", shown)) == ["9", "14"]
    assert re.findall(r"a\.yaml:(\d+):", render("concise", shown)) == ["9", "14"]
    assert re.findall(r'<failure message="(\d+):', render("junit", shown)) == ["9", "14"]
    assert render("text", shown).count("error DL292") == 1
    assert "      = also: 14:14: slot 2, channel 1 is also the output of A [B]\n" in render("text", shown)


def test_text_names_every_finding_and_quotes_every_warning_and_error(cases):
    for doc, outcome in cases:
        shown = text(outcome.findings, {doc.file: doc})
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
    shown = text([row(2, "A", "A is off"), row(5, "B", "B is off"), row(9, "C", "C is off")], {})
    assert (
        shown
        == "a.yaml:2:3: warning DL211: A is off [A]\n      = cure: move it\n      = also: B (line 5), C (line 9)\n\n"
    )


def test_a_warning_that_says_something_else_is_quoted_and_an_info_named():
    shown = text([row(2, "A", "is 3"), row(5, "B", "is 4"), row(6, "C", "is 4"), row(7, "D", "is 3")], {})
    assert shown.splitlines()[2:4] == ["      = also: D (line 7)", "      = also: 5:3: is 4 [B], and C (line 6)"]
    infos = [row(n, loop, f"is {n}", Severity.INFO) for n, loop in ((2, "A"), (5, "B"), (6, ""))]
    assert text(infos, {}).splitlines()[2:3] == ["      = also: B (line 5), line 6"]


@pytest.mark.parametrize("other", [{"severity": Severity.ERROR}, {"plc_effect": "stops"}, {"reference": "ch. 1"}])
def test_what_differs_in_more_than_its_words_stands_alone(other):
    assert text([row(2, "A"), row(5, "B", **other)], {}).count("DL211") == 2


def test_very_many_places_are_counted():
    shown = text([row(n, f"L{n}") for n in range(1, MOST_PLACES + 12)], {})
    assert f"L{MOST_PLACES + 1} (line {MOST_PLACES + 1}), 10 more (--format concise" in shown


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
    from pidcfg.validate.catalog import rules

    assert [code for code, rule in rules().items() if rule.part("Fix").lower().startswith("nothing")] == []
