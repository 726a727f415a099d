"""Wires, names and conditions of NextoPID, the two forms of the equation, and what the auto-tuning would do."""

from __future__ import annotations

import re
from decimal import ROUND_HALF_EVEN, Decimal
from itertools import chain, pairwise, product
from math import expm1, prod
from typing import TYPE_CHECKING, Any

from pidcfg.encoders.maps.nextopid import BLOCK_TYPES
from pidcfg.encoders.nextopid.image import WireError
from pidcfg.encoders.nextopid.wiring import D204, D205
from pidcfg.schemas.expressions import (
    COMPARISONS,
    CONDITION_OPERATORS,
    CONSTANT,
    EQUALITIES,
    SIGNAL,
    TRUTH,
    TWO_OPERANDS,
)
from pidcfg.schemas.nextopid import D202
from pidcfg.text.diagnostics import Severity
from pidcfg.text.references import NEXTOPID, Decision
from pidcfg.text.signs import closest_name
from pidcfg.validate.rule import Finding, Findings, error, info, per_pid, warning
from pidcfg.validate.shared_checks import list_names, number_text

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from pidcfg.schemas.expressions import Expression
    from pidcfg.schemas.iec import IecType
    from pidcfg.text.paths import Path
    from pidcfg.validate.rules.nextopid.context import BlockView, NextopidContext

# --- Wires and names: what means nothing, what nobody reads, and names that stand for two things ----------------------

BLOCKS = NEXTOPID.cite("chapter 1: Introduction")
LOOP_TEXT = "the loop"

D209 = Decision(
    209,
    "a name stands for one thing",
    "Capital and small letters are one. The program, its signals and its blocks have names of their own, and none has "
    "that of a type of the library (error) or of a standard function or function block (warning).",
    "It is what IEC 61131-3 says of identifiers; the manual says nothing of names.",
)
D210 = Decision(
    210,
    "a filter, delay or lag that nothing reads is a mistake",
    "An output of ControlLowFilter, ControlDelay, ControlLag, ControlDelayLag and ControlLeadLag that no wire reads is "
    "a warning, a signal that no wire reads an info. MV of loops, selectors and PWM may go to the program around.",
    "They are made to be wired to another block; the valve is connected outside.",
)

STRUCTURES = (
    "PIDA_ERROR_BITS PIDA_WARNING_BITS ON_OFF_ERROR_BITS ON_OFF_WARNING_BITS AUTOTUNE_PARAM AUTOTUNE_RESULT "
    "AUTOTUNE_MODE AUTOTUNE_P AUTOTUNE_PI AUTOTUNE_PID"
)
LIBRARY_NAMES = {name.casefold(): name for name in (*BLOCK_TYPES, *STRUCTURES.split())}
FUNCTIONS = """
    SIN COS TAN ASIN ACOS ATAN EXPT ADD SUB MUL DIV MOVE SHL SHR ROL ROR GT GE EQ LE LT NE LEN LEFT RIGHT MID CONCAT
    EXP LN LOG LIMIT SEL MUX INSERT DELETE REPLACE FIND TRUNC ADR SIZEOF SR RS SEMA R_TRIG F_TRIG CTU CTD CTUD TP TON
    TOF RTC POINTER REFERENCE METHOD THIS SUPER INTERFACE UNION BIT EN ENO PUBLIC PRIVATE PERSISTENT CONTINUE JMP
"""
_REFUSED_WORDS = """
    SEL LIMIT ADR THIS SUPER BIT METHOD INI PROPERTY CONTINUE JMP POINTER REFERENCE INTERFACE UNION
"""
REFUSED_NAMES = frozenset(_REFUSED_WORDS.split())
"""Names that CODESYS does not compile as those of a variable; conversions, INT_TO_REAL, are others."""
STANDARD_NAMES = frozenset(FUNCTIONS.split()) | REFUSED_NAMES
_TYPE_PATTERN = "(BOOL|BYTE|WORD|DWORD|LWORD|U?[SDL]?INT|L?REAL|TIME|DATE|STRING|ANY)"
CONVERSION = re.compile(rf"{_TYPE_PATTERN}_TO_\w+|TO_{_TYPE_PATTERN}")
PASSIVE_BLOCKS = ("ControlLowFilter", "ControlDelay", "ControlLag", "ControlDelayLag", "ControlLeadLag")
"""Blocks whose output is of use only to other blocks."""


