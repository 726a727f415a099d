"""Settings of `validate` from ``pidcfg.toml`` or ``pyproject.toml``: keys, types, complaints with their places."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Callable, Sequence
from dataclasses import field
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

import click

from pidcfg.cli.formats import formats_of
from pidcfg.cli.inputs import EXCLUSION_KEY, Exclusion, relative_path
from pidcfg.cli.options import refuse_dash
from pidcfg.text.frozen import frozen
from pidcfg.text.paths import PARENT, Data
from pidcfg.text.reader import read_file
from pidcfg.text.signs import closest_name

# --- The keys of a settings file, and the JSON Schema for editors that is generated from them -------------------------

PER_FILE_KEY, EXCLUDE_KEY = "per-file-ignores", "exclude"
EXCLUDE_REASON = f"{EXCLUDE_KEY} of "
"""How the reason begins why a settings file leaves an entry out of a folder."""
MAX_FILE_SIZE = 1 << 18
"""Bytes of a settings file; a byte of TOML takes up to 600 of memory."""
MAX_PATTERNS = 200
"""Patterns of ``exclude``."""


class Key(NamedTuple):
    """One key: its kind, what it does, and an example."""

    kind: str
    text: str
    example: str


# fmt: off
SETTINGS_KEYS = {
    "select": Key("codes", "Only rules whose code begins so.", '["DL2", "PID101"]'),
    "ignore": Key("codes", "Rules whose code begins so are left out.", '["DL220"]'),
    "severity": Key("severity", "Findings of this severity and above are shown.", '"warning"'),
    "strict": Key("switch", "Exit 1 on warnings too.", "true"),
    "format": Key("format", "How the result is printed.", '"text"'),
    "baseline": Key("path", "A file of known findings, below the folder of the settings file.", '"known.json"'),
    EXCLUDE_KEY: Key(
        "patterns", "What is left out of folders: lines of .gitignore, from the folder of the settings file.",
        '["archive/", "*.bak.yaml"]',
    ),
    PER_FILE_KEY: Key(
        "table", "Patterns of paths below the folder of the settings file, and the rules left out there.",
        '{"old/**" = ["DL222"]}',
    ),
}
"""All there is."""
REFUSED_KEYS = {
    "tool": "in pidcfg.toml the keys stand at the top, without [tool.pidcfg]",
    "limit": "limits on untrusted input are raised on the command line only (--limit)",
    "limits": "limits on untrusted input are raised on the command line only (--limit)",
    "output": "files to write are named on the command line only (--report-output)",
    "fix": "files are changed only when the command line says so (--fix)",
}
"""Keys that users may expect, and why they do not exist."""
# fmt: on
SEVERITIES = ("error", "warning", "info")
KEY_ALIASES = {key.replace("-", "_"): key for key in SETTINGS_KEYS}
OPTION_KEYS = frozenset(SETTINGS_KEYS) - {PER_FILE_KEY}
"""Keys that are options of the command too."""


def settings_schema() -> Data:
    """The JSON Schema of ``pidcfg.toml``, for editors."""
    from pidcfg.schemas.document import DIALECT
    from pidcfg.schemas.numbers import text_schema

    codes = {"type": "array", "items": text_schema("[A-Za-z]{1,3}[0-9]{0,3}", "PID101", "DL2")}
    kinds: dict[str, Data] = {
        "codes": codes,
        "switch": {"type": "boolean"},
        "severity": {"enum": list(SEVERITIES)},
        "format": {"enum": list(formats_of("validate"))},
        "path": {"type": "string", "minLength": 1},
        "patterns": {"type": "array", "items": {"type": "string", "minLength": 1}, "maxItems": MAX_PATTERNS},
        "table": {"type": "object", "additionalProperties": codes},
    }
    properties = {key: {**kinds[row.kind], "description": row.text} for key, row in SETTINGS_KEYS.items()}
    return {
        "$schema": DIALECT,
        "type": "object",
        "properties": properties,
        "additionalProperties": False,
        "title": "pidcfg settings",
    }


# --- The check of a settings file: keys, types and codes, and the complaint with line and column ----------------------

MAX_VALUE_LENGTH = 60
"""Characters of a value."""


class _SettingsFile(NamedTuple):
    """A settings file as complaints need it."""

    name: str
    text: str
    table: str
    root: Path

    def refuse(self, key: str, message: str, cure: str | None = None, value: str | None = None) -> NoReturn:
        """Ends the command with one error at a key, or at a text below it."""
        line, column = locate_key(self.text, self.table, key, value)
        location = f":{line}:{column}" if line else ""
        raise click.ClickException(f"{self.name}{location}: {message}" + (f"; {cure}" if cure else ""))


def check_table(table: object, name: str, text: str, table_name: str, root: Path) -> Data:
    """The settings of a table, as option values."""
    file = _SettingsFile(name, text, table_name, root)
    if not isinstance(table, dict):
        file.refuse(table_name.rpartition(".")[2], f"[{table_name}] must be a table")
    return {key: _check_value(key, value, file) for key, value in table.items()}


def _check_value(key: str, value: object, file: _SettingsFile) -> object:
    row = SETTINGS_KEYS.get(key)
    if row is None:
        near = KEY_ALIASES.get(key) or closest_name(key, SETTINGS_KEYS)
        cure = f"did you mean {near}?" if near else f"known keys: {', '.join(SETTINGS_KEYS)}"
        file.refuse(key, f"unknown key {key!r}", REFUSED_KEYS.get(key, cure))
    return CHECK_BY_KIND[row.kind](key, value, file)


def _check_codes(key: str, value: object, file: _SettingsFile) -> list[str]:
    """Codes or their beginnings."""
    from pidcfg.validate import list_texts
    from pidcfg.validate.catalog import suggest_code

    if not isinstance(value, list) or not all(isinstance(code, str) for code in value):
        file.refuse(key, f"{key} must be a list of codes", f"write {key} = {SETTINGS_KEYS['select'].example}")
    codes = list(dict.fromkeys(value))
    for code in codes:
        if not code.strip() or not list_texts(code.upper()):
            file.refuse(key, f"no rule begins with {code!r}", suggest_code(code), code)
    return [code.upper() for code in codes]


def _shorten(value: object) -> str:
    """A value as a complaint has it, shortened."""
    try:
        text = repr(value)
    except ValueError:
        return "a number of too many digits"
    return text if len(text) <= MAX_VALUE_LENGTH else f"{text[:MAX_VALUE_LENGTH]}…"


def _check_switch(key: str, value: object, file: _SettingsFile) -> bool:
    if not isinstance(value, bool):
        file.refuse(key, f"{key} must be true or false, not {_shorten(value)}", f"write {key} = true, without quotes")
    return value


def _choice_check(words: tuple[str, ...]) -> Callable[[str, object, _SettingsFile], str]:
    def choice(key: str, value: object, file: _SettingsFile) -> str:
        if not isinstance(value, str) or value not in words:
            near = closest_name(value, words) if isinstance(value, str) else None
            cure = f"did you mean {near}?" if near else None
            file.refuse(key, f"{key} is {_shorten(value)}, not one of {', '.join(words)}", cure)
        return value

    return choice


def _check_path(key: str, value: object, file: _SettingsFile) -> str:
    """A path that stays below the folder of the settings file, links included."""
    if not isinstance(value, str) or not value:
        file.refuse(key, f"{key} must be the path of a file, not {_shorten(value)}")
    try:
        target, root = (file.root / value).resolve(), file.root.resolve()
    except (OSError, ValueError, RuntimeError):
        file.refuse(key, f"{key}: {value!r} is no path")
    if Path(value).is_absolute() or root not in target.parents:
        file.refuse(key, f"{key}: {value!r} leads out of the folder of the settings file", "name it with --baseline")
    return relative_path(str(file.root / value), Path())


def _check_patterns(key: str, value: object, file: _SettingsFile) -> list[str]:
    """Lines of ``.gitignore``."""
    from pidcfg.cli.inputs import pattern_fault

    if not isinstance(value, list) or not all(isinstance(line, str) for line in value):
        file.refuse(key, f"{key} must be a list of patterns", f"write {key} = {SETTINGS_KEYS[key].example}")
    if len(value) > MAX_PATTERNS:
        file.refuse(key, f"{key} has more than {MAX_PATTERNS} patterns", "name their folder")
    for line in value:
        if fault := pattern_fault(line):
            file.refuse(key, fault, value=line)
    return value


def _check_per_file(key: str, value: object, file: _SettingsFile) -> dict[str, list[str]]:
    """A table of patterns."""
    if not isinstance(value, dict):
        file.refuse(key, f"{key} must be a table of patterns", f"write {key} = {SETTINGS_KEYS[key].example}")
    for glob in value:
        if not glob.strip("/") or "\\" in glob:
            file.refuse(key, f"{glob!r} is no pattern of paths", "write it with forward slashes", glob)
        if PARENT in glob.split("/"):
            file.refuse(
                key,
                f"{glob!r} leads out of the folder of the settings file, and fits nothing there",
                "put a settings file into the folder above",
                glob,
            )
    return {glob: _check_codes(glob, codes, file) for glob, codes in value.items()}


CHECK_BY_KIND: dict[str, Callable[[str, object, _SettingsFile], object]] = {
    "codes": _check_codes,
    "switch": _check_switch,
    "severity": _choice_check(SEVERITIES),
    "format": _choice_check(formats_of("validate")),
    "path": _check_path,
    "patterns": _check_patterns,
    "table": _check_per_file,
}


COMMENT_PATTERN = re.compile(r"""(\"(?:\\.|[^"\\\n])*"|'[^'\n]*')|#[^\n]*""")
"""A quoted text on one line, in which # begins nothing, or a comment."""


