"""What a scenario file may say: which configuration runs against which plants, what happens, and what is expected."""

from __future__ import annotations

import re
from collections.abc import Mapping
from decimal import Decimal
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, WithJsonSchema, model_validator

from pidcfg.schemas.base import (
    BOOLEANS,
    DURATION,
    DURATION_FORM,
    DURATION_SCHEMA,
    QUANTITY_SCHEMA,
    AnyQuantity,
    Flag,
    FormatVersion,
    Integer,
    Model,
    Name,
    Number,
    Parser,
    Quantity,
    Range,
    Seconds,
    Text,
    pair_schema,
    parse_flag,
    parse_pair,
    parse_quantity,
    parse_seconds,
    parse_text,
)
from pidcfg.schemas.numbers import (
    NUMBER,
    SIGNED_PATTERN,
    UNSIGNED_PATTERN,
    JsonSchema,
    decimal_text,
    number_schema,
    parse_integer,
    parse_number,
    parse_number_text,
    refuse,
    text_schema,
)

# --- Field types of scenarios: what a bound, a share, a start or an expression may look like as text ------------------


class Bound(NamedTuple):
    """A limit of an expectation: a number, a share (``%``), or a time (``s``)."""

    value: Decimal
    unit: Literal["", "%", "s"] = ""


class ForbiddenMode(NamedTuple):
    """A mode that a loop must not reach."""

    mode: str


def parse_mode(value: object) -> str | ForbiddenMode:
    """A mode, ``manual``, or one that must not come, ``{never: auto}``."""
    if isinstance(value, ForbiddenMode):
        return value
    if isinstance(value, Mapping):
        if set(value) != {"never"}:
            refuse("mode_form", "a mode is wanted", help="write 'mode: auto', or 'mode: {never: auto}'")
        return ForbiddenMode(parse_text(value["never"]))
    return parse_text(value)


def parse_percent(value: object) -> Decimal:
    """A share in %: ``5 %`` or ``5``; a bare number up to 1 could be a part of one, and is refused."""
    if isinstance(value, str) and value.endswith("%"):
        return parse_number_text(value[:-1].strip())
    number = parse_number(value)
    if 0 < number <= 1:
        part, whole = decimal_text(number), decimal_text(number * 100)
        cure = f"write {whole} % or {part} %" if number < 1 else "write 1 %, or what is meant below 100 %"
        refuse("percent_form", f"{part} can be {whole} % or {part} %", help=cure)
    return number


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


def parse_loop_count(value: object) -> int:
    """A number of loops as a set-up word of four decimal digits takes it."""
    count = parse_integer(value)
    if not 0 <= count <= MAX_LOOP_COUNT:
        refuse("number_form", f"{value} does not fit the word", help=f"write 0 to {MAX_LOOP_COUNT}")
    return count


def parse_truth(value: object) -> bool | int:
    """What a flag must be: true, false, or the value of a word."""
    if isinstance(value, bool) or (isinstance(value, str) and value in BOOLEANS):
        return parse_flag(value)
    return parse_word(value)


def list_as_mapping(value: object) -> object:
    """A list as a mapping of its indices, so that both forms of ``plants`` are read the same way."""
    return dict(enumerate(value)) if isinstance(value, list) else value


def allow_list(schema: JsonSchema) -> None:
    """The JSON Schema of a mapping, changed so that a list of the same things is as good."""
    items = schema.pop("additionalProperties")
    del schema["type"]
    schema["anyOf"] = [{"type": "object", "additionalProperties": items}, {"type": "array", "items": items}]


def rejoin_expression(value: object) -> object:
    """Puts an expression together that a YAML mapping in braces cut at its commas.

    To YAML ``{input: 1 / max(Fi, 1), load: 2}`` is a value ``1 / max(Fi``, a key ``1)`` without a value, and the rest.
    """
    if not isinstance(value, Mapping):
        return value
    entries: dict[object, Any] = {}
    cut_key: object = None
    for key, item in value.items():
        if cut_key is not None and item is None:
            entries[cut_key] = type(entries[cut_key])(f"{entries[cut_key]}, {key}")
        else:
            entries[key], cut_key = item, key
        if not isinstance(entries[cut_key], str) or entries[cut_key].count("(") <= entries[cut_key].count(")"):
            cut_key = None
    return entries


