"""Format ``text``: a block a finding, with the line and a caret; a section a run."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.cli.formats import reporters
from pidcfg.cli.formats.format import Format, Kind

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.cli.formats.findings import Findings
    from pidcfg.diagnostics import Severity
    from pidcfg.scenario.outcome import Outcome


def findings_text(findings: Findings) -> str:
    """For people in front of a terminal."""
    return reporters.text(findings.reported, findings.documents)


def runs_text(outcomes: Sequence[Outcome], fails: Severity) -> str:
    """What happened, metrics and expectations."""
    from pidcfg.cli.formats.simulation_text import text

    del fails
    return text(outcomes)


FORMAT = Format("people; the default", "txt", Kind.PLAIN, findings_text, runs_text)
