"""The neutral form as a target: every field goes to itself."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.conversion.ledger import Put, Target
from pidcfg.conversion.to_neutral.generic import fields, plain

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pidcfg.schemas.generic import GenericFile


def from_neutral(file: GenericFile, options: Mapping[str, Any]) -> Target:  # noqa: ARG001 - there is nothing to choose
    """The file as it is."""
    data = plain(file)
    return Target(data, [[Put(path, path) for path, _ in fields(loop)] for loop in file.loops])
