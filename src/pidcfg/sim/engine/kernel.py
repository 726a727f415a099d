"""The base step: plants, controllers, metrics, log and trend, in that order, from event to event without a stop.

Everything here and below is a plain function on lists of flat objects and of numbers, so that numba compiles the very
same source. ``scan`` is the vendor's; see `pidcfg.sim.engine.choice` for how it takes its place.
"""

from collections.abc import Callable, MutableSequence, Sequence
from copy import copy
from dataclasses import dataclass, fields
from typing import Any, Generic, NamedTuple, TypeVar

from pidcfg.sim.engine.expressions import evaluate
from pidcfg.sim.engine.plants import Plant, add_noise, step_plants
from pidcfg.sim.judgement.meters import (
    Band,
    Benefit,
    Gauge,
    Meter,
    Onset,
    begin_meter,
    change_status,
    compare_errors,
    measure_loop,
    note_onsets,
    read_gauges,
    watch_bands,
)

Config = TypeVar("Config")
State = TypeVar("State")
"""The vendor's records of a loop."""

LOG_ROWS = 4096
"""Changes that are kept before Python has to look at them."""
LOG_COLUMNS = 5
"""Base step, loop, status, auxiliary status, notice."""


@dataclass(slots=True)
class Channel:
    """What an analog input shows when it is not simply a plant: an expression, or a broken sensor.

    ``source`` is the signal it reads, or −1 when ``first`` and ``last`` bound the code of an expression.
    """

    target: int
    source: int = -1
    first: int = 0
    last: int = 0
    broken: int = 0
    value: float = 0.0
    held_value: float = 0.0
    fault: int = 0
    fault_at: int = 0


@dataclass(slots=True)
class Span:
    """How far a loop's measurement moved during a window of the pre-roll."""

    slot: int
    width: float = 0.0
    """Of its range, and the counts in it."""
    counts: int = 1
    low: float = 0.0
    high: float = 0.0
    total: float = 0.0


@dataclass(slots=True)
class HeldSignal:
    """A signal of the PLC as the reference sees it: held once ``loop`` controls (−1: never).

    With a ``source`` it is the share of ``width`` that this signal of the reference is above ``low``.
    """

    loop: int
    slot: int
    source: int = -1
    low: float = 0.0
    width: float = 1.0


class Storage(NamedTuple):
    """How the data of a run lie."""

    rows: Callable[[Sequence[Any]], Any]
    """Copies of objects of one class."""
    numbers: Callable[[str, Sequence[Any]], Any]
    """Numbers, of the type that `array.array` knows by a letter."""
    copy_into: Callable[[Any, Any], None]
    """Writes what some of the same kind hold, the second, into others."""


def copy_into_lists(target: MutableSequence[Any], source: Sequence[Any]) -> None:
    """`Storage.copy_into` of lists."""
    if not target or isinstance(target[0], int | float):
        target[:] = source
        return
    names = [f.name for f in fields(target[0])]
    for item, other in zip(target, source, strict=True):
        for name in names:
            setattr(item, name, getattr(other, name))


LIST_STORAGE = Storage(lambda objects: list(map(copy, objects)), lambda _, values: list(values), copy_into_lists)
"""As CPython works on them fastest."""


# Groups of arguments: a `MutableSequence` is written by the kernels, a `Sequence` only read (see
# `pidcfg.sim.engine.choice`).


class World(NamedTuple):
    """What surrounds the controllers: plants, channels and signals."""

    step: int
    """Ticks of a base step."""
    parts: int
    """Equal parts in which the plants go through it."""
    plants: MutableSequence[Plant]
    channels: MutableSequence[Channel]
    delay: MutableSequence[float]
    """The delay lines of all plants."""
    signal_values: MutableSequence[float]
    code: Sequence[int]
    """Expressions, with their constants, and the stack that they are evaluated on."""
    constants: Sequence[float]
    stack: MutableSequence[float]


class NoiseRows(NamedTuple):
    """Noise: standard normal numbers, ``columns`` for each base step from ``first`` on."""

    noise: Sequence[float]
    columns: int
    first: int


class Loops(NamedTuple, Generic[Config, State]):
    """The controllers: what `pidcfg.sim.controllers.plc.Plc` has under the same names."""

    configs: Sequence[Config]
    states: Sequence[State]
    aux: MutableSequence[float]


class Meters(NamedTuple):
    """What is measured."""

    loops: MutableSequence[Meter]
    bands: MutableSequence[Band]
    gauges: MutableSequence[Gauge]
    onsets: MutableSequence[Onset]


