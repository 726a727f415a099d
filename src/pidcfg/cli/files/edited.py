"""Files that a command edits: the change as a patch, and new contents in the place of the old, whole or not at all."""

from __future__ import annotations

import os
import stat
import sys
from difflib import unified_diff
from pathlib import Path
from typing import TYPE_CHECKING

import click

from pidcfg.cli.files.outputs import write_files
from pidcfg.cli.terminal.console import echo, hand_on
from pidcfg.control_characters import UNPRINTABLE
from pidcfg.reader import read_file

if TYPE_CHECKING:
    from collections.abc import Mapping

PRINTED = frozenset(range(0x20, 0x7F)) - {ord('"'), ord("\\")}
"""Bytes that stand for themselves in a quoted name."""
NO_NEWLINE = "\\ No newline at end of file"


def difference(name: str, before: bytes, after: bytes) -> str:
    """What changes, as `patch` reads it."""
    shown = _quoted(name)
    rows = unified_diff(_lines(before), _lines(after), shown, shown)
    return "".join(row if row.endswith("\n") else f"{row}\n{NO_NEWLINE}\n" for row in rows)


def _quoted(name: str) -> str:
    """A name as `patch` and git write it in a header: in quotes where it would end early, a tab behind blanks."""
    if UNPRINTABLE.search(name) or any(c in '\t\n"\\' or "\ud800" <= c <= "\udfff" for c in name):
        data = os.fsencode(name)
        return '"' + "".join(chr(b) if b in PRINTED else f"\\{b:03o}" for b in data) + '"'
    return f"{name}\t" if " " in name else name


def print_patch(text: str) -> None:
    """Prints what another program may read: every byte as it is, unless a terminal shows it."""
    if sys.stdout.isatty():
        echo(text)
    else:
        hand_on(text.encode())


def _lines(data: bytes) -> list[str]:
    """Lines with their ends, split where `patch` splits them."""
    parts = data.decode().split("\n")
    return [f"{part}\n" for part in parts[:-1]] + ([parts[-1]] if parts[-1] else [])


def replace_files(changed: Mapping[str, tuple[bytes, bytes]]) -> None:
    """Puts new contents in the place of those that were read, by name; nothing where one file is protected or changed.

    Ends the command with the reason.
    """
    for name, (before, _) in changed.items():
        try:
            now, status = read_file(name), Path(name).stat()
        except OSError as error:
            reason = f"cannot read {name} again: {error.strerror}"
            raise click.ClickException(f"{reason}; nothing was written") from None
        if now != before:
            raise click.ClickException(f"{name} has changed since it was read; nothing was written")
        if not status.st_mode & stat.S_IWUSR or not os.access(name, os.W_OK):
            raise click.ClickException(f"{name} is read-only; nothing was written")
        if status.st_nlink > 1:
            links = "has more than one name (hard links), and the others would keep the old text"
            raise click.ClickException(f"{name} {links}; nothing was written")
    write_files({name: data for name, (_, data) in changed.items()}, force=True, over_inputs=True)
