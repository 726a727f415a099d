"""What a vendor's modules of this room have to give, as `pidcfg.encoders.contract` has it for the encoders."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from pidcfg.conversion.ledger import NeutralLoop, TargetFile
    from pidcfg.conversion.operation import Operation, VendorSettings
    from pidcfg.encoders.contract import Parts
    from pidcfg.schemas.generic import GenericFile


class Source(Protocol):
    """``conversion.from_<vendor>``: from a configuration to the neutral form."""

    @property
    def OWN_SETTINGS(self) -> VendorSettings:  # noqa: N802 - a constant of the module
        """What a conversion within the vendor keeps."""

    @property
    def NOTHING_LOST(self) -> Mapping[str, str]:  # noqa: N802 - a constant of the module
        """Keys that may be left out, and why nothing is lost then."""

    def to_neutral(self, config: Any, /) -> list[NeutralLoop]:
        """The loops in the neutral form."""

    def operations(self, config: Any, /) -> list[Operation]:
        """How each loop behaves where the neutral form says nothing."""


class Target(Protocol):
    """``conversion.to_<vendor>``: from the neutral form to a configuration."""

    def from_neutral(
        self, file: GenericFile, options: Mapping[str, Any], operations: Sequence[Operation] = (), /
    ) -> TargetFile:
        """The configuration with the exact values."""


def source_of(vendor: Parts) -> Source:
    """How a vendor's configurations become neutral."""
    source: Source = vendor.module("to_neutral")
    return source


def target_of(vendor: Parts) -> Target:
    """How a vendor's configurations are made of neutral ones."""
    target: Target = vendor.module("from_neutral")
    return target
