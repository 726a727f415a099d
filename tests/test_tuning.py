"""Tuning rules against the manual's worked examples and the textbooks, identification against exact responses."""

from __future__ import annotations

import cmath
import json
import math
import random
import xml.etree.ElementTree as ET

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import pidcfg
from command import run as command
from command import run_text
from pidcfg.cli.formats.tuning import margin_chart as chart_of
from pidcfg.pictures import figure as draw
from pidcfg.tuning.identify import identify
from pidcfg.tuning.margins import margins
from pidcfg.tuning.margins import step_answer as forecast
from pidcfg.tuning.response import Record, RecordError
from pidcfg.tuning.robust import fit_gains
from pidcfg.tuning.rules import METHODS, Cycle, Gains, Process
from pidcfg.tuning.transfer import Transfer, transfer_of
from pidcfg.vendors import VENDORS

# --- Tuning rules against the manual's worked examples and the textbooks, identification against exact responses ------

EXAMPLE = Process(gain=2, time_constant=10, dead_time=1, sample_time=0.1, closed_loop=4)
"""The process of NextoPID's chapter on tuning."""


def tune(name, form, process=EXAMPLE, cycle=None):
    """Gain, integral and derivative time."""
    gains = METHODS[name].gains(form, process, cycle or Cycle(10, 4))
    return gains.gain, gains.integral_time, gains.derivative_time


def test_the_manual_s_synthesis():
    """Gs 2, Tc 10, Tde 1, Tcl 4, sample time 0.1: Kp 0.99, Ti 10, Td 0.525."""
    assert tune("synthesis", "PID") == pytest.approx((0.990099, 10, 0.525), abs=1e-6)
    assert tune("synthesis", "PI")[2] == 0


def test_the_manual_s_least_error_for_set_point_changes():
    """Kp 3.85, Ti 13.77, Td 0.44; the coefficient that is printed, 1.435, would give 5.09."""
    assert tuple(round(x, 2) for x in tune("iae-setpoint", "PID")) == (3.85, 13.77, 0.44)


PU = 1.05 / 10


@pytest.mark.parametrize(
    ("name", "form", "wanted"),
    [
        ("iae-disturbance", "P", (0.902 / 2 * PU**-0.985, math.inf, 0)),
        ("iae-disturbance", "PI", (0.984 / 2 * PU**-0.985, 10 / 0.608 * PU**0.707, 0)),
        ("iae-disturbance", "PID", (1.435 / 2 * PU**-0.921, 10 / 0.878 * PU**0.749, 4.82 * PU**1.137)),
        ("iae-setpoint", "PI", (0.758 / 2 * PU**-0.861, 10 / (1.02 - 0.323 * PU), 0)),
        ("zn-open", "P", (5, math.inf, 0)),
        ("zn-open", "PI", (4.5, 3.33, 0)),
        ("zn-open", "PID", (6, 2, 0.5)),
        ("zn-closed", "P", (5, math.inf, 0)),
        ("zn-closed", "PI", (4.5, 4 / 1.2, 0)),
        ("zn-closed", "PID", (6, 2, 0.5)),
        ("tyreus-luyben", "PI", (10 / 3.2, 8.8, 0)),
        ("tyreus-luyben", "PID", (10 / 2.2, 8.8, 4 / 6.3)),
        ("nextopid-autotune", "PID", (10 / 3.2, 8.8, 4 / 6.3)),
        ("dl06-autotune", "PI", (3, 4, 0)),
        ("dl06-autotune", "PID", (4.5, 2.4, 0.4)),
    ],
)
def test_tables_and_textbooks(name, form, wanted):
    assert tune(name, form) == pytest.approx(wanted)


def test_a_rule_that_ends_says_where():
    slow = Process(gain=1, time_constant=1, dead_time=5)
    with pytest.raises(ValueError, match=r"above 3\.16"):
        METHODS["iae-setpoint"].gains("PI", slow, Cycle(0, 0))


def test_independent_gains():
    gains = Gains(4, 8, 0.5)
    assert (gains.ki, gains.kd) == (0.5, 2)
    assert Gains(4, math.inf, 0).ki == 0


