"""One loop's V-memory words back to a configuration, with everything left out that is a default."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from pidcfg.encoders.blocks import LoopBlock
from pidcfg.encoders.dl06.encode import scales, unset_limits
from pidcfg.encoders.dl06.status import intended_mode
from pidcfg.encoders.mapping import defaults_of, file_data
from pidcfg.encoders.maps.dl06 import RAMP_SOAK_PAIR, RAMP_SOAK_PAIRS, RAMP_SOAK_SIZE, SPACE
from pidcfg.encoders.settings import settings_values
from pidcfg.encoders.values import Data, present
from pidcfg.schemas.dl06 import OFF_NINES, Loop, RampSoakStep
from pidcfg.schemas.octal import v_name

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from decimal import Decimal

    from pidcfg.encoders.scales import Scale
    from pidcfg.schemas.dl06 import LoopSettings

ALWAYS = frozenset({"mode", "tuning.reset", "tuning.rate", "pv.format"})
"""Fields that are written even where they are defaults."""
MODE_TITLES = {"Manual mode", "Automatic mode", "Cascade mode"}


@dataclass(frozen=True, slots=True)
class LoopReader:
    """One loop's words on their way to a mapping."""

    block: LoopBlock
    settings: LoopSettings
    loop_table: range
    """The words of all loops."""
    notes: list[str] = field(default_factory=list)

    def data(self, words: Mapping[int, int], names: Mapping[int, str]) -> Data:
        """The loop as a mapping, in the order of a hand-written file; ``names``: loops by their output words."""
        scales = self.scales()
        values = settings_values(self.settings) | self.block.values(scales)
        self.note_status()
        always = set(ALWAYS)
        if self.settings.setpoint:
            always.add("setpoint.value")
        if values["alarms.pv.enabled"] or values["alarms.deviation.enabled"]:
            always.add("alarms.hysteresis")
        values |= {
            "mode": intended_mode(self.block.word("mode_and_alarm_status"), self.settings.mode),
            **_source(values["remote_setpoint"], names),
            "tuning.reset": reset_of(self.block.word("reset"), values["tuning.reset"]),
            "pv.transfer": _transfer(values["pv.transfer"]),
            "output.transfer": _transfer(values["output.transfer"]),
            "ramp_soak": self.ramp_soak(values, words, scales),
        }
        return file_data(Loop, values, self.unset(scales), frozenset(always))

    def scales(self) -> dict[str, Scale]:
        """The scales, from the format bits and the ranges beside the words."""
        bits = self.block.choices()
        ranges = self.settings.pv.range, self.settings.output.range
        return scales(bits["pv.format"], bits["output.format"], ranges, root=bits["pv.square_root"])

    def unset(self, scales: Mapping[str, Scale]) -> Data:
        """What the words mean where the file gives no values; the reset time is always given."""
        table = self.block.table
        return table.held(defaults_of(Loop, [table], unset_limits(scales)) | {"tuning.reset": None}, scales)

    def note_status(self) -> None:
        """Says which bits are not carried: momentary requests, flags that the controller writes, reserved bits."""
        for row in self.block.table.bits:
            word = self.block.raw[row.offset]
            if row.path is None and word & row.mask and row.title not in MODE_TITLES:
                address = v_name(self.block.start + row.offset)
                self.notes.append(f"{self.block.loop}: {address} {word:04X}: {row.title} is not carried over")

    def ramp_soak(self, values: Data, words: Mapping[int, int], scales: Mapping[str, Scale]) -> Data | None:
        """The section ``ramp_soak``, with the steps when the listing holds the whole table."""
        table, on, request = values["ramp_soak.table"], values["ramp_soak.enabled"], values["ramp_soak.request"]
        if not table and not on and request == "none":
            return None
        data: Data = {"table": v_name(table)}
        if not on:
            data["enabled"] = False
        if request != "none":
            data["request"] = request
        addresses = range(table, table + RAMP_SOAK_SIZE)
        missing = next((a for a in addresses if a not in words), None)
        if addresses[0] < self.loop_table.stop and addresses[-1] >= self.loop_table.start:
            self.notes.append(
                f"{self.block.loop}: the ramp/soak table at {v_name(table)} lies over the loop table: its words are no "
                "steps"
            )
        elif missing is None:
            data["steps"] = self.steps([words[a] for a in addresses], table, scales)
        else:
            self.notes.append(
                f"{self.block.loop}: {v_name(missing)} of the ramp/soak table is missing; its steps are left out"
            )
        return data

    def steps(self, raw: Sequence[int], table: int, scales: Mapping[str, Scale]) -> list[Data]:
        """The pairs of a ramp/soak table without the unused ones at its end."""
        size, unset = RAMP_SOAK_PAIR.size, RAMP_SOAK_PAIR.held({}, scales)
        pairs = [tuple(raw[j * size : (j + 1) * size]) for j in range(RAMP_SOAK_PAIRS)]
        while pairs and not any(pairs[-1]):
            pairs.pop()
        blocks = (
            LoopBlock(self.block.loop, SPACE, table + j * size, RAMP_SOAK_PAIR, pair) for j, pair in enumerate(pairs)
        )
        return [file_data(RampSoakStep, block.values(scales), unset, frozenset({"soak"})) for block in blocks]


def reset_of(word: int, time: Decimal) -> Decimal | str:
    """A reset time, or which of the two words that switch the integral off stands there."""
    return {0x0000: "off", 0x9999: OFF_NINES}.get(word, time)


def _source(pointer: int, names: Mapping[int, str]) -> Data:
    """Where the remote set point comes from: a loop's output, or an address."""
    return {
        "cascade_from": names.get(pointer),
        "remote_setpoint": v_name(pointer) if pointer and pointer not in names else None,
    }


def _transfer(value: tuple[int, int, int] | int | None) -> Data | None:
    if value is None or isinstance(value, int):
        return None if value is None else {"address": v_name(value)}
    base, slot, channel = value
    return {**present({"base": base or None}), "slot": slot, "channel": channel}
