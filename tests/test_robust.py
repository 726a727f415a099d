"""Robust gains: margins by another program, brute force, the virtual PLC, and what is told."""

from __future__ import annotations

import json
import math
import os
import random
from dataclasses import replace
from importlib.resources import files
from itertools import product
from types import SimpleNamespace

import pytest

import pidcfg
from pidcfg.cli.formats.tuning import tuning_text
from pidcfg.output.process import GainsFile, Robustness, Target
from pidcfg.output.retune import loop_tuning
from pidcfg.output.robust import confirm_gains, spreads_of
from pidcfg.text.reader import DEFAULT, reader_of
from pidcfg.tuning.robust import Search, Words
from pidcfg.tuning.rules import Gains, Process, TuningError, plants_of, read_spreads
from pidcfg.tuning.sampled import (
    Curve,
    SampledLoop,
    Sampling,
    absolute_error,
    allowed_gains,
    default_sample_time,
    hold_process,
    sampled_margins,
)
from pidcfg.vendors import VENDORS

PLANT = Process(2, 60, 8)
FLOATS = ("click", "nextopid", "dpide", "generic")


# --- the loop, by python-control -------------------------------------------------------------------------------------


def by_matrices(process, sample):
    """Transition, inputs now and a sample before, output row, and whole samples of delay, by matrix exponentials."""
    control = pytest.importorskip("control")
    np = pytest.importorskip("numpy")
    expm = pytest.importorskip("scipy.linalg").expm

    continuous = control.tf([process.gain], [1, 0]) if process.integrating else None
    continuous = continuous or control.tf([process.gain], [process.time_constant, 1])
    if process.second_time_constant:
        continuous *= control.tf([1], [process.second_time_constant, 1])
    space = control.tf2ss(continuous)
    n = space.A.shape[0]
    whole = np.block([[space.A, space.B], [np.zeros((1, n + 1))]])

    def moved(seconds):
        both = expm(whole * seconds)
        return both[:n, :n], both[:n, n:]

    delay = math.floor(process.dead_time / sample + 1e-9)
    late = max(0.0, process.dead_time - delay * sample)
    rest, fresh = moved(sample - late)
    return moved(sample)[0], fresh, rest @ moved(late)[1], space.C, delay


def by_control(gains, process, sampling):
    """Ms, gain margin and phase margin."""
    control = pytest.importorskip("control")
    np = pytest.importorskip("numpy")

    sample, lag = sampling.sample_time, sampling.filter_share(gains.derivative_time)
    a, now, before, row, delay = by_matrices(process, sample)
    z = control.tf([1, 0], [1], sample)
    pid = 1 + sample / gains.integral_time * z / (z - 1)
    pid += gains.derivative_time / sample * (z - 1) / z * lag * z / (z - (1 - lag))
    pid *= gains.gain * sampling.pv_share * z / (z - (1 - sampling.pv_share))
    top = math.pi / sample * (1 - 1e-9)
    low = 1e-3 / (process.time_constant + process.second_time_constant + process.dead_time + sample)
    turn = 0.04 / (process.dead_time + sample)
    w = np.union1d(np.geomspace(low, top, 1200), np.arange(turn, top, turn))
    points = np.exp(1j * w * sample)
    plants = [(row @ np.linalg.solve(p * np.eye(len(a)) - a, now + before / p))[0, 0] * p**-delay for p in points]
    values = pid(points) * np.array(plants)
    gain_margin, phase_margin, *_ = control.stability_margins(control.frd(values, w))
    return float(np.max(1 / np.abs(1 + values))), gain_margin, phase_margin


def random_loop(rng):
    constant, sample = 10 ** rng.uniform(0, 2), 10 ** rng.uniform(-1, 0.7)
    kind = rng.choice(["lag", "two", "integrator"])
    dead = sample * rng.uniform(0.2, 12)
    process = Process(10 ** rng.uniform(-1, 1), constant, dead)
    if kind == "two":
        process = Process(process.gain, constant, dead, second_time_constant=constant * rng.uniform(0.1, 1))
    if kind == "integrator":
        process = Process(process.gain / constant, 1.0, dead, integrating=True)
    delay = dead + sample + process.second_time_constant
    gain = rng.uniform(0.1, 0.8) / process.slope / delay
    rate = rng.choice([0.0, rng.uniform(0.1, 0.5) * delay])
    filters = rng.choice([{}, {"derivative_share": rng.uniform(0.2, 1)}, {"derivative_limit": rng.uniform(2, 20)}])
    sampling = Sampling(sample, rng.choice([1.0, rng.uniform(0.3, 1)]), **filters)
    return Gains(gain, delay * rng.uniform(2, 10), rate), process, sampling