@pytest.mark.parametrize(("vendor", "stored"), [("dl06", [1.92, 13.8, 0.44]), ("ezlogix", [1.92, 13.8, 0.4])])
def test_numbers_as_registers_hold_them(vendor, stored):
    """A PV of 0 to 50: gains in shares of the span are half of those in engineering units, 3.85."""
    gains = METHODS["iae-setpoint"].gains("PID", EXAMPLE, Cycle(0, 0))
    found = fit_gains(gains, VENDORS[vendor], 50, 100)
    assert [float(f.stored) for f in found] == stored
    for value in found:
        assert value.error_percent == pytest.approx(float((value.stored / value.wanted - 1) * 100))


def test_floats_hold_all_but_the_last_digits():
    gains = METHODS["iae-setpoint"].gains("PID", EXAMPLE, Cycle(0, 0))
    stored = [float(f.stored) for f in fit_gains(gains, VENDORS["click"], 50, 100)]
    assert stored == pytest.approx([gains.gain, gains.integral_time, gains.derivative_time], rel=6e-8)


def test_numbers_that_registers_cannot_hold_say_so():
    found = fit_gains(Gains(0.004, 70000, 0.03), VENDORS["dl06"], 100, 100)
    assert [f.stored is None for f in found] == [True, True, False]
    assert "switches it off" in found[0].problem
    assert [f.problem for f in fit_gains(Gains(0.001, 7000, 0), VENDORS["click"], 1, 100)] == [
        "0.001 is outside 0.01 to 10000",
        "7000 is outside 0.01 to 6000",
        None,
    ]


@pytest.mark.parametrize(
    ("seconds", "held", "unit"),
    [(999.8, 999.8, "s"), (999.9, 16.7, "min"), (7000, 116.7, "min"), (59_988, 999.8, "min"), (0.05, None, "s")],
)
def test_a_reset_beyond_the_word_in_seconds_is_one_in_minutes(seconds, held, unit):
    """9999 is an off code in either unit; 59988 s are 999.8 min. What is too short in seconds is so in minutes."""
    reset = fit_gains(Gains(1, seconds, 0), VENDORS["dl06"], 100, 100)[1]
    assert (reset.stored if reset.stored is None else float(reset.stored), reset.unit) == (held, unit)


@pytest.mark.parametrize(("seconds", "said"), [(9000, True), (100, False)])
def test_a_reset_in_minutes_says_which_key_it_needs(seconds, said):
    """The word counts in seconds unless bit 4 of +01 is on: 134 alone would integrate 60 times as fast."""
    process = {"gain": 2, "time_constant": seconds, "dead_time": 1000, "sample_time": 10}
    found = pidcfg.tune("simc", "PI", vendor="dl06", pv_range=(0, 200), **process)
    assert any("`reset_unit: minutes`" in warning for warning in found.warnings) is said


@pytest.mark.parametrize(
    ("vendor", "least", "most", "below", "above"),
    [("dl06", 0.05, 99.99, 0.049, 100), ("click", 0.1, 30, 0.099, 30.1), ("ezlogix", 0.05, 99.99, 0.049, 100)],
)
def test_a_sample_time_that_no_loop_of_the_plc_can_have_is_told(vendor, least, most, below, above):
    def said(seconds):
        numbers = {"gain": 2, "time_constant": 3000, "dead_time": 200, "sample_time": seconds}
        found = pidcfg.tune("simc", "PI", vendor=vendor, pv_range=(0, 100), **numbers)
        return [text for text in found.warnings if f"every {least} to {most} s" in text]

    assert [len(said(seconds)) for seconds in (below, least, most, above)] == [1, 0, 0, 1]


def test_no_integral_term_in_each_vendor_s_way():
    words = {v: [float(f.stored) for f in fit_gains(Gains(1, math.inf, 0), VENDORS[v], 100, 100)] for v in VENDORS}
    assert {v: found[1] for v, found in words.items()} == {**dict.fromkeys(VENDORS, 0), "click": 6000}


# --- identification --------------------------------------------------------------------------------------------------


def record(process: Process, *, noise=0.0, samples=600, seed=1, before=0.1):
    """A step of 10 from 20, on a PV at 50."""
    rng = random.Random(seed)
    dt = (process.dead_time + 6 * process.time_constant) / (samples * (1 - before))
    time = [i * dt for i in range(samples)]
    at = time[int(samples * before)]
    output = [20.0 if t < at else 30.0 for t in time]
    pv = [50 + 10 * process.gain * answer(t - at, process) + rng.gauss(0, noise) for t in time]
    return Record(time, output, pv)


def answer(past: float, process: Process) -> float:
    """The share of the final rise."""
    past -= process.dead_time
    return 1 - math.exp(-past / process.time_constant) if past > 0 else 0.0


