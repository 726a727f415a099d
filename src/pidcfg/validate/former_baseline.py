"""Baselines of former formats, which are read until 1.0: what they know becomes entries of the present one.

A row of the second format has the value at the key of its finding and none of those that it is compared with; it knows
a finding of its code, severity, loop, key and value. The first format knew findings by path and message, of which one
could stand for several loops. A row knows the findings of its code and severity in its file that say the same at the
same path. The wording has changed where findings of several loops became one a loop, so these count as well:

* a message that ended in "as in A, B and 2 more": the findings of these loops, and of so many more;
* a finding of several loops: those at each of them, when the row names them and quotes no other numbers;
* a message that stands at another path now.

Rows of rules that are lines of the checklist now know nothing, and go.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, NamedTuple

from pidcfg.validate.catalog import current, rule_of, rules

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from pidcfg.diagnostics import Diagnostic

COUNTED_LOOP = re.compile(r"^loops\[\d+\]")
MERGED = re.compile(r", as in (?P<names>.+?)(?: and (?P<more>\d+) more)?$")
"""The end of a message that stood for several loops."""
REWORDED = frozenset(("DL293", "EZ404", "NX602", "NX604"))
"""Rules whose findings within one loop, or at blocks, have another wording or stand at more places now."""
SUBJECT = 3
"""Words that a message begins with before it says anything: ``the name TIC1``."""
NUMBER = re.compile(r"\d+(?:\.\d+)?")


class FormerEntry(NamedTuple):
    """A finding as the first format kept it."""

    code: str
    severity: str
    file: str
    path: str
    message: str

    @property
    def place(self) -> str:
        """Where it was found."""
        return self.path

    @property
    def said(self) -> str:
        """What was found."""
        return self.message


class SecondEntry(NamedTuple):
    """A finding as the second format kept it: without what it is compared with."""

    file: str
    code: str
    severity: str
    loop: str
    key: str
    value: str | None

    @property
    def place(self) -> str:
        """Where it was found."""
        return " ".join(filter(None, (self.loop, self.key)))

    @property
    def said(self) -> str:
        """What was found."""
        return self.value or "no value"


class Renewed(NamedTuple):
    """What becomes of former rows: the findings that they know, the rows that know none, and those that go."""

    known: list[Diagnostic]
    left: list[FormerEntry | SecondEntry]
    gone: list[FormerEntry | SecondEntry]


def renewed(
    rows: Sequence[FormerEntry | SecondEntry], findings: Iterable[Diagnostic], file_of: Callable[[str], str]
) -> Renewed:
    """The findings that the rows of a former baseline know; a row that several findings fit knows each of them once."""
    by_rule: dict[tuple[str, str, str], list[Diagnostic]] = {}
    for d in findings:
        by_rule.setdefault((d.code, d.severity.label, file_of(d.file)), []).append(d)
    result = Renewed([], [], [])
    taken: set[int] = set()
    for row in rows:
        code = current(row.code)
        if code in rules(code) and rule_of(code).checklist:
            result.gone.append(row)
            continue
        candidates = by_rule.get((code, row.severity, row.file), [])
        free = [d for d in candidates if id(d) not in taken]
        known = list(_known(row, free))
        merges = isinstance(row, FormerEntry) and any(True for _ in _known(row, candidates))
        if not known and not merges:
            result.left.append(row)
        taken.update(map(id, known))
        result.known.extend(known)
    return result


def _known(row: FormerEntry | SecondEntry, findings: Sequence[Diagnostic]) -> Iterable[Diagnostic]:
    """The findings that a row knows."""
    if isinstance(row, FormerEntry):
        return _said(row, findings)
    return [d for d in findings if (d.loop, d.key, d.value) == row[3:]][:1]


def _said(row: FormerEntry, findings: Sequence[Diagnostic]) -> Iterator[Diagnostic]:
    """The findings that a row of the first format knows."""
    at_path = [d for d in findings if _path(d) == row.path]
    merged = None if any(d.message == row.message for d in at_path) else MERGED.search(row.message)
    stem = row.message[: merged.start()] if merged else row.message
    same = [d for d in at_path if d.message == stem] or [d for d in at_path if stem in d.message.split("; ")]
    if current(row.code) in REWORDED:
        yield from (d for d in findings if d in same or _is_reworded(row, d))
    elif merged is not None:
        yield from same[:1]
        yield from _of_loops(merged, [d for d in findings if not row.path.startswith(f"loops[{d.loop}]")])
    elif same and not same[0].with_loops:
        yield same[0]
    else:
        shared = [d for d in findings if d.with_loops and (d in same or _names(row, d))]
        yield from shared or [d for d in findings if d.message == stem or _is_of_the_file(row, d)]


def _is_reworded(row: FormerEntry, d: Diagnostic) -> bool:
    """Whether a finding says the same as a row in other words: at its path, of the same name, or of the same loops."""
    if _path(d) == row.path:
        return _has_no_other_numbers(row, d)
    begins = (text.casefold().split()[:SUBJECT] for text in (row.message, d.message))
    return d.message == row.message or len(set(map(tuple, begins))) == 1 or (bool(d.with_loops) and _names(row, d))


def _of_loops(merged: re.Match[str], findings: Sequence[Diagnostic]) -> Iterator[Diagnostic]:
    """The findings of loops that a message named, and of so many more as it only counted."""
    names, more = merged["names"].split(", "), int(merged["more"] or 0)
    for d in findings:
        if d.loop in names:
            yield d
        elif more:
            more -= 1
            yield d


def _names(row: FormerEntry, d: Diagnostic) -> bool:
    """Whether a row speaks of a finding's loop and of one that it concerns with it, and of no other numbers."""
    text = f"{row.path} {row.message}"
    has = {name for name in (d.loop, *d.with_loops) if re.search(rf"(?<!\w){re.escape(name)}(?!\w)", text)}
    return len(has) > 1 and _has_no_other_numbers(row, d)


def _is_of_the_file(row: FormerEntry, d: Diagnostic) -> bool:
    """Whether a finding that was reported at one loop is reported at their list now."""
    return d.path == ("loops",) and row.path.startswith("loops[") and _has_no_other_numbers(row, d)


def _has_no_other_numbers(row: FormerEntry, d: Diagnostic) -> bool:
    """Whether a finding quotes all numbers that a row quotes."""
    return set(NUMBER.findall(row.message)) <= set(NUMBER.findall(d.message))


def _path(d: Diagnostic) -> str:
    """A finding's path as the first format had it, with the name of the loop."""
    return COUNTED_LOOP.sub(lambda _: f"loops[{d.loop}]", d.where) if d.loop else d.where
