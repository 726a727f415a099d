"""What a scenario file may say: which configuration runs against which plants, what happens, and what is expected.

A key that only fits some models, events or expectations is optional here; what belongs together is checked once the
configuration is known (`pidcfg.sim.check`), since names of loops, signals and alarms come from there.
"""

from __future__ import annotations

from collections.abc import Mapping
from decimal import Decimal
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import BeforeValidator, Field, PlainValidator, WithJsonSchema, model_validator

from pidcfg.schemas.base import (
    DURATION,
    TRUTHS,
    AnyQuantity,
    Flag,
    FormatVersion,
    Integer,
    Model,
    Name,
    Number,
    Quantity,
    Range,
    Seconds,
    Text,
    number_text,
    parse_flag,
    parse_number,
    parse_pair,
    parse_quantity,
    parse_seconds,
    refuse,
)


class Bound(NamedTuple):
    """A limit of an expectation: a number, a share (``%``), or a time (``s``)."""

    value: Decimal
    unit: Literal["", "%", "s"] = ""


def parse_percent(value: object) -> Decimal:
    """A share in %: ``5 %`` or ``5``."""
    if isinstance(value, str) and value.endswith("%"):
        return number_text(value[:-1].strip())
    return parse_number(value)


def parse_bound(value: object) -> Bound:
    """``10``, ``10 %`` or ``10 min``."""
    if isinstance(value, Bound):
        return value
    if isinstance(value, str) and value.endswith("%"):
        return Bound(parse_percent(value), "%")
    if isinstance(value, str) and DURATION.fullmatch(value):
        return Bound(parse_seconds(value), "s")
    return Bound(parse_number(value))


def parse_initial(value: object) -> Literal["steady"] | dict[str, Quantity]:
    """``steady``, or the output that each loop starts with: ``{TIC-101: 40}``."""
    if value == "steady":
        return "steady"
    if isinstance(value, Mapping):
        return {str(loop): parse_quantity(output) for loop, output in value.items()}
    return refuse("initial_form", f"{value!r} is no way to start", help="write steady, or {TIC-101: 40} with outputs")


def parse_word(value: object) -> int:
    """A 16-bit word: ``0x0008`` or ``8``."""
    if isinstance(value, str) and value[:2].lower() == "0x":
        try:
            word = int(value, 16)
        except ValueError:
            return refuse("number_form", f"{value!r} is not a hexadecimal number")
    else:
        word = int(parse_number(value))
    if not 0 <= word <= 0xFFFF:
        refuse("number_form", f"{value} does not fit a 16-bit word")
    return word


def parse_truth(value: object) -> bool | int:
    """What a flag must be: true, false, or the value of a word."""
    if isinstance(value, bool) or (isinstance(value, str) and value in TRUTHS):
        return parse_flag(value)
    return parse_word(value)


def by_key(value: object) -> object:
    """A list as a mapping of its indices, so that both forms of ``plants`` are read the same way."""
    return dict(enumerate(value)) if isinstance(value, list) else value


def rejoin(value: object) -> object:
    """Puts an expression together that a YAML mapping in braces cut at its commas.

    To YAML ``{input: 1 / max(Fi, 1), load: 2}`` is a value ``1 / max(Fi``, a key ``1)`` without a value, and the rest.
    """
    if not isinstance(value, Mapping):
        return value
    joined: dict[Any, Any] = {}
    cut: Any = None
    for key, item in value.items():
        if cut is not None and item is None:
            joined[cut] = type(joined[cut])(f"{joined[cut]}, {key}")
        else:
            joined[key], cut = item, key
        if not isinstance(joined[cut], str) or joined[cut].count("(") <= joined[cut].count(")"):
            cut = None
    return joined


def whole(data: object) -> object:
    """The data of a scenario file with its expressions put together."""
    if not isinstance(data, Mapping):
        return data
    plants = data.get("plants")
    mended = dict(data)
    if isinstance(plants, Mapping):
        mended["plants"] = {name: rejoin(plant) for name, plant in plants.items()}
    elif isinstance(plants, list):
        mended["plants"] = [rejoin(plant) for plant in plants]
    if "connect" in data:
        mended["connect"] = rejoin(data["connect"])
    return mended


