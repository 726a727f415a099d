"""The JSON Schema of templates: parts of loops, in which nothing is required, and loops that use one."""

from __future__ import annotations

from copy import deepcopy
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pidcfg.schemas.numbers import JsonSchema

PART = "Part"
"""Behind the name of a definition: the same with nothing required."""
REFERENCE = "#/$defs/"
TEMPLATES_TEXT = (
    "What equal loops have in common, by a name of its own: a loop with `use: NAME` has all of it, and what it writes "
    "itself wins. A template may use another one."
)
USE_TEXT = "The template whose values the loop has; what the loop writes itself wins, lists as a whole."


def with_templates(schema: JsonSchema) -> JsonSchema:
    """The schema of a configuration file whose loops may use templates."""
    loops = schema["properties"]["loops"]
    whole = loops["items"]
    part = _part(deepcopy(whole))
    used = {ref.removeprefix(REFERENCE) for ref in _references(whole)}
    definitions = {f"{name}{PART}": _part(deepcopy(definition)) for name, definition in schema["$defs"].items()}
    for name in used:
        definitions[f"{name}{PART}"]["properties"]["use"] = {"type": "string", "description": USE_TEXT}
    schema["$defs"] |= definitions
    loops["items"] = {
        "if": {"required": ["use"]},
        "then": {"allOf": [{"required": ["name"]}, part]},
        "else": whole,
    }
    templates = {"type": "object", "description": TEMPLATES_TEXT, "additionalProperties": part}
    schema["properties"] = {"templates": templates, **schema["properties"]}
    return schema


def _part(value: Any) -> Any:
    """A schema in which nothing is required, all the way down; it has no title, or an editor would show both."""
    if isinstance(value, list):
        return [_part(item) for item in value]
    if not isinstance(value, dict):
        return value
    if "discriminator" in value and "oneOf" in value:
        return {"anyOf": [_part(kind) for kind in value["oneOf"]]}
    return {
        key: f"{item}{PART}" if key == "$ref" else _part(item)
        for key, item in value.items()
        if not (key == "required" and isinstance(item, list)) and not (key == "title" and isinstance(item, str))
    }


def _references(value: JsonSchema) -> list[str]:
    """The definitions of an item: one, or the choices of several."""
    if "$ref" in value:
        return [value["$ref"]]
    return [kind["$ref"] for kind in value.get("oneOf", ()) if "$ref" in kind]
