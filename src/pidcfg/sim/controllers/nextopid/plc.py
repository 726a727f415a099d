"""The virtual NextoPID program: its modes, its place in a run, what verdicts ask of it and what ``set`` may write."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, MutableSequence
from dataclasses import replace
from decimal import Decimal
from functools import cached_property
from typing import TYPE_CHECKING, Any

from pidcfg.encoders.maps.nextopid import BLOCK_TYPES
from pidcfg.encoders.parameters import Parameter, shortest_single
from pidcfg.schemas.base import parse_duration, parse_seconds
from pidcfg.schemas.expressions import CONSTANT, SIGNAL
from pidcfg.schemas.iec import Wire
from pidcfg.schemas.numbers import refuse
from pidcfg.sim.controllers.kernels import leave_notice
from pidcfg.sim.controllers.nextopid import equation, terms
from pidcfg.sim.controllers.nextopid.memory import FIRST_ROW, ROW_SIZE, SIGNAL_PARAMETERS, Memory, number_of, value_of
from pidcfg.sim.controllers.nextopid.terms import (
    AUTO_TUNE,
    CASC,
    FLAG_COUNT,
    KP,
    MIN_TI,
    TD_KD,
    TI_KI,
    TUNE_DONE,
    TUNE_ERROR,
    TUNE_FLAGS,
    Config,
    State,
)
from pidcfg.sim.controllers.nextopid.terms import MANUAL as PIDA_MANUAL
from pidcfg.sim.controllers.nextopid.terms import TUNE_RESULT as RESULT
from pidcfg.sim.controllers.plc import COUNTS_PER_RANGE, TICKS, NoOptions
from pidcfg.sim.controllers.settings import ContentParser, NamedKeys, Seconds
from pidcfg.sim.engine.expressions import FAULTS, depends_on

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Sequence

    from pidcfg.encoders.parameters import Content, Entry, Program
    from pidcfg.schemas.base import Quantity
    from pidcfg.sim.judgement.report import TuneReport

# --- What an operator does to a loop's parameters, and what becomes of an auto-tuning (kernels) -----------------------

MANUAL_ON, MANUAL_OFF, CASC_ON, CASC_OFF, TUNE_ON, TUNE_OFF, ACCEPT = 1, 2, 4, 8, 16, 32, 64
"""Commands of the operator (`State.command`)."""
MANUAL, CASCADE, TUNE = (MANUAL_ON, MANUAL_OFF), (CASC_ON, CASC_OFF), (TUNE_ON, TUNE_OFF)
NO_RUN, RUNNING, DONE, FAILED, CANCELLED = range(5)
"""State of the last auto-tuning (`State.tune_outcome`)."""
ON_OFF_MANUAL = terms.OFFSETS["ControlON_OFF"]["Manual"]


def write_switch(state: State, pair: tuple[int, int], *, on: bool) -> None:
    """A switch is to be written; of several commands before the next cycle the last one counts (D82)."""
    state.command = state.command & ~(pair[0] | pair[1]) | pair[not on]


def write_commands(config: Config, state: State, signals: MutableSequence[float]) -> None:
    """Writes the parameters that the operator's commands change."""
    manual = config.base + (ON_OFF_MANUAL if config.kind == terms.ON_OFF else PIDA_MANUAL)
    if state.command & (MANUAL_ON | MANUAL_OFF):
        signals[manual] = 1.0 if state.command & MANUAL_ON else 0.0
    if state.command & (CASC_ON | CASC_OFF):
        signals[config.base + CASC] = 1.0 if state.command & CASC_ON else 0.0
    if state.command & ACCEPT:
        signals[config.base + KP] = signals[config.base + RESULT]
        signals[config.base + TI_KI] = signals[config.base + RESULT + 1]
        signals[config.base + TD_KD] = signals[config.base + RESULT + 2]
    if state.command & (TUNE_ON | TUNE_OFF):
        signals[config.base + AUTO_TUNE] = 1.0 if state.command & TUNE_ON else 0.0
    state.command = 0


