"""Neutral loops as EZLogix ones: gains in counts per count, blocks from R1 and S1 upward, tags from IR1, OR1 and O1."""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING, Any

from pidcfg.conversion.arithmetic import ZERO, number, product, quotient, rescaled, width
from pidcfg.conversion.builder import Builder, chosen, given, starts
from pidcfg.conversion.ledger import Missing, Target
from pidcfg.conversion.pipeline import ConvertError
from pidcfg.conversion.to_neutral.ezlogix import ACTS_ON, FULL, RAISES, SETPOINT
from pidcfg.encoders.maps.ezlogix import BLOCKS
from pidcfg.encoders.values import present
from pidcfg.encoders.words import nearest
from pidcfg.refs import Decision
from pidcfg.schemas.base import decimal_text
from pidcfg.schemas.ezlogix import CV_FULL, DISCRETES, REGISTERS

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pidcfg.schemas.generic import GenericFile, Loop

D291 = Decision(
    291,
    "a converted PV is 0 to 4095 counts",
    "`pv.counts` of a converted loop is [0, 4095], unless --pv-counts says otherwise; the gain is worked out with it.",
    "No other controller tells how many counts the new input module makes, and the gain is in counts per count.",
)
BANKS = {"registers": REGISTERS, "discretes": DISCRETES}
ACTIONS = {raises: action for action, raises in RAISES.items()}
ALGORITHMS = {what: algorithm for algorithm, what in ACTS_ON.items()}


def from_neutral(file: GenericFile, options: Mapping[str, Any]) -> Target:
    """An EZLogix file with these loops."""
    count = len(file.loops)
    blocks = {key: starts(BANKS[key], table.size, count, options.get(key) or ()) for key, (_, table) in BLOCKS.items()}
    outputs = [entry and entry["tag"] for entry in options.get("output_tag") or ()]
    tags = {
        "pv": chosen(options.get("pv_tag") or (), count, "IR{}".format),
        "cv": chosen(options.get("cv_tag") or (), count, "OR{}".format),
        "pulse": chosen(outputs, count, "O{}".format),
    }
    counts = _pv_counts(options.get("pv_counts") or (), count)
    builders = []
    for i, loop in enumerate(file.loops):
        b = Builder()
        b.put("name", loop.name, "name")
        if loop.description is not None:
            b.put("description", loop.description, "description")
        for key, (prefix, _) in BLOCKS.items():
            b.put(key, f"{prefix}{blocks[key][i]}", None, "" if key in options else "the next free block")
        _loop(b, loop, counts[i], {key: names[i] for key, names in tags.items()})
        builders.append(b)
    wired = len(options.get("cv_tag") or ())
    _cascades(builders, file.loops, [int(start) for start in blocks["registers"]], counts, wired)
    data = {"pidcfg": 1, "vendor": "ezlogix"} | present({"name": file.name, "description": file.description})
    return Target({**data, "loops": [b.data for b in builders]}, [b.puts for b in builders])


def _pv_counts(said: list[tuple[int, int]] | tuple[()], count: int) -> list[tuple[int, int]]:
    """The counts of each loop's PV: one pair for all, or one of each (D291)."""
    if len(said) not in {0, 1, count}:
        raise ConvertError([Missing(("loops",), "loops", f"{len(said)} ranges of counts for {count} loops")])
    return list(said) if len(said) == count else [said[0] if said else (0, CV_FULL)] * count


def _loop(b: Builder, loop: Loop, counts: tuple[int, int], tags: Mapping[str, str]) -> None:
    b.put("mode", "manual" if loop.mode == "manual" else "auto", "mode")
    _algorithm(b, loop)
    b.put("action", ACTIONS[loop.output_raises_pv], "output_raises_pv")
    b.put("sample_rate", number(loop.sample_time), "sample_time")
    _tuning(b, loop, Decimal(counts[1] - counts[0]))
    _pv(b, loop, counts, tags["pv"])
    if loop.setpoint.value is not None:
        b.put("setpoint.value", number(loop.setpoint.value), "setpoint.value")
    if loop.setpoint.limits is not None:
        _pair(b, "setpoint.limits", loop.setpoint.limits)
    if loop.setpoint.follows_pv:
        b.drop("setpoint.follows_pv", "copy the PV into the set point in the program while the loop is in Manual")
    _output(b, loop, tags)
    if loop.deadband:
        b.put("deadband", number(loop.deadband), "deadband")
    b.put("anti_windup", loop.anti_windup, "anti_windup")
    _alarms(b, loop, counts, tags["pv"])


def _pair(b: Builder, path: str, ends: tuple[Decimal, Decimal]) -> None:
    """Both limits, each of which may be rounded or clamped."""
    section, key = path.split(".")
    b.data.setdefault(section, {})[key] = [number(end) for end in ends]
    for i in range(2):
        b.mark(f"{path}.{i}", f"{path}.{i}")


# --- equation --------------------------------------------------------------------------------------------------------


def _algorithm(b: Builder, loop: Loop) -> None:
    tuning = loop.tuning
    if tuning.derivative_time or given(loop, "tuning", "derivative_on"):
        b.put("algorithm", ALGORITHMS[tuning.derivative_on], "tuning.derivative_on")
    else:
        b.put("algorithm", "position", None, "without a derivative both algorithms are the same")
    if tuning.derivative_filter and tuning.derivative_time:
        b.drop("tuning.derivative_filter", "filter the PV in the program: the derivative has no filter")
    elif tuning.derivative_filter:
        b.drop("tuning.derivative_filter", "there is no derivative to be filtered")


