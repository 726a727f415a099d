"""Neutral loops as an object: made of their parameters, and handled as an operator would."""

from __future__ import annotations

from dataclasses import dataclass
from math import gcd
from typing import TYPE_CHECKING, Any

from pidcfg.encoders.generic.decode import loop_names
from pidcfg.encoders.maps.generic import NEEDED
from pidcfg.schemas.base import refuse
from pidcfg.sim.controllers.generic import state as bits
from pidcfg.sim.controllers.generic.report import (
    ALARM_BITS,
    FLAG_BITS,
    MODES,
    SIGNALS,
    describe,
    mode_name,
    refuse_mode,
    requested,
)
from pidcfg.sim.controllers.generic.setting import KEYS
from pidcfg.sim.controllers.generic.state import Config, State
from pidcfg.sim.controllers.generic.words import configure, effect, fields_of, ticks
from pidcfg.sim.plc import TICKS, LoopsOnly
from pidcfg.sim.terms import clamp

if TYPE_CHECKING:
    from collections.abc import Mapping, MutableSequence, Sequence

    from pidcfg.encoders.parameters import Program
    from pidcfg.schemas.base import Quantity
    from pidcfg.sim.report import ScanTime

COUNTS = 1 << 20
"""What the range of a PV counts where something is measured in counts."""


@dataclass(frozen=True, slots=True)
class Options:
    """What a scenario chooses about the controller; no parameter holds it."""

    scan_time: int = 0
    """Length of a scan in ticks: the base step; calculations come with the next scan."""


