"""The virtual Delta AS: built from the operands of its DPIDE instructions, operated, and what a scan does for them."""

from __future__ import annotations

from collections.abc import Mapping, MutableSequence, Sequence
from decimal import Decimal
from typing import TYPE_CHECKING, Any

from pidcfg.encoders.image import read_settings
from pidcfg.encoders.maps.dpide import LOOPS, ROWS, TABLES
from pidcfg.encoders.parameters import Content, Program, content_text, raw_of, register_content
from pidcfg.schemas.base import Quantity
from pidcfg.schemas.dpide import MAX_CYCLE, MIN_CYCLE, PlcSettings, Scale, parse_milliseconds, parse_time
from pidcfg.schemas.iec import TimeNumber
from pidcfg.schemas.numbers import parse_integer, refuse
from pidcfg.sim.controllers.autotune import DONE, FAILED, TUNE_STATUS
from pidcfg.sim.controllers.dpide import equation as bits
from pidcfg.sim.controllers.dpide.equation import (
    AUTO,
    FROM_MANUAL,
    HALTING,
    IN_DEAD_BAND,
    LIMITED,
    MANUAL,
    MODES,
    NO_PAST,
    OFF,
    REQUEST,
    STOPPED,
    TUNING,
    Config,
    State,
    abandon_autotune,
    apply_dead_band,
    calculate_gains,
    calculate_mv,
    calculate_slope,
    change_rate,
    run_autotune,
    show_signals,
    start_tune,
)
from pidcfg.sim.controllers.kernels import (
    NEVER,
    clamp,
    finite_or,
    leave_notice,
    read_registers,
    register_values,
    single,
)
from pidcfg.sim.controllers.plc import COUNTS_PER_RANGE, SWITCH_AND_TUNE, TICKS, NamedPlc
from pidcfg.sim.controllers.plc import ScanOptions as Options
from pidcfg.sim.controllers.settings import (
    NO_VALUE,
    NamedKeys,
    RegisterError,
    Registers,
    Seconds,
    WriteResult,
    parameters_of,
    parse_plain,
)
from pidcfg.sim.costs import COSTS

if TYPE_CHECKING:
    from pidcfg.sim.judgement.report import TuneReport

# --- The four modes of a DPIDE instruction, as PID_RUN, PID_MODE and PID_MAN make them (D275) -------------------------


def enter_mode(config: Config, state: State, mode: int) -> None:
    """The mode, and what the next calculation has to know of the one before (kernel)."""
    before = state.status & MODES
    state.status = (state.status & ~MODES) | mode
    if before == OFF:
        state.error_sign = 0.0
        state.sv_crossed = 0
    if mode == TUNING:
        start_tune(config, state)
    elif mode == AUTO:
        state.pending |= NO_PAST
        if before == MANUAL:
            state.pending |= FROM_MANUAL


def stop_block(config: Config, state: State) -> None:
    """PID_RUN is FALSE: MV is 0, and nothing else is written (D273, D688; kernel)."""
    if state.status & TUNING:
        abandon_autotune(state)
        state.mode = state.previous_mode
    state.pending &= ~(REQUEST | HALTING)
    state.status = (state.status & ~(MODES | LIMITED | IN_DEAD_BAND)) | OFF
    state.out = 0.0
    if config.mout_is_mv:
        state.mout = 0.0


def switch_mode(config: Config, state: State) -> None:
    """The mode that the operands make takes effect (kernel)."""
    state.pending &= ~(REQUEST | FROM_MANUAL)
    if state.status & TUNING:
        abandon_autotune(state)
    enter_mode(config, state, state.wanted_mode)


# --- How a DPIDE instruction is reported: names of modes and flags as bits, and notices in words ----------------------

MODE_BITS = {"manual": bits.MANUAL, "auto": bits.AUTO, "autotune": bits.TUNING, "off": bits.OFF}
SIGNALS = {
    "in_slot": "",
    "pv_slot": "PV",
    "sp_slot": "SV",
    "out_slot": "MV",
    "mout_slot": "MOUT",
    "bias_slot": "I_MV",
    "error_slot": "E",
}
"""Signals of a loop by their slots in `Config`; the measurement itself belongs to the plant."""
FLAG_BITS = {
    "mv_limited": bits.LIMITED,
    "in_dead_band": bits.IN_DEAD_BAND,
    "autotune_running": bits.TUNING,
    "autotune_error": bits.TUNE_ERROR,
}

