"""The virtual DL06: one scan of its loop task, and its V-memory as others see it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, MutableSequence, Sequence

from pidcfg.encoders.codecs import DecodeError, EncodeError, bcd_digits
from pidcfg.encoders.maps.dl06 import ERROR_FLAGS, FORMATS, LOOP_COUNT, LOOP_TABLE, LOOP_TABLES, SPACE, TABLE_POINTER
from pidcfg.encoders.regmap import Bits, Word
from pidcfg.sim.controllers.dl06.autotune import run_autotune
from pidcfg.sim.controllers.dl06.equation import (
    CASCADE,
    FIRST_SAMPLE,
    GOAL,
    MANUAL,
    NO_PAST,
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
    calculate_output,
    calculate_position,
    raw_scales,
    renew_alarms,
)
from pidcfg.sim.controllers.dl06.operate import (
    COMMANDS,
    MODE_BITS,
    OVERRIDE_OVERFLOW,
    UNSETTABLE_FIELDS,
    ramp_soak,
    to_manual,
    update_mode,
)
from pidcfg.sim.controllers.dl06.plc import Dl06, Options, load
from pidcfg.sim.controllers.kernels import ROUNDING_MAGIC, round_half_even
from pidcfg.sim.controllers.settings import NO_LOOP, NO_REGISTER, NO_VALUE, RegisterError, Registers, WriteResult
from pidcfg.sim.costs import COSTS

# --- The virtual DL06: one scan of its loop task ----------------------------------------------------------------------
#
# Design. `scan` is called at every base step and calculates the loops that are due, in ascending order. `sample` is
# one calculation of one loop, top to bottom in the order of the manual's block diagrams: PV word and filter, then
# whatever rarely happens (`State.pending`: mode requests, ramp/soak, auto-tune), set point, alarms, error, PID
# equation, limits, output word. Nothing here knows files, names or units: see `plc.load` for how words become `Config`
# and `State`.
#
# Signals of a loop (slots in `Config`): ``in_slot`` is read, in engineering units; ``pv_slot``, ``sp_slot``,
# ``out_slot`` and ``bias_slot`` are written, as the words say in engineering units, and ``step_slot``, the step of the
# profile. With square-root extract ``sp_slot`` is the PV that satisfies the set point, so that both can be compared.

__all__ = ["COST", "INLINED", "Config", "Dl06", "Options", "State", "load", "sample", "scan"]

MAX_OUTPUT_COUNTS = 2147483647.0
"""An output beyond a signed 32-bit number of counts is an overflow (D40)."""
MODE_WORK = TRIP | RESTORE | REQUEST | GOAL


def show_output(config: Config, state: State, signals: list[float]) -> None:
    """The output as its word says."""
    if state.pending & (STOPPED | OUTPUT_CUT) == 0:
        signals[config.out_slot] = config.out_low + (state.out - config.out_min) * config.out_width / config.out_span


def sample(i: int, configs: list[Config], states: list[State], aux: list[float], signals: list[float]) -> None:
    """One calculation of loop ``i``."""
    config = configs[i]
    state = states[i]
    pending = state.pending
    if pending & (STOPPED | OUTPUT_CUT):
        signals[config.out_slot] = config.out_low + (0.0 - config.out_min) * config.out_width / config.out_span
        if pending & STOPPED:
            return
    # Process variable: the A/D converter saturates; D679: the word is whole counts
    low, minimum = config.pv_low, config.pv_min
    width, span = config.pv_width, config.pv_span
    pv = (signals[config.in_slot] - low) * span / width + minimum
    if pv >= config.pv_max:
        pv = config.pv_max
    elif pv > minimum:
        pv = pv + ROUNDING_MAGIC - ROUNDING_MAGIC
    else:
        pv = minimum
    previous_pv = state.pv
    # PV filter: k (PV - PV(n-1)) + PV(n-1). D48: the first sample has no past; D36: it works on words
    if pending & FIRST_SAMPLE:
        previous_pv = pv
    elif pending & PV_STALE:
        pv = previous_pv
    if config.filter < 1.0:
        pv = previous_pv + config.filter * (pv - previous_pv) + ROUNDING_MAGIC - ROUNDING_MAGIC
    state.pv = pv

    if pending:
        state.pending = pending & ~FIRST_SAMPLE
        if pending & MODE_WORK:
            update_mode(i, configs, states)
            # into Cascade a bumpless transfer writes the major loop's output (D41)
            if config.major >= 0:
                show_output(configs[config.major], states[config.major], signals)
        if pending & SOAK:
            ramp_soak(config, state, aux, signals)
        pending = state.pending
    status = state.status

    # Set point with its limits; D675: in Cascade +02 is left alone
    sp = states[config.major].out if status & CASCADE else state.sp
    if sp < config.sp_min:
        sp = config.sp_min
    elif sp > config.sp_max:
        sp = config.sp_max
    # Alarms, where one may come on or go off
    change = pv - previous_pv
    fast = config.rate_of_change
    if (
        pv < state.alarm_band_low
        or pv > state.alarm_band_high
        or sp != state.alarm_band_sp
        or change > fast
        or -change > fast
    ):
        renew_alarms(config, state, pv, previous_pv, sp)
        centre = sp * abs(sp) if config.square_root else sp
        signals[config.sp_slot] = low + (centre - minimum) * width / span

    if pending & TUNE:
        run_autotune(config, state, aux, sp)
        pending = state.pending
    # Control output: the equation, then its limits
    if status & MANUAL == 0 and pending & RELAY == 0:
        if config.is_special or pending & NO_PAST:
            output = calculate_output(config, state, sp, pv)
        else:
            error = (sp - pv) / config.span
            output = calculate_position(config, state, error, error)
        if output > MAX_OUTPUT_COUNTS or output < -MAX_OUTPUT_COUNTS:
            state.status |= OVERFLOW
            to_manual(i, configs, states, OVERRIDE_OVERFLOW)
        else:
            if output > config.output_high_limit:
                output = config.output_high_limit
            if output < config.output_low_limit:
                output = config.output_low_limit
            state.unrounded_output = output
            state.out = output + ROUNDING_MAGIC - ROUNDING_MAGIC

    signals[config.pv_slot] = low + (pv - minimum) * width / span
    low, minimum = config.out_low, config.out_min
    width, span = config.out_width, config.out_span
    if pending & OUTPUT_CUT == 0:
        signals[config.out_slot] = low + (state.out - minimum) * width / span
    signals[config.bias_slot] = low + (state.bias + ROUNDING_MAGIC - ROUNDING_MAGIC - minimum) * width / span


def next_slow_loop(tick: int, configs: list[Config], states: list[State]) -> int:
    """The slow loop that this scan calculates: the first due behind the last served (D52); -1: none.

    Loops that Program mode has stopped take no turn (D650).
    """
    n = len(configs)
    for k in range(1, n + 1):
        i = (states[0].last_slow_loop + k) % n
        if configs[i].slow and tick >= states[i].due and states[i].pending & STOPPED == 0:
            states[0].last_slow_loop = i
            return i
    return -1


def scan(tick: int, configs: list[Config], states: list[State], aux: list[float], signals: list[float]) -> None:
    """One scan at ``tick``: every fast loop that is due, and at most one slow one where scans have a length."""
    slow_loop = -2
    for i in range(len(configs)):
        state = states[i]
        due = state.due
        if tick < due:
            continue
        if configs[i].slow:
            if slow_loop == -2:
                slow_loop = next_slow_loop(tick, configs, states)
            if i != slow_loop:
                continue
        due += state.period
        state.due = due if due > tick else tick + state.period
        sample(i, configs, states, aux, signals)


INLINED = (scan, sample, calculate_position)
"""The hot path of compiled code."""
COST = COSTS["dl06"]

# --- The V-memory of a virtual DL06: set-up words, loop table and ramp/soak tables ------------------------------------


class Dl06Registers(Registers):
    """Words of V-memory; request bits are read as 0, since the PLC takes them at once."""

    def __init__(self, plc: Dl06) -> None:
        self.plc = plc
        start = plc.words.get(TABLE_POINTER, 0)
        self._rows = {
            start + i * LOOP_TABLE.size + row.offset: (i, row)
            for i in range(len(plc.loops))
            for row in LOOP_TABLE.words
        }

    def loops_by_register(self) -> dict[int, int]:
        """Loop tables; set-up words and ramp/soak tables belong to no loop here."""
        others = {number for number in self.plc.words if number not in self._rows}
        return dict.fromkeys([*others, ERROR_FLAGS], NO_LOOP) | super().loops_by_register()

    def contents(self, loop: int, signals: Sequence[float]) -> Mapping[int, int]:
        """As the words are after the last scan."""
        if loop == NO_LOOP:
            others = {n: raw for n, raw in self.plc.words.items() if n not in self._rows}
            return others | {ERROR_FLAGS: self.plc.error_words["V7642"]}
        memory = self.plc.memory(loop).memory
        held = {row.name: memory[row.offset] for row in LOOP_TABLE.words}
        return self.contents_by_number(loop, held | dict(self._controller_words(loop)))

    def _controller_words(self, loop: int) -> Iterator[tuple[str, int]]:
        """Words that the controller writes."""
        state, values, memory = self.plc.states[loop], self.plc.memory(loop).values, self.plc.memory(loop).memory
        pv = FORMATS[values["pv.format"]]
        output = FORMATS[values["output.format"] or values["pv.format"]]
        counted_words = (
            ("setpoint", pv, state.sp),
            ("pv", pv, state.pv),
            ("bias", output, state.bias),
            ("output", output, state.out),
        )
        for name, kind, value in counted_words:
            counts = int(round_half_even(value))
            try:
                yield name, kind.codec.encode(counts)
            except EncodeError:
                yield name, kind.codec.encode(kind.codec.high if counts > 0 else kind.codec.low)
        yield "mode_and_alarm_status", state.status
        for name in ("mode_setting_1", "mode_setting_2"):
            yield name, memory[LOOP_TABLE.offset_of(name)] & ~_requests(LOOP_TABLE.offset_of(name))
        yield "ramp_soak_flags", state.aux_status & ~_requests(LOOP_TABLE.offset_of("ramp_soak_flags"))
        yield "ramp_soak_errors", state.rs_error

    def write(self, number: int, raw: int, signals: MutableSequence[float]) -> WriteResult:
        """A word; bits of it that are requests are carried out, and those that the PLC writes stay."""
        name = SPACE.name(number)
        if number not in self._rows:
            return self._write_outside_table(number, raw)
        loop, row = self._rows[number]
        if row.path is None and row.access == "status":
            raise self.read_only_error(name, row)
        if row.path in UNSETTABLE_FIELDS:
            raise RegisterError(NO_REGISTER, f"{name} ({row.title}) is wired, or written by the analog input")
        if row.path is None:
            return self._write_bits(loop, row, raw, signals)
        memory = self.plc.memory(loop)
        self.decode(name, LOOP_TABLES[memory.decimals].words[row.offset].decode, raw, raw_scales(memory.values))
        late = self.plc.write(loop, [(row, raw)], signals)
        return WriteResult.setting(row.path, f"{name} = {SPACE.content_text(number, raw)}", late)

    def _write_bits(self, loop: int, word: Word, raw: int, signals: MutableSequence[float]) -> WriteResult:
        """The bits of a word, one choice after the other."""
        changes: list[WriteResult] = []
        memory = self.plc.memory(loop).memory
        for row in LOOP_TABLE.bits:
            bits = raw & row.mask
            if row.offset != word.offset:
                continue
            if row.access == "request" and bits:
                changes.append(self._request(loop, row, bits))
            elif row.access == "setting" and bits != memory[row.offset] & row.mask:
                try:
                    value = row.decode(raw)
                except DecodeError as error:
                    raise RegisterError(NO_VALUE, str(error)) from None
                late = self.plc.write(loop, [(row, bits)], signals)
                changes.append(WriteResult.setting(row.path, value, late))
        mode = next((one.mode for one in changes if one.mode), None)
        return WriteResult(", ".join(one.text for one in changes) or f"wrote {word.name}, nothing new", mode)

    def _request(self, loop: int, row: Bits, bits: int) -> WriteResult:
        """A mode, an auto-tune, or a command of the ramp/soak generator."""
        if row.offset == LOOP_TABLE.offset_of("ramp_soak_flags"):
            command = next(name for name, bit in COMMANDS.items() if bits & bit)
            self.plc.ramp_soak(loop, command)
            return WriteResult(f"ramp/soak {command}")
        if row.path == "autotune.start":
            self.plc.autotune(loop)
            return WriteResult("auto-tune start")
        mode = next(name for name, bit in MODE_BITS.items() if bits & bit)
        self.plc.request(loop, mode)
        return WriteResult(f"request mode {mode}", mode)

    def _write_outside_table(self, number: int, raw: int) -> WriteResult:
        """A set-up word, which counts at the next change to Run, or a word of a ramp/soak table."""
        name = SPACE.name(number)
        if number == ERROR_FLAGS:
            raise RegisterError(NO_REGISTER, f"{name} is written by the PLC alone")
        if number == LOOP_COUNT:
            self.decode(name, bcd_digits, raw)
        self.plc.write_outside_table(number, raw)
        return WriteResult(f"set {name} to {SPACE.content_text(number, raw)}")


def _requests(offset: int) -> int:
    """The request bits of a word."""
    return sum(row.mask for row in LOOP_TABLE.bits if row.offset == offset and row.access == "request")
