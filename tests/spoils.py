"""Mistakes that people make in a configuration and its scenario: small edits of their data, by structure.

A configuration's keys are told by a table, a row a vendor. `spoils` gives every mistake that fits an example, each with
both files changed. What a file may well say on purpose (Manual, a stopped CPU, another set point within its range) is
marked as an `intent`: no run can tell such an edit from what was wanted.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

from pidcfg.schemas.base import parse_seconds

Data = dict[str, Any]


@dataclass(frozen=True)
class Keys:
    """Where a vendor's configuration says what; dotted paths below a loop, numbers are places in a list."""

    gain: str
    reset: str
    no_reset: object
    rate: str
    sample: str
    setpoint: str
    span: tuple[str, str]
    limits: tuple[str, str]
    switches: dict[str, dict[object, object]]
    """Keys with two values that are easily confused, and what each is turned into."""
    manual: dict[str, object]
    """What puts the loop in Manual for good."""
    most: dict[str, float] = field(default_factory=dict)
    """The highest value that the PLC takes, by key."""
    set_key: str = "setpoint"
    """What an event calls the set point."""
    output: str = "OUT"
    """The signal of the output."""
    flags: tuple[str, ...] = ()
    """Keys that help, and are turned off."""
    alarms: tuple[str, ...] = ()
    """The absolute alarms from the lowest to the highest."""
    deviations: tuple[str, ...] = ()
    deadband: str = ""


CONTROL = {"direct": "reverse", "reverse": "direct"}
BOTH: dict[object, object] = {True: False, False: True}
PV_ALARMS = tuple(f"alarms.pv.{name}" for name in ("low_low", "low", "high", "high_high"))
VENDORS = {
    "dl06": Keys(
        "tuning.gain",
        "tuning.reset",
        "off",
        "tuning.rate",
        "sample_rate",
        "setpoint.value",
        ("pv.range.0", "pv.range.1"),
        ("output.limits.0", "output.limits.1"),
        {
            "action": {**CONTROL},
            "pv.square_root": BOTH,
            "tuning.reset_unit": {"seconds": "minutes", "minutes": "seconds"},
        },
        {"mode": "manual"},
        {"tuning.gain": 99.99, "tuning.reset": 999.9, "tuning.rate": 99.99, "sample_rate": 99.99},
        flags=("bias_freeze",),
        alarms=PV_ALARMS,
        deviations=("alarms.deviation.yellow", "alarms.deviation.red"),
        deadband="error.deadband",
    ),
    "click": Keys(
        "tuning.proportional_gain",
        "tuning.reset_time",
        6000,
        "tuning.derivative_gain",
        "sample_rate",
        "setpoint.value",
        ("pv.range.0", "pv.range.1"),
        ("output.limits.0", "output.limits.1"),
        {"action": {**CONTROL}, "error.curve": {"linear": "squared", "squared": "linear"}},
        {"mode": "manual"},
        {"tuning.proportional_gain": 10000, "tuning.reset_time": 6000, "sample_rate": 30},
        output="CO",
        flags=("freeze_bias",),
        alarms=PV_ALARMS,
        deviations=("alarms.deviation.high", "alarms.deviation.high_high"),
        deadband="error.deadband",
    ),
    "ezlogix": Keys(
        "tuning.proportional_gain",
        "tuning.integral_time",
        "off",
        "tuning.derivative_time",
        "sample_rate",
        "setpoint.value",
        ("pv.range.0", "pv.range.1"),
        ("output.limits.0", "output.limits.1"),
        {
            "action": {**CONTROL},
            "pv.square_root": BOTH,
            "algorithm": {"position": "velocity", "velocity": "position"},
        },
        {"mode": "manual"},
        {"tuning.proportional_gain": 99.99, "tuning.integral_time": 6000, "sample_rate": 99.99},
        output="CV",
        flags=("anti_windup",),
        deadband="deadband",
    ),
    "nextopid": Keys(
        "Kp",
        "Ti_Ki",
        0.0,
        "Td_Kd",
        "sample_time",
        "SP",
        ("MinPV", "MaxPV"),
        ("MinMV", "MaxMV"),
        {"Direct": BOTH, "Indep": BOTH},
        {"Manual": True},
        set_key="SP",
        output="MV",
        deadband="DeadBand",
    ),
    "dpide": Keys(
        "Kc_Kp",
        "Ti_Ki",
        0.0,
        "Td_Kd",
        "CYCLE",
        "SV",
        ("pv.range.0", "pv.range.1"),
        ("MV_MIN", "MV_MAX"),
        {"PID_DIR": BOTH, "PID_EQ": BOTH},
        {"PID_MAN": True},
        set_key="SV",
        output="MV",
        deadband="ERR_DBW",
    ),
    "generic": Keys(
        "tuning.gain",
        "tuning.integral_time",
        "off",
        "tuning.derivative_time",
        "sample_time",
        "setpoint.value",
        ("pv.range.0", "pv.range.1"),
        ("output.limits.0", "output.limits.1"),
        {"output_raises_pv": BOTH, "pv.square_root": BOTH},
        {"mode": "manual"},
        flags=("anti_windup",),
        alarms=PV_ALARMS,
        deviations=("alarms.deviation.high", "alarms.deviation.high_high"),
        deadband="deadband",
    ),
}
ABSENT = {"Direct": False, "Indep": False, "pv.square_root": False, "error.curve": "linear"}
"""What a switch is that is not written."""