WAITS_FOR_TUNE = 32
WAITS_FOR_PLC = 33
TUNE_WAITS = 34
TUNE_RUNS = 35
TUNE_IDLE = 36
IS_STOPPED = 37
TUNE_WAITS_FOR_PLC = 38

MODE_CODES = (WAITS_FOR_TUNE, WAITS_FOR_PLC)
"""Reasons that concern a requested mode."""
REASONS = {
    **bits.REASONS,
    bits.MV_JUMPS: "MV jumps at the end of manual: without Ti_Ki there is no I_MV that could carry MOUT",
    WAITS_FOR_TUNE: "waits: PID_MAN has no effect while PID_MODE is 1",
    WAITS_FOR_PLC: "waits: the PLC is stopped",
    TUNE_WAITS: "autotune waits: PID_RUN is FALSE",
    TUNE_WAITS_FOR_PLC: "autotune waits: the PLC is stopped",
    TUNE_RUNS: "autotune is running already",
    TUNE_IDLE: "no autotune to be cancelled",
    IS_STOPPED: "the PLC is stopped: the instruction is not executed, MV stays as it is",
}

# --- What a scenario's ``set`` may write in a running DPIDE instruction: its operands, by their names -----------------
#
# Short forms: ``setpoint`` is SV, ``output`` is MOUT.

PID_MODES = (0, 1, 2)
UNSETTABLE_OPERANDS = {
    "PV": "it comes from the plant",
    "MV": "the PLC writes it; MOUT does so in manual",
}
"""Operands that cannot be set, and why."""


def parse_mode(value: object) -> int:
    """0, 1 or 2."""
    mode = parse_integer(value)
    if mode not in PID_MODES:
        refuse("choice", f"{mode} is none of {', '.join(map(str, PID_MODES))}")
    return mode


def parse_seconds_in(value: object) -> Decimal:
    """A time in s or a gain, as the configuration has it; `TimeNumber` is a number."""
    return parse_time(value) if isinstance(value, str) else parse_plain(value)


def mark_time(name: str, value: object, content: Content) -> Content:
    """The content of an operand, marked where its value can be nothing but a time."""
    is_time = name in {"Ti_Ki", "Td_Kd"} and isinstance(value, str) and isinstance(parse_time(value), TimeNumber)
    return Seconds(content) if is_time else content


KEYS = NamedKeys(
    parameters_of(TABLES, UNSETTABLE_OPERANDS),
    {"setpoint": "SV", "setpoint.value": "SV", "output": "MOUT"},
    {"mode": "mode", "autotune": "autotune"},
    UNSETTABLE_OPERANDS,
    {
        "PID_MODE": parse_mode,
        "CYCLE": parse_milliseconds,
        "Ti_Ki": parse_seconds_in,
        "Td_Kd": parse_seconds_in,
        "Tf": parse_seconds_in,
    },
)


# --- From the operands of a DPIDE instruction to the numbers that it calculates with, and back ------------------------

MILLISECOND = TICKS // 1000
NOT_NEGATIVE = ("Kc_Kp", "Ti_Ki", "Td_Kd", "Tf")
"""Operands of which a negative value counts as 0."""
Operands = dict[str, float]
"""BOOL as 0 or 1, DINT and REAL."""


def operands_of(words: Mapping[str, Any], loop: str) -> tuple[Operands, list[str]]:
    """The operands of a loop, and which are no value; what a listing lacks is FALSE or 0, but for PID_RUN."""
    operands: Operands = {}
    problems: list[str] = []
    for name, row in ROWS.items():
        default = float(name == "PID_RUN")
        content = words.get(f"{loop}.{name}", default)
        wrong = not isinstance(content, bool | int | float)
        if wrong or (name == "PID_MODE" and content not in PID_MODES):
            problems.append(f"{name}: {content} means nothing there, {content_text(row.type, default)} is taken")
            content = default
        operands[name] = content
    return operands, problems


