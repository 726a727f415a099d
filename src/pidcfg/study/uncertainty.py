"""What a scenario's ``vary`` stands for: each uncertain number with its ends."""

from __future__ import annotations

from collections.abc import Iterator
from decimal import Decimal
from math import inf
from typing import Any, Literal, NamedTuple

from pydantic_core import PydanticCustomError

from pidcfg.schemas.base import DURATION, SECONDS, parse_seconds
from pidcfg.schemas.numbers import decimal_text
from pidcfg.schemas.scenario import Amount, Plant, Scenario, Spread, parse_amount
from pidcfg.sim.controllers.plc import SETPOINT, Plc
from pidcfg.sim.engine.checks import (
    LARGEST_NUMBER,
    MODEL_KEYS,
    NOT_NEGATIVE_KEYS,
    PLANT_KEYS,
    POSITIVE_KEYS,
    SMALLEST_NUMBER,
)
from pidcfg.sim.engine.expressions import Problem, unknown_name
from pidcfg.text.document import Document, Plain
from pidcfg.text.frozen import frozen
from pidcfg.text.paths import Path, dotted_text, leaves, parse_path, value_at
from pidcfg.text.references import Decision

D800 = Decision(
    800,
    "what varies, and when it is written",
    "A varied number of a plant takes the place of the file's. A varied key of a loop is written as an event `set` at "
    "0 s would write it, before the events of the scenario and after a pre-roll, which runs with the configured "
    "values; so it is rounded to its word as ever. ± is a share of the value that the file has at that key; where it "
    "has none, or 0, uniform or normal is wanted. Drawn numbers have ten significant digits. A number that must be "
    "above 0 or not negative is refused before the run where its spread goes further.",
    "A sample is then a scenario that anybody can run, with the bytes that would be deployed.",
)
PLANT_NUMBERS = ("gain", "load", "noise", "dead_time", "initial")
"""Numbers of every plant."""
PLANT_TIMES = ("time_constant", "time_constants", "lead", "lag", "dead_time")
DRAWN_DIGITS = 10
"""Significant digits of a drawn number."""
HALF = 0.5
FAR_DEVIATIONS = 3.0
"""Standard deviations that a drawn number may well be away from its mean."""


class NumberSpread(NamedTuple):
    """A number's spread in its unit: uniform from ``low`` to ``high``, or normal within them."""

    low: float = -inf
    high: float = inf
    mean: float = 0.0
    sigma: float | None = None
    """None: uniform."""


@frozen
class Uncertainty:
    """One number that varies."""

    section: Literal["plants", "loops"]
    name: str
    """Of the plant or the loop."""
    key: str
    text: str
    """How it is spread, for people."""
    spread: NumberSpread
    unit: str = ""
    """Written behind a drawn number."""
    is_integer: bool = False
    """Its word takes whole numbers alone."""

    @property
    def random_stream(self) -> str:
        """What its random numbers hang on: neither the place in the file nor the other ones."""
        return f"{self.section}.{self.name}.{self.key}"

    @property
    def label(self) -> str:
        """For people."""
        return f"{self.name} {self.key}"

    def number_text(self, value: float) -> str:
        """A drawn number as a scenario has it."""
        number = Decimal(f"{value:.{DRAWN_DIGITS}g}")
        return f"{decimal_text(round(number) + Decimal(0) if self.is_integer else number)} {self.unit}".rstrip()


class VaryError(Exception):
    """Why a number cannot vary so."""

    def __init__(self, message: str, cure: str | None = None) -> None:
        super().__init__(message)
        self.cure = cure


def find_uncertainties(
    scenario: Scenario, plc: Plc, config: Document | None
) -> tuple[list[Uncertainty], list[Problem]]:
    """All numbers that vary, in the order of the file, and what is wrong with ``vary``.

    ``config``: the configuration, whose numbers a ± is a share of; None: a listing, which has none.
    """
    uncertainties_found: list[Uncertainty] = []
    problems: list[Problem] = []
    for path, make in _vary_entries(scenario, plc, config):
        if isinstance(make, Problem):
            problems.append(make)
            continue
        try:
            uncertainties_found.append(make())
        except VaryError as error:
            problems.append(Problem(path, str(error), "value", help=error.cure))
            continue
        if uncertainties_found[-1].section == "plants" and uncertainties_found[-1].key == "gain":
            problems += _warn_of_sign(path, uncertainties_found[-1])
    return uncertainties_found, problems


