"""The virtual CLICK: built from its registers, operated as by its operator, its ladder and the switch; one scan.

`load` decodes nothing but registers; what none holds (names, intended modes, the bit of the pulses) comes from the
image's settings.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Mapping, MutableSequence, Sequence
from dataclasses import fields
from decimal import Decimal
from math import isfinite, isnan, sqrt
from typing import TYPE_CHECKING, Any, cast

from pidcfg.encoders.image import Image
from pidcfg.encoders.maps.click import BLOCKS, ERRORS, SPACE, TABLES, TUNING_NUMBERS, error_text
from pidcfg.encoders.maps.click import MODE_BITS as INDICATIONS
from pidcfg.encoders.regmap import Point, Word
from pidcfg.schemas.base import Quantity, Rate, parse_seconds
from pidcfg.schemas.click import parse_sample_rate, parse_unit_rate
from pidcfg.schemas.numbers import parse_integer, parse_number, refuse
from pidcfg.sim.controllers.autotune import DONE, POINTS, TUNE_STATUS
from pidcfg.sim.controllers.click import equation as bits
from pidcfg.sim.controllers.click.equation import (
    AUTO,
    BIAS_ERROR,
    BIAS_NUMBER,
    FIRST_SAMPLE,
    GOAL,
    MANUAL,
    MODES,
    NAN,
    NO_PAST,
    PID_ERROR,
    REFUSED_TUNE_MODE,
    REFUSED_TUNE_RANGE,
    REQUEST,
    TUNE_ABORTED,
    TUNE_CANCELLED,
    TUNE_ERROR,
    TUNE_IDLE,
    TUNING,
    Config,
    Loop,
    State,
    abandon_autotune,
    calculate_gains,
    calculate_output,
    change_rate,
    configure_loop,
    float_of,
    is_tunable,
    loop_of,
    lowest_error,
    renew_alarms,
    run_autotune,
    sample_ticks,
    set_pulse,
    start_tune,
    write_state,
)
from pidcfg.sim.controllers.kernels import GOAL_ENDED, NEVER, clamp, finite_or, single, tell_request
from pidcfg.sim.controllers.plc import SWITCH_AND_TUNE, TICKS, Plc
from pidcfg.sim.controllers.plc import ScanOptions as Options
from pidcfg.sim.controllers.settings import NOT_NOW, Keys, RegisterError, Registers, WriteResult, items_of, rows_of
from pidcfg.sim.costs import COSTS

if TYPE_CHECKING:
    from pidcfg.sim.judgement.report import TuneReport

# --- Mode requests of a CLICK loop: what is granted, refused or overridden, and the bumpless transfer (D119) ----------
#
# Manual is entered from everywhere, Auto from Manual only, Autotune from Auto only; a PID error forces Manual and
# refuses Auto (D118). `REASONS` gives the text of each refusal; kernels leave its number in `State.notice`.

REFUSED_STOP = 1
REFUSED_TUNING = 2
OVERRIDE_STOP = 3
ERROR_CLEARED = 4
GOAL_GIVEN_UP = 5
REFUSED_ERROR = 100
OVERRIDE_ERROR = 200
NOTED_ERROR = 300
"""To these the row of the PID error is added."""

MODE_REASONS = {
    REFUSED_STOP: "refused: the PLC is in STOP mode",
    REFUSED_TUNING: "refused: Auto is entered from Manual; clearing the autotune request ends an autotune",
    OVERRIDE_STOP: "to Manual: the PLC went to STOP mode",
    ERROR_CLEARED: "no PID error any more",
    GOAL_GIVEN_UP: GOAL_ENDED,
}
MODE_NOTICES = {REFUSED_STOP, REFUSED_TUNING, OVERRIDE_STOP}
"""Reasons that concern the mode."""


def stop_tune(state: State) -> None:
    """A mode other than Auto ends an autotune without results."""
    if state.status & TUNING:
        abandon_autotune(state)
        state.status |= TUNE_ERROR
        state.requested_mode = 0
        tell_request(state, TUNE_ABORTED)


def to_manual(state: State, reason: int) -> None:
    """Force a loop into Manual, its output as it stands."""
    if state.status & MANUAL == 0:
        stop_tune(state)
        state.status = (state.status & ~MODES) | MANUAL
        state.requested_mode = 0
        tell_request(state, reason)


def to_auto(config: Config, state: State) -> None:
    """Manual to Auto: the bias becomes the output, and in mode 1 the set point the PV."""
    state.bias = state.out
    if config.bumpless == 1:
        state.sp = state.pv
    state.pending |= NO_PAST
    state.status = (state.status & ~MODES) | AUTO


def tune_refusal(config: Config, state: State) -> int:
    """Why an autotune cannot start: it needs Auto and PV limits (D123); 0: it can."""
    if state.status & AUTO == 0:
        return REFUSED_TUNE_MODE
    return 0 if is_tunable(config) else REFUSED_TUNE_RANGE


def request_mode(config: Config, state: State, mode: int) -> int:
    """Request a mode: it is entered, or the reason of the refusal is returned."""
    state.requested_mode = mode
    present_mode = state.status & MODES
    if present_mode == mode:
        return 0
    if mode == MANUAL:
        stop_tune(state)
        state.status = (state.status & ~MODES) | MANUAL
        return 0
    if mode == AUTO:
        if present_mode == TUNING:
            return REFUSED_TUNING
        if state.error_row:
            return REFUSED_ERROR + state.error_row
        to_auto(config, state)
        return 0
    reason = tune_refusal(config, state)
    if reason:
        state.status |= TUNE_ERROR
    else:
        start_tune(state)
    return reason


def cancel_autotune(state: State) -> None:
    """The autotune request is cleared: back to Auto with the registers as they were."""
    state.request &= ~TUNING
    state.requested_mode = 0
    if state.status & TUNING:
        abandon_autotune(state)
        state.status = (state.status & ~MODES) | AUTO
        tell_request(state, TUNE_CANCELLED)
    else:
        tell_request(state, TUNE_IDLE)


def approach_goal(config: Config, state: State) -> None:
    """Come one step closer to the goal; at the goal write its set point, as an operator would."""
    if state.status & MODES == state.goal:
        if state.goal_has_sp:
            state.sp = state.goal_sp
        state.pending &= ~GOAL
        state.goal = 0
        return
    reason = request_mode(config, state, state.goal)
    if reason and (state.refused_reasons >> state.error_row) & 1 == 0:
        state.refused_reasons |= 1 << state.error_row
        tell_request(state, reason)


def update_mode(config: Config, state: State) -> None:
    """Everything that can change the mode at a sample: requests, of which Autotune's comes last, or the goal (D673)."""
    if state.pending & REQUEST:
        state.pending &= ~(REQUEST | GOAL)
        state.goal = 0
        for bit in (state.request & (MANUAL | AUTO), state.request & TUNING):
            reason = request_mode(config, state, bit) if bit else 0
            if reason:
                tell_request(state, reason)
        state.request = 0
    elif state.pending & GOAL:
        approach_goal(config, state)


