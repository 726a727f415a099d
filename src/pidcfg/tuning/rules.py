"""Tuning rules of the manuals and of the literature by name, and the plants that stand for an uncertain process."""

from __future__ import annotations

import random
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import product
from math import inf, isfinite
from typing import Any, Literal, NoReturn

from pidcfg.text.frozen import frozen
from pidcfg.text.references import NEXTOPID, Basis, Decision
from pidcfg.tuning import (
    GENTLE_CLOSED,
    NEXTOPID_CLOSED,
    TYREUS_LUYBEN,
    ZIEGLER_NICHOLS_CLOSED,
    ZIEGLER_NICHOLS_OPEN,
    Form,
    Row,
)

# ----------------------------------------------------------------------------------------------------------------------
# The manuals' tuning rules as tables and formulas; results are in the dependent form, in engineering units and s.
# A process is a lag with dead time, with a second lag, or an integrator. Coefficients of the ultimate cycle and of the
# reaction curve stand in `pidcfg.tuning`.

Model = Literal["first-order", "second-order", "integrating"]

D90 = Decision(
    90,
    "the reaction curve's coefficients are Ziegler and Nichols's",
    "P: 1/(R L); PI: 0.9/(R L), 3.33 L; PID: 1.2/(R L), 2 L, 0.5 L, with the steepest slope R of a unit step and the "
    "dead time L.",
    "DL06 and EZLogix name the method; the figure with the formulas is lost.",
)
D91 = Decision(
    91,
    "zn-closed is the textbook's, dl06-autotune what the virtual DL06 does",
    "zn-closed: P 0.5 Ku; PI 0.45 Ku, Pu/1.2; PID 0.6 Ku, Pu/2, Pu/8. dl06-autotune: PI 0.30 Ku, Pu; PID 0.45 Ku, "
    "0.60 Pu, 0.10 Pu; P 0.30 Ku.",
    "A rule by a known name must give the known numbers; the DL06's own table is lost, and the gentler one is what "
    "the family is known to use; the virtual CLICK's relay takes it too.",
)
D92 = Decision(
    92,
    "table 17-2's PID gain is 1.086",
    "The coefficient of the PID gain for set-point changes is 1.086, not 1.435.",
    "The manual's own example (Gs 2, Tc 10, Tde 1, 0.1 s: Kp 3.85, Ti 13.77, Td 0.44) only follows with 1.086, as the "
    "rule was published by Rovira in 1969; 1.435 stands in table 17-1.",
)
D93 = Decision(
    93,
    "NextoPID's auto-tune rule",
    "PID: Ku/3.2, 2.2 Pu, Pu/6.3; PI: Ku/3.2, 2.2 Pu; P: 0.5 Ku. The textbook's Tyreus-Luyben has Ku/2.2 for PID.",
    "The rule is not given; the worked example of the manual agrees with these numbers.",
)


MIN_NUMBER, MAX_NUMBER = 1e-9, 1e12
"""Of a gain, or of a time in s: nothing that is tuned has others, and beyond them a float makes no margins."""


class TuningError(ValueError):
    """Numbers, or a recorded step, from which a rule makes no gains."""

    is_question = False
    """Whether only who knows the plant can say what is meant."""


def is_usable(number: float) -> bool:
    """Whether the size of a gain or time is one of a process."""
    return MIN_NUMBER <= abs(number) <= MAX_NUMBER


@frozen
class Process:
    """A process: static gain in PV units per unit of the output, time constant, dead time, and the loop around it.

    ``closed_loop`` is the time constant that is wanted in closed loop; ``sample_time`` acts like half of it in dead
    time where a rule says so. An integrating process has the slope as gain, per s, and 1 s as time constant, so that
    gain over time constant is the slope of both kinds. All times in s.
    """

    gain: float
    time_constant: float
    dead_time: float
    sample_time: float = 0.0
    closed_loop: float = 0.0
    second_time_constant: float = 0.0
    integrating: bool = False

    @property
    def delay(self) -> float:
        """Dead time and half the sample time."""
        return self.dead_time + self.sample_time / 2

    @property
    def slope(self) -> float:
        """How steeply the PV begins to rise, per s and unit of the output."""
        return self.gain / self.time_constant

    @property
    def model(self) -> Model:
        """Its kind."""
        return "integrating" if self.integrating else "second-order" if self.second_time_constant else "first-order"