@error("NX601", D205, "{key}: {problem}")
def wire_without_meaning(context: NextopidContext) -> Findings:
    """A parameter is wired to something that does not exist, has another type, or cannot be read.

    Why: the program that is written from it would not compile, or the parameter would keep 0. A BOOL takes the name of
    a BOOL, a number an expression of numbers: declared signals, `NAME.Parameter`, + - * / and min, max, abs, sqrt.

    Fix: correct the character that the message points at.
    """
    for path, misfit in context.encoding.misfits:
        error = misfit.error
        if isinstance(error, WireError):
            cure = _cure_of_wire(context, str(misfit.value), error)
            yield Finding(path, {"key": misfit.word.name, "problem": str(error)}, fix=cure, offset=error.offset)


OTHER_NAMES = {"out": "MV", "output": "MV", "co": "MV", "cv": "MV", "sv": "SP", "setpoint": "SP"}
"""What other families call the signals of a block."""


def _cure_of_wire(context: NextopidContext, text: str, error: WireError) -> str:
    """The cure; for ``NAME.Parameter`` the nearest parameter of the block, if there is such a block."""
    if re.match(r"(?:T|TIME)#", text, re.IGNORECASE):
        return "write the seconds, or a number with its unit, as in 40 s"
    word = re.match(r"(\w+)\.(\w[\w.]*)", text[error.offset :])
    kinds = {placed.item.name: placed.kind for placed in context.encoding.items}
    if word is None or word.group(1) not in kinds or word.group() in context.encoding.layout.types:
        return error.cure
    rows = [row.name for row in kinds[word.group(1)].table.rows]
    same = OTHER_NAMES.get(word.group(2).casefold())
    near = same if same in rows else closest_name(word.group(2), rows)
    return f"did you mean '{word.group(1)}.{near}'?" if near else error.cure


@error("NX602", D204, "{names} within the same cycle")
def ring_without_delay(context: NextopidContext) -> Findings:
    """Blocks that answer at once are wired in a ring.

    Why: selectors, split ranges, lead-lags and delays of 0 s pass their input on within the same call. In a ring of
    nothing else the value depends on which of them is called first, and runs away.

    Fix: put a filter, a lag or a delay into the ring, or take one of the wires away.
    """
    for ring in context.encoding.rings:
        names = [context.views[i].name for i in ring]
        several = f"{', '.join(names[:-1])} and {names[-1]} feed each other"
        text = f"{names[0]} feeds itself" if len(names) == 1 else several
        loops = [context.views[i].name for i in ring if context.views[i].placed.is_loop]
        for view in (context.views[i] for i in ring):
            yield view.report("name", names=text).with_other_loops(*(name for name in loops if name != view.name))


@error("NX603", BLOCKS, "{name} is the library's own {taken}")
def name_of_a_library_block(context: NextopidContext) -> Findings:
    """A signal or an instance has the name of one of the library's blocks, functions or structures.

    Why: a declaration such as `ControlPWM : ControlPWM` does not compile, or hides the block from the program.

    Fix: name it after what it does, such as TIC101 or VALVE_PWM.
    """
    for _, name, path in named_items(context):
        if name.casefold() in LIBRARY_NAMES:
            yield Finding(path, {"name": name, "taken": LIBRARY_NAMES[name.casefold()]}, key=path[0] == "signals")


@error("NX604", D209, "the name {name} is also that of {others}{letters}")
def name_used_twice(context: NextopidContext) -> Findings:
    """The program, its signals and its blocks do not all have names of their own.

    Why: the names are variables of one program, where capital and small letters are the same: the second declaration
    does not compile, and a wire could mean either.

    Fix: rename one of them.
    """
    groups: dict[str, list[tuple[str, str, Path]]] = {}
    for row in named_items(context):
        groups.setdefault(row[1].casefold(), []).append(row)
    for rows in groups.values():
        for what, name, path in rows if len(rows) > 1 else ():
            mine = (what, name) if what == LOOP_TEXT else None  # loops of one name have PID106
            others = [row for row in rows if row[2] != path and row[:2] != mine]
            if others:
                same = all(row[1] == name for row in others)
                letters = "" if same else ": capital and small letters are the same"
                values = {"name": name, "others": list_names([" ".join(row[:2]) for row in others]), "letters": letters}
                loops = (row[1] for row in others if row[0] == LOOP_TEXT)
                yield Finding(path, values, key=path[0] == "signals").with_other_loops(*loops)


