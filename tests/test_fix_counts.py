"""``validate --fix`` does what its count says: so many findings go, none comes back, and no other byte changes."""

from __future__ import annotations

import json
import re
import tempfile
from collections import Counter
from contextlib import chdir
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pidcfg.vendors import VENDORS
from shell import captured, pidcfg

STARTERS = Path(__file__).parents[1] / "src/pidcfg/cli/starters"
MENDED = {
    "dl06": [
        ("V2000 ", "v2000 "),
        ("sample_rate:", "smaple_rate:"),
        ("gain: 2.00 ", 'gain: "2.00" '),
        ("bias_freeze: true ", "bias_freeze: yes "),
        ("action: direct ", "action: DIRECT "),
        ("hysteresis:", "hysterisis:"),
    ],
    "click": [
        ("bits: C101 ", "bits: c0101 "),
        ("derivative_gain:", "derivative-gain:"),
        ("filter: 80 ", 'filter: "80" '),
        ("freeze_bias: true ", "freeze_bias: on "),
        ("hysteresis: 2.0", 'hysteresis: "2.0"'),
    ],
    "ezlogix": [
        ("registers: R101 ", "registers: r101 "),
        ("algorithm: position ", "algorithm: Position "),
        ("integral_time:", "integral time:"),
        ("anti_windup: true", "anti_windup: yes"),
    ],
    "nextopid": [("sample_time: 100 ms", "sampel_time: 100 ms"), ("  - name: FIC_101\n", "  - Name: FIC_101\n")],
    "dpide": [("device: D500 ", "device: d500 "), ("PID_RUN: true ", "PID_RUN: yes "), ("MV_MAX:", "MVMAX:")],
    "generic": [("integral_time:", "integarl_time:"), ("proportional: true ", "proportional: 'true' ")],
}
"""Texts of each starter file, and slips that have one reading."""
LEFT = {
    "dl06": [("limits: [20, 300]", "limits: [020, 300]"), ("rate: 0 ", "rate: high ")],
    "click": [("reset_time: 120 ", "reset_time: 0120 "), ("integers: DS101 ", "integers: DS0 ")],
    "ezlogix": [("proportional_gain: 2.00 ", "proportional_gain: 0x180 "), ("tag: IR1 ", "tag: XR1 ")],
    "nextopid": [("MaxMV: 100.0", "MaxMV: 0100")],
    "dpide": [("CYCLE: 1000 ", "CYCLE: 01000 "), ("PID_DIR: true ", "PID_DIR: forward ")],
    "generic": [("gain: 2.5 ", "gain: 2,5 "), ("derivative_on: pv ", "derivative_on: level ")],
}
"""Slips that a person has to decide."""
CASES = st.sampled_from([*VENDORS]).flatmap(
    lambda key: st.tuples(
        st.just(key), st.sets(st.sampled_from(MENDED[key])), st.sets(st.sampled_from(LEFT[key])), st.booleans()
    )
)


def spoilt(vendor, slips):
    """A starter file with slips in it."""
    text = (STARTERS / f"{vendor}.yaml").read_text("utf-8")
    for good, bad in slips:
        assert text.count(good) >= 1, good
        text = text.replace(good, bad, 1)
    return text


def findings(*arguments):
    """Code and place of each finding that a run reports, and what it says to people."""
    code, both, out = captured(pidcfg, ["validate", "a.yaml", "--format", "json", *arguments])
    assert code in {0, 1}, both
    rows = json.loads(out)["findings"]
    return Counter((row["code"], row["line"], row["message"]) for row in rows), both.replace(out, "")


def number(text, pattern):
    """The number that a text names; 0 where it names none."""
    match = re.search(pattern, text)
    return int(match[1]) if match else 0


@settings(max_examples=25, deadline=None)
@given(CASES)
def test_the_number_that_fix_names_is_that_of_the_findings_gone(case):
    vendor, mended, left, windows = case
    end = "\r\n" if windows else "\n"
    wrong, right = (spoilt(vendor, slips).replace("\n", end).encode() for slips in ([*mended, *left], left))
    with tempfile.TemporaryDirectory() as folder, chdir(folder):
        Path("a.yaml").write_bytes(wrong)
        before, said = findings()
        after, corrected = findings("--fix")
        assert Path("a.yaml").read_bytes() == right
        named = number(corrected, r"(\d+) findings? in \d+ files? corrected")
        assert named == number(said, r"(\d+) correctable with --fix") == len(mended)
        assert (before - after).total() == named
        assert {row[0] for row in (before - after)} == {*re.findall(r"x ([A-Z]+\d+)", corrected)}
        assert after == findings()[0], "what is left is named"
        assert sum(after.values()) >= len(left)
        again, said = findings("--fix")
        assert "0 findings in 0 files corrected" in said
        assert (again, Path("a.yaml").read_bytes()) == (after, right)


@pytest.mark.parametrize("vendor", VENDORS)
def test_every_slip_is_one(vendor):
    for slip in (*MENDED[vendor], *LEFT[vendor]):
        with tempfile.TemporaryDirectory() as folder, chdir(folder):
            Path("a.yaml").write_text(spoilt(vendor, [slip]), "utf-8")
            assert findings()[0], slip
