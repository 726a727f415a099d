"""Random DL06 configurations and memory images for property tests."""

from __future__ import annotations

from decimal import Decimal

from hypothesis import strategies as st

from pidcfg.encoders.codecs import Bcd, Distance, Position
from pidcfg.encoders.maps.dl06 import FORMATS, LOOP_TABLE, SpanBcd
from pidcfg.schemas.base import Quantity
from pidcfg.schemas.dl06 import Dl06File

FORMAT_NAMES = sorted(FORMATS)


def decimals(low: str, high: str, places: int) -> st.SearchStrategy[Decimal]:
    """Numbers that a BCD word of so many places holds exactly."""
    return st.decimals(Decimal(low), Decimal(high), places=places)


@st.composite
def quantities(draw, name: str, limits: tuple[Decimal, Decimal] | None, *, span: bool = False, top: int | None = None):
    """A value on a scale: raw counts, or an engineering value inside the range."""
    form = FORMATS[name]
    if limits is None or draw(st.booleans()):
        low = 0 if span else form.minimum
        return Quantity(Decimal(draw(st.integers(low, top or form.maximum))), counts=True)
    share = draw(st.decimals(0, Decimal("0.5") if span else 1, places=4))
    width = limits[1] - limits[0]
    return Quantity(share * width if span else limits[0] + share * width)


@st.composite
def ranges(draw, *, given: bool = False):
    """A range, or none."""
    if not given and draw(st.booleans()):
        return None
    low = draw(st.decimals(-500, 500, places=1))
    return low, low + draw(st.decimals("0.5", 2000, places=1))


def maybe(strategy: st.SearchStrategy) -> st.SearchStrategy:
    """Given or left out."""
    return st.none() | strategy


@st.composite
def ramp_soaks(draw, name: str, limits, index: int):
    """A generator with its table in the upper block, none overlapping another loop's."""
    step = st.fixed_dictionaries(
        {
            "ramp_to": quantities(name, limits),
            "slope": st.decimals("0.01", "99.99", places=2).map(lambda d: Quantity(d, counts=True)),
            "soak": decimals("0.1", "999.9", 1),
            "deviation": maybe(quantities(name, limits, span=True)),
        }
    )
    return {
        "table": 0o12000 + index * 0o40,
        "enabled": draw(st.booleans()),
        "steps": draw(maybe(st.lists(step, max_size=8))),
        "request": draw(st.sampled_from(["none", "start", "hold", "resume", "jog"])),
    }


@st.composite
def loops(draw, index: int, names: list[str], form: str | None = None):
    """One loop with every key that the schema knows, given or left out; ``form``: all in this format, with ranges."""
    name = form or draw(st.sampled_from(FORMAT_NAMES))
    out_name = None if form else draw(maybe(st.sampled_from(FORMAT_NAMES)))
    pv_range, out_range = draw(ranges(given=form is not None)), draw(ranges(given=form is not None))
    root = draw(st.booleans()) and "unipolar" in name
    pv = quantities(name, pv_range)
    # On the square-root scale raw counts end at the root of the span, about 63.
    sp = quantities(name, pv_range, top=63 if root else None)
    span = quantities(name, pv_range, span=True)
    out = quantities(out_name or name, out_range)
    flags = maybe(st.booleans())
    source = st.one_of(
        st.fixed_dictionaries({"slot": st.integers(1, 4), "channel": st.integers(1, 16)}),
        st.fixed_dictionaries({"address": st.integers(0o400, 0o677)}),
    )
    other = [n for n in names if n != names[index]]
    data = {
        "name": names[index],
        "mode": draw(st.sampled_from(["manual", "auto", "cascade"])),
        "cascade_from": draw(maybe(st.sampled_from(other))) if other else None,
        "sample_rate": draw(decimals("0.05", "99.99", 2)),
        "algorithm": draw(st.sampled_from(["position", "velocity"])),
        "action": draw(st.sampled_from(["direct", "reverse"])),
        "bumpless": draw(st.sampled_from(["I", "II"])),
        "bias_freeze": draw(st.booleans()),
        "independent_of_cpu_mode": draw(st.booleans()),
        "tuning": {
            "gain": draw(decimals("0", "99.99", 2)),
            "reset": draw(st.just("off") | decimals("0", "99.99", 1)),
            "reset_unit": draw(st.sampled_from(["seconds", "minutes"])),
            "rate": draw(decimals("0", "99.99", 2)),
        },
        "derivative_gain_limit": draw(maybe(st.integers(0, 20))),
        "derivative_gain_limit_enabled": draw(flags),
        "pv": {
            "range": pv_range,
            "format": name,
            "square_root": root,
            "filter": draw(maybe(decimals("0.1", "1.0", 1))),
            "filter_enabled": draw(flags),
            "transfer": draw(maybe(source)),
        },
        "setpoint": {"value": draw(maybe(sp)), "limits": draw(maybe(st.tuples(sp, sp))), "limits_enabled": draw(flags)},
        "output": {
            "range": out_range,
            "format": out_name,
            "limits": draw(maybe(st.tuples(out, out))),
            "transfer": draw(maybe(source)),
        },
        "error": {
            "curve": draw(st.sampled_from(["linear", "squared"])),
            "deadband": draw(maybe(span)),
            "deadband_enabled": draw(flags),
        },
        "alarms": {
            "pv": draw(
                maybe(
                    st.fixed_dictionaries(
                        {k: maybe(pv) for k in ("low_low", "low", "high", "high_high")} | {"enabled": flags}
                    )
                )
            ),
            "deviation": draw(
                maybe(st.fixed_dictionaries({"yellow": maybe(span), "red": maybe(span), "enabled": flags}))
            ),
            "rate_of_change_enabled": draw(flags),
            "hysteresis": draw(maybe(span)),
        },
        "ramp_soak": draw(maybe(ramp_soaks(name, None if root else pv_range, index))),
        "autotune": {
            "method": draw(st.sampled_from(["open", "closed"])),
            "type": draw(st.sampled_from(["PID", "PI"])),
            "start": draw(st.booleans()),
        },
        "state": {"pv": draw(maybe(pv)), "bias": draw(maybe(out)), "output": draw(maybe(out))},
    }
    return {key: value for key, value in data.items() if value is not None}


