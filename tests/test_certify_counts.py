"""What is made of samples once they have run: margins, counts, shares, states, and the text of a scenario."""

from __future__ import annotations

from dataclasses import replace
from hashlib import sha256
from itertools import pairwise
from math import inf
from types import SimpleNamespace

import pytest

from certify_rig import uniform
from pidcfg.pictures import Band, Line
from pidcfg.schemas.scenario import Expectation
from pidcfg.sim.controllers.plc import Axes
from pidcfg.sim.judgement.meters import METRICS
from pidcfg.sim.judgement.report import Verdict
from pidcfg.study.certification import certify as certify_module
from pidcfg.study.certification import samples as workers
from pidcfg.study.certification import tally as tally_module
from pidcfg.study.certification.certify import BatchNames, CertifyOptions, charts_of, make_certification
from pidcfg.study.certification.certify import BatchOutcome as Outcome
from pidcfg.study.certification.samples import (
    FAN_TIMES,
    Batch,
    Fan,
    SampleResult,
    ThinnedRecording,
    Trial,
    block_yaml,
    fan_of,
    margin,
    name_differences,
    trial_facts,
)
from pidcfg.study.certification.tally import BLOCK_SAMPLES, MAX_WORST_SAMPLES, Tally, json_of
from pidcfg.text.document import Document, Node, Plain
from pidcfg.text.processes import ITEMS_AHEAD
from pidcfg.text.reader import DEFAULT
from pidcfg.text.source import read_document


def wanted(**keys):
    """An expectation."""
    return Expectation.model_validate(keys)


# --- margins ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("keys", "value", "passed", "share"),
    [
        ({"signal": "A.PV", "max": 80}, 60.0, True, 0.25),
        ({"signal": "A.PV", "max": 80}, 100.0, False, -0.25),
        ({"signal": "A.PV", "min": 80}, 100.0, True, 0.25),
        ({"signal": "A.PV", "min": 80}, 60.0, False, -0.25),
        ({"signal": "A.PV", "max": -80}, -100.0, True, 0.25),
        ({"signal": "A.PV", "min": 0}, 3.0, True, 3.0),
        ({"signal": "A.PV", "min": 80, "max": 200}, [100.0, 190.0], True, 0.05),
        ({"signal": "A.PV", "min": 80, "max": 200}, [84.0, 150.0], True, 0.05),
        ({"signal": "A.PV", "final": 50, "tolerance": 2}, 49.5, True, 0.75),
        ({"signal": "A.PV", "final": 50, "tolerance": 2}, 53.0, False, -0.5),
        ({"signal": "A.PV", "final": 50, "tolerance": 2, "max": 80}, 40.0, False, -inf),
        ({"loop": "A", "metric": "overshoot", "max": "20 %"}, 15, True, 0.25),
        ({"loop": "A", "metric": "settling_time", "max": "1 min"}, None, False, -inf),
        ({"loop": "A", "metric": "settling_time", "max": "1 min"}, 45.0, True, 0.25),
        ({"loop": "A", "alarm": "pv_high", "never": True}, None, True, inf),
        ({"loop": "A", "alarm": "pv_high", "never": True}, 12.0, False, -inf),
        ({"loop": "A", "mode": "auto"}, "auto", True, inf),
        ({"loop": "A", "flag": "x"}, False, False, -inf),
        ({"loop": "A", "autotune": "done"}, True, True, inf),
        ({"loop": "A", "autotune": "gain", "max": 8}, 6.0, True, 0.25),
    ],
)
def test_a_margin_is_a_share_of_the_limit(keys, value, passed, share):
    assert margin(wanted(**keys), Verdict("", passed, value)) == pytest.approx(share)


# --- counts ----------------------------------------------------------------------------------------------------------

GAIN = uniform(0, 10)


def seen(i, number=5.0, **keys):
    """A sample that passes, but for what is said."""
    row = tuple(float(i) if name == "iae" else None for name in METRICS)
    whole = {"passed": True, "held": (True, True), "margin": 1.0, "standing": "+?", "metrics": (row,), **keys}
    return SampleResult(i, (number,), **whole)


def tally_of(samples):
    """The counts of some samples."""
    tally = Tally.empty((2, 2, 1, 1))
    for one in samples:
        tally.add_result(one, [GAIN])
    return tally


