"""Format ``json``: the public layout, for programs."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.cli.formats import reporters
from pidcfg.cli.formats.format import Format, Kind

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.cli.formats.findings import Findings
    from pidcfg.diagnostics import Severity
    from pidcfg.scenario.outcome import Outcome


def findings_json(findings: Findings) -> str:
    """The layout that `pidcfg schema output-validate` describes."""
    return reporters.json_v1(findings.reported, findings.documents)


def runs_json(outcomes: Sequence[Outcome], fails: Severity) -> str:
    """The layout that `pidcfg schema output-simulate` describes."""
    from pidcfg.cli.formats.simulation_text import json_v1

    del fails
    return json_v1(outcomes)


FORMAT = Format("programs; the layout is [published](#json) and stays", "json", Kind.JSON, findings_json, runs_json)