# --- What a CLICK loop tells the outside: names of modes, alarms and flags as bits, and notices in words --------------

MODE_BITS = {"manual": bits.MANUAL, "auto": bits.AUTO, "autotune": bits.TUNING}
SIGNALS = {
    "in_slot": "",
    "pv_slot": "PV",
    "sp_slot": "SP",
    "out_slot": "CO",
    "bias_slot": "BIAS",
    "error_slot": "ERROR",
    "pwm_slot": "PWM",
}
"""Signals of a loop by their slots in `Config`; the measurement itself belongs to the plant."""
ALARM_BITS = {
    "pv_low_low": bits.LOW_LOW,
    "pv_low": bits.LOW,
    "pv_high": bits.HIGH,
    "pv_high_high": bits.HIGH_HIGH,
    "deviation_high": bits.DEVIATION_HIGH,
    "deviation_high_high": bits.DEVIATION_HIGH_HIGH,
    "rate_of_change": bits.RATE_OF_CHANGE,
}
ALARM_LIMITS = {
    "pv_low_low": "low_low",
    "pv_low": "low",
    "pv_high": "high",
    "pv_high_high": "high_high",
    "deviation_high": "deviation_high",
    "deviation_high_high": "deviation_high_high",
    "rate_of_change": "rate_of_change",
}
"""Where `Config` has the limit of each."""
OUTER_ALARMS = ("pv_low_low", "pv_high_high", "deviation_high_high")
FLAG_BITS = {"pid_error": bits.PID_ERROR, "autotune_error": bits.TUNE_ERROR}

