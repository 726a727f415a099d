"""What a loop is for, heating or cooling, as its name and description tell it; and what its action says of that."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from pidcfg.encoders.contract import tables_of
from pidcfg.text.frozen import frozen
from pidcfg.text.paths import value_at

if TYPE_CHECKING:
    from pidcfg.vendors import Vendor

# --- Words, in English and German: the only list of them --------------------------------------------------------------


def _words(*patterns: str) -> re.Pattern[str]:
    """Whole words; a number may follow (``OVEN2``)."""
    return re.compile(rf"\b(?:{'|'.join(patterns)})(?![^\W\d_])", re.IGNORECASE)


HEATING = _words(
    r"heat(?! (?:exchang|pump|recover|transfer|meter|sink|remov|loss|of ))",
    r"(?:re|pre)?heat(?:s|ed|ers?|ing)",
    r"ovens?|furnaces?|kilns?|boilers?|burners?",
    r"\w*heiz\w*",
    r"\w*erhitz\w*",
    r"(?:er|an|auf|vor)w(?:ä|ae)rm\w*",
    r"ofen\w*|(?:\w*(?:[^\Wh]|[aceoü]h))?(?:ofen|öfen|oefen)",
    r"\w*brenner(?!ei)\w*|brennkammer\w*|dampfkessel\w*",
)
COOLING = _words(
    r"cool(?:s|ed|ers?|ing)?|cold(?! (?:junction|start))|chill(?:s|ed|ers?|ing)?",
    r"fridges?|freez(?:ers?|ing)|refrigerat\w*|air condition\w*",
    r"\w*k(?:ü|ue)hl\w*",
    r"\w*k(?:ä|ae)lte\w*|kalt(?!leiter|st[ae])\w*|\w*gefrier\w*|eiswasser\w*",
)
OTHERWISE = _words(
    r"air to close|(?:normally|fails?) open|inver(?:ted|s|se|tiert)|reversed|bypass\w*",
    r"exhaust|draft|draught|vents?|vented|venting|ventilat\w*|fans?|dampers?|quench\w*",
    r"stromlos (?:offen|auf)|feder\w* (?:ö|oe)ffne\w*|umgekehrt\w*",
    r"\w*abluft\w*|\w*l(?:ü|ue)fte[rn]\w*|\w*l(?:ü|ue)ftung\w*|gebl(?:ä|ae)se\w*|\w*klappen?|abschreck\w*",
)
"""An actuator that may work the other way round: nothing can be said then."""
NO_TEMPERATURE = _words(
    r"[flpqsw][dfq]?[ir]?ca? ?\d*",
    r"flow|level|pressure|speed|vacuum|humidity",
    r"\w*druck\w*|\w*durchflu(?:ss|ß)\w*|\w*menge\w*|\w*f(?:ü|ue)llstand\w*|niveau\w*|\w*drehzahl\w*|\w*feuchte\w*",
)
"""What a loop without a unit controls instead; its name by ISA 5.1 (``FIC-101``) tells it, too."""
TEMPERATURE = re.compile(
    r"(?:deg|°|º)? ?[cfk]|(?:deg(?:rees?)?|grad|°) ?\w*|℃|℉|celsius|fahrenheit|kelvin", re.IGNORECASE
)
WORD_BREAK = re.compile(r"[\W_]|(?<=[a-zäöüß])(?=[A-ZÄÖÜ][a-zäöüß])")
PLACES = ("name", "description")


@frozen
class Purpose:
    """What a loop is for."""

    heats: bool
    word: str
    """As the file has it."""
    place: str
    """The key where it stands."""

    @property
    def text(self) -> str:
        """``heating`` or ``cooling``."""
        return "heating" if self.heats else "cooling"


def purpose_of(loop: Any) -> Purpose | None:
    """What a loop's words say that it does; None where they say nothing, or both."""
    texts = {place: WORD_BREAK.sub(" ", getattr(loop, place, None) or "") for place in PLACES}
    whole, unit = " ".join(texts.values()), loop.pv.unit
    if OTHERWISE.search(whole) or (NO_TEMPERATURE.search(whole) if unit is None else not TEMPERATURE.fullmatch(unit)):
        return None
    heats, cools = HEATING.search(whole), COOLING.search(whole)
    if (heats is None) is (cools is None):
        return None
    pattern = HEATING if heats else COOLING
    found = ((match[0], place) for place, text in texts.items() if (match := pattern.search(text)))
    return next((Purpose(heats is not None, word, place) for word, place in found), None)


# --- The action, by the word that each vendor has for it --------------------------------------------------------------

ACTION = "action"
"""The key of those whose word stands alone."""


@frozen
class Action:
    """What a loop's configuration says of the way from output to PV."""

    key: str
    raises_pv: bool
    """Whether the loop takes it that the PV rises with the output."""
    here: str
    """The key with its value."""
    other: str
    """The key with the opposite value."""


def action_key(vendor: Vendor) -> str:
    """The key that says the action of a loop."""
    key, blank, _ = tables_of(vendor).TUNED.heating.partition(" ")
    return key.rstrip(":") if blank else ACTION


def action_word(vendor: Vendor, *, raises_pv: bool) -> str:
    """How the action is written of a loop whose PV rises with its output, or falls."""
    tuned = tables_of(vendor).TUNED
    return (tuned.heating if raises_pv else tuned.cooling).rpartition(" ")[2].lower()


def action_of(vendor: Vendor, loop: object) -> Action | None:
    """The action of a loop; None where an expression gives it."""
    texts = {action_word(vendor, raises_pv=rises): rises for rises in (True, False)}
    key = action_key(vendor)
    value = value_at(loop, (key,))
    word = str(value).lower()
    if not isinstance(value, bool | str) or word not in texts:
        return None
    other = next(text for text in texts if text != word)
    return Action(key, texts[word], f"{key}: {word}", f"{key}: {other}")