def locate_key(text: str, table: str, key: str, value: str | None = None) -> tuple[int, int]:
    """Line and column (1-based) of a key of a table, or of a text behind it; 0 where it does not occur."""
    text = COMMENT_PATTERN.sub(lambda found: found[1] or " " * len(found[0]), text)
    begin = re.search(rf"^[ \t]*\[[ \t]*{re.escape(table)}\b", text, re.MULTILINE) if table else None
    start = begin.start() if begin else 0
    key_pattern = rf"(?:\"{re.escape(key)}\"|'{re.escape(key)}'|(?<![\w-]){re.escape(key)})"
    match = re.compile(rf"{key_pattern}(?=[ \t]*[=.\]])").search(text, start)
    if match is None:
        return 0, 0
    offset = match.start()
    if value is not None:
        offset = max(offset, text.find(value, match.end()))
    lines = text[:offset].split("\n")
    return len(lines), len(lines[-1]) + 1


# --- Settings of `validate` from ``pidcfg.toml`` or ``[tool.pidcfg]`` of a ``pyproject.toml`` -------------------------
#
# A file can choose what is read and reported and how, and nothing else: it opens no connection, runs nothing, raises
# no limit and names no file to write, but for a baseline of the first format, renewed where it is. The command line
# wins.

SETTINGS_FILE, PYPROJECT = "pidcfg.toml", "pyproject.toml"
TABLE_NAME = "tool.pidcfg"
REPOSITORY = ".git"
TABLE_PATTERN = re.compile(rb"tool[\"' \t]*\.[\"' \t]*pidcfg|^[ \t]*\[?[\"' \t]*tool[\"' \t]*[\]=]", re.MULTILINE)
"""What a shared file must hold before it is read as TOML."""
SETTINGS_META, CONFIG_FILE_META, ISOLATED_META = "pidcfg.settings", "pidcfg.config", "pidcfg.isolated"
TOML_TOKEN = re.compile(
    rb"""\"{3}(?:[^\\]|\\.)*?\"{3}|'{3}.*?'{3}|"(?:[^"\\\n]|\\.)*"|'[^'\n]*'|\.|[\w-]+|[^\S\n]+|(?P<ends>\#[^\n]*|.)""",
    re.DOTALL,
)
"""A text, a dot, a word, blanks; what ends a key."""
MAX_KEY_DOTS = 31
"""In the key of a settings file."""
PARAMETER_BY_KEY = {"format": "fmt"}
"""Keys whose option is kept under another name."""


