"""The signals of an EZLogix loop: what its registers say, in engineering units."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.sim.controllers.ezlogix.equation import FULL
from pidcfg.sim.controllers.ezlogix.state import OUTPUT_CUT, STOPPED
from pidcfg.sim.plc import TICKS

if TYPE_CHECKING:
    from collections.abc import MutableSequence

    from pidcfg.sim.controllers.ezlogix.state import Config, State


def show_setpoint(c: Config, s: State, sig: MutableSequence[float]) -> None:
    """The set point within its limits, though the register is written at the next calculation (kernel)."""
    sp = s.sp
    if sp > c.sp_high:
        sp = c.sp_high
    if sp < c.sp_low:
        sp = c.sp_low
    if c.root:
        sp *= sp
    sig[c.sig_sp] = c.pv_low + (sp - c.pv_min) * c.pv_width / c.pv_span


def show_output(c: Config, s: State, sig: MutableSequence[float]) -> None:
    """The CV; one that nothing carries on stays as it is (D672; kernel)."""
    if s.busy & (OUTPUT_CUT | STOPPED) == 0:
        sig[c.sig_out] = c.out_low + s.out * c.out_width / FULL


def show(c: Config, s: State, sig: MutableSequence[float]) -> None:
    """Renew them (kernel); BIAS has no limits (D657)."""
    sig[c.sig_pv] = c.pv_low + (s.pv - c.pv_min) * c.pv_width / c.pv_span
    show_setpoint(c, s, sig)
    show_output(c, s, sig)
    sig[c.sig_bias] = c.out_low + (s.integral + c.offset) * c.out_width / FULL
    sig[c.sig_error] = s.error
    sig[c.sig_status] = s.tune_status * 1.0
    sig[c.sig_countdown] = s.tune_left // TICKS * 1.0
