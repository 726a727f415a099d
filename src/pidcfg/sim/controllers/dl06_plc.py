"""The DL06 as an object: made of V-memory words, and handled from outside as its operator, ladder and CPU switch would.

`load` decodes nothing but words; what no word holds (names, ranges, intended modes) comes from the image's settings.
Each loop has its words twice: as they stand in memory, and as the controller has last read them, since some words are
read only when an alarm is enabled or the CPU changes its mode.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import gcd
from typing import TYPE_CHECKING, Any

from pidcfg.encoders.dl06 import unnamed
from pidcfg.encoders.dl06_setup import Setup, check_setup
from pidcfg.encoders.maps.dl06 import CPU, LOOP_COUNT, LOOP_TABLE, RAMP_SOAK_SIZE, TABLE_POINTER
from pidcfg.schemas.base import refuse
from pidcfg.sim.controllers import dl06_modes
from pidcfg.sim.controllers import dl06_state as bits
from pidcfg.sim.controllers.dl06_equation import coefficients
from pidcfg.sim.controllers.dl06_loop import Loop, eng, loop_of
from pidcfg.sim.controllers.dl06_report import (
    ALARM_BITS,
    AUX_BITS,
    COMMANDS,
    FLAG_BITS,
    MODES,
    SIGNALS,
    describe,
    mode_name,
    requested,
)
from pidcfg.sim.controllers.dl06_setting import CASCADE_FROM, find_rows, fits, parse_setting
from pidcfg.sim.controllers.dl06_state import NEVER, TICKS, Config, State
from pidcfg.sim.controllers.dl06_tune_open import POINTS
from pidcfg.sim.controllers.dl06_tune_results import WANTED
from pidcfg.sim.controllers.dl06_words import (
    SLOW,
    alarm_error,
    configure,
    major_of,
    profile,
    show,
    tuning,
    write_state,
)

if TYPE_CHECKING:
    from collections.abc import Mapping, MutableSequence

    from pidcfg.encoders.image import Image
    from pidcfg.schemas.base import Quantity


@dataclass(frozen=True, slots=True)
class Options:
    """What a scenario chooses about the PLC; no word holds it."""

    auto_interlock: bool = True
    """A PV alarm refuses a request for Auto."""
    scan_time: int = 0
    """Length of a scan in ticks; 0: every base step has time for all loops."""
    step_bias: bool = False
    """Set-point changes move the bias in proportion."""
    number_of_loops: int | None = None
    """What V7641 gets instead of the image's count."""


