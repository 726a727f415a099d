"""From the registers of a CLICK loop to the numbers that the controller calculates with, and back."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from pidcfg.encoders.maps.click import BLOCKS, SPACE
from pidcfg.encoders.settings import default_name
from pidcfg.encoders.spaces import SINGLE
from pidcfg.schemas.click import BITS, FLOATS, INTEGERS
from pidcfg.sim.controllers.click.errors import nearest_allowed
from pidcfg.sim.controllers.click.state import DEVIATION_ALARMS, PV_ALARMS, RATE_OF_CHANGE, UNBOUNDED
from pidcfg.sim.plc import TICKS
from pidcfg.sim.records import read_registers, register_values
from pidcfg.sim.terms import single

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pidcfg.sim.controllers.click.state import Config, State

BANKS = {"bits": BITS, "integers": INTEGERS, "floats": FLOATS}
ROWS = [
    (key, prefix, row) for key, (prefix, table) in BLOCKS.items() for row in table.words if row.access != "reserved"
]
"""Every register that is not reserved: its block, its bank and its row."""
MILLISECOND = TICKS // 1000


def float_of(raw: int) -> float:
    """The number that single-precision bits are, exactly."""
    value: float = struct.unpack(">f", raw.to_bytes(4, "big"))[0]
    return value


def bits_of(value: float) -> int:
    """The bits of a single-precision number."""
    return int.from_bytes(struct.pack(">f", value), "big")


@dataclass(slots=True)
class Loop:
    """A loop's registers by name, and what no register holds."""

    name: str
    goal: str
    has_setpoint: bool
    """Whether the configuration gives a set point; it may leave that to the operator."""
    pwm: bool
    starts: Mapping[str, int]
    """The number of each block's first register."""
    words: dict[str, int]

    def numbers(self) -> dict[str, float]:
        """What every register holds."""
        return {row.name: number_of(prefix, self.words[row.name]) for _, prefix, row in ROWS}

    def absorb(self, s: State) -> None:
        """Put what the controller has written into the registers."""
        for name, value in register_values(s).items():
            self.words[name] = value & 0xFFFF if isinstance(value, int) else bits_of(value)


def number_of(prefix: str, raw: int) -> float:
    """What a register of a bank holds."""
    kind = SPACE.kind(SPACE.number(prefix, 1))
    return float_of(raw) if kind is SINGLE else kind.show(raw)


def loop_of(words: Mapping[int, int], index: int, entry: Mapping[str, Any]) -> Loop:
    """A loop from the PLC's memory and its entry in the image's settings; a register that was never written is 0."""
    starts = {key: BANKS[key].parse(entry[key]) for key in BLOCKS}
    contents = {row.name: words.get(SPACE.number(prefix, starts[key] + row.offset), 0) for key, prefix, row in ROWS}
    output = entry.get("output") or {}
    name = str(entry.get("loop", default_name(index)))
    return Loop(
        name,
        entry.get("mode", "manual"),
        entry.get("setpoint") is not False,
        output.get("pwm") is not None,
        starts,
        contents,
    )


def configure(c: Config, n: Mapping[str, float]) -> None:
    """Everything in a loop's `Config` that follows from its registers."""
    read_registers(c, n)
    c.filter = single(nearest_allowed("filter", n["filter"]) / 100.0)
    c.deadband_on = int(n["deadband_enable"] and c.deadband > 0.0)
    c.bumpless = 2 if n["bumpless_mode"] else 1
    c.pwm_period = int(nearest_allowed("pwm_period", n["pwm_period"])) * TICKS


def alarms_off(n: Mapping[str, float]) -> int:
    """The alarms of the groups that are off; they go off with the bit (D655)."""
    pv = 0 if n["pv_alarm_enable"] else PV_ALARMS
    deviation = 0 if n["deviation_alarm_enable"] else DEVIATION_ALARMS
    return pv | deviation | (0 if n["rate_alarm_enable"] else RATE_OF_CHANGE)


def write_state(s: State, n: Mapping[str, float]) -> None:
    """The registers that the controller writes too, as they stand in memory; the sample rate within its limits."""
    read_registers(s, n)
    s.period = sample_ticks(n["sample_rate"])
    s.status &= ~alarms_off(n)
    s.quiet_low, s.quiet_high = UNBOUNDED, -UNBOUNDED


def sample_ticks(milliseconds: float) -> int:
    """The time between two samples, within the register's range even with a PID error (D118)."""
    return int(nearest_allowed("sample_rate", milliseconds)) * MILLISECOND
