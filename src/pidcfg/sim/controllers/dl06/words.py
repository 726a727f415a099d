"""From the words of a loop table to the numbers that the controller calculates with.

Every word and bit is decoded by its row of the register map, in counts. A word that is no value of its format (a BCD
digit above 9, say) counts as 0, which switches its function off, and is reported (D50).
"""

from __future__ import annotations

from collections.abc import Mapping, MutableSequence, Sequence
from functools import lru_cache
from math import sqrt
from typing import Any, NamedTuple

from pidcfg.encoders.dl06.setup import alarm_order_broken, check_ramp_soak
from pidcfg.encoders.maps.dl06 import CPU, FORMATS, LOOP_TABLE, LOOP_TABLES, RAMP_SOAK_PAIR, RAMP_SOAK_SIZE, RESET
from pidcfg.encoders.regmap import Bits, RegisterMap, Word, decode_one
from pidcfg.encoders.scales import Scale
from pidcfg.encoders.words import DecodeError
from pidcfg.schemas.base import Quantity
from pidcfg.sim.controllers.dl06.state import CASCADE, OUTPUT_CUT, STOPPED, Config, State
from pidcfg.sim.plc import TICKS
from pidcfg.sim.records import read_registers
from pidcfg.sim.terms import clamp, nearest

Values = Mapping[str, Any]
"""Decoded values by path; quantities in counts."""

SLOW = 2 * TICKS
"""Sample rates above this are calculated at most one a scan."""


class NoWord(NamedTuple):
    """A word that is no value of its format, in words, and whether it is a setting, not what the PLC writes."""

    text: str
    setting: bool


OF_SCALES = ("pv.format", "output.format", "pv.square_root")
"""The choices that decide how counts are written."""
KEPT_TABLES = 64
"""Ramp/soak tables that are kept decoded: a loop is decoded anew whenever one of its words is written."""


def raw_scales(bits: Values) -> dict[str, Scale]:
    """The scales of a loop's words, in counts."""
    pv = FORMATS[bits["pv.format"]]
    output = FORMATS[bits["output.format"] or bits["pv.format"]]
    return {"pv": Scale(pv), "sp": Scale(pv, root=bits["pv.square_root"]), "output": Scale(output)}


def decode_block(
    table: RegisterMap, words: Sequence[int], scales: Mapping[str, Scale], start: int = 0
) -> tuple[Values, list[NoWord]]:
    """Every value of a block by path, and its words that have no value; ``start`` is where the block begins."""
    values: dict[str, Any] = {}
    problems: list[NoWord] = []
    rows: tuple[Word | Bits, ...] = (*table.bits, *table.words)
    for row in rows:
        if row.path is None:
            continue
        if isinstance(row, Word) and not scales:
            scales = raw_scales(values)
        try:
            values[row.path] = decode_row(row, words[row.offset], scales)
        except DecodeError as error:
            setting = isinstance(row, Bits) or row.access != "status"
            problems.append(NoWord(f"+{start + row.offset:02o} {row.title}: {error}; taken as 0", setting))
            values[row.path] = decode_row(row, 0, scales)
    return values, problems


def decode_row(row: Word | Bits, word: int, scales: Mapping[str, Scale]) -> Any:
    """One register's or choice's value."""
    return row.decode(word) if isinstance(row, Bits) else decode_one(row.codec, word, scales)


def decode_loop(words: Sequence[int], reset_decimals: int) -> tuple[Values, list[NoWord]]:
    """The 32 words of a loop, and which of them have no value."""
    return decode_block(LOOP_TABLES[reset_decimals], words, {})


def counts(value: Any) -> float:
    """A decoded quantity as a float."""
    return float(value.value)


def configure(c: Config, v: Values, reset_decimals: int, loops: int) -> None:
    """Everything in a loop's `Config` that follows from its words; ``loops`` decides the least sample rate (D51)."""
    read_registers(c, {path: value.value if isinstance(value, Quantity) else value for path, value in v.items()})
    _scales(c, v)
    c.bumpless = 1 if v["bumpless"] == "I" else 2
    c.m_low = clamp(counts(v["output.limits.0"]), c.out_min, c.out_max)
    c.m_high = clamp(counts(v["output.limits.1"]), c.out_min, c.out_max)
    c.span = sqrt(c.pv_span) if c.root else c.pv_span
    c.deadband = counts(v["error.deadband"]) / c.span if v["error.deadband_enabled"] else 0.0
    c.curved = int(c.root or c.squared or c.deadband > 0.0)
    c.special = int(c.velocity or c.curved or c.on_pv or c.step_bias)
    c.sees_pv = int(isinstance(v["pv.transfer"], tuple))
    c.drives = int(isinstance(v["output.transfer"], tuple))
    c.rs_fault = check_ramp_soak(v["ramp_soak.table"])
    c.reset_unit = 60.0 if v["tuning.reset_unit"] == "minutes" else 1.0
    c.reset_step = float(RESET[reset_decimals].step)
    c.least_period = ticks(CPU.fast_rate if loops <= CPU.fast_loops else CPU.slow_rate)
    c.period = max(ticks(v["sample_rate"]), c.least_period)
    c.halt = int(v["sample_rate"] == 0)


