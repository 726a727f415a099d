"""The virtual EZLogix: built from registers, discretes and dialog, operated, and what is done at one base step."""

from __future__ import annotations

from collections.abc import Callable, Mapping, MutableSequence, Sequence
from dataclasses import dataclass
from decimal import Decimal
from math import sqrt
from typing import TYPE_CHECKING, Any, cast

from pidcfg.encoders.codecs import Position, Scale
from pidcfg.encoders.ezlogix.image import scales_of
from pidcfg.encoders.image import Image, read_settings
from pidcfg.encoders.maps.ezlogix import BLOCKS, CODES, MAP_SPACE, MIN_SAMPLE_COUNTS, R_BLOCK, S_BLOCK, SPACE
from pidcfg.encoders.regmap import RegisterMap, Word
from pidcfg.schemas.base import Quantity, parse_off_seconds, parse_quantity, parse_seconds, parse_whole_seconds
from pidcfg.schemas.ezlogix import CV_FULL, LIMITS, TAG, LoopSettings
from pidcfg.schemas.numbers import parse_number
from pidcfg.sim.controllers.autotune import POINTS
from pidcfg.sim.controllers.ezlogix import equation as bits
from pidcfg.sim.controllers.ezlogix.equation import (
    AUTO,
    CV_HELD,
    FULL_CV,
    MODES,
    NO_PAST,
    PV_STALE,
    REQUEST,
    SATURATED,
    STOPPED,
    TUNE,
    TUNING,
    Config,
    State,
    calculate_cv,
    calculate_gains,
    run_autotune,
    set_pulse,
    show_output,
    show_setpoint,
    show_signals,
)
from pidcfg.sim.controllers.kernels import NEVER, ROUNDING_MAGIC, clamp, leave_notice, read_registers, round_half_even
from pidcfg.sim.controllers.plc import SWITCH_AND_TUNE, TICKS, CountsPlc, low_and_width
from pidcfg.sim.controllers.plc import NoOptions as Options
from pidcfg.sim.controllers.settings import (
    NO_REGISTER,
    NOT_NOW,
    Keys,
    RegisterError,
    Registers,
    WriteResult,
    items_of,
    rows_of,
)
from pidcfg.sim.costs import COSTS

if TYPE_CHECKING:
    from pidcfg.sim.judgement.report import TuneReport

# --- How an EZLogix loop is reported: names of modes and flags as bits, and notices in words --------------------------

MODE_BITS = {"manual": bits.MANUAL, "auto": bits.AUTO}
SIGNALS = {
    "in_slot": "",
    "pv_slot": "PV",
    "sp_slot": "SP",
    "out_slot": "CV",
    "bias_slot": "BIAS",
    "error_slot": "ERROR",
    "status_slot": "STATUS",
    "pulse_slot": "O",
    "countdown_slot": "COUNTDOWN",
}
"""Signals of a loop by their slots in `Config`; the measurement itself belongs to the plant."""
FLAG_BITS = {"saturation": bits.SATURATED, "autotune_running": bits.TUNING, "autotune_error": bits.TUNE_ERROR}

WAITS_FOR_RATE = 1
WAITS_FOR_RUN = 2
IS_STOPPED = 3
PV_IS_STALE = 4
OUTPUT_IS_CUT = 5
TUNE_RUNS = 6

TUNE_STATUS = {code.number: code.title for code in CODES}
"""The manual's table of Base+12 in words."""
REASONS = {
    **{bits.REASON_BASE + n: f"autotune: {title} (status {n})" for n, title in TUNE_STATUS.items()},
    WAITS_FOR_RATE: "waits: the loop is not calculated, its sample rate is below 0.05 s",
    WAITS_FOR_RUN: "waits: the PLC is stopped and the loop is not calculated",
    IS_STOPPED: "the PLC is stopped: the loop is not calculated, its outputs stay as they are",
    PV_IS_STALE: "the PLC is stopped: the loop goes on, but nothing renews its PV in an R register",
    OUTPUT_IS_CUT: "the PLC is stopped: the loop goes on, but nothing carries its CV from an R register to an output",
    TUNE_RUNS: "autotune is running already",
    bits.FAR_FROM_SP: "the autotune begins with the PV more than 10 % of its span from the set point (D622)",
    bits.PLC_STOPPED: "autotune cancelled: the PLC was stopped (status 4)",
    bits.RATE_WRITTEN: "autotune: the sample rate was changed (status 6, D695)",
    bits.PV_MOVING: "the PV was moving when the autotune began: do not trust its gains (D623)",
}

