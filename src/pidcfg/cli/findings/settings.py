"""Settings of `validate` from ``pidcfg.toml`` or ``[tool.pidcfg]`` of a ``pyproject.toml``.

A file can choose what is read and reported and how, and nothing else: it opens no connection, runs nothing, raises no
limit and names no file to write, but for a baseline of the first format, renewed where it is. The command line wins.
"""

from __future__ import annotations

import os
import re
import sys
from dataclasses import field
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from pidcfg.cli.files.identity import EXCLUDED, Exclusion, relative
from pidcfg.cli.findings.settings_keys import EXCLUDE, EXCLUDES, LARGEST, OPTIONS, PER_FILE
from pidcfg.cli.options import only_file
from pidcfg.frozen import frozen
from pidcfg.reader import read_file

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

SETTINGS_FILE, PYPROJECT = "pidcfg.toml", "pyproject.toml"
TABLE = "tool.pidcfg"
REPOSITORY = ".git"
HAS_TABLE = re.compile(rb"tool[\"' \t]*\.[\"' \t]*pidcfg|^[ \t]*\[?[\"' \t]*tool[\"' \t]*[\]=]", re.MULTILINE)
"""What a shared file must hold before it is read as TOML."""
SETTINGS, CONFIG_FILE, IS_ISOLATED = "pidcfg.settings", "pidcfg.config", "pidcfg.isolated"
TOKEN = re.compile(
    rb"""\"{3}(?:[^\\]|\\.)*?\"{3}|'{3}.*?'{3}|"(?:[^"\\\n]|\\.)*"|'[^'\n]*'|\.|[\w-]+|[^\S\n]+|(?P<ends>\#[^\n]*|.)""",
    re.DOTALL,
)
"""A text, a dot, a word, blanks; what ends a key."""
MOST_DOTS = 31
"""In the key of a settings file."""
PARAMETERS = {"format": "fmt"}
"""Keys whose option is kept under another name."""


@frozen
class Settings:
    """What a settings file says; without a file nothing."""

    file: str | None = None
    """As messages name it."""
    root: Path = field(default_factory=Path.cwd)
    """The folder that its paths and patterns begin at."""
    values: dict[str, Any] = field(default_factory=dict)

    @property
    def mention(self) -> str:
        """The end of the summary: settings are never in force unseen."""
        return f"; settings of {self.file}" if self.file else ""

    @property
    def per_file_ignores(self) -> dict[str, list[str]]:
        """Patterns of files, and the beginnings of the codes that are left out in them."""
        patterns: dict[str, list[str]] = self.values.get(PER_FILE, {})
        return patterns

    def ignored_in(self, file: str) -> list[str]:
        """The beginnings of codes that are left out in a file."""
        if not self.per_file_ignores:
            return []
        from pidcfg.globs import matches

        path = relative(file, self.root)
        return [code for pattern, codes in self.per_file_ignores.items() if matches(pattern, path) for code in codes]


def of(ctx: click.Context) -> Settings:
    """The settings of the running command."""
    settings: Settings = ctx.meta[SETTINGS]
    return settings


def take(ctx: click.Context, param: click.Parameter, paths: tuple[str, ...]) -> tuple[str, ...]:
    """Callback of the paths, which come before the options: settings become the options' defaults."""
    del param
    if ctx.resilient_parsing:
        return paths
    config, isolated = ctx.meta.get(CONFIG_FILE), ctx.meta.get(IS_ISOLATED, False)
    if config is not None and isolated:
        raise click.UsageError("--config and --isolated exclude each other", ctx)
    settings = Settings() if isolated or not paths else _settings([place_of(path) for path in paths], config)
    ctx.meta[SETTINGS] = settings
    ctx.meta[EXCLUDED] = Exclusion(settings.root, f"{EXCLUDES}{settings.file}", tuple(settings.values.get(EXCLUDE, ())))
    options = {PARAMETERS.get(k, k): v for k, v in settings.values.items() if k in OPTIONS}
    ctx.default_map = {**(ctx.default_map or {}), **options}
    return paths


