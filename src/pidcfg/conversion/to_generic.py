"""The neutral form as a target: every field goes to itself."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.conversion.from_generic import fields_by_path, to_plain_data
from pidcfg.conversion.ledger import TargetField, TargetFile
from pidcfg.conversion.operation import ADDED_ANTI_WINDUP

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from pidcfg.conversion.operation import Operation
    from pidcfg.schemas.generic import GenericFile


def from_neutral(
    file: GenericFile,
    options: Mapping[str, Any],
    operations: Sequence[Operation] = (),
) -> TargetFile:
    """The file as it is; an integral that some limit stops is one that the limits of the output stop (D342)."""
    data = to_plain_data(file)
    stopped = {i for i, operation in enumerate(operations) if operation.bounds_integral}
    puts = []
    for i, loop in enumerate(file.loops):
        puts.append([TargetField(path, path) for path, _ in fields_by_path(loop)])
        if i in stopped and not loop.anti_windup:
            data["loops"][i]["anti_windup"] = True
            puts[i] = [put for put in puts[i] if put.path != "anti_windup"]
            puts[i].append(TargetField("anti_windup", "anti_windup", ADDED_ANTI_WINDUP, assumed=True))
    return TargetFile(data, puts)
