"""The signals of a DPIDE instruction: what its operands hold."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.sim.terms import finite

if TYPE_CHECKING:
    from collections.abc import MutableSequence

    from pidcfg.sim.controllers.dpide.state import Config, State


def show(c: Config, s: State, sig: MutableSequence[float]) -> None:
    """Renew them; what is no number is shown as 0 (kernel)."""
    sig[c.sig_pv] = finite(s.pv, 0.0)
    sig[c.sig_sp] = s.sp
    sig[c.sig_out] = s.out
    sig[c.sig_mout] = s.mout
    sig[c.sig_bias] = s.integral
    sig[c.sig_error] = finite(s.error, 0.0)
