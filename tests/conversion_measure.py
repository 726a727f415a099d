"""How true reports of conversions are: random files over all pairs of vendors, each field held against its line.

Run as a script it measures as many as it is told (``python tests/conversion_measure.py 20``: conversions a pair; with
``spoil`` behind it results are spoiled key by key, and it counts how many of those that make an exact line wrong are
noticed); the tests run a few. A line is held against the target's own file, decoded from its registers and brought to
neutral terms, with nothing of what the report was made of but the names of the neutral fields.
"""

from __future__ import annotations

import copy
import sys
from collections import Counter
from decimal import Decimal
from itertools import permutations

from hypothesis import HealthCheck, Phase, given, settings

import click_strategies
import dl06_strategies
import dpide_strategies
import ezlogix_strategies
import nextopid_strategies
from neutral_strategies import neutral_files
from pidcfg.conversion import ConvertError, do_overlap
from pidcfg.conversion.builder import correct_lines, has_alarms, is_harmless, make_comparable
from pidcfg.conversion.pipeline import convert, neutral_loops
from pidcfg.encoders.codecs import DecodeError, EncodeError
from pidcfg.encoders.contract import encoder_of
from pidcfg.schemas.generic import Loop
from pidcfg.text.paths import dotted_text, given_fields, leaves, set_value
from pidcfg.text.source import read_document
from pidcfg.text.writer import yaml_text
from pidcfg.validate.engine import check_document
from pidcfg.vendors import VENDORS

RANDOM = {
    "click": click_strategies.configurations(),
    "dl06": dl06_strategies.configurations(),
    "dpide": dpide_strategies.configurations(),
    "ezlogix": ezlogix_strategies.configurations(),
    "nextopid": nextopid_strategies.configurations(),
    "generic": neutral_files(),
}
PAIRS = list(permutations(VENDORS, 2))
NOTHING_SAID = {"nextopid": Decimal(0), "dpide": Decimal(0)}
"""The output in manual where a file says none; with the others it is the low end of the range."""
TOLERANCE = Decimal("1e-6")
"""Relative: single precision, there and back."""


def sources(vendor):
    """Files of a vendor: random ones, and random neutral ones written for it."""
    return RANDOM[vendor] if vendor == "generic" else RANDOM[vendor] | neutral_files()


def as_source(file, vendor):
    """A file as one of the vendor; None where it cannot be."""
    if file.vendor == vendor:
        return file
    try:
        data = convert(file, VENDORS["generic"], VENDORS[vendor], {}).data
    except (ConvertError, EncodeError):
        return None
    return check_document(read_document(yaml_text(data).encode(), "source.yaml")).config


def held(data, vendor):
    """The neutral loops of what the vendor's registers hold of a file."""
    target = VENDORS[vendor]
    image = encoder_of(target).encode(target.model.model_validate(data)).image
    decoded = target.model.model_validate(target.load("decode")(image.words, image.settings, image.plc).data)
    return neutral_loops(decoded, target)[0].loops


def unspoken(config, i, rows):
    """The fields that a loop's file gives and no line speaks of."""
    plc = getattr(config, "plc", None)
    given = [*given_fields(config.loops[i]), *(given_fields(plc, ("plc",)) if i == 0 and plc is not None else ())]
    paths = [dotted_text(path) for path, _ in given]
    lines = {row.field for row in rows}
    return [path for path in paths if not any(do_overlap(path, line) for line in lines)]


POSITIONS = ("output.limits", "output.manual", "output.bias", "setpoint.limits", "setpoint.value")
"""Fields that lie on a scale, and are exact as shares of its range."""


def width_of(key, before):
    """The range that a position lies on; None: the field is no position."""
    if not key.startswith(POSITIONS):
        return None
    side = "output" if key.startswith("output") else "pv"
    low, high = (before.get(f"{side}.range.{end}") for end in (0, 1))
    return None if low is None or high is None else abs(high - low)


def differs(key, one, two, width=None):
    """Whether two neutral values are not the same; a set point that stays needs no place."""
    if is_harmless(key, one):
        return two not in {one, None}
    if isinstance(one, bool) or isinstance(two, bool) or not isinstance(one, Decimal) or not isinstance(two, Decimal):
        return one != two
    return abs(one - two) > TOLERANCE * max(abs(one), abs(two), width or Decimal("1e-9"))


