"""Structured Text that pidcfg wrote, run by an interpreter that is not pidcfg, beside the virtual PLC.

`record` runs a scenario on the engine and keeps, of every base step, what was written from outside (measurements,
signals, what the operator did) and what all values were behind it. `replay` gives the same to the program as text. The
blocks of the library are the engine's own, called by the declared name, type and order of their parameters: what is
compared are wiring, order, types and constants.
"""

from __future__ import annotations

import re
from decimal import Decimal
from functools import cache, partial
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import NamedTuple
from xml.etree import ElementTree as ET

from dpide_rig import program_of
from iec.machine import Block, Machine, Parameter, RunError, Surroundings
from iec.syntax import KEYWORDS, NAME, NUMBER, SIGN, StError, tokens_of
from pidcfg.api import encode
from pidcfg.encoders.dpide.files import make_instructions
from pidcfg.encoders.dpide.image import encode as encode_dpide
from pidcfg.encoders.maps.dpide import ROWS
from pidcfg.encoders.maps.nextopid import BLOCK_TYPES, MAX_DELAY_SAMPLES
from pidcfg.encoders.nextopid.image import encode as encode_nextopid
from pidcfg.encoders.nextopid.st_write import Unit
from pidcfg.schemas.dpide import DpideFile
from pidcfg.schemas.iec import AUTOTUNE_MODE
from pidcfg.schemas.nextopid import NextopidFile
from pidcfg.schemas.scenario import Scenario
from pidcfg.sim.controllers.dpide import scan as dpide
from pidcfg.sim.controllers.kernels import round_half_even, single
from pidcfg.sim.controllers.nextopid import scan as nextopid
from pidcfg.sim.controllers.nextopid import terms
from pidcfg.sim.controllers.nextopid.plc import write_commands
from pidcfg.sim.controllers.plc import TICKS
from pidcfg.sim.engine.run import Settings, simulate
from pidcfg.text.source import read_document

EXAMPLES = Path(__file__).parents[1] / "examples"
DIGIT = 2.0**-23
"""The last digit of single precision, of a number around 1."""
IN_OUT = ("PID_MODE", "Kc_Kp", "Ti_Ki", "Td_Kd", "Tf", "MOUT")
"""Operands that the instruction may write."""


class Step(NamedTuple):
    """A base step: what came from outside, by the name in the text, and what there was after it."""

    tick: int
    writes: list
    values: dict


class Record(NamedTuple):
    """A run, the text of its program, and what the text is run with."""

    text: str
    initial: dict
    """What there is before the first one."""
    steps: list
    machine: object
    """Makes the machine of a text: `(machine, its programs in their order, cells by name, clock)`."""


def example(vendor, name, samples=None):
    """The record of an example; ``samples``: its scenario in so many base steps, from a cold start."""
    return (_record_nextopid if vendor == "nextopid" else _record_dpide)(vendor, name, samples)


def _read(path):
    return read_document(path.read_bytes(), path.name).data


def _scenario(vendor, name, samples, step):
    """The scenario; compressed, its events keep their order and their share of the time."""
    scenario = Scenario.model_validate(_read(EXAMPLES / vendor / f"{name}.scenario.yaml"))
    scenario = scenario.model_copy(update={"expect": []})
    if samples is None:
        return scenario
    duration = Decimal(samples * (int(scenario.step * TICKS) if scenario.step else step)) / TICKS
    share = duration / scenario.duration
    events = [event.model_copy(update={"at": event.at * share}) for event in scenario.events]
    return scenario.model_copy(update={"duration": duration, "events": events, "initial": {}})


def _run(scenario, new_plc, module, scan):
    controller = SimpleNamespace(**{**vars(module), "scan": scan})
    simulate(scenario, new_plc, controller, Settings(engine="python", with_verdicts=False, with_reference=False))


# --- NextoPID ---------------------------------------------------------------------------------------------------------


def to_engine(kind, value):
    """A value of the text as the engine has it."""
    return single(value / 1000) if kind == "TIME" else float(value)


def of_engine(kind, value):
    """A value of the engine as the text has it."""
    if kind == "BOOL":
        return value != 0.0
    if kind == "TIME":
        return round(value * 1000)
    return single(value) if kind == "REAL" else int(value)