# --- What a scenario's ``set`` may write in a running loop, by the keys of its configuration --------------------------
#
# Short forms: ``setpoint`` and ``output`` with a number. What the dialog alone holds (action, algorithm, tags) is no
# register and cannot be set.

CV = Word(-1, "cv", "output.value", Position("output"), "output", "Control Variable", "-", LIMITS)
"""The CV stands in its tag, outside the block."""

EVENT_KEYS = {"mode": "mode", "autotune": "autotune"}
PARSERS: Mapping[str, Callable[[object], object]] = {
    "sample_rate": parse_seconds,
    "tuning.proportional_gain": parse_number,
    "tuning.integral_time": parse_off_seconds,
    "tuning.derivative_time": parse_off_seconds,
    "autotune.timeout": parse_whole_seconds,
    "output.pulse.cycle_time": parse_seconds,
    "output.pulse.min_on": parse_seconds,
    "output.pulse.min_off": parse_seconds,
}
KEYS = Keys(
    {**rows_of((R_BLOCK, S_BLOCK), EVENT_KEYS), str(CV.path): CV},
    {"setpoint": "setpoint.value", "output": str(CV.path)},
    EVENT_KEYS,
    PARSERS,
    lambda _word: parse_quantity,
)


# --- From the registers and discretes of a loop, and its dialog, to the numbers that the controller calculates with ---

UNKNOWN_PERIOD = 50_000
"""Ticks that stand for the sample rate of a loop that is not calculated."""


@dataclass(slots=True)
class Loop:
    """A loop's registers and discretes, and what its dialog alone holds."""

    dialog: LoopSettings
    registers: list[int]
    discretes: list[int]

    def word(self, name: str) -> int:
        """The raw content of a register."""
        return self.registers[R_BLOCK.offset_of(name)]

    def bit(self, name: str) -> int:
        """The state of a discrete."""
        return int(self.discretes[S_BLOCK.offset_of(name)] != 0)

    def values(self) -> dict[str, Any]:
        """What registers and discretes hold, in counts, and what the dialog says, by name."""
        discretes = {row.name: self.bit(row.name) for row in S_BLOCK.words}
        choices = {"action": self.dialog.action, "algorithm": self.dialog.algorithm}
        return {row.name: self.word(row.name) for row in R_BLOCK.words} | discretes | choices

    def quantity(self, name: str) -> Decimal:
        """What a register holds, in its unit: a gain, or a time in seconds."""
        value: Decimal = R_BLOCK.find_word(name).decode(self.word(name))
        return value

    def scales(self) -> dict[str, Scale]:
        """The scales of the loop's registers in engineering units."""
        return scales_of(self.dialog.pv, self.dialog.output, root=bool(self.bit("square_root")))

    def write(self, row: str, raw: int) -> None:
        """The raw content of a register or a discrete."""
        block, table = (self.registers, R_BLOCK) if row in REGISTER_NAMES else (self.discretes, S_BLOCK)
        block[table.offset_of(row)] = raw


REGISTER_NAMES = frozenset(word.name for word in R_BLOCK.words if word.access != "reserved")


def block_of(words: Mapping[int, int], prefix: str, first: int, table: RegisterMap) -> list[int]:
    """A block of registers; what lies beyond the end of its bank counts as 0."""
    bank = next(bank for bank in SPACE.banks if bank.prefix == prefix)
    start = SPACE.number_of(prefix, first)
    return [words.get(start + k, 0) if first + k <= bank.last else 0 for k in range(table.size)]


def loop_of(words: Mapping[int, int], dialog: LoopSettings) -> Loop:
    """A loop from the memory."""
    blocks = {key: block_of(words, prefix, getattr(dialog, key), table) for key, (prefix, table) in BLOCKS.items()}
    return Loop(dialog, blocks["registers"], blocks["discretes"])


def ticks(seconds: Any) -> int:
    """Seconds as ticks."""
    return int(seconds * TICKS)


