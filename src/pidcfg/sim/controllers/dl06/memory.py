"""V-memory of a virtual DL06: every loop's words, and the records that the controller calculates with.

Each loop has its words twice: as they stand in memory, and as the controller has last read them, since some words are
read only when an alarm is enabled or the CPU changes its mode.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from pidcfg.encoders.dl06.setup import Setup, check_setup
from pidcfg.encoders.maps.dl06 import CPU, LOOP_COUNT, LOOP_TABLE, RAMP_SOAK_SIZE, TABLE_POINTER
from pidcfg.encoders.settings import default_name
from pidcfg.sim.controllers.dl06 import modes as dl06_modes
from pidcfg.sim.controllers.dl06 import state as bits
from pidcfg.sim.controllers.dl06.equation import coefficients
from pidcfg.sim.controllers.dl06.loop import Loop, loop_of
from pidcfg.sim.controllers.dl06.report import COMMANDS, MODES, SIGNALS
from pidcfg.sim.controllers.dl06.state import Config, State
from pidcfg.sim.controllers.dl06.tune_open import POINTS
from pidcfg.sim.controllers.dl06.tune_results import REQUESTED, TUNE_RUNS
from pidcfg.sim.controllers.dl06.words import (
    SLOW,
    alarm_error,
    configure,
    major_of,
    profile,
    show,
    tuning,
    write_state,
)
from pidcfg.sim.notices import tell_request
from pidcfg.sim.plc import CountsPlc, low_and_width
from pidcfg.sim.problems import NoValue

if TYPE_CHECKING:
    from collections.abc import Mapping, MutableSequence

    from pidcfg.encoders.image import Image


@dataclass(frozen=True, slots=True)
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


class Memory(CountsPlc):
    """The words of an image, and what the kernels make of them."""

    cfg: list[Config]
    st: list[State]

    def __init__(self, image: Image, options: Options) -> None:
        self._words, self._options, self._plc = image.words, options, image.plc
        self.problems: list[NoValue] = []
        if options.number_of_loops is not None:
            self._words[LOOP_COUNT] = int(str(options.number_of_loops), 16)
        self._setup = self._check()
        count = len(image.settings) or min(self._setup.count, CPU.loops)
        self._loops = [self._loop(i, image) for i in range(count)]
        self.loops = [loop.name for loop in self._loops]
        self.goals = [loop.goal for loop in self._loops]
        self.place_loops(Config, State, SIGNALS, RAMP_SOAK_SIZE + POINTS)
        for i in range(count):
            self._begin(i)

    @property
    def words(self) -> Mapping[int, int]:
        """V-memory as it was loaded, and what was written outside of the loop table since."""
        return self._words

    def memory(self, loop: int) -> Loop:
        """A loop's words as they are after the last scan; what the controller writes all the time is in its state."""
        self._loops[loop].absorb(self.cfg[loop], self.st[loop])
        return self._loops[loop]

    def write_other(self, number: int, raw: int) -> None:
        """Writes a word outside of the loop table; of a ramp/soak table it counts at once."""
        self._words[number] = raw
        for i, loop in enumerate(self._loops):
            if 0 <= number - loop.values["ramp_soak.table"] < RAMP_SOAK_SIZE:
                self._apply(i)

    def _check(self) -> Setup:
        return check_setup(self._words.get(TABLE_POINTER, 0), self._words.get(LOOP_COUNT, 0))

    def _loop(self, i: int, image: Image) -> Loop:
        entry = {"loop": default_name(i), **(image.settings[i] if i < len(image.settings) else {})}
        decimals = int(image.plc.get("reset_decimals", 1))
        start = self._words.get(TABLE_POINTER, 0) + i * LOOP_TABLE.size
        loop, problems = loop_of(self._words, start, entry, decimals)
        self.problems += [NoValue(i, text, setting) for text, setting in problems]
        return loop

    def _begin(self, i: int) -> None:
        """What a loop starts with: the controller's words, its goal, and its places in the shared vectors."""
        c, s, v = self.cfg[i], self.st[i], self._loops[i].values
        c.rs_table = i * RAMP_SOAK_SIZE
        c.tune_buffer = len(self._loops) * RAMP_SOAK_SIZE + i * POINTS
        c.interlock, c.step_bias = int(self._options.auto_interlock), int(self._options.step_bias)
        c.on_pv = int(self._plc.get("derivative") == "pv")
        self._apply(i)
        for path in ("setpoint.value", "state.pv", "state.bias", "state.output"):
            write_state(s, v, path)
        s.goal = 0 if self.goals[i] == "manual" else MODES[self.goals[i]]
        s.goal_writes = int(self._loops[i].has_setpoint)
        s.busy |= bits.GOAL if s.goal else 0
        if not (v["ramp_soak.enabled"] or v["ramp_soak.table"]):
            self.signals[c.sig_step] = ""
        s.rs_command = COMMANDS.get(v["ramp_soak.request"], 0)
        s.busy |= bits.SOAK if s.rs_command else 0
        if v["autotune.start"]:
            self._start_tune(i)
        self._show(i, self.sig)

    def _apply(self, i: int) -> None:
        """Make the words that the controller has read its configuration."""
        words, c, s = self._loops[i], self.cfg[i], self.st[i]
        v = words.values
        form = c.velocity
        configure(c, v, words.decimals, self._setup.count)
        s.busy |= bits.FRESH if c.velocity != form else 0  # another form has no past (D681)
        c.halt = int(c.halt or not self._setup.running or i >= self._setup.count)
        c.slow = int(self._options.scan_time > 0 and c.period > SLOW)
        self._follow_pointer(i)
        c.pv_low, c.pv_width = low_and_width(words.pv_range, c.pv_min, c.pv_span)
        c.out_low, c.out_width = low_and_width(words.out_range, c.out_min, c.out_span)
        table = [self._words.get(v["ramp_soak.table"] + k, 0) for k in range(RAMP_SOAK_SIZE)]
        self.aux[c.rs_table : c.rs_table + RAMP_SOAK_SIZE] = profile(table, v)
        tuning(c, s, v, words.decimals)
        coefficients(c, s)
        s.quiet_low, s.quiet_high = bits.UNBOUNDED, -bits.UNBOUNDED
        s.status &= ~bits.ALARM_ERROR
        if alarm_error(v):
            s.status |= bits.ALARM_ERROR
            s.busy |= 0 if s.status & bits.MANUAL else bits.TRIP

    def _follow_pointer(self, i: int) -> None:
        """Whose output is a loop's remote set point; a loop in Cascade that loses it goes to Manual (D66)."""
        pointer, start = self._loops[i].values["remote_setpoint"] or 0, self._words.get(TABLE_POINTER, 0)
        major = major_of(pointer, start, len(self._loops), i)
        if major < 0 and self.st[i].status & bits.CASCADE:
            dl06_modes.to_manual(i, self.cfg, self.st, dl06_modes.OVERRIDE_NO_REMOTE)
        self.cfg[i].major = major

    def _start_tune(self, i: int) -> None:
        """Bit 7 of +01 goes on."""
        words, s = self._loops[i], self.st[i]
        s.requested = 0
        if s.status & bits.TUNING:
            tell_request(s, TUNE_RUNS)
        elif self._calculated(i):
            words.absorb(self.cfg[i], s)
            words.absorbed = False
            s.tune_done = 0
            s.tune_phase = REQUESTED
            s.busy |= bits.TUNE

    def _calculated(self, i: int) -> bool:
        """Whether a loop is calculated at all; leaves a notice when it is not."""
        s = self.st[i]
        if self.cfg[i].halt:
            tell_request(s, dl06_modes.REFUSED_OFF)
        elif s.busy & bits.STOPPED:
            tell_request(s, dl06_modes.REFUSED_PROGRAM)
        else:
            return True
        return False

    def _show(self, i: int, sig: MutableSequence[float]) -> None:
        """The signals of a loop as its words say."""
        show(self.cfg[i], self.st[i], sig)
