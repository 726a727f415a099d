"""The filter of a derivative on two sides that work it out differently: which time constants are alike."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.conversion.operation.rules import PREFIX, Smoothing

if TYPE_CHECKING:
    from decimal import Decimal

    from pidcfg.conversion.ledger import Change
    from pidcfg.schemas.generic import Loop

SMOOTHING, FILTER = f"{PREFIX}smoothing", "tuning.derivative_filter"
NEAR = 0.01
"""Share of a change by which two filters may let a different one through."""


def rules_of(line: Change) -> tuple[Smoothing, Smoothing]:
    """The rules of source and target, of which a line of the report tells."""
    before, after = (next(rule for rule in Smoothing if rule.text == text) for text in (line.source, line.target))
    return before, after


def alike(line: Change, other: Loop) -> Decimal:
    """The time constant with which the source's filter lets as much through as the target's."""
    before, after = rules_of(line)
    return before.time(after.share(other.tuning.derivative_filter, other.sample_time), other.sample_time)


def lets_through_the_same(line: Change, loop: Loop, other: Loop) -> bool:
    """Whether both filters let as much of a change through in a sample."""
    shares = [
        rule.share(one.tuning.derivative_filter, one.sample_time)
        for rule, one in zip(rules_of(line), (loop, other), strict=True)
    ]
    return abs(float(shares[0] - shares[1])) <= NEAR


def further(line: Change, loop: Loop) -> float:
    """How much more of a change one of both rules lets through in a sample, with the time constant of a loop."""
    one, two = (rule.share(loop.tuning.derivative_filter, loop.sample_time) for rule in rules_of(line))
    return abs(float(one - two))