def configure_loop(config: Config, loop: Loop, *, runs_when_stopped: bool) -> None:
    """A loop's `Config`; values beyond the manual's ranges are taken as they are (D171)."""
    dialog = loop.dialog
    read_registers(config, loop.values())
    low, high = dialog.pv.counts or (0, CV_FULL)
    config.pv_min, config.pv_max, config.pv_span = float(low), float(high), float(high - low)
    config.pv_low, config.pv_width = low_and_width(dialog.pv.range, config.pv_min, config.pv_span)
    config.out_low, config.out_width = low_and_width(dialog.output.range, 0.0, float(CV_FULL))
    config.halt = int(loop.word("sample_rate") < MIN_SAMPLE_COUNTS)  # a sample rate below 0.05 s is none (D162)
    config.period = UNKNOWN_PERIOD if config.halt else ticks(loop.quantity("sample_rate"))
    config.runs_when_stopped = int(runs_when_stopped)
    config.fetches_pv = int(dialog.pv.tag.startswith("IR"))
    config.carries_output = int(dialog.output.tag.startswith("OR") or dialog.output.pulse is not None)
    config.scale = sqrt(config.pv_span) if config.square_root else 1.0
    config.cv_low_limit, config.cv_high_limit = (
        clamp(float(loop.word(name)), 0.0, float(CV_FULL)) for name in ("cv_low", "cv_high")
    )
    config.timeout = ticks(loop.word("autotune_timeout"))
    config.cycle = 0 if dialog.output.pulse is None else ticks(loop.quantity("cycle_time"))
    config.min_on, config.min_off = ticks(loop.quantity("min_on")), ticks(loop.quantity("min_off"))


def set_gains(config: Config, state: State, loop: Loop) -> None:
    """The gain registers and the sample rate."""
    state.gain = float(loop.quantity("proportional_gain"))
    state.reset = float(loop.quantity("integral_time"))
    state.rate = float(loop.quantity("derivative_time"))
    state.period = config.period


def store_results(loop: Loop, state: State) -> None:
    """Put what the PLC has written into the registers: results of an autotune, a set point within its limits."""
    loop.write("setpoint", int(state.sp))
    loop.write("proportional_gain", round(state.gain * 100))
    loop.write("integral_time", round(state.reset * 10))
    loop.write("derivative_time", round(state.rate * 10))


def tag_number(tag: str) -> int | None:
    """The plain number of an R register; None for a physical tag."""
    match = TAG.fullmatch(tag)
    return SPACE.number_of("R", int(match.group(2))) if match and match.group(1) == "R" else None


# --- The virtual EZLogix: built from its registers and dialog, operated as by its operator ----------------------------