def _record_nextopid(vendor, name, samples):
    path = EXAMPLES / vendor / f"{name}.yaml"
    image = encode_nextopid(NextopidFile.model_validate(_read(path))).image
    unit = Unit(image)
    plcs, steps, last = [], [], {}

    def new_plc():
        plc = nextopid.load(image)
        plcs.append(plc)
        return plc

    plc = new_plc()
    names = _names_in_text(unit)
    outside = {slot: key for key, slot in plc.outside_inputs.items()}
    names_of = {slot: outside.get(slot) or names.get(slot) for slot in range(len(plc.signal_values))}

    def scan(tick, configs, states, aux, signals):
        own = next(plc for plc in plcs if plc.configs is configs)
        if last.get("plc") is not own:
            last.update(plc=own, values=list(new_plc().signal_values))
            steps.clear()
        for config, state in zip(configs, states, strict=True):
            if state.command:
                write_commands(config, state, signals)
        before = last["values"]
        writes = [(key, signals[i]) for i, key in names_of.items() if key and signals[i] != before[i]]
        nextopid.scan(tick, configs, states, aux, signals)
        last["values"] = list(signals[: len(before)])
        steps.append(Step(tick, writes, {names[i]: signals[i] for i in names}))

    periods = {plc.items[i].name: plc.configs[place].period for place, i in enumerate(plc.listed_items)}
    scenario = _scenario(vendor, name, samples, min(periods.values(), default=plc.task_ticks))
    _run(scenario, new_plc, nextopid, scan)
    initial = {key: plc.signal_values[i] for i, key in names.items()}
    return Record(
        encode(path, "st").text, initial, steps, lambda text: _nextopid_machine(text, unit.program, names, periods)
    )


def _names_in_text(unit):
    """What each value is called in the text, by its number; inputs of functions that nothing reads are not there."""
    found = {}
    for number, name in unit.names.items():
        owner = unit.layout.owner_of(number)
        if owner is not None and unit.layout.instances[owner].kind.function and "." in name:
            continue
        found[number] = name
    return found


def _nextopid_machine(text, program, names, periods):
    clock = SimpleNamespace(tick=0, periods={})
    memory = {}
    blocks = {kind.name: _nextopid_block(kind, clock, memory) for kind in BLOCK_TYPES.values()}
    machine = Machine(text, Surroundings(blocks, {AUTOTUNE_MODE.name: AUTOTUNE_MODE.words}))
    scope = machine.programs[program.upper()]
    for name, instance in scope.instances.items():
        period = next((ticks for key, ticks in periods.items() if key.upper() == name), 1)
        clock.periods[id(instance.cells)] = period
    cells = {}
    for name in names.values():
        first, _, rest = name.upper().partition(".")
        cells[name] = scope.instances[first].cells[rest] if rest else scope.cells[first]
    return machine, [program], cells, clock


def _nextopid_block(kind, clock, memory):
    rows = kind.table.rows

    def run(cells):
        key = id(cells)
        if kind.function or key not in memory:
            memory[key] = _new_block(kind, clock.periods.get(key, 1)), cells, clock.tick
        (config, state, aux), _, called = memory[key]
        if clock.tick > called:
            config.sample_time = single((clock.tick - called) / TICKS)
        memory[key] = (config, state, aux), cells, clock.tick
        signals = [to_engine(row.type.name, cells[row.name.upper()].value) for row in rows] + [0.0]
        nextopid.call_block(config, state, aux, signals)
        for row, value in zip(rows, signals, strict=False):
            if row.access == "output":
                cells[row.name.upper()].value = of_engine(row.type.name, value)

    parameters = tuple(Parameter(row.name, row.type.name, row.access, of_engine(row.type.name, 0.0)) for row in rows)
    return Block(kind.name, parameters, run, kind.function)


def _new_block(kind, period):
    config, state = terms.Config(), terms.State()
    config.kind, config.sample_time = terms.KINDS[kind.name], single(period / TICKS)
    config.is_integer, config.sp_slot = int(kind.name.endswith("INT")), len(kind.table.rows)
    return config, state, [0.0] * MAX_DELAY_SAMPLES


# --- DPIDE ------------------------------------------------------------------------------------------------------------


class Watched(dpide.Dpide):
    """A Delta AS that tells what is written to its operands from outside."""

    def __init__(self, *args):
        self.told = []
        super().__init__(*args)

    def _write(self, i, **values):
        self.told.append((i, values))
        super()._write(i, **values)


