"""Small CLICK configurations for tests of rules: one that is in order, and what is changed in it."""

from __future__ import annotations

import json
from copy import deepcopy
from typing import TYPE_CHECKING, Any

from pidcfg.text.source import read_document
from pidcfg.validate.engine import Checked, check_document

if TYPE_CHECKING:
    from pidcfg.text.diagnostics import Diagnostic

LOOP: dict[str, Any] = {
    "name": "A",
    "bits": "C1",
    "integers": "DS1",
    "floats": "DF1",
    "action": "direct",
    "action_verified": True,
    "sample_rate": "1000 ms",
    "freeze_bias": True,
    "tuning": {"proportional_gain": 1, "reset_time": 60, "derivative_gain": 0},
    "pv": {"range": [0, 100]},
}


def changed(**values: Any) -> dict[str, Any]:
    """The loop with other values: ``changed(**{"pv.filter": 50})``."""
    loop = deepcopy(LOOP)
    for path, value in values.items():
        *parents, key = path.split(".")
        place = loop
        for parent in parents:
            place = place.setdefault(parent, {})
        place[key] = value
    return loop


def checked(*loops: dict[str, Any]) -> Checked:
    """What the rules say about a file of these loops, and its image."""
    text = json.dumps({"pidcfg": 1, "vendor": "click", "loops": loops}, default=float)
    result = check_document(read_document(text.encode(), "case.yaml"))
    assert result.config is not None, result.findings
    return result


def findings(*loops: dict[str, Any]) -> tuple[Diagnostic, ...]:
    """What the rules say about a file of these loops."""
    return checked(*loops).findings


def codes(*loops: dict[str, Any]) -> set[str]:
    """The codes of what the rules say about a file of these loops."""
    return {d.code for d in findings(*loops)}
