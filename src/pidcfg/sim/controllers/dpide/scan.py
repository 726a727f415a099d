"""The virtual Delta AS: what one scan does for its DPIDE instructions, and their operands as registers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.encoders.maps.dpide import ROWS
from pidcfg.encoders.parameters import raw_of
from pidcfg.sim.controllers.dpide.autotune import tune
from pidcfg.sim.controllers.dpide.equation import (
    AUTO,
    HALTING,
    LIMITED,
    MANUAL,
    OFF,
    REQUEST,
    STOPPED,
    TUNING,
    Config,
    State,
    calculate,
    derivative,
    effective,
    show,
)
from pidcfg.sim.controllers.dpide.operate import KEYS, PID_MODES, halt, switch
from pidcfg.sim.controllers.dpide.plc import Dpide, load
from pidcfg.sim.controllers.kernels import finite, single
from pidcfg.sim.controllers.plc import ScanOptions as Options
from pidcfg.sim.controllers.settings import NO_VALUE, Done, RegisterError, Registers, checked_row, content_written, done
from pidcfg.sim.costs import COSTS

if TYPE_CHECKING:
    from collections.abc import Mapping, MutableSequence, Sequence

# --- The virtual Delta AS: what one scan of the program does for its DPIDE instructions -------------------------------
#
# Design. `scan` is called at every base step; it calculates the instructions whose sampling time has passed, and
# looks at PID_RUN in between. `sample` is one calculation of one loop: PV, mode, error and dead band, then autotune,
# algorithm or manual, and MOUT. Every result of the calculation is rounded to single precision (D265). Nothing here
# knows files, names or units: see `plc.load` for how operands become `Config` and `State`.
#
# Signals of a loop (slots in `Config`): ``sig_in`` is read, in PV's unit; PV, SV, MV, MOUT, I_MV and E, the error as
# it counts, are written as the operands say.

__all__ = ["COST", "INLINED", "Config", "Dpide", "Options", "State", "load", "sample", "scan"]


def by_hand(c: Config, s: State) -> None:
    """MV is MOUT within its limits (D274)."""
    s.status |= LIMITED
    if s.mout > c.high:
        s.out = c.high
    elif s.mout < c.low:
        s.out = c.low
    else:
        s.out = s.mout
        s.status &= ~LIMITED


def fetch(c: Config, s: State, st: list[State]) -> None:
    """What other loops have written to the devices of this one's operands (D266)."""
    if c.sv_from >= 0:
        s.sp = st[c.sv_from].out
    if c.bias_from >= 0:
        s.bias = st[c.bias_from].out
    if c.mout_from >= 0:
        s.mout = st[c.mout_from].out


def sample(i: int, cfg: list[Config], st: list[State], sig: list[float]) -> None:
    """One calculation of an instruction."""
    c = cfg[i]
    s = st[i]
    s.pv = single(sig[c.sig_in])
    if s.busy & REQUEST:
        switch(c, s)
    if s.status & OFF:
        sig[c.sig_pv] = finite(s.pv, 0.0)
        return
    fetch(c, s, st)
    raw = single(s.sp - s.pv) if c.forward else single(s.pv - s.sp)
    e = effective(c, s, raw)
    s.error = e
    if s.status & TUNING:
        tune(c, s, raw)
    if s.status & AUTO:
        calculate(c, s, e)
    elif s.status & MANUAL:
        by_hand(c, s)
    if c.follow or c.joined:
        s.mout = s.out
    show(c, s, sig)


def scan(tick: int, cfg: list[Config], st: list[State], aux: list[float], sig: list[float]) -> None:  # noqa: ARG001
    """The program at ``tick``: instructions that are due (D685), and those whose PID_RUN has become FALSE (D266)."""
    for i in range(len(cfg)):
        s = st[i]
        if s.busy & (HALTING | STOPPED) == HALTING:
            halt(cfg[i], s)
            sig[cfg[i].sig_out] = s.out
            sig[cfg[i].sig_mout] = s.mout
        due = s.due
        if tick >= due:
            due += s.period
            s.due = due if due > tick else tick + s.period
            sample(i, cfg, st, sig)


INLINED = (scan, sample, calculate, derivative, effective, fetch, show)
"""The hot path of compiled code."""
COST = COSTS["dpide"]

# --- The operands of a virtual Delta AS by name, as a map puts them into registers ------------------------------------


class DpideRegisters(Registers):
    """All operands of all instructions."""

    def __init__(self, plc: Dpide) -> None:
        self.plc = plc
        self._at = {f"{loop}.{row}": (i, row) for i, loop in enumerate(plc.loops) for row in ROWS}

    def places(self) -> Mapping[Any, int]:
        """Every operand with its loop; of those in one device the one first that says what it holds (D266)."""
        return {name: self._at[name][0] for name in sorted(self._at, key=self._rank)}

    def _rank(self, name: str) -> int:
        """0 for MOUT in the device of MV, which an operator writes; 1 for MV, the PLC's; 2 for the others."""
        loop, row = self._at[name]
        return 0 if row == "MOUT" and self.plc.cfg[loop].joined else 1 if row == "MV" else 2

    def contents(self, loop: int, sig: Sequence[float]) -> Mapping[Any, int]:  # noqa: ARG002 - operands say it
        """As the operands are after the last calculation."""
        held = self.plc.memory(loop)
        prefix = self.plc.loops[loop]
        return {f"{prefix}.{name}": raw_of(row.type, held[name]) for name, row in ROWS.items()}

    def write(self, number: Any, raw: int, sig: MutableSequence[float]) -> Done:
        """An operand that the program or an operator may write."""
        loop, name = self._at[number]
        row = checked_row(KEYS, number, name)
        content = content_written(number, row, raw)
        if name == "PID_MODE" and content not in PID_MODES:
            raise RegisterError(NO_VALUE, f"{number}: {content} is none of {', '.join(map(str, PID_MODES))}")
        before = self.plc.intended_mode(loop, sig)
        late = self.plc.set(loop, (name,), float(content) if row.type.kind == "real" else int(content), sig)
        mode = self.plc.intended_mode(loop, sig)
        return done(number, row, content, late, mode if mode != before else None)
