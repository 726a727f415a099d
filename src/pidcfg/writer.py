"""Data to YAML text that reads like a hand-written file: leaf mappings on one line, sections below each other."""

from __future__ import annotations

import io
from typing import Any

WIDTH = 110


def yaml_text(data: dict[str, Any]) -> str:
    """A configuration as YAML; the same data give the same bytes."""
    from ruamel.yaml import YAML

    yaml = YAML()
    yaml.width = 1000
    yaml.indent(mapping=2, sequence=4, offset=2)
    out = io.StringIO()
    yaml.dump(_styled(data), out)
    return out.getvalue()


def _styled(value: Any) -> Any:
    """Short mappings and lists of scalars in flow style."""
    from ruamel.yaml.comments import CommentedMap, CommentedSeq

    if isinstance(value, dict):
        mapping = CommentedMap((key, _styled(inner)) for key, inner in value.items())
        if _flat(value):
            mapping.fa.set_flow_style()
        return mapping
    if isinstance(value, list):
        sequence = CommentedSeq(_styled(inner) for inner in value)
        if not any(isinstance(inner, dict | list) for inner in value):
            sequence.fa.set_flow_style()
        return sequence
    return value


def _flat(value: dict[str, Any]) -> bool:
    """Whether a mapping fits on one line: scalars and pairs, and one level of short mappings."""
    if any(isinstance(inner, dict) and any(isinstance(x, dict) for x in inner.values()) for inner in value.values()):
        return False
    if any(isinstance(inner, list) and any(isinstance(x, dict | list) for x in inner) for inner in value.values()):
        return False
    return len(str(value)) <= WIDTH and "vendor" not in value and "name" not in value
