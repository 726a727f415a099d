"""Findings in the formats that people, CI systems and editors read: pure functions from `Findings` to text."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pidcfg.cli.formats.findings import Findings

FORMATS = ("text", "concise", "json", "sarif", "github", "gitlab", "junit")
"""Each is the name of a module here, whose function of the same name writes it."""
FOR_PEOPLE = frozenset({"text", "concise", "github"})
"""Formats that a line with the totals may follow, on stderr."""


def render(name: str, findings: Findings) -> str:
    """The findings in one of the formats, whose module is imported only now."""
    text: str = getattr(import_module(f"{__name__}.{name}"), name)(findings)
    return text