REASONS = MODE_REASONS | bits.REASONS
MODE_CODES = set(MODE_NOTICES)
for _row, _error in enumerate(ERRORS, start=1):
    _text = error_text(_error)
    REASONS[REFUSED_ERROR + _row] = f"refused: {_text}"
    REASONS[OVERRIDE_ERROR + _row] = f"to Manual: {_text}"
    REASONS[NOTED_ERROR + _row] = _text
    MODE_CODES |= {REFUSED_ERROR + _row, OVERRIDE_ERROR + _row}

# --- What a scenario's ``set`` may write in a CLICK loop: a key of the configuration to its register ------------------
#
# Keys are those of a loop in the configuration file (``tuning.reset_time``, ``alarms.pv.high``). Short forms:
# ``setpoint``, ``output`` and ``bias`` with a number, and the last part of a key where only one register has it.

SHORT_FORMS = {"setpoint": "setpoint.value", "output": "state.output", "bias": "state.bias"}
EVENT_KEYS = {"mode": "mode", "autotune": "autotune"}
"""Keys that have an event instead, and the key of that event."""
UNSETTABLE_FIELDS = {"state.raw_pv", "state.pv"}
"""What only the controller writes."""


def parse_plain(value: object) -> Decimal:
    """A number in the unit of its register; a PLC with floats has no counts."""
    if isinstance(value, Quantity):
        if value.counts:
            refuse("number_form", f"{value} is in counts, but the register holds a number in its own unit")
        return value.value
    return parse_number(value)


PARSERS: dict[str, Callable[[object], object]] = {
    "sample_rate": parse_sample_rate,
    "tuning.reset_time": parse_seconds,
    "tuning.derivative_gain": parse_seconds,
    "output.pwm.period": parse_seconds,
    "pv.filter": parse_integer,
    "derivative_gain_limit": parse_integer,
    "alarms.rate_of_change": parse_unit_rate,
}
KEYS = Keys(rows_of(TABLES, UNSETTABLE_FIELDS), SHORT_FORMS, EVENT_KEYS, PARSERS, lambda _word: parse_plain)


def encode_setting(row: Point, value: Any, sample_rate: Decimal) -> int:
    """A parsed value to the bits of its register; ``sample_rate`` is the present one in s."""
    if isinstance(value, Rate):
        value = value.per_sample(sample_rate).value
    return row.encode(value)


def check_setting(path: tuple[str, ...], value: object, sample_rate: Decimal) -> object:
    """The value of a key as its registers take it; a ``PydanticCustomError`` says what is wrong."""
    return KEYS.check(path, value, lambda row, item: encode_setting(row, item, sample_rate))


def settings_of(path: tuple[str, ...], value: Any, sample_rate: Decimal) -> list[tuple[Word, int]]:
    """The registers behind a key, and the bits that a checked value makes in each."""
    items = items_of(KEYS.find(path), value)
    return [(cast("Word", row), encode_setting(row, item, sample_rate)) for row, item in items]


