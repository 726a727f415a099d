"""`tune --plot`: the open loop with its margins, and the answers of the closed loop."""

from __future__ import annotations

import cmath
import math
import xml.etree.ElementTree as ET

import pytest

import pidcfg
from command import run_text
from pidcfg.cli.formats.tuning import margin_chart as chart_of
from pidcfg.pictures import figure as draw

RULES = [
    ("simc", {"gain": 2, "time_constant": 10, "dead_time": 2}),
    ("simc", {"model": "integrating", "gain": 0.02, "dead_time": 5}),
    ("iae-disturbance", {"gain": -2, "time_constant": 10, "dead_time": 2}),
    ("chr", {"form": "P", "gain": 2, "time_constant": 10, "dead_time": 2}),
    ("zn-closed", {"gain": 2, "ultimate_gain": 8, "ultimate_period": 4}),
    ("amigo", {"transfer": "exp(-0.2s)(-0.3s+1)/((2s+1)(s+1))"}),
]


@pytest.mark.parametrize(("method", "numbers"), RULES)
def test_every_mark_is_where_its_margin_is_measured(method, numbers):
    result = pidcfg.tune(method, **numbers)
    margins, locus = result.judgement.margins, chart_of(result).locus
    assert abs(locus.nearest + 1) == pytest.approx(1 / margins.ms, rel=1e-3)
    assert locus.turn == pytest.approx(-1 / margins.gain_margin, rel=1e-6)
    assert min(abs(point + 1) for point in locus.points) == abs(locus.nearest + 1)
    if math.isinf(margins.phase_margin):
        assert locus.crossover is None
    else:
        assert abs(locus.crossover) == pytest.approx(1)
        assert 180 - abs(math.degrees(cmath.phase(locus.crossover))) == pytest.approx(margins.phase_margin)


@pytest.mark.parametrize(("method", "numbers"), RULES)
def test_the_answers_are_those_that_are_told(method, numbers):
    result = pidcfg.tune(method, **numbers)
    chart, told = chart_of(result), result.judgement.answer
    after_setpoint, after_load = (panel.lines[0] for panel in chart.panels)
    assert after_setpoint.times[0] == 0
    assert after_setpoint.values[0] == after_load.values[0] == 0
    rest = math.isinf(result.gains.integral_time)
    if rest:
        assert after_setpoint.values[-1] < 0.95
    else:
        assert after_setpoint.values[-1] == pytest.approx(1, abs=0.03)
        assert abs(after_load.values[-1]) < 0.1 * max(map(abs, after_load.values))
        assert 100 * (max(after_setpoint.values) - 1) == pytest.approx(max(told.overshoot, 0), abs=0.5)
        times, values = after_load.times, after_load.values
        area = sum(abs(v) * (b - a) for a, b, v in zip(times, times[1:], values, strict=False))
        assert area == pytest.approx(told.iae_disturbance, rel=0.05)


def test_the_picture_names_circle_and_margins():
    chart = chart_of(pidcfg.tune("simc", gain=1, time_constant=1, dead_time=1))
    root = ET.fromstring(draw.svg([chart], title="simc, PI"))  # noqa: S314 - drawn here
    texts = ["".join(node.itertext()) for node in root.iter() if node.tag.endswith("}text")]
    margins = {"Ms 1.59", "gain margin 3.14", "phase margin 61.4°"}
    assert margins | {"-1", "Kp 0.5, Ti 1 s", "real part of the open loop"} <= set(texts)
    (said,) = [node.text for node in root.iter() if node.tag.endswith("}desc")]
    assert "The open loop in the complex plane: Ms 1.59, gain margin 3.14, phase margin 61.4°." in said
    lines = [node.get("class") or "" for node in root.iter()]
    assert {"line circle ms", "line circle unit", "line locus only", "line angle"} <= set(lines)


def run(*args, cwd):
    return run_text("tune", "--method", "simc", *args, cwd=cwd)


PROCESS = ["--gain", "2", "--time-constant", "10", "--dead-time", "2"]


def test_files_and_terminal(tmp_path):
    result = run(*PROCESS, "--plot", "loop.svg", "--plot", "loop.html", "--plot", "-", cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    assert "Ms 1.59" in (tmp_path / "loop.svg").read_text("utf-8")
    assert (tmp_path / "loop.html").read_text("utf-8").count("<svg") == 2
    assert "PV, set point +1" in result.stdout
    assert run(*PROCESS, "--plot", "loop.svg", cwd=tmp_path).returncode == 0  # the same bytes
    other = run(*PROCESS[:-1], "3", "--plot", "loop.svg", cwd=tmp_path)
    assert (other.returncode, "use --force" in other.stderr) == (2, True)


@pytest.mark.parametrize(
    ("args", "says"),
    [
        ([*PROCESS, "--plot", "-", "--format", "json"], "would both go to standard output"),
        ([*PROCESS, "--plot", "loop.gif"], "loop.gif"),
        ([*PROCESS, "--plot", "a.svg", "--diff"], "--diff needs --write"),
    ],
)
def test_what_cannot_be_drawn_is_refused(tmp_path, args, says):
    result = run(*args, cwd=tmp_path)
    assert says in result.stderr
    assert result.returncode == 2
    assert list(tmp_path.iterdir()) == []


def test_a_loop_whose_process_is_not_known_has_no_picture(tmp_path):
    cycle = ["--ultimate-gain", "2", "--ultimate-period", "3", "--plot", "a.svg"]
    result = run_text("tune", "--method", "zn-closed", *cycle, cwd=tmp_path)
    assert (result.returncode, list(tmp_path.iterdir())) == (2, [])
    assert "--plot needs the process: add its --gain" in result.stderr