def test_samples_are_counted_in_order():
    with pytest.raises(ValueError, match="sample 1 comes after 0 samples"):
        tally_of([seen(1)])


def test_counts_of_samples():
    tally = tally_of(
        [
            seen(0, 1.0),
            seen(1, 1.9, passed=False, held=(True, False), margin=-0.5),
            seen(2, 9.0, passed=False, standing="-?", margin=-inf),
            seen(3, 8.0),
            seen(4, 5.0, passed=False, held=(), standing="", metrics=(), reason="cannot", margin=-inf),
            seen(5, 2.0),
        ]
    )
    assert (tally.samples, tally.passed, tally.failed_to_run) == (6, 3, 1)
    assert tally.held == [5, 4]
    assert (tally.standing_failed, tally.standing_judged) == ([1, 0], [5, 0])
    assert (tally.lowest, tally.highest) == ([[2, 1]], [[2, 1]])
    assert [one.sample for one in tally.worst] == [2, 4, 1, 0, 3, 5]
    assert tally.reasons == ["sample 4: cannot"]
    iae = tally.metrics[0][METRICS.index("iae")]
    assert (iae.count, iae.low, iae.high, iae.mean) == (5, 0, 5, 2.2)
    assert Tally.of_json(tally.to_json()) == tally
    assert json_of(Tally.of_json(tally.to_json()).to_json()) == json_of(tally.to_json())


def test_blocks_end_after_so_many_samples_and_worst_are_few():
    tally = tally_of([seen(i) for i in range(BLOCK_SAMPLES)])
    iae = tally.metrics[0][METRICS.index("iae")]
    assert (iae.block_total, iae.total) == (0, BLOCK_SAMPLES * (BLOCK_SAMPLES - 1) / 2)
    tally.add_result(seen(BLOCK_SAMPLES), [GAIN])
    assert iae.block_total == BLOCK_SAMPLES
    assert [one.sample for one in tally.worst] == list(range(MAX_WORST_SAMPLES))


def varied(i):
    """A sample like no other: some fail, some cannot run, some measure nothing."""
    if i % 11 == 3:
        return seen(i, passed=False, held=(), standing="", metrics=(), reason=f"cannot {i}", margin=-inf)
    row = tuple(None if (i + j) % 7 == 0 else (i * 37 % 101 - 50) / (j + 3) for j in range(len(METRICS)))
    good = i % 5 != 0
    signs = "+?" if i % 3 else "-+"
    return seen(
        i, float(i % 10), passed=good, held=(good, True), margin=(i * 13 % 17) / 3, standing=signs, metrics=(row,)
    )


@pytest.mark.parametrize("samples", [1, 16, 17, 48, 100])
def test_blocks_that_others_have_counted_add_up_to_the_same_bits(samples, monkeypatch):
    monkeypatch.setattr(tally_module, "BLOCK_SAMPLES", 16)
    whole, parts = tally_of(varied(i) for i in range(samples)), Tally.empty((2, 2, 1, 1))
    for first in range(0, samples, 16):
        block = Tally.empty((2, 2, 1, 1), first)
        for i in range(first, min(first + 16, samples)):
            block.add_result(varied(i), [GAIN])
        parts.append_block(Tally.of_json(block.to_json()))
    assert json_of(parts.to_json()) == json_of(whole.to_json())
    if samples == 17:
        for i in range(17, 40):  # a block that has begun goes on sample by sample
            whole.add_result(varied(i), [GAIN])
            parts.add_result(varied(i), [GAIN])
        assert json_of(parts.to_json()) == json_of(whole.to_json())


@pytest.mark.parametrize("first", [0, 16, 17, 48])
def test_a_block_in_another_place_is_refused(first, monkeypatch):
    monkeypatch.setattr(tally_module, "BLOCK_SAMPLES", 16)
    before = tally_of(seen(i) for i in range(32 if first != 17 else 17))
    with pytest.raises(ValueError, match=f"0 samples from {first} come after"):
        before.append_block(Tally.empty((2, 2, 1, 1), first))


def result(samples, shares=(None, 50.0), keep=3):
    """What the counts of some samples say."""
    names = BatchNames(
        "title", list(zip(("one", "two"), shares, strict=True)), [("saturated", "A"), ("oscillates", "A")], ["A"]
    )
    document = Document("x.yaml", "", {"scenario": "title"}, Node(None))
    return make_certification(names, Batch(document, [GAIN], 7), tally_of(samples), keep)


