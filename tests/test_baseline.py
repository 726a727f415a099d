"""Baselines: known findings are not reported, new ones never enter, and what is gone leaves."""

from __future__ import annotations

import json
from collections import Counter

import pytest
from hypothesis import given
from hypothesis import strategies as st

import living_rig
from living_rig import GOOD, run
from pidcfg.text.diagnostics import Diagnostic, Severity, Span, number_of
from pidcfg.text.source import read_document
from pidcfg.validate.baseline import (
    Entry,
    compare,
    enters,
    entry,
    from_text,
    stale_finding,
    to_text,
    without,
)
from pidcfg.validate.engine import Quotes
from pidcfg.validate.rule import value_of

TWICE = living_rig.TWICE + "    bias_freeze: true\n"
KNOWN = "known.json"
ROW = (
    '{"version": 3, "findings": [{"file": "a.yaml", "code": "DL242", "severity": "error", "loop": "A", '
    '"key": "alarms.pv.low", "value": null, "quotes": null, "count": 1}]}'
)


def counts(entries):
    """A baseline with entries that stand for 600,000 findings each."""
    row = {**json.loads(ROW)["findings"][0], "count": 600_000}
    return json.dumps({"version": 3, "findings": [row] * entries})


def document(text):
    return read_document(text.encode(), "a.yaml")


