"""Comments that ignore, and baselines."""

from __future__ import annotations

import json
from collections import Counter

import pytest
from hypothesis import given
from hypothesis import strategies as st

import living_rig
from living_rig import GOOD, TWICE, run
from pidcfg.text.diagnostics import Diagnostic, Severity, Span, number_of
from pidcfg.text.source import comments_in, read_document
from pidcfg.validate.baseline import (
    Entry,
    baseline_text,
    compare,
    entry_of,
    may_be_in_baseline,
    parse_baseline,
    remove_entries,
    stale_finding,
    suppress,
)
from pidcfg.validate.catalog import find_rules
from pidcfg.validate.engine import QuotedNumbers, check_document
from pidcfg.validate.rule import IGNORE_RULES, value_of

# --- Baselines: known findings are not reported, new ones never enter, and what is gone leaves ------------------------

BASELINE_TWICE = living_rig.TWICE + "    bias_freeze: true\n"
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
    (tmp_path / "a.yaml").write_text(BASELINE_TWICE, "utf-8")
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
    (tmp_path / "a.yaml").write_text("# one\n\n# two\n" + BASELINE_TWICE.replace("\n", "  # x\n"), "utf-8")
    assert validate("a.yaml", "--strict").out == ""


def test_a_new_finding_is_reported_and_never_enters(validate, tmp_path):
    validate("a.yaml", "--create-baseline")
    before = (tmp_path / KNOWN).read_bytes()
    (tmp_path / "a.yaml").write_text(BASELINE_TWICE.replace("sample_rate: 1", "sample_rate: 1000"), "utf-8")
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
    (tmp_path / "a.yaml").write_text(BASELINE_TWICE.replace("low: 15, high: 15", "low: 16, high: 30"), "utf-8")
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
    (tmp_path / "a.yaml").write_text(BASELINE_TWICE.replace("gain", "gian"), "utf-8")
    assert "PID048" not in validate().out, "the rules could not run"
    (tmp_path / "a.yaml").write_text("pidcfg: [", "utf-8")
    assert "PID048" not in validate().out, "the file could not be read"
    (tmp_path / "a.yaml").unlink()
    assert validate("b.yaml", "--format", "concise").out.count("PID048") == 3, "the file has gone"


def test_a_value_that_changes_is_a_new_finding(validate, tmp_path):
    validate("a.yaml", "--create-baseline")
    (tmp_path / "a.yaml").write_text(BASELINE_TWICE.replace(" low: 15, high: 15", " low: 14, high: 15"), "utf-8")
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
    (tmp_path / "a.yaml").write_text(BASELINE_TWICE.replace(old, new), "utf-8")
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
    left = remove_entries(entries, outcome.stale)

    for one in set(left):
        assert left.count(one) <= entries.count(one)
    assert {e.file for e in outcome.stale} <= checked
    assert Counter([*left, *outcome.stale]) == Counter(entries)
    chosen = [d for d in found if all_chosen or number_of(d.code) > "100"]
    assert sorted(map(id, [*outcome.new, *outcome.known])) == sorted(map(id, chosen)), "new or known, each once"
    assert all(may_be_in_baseline(d) and entry_of(d, str) in entries for d in outcome.known)
    there = Counter(entry_of(d, str) for d in chosen if may_be_in_baseline(d))
    assert Counter(entry_of(d, str) for d in outcome.known) <= there & Counter(entries)
    if all_chosen:
        assert Counter(entry_of(d, str) for d in outcome.known) == there & Counter(entries), (
            "each entry knows one finding"
        )
        assert Counter(outcome.stale) <= Counter(entries) - there
    again = compare(found, lambda _: True, left, checked, str)
    assert again.stale == []


@pytest.mark.parametrize(("found", "outcome"), [(1, (0, 1, 2)), (2, (0, 2, 1)), (3, (0, 3, 0)), (4, (1, 3, 0))])
def test_each_of_three_equal_entries_knows_one_finding(found, outcome):
    finding = Diagnostic("DL242", Severity.ERROR, "says something", "a", Span(1, 1, 1, 2), ("loops", 0), "A")
    compared = compare([finding] * found, lambda _: True, [entry_of(finding, str)] * 3, {"a"}, str)
    assert (len(compared.new), len(compared.known), len(compared.stale)) == outcome


@pytest.mark.parametrize("field", Entry._fields)
def test_entries_that_differ_in_one_field_are_in_one_order(field):
    first = Entry("a.yaml", "DL242", "error", "A", "loops.0.mode", "auto", "manual")
    other = first._replace(**{field: "DL243" if field == "code" else "b"})
    assert baseline_text([first, other]) == baseline_text([other, first])