def keep_results(config: Config, state: State, signals: MutableSequence[float]) -> None:
    """Results for the report: the block clears its own when AutoTune goes off."""
    b = config.base
    if signals[b + AUTO_TUNE] == 0.0:
        if state.tune_outcome == RUNNING:
            state.tune_outcome = CANCELLED
    elif signals[b + TUNE_DONE] == 0.0:
        state.tune_outcome = RUNNING
    elif state.tune_outcome not in (DONE, FAILED):
        state.tune_outcome = FAILED if signals[b + TUNE_ERROR] != 0.0 else DONE
        state.result_kp = signals[b + RESULT]
        state.result_ti = signals[b + RESULT + 1]
        state.result_td = signals[b + RESULT + 2]
        state.result_flags = 0
        for i in range(FLAG_COUNT):
            if signals[b + TUNE_FLAGS + i] != 0.0:
                state.result_flags |= 1 << i


# --- How a NextoPID loop is reported: names of modes, bits and signals, and notices in words --------------------------

MODE_BITS = {
    "manual": terms.MANUAL_MODE,
    "auto": terms.AUTO_MODE,
    "cascade": terms.CASCADE_MODE,
    "tracking": terms.TRACKING_MODE,
    "autotune": terms.TUNING_MODE,
}
"""The first three can be requested; the others follow from inputs of the block."""
TUNE_ROWS = [row.name for row in BLOCK_TYPES["PIDA_TUNE_REAL"].table.rows]
ERRORS = [name for name in TUNE_ROWS if name.startswith("ErrBits.")]
WARNINGS = [name for name in TUNE_ROWS if name.startswith("WarnBits.")]
FLAG_BITS = {name: terms.ERROR_BASE << i for i, name in enumerate(ERRORS)} | {"overridden": terms.OVERRIDDEN}
AUX_BITS = {name: 1 << i for i, name in enumerate(WARNINGS)}
RESULT_FLAGS = [
    name.removeprefix("AutoTuneResult.") for name in TUNE_ROWS[TUNE_ROWS.index("AutoTuneResult.Bad_PercAmpMV") :]
]

IS_WIRED = 1
"""Reasons of notices; one for each of the three requests that a wire prevents."""
CASC_IS_WIRED = 2
TUNE_IS_WIRED = 3
NO_TUNE = 4
NO_CASCADE = 5
NOTHING_TO_ACCEPT = 6
COMES_ABOUT = 7

REASONS = {
    IS_WIRED: "Manual is wired in the program; set what it is wired to",
    CASC_IS_WIRED: "CASC is wired in the program; set what it is wired to",
    TUNE_IS_WIRED: "AutoTune is wired in the program; set what it is wired to",
    NO_TUNE: "this block has no auto-tuning; use PIDA_TUNE_REAL or PIDA_TUNE_INT",
    NO_CASCADE: "ControlON_OFF has no cascade mode",
    COMES_ABOUT: "this mode comes about by itself; ask for manual, auto or cascade, or for autotune: start",
    NOTHING_TO_ACCEPT: "there are no results without error to accept",
}

TUNE_STATUS = ("idle", "running", "done", "failed", "cancelled")

# --- What a scenario's ``set`` may write in a running program: parameters of loops, blocks, and signals ---------------

TIMES = ("Tfd", "DelayTime", "Tc", "Tlead", "Tlag")
TIMES_OR_GAINS = ("Ti_Ki", "Td_Kd")
"""Times in the dependent form, gains with Indep TRUE."""
SHORT_FORMS = {"setpoint": "SP", "setpoint.value": "SP", "output": "ManualMV"}
WORDS = {"AutoTuneParam.Mode"}


def parse_tune_mode(value: object) -> str:
    """P, PI or PID."""
    if value not in {"P", "PI", "PID"}:
        refuse("set_value", f"{value!r} is not one of P, PI, PID")
    return f"AUTOTUNE_{value}"


def parse_gain(value: object) -> Decimal:
    """A gain of the independent form, which is no time (D202)."""
    duration = parse_duration(value)
    if duration.unit is not None:
        refuse(
            "set_value", f"{value} is a time, but with Indep TRUE it is a gain", help="write a number without a unit"
        )
    return duration.value


