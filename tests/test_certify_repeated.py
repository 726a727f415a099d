"""The samples of a batch by one run that is begun again and again: each is what it is by itself, in any order."""

from __future__ import annotations

from dataclasses import fields, replace
from functools import partial
from pathlib import Path

import pytest

from certify_rig import CONFIG, loaded_of
from pidcfg.sim.engine.choice import is_installed
from pidcfg.sim.engine.repeat import IrregularError, Repeated
from pidcfg.sim.engine.run import Settings, begin_run
from pidcfg.study.certification import samples as workers
from pidcfg.study.certification.samples import Job, Sampler, Thinned, run_sample
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
    for _ in run.course():
        pass
    machine, net, plc, held = run.machine, run.net, run.plc, run.machine.reference
    groups = (machine.meters, machine.bands, machine.gauges, machine.onsets, net.plants, net.channels, plc.configs)
    groups += (plc.states, plc.aux, net.signal_values, held.plants, held.channels, held.signal_values, held.outputs)
    used = max((plant.delay + plant.length for plant in net.plants), default=0)
    found = [[values_of(record) for record in group] for group in (*groups, held.rivals)]
    return [*found, list(net.delay[:used]), list(held.delay[:used]), net.parts, run.zero]


def assert_alike(job, monkeypatch, *, alone=(), order=(3, 0, 4, 3)):
    """A sampler finds what each sample shows by itself; only those that run ``alone`` are not begun again."""
    loaded, batch = job.loaded()
    wanted = {i: run_sample(loaded, batch, i, job.settings)[0] for i in order}
    by_themselves = []
    monkeypatch.setattr(workers, "run_sample", lambda *words: by_themselves.append(words[2]) or run_sample(*words))
    sampler = Sampler(loaded, batch, job.settings)
    assert [repr(sampler.run(i)) for i in order] == [repr(wanted[i]) for i in order]
    assert by_themselves == [i for i in order if i in alone]
    first = sampler.repeated.run
    new_plc, settings = partial(batch.new_plc, loaded), replace(job.settings, told=False)
    for i in order[-2:]:
        drawn = batch.numbers(i)
        again = records_after(sampler.repeated.begin(batch.like(first.scenario, i, drawn)))
        assert again == records_after(begin_run(batch.scenario(i, drawn), new_plc, loaded.controller, settings))
    recorded, alone_recorded = Thinned(), Thinned()
    assert sampler.record(order[0], recorded)
    run_sample(loaded, batch, order[0], replace(job.settings, recording=alone_recorded))
    assert recorded.taken == alone_recorded.taken
    assert_as_new(sampler.repeated, Repeated(first.scenario, new_plc, loaded.controller, settings).plc)
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
    loaded, batch = job.loaded()
    wanted = [run_sample(loaded, batch, i, job.settings)[0] for i in range(4)]
    ran = []
    monkeypatch.setattr(workers, "run_sample", lambda *words: ran.append(words[2]) or run_sample(*words))
    sampler = Sampler(loaded, batch, job.settings)
    assert [repr(sampler.run(i)) for i in range(4)] == [repr(one) for one in wanted]
    assert ran == sorted(alone)
    assert [sampler.record(i, Thinned()) for i in range(4)] == [not one.reason for one in wanted]


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
    repeated = Repeated(known.scenario, known.plc, known.controller, Settings("python", told=False))
    repeated.begin(known.scenario)
    with pytest.raises(IrregularError):
        repeated.begin(other.scenario)
    repeated.begin(known.scenario)


def test_a_plant_that_loses_its_gain_moves_nothing_any_more():
    known, other = (
        loaded_of(f"{HEAD}plants: {{{LAG.replace('gain: 2', f'gain: {gain}')}}}\n", AUTO) for gain in (2, 0)
    )
    repeated = Repeated(known.scenario, known.plc, known.controller, Settings("python", told=False))
    driven = [repeated.begin(one.scenario).agenda.influence.driven for one in (known, other, known)]
    assert driven == [[True], [False], [True]]
