"""Comments that ignore findings: which are comments at all, what they do, and what is said of them."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from living_rig import GOOD, TWICE, run
from pidcfg.text.diagnostics import Severity
from pidcfg.text.source import comments_in, read_document
from pidcfg.validate.baseline import suppress
from pidcfg.validate.catalog import rules
from pidcfg.validate.engine import check_document
from pidcfg.validate.rule import SUPPRESSION

ALARMS = "    alarms: {pv: {low_low: 15, low: 15, high: 15, high_high: 90}}"


def outcome(text):
    doc = read_document(text.encode(), "case.yaml")
    return suppress(list(check_document(doc).findings), doc)


def left(text):
    return [(d.span.line, d.code) for d in outcome(text).kept]


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
    found = [(c.line, c.text, c.alone) for c in comments_in(text)]
    assert found == expected
    for comment in comments_in(text):
        assert lines[comment.line - 1][comment.column - 1 :] == comment.text


# --- what an ignore does ----------------------------------------------------------------------------------------------


def test_a_comment_ignores_the_codes_it_names_on_its_line_and_no_others():
    assert left(TWICE) == [(9, "DL254"), (9, "DL242"), (9, "DL242")]
    found = outcome(behind("# pidcfg: ignore[DL242] agreed with the plant on 3 May"))
    assert [d.code for d in found.kept] == ["DL254"]
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
    assert suppress(list(check_document(doc).findings), doc).kept == []


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
    (found,) = outcome(behind(comment)).kept
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
    assert {rule.code for rule in SUPPRESSION} <= set(rules())
    assert {rule.severity for rule in SUPPRESSION} == {Severity.WARNING}


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
    assert [d.code for d in found.kept] == ["DL254", "DL242", "DL242"]


def test_an_ignore_behind_another_comment_is_reported_and_ignores_nothing():
    found = outcome(behind("# heater 2 # pidcfg: ignore[DL242, DL254] why"))
    assert found.ignored == []
    (said,) = (d for d in found.kept if d.code == "PID045")
    assert "begins its comment" in said.message
    two = outcome(behind("# pidcfg: ignore[DL242] why # pidcfg: ignore[DL254] why"))
    assert {d.code for d in two.kept} == {"DL254", "PID045"}


SHARED = TWICE.replace("alarms: {", "alarms: &al {") + (
    "  - name: B\n    sample_rate: 1\n    action: direct\n    tuning: {gain: 1, reset: 10}\n    alarms: *al\n"
)


@pytest.mark.parametrize("bare", [False, True])
def test_the_comment_of_an_anchor_does_not_speak_for_its_aliases(bare):
    def judged(text):
        doc = read_document(text.encode(), "case.yaml")
        found = list(check_document(doc).findings)
        return suppress(found, doc.bare() if bare else doc)

    text = SHARED.replace("90}}", "90}}  # pidcfg: ignore[DL242, DL254] A is a spare")
    found = judged(text)
    assert {i.finding.loop for i in found.ignored} == {"A"}
    assert {(d.loop, d.code) for d in found.kept} == {("B", "DL242"), ("B", "DL254")}
    both = judged(text.replace("*al", "*al  # pidcfg: ignore[DL242, DL254] B is a spare too"))
    assert both.kept == []
    assert {(i.finding.loop, i.reason) for i in both.ignored} == {("A", "A is a spare"), ("B", "B is a spare too")}


def test_a_shared_value_in_a_list_is_not_ignored_at_its_anchor():
    text = TWICE.replace("  - name: A", "  - &a\n    name: A").replace("90}}", "90}}  # pidcfg: ignore[DL242] x")
    doc = read_document((text + "  - *a\n").encode(), "case.yaml")
    found = [d for d in check_document(doc).findings if d.code == "DL242"]
    assert {i.finding.path[1] for i in suppress(found, doc).ignored} == {0}
    assert {d.path[1] for d in suppress(found, doc).kept if d.code == "DL242"} <= {1}