def rejoin_expressions(data: object) -> object:
    """The data of a scenario file with its expressions put together."""
    if not isinstance(data, Mapping):
        return data
    plants = data.get("plants")
    scenario = dict(data)
    if isinstance(plants, Mapping):
        scenario["plants"] = {name: rejoin_expression(plant) for name, plant in plants.items()}
    elif isinstance(plants, list):
        scenario["plants"] = [rejoin_expression(plant) for plant in plants]
    if "connect" in data:
        scenario["connect"] = rejoin_expression(data["connect"])
    return scenario


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


MAX_LOOP_COUNT = 9999

_PERCENT_FORM = rf"\s*{SIGNED_PATTERN}\s*%"
_PERCENT_TEXT = text_schema(_PERCENT_FORM, "5 %")
_BOUND_TEXT = text_schema(f"{_PERCENT_FORM}|{DURATION_FORM}", "10 %", "10 min")
_MODE_SCHEMA = {
    "anyOf": [
        {"type": "string"},
        {
            "type": "object",
            "properties": {"never": {"type": "string"}},
            "required": ["never"],
            "additionalProperties": False,
        },
    ]
}
_INITIAL_SCHEMA = {"anyOf": [{"const": "steady"}, {"type": "object", "additionalProperties": QUANTITY_SCHEMA}]}

Initial = Annotated[Literal["steady"] | dict[str, Quantity], Parser(parse_initial), WithJsonSchema(_INITIAL_SCHEMA)]
LoopCount = Annotated[
    int, Parser(parse_loop_count), WithJsonSchema({"type": "integer", "minimum": 0, "maximum": MAX_LOOP_COUNT})
]
AnyBound = Annotated[Bound, Parser(parse_bound), WithJsonSchema(number_schema(_BOUND_TEXT))]
Percent = Annotated[Decimal, Parser(parse_percent), WithJsonSchema(number_schema(_PERCENT_TEXT))]
AnyMode = Annotated[str | ForbiddenMode, Parser(parse_mode), WithJsonSchema(_MODE_SCHEMA)]
Truth = Annotated[bool | int, Parser(parse_truth), WithJsonSchema({"type": ["boolean", "integer", "string"]})]
Times = Annotated[
    tuple[Decimal, Decimal],
    Parser(parse_pair(parse_seconds, "a pair of times")),
    WithJsonSchema(pair_schema(DURATION_SCHEMA)),
]
Expression = Annotated[str, Parser(parse_expression), WithJsonSchema({"type": ["string", "number"], "maxLength": 1000})]
Key = Annotated[str | int, Parser(parse_key), WithJsonSchema({"type": "string"})]
ModelName = Literal["first_order", "second_order", "integrator", "lead_lag", "dead_time", "valve", "pulses"]
Metric = Literal[
    "overshoot",
    "settling_time",
    "rise_time",
    "iae",
    "ise",
    "itae",
    "total_variation",
    "final_error",
    "oscillation_period",
    "oscillation_amplitude",
]
StandingKind = Literal[
    "not-in-mode",
    "set-up-error",
    "pv-not-driven",
    "saturated",
    "error-stands",
    "out-of-range",
    "oscillates",
    "alarm-stands",
    "not-settled",
    "no-better",
]
"""What a standing expectation can find, in the order of the report."""

# --- What a scenario says of what is uncertain: numbers of plants and of loops, and how each is spread ----------------

AMOUNT = re.compile(r"([-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?) *([^\s0-9.].*)")
PLUS_MINUS_PERCENT = re.compile(r"(?:±|\+-|\+/-) ?([0-9.]+) ?%")
SPREAD_FORMS = "write ±30 %, {uniform: [40, 90]} or {normal: [8, 2], limits: [4, 14]}"