def _tuning(b: Builder, loop: Loop, span: Decimal) -> None:
    tuning = loop.tuning
    per_share = quotient(product(tuning.gain, width(loop.pv.range)), width(loop.output.range))
    gain, integral, derivative = quotient(product(per_share, FULL), span), tuning.integral_time, tuning.derivative_time
    if not gain:
        b.put(
            "tuning.proportional_gain",
            0,
            "tuning.gain",
            "gain 0 switches the proportional term off only: the times are off as well",
        )
        integral = derivative = ZERO
    elif tuning.proportional:
        b.put("tuning.proportional_gain", number(gain), "tuning.gain", "counts per count")
    else:
        b.put("tuning.proportional_gain", 0, "tuning.proportional")
        integral, derivative = quotient(integral, gain), product(derivative, gain)
        note = "gain 0 counts as 1 for the other terms: the gain is in the times"
        b.mark("tuning.integral_time" if integral else "tuning.derivative_time", "tuning.gain", note)
    b.put("tuning.integral_time", number(integral), "tuning.integral_time")
    b.put("tuning.derivative_time", number(derivative), "tuning.derivative_time")


# --- PV and output ---------------------------------------------------------------------------------------------------


def _pv(b: Builder, loop: Loop, counts: tuple[int, int], tag: str) -> None:
    pv = loop.pv
    b.put("pv.tag", tag, None, "where the PV stands")
    b.put("pv.range", [number(end) for end in pv.range], "pv.range")
    if pv.unit is not None:
        b.put("pv.unit", pv.unit, "pv.unit")
    b.put("pv.counts", [*counts], None, "counts of the input at both ends of the range: the gain depends on them")
    if pv.square_root:
        b.put("pv.square_root", pv.square_root, "pv.square_root")
    if pv.filter:
        time = f"{pv.filter:.4g}"
        b.drop(
            "pv.filter",
            f"filter {tag} in the program with a time constant of {time} s; the R register with the "
            "result becomes the PV's tag",
        )


def _output(b: Builder, loop: Loop, tags: Mapping[str, str]) -> None:
    output, full = loop.output, (ZERO, FULL)
    b.put("output.tag", tags["cv"], None, "where the CV goes")
    b.put("output.range", [number(end) for end in output.range], "output.range")
    if output.unit is not None:
        b.put("output.unit", output.unit, "output.unit")
    if output.limits is not None:
        _pair(b, "output.limits", output.limits)
    if given(loop, "output", "bias"):
        b.put("output.offset", number(output.bias), "output.bias")
    if output.manual is not None:
        counts = nearest(rescaled(output.manual, output.range, full))
        if counts:
            b.drop("output.manual", f"write {counts} counts into {tags['cv']} while the loop is in Manual")
        else:
            b.mark("output.tag", "output.manual", "a loop starts with 0 counts")
    if output.max_rate is not None:
        b.drop("output.max_rate", "limit the change of the output in the program, between the CV and its output")
    if output.pulse is not None:
        b.put("output.pulse.tag", tags["pulse"], None, "the discrete output")
        for key, of in (("cycle_time", "period"), ("min_on", "min_on"), ("min_off", "min_off")):
            time = getattr(output.pulse, of)
            if time or key == "cycle_time":
                b.put(f"output.pulse.{key}", number(time), f"output.pulse.{of}")


def _alarms(b: Builder, loop: Loop, counts: tuple[int, int], tag: str) -> None:
    """There are none: what the program compares instead."""
    alarms = loop.alarms
    for key, point in dict(alarms.pv).items():
        if point is not None:
            what = "above" if key.startswith("high") else "below"
            b.drop(f"alarms.pv.{key}", f"compare {tag} in the program: {what} {_raw(loop, point, counts)} counts")
    for key, point in dict(alarms.deviation).items():
        if point is not None:
            b.drop(f"alarms.deviation.{key}", f"compare the error in the program: beyond {decimal_text(point)}")
    if alarms.rate_of_change is not None:
        b.drop("alarms.rate_of_change", f"compare {tag} with what it was a sample before in the program")
    if alarms.hysteresis:
        b.drop("alarms.hysteresis", "switch alarms off in the program when the PV is back by as much")


def _raw(loop: Loop, point: Decimal, counts: tuple[int, int]) -> int:
    """A PV in counts of its register, which with the square root holds the square."""
    share = quotient(point - loop.pv.range[0], width(loop.pv.range))
    if loop.pv.square_root:
        return nearest(product(share, share, Decimal(counts[1] - counts[0])))
    return nearest(rescaled(point, loop.pv.range, (Decimal(counts[0]), Decimal(counts[1]))))


# --- cascade ---------------------------------------------------------------------------------------------------------


def _cascades(
    builders: list[Builder], loops: tuple[Loop, ...], registers: list[int], counts: list[tuple[int, int]], wired: int
) -> None:
    """Set points that are another loop's output: its CV tag becomes their register (D290)."""
    names = {loop.name: i for i, loop in enumerate(loops)}
    taken = set(range(wired))
    for i, loop in enumerate(loops):
        source = loop.setpoint.source
        if source is None:
            continue
        register, outer = f"{REGISTERS.prefix}{registers[i] + SETPOINT}", names.get(source)
        if outer is None or outer in taken or loop.pv.square_root or counts[i] != (0, CV_FULL):
            builders[i].drop("setpoint.source", f"scale the CV of {source} in the program and write it to {register}")
            continue
        taken.add(outer)
        tag = builders[outer].puts.index(next(put for put in builders[outer].puts if put.field == "output.tag"))
        del builders[outer].puts[tag]
        builders[outer].put("output.tag", register, None, f"the set point of {loop.name}")
        builders[i].mark("registers", "setpoint.source", f"{register} is the CV tag of {source}")
