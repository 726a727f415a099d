"""What the standing expectations ask of a PLC, with the answers of one that has no such thing.

Design. Names and masks are tables; what follows from the present registers and signals is a method. A vendor overrides
what is so with it, next to the attributes of `pidcfg.sim.plc.Plc` that the names come from.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence

    from pidcfg.sim.problems import NoValue

IN_CONTROL = ("auto", "cascade")
"""The modes in which a loop controls, as every vendor calls them."""


class LoopFacts(ABC):
    """What verdicts have to know of a PLC's loops, besides what the report shows."""

    cfg: Sequence[Any]
    st: Sequence[Any]
    loops: Sequence[str]
    goals: Sequence[str]
    scales: Sequence[tuple[float, float, int]]
    modes: Mapping[str, int]
    alarm_bits: Mapping[str, int]
    outer_alarms: Sequence[str] = ()
    """The outermost alarms of ``alarm_bits``: high-high, low-low, red."""
    alarm_limits: Mapping[str, str] = {}
    """Where the configuration of a loop has the limit of each alarm."""
    unreached: float = 0.0
    """A limit from which on, either way, an alarm is off."""
    error_flags: Sequence[str] = ()
    """Flags that mean an error of the set-up."""
    tuning_flags: Sequence[str] = ()
    """Flags that are on while an auto-tune runs, where that is no mode."""
    word_owners: Mapping[str, int] = {}
    """Error registers that belong to one loop, with its number; the others concern them all."""
    problems: Sequence[NoValue] = ()
    """Words and parameters that are no value of their format."""
    mode_keys: Collection[str] = ()
    """Parameters that choose the mode, which an event may set."""

    @property
    def control_bits(self) -> int:
        """The bits of a status that mean Auto or Cascade."""
        return sum(self.modes.get(mode, 0) for mode in IN_CONTROL)

    @property
    def outer_bits(self) -> int:
        """The bits of a status that are outermost alarms."""
        return sum(self.alarm_bits[name] for name in self.outer_alarms)

    @property
    def masters(self) -> Sequence[int]:
        """For each loop the one whose output is its set point; −1: there is none."""
        return [-1] * len(self.loops)

    @property
    def flow(self) -> Iterable[tuple[int, int]]:
        """Pairs of signals within the PLC, the first of which moves the second, besides the loops' own."""
        for c, master in zip(self.cfg, self.masters, strict=False):
            if master >= 0:
                yield self.cfg[master].sig_out, c.sig_sp

    def intended_mode(self, loop: int, sig: Sequence[float]) -> str:  # noqa: ARG002 - in most PLCs it is requested
        """The mode that a loop shall be in, as its configuration and its inputs say now."""
        return self.goals[loop]

    def pv_range(self, loop: int) -> tuple[float, float] | None:
        """The ends of a PV's range; None: the configuration gives none."""
        return self.scales[loop][:2]

    def alarm_is_on(self, loop: int, alarm: str) -> bool:
        """Whether an alarm can come: it is switched on and has a limit."""
        limit = self.alarm_limits.get(alarm)
        return limit is None or bool(abs(getattr(self.cfg[loop], limit)) < self.unreached)

    def alarm_level(self, loop: int, alarm: str) -> float | None:
        """Where an alarm comes on, in the unit of the PV's signal: a PV, or a distance from the set point.

        None: the alarm is off, or is about no level.
        """
        limit = self.alarm_limits.get(alarm)
        return float(getattr(self.cfg[loop], limit)) if limit is not None and self.alarm_is_on(loop, alarm) else None

    def given_set_point(self, loop: int, sig: Sequence[float]) -> float:
        """At the start: the set point that the configuration gives a loop, before the PLC limits it."""
        return float(sig[self.cfg[loop].sig_sp])

    def mode_inputs(self, loop: int) -> Collection[int]:  # noqa: ARG002 - in most PLCs an operator chooses the mode
        """The signals of the program that choose a loop's mode."""
        return ()

    @abstractmethod
    def output_limits(self, loop: int, sig: Sequence[float]) -> tuple[float, float]:
        """The present limits of a loop's output, in the unit of its signal."""

    def inner_deviation(self, loop: int) -> float | None:  # noqa: ARG002 - not every PLC has such an alarm
        """The inner deviation alarm, in the unit of the PV's signal; None: it is off."""
        return None

    def integrates(self, loop: int, sig: Sequence[float]) -> bool:  # noqa: ARG002 - in most PLCs the state has it
        """Whether a loop has an integral, so that no error may last."""
        return bool(self.st[loop].reset > 0.0)

    def dead_band(self, loop: int, sig: Sequence[float]) -> float:  # noqa: ARG002 - registers
        """The error within which a loop does nothing, in the unit of the PV's signal."""
        return 0.0

    def set_up_errors(self, loop: int) -> Iterator[str]:
        """Errors of a loop's set-up that are no flag, in words: what is no value of its format (D338)."""
        yield from (problem.text for problem in self.problems if problem.setting and problem.loop == loop)

    def program_errors(self, sig: Sequence[float]) -> Iterable[str]:  # noqa: ARG002 - most PLCs have nothing but loops
        """Errors of what is no loop, in words."""
        return ()

    def only_switches(self, loop: int) -> bool:  # noqa: ARG002 - most loops do not
        """Whether a loop's output is nothing but on or off."""
        return False

    def pulse_cycle(self, loop: int) -> float:  # noqa: ARG002 - most outputs are no pulses
        """The period of the pulses that a loop's output makes, in s; 0: it makes none."""
        return 0.0

    def windup_input(self, loop: int, sig: Sequence[float]) -> bool:  # noqa: ARG002 - most PLCs have none
        """Whether a loop is told from outside that its output is limited."""
        return False

    def left_out(
        self,
        loop: int,  # noqa: ARG002 - most PLCs have no selector
        sig: Sequence[float],  # noqa: ARG002
        own: Collection[int],  # noqa: ARG002
        rivals: Collection[int],  # noqa: ARG002
    ) -> bool:
        """Whether a selector of the program leaves a loop's output out and takes that of another loop.

        ``own`` are the signals that follow the loop's output, ``rivals`` those that follow others.
        """
        return False

    def operated(self, image: Any) -> Any:
        """The same image with the operator's inputs of each loop in his own hand; most PLCs have no others."""
        return image