MIN_PERIOD_STEPS = 100
"""Least number of base steps in a PWM period: the pulses' resolution is 1 % (D121)."""
COUNTS_PER_RANGE = 1 << 16
"""Counts of the PV's range where a resolution is needed: floats have none (D128)."""


class Click(Plc):
    """A CLICK as loaded from its registers."""

    configs: list[Config]
    states: list[State]
    out_name = "CO"
    output_unit = "%"
    pulses = ("PWM",)
    modes: Mapping[str, int] = MODE_BITS
    options = tuple(f.name for f in fields(Options))
    commands = SWITCH_AND_TUNE
    tune_rule = "a rule of ours, since the help prints none (D123, D125)"
    tuned_names = ("proportional_gain", "reset_time", "derivative_gain", "sample_rate")
    alarm_bits: Mapping[str, int] = ALARM_BITS
    alarm_limits: Mapping[str, str] = ALARM_LIMITS
    no_limit = bits.UNBOUNDED
    flag_bits: Mapping[str, int] = FLAG_BITS
    reasons: Mapping[int, str] = REASONS
    mode_codes = MODE_CODES
    outer_alarms = OUTER_ALARMS
    error_flags = ("pid_error",)

    def __init__(self, image: Image, options: Options | None = None) -> None:
        words = image.words
        self._loops = [loop_of(words, i, entry) for i, entry in enumerate(image.settings)]
        self.loops = [loop.name for loop in self._loops]
        self.initial_modes = [loop.initial_mode for loop in self._loops]
        self.place_loops(Config, State, SIGNALS, POINTS)
        for i in range(len(self._loops)):
            self._begin_loop(i)
        self.scales = [scale_of(config) for config in self.configs]
        self.in_run = False
        self.run(0)

    @property
    def error_words(self) -> Mapping[str, int]:
        """The error register of each loop, DSn+00."""
        names = (f"DS{loop.starts['integers']}" for loop in self._loops)
        return {name: int(state.error_number) for name, state in zip(names, self.states, strict=True)}

    @property
    def base_ticks(self) -> int:
        """The greatest common step of the sample rates, in ticks; a part of it where pulses need a finer one (D121)."""
        step = super().base_ticks
        finest = min((config.pwm_period // MIN_PERIOD_STEPS for config in self.configs if config.pwm), default=step)
        parts = -(-step // finest)
        while step % parts:
            parts += 1
        return step // parts

    def _begin_loop(self, i: int) -> None:
        """What a loop starts with: the controller's registers, its goal, and its places in the shared vectors."""
        loop, config, state = self._loops[i], self.configs[i], self.states[i]
        config.tune_buffer = i * POINTS
        config.pwm = int(loop.pwm)
        if not loop.pwm:
            self.signals[config.pwm_slot] = ""
        self._apply_registers(i)
        config.period = state.period
        state.goal = 0 if loop.initial_mode == "manual" else MODE_BITS[loop.initial_mode]
        state.goal_sp, state.goal_has_sp = state.sp, int(loop.has_setpoint)
        state.pending |= bits.GOAL if state.goal else 0
        self._show_signals(i, self.signal_values)

    def _apply_registers(self, i: int) -> None:
        """Make the registers the controller's configuration, and look for PID errors (D117)."""
        config, state = self.configs[i], self.states[i]
        n, period = self._loops[i].numbers(), state.period
        configure_loop(config, n)
        write_state(state, n)
        self._note_error(state, lowest_error(n))
        if state.period != period:
            change_rate(state)
        if not state.error_row:
            calculate_gains(config, state)

    @staticmethod
    def _note_error(state: State, error: int) -> None:
        """The lowest error that is active; a loop in Auto or Autotune goes to Manual at once (D118)."""
        if error == state.error_row:
            return
        state.error_row, state.error_number = error, float(ERRORS[error - 1].number) if error else 0.0
        state.status &= ~bits.PID_ERROR
        state.requested_mode = 0
        if not error:
            tell_request(state, ERROR_CLEARED)
            return
        state.status |= bits.PID_ERROR
        if state.status & bits.MANUAL:
            tell_request(state, NOTED_ERROR + error)
        else:
            to_manual(state, OVERRIDE_ERROR + error)

    def _show_signals(self, i: int, signals: MutableSequence[float]) -> None:
        """The signals of a loop as its registers say; in STOP mode nothing drives its outputs (D120)."""
        config, state = self.configs[i], self.states[i]
        stopped = bool(state.pending & bits.STOPPED)
        signals[config.pv_slot], signals[config.sp_slot], signals[config.bias_slot] = (
            finite_or(state.pv, 0.0),
            finite_or(state.sp, 0.0),
            finite_or(state.bias, 0.0),
        )
        signals[config.out_slot] = 0.0 if stopped else finite_or(state.out, 0.0)
        signals[config.error_slot] = state.error_number

    # --- the CPU -----------------------------------------------------------------------------------------------------

    def start(self, tick: int) -> None:
        """STOP to RUN: loops begin in Manual, with the outputs that their registers hold (D120)."""
        for state in self.states:
            state.pending = (state.pending & ~bits.STOPPED) | bits.FIRST_SAMPLE
            state.due = tick
            state.on_time = -1.0

    def stop(self, signals: MutableSequence[float]) -> None:
        """RUN to STOP: loops are not executed, outputs are off."""
        for i, state in enumerate(self.states):
            to_manual(state, OVERRIDE_STOP)
            state.pending = (state.pending & ~(bits.REQUEST | bits.GOAL)) | bits.STOPPED
            state.request = state.goal = 0
            state.due = NEVER
            self._show_signals(i, signals)

    # --- the operator ------------------------------------------------------------------------------------------------

    @property
    def output_raises_pv(self) -> list[bool]:
        """Direct (forward) action: the PV rises with the output."""
        return [not config.reverse for config in self.configs]

    @property
    def error_loops(self) -> dict[str, int]:
        """DSn+00 of each loop."""
        return {name: i for i, name in enumerate(self.error_words)}

    def output_limits(self, loop: int, signals: Sequence[float]) -> tuple[float, float]:
        """CO's lower and upper limit."""
        return self.configs[loop].out_low, self.configs[loop].out_high

    def given_set_point(self, loop: int, signals: Sequence[float]) -> float:
        """What is written at the first change to Auto."""
        return float(self.states[loop].goal_sp)

    def inner_deviation(self, loop: int) -> float | None:
        """The first deviation alarm."""
        limit = self.configs[loop].deviation_high
        return None if limit >= bits.UNBOUNDED else limit

    def integrates(self, loop: int, signals: Sequence[float]) -> bool:
        """The longest reset time is as good as none."""
        return self.states[loop].reset < float(TUNING_NUMBERS.no_integral)

    def dead_band(self, loop: int, signals: Sequence[float]) -> float:
        """DFn+03, which is compared with the squared error where that is on."""
        config = self.configs[loop]
        band = sqrt(config.deadband) if config.squared else config.deadband
        return band if config.deadband_on else 0.0

    def pulse_cycle(self, loop: int) -> float:
        """The PWM period."""
        return self.configs[loop].pwm_period / TICKS if self.configs[loop].pwm else 0.0

    def request(self, loop: int, mode: str) -> None:
        """A mode request goes on; it is looked at with the next sample and is off again."""
        state, bit = self.states[loop], MODE_BITS[mode]
        state.requested_mode = bit
        if state.pending & bits.STOPPED:
            tell_request(state, REFUSED_STOP)
            return
        if state.pending & bits.GOAL and not state.pending & bits.REQUEST:
            tell_request(state, GOAL_GIVEN_UP)
        state.request = state.request | bit if bit == bits.TUNING else (state.request & bits.TUNING) | bit
        state.pending |= bits.REQUEST

    def autotune(self, loop: int, command: str) -> None:
        """``start`` sets the autotune request, ``cancel`` clears it."""
        if command == "start":
            self.request(loop, "autotune")
        else:
            cancel_autotune(self.states[loop])

    def tuning_result(self, loop: int) -> TuneReport | None:
        """How the autotune of a loop went; None when there was none."""
        registers, state = self._loops[loop], self.states[loop]
        error = bool(state.status & bits.TUNE_ERROR)
        if not (state.tune_done or state.status & bits.TUNING or error):
            return None
        done = state.tune_done == DONE
        status = "running" if state.status & bits.TUNING else "error" if error else TUNE_STATUS[state.tune_done]
        registers.store_results(state)
        n = registers.numbers()
        results = [n[name] / 1000 if name == "sample_rate" else n[name] for name in self.tuned_names]
        return self.tune_report(status, results, done=done, error=error)

    def set_output(self, loop: int, value: Quantity, signals: MutableSequence[float]) -> None:
        """The output that a loop in Manual starts with."""
        self.set(loop, ("output",), value.value, signals)

    def check_set(self, loop: int, path: tuple[str, ...], value: object) -> object:
        """The value of a ``set`` event as its registers take it; a ``PydanticCustomError`` says what is wrong."""
        return check_setting(path, value, self._sample_rate(loop))

    def new_period(self, loop: int, path: tuple[str, ...], value: Any) -> int:
        """The sample rate that a value for this key makes, in ticks; 0: the key is something else."""
        if KEYS.find(path)[0].path != "sample_rate":
            return 0
        ((_, raw),) = settings_of(path, value, self._sample_rate(loop))
        return sample_ticks(raw - 0x10000 if raw > 0x7FFF else raw)

    def set(self, loop: int, path: tuple[str, ...], value: Any, signals: MutableSequence[float]) -> str | None:
        """Write a value to its registers, which show at once (D674); why it has no effect, as in Auto (D127)."""
        return self.write(loop, settings_of(path, value, self._sample_rate(loop)), signals)

    def write(self, loop: int, contents: Sequence[tuple[Word, int]], signals: MutableSequence[float]) -> str | None:
        """Write raw contents; as `set` otherwise."""
        registers, state = self._loops[loop], self.states[loop]
        if contents[0][0].name == "output" and state.status & bits.MANUAL == 0:
            return "is not written: the output is read-only unless the loop is in Manual"
        registers.store_results(state)
        for row, raw in contents:
            registers.words[row.name] = raw
            if row.name == "setpoint":
                state.goal_sp, state.goal_has_sp = float_of(raw), 1
        self._apply_registers(loop)
        self._show_signals(loop, signals)
        return None

    def memory(self, loop: int) -> Loop:
        """A loop's registers as they are after the last scan."""
        self._loops[loop].store_results(self.states[loop])
        return self._loops[loop]

    def _sample_rate(self, loop: int) -> Decimal:
        """The register of the sample rate in s."""
        return Decimal(self.states[loop].sample_ms) / 1000


def scale_of(config: Config) -> tuple[float, float, int]:
    """The ends of the PV's range, 0 to 100 where the registers hold none, and what counts as a count (D128)."""
    if not (isfinite(config.pv_low) and isfinite(config.pv_high) and config.pv_low < config.pv_high):
        return 0.0, 100.0, COUNTS_PER_RANGE
    return config.pv_low, config.pv_high, COUNTS_PER_RANGE


load = Click


# --- The virtual CLICK: what one pass of the main program does for its PID loops --------------------------------------
#
# Design. `scan` is called at every base step, calculates the loops that are due, and renews the discrete outputs of
# those with pulse width modulation. `sample` is one calculation of one loop: PV and filter, mode requests, set-point
# limits, alarms, autotune, equation, output limits. Every result of the calculation is rounded to single precision
# (D110). Nothing here knows files, names or units: see `load` for how registers become `Config` and `State`.
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
            state.error_row = BIAS_ERROR
            state.error_number = BIAS_NUMBER
            state.status |= PID_ERROR
            to_manual(state, OVERRIDE_ERROR + BIAS_ERROR)
            signals[config.error_slot] = state.error_number


def sample(config: Config, state: State, aux: list[float], signals: list[float]) -> None:
    """One calculation of a loop."""
    # Raw Process Variable (DFn+11) and PV Filter; D115: the first sample has no past
    raw = single(signals[config.in_slot])
    previous_pv = state.pv
    if state.pending & FIRST_SAMPLE:
        state.pending &= ~FIRST_SAMPLE
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
        signals[config.sp_slot] = finite_or(state.sp, 0.0)
    if state.status & TUNING:
        run_autotune(config, state, aux)
    # Control Output (DFn+08)
    if state.status & AUTO:
        control_output(config, state, signals)
    # D116: what is no number is shown as 0
    signals[config.pv_slot] = pv
    signals[config.out_slot] = finite_or(state.out, 0.0)
    signals[config.bias_slot] = finite_or(state.bias, 0.0)


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
            signals[config.pwm_slot] = set_pulse(config, state, tick)


INLINED = (scan, sample, calculate_output)
"""The hot path of compiled code."""
COST = COSTS["click"]

# --- The C, DS and DF registers of a virtual CLICK --------------------------------------------------------------------

REQUESTS = {"manual_request": "manual", "auto_request": "auto", "autotune_request": "autotune"}
STATUS = {f"alarm_{name.removeprefix('pv_')}": bit for name, bit in ALARM_BITS.items()}
STATUS |= dict(zip(INDICATIONS, (MANUAL, AUTO), strict=True))
"""Bits that the PLC writes, by what they show."""


class ClickRegisters(Registers):
    """The blocks of all loops; requests are read as 0, since the PLC takes them at once."""

    def __init__(self, plc: Click) -> None:
        self.plc = plc
        self._rows: dict[int, tuple[int, Word]] = {}
        for i in range(len(plc.loops)):
            starts = plc.memory(i).starts
            for key, (prefix, table) in BLOCKS.items():
                start = SPACE.number_of(prefix, starts[key])
                self._rows |= {start + row.offset: (i, row) for row in table.words}

    def contents(self, loop: int, signals: Sequence[float]) -> Mapping[int, int]:
        """As the registers are after the last scan."""
        words, status = self.plc.memory(loop).words, self.plc.states[loop].status
        alarms = {name: int(bool(status & bit)) for name, bit in STATUS.items()}
        return self.contents_by_number(loop, defaultdict(int, words | alarms | dict.fromkeys(REQUESTS, 0)))

    def write(self, number: int, raw: int, signals: MutableSequence[float]) -> WriteResult:
        """A setting, the output in Manual, or a request."""
        loop, row = self._rows[number]
        name = SPACE.name(number)
        if row.name in REQUESTS:
            return self._request(loop, row.name, raw)
        if row.path is None or row.path in UNSETTABLE_FIELDS:
            raise self.read_only_error(name, row)
        self.decode(name, row.codec.decode, raw)
        if late := self.plc.write(loop, [(row, raw)], signals):
            raise RegisterError(NOT_NOW, f"{name} {late}")
        return WriteResult(f"set {row.path} to {SPACE.content_text(number, raw)}")

    def _request(self, loop: int, name: str, raw: int) -> WriteResult:
        """A request goes on; one for an autotune may go off again."""
        mode = REQUESTS[name]
        if raw:
            self.plc.request(loop, mode)
            return WriteResult(f"request mode {mode}", mode)
        if name == "autotune_request":
            self.plc.autotune(loop, "cancel")
        return WriteResult(f"request of mode {mode} off")
