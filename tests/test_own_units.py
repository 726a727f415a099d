"""A number may carry its key's own unit; another unit is an error that names both."""

from __future__ import annotations

from pathlib import Path

import pytest

from one_loop import PLANT
from pidcfg.schemas.numbers import NUMBER
from pidcfg.text.document import LINE_BREAK
from pidcfg.text.source import read_document
from pidcfg.validate.engine import check_document
from pidcfg.validate.own_units import _unit_of
from pidcfg.vendors import VENDORS

EXAMPLES = Path(__file__).parents[1] / "examples"
FILES = sorted(p for p in EXAMPLES.glob("*/*.yaml") if "scenario" not in p.name and p.parent.name in VENDORS)
EXPRESSIONS = {"nextopid"}
"""Vendors whose values may be expressions: a number with a unit is none."""

TIMED = ("s", "min", "sample", "cycle", "cycles")
"""Ends of units that times and rates have, which are read by types of their own."""


def checked(text):
    return check_document(read_document(text.encode(), "a.yaml"))


def numbers(data, path=()):
    """The places of numbers that are written plain."""
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for step, value in items:
        if isinstance(value, str) and type(value) is not str and NUMBER.fullmatch(value):
            yield (*path, step)
        yield from numbers(value, (*path, step))


def with_units(doc, vendor, spelled):
    """The text with each number's own unit behind it, and how many there are."""
    lines, places = LINE_BREAK.split(doc.text), set()  # an alias shares the place of its anchor
    for path in numbers(doc.data):
        if path[0] == "loops":
            loop = doc.data["loops"][path[1]]
            unit = _unit_of(vendor, loop, path[2:])
            if unit and not unit.endswith(TIMED):
                places.add((doc.locate(path), spelled(unit)))
    for span, unit in sorted(places, key=lambda row: (row[0].line, row[0].column), reverse=True):
        line = lines[span.line - 1]
        lines[span.line - 1] = f"{line[: span.end_column - 1]} {unit}{line[span.end_column - 1 :]}"
    return "\n".join(lines), len(places)


@pytest.mark.parametrize("path", FILES, ids=lambda p: f"{p.parent.name}/{p.stem}")
def test_a_number_in_its_own_unit_is_the_number(path):
    vendor = VENDORS[path.parent.name]
    bare = checked(path.read_text("utf-8"))
    text, count = with_units(bare.document, vendor, str)
    stated = checked(text)
    if vendor.key in EXPRESSIONS:
        assert stated.failed or not count
        return
    assert count
    assert stated.config == bare.config
    assert [d.message for d in stated.findings] == [d.message for d in bare.findings]


@pytest.mark.parametrize("vendor", [key for key in VENDORS if key not in EXPRESSIONS])
def test_any_other_unit_is_refused_and_both_are_named(vendor):
    path = next(p for p in FILES if p.parent.name == vendor)
    bare = checked(path.read_text("utf-8"))
    text, count = with_units(bare.document, VENDORS[vendor], lambda _: "furlong")
    refused = [d for d in checked(text).findings if d.code == "PID022"]
    assert count
    assert refused
    assert {d.loop for d in refused} == {loop["name"] for loop in bare.document.data["loops"]}
    assert all(d.help.startswith("the key is in ") and ", not in furlong:" in d.help for d in refused)


LOOP = PLANT.replace("degC", "UNIT").replace("value: 85", "value: 85 SAID")


@pytest.mark.parametrize(
    ("unit", "said"),
    [("degC", "°C"), ("°C", "degC"), ("degC", "℃"), ("degF", "°F"), ("m3/h", "m3 / h"), ("'%'", "%"), ("bar", "bar")],
)
def test_spellings_of_one_unit(unit, said):
    result = checked(LOOP.replace("UNIT", unit).replace("SAID", said))
    assert not result.failed
    assert str(result.config.loops[0].setpoint.value) == "85"


@pytest.mark.parametrize(("unit", "said"), [("degC", "degF"), ("degC", "C"), ("bar", "mbar"), ("m3/h", "m3")])
def test_what_is_not_the_same_unit(unit, said):
    (d,) = (
        d for d in checked(LOOP.replace("UNIT", unit).replace("SAID", said)).findings if d.severity.label == "error"
    )
    assert d.help == f"the key is in {unit}, not in {said}: write the number of {unit} alone"
    assert (d.span.line, d.span.column) == (10, 23)


def test_without_a_unit_of_the_pv_nothing_is_assumed():
    (d,) = (d for d in checked(LOOP.replace(", unit: UNIT", "").replace("SAID", "degC")).findings if d.code == "PID022")
    assert d.help == "write the number alone; it is taken in the key's own unit, which need not be degC"
