"""The virtual EZLogix: its PID loops at one base step, and its registers and discretes as others see them."""

from __future__ import annotations

from collections.abc import Mapping, MutableSequence, Sequence
from math import sqrt

from pidcfg.encoders.maps.ezlogix import BLOCKS, MAP_SPACE
from pidcfg.encoders.regmap import Word
from pidcfg.sim.controllers.ezlogix.autotune import tune
from pidcfg.sim.controllers.ezlogix.equation import (
    AUTO,
    FRESH,
    FULL,
    HELD,
    MODES,
    PV_STALE,
    REQUEST,
    SATURATED,
    STOPPED,
    TUNE,
    TUNING,
    Config,
    State,
    calculate_cv,
    pulse,
    show_output,
    show_setpoint,
    show_signals,
)
from pidcfg.sim.controllers.ezlogix.operate import MODE_BITS
from pidcfg.sim.controllers.ezlogix.plc import Ezlogix, load
from pidcfg.sim.controllers.kernels import NEAREST, nearest
from pidcfg.sim.controllers.plc import TICKS
from pidcfg.sim.controllers.plc import NoOptions as Options
from pidcfg.sim.controllers.settings import NO_REGISTER, NOT_NOW, Done, RegisterError, Registers
from pidcfg.sim.costs import COSTS

# --- The virtual EZLogix: its PID loops at one base step --------------------------------------------------------------
#
# Design. `scan` is called at every base step; it calculates the loops that are due, in ascending order, and moves the
# control outputs, which work between samples too. `sample` is one calculation of one loop: PV, set point, error, then
# whatever rarely happens (`State.pending`: a mode, an autotune), equation, saturation, signals. Nothing here knows
# files, names or units: see `plc.load` for how registers become `Config` and `State`.
#
# Signals of a loop (slots in `Config`): ``in_slot`` is read, in engineering units; PV, SP, CV and BIAS (integral term
# and offset) are written in engineering units, ERROR, STATUS and COUNTDOWN as their registers hold them, O as 0 or 1.
# With the square root of the PV, SP is the PV that satisfies the set point, so that both can be compared.

__all__ = ["COST", "INLINED", "Config", "Ezlogix", "Options", "State", "load", "sample", "scan"]

ERROR_MOST = 32767.0
"""Base+11, the error, is a signed word that stays within this (D169)."""


def convert_pv(config: Config, value: float) -> float:
    """A measurement as whole counts; the converter saturates at the ends of its range (D670)."""
    pv = (value - config.pv_low) * config.pv_span / config.pv_width + config.pv_min
    if pv >= config.pv_max:
        return config.pv_max
    if pv > config.pv_min:
        return pv + NEAREST - NEAREST
    return config.pv_min


def switch_mode(state: State) -> None:
    """Discrete +0 as it was written; Manual keeps the CV, Auto begins with it."""
    state.pending &= ~REQUEST
    if state.wanted_mode & AUTO and state.status & AUTO == 0:
        state.pending |= FRESH
    state.status = (state.status & ~MODES) | state.wanted_mode


def limit_setpoint(i: int, configs: list[Config], states: list[State], signals: list[float]) -> None:
    """Limits write the register of the set point (D164), which may be an outer loop's CV too (D177)."""
    config = configs[i]
    state = states[i]
    if state.sp > config.sp_high:
        state.sp = config.sp_high
    if state.sp < config.sp_low:
        state.sp = config.sp_low
    outer = config.outer_loop
    if outer >= 0 and states[outer].out != state.sp:
        states[outer].out = state.sp
        show_output(configs[outer], states[outer], signals)


def sample(i: int, configs: list[Config], states: list[State], aux: list[float], signals: list[float]) -> None:
    """One calculation of loop ``i``."""
    config = configs[i]
    state = states[i]
    pending = state.pending
    if pending & PV_STALE == 0:
        state.pv = convert_pv(config, signals[config.in_slot])
    limit_setpoint(i, configs, states, signals)
    # Use PV Square Root; D163: the root is that of the register
    pv = state.pv
    if config.square_root:
        pv = sqrt(pv) if pv > 0.0 else 0.0
    # Controller Action: E = PV - SP for Direct Acting, SP - PV for Reverse Acting
    difference = pv - state.sp if config.direct else state.sp - pv
    pv *= config.scale
    error = difference * config.scale
    # Error, Base+11. D169: signed word saturates
    shown_error = error + NEAREST - NEAREST
    if shown_error > ERROR_MOST:
        shown_error = ERROR_MOST
    elif shown_error < -ERROR_MOST:
        shown_error = -ERROR_MOST
    state.error = shown_error
    # Deadband; D170: it acts in every term
    if -config.deadband < difference < config.deadband:
        error = 0.0

    if pending & REQUEST:
        switch_mode(state)
    if pending & TUNE:
        tune(config, state, aux, pv)
    # Position Algorithm: the derivative acts on E; Velocity Algorithm: on PV. D161: with E's sign
    derivative_input = pv
    if config.velocity == 0:
        derivative_input = error
    elif config.direct == 0:
        derivative_input = -pv
    if state.status & AUTO and state.pending & HELD == 0:
        calculate_cv(config, state, error, derivative_input)
    else:
        state.unlimited_cv = state.out
        state.derivative_input_1 = derivative_input
    # Saturation. D167: the bit tells of the CV as it is, anti-windup looks at the one before its limits
    if 0.0 < state.out < FULL:
        state.status &= ~SATURATED
    else:
        state.status |= SATURATED
    if config.inner_loop >= 0:
        states[config.inner_loop].sp = state.out
        show_setpoint(configs[config.inner_loop], states[config.inner_loop], signals)
    show_signals(config, state, signals)