class Amount(NamedTuple):
    """A number, and the unit that is written behind it: ``40``, ``2 min``."""

    value: Decimal
    unit: str = ""

    def __str__(self) -> str:
        return f"{decimal_text(self.value)} {self.unit}".rstrip()


class Spread(NamedTuple):
    """How a number is spread.

    ``share``: uniform around the file's value, ``pair[0]`` % of its amount to either side. ``uniform``: between the
    pair. ``normal``: the pair is mean and standard deviation; within ``limits`` where there are some.
    """

    kind: Literal["share", "uniform", "normal"]
    pair: tuple[Amount, Amount]
    limits: tuple[Amount, Amount] | None = None

    def __str__(self) -> str:
        first, second = self.pair
        if self.kind == "share":
            return f"±{decimal_text(first.value)} %"
        within = "" if self.limits is None else f" within {self.limits[0]} to {self.limits[1]}"
        return f"{first} to {second}" if self.kind == "uniform" else f"{first}, deviation {second}{within}"


def parse_amount(value: object) -> Amount:
    """A number, with or without a unit."""
    match = AMOUNT.fullmatch(value) if isinstance(value, str) and not NUMBER.fullmatch(value) else None
    return Amount(parse_number_text(match[1]), match[2].strip()) if match else Amount(parse_number(value))


def parse_spread(value: object) -> Spread:
    """``±30 %``, ``{uniform: [40, 90]}`` or ``{normal: [8, 2], limits: [4, 14]}``."""
    if isinstance(value, Spread):
        return value
    if isinstance(value, str) and (match := PLUS_MINUS_PERCENT.fullmatch(value)):
        share = parse_number_text(match[1])
        if share <= 0:
            refuse("number_form", f"{value} leaves nothing to vary", help=SPREAD_FORMS)
        return Spread("share", (Amount(share, "%"), Amount(share, "%")))
    if not isinstance(value, Mapping):
        refuse("spread_form", f"{value!r} does not say how the number is spread", help=SPREAD_FORMS)
    keys = set(value)
    if keys == {"uniform"}:
        return Spread("uniform", _parse_ends(value["uniform"], "uniform"))
    if keys in ({"normal"}, {"normal", "limits"}):
        mean, sigma = _parse_amounts(value["normal"], "mean and standard deviation")
        if sigma.value <= 0:
            refuse("number_form", f"the standard deviation {sigma} is not above 0", help=SPREAD_FORMS)
        limits = _parse_ends(value["limits"], "limits") if "limits" in keys else None
        if limits is not None and limits[0].unit != mean.unit:
            refuse(
                "number_form", f"normal is in {mean.unit or 'plain numbers'}, limits in another unit", help=SPREAD_FORMS
            )
        return Spread("normal", (mean, sigma), limits)
    return refuse(
        "spread_form", f"{', '.join(map(str, value)) or 'nothing'} does not say how a number varies", help=SPREAD_FORMS
    )


def _parse_amounts(value: object, title: str) -> tuple[Amount, Amount]:
    """Two amounts of one unit."""
    first, second = parse_pair(parse_amount, title)(value)
    if first.unit != second.unit:
        refuse("number_form", f"{first} and {second} are not in one unit", help="write both in the same unit")
    return first, second


def _parse_ends(value: object, title: str) -> tuple[Amount, Amount]:
    """Two ends, the lower one first."""
    low, high = _parse_amounts(value, "a pair of ends")
    if low.value >= high.value:
        refuse("range_order", f"{title} [{low}, {high}] does not ascend", help="write the lower end first")
    return low, high