def test_margins_against_python_control():
    """Ms, gain and phase margin of random sampled loops within 0.5 %; PIDCFG_LOOPS=300 for the long run."""
    rng, compared = random.Random(5), 0
    while compared < int(os.environ.get("PIDCFG_LOOPS", "10")):
        gains, process, sampling = random_loop(rng)
        plant = hold_process(process, sampling.sample_time)
        if absolute_error(gains, plant, sampling) == math.inf:
            continue
        found = sampled_margins(SampledLoop(gains, plant, sampling))
        ours = (found.ms, found.gain_margin, found.phase_margin)
        assert ours == pytest.approx(by_control(gains, process, sampling), rel=0.005), (gains, process, sampling)
        compared += 1


LOOPS = [
    (Gains(0.9, 30, 0), Process(2, 60, 8.3), Sampling(2.0)),
    (Gains(2.5, 40, 0), Process(0.02, 1, 4.6, integrating=True), Sampling(0.5)),
    (Gains(0.9, 30, 0), Process(2, 60, 8.3), Sampling(2.0, 0.5)),
    (Gains(1.4, 15, 4), Process(2, 40, 5), Sampling(1.0, 1.0, 0.6)),
    (Gains(0.6, 60, 3), Process(0.05, 1, 7.4, second_time_constant=5, integrating=True), Sampling(1.0, 1.0, 1.0, 8.0)),
]


def test_the_error_after_a_load_by_matrices():
    """The equation as the manuals print it, on the process by matrix exponentials, until nothing moves."""
    np = pytest.importorskip("numpy")

    for gains, process, sampling in LOOPS:
        sample, lag = sampling.sample_time, sampling.filter_share(gains.derivative_time)
        a, now, before, row, delay = by_matrices(process, sample)
        x, outputs, errors = np.zeros((len(a), 1)), [0.0] * (delay + 1), []
        pv = slow = total = 0.0
        for n in range(1500):
            y = float((row @ x)[0, 0])
            errors.append(abs(y))
            pv += sampling.pv_share * (y - pv)
            e, last = -pv, slow
            slow += lag * (e - slow)
            total += e * sample / gains.integral_time
            outputs.append(1 + gains.gain * (e + total + gains.derivative_time / sample * (slow - last)))
            x = a @ x + now * outputs[n + 1] + before * outputs[n]
        ours = absolute_error(gains, hold_process(process, sample), sampling)
        assert errors[-1] < 1e-5 * max(errors)
        assert ours == pytest.approx(sum(errors) * sample, rel=1e-4), process


# --- the search, by brute force --------------------------------------------------------------------------------------


def brute(plants, sampling, ms, words, rows):
    """The least largest error of all words, each on every plant."""
    best, loops = (math.inf, None), [hold_process(plant, sampling.sample_time) for plant in plants]
    for gain, (integral, derivative) in product(words, rows):
        gains = Gains(gain, integral, derivative)
        error = 0.0
        for loop in loops:
            error = max(error, absolute_error(gains, loop, sampling))
            if error >= best[0]:
                break
        if error < best[0] and all(sampled_margins(SampledLoop(gains, loop, sampling)).ms <= ms for loop in loops):
            best = (error, gains)
    return best


CASES = [  # process, loop, limit, what varies, steps of gain and time, derivative time
    (Process(2, 60, 8), Sampling(2.0), 1.6, "gain=±30%,dead-time=80%..130%", 0.06, 4.0, 0.0),
    (Process(1, 20, 3, second_time_constant=6), Sampling(2.0), 1.8, "dead-time=±20%", 0.2, 3.0, 2.0),
    (Process(0.05, 1, 4, integrating=True), Sampling(1.0), 1.7, "gain=±20%", 0.3, 6.0, 0.0),
    (Process(3, 100, 2), Sampling(1.0, 1.0, 1.0, 8.0), 2.5, "gain=±40%", 0.7, 2.0, 1.0),
    (Process(2, 60, 8), Sampling(2.0, 0.5), 2.0, "time-constant=±20%", 0.1, 4.0, 0.0),
    (Process(1, 5, 10), Sampling(2.0), 1.4, "gain=±10%", 0.03, 0.6, 0.0),
]
FINE = int(os.environ.get("PIDCFG_FINE", "1"))
"""How many times finer the grids are, for a long run of all cases: 5 makes 9,000 words of each."""


