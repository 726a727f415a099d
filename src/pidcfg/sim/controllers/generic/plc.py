"""The virtual controller of neutral loops: built from their parameters, operated as by an operator."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.encoders.maps.generic import LOOPS
from pidcfg.sim.controllers.generic import state as bits
from pidcfg.sim.controllers.generic.report import (
    ABOUT_MODE,
    ALARM_BITS,
    ALARM_LIMITS,
    FLAG_BITS,
    MODES,
    NO_SOURCE,
    OUTER_ALARMS,
    REASONS,
    SIGNALS,
)
from pidcfg.sim.controllers.generic.setting import KEYS
from pidcfg.sim.controllers.generic.state import Config, State
from pidcfg.sim.controllers.generic.words import Fields, configure, effect, fields_of, ticks
from pidcfg.sim.named_plc import NamedPlc
from pidcfg.sim.notices import noticed
from pidcfg.sim.plc import COUNTS, TICKS
from pidcfg.sim.terms import clamp

if TYPE_CHECKING:
    from collections.abc import Mapping, MutableSequence, Sequence

    from pidcfg.schemas.base import Quantity


class Generic(NamedPlc):
    """Neutral loops as loaded from their parameters; they always run."""

    cfg: list[Config]
    st: list[State]
    named, keys, sample_key = LOOPS, KEYS, "sample_time"
    config, state, slots = Config, State, SIGNALS
    out_name = "OUT"
    pulses: Sequence[str] = ("PULSE",)
    modes: Mapping[str, int] = MODES
    alarm_bits: Mapping[str, int] = ALARM_BITS
    alarm_limits: Mapping[str, str] = ALARM_LIMITS
    unreached = bits.UNREACHED
    flag_bits: Mapping[str, int] = FLAG_BITS
    reasons: Mapping[int, str] = REASONS
    about_mode = ABOUT_MODE
    outer_alarms = OUTER_ALARMS

    def contents_of(self, words: Mapping[str, Any], loop: str) -> tuple[Fields, list[str]]:
        """The fields of a loop, and which are missing or no value."""
        return fields_of(words, loop)

    def prepare(self) -> None:
        """Who is whose master, whose set point follows its PV, and the scales."""
        for c, entry in zip(self.cfg, self._settings, strict=True):
            setpoint = dict(entry.get("setpoint", {}))
            source = setpoint.get("source")
            c.source = self.loops.index(source) if source in self.loops else -1
            c.follows = int(bool(setpoint.get("follows_pv")))
        for i, c in enumerate(self.cfg):
            c.slave = next((j for j, other in enumerate(self.cfg) if other.source == i != j), -1)
        self.scales = [(f["pv.range.0"], f["pv.range.1"], COUNTS) for f in self._contents]

    def begin(self, loop: int) -> None:
        """What a loop starts with (D301): its mode, its set point and output."""
        c, s, fields = self.cfg[loop], self.st[loop], self._contents[loop]
        configure(c, s, fields)
        if not c.pulses:
            self.signals[c.sig_pulse] = ""
        mode = fields["mode"]
        s.status = bits.AUTO if mode == "cascade" and c.source < 0 else MODES[mode]
        s.wanted, s.busy = s.status, bits.FRESH
        s.sp = clamp(fields.get("setpoint.value", c.base), c.sp_low, c.sp_high)
        start = fields.get("output.manual", 0.0) if s.status & bits.MANUAL else 0.0
        s.out = s.manual = clamp(start, c.low, c.high)
        self._show(loop, self.sig)

    def sample_ticks(self, value: Any) -> int:
        """The sample time."""
        return ticks(value)

    @property
    def rises(self) -> list[bool]:
        """Whether the PV rises with the output."""
        return [bool(c.raises) for c in self.cfg]

    @property
    def masters(self) -> list[int]:
        """The loops that ``setpoint.source`` names."""
        return [c.source for c in self.cfg]

    def output_limits(self, loop: int, sig: Sequence[float]) -> tuple[float, float]:  # noqa: ARG002 - no signals
        """``output.limits``, or the range."""
        return self.cfg[loop].low, self.cfg[loop].high

    def given_set_point(self, loop: int, sig: Sequence[float]) -> float:
        """``setpoint.value``."""
        return float(self._contents[loop].get("setpoint.value", sig[self.cfg[loop].sig_sp]))

    def inner_deviation(self, loop: int) -> float | None:
        """``alarms.deviation.high``."""
        limit = self.cfg[loop].deviation_at
        return None if limit >= bits.UNREACHED else limit

    def dead_band(self, loop: int, sig: Sequence[float]) -> float:  # noqa: ARG002 - no signals
        """``deadband``."""
        return self.cfg[loop].band

    def pulse_cycle(self, loop: int) -> float:
        """The period of the pulses."""
        return self.cfg[loop].cycle / TICKS if self.cfg[loop].pulses else 0.0

    def _show(self, i: int, sig: MutableSequence[float]) -> None:
        """The signals that an operator's change affects at once."""
        c, s = self.cfg[i], self.st[i]
        sig[c.sig_sp], sig[c.sig_out], sig[c.sig_bias] = s.sp, s.out, s.bias + s.integral

    # --- the operator ------------------------------------------------------------------------------------------------

    def request(self, loop: int, mode: str) -> None:
        """A mode for the next sample; cascade needs a source."""
        s = self.st[loop]
        if mode == "cascade" and self.cfg[loop].source < 0:
            s.notice = noticed(s.notice, MODES[mode], NO_SOURCE)
            return
        s.wanted = MODES[mode]
        s.busy &= ~(bits.MANUAL_SET | bits.SP_SET)
        s.busy = s.busy & ~bits.REQUEST if s.status & s.wanted else s.busy | bits.REQUEST

    def set_output(self, loop: int, value: Quantity, sig: MutableSequence[float]) -> None:
        """The output that a loop starts with, in every mode."""
        c, s = self.cfg[loop], self.st[loop]
        s.out = s.manual = clamp(float(value.value), c.low, c.high)
        s.busy |= bits.BUMPLESS
        self._show(loop, sig)

    def set(self, loop: int, path: tuple[str, ...], value: Any, sig: MutableSequence[float]) -> str | None:
        """Write a field; returns why it does not act as it stands, if so."""
        name = KEYS.find(path).name
        c, s, fields = self.cfg[loop], self.st[loop], self._contents[loop]
        fields[name] = value
        configure(c, s, fields)
        if name == "setpoint.value":
            if s.status & bits.CASCADE:
                return "in cascade the set point is the master's output"
            s.sp = clamp(value, c.sp_low, c.sp_high)
            s.busy |= bits.SP_SET if s.busy & bits.REQUEST else 0
        elif name == "output.manual" and s.wanted == bits.MANUAL:
            s.manual = value
            s.busy |= bits.MANUAL_SET
        self._show(loop, sig)
        return effect(name, fields, by_hand=s.wanted == bits.MANUAL)


load = Generic