def scan(tick: int, configs: list[Config], states: list[State], aux: list[float], signals: list[float]) -> None:
    """The PLC at ``tick``: every loop that is due, and every control output."""
    for i in range(len(configs)):
        state = states[i]
        due = state.due
        if tick >= due:
            due += state.period
            state.due = due if due > tick else tick + state.period
            sample(i, configs, states, aux, signals)
        if configs[i].cycle > 0 and state.pending & STOPPED == 0:
            pulse(tick, configs[i], state, signals)


INLINED = (scan, sample, limit_setpoint, calculate_cv, convert_pv, show_signals, show_setpoint, show_output, pulse)
"""The hot path of compiled code."""
COST = COSTS["ezlogix"]

# --- The registers and discretes of a virtual EZLogix, and the tags of PV and CV --------------------------------------

MODE_OF = {bool(bit & AUTO): name for name, bit in MODE_BITS.items()}
WORD = 0xFFFF


class EzlogixRegisters(Registers):
    """Both blocks of all loops; where tags of PV and CV have a register of their own, those too."""

    def __init__(self, plc: Ezlogix) -> None:
        self.plc = plc
        self._rows: dict[int, tuple[int, Word]] = {}
        self._tags: dict[int, tuple[int, str]] = {}
        self._started = [False] * len(plc.loops)
        """Discrete +4 as it was written."""
        for i in range(len(plc.loops)):
            dialog = plc.memory(i).dialog
            for key, (prefix, table) in BLOCKS.items():
                start = MAP_SPACE.number(prefix, getattr(dialog, key))
                self._rows |= {start + row.offset: (i, row) for row in table.words}
        for i in range(len(plc.loops)):
            dialog = plc.memory(i).dialog
            for tag, what in ((dialog.pv.tag, "pv"), (dialog.output.tag, "cv")):
                number = MAP_SPACE.parse(tag)
                if number is not None and number not in self._rows:
                    self._tags.setdefault(number, (i, what))

    def places(self) -> dict[int, int]:
        """The two blocks of each loop, and its tags."""
        return super().places() | {number: loop for number, (loop, _) in self._tags.items()}

    def contents(self, loop: int, signals: Sequence[float]) -> Mapping[int, int]:
        """As the registers are after the last calculation."""
        memory, state = self.plc.memory(loop), self.plc.states[loop]
        held = {row.name: memory.word(row.name) for row in BLOCKS["registers"][1].words}
        held |= {row.name: memory.bit(row.name) for row in BLOCKS["discretes"][1].words}
        held |= {
            "error": int(nearest(state.error)) & WORD,
            "autotune_status": state.tune_status,
            "autotune_timeout": state.tune_countdown // TICKS,
            "mode": int(bool((state.wanted_mode if state.pending & REQUEST else state.status) & AUTO)),
            "saturation": int(bool(state.status & SATURATED)),
            "start_autotune": int(self._started[loop] or bool(state.status & TUNING)),
        }
        tags = {"pv": int(nearest(state.pv)) & WORD, "cv": int(nearest(state.out)) & WORD}
        contents = self.contents_by_number(loop, held)
        return contents | {number: tags[what] for number, (i, what) in self._tags.items() if i == loop}

    def write(self, number: int, raw: int, signals: MutableSequence[float]) -> Done:
        """A setting, the mode, the start of an autotune, or the CV in Manual."""
        name = MAP_SPACE.name(number)
        if number in self._tags:
            return self._write_tag(number, raw, signals)
        loop, row = self._rows[number]
        if row.access in {"status", "reserved"}:
            raise self.read_only(name, row)
        if row.name == "mode":
            mode = MODE_OF[bool(raw)]
            self.plc.request(loop, mode)
            return Done(f"request mode {mode}", mode)
        if row.name == "start_autotune":
            return self._start(loop, is_on=bool(raw))
        late = self.plc.write(loop, row, raw, signals)
        return Done.setting(row.path, MAP_SPACE.shown(number, raw), late)

    def _start(self, loop: int, *, is_on: bool) -> Done:
        """Discrete +4, of which only the changes count."""
        was = self._started[loop] or bool(self.plc.states[loop].status & TUNING)
        self._started[loop] = is_on
        if is_on == was:
            return Done(f"start of an autotune stays {'on' if is_on else 'off'}")
        self.plc.autotune(loop, "start" if is_on else "cancel")
        return Done("autotune start" if is_on else "autotune off")

    def _write_tag(self, number: int, raw: int, signals: MutableSequence[float]) -> Done:
        loop, what = self._tags[number]
        name = MAP_SPACE.name(number)
        if what == "pv":
            raise RegisterError(NO_REGISTER, f"{name} is the measurement, which the plant writes")
        if late := self.plc.write_output(loop, raw, signals):
            raise RegisterError(NOT_NOW, f"{name}: {late}")
        return Done(f"set output to {raw} counts")
