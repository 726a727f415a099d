"""Neutral loops as a NextoPID program: PIDA_REAL blocks with filters and pulses beside them, names, and a task."""

from __future__ import annotations

import re
import unicodedata
from dataclasses import dataclass, field
from decimal import Decimal
from fractions import Fraction
from math import gcd
from typing import TYPE_CHECKING

from pidcfg.conversion.builder import (
    ALARMS,
    ZERO,
    SameField,
    TargetBuilder,
    apply_table,
    file_number,
    product,
    quotient,
    same_fields,
    target_file,
    to_independent,
    unmatched_fields,
)
from pidcfg.conversion.from_nextopid import MV_HELD_NOTE, to_neutral
from pidcfg.conversion.operation import (
    Deadband,
    Filter,
    Manual,
    Master,
    Operation,
    Rate,
    Smoothing,
    VendorSettings,
    Windup,
)
from pidcfg.encoders.codecs import round_to_integer
from pidcfg.encoders.maps.nextopid import BLOCK_TYPES
from pidcfg.encoders.nextopid.image import bumpless_moves, encode
from pidcfg.schemas.iec import KEYWORDS, MAX_IDENTIFIER_LENGTH, Wire
from pidcfg.schemas.nextopid import MAX_SAMPLE_TIME, MIN_INTEGRAL_TIME, Controller, PidaReal, Plc
from pidcfg.schemas.numbers import decimal_text
from pidcfg.text.frozen import frozen
from pidcfg.text.references import Decision

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.conversion import TargetFile
    from pidcfg.conversion.builder import Span, Table
    from pidcfg.encoders.image import Settings
    from pidcfg.encoders.nextopid.image import NextopidEncoding
    from pidcfg.schemas.generic import GenericFile, Loop
    from pidcfg.schemas.nextopid import Loop as SourceLoop
    from pidcfg.schemas.nextopid import NextopidFile
    from pidcfg.text.paths import Data

__all__ = ["HARMLESS_FIELDS", "OWN_SETTINGS", "from_neutral", "operations", "to_neutral"]
"""What a vendor gives; the way to the neutral form has a module of its own."""

HARMLESS_FIELDS = {
    "type": "the neutral form has one kind of PID; field units of an INT block are those of its MinPV and MaxPV",
    "PV": "the process's; what calculates it is reported",
    **dict.fromkeys(("Indep", "DisableP", "CASC", "Manual"), "FALSE, as without it"),
    **dict.fromkeys(("Tfd", "BIAS", "MaxVarMV", "DeadBand"), "0, as without it"),
    "ManualMV": "0, as without it",
    "plc.sample_time": "each loop says its own",
    "plc.program": "the name of the program in this PLC",
    "plc.map": "where this PLC's registers are",
    "sample_time": "it is reported with the task's",
    "SP_CASC": "0 while cascade mode is off and nothing gives it",
    "TRK_VAL": "reported where TRK_IN or OVERR can be on",
    "TRK_IN": "connections of a cascade go with it; others are reported",
    "Windup_H_IN": "connections of a cascade go with it; others are reported",
    "Windup_L_IN": "connections of a cascade go with it; others are reported",
    "OVERR": "reported when it can be on",
    "AutoTune": "reported when it can be on",
    "DerivEr": "of no effect without a derivative",
}
"""Fields that may come without a line in the report, and why."""

# --- NextoPID blocks: MV becomes ManualMV, and comes back without a bump (manual, ManualMV and chapter 16) ------------

OWN_SETTINGS = VendorSettings()
"""Nothing has an address, and nothing else is left out."""


def operations(config: NextopidFile) -> list[Operation]:
    """Of each block (D221, D222, D229); one whose MV is wired or copied into its ManualMV keeps it."""
    encoding, first_loop = encode(config), len(config.blocks)
    return [
        Operation(
            manual=Manual.STAYS if _keeps_output(encoding, first_loop + i, loop) else Manual.JUMPS,
            windup=Windup.PARTIAL,
            deadband=Deadband.HELD,
            follows_output=True,
            keeps_following=True,
            smoothing=Smoothing.EXACT,
            rate=Rate.KEPT_UP,
            filter=Filter.SAMPLED if loop.sample_time in {None, config.plc.sample_time} else Filter.CYCLIC,
            master=Master.FOLLOWS if isinstance(getattr(loop, "TRK_IN", None), Wire) else Master.INTEGRATES,
        )
        for i, loop in enumerate(config.loops)
    ]


