"""The findings of a run, and what several formats need: names relative to the checkout, and fingerprints."""

from __future__ import annotations

import os
import re
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING

from pidcfg.diagnostics import Severity
from pidcfg.frozen import frozen

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.cli.formats.reporters import Documents
    from pidcfg.diagnostics import Diagnostic, Span

STDIN = "<stdin>"
"""The name of standard input in reports."""
CHECKOUTS = ("GITHUB_WORKSPACE", "CI_PROJECT_DIR")
"""Variables in which a CI system names the folder of its checkout, which the names in its formats are relative to."""
VOLATILE = re.compile(r"\bline \d+|\b[A-Z]{1,3}\d+\b|; measured: .*", re.DOTALL)
"""What differs in a message between runs of the same fault: line numbers, registers that move when a loop is inserted
above, what was measured."""
CHARACTERS = 32
"""Of a fingerprint, in hexadecimal: 128 bits."""


@frozen
class Findings:
    """The findings of some files; ``documents`` has every file that was looked at, also those without findings."""

    reported: Sequence[Diagnostic]
    documents: Documents
    fails: Severity = Severity.ERROR
    """From which severity on a finding fails the run."""
    suppressed: Sequence[tuple[Diagnostic, str | None]] = ()
    """Findings that are not reported: a comment ignores them for a reason, or (None) a baseline knows them."""
    command: str = "validate"
    """Which command has found them."""

    @property
    def files(self) -> list[str]:
        """Every file, in the order in which it was looked at."""
        return list(dict.fromkeys([*self.documents, *(d.file for d in self.reported)]))


def checkout() -> Path:
    """The folder that names are relative to: the CI system's checkout when we run inside it, else where we run."""
    here = Path.cwd()
    for name in CHECKOUTS:
        folder = os.environ.get(name, "")
        if Path(folder).is_absolute() and here.is_relative_to(Path(folder).resolve()):
            return Path(folder).resolve()
    return here


def path_in_checkout(file: str) -> str | None:
    """A file's name relative to the checkout, with forward slashes; None for one outside of it."""
    root = checkout()
    path = Path(os.path.abspath(file))  # noqa: PTH100 - a link keeps its name
    if not path.is_relative_to(root):
        try:
            path = path.resolve()
        except (OSError, RuntimeError, ValueError):
            return None
    return path.relative_to(root).as_posix() if path.is_relative_to(root) else None


def display_name(file: str) -> str:
    """A file's name relative to the checkout, or as it was given when it lies outside."""
    return file if file == STDIN else path_in_checkout(file) or file


def uri(file: str) -> tuple[str, bool]:
    """A file as a URI reference, and whether it is relative to the checkout."""
    if file == STDIN:
        return "stdin", False
    name = path_in_checkout(file)
    if name is None and Path(file).is_absolute():
        return Path(file).as_uri(), False
    from urllib.parse import quote

    return quote(os.fsencode(name or os.path.normpath(file)).replace(os.sep.encode(), b"/")), name is not None


def fingerprints(findings: Findings) -> list[str]:
    """One a finding, unique, and the same when lines or loops are inserted above it.

    The value and the message are part of it, so that a value that was accepted once does not hide another wrong value
    later; findings that are equal in everything are numbered. What several loops share has no message in it, since that
    names the others. Codes are hashed as they were before every vendor had a
    prefix, so that no alert is closed and opened again.
    """
    import hashlib

    from pidcfg.validate.catalog import CODE, former

    seen: Counter[str] = Counter()
    named = {d.file for d in findings.reported}
    rows = {file: doc.lines for file, doc in findings.documents.items() if file in named}
    prints = []
    for d in findings.reported:
        steps = [step for step in d.path if isinstance(step, str)]
        value = CODE.sub(lambda match: former(match[0]), _source_text(d.span, rows.get(d.file, [])))
        text = "" if d.with_loops else d.message
        message = CODE.sub(lambda match: former(match[0]), VOLATILE.sub("", text))
        key = "\0".join((former(d.code), display_name(d.file), d.loop, ".".join(steps), value, message))
        seen[key] += 1
        digest = hashlib.sha256(f"{key}\0{seen[key]}".encode("utf-8", "backslashreplace"))
        prints.append(digest.hexdigest()[:CHARACTERS])
    return prints


def _source_text(span: Span, rows: Sequence[str]) -> str:
    """The text at a place, within one line."""
    if span.line != span.end_line or not 0 < span.line <= len(rows):
        return ""
    return rows[span.line - 1][span.column - 1 : span.end_column - 1]


def sentence(d: Diagnostic) -> str:
    """The message with the loop that it concerns, unless it names that itself."""
    return f"{d.message} [{d.loop}]" if d.loop and d.loop not in d.message else d.message


def details(d: Diagnostic) -> list[str]:
    """Everything that a finding says, line by line."""
    rows = (("PLC", d.plc_effect), ("see", d.reference), ("cure", d.help))
    return [sentence(d), *(f"{label}: {text}" for label, text in rows if text)]