@frozen
class Settings:
    """What a settings file says; without a file nothing."""

    file: str | None = None
    """As messages name it."""
    root: Path = field(default_factory=Path.cwd)
    """The folder that its paths and patterns begin at."""
    values: Data = field(default_factory=dict)

    @property
    def mention(self) -> str:
        """The end of the summary: settings are never in force unseen."""
        return f"; settings of {self.file}" if self.file else ""

    @property
    def per_file_ignores(self) -> dict[str, list[str]]:
        """Patterns of files, and the beginnings of the codes that are left out in them."""
        patterns: dict[str, list[str]] = self.values.get(PER_FILE_KEY, {})
        return patterns

    def ignored_codes(self, file: str) -> list[str]:
        """The beginnings of codes that are left out in a file."""
        if not self.per_file_ignores:
            return []
        from pidcfg.text.paths import matches

        path = relative_path(file, self.root)
        return [code for pattern, codes in self.per_file_ignores.items() if matches(pattern, path) for code in codes]


def current_settings(ctx: click.Context) -> Settings:
    """The settings of the running command."""
    settings: Settings = ctx.meta[SETTINGS_META]
    return settings


def apply_settings(ctx: click.Context, param: click.Parameter, paths: tuple[str, ...]) -> tuple[str, ...]:
    """Callback of the paths, which come before the options: settings become the options' defaults."""
    del param
    if ctx.resilient_parsing:
        return paths
    config, isolated = ctx.meta.get(CONFIG_FILE_META), ctx.meta.get(ISOLATED_META, False)
    if config is not None and isolated:
        raise click.UsageError("--config and --isolated exclude each other", ctx)
    settings = Settings() if isolated or not paths else settings_of([search_start(path) for path in paths], config)
    ctx.meta[SETTINGS_META] = settings
    ctx.meta[EXCLUSION_KEY] = Exclusion(
        settings.root, f"{EXCLUDE_REASON}{settings.file}", tuple(settings.values.get(EXCLUDE_KEY, ()))
    )
    options = {PARAMETER_BY_KEY.get(k, k): v for k, v in settings.values.items() if k in OPTION_KEYS}
    ctx.default_map = {**(ctx.default_map or {}), **options}
    return paths


