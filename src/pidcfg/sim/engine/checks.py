"""What a scenario's schema cannot say: which keys go together, and names that only the PLC knows."""

from __future__ import annotations

from collections.abc import Iterator
from decimal import Decimal
from math import inf

from pydantic_core import PydanticCustomError

from pidcfg.schemas.expressions import FUNCTIONS, NUMBER
from pidcfg.schemas.numbers import parse_number
from pidcfg.schemas.scenario import Bound, Event, Expectation, ForbiddenMode, Plant, Scenario
from pidcfg.sim.controllers.plc import CONTROL_MODES, TICKS, Plc
from pidcfg.sim.engine.expressions import Problem, unknown_name
from pidcfg.text.paths import Path, dotted_text, leaves, parse_path

# ----------------------------------------------------------------------------------------------------------------------
# What an expectation may say: one subject with the keys that go with it, names that exist, bounds that can be met.

KEYS_BY_SUBJECT = {
    "metric": {"loop", "metric", "band", "min", "max"},
    "signal": {"signal", "min", "max", "final", "tolerance", "from", "until"},
    "alarm": {"loop", "alarm", "never", "at", "tolerance", "before", "after"},
    "flag": {"loop", "flag", "is"},
    "autotune": {"loop", "autotune", "min", "max", "is"},
    "mode": {"loop", "mode", "at"},
}
"""What an expectation can be about, and the keys that go with it."""
BOUND_UNITS = {
    "overshoot": ("", "%"),
    "settling_time": ("", "s"),
    "rise_time": ("", "s"),
    "oscillation_period": ("", "s"),
}
"""Units that the bounds of a metric may carry; none by default."""


def check_expectation(path: Path, expectation: Expectation, scenario: Scenario, plc: Plc) -> Iterator[Problem]:
    """One subject with the keys that go with it, and a bound."""
    fields = type(expectation).model_fields
    given_keys = {fields[name].alias or name for name in expectation.model_fields_set}
    subjects = [key for key in KEYS_BY_SUBJECT if key in given_keys]
    if len(subjects) != 1:
        message = f"an expectation about {' and '.join(subjects)}" if subjects else "an expectation about nothing"
        yield Problem(path, message, help=f"one of {', '.join(KEYS_BY_SUBJECT)} is expected", key=True)
        return
    subject = subjects[0]
    for key in sorted(given_keys - KEYS_BY_SUBJECT[subject] - {"share"}):
        keys = ", ".join(sorted(KEYS_BY_SUBJECT[subject]))
        yield Problem((*path, key), f"{key} does not go with {subject}", help=f"known keys here: {keys}", key=True)
    yield from _check_names(path, subject, expectation, plc, scenario)
    yield from _check_bounds(path, subject, expectation, given_keys)
    yield from _check_possible(path, subject, expectation, scenario.duration)
    if expectation.share is not None and not 0 < expectation.share < 100:
        cure = "without share no sample may fail" if expectation.share >= 100 else "write it like 99 %"
        yield Problem((*path, "share"), f"samples cannot show a share of {expectation.share:f} %", "value", help=cure)
    times = {
        "at": expectation.at,
        "before": expectation.before,
        "after": expectation.after,
        "from": expectation.start,
        "until": expectation.until,
    }
    for key, time in times.items():
        if time is not None and not 0 <= time <= scenario.duration:
            yield Problem(
                (*path, key), f"{key} {time:f} s is outside the scenario (0 to {scenario.duration:f} s)", "value"
            )


def _check_names(path: Path, subject: str, expectation: Expectation, plc: Plc, scenario: Scenario) -> Iterator[Problem]:
    """Names of loops, signals, alarms, modes and flags."""
    if expectation.loop is not None and expectation.loop not in plc.loops:
        yield unknown_name((*path, "loop"), "loop", expectation.loop, plc.loops)
    elif expectation.loop is None and subject not in {"signal", "flag"}:
        yield Problem((*path, subject), f"{subject} needs a loop", help="add 'loop: …'", key=True)
    plants = [text.name for text in scenario.plants.values() if text.name]
    names = {
        "signal": [name for name in plc.signals if name] + [*scenario.signals, *plants],
        "alarm": list(plc.alarm_bits),
        "mode": list(plc.modes),
        "flag": list(plc.error_words) if expectation.loop is None else [*plc.flag_bits, *plc.aux_bits],
        "autotune": ["done", "error", *plc.tuned_names],
    }.get(subject)
    name = getattr(expectation, subject)
    if isinstance(name, ForbiddenMode):
        name, path = name.mode, (*path, "mode")
        subject = "never"
    if names is not None and name not in names:
        yield unknown_name(
            (*path, subject), {"autotune": "result of auto-tune", "never": "mode"}.get(subject, subject), name, names
        )


