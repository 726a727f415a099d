"""A neutral loop that keeps to the rules of a PLC: the source's numbers with the target's windup, start and so on.

Design. A conversion changes rules that no number says: what an integral does at a limit, what a dead band does, how a
loop begins. So the battery holds neither side against the other, but both against a loop in double precision that has
the numbers of the source's file and a switch for each rule (`Rules`): with the source's rules it must do what the
source does, with the target's rules what the target does. It shares no line of its equation with any vendor's.
"""

from __future__ import annotations

from collections.abc import MutableSequence, Sequence
from dataclasses import dataclass, field
from math import gcd, isfinite, sqrt
from typing import Any

from pidcfg.conversion.operation import (
    Deadband,
    Filter,
    Hand,
    Interlock,
    Manual,
    Master,
    Operation,
    Rate,
    Smoothing,
    Start,
    Transfer,
    Windup,
    WithoutIntegral,
    Zero,
)
from pidcfg.encoders.contract import encoder_of
from pidcfg.schemas.generic import GenericFile, Loop
from pidcfg.sim.controllers.generic import equation as bits
from pidcfg.sim.controllers.generic import scan as generic
from pidcfg.sim.controllers.generic.equation import AUTO, BUMPLESS, CASCADE, MANUAL, MODES, NO_PAST, REQUEST, SP_SET
from pidcfg.sim.controllers.generic.scan import Generic, filter_share
from pidcfg.sim.controllers.kernels import clamp, round_half_even
from pidcfg.sim.controllers.plc import TICKS, CountsPlc
from pidcfg.sim.costs import COSTS
from pidcfg.study.verification.trial import Side, new_plc, root_step
from pidcfg.text.frozen import frozen
from pidcfg.text.references import Decision
from pidcfg.vendors import VENDORS

D927 = Decision(
    927,
    "a conversion is proved by a loop that stands in for both sides",
    "The numbers of the source's file run in a loop of double precision with a switch for each rule: how it begins, "
    "what holds the output in Manual and the integral at a limit, what a dead band does, how it comes to Auto, how "
    "filters are worked out, and what is counted. With the rules of the source it must do what the source does, with "
    "those of the target what the target does. A number is another one only where a line of the report says which, "
    "and then the target must have that one; a rule only where a line names it, and then it is that rule. The action "
    "never is. A number or a rule that is another one without a line fails whatever the stages show. What a line "
    "says is lost and no neutral loop has is left out of the source. Numbers that are moved by "
    "10 % (limits by 2 % of the range) without being seen in any stage are listed as not shown.",
    "A sentence that explained a stage explained everything in it: an action that was turned round drove the output to "
    "its limit, and the line about the integral at a limit called 19 differences of up to 90 % of the output alike.",
)
FRESH_DERIVATIVE = 64
"""`State.pending`: the next calculation has no past for its derivative."""
WINDUP_BY_OUTPUT = (Windup.WORKED_OUT, Windup.NONE)
"""What the integral is worked out of the output that is sent."""
SHARE_DIGITS = 10
"""Of a filter's share, which a time constant in the neutral form says with so many."""
EDGE_SHARE = 0.1
"""Share of a count by which a number in double precision may miss a whole one."""
ALARM_LEVELS = {"low_low_at": -1, "low_at": -1, "high_at": 1, "high_high_at": 1, "deviation_at": 2, "deviation_2_at": 2}
"""Alarm points: those of the PV count from the low end of its range; a positive one is passed upward."""
WINDUP_AT_LIMITS = (Windup.FROZEN, Windup.WITHIN_LIMITS)
WINDUP_AT_ENDS = (Windup.FROZEN_AT_ENDS, Windup.WITHIN_RANGE)
"""Rules with an integral that stays between the limits of the output, or between the ends of its range."""


