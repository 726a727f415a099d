"""What short runs of the virtual PLCs give with one change each, in full; ``generated`` writes the answers anew.

A scenario has as much to do as fits two minutes: modes, set points, gains, disturbances, auto-tunes, faults. It runs as
it is, and with another value in the scenario or in its configuration. The report and samples of the trend stand in a
file below ``tests/data/runs`` behind the place and the change.
"""

from __future__ import annotations

import io
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pidcfg import api
from pidcfg.encoders.listing import ListingError
from pidcfg.text.reader import Limits
from spoiled_configurations import MILD, spoiled
from spoiled_listings import EXAMPLES, Source, answers_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

FOLDER = Path(__file__).parent / "data" / "runs"
PLACES = 12
BETWEEN = "---\n"
"""Between a scenario and its configuration."""
SHORT = Limits(loop_steps=20_000)
"""A change may ask for a long run: it is refused."""
TREND = 10
"""Rows of the trend that are kept."""
SCENARIOS = {
    "dl06/reactor": """
duration: 120
plants:
  FIC-102: {model: first_order, gain: 0.5, time_constant: 3, dead_time: 0.4, initial: 20, noise: 0.05}
  TIC-101: {model: first_order, input: FIC-102.PV, gain: 4.0, time_constant: 24, dead_time: 2, initial: 80}
  LIC-103: {model: integrator, gain: -0.02, load: 1.0, initial: 50}
seed: 7
events:
  - {at: 5, loop: TIC-101, set: {setpoint: 95}}
  - {at: 10, loop: FIC-102, mode: auto}
  - {at: 14, loop: FIC-102, set: {setpoint: 30}}
  - {at: 18, loop: FIC-102, mode: manual}
  - {at: 22, loop: FIC-102, set: {output: 40}}
  - {at: 26, loop: FIC-102, mode: cascade}
  - {at: 30, loop: TIC-101, ramp_soak: start}
  - {at: 40, loop: TIC-101, ramp_soak: hold}
  - {at: 44, loop: TIC-101, ramp_soak: resume}
  - {at: 50, loop: TIC-101, ramp_soak: jog}
  - {at: 54, loop: TIC-101, mode: manual}
  - {at: 58, loop: TIC-101, set: {tuning.gain: 1.5}}
  - {at: 60, loop: LIC-103, disturb: {load: 1.4}}
  - {at: 66, loop: TIC-101, mode: auto}
  - {at: 70, loop: LIC-103, pv: 120, for: 5}
  - {at: 80, plc: program}
  - {at: 88, plc: run}
  - {at: 94, loop: LIC-103, mode: manual}
  - {at: 104, loop: LIC-103, autotune: start}
""",
    "dl06/oven": """
duration: 1800
plants:
  TIC-201: {model: first_order, gain: 11, load: 25, time_constant: 900, dead_time: 10, initial: 25, noise: 0.1}
seed: 3
events:
  - {at: 30, loop: TIC-201, ramp_soak: start}
  - {at: 400, loop: TIC-201, disturb: {load: 10}}
  - {at: 900, loop: TIC-201, autotune: start}
  - {at: 1700, loop: TIC-201, pv: 1200, for: 20}
""",
    "click/brewery": """
duration: 300
plants:
  KETTLE: {model: first_order, gain: 1.05, load: 18, time_constant: 60, dead_time: 3, initial: 50, noise: 0.03}
  GLYCOL: {model: first_order, gain: -0.35, load: 24, time_constant: 50, dead_time: 4, initial: 18}
initial: {KETTLE: 30, GLYCOL: 17}
seed: 5
events:
  - {at: 10, loop: KETTLE, set: {setpoint: 66}}
  - {at: 30, loop: GLYCOL, disturb: {load: 28}}
  - {at: 40, loop: KETTLE, mode: manual}
  - {at: 46, loop: KETTLE, set: {output: 40}}
  - {at: 60, loop: KETTLE, mode: auto}
  - {at: 66, loop: KETTLE, set: {tuning.proportional_gain: 4}}
  - {at: 70, loop: GLYCOL, pv: 40, for: 4}
  - {at: 80, plc: stop}
  - {at: 86, plc: run}
  - {at: 100, loop: KETTLE, mode: manual}
  - {at: 110, loop: KETTLE, autotune: start}
""",
    "ezlogix/dosing": """
duration: 180
plants:
  - {name: pipe, model: first_order, input: FLOW.CV, gain: 0.5, time_constant: 3, dead_time: 0.4, initial: 30}
  - {name: DAYTANK, model: integrator, input: DAYTANK.CV * 0.6 - pipe, gain: 0.01, initial: 70, limits: [0, 100]}
connect:
  FLOW.PV: pipe * pipe / 50
initial: {FLOW: 60, DAYTANK: 50}
events:
  - {at: 5, loop: FLOW, set: {setpoint: 40}}
  - {at: 20, loop: FLOW, mode: manual}
  - {at: 24, loop: FLOW, set: {output: 30}}
  - {at: 30, loop: FLOW, mode: auto}
  - {at: 34, loop: FLOW, set: {tuning.proportional_gain: 0.8}}
  - {at: 40, loop: DAYTANK, pv: 10, for: 5}
  - {at: 50, plc: stop}
  - {at: 56, plc: run}
  - {at: 60, loop: FLOW, mode: manual}
  - {at: 62, loop: FLOW, autotune: start}
""",
    "dpide/dryer": """
duration: 240
plants:
  AIR: {model: first_order, gain: 2.2, load: 18, time_constant: 20, dead_time: 2, noise: 0.05}
  DUCT: {model: first_order, gain: 5.5, time_constant: 4, dead_time: 0.5}
seed: 2
events:
  - {at: 5, loop: AIR, set: {SV: 90}}
  - {at: 20, loop: AIR, mode: manual}
  - {at: 25, loop: AIR, set: {MOUT: 60}}
  - {at: 30, loop: AIR, mode: auto}
  - {at: 35, loop: DUCT, disturb: {gain: 4}}
  - {at: 40, loop: DUCT, set: {Kc_Kp: 0.1}}
  - {at: 50, plc: stop}
  - {at: 56, plc: run}
  - {at: 60, loop: DUCT, pv: 400, for: 4}
  - {at: 70, loop: AIR, autotune: start}
""",
    "generic/boiler": """
duration: 240
plants:
  FIC-1: {model: first_order, gain: 0.4, time_constant: 3}
  TIC-1: {model: first_order, input: FIC-1.PV, gain: 4, load: 15, time_constant: 60, dead_time: 4, initial: 15}
  TIC-2: {model: first_order, input: TIC-2.PULSE, gain: 90, load: 15, time_constant: 90, dead_time: 5, initial: 15}
events:
  - {at: 30, loop: TIC-1, disturb: {load: 0}}
  - {at: 40, loop: FIC-1, mode: auto}
  - {at: 45, loop: FIC-1, set: {setpoint: 20}}
  - {at: 55, loop: FIC-1, mode: manual}
  - {at: 60, loop: FIC-1, set: {output: 30}}
  - {at: 70, loop: FIC-1, mode: cascade}
  - {at: 80, loop: TIC-1, set: {tuning.gain: 2}}
  - {at: 90, loop: TIC-1, pv: 140, for: 6}
""",
    "nextopid/override": """
duration: 36
plants:
  TIC_1: {model: first_order, input: VALVE.MV, gain: 2.0, load: 20, time_constant: 10, dead_time: 1}
  PIC_2: {model: first_order, input: VALVE.MV, gain: 0.06, time_constant: 4, dead_time: 0.5, noise: 0.01}
seed: 4
events:
  - {at: 5, loop: PIC_2, disturb: {gain: 0.1}}
  - {at: 10, loop: PIC_2, disturb: {gain: 0.06}}
  - {at: 13, loop: TIC_1, set: {SP: 100}}
  - {at: 17, loop: TIC_1, mode: manual}
  - {at: 19, loop: TIC_1, set: {ManualMV: 30}}
  - {at: 22, loop: TIC_1, mode: auto}
  - {at: 26, loop: TIC_1, set: {Kp: 4}}
  - {at: 32, loop: TIC_1, pv: 250, for: 2}
""",
    "nextopid/autotune": """
duration: 90
initial: steady
plants:
  TIC_1: {model: first_order, gain: 2, time_constant: 10, dead_time: 1, initial: 40}
events:
  - {at: 2, loop: TIC_1, autotune: start}
  - {at: 4, loop: TIC_1, autotune: cancel}
  - {at: 6, loop: TIC_1, autotune: start}
  - {at: 60, loop: TIC_1, autotune: accept}
  - {at: 65, loop: TIC_1, mode: auto}
  - {at: 70, loop: TIC_1, set: {SP: 50}}
""",
    "nextopid/diagnostics": """
duration: 60
initial: steady
plants:
  - {name: Heater, model: first_order, input: TIC_101.MV, gain: 1, time_constant: 10, dead_time: 1, initial: 40}
connect:
  TT_101: Heater
events:
  - {at: 5, set: {Module_Failed: true}}
  - {at: 15, set: {Module_Failed: false}}
  - {at: 30, set: {Manual_1: true}}
  - {at: 40, set: {Hold: 2}}
  - {at: 50, set: {Manual_1: false}}
""",
}
"""A scenario by the example whose configuration it runs."""


