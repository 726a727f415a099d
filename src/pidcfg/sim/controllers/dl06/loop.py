"""The words of one DL06 loop, as they stand in memory and as the controller has last read them.

Some words are read only when an alarm's enable bit goes from 0 to 1, some only when the CPU changes its mode; a value
that is written to one of them changes the memory and nothing else until then.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from decimal import Decimal
from typing import TYPE_CHECKING, Any

from pidcfg.encoders.dl06.status import intended_mode
from pidcfg.encoders.maps.dl06 import FORMATS, LOOP_TABLE, LOOP_TABLES, RAMP_SOAK_SIZE, READ_LATE
from pidcfg.encoders.regmap import Bits, Word, encode_one
from pidcfg.encoders.scales import Scale
from pidcfg.sim.controllers.dl06.words import NoWord, Values, decode_loop, decode_profile
from pidcfg.sim.plc import TICKS

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pidcfg.sim.controllers.dl06.state import Config, State
    from pidcfg.sim.settings import Row

ALARM_WORD = "no*"
"""The manual's mark of a word that is read only when its alarm's enable bit goes from 0 to 1."""

ENABLES = {
    "alarms.pv.enabled": ("alarms.pv.", "alarms.hysteresis"),
    "alarms.deviation.enabled": ("alarms.deviation.", "alarms.hysteresis"),
    "alarms.rate_of_change_enabled": ("alarms.rate_of_change",),
}
"""Which words an alarm's enable bit makes the controller read when it goes from 0 to 1 (D682)."""


@dataclass(slots=True)
class Loop:
    """A loop's words, and what no word holds."""

    name: str
    goal: str
    pv_range: tuple[Decimal, Decimal] | None
    out_range: tuple[Decimal, Decimal] | None
    decimals: int
    """Implied decimals of the reset word."""
    memory: list[int]
    read: list[int]
    values: Values
    """Decoded from the words that have been read; quantities in counts."""
    absorbed: bool = True
    """The results of the last auto-tune have been written to the words."""
    results: Mapping[str, float] = field(default_factory=dict)
    """Results of the last auto-tune, by register."""
    has_setpoint: bool = True
    """Whether the configuration gives a set point; it may leave that to the operator."""

    def scales(self) -> dict[str, Scale]:
        """The scales of the loop's words in engineering units."""
        pv = FORMATS[self.values["pv.format"]]
        output = FORMATS[self.values["output.format"] or self.values["pv.format"]]
        root = self.values["pv.square_root"]
        return {
            "pv": Scale(pv, self.pv_range),
            "sp": Scale(pv, self.pv_range, root),
            "output": Scale(output, self.out_range),
        }

    def reread(self, *, alarms: bool) -> None:
        """Read the words at a change of the CPU's mode; those of the alarms at the change to Run only (D648)."""
        old = self.read[:]
        self.read[:] = self.memory
        for word in () if alarms else LOOP_TABLE.words:
            if word.read == ALARM_WORD:
                self.read[word.offset] = old[word.offset]
        self.decode()

    def decode(self) -> None:
        """Renew the values from the words that have been read."""
        self.values, _ = decode_loop(self.read, self.decimals)

    def store(self, row: Row, word: int) -> str | None:
        """Write raw content, of a choice its bits in place; returns why the controller does not know it yet, if so."""
        if isinstance(row, Bits):
            word |= self.memory[row.offset] & ~row.mask
        rose = word & ~self.memory[row.offset]
        self.memory[row.offset] = word
        if isinstance(row, Word) and row.read in READ_LATE:
            return f"+{row.offset:02o} {READ_LATE[row.read]}"
        self.read[row.offset] = word
        if rose:
            self._read_alarms(str(row.path))
        self.decode()
        return None

    def _read_alarms(self, path: str) -> None:
        for start in ENABLES.get(path, ()):
            for word in LOOP_TABLE.words:
                if str(word.path).startswith(start):
                    self.read[word.offset] = self.memory[word.offset]

    def absorb(self, c: Config, s: State) -> None:
        """Put what an auto-tune has written into the words."""
        if self.absorbed or not s.tune_done:
            return
        self.absorbed = True
        results = tuned_words(c, s)
        self.results = {name: float(value) for name, value in results.items()}
        for name, value in results.items():
            word = LOOP_TABLES[self.decimals].word(name)
            self.memory[word.offset] = self.read[word.offset] = encode_one(word.codec, value, {})
        self.decode()


def loop_of(words: Mapping[int, int], start: int, entry: Mapping[str, Any], decimals: int) -> tuple[Loop, list[NoWord]]:
    """A loop from the memory at ``start`` and its entry in the image's settings; its words that have no value.

    Those of its ramp/soak table count where the generator is enabled.
    """
    memory = [words.get(start + k, 0) for k in range(LOOP_TABLE.size)]
    values, problems = decode_loop(memory, decimals)
    pv, out = entry.get("pv") or {}, entry.get("output") or {}
    goal = intended_mode(memory[LOOP_TABLE.offset("mode_and_alarm_status")], entry.get("mode", "manual"))
    loop = Loop(entry["loop"], goal, ends(pv), ends(out), decimals, memory, memory[:], values)
    loop.has_setpoint = entry.get("setpoint") is not False
    if values["ramp_soak.enabled"]:
        table = [words.get(values["ramp_soak.table"] + k, 0) for k in range(RAMP_SOAK_SIZE)]
        for _, wrong in decode_profile(table, values):
            problems += [NoWord(f"ramp/soak table {one.text}", one.setting) for one in wrong]
    return loop, problems


def tuned_words(c: Config, s: State) -> dict[str, Decimal]:
    """What an auto-tune writes, by register."""
    results = {"gain": s.gain, "reset": s.reset / c.reset_unit, "rate": s.rate, "sample_rate": s.period / TICKS}
    return {name: Decimal(f"{value:.2f}") for name, value in results.items()}


def ends(settings: Mapping[str, Any]) -> tuple[Decimal, Decimal] | None:
    """The engineering range of a settings entry."""
    pair = settings.get("range")
    return None if pair is None else (Decimal(str(pair[0])), Decimal(str(pair[1])))
