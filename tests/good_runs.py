"""Runs in which control happens as it should: the measure of how often `simulate` cries wolf.

Run it with ``python tests/good_runs.py [COUNT] [--first SEED]``: so many runs of each vendor, of which none may fail
by a standing expectation. A run is a random process whose output can hold the set point with room to spare, a loop that
is tuned for it by a rule of the textbooks, written in neutral terms and converted to the vendor, and a random course:
short and long runs, cold starts, steps and ramps of the set point, disturbances early and late, operators who take the
loop to Manual and back, sensors that break and are repaired, noise, pulses, cascades, a deadband, no integral.
"""

from __future__ import annotations

import argparse
import json
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from random import Random
from typing import TYPE_CHECKING, Any

from ruamel.yaml import YAML

import pidcfg

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

Data = dict[str, Any]

PULSES = {"generic": "{}.PULSE", "click": "{}.PWM", "ezlogix": "{}.O", "nextopid": "{}_PWM.PWM"}
"""The signal of a loop's pulses, 0 or 1."""
CASCADES = ("generic", "dl06", "nextopid")
"""Vendors that have them without a program around."""
VENDORS = ("dl06", "click", "ezlogix", "nextopid", "dpide", "generic")
MOST_STEPS, MOST_PULSED = 5000, 1000
"""Samples of a run, and of one with pulses, of which a hundredth is a base step."""
STIFF = 6.0
"""The gain around a loop that has no integral: its offset stays small."""
RUSH = 25.0
"""Of the span in %, how far half the output may drive the PV within the delay: a faster process starts at rest."""
PUSH = 20.0
"""Of the span in %, the most that a disturbance moves a PV without control (an integrator: in the loop's time)."""
LEAST_RATE = 5
"""Samples of a derivative time: a shorter one has no effect."""
INNER = 8
"""Samples that an inner loop delays its master by."""
STEADIEST = 25.0
"""The highest gain around a loop, in % per %: beyond it noise and rounding move the output to and fro."""


@dataclass(frozen=True)
class Process:
    """What a loop controls: % of the PV's span per % of the output (an integrator: per s), times in s."""

    gain: float
    lag: float
    second: float
    """Another lag behind it; 0: none."""
    dead_time: float
    integrates: bool
    raises: bool

    @property
    def per_s(self) -> float:
        """How fast the PV begins to move."""
        return self.gain if self.integrates else self.gain / self.lag

    @property
    def delay(self) -> float:
        """What a tuning takes for dead time."""
        return self.dead_time + self.second


@dataclass(frozen=True)
class Course:
    """One run: files as data."""

    name: str
    vendor: str
    config: Data
    scenario: Data


def draw(rng: Random, sample: float, *, cascade: bool) -> Process:
    """A process that suits a sample time; one behind an inner loop is slow."""
    lag = sample * 10 ** rng.uniform(2.0 if cascade else 0.9, 2.3)
    dead_time = rng.choice((0.0, rng.uniform(0.02, 0.5))) * lag
    if rng.random() < 0.2:
        gain = rng.uniform(0.5, 2.0) / lag
        return Process(gain, lag, 0.0, min(dead_time, 0.2 * lag), True, rng.random() < 0.7)
    second = rng.choice((0.0, 0.0, 0.1, 0.3)) * lag
    return Process(rng.uniform(0.9, 2.5), lag, second, dead_time, False, rng.random() < 0.7)


def tuned(rng: Random, process: Process, behind: float) -> tuple[float, float, float, float]:
    """Gain in % per %, integral and derivative time, and the time in which the closed loop answers (Skogestad).

    ``behind``: what else delays it.
    """
    delay = process.delay + behind
    closed = max(rng.uniform(1.0, 3.0) * delay, 0.0 if process.integrates else rng.uniform(0.15, 1.2) * process.lag)
    closed = max(closed, 1 / (process.per_s * STEADIEST) - delay)
    gain = 1 / (process.per_s * (closed + delay))
    reset = 4 * (closed + delay) if process.integrates else min(process.lag, 4 * (closed + delay))
    rate = rng.choice((0.0, 0.0, min(0.3 * delay, 0.1 * reset)))
    return gain, reset, rate, closed + delay