@pytest.mark.parametrize("case", range(len(CASES) if FINE > 1 else 2))
def test_the_best_of_all_words(case):
    process, sampling, ms, vary, gain_step, time_step, rate = CASES[case]
    plants = plants_of(process, read_spreads(vary, process), samples=2)
    words = Words(gain_step / FINE, 1, 20 * FINE)
    rows = [(i * time_step / FINE, rate) for i in range(1, 18 * FINE + 1)]
    search = Search(plants, sampling, ms, derivative=rate > 0)
    found = search.find_best(lambda: search.search_rows(words, rows))
    error, gains = brute(plants, sampling, ms, [i * words.step for i in range(words.last, 0, -1)], rows)
    assert gains is not None
    assert found.error == pytest.approx(error, rel=1e-9), (found.gains, gains)
    assert found.ms <= ms


def test_many_times_are_searched_like_few():
    """The first look at every so many times, and the times that are left out as too long, hide no better ones."""
    plants = plants_of(PLANT, read_spreads("gain=±30%", PLANT), samples=0)
    search, words = Search(plants, Sampling(4.0), 1.6), Words(0.02, 1, 200)
    rows = [(10 + i * 0.25, 0.0) for i in range(90)]
    whole = search.find_best(lambda: search.search_rows(words, rows))
    parts = [search.search_rows(words, rows[i : i + 30]) for i in range(0, 90, 30)]
    best = min(parts, key=lambda part: part.error)
    assert (whole.gains, whole.error) == (best.gains, best.error)
    assert best.gains.integral_time > rows[45][0]


@pytest.mark.parametrize("rates", [[0.0], [0.0, 1.5]])
def test_times_that_are_searched_in_turn_are_searched_like_each_alone(rates):
    """What was in the way at shorter times of an integrating process is no bound of the longer ones."""
    plants, words = [Process(0.02, 1, 5, integrating=True)], Words(0.05, 1, 200)
    rows = [(5.0 + i, rate) for i in range(70) for rate in rates]

    def search():
        return Search(plants, Sampling(1.0), 1.6, derivative=len(rates) > 1)

    together = search()
    whole = together.find_best(lambda: together.search_rows(words, rows))
    alone = [one for row in rows if (one := search().search_rows(words, [row]))]
    best = min(alone, key=lambda one: one.error)
    assert (whole.gains, whole.error) == (best.gains, best.error)


@pytest.mark.parametrize(
    ("process", "sample"),
    [(PLANT, 200.0), (Process(2, 60, 0.01), 0.5), (Process(0.1, 1, 1, integrating=True), 4.0)],
)
def test_a_loop_that_turns_at_half_the_sample_frequency_has_a_highest_gain(process, sample):
    """A dead time below the sample time: -180° comes by at the end only, and from there up no gain is stable."""
    plant = hold_process(process, sample)
    for time in (1.0, 10.0, 100.0, 1000.0):
        highest = allowed_gains([Curve(plant, Sampling(sample), 1.6, derivative=False)], time, 0.0)[0][1]
        assert highest < math.inf
        assert absolute_error(Gains(10 * highest, time, 0.0), plant, Sampling(sample)) == math.inf


def test_the_known_search():
    """27 plants and all words of a DL06: least Ti/Kp at Kp 0.65, Ti 26.0, worst Ms 1.599; least IAE elsewhere."""
    plants = [Process(*row) for row in product((1.4, 2, 2.6), (48, 60, 72), (6.4, 8, 10.4))]
    search = Search(plants, Sampling(1.0), 1.6)
    known = search.try_gains(Gains(0.65, 26.0, 0.0))
    assert (round(known.ms, 3), plants[known.worst_ms]) == (1.599, Process(2.6, 48, 10.4))
    found = search.find_best(lambda: search.search_rows(Words(0.01, 1, 9999), [(i / 10, 0.0) for i in range(1, 9999)]))
    assert (round(found.gains.gain, 2), found.gains.integral_time) == (0.74, 31.4)
    assert found.error < 0.965 * known.error
    assert found.ms <= 1.6


# --- the method ------------------------------------------------------------------------------------------------------


def tuned(**changes):
    numbers = {"gain": 2, "time_constant": 60, "dead_time": 8, "sample_time": 2, "vary": "gain=±30%"}
    return pidcfg.tune("robust", **{**numbers, **changes})