_AMOUNT_SCHEMA: JsonSchema = {"type": ["number", "string"]}
_PAIR_SCHEMA = pair_schema(_AMOUNT_SCHEMA)
_SPREAD_SCHEMA: JsonSchema = {
    "anyOf": [
        text_schema(rf"(?:±|\+-|\+/-) ?{UNSIGNED_PATTERN} ?%", "±30 %"),
        {
            "type": "object",
            "properties": {"uniform": _PAIR_SCHEMA},
            "required": ["uniform"],
            "additionalProperties": False,
        },
        {
            "type": "object",
            "properties": {"normal": _PAIR_SCHEMA, "limits": _PAIR_SCHEMA},
            "required": ["normal"],
            "additionalProperties": False,
        },
    ]
}
AnySpread = Annotated[Spread, Parser(parse_spread), WithJsonSchema(_SPREAD_SCHEMA)]


class Vary(Model):
    """What is uncertain; ``pidcfg certify`` draws it anew for each sample, other commands run the file's values."""

    seed: Integer | None = None
    """Seed of the samples; not given: that of the scenario."""
    plants: Annotated[dict[Name, dict[str, AnySpread]], Field(default_factory=dict)]
    """By plant its keys: ``gain: ±30 %``, ``dead_time: {normal: [8, 2], limits: [4, 14]}``."""
    loops: Annotated[dict[Name, dict[str, AnySpread]], Field(default_factory=dict)]
    """By loop keys that an event may ``set``: ``tuning.gain: ±10 %``."""


# ----------------------------------------------------------------------------------------------------------------------
# What a scenario file may say: which configuration runs against which plants, what happens, and what is expected.
# A key that only fits some models, events or expectations is optional here; what belongs together is checked once the
# configuration is known (`pidcfg.sim.engine.checks`), since names of loops, signals and alarms come from there.


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
    """Of any length, base steps or not."""
    stiction: Number = Decimal(0)
    """Valve: it sticks until it is asked to move by more than this, in units of the input."""
    rate_limit: Number | None = None
    """Valve: fastest move, in units of the input per second."""
    period: Seconds | None = None
    """Pulses: how often a new one begins; its time on is the input, in % of this."""
    resolution: Seconds | None = None
    """Pulses: the steps in which their time on is rounded; not given: a thousandth of the period."""
    initial: Number | None = None
    """Value at time 0; the delay line is full of the input that holds it. Not given: where its input holds it."""
    limits: Range | None = None
    """Where the value stops: a tank is not emptier than empty."""
    noise: Number = Decimal(0)
    """Standard deviation of the measurement's noise, in PV units."""


class Options(Model):
    """What the PLC does that its words do not say; unknown to a vendor is an error."""

    number_of_loops: LoopCount | None = None
    """Written to V7641 in place of the number of loops, so that a wrong set-up can be seen to fail."""
    auto_interlock: Flag | None = None
    """Whether a request for Auto is refused while a PV alarm is active (default true)."""
    step_bias: Flag | None = None
    """Whether a change of the set point scales the bias (default false)."""
    scan_time: Seconds | None = None
    """Time of one PLC scan; it becomes the base step, and slow loops then take turns."""


DISTURBANCE_TIMES = ("time_constant", "lead", "lag")


def seconds_of_times(value: object) -> object:
    """What a disturbance says, with times as plain seconds."""
    if not isinstance(value, Mapping):
        return value
    return {
        key: parse_seconds(item)
        if key in DISTURBANCE_TIMES and isinstance(item, str) and DURATION.fullmatch(item)
        else item
        for key, item in value.items()
    }


_DISTURBANCE_SCHEMA: JsonSchema = {
    "type": "object",
    "properties": dict.fromkeys(DISTURBANCE_TIMES, DURATION_SCHEMA),
    "additionalProperties": {"type": "number"},
}
Disturbance = Annotated[dict[str, Number], BeforeValidator(seconds_of_times), WithJsonSchema(_DISTURBANCE_SCHEMA)]


