"""The registers of a virtual CLICK: every loop's words, and the records that the controller calculates with."""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING

from pidcfg.encoders.maps.click import ERRORS
from pidcfg.sim.controllers.click import modes as click_modes
from pidcfg.sim.controllers.click import state as bits
from pidcfg.sim.controllers.click.equation import coefficients
from pidcfg.sim.controllers.click.errors import lowest_error
from pidcfg.sim.controllers.click.report import MODES, SIGNALS
from pidcfg.sim.controllers.click.state import Config, State
from pidcfg.sim.controllers.click.words import configure, loop_of, write_state
from pidcfg.sim.notices import tell_request
from pidcfg.sim.plc import Plc
from pidcfg.sim.reaction_curve import POINTS
from pidcfg.sim.terms import finite

if TYPE_CHECKING:
    from collections.abc import Mapping, MutableSequence

    from pidcfg.encoders.image import Image

PULSES = 100
"""Least number of base steps in a PWM period: the pulses' resolution is 1 % (D121)."""
COUNTS = 1 << 16
"""Counts of the PV's range where a resolution is needed: floats have none (D128)."""


class Memory(Plc):
    """The registers of an image, and what the kernels make of them."""

    cfg: list[Config]
    st: list[State]

    def __init__(self, image: Image) -> None:
        words = image.words
        self._loops = [loop_of(words, i, entry) for i, entry in enumerate(image.settings)]
        self.loops = [loop.name for loop in self._loops]
        self.goals = [loop.goal for loop in self._loops]
        self.place_loops(Config, State, SIGNALS, POINTS)
        for i in range(len(self._loops)):
            self._begin(i)
        self.scales = [scale_of(c) for c in self.cfg]

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
        s.goal = 0 if loop.goal == "manual" else MODES[loop.goal]
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


def scale_of(c: Config) -> tuple[float, float, int]:
    """The ends of the PV's range, 0 to 100 where the registers hold none, and what counts as a count (D128)."""
    if not (isfinite(c.pv_low) and isfinite(c.pv_high) and c.pv_low < c.pv_high):
        return 0.0, 100.0, COUNTS
    return c.pv_low, c.pv_high, COUNTS