def _keeps_output(encoding: NextopidEncoding, i: int, loop: SourceLoop) -> bool:
    wire = loop.ManualMV
    if bumpless_moves(encoding, i).holds_mv is not None:
        return True
    return isinstance(wire, Wire) and wire.text == f"{loop.name}.MV"


# --- Names of the neutral loops as IEC identifiers, none like another but for capital letters -------------------------

FUNCTIONS = "EXP LIMIT LN LOG MUX SEL SIN COS TAN TRUNC MOVE"
"""Functions whose names a program can give away, but should not."""
RESERVED_NAMES = {
    name.casefold() for name in (*BLOCK_TYPES, *KEYWORDS, *FUNCTIONS.split(), Plc.model_fields["program"].default)
}
"""What no instance may be called."""
STRUCTURE_PATTERN = re.compile(r"autotune_(p|pi|pid|param|result|mode)|(pida|on_off)_(error|warning)_bits")
"""Types of the library that are no blocks, in small letters."""
NON_NAME_PATTERN = re.compile(r"[^A-Za-z0-9]+")


class Names:
    """The names of a program, given one after the other."""

    def __init__(self) -> None:
        self.names_in_use = set(RESERVED_NAMES)

    def new_name(self, loop_name: str, ending: str = "") -> str:
        """A name that is still free, as near to the wanted one as can be."""
        ascii_name = unicodedata.normalize("NFKD", loop_name).encode("ascii", "ignore").decode()
        stem = NON_NAME_PATTERN.sub("_", ascii_name).strip("_") or "Loop"
        stem = stem if stem[0].isalpha() else f"L_{stem}"
        name, count = _join_name(stem, ending), 1
        while name.casefold() in self.names_in_use or STRUCTURE_PATTERN.fullmatch(name.casefold()):
            count += 1
            name = _join_name(stem, f"_{count}{ending}")
        self.names_in_use.add(name.casefold())
        return name


def _join_name(stem: str, ending: str) -> str:
    return stem[: MAX_IDENTIFIER_LENGTH - len(ending)].rstrip("_") + ending


# --- The cyclic task of a NextoPID program: the longest interval of which all loops take every n-th cycle -------------

D295 = Decision(
    295,
    "the task's interval is the greatest common step of the loops' sample times, of at least 1 ms",
    "Sample times are rounded to whole milliseconds for it where they are none, and limited to 60 s; a loop runs in "
    "every n-th cycle. An interval that an option gives is taken, and sample times are rounded to its multiples. "
    "Filters and pulses run in every cycle of the task.",
    "A loop's sample time must be a multiple of the task's. 60 s is the longest that the blocks allow.",
)
SHORTEST_SAMPLE, LONGEST_SAMPLE_TIME = Decimal("0.001"), MAX_SAMPLE_TIME
"""Sample times in s."""


@frozen
class Task:
    """The interval in s."""

    interval: Decimal

    def cycles_of(self, time: Decimal) -> int:
        """How many cycles are nearest to a sample time."""
        max_cycles = int(LONGEST_SAMPLE_TIME / self.interval)
        return max(1, min(round_to_integer(quotient(time, self.interval)), max_cycles))

    @staticmethod
    def allows(time: Decimal) -> bool:
        """Whether a sample time is one that the blocks allow."""
        return SHORTEST_SAMPLE <= time <= LONGEST_SAMPLE_TIME


def task_of(times: Sequence[Decimal], interval: Decimal | None) -> Task:
    """The task for these sample times; ``interval``: it is decided."""
    if interval is not None:
        return Task(interval)
    steps = [min(max(time, SHORTEST_SAMPLE), LONGEST_SAMPLE_TIME) for time in times]
    interval_step = common_step(steps)
    if interval_step < SHORTEST_SAMPLE:
        interval_step = common_step(
            [max(Decimal(round_to_integer(step / SHORTEST_SAMPLE)), Decimal(1)) * SHORTEST_SAMPLE for step in steps]
        )
    return Task(interval_step)


def common_step(times: Sequence[Decimal]) -> Decimal:
    """The greatest interval of which all times are multiples; 0.1 s without any."""
    fractions = [Fraction(time) for time in times] or [Fraction(1, 10)]
    step = fractions[0]
    for other in fractions[1:]:
        denominator = step.denominator * other.denominator
        step = Fraction(gcd(step.numerator * other.denominator, other.numerator * step.denominator), denominator)
    return Decimal(step.numerator) / Decimal(step.denominator)


# --- The special connections of the cascades that neutral loops name --------------------------------------------------

SLAVE_OUTPUTS = {"TRK_IN": "TRK_OUT", "Windup_H_IN": "Windup_H_OUT", "Windup_L_IN": "Windup_L_OUT"}
"""What a master reads of its slave."""