@frozen
class Rules:
    """The switches of one loop."""

    operation: Operation
    pv_count: float = 0.0
    """What the PLC rounds a PV to, in the PV's unit; 0: to nothing."""
    setpoint_count: float = 0.0
    """The same of a set point, which a root makes coarser."""
    output_count: float = 0.0
    """The same of the output, in the unit of the output's signal."""
    lowest_count: float = 0.0
    """The count at the low end of the PV's range: ties go to even counts."""
    filter_cycle: int = 0
    """Ticks between two calculations of the PV's filter; 0: it is worked out with the samples."""

    @classmethod
    def make(cls, side: Side, i: int, operation: Operation) -> Rules:
        """Those of a loop of a PLC that calculates as ``side`` does."""
        plc = new_plc(side, (i,))
        task = getattr(getattr(side.config, "plc", None), "sample_time", None)
        if operation.filter is Filter.CYCLIC and task is not None:  # else a loop without a filter, in another PLC
            return cls(operation, filter_cycle=round(float(task) * TICKS))
        if not isinstance(plc, CountsPlc):
            return cls(operation)
        low, high, counts = plc.scales[i]
        loop = side.loop(i)
        width = float(loop.output.range[1] - loop.output.range[0])
        count = abs(high - low) / counts
        output = width / getattr(plc.configs[i], "out_span", 4095)
        return cls(operation, count, root_step(side, i) or count, output, plc.configs[i].pv_min)


@dataclass(slots=True)
class Config(bits.Config):
    """A neutral loop's, with its rules."""

    rules: Rules = field(default_factory=lambda: Rules(None))  # type: ignore[arg-type] # each loop gets its own


@dataclass(slots=True)
class State(bits.State):
    """A neutral loop's; ``integral`` is the whole bias of the output."""

    counts: float = 0.0
    """The PV in counts, filtered, before its root."""
    filtered_pv: float = 0.0
    """The PV of a filter that is worked out in cycles of its own."""
    unlimited_output: float = 0.0
    """The output within its range, before its limits."""
    error_sign: float = 0.0
    has_crossed: int = 0
    """The PV has crossed the set point since it came into the dead band."""
    goal_mode: int = 0
    """The mode that the loop is brought to after its start; 0: it is there."""
    goal_sp: float = 0.0


# --- The equation: PV, error, derivative, integral and output, each with the rules that vendors have for it -----------


TIE_DIGITS = 9
"""Of counts that were divided: a half that misses itself by the last digit of double precision is a half."""


def whole_count(counts: float) -> float:
    """The nearest count; of a half the even one, as the PLC's product has it."""
    return round_half_even(round(counts, TIE_DIGITS))


def round_to_count(value: float, low: float, count: float) -> float:
    """A value in whole counts from ``low`` on."""
    return low + whole_count((value - low) / count) * count if count else value


def measure_pv(config: Config, state: State, raw: float) -> None:
    """The PV, its root and its filter; a PLC that counts filters the counts, before the root."""
    rules = config.rules
    first = state.pending & NO_PAST
    if rules.pv_count:
        zero = config.pv_low - rules.lowest_count * rules.pv_count
        last = rules.lowest_count + config.pv_span / rules.pv_count
        counts = whole_count(clamp((raw - zero) / rules.pv_count, rules.lowest_count, last))
        if state.pv_share < 1.0 and not first:
            counts = round_half_even(state.counts + state.pv_share * (counts - state.counts))
        state.counts = counts
        raw = zero + counts * rules.pv_count
    pv = raw
    if config.square_root:
        pv = config.pv_low + config.pv_span * sqrt(max((raw - config.pv_low) / config.pv_span, 0.0))
    state.previous_pv = pv if first else state.pv
    if rules.filter_cycle:
        pv = state.filtered_pv
    elif state.pv_share < 1.0 and not first and not rules.pv_count:
        pv = state.pv + (pv - state.pv) * state.pv_share
    state.pv = pv


def check_dead_band(config: Config, state: State, error: float) -> bool:
    """Whether the rule of the dead band holds."""
    band, rule = config.deadband, config.rules.operation.deadband
    edge = EDGE_SHARE * config.rules.pv_count
    is_inside = band > 0.0 and abs(error) < band + (edge if config.rules.operation.has_edge else -edge)
    if rule is not Deadband.CROSSED:
        return is_inside
    if not is_inside:
        state.has_crossed = 0
    elif state.error_sign * error < 0.0:
        state.has_crossed = 1
    if error:
        state.error_sign = 1.0 if error > 0.0 else -1.0
    return bool(state.has_crossed)