@info("NX605", D210, "no wire reads the signal {name}")
def unused_signal(context: NextopidContext) -> Findings:
    """A signal is declared, and nothing reads it and no move writes it.

    Why: it has no effect. Often it was meant for a parameter that still holds a number.

    Fix: wire it, or remove it.
    """
    used = _names_read(context) | {move.to for move in context.config.moves}
    for name in context.config.signals:
        if name not in used:
            yield Finding(("signals", name), {"name": name}, key=True)


@warning("NX606", D209, "{name} is also a standard function or function block")
def name_of_a_standard_function(context: NextopidContext) -> Findings:
    """A signal or an instance shadows a standard function or function block.

    Why: within the program the name means the variable, and the standard function cannot be called any more. CODESYS
    does not compile some of them, such as SEL, LIMIT and INT_TO_REAL: those are errors.

    Fix: choose another name.
    """
    for _, name, path in named_items(context):
        refused = name.upper() in REFUSED_NAMES or CONVERSION.fullmatch(name.upper())
        if refused or name.upper() in STANDARD_NAMES:
            severity = Severity.ERROR if refused else None
            yield Finding(path, {"name": name}, key=path[0] == "signals", severity=severity)


@warning("NX607", D210, "nothing reads {name}.OutVar")
def unused_output(context: NextopidContext) -> Findings:
    """A filter, delay or lag works for nobody.

    Why: its output reaches no loop. A PV filter beside the loop filters nothing, and a feed-forward that is not wired
    to BIAS does not act; both look complete.

    Fix: wire the output to the parameter that it was made for, or remove the block.
    """
    read = _names_read(context)
    for view in context.blocks_of_type(*PASSIVE_BLOCKS):
        if f"{view.name}.OutVar" not in read:
            yield view.report("name", name=view.name)


def named_items(context: NextopidContext) -> Iterator[tuple[str, str, Path]]:
    """Everything of the program that has a name: what it is, its name, and where that stands."""
    yield "the program", context.config.plc.program, ("plc", "program")
    for name in context.config.signals:
        yield "the signal", name, ("signals", name)
    for placed in context.encoding.items:
        yield LOOP_TEXT if placed.is_loop else "the block", placed.item.name, (*placed.place, "name")


def _names_read(context: NextopidContext) -> set[str]:
    """The names that wires and moves read, also those that mean nothing."""
    wires = context.encoding.wires.values()
    copies = (copy for copy in context.encoding.copies if copy is not None)
    moved = (part for copy in copies for part in (copy.value, copy.when) if part is not None)
    read = {context.names[number] for number in chain.from_iterable(wire.signals for wire in (*wires, *moved))}
    texts = (str(m.value) for _, m in context.encoding.misfits if isinstance(m.error, WireError))
    return read | set(chain.from_iterable(re.findall(r"\w[\w.]*", text) for text in texts))


# --- Conditions that are always TRUE, or always FALSE -----------------------------------------------------------------
#
# Design. A condition is walked with all values that could make a difference: both of a BOOL, and of a number that is
# compared with literals only one below, at, between and above each of them. A comparison of anything else may come
# out either way, whatever the others do. So a condition that is called constant is constant.

D550 = Decision(
    550,
    "a condition that no value changes is a mistake",
    "One that comes out the same for every value of its signals is a warning; a signal's first value does not count. "
    "Comparisons of anything but a name with a number are taken to come out either way.",
    "PV < 4.0 OR PV > 3.0 looks like two limits and is TRUE; a switch that is meant to be constant is written as one.",
)
COMPARISON_OPS = frozenset((*COMPARISONS.values(), *EQUALITIES.values()))
TRUTH_TEXT = {True: "TRUE", False: "FALSE"}
LEAF_OPS = frozenset((SIGNAL, CONSTANT, TRUTH))
MAX_CASES = 4096
"""Combinations that are tried; a condition of more is not judged."""