class Drawer:
    """Draws one run; its parts are filled in one after the other."""

    def __init__(self, seed: int, vendor: str) -> None:
        self.rng = rng = Random(f"{seed}/{vendor}")
        self.vendor = vendor
        self.sample = rng.choice((0.1, 0.2, 0.5, 1.0, 2.0))
        self.cascade = vendor in CASCADES and rng.random() < 0.25
        self.process = draw(rng, self.sample, cascade=self.cascade)
        self.low = rng.choice((0.0, 0.0, -20.0, 50.0))
        self.span = rng.choice((1.0, 10.0, 100.0, 150.0, 400.0, 1200.0))
        self.stroke = rng.choice((100.0, 100.0, 50.0))
        self.at = round(rng.uniform(0.3, 0.7), 3)
        self.output = rng.uniform(30, 60)
        behind = INNER * self.sample if self.cascade else self.sample
        self.gain, self.reset, self.rate, self.answer = tuned(rng, self.process, behind)
        stiff = self.process.integrates or self.gain * self.process.gain >= STIFF
        self.integral = not stiff or self.cascade or rng.random() < 0.5
        self.reset *= self.integral
        slow = self.process.lag >= 80 * self.sample and not self.process.integrates
        self.pulse = (
            round(self.process.lag / 20 / self.sample) * self.sample
            if slow and vendor in PULSES and not self.cascade
            else 0.0
        )
        self.tags: list[str] = []

    # --- the loop --------------------------------------------------------------------------------------------------

    def pv(self, share: float) -> float:
        """A value of the PV's range."""
        return round(self.low + share * self.span, 4)

    def config(self) -> Data:
        """The neutral file."""
        rng, scale = self.rng, self.stroke / self.span
        tuning: Data = {"gain": round(self.gain * scale, 6), "integral_time": round(self.reset, 2) or "off"}
        if self.rate >= LEAST_RATE * self.sample:
            tuning |= {"derivative_time": round(self.rate, 2), "derivative_filter": round(self.rate / 5, 3)}
        loop: Data = {
            "name": "A",
            "output_raises_pv": self.process.raises,
            "sample_time": self.sample,
            "tuning": tuning,
            "pv": {"range": [self.low, self.low + self.span]},
            "setpoint": {"value": self.pv(self.at), "limits": [self.pv(0.03), self.pv(0.97)]},
            "output": {"range": [0, self.stroke], "manual": round(self.output * self.stroke / 100, 2)},
        }
        if not self.integral:
            loop["output"]["bias"] = loop["output"]["manual"]
            self.tags.append("no integral")
        if self.pulse:
            loop["output"]["pulse"] = {"period": self.pulse}
            self.tags.append("pulses")
        if rng.random() < 0.15 and self.integral:
            loop["deadband"] = round(rng.uniform(0.002, 0.008) * self.span, 4)
            self.tags.append("deadband")
        if rng.random() < 0.4:
            points = {"low_low": 0.005, "low": 0.01, "high": 0.99, "high_high": 0.995}
            loop["alarms"] = {"pv": {key: self.pv(share) for key, share in points.items()}}
        loops = [loop]
        if self.cascade:
            self.tags.append("cascade")
            loops.append(self.slave())
            loop["output"] |= {"unit": "m3/h"}
        return {"pidcfg": 1, "vendor": "generic", "loops": loops}

    def slave(self) -> Data:
        """The inner loop, whose PV has the range of the outer loop's output."""
        return {
            "name": "B",
            "mode": "cascade",
            "output_raises_pv": True,
            "sample_time": self.sample,
            "tuning": {"gain": round(0.5 * 100 / self.stroke, 4), "integral_time": round(4 * self.sample, 2)},
            "pv": {"range": [0, self.stroke]},
            "setpoint": {"source": "A"},
            "output": {"range": [0, 100]},
        }

    # --- its process -----------------------------------------------------------------------------------------------

    def plants(self) -> Data:
        """The process in engineering units, resting at the set point with the output that was drawn."""
        rng, process = self.rng, self.process
        self.sign = 1 if process.raises else -1
        gain = self.sign * process.gain * self.span / self.stroke
        self.level = self.output * self.stroke / 100
        self.reach = abs(gain) * self.stroke / 100
        """PV units (an integrator: per s) for each % of the output."""
        plant: Data = {"gain": gain, "dead_time": round(process.dead_time, 2)}
        if process.integrates:
            self.load = -gain * self.level
            plant |= {"model": "integrator", "limits": [self.low - self.span, self.low + 2 * self.span]}
        else:
            self.load = self.pv(self.at) - gain * self.level
            plant["model"] = "first_order"
            if process.second:
                plant |= {"model": "second_order", "time_constants": [process.lag, process.second]}
            else:
                plant["time_constant"] = process.lag
        plant["load"] = self.load
        self.rests = rng.random() < 0.3
        start = self.at if self.rests else rng.uniform(0.1, 0.85)
        if process.integrates:
            start = min(max(start, self.at - 0.2), self.at + 0.2)
        plant["initial"] = self.pv(start)
        if rng.random() < 0.4:
            plant["noise"] = rng.uniform(0.0005, 0.003) * self.span
            self.tags.append("noise")
        if self.pulse:
            plant["input"] = f"{self.stroke} * {PULSES[self.vendor].format('A')}"
        if not self.cascade:
            return {"A": plant}
        plant |= {"input": "B.PV", "dead_time": plant["dead_time"] + self.sample}
        inner = {"model": "first_order", "gain": self.stroke / 100, "initial": self.level}
        inner["time_constant"] = 3 * self.sample
        return {"B": inner, "A": plant}

    # --- what happens ----------------------------------------------------------------------------------------------

    def events(self, duration: float) -> Iterator[Data]:
        """Up to four things, each of which leaves the output between 12 and 88 % once it has settled."""
        rng, at, output, moment = self.rng, self.at, self.output, 0.0
        rest = 2 * (self.answer + self.reset)
        for _ in range(rng.choice((0, 1, 1, 2, 2, 3, 4))):
            moment += rng.uniform(0.02, 0.6) * (duration - moment)
            kind = rng.choice(("step", "step", "ramp", "load", "load", "manual", "manual", "sensor"))
            time = round(moment, 1)
            if kind in {"step", "ramp"}:
                new = self.new_set_point(at, output)
                output += self.effort(new - at)
                steps = 1 if kind == "step" else rng.randint(5, 12)
                pause = rng.uniform(0.005, 0.02) * duration
                for i in range(1, steps + 1):
                    value = self.pv(at + (new - at) * i / steps)
                    yield {"at": round(time + (i - 1) * pause, 1), "loop": "A", "set": {"setpoint": value}}
                moment += (steps - 1) * pause
                at = new
            elif kind == "load":
                reach = self.process.per_s * self.answer if self.process.integrates else self.process.gain
                most = min(20.0, PUSH / reach)
                new_output = min(max(output + rng.uniform(-most, most), 12), 88)
                self.load += (output - new_output) * self.reach * self.sign
                output = new_output
                yield {"at": time, "loop": "A", "disturb": {"load": self.load}}
            elif kind == "manual" and not self.process.integrates and not self.cascade and time > rest:
                back = round(time + rng.uniform(0.02, 0.15) * duration, 1)
                yield {"at": time, "loop": "A", "mode": "manual"}
                if rng.random() < 0.8:
                    yield {"at": back, "loop": "A", "mode": "auto"}
                    moment = back
                else:
                    return
            elif kind == "sensor":
                length = round(min(0.03 * duration, 0.2 * self.answer), 1)
                if length >= 2 * self.sample:
                    shown = rng.choice((self.pv(1.0), self.pv(0.0)))
                    yield {"at": time, "loop": "A", "pv": shown, "for": length}
            else:
                continue
            rest = moment + 2 * (self.answer + self.reset)
            self.tags.append(kind)

    def effort(self, change: float) -> float:
        """By how many % of the output a share of the span more of the PV is held."""
        return 0.0 if self.process.integrates else self.sign * change * self.span / self.reach

    def new_set_point(self, at: float, output: float) -> float:
        """Another set point, which the output can hold."""
        for _ in range(50):
            new = round(min(max(at + self.rng.uniform(-0.25, 0.25), 0.1), 0.85), 3)
            if 12 <= output + self.effort(new - at) <= 88:
                return new
        return at

    def course(self, seed: int) -> Course:
        """All of it."""
        rng = self.rng
        config, plants = self.config(), self.plants()
        natural = 5 * (self.answer + (self.reset or self.process.lag))
        duration = natural * 10 ** rng.uniform(-1.2, 1.0)
        duration = round(
            min(max(duration, 30 * self.sample), (MOST_PULSED if self.pulse else MOST_STEPS) * self.sample), 1
        )
        scenario: Data = {
            "pidcfg": 1,
            "scenario": f"Good run {seed}",
            "config": "good.yaml",
            "duration": duration,
            "seed": seed,
            "plants": plants,
            "events": sorted(self.events(duration), key=lambda event: event["at"]),
        }
        if self.pulse:
            parts = next(n for n in (1, 2, 5, 10, 20, 50, 100) if n * self.pulse >= 100 * self.sample)
            scenario["step"] = self.sample / parts
        rushes = 50 * self.process.per_s * (self.process.delay + self.sample) > RUSH
        if not self.process.integrates and not self.pulse and (rushes or self.rests or rng.random() < 0.2):
            scenario["initial"] = "steady"
            self.tags.append("steady")
        elif rushes or self.rests or self.cascade or not self.process.raises:
            scenario["initial"] = {"A": round(self.level, 3)}
        scenario["events"] = [event for event in scenario["events"] if event["at"] <= duration]
        name = f"{self.vendor}/{seed} {'integrator' if self.process.integrates else 'lag'} {' '.join(self.tags)}"
        return Course(name, self.vendor, as_vendor(config, self.vendor), scenario)