@pytest.fixture
def validate(monkeypatch, capsysbinary, tmp_path):
    """``pidcfg validate --baseline known.json`` in a folder with one file that has findings."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.yaml").write_text(TWICE, "utf-8")
    return lambda *args: run(monkeypatch, capsysbinary, *(args or ["a.yaml"]), "--baseline", KNOWN)


def test_a_baseline_is_made_when_it_is_asked_for_and_then_nothing_is_reported(validate, tmp_path):
    assert validate().code == 2, "a baseline that is not there is no empty one"
    made = validate("a.yaml", "--create-baseline")
    assert (made.code, made.out) == (0, "")
    assert "known.json: 3 findings written" in made.err
    found = validate("a.yaml", "--strict")
    assert (found.code, found.out) == (0, "")
    assert "0 errors, 0 warnings, 0 infos; 3 in the baseline" in found.err
    rows = json.loads((tmp_path / KNOWN).read_text("utf-8"))["findings"]
    assert [list(row) for row in rows] == [["file", "code", "severity", "loop", "key", "value", "quotes", "count"]] * 3
    assert [tuple(row.values()) for row in rows] == [
        ("a.yaml", "DL242", "error", "A", "alarms.pv.high", "15", "15 15", 1),
        ("a.yaml", "DL242", "error", "A", "alarms.pv.low", "15", "15 15", 1),
        ("a.yaml", "DL254", "info", "A", "alarms.hysteresis", None, "1", 1),
    ]


def test_entries_stay_when_lines_move(validate, tmp_path):
    validate("a.yaml", "--create-baseline")
    (tmp_path / "a.yaml").write_text("# one\n\n# two\n" + TWICE.replace("\n", "  # x\n"), "utf-8")
    assert validate("a.yaml", "--strict").out == ""


def test_a_new_finding_is_reported_and_never_enters(validate, tmp_path):
    validate("a.yaml", "--create-baseline")
    before = (tmp_path / KNOWN).read_bytes()
    (tmp_path / "a.yaml").write_text(TWICE.replace("sample_rate: 1", "sample_rate: 1000"), "utf-8")
    for option in ((), ("--shrink-baseline",)):
        found = validate("a.yaml", *option)
        assert found.code == 1
        assert "PID101" in found.out
        assert (tmp_path / KNOWN).read_bytes() == before
    again = validate("a.yaml", "--create-baseline")
    assert again.code == 2
    assert "only shrinks" in again.err
    assert (tmp_path / KNOWN).read_bytes() == before


def test_what_no_longer_occurs_is_reported_at_its_line_and_removed_on_request(validate, tmp_path):
    validate("a.yaml", "--create-baseline")
    (tmp_path / "a.yaml").write_text(TWICE.replace("low: 15, high: 15", "low: 16, high: 30"), "utf-8")
    found = validate()
    assert found.code == 0
    assert validate("a.yaml", "--strict").code == 1
    lines = (tmp_path / KNOWN).read_text("utf-8").splitlines()
    for row in (row for row in found.out.splitlines() if "PID048" in row):
        number = int(row.split(":")[1])
        assert '"DL242"' in lines[number - 1]
        assert row.startswith(
            f"known.json:{number}:5: warning PID048: DL242 no longer occurs in a.yaml at A alarms.pv."
        )
    assert len(json.loads(validate("a.yaml", "--format", "json").out)["findings"]) == 2
    shrunk = validate("a.yaml", "--shrink-baseline")
    assert "known.json: 2 entries removed" in shrunk.err
    assert [row["code"] for row in json.loads((tmp_path / KNOWN).read_text("utf-8"))["findings"]] == ["DL254"]
    assert validate("a.yaml", "--strict").out == ""


def test_an_entry_is_not_called_gone_because_it_was_not_looked_for(validate, tmp_path):
    (tmp_path / "b.yaml").write_text(GOOD, "utf-8")
    validate("a.yaml", "--create-baseline")
    assert "PID048" not in validate("b.yaml").out, "another file was checked"
    assert "PID048" not in validate("a.yaml", "--select", "PID1,PID048").out, "other rules were chosen"
    (tmp_path / "a.yaml").write_text(TWICE.replace("gain", "gian"), "utf-8")
    assert "PID048" not in validate().out, "the rules could not run"
    (tmp_path / "a.yaml").write_text("pidcfg: [", "utf-8")
    assert "PID048" not in validate().out, "the file could not be read"
    (tmp_path / "a.yaml").unlink()
    assert validate("b.yaml", "--format", "concise").out.count("PID048") == 3, "the file has gone"


def test_a_value_that_changes_is_a_new_finding(validate, tmp_path):
    validate("a.yaml", "--create-baseline")
    (tmp_path / "a.yaml").write_text(TWICE.replace(" low: 15, high: 15", " low: 14, high: 15"), "utf-8")
    found = validate()
    assert found.code == 1
    assert "error DL242: low is 14 " in found.out
    assert "DL242 no longer occurs in a.yaml at A alarms.pv.low: 15" in found.out


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("low_low: 15, low: 15,", "low_low: 90, low: 15,", "low is 15 counts in V2014, not above low_low, 90 counts"),
        ("high: 15, high_high: 90", "high: 15, high_high: 14", "high_high is 14 counts in V2016, not above high, 15"),
    ],
)
def test_a_value_that_the_finding_is_compared_with_makes_a_new_finding(validate, tmp_path, old, new, says):
    validate("a.yaml", "--create-baseline")
    (tmp_path / "a.yaml").write_text(TWICE.replace(old, new), "utf-8")
    found = validate("a.yaml", "--strict")
    assert found.code == 1
    assert f"error DL242: {says}" in found.out


@pytest.mark.parametrize("spelling", ["15.0", "1.5e+1", '"15 "'])
def test_another_spelling_of_a_value_is_no_other_value(spelling):
    assert value_of(document(f"loops: [{{name: A, x: {spelling}}}]"), ("loops", 0, "x")) == "15"


def test_unusable_input_and_schema_errors_never_enter(validate, tmp_path):
    (tmp_path / "a.yaml").write_text(GOOD.replace("gain", "gian"), "utf-8")
    (tmp_path / "b.yaml").write_text("pidcfg: [", "utf-8")
    made = validate("a.yaml", "b.yaml", "--create-baseline")
    assert made.code == 2
    assert json.loads((tmp_path / KNOWN).read_text("utf-8"))["findings"] == []
    assert "PID020" in validate("a.yaml").out


def test_paths_are_seen_from_the_baseline(validate, tmp_path, monkeypatch, capsysbinary):
    validate("a.yaml", "--create-baseline")
    (tmp_path / "sub").mkdir()
    monkeypatch.chdir(tmp_path / "sub")
    assert run(monkeypatch, capsysbinary, "../a.yaml", "--baseline", "../known.json", "--strict").code == 0


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("{", "1:2: not JSON"),
        ("[]", "not a baseline of version 3"),
        ('{"version": 4, "findings": []}', "version 3"),
        ('{"version": true, "findings": []}', "version 3"),
        ('{"version": [], "findings": []}', "version 3"),
        ('{"version": 3, "findings": [{"code": "DL242"}]}', "key, value, quotes (value and quotes: text or null)"),
        (ROW.replace('"quotes": null', '"quotes": 3'), "text or null"),
        ('{"version": 3, "findings": 3}', "version 3"),
        ('{"version": 3, "findings": ["DL242"]}', "findings[0] must have the texts file"),
        (ROW.replace('"count": 1', '"count": 0'), "a count above 0"),
        (ROW.replace('"count": 1', '"count": true'), "a count above 0"),
        (ROW.replace('"count": 1', '"count": 1000000000000'), "a count above 0"),
        (ROW.replace('"value": null', '"value": 15'), "text or null"),
        (ROW.replace('"loop": "A"', '"loop": null'), "must have the texts"),
        ("[" * 100_000, "not JSON"),
        (counts(2), "more than 1000000 findings"),
    ],
)
def test_a_baseline_that_cannot_be_read_is_unusable_input(validate, tmp_path, text, words):
    (tmp_path / KNOWN).write_text(text, "utf-8")
    found = validate()
    assert (found.code, found.out) == (2, "")
    assert words in found.err
    assert found.err.count("\n") == 1


@pytest.mark.parametrize("option", ["--create-baseline", "--shrink-baseline"])
def test_a_baseline_needs_a_name(monkeypatch, capsysbinary, tmp_path, option):
    (tmp_path / "a.yaml").write_text(GOOD, "utf-8")
    assert "--baseline FILE" in run(monkeypatch, capsysbinary, tmp_path / "a.yaml", option).err


CODES = st.sampled_from(["PID020", "PID043", "PID054", "PID101", "DL242"])
VALUES = st.sampled_from([None, "15", "16"])
FOUND = st.builds(
    lambda code, severity, file, loop, value: Diagnostic(
        code, severity, "says something", file, Span(1, 1, 1, 2), ("loops", 0), loop, key="mode", value=value
    ),
    CODES,
    st.sampled_from(Severity),
    st.sampled_from(["a", "b"]),
    st.sampled_from(["", "A"]),
    VALUES,
)
ENTRIES = st.lists(
    st.builds(
        Entry,
        st.sampled_from(["a", "b"]),
        CODES,
        st.sampled_from(["error", "warning"]),
        st.sampled_from(["", "A"]),
        st.just("mode"),
        VALUES,
    ),
    max_size=8,
)


@given(st.lists(FOUND, max_size=8), ENTRIES, st.sets(st.sampled_from(["a", "b"])), st.booleans())
def test_a_baseline_only_shrinks_and_loses_no_finding(found, entries, checked, all_chosen):
    outcome = compare(found, lambda d: all_chosen or number_of(d.code) > "100", entries, checked, str)
    left = without(entries, outcome.stale)

    for one in set(left):
        assert left.count(one) <= entries.count(one)
    assert {e.file for e in outcome.stale} <= checked
    assert Counter([*left, *outcome.stale]) == Counter(entries)
    chosen = [d for d in found if all_chosen or number_of(d.code) > "100"]
    assert sorted(map(id, [*outcome.new, *outcome.known])) == sorted(map(id, chosen)), "new or known, each once"
    assert all(enters(d) and entry(d, str) in entries for d in outcome.known)
    there = Counter(entry(d, str) for d in chosen if enters(d))
    assert Counter(entry(d, str) for d in outcome.known) <= there & Counter(entries)
    if all_chosen:
        assert Counter(entry(d, str) for d in outcome.known) == there & Counter(entries), "each entry knows one finding"
        assert Counter(outcome.stale) <= Counter(entries) - there
    again = compare(found, lambda _: True, left, checked, str)
    assert again.stale == []


@given(ENTRIES)
def test_a_baseline_reads_back_as_it_was_written(entries):
    text = to_text(entries)
    assert Counter(from_text(text)) == Counter(entries)
    assert to_text(entries[::-1]) == text
    rows = len(set(entries))
    assert text.count("\n") == (rows + 5 if rows else 4), "an entry is a line"


@pytest.mark.parametrize("version", [1, 2])
def test_a_baseline_of_a_former_version_is_refused_with_its_cure_and_stays(validate, tmp_path, version):
    (tmp_path / KNOWN).write_text(f'{{"version": {version}, "findings": []}}', "utf-8")
    for option in ("--strict", "--shrink-baseline"):
        found = validate("a.yaml", option)
        assert found.code == 2
        told = f"a baseline of version {version}; this pidcfg reads version 3; a new one is made with --create-baseline"
        assert f"{KNOWN}:1:1: {told}" in found.err
    assert json.loads((tmp_path / KNOWN).read_text("utf-8")) == {"version": version, "findings": []}


def test_a_mapping_is_known_by_all_that_it_holds():
    one, same, other = (
        value_of(document(f"loops: [{{name: A, x: {text}}}]"), ("loops", 0, "x"))
        for text in ("{a: 1, b: [2]}", "{b: [2.0], a: 1}", "{a: 1, b: [3]}")
    )

    assert one == same != other
    assert one.startswith("sha256:")


def test_a_row_that_is_gone_is_marked_from_its_first_to_its_last_character():
    found = stale_finding("gone", "{row}", '[\n  {row},\n  {"b": 1}\n]', KNOWN)

    assert found.span == Span(2, 3, 2, len("  {row},") + 1)


def test_a_number_in_the_name_of_a_loop_is_not_quoted_and_one_beside_it_is():
    doc = document('loops: [{name: Oven 2}, {name: "7"}, {name: B}]')

    numbers = Quotes(doc)._numbers("Oven 2 at 15 is above 2.5, Oven 22 at 3; 7 at 7.5 is above 0.7 and -7, not 7.")
    assert numbers == ["15", "2.5", "22", "3", "7.5", "0.7", "-7"]
