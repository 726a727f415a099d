"""What a batch rests on: samples that are what they are by themselves, random numbers by counters, the bound."""

from __future__ import annotations

import random
from dataclasses import fields, replace
from fractions import Fraction
from functools import partial
from hashlib import sha256
from math import comb, inf, log, nextafter
from pathlib import Path
from statistics import NormalDist, fmean

import pytest

from certify_bound import SHARE, held_by
from certify_rig import CONFIG, loaded_of, normal, uniform
from pidcfg.sim.engine.choice import is_installed
from pidcfg.sim.engine.repeat import IrregularError, RepeatedRun
from pidcfg.sim.engine.run import Settings, begin_run
from pidcfg.study.certification import samples as workers
from pidcfg.study.certification.certify import BOUND_RISK, log_tail, lower_bound, samples_needed
from pidcfg.study.certification.samples import (
    GOLDEN_STEP,
    DrawError,
    Job,
    Sampler,
    ThinnedRecording,
    bits_of,
    draw_number,
    fifth_bounds,
    mix_bits,
    run_sample,
    seed_of,
    unit_number,
)
from pidcfg.study.certification.tally import BLOCK_SAMPLES, Distribution, bin_of, upper_edge
from pidcfg.text.reader import DEFAULT
from pidcfg.text.source import read_document

EXAMPLES = Path(__file__).parents[1] / "examples"
ENGINE = "numba" if is_installed() else "python"


def job_of(text, config, engine="python", name="run.scenario.yaml"):
    """A batch of a scenario's text and its configuration's."""
    return Job(name, text, "loop.yaml", config.encode(), 7, engine, DEFAULT)


def example_job(path):
    """A batch of an example: with its own ``vary``, or one of all gains, dead times and noises."""
    text = path.read_text("utf-8")
    document = read_document(text.encode(), path.name, DEFAULT)
    if "vary" not in document.data:
        plants = document.data["plants"]
        rows = plants.items() if isinstance(plants, dict) else ((plant["name"], plant) for plant in plants)
        spreads = "dead_time: {uniform: [0, 3]}, noise: {uniform: [0.01, 0.02]}"
        varied = (
            f"{name}: {{{'gain: ±10 %, ' * ('gain' in row)}{spreads}}}"
            for name, row in rows
            if row["model"] != "pulses"
        )
        text += "\nvary:\n  plants:\n" + "".join(f"    {row}\n" for row in varied)
    config = path.with_name(str(document.data["config"])).read_text("utf-8")
    return job_of(text, config, ENGINE, path.name)


def assert_as_new(repeated, new):
    """The PLC of the last sample goes back to its program-to-run transition."""
    repeated._renew_plc()
    plc, names = repeated.plc, [name for name in vars(new) if name not in {"configs", "states", "aux"}]
    for one, other in zip((*plc.configs, *plc.states), (*new.configs, *new.states), strict=True):
        assert [getattr(one, f.name) for f in fields(other)] == [getattr(other, f.name) for f in fields(other)]
    assert list(plc.aux) == list(new.aux)
    assert {name: repr(vars(plc)[name]) for name in names} == {name: repr(vars(new)[name]) for name in names}


def values_of(record):
    """The fields of a record, or a number."""
    return [getattr(record, f.name) for f in fields(record)] if hasattr(record, "__dataclass_fields__") else record


def records_after(run):
    """Everything that the kernels have left behind, with lines of delay as long as they are used."""
    for _ in run.steps_to_end():
        pass
    machine, net, plc, held = run.machine, run.net, run.plc, run.machine.reference
    groups = (machine.meters, machine.bands, machine.gauges, machine.onsets, net.plants, net.channels, plc.configs)
    groups += (plc.states, plc.aux, net.signal_values, held.plants, held.channels, held.signal_values, held.outputs)
    used = max((plant.delay + plant.length for plant in net.plants), default=0)
    found = [[values_of(record) for record in group] for group in (*groups, held.benefits)]
    return [*found, list(net.delay[:used]), list(held.delay[:used]), net.parts, run.start_step]