def _warn_of_sign(path: Path, gain: Uncertainty) -> Iterator[Problem]:
    """A process whose direction is as uncertain as its gain."""
    low, high, mean, sigma = gain.spread
    if sigma is not None:
        low, high = max(low, mean - FAR_DEVIATIONS * sigma), min(high, mean + FAR_DEVIATIONS * sigma)
    if low < 0 < high:
        message = f"the gain of {gain.name} goes from {low:.4g} to {high:.4g}: with the other sign the loop runs away"
        yield Problem(path, message, "value", "warning", help="keep the gain on one side of 0")


def _vary_entries(scenario: Scenario, plc: Plc, config: Document | None) -> Iterator[tuple[Path, Any]]:
    """The place of each number, and what makes its `Uncertainty`, or a problem of its name."""
    if scenario.vary is None:
        return
    plants = {str(text.name or key): text for key, text in scenario.plants.items()}
    for name, keys in scenario.vary.plants.items():
        for key, spread in keys.items():
            path = ("vary", "plants", name, key)
            if name not in plants:
                yield path, unknown_name(path[:3], "plant of the scenario", name, plants, key=True)
                break
            yield path, lambda name=name, key=key, spread=spread: vary_plant(name, key, spread, plants[name])
    for name, keys in scenario.vary.loops.items():
        for key, spread in keys.items():
            path = ("vary", "loops", name, key)
            if name not in plc.loops:
                yield path, unknown_name(path[:3], "loop", name, plc.loops, key=True)
                break
            yield path, lambda name=name, key=key, spread=spread: vary_loop(name, key, spread, plc, config)


# --- plants ----------------------------------------------------------------------------------------------------------


def vary_plant(name: str, key: str, spread: Spread, plant: Plant) -> Uncertainty:
    """A number of a plant; a `VaryError` says why it cannot vary so."""
    base = key.partition(".")[0]
    numbers = [
        k for k in PLANT_KEYS if getattr(plant, k) is not None and any(k in row for row in MODEL_KEYS[plant.model])
    ]
    numbers = [
        k
        for text_part in numbers
        for k in ((f"{text_part}.0", f"{text_part}.1") if text_part == "time_constants" else (text_part,))
    ]
    if key not in (*PLANT_NUMBERS, *numbers):
        near = unknown_name((), f"number of {name} that can vary", key, [*PLANT_NUMBERS, *numbers])
        raise VaryError(near.message, near.help)
    written = [
        text_part for text_part in (*spread.pair, *(spread.limits or ())) if text_part.unit and spread.kind != "share"
    ]
    if written and base not in PLANT_TIMES:
        raise VaryError(f"{key} is a plain number, not {written[0]}", "leave out the unit")
    value = value_at(plant, parse_path(key))
    file_number = None if value is None else Amount(value)
    ends = number_spread(spread, file_number, f"{name} has no {key}", time=base in PLANT_TIMES)
    lowest, highest = (ends.low, ends.high) if ends.sigma is None or ends.low > -inf else (ends.mean, ends.mean)
    must_be_positive = base in POSITIVE_KEYS or base == "time_constants"
    if must_be_positive or base in NOT_NEGATIVE_KEYS:
        bound = "above 0" if must_be_positive else "at least 0"
        if ends.sigma is not None and ends.low == -inf:
            cure = f"add limits, such as limits: [{ends.mean / 2:g}, {ends.mean * 2:g}]"
            raise VaryError(f"{key} must be {bound}, and a normal spread without limits goes below", cure)
        if lowest < 0 or (must_be_positive and lowest == 0):
            raise VaryError(f"{key} must be {bound}, and {spread} goes down to {lowest:g}", "narrow it")
    if must_be_positive and lowest < float(SMALLEST_NUMBER):
        raise VaryError(f"{key} goes below {SMALLEST_NUMBER:g}", "narrow it")
    if max(abs(lowest), abs(highest)) > LARGEST_NUMBER:
        raise VaryError(f"{key} goes beyond {LARGEST_NUMBER:g}")
    return Uncertainty("plants", name, key, str(spread), ends)