def _record_dpide(vendor, name, samples):
    path = EXAMPLES / vendor / f"{name}.yaml"
    image = encode_dpide(DpideFile.model_validate(_read(path))).image
    loops = [*make_instructions(image)]
    interrupt = image.plc.get("interrupt_task")
    plcs, steps, last = [], [], {}

    def new_plc():
        plc = Watched(image, dpide.Options())
        plcs.append(plc)
        return plc

    def scan(tick, configs, states, aux, signals):
        own = next(plc for plc in plcs if plc.configs is configs)
        if last.get("plc") is not own:
            last.update(plc=own)
            steps.clear()
        writes = [(loop.symbols["PV"].name, signals[c.in_slot]) for loop, c in zip(loops, configs, strict=True)]
        for i, values in own.told:
            symbols = {key: loops[i].symbols[key].name for key in values if loops[i].is_symbol(key)}
            assert all(values[key] == loops[i].cells[key].raw for key in values if key not in symbols)
            writes += [(name, values[key]) for key, name in symbols.items()]
        own.told.clear()
        dpide.scan(tick, configs, states, aux, signals)
        steps.append(Step(tick, writes, _values(loops, own)))

    constants = {loop.name: {row for row in ROWS if not loop.is_symbol(row)} for loop in loops}
    scenario = _scenario(vendor, name, samples, min(new_plc().periods))
    events = [event for event in scenario.events if not _is_constant(event, constants)]
    _run(scenario.model_copy(update={"events": events}), new_plc, dpide, scan)
    initial = {key: value for key, value in _values(loops, new_plc()).items() if "." not in key}
    return Record(encode(path, "st").text, initial, steps, lambda text: _dpide_machine(text, interrupt, loops))


def _is_constant(event, constants):
    """Whether an event writes what is a number in the text, and has no device."""
    fixed = constants.get(event.loop, ())
    return bool(event.mode and "PID_MAN" in fixed) or any(key in fixed for key in event.set or {})


def _values(loops, plc):
    """Symbols; operands as the instruction has them, ``OVEN.SV``; the width that goes to an output, ``Y0.0``."""
    found = {}
    for i, loop in enumerate(loops):
        held = plc.memory(i)
        found |= {loop.symbols[key].name: held[key] for key in ROWS if loop.is_symbol(key) and key != "PV"}
        found |= {f"{loop.name}.{key}": single(held[key]) for key in ROWS if key != "PV"}
        if loop.call.GPWM is not None:
            found[f"{loop.call.GPWM.output}.{loop.call.GPWM.cycle}"] = round_half_even(single(held["MV"]))
    return found


DEVICE = re.compile(r"(X|Y|M|S|SM|D)\d+(\.\d+)?")


def _device(name):
    return "BOOL" if (match := DEVICE.fullmatch(name)) and (match[1] != "D" or match[2]) else ""


def _direction(row):
    if row.name in {"MV", "I_MV"}:
        return "output" if row.name == "MV" else "in_out"
    return "operand" if row.name in IN_OUT else "input"


def _dpide_machine(text, interrupt, loops):
    clock = SimpleNamespace(tick=0)
    memory, pulses = {}, {}
    plc_settings = {"interrupt_task": interrupt} if interrupt else {}

    def instruction(cells):
        place = cells["I_MV"]
        operands = {key: cells[key.upper()].value for key in ROWS if key not in {"PV", "MV", "I_MV"}}
        if place not in memory:
            plc = dpide.load(program_of(operands, plc=plc_settings), dpide.Options())
            memory[place] = plc, list(plc.signal_values), operands, {}
        plc, signals, before, _ = memory[place]
        changed = {key: value for key, value in operands.items() if value != before[key]}
        if changed:
            plc._write(0, **changed)
        signals[plc.configs[0].in_slot] = cells["PV"].value
        dpide.scan(clock.tick, plc.configs, plc.states, plc.aux, signals)
        held = plc.memory(0)
        for key in (*IN_OUT, "I_MV", "MV"):
            cells[key.upper()].value = held[key]
        memory[place] = plc, signals, {key: held[key] for key in operands}, cells

    def gpwm(cells):
        pulses[cells["OUT"]] = cells["CYCLE"].value, cells["WIDTH"].value

    rows = tuple(Parameter(row.name, row.type.name, _direction(row)) for row in ROWS.values())
    pulse_rows = (
        Parameter("EN", "BOOL", "input"),
        Parameter("WIDTH", "INT", "input"),
        Parameter("CYCLE", "INT", "input"),
    )
    blocks = (
        Block("DPIDE", rows, instruction, function=True),
        Block("GPWM", (*pulse_rows, Parameter("OUT", "BOOL", "in_out")), gpwm, function=True),
        Block("EI", (), lambda _: None, function=True),
    )
    machine = Machine(text, Surroundings({block.name: block for block in blocks}, {}, _device))
    machine.device("SM400").value = True
    scope = machine.programs["PIDLOOPS"]

    def operand(place, key):
        return memory[place][3][key.upper()].value if place in memory else float("nan")

    def width(output, cycle):
        found = pulses.get(machine.places.get(output))
        return found[1] if found and found[0] == cycle else float("nan")

    cells = {}
    for loop in loops:
        symbols = {key: loop.symbols[key].name for key in ROWS if loop.is_symbol(key)}
        cells |= {name: scope.cells[name.upper()] for name in symbols.values()}
        place = cells[symbols["I_MV"]]
        cells |= {f"{loop.name}.{key}": Asked(partial(operand, place, key)) for key in ROWS}
        if pulse := loop.call.GPWM:
            cells[f"{pulse.output}.{pulse.cycle}"] = Asked(partial(width, pulse.output, pulse.cycle))
    return machine, [name for name in ("MAIN", "PIDLOOPS") if name in machine.programs], cells, clock


