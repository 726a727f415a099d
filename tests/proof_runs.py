"""Runs that are truly worse than a good one: the measure of how often `simulate` calls one of them proven.

Run it with ``python tests/proof_runs.py [COUNT] [--first SEED]``. A case is a random plant (of first or second order,
or an integrator; slow and fast, with and without dead time and noise), a loop that is tuned for it by lambda in neutral
terms and converted to a vendor, a step of its set point and a disturbance. The good run has to end proven; each of
`MISTAKES` drawn for it makes another run, which is truly worse by what the PV did against the good run's set point.
"""

from __future__ import annotations

import argparse
import csv
import io
import json
import sys
from bisect import bisect_right
from collections import Counter
from copy import deepcopy
from dataclasses import dataclass
from random import Random
from typing import TYPE_CHECKING, Any

import pidcfg

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

Data = dict[str, Any]
VENDORS = ("generic", "dl06", "click", "ezlogix", "dpide", "nextopid")
DRAWN = 8
"""Mistakes of a case."""
MAX_LOSS = "gain=50%,time=50%,filter=100%"
"""A loop that a vendor's words cannot hold is no matter of this measure."""


def short(value: float, digits: int = 3) -> float:
    """A number as people write it."""
    return float(f"{value:.{digits}g}")


# --- A good run ------------------------------------------------------------------------------------------------------


@dataclass
class Process:
    """What is drawn."""

    kind: str
    time: float
    dead: float
    gain: float
    """Span of the PV for the whole output."""
    low: float
    span: float
    rises: bool
    rest: float
    """The output at rest, in %."""
    set_point: float
    step: float
    speed: float
    """Lambda as a multiple of the time constant."""
    load: float
    noise: float
    alarms: bool

    @classmethod
    def drawn(cls, r: Random) -> Process:
        """One of many."""
        time = 10 ** r.uniform(0.7, 2.7)
        low, span = r.choice([0, 0, -50, 20]), r.choice([10, 50, 100, 200, 800])
        gain, kind = r.choice([0.3, 0.6, 1, 1.5, 2.5]), r.choices(["first", "second", "integrator"], [6, 3, 2])[0]
        step = span * r.uniform(0.08, 0.2) * r.choice([1, -1])
        if kind != "integrator":
            step *= min(1.0, 0.25 * gain * span / abs(step))
        return cls(
            kind=kind,
            time=time,
            dead=time * r.choice([0, 0.05, 0.1, 0.2, 0.4, 0.8]),
            gain=gain,
            low=low,
            span=span,
            rises=r.random() < 0.75,
            rest=r.uniform(30, 65),
            set_point=low + span * r.uniform(0.3, 0.6),
            step=step,
            speed=r.uniform(0.4, 1.1),
            load=r.choice([0, 8, -10, 15]) if kind != "integrator" else r.choice([0, 10]),
            noise=r.choice([0, 0, 0, 0.0005, 0.002]),
            alarms=r.random() < 0.5,
        )


def loop_of(p: Process) -> Data:
    """A loop that is tuned for a process."""
    sample = max(0.1, min(round(p.time / 20, 1), 90))
    gain, integral = tuned(p, sample)
    loop: Data = {
        "name": "X1",
        "output_raises_pv": p.rises,
        "sample_time": sample,
        "tuning": {"gain": short(gain), "integral_time": short(integral)},
        "pv": {"range": [p.low, p.low + p.span]},
        "setpoint": {"value": short(p.set_point, 4)},
        "output": {"range": [0, 100], "unit": "%"},
    }
    if p.alarms:
        levels = {"low_low": 0.02, "low": 0.06, "high": 0.93, "high_high": 0.97}
        loop["alarms"] = {"pv": {name: p.low + share * p.span for name, share in levels.items()}}
        loop["alarms"]["hysteresis"] = short(0.01 * p.span)
    return loop


def slope(p: Process) -> float:
    """PV units for a percent of the output; of an integrator, a second."""
    size = p.span / 100 / (6 * p.time) if p.kind == "integrator" else p.gain * p.span / 100
    return size if p.rises else -size


def tuned(p: Process, sample: float) -> tuple[float, float]:
    """Gain and integral time by lambda."""
    if p.kind == "integrator":
        closed = max(2 * p.time * p.speed, 2 * (p.dead + sample))
        return (2 * closed + p.dead) / (abs(slope(p)) * (closed + p.dead) ** 2), 2 * closed + p.dead
    lag, closed = lags(p), max(p.time * p.speed, 1.2 * (p.dead + sample))
    return lag / (abs(slope(p)) * (closed + p.dead + sample / 2)), lag


def lags(p: Process) -> float:
    """The time constants."""
    return p.time * (1.5 if p.kind == "second" else 1)


