"""The virtual PLC of a scenario behind its vendor's register map: read, written to, and moved on in time."""

from __future__ import annotations

from contextlib import suppress
from decimal import Decimal
from typing import TYPE_CHECKING, NamedTuple

from pidcfg.sim.registers import NO_REGISTER, RegisterError
from pidcfg.sim.report import Note, rounded
from pidcfg.sim.run import Settings, begun

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from pidcfg.encoders.modbus import Places
    from pidcfg.scenario.load import Loaded
    from pidcfg.sim.registers import Done, Registers
    from pidcfg.sim.report import Report

Where = tuple[str, int]
"""A table and the number of a register in it."""
WORD = 0xFFFF


class Part(NamedTuple):
    """What a register has of a value: the bits of ``mask`` behind ``shift``, at its own bit ``bit``."""

    number: int
    shift: int
    mask: int
    bit: int
    loop: int


ENDLESS = Decimal(10) ** 9
"""Seconds of a run that ends when somebody ends it."""
LISTED = 1000
"""Writes that the report lists; so that a panel that writes all the time does not fill the memory."""


class VirtualPlc:
    """A run that goes on for as long as it is wanted. Nothing is expected of it: somebody else has a hand in it."""

    def __init__(self, loaded: Loaded, numbering: Places) -> None:
        if loaded.scenario is None or loaded.vendor is None:
            raise ValueError(f"{loaded.document.file} could not be loaded")
        scenario = loaded.scenario.model_copy(update={"duration": ENDLESS, "expect": (), "allow": ()})
        self.run = begun(scenario, loaded.plc, loaded.controller, Settings(engine="python", judged=False))
        self.registers: Registers = loaded.vendor.load("virtual")(self.run.plc)
        self.unlisted = 0
        self._course: Iterator[int] = self.run.course()
        self._at = self.run.zero
        self._where: dict[Where, list[Part]] = {}
        for number, loop in self.registers.places().items():
            with suppress(LookupError):  # no client reads what the map does not have
                place = numbering.place(number)
                for part in range(place.width):
                    shift, mask = (place.shift(part), WORD) if place.bit is None else (0, 1)
                    one = Part(number, shift, mask, place.bit or 0, loop)
                    here = self._where.setdefault((place.table, place.register + part), [])
                    if all(other.mask != WORD and other.bit != one.bit for other in here):  # one device, several names
                        here.append(one)
        self._held: dict[int, Mapping[int, int]] = {}

    @property
    def steps(self) -> int:
        """Base steps so far."""
        return self._at - self.run.zero

    @property
    def dt(self) -> float:
        """The base step in s."""
        return self.run.dt

    def advance(self, steps: int) -> None:
        """Base steps, as fast as they go."""
        end = self._at + steps
        self._held.clear()
        while self._at < end:
            self.run.chunk = end - self._at
            self._at = next(self._course)

    def read(self, table: str, first: int, count: int) -> list[int]:
        """Registers as they are now; raises `RegisterError` where one is not there."""
        return [self._content(table, first + k) for k in range(count)]

    def _content(self, table: str, register: int) -> int:
        content = 0
        for part in self._parts(table, register):
            content |= (self._raw(part) >> part.shift & part.mask) << part.bit
        return content

    def _raw(self, part: Part) -> int:
        """What a value holds now."""
        if part.loop not in self._held:
            self._held[part.loop] = self.registers.contents(part.loop, self.run.net.sig)
        return self._held[part.loop][part.number]

    def _parts(self, table: str, register: int) -> list[Part]:
        found = self._where.get((table, register))
        if found is None:
            raise RegisterError(NO_REGISTER, f"{table} {register} is no register of this PLC")
        return found

    def write(self, table: str, first: int, contents: Sequence[int]) -> None:
        """Registers one after the other, halves of a value together; raises `RegisterError` where one is refused."""
        raws: dict[int, tuple[int, int]] = {}
        for k, content in enumerate(contents):
            for part in self._parts(table, first + k):
                raw, written = raws.get(part.number, (self._raw(part), int(content) >> part.bit & part.mask))
                if part.mask == WORD or written != raw:  # of the switches in a register those that change
                    raw = raw & ~(part.mask << part.shift) | (int(content) >> part.bit & part.mask) << part.shift
                    raws[part.number] = (raw, part.loop)
        for number, (raw, loop) in raws.items():
            self._write(number, raw, loop)

    def _write(self, number: int, raw: int, loop: int) -> None:
        """One value, with everything that an event of the scenario brings about."""
        sig, cfg = self.run.net.sig, self.run.plc.cfg
        before = list(sig)
        done = self.registers.write(number, raw, sig)
        self._held.clear()
        self.run.machine.hold(before)
        if loop >= 0:
            self._note(loop, done)
            slot = cfg[loop].sig_sp
            if sig[slot] != before[slot]:
                self.run.agenda.begin_step(self.steps, loop, before[slot])

    def _note(self, loop: int, done: Done) -> None:
        run = self.run
        if done.mode is not None:
            run.journal.requested[loop] = done.mode
        if len(run.agenda.done) < LISTED:
            run.agenda.done.append(Note(rounded(self.steps * self.dt), run.plc.loops[loop], done.text))
        else:
            self.unlisted += 1

    def report(self) -> Report:
        """What has happened so far; the run is over then."""
        self.run.last = max(self.steps - 1, 0)
        return self.run.finish()
