"""One cycle of the task and the blocks other than PID: filters, delays, pulses, selectors; the registers by name."""

from __future__ import annotations

from collections.abc import Mapping, MutableSequence, Sequence
from typing import Any

from pidcfg.encoders.maps.nextopid import MAX_DELAY_SAMPLES
from pidcfg.encoders.parameters import Content, Parameter, content_text, raw_of, register_content
from pidcfg.schemas.iec import IecType, Wire, time_text
from pidcfg.sim.controllers.kernels import clamp, finite_or, round_half_even, single
from pidcfg.sim.controllers.nextopid import terms
from pidcfg.sim.controllers.nextopid.equation import call_pid
from pidcfg.sim.controllers.nextopid.memory import execute_moves, number_of, read_wires, value_of
from pidcfg.sim.controllers.nextopid.plc import Nextopid, keep_results, load, write_commands
from pidcfg.sim.controllers.nextopid.terms import (
    AUTO_MODE,
    BAD_DEAD_BAND,
    BAD_PV_LIMITS,
    ERROR_BASE,
    MANUAL_MODE,
    MODES,
    OFFSETS,
    Config,
    State,
    lag_share,
)
from pidcfg.sim.controllers.plc import NoOptions as Options
from pidcfg.sim.controllers.settings import NO_LOOP, NO_REGISTER, RegisterError, Registers, WriteResult
from pidcfg.sim.costs import COSTS

# --- ControlLowFilter, ControlLag and ControlLeadLag: exact first-order steps, every result in single precision -------
#
# A first call has no time before it: it shows where the block starts (D237). At a limit a lag goes on from it (D238);
# a result that is no number is not written (D247). D numbers: see `nextopid.BLOCK_DECISIONS`.

_FILTER = OFFSETS["ControlLowFilter"]
_LAG = OFFSETS["ControlLag"]
_LEAD_LAG = OFFSETS["ControlLeadLag"]

_F_IN, _F_TC = _FILTER["InVar"], _FILTER["Tc"]
_F_OUT, _F_ERROR, _F_TS = _FILTER["OutVar"], _FILTER["Error"], _FILTER["SampleTime"]

_LAG_IN, _GS, _OFFSET, _TC = _LAG["InVar"], _LAG["Gs"], _LAG["Offset"], _LAG["Tc"]
_LAG_INIT, _LAG_LOW, _LAG_HIGH = _LAG["Init_OutVar"], _LAG["Min_OutVar"], _LAG["Max_OutVar"]
_LAG_OUT, _FILTER_ERROR, _FILTER_TS = _LAG["OutVar"], _LAG["Error"], _LAG["SampleTime"]

_LL_IN, _LL_G, _LL_LEAD, _LL_LAG = _LEAD_LAG["InVar"], _LEAD_LAG["G"], _LEAD_LAG["Tlead"], _LEAD_LAG["Tlag"]
_LL_LOW, _LL_HIGH, _LL_DISABLE = _LEAD_LAG["Min_OutVar"], _LEAD_LAG["Max_OutVar"], _LEAD_LAG["Disable"]
_LL_OUT, _LL_ERROR, _LL_TS = _LEAD_LAG["OutVar"], _LEAD_LAG["Error"], _LEAD_LAG["SampleTime"]


def sample_share(config: Config, state: State, time_constant: float) -> float:
    """The share of the way of one sample, worked out again when the time constant has changed (kernel, D236)."""
    quotient = single(config.sample_time / time_constant)
    if quotient != state.lag_quotient:
        state.lag_quotient = quotient
        state.lag_share = single(lag_share(quotient))
    return state.lag_share


def approach_target(start: float, target: float, share: float) -> float:
    """From ``start`` a share of the way to ``target`` (kernel)."""
    return single(start + single(single(target - start) * share))


def low_filter(config: Config, state: State, signals: MutableSequence[float]) -> None:
    """One call of ControlLowFilter (kernel)."""
    base = config.base
    time_constant = signals[base + _F_TC]
    signals[base + _F_TS] = config.sample_time
    if not time_constant > 0.0:
        signals[base + _F_ERROR] = 1.0
        return
    signals[base + _F_ERROR] = 0.0
    in_var = signals[base + _F_IN]
    if state.started == 0:
        state.started = 1
        state.lag_output = in_var
    state.lag_output = finite_or(
        approach_target(state.lag_output, in_var, sample_share(config, state, time_constant)), state.lag_output
    )
    signals[base + _F_OUT] = state.lag_output