def as_vendor(config: Data, vendor: str) -> Data:
    """A neutral file as one of the vendor."""
    if vendor == "generic":
        return config
    result = pidcfg.convert(json.dumps(config), vendor, name="good.yaml")
    if not result.text:
        raise ValueError(f"{vendor} cannot have {json.dumps(config)}: {[d.message for d in result.findings]}")
    data: Data = json.loads(json.dumps(YAML(typ="safe", pure=True).load(result.text)))
    for loop in data["loops"]:
        if vendor == "click":
            loop["action_verified"] = True
    return data


def failures(run: Course) -> list[str]:
    """Why a run fails; it should not. What a short run does not prove is no failure."""
    files = {"good.scenario.yaml": json.dumps(run.scenario), "good.yaml": json.dumps(run.config)}
    result = pidcfg.simulate(Path("good.scenario.yaml"), files=files, engine="python")
    if result.report is None:
        return [f"does not run: {d.code} {d.message}" for d in result.findings if d.severity.label == "error"]
    return [f"{v.kind} {v.loop}: {v.text}" for v in result.report.standing if v.fails and v.verdict == "failed"]


def measured(seed: int, vendors: Sequence[str] = VENDORS) -> list[tuple[Course, list[str]]]:
    """The run of each vendor with this seed."""
    runs = [Drawer(seed, vendor).course(seed) for vendor in vendors]
    return [(run, failures(run)) for run in runs]


def main(arguments: Sequence[str]) -> int:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("count", nargs="?", type=int, default=60, help="runs of each vendor")
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--vendor", choices=VENDORS, action="append", help="only these")
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    parser.add_argument("--show", action="store_true", help="the files of runs that fail")
    options = parser.parse_args(arguments)
    seeds = range(options.first, options.first + options.count)
    total = wrong = 0
    with ProcessPoolExecutor(options.jobs) as pool:
        for runs in pool.map(partial(measured, vendors=options.vendor or VENDORS), seeds):
            for run, why in runs:
                total += 1
                wrong += bool(why)
                if why:
                    sys.stdout.write(f"{run.name}: {'; '.join(why)}\n")
                    if options.show:
                        sys.stdout.write(f"{json.dumps(run.config)}\n{json.dumps(run.scenario)}\n")
                    sys.stdout.flush()
    sys.stdout.write(f"{total} good runs, of which {wrong} fail (goal 0)\n")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
