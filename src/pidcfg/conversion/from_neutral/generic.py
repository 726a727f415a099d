"""The neutral form as a target: every field goes to itself."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.conversion.ledger import TargetField, TargetFile
from pidcfg.conversion.to_neutral.generic import fields, plain

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pidcfg.schemas.generic import GenericFile


def from_neutral(file: GenericFile, options: Mapping[str, Any]) -> TargetFile:  # noqa: ARG001 - nothing to choose
    """The file as it is."""
    return TargetFile(plain(file), [[TargetField(path, path) for path, _ in fields(loop)] for loop in file.loops])