def assert_alike(job, monkeypatch, *, alone=(), order=(3, 0, 4, 3)):
    """A sampler finds what each sample shows by itself; only those that run ``alone`` are not begun again."""
    loaded, batch = job.load_batch()
    wanted = {i: run_sample(loaded, batch, i, job.settings)[0] for i in order}
    by_themselves = []
    monkeypatch.setattr(workers, "run_sample", lambda *words: by_themselves.append(words[2]) or run_sample(*words))
    sampler = Sampler(loaded, batch, job.settings)
    assert [repr(sampler.run_sample(i)) for i in order] == [repr(wanted[i]) for i in order]
    assert by_themselves == [i for i in order if i in alone]
    first = sampler.repeated_run.run
    new_plc, settings = partial(batch.new_plc, loaded), replace(job.settings, with_report=False)
    for i in order[-2:]:
        drawn = batch.draw_numbers(i)
        again = records_after(sampler.repeated_run.begin(batch.repeat_scenario(first.scenario, i, drawn)))
        assert again == records_after(begin_run(batch.make_scenario(i, drawn), new_plc, loaded.controller, settings))
    recorded, alone_recorded = ThinnedRecording(), ThinnedRecording()
    assert sampler.record_sample(order[0], recorded)
    run_sample(loaded, batch, order[0], replace(job.settings, recording=alone_recorded))
    assert recorded.columns == alone_recorded.columns
    assert_as_new(sampler.repeated_run, RepeatedRun(first.scenario, new_plc, loaded.controller, settings).plc)
    return [wanted[i] for i in order]


@pytest.mark.parametrize(
    "path", sorted(EXAMPLES.glob("*/*.scenario.yaml")), ids=lambda path: path.parent.name + "-" + path.name
)
def test_samples_of_an_example_are_what_they_are_by_themselves(path, monkeypatch):
    seen = assert_alike(example_job(path), monkeypatch)
    assert len({one.metrics for one in seen}) > 1