@dataclass(frozen=True)
class Spoil:
    """One mistake; ``intent``: a file may well say this on purpose."""

    name: str
    config: Data
    scenario: Data
    intent: bool = False


# --- paths ------------------------------------------------------------------------------------------------------------


def step_into(node: Any, key: str) -> Any:
    """A part of a mapping or list; None where there is none."""
    if isinstance(node, list):
        return node[int(key)] if key.isdigit() and int(key) < len(node) else None
    return node.get(key) if isinstance(node, dict) else None


def value_at(node: Any, path: str) -> Any:
    """What a dotted path leads to; None where there is nothing."""
    for key in path.split("."):
        node = step_into(node, key)
    return node


def put(node: Any, path: str, value: object) -> None:
    """Writes a value; sections that are not there are made."""
    *way, last = path.split(".")
    for key in way:
        inner = step_into(node, key)
        if inner is None:
            inner = node[key] = [0, 100] if key == "limits" else {}
        node = inner
    if isinstance(node, list):
        node[int(last)] = value
    else:
        node[last] = value


def number(value: object) -> float | None:
    """A number, or a time with its unit in s; None: something else."""
    if isinstance(value, bool):
        return None
    if isinstance(value, int | float):
        return float(value)
    try:
        return float(parse_seconds(value)) if isinstance(value, str) else None
    except ValueError:
        return None


def times(value: object, factor: float, most: float = 1e9) -> object:
    """A number or a time made larger, in the form that it had."""
    plain = number(value)
    if plain is None:
        return None
    new = min(plain * factor, most)
    new = round(new, 4) if isinstance(value, float | str) or new != int(new) else int(new)
    return None if new == plain else f"{new:g} s" if isinstance(value, str) else new


# --- the mistakes -----------------------------------------------------------------------------------------------------

Edit = Callable[[Data, Data], bool]
"""Changes both files; False: it does not fit."""


def spoils(config: Data, scenario: Data) -> Iterator[Spoil]:
    """All mistakes that fit an example; written expectations are taken out."""
    bare = {key: value for key, value in scenario.items() if key != "expect"}
    names: set[str] = set()
    for name, edit, intent in edits(config, bare):
        one, two = copy.deepcopy((config, bare))
        if name not in names and edit(one, two) and (one, two) != (config, bare):
            names.add(name)
            yield Spoil(name, one, two, intent)


def edits(config: Data, scenario: Data) -> Iterator[tuple[str, Edit, bool]]:
    """Names of mistakes and how to make them."""
    keys = VENDORS[config["vendor"]]
    for i, loop in enumerate(config["loops"]):
        for name, change in of_loop(keys, loop):
            yield f"{loop['name']}: {name}", in_loop(i, change), False
        for name, edit, intent in of_run(keys, config, scenario, i):
            yield f"{loop['name']}: {name}", edit, intent
    for key in plant_keys(scenario):
        for name, change in of_plant(plant_at(scenario, key)):
            yield f"plant {plant_name(scenario, key)}: {name}", in_plant(key, change), False
    for i, block in enumerate(config.get("blocks", ())):
        for name, value in of_block(block):
            yield f"block {block['name']}: {name} {value}", in_block(i, name, value), False
    yield from of_all(config, scenario)


def in_loop(i: int, change: Callable[[Data], object]) -> Edit:
    """An edit of one loop."""
    return lambda config, _: change(config["loops"][i]) is not False


def in_block(i: int, key: str, value: object) -> Edit:
    """An edit of one block."""
    return lambda config, _: config["blocks"][i].update({key: value}) is None


def writes(values: dict[str, object]) -> Callable[[Data], object]:
    """A change that writes keys."""

    def change(loop: Data) -> object:
        for path, value in values.items():
            put(loop, path, value)
        return None not in values.values()

    return change


