"""What a scenario file may say: which configuration runs against which plants, what happens, and what is expected.

A key that only fits some models, events or expectations is optional here; what belongs together is checked once the
configuration is known (`pidcfg.sim.check_scenario`), since names of loops, signals and alarms come from there.
"""

from __future__ import annotations

from decimal import Decimal
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from pidcfg.schemas.base import AnyQuantity, Flag, FormatVersion, Integer, Model, Name, Number, Range, Seconds, Text
from pidcfg.schemas.scenario_fields import (
    AnyBound,
    AnyMode,
    Expression,
    Initial,
    Key,
    LoopCount,
    Metric,
    ModelName,
    Percent,
    StandingKind,
    Times,
    Truth,
    both_forms,
    by_key,
    whole,
)
from pidcfg.schemas.scenario_vary import Vary


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

    number_of_loops: LoopCount | None = None
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
    """The loop it happens to."""
    plant: Name | None = None
    """The plant it happens to, by its name."""
    set: dict[str, Any] | None = None
    """With ``loop``: keys of its configuration. Without: signals of the scenario."""
    disturb: dict[str, Number] | None = None
    """New values of a plant's gain, load, noise or other numbers."""
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
    """A standing expectation that a loop may fail, since that is what the scenario shows."""

    kind: StandingKind
    """What is allowed: its kind as the report names it."""
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
        dict[Key, Plant], BeforeValidator(by_key), Field(default_factory=dict, json_schema_extra=both_forms)
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
    allow: tuple[Allowance, ...] = ()
    """Standing expectations that a loop may fail."""
    loops: tuple[Name, ...] | None = None
    """The loops that the standing expectations judge; not given: all."""

    _whole = model_validator(mode="before")(whole)
