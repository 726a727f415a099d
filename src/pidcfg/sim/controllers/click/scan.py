"""The virtual CLICK: what one pass of the main program does, and its registers as others see them."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, MutableSequence, Sequence
from math import isnan

from pidcfg.encoders.maps.click import BLOCKS, MODE_BITS, SPACE
from pidcfg.encoders.regmap import Word
from pidcfg.sim.controllers.click.autotune import tune
from pidcfg.sim.controllers.click.equation import (
    AUTO,
    BIAS_ERROR,
    BIAS_NUMBER,
    FIRST,
    GOAL,
    MANUAL,
    NAN,
    PID_ERROR,
    REQUEST,
    TUNING,
    Config,
    State,
    calculate_output,
    pulse,
    renew_alarms,
)
from pidcfg.sim.controllers.click.operate import ALARM_BITS, FIXED, OVERRIDE_ERROR, to_manual, update_mode
from pidcfg.sim.controllers.click.plc import Click, load
from pidcfg.sim.controllers.kernels import clamp, finite, single
from pidcfg.sim.controllers.plc import ScanOptions as Options
from pidcfg.sim.controllers.settings import NOT_NOW, Done, RegisterError, Registers
from pidcfg.sim.costs import COSTS

# --- The virtual CLICK: what one pass of the main program does for its PID loops --------------------------------------
#
# Design. `scan` is called at every base step, calculates the loops that are due, and renews the discrete outputs of
# those with pulse width modulation. `sample` is one calculation of one loop: PV and filter, mode requests, set-point
# limits, alarms, autotune, equation, output limits. Every result of the calculation is rounded to single precision
# (D110). Nothing here knows files, names or units: see `plc.load` for how registers become `Config` and `State`.
#
# Signals of a loop (slots in `Config`): ``in_slot`` is read, in the PV's unit; ``pv_slot``, ``sp_slot``, ``out_slot``,
# ``bias_slot`` and ``error_slot`` are written as the registers say, and ``pwm_slot`` is 1 while the pulse is on.

__all__ = ["COST", "INLINED", "Click", "Config", "Options", "State", "load", "sample", "scan"]


def control_output(config: Config, state: State, signals: list[float]) -> None:
    """The output in Auto, within its limits; what is no number is not written (D116)."""
    output = calculate_output(config, state)
    if not isnan(output):
        state.out = clamp(output, config.out_low, config.out_high)
    else:
        state.filtered_difference = 0.0
        if isnan(state.bias):
            state.bias = NAN
            state.error = BIAS_ERROR
            state.number = BIAS_NUMBER
            state.status |= PID_ERROR
            to_manual(state, OVERRIDE_ERROR + BIAS_ERROR)
            signals[config.error_slot] = state.number


def sample(config: Config, state: State, aux: list[float], signals: list[float]) -> None:
    """One calculation of a loop."""
    # Raw Process Variable (DFn+11) and PV Filter; D115: the first sample has no past
    raw = single(signals[config.in_slot])
    previous_pv = state.pv
    if state.pending & FIRST:
        state.pending &= ~FIRST
        previous_pv = raw
    pv = raw
    if config.filter_on:
        pv = single(previous_pv + single(config.filter * single(raw - previous_pv)))
    state.raw = raw
    state.pv = pv
    if state.pending & (REQUEST | GOAL):
        update_mode(config, state)
    # Setpoint Upper and Lower Limits; D126: an enabled limit overwrites the set point
    if config.sp_high_on and state.sp > config.sp_high:
        state.sp = config.sp_high
    if config.sp_low_on and state.sp < config.sp_low:
        state.sp = config.sp_low
    # PV Alarm, PV Deviation Alarm, PV Rate of Change: where one may come on or go off
    change = pv - previous_pv
    fast = config.rate_of_change
    if (
        pv < state.alarm_band_low
        or pv > state.alarm_band_high
        or state.sp != state.alarm_band_sp
        or change > fast
        or -change > fast
    ):
        renew_alarms(config, state, previous_pv)
        signals[config.sp_slot] = finite(state.sp, 0.0)
    if state.status & TUNING:
        tune(config, state, aux)
    # Control Output (DFn+08)
    if state.status & AUTO:
        control_output(config, state, signals)
    # D116: what is no number is shown as 0
    signals[config.pv_slot] = pv
    signals[config.out_slot] = finite(state.out, 0.0)
    signals[config.bias_slot] = finite(state.bias, 0.0)


def scan(tick: int, configs: list[Config], states: list[State], aux: list[float], signals: list[float]) -> None:
    """One pass at ``tick``: every loop that is due, and every discrete output."""
    for i in range(len(configs)):
        config = configs[i]
        state = states[i]
        due = state.due
        if tick >= due:
            due += state.period
            state.due = due if due > tick else tick + state.period
            sample(config, state, aux, signals)
        if config.pwm:
            signals[config.pwm_slot] = pulse(config, state, tick)


INLINED = (scan, sample, calculate_output)
"""The hot path of compiled code."""
COST = COSTS["click"]

# --- The C, DS and DF registers of a virtual CLICK --------------------------------------------------------------------

REQUESTS = {"manual_request": "manual", "auto_request": "auto", "autotune_request": "autotune"}
STATUS = {f"alarm_{name.removeprefix('pv_')}": bit for name, bit in ALARM_BITS.items()}
STATUS |= dict(zip(MODE_BITS, (MANUAL, AUTO), strict=True))
"""Bits that the PLC writes, by what they show."""


class ClickRegisters(Registers):
    """The blocks of all loops; requests are read as 0, since the PLC takes them at once."""

    def __init__(self, plc: Click) -> None:
        self.plc = plc
        self._rows: dict[int, tuple[int, Word]] = {}
        for i in range(len(plc.loops)):
            starts = plc.memory(i).starts
            for key, (prefix, table) in BLOCKS.items():
                start = SPACE.number(prefix, starts[key])
                self._rows |= {start + row.offset: (i, row) for row in table.words}

    def contents(self, loop: int, signals: Sequence[float]) -> Mapping[int, int]:
        """As the registers are after the last scan."""
        words, status = self.plc.memory(loop).words, self.plc.states[loop].status
        alarms = {name: int(bool(status & bit)) for name, bit in STATUS.items()}
        return self.contents_by_number(loop, defaultdict(int, words | alarms | dict.fromkeys(REQUESTS, 0)))

    def write(self, number: int, raw: int, signals: MutableSequence[float]) -> Done:
        """A setting, the output in Manual, or a request."""
        loop, row = self._rows[number]
        name = SPACE.name(number)
        if row.name in REQUESTS:
            return self._request(loop, row.name, raw)
        if row.path is None or row.path in FIXED:
            raise self.read_only(name, row)
        self.decode(name, row.codec.decode, raw)
        if late := self.plc.write(loop, [(row, raw)], signals):
            raise RegisterError(NOT_NOW, f"{name} {late}")
        return Done(f"set {row.path} to {SPACE.shown(number, raw)}")

    def _request(self, loop: int, name: str, raw: int) -> Done:
        """A request goes on; one for an autotune may go off again."""
        mode = REQUESTS[name]
        if raw:
            self.plc.request(loop, mode)
            return Done(f"request mode {mode}", mode)
        if name == "autotune_request":
            self.plc.autotune(loop, "cancel")
        return Done(f"request of mode {mode} off")
