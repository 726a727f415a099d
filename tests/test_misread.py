"""What is written the way people write it is refused with the way it is written here; no value changes silently."""

from __future__ import annotations

import pytest

import pidcfg as api
from one_loop import PLANT
from pidcfg.schemas.numbers import cure
from pidcfg.study.scenario import check_scenario
from pidcfg.text.source import read_document
from pidcfg.validate.engine import check_document

EVENT = """\
pidcfg: 1
scenario: step
config: a.yaml
duration: 10
plants: {A: {model: first_order, gain: 1, time_constant: 60}}
events:
  - {at: 5, loop: A, sp: 80}
"""


def first(text):
    data = text if isinstance(text, bytes) else text.encode()
    return min(check_document(read_document(data, "a.yaml")).findings, key=lambda d: d.order)


def test_the_plant_is_a_good_one():
    assert not [d for d in check_document(read_document(PLANT.encode(), "a.yaml")).findings if d.severity > 1]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("2,5", "write 2.5: the decimal sign is a point"),
        ("-2,50", "write -2.50: the decimal sign is a point"),
        ("2,0", "write 2.0: the decimal sign is a point"),
        ("1,800", "write 1.800 or 1800: a comma says neither"),
        ("1,800.0", "write 1800.0: nothing stands between thousands"),
        ("1.800,0", "write 1800.0: nothing stands between thousands"),
        ("1'085.0", "write 1085.0: nothing stands between thousands"),
        ("1 085", "write 1085: nothing stands between thousands"),
        ("1\N{NO-BREAK SPACE}085", "write 1085: nothing stands between thousands"),
        ("1,234,567", "write 1234567: nothing stands between thousands"),
        ("85 %", "write the number alone; it is taken in the key's own unit, which need not be %"),
        ("85°C", "write the number alone; it is taken in the key's own unit, which need not be °C"),
        ("2.50 %/degC", "write the number alone; it is taken in the key's own unit, which need not be %/degC"),
        (
            "2,5 degC",
            "write 2.5: the decimal sign is a point; it is taken in the key's own unit, which need not be degC",
        ),
        ("2,5 counts", "write 2.5: the decimal sign is a point; counts may stay"),
        ("\N{EN DASH}5", "write -5: U+2013 is a dash, not a minus"),
        ("\N{MINUS SIGN}2.5", "write -2.5: U+2212 is a dash, not a minus"),
        ("5\N{NO-BREAK SPACE}", "write 5: U+00A0 is a no-break space, not a space"),
        (
            "\N{LEFT DOUBLE QUOTATION MARK}5\N{RIGHT DOUBLE QUOTATION MARK}",
            "write 5: U+201C is a quote, not a quote of YAML",
        ),
        ("abc", None),
        ("2.5.6", None),
        ("12.345.678", "write 12345678: nothing stands between thousands"),
        ("1O0", "write 100: a letter stands where a digit belongs"),
        ("\N{FULLWIDTH DIGIT TWO}", "write 2: U+FF12 is FULLWIDTH DIGIT TWO"),
        ("1/3", None),
        ("1,2,3", None),
        ("5 - 6", None),
        ("5 counts", None),
        ("", None),
    ],
)
def test_the_cure_of_a_text_that_is_no_number(text, says):
    assert cure(text) == says


@pytest.mark.parametrize(
    ("before", "after", "place", "message", "cure"),
    [
        (
            "gain: 2.5",
            "gain: 2,5",
            (8, 22),
            "5 has no value",
            "write 2.5: the decimal sign is a point; 2,5 inside braces is two keys",
        ),
        ("100}", "1,800.0}", (8, 34), "800.0 has no value", "write 1800.0: nothing stands between thousands"),
        ("sample_rate: 2", "sample_rate: 2,5", (6, 18), "sample_rate: '2,5' is not a number", "write 2.5"),
        ("sample_rate: 2", "sample_rate: 2,5 s", (6, 18), "sample_rate: '2,5 s' is not a time", "write 2.5"),
        ("sample_rate: 2", "sample_rate: 2 parsec", (6, 18), "'2 parsec' is not a time", "units are ms, s, min and h"),
        ("400]", "400,5]", (9, 17), "a list of two values, not of 3", "that is a point"),
        ("400]", "1e-320]", (9, 17), "range: 1e-320 is too small; the limit is 1e-300", "write 0 where that is meant"),
        ("400]", "1e301]", (9, 17), "range: 1e301 is too large; the limit is 1e300", "write a smaller number"),
        ("value: 85", "value: 85 °F", (10, 23), "value: '85 °F' is not a number", "the key is in degC, not in degF"),
        ("value: 85", "value: 1e-3 counts", (10, 23), "setpoint is 0.001 counts, but raw counts are whole", "round it"),
        (
            "value: 85",
            "value: 1e300",
            (10, 23),
            "setpoint is 1e+300 degC, but its word holds 0 to 400",
            "write a value that the word holds",
        ),
        (
            "  - name",
            "    name",
            (5, 5),
            "loops must be a list, not a mapping",
            "begin each item of loops with a dash: '- name: …'",
        ),
        ("gain", "Kp", (8, 14), "unknown key 'Kp'", "did you mean gain?"),
        ("    setpoint: {value: 85}", "    sp: 85", (10, 5), "unknown key 'sp'", "did you mean setpoint?"),
        (
            "    setpoint",
            "    alarms: {low: 5}\n    setpoint",
            (10, 14),
            "unknown key 'low'",
            "did you mean pv: {low: …}?",
        ),
        (
            "    setpoint",
            "    reset: 5\n    setpoint",
            (10, 5),
            "unknown key 'reset'",
            "did you mean tuning: {reset: …}?",
        ),
        ("dl06", "click", (2, 9), "this looks like dl06: its keys are those of the file", "write vendor: dl06"),
        (PLANT[PLANT.index("loops:") :], "loops: [null]\n", (4, 9), "item 1 of loops has no value", "remove the item"),
        (
            PLANT[PLANT.index("loops:") :],
            "loops: []\n",
            (4, 1),
            "the list of loops is empty: there is nothing",
            "add a loop",
        ),
    ],
)
def test_where_it_stands_what_it_is_and_what_to_do(before, after, place, message, cure):
    assert before in PLANT
    d = first(PLANT.replace(before, after))
    assert d.severity.label == "error"
    assert (d.span.line, d.span.column) == place
    assert message in d.message
    assert cure in d.help


def test_a_key_of_an_event_is_named():
    (d,) = api.load(EVENT).findings
    assert (d.message, d.help) == ("unknown key 'sp'", "did you mean set: {setpoint: …}?")


def test_another_unit_in_an_event_is_told_with_that_of_the_key(tmp_path):
    (tmp_path / "a.yaml").write_text(PLANT, "utf-8")
    (tmp_path / "s.yaml").write_text(EVENT.replace("sp: 80", "set: {setpoint: 203 °F}"), "utf-8")
    doc = read_document((tmp_path / "s.yaml").read_bytes(), str(tmp_path / "s.yaml"))
    (d,) = [d for d in check_scenario(doc) if d.code == "PID053"]
    assert (d.message, d.help) == (
        "setpoint: '203 °F' is not a number",
        "the key is in degC, not in degF: write the number of degC alone",
    )


def test_a_file_with_one_odd_key_is_still_of_its_vendor():
    assert "this looks like" not in first(PLANT.replace("gain", "proportional_gain")).message
