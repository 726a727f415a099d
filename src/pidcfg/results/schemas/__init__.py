"""JSON Schemas of what the commands print as JSON, for programs that read it; every object lists all of its keys."""

from __future__ import annotations

from importlib import import_module
from typing import Any

DIALECT = "https://json-schema.org/draft/2020-12/schema"
OUTPUTS = {
    "output-validate": ("findings", "validate --format json"),
    "output-statistics": ("counts", "validate --statistics --format json"),
    "output-simulate": ("runs", "simulate --format json"),
    "output-certify": ("batches", "certify --format json"),
    "output-convert": ("conversion", "convert --report json"),
    "output-diff": ("differences", "diff --format json"),
    "output-tune": ("gains", "tune --format json"),
    "output-rule": ("rules", "rule --format json"),
    "output-encode": ("words", "encode --format json"),
}
"""Name of each schema, the module here whose function ``schema`` gives it, and the command that it is about."""


def output_schema(name: str) -> dict[str, Any]:
    """One of the schemas."""
    module, command = OUTPUTS[name]
    title = f"What pidcfg {command} prints, version 1"
    layout: dict[str, Any] = import_module(f"{__name__}.{module}").schema()
    return {"$schema": DIALECT, "title": title, **layout}
