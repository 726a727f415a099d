"""Baselines: known findings are not reported, new ones never enter, and what is gone leaves."""

from __future__ import annotations

import json
import re
from collections import Counter

import pytest
from hypothesis import given
from hypothesis import strategies as st

from living_rig import GOOD, TWICE, run
from pidcfg.diagnostics import Diagnostic, Severity, Span, number_of
from pidcfg.validate.baseline import Entry, compare, enters, entry, from_text, to_text, without
from pidcfg.validate.catalog import CODE

KNOWN = "known.json"


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
    assert [(r["code"], r["file"], r["path"]) for r in rows] == [
        ("DL242", "a.yaml", "loops[A].alarms.pv.high"),
        ("DL242", "a.yaml", "loops[A].alarms.pv.low"),
        ("DL254", "a.yaml", "loops[A].alarms.hysteresis"),
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
        assert row.startswith(f"known.json:{number}:5: warning PID048: DL242 no longer occurs in a.yaml at loops[A]")
    assert found.out.count("PID048") == 2
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
    assert validate("b.yaml").out.count("PID048") == 3, "the file has gone"


def test_a_value_that_changes_is_a_new_finding(validate, tmp_path):
    validate("a.yaml", "--create-baseline")
    (tmp_path / "a.yaml").write_text(TWICE.replace("low_low: 15, low: 15", "low_low: 20, low: 15"), "utf-8")
    assert validate().code == 1


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
        ("[]", "not a baseline of version 1"),
        ('{"version": 2, "findings": []}', "version 1"),
        ('{"version": 1, "findings": [{"code": "DL242"}]}', "findings[0] must have the texts code"),
        ("[" * 100_000, "not JSON"),
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
FOUND = st.builds(
    lambda code, severity, file, message: Diagnostic(code, severity, message, file, Span(1, 1, 1, 2), ("loops", 0)),
    CODES,
    st.sampled_from(Severity),
    st.sampled_from(["a", "b"]),
    st.sampled_from(["x", "y"]),
)
ENTRIES = st.lists(
    st.builds(
        Entry,
        CODES,
        st.sampled_from(["error", "warning"]),
        st.sampled_from(["a", "b"]),
        st.just("loops[0]"),
        st.sampled_from(["x", "y"]),
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
    assert sorted([*left, *outcome.stale]) == sorted(entries)
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
    assert from_text(text) == sorted(entries, key=lambda entry: (number_of(entry.code), entry))
    assert to_text(reversed(entries)) == text
    assert [line for line in text.splitlines() if re.search(CODE, line)] == [
        line for line in text.splitlines() if line.startswith('    {"code": ')
    ], "an entry is a line"