@st.composite
def configurations(draw, form: str | None = None) -> Dl06File:
    """A configuration whose every value fits its word."""
    count = draw(st.integers(1, 3))
    names = [f"LOOP-{i + 1}" for i in range(count)]
    return Dl06File.model_validate(
        {
            "pidcfg": 1,
            "vendor": "dl06",
            "plc": {
                "loop_table": draw(st.sampled_from([0o2000, 0o1200, 0o10000])),
                "reset_decimals": draw(st.sampled_from([1, 2])),
            },
            "loops": [draw(loops(i, names, form)) for i in range(count)],
        }
    )


@st.composite
def loop_words(draw) -> list[int]:
    """32 words that a loop table may hold: every word in its format, every bit field with a meaning."""
    image = [0] * LOOP_TABLE.size
    for row in LOOP_TABLE.bits:
        if row.path is not None:
            image[row.offset] |= row.encode(draw(st.sampled_from(list(row.bits_by_value))))
    bits = LOOP_TABLE.decode_bits(image)
    formats = {"pv": bits["pv.format"], "sp": bits["pv.format"], "output": bits["output.format"] or bits["pv.format"]}
    for word in LOOP_TABLE.words:
        if word.path is not None:
            image[word.offset] = draw(word_values(word.codec, formats))
    return image


def word_values(codec, formats) -> st.SearchStrategy[int]:
    """The words that a codec takes."""
    if isinstance(codec, Bcd | SpanBcd):
        return st.integers(0, 9999).map(lambda n: int(str(n), 16))
    if isinstance(codec, Position):
        form = FORMATS[formats[codec.scale]]
        return st.integers(form.minimum, form.maximum).map(form.codec.encode)
    if isinstance(codec, Distance):
        return st.integers(0, FORMATS[formats[codec.scale]].maximum)
    return st.integers(0, 0xFFFF)


EVERYTHING = {
    "description": "all of it",
    "mode": "cascade",
    "cascade_from": "L2",
    "remote_setpoint": "V3000",
    "algorithm": "velocity",
    "bumpless": "I",
    "bias_freeze": True,
    "independent_of_cpu_mode": True,
    "tuning": {"gain": 1, "reset": 30, "reset_unit": "seconds", "rate": 5},
    "derivative_gain_limit": 10,
    "derivative_gain_limit_enabled": True,
    "pv": {
        "range": [0, 50],
        "unit": "l/h",
        "format": "12-bit unipolar",
        "square_root": False,
        "filter": 0.5,
        "filter_enabled": True,
        "transfer": {"slot": 1, "channel": 2},
    },
    "setpoint": {"value": 20, "limits": [0, 45], "limits_enabled": True},
    "output": {
        "range": [0, 100],
        "unit": "%",
        "format": "12-bit unipolar",
        "limits": [5, 95],
        "transfer": {"address": "V3000"},
    },
    "error": {"curve": "squared", "deadband": 0.5, "deadband_enabled": True},
    "alarms": {
        "pv": {"low_low": 1, "low": 2, "high": 40, "high_high": 45, "enabled": True},
        "deviation": {"yellow": 5, "red": 10, "enabled": True},
        "rate_of_change": 0.5,
        "rate_of_change_enabled": True,
        "hysteresis": 1,
    },
    "ramp_soak": {
        "table": "V4000",
        "enabled": True,
        "request": "start",
        "steps": [{"ramp_to": 20, "slope": 0.1, "soak": 5, "deviation": 1}],
    },
    "autotune": {"method": "open", "type": "PI", "start": True},
    "state": {"pv": 10, "bias": 20, "output": 30},
}
"""Every key of a loop, none at its default: a conversion has to speak of each."""
