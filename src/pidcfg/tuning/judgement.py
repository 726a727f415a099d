"""Whether gains are to be trusted: the range of the rule, the margins of the loop, and what it does in time."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import atan, isinf, pi, sqrt
from typing import TYPE_CHECKING

from pidcfg.tuning.closed_loop import answer
from pidcfg.tuning.margins import margins
from pidcfg.tuning.rules import Process
from pidcfg.tuning.transfer import transfer_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.tuning.closed_loop import Answer
    from pidcfg.tuning.margins import Margins
    from pidcfg.tuning.methods import Method
    from pidcfg.tuning.rules import Cycle, Form, Gains
    from pidcfg.tuning.transfer import Transfer

LIVELIEST = 2.5
"""Of Ms: above it small errors of the process make the loop swing (D706)."""
SAMPLE_SHARE = 10
"""A sample time should be below this part of the time constant."""


@dataclass(frozen=True, slots=True)
class Judgement:
    """Whether the rule was made for the process, with its range in words, and how the loop behaves."""

    valid: bool
    reason: str
    margins: Margins | None = None
    """None: the loop is unstable, or the process is not known."""
    answer: Answer | None = None
    plant: Transfer | None = None
    """What the margins are those of; None: the process is not known."""
    known: bool = True
    """Whether there was a process to judge the gains by."""

    def warnings(self) -> Iterator[str]:
        """What an engineer has to know before the gains are used."""
        if not self.valid:
            yield f"outside the rule's range, which is {self.reason}"
        if self.margins is not None and self.margins.ms > LIVELIEST:
            yield f"Ms is {self.margins.ms:.3g}: up to 2 is robust, this loop swings when the process changes a little"
        elif self.known and self.margins is None:
            yield "with these gains the loop is unstable"


def judged(
    method: Method, form: Form, gains: Gains, process: Process | None, transfer: Transfer | None = None
) -> Judgement:
    """The judgement of gains on a process, or on the transfer function that it was reduced from."""
    if process is None:
        return Judgement(valid=True, reason="it has no limits; margins need the process's gain", known=False)
    valid, reason = method.range_of_validity(form, process)
    plant = transfer_of(process)
    if transfer is not None:
        plant = replace(transfer, dead_time=transfer.dead_time + process.sample_time / 2)
    found = margins(gains, plant)
    return Judgement(valid, reason, found, None if found is None else answer(gains, plant), plant)


def process_of_cycle(gain: float, cycle: Cycle) -> Process | None:
    """The lag with dead time that has this gain and ultimate cycle; None: no such process."""
    loud = gain * cycle.gain
    if loud <= 1:
        return None
    turned, w = sqrt(loud * loud - 1), 2 * pi / cycle.period
    return Process(gain, turned / w, (pi - atan(turned)) / w)


def remarks(process: Process) -> Iterator[str]:
    """What the rules' authors warn of."""
    if process.integrating:
        return
    if process.dead_time and process.time_constant / process.dead_time < 1:
        yield "the dead time is longer than the time constant: hard to control, whatever the gains"
    if process.sample_time and process.sample_time * SAMPLE_SHARE >= process.time_constant:
        yield "the sample time is not below a tenth of the time constant"


def finite(value: float) -> float | None:
    """A number for JSON; None where there is no limit."""
    return None if isinf(value) else value