@frozen
class Cycle:
    """The ultimate cycle: the gain at which a P controller just keeps swinging, and its period in s."""

    gain: float
    period: float


@frozen
class Gains:
    """A controller in the dependent form: gain, integral and derivative time in s; infinite: no integral term."""

    gain: float
    integral_time: float
    derivative_time: float

    @property
    def ki(self) -> float:
        """Integral gain of the independent form, per s."""
        return self.gain / self.integral_time

    @property
    def kd(self) -> float:
        """Derivative gain of the independent form, in s."""
        return self.gain * self.derivative_time


IAE_DISTURBANCE: dict[Form, tuple[float, ...]] = {
    "P": (0.902, -0.985),
    "PI": (0.984, -0.985, 0.608, 0.707),
    "PID": (1.435, -0.921, 0.878, 0.749, 0.482, 1.137),
}
"""Table 17-1: factor and power of Pu, for gain, integral time (Tc over the factor) and derivative time."""
IAE_SETPOINT: dict[Form, tuple[float, ...]] = {
    "PI": (0.758, -0.861, 1.02, 0.323),
    "PID": (1.086, -0.869, 0.74, 0.13, 0.348, 0.914),
}
"""Table 17-2, the PID's gain corrected (D92); the integral time is Tc / (a - b Pu)."""


def rule_of_cycle(table: dict[Form, Row]) -> Callable[[Form, Cycle], Gains]:
    """A rule of multiples of the ultimate cycle."""

    def gains(form: Form, cycle: Cycle) -> Gains:
        gain, integral, derivative = table[form]
        return Gains(gain * cycle.gain, integral * cycle.period, derivative * cycle.period)

    return gains


def reaction_curve(form: Form, process: Process) -> Gains:
    """Ziegler-Nichols, open loop: a first-order lag rises with Gs/Tc at its steepest."""
    gain, integral, derivative = ZIEGLER_NICHOLS_OPEN[form]
    dead = process.dead_time
    return Gains(gain / (process.slope * dead), integral * dead, derivative * dead)


def synthesis(form: Form, process: Process) -> Gains:
    """The closed loop becomes a lag of the time constant that is asked for."""
    gain = process.time_constant / (process.gain * (process.closed_loop + process.delay))
    return Gains(gain, process.time_constant, process.delay / 2 if form == "PID" else 0.0)


def least_error_after_disturbances(table: Mapping[Form, tuple[float, ...]]) -> Callable[[Form, Process], Gains]:
    """A rule of factors and powers of dead time over time constant."""

    def gains(form: Form, process: Process) -> Gains:
        row, pu = table[form], process.delay / process.time_constant
        integral = process.time_constant / row[2] * pu ** row[3] if len(row) > 2 else inf
        derivative = row[4] * process.time_constant * pu ** row[5] if form == "PID" else 0.0
        return Gains(row[0] / process.gain * pu ** row[1], integral, derivative)

    return gains


def least_error_after_setpoint_steps(table: Mapping[Form, tuple[float, ...]]) -> Callable[[Form, Process], Gains]:
    """A rule of factors and powers whose integral time is Tc / (a - b Pu)."""

    def gains(form: Form, process: Process) -> Gains:
        row, pu = table[form], process.delay / process.time_constant
        denominator = row[2] - row[3] * pu
        if denominator <= 0:
            limit = row[2] / row[3]
            raise ValueError(f"the rule has no integral time where dead time / time constant is above {limit:.3g}")
        derivative = row[4] * process.time_constant * pu ** row[5] if form == "PID" else 0.0
        return Gains(row[0] / process.gain * pu ** row[1], process.time_constant / denominator, derivative)

    return gains