@settings(max_examples=10, deadline=None)
@given(
    gain=st.floats(0.1, 20).flatmap(lambda g: st.sampled_from([g, -g])),
    constant=st.floats(0.1, 1000),
    share=st.floats(0.02, 2),
)
def test_a_process_comes_back_from_its_exact_response(gain, constant, share):
    process = Process(gain, constant, constant * share)
    found = identify(record(process)).process
    assert found.gain == pytest.approx(gain, rel=0.02)
    assert found.time_constant == pytest.approx(constant, rel=0.04)
    assert found.dead_time == pytest.approx(process.dead_time, abs=0.04 * constant)


def test_noise_is_measured_and_does_not_move_the_result_much():
    found = identify(record(Process(2, 10, 1), noise=0.2, samples=3000))
    assert found.noise == pytest.approx(0.2, rel=0.2)
    assert (found.process.gain, found.process.time_constant) == pytest.approx((2, 10), rel=0.03)
    assert found.process.dead_time == pytest.approx(1, abs=0.2)


GOOD = Process(2, 10, 1)
SHORT = record(GOOD)
BAD = {
    "the output never changes": Record(SHORT.time, [5.0] * 600, SHORT.pv),
    "has not settled: the record ends 60": Record(
        SHORT.time, [20.0 + 10 * (i > 60) - 8 * (i > 200) for i in range(600)], SHORT.pv
    ),
    "before 10 samples": Record(SHORT.time[:70], SHORT.output[:70], SHORT.pv[:70]),
    "has not settled": Record(SHORT.time[:130], SHORT.output[:130], SHORT.pv[:130]),
    "the PV answers by": record(Process(0.01, 10, 1), noise=1.0),
    "was not at rest before": Record(SHORT.time, SHORT.output, [y + 3 * (i < 30) for i, y in enumerate(SHORT.pv)]),
}


@pytest.mark.parametrize("message", BAD)
def test_records_that_tell_no_process_are_refused(message):
    with pytest.raises(RecordError, match=message) as error:
        identify(BAD[message])
    assert error.value.cure


# --- the command -----------------------------------------------------------------------------------------------------


PROCESS = ["--gain", "2", "--time-constant", "10", "--dead-time", "1"]


def run(*args, cwd=None):
    """The command in a process of its own."""
    return command("tune", *args, cwd=cwd)


def test_the_command_s_json_has_the_interface_s_keys():
    result = run("--method", "iae-setpoint", *PROCESS, "--sample-time", "0.1", "--for", "click", "--format", "json")
    found = json.loads(result.stdout)
    assert found["version"] == 1
    assert (found["method"], found["form"]) == ("iae-setpoint", "PID")
    assert found["gain"] == pytest.approx(3.849342)
    assert found["for"]["action"] == "direct"
    assert found["for"]["values"][0]["key"] == "tuning.proportional_gain"


def test_a_cooling_process_gets_the_vendor_s_word_for_it():
    for vendor, word in (("dl06", "reverse"), ("click", "reverse"), ("ezlogix", "direct")):
        cooling = ["--gain", "-2", *PROCESS[2:], "--pv-range", "0", "100"]
        result = run("--method", "zn-open", *cooling, "--for", vendor, "--format", "json")
        assert json.loads(result.stdout)["for"]["action"] == word
        assert json.loads(result.stdout)["gain"] == pytest.approx(6)


CSV = "time,output,pv\n" + "\n".join(
    f"{t:.3f},{u},{y:.5f}" for t, u, y in zip(SHORT.time, SHORT.output, SHORT.pv, strict=True)
)


def test_a_recorded_step_is_identified_and_drawn(tmp_path):
    (tmp_path / "step.csv").write_text(CSV, "utf-8")
    result = run("--method", "zn-open", "--from-csv", "step.csv", cwd=tmp_path)
    text = result.stdout.decode()
    assert result.returncode == 0
    assert text.startswith("identified: gain 2")
    assert text.count("│") >= 12
    assert "○ recorded   × fitted   ◉ both" in text