def settings_of(paths: Sequence[str], config: str | None) -> Settings:
    """The settings of a file that was named, or of the one that all paths have."""
    if config is not None:
        path = Path(config)
        data = _read_settings_file(path, config)
        return _load_settings(path, config, data)
    files: dict[Path | None, str] = {}
    starts = {_start_folder(name): name for name in reversed(paths)}
    for folder, name in reversed(starts.items()):
        files.setdefault(_find_settings_file(_candidates_from(folder)), name)
    if len(files) > 1:
        examples = [f"{name}: {_label(file) if file else 'none'}" for file, name in files.items()]
        raise click.UsageError(
            f"the paths have different settings ({'; '.join(examples[:2])}); choose with --config FILE or --isolated, "
            "or check them one by one"
        )
    (file,) = files
    return Settings() if file is None else _load_settings(file, _label(file), _read_settings_file(file, _label(file)))


def _find_settings_file(candidates: Sequence[Path]) -> Path | None:
    """The first of these files that exists and has a pidcfg table."""
    for path in candidates:
        if path.is_file():
            data = _read_settings_file(path, _label(path)) if path.name != SETTINGS_FILE else b""
            if path.name == SETTINGS_FILE or (TABLE_PATTERN.search(data) and _has_table(_label(path), data)):
                return path
    return None