class Generic(LoopsOnly):
    """Neutral loops as loaded from their parameters; implements `pidcfg.sim.plc.Plc`."""

    out_name = "OUT"
    pulses: Sequence[str] = ("PULSE",)
    word_of_flags = "{}"
    modes = tuple(MODES)
    options = ("scan_time",)
    commands: Mapping[str, Sequence[str]] = {"ramp_soak": (), "autotune": (), "plc": ()}
    tuned_names: Sequence[str] = ()
    alarm_bits: Mapping[str, int] = ALARM_BITS
    flag_bits: Mapping[str, int] = FLAG_BITS
    aux_bits: Mapping[str, int] = {}
    running = True
    flags: Mapping[str, int] = {}
    mode = staticmethod(mode_name)
    describe = staticmethod(describe)
    requested = staticmethod(requested)

    def __init__(self, program: Program) -> None:
        words = program.words
        self.problems: list[str] = []
        """Parameters that are missing."""
        self.loops = [str(entry["loop"]) for entry in program.settings] or loop_names(words)
        sources = [dict(entry.get("setpoint", {})).get("source") for entry in program.settings] or [None] * len(
            self.loops
        )
        self._fields = [fields_of(words, loop, NEEDED, self.problems) for loop in self.loops]
        self.cfg = [Config() for _ in self.loops]
        self.st = [State() for _ in self.loops]
        self.aux: list[float] = []
        self.sig = [0.0] * (len(self.loops) * len(SIGNALS))
        self.signals: list[str] = []
        for i, source in enumerate(sources):
            self.cfg[i].source = self.loops.index(source) if source in self.loops else -1
            self._begin(i)
        for i, c in enumerate(self.cfg):
            c.slave = next((j for j, other in enumerate(self.cfg) if other.source == i != j), -1)
        self.goals = [mode_name(s.status) for s in self.st]
        self.scales = [(f["pv.range.0"], f["pv.range.1"], COUNTS) for f in self._fields]

    def _begin(self, i: int) -> None:
        """What a loop starts with (D301): its mode, its places in the shared vector, its set point and output."""
        c, s, fields = self.cfg[i], self.st[i], self._fields[i]
        first = i * len(SIGNALS)
        c.sig_in, c.sig_pv, c.sig_sp, c.sig_out, c.sig_bias, c.sig_pulse = range(first, first + len(SIGNALS))
        configure(c, s, fields)
        c.period = s.period
        names = SIGNALS if c.pulses else SIGNALS[:-1]
        self.signals += [f"{self.loops[i]}.{name}" if name else "" for name in names] + [""] * (not c.pulses)
        mode = fields["mode"]
        s.status = bits.AUTO if mode == "cascade" and c.source < 0 else MODES[mode]
        s.wanted, s.busy = s.status, bits.FRESH
        s.sp = clamp(fields.get("setpoint.value", c.base), c.sp_low, c.sp_high)
        start = fields.get("output.manual", 0.0) if s.status & bits.MANUAL else 0.0
        s.out = s.manual = clamp(start, c.low, c.high)
        self._show(i, self.sig)

    @property
    def base(self) -> int:
        """The greatest common step of the sample times, in ticks."""
        return gcd(*(c.period for c in self.cfg)) or TICKS

    @property
    def periods(self) -> list[int]:
        """The present sample time of each loop, in ticks."""
        return [s.period for s in self.st]

    @property
    def rises(self) -> list[bool]:
        """Whether the PV rises with the output."""
        return [bool(c.raises) for c in self.cfg]

    def _show(self, i: int, sig: MutableSequence[float]) -> None:
        """What an operator's hand changes at once."""
        c, s = self.cfg[i], self.st[i]
        sig[c.sig_sp], sig[c.sig_out], sig[c.sig_bias] = s.sp, s.out, s.bias + s.integral

    # --- the operator ------------------------------------------------------------------------------------------------

    def run(self, tick: int) -> None:
        """There is no switch: the loops always run."""

    def program(self, sig: MutableSequence[float]) -> None:
        """There is no switch."""

    def ramp_soak(self, loop: int, command: str) -> None:
        """There is no ramp/soak generator, and no command of it."""

    def autotune(self, loop: int, command: str) -> None:
        """There is no auto-tuning, and no command of it."""

    @staticmethod
    def tuned(loop: int) -> None:
        """There is no auto-tuning."""

    @staticmethod
    def scan_time(_without_loops: float) -> ScanTime | None:
        """There is no CPU whose scan could become longer."""
        return None

    def request(self, loop: int, mode: str) -> None:
        """A mode for the next sample; cascade needs a source."""
        s = self.st[loop]
        if mode == "cascade" and self.cfg[loop].source < 0:
            refuse_mode(s, mode)
            return
        s.wanted = MODES[mode]
        s.busy &= ~bits.GIVEN
        s.busy = s.busy & ~bits.REQUEST if s.status & s.wanted else s.busy | bits.REQUEST

    def set_output(self, loop: int, value: Quantity, sig: MutableSequence[float]) -> None:
        """The output that a loop starts with, in every mode."""
        c, s = self.cfg[loop], self.st[loop]
        s.out = s.manual = clamp(float(value.value), c.low, c.high)
        s.busy |= bits.CARRIED
        self._show(loop, sig)

    @staticmethod
    def check_input(name: str, value: object) -> float:  # noqa: ARG004 - there is nothing to check
        """There is no such signal."""
        return refuse("set_key", f"{name} is no signal from outside")

    @staticmethod
    def check_set(loop: int, path: tuple[str, ...], value: object) -> object:  # noqa: ARG004 - all loops are alike
        """The content that a ``set`` event makes of its field; a ``PydanticCustomError`` says what is wrong."""
        return KEYS.check(path, value)

    def period_set(self, loop: int, path: tuple[str, ...], value: Any) -> int:  # noqa: ARG002 - all loops are alike
        """The sample time that a value for this key makes, in ticks; 0: another key."""
        return ticks(value) if KEYS.find(path).name == "sample_time" else 0

    def set(self, loop: int, path: tuple[str, ...], value: Any, sig: MutableSequence[float]) -> str | None:
        """Write a field; returns why it does not act as it stands, if so."""
        name = KEYS.find(path).name
        c, s, fields = self.cfg[loop], self.st[loop], self._fields[loop]
        fields[name] = value
        configure(c, s, fields)
        if name == "setpoint.value":
            if s.status & bits.CASCADE:
                return "in cascade the set point is the master's output"
            s.sp = clamp(value, c.sp_low, c.sp_high)
        elif name == "output.manual" and s.wanted == bits.MANUAL:
            s.manual = value
            s.busy |= bits.GIVEN
        self._show(loop, sig)
        return effect(name, fields, by_hand=s.wanted == bits.MANUAL)


def load(program: Program, options: Options | None = None) -> Generic:  # noqa: ARG001 - the base step is the runner's
    """The virtual controller of a program's parameters, as it stands when it begins to run."""
    return Generic(program)
