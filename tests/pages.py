"""README.md and the pages of docs/ as a reader follows them.

``python tests/pages.py docs/tutorial.md`` renews the outputs that a page shows. Read what changed before you commit it:
an output is what somebody looked at.

A block of the language ``console`` is a session: ``$ `` begins a command, a ``\\`` at its end continues it, and what
follows is what the terminal shows (or standard output alone). A line ``...`` stands for lines that are left out, and a
command that nothing follows is only run; so a block without ``$ `` is nothing but commands. A command that does not end
with 0 needs ``$ echo $?`` after it.

Each page has a folder of its own with ``examples`` in it, and its blocks are followed in order. A block that begins
with a comment that is a file's name, or stands below a line that ends with such a name in backticks and a colon, is that
file; as a ``diff`` its lines take the place of others (``-``), or come behind one (a blank before it).
"""

from __future__ import annotations

import io
import os
import re
import shlex
import shutil
import sys
import tempfile
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

ROOT = Path(__file__).parents[1]
PAGES = {
    path.relative_to(ROOT).as_posix(): path for path in (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))
}
BEGINS_IN = {"README.md": "examples/dl06"}
"""Where a page says that its commands run; the others begin beside ``examples``."""

NOT_RUN = {
    "pip install": "installs; tests/test_setup.py installs the package",
    "python -m venv": "installs",
    "python tasks.py": "tests/test_setup.py has the tasks",
    "python tests/pages.py": "runs the pages",
    "check-jsonschema": "another program; the tests hold the examples to the schemas",
}
"""Commands that a page may show and the tests do not run, and why."""

FENCE = re.compile(r"^(?P<indent> *)(?P<ticks>`{3,})(?P<language>[^` ]*)[^`]*$")
FILE = re.compile(r"^(?:#|//) (?P<name>[\w./-]+\.\w+)$")
ABOVE = re.compile(r"`(?P<name>[\w./-]+\.\w+)`:$")


@dataclass
class Block:
    """A fenced block of a page: its language, the file that it is, its lines, and the line before the first."""

    language: str
    file: str | None
    lines: list[str]
    begin: int


@dataclass
class Step:
    """A command of a session, and the lines that the page shows below it: their numbers in the page, and themselves."""

    command: str
    begin: int
    end: int
    shown: list[str]


def blocks(text: str) -> Iterator[Block]:
    """The fenced blocks of a page."""
    lines, at = text.splitlines(), 0
    while at < len(lines):
        fence = FENCE.match(lines[at])
        at += 1
        if not fence:
            continue
        begin, indent = at, fence["indent"]
        while lines[at].strip() != fence["ticks"]:
            at += 1
        body = [line.removeprefix(indent) for line in lines[begin:at]]
        at += 1
        yield Block(fence["language"], name_of(body, lines[: begin - 1]), body, begin)


def name_of(body: list[str], before: list[str]) -> str | None:
    """The file that a block is: its first line says it, or the last line of text above."""
    above = next((line for line in reversed(before) if line.strip()), "")
    found = (FILE.match(body[0]) if body else None) or ABOVE.search(above)
    return found["name"] if found else None


def steps(block: Block) -> Iterator[Step]:
    """The commands of a session; without a prompt every line is one."""
    prompt, at = "$ " if any(line.startswith("$ ") for line in block.lines) else "", 0
    while at < len(block.lines):
        assert block.lines[at].startswith(prompt), f"line {block.begin + at + 1}: a session begins with '$ '"
        command = block.lines[at].removeprefix(prompt)
        while command.endswith("\\"):
            at += 1
            command = command[:-1].rstrip() + " " + block.lines[at].removeprefix("> ").strip()
        at = first = at + 1
        while prompt and at < len(block.lines) and not block.lines[at].startswith(prompt):
            at += 1
        yield Step(command, block.begin + first, block.begin + at, block.lines[first:at])


# --- what runs them --------------------------------------------------------------------------------------------------


class Shell:
    """The few words of a shell that the pages use, in this process; ``code`` is the last command's exit code."""

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
    return code, terminal.getvalue().decode(), out.buffer.getvalue().decode()  # type: ignore[attr-defined]


def pidcfg(words: list[str]) -> int:
    """The command itself, from its entry point."""
    from pidcfg.cli.main import main

    sys.argv, before = ["pidcfg", *words], sys.argv
    try:
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


# --- following a page ------------------------------------------------------------------------------------------------


def put(block: Block) -> None:
    """Writes the file that a block is, or changes it as a diff says."""
    assert block.file
    path = Path(block.file)
    if block.language != "diff":
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("\n".join(block.lines) + "\n", "utf-8", newline="\n")
        return
    text = path.read_text("utf-8")
    for change in re.finditer(r"(?:^[ -].*\n)+(?:^\+.*\n)*", "\n".join(block.lines) + "\n", re.MULTILINE):
        marked = change[0].splitlines(keepends=True)
        old, new = ("".join(line[1:] for line in marked if line[0] in signs) for signs in (" -", " +"))
        assert text.count(old) == 1, f"{block.file} has not one line {old!r}"
        text = text.replace(old, new)
    path.write_text(text, "utf-8", newline="\n")


def skipped(command: str) -> str | None:
    """The entry of `NOT_RUN` that a command belongs to."""
    return next((known for known in NOT_RUN if command == known or command.startswith(f"{known} ")), None)


def follow(text: str) -> Iterator[tuple[Step, str, str, int]]:
    """Does what a page says in the current folder; each command with its terminal, its output and its exit code."""
    shell = Shell()
    for block in blocks(text):
        if block.language == "console":
            for step in steps(block):
                if not skipped(step.command):
                    yield step, *shell.run(step.command), shell.code
        elif block.file:
            put(block)


@contextmanager
def workshop(page: str, folder: Path) -> Iterator[None]:
    """A folder for one page, with the examples in it, as the current one."""
    before = Path.cwd()
    shutil.copytree(ROOT / "examples", folder / "examples")
    os.chdir(folder / BEGINS_IN.get(page, "."))
    try:
        yield
    finally:
        os.chdir(before)


def renewed(shown: list[str], printed: str) -> list[str]:
    """The lines that a page should show in place of those it does: cut where they were cut."""
    lines = printed.splitlines()
    if "..." not in shown:
        return lines
    cut = shown.index("...")
    tail = len(shown) - cut - 1
    return lines[:cut] + ["..."] + (lines[-tail:] if tail else [])


def main() -> None:
    """Renews the outputs of the pages that are named."""
    for page in sys.argv[1:]:
        path = PAGES[page]
        lines = path.read_text("utf-8").splitlines()
        with tempfile.TemporaryDirectory() as folder, workshop(page, Path(folder)):
            found = list(follow("\n".join(lines)))
        for step, terminal, _, code in reversed(found):
            if step.shown:
                lines[step.begin : step.end] = renewed(step.shown, terminal)
            if code:
                sys.stderr.write(f"{page}: exit code {code}: {step.command}\n")
        path.write_text("\n".join(lines) + "\n", "utf-8", newline="\n")


if __name__ == "__main__":
    main()
