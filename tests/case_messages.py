"""What every rule says about its case files, which is what a user sees in a CI log; `generated` writes it anew."""

from __future__ import annotations

from pathlib import Path

from pidcfg.text.source import read_document
from pidcfg.validate.catalog import CODE
from pidcfg.validate.engine import check_document

FOLDER = Path(__file__).parent / "cases"
GOLDEN = FOLDER / "messages.txt"


def lines(case: Path) -> list[str]:
    """The findings of one file that carry its code, each in a line."""
    code = CODE.match(case.stem)[0]
    checked = check_document(read_document(case.read_bytes(), case.name))
    found = [d for d in (*checked.findings, *checked.to_check) if d.code == code]
    return [
        f"{d.file}:{d.span.line}:{d.span.column} {d.severity.label}: {d.message}"
        + (f" [{d.plc_effect}]" if d.plc_effect else "")
        for d in found
    ]


def messages() -> str:
    """All of them, in the order of the files."""
    return "".join(f"{line}\n" for case in sorted(FOLDER.glob("*.yaml")) for line in lines(case))