class Reference(NamedTuple):
    """The same plants with the outputs of the loops held (`pidcfg.sim.engine.reference`)."""

    plants: MutableSequence[Plant]
    channels: MutableSequence[Channel]
    delay: MutableSequence[float]
    signal_values: MutableSequence[float]
    outputs: Sequence[HeldSignal]
    benefits: MutableSequence[Benefit]


class Log(NamedTuple):
    """What is written down."""

    rows: MutableSequence[int]
    trend: MutableSequence[float]
    counts: MutableSequence[int]
    """Rows of the log, rows of the trend, and set-point events so far."""
    trend_slots: Sequence[int]
    """The signals of a row of the trend."""
    interval: int
    """Base steps between two rows of the trend; 0: there is none."""


def scan(
    tick: int,
    configs: Sequence[Any],
    states: Sequence[Any],
    aux: MutableSequence[float],
    signals: MutableSequence[float],
) -> None:
    """No controllers, only plants; a vendor's scan replaces this."""


def read_channels(
    step: int,
    channels: Sequence[Channel],
    signals: MutableSequence[float],
    code: Sequence[int],
    constants: Sequence[float],
    stack: MutableSequence[float],
) -> None:
    """Connected expressions and broken sensors (kernel)."""
    for i in range(len(channels)):
        channel = channels[i]
        if channel.broken == 1:
            value = channel.value
        elif channel.source >= 0:
            value = signals[channel.source]
        else:
            value = evaluate(code, constants, channel.first, channel.last, signals, stack)
            if stack[0] == 0.0:
                channel.held_value = value
            else:
                value = channel.held_value
                if channel.fault == 0:
                    channel.fault = int(stack[0])
                    channel.fault_at = step
        signals[channel.target] = value


def write_log(
    step: int,
    i: int,
    state: Any,
    meter: Meter,
    onsets: Sequence[Onset],
    rows: MutableSequence[int],
    counts: MutableSequence[int],
) -> None:
    """A row for loop ``i``, whose status has changed or that has a notice (kernel)."""
    first = counts[0] * LOG_COLUMNS
    rows[first] = step
    rows[first + 1] = i
    rows[first + 2] = state.status
    rows[first + 3] = state.aux_status
    rows[first + 4] = state.notice
    counts[0] += 1
    if state.status != meter.status or state.aux_status != meter.aux_status:
        change_status(step, meter, state.status, state.aux_status)
        note_onsets(step, i, state.status, onsets)
    state.notice = 0


def hold_outputs(
    outputs: Sequence[HeldSignal],
    meters: Sequence[Meter],
    signals: Sequence[float],
    reference_signals: MutableSequence[float],
) -> None:
    """What the reference sees of the PLC's signals (kernel)."""
    for i in range(len(outputs)):
        output = outputs[i]
        if output.source >= 0:
            reference_signals[output.slot] = (reference_signals[output.source] - output.low) / output.width
        elif output.loop < 0 or (meters[output.loop].in_control == 0 and meters[output.loop].control_steps == 0):
            reference_signals[output.slot] = signals[output.slot]


def step_reference(
    k: int,
    parts: int,
    reference: Reference,
    meters: Sequence[Meter],
    signals: Sequence[float],
    code: Sequence[int],
    constants: Sequence[float],
    stack: MutableSequence[float],
) -> None:
    """The reference through one base step (kernel)."""
    plants, channels, delay, reference_signals, outputs, _ = reference
    hold_outputs(outputs, meters, signals, reference_signals)
    if k > 0:
        step_plants(k, parts, plants, delay, reference_signals, code, constants, stack)
    for i in range(len(plants)):
        reference_signals[plants[i].measured] = reference_signals[plants[i].slot]
    if len(channels) > 0:
        read_channels(k, channels, reference_signals, code, constants, stack)


def measure_edge(k: int, m: Meter, signals: Sequence[float]) -> None:
    """`measure_loop` at the first base step of a run, or at the last, which stands for no time (kernel)."""
    iae, ise, itae = m.iae, m.ise, m.itae
    measure_loop(k, m, signals)
    if k == 0:
        begin_meter(m, signals)
    else:
        m.iae = iae
        m.ise = ise
        m.itae = itae


