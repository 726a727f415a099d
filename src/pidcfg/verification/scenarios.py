"""A stage as the scenario of one side: its plant, what is wired to what, and its events."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.verification.acts import Act, Stage
    from pidcfg.verification.bench import Bench
    from pidcfg.verification.names import SideNames

PLANT, LOST, MOVED = "Plant", "lost", "moved"


def scenario_data(stage: Stage, bench: Bench, names: SideNames) -> dict[str, Any]:
    """The stage as a scenario of one side.

    The plant reads the output in its own units: ``zero`` is what its 0 % adds.
    """
    low, high = names.scale
    width, zero = high - low, bench.gain * low / (high - low)
    plant: dict[str, Any] = {"name": PLANT, "model": "first_order", "input": names.output, "initial": stage.pv}
    plant |= {"gain": bench.gain / width, "time_constant": bench.time, "dead_time": bench.dead}
    plant["load"] = stage.load - zero
    if stage.swept:
        plant = {"name": PLANT, "model": "integrator", "input": "0", "gain": 1, "load": 0, "initial": stage.pv}
    offset = 0.0 if stage.swept else zero
    plant["limits"] = [bench.low, bench.high]
    return {
        "pidcfg": 1,
        "scenario": stage.name,
        "config": "configuration.yaml",
        "duration": round(stage.end, 6),
        "plants": [plant],
        "signals": {LOST: 0, MOVED: 0},
        "connect": {names.inlet: names.measured, **names.connect},
        "events": [
            *names.events,
            *(event for act in stage.acts for event in _events(act, names, offset)),
        ],
    }


def _events(act: Act, names: SideNames, zero: float) -> Iterator[dict[str, Any]]:
    event: dict[str, Any] = {"at": round(act.at, 6)}
    if act.mode is not None and act.mode in names.modes:
        yield event | {"loop": names.loop, "mode": act.mode}
    if act.setpoint is not None:
        yield event | {"loop": names.loop, "set": {"setpoint": names.setpoint_at(act.setpoint)}}
    if act.output is not None:
        yield event | {"loop": names.loop, "set": {"output": names.output_at(act.output)}}
    if act.master is not None and names.master is not None:
        name, (low, high) = names.master
        yield event | {"loop": name, "set": {"output": low + act.master * (high - low)}}
    after = {"at": round(act.at + names.step, 6)}
    if act.load is not None:
        yield after | {"plant": PLANT, "disturb": {"load": act.load - zero}}
    if act.moved is not None:
        yield after | {"set": {MOVED: act.moved}}
    if act.lost is not None:
        yield after | {"set": {LOST: int(act.lost)}}
