"""The virtual CLICK: built from its registers, operated as by its operator, its ladder and the switch.

`load` decodes nothing but registers; what none holds (names, intended modes, the bit of the pulses) comes from the
image's settings.
"""

from __future__ import annotations

from dataclasses import fields
from decimal import Decimal
from typing import TYPE_CHECKING, Any

from pidcfg.sim.controllers.click import modes as click_modes
from pidcfg.sim.controllers.click import state as bits
from pidcfg.sim.controllers.click import tune_results as click_tune_results
from pidcfg.sim.controllers.click.memory import Memory
from pidcfg.sim.controllers.click.report import ABOUT_MODE, ALARM_BITS, FLAG_BITS, MODES, OUTER_ALARMS, REASONS
from pidcfg.sim.controllers.click.setting import KEYS, check_setting, settings_of
from pidcfg.sim.controllers.click.words import float_of, sample_ticks
from pidcfg.sim.notices import tell_request
from pidcfg.sim.plc import SWITCH_AND_TUNE, TICKS, ScanOptions
from pidcfg.sim.records import NEVER

if TYPE_CHECKING:
    from collections.abc import Mapping, MutableSequence, Sequence

    from pidcfg.encoders.image import Image
    from pidcfg.schemas.base import Quantity

STATUS = {
    click_tune_results.DONE: "done",
    click_tune_results.FAILED: "error",
    click_tune_results.CANCELLED: "cancelled",
}
"""How an autotune went, by `State.tune_done`."""


class Click(Memory):
    """A CLICK as loaded from its registers."""

    out_name = "CO"
    pulses = ("PWM",)
    modes: Mapping[str, int] = MODES
    options = tuple(f.name for f in fields(ScanOptions))
    commands = SWITCH_AND_TUNE
    tuned_names = ("proportional_gain", "reset_time", "derivative_gain", "sample_rate")
    alarm_bits: Mapping[str, int] = ALARM_BITS
    flag_bits: Mapping[str, int] = FLAG_BITS
    reasons: Mapping[int, str] = REASONS
    about_mode = ABOUT_MODE
    outer_alarms = OUTER_ALARMS
    error_flags = ("pid_error",)

    def __init__(self, image: Image) -> None:
        super().__init__(image)
        self.in_run = False
        self.run(0)

    # --- the CPU -----------------------------------------------------------------------------------------------------

    def start(self, tick: int) -> None:
        """STOP to RUN: loops begin in Manual, with the outputs that their registers hold (D120)."""
        for s in self.st:
            s.busy = (s.busy & ~bits.STOPPED) | bits.FIRST
            s.due = tick
            s.pulse = -1.0

    def stop(self, sig: MutableSequence[float]) -> None:
        """RUN to STOP: loops are not executed, outputs are off."""
        for i, s in enumerate(self.st):
            click_modes.to_manual(s, click_modes.OVERRIDE_STOP)
            s.busy = (s.busy & ~(bits.REQUEST | bits.GOAL)) | bits.STOPPED
            s.request = s.goal = 0
            s.due = NEVER
            self._show(i, sig)

    # --- the operator ------------------------------------------------------------------------------------------------

    @property
    def rises(self) -> list[bool]:
        """Direct (forward) action: the PV rises with the output."""
        return [not c.reverse for c in self.cfg]

    @property
    def word_owners(self) -> dict[str, int]:  # type: ignore[override]  # a table of the registers' addresses
        """DSn+00 of each loop."""
        return {name: i for i, name in enumerate(self.flags)}

    def output_limits(self, loop: int, sig: Sequence[float]) -> tuple[float, float]:  # noqa: ARG002 - registers
        """CO's lower and upper limit."""
        return self.cfg[loop].out_low, self.cfg[loop].out_high

    def inner_deviation(self, loop: int) -> float | None:
        """The first deviation alarm."""
        limit = self.cfg[loop].deviation_high
        return None if limit >= bits.UNBOUNDED else limit

    def pulse_cycle(self, loop: int) -> float:
        """The PWM period."""
        return self.cfg[loop].pwm_period / TICKS if self.cfg[loop].pwm else 0.0

    def request(self, loop: int, mode: str) -> None:
        """A mode request goes on; it is looked at with the next sample and is off again."""
        s, bit = self.st[loop], MODES[mode]
        s.requested = bit
        if s.busy & bits.STOPPED:
            tell_request(s, click_modes.REFUSED_STOP)
            return
        s.request = s.request | bit if bit == bits.TUNING else (s.request & bits.TUNING) | bit
        s.busy |= bits.REQUEST

    def autotune(self, loop: int, command: str) -> None:
        """``start`` sets the autotune request, ``cancel`` clears it."""
        if command == "start":
            self.request(loop, "autotune")
        else:
            click_modes.cancel(self.st[loop])

    def tuned(self, loop: int) -> Mapping[str, Any] | None:
        """How the autotune of a loop went; None when there was none."""
        registers, s = self._loops[loop], self.st[loop]
        error = bool(s.status & bits.TUNE_ERROR)
        if not (s.tune_done or s.status & bits.TUNING or error):
            return None
        done = s.tune_done == click_tune_results.DONE
        status = "running" if s.status & bits.TUNING else "error" if error else STATUS[s.tune_done]
        registers.absorb(s)
        n = registers.numbers()
        results = {name: n[name] / 1000 if name == "sample_rate" else n[name] for name in self.tuned_names}
        return {"done": done, "error": error, "status": status, "results": results if done else {}}

    def set_output(self, loop: int, value: Quantity, sig: MutableSequence[float]) -> None:
        """The output that a loop in Manual starts with."""
        self.set(loop, ("output",), value.value, sig)

    def check_set(self, loop: int, path: tuple[str, ...], value: object) -> object:
        """The value of a ``set`` event as its registers take it; a ``PydanticCustomError`` says what is wrong."""
        return check_setting(path, value, self._sample_rate(loop))

    def period_set(self, loop: int, path: tuple[str, ...], value: Any) -> int:
        """The sample rate that a value for this key makes, in ticks; 0: the key is something else."""
        if KEYS.find(path)[0].path != "sample_rate":
            return 0
        ((_, raw),) = settings_of(path, value, self._sample_rate(loop))
        return sample_ticks(raw - 0x10000 if raw > 0x7FFF else raw)

    def set(self, loop: int, path: tuple[str, ...], value: Any, sig: MutableSequence[float]) -> str | None:
        """Write a value to its registers; returns why it has no effect, as an output in Auto (D127)."""
        registers, s = self._loops[loop], self.st[loop]
        written = settings_of(path, value, self._sample_rate(loop))
        if written[0][0].name == "output" and s.status & bits.MANUAL == 0:
            return "is not written: the output is read-only unless the loop is in Manual"
        registers.absorb(s)
        for row, raw in written:
            registers.words[row.name] = raw
            if row.name == "setpoint":
                s.goal_sp, s.goal_writes = float_of(raw), 1
        self._apply(loop)
        self._show(loop, sig)
        return None

    def _sample_rate(self, loop: int) -> Decimal:
        """The register of the sample rate in s."""
        return Decimal(self.st[loop].sample_ms) / 1000


def load(image: Image, options: ScanOptions | None = None) -> Click:  # noqa: ARG001 - the base step is the runner's
    """The virtual PLC of an image's registers, as it stands at its change from STOP to RUN."""
    return Click(image)
