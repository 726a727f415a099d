"""The virtual DL06: V-memory and the records that the controller has latched from it, and its place in a run."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, MutableSequence, Sequence
from dataclasses import dataclass, fields
from decimal import Decimal
from math import sqrt
from typing import Any

from pidcfg.encoders.codecs import Scale
from pidcfg.encoders.dl06.image import Setup, check_setup, intended_mode
from pidcfg.encoders.image import Image, default_name
from pidcfg.encoders.maps.dl06 import (
    CPU,
    FORMATS,
    LOOP_COUNT,
    LOOP_TABLE,
    LOOP_TABLES,
    RAMP_SOAK_SIZE,
    READ_DELAYS,
    TABLE_POINTER,
)
from pidcfg.encoders.regmap import Point
from pidcfg.schemas.base import Quantity
from pidcfg.schemas.numbers import refuse
from pidcfg.sim.controllers.dl06 import equation as bits
from pidcfg.sim.controllers.dl06 import operate as dl06_modes
from pidcfg.sim.controllers.dl06.autotune import POINTS, REQUESTED, TUNE_RUNS, change_rate, stop_tune
from pidcfg.sim.controllers.dl06.equation import (
    SLOW_PERIOD,
    BadWord,
    Config,
    State,
    Values,
    alarm_error,
    calculate_gains,
    configure_loop,
    decode_loop,
    decode_profile,
    major_of,
    read_profile,
    set_gains,
    show_signals,
    ticks,
    write_state,
)
from pidcfg.sim.controllers.dl06.operate import (
    ALARM_BITS,
    ALARM_LIMITS,
    AUX_BITS,
    CASCADE_FROM,
    COMMANDS,
    FLAG_BITS,
    MODE_BITS,
    OUTER_ALARMS,
    REASONS,
    SIGNALS,
    encode_setting,
    find_rows,
    parse_setting,
    refuse_misfit,
    stored_rate,
)
from pidcfg.sim.controllers.kernels import NEVER, tell_request
from pidcfg.sim.controllers.plc import TICKS, CountsPlc, low_and_width
from pidcfg.sim.controllers.settings import items_of
from pidcfg.sim.engine.expressions import BadValue
from pidcfg.sim.judgement.report import ScanTime, TuneReport
from pidcfg.text.frozen import frozen
from pidcfg.text.references import DL06

# ----------------------------------------------------------------------------------------------------------------------
# How much the loops lengthen the PLC's scan, by the formula of the manual ("PID Loop Effect on CPU Scan Time").

SCAN_TIME_EFFECT = DL06.cite("PID Loop Effect on CPU Scan Time")
CALCULATION_SECONDS = (150e-6, 250e-6, 350e-6)
"""Seconds of one loop calculation: minimum, typical, maximum; it depends on the options that are selected."""


def scan_time(without_loops: float, sample_rates: Iterable[float]) -> ScanTime:
    """The scan time without loops, plus for each loop (scan time / sample rate) x calculation time."""
    loop_share = sum(without_loops / rate for rate in sample_rates)
    low, typical, high = (without_loops + loop_share * seconds for seconds in CALCULATION_SECONDS)
    return ScanTime(low, typical, high)


# --- The words of one DL06 loop, as they stand in memory and as the controller has last read them ---------------------
#
# Some words are read only when an alarm's enable bit goes from 0 to 1, some only when the CPU changes its mode; a
# value that is written to one of them changes the memory and nothing else until then.

READ_ON_ENABLE = "no*"
"""The manual's mark of a word that is read only when its alarm's enable bit goes from 0 to 1."""

WORDS_BY_ENABLE = {
    "alarms.pv.enabled": ("alarms.pv.", "alarms.hysteresis"),
    "alarms.deviation.enabled": ("alarms.deviation.", "alarms.hysteresis"),
    "alarms.rate_of_change_enabled": ("alarms.rate_of_change",),
}
"""Which words an alarm's enable bit makes the controller read when it goes from 0 to 1 (D682)."""


