"""Format ``json``: the public layout, for programs."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.cli.formats import reporters

if TYPE_CHECKING:
    from pidcfg.cli.formats.findings import Findings


def json(findings: Findings) -> str:
    """The layout that `pidcfg schema output-validate` describes."""
    return reporters.json_v1(findings.found, findings.documents)
