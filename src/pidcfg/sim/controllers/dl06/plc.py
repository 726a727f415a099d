"""The virtual DL06: built from V-memory words, operated as by its operator, its ladder and the CPU switch.

`load` decodes nothing but words; what no word holds (names, ranges, intended modes) comes from the image's settings.
"""

from __future__ import annotations

from dataclasses import fields
from math import sqrt
from typing import TYPE_CHECKING, Any

from pidcfg.encoders.maps.dl06 import LOOP_TABLE, TABLE_POINTER
from pidcfg.schemas.numbers import refuse
from pidcfg.sim.controllers.dl06 import modes as dl06_modes
from pidcfg.sim.controllers.dl06 import state as bits
from pidcfg.sim.controllers.dl06 import timing as dl06_timing
from pidcfg.sim.controllers.dl06.memory import Memory, Options
from pidcfg.sim.controllers.dl06.report import (
    ALARM_BITS,
    ALARM_LIMITS,
    AUX_BITS,
    COMMANDS,
    FLAG_BITS,
    MODES,
    OUTER_ALARMS,
    REASONS,
)
from pidcfg.sim.controllers.dl06.setting import (
    CASCADE_FROM,
    encode_setting,
    find_rows,
    fits,
    parse_setting,
    stored_rate,
)
from pidcfg.sim.controllers.dl06.tune_results import TUNE_ABORTED, end_tune
from pidcfg.sim.controllers.dl06.words import ticks, write_state
from pidcfg.sim.notices import tell_request
from pidcfg.sim.plc import TICKS
from pidcfg.sim.records import NEVER
from pidcfg.sim.settings import items_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, MutableSequence, Sequence

    from pidcfg.encoders.image import Image
    from pidcfg.schemas.base import Quantity
    from pidcfg.sim.controllers.dl06.state import Config, State
    from pidcfg.sim.report import ScanTime
    from pidcfg.sim.settings import Row