def lag_fault(base: int, signals: Sequence[float]) -> bool:
    """Whether a lag's parameters stop it, crossed limits among them (kernel).

    ``base``: where ControlLag's parameters would begin.
    """
    return not (
        signals[base + _TC] > 0.0 and signals[base + _LAG_LOW] <= signals[base + _LAG_INIT] <= signals[base + _LAG_HIGH]
    )


def step_lag(config: Config, state: State, in_var: float, base: int, signals: MutableSequence[float]) -> None:
    """The output of a lag with the input ``in_var`` (kernel)."""
    if state.started == 0:
        state.started = 1
        state.lag_output = signals[base + _LAG_INIT]
    else:
        target = single(single(signals[base + _GS] * in_var) + signals[base + _OFFSET])
        lagged = approach_target(state.lag_output, target, sample_share(config, state, signals[base + _TC]))
        state.lag_output = finite_or(
            clamp(lagged, signals[base + _LAG_LOW], signals[base + _LAG_HIGH]), state.lag_output
        )
    signals[base + _LAG_OUT] = state.lag_output


def call_lag(config: Config, state: State, signals: MutableSequence[float]) -> None:
    """One call of ControlLag (kernel)."""
    base = config.base
    signals[base + _FILTER_TS] = config.sample_time
    if lag_fault(base, signals):
        signals[base + _FILTER_ERROR] = 1.0
        return
    signals[base + _FILTER_ERROR] = 0.0
    step_lag(config, state, signals[base + _LAG_IN], base, signals)


def lead_lag(config: Config, state: State, signals: MutableSequence[float]) -> None:
    """One call of ControlLeadLag: the output comes from the lagged input as it was before this call (kernel, D243)."""
    base = config.base
    lead = signals[base + _LL_LEAD]
    lag_time = signals[base + _LL_LAG]
    signals[base + _LL_TS] = config.sample_time
    if not (lead >= 0.0 and lag_time > 0.0):
        signals[base + _LL_ERROR] = 1.0
        return
    signals[base + _LL_ERROR] = 0.0
    in_var = signals[base + _LL_IN]
    if state.started == 0:
        state.started = 1
        state.lag_output = in_var
    if signals[base + _LL_DISABLE] != 0.0:
        signals[base + _LL_OUT] = 0.0
    else:
        led_input = single(state.lag_output + single(single(lead / lag_time) * single(in_var - state.lag_output)))
        out = clamp(single(signals[base + _LL_G] * led_input), signals[base + _LL_LOW], signals[base + _LL_HIGH])
        signals[base + _LL_OUT] = finite_or(out, signals[base + _LL_OUT])
    state.lag_output = finite_or(
        approach_target(state.lag_output, in_var, sample_share(config, state, lag_time)), state.lag_output
    )


# --- ControlDelay and ControlDelayLag: the input of so many samples ago -----------------------------------------------
#
# The line lies in the shared vector from ``config.buffer`` on and is as long as the delay; the oldest value is at
# ``state.position``. It starts full of InitDelayedVar, and a delay of another length starts full of what the last one
# gave, so that the output stands for the new delay (D240). A delay is rounded to samples (D239).

_DELAY = OFFSETS["ControlDelay"]
_DELAY_LAG = OFFSETS["ControlDelayLag"]
_DELAY_IN, _TIME, _DELAY_INIT = _DELAY["InVar"], _DELAY["DelayTime"], _DELAY["InitDelayedVar"]
"""ControlDelayLag has them at the same places."""
_DELAY_OUT, _DELAY_ERROR, _DELAY_TS = _DELAY["OutVar"], _DELAY["Error"], _DELAY["SampleTime"]
_LAG_ERROR, _LAG_TS = _DELAY_LAG["Error"], _DELAY_LAG["SampleTime"]
LAG_OFFSET = _DELAY_LAG["Gs"] - OFFSETS["ControlLag"]["Gs"]
"""How far the rest of ControlDelayLag's parameters is behind ControlLag's."""

ROUNDING_SHARE = 1.0 - 2.0**-22
"""A delay that exceeds the longest one by less than single precision can tell does not exceed it."""


