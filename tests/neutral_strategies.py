"""Random neutral loops for property tests: what any controller may have."""

from __future__ import annotations

from functools import cache

from hypothesis import strategies as st
from pydantic import BaseModel

from pidcfg.schemas.generic import GenericFile

EVERYTHING = {
    "name": "L1",
    "description": "A loop",
    "mode": "manual",
    "output_raises_pv": True,
    "sample_time": 1,
    "tuning": {
        "gain": 0.5,
        "integral_time": 30,
        "derivative_time": 4,
        "proportional": False,
        "derivative_on": "error",
        "derivative_filter": 0.5,
    },
    "pv": {"range": [0, 200], "unit": "degC", "filter": 2, "square_root": True},
    "setpoint": {"value": 50, "limits": [10, 90], "source": "L0", "follows_pv": True},
    "output": {
        "range": [0, 50],
        "unit": "Hz",
        "limits": [5, 45],
        "bias": 10,
        "manual": 20,
        "max_rate": 3,
        "pulse": {"period": 10, "min_on": 1, "min_off": 2},
    },
    "deadband": 1,
    "anti_windup": False,
    "alarms": {
        "pv": {"low_low": 10, "low": 20, "high": 150, "high_high": 190},
        "deviation": {"high": 5, "high_high": 9},
        "rate_of_change": 2,
        "hysteresis": 1,
    },
}
"""Every field of the neutral loop, none of them at its default."""


def leaves(model: BaseModel, prefix: str = "") -> set[str]:
    """Every field of a model that holds a value."""
    found = set()
    for key, value in dict(model).items():
        found |= leaves(value, f"{prefix}{key}.") if isinstance(value, BaseModel) else {f"{prefix}{key}"}
    return found


def unheard(file: GenericFile, puts: list) -> set[str]:
    """The fields of the last neutral loop of which an adapter says nothing."""
    spoken = {put.neutral for put in puts if put.neutral}
    return {
        path for path in leaves(file.loops[-1]) if not any(of == path or of.startswith(f"{path}.") for of in spoken)
    }


def part(**keys: st.SearchStrategy) -> st.SearchStrategy:
    """A section whose keys may be missing."""
    return st.fixed_dictionaries({}, optional=keys)


@cache
@st.composite
def within(draw, low: float, high: float) -> float:
    """A value between two ends, with few digits."""
    return round(low + (high - low) * draw(st.integers(0, 100)) / 100, 6)


@cache
@st.composite
def pairs(draw, low: float, high: float) -> tuple[float, float]:
    """Two ascending values between two ends."""
    first, second = sorted(draw(st.lists(st.integers(0, 100), min_size=2, max_size=2, unique=True)))
    return tuple(round(low + (high - low) * share / 100, 6) for share in (first, second))


@st.composite
def alarms(draw, low: float, high: float):
    """Points in order, each of which may be missing."""
    shares = sorted(draw(st.lists(st.integers(1, 99), min_size=4, max_size=4, unique=True)))
    names = draw(st.sets(st.sampled_from(["low_low", "low", "high", "high_high"])))
    points = dict(zip(("low_low", "low", "high", "high_high"), shares, strict=True))
    width = high - low
    return {
        "pv": {name: round(low + width * points[name] / 100, 6) for name in names},
        "deviation": draw(deviations(width)),
        **draw(changes(width)),
    }


@cache
def deviations(width: float) -> st.SearchStrategy:
    """Distances from the set point, each of which may be missing."""
    return part(high=within(0.03 * width, 0.1 * width), high_high=within(0.2 * width, 0.3 * width))


@cache
def changes(width: float) -> st.SearchStrategy:
    """What else alarms may have."""
    return part(rate_of_change=within(0.01 * width, width), hysteresis=within(0, 0.02 * width))


PVS = part(unit=st.just("degC"), filter=st.decimals(0, 10, places=1), square_root=st.booleans())


@cache
def set_points(low: float, high: float) -> st.SearchStrategy:
    """What a set point may have."""
    return part(value=within(low, high), limits=pairs(low, high), follows_pv=st.booleans())


@cache
def outputs(low: float, high: float) -> st.SearchStrategy:
    """What an output may have beside its range."""
    return part(
        unit=st.just("%"),
        limits=pairs(low, high),
        bias=within(low, high),
        manual=within(low, high),
        max_rate=st.integers(1, 50),
        pulse=st.fixed_dictionaries({"period": st.integers(2, 600)}, optional={"min_on": st.integers(0, 1)}),
    )


@st.composite
def neutral_loops(draw, index: int):
    """One loop whose gains and times any controller can hold."""
    low, high = draw(st.sampled_from([(0, 100), (-50, 150), (0, 400), (20, 21), (-328, 1562)]))
    out_low, out_high = draw(st.sampled_from([(0, 100), (4, 20), (-10, 10), (0, 3000)]))
    share = (out_high - out_low) / (high - low)
    tuning = {
        "gain": round(share * draw(st.integers(10, 4000)) / 100, 9),
        "integral_time": draw(st.just(0) | st.integers(1, 5000)),
        "derivative_time": draw(st.just(0) | st.integers(1, 50)),
        "proportional": draw(st.booleans()),
        "derivative_on": draw(st.sampled_from(["pv", "error"])),
        "derivative_filter": draw(st.just(0) | st.decimals("0.1", 5, places=1)),
    }
    return {
        "name": f"L{index}",
        "mode": draw(st.sampled_from(["manual", "auto"])),
        "output_raises_pv": draw(st.booleans()),
        "sample_time": draw(st.decimals("0.1", 20, places=1)),
        "tuning": tuning,
        "pv": {"range": (low, high), **draw(PVS)},
        "setpoint": draw(set_points(low, high)),
        "output": {"range": (out_low, out_high), **draw(outputs(out_low, out_high))},
        "deadband": draw(within(0, 0.02 * (high - low))),
        "anti_windup": draw(st.booleans()),
        "alarms": draw(alarms(low, high)),
    }


@st.composite
def neutral_files(draw) -> GenericFile:
    """Up to three loops, of which a later one may take its set point from an earlier one."""
    loops = [draw(neutral_loops(i)) for i in range(draw(st.integers(1, 3)))]
    for i, loop in enumerate(loops[1:]):
        if draw(st.booleans()):
            loop["setpoint"]["source"] = f"L{i}"
    return GenericFile.model_validate({"pidcfg": 1, "vendor": "generic", "loops": loops})
