"""The virtual controller of neutral loops: what is done at each base step.

Design. `scan` is called at every base step; it calculates the loops whose sample time has passed, in the order of the
file, and renews the pulses. `sample` is one calculation of one loop: PV, mode, set point, error, then the master of a
slave that is not in cascade, manual or the equation, and the alarms. Nothing here knows files, names or units: see
`plc.load` for how parameters become `Config` and `State`.

Signals of a loop (slots in `Config`): ``in_slot`` is read, in PV's unit; PV, SP, OUT, BIAS (bias and integral) and, for
a loop with a pulse output, PULSE are written.
"""

from __future__ import annotations

from collections.abc import Sequence

from pidcfg.sim.controllers.generic.equation import (
    AUTO,
    BUMPLESS,
    CASCADE,
    FRESH,
    LIMITED,
    MANUAL,
    MANUAL_SET,
    MODES,
    REQUEST,
    SLOWED,
    SP_SET,
    TRACKING,
    Config,
    State,
    calculate_derivative,
    calculate_error,
    calculate_output,
    measure_pv,
    output_manual,
    pulse,
    renew_alarms,
    restore_integral,
)
from pidcfg.sim.controllers.generic.plc import Generic, load
from pidcfg.sim.controllers.kernels import clamp
from pidcfg.sim.controllers.plc import ScanOptions as Options
from pidcfg.sim.costs import COSTS

__all__ = ["COST", "INLINED", "Config", "Generic", "Options", "State", "load", "sample", "scan"]


def switch_mode(config: Config, state: State) -> None:
    """The requested mode takes effect, without a bump (D301)."""
    if state.wanted_mode == MANUAL and not state.status & MANUAL:
        if state.pending & MANUAL_SET == 0:
            state.manual = state.out
    elif state.status & MANUAL and state.wanted_mode != MANUAL:
        state.pending |= BUMPLESS
        if config.sp_follows_pv and state.wanted_mode == AUTO and state.pending & SP_SET == 0:
            state.sp = state.pv
    state.pending &= ~(REQUEST | MANUAL_SET | SP_SET)
    state.status = (state.status & ~MODES) | state.wanted_mode


def tracks_slave(i: int, configs: Sequence[Config], states: Sequence[State]) -> bool:
    """Whether the loop has slaves, and none of them is in cascade."""
    if configs[i].first_slave < 0:
        return False
    for j in range(len(configs)):  # noqa: SIM110 - a generator cannot be compiled
        if configs[j].master == i and states[j].status & CASCADE:
            return False
    return True


def sample(i: int, configs: list[Config], states: list[State], signals: list[float]) -> None:
    """One calculation of a loop."""
    config = configs[i]
    state = states[i]
    measure_pv(config, state, signals[config.in_slot])
    if state.pending & REQUEST:
        switch_mode(config, state)
    if state.status & CASCADE and config.master >= 0:
        state.sp = states[config.master].out
    state.sp = clamp(state.sp, config.sp_low, config.sp_high)
    calculate_error(config, state)
    proportional_term = state.kp * state.error if config.proportional_on else 0.0
    derivative_term = calculate_derivative(config, state)
    state.pending &= ~FRESH
    state.status &= ~TRACKING
    if state.status & MANUAL:
        output_manual(config, state, proportional_term, derivative_term)
    elif tracks_slave(i, configs, states):
        state.status = (state.status & ~(LIMITED | SLOWED)) | TRACKING
        state.out = clamp(states[config.first_slave].sp, config.low, config.high)
        restore_integral(state, proportional_term, derivative_term)
        state.pending |= BUMPLESS
    else:
        calculate_output(config, state, proportional_term, derivative_term)
    renew_alarms(config, state)
    signals[config.pv_slot] = state.pv
    signals[config.sp_slot] = state.sp
    signals[config.out_slot] = state.out
    signals[config.bias_slot] = state.bias + state.integral


def scan(tick: int, configs: list[Config], states: list[State], aux: list[float], signals: list[float]) -> None:
    """The loops that are due at ``tick``, and the pulses of all."""
    for i in range(len(configs)):
        state = states[i]
        due = state.due
        if tick >= due:
            due += state.period
            state.due = due if due > tick else tick + state.period
            sample(i, configs, states, signals)
        if configs[i].has_pulses:
            pulse(tick, configs[i], state, signals)


INLINED = (scan, sample, measure_pv, calculate_error, calculate_derivative, calculate_output, renew_alarms)
"""The hot path of compiled code."""
COST = COSTS["generic"]