class Event(Model):
    """One thing that happens, once, at ``at``."""

    at: Seconds
    """When; it takes effect at the next base step."""
    loop: Name | None = None
    """The loop it happens to."""
    plant: Name | None = None
    """The plant it happens to, by its name."""
    set: dict[str, Any] | None = None
    """With ``loop``: keys of its configuration. Without: signals of the scenario."""
    disturb: Disturbance | None = None
    """New values of a plant's gain, load, noise or other numbers; a time may carry its unit."""
    mode: Text | None = None
    """A mode request, made once."""
    ramp_soak: Literal["start", "hold", "resume", "jog"] | None = None
    """One of the control bits of the ramp/soak generator, where the PLC has one."""
    autotune: Literal["start", "cancel", "accept"] | None = None
    """Sets or clears the bit that starts auto-tune; the report carries the results."""
    pv: AnyQuantity | None = None
    """A broken sensor: what it shows from now on."""
    duration: Annotated[Seconds | None, Field(alias="for")] = None
    """How long a sensor stays broken; not given: to the end."""
    plc: Literal["program", "stop", "run"] | None = None
    """The CPU changes its mode; ``program`` or ``stop``, as the PLC calls it."""


class Expectation(Model):
    """One thing that must be so; failing it fails the scenario."""

    loop: Name | None = None
    """The loop that is judged."""
    signal: Name | None = None
    """The signal that is judged, such as ``TIC-101.PV``."""
    metric: Metric | None = None
    """A metric of the loop, with ``min`` or ``max``."""
    band: Percent | None = None
    """Settled means within this share of the set-point step (default 5 %)."""
    min: AnyBound | None = None
    """Lowest value that passes; a time may carry its unit, an overshoot is in %."""
    max: AnyBound | None = None
    """Highest value that passes."""
    final: Number | None = None
    """Of a signal: its value at the end, within ``tolerance``."""
    tolerance: AnyBound | None = None
    """Of ``final`` in the signal's units; of ``at`` as a time."""
    start: Annotated[Seconds | None, Field(alias="from")] = None
    """Of a signal's ``min`` and ``max``: the time to look from, and ``until``."""
    until: Seconds | None = None
    """Of a signal: the time to look until."""
    alarm: Text | None = None
    """An alarm of the loop, by its name in the report; it must come unless ``never`` is true."""
    never: Flag | None = None
    """The alarm must not come."""
    at: Seconds | None = None
    """Of an alarm: first activation (within ``tolerance``). Of a mode: the time to look."""
    before: Seconds | None = None
    """The alarm must come before this time."""
    after: Seconds | None = None
    """The alarm must come after this time and not earlier."""
    mode: AnyMode | None = None
    """The mode at the end, or ``at`` a time; ``{never: auto}``: the loop must not come into it."""
    flag: Text | None = None
    """A condition of a loop; without ``loop`` a set-up error word, V7642. It must be true, or what ``is`` says."""
    value: Annotated[Truth | None, Field(alias="is")] = None
    """Of a flag: what it must be; true when not given."""
    autotune: Text | None = None
    """A result of auto-tune, by the vendor's name, with ``min`` and ``max``; or ``done``, ``error``."""
    share: Percent | None = None
    """Of ``pidcfg certify``: the share of samples of which it must hold (not given: all); others judge it once."""


class Allowance(Model):
    """A check of every run that a loop may fail, since that is what the scenario shows."""

    kind: Literal[StandingKind, "not-proven"]
    """What is allowed: its kind as the report names it; ``not-proven``: whatever the run does not show."""
    loop: Name
    """The loop that may."""
    reason: Text
    """Why; the report repeats it."""


