"""The virtual controller of neutral loops: from their parameters to a run, and what is done at each base step."""

from __future__ import annotations

from collections.abc import Callable, Mapping, MutableSequence, Sequence
from decimal import Decimal
from math import expm1
from typing import Any

from pidcfg.encoders.image import default_of
from pidcfg.encoders.maps.generic import LOOPS, REQUIRED_FIELDS, ROWS, TABLES
from pidcfg.encoders.parameters import Content, Parameter, read_content, store_content
from pidcfg.schemas.base import Quantity, limits_at, parse_off_seconds, parse_seconds
from pidcfg.schemas.generic import Loop
from pidcfg.schemas.numbers import refuse
from pidcfg.sim.controllers.generic import equation as bits
from pidcfg.sim.controllers.generic.equation import (
    AUTO,
    BUMPLESS,
    CASCADE,
    LIMITED,
    MANUAL,
    MANUAL_SET,
    MODES,
    NO_PAST,
    REQUEST,
    SLOWED,
    SP_SET,
    TRACKING,
    UNBOUNDED,
    Config,
    State,
    calculate_derivative,
    calculate_error,
    calculate_output,
    measure_pv,
    output_manual,
    renew_alarms,
    restore_integral,
    set_pulse,
)
from pidcfg.sim.controllers.kernels import add_notice, clamp, read_registers
from pidcfg.sim.controllers.plc import COUNTS_PER_RANGE, TICKS, NamedPlc
from pidcfg.sim.controllers.plc import ScanOptions as Options
from pidcfg.sim.controllers.settings import ContentParser, NamedKeys, parameters_of, parse_plain
from pidcfg.sim.costs import COSTS

# --- What a neutral loop tells the outside: names of modes, alarms and flags as bits, and notices in words ------------

MODE_BITS = {"manual": bits.MANUAL, "auto": bits.AUTO, "cascade": bits.CASCADE}
SIGNALS = {
    "in_slot": "",
    "pv_slot": "PV",
    "sp_slot": "SP",
    "out_slot": "OUT",
    "bias_slot": "BIAS",
    "pulse_slot": "PULSE",
}
"""Signals of a loop by their slots in `Config`; the measurement itself belongs to the plant."""
ALARM_BITS = {
    "high_high": bits.HIGH_HIGH,
    "low_low": bits.LOW_LOW,
    "high": bits.HIGH,
    "low": bits.LOW,
    "deviation_high_high": bits.DEVIATION_2,
    "deviation_high": bits.DEVIATION,
    "rate_of_change": bits.RATE,
}
ALARM_LIMITS = {
    "high_high": "high_high_at",
    "low_low": "low_low_at",
    "high": "high_at",
    "low": "low_at",
    "deviation_high_high": "deviation_2_at",
    "deviation_high": "deviation_at",
    "rate_of_change": "rate_at",
}
"""Where `Config` has the limit of each."""
OUTER_ALARMS = ("high_high", "low_low", "deviation_high_high")
FLAG_BITS = {
    "out_limited": bits.LIMITED,
    "rate_limited": bits.SLOWED,
    "tracking": bits.TRACKING,
    "in_deadband": bits.IN_DEAD_BAND,
}
NO_SOURCE = 32
MODE_CODES = (NO_SOURCE,)
"""Reasons that concern a requested mode."""
REASONS = {
    NO_SOURCE: "refused: the loop has no setpoint.source",
    bits.OUTPUT_JUMPS: "OUT jumps: without an integral time nothing can carry it on",
}

# --- What a scenario's ``set`` may write in a running neutral loop: its fields, by their keys in the file -------------
#
# Short forms: ``setpoint`` is setpoint.value, ``output`` the output in manual.

RANGE_IS_FIXED = "scales do not change in a running loop"
UNSETTABLE_FIELDS = {
    "pv.range": RANGE_IS_FIXED,
    "pv.range.0": RANGE_IS_FIXED,
    "pv.range.1": RANGE_IS_FIXED,
    "output.range": RANGE_IS_FIXED,
    "output.range.0": RANGE_IS_FIXED,
    "output.range.1": RANGE_IS_FIXED,
    "setpoint.source": "who the master is does not change in a running loop",
    "output.pulse.period": "it is the plant's wiring",
}
"""Fields that cannot be set, and why."""
OFF_FIELDS = ("tuning.integral_time", "tuning.derivative_time")
"""Times that may be `off`."""


