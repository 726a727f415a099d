"""How a command that cannot go on says so, on standard error."""

from __future__ import annotations

import os
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING

import click

from pidcfg.cli.environment import hint
from pidcfg.cli.terminal.console import note
from pidcfg.control_characters import one_line

if TYPE_CHECKING:
    from collections.abc import Iterable


def say(error: click.ClickException) -> None:
    """An error as click writes it, through what knows colours and code pages."""
    text = StringIO()
    if isinstance(error, click.BadParameter) and error.param is not None and error.param_hint is None:
        error.param_hint = hint(error.param, error.ctx)
    error.show(text)
    if isinstance(error, click.NoSuchOption) and error.ctx is not None and error.ctx.parent is None:
        text.write("Options of a command stand behind it: pidcfg validate --strict …\n")
    for parameter in _also_missing(error):
        text.write(f"Also missing: {hint(parameter, error.ctx)}\n")  # type: ignore[attr-defined]
    shown = text.getvalue().rstrip("\n")
    if error.message and not isinstance(error, click.exceptions.NoArgsIsHelpError):
        shown = shown.replace(click.unstyle(error.message), one_line(error.message))  # show leaves sequences out
    note(shown)


def _also_missing(error: click.ClickException) -> Iterable[click.Parameter]:
    """Further required parameters that were not given: those that the command line has come before all others."""
    if not isinstance(error, click.MissingParameter) or error.ctx is None:
        return ()
    known = error.ctx.params
    return [p for p in error.ctx.command.params if p.required and p.name not in known and p is not error.param]


def refused(error: OSError) -> str:
    """What the system refuses, by its name where there is one; a process that is gone says so itself."""
    if isinstance(error, ChildProcessError) and error.errno is None:
        return str(error)
    try:
        Path.cwd()
    except OSError:
        return "the working directory is gone; change to one that is there"
    what = f" {os.fsdecode(error.filename)}" if isinstance(error.filename, str | bytes) else ""
    return one_line(f"cannot write or read{what}: {error.strerror or error}")
