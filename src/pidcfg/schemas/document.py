"""JSON Schema of a model, with the texts below its fields as descriptions."""

from __future__ import annotations

import ast
import inspect
import re
import sys
from decimal import Decimal
from functools import cache
from typing import TYPE_CHECKING

from pydantic import BaseModel
from pydantic.json_schema import GenerateJsonSchema

if TYPE_CHECKING:
    from types import ModuleType

    from pidcfg.schemas.numbers import JsonSchema

# --- The texts below the fields of a model, which say what each key is ------------------------------------------------
#
# They are read from the source when they are wanted, so that loading a model for validation stays fast.


@cache
def field_texts(model: type[BaseModel]) -> dict[str, str]:
    """The text below each field of a model, from its source; inherited fields keep theirs."""
    texts: dict[str, str] = {}
    for cls in reversed([c for c in model.__mro__ if issubclass(c, BaseModel) and c.__module__.startswith("pidcfg")]):
        texts |= _texts_of(sys.modules[cls.__module__]).get(cls.__qualname__, {})
    return texts


@cache
def _texts_of(module: ModuleType) -> dict[str, dict[str, str]]:
    """The texts of a module's classes; its source is parsed once, for all of them."""
    body = ast.parse(inspect.getsource(module)).body
    return {cls.name: _texts_in(cls) for cls in body if isinstance(cls, ast.ClassDef)}


def _texts_in(body: ast.ClassDef) -> dict[str, str]:
    texts = {}
    for field, text in zip(body.body, body.body[1:], strict=False):
        if (
            isinstance(field, ast.AnnAssign)
            and isinstance(field.target, ast.Name)
            and isinstance(text, ast.Expr)
            and isinstance(text.value, ast.Constant)
        ):
            texts[field.target.id] = " ".join(str(text.value.value).split())
    return texts


# --- JSON Schema of a model, with the texts below its fields as descriptions ------------------------------------------
#
# The descriptions are read from the source when a schema is printed, so that loading a model for validation stays
# fast.

DIALECT = "https://json-schema.org/draft/2020-12/schema"
SCHEMA_ID = "urn:pidcfg:schema:{key}"
"""The name by which other schemas and programs may refer to one: no address, since there is none."""
WORD = re.compile("[A-Z][a-z0-9]*")
ABBREVIATIONS = {"Pv": "PV", "Plc": "PLC", "Pwm": "PWM", "Gpwm": "GPWM"}


class _Schema(GenerateJsonSchema):
    """pydantic's generator without titles that only repeat the key."""

    def field_title_should_be_set(self, schema: object) -> bool:
        """Editors show the key already."""
        del schema
        return False

    def encode_default(self, dft: object) -> None:
        """`_set_default` writes them, from the model."""
        del dft


def json_schema(model: type[BaseModel], key: str, title: str) -> JsonSchema:
    """The schema of one kind of file; keys of every object carry a description, numbers their limits and unit."""
    schema = model.model_json_schema(schema_generator=_Schema)
    models = {m.__name__: m for m in models_of(model)}
    for name, definition in schema.get("$defs", {}).items():
        _describe_properties(definition, models.get(name))
        definition["title"] = _object_title(name, definition)
    _describe_properties(schema, model)
    return {"$schema": DIALECT, "$id": SCHEMA_ID.format(key=key), **schema, "title": title}


def models_of(model: type[BaseModel], models: dict[type[BaseModel], None] | None = None) -> dict[type[BaseModel], None]:
    """The model and all that its fields hold."""
    models = {} if models is None else models
    if model not in models:
        models[model] = None
        for field in model.model_fields.values():
            for inner in models_in(field.annotation):
                models_of(inner, models)
    return models


def models_in(annotation: object) -> list[type[BaseModel]]:
    """The models that an annotation names."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [m for inner in getattr(annotation, "__args__", ()) for m in models_in(inner)]


def _describe_properties(definition: JsonSchema, model: type[BaseModel] | None) -> None:
    """Adds descriptions and plain defaults to the properties of one object."""
    if model is None:
        return
    texts = field_texts(model)
    names = {field.alias or name: name for name, field in model.model_fields.items()}
    for key, prop in definition.get("properties", {}).items():
        text = texts.get(names[key], "")
        prop["description"] = text + (f" Unit: {prop['x-unit']}." if prop.get("x-unit") else "")
        _drop_null(prop)
        _set_default(prop, model.model_fields[names[key]].get_default())
        if "x-unit" in prop:
            _add_examples(prop)


def _object_title(name: str, definition: JsonSchema) -> str:
    """What an object is called, which editors show above its description: the block that it is, or its name in words.

    ``PvAlarms`` are ``PV alarms``.
    """
    kind = definition.get("properties", {}).get("type", {}).get("const")
    words = [ABBREVIATIONS.get(word, word) for word in WORD.findall(name)]
    rest = [word if word.isupper() else word.lower() for word in words[1:]]
    return str(kind) if kind else " ".join([*words[:1], *rest])


def _add_examples(prop: JsonSchema) -> None:
    """Values that an editor offers for a number with a unit: texts that carry one, or a number within the limits."""
    forms = [prop, *prop.get("anyOf", ())]
    values: list[object] = [text for way in forms for text in way.get("examples", ())]
    if not values:
        low, high = prop.get("minimum", 1), prop.get("maximum", 1)
        values = [prop.get("default") or min(max(1, low), high)]
    prop["examples"] = values
    prop["defaultSnippets"] = [{"label": str(value), "body": value} for value in values]


def _drop_null(prop: JsonSchema) -> None:
    """An optional key may be left out, but never be null."""
    kinds = [kind for kind in prop.get("anyOf", []) if kind.get("type") != "null"]
    if "anyOf" in prop and len(kinds) == 1:
        del prop["anyOf"]
        prop.update({k: v for k, v in kinds[0].items() if k not in prop})
    elif kinds:
        prop["anyOf"] = kinds


def _set_default(prop: JsonSchema, default: object) -> None:
    """Defaults that are single words or numbers; the others are told in the description."""
    prop.pop("default", None)
    if isinstance(default, bool | int | str):
        prop["default"] = default
    elif isinstance(default, Decimal):
        prop["default"] = int(default) if default == int(default) else float(default)