@pytest.mark.parametrize(
    ("args", "message"),
    [
        (["--method", "zn-open", "--gain", "2"], "zn-open needs --time-constant"),
        (["--method", "zn-closed", "--ultimate-gain", "2"], "zn-closed needs --ultimate-period"),
        (["--method", "synthesis", "--form", "P"], "synthesis has no rule for P; it has PI and PID"),
        (["--method", "zn-open", "--gain", "0"], "other than 0"),
        (["--method", "zn-open", "--dead-time", "-1"], "above 0"),
        (["--method", "zn-open", "--gain", "nan"], "nan"),
        (
            ["--method", "zn-closed", "--ultimate-gain", "2", "--ultimate-period", "3", "--for", "dl06"],
            "add --pv-range",
        ),
        (
            ["--method", "zn-closed", "--ultimate-gain", "2", "--ultimate-period", "3", "--pv-range", "5", "5"],
            "--pv-range 5 to 5 does not ascend",
        ),
        (["--method", "simc", "--gain", "1e-310", "--time-constant", "5", "--dead-time", "1"], "from 1e-09 to 1e+12"),
        (["--method", "simc", "--gain", "1", "--time-constant", "5", "--dead-time", "1e-300"], "from 1e-09 to 1e+12"),
        (["--method", "simc", "--transfer", "2/(1e-310s+1)"], "has 1e-310; its numbers go from 1e-09 to 1e+12"),
        (["--method", "simc", "--from-csv", "ramp.csv"], "simc divides by the dead time, which is 0"),
        (["--method", "zn-open", "--from-csv", "none.csv"], "none.csv"),
        (
            ["--method", "zn-open", "--from-csv", "bad.csv", "--columns", "time=1,output=2,pv=3"],
            "bad.csv:2:2: 'x' in column 2 is not a number; correct or remove the row",
        ),
        (["--method", "zn-open", "--from-csv", "back.csv"], "back.csv:4: the time does not go on (1 after 2 s)"),
        (
            ["--method", "zn-open", "--from-csv", "flat.csv", "--columns", "time=1,output=2,pv=3"],
            "flat.csv: the output never changes",
        ),
        (["--method", "zn-open", "--from-csv", "empty.csv"], "holds no samples"),
        (["--method", "zn-open", "--from-csv", "bytes.csv"], "is not UTF-8"),
        (["--method", "zn-open", "--from-csv", "good.csv", "--gain", "2"], "do not go together"),
    ],
)
def test_what_makes_no_sense_is_refused_in_one_line(tmp_path, args, message):
    files = {
        "bad.csv": "0,1,2\n1,x,3\n" + "".join(f"{i},1,3\n" for i in range(2, 30)),
        "back.csv": "t,u,y\n0,1,1\n2,1,1\n1,1,1\n3,1,1\n",
        "flat.csv": "0,1,2\n1,1,2\n2,1,2\n",
        "empty.csv": "time,out,pv\n",
        "ramp.csv": "".join(f"{i},{int(i >= 10)},{max(0, i - 10)}\n" for i in range(40)),
        "good.csv": CSV,
    }
    for name, text in files.items():
        (tmp_path / name).write_text(text, "utf-8")
    (tmp_path / "bytes.csv").write_bytes(b"\x00\xff\xfe1,2,3")
    result = run(*args, cwd=tmp_path)
    assert result.returncode == 2
    assert message in result.stderr.decode()
    assert b"Traceback" not in result.stderr


@pytest.mark.parametrize("ratio", [1e3, 1e4, 1e5, 1e6, 1e9])
def test_the_forecast_of_a_slow_process_is_that_of_an_integrator(ratio):
    """By Skogestad's rule the lag no longer matters, but for the size of a disturbance."""
    process = Process(ratio, ratio, 1, closed_loop=1)
    slow = forecast(METHODS["simc"].gains("PI", process, Cycle(1, 1)), transfer_of(process))
    line = Process(1, 1, 1, closed_loop=1, integrating=True)
    wanted = forecast(METHODS["simc"].gains("PI", line, Cycle(1, 1)), transfer_of(line))
    assert slow.overshoot == pytest.approx(wanted.overshoot, rel=0.02)
    assert slow.iae_setpoint == pytest.approx(wanted.iae_setpoint, rel=0.01)
    assert slow.iae_disturbance == pytest.approx(wanted.iae_disturbance, rel=0.01)


def test_times_too_far_apart_have_no_forecast():
    assert forecast(Gains(5, 1e6, 0), Transfer(1, (), (10,), 0, 1)) is None
    assert forecast(Gains(5, 4e2, 0), Transfer(1, (), (10,), 0, 1)) is not None


