"""What a drafted run should show: set points reached, little overshoot, no outermost alarm."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.draft.course import Line
from pidcfg.draft.numbers import digits

if TYPE_CHECKING:
    from pidcfg.draft.course import Course, Units

BETWEEN = 0.02
"""Of the range of the PV: how near to its set point a loop shall end."""
OVERSHOOT = 30
"""In %: what a step may overshoot on a plant that suits the loop."""


def expectations(units: Units, course: Course) -> list[Line]:
    """What such a run should show."""
    lines: list[Line] = []
    stepped = {line.data["loop"]: line.data["set"]["setpoint"] for line in course.events if _is_setpoint(line)}
    for plan in units.plans.values():
        if plan.name in stepped and plan.integrates:
            band = BETWEEN * units.span(plan) + 1.5 * units.plc.dead_band(plan.i, units.plc.sig)
            signal = units.process(plan) if units.process(plan) != plan.name else f"{plan.name}.PV"
            row = {"signal": signal, "final": stepped[plan.name], "tolerance": digits(band, 2)}
            lines.append(Line(row))
            if any(line.data.get("loop") == plan.name and line.data["at"] for line in course.events):
                lines.append(Line({"loop": plan.name, "metric": "overshoot", "max": f"{OVERSHOOT} %"}))
        alarms = [a for a in units.plc.outer_alarms if a.startswith("pv_") and units.plc.alarm_is_on(plan.i, a)]
        lines += [Line({"loop": plan.name, "alarm": alarm, "never": True}) for alarm in alarms]
    lines += [Line({"loop": line.data["loop"], "mode": "auto"}) for line in course.events if "mode" in line.data]
    return lines


def _is_setpoint(line: Line) -> bool:
    return "loop" in line.data and "setpoint" in line.data.get("set", {})