HEAD = "pidcfg: 1\nscenario: One\nconfig: loop.yaml\nduration: 200\nseed: 2\n"
LAG = "TIC-1: {model: first_order, gain: 2, time_constant: 20, load: 3, initial: 40}"
AUTO = CONFIG.replace("mode: manual", "mode: auto").replace(", manual: 50", "")
EVERYTHING = f"""plants: {{{LAG}}}
signals: {{feed: 1}}
vary:
  plants: {{TIC-1: {{gain: ±20 %, noise: {{uniform: [0.1, 0.3]}}, dead_time: {{uniform: [0, 9]}}, initial: ±10 %}}}}
  loops: {{TIC-1: {{tuning.gain: ±20 %}}}}
events:
  - {{at: 10, loop: TIC-1, set: {{setpoint: 70}}}}
  - {{at: 30, loop: TIC-1, disturb: {{gain: 0}}}}
  - {{at: 40, loop: TIC-1, disturb: {{gain: 2.2, noise: 0.5}}}}
  - {{at: 60, loop: TIC-1, pv: 0, for: 8}}
  - {{at: 80, loop: TIC-1, mode: manual}}
  - {{at: 80, loop: TIC-1, set: {{output: 20}}}}
  - {{at: 100, loop: TIC-1, mode: auto}}
  - {{at: 120, set: {{feed: 2}}}}
  - {{at: 150, loop: TIC-1, pv: 90}}
expect:
  - {{loop: TIC-1, metric: iae, max: 1000, share: 50 %}}
  - {{loop: TIC-1, metric: settling_time, band: 10 %, max: 40}}
  - {{signal: TIC-1.PV, min: 0, max: 80, from: 20, until: 90}}
  - {{signal: TIC-1.PV, final: 70, tolerance: 5}}
  - {{loop: TIC-1, mode: manual, at: 90}}
  - {{loop: TIC-1, mode: auto}}
"""
AT_REST = f"""initial: steady
plants: {{{LAG}}}
vary: {{plants: {{TIC-1: {{gain: ±20 %, time_constant: ±50 %}}}}}}
events: [{{at: 20, loop: TIC-1, set: {{setpoint: 60}}}}]
"""
NO_REST = """initial: steady
plants: {TIC-1: {model: first_order, gain: 2, time_constant: 20, dead_time: 9}}
vary: {plants: {TIC-1: {gain: ±20 %}}}
"""
WITH_OUTPUTS = f"""initial: {{TIC-1: 30}}
plants: {{{LAG}}}
vary: {{plants: {{TIC-1: {{load: ±20 %}}}}}}
events: [{{at: 50, loop: TIC-1, set: {{output: 30}}}}]
"""
IN_A_RING = """plants:
  - {name: jacket, model: first_order, gain: 2, time_constant: 5, input: "TIC-1.OUT + 0.1 * vessel"}
  - {name: vessel, model: second_order, time_constants: [9, 30], input: jacket / 1.5, noise: 0.1}
connect: {TIC-1.PV: max(vessel, 3) * 1.5}
vary:
  plants:
    jacket: {time_constant: {uniform: [0.2, 2]}, dead_time: {uniform: [0, 40]}}
    vessel: {time_constants.1: ±50 %, gain: ±10 %}
"""
WRONG_ACTION = """plants: {TIC-1: {model: first_order, gain: 0.1, time_constant: 20, load: 30}}
vary: {plants: {TIC-1: {gain: {uniform: [-0.2, 0.2]}}}}
"""
IDLE_PLANT = f"""plants: {{{LAG}}}
vary: {{plants: {{TIC-1: {{gain: {{uniform: [1.999999999, 2.000000001]}}}}}}}}
events: [{{at: 199, loop: TIC-1, disturb: {{gain: 2}}}}]
"""
IDLE_LOOP = f"""plants: {{{LAG}}}
vary: {{loops: {{TIC-1: {{tuning.gain: {{uniform: [2.499999999, 2.500000001]}}}}}}}}
events: [{{at: 199, loop: TIC-1, set: {{tuning.gain: 2.5}}}}]
"""
IDLE_IN_ALL = f"""plants: {{{LAG}}}
vary: {{plants: {{TIC-1: {{gain: ±1 %}}}}}}
events: [{{at: 199, loop: TIC-1, set: {{tuning.gain: 2.5}}}}]
"""
WEIGHED = """plants:
  TIC-1: {model: first_order, gain: 2, time_constant: 20, load: 3, input: "TIC-1.OUT * max(TIC-1.gain - 2, 0)"}
vary: {plants: {TIC-1: {gain: ±20 %}}}
"""
DIVISION = """signals: {by: 1}
plants: {TIC-1: {model: first_order, gain: 2, time_constant: 20, input: TIC-1.OUT / by}}
vary: {plants: {TIC-1: {gain: ±20 %}}}
events: [{at: 50, set: {by: 0}}, {at: 60, set: {by: 2}}]
"""
IN_TURN = f"""plants: {{{LAG}}}
vary: {{plants: {{TIC-1: {{gain: ±20 %}}}}}}
events:
  - {{at: 10, loop: TIC-1, set: {{setpoint: 60}}}}
  - {{at: 20, loop: TIC-1, set: {{tuning.integral_time: 1 min}}}}
  - {{at: 50, loop: TIC-1, set: {{tuning.gain: 9}}}}
"""
CASES = {
    # name: configuration, the rest of the scenario
    "every event": (AUTO, EVERYTHING),
    "a start at rest": (AUTO, AT_REST),
    "no rest": (AUTO.replace("gain: 2.5", "gain: 40"), NO_REST),
    "outputs at the start": (CONFIG, WITH_OUTPUTS),
    "plants that read each other": (AUTO, IN_A_RING),
    "a wrong action in some": (AUTO, WRONG_ACTION),
    "a disturbance that changes nothing in some": (AUTO, IDLE_PLANT),
    "a parameter that is already so in some": (AUTO, IDLE_LOOP),
    "a parameter that is already so in all": (AUTO, IDLE_IN_ALL),
    "a division by nothing": (AUTO, DIVISION),
    "an output that moves the PV in some": (AUTO, WEIGHED),
    "parameters that are written in turn": (AUTO, IN_TURN),
}


@pytest.mark.parametrize("engine", ["python", ENGINE] if ENGINE != "python" else ["python"])
@pytest.mark.parametrize("name", CASES)
def test_nothing_of_a_sample_is_left_for_the_next_one(name, engine, monkeypatch):
    config, rest = CASES[name]
    seen = assert_alike(job_of(HEAD + rest, config, engine), monkeypatch, order=(2, 0, 1, 2, 3, 4, 0))
    if "changes nothing in some" in name or "so in some" in name:
        assert len({one.standing for one in seen}) == 2
    if name in {"no rest", "a wrong action in some", "a division by nothing"}:
        assert any(one.reason for one in seen)