def link_cascades(file: GenericFile, builders: Sequence[TargetBuilder]) -> None:
    """Wires every slave to its master, and the master to the first of its slaves."""
    first_slaves: dict[int, str] = {}
    for i, (b, loop) in enumerate(zip(builders, file.loops, strict=True)):
        master = _find_master(file.loops, i, b)
        if loop.mode == "cascade":
            note = "" if master is not None else "no loop gives it a set point: it is in automatic, and holds SP"
            b.put("CASC", master is not None, "mode", note, clamped=master is None)
        if master is not None:
            _wire_slave(b, builders[master], first_slaves.get(master, ""))
            first_slaves.setdefault(master, b.data["name"])


def _find_master(loops: Sequence[Loop], i: int, b: TargetBuilder) -> int | None:
    """The loop whose output is this one's set point; dropped where that cannot be."""
    source, pv = loops[i].setpoint.source, loops[i].pv.range
    if source is None:
        return None
    outer = next((j for j, other in enumerate(loops) if other.name == source and j != i), None)
    if outer is None:
        b.drop("setpoint.source", f"no other loop is called {source}: write the set point in the program")
        return None
    output = loops[outer].output.range
    if output != pv:
        ranges = f"the output of {source} is {_range_text(output)}, this PV {_range_text(pv)}"
        b.drop("setpoint.source", f"{ranges}: wire SP_CASC to its MV with the scale that you mean")
        return None
    return outer


def _wire_slave(b: TargetBuilder, master: TargetBuilder, first_slave: str) -> None:
    slave, name = b.data["name"], master.data["name"]
    note = f"TRK_IN, TRK_VAL and windup inputs of {name} follow {first_slave} only" if first_slave else ""
    b.put("SP_CASC", f"{name}.MV", "setpoint.source", note)
    if first_slave:
        return
    note = f"connections of the cascade with {slave}"
    master.put("TRK_VAL", f"{slave}.PV", None, note)
    for key, output in SLAVE_OUTPUTS.items():
        master.put(key, f"{slave}.{output}", None, note)


def _range_text(span: Span) -> str:
    return f"{decimal_text(span[0])} to {decimal_text(span[1])}"


# --- Neutral loops as a NextoPID program: PIDA_REAL blocks, with filters and pulses beside them -----------------------

D294 = Decision(
    294,
    "without a set point a NextoPID loop gets the one at which its output is least",
    "SP is MinPV where the PV rises with the output, else MaxPV; reported as assumed.",
    "SP must be given. A loop that nobody has given a set point must not open its valve.",
)
LOOP_KEYS = (
    "name",
    "type",
    "description",
    "sample_time",
    *(key for key in PidaReal.model_fields if key not in Controller.model_fields and key != "type"),
    "pv",
    "output",
)
"""In the order of the file."""
PERIOD_LIMITS = (1, 0xFFFF)
"""Cycles of a ControlPWM's period."""
SHORT_PERIOD = 100
"""Steps of a pulse output below which the report says how to get more."""
COMPARE_IN_PROGRAM = "compare PV in the program"
PROGRAM_ADVICE = {
    "pv.square_root": "wire PV to an expression with sqrt",
    "output.pulse.min_on": "drop shorter pulses in the program, behind ControlPWM",
    "output.pulse.min_off": "fill shorter gaps in the program, behind ControlPWM",
    **dict.fromkeys(ALARMS, COMPARE_IN_PROGRAM),
}
"""Neutral fields that the blocks do not have, with what to program instead."""
HOLDS_MV_NOTE = "the output stays on the way to manual, as figure 16-1 has it"
FOLLOWS_PV_NOTE = "a move, as figure 16-1 has it: the set point follows the PV all the time in manual"
WINDUP_NOTE = "the blocks never integrate further into MinMV, MaxMV or MaxVarMV"


@dataclass(slots=True)
class Program:
    """What stands beside the loops."""

    task: Task
    names: Names = field(default_factory=Names)
    signals: Data = field(default_factory=dict)
    blocks: list[Data] = field(default_factory=list)
    moves: list[Data] = field(default_factory=list)

    def add_block(self, block: Data) -> str:
        """Adds a block; returns its path in the file."""
        self.blocks.append(block)
        return f"/blocks.{len(self.blocks) - 1}"


