"""Robust gains tried by `certify`: the virtual PLC with the loop alone, and samples of the plants that it is for."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, log
from typing import TYPE_CHECKING

from pidcfg.certification.certify import Plan, certify_document
from pidcfg.reader import reader_of
from pidcfg.results.conversion import converted
from pidcfg.source import read_document
from pidcfg.tuning.load_response import absolute_error
from pidcfg.tuning.uncertainty import SEED
from pidcfg.validate.engine import check_document

if TYPE_CHECKING:
    from pidcfg.encoders.tuned import LoopTuning
    from pidcfg.limits import Limits
    from pidcfg.results.findings import Data
    from pidcfg.tuning.robust import Robust
    from pidcfg.tuning.rules import Process
    from pidcfg.vendors import Vendor

ROOM, COUNTS, FULL = 1.1, 2.0, 4095
"""Of the IAE: what the words of PV and output, and the time of the step, may add; and counts of the PV all the time."""
STEP, REST, ENDS = 0.1, 0.5, 0.85
"""Of the output's range: the step of the load, where the output rests on the process itself, and on no plant beyond."""
LONG = 15.0
"""Times all times of loop and process: how long a run lasts."""
OWN = "generic"
NEUTRAL = """pidcfg: 1
vendor: generic
loops:
  - name: LOOP
    mode: auto
    output_raises_pv: true
    sample_time: {sample!r}
    tuning: {{gain: {gain!r}, integral_time: {integral!r}, derivative_time: {rate!r}, derivative_filter: {lag!r}}}
    pv: {{range: [0, {pv!r}], filter: {filter!r}}}
    setpoint: {{value: {middle!r}}}
    output: {{range: [0, {output!r}], limits: [0, {output!r}]}}
"""
SCENARIO = """pidcfg: 1
scenario: A step of the load
config: loop.yaml
duration: {duration!r}
initial: steady
plants:
  LOOP: {{{plant}, load: {load!r}, initial: {middle!r}}}
vary:
  seed: {seed}
  plants:
    LOOP: {{{varies}}}
events:
  - {{at: {at!r}, loop: LOOP, disturb: {{load: {more!r}}}}}
expect:
  - {{loop: LOOP, metric: iae, max: {most!r}}}
"""
NAMES = ("loop.yaml", "loop.scenario.yaml")


@dataclass(frozen=True, slots=True)
class Confirmation:
    """How many samples have an IAE below a limit; shares in %."""

    plc: str
    samples: int
    held: int
    bound: float
    limit: float
    largest: float | None

    @property
    def passed(self) -> bool:
        """Whether all have."""
        return self.held == self.samples

    def to_json(self) -> Data:
        """Under ``robust.certified``."""
        return {
            "plc": self.plc,
            "samples": self.samples,
            "held": self.held,
            "at_least_percent": self.bound,
            "iae_limit": self.limit,
            "iae_max": self.largest,
            "passed": self.passed,
        }


def confirmed(
    found: Robust, process: Process, vendor: Vendor | None, loop: LoopTuning | None, samples: int, limits: Limits
) -> Confirmation | None:
    """What `certify` says of the gains; None: nothing varies, or the loop does not run in its virtual PLC."""
    if not found.spreads or (process.integrating and process.second_time_constant):
        return None
    output = 100.0 if loop is None or loop.output_span is None else float(loop.output_span)
    pv = process.gain * output if loop is None or loop.pv_span is None else float(loop.pv_span)
    text = _loop_text(found, pv, output)
    plc, config = _as_vendor(text, vendor, limits)
    scenario, most = _scenario(found, process, pv, output)
    files = {NAMES[0]: config, NAMES[1]: scenario.encode()}
    doc = read_document(files[NAMES[1]], NAMES[1], limits)
    certification = certify_document(doc, Plan(samples, SEED, keep_worst=0), limits, reader_of(files)).certification
    if certification is None:
        return None
    (wanted,) = certification.expectations
    largest = certification.metrics["LOOP"]["iae"]["max"]
    held = min(wanted.held, certification.all_passed)
    return Confirmation(plc, samples, held, wanted.bound, most, largest)


def _loop_text(found: Robust, pv: float, output: float) -> str:
    """The loop in the neutral form."""
    gains, sampling = found.result.gains, found.search.sampling
    seconds = sampling.sample_time
    limit = sampling.derivative_limit
    lag = _time(sampling.derivative_share, seconds) if limit is None else gains.derivative_time / limit
    return NEUTRAL.format(
        sample=seconds,
        gain=gains.gain,
        integral=gains.integral_time,
        rate=gains.derivative_time,
        lag=lag if gains.derivative_time else 0.0,
        pv=pv,
        filter=_time(sampling.pv_share, seconds),
        middle=pv / 2,
        output=output,
    )


def _time(share: float, seconds: float) -> float:
    """The time constant of a filter that takes a share of each difference."""
    return 0.0 if share >= 1 else -seconds / log(1 - share)


def _as_vendor(text: str, vendor: Vendor | None, limits: Limits) -> tuple[str, bytes]:
    """The loop as a file of a PLC, with its name; the neutral form where the PLC cannot have it alone."""
    neutral = text.encode()
    if vendor is not None and vendor.key != OWN:
        checked = check_document(read_document(neutral, NAMES[0], limits), limits)
        result = converted(checked, vendor, {}, limits, None)
        if result.text and result.ok:
            return vendor.key, result.text.encode()
    return OWN, neutral


def _scenario(found: Robust, process: Process, pv: float, output: float) -> tuple[str, float]:
    """The scenario, and the largest IAE that is expected."""
    lowest = next((spread.low for spread in found.spreads if spread.name == "gain"), process.gain)
    rest = output * min(REST, ENDS * lowest / process.gain)
    push = min(STEP * output, rest / 2) * process.gain
    gains, search = found.result.gains, found.search
    sampling, plants = search.sampling, search.plants
    slowest = gains.integral_time + process.time_constant + process.second_time_constant + process.dead_time
    duration = ceil(LONG * slowest / sampling.sample_time) * sampling.sample_time
    errors = (
        absolute_error(gains, curve.plant, sampling) / plant.gain
        for curve, plant in zip(search.curves, plants, strict=True)
    )
    most = ROOM * push * max(errors) + COUNTS * pv / FULL * duration
    load = (0.0 if process.integrating else pv / 2) - process.gain * rest
    text = SCENARIO.format(
        duration=duration,
        plant=_plant(process),
        load=load,
        middle=pv / 2,
        seed=SEED,
        varies=", ".join(f"{_key(s.name, process)}: {{uniform: [{s.low!r}, {s.high!r}]}}" for s in found.spreads),
        at=2 * sampling.sample_time,
        more=load + push,
        most=most,
    )
    return text, most


def _plant(process: Process) -> str:
    """The process as a scenario has it."""
    if process.integrating:
        return f"model: integrator, gain: {process.gain!r}, dead_time: {process.dead_time!r}"
    common = f"gain: {process.gain!r}, dead_time: {process.dead_time!r}"
    if process.second_time_constant:
        times = f"[{process.time_constant!r}, {process.second_time_constant!r}]"
        return f"model: second_order, time_constants: {times}, {common}"
    return f"model: first_order, time_constant: {process.time_constant!r}, {common}"


def _key(name: str, process: Process) -> str:
    """A number of the process as ``vary`` names it."""
    if not process.second_time_constant:
        return name
    return {"time_constant": "time_constants.0", "second_time_constant": "time_constants.1"}.get(name, name)