def configure_loop(config: Config, state: State, operands: Operands, interval: int) -> None:
    """From the operands to the records of an instruction; ``interval`` of an interrupt task in ticks, 0: none."""
    read_registers(config, operands)
    read_registers(state, operands, single)
    config.dead_band = abs(single(operands["ERR_DBW"]))
    config.lowest_mv, config.highest_mv = sorted(single(operands[name]) for name in ("MV_MIN", "MV_MAX"))
    state.period = interval or sampling_time(int(operands["CYCLE"]))
    calculate_gains(config, state)


def store_results(operands: Operands, state: State) -> None:
    """Write the instruction's values to its operands."""
    operands |= register_values(state)


def sampling_time(cycle: int) -> int:
    """CYCLE in ticks."""
    return min(max(cycle, MIN_CYCLE), MAX_CYCLE) * MILLISECOND


def scale_of(scale: Scale, setpoint: float) -> tuple[float, float, int]:
    """The ends of PV's range; without one 0 to 1, widened to SV (D279)."""
    if scale.range is not None:
        return float(scale.range[0]), float(scale.range[1]), COUNTS_PER_RANGE
    return min(0.0, setpoint), max(1.0, setpoint), COUNTS_PER_RANGE


def missing_effect(name: str, config: Config, state: State, operands: Operands, interval: int) -> str | None:
    """Why an operand that has just been written does not act as it stands, if so."""
    value = operands[name]
    if name in NOT_NEGATIVE and value < 0:
        return "what is below 0 counts as 0"
    if name == "MOUT":
        return _mout_effect(config, state)
    if name == "CYCLE" and interval:
        return "has no effect: the interval of the interrupt task is the sampling time"
    if name == "CYCLE" and state.period != value * MILLISECOND:
        return f"counts as {state.period // MILLISECOND} ms"
    if name in {"MV_MAX", "MV_MIN"} and operands["MV_MAX"] < operands["MV_MIN"]:
        return "MV_MAX is below MV_MIN: each is taken for the other"
    if name == "I_MV" and state.ki <= 0.0:
        return "the next calculation makes it 0: there is no integral"
    if name == "PID_MAN" and state.wanted_mode == TUNING:
        return "has no effect while PID_MODE is 1"
    return None


def _mout_effect(config: Config, state: State) -> str | None:
    if state.wanted_mode == OFF:
        return "MV stays 0 while PID_RUN is FALSE"
    if config.manual and state.wanted_mode != TUNING:
        return None
    follows = "; MOUT_AUTO is TRUE, so MOUT follows MV again" if config.mout_follows else ""
    if config.mout_is_mv:
        follows = "; it stands in the device of MV, which overwrites it"
    return f"MOUT acts in manual only{follows}"


# --- The virtual Delta AS: built from the operands of its DPIDE instructions, operated as by an operator --------------