class Ezlogix(CountsPlc):
    """An EZLogix as loaded from its registers."""

    configs: list[Config]
    states: list[State]
    out_name = "CV"
    pulses = ("O",)
    modes: Mapping[str, int] = MODE_BITS
    commands = SWITCH_AND_TUNE
    tune_rule = "coefficients of the DL06's family, since the manual prints none (D178)"
    tuned_names = ("proportional_gain", "integral_time", "derivative_time")
    flag_bits: Mapping[str, int] = FLAG_BITS
    reasons: Mapping[int, str] = REASONS
    tuning_flags = ("autotune_running",)

    def __init__(self, image: Image, options: Options | None = None) -> None:
        words = image.words
        self._runs_when_stopped = bool(image.plc.get("process_when_stopped", True))
        dialogs = [read_settings(LoopSettings, entry, f"settings[{i}]") for i, entry in enumerate(image.settings)]
        self._loops = [loop_of(words, dialog) for dialog in dialogs]
        self.loops = [dialog.loop for dialog in dialogs]
        self.initial_modes = ["auto" if loop.bit("mode") else "manual" for loop in self._loops]
        self.place_loops(Config, State, SIGNALS, POINTS)
        for i in range(len(dialogs)):
            self._begin_loop(i, words)
        self.scale_loops()

    def _begin_loop(self, i: int, words: Mapping[int, int]) -> None:
        """What a loop starts with: its places in the shared vectors, its registers, and a request for its mode."""
        config, state, loop = self.configs[i], self.states[i], self._loops[i]
        if loop.dialog.output.pulse is None:
            self.signals[config.pulse_slot] = ""
        config.tune_buffer = i * POINTS
        number = tag_number(loop.dialog.output.tag)
        config.inner_loop = self._find_setpoint(number, i)
        if config.inner_loop >= 0:
            self.configs[config.inner_loop].outer_loop = i
        held = 0 if number is None else words.get(number, 0)
        state.out = state.unlimited_cv = clamp(float(held), 0.0, float(CV_FULL))
        state.sp = float(loop.word("setpoint"))
        self._apply_registers(i)
        state.pv, state.tune_countdown = config.pv_min, config.timeout
        if self.initial_modes[i] == "auto":
            self.request(i, "auto")
        self._show_signals(i, self.signal_values)

    def _find_setpoint(self, number: int | None, i: int) -> int:
        """The other loop whose set point register has this number; -1: none."""
        places = [SPACE.number_of("R", loop.dialog.registers) + R_BLOCK.offset_of("setpoint") for loop in self._loops]
        return next((j for j, place in enumerate(places) if place == number and j != i), -1)

    def _apply_registers(self, i: int) -> None:
        """Make the registers the controller's configuration."""
        config, state, loop = self.configs[i], self.states[i], self._loops[i]
        halted, period = config.halt, state.period
        configure_loop(config, loop, runs_when_stopped=self._runs_when_stopped)
        set_gains(config, state, loop)
        if (config.halt or state.period != period) and not state.pending & bits.STOPPED:
            bits.change_rate(config, state)
        calculate_gains(state)
        if config.halt:
            state.due = NEVER
        elif halted and not state.pending & bits.STOPPED:
            state.due = 0

    def _note_waiting(self, i: int, mode: int = 0) -> None:
        """Leaves a notice that a request waits, as the loop is not calculated."""
        if self.configs[i].halt:
            leave_notice(self.states[i], WAITS_FOR_RATE, mode)
        elif self.states[i].pending & bits.STOPPED:
            leave_notice(self.states[i], WAITS_FOR_RUN, mode)

    def _show_signals(self, i: int, signals: MutableSequence[float]) -> None:
        """The signals that an operator's change affects at once: SP is limited, its register later (D656)."""
        show_signals(self.configs[i], self.states[i], signals)

    @classmethod
    def is_about_mode(cls, requested_mode: int, reason: int) -> bool:
        """Whether a mode was requested: requests are never refused, they wait."""
        return requested_mode != 0

    @property
    def output_raises_pv(self) -> list[bool]:
        """Reverse controller action: the PV rises with the CV."""
        return [not config.direct for config in self.configs]

    @property
    def masters(self) -> list[int]:
        """The loop whose CV tag is a loop's set point register (D177)."""
        feeds = [config.inner_loop for config in self.configs]
        return [feeds.index(i) if i in feeds else -1 for i in range(len(feeds))]

    def output_limits(self, loop: int, signals: Sequence[float]) -> tuple[float, float]:
        """The CV limits."""
        config = self.configs[loop]
        return (
            config.out_low + config.cv_low_limit * config.out_width / CV_FULL,
            config.out_low + config.cv_high_limit * config.out_width / CV_FULL,
        )

    def dead_band(self, loop: int, signals: Sequence[float]) -> float:
        """Base+5; of a root the error has another scale."""
        config = self.configs[loop]
        return config.deadband * (config.scale if config.square_root else 1.0) * config.pv_width / config.pv_span

    def pulse_cycle(self, loop: int) -> float:
        """The cycle time of the control output."""
        return self.configs[loop].cycle / TICKS

    # --- the PLC's switch --------------------------------------------------------------------------------------------

    def start(self, tick: int) -> None:
        """The PLC runs: loops that stood still begin as at the start (D173)."""
        for config, state in zip(self.configs, self.states, strict=True):
            if state.pending & bits.STOPPED:
                bits.stop_tune(config, state)
                state.due = NEVER if config.halt else tick
                state.last_tick = state.cycle_end = tick
                state.pending |= bits.NO_PAST if state.status & bits.AUTO else 0
            state.pending &= ~(bits.STOPPED | bits.PV_STALE | bits.OUTPUT_CUT)

    def stop(self, signals: MutableSequence[float]) -> None:
        """The PLC stops: loops stand still, or go on with the tags that need no ladder program (D173)."""
        for config, state in zip(self.configs, self.states, strict=True):
            if not config.runs_when_stopped:
                state.pending |= bits.STOPPED
                state.due = NEVER
                leave_notice(state, IS_STOPPED)
                continue
            if not config.fetches_pv:
                state.pending |= bits.PV_STALE
                leave_notice(state, PV_IS_STALE)
            if not config.carries_output:
                state.pending |= bits.OUTPUT_CUT
                leave_notice(state, OUTPUT_IS_CUT)

    # --- the operator ------------------------------------------------------------------------------------------------

    def request(self, loop: int, mode: str) -> None:
        """Discrete +0 is written, which nothing refuses."""
        state, bit = self.states[loop], MODE_BITS[mode]
        state.wanted_mode = bit
        state.pending |= bits.REQUEST
        self._note_waiting(loop, bit)

    def autotune(self, loop: int, command: str) -> None:
        """``start``: discrete +4 goes from 0 to 1, by way of 0 where it is still on; ``cancel``: it goes to 0."""
        state, start = self.states[loop], command == "start"
        if start and state.status & bits.TUNING:
            leave_notice(state, TUNE_RUNS)
            return
        self._note_waiting(loop)
        state.tune_command = bits.ON if start else bits.OFF
        state.pending |= bits.TUNE

    def tuning_result(self, loop: int) -> TuneReport | None:
        """How the last autotune of a loop went; None when there was none."""
        state = self.states[loop]
        status = state.tune_status if state.status & bits.TUNING else state.last_tune_status
        if not status:
            return None
        done, error = status == bits.DONE, status > bits.CANCELLED
        results = state.tune_gain, state.tune_reset, state.tune_rate
        return self.tune_report(f"{status}: {TUNE_STATUS[status]}", results, done=done, error=error)

    def set_output(self, loop: int, value: Quantity, signals: MutableSequence[float]) -> None:
        """The CV that a loop starts with."""
        self._set_cv(loop, CV.encode(value, self._loops[loop].scales()), signals)

    def check_set(self, loop: int, path: tuple[str, ...], value: object) -> object:
        """The value of a ``set`` event as its registers take it; a ``PydanticCustomError`` says what is wrong."""
        scales = self._loops[loop].scales()
        return KEYS.check(path, value, lambda row, item: row.encode(item, scales))

    def new_period(self, loop: int, path: tuple[str, ...], value: Any) -> int:
        """The sample rate that a value for this key makes, in ticks; 0: another key, or a rate that is none."""
        rows = KEYS.find(path)
        if str(rows[0].path) != "sample_rate":
            return 0
        row: Word = R_BLOCK.find_word("sample_rate")
        raw = row.encode(value, self._loops[loop].scales())
        return ticks(row.decode(raw)) if raw >= MIN_SAMPLE_COUNTS else 0

    def set(self, loop: int, path: tuple[str, ...], value: Any, signals: MutableSequence[float]) -> str | None:
        """Write a value to its registers; returns why it has no effect, if so."""
        rows: list[Any] = KEYS.find(path)
        scales = self._loops[loop].scales()
        if rows[0] is CV:
            return self.write_output(loop, CV.encode(value, scales), signals)
        late = None
        for row, item in items_of(rows, value):
            late = self.write(loop, cast("Word", row), row.encode(item, scales), signals)  # the blocks are Words
        return late

    def write(self, loop: int, row: Word, raw: int, signals: MutableSequence[float]) -> str | None:
        """Write the raw content of a register; as `set` otherwise."""
        registers, state = self._loops[loop], self.states[loop]
        store_results(registers, state)
        registers.write(row.name, raw)
        state.sp = float(registers.word("setpoint"))
        tuned = state.status & bits.TUNING
        self._apply_registers(loop)
        if tuned and not state.status & bits.TUNING:
            self._set_cv(loop, int(state.out), signals)
        if row.name == "autotune_timeout":
            state.tune_countdown = self.configs[loop].timeout
        if row.name.startswith("setpoint"):
            self._show_signals(loop, signals)
        if self.configs[loop].halt:
            return "the loop is not calculated: its sample rate is below 0.05 s"
        return self._write_outer(loop, signals) if row.name == "setpoint" else None

    def memory(self, loop: int) -> Loop:
        """A loop's registers and discretes as they are after the last calculation."""
        store_results(self._loops[loop], self.states[loop])
        return self._loops[loop]

    def _write_outer(self, loop: int, signals: MutableSequence[float]) -> str | None:
        """Writes the CV that stands in this loop's set point register (D177); returns what overwrites it."""
        outer = self.configs[loop].outer_loop
        if outer < 0:
            return None
        if not self.states[outer].pending & bits.CV_HELD:
            self._set_cv(outer, int(self.states[loop].sp), signals)
        if self._why_cv_is_kept(outer):
            return f"the CV of {self.loops[outer]} stands in the same register and overwrites it"
        return None

    def _why_cv_is_kept(self, loop: int) -> str | None:
        """Why nobody else can write a loop's CV; None: he can."""
        state = self.states[loop]
        if state.pending & bits.CV_HELD:
            return "the autotune holds the CV"
        mode = state.wanted_mode if state.pending & bits.REQUEST else state.status
        if mode & bits.AUTO and not self.configs[loop].halt:
            return "the loop is in Auto and calculates the CV itself"
        return None

    def write_output(self, loop: int, raw: int, signals: MutableSequence[float]) -> str | None:
        """The operator writes the CV, which he can in Manual only (D172)."""
        why = self._why_cv_is_kept(loop)
        if why is None:
            self._set_cv(loop, raw, signals)
        return why

    def _set_cv(self, loop: int, raw: int, signals: MutableSequence[float]) -> None:
        state, inner = self.states[loop], self.configs[loop].inner_loop
        state.out = float(raw)
        self._show_signals(loop, signals)
        if inner >= 0:
            self.states[inner].sp = state.out
            self._show_signals(inner, signals)


