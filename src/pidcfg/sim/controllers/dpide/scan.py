"""The virtual Delta AS: what one scan does for its DPIDE instructions, and their operands as registers."""

from __future__ import annotations

from collections.abc import Mapping, MutableSequence, Sequence
from typing import Any

from pidcfg.encoders.maps.dpide import ROWS
from pidcfg.encoders.parameters import content_text, raw_of, register_content
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
    apply_dead_band,
    calculate_mv,
    calculate_slope,
    show_signals,
)
from pidcfg.sim.controllers.dpide.operate import KEYS, PID_MODES, stop_block, switch_mode
from pidcfg.sim.controllers.dpide.plc import Dpide, load
from pidcfg.sim.controllers.kernels import finite, single
from pidcfg.sim.controllers.plc import ScanOptions as Options
from pidcfg.sim.controllers.settings import NO_VALUE, Done, RegisterError, Registers
from pidcfg.sim.costs import COSTS

# --- The virtual Delta AS: what one scan of the program does for its DPIDE instructions -------------------------------
#
# Design. `scan` is called at every base step; it calculates the instructions whose sampling time has passed, and
# looks at PID_RUN in between. `sample` is one calculation of one loop: PV, mode, error and dead band, then autotune,
# algorithm or manual, and MOUT. Every result of the calculation is rounded to single precision (D265). Nothing here
# knows files, names or units: see `plc.load` for how operands become `Config` and `State`.
#
# Signals of a loop (slots in `Config`): ``in_slot`` is read, in PV's unit; PV, SV, MV, MOUT, I_MV and E, the error as
# it counts, are written as the operands say.

__all__ = ["COST", "INLINED", "Config", "Dpide", "Options", "State", "load", "sample", "scan"]


def output_mout(config: Config, state: State) -> None:
    """MV is MOUT within its limits (D274)."""
    state.status |= LIMITED
    if state.mout > config.highest_mv:
        state.out = config.highest_mv
    elif state.mout < config.lowest_mv:
        state.out = config.lowest_mv
    else:
        state.out = state.mout
        state.status &= ~LIMITED


def fetch_operands(i: int, configs: list[Config], states: list[State]) -> None:
    """What other loops have written to the devices of this one's operands (D266), if they are executed at all."""
    config = configs[i]
    state = states[i]
    if config.sv_from >= 0 and configs[config.sv_from].halt == 0:
        state.sp = states[config.sv_from].out
    if config.bias_from >= 0 and configs[config.bias_from].halt == 0:
        state.bias = states[config.bias_from].out
    if config.mout_from >= 0 and configs[config.mout_from].halt == 0:
        state.mout = states[config.mout_from].out


def sample(i: int, configs: list[Config], states: list[State], signals: list[float]) -> None:
    """One calculation of an instruction."""
    config = configs[i]
    state = states[i]
    state.pv = single(signals[config.in_slot])
    if state.pending & REQUEST:
        switch_mode(config, state)
    if state.status & OFF:
        signals[config.pv_slot] = finite(state.pv, 0.0)
        return
    fetch_operands(i, configs, states)
    # PID Block Diagram: SV, PV and REVERSE (PID_DIR), then DEAD BAND (ERR_DBW)
    raw_error = single(state.sp - state.pv) if config.forward_action else single(state.pv - state.sp)
    error = apply_dead_band(config, state, raw_error)
    state.error = error
    # PID_MODE 1; the algorithm; PID_MAN; MOUT_AUTO
    if state.status & TUNING:
        tune(config, state, raw_error)
    if state.status & AUTO:
        calculate_mv(config, state, error)
    elif state.status & MANUAL:
        output_mout(config, state)
    if config.mout_follows or config.mout_is_mv:
        state.mout = state.out
    show_signals(config, state, signals)


def scan(tick: int, configs: list[Config], states: list[State], aux: list[float], signals: list[float]) -> None:
    """The program at ``tick``: instructions that are due (D685, D1016), and those whose PID_RUN is FALSE now (D266)."""
    for i in range(len(configs)):
        state = states[i]
        if state.pending & (HALTING | STOPPED) == HALTING:
            stop_block(configs[i], state)
            signals[configs[i].out_slot] = state.out
            signals[configs[i].mout_slot] = state.mout
        due = state.due
        if tick >= due:
            due += state.period
            state.due = due if due > tick else tick + state.period
            sample(i, configs, states, signals)


INLINED = (scan, sample, calculate_mv, calculate_slope, apply_dead_band, fetch_operands, show_signals)
"""The hot path of compiled code."""
COST = COSTS["dpide"]

# --- The operands of a virtual Delta AS by name, as a map puts them into registers ------------------------------------


class DpideRegisters(Registers):
    """All operands of all instructions."""

    def __init__(self, plc: Dpide) -> None:
        self.plc = plc
        rows = ROWS.values()
        self._rows = {f"{loop}.{row.name}": (i, row) for i, loop in enumerate(plc.loops) for row in rows}

    def places(self) -> dict[Any, int]:
        """Every operand with its loop; of those in one device the one first that says what it holds (D266)."""
        return {name: self._rows[name][0] for name in sorted(self._rows, key=self._rank)}

    def _rank(self, name: str) -> int:
        """0 for MOUT in the device of MV, which an operator writes; 1 for MV, the PLC's; 2 for the others."""
        loop, row = self._rows[name]
        return 0 if row.name == "MOUT" and self.plc.configs[loop].mout_is_mv else 1 if row.name == "MV" else 2

    def contents(self, loop: int, signals: Sequence[float]) -> Mapping[Any, int]:
        """As the operands are after the last calculation."""
        held = self.plc.memory(loop)
        return self.contents_by_number(loop, {name: raw_of(row.type, held[name]) for name, row in ROWS.items()})

    def write(self, number: Any, raw: int, signals: MutableSequence[float]) -> Done:
        """An operand that the program or an operator may write."""
        loop, row = self._rows[number]
        row = self.find_parameter(KEYS, number, row.name)
        content = self.decode(number, register_content, row.type, raw)
        if row.name == "PID_MODE" and content not in PID_MODES:
            raise RegisterError(NO_VALUE, f"{number}: {content} is none of {', '.join(map(str, PID_MODES))}")
        before = self.plc.intended_mode(loop, signals)
        value = float(content) if row.type.kind == "real" else int(content)
        late = self.plc.set(loop, (row.name,), value, signals)
        mode = self.plc.intended_mode(loop, signals)
        return Done.setting(number, content_text(row.type, content), late, mode if mode != before else None)
