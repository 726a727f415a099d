"""How good the battery of --verify is: correct conversions that fail, and spoiled results that stay green.

Run as a program: ``python tests/verify_measure.py [CONVERSIONS [SPOILED [SEED]]] [--wild]`` prints both figures over
all 20 pairs, and each spoiled setting that was not found with the reason that makes it harmless; with ``--wild`` of
loops at the edge. The tests run a sample of both.
"""

from __future__ import annotations

import random
import sys
from collections import Counter
from copy import deepcopy
from dataclasses import dataclass, field, replace
from decimal import Decimal
from itertools import count, permutations
from pathlib import Path

from pidcfg.conversion import ConvertError, do_overlap
from pidcfg.conversion.builder import flatten
from pidcfg.conversion.operation import Windup, WithoutIntegral, has_narrow_limits
from pidcfg.conversion.pipeline import convert
from pidcfg.encoders.codecs import DecodeError, EncodeError
from pidcfg.schemas.generic import GenericFile
from pidcfg.sim.engine.run import UnusableError
from pidcfg.study.verification.trial import loops_of, neutral_of, root_step
from pidcfg.study.verification.verify import (
    Battery,
    _make_sides,
    hidden_fields,
    make_reference,
    tolerance_of,
    unreported_numbers,
    unreported_rules,
)
from pidcfg.text.reader import DEFAULT
from pidcfg.text.source import read_document
from pidcfg.text.writer import yaml_text
from pidcfg.validate.engine import check_document
from pidcfg.vendors import VENDORS

ROOT = Path(__file__).parents[1]
PLCS = [key for key in VENDORS if key != "generic"]
PAIRS = list(permutations(PLCS, 2))
LEFT_OUT = {
    "name": "a label",
    "description": "a label",
    "type": "the kind of block",
    "unit": "a label",
    **dict.fromkeys(("registers", "discretes", "bits", "integers", "floats", "device", "devices", "format"), "a place"),
    **dict.fromkeys(("pv_tag", "cv_tag", "output_tag", "bit", "transfer", "remote_setpoint", "PV", "tag"), "a place"),
    "counts": "the input module's",
    "autotune": "no part of control",
    **dict.fromkeys(("pulse", "pwm"), "the plant takes the output before it is pulsed"),
    "call": "how the program calls the instruction",
    "cascade_from": "a link, spoiled in the tests of cascades",
    **dict.fromkeys(("SP_CASC", "TRK_VAL", "TRK_IN", "Windup_H_IN", "Windup_L_IN"), "a link, likewise"),
    "independent_of_cpu_mode": "acts while the CPU stands still",
    "input_range": "a label of the instrument",
}
"""Keys that are not spoiled, and why."""
POSITIONS = {"value", "SP", "SV", "MinPV", "MaxPV", "lower_limit", "upper_limit", "low", "high", "low_low", "high_high"}
OUTPUTS = {"MinMV", "MaxMV", "MV_MIN", "MV_MAX", "BIAS", "ManualMV", "MOUT"}
TIMES = {"Ti_Ki", "Td_Kd", "Tfd", "Tf", "CYCLE", "reset", "rate", "sample_rate", "sample_time", "reset_time"}
TIMES |= {"derivative_gain", "integral_time", "derivative_time", "Tc"}
SETPOINTS = {"SP", "SV", "value"}
CHOICES = (
    ("direct", "reverse"),
    ("I", "II"),
    ("auto", "manual"),
    ("position", "velocity"),
    ("pv", "error"),
    ("seconds", "minutes"),
)


def checked(data):
    """Plain data as a checked configuration."""
    return check_document(read_document(yaml_text(data).encode(), "<measure>", DEFAULT))


# --- correct conversions ---------------------------------------------------------------------------------------------