def of_loop(keys: Keys, loop: Data) -> Iterator[tuple[str, Callable[[Data], object]]]:
    """Mistakes in one loop of the configuration."""
    for path, turned in keys.switches.items():
        now = value_at(loop, path)
        now = ABSENT.get(path) if now is None else now
        if now in turned:
            yield f"{path} {turned[now]}", writes({path: turned[now]})
    for path, factors in (
        (keys.gain, (10, 0.1, 30, 0.03)),
        (keys.reset, (60, 1 / 60, 10, 0.1)),
        (keys.rate, (60, 10)),
        (keys.sample, (20,)),
    ):
        for factor in factors:
            yield (
                f"{path} × {factor:.2g}",
                writes({path: times(value_at(loop, path), factor, keys.most.get(path, 1e9))}),
            )
    yield "no reset", writes({keys.reset: keys.no_reset})
    for path in keys.flags:
        yield f"{path} off", writes({path: False if value_at(loop, path) else None})
    yield from of_ranges(keys, loop)
    yield from of_alarms(keys, loop)
    if value_at(loop, "output.pulse.cycle_time") is not None:
        yield "pulses × 50", writes({"output.pulse.cycle_time": times(loop["output"]["pulse"]["cycle_time"], 50)})
    for key in ("SP_CASC", "TRK_VAL", "OVERR", "CASC", "Windup_H_IN", "PV"):
        if isinstance(loop.get(key), str):
            yield f"{key} not wired", lambda one, key=key: one.pop(key)


def ends(loop: Data, paths: tuple[str, str], fallback: tuple[float, float] = (0.0, 100.0)) -> tuple[float, float]:
    """A range of a loop."""
    low, high = (number(value_at(loop, path)) for path in paths)
    return fallback if low is None or high is None else (low, high)


def span_of(keys: Keys, loop: Data) -> tuple[float, float]:
    """The range of a loop's PV."""
    return ends(loop, keys.span)


def of_ranges(keys: Keys, loop: Data) -> Iterator[tuple[str, Callable[[Data], object]]]:
    """Set point, limits and ranges."""
    low, high = span_of(keys, loop)
    span, (least, most) = high - low, ends(loop, keys.limits, ends(loop, ("output.range.0", "output.range.1")))
    stroke = most - least
    for name, sp in (("above its range", high + span), ("below its range", low - span / 2)):
        yield f"set point {name}", writes({keys.setpoint: sp})
    for name, one, two in (
        ("crossed", most, least),
        ("the lowest tenth", least, least + 0.1 * stroke),
        ("the highest tenth", most - 0.1 * stroke, most),
        ("of a tenth, in %", least / 10, most / 10),
        ("equal", least, least),
    ):
        yield f"output limits {name}", writes(dict(zip(keys.limits, (one, two), strict=True)))
    for name, one, two in (
        ("× 10", low, low + 10 * span),
        ("÷ 10", low, low + span / 10),
        ("crossed", high, low),
        ("shifted", low + span / 2, high + span / 2),
    ):
        yield f"PV range {name}", writes(dict(zip(keys.span, (one, two), strict=True)))
    if keys.deadband:
        yield "deadband of a fifth", writes({keys.deadband: span / 5})


def of_alarms(keys: Keys, loop: Data) -> Iterator[tuple[str, Callable[[Data], object]]]:
    """Alarms that refuse Auto, stand, or are in the wrong order."""
    low, high = span_of(keys, loop)
    span = high - low
    if keys.alarms:
        for name, shares in (
            ("above the PV", (0.94, 0.95, 0.97, 0.99)),
            ("below the PV", (0.0, 0.001, 0.002, 0.004)),
            ("in the wrong order", (0.9, 0.6, 0.4, 0.1)),
            ("of which the inner two are crossed", (0.01, 0.9, 0.1, 0.99)),
            ("with a high-high at the set point", (0.001, 0.002, 0.003, 0.01)),
        ):
            yield (
                f"alarms {name}",
                writes({p: round(low + s * span, 3) for p, s in zip(keys.alarms, shares, strict=True)}),
            )
    if keys.deviations:
        inner, outer = keys.deviations
        yield "deviation alarms crossed", writes({inner: round(0.2 * span, 3), outer: round(0.02 * span, 3)})


