"""One row per vendor: everything that the rest of the program knows about it, by name until it is needed.

A row holds text, so that listing the vendors imports nothing; the accessors import what they name. There is no other
place that may ask which vendor it is.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable

    from pydantic import BaseModel


@dataclass(frozen=True, slots=True)
class Vendor:
    """A PLC family; ``module:attribute`` of its schema, codecs, rules, writers, controller, texts and starter file."""

    key: str
    title: str
    schema: str
    encode: str
    decode: str
    context: str
    rules: str
    formats: str
    decode_options: str
    checklist: str
    controller: str
    registers: str
    explainer: str
    tuned: str
    starter: str
    to_neutral: str
    from_neutral: str
    convert_options: str

    def load(self, what: str) -> Any:
        """The object that a column names, imported on first use."""
        module, _, attribute = getattr(self, what).partition(":")
        return getattr(import_module(module), attribute)

    @property
    def model(self) -> type[BaseModel]:
        """The schema of its configuration files."""
        model: type[BaseModel] = self.load("schema")
        return model

    @property
    def encoder(self) -> Callable[[Any], Any]:
        """Configuration to `pidcfg.encoders.image.Encoding`."""
        encoder: Callable[[Any], Any] = self.load("encode")
        return encoder


# fmt: off
VENDORS = {
    v.key: v
    for v in (
        Vendor(
            key="dl06",
            title="AutomationDirect DirectLOGIC DL06",
            schema="pidcfg.schemas.dl06:Dl06File",
            encode="pidcfg.encoders.dl06.encode:encode",
            decode="pidcfg.encoders.dl06.decode:decode",
            context="pidcfg.validate.rules.dl06.context:Dl06Context",
            rules="pidcfg.validate.rules.dl06:RULES",
            formats="pidcfg.encoders.dl06.files:FORMATS",
            decode_options="pidcfg.encoders.dl06.files:DECODE_OPTIONS",
            checklist="pidcfg.encoders.dl06.files:checklist",
            controller="pidcfg.sim.controllers.dl06.scan:load",
            registers="pidcfg.encoders.maps.dl06:TABLES",
            explainer="pidcfg.explain.dl06:EXPLAINER",
            tuned="pidcfg.encoders.maps.dl06:TUNED",
            starter="starters/dl06.yaml",
            to_neutral="pidcfg.convert.dl06:to_neutral",
            from_neutral="pidcfg.convert.dl06:from_neutral",
            convert_options="pidcfg.convert.dl06:CONVERT_OPTIONS",
        ),
        Vendor(
            key="click",
            title="AutomationDirect CLICK",
            schema="pidcfg.schemas.click:ClickFile",
            encode="pidcfg.encoders.click.encode:encode",
            decode="pidcfg.encoders.click.decode:decode",
            context="pidcfg.validate.rules.click.context:ClickContext",
            rules="pidcfg.validate.rules.click:RULES",
            formats="pidcfg.encoders.click.files:FORMATS",
            decode_options="pidcfg.encoders.click.files:DECODE_OPTIONS",
            checklist="pidcfg.encoders.click.files:checklist",
            controller="pidcfg.sim.controllers.click.scan:load",
            registers="pidcfg.encoders.maps.click:TABLES",
            explainer="pidcfg.explain.click:EXPLAINER",
            tuned="pidcfg.encoders.maps.click:TUNED",
            starter="starters/click.yaml",
            to_neutral="pidcfg.convert.click:to_neutral",
            from_neutral="pidcfg.convert.click:from_neutral",
            convert_options="pidcfg.convert.click:CONVERT_OPTIONS",
        ),
        Vendor(
            key="ezlogix",
            title="EZAutomation EZLogix",
            schema="pidcfg.schemas.ezlogix:EzlogixFile",
            encode="pidcfg.encoders.ezlogix.encode:encode",
            decode="pidcfg.encoders.ezlogix.decode:decode",
            context="pidcfg.validate.rules.ezlogix.context:EzlogixContext",
            rules="pidcfg.validate.rules.ezlogix:RULES",
            formats="pidcfg.encoders.ezlogix.files:FORMATS",
            decode_options="pidcfg.encoders.ezlogix.files:DECODE_OPTIONS",
            checklist="pidcfg.encoders.ezlogix.files:checklist",
            controller="pidcfg.sim.controllers.ezlogix.scan:load",
            registers="pidcfg.encoders.maps.ezlogix:TABLES",
            explainer="pidcfg.explain.ezlogix:EXPLAINER",
            tuned="pidcfg.encoders.maps.ezlogix:TUNED",
            starter="starters/ezlogix.yaml",
            to_neutral="pidcfg.convert.ezlogix:to_neutral",
            from_neutral="pidcfg.convert.ezlogix:from_neutral",
            convert_options="pidcfg.convert.ezlogix:CONVERT_OPTIONS",
        ),
        Vendor(
            key="nextopid",
            title="Altus NextoPID",
            schema="pidcfg.schemas.nextopid:NextopidFile",
            encode="pidcfg.encoders.nextopid.encode:encode",
            decode="pidcfg.encoders.nextopid.decode:decode",
            context="pidcfg.validate.rules.nextopid.context:NextopidContext",
            rules="pidcfg.validate.rules.nextopid:RULES",
            formats="pidcfg.encoders.nextopid.files:FORMATS",
            decode_options="pidcfg.encoders.nextopid.files:DECODE_OPTIONS",
            checklist="pidcfg.encoders.nextopid.files:checklist",
            controller="pidcfg.sim.controllers.nextopid.scan:load",
            registers="pidcfg.encoders.maps.nextopid:TABLES",
            explainer="pidcfg.explain.nextopid:EXPLAINER",
            tuned="pidcfg.encoders.maps.nextopid:TUNED",
            starter="starters/nextopid.yaml",
            to_neutral="pidcfg.convert.nextopid:to_neutral",
            from_neutral="pidcfg.convert.nextopid:from_neutral",
            convert_options="pidcfg.convert.nextopid:CONVERT_OPTIONS",
        ),
        Vendor(
            key="dpide",
            title="Delta AS",
            schema="pidcfg.schemas.dpide:DpideFile",
            encode="pidcfg.encoders.dpide.encode:encode",
            decode="pidcfg.encoders.dpide.decode:decode",
            context="pidcfg.validate.rules.dpide.context:DpideContext",
            rules="pidcfg.validate.rules.dpide:RULES",
            formats="pidcfg.encoders.dpide.files:FORMATS",
            decode_options="pidcfg.encoders.dpide.files:DECODE_OPTIONS",
            checklist="pidcfg.encoders.dpide.files:checklist",
            controller="pidcfg.sim.controllers.dpide.scan:load",
            registers="pidcfg.encoders.maps.dpide:TABLES",
            explainer="pidcfg.explain.dpide:EXPLAINER",
            tuned="pidcfg.encoders.maps.dpide:TUNED",
            starter="starters/dpide.yaml",
            to_neutral="pidcfg.convert.dpide:to_neutral",
            from_neutral="pidcfg.convert.dpide:from_neutral",
            convert_options="pidcfg.convert.dpide:CONVERT_OPTIONS",
        ),
        Vendor(
            key="generic",
            title="Neutral form",
            schema="pidcfg.schemas.generic:GenericFile",
            encode="pidcfg.encoders.generic.encode:encode",
            decode="pidcfg.encoders.generic.decode:decode",
            context="pidcfg.validate.rules.neutral.context:NeutralContext",
            rules="pidcfg.validate.rules.neutral:RULES",
            formats="pidcfg.encoders.generic.files:FORMATS",
            decode_options="pidcfg.encoders.generic.files:DECODE_OPTIONS",
            checklist="pidcfg.encoders.generic.files:checklist",
            controller="pidcfg.sim.controllers.generic.scan:load",
            registers="pidcfg.encoders.maps.generic:TABLES",
            explainer="pidcfg.explain.generic:EXPLAINER",
            tuned="pidcfg.encoders.maps.generic:TUNED",
            starter="starters/generic.yaml",
            to_neutral="pidcfg.convert.generic:to_neutral",
            from_neutral="pidcfg.convert.generic:from_neutral",
            convert_options="pidcfg.convert.generic:CONVERT_OPTIONS",
        ),
    )
}
# fmt: on


def format_names() -> list[str]:
    """The file formats of all vendors, each once."""
    return list(dict.fromkeys(name for vendor in VENDORS.values() for name in vendor.load("formats")))


def format_of(vendor: Vendor, name: str) -> Any:
    """One of a vendor's file formats; raises `KeyError` naming those it has."""
    kinds = vendor.load("formats")
    if name not in kinds:
        raise KeyError(f"{vendor.title} has no format {name}; it has {', '.join(kinds)}")
    return kinds[name]
