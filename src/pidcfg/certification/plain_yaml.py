"""The data of a scenario as YAML in block style, each scalar as the file had it: unquoted ones stay unquoted."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from pidcfg.document import Plain
from pidcfg.writer import json_line

if TYPE_CHECKING:
    from collections.abc import Iterator

SAFE_KEY = re.compile(r"[A-Za-z_][\w.\-]*")
BREAKS = re.compile("[\n\r\x85\u2028\u2029\t]|: | #|^[-?:] ")
"""What an unquoted scalar of a block cannot hold."""


def block_yaml(data: dict[str, Any]) -> str:
    """A mapping as YAML; reading it gives the same data."""
    return "\n".join(_lines(data, 0)) + "\n"


def _lines(value: Any, depth: int) -> Iterator[str]:
    """A mapping or a list that holds something, a line each."""
    indent = "  " * depth
    entries = (
        ((f"{_key(key)}:", item) for key, item in value.items())
        if isinstance(value, dict)
        else (("-", v) for v in value)
    )
    for begin, item in entries:
        if isinstance(item, dict | list) and item:
            first, *rest = _lines(item, depth + 1)
            if begin == "-":
                yield f"{indent}- {first.lstrip(' ')}"
                yield from rest
            else:
                yield f"{indent}{begin}"
                yield first
                yield from rest
        else:
            yield f"{indent}{begin} {_scalar(item)}"


def _key(key: str) -> str:
    return key if SAFE_KEY.fullmatch(key) else json_line(key)


def _scalar(value: Any) -> str:
    if isinstance(value, Plain) and value and not BREAKS.search(value):
        return str(value)
    return json_line(str(value) if isinstance(value, str) else value)