@warning("NX686", D550, "{key} is always {value}: {text}")
def constant_condition(context: NextopidContext) -> Findings:
    """A condition comes out the same whatever its signals are.

    Why: it looks as if it switched, and never does: `PV < 4.0 OR PV > 3.0` is TRUE for every PV. Mostly an AND stands
    where an OR was meant, or a limit is on the wrong side.

    Fix: correct the condition; write `true` or `false` where a constant is meant.
    """
    kinds = context.encoding.layout.kinds
    for (i, name), expression in context.encoding.wires.items():
        view = context.views[i]
        if view.placed.kind.table.find_parameter(name).type.kind == "bool":
            value = constant_value(expression, kinds)
            if value is not None:
                yield view.report(name, key=name, value=TRUTH_TEXT[value], text=expression.text)
    for i, copy in enumerate(context.encoding.copies):
        value = None if copy is None or copy.when is None else constant_value(copy.when, kinds)
        if copy is not None and copy.when is not None and value is not None:
            values = {"key": "when", "value": TRUTH_TEXT[value], "text": copy.when.text}
            yield Finding(("moves", i, "when"), values)


def constant_value(expression: Expression, kinds: Mapping[int, IecType]) -> bool | None:
    """The value that a condition has in all cases; None: it has both, or nobody knows."""
    tree = _expression_tree(expression)
    comparisons = [*_comparisons(tree, kinds)]
    points: dict[Node, set[Decimal]] = {}
    for node in filter(_compares_name_with_number, comparisons):
        name, point = sorted(node[1:], key=lambda side: side[0] == CONSTANT)
        points.setdefault(name, set()).add(point[1])
    cases: dict[Node, list[Any]] = {(SIGNAL, n): [False, True] for n in expression.signals if kinds[n].kind == "bool"}
    cases |= {name: _test_values(value, kinds[name[1]]) for name, value in points.items()}
    cases |= {node: [False, True] for node in comparisons if not _compares_name_with_number(node)}
    if prod(len(values) for values in cases.values()) > MAX_CASES:
        return None
    value = {_evaluate(tree, dict(zip(cases, chosen, strict=True))) for chosen in product(*cases.values())}
    return bool(value.pop()) if len(value) == 1 else None


Node = tuple[Any, ...]
"""An operator and its operands; ``SIGNAL`` with its number, ``CONSTANT`` and ``TRUTH`` with their value."""


def _expression_tree(expression: Expression) -> Node:
    stack: list[Node] = []
    for op, operand in zip(expression.code[::2], expression.code[1::2], strict=True):
        if op in (SIGNAL, TRUTH):
            stack.append((op, operand))
        elif op == CONSTANT:
            stack.append((op, Decimal(repr(expression.constants[operand]))))
        elif op in TWO_OPERANDS:
            right = stack.pop()
            stack.append((op, stack.pop(), right))
        else:
            stack.append((op, stack.pop()))
    return stack.pop()


def _comparisons(node: Node, kinds: Mapping[int, IecType]) -> Iterator[Node]:
    """The comparisons of numbers in a condition."""
    if node[0] in LEAF_OPS:
        return
    if node[0] in COMPARISON_OPS and not any(_is_bool(side, kinds) for side in node[1:]):
        yield node
        return
    for side in node[1:]:
        yield from _comparisons(side, kinds)


def _is_bool(node: Node, kinds: Mapping[int, IecType]) -> bool:
    return node[0] in CONDITION_OPERATORS | {TRUTH} or (node[0] == SIGNAL and kinds[node[1]].kind == "bool")


def _compares_name_with_number(node: Node) -> bool:
    """Whether a comparison is one of a name and a number."""
    return {side[0] for side in node[1:]} == {SIGNAL, CONSTANT}


def _test_values(points: set[Decimal], kind: IecType) -> list[Decimal]:
    """Values that make all the difference there is."""
    if kind.kind == "whole":
        near = {point.to_integral_value() + step for point in points for step in (-1, 0, 1)}
        return sorted({min(max(value, Decimal(kind.low)), Decimal(kind.high)) for value in near})
    ends = sorted(points)
    between = {(low + high) / 2 for low, high in pairwise(ends)}
    values = {ends[0] - 1, *ends, *between, ends[-1] + 1}
    return sorted({max(value, Decimal(0)) for value in values} if kind.kind == "time" else values)


def _evaluate(node: Node, case: Mapping[Node, Any]) -> Any:
    """The value of a condition in a case."""
    if node in case:
        return case[node]
    if node[0] in LEAF_OPS:
        return node[1]
    sides = [_evaluate(side, case) for side in node[1:]]
    return TWO_OPERANDS[node[0]](*sides) if len(sides) > 1 else not sides[0]


