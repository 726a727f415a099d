"""What every rule says about its case files, which is what a user sees in a CI log; `generated` writes it anew."""

from __future__ import annotations

import re
from collections import defaultdict
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from pidcfg.text.source import read_document
from pidcfg.validate.catalog import CODE_PATTERN
from pidcfg.validate.engine import check_document

if TYPE_CHECKING:
    from collections.abc import Callable

    from pidcfg.text.diagnostics import Diagnostic

FOLDER = Path(__file__).parent / "cases"
GOLDEN = FOLDER / "messages.txt"
VENDOR = re.compile(r"^vendor: *(\w+)", re.MULTILINE)


@cache
def said_of(case: Path) -> tuple[Diagnostic, ...]:
    """What the rules say of one file: its findings, and the lines that it gives the checklist."""
    checked = check_document(read_document(case.read_bytes(), case.name))
    return (*checked.findings, *checked.to_check)


def lines(case: Path) -> list[str]:
    """The findings of one file that carry its code, each in a line."""
    code = CODE_PATTERN.match(case.stem)[0]
    found = [d for d in said_of(case) if d.code == code]
    return [
        f"{d.file}:{d.span.line}:{d.span.column} {d.severity.label}: {d.message}"
        + (f" [{d.plc_effect}]" if d.plc_effect else "")
        for d in found
    ]


def is_about(case: Path, wanted: Callable[[str], bool]) -> bool:
    """Whether a file is one of a vendor that is wanted, or names none."""
    vendor = VENDOR.search(case.read_text("utf-8", errors="replace"))
    return vendor is None or wanted(vendor[1])


def messages(wanted: Callable[[str], bool] = bool) -> str:
    """All of them, in the order of the files; those of other vendors than are wanted as they were committed."""
    committed = defaultdict[str, list[str]](list)
    for line in GOLDEN.read_text("utf-8").splitlines():
        committed[line.partition(":")[0]].append(line)
    cases = sorted(FOLDER.glob("*.yaml"))
    found = (lines(case) if is_about(case, wanted) else committed[case.name] for case in cases)
    return "".join(f"{line}\n" for part in found for line in part)