@frozen
class NextopidLoop:
    """A neutral loop, and the program that it goes into."""

    neutral: Loop
    name: str
    """The instance of its block."""
    program: Program

    @property
    def cycles(self) -> int:
        """The loop runs in every n-th cycle of the task."""
        return self.program.task.cycles_of(self.neutral.sample_time)

    @property
    def interval(self) -> Decimal:
        """The loop's interval in s: a multiple of the task's, as near as can be."""
        return product(self.program.task.interval, Decimal(self.cycles))


def from_neutral(
    file: GenericFile,
    options: Settings,
    operations: Sequence[Operation] = (),
) -> TargetFile:
    """A NextoPID file with these loops."""
    program = Program(task_of([loop.sample_time for loop in file.loops], options.get("sample_time")))
    builders = []
    for i, loop in enumerate(file.loops):
        name = program.names.new_name(loop.name)
        b = TargetBuilder(i, {"name": name, "type": "PIDA_REAL"})
        if name != loop.name:
            b.mark("name", "name", "an identifier of IEC 61131-3, unique without regard to capitals", assumed=True)
        builders.append(b)
    for b, loop in zip(builders, file.loops, strict=True):
        apply_table(b, loop, NextopidLoop(loop, b.data["name"], program), FIELDS)
    link_cascades(file, builders)
    for i, (b, loop) in enumerate(zip(builders, file.loops, strict=True)):
        stays = bool(operations) and operations[i].manual is Manual.STAYS
        program.moves += bumpless_moves_of(b, loop, len(program.moves), output_stays=stays)
    for b in builders:
        b.data = {key: b.data[key] for key in LOOP_KEYS if key in b.data}
    plc = {"sample_time": file_number(program.task.interval)}
    target = target_file("nextopid", file, builders, plc=plc, signals=program.signals, blocks=program.blocks)
    target.data |= {"moves": program.moves} if program.moves else {}
    return target


def bumpless_moves_of(b: TargetBuilder, loop: Loop, first_index: int, *, output_stays: bool) -> list[Data]:
    """The moves of figure 16-1: MV into ManualMV in automatic, PV into SP in manual."""
    name, moves = b.data["name"], []
    if output_stays:
        moves.append({"move": f"{name}.MV", "to": f"{name}.ManualMV", "when": f"NOT {name}.Manual"})
        b.mark(f"/moves.{first_index}.move", None, HOLDS_MV_NOTE)
    if loop.setpoint.follows_pv:
        b.mark(f"/moves.{first_index + len(moves)}.move", "setpoint.follows_pv", FOLLOWS_PV_NOTE)
        moves.append({"move": f"{name}.PV", "to": f"{name}.SP", "when": f"{name}.Manual"})
    return moves


def _sample_time(b: TargetBuilder, n: NextopidLoop) -> None:
    sample_time, task = n.neutral.sample_time, n.program.task
    path, note = "/plc.sample_time", ""
    if n.interval != task.interval:
        path, note = "sample_time", f"every {n.cycles} cycles of the task"
        b.data["sample_time"] = file_number(n.interval)
    b.mark(path, "sample_time", note, exact=sample_time, clamped=not task.allows(sample_time))


def _direction(b: TargetBuilder, n: NextopidLoop) -> None:
    b.put("Direct", not n.neutral.output_raises_pv, "output_raises_pv")
    if n.neutral.mode != "cascade":
        b.put("Manual", n.neutral.mode == "manual", "mode")


def _setpoint(b: TargetBuilder, n: NextopidLoop) -> None:
    setpoint, span = n.neutral.setpoint, n.neutral.pv.range
    if setpoint.value is None:
        note = "nothing says the set point: at this one the output is least"
        b.put("SP", span[not n.neutral.output_raises_pv], None, note)
    else:
        b.put("SP", setpoint.value, "setpoint.value")
    if setpoint.limits is None:
        return
    for i, (end, key, sign) in enumerate(zip(setpoint.limits, ("MinPV", "MaxPV"), (1, -1), strict=True)):
        if (end - span[i]) * sign > 0:
            b.drop(f"setpoint.limits.{i}", f"{key} limits the PV too: limit SP in the program")
        else:
            b.mark(key, f"setpoint.limits.{i}", "" if end == span[i] else f"{key} limits the set point")


