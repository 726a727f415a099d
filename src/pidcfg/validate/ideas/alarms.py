"""Alarms of the PV and of its deviation, against the set point, the deadband and the hysteresis."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Generic, Protocol, TypeVar

from pidcfg.validate.views import Placed

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from decimal import Decimal

    from pidcfg.validate.rule import Findings

PV_POINTS = ("low_low", "low", "high", "high_high")
"""The alarm points of the PV, from below."""
Number = TypeVar("Number", int, "Decimal")
"""What registers hold: counts, or numbers in the PV's unit."""


class AlarmView(Placed, Protocol, Generic[Number]):
    """A loop with four PV alarms, deviation alarms and a hysteresis, each in a register of its own."""

    @property
    def pv_alarms(self) -> bool:
        """Whether the bit of the four PV alarms is set."""

    @property
    def deviation_alarms(self) -> bool:
        """Whether the bit of the two deviation alarms is set."""

    @property
    def deadband_on(self) -> bool:
        """Whether the deadband's bit is set."""

    def value(self, name: str) -> object:
        """The value of a register; None when there is none."""

    def holds(self, *names: str) -> list[Number]:
        """What several registers hold; empty as soon as one value does not fit."""

    def shown(self, name: str) -> str:
        """A register's value as a message quotes it."""

    def distance(self, value: Number) -> str:
        """A distance on the PV's scale as a message quotes it."""


def neighbours_out_of_order(
    view: AlarmView[Number], prefix: str, points: Sequence[str] = PV_POINTS
) -> Iterator[tuple[str, str, bool]]:
    """Neighbouring alarm points that do not ascend, and whether they are equal."""
    for low, high in pairwise(points):
        words = view.holds(f"{prefix}_{low}", f"{prefix}_{high}")
        if words and words[0] >= words[1]:
            yield low, high, words[0] == words[1]


def alarm_beyond(view: AlarmView[Number], value: Number) -> str | None:
    """The PV alarm, low or high, that a value lies beyond; None between them, or where they are off or crossed."""
    points = view.holds("pv_low", "pv_high")
    if not view.pv_alarms or not points or points[0] >= points[1] or points[0] <= value <= points[1]:
        return None
    return "low" if value < points[0] else "high"


def deadband_of_zero(view: AlarmView[Number]) -> Findings:
    """A deadband that is on and ignores nothing."""
    if view.deadband_on and view.holds("deadband") == [0]:
        key = "deadband_enabled" if view.value("deadband") is None else "deadband"
        yield view.at("error", key, value=view.shown("deadband"))


def alarm_within(
    view: AlarmView[Number], width: Number, setpoint: Number | None, deviation: tuple[str, str]
) -> tuple[str, Number] | None:
    """The first alarm that is no further from the set point than a width, and how far it is.

    ``deviation``: the name and the register of the nearer one of the deviation alarms.
    """
    name, register = deviation
    distances = [(name, limit) for limit in view.holds(register)] if view.deviation_alarms else []
    points = view.holds("pv_low", "pv_high") if view.pv_alarms else []
    if points and setpoint is not None:
        distances += [("low", setpoint - points[0]), ("high", points[1] - setpoint)]
    return next(((alarm, distance) for alarm, distance in distances if 0 < distance <= width), None)


def hysteresis_spans_normal_zone(view: AlarmView[Number], most: Number | None = None) -> Findings:
    """A hysteresis as wide as the zone between low and high alarm; above ``most`` another rule reports it."""
    words = view.holds("pv_low", "pv_high", "hysteresis")
    if view.pv_alarms and words and 0 < words[1] - words[0] <= words[2] and (most is None or words[2] <= most):
        zone = view.distance(words[1] - words[0])
        yield view.at("alarms", "hysteresis", value=view.shown("hysteresis"), zone=zone)