def advance(
    k: int,
    last: int,
    zero: int,
    final_step: int,
    plants_step: int,
    world: World,
    noise_rows: NoiseRows,
    loops: Loops[Any, Any],
    meters: Meters,
    log: Log,
    reference: Reference,
) -> int:
    """Base steps ``k`` to ``last`` − 1 of the run; returns the next one, early when the log is full (kernel).

    Time 0 is base step ``zero``, and what lies before is the pre-roll; ``final_step`` after it the run ends. The plants
    have come to base step ``plants_step`` already; at the first one they are at rest.
    """
    tick, parts, plants, channels, delay, signals, code, constants, stack = world
    noise, columns, noise_from = noise_rows
    configs, states, aux = loops
    loop_meters, bands, gauges, onsets = meters
    rows, trend, counts, trend_slots, interval = log
    count = len(loop_meters)
    row_limit = len(rows) // LOG_COLUMNS - count
    channel_count = len(channels)
    gauge_count = len(gauges)
    benefit_count = len(reference.benefits)
    while k < last and counts[0] <= row_limit:
        if len(reference.plants) > 0:
            step_reference(k, parts, reference, loop_meters, signals, code, constants, stack)
        if k > plants_step:
            step_plants(k, parts, plants, delay, signals, code, constants, stack)
        if columns > 0:
            add_noise(k - noise_from, columns, plants, noise, signals)
        if channel_count > 0:
            read_channels(k, channels, signals, code, constants, stack)
        scan(k * tick, configs, states, aux, signals)
        run_step = k - zero
        for i in range(count):
            state = states[i]
            meter = loop_meters[i]
            if state.status != meter.status or state.notice != 0 or state.aux_status != meter.aux_status:
                write_log(run_step, i, state, meter, onsets, rows, counts)
            if 0 < run_step < final_step:
                measure_loop(run_step, meter, signals)
            else:
                measure_edge(run_step, meter, signals)
        if counts[2] > 0:
            watch_bands(run_step, bands, loop_meters, signals)
        if gauge_count > 0:
            read_gauges(run_step, gauges, signals)
        if benefit_count > 0:
            compare_errors(reference.benefits, loop_meters, signals, reference.signal_values)
        if interval > 0 and run_step % interval == 0:
            first_value = counts[1] * len(trend_slots)
            for i in range(len(trend_slots)):
                trend[first_value + i] = signals[trend_slots[i]]
            counts[1] += 1
        k += 1
    return k


STEADY_SHARE = 1e-6
STEADY_COUNTS = 2.0
"""A PV is steady when it moves less than this share of its range, or stays this close to its mean."""


def is_steady(span: Span, steps: int) -> bool:
    """Whether a PV was at rest over a window of ``steps`` (kernel)."""
    if span.high - span.low < STEADY_SHARE * span.width:
        return True
    mean = span.total / steps
    return max(span.high - mean, mean - span.low) <= STEADY_COUNTS * span.width / span.counts


def settle(
    k: int,
    steps: int,
    max_windows: int,
    plants_step: int,
    world: World,
    loops: Loops[Any, Any],
    spans: MutableSequence[Span],
) -> int:
    """Windows of the pre-roll from base step ``k`` on, until all PVs are at rest; returns the next one (kernel).

    Each has ``steps`` base steps, without noise, events, metrics and log; there are ``max_windows`` at most.
    """
    unsteady_count = 1
    while max_windows > 0 and unsteady_count > 0:
        run_window(k, k + steps, plants_step, world, loops, spans)
        k += steps
        max_windows -= 1
        unsteady_count = 0
        for i in range(len(spans)):
            if not is_steady(spans[i], steps):
                unsteady_count += 1
    return k


def run_window(
    k: int, last: int, plants_step: int, world: World, loops: Loops[Any, Any], spans: MutableSequence[Span]
) -> None:
    """One window: base steps ``k`` to ``last`` − 1 (kernel)."""
    tick, parts, plants, channels, delay, signals, code, constants, stack = world
    configs, states, aux = loops
    first = k
    while k < last:
        if k > plants_step:
            step_plants(k, parts, plants, delay, signals, code, constants, stack)
        for i in range(len(plants)):
            signals[plants[i].measured] = signals[plants[i].slot]
        if len(channels) > 0:
            read_channels(k, channels, signals, code, constants, stack)
        scan(k * tick, configs, states, aux, signals)
        for i in range(len(spans)):
            span = spans[i]
            value = signals[span.slot]
            if k == first:
                span.low = value
                span.high = value
                span.total = 0.0
            elif value < span.low:
                span.low = value
            elif value > span.high:
                span.high = value
            span.total += value
        k += 1