ALONE = {
    # name: the scenario, samples that are not begun again
    "a value that the PLC does not take": ("loops: {TIC-1: {tuning.gain: {normal: [2, 90]}}}", {0, 1, 3}),
    "a number that is never drawn": ("plants: {TIC-1: {gain: {normal: [1, 1], limits: [90, 91]}}}", {0, 1, 2, 3}),
}


@pytest.mark.parametrize("name", ALONE)
def test_what_changes_more_than_numbers_runs_by_itself(name, monkeypatch):
    vary, alone = ALONE[name]
    job = job_of(f"{HEAD}plants: {{{LAG}}}\nvary: {{{vary}}}\n", AUTO)
    loaded, batch = job.load_batch()
    wanted = [run_sample(loaded, batch, i, job.settings)[0] for i in range(4)]
    ran = []
    monkeypatch.setattr(workers, "run_sample", lambda *words: ran.append(words[2]) or run_sample(*words))
    sampler = Sampler(loaded, batch, job.settings)
    assert [repr(sampler.run_sample(i)) for i in range(4)] == [repr(one) for one in wanted]
    assert ran == sorted(alone)
    assert [sampler.record_sample(i, ThinnedRecording()) for i in range(4)] == [not one.reason for one in wanted]


CHANGED = {
    # name: the scenario, another one
    "an event more": ("", "events: [{at: 50, loop: TIC-1, set: {setpoint: 60}}]"),
    "an event of another kind": (
        "events: [{at: 0, loop: TIC-1, set: {setpoint: 60}}]",
        "events: [{at: 0, loop: TIC-1, mode: manual}]",
    ),
    "a sample time": (
        "events: [{at: 0, loop: TIC-1, set: {sample_time: 1 s}}]",
        "events: [{at: 0, loop: TIC-1, set: {sample_time: 2 s}}]",
    ),
    "noise where there was none": ("", "noise: 0.1"),
    "no noise where there was some": ("noise: 0.1", ""),
    "a number that is refused": ("", "time_constant: 0"),
    "a dead time that is too long": ("", "dead_time: 2000000"),
}


@pytest.mark.parametrize("name", CHANGED)
def test_a_run_is_not_begun_again_for_more_than_numbers(name):
    rest = [
        f"plants: {{{LAG}}}\n{one}" if "events" in one else f"plants: {{{LAG[:-1]}, {one}}}}}" for one in CHANGED[name]
    ]
    known, other = (
        loaded_of(HEAD + one.replace("time_constant: 20, load: 3, initial: 40, time", "time"), AUTO) for one in rest
    )
    repeated = RepeatedRun(known.scenario, known.new_plc, known.controller, Settings("python", with_report=False))
    repeated.begin(known.scenario)
    with pytest.raises(IrregularError):
        repeated.begin(other.scenario)
    repeated.begin(known.scenario)


def test_a_plant_that_loses_its_gain_moves_nothing_any_more():
    known, other = (
        loaded_of(f"{HEAD}plants: {{{LAG.replace('gain: 2', f'gain: {gain}')}}}\n", AUTO) for gain in (2, 0)
    )
    repeated = RepeatedRun(known.scenario, known.new_plc, known.controller, Settings("python", with_report=False))
    driven = [repeated.begin(one.scenario).agenda.influence.is_driven for one in (known, other, known)]
    assert driven == [[True], [False], [True]]


# --- Random numbers by counters, the bound, and counting: what a batch rests on, without a run ------------------------


# --- draws -----------------------------------------------------------------------------------------------------------


def test_the_numbers_are_those_of_splitmix64():
    published = [
        6457827717110365317,
        3203168211198807973,
        9817491932198370423,
        4593380528125082431,
        16408922859458223821,
    ]
    assert [mix_bits(1234567 + (i + 1) * GOLDEN_STEP) for i in range(5)] == published
    assert [bits_of(1234567, i) for i in range(5)] == published
    assert seed_of(1234567, 0) == published[0] >> 1 < 1 << 63


def test_a_number_depends_on_seed_sample_and_name_alone():
    numbers = {unit_number(seed, i, row, k) for seed in (1, 2) for i in range(50) for row in ("a", "b") for k in (0, 1)}
    assert len(numbers) == 2 * 50 * 2 * 2
    assert all(0 < number < 1 for number in numbers)
    assert (
        draw_number(uniform(1, 2), 7, 5) == draw_number(uniform(1, 2), 7, 5) != draw_number(uniform(1, 2, "load"), 7, 5)
    )