def keys_of(kind: str, name: str, wires: Mapping[str, str], *, independent: bool = False) -> NamedKeys:
    """The parameters of a block that can be set; ``wires``: those that are not, and what they are wired to.

    ``independent``: the program starts with Indep TRUE.
    """
    rows = {row.name: row for row in BLOCK_TYPES[kind].inputs}
    unsettable = {row: f"the program wires {text} to {name}.{row}; set that" for row, text in wires.items()}
    if "PV" in rows:
        unsettable.setdefault("PV", "the plant writes it; pv: is the event of a broken sensor")
    parsers: dict[str, ContentParser] = {**dict.fromkeys(TIMES, parse_seconds), **dict.fromkeys(WORDS, parse_tune_mode)}
    parsers |= dict.fromkeys(TIMES_OR_GAINS, parse_gain if independent else parse_seconds)
    short = {key: row for key, row in SHORT_FORMS.items() if row in rows}
    return NamedKeys(rows, short, {}, unsettable, parsers)


# ----------------------------------------------------------------------------------------------------------------------
# What verdicts on a run ask of a NextoPID program: modes, limits and wires, from the signals that blocks share.

MODE_KEYS = ("Manual", "CASC", "TRK_IN", "AutoTune")
"""The inputs that choose the mode of a loop."""
SELECTORS = (terms.SELECT_MAX, terms.SELECT_MIN)
SELECTOR_INPUTS = [
    (terms.OFFSETS["ControlSelectMax"][f"MV{i}"], terms.OFFSETS["ControlSelectMax"][f"OVERR{i}"]) for i in (1, 2)
]
"""The inputs of a selector, and what tells the controller behind each that it is left out."""
PWM = terms.OFFSETS["ControlPWM"]