class Dpide(NamedPlc):
    """A Delta AS as loaded from its operands."""

    configs: list[Config]
    states: list[State]
    table, keys, sample_key = LOOPS, KEYS, "CYCLE"
    config, state, slots = Config, State, SIGNALS
    setpoint = KEYS.short_forms["setpoint"]
    out_name = "MV"
    modes: Mapping[str, int] = MODE_BITS
    commands = SWITCH_AND_TUNE
    tune_rule = "a rule of ours, since the manual prints none (D276, D277)"
    tuned_names = ("Kc_Kp", "Ti_Ki", "Td_Kd", "Tf")
    flag_bits: Mapping[str, int] = FLAG_BITS
    reasons: Mapping[int, str] = REASONS
    mode_codes = MODE_CODES
    form_key = "PID_EQ"
    mode_keys = ("PID_RUN", "PID_MAN", "PID_MODE")

    def __init__(self, program: Program, options: Options | None = None) -> None:
        super().__init__(program, options)
        self._dependent = [bool(config.dependent) for config in self.configs]
        scales = [
            read_settings(Scale, entry.get("pv", {}), f"settings[{i}].pv") for i, entry in enumerate(self._settings)
        ]
        self._has_range = [scale.range is not None for scale in scales]
        self.scales = [scale_of(scale, state.sp) for scale, state in zip(scales, self.states, strict=True)]

    def contents_of(self, words: Mapping[str, Any], loop: str) -> tuple[Operands, list[str]]:
        """The operands of a loop, and which of them are no value."""
        return operands_of(words, loop)

    def prepare(self) -> None:
        """The interval of an interrupt task in ticks (0: none), and the devices of all operands."""
        self._interval = (read_settings(PlcSettings, self._plc_settings, "plc").interrupt_task or 0) * MILLISECOND
        self._devices = [dict(entry.get("devices", {})) for entry in self._settings]

    def begin(self, loop: int) -> None:
        """What an instruction starts with: its operands, the mode that they make, and who writes to its devices."""
        config, state = self.configs[loop], self.states[loop]
        configure_loop(config, state, self._contents[loop], self._interval)
        config.sv_writer, config.bias_writer, config.mout_writer = (
            self._writer(loop, name) for name in ("SV", "BIAS", "MOUT")
        )
        devices = self._devices[loop]
        config.mout_is_mv = int("MOUT" in devices and devices["MOUT"] == devices.get("MV"))
        state.status = bits.OFF
        enter_mode(config, state, self._mode(loop))
        state.wanted_mode = state.status & bits.MODES
        if state.status & bits.OFF:
            state.out = 0.0
        self._join_mout(loop)
        show_signals(config, state, self.signal_values)

    def sample_ticks(self, value: Any) -> int:
        """CYCLE, unless an interrupt task has the sampling time."""
        return 0 if self._interval else sampling_time(value)

    def _mode(self, i: int) -> int:
        """The mode that PID_RUN, PID_MODE and PID_MAN make."""
        if not self._contents[i]["PID_RUN"]:
            return bits.OFF
        if self.states[i].mode == 1:
            return bits.TUNING
        return bits.MANUAL if self.configs[i].manual else bits.AUTO

    def _join_mout(self, i: int) -> None:
        """One device of MOUT and MV holds what was written to it; 0 while PID_RUN is FALSE."""
        config, state = self.configs[i], self.states[i]
        if config.mout_is_mv and state.status & bits.OFF:
            state.mout = state.out = 0.0
        elif config.mout_is_mv:
            state.out = state.mout

    def _writer(self, i: int, operand: str) -> int:
        """The other loop whose MV stands in the device of an operand; -1: none."""
        device = self._devices[i].get(operand)
        writers = (j for j, devices in enumerate(self._devices) if j != i and device and devices.get("MV") == device)
        return next(writers, -1)

    def _write(self, i: int, **values: float) -> None:
        """Write operands, and all others that stand in the same devices, of this loop too (D266)."""
        places = {device: values[name] for name, device in self._devices[i].items() if name in values}
        for j, devices in enumerate(self._devices):
            shared = {name: places[device] for name, device in devices.items() if device in places and name != "MV"}
            if j == i:
                self._put_operands(j, shared | values)
            elif shared:
                self._put_operands(j, shared)

    def _put_operands(self, i: int, values: Mapping[str, float]) -> None:
        """A mode that operands make takes effect with the next calculation, FALSE for PID_RUN at once."""
        config, state = self.configs[i], self.states[i]
        before, period = state.mode, state.period
        store_results(self._contents[i], state)
        self._contents[i] |= values
        configure_loop(config, state, self._contents[i], self._interval)
        if state.mode == 1 != before:
            state.previous_mode = before
        state.wanted_mode = self._mode(i)
        state.pending &= ~(bits.REQUEST | bits.HALTING)
        if state.wanted_mode != state.status & bits.MODES:
            state.pending |= bits.REQUEST | (bits.HALTING if state.wanted_mode == bits.OFF else 0)
        elif state.period != period and not state.pending & bits.STOPPED:
            change_rate(config, state)
        self._join_mout(i)

    def _show_signals(self, signals: MutableSequence[float]) -> None:
        """The signals that an operator's change affects at once."""
        for config, state in zip(self.configs, self.states, strict=True):
            show_signals(config, state, signals)

    @property
    def output_raises_pv(self) -> list[bool]:
        """Forward action: PV rises with MV."""
        return [bool(config.forward_action) for config in self.configs]

    @property
    def masters(self) -> list[int]:
        """The loop whose MV stands in the device of SV (D266)."""
        return [config.sv_writer for config in self.configs]

    def intended_mode(self, loop: int, signals: Sequence[float]) -> str:
        """What PID_RUN, PID_MODE and PID_MAN say."""
        return self.mode(self.states[loop].wanted_mode)

    def pv_range(self, loop: int) -> tuple[float, float] | None:
        """``pv.range``; no operand has it."""
        return self.scales[loop][:2] if self._has_range[loop] else None

    def output_limits(self, loop: int, signals: Sequence[float]) -> tuple[float, float]:
        """MV_MIN and MV_MAX."""
        return self.configs[loop].lowest_mv, self.configs[loop].highest_mv

    def dead_band(self, loop: int, signals: Sequence[float]) -> float:
        """ERR_DBW."""
        return self.configs[loop].dead_band

    # --- the PLC's switch --------------------------------------------------------------------------------------------

    def start(self, tick: int) -> None:
        """The PLC runs: instructions begin without a past (D687), an autotune from its beginning (D278)."""
        for config, state in zip(self.configs, self.states, strict=True):
            state.due = tick
            state.pending &= ~bits.STOPPED
            mode, state.status = state.status & bits.MODES, (state.status & ~bits.MODES) | bits.OFF
            enter_mode(config, state, mode)

    def stop(self, signals: MutableSequence[float]) -> None:
        """The PLC stops: no instruction is executed, and MV stays as it is (D278)."""
        for state in self.states:
            state.pending |= bits.STOPPED
            state.due = NEVER
            leave_notice(state, IS_STOPPED)

    # --- the operator ------------------------------------------------------------------------------------------------

    def request(self, loop: int, mode: str) -> None:
        """Write the operands that select a mode: PID_RUN, PID_MODE and PID_MAN (D275)."""
        state = self.states[loop]
        if mode == "off":
            self._write(loop, PID_RUN=False)
        elif mode == "autotune":
            self._write(loop, PID_RUN=True, PID_MODE=1)
        elif mode == "manual":
            self._write(loop, PID_RUN=True, PID_MAN=True)
        else:
            self._write(loop, PID_RUN=True, PID_MAN=False, PID_MODE=self._automatic_mode(loop))
        if mode == "manual" and state.wanted_mode == bits.TUNING:
            leave_notice(state, WAITS_FOR_TUNE, self.request_code(mode))
        elif not self.in_run and state.wanted_mode != state.status & bits.MODES:
            leave_notice(state, WAITS_FOR_PLC, self.request_code(mode))

    def autotune(self, loop: int, command: str) -> None:
        """``start`` writes 1 to PID_MODE, ``cancel`` what it was before."""
        state = self.states[loop]
        if command == "cancel":
            if state.mode != 1:
                leave_notice(state, TUNE_IDLE)
            self._write(loop, PID_MODE=self._automatic_mode(loop))
        elif state.mode == 1:
            leave_notice(state, TUNE_RUNS)
        else:
            self._write(loop, PID_MODE=1)
            if state.wanted_mode == bits.OFF:
                leave_notice(state, TUNE_WAITS)
            elif not self.in_run:
                leave_notice(state, TUNE_WAITS_FOR_PLC)

    def _automatic_mode(self, loop: int) -> int:
        """PID_MODE without an autotune."""
        state = self.states[loop]
        return state.previous_mode if state.mode == 1 else state.mode

    def tuning_result(self, loop: int) -> TuneReport | None:
        """How the last autotune of a loop went; None when there was none."""
        state = self.states[loop]
        running = bool(state.status & bits.TUNING)
        if not (running or state.tune_done):
            return None
        done, error = state.tune_done == DONE, state.tune_done == FAILED
        status = "running" if running else TUNE_STATUS[state.tune_done]
        if error:
            status = f"{status}: {REASONS[state.tune_reason].partition(': ')[2]}"
        results = state.tune_gain, state.tune_reset, state.tune_rate, state.tune_tf
        return self.tune_report(status, results, done=done, error=error)

    def memory(self, loop: int) -> Operands:
        """A loop's operands as they are after the last calculation."""
        store_results(self._contents[loop], self.states[loop])
        return self._contents[loop] | {"PV": self.states[loop].pv}

    def set_output(self, loop: int, value: Quantity, signals: MutableSequence[float]) -> None:
        """The MV that a loop starts with, and MOUT, which holds it in manual."""
        config, state = self.configs[loop], self.states[loop]
        self._write(loop, MOUT=float(value.value))
        if not state.status & bits.OFF:
            state.out = clamp(single(float(value.value)), config.lowest_mv, config.highest_mv)
        if config.mout_is_mv:
            state.mout = state.out
        self._show_signals(signals)

    def check_set(self, loop: int, path: tuple[str, ...], value: object) -> object:
        """The content that a ``set`` event makes of its operand; a ``PydanticCustomError`` says what is wrong."""
        name = KEYS.find(path).name
        content = mark_time(name, value, KEYS.check(path, value))
        if name == "Ti_Ki" and isinstance(content, Seconds) and not self._dependent[loop]:
            refuse(
                "set_value",
                f"{value} is a time, but the loop begins with PID_EQ FALSE, where Ti_Ki is the gain Ki in 1/s",
                help="write the gain as a bare number: Kp divided by the time in s",
            )
        return content

    def set(self, loop: int, path: tuple[str, ...], value: float, signals: MutableSequence[float]) -> str | None:
        """Write an operand; returns why it does not act as it stands, if so."""
        name = KEYS.find(path).name
        config, state = self.configs[loop], self.states[loop]
        if name == "Ti_Ki" and isinstance(value, Seconds) and not config.dependent:
            return "is not written: a time, but PID_EQ is FALSE now, and Ti_Ki the gain Ki in 1/s"
        self._write(loop, **{name: float(value) if isinstance(value, Seconds) else value})
        self._show_signals(signals)
        if isinstance(value, Seconds) and not config.dependent:
            return f"PID_EQ is FALSE: the time counts as a gain Kd of {float(value):g}"
        writer = self._writer(loop, name)
        if writer >= 0:
            return f"MV of {self.loops[writer]} stands in the same device and overwrites it"
        return missing_effect(name, config, state, self._contents[loop], self._interval)