def untrue(row, names, before, after):
    """The neutral fields of an exact line that the target does not hold."""
    keys = [key for key in before for name in names if key == name or key.startswith(f"{name}.")]
    if row.kind != "exact" or (row.target is None and row.field.endswith("proportional")):
        return []
    return [
        key
        for key in keys
        if row.kind == "exact"
        and before[key] is not None
        and differs(key, before[key], after.get(key), width_of(key, before))
    ]


def measured(config, one, two):
    """Of a conversion: lines, exact lines, exact lines that are not exact, given fields, fields without a line."""
    count = Counter()
    source, target = VENDORS[one], VENDORS[two]
    loops = source.load("to_neutral")(config)
    neutral = {i: Loop.model_validate(loop.data) for i, loop in enumerate(loops) if not loop.missing}
    result = convert(config, source, target, {})
    back = held(result.data, two)
    originals = {loop.name: neutral[i].name for i, loop in zip(result.source_loops, back, strict=True)}
    count["conversions"] += 1
    for j, i in enumerate(result.source_loops):
        rows = result.loops[i].changes
        before, after = make_comparable(neutral[i], back[j])
        if not has_alarms(neutral[i]):
            before.pop("alarms.hysteresis", None)  # it acts on none
        after.setdefault("output.manual", NOTHING_SAID.get(two, before["output.range.0"]))
        after["setpoint.source"] = originals.get(after.get("setpoint.source"))
        names = {field.path: field.neutral for field in loops[i].fields}
        count["lines"] += len(rows)
        for row in rows:
            count["exact"] += row.kind == "exact"
            wanted = [
                name for name in names.get(row.field, ()) if any(do_overlap(name, other) for other in row.neutral)
            ]
            ends = [max(name, other, key=len) for name in wanted for other in row.neutral if do_overlap(name, other)]
            wrong = untrue(row, ends, before, after)
            count["untrue"] += bool(wrong)
            for key in wrong:
                count[f"untrue {two} {row.field} {key}"] += 1
        silent = unspoken(config, i, rows)
        count["given"] += len(list(given_fields(config.loops[i])))
        count["silent"] += len(silent)
        for path in silent:
            count[f"silent {one} {path}"] += 1
    return count


def measure(one, two, number, what=measured):
    """The counts over random files of a pair."""
    total = Counter()

    @settings(
        max_examples=number,
        deadline=None,
        database=None,
        derandomize=True,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    @given(sources(one))
    def run(file):
        config = as_source(file, one)
        if config is None:
            return
        try:
            total.update(what(config, one, two))
        except (ConvertError, EncodeError, DecodeError):
            total["refused"] += 1

    run()
    return total


def spoiled(value):
    """A value that is certainly another one; None: it is left alone."""
    if isinstance(value, bool):
        return not value
    return value * 1.25 + 1 if isinstance(value, int | float) else None


def spoils(config, one, two):
    """Of a conversion whose result is spoiled in one key after the other: how many change a line of the report."""
    count = Counter()
    source, target = VENDORS[one], VENDORS[two]
    loops = source.load("to_neutral")(config)
    result = convert(config, source, target, {})
    for j, i in enumerate(result.source_loops):
        before = Loop.model_validate(loops[i].data)
        rows = [row for row in result.loops[i].changes if row.kind == "exact"]
        plain = target.load("to_neutral")(target.model.model_validate(result.data))[j].data
        whole = make_comparable(before, Loop.model_validate(plain))[1]
        for path, value, place in leaves(result.data["loops"][j]):
            if (other := spoiled(value)) is None:
                continue
            data = copy.deepcopy(result.data)
            set_value(data["loops"][j], place, other)
            try:
                after = target.load("to_neutral")(target.model.model_validate(data))[j]
                held = Loop.model_validate(after.data)
            except ValueError:
                count["refused by the schema"] += 1
                continue
            now = make_comparable(before, held)[1]
            about = {name for row in rows for name in row.neutral}
            if not any(whole.get(key) != now.get(key) and any(do_overlap(key, name) for name in about) for key in now):
                count["of no exact line"] += 1
                continue
            count["spoiled"] += 1
            found = any(row.kind != "exact" for row in correct_lines(rows, before, held))
            count["found"] += found
            if not found:
                count[f"left {two} {dotted_text(path)}"] += 1
    return count


if __name__ == "__main__":
    sums = Counter()
    what = spoils if len(sys.argv) > 2 else measured
    for one, two in PAIRS:
        sums.update(measure(one, two, int(sys.argv[1]), what))
    for key, value in sorted(sums.items(), key=lambda item: (" " in item[0], -item[1])):
        sys.stdout.write(f"{value:6} {key}\n")