@given(ENTRIES)
def test_a_baseline_reads_back_as_it_was_written(entries):
    text = baseline_text(entries)
    assert Counter(parse_baseline(text)) == Counter(entries)
    assert baseline_text(entries[::-1]) == text
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

    text = "Oven 2 at 15 is above 2.5, Oven 22 at 3; 7 at 7.5 is above 0.7 and -7, not 7."
    numbers = QuotedNumbers(doc)._find_numbers(text)
    assert numbers == ["15", "2.5", "22", "3", "7.5", "0.7", "-7"]


# --- Comments that ignore findings: which are comments at all, what they do, and what is said of them -----------------

ALARMS = "    alarms: {pv: {low_low: 15, low: 15, high: 15, high_high: 90}}"


def outcome(text):
    doc = read_document(text.encode(), "case.yaml")
    return suppress(list(check_document(doc).findings), doc)


def left(text):
    return [(d.span.line, d.code) for d in outcome(text).findings]


def behind(comment, text=TWICE):
    """The comment at the end of the line with the alarms."""
    assert ALARMS in text
    return text.replace(ALARMS, f"{ALARMS}  {comment}")


# --- what is a comment ------------------------------------------------------------------------------------------------

WORDS = st.text("ab#:' \t°é\"-", min_size=1, max_size=12)
COMMENT = st.one_of(st.none(), st.text("x# '\":|\té", max_size=10).map(lambda text: f"# {text}"))


def single(text):
    return "'" + text.replace("'", "''").replace("\t", " ") + "'"


def double(text):
    return '"' + text.replace('"', '\\"') + '"'


@st.composite
def yaml_texts(draw):
    """A text with scalars of all styles that hold ``#``, and the comments that it really has."""
    lines, expected = [], []

    def put(line, comment=None, *, alone=False):
        if comment is not None:
            line += comment if alone else f" {comment}"
            expected.append((len(lines) + 1, comment, alone))
        lines.append(line)

    for i in range(draw(st.integers(1, 6))):
        kind, text, comment = draw(st.sampled_from("dsbfma")), draw(WORDS), draw(COMMENT)
        if kind == "d":
            put(f"k{i}: {double(text)}", comment)
        elif kind == "s":
            put(f"{single(f'k{i}')}: {single(text)}", comment)
        elif kind == "b":
            put(f"k{i}: {draw(st.sampled_from('|>'))}{draw(st.sampled_from(['', '-', '+', '2']))}", comment)
            lines.extend([f"  # {text.strip()}"] * draw(st.integers(1, 3)))
        elif kind == "f":
            put(f"k{i}: [{double(text)}, 1,", comment)
            put(f"  a#b, {single(text)}]", draw(COMMENT))
        elif kind == "m":
            lines.append(f'k{i}: "a')
            put('  # b"', comment)
        else:
            below_text = lines and lines[-1].startswith("  #")  # there an indented comment is text
            put("" if below_text else draw(st.sampled_from(["", "  "])), comment or "#", alone=True)
            put(f"k{i}: x#y", draw(COMMENT))
    return lines, expected


@given(yaml_texts(), st.sampled_from(["\n", "\r\n"]), st.booleans())
def test_a_hash_inside_a_value_is_no_comment(made, end, last):
    lines, expected = made
    text = end.join(lines) + (end if last else "")
    found = [(c.line, c.text, c.is_alone) for c in comments_in(text)]
    assert found == expected
    for comment in comments_in(text):
        assert lines[comment.line - 1][comment.column - 1 :] == comment.text


# --- what an ignore does ----------------------------------------------------------------------------------------------


def test_a_comment_ignores_the_codes_it_names_on_its_line_and_no_others():
    assert left(TWICE) == [(9, "DL254"), (9, "DL242"), (9, "DL242")]
    found = outcome(behind("# pidcfg: ignore[DL242] agreed with the plant on 3 May"))
    assert [d.code for d in found.findings] == ["DL254"]
    assert [(i.finding.code, i.reason) for i in found.ignored] == [("DL242", "agreed with the plant on 3 May")] * 2


@pytest.mark.parametrize(
    "form",
    [
        "# pidcfg: ignore[DL242, DL254] why",
        "#pidcfg:ignore[DL242,DL254] why",
        "# PIDCFG: Ignore [dl242 , DL254]why",
        "# pidcfg: ignore[DL242,DL254] why # later",
    ],
)
def test_spellings(form):
    assert left(behind(form)) == []
    assert {i.reason for i in outcome(behind(form)).ignored} == {"why"}


