"""When a rounded value is a loss: how far each kind of number may be off."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING

from pidcfg.conversion.ledger import LOSSES
from pidcfg.refs import Decision
from pidcfg.schemas.numbers import NUMBER

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.conversion.ledger import Change

D340 = Decision(
    340,
    "a value that is rounded too far is a loss",
    "A gain may be 2 % off, a time 5 %, the time constant of a filter 10 %, a deadband, a hysteresis, a rate of "
    "change or a set point on the few counts of a root 10 %; `--max-loss` says otherwise. A value beyond stays "
    "`rounded` and is a loss. Errors are those of time constants and gains in engineering units, not of the numbers in "
    "registers.",
    "2 % of a gain is within what a tuning leaves open, and the steps of all registers are finer at usual gains; times "
    "and filters move a loop less. A filter word of 0.2 for 0.23 is 14 % off, its time constant 18 %.",
)
KINDS = {
    "tuning.gain": "gain",
    "output.max_rate": "gain",
    "sample_time": "time",
    "tuning.integral_time": "time",
    "tuning.derivative_time": "time",
    "output.pulse.period": "time",
    "output.pulse.min_on": "time",
    "output.pulse.min_off": "time",
    "tuning.derivative_filter": "filter",
    "pv.filter": "filter",
    "setpoint.value": "band",
    "deadband": "band",
    "alarms.rate_of_change": "band",
    "alarms.hysteresis": "band",
}
"""The limit of each neutral number; positions are as near as their counts are, but for the few of a root."""


@dataclass(frozen=True, slots=True)
class MaxLoss:
    """How far numbers may be rounded without being a loss, in % of the value (D340)."""

    gain: float = 2.0
    time: float = 5.0
    filter: float = 10.0
    band: float = 10.0

    def of(self, neutral: Sequence[str]) -> float:
        """The limit of a line about these neutral fields; infinite without one."""
        limits = [float(getattr(self, KINDS[name])) for name in neutral if name in KINDS]
        return min(limits, default=float("inf"))


DEFAULT = MaxLoss()


class MaxLossError(ValueError):
    """A text that is no list of limits."""


def parse_max_loss(text: str) -> MaxLoss:
    """``gain=2%,time=5%``: those that are not named keep their limits; raises `MaxLossError`."""
    names = [field.name for field in fields(MaxLoss)]
    limits = {}
    for part in text.split(","):
        name, _, percent = (piece.strip() for piece in part.partition("="))
        percent = percent.removesuffix("%").strip()
        value = float(percent) if NUMBER.fullmatch(percent) else -1.0
        if name not in names or not 0 <= value < float("inf"):
            raise MaxLossError(f"{part.strip()!r}; write limits such as gain=2%,time=5% ({', '.join(names)})")
        limits[name] = value
    return replace(DEFAULT, **limits)


def judged(change: Change, limits: MaxLoss) -> Change:
    """A line, a loss when it is one by its kind or its error."""
    beyond = change.error_percent > limits.of(change.neutral)
    return replace(change, loss=True) if beyond and change.kind not in LOSSES else change
