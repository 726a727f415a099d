"""Cascades: where a set point comes from."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.encoders.generic.decisions import D302
from pidcfg.schemas.names import nearest
from pidcfg.validate.ideas.cascades import rings
from pidcfg.validate.ideas.duplicates import at_both
from pidcfg.validate.rule import Findings, error, per_loop, warning

if TYPE_CHECKING:
    from pidcfg.validate.rules.generic.context import GenericContext, LoopView


def master_of(context: GenericContext, view: LoopView) -> LoopView | None:
    """The loop whose output is this one's set point."""
    return context.by_name.get(view.loop.setpoint.source or "")


@error("GN831", D302, "there is no loop {source}{cure}")
def unknown_cascade_source(context: GenericContext) -> Findings:
    """The source of the set point is no loop of the file.

    Why: the set point would come from nowhere.

    Fix: write the name of a loop of this file.
    """
    for view in context.loops:
        source = view.loop.setpoint.source
        if source is not None and source not in context.by_name:
            near = nearest(source, context.by_name)
            yield view.at("setpoint", "source", source=source, cure=f"; did you mean {near}?" if near else "")


@per_loop
@error("GN832", D302, "the set point of {name} is its own output")
def cascade_to_itself(view: LoopView) -> Findings:
    """A loop is the source of its own set point.

    Why: the output would drive the set point, which drives the output.

    Fix: write the name of the master.
    """
    if view.loop.setpoint.source == view.name:
        yield view.at("setpoint", "source", name=view.name)


@error("GN833", D302, "the cascade goes in a ring: {names}")
def cascade_ring(context: GenericContext) -> Findings:
    """Loops are each other's masters.

    Why: a cascade has an outermost loop with a set point of its own.

    Fix: take `source` from the outermost loop.
    """
    masters = [master_of(context, view) for view in context.loops]
    for ring in rings([None if master is None else master.index for master in masters]):
        if len(ring) > 1:
            names = [context.loops[i].name for i in ring]
            way = " - ".join((*names, names[0]))
            for i in ring:
                view = context.loops[i]
                others = (name for name in names if name != view.name)
                yield view.at("setpoint", "source", names=way).shared_with(*others)


@per_loop
@error("GN834", D302, "the mode is cascade, but setpoint.source is not given")
def cascade_without_source(view: LoopView) -> Findings:
    """A loop is meant to run in cascade and has no master.

    Why: there is nothing that its set point could follow.

    Fix: write `setpoint: {source: …}` with the master's name, or `mode: auto`.
    """
    if view.loop.mode == "cascade" and view.loop.setpoint.source is None:
        yield view.at("mode")


@warning(
    "GN835", D302, "the output of {master} has the range {low} to {high}, the PV of {slave} {own_low} to {own_high}"
)
def cascade_scales_differ(context: GenericContext) -> Findings:
    """The master's output and the slave's PV have different ranges.

    Why: the master's output is the slave's set point as it is, in units of the slave's PV. A master from 0 to 100 %
    asks a flow from 0 to 40 m3/h for what it never reaches, and its gain acts on another scale.

    Fix: give the master `output.range` the slave's `pv.range`, and its gain in those units; limit it by
    `output.limits`.
    """
    for view in context.loops:
        master = master_of(context, view)
        if master is None or master is view:
            continue
        output, pv = master.loop.output.range, view.loop.pv.range
        if output != pv:
            values = {
                "master": master.name,
                "slave": view.name,
                "low": output[0],
                "high": master.out(output[1]),
                "own_low": pv[0],
                "own_high": view.pv(pv[1]),
            }
            at_slave, at_master = view.at("setpoint", "source"), master.at("output", "range")
            yield from at_both(view, at_slave, master, at_master, **values)