class Asked:
    """What stands in no variable of the text."""

    type = "REAL"

    def __init__(self, ask):
        self.ask = ask

    @property
    def value(self):
        """Now."""
        return self.ask()


# --- The same to the text ---------------------------------------------------------------------------------------------


def differs(found, wanted):
    """Whether two values are further apart than a digit of single precision; infinite ones and NaN are not equal."""
    return found != wanted and not abs(found - wanted) <= DIGIT * max(abs(found), abs(wanted))


def replay(record, text=None):
    """The first difference, or why the text cannot run: (base step, what, found, wanted); None: all is the same."""
    try:
        machine, programs, cells, clock = record.machine(record.text if text is None else text)
    except (StError, RunError, KeyError) as error:
        return -1, repr(error), None, None
    pairs = [(name, cells[name]) for name in record.steps[0].values]
    for name, wanted in record.initial.items():
        if differs(to_engine(cells[name].type, cells[name].value), wanted):
            return -1, f"{name} at first", cells[name].value, wanted
    try:
        for at, step in enumerate(record.steps):
            clock.tick = step.tick
            for name, value in step.writes:
                cell = cells[name]
                cell.value = of_engine(cell.type, value)
            for program in programs:
                machine.run(program)
            for name, cell in pairs:
                if differs(to_engine(cell.type, cell.value), step.values[name]):
                    return at, name, cell.value, step.values[name]
    except RunError as error:
        return at, repr(error), None, None
    return None


# --- PLCopen XML: the declarations of a document as text, and its body ------------------------------------------------

SPACE = "{http://www.plcopen.org/xml/tc6_0201}"
XHTML = "{http://www.w3.org/1999/xhtml}"


def text_of_plcopen(document):
    """The program of a PLCopen document as Structured Text."""
    pou = ET.fromstring(document).find(f".//{SPACE}pou")  # noqa: S314 - it is our own
    lines = [f"PROGRAM {pou.get('name')}", "VAR"]
    for variable in pou.iterfind(f".//{SPACE}localVars/{SPACE}variable"):
        kind = variable.find(f"{SPACE}type")[0]
        initial = variable.find(f"{SPACE}initialValue")
        value = "" if initial is None else f" := {_initial(initial[0])}"
        lines.append(f"{variable.get('name')} : {kind.get('name') or kind.tag.removeprefix(SPACE)}{value};")
    body = pou.find(f"{SPACE}body/{SPACE}ST/{XHTML}xhtml").text
    return "\n".join([*lines, "END_VAR", body, "END_PROGRAM", ""])


def _initial(element):
    if element.tag == f"{SPACE}simpleValue":
        return element.get("value")
    members = ", ".join(f"{member.get('member')} := {_initial(member[0])}" for member in element)
    return f"({members})"


# --- Spoils: a statement that is wrong in one way ---------------------------------------------------------------------

OTHER = {
    "AND": "OR",
    "OR": "AND",
    "<": ">",
    ">": "<",
    "+": "-",
    "-": "+",
    "*": "/",
    "/": "*",
    "TRUE": "FALSE",
    "FALSE": "TRUE",
}


