"""What the verdicts of the standing expectations are drawn from: when a loop is looked at, and what is known of it."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from math import hypot
from typing import TYPE_CHECKING, NamedTuple

from pidcfg.schemas.expressions import ABSOLUTE, CONSTANT, MAXIMUM, MINIMUM, NEGATE, ROOT, SIGNAL
from pidcfg.sim.controllers.plc import CONTROL_MODES, SETPOINT, TICKS, steps_until
from pidcfg.sim.engine.expressions import evaluate
from pidcfg.sim.engine.influence import OUTPUT_STEP, pv_change, read_signals
from pidcfg.sim.engine.plants import PERCENT
from pidcfg.sim.judgement.meters import Benefit, Meter
from pidcfg.text.frozen import frozen
from pidcfg.text.paths import dotted_text, leaves

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from pidcfg.schemas.scenario import Event, Scenario
    from pidcfg.schemas.scenario import Plant as PlantText
    from pidcfg.sim.controllers.plc import Plc
    from pidcfg.sim.engine.influence import Influence
    from pidcfg.sim.engine.kernel import Channel
    from pidcfg.sim.engine.network import Network
    from pidcfg.sim.engine.plants import Plant
    from pidcfg.sim.judgement.report import Verdict, VerdictWord

# --- When a loop's error is looked at: at the end of the run, and before what moves the loop or ends its control ------
#
# Design. The events of a scenario are known beforehand, and so are the looks: each ends right before an event, or
# with the run, and has a window before it in which the loop is left alone. The meter of a loop sums up the error of
# one window at a time; between two of them it is set to the next (`aim_meter`), so that the
# kernel knows of one only. How long a window has to be for an answer depends on the plant: `plant_time`.

END_DIVISOR, MIN_DEAD_TIMES, MIN_SAMPLES = 10, 3, 10
"""The end of a run is its last tenth, but so many dead times and samples at least."""
STAGE_DIVISOR = 4
"""Before an event it is the last quarter of the time since the one before, with the same least lengths."""
PATIENCE_TIMES = 4
"""Plant times that a loop may take to get to its set point (D331)."""
SMOOTHING_SAMPLES = 3
"""Samples of a loop that count as a part of its plant: it answers that much later."""


@frozen
class Look:
    """A window in which a loop's error is looked at; all in base steps."""

    start: int
    """Where it begins to be summed up, for whether it gets smaller."""
    middle: int
    """Where the second half of that begins."""
    end: int
    """The last one."""
    stage_start: int
    """Where the last event before it moved the loop; 0: none did."""
    is_final: bool
    """It is the end of the run, and no event comes later."""
    next_event_time: float
    """When the event comes that ends it, in s."""

    @property
    def half_length(self) -> float:
        """Base steps between the two halves."""
        return (self.end + 1 - self.start) / 2


def make_looks(scenario: Scenario, plc: Plc, influence: Influence, i: int, step: int, last: int) -> list[Look]:
    """The looks at one loop in a run of ``last`` base steps of ``step`` ticks; the final one is always there."""
    net = influence.net
    dead_time = max((float(net.texts[name][1].dead_time) for name in influence.plants_between(i)), default=0.0)
    min_length = max(MIN_DEAD_TIMES * dead_time * TICKS / step, MIN_SAMPLES * plc.configs[i].period / step)
    event_ks = {k for k, event in event_steps(scenario, step, last) if influence.can_move(event, i)}
    bounds = [0, *sorted(event_ks - {0})]
    looks = []
    for stage, following in pairwise(bounds):
        length = round(max((following - stage) / STAGE_DIVISOR, min_length))
        if stage + length < following:
            looks.append(_make_look(following - 1, length, stage, final=False, following=following * step / TICKS))
    length = min(last, round(max(last / END_DIVISOR, min_length)))
    return [*looks, _make_look(last, length, bounds[-1], final=True, following=last * step / TICKS)]