def test_a_comment_on_a_line_of_its_own_speaks_of_the_next_line_with_content():
    own = "    # pidcfg: ignore[DL242] why\n\n    # another\n    # pidcfg: ignore[DL254] why\n"
    assert left(TWICE.replace(ALARMS, own + ALARMS)) == []
    assert (10, "DL242") in left(
        TWICE.replace(ALARMS, ALARMS.replace("alarms", "# pidcfg: ignore[DL254] x\n    alarms"))
    )


def test_the_text_of_a_value_ignores_nothing():
    text = TWICE.replace("name: A", 'name: A\n    description: "# pidcfg: ignore[DL242] why"').replace(
        "alarms: {", "alarms: {# pidcfg: ignore[DL242] why\n      "
    )
    assert [code for _, code in left(text)].count("DL242") == 2


def test_windows_line_ends_and_a_byte_order_mark():
    doc = read_document(
        b"\xef\xbb\xbf" + behind("# pidcfg: ignore[DL242, DL254] why").replace("\n", "\r\n").encode(), "x"
    )
    assert suppress(list(check_document(doc).findings), doc).findings == []


def test_an_ignore_before_another_comment_is_not_edited():
    found = outcome(behind("# pidcfg: ignore[DL243] why # heating")).findings
    assert [d.edits for d in found if d.code == "PID043"] == [()]


@pytest.mark.parametrize(
    ("comment", "code", "words"),
    [
        ("# pidcfg: ignore[DL242, DL254, DL243] why", "PID043", "DL243: no such finding on this line"),
        ("# pidcfg: ignore[DL242, DL254, PID999] why", "PID044", "no rule is called 'PID999'"),
        ("# pidcfg: ignore[DL242, DL254, DL2] why", "PID044", "DL2 is only the beginning of a code"),
        ("# pidcfg: ignore[DL242, DL254, high] why", "PID044", "no rule is called 'HIGH'"),
        ("# pidcfg: ignore[DL242, DL254]", "PID046", "no reason"),
        ("# pidcfg: ignore[DL242, DL254, PID020] why", "PID047", "PID020 (unknown-key) cannot be ignored"),
    ],
)
def test_what_is_wrong_with_an_ignore_is_said_at_its_place(comment, code, words):
    (found,) = outcome(behind(comment)).findings
    assert (found.code, found.severity, found.span.line) == (code, Severity.WARNING, 9)
    assert words in found.message
    assert behind(comment).splitlines()[8][found.span.column - 1 :].startswith("# pidcfg: ignore")


@pytest.mark.parametrize(
    "comment",
    [
        "# pidcfg: ignore",
        "# pidcfg: ignore DL242 why",
        "# pidcfg: ignore[] why",
        "# pidcfg: ignore[DL242 why",
        "# pidcfg: ingore[DL242] why",
    ],
)
def test_what_cannot_be_read_ignores_nothing_and_is_reported(comment):
    codes = [code for _, code in left(behind(comment))]
    assert codes.count("DL242") == 2
    assert codes.count("PID045") == 1


def test_prose_about_pidcfg_is_left_alone():
    assert left(GOOD + "# pidcfg: see the manual [page 3]\n# pidcfg: 1\n") == []


def test_errors_of_text_and_schema_stay_and_hide_that_others_are_unused():
    text = GOOD.replace("sample_rate: 1", "sample_rate: x  # pidcfg: ignore[PID022] why")
    text = text.replace("action: direct", "action: direct  # pidcfg: ignore[DL242] why")
    assert sorted(left(text)) == [(6, "PID022"), (6, "PID047")], "rules have not run: nothing can be called unused"


def test_a_text_that_can_be_read_in_two_ways_is_reported_whole():
    text = behind("# pidcfg: ignore[DL242, DL254] why") + "vendor: dl06  # pidcfg: ignore[PID004] why\n"
    assert sorted(code for _, code in left(text)) == ["DL242", "DL242", "DL254", "PID004"]
    assert outcome(text).ignored == []


def test_each_remark_about_an_ignore_has_a_page_and_is_a_warning():
    assert {rule.code for rule in IGNORE_RULES} <= set(find_rules())
    assert {rule.severity for rule in IGNORE_RULES} == {Severity.WARNING}


# --- the command ------------------------------------------------------------------------------------------------------


