"""What a key of a configuration is, from the text below its field in the schema."""

from __future__ import annotations

from functools import cache
from typing import Any

from pidcfg.schemas.document import field_texts, models_of
from pidcfg.schemas.limits import Limits, limits_at
from pidcfg.vendors import VENDORS


@cache
def key_text(vendor: str, path: str) -> str:
    """The text of a key by its path, wherever in the file it stands; its section's where it has none of its own."""
    file = VENDORS[vendor].model
    steps = [step for step in path.split(".") if not step.isdigit()]
    while steps:
        for found in models_of(file):
            text = _walked(found, steps)
            if text:
                return text
        steps.pop()
    return ""


@cache
def key_limits(vendor: str, path: str) -> Limits | None:
    """What the manual allows for the number at a key of a loop, or of the file; None where it says nothing."""
    file = VENDORS[vendor].model
    found = limits_at(file, f"loops.{path}")
    return limits_at(file, path) if found is None and path.partition(".")[0] in file.model_fields else found


def limits_text(limits: Limits) -> str:
    """Limits as the remark on a number that passes them."""
    if limits.high is None:
        return f"not allowed: below {limits.low}"
    return f"not allowed: above {limits.high}" if limits.low is None else f"not within {limits.low} to {limits.high}"


def _walked(model: Any, steps: list[str]) -> str:
    """The text of the last key, if the keys lead through the model."""
    own = model.model_fields.get(steps[0])
    if own is None:
        return ""
    if len(steps) == 1:
        return _texts(model).get(steps[0], "")
    below = [m for m in models_of(model) if m is not model]
    return next(
        (
            text
            for m in below
            if steps[1] in m.model_fields and m in _inside(own.annotation) and (text := _walked(m, steps[1:]))
        ),
        "",
    )


def _inside(annotation: Any) -> list[Any]:
    args = getattr(annotation, "__args__", ())
    return [annotation, *(inner for arg in args for inner in _inside(arg))]


@cache
def _texts(model: Any) -> dict[str, str]:
    return field_texts(model)
