"""What becomes of the set point that a file gives."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from pidcfg.validate.rule import reported_once
from pidcfg.validate.views import Placed

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from pidcfg.validate.rule import Finding


class Setpoint(Protocol):
    """The part of a loop that is its set point."""

    @property
    def value(self) -> object:
        """The set point; None when it is not given."""


class Loop(Protocol):
    """A loop with modes and a set point."""

    @property
    def mode(self) -> str:
        """The mode that the loop is meant for."""

    @property
    def bumpless(self) -> object:
        """How the loop changes from Manual to Auto."""

    @property
    def setpoint(self) -> Setpoint:
        """Its set point."""


class SetpointView(Placed, Protocol):
    """A loop whose set point stands in a register."""

    @property
    def loop(self) -> Loop:
        """The loop as the file has it."""

    def shown(self, name: str) -> str:
        """A register's value as a message quotes it."""


def setpoint_replaced_by_pv(views: Sequence[SetpointView], bumpless: object) -> Iterator[Finding]:
    """The loops whose set point the PV replaces on the change to Auto, which one kind of bumpless transfer does."""
    replaced = [
        view
        for view in views
        if view.loop.mode == "auto" and view.loop.bumpless == bumpless and view.loop.setpoint.value is not None
    ]
    return reported_once(replaced, lambda view: view.at("setpoint", "value", value=view.shown("setpoint")))
