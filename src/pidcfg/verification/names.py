"""What a loop's signals are called on one side, and the loops of its cascade that run with it.

Those have no plant: the PV of each is its own set point, so that none holds the others up. Slaves go to Cascade, a
master stays in Manual.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from pydantic_core import PydanticCustomError

from pidcfg.sim.plc import TICKS

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping, Sequence

    from pidcfg.schemas.generic import Loop
    from pidcfg.sim.plc import Plc

PERCENT = (0.0, 100.0)


@dataclass(frozen=True, slots=True)
class SideNames:
    """What a loop's signals are called on one side."""

    loop: str
    output: str
    inlet: str
    """Where the PV comes in."""
    measured: str
    """What the transmitter shows, as an expression of the plant's value."""
    scale: tuple[float, float]
    """What the output's signal shows at 0 % and 100 %."""
    step: float
    """The base step in s: what happens to the plant begins with a sample and is seen at the next one on every side."""
    whole: tuple[bool, bool]
    """Whether output and set point are set in whole numbers."""
    modes: Collection[str]
    """What can be asked for."""
    connect: Mapping[str, str]
    """What the PVs of other loops are wired to, where some run with it."""
    events: Sequence[Mapping[str, Any]]
    """What happens to those."""
    master: tuple[str, tuple[float, float]] | None = None
    """The loop that gives the set point, and what its output shows at 0 % and 100 %."""

    def output_at(self, share: float) -> float:
        """The value of the output's signal for a share of its range."""
        low, high = self.scale
        value = low + share * (high - low)
        return round(value) if self.whole[0] else value

    def setpoint_at(self, value: float) -> float:
        """A set point as the loop takes it."""
        return round(value) if self.whole[1] else value


def slaves_of(loops: Sequence[Loop | None], i: int) -> tuple[int, ...]:
    """The loops whose set point is the output of one."""
    loop = loops[i]
    name = None if loop is None else loop.name
    return tuple(j for j, one in enumerate(loops) if one is not None and one.setpoint.source == name and j != i)


def master_of(loops: Sequence[Loop | None], i: int) -> int | None:
    """The loop whose output is the set point of one."""
    loop = loops[i]
    source = None if loop is None else loop.setpoint.source
    return next((j for j, one in enumerate(loops) if one is not None and one.name == source and j != i), None)


def companions(loops: Sequence[Loop | None], i: int, *, with_master: bool) -> tuple[int, ...]:
    """The loops that run with one: its slaves and theirs, the last ones first, behind its master where it is wanted."""
    master = master_of(loops, i)
    others = list(slaves_of(loops, i))
    for j in others:
        others += [k for k in slaves_of(loops, j) if k not in {i, *others}]
    if with_master and master is not None and master not in others:
        others.append(master)
    return tuple(reversed(others))


def output_scale(plc: Plc, i: int, loop: Loop | None) -> tuple[float, float]:
    """What a loop's output signal shows at 0 % and 100 %."""
    if plc.outputs:
        low, high = plc.outputs[i]
    elif loop is not None:
        low, high = (float(end) for end in loop.output.range)
    else:
        low, high = PERCENT
    return float(low), float(high)


def names_of(
    plc: Plc, loops: Sequence[Loop | None], i: int, measured: str, others: Sequence[int], *, as_configured: bool
) -> SideNames:
    """The names of a loop's signals; ``others`` of its cascade run with it, in their own modes or not."""
    name, c = plc.loops[i], plc.cfg[i]
    scale = output_scale(plc, i, loops[i])
    master = master_of(loops, i)
    gives = None if master is None else (plc.loops[master], output_scale(plc, master, loops[master]))
    return SideNames(
        name,
        plc.signals[c.sig_out],
        _inlet(plc, i),
        measured,
        scale,
        plc.base / TICKS,
        (is_whole(plc, i, "output", scale[0]), is_whole(plc, i, "setpoint", plc.scales[i][0])),
        plc.modes,
        {_inlet(plc, j): plc.signals[plc.cfg[j].sig_sp] for j in others},
        []
        if as_configured
        else [
            event
            for turn, j in enumerate(others)
            for event in _others_events(plc, j, turn, output_scale(plc, j, loops[j]), is_master=j == master)
        ],
        gives,
    )


def _inlet(plc: Plc, i: int) -> str:
    name = plc.loops[i]
    return plc.inlets.get(name, f"{name}.PV")


def _others_events(plc: Plc, j: int, turn: int, scale: tuple[float, float], *, is_master: bool) -> list[dict[str, Any]]:
    """A master goes to Manual, a slave by way of Auto to Cascade, where it has that mode, its output in the middle."""
    if is_master:
        return [{"at": 0, "loop": plc.loops[j], "mode": "manual"}]
    name, period = plc.loops[j], plc.cfg[j].period / TICKS
    low, high, _ = plc.scales[j]
    begin = 3 * turn * period
    bottom, top = scale
    middle, centre = (bottom + top) / 2, (low + high) / 2
    events: list[dict[str, Any]] = [
        {"at": begin, "loop": name, "mode": "manual"},
        {
            "at": begin,
            "loop": name,
            "set": {"output": round(middle) if is_whole(plc, j, "output", bottom) else middle},
        },
        {"at": begin + period, "loop": name, "mode": "auto"},
        {
            "at": begin + period,
            "loop": name,
            "set": {"setpoint": round(centre) if is_whole(plc, j, "setpoint", low) else centre},
        },
    ]
    if "cascade" in plc.modes:
        events.append({"at": begin + 2 * period, "loop": name, "mode": "cascade"})
    return events


def is_whole(plc: Plc, i: int, key: str, low: float) -> bool:
    """Whether a value is set in whole numbers only: counts, where there is no range, and the inputs of INT blocks."""
    try:
        plc.check_set(i, (key,), low + 0.5)
    except PydanticCustomError:
        return True
    return False