def calculate_derivative(config: Config, state: State, *, in_dead_band: bool) -> float:
    """D after its filter."""
    operation = config.rules.operation
    if config.derivative_on_error:
        change = state.error - state.previous_error
    else:
        change = state.previous_pv - state.pv if config.output_raises_pv else state.pv - state.previous_pv
        if in_dead_band and operation.deadband is Deadband.CROSSED:
            change = 0.0
    if state.pending & FRESH_DERIVATIVE:
        change, state.filtered_difference = 0.0, 0.0
        state.pending &= ~FRESH_DERIVATIVE
    if in_dead_band and operation.deadband is Deadband.ONLY_BIAS:
        state.filtered_difference = 0.0
        return 0.0
    state.filtered_difference += (change - state.filtered_difference) * state.derivative_share
    return state.kd * state.filtered_difference


def begin_control(config: Config, state: State, proportional_term: float, derivative_term: float) -> bool:
    """The integral with which a loop comes out of Manual; whether the first sample is left out of it."""
    operation = config.rules.operation
    if state.ki <= 0.0:
        if operation.windup is Windup.NONE:
            state.integral = state.out - proportional_term - derivative_term
        elif operation.without_integral is WithoutIntegral.TAKEN_OVER:
            state.integral = state.out
        return False
    rounds = config.square_root and config.rules.setpoint_count > 0.0 and config.sp_follows_pv
    if operation.transfer is Transfer.ON_TOP or (rounds and operation.windup is not Windup.NONE):
        state.integral = state.out  # a set point that is the root of the PV in whole counts leaves an error
        return False
    if not operation.follows_output:
        state.integral = state.out - proportional_term - derivative_term
    return operation.windup is Windup.CONDITIONAL


def holds_integral(config: Config, state: State, step: float) -> bool:
    """Whether the integral stands still because of what the output was."""
    rule, low = config.rules.operation.windup, config.out_low
    high = low + config.out_span
    if rule is Windup.FROZEN:
        return state.out >= config.limit_high or state.out <= config.limit_low
    if rule is Windup.FROZEN_AT_ENDS:
        return (step > 0.0 and state.out >= high) or (step < 0.0 and state.out <= low)
    if rule is Windup.CONDITIONAL_AT_ENDS:
        return (step > 0.0 and state.unlimited_output >= high) or (step < 0.0 and state.unlimited_output <= low)
    return False


def bound_integral(config: Config, state: State) -> None:
    """The integral within the limits or the range, where the rule has it so."""
    if config.rules.operation.windup in WINDUP_AT_LIMITS:
        state.integral = clamp(state.integral, config.limit_low, config.limit_high)
    elif config.rules.operation.windup in WINDUP_AT_ENDS:
        state.integral = clamp(state.integral, config.out_low, config.out_low + config.out_span)


def calculate_output(config: Config, state: State, proportional_term: float, derivative_term: float) -> None:
    """The output with the integral of this sample, and what the limits make of both."""
    windup = config.rules.operation.windup
    step = state.ki * state.error
    if state.pending & BUMPLESS:
        state.pending &= ~BUMPLESS
        if begin_control(config, state, proportional_term, derivative_term):
            step = 0.0
    if (
        state.ki <= 0.0
        and windup is not Windup.NONE
        and (config.rules.operation.without_integral is WithoutIntegral.CONSTANT)
    ):
        state.integral = state.bias
    previous_integral = state.integral
    if not holds_integral(config, state, step):
        state.integral += step
    bound_integral(config, state)
    output = proportional_term + state.integral + derivative_term
    send_output(config, state, output)
    if (windup is Windup.HELD_BEYOND and not config.limit_low <= output <= config.limit_high) or (
        windup is Windup.CONDITIONAL
        and ((output > config.limit_high and step > 0.0) or (output < config.limit_low and step < 0.0))
    ):
        state.integral = previous_integral
    elif windup in WINDUP_BY_OUTPUT and (state.ki > 0.0 or windup is Windup.NONE):
        if not config.limit_low <= output <= config.limit_high:
            state.integral = clamp(output, config.limit_low, config.limit_high) - proportional_term - derivative_term
    elif windup is Windup.PARTIAL and (output - state.out) * step > 0.0:
        room = state.out - (proportional_term + previous_integral + derivative_term)
        state.integral = previous_integral + (clamp(room, 0.0, step) if step > 0.0 else clamp(room, step, 0.0))