def of_run(keys: Keys, config: Data, scenario: Data, i: int) -> Iterator[tuple[str, Edit, bool]]:
    """What happens to one loop, and how it is connected."""
    loop = config["loops"][i]
    name, (low, high), duration = loop["name"], span_of(keys, loop), number(scenario["duration"]) or 0.0
    for what, value in (("at its lowest", low), ("at its highest", high), ("stuck", low + 0.37 * (high - low))):
        for share in (0.05, 0.6):
            yield f"sensor {what} from {share:.0%}", event(at=share * duration, loop=name, pv=value), False
    top = high - 0.001 * (high - low)
    yield "set point at the end of its range", in_loop(i, writes({keys.setpoint: top})), True
    yield "set point far above", event(at=duration / 20, loop=name, set={keys.set_key: top}), True
    yield "manual for ever", event(at=duration / 20, loop=name, mode="manual"), True
    yield "is meant for manual", in_loop(i, writes(keys.manual)), True
    yield (
        "gain × 20 by an event",
        event(
            at=duration / 20,
            loop=name,
            set={keys.gain: times(value_at(loop, keys.gain), 20, keys.most.get(keys.gain, 1e9))},
        ),
        False,
    )
    yield "PV not connected", in_connections(f"{name}.PV", None), False
    for what, text in (("× 10", "10 * ({})"), ("÷ 10", "({}) / 10"), ("of the wrong sign", "0 - ({})")):
        yield f"PV connected {what}", in_connections(f"{name}.PV", text), False
    yield "no plant", without_plant(name), False
    yield "mode events removed", without_events(lambda one: one.get("loop") == name and "mode" in one), True
    yield "profile not started", without_events(lambda one: one.get("loop") == name and "ramp_soak" in one), True
    for other in config["loops"]:
        if other is not loop:
            yield f"plant changed with {other['name']}", swapped(name, other["name"]), False
            yield (
                f"its output wired to the plants of {other['name']}",
                outputs_swapped(name, other["name"], keys.output),
                False,
            )
            yield from of_cascade(i, loop, str(other["name"]))


def of_cascade(i: int, loop: Data, other: str) -> Iterator[tuple[str, Edit, bool]]:
    """Wrong links of a cascade."""
    if "cascade_from" in loop:
        yield f"cascade from {other}", in_loop(i, writes({"cascade_from": other})), False
        yield "auto in place of cascade", in_loop(i, writes({"mode": "auto"})), False
        yield "cascade from nowhere", in_loop(i, lambda one: one.pop("cascade_from")), False
    if value_at(loop, "setpoint.source") is not None:
        yield f"set point from {other}", in_loop(i, writes({"setpoint.source": other})), False
        yield "auto in place of cascade", in_loop(i, writes({"mode": "auto"})), False
    if isinstance(loop.get("SP_CASC"), str):
        yield f"SP_CASC from {other}", in_loop(i, writes({"SP_CASC": f"{other}.PV"})), False
    for key in ("TRK_VAL", "TRK_IN", "OVERR"):
        if isinstance(loop.get(key), str) and "." in loop[key]:
            wrong = {"TRK_VAL": f"{other}.SP", "TRK_IN": f"{other}.Windup_H_OUT", "OVERR": f"{other}.Windup_H_OUT"}[key]
            yield f"{key} from {wrong}", in_loop(i, writes({key: wrong})), False


def of_all(config: Data, scenario: Data) -> Iterator[tuple[str, Edit, bool]]:
    """What concerns all loops."""
    duration = number(scenario["duration"]) or 0.0
    loops = len(config["loops"])
    if config["vendor"] == "dl06":
        for count in {0, loops - 1, 9}:
            yield f"number of loops {count}", plc_option("number_of_loops", count), False
    stop = "program" if config["vendor"] == "dl06" else "stop"
    yield "CPU stopped", event(at=duration / 3, plc=stop), True
    for key in ("loop_table", "sample_time"):
        if key in config.get("plc", {}):
            new = {"loop_table": "V17700", "sample_time": times(config["plc"].get("sample_time"), 50)}[key]
            yield f"plc.{key} {new}", lambda one, _, key=key, new=new: one["plc"].update({key: new}) is None, False
    for signal, value in config.get("signals", {}).items():
        if isinstance(value, bool):
            turned = lambda one, _, signal=signal, value=value: one["signals"].update({signal: not value}) is None  # noqa: E731
            yield f"signal {signal} turned", turned, True


