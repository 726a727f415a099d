"""The tuning rules by name: what each takes, the controllers and processes that it is for, and where it holds."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf
from typing import TYPE_CHECKING

from pidcfg.refs import NEXTOPID, Decision
from pidcfg.tuning import published, rules
from pidcfg.tuning.rules import D90, D91, D92, D93, Form, Model, of_cycle
from pidcfg.tuning.uncertainty import D852

if TYPE_CHECKING:
    from collections.abc import Callable

    from pidcfg.refs import Basis
    from pidcfg.tuning.rules import Cycle, Gains, Process

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

FITTED = (0.1, 1.0)
"""Of dead time over time constant: the range for which most rules were fitted."""
LAST_DIGITS = 1e-9


@dataclass(frozen=True, slots=True)
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
            return self.of_process(form, self.taken(form, process))
        if self.of_ultimate is not None:
            return self.of_ultimate(form, cycle)
        raise ValueError(f"{self.name} is made of nothing")

    def taken(self, form: Form, process: Process) -> Process:
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
        taken = self.taken(form, process)
        if self.searches:
            return True, "for the plants that were tried, in this loop; nothing is said of others"
        if process.integrating or self.of_process is None:
            return True, "it has no limits"
        low, high = self.ratio
        ratio = taken.delay / taken.time_constant
        if self.aims and taken.closed_loop:
            fast = taken.closed_loop < taken.delay * (1 - LAST_DIGITS)
            text = f"for a closed loop of {taken.delay:.4g} s (the dead time) or slower"
            return not fast, f"{text}; it is to have {taken.closed_loop:.4g} s"
        if (low, high) == (0.0, inf):
            return True, "for every dead time / time constant"
        holds = low * (1 - LAST_DIGITS) <= ratio <= high * (1 + LAST_DIGITS)
        return holds, f"for dead time / time constant of {low:g} to {high:g}; it is {ratio:.3g}"

    def __reduce__(self) -> tuple[Callable[[str], Method], tuple[str]]:
        """A copy, be it in another process, is the method itself."""
        return method_named, (self.name,)


PROCESS = ("gain", "time_constant", "dead_time")
DELAYED = ("gain", "time_constant", "delay")
ALL: tuple[Form, ...] = ("P", "PI", "PID")
PI_PID: tuple[Form, ...] = ("PI", "PID")
ANY_LAG: tuple[Model, ...] = ("first-order", "integrating")
ANY: tuple[Model, ...] = ("first-order", "second-order", "integrating")
IAE = NEXTOPID.at("Minimization of Integral of Absolute Error")


def _fitted(
    name: str,
    title: str,
    basis: Basis,
    forms: tuple[Form, ...],
    rule: Callable[[Form, Process], Gains],
    ratio: tuple[float, float] = FITTED,
) -> Method:
    """A rule that was fitted to lags with a dead time of some share."""
    return Method(name, title, basis, forms, rule, needs=DELAYED, ratio=ratio)


def _aiming(
    name: str, title: str, basis: Basis, rule: Callable[[Form, Process], Gains], models: tuple[Model, ...]
) -> Method:
    """A rule that makes the closed loop as fast as is asked for."""
    return Method(name, title, basis, PI_PID, rule, needs=DELAYED, models=models, aims=True)


def _cycle(name: str, title: str, basis: Basis, table: dict[Form, rules.Row]) -> Method:
    """A rule of multiples of the ultimate cycle."""
    return Method(name, title, basis, ALL, of_ultimate=of_cycle(table))


after_disturbances, after_steps = rules.least_error_after_disturbances, rules.least_error_after_setpoint_steps
CHIEN, CHR_RANGE = "Chien, Hrones and Reswick, ", (0.11, 1.0)
# fmt: off
ROWS = (
    Method("synthesis", "a closed-loop time constant that you choose", NEXTOPID.at("Synthesis Method"), PI_PID,
           rules.synthesis, needs=("gain", "time_constant", "closed_loop"), aims=True),
    _fitted("iae-disturbance", "least absolute error after disturbances", IAE, ALL,
            after_disturbances(rules.DISTURBANCE)),
    _fitted("iae-setpoint", "least absolute error after set-point changes", D92, PI_PID, after_steps(rules.SETPOINT)),
    _fitted("itae-disturbance", "least absolute error times time after disturbances", published.D705, ALL,
            after_disturbances(published.ITAE_DISTURBANCE)),
    _fitted("itae-setpoint", "least absolute error times time after set-point changes", published.D705, PI_PID,
            after_steps(published.ITAE_SETPOINT)),
    _aiming("simc", "Skogestad's SIMC", published.D700, published.simc, ANY),
    _aiming("simc-improved", "Skogestad's SIMC, improved for dead time", published.D700, published.simc_improved,
            ANY_LAG),
    _aiming("lambda", "lambda tuning", published.D701, published.lambda_rule, ANY_LAG),
    Method("amigo", "Åström and Hägglund's AMIGO", published.D702, PI_PID, published.amigo, None, DELAYED, ANY_LAG),
    _fitted("cohen-coon", "Cohen and Coon", published.D703, ALL, published.cohen_coon),
    *(
        _fitted(name, CHIEN + aim, published.D704, ALL, published.chien_hrones_reswick(name), CHR_RANGE)
        for name, aim in (
            ("chr", "set points without overshoot"),
            ("chr-20", "set points with 20 % overshoot"),
            ("chr-disturbance", "disturbances without overshoot"),
            ("chr-disturbance-20", "disturbances with 20 % overshoot"),
        )
    ),
    Method("zn-open", "Ziegler-Nichols, reaction curve", D90, ALL, rules.reaction_curve, needs=PROCESS, models=ANY_LAG,
           ratio=FITTED),
    Method("robust", "least error after a load with Ms below a limit on every plant", D852, PI_PID, needs=DELAYED,
           models=ANY, searches=True),
    _cycle("zn-closed", "Ziegler-Nichols, ultimate cycle", D91, rules.ZIEGLER_NICHOLS_CLOSED),
    _cycle("tyreus-luyben", "Tyreus-Luyben, ultimate cycle", D93, rules.TYREUS_LUYBEN),
    _cycle("nextopid-autotune", "what NextoPID's auto-tune makes of its relay test", D93, rules.NEXTOPID_CLOSED),
    _cycle("dl06-autotune", "what the virtual DL06 makes of its closed-loop auto-tune", D91, rules.GENTLE_CLOSED),
)
# fmt: on
METHODS = {method.name: method for method in ROWS}
"""By name, in the order in which they are listed."""


def method_named(name: str) -> Method:
    """The method with this name; raises `KeyError`."""
    return METHODS[name]
