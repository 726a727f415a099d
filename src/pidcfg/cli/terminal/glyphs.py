"""Text for code pages that lack some of its characters: what a person would type in their place, never a crash."""

from __future__ import annotations

import codecs
import sys
import unicodedata
from io import TextIOWrapper

HANDLER = "pidcfg"
"""The name under which Python knows the fallback."""

# fmt: off
PLAIN = {
    "…": "...", "·": "-", "•": "*", "–": "-", "—": "-", "−": "-", "‐": "-", "‑": "-",
    "×": "x", "÷": "/", "±": "+/-", "√": "sqrt", "∞": "inf", "≤": "<=", "≥": ">=", "≠": "!=", "≈": "~",
    "°": "deg", "º": "deg", "℃": "degC", "℉": "degF", "′": "'", "″": '"', "’": "'", "‘": "'", "“": '"', "”": '"',
    "„": '"', "«": '"', "»": '"', "µ": "u", "μ": "u", "Ω": "ohm", "\u2126": "ohm", "π": "pi", "Φ": "phi", "φ": "phi",
    "ζ": "zeta", "τ": "tau", "Δ": "delta", "∆": "delta", "λ": "lambda", "σ": "sigma", "ω": "omega", "α": "alpha",
    "β": "beta", "²": "^2", "³": "^3", "¹": "^1", "⁻": "-", "½": "1/2", "¼": "1/4", "¾": "3/4", "‰": "0/00", "€": "EUR",
    "→": "->", "←": "<-", "↔": "<->", "⇒": "=>", "↑": "^", "↓": "v", "▲": "^", "▼": "v", "▶": ">", "◀": "<",
    "✓": "ok", "✔": "ok", "✗": "x", "✘": "x", "■": "#", "□": "#", "◆": "*", "◇": "*",
    "ß": "ss", "ø": "o", "Ø": "O", "æ": "ae", "Æ": "AE", "œ": "oe", "Œ": "OE", "ł": "l", "Ł": "L", "đ": "d", "ı": "i",
    "\u00a0": " ", "\u2009": " ", "\u202f": " ", "\ufeff": "", "\ufffd": "?",
}
# fmt: on
"""What stands for a character that a code page lacks."""
BOXES, BLOCKS, SHAPES = range(0x2500, 0x2580), range(0x2580, 0x25A0), range(0x25A0, 0x2600)
BRAILLE = range(0x2800, 0x2900)
HORIZONTAL, VERTICAL = frozenset("─━┄┅┈┉╌╍═╴╶╸╺╼╾"), frozenset("│┃┆┇┊┋╎╏║╵╷╹╻╽╿")
SLANTED = {"╱": "/", "╲": "\\", "╳": "x"}


def encodable(text: str, encoding: str | None) -> str:
    """The text with what the encoding lacks replaced: as it is for UTF-8."""
    encoding = encoding or "utf-8"
    return text if fits(text, encoding) else text.encode(encoding, HANDLER).decode(encoding)


def install() -> None:
    """Lets everything that is printed fall back so, also what click and Python print by themselves."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors=HANDLER)


def fits(text: str, encoding: str | None) -> bool:
    """Whether an encoding has all characters of a text."""
    try:
        text.encode(encoding or "utf-8")
    except UnicodeEncodeError:
        return False
    return True


def _replaced(char: str, encoding: str) -> str:
    """What stands for one character: a letter without its accent, else the nearest ASCII, else a question mark."""
    plain = PLAIN.get(char) or _drawn(char)
    if plain is None:
        bare = "".join(c for c in unicodedata.normalize("NFKD", char) if not unicodedata.combining(c))
        plain = bare if bare != char else None
    return plain if plain is not None and fits(plain, encoding) else "" if unicodedata.combining(char) else "?"


def _drawn(char: str) -> str | None:
    """Lines of boxes, bars and dots of pictures."""
    code = ord(char)
    if code in BOXES:
        return SLANTED.get(char) or ("-" if char in HORIZONTAL else "|" if char in VERTICAL else "+")
    if code in BLOCKS:
        return "#"
    if code in SHAPES:
        return "o"
    if code in BRAILLE:
        return "." if code > BRAILLE.start else " "
    return None


def _handle(error: UnicodeError) -> tuple[str, int]:
    """What Python calls when an encoding lacks characters."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    lacking = error.object[error.start : error.end]
    return "".join(_replaced(char, error.encoding) for char in lacking), error.end


codecs.register_error(HANDLER, _handle)