# --- Tuning rules of the literature; results are in the dependent form, gains in output per PV unit, times in s -------
#
# Everywhere the dead time is that of the process and half the sample time (`Process.delay`). A rule that has a
# formula for processes that integrate, or for two lags, has it here; for the others two lags become one by the half
# rule.

D700 = Decision(
    700,
    "SIMC as published, and its improved form",
    "Kc = T/(K (c + L)), Ti = min(T, 4 (c + L)), in series with Td = the second time constant; an integrator has "
    "1/(K' (c + L)) and 4 (c + L). c is --closed-loop, or the dead time. simc-improved: PI with T + L/3 for T, PID in "
    "series with Td = L/3. The series form is converted to the dependent one. A first-order process has no PID by "
    "SIMC.",
    "Skogestad, J. Process Control 13 (2003) 291; improved: Grimholt and Skogestad, IFAC PID 2012 and J. Process "
    "Control 70 (2018) 36.",
)
D701 = Decision(
    701,
    "lambda as published",
    "PI: T/(K (c + L)), T; PID: (T + L/2)/(K (c + L/2)), T + L/2, T L/(2 T + L); an integrator: "
    "(2 c + L)/(K' (c + L)²), 2 c + L. c is --closed-loop; without it three times the larger of T and L, of an "
    "integrator three times L.",
    "Dahlin 1968; Åström and Hägglund, Advanced PID Control (2006), 7.3: a lambda of three time constants is robust.",
)
D702 = Decision(
    702,
    "AMIGO as published",
    "PI: (0.15 + (0.35 - L T/(L + T)²) T/L)/K, 0.35 L + 13 L T²/(T² + 12 L T + 7 L²); PID: (0.2 + 0.45 T/L)/K, "
    "L (0.4 L + 0.8 T)/(L + 0.1 T), 0.5 L T/(0.3 L + T); an integrator: PI 0.35/(K' L), 13.4 L; PID 0.45/(K' L), 8 L, "
    "0.5 L.",
    "Åström and Hägglund, J. Process Control 14 (2004) 635, and Advanced PID Control (2006), 7.4.",
)
D703 = Decision(
    703,
    "Cohen-Coon as published",
    "With r = L/T: P (1 + r/3)/(K r); PI (0.9 + r/12)/(K r), L (30 + 3 r)/(9 + 20 r); PID (4/3 + r/4)/(K r), "
    "L (32 + 6 r)/(13 + 8 r), 4 L/(11 + 2 r).",
    "Cohen and Coon, Trans. ASME 75 (1953) 827.",
)
D704 = Decision(
    704,
    "CHR is the rule for set points without overshoot",
    "`chr`: P 0.3, PI 0.35 and 1.2 T, PID 0.6, T and 0.5 L; `chr-20` (20 % overshoot): 0.7; 0.6 and T; 0.95, 1.4 T and "
    "0.47 L; `chr-disturbance`: 0.3; 0.6 and 4 L; 0.95, 2.4 L and 0.42 L; `chr-disturbance-20`: 0.7; 0.7 and 2.3 L; "
    "1.2, 2 L and 0.42 L; the gains are multiples of T/(K L).",
    "Chien, Hrones and Reswick, Trans. ASME 74 (1952) 175; a rule by one name must mean the careful one.",
)
D705 = Decision(
    705,
    "least ITAE as published",
    "Disturbances: P 0.490 r^-1.084; PI 0.859 r^-0.977, T/0.674 r^0.680; PID 1.357 r^-0.947, T/0.842 r^0.738, "
    "0.381 T r^0.995. Set points: PI 0.586 r^-0.916, T/(1.03 - 0.165 r); PID 0.965 r^-0.855, T/(0.796 - 0.147 r), "
    "0.308 T r^0.929; gains over K, r = L/T.",
    "Lopez et al., Instrum. Technol. 14 (1967) 57; Rovira, Murrill and Smith, Instrum. Control Syst. 42 (1969) 67.",
)