def delay_fault(config: Config, time: float) -> bool:
    """Whether a delay is negative or longer than the line (kernel, D239)."""
    return not (time >= 0.0 and time * ROUNDING_SHARE <= MAX_DELAY_SAMPLES * config.sample_time)


def begin_line(config: Config, state: State, aux: MutableSequence[float], samples: int, value: float) -> None:
    """A line of this length, full of one value (kernel)."""
    state.samples = samples
    state.position = 0
    state.delayed_value = value
    for i in range(samples):
        aux[config.buffer + i] = value


def delay_input(config: Config, state: State, aux: MutableSequence[float], signals: MutableSequence[float]) -> float:
    """What InVar was a DelayTime ago (kernel)."""
    base = config.base
    in_var = signals[base + _DELAY_IN]
    samples = int(round_half_even(single(signals[base + _TIME] / config.sample_time)))
    if state.started == 0:
        begin_line(config, state, aux, samples, signals[base + _DELAY_INIT])
    elif samples != state.samples:
        begin_line(config, state, aux, samples, state.delayed_value)
    if samples == 0:
        state.delayed_value = in_var
        return in_var
    oldest = config.buffer + state.position
    state.delayed_value = aux[oldest]
    aux[oldest] = in_var
    state.position += 1
    if state.position == samples:
        state.position = 0
    return state.delayed_value


def call_delay(config: Config, state: State, aux: MutableSequence[float], signals: MutableSequence[float]) -> None:
    """One call of ControlDelay (kernel)."""
    base = config.base
    signals[base + _DELAY_TS] = config.sample_time
    if delay_fault(config, signals[base + _TIME]):
        signals[base + _DELAY_ERROR] = 1.0
        return
    signals[base + _DELAY_ERROR] = 0.0
    signals[base + _DELAY_OUT] = delay_input(config, state, aux, signals)
    state.started = 1


def delay_lag(config: Config, state: State, aux: MutableSequence[float], signals: MutableSequence[float]) -> None:
    """One call of ControlDelayLag: the delay first, then the lag (kernel)."""
    base = config.base
    signals[base + _LAG_TS] = config.sample_time
    if delay_fault(config, signals[base + _TIME]) or lag_fault(base + LAG_OFFSET, signals):
        signals[base + _LAG_ERROR] = 1.0
        return
    signals[base + _LAG_ERROR] = 0.0
    step_lag(config, state, delay_input(config, state, aux, signals), base + LAG_OFFSET, signals)


# --- ControlON_OFF: the output switches where the error leaves the dead band (D244) -----------------------------------
#
# With an error bit the block is not executed, and its other outputs stay (D235). `State.status` has its two error
# bits where it has those of the PID blocks, so that each is reported under its own name.

_ON_OFF = OFFSETS["ControlON_OFF"]
_SP, _PV, _BAND, _ON_OFF_HIGH, _ON_OFF_LOW = (_ON_OFF[name] for name in ("SP", "PV", "DeadBand", "MaxPV", "MinPV"))
_DIRECT, _MANUAL, _MANUAL_MV, _ON_OFF_MV = (_ON_OFF[name] for name in ("Direct", "Manual", "ManualMV", "MV"))
_ERR_PV_LIMITS, _ERR_DEAD_BAND = _ON_OFF["ErrBits.MaxMinPV"], _ON_OFF["ErrBits.DeadBand"]
_WARN_BITS = _ON_OFF["WarnBits.PV_MaxPV"]
"""The first of four, in the order of the table, which is that of the PID blocks."""
WARNING_COUNT = 4
PV_HIGH, PV_LOW, SP_HIGH, SP_LOW = 1, 2, 4, 8


def write_bits(first: int, count: int, bits: int, signals: MutableSequence[float]) -> None:
    """A set of bits as BOOLs, one after the other (kernel)."""
    for i in range(count):
        signals[first + i] = float((bits >> i) & 1)


