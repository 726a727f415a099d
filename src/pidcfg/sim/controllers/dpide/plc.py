"""The virtual Delta AS: built from the operands of its DPIDE instructions, operated as by an operator."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.encoders.maps.dpide import LOOPS
from pidcfg.encoders.settings import read_settings
from pidcfg.schemas.dpide import PlcSettings, Scale
from pidcfg.schemas.numbers import refuse
from pidcfg.sim.controllers.dpide import report
from pidcfg.sim.controllers.dpide import state as bits
from pidcfg.sim.controllers.dpide.modes import enter
from pidcfg.sim.controllers.dpide.report import ABOUT_MODE, FLAG_BITS, MODES, REASONS, SIGNALS
from pidcfg.sim.controllers.dpide.setting import KEYS, Seconds, with_mark
from pidcfg.sim.controllers.dpide.signals import show
from pidcfg.sim.controllers.dpide.state import Config, State
from pidcfg.sim.controllers.dpide.words import (
    MILLISECOND,
    Operands,
    absorb,
    configure,
    effect,
    operands_of,
    sampling_time,
    scale_of,
)
from pidcfg.sim.named_plc import NamedPlc
from pidcfg.sim.notices import tell
from pidcfg.sim.plc import SWITCH_AND_TUNE
from pidcfg.sim.records import NEVER
from pidcfg.sim.terms import clamp, single
from pidcfg.sim.tuning_rules import DONE, FAILED, TUNE_STATUS

if TYPE_CHECKING:
    from collections.abc import Mapping, MutableSequence, Sequence

    from pidcfg.encoders.parameters import Program
    from pidcfg.schemas.base import Quantity
    from pidcfg.sim.plc import ScanOptions


class Dpide(NamedPlc):
    """A Delta AS as loaded from its operands."""

    cfg: list[Config]
    st: list[State]
    named, keys, sample_key = LOOPS, KEYS, "CYCLE"
    config, state, slots = Config, State, SIGNALS
    setpoint = KEYS.short["setpoint"]
    out_name = "MV"
    modes: Mapping[str, int] = MODES
    commands = SWITCH_AND_TUNE
    tuned_names = ("Kc_Kp", "Ti_Ki", "Td_Kd", "Tf")
    flag_bits: Mapping[str, int] = FLAG_BITS
    reasons: Mapping[int, str] = REASONS
    about_mode = ABOUT_MODE
    mode_keys = ("PID_RUN", "PID_MAN", "PID_MODE")

    def __init__(self, program: Program, options: ScanOptions | None = None) -> None:
        super().__init__(program, options)
        self._dependent = [bool(c.dependent) for c in self.cfg]
        scales = [
            read_settings(Scale, entry.get("pv", {}), f"settings[{i}].pv") for i, entry in enumerate(self._settings)
        ]
        self._ranged = [scale.range is not None for scale in scales]
        self.scales = [scale_of(scale, s.sp) for scale, s in zip(scales, self.st, strict=True)]

    def contents_of(self, words: Mapping[str, Any], loop: str) -> tuple[Operands, list[str]]:
        """The operands of a loop, and which of them are no value."""
        return operands_of(words, loop)

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

    @property
    def rises(self) -> list[bool]:
        """Forward action: PV rises with MV."""
        return [bool(c.forward) for c in self.cfg]

    @property
    def masters(self) -> list[int]:
        """The loop whose MV stands in the device of SV (D266)."""
        return [c.sv_from for c in self.cfg]

    def intended_mode(self, loop: int, sig: Sequence[float]) -> str:  # noqa: ARG002 - operands
        """What PID_RUN, PID_MODE and PID_MAN say."""
        return self.mode(self.st[loop].wanted)

    def pv_range(self, loop: int) -> tuple[float, float] | None:
        """``pv.range``; no operand has it."""
        return self.scales[loop][:2] if self._ranged[loop] else None

    def output_limits(self, loop: int, sig: Sequence[float]) -> tuple[float, float]:  # noqa: ARG002 - operands
        """MV_MIN and MV_MAX."""
        return self.cfg[loop].low, self.cfg[loop].high

    def dead_band(self, loop: int, sig: Sequence[float]) -> float:  # noqa: ARG002 - operands
        """ERR_DBW."""
        return self.cfg[loop].band

    # --- the PLC's switch --------------------------------------------------------------------------------------------

    def start(self, tick: int) -> None:
        """The PLC runs: instructions begin without a past (D687), an autotune from its beginning (D278)."""
        for c, s in zip(self.cfg, self.st, strict=True):
            s.due = tick
            s.busy &= ~bits.STOPPED
            mode, s.status = s.status & bits.MODES, (s.status & ~bits.MODES) | bits.OFF
            enter(c, s, mode)

    def stop(self, sig: MutableSequence[float]) -> None:  # noqa: ARG002 - MV stays as it is
        """The PLC stops: no instruction is executed, and MV stays as it is (D278)."""
        for s in self.st:
            s.busy |= bits.STOPPED
            s.due = NEVER
            tell(s, report.IS_STOPPED)

    # --- the operator ------------------------------------------------------------------------------------------------

    def request(self, loop: int, mode: str) -> None:
        """Write the operands that select a mode: PID_RUN, PID_MODE and PID_MAN (D275)."""
        s = self.st[loop]
        if mode == "off":
            self._write(loop, PID_RUN=False)
        elif mode == "autotune":
            self._write(loop, PID_RUN=True, PID_MODE=1)
        elif mode == "manual":
            self._write(loop, PID_RUN=True, PID_MAN=True)
        else:
            self._write(loop, PID_RUN=True, PID_MAN=False, PID_MODE=self._automatic(loop))
        if mode == "manual" and s.wanted == bits.TUNING:
            tell(s, report.WAITS_FOR_TUNE, self.request_code(mode))
        elif not self.in_run and s.wanted != s.status & bits.MODES:
            tell(s, report.WAITS_FOR_PLC, self.request_code(mode))

    def autotune(self, loop: int, command: str) -> None:
        """``start`` writes 1 to PID_MODE, ``cancel`` what it was before."""
        s = self.st[loop]
        if command == "cancel":
            if s.mode != 1:
                tell(s, report.TUNE_IDLE)
            self._write(loop, PID_MODE=self._automatic(loop))
        elif s.mode == 1:
            tell(s, report.TUNE_RUNS)
        else:
            self._write(loop, PID_MODE=1)
            if s.wanted == bits.OFF:
                tell(s, report.TUNE_WAITS)
            elif not self.in_run:
                tell(s, report.TUNE_WAITS_FOR_PLC)

    def _automatic(self, loop: int) -> int:
        """PID_MODE without an autotune."""
        s = self.st[loop]
        return s.mode_before if s.mode == 1 else s.mode

    def tuned(self, loop: int) -> Mapping[str, Any] | None:
        """How the last autotune of a loop went; None when there was none."""
        s = self.st[loop]
        running = bool(s.status & bits.TUNING)
        if not (running or s.tune_done):
            return None
        done, error = s.tune_done == DONE, s.tune_done == FAILED
        status = "running" if running else TUNE_STATUS[s.tune_done]
        if error:
            status = f"{status}: {REASONS[s.tune_reason].partition(': ')[2]}"
        results = dict(zip(self.tuned_names, (s.tune_gain, s.tune_reset, s.tune_rate, s.tune_tf), strict=True))
        return {"done": done, "error": error, "status": status, "results": results if done else {}}

    def memory(self, loop: int) -> Operands:
        """A loop's operands as they are after the last calculation."""
        absorb(self._contents[loop], self.st[loop])
        return self._contents[loop] | {"PV": self.st[loop].pv}

    def set_output(self, loop: int, value: Quantity, sig: MutableSequence[float]) -> None:
        """The MV that a loop starts with, and MOUT, which holds it in manual."""
        c, s = self.cfg[loop], self.st[loop]
        self._write(loop, MOUT=float(value.value))
        if not s.status & bits.OFF:
            s.out = clamp(single(float(value.value)), c.low, c.high)
        if c.joined:
            s.mout = s.out
        self._show(sig)

    def check_set(self, loop: int, path: tuple[str, ...], value: object) -> object:
        """The content that a ``set`` event makes of its operand; a ``PydanticCustomError`` says what is wrong."""
        name = KEYS.find(path).name
        content = with_mark(name, value, KEYS.check(path, value))
        if name == "Ti_Ki" and isinstance(content, Seconds) and not self._dependent[loop]:
            refuse(
                "set_value",
                f"{value} is a time, but the loop begins with PID_EQ FALSE, where Ti_Ki is the gain Ki in 1/s",
                help="write the gain as a bare number: Kp divided by the time in s",
            )
        return content

    def set(self, loop: int, path: tuple[str, ...], value: float, sig: MutableSequence[float]) -> str | None:
        """Write an operand; returns why it does not act as it stands, if so."""
        name = KEYS.find(path).name
        c, s = self.cfg[loop], self.st[loop]
        if name == "Ti_Ki" and isinstance(value, Seconds) and not c.dependent:
            return "is not written: a time, but PID_EQ is FALSE now, and Ti_Ki the gain Ki in 1/s"
        self._write(loop, **{name: float(value) if isinstance(value, Seconds) else value})
        self._show(sig)
        if isinstance(value, Seconds) and not c.dependent:
            return f"PID_EQ is FALSE: the time counts as a gain Kd of {float(value):g}"
        writer = self._writer(loop, name)
        if writer >= 0:
            return f"MV of {self.loops[writer]} stands in the same device and overwrites it"
        return effect(name, c, s, self._contents[loop], self._interval)


load = Dpide