@pytest.fixture(scope="module")
def dl06():
    return tuned(vendor="dl06", vary="gain=±30%,dead-time=80%..130%")


def not_better(search, gains, error):
    """Whether a plant shows that gains are not allowed, or have a larger IAE."""
    if any(curve.sensitivity(gains) > search.ms for curve in search.deciding):
        return True
    return any(absolute_error(gains, curve.plant, search.sampling) >= error for curve in search.deciding)


def test_no_neighbour_is_better(dl06):
    """Words a few counts off either have a larger IAE on some plant, or an Ms above the limit."""
    search, best = dl06.robust.tuning.search, dl06.robust.tuning.result
    for up, along in product(range(-3, 4), range(-12, 13, 3)):
        gains = Gains(best.gains.gain + up / 100, best.gains.integral_time + along / 10, 0.0)
        assert (up, along) == (0, 0) or not_better(search, gains, best.error), gains


def test_what_holds_is_told(dl06):
    text, data = tuning_text(dl06), dl06.to_json()["robust"]
    assert "nothing is said of others" in text
    assert "205: the process, 4 combinations of ends, 200 samples between; gain 1.4 to 2.6" in text
    assert "the best of all words; they cost" in text
    assert "% of the PV's span" in text
    assert (data["plants"], data["every_word"], data["ms_limit"]) == (205, True, 1.6)
    assert data["worst_ms"] <= 1.6
    assert data["cost_percent"] > -0.1
    assert data["worst_iae"] == pytest.approx(dl06.robust.tuning.result.error)
    assert dl06.vendor.values[0].stored == round(dl06.vendor.values[0].wanted, 2)
    json.dumps(dl06.to_json())


def test_refining_finds_nothing_better():
    """Numbers in floating point: what is near the result and allowed has no IAE that is better by 0.1 %."""
    found = tuned(vendor="click").robust.tuning
    rng = random.Random(4)
    best = found.result
    for _ in range(60):
        reach = rng.choice([0.002, 0.01, 0.05])
        ratios = [1 + rng.uniform(-reach, reach) for _ in range(2)]
        gains = Gains(best.gains.gain * ratios[0], best.gains.integral_time * ratios[1], 0.0)
        assert not_better(found.search, gains, best.error * 0.999), gains


@pytest.mark.parametrize("vendor", VENDORS)
def test_every_vendor_gets_gains_that_it_holds(vendor):
    result = tuned(vendor=vendor, pv_range=(0, 200), vary=None)
    assert all(value.problem is None for value in result.vendor.values)
    stored = [float(value.stored) for value in result.vendor.values]
    span = {"span": 2.0}.get(VENDORS[vendor].load("tuned").gain_unit, 1.0)
    assert stored[0] / span == pytest.approx(result.gains.gain, rel=1e-12 if vendor not in FLOATS else 1e-7)
    assert stored[1] == pytest.approx(result.gains.integral_time, rel=1e-7)
    assert result.robust.tuning.result.ms <= 1.6


SLOW = {"gain": 0.5, "time_constant": 5000, "dead_time": 500, "sample_time": 99, "vary": None}


def test_a_slow_loop_of_a_dl06_has_its_reset_in_minutes():
    """The best integral time is 2000 s; in seconds the word ends at half of it, with six times the IAE."""
    found = tuned(vendor="dl06", pv_range=(0, 100), **SLOW)
    reset = found.vendor.values[1]
    assert (reset.unit, reset.problem) == ("min", None)
    assert 60 * float(reset.stored) == pytest.approx(found.gains.integral_time)
    assert 1900 < found.gains.integral_time < 2200
    assert found.robust.tuning.cost_percent < 0.1
    assert found.robust.assumptions == ()


def test_the_longest_time_that_is_tried_is_one_that_the_plc_holds():
    """The best integral time is beyond the 6000 s of a CLICK; the steps of a grid must not end behind them."""
    slow = {"gain": 0.5, "time_constant": 20000, "dead_time": 3000, "sample_time": 300, "vary": None}
    reset = tuned(vendor="click", **slow).vendor.values[1]
    assert reset.problem is None
    assert 5900 < float(reset.stored) < 6000


