"""Format ``concise``: one line a finding, as compilers print it and editors jump to it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.cli.formats.findings import sentence
from pidcfg.cli.formats.format import Format, Kind
from pidcfg.control_characters import printable

if TYPE_CHECKING:
    from pidcfg.cli.formats.findings import Findings


def findings_concise(findings: Findings) -> str:
    """``file:line:column: severity CODE message [loop]``."""
    rows = (
        f"{d.file}:{d.span.line}:{d.span.column}: {d.severity.label} {d.code} {' '.join(sentence(d).split())}"
        for d in findings.reported
    )
    return "".join(printable(row).replace("\n", " ") + "\n" for row in rows)


FORMAT = Format("people and editors: one line a finding", "concise", Kind.PLAIN, findings_concise)
