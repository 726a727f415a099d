"""Typical mistakes of new users and the whole of what the command says to each; ``generated`` renews the answers.

A group is a file below ``tests/typical``: files, and cases that change or add some and run a command. What all of its
commands print stands beside it, in a text that is read as a user reads it: where it is, what is wrong, which limit
there is, and what to do.
"""

from __future__ import annotations

import os
import re
import shlex
import tempfile
from contextlib import chdir
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ruamel.yaml import YAML

from pidcfg.cli.main import Exit
from pidcfg.vendors import VENDORS
from shell import captured, environment, pidcfg

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

FOLDER = Path(__file__).parent / "typical"
GROUPS = sorted(path.stem for path in FOLDER.glob("*.yaml"))
HEADING = re.compile(r"^=== (.*)$", re.MULTILINE)
NEWLINE = "\n"
PLAIN = {"NO_COLOR": "1", "COLUMNS": "100", "GITHUB_ACTIONS": ""}


@cache
def group(name: str) -> Any:
    """One group's files and cases."""
    return YAML(typ="safe").load((FOLDER / f"{name}.yaml").read_text("utf-8"))


def cases(name: str) -> dict[str, Any]:
    """The cases of a group by their titles."""
    return {title: case or {} for title, case in group(name)["cases"].items()}


def content(file: Any) -> bytes:
    """The bytes of a file: text, text in an encoding, bytes in hexadecimal, or what a command prints."""
    if isinstance(file, str):
        return file.encode()
    if "hex" in file:
        return bytes.fromhex(file["hex"])
    if "made" in file:
        return captured(pidcfg, shlex.split(file["made"]))[2].encode()
    return file["text"].encode(file["encoding"])


def answer(name: str, title: str) -> str:
    """What the commands of a case print, with their endings."""
    whole, case = group(name), cases(name)[title]
    files = {**whole.get("files", {}), **case.get("files", {})}
    said = []
    with tempfile.TemporaryDirectory() as folder, chdir(folder), environment({**PLAIN, **case.get("env", {})}):
        for file, what in files.items():
            Path(file).parent.mkdir(parents=True, exist_ok=True)
            if file.endswith("/"):
                Path(file).mkdir(exist_ok=True)
            else:
                Path(file).write_bytes(content(what))
        changed = case.get("in", whole.get("in", next(iter(files))))
        said += [change(changed, before, after) for before, after in case.get("change", {}).items()]
        commands = case.get("run", whole.get("run"))
        said += [ran(command) for command in ([commands] if isinstance(commands, str) else commands)]
        left = {path.relative_to(folder).as_posix() for path in Path(folder).rglob("*") if path.is_file()}
        said += [f"[wrote {', '.join(sorted(left - {*files}))}]\n"] if left - {*files} else []
    return "".join(said).replace(os.path.realpath(folder), "FOLDER").replace(folder, "FOLDER")


def change(file: str, before: str, after: str) -> str:
    """Changes the one place of a file, and says how."""
    text = Path(file).read_text("utf-8")
    assert text.count(before) == 1, f"{before!r} stands {text.count(before)} times in {file}"
    Path(file).write_text(text.replace(before, after), "utf-8", newline="")
    rows = [*(f"-{row}" for row in before.splitlines()), *(f"+{row}" for row in after.splitlines())]
    return "".join(f"{row}\n" for row in rows)


def ran(command: str) -> str:
    """One command, what it printed, and how it ended."""
    code, both, _ = captured(pidcfg, shlex.split(command))
    assert code != Exit.BUG, both
    return f"$ pidcfg {command}\n{both}[{code}]\n"


def answers(name: str) -> str:
    """The whole text of a group."""
    return "\n".join(f"=== {title}\n{answer(name, title)}" for title in cases(name))


@cache
def committed(name: str) -> dict[str, str]:
    """The answers of a group as they were read and committed, by title."""
    _, *parts = HEADING.split((FOLDER / f"{name}.txt").read_text("utf-8"))
    return {title: f"{body.strip(NEWLINE)}{NEWLINE}" for title, body in zip(parts[::2], parts[1::2], strict=True)}


def subjects(name: str) -> list[str]:
    """A group's name, and the vendors that its files and answers speak of."""
    paths = [FOLDER / f"{name}.yaml", FOLDER / f"{name}.txt"]
    text = "".join(path.read_text("utf-8") for path in paths if path.exists())
    return [name, *(key for key, vendor in VENDORS.items() if re.search(rf"\b(?:{key}|{vendor.prefix}\d)", text))]


def golden_files(wanted: Callable[[str], bool] = bool) -> Mapping[Path, bytes]:
    """The answers of every group by path, or of those that speak of a vendor that is wanted."""
    names = [name for name in GROUPS if any(map(wanted, subjects(name)))]
    return {FOLDER / f"{name}.txt": answers(name).encode() for name in names}
