"""Plain texts of a file as the numbers, switches and words that YAML writes without quotes."""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING, Any

from pidcfg.document import Plain
from pidcfg.schemas.numbers import NUMBER
from pidcfg.writer import Number, yaml_text

if TYPE_CHECKING:
    from pidcfg.document import Document


TEXTS = frozenset(("name", "description", "use"))
"""Keys whose values are texts, also where they look like numbers: 1.10 is no 1.1."""


def plain_text(doc: Document) -> str:
    """The file as YAML in which each loop has all of its values; comments stay behind."""
    return yaml_text(native(doc.data or {}))


def native(value: Any) -> Any:
    """Data with its plain texts as what YAML writes without quotes: numbers, switches, words."""
    if isinstance(value, dict):
        return {key: str(x) if key in TEXTS and isinstance(x, Plain) else native(x) for key, x in value.items()}
    if isinstance(value, list):
        return [native(inner) for inner in value]
    return number_or_text(value) if isinstance(value, Plain) else value


def number_or_text(text: str) -> Any:
    """A plain text as a number or a switch where it is written back the same way; another number as it is."""
    if text.lower() in {"true", "false"}:
        return text.lower() == "true"
    for kind in (int, float):
        try:
            number = kind(text)
        except ValueError:
            continue
        if not isfinite(float(text)):
            continue
        if str(number) == text or (kind is float and text.rstrip("0").rstrip(".") == f"{number:.15g}"):
            return number
    return Number(text) if NUMBER.fullmatch(text) else str(text)
