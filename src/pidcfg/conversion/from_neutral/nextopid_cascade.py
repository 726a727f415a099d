"""The special connections of the cascades that neutral loops name."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.schemas.numbers import decimal_text

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.conversion.arithmetic import Span
    from pidcfg.conversion.builder import TargetBuilder
    from pidcfg.schemas.generic import GenericFile, Loop

OUTPUTS = {"TRK_IN": "TRK_OUT", "Windup_H_IN": "Windup_H_OUT", "Windup_L_IN": "Windup_L_OUT"}
"""What a master reads of its slave."""


def link(file: GenericFile, builders: Sequence[TargetBuilder]) -> None:
    """Wires every slave to its master, and the master to the first of its slaves."""
    served: dict[int, str] = {}
    for i, (b, loop) in enumerate(zip(builders, file.loops, strict=True)):
        master = _master(file.loops, i, b)
        if loop.mode == "cascade":
            note = "" if master is not None else "no loop gives it a set point: it is in automatic, and holds SP"
            b.put("CASC", master is not None, "mode", note, clamped=master is None)
        if master is not None:
            _wire(b, builders[master], served.get(master, ""))
            served.setdefault(master, b.data["name"])


def _master(loops: Sequence[Loop], i: int, b: TargetBuilder) -> int | None:
    """The loop whose output is this one's set point; dropped where that cannot be."""
    source, pv = loops[i].setpoint.source, loops[i].pv.range
    if source is None:
        return None
    outer = next((j for j, other in enumerate(loops) if other.name == source and j != i), None)
    if outer is None:
        b.drop("setpoint.source", f"no other loop is called {source}: write the set point in the program")
        return None
    output = loops[outer].output.range
    if output != pv:
        ranges = f"the output of {source} is {_text(output)}, this PV {_text(pv)}"
        b.drop("setpoint.source", f"{ranges}: wire SP_CASC to its MV with the scale that you mean")
        return None
    return outer


def _wire(b: TargetBuilder, master: TargetBuilder, other: str) -> None:
    slave, name = b.data["name"], master.data["name"]
    note = f"TRK_IN, TRK_VAL and windup inputs of {name} follow {other} only" if other else ""
    b.put("SP_CASC", f"{name}.MV", "setpoint.source", note)
    if other:
        return
    note = f"connections of the cascade with {slave}"
    master.put("TRK_VAL", f"{slave}.PV", None, note)
    for key, output in OUTPUTS.items():
        master.put(key, f"{slave}.{output}", None, note)


def _text(span: Span) -> str:
    return f"{decimal_text(span[0])} to {decimal_text(span[1])}"