def test_a_row_begins_at_the_bits_of_its_sample_and_its_name():
    bits = int.from_bytes(sha256(b"plants.TIC-1.gain").digest()[:8], "big")
    begin = mix_bits(bits_of(7, 3) ^ bits)
    for draw in range(3):
        number = mix_bits(begin + (draw + 1) * GOLDEN_STEP) >> 11
        assert unit_number(7, 3, "plants.TIC-1.gain", draw) == (number + 0.5) / 2**53


def test_a_negative_and_a_large_seed_are_seeds():
    assert len({bits_of(seed, 0) for seed in (-1, 0, 1, 1 << 63, (1 << 64) - 2)}) == 5


def test_a_uniform_number_covers_its_range_evenly():
    values = [draw_number(uniform(40, 90), 1, i) for i in range(4000)]
    assert 40 <= min(values) < 40.1
    assert 89.9 < max(values) <= 90
    counts = [sum(low <= value < low + 10 for value in values) for low in range(40, 90, 10)]
    assert all(700 < count < 900 for count in counts)


def test_a_normal_number_has_its_mean_and_deviation():
    values = [draw_number(normal(8, 2), 3, i) for i in range(4000)]
    found = NormalDist.from_samples(values)
    assert abs(found.mean - 8) < 0.12
    assert abs(found.stdev - 2) < 0.1


def test_limits_draw_again_from_the_same_row():
    wide, narrow = normal(8, 2), normal(8, 2, 7, 9)
    rows = [[unit_number(1, i, wide.random_stream, k) for k in range(100)] for i in range(300)]
    inside = [next(v for v in (8 + 2 * NormalDist().inv_cdf(u) for u in row) if 7 <= v <= 9) for row in rows]
    assert [draw_number(narrow, 1, i) for i in range(300)] == inside
    assert any(draw_number(wide, 1, i) != inside[i] for i in range(300))


def test_a_hundred_numbers_without_one_within_the_limits_are_enough():
    with pytest.raises(DrawError, match=r"TIC-1 gain: 100 numbers, none within 30 to 31"):
        draw_number(normal(8, 2, 30, 31), 1, 0)
    first = next(
        i for i in range(500) if not 12 <= 8 + 2 * NormalDist().inv_cdf(unit_number(1, i, "plants.TIC-1.gain")) <= 99
    )
    assert 12 <= draw_number(normal(8, 2, 12, 99), 1, first) <= 99


@pytest.mark.parametrize("what", [uniform(40, 90), normal(8, 2), normal(8, 2, 4, 9), normal(8, 2, 9, inf)])
def test_a_fifth_of_the_samples_lies_in_each_outer_fifth(what):
    low, high = fifth_bounds(what.spread)
    values = [draw_number(what, 5, i) for i in range(3000)]
    assert abs(fmean(value < low for value in values) - 0.2) < 0.03
    assert abs(fmean(value >= high for value in values) - 0.2) < 0.03


# --- the bound -------------------------------------------------------------------------------------------------------


def tail(passed, samples, share):
    """The probability that at least so many pass, in fractions."""
    p = Fraction(share)
    return sum(comb(samples, k) * p**k * (1 - p) ** (samples - k) for k in range(passed, samples + 1))


@pytest.mark.parametrize(("passed", "samples"), [(1, 1), (1, 7), (59, 59), (58, 60), (3, 30), (99, 100), (150, 300)])
def test_the_bound_is_where_the_exact_tail_is_the_risk(passed, samples):
    bound = lower_bound(passed, samples)
    assert abs(float(tail(passed, samples, bound)) / BOUND_RISK - 1) < 1e-10
    assert log_tail(passed, samples, bound) < log(BOUND_RISK) <= log_tail(passed, samples, nextafter(bound, 1))
    assert tail(passed, samples, bound * (1 - 1e-9)) < BOUND_RISK < tail(passed, samples, bound * (1 + 1e-9))


def test_the_bound_in_special_cases():
    assert lower_bound(0, 100) == 0
    assert lower_bound(100, 100) == pytest.approx(0.05 ** (1 / 100), rel=1e-12)
    assert lower_bound(2000, 2000) == pytest.approx(0.998503, abs=1e-6)
    assert lower_bound(1_000_000, 1_000_000) < 1
    half = lower_bound(500_000, 1_000_000)
    assert half == pytest.approx(0.5 - 1.6449 * 0.0005, abs=2e-6)
    assert log_tail(500_000, 1_000_000, half) < log_tail(500_000, 1_000_000, nextafter(half, 1))


