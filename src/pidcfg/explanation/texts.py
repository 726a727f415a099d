"""What a key of a configuration is, from the text below its field in the schema, and what is allowed there."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

from pidcfg.schemas.document import models_in, models_of
from pidcfg.schemas.limits import Limits, limits_at
from pidcfg.schemas.texts import field_texts

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pydantic import BaseModel


@cache
def texts_of(model: type[BaseModel]) -> Mapping[str, str]:
    """The text below each field of a model."""
    return field_texts(model)


@cache
def key_text(file: type[BaseModel], path: str) -> str:
    """The text of a key by its path, wherever in the file it stands; its section's where it has none of its own."""
    steps = [step for step in path.split(".") if not step.isdigit()]
    while steps:
        for model in models_of(file):
            text = _text_below(model, steps)
            if text:
                return text
        steps.pop()
    return ""


def _text_below(model: type[BaseModel], steps: list[str]) -> str:
    """The text of the last key, if the keys lead through the model."""
    field = model.model_fields.get(steps[0])
    if field is None:
        return ""
    if len(steps) == 1:
        return texts_of(model).get(steps[0], "")
    sections = (section for section in models_in(field.annotation) if section is not model)
    return next((text for section in sections if (text := _text_below(section, steps[1:]))), "")


@cache
def key_limits(file: type[BaseModel], path: str) -> Limits | None:
    """What the manual allows for the number at a key of a loop, or of the file; None where it says nothing."""
    limits = limits_at(file, f"loops.{path}")
    return limits_at(file, path) if limits is None and path.partition(".")[0] in file.model_fields else limits


def limits_text(limits: Limits) -> str:
    """Limits as the remark on a number that passes them."""
    if limits.high is None:
        return f"not allowed: below {limits.low}"
    return f"not allowed: above {limits.high}" if limits.low is None else f"not within {limits.low} to {limits.high}"


def first_sentence(text: str) -> str:
    """A text up to where it goes into details."""
    for at in range(1, len(text) - 1):
        if text[at : at + 2] in {"; ", ". ", ": "} and text.count("(", 0, at) == text.count(")", 0, at):
            return text[:at]
    return text.removesuffix(".")
