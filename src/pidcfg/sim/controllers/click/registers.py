"""The C, DS and DF registers of a virtual CLICK."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.encoders.maps.click import BLOCKS, SPACE
from pidcfg.encoders.words import DecodeError
from pidcfg.sim.controllers.click.report import ALARM_BITS
from pidcfg.sim.controllers.click.setting import FIXED
from pidcfg.sim.registers import NO_REGISTER, NO_VALUE, NOT_NOW, Done, RegisterError, Registers

if TYPE_CHECKING:
    from collections.abc import Mapping, MutableSequence, Sequence

    from pidcfg.encoders.regmap import Word
    from pidcfg.sim.controllers.click.plc import Click

REQUESTS = {"manual_request": "manual", "auto_request": "auto", "autotune_request": "autotune"}
ALARMS = {f"alarm_{name.removeprefix('pv_')}": bit for name, bit in ALARM_BITS.items()}


class ClickRegisters(Registers):
    """The blocks of all loops; requests are read as 0, since the PLC takes them at once."""

    def __init__(self, plc: Click) -> None:
        self.plc = plc
        self._at: dict[int, tuple[int, Word]] = {}
        for i in range(len(plc.loops)):
            starts = plc.memory(i).starts
            for key, (prefix, table) in BLOCKS.items():
                start = SPACE.number(prefix, starts[key])
                self._at |= {start + row.offset: (i, row) for row in table.words}

    def places(self) -> Mapping[int, int]:
        """The three blocks of each loop."""
        return {number: loop for number, (loop, _) in self._at.items()}

    def contents(self, loop: int, sig: Sequence[float]) -> Mapping[int, int]:  # noqa: ARG002 - registers say it
        """As the registers are after the last scan."""
        words, status = self.plc.memory(loop).words, self.plc.st[loop].status
        alarms = {name: int(bool(status & bit)) for name, bit in ALARMS.items()}
        idle = dict.fromkeys(REQUESTS, 0)
        held = {**words, **alarms, **idle}
        return {number: held.get(row.name, 0) for number, (i, row) in self._at.items() if i == loop}

    def write(self, number: int, raw: int, sig: MutableSequence[float]) -> Done:
        """A setting, the output in Manual, or a request."""
        loop, row = self._at[number]
        name = SPACE.name(number)
        if row.name in REQUESTS:
            return self._request(loop, row.name, raw)
        if row.path is None or row.path in FIXED:
            raise RegisterError(NO_REGISTER, f"{name} ({row.title}) is written by the PLC alone")
        try:
            row.codec.decode(raw)  # type: ignore[call-arg]  # no register of a CLICK has a scale
        except DecodeError as error:
            raise RegisterError(NO_VALUE, f"{name}: {error}") from None
        if late := self.plc.write(loop, [(row, raw)], sig):
            raise RegisterError(NOT_NOW, f"{name} {late}")
        return Done(f"set {row.path} to {SPACE.shown(number, raw)}")

    def _request(self, loop: int, name: str, raw: int) -> Done:
        """A request goes on; one for an autotune may go off again."""
        mode = REQUESTS[name]
        if raw:
            self.plc.request(loop, mode)
            return Done(f"request mode {mode}", mode)
        if name == "autotune_request":
            self.plc.autotune(loop, "cancel")
        return Done(f"request of mode {mode} off")
