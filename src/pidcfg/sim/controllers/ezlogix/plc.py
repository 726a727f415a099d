"""The virtual EZLogix: from registers, discretes and dialog to a run."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt
from typing import TYPE_CHECKING, Any, cast

from pidcfg.encoders.ezlogix.image import scales_of
from pidcfg.encoders.image import read_settings
from pidcfg.encoders.maps.ezlogix import BLOCKS, LEAST_SAMPLE_RATE, R_BLOCK, S_BLOCK, SPACE
from pidcfg.schemas.ezlogix import CV_FULL, TAG, LoopSettings
from pidcfg.sim.controllers.autotune import POINTS
from pidcfg.sim.controllers.ezlogix import autotune as ezlogix_autotune
from pidcfg.sim.controllers.ezlogix import equation as bits
from pidcfg.sim.controllers.ezlogix import operate as report
from pidcfg.sim.controllers.ezlogix.equation import Config, State, calculate_gains, show_signals
from pidcfg.sim.controllers.ezlogix.operate import (
    CV,
    FLAG_BITS,
    KEYS,
    MODE_BITS,
    REASONS,
    SIGNALS,
    TUNE_STATUS,
    WAITS_FOR_RATE,
    WAITS_FOR_RUN,
)
from pidcfg.sim.controllers.kernels import NEVER, clamp, read_registers, tell
from pidcfg.sim.controllers.plc import SWITCH_AND_TUNE, TICKS, CountsPlc, NoOptions, low_and_width
from pidcfg.sim.controllers.settings import items_of

if TYPE_CHECKING:
    from collections.abc import Mapping, MutableSequence, Sequence
    from decimal import Decimal

    from pidcfg.encoders.codecs import Scale
    from pidcfg.encoders.image import Image
    from pidcfg.encoders.regmap import Codec, RegisterMap, Word
    from pidcfg.schemas.base import Quantity
    from pidcfg.sim.judgement.report import TuneReport

# ----------------------------------------------------------------------------------------------------------------------
# From the registers and discretes of a loop, and its dialog, to the numbers that the controller calculates with.

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
        return self.registers[R_BLOCK.offset(name)]

    def bit(self, name: str) -> int:
        """The state of a discrete."""
        return int(self.discretes[S_BLOCK.offset(name)] != 0)

    def values(self) -> dict[str, Any]:
        """What registers and discretes hold, in counts, and what the dialog says, by name."""
        discretes = {row.name: self.bit(row.name) for row in S_BLOCK.words}
        choices = {"action": self.dialog.action, "algorithm": self.dialog.algorithm}
        return {row.name: self.word(row.name) for row in R_BLOCK.words} | discretes | choices

    def quantity(self, name: str) -> Decimal:
        """What a register holds, in its unit: a gain, or a time in seconds."""
        codec = cast("Codec", R_BLOCK.word(name).codec)
        value: Decimal = codec.decode(self.word(name))
        return value

    def scales(self) -> dict[str, Scale]:
        """The scales of the loop's registers in engineering units."""
        return scales_of(self.dialog.pv, self.dialog.output, root=bool(self.bit("square_root")))

    def write(self, row: str, raw: int) -> None:
        """The raw content of a register or a discrete."""
        block, table = (self.registers, R_BLOCK) if row in REGISTER_NAMES else (self.discretes, S_BLOCK)
        block[table.offset(row)] = raw


REGISTER_NAMES = frozenset(word.name for word in R_BLOCK.words if word.access != "reserved")


def block_of(words: Mapping[int, int], prefix: str, first: int, table: RegisterMap) -> list[int]:
    """A block of registers; what lies beyond the end of its bank counts as 0."""
    bank = next(bank for bank in SPACE.banks if bank.prefix == prefix)
    start = SPACE.number(prefix, first)
    return [words.get(start + k, 0) if first + k <= bank.last else 0 for k in range(table.size)]