@cache
def spoils(text):
    """All spoils of a text: what was done, and the text with it."""
    tokens = tokens_of(text)
    body = next(i for i in reversed(range(len(tokens))) if tokens[i].upper == "END_VAR") + 1
    found = [
        *_constants(text, tokens),
        *_wires(text, tokens, body),
        *_swaps(text, tokens),
        *_orders(text, tokens, body),
    ]
    return [(what, spoiled) for what, spoiled in found if spoiled != text]


def _with(text, *changes):
    for at, until, new in sorted(changes, reverse=True):
        text = text[:at] + new + text[until:]
    return text


def _constants(text, tokens):
    for token in tokens:
        if token.kind == NUMBER:
            whole = "." not in token.text
            new = str(int(token.text) + 1) if whole else repr(float(token.text) * 1.1 + 0.25)
            yield f"constant, line {token.line}: {token.text} is {new}", _with(text, (token.at, token.until, new))
        elif token.upper in OTHER and token.kind in {NAME, SIGN}:
            new = OTHER[token.upper]
            yield f"sign, line {token.line}: {token.text} is {new}", _with(text, (token.at, token.until, new))


def _paths(tokens, body):
    """Variables that are read or written in statements, as (from, until)."""
    i = body
    while i < len(tokens):
        first = i
        if tokens[i].kind == NAME:
            while tokens[i + 1].text == ".":
                i += 2
            before, after = tokens[first - 1].text, tokens[i + 1].text
            named = after in {":=", "=>"} and before in {"(", ","}
            if (
                not named
                and after != "("
                and tokens[first].upper not in KEYWORDS
                and tokens[first - 1].upper != "PROGRAM"
            ):
                yield tokens[first].at, tokens[i].until
        i += 1


def _wires(text, tokens, body):
    places = [*_paths(tokens, body)]
    names = sorted({text[at:until] for at, until in places})
    for at, until in places:
        for name in names:
            if name != text[at:until]:
                line = text.count("\n", 0, at) + 1
                yield f"wire, line {line}: {text[at:until]} is {name}", _with(text, (at, until, name))


def _swaps(text, tokens):
    """Two neighbours of a call or of an initial value that have each other's names."""
    names = [
        i
        for i in range(1, len(tokens) - 1)
        if tokens[i].kind == NAME and tokens[i - 1].text in {"(", ","} and tokens[i + 1].text in {":=", "=>"}
    ]
    for first, second in pairwise(names):
        one, two = tokens[first], tokens[second]
        values = text[tokens[first + 1].until : tokens[second - 1].at], text[tokens[second + 1].until :]
        if not values[1].lstrip().startswith(values[0].strip()):
            changes = (one.at, one.until, two.text), (two.at, two.until, one.text)
            yield f"names, line {one.line}: {one.text} and {two.text} exchanged", _with(text, *changes)


def _orders(text, tokens, body):
    """Two statements after each other that are exchanged, or one that is missing."""
    instances = {tokens[i].upper for i in range(body) if tokens[i + 1].text == ":"}
    spans, depth, first = [], 0, None
    for i in range(body, len(tokens)):
        token = tokens[i]
        if token.upper in {"PROGRAM", "END_PROGRAM"}:
            first = None
            continue
        first = i if first is None else first
        depth += (token.upper == "IF") - (token.upper == "END_IF")
        if token.text == ";" and not depth:
            spans.append((tokens[first].at, token.until, *_uses(tokens[first : i + 1], instances)))
            first = None
    for at, until, _, _ in spans:
        yield f"statement, line {text.count(chr(10), 0, at) + 1}: is missing", _with(text, (at, until, ""))
    for (a, b, one, changed), (c, d, two, altered) in pairwise(spans):
        if _meet(changed, two) or _meet(altered, one):
            line = text.count("\n", 0, a) + 1
            yield f"order, line {line}: stands behind the next one", _with(text, (a, b, text[c:d]), (c, d, text[a:b]))


def _uses(tokens, instances):
    """The variables of a statement, and those of them that it changes; an instance stands for all its members."""
    words = re.findall(r"\w+(?: \. \w+)*|\S+", " ".join(token.upper for token in tokens))
    changed = {words[0]} & instances
    for i, word in enumerate(words[1:], 1):
        if word == ":=" and (i < 2 or words[i - 2] in {";", "THEN", "ELSE"}):
            changed.add(words[i - 1])
        elif word == "=>":
            changed.add(words[i + 1])
    return set(words), changed


def _meet(changed, used):
    return any(word == name or word.startswith(f"{name} .") for name in changed for word in used)
