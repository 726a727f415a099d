"""Known findings: a list that is written once and from then on only shrinks.

An entry has neither a line nor a message: it is file, code, severity, loop, key, the value that is written there
(`pidcfg.validate.identity`) and what else the message quotes of the loop (`pidcfg.validate.quotes`), with how many such
findings there are. So it survives every edit that does not touch its loop, and a value that changes is a new finding,
at whichever key it stands. Entries of former formats are in `pidcfg.validate.former_baseline`.
"""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

from pidcfg.diagnostics import Diagnostic, Severity, Span, number_of
from pidcfg.validate.catalog import current, ignorable
from pidcfg.validate.codes import D317, SUPPRESSION
from pidcfg.validate.former_baseline import FormerEntry, SecondEntry
from pidcfg.writer import json_line

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Sequence

VERSION, FIRST, SECOND = 3, 1, 2
NEVER_KNOWN = frozenset(rule.code for rule in SUPPRESSION)
"""What is wrong with ignores and with the baseline itself is to be corrected, and never enters a baseline."""
COUNT = "count"


class Entry(NamedTuple):
    """A finding without its place; the file is seen from the folder of the baseline."""

    file: str
    code: str
    severity: str
    loop: str
    key: str
    value: str | None
    quotes: str | None = None


class BaselineError(Exception):
    """A baseline that cannot be read."""


@dataclass(frozen=True, slots=True)
class Baseline:
    """What a file of known findings has: entries, each as often as it counts, and rows of former formats."""

    entries: list[Entry] = field(default_factory=list)
    former: list[FormerEntry | SecondEntry] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class Compared:
    """The findings that are new, those that are known, and the entries that no longer occur, in order."""

    new: list[Diagnostic]
    known: list[Diagnostic]
    stale: list[Entry]


def entry(finding: Diagnostic, file_of: Callable[[str], str]) -> Entry:
    """A finding as a baseline keeps it."""
    d = finding
    return Entry(file_of(d.file), d.code, d.severity.label, d.loop, d.key, d.value, d.quotes)


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
    files = read_files(findings, checked_files, file_of)
    stale = [e for e in entries if e.file in files and _take(left, e)]
    return Compared(new, known, stale)


def read_files(findings: Sequence[Diagnostic], checked_files: set[str], file_of: Callable[[str], str]) -> set[str]:
    """The files that every rule has seen: of the others nobody can say what no longer occurs."""
    return checked_files - {file_of(d.file) for d in findings if not ignorable(d)}


def _take(left: Counter[Entry], key: Entry) -> bool:
    """Counts one down, if there is one."""
    present = left[key] > 0
    left[key] -= present
    return present


def without(entries: Sequence[Entry], stale: Sequence[Entry]) -> list[Entry]:
    """What is left of a baseline: never more than there was."""
    left = Counter(stale)
    return [e for e in entries if not _take(left, e)]


def to_text(baseline: Baseline) -> str:
    """A baseline as a file: one entry a line, in order, so that a diff shows what was removed."""
    rows = [_row(e, count) for e, count in sorted(Counter(baseline.entries).items(), key=lambda row: _order(row[0]))]
    rows += sorted(former_row(row, count) for row, count in Counter(baseline.former).items())
    body = "[\n" + ",\n".join(f"    {row}" for row in rows) + "\n  ]" if rows else "[]"
    return f'{{\n  "version": {VERSION},\n  "findings": {body}\n}}\n'


def _order(e: Entry) -> tuple[str, ...]:
    """By number of the code, as findings are."""
    return (number_of(e.code), *e[:-2], *("" if text is None else f"={text}" for text in e[-2:]))


def _row(e: Entry, count: int) -> str:
    """An entry as the file has it, without the comma behind it."""
    return json_line({**e._asdict(), COUNT: count})


def former_row(row: FormerEntry | SecondEntry, count: int) -> str:
    """A row of a former format as the file has it; one of the first stands there as often as it counts."""
    if isinstance(row, SecondEntry):
        return json_line({**row._asdict(), COUNT: count})
    return ",\n    ".join([json_line(row._asdict())] * count)


