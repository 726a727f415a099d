"""Random Delta AS configurations for property tests."""

from __future__ import annotations

from decimal import Decimal

from hypothesis import strategies as st

from pidcfg.encoders.maps.dpide import ROWS
from pidcfg.schemas.dpide import BLOCK_REGISTERS, DpideFile
from pidcfg.schemas.iec import BOOL, TimeNumber

LARGEST = Decimal("3.4e38")
TEXTS = st.text(st.characters(codec="utf-8", exclude_categories=("Cc", "Cs", "Cn", "Co")), min_size=1, max_size=20)
NAMES = st.from_regex(r"[A-Za-z0-9Ä_](?:[A-Za-z0-9_.\-/#]| [A-Za-z0-9#]){0,12}[A-Za-z0-9#_]", fullmatch=True)


def numbers() -> st.SearchStrategy:
    """What a REAL can hold, also far out; what would round to 0 is left out."""
    usual = st.decimals(-5000, 5000, places=3)
    far = st.decimals(-LARGEST, LARGEST, allow_nan=False, allow_infinity=False).filter(
        lambda d: d == 0 or abs(d) > Decimal("1e-37")
    )
    return usual | far.map(lambda d: Decimal(repr(float(d))))


def times() -> st.SearchStrategy:
    """Bare numbers, and seconds that were written with a unit."""
    return numbers() | st.decimals(0, 6000, places=2).map(lambda d: f"{d} s")


def flags() -> st.SearchStrategy:
    """Devices of flags."""
    return (
        st.integers(0, 8191).map("M{}".format)
        | st.integers(0, 4095).map("SM{}".format)
        | st.integers(0, 2047).map("S{}".format)
        | st.tuples(st.sampled_from("XY"), st.integers(0, 63), st.integers(0, 15)).map(lambda t: "{}{}.{}".format(*t))
        | st.tuples(st.integers(0, 29999), st.integers(0, 15)).map(lambda t: "D{}.{}".format(*t))
    )


def registers() -> st.SearchStrategy:
    """Devices of numbers."""
    return st.integers(0, 29999).map("D{}".format)


def scales() -> st.SearchStrategy:
    """Range and unit, each given or not."""
    ranges = st.tuples(st.integers(-500, 500), st.integers(1, 1000)).map(lambda t: [t[0], t[0] + t[1]])
    return st.fixed_dictionaries({}, optional={"range": ranges, "unit": TEXTS})


def calls() -> st.SearchStrategy:
    """How a program calls the instruction."""
    pulses = st.fixed_dictionaries({"cycle": st.integers(1, 32767), "output": flags()})
    options = {
        "EN": flags(),
        "function_block": st.sampled_from(["AS_DPIDE", "HEATER"]),
        "timer": st.integers(0, 511).map("T{}".format),
        "GPWM": pulses,
    }
    return st.fixed_dictionaries({}, optional=options)


def keys() -> st.SearchStrategy:
    """Every key that the schema knows of a loop, given or left out."""
    switches = {key: st.booleans() for key, row in ROWS.items() if row.type is BOOL}
    reals = {key: numbers() for key in ("PV", "ERR_DBW", "MOUT", "BIAS")}
    devices = {key: flags() if row.type is BOOL else registers() for key, row in ROWS.items() if key != "I_MV"}
    return st.fixed_dictionaries(
        {
            "SV": numbers(),
            "CYCLE": st.integers(-(2**31), 2**31 - 1) | st.just("1.5 s"),
            "Kc_Kp": numbers(),
            "Ti_Ki": times(),
            "Td_Kd": times(),
            "MV_MAX": numbers(),
            "MV_MIN": numbers(),
        },
        optional={
            **switches,
            **reals,
            "Tf": times(),
            "PID_MODE": st.integers(-(2**31), 2**31 - 1),
            "call": calls(),
            "pv": scales(),
            "output": scales(),
            "description": TEXTS,
            "devices": st.fixed_dictionaries({}, optional=devices),
        },
    )


KEYS = keys()
"""Made once: making it anew takes longer than drawing from it."""


@st.composite
def loops(draw, name: str) -> dict:
    """One loop."""
    data = draw(KEYS)
    return {"name": name, "device": f"D{BLOCK_REGISTERS * draw(st.integers(0, 900))}", **data}


@st.composite
def configurations(draw, named: st.SearchStrategy = NAMES) -> DpideFile:
    """A configuration whose every value fits its operand; it need not be a sensible one."""
    names = draw(st.lists(named, min_size=1, max_size=3, unique=True))
    data = {"pidcfg": 1, "vendor": "dpide", "loops": [draw(loops(name)) for name in names]}
    data |= draw(st.fixed_dictionaries({}, optional={"name": TEXTS, "description": TEXTS}))
    data |= draw(st.just({}) | st.integers(1, 10**6).map(lambda n: {"plc": {"interrupt_task": n}}))
    return DpideFile.model_validate(data)


def timed(config: DpideFile) -> int:
    """How many values were written with a unit of time."""
    return sum(isinstance(getattr(loop, key), TimeNumber) for loop in config.loops for key in ("Ti_Ki", "Td_Kd", "Tf"))
