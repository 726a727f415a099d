"""The few words of a shell that the pages of the documentation use, in this process: the same on every system."""

from __future__ import annotations

import io
import os
import re
import shlex
import shutil
import sys
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING
from unittest.mock import patch

if TYPE_CHECKING:
    from collections.abc import Iterator


class Shell:
    """Runs one command after the other; ``code`` is the last one's exit code."""

    def __init__(self) -> None:
        self.code = 0

    def run(self, command: str) -> tuple[str, str]:
        """What the command shows on a terminal, and what of it is standard output."""
        if command == "echo $?":
            text, self.code = f"{self.code}\n", 0
            return text, text
        words, target = shlex.split(command), None
        if ">" in words:
            target = words[words.index(">") + 1]
            words = words[: words.index(">")]
        words = [found for word in words for found in expanded(word)]
        variables = {}
        while words and re.fullmatch(r"[A-Z_]+=.*", words[0]):
            name, _, variables[name] = words.pop(0).partition("=")
        program = {"pidcfg": pidcfg, "cd": cd, "cat": cat, "cp": cp, "mkdir": mkdir, "cmp": cmp}.get(words[0])
        if program is None:
            sys.exit(f"{command!r} is no command of the pages: give it a reason in NOT_RUN, or a function here")
        with environment(variables):
            self.code, both, out = captured(program, words[1:])
        if target is None:
            return both, out
        Path(target).write_text(out, "utf-8", newline="\n")
        return ("", "") if both == out else (both.replace(out, ""), "")


def expanded(word: str) -> list[str]:
    """The files that a pattern means, as a shell puts them in its place."""
    return sorted(path.as_posix() for path in Path().glob(word)) or [word] if "*" in word else [word]


@contextmanager
def environment(variables: dict[str, str]) -> Iterator[None]:
    """Variables for one command."""
    before = dict(os.environ)
    os.environ.update(variables)
    try:
        yield
    finally:
        os.environ.clear()
        os.environ.update(before)


class Tee(io.BytesIO):
    """One of the two outputs; what is written to it reaches the terminal as well."""

    def __init__(self, terminal: io.BytesIO) -> None:
        super().__init__()
        self.terminal = terminal

    def write(self, data: object) -> int:
        """Writes to both."""
        self.terminal.write(data)  # type: ignore[arg-type]
        return super().write(data)  # type: ignore[arg-type]


def captured(program: object, words: list[str]) -> tuple[int, str, str]:
    """Exit code, terminal and standard output of a function that stands for a program."""
    terminal = io.BytesIO()
    out, err = (io.TextIOWrapper(Tee(terminal), "utf-8", write_through=True, newline="\n") for _ in range(2))
    with redirect_stdout(out), redirect_stderr(err):
        code = program(words)  # type: ignore[operator]
    return code, terminal.getvalue().decode(), out.buffer.getvalue().decode()


def pidcfg(words: list[str]) -> int:
    """The command itself, from its entry point, as an installation without the extra ``fast`` runs it."""
    from pidcfg.cli.main import main

    sys.argv, before = ["pidcfg", *words], sys.argv
    try:
        with patch("pidcfg.sim.engine.choice.is_installed", lambda: False):
            main()
    except SystemExit as end:
        return int(end.code or 0)
    finally:
        sys.argv = before
    return 0


def cd(words: list[str]) -> int:
    """Changes the folder."""
    os.chdir(words[0])
    return 0


def cat(words: list[str]) -> int:
    """Prints files."""
    for word in words:
        sys.stdout.write(Path(word).read_text("utf-8"))
    return 0


def cp(words: list[str]) -> int:
    """Copies files to a file or into a folder."""
    for word in words[:-1]:
        shutil.copy(word, words[-1])
    return 0


def mkdir(words: list[str]) -> int:
    """Makes folders."""
    for word in words:
        Path(word).mkdir()
    return 0


def cmp(words: list[str]) -> int:
    """Compares two files, and is silent when they are the same."""
    same = Path(words[0]).read_bytes() == Path(words[1]).read_bytes()
    sys.stdout.write("" if same else f"{words[0]} {words[1]} differ\n")
    return 0 if same else 1