CHR: dict[str, dict[Form, tuple[float, float, float, float]]] = {
    "chr": {"P": (0.3, inf, 0, 0), "PI": (0.35, 1.2, 0, 0), "PID": (0.6, 1.0, 0, 0.5)},
    "chr-20": {"P": (0.7, inf, 0, 0), "PI": (0.6, 1.0, 0, 0), "PID": (0.95, 1.4, 0, 0.47)},
    "chr-disturbance": {"P": (0.3, inf, 0, 0), "PI": (0.6, 0, 4.0, 0), "PID": (0.95, 0, 2.4, 0.42)},
    "chr-disturbance-20": {"P": (0.7, inf, 0, 0), "PI": (0.7, 0, 2.3, 0), "PID": (1.2, 0, 2.0, 0.42)},
}
"""Gain over T/(K L); the integral time as multiples of T and of L; the derivative time of L."""
ITAE_DISTURBANCE: dict[Form, tuple[float, ...]] = {
    "P": (0.490, -1.084),
    "PI": (0.859, -0.977, 0.674, 0.680),
    "PID": (1.357, -0.947, 0.842, 0.738, 0.381, 0.995),
}
ITAE_SETPOINT: dict[Form, tuple[float, ...]] = {
    "PI": (0.586, -0.916, 1.03, 0.165),
    "PID": (0.965, -0.855, 0.796, 0.147, 0.308, 0.929),
}
LAMBDA_FACTOR = 3
"""So many times the larger of time constant and dead time, where no closed loop is asked for."""


def to_dependent_form(gain: float, integral_time: float, derivative_time: float) -> Gains:
    """A series (interacting) controller in the dependent form; its derivative time is at most a quarter of Ti there."""
    factor = 1 + derivative_time / integral_time
    return Gains(gain * factor, integral_time * factor, derivative_time / factor)


def closed_loop_time(process: Process) -> float:
    """The closed-loop time constant of SIMC: the one asked for, or the dead time for tight and still smooth control."""
    return process.closed_loop or process.delay


def _simc_gains(process: Process, constant: float, derivative_time: float) -> Gains:
    total = closed_loop_time(process) + process.delay
    gain = 1 / (process.gain * total) if process.integrating else constant / (process.gain * total)
    integral = 4 * total if process.integrating else min(constant, 4 * total)
    return to_dependent_form(gain, integral, derivative_time)


def simc(form: Form, process: Process) -> Gains:
    """Skogestad's rule: PI of a first-order process or an integrator, PID of two lags; else raises `ValueError`."""
    if form == "PID" and not process.second_time_constant:
        raise ValueError("the rule has a derivative for a second time constant only; use PI, or simc-improved")
    return _simc_gains(process, process.time_constant, process.second_time_constant if form == "PID" else 0.0)


def simc_improved(form: Form, process: Process) -> Gains:
    """The rule with a third of the dead time more: in the integral time of PI, or as derivative time of PID."""
    third = process.delay / 3
    if form == "PID":
        return _simc_gains(process, process.time_constant, third)
    return _simc_gains(process, process.time_constant + third, 0.0)


def lambda_rule(form: Form, process: Process) -> Gains:
    """The closed loop becomes a lag of the time constant that is asked for."""
    dead, constant = process.delay, process.time_constant
    slowest = dead if process.integrating else max(constant, dead)
    closed_loop = process.closed_loop or LAMBDA_FACTOR * slowest
    if process.integrating:
        if form == "PID":
            raise ValueError("the rule has PI only for a process that integrates")
        return Gains((2 * closed_loop + dead) / (process.gain * (closed_loop + dead) ** 2), 2 * closed_loop + dead, 0.0)
    if form == "PI":
        return Gains(constant / (process.gain * (closed_loop + dead)), constant, 0.0)
    integral = constant + dead / 2
    return Gains(
        integral / (process.gain * (closed_loop + dead / 2)), integral, constant * dead / (2 * constant + dead)
    )


