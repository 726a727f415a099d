"""Format ``gitlab``: the Code Quality report that GitLab shows in merge requests."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.cli.formats.findings import STDIN, display_name, fingerprints, sentence
from pidcfg.cli.formats.format import Format, Kind
from pidcfg.diagnostics import Severity
from pidcfg.writer import json_text

if TYPE_CHECKING:
    from pidcfg.cli.formats.findings import Findings

SEVERITIES = {Severity.ERROR: "major", Severity.WARNING: "minor", Severity.INFO: "info"}


def findings_gitlab(findings: Findings) -> str:
    """A list of issues."""
    rows = [
        {
            "description": sentence(d),
            "check_name": d.code,
            "fingerprint": fingerprint,
            "severity": SEVERITIES[d.severity],
            "location": {
                "path": "stdin" if d.file == STDIN else display_name(d.file),
                "lines": {"begin": d.span.line, "end": d.span.end_line},
            },
        }
        for d, fingerprint in zip(findings.reported, fingerprints(findings), strict=True)
    ]
    return json_text(rows)


FORMAT = Format("GitLab's Code Quality report", "gitlab.json", Kind.JSON, findings_gitlab)
