"""What an operator does to a loop's parameters, and what becomes of an auto-tuning (kernels)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.sim.controllers.nextopid import slots
from pidcfg.sim.controllers.nextopid.slots import (
    AUTO_TUNE,
    CASC,
    FLAGS,
    KP,
    TD_KD,
    TI_KI,
    TUNE_DONE,
    TUNE_ERROR,
    TUNE_FLAGS,
)
from pidcfg.sim.controllers.nextopid.slots import MANUAL as PIDA_MANUAL
from pidcfg.sim.controllers.nextopid.slots import TUNE_RESULT as RESULT

if TYPE_CHECKING:
    from collections.abc import MutableSequence

    from pidcfg.sim.controllers.nextopid.state import Config, State

MANUAL_ON, MANUAL_OFF, CASC_ON, CASC_OFF, TUNE_ON, TUNE_OFF, ACCEPT = 1, 2, 4, 8, 16, 32, 64
"""Commands of the operator (`State.command`)."""
MANUAL, CASCADE, TUNE = (MANUAL_ON, MANUAL_OFF), (CASC_ON, CASC_OFF), (TUNE_ON, TUNE_OFF)
NO_RUN, RUNNING, DONE, FAILED, CANCELLED = range(5)
"""State of the last auto-tuning (`State.tune_end`)."""
ON_OFF_MANUAL = slots.PLACES["ControlON_OFF"]["Manual"]


def command(s: State, pair: tuple[int, int], *, on: bool) -> None:
    """A switch is to be written; of several commands before the next cycle the last one counts (D82)."""
    s.command = s.command & ~(pair[0] | pair[1]) | pair[not on]


def operate(c: Config, s: State, sig: MutableSequence[float]) -> None:
    """Writes the parameters that the operator's commands change."""
    manual = c.base + (ON_OFF_MANUAL if c.kind == slots.ON_OFF else PIDA_MANUAL)
    if s.command & (MANUAL_ON | MANUAL_OFF):
        sig[manual] = 1.0 if s.command & MANUAL_ON else 0.0
    if s.command & (CASC_ON | CASC_OFF):
        sig[c.base + CASC] = 1.0 if s.command & CASC_ON else 0.0
    if s.command & ACCEPT:
        sig[c.base + KP] = sig[c.base + RESULT]
        sig[c.base + TI_KI] = sig[c.base + RESULT + 1]
        sig[c.base + TD_KD] = sig[c.base + RESULT + 2]
    if s.command & (TUNE_ON | TUNE_OFF):
        sig[c.base + AUTO_TUNE] = 1.0 if s.command & TUNE_ON else 0.0
    s.command = 0


def keep_results(c: Config, s: State, sig: MutableSequence[float]) -> None:
    """Results for the report: the block clears its own when AutoTune goes off."""
    b = c.base
    if sig[b + AUTO_TUNE] == 0.0:
        if s.tune_end == RUNNING:
            s.tune_end = CANCELLED
    elif sig[b + TUNE_DONE] == 0.0:
        s.tune_end = RUNNING
    elif s.tune_end not in (DONE, FAILED):
        s.tune_end = FAILED if sig[b + TUNE_ERROR] != 0.0 else DONE
        s.result_kp = sig[b + RESULT]
        s.result_ti = sig[b + RESULT + 1]
        s.result_td = sig[b + RESULT + 2]
        s.result_flags = 0
        for i in range(FLAGS):
            if sig[b + TUNE_FLAGS + i] != 0.0:
                s.result_flags |= 1 << i
