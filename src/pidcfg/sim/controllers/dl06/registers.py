"""The V-memory of a virtual DL06: set-up words, loop table and ramp/soak tables."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.encoders.maps.dl06 import (
    ERROR_FLAGS,
    FORMATS,
    LOOP_COUNT,
    LOOP_TABLE,
    LOOP_TABLES,
    SPACE,
    TABLE_POINTER,
)
from pidcfg.encoders.regmap import Bits, Word, decode_one
from pidcfg.encoders.words import DecodeError, EncodeError, bcd_digits
from pidcfg.sim.controllers.dl06.report import COMMANDS, MODES
from pidcfg.sim.controllers.dl06.setting import FIXED
from pidcfg.sim.controllers.dl06.words import raw_scales
from pidcfg.sim.registers import NO_REGISTER, NO_VALUE, Done, RegisterError, Registers
from pidcfg.sim.terms import nearest

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, MutableSequence, Sequence

    from pidcfg.sim.controllers.dl06.plc import Dl06

NO_LOOP = -1


class Dl06Registers(Registers):
    """Words of V-memory; request bits are read as 0, since the PLC takes them at once."""

    def __init__(self, plc: Dl06) -> None:
        self.plc = plc
        start = plc.words.get(TABLE_POINTER, 0)
        self._tables = {
            start + i * LOOP_TABLE.size + row.offset: (i, row)
            for i in range(len(plc.loops))
            for row in LOOP_TABLE.words
        }

    def places(self) -> Mapping[int, int]:
        """Loop tables; set-up words and ramp/soak tables belong to no loop here."""
        others = {number for number in self.plc.words if number not in self._tables}
        return dict.fromkeys([*others, ERROR_FLAGS], NO_LOOP) | {n: loop for n, (loop, _) in self._tables.items()}

    def contents(self, loop: int, sig: Sequence[float]) -> Mapping[int, int]:  # noqa: ARG002 - registers say it
        """As the words are after the last scan."""
        if loop == NO_LOOP:
            others = {n: raw for n, raw in self.plc.words.items() if n not in self._tables}
            return others | {ERROR_FLAGS: self.plc.flags["V7642"]}
        memory = self.plc.memory(loop).memory
        held = dict(self._written(loop))
        return {n: held.get(row.name, memory[row.offset]) for n, (i, row) in self._tables.items() if i == loop}

    def _written(self, loop: int) -> Iterator[tuple[str, int]]:
        """Words that the controller writes."""
        s, values, memory = self.plc.st[loop], self.plc.memory(loop).values, self.plc.memory(loop).memory
        pv = FORMATS[values["pv.format"]]
        output = FORMATS[values["output.format"] or values["pv.format"]]
        counted = (("setpoint", pv, s.sp), ("pv", pv, s.pv), ("bias", output, s.bias), ("output", output, s.out))
        for name, kind, value in counted:
            counts = int(nearest(value))
            try:
                yield name, kind.codec.encode(counts)
            except EncodeError:
                yield name, kind.codec.encode(kind.codec.high if counts > 0 else kind.codec.low)
        yield "mode_and_alarm_status", s.status
        for name in ("mode_setting_1", "mode_setting_2"):
            yield name, memory[LOOP_TABLE.offset(name)] & ~_requests(LOOP_TABLE.offset(name))
        yield "ramp_soak_flags", s.aux_status & ~_requests(LOOP_TABLE.offset("ramp_soak_flags"))
        yield "ramp_soak_errors", s.rs_error

    def write(self, number: int, raw: int, sig: MutableSequence[float]) -> Done:
        """A word; bits of it that are requests are carried out, and those that the PLC writes stay."""
        name = SPACE.name(number)
        if number not in self._tables:
            return self._write_other(number, raw)
        loop, row = self._tables[number]
        if row.path is None and row.access == "status":
            raise RegisterError(NO_REGISTER, f"{name} ({row.title}) is written by the PLC alone")
        if row.path in FIXED:
            raise RegisterError(NO_REGISTER, f"{name} ({row.title}) is wired, or written by the analog input")
        if row.path is None:
            return self._write_bits(loop, row, raw, sig)
        memory = self.plc.memory(loop)
        try:
            decode_one(LOOP_TABLES[memory.decimals].words[row.offset].codec, raw, raw_scales(memory.values))
        except DecodeError as error:
            raise RegisterError(NO_VALUE, f"{name}: {error}") from None
        late = self.plc.write(loop, [(row, raw)], sig)
        return Done(f"set {row.path} to {name} = {SPACE.shown(number, raw)}" + (f"; {late}" if late else ""))

    def _write_bits(self, loop: int, word: Word, raw: int, sig: MutableSequence[float]) -> Done:
        """The bits of a word, one choice after the other."""
        done: list[Done] = []
        memory = self.plc.memory(loop).memory
        for row in LOOP_TABLE.bits:
            bits = raw & row.mask
            if row.offset != word.offset:
                continue
            if row.access == "request" and bits:
                done.append(self._request(loop, row, bits))
            elif row.access == "setting" and bits != memory[row.offset] & row.mask:
                try:
                    value = row.decode(raw)
                except DecodeError as error:
                    raise RegisterError(NO_VALUE, str(error)) from None
                late = self.plc.write(loop, [(row, bits)], sig)
                done.append(Done(f"set {row.path} to {value}" + (f"; {late}" if late else "")))
        mode = next((one.mode for one in done if one.mode), None)
        return Done(", ".join(one.text for one in done) or f"wrote {word.name}, nothing new", mode)

    def _request(self, loop: int, row: Bits, bits: int) -> Done:
        """A mode, an auto-tune, or a command of the ramp/soak generator."""
        if row.offset == LOOP_TABLE.offset("ramp_soak_flags"):
            command = next(name for name, bit in COMMANDS.items() if bits & bit)
            self.plc.ramp_soak(loop, command)
            return Done(f"ramp/soak {command}")
        if row.path == "autotune.start":
            self.plc.autotune(loop)
            return Done("auto-tune start")
        mode = next(name for name, bit in MODES.items() if bits & bit)
        self.plc.request(loop, mode)
        return Done(f"request mode {mode}", mode)

    def _write_other(self, number: int, raw: int) -> Done:
        """A set-up word, which counts at the next change to Run, or a word of a ramp/soak table."""
        name = SPACE.name(number)
        if number == ERROR_FLAGS:
            raise RegisterError(NO_REGISTER, f"{name} is written by the PLC alone")
        if number == LOOP_COUNT:
            try:
                bcd_digits(raw)
            except DecodeError as error:
                raise RegisterError(NO_VALUE, f"{name}: {error}") from None
        self.plc.write_other(number, raw)
        return Done(f"set {name} to {SPACE.shown(number, raw)}")


def _requests(offset: int) -> int:
    """The request bits of a word."""
    return sum(row.mask for row in LOOP_TABLE.bits if row.offset == offset and row.access == "request")