def of_block(block: Data) -> Iterator[tuple[str, object]]:
    """Mistakes in a block of a program."""
    yield from (
        (key, new)
        for key, now, new in (
            ("type", "ControlSelectMin", "ControlSelectMax"),
            ("type", "ControlSelectMax", "ControlSelectMin"),
            ("Mode", 4, 1),
            ("Mode", 4, 2),
            ("Mode", 4, 3),
            ("SPLIT", 40, 95),
            ("SPLIT", 40, 5),
        )
        if block.get(key) == now
    )
    for key, factor in (("Period", 50), ("Tc", 100), ("MaxMV", 10), ("G", -1)):
        if number(block.get(key)) is not None:
            yield key, times(block[key], factor)
    if {"MV1", "MV2"} <= set(block):
        yield "MV1", block["MV2"]
        yield "MV2", block["MV1"]


# --- plants and events ------------------------------------------------------------------------------------------------


def plant_keys(scenario: Data) -> list[Any]:
    """The names or places of the plants."""
    plants = scenario.get("plants", {})
    return list(range(len(plants))) if isinstance(plants, list) else list(plants)


def plant_at(scenario: Data, key: Any) -> Data:
    """One plant."""
    plant: Data = scenario["plants"][key]
    return plant


def plant_name(scenario: Data, key: Any) -> str:
    """What a plant is called."""
    return str(plant_at(scenario, key).get("name", key))


def in_plant(key: Any, change: Callable[[Data], object]) -> Edit:
    """An edit of one plant."""
    return lambda _, scenario: change(plant_at(scenario, key)) is not False


def of_plant(plant: Data) -> Iterator[tuple[str, Callable[[Data], object]]]:
    """A process that is not as it was thought."""
    gain, load = number(plant.get("gain", 1)) or 0.0, number(plant.get("load", 0)) or 0.0
    for name, factor in (("of the wrong sign", -1.0), ("× 10", 10.0), ("÷ 10", 0.1), ("0", 0.0)):
        yield f"gain {name}", writes({"gain": gain * factor})
    if number(plant.get("dead_time")):
        for factor in (5, 20):
            yield f"dead time × {factor}", writes({"dead_time": times(plant["dead_time"], factor)})
    if number(plant.get("time_constant")):
        for factor in (20, 1 / 20):
            yield f"time constant × {factor:.2g}", writes({"time_constant": times(plant["time_constant"], factor)})
    reach = 150 * abs(gain)
    yield "load far up", writes({"load": load + reach})
    yield "load far down", writes({"load": load - reach})
    if "input" in plant:
        yield "input of 0", writes({"input": "0"})


def in_connections(key: str, text: str | None) -> Edit:
    """What a PV is connected to, another way; None: to nothing."""

    def edit(_: Data, scenario: Data) -> bool:
        connections = scenario.get("connect", {})
        if key not in connections:
            return False
        if text is None:
            del connections[key]
        else:
            connections[key] = text.format(connections[key])
        return True

    return edit


def without_plant(name: str) -> Edit:
    """No plant for a loop."""
    return lambda _, scenario: (
        isinstance(scenario.get("plants"), dict) and scenario["plants"].pop(name, None) is not None
    )


def without_events(removed: Callable[[Data], bool]) -> Edit:
    """Events left out."""

    def edit(_: Data, scenario: Data) -> bool:
        before = scenario.get("events", [])
        scenario["events"] = [one for one in before if not removed(one)]
        return scenario["events"] != before

    return edit


def event(**what: object) -> Edit:
    """One more event."""

    def edit(_: Data, scenario: Data) -> bool:
        scenario["events"] = [*scenario.get("events", ()), dict(what)]
        return not isinstance(what.get("set"), dict) or None not in what["set"].values()

    return edit


def plc_option(key: str, value: object) -> Edit:
    """An option of the virtual PLC."""
    return lambda _, scenario: scenario.setdefault("plc", {}).update({key: value}) is None


def swapped(one: str, other: str) -> Edit:
    """The plants of two loops in each other's place: the wires of two sensors and two valves are mixed up."""

    def edit(_: Data, scenario: Data) -> bool:
        plants = scenario.get("plants")
        if not isinstance(plants, dict) or not {one, other} <= set(plants) or one > other:
            return False
        plants[one], plants[other] = plants[other], plants[one]
        return True

    return edit


def outputs_swapped(one: str, other: str, output: str) -> Edit:
    """Plants that read one loop's output read the other's, and the other way round: two valves are mixed up."""
    first, second = f"{one}.{output}", f"{other}.{output}"

    def edit(_: Data, scenario: Data) -> bool:
        changed = False
        for key in plant_keys(scenario) if one < other else ():
            plant = plant_at(scenario, key)
            text = str(plant.get("input", f"{key}.{output}"))
            if first in text or second in text:
                plant["input"] = text.replace(first, "\0").replace(second, first).replace("\0", second)
                changed = True
        return changed

    return edit
