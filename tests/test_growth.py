"""Work grows with the number of loops and no faster: Python's calls are counted, never the clock."""

import sys
from functools import cache

import pytest

import pidcfg
from pidcfg.conversion.pipeline import convert
from pidcfg.schemas.generic import GenericFile
from pidcfg.text.writer import yaml_text
from pidcfg.vendors import VENDORS

LOOP = {
    "mode": "auto",
    "output_raises_pv": True,
    "sample_time": 1,
    "tuning": {"gain": 1.5, "integral_time": 60, "derivative_time": 5},
    "pv": {"range": [0, 100], "unit": "degC"},
    "setpoint": {"value": 50},
    "output": {"range": [0, 100]},
    "alarms": {"pv": {"low": 10, "high": 90}, "hysteresis": 1},
}
FEWEST = {"dl06": 2, "click": 2, "ezlogix": 4}
"""Loops to begin with, where a PLC has not many; it has four times as many."""
BOUND = {"dl06": 1.05, "click": 1.05, "ezlogix": 1.05}
"""How many times the calls may be that so many more loops would take by the step before; few loops may be compared."""
WORK = {
    "check": lambda text, _: pidcfg.check_text(text, "a.yaml"),
    "encode": lambda text, _: pidcfg.encode(text),
    "diff": lambda text, _: pidcfg.diff(text, text.replace("1.5", "1.6")),
    "convert": lambda text, vendor: pidcfg.convert(text, to="dpide" if vendor != "dpide" else "nextopid"),
}


@cache
def configuration(vendor, loops):
    """A file of so many loops."""
    data = {"pidcfg": 1, "vendor": "generic", "loops": [{"name": f"L{100 + i}", **LOOP} for i in range(loops)]}
    if vendor != "generic":
        data = convert(GenericFile.model_validate(data), VENDORS["generic"], VENDORS[vendor], {}).data
    return yaml_text(data)


def calls_of(work):
    """The calls that some work takes."""
    events = []
    sys.setprofile(lambda _, event, __: events.append(event))
    try:
        work()
    finally:
        sys.setprofile(None)
    return events.count("call") + events.count("c_call")


@pytest.mark.parametrize("what", WORK)
@pytest.mark.parametrize("vendor", VENDORS)
def test_calls_grow_with_the_loops_and_no_faster(vendor, what):
    texts = [configuration(vendor, FEWEST.get(vendor, 5) * factor) for factor in (1, 2, 4)]
    WORK[what](texts[0], vendor)  # so that everything is loaded
    few, twice, four_times = (calls_of(lambda text=text: WORK[what](text, vendor)) for text in texts)
    assert four_times - twice <= BOUND.get(vendor, 1.01) * 2 * (twice - few)
