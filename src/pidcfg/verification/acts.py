"""What a stage is made of: acts at times, and how both sides are compared."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

from pidcfg.verification.bench import IN_CASCADE

if TYPE_CHECKING:
    from pidcfg.verification.bench import Bench

Signal = Literal["pv", "output", "setpoint", "mode", "alarms"]
ALL: frozenset[Signal] = frozenset(("pv", "output", "setpoint", "mode", "alarms"))


@dataclass(frozen=True, slots=True)
class Act:
    """Something that happens ``at`` s; numbers of a plant, a key of the loop, a mode, or a broken sensor."""

    at: float
    mode: str | None = None
    setpoint: float | None = None
    output: float | None = None
    """A share of the range."""
    load: float | None = None
    master: float | None = None
    """The output of the loop that gives the set point, as a share of its range."""
    moved: float | None = None
    """By how much the PV lies beside the plant's value from then on."""
    lost: bool | None = None
    """The sensor shows the lower end of its range, or the PV again."""


@dataclass(frozen=True, slots=True)
class Stage:
    """One stage; times in s."""

    name: str
    title: str
    acts: tuple[Act, ...]
    end: float
    begin: float = 0.0
    """From when on both sides are compared."""
    signals: frozenset[Signal] = ALL
    pv: float = 0.0
    """Of the plant at the beginning."""
    load: float = 0.0
    loses_sensor: bool = False
    swept: bool = False
    """The plant is an integrator that only its load moves."""
    output: float | None = None
    """With which a stage begins; None: as configured."""
    slack: int = 0
    """Samples by which signals may come apart in addition: a loop above samples more slowly."""
    with_master: bool = False
    """The loop that gives the set point runs, too."""


def at_rest(b: Bench) -> tuple[Act, ...]:
    """In Manual, with the plant at rest at the set point.

    The output is held until the inner loops are in Cascade: some masters take over what these have for a set point.
    """
    held = min(round(IN_CASCADE * b.slowest / b.sample), round(b.rest / b.sample) - 1)
    return (
        Act(0.0, mode="auto"),  # a block may keep its set point from a master in Manual, too
        Act(0.0, mode="manual"),
        Act(0.0, output=b.middle),
        Act(b.sample, setpoint=b.start),
        *(Act(k * b.sample, output=b.middle) for k in range(1, held)),
        Act(b.rest - b.sample, output=b.middle),
    )


def in_auto(b: Bench) -> tuple[Act, ...]:
    """The same, and then Auto with the same set point."""
    return (
        *at_rest(b),
        Act(b.rest, mode="auto"),
        Act(b.rest + b.sample, setpoint=b.start),
    )


def settled(
    b: Bench, name: str, title: str, acts: tuple[Act, ...], length: float, signals: frozenset[Signal] = ALL
) -> Stage:
    """A stage in Auto whose acts are counted from the time at which the loop has settled."""
    begin = b.rest + 2 * b.sample + b.settling
    moved = tuple(later(act, begin) for act in acts)
    load = b.load(b.start, b.middle)
    return Stage(name, title, (*in_auto(b), *moved), begin + length, begin, signals, b.start, load, output=b.middle)


def later(act: Act, by: float) -> Act:
    """The same act by so much later."""
    return replace(act, at=act.at + by)


def on_grid(stage: Stage, low: float, step: float, high: float) -> Stage:
    """The stage with its set points at whole steps from ``low`` on, so that the coarser register holds them."""
    acts = tuple(
        act if act.setpoint is None else replace(act, setpoint=nearest_step(act.setpoint, low, step, high))
        for act in stage.acts
    )
    return replace(stage, acts=acts)


def nearest_step(value: float, low: float, step: float, high: float) -> float:
    """The nearest of the values that lie whole steps from ``low`` on, up to ``high``; the value itself at an end."""
    near = low + round((value - low) / step) * step
    return near if low < value < high and near <= high else value
