"""The key that a verdict names: of the file that is wrong, and also where it does not give that key."""

from copy import deepcopy

import pytest

from pidcfg.conversion.pipeline import convert
from pidcfg.vendors import VENDORS
from pidcfg.verification.battery import side_of
from pidcfg.verification.comparison import Difference
from pidcfg.verification.keys import key_of
from pidcfg.verification.neutral import loops_of
from verify_measure import checked

EZLOGIX = {
    "pidcfg": 1,
    "vendor": "ezlogix",
    "plc": {"process_when_stopped": True},
    "loops": [
        {
            "name": "OVEN",
            "registers": "R101",
            "discretes": "S101",
            "mode": "auto",
            "algorithm": "velocity",
            "action": "reverse",
            "sample_rate": 1.0,
            "tuning": {"proportional_gain": 4.0, "integral_time": 60.0, "derivative_time": "off"},
            "pv": {"tag": "IR1", "range": [0, 400], "unit": "degC", "counts": [0, 4095]},
            "setpoint": {"value": 170.0, "limits": [20, 320]},
            "output": {"tag": "OR1", "range": [0, 100], "unit": "%", "limits": [10, 90]},
            "anti_windup": True,
        }
    ],
}
CASES = [
    ("dl06", "bias_freeze", None, ("step 50 %", "pv", 0.5, 0.4), "bias_freeze"),
    ("dl06", "bumpless", None, ("transfers", "pv", 0.5, 0.4), "bumpless"),
    ("dl06", "setpoint.value", None, ("start", "setpoint", 170.0, 0.0), "setpoint.value"),
    ("click", "freeze_bias", None, ("step 50 %", "pv", 0.5, 0.4), "freeze_bias"),
    ("click", "action", "reverse", ("high limit", "pv", 0.5, 0.4), "action"),
    ("click", "tuning.proportional_gain", 5.0, ("auto", "output", 0.5, 0.4), "tuning.proportional_gain"),
    ("dl06", "output.limits.1", 95, ("step 50 %", "output", 0.9, 0.95), "output.limits"),
    ("dl06", "output.range.1", 105, ("step 50 %", "output", 0.9, 0.857), "output.range"),
    ("dpide", "CYCLE", 1200, ("start", "sample time", 1.0, 1.2), "CYCLE"),
    ("dpide", "Kc_Kp", 1.25, ("start", "pv", 0.5, 0.4), "Kc_Kp"),
    ("dpide", "PID_MAN", True, ("start", "mode", "auto", "manual"), "PID_MAN"),
    ("nextopid", "MaxPV", 380, ("set point limits", "setpoint", 400.0, 380.0), "MaxPV"),
    ("nextopid", "Kp", 1.25, ("start", "pv", 0.5, 0.4), "Kp"),
    ("nextopid", "Manual", None, ("start", "mode", "manual", "auto"), "Manual"),
]


def edited(data, path, value):
    """A file's data with one key of its first loop changed, or taken out for None."""
    data = deepcopy(data)
    *above, last = [int(part) if part.isdecimal() else part for part in path.split(".")]
    here = data["loops"][0]
    for part in above:
        here = here[part]
    if value is None:
        del here[last]
    else:
        here[last] = value
    return data


@pytest.mark.parametrize(("target", "path", "value", "seen", "key"), CASES)
def test_key_is_the_one_that_was_spoiled(target, path, value, seen, key):
    base = edited(EZLOGIX, "mode", "manual") if path == "Manual" else EZLOGIX
    source = checked(base)
    outcome = convert(source.config, source.vendor, VENDORS[target], {})
    result = checked(edited(outcome.data, path, value))
    assert not result.failed
    (loop,) = loops_of(source.config, source.vendor)
    stage, signal, before, after = seen
    difference = Difference(stage, signal, 1.0, before, after, (1,))
    assert key_of(difference, loop, side_of(result.vendor, result.config), 0) == key