@dataclass(slots=True)
class Loop:
    """A loop's words, and what no word holds."""

    name: str
    initial_mode: str
    pv_range: tuple[Decimal, Decimal] | None
    out_range: tuple[Decimal, Decimal] | None
    decimals: int
    """Implied decimals of the reset word."""
    memory: list[int]
    read_words: list[int]
    values: Values
    """Decoded from the words that have been read; quantities in counts."""
    results_stored: bool = True
    """The results of the last auto-tune have been written to the words."""
    results: Sequence[float] = ()
    """Results of the last auto-tune, in the order of `tuned_words`."""
    has_setpoint: bool = True
    """Whether the configuration gives a set point; it may leave that to the operator."""

    def scales(self) -> dict[str, Scale]:
        """The scales of the loop's words in engineering units."""
        pv = FORMATS[self.values["pv.format"]]
        output = FORMATS[self.values["output.format"] or self.values["pv.format"]]
        root = self.values["pv.square_root"]
        return {
            "pv": Scale(pv, self.pv_range),
            "sp": Scale(pv, self.pv_range, root),
            "output": Scale(output, self.out_range),
        }

    def reread(self, *, alarms: bool) -> None:
        """Read the words at a change of the CPU's mode; those of the alarms at the change to Run only (D648)."""
        old = self.read_words[:]
        self.read_words[:] = self.memory
        for word in () if alarms else LOOP_TABLE.words:
            if word.read_when == READ_ON_ENABLE:
                self.read_words[word.offset] = old[word.offset]
        self.decode()

    def decode(self) -> None:
        """Renew the values from the words that have been read."""
        self.values, _ = decode_loop(self.read_words, self.decimals)

    def store(self, row: Point, word: int) -> str | None:
        """Write raw content, of a choice its bits in place; returns why the controller does not know it yet, if so."""
        word |= self.memory[row.offset] & ~row.mask
        rose = word & ~self.memory[row.offset]
        self.memory[row.offset] = word
        if row.read_when in READ_DELAYS:
            return f"+{row.offset:02o} {READ_DELAYS[row.read_when]}"
        self.read_words[row.offset] = word
        if rose:
            self._read_alarms(str(row.path))
        self.decode()
        return None

    def _read_alarms(self, path: str) -> None:
        for start in WORDS_BY_ENABLE.get(path, ()):
            for word in LOOP_TABLE.words:
                if str(word.path).startswith(start):
                    self.read_words[word.offset] = self.memory[word.offset]

    def store_results(self, config: Config, state: State) -> None:
        """Put what an auto-tune has written into the words."""
        if self.results_stored or not state.tune_done:
            return
        self.results_stored = True
        results = tuned_words(config, state)
        self.results = [float(value) for value in results.values()]
        for name, value in results.items():
            word = LOOP_TABLES[self.decimals].find_word(name)
            self.memory[word.offset] = self.read_words[word.offset] = word.encode(value)
        self.decode()


def loop_of(
    words: Mapping[int, int], start: int, entry: Mapping[str, Any], decimals: int
) -> tuple[Loop, list[BadWord]]:
    """A loop from the memory at ``start`` and its entry in the image's settings; its words that have no value.

    Those of its ramp/soak table count where the generator is enabled.
    """
    memory = [words.get(start + k, 0) for k in range(LOOP_TABLE.size)]
    values, problems = decode_loop(memory, decimals)
    pv, out = entry.get("pv") or {}, entry.get("output") or {}
    goal = intended_mode(memory[LOOP_TABLE.offset_of("mode_and_alarm_status")], entry.get("mode", "manual"))
    loop = Loop(entry["loop"], goal, pv_ends(pv), pv_ends(out), decimals, memory, memory[:], values)
    loop.has_setpoint = entry.get("setpoint") is not False
    if values["ramp_soak.enabled"]:
        table = [words.get(values["ramp_soak.table"] + k, 0) for k in range(RAMP_SOAK_SIZE)]
        for _, wrong in decode_profile(table, values):
            problems += [BadWord(f"ramp/soak table {one.text}", one.is_setting) for one in wrong]
    return loop, problems