def _check_bounds(path: Path, subject: str, expectation: Expectation, given_keys: set[str]) -> Iterator[Problem]:
    """Something must be demanded, in a unit that fits."""
    needs = {"metric": {"min", "max"}, "signal": {"min", "max", "final"}, "alarm": {"never", "at", "before", "after"}}
    if subject in needs and not needs[subject] & given_keys:
        yield Problem(
            path, f"nothing is expected of the {subject}", help=f"add {' or '.join(sorted(needs[subject]))}", key=True
        )
    if subject == "autotune" and expectation.autotune in {"done", "error"} and {"min", "max"} & given_keys:
        yield Problem(path, f"{expectation.autotune} is true or false", help="use 'is: true'", key=True)
    if ("final" in given_keys) != ("tolerance" in given_keys) and subject == "signal":
        yield Problem(path, "final and tolerance belong together", help="final: 50, tolerance: 0.5", key=True)
    if (
        subject == "alarm"
        and "never" in given_keys
        and ({"at", "after"} & given_keys or ("before" in given_keys and not expectation.never))
    ):
        yield Problem((*path, "never"), "an alarm that never comes has no time; 'before' may limit it", key=True)
    if isinstance(expectation.mode, ForbiddenMode) and "at" in given_keys:
        yield Problem((*path, "at"), "a mode that never comes has no time", key=True)
    if expectation.band is not None and not (expectation.metric == "settling_time" and 0 < expectation.band < 100):
        yield Problem(
            (*path, "band"), "band is the share (above 0 %, below 100 %) of the step in settling_time", key=True
        )
    units: tuple[str, ...] = BOUND_UNITS.get(expectation.metric or "", ("",))
    for key in ("min", "max"):
        bound: Bound | None = getattr(expectation, key)
        if bound is not None and bound.unit not in units:
            has = " or ".join(unit or "a plain number" for unit in units)
            yield Problem(
                (*path, key),
                f"{key} of {expectation.metric or subject} cannot be in {bound.unit}",
                "value",
                help=f"write {has}",
            )


def _check_possible(path: Path, subject: str, expectation: Expectation, duration: Decimal) -> Iterator[Problem]:
    """Something must be able to pass."""
    if expectation.metric not in {None, "final_error"} and expectation.max is not None and expectation.max.value < 0:
        yield Problem((*path, "max"), f"{expectation.metric} is never below 0: no value passes", "value")
    if (
        "s" in BOUND_UNITS.get(expectation.metric or "", ())
        and expectation.min is not None
        and expectation.min.value > duration
    ):
        message = f"{expectation.metric} is never above the {duration:f} s that the scenario has: no value passes"
        yield Problem((*path, "min"), message, "value", help="write less, or lengthen the duration")
    if expectation.min is not None and expectation.max is not None and expectation.min.value > expectation.max.value:
        message = f"min {expectation.min.value:f} is above max {expectation.max.value:f}: no value passes"
        yield Problem((*path, "min"), message, "value", help="write the smaller number as min")
    if expectation.start is not None and expectation.until is not None and expectation.start > expectation.until:
        yield Problem((*path, "from"), "from comes after until", "value")
    if expectation.before is not None and expectation.after is not None and expectation.after > expectation.before:
        message = f"before {expectation.before:f} s and after {expectation.after:f} s: no alarm is both"
        yield Problem((*path, "after"), message, "value", help="write the earlier time as after")
    if expectation.tolerance is not None and expectation.tolerance.value < 0:
        message = f"tolerance is {expectation.tolerance.value:f}: no value passes"
        yield Problem((*path, "tolerance"), message, "value", help="write 0 or more")
    if subject == "flag" and expectation.loop is not None and expectation.value not in {None, False, True}:
        yield Problem((*path, "is"), "a loop's flag is true or false", "value", help="write true or false")