# --- The two forms of the equation: which terms are on, and values that do not do what they look like -----------------

DISABLE_P = NEXTOPID.cite("chapter 2: DisableP")
INDEP = NEXTOPID.cite("chapter 2: Indep")
BIAS = NEXTOPID.cite("chapter 2: BIAS")
DERIVATIVE = NEXTOPID.cite("chapter 2: DerivEr")
DEAD_BAND = NEXTOPID.cite("chapter 2: DeadBand")


@per_pid
@warning("NX635", DISABLE_P, "neither a proportional nor an integral term is on: {left}")
def no_control_term(view: BlockView) -> Findings:
    """Nothing holds the set point.

    Why: with DisableP and no integral, or with Kp and Ki 0 in the independent form, MV stays at BIAS whatever the error
    is; a derivative moves it only while PV moves.

    Fix: give Ti_Ki, or switch the proportional term on.
    """
    gain = view.number_of("Kp")
    dependent_zero = gain == 0 and view.is_on("Indep") is False  # NX612
    if view.proportional == 0 and view.integral == 0 and not dependent_zero:
        left = "the derivative alone holds no set point" if view.derivative else "MV never moves"
        key = "DisableP" if view.is_on("Indep") is False else "Kp"
        yield view.report(key, left=left)


@per_pid
@info("NX636", DISABLE_P, "DisableP is ignored with Indep TRUE: Kp {gain} acts")
def disable_p_ignored(view: BlockView) -> Findings:
    """DisableP is TRUE, and the gains are independent.

    Why: it acts in the dependent form only; the proportional term that was to be off is on.

    Fix: write `Kp: 0`, which leaves Ki and Kd alone in the independent form.
    """
    if view.is_on("DisableP") and view.is_on("Indep") and view.number_of("Kp"):
        yield view.report("DisableP", gain=view.quote("Kp"))


@error("NX637", D202, "{key} is {time} s, a time, but with Indep TRUE it is the gain {gain}")
def time_as_gain(context: NextopidContext) -> Findings:
    """A gain of the independent form is written with a unit of time.

    Why: with Indep TRUE, Ti_Ki is the integral gain and Td_Kd the derivative gain. An integral time of 60 s read as a
    gain of 60 integrates thousands of times faster.

    Fix: divide Kp by the integral time for Ki, multiply it by the derivative time for Kd; or write `Indep: false`.
    """
    for view in context.pids:
        for key, gain in (("Ti_Ki", "Ki"), ("Td_Kd", "Kd")):
            if context.has_time_as_gain(view, key):
                yield view.report(key, key=key, time=view.quote(key), gain=gain)


@per_pid
@warning("NX638", INDEP, "Indep is wired: Ti_Ki and Td_Kd are times while it is FALSE and gains while it is TRUE")
def form_from_a_wire(view: BlockView) -> Findings:
    """The form of the equation can change while the loop runs.

    Why: the same numbers then mean something else: an integral time of 60 s becomes an integral gain of 60.

    Fix: write `true` or `false`.
    """
    if view.wire("Indep") is not None:
        yield view.report("Indep")


@per_pid
@info("NX639", BIAS, "no integral and BIAS {bias}: an error stays as long as the process needs another MV")
def proportional_without_bias(view: BlockView) -> Findings:
    """A loop without an integral has no offset.

    Why: BIAS is MV at zero error. A heater that has to give 30 % to hold the temperature does so only with the error
    that makes 30 %. Where errors may be large that is what is wanted.

    Fix: give the MV that holds the set point as BIAS, or an integral time.
    """
    if view.proportional and view.integral == 0 and view.number_of("BIAS") == 0:
        yield view.report("Ti_Ki", bias=view.quote("BIAS"))


@per_pid
@info(
    "NX640",
    DERIVATIVE,
    "DerivEr is TRUE: a step of 1 % of the set point moves MV by {percent} % through the derivative",
)
def derivative_of_the_error(view: BlockView) -> Findings:
    """The derivative acts on the error.

    Why: each new set point throws MV, by the derivative gain times the step over the sample time, of which Tfd lets 1 -
    e^(-Ts/Tfd) through in the first cycle. Most applications take the derivative of PV.

    Fix: remove DerivEr, unless the set point moves slowly, as that of a cascade's slave does.
    """
    gain, pv, mv = view.derivative, view.pv_limits, view.mv_limits
    if view.is_on("DerivEr") and gain and pv and mv and view.sample_time > 0:
        smoothing = view.number_of("Tfd") or Decimal(0)
        share = -expm1(-float(view.sample_time / smoothing)) if smoothing > 0 else 1.0
        percent = gain * (pv[1] - pv[0]) / view.sample_time / (mv[1] - mv[0])
        yield view.report("DerivEr", percent=f"{float(percent) * share:.3g}")