def scenario_of(p: Process, loop: Data, seed: int) -> Data:
    """A step of the set point and a disturbance, each with time to settle."""
    gain = short(slope(p), 4)
    plant: Data = {"model": "first_order", "gain": gain, "time_constant": short(p.time)}
    if p.kind == "second":
        plant = {"model": "second_order", "gain": gain, "time_constants": [short(p.time), short(p.time / 2)]}
    elif p.kind == "integrator":
        plant = {"model": "integrator", "gain": gain}
    plant["initial"] = short(p.set_point, 4)
    plant["load"] = short((0 if p.kind == "integrator" else p.set_point) - gain * p.rest, 5)
    plant |= {"dead_time": short(p.dead, 2)} if p.dead else {}
    plant |= {"noise": short(p.span * p.noise)} if p.noise else {}
    sample, scale = loop["sample_time"], lags(p) + p.dead
    slow = 6 * loop["tuning"]["integral_time"] if p.kind == "integrator" else 20 * scale
    first = short(max(scale, 20 * sample), 2)
    gap = max(slow, 60 * sample)
    events: list[Data] = [{"at": first, "loop": "X1", "set": {"setpoint": short(p.set_point + p.step, 4)}}]
    if p.load:
        load = short(plant["load"] + abs(gain) * p.load, 5)
        events.append({"at": short(first + gap), "loop": "X1", "disturb": {"load": load}})
    return {
        "pidcfg": 1,
        "scenario": "A step and a disturbance",
        "config": "c.yaml",
        "duration": short(first + 2 * gap),
        "initial": "steady",
        "plants": {"X1": plant},
        "events": events,
        "seed": seed,
    }


# --- Mistakes --------------------------------------------------------------------------------------------------------


def times(section: str, key: str, factor: float) -> Callable[[Process, Data, Data], object]:
    """A number of the loop, times a factor."""
    return lambda _, loop, __: loop[section].update({key: short(loop[section][key] * factor)})


def moved(p: Process, scenario: Data, gain: float) -> None:
    """A plant with another gain, at rest at the same output."""
    plant = scenario["plants"]["X1"]
    load = plant["load"] if p.kind != "integrator" else p.rest * plant["gain"] + plant["load"]
    rest = (
        p.set_point - plant["gain"] * gain * p.rest if p.kind != "integrator" else load - plant["gain"] * gain * p.rest
    )
    plant |= {"gain": short(plant["gain"] * gain, 4), "load": short(rest, 5)}


def late_event(scenario: Data, share: float, **what: Any) -> None:
    """An event some time after the step."""
    scenario["events"].append({"at": short(scenario["events"][0]["at"] * share), "loop": "X1", **what})
    scenario["events"].sort(key=lambda event: event["at"])


MISTAKES: dict[str, Callable[[Process, Data, Data], object]] = {
    "action": lambda _, loop, __: loop.update(output_raises_pv=not loop["output_raises_pv"]),
    **{f"gain * {k}": times("tuning", "gain", k) for k in (3, 10, 30)},
    **{f"gain / {k}": times("tuning", "gain", 1 / k) for k in (5, 10, 30)},
    **{f"integral time * {k}": times("tuning", "integral_time", k) for k in (5, 10, 60)},
    **{f"integral time / {k}": times("tuning", "integral_time", 1 / k) for k in (4, 10, 60)},
    "no integral": lambda _, loop, __: loop["tuning"].update(integral_time=0),
    **{
        f"sample time * {k}": lambda _, loop, __, k=k: loop.update(sample_time=loop["sample_time"] * k)
        for k in (20, 60)
    },
    **{f"dead band {k} %": lambda p, loop, _, k=k: loop.update(deadband=short(k / 100 * p.span)) for k in (5, 12)},
    "output limited above": lambda p, loop, _: loop["output"].update(limits=[0, max(5, round(p.rest - 3))]),
    "output limited below": lambda p, loop, _: loop["output"].update(limits=[min(95, round(p.rest + 3)), 100]),
    "output too slow": lambda p, loop, _: loop["output"].update(max_rate=short(max(0.01, 2 / p.time))),
    "filter": lambda p, loop, _: loop["pv"].update(filter=short(p.time * 3)),
    "derivative": lambda p, loop, _: loop["tuning"].update(derivative_time=short(p.time * 4)),
    "set point limited": lambda p, loop, _: loop["setpoint"].update(
        limits=sorted([p.low + (0 if p.step > 0 else p.span), short(p.set_point + 0.3 * p.step, 4)])
    ),
    "manual": lambda _, loop, __: loop.update(mode="manual"),
    "dead time * 5": lambda p, _, scenario: scenario["plants"]["X1"].update(
        dead_time=short(5 * max(p.dead, 0.3 * p.time))
    ),
    "plant gain * 6": lambda p, _, scenario: moved(p, scenario, 6),
    "plant gain / 6": lambda p, _, scenario: moved(p, scenario, 1 / 6),
    "sensor stuck": lambda p, _, scenario: late_event(scenario, 1.3, pv=short(p.set_point, 4)),
    "plant lost": lambda _, __, scenario: late_event(scenario, 1.1, disturb={"gain": 0}),
    "operator": lambda _, __, scenario: late_event(scenario, 0.5, mode="manual"),
}
"""What people do wrong, and what breaks; each changes a loop or a scenario."""


