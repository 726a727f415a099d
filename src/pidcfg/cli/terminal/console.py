"""What reaches the terminal: results on stdout, everything else on stderr, and rich only where a person watches."""

from __future__ import annotations

import codecs
import json
import os
import sys
from typing import TYPE_CHECKING

import click

from pidcfg.cli.terminal import colour
from pidcfg.cli.terminal.glyphs import encodable, fits
from pidcfg.cli.terminal.progress import LINE
from pidcfg.control_characters import one_line, printable

if TYPE_CHECKING:
    from typing import TextIO

WIDEST = 1000
"""Columns of a page: COLUMNS may say any number."""


def echo(text: str) -> None:
    """A result as it is: a file's text, never coloured; where a code page lacks some of it, a note says so.

    Where a person watches, control characters in it are shown and not obeyed.
    """
    if sys.stdout.isatty():
        text = printable(text.replace("\r\n", "\n"))
    _put(text, color=False)
    if not fits(text, sys.stdout.encoding):
        lacking = "".join(dict.fromkeys(c for c in text if not fits(c, sys.stdout.encoding)))
        note(
            f"note: the code page {sys.stdout.encoding} lacks {lacking!a}: that text was replaced; "
            "a file is written in UTF-8, and so is standard output with PYTHONUTF8=1"
        )


def show(text: str) -> None:
    """A result for people: in colour where that is wanted."""
    text, coloured = printable(text), colour.enabled(sys.stdout)
    _put(colour.painted(text) if coloured else text, color=coloured)


def echo_json(text: str) -> None:
    """A JSON result; JSON is UTF-8, so on another code page JSON's own escapes stand for what is not ASCII."""
    if not (text.isascii() or _is_utf8(text)):
        text = json.dumps(json.loads(text), indent=2) + "\n"
    echo(text)


def echo_xml(text: str) -> None:
    """XML or HTML that says it is UTF-8; on another code page numbers stand for characters that are not ASCII."""
    if not (text.isascii() or _is_utf8(text)):
        text = text.encode("ascii", "xmlcharrefreplace").decode()
    echo(text)


def _is_utf8(text: str) -> bool:
    """Whether a text reaches standard output as UTF-8."""
    encoding = sys.stdout.encoding or "utf-8"
    return codecs.lookup(encoding).name == "utf-8" and fits(text, encoding)


def note(text: str) -> None:
    """A remark for people, on stderr."""
    LINE.end()
    coloured = colour.enabled(sys.stderr)
    text = encodable(printable(text), sys.stderr.encoding)
    try:
        click.echo(colour.painted(text) if coloured else text, err=True, color=coloured)
    except OSError:  # nobody reads it, or the disk is full: a remark that is lost changes no exit code
        drop(sys.stderr)


def remark(text: str) -> None:
    """A note that has one line to itself, whatever the names and values in it hold."""
    note(one_line(text))


def _put(text: str, *, color: bool) -> None:
    """Prints; when the reader has gone (as `| head` does) the command goes on, with its files and its exit code."""
    LINE.end()
    try:
        click.echo(encodable(text, sys.stdout.encoding), nl=False, color=color)
    except BrokenPipeError:
        drop(sys.stdout)


def drop(stream: TextIO) -> None:
    """Sends what is still to be written to nowhere: Python would complain again when it closes the stream."""
    os.close(stream.fileno())  # first: no more files may be open than are now
    nowhere = os.open(os.devnull, os.O_WRONLY)
    if nowhere != stream.fileno():
        os.dup2(nowhere, stream.fileno())
        os.close(nowhere)


def markdown(text: str) -> None:
    """A page of documentation: formatted where colour is wanted, as it is elsewhere."""
    if not colour.enabled(sys.stdout):
        _put(text, color=False)
        return
    import shutil
    from io import StringIO

    from rich.console import Console
    from rich.markdown import Markdown

    page, width = StringIO(), min(shutil.get_terminal_size().columns, WIDEST)
    Console(file=page, force_terminal=True, color_system="standard", legacy_windows=False, width=width).print(
        Markdown(text)
    )
    _put(page.getvalue(), color=True)
