"""The operands of a virtual Delta AS by name, as a map puts them into registers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.encoders.iec_registers import raw_of
from pidcfg.encoders.maps.dpide import ROWS
from pidcfg.sim.controllers.dpide.setting import KEYS, PID_MODES
from pidcfg.sim.named_registers import checked_row, content_written, done
from pidcfg.sim.registers import NO_VALUE, Done, RegisterError, Registers

if TYPE_CHECKING:
    from collections.abc import Mapping, MutableSequence, Sequence

    from pidcfg.sim.controllers.dpide.plc import Dpide


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