@pytest.mark.parametrize(
    ("integral", "unit", "said"), [(999.7, "seconds", True), (800, "seconds", False), (2000, "minutes", False)]
)
def test_a_file_s_reset_at_the_end_of_its_seconds_is_said(dl06, monkeypatch, integral, unit, said):
    """The unit of a file's loop stays, since a rule changes gains alone."""
    best = dl06.robust.tuning
    one = replace(best, result=replace(best.result, gains=Gains(1.0, integral, 0.0)))
    monkeypatch.setattr("pidcfg.output.robust.find_robust_gains", lambda *_: one)
    text = (files("pidcfg") / "cli/starters/dl06.yaml").read_text("utf-8")
    text = text.replace("rate: 2.0 ", "rate: 99 ").replace("reset_unit: seconds", f"reset_unit: {unit}")
    found = tuned(into=text.encode(), into_name="f.yaml", **SLOW)
    assert any("reset_unit: minutes" in remark for remark in found.robust.assumptions) == said


def test_pid_is_better_than_pi():
    pi, pid = (tuned(form=form, vary=None, sample_time=1) for form in ("PI", "PID"))
    assert pid.robust.tuning.result.error < 0.8 * pi.robust.tuning.result.error
    assert pid.robust.tuning.result.ms <= 1.6


@pytest.mark.parametrize(
    ("dead", "constant", "wanted"), [(8, 60, 0.5), (0.1, 1, 0.1), (20, 60, 2), (1, 500, 5), (900, 60, 20)]
)
def test_a_sample_time_that_nobody_gave(dead, constant, wanted):
    assert default_sample_time(Process(1, constant, dead)) == wanted


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"vary": "gain"}, "'gain' has no ="),
        ({"vary": "speed=±3%"}, "there is no 'speed'"),
        ({"vary": "gain=±30%,gain=±20%"}, "gain stands there twice"),
        ({"vary": "gain=30"}, "does not say how far it varies"),
        ({"vary": "gain=±100%"}, "must stay above 0"),
        ({"vary": f"gain=1..{'9' * 400}"}, "goes beyond what a number holds"),
        ({"vary": "gain=-3..-1"}, "in the direction of the process's gain"),
        ({"vary": "dead-time=9..12"}, "leaves out the process's own 8"),
        ({"vary": "dead-time=12..7"}, "does not ascend"),
        ({"vary": "second-time-constant=±10%"}, "the process has none"),
        ({"sample_time": 1e-6}, "every 0.008 s or slower"),
        ({"ms": 1.0}, "write a number from 1.1 to 3"),
        ({"ms": math.nan}, "write a number from 1.1 to 3"),
        ({"form": "P"}, "no rule for P"),
        ({"gain": None}, "needs `gain`"),
        ({"gain": None, "time_constant": None, "dead_time": None, "transfer": "1/(s+1)"}, "not `transfer`"),
    ],
)
def test_what_makes_no_sense_is_refused(changes, says):
    with pytest.raises(ValueError, match=r".") as error:
        tuned(**changes)
    assert says in str(error.value)
    assert "\n" not in str(error.value)


def test_other_methods_take_neither():
    with pytest.raises(ValueError, match="`vary` is for the method robust"):
        pidcfg.tune("simc", gain=1, time_constant=1, dead_time=1, vary="gain=±30%")


def test_a_spread_of_a_negative_gain_is_written_with_its_sign():
    assert [(s.low, s.high) for s in read_spreads("gain=-3..-1", PLANT, negative=True)] == [(1, 3)]
    assert [(s.low, s.high) for s in read_spreads("gain=±50%", PLANT, negative=True)] == [(1, 3)]


def test_plants_are_the_same_each_time():
    spreads = read_spreads("gain=±30%,dead-time=80%..130%", PLANT)
    plants = plants_of(PLANT, spreads)
    assert plants == plants_of(PLANT, spreads)
    assert len(plants) == 205
    assert {(1.4, 6.4), (1.4, 10.4), (2.6, 6.4), (2.6, 10.4)} == {(p.gain, p.dead_time) for p in plants[1:5]}
    assert all(1.4 <= p.gain <= 2.6 and 6.4 <= p.dead_time <= 10.4 for p in plants)


def test_words_that_are_too_coarse_are_said():
    with pytest.raises(TuningError, match="no word of the PLC keeps Ms below its limit"):
        tuned(gain=900, vendor="dl06", vary=None)


# --- the virtual PLC -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("vendor", ["dl06", "dpide", "generic"])
def test_the_virtual_plc_has_the_error_that_is_told(vendor):
    """A step of a tenth of the output on plants that hardly differ; the words of a DL06 add a little."""
    result = tuned(vendor=vendor, vary="gain=99.9%..100.1%", samples=2)
    done = result.robust.confirmation
    assert (done.plc, done.samples, done.held_count) == (vendor, 2, 2)
    assert done.max_iae == pytest.approx(10 * result.robust.tuning.result.error, rel=0.03)
    assert "2 of 2 samples on a virtual " + vendor in tuning_text(result)