def parse_key(value: object) -> str | int:
    """A loop's name, or the index in a list."""
    return value if isinstance(value, int) else str(value)


def parse_expression(value: object) -> str:
    """An expression of signals as text; it is read when the names are known."""
    if isinstance(value, int | float | Decimal) and not isinstance(value, bool):
        return str(value)
    if not isinstance(value, str):
        refuse("text_type", "an expression is wanted", help="write a signal's name, or 1 / max(Fi, 1)")
    return str(value)


_BOUND_SCHEMA = {"anyOf": [{"type": "number"}, {"type": "string", "pattern": r"^[-+]?[0-9.]+ ?(%|ms|s|min|h)$"}]}
_PERCENT_SCHEMA = {"anyOf": [{"type": "number"}, {"type": "string", "pattern": r"^[-+]?[0-9.]+ ?%$"}]}
_TIMES_SCHEMA = {"type": "array", "items": {"type": ["number", "string"]}, "minItems": 2, "maxItems": 2}
_INITIAL_SCHEMA = {
    "anyOf": [{"const": "steady"}, {"type": "object", "additionalProperties": {"type": ["number", "string"]}}]
}

AnyBound = Annotated[Bound, PlainValidator(parse_bound), WithJsonSchema(_BOUND_SCHEMA)]
Percent = Annotated[Decimal, PlainValidator(parse_percent), WithJsonSchema(_PERCENT_SCHEMA)]
Truth = Annotated[bool | int, PlainValidator(parse_truth), WithJsonSchema({"type": ["boolean", "integer", "string"]})]
Times = Annotated[
    tuple[Decimal, Decimal],
    PlainValidator(parse_pair(parse_seconds, "a pair of times")),
    WithJsonSchema(_TIMES_SCHEMA),
]
Expression = Annotated[
    str, PlainValidator(parse_expression), WithJsonSchema({"type": ["string", "number"], "maxLength": 1000})
]
Key = Annotated[str | int, PlainValidator(parse_key), WithJsonSchema({"type": "string"})]
ModelName = Literal["first_order", "second_order", "integrator", "lead_lag", "dead_time", "valve"]
Metric = Literal["overshoot", "settling_time", "rise_time", "iae", "ise", "itae", "total_variation", "final_error"]


class Plant(Model):
    """One process. Without ``input`` the plant of a loop reads that loop's output, in engineering units."""

    name: Name | None = None
    """Name of its signal (where plants are a list)."""
    model: ModelName
    """first_order: T·dPV/dt = gain·u + load − PV; integrator: dPV/dt = gain·u + load; the others alike."""
    input: Expression | None = None
    """A signal, or an expression of signals; another plant's signal is free of noise."""
    gain: Number = Decimal(1)
    """PV units per unit of the input (integrator: per second)."""
    load: Number = Decimal(0)
    """What is added to gain·u."""
    time_constant: Seconds | None = None
    """First order; second order together with ``damping``."""
    time_constants: Times | None = None
    """Second order as two lags in series."""
    damping: Number | None = None
    """Damping ratio ζ of a second-order plant: below 1 it swings."""
    lead: Seconds | None = None
    """Lead time of lead_lag."""
    lag: Seconds | None = None
    """Lag time of lead_lag."""
    dead_time: Seconds = Decimal(0)
    """A whole number of base steps; rounding is reported."""
    stiction: Number = Decimal(0)
    """Valve: it sticks until it is asked to move by more than this, in units of the input."""
    rate_limit: Number | None = None
    """Valve: fastest move, in units of the input per second."""
    initial: Number | None = None
    """Value at time 0; the delay line is full of the input that holds it. Not given: where its input holds it."""
    limits: Range | None = None
    """Where the value stops: a tank is not emptier than empty."""
    noise: Number = Decimal(0)
    """Standard deviation of the measurement's noise, in PV units."""