def loop_of(words: Mapping[int, int], dialog: LoopSettings) -> Loop:
    """A loop from the memory."""
    blocks = {key: block_of(words, prefix, getattr(dialog, key), table) for key, (prefix, table) in BLOCKS.items()}
    return Loop(dialog, blocks["registers"], blocks["discretes"])


def ticks(seconds: Any) -> int:
    """Seconds as ticks."""
    return int(seconds * TICKS)


def configure(config: Config, loop: Loop, *, goes_on: bool) -> None:
    """A loop's `Config`; values beyond the manual's ranges are taken as they are (D171)."""
    dialog = loop.dialog
    read_registers(config, loop.values())
    low, high = dialog.pv.counts or (0, CV_FULL)
    config.pv_min, config.pv_max, config.pv_span = float(low), float(high), float(high - low)
    config.pv_low, config.pv_width = low_and_width(dialog.pv.range, config.pv_min, config.pv_span)
    config.out_low, config.out_width = low_and_width(dialog.output.range, 0.0, float(CV_FULL))
    config.halt = int(loop.word("sample_rate") < LEAST_SAMPLE_RATE)  # a sample rate below 0.05 s is none (D162)
    config.period = UNKNOWN_PERIOD if config.halt else ticks(loop.quantity("sample_rate"))
    config.runs_when_stopped = int(goes_on)
    config.fetches_pv = int(dialog.pv.tag.startswith("IR"))
    config.carries_output = int(dialog.output.tag.startswith("OR") or dialog.output.pulse is not None)
    config.scale = sqrt(config.pv_span) if config.square_root else 1.0
    config.cv_low_limit, config.cv_high_limit = (
        clamp(float(loop.word(name)), 0.0, float(CV_FULL)) for name in ("cv_low", "cv_high")
    )
    config.timeout = ticks(loop.word("autotune_timeout"))
    config.cycle = 0 if dialog.output.pulse is None else ticks(loop.quantity("cycle_time"))
    config.min_on, config.min_off = ticks(loop.quantity("min_on")), ticks(loop.quantity("min_off"))


def tuning(config: Config, state: State, loop: Loop) -> None:
    """The gain registers and the sample rate."""
    state.gain = float(loop.quantity("proportional_gain"))
    state.reset = float(loop.quantity("integral_time"))
    state.rate = float(loop.quantity("derivative_time"))
    state.period = config.period


def absorb(loop: Loop, state: State) -> None:
    """Put what the PLC has written into the registers: results of an autotune, a set point within its limits."""
    loop.write("setpoint", int(state.sp))
    loop.write("proportional_gain", round(state.gain * 100))
    loop.write("integral_time", round(state.reset * 10))
    loop.write("derivative_time", round(state.rate * 10))


