"""What stands around the loops of a configuration: whose output is whose set point, shared PVs, selectors, wires."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from pydantic_core import PydanticCustomError

from pidcfg.schemas.scenario import Scenario
from pidcfg.sim.influence import Influence
from pidcfg.sim.prepare import prepare

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from pidcfg.sim.plc import Plc

PV_SOURCES = (("pv", "tag"), ("devices", "PV"), ("pv", "transfer"))
"""Where a loop's configuration says from which device its PV comes; two loops that name the same share it."""
LARGER = "Max"
"""In the type of a selector that takes the larger of its inputs."""


@dataclass(frozen=True, slots=True)
class Selector:
    """A signal of the program that is one of several outputs."""

    signal: str
    takes_larger: bool
    first: int
    """The loop that shall have it."""


@dataclass(frozen=True, slots=True)
class Surroundings:
    """By the number of a loop."""

    masters: Mapping[int, int]
    """Its master, where its set point is another loop's output."""
    leaders: Mapping[int, int] = field(default_factory=dict)
    """The first loop with the same PV, of every further one."""
    selectors: Mapping[int, Selector] = field(default_factory=dict)
    """The selector that reads its output."""
    given: Mapping[int, str] = field(default_factory=dict)
    """A signal from outside that the program makes its set point of."""

    def slaves(self, i: int) -> Iterator[int]:
        """The loops whose set point is the output of one."""
        return (j for j, master in self.masters.items() if master == i)


def surroundings_of(config: Any, plc: Plc) -> Surroundings:
    """Of a configuration and its PLC as it starts."""
    masters = {i: m for i, m in enumerate(plc.masters) if m >= 0 and plc.goals[i] == "cascade"}
    empty = Scenario.model_validate({"pidcfg": 1, "scenario": "-", "config": "-", "duration": 1})
    net = prepare(empty, plc)
    influence = Influence.of(empty, net, plc)
    name_of = {slot: name for name, slot in plc.inputs.items()}
    measured, given = set(plc.inlets.values()), {}
    for i in range(len(plc.loops)):
        names = [name_of[slot] for slot in sorted(influence.set_points[i]) if slot in name_of]
        names = [name for name in names if "." not in name and name not in measured and step_of(plc, name)]
        if names and i not in masters:
            given[i] = names[0]
    return Surroundings(masters, _leaders(config, plc), _selectors(config, plc, influence), given)


def step_of(plc: Plc, name: str) -> tuple[float, float] | None:
    """The first value of a signal from outside and one a tenth above it; None for a switch."""
    value = plc.sig[plc.inputs[name]]
    for new in (round(value * 1.1, 6), round(value * 1.1), value + 1):
        try:
            if plc.check_input(name, new) != value:
                return value, new
        except PydanticCustomError:
            continue
    return None


def _leaders(config: Any, plc: Plc) -> dict[int, int]:
    places: dict[object, list[int]] = defaultdict(list)
    for i, loop in enumerate(config.loops):
        inlet = plc.inlets.get(plc.loops[i])
        source = inlet or next((repr(value) for path in PV_SOURCES if (value := _at(loop, path)) is not None), None)
        if source is not None:
            places[source].append(i)
    return {i: loops[0] for loops in places.values() for i in loops[1:]}


def _at(model: Any, path: tuple[str, ...]) -> Any:
    for key in path:
        model = model.get(key) if isinstance(model, dict) else getattr(model, key, None)
        if model is None:
            return None
    return model


def _selectors(config: Any, plc: Plc, influence: Influence) -> dict[int, Selector]:
    cfg = plc.cfg[: len(plc.loops)]
    barrier = {slot for c in cfg for slot in (c.sig_pv, c.sig_sp)}
    outs = {c.sig_out for c in cfg}
    readers: dict[int, list[int]] = defaultdict(list)
    for i, c in enumerate(cfg):
        for slot in influence.reach([c.sig_out], without=barrier | (outs - {c.sig_out})) - {c.sig_out}:
            readers[slot].append(i)
    kinds = {block.name: block.type for block in getattr(config, "blocks", ())}
    found: dict[int, Selector] = {}
    for slot, loops in readers.items():
        block = plc.signals[slot].partition(".")[0] if slot < len(plc.signals) else ""
        if len(loops) > 1 and "Select" in kinds.get(block, "") and plc.signals[slot].endswith(".MV"):
            selector = Selector(plc.signals[slot], LARGER in kinds[block], loops[0])
            found |= dict.fromkeys(loops, selector)
    return found
