"""One loop's V-memory words to the sections of its configuration, with everything left out that is a default."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from pidcfg.encoders.dl06.encode import ends, scales
from pidcfg.encoders.dl06.status import intended_mode
from pidcfg.encoders.maps.dl06 import RAMP_SOAK_PAIR, RAMP_SOAK_PAIRS, RAMP_SOAK_SIZE
from pidcfg.encoders.values import Data, present, quantity
from pidcfg.encoders.words import DecodeError
from pidcfg.schemas.base import plain_number
from pidcfg.schemas.dl06 import Autotune, Loop
from pidcfg.schemas.octal import v_name

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from pidcfg.encoders.regmap import RegisterMap
    from pidcfg.encoders.scales import Scale
    from pidcfg.schemas.dl06 import LoopSettings, Scaling

CHOICES = ("algorithm", "bumpless", "bias_freeze", "independent_of_cpu_mode")
DEFAULTS = {key: Loop.model_fields[key].default for key in CHOICES}
AUTOTUNE = {key: field.default for key, field in Autotune.model_fields.items()}
"""Choices that are left out when they are what the schema takes by default."""


@dataclass(frozen=True, slots=True)
class LoopReader:
    """One loop's words on their way to a mapping."""

    start: int
    table: RegisterMap
    raw: list[int]
    beside: LoopSettings
    notes: list[str]

    @property
    def name(self) -> str:
        """The loop's name."""
        return self.beside.loop

    def word(self, name: str) -> int:
        """A register as it is."""
        return self.raw[self.table.offset(name)]

    def data(self, words: Mapping[int, int], names: Mapping[int, str]) -> Data:
        """The loop as a mapping, in the order of a hand-written file."""
        scales = self.scales()
        try:
            values = self.table.decode(self.raw, scales)
        except DecodeError as error:
            raise self.misread(error, self.start) from None
        self.note_status()
        data: Data = {"name": self.name, **present({"description": self.beside.description})}
        data["mode"] = self.mode()
        data |= _cascade(values["remote_setpoint"], names)
        data["sample_rate"] = plain_number(values["sample_rate"])
        data |= _chosen(values, ("algorithm",))
        data["action"] = values["action"]
        data |= _chosen(values, ("bumpless", "bias_freeze", "independent_of_cpu_mode"))
        data["tuning"] = _tuning(values)
        data |= self.valued("derivative_gain_limit", values, "derivative_gain_limit")
        sections = {
            "pv": self.pv(values),
            "setpoint": self.setpoint(values, scales["sp"]),
            "output": self.output(values, scales["output"]),
            "error": self.error(values),
            "alarms": self.alarms(values),
            "ramp_soak": self.ramp_soak(values, words, scales),
            "autotune": {k: values[f"autotune.{k}"] for k in AUTOTUNE if values[f"autotune.{k}"] != AUTOTUNE[k]},
            "state": {k: quantity(values[f"state.{k}"]) for k in ("pv", "bias", "output") if self.word(k)},
        }
        return data | {key: section for key, section in sections.items() if section}

    def scales(self) -> dict[str, Scale]:
        """The scales, from the format bits and the ranges beside the words."""
        try:
            bits = self.table.decode_bits(self.raw)
        except DecodeError as error:
            raise self.misread(error, self.start) from None
        ranges = self.beside.pv.range, self.beside.output.range
        return scales(bits["pv.format"], bits["output.format"], ranges, root=bits["pv.square_root"])

    def misread(self, error: DecodeError, start: int) -> DecodeError:
        """An error with the address of the word and the loop's name."""
        address = start + (error.place or 0)
        return DecodeError(f"{self.name}, {v_name(address)}: {error}", address)

    def mode(self) -> str:
        """From the status word; a listing made before the first run has none, then the mode beside the words."""
        return intended_mode(self.word("mode_and_alarm_status"), self.beside.mode)

    def note_status(self) -> None:
        """Says which bits are not carried: momentary requests, flags that the controller writes, reserved bits."""
        for row in self.table.bits:
            if row.path is None and self.raw[row.offset] & row.mask and row.title not in _MODE_TITLES:
                address = v_name(self.start + row.offset)
                self.notes.append(f"{self.name}: {address} {self.raw[row.offset]:04X}: {row.title} is not carried over")

    def valued(self, key: str, values: Data, name: str, path: str | None = None, shown: Any = None) -> Data:
        """A value with its enable bit: left out when both are 0, with ``…_enabled: false`` when only the bit is."""
        path = path or key
        on = values[f"{path}_enabled"]
        if not on and not self.word(name):
            return {}
        value = quantity(values[path]) if shown is None else shown
        return {key: value} if on else {key: value, f"{key}_enabled": False}

    def pv(self, values: Data) -> Data:
        """The section ``pv``."""
        data = _scaling(self.beside.pv)
        data["format"] = values["pv.format"]
        if values["pv.square_root"]:
            data["square_root"] = True
        data |= self.valued("filter", values, "filter", "pv.filter")
        return data | _transfer(values["pv.transfer"])

    def setpoint(self, values: Data, scale: Scale) -> Data:
        """The section ``setpoint``."""
        given = self.beside.setpoint or self.word("setpoint")
        data: Data = {"value": quantity(values["setpoint.value"])} if given else {}
        if values["setpoint.limits_enabled"] or not self.at_ends("setpoint", scale):
            data["limits"] = [quantity(values["setpoint.limits.0"]), quantity(values["setpoint.limits.1"])]
            if not values["setpoint.limits_enabled"]:
                data["limits_enabled"] = False
        return data

    def output(self, values: Data, scale: Scale) -> Data:
        """The section ``output``."""
        data = _scaling(self.beside.output)
        if values["output.format"]:
            data["format"] = values["output.format"]
        if not self.at_ends("output", scale):
            data["limits"] = [quantity(values["output.limits.0"]), quantity(values["output.limits.1"])]
        return data | _transfer(values["output.transfer"])

    def at_ends(self, part: str, scale: Scale) -> bool:
        """Whether both limits are what limits that are not given are encoded as."""
        codec = scale.format.codec
        low, high = (codec.encode(int(end.value)) for end in ends(scale))
        return self.word(f"{part}_low") == low and self.word(f"{part}_high") == high

    def error(self, values: Data) -> Data:
        """The section ``error``."""
        data = {"curve": "squared"} if values["error.curve"] == "squared" else {}
        return data | self.valued("deadband", values, "deadband", "error.deadband")

    def alarms(self, values: Data) -> Data:
        """The section ``alarms``."""
        data: Data = {
            "pv": self.group(values, "alarms.pv", "pv", ("low_low", "low", "high", "high_high")),
            "deviation": self.group(values, "alarms.deviation", "deviation", ("yellow", "red")),
        }
        data = {key: section for key, section in data.items() if section}
        data |= self.valued("rate_of_change", values, "rate_of_change", "alarms.rate_of_change")
        if self.word("hysteresis") or values["alarms.pv.enabled"] or values["alarms.deviation.enabled"]:
            data["hysteresis"] = quantity(values["alarms.hysteresis"])
        return data

    def group(self, values: Data, path: str, prefix: str, keys: tuple[str, ...]) -> Data:
        """Alarms that share an enable bit: all of them when it is on, the stored ones and ``enabled: false`` if not."""
        on = values[f"{path}.enabled"]
        data = {k: quantity(values[f"{path}.{k}"]) for k in keys if on or self.word(f"{prefix}_{k}")}
        return data if on or not data else {**data, "enabled": False}

    def ramp_soak(self, values: Data, words: Mapping[int, int], scales: Mapping[str, Scale]) -> Data:
        """The section ``ramp_soak``, with the steps when the listing holds the whole table."""
        table, on, request = values["ramp_soak.table"], values["ramp_soak.enabled"], values["ramp_soak.request"]
        if not table and not on and request == "none":
            return {}
        data: Data = {"table": v_name(table)}
        if not on:
            data["enabled"] = False
        if request != "none":
            data["request"] = request
        addresses = range(table, table + RAMP_SOAK_SIZE)
        missing = next((a for a in addresses if a not in words), None)
        if missing is None:
            data["steps"] = self.steps([words[a] for a in addresses], table, scales)
        else:
            self.notes.append(
                f"{self.name}: {v_name(missing)} of the ramp/soak table is missing; its steps are left out"
            )
        return data

    def steps(self, raw: list[int], table: int, scales: Mapping[str, Scale]) -> list[Data]:
        """The pairs of a ramp/soak table without the unused ones at its end."""
        size = RAMP_SOAK_PAIR.size
        pairs = [raw[j * size : (j + 1) * size] for j in range(RAMP_SOAK_PAIRS)]
        while pairs and not any(pairs[-1]):
            pairs.pop()
        return [self.step(pair, table + j * size, scales) for j, pair in enumerate(pairs)]

    def step(self, pair: list[int], start: int, scales: Mapping[str, Scale]) -> Data:
        """One pair of ramp and soak."""
        try:
            return _step(RAMP_SOAK_PAIR.decode(pair, scales), pair)
        except DecodeError as error:
            raise self.misread(error, start) from None


