"""The memory of a virtual Delta AS: the operands of its instructions, and the records that the kernels work with."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.encoders.maps.dpide import ROWS
from pidcfg.encoders.settings import read_settings
from pidcfg.schemas.dpide import PlcSettings, Scale
from pidcfg.sim.controllers.dpide import state as bits
from pidcfg.sim.controllers.dpide.modes import enter
from pidcfg.sim.controllers.dpide.report import SIGNALS
from pidcfg.sim.controllers.dpide.signals import show
from pidcfg.sim.controllers.dpide.state import Config, State
from pidcfg.sim.controllers.dpide.words import MILLISECOND, absorb, configure, operands_of, scale_of
from pidcfg.sim.plc import Plc

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, MutableSequence, Sequence

    from pidcfg.encoders.parameters import Program


class Memory(Plc):
    """The operands of a program, and what the kernels make of them."""

    cfg: list[Config]
    st: list[State]

    def __init__(self, program: Program) -> None:
        words = program.words
        self.problems: list[str] = []
        """Operands that are no value of their type."""
        self._interval = (read_settings(PlcSettings, program.plc, "plc").interrupt_task or 0) * MILLISECOND
        self.loops = [str(entry["loop"]) for entry in program.settings] or loops_of(words)
        entries: Sequence[Mapping[str, Any]] = program.settings or [{}] * len(self.loops)
        self._devices = [dict(entry.get("devices", {})) for entry in entries]
        self._operands = [operands_of(words, loop, self.problems) for loop in self.loops]
        self.place_loops(Config, State, SIGNALS)
        for i in range(len(self.loops)):
            self._begin(i)
        scales = [read_settings(Scale, entry.get("pv", {}), f"settings[{i}].pv") for i, entry in enumerate(entries)]
        self._ranged = [scale.range is not None for scale in scales]
        self.scales = [scale_of(scale, s.sp) for scale, s in zip(scales, self.st, strict=True)]

    def _begin(self, i: int) -> None:
        """What a loop starts with: its operands, the mode that they make, and its places in the shared vectors."""
        c, s = self.cfg[i], self.st[i]
        configure(c, s, self._operands[i], self._interval)
        c.period = s.period
        c.sv_from, c.bias_from, c.mout_from = (self._writer(i, name) for name in ("SV", "BIAS", "MOUT"))
        c.joined = int("MOUT" in self._devices[i] and self._devices[i]["MOUT"] == self._devices[i].get("MV"))
        s.status = bits.OFF
        enter(c, s, self._mode(i))
        s.wanted = s.status & bits.MODES
        if s.status & bits.OFF:
            s.out = 0.0
        self._join(i)
        show(c, s, self.sig)

    def _mode(self, i: int) -> int:
        """The mode that PID_RUN, PID_MODE and PID_MAN make."""
        if not self._operands[i]["PID_RUN"]:
            return bits.OFF
        if self.st[i].mode == 1:
            return bits.TUNING
        return bits.MANUAL if self.cfg[i].manual else bits.AUTO

    def _join(self, i: int) -> None:
        """One device of MOUT and MV holds what was written to it; 0 while PID_RUN is FALSE."""
        c, s = self.cfg[i], self.st[i]
        if c.joined and s.status & bits.OFF:
            s.mout = s.out = 0.0
        elif c.joined:
            s.out = s.mout

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
                self._put(j, shared | values)
            elif shared:
                self._put(j, shared)

    def _put(self, i: int, values: Mapping[str, float]) -> None:
        """A mode that operands make takes effect with the next calculation, FALSE for PID_RUN at once."""
        c, s = self.cfg[i], self.st[i]
        before = s.mode
        absorb(self._operands[i], s)
        self._operands[i] |= values
        configure(c, s, self._operands[i], self._interval)
        if s.mode == 1 != before:
            s.mode_before = before
        s.wanted = self._mode(i)
        s.busy &= ~(bits.REQUEST | bits.HALTING)
        if s.wanted != s.status & bits.MODES:
            s.busy |= bits.REQUEST | (bits.HALTING if s.wanted == bits.OFF else 0)
        self._join(i)

    def _show(self, sig: MutableSequence[float]) -> None:
        """The signals that an operator's change affects at once."""
        for c, s in zip(self.cfg, self.st, strict=True):
            show(c, s, sig)


def loops_of(words: Iterable[str]) -> list[str]:
    """The loops of a listing without settings, in its order."""
    pairs = (name.rpartition(".") for name in words)
    return list(dict.fromkeys(loop for loop, _, operand in pairs if loop and operand in ROWS))
