"""What a finding is known by, besides its code: the loop, the key, and the value that is written there.

Nothing of it follows from the place of the loop in the file, or from what stands at other loops: loops and blocks are
called by their names, items without a name are not counted, and a value is brought into one spelling. What stands above
all loops (the list of loops, the file) has no value, since every edit would change it.
"""

from __future__ import annotations

import hashlib
import json
from decimal import Decimal, InvalidOperation
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pidcfg.document import Document
    from pidcfg.paths import Path

LOOPS = "loops"
LONGEST = 80
"""Characters of a value before its hash stands for it."""
MOST_DIGITS = 400
"""Digits of a number that is written out; a longer one stays as it is written."""
HASH = 16
"""Hexadecimal digits of a hash."""


def loop_name(doc: Document, path: Path) -> str:
    """The name of the loop that a path is in; empty where it is in none, or the name cannot be read."""
    loops = (doc.data or {}).get(LOOPS)
    if len(path) > 1 and path[0] == LOOPS and isinstance(path[1], int) and isinstance(loops, list):
        return (_name(loops[path[1]]) if path[1] < len(loops) else None) or ""
    return ""


def key_of(doc: Document, path: Path) -> str:
    """The path below the loop, with names in the place of numbers: ``tuning.reset``, ``blocks[SEL].MV1``."""
    data: Any = doc.data
    text, named = "", False
    for depth, step in enumerate(path):
        data = _child(data, step)
        if isinstance(step, str):
            text += f".{step}"
            continue
        name = _name(data)
        if depth == 1 and path[0] == LOOPS and name:
            text, named = "", True
        elif name:
            text, named = f"{text}[{name}]", True
        else:
            text += f"[{step}]" if named else "[]"
    return text.removeprefix(".")


def value_of(doc: Document, path: Path) -> str | None:
    """What is written at a path, in one spelling; a hash of a mapping and of a long text; None where nothing is."""
    if not path or path == (LOOPS,):
        return None
    data = _at(doc, path)
    if data is None:
        return None
    plain = _plain(data)
    text = _text(plain)
    return _hash(text) if isinstance(plain, dict) else shortened(text)


def _at(doc: Document, path: Path) -> Any:
    """What is written at a path; None where nothing is."""
    data: Any = doc.data
    for step in path:
        data = _child(data, step)
    return data


def shortened(text: str) -> str:
    """A text, or its hash where it is a long one."""
    return _hash(text) if len(text) > LONGEST else text


def _hash(text: str) -> str:
    return f"sha256:{hashlib.sha256(text.encode('utf-8', 'backslashreplace')).hexdigest()[:HASH]}"


def _text(plain: Any) -> str:
    """Plain data as text: a list of scalars as the file has it, anything else as JSON."""
    if isinstance(plain, str):
        return plain
    if isinstance(plain, list) and all(isinstance(item, str) for item in plain):
        return f"[{', '.join(plain)}]"
    return json.dumps(plain, ensure_ascii=False, sort_keys=True)


def _child(data: Any, step: str | int) -> Any:
    """What is one step below; None where nothing is."""
    if isinstance(data, dict):
        return data.get(step)
    return data[step] if isinstance(data, list) and isinstance(step, int) and 0 <= step < len(data) else None


def _name(item: Any) -> str | None:
    """The name of an item of a list."""
    name = item.get("name") if isinstance(item, dict) else None
    return str(name) if isinstance(name, str) else None


def _plain(data: Any) -> Any:
    """Data with every scalar in one spelling."""
    if isinstance(data, dict):
        return {str(key): _plain(value) for key, value in data.items()}
    if isinstance(data, list):
        return [_plain(item) for item in data]
    return _spelling(str(data))


def _spelling(text: str) -> str:
    """A scalar: numbers without zeros that say nothing, runs of blanks as one."""
    words = " ".join(text.split())
    number, blank, unit = words.partition(" ")
    try:
        value = Decimal(number)
    except InvalidOperation:
        return words
    if not value.is_finite() or abs(value.adjusted()) > MOST_DIGITS or len(number) > MOST_DIGITS:
        return words
    short = f"{value:f}"
    short = short.rstrip("0").rstrip(".") if "." in short else short
    return f"{'0' if not value else short}{blank}{unit}"