def simulated(text: str) -> str:
    """The report of a scenario behind which stands its configuration, and samples of the trend."""
    scenario, _, config = text.partition(BETWEEN)
    trend = io.StringIO()
    files = {"a.yaml": config.encode()}
    result = api.simulate(
        scenario.encode(), engine="python", trend=trend, name="a.scenario.yaml", files=files, limits=SHORT
    )
    found = [f"{d.span.line}:{d.span.column} {d.code}: {d.message}" for d in result.findings]
    if result.report is None:
        raise ListingError("\n".join(found))
    head, *rows = trend.getvalue().splitlines()
    kept = rows[:: max(1, len(rows) // TREND)]
    return "\n".join([*found, *flat(result.to_json()), head, *kept, rows[-1]])


def flat(data: Any, above: str = "") -> Iterator[str]:
    """Data with a line for each value."""
    if isinstance(data, dict):
        for key, inner in data.items():
            yield from flat(inner, f"{above}.{key}")
    elif isinstance(data, list) and any(isinstance(inner, dict | list) for inner in data):
        for i, inner in enumerate(data):
            yield from flat(inner, f"{above}[{i}]")
    else:
        yield f"{above}: {data}"


def _source(example: str, part: float) -> Source:
    head = f"pidcfg: 1\nscenario: {example}\nconfig: a.yaml\n" + SCENARIOS[example].lstrip()
    config = (EXAMPLES / f"{example}.yaml").read_text("utf-8")
    return Source(head + BETWEEN + config, PLACES, simulated, part)


SOURCES: dict[str, Callable[[], Source]] = {
    f"{example.replace('/', '-')}-{turn + 1}": partial(_source, example, turn / 3)
    for example in SCENARIOS
    for turn in range(3)
}


@cache
def answers(name: str) -> str:
    """The file of a source: each change, and below it the answer."""
    return answers_of(SOURCES[name](), partial(spoiled, numbers=MILD))


def golden_files(wanted: Callable[[str], bool] = bool) -> dict[Path, bytes]:
    """All of them, or those whose names are wanted."""
    return {FOLDER / f"{name}.txt": answers(name).encode() for name in SOURCES if wanted(name)}