def tuned_words(config: Config, state: State) -> dict[str, Decimal]:
    """What an auto-tune writes, by register."""
    results = {
        "gain": state.gain,
        "reset": state.reset / config.reset_unit,
        "rate": state.rate,
        "sample_rate": state.period / TICKS,
    }
    return {name: Decimal(f"{value:.2f}") for name, value in results.items()}


def pv_ends(settings: Mapping[str, Any]) -> tuple[Decimal, Decimal] | None:
    """The engineering range of a settings entry."""
    pair = settings.get("range")
    return None if pair is None else (Decimal(str(pair[0])), Decimal(str(pair[1])))


# --- The virtual DL06: built from V-memory words, operated as by its operator, its ladder and the CPU switch ----------


@frozen
class Options:
    """What a scenario chooses about the PLC; no word holds it."""

    auto_interlock: bool = True
    """A PV alarm refuses a request for Auto."""
    scan_time: int = 0
    """Length of a scan in ticks (D641); 0: every base step has time for all loops."""
    step_bias: bool = False
    """Set-point changes move the bias in proportion."""
    number_of_loops: int | None = None
    """What V7641 gets instead of the image's count."""


class Dl06(CountsPlc):
    """A DL06 as loaded from its words; what none holds (names, ranges, intended modes) the image's settings say."""

    configs: list[Config]
    states: list[State]
    out_name = "OUT"
    error_format = "0x{:04X}"
    modes: Mapping[str, int] = MODE_BITS
    options = tuple(f.name for f in fields(Options))
    commands: Mapping[str, Sequence[str]] = {
        "ramp_soak": tuple(COMMANDS),
        "autotune": ("start",),
        "plc": ("program", "run"),
    }
    tuned_names = ("gain", "reset", "rate", "sample_rate")
    alarm_bits: Mapping[str, int] = ALARM_BITS
    alarm_limits: Mapping[str, str] = ALARM_LIMITS
    no_limit = bits.UNBOUNDED
    flag_bits: Mapping[str, int] = FLAG_BITS
    aux_bits: Mapping[str, int] = AUX_BITS
    reasons: Mapping[int, str] = REASONS
    outer_alarms = OUTER_ALARMS
    error_flags = ("alarm_programming_error",)
    tuning_flags = ("autotune_running",)

    def __init__(self, image: Image, options: Options | None = None) -> None:
        self._words, self._options, self._plc = image.words, options or Options(), image.plc
        self.problems: list[BadValue] = []
        if self._options.number_of_loops is not None:
            self._words[LOOP_COUNT] = int(str(self._options.number_of_loops), 16)
        self._setup = self._check_setup()
        count = len(image.settings) or min(self._setup.count, CPU.loops)
        self._loops = [self._load_loop(i, image) for i in range(count)]
        self.loops = [loop.name for loop in self._loops]
        self.initial_modes = [loop.initial_mode for loop in self._loops]
        self.place_loops(Config, State, SIGNALS, RAMP_SOAK_SIZE + POINTS)
        for i in range(count):
            self._begin_loop(i)
        self.in_run = False
        self.run(0)
        self.scale_loops()

    @property
    def words(self) -> Mapping[int, int]:
        """V-memory as it was loaded, and what was written outside of the loop table since."""
        return self._words

    def memory(self, loop: int) -> Loop:
        """A loop's words as they are after the last scan; what the controller writes all the time is in its state."""
        self._loops[loop].store_results(self.configs[loop], self.states[loop])
        return self._loops[loop]

    def write_outside_table(self, number: int, raw: int) -> None:
        """Writes a word outside of the loop table; of a ramp/soak table it counts at once."""
        self._words[number] = raw
        for i, loop in enumerate(self._loops):
            if 0 <= number - loop.values["ramp_soak.table"] < RAMP_SOAK_SIZE:
                self._apply_words(i)

    def _check_setup(self) -> Setup:
        return check_setup(self._words.get(TABLE_POINTER, 0), self._words.get(LOOP_COUNT, 0))

    def _load_loop(self, i: int, image: Image) -> Loop:
        entry = {"loop": default_name(i), **(image.settings[i] if i < len(image.settings) else {})}
        decimals = int(image.plc.get("reset_decimals", 1))
        start = self._words.get(TABLE_POINTER, 0) + i * LOOP_TABLE.size
        loop, problems = loop_of(self._words, start, entry, decimals)
        self.problems += [BadValue(i, text, setting) for text, setting in problems]
        return loop

    def _begin_loop(self, i: int) -> None:
        """What a loop starts with: the controller's words, its goal, and its places in the shared vectors."""
        config, state, v = self.configs[i], self.states[i], self._loops[i].values
        config.rs_table = i * RAMP_SOAK_SIZE
        config.tune_buffer = len(self._loops) * RAMP_SOAK_SIZE + i * POINTS
        config.interlock, config.step_bias = int(self._options.auto_interlock), int(self._options.step_bias)
        config.derivative_on_pv = int(self._plc.get("derivative") == "pv")
        self._apply_words(i)
        for path in ("setpoint.value", "state.pv", "state.bias", "state.output"):
            write_state(state, v, path)
        state.goal = 0 if self.initial_modes[i] == "manual" else MODE_BITS[self.initial_modes[i]]
        state.goal_has_sp = int(self._loops[i].has_setpoint)
        state.pending |= bits.GOAL if state.goal else 0
        if not (v["ramp_soak.enabled"] or v["ramp_soak.table"]):
            self.signals[config.step_slot] = ""
        state.rs_command = COMMANDS.get(v["ramp_soak.request"], 0)
        state.pending |= bits.SOAK if state.rs_command else 0
        if v["autotune.start"]:
            self._start_tune(i)
        self._show_signals(i, self.signal_values)

    def _apply_words(self, i: int) -> None:
        """Make the words that the controller has read its configuration."""
        words, config, state = self._loops[i], self.configs[i], self.states[i]
        v = words.values
        form, period = config.velocity, state.period
        configure_loop(config, v, words.decimals, self._setup.count)
        state.pending |= bits.NO_PAST if config.velocity != form else 0  # another form has no past (D681)
        config.halt = int(config.halt or not self._setup.is_running or i >= self._setup.count)
        config.slow = int(self._options.scan_time > 0 and config.period > SLOW_PERIOD)
        self._follow_pointer(i)
        config.pv_low, config.pv_width = low_and_width(words.pv_range, config.pv_min, config.pv_span)
        config.out_low, config.out_width = low_and_width(words.out_range, config.out_min, config.out_span)
        table = [self._words.get(v["ramp_soak.table"] + k, 0) for k in range(RAMP_SOAK_SIZE)]
        for at, value in enumerate(read_profile(table, v), config.rs_table):
            self.aux[at] = value
        set_gains(config, state, v, words.decimals)
        if config.halt or state.period != period:
            change_rate(state)
        calculate_gains(config, state)
        state.alarm_band_low, state.alarm_band_high = bits.UNBOUNDED, -bits.UNBOUNDED
        state.status &= ~bits.ALARM_ERROR
        if alarm_error(v):
            state.status |= bits.ALARM_ERROR
            state.pending |= 0 if state.status & bits.MANUAL else bits.TRIP

    def _follow_pointer(self, i: int) -> None:
        """Whose output is a loop's remote set point; a loop in Cascade that loses it goes to Manual (D66)."""
        pointer, start = self._loops[i].values["remote_setpoint"] or 0, self._words.get(TABLE_POINTER, 0)
        major = major_of(pointer, start, len(self._loops), i)
        if major < 0 and self.states[i].status & bits.CASCADE:
            dl06_modes.to_manual(i, self.configs, self.states, dl06_modes.OVERRIDE_NO_REMOTE)
        self.configs[i].major = major

    def _start_tune(self, i: int) -> None:
        """Bit 7 of +01 goes on."""
        words, state = self._loops[i], self.states[i]
        state.requested_mode = 0
        if state.status & bits.TUNING:
            tell_request(state, TUNE_RUNS)
        elif self._is_calculated(i):
            words.store_results(self.configs[i], state)
            words.results_stored = False
            state.tune_done = 0
            state.tune_phase = REQUESTED
            state.pending |= bits.TUNE

    def _is_calculated(self, i: int) -> bool:
        """Whether a loop is calculated at all; leaves a notice when it is not."""
        state = self.states[i]
        if self.configs[i].halt:
            tell_request(state, dl06_modes.REFUSED_OFF)
        elif state.pending & bits.STOPPED:
            tell_request(state, dl06_modes.REFUSED_PROGRAM)
        else:
            return True
        return False

    def _show_signals(self, i: int, signals: MutableSequence[float]) -> None:
        """The signals of a loop as its words say."""
        show_signals(self.configs[i], self.states[i], signals)

    @classmethod
    def is_about_mode(cls, requested_mode: int, reason: int) -> bool:
        """Whether a notice concerns the mode: a refusal if a mode was requested, an override always."""
        return reason in dl06_modes.MODE_REASONS and bool(requested_mode or reason > dl06_modes.LAST_REFUSAL)

    @classmethod
    def profile_step(cls, aux_status: int) -> str:
        """The step byte of the ramp/soak word: odd steps are ramps, even ones soaks."""
        step = aux_status // bits.RS_STEP
        return f"{step} {'ramp' if step % 2 else 'soak'}" if step else ""

    # --- the CPU -----------------------------------------------------------------------------------------------------

    @property
    def output_raises_pv(self) -> list[bool]:
        """Direct action: the PV rises with the output."""
        return [not config.reverse for config in self.configs]

    @property
    def masters(self) -> list[int]:
        """The major loops, as the remote set point pointers name them."""
        return [config.major for config in self.configs]

    def output_limits(self, loop: int, signals: Sequence[float]) -> tuple[float, float]:
        """+30 and +31, within the data range."""
        config = self.configs[loop]
        scale = config.out_width / config.out_span
        return config.out_low + (config.output_low_limit - config.out_min) * scale, config.out_low + (
            config.output_high_limit - config.out_min
        ) * scale

    def alarm_level(self, loop: int, alarm: str) -> float | None:
        """The counts of a limit on the scale of the PV, which the signal before a root has, too."""
        counts, config = super().alarm_level(loop, alarm), self.configs[loop]
        if counts is None:
            return None
        scale = config.pv_width / config.pv_span
        return config.pv_low + (counts - config.pv_min) * scale if alarm.startswith("pv_") else counts * scale

    def inner_deviation(self, loop: int) -> float | None:
        """The yellow deviation alarm; of a root it has another scale than the PV."""
        config = self.configs[loop]
        is_off = config.square_root or config.yellow >= bits.UNBOUNDED
        return None if is_off else config.yellow * config.pv_width / config.pv_span

    def dead_band(self, loop: int, signals: Sequence[float]) -> float:
        """+23, which is compared with the squared error where that is on."""
        config = self.configs[loop]
        return (sqrt(config.deadband) if config.squared else config.deadband) * config.pv_width

    def set_up_errors(self, loop: int) -> Iterator[str]:
        """Words that are no value of their format, and the ramp/soak programming errors that +35 has had."""
        yield from super().set_up_errors(loop)
        if self.states[loop].rs_errors:
            yield f"ramp/soak programming error, +35 = 0x{self.states[loop].rs_errors:04X}"

    @property
    def running(self) -> bool:
        """Whether the loop task runs."""
        return self._setup.is_running

    @property
    def error_words(self) -> Mapping[str, int]:
        """V7642."""
        return {"V7642": self._setup.flags}

    def scan_time(self, without_loops: float) -> ScanTime:
        """The length of a scan with the loops that are calculated, in s."""
        return scan_time(without_loops, [period / TICKS for period in self.periods if period])

    def start(self, tick: int) -> None:
        """The program-to-run transition: all words are read, loops begin anew and return to their modes (D49, D648)."""
        self._setup = self._check_setup()
        for i, loop in enumerate(self._loops):
            config, state = self.configs[i], self.states[i]
            loop.store_results(config, state)
            loop.reread(alarms=True)
            self._apply_words(i)
            state.due = NEVER if config.halt else tick
            if state.pending & bits.STOPPED and state.prior_mode != bits.MANUAL:
                state.pending |= bits.RESTORE
            state.pending &= ~(bits.STOPPED | bits.PV_STALE | bits.OUTPUT_CUT | bits.PROGRAM)
            state.pending |= bits.FIRST_SAMPLE

    def stop(self, signals: MutableSequence[float]) -> None:
        """The CPU stops: loops go to Manual and are not calculated, except those that are independent of its mode.

        Output modules turn off at once, but for those that an independent loop writes itself (D49).
        """
        for i, (config, state) in enumerate(zip(self.configs, self.states, strict=True)):
            self._loops[i].store_results(config, state)
            self._loops[i].reread(alarms=False)
            self._apply_words(i)
            if config.independent:
                state.pending |= bits.PROGRAM
                state.pending |= 0 if config.fetches_pv else bits.PV_STALE
                state.pending |= 0 if config.carries_output else bits.OUTPUT_CUT
            else:
                state.prior_mode = state.status & bits.MODES
                state.pending |= bits.STOPPED
                stop_tune(state)
        for state in self.states:
            if state.pending & bits.STOPPED and state.prior_mode != bits.MANUAL:
                state.requested_mode = 0
                state.status = (state.status & ~bits.MODES) | bits.MANUAL
                tell_request(state, dl06_modes.OVERRIDE_PROGRAM)
        for config, state in zip(self.configs, self.states, strict=True):
            if state.pending & bits.STOPPED and state.prior_mode & bits.CASCADE:
                # an independent major loop does not go on alone (D680)
                dl06_modes.to_manual(config.major, self.configs, self.states, dl06_modes.OVERRIDE_MINOR)
        for i in range(len(self.states)):
            self._show_signals(i, signals)

    # --- the operator ------------------------------------------------------------------------------------------------

    def request(self, loop: int, mode: str) -> None:
        """A one-shot mode request; it takes the place of the configured one, granted or not (D68, D643)."""
        state = self.states[loop]
        state.requested_mode = MODE_BITS[mode]
        if state.pending & bits.GOAL and not self.configs[loop].halt:
            tell_request(state, dl06_modes.GIVEN_UP)
        state.goal = 0
        state.pending &= ~bits.GOAL
        if self._is_calculated(loop):
            state.request = MODE_BITS[mode]
            state.pending |= bits.REQUEST

    def ramp_soak(self, loop: int, command: str) -> None:
        """``start``, ``hold``, ``resume`` or ``jog``: a control bit of +33 goes on."""
        state = self.states[loop]
        state.requested_mode = 0
        if self._is_calculated(loop):
            state.rs_command |= COMMANDS[command]
            state.pending |= bits.SOAK

    def autotune(self, loop: int, command: str = "start") -> None:
        """``start``: bit 7 of +01 goes on."""
        self._start_tune(loop)

    def tuning_result(self, loop: int) -> TuneReport | None:
        """How the auto-tune of a loop went; None when there was none."""
        words, state = self._loops[loop], self.states[loop]
        words.store_results(self.configs[loop], state)
        error = bool(state.status & bits.TUNE_ERROR)
        if not (state.tune_done or state.tune_phase or error):
            return None
        status = "running" if state.tune_phase else "done" if state.tune_done else "error"
        return self.tune_report(status, words.results, done=bool(state.tune_done), error=error)

    def set_output(self, loop: int, value: Quantity, signals: MutableSequence[float]) -> None:
        """The output that a loop in Manual starts with; it has no limits (D645)."""
        self.set(loop, ("state", "output"), value, signals)

    def check_set(self, loop: int, path: tuple[str, ...], value: object) -> object:
        """The value of a ``set`` event as its registers take it; a ``PydanticCustomError`` says what is wrong."""
        words = self._loops[loop]
        rows = find_rows(path, words.decimals)
        parsed = parse_setting(path, rows, value)
        if path == (CASCADE_FROM,):
            return self._output_address(str(parsed))
        refuse_misfit(rows, parsed, words.values, words.scales())
        return parsed

    def new_period(self, loop: int, path: tuple[str, ...], value: Any) -> int:
        """The sample rate that a value for this key makes, in ticks; 0: the key is something else."""
        rows = find_rows(path, self._loops[loop].decimals)
        if str(rows[0].path) != "sample_rate":
            return 0
        return max(ticks(stored_rate(rows[0], value)), self.configs[loop].min_period) if value else 0

    def set(self, loop: int, path: tuple[str, ...], value: Any, signals: MutableSequence[float]) -> str | None:
        """Write a value to its registers; returns why it has no effect yet, or none at all, if so."""
        words = self.memory(loop)
        rows = find_rows(path, words.decimals)
        scales = words.scales()
        contents = [(row, encode_setting(row, item, words.values, scales)) for row, item in items_of(rows, value)]
        return self.write(loop, contents, signals)

    def write(self, loop: int, contents: Sequence[tuple[Point, int]], signals: MutableSequence[float]) -> str | None:
        """Write raw contents, of a choice its bits in place; as `set` otherwise."""
        words, reasons = self.memory(loop), []
        for row, raw in contents:
            reason = words.store(row, raw)
            if reason is None:
                self._apply_words(loop)
                write_state(self.states[loop], words.values, str(row.path))
                reason = overruling_reason(self.configs[loop], self.states[loop], str(row.path))
            if reason is not None:
                reasons.append(reason)
        self._show_signals(loop, signals)
        return "; ".join(reasons) or None

    def _output_address(self, name: str) -> int:
        """Address of the output word of a loop."""
        if name not in self.loops:
            refuse("set_value", f"{name!r} is no loop of this PLC", help=f"known: {', '.join(self.loops)}")
        index = self.loops.index(name)
        return self._words.get(TABLE_POINTER, 0) + index * LOOP_TABLE.size + LOOP_TABLE.offset_of("output")


def overruling_reason(config: Config, state: State, path: str) -> str | None:
    """Why a word that has just been written has no effect, or soon none any more; None: it has."""
    controls = state.status & (bits.AUTO | bits.CASCADE) and not config.halt and not state.pending & bits.STOPPED
    if path == "state.output" and controls:
        return "the next calculation overwrites +05, only in Manual it stays"
    if path == "state.bias" and config.velocity:
        return "the velocity form has no bias: +04 does nothing"
    if path == "setpoint.value" and state.status & bits.CASCADE and config.major >= 0:
        return "in Cascade the set point is the output of the major loop, +02 waits"
    if path == "setpoint.value" and state.rs_step and not state.aux_status & bits.RS_HELD:
        return "a ramp/soak profile runs: its next ramp overwrites +02"
    return None


load = Dl06
