"""The production run of every vendor for the benchmark: configuration, plants and set-point events, as for `simulate`.

Every vendor controls the same first-order plants with the same gains, in a form as near as it has: filter, derivative
with its filter and alarms where it has them. Set points go up and down, each event long after the one before.
"""

from __future__ import annotations

import random
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from pidcfg.sim.engine.run import Settings, simulate
from pidcfg.study.scenario import load_scenario
from pidcfg.text.source import read_document

if TYPE_CHECKING:
    from collections.abc import Callable

    from pidcfg.sim.engine.choice import EngineName
    from pidcfg.sim.engine.recording import Recording
    from pidcfg.sim.engine.run import Sink
    from pidcfg.sim.judgement.report import Report
    from pidcfg.study.scenario import LoadedScenario

STEP = 0.5
"""Base step and sample rate in s."""
TIME_CONSTANT = 20
EVENTS = 10
LOW, HIGH = 40, 60
NOISE = 0.2
VENDORS = ("dl06", "ezlogix", "click", "dpide", "nextopid", "generic")

_HEADS = {
    "dl06": "plc: {loop_table: V2000}\n",
    "nextopid": "plc: {sample_time: 0.1}\n",
}
_LOOPS = {
    "dl06": """\
  - name: T{n}
    mode: auto
    sample_rate: 0.5
    action: direct
    bias_freeze: true
    tuning: {{gain: 2.00, reset: 20.0, rate: 1.00}}
    derivative_gain_limit: 10
    pv: {{range: [0, 100], filter: 0.5}}
    setpoint: {{value: 40, limits: [2, 98]}}
    output: {{range: [0, 100]}}
    alarms: {{pv: {{low_low: 1, low: 2, high: 90, high_high: 95}}, deviation: {{yellow: 97, red: 99}},
      rate_of_change: 90 /s, hysteresis: 1}}
""",
    "ezlogix": """\
  - name: T{n}
    registers: R{register}
    discretes: S{register}
    mode: auto
    algorithm: velocity
    action: reverse
    sample_rate: 0.50
    tuning: {{proportional_gain: 2.00, integral_time: 20.0, derivative_time: 1.0}}
    pv: {{tag: IR{n}, range: [0, 100], counts: [0, 4095]}}
    setpoint: {{value: 40, limits: [2, 98]}}
    output: {{tag: OR{n}, range: [0, 100], unit: "%"}}
    anti_windup: true
""",
    "click": """\
  - name: T{n}
    bits: C{registers}
    integers: DS{registers}
    floats: DF{registers}
    mode: auto
    action: direct
    action_verified: true
    sample_rate: 500 ms
    freeze_bias: true
    tuning: {{proportional_gain: 2, reset_time: 20, derivative_gain: 1}}
    derivative_gain_limit: 10
    derivative_gain_limit_enabled: true
    pv: {{range: [0, 100], filter: 50}}
    setpoint: {{value: 40, lower_limit: 2, upper_limit: 98}}
    output: {{limits: [0, 100], unit: "%"}}
    alarms: {{pv: {{low_low: 1, low: 2, high: 90, high_high: 95}}, deviation: {{high: 97, high_high: 99}},
      rate_of_change: 90 /s, hysteresis: 1}}
""",
    "dpide": """\
  - name: T{n}
    device: D{device}
    SV: 40.0
    CYCLE: 500
    PID_EQ: true
    Kc_Kp: 2.0
    Ti_Ki: 20.0
    Td_Kd: 1.0
    Tf: 0.5
    PID_DE: true
    PID_DIR: true
    MV_MAX: 100
    MV_MIN: 0
    pv: {{range: [0, 100]}}
    output: {{range: [0, 100]}}
""",
    "nextopid": """\
  - name: T{n}
    type: PIDA_REAL
    sample_time: 500 ms
    SP: 40.0
    Kp: 2.0
    Ti_Ki: 20.0
    Td_Kd: 1.0
    Tfd: 0.5
    MinMV: 0.0
    MaxMV: 100.0
    MinPV: 0.0
    MaxPV: 100.0
""",
    "generic": """\
  - name: T{n}
    output_raises_pv: true
    sample_time: 0.5 s
    tuning: {{gain: 2, integral_time: 20 s, derivative_time: 1 s, derivative_filter: 0.1 s}}
    pv: {{range: [0, 100], filter: 0.5 s}}
    setpoint: {{value: 40, limits: [2, 98]}}
    output: {{range: [0, 100], unit: "%"}}
    alarms: {{pv: {{low: 2, high: 90, high_high: 95}}, hysteresis: 1}}
""",
}
SETPOINTS = {"dpide": "SV", "nextopid": "SP"}