def test_all_that_is_wanted_must_be_shown():
    good = [seen(i) for i in range(10)]
    assert result(good).passed
    assert [one.bound for one in result(good).expectations] == [pytest.approx(74.1134, abs=1e-4)] * 2
    one_missed = [*good, seen(10, passed=False, held=(True, False))]
    assert result(one_missed).passed
    assert not result(one_missed, (None, 80.0)).passed
    assert not result(one_missed, (None, None)).passed
    assert not result([*good, seen(10, held=(False, True))]).passed
    assert not result([*good, seen(10, standing="-+")]).passed
    lost = result([*good, seen(10, passed=False, held=(), standing="", metrics=(), reason="x")], (50.0, 50.0))
    assert not lost.passed
    assert [one.held for one in (*lost.expectations, *lost.standing)] == [10, 10, 10, 10]
    assert all(one.passed for one in lost.expectations)
    assert [(one.judged, one.passed) for one in lost.standing] == [(10, False), (0, False)]


def test_a_sample_that_cannot_run_fails_a_batch_of_which_little_is_wanted():
    names = BatchNames("title", [("one", 50.0)], [], [])
    batch = Batch(Document("x.yaml", "", {"scenario": "t"}, Node(None)), [], 7)
    tally = Tally(samples=100, failed_to_run=1, held=[99])
    found = make_certification(names, batch, tally, 0)
    assert found.expectations[0].passed
    assert not found.passed


def test_a_certification_that_nothing_is_expected_of_fails_where_the_configuration_has_errors():
    found = result([seen(0)], (None, None))
    assert found.passed
    assert Outcome("x", certification=found).passed
    assert not Outcome("x", certification=found, lacks_expectations=True).passed
    assert not Outcome("x").passed


def test_what_matters_most_comes_first():
    many = [seen(i, 9.0 if i % 2 else 1.0, passed=i % 2 == 0) for i in range(10)]
    (effect,) = result(many).effects
    assert (effect.lowest, effect.highest, effect.size) == (100, 0, 100)
    names = BatchNames("title", [], [], [])
    tally = Tally(samples=4, lowest=[[2, 2], [2, 2], [0, 0]], highest=[[2, 2], [2, 1], [2, 1]])
    varies = [uniform(0, 1), uniform(0, 1, "load"), uniform(0, 1, "noise")]
    batch = Batch(Document("x.yaml", "", {"scenario": "t"}, Node(None)), varies, 7)
    found = make_certification(names, batch, tally, 0).effects
    assert [(e.label, e.size) for e in found] == [("TIC-1 load", 50), ("TIC-1 gain", 0), ("TIC-1 noise", 0)]
    assert found[2].lowest is None


def test_the_worst_say_what_they_miss():
    samples = [seen(0, margin=-0.5, tightest=1), seen(1, margin=-inf), seen(2, margin=0.25, tightest=0)]
    worst = result(samples, keep=2).worst
    assert [(one.sample, one.margin, one.failed, one.expectation) for one in worst] == [
        (1, None, True, ""),
        (0, -0.5, True, "two"),
    ]
    assert worst[0].numbers == {"TIC-1 gain": 5.0}
    assert result(samples, keep=3).worst[2].expectation == result(samples).expectations[0].text


def test_2000_samples_are_what_a_plan_has():
    assert CertifyOptions() == CertifyOptions(
        2000, None, 1, None, 3, record=False, state=None, save_state=None, progress=None, remark=None
    )