class Dl06:
    """A DL06 as loaded from its words; implements `pidcfg.sim.plc.Plc`."""

    out_name = "OUT"
    modes = tuple(MODES)
    tuned_names = ("gain", "reset", "rate", "sample_rate")
    alarm_bits: Mapping[str, int] = ALARM_BITS
    flag_bits: Mapping[str, int] = FLAG_BITS
    aux_bits: Mapping[str, int] = AUX_BITS
    mode = staticmethod(mode_name)
    describe = staticmethod(describe)
    requested = staticmethod(requested)

    def __init__(self, image: Image, options: Options) -> None:
        self._words, self._options, self._plc = image.words, options, image.plc
        self.problems: list[str] = []
        """Words that are no value of their format."""
        if options.number_of_loops is not None:
            self._words[LOOP_COUNT] = int(str(options.number_of_loops), 16)
        self._setup = self._check()
        count = len(image.settings) or min(self._setup.count, CPU.loops)
        self._loops = [self._loop(i, image) for i in range(count)]
        self.loops = [loop.name for loop in self._loops]
        self.goals = [loop.goal for loop in self._loops]
        self.cfg = [Config() for _ in self._loops]
        self.st = [State() for _ in self._loops]
        self.aux = [0.0] * (count * (RAMP_SOAK_SIZE + POINTS))
        self.sig = [0.0] * (count * len(SIGNALS))
        self.signals = [f"{loop.name}.{name}" if name else "" for loop in self._loops for name in SIGNALS]
        for i in range(count):
            self._begin(i)
        self._in_run = False
        self.run(0)
        self.scales = [(c.pv_low, c.pv_low + c.pv_width, int(c.pv_span)) for c in self.cfg]

    # --- the CPU -----------------------------------------------------------------------------------------------------

    @property
    def running(self) -> bool:
        """Whether the loop task runs."""
        return self._setup.running

    @property
    def flags(self) -> Mapping[str, int]:
        """V7642."""
        return {"V7642": self._setup.flags}

    @property
    def base(self) -> int:
        """The greatest common step of the sample rates, in ticks."""
        return gcd(*(c.period for c in self.cfg if not c.halt)) or TICKS

    def run(self, tick: int) -> None:
        """The program-to-run transition: all words are read, loops return to their prior modes (D49)."""
        if self._in_run:
            return
        self._in_run = True
        self._setup = self._check()
        for i, loop in enumerate(self._loops):
            c, s = self.cfg[i], self.st[i]
            loop.absorb(c, s)
            loop.reread()
            self._apply(i)
            s.due = NEVER if c.halt else tick
            if s.busy & bits.STOPPED and s.prior != bits.MANUAL:
                s.busy |= bits.RESTORE
            s.busy &= ~(bits.STOPPED | bits.BLIND | bits.MUTE | bits.PROGRAM)
            s.busy |= bits.FIRST

    def program(self) -> None:
        """The CPU stops: loops go to Manual and are not calculated, except those that are independent of its mode."""
        if not self._in_run:
            return
        self._in_run = False
        for i, (c, s) in enumerate(zip(self.cfg, self.st, strict=True)):
            self._loops[i].absorb(c, s)
            self._loops[i].reread()
            self._apply(i)
            if c.independent:
                s.busy |= bits.PROGRAM | (0 if c.sees_pv else bits.BLIND) | (0 if c.drives else bits.MUTE)
                continue
            s.prior = s.status & bits.MODES
            s.busy |= bits.STOPPED
            if s.prior != bits.MANUAL:
                s.requested = 0
                s.status = (s.status & ~bits.MODES) | bits.MANUAL
                dl06_modes.tell(s, dl06_modes.OVERRIDE_PROGRAM)

    def _check(self) -> Setup:
        return check_setup(self._words.get(TABLE_POINTER, 0), self._words.get(LOOP_COUNT, 0))

    # --- the operator ------------------------------------------------------------------------------------------------

    def request(self, loop: int, mode: str) -> None:
        """A one-shot mode request."""
        s = self.st[loop]
        s.requested = MODES[mode]
        if self._calculated(loop):
            s.request = MODES[mode]
            s.busy |= bits.REQUEST

    def _calculated(self, loop: int) -> bool:
        """Whether the loop is calculated at all; leaves a notice when it is not."""
        s = self.st[loop]
        if self.cfg[loop].halt:
            dl06_modes.tell(s, dl06_modes.REFUSED_OFF)
        elif s.busy & bits.STOPPED:
            dl06_modes.tell(s, dl06_modes.REFUSED_PROGRAM)
        else:
            return True
        return False

    def ramp_soak(self, loop: int, command: str) -> None:
        """``start``, ``hold``, ``resume`` or ``jog``: a control bit of +33 goes on."""
        s = self.st[loop]
        s.requested = 0
        if self._calculated(loop):
            s.rs_command |= COMMANDS[command]
            s.busy |= bits.SOAK

    def autotune(self, loop: int, command: str = "start") -> None:  # noqa: ARG002 - the only command there is
        """``start``: bit 7 of +01 goes on."""
        own, s = self._loops[loop], self.st[loop]
        s.requested = 0
        if self._calculated(loop):
            own.absorb(self.cfg[loop], s)
            own.absorbed = False
            s.tune_done = 0
            s.tune_phase = WANTED
            s.busy |= bits.TUNE

    def tuned(self, loop: int) -> Mapping[str, Any] | None:
        """How the auto-tune of a loop went; None when there was none."""
        own, s = self._loops[loop], self.st[loop]
        own.absorb(self.cfg[loop], s)
        error = bool(s.status & bits.TUNE_ERROR)
        if not (s.tune_done or s.tune_phase or error):
            return None
        status = "running" if s.tune_phase else "done" if s.tune_done else "error"
        results = own.results if s.tune_done else {}
        return {"done": bool(s.tune_done), "error": error, "status": status, "results": results}

    def set_output(self, loop: int, value: Quantity, sig: MutableSequence[float]) -> None:
        """The output that a loop in Manual starts with."""
        self.set(loop, ("state", "output"), value, sig)

    def check_set(self, loop: int, path: tuple[str, ...], value: object) -> object:
        """The value of a ``set`` event as its registers take it; a ``PydanticCustomError`` says what is wrong."""
        own = self._loops[loop]
        rows = find_rows(path, own.decimals)
        parsed = parse_setting(path, rows, value)
        if path == (CASCADE_FROM,):
            return self._output_address(str(parsed))
        fits(rows, parsed, own.values, own.scales())
        return parsed

    def set(self, loop: int, path: tuple[str, ...], value: Any, sig: MutableSequence[float]) -> str | None:
        """Write a value to its registers; returns why it has no effect yet, if so."""
        own = self._loops[loop]
        own.absorb(self.cfg[loop], self.st[loop])
        rows = find_rows(path, own.decimals)
        late = None
        for row, item in zip(rows, value if len(rows) > 1 else [value], strict=True):
            late = own.write(row, item)
            if late is None:
                self._apply(loop)
                write_state(self.st[loop], own.values, str(row.path))
        show(self.cfg[loop], self.st[loop], sig)
        return late

    # --- words -------------------------------------------------------------------------------------------------------

    def _loop(self, i: int, image: Image) -> Loop:
        own = {"loop": unnamed(i), **(image.settings[i] if i < len(image.settings) else {})}
        decimals = int(image.plc.get("reset_decimals", 1))
        start = self._words.get(TABLE_POINTER, 0) + i * LOOP_TABLE.size
        loop, problems = loop_of(self._words, start, own, decimals)
        self.problems += problems
        return loop

    def _output_address(self, name: str) -> int:
        """Address of the output word of a loop."""
        if name not in self.loops:
            refuse("set_value", f"{name!r} is no loop of this PLC", help=f"known: {', '.join(self.loops)}")
        index = self.loops.index(name)
        return self._words.get(TABLE_POINTER, 0) + index * LOOP_TABLE.size + LOOP_TABLE.offset("output")

    def _begin(self, i: int) -> None:
        """What a loop starts with: the controller's words, its goal, and its places in the shared vectors."""
        c, s, v = self.cfg[i], self.st[i], self._loops[i].values
        c.sig_in, c.sig_pv, c.sig_sp, c.sig_out, c.sig_bias = (i * len(SIGNALS) + k for k in range(len(SIGNALS)))
        c.rs_table = i * RAMP_SOAK_SIZE
        c.tune_buffer = len(self._loops) * RAMP_SOAK_SIZE + i * POINTS
        c.interlock, c.step_bias = int(self._options.auto_interlock), int(self._options.step_bias)
        c.on_pv = int(self._plc.get("derivative") == "pv")
        self._apply(i)
        for path in ("setpoint.value", "state.pv", "state.bias", "state.output"):
            write_state(s, v, path)
        s.goal = 0 if self.goals[i] == "manual" else MODES[self.goals[i]]
        s.goal_sp, s.goal_writes = s.sp, 1
        s.busy |= bits.GOAL if s.goal else 0
        s.rs_command = COMMANDS.get(v["ramp_soak.request"], 0)
        s.busy |= bits.SOAK if s.rs_command else 0
        if v["autotune.start"]:
            self.autotune(i)
        show(self.cfg[i], self.st[i], self.sig)

    def _apply(self, i: int) -> None:
        """Make the words that the controller has read its configuration."""
        own, c, s = self._loops[i], self.cfg[i], self.st[i]
        v = own.values
        configure(c, v, own.decimals, self._setup.count)
        c.halt = int(c.halt or not self.running or i >= self._setup.count)
        c.slow = int(self._options.scan_time > 0 and c.period > SLOW)
        c.major = major_of(v["remote_setpoint"] or 0, self._words.get(TABLE_POINTER, 0), len(self._loops), i)
        c.pv_low, c.pv_width = eng(own.pv_range, c.pv_min, c.pv_span)
        c.out_low, c.out_width = eng(own.out_range, c.out_min, c.out_span)
        table = [self._words.get(v["ramp_soak.table"] + k, 0) for k in range(RAMP_SOAK_SIZE)]
        self.aux[c.rs_table : c.rs_table + RAMP_SOAK_SIZE] = profile(table, v)
        tuning(c, s, v, own.decimals)
        coefficients(c, s)
        s.quiet_low, s.quiet_high = bits.UNBOUNDED, -bits.UNBOUNDED
        s.status &= ~bits.ALARM_ERROR
        if alarm_error(v):
            s.status |= bits.ALARM_ERROR
            s.busy |= 0 if s.status & bits.MANUAL else bits.TRIP


def load(image: Image, options: Options | None = None) -> Dl06:
    """The virtual PLC of an image's words, as it stands at its program-to-run transition."""
    return Dl06(image, options or Options())
