"""Before a run: the PLC's options, the base step, the network, and all problems of a scenario."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import fields
from math import gcd
from typing import TYPE_CHECKING

from pydantic_core import PydanticCustomError

from pidcfg.paths import leaves
from pidcfg.sim.check_scenario import check_scenario
from pidcfg.sim.network import Network, build
from pidcfg.sim.plc import TICKS, Controller, Plc
from pidcfg.sim.problems import Problem

if TYPE_CHECKING:
    from pidcfg.schemas.scenario import Scenario


def options(scenario: Scenario, controller: Controller) -> object:
    """What the scenario chooses about the PLC, as the controller takes it; `prepare` reports what it does not know."""
    known = {f.name for f in fields(controller.Options)}
    choices = {key: value for key, value in scenario.plc.model_dump(exclude_none=True).items() if key in known}
    if "scan_time" in choices:
        choices["scan_time"] = int(choices["scan_time"] * TICKS)
    return controller.Options(**choices)


def base_step(scenario: Scenario, plc: Plc) -> int:
    """The base step in ticks: that of the scenario, the scan time, or the greatest common step of the sample rates."""
    chosen = scenario.step or scenario.plc.scan_time
    if chosen is not None:
        return max(1, int(chosen * TICKS))
    rates = [plc.base] if plc.running else [config.period for config in plc.cfg]
    return gcd(*rates, *rates_set(scenario, plc)) or TICKS


def rates_set(scenario: Scenario, plc: Plc) -> list[int]:
    """Sample rates that events of the scenario set, in ticks."""
    periods = []
    for event in scenario.events:
        if event.loop not in plc.loops or event.set is None or event.at > scenario.duration:
            continue
        loop = plc.loops.index(event.loop)
        for keys, value, _ in leaves(event.set):
            with suppress(PydanticCustomError):  # the check of the scenario reports it
                periods.append(plc.period_set(loop, keys, plc.check_set(loop, keys, value)))
    return periods


def prepare(scenario: Scenario, plc: Plc) -> Network:
    """The network of a scenario, with everything that is wrong with the scenario in ``problems``."""
    step = base_step(scenario, plc)
    problems = list(check_scenario(scenario, plc))
    for name, period in zip(plc.loops, plc.periods, strict=True):
        if period and misses(period, step, scenario):
            problems.append(uneven(name, period, step))
    if scenario.plc.number_of_loops is not None and any(plc.flags.values()):
        words = ", ".join(f"{name} = {plc.word_of_flags.format(word)}" for name, word in plc.flags.items())
        message = f"with {scenario.plc.number_of_loops} loops the set-up check gives {words}: the loop task is off"
        problems.append(Problem(("plc", "number_of_loops"), message, "set_up", "warning"))
    return build(scenario, plc, step, problems)


def misses(period: int, step: int, scenario: Scenario) -> bool:
    """Whether samples of this rate come late in steps of this length; any rate fits scans that are shorter."""
    return period < step if scenario.plc.scan_time is not None else period % step != 0


def uneven(loop: str, period: int, step: int, since: str = "") -> Problem:
    """A sample rate that the base step does not meet."""
    what = "is shorter than" if period < step else "is no multiple of"
    message = f"{since}the sample rate of {loop}, {period / TICKS:g} s, {what} the step, {step / TICKS:g} s"
    cure = f"its samples come at the next base step; give 'step: {gcd(period, step) / TICKS:g}', which fits them all"
    return Problem(("step",), message, "rounded", "warning", cure, loop=loop)


def too_long(last: int, loops: int, limit: int | None) -> list[Problem]:
    """The limit on loop-steps, and a scenario without any; ``last``: its last base step."""
    count = (last + 1) * loops
    if limit is not None and count > limit:
        message = f"{count} loop-steps; the limit is {limit}"
        return [Problem(("duration",), message, "limit", help="use a longer step, or the option --no-limit")]
    cure = "lengthen the duration, or give a shorter 'step'"
    short = Problem(("duration",), "the scenario is shorter than its base step", "value", help=cure)
    return [short] if last < 1 else []