def amigo(form: Form, process: Process) -> Gains:
    """Åström and Hägglund's rule for a maximum sensitivity of about 1.4."""
    dead, constant, gain = process.delay, process.time_constant, process.gain
    if process.integrating:
        row = (0.45, 8.0, 0.5) if form == "PID" else (0.35, 13.4, 0.0)
        return Gains(row[0] / (gain * dead), row[1] * dead, row[2] * dead)
    if form == "PID":
        integral = dead * (0.4 * dead + 0.8 * constant) / (dead + 0.1 * constant)
        derivative = 0.5 * dead * constant / (0.3 * dead + constant)
        return Gains((0.2 + 0.45 * constant / dead) / gain, integral, derivative)
    part = 0.35 - dead * constant / (dead + constant) ** 2
    integral = 0.35 * dead + 13 * dead * constant**2 / (constant**2 + 12 * dead * constant + 7 * dead**2)
    return Gains((0.15 + part * constant / dead) / gain, integral, 0.0)


def cohen_coon(form: Form, process: Process) -> Gains:
    """A decay to a quarter, with the dead time taken into account."""
    dead, ratio = process.delay, process.delay / process.time_constant
    unit = 1 / (process.gain * ratio)
    if form == "P":
        return Gains(unit * (1 + ratio / 3), inf, 0.0)
    if form == "PI":
        return Gains(unit * (0.9 + ratio / 12), dead * (30 + 3 * ratio) / (9 + 20 * ratio), 0.0)
    integral = dead * (32 + 6 * ratio) / (13 + 8 * ratio)
    return Gains(unit * (4 / 3 + ratio / 4), integral, 4 * dead / (11 + 2 * ratio))


def chien_hrones_reswick(name: str) -> Callable[[Form, Process], Gains]:
    """One of the four rules, for set points or disturbances, without overshoot or with 20 %."""

    def gains(form: Form, process: Process) -> Gains:
        gain, of_constant, of_dead, derivative = CHR[name][form]
        dead = process.delay
        integral = of_constant * process.time_constant + of_dead * dead
        return Gains(gain / (process.slope * dead), integral, derivative * dead)

    return gains


# --- What of a process is uncertain, and the plants that stand for it: all combinations of the ends, and samples ------

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
DEFAULT_SAMPLES, SEED = 200, 1
VARIED_NUMBERS = ("gain", "time_constant", "second_time_constant", "dead_time")
PERCENT = 100.0
NUMBER_PATTERN = r"[0-9]+(?:\.[0-9]*)?|\.[0-9]+"
PLUS_MINUS_PATTERN = re.compile(rf"(?:±|\+-|\+/-) ?({NUMBER_PATTERN}) ?%")
PERCENT_RANGE_PATTERN = re.compile(rf"({NUMBER_PATTERN}) ?% ?\.\. ?({NUMBER_PATTERN}) ?%")
NUMBER_RANGE_PATTERN = re.compile(rf"(-?(?:{NUMBER_PATTERN})) ?\.\. ?(-?(?:{NUMBER_PATTERN}))")
SPREAD_FORMS = "write ±30%, 80%..130% (of the process's number), or both ends as numbers: 6..10"


@frozen
class Spread:
    """A number of the process and its ends, which are amounts: a gain counts without its sign."""

    name: str
    low: float
    high: float


def read_spreads(text: str, process: Process, *, negative: bool = False) -> list[Spread]:
    """``gain=±30%,dead-time=80%..130%`` for a process; raises `TuningError` for what makes no sense.

    ``negative``: the process's gain is, so that the ends of a gain are written with their sign.
    """
    spreads: dict[str, Spread] = {}
    for part in text.split(","):
        name, sign, value = (word.strip() for word in part.partition("="))
        key = name.replace("-", "_")
        if not sign:
            raise TuningError(f"vary: {part.strip()!r} has no =; write it like gain=±30%,dead-time=80%..130%")
        if key not in VARIED_NUMBERS:
            raise TuningError(f"vary: there is no {name!r}; gain, time-constant, second-time-constant, dead-time vary")
        if key in spreads:
            raise TuningError(f"vary: {name} stands there twice")
        low, high = _read_ends(name, value, getattr(process, key))
        if key == "gain" and negative and "%" not in value:
            low, high = -high, -low
        spreads[key] = spread_of(key, low, high, process)
    return list(spreads.values())


