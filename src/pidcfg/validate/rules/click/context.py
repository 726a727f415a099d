"""What the CLICK rules look at: the file, and each loop with what its registers hold."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pidcfg.diagnostics import Path
    from pidcfg.encoders.image import Encoding
    from pidcfg.schemas.click import ClickFile


@dataclass(frozen=True)
class ClickContext:
    """A configuration with its encoding."""

    config: ClickFile
    encoding: Encoding

    @property
    def explained(self) -> frozenset[Path]:
        """Places whose limits a rule of CLICK's own explains better than the rules for every vendor."""
        return frozenset()