class Scenario(Model):
    """A scenario file."""

    pidcfg: FormatVersion
    """Version of the file format."""
    scenario: Text
    """A title for the report."""
    config: Text
    """A configuration or a memory listing, relative to this file."""
    duration: Seconds
    """How long to run, in seconds or with a unit."""
    step: Seconds | None = None
    """Base step; not given: the greatest common step of the sample rates."""
    initial: Initial | None = None
    """``steady``: settled at the configured set points when time starts. Or the output that each loop starts with."""
    plants: Annotated[
        dict[Key, Plant], BeforeValidator(list_as_mapping), Field(default_factory=dict, json_schema_extra=allow_list)
    ]
    """By loop, or a list with names."""
    connect: Annotated[dict[str, Expression], Field(default_factory=dict)]
    """What a loop's PV is wired to, ``TIC_1.PV: MV_out * 2``."""
    signals: Annotated[dict[Name, Number], Field(default_factory=dict)]
    """Values from outside; events may change them."""
    seed: Integer = 0
    """Seed of the noise."""
    vary: Vary | None = None
    """What is uncertain: what ``pidcfg certify`` varies."""
    plc: Options = Options()
    """Set-up words and options of the virtual PLC."""
    events: tuple[Event, ...] = ()
    """What happens, and when."""
    expect: tuple[Expectation, ...] = ()
    """What must be so; it decides the exit code."""
    reference: Text | None = None
    """A run that was accepted (``simulate --accept``), relative to this file; what differs from it fails."""
    allow: tuple[Allowance, ...] = ()
    """What is always checked and a loop may fail."""
    tolerance: Annotated[dict[Name, AnyBound], Field(default_factory=dict)]
    """By loop how far from its set point the PV may come to rest, in its unit or in ``%`` of its span."""
    assumed_signs: tuple[Name, ...] = ()
    """Loops whose plant has its sign from their own action, as drafted: whether the action is right is not judged."""
    loops: tuple[Name, ...] | None = None
    """The loops that are judged by what is always checked; not given: all."""

    _rejoin = model_validator(mode="before")(rejoin_expressions)


# --- What a person has accepted of a run: metrics, modes and alarms; times in s, values in the units of the loop ------

Role = Literal["pv", "setpoint", "output"]
"""Which signal of a loop it is, whatever the PLC calls it."""


class AcceptedPart(BaseModel):
    """A part of the file; unknown keys, texts for numbers and NaN are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)


class Extent(AcceptedPart):
    """How far a signal went, and where it ended."""

    min: float
    max: float
    final: float


class ModeBegin(AcceptedPart):
    """A mode, and since when."""

    at: float
    mode: str


class AlarmTimes(AcceptedPart):
    """When an alarm came first, and how long it was on in all."""

    first: float
    total: float


class AcceptedLoop(AcceptedPart):
    """What an accepted run shows of a loop."""

    pv_unit: str
    output_unit: str
    pv_range: tuple[float, float]
    """What the PLC takes its transmitter for; a tolerance is a share of it."""
    output_range: tuple[float, float] | None
    sample_time: float
    metrics: dict[Metric, float | None]
    """In the order of the report; None: nothing was measured."""
    signals: dict[Role, Extent]
    modes: list[ModeBegin]
    alarms: dict[str, AlarmTimes]


class AcceptedRun(AcceptedPart):
    """An accepted run; ``accepted`` is the title of its scenario."""

    pidcfg: Literal[1]
    accepted: str
    duration: Annotated[float, Field(gt=0)]
    loops: dict[str, AcceptedLoop]
    signals: dict[str, Extent]
    """The signals that are no loop's: of plants, and of the program around the loops."""


class AcceptedError(Exception):
    """Why a file cannot be used as the accepted run of a scenario."""


def run_of_data(data: bytes, max_bytes: int, *, may_quote: bool = True) -> AcceptedRun:
    """What a file of at most ``max_bytes`` bytes holds; raises `AcceptedError`, quoting it where ``may_quote``."""
    if len(data) > max_bytes:
        raise AcceptedError(f"is larger than {max_bytes} bytes; raise it with --limit")
    try:
        return AcceptedRun.model_validate_json(data)
    except ValidationError as error:
        first = error.errors(include_url=False, include_context=False, include_input=False)[0]
        place = ".".join(map(str, first["loc"]))
        why = f": {place and f'{place}: '}{first['msg'][:1].lower()}{first['msg'][1:]}" if may_quote else ""
        raise AcceptedError(f"is no accepted run{why}") from None
