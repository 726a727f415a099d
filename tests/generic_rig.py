"""Neutral loops with plants, and random files, for the tests of the neutral form."""

from __future__ import annotations

from decimal import Decimal

from hypothesis import strategies as st

from pidcfg.encoders.generic.image import encode
from pidcfg.schemas.generic import GenericFile
from pidcfg.sim.controllers.generic.scan import load, scan
from pidcfg.sim.controllers.plc import TICKS
from pidcfg.sim.controllers.plc import ScanOptions as Options
from rig_plants import Fixed

PLAIN = {
    "output_raises_pv": True,
    "sample_time": "100 ms",
    "tuning": {"gain": 1},
    "pv": {"range": [0, 100]},
    "setpoint": {"value": 0},
    "output": {"range": [-100, 100]},
}
"""A proportional loop with a gain of 1."""


def file_of(*loops):
    """A file of loops L1, L2 … that differ from a plain one by what is given."""
    entries = [{"name": f"L{i + 1}", **PLAIN, **given} for i, given in enumerate(loops)]
    return GenericFile.model_validate({"pidcfg": 1, "vendor": "generic", "loops": entries})


class Rig:
    """A controller, the plants of its loops, and the clock; ``base`` is the base step in seconds."""

    def __init__(self, *loops, plants=(), base=0.1):
        self.plc = load(encode(file_of(*loops)).image, Options())
        self.configs, self.states, self.signal_values = self.plc.configs, self.plc.states, list(self.plc.signal_values)
        self.plants = [*plants, *(Fixed() for _ in self.configs[len(plants) :])]
        self.base, self.tick = base, 0

    def set(self, key, value, i=0):
        """A set event."""
        path = tuple(key.split("."))
        return self.plc.set(i, path, self.plc.check_set(i, path, value), self.signal_values)

    def mode(self, i=0):
        return self.plc.mode(self.states[i].status)

    def flags(self, i=0):
        """Alarms and flags that are on."""
        bits = {**self.plc.alarm_bits, **self.plc.flag_bits}
        return {name for name, bit in bits.items() if self.states[i].status & bit}

    def signal(self, name, i=0):
        return self.signal_values[self.plc.signals.index(f"{self.plc.loops[i]}.{name}")]

    def step(self, count=1):
        """Base steps: plants with the outputs of the step before, then the controllers."""
        for _ in range(count):
            for c, plant in zip(self.configs, self.plants, strict=True):
                if self.tick:
                    plant.step(self.signal_values[c.out_slot], self.base)
                self.signal_values[c.in_slot] = plant.value
            scan(self.tick, self.configs, self.states, self.plc.aux, self.signal_values)
            self.tick += round(self.base * TICKS)
        return self

    def play(self, pvs, name="OUT", i=0):
        """A signal after each of some measurements."""
        rows = []
        for pv in pvs:
            self.plants[i].value = pv
            self.step()
            rows.append(self.signal(name, i))
        return rows


# --- random files ----------------------------------------------------------------------------------------------------

TEXTS = st.text(st.characters(codec="utf-8", exclude_categories=("Cc", "Cs", "Cn", "Co")), min_size=1, max_size=20)
TRUTHS = st.booleans()


NUMBERS = st.decimals(-5000, 5000, places=3) | st.sampled_from(["1e200", "-1.5e-200", "0.1234567890123456"]).map(
    Decimal
)
"""What a double holds exactly as its shortest decimal, also far out."""
POSITIVE = st.decimals(0, 5000, places=4) | st.sampled_from(["1e100", "1.5e-200"]).map(Decimal)
TIMES = POSITIVE | st.integers(0, 9000).map("{} ms".format)
PAIRS = st.tuples(st.integers(-5000, 5000), st.integers(1, 9000)).map(lambda t: [t[0], t[0] + t[1] / 8])


def part(needed, **keys):
    """A section with some keys that must stand there and others that may."""
    return st.fixed_dictionaries(needed, optional=keys)


def loops(names):
    """Loops with every key that the schema knows, given or left out; they get their names later."""
    points = part({}, low_low=NUMBERS, low=NUMBERS, high=NUMBERS, high_high=NUMBERS)
    tuning = part(
        {"gain": POSITIVE},
        integral_time=TIMES | st.just("off"),
        derivative_time=TIMES | st.just("off"),
        proportional=TRUTHS,
        derivative_on=st.sampled_from(["pv", "error"]),
        derivative_filter=TIMES,
    )
    output = part(
        {"range": PAIRS},
        unit=TEXTS,
        limits=PAIRS,
        bias=NUMBERS,
        manual=NUMBERS,
        max_rate=POSITIVE,
        pulse=part({"period": TIMES}, min_on=TIMES, min_off=TIMES),
    )
    return part(
        {
            "output_raises_pv": TRUTHS,
            "sample_time": TIMES,
            "tuning": tuning,
            "output": output,
            "pv": part({"range": PAIRS}, unit=TEXTS, filter=TIMES, square_root=TRUTHS),
        },
        description=TEXTS,
        mode=st.sampled_from(["manual", "auto", "cascade"]),
        setpoint=part({}, value=NUMBERS, limits=PAIRS, source=st.sampled_from(names), follows_pv=TRUTHS),
        deadband=POSITIVE,
        anti_windup=TRUTHS,
        alarms=part(
            {},
            pv=points,
            deviation=part({}, high=POSITIVE, high_high=POSITIVE),
            rate_of_change=POSITIVE,
            hysteresis=POSITIVE,
        ),
    )


NAMES = ("TIC-101", "A.b", "A.b.pv", "Öl 2#")
TOP, LOOPS = part({}, name=TEXTS, description=TEXTS), loops(NAMES)


@st.composite
def configurations(draw):
    """A file of one to three loops."""
    entries = [{"name": name, **draw(LOOPS)} for name in NAMES[draw(st.integers(0, 3)) :][:2]]
    return GenericFile.model_validate({"pidcfg": 1, "vendor": "generic", **draw(TOP), "loops": entries})
