"""Whether the loops of a converted EZLogix go on while their PLC is stopped."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.conversion.operation.rules import Stopped
from pidcfg.refs import Decision

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.conversion.builder import TargetBuilder
    from pidcfg.conversion.operation.rules import Operation

D760 = Decision(
    760,
    "an EZLogix that stands for another PLC goes on while it is stopped only where the source's does",
    "`process_when_stopped` is written in a conversion: true where a loop of the source is independent of its CPU's "
    "mode, else false. A file of the same vendor keeps what it has. The check box is one for all loops.",
    "The dialog's default is to go on (manual, Process PID when PLC is Stopped). The other families' loops stand still "
    "with their PLC, and a heater that goes on behind a STOP is what nobody looks for.",
)


def stopped_section(builders: list[TargetBuilder], operations: Sequence[Operation]) -> dict[str, Any]:
    """Whether the loops go on while the PLC is stopped (D760); nothing for loops that come from an EZLogix file."""
    answers = {operation.stopped for operation in operations}
    if not answers or Stopped.AS_GIVEN in answers:
        return {}
    goes_on = Stopped.GOES_ON in answers
    note = "the dialog's check box" if goes_on else "clear the dialog's check box: its default is to go on"
    builders[0].mark("/plc.process_when_stopped", None, note)
    return {"process_when_stopped": goes_on}
