"""Random NextoPID configurations for property tests: all blocks, and wires of all kinds between them."""

from __future__ import annotations

from hypothesis import strategies as st

from pidcfg.encoders.maps.nextopid import BLOCK_TYPES, LOOP_TYPES
from pidcfg.encoders.nextopid.encode import encode
from pidcfg.schemas.iec import BOOL
from pidcfg.schemas.nextopid import NextopidFile

OTHER_BLOCKS = sorted(set(BLOCK_TYPES) - LOOP_TYPES)
TEXTS = st.text(st.characters(codec="utf-8", exclude_categories=("Cc", "Cs")), min_size=1, max_size=12)
"""Names and descriptions, with all that could end a comment."""
NAMES = st.from_regex(r"[A-Za-z](_?[A-Za-z0-9]){0,5}", fullmatch=True)


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


def expressions(names: list[str]) -> st.SearchStrategy:
    """Texts that the grammar takes, over these names."""
    leaves = number("0", "100").map(str) | st.sampled_from(["2", "0.5", "1e-7", "3E6", ".25", "7."])
    leaves = st.sampled_from(names) | leaves if names else leaves
    return st.recursive(leaves, joined, max_leaves=6).filter(lambda text: len(text) < 300)


def wires(names: list[str]) -> st.SearchStrategy:
    """What may stand in place of a number: a name, or an expression that is not a number."""
    calculated = expressions(names).map(lambda text: text if any(sign in text for sign in "(*/ ") else f"({text})")
    return st.sampled_from(names) | calculated if names else calculated


@st.composite
def items(draw, name: str, kind: str, bools: list[str], numbers: list[str]):
    """One block; ``bools`` and ``numbers`` are what it may be wired to."""
    data = {"name": name, "type": kind}
    for row in BLOCK_TYPES[kind].inputs:
        field = BLOCK_TYPES[kind].model.model_fields.get(row.name)
        if field is None or not (field.is_required() or draw(st.booleans())):
            continue
        wire = "Wire" in str(field.annotation) and draw(st.integers(0, 2)) == 0
        if row.type is BOOL:
            data[row.name] = draw(st.sampled_from(bools)) if wire and bools else draw(st.booleans())
        elif row.type.kind == "whole":
            top = 4 if row.name == "Mode" else 500
            data[row.name] = draw(wires(numbers)) if wire else draw(st.integers(1, top))
        else:
            positive = row.name.startswith(("T", "Max", "Delay", "Dead"))
            data[row.name] = draw(wires(numbers)) if wire else draw(number("0.001" if positive else "-5000"))
    if "TUNE" in kind and draw(st.booleans()):
        data["AutoTuneParam"] = {
            "PercAmpMV": draw(number("0.1", "50")), "PercHystPV": draw(number("0.01", "1")),
            "PercMaxPeakPV": draw(number("0.1", "50")), "NumCycles": draw(st.integers(1, 10)),
            "Mode": draw(st.sampled_from(["P", "PI", "PID"])),
        }  # fmt: skip
    return data | ({"description": draw(TEXTS)} if draw(st.booleans()) else {})


@st.composite
def beside(draw):
    """What a loop has that is no parameter."""
    data = {"sample_time": draw(st.sampled_from(["100 ms", 0.2, "1 s", "90 s"]))} if draw(st.booleans()) else {}
    if draw(st.booleans()):
        data["pv"] = {"unit": draw(TEXTS)}
    if draw(st.booleans()):
        low = draw(number())
        data["output"] = {"range": (low, low + draw(number("0.5", "9000"))), "unit": draw(TEXTS)}
    return data


def _wireable(names: dict[str, str]) -> tuple[list[str], list[str]]:
    """Names of BOOLs and of numbers that wires may read: signals, and all parameters of the blocks."""
    rows = [(f"{name}.{row.name}", row.type) for name, kind in names.items() for row in BLOCK_TYPES[kind].table.rows]
    bools = [full for full, kind in rows if kind is BOOL]
    return bools, [full for full, kind in rows if kind.kind in {"real", "whole"}]


@st.composite
def candidates(draw):
    """A configuration, in which a wire may read an input of its own block that is wired itself."""
    count = draw(st.integers(1, 6))
    words = draw(st.lists(NAMES, min_size=count + 3, max_size=count + 3, unique_by=str.upper))
    names = [f"{word}_{i}" for i, word in enumerate(words)]
    signals = {name: draw(st.booleans() | number()) for name in names[count:]}
    kinds = {}
    for i, name in enumerate(names[:count]):
        kinds[name] = draw(st.sampled_from(OTHER_BLOCKS if i % 2 else sorted(LOOP_TYPES)))
    bools, numbers = _wireable(kinds)
    bools += [name for name, value in signals.items() if isinstance(value, bool)]
    numbers += [name for name, value in signals.items() if not isinstance(value, bool)]
    blocks, loops = [], []
    for name, kind in kinds.items():
        item = draw(items(name, kind, bools, numbers))
        if kind in LOOP_TYPES:
            loops.append(item | draw(beside()))
        else:
            blocks.append(item)
    plc = {"sample_time": "100 ms"} | ({"program": draw(st.just("Line_1"))} if draw(st.booleans()) else {})
    data = {"pidcfg": 1, "vendor": "nextopid", "plc": plc, "signals": signals, "blocks": blocks, "loops": loops}
    return data | ({"name": draw(TEXTS)} if draw(st.booleans()) else {})


def configurations() -> st.SearchStrategy:
    """A configuration whose every value fits and whose every wire means something."""
    return candidates().map(NextopidFile.model_validate).filter(lambda config: not encode(config).misfits)