def send_output(config: Config, state: State, output: float) -> None:
    """The output as fast as it may, within its limits, in counts."""
    count = config.rules.output_count
    state.unlimited_output = round_to_count(
        clamp(output, config.out_low, config.out_low + config.out_span), config.out_low, count
    )
    bits.move_output(config, state, output)
    state.out = clamp(round_to_count(state.out, config.out_low, count), config.limit_low, config.limit_high)


def send_manual_output(config: Config, state: State) -> None:
    """The operator's output, which some PLCs limit."""
    if config.rules.operation.moves_by_hand:
        send_output(config, state, state.manual_output)
    elif config.rules.operation.hand is Hand.LIMITED:
        state.out = state.unlimited_output = clamp(state.manual_output, config.limit_low, config.limit_high)
    else:
        state.out = state.unlimited_output = round_to_count(
            state.manual_output, config.out_low, config.rules.output_count
        )


# --- Modes: how a loop begins, and what becomes of set point, output and integral when it is switched -----------------


def is_refused(config: Config, state: State, mode: int) -> bool:
    """Whether an alarm of the PV keeps a loop in Manual."""
    if config.rules.operation.interlock is Interlock.GRANTED or not state.status & MANUAL or mode == MANUAL:
        return False
    pv = state.pv
    return (
        pv < config.low_at
        or pv < config.low_low_at
        or pv > config.high_at
        or pv > config.high_high_at
        or bool(state.status & (bits.LOW | bits.LOW_LOW | bits.HIGH | bits.HIGH_HIGH))
    )


def switch_mode(config: Config, state: State) -> None:
    """The requested mode takes effect, or is refused."""
    mode, operation = state.wanted_mode, config.rules.operation
    if is_refused(config, state, mode):
        if not state.goal_mode:
            state.wanted_mode = MANUAL
            state.pending &= ~(REQUEST | bits.MANUAL_SET | SP_SET)
        return
    if mode == MANUAL and not state.status & MANUAL:
        if not state.pending & bits.MANUAL_SET and operation.manual is Manual.STAYS:
            state.manual_output = state.out
    elif state.status & MANUAL and mode != MANUAL:
        state.pending |= BUMPLESS | (FRESH_DERIVATIVE if operation.rate is Rate.ANEW else 0)
        if config.sp_follows_pv and not (state.pending & SP_SET or operation.keeps_following):
            state.sp = state.pv
    state.pending &= ~(REQUEST | bits.MANUAL_SET | SP_SET)
    state.status = (state.status & ~MODES) | mode


def choose_setpoint(i: int, configs: Sequence[Config], states: Sequence[State]) -> None:
    """The set point in force: its own, the PV or the master's output, within its limits."""
    config, state = configs[i], states[i]
    if state.status & CASCADE and config.master >= 0:
        state.sp = states[config.master].out
    state.sp = clamp(state.sp, config.sp_low, config.sp_high)
    if state.status & CASCADE and config.master >= 0 and config.rules.operation.limits_master:
        states[config.master].out = state.sp


def waits_for_slave(i: int, configs: Sequence[Config], states: Sequence[State]) -> bool:
    """Whether a slave is still on its way to Cascade, where a master goes to Manual without one."""
    if configs[i].rules.operation.master is not Master.MANUAL or not states[i].status & MANUAL:
        return False
    return any(config.master == i and state.goal_mode == CASCADE for config, state in zip(configs, states, strict=True))


def approach_goal(state: State) -> None:
    """A loop that waits in Manual after its start is brought to its mode, as an operator would."""
    if state.status & state.goal_mode:
        state.goal_mode, state.sp = 0, state.goal_sp
    else:
        state.wanted_mode = state.goal_mode if state.status & AUTO else AUTO
        state.pending |= REQUEST


def rounded_setpoint(config: Config, state: State) -> float:
    """The set point in the counts of the PV, or of its root."""
    rules = config.rules
    zero = 0.0 if config.square_root else rules.lowest_count * rules.pv_count
    return round_to_count(state.sp, config.pv_low - zero, rules.setpoint_count)


def measure_error(config: Config, state: State) -> bool:
    """The error as it counts, and whether the rule of the dead band holds."""
    operation = config.rules.operation
    sp = rounded_setpoint(config, state)
    error = sp - state.pv if config.output_raises_pv else state.pv - sp
    in_dead_band = check_dead_band(config, state, error)
    if in_dead_band and operation.deadband in {Deadband.AS_ZERO, Deadband.CROSSED}:
        error = 0.0
    if operation.squares_error:
        error *= abs(error) / config.pv_span
    state.previous_error = error if state.pending & NO_PAST else state.error
    state.error = error
    return in_dead_band


