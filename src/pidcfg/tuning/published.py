"""Tuning rules of the literature; results are in the dependent form, gains in output per PV unit, times in s.

Everywhere the dead time is that of the process and half the sample time (`Process.delay`). A rule that has a formula
for processes that integrate, or for two lags, has it here; for the others two lags become one by the half rule.
"""

from __future__ import annotations

from math import inf
from typing import TYPE_CHECKING

from pidcfg.refs import Decision
from pidcfg.tuning.rules import Form, Gains, Process

if TYPE_CHECKING:
    from collections.abc import Callable

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


def in_dependent_form(gain: float, integral_time: float, derivative_time: float) -> Gains:
    """A series (interacting) controller in the dependent form; its derivative time is at most a quarter of Ti there."""
    factor = 1 + derivative_time / integral_time
    return Gains(gain * factor, integral_time * factor, derivative_time / factor)


def aim(process: Process) -> float:
    """The closed-loop time constant of SIMC: the one asked for, or the dead time for tight and still smooth control."""
    return process.closed_loop or process.delay


def _simc(process: Process, constant: float, derivative_time: float) -> Gains:
    total = aim(process) + process.delay
    gain = 1 / (process.gain * total) if process.integrating else constant / (process.gain * total)
    integral = 4 * total if process.integrating else min(constant, 4 * total)
    return in_dependent_form(gain, integral, derivative_time)


def simc(form: Form, process: Process) -> Gains:
    """Skogestad's rule: PI of a first-order process or an integrator, PID of two lags; else raises `ValueError`."""
    if form == "PID" and not process.second_time_constant:
        raise ValueError("the rule has a derivative for a second time constant only; use PI, or simc-improved")
    return _simc(process, process.time_constant, process.second_time_constant if form == "PID" else 0.0)


def simc_improved(form: Form, process: Process) -> Gains:
    """The rule with a third of the dead time more: in the integral time of PI, or as derivative time of PID."""
    third = process.delay / 3
    if form == "PID":
        return _simc(process, process.time_constant, third)
    return _simc(process, process.time_constant + third, 0.0)


def lambda_rule(form: Form, process: Process) -> Gains:
    """The closed loop becomes a lag of the time constant that is asked for."""
    dead, constant = process.delay, process.time_constant
    slowest = dead if process.integrating else max(constant, dead)
    wanted = process.closed_loop or LAMBDA_FACTOR * slowest
    if process.integrating:
        if form == "PID":
            raise ValueError("the rule has PI only for a process that integrates")
        return Gains((2 * wanted + dead) / (process.gain * (wanted + dead) ** 2), 2 * wanted + dead, 0.0)
    if form == "PI":
        return Gains(constant / (process.gain * (wanted + dead)), constant, 0.0)
    integral = constant + dead / 2
    return Gains(integral / (process.gain * (wanted + dead / 2)), integral, constant * dead / (2 * constant + dead))


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