def _settings(paths: Sequence[str], config: str | None) -> Settings:
    """The settings of a file that was named, or of the one that all paths have."""
    if config is not None:
        path = Path(config)
        data = _bytes(path, config)
        return _loaded(path, config, data)
    files: dict[Path | None, str] = {}
    starts = {_start(name): name for name in reversed(paths)}
    for folder, name in reversed(starts.items()):
        files.setdefault(_first(_above(folder)), name)
    if len(files) > 1:
        examples = [f"{name}: {_shown(file) if file else 'none'}" for file, name in files.items()]
        raise click.UsageError(
            f"the paths have different settings ({'; '.join(examples[:2])}); choose with --config FILE or --isolated, "
            "or check them one by one"
        )
    (file,) = files
    return Settings() if file is None else _loaded(file, _shown(file), _bytes(file, _shown(file)))


def _first(places: Sequence[Path]) -> Path | None:
    """The first of these files that exists and has a pidcfg table."""
    for path in places:
        if path.is_file():
            data = _bytes(path, _shown(path)) if path.name != SETTINGS_FILE else b""
            if path.name == SETTINGS_FILE or (HAS_TABLE.search(data) and _has_table(_shown(path), data)):
                return path
    return None


def place_of(path: str) -> str:
    """Where the search for settings begins: standard input is where its name is, else in the working directory."""
    from pidcfg.cli.files.inputs import STDIN, UNNAMED, name_of

    name = name_of(path)
    return STDIN if name == UNNAMED else name


def candidates(first: str) -> list[Path]:
    """Where settings may stand: from the folder of the first input upward, to the root of its repository at most."""
    return _above(_start(first))


def _start(name: str) -> Path:
    """The folder of an input; links are not followed."""
    start = Path(os.path.abspath("." if name == "-" else name))  # noqa: PTH100
    return start if start.is_dir() else start.parent


def _above(start: Path) -> list[Path]:
    """Where settings may stand from a folder upward."""
    places = []
    for folder in (start, *start.parents):
        places += [folder / SETTINGS_FILE, folder / PYPROJECT]
        if (folder / REPOSITORY).exists():
            break
    return places


def _shown(path: Path) -> str:
    """A path as messages name it: from the working directory."""
    return relative(str(path), Path.cwd())


def _bytes(path: Path, name: str) -> bytes:
    try:
        data = read_file(path, LARGEST + 1)
    except (OSError, ValueError) as error:
        raise click.ClickException(f"cannot read {name}: {getattr(error, 'strerror', None) or error}") from None
    if len(data) > LARGEST:
        raise click.ClickException(f"{name} is larger than {LARGEST} bytes")
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
def _parsed(name: str, data: bytes) -> dict[str, Any]:
    """The tables of a TOML file; a usage error with line and column where it is none."""
    import tomllib

    _refuse_depth(name, data)
    try:
        return tomllib.loads(data.decode("utf-8-sig"))
    except UnicodeDecodeError:
        raise click.ClickException(f"{name} is not UTF-8; save the file as UTF-8") from None
    except tomllib.TOMLDecodeError as error:
        place = re.search(r" \(at line (\d+), column (\d+)\)$", str(error))
        at = f":{place[1]}:{place[2]}" if place else ""
        text = str(error)[: place.start()] if place else str(error)
        cure = next((cure for words, cure in TOML_CURES if words in text), None)
        raise click.ClickException(f"{name}{at}: not TOML: {text}" + (f"; {cure}" if cure else "")) from None
    except RecursionError:
        raise click.ClickException(f"{name}: not usable as TOML: brackets are nested too deeply") from None
    except ValueError:
        raise click.ClickException(f"{name}{_place_of_digits(data)}: a number of too many digits") from None


def _place_of_digits(data: bytes) -> str:
    """Line and column of the first number that is too long to be read."""
    match = re.search(rb"[0-9_]{%d}" % sys.get_int_max_str_digits(), data)
    before = data[: match.start()].decode("utf-8", "replace").split("\n") if match else None
    return f":{len(before)}:{len(before[-1]) + 1}" if before else ""