@pytest.mark.parametrize("constant", [1e6, 1e9, 1e12])
def test_the_forecast_of_a_slow_lag_is_that_of_the_integrator(constant):
    """Of a step's small share no digit is lost: SIMC with a wish far below the dead time overshoots by 93 %."""
    process = Process(1, constant, 0.01, closed_loop=1e-4)
    gains = METHODS["simc"].gains("PI", process, Cycle(1, 1))
    assert forecast(gains, transfer_of(process)).overshoot == pytest.approx(93.02, abs=0.02)


@settings(max_examples=30)
@given(st.tuples(*[st.floats(-6, 12)] * 4))
def test_no_process_of_usable_numbers_takes_long_or_fails(sizes):
    gain, constant, dead, wish = (10**size for size in sizes)
    process = Process(gain, constant, dead, closed_loop=wish)
    gains = METHODS["simc"].gains("PI", process, Cycle(1, 1))
    found = margins(gains, transfer_of(process))
    assert found is not None
    said = forecast(gains, transfer_of(process))
    assert said is None or (math.isfinite(said.overshoot) and said.overshoot < 100)


# --- `tune --plot`: the open loop with its margins, and the answers of the closed loop --------------------------------

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
    assert locus.phase_crossover == pytest.approx(-1 / margins.gain_margin, rel=1e-6)
    assert min(abs(point + 1) for point in locus.points) == abs(locus.nearest + 1)
    if math.isinf(margins.phase_margin):
        assert locus.gain_crossover is None
    else:
        assert abs(locus.gain_crossover) == pytest.approx(1)
        assert 180 - abs(math.degrees(cmath.phase(locus.gain_crossover))) == pytest.approx(margins.phase_margin)


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
    root = ET.fromstring(draw.draw_svg([chart], title="simc, PI"))  # noqa: S314 - drawn here
    texts = ["".join(node.itertext()) for node in root.iter() if node.tag.endswith("}text")]
    margins = {"Ms 1.59", "gain margin 3.14", "phase margin 61.4°"}
    assert margins | {"-1", "Kp 0.5, Ti 1 s", "real part of the open loop"} <= set(texts)
    (said,) = [node.text for node in root.iter() if node.tag.endswith("}desc")]
    assert "The open loop in the complex plane: Ms 1.59, gain margin 3.14, phase margin 61.4°." in said
    lines = [node.get("class") or "" for node in root.iter()]
    assert {"line circle ms", "line circle unit", "line locus only", "line angle"} <= set(lines)


def run_plot(*args, cwd):
    return run_text("tune", "--method", "simc", *args, cwd=cwd)


PLOT_PROCESS = ["--gain", "2", "--time-constant", "10", "--dead-time", "2"]


def test_files_and_terminal(tmp_path):
    result = run_plot(*PLOT_PROCESS, "--plot", "loop.svg", "--plot", "loop.html", "--plot", "-", cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    assert "Ms 1.59" in (tmp_path / "loop.svg").read_text("utf-8")
    page = (tmp_path / "loop.html").read_text("utf-8")
    assert page.count("<svg") == 3
    plane = page.partition('<svg class="locus"')[2].partition("</svg>")[0]
    assert "Ms 1.59" in plane
    assert 'class="line circle ms"' in plane
    assert "PV, set point +1" in result.stdout
    assert run_plot(*PLOT_PROCESS, "--plot", "loop.svg", cwd=tmp_path).returncode == 0  # the same bytes
    other = run_plot(*PLOT_PROCESS[:-1], "3", "--plot", "loop.svg", cwd=tmp_path)
    assert (other.returncode, "use --force" in other.stderr) == (2, True)


@pytest.mark.parametrize(
    ("args", "says"),
    [
        ([*PLOT_PROCESS, "--plot", "-", "--format", "json"], "would both go to standard output"),
        ([*PLOT_PROCESS, "--plot", "loop.gif"], "loop.gif"),
        ([*PLOT_PROCESS, "--plot", "a.svg", "--diff"], "--diff needs --write"),
    ],
)
def test_what_cannot_be_drawn_is_refused(tmp_path, args, says):
    result = run_plot(*args, cwd=tmp_path)
    assert says in result.stderr
    assert result.returncode == 2
    assert list(tmp_path.iterdir()) == []


def test_a_loop_whose_process_is_not_known_has_no_picture(tmp_path):
    cycle = ["--ultimate-gain", "2", "--ultimate-period", "3", "--plot", "a.svg"]
    result = run_text("tune", "--method", "zn-closed", *cycle, cwd=tmp_path)
    assert (result.returncode, list(tmp_path.iterdir())) == (2, [])
    assert "--plot needs the process: add its --gain" in result.stderr