def non_negative_parser(path: str, parse: Callable[[object], Decimal]) -> ContentParser:
    """A parser that also refuses what the schema's limits refuse; a sample time and a period are above 0."""

    def parse_non_negative(value: object) -> Decimal:
        number = parse(value)
        if number < 0 or (path == "sample_time" and not number):
            refuse("set_value", f"{path} is {number}; it is {'above' if path == 'sample_time' else 'at least'} 0")
        return number

    return parse_non_negative


def parser_of(path: str) -> ContentParser | None:
    """How a field is written; None: as its type tells."""
    limits = None if path.rpartition(".")[2].isdigit() else limits_at(Loop, path)
    if limits is None:
        return None
    time = parse_off_seconds if path in OFF_FIELDS else parse_seconds
    return non_negative_parser(path, time if limits.unit == "s" else parse_plain)


KEYS = NamedKeys(
    parameters_of(TABLES, (*UNSETTABLE_FIELDS, "mode")),
    {"setpoint": "setpoint.value", "output": "output.manual"},
    {"mode": "mode"},
    UNSETTABLE_FIELDS,
    {path: parser for path in ROWS if (parser := parser_of(path)) is not None},
)


# --- From the parameters of a neutral loop to the numbers that it calculates with -------------------------------------

Fields = dict[str, Any]
"""Content by path; a field that the configuration leaves out is missing."""
FALLBACKS: Fields = {"sample_time": 1.0, "pv.range.1": 100.0, "output.range.1": 100.0}
"""What is taken for a field that every loop has and a listing lacks, where that is not the nothing of its type."""


def _default_content(row: Parameter) -> Content | None:
    value = default_of(Loop, row.name)
    if value is not None:
        return store_content(row.type, value)
    return FALLBACKS.get(row.name, row.type.default) if row.name in REQUIRED_FIELDS else None


DEFAULTS: Fields = {name: value for name, row in ROWS.items() if (value := _default_content(row)) is not None}
"""What fields hold that the file does not give; the others are missing then."""


def fields_of(words: Mapping[str, Any], loop: str) -> tuple[Fields, list[str]]:
    """The parameters of a loop; what a listing lacks and every loop has, and what is no value, is a problem."""
    fields = dict(DEFAULTS)
    problems: list[str] = []
    for path, row in ROWS.items():
        raw = words.get(f"{loop}.{path}")
        content = None if raw is None else read_content(row.type, raw)
        if content is not None:
            fields[path] = content
        elif raw is not None or path in REQUIRED_FIELDS:
            what = "is missing" if raw is None else f"is no {row.type.name}"
            problems.append(f"{path} {what}, {DEFAULTS.get(path, 'nothing')} is taken")
    return fields, problems


def ticks(seconds: float) -> int:
    """A sample time in ticks, one at least."""
    return max(1, round(seconds * TICKS))


def filter_share(time: float, seconds: float) -> float:
    """What a filter with this time constant takes of a difference in each sample."""
    return -expm1(-seconds / time) if time > 0.0 else 1.0


def first_field(f: Fields, *paths: str) -> float:
    """The first of some fields that the loop has."""
    return next(float(f[path]) for path in paths if path in f)


def configure_loop(config: Config, state: State, f: Fields) -> None:
    """From the parameters to the records of a loop."""
    read_registers(config, f)
    state.period = ticks(f["sample_time"])
    seconds = state.period / TICKS
    config.pv_span = (f["pv.range.1"] - f["pv.range.0"]) or 1.0
    config.out_span = (f["output.range.1"] - f["output.range.0"]) or 1.0
    config.limit_low = first_field(f, "output.limits.0", "output.range.0")
    config.limit_high = first_field(f, "output.limits.1", "output.range.1")
    config.rate_limit = f.get("output.max_rate", UNBOUNDED) * seconds
    config.rate_at = f.get("alarms.rate_of_change", UNBOUNDED) * seconds
    config.has_pulses = int(f.get("output.pulse.period", 0.0) > 0.0)
    config.cycle = float(ticks(f.get("output.pulse.period", 1.0)))
    config.min_on, config.min_off = f["output.pulse.min_on"] * TICKS, f["output.pulse.min_off"] * TICKS
    set_factors(state, f, seconds)