# --- What a scenario's schema cannot say: which keys go together, and names that only the configuration knows ---------

MIN_SAMPLES = 10
"""Of a loop: in fewer nothing of it can be judged."""
LARGEST_NUMBER = Decimal("1e12")
"""Largest magnitude of a plant's number; larger ones are typing mistakes and would overflow the arithmetic."""
SMALLEST_NUMBER = 1 / LARGEST_NUMBER
"""Smallest number of those that are above 0; the square of a smaller one is lost in the arithmetic."""

ACTIONS = ("set", "disturb", "mode", "ramp_soak", "autotune", "pv", "plc")
LOOP_ACTIONS = ("mode", "ramp_soak", "autotune", "pv")

MODEL_KEYS = {
    "first_order": (("time_constant",),),
    "second_order": (("time_constants",), ("time_constant", "damping")),
    "integrator": ((),),
    "lead_lag": (("lead", "lag"),),
    "dead_time": ((),),
    "valve": ((), ("stiction",), ("rate_limit",), ("stiction", "rate_limit")),
    "pulses": (("period",), ("period", "resolution")),
}
"""For each model the sets of keys of which it takes exactly one, besides the keys of every plant."""
PLANT_KEYS = (
    "time_constant",
    "time_constants",
    "damping",
    "lead",
    "lag",
    "stiction",
    "rate_limit",
    "period",
    "resolution",
)
TIME_KEYS = ("time_constant", "time_constants", "lag", "lead", "dead_time", "period", "resolution")
POSITIVE_KEYS = ("time_constant", "time_constants", "lag", "rate_limit", "period", "resolution")
NOT_NEGATIVE_KEYS = ("damping", "lead", "dead_time", "stiction", "noise")
DISTURBED_KEYS = ("gain", "load", "noise", "time_constant", "damping", "lead", "lag", "stiction", "rate_limit")


def check_scenario(scenario: Scenario, plc: Plc) -> Iterator[Problem]:
    """Everything that is wrong with a scenario apart from its expressions."""
    for option in sorted(scenario.plc.model_fields_set - set(plc.options)):
        yield unknown_name(("plc", option), "option of this PLC", option, plc.options, key=True)
    yield from _check_times(scenario)
    for name in sorted({loop for loop in plc.loops if list(plc.loops).count(loop) > 1}):
        message = f"the configuration has several loops with the name {name}"
        yield Problem(("config",), message, "value", help="each loop needs a name of its own")
    yield from _check_initial(scenario, plc)
    named = [(("plants", key, "name"), plant.name) for key, plant in scenario.plants.items()]
    for path, label in [*named, *((("signals", name), name) for name in scenario.signals)]:
        if label is not None and (label in FUNCTIONS or NUMBER.fullmatch(label)):
            cure = "give it a name that is neither a number nor a function"
            yield Problem(path, f"{label!r} already means something in expressions", "value", help=cure)
    for name, value in scenario.signals.items():
        yield from _check_signal(("signals", name), name, value)
    for key, plant in scenario.plants.items():
        yield from check_plant(("plants", key), plant)
    for i, event in enumerate(scenario.events):
        yield from _check_event(("events", i), event, scenario, plc)
    for i, expectation in enumerate(scenario.expect):
        yield from check_expectation(("expect", i), expectation, scenario, plc)
    yield from _check_standing(scenario, plc)


def _max_tolerance(tolerance: Bound, pv_range: tuple[float, float] | None) -> float:
    """The span of a PV in the unit of a tolerance; without end where there is no range."""
    if tolerance.unit == "%":
        return 100.0
    return inf if pv_range is None else abs(pv_range[1] - pv_range[0])