load = Ezlogix


# --- The virtual EZLogix: its PID loops at one base step --------------------------------------------------------------
#
# Design. `scan` is called at every base step; it calculates the loops that are due, in ascending order, and moves the
# control outputs, which work between samples too. `sample` is one calculation of one loop: PV, set point, error, then
# whatever rarely happens (`State.pending`: a mode, an autotune), equation, saturation, signals. Nothing here knows
# files, names or units: see `load` for how registers become `Config` and `State`.
#
# Signals of a loop (slots in `Config`): ``in_slot`` is read, in engineering units; PV, SP, CV and BIAS (integral term
# and offset) are written in engineering units, ERROR, STATUS and COUNTDOWN as their registers hold them, O as 0 or 1.
# With the square root of the PV, SP is the PV that satisfies the set point, so that both can be compared.

__all__ = ["COST", "INLINED", "Config", "Ezlogix", "Options", "State", "load", "sample", "scan"]

MAX_ERROR = 32767.0
"""Base+11, the error, is a signed word that stays within this (D169)."""


def convert_pv(config: Config, value: float) -> float:
    """A measurement as whole counts; the converter saturates at the ends of its range (D670)."""
    pv = (value - config.pv_low) * config.pv_span / config.pv_width + config.pv_min
    if pv >= config.pv_max:
        return config.pv_max
    if pv > config.pv_min:
        return pv + ROUNDING_MAGIC - ROUNDING_MAGIC
    return config.pv_min