# --- loops -----------------------------------------------------------------------------------------------------------


def vary_loop(name: str, key: str, spread: Spread, plc: Plc, config: Document | None) -> Uncertainty:
    """A key of a loop that ``set`` may change; a `VaryError` says why it cannot vary so."""
    unknown_key = _value_error(Uncertainty("loops", name, key, "", NumberSpread()), 1.0, plc)
    if unknown_key is not None and unknown_key.type == "set_key":
        raise VaryError(unknown_key.message(), (unknown_key.context or {}).get("help"))
    file_number = file_value(name, key, plc, config) if spread.kind == "share" else None
    ends = number_spread(spread, file_number, f"the configuration file gives {name} no number at {key}")
    unit = file_number.unit if file_number is not None else spread.pair[0].unit
    uncertainty = Uncertainty("loops", name, key, str(spread), ends, unit)
    test_values = [ends.mean] if ends.sigma is not None and ends.low == -inf else [ends.low, ends.high]
    middle = (test_values[0] + test_values[-1]) / 2
    fraction = middle // 1 + HALF
    if _value_error(uncertainty, fraction, plc) is not None and _value_error(uncertainty, fraction - HALF, plc) is None:
        uncertainty = Uncertainty("loops", name, key, str(spread), ends, unit, is_integer=True)
    for value in test_values:
        error = _value_error(uncertainty, value, plc)
        if error is not None:
            raise VaryError(f"{uncertainty.number_text(value)}: {error.message()}", (error.context or {}).get("help"))
    return uncertainty


def _value_error(uncertainty: Uncertainty, value: float, plc: Plc) -> PydanticCustomError | None:
    """What the controller has against a value."""
    try:
        plc.check_set(
            plc.loops.index(uncertainty.name), tuple(uncertainty.key.split(".")), Plain(uncertainty.number_text(value))
        )
    except PydanticCustomError as error:
        return error
    return None


def file_value(name: str, key: str, plc: Plc, config: Document | None) -> Amount | None:
    """The number that the configuration file has at a key of a loop; None: it has none there, or is a listing."""
    loops = config.data.get("loops") if config is not None and config.data else None
    entries = (
        [e for e in loops if isinstance(e, dict) and str(e.get("name")) == name] if isinstance(loops, list) else []
    )
    if not entries:
        return None
    path = plc.setpoint if key in SETPOINT else key
    values = [value for keys, value, _ in leaves(entries[0]) if dotted_text(keys) == path]
    values = values or [value for keys, value, _ in leaves(entries[0]) if keys[-1] == path]
    pair = value_at(entries[0], parse_path(path))
    if not values and pair is not None:
        values = [pair]
    if len(values) != 1:
        return None
    try:
        return parse_amount(values[0])
    except PydanticCustomError:
        return None


# --- ends ------------------------------------------------------------------------------------------------------------


def number_spread(spread: Spread, file_number: Amount | None, missing_text: str, *, time: bool = False) -> NumberSpread:
    """The ends of a spread around what ``file_number`` in the file; ``time``: in s."""
    if spread.kind == "share":
        if file_number is None:
            raise VaryError(f"{missing_text}, of which {spread} could be a share", "write uniform: [low, high]")
        if not file_number.value:
            raise VaryError(f"{spread} of 0 is 0", "write uniform: [low, high]")
        reach = abs(file_number.value) * spread.pair[0].value / 100
        return NumberSpread(float(file_number.value - reach), float(file_number.value + reach))
    first, second = (_amount_number(amount, time=time) for amount in spread.pair)
    if spread.kind == "uniform":
        return NumberSpread(first, second)
    low, high = (
        (-inf, inf) if spread.limits is None else (_amount_number(amount, time=time) for amount in spread.limits)
    )
    return NumberSpread(low, high, first, second)


def _amount_number(amount: Amount, *, time: bool) -> float:
    """An amount in its own unit; a ``time`` in s."""
    if not time or not amount.unit:
        return float(amount.value)
    if not DURATION.fullmatch(f"{amount.value:f} {amount.unit}"):
        raise VaryError(f"{amount} is not a time", f"units are {', '.join(SECONDS)}, as in 250 ms")
    return float(parse_seconds(Plain(f"{amount.value:f} {amount.unit}")))
