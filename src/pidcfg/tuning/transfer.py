"""Transfer functions of lags, leads, integrators and dead time, and the half rule that reduces them to a process."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import isclose

from pidcfg.refs import Decision
from pidcfg.tuning.rules import Process, TuningError

D707 = Decision(
    707,
    "the half rule as published",
    "The largest time constants stay; half of the next one goes to the last that stays, its other half, all smaller "
    "ones and the times of negative zeros become dead time. A positive zero (T s + 1) is cancelled first against the "
    "next larger lag, or against the next smaller one where that is within a factor of 1.6 and nearer, by Skogestad's "
    "rules T1 to T3 with the dead time as closed-loop time constant.",
    "Skogestad, J. Process Control 13 (2003) 291, sections 2 and 4.",
)

CLOSE = 1.6
"""A smaller lag this near to a zero may cancel it."""
LAST_DIGITS = 1e-9


@dataclass(frozen=True, slots=True)
class Transfer:
    """Gain, the times T of factors (T s + 1) above and below the line, integrators, and dead time in s."""

    gain: float
    zeros: tuple[float, ...]
    poles: tuple[float, ...]
    integrators: int
    dead_time: float


def transfer_of(process: Process) -> Transfer:
    """A process with half its sample time as dead time."""
    lags = (process.second_time_constant,) if process.second_time_constant else ()
    if process.integrating:
        return Transfer(process.slope, (), lags, 1, process.delay)
    return Transfer(process.gain, (), (process.time_constant, *lags), 0, process.delay)


FACTOR = 5
"""Times the closed-loop time constant: what is slower than that looks like an integrator."""
ROUNDS, ENOUGH = 30, 1e-12
"""The dead time is a result, and a bound of the rules that lead to it."""


def reduced(transfer: Transfer, order: int) -> Process:
    """The process of one or two lags that is nearest by the half rule; raises `TuningError` where none is."""
    dead = transfer.dead_time
    for _ in range(ROUNDS):
        gain, lags = _without_leads(transfer, dead)
        process = _by_halves(replace(transfer, gain=gain, poles=lags), order)
        if isclose(process.dead_time, dead, rel_tol=ENOUGH, abs_tol=ENOUGH):
            break
        dead = process.dead_time
    return process


def _by_halves(transfer: Transfer, order: int) -> Process:
    """The largest lags, half of the next one, and the dead time that all others make."""
    kept = order - transfer.integrators
    lags = sorted(transfer.poles, reverse=True)
    whole, half = lags[:kept], sum(lags[kept : kept + 1]) / 2
    dead = transfer.dead_time + half + sum(lags[kept + 1 :]) - sum(zero for zero in transfer.zeros if zero < 0)
    if whole:
        whole[-1] += half
        whole.sort(reverse=True)
    if transfer.integrators:
        return Process(transfer.gain, 1.0, dead, second_time_constant=whole[0] if whole else 0.0, integrating=True)
    if not whole:
        raise TuningError("the transfer function has no lag: nothing that the rules take")
    return Process(transfer.gain, whole[0], dead, second_time_constant=whole[1] if len(whole) > 1 else 0.0)


def _without_leads(transfer: Transfer, dead: float) -> tuple[float, tuple[float, ...]]:
    """Gain and lags after each lead (a positive zero) has been cancelled against a lag near it."""
    gain, lags = transfer.gain, sorted(transfer.poles)
    for lead in sorted((zero for zero in transfer.zeros if zero > 0), reverse=True):
        if not lags:
            raise TuningError(f"no lag is left for the lead of {lead:g} s")
        lag = _partner(lead, lags)
        lags.remove(lag)
        if lead < lag and lead < FACTOR * dead:  # T3
            bound = min(lag, FACTOR * dead)
            gain *= bound / lag
            if bound > lead:
                lags = sorted([*lags, bound - lead])
        elif lead < lag or lag >= dead:  # T2, T1
            gain *= lead / lag
        elif lead >= dead:  # T1a
            gain *= lead / dead
    return gain, tuple(lags)


def _partner(lead: float, lags: list[float]) -> float:
    """The lag that a lead is cancelled against: the next larger one, or a smaller one that is nearer and close."""
    larger = next((lag for lag in lags if lag >= lead), None)
    smaller = next((lag for lag in reversed(lags) if lag < lead), None)
    if larger is None or smaller is None:
        return larger or smaller or lags[0]
    return smaller if lead / smaller < min(larger / lead, CLOSE) * (1 - LAST_DIGITS) else larger
