"""Data as text: JSON, and YAML that reads like a hand-written file (leaf mappings on one line)."""

from __future__ import annotations

import io
import json
import re
from typing import TYPE_CHECKING

from pidcfg.text.signs import CONTROL_SIGNS

if TYPE_CHECKING:
    from ruamel.yaml.nodes import ScalarNode
    from ruamel.yaml.representer import BaseRepresenter

    from pidcfg.text.paths import Data

ESCAPED_SIGNS = re.compile(rf"[{CONTROL_SIGNS}]|#(?=#\w*\[)")
"""Control characters that JSON, and YAML in double quotes, may hold as they are; and what begins an order in a log."""
MAX_LINE_WIDTH = 110
FLOW_ENDINGS = frozenset("?:")
"""Signs that some readers take for the end of a text in flow style."""


class Number(str):
    """A number as it is written, whichever of its forms: it stands without quotes."""

    __slots__ = ()


def json_text(data: object, *, allow_nan: bool = True) -> str:
    """Data as indented JSON with a line end; raises `ValueError` for NaN and infinities where they are not allowed."""
    return _escape_controls(json.dumps(data, indent=2, ensure_ascii=False, allow_nan=allow_nan)) + "\n"


def json_line(data: object) -> str:
    """Data as JSON on one line, whoever divides a text into lines."""
    return _escape_controls(json.dumps(data, ensure_ascii=False))


def _escape_controls(text: str) -> str:
    """JSON or YAML whose control characters are all escapes; outside of quoted texts there is none."""
    return ESCAPED_SIGNS.sub(lambda sign: f"\\u{ord(sign.group()):04x}", text)


def yaml_text(data: Data) -> str:
    """A configuration as YAML; the same data give the same bytes. What would hide a part of the text is an escape."""
    from ruamel.yaml import YAML

    yaml = YAML()
    yaml.width = 1000
    yaml.indent(mapping=2, sequence=4, offset=2)
    yaml.representer.add_representer(Number, _represent_number)
    out = io.StringIO()
    yaml.dump(_to_flow_style(data), out)
    return _escape_controls(out.getvalue())


def _represent_number(representer: BaseRepresenter, text: Number) -> ScalarNode:
    """A node whose tag is the one that its text means to any reader, so that it needs neither quotes nor a tag."""
    from ruamel.yaml.nodes import ScalarNode
    from ruamel.yaml.resolver import VersionedResolver

    return representer.represent_scalar(VersionedResolver().resolve(ScalarNode, str(text), (True, False)), str(text))


def _to_flow_style(value: object, *, flow: bool = False) -> object:
    """Short mappings and lists of scalars in flow style; texts that not every reader takes there are quoted."""
    from ruamel.yaml.comments import CommentedMap, CommentedSeq
    from ruamel.yaml.scalarstring import DoubleQuotedScalarString, SingleQuotedScalarString

    if isinstance(value, dict):
        is_short = flow or _fits_a_line(value)
        mapping = CommentedMap(
            (_to_flow_style(key), _to_flow_style(inner, flow=is_short)) for key, inner in value.items()
        )
        if is_short:
            mapping.fa.set_flow_style()
        return mapping
    if isinstance(value, list):
        is_short = flow or not any(isinstance(inner, dict | list) for inner in value)
        sequence = CommentedSeq(_to_flow_style(inner, flow=is_short) for inner in value)
        if is_short:
            sequence.fa.set_flow_style()
        return sequence
    if isinstance(value, str) and ESCAPED_SIGNS.search(value):
        return DoubleQuotedScalarString(value)
    if flow and isinstance(value, str) and FLOW_ENDINGS.intersection(value):
        return SingleQuotedScalarString(value)
    return value


def _fits_a_line(value: Data) -> bool:
    """Whether a mapping fits on one line: scalars and pairs, and one level of short mappings."""
    if any(isinstance(inner, dict) and any(isinstance(x, dict) for x in inner.values()) for inner in value.values()):
        return False
    if any(isinstance(inner, list) and any(isinstance(x, dict | list) for x in inner) for inner in value.values()):
        return False
    return len(str(value)) <= MAX_LINE_WIDTH and "vendor" not in value and "name" not in value
