"""Random EZLogix configurations and registers for property tests."""

from __future__ import annotations

from decimal import Decimal

from hypothesis import strategies as st

from pidcfg.encoders.codecs import Scale
from pidcfg.encoders.maps.ezlogix import BLOCKS, SPACE, counts_format
from pidcfg.encoders.regmap import BIT
from pidcfg.schemas.base import Quantity
from pidcfg.schemas.ezlogix import EzlogixFile


def part(**keys: st.SearchStrategy) -> st.SearchStrategy:
    """A section whose keys may be missing."""
    return st.fixed_dictionaries({}, optional=keys)


def tenths(low: str, high: str, places: int = 1) -> st.SearchStrategy:
    """Numbers that a register of so many decimals holds exactly."""
    return st.decimals(low, high, places=places)


@st.composite
def ranges(draw):
    """A range, or none."""
    if draw(st.booleans()):
        return None
    low = draw(st.decimals(-500, 500, places=1))
    return low, low + draw(st.decimals("0.5", 2000, places=1))


@st.composite
def positions(draw, scale: Scale):
    """A value on a scale: raw counts, or an engineering value inside the range."""
    if scale.range is None or draw(st.booleans()):
        return Quantity(Decimal(draw(st.integers(scale.zero_counts, scale.top_counts))), counts=True)
    return Quantity(scale.range[0] + draw(st.decimals(0, 1, places=4)) * scale.width)


@st.composite
def distances(draw, scale: Scale):
    """A difference on a scale."""
    if scale.range is None or draw(st.booleans()):
        return Quantity(Decimal(draw(st.integers(0, scale.top_counts - scale.zero_counts))), counts=True)
    return Quantity(draw(st.decimals(0, "0.5", places=4)) * scale.width)


@st.composite
def loops(draw, index: int):
    """One loop with every key that the schema knows, given or left out."""
    root = draw(st.booleans())
    counts = draw(st.none() | st.sampled_from([(0, 4095), (0, 32767), (0, 65535)] + ([] if root else [(819, 4095)])))
    pv_range, out_range = draw(ranges()), draw(ranges())
    sp = Scale(counts_format(*(counts or (0, 4095))), pv_range, has_root=root)
    cv = Scale(counts_format(0, 4095), out_range)
    pulse = st.fixed_dictionaries(
        {"tag": st.just("O1"), "cycle_time": tenths("0.1", "6553.5")},
        optional={"min_on": tenths("0", "6553.5"), "min_off": tenths("0", "6553.5")},
    )
    data = {
        "name": f"L{index}",
        "registers": 1 + 32 * index,
        "discretes": 1 + 8 * index,
        "mode": draw(st.sampled_from(["manual", "auto"])),
        "action": draw(st.sampled_from(["direct", "reverse"])),
        "algorithm": draw(st.sampled_from(["position", "velocity"])),
        "sample_rate": draw(tenths("0.05", "99.99", 2)),
        "tuning": {
            "proportional_gain": draw(tenths("0", "99.99", 2)),
            "integral_time": draw(st.just("off") | tenths("0", "6000")),
            "derivative_time": draw(st.just("off") | tenths("0", "600")),
        },
        "pv": {
            "tag": draw(st.sampled_from(["IR1", "R1000"])),
            "range": pv_range,
            "counts": counts,
            "square_root": root,
            **draw(part(unit=st.just("degC"))),
        },
        "setpoint": draw(part(value=positions(sp), limits=st.tuples(positions(sp), positions(sp)))),
        "output": {
            "tag": draw(st.sampled_from(["OR1", "R1001"])),
            "range": out_range,
            **draw(
                part(
                    unit=st.just("%"), limits=st.tuples(positions(cv), positions(cv)), offset=positions(cv), pulse=pulse
                )
            ),
        },
        "deadband": draw(distances(sp)),
        "anti_windup": draw(st.booleans()),
        "autotune": draw(part(type=st.sampled_from(["PID", "PI"]), timeout=st.integers(0, 65535))),
    }
    for key in ("pv", "output"):
        data[key] = {k: v for k, v in data[key].items() if v is not None}
    return data


@st.composite
def configurations(draw) -> EzlogixFile:
    """A configuration whose every value fits its register."""
    entries = [draw(loops(i)) for i in range(draw(st.integers(1, 3)))]
    plc = draw(part(process_when_stopped=st.booleans(), tag_names=st.just("{name}_{variable}")))
    return EzlogixFile.model_validate({"pidcfg": 1, "vendor": "ezlogix", "plc": plc, "loops": entries})


@st.composite
def registers(draw) -> dict[int, int]:
    """All registers of a loop at R1 and S1 with anything that they can hold."""
    found = {}
    for prefix, table in BLOCKS.values():
        for row in table.words:
            address = SPACE.number_of(prefix, 1 + row.offset)
            found[address] = draw(st.integers(0, 1 if SPACE.kind_of(address) is BIT else 0xFFFF))
    return found


EVERYTHING = {
    "description": "An oven",
    "tuning": {"proportional_gain": 2.5, "integral_time": 30, "derivative_time": 4},
    "pv": {"tag": "IR1", "range": [0, 200], "unit": "degC", "counts": [0, 4095], "square_root": True},
    "setpoint": {"value": 50, "limits": [10, 90]},
    "output": {
        "tag": "OR1",
        "range": [0, 50],
        "unit": "Hz",
        "limits": [5, 45],
        "offset": 10,
        "pulse": {"tag": "O1", "cycle_time": 10, "min_on": 0.5, "min_off": 0.7},
    },
    "deadband": 6.25,
    "anti_windup": False,
    "autotune": {"type": "PI", "timeout": 900},
}
"""Every key of a loop beside those that it must have, none at its default: a conversion has to speak of each."""
