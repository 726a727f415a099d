"""Which YAML files in a folder are for pidcfg: those with its key, and those of which nobody can tell."""

from __future__ import annotations

import re

from pidcfg.reader import read_file
from pidcfg.unreadable import UTF16_MARKS

LARGEST = 64 << 20
"""Bytes of a file that is searched for the key; a larger one is read, and complained about."""
BREAK = re.compile(rb"\r\n?|\xc2\x85|\xe2\x80[\xa8\xa9]")
MARK = b"\xef\xbb\xbf"
FIRST = re.compile(rb"^([ \t]*)(?!%|#|\.\.\.|[ \t])(?:---(?:[ \t]+|$))?(?:#.*$)?([^\s#].*)", re.MULTILINE)
"""The first line that says something, and how far it is indented: there the keys at the top stand."""
PLAIN = re.compile(rb"(?:[\w.$/+-]+|\"[^\"\\\n]*\"|'[^'\n]*')[ \t]*:(?:\s|$)|-(?:[ \t]|$)")
"""A key or an item in a block: what follows is read line by line. Anything else may hold keys anywhere."""
OPENING = re.compile(rb"[{,?]\s*")
KEY = re.compile(rb"^(?:\?[ \t]+)?\t*[\"']?pidcfg[\"']?[ \t]*(?::|$)", re.MULTILINE)
"""The key at the top; also after a tab."""
ESCAPED = re.compile(rb"^(?:\?[ \t]+)?\"[^\"\n:]*\\", re.MULTILINE)
"""A key that is spelled with escapes may be any."""
LIKE_PIDCFG = (
    re.compile(rb"^[\"']?(?:vendor|scenario)[\"']?\s*:", re.MULTILINE),
    re.compile(rb"^[\"']?(?:loops|config|plants|expect)[\"']?\s*:", re.MULTILINE),
)
"""Keys at the top by which a file is for pidcfg although that key is missing or misspelt."""


def is_for_pidcfg(name: str, data: bytes, most: int) -> bool:
    """Whether a file is for pidcfg by its first bytes; when they are more than ``most``, by all of them."""
    if has_key(data):
        return True
    if len(data) <= most:
        return False
    try:
        whole = read_file(name, LARGEST + 1)
    except (OSError, ValueError):
        return True
    return len(whole) > LARGEST or has_key(whole)


def has_key(data: bytes) -> bool:
    """Whether a text has the key ``pidcfg`` at the top, or may have it."""
    text = data.decode("utf-16", "replace").encode() if data.startswith(UTF16_MARKS) else data.replace(b"\0", b"")
    text = BREAK.sub(b"\n", text.removeprefix(MARK).removeprefix(MARK))
    first = FIRST.search(text)
    if first is None:
        return False
    if not PLAIN.match(first[2]):
        text = OPENING.sub(b"\n", text)
    elif first[1]:
        text = re.sub(rb"^" + re.escape(first[1]), b"", text, flags=re.MULTILINE)
    return bool(KEY.search(text) or ESCAPED.search(text)) or all(key.search(text) for key in LIKE_PIDCFG)