def switch_mode(state: State) -> None:
    """Discrete +0 as it was written; Manual keeps the CV, Auto begins with it."""
    state.pending &= ~REQUEST
    if state.wanted_mode & AUTO and state.status & AUTO == 0:
        state.pending |= NO_PAST
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
    shown_error = error + ROUNDING_MAGIC - ROUNDING_MAGIC
    if shown_error > MAX_ERROR:
        shown_error = MAX_ERROR
    elif shown_error < -MAX_ERROR:
        shown_error = -MAX_ERROR
    state.error = shown_error
    # Deadband; D170: it acts in every term
    if -config.deadband < difference < config.deadband:
        error = 0.0

    if pending & REQUEST:
        switch_mode(state)
    if pending & TUNE:
        run_autotune(config, state, aux, pv)
    # Position Algorithm: the derivative acts on E; Velocity Algorithm: on PV. D161: with E's sign
    derivative_input = pv
    if config.velocity == 0:
        derivative_input = error
    elif config.direct == 0:
        derivative_input = -pv
    if state.status & AUTO and state.pending & CV_HELD == 0:
        calculate_cv(config, state, error, derivative_input)
    else:
        state.unlimited_cv = state.out
        state.derivative_input_1 = derivative_input
    # Saturation. D167: the bit tells of the CV as it is, anti-windup looks at the one before its limits
    if 0.0 < state.out < FULL_CV:
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
            set_pulse(tick, configs[i], state, signals)