def control_in_dead_band(config: Config, state: State, proportional_term: float, derivative_term: float) -> None:
    """The output inside a dead band that does more than to take the error away."""
    if config.rules.operation.deadband is Deadband.HELD:
        state.integral = state.out - proportional_term - derivative_term
    else:
        if state.pending & BUMPLESS:
            state.integral = state.out
        bound_integral(config, state)
        send_output(config, state, state.integral)
    state.pending &= ~BUMPLESS


def sample(i: int, configs: list[Config], states: list[State], signals: list[float]) -> None:
    """One calculation of a loop."""
    config, state = configs[i], states[i]
    operation = config.rules.operation
    measure_pv(config, state, signals[config.in_slot])
    if state.goal_mode and not waits_for_slave(i, configs, states):
        approach_goal(state)
    if state.pending & REQUEST:
        goes_to_cascade = state.wanted_mode == CASCADE and not state.status & CASCADE
        switch_mode(config, state)
        if goes_to_cascade and operation.leads_master and config.master >= 0:
            master = states[config.master]
            master.out = master.manual_output = state.pv
    choose_setpoint(i, configs, states)
    in_dead_band = measure_error(config, state)
    proportional_term = state.kp * state.error if config.proportional_on else 0.0
    derivative_term = calculate_derivative(config, state, in_dead_band=in_dead_band)
    state.pending &= ~NO_PAST
    if state.status & MANUAL:
        send_manual_output(config, state)
        state.integral = state.out - proportional_term - derivative_term
    elif operation.master is Master.FOLLOWS and generic.tracks_slave(i, configs, states):
        state.out = clamp(states[config.first_slave].sp, config.limit_low, config.limit_high)
        state.pending |= BUMPLESS
    elif in_dead_band and operation.deadband in {Deadband.HELD, Deadband.ONLY_BIAS}:
        control_in_dead_band(config, state, proportional_term, derivative_term)
    else:
        calculate_output(config, state, proportional_term, derivative_term)
    bits.renew_alarms(config, state)
    signals[config.pv_slot] = state.pv
    signals[config.sp_slot] = rounded_setpoint(config, state)
    signals[config.out_slot] = state.out
    signals[config.bias_slot] = state.integral
    if state.status & MANUAL and config.sp_follows_pv and operation.keeps_following:
        state.sp = state.pv  # a program moves it behind the block: the next sample is the first that has it


def filter_pv(tick: int, config: Config, state: State, raw: float) -> None:
    """One cycle of a filter that runs faster than its loop."""
    if tick == 0:
        state.filtered_pv = raw
    elif tick % config.rules.filter_cycle == 0:
        state.filtered_pv += (raw - state.filtered_pv) * state.pv_share


def scan(tick: int, configs: list[Config], states: list[State], _aux: list[float], signals: list[float]) -> None:
    """The loops that are due at ``tick``, and filters with cycles of their own."""
    for i, (config, state) in enumerate(zip(configs, states, strict=True)):
        if config.rules.filter_cycle:
            filter_pv(tick, config, state, signals[config.in_slot])
        if tick >= state.due:
            due = state.due + state.period
            state.due = due if due > tick else tick + state.period
            sample(i, configs, states, signals)


# --- The loops as a side of the battery -------------------------------------------------------------------------------


