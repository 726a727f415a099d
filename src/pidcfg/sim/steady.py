"""The pre-roll of ``initial: steady``: controllers and plants run until every PV is at rest, then time starts.

A PV is at rest when over one window, the longest time constant, it hardly moves or stays within two counts of its mean:
a quantised loop on an integrator hunts for ever. Where an output is on or off, or pulses, the PVs never rest: there the
highest and the lowest PV must come back (D761). Outputs do not count; noise and events are off.
"""

from __future__ import annotations

from math import lcm
from typing import TYPE_CHECKING

from pidcfg.sim.influence import Influence
from pidcfg.sim.kernel import Span
from pidcfg.sim.plc import TICKS
from pidcfg.sim.problems import Problem

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from pidcfg.schemas.scenario import Scenario
    from pidcfg.sim.engine import Machine
    from pidcfg.sim.network import Network
    from pidcfg.sim.plc import Plc

WINDOWS = 100
"""Windows after which a network counts as one that never settles."""
SAMPLES = 4
"""Samples of the slowest loop that a window spans at least."""
ALIGNED = 10
"""A window grows at most by this factor to hold whole samples of all loops."""
STEADY_SHARE = 1e-6
STEADY_COUNTS = 2.0
"""A PV is steady when it moves less than this share of its range, or stays this close to its mean."""
CYCLE_WINDOWS = 4
"""Windows whose extremes are held against those of as many before: a cycle may be longer than the time constant."""
CYCLE_SHARE = 0.02
"""Of the swing, by which the extremes of a cycle may differ from those before."""


class UnsteadyError(Exception):
    """The network does not settle; ``problem`` says which loop moves and how far."""

    def __init__(self, problem: Problem) -> None:
        super().__init__(problem.message)
        self.problem = problem


def settle(machine: Machine, max_loop_steps: int | None, swinging: Collection[int] = ()) -> int:
    """Runs the pre-roll and returns its base steps; ``swinging``: loops that may swing. Raises `UnsteadyError`."""
    plc = machine.plc
    spans = [Span(config.sig_in) for config in plc.cfg[: len(plc.loops)]]
    steps = window_of(machine)
    past: list[list[tuple[float, float]]] = []
    k, moving = 0, 0
    for _ in range(WINDOWS):
        if max_loop_steps is not None and (k + steps) * len(spans) > max_loop_steps:
            break
        k = machine.settle(k, k + steps, spans)
        unsteady = [i for i, span in enumerate(spans) if not is_steady(span, plc.scales[i], steps)]
        if swinging:
            past.append([(span.low, span.high) for span in spans])
            ends = {i: [window[i] for window in past] for i in swinging}
            unsteady = [i for i in unsteady if i not in ends or not comes_back(ends[i], plc.scales[i])]
        if not unsteady:
            return k
        moving = unsteady[0]
    raise UnsteadyError(_explain(machine, k, spans[moving], moving, steps))


def refused(machine: Machine) -> list[Problem]:
    """A warning for each loop that rests in another mode than it is meant for: what rests is not under control."""
    plc = machine.plc
    modes = [plc.mode(state.status) for state in plc.st[: len(plc.loops)]]
    cure = "see the mode changes at 0 s for the reason"
    return [
        Problem(
            ("initial",),
            f"{loop} rests in {mode}, though {goal} is meant",
            "no_steady_state",
            "warning",
            cure,
            loop=loop,
        )
        for loop, mode, goal in zip(plc.loops, modes, plc.goals, strict=True)
        if goal != "manual" and mode == "manual" and "manual" in plc.modes
    ]


def window_of(machine: Machine) -> int:
    """Base steps of a window: the longest time constant, in whole samples so that all loops sample at time 0."""
    periods = [config.period for config in machine.plc.cfg]
    longest = max(machine.net.longest(), machine.plc.longest)
    least = max(longest * TICKS, SAMPLES * max(periods, default=0), machine.step)
    common = lcm(*periods, machine.step)
    if common > ALIGNED * least:
        common = machine.step
    return int(-(-least // common)) * common // machine.step


def is_steady(span: Span, scale: tuple[float, float, int], steps: int) -> bool:
    """Whether a PV was at rest over a window of ``steps``; ``scale`` is its range and the counts in it."""
    low, high, counts = scale
    if span.high - span.low < STEADY_SHARE * abs(high - low):
        return True
    mean = span.total / steps
    return max(span.high - mean, mean - span.low) <= STEADY_COUNTS * abs(high - low) / counts


def swinging_loops(scenario: Scenario, net: Network, plc: Plc) -> set[int]:
    """The loops whose outputs are on or off, or pulses, and those whose PVs one of them moves."""
    loops = range(len(plc.loops))
    sources = [i for i in loops if plc.only_switches(i) or plc.pulse_cycle(i)]
    if not sources:
        return set()
    influence = Influence.of(scenario, net, plc)
    moved = set[int]().union(*(influence.of_output(i) for i in sources))
    return {i for i in loops if i in sources or plc.cfg[i].sig_pv in moved}


def comes_back(past: Sequence[tuple[float, float]], scale: tuple[float, float, int]) -> bool:
    """Whether a PV swings between the same extremes: ``past`` has the lowest and highest of each window."""
    if len(past) < 2 * CYCLE_WINDOWS:
        return False
    before, now = past[-2 * CYCLE_WINDOWS : -CYCLE_WINDOWS], past[-CYCLE_WINDOWS:]
    (low_before, high_before), (low_now, high_now) = _extremes(before), _extremes(now)
    low, high, counts = scale
    least = max(STEADY_SHARE, STEADY_COUNTS / counts) * abs(high - low)
    slack = max(CYCLE_SHARE * (high_now - low_now), least)
    return abs(low_now - low_before) <= slack and abs(high_now - high_before) <= slack


def _extremes(windows: Sequence[tuple[float, float]]) -> tuple[float, float]:
    return min(low for low, _ in windows), max(high for _, high in windows)


def _explain(machine: Machine, k: int, span: Span, loop: int, steps: int) -> Problem:
    dt, name = machine.step / TICKS, machine.plc.loops[loop]
    message = (
        f"no steady state after {k * dt:g} s: the PV of {name} still moves between {span.low:.6g} and {span.high:.6g} "
        f"within {steps * dt:g} s; the run starts from 'initial' of the plants instead"
    )
    cure = "check mode, action and tuning of the loop, and the signs of the plant's gain and load"
    return Problem(("initial",), message, "no_steady_state", help=cure, loop=name)