def limit_inputs(config: Config, state: State, signals: MutableSequence[float]) -> None:
    """PV and SP within MinPV and MaxPV, and the warnings that tell so (kernel)."""
    base = config.base
    high = signals[base + _ON_OFF_HIGH]
    low = signals[base + _ON_OFF_LOW]
    state.pv = signals[base + _PV]
    state.sp = signals[base + _SP]
    warnings = 0
    if state.pv > high:
        state.pv = high
        warnings = PV_HIGH
    elif state.pv < low:
        state.pv = low
        warnings = PV_LOW
    if state.sp > high:
        state.sp = high
        warnings |= SP_HIGH
    elif state.sp < low:
        state.sp = low
        warnings |= SP_LOW
    if warnings != state.aux_status:
        state.aux_status = warnings
        write_bits(base + _WARN_BITS, WARNING_COUNT, warnings, signals)


def on_off(config: Config, state: State, signals: MutableSequence[float]) -> None:
    """One call of ControlON_OFF (kernel)."""
    base = config.base
    band = signals[base + _BAND]
    errors = 0
    if not signals[base + _ON_OFF_HIGH] > signals[base + _ON_OFF_LOW]:
        errors |= BAD_PV_LIMITS
    if not band >= 0.0:
        errors |= BAD_DEAD_BAND
    if errors != state.status // ERROR_BASE:
        state.status = (state.status & MODES) | errors * ERROR_BASE
        signals[base + _ERR_PV_LIMITS] = 1.0 if errors & BAD_PV_LIMITS else 0.0
        signals[base + _ERR_DEAD_BAND] = 1.0 if errors & BAD_DEAD_BAND else 0.0
    if errors != 0:
        return
    limit_inputs(config, state, signals)
    state.status = MANUAL_MODE if signals[base + _MANUAL] != 0.0 else AUTO_MODE
    state.previous_error = single(state.sp - state.pv)
    if state.status == MANUAL_MODE:
        signals[base + _ON_OFF_MV] = 1.0 if signals[base + _MANUAL_MV] != 0.0 else 0.0
    elif state.previous_error > band or state.previous_error < -band:
        above = state.previous_error > 0.0
        signals[base + _ON_OFF_MV] = 1.0 if above == (signals[base + _DIRECT] == 0.0) else 0.0
    state.out = signals[base + _ON_OFF_MV]


# --- ControlPWM: the share of a period's cycles in which the output is on ---------------------------------------------
#
# The on-cycles come first in a period, as many as MV is where the period begins, rounded (D241, D242).

_PWM = OFFSETS["ControlPWM"]
_PWM_MV, _PWM_HIGH, _PWM_LOW, _PERIOD = _PWM["MV"], _PWM["MaxMV"], _PWM["MinMV"], _PWM["Period"]
_PWM_OUT, _PWM_ERROR, _WARNING = _PWM["PWM"], _PWM["Error"], _PWM["Warning"]


def call_pwm(config: Config, state: State, signals: MutableSequence[float]) -> None:
    """One call of ControlPWM (kernel)."""
    base = config.base
    low = signals[base + _PWM_LOW]
    high = signals[base + _PWM_HIGH]
    period = signals[base + _PERIOD]
    if not (high > low and period >= 1.0):
        signals[base + _PWM_ERROR] = 1.0
        return
    signals[base + _PWM_ERROR] = 0.0
    mv = signals[base + _PWM_MV]
    limited = clamp(mv, low, high)
    signals[base + _WARNING] = 1.0 if limited != mv else 0.0
    if state.position == 0:
        on = round_half_even(single(single(single(limited - low) / single(high - low)) * period))
        state.samples = int(period)
        state.on_cycles = int(on) if on > 0.0 else 0
    signals[base + _PWM_OUT] = 1.0 if state.position < state.on_cycles else 0.0
    state.position += 1
    if state.position >= state.samples:
        state.position = 0


# --- ControlSelectMax, ControlSelectMin and ControlSplitRange: functions, which keep nothing from call to call --------
#
# Of two equal outputs MV2 is selected (D245); a range is split at SPLIT (D246). D numbers: `nextopid.BLOCK_DECISIONS`.

_SELECT = OFFSETS["ControlSelectMax"]
"""ControlSelectMin has the same places."""
_MV1, _MV2, _SELECT_MV = _SELECT["MV1"], _SELECT["MV2"], _SELECT["MV"]
_OVERR1, _OVERR2 = _SELECT["OVERR1"], _SELECT["OVERR2"]
_SPLIT = OFFSETS["ControlSplitRange"]
_SPLIT_IN, _POINT, _MODE = _SPLIT["MV"], _SPLIT["SPLIT"], _SPLIT["Mode"]
_OUT1, _OUT2, _SPLIT_ERROR = _SPLIT["MV1"], _SPLIT["MV2"], _SPLIT["Error"]
FULL_RANGE = 100.0