def configuration(vendor: str, loops: int) -> str:
    """So many loops of a vendor."""
    text = f"pidcfg: 1\nvendor: {vendor}\n{_HEADS.get(vendor, '')}loops:\n"
    for i in range(loops):
        places = {"register": 101 + 32 * i, "registers": 101 + 50 * i, "device": 500 + 100 * i}
        text += _LOOPS[vendor].format(n=i + 1, **places)
    return text


def scenario(vendor: str, loops: int, steps: int, *, noise: bool) -> str:
    """First-order plants and set-point events, which take turns with the loops, for ``steps`` base steps."""
    text = f"pidcfg: 1\nscenario: production\nconfig: c.yaml\nduration: {(steps - 1) * STEP:g}\nstep: {STEP}\nplants:\n"
    sigma = f", noise: {NOISE}" if noise else ""
    for i in range(loops):
        text += f"  T{i + 1}: {{model: first_order, gain: 1, time_constant: {TIME_CONSTANT}, initial: 30{sigma}}}\n"
    text += "events:\n"
    key = SETPOINTS.get(vendor, "setpoint.value")
    for event in range(EVENTS):
        at, value = steps * (event + 1) // (EVENTS + 1), HIGH if event // loops % 2 == 0 else LOW
        text += f"  - {{at: {at * STEP:g}, loop: T{event % loops + 1}, set: {{{key}: {value}}}}}\n"
    return text


def limit_cycle(steps: int) -> tuple[str, str]:
    """A DL06 loop with far too much gain behind a dead time: it swings from end to end, and so do its alarms."""
    config = configuration("dl06", 1).replace("gain: 2.00, reset: 20.0, rate: 1.00", "gain: 40.0, reset: 20.0")
    plant = f"{{model: first_order, gain: 1, time_constant: {TIME_CONSTANT}, dead_time: 5, initial: 30}}"
    text = f"pidcfg: 1\nscenario: cycle\nconfig: c.yaml\nduration: {(steps - 1) * STEP:g}\nstep: {STEP}\n"
    alarms = "alarms: {{pv: {{low_low: 1, low: 2, high: 90, high_high: 95}}, deviation: {{yellow: 97, red: 99}}"
    near = "alarms: {pv: {low_low: 1, low: 29, high: 42, high_high: 95}, deviation: {yellow: 3, red: 99}"
    return config.replace(alarms.replace("{{", "{").replace("}}", "}"), near), text + f"plants:\n  T1: {plant}\n"


@dataclass(frozen=True)
class Files:
    """A reader of two texts."""

    config: str

    def read(self, name: str, most: int) -> bytes:
        """The configuration, whatever its name."""
        del name
        return self.config.encode()[:most]

    def resolve(self, name: str, other: str) -> str:
        """The name as it is."""
        del name
        return other


def loaded(config: str, text: str) -> LoadedScenario:
    """A scenario ready to run; what is wrong with it ends the benchmark."""
    done = load_scenario(read_document(text.encode(), "s.yaml"), Files(config))
    errors = [finding.message for finding in (*done.findings, *done.config_errors) if finding.severity.label == "error"]
    if done.image is None or errors:
        raise SystemExit(f"the benchmark's files have errors: {'; '.join(errors)}\n{config}\n{text[:500]}")
    return done


def ours(
    case: LoadedScenario,
    engine: EngineName,
    *,
    trend: Sink | None = None,
    recording: Recording | None = None,
    judged: bool = True,
) -> Report:
    """The run of `pidcfg simulate`; what C does stands alone, without verdicts and the run without control for them."""
    assert case.scenario is not None
    settings = Settings(engine, trend=trend, recording=recording, with_verdicts=judged, with_reference=judged)
    return simulate(case.scenario, case.new_plc, case.controller, settings)


def simple_pid(loops: int, steps: int, *, noise: bool) -> Callable[[], Any]:
    """The same plants under simple-pid, as its page shows how it is used; raises ImportError where it is missing."""
    from simple_pid import PID  # type: ignore[import-not-found,unused-ignore]

    share = STEP / TIME_CONSTANT

    def run() -> list[float]:
        controllers = [PID(2.0, 0.1, 2.0, setpoint=LOW, output_limits=(0, 100)) for _ in range(loops)]
        values = [30.0] * loops
        outputs: list[Any] = [0.0] * loops
        source = random.Random(1)
        stride = max(1, steps // (EVENTS + 1))
        for k in range(steps):
            if k % stride == 0:
                for controller in controllers:
                    controller.setpoint = HIGH if k // stride % 2 else LOW
            for i in range(loops):
                values[i] += share * (outputs[i] - values[i])
                shown = values[i] + NOISE * source.gauss(0.0, 1.0) if noise else values[i]
                outputs[i] = controllers[i](shown, dt=STEP)
        return values

    return run