load = Dpide


# --- The virtual Delta AS: what one scan of the program does for its DPIDE instructions -------------------------------
#
# Design. `scan` is called at every base step; it calculates the instructions whose sampling time has passed, and
# looks at PID_RUN in between. `sample` is one calculation of one loop: PV, mode, error and dead band, then autotune,
# algorithm or manual, and MOUT. Every result of the calculation is rounded to single precision (D265). Nothing here
# knows files, names or units: see `load` for how operands become `Config` and `State`.
#
# Signals of a loop (slots in `Config`): ``in_slot`` is read, in PV's unit; PV, SV, MV, MOUT, I_MV and E, the error as
# it counts, are written as the operands say.

__all__ = ["COST", "INLINED", "Config", "Dpide", "Options", "State", "load", "sample", "scan"]


def output_mout(config: Config, state: State) -> None:
    """MV is MOUT within its limits (D274)."""
    state.status |= LIMITED
    if state.mout > config.highest_mv:
        state.out = config.highest_mv
    elif state.mout < config.lowest_mv:
        state.out = config.lowest_mv
    else:
        state.out = state.mout
        state.status &= ~LIMITED


def fetch_operands(i: int, configs: list[Config], states: list[State]) -> None:
    """What other loops have written to the devices of this one's operands (D266), if they are executed at all."""
    config = configs[i]
    state = states[i]
    if config.sv_writer >= 0 and configs[config.sv_writer].halt == 0:
        state.sp = states[config.sv_writer].out
    if config.bias_writer >= 0 and configs[config.bias_writer].halt == 0:
        state.bias = states[config.bias_writer].out
    if config.mout_writer >= 0 and configs[config.mout_writer].halt == 0:
        state.mout = states[config.mout_writer].out


