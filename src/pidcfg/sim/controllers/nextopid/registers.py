"""The parameters and signals of a virtual NextoPID program by name, as a map puts them into registers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.encoders.iec_registers import raw_of
from pidcfg.encoders.parameters import Parameter
from pidcfg.schemas.iec import Wire, time_text
from pidcfg.sim.controllers.nextopid.memory import number_of
from pidcfg.sim.named_registers import checked_row, content_written, done
from pidcfg.sim.registers import NO_REGISTER, Done, RegisterError, Registers
from pidcfg.sim.terms import finite

if TYPE_CHECKING:
    from collections.abc import Mapping, MutableSequence, Sequence

    from pidcfg.encoders.parameters import Content
    from pidcfg.schemas.iec import IecType
    from pidcfg.sim.controllers.nextopid.plc import Nextopid

NO_LOOP = -1


class NextopidRegisters(Registers):
    """Signals, and every parameter of every instance; a function has none."""

    def __init__(self, plc: Nextopid) -> None:
        self.plc = plc
        self._loops = {loop: i for i, loop in enumerate(plc.loops)}
        self._rows: dict[str, Parameter] = {name: Parameter(name, kind) for name, kind in plc.layout.signals.items()}
        for instance in plc.layout.instances:
            if not instance.kind.function:
                self._rows |= {f"{instance.name}.{row.name}": row for row in instance.kind.table.rows}
        copied = {copy.target for copy in plc.copies if copy.when is None}
        numbers = plc.layout.numbers
        self._written = {
            name for name in self._rows if isinstance(plc.words.get(name), Wire) or numbers[name] in copied
        }
        """What the program writes in every cycle."""

    def places(self) -> Mapping[Any, int]:
        """Every signal and parameter, with its loop."""
        return {name: self._loops.get(name.partition(".")[0], NO_LOOP) for name in self._rows}

    def contents(self, loop: int, sig: Sequence[float]) -> Mapping[Any, int]:
        """As they are after the last cycle."""
        numbers = self.plc.layout.numbers
        return {
            name: raw_of(self._rows[name].type, content_of_number(self._rows[name].type, sig[numbers[name]]))
            for name, owner in self.places().items()
            if owner == loop
        }

    def write(self, number: Any, raw: int, sig: MutableSequence[float]) -> Done:
        """A signal from outside, or an input that the program does not write."""
        row = self._rows[number]
        owner, _, name = number.partition(".")
        if row.access == "output":
            raise RegisterError(NO_REGISTER, f"{number} is an output, which the block writes")
        if number in self._written:
            raise RegisterError(NO_REGISTER, f"{number} is written by the program")
        if name:
            row = checked_row(self.plc.keys[owner], number, name)
        content = content_written(number, row, raw)
        loop = self._loops.get(owner, NO_LOOP)
        if loop == NO_LOOP or not name:
            sig[self.plc.inputs.get(number, self.plc.layout.numbers[number])] = number_of(row.type, content)
            return done(number, row, content, None, None)
        before = self.plc.intended_mode(loop, sig)
        late = self.plc.set(loop, (name,), content, sig)
        mode = self.plc.intended_mode(loop, sig)
        return done(number, row, content, late, mode if mode != before else None)


def content_of_number(kind: IecType, value: float) -> Content:
    """What the kernels have as a content: the inverse of `number_of`."""
    if kind.kind == "bool":
        return value != 0.0
    if kind.kind == "time":
        return time_text(round(value * 1000))
    if kind.kind == "word":
        return kind.words[int(value)]
    return finite(value, 0.0) if kind.kind == "real" else int(value)
