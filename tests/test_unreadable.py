"""Bytes and lines that are no YAML: what they are, where, and how to cure them."""

from __future__ import annotations

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

import one_loop
from pidcfg.text.document import LINE_BREAK
from pidcfg.text.signs import MAGIC
from pidcfg.text.source import read_document

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