def random_loop(rng: random.Random, i: int) -> dict:
    """A neutral loop as a plant has it: gains, times and limits that every controller can hold."""
    low, high = rng.choice([(0, 100), (-50, 150), (0, 400), (0, 10), (-328, 1562)])
    span = high - low
    out_low, out_high = rng.choice([(0, 100), (0, 100), (4, 20), (0, 3000)])
    width = out_high - out_low
    sample = rng.choice([0.1, 0.2, 0.5, 1, 2, 5])
    loop = {
        "name": f"L{i}",
        "mode": rng.choice(["auto", "auto", "auto", "manual"]),
        "output_raises_pv": rng.random() < 0.6,
        "sample_time": sample,
        "tuning": {
            "gain": float(f"{width / span * rng.uniform(0.3, 6):.4g}"),
            "integral_time": 0 if rng.random() < 0.12 else round(sample * rng.uniform(12, 200), 1),
            "derivative_time": round(sample * rng.uniform(2, 8), 1) if rng.random() < 0.3 else 0,
            "derivative_on": rng.choice(["pv", "error"]),
        },
        "pv": {"range": [low, high], "unit": "degC"},
        "setpoint": {"value": round(low + span * rng.uniform(0.3, 0.7), 2), "follows_pv": rng.random() < 0.4},
        "output": {"range": [out_low, out_high]},
        "alarms": {},
        "anti_windup": rng.random() < 0.8,
    }
    if loop["tuning"]["derivative_time"] and rng.random() < 0.5:
        loop["tuning"]["derivative_filter"] = round(loop["tuning"]["derivative_time"] / rng.choice([4, 8, 10]), 2)
    if rng.random() < 0.3:
        loop["pv"]["filter"] = round(sample * rng.uniform(0.5, 4), 2)
    if rng.random() < 0.4:
        loop["setpoint"]["limits"] = [round(low + 0.1 * span, 2), round(low + 0.9 * span, 2)]
    if rng.random() < 0.4:
        loop["output"]["limits"] = [round(out_low + 0.1 * width, 2), round(out_low + 0.85 * width, 2)]
    if loop["mode"] == "manual" or rng.random() < 0.3:
        loop["output"]["manual"] = round(out_low + width * rng.uniform(0.2, 0.8), 2)
    if not loop["tuning"]["integral_time"]:
        loop["output"]["bias"] = round(out_low + width * rng.uniform(0.3, 0.6), 2)
    if rng.random() < 0.08:
        loop["deadband"] = round(span * rng.uniform(0.005, 0.02), 3)
    if rng.random() < 0.5:
        loop["alarms"] = random_alarms(rng, low, span, sample)
    return loop


def random_alarms(rng: random.Random, low: float, span: float, sample: float) -> dict:
    """Alarm points around the set points that a loop may have."""
    points = {"low_low": 0.06, "low": 0.15, "high": 0.85, "high_high": 0.94}
    chosen = {key: round(low + span * share, 2) for key, share in points.items() if rng.random() < 0.7}
    alarms = {"pv": chosen, "hysteresis": round(span * rng.choice([0.005, 0.01]), 3)}
    if rng.random() < 0.5:
        alarms["deviation"] = {"high": round(span * 0.06, 2), "high_high": round(span * 0.15, 2)}
    if rng.random() < 0.3:
        alarms["rate_of_change"] = round(span * 0.02 / sample, 3)
    return alarms


def of_vendor(loops: list[dict], vendor: str):
    """Neutral loops as a vendor's checked configuration; None where it cannot hold them."""
    try:
        file = GenericFile.model_validate({"pidcfg": 1, "vendor": "generic", "loops": loops})
        converted = convert(file, VENDORS["generic"], VENDORS[vendor], {})
        result = checked(converted.data)
    except (ConvertError, DecodeError, EncodeError):
        return None
    return None if result.failed else result


def sources(seed: int, *, examples: bool = True, wild: bool = False):
    """Configurations of each vendor without end: the examples first, then random ones."""
    for path in sorted((ROOT / "examples").glob("*/*.yaml") if examples else ()):
        if ".scenario." in path.name or path.parent.name in {"mistakes", "generic"}:
            continue
        source = check_document(read_document(path.read_bytes(), str(path), DEFAULT))
        for target in PLCS:
            if target != source.vendor.key:
                yield source, target, path.name
    for n in count(1):
        source, target = wild_source(n, str(seed)) if wild else random_source(n, seed)
        if source is not None:
            yield source, target, f"{'wild' if wild else 'random'} {n}"


def random_source(n: int, seed: int = 1):
    """The n-th random configuration, and the vendor that it goes to."""
    one, two = PAIRS[(n - 1) % len(PAIRS)]
    return of_vendor([random_loop(random.Random(f"{seed}/{n}"), 1)], one), two