def select_input(config: Config, takes_first: bool, signals: MutableSequence[float]) -> None:  # noqa: FBT001 - a kernel
    """Takes one of the two and tells the other one that it is overridden (kernel)."""
    base = config.base
    signals[base + _SELECT_MV] = signals[base + (_MV1 if takes_first else _MV2)]
    signals[base + _OVERR1] = 0.0 if takes_first else 1.0
    signals[base + _OVERR2] = 1.0 if takes_first else 0.0


def select_max(config: Config, signals: MutableSequence[float]) -> None:
    """One call of ControlSelectMax (kernel)."""
    select_input(config, signals[config.base + _MV1] > signals[config.base + _MV2], signals)


def select_min(config: Config, signals: MutableSequence[float]) -> None:
    """One call of ControlSelectMin (kernel)."""
    select_input(config, signals[config.base + _MV1] < signals[config.base + _MV2], signals)


def split_range(config: Config, signals: MutableSequence[float]) -> None:
    """One call of ControlSplitRange (kernel)."""
    base = config.base
    mv = signals[base + _SPLIT_IN]
    point = signals[base + _POINT]
    mode = signals[base + _MODE]
    if not (1.0 <= mode <= 4.0 and 0.0 <= mv <= FULL_RANGE and 0.0 < point < FULL_RANGE):
        signals[base + _SPLIT_ERROR] = 1.0
        signals[base + _OUT1] = 0.0
        signals[base + _OUT2] = 0.0
        return
    signals[base + _SPLIT_ERROR] = 0.0
    lower = FULL_RANGE
    upper = 0.0
    if mv < point:
        lower = single(single(mv / point) * FULL_RANGE)
    else:
        upper = single(single(single(mv - point) / single(FULL_RANGE - point)) * FULL_RANGE)
    signals[base + _OUT1] = single(FULL_RANGE - lower) if mode == 4.0 else lower
    if mode == 1.0:
        signals[base + _OUT2] = single(FULL_RANGE - lower)
    else:
        signals[base + _OUT2] = single(FULL_RANGE - upper) if mode == 3.0 else upper


# --- The virtual NextoPID: one cycle of the task ----------------------------------------------------------------------
#
# Design. `scan` is called at every base step; it calls the blocks that are due, in the order of execution, each after
# its wires have been renewed; what the program around assigns is new in every cycle (D694). The PID blocks stand
# in `equation` and `autotune`. Nothing here knows files or names: see `memory` for how a program becomes `Config` and
# `State`.

__all__ = ["COST", "INLINED", "Config", "Nextopid", "Options", "State", "call_block", "load", "scan"]


def call_block(config: Config, state: State, aux: list[float], signals: list[float]) -> None:
    """One call of a block (kernel)."""
    kind = config.kind
    if kind <= terms.PIDA_TUNE_INT:
        call_pid(config, state, signals)
        signals[config.sp_slot] = state.sp
        if kind >= terms.PIDA_TUNE_REAL:
            keep_results(config, state, signals)
    elif kind == terms.LEAD_LAG:
        lead_lag(config, state, signals)
    elif kind == terms.DELAY:
        call_delay(config, state, aux, signals)
    elif kind == terms.DELAY_LAG:
        delay_lag(config, state, aux, signals)
    elif kind == terms.LAG:
        call_lag(config, state, signals)
    elif kind == terms.LOW_FILTER:
        low_filter(config, state, signals)
    else:
        call_switch(config, state, signals)


def call_switch(config: Config, state: State, signals: list[float]) -> None:
    """One call of a block that switches or selects (kernel)."""
    kind = config.kind
    if kind == terms.ON_OFF:
        on_off(config, state, signals)
        signals[config.sp_slot] = state.sp
    elif kind == terms.PWM:
        call_pwm(config, state, signals)
    elif kind == terms.SELECT_MIN:
        select_min(config, signals)
    elif kind == terms.SELECT_MAX:
        select_max(config, signals)
    else:
        split_range(config, signals)


