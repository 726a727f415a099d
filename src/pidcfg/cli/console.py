"""What reaches the terminal: results on stdout, everything else on stderr, and rich only where a person watches."""

from __future__ import annotations

import codecs
import json
import os
import sys
import time
from typing import TYPE_CHECKING, TypeVar

import click

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from rich.progress import Progress

T = TypeVar("T")


def echo(text: str) -> None:
    """A result; characters that the terminal's code page lacks are replaced, never a crash."""
    click.echo(_encodable(text, sys.stdout.encoding), nl=False)


def echo_json(text: str) -> None:
    """A JSON result; JSON is UTF-8, so on another code page JSON's own escapes stand for what is not ASCII."""
    if not (text.isascii() or _is_utf8(text)):
        text = json.dumps(json.loads(text), indent=2) + "\n"
    echo(text)


def echo_xml(text: str) -> None:
    """An XML result that says it is UTF-8; on another code page numbers stand for characters that are not ASCII."""
    if not (text.isascii() or _is_utf8(text)):
        text = text.encode("ascii", "xmlcharrefreplace").decode()
    echo(text)


def _is_utf8(text: str) -> bool:
    """Whether a text reaches standard output as UTF-8."""
    encoding = sys.stdout.encoding or "utf-8"
    return codecs.lookup(encoding).name == "utf-8" and _encodable(text, encoding) == text


def note(text: str) -> None:
    """A remark for people, on stderr."""
    click.echo(_encodable(text, sys.stderr.encoding), err=True)


def _encodable(text: str, encoding: str | None) -> str:
    return text.encode(encoding or "utf-8", "replace").decode(encoding or "utf-8", "replace")


def watched() -> bool:
    """Whether a person watches stderr: progress is shown to nobody else."""
    return sys.stderr.isatty() and not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"


def progress(items: Iterable[T], label: str, total: int, *, quiet: bool = False) -> Iterator[T]:
    """The items, with a progress bar once they take longer than a second on a terminal."""
    if quiet or not watched():
        yield from items
        return
    begun, bar = time.monotonic(), None
    try:
        for done, item in enumerate(items, start=1):
            yield item
            if bar is None and time.monotonic() - begun > 1:
                bar = _bar()
                bar.start()
                bar.add_task(label, total=total)
            if bar is not None:
                bar.update(bar.task_ids[0], completed=done)
    finally:
        if bar is not None:
            bar.stop()


def _bar() -> Progress:
    """A bar on stderr that leaves nothing behind."""
    from rich.console import Console
    from rich.progress import Progress

    return Progress(console=Console(stderr=True), transient=True)


def markdown(text: str) -> None:
    """A page of documentation: formatted on a terminal, as it is in a pipe."""
    if not sys.stdout.isatty() or os.environ.get("NO_COLOR"):
        echo(text)
        return
    from rich.console import Console
    from rich.markdown import Markdown

    Console().print(Markdown(text))