def numbered(n: int):
    """The n-th random conversion."""
    return Conversion.of(*random_source(n), f"random {n}")


# --- wild loops ------------------------------------------------------------------------------------------------------


def wild_loop(rng: random.Random, i: int) -> dict:
    """A neutral loop at the edge: gains to 400, derivatives of 100 s at 0.1 s, dead bands, Manual with limits."""
    low, high = rng.choice([(0, 100), (-50, 150), (0, 400), (0, 10), (-328, 1562), (0, 1200), (-1, 1), (0, 16)])
    out_low, out_high = rng.choice([(0, 100), (0, 100), (4, 20), (0, 3000), (0, 50), (-100, 100)])
    span, width = high - low, out_high - out_low
    sample = rng.choice([0.05, 0.1, 0.1, 0.2, 0.5, 1, 2, 5, 30])
    gain = 10 ** rng.uniform(-1.2, 1.3) * width / span
    if rng.random() < 0.25:
        gain = rng.uniform(20, 400)
    loop = {
        "name": f"L{i}",
        "mode": rng.choice(["auto", "auto", "manual"]),
        "output_raises_pv": rng.random() < 0.5,
        "sample_time": sample,
        "tuning": wild_tuning(rng, sample, gain),
        "pv": {"range": [low, high], "unit": "degC"},
        "setpoint": {"value": round(low + span * rng.uniform(0.2, 0.8), 2), "follows_pv": rng.random() < 0.4},
        "output": {"range": [out_low, out_high]},
        "alarms": {},
        "anti_windup": rng.random() < 0.8,
    }
    if rng.random() < 0.35:
        loop["pv"]["filter"] = round(sample * 10 ** rng.uniform(-0.3, 1.3), 2)
    if rng.random() < 0.08:
        loop["pv"]["square_root"] = True
    if rng.random() < 0.4:
        ends = low + rng.uniform(0, 0.2) * span, low + rng.uniform(0.8, 1) * span
        loop["setpoint"]["limits"] = [round(end, 2) for end in ends]
    if rng.random() < 0.5:
        ends = out_low + rng.uniform(0, 0.3) * width, out_low + rng.uniform(0.6, 1) * width
        loop["output"]["limits"] = [round(end, 2) for end in ends]
    if loop["mode"] == "manual" or rng.random() < 0.3:
        loop["output"]["manual"] = round(out_low + width * rng.uniform(0, 1), 2)
    if not loop["tuning"]["integral_time"]:
        loop["output"]["bias"] = round(out_low + width * rng.uniform(0.2, 0.7), 2)
    if rng.random() < 0.25:
        loop["deadband"] = round(span * rng.uniform(0.003, 0.05), 3)
    if rng.random() < 0.5:
        loop["alarms"] = random_alarms(rng, low, span, sample)
    return loop


def wild_tuning(rng: random.Random, sample: float, gain: float) -> dict:
    """Its gain and times."""
    times = rng.choice([sample * 10 ** rng.uniform(0, 1.5), rng.uniform(5, 100)])
    tuning = {
        "gain": float(f"{gain:.4g}"),
        "integral_time": 0 if rng.random() < 0.12 else float(f"{sample * 10 ** rng.uniform(0.5, 3.2):.3g}"),
        "derivative_time": float(f"{times:.3g}") if rng.random() < 0.4 else 0,
        "derivative_on": rng.choice(["pv", "error"]),
    }
    if tuning["derivative_time"] and rng.random() < 0.5:
        tuning["derivative_filter"] = round(tuning["derivative_time"] / rng.choice([2, 4, 8, 10, 20]), 2)
    return tuning


def wild_source(n: int, seed: str = "1"):
    """The n-th wild configuration, without a dead band where its vendor has none, and the vendor that it goes to."""
    one, two = PAIRS[(n - 1) % len(PAIRS)]
    loop = wild_loop(random.Random(f"{seed}/{n}"), 1)
    source = of_vendor([loop], one)
    if source is None:
        source = of_vendor([{key: value for key, value in loop.items() if key != "deadband"}], one)
    return source, two