def search_start(path: str) -> str:
    """Where the search for settings begins: standard input is where its name is, else in the working directory."""
    from pidcfg.cli.inputs import STDIN, STDIN_TITLE, name_of

    name = name_of(path)
    return STDIN if name == STDIN_TITLE else name


def settings_candidates(first: str) -> list[Path]:
    """Where settings may stand: from the folder of the first input upward, to the root of its repository at most."""
    return _candidates_from(_start_folder(first))


def _start_folder(name: str) -> Path:
    """The folder of an input; links are not followed."""
    start = Path(os.path.abspath("." if name == "-" else name))
    return start if start.is_dir() else start.parent


def _candidates_from(start: Path) -> list[Path]:
    """Where settings may stand from a folder upward."""
    candidates = []
    for folder in (start, *start.parents):
        candidates += [folder / SETTINGS_FILE, folder / PYPROJECT]
        if (folder / REPOSITORY).exists():
            break
    return candidates


def _label(path: Path) -> str:
    """A path as messages name it: from the working directory."""
    return relative_path(str(path), Path.cwd())


def _read_settings_file(path: Path, name: str) -> bytes:
    try:
        data = read_file(path, MAX_FILE_SIZE + 1)
    except (OSError, ValueError) as error:
        raise click.ClickException(f"cannot read {name}: {getattr(error, 'strerror', None) or error}") from None
    if len(data) > MAX_FILE_SIZE:
        raise click.ClickException(f"{name} is larger than {MAX_FILE_SIZE} bytes")
    return data


TOML_CURES = (
    ("Expected '='", "write key = value"),
    ("Invalid value", "words stand in quotes, and a switch is true or false"),
    ("Cannot overwrite", "the key stands twice: keep one"),
    ("Unclosed array", "close it with ]"),
    ("Invalid hex value", "write paths with / or between single quotes"),
    ("Unescaped '\\' in a string", "write paths with / or between single quotes"),
)
"""What the parser says, and what helps."""


@lru_cache(maxsize=1)
def _parse_toml(name: str, data: bytes) -> Data:
    """The tables of a TOML file; a usage error with line and column where it is none."""
    import tomllib

    _refuse_depth(name, data)
    try:
        return tomllib.loads(data.decode("utf-8-sig"))
    except UnicodeDecodeError:
        raise click.ClickException(f"{name} is not UTF-8; save the file as UTF-8") from None
    except tomllib.TOMLDecodeError as error:
        position = re.search(r" \(at line (\d+), column (\d+)\)$", str(error))
        location = f":{position[1]}:{position[2]}" if position else ""
        text = str(error)[: position.start()] if position else str(error)
        cure = next((cure for words, cure in TOML_CURES if words in text), None)
        raise click.ClickException(f"{name}{location}: not TOML: {text}" + (f"; {cure}" if cure else "")) from None
    except RecursionError:
        raise click.ClickException(f"{name}: not usable as TOML: brackets are nested too deeply") from None
    except ValueError:
        raise click.ClickException(f"{name}{_locate_long_number(data)}: a number of too many digits") from None


def _locate_long_number(data: bytes) -> str:
    """Line and column of the first number that is too long to be read."""
    match = re.search(rb"[0-9_]{%d}" % sys.get_int_max_str_digits(), data)
    lines = data[: match.start()].decode("utf-8", "replace").split("\n") if match else None
    return f":{len(lines)}:{len(lines[-1]) + 1}" if lines else ""


def _refuse_depth(name: str, data: bytes) -> None:
    """Ends the command at a key of too many parts: the parser keeps its beginnings, 10 GB for 100 kB of ``a.a.a``."""
    dots = 0
    for token in TOML_TOKEN.finditer(data):
        if token[0] == b".":
            dots += 1
        elif token["ends"]:
            dots = 0
        if dots > MAX_KEY_DOTS:
            lines = data[: token.start()].decode("utf-8", "replace").split("\n")
            message = f"{name}:{len(lines)}:{len(lines[-1]) + 1}: a key of more than {MAX_KEY_DOTS + 1} parts"
            raise click.ClickException(f"{message}; write tables of one or two names, as [tool.pidcfg]")


