"""What a loop is for, as its name and description tell: heating or cooling.

Rules of several vendors hold the action of a loop against it; the words of it stand here once.
"""

from __future__ import annotations

import re
from typing import Any

HEATING = re.compile(r"\b(?:(?:re|pre)?heat(?:er|ers|ing)|ovens?|furnaces?|kilns?|boilers?|burners?)(?![a-z])")
COOLING = re.compile(
    r"\b(?:cool(?:er|ers|ing)?|cold|chill(?:er|ers|ed|ing)|fridges?|freez(?:er|ers|ing)|refrigerat\w*|"
    r"air condition\w*)(?![a-z])"
)
UNCLEAR = re.compile(
    r"\b(?:air to close|(?:normally|fails?) open|inver(?:ted|se)|reversed|"
    r"exhaust|draft|draught|vent\w*|fans?|dampers?|quench\w*)(?![a-z])"
)
TEMPERATURE = re.compile(r"(?:deg|°|º)? ?[cfk]|(?:deg(?:rees?)?|°) ?\w*|℃|℉|celsius|fahrenheit|kelvin")
BREAK = re.compile(r"[\W_]+")


def spoken_of(loop: Any) -> set[str]:
    """What name and description say that a loop does: ``heating``, ``cooling``."""
    text = BREAK.sub(" ", f"{loop.name} {loop.description or ''}".casefold())
    unit = (loop.pv.unit or "degC").casefold()
    if UNCLEAR.search(text) or not TEMPERATURE.fullmatch(unit):
        return set()
    return {word for word, pattern in (("heating", HEATING), ("cooling", COOLING)) if pattern.search(text)}