# --- the fan ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("steps", [1, 2, 399, 400, 401, 5000])
def test_a_thinned_run_keeps_its_ends_and_equal_distances(steps):
    thinned = ThinnedRecording(frozenset({"b"}))
    thinned.begin(["a", "b"], steps, 0.5)
    rows = [value for i in range(steps) for value in (-1.0, float(i))]
    for begin in range(0, steps, 37):
        part = rows[2 * begin : 2 * min(begin + 37, steps)]
        thinned.add_rows(part, len(part) // 2)
    kept = list(thinned.columns["b"])
    assert thinned.columns.keys() == {"b"}
    assert kept == thinned.chosen_steps
    assert (kept[0], kept[-1], len(kept)) == (0, steps - 1, min(steps, FAN_TIMES))
    gaps = {round(b - a) for a, b in pairwise(kept)}
    assert not gaps or max(gaps) - min(gaps) <= 1


def test_a_fan_has_the_values_of_the_nearest_rank():
    runs = [{"a": [float(i), 100.0 - i]} for i in range(1, 21)]
    fan = fan_of([0.0, 1.0], runs)
    assert [level[0] for level in fan.quantiles["a"]] == [1, 5, 10, 15, 19]
    assert [level[1] for level in fan.quantiles["a"]] == [80, 84, 89, 94, 98]
    assert fan_of((), []).quantiles == {}


# --- the text of a scenario ------------------------------------------------------------------------------------------


def test_a_scenario_s_data_survive_being_written():
    data = {
        "pidcfg": Plain("1"),
        "scenario": "a: b # c",
        "note": Plain("two\nlines"),
        "quoted": "12",
        "plain": Plain("max(a, 1) * [2"),
        "empty": {},
        "none": [],
        "odd key: x": Plain("- 1"),
        "list": [Plain("1"), {"a": Plain("2"), "b": [Plain("x: y"), "0.5"]}, [Plain("3"), Plain("4")]],
        "deep": {"a": {"b": {"c": Plain("±30 %")}}},
    }
    read = read_document(block_yaml(data).encode(), "x.yaml", DEFAULT)
    assert read.problems == ()
    assert read.data == data
    assert type(read.data["quoted"]) is str
    assert isinstance(read.data["plain"], Plain)
    assert isinstance(read.data["list"][0], Plain)


# --- pictures, trials, processes -------------------------------------------------------------------------------------


def test_a_fan_is_drawn_with_its_median_and_two_bands():
    levels = {name: [[base + i, base + 10.0 + i] for i in range(5)] for name, base in (("A.PV", 0), ("A.OUT", 50))}
    fan = Fan(20, [0.0, 1.0], levels)
    axes = {
        "A": Axes("A.PV", "", "A.OUT", "degC", "%", (0.0, 100.0), description="Kiln"),
        "B": Axes("A.PV", "A.OUT", ""),
    }
    outcome = Outcome("x.yaml", fan=fan, axes=axes, duration=1.0)
    first, second = charts_of(outcome)
    assert (first.title, first.loop, first.begin, first.end) == ("A: Kiln", "A", 0.0, 1.0)
    assert first.notes == ("20 samples: the line is the median, the bands hold the middle 50 % and 90 % at each time",)
    pv, out = first.panels
    assert (pv.title, pv.unit, pv.shown_range, out.title, out.unit, out.shown_range) == (
        "PV", "degC", None, "OUT", "%", (0.0, 100.0)
    )  # fmt: skip
    assert pv.lines == (Line("PV", "pv", fan.times, [2, 12]),)
    assert pv.bands == (Band("pv", fan.times, [0, 10], [4, 14]), Band("pv", fan.times, [1, 11], [3, 13]))
    assert [line.role for line in out.lines] == ["output"]
    assert (second.title, [panel.title for panel in second.panels]) == ("B", ["PV, OUT"])
    assert [line.role for line in second.panels[0].lines] == ["setpoint", "pv"]
    assert charts_of(outcome, {"B"}) == [second]
    assert charts_of(replace(outcome, fan=None)) == charts_of(replace(outcome, fan=Fan(0, (), {}))) == []


def test_a_trial_is_a_hash_of_the_first_64_samples():
    trial, longer = Trial(), Trial()
    for sample in range(70):
        trial.add_result(SampleResult(sample))
        if sample < 63:
            longer.add_result(SampleResult(sample))
    assert (trial.samples, longer.samples) == (64, 63)
    assert trial.digest != longer.digest
    longer.add_result(SampleResult(62))
    longer.add_result(SampleResult(64))
    longer.add_result(SampleResult(63))
    assert (trial.digest, trial.samples) == (longer.digest, longer.samples)
    assert trial.digest == sha256(b"".join(repr(SampleResult(sample)).encode() for sample in range(64))).hexdigest()
    trial.run_samples(None, 1000)
    assert trial_facts(None, 3)["samples"] == "AttributeError: 'NoneType' object has no attribute 'make_sampler'"


def test_what_differs_between_two_machines_is_said_shortly():
    mine = {"Python": "3.12\n(main)", "samples": "ab" * 32, "same": "x", "long": "a b" + "c" * 61}
    other = {"Python": "3.13", "samples": "cd" * 32, "same": "x"}
    assert name_differences(mine, other) == [
        "Python 3.13 and not 3.12 (main)",
        "samples cdcdcdcdcdcd… and not abababababab…",
        f"long none and not {mine['long']}",
    ]
    assert name_differences(mine, mine) == []


def crew_that_ends(ends):
    """Processes that end, each time after so many parts."""

    class Crew:
        """As `pidcfg.text.processes.Crew`."""

        def __init__(self, jobs, _work, _arguments):
            assert jobs == 3

        def results(self, parts):
            """The parts, until a process ends."""
            most = ends.pop(0) if ends else None
            for done, part in enumerate(parts):
                if done == most:
                    raise ChildProcessError
                yield list(part)

    return Crew


def test_what_an_ended_process_had_begun_is_run_again(monkeypatch):
    monkeypatch.setattr(workers, "WorkerPool", crew_that_ends([2, 1]))
    assert list(workers.process_results(None, 5, 50, 3)) == list(range(5, 50))
    ends = [2, 0]
    monkeypatch.setattr(workers, "WorkerPool", crew_that_ends(ends))
    ran = workers.process_results(None, 5, 50, 3)
    assert [next(ran) for _ in range(16)] == list(range(5, 21))
    most = min(21 + 3 * ITEMS_AHEAD * workers.SAMPLES_AT_ONCE, 50) - 1
    with pytest.raises(workers.WorkersError, match=f"a process ended at samples 21 to {most}, perhaps for want"):
        next(ran)


def test_recordings_are_those_of_the_samples_that_ran(monkeypatch):
    def recorded(sample):
        return None if sample == 1 else ([0.0, 1.0], {"a": [float(sample), sample + 0.5]})

    monkeypatch.setattr(workers, "_make_recorder", lambda _: lambda samples: [recorded(i) for i in samples])
    fan = workers.record_fan(None, 1, 3)
    assert (fan.samples, list(fan.times), fan.quantiles["a"][2]) == (1, [0.0, 1.0], [0.0, 0.5])
    assert workers.record_fan(None, 8, 3) == workers.record_fan(None, 8, 1)
    asked = []

    class Crew:
        """As `pidcfg.text.processes.Crew`."""

        def __init__(self, jobs, work, arguments):
            asked.append((jobs, arguments))
            self.work = work(*arguments)

        def results(self, parts):
            """What each part gives."""
            return map(self.work, parts)

    monkeypatch.setattr(workers, "WorkerPool", Crew)
    fan = workers.record_fan("job", 9, 3)
    assert (asked, fan.samples, fan.quantiles["a"][4]) == ([(3, ("job",))], 8, [8.0, 8.5])
    assert fan == workers.record_fan("job", 9, 1)
    assert workers.record_fan("job", 2000, 1).samples == 499
    monkeypatch.setattr(workers, "_make_recorder", lambda _: lambda samples: [None for _ in samples])
    assert workers.record_fan(None, 3, 1) == Fan(0, [], {})


@pytest.mark.parametrize(
    ("cluster", "minutes", "kept"),
    [
        (None, [0.0] * 200, [64, 128, 192, 200]),
        ("tcp://s:1", [100.0, 100.5, 100.9, 101.0, 101.5, 102.0, 102.1], [1, 4, 6, 7]),
    ],
)
def test_a_state_is_kept_now_and_then_and_at_the_end(monkeypatch, cluster, minutes, kept):
    """One process: every 64 samples; a cluster: a second after the last time."""
    states, shares, clock = [], [], [*minutes]
    monkeypatch.setattr(certify_module, "_next_results", lambda *_: ([SampleResult(i)] for i in range(len(minutes))))
    monkeypatch.setattr(certify_module, "key_of", lambda _: "key")
    monkeypatch.setattr(certify_module, "state_text", lambda progress, _: progress.tally.samples)
    monkeypatch.setattr(certify_module, "time", SimpleNamespace(monotonic=lambda: clock[min(len(shares), 7) - 1]))
    plan = CertifyOptions(len(minutes), save_state=states.append, progress=shares.append, cluster=cluster)
    tally = certify_module.run_samples(None, BatchNames("x", [], [], []), [], plan)
    assert (states, tally.samples, shares[-1]) == (kept, len(minutes), 1.0)
    assert shares[0] == 1 / len(minutes)
