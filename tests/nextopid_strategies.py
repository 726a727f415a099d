"""Random NextoPID configurations for property tests: all blocks, and wires of all kinds between them."""

from __future__ import annotations

import functools
import re

from hypothesis import strategies as st

from pidcfg.encoders.maps.nextopid import BLOCK_TYPES, LOOP_TYPES
from pidcfg.encoders.nextopid.image import encode
from pidcfg.schemas.iec import BOOL, IecType, parse_signal, signal_type
from pidcfg.schemas.nextopid import NextopidFile

TYPES = (tuple(sorted(LOOP_TYPES)), tuple(sorted(set(BLOCK_TYPES) - LOOP_TYPES)))
TIMES = st.integers(0, 0xFFFFFFFF).map(lambda ms: f"T#{ms}ms")
TEXTS = st.text(st.characters(codec="utf-8", exclude_categories=("Cc", "Cs")), min_size=1, max_size=12)
"""Names and descriptions, with all that could end a comment."""
NAMES = st.from_regex(r"[A-Za-z](_?[A-Za-z0-9]){0,5}", fullmatch=True)


@functools.cache
def number(low: str = "-5000", high: str = "5000", places: int = 4) -> st.SearchStrategy:
    """A number as people write it: most have no exact single-precision form."""
    return st.decimals(low, high, places=places).map(lambda value: value + 0)


def joined(operands: st.SearchStrategy) -> st.SearchStrategy:
    """Expressions one level higher: signs, operators, functions, with and without parentheses."""
    two = st.tuples(operands, st.sampled_from([" + ", "-", "*", " / "]), operands)
    many = st.lists(operands, min_size=2, max_size=4)
    return st.one_of(
        two.map("".join),
        two.map(lambda parts: f"({''.join(parts)})"),
        operands.map(lambda text: f"-({text})"),
        operands.map(lambda text: f"(- {text})"),
        st.tuples(st.sampled_from(["min", "max"]), many).map(lambda part: f"{part[0]}({', '.join(part[1])})"),
        st.tuples(st.sampled_from(["abs", "sqrt"]), operands).map(lambda part: f"{part[0]}({part[1]})"),
    )


SIGNALS = st.booleans() | number() | st.integers(-0x8000, 0x7FFF).map(lambda value: f"INT#{value}") | TIMES
"""First values, with their types."""
PLACE = re.compile(r"\[(\d+)\]")
PLACES = st.integers(0, 999).map(lambda place: f"[{place}]")
"""Where a name will stand, so that the strategy is made once."""
LEAVES = PLACES | number("0", "100").map(str) | st.sampled_from(["2", "0.5", "1e-7", "3E6", ".25", "7."])
EXPRESSIONS = st.recursive(LEAVES, joined, max_leaves=6).map(
    lambda text: text if any(sign in text for sign in "[(*/ ") else f"({text})"
)


def compared(parts) -> str:
    """Two sums that are compared, in parentheses or not."""
    left, sign, right = parts
    return f"{left}{sign}{right}"


COMPARED = st.tuples(EXPRESSIONS, st.sampled_from([" < ", "<=", " > ", ">= ", "=", " <> "]), EXPRESSIONS).map(compared)


def joined_bools(operands: st.SearchStrategy) -> st.SearchStrategy:
    """Conditions one level higher."""
    words = st.sampled_from([" AND ", " OR ", " XOR ", " and ", " = ", " <> "])
    two = st.tuples(operands, words, operands)
    return two.map(lambda p: f"({p[0]}){p[1]}({p[2]})") | operands.map(lambda text: f"NOT ({text})")


TRUTH_PLACE = re.compile(r"\{(\d+)\}")
TRUTHS = st.integers(0, 999).map(lambda place: f"{{{place}}}") | st.sampled_from(("TRUE", "false"))
CONDITIONS = st.recursive(TRUTHS | COMPARED.map(lambda text: f"({text})"), joined_bools, max_leaves=4)


def condition(draw, bools: list[str], numbers: list[str]) -> str:
    """A condition over these names."""
    text = draw(CONDITIONS)
    text = TRUTH_PLACE.sub(lambda place: bools[int(place.group(1)) % len(bools)] if bools else "TRUE", text)
    text = PLACE.sub(lambda place: numbers[int(place.group(1)) % len(numbers)] if numbers else "(1)", text)
    return f"({text})" if text.lower() in {"true", "false"} else text


def expression(draw, names: list[str], form: st.SearchStrategy) -> str:
    """An expression over these names that is no number."""
    text = draw(form)
    return PLACE.sub(lambda place: names[int(place.group(1)) % len(names)] if names else "(1)", text)


def choices(draw, name: str, kind: str) -> dict[str, str]:
    """Which parameters of a block are given, and which of those are wired."""
    found = {}
    for row in BLOCK_TYPES[kind].inputs:
        field = BLOCK_TYPES[kind].model.model_fields.get(row.name)
        chance = draw(st.integers(0, 5))
        if field is not None and (field.is_required() or chance > 1):
            found[row.name] = "wire" if chance > 3 and "Wire" in str(field.annotation) else "value"
    return found