@dataclass
class Conversion:
    """A conversion with its twin, and the references that spoiled results are held against."""

    source: object
    result: object
    outcome: object
    label: str

    @classmethod
    def of(cls, source, target: str, label: str):
        """The conversion; None where the source or the target refuses it."""
        try:
            outcome = convert(source.config, source.vendor, VENDORS[target], {})
        except (ConvertError, DecodeError, EncodeError):
            return None
        result = checked(outcome.data)
        if result.failed:
            return None
        return cls(source, result, outcome, f"{label}: {source.vendor.key} to {target}")

    @property
    def pairs(self):
        """The places of the loops that went over."""
        return [(i, j) for j, i in enumerate(self.outcome.source_loops)]

    def is_in_memory(self, result) -> bool:
        """Whether a spoiled result differs in a register or a parameter, and not in labels alone."""
        return result.encoding.image.words != self.result.encoding.image.words

    def sides(self, result):
        """The source, what the report makes of it, and a result."""
        one, two = (self.source.vendor, self.source.config), (result.vendor, result.config)
        return _make_sides(one, two, self.pairs, self.outcome.loops, ("source", "result"))

    def unexplained(self, result, i: int, j: int, *, source: bool = False):
        """The first difference that no switch explains; None: both sides are alike. ``source``: that of the source."""
        sides = self.sides(result)
        if sides.target.loops[j] is None:
            return "no neutral form"
        step = max(root_step(sides.source, i), root_step(sides.target, j))
        reference = make_reference(sides.target_model, i, sides.target.loops[j], step)
        tolerance = tolerance_of(sides.target_model, i, sides.target, j, reference.bench)
        found = next(unreported_numbers(sides.target_model.loops[i], sides.target.loops[j]), None)
        found = found or next(unreported_rules(sides, i, j), None)
        if found is None:
            found = next(Battery(reference, sides.target, j, tolerance).find_differences(), None)
        if found is None and source:
            mirror = make_reference(sides.source_model, i, sides.target.loops[j], step)
            tolerance = tolerance_of(sides.source_model, i, sides.reduced_source, i, mirror.bench)
            found = next(Battery(mirror, sides.reduced_source, i, tolerance).find_differences(), None)
        return found


# --- spoiled results -------------------------------------------------------------------------------------------------


def leaves(data, path=()):
    """Every setting of a loop's plain data that may be spoiled, with its path."""
    items = data.items() if isinstance(data, dict) else enumerate(data)
    for key, value in items:
        if key in LEFT_OUT:
            continue
        if isinstance(value, dict | list):
            yield from leaves(value, (*path, key))
        else:
            yield (*path, key), value


def spoiled_values(path, value, loop):
    """What a setting is changed to, with the name of the change; None removes it."""
    name = next(key for key in reversed(path) if isinstance(key, str))
    span = float(loop.pv.range[1] - loop.pv.range[0])
    width = float(loop.output.range[1] - loop.output.range[0])
    if isinstance(value, bool):
        yield "flipped", not value
    elif isinstance(value, str):
        yield from spoiled_text(name, value)
    elif isinstance(value, int | float):
        yield from spoiled_numbers(path, name, value, span, width)
    yield "removed", None


def spoiled_text(name, value):
    """Words, and times with a unit."""
    for pair in CHOICES:
        if value in pair:
            yield "flipped", pair[1 - pair.index(value)]
            return
    number, _, unit = value.partition(" ")
    time = unit in {"ms", "s", "min"}
    try:
        spoiled = Decimal(number) * (Decimal("1.2") if time else Decimal("1.05"))
        yield "x 1.2" if time else "x 1.05", f"{spoiled if time else spoiled.to_integral_value()} {unit}"
    except ArithmeticError:
        return


def spoiled_numbers(path, name, value, span, width):
    """Times by 1.2, positions by 5 % of span either way, other numbers by 1.25."""
    section = path[0]
    if name in TIMES:
        if value:
            yield "x 1.2", type(value)(round(value * 1.2, 6))
    elif name in OUTPUTS or (section in {"output", "state"} and name != "max_rate"):
        full = 100 if section == "state" else width
        yield "+ 5 %", round(value + 0.05 * full, 6)
        yield "- 5 %", round(value - 0.05 * full, 6)
    elif "deviation" in path or name in {"hysteresis", "rate_of_change"}:
        yield "x 1.25", round(value * 1.25, 6)
    elif name in POSITIONS or (section in {"setpoint", "pv", "alarms"} and name != "filter"):
        yield "+ 5 %", round(value + 0.05 * span, 6)
        yield "- 5 %", round(value - 0.05 * span, 6)
    elif name == "PID_MODE":
        yield "other", 0 if value == 2 else 2
    elif value:
        spoiled = value * 1.25
        yield "x 1.25", round(spoiled) if name == "filter" and value > 1 else round(spoiled, 6)