INLINED = (scan, sample, limit_setpoint, calculate_cv, convert_pv, show_signals, show_setpoint, show_output, set_pulse)
"""The hot path of compiled code."""
COST = COSTS["ezlogix"]

# --- The registers and discretes of a virtual EZLogix, and the tags of PV and CV --------------------------------------

MODE_NAMES = {bool(bit & AUTO): name for name, bit in MODE_BITS.items()}
WORD_MASK = 0xFFFF


class EzlogixRegisters(Registers):
    """Both blocks of all loops; where tags of PV and CV have a register of their own, those too."""

    def __init__(self, plc: Ezlogix) -> None:
        self.plc = plc
        self._rows: dict[int, tuple[int, Word]] = {}
        self._tags: dict[int, tuple[int, str]] = {}
        self._start_bits = [False] * len(plc.loops)
        """Discrete +4 as it was written."""
        for i in range(len(plc.loops)):
            dialog = plc.memory(i).dialog
            for key, (prefix, table) in BLOCKS.items():
                start = MAP_SPACE.number_of(prefix, getattr(dialog, key))
                self._rows |= {start + row.offset: (i, row) for row in table.words}
        for i in range(len(plc.loops)):
            dialog = plc.memory(i).dialog
            for tag, what in ((dialog.pv.tag, "pv"), (dialog.output.tag, "cv")):
                number = MAP_SPACE.parse(tag)
                if number is not None and number not in self._rows:
                    self._tags.setdefault(number, (i, what))

    def loops_by_register(self) -> dict[int, int]:
        """The two blocks of each loop, and its tags."""
        return super().loops_by_register() | {number: loop for number, (loop, _) in self._tags.items()}

    def contents(self, loop: int, signals: Sequence[float]) -> Mapping[int, int]:
        """As the registers are after the last calculation."""
        memory, state = self.plc.memory(loop), self.plc.states[loop]
        held = memory.values() | {
            "error": int(round_half_even(state.error)) & WORD_MASK,
            "autotune_status": state.tune_status,
            "autotune_timeout": state.tune_countdown // TICKS,
            "mode": int(bool((state.wanted_mode if state.pending & REQUEST else state.status) & AUTO)),
            "saturation": int(bool(state.status & SATURATED)),
            "start_autotune": int(self._start_bits[loop] or bool(state.status & TUNING)),
        }
        tags = {"pv": int(round_half_even(state.pv)) & WORD_MASK, "cv": int(round_half_even(state.out)) & WORD_MASK}
        contents = self.contents_by_number(loop, held)
        return contents | {number: tags[what] for number, (i, what) in self._tags.items() if i == loop}

    def write(self, number: int, raw: int, signals: MutableSequence[float]) -> WriteResult:
        """A setting, the mode, the start of an autotune, or the CV in Manual."""
        name = MAP_SPACE.name(number)
        if number in self._tags:
            return self._write_tag(number, raw, signals)
        loop, row = self._rows[number]
        if row.access in {"status", "reserved"}:
            raise self.read_only_error(name, row)
        if row.name == "mode":
            mode = MODE_NAMES[bool(raw)]
            self.plc.request(loop, mode)
            return WriteResult(f"request mode {mode}", mode)
        if row.name == "start_autotune":
            return self._switch_autotune(loop, is_on=bool(raw))
        late = self.plc.write(loop, row, raw, signals)
        return WriteResult.setting(row.path, MAP_SPACE.content_text(number, raw), late)

    def _switch_autotune(self, loop: int, *, is_on: bool) -> WriteResult:
        """Discrete +4, of which only the changes count."""
        was = self._start_bits[loop] or bool(self.plc.states[loop].status & TUNING)
        self._start_bits[loop] = is_on
        if is_on == was:
            return WriteResult(f"start of an autotune stays {'on' if is_on else 'off'}")
        self.plc.autotune(loop, "start" if is_on else "cancel")
        return WriteResult("autotune start" if is_on else "autotune off")

    def _write_tag(self, number: int, raw: int, signals: MutableSequence[float]) -> WriteResult:
        loop, what = self._tags[number]
        name = MAP_SPACE.name(number)
        if what == "pv":
            raise RegisterError(NO_REGISTER, f"{name} is the measurement, which the plant writes")
        if late := self.plc.write_output(loop, raw, signals):
            raise RegisterError(NOT_NOW, f"{name}: {late}")
        return WriteResult(f"set output to {raw} counts")