def _read_ends(name: str, text: str, nominal: float) -> tuple[float, float]:
    """Both ends of one number as they are written."""
    if match := PLUS_MINUS_PATTERN.fullmatch(text):
        share = float(match[1]) / PERCENT
        return nominal * (1 - share), nominal * (1 + share)
    if match := PERCENT_RANGE_PATTERN.fullmatch(text):
        return nominal * float(match[1]) / PERCENT, nominal * float(match[2]) / PERCENT
    if match := NUMBER_RANGE_PATTERN.fullmatch(text):
        return float(match[1]), float(match[2])
    raise TuningError(f"vary: {name}={text!r} does not say how far it varies; {SPREAD_FORMS}")


def spread_of(key: str, low: float, high: float, process: Process) -> Spread:
    """A spread that the process lies in; raises `TuningError` for one that no process has."""
    name, nominal = key.replace("_", "-"), getattr(process, key)
    if not nominal or (key == "time_constant" and process.integrating):
        _refuse_spread(name, "varies, and the process has none")
    if not (isfinite(low) and isfinite(high)):
        _refuse_spread(name, "goes beyond what a number holds")
    if low <= 0:
        sign = ", in the direction of the process's gain" if key == "gain" else ""
        _refuse_spread(name, f"from {low:g} to {high:g} must stay above 0{sign}")
    if low >= high:
        _refuse_spread(name, f"from {low:g} to {high:g} does not ascend; write the lower end first")
    if not low <= nominal * (1 + 1e-9) or not nominal <= high * (1 + 1e-9):
        _refuse_spread(name, f"from {low:g} to {high:g} leaves out the process's own {nominal:g}")
    return Spread(key, low, high)


def _refuse_spread(name: str, why: str) -> NoReturn:
    raise TuningError(f"vary: {name} {why}")


def plants_of(process: Process, spreads: Sequence[Spread], samples: int = DEFAULT_SAMPLES) -> list[Process]:
    """The process, then all combinations of ends, then samples; each once."""
    rows = list(product(*((spread.low, spread.high) for spread in spreads)))
    draw = random.Random(SEED)  # noqa: S311 - the same plants each time are what is wanted
    rows += [
        tuple(spread.low + (spread.high - spread.low) * draw.random() for spread in spreads)
        for _ in range(samples if spreads else 0)
    ]
    names = [spread.name for spread in spreads]
    changes: list[dict[str, Any]] = [dict(zip(names, row, strict=True)) for row in rows]
    return list(dict.fromkeys([process, *(replace(process, **change) for change in changes)]))


# --- The tuning rules by name: what each takes, the controllers and processes that it is for, and where it holds ------

D706 = Decision(
    706,
    "where a rule holds",
    "Dead time (with half the sample time) over time constant: 0.1 to 1 for the reaction curve, Cohen-Coon, least IAE "
    "and ITAE; 0.11 to 1 for CHR. SIMC, lambda and the synthesis aim at a closed loop that is not faster than the dead "
    "time. AMIGO and the rules of the ultimate cycle have no limits. Outside, and where Ms is above 2.5, the gains are "
    "given with a warning.",
    "The ranges that the authors fitted or recommended their rules for, as O'Dwyer, Handbook of PI and PID Controller "
    "Tuning Rules (2009) lists them; the least-error rules give absurd gains below them.",
)

FITTED_RATIO = (0.1, 1.0)
"""Of dead time over time constant: the range for which most rules were fitted."""
ROUNDING_TOLERANCE = 1e-9


