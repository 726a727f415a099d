"""Format ``text``: a block a finding, with the line and a caret."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.cli.formats import reporters

if TYPE_CHECKING:
    from pidcfg.cli.formats.findings import Findings


def text(findings: Findings) -> str:
    """For people in front of a terminal."""
    return reporters.text(findings.found, findings.documents)