def spoils(conversion: Conversion, j: int, loop):
    """Every spoiled result of one loop: path, change, and the checked file; those that cannot be read are left out."""
    data = conversion.outcome.data
    for path, value in list(leaves(data["loops"][j])):
        for change, other in spoiled_values(path, value, loop):
            copy = deepcopy(data)
            here = copy["loops"][j]
            for key in path[:-1]:
                here = here[key]
            if other is None:
                if isinstance(here, list):
                    continue
                del here[path[-1]]
            else:
                here[path[-1]] = other
            result = checked(copy)
            if result.config is None or result.encoding is None or not result.encoding.is_complete:
                continue
            if result.encoding.image.words == conversion.result.encoding.image.words and (
                result.encoding.image.settings == conversion.result.encoding.image.settings
            ):
                continue  # the same memory: nothing is spoiled
            yield path, change, result


def dotted(path):
    """A path as text."""
    return ".".join(map(str, path))


def is_idle(conversion: Conversion, j: int, path, result) -> bool:
    """Whether a setting does nothing on this loop, so that it is not one that acts: these are left out.

    Labels of a scale that no register holds; a bias that the integral takes over; a set point while nothing is in Auto;
    what the derivative acts on, without one; an output for Manual in a loop that starts in Auto; a range of the PV that
    is wider than the transmitter's.
    """
    before, after = (loops_of(one.config, one.vendor)[j] for one in (conversion.result, result))
    name = next(key for key in reversed(path) if isinstance(key, str))
    operations = [one.vendor.load("operation")(one.config)[j] for one in (conversion.result, result)]
    same = after == before and operations[0] == operations[1]
    windup = after.model_copy(update={"anti_windup": before.anti_windup}) == before and acts_alike(*operations, before)
    alarms = {key for key in flatten(before) if key.startswith("alarms.")}
    if same or windup or (name == "hysteresis" and alarms <= {"alarms.hysteresis"}):
        return True
    if name in {"ManualMV", "MOUT"} or path == ("state", "output"):
        return before.mode != "manual" or by_hand(before) == by_hand(after)
    if name in {"BIAS", "bias", "offset"}:
        return bool(before.tuning.integral_time) or operations[0].without_integral is WithoutIntegral.TAKEN_OVER
    if "limit" in name and path[0] == "setpoint" and set_points(before) == set_points(after):
        return True
    if name == "hysteresis" and not any(
        key.startswith("alarms.") and key != "alarms.hysteresis" for key in flatten(before)
    ):
        return True
    low, high = before.pv.range
    wider = after.pv.range[0] <= low and high <= after.pv.range[1]
    derives = before.tuning.derivative_time or after.tuning.derivative_time
    within = "limit" in name and path[0] == "setpoint" and set_points(before) == set_points(after)
    return (
        within
        or (name == "range" and not conversion.is_in_memory(result))
        or (name in SETPOINTS and before.mode == after.mode == "manual")
        or (name in {"DerivEr", "PID_DE", "algorithm"} and not derives)
        or (name in {"MinPV", "MaxPV"} and wider)
    )


def by_hand(loop):
    """The output that a loop has in manual, within its limits."""
    low, high = loop.output.limits or loop.output.range
    return min(max(loop.output.manual or Decimal(0), low), high)


def set_points(loop):
    """Which set points a loop takes, within the range of its PV."""
    low, high = loop.pv.range
    first, last = loop.setpoint.limits or loop.pv.range
    return max(first, low), min(last, high)