def scan(tick: int, configs: list[Config], states: list[State], aux: list[float], signals: list[float]) -> None:
    """The task at ``tick``: the operator's commands, what the program around assigns, moves, calls in turn, moves."""
    count = len(configs)
    for i in range(count):
        if states[i].command != 0:
            write_commands(configs[i], states[i], signals)
        if configs[i].early_wires > 0:
            read_wires(configs[i], states[i], aux, signals, configs[i].wires_begin + configs[i].early_wires)
    if count > 0 and configs[0].moves_begin < configs[0].early_moves_end:
        execute_moves(states[0], tick, aux, signals, configs[0].moves_begin, configs[0].early_moves_end)
    for position in range(count):
        block = configs[position].call_order
        config = configs[block]
        state = states[block]
        if tick >= state.due:
            state.due = tick + state.period
            if config.wires_begin < config.wires_end:
                read_wires(config, state, aux, signals, config.wires_end)
            if state.fault != 0 and state.fault_at < 0:
                state.fault_at = tick
            call_block(config, state, aux, signals)
            if config.error_slot >= 0 and signals[config.error_slot] != 0.0:
                state.has_erred = 1
    if count > 0 and configs[0].early_moves_end < configs[0].moves_end:
        execute_moves(states[0], tick, aux, signals, configs[0].early_moves_end, configs[0].moves_end)


INLINED = (scan, read_wires, value_of)
"""The hot path of compiled code."""
COST = COSTS["nextopid"]

# --- The parameters and signals of a virtual NextoPID program by name, as a map puts them into registers --------------


class NextopidRegisters(Registers):
    """Signals, and every parameter of every instance; a function has none."""

    def __init__(self, plc: Nextopid) -> None:
        self.plc = plc
        rows = {name: Parameter(name, kind) for name, kind in plc.layout.signals.items()}
        for instance in plc.layout.instances:
            if not instance.kind.function:
                rows |= {f"{instance.name}.{row.name}": row for row in instance.kind.table.rows}
        loops = {loop: i for i, loop in enumerate(plc.loops)}
        self._rows = {name: (loops.get(name.partition(".")[0], NO_LOOP), row) for name, row in rows.items()}
        copied = {copy.target for copy in plc.copies if copy.when is None}
        numbers = plc.layout.numbers
        self._program_written = {
            name for name in rows if isinstance(plc.words.get(name), Wire) or numbers[name] in copied
        }
        """What the program writes in every cycle."""

    def contents(self, loop: int, signals: Sequence[float]) -> Mapping[Any, int]:
        """As they are after the last cycle."""
        numbers = self.plc.layout.numbers
        return {
            name: raw_of(row.type, content_of_number(row.type, signals[numbers[name]]))
            for name, (owner, row) in self._rows.items()
            if owner == loop
        }

    def write(self, number: Any, raw: int, signals: MutableSequence[float]) -> WriteResult:
        """A signal from outside, or an input that the program does not write."""
        loop, row = self._rows[number]
        owner, _, name = number.partition(".")
        if row.access == "output":
            raise RegisterError(NO_REGISTER, f"{number} is an output, which the block writes")
        if number in self._program_written:
            raise RegisterError(NO_REGISTER, f"{number} is written by the program")
        if name:
            row = self.find_parameter(self.plc.keys[owner], number, name)
        content = self.decode(number, register_content, row.type, raw)
        if loop == NO_LOOP or not name:
            signals[self.plc.inputs.get(number, self.plc.layout.numbers[number])] = number_of(row.type, content)
            return WriteResult.setting(number, content_text(row.type, content), None)
        before = self.plc.intended_mode(loop, signals)
        late = self.plc.set(loop, (row.name,), content, signals)
        mode = self.plc.intended_mode(loop, signals)
        return WriteResult.setting(number, content_text(row.type, content), late, mode if mode != before else None)


def content_of_number(kind: IecType, value: float) -> Content:
    """What the kernels have as a content: the inverse of `number_of`."""
    if kind.kind == "bool":
        return value != 0.0
    if kind.kind == "time":
        return time_text(round(value * 1000))
    if kind.kind == "word":
        return kind.words[int(value)]
    return finite_or(value, 0.0) if kind.kind == "real" else int(value)
