"""The registers and discretes of a virtual EZLogix, and the tags of PV and CV."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.encoders.maps.ezlogix import BLOCKS, MAP_SPACE
from pidcfg.sim.controllers.ezlogix.report import MODES
from pidcfg.sim.controllers.ezlogix.state import AUTO, REQUEST, SATURATED, TUNING
from pidcfg.sim.plc import TICKS
from pidcfg.sim.registers import NO_REGISTER, NOT_NOW, Done, RegisterError, Registers
from pidcfg.sim.terms import nearest

if TYPE_CHECKING:
    from collections.abc import Mapping, MutableSequence, Sequence

    from pidcfg.encoders.regmap import Word
    from pidcfg.sim.controllers.ezlogix.plc import Ezlogix

MODE_OF = {bool(bit & AUTO): name for name, bit in MODES.items()}
WORD = 0xFFFF


class EzlogixRegisters(Registers):
    """Both blocks of all loops; where tags of PV and CV have a register of their own, those too."""

    def __init__(self, plc: Ezlogix) -> None:
        self.plc = plc
        self._at: dict[int, tuple[int, Word]] = {}
        self._tags: dict[int, tuple[int, str]] = {}
        self._started = [False] * len(plc.loops)
        """Discrete +4 as it was written."""
        for i in range(len(plc.loops)):
            dialog = plc.memory(i).dialog
            for key, (prefix, table) in BLOCKS.items():
                start = MAP_SPACE.number(prefix, getattr(dialog, key))
                self._at |= {start + row.offset: (i, row) for row in table.words}
        for i in range(len(plc.loops)):
            dialog = plc.memory(i).dialog
            for tag, what in ((dialog.pv.tag, "pv"), (dialog.output.tag, "cv")):
                number = MAP_SPACE.parse(tag)
                if number is not None and number not in self._at:
                    self._tags.setdefault(number, (i, what))

    def places(self) -> Mapping[int, int]:
        """The two blocks of each loop, and its tags."""
        return {number: loop for number, (loop, _) in (self._at | self._tags).items()}

    def contents(self, loop: int, sig: Sequence[float]) -> Mapping[int, int]:  # noqa: ARG002 - registers say it
        """As the registers are after the last calculation."""
        memory, s = self.plc.memory(loop), self.plc.st[loop]
        held = {row.name: memory.word(row.name) for row in BLOCKS["registers"][1].words}
        held |= {row.name: memory.bit(row.name) for row in BLOCKS["discretes"][1].words}
        held |= {
            "error": int(nearest(s.error)) & WORD,
            "autotune_status": s.tune_status,
            "autotune_timeout": s.tune_left // TICKS,
            "mode": int(bool((s.wanted if s.busy & REQUEST else s.status) & AUTO)),
            "saturation": int(bool(s.status & SATURATED)),
            "start_autotune": int(self._started[loop] or bool(s.status & TUNING)),
        }
        tags = {"pv": int(nearest(s.pv)) & WORD, "cv": int(nearest(s.out)) & WORD}
        contents = {number: held[row.name] for number, (i, row) in self._at.items() if i == loop}
        return contents | {number: tags[what] for number, (i, what) in self._tags.items() if i == loop}

    def write(self, number: int, raw: int, sig: MutableSequence[float]) -> Done:
        """A setting, the mode, the start of an autotune, or the CV in Manual."""
        name = MAP_SPACE.name(number)
        if number in self._tags:
            return self._write_tag(number, raw, sig)
        loop, row = self._at[number]
        if row.access in {"status", "reserved"}:
            raise RegisterError(NO_REGISTER, f"{name} ({row.title}) is written by the PLC alone")
        if row.name == "mode":
            mode = MODE_OF[bool(raw)]
            self.plc.request(loop, mode)
            return Done(f"request mode {mode}", mode)
        if row.name == "start_autotune":
            return self._start(loop, is_on=bool(raw))
        late = self.plc.write(loop, row, raw, sig)
        return Done(f"set {row.path} to {MAP_SPACE.shown(number, raw)}" + (f"; {late}" if late else ""))

    def _start(self, loop: int, *, is_on: bool) -> Done:
        """Discrete +4, of which only the changes count."""
        was = self._started[loop] or bool(self.plc.st[loop].status & TUNING)
        self._started[loop] = is_on
        if is_on == was:
            return Done(f"start of an autotune stays {'on' if is_on else 'off'}")
        self.plc.autotune(loop, "start" if is_on else "cancel")
        return Done("autotune start" if is_on else "autotune off")

    def _write_tag(self, number: int, raw: int, sig: MutableSequence[float]) -> Done:
        loop, what = self._tags[number]
        name = MAP_SPACE.name(number)
        if what == "pv":
            raise RegisterError(NO_REGISTER, f"{name} is the measurement, which the plant writes")
        if late := self.plc.write_output(loop, raw, sig):
            raise RegisterError(NOT_NOW, f"{name}: {late}")
        return Done(f"set output to {raw} counts")
