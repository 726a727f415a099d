"""What the schemas are put together from."""

from __future__ import annotations

from typing import Any

Schema = dict[str, Any]
VERSION: Schema = {"const": 1, "description": "The version of this layout."}


def record(description: str, optional: tuple[str, ...] = (), /, **keys: Schema) -> Schema:
    """An object that has these keys and no others; a trailing underscore keeps a key from being a word of Python."""
    names = {key.rstrip("_"): schema for key, schema in keys.items()}
    required = [name for name in names if name not in optional]
    return {
        "description": description,
        "type": "object",
        "properties": names,
        "required": required,
        "additionalProperties": False,
    }


def by_name(description: str, value: Schema) -> Schema:
    """An object whose keys are names of the user's files."""
    return {"description": description, "type": "object", "additionalProperties": value}


def listing(description: str, item: Schema) -> Schema:
    """A list."""
    return {"description": description, "type": "array", "items": item}


def text(description: str, *choices: str) -> Schema:
    """Text, or one of some words."""
    return {"description": description, **({"enum": list(choices)} if choices else {"type": "string"})}


def number(description: str) -> Schema:
    """A number."""
    return {"description": description, "type": "number"}


def count(description: str, least: int = 0) -> Schema:
    """A whole number."""
    return {"description": description, "type": "integer", "minimum": least}


def switch(description: str) -> Schema:
    """True or false."""
    return {"description": description, "type": "boolean"}


def or_null(schema: Schema) -> Schema:
    """The same, or null where there is none."""
    if "enum" in schema:
        return {**schema, "enum": [*schema["enum"], None]}
    return {**schema, "type": [schema["type"], "null"]}


def anything(description: str) -> Schema:
    """A value as the user's file or the PLC has it."""
    return {"description": description, "type": ["null", "boolean", "number", "string", "array"]}


def one_or_several(name: str, plural: str, one: Schema, **parts: Schema) -> Schema:
    """What stands alone for one scenario, and for several in a list; ``parts``: its parts."""
    several = record(
        "Several scenarios.",
        version=VERSION,
        **{plural: listing("One a scenario.", {"$ref": f"#/$defs/{name}"})},
        passed=switch(f"Whether every {name} passed."),
    )
    alone = {**one, "properties": {"version": VERSION, **one["properties"]}, "required": ["version", *one["required"]]}
    return {"oneOf": [alone, several], "$defs": {name: one, **parts}}