_MODE_TITLES = {"Manual mode", "Automatic mode", "Cascade mode"}


def _scaling(part: Scaling) -> Data:
    """Range and unit as the file writes them."""
    ends_of_range = part.range and [plain_number(end) for end in part.range]
    return present({"range": ends_of_range, "unit": part.unit})


def _chosen(values: Data, keys: tuple[str, ...]) -> Data:
    """The choices that differ from their default."""
    return {key: values[key] for key in keys if values[key] != DEFAULTS[key]}


def _cascade(pointer: int, names: Mapping[int, str]) -> Data:
    if not pointer:
        return {}
    return {"cascade_from": names[pointer]} if pointer in names else {"remote_setpoint": v_name(pointer)}


def _tuning(values: Data) -> Data:
    reset = values["tuning.reset"]
    data: Data = {"gain": plain_number(values["tuning.gain"]), "reset": plain_number(reset) if reset else "off"}
    if values["tuning.reset_unit"] == "minutes":
        data["reset_unit"] = "minutes"
    return {**data, "rate": plain_number(values["tuning.rate"])}


def _transfer(value: tuple[int, int, int] | int | None) -> Data:
    if value is None:
        return {}
    if isinstance(value, int):
        return {"transfer": {"address": v_name(value)}}
    base, slot, channel = value
    return {"transfer": {**({"base": base} if base else {}), "slot": slot, "channel": channel}}


def _step(values: Data, raw: Sequence[int]) -> Data:
    data = {
        "ramp_to": quantity(values["ramp_to"]),
        "slope": quantity(values["slope"]),
        "soak": plain_number(values["soak"]),
    }
    return {**data, "deviation": quantity(values["deviation"])} if raw[-1] else data