def ticks(seconds: Any) -> int:
    """Seconds as ticks."""
    return round(float(seconds) * TICKS)


def _scales(c: Config, v: Values) -> None:
    pv, output = raw_scales(v)["pv"].format, raw_scales(v)["output"].format
    c.pv_min, c.pv_max, c.pv_span = float(pv.minimum), float(pv.maximum), float(pv.span)
    c.out_min, c.out_max, c.out_span = float(output.minimum), float(output.maximum), float(output.span)
    k = float(v["pv.filter"])
    c.filter = k if v["pv.filter_enabled"] and 0.0 < k <= 1.0 else 1.0


PV_LIMITS = ("low_low", "low", "high", "high_high")
DEVIATION_LIMITS = ("yellow", "red")


def alarm_error(v: Values) -> bool:
    """Whether limits of an enabled group are out of order: bit 10 of +06, which forces Manual (D47)."""
    pv = [int(v[f"alarms.pv.{name}"].value) for name in PV_LIMITS] if v["alarms.pv.enabled"] else None
    deviation = [int(v[f"alarms.deviation.{n}"].value) for n in DEVIATION_LIMITS]
    return alarm_order_broken(pv, deviation if v["alarms.deviation.enabled"] else None)


def tuning(c: Config, s: State, v: Values, reset_decimals: int) -> None:
    """The gain words and the sample rate; a reset of all zeros or all nines is off."""
    codec = RESET[reset_decimals]
    reset = v["tuning.reset"]
    s.gain = float(v["tuning.gain"])
    s.reset = 0.0 if reset / codec.step in codec.off else float(reset) * c.reset_unit
    s.rate = float(v["tuning.rate"])
    s.period = c.period


def decode_profile(words: Sequence[int], v: Values) -> Sequence[tuple[Values, list[NoWord]]]:
    """The pairs of a ramp/soak table, each with its words that have no value."""
    return _pairs(tuple(words), *(v[path] for path in OF_SCALES))


@lru_cache(maxsize=KEPT_TABLES)
def _pairs(words: Sequence[int], *formats: Any) -> Sequence[tuple[Values, list[NoWord]]]:
    scales = raw_scales(dict(zip(OF_SCALES, formats, strict=True)))
    size = RAMP_SOAK_PAIR.size
    starts = range(0, RAMP_SOAK_SIZE, size)
    return [decode_block(RAMP_SOAK_PAIR, words[at : at + size], scales, at) for at in starts]


def profile(words: Sequence[int], v: Values) -> list[float]:
    """A ramp/soak table as the kernels want it: target, slope a second, seconds to soak, deviation for each pair."""
    table: list[float] = []
    for pair, _ in decode_profile(words, v):
        table += [counts(pair["ramp_to"]), counts(pair["slope"]), float(pair["soak"] * 60), counts(pair["deviation"])]
    return table


def major_of(pointer: int, start: int, loops: int, minor: int) -> int:
    """The loop of the table at ``start`` whose output word the remote set point pointer names; -1: none."""
    index, offset = divmod(pointer - start, LOOP_TABLE.size)
    named = offset == LOOP_TABLE.offset("output") and 0 <= index < loops and index != minor
    return index if named else -1


def write_state(s: State, v: Values, path: str) -> None:
    """Words that the controller also writes: a value from outside replaces theirs."""
    if path == "setpoint.value":
        s.sp = s.goal_sp = counts(v[path])
        s.goal_writes = 1
    elif path == "state.pv":
        s.pv = counts(v[path])
    elif path == "state.bias":
        s.bias = counts(v[path])
    elif path == "state.output":
        s.out = s.m = counts(v[path])


def show(c: Config, s: State, sig: MutableSequence[float]) -> None:
    """The signals of a loop as its words say; a remote set point stays the one that was calculated with last (D67)."""
    out = 0.0 if s.busy & (STOPPED | OUTPUT_CUT) else s.out
    if s.status & CASCADE == 0 or c.major < 0:
        sp = clamp(s.sp, c.sp_min, c.sp_max)
        centre = sp * abs(sp) if c.root else sp
        sig[c.sig_sp] = c.pv_low + (centre - c.pv_min) * c.pv_width / c.pv_span
    sig[c.sig_pv] = c.pv_low + (s.pv - c.pv_min) * c.pv_width / c.pv_span
    sig[c.sig_out] = c.out_low + (out - c.out_min) * c.out_width / c.out_span
    sig[c.sig_step] = float(s.rs_step)
    sig[c.sig_bias] = c.out_low + (nearest(s.bias) - c.out_min) * c.out_width / c.out_span