def sample(i: int, configs: list[Config], states: list[State], signals: list[float]) -> None:
    """One calculation of an instruction."""
    config = configs[i]
    state = states[i]
    state.pv = single(signals[config.in_slot])
    if state.pending & REQUEST:
        switch_mode(config, state)
    if state.status & OFF:
        signals[config.pv_slot] = finite_or(state.pv, 0.0)
        return
    fetch_operands(i, configs, states)
    # PID Block Diagram: SV, PV and REVERSE (PID_DIR), then DEAD BAND (ERR_DBW)
    raw_error = single(state.sp - state.pv) if config.forward_action else single(state.pv - state.sp)
    error = apply_dead_band(config, state, raw_error)
    state.error = error
    # PID_MODE 1; the algorithm; PID_MAN; MOUT_AUTO
    if state.status & TUNING:
        run_autotune(config, state, raw_error)
    if state.status & AUTO:
        calculate_mv(config, state, error)
    elif state.status & MANUAL:
        output_mout(config, state)
    if config.mout_follows or config.mout_is_mv:
        state.mout = state.out
    show_signals(config, state, signals)


def scan(tick: int, configs: list[Config], states: list[State], aux: list[float], signals: list[float]) -> None:
    """The program at ``tick``: instructions that are due (D685, D1016), and those whose PID_RUN is FALSE now (D266)."""
    for i in range(len(configs)):
        state = states[i]
        if state.pending & (HALTING | STOPPED) == HALTING:
            stop_block(configs[i], state)
            signals[configs[i].out_slot] = state.out
            signals[configs[i].mout_slot] = state.mout
        due = state.due
        if tick >= due:
            due += state.period
            state.due = due if due > tick else tick + state.period
            sample(i, configs, states, signals)