def set_factors(state: State, f: Fields, seconds: float) -> None:
    """Of the equation and its filters."""
    read_registers(state, f)
    state.kp = state.gain
    state.ki = state.gain * seconds / state.reset if state.reset > 0.0 else 0.0
    state.kd = state.gain * state.rate / seconds
    state.pv_share = filter_share(f["pv.filter"], seconds)
    state.derivative_share = filter_share(f["tuning.derivative_filter"], seconds)


def missing_effect(path: str, f: Fields, *, is_manual: bool) -> str | None:
    """Why a field that has just been written does not act as it stands, if so."""
    if path == "output.manual" and not is_manual:
        return "output.manual acts in manual only, which keeps the output when it begins"
    if path.startswith("output.pulse.") and "output.pulse.period" not in f:
        return "there is no pulse output: output.pulse.period is not given"
    return None


# --- The virtual controller of neutral loops: built from their parameters, operated as by an operator -----------------


class Generic(NamedPlc):
    """Neutral loops as loaded from their parameters; they always run."""

    configs: Sequence[Config]
    states: Sequence[State]
    table, keys, sample_key = LOOPS, KEYS, "sample_time"
    config, state, slots = Config, State, SIGNALS
    out_name = "OUT"
    pulses: Sequence[str] = ("PULSE",)
    modes: Mapping[str, int] = MODE_BITS
    alarm_bits: Mapping[str, int] = ALARM_BITS
    alarm_limits: Mapping[str, str] = ALARM_LIMITS
    no_limit = bits.UNBOUNDED
    flag_bits: Mapping[str, int] = FLAG_BITS
    reasons: Mapping[int, str] = REASONS
    mode_codes = MODE_CODES
    outer_alarms = OUTER_ALARMS

    def contents_of(self, words: Mapping[str, Any], loop: str) -> tuple[Fields, list[str]]:
        """The fields of a loop, and which are missing or no value."""
        return fields_of(words, loop)

    def prepare(self) -> None:
        """Who is whose master, whose set point follows its PV, and the scales."""
        for config, entry in zip(self.configs, self._settings, strict=True):
            setpoint = dict(entry.get("setpoint", {}))
            source = setpoint.get("source")
            config.master = self.loops.index(source) if source in self.loops else -1
            config.sp_follows_pv = int(bool(setpoint.get("follows_pv")))
        for i, config in enumerate(self.configs):
            config.first_slave = next((j for j, other in enumerate(self.configs) if other.master == i != j), -1)
        self.scales = [(f["pv.range.0"], f["pv.range.1"], COUNTS_PER_RANGE) for f in self._contents]

    def begin(self, loop: int) -> None:
        """What a loop starts with (D301): its mode, its set point and output."""
        config, state, fields = self.configs[loop], self.states[loop], self._contents[loop]
        configure_loop(config, state, fields)
        if not config.has_pulses:
            self.signals[config.pulse_slot] = ""
        mode = fields["mode"]
        state.status = bits.AUTO if mode == "cascade" and config.master < 0 else MODE_BITS[mode]
        state.wanted_mode, state.pending = state.status, bits.NO_PAST
        state.sp = clamp(fields.get("setpoint.value", config.pv_low), config.sp_low, config.sp_high)
        start = fields.get("output.manual", 0.0) if state.status & bits.MANUAL else 0.0
        state.out = state.manual_output = clamp(start, config.limit_low, config.limit_high)
        if "output.max_rate" in fields and not state.status & bits.MANUAL:
            state.out = 0.0  # as MV of a NextoPID block before its first call (D223)
        self._show_signals(loop, self.signal_values)

    def sample_ticks(self, value: Any) -> int:
        """The sample time."""
        return ticks(value)

    @property
    def output_raises_pv(self) -> list[bool]:
        """Whether the PV rises with the output."""
        return [bool(config.output_raises_pv) for config in self.configs]

    @property
    def masters(self) -> list[int]:
        """The loops that ``setpoint.source`` names."""
        return [config.master for config in self.configs]

    def output_limits(self, loop: int, signals: Sequence[float]) -> tuple[float, float]:
        """``output.limits``, or the range."""
        return self.configs[loop].limit_low, self.configs[loop].limit_high

    def given_set_point(self, loop: int, signals: Sequence[float]) -> float:
        """``setpoint.value``."""
        return float(self._contents[loop].get("setpoint.value", signals[self.configs[loop].sp_slot]))

    def inner_deviation(self, loop: int) -> float | None:
        """``alarms.deviation.high``."""
        limit = self.configs[loop].deviation_at
        return None if limit >= bits.UNBOUNDED else limit

    def dead_band(self, loop: int, signals: Sequence[float]) -> float:
        """``deadband``."""
        return self.configs[loop].deadband

    def pulse_cycle(self, loop: int) -> float:
        """The period of the pulses."""
        return self.configs[loop].cycle / TICKS if self.configs[loop].has_pulses else 0.0

    def _show_signals(self, i: int, signals: MutableSequence[float]) -> None:
        """The signals that an operator's change affects at once."""
        config, state = self.configs[i], self.states[i]
        signals[config.sp_slot], signals[config.out_slot], signals[config.bias_slot] = (
            state.sp,
            state.out,
            state.bias + state.integral,
        )

    # --- the operator ------------------------------------------------------------------------------------------------

    def request(self, loop: int, mode: str) -> None:
        """A mode for the next sample; cascade needs a source."""
        state = self.states[loop]
        if mode == "cascade" and self.configs[loop].master < 0:
            state.notice = add_notice(state.notice, MODE_BITS[mode], NO_SOURCE)
            return
        state.wanted_mode = MODE_BITS[mode]
        state.pending &= ~(bits.MANUAL_SET | bits.SP_SET)
        state.pending = (
            state.pending & ~bits.REQUEST if state.status & state.wanted_mode else state.pending | bits.REQUEST
        )

    def set_output(self, loop: int, value: Quantity, signals: MutableSequence[float]) -> None:
        """The output that a loop starts with, in every mode."""
        config, state = self.configs[loop], self.states[loop]
        state.out = state.manual_output = clamp(float(value.value), config.limit_low, config.limit_high)
        state.pending |= bits.BUMPLESS
        self._show_signals(loop, signals)

    def set(self, loop: int, path: tuple[str, ...], value: Any, signals: MutableSequence[float]) -> str | None:
        """Write a field; returns why it does not act as it stands, if so."""
        name = KEYS.find(path).name
        config, state, fields = self.configs[loop], self.states[loop], self._contents[loop]
        fields[name] = value
        configure_loop(config, state, fields)
        if name == "setpoint.value":
            if state.status & bits.CASCADE:
                return "in cascade the set point is the master's output"
            state.sp = clamp(value, config.sp_low, config.sp_high)
            state.pending |= bits.SP_SET if state.pending & bits.REQUEST else 0
        elif name == "output.manual" and state.wanted_mode == bits.MANUAL:
            state.manual_output = value
            state.pending |= bits.MANUAL_SET
        self._show_signals(loop, signals)
        return missing_effect(name, fields, is_manual=state.wanted_mode == bits.MANUAL)


load = Generic


__all__ = ["COST", "INLINED", "Config", "Generic", "Options", "State", "load", "sample", "scan"]


def switch_mode(config: Config, state: State) -> None:
    """The requested mode takes effect, without a bump (D301)."""
    if state.wanted_mode == MANUAL and not state.status & MANUAL:
        if state.pending & MANUAL_SET == 0:
            state.manual_output = state.out
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
    state.pending &= ~NO_PAST
    state.status &= ~TRACKING
    if state.status & MANUAL:
        output_manual(config, state, proportional_term, derivative_term)
    elif tracks_slave(i, configs, states):
        state.status = (state.status & ~(LIMITED | SLOWED)) | TRACKING
        state.out = clamp(states[config.first_slave].sp, config.limit_low, config.limit_high)
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
            set_pulse(tick, configs[i], state, signals)


INLINED = (scan, sample, measure_pv, calculate_error, calculate_derivative, calculate_output, renew_alarms)
"""The hot path of compiled code."""
COST = COSTS["generic"]