class Options(Model):
    """What the PLC does that its words do not say; unknown to a vendor is an error."""

    number_of_loops: Integer | None = None
    """Written to V7641 in place of the number of loops, so that a wrong set-up can be seen to fail."""
    auto_interlock: Flag | None = None
    """Whether a request for Auto is refused while a PV alarm is active (default true)."""
    step_bias: Flag | None = None
    """Whether a change of the set point scales the bias (default false)."""
    scan_time: Seconds | None = None
    """Time of one PLC scan; it becomes the base step, and slow loops then take turns."""


class Event(Model):
    """One thing that happens, once, at ``at``."""

    at: Seconds
    """When; it takes effect at the next base step."""
    loop: Name | None = None
    plant: Name | None = None
    set: dict[str, Any] | None = None
    """With ``loop``: keys of its configuration. Without: signals of the scenario."""
    disturb: dict[str, Number] | None = None
    """New values of a plant's gain, load, noise or other numbers."""
    mode: Text | None = None
    """A mode request, made once."""
    ramp_soak: Literal["start", "hold", "resume", "jog"] | None = None
    autotune: Literal["start"] | None = None
    pv: AnyQuantity | None = None
    """A broken sensor: what it shows from now on."""
    duration: Annotated[Seconds | None, Field(alias="for")] = None
    """How long a sensor stays broken; not given: to the end."""
    plc: Literal["program", "run"] | None = None


class Expectation(Model):
    """One thing that must be so; failing it fails the scenario."""

    loop: Name | None = None
    signal: Name | None = None
    metric: Metric | None = None
    band: Percent | None = None
    """Settled means within this share of the set-point step (default 5 %)."""
    min: AnyBound | None = None
    max: AnyBound | None = None
    final: Number | None = None
    """Of a signal: its value at the end, within ``tolerance``."""
    tolerance: AnyBound | None = None
    """Of ``final`` in the signal's units; of ``at`` as a time."""
    start: Annotated[Seconds | None, Field(alias="from")] = None
    """Of a signal's ``min`` and ``max``: the time to look from, and ``until``."""
    until: Seconds | None = None
    alarm: Text | None = None
    never: Flag | None = None
    at: Seconds | None = None
    """Of an alarm: first activation (within ``tolerance``). Of a mode: the time to look."""
    before: Seconds | None = None
    after: Seconds | None = None
    mode: Text | None = None
    """The mode at the end, or ``at`` a time."""
    flag: Text | None = None
    """A condition of a loop; without ``loop`` a set-up error word, V7642. It must be true, or what ``is`` says."""
    value: Annotated[Truth | None, Field(alias="is")] = None
    autotune: Text | None = None
    """A result of auto-tune, by the vendor's name, with ``min`` and ``max``; or ``done``, ``error``."""


class Scenario(Model):
    """A scenario file."""

    pidcfg: FormatVersion
    """Version of the file format."""
    scenario: Text
    """A title for the report."""
    config: Text
    """A configuration or a memory listing, relative to this file."""
    duration: Seconds
    step: Seconds | None = None
    """Base step; not given: the greatest common step of the sample rates."""
    initial: Annotated[
        Literal["steady"] | dict[str, Quantity] | None,
        PlainValidator(parse_initial),
        WithJsonSchema(_INITIAL_SCHEMA),
    ] = None
    """``steady``: settled at the configured set points when time starts. Or the output that each loop starts with."""
    plants: Annotated[dict[Key, Plant], BeforeValidator(by_key), Field(default_factory=dict)]
    """By loop, or a list with names."""
    connect: Annotated[dict[str, Expression], Field(default_factory=dict)]
    """What a loop's PV is wired to, ``TIC_1.PV: MV_out * 2``."""
    signals: Annotated[dict[Name, Number], Field(default_factory=dict)]
    """Values from outside; events may change them."""
    seed: Integer = 0
    """Seed of the noise."""
    plc: Options = Options()
    events: tuple[Event, ...] = ()
    expect: tuple[Expectation, ...] = ()

    _whole = model_validator(mode="before")(whole)