def tag_number(tag: str) -> int | None:
    """The plain number of an R register; None for a physical tag."""
    match = TAG.fullmatch(tag)
    return SPACE.number("R", int(match.group(2))) if match and match.group(1) == "R" else None


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

    def __init__(self, image: Image, options: NoOptions | None = None) -> None:
        words = image.words
        self._goes_on = bool(image.plc.get("process_when_stopped", True))
        dialogs = [read_settings(LoopSettings, entry, f"settings[{i}]") for i, entry in enumerate(image.settings)]
        self._loops = [loop_of(words, dialog) for dialog in dialogs]
        self.loops = [dialog.loop for dialog in dialogs]
        self.goals = ["auto" if loop.bit("mode") else "manual" for loop in self._loops]
        self.place_loops(Config, State, SIGNALS, POINTS)
        for i in range(len(dialogs)):
            self._begin(i, words)
        self.scale_loops()

    def _begin(self, i: int, words: Mapping[int, int]) -> None:
        """What a loop starts with: its places in the shared vectors, its registers, and a request for its mode."""
        config, state, loop = self.configs[i], self.states[i], self._loops[i]
        if loop.dialog.output.pulse is None:
            self.signals[config.pulse_slot] = ""
        config.tune_buffer = i * POINTS
        number = tag_number(loop.dialog.output.tag)
        config.inner_loop = self._setpoint_at(number, i)
        if config.inner_loop >= 0:
            self.configs[config.inner_loop].outer_loop = i
        state.out = state.unlimited_cv = (
            clamp(float(words.get(number, 0)), 0.0, float(CV_FULL)) if number is not None else 0.0
        )
        state.sp = float(loop.word("setpoint"))
        self._apply(i)
        state.pv, state.tune_countdown = config.pv_min, config.timeout
        if self.goals[i] == "auto":
            self._request_mode(i, bits.AUTO)
        self._show(i, self.signal_values)

    def _setpoint_at(self, number: int | None, i: int) -> int:
        """The other loop whose set point register has this number; -1: none."""
        places = [SPACE.number("R", loop.dialog.registers) + R_BLOCK.offset("setpoint") for loop in self._loops]
        return next((j for j, place in enumerate(places) if place == number and j != i), -1)

    def _apply(self, i: int) -> None:
        """Make the registers the controller's configuration."""
        config, state, loop = self.configs[i], self.states[i], self._loops[i]
        halted, period = config.halt, state.period
        configure(config, loop, goes_on=self._goes_on)
        tuning(config, state, loop)
        if (config.halt or state.period != period) and not state.pending & bits.STOPPED:
            ezlogix_autotune.change_rate(config, state)
        calculate_gains(state)
        if config.halt:
            state.due = NEVER
        elif halted and not state.pending & bits.STOPPED:
            state.due = 0

    def _request_mode(self, i: int, mode: int) -> None:
        """Write discrete +0, which nothing refuses."""
        state = self.states[i]
        state.wanted_mode = mode
        state.pending |= bits.REQUEST
        self._note_waiting(i, mode)

    def _note_waiting(self, i: int, mode: int = 0) -> None:
        """Leaves a notice that a request waits, as the loop is not calculated."""
        if self.configs[i].halt:
            tell(self.states[i], WAITS_FOR_RATE, mode)
        elif self.states[i].pending & bits.STOPPED:
            tell(self.states[i], WAITS_FOR_RUN, mode)

    def _show(self, i: int, signals: MutableSequence[float]) -> None:
        """The signals that an operator's change affects at once: SP is limited, its register later (D656)."""
        show_signals(self.configs[i], self.states[i], signals)

    @classmethod
    def is_about_mode(cls, requested: int, reason: int) -> bool:
        """Whether a mode was requested: requests are never refused, they wait."""
        return requested != 0

    @property
    def rises(self) -> list[bool]:
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
                ezlogix_autotune.stop_tune(config, state)
                state.due = NEVER if config.halt else tick
                state.last_tick = state.cycle_end = tick
                state.pending |= bits.FRESH if state.status & bits.AUTO else 0
            state.pending &= ~(bits.STOPPED | bits.PV_STALE | bits.OUTPUT_CUT)

    def stop(self, signals: MutableSequence[float]) -> None:
        """The PLC stops: loops stand still, or go on with the tags that need no ladder program (D173)."""
        for config, state in zip(self.configs, self.states, strict=True):
            if not config.runs_when_stopped:
                state.pending |= bits.STOPPED
                state.due = NEVER
                tell(state, report.IS_STOPPED)
                continue
            if not config.fetches_pv:
                state.pending |= bits.PV_STALE
                tell(state, report.PV_IS_STALE)
            if not config.carries_output:
                state.pending |= bits.OUTPUT_CUT
                tell(state, report.OUTPUT_IS_CUT)

    # --- the operator ------------------------------------------------------------------------------------------------

    def request(self, loop: int, mode: str) -> None:
        """Discrete +0 is written."""
        self._request_mode(loop, MODE_BITS[mode])

    def autotune(self, loop: int, command: str) -> None:
        """``start``: discrete +4 goes from 0 to 1, by way of 0 where it is still on; ``cancel``: it goes to 0."""
        state, start = self.states[loop], command == "start"
        if start and state.status & bits.TUNING:
            tell(state, report.TUNE_RUNS)
            return
        self._note_waiting(loop)
        state.tune_command = ezlogix_autotune.ON if start else ezlogix_autotune.OFF
        state.pending |= bits.TUNE

    def tuned(self, loop: int) -> TuneReport | None:
        """How the last autotune of a loop went; None when there was none."""
        state = self.states[loop]
        status = state.tune_status if state.status & bits.TUNING else state.tune_last
        if not status:
            return None
        done, error = status == ezlogix_autotune.DONE, status > ezlogix_autotune.CANCELLED
        results = state.tune_gain, state.tune_reset, state.tune_rate
        return self.tune_report(f"{status}: {TUNE_STATUS[status]}", results, done=done, error=error)

    def set_output(self, loop: int, value: Quantity, signals: MutableSequence[float]) -> None:
        """The CV that a loop starts with."""
        self._set_cv(loop, CV.encode(value, self._loops[loop].scales()), signals)

    def check_set(self, loop: int, path: tuple[str, ...], value: object) -> object:
        """The value of a ``set`` event as its registers take it; a ``PydanticCustomError`` says what is wrong."""
        scales = self._loops[loop].scales()
        return KEYS.check(path, value, lambda row, item: row.encode(item, scales))

    def period_set(self, loop: int, path: tuple[str, ...], value: Any) -> int:
        """The sample rate that a value for this key makes, in ticks; 0: another key, or a rate that is none."""
        rows = KEYS.find(path)
        if str(rows[0].path) != "sample_rate":
            return 0
        row: Word = R_BLOCK.word("sample_rate")
        raw = row.encode(value, self._loops[loop].scales())
        return ticks(row.decode(raw)) if raw >= LEAST_SAMPLE_RATE else 0

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
        absorb(registers, state)
        registers.write(row.name, raw)
        state.sp = float(registers.word("setpoint"))
        tuned = state.status & bits.TUNING
        self._apply(loop)
        if tuned and not state.status & bits.TUNING:
            self._set_cv(loop, int(state.out), signals)
        if row.name == "autotune_timeout":
            state.tune_countdown = self.configs[loop].timeout
        if row.name.startswith("setpoint"):
            self._show(loop, signals)
        if self.configs[loop].halt:
            return "the loop is not calculated: its sample rate is below 0.05 s"
        return self._write_outer(loop, signals) if row.name == "setpoint" else None

    def memory(self, loop: int) -> Loop:
        """A loop's registers and discretes as they are after the last calculation."""
        absorb(self._loops[loop], self.states[loop])
        return self._loops[loop]

    def _write_outer(self, loop: int, signals: MutableSequence[float]) -> str | None:
        """Writes the CV that stands in this loop's set point register (D177); returns what overwrites it."""
        outer = self.configs[loop].outer_loop
        if outer < 0:
            return None
        if not self.states[outer].pending & bits.HELD:
            self._set_cv(outer, int(self.states[loop].sp), signals)
        if self._keeps_cv(outer):
            return f"the CV of {self.loops[outer]} stands in the same register and overwrites it"
        return None

    def _keeps_cv(self, loop: int) -> str | None:
        """Why nobody else can write a loop's CV; None: he can."""
        state = self.states[loop]
        if state.pending & bits.HELD:
            return "the autotune holds the CV"
        if (state.wanted_mode if state.pending & bits.REQUEST else state.status) & bits.AUTO and not self.configs[
            loop
        ].halt:
            return "the loop is in Auto and calculates the CV itself"
        return None

    def write_output(self, loop: int, raw: int, signals: MutableSequence[float]) -> str | None:
        """The operator writes the CV, which he can in Manual only (D172)."""
        why = self._keeps_cv(loop)
        if why is None:
            self._set_cv(loop, raw, signals)
        return why

    def _set_cv(self, loop: int, raw: int, signals: MutableSequence[float]) -> None:
        state, inner = self.states[loop], self.configs[loop].inner_loop
        state.out = float(raw)
        self._show(loop, signals)
        if inner >= 0:
            self.states[inner].sp = state.out
            self._show(inner, signals)


load = Ezlogix