def _check_standing(scenario: Scenario, plc: Plc) -> Iterator[Problem]:
    """Loops that standing expectations name, reasons, and a run that is too short to be judged."""
    for i, entry in enumerate(scenario.allow):
        if entry.loop not in plc.loops:
            yield unknown_name(("allow", i, "loop"), "loop", entry.loop, plc.loops)
        if not entry.reason.strip():
            yield Problem(("allow", i, "reason"), "the reason is empty", "value", help="say why the loop may")
    for name, tolerance in scenario.tolerance.items():
        if name not in plc.loops:
            yield unknown_name(("tolerance", name), "loop", name, plc.loops, key=True)
        elif tolerance.value <= 0 or tolerance.unit == "s":
            cure = "write it in the PV's unit, or in % of its span"
            message = f"the tolerance of {name} is {tolerance.value:f}{tolerance.unit}; it must be above 0"
            yield Problem(("tolerance", name), message, "value", help=cure)
        elif tolerance.value >= (max_tolerance := _max_tolerance(tolerance, plc.pv_range(plc.loops.index(name)))):
            message = (
                f"a tolerance of {tolerance.value:f}{tolerance.unit and ' %'} passes whatever the PV of {name} does"
            )
            cure = f"write less than {max_tolerance:g}{tolerance.unit and ' %'}, the span"
            yield Problem(("tolerance", name), message, "value", help=cure)
    for key in ("assumed_signs", "loops"):
        for i, name in enumerate(getattr(scenario, key) or ()):
            if name not in plc.loops:
                yield unknown_name((key, i), "loop", name, plc.loops)
    if scenario.loops is not None and not scenario.loops:
        yield Problem(("loops",), "no loop is judged", "value", help="name the loops, or leave out the key")
    yield from _check_length(scenario, plc)


def _check_length(scenario: Scenario, plc: Plc) -> Iterator[Problem]:
    """A run in which nothing can be judged: shorter than a sample, or with too few of them for every loop (D562)."""
    cure = "nothing can be judged; let the scenario run longer"
    periods = [config.period for config in plc.configs[: len(plc.loops)]]
    judged_periods = [
        period
        for name, goal, period in zip(plc.loops, plc.initial_modes, periods, strict=True)
        if goal in CONTROL_MODES and period and (scenario.loops is None or name in scenario.loops)
    ]
    slowest, fewest = max(periods, default=0), MIN_SAMPLES * min(judged_periods, default=0)
    if 0 < scenario.duration * TICKS < slowest:
        message = f"{scenario.duration:f} s are shorter than a sample of the slowest loop, {slowest / TICKS:g} s"
        yield Problem(("duration",), message, "value", help=cure)
    elif 0 < scenario.duration * TICKS < fewest:
        message = f"{scenario.duration:f} s are shorter than {MIN_SAMPLES} samples of any loop, {fewest / TICKS:g} s"
        yield Problem(("duration",), message, "value", help=cure)


def _check_times(scenario: Scenario) -> Iterator[Problem]:
    if scenario.step is not None and scenario.plc.scan_time is not None:
        cure = "leave out 'step': the scan time is the base step"
        yield Problem(("step",), "step and plc.scan_time do not go together", help=cure, key=True)
    times = {"duration": scenario.duration, "step": scenario.step, "plc.scan_time": scenario.plc.scan_time}
    for key, time in times.items():
        if time is None:
            continue
        path = parse_path(key)
        if time <= 0:
            message = f"{path[-1]} is {time:f} s; it must be above 0 s"
            yield Problem(path, message, "value", help="write a time, as in 10 or 10 min")
        elif key != "duration" and time * TICKS != int(time * TICKS):
            yield Problem(path, f"{path[-1]} is no whole number of microseconds", "value")
        elif time > LARGEST_NUMBER:
            yield Problem(path, f"{path[-1]} is beyond {LARGEST_NUMBER:g} s", "value")


def _check_initial(scenario: Scenario, plc: Plc) -> Iterator[Problem]:
    """Outputs that loops start with."""
    for loop, value in scenario.initial.items() if isinstance(scenario.initial, dict) else ():
        path = ("initial", loop)
        if loop in plc.loops:
            yield from _check_value(path, loop, plc, ("output",), value)
        else:
            yield unknown_name(path, "loop", loop, plc.loops, key=True)


def _check_value(path: Path, loop: str, plc: Plc, keys: tuple[str, ...], value: object) -> Iterator[Problem]:
    """What the controller has against a value."""
    try:
        plc.check_set(plc.loops.index(loop), keys, value)
    except PydanticCustomError as error:
        cure = (error.context or {}).get("help")
        yield Problem(path, f"{dotted_text(keys)}: {error.message()}", "value", help=cure, loop=loop)