def test_how_many_samples_show_a_share():
    assert [samples_needed(share) for share in (0.99, 0.999, 0.95, 0.5, 0.04)] == [299, 2995, 59, 5, 1]
    for share in (0.5, 0.9, 0.99, 0.999, 0.9999):
        needed = samples_needed(share)
        assert lower_bound(needed, needed) >= share
        assert needed == 1 or lower_bound(needed - 1, needed - 1) < share


def test_the_bound_lies_below_a_share_in_closed_form_at_least_as_often_as_it_says():
    """PV = 50 gain is at most 120 where the gain is at most 2.4: 5 of 6 of 1.4 to 2.6; 200 seeds of 100 samples."""
    share, below = (2.4 - 1.4) / (2.6 - 1.4), 0
    for seed in range(200):
        passed = sum(50 * draw_number(uniform(1.4, 2.6), seed, i) <= 120 for i in range(100))
        below += lower_bound(passed, 100) <= share
    assert 180 <= below < 200


def test_batches_that_run_count_what_is_drawn():
    """The same plants through `tests/certify_bound.py`, which runs them: 3 seeds of 40 samples."""
    for seed in range(3):
        drawn_ones = sum(50 * draw_number(uniform(1.4, 2.6), seed, i) <= 120 for i in range(40))
        assert held_by(seed, 40) == drawn_ones
    assert abs(SHARE - 5 / 6) < 1e-15


# --- counting --------------------------------------------------------------------------------------------------------


def test_a_bin_is_sign_exponent_and_eight_bits():
    assert bin_of(1.0) == bin_of(1 + 1 / 257) != bin_of(1 + 1 / 256)
    assert bin_of(-1.0) == bin_of(1.0) + (1 << 19)
    assert upper_edge(bin_of(1.0)) == 1 + 1 / 256
    assert upper_edge(bin_of(-1.0)) == -1.0
    assert upper_edge(bin_of(-1.001)) == -1.0
    assert upper_edge(bin_of(0.0)) == upper_edge(bin_of(-0.0)) == upper_edge(bin_of(1e-310)) == 0.0
    assert (bin_of(1.5 * 2.0**-1023), bin_of(2.0**-1022)) == (0, 1 << 8)


def test_an_edge_is_at_most_a_bin_above_its_number():
    source = random.Random(1)
    for _ in range(2000):
        value = source.uniform(-1, 1) * 10 ** source.uniform(-12, 12)
        assert value <= upper_edge(bin_of(value)) <= value + abs(value) / 256


def filled(values):
    """A distribution of numbers, a sample each."""
    found = Distribution()
    for i, value in enumerate(values, 1):
        found.add_number(value)
        if i % BLOCK_SAMPLES == 0:
            found.end_block()
    return found


def test_quantiles_are_edges_of_the_bins_in_which_they_lie():
    values = [float(i) for i in range(-500, 501)]
    found = filled(values)
    assert (found.count, found.low, found.high, found.mean) == (1001, -500, 500, 0)
    for share, exact in ((0.0, -500), (0.05, -450), (0.5, 0), (0.95, 450), (1.0, 500)):
        assert exact <= found.quantile(share) <= exact + abs(exact) / 256
    with pytest.raises(ValueError, match="nothing was measured"):
        Distribution().quantile(0.5)


def test_the_mean_is_a_sum_over_blocks():
    source = random.Random(2)
    values = [source.uniform(0, 1e6) for _ in range(3 * BLOCK_SAMPLES + 17)]
    total = 0.0
    for begin in range(0, len(values), BLOCK_SAMPLES):
        part = 0.0
        for value in values[begin : begin + BLOCK_SAMPLES]:
            part += value
        total += part
    assert filled(values).mean == total / len(values)
    assert total != sum(values)


def test_a_distribution_goes_on_from_its_state():
    source = random.Random(3)
    values = [source.gauss(0, 5) for _ in range(BLOCK_SAMPLES + 300)]
    first = Distribution.of_json(filled(values[:200]).to_json())
    for i, value in enumerate(values[200:], 201):
        first.add_number(value)
        if i % BLOCK_SAMPLES == 0:
            first.end_block()
    assert first == filled(values)
