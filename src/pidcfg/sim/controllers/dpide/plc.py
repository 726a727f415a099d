"""The virtual Delta AS: built from the operands of its DPIDE instructions, operated as by an operator."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING, Any

from pidcfg.schemas.base import refuse
from pidcfg.sim.controllers.dpide import autotune as dpide_autotune
from pidcfg.sim.controllers.dpide import report
from pidcfg.sim.controllers.dpide import state as bits
from pidcfg.sim.controllers.dpide.memory import Memory
from pidcfg.sim.controllers.dpide.modes import enter
from pidcfg.sim.controllers.dpide.report import ABOUT_MODE, FLAG_BITS, MODES, REASONS, TUNE_STATUS
from pidcfg.sim.controllers.dpide.setting import KEYS, Seconds, with_mark
from pidcfg.sim.controllers.dpide.words import effect, sampling_time
from pidcfg.sim.notices import tell
from pidcfg.sim.plc import SWITCH_AND_TUNE, ScanOptions
from pidcfg.sim.records import NEVER
from pidcfg.sim.terms import clamp, single

if TYPE_CHECKING:
    from collections.abc import Mapping, MutableSequence, Sequence

    from pidcfg.encoders.parameters import Program
    from pidcfg.schemas.base import Quantity


class Dpide(Memory):
    """A Delta AS as loaded from its operands."""

    out_name = "MV"
    modes: Mapping[str, int] = MODES
    options = tuple(f.name for f in fields(ScanOptions))
    commands = SWITCH_AND_TUNE
    tuned_names = ("Kc_Kp", "Ti_Ki", "Td_Kd", "Tf")
    flag_bits: Mapping[str, int] = FLAG_BITS
    reasons: Mapping[int, str] = REASONS
    about_mode = ABOUT_MODE
    mode_keys = ("PID_RUN", "PID_MAN", "PID_MODE")

    def __init__(self, program: Program) -> None:
        super().__init__(program)
        self.goals = [self.mode(s.status) for s in self.st]
        self._dependent = [bool(c.dependent) for c in self.cfg]

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

    # --- the PLC's switch --------------------------------------------------------------------------------------------

    def start(self, tick: int) -> None:
        """The PLC runs: instructions begin without a past, an autotune from its beginning (D278)."""
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
        done, error = s.tune_done == dpide_autotune.DONE, s.tune_done == dpide_autotune.FAILED
        status = "running" if running else TUNE_STATUS[s.tune_done]
        if error:
            status = f"{status}: {REASONS[s.tune_reason].partition(': ')[2]}"
        results = dict(zip(self.tuned_names, (s.tune_gain, s.tune_reset, s.tune_rate, s.tune_tf), strict=True))
        return {"done": done, "error": error, "status": status, "results": results if done else {}}

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

    def period_set(self, loop: int, path: tuple[str, ...], value: Any) -> int:  # noqa: ARG002 - all loops are alike
        """The sampling time that a value for this key makes, in ticks; 0: another key, or an interrupt task has it."""
        return sampling_time(value) if KEYS.find(path).name == "CYCLE" and not self._interval else 0

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
        return effect(name, c, s, self._operands[loop], self._interval)


def load(program: Program, options: ScanOptions | None = None) -> Dpide:  # noqa: ARG001 - the base step is the runner's
    """The virtual PLC of a program's operands, as it stands when it begins to run."""
    return Dpide(program)
