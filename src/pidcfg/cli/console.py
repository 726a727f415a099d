"""What reaches the terminal: results on stdout, everything else on stderr; what was read, and what is done next."""

from __future__ import annotations

import codecs
import json
import os
import platform
import re
import stat
import sys
import time
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING

import click

from pidcfg.about import VERSION
from pidcfg.cli import environment
from pidcfg.cli.environment import parameter_hint
from pidcfg.cli.terminal import LINE, can_encode, encodable, is_coloured, paint_report
from pidcfg.text.signs import CI_COMMAND, break_ci_commands, find_ci_command, to_one_line, to_printable

if TYPE_CHECKING:
    from collections.abc import Iterable
    from typing import TextIO

    from pidcfg.study.outcome import Outcome


# ----------------------------------------------------------------------------------------------------------------------
# What reaches the terminal: results on stdout, everything else on stderr, and rich only where a person watches.

MAX_PAGE_WIDTH = 1000
"""Columns of a page: COLUMNS may say any number."""
CI_VARIABLES = ("GITHUB_ACTIONS", "TF_BUILD", "TEAMCITY_VERSION")
"""Variables of the CI systems that look for orders in a log."""
NOT_ASCII = re.compile(r"[^\x00-\x7f]")


def echo(text: str) -> None:
    """A result as it is, a file's text that nothing may be put into: where a line of it would be an order, none."""
    _refuse_ci_commands(encodable(text, sys.stdout.encoding))
    show_ci_commands(text)


def write_user_file(data: bytes) -> None:
    """The bytes of a user's own file, as `echo` prints texts."""
    _refuse_ci_commands(data.decode("utf-8", "replace"))
    sys.stdout.buffer.write(data)


def show_lines(text: str) -> None:
    """A result that a program takes from a log: never coloured, and no order."""
    show_ci_commands(break_ci_commands(encodable(text, sys.stdout.encoding)))


def show_ci_commands(text: str) -> None:
    """A result as it is, with orders that are meant; where a code page lacks some of it, a note says so.

    Where a person watches, control characters in it are shown and not obeyed.
    """
    if sys.stdout.isatty():
        text = to_printable(text.replace("\r\n", "\n"))
    _print_text(text, color=False)
    if not can_encode(text, sys.stdout.encoding):
        missing_signs = "".join(dict.fromkeys(c for c in text if not can_encode(c, sys.stdout.encoding)))
        write_note(
            f"note: the code page {sys.stdout.encoding} lacks {missing_signs!a}: that text was replaced; "
            "a file is written in UTF-8, and so is standard output with PYTHONUTF8=1"
        )


def show_text(text: str) -> None:
    """A result for people: in colour where that is wanted."""
    text, coloured = _to_safe_text(text, sys.stdout), is_coloured(sys.stdout)
    _print_text(paint_report(text) if coloured else text, color=coloured)


def echo_json(text: str) -> None:
    """A JSON result; JSON is UTF-8, so on another code page JSON's own escapes stand for what is not ASCII."""
    if not (text.isascii() or _is_utf8(text)):
        text = NOT_ASCII.sub(lambda sign: json.dumps(sign[0])[1:-1], text)
    echo(text)


def echo_xml(text: str) -> None:
    """XML or HTML that says it is UTF-8; on another code page numbers stand for characters that are not ASCII."""
    if not (text.isascii() or _is_utf8(text)):
        text = text.encode("ascii", "xmlcharrefreplace").decode()
    if find_ci_command(text) is not None:
        text = CI_COMMAND.sub(lambda begin: f"{begin[0][:-1]}&#{ord(begin[0][-1])};", text)
    echo(text)


def _is_utf8(text: str) -> bool:
    """Whether a text reaches standard output as UTF-8."""
    encoding = sys.stdout.encoding or "utf-8"
    return codecs.lookup(encoding).name == "utf-8" and can_encode(text, encoding)


def write_note(text: str) -> None:
    """A remark for people, on stderr."""
    LINE.end()
    coloured = is_coloured(sys.stderr)
    text = _to_safe_text(text, sys.stderr)
    try:
        click.echo(paint_report(text) if coloured else text, err=True, color=coloured)
    except OSError:  # nobody reads it, or the disk is full: a remark that is lost changes no exit code
        discard_output(sys.stderr)


def write_remark(text: str) -> None:
    """A note that has one line to itself, whatever the names and values in it hold."""
    write_note(to_one_line(text))


def _to_safe_text(text: str, stream: TextIO) -> str:
    """Text that hides nothing and orders nothing, also once a code page has replaced some of it."""
    return break_ci_commands(encodable(to_printable(text), stream.encoding))


def _refuse_ci_commands(text: str) -> None:
    """Ends the command where a line of a result would be an order to a CI system that reads it; a file is no log."""
    ci_command = None if set(CI_VARIABLES).isdisjoint(os.environ) else find_ci_command(text)
    if ci_command is None:
        return
    try:
        if stat.S_ISREG(os.fstat(sys.stdout.fileno()).st_mode):
            return
    except OSError:  # no file at all
        pass
    line = text.count("\n", 0, ci_command.end()) + 1
    reason = f"line {line} of the result would be an order to the CI job that keeps this log"
    raise click.ClickException(f"{reason}; send the result to a file: > FILE")


def _print_text(text: str, *, color: bool) -> None:
    """Prints; when the reader has gone (as `| head` does) the command goes on, with its files and its exit code."""
    LINE.end()
    try:
        click.echo(encodable(text, sys.stdout.encoding), nl=False, color=color)
    except BrokenPipeError:
        discard_output(sys.stdout)


