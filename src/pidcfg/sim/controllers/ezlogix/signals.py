"""The signals of an EZLogix loop: what its registers say, in engineering units."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.sim.controllers.ezlogix.equation import FULL
from pidcfg.sim.controllers.ezlogix.state import OUTPUT_CUT, STOPPED

if TYPE_CHECKING:
    from collections.abc import MutableSequence

    from pidcfg.sim.controllers.ezlogix.state import Config, State


def show(c: Config, s: State, sig: MutableSequence[float]) -> None:
    """Renew them (kernel); an output that nothing carries on stays as it is (D672)."""
    centre = s.sp * s.sp if c.root else s.sp
    sig[c.sig_pv] = c.pv_low + (s.pv - c.pv_min) * c.pv_width / c.pv_span
    sig[c.sig_sp] = c.pv_low + (centre - c.pv_min) * c.pv_width / c.pv_span
    if s.busy & (OUTPUT_CUT | STOPPED) == 0:
        sig[c.sig_out] = c.out_low + s.out * c.out_width / FULL
    sig[c.sig_bias] = c.out_low + (s.integral + c.offset) * c.out_width / FULL
    sig[c.sig_error] = s.error
    sig[c.sig_status] = s.tune_status * 1.0