def reason(conversion: Conversion, i: int, j: int, path, result) -> str:
    """Why a spoiled setting that was not found is harmless on its loop; empty: nobody knows."""
    sides = conversion.sides(conversion.result)
    reference = make_reference(sides.target_model, i, sides.target.loops[j])
    hidden = list(hidden_fields(reference, sides.target_model, i))
    both = [neutral_of(one.config, one.vendor)[1][j].fields for one in (conversion.result, result)]
    entries = [entry for fields in both for entry in fields]
    fields = [to for entry in entries if do_overlap(dotted(path), entry.path) for to in entry.neutral]
    if any(do_overlap(field, other) for field in fields for other in hidden):
        return "the verdict lists it as not shown"
    return ""


def acts_alike(before, after, loop) -> bool:
    """Whether two rules of windup are one on a loop: without an integral, or with limits inside of the range."""
    if replace(before, windup=after.windup) != after:
        return False
    both = {before.windup, after.windup}
    within = {Windup.FROZEN_AT_ENDS, Windup.WITHIN_RANGE, Windup.CONDITIONAL_AT_ENDS, Windup.ENDLESS}
    return not loop.tuning.integral_time or (has_narrow_limits(loop) and both <= within - {Windup.ENDLESS})


@dataclass
class Figures:
    """What a measurement gave so far."""

    say: object
    correct: int = 0
    failed: list = field(default_factory=list)
    spoiled: int = 0
    survivors: list = field(default_factory=list)

    def test(self, one: Conversion, i: int, j: int) -> bool:
        """Whether a correct conversion of a loop passes."""
        difference = verdict(one, one.result, i, j, source=True)
        if difference is not None:
            self.failed.append((one.label, j, difference))
            what = difference if isinstance(difference, str) else f"{difference.stage} {difference.signal}"
            self.say(f"FAILED {one.label} loop {j}: {what}")
        return difference is None

    def spoil(self, one: Conversion, i: int, j: int, rng: random.Random, most: int) -> None:
        """Some spoiled results of a loop."""
        loop = loops_of(one.result.config, one.result.vendor)[j]
        candidates = [spoiled for spoiled in spoils(one, j, loop) if not is_idle(one, j, spoiled[0], spoiled[2])]
        for path, change, result in rng.sample(candidates, min(most, len(candidates))):
            self.spoiled += 1
            if verdict(one, result, i, j) is None:
                why = reason(one, i, j, path, result)
                self.survivors.append((one.label, dotted(path), change, why))
                self.say(f"survived {one.label}: {dotted(path)} {change}: {why or '?'}")

    @property
    def found(self) -> int:
        """Spoiled results that were found."""
        return self.spoiled - len(self.survivors)


def verdict(one: Conversion, result, i: int, j: int, *, source: bool = False):
    """What is wrong with a loop; None: nothing."""
    try:
        return one.unexplained(result, i, j, source=source)
    except UnusableError as error:
        return str(error)


def measure(
    conversions: int,
    wanted: int,
    seed: int = 1,
    per_loop: int = 8,
    *,
    examples: bool = True,
    wild: bool = False,
    say=print,
) -> Figures:
    """Both figures, with the failures and the survivors."""
    figures = Figures(say)
    for source, target, label in sources(seed, examples=examples, wild=wild):
        if figures.correct >= conversions and figures.spoiled >= wanted:
            return figures
        one = Conversion.of(source, target, label)
        if one is None:
            continue
        figures.correct += 1
        for i, j in one.pairs:
            if figures.test(one, i, j) and figures.spoiled < wanted:
                figures.spoil(one, i, j, random.Random(f"{seed}/{one.label}/{j}"), per_loop)
    return figures


def main() -> None:
    """Prints the figures."""
    wild = "--wild" in sys.argv
    given = [int(text) for text in sys.argv[1:] if text != "--wild"]
    conversions, wanted, seed = (*given, *(400, 2000, 1)[len(given) :])
    figures = measure(conversions, wanted, seed, examples=not wild, wild=wild)
    share = 100 * figures.found / max(figures.spoiled, 1)
    print(f"{len(figures.failed)} of {figures.correct} correct conversions failed")  # noqa: T201
    print(f"{figures.found} of {figures.spoiled} spoiled results were found: {share:.1f} %")  # noqa: T201
    for (path, change, why), times in Counter(row[1:] for row in figures.survivors).most_common():
        print(f"  {times} x {path} {change}: {why or '?'}")  # noqa: T201


if __name__ == "__main__":
    main()