class Dl06(Memory):
    """A DL06 as loaded from its words."""

    out_name = "OUT"
    word_of_flags = "0x{:04X}"
    modes: Mapping[str, int] = MODES
    options = tuple(f.name for f in fields(Options))
    commands: Mapping[str, Sequence[str]] = {
        "ramp_soak": tuple(COMMANDS),
        "autotune": ("start",),
        "plc": ("program", "run"),
    }
    tuned_names = ("gain", "reset", "rate", "sample_rate")
    alarm_bits: Mapping[str, int] = ALARM_BITS
    alarm_limits: Mapping[str, str] = ALARM_LIMITS
    unreached = bits.UNBOUNDED
    flag_bits: Mapping[str, int] = FLAG_BITS
    aux_bits: Mapping[str, int] = AUX_BITS
    reasons: Mapping[int, str] = REASONS
    outer_alarms = OUTER_ALARMS
    error_flags = ("alarm_programming_error",)
    tuning_flags = ("autotune_running",)

    def __init__(self, image: Image, options: Options) -> None:
        super().__init__(image, options)
        self.in_run = False
        self.run(0)
        self.scale_loops()

    @classmethod
    def is_about_mode(cls, requested: int, reason: int) -> bool:
        """Whether a notice concerns the mode: a refusal if a mode was requested, an override always."""
        return reason in dl06_modes.REASONS and bool(requested or reason > dl06_modes.LAST_REFUSAL)

    @classmethod
    def profile_step(cls, aux_status: int) -> str:
        """The step byte of the ramp/soak word: odd steps are ramps, even ones soaks."""
        step = aux_status // bits.RS_STEP
        return f"{step} {'ramp' if step % 2 else 'soak'}" if step else ""

    # --- the CPU -----------------------------------------------------------------------------------------------------

    @property
    def rises(self) -> list[bool]:
        """Direct action: the PV rises with the output."""
        return [not c.reverse for c in self.cfg]

    @property
    def masters(self) -> list[int]:
        """The major loops, as the remote set point pointers name them."""
        return [c.major for c in self.cfg]

    def output_limits(self, loop: int, sig: Sequence[float]) -> tuple[float, float]:  # noqa: ARG002 - words, no signals
        """+30 and +31, within the data range."""
        c = self.cfg[loop]
        share = c.out_width / c.out_span
        return c.out_low + (c.m_low - c.out_min) * share, c.out_low + (c.m_high - c.out_min) * share

    def alarm_level(self, loop: int, alarm: str) -> float | None:
        """The counts of a limit on the scale of the PV, which the signal before a root has, too."""
        counts, c = super().alarm_level(loop, alarm), self.cfg[loop]
        if counts is None:
            return None
        share = c.pv_width / c.pv_span
        return c.pv_low + (counts - c.pv_min) * share if alarm.startswith("pv_") else counts * share

    def inner_deviation(self, loop: int) -> float | None:
        """The yellow deviation alarm; of a root it has another scale than the PV."""
        c = self.cfg[loop]
        return None if c.root or c.yellow >= bits.UNBOUNDED else c.yellow * c.pv_width / c.pv_span

    def dead_band(self, loop: int, sig: Sequence[float]) -> float:  # noqa: ARG002 - words, no signals
        """+23, which is compared with the squared error where that is on."""
        c = self.cfg[loop]
        return (sqrt(c.deadband) if c.squared else c.deadband) * c.pv_width

    def set_up_errors(self, loop: int) -> Iterator[str]:
        """Words that are no value of their format, and the ramp/soak programming errors that +35 has had."""
        yield from super().set_up_errors(loop)
        if self.st[loop].rs_errors:
            yield f"ramp/soak programming error, +35 = 0x{self.st[loop].rs_errors:04X}"

    @property
    def running(self) -> bool:
        """Whether the loop task runs."""
        return self._setup.running

    @property
    def flags(self) -> Mapping[str, int]:
        """V7642."""
        return {"V7642": self._setup.flags}

    def scan_time(self, without_loops: float) -> ScanTime:
        """The length of a scan with the loops that are calculated, in s."""
        return dl06_timing.scan_time(without_loops, [period / TICKS for period in self.periods if period])

    def start(self, tick: int) -> None:
        """The program-to-run transition: all words are read, loops begin anew and return to their modes (D49, D648)."""
        self._setup = self._check()
        for i, loop in enumerate(self._loops):
            c, s = self.cfg[i], self.st[i]
            loop.absorb(c, s)
            loop.reread(alarms=True)
            self._apply(i)
            s.due = NEVER if c.halt else tick
            if s.busy & bits.STOPPED and s.prior != bits.MANUAL:
                s.busy |= bits.RESTORE
            s.busy &= ~(bits.STOPPED | bits.PV_STALE | bits.OUTPUT_CUT | bits.PROGRAM)
            s.busy |= bits.FIRST

    def stop(self, sig: MutableSequence[float]) -> None:
        """The CPU stops: loops go to Manual and are not calculated, except those that are independent of its mode.

        Output modules turn off at once, but for those that an independent loop writes itself (D49).
        """
        for i, (c, s) in enumerate(zip(self.cfg, self.st, strict=True)):
            self._loops[i].absorb(c, s)
            self._loops[i].reread(alarms=False)
            self._apply(i)
            if c.independent:
                s.busy |= bits.PROGRAM | (0 if c.sees_pv else bits.PV_STALE) | (0 if c.drives else bits.OUTPUT_CUT)
            else:
                s.prior = s.status & bits.MODES
                s.busy |= bits.STOPPED
                if s.status & bits.TUNING:  # a change of mode, too (D64)
                    end_tune(s, TUNE_ABORTED)
        stopped = [(c, s) for c, s in zip(self.cfg, self.st, strict=True) if s.busy & bits.STOPPED]
        for _, s in stopped:
            if s.prior != bits.MANUAL:
                s.requested = 0
                s.status = (s.status & ~bits.MODES) | bits.MANUAL
                tell_request(s, dl06_modes.OVERRIDE_PROGRAM)
        for c, s in stopped:
            if s.prior & bits.CASCADE:  # an independent major loop does not go on alone (D680)
                dl06_modes.to_manual(c.major, self.cfg, self.st, dl06_modes.OVERRIDE_MINOR)
        for i in range(len(self.st)):
            self._show(i, sig)

    # --- the operator ------------------------------------------------------------------------------------------------

    def request(self, loop: int, mode: str) -> None:
        """A one-shot mode request; it takes the place of the configured one, granted or not (D68, D643)."""
        s = self.st[loop]
        s.requested = MODES[mode]
        if s.busy & bits.GOAL and not self.cfg[loop].halt:
            tell_request(s, dl06_modes.GIVEN_UP)
        s.goal = 0
        s.busy &= ~bits.GOAL
        if self._calculated(loop):
            s.request = MODES[mode]
            s.busy |= bits.REQUEST

    def ramp_soak(self, loop: int, command: str) -> None:
        """``start``, ``hold``, ``resume`` or ``jog``: a control bit of +33 goes on."""
        s = self.st[loop]
        s.requested = 0
        if self._calculated(loop):
            s.rs_command |= COMMANDS[command]
            s.busy |= bits.SOAK

    def autotune(self, loop: int, command: str = "start") -> None:  # noqa: ARG002 - the only command there is
        """``start``: bit 7 of +01 goes on."""
        self._start_tune(loop)

    def tuned(self, loop: int) -> Mapping[str, Any] | None:
        """How the auto-tune of a loop went; None when there was none."""
        words, s = self._loops[loop], self.st[loop]
        words.absorb(self.cfg[loop], s)
        error = bool(s.status & bits.TUNE_ERROR)
        if not (s.tune_done or s.tune_phase or error):
            return None
        status = "running" if s.tune_phase else "done" if s.tune_done else "error"
        results = words.results if s.tune_done else {}
        return {"done": bool(s.tune_done), "error": error, "status": status, "results": results}

    def set_output(self, loop: int, value: Quantity, sig: MutableSequence[float]) -> None:
        """The output that a loop in Manual starts with; it has no limits (D645)."""
        self.set(loop, ("state", "output"), value, sig)

    def check_set(self, loop: int, path: tuple[str, ...], value: object) -> object:
        """The value of a ``set`` event as its registers take it; a ``PydanticCustomError`` says what is wrong."""
        words = self._loops[loop]
        rows = find_rows(path, words.decimals)
        parsed = parse_setting(path, rows, value)
        if path == (CASCADE_FROM,):
            return self._output_address(str(parsed))
        fits(rows, parsed, words.values, words.scales())
        return parsed

    def period_set(self, loop: int, path: tuple[str, ...], value: Any) -> int:
        """The sample rate that a value for this key makes, in ticks; 0: the key is something else."""
        rows = find_rows(path, self._loops[loop].decimals)
        if str(rows[0].path) != "sample_rate":
            return 0
        return max(ticks(stored_rate(rows[0], value)), self.cfg[loop].least_period) if value else 0

    def set(self, loop: int, path: tuple[str, ...], value: Any, sig: MutableSequence[float]) -> str | None:
        """Write a value to its registers; returns why it has no effect yet, or none at all, if so."""
        words = self.memory(loop)
        rows = find_rows(path, words.decimals)
        scales = words.scales()
        return self.write(
            loop, [(row, encode_setting(row, item, words.values, scales)) for row, item in items_of(rows, value)], sig
        )

    def write(self, loop: int, written: Sequence[tuple[Row, int]], sig: MutableSequence[float]) -> str | None:
        """Write raw contents, of a choice its bits in place; as `set` otherwise."""
        words, late = self.memory(loop), []
        for row, raw in written:
            reason = words.store(row, raw)
            if reason is None:
                self._apply(loop)
                write_state(self.st[loop], words.values, str(row.path))
                reason = overruled(self.cfg[loop], self.st[loop], str(row.path))
            if reason is not None:
                late.append(reason)
        self._show(loop, sig)
        return "; ".join(late) or None

    def _output_address(self, name: str) -> int:
        """Address of the output word of a loop."""
        if name not in self.loops:
            refuse("set_value", f"{name!r} is no loop of this PLC", help=f"known: {', '.join(self.loops)}")
        index = self.loops.index(name)
        return self._words.get(TABLE_POINTER, 0) + index * LOOP_TABLE.size + LOOP_TABLE.offset("output")


def overruled(c: Config, s: State, path: str) -> str | None:
    """Why a word that has just been written has no effect, or soon none any more; None: it has."""
    controls = s.status & (bits.AUTO | bits.CASCADE) and not c.halt and not s.busy & bits.STOPPED
    if path == "state.output" and controls:
        return "the next calculation overwrites +05, only in Manual it stays"
    if path == "state.bias" and c.velocity:
        return "the velocity form has no bias: +04 does nothing"
    if path == "setpoint.value" and s.status & bits.CASCADE and c.major >= 0:
        return "in Cascade the set point is the output of the major loop, +02 waits"
    if path == "setpoint.value" and s.rs_step and not s.aux_status & bits.RS_HELD:
        return "a ramp/soak profile runs: its next ramp overwrites +02"
    return None


def load(image: Image, options: Options | None = None) -> Dl06:
    """The virtual PLC of an image's words, as it stands at its program-to-run transition."""
    return Dl06(image, options or Options())