def _has_table(name: str, data: bytes) -> bool:
    """Whether a shared file has a pidcfg table."""
    tool = _parse_toml(name, data).get("tool")
    return isinstance(tool, dict) and "pidcfg" in tool


def _load_settings(path: Path, name: str, data: bytes) -> Settings:
    """The settings of one file, checked."""
    table: Any = _parse_toml(name, data)
    table_name = ""
    if path.name == PYPROJECT:
        table_name = TABLE_NAME
        tool = table.get("tool")
        table = tool.get("pidcfg", {}) if isinstance(tool, dict) else {}
    root = Path(os.path.abspath(path)).parent
    return Settings(name, root, check_table(table, name, data.decode("utf-8-sig"), table_name, root))


def describe_settings(ctx: click.Context) -> str:
    """Which file was used, and what holds now."""
    settings = current_settings(ctx)
    lines = [f"settings file: {settings.file or 'none'}"]
    for key in sorted(OPTION_KEYS):
        name = PARAMETER_BY_KEY.get(key, key)
        value = ctx.meta[EXCLUSION_KEY].patterns if key == EXCLUDE_KEY else ctx.params.get(name)
        source = ctx.get_parameter_source(name)
        variable = next((option.envvar for option in ctx.command.params if option.name == name), None)
        origins = {"COMMANDLINE": "command line", "ENVIRONMENT": variable, "DEFAULT_MAP": settings.file}
        origin = origins.get(source.name if source else "")
        lines.append(f"{key} = {_to_toml(value)}" + (f"  # {origin}" if origin else ""))
    lines += [
        f"{PER_FILE_KEY}.{_to_toml(glob)} = {_to_toml(codes)}" for glob, codes in settings.per_file_ignores.items()
    ]
    return "\n".join(lines) + "\n"


def _to_toml(value: object) -> str:
    import json

    return json.dumps(value, ensure_ascii=False) if value is not None else '""'


def _keep_option(name: str) -> Callable[[click.Context, click.Parameter, object], None]:
    """Keeps an option for `apply_settings`, which runs after it."""

    def keep(ctx: click.Context, param: click.Parameter, value: object) -> None:
        del param
        if value:
            ctx.meta[name] = value

    return keep


CONFIG_OPTION = click.option(
    "--config",
    metavar="FILE",
    is_eager=True,
    expose_value=False,
    callback=_keep_option(CONFIG_FILE_META),
    help="Take settings from this file, not from pidcfg.toml or pyproject.toml.",
)
ISOLATED_OPTION = click.option(
    "--isolated",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_keep_option(ISOLATED_META),
    help="Take no settings from files.",
)
SHOW_OPTION = click.option(
    "--show-settings", is_flag=True, help="Print the settings in force and their file, and stop."
)
FIX_OPTION = click.option("--fix", is_flag=True, help="Correct what has one reading only, and report the rest.")
DIFF_OPTION = click.option(
    "--diff", is_flag=True, help="Show what --fix would change; write nothing, exit 1 if anything."
)
BASELINE_OPTION = click.option(
    "--baseline", metavar="FILE", callback=refuse_dash, help="Leave out what this file knows."
)
CREATE_OPTION = click.option(
    "--create-baseline", "create", is_flag=True, help="Write the findings there are to --baseline."
)
SHRINK_OPTION = click.option(
    "--shrink-baseline",
    "shrink",
    is_flag=True,
    help="Remove what no longer occurs from --baseline; nothing is ever added.",
)


def baseline_options(command: Callable[..., object]) -> Callable[..., object]:
    """The options of known findings."""
    return BASELINE_OPTION(CREATE_OPTION(SHRINK_OPTION(command)))
