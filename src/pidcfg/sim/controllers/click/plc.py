"""The virtual CLICK: built from its registers, operated as by its operator, its ladder and the switch.

`load` decodes nothing but registers; what none holds (names, intended modes, the bit of the pulses) comes from the
image's settings.
"""

from __future__ import annotations

from dataclasses import fields
from decimal import Decimal
from math import isfinite, sqrt
from typing import TYPE_CHECKING, Any

from pidcfg.encoders.maps.click import ERRORS, TUNED
from pidcfg.sim.controllers.autotune import DONE, POINTS, TUNE_STATUS
from pidcfg.sim.controllers.click import equation as bits
from pidcfg.sim.controllers.click import operate as click_modes
from pidcfg.sim.controllers.click.equation import (
    Config,
    Loop,
    State,
    coefficients,
    configure,
    float_of,
    loop_of,
    lowest_error,
    sample_ticks,
    write_state,
)
from pidcfg.sim.controllers.click.operate import (
    ABOUT_MODE,
    ALARM_BITS,
    ALARM_LIMITS,
    FLAG_BITS,
    KEYS,
    MODE_BITS,
    OUTER_ALARMS,
    REASONS,
    SIGNALS,
    check_setting,
    settings_of,
)
from pidcfg.sim.controllers.kernels import NEVER, finite, tell_request
from pidcfg.sim.controllers.plc import SWITCH_AND_TUNE, TICKS, Plc, ScanOptions

if TYPE_CHECKING:
    from collections.abc import Mapping, MutableSequence, Sequence

    from pidcfg.encoders.image import Image
    from pidcfg.encoders.regmap import Word
    from pidcfg.schemas.base import Quantity

PULSES = 100
"""Least number of base steps in a PWM period: the pulses' resolution is 1 % (D121)."""
COUNTS = 1 << 16
"""Counts of the PV's range where a resolution is needed: floats have none (D128)."""


