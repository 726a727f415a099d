"""What of a process is uncertain, and the plants that stand for it: all combinations of the ends, and samples."""

from __future__ import annotations

import random
import re
from dataclasses import dataclass, replace
from itertools import product
from math import isfinite
from typing import TYPE_CHECKING, NoReturn

from pidcfg.refs import Decision
from pidcfg.tuning.rules import TuningError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.tuning.rules import Process

D851 = Decision(
    851,
    "the plants that robust gains are for",
    "The process as given, all combinations of the ends of what varies, and 200 samples that lie uniformly and "
    "independently between them, by a fixed seed. Ms is below its limit, and the IAE at most the one that is told, "
    "for each of these plants; for others in between nothing is proved.",
    "Ends alone need not be the worst case of a sampled loop, and a continuum cannot be tried.",
)
D852 = Decision(
    852,
    "robust gains are those with the least IAE on the worst plant",
    "Of all gains with which Ms stays below its limit on every plant, those whose largest IAE after a step at the "
    "output is least. A gain counts only where Ms stays below its limit by the phase of the loop as it is: what is "
    "beyond -180° may not be louder than the limit allows. Ti/Kp, which is often taken instead, is the IAE only where "
    "the error does not change its sign: gain 2, 60 s ± 20 %, 8 s with gain ±30 % and dead time 80 to 130 %, sampled "
    "every second, has its least Ti/Kp at Kp 0.65, Ti 26 s, and there 4 % more IAE than with Kp 0.74, Ti 31.4 s.",
    "A promise for every plant is about the worst of them. `tests/test_robust.py` compares with all words.",
)
SAMPLES, SEED = 200, 1
NAMES = ("gain", "time_constant", "second_time_constant", "dead_time")
WHOLE = 100.0
NUMBER = r"[0-9]+(?:\.[0-9]*)?|\.[0-9]+"
AROUND = re.compile(rf"(?:±|\+-|\+/-) ?({NUMBER}) ?%")
SHARES = re.compile(rf"({NUMBER}) ?% ?\.\. ?({NUMBER}) ?%")
ENDS = re.compile(rf"(-?(?:{NUMBER})) ?\.\. ?(-?(?:{NUMBER}))")
FORMS = "write ±30%, 80%..130% (of the process's number), or both ends as numbers: 6..10"


@dataclass(frozen=True, slots=True)
class Spread:
    """A number of the process and its ends, which are amounts: a gain counts without its sign."""

    name: str
    low: float
    high: float


def read_spreads(text: str, process: Process, *, negative: bool = False) -> list[Spread]:
    """``gain=±30%,dead-time=80%..130%`` for a process; raises `TuningError` for what makes no sense.

    ``negative``: the process's gain is, so that the ends of a gain are written with their sign.
    """
    found: dict[str, Spread] = {}
    for part in text.split(","):
        name, sign, value = (word.strip() for word in part.partition("="))
        key = name.replace("-", "_")
        if not sign:
            raise TuningError(f"vary: {part.strip()!r} has no =; write it like gain=±30%,dead-time=80%..130%")
        if key not in NAMES:
            raise TuningError(f"vary: there is no {name!r}; gain, time-constant, second-time-constant, dead-time vary")
        if key in found:
            raise TuningError(f"vary: {name} stands there twice")
        low, high = _ends(name, value, getattr(process, key))
        if key == "gain" and negative and "%" not in value:
            low, high = -high, -low
        found[key] = spread_of(key, low, high, process)
    return list(found.values())


def _ends(name: str, text: str, stands: float) -> tuple[float, float]:
    """Both ends of one number as they are written."""
    if match := AROUND.fullmatch(text):
        share = float(match[1]) / WHOLE
        return stands * (1 - share), stands * (1 + share)
    if match := SHARES.fullmatch(text):
        return stands * float(match[1]) / WHOLE, stands * float(match[2]) / WHOLE
    if match := ENDS.fullmatch(text):
        return float(match[1]), float(match[2])
    raise TuningError(f"vary: {name}={text!r} does not say how far it varies; {FORMS}")


def spread_of(key: str, low: float, high: float, process: Process) -> Spread:
    """A spread that the process lies in; raises `TuningError` for one that no process has."""
    name, stands = key.replace("_", "-"), getattr(process, key)
    if not stands or (key == "time_constant" and process.integrating):
        _refuse(name, "varies, and the process has none")
    if not (isfinite(low) and isfinite(high)):
        _refuse(name, "goes beyond what a number holds")
    if low <= 0:
        sign = ", in the direction of the process's gain" if key == "gain" else ""
        _refuse(name, f"from {low:g} to {high:g} must stay above 0{sign}")
    if low >= high:
        _refuse(name, f"from {low:g} to {high:g} does not ascend; write the lower end first")
    if not low <= stands * (1 + 1e-9) or not stands <= high * (1 + 1e-9):
        _refuse(name, f"from {low:g} to {high:g} leaves out the process's own {stands:g}")
    return Spread(key, low, high)


def _refuse(name: str, why: str) -> NoReturn:
    raise TuningError(f"vary: {name} {why}")


def plants_of(process: Process, spreads: Sequence[Spread], samples: int = SAMPLES) -> list[Process]:
    """The process, then all combinations of ends, then samples; each once."""
    rows = list(product(*((spread.low, spread.high) for spread in spreads)))
    draw = random.Random(SEED)  # noqa: S311 - the same plants each time are what is wanted
    rows += [
        tuple(spread.low + (spread.high - spread.low) * draw.random() for spread in spreads)
        for _ in range(samples if spreads else 0)
    ]
    names = [spread.name for spread in spreads]
    plants = (replace(process, **dict(zip(names, row, strict=True))) for row in rows)  # type: ignore[arg-type]  # floats
    return list(dict.fromkeys([process, *plants]))
