"""Random CLICK configurations and registers for property tests."""

from __future__ import annotations

from hypothesis import strategies as st

from pidcfg.encoders.codecs import single_bits
from pidcfg.encoders.maps.click import BLOCKS, SPACE
from pidcfg.encoders.regmap import BIT
from pidcfg.schemas.click import ClickFile


def maybe(strategy: st.SearchStrategy) -> st.SearchStrategy:
    """Given or left out."""
    return st.none() | strategy


def number(low: str = "-5000", high: str = "5000") -> st.SearchStrategy:
    """A number as people write it, with up to four decimals: most have no exact single-precision form."""
    return st.decimals(low, high, places=4)


FLAGS = st.booleans()


def part(**keys: st.SearchStrategy) -> st.SearchStrategy:
    """A section whose keys may be missing."""
    return st.fixed_dictionaries({}, optional=keys)


SECTIONS = {
    "pv": part(
        unit=st.just("degF"), input_range=st.just((-328, 1562)), filter=st.integers(1, 100), filter_enabled=FLAGS
    ),
    "setpoint": part(
        value=number(),
        lower_limit=number(),
        lower_limit_enabled=FLAGS,
        upper_limit=number(),
        upper_limit_enabled=FLAGS,
    ),
    "output": part(
        limits=st.tuples(number("0", "100"), number("0", "100")),
        unit=st.just("%"),
        pwm=part(period=st.integers(1, 600)).map(lambda p: {"bit": "Y001", **p}),
    ),
    "error": part(curve=st.sampled_from(["linear", "squared"]), deadband=number("0", "50"), deadband_enabled=FLAGS),
    "alarms": part(
        pv=part(low_low=number(), low=number(), high=number(), high_high=number(), enabled=FLAGS),
        deviation=part(high=number(), high_high=number(), enabled=FLAGS),
        rate_of_change=number("0", "50"),
        rate_of_change_enabled=FLAGS,
        hysteresis=number("0", "5"),
    ),
    "autotune": part(
        method=st.sampled_from(["open", "closed"]),
        type=st.sampled_from(["PID", "PI"]),
        hysteresis=number("1", "10"),
    ),
    "state": part(bias=number(), output=number(), raw_pv=number(), pv=number()),
}
"""Made once: making them anew takes longer than drawing from them."""


@st.composite
def loops(draw, index: int):
    """One loop with every key that the schema knows, given or left out."""
    low = draw(number())
    data = {
        "name": f"L{index}",
        "bits": 1 + 40 * index,
        "integers": 1 + 15 * index,
        "floats": 1 + 25 * index,
        "mode": draw(st.sampled_from(["manual", "auto"])),
        "action": draw(st.sampled_from(["direct", "reverse"])),
        "action_verified": draw(st.booleans()),
        "sample_rate": f"{draw(st.integers(100, 30000))} ms",
        "bumpless": draw(st.sampled_from([1, 2])),
        "freeze_bias": draw(st.booleans()),
        "tuning": {
            "proportional_gain": draw(number("0.01", "10000")),
            "reset_time": draw(number("0.01", "6000")),
            "derivative_gain": draw(number("0", "6000")),
        },
        "derivative_gain_limit": draw(maybe(st.integers(0, 100))),
        "derivative_gain_limit_enabled": draw(maybe(FLAGS)),
        "pv": {"range": (low, low + draw(number("0.5", "9000"))), **draw(SECTIONS["pv"])},
        **{name: draw(section) for name, section in SECTIONS.items() if name != "pv"},
    }
    return {key: value for key, value in data.items() if value is not None}


@st.composite
def configurations(draw) -> ClickFile:
    """A configuration whose every value fits its register."""
    entries = [draw(loops(i)) for i in range(draw(st.integers(1, 3)))]
    return ClickFile.model_validate({"pidcfg": 1, "vendor": "click", "loops": entries})


@st.composite
def registers(draw) -> dict[int, int]:
    """All registers of a loop at C1, DS1 and DF1 with anything that the PLC's memory may hold, but for infinities."""
    found = {}
    for prefix, table in BLOCKS.values():
        for row in table.words:
            address = SPACE.number_of(prefix, 1 + row.offset)
            kind = SPACE.kind_of(address)
            if kind.digits == 8:
                value = draw(st.floats(width=32, allow_nan=False, allow_infinity=False))
                found[address] = single_bits(0.0 if value == 0 else value)
            else:
                found[address] = draw(st.integers(0, 1 if kind is BIT else 0xFFFF))
    return found


EVERYTHING = {
    "description": "A tank",
    "action_verified": True,
    "bumpless": 1,
    "tuning": {"proportional_gain": 2.5, "reset_time": 30, "derivative_gain": 4},
    "derivative_gain_limit": 10,
    "derivative_gain_limit_enabled": True,
    "pv": {"range": [0, 200], "input_range": [-100, 500], "unit": "degC", "filter": 80, "filter_enabled": True},
    "setpoint": {
        "value": 50,
        "lower_limit": 10,
        "lower_limit_enabled": True,
        "upper_limit": 90,
        "upper_limit_enabled": True,
    },
    "output": {"limits": [5, 95], "unit": "%", "pwm": {"bit": "Y002", "period": 20}},
    "error": {"curve": "squared", "deadband": 4, "deadband_enabled": True},
    "alarms": {
        "pv": {"low_low": 5, "low": 10, "high": 150, "high_high": 190, "enabled": True},
        "deviation": {"high": 5, "high_high": 10, "enabled": True},
        "rate_of_change": 2,
        "rate_of_change_enabled": True,
        "hysteresis": 1,
    },
    "autotune": {"method": "closed", "type": "PI", "hysteresis": 3},
    "state": {"bias": 20, "output": 30, "raw_pv": 40, "pv": 41},
}
"""Every key of a loop beside those that it must have, none at its default: a conversion has to speak of each."""