@frozen
class Method:
    """A rule: its name and inputs, the controllers and processes that it is for, and its formulas."""

    name: str
    title: str
    basis: Basis
    forms: tuple[Form, ...]
    of_process: Callable[[Form, Process], Gains] | None = None
    of_ultimate: Callable[[Form, Cycle], Gains] | None = None
    needs: tuple[str, ...] = ()
    """Numbers of the process that must be above 0."""
    models: tuple[Model, ...] = ("first-order",)
    """Processes with a formula; two lags without one become one by the half rule."""
    ratio: tuple[float, float] = (0.0, inf)
    """Dead time over time constant, between which the rule holds."""
    aims: bool = False
    """Whether it makes the closed loop as fast as is asked for."""
    searches: bool = False
    """Whether it is no formula: it tries gains on plants (`pidcfg.tuning.robust`)."""

    def gains(self, form: Form, process: Process, cycle: Cycle) -> Gains:
        """The result, from whichever of the two the rule is for; raises `ValueError` beyond the rule's own range."""
        if self.of_process is not None:
            return self.of_process(form, self.reduce_process(form, process))
        if self.of_ultimate is not None:
            return self.of_ultimate(form, cycle)
        raise ValueError(f"{self.name} is made of nothing")

    def reduce_process(self, form: Form, process: Process) -> Process:
        """The process as the rule takes it: by the half rule without the second lag, where it has no use for it."""
        second = process.second_time_constant
        if not second or (form == "PID" and "second-order" in self.models):
            return process
        if process.integrating:
            return replace(process, dead_time=process.dead_time + second / 2, second_time_constant=0.0)
        constant, dead = process.time_constant + second / 2, process.dead_time + second / 2
        return replace(process, time_constant=constant, dead_time=dead, second_time_constant=0.0)

    def range_of_validity(self, form: Form, process: Process) -> tuple[bool, str]:
        """Whether a process is one that the rule was made for, and the range in words."""
        reduced = self.reduce_process(form, process)
        if self.searches:
            return True, "for the plants that were tried, in this loop; nothing is said of others"
        if process.integrating or self.of_process is None:
            return True, "it has no limits"
        low, high = self.ratio
        ratio = reduced.delay / reduced.time_constant
        if self.aims and reduced.closed_loop:
            fast = reduced.closed_loop < reduced.delay * (1 - ROUNDING_TOLERANCE)
            text = f"for a closed loop of {reduced.delay:.4g} s (the dead time) or slower"
            return not fast, f"{text}; it is to have {reduced.closed_loop:.4g} s"
        if (low, high) == (0.0, inf):
            return True, "for every dead time / time constant"
        holds = low * (1 - ROUNDING_TOLERANCE) <= ratio <= high * (1 + ROUNDING_TOLERANCE)
        return holds, f"for dead time / time constant of {low:g} to {high:g}; it is {ratio:.3g}"

    def __reduce__(self) -> tuple[Callable[[str], Method], tuple[str]]:
        """A copy, be it in another process, is the method itself."""
        return find_method, (self.name,)


PROCESS_NUMBERS = ("gain", "time_constant", "dead_time")
DELAY_NUMBERS = ("gain", "time_constant", "delay")
ALL_FORMS: tuple[Form, ...] = ("P", "PI", "PID")
PI_PID: tuple[Form, ...] = ("PI", "PID")
ANY_LAG: tuple[Model, ...] = ("first-order", "integrating")
ANY_MODEL: tuple[Model, ...] = ("first-order", "second-order", "integrating")
IAE = NEXTOPID.cite("Minimization of Integral of Absolute Error")


def _fitted_rule(
    name: str,
    title: str,
    basis: Basis,
    forms: tuple[Form, ...],
    rule: Callable[[Form, Process], Gains],
    ratio: tuple[float, float] = FITTED_RATIO,
) -> Method:
    """A rule that was fitted to lags with a dead time of some share."""
    return Method(name, title, basis, forms, rule, needs=DELAY_NUMBERS, ratio=ratio)


