"""The memory of a virtual Delta AS: the operands of its instructions, and the records that the kernels work with."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.encoders.maps.dpide import LOOPS
from pidcfg.encoders.settings import read_settings
from pidcfg.schemas.dpide import PlcSettings
from pidcfg.sim.controllers.dpide import state as bits
from pidcfg.sim.controllers.dpide.modes import enter
from pidcfg.sim.controllers.dpide.report import SIGNALS
from pidcfg.sim.controllers.dpide.setting import KEYS
from pidcfg.sim.controllers.dpide.signals import show
from pidcfg.sim.controllers.dpide.state import Config, State
from pidcfg.sim.controllers.dpide.words import MILLISECOND, Operands, absorb, configure, operands_of, sampling_time
from pidcfg.sim.named_plc import NamedPlc

if TYPE_CHECKING:
    from collections.abc import Mapping, MutableSequence


class Memory(NamedPlc):
    """The operands of a program, and what the kernels make of them."""

    cfg: list[Config]
    st: list[State]

    named, keys, sample_key = LOOPS, KEYS, "CYCLE"
    config, state, slots = Config, State, SIGNALS

    def contents_of(self, words: Mapping[str, Any], loop: str) -> Operands:
        """The operands of a loop; what is no value is told."""
        return operands_of(words, loop, self.problems)

    def prepare(self) -> None:
        """The interval of an interrupt task in ticks (0: none), and the devices of all operands."""
        self._interval = (read_settings(PlcSettings, self._file, "plc").interrupt_task or 0) * MILLISECOND
        self._devices = [dict(entry.get("devices", {})) for entry in self._settings]

    def begin(self, loop: int) -> None:
        """What an instruction starts with: its operands, the mode that they make, and who writes to its devices."""
        c, s = self.cfg[loop], self.st[loop]
        configure(c, s, self._contents[loop], self._interval)
        c.sv_from, c.bias_from, c.mout_from = (self._writer(loop, name) for name in ("SV", "BIAS", "MOUT"))
        devices = self._devices[loop]
        c.joined = int("MOUT" in devices and devices["MOUT"] == devices.get("MV"))
        s.status = bits.OFF
        enter(c, s, self._mode(loop))
        s.wanted = s.status & bits.MODES
        if s.status & bits.OFF:
            s.out = 0.0
        self._join(loop)
        show(c, s, self.sig)

    def sample_ticks(self, value: Any) -> int:
        """CYCLE, unless an interrupt task has the sampling time."""
        return 0 if self._interval else sampling_time(value)

    def _mode(self, i: int) -> int:
        """The mode that PID_RUN, PID_MODE and PID_MAN make."""
        if not self._contents[i]["PID_RUN"]:
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
        absorb(self._contents[i], s)
        self._contents[i] |= values
        configure(c, s, self._contents[i], self._interval)
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
