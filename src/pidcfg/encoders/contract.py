"""What a vendor's modules of this room give; ``tests/vendor_contract.py`` holds each of them to it by their types."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from pidcfg.encoders.image import Decoded, Settings
    from pidcfg.encoders.listing import FileKind
    from pidcfg.encoders.parameters import AnyEncoding, ParameterTable
    from pidcfg.encoders.regmap import LoopTuning, RegisterMap, TuningNumbers, Writer


class HasModules(Protocol):
    """What has modules: a vendor."""

    def module(self, what: str, /) -> Any:
        """The module of a part; raises `LookupError` where there is none."""


class Encoder(Protocol):
    """``encoders.<vendor>.image``: from configurations to words, and back."""

    def encode(self, config: Any, /) -> AnyEncoding:
        """The words of a configuration."""

    def decode(
        self,
        words: Any,
        settings: Sequence[Settings] = (),
        plc: Settings | None = None,
        options: Settings | None = None,
    ) -> Decoded:
        """The configuration of words by address, or by name; raises `DecodeError`."""

    def tuning_of(self, config: Any, loop: Any, /) -> LoopTuning:
        """How a loop holds its gains."""


class Files(Protocol):
    """``encoders.<vendor>.files``: the formats of its files."""

    @property
    def FORMATS(self) -> Mapping[str, FileKind]:  # noqa: N802 - a constant of the module
        """By name."""

    def checklist(self, config: Any, /) -> tuple[str, ...]:
        """What a person should check after the download."""


class Tables(Protocol):
    """``encoders.maps.<vendor>``: its registers or parameters."""

    @property
    def TABLES(self) -> Sequence[RegisterMap | ParameterTable]:  # noqa: N802 - a constant of the module
        """All that there are."""

    @property
    def TUNING_NUMBERS(self) -> TuningNumbers:  # noqa: N802 - a constant of the module
        """Where the gains stand."""

    @property
    def NO_REGISTER(self) -> tuple[str, ...]:  # noqa: N802 - a constant of the module
        """Settings that act on a loop and that no register has, by key; those of the PLC begin with ``plc.``."""

    @property
    def WRITERS(self) -> tuple[Writer, ...]:  # noqa: N802 - a constant of the module
        """Who else writes them."""


def encoder_of(vendor: HasModules) -> Encoder:
    """How a vendor encodes."""
    encoder: Encoder = vendor.module("encode")
    return encoder


def formats_of(vendor: HasModules) -> Files:
    """The formats of a vendor."""
    files: Files = vendor.module("formats")
    return files


def tables_of(vendor: HasModules) -> Tables:
    """The registers or parameters of a vendor."""
    tables: Tables = vendor.module("registers")
    return tables


@cache
def units_by_path(vendor: HasModules) -> Mapping[str, str]:
    """The units of the vendor's registers and parameters by the path of their value."""
    units: dict[str, str] = {}
    for path, unit in (row for table in tables_of(vendor).TABLES for row in table.units()):
        if unit:
            units.setdefault(path, unit)
    return units