def discard_output(stream: TextIO) -> None:
    """Sends what is still to be written to nowhere: Python would complain again when it closes the stream."""
    os.close(stream.fileno())  # first: no more files may be open than are now
    devnull = os.open(os.devnull, os.O_WRONLY)
    if devnull != stream.fileno():
        os.dup2(devnull, stream.fileno())
        os.close(devnull)


def show_markdown(text: str) -> None:
    """A page of documentation: formatted where colour is wanted, as it is elsewhere."""
    if not is_coloured(sys.stdout):
        _print_text(break_ci_commands(encodable(text, sys.stdout.encoding)), color=False)
        return
    import shutil
    from io import StringIO

    from rich.console import Console
    from rich.markdown import Markdown

    page, width = StringIO(), min(shutil.get_terminal_size().columns, MAX_PAGE_WIDTH)
    Console(file=page, force_terminal=True, color_system="standard", legacy_windows=False, width=width).print(
        Markdown(text)
    )
    _print_text(break_ci_commands(encodable(page.getvalue(), sys.stdout.encoding)), color=True)


# --- What is usually done next: one line for a person at a terminal, never for a file, a pipe or CI -------------------

SAFE_WORD = re.compile(r"[\w@%+=:,./-]+")
"""A word that a shell takes as it is."""


def suggest_next_step(*words: str, quiet: bool = False, fmt: str = "text") -> None:
    """Names the command that is usually next, ``words`` behind ``pidcfg``."""
    if quiet or fmt != "text" or "CI" in os.environ or not sys.stderr.isatty():
        return
    write_remark(f"next: pidcfg {' '.join(word if SAFE_WORD.fullmatch(word) else _quote_word(word) for word in words)}")


def _quote_word(word: str) -> str:
    """In double quotes, which every shell knows."""
    return '"' + word.replace('"', '\\"') + '"'


# --- ``--verbose``: what a command has read, left out and taken from elsewhere, on standard error ---------------------


class VerboseLog:
    """What is said with ``--verbose``, and nothing without it."""

    def __init__(self, ctx: click.Context, *, verbose: bool, quiet: bool) -> None:
        if verbose and quiet:
            raise click.UsageError("--verbose and --quiet exclude each other", ctx)
        self.is_wanted = verbose
        self._begin_time = self._last_time = time.perf_counter()
        self.write_lines(f"pidcfg {VERSION}, Python {platform.python_version()}, {platform.system()}")
        self.write_lines(*(f"environment: {setting}" for setting in environment.variables_in_force(ctx.command)))

    def write_lines(self, *lines: str) -> None:
        """Lines for whoever wants to know."""
        for line in lines if self.is_wanted else ():
            write_remark(line)

    def write_names(self, title: str, names: Iterable[str]) -> None:
        """A line for each name."""
        self.write_lines(*(f"{title} {name}" for name in names))

    def write_run(self, outcome: Outcome) -> None:
        """What a run read, and how fast it was."""
        self.write_lines(*(f"read {name}" for name in dict.fromkeys((outcome.file, outcome.config)) if name))
        now = time.perf_counter()
        seconds, self._last_time = now - self._last_time, now
        if outcome.report is not None:
            duration = outcome.report.duration
            self.write_lines(f"ran {outcome.file}: {duration:g} s in {seconds:.2f} s, engine {outcome.report.engine}")

    def write_time(self) -> None:
        """How long it took."""
        self.write_lines(f"took {time.perf_counter() - self._begin_time:.2f} s")


# --- How a command that cannot go on says so, on standard error -------------------------------------------------------


def print_error(error: click.ClickException) -> None:
    """An error as click writes it, through what knows colours and code pages."""
    text = StringIO()
    if isinstance(error, click.BadParameter) and error.param is not None and error.param_hint is None:
        error.param_hint = parameter_hint(error.param, error.ctx)
    error.show(text)
    if isinstance(error, click.NoSuchOption) and error.ctx is not None and error.ctx.parent is None:
        text.write("Options of a command stand behind it: pidcfg validate --strict …\n")
    for parameter in _missing_parameters(error):
        text.write(f"Also missing: {parameter}\n")
    message = text.getvalue().rstrip("\n")
    if error.message and not isinstance(error, click.exceptions.NoArgsIsHelpError):
        message = message.replace(click.unstyle(error.message), to_one_line(error.message))  # show leaves sequences out
    write_note(message)


def _missing_parameters(error: click.ClickException) -> Iterable[str]:
    """Further required parameters that were not given: those that the command line has come before all others."""
    if not isinstance(error, click.MissingParameter) or error.ctx is None:
        return ()
    ctx, given = error.ctx, error.ctx.params
    missing = [p for p in ctx.command.params if p.required and p.name not in given and p is not error.param]
    return [parameter_hint(parameter, ctx) for parameter in missing]


def system_refusal(error: OSError) -> str:
    """What the system refuses, by its name where there is one; a process that is gone says so itself."""
    if isinstance(error, ChildProcessError) and error.errno is None:
        return str(error)
    try:
        Path.cwd()
    except OSError:
        return "the working directory is gone; change to one that is there"
    file_text = f" {os.fsdecode(error.filename)}" if isinstance(error.filename, str | bytes) else ""
    return to_one_line(f"cannot write or read{file_text}: {error.strerror or error}")
