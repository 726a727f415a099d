"""What the EZLogix rules look at: the file, and each loop with what its registers hold."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pidcfg.diagnostics import Path
    from pidcfg.encoders.image import Encoding
    from pidcfg.schemas.ezlogix import EzlogixFile


@dataclass(frozen=True)
class EzlogixContext:
    """A configuration with its encoding."""

    config: EzlogixFile
    encoding: Encoding

    @property
    def explained(self) -> frozenset[Path]:
        """Places whose limits a rule of EZLogix's own explains better than the rules for every vendor."""
        return frozenset()