def check_plant(path: Path, plant: Plant) -> Iterator[Problem]:
    """Numbers within reason, and the keys that the model needs."""
    plant_keys = tuple(key for key in PLANT_KEYS if key in plant.model_fields_set)
    allowed_keys = MODEL_KEYS[plant.model]
    for key in plant_keys:
        if not any(key in keys for keys in allowed_keys):
            takes = " or ".join(" and ".join(keys) for keys in allowed_keys if keys) or "none of its own"
            yield Problem((*path, key), f"{plant.model} has no {key}", help=f"it takes {takes}", key=True)
    if not any(set(plant_keys) == set(keys) for keys in allowed_keys) and all(
        any(k in keys for keys in allowed_keys) for k in plant_keys
    ):
        expectation = " or ".join(" and ".join(keys) for keys in allowed_keys if keys)
        yield Problem(
            (*path, "model"), f"{plant.model} needs {expectation}", help="add it, and nothing else of the two"
        )
    for key, value in _plant_numbers(plant):
        unit = " s" if key in TIME_KEYS else ""
        if abs(value) > LARGEST_NUMBER:
            yield Problem((*path, key), f"{key} is beyond {LARGEST_NUMBER:g}", "value")
        elif key in POSITIVE_KEYS and value < SMALLEST_NUMBER:
            tiny = (
                f"is below {SMALLEST_NUMBER:g}{unit}" if value > 0 else f"is {value:f}{unit}; it must be above 0{unit}"
            )
            cure = "a plant without a lag is dead_time" if key not in {"period", "resolution"} else None
            yield Problem((*path, key), f"{key} {tiny}", "value", help=cure)
        elif key in NOT_NEGATIVE_KEYS and value < 0:
            message = f"{key} is {value:f}{unit}; it must not be negative"
            yield Problem((*path, key), message, "value", help="write 0 or more")
    if plant.initial is not None and plant.limits and not plant.limits[0] <= plant.initial <= plant.limits[1]:
        low, high = plant.limits
        message = f"initial, {plant.initial:f}, is outside its limits, {low:f} to {high:f}"
        yield Problem((*path, "initial"), message, "value", help="begin inside the limits, or widen them")
    yield from _check_pulses(path, plant)


def _check_pulses(path: Path, plant: Plant) -> Iterator[Problem]:
    """What pulses cannot be."""
    if plant.model != "pulses":
        return
    if plant.dead_time:
        cure = "give the dead time to the plant that reads the pulses"
        yield Problem((*path, "dead_time"), "pulses have no dead time", help=cure, key=True)
    if plant.resolution is not None and plant.period is not None and plant.resolution > plant.period:
        message = f"the resolution, {plant.resolution:f} s, is above the period, {plant.period:f} s"
        yield Problem((*path, "resolution"), message, "value", help="write a part of the period")


def _plant_numbers(plant: Plant) -> Iterator[tuple[str, Decimal]]:
    for key in (*DISTURBED_KEYS, "dead_time", "initial", "period", "resolution"):
        value = getattr(plant, key)
        if value is not None:
            yield key, value
    for key in ("time_constants", "limits"):
        yield from ((key, value) for value in getattr(plant, key) or ())


def _check_event(path: Path, event: Event, scenario: Scenario, plc: Plc) -> Iterator[Problem]:
    """One action, at a time within the run, on something that exists."""
    actions = [key for key in ACTIONS if getattr(event, key) is not None]
    if len(actions) != 1:
        count_text = f"{' and '.join(actions)} in one event" if actions else "an event that does nothing"
        yield Problem(path, count_text, help=f"one of {', '.join(ACTIONS)} makes an event", key=True)
        return
    action = actions[0]
    if event.at < 0:
        yield Problem((*path, "at"), f"the event is at {event.at:f} s, before time 0", "value", help="write 0 or more")
    elif event.at > scenario.duration:
        message = f"the event at {event.at:f} s comes after the end of the scenario ({scenario.duration:f} s)"
        cure = "lengthen the duration, or move the event"
        yield Problem((*path, "at"), message, "too_late", "warning", help=cure)
    if event.duration is not None and (action != "pv" or event.duration <= 0):
        yield Problem((*path, "for"), "'for' is the time above 0 that a sensor stays broken (pv)", key=True)
    if event.loop is not None and event.loop not in plc.loops:
        yield unknown_name((*path, "loop"), "loop", event.loop, plc.loops)
    elif event.loop in plc.wired_loops and action == "pv":
        message = f"the PV of {event.loop} comes from the PLC's program; set the signal that it is made of"
        yield Problem((*path, "pv"), message, key=True)
    elif event.loop is None and action in LOOP_ACTIONS:
        yield Problem((*path, action), f"{action} needs a loop", help="add 'loop: …'", key=True)
    elif event.plant is not None and action != "disturb":
        yield Problem((*path, "plant"), "only a disturbance names a plant", key=True)
    elif action in {"set", "disturb"} and not any(leaves(getattr(event, action))):
        yield Problem((*path, action), f"{action} changes nothing", help=f"write {action}: {{KEY: VALUE}}", key=True)
    elif action == "set":
        yield from check_set(path, event, scenario, plc)
    elif action == "disturb":
        yield from _check_disturb(path, event, scenario)
    elif action == "mode" and event.mode not in plc.modes:
        yield unknown_name((*path, "mode"), "mode", event.mode, plc.modes)
    elif action == "plc" and event.loop is not None:
        yield Problem((*path, "loop"), "plc concerns the whole PLC, not a loop", key=True)
    elif action in plc.commands:
        yield from _check_command((*path, action), action, getattr(event, action), plc)


