"""The signals of a DPIDE instruction: what its operands hold."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import MutableSequence

    from pidcfg.sim.controllers.dpide.state import Config, State


def shown(value: float) -> float:
    """What a signal shows of an operand: 0 for what is no number (kernel)."""
    return value if value - value == 0.0 else 0.0


def show(c: Config, s: State, sig: MutableSequence[float]) -> None:
    """Renew them (kernel)."""
    sig[c.sig_pv] = shown(s.pv)
    sig[c.sig_sp] = s.sp
    sig[c.sig_out] = s.out
    sig[c.sig_mout] = s.mout
    sig[c.sig_bias] = s.integral
    sig[c.sig_error] = shown(s.error)
