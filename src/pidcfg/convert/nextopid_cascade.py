"""The special connections of the cascades that neutral loops name."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.convert.nextopid_wires import same
from pidcfg.convert.terms import rounded, width
from pidcfg.schemas.base import decimal_text

if TYPE_CHECKING:
    from decimal import Decimal

    from pidcfg.convert.builder import Builder
    from pidcfg.convert.terms import Span
    from pidcfg.schemas.generic import GenericFile, Loop

OUTPUTS = {"TRK_IN": "TRK_OUT", "Windup_H_IN": "Windup_H_OUT", "Windup_L_IN": "Windup_L_OUT"}
"""What a master reads of its slave."""


def link(file: GenericFile, builders: list[Builder]) -> None:
    """Wires every slave to its master, and the master to the first of its slaves."""
    numbers = {loop.name: i for i, loop in reversed(list(enumerate(file.loops)))}
    served: dict[int, str] = {}
    for i, (b, loop) in enumerate(zip(builders, file.loops, strict=True)):
        source = loop.setpoint.source
        master = None if source is None else numbers.get(source)
        if source is not None and (master is None or master == i):
            b.drop("setpoint.source", f"no other loop is called {source}: write the set point in the program")
            master = None
        if loop.mode == "cascade":
            _cascade_mode(b, linked=master is not None)
        if master is not None:
            _wire(b, loop, builders[master], file.loops[master], served.get(master, ""))
            served.setdefault(master, b.data["name"])


def _cascade_mode(b: Builder, *, linked: bool) -> None:
    note = "" if linked else "no loop gives it a set point: it is in automatic, and holds SP"
    b.put("CASC", linked, "mode", note, assumed=not linked)


def _wire(b: Builder, loop: Loop, master: Builder, major: Loop, other: str) -> None:
    slave, name = b.data["name"], master.data["name"]
    spans = major.output.range, loop.pv.range
    b.put("SP_CASC", scaled(f"{name}.MV", *spans), "setpoint.source", "" if same(*spans) else "scaled to this PV")
    if other:
        b.mark("SP_CASC", "setpoint.source", f"TRK_IN, TRK_VAL and windup inputs of {name} follow {other} only")
        return
    note = f"connections of the cascade with {slave}"
    master.put("TRK_VAL", scaled(f"{slave}.PV", loop.pv.range, major.output.range), None, note)
    for key, output in OUTPUTS.items():
        master.put(key, f"{slave}.{output}", None, note)


def scaled(signal: str, source: Span, target: Span) -> str:
    """The expression that brings a signal from one range to the same place of another."""
    if same(source, target):
        return signal
    factor = f"{_number(width(target))} / {_number(width(source))}"
    first = f"({signal} - {_number(source[0])})" if source[0] else signal
    start = f" + {_number(target[0])}" if target[0] else ""
    return f"{first} * {factor}{start}"


def _number(value: Decimal) -> str:
    """A number in an expression, where a sign may not follow an operator."""
    text = decimal_text(rounded(value))
    return f"({text})" if value < 0 else text