class Facts(Memory):
    """A program's answers for the standing expectations."""

    error_flags = tuple(ERRORS)
    form_key = "Indep"
    mode_keys = MODE_KEYS

    def wires_of(self, block: int) -> Iterator[tuple[int, list[int]]]:
        """The wires of a block: the parameter that each renews, and the signals that it reads."""
        config, aux = self.configs[block], self.aux
        for row in range(FIRST_ROW + ROW_SIZE * config.wires_begin, FIRST_ROW + ROW_SIZE * config.wires_end, ROW_SIZE):
            code = range(int(aux[row + 2]), int(aux[row + 3]), 2)
            yield int(aux[row]), [int(aux[at + 1]) for at in code if aux[at] == SIGNAL]

    @property
    def signal_links(self) -> Sequence[tuple[int, int]]:
        """Moves, wires, and from each input of a block to its outputs."""
        return self._all_flow

    @cached_property
    def _all_flow(self) -> Sequence[tuple[int, int]]:
        """The program's, which no event changes."""
        return tuple(self._flow())

    def _flow(self) -> Iterator[tuple[int, int]]:
        for copy in self.copies:
            for part in (copy.value, copy.when):
                yield from ((source, copy.target) for source in (part.signals if part else ()))
        for block, i in enumerate(self.listed_items):
            for target, sources in self.wires_of(block):
                yield from ((source, target) for source in sources if self.wire_follows(block, target, source, sources))
            rows = list(enumerate(self.layout.instances[i].kind.table.rows, self.layout.instances[i].base))
            outputs = [slot for slot, row in rows if row.access == "output"]
            for slot, row in rows:
                if row.access == "input":
                    yield from ((slot, output) for output in outputs)
                if row.name in {"SP", "SP_CASC"} and self.items[i].loop is not None:
                    yield slot, self.configs[block].sp_slot

    def wire_follows(self, block: int, target: int, source: int, sources: list[int]) -> bool:
        """Whether a wire's value follows a signal that it reads."""
        config, aux = self.configs[block], self.aux
        rows = range(FIRST_ROW + ROW_SIZE * config.wires_begin, FIRST_ROW + ROW_SIZE * config.wires_end, ROW_SIZE)
        position = next(row for row in rows if int(aux[row]) == target)
        first, last = int(aux[position + 2]), int(aux[position + 3])
        if CONSTANT not in {int(op) for op in aux[first:last:2]}:
            return True

        def value(signals: Sequence[float]) -> float | None:
            found = value_of(aux, first, last, signals)
            return None if aux[int(aux[0])] else found

        return depends_on(value, self.signal_values, sources, source)

    @property
    def masters(self) -> list[int]:
        """The loop whose MV comes in at SP_CASC, by whatever blocks."""
        loop_by_output = {config.out_slot: i for i, config in enumerate(self.configs[: len(self.loops)])}
        sources = defaultdict(list)
        for source, target in self.signal_links:
            sources[target].append(source)
        masters = []
        for i, config in enumerate(self.configs[: len(self.loops)]):
            waiting, seen, master = [config.base + terms.SP_CASC] if config.kind != terms.ON_OFF else [], set(), -1
            while waiting and master < 0:
                slot = waiting.pop(0)
                master = loop_by_output.get(slot, -1) if loop_by_output.get(slot, i) != i else -1
                if slot not in seen and slot not in loop_by_output:
                    seen.add(slot)
                    waiting += sources[slot]
            masters.append(master)
        return masters

    def intended_mode(self, loop: int, signals: Sequence[float]) -> str:
        """What Manual and CASC say, or what they are wired to."""
        if self.value_of(loop, "Manual", signals):
            return "manual"
        return "cascade" if self.value_of(loop, "CASC", signals) else "auto"

    def value_of(self, loop: int, row: str, signals: Sequence[float]) -> float:
        """The value of a parameter, or of what it is wired to; 0 where the loop has none."""
        number = self.layout.numbers.get(f"{self.loops[loop]}.{row}")
        return 0.0 if number is None else self.wired_value(loop, number, signals)

    def wired_value(self, block: int, number: int, signals: Sequence[float]) -> float:
        """What a parameter of a block has at its next call: its value, or that of its wire where it has one."""
        config = self.configs[block]
        for row in range(FIRST_ROW + ROW_SIZE * config.wires_begin, FIRST_ROW + ROW_SIZE * config.wires_end, ROW_SIZE):
            if int(self.aux[row]) == number:
                value = value_of(self.aux, int(self.aux[row + 2]), int(self.aux[row + 3]), signals)
                return signals[number] if self.aux[int(self.aux[0])] else value
        return signals[number]

    def given_set_point(self, loop: int, signals: Sequence[float]) -> float:
        """SP, or what it is wired to."""
        return self.value_of(loop, "SP", signals)

    def mode_inputs(self, loop: int) -> set[int]:
        """What the wires of its mode inputs read."""
        base = self.configs[loop].base
        kind = self.layout.instances[self.listed_items[loop]].kind
        places = {base + i for i, row in enumerate(kind.table.rows) if row.name in MODE_KEYS}
        return {slot for target, sources in self.wires_of(loop) if target in places for slot in sources}

    def output_limits(self, loop: int, signals: Sequence[float]) -> tuple[float, float]:
        """MinMV and MaxMV; of ControlON_OFF off and on."""
        if self.is_on_off(loop):
            return 0.0, 1.0
        base = self.configs[loop].base
        return signals[base + terms.MIN_MV], signals[base + terms.MAX_MV]

    def is_on_off(self, loop: int) -> bool:
        """Whether the loop is a ControlON_OFF."""
        return bool(self.configs[loop].kind == terms.ON_OFF)

    def integrates(self, loop: int, signals: Sequence[float]) -> bool:
        """Whether Ti_Ki is given; a time below 0.001 s is none."""
        if self.is_on_off(loop):
            return False
        base = self.configs[loop].base
        ti_ki = signals[base + terms.TI_KI]
        return bool(ti_ki > 0.0 if signals[base + terms.INDEP] else ti_ki >= MIN_TI)

    def dead_band(self, loop: int, signals: Sequence[float]) -> float:
        """DeadBand."""
        return 0.0 if self.is_on_off(loop) else signals[self.configs[loop].base + terms.DEAD_BAND]

    def pulse_cycle(self, loop: int) -> float:
        """The period of a ControlPWM that reads the loop's MV."""
        for block, config in enumerate(self.configs):
            reads = any(self.configs[loop].out_slot in sources for _, sources in self.wires_of(block))
            if config.kind == terms.PWM and reads:
                return float(self.signal_values[config.base + PWM["Period"]] * config.period / TICKS)
        return 0.0

    def program_errors(self, signals: Sequence[float]) -> Iterator[str]:
        """Blocks whose output Error was on at some time; loops have ErrBits."""
        for block, i in enumerate(self.listed_items):
            if self.states[block].has_erred:
                now = "is" if signals[self.configs[block].error_slot] else "was"
                yield f"{self.layout.instances[i].name}.Error {now} on"

    def windup_input(self, loop: int, signals: Sequence[float]) -> bool:
        """Windup_H_IN or Windup_L_IN."""
        base = self.configs[loop].base
        return not self.is_on_off(loop) and bool(signals[base + terms.WINDUP_H_IN] or signals[base + terms.WINDUP_L_IN])

    def is_deselected(self, loop: int, signals: Sequence[float], own: Collection[int], rivals: Collection[int]) -> bool:
        """Whether a selector behind its MV takes a rival; where there is no selector, whether OVERR is on."""
        has_selector = False
        for block, config in enumerate(self.configs):
            wired = dict(self.wires_of(block)) if config.kind in SELECTORS else {}
            inputs = [set(wired.get(config.base + value, ())) for value, _ in SELECTOR_INPUTS]
            for (_, out), lost, taken in zip(SELECTOR_INPUTS, inputs, reversed(inputs), strict=True):
                has_selector = has_selector or bool(lost & set(own))
                if signals[config.base + out] and lost & set(own) and taken & set(rivals):
                    return True
        return not has_selector and bool(self.states[loop].status & terms.OVERRIDDEN)


