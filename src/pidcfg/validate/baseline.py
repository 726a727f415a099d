"""Known findings: a list that is written once and from then on only shrinks.

An entry has no line number, so that it survives edits above it: code, severity, file, path and message. The path
names loops rather than counting them.
"""

from __future__ import annotations

import json
import re
from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

from pidcfg.diagnostics import Diagnostic, Severity, Span, number_of
from pidcfg.validate.catalog import current, former, ignorable
from pidcfg.validate.codes import D317, SUPPRESSION
from pidcfg.writer import json_line

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Mapping, Sequence

VERSION = 1
NEVER_KNOWN = frozenset(rule.code for rule in SUPPRESSION)
"""What is wrong with ignores and with the baseline itself is to be corrected, and never enters a baseline."""
COUNTED_LOOP = re.compile(r"^loops\[\d+\]")


class Entry(NamedTuple):
    """A finding without its place; the file is seen from the folder of the baseline."""

    code: str
    severity: str
    file: str
    path: str
    message: str


class BaselineError(Exception):
    """A baseline that cannot be read."""


@dataclass(frozen=True, slots=True)
class Compared:
    """The findings that are new, those that are known, and the entries that no longer occur, in order."""

    new: list[Diagnostic]
    known: list[Diagnostic]
    stale: list[Entry]


def entry(finding: Diagnostic, file_of: Callable[[str], str]) -> Entry:
    """A finding as a baseline keeps it."""
    path = COUNTED_LOOP.sub(lambda _: f"loops[{finding.loop}]", finding.where) if finding.loop else finding.where
    return Entry(finding.code, finding.severity.label, file_of(finding.file), path, finding.message)


def enters(finding: Diagnostic) -> bool:
    """Whether a finding may be in a baseline."""
    return ignorable(finding) and finding.code not in NEVER_KNOWN


def compare(
    findings: Sequence[Diagnostic],
    is_selected: Callable[[Diagnostic], bool],
    entries: Sequence[Entry],
    checked_files: set[str],
    file_of: Callable[[str], str],
) -> Compared:
    """Compares findings in ``checked_files`` with a baseline; those that ``is_selected`` refuses are not reported.

    An entry is stale when its file was checked by every rule, and the finding was not there.
    """
    left = Counter(entries)
    new: list[Diagnostic] = []
    known: list[Diagnostic] = []
    for d in findings:
        key = entry(d, file_of)
        if enters(d) and left[key] > 0:
            left[key] -= 1
            if is_selected(d):
                known.append(d)
        elif is_selected(d):
            new.append(d)
    unread = {file_of(d.file) for d in findings if not ignorable(d)}
    read_files = checked_files - unread
    stale = [e for e in entries if e.file in read_files and _take(left, e)]
    return Compared(new, known, stale)


def _take(left: Counter[Entry], key: Entry) -> bool:
    """Counts one down, if there is one."""
    present = left[key] > 0
    left[key] -= present
    return present


def without(entries: Sequence[Entry], stale: Sequence[Entry]) -> list[Entry]:
    """What is left of a baseline, with its codes as they are written there: never more than there was."""
    left = Counter(stale)
    return sorted(e for e, now in zip(entries, with_current_codes(entries), strict=True) if not _take(left, now))


def to_text(entries: Iterable[Entry]) -> str:
    """A baseline as a file: one entry a line, in order, so that a diff shows what was removed."""
    in_order = sorted(entries, key=lambda e: (number_of(e.code), e))
    rows = ",\n".join(f"    {_row(e)}" for e in in_order)
    body = f"[\n{rows}\n  ]" if rows else "[]"
    return f'{{\n  "version": {VERSION},\n  "findings": {body}\n}}\n'


def from_text(text: str) -> list[Entry]:
    """The entries of a file; raises `BaselineError`."""
    try:
        data = json.loads(text)
    except json.JSONDecodeError as error:
        raise BaselineError(f"{error.lineno}:{error.colno}: not JSON: {error.msg}") from None
    except (RecursionError, ValueError) as error:
        raise BaselineError(f"1:1: not JSON: {type(error).__name__}") from None
    if not isinstance(data, dict) or data.get("version") != VERSION or not isinstance(data.get("findings"), list):
        raise BaselineError(f"1:1: not a baseline of version {VERSION}")
    return [_entry(number, row) for number, row in enumerate(data["findings"])]


def _entry(number: int, row: Mapping[str, Any]) -> Entry:
    if not isinstance(row, dict) or set(row) != set(Entry._fields) or not all(isinstance(v, str) for v in row.values()):
        raise BaselineError(f"1:1: findings[{number}] must have the texts {', '.join(Entry._fields)}")
    return Entry(**row)


def with_current_codes(entries: Iterable[Entry]) -> list[Entry]:
    """Entries of a baseline with their codes as they are written now."""
    return [e._replace(code=current(e.code)) for e in entries]


def _row(entry: Entry) -> str:
    """An entry as the file has it, without the comma behind it."""
    return json_line(entry._asdict())


def stale_findings(stale: Sequence[Entry], ignored: Collection[Entry], text: str, file: str) -> list[Diagnostic]:
    """Entries that no longer occur, or are ``ignored`` by a comment now, as findings at their lines of the file."""
    lines = text.splitlines()
    where = {line.strip().rstrip(","): number for number, line in reversed(list(enumerate(lines, start=1)))}
    findings = []
    for e in stale:
        line = next((where[row] for row in map(_row, (e, e._replace(code=former(e.code)))) if row in where), 1)
        column = len(lines[line - 1]) - len(lines[line - 1].lstrip()) + 1
        status = "is ignored by a comment now" if e in ignored else "no longer occurs"
        message = f"{e.code} {status} in {e.file}" + (f" at {e.path}" if e.path else "") + f": {e.message}"
        findings.append(
            Diagnostic(
                "PID048",
                Severity.WARNING,
                message,
                file,
                Span(line, column, line, max(column, len(lines[line - 1])) + 1),
                reference=str(D317),
                help="--shrink-baseline removes it",
            )
        )
    return findings
