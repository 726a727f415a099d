"""Texts in the quotes of a word processor, which are letters to YAML."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.diagnostics import Diagnostic, Severity
from pidcfg.document import Plain
from pidcfg.odd_signs import QUOTES, code, in_curly_quotes
from pidcfg.validate.codes import D720
from pidcfg.validate.identity import loop_name

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.document import Document
    from pidcfg.paths import Path


def curly_quotes(doc: Document) -> list[Diagnostic]:
    """A warning for each plain text of a file that begins and ends so."""
    if not any(quote in doc.text for quote in QUOTES):
        return []
    return [_warning(doc, path, text) for path, text in _plain_texts(doc.data, ()) if in_curly_quotes(text)]


def _plain_texts(data: object, path: Path) -> Iterator[tuple[Path, str]]:
    """Every text that stands without quotes of YAML, and its place."""
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for step, value in items:
        if isinstance(value, Plain):
            yield (*path, step), value
        else:
            yield from _plain_texts(value, (*path, step))


def _warning(doc: Document, path: Path, text: str) -> Diagnostic:
    message = f"{path[-1]}: the quotes of {text[:60]} are a part of the text: {code(text[0])} is a letter to YAML"
    cure = f'write "{text[1:-1]}" with straight quotes'
    return Diagnostic(
        code="PID018",
        severity=Severity.WARNING,
        message=message,
        file=doc.file,
        span=doc.locate(path),
        path=path,
        loop=loop_name(doc, path),
        help=cure,
        reference=str(D720),
    )