# --- The virtual NextoPID program: built from its parameters, operated as by its operator -----------------------------

OPERATOR_INPUTS = ("SP", "ManualMV", "Manual", "CASC")
"""Inputs of a loop that are the operator's: a wire to one is his switch, or his panel."""
TIME_PARAMETERS = ("Tc", "Tlag", "DelayTime")
"""Parameters of blocks that are times for something to settle."""


class Nextopid(Facts):
    """A NextoPID program as loaded."""

    setpoint = SHORT_FORMS["setpoint"]
    out_name = "MV"
    modes: Mapping[str, int] = MODE_BITS
    commands: Mapping[str, Sequence[str]] = {"ramp_soak": (), "autotune": ("start", "cancel", "accept"), "plc": ()}
    tuned_names = ("Kp", "Ti_Ki", "Td_Kd")
    flag_bits: Mapping[str, int] = FLAG_BITS
    aux_bits: Mapping[str, int] = AUX_BITS
    reasons: Mapping[int, str] = REASONS

    def __init__(self, image: Program, options: NoOptions | None = None) -> None:
        super().__init__(image)
        self.keys = {item.name: self._keys(item.name, item.type) for item in self.items}
        self.initial_modes = [self._initial_mode(loop) for loop in self.loops]
        self.scales = [self._scale(loop) for loop in self.loops]
        self.signals = self._signal_names()
        self.wired_loops = frozenset(loop for loop in self.loops if f"{loop}.PV" not in self.outside_inputs)
        """Loops whose PV comes from the program itself."""
        self.inputs = self._find_inputs()
        self.longest_time = self._find_longest_time()
        self.pv_inputs = {loop: name for loop in self.wired_loops if (name := self._find_pv_input(f"{loop}.PV"))}

    def _wire_texts(self, name: str) -> dict[str, str]:
        prefix = f"{name}."
        return {
            key.removeprefix(prefix): content.text
            for key, content in self.words.items()
            if key.startswith(prefix) and isinstance(content, Wire)
        }

    def _keys(self, name: str, kind: str) -> NamedKeys:
        return keys_of(kind, name, self._wire_texts(name), independent=bool(self._value(name, "Indep")))

    def _slot(self, loop: str, row: str) -> int:
        return self.layout.numbers[f"{loop}.{row}"]

    def _value(self, loop: str, row: str) -> float:
        """A parameter before the first cycle, with the first values of what it is wired to."""
        number = self.layout.numbers.get(f"{loop}.{row}")
        place = next(at for at, i in enumerate(self.listed_items) if self.items[i].name == loop)
        return 0.0 if number is None else self.wired_value(place, number, self.signal_values)

    def _initial_mode(self, loop: str) -> str:
        if self._value(loop, "Manual"):
            return "manual"
        return "cascade" if self._value(loop, "CASC") else "auto"

    def _scale(self, loop: str) -> tuple[float, float, int]:
        low, high = self._value(loop, "MinPV"), self._value(loop, "MaxPV")
        return low, high if high > low else low + 1.0, COUNTS_PER_RANGE

    def _signal_names(self) -> list[str]:
        """Signals of the report: those from outside, what loops and blocks give, and what wires read."""
        shown_numbers = set(range(len(self.layout.signals)))
        for instance in self.layout.instances:
            for i, row in enumerate(instance.kind.table.rows):
                if instance.name in self.loops:
                    wanted = row.name in SIGNAL_PARAMETERS or (
                        row.access == "output" and instance.base + i in self.read_signals
                    )
                else:
                    wanted = row.access == "output" and row.name not in {"Error", "SampleTime", "Warning"}
                if wanted and "Bits." not in row.name:
                    shown_numbers.add(instance.base + i)
        name_of = {number: name for name, number in self.layout.numbers.items() if number in shown_numbers}
        name_of |= {self.configs[i].sp_slot: f"{loop}.SP" for i, loop in enumerate(self.loops)}
        return [name_of.get(number, "") for number in range(len(self.signal_values))]

    def _find_inputs(self) -> dict[str, int]:
        """Signals from outside, and parameters of blocks that nothing is wired to."""
        inputs = {name: self.layout.numbers[name] for name in self.layout.signals}
        for item in self.items:
            if item.loop is None:
                for row in BLOCK_TYPES[item.type].inputs:
                    name = f"{item.name}.{row.name}"
                    if not isinstance(self.words.get(name), Wire):
                        inputs[name] = self.outside_inputs.get(name, self.layout.numbers[name])
        return inputs

    def _find_pv_input(self, name: str) -> str | None:
        """Where a measurement comes into the program: followed back through wires and filters; None: nowhere alone."""
        for _ in range(2 * len(self.items) + 1):
            content = self.words.get(name)
            if name in self.inputs and not isinstance(content, Wire):
                return name
            if not isinstance(content, Wire) or content.text not in self.layout.numbers:
                return None
            name = content.text.replace(".OutVar", ".InVar")
        return None

    def _find_longest_time(self) -> float:
        """Time constants and delays of all blocks, as they stand before the first cycle."""
        names = (f"{item.name}.{row}" for item in self.items for row in TIME_PARAMETERS if item.loop is None)
        slots = (self.layout.numbers[name] for name in names if name in self.layout.numbers)
        return max([0.0, *(self.signal_values[slot] for slot in slots)])

    def faults(self) -> Iterator[tuple[int, str, str]]:
        """Wires that had no value."""
        name_of = {number: name for name, number in self.layout.numbers.items()}
        for state in self.states:
            if state.fault:
                yield state.fault_at, name_of[state.fault_target], FAULTS[state.fault]

    # --- what the runner reads ---------------------------------------------------------------------------------------

    @property
    def output_raises_pv(self) -> list[bool]:
        """Reverse action at the start: the PV rises with MV."""
        return [not self._value(loop, "Direct") for loop in self.loops]

    @property
    def periods(self) -> list[int]:
        """The sample time of each loop, in ticks; no event changes it."""
        return [config.period for config in self.configs[: len(self.loops)]]

    @classmethod
    def mode(cls, status: int) -> str:
        """The mode that a status word tells; before the first call it is auto."""
        return next((name for name, bit in MODE_BITS.items() if status & bit), "auto")

    @classmethod
    def is_about_mode(cls, requested_mode: int, reason: int) -> bool:
        """Whether a mode was requested."""
        return requested_mode != 0

    # --- signals and parameters --------------------------------------------------------------------------------------

    def check_input(self, name: str, value: object) -> float:
        """The value of a signal, or of a block's parameter, as `inputs` takes it."""
        owner, _, row = name.partition(".")
        if row:
            parameter = self.keys[owner].find((row,))
            return number_of(parameter.type, self.keys[owner].parse(parameter, value))
        signal = Parameter(name, self.layout.signals[name])
        return number_of(signal.type, NamedKeys({name: signal}, {}).parse(signal, value))

    def set_output(self, loop: int, value: Quantity, signals: MutableSequence[float]) -> str | None:
        """The MV that a loop in manual mode starts with; returns why it has no effect in the others."""
        return self.set(loop, ("output",), self.check_set(loop, ("output",), value), signals)

    def check_set(self, loop: int, path: tuple[str, ...], value: object) -> object:
        """The content of a parameter; a ``PydanticCustomError`` says what is wrong."""
        keys = self.keys[self.loops[loop]]
        content = keys.check(path, value)
        is_time = keys.find(path).name in TIMES_OR_GAINS and parse_duration(value).unit is not None
        return Seconds(content) if is_time else content

    def new_period(self, loop: int, path: tuple[str, ...], value: Any) -> int:
        """No parameter is a sample time."""
        return 0

    def set(self, loop: int, path: tuple[str, ...], value: Any, signals: MutableSequence[float]) -> str | None:
        """Writes a parameter; returns why it has no effect yet, if so."""
        name, config = self.loops[loop], self.configs[loop]
        row = self.keys[name].find(path)
        content: Content = value
        if isinstance(value, Seconds) and self._parameter_value(loop, "Indep", signals):
            return f"is not written: a time, but Indep is TRUE now, and {row.name} a gain"
        signals[self._slot(name, row.name)] = number_of(row.type, content)
        if row.name == "SP" and not self._parameter_value(loop, "CASC", signals):
            low, high, _ = self.scales[loop]
            signals[config.sp_slot] = min(max(signals[self._slot(name, "SP")], low), high)
        if row.name == "SP" and self._parameter_value(loop, "CASC", signals):
            return "the loop is in cascade mode and follows SP_CASC"
        if row.name == "ManualMV" and not self._parameter_value(loop, "Manual", signals):
            return "the loop is not in manual mode"
        return None

    def unwire_operator_inputs(self, image: Program) -> Program:
        """The program with the operator's inputs unwired, each at the first value of its wire."""
        names = {f"{loop}.{row}" for loop in self.loops for row in OPERATOR_INPUTS}
        cells = (self._unwire(cell) if cell.address in names else cell for cell in image.cells)
        return replace(image, cells=tuple(cells))

    def _unwire(self, cell: Entry) -> Entry:
        if not isinstance(cell.raw, Wire):
            return cell
        loop, _, row = cell.address.partition(".")
        value = self._value(loop, row)
        return cell._replace(raw=value if cell.type.kind == "real" else int(value))

    def _parameter_value(self, loop: int, row: str, signals: Sequence[float]) -> float:
        number = self.layout.numbers.get(f"{self.loops[loop]}.{row}")
        return 0.0 if number is None else signals[number]

    # --- the operator ------------------------------------------------------------------------------------------------

    def request(self, loop: int, mode: str) -> None:
        """Manual and CASC are written (D690), unless the program wires them."""
        name, state, code = self.loops[loop], self.states[loop], self.request_code(mode)
        wired = self._wire_texts(name)
        if mode == "cascade" and f"{name}.CASC" not in self.layout.numbers:
            leave_notice(state, NO_CASCADE, code)
        elif "Manual" in wired:
            leave_notice(state, IS_WIRED, code)
        elif mode in {"auto", "cascade"} and "CASC" in wired:
            leave_notice(state, CASC_IS_WIRED, code)
        elif mode in {"tracking", "autotune"}:
            leave_notice(state, COMES_ABOUT, code)
        else:
            write_switch(state, MANUAL, on=mode == "manual")
            if mode != "manual" and f"{name}.CASC" in self.layout.numbers:
                write_switch(state, CASCADE, on=mode == "cascade")

    def autotune(self, loop: int, command: str) -> None:
        """``start`` and ``cancel`` write AutoTune; ``accept`` copies the results over the gains and resets it."""
        name, state = self.loops[loop], self.states[loop]
        if f"{name}.AutoTune" not in self.layout.numbers:
            leave_notice(state, NO_TUNE)
        elif "AutoTune" in self._wire_texts(name):
            leave_notice(state, TUNE_IS_WIRED)
        elif command == "accept" and state.tune_phase != equation.DONE:
            leave_notice(state, NOTHING_TO_ACCEPT)
        else:
            state.command |= ACCEPT if command == "accept" else 0
            write_switch(state, TUNE, on=command == "start")

    def tuning_result(self, loop: int) -> TuneReport | None:
        """How the last auto-tuning of a loop went; None where there was none."""
        state = self.states[loop]
        if state.tune_outcome == NO_RUN:
            return None
        ended = state.tune_outcome in {DONE, FAILED}
        flags = [name for i, name in enumerate(RESULT_FLAGS) if state.result_flags >> i & 1 and ended]
        status = ", ".join(flags) or TUNE_STATUS[state.tune_outcome]
        results = [shortest_single(result) for result in (state.result_kp, state.result_ti, state.result_td)]
        return self.tune_report(status, results if any(results) else [], done=ended, error=state.tune_outcome == FAILED)


load = Nextopid
