"""Lines that are true of the side that runs: one that says something else of it explains nothing."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.conversion.operation.rules import PREFIX
from pidcfg.verification.neutral import neutral_values, same

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from pidcfg.conversion.operation.rules import Operation
    from pidcfg.schemas.generic import Loop
    from pidcfg.verification.trial import Side
    from pidcfg.verification.twin import Line


def true_lines(lines: Sequence[Line], loop: Loop, side: Side, j: int) -> Iterator[Line]:
    """The lines that fit the loop at ``j`` of a side; ``loop`` is the one that it is held against."""
    operation: Operation = side.vendor.load("operation")(side.config)[j]
    _, values = neutral_values(loop, side.loop(j))
    for line in lines:
        if line.neutral.startswith(PREFIX):
            rule = line.neutral.removeprefix(PREFIX)
            same_band = rule != "deadband" or same(values.get(rule), loop.deadband)
            if line.held in _answers(operation, rule) and same_band:
                yield line
        elif same(values.get(line.neutral), line.held):
            yield line


def _answers(operation: Operation, rule: str) -> set[str]:
    """What a loop does by a rule; without an integral it goes to Auto in another way."""
    answers = [getattr(operation, rule, None)]
    if rule == "transfer":
        answers.append(operation.without_integral)
    return {answer.text for answer in answers if answer is not None}
