"""The check of a settings file: keys, types and codes, and the complaint with line and column."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, NoReturn

import click

from pidcfg.cli.files.identity import relative
from pidcfg.cli.findings.settings_keys import ALIASES, KEYS, LARGEST, MOST, REFUSED, SEVERITIES
from pidcfg.cli.formats import formats_of
from pidcfg.globs import UP
from pidcfg.schemas.names import nearest

if TYPE_CHECKING:
    from collections.abc import Callable

SHOWN = 60
"""Characters of a value."""


class _File(NamedTuple):
    """A settings file as complaints need it."""

    name: str
    text: str
    table: str
    root: Path

    def refuse(self, key: str, message: str, cure: str | None = None, value: str | None = None) -> NoReturn:
        """Ends the command with one error at a key, or at a text below it."""
        line, column = locate(self.text, self.table, key, value)
        place = f":{line}:{column}" if line else ""
        raise click.ClickException(f"{self.name}{place}: {message}" + (f"; {cure}" if cure else ""))


def checked(table: Any, name: str, text: str, within: str, root: Path) -> dict[str, Any]:
    """The settings of a table, as option values."""
    file = _File(name, text, within, root)
    if not isinstance(table, dict):
        file.refuse(within.rpartition(".")[2], f"[{within}] must be a table")
    return {key: _value(key, value, file) for key, value in table.items()}


def _value(key: str, value: Any, file: _File) -> Any:
    row = KEYS.get(key)
    if row is None:
        near = ALIASES.get(key) or nearest(key, KEYS)
        cure = f"did you mean {near}?" if near else f"known keys: {', '.join(KEYS)}"
        file.refuse(key, f"unknown key {key!r}", REFUSED.get(key, cure))
    return CHECKS[row.kind](key, value, file)


def _codes(key: str, value: Any, file: _File) -> list[str]:
    """Codes or their beginnings."""
    from pidcfg.cli.findings.former_codes import current_code
    from pidcfg.validate.catalog import current, rules, suggestion

    if not isinstance(value, list) or not all(isinstance(code, str) for code in value):
        file.refuse(key, f"{key} must be a list of codes", f"write {key} = {KEYS['select'].example}")
    codes = list(dict.fromkeys(value))
    for code in codes:
        if not code.strip() or not rules(current(code.upper())):
            file.refuse(key, f"no rule begins with {code!r}", suggestion(code), code)
    return [current_code(code.upper()) for code in codes]


def _quoted(value: object) -> str:
    """A value as a complaint has it, shortened."""
    try:
        text = repr(value)
    except ValueError:
        return "a number of too many digits"
    return text if len(text) <= SHOWN else f"{text[:SHOWN]}…"


def _switch(key: str, value: Any, file: _File) -> bool:
    if not isinstance(value, bool):
        file.refuse(key, f"{key} must be true or false, not {_quoted(value)}", f"write {key} = true, without quotes")
    return value


def _choice(words: tuple[str, ...]) -> Callable[[str, Any, _File], str]:
    def choice(key: str, value: Any, file: _File) -> str:
        if not isinstance(value, str) or value not in words:
            near = nearest(value, words) if isinstance(value, str) else None
            cure = f"did you mean {near}?" if near else None
            file.refuse(key, f"{key} is {_quoted(value)}, not one of {', '.join(words)}", cure)
        return value

    return choice


def _path(key: str, value: Any, file: _File) -> str:
    """A path that stays below the folder of the settings file, links included."""
    if not isinstance(value, str) or not value or len(value) > LARGEST:
        file.refuse(key, f"{key} must be the path of a file, not {_quoted(value)}")
    try:
        target, root = (file.root / value).resolve(), file.root.resolve()
    except (OSError, ValueError, RuntimeError):
        file.refuse(key, f"{key}: {value!r} is no path")
    if Path(value).is_absolute() or root not in target.parents:
        file.refuse(key, f"{key}: {value!r} leads out of the folder of the settings file", "name it with --baseline")
    return relative(str(file.root / value), Path())


def _patterns(key: str, value: Any, file: _File) -> list[str]:
    """Lines of ``.gitignore``."""
    from pidcfg.cli.files.patterns import fault

    if not isinstance(value, list) or not all(isinstance(line, str) for line in value):
        file.refuse(key, f"{key} must be a list of patterns", f"write {key} = {KEYS[key].example}")
    if len(value) > MOST:
        file.refuse(key, f"{key} has more than {MOST} patterns", "name their folder")
    for line in value:
        if wrong := fault(line):
            file.refuse(key, wrong, value=line)
    return value


def _per_file(key: str, value: Any, file: _File) -> dict[str, list[str]]:
    """A table of patterns."""
    if not isinstance(value, dict):
        file.refuse(key, f"{key} must be a table of patterns", f"write {key} = {KEYS[key].example}")
    for glob in value:
        if not glob.strip("/") or "\\" in glob:
            file.refuse(key, f"{glob!r} is no pattern of paths", "write it with forward slashes", glob)
        if UP in glob.split("/"):
            file.refuse(
                key,
                f"{glob!r} leads out of the folder of the settings file, and fits nothing there",
                "put a settings file into the folder above",
                glob,
            )
    return {glob: _codes(glob, codes, file) for glob, codes in value.items()}


CHECKS: dict[str, Callable[[str, Any, _File], Any]] = {
    "codes": _codes,
    "switch": _switch,
    "severity": _choice(SEVERITIES),
    "format": _choice(formats_of("validate")),
    "path": _path,
    "patterns": _patterns,
    "table": _per_file,
}


def locate(text: str, table: str, key: str, value: str | None = None) -> tuple[int, int]:
    """Line and column (1-based) of a key of a table, or of a text behind it; 0 where it does not occur."""
    begin = re.search(rf"^[ \t]*\[[ \t]*{re.escape(table)}\b", text, re.MULTILINE) if table else None
    start = begin.start() if begin else 0
    quoted = rf"(?:\"{re.escape(key)}\"|'{re.escape(key)}'|(?<![\w-]){re.escape(key)})"
    match = re.compile(rf"{quoted}(?=[ \t]*[=.\]])").search(text, start)
    if match is None:
        return 0, 0
    at = match.start()
    if value is not None:
        at = max(at, text.find(value, match.end()))
    before = text[:at].split("\n")
    return len(before), len(before[-1]) + 1