def test_gains_that_do_worse_are_not_confirmed(dl06):
    """The limit is that of the gains which were found; a quarter of the gain has four times the error."""
    found = dl06.robust.tuning
    done = confirm_gains(found, PLANT, None, None, 2, DEFAULT)
    assert done.passed
    weak = replace(found.result, gains=replace(found.result.gains, gain=found.result.gains.gain / 4))
    lazy = confirm_gains(replace(found, result=weak), PLANT, None, None, 2, DEFAULT)
    assert lazy.max_iae > done.limit


@pytest.mark.parametrize(
    ("text", "loop"),
    [
        ("sample_rate: 2.0", {"sample_time": 2.0, "pv_share": 1.0, "derivative_limit": None}),
        ("sample_rate: 0.5\n    derivative_gain_limit: 8", {"sample_time": 0.5, "derivative_limit": 8.0}),
    ],
)
def test_the_loop_of_a_file_is_the_one_that_is_searched(text, loop):
    """Sample time and filters of the loop in the file, and what contradicts them is refused."""
    data = pidcfg_starter("dl06").replace("sample_rate: 2.0", text)
    result = tuned(vary=None, sample_time=None, into=data.encode(), into_name="oven.yaml")
    assert {key: getattr(result.robust.sampling, key) for key in loop} == loop
    assert result.written.ok
    with pytest.raises(ValueError, match="the loop samples every"):
        tuned(vary=None, sample_time=7, into=data.encode(), into_name="oven.yaml")


@pytest.mark.parametrize(
    ("vendor", "old", "new", "sampling"),
    [
        ("dl06", "unit: degC", "unit: degC\n      filter: 0.4", {"pv_share": 0.4}),
        ("dl06", "unit: degC", "unit: degC\n      filter: 0.4\n      filter_enabled: false", {"pv_share": 1.0}),
        ("click", "filter: 80", "filter: 30", {"pv_share": 0.3, "sample_time": 0.5}),
        ("dpide", "Tf: 2.0", "Tf: 3.0", {"derivative_share": 0.25, "sample_time": 1.0}),
        ("nextopid", "Tfd: 0.0", "Tfd: 0.1", {"derivative_share": 1 - math.exp(-1), "sample_time": 0.1}),
        ("generic", "filter: 0 s", "filter: 1 s", {"pv_share": 1 - math.exp(-1), "sample_time": 1.0}),
        ("ezlogix", "sample_rate: 0.5", "sample_rate: 0.7", {"sample_time": 0.7, "pv_share": 1.0}),
    ],
)
def test_every_vendor_s_filters(vendor, old, new, sampling):
    text = pidcfg_starter(vendor)
    assert old in text
    into = GainsFile(text.replace(old, new, 1).encode(), "a.yaml", None, reader_of(None))
    _, loop = loop_tuning(Target(None, None, None, into), into, DEFAULT)
    assert {key: getattr(loop, key) for key in sampling} == pytest.approx(sampling)


def pidcfg_starter(vendor):
    return (files("pidcfg") / VENDORS[vendor].starter).read_text("utf-8")


def test_a_negative_gain_is_told_with_its_sign():
    """Ends and plants; and a bound is cut off, so that it is never more than what the samples show."""
    result = tuned(gain=-2, vendor="click", samples=60, vary="gain=-3..-1,dead-time=±10%")
    text = tuning_text(result)
    assert "gain -3 to -1, dead time" in text
    assert "(gain -3, dead time 8.8 s)" in text
    assert "action reverse" in text
    assert 0.05 ** (1 / 60) < 0.9513
    assert "60 of 60 samples on a virtual click keep the IAE, so at least 95.12 % of the plants between" in text


def test_a_record_s_confidence_varies():
    """What --vary does not name varies by its confidence; a dead time that is not told from 0 stays above it."""
    fit = SimpleNamespace(confidence=(0.1, 3.0, 9.0))
    spreads = spreads_of(Robustness("gain=±50%", 1.6), PLANT, fit, negative=False)
    assert [(s.name, s.low, s.high) for s in spreads] == [
        ("gain", 1, 3),
        ("time_constant", 57, 63),
        ("dead_time", 0.08, 17),
    ]