@per_pid
@error("NX641", DEAD_BAND, "DeadBand {band} is the whole range of PV, {low} to {high}, or more: MV never moves")
def dead_band_as_wide_as_the_range(view: BlockView) -> Findings:
    """The dead band is so wide that the loop never acts.

    Why: PV and set point are limited to MinPV..MaxPV, so the error cannot be larger than that range. While it is inside
    the dead band, MV stays.

    Fix: give an error that may be left alone, in units of PV.
    """
    band, pv = view.number_of("DeadBand"), view.pv_limits
    if band is not None and pv is not None and band >= pv[1] - pv[0]:
        yield view.report("DeadBand", band=view.quote("DeadBand"), low=view.quote("MinPV"), high=view.quote("MaxPV"))


# --- What the auto-tuning would do ------------------------------------------------------------------------------------

AUTOTUNE_START = NEXTOPID.cite("chapter 4: AutoTune")
PARAMETERS = NEXTOPID.cite("chapter 4: AutoTuneParam")
RESULT = NEXTOPID.cite("chapter 4: MV_TOO_HIGH, MV_TOO_LOW")
MODE = NEXTOPID.cite("chapter 4: Mode")
INT_TUNE_BLOCK = "PIDA_TUNE_INT"

D217 = Decision(
    217,
    "the peaks of an auto-tuning need room",
    "PercMaxPeakPV up to twice PercHystPV is a warning, and so is a step of an INT's MV that is not whole.",
    "PEAK_TOO_LOW is set below twice the hysteresis, PEAK_TOO_HIGH beyond PercMaxPeakPV; an INT has no half steps.",
)


def auto_tuned_loops(context: NextopidContext) -> list[BlockView]:
    """The loops with auto-tuning."""
    return context.blocks_of_type("PIDA_TUNE_REAL", INT_TUNE_BLOCK)


def exact_tune_step(view: BlockView) -> Decimal | None:
    """The step of MV to either side, as PercAmpMV gives it."""
    percent, mv = view.number_of("AutoTuneParam.PercAmpMV"), view.mv_limits
    return None if percent is None or mv is None else percent * (mv[1] - mv[0]) / 100


def tune_step(view: BlockView) -> Decimal | None:
    """The step of MV to either side: an INT controller rounds it, half to even."""
    step = exact_tune_step(view)
    return step if step is None or view.type != INT_TUNE_BLOCK else step.to_integral_value(ROUND_HALF_EVEN)


@error("NX656", PARAMETERS, "AutoTune is {how}, but AutoTuneParam is not given: all of it is 0")
def auto_tuning_without_parameters(context: NextopidContext) -> Findings:
    """The auto-tuning can be started, and has no parameters.

    Why: amplitude, hysteresis, safety limit and cycles are 0 then, which are all out of range: it ends at once with an
    error.

    Fix: give AutoTuneParam, for a start PercAmpMV 5, PercHystPV 0.1, PercMaxPeakPV 10, NumCycles 3.
    """
    for view in auto_tuned_loops(context):
        if view.item.AutoTuneParam is None and view.may_be_on("AutoTune"):
            how = "wired" if view.is_wired("AutoTune") else "TRUE"
            yield view.report("AutoTune", "AutoTuneResult.Bad_PercAmpMV", how=how)


@warning("NX657", AUTOTUNE_START, "AutoTune is {value}: the auto-tuning begins with the first cycle")
def auto_tuning_at_start(context: NextopidContext) -> Findings:
    """The auto-tuning starts with the program.

    Why: a process that has just been started is not steady, and MV is switched up and down before anybody looks.
    While AutoTune is TRUE the controller does not control.

    Fix: write `false`, or wire a command of the operator.
    """
    for view in auto_tuned_loops(context):
        if view.is_on("AutoTune") and view.item.AutoTuneParam is not None:
            yield view.report("AutoTune", value=view.quote("AutoTune"))


