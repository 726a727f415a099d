"""The virtual DL06: one scan of its loop task, and its V-memory as others see it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.encoders.codecs import DecodeError, EncodeError, bcd_digits
from pidcfg.encoders.maps.dl06 import ERROR_FLAGS, FORMATS, LOOP_COUNT, LOOP_TABLE, LOOP_TABLES, SPACE, TABLE_POINTER
from pidcfg.encoders.regmap import Bits, Word, decode_one
from pidcfg.sim.controllers.dl06.autotune import tune
from pidcfg.sim.controllers.dl06.equation import (
    CASCADE,
    FIRST,
    FRESH,
    GOAL,
    MANUAL,
    OUTPUT_CUT,
    OVERFLOW,
    PV_STALE,
    RELAY,
    REQUEST,
    RESTORE,
    SOAK,
    STOPPED,
    TRIP,
    TUNE,
    Config,
    State,
    alarms,
    calculate,
    position,
    raw_scales,
)
from pidcfg.sim.controllers.dl06.operate import (
    COMMANDS,
    FIXED,
    MODE_BITS,
    OVERRIDE_OVERFLOW,
    modes,
    ramp_soak,
    to_manual,
)
from pidcfg.sim.controllers.dl06.plc import Dl06, Options, load
from pidcfg.sim.controllers.kernels import NEAREST, nearest
from pidcfg.sim.controllers.settings import NO_REGISTER, NO_VALUE, Done, RegisterError, Registers
from pidcfg.sim.costs import COSTS

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, MutableSequence, Sequence

# --- The virtual DL06: one scan of its loop task ----------------------------------------------------------------------
#
# Design. `scan` is called at every base step and calculates the loops that are due, in ascending order. `sample` is
# one calculation of one loop, top to bottom in the order of the manual's block diagrams: PV word and filter, then
# whatever rarely happens (`State.busy`: mode requests, ramp/soak, auto-tune), set point, alarms, error, PID equation,
# limits, output word. Nothing here knows files, names or units: see `plc.load` for how words become `Config` and
# `State`.
#
# Signals of a loop (slots in `Config`): ``sig_in`` is read, in engineering units; ``sig_pv``, ``sig_sp``, ``sig_out``
# and ``sig_bias`` are written, as the words say in engineering units, and ``sig_step``, the step of the profile. With
# square-root extract ``sig_sp`` is the PV that satisfies the set point, so that both can be compared.

__all__ = ["COST", "INLINED", "Config", "Dl06", "Options", "State", "load", "sample", "scan"]

LARGEST = 2147483647.0
"""An output beyond a signed 32-bit number of counts is an overflow (D40)."""
MODE_WORK = TRIP | RESTORE | REQUEST | GOAL


def show_output(c: Config, s: State, sig: list[float]) -> None:
    """The output as its word says."""
    if s.busy & (STOPPED | OUTPUT_CUT) == 0:
        sig[c.sig_out] = c.out_low + (s.out - c.out_min) * c.out_width / c.out_span


def sample(i: int, cfg: list[Config], st: list[State], aux: list[float], sig: list[float]) -> None:
    """One calculation of loop ``i``."""
    c = cfg[i]
    s = st[i]
    busy = s.busy
    if busy & (STOPPED | OUTPUT_CUT):
        sig[c.sig_out] = c.out_low + (0.0 - c.out_min) * c.out_width / c.out_span
        if busy & STOPPED:
            return
    # the A/D converter saturates; the PV word is a whole number of counts (D679)
    low, least = c.pv_low, c.pv_min
    width, span = c.pv_width, c.pv_span
    pv = (sig[c.sig_in] - low) * span / width + least
    if pv >= c.pv_max:
        pv = c.pv_max
    elif pv > least:
        pv = pv + NEAREST - NEAREST
    else:
        pv = least
    old = s.pv
    # the first sample has no past (D48); the filter works on words (D36)
    if busy & FIRST:
        old = pv
    elif busy & PV_STALE:
        pv = old
    if c.filter < 1.0:
        pv = old + c.filter * (pv - old) + NEAREST - NEAREST
    s.pv = pv

    if busy:
        s.busy = busy & ~FIRST
        if busy & MODE_WORK:
            modes(i, cfg, st)
            # into Cascade a bumpless transfer writes the major loop's output (D41)
            if c.major >= 0:
                show_output(cfg[c.major], st[c.major], sig)
        if busy & SOAK:
            ramp_soak(c, s, aux, sig)
        busy = s.busy
    status = s.status

    sp = st[c.major].out if status & CASCADE else s.sp  # in Cascade +02 is left alone (D675)
    if sp < c.sp_min:
        sp = c.sp_min
    elif sp > c.sp_max:
        sp = c.sp_max
    change = pv - old
    fast = c.rate_of_change
    if pv < s.quiet_low or pv > s.quiet_high or sp != s.quiet_sp or change > fast or -change > fast:
        alarms(c, s, pv, old, sp)
        centre = sp * abs(sp) if c.root else sp
        sig[c.sig_sp] = low + (centre - least) * width / span

    if busy & TUNE:
        tune(c, s, aux, sp)
        busy = s.busy
    if status & MANUAL == 0 and busy & RELAY == 0:
        if c.special or busy & FRESH:
            m = calculate(c, s, sp, pv)
        else:
            e = (sp - pv) / c.span
            m = position(c, s, e, e)
        if m > LARGEST or m < -LARGEST:
            s.status |= OVERFLOW
            to_manual(i, cfg, st, OVERRIDE_OVERFLOW)
        else:
            if m > c.m_high:
                m = c.m_high
            if m < c.m_low:
                m = c.m_low
            s.m = m
            s.out = m + NEAREST - NEAREST

    sig[c.sig_pv] = low + (pv - least) * width / span
    low, least = c.out_low, c.out_min
    width, span = c.out_width, c.out_span
    if busy & OUTPUT_CUT == 0:
        sig[c.sig_out] = low + (s.out - least) * width / span
    sig[c.sig_bias] = low + (s.bias + NEAREST - NEAREST - least) * width / span


def next_slow(tick: int, cfg: list[Config], st: list[State]) -> int:
    """The slow loop that this scan calculates: the first due behind the last served (D52); -1: none.

    Loops that Program mode has stopped take no turn (D650).
    """
    n = len(cfg)
    for k in range(1, n + 1):
        i = (st[0].turn + k) % n
        if cfg[i].slow and tick >= st[i].due and st[i].busy & STOPPED == 0:
            st[0].turn = i
            return i
    return -1


def scan(tick: int, cfg: list[Config], st: list[State], aux: list[float], sig: list[float]) -> None:
    """One scan at ``tick``: every fast loop that is due, and at most one slow one where scans have a length."""
    chosen = -2
    for i in range(len(cfg)):
        s = st[i]
        due = s.due
        if tick < due:
            continue
        if cfg[i].slow:
            if chosen == -2:
                chosen = next_slow(tick, cfg, st)
            if i != chosen:
                continue
        due += s.period
        s.due = due if due > tick else tick + s.period
        sample(i, cfg, st, aux, sig)


INLINED = (scan, sample, position)
"""The hot path of compiled code."""
COST = COSTS["dl06"]

# --- The V-memory of a virtual DL06: set-up words, loop table and ramp/soak tables ------------------------------------

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
        mode = next(name for name, bit in MODE_BITS.items() if bits & bit)
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
