"""Files written and edited: every other byte stays; and the dotted keys that say where."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import replace
from decimal import Decimal
from functools import cache

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from edited_files import NAME, checked, inserted, moved, pool, renamed, reordered, spaced
from pidcfg.cli.options import select_findings
from pidcfg.schemas.generic import Loop
from pidcfg.text.paths import dotted_text, given_fields, has_key, is_given, leaves, parse_path, set_value, value_at
from pidcfg.text.source import read_document
from pidcfg.text.writer import yaml_text
from pidcfg.validate.baseline import compare, entry_of, may_be_in_baseline, suppress
from pidcfg.validate.fixes import replace_values
from pidcfg.validate.schema import _rename_key, key_edit, value_edit

# --- What covers a finding covers it after every edit that does not touch its loop, and no other one instead ----------

VENDORS = ("dl06", "click", "ezlogix", "nextopid", "dpide", "generic")

OF_ALL_LOOPS = {"DL210"}
"""Rules about each loop for which the number of loops counts: with a fifth loop the CPU really is too slow."""
EXAMPLES = settings(max_examples=20)
PLAIN = re.compile(r"(?<![\w.\-/])-?\d+(?:\.\d+)?(?![\w.])")
"""A number as a file has it."""
SAID = re.compile(r"#|name: [^,]*$")
"""What stands before a number that is part of a remark or a name."""
NUMBERS = re.compile(r"(?<![\w.\-/])\d+(?:\.\d+)?(?![\w/])").findall
"""The numbers of a message that are in no name and in no address."""


def identity(d):
    return entry_of(d, str)


def findings(text):
    return list(checked(text).findings)


@st.composite
def edits(draw, parts):
    """An edited file, and the names of loops that the edits touched."""
    touched = set()
    for n in range(draw(st.integers(1, 3))):
        kind = draw(st.sampled_from(["append", "insert", "reorder", "rename", "move", "space"]))
        at = draw(st.integers(0, len(parts.loops) - 1))
        if kind in {"append", "insert"} and not any(name.startswith("ADDED") for name in parts.names):
            parts = inserted(parts, len(parts.loops) if kind == "append" else at, n + 1)
            touched.add(f"ADDED{n + 1}")
        elif kind == "reorder":
            parts = reordered(parts, draw(st.permutations(range(len(parts.loops)))))
        elif kind == "space":
            parts = spaced(parts, at)
        elif kind in {"rename", "move"} and not touched & {"RENAMED"}:
            name = parts.names[at]
            after = (renamed if kind == "rename" else moved)(parts, name)
            if after.vendor != "dl06" or kind == "rename":
                touched |= {name, "RENAMED"} if after != parts else set()
            parts = after
    return parts, touched


def concerns(d, touched):
    """Whether an edit of these loops may change a finding: it is one of theirs, or of something that they share."""
    return d.loop in touched or bool(touched & set(d.with_loops)) or not d.loop or d.code in OF_ALL_LOOPS


@pytest.mark.parametrize("vendor", VENDORS)
@EXAMPLES
@given(data=st.data())
def test_edits_elsewhere_never_change_what_is_covered(vendor, data):
    parts = data.draw(st.sampled_from(pool(vendor)))
    before = findings(parts.text)
    target = data.draw(st.sampled_from([d for d in before if d.loop]))
    with_comment = commented(parts, target)
    edited, touched = data.draw(edits(with_comment))
    text = edited.text
    after = findings(text)
    mine, theirs = ([d for d in rows if not concerns(d, touched)] for rows in (before, after))

    assert Counter(map(identity, mine)) == Counter(map(identity, theirs))

    known = compare(after, lambda _: True, list(map(identity, filter(may_be_in_baseline, before))), set(), str).known
    assert all(any(d is one for one in known) for d in theirs if may_be_in_baseline(d)), "the baseline"
    assert all(identity(d) in set(map(identity, before)) for d in known)

    covered = {identity(d) for d in before if not any(d is one for one in select_findings(before, [], [target.code]))}
    assert covered >= {identity(d) for d in theirs if d not in select_findings(after, [], [target.code])}, "a setting"

    ignored = [one.finding for one in suppress(after, read_document(text.encode(), "plant.yaml")).ignored]
    first = suppress(findings(with_comment.text), read_document(with_comment.text.encode(), "plant.yaml")).ignored
    assert Counter(identity(d) for d in ignored if not concerns(d, touched)) == Counter(
        identity(one.finding) for one in first if not concerns(one.finding, touched)
    ), "a comment"
    assert {d.loop for d in ignored} <= {target.loop, *("RENAMED" for _ in touched)}


def commented(parts, d):
    """The file with a comment behind the line of a finding; unchanged where that line has none of its own."""
    lines = parts.text.split("\n")
    line = lines[d.span.line - 1]
    start = len(parts.head.split("\n"))
    for i, loop in enumerate(parts.loops):
        rows = loop.split("\n")
        if start <= d.span.line < start + len(rows) - 1:
            rows[d.span.line - start] = f"{re.sub(r' *# (?:expect|ok).*', '', line)}  # pidcfg: ignore[{d.code}] reason"
            loops = (*parts.loops[:i], "\n".join(rows), *parts.loops[i + 1 :])
            return type(parts)(parts.vendor, parts.head, loops, parts.tail)
        start += len(rows) - 1
    return parts


@cache
def numbers(vendor):
    """The findings of numbers that are written in a loop, with their files."""
    rows = [(parts, d) for parts in pool(vendor) for d in findings(parts.text) if d.loop]
    rows = [(parts, d) for parts, d in rows if d.value and re.fullmatch(r"-?\d+(\.\d+)?", d.value)]
    assert len(rows) > 10
    return rows


@pytest.mark.parametrize("vendor", VENDORS)
@EXAMPLES
@given(data=st.data())
def test_a_value_that_changes_makes_a_new_finding(vendor, data):
    parts, d = data.draw(st.sampled_from(numbers(vendor)))
    before = findings(parts.text)
    factor = data.draw(st.sampled_from(["0.999", "1.001", "2", "1.1", "0.5"]))
    lines = parts.text.split("\n")
    row = lines[d.span.line - 1]
    value = f"{Decimal(d.value) * Decimal(factor) + (d.value == '0'):f}"
    lines[d.span.line - 1] = row[: d.span.column - 1] + value + row[d.span.end_column - 1 :]
    after = findings("\n".join(lines))
    same = [one for one in after if (one.code, one.loop, one.key) == (d.code, d.loop, d.key) and one.path == d.path]
    known = compare(after, lambda _: True, list(map(identity, before)), set(), str).known
    assert not any(one is k for one in same for k in known)


def written(parts, i):
    """The numbers that are written in a loop, by their places in its text."""
    return [m for m in PLAIN.finditer(parts.loops[i]) if not SAID.search(row_before(parts.loops[i], m))]


def row_before(text, match):
    return text[: match.start()].rpartition("\n")[2]


@pytest.mark.parametrize("vendor", VENDORS)
@settings(max_examples=60)
@given(data=st.data())
def test_any_number_of_a_loop_is_part_of_what_its_findings_are_known_by_and_of_no_other(vendor, data):
    parts = data.draw(st.sampled_from(pool(vendor)))
    i = data.draw(st.integers(0, len(parts.loops) - 1))
    number = data.draw(st.sampled_from(written(parts, i) or [None]))
    if number is None:
        return
    new = f"{Decimal(number[0]) * Decimal(data.draw(st.sampled_from(['1.5', '2', '0.5']))) + 1:f}"
    loop = parts.loops[i][: number.start()] + new + parts.loops[i][number.end() :]
    edited = replace(parts, loops=(*parts.loops[:i], loop, *parts.loops[i + 1 :]))
    before = {(d.code, d.severity, d.path): d for d in findings(parts.text) if d.loop}
    for d in findings(edited.text):
        former = before.get((d.code, d.severity, d.path))
        if former is None or d.code in OF_ALL_LOOPS:
            continue
        if d.loop != parts.names[i]:
            assert identity(d) == identity(former)
        elif not d.with_loops and NUMBERS(d.message) != NUMBERS(former.message):
            assert identity(d) != identity(former)


@pytest.mark.parametrize("vendor", VENDORS)
@EXAMPLES
@given(data=st.data())
def test_the_same_faults_in_a_new_loop_are_new(vendor, data):
    parts = data.draw(st.sampled_from(pool(vendor)))
    before = findings(parts.text)
    i = data.draw(st.sampled_from(sorted({d.path[1] for d in before if d.loop})))
    at = data.draw(st.integers(0, len(parts.loops)))
    copy = NAME.sub(lambda match: match[1] + "COPIED", parts.loops[i], count=1)
    after = findings(replace(parts, loops=(*parts.loops[:at], copy, *parts.loops[at:])).text)
    known = compare(after, lambda _: True, list(map(identity, before)), set(), str).known
    assert "COPIED" not in {d.loop for d in known}


# --- A key with another name: where it may be renamed, and what an alias shares ---------------------------------------


def test_a_mapping_that_an_alias_shares_is_renamed_by_either_path():
    shared = {"gian": 1}
    data = {"a": shared, "b": shared}
    assert _rename_key(data, ("a", "gian"), "gain") is True
    assert _rename_key(data, ("b", "gian"), "gain") is True
    assert data == {"a": {"gain": 1}, "b": {"gain": 1}}


@pytest.mark.parametrize("mapping", [{"gian": 1, "gain": 2}, {"gian": None}, {"other": 1}])
def test_a_key_that_is_taken_or_has_no_value_or_is_not_there_is_not_renamed(mapping):
    data = {"a": {**mapping}}
    assert _rename_key(data, ("a", "gian"), "gain") is False
    assert data == {"a": mapping}


TEXT = """\
plain: 1
'quoted': &here [2, 3]
? long
: 4
&mark named: 5
text: "a
  b"