def _rule_with_aim(
    name: str, title: str, basis: Basis, rule: Callable[[Form, Process], Gains], models: tuple[Model, ...]
) -> Method:
    """A rule that makes the closed loop as fast as is asked for."""
    return Method(name, title, basis, PI_PID, rule, needs=DELAY_NUMBERS, models=models, aims=True)


def _rule_of_cycle(name: str, title: str, basis: Basis, table: dict[Form, Row]) -> Method:
    """A rule of multiples of the ultimate cycle."""
    return Method(name, title, basis, ALL_FORMS, of_ultimate=rule_of_cycle(table))


load_rule, step_rule = least_error_after_disturbances, least_error_after_setpoint_steps
CHR_TITLE, CHR_RANGE = "Chien, Hrones and Reswick, ", (0.11, 1.0)
# fmt: off
METHOD_ROWS = (
    Method("synthesis", "a closed-loop time constant that you choose", NEXTOPID.cite("Synthesis Method"), PI_PID,
           synthesis, needs=("gain", "time_constant", "closed_loop"), aims=True),
    _fitted_rule("iae-disturbance", "least absolute error after disturbances", IAE, ALL_FORMS,
                 load_rule(IAE_DISTURBANCE)),
    _fitted_rule("iae-setpoint", "least absolute error after set-point changes", D92, PI_PID, step_rule(IAE_SETPOINT)),
    _fitted_rule("itae-disturbance", "least absolute error times time after disturbances", D705, ALL_FORMS,
                 load_rule(ITAE_DISTURBANCE)),
    _fitted_rule("itae-setpoint", "least absolute error times time after set-point changes", D705, PI_PID,
                 step_rule(ITAE_SETPOINT)),
    _rule_with_aim("simc", "Skogestad's SIMC", D700, simc, ANY_MODEL),
    _rule_with_aim("simc-improved", "Skogestad's SIMC, improved for dead time", D700, simc_improved,
                   ANY_LAG),
    _rule_with_aim("lambda", "lambda tuning", D701, lambda_rule, ANY_LAG),
    Method("amigo", "Åström and Hägglund's AMIGO", D702, PI_PID, amigo, None, DELAY_NUMBERS, ANY_LAG),
    _fitted_rule("cohen-coon", "Cohen and Coon", D703, ALL_FORMS, cohen_coon),
    *(
        _fitted_rule(name, CHR_TITLE + aim, D704, ALL_FORMS, chien_hrones_reswick(name), CHR_RANGE)
        for name, aim in (
            ("chr", "set points without overshoot"),
            ("chr-20", "set points with 20 % overshoot"),
            ("chr-disturbance", "disturbances without overshoot"),
            ("chr-disturbance-20", "disturbances with 20 % overshoot"),
        )
    ),
    Method("zn-open", "Ziegler-Nichols, reaction curve", D90, ALL_FORMS, reaction_curve, needs=PROCESS_NUMBERS,
           models=ANY_LAG, ratio=FITTED_RATIO),
    Method("robust", "least error after a load with Ms below a limit on every plant", D852, PI_PID, needs=DELAY_NUMBERS,
           models=ANY_MODEL, searches=True),
    _rule_of_cycle("zn-closed", "Ziegler-Nichols, ultimate cycle", D91, ZIEGLER_NICHOLS_CLOSED),
    _rule_of_cycle("tyreus-luyben", "Tyreus-Luyben, ultimate cycle", D93, TYREUS_LUYBEN),
    _rule_of_cycle("nextopid-autotune", "what NextoPID's auto-tune makes of its relay test", D93, NEXTOPID_CLOSED),
    _rule_of_cycle("dl06-autotune", "what the virtual DL06 makes of its closed-loop auto-tune", D91, GENTLE_CLOSED),
)
# fmt: on
METHODS = {method.name: method for method in METHOD_ROWS}
"""By name, in the order in which they are listed."""


def find_method(name: str) -> Method:
    """The method with this name; raises `KeyError`."""
    return METHODS[name]