# --- What a run did, and whether it was truly worse ------------------------------------------------------------------


@dataclass
class Run:
    """A run that is over."""

    times: list[float]
    pv: list[float]
    set_points: list[float]
    result: pidcfg.SimulateResult

    @property
    def loop(self) -> Any:
        """What became of the loop."""
        return self.result.report.loops["X1"]


def run(loop: Data, scenario: Data, vendor: str) -> Run | None:
    """A run of a vendor; None: the vendor cannot hold the loop, or it cannot run."""
    text: str | None = json.dumps({"pidcfg": 1, "vendor": "generic", "loops": [loop]})
    if vendor != "generic":
        text = pidcfg.convert(text or "", vendor, name="g.yaml", max_loss=MAX_LOSS).text
    if text is None:
        return None
    trend = io.StringIO()
    result = pidcfg.simulate(json.dumps(scenario), files={"c.yaml": text}, trend=trend, name="s.yaml")
    if result.report is None:
        return None
    rows = list(csv.DictReader(io.StringIO(trend.getvalue())))
    sp = "X1.SP" if "X1.SP" in rows[0] else "X1.SV"
    columns = ([float(row[key]) for row in rows] for key in ("time", "X1.PV", sp))
    return Run(*columns, result)


def truly_worse(good: Run, other: Run, p: Process) -> list[str]:
    """Why a run is truly worse than the good one, on the PV, by its alarms and its modes; nothing: it is not."""
    wanted = [good.set_points[max(0, bisect_right(good.times, t) - 1)] for t in other.times]
    errors = [abs(sp - pv) for sp, pv in zip(wanted, other.pv, strict=True)]
    before = [abs(sp - pv) for sp, pv in zip(good.set_points, good.pv, strict=True)]
    floor = 3 * p.noise * p.span
    why = []
    if tail(errors) > max(3 * tail(before), 0.02 * p.span + floor):
        why.append("offset")
    if mean(errors) > max(3 * mean(before), 0.003 * p.span):
        why.append("error")
    half = len(errors) // 2
    if swings([sp - pv for sp, pv in zip(wanted, other.pv, strict=True)][half:], 0.01 * p.span + floor):
        why.append("swing")
    if {a.alarm for a in other.loop.alarms} - {a.alarm for a in good.loop.alarms}:
        why.append("alarm")
    if {m.mode for m in other.loop.modes} - {m.mode for m in good.loop.modes}:
        why.append("mode")
    return why


def mean(values: Sequence[float]) -> float:
    """Of some values."""
    return sum(values) / len(values)


def tail(values: Sequence[float]) -> float:
    """The mean of the last tenth."""
    return mean(values[-max(1, len(values) // 10) :])


def swings(errors: Sequence[float], least: float) -> bool:
    """Whether the set point is crossed five times, and the swings hardly get smaller."""
    peaks: list[float] = []
    for error in errors:
        if abs(error) < least:
            continue
        if peaks and (error > 0) == (peaks[-1] > 0):
            peaks[-1] = max(peaks[-1], error, key=abs)
        else:
            peaks.append(error)
    return len(peaks) > 5 and abs(peaks[-1]) > 0.8 * abs(peaks[1])


# --- The measure -----------------------------------------------------------------------------------------------------


def measured(seed: int) -> Iterator[tuple[str, str, Sequence[str], Run]]:
    """The good run of a case, and each worse one: vendor, mistake (empty: none), why it is worse, and the run."""
    r = Random(seed)
    p, vendor = Process.drawn(r), VENDORS[seed % len(VENDORS)]
    loop = loop_of(p)
    scenario = scenario_of(p, loop, seed)
    good = run(loop, scenario, vendor)
    if good is None:
        return
    yield vendor, "", (), good
    for name in r.sample(sorted(MISTAKES), DRAWN) if good.result.passed else ():
        its_loop, its_scenario = deepcopy(loop), deepcopy(scenario)
        MISTAKES[name](p, its_loop, its_scenario)
        other = run(its_loop, its_scenario, vendor)
        why = [] if other is None else truly_worse(good, other, p)
        if other is not None and why:
            yield vendor, name, why, other


def main() -> None:
    """Counts, and lists what was seen wrongly."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("count", nargs="?", type=int, default=100)
    parser.add_argument("--first", type=int, default=0)
    given = parser.parse_args()
    counts: Counter[str] = Counter()
    for seed in range(given.first, given.first + given.count):
        for vendor, name, why, one in measured(seed):
            group = "worse" if name else "good"
            counts[f"{group}: {one.loop.verdict}"] += 1
            if one.result.passed == bool(name):
                counts[f"{group}, seen wrongly"] += 1
                said = f"{one.loop.verdict} {one.loop.missing[:120]}"
                sys.stdout.write(f"{seed} {vendor} {name or 'good'} ({', '.join(why)}): {said}\n")
    for what, count in sorted(counts.items()):
        sys.stdout.write(f"{count:6} {what}\n")


if __name__ == "__main__":
    main()