@warning("NX658", RESULT, "from ManualMV {start} the auto-tuning would step to {target}{unit}, beyond {limit} {end}")
def auto_tuning_step_beyond_limits(context: NextopidContext) -> Findings:
    """The step of the auto-tuning does not fit between MV and its limit.

    Why: MV is switched between both sides of where it stood. Where one of them is beyond a limit, the auto-tuning ends
    with an error.

    Fix: lower PercAmpMV, or bring ManualMV nearer to the middle.
    """
    for view in auto_tuned_loops(context):
        step, start, mv = tune_step(view), view.number_of("ManualMV"), view.mv_limits
        if step is None or start is None or mv is None or view.is_on("Manual") is not True:
            continue
        start = min(max(start, mv[0]), mv[1])
        for target, limit, bit in ((start - step, "MinMV", "LOW"), (start + step, "MaxMV", "HIGH")):
            if target < mv[0] or target > mv[1]:
                yield view.report(
                    "AutoTuneParam.PercAmpMV",
                    f"AutoTuneResult.MV_TOO_{bit}",
                    start=view.quote("ManualMV"),
                    target=number_text(target),
                    unit=view.unit("MV"),
                    limit=limit,
                    end=view.quote(limit),
                )


@warning(
    "NX659",
    D217,
    "PercMaxPeakPV {peak} % is not above twice PercHystPV {hysteresis} %: the peaks are too low or too high",
)
def auto_tuning_peaks_without_room(context: NextopidContext) -> Findings:
    """The peaks of PV can only be too low or too high.

    Why: below twice the hysteresis the peaks cannot be trusted, and beyond PercMaxPeakPV the auto-tuning is aborted.

    Fix: raise PercMaxPeakPV as far as the process allows, or lower PercHystPV to the noise of PV.
    """
    for view in auto_tuned_loops(context):
        max_peak, min_peak = (view.number_of(f"AutoTuneParam.{key}") for key in ("PercMaxPeakPV", "PercHystPV"))
        if max_peak is not None and min_peak is not None and 0 < max_peak <= 2 * min_peak:
            peak, hysteresis = number_text(max_peak), number_text(min_peak)
            yield view.report(
                "AutoTuneParam.PercMaxPeakPV", "AutoTuneResult.PEAK_TOO_LOW", peak=peak, hysteresis=hysteresis
            )


@warning("NX660", D217, "PercAmpMV {percent} % is a step of {step}, and MV is an INT: {effect}")
def auto_tuning_step_not_whole(context: NextopidContext) -> Findings:
    """The step of the auto-tuning is none that an INT can make.

    Why: MV has whole numbers only. The step is rounded to the nearest one, and a step that rounds to 0 ends the
    auto-tuning with an error.

    Fix: raise PercAmpMV, or give MV a larger scale such as 0 to 30000.
    """
    for view in context.blocks_of_type(INT_TUNE_BLOCK):
        step, rounded = exact_tune_step(view), tune_step(view)
        if step is not None and rounded is not None and step != rounded:
            effect = f"the step is {number_text(rounded)}" if rounded else "the auto-tuning ends with an error"
            yield view.report(
                "AutoTuneParam.PercAmpMV",
                None if rounded else "AutoTuneResult.Bad_PercAmpMV",
                percent=view.quote("AutoTuneParam.PercAmpMV"),
                step=number_text(step),
                effect=effect,
            )


@info("NX661", MODE, "the auto-tuning tunes a {mode} controller, and the loop has {terms}")
def auto_tuning_of_other_terms(context: NextopidContext) -> Findings:
    """The auto-tuning tunes another kind of controller than the loop is.

    Why: a gain that was made for P alone is too high beside an integral; a result for PI says nothing of the
    derivative that stays. Mode is P when it is not given.

    Fix: give the Mode of the loop, or clear the terms that are not tuned.
    """
    for view in auto_tuned_loops(context):
        param = view.item.AutoTuneParam
        if param is not None and view.integral and "I" not in param.Mode:
            terms = "an integral and a derivative" if view.derivative else "an integral"
            yield view.report("AutoTuneParam.Mode", mode=param.Mode, terms=terms)
        elif param is not None and view.derivative and "D" not in param.Mode:
            yield view.report("AutoTuneParam.Mode", mode=param.Mode, terms="a derivative")