def _make_look(end: int, length: int, stage: int, *, final: bool, following: float) -> Look:
    start = max(0, end - length)
    return Look(start, (start + end + 1) // 2, end, stage, final, following)


def event_steps(scenario: Scenario, step: int, last: int) -> Iterator[tuple[int, Event]]:
    """The events of a run, and ends of sensor faults, with their base steps."""
    for event in scenario.events:
        ends = () if event.duration is None else (event.at + event.duration,)
        for time in (event.at, *ends):
            k = steps_until(time, step)
            if k <= last:
                yield k, event


@frozen
class Pace:
    """How fast a loop's PV can answer its output."""

    dead_time: float
    """The dead times of the plants between."""
    seconds: float
    """Dead times and time constants of the plants between, and some samples of the loop."""
    turn_time: float
    """The same without the time in which an integrator crosses the span: a limit has turned its PV round by then."""
    lag_time: float
    """The time constants alone."""
    integrates: bool
    """One of the plants integrates: it comes to rest nowhere by itself."""


def plant_time(plc: Plc, influence: Influence, i: int) -> Pace:
    """The pace of one loop's plants."""
    net = influence.net
    dead_time, lag_time, integrates = 0.0, 0.0, False
    low, high, _ = plc.scales[i]
    out_low, out_high = (0.0, 1.0) if plc.pulse_cycle(i) else plc.output_limits(i, net.signal_values)
    for name in influence.plants_between(i):
        text = net.texts[name][1]
        dead_time += float(text.dead_time)
        lag_time += sum(lag_times(text))
        integrates = integrates or text.model == "integrator"
    speed, turn_time = (
        abs(pv_change(net, plc, i)) * (out_high - out_low),
        SMOOTHING_SAMPLES * plc.configs[i].period / TICKS + dead_time + lag_time,
    )
    crossing = abs(high - low) / speed if integrates and speed else 0.0
    return Pace(dead_time, turn_time + crossing, turn_time, lag_time, integrates)


def lag_times(text: PlantText) -> Iterator[float]:
    """The time constants of a plant, in s."""
    yield from (float(time) for time in text.time_constants or ())
    if text.time_constant is not None:
        yield float(text.time_constant) * max(1.0, 2 * float(text.damping or 0))
    if text.lag is not None:
        yield float(text.lag)


# --- What the verdicts of the standing expectations are drawn from ----------------------------------------------------
#
# Design. `Evidence` holds what a run leaves behind: meters, final signals, the PLC as it stands, the wiring, and the
# scenario. Each kind is a function of the evidence and a loop in a module of its own; `pidcfg.sim.judgement.standing`
# calls them, and knows what keeps a loop from being judged. Only the words of a verdict come from the journal.

NEGLIGIBLE_SHARE = 0.001
"""Of a span: what is less is no difference."""
ROUNDING_COUNTS = 2
"""Counts of a PV: what is less is rounding."""


class Judgement(NamedTuple):
    """What one kind says of one loop; ``at`` in s."""

    verdict: VerdictWord
    text: str
    at: float | None = None
    is_conclusive: bool = True
    """A look at another time may tell more if this is false."""


def proven_verdict(text: str) -> Judgement:
    """The run shows it."""
    return Judgement("proven", text)


def failed_verdict(text: str, at: float | None = None) -> Judgement:
    """The run shows the contrary."""
    return Judgement("failed", text, at)


def open_verdict(missing: str, at: float | None = None) -> Judgement:
    """The run shows neither, and what is missing."""
    return Judgement("not-proven", missing, at)


def too_early_verdict(why: str) -> Judgement:
    """The run does not show it yet, and why."""
    return Judgement("not-proven", why, is_conclusive=False)


def unjudged_verdict(why: str) -> Judgement:
    """The loop is exempt, and why."""
    return Judgement("not-judged", why)


class LookResult(NamedTuple):
    """What a look at a loop in control showed."""

    look: Look
    saturation: Judgement
    lasting_error: Judgement
    has_arrived: bool = False
    """Its PV was at its set point, on average."""


class Swings(NamedTuple):
    """An oscillation; times in base steps."""

    period: float
    amplitude: float
    """Half peak to peak, in PV units."""
    since: int
    """Its first turning point."""


@dataclass
class Evidence:
    """A run that is over."""

    scenario: Scenario
    plc: Plc
    net: Network
    influence: Influence
    meters: Sequence[Meter]
    step: int
    """Ticks of a base step."""
    last: int
    """The last base step."""
    reasons: Mapping[int, str] = field(default_factory=dict)
    """Why a loop changed or did not change its mode last, in words, by its number."""
    given_set_points: Mapping[int, float] = field(default_factory=dict)
    """The set points that the configuration gives, of loops that have none from another loop, by their number."""
    effects: list[float] = field(default_factory=list)
    """How far each loop's output can move its PV (an integrator: in 1 s), as at the start; 0: that is not known."""
    paces: list[Pace] = field(default_factory=list)
    """How fast the plants of each loop are."""
    ignored_events: dict[int, int] = field(default_factory=dict)
    """The event that changed a loop's set point last, where it did not control then."""
    unmet_events: dict[int, tuple[int, int]] = field(default_factory=dict)
    """The same where it was meant to, and from when on it was."""
    requested_set_points: dict[int, tuple[int, float]] = field(default_factory=dict)
    """The event that changed a loop's set point last, and to what, where that is a number in the PV's unit."""
    verdicts: Sequence[Verdict] = ()
    """What became of the scenario's expectations."""
    benefits: Mapping[int, Benefit] = field(default_factory=dict)
    """What the plants of each loop would have done without it, by its number; empty: there was no reference."""
    bands: list[float] = field(default_factory=list)
    """How far from its set point each loop's PV may come to rest (D332)."""
    looks: dict[int, list[LookResult]] = field(default_factory=dict)
    """What the looks at each loop have shown, by its number."""
    swings: dict[int, Swings] = field(default_factory=dict)
    """The first oscillation of each loop that no event stirs up and that reaches the last third, by its number."""

    @property
    def signal_values(self) -> Sequence[float]:
        """The signals as they end."""
        return self.net.signal_values

    def seconds(self, k: float) -> float:
        """A base step as a time."""
        return k * self.step / TICKS

    @cached_property
    def masters(self) -> Sequence[int]:
        """See `LoopFacts.masters`."""
        return self.plc.masters

    def unit(self, loop: int) -> str:
        """The unit of a loop's PV with a blank before it, where it is known."""
        unit = self.plc.units.get(self.plc.loops[loop], "")
        return f" {unit}" if unit else ""

    def cascade_loops(self, loop: int) -> set[int]:
        """A loop and those up and down its cascade."""
        family = {loop}
        while True:
            links = {j for i in family for j in (self.masters[i], *self.slaves(i)) if j >= 0}
            if links <= family:
                return family
            family |= links

    def slaves(self, loop: int) -> Iterator[int]:
        """The loops that have their set point from a loop."""
        return (i for i, master in enumerate(self.masters) if master == loop)

    def mean_errors(self, loop: int) -> tuple[float, float]:
        """SP − PV on average, in the two halves of the window that ends here."""
        m = self.meters[loop]
        early, late = m.window_middle - m.window_start, self.last + 1 - m.window_middle
        return m.early_error / max(early, 1), m.final_error / late

    def set_point_moves(self, loop: int) -> float:
        """By how much the set point is elsewhere in the second half of that window."""
        m = self.meters[loop]
        return abs(
            m.final_sp / (self.last + 1 - m.window_middle) - m.early_sp / max(m.window_middle - m.window_start, 1)
        )

    def span(self, loop: int) -> float:
        """The span of a loop's PV."""
        low, high, _ = self.plc.scales[loop]
        return abs(high - low)

    def min_difference(self, loop: int) -> float:
        """A difference of the PV that is more than rounding."""
        return max(ROUNDING_COUNTS * self.span(loop) / self.plc.scales[loop][2], NEGLIGIBLE_SHARE * self.span(loop))

    def judged_looks(self, loop: int) -> Sequence[LookResult]:
        """What the looks at a loop showed while it was in control; of the last ones only what can be judged."""
        results = self.looks.get(loop, [])
        final = results[-1] if results else None
        if final is not None and final.look.is_final and final.look.stage_start > final.look.start and len(results) > 1:
            return results[:-1]
        return results

    def events(self) -> Iterator[tuple[int, Event]]:
        """The events of the run, and ends of sensor faults, with their base steps."""
        return event_steps(self.scenario, self.step, self.last)

    def events_on(self, loop: int, since: int) -> list[float]:
        """The times from base step ``since`` on at which an event moves a loop's PV or set point."""
        return sorted(
            self.seconds(k) for k, event in self.events() if k >= since and self.influence.can_move(event, loop)
        )

    def set_point_of(self, event: Event, loop: int) -> object:
        """What an event sets a loop's set point to, itself or a signal that it is made of; None: it does not."""
        if event.loop is None:
            made_of, outside = self.influence.set_point_sources[loop], self.net.outside_signals
            values = ((outside[dotted_text(path)], value) for path, value, _ in leaves(event.set or {}))
            return next((value for slot, value in values if slot in made_of), None)
        if event.loop != self.plc.loops[loop]:
            return None
        keys = {*SETPOINT, self.plc.setpoint}
        return next((value for path, value, _ in leaves(event.set or {}) if dotted_text(path) in keys), None)

    def is_set_point(self, event: Event, loop: int) -> bool:
        """Whether what an event sets is the set point itself, as far as the signals tell before it happens."""
        sp = self.signal_values[self.plc.configs[loop].sp_slot]
        sources = self.influence.set_point_sources[loop].intersection(self.influence.written_signals(event))
        return all(abs(self.signal_values[slot] - sp) <= self.bands[loop] for slot in sources)

    def last_mode(self, loop: int) -> str:
        """The mode that a loop ends in."""
        return self.plc.mode(self.meters[loop].status)

    @staticmethod
    def is_control(mode: str) -> bool:
        """Whether a mode is one in which a loop controls."""
        return mode in CONTROL_MODES


DEVIATION_ALARMS = {"deviation_red", "deviation_high_high"}
"""Outermost alarms that say nothing of a loop in Manual."""
BAND_SHARE = 0.02
"""Of the span: how far from its set point a PV may come to rest."""
SWITCHED_BAND_SHARE = 0.05
"""The same where the output is on or off."""
RIPPLE_DIVISOR = 4
"""Of what a whole cycle would move the PV: the swing of pulses that are on for half of it, d (1 − d)."""
NOISE_MARGIN = 3
"""Standard deviations of the noise that are no error."""


def band_of(e: Evidence, i: int) -> float:
    """How far from its set point a loop's PV may come to rest, on average (D332)."""
    tolerance, span = e.scenario.tolerance.get(e.plc.loops[i]), e.span(i)
    if tolerance is not None:
        return float(tolerance.value) * (span / 100 if tolerance.unit == "%" else 1.0)
    inner = e.plc.inner_deviation(i)
    share = SWITCHED_BAND_SHARE if e.plc.is_on_off(i) else BAND_SHARE
    return max(e.min_difference(i), share * span if inner is None else min(share * span, inner))


def pulse_ripple(e: Evidence, i: int) -> float:
    """How far the PV goes up and down with pulses that are on for half of their cycle; 0: there are none."""
    cycle = e.influence.pulse_cycle(i)
    by = OUTPUT_STEP if e.plc.pulse_cycle(i) else PERCENT
    return (
        abs(pv_change(e.net, e.plc, i, step=by)) * cycle / (RIPPLE_DIVISOR * max(e.paces[i].lag_time, cycle))
        if cycle
        else 0.0
    )


def limits_reached(e: Evidence, loop: int) -> str:
    """The limit that a loop's output ends at: ``lower``, ``upper``; empty: it is inside."""
    low, high = e.plc.output_limits(loop, e.signal_values)
    out, slack = e.signal_values[e.plc.configs[loop].out_slot], NEGLIGIBLE_SHARE / 2 * abs(high - low)
    return "upper" if out >= high - slack else "lower" if out <= low + slack else ""


# --- What the meters of a run have to know beforehand: masks, the mode that is wanted, and where the end begins -------

LAST_THIRD_DIVISOR = 3
SWING_COUNTS, SWING_SHARE, SWING_NOISE = 4, 0.01, 10
"""Counts, share of the span, and standard deviations of the noise that a swing must pass, peak to peak."""


def meters_of(scenario: Scenario, plc: Plc, net: Network, last: int) -> list[Meter]:
    """A meter a loop, for a run of ``last`` base steps."""
    return [_make_meter(scenario, plc, net, i, last) for i in range(len(plc.loops))]


def aim_meter(m: Meter, look: Look, pace: float) -> None:
    """Sets a meter to the next look at its loop, whose plant time is ``pace`` base steps."""
    m.window_start, m.window_middle = look.start, look.middle
    m.early_error = m.final_error = m.early_sp = m.final_sp = 0.0
    m.error_sign = 0
    m.watch_from = min(m.last_third, max(look.stage_start, look.start - round(PATIENCE_TIMES * pace)))


def _make_meter(scenario: Scenario, plc: Plc, net: Network, i: int, last: int) -> Meter:
    config = plc.configs[i]
    m = Meter(config.pv_slot, config.sp_slot, config.out_slot)
    m.control_bits = plc.control_bits
    m.wanted_bits = plc.modes.get(plc.initial_modes[i], 0) & m.control_bits
    named = {e.alarm for e in scenario.expect if e.loop == plc.loops[i] and e.alarm and not e.never}
    m.outer_bits = sum(plc.alarm_bits[name] for name in plc.outer_alarms if name not in named)
    m.level_bits = sum(plc.alarm_bits[name] for name in plc.outer_alarms if name not in named | DEVIATION_ALARMS)
    m.last_third = last - last // LAST_THIRD_DIVISOR
    m.min_swing = min_swing(scenario, plc, net, i)
    return m


def min_swing(scenario: Scenario, plc: Plc, net: Network, i: int) -> float:
    """How far a loop's PV must go up and down to swing."""
    low, high, counts = plc.scales[i]
    span = abs(high - low)
    return max(SWING_COUNTS * span / counts, SWING_SHARE * span, SWING_NOISE * noise_of(scenario, plc, net, i))


def noise_of(scenario: Scenario, plc: Plc, net: Network, loop: int) -> float:
    """The standard deviation of the noise of a loop's PV, at rest."""
    total = 0.0
    for name in _noise_sources(net, plc, loop):
        plant = net.plants[net.plant_index[name]]
        later = [(e.disturb or {}).get("noise", 0) for e in scenario.events if (e.plant or e.loop) == name]
        sigma = max([plant.sigma, *map(float, later)])
        total = hypot(total, _pv_change(net, plc, loop, plant.measured, sigma))
    return total


def _noise_sources(net: Network, plc: Plc, loop: int) -> list[str]:
    """The noisy plants whose measurements a loop's PV is made of, by what reads what alone."""
    if loop not in net.noise_sources:
        inlet = plc.pv_inputs.get(plc.loops[loop])
        target = plc.configs[loop].in_slot if inlet is None else plc.inputs[inlet]
        net.noise_sources[loop] = []
        for name in net.noisy_plants:
            reached = {net.plants[net.plant_index[name]].measured}
            for channel in net.channels:
                if not reached.isdisjoint(read_signals(net, channel)):
                    reached.add(channel.target)
            net.noise_sources[loop] += [name] if target in reached else []
    return net.noise_sources[loop]


def _pv_change(net: Network, plc: Plc, loop: int, measured: int, sigma: float) -> float:
    """What a change of a measurement by ``sigma`` makes of a loop's PV, by way of connections alone."""
    raised_signals = list(net.signal_values)
    raised_signals[measured] += sigma
    stack = net.pool.new_stack()
    for channel in net.channels:
        if channel.source >= 0:
            raised_signals[channel.target] += raised_signals[channel.source] - net.signal_values[channel.source]
        else:
            ends = [
                evaluate(net.pool.code, net.pool.constants, channel.first, channel.last, signals, stack)
                for signals in (net.signal_values, raised_signals)
            ]
            raised_signals[channel.target] += ends[1] - ends[0]
    inlet = plc.pv_inputs.get(plc.loops[loop])
    target = plc.configs[loop].in_slot if inlet is None else plc.inputs[inlet]
    return abs(raised_signals[target] - net.signal_values[target])


# --- Whether another loop's output is taken in the place of a loop's own: by a selector, by ``min`` or ``max`` --------
#
# Design. What is taken instead has to follow another loop's output. The smaller or larger of an output and a
# constant, or of an output and a signal from outside, is a limit of the output: a loop that stands at it is
# saturated. So is one whose output a plant takes as it is, whatever the loop's own inputs say.

OPERAND_COUNTS = {CONSTANT: 0, SIGNAL: 0, NEGATE: 1, ABSOLUTE: 1, ROOT: 1}
"""How many operands an operation takes; all others take two."""


def is_deselected(e: Evidence, i: int) -> bool:
    """Whether a loop acts on nothing now, since another loop's output is taken in its place."""
    out = e.plc.configs[i].out_slot
    own_signals, others = e.influence.own_and_other_signals(i)
    if any(out in read_signals(e.net, plant) and not _is_left_out(e, plant, out, others) for plant in e.net.plants):
        return False
    return e.plc.is_deselected(i, e.signal_values, own_signals, others) or _is_selected_away(e, i, others)


def _is_selected_away(e: Evidence, i: int, others: frozenset[int]) -> bool:
    """Whether every plant or connection that reads a loop's output takes the smaller or larger of it and a rival."""
    out = e.plc.configs[i].out_slot
    wired: list[Plant | Channel] = [*e.net.plants, *e.net.channels]
    readers = [reader for reader in wired if out in read_signals(e.net, reader)]
    return bool(readers) and all(_is_left_out(e, reader, out, others) for reader in readers)


def _is_left_out(e: Evidence, reader: Plant | Channel, out: int, others: frozenset[int]) -> bool:
    pool = e.net.pool
    if reader.source >= 0:
        return False
    values = set()
    for away in (-NEGLIGIBLE_SHARE, 0.0, NEGLIGIBLE_SHARE):
        signals = list(e.signal_values)
        signals[out] += away * (abs(signals[out]) + 1.0)
        values.add(evaluate(pool.code, pool.constants, reader.first, reader.last, signals, pool.new_stack()))
    return len(values) == 1 and any(
        out in lost and others & taken for taken, lost in _selections(e, reader.first, reader.last)
    )


def _selections(e: Evidence, first: int, last: int) -> Iterator[tuple[set[int], set[int]]]:
    """Of each ``min`` and ``max`` in an expression the signals of what it takes now, and of what it leaves out."""
    pool, operand_starts = e.net.pool, list[int]()
    code = pool.code
    for position in range(first, last, 2):
        if code[position] in {MINIMUM, MAXIMUM}:
            (a, b), end = operand_starts[-2:], position
            sides = (a, b), (b, end)
            left, right = (evaluate(code, pool.constants, *side, e.signal_values, pool.new_stack()) for side in sides)
            signals = [{code[k + 1] for k in range(*side, 2) if code[k] == SIGNAL} for side in sides]
            takes_right = right < left if code[position] == MINIMUM else right > left
            yield (signals[1], signals[0]) if takes_right else (signals[0], signals[1])
        operands = OPERAND_COUNTS.get(code[position], 2)
        if operands == 0:
            operand_starts.append(position)
        elif operands == 2:
            operand_starts.pop()