def _refuse_depth(name: str, data: bytes) -> None:
    """Ends the command at a key of too many parts: the parser keeps its beginnings, 10 GB for 100 kB of ``a.a.a``."""
    dots = 0
    for token in TOKEN.finditer(data):
        if token[0] == b".":
            dots += 1
        elif token["ends"]:
            dots = 0
        if dots > MOST_DOTS:
            before = data[: token.start()].decode("utf-8", "replace").split("\n")
            message = f"{name}:{len(before)}:{len(before[-1]) + 1}: a key of more than {MOST_DOTS + 1} parts"
            raise click.ClickException(f"{message}; write tables of one or two names, as [tool.pidcfg]")


def _has_table(name: str, data: bytes) -> bool:
    """Whether a shared file has a pidcfg table."""
    tool = _parsed(name, data).get("tool")
    return isinstance(tool, dict) and "pidcfg" in tool


def _loaded(path: Path, name: str, data: bytes) -> Settings:
    """The settings of one file, checked."""
    from pidcfg.cli.findings.settings_file import checked

    table: Any = _parsed(name, data)
    within = ""
    if path.name == PYPROJECT:
        within = TABLE
        tool = table.get("tool")
        table = tool.get("pidcfg", {}) if isinstance(tool, dict) else {}
    root = Path(os.path.abspath(path)).parent  # noqa: PTH100 - links are not followed
    return Settings(name, root, checked(table, name, data.decode("utf-8-sig"), within, root))


def report(ctx: click.Context) -> str:
    """Which file was used, and what holds now."""
    settings = of(ctx)
    lines = [f"settings file: {settings.file or 'none'}"]
    for key in sorted(OPTIONS):
        name = PARAMETERS.get(key, key)
        value = ctx.meta[EXCLUDED].patterns if key == EXCLUDE else ctx.params.get(name)
        source = ctx.get_parameter_source(name)
        variable = next((option.envvar for option in ctx.command.params if option.name == name), None)
        origins = {"COMMANDLINE": "command line", "ENVIRONMENT": variable, "DEFAULT_MAP": settings.file}
        origin = origins.get(source.name if source else "")
        lines.append(f"{key} = {_text(value)}" + (f"  # {origin}" if origin else ""))
    lines += [f"{PER_FILE}.{_text(glob)} = {_text(codes)}" for glob, codes in settings.per_file_ignores.items()]
    return "\n".join(lines) + "\n"


def _text(value: object) -> str:
    import json

    return json.dumps(value, ensure_ascii=False) if value is not None else '""'


def _remember(name: str) -> Callable[[click.Context, click.Parameter, Any], None]:
    """Keeps an option for `take`, which runs after it."""

    def keep(ctx: click.Context, param: click.Parameter, value: Any) -> None:
        del param
        if value:
            ctx.meta[name] = value

    return keep


CONFIG = click.option(
    "--config",
    metavar="FILE",
    is_eager=True,
    expose_value=False,
    callback=_remember(CONFIG_FILE),
    help="Take settings from this file, not from pidcfg.toml or pyproject.toml.",
)
ISOLATED = click.option(
    "--isolated",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_remember(IS_ISOLATED),
    help="Take no settings from files.",
)
SHOW = click.option("--show-settings", is_flag=True, help="Print the settings in force and their file, and stop.")
FIX = click.option("--fix", is_flag=True, help="Correct what has one reading only, and report the rest.")
DIFF = click.option("--diff", is_flag=True, help="Show what --fix would change; write nothing, exit 1 if anything.")
BASELINE = click.option("--baseline", metavar="FILE", callback=only_file, help="Leave out what this file knows.")
CREATE = click.option("--create-baseline", "create", is_flag=True, help="Write the findings there are to --baseline.")
SHRINK = click.option(
    "--shrink-baseline",
    "shrink",
    is_flag=True,
    help="Remove what no longer occurs from --baseline; nothing is ever added.",
)


def baseline_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """The options of known findings."""
    return BASELINE(CREATE(SHRINK(command)))
