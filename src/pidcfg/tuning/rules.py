"""The manuals' tuning rules as tables and formulas; results are in the dependent form, in engineering units and s.

A process is a lag with dead time, with a second lag, or an integrator. Coefficients stand here once: the auto-tunes of
the virtual PLCs take theirs from these tables. Rules of the literature: `pidcfg.tuning.published`; the table of all:
`pidcfg.tuning.methods`.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import TYPE_CHECKING, Literal

from pidcfg.refs import Decision

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

Form = Literal["P", "PI", "PID"]
Model = Literal["first-order", "second-order", "integrating"]
Row = tuple[float, float, float]
"""What the gain, the integral and the derivative time are multiplied with; infinite: no integral term."""

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


LEAST, LARGEST = 1e-9, 1e12
"""Of a gain, or of a time in s: nothing that is tuned has others, and beyond them a float makes no margins."""


class TuningError(ValueError):
    """Numbers, or a recorded step, from which a rule makes no gains."""


def is_usable(number: float) -> bool:
    """Whether the size of a gain or time is one of a process."""
    return LEAST <= abs(number) <= LARGEST


@dataclass(frozen=True, slots=True)
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


@dataclass(frozen=True, slots=True)
class Cycle:
    """The ultimate cycle: the gain at which a P controller just keeps swinging, and its period in s."""

    gain: float
    period: float


@dataclass(frozen=True, slots=True)
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


ZIEGLER_NICHOLS_OPEN: dict[Form, Row] = {"P": (1.0, inf, 0.0), "PI": (0.9, 3.33, 0.0), "PID": (1.2, 2.0, 0.5)}
"""Of 1/(R L), the dead time and the dead time."""
ZIEGLER_NICHOLS_CLOSED: dict[Form, Row] = {
    "P": (0.5, inf, 0.0),
    "PI": (0.45, 1 / 1.2, 0.0),
    "PID": (0.6, 0.5, 0.125),
}
"""Of the ultimate gain and its period, as all that follow."""
OPEN_SAMPLE = {"PI": 0.12, "PID": 0.056}
CLOSED_SAMPLE = {"PI": 0.03, "PID": 0.014}
"""The sample rates that the auto-tunes set: shares of the dead time, and of the ultimate period."""
GENTLE_CLOSED: dict[Form, Row] = {"P": (0.30, inf, 0.0), "PI": (0.30, 1.00, 0.0), "PID": (0.45, 0.60, 0.10)}
TYREUS_LUYBEN: dict[Form, Row] = {"P": (0.5, inf, 0.0), "PI": (1 / 3.2, 2.2, 0.0), "PID": (1 / 2.2, 2.2, 1 / 6.3)}
NEXTOPID_P, NEXTOPID_PART, NEXTOPID_TI, NEXTOPID_TD = 0.5, 3.2, 2.2, 6.3
"""Kp = 0.5 Ku for P, else Ku / 3.2; Ti = 2.2 Pu; Td = Pu / 6.3."""
NEXTOPID_CLOSED: dict[Form, Row] = {
    "P": (NEXTOPID_P, inf, 0.0),
    "PI": (1 / NEXTOPID_PART, NEXTOPID_TI, 0.0),
    "PID": (1 / NEXTOPID_PART, NEXTOPID_TI, 1 / NEXTOPID_TD),
}

DISTURBANCE: dict[Form, tuple[float, ...]] = {
    "P": (0.902, -0.985),
    "PI": (0.984, -0.985, 0.608, 0.707),
    "PID": (1.435, -0.921, 0.878, 0.749, 0.482, 1.137),
}
"""Table 17-1: factor and power of Pu, for gain, integral time (Tc over the factor) and derivative time."""
SETPOINT: dict[Form, tuple[float, ...]] = {
    "PI": (0.758, -0.861, 1.02, 0.323),
    "PID": (1.086, -0.869, 0.74, 0.13, 0.348, 0.914),
}
"""Table 17-2, the PID's gain corrected (D92); the integral time is Tc / (a - b Pu)."""


def of_cycle(table: dict[Form, Row]) -> Callable[[Form, Cycle], Gains]:
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
        rest = row[2] - row[3] * pu
        if rest <= 0:
            limit = row[2] / row[3]
            raise ValueError(f"the rule has no integral time where dead time / time constant is above {limit:.3g}")
        derivative = row[4] * process.time_constant * pu ** row[5] if form == "PID" else 0.0
        return Gains(row[0] / process.gain * pu ** row[1], process.time_constant / rest, derivative)

    return gains