def _check_command(path: Path, action: str, command: str, plc: Plc) -> Iterator[Problem]:
    """A command that this PLC has."""
    known = plc.commands[action]
    if not known:
        yield Problem(path, f"this PLC has no {action.replace('_', '/')}", key=True)
    elif command not in known:
        yield unknown_name(path, f"command of {action} on this PLC", command, known)


def check_set(path: Path, event: Event, scenario: Scenario, plc: Plc) -> Iterator[Problem]:
    """New values of signals, or of a loop's parameters."""
    for keys, value, below in leaves(event.set):
        key_path = (*path, "set", *below)
        name = dotted_text(keys)
        if event.loop is not None:
            yield from _check_value(key_path, event.loop, plc, keys, value)
        elif name in plc.inputs:
            yield from _check_input(key_path, name, value, plc)
        elif name not in scenario.signals:
            known = [*scenario.signals, *plc.inputs]
            yield unknown_name(key_path, "signal of the scenario or the program", name, known, key=True)
        else:
            yield from _check_signal(key_path, name, value)


def _check_input(path: Path, name: str, value: object, plc: Plc) -> Iterator[Problem]:
    """The value of a signal of the PLC's program."""
    try:
        plc.check_input(name, value)
    except PydanticCustomError as error:
        yield Problem(path, f"{name}: {error.message()}", "value", help=(error.context or {}).get("help"))


def _check_signal(path: Path, name: str, value: object) -> Iterator[Problem]:
    """The value of a signal from outside."""
    try:
        number = parse_number(value)
    except PydanticCustomError as error:
        yield Problem(path, f"{name}: {error.message()}", "value", help=(error.context or {}).get("help"))
        return
    if abs(number) > LARGEST_NUMBER:
        yield Problem(path, f"{name} is beyond {LARGEST_NUMBER:g}", "value")


def _check_disturb(path: Path, event: Event, scenario: Scenario) -> Iterator[Problem]:
    """New values of a plant's numbers."""
    names = {text.name or key: text for key, text in scenario.plants.items()}
    name = event.plant or event.loop
    if name is None or name not in names or (event.plant and event.loop):
        known = [str(n) for n in names]
        yield unknown_name(
            (*path, "plant" if event.plant else "loop"), "plant of the scenario", name, known, key=name is None
        )
        return
    plant = names[name]
    for key, value in (event.disturb or {}).items():
        key_path = (*path, "disturb", key)
        changeable = [
            k for k in DISTURBED_KEYS if getattr(plant, k) is not None and (k not in PLANT_KEYS or _takes_key(plant, k))
        ]
        if key not in changeable:
            yield unknown_name(key_path, f"number of {name} that can change", key, changeable, key=True)
        elif (
            abs(value) > LARGEST_NUMBER
            or (value < 0 and key in NOT_NEGATIVE_KEYS)
            or (value < SMALLEST_NUMBER and key in POSITIVE_KEYS)
        ):
            yield Problem(key_path, f"{key} cannot be {value}", "value")


def _takes_key(plant: Plant, key: str) -> bool:
    return any(key in keys for keys in MODEL_KEYS[plant.model])