def items(draw, name: str, kind: str, chosen: dict[str, str], wireable: dict[str, IecType]):
    """One block. What it is wired to may be its own, but for inputs that are wired themselves."""
    data = {"name": name, "type": kind}
    names = {full: of for full, of in wireable.items() if chosen.get(full.removeprefix(f"{name}.")) != "wire"}
    bools = [full for full, of in names.items() if of is BOOL]
    numbers = [full for full, of in names.items() if of.kind in {"real", "whole", "time"}]
    for row in BLOCK_TYPES[kind].inputs:
        how = chosen.get(row.name)
        if how is None or (how == "wire" and row.type is BOOL and not bools):
            continue
        if how == "wire":
            form = PLACES if draw(st.booleans()) else EXPRESSIONS
            plain = draw(st.booleans())
            if row.type is BOOL:
                data[row.name] = draw(st.sampled_from(bools)) if plain else condition(draw, bools, numbers)
            else:
                data[row.name] = expression(draw, numbers, form)
        elif row.type is BOOL:
            data[row.name] = draw(st.booleans())
        elif row.type.kind == "whole":
            data[row.name] = draw(st.integers(1, 4 if row.name == "Mode" else 500))
        else:
            positive = row.name.startswith(("T", "Max", "Delay", "Dead"))
            data[row.name] = draw(number("0.001" if positive else "-5000"))
    if "TUNE" in kind and draw(st.booleans()):
        data["AutoTuneParam"] = {
            "PercAmpMV": expression(draw, numbers, EXPRESSIONS) if draw(st.booleans()) else draw(number("0.1", "50")),
            "PercHystPV": draw(number("0.01", "1")),
            "PercMaxPeakPV": draw(number("0.1", "50")),
            "NumCycles": draw(st.integers(1, 10)),
            "Mode": draw(st.sampled_from(("P", "PI", "PID"))),
        }
    return data | ({"description": draw(TEXTS)} if draw(st.booleans()) else {})


@st.composite
def beside(draw):
    """What a loop has that is no parameter."""
    data = {"sample_time": draw(st.sampled_from(("100 ms", 0.2, "1 s", "90 s")))} if draw(st.booleans()) else {}
    if draw(st.booleans()):
        data["pv"] = {"unit": draw(TEXTS)}
    if draw(st.booleans()):
        low = draw(number())
        data["output"] = {"range": (low, low + draw(number("0.5", "9000"))), "unit": draw(TEXTS)}
    return data


@st.composite
def copies(draw, signals: dict, loops: list, wireable: dict[str, IecType]):
    """A move to a signal, or to an input of a loop that is given and not wired."""
    given = [f"{loop['name']}.{key}" for loop in loops for key, value in loop.items() if not isinstance(value, str)]
    targets = [*(name for name in signals if wireable[name].kind != "time"), *(n for n in given if n in wireable)]
    target = draw(st.sampled_from([*targets, *signals]))
    bools = [name for name, kind in wireable.items() if kind is BOOL]
    numbers = [name for name, kind in wireable.items() if kind.kind in {"real", "whole", "time"}]
    if wireable[target] is BOOL:
        value = draw(st.sampled_from((True, False, None)))
        value = condition(draw, bools, numbers) if value is None else value
    elif draw(st.booleans()):
        value = draw(st.integers(-300, 300))
    else:
        value = expression(draw, numbers, EXPRESSIONS)
    move = {"move": value, "to": target}
    if draw(st.booleans()):
        move |= {"when": condition(draw, bools, numbers)}
    return move | ({"at": "start"} if draw(st.booleans()) else {})


@st.composite
def files(draw):
    """The data of a configuration."""
    count = draw(st.integers(1, 6))
    words = draw(st.lists(NAMES, min_size=count + 3, max_size=count + 3))
    names = [f"{word}_{i}" for i, word in enumerate(words)]
    signals = {name: draw(SIGNALS) for name in names[count:]}
    kinds = {name: draw(st.sampled_from(TYPES[i % 2])) for i, name in enumerate(names[:count])}
    wireable = {name: signal_type(parse_signal(value)) for name, value in signals.items()}
    for name, kind in kinds.items():
        wireable |= {f"{name}.{row.name}": row.type for row in BLOCK_TYPES[kind].table.rows}
    blocks, loops = [], []
    for name, kind in kinds.items():
        item = items(draw, name, kind, choices(draw, name, kind), wireable)
        if kind in LOOP_TYPES:
            loops.append(item | draw(beside()))
        else:
            blocks.append(item)
    moves = draw(st.lists(copies(signals, loops, wireable), max_size=4))
    plc = {"sample_time": "100 ms"} | ({"program": "Line_1"} if draw(st.booleans()) else {})
    data = {"pidcfg": 1, "vendor": "nextopid", "plc": plc, "signals": signals, "blocks": blocks, "loops": loops}
    data |= {"moves": moves} if moves else {}
    return data | ({"name": draw(TEXTS)} if draw(st.booleans()) else {})


def configurations() -> st.SearchStrategy:
    """A configuration whose every value fits and whose every wire means something."""
    return files().map(NextopidFile.model_validate).filter(lambda config: not encode(config).misfits)
