"""README.md and the pages of docs/ as a reader follows them.

``python tests/pages.py docs/tutorial.md`` renews the outputs of a page that are no longer true, and adds the exit codes
that it lacks. Read what changed before you commit it: an output is what somebody looked at.

A block of the language ``python`` with ``>>>`` in it is a session of Python; those of a page go on from one to the
next.

A block of the language ``console`` is a session: ``$ `` begins a command, a ``\\`` at its end continues it, and what
follows is what the terminal shows (or standard output alone). A line ``...`` stands for lines that are left out, and a
command that nothing follows is only run; so a block without ``$ `` is nothing but commands. A command that does not end
with 0 needs ``$ echo $?`` after it.

Each page has a folder of its own with ``examples`` in it, and its blocks are followed in order. A block that begins
with a comment that is a file's name, or stands below a line that ends with such a name in backticks and a colon, is
that file; as a ``diff`` its lines take the place of others (``-``), or come behind one (a blank before it).
"""

from __future__ import annotations

import os
import re
import shutil
import sys
import tempfile
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from shell import Shell

if TYPE_CHECKING:
    from collections.abc import Iterator

ROOT = Path(__file__).parents[1]
PAGES = {
    path.relative_to(ROOT).as_posix(): path for path in (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))
}
BEGINS_IN = re.compile(r"commands\s+below\s+run\s+in\s+`([\w/]+)`")
"""How a page says where its commands run; else they begin beside ``examples``."""
BESIDE = ("examples", "tests/data")
"""What a page finds around it."""

NOT_RUN = {
    "pip install": "installs; tests/test_setup.py installs the package",
    "python -m venv": "installs",
    "python tasks.py": "tests/test_setup.py has the tasks",
    "python tests/pages.py": "runs the pages",
    "pidcfg report reactor.scenario.yaml -o reactor.pdf": "needs a browser; the tests of the report print with it",
    "check-jsonschema": "another program; the tests hold the examples to the schemas",
}
"""Commands that a page may show and the tests do not run, and why."""

FENCE = re.compile(r"^(?P<indent> *)(?P<ticks>`{3,})(?P<language>[^` ]*)[^`]*$")
FILE = re.compile(r"^(?:#|//) (?P<name>[\w./-]+\.\w+)$")
ABOVE = re.compile(r"`(?P<name>[\w./-]+\.\w+)`:$")


@dataclass
class Block:
    """A fenced block of a page: its language, the file that it is, its lines, the first one's number, its indent."""

    language: str
    file: str | None
    lines: list[str]
    begin: int
    indent: str


@dataclass
class Step:
    """A command of a session, and the lines that the page shows below it: their numbers in the page, and themselves."""

    command: str
    begin: int
    end: int
    shown: list[str]
    indent: str


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
        yield Block(fence["language"], name_of(body, lines[: begin - 1]), body, begin, indent)


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
        yield Step(command, block.begin + first, block.begin + at, block.lines[first:at], block.indent)


def python_session(text: str) -> str:
    """The blocks of a page that are sessions of Python, at the lines where they stand."""
    lines = [""] * len(text.splitlines())
    for block in blocks(text):
        if block.language == "python" and any(line.startswith(">>> ") for line in block.lines):
            lines[block.begin : block.begin + len(block.lines)] = block.lines
    return "\n".join(lines).rstrip()


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
def workshop(text: str, folder: Path) -> Iterator[None]:
    """A folder for one page, with the examples in it, as the current one."""
    before, begins = Path.cwd(), BEGINS_IN.search(text)
    for name in BESIDE:
        shutil.copytree(ROOT / name, folder / name)
    os.chdir(folder / begins[1] if begins else folder)
    try:
        yield
    finally:
        os.chdir(before)


def unlike(shown: list[str], printed: str) -> str | None:
    """The first line that a page shows and the command does not print, or None."""
    whole = [line.rstrip() for line in printed.rstrip("\n").split("\n")]
    cuts = [list(part) for part in split(shown)]
    for number, part in enumerate(cuts):
        at = 0
        if number == len(cuts) - 1 and number and part:
            at = max(0, len(whole) - len(part))
        elif number:
            at = next((i for i in range(len(whole)) if whole[i : i + len(part)] == part), 0)
        for line, there in zip(part, whole[at:] + [None] * len(part), strict=False):
            if line != there:
                return f"shown {line!r}, printed {there!r}"
        whole = whole[at + len(part) :]
    return f"not shown: {whole[0]!r}" if whole and (len(cuts) == 1 or cuts[-1]) else None


def split(shown: list[str]) -> Iterator[list[str]]:
    """The parts between the lines that say that something is left out."""
    part: list[str] = []
    for line in shown:
        if line.strip() == "...":
            yield part
            part = []
        else:
            part.append(line.rstrip())
    yield part


def renewed(shown: list[str], printed: str) -> list[str]:
    """The lines that a page should show in place of those it does: cut where they were cut."""
    lines = printed.splitlines()
    if "..." not in shown:
        return lines
    cut = shown.index("...")
    tail = len(shown) - cut - 1
    return lines[:cut] + ["..."] + (lines[-tail:] if tail else [])


def renew(text: str) -> str:
    """A page with the outputs of today, and with the exit codes that are not 0."""
    with tempfile.TemporaryDirectory() as folder, workshop(text, Path(folder)):
        found = list(follow(text))
    lines, following = text.splitlines(), ""
    for step, terminal, out, code in reversed(found):
        if code and following != "echo $?":
            lines[step.end : step.end] = [f"{step.indent}$ echo $?", f"{step.indent}{code}"]
        if step.shown and unlike(step.shown, terminal) and unlike(step.shown, out):
            lines[step.begin : step.end] = [step.indent + line for line in renewed(step.shown, terminal)]
        following = step.command
    return "\n".join(lines) + "\n"


def main() -> None:
    """Renews the pages that are named."""
    for page in sys.argv[1:]:
        PAGES[page].write_text(renew(PAGES[page].read_text("utf-8")), "utf-8", newline="\n")


if __name__ == "__main__":
    main()