INLINED = (scan, sample, calculate_mv, calculate_slope, apply_dead_band, fetch_operands, show_signals)
"""The hot path of compiled code."""
COST = COSTS["dpide"]

# --- The operands of a virtual Delta AS by name, as a map puts them into registers ------------------------------------


class DpideRegisters(Registers):
    """All operands of all instructions."""

    def __init__(self, plc: Dpide) -> None:
        self.plc = plc
        rows = ROWS.values()
        self._rows = {f"{loop}.{row.name}": (i, row) for i, loop in enumerate(plc.loops) for row in rows}

    def loops_by_register(self) -> dict[Any, int]:
        """Every operand with its loop; of those in one device the one first that says what it holds (D266)."""
        return {name: self._rows[name][0] for name in sorted(self._rows, key=self._rank)}

    def _rank(self, name: str) -> int:
        """0 for MOUT in the device of MV, which an operator writes; 1 for MV, the PLC's; 2 for the others."""
        loop, row = self._rows[name]
        return 0 if row.name == "MOUT" and self.plc.configs[loop].mout_is_mv else 1 if row.name == "MV" else 2

    def contents(self, loop: int, signals: Sequence[float]) -> Mapping[Any, int]:
        """As the operands are after the last calculation."""
        held = self.plc.memory(loop)
        return self.contents_by_number(loop, {name: raw_of(row.type, held[name]) for name, row in ROWS.items()})

    def write(self, number: Any, raw: int, signals: MutableSequence[float]) -> WriteResult:
        """An operand that the program or an operator may write."""
        loop, row = self._rows[number]
        row = self.find_parameter(KEYS, number, row.name)
        content = self.decode(number, register_content, row.type, raw)
        if row.name == "PID_MODE" and content not in PID_MODES:
            raise RegisterError(NO_VALUE, f"{number}: {content} is none of {', '.join(map(str, PID_MODES))}")
        before = self.plc.intended_mode(loop, signals)
        value = float(content) if row.type.kind == "real" else int(content)
        late = self.plc.set(loop, (row.name,), value, signals)
        mode = self.plc.intended_mode(loop, signals)
        return WriteResult.setting(number, content_text(row.type, content), late, mode if mode != before else None)
