"""JSON Schemas by their names: of a vendor's files, of scenarios, and of what commands print."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.output.json_schemas import OUTPUTS, output_schema
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from pydantic import BaseModel

SCENARIO = "scenario"


def schema(name: str) -> dict[str, Any]:
    """The JSON Schema of a vendor's files (``dl06``), with templates, of ``scenario``, or of an output.

    Raises `KeyError` for another name.
    """
    from pidcfg.schemas.templates import with_templates

    plain = plain_schema(name)
    return with_templates(plain) if name in VENDORS else plain


def plain_schema(name: str) -> dict[str, Any]:
    """The same without templates."""
    if name in OUTPUTS:
        return output_schema(name)
    from pidcfg.schemas.document import json_schema

    return json_schema(_model(name), name, _title(name))


def _model(name: str) -> type[BaseModel]:
    if name == SCENARIO:
        from pidcfg.schemas.scenario import Scenario

        return Scenario
    return VENDORS[name].model


def _title(name: str) -> str:
    return "pidcfg scenario" if name == SCENARIO else f"pidcfg configuration for {VENDORS[name].title}"