def test_ignored_findings_do_not_count_and_are_counted(tmp_path, monkeypatch, capsysbinary):
    file = tmp_path / "a.yaml"
    file.write_text(behind("# pidcfg: ignore[DL242, DL254] why"), "utf-8")
    found = run(monkeypatch, capsysbinary, file, "--strict")
    assert (found.code, found.out) == (0, "")
    assert "1 file checked: 0 errors, 0 warnings, 0 infos; 3 ignored" in found.err


def test_a_selection_does_not_make_an_ignore_unused(tmp_path, monkeypatch, capsysbinary):
    file = tmp_path / "a.yaml"
    file.write_text(behind("# pidcfg: ignore[DL242, DL254] why"), "utf-8")
    found = run(monkeypatch, capsysbinary, file, "--strict", "--select", "PID1,PID043")
    assert (found.code, found.out) == (0, "")


def test_an_ignored_error_still_keeps_encode_from_writing(tmp_path, monkeypatch, capsysbinary):
    file = tmp_path / "a.yaml"
    file.write_text(behind("# pidcfg: ignore[DL242, DL254] why"), "utf-8")
    monkeypatch.setattr("sys.argv", ["pidcfg", "encode", str(file)])
    from pidcfg.cli.main import main

    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 1
    captured = capsysbinary.readouterr()
    assert captured.out == b""
    assert b"DL242" in captured.err


def test_warnings_of_ignores_can_be_left_out_by_option(tmp_path, monkeypatch, capsysbinary):
    file = tmp_path / "a.yaml"
    file.write_text(behind("# pidcfg: ignore[DL242, DL254]"), "utf-8")
    assert run(monkeypatch, capsysbinary, file, "--strict").code == 1
    assert run(monkeypatch, capsysbinary, file, "--strict", "--ignore", "PID046").code == 0


# --- comments that only look as if they ignored something -------------------------------------------------------------


@pytest.mark.parametrize(
    "line",
    [
        "    # alarms: {pv: {low: 15}}  # pidcfg: ignore[DL242, DL254] spare until March",
        "    # note: do not write # pidcfg: ignore[DL242, DL254] here",
        "    ## pidcfg: ignore[DL242, DL254] why",
    ],
)
def test_a_line_that_was_commented_out_and_prose_ignore_nothing(line):
    found = outcome(TWICE.replace(ALARMS, f"{line}\n{ALARMS}"))
    assert found.ignored == []
    assert [d.code for d in found.findings] == ["DL254", "DL242", "DL242"]


def test_an_ignore_behind_another_comment_is_reported_and_ignores_nothing():
    found = outcome(behind("# heater 2 # pidcfg: ignore[DL242, DL254] why"))
    assert found.ignored == []
    (said,) = (d for d in found.findings if d.code == "PID045")
    assert "begins its comment" in said.message
    two = outcome(behind("# pidcfg: ignore[DL242] why # pidcfg: ignore[DL254] why"))
    assert {d.code for d in two.findings} == {"DL254", "PID045"}


SHARED = TWICE.replace("alarms: {", "alarms: &al {") + (
    "  - name: B\n    sample_rate: 1\n    action: direct\n    tuning: {gain: 1, reset: 10}\n    alarms: *al\n"
)


@pytest.mark.parametrize("bare", [False, True])
def test_the_comment_of_an_anchor_does_not_speak_for_its_aliases(bare):
    def judged(text):
        doc = read_document(text.encode(), "case.yaml")
        found = list(check_document(doc).findings)
        return suppress(found, doc.without_data() if bare else doc)

    text = SHARED.replace("90}}", "90}}  # pidcfg: ignore[DL242, DL254] A is a spare")
    found = judged(text)
    assert {i.finding.loop for i in found.ignored} == {"A"}
    assert {(d.loop, d.code) for d in found.findings} == {("B", "DL242"), ("B", "DL254")}
    both = judged(text.replace("*al", "*al  # pidcfg: ignore[DL242, DL254] B is a spare too"))
    assert both.findings == []
    assert {(i.finding.loop, i.reason) for i in both.ignored} == {("A", "A is a spare"), ("B", "B is a spare too")}


def test_a_shared_value_in_a_list_is_not_ignored_at_its_anchor():
    text = TWICE.replace("  - name: A", "  - &a\n    name: A").replace("90}}", "90}}  # pidcfg: ignore[DL242] x")
    doc = read_document((text + "  - *a\n").encode(), "case.yaml")
    found = [d for d in check_document(doc).findings if d.code == "DL242"]
    assert {i.finding.path[1] for i in suppress(found, doc).ignored} == {0}
    assert {d.path[1] for d in suppress(found, doc).findings if d.code == "DL242"} <= {1}
