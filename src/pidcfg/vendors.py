"""One row per vendor: its key and its title. What the rest of the program knows about it is found by these.

Modules are named in text, so that listing the vendors imports nothing. No other module may branch on the
vendor.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from pidcfg.text.frozen import frozen

if TYPE_CHECKING:
    from pydantic import BaseModel


@frozen
class Vendor:
    """A PLC family: its key, from which the names of its modules follow, its title, and how its rules' codes begin."""

    key: str
    title: str
    prefix: str
    banks: tuple[str, ...] = ()
    """How its addresses begin, so that a question about one loads no other vendor; the registers are in its maps."""

    def load(self, part: str) -> Any:
        """The object that a row of `PARTS` names, imported on first use; raises `LookupError` where there is none."""
        module, name = self.module(part), self._locate(part)[1]
        if not hasattr(module, name):
            raise LookupError(f"{self.key} has no {part}: {module.__name__} has no {name}")
        return getattr(module, name)

    def module(self, part: str) -> Any:
        """The module that has the object, for its other names; raises `LookupError` where there is none."""
        name = self._locate(part)[0]
        try:
            return import_module(name)
        except ModuleNotFoundError as error:
            if error.name is None or not f"{name}.".startswith(f"{error.name}."):
                raise
            raise LookupError(f"{self.key} has no {part}: {error.name} is missing") from None

    def _locate(self, part: str) -> tuple[str, str]:
        """The module of a part, and the object's name in it."""
        module, _, name = PARTS[part].format(key=self.key, Key=self.key.capitalize()).partition(":")
        return f"pidcfg.{module}", name

    @property
    def starter(self) -> str:
        """The file that `pidcfg init` writes, within the package."""
        return f"cli/starters/{self.key}.yaml"

    @property
    def model(self) -> type[BaseModel]:
        """The schema of its configuration files."""
        model: type[BaseModel] = self.load("schema")
        return model


PARTS = {
    "schema": "schemas.{key}:{Key}File",
    "encode": "encoders.{key}.image:encode",
    "decode": "encoders.{key}.image:decode",
    "numbering": "encoders.{key}.files:NUMBERING",
    "points": "encoders.{key}.files:points",
    "tags": "encoders.{key}.image:tag_positions",
    "mode_of": "encoders.{key}.image:mode_of",
    "context": "validate.rules.{key}:{Key}Context",
    "rules": "validate.rules.{key}:RULES",
    "formats": "encoders.{key}.files:FORMATS",
    "format_names": "encoders.{key}:FORMATS",
    "decode_options": "encoders.{key}:DECODE_OPTIONS",
    "checklist": "encoders.{key}.files:checklist",
    "controller": "sim.controllers.{key}.scan:load",
    "virtual": "sim.controllers.{key}.scan:{Key}Registers",
    "registers": "encoders.maps.{key}:TABLES",
    "tuned": "encoders.maps.{key}:TUNING_NUMBERS",
    "written": "encoders.maps.{key}:WRITERS",
    "explainer": "output.explanation.{key}:EXPLAINER",
    "to_neutral": "conversion.{key}:to_neutral",
    "from_neutral": "conversion.{key}:from_neutral",
    "operation": "conversion.{key}:operations",
    "convert_options": "encoders.{key}:CONVERT_OPTIONS",
}
"""Module and name of every part of a vendor; the same for all."""

VENDORS = {
    v.key: v
    for v in (
        Vendor("dl06", "AutomationDirect DirectLOGIC DL06", "DL", ("V",)),
        Vendor("click", "AutomationDirect CLICK", "CK", ("C", "DS", "DF")),
        Vendor("ezlogix", "EZAutomation EZLogix", "EZ", ("R", "S")),
        Vendor("nextopid", "Altus NextoPID", "NX"),
        Vendor("dpide", "Delta AS", "DP"),
        Vendor("generic", "Neutral form", "GN"),
    )
}


def format_names() -> list[str]:
    """The file formats of all vendors, each once."""
    return list(dict.fromkeys(name for vendor in VENDORS.values() for name in vendor.load("format_names")))


def format_of(vendor: Vendor, name: str) -> Any:
    """One of a vendor's file formats; raises `KeyError` naming those it has."""
    formats = vendor.load("formats")
    if name not in formats:
        raise KeyError(f"{vendor.title} has no format {name}; it has {', '.join(formats)}")
    return formats[name]