class StandInPlc(Generic):
    """Neutral loops with rules."""

    config, state = Config, State
    configs: Sequence[Config]
    states: Sequence[State]

    def __init__(self, image: Any, rules: Sequence[Rules]) -> None:
        self._rules = rules
        super().__init__(image)

    @property
    def base_ticks(self) -> int:
        """The step in which samples and cycles of filters are whole."""
        return gcd(super().base_ticks, *(config.rules.filter_cycle for config in self.configs))

    def begin(self, loop: int) -> None:
        """What a loop starts with."""
        config, state = self.configs[loop], self.states[loop]
        config.rules = self._rules[loop]
        super().begin(loop)
        operation = config.rules.operation
        self._set_filters(loop)
        self._round_levels(loop)
        state.integral = state.bias
        if operation.zero is Zero.OF_RANGE and (state.ki > 0.0 or not state.bias):
            state.integral = config.out_low
        if operation.start is not Start.RUNS and not state.status & MANUAL:
            state.goal_mode, state.goal_sp = state.status & MODES, state.sp
            state.status = (state.status & ~MODES) | MANUAL
            state.wanted_mode = MANUAL
            self._begin_manual(loop)
        elif state.status & MANUAL:
            self._begin_manual(loop)

    def _begin_manual(self, loop: int) -> None:
        """The output that a loop begins with in Manual."""
        config, state, configured = self.configs[loop], self.states[loop], self._contents[loop].get("output.manual")
        operation = config.rules.operation
        limited = operation.hand is Hand.LIMITED
        first = float((0.0 if operation.zero is Zero.OF_UNIT else config.out_low) if configured is None else configured)
        state.out = state.manual_output = clamp(first, config.limit_low, config.limit_high) if limited else first
        self._show_signals(loop, self.signal_values)

    def request(self, loop: int, mode: str) -> None:
        """A mode for the next sample, in the place of the one that the configuration gives."""
        self.states[loop].goal_mode = 0
        super().request(loop, mode)

    def set(self, loop: int, path: tuple[str, ...], value: Any, signals: MutableSequence[float]) -> str | None:
        """Write a field."""
        text = super().set(loop, path, value, signals)
        self._set_filters(loop)
        self._round_levels(loop)
        return text

    def _round_levels(self, loop: int) -> None:
        """Levels and distances in whole counts of the PV."""
        config, count = self.configs[loop], self.configs[loop].rules.pv_count
        config.deadband = round_to_count(config.deadband, 0.0, config.rules.setpoint_count)
        if not count or config.square_root:
            return
        config.hysteresis = round_to_count(config.hysteresis, 0.0, count)
        for name, side in ALARM_LEVELS.items():
            value = getattr(config, name)
            low = config.pv_low if abs(side) == 1 else 0.0
            setattr(
                config,
                name,
                round_to_count(value, low, count) + side * EDGE_SHARE * count if isfinite(value) else value,
            )

    def _set_filters(self, loop: int) -> None:
        """The filters and the integral as the rules work them out."""
        config, state = self.configs[loop], self.states[loop]
        if config.rules.filter_cycle:
            state.pv_share = filter_share(float(self._contents[loop]["pv.filter"]), config.rules.filter_cycle / TICKS)
        state.pv_share = round(state.pv_share, SHARE_DIGITS)
        slowest = float(config.rules.operation.slowest_integral)
        if slowest and state.ki <= 0.0:
            state.ki = state.kp * state.period / TICKS / slowest
        if self.configs[loop].rules.operation.smoothing is Smoothing.BACKWARD:
            time = float(self._contents[loop]["tuning.derivative_filter"])
            seconds = state.period / TICKS
            state.derivative_share = seconds / (seconds + time)


@dataclass(frozen=True)
class StandIn(Side):
    """A side whose loops are neutral ones with rules; ``vendor`` is the neutral form."""

    rules: Sequence[Rules] = ()

    def load(self, *, operator_only: bool) -> StandInPlc:  # noqa: ARG002 - nobody else switches it
        """The loops, which nobody but the operator switches."""
        return StandInPlc(self.image, self.rules)

    @property
    def controller(self) -> Any:
        """What the runner calls."""
        return Controller


class Controller:
    """What `pidcfg.sim.engine.run.simulate` needs of a controller."""

    COST, INLINED, Config, State, scan, load = COSTS["generic"], (), Config, State, staticmethod(scan), StandInPlc


def make_stand_in(loops: Sequence[Loop | None], rules: Sequence[Rules | None]) -> StandIn:
    """Neutral loops with rules; one without a neutral form keeps its place and does nothing."""
    vendor = VENDORS["generic"]
    first = next(loop for loop in loops if loop is not None)
    neutral_loops = [
        first.model_copy(update={"name": f"_{i}"}) if loop is None else loop for i, loop in enumerate(loops)
    ]
    config = GenericFile(pidcfg=1, vendor="generic", loops=neutral_loops)
    other = next(rule for rule in rules if rule is not None)
    return StandIn(vendor, config, encoder_of(vendor).encode(config).image, tuple(loops), [r or other for r in rules])