def from_text(text: str) -> Baseline:
    """What a file says; raises `BaselineError`."""
    try:
        data = json.loads(text)
    except json.JSONDecodeError as error:
        raise BaselineError(f"{error.lineno}:{error.colno}: not JSON: {error.msg}") from None
    except (RecursionError, ValueError) as error:
        raise BaselineError(f"1:1: not JSON: {type(error).__name__}") from None
    if not isinstance(data, dict) or not isinstance(data.get("findings"), list):
        raise BaselineError(f"1:1: not a baseline of version {VERSION}")
    version = data.get("version")
    if isinstance(version, bool) or not isinstance(version, int) or version not in {FIRST, SECOND, VERSION}:
        raise BaselineError(f"1:1: not a baseline of version {VERSION}")
    baseline = Baseline()
    for number, row in enumerate(data["findings"]):
        _read(number, row, baseline, version)
        if len(baseline.entries) + len(baseline.former) > MOST:
            raise BaselineError(f"1:1: findings[{number}]: the counts up to here are more than {MOST} findings")
    return baseline


def _read(number: int, row: Any, baseline: Baseline, version: int) -> None:
    """One row of a file, put where it belongs; rows of former formats may stand in a later one."""
    keys = set(row) if isinstance(row, dict) else set()
    if keys == set(FormerEntry._fields) and all(isinstance(value, str) for value in row.values()):
        baseline.former.append(FormerEntry(**row))
        return
    if version >= SECOND and keys == {*SecondEntry._fields, COUNT} and _is_sound(row):
        count = row.pop(COUNT)
        baseline.former.extend([SecondEntry(**row)] * count)
        return
    if version < VERSION or keys != {*Entry._fields, COUNT} or not _is_sound(row):
        fields = {FIRST: FormerEntry._fields, SECOND: SecondEntry._fields}.get(version, Entry._fields)
        null = " and ".join(name for name in fields if name in OR_NULL)
        more = f" ({null}: text or null) and a {COUNT} above 0" if null else ""
        raise BaselineError(f"1:1: findings[{number}] must have the texts {', '.join(fields)}{more}")
    count = row.pop(COUNT)
    baseline.entries.extend([Entry(**row)] * count)


MOST = 1_000_000
"""Findings that a baseline may stand for."""
OR_NULL = ("value", "quotes")
"""Keys of an entry that may have nothing to say."""


def _is_sound(row: dict[str, Any]) -> bool:
    """Whether a row has the right types."""
    count = row[COUNT]
    whole = isinstance(count, int) and not isinstance(count, bool) and 0 < count <= MOST
    return whole and all(
        isinstance(text, str) or (text is None and key in OR_NULL) for key, text in row.items() if key != COUNT
    )


def stale_findings(
    stale: Sequence[Entry], ignored: Collection[Entry], entries: Sequence[Entry], text: str, file: str
) -> list[Diagnostic]:
    """Entries that no longer occur, or are ``ignored`` by a comment now, as findings at their lines of the file."""
    counts = Counter(entries)
    findings = []
    for e, number in Counter(stale).items():
        share = f" ({number} of {counts[e]})" if number < counts[e] else ""
        status = "is ignored by a comment now" if e in ignored else "no longer occurs"
        place = " ".join(part for part in (e.loop, e.key) if part)
        message = f"{e.code} {status}{share} in {e.file}" + (f" at {place}" if place else "")
        message += "" if e.value is None else f": {e.value}"
        findings.append(stale_finding(message, _row(e, counts[e]), text, file))
    return findings


def stale_rows(rows: Iterable[FormerEntry | SecondEntry], text: str, file: str) -> list[Diagnostic]:
    """Rows of former formats that know no finding, as findings at their lines of the file."""
    findings = []
    for row, number in Counter(rows).items():
        place = f" at {row.place}" if row.place else ""
        message = f"{current(row.code)} no longer occurs in {row.file}{place}: {row.said}"
        findings.append(stale_finding(message, former_row(row, number).partition("\n")[0], text, file))
    return findings


def stale_finding(message: str, row: str, text: str, file: str) -> Diagnostic:
    """A finding at the line of a row of the file; at the first line where somebody wrote the row in another way."""
    lines = text.split("\n")
    line = next((n for n, content in enumerate(lines, start=1) if content.strip().rstrip(",") == row), 1)
    content = lines[line - 1]
    column = len(content) - len(content.lstrip()) + 1
    span = Span(line, column, line, max(column, len(content)) + 1)
    cure = "--shrink-baseline removes it"
    return Diagnostic("PID048", Severity.WARNING, message, file, span, reference=str(D317), help=cure)
