"""What is said of a file that is not as the schema wants it, and how to mend it: each kind of fault once."""

from __future__ import annotations

import pytest

from pidcfg.text.source import read_document
from pidcfg.validate.engine import check_document

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