def _equation(b: TargetBuilder, n: NextopidLoop) -> None:
    """The dependent form; the independent one where an integral time would count as none."""
    tuning = n.neutral.tuning
    gain, integral, derivative, p_acts = tuning.gain, tuning.integral_time, tuning.derivative_time, tuning.proportional
    form_note = ""
    if ZERO < integral < MIN_INTEGRAL_TIME:
        form_note = f"a gain (Indep TRUE): below {MIN_INTEGRAL_TIME} s an integral time counts as none"
        b.data["Indep"] = True
        integral, derivative = to_independent(gain, integral, derivative)
        b.put("Kp", gain if p_acts else 0, "tuning.gain")
        b.mark("Kp", "tuning.proportional")
    else:
        b.put("Kp", gain, "tuning.gain")
        b.put("DisableP", not p_acts, "tuning.proportional")
    b.put("Ti_Ki", integral, "tuning.integral_time", form_note)
    b.put("Td_Kd", derivative, "tuning.derivative_time")
    b.put("DerivEr", tuning.derivative_on == "error", "tuning.derivative_on")


def _pv_filter(b: TargetBuilder, n: NextopidLoop) -> None:
    """A low-pass filter before the loop."""
    time, program = n.neutral.pv.filter, n.program
    if time:
        signal, block = program.names.new_name(n.name, "_IN"), program.names.new_name(n.name, "_FILTER")
        program.signals[signal] = b.data["SP"]
        path = program.add_block({"name": block, "type": "ControlLowFilter", "InVar": signal, "Tc": file_number(time)})
        b.mark(f"{path}.Tc", "pv.filter", f"{block}, a block before PV")
        b.put("PV", f"{block}.OutVar", None, f"{signal} is the PV before its filter: assign it to the analog input")


def _limits(b: TargetBuilder, n: NextopidLoop) -> None:
    low, high = n.neutral.output.limits or n.neutral.output.range
    b.put("MinMV", low, "output.limits.0")
    b.put("MaxMV", high, "output.limits.1")


def _manual(b: TargetBuilder, n: NextopidLoop) -> None:
    output = n.neutral.output
    low, high = output.limits or output.range
    if output.manual is not None:
        b.put("ManualMV", output.manual, "output.manual")
    elif n.neutral.mode == "manual":
        b.put("ManualMV", min(max(ZERO, low), high), None, "nothing says the output in manual")


def _max_rate(b: TargetBuilder, n: NextopidLoop) -> None:
    rate = n.neutral.output.max_rate
    if rate is None:
        return
    step = product(rate, n.interval)
    if step:
        b.put("MaxVarMV", step, "output.max_rate", f"per cycle of {decimal_text(n.interval)} s", exact=step)
    else:
        b.drop("output.max_rate", "MaxVarMV 0 is no limit: put the loop into manual to hold its output")


def _pulses(b: TargetBuilder, n: NextopidLoop) -> None:
    """A ControlPWM behind the loop."""
    pulse, interval = n.neutral.output.pulse, n.program.task.interval
    if pulse is None:
        return
    exact_period = quotient(pulse.period, interval)
    period = min(max(round_to_integer(exact_period), PERIOD_LIMITS[0]), PERIOD_LIMITS[1])
    name = n.program.names.new_name(n.name, "_PWM")
    low, high = (file_number(end) for end in n.neutral.output.range)
    block = {"name": name, "type": "ControlPWM", "MV": f"{n.name}.MV", "MaxMV": high, "MinMV": low, "Period": period}
    path = n.program.add_block(block)
    note = f"{name}, in cycles of the task of {decimal_text(interval)} s"
    if period < SHORT_PERIOD:
        note += f": the output has {period} steps; a shorter interval (--sample-time) gives more"
    clamped = not PERIOD_LIMITS[0] <= round_to_integer(exact_period) <= PERIOD_LIMITS[1]
    b.mark(f"{path}.Period", "output.pulse.period", note, exact=exact_period, clamped=clamped)


def _drop_unmatched(b: TargetBuilder, n: NextopidLoop) -> None:
    if not n.neutral.anti_windup:
        b.mark("anti_windup", "anti_windup", WINDUP_NOTE, assumed=True)
    b.drop_all(unmatched_fields(n.neutral, PROGRAM_ADVICE))


FIELDS: Table[TargetBuilder, NextopidLoop] = (
    SameField("description"),
    _sample_time,
    _direction,
    _setpoint,
    _equation,
    SameField("tuning.derivative_filter", "Tfd", skip_falsy=True),
    SameField("pv.range.0", "MinPV"),
    SameField("pv.range.1", "MaxPV"),
    SameField("pv.unit"),
    _pv_filter,
    _limits,
    *same_fields("output.range", "output.unit"),
    SameField("output.bias", "BIAS", skip_falsy=True),
    _manual,
    _max_rate,
    _pulses,
    SameField("deadband", "DeadBand", skip_falsy=True, note=MV_HELD_NOTE),
    _drop_unmatched,
)
"""Every field in the order of the report."""