class Click(Plc):
    """A CLICK as loaded from its registers."""

    cfg: list[Config]
    st: list[State]
    out_name = "CO"
    output_unit = "%"
    pulses = ("PWM",)
    modes: Mapping[str, int] = MODE_BITS
    options = tuple(f.name for f in fields(ScanOptions))
    commands = SWITCH_AND_TUNE
    tuned_names = ("proportional_gain", "reset_time", "derivative_gain", "sample_rate")
    alarm_bits: Mapping[str, int] = ALARM_BITS
    alarm_limits: Mapping[str, str] = ALARM_LIMITS
    unreached = bits.UNBOUNDED
    flag_bits: Mapping[str, int] = FLAG_BITS
    reasons: Mapping[int, str] = REASONS
    about_mode = ABOUT_MODE
    outer_alarms = OUTER_ALARMS
    error_flags = ("pid_error",)

    def __init__(self, image: Image) -> None:
        words = image.words
        self._loops = [loop_of(words, i, entry) for i, entry in enumerate(image.settings)]
        self.loops = [loop.name for loop in self._loops]
        self.goals = [loop.goal for loop in self._loops]
        self.place_loops(Config, State, SIGNALS, POINTS)
        for i in range(len(self._loops)):
            self._begin(i)
        self.scales = [scale_of(c) for c in self.cfg]
        self.in_run = False
        self.run(0)

    @property
    def flags(self) -> Mapping[str, int]:
        """The error register of each loop, DSn+00."""
        return {f"DS{loop.starts['integers']}": int(s.number) for loop, s in zip(self._loops, self.st, strict=True)}

    @property
    def base(self) -> int:
        """The greatest common step of the sample rates, in ticks; a part of it where pulses need a finer one (D121)."""
        step = super().base
        finest = min((c.pwm_period // PULSES for c in self.cfg if c.pwm), default=step)
        parts = -(-step // finest)
        while step % parts:
            parts += 1
        return step // parts

    def _begin(self, i: int) -> None:
        """What a loop starts with: the controller's registers, its goal, and its places in the shared vectors."""
        loop, c, s = self._loops[i], self.cfg[i], self.st[i]
        c.tune_buffer = i * POINTS
        c.pwm = int(loop.pwm)
        if not loop.pwm:
            self.signals[c.sig_pwm] = ""
        self._apply(i)
        c.period = s.period
        s.goal = 0 if loop.goal == "manual" else MODE_BITS[loop.goal]
        s.goal_sp, s.goal_writes = s.sp, int(loop.has_setpoint)
        s.busy |= bits.GOAL if s.goal else 0
        self._show(i, self.sig)

    def _apply(self, i: int) -> None:
        """Make the registers the controller's configuration, and look for PID errors (D117)."""
        c, s = self.cfg[i], self.st[i]
        n = self._loops[i].numbers()
        configure(c, n)
        write_state(s, n)
        self._note_error(s, lowest_error(n))
        if not s.error:
            coefficients(c, s)

    @staticmethod
    def _note_error(s: State, error: int) -> None:
        """The lowest error that is active; a loop in Auto or Autotune goes to Manual at once (D118)."""
        if error == s.error:
            return
        s.error, s.number = error, float(ERRORS[error - 1].number) if error else 0.0
        s.status &= ~bits.PID_ERROR
        s.requested = 0
        if not error:
            tell_request(s, click_modes.CLEARED)
            return
        s.status |= bits.PID_ERROR
        if s.status & bits.MANUAL:
            tell_request(s, click_modes.NOTED_ERROR + error)
        else:
            click_modes.to_manual(s, click_modes.OVERRIDE_ERROR + error)

    def _show(self, i: int, sig: MutableSequence[float]) -> None:
        """The signals of a loop as its registers say; in STOP mode nothing drives its outputs (D120)."""
        c, s = self.cfg[i], self.st[i]
        stopped = bool(s.busy & bits.STOPPED)
        sig[c.sig_pv], sig[c.sig_sp], sig[c.sig_bias] = finite(s.pv, 0.0), finite(s.sp, 0.0), finite(s.bias, 0.0)
        sig[c.sig_out] = 0.0 if stopped else finite(s.out, 0.0)
        sig[c.sig_error] = s.number

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

    def given_set_point(self, loop: int, sig: Sequence[float]) -> float:  # noqa: ARG002 - a register
        """What is written at the first change to Auto."""
        return float(self.st[loop].goal_sp)

    def inner_deviation(self, loop: int) -> float | None:
        """The first deviation alarm."""
        limit = self.cfg[loop].deviation_high
        return None if limit >= bits.UNBOUNDED else limit

    def integrates(self, loop: int, sig: Sequence[float]) -> bool:  # noqa: ARG002 - registers
        """The longest reset time is as good as none."""
        return self.st[loop].reset < float(TUNED.no_integral)

    def dead_band(self, loop: int, sig: Sequence[float]) -> float:  # noqa: ARG002 - registers
        """DFn+03, which is compared with the squared error where that is on."""
        c = self.cfg[loop]
        band = sqrt(c.deadband) if c.squared else c.deadband
        return band if c.deadband_on else 0.0

    def pulse_cycle(self, loop: int) -> float:
        """The PWM period."""
        return self.cfg[loop].pwm_period / TICKS if self.cfg[loop].pwm else 0.0

    def request(self, loop: int, mode: str) -> None:
        """A mode request goes on; it is looked at with the next sample and is off again."""
        s, bit = self.st[loop], MODE_BITS[mode]
        s.requested = bit
        if s.busy & bits.STOPPED:
            tell_request(s, click_modes.REFUSED_STOP)
            return
        if s.busy & bits.GOAL and not s.busy & bits.REQUEST:
            tell_request(s, click_modes.GIVEN_UP)
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
        done = s.tune_done == DONE
        status = "running" if s.status & bits.TUNING else "error" if error else TUNE_STATUS[s.tune_done]
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
        """Write a value to its registers, which show at once (D674); why it has no effect, as in Auto (D127)."""
        return self.write(loop, settings_of(path, value, self._sample_rate(loop)), sig)

    def write(self, loop: int, written: Sequence[tuple[Word, int]], sig: MutableSequence[float]) -> str | None:
        """Write raw contents; as `set` otherwise."""
        registers, s = self._loops[loop], self.st[loop]
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

    def memory(self, loop: int) -> Loop:
        """A loop's registers as they are after the last scan."""
        self._loops[loop].absorb(self.st[loop])
        return self._loops[loop]

    def _sample_rate(self, loop: int) -> Decimal:
        """The register of the sample rate in s."""
        return Decimal(self.st[loop].sample_ms) / 1000


def scale_of(c: Config) -> tuple[float, float, int]:
    """The ends of the PV's range, 0 to 100 where the registers hold none, and what counts as a count (D128)."""
    if not (isfinite(c.pv_low) and isfinite(c.pv_high) and c.pv_low < c.pv_high):
        return 0.0, 100.0, COUNTS
    return c.pv_low, c.pv_high, COUNTS


def load(image: Image, options: ScanOptions | None = None) -> Click:  # noqa: ARG001 - the base step is the runner's
    """The virtual PLC of an image's registers, as it stands at its change from STOP to RUN."""
    return Click(image)