"""


@pytest.mark.parametrize(
    ("path", "key", "value"),
    [
        (("plain",), ("new", 1, 1), ("x", 1, 8)),
        (("quoted",), ("'new'", 2, 1), None),
        ((), None, None),
        (("named",), None, ("x", 5, 14)),
        (("text",), ("new", 6, 1), None),
        (("missing",), None, None),
    ],
)
def test_an_edit_is_for_one_line_without_an_anchor(path, key, value):
    doc = read_document(TEXT.encode(), "a.yaml")

    def shown(edits):
        return next(((edit.text, edit.span.line, edit.span.column) for edit in edits), None)

    assert (shown(key_edit(doc, path, "new")), shown(value_edit(doc, path, "x"))) == (key, value)


# --- Values that are written into a file: in the place of others, or as new keys behind a neighbour -------------------

BLOCK = "loops:\n  - name: A  # the first\n    tuning:\n      gain: 1  # as found\n    mode: auto\n"
FLOW = "loops:\n  - {name: A, tuning: {gain: 1}, mode: auto}\n"
GAIN, RATE, RESET = (("loops", 0, "tuning", key) for key in ("gain", "rate", "reset"))


@pytest.mark.parametrize(
    ("text", "values", "written"),
    [
        (BLOCK, {GAIN: "2.5"}, BLOCK.replace("gain: 1", "gain: 2.5")),
        (FLOW, {GAIN: "2.5"}, FLOW.replace("gain: 1", "gain: 2.5")),
        (BLOCK, {RATE: "3"}, BLOCK.replace("# as found\n", "# as found\n      rate: 3\n")),
        (FLOW, {RATE: "3"}, FLOW.replace("gain: 1", "gain: 1, rate: 3")),
        (BLOCK, {RESET: "2 min", RATE: "3"}, BLOCK.replace("found\n", "found\n      reset: 2 min\n      rate: 3\n")),
        (FLOW, {GAIN: "2", RESET: "4", RATE: "3"}, FLOW.replace("gain: 1", "gain: 2, reset: 4, rate: 3")),
        (BLOCK.replace("gain: 1", "gain: '1 s'"), {GAIN: "2 s"}, BLOCK.replace("gain: 1", "gain: '2 s'")),
        (BLOCK.replace("gain: 1", "gain: '1'"), {GAIN: "2"}, BLOCK.replace("gain: 1", "gain: 2")),
    ],
)
@pytest.mark.parametrize("mark", ["", "\N{ZERO WIDTH NO-BREAK SPACE}"])
def test_a_key_that_is_not_there_goes_behind_its_neighbour(text, values, written, mark):
    data = (mark + text).encode()
    made = replace_values(data, read_document(data, "a.yaml"), values, dict.fromkeys((RATE, RESET), GAIN))
    assert made.decode() == mark + written


# --- What the writer writes is read back as it was --------------------------------------------------------------------


@pytest.mark.parametrize(
    "text",
    [
        "0?",
        "a?b",
        "?x",
        "?",
        "? x",
        "it's?",
        "a?\tb",
        "0:",
        ": x",
        "0#",
        "a #b",
        "0,",
        "a, b",
        "{",
        "]",
        "&a",
        "*a",
        "!a",
        "%a",
        ":",
        ":a",
        "a:b",
        "a::b",
        "a :b",
        "@a",
        "`a",
        "- a",
        "|",
        ">",
        '"a',
        "'a",
        "a'?",
        "\u00b0C?",
    ],
)
def test_a_text_comes_back_in_short_mappings_and_in_long_ones(text):
    data = {"name": text, "loops": [{"name": "A", "pv": {"unit": text}, "list": [text, text], "description": text}]}
    document = read_document(yaml_text(data).encode(), "x.yaml")

    assert document.problems == ()
    assert document.data == data


# --- Dotted keys: there and back, and what stands at them -------------------------------------------------------------


KEYS = st.from_regex(r"[a-z_]+", fullmatch=True)
LOOP = Loop.model_validate(
    {
        "name": "TIC-101",
        "output_raises_pv": True,
        "sample_time": 1,
        "tuning": {"gain": 2},
        "pv": {"range": [0, 100]},
        "output": {"range": [0, 100]},
        "setpoint": {"limits": [10, 90]},
    }
)


@given(st.lists(st.one_of(KEYS, st.integers(0, 99)), max_size=5))
def test_a_path_comes_back_from_its_text(path):
    assert parse_path(dotted_text(path)) == tuple(path)


def test_only_numbers_are_indices():
    assert parse_path("x.²") == ("x", "²")
    assert parse_path("x.2") == ("x", 2)


@given(st.lists(KEYS, min_size=1, max_size=5), st.integers())
def test_what_is_put_is_found(path, value):
    data = {}
    set_value(data, path, value)
    assert value_at(data, path) == value
    assert has_key(data, path)


def test_sections_that_are_there_are_kept_and_items_of_lists_are_reached():
    data = {"a": {"b": 1}, "l": [{"x": 1}]}
    set_value(data, ("a", "c"), 2)
    set_value(data, ("l", 0, "x"), 3)
    assert data == {"a": {"b": 1, "c": 2}, "l": [{"x": 3}]}


def test_a_list_that_stands_where_a_section_belongs_gives_way():
    data = {"output": [1]}
    set_value(data, ("output", "unit"), "%")
    assert data == {"output": {"unit": "%"}}


@pytest.mark.parametrize("path", [("b",), ("a", "b"), ("l", 5), ("l", "x"), ("a", 0, "c")])
def test_where_there_is_nothing_there_is_none(path):
    data = {"a": None, "l": [1]}
    assert value_at(data, path) is None
    assert not has_key(data, path)


def test_models_are_walked_by_their_fields():
    assert value_at(LOOP, parse_path("setpoint.limits.1")) == 90
    assert value_at(LOOP, parse_path("setpoint.limits.2")) is None
    assert is_given(LOOP, ("tuning", "gain"))
    assert not is_given(LOOP, ("tuning", "integral_time"))
    assert [dotted_text(path) for path, _ in given_fields(LOOP)] == [
        "name",
        "output_raises_pv",
        "sample_time",
        "tuning.gain",
        "pv.range",
        "setpoint.limits",
        "output.range",
    ]


def test_a_key_that_is_dotted_itself_counts_as_several_and_its_path_is_as_written():
    data = {"tuning": {"gain": 2, "a.b": {}}, "alarms.pv": {"high": [1]}, 5: "x"}

    assert list(leaves(data)) == [
        (("tuning", "gain"), 2, ("tuning", "gain")),
        (("alarms", "pv", "high"), [1], ("alarms.pv", "high")),
        (("5",), "x", (5,)),
    ]
