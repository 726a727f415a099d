"""What a reader of a loop sheet looks for first."""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING, Any

from pidcfg.encoders.words import DecodeError
from pidcfg.explanation.direction import PV_RISES
from pidcfg.paths import steps, value_at
from pidcfg.report.content import Fact
from pidcfg.report.roots import loop_words
from pidcfg.report.texts import SIDES, number, text
from pidcfg.schemas.iec import Wire
from pidcfg.schemas.units import unit_text

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from pidcfg.encoders.image import Encoding
    from pidcfg.report.content import Group, Setting
    from pidcfg.vendors import Vendor

FIRST = (
    ("Mode", "mode", "", ("mode",)),
    ("PV range", "pv.range", "pv", ("pv.range",)),
    ("Set point", "setpoint.value", "pv", ("setpoint.value", "SP", "SV")),
    ("Output range", "output.range", "output", ("output.range",)),
    ("Sample time", "sample_time", "s", ("sample_time", "sample_rate", "CYCLE")),
)
"""Each with the field of the neutral loop that says it, its unit, and the vendors' own keys, for a loop without one."""
PERIODS = ("output.pulse.cycle_time", "output.pulse.period", "output.pwm.period", "call.GPWM.cycle")
PULSED = ("output.pulse.tag", "output.pwm.bit", "call.GPWM.output")
"""The period of an output's pulses, and what is pulsed, by the vendors' own keys."""
PAIR = 2
FORMS = {True: "dependent: Ti and Td are times", False: "independent: Ki and Kd are gains"}
WIRED = "the program chooses it: "


def facts(
    vendor: Vendor, loop: Any, neutral: Mapping[str, Any], groups: Sequence[Group], stored: Mapping[str, str]
) -> Iterator[Fact]:
    """The facts of a loop; ``neutral``: its neutral form or nothing, ``stored``: what registers hold, as text."""
    units = {side: value_at(neutral, (side, "unit")) or "" for side in SIDES}
    settings = {setting.path: setting for group in groups for setting in group.settings}
    for title, path, unit, keys in FIRST:
        value = value_at(neutral, steps(path))
        setting = next((settings[key] for key in keys if key in settings), None)
        place = setting.place if setting is not None else ""
        if path in stored and setting is not None and setting.unit == "counts":
            yield Fact(title, stored[path], place)
        elif isinstance(value, str | int | float | list | tuple | Decimal):
            shown = " to ".join(map(brief, value)) if isinstance(value, list | tuple) else brief(value)
            yield Fact(title, f"{shown} {unit_text(unit, units)}".rstrip(), place)
        elif setting is not None:
            yield Fact(title, quantity(setting), place)
    if rises := direction(vendor, loop):
        key = vendor.load("explainer").direction.key
        yield Fact("Direction", rises, settings[key].place if key in settings else "")
    yield from tuning(vendor, loop, settings)
    yield from pulses(neutral, settings)


def direction(vendor: Vendor, loop: Any) -> str:
    """Where the PV goes when the output rises, by the loop's own word for its action; empty where nobody knows."""
    key, heating = vendor.load("explainer").direction.key, vendor.load("tuned").heating.rpartition(" ")[2]
    value = value_at(loop, steps(key))
    if isinstance(value, Wire):
        return f"{WIRED}{key} := {value.text}"
    if isinstance(value, bool | str):
        return PV_RISES[str(value).lower() == heating.lower()]
    return ""


def tuning(vendor: Vendor, loop: Any, settings: Mapping[str, Setting]) -> Iterator[Fact]:
    """The form of the equation, where a vendor has two, and the three terms."""
    tuned = vendor.load("tuned")
    form, dependent = getattr(tuned, "dependent", None), None
    value = None if form is None else value_at(loop, steps(form[0]))
    if form is not None and value is not None:
        dependent = value is form[1] if isinstance(value, bool) else None
        words = FORMS[dependent] if dependent is not None else f"{WIRED}{form[0]} := {text(value)[3:]}"
        yield Fact("Form", words, settings[form[0]].place if form[0] in settings else "")
    for path in map(tuned.key, tuned.names):
        if path in settings:
            names = path.split("_") if form is not None else [path]
            name = path if dependent is None else names[0 if dependent else -1]
            yield Fact(label(name), quantity(settings[path]), settings[path].place)


def pulses(neutral: Mapping[str, Any], settings: Mapping[str, Setting]) -> Iterator[Fact]:
    """The pulses of an output that a relay switches: period, shortest times, and duty cycle at the output's limits."""
    key = next((key for key in PERIODS if key in settings and not isinstance(settings[key].value, str | None)), None)
    if key is None:
        return
    period = settings[key]
    shortest = [(word, value_at(neutral, ("output", "pulse", f"min_{word}"))) for word in ("on", "off")]
    words = [f"{word} at least {brief(value)} s" for word, value in shortest if value]
    bit = next((settings[one].value for one in PULSED if one in settings), None)
    target = [f"on {text(bit)}"] if bit else []
    yield Fact("Pulses", ", ".join([f"every {quantity(period)}", *target, *words]), period.place)
    ends = [*map(float, value_at(neutral, steps("output.range")) or ())]
    limits = [*map(float, value_at(neutral, steps("output.limits")) or ends)]
    if len(ends) == len(limits) == PAIR and ends[0] != ends[1]:
        shares = [f"{100 * (limit - ends[0]) / (ends[1] - ends[0]):.3g}" for limit in limits]
        yield Fact("Duty cycle", f"{' to '.join(shares)} %", "")


def stored_setpoint(encoding: Encoding, loop: int, unit: str) -> dict[str, str]:
    """The set point that the register of a loop, by its number, holds, as the shortest value that is stored so."""
    path = "setpoint.value"
    for block, word, raw in loop_words(encoding, loop):
        scale = block.scales.get(str(getattr(word.codec, "scale", "")))
        if word.path == path and scale is not None and scale.range is not None:
            try:
                value = block.table.decode_word(word, raw, block.scales)
            except DecodeError:
                return {}
            return {path: f"{text(value)} {'' if value.counts else unit}".rstrip()}
    return {}


def brief(value: Any) -> str:
    """A value with at most ten digits, never with an exponent: what a sheet shows first must be what the PLC holds."""
    return number(float(f"{float(value):.10g}")) if isinstance(value, float | Decimal) else text(value)


def quantity(setting: Setting) -> str:
    """A value with its unit."""
    return f"{text(setting.value)} {setting.unit}".rstrip()


def label(path: str) -> str:
    """A key as a label: the manual's names stay, others become words."""
    last = path.removesuffix(".value").rpartition(".")[2]
    words = last.replace("_", " ")
    return words[:1].upper() + words[1:] if last.islower() else last
