"""Shell completion of the word that is being typed: how each shell asks, and what there is."""

from __future__ import annotations

import os
import re
import shlex
from copy import copy
from dataclasses import fields
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING

import click
from click.shell_completion import CompletionItem, ShellComplete, add_completion_class

from pidcfg.cli.commands.completion import completion_script
from pidcfg.cli.terminal import encodable
from pidcfg.text.reader import DEFAULT, SUFFIXES, Limits, read_file
from pidcfg.vendors import VENDORS, format_names

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from pidcfg.vendors import Vendor

    Items = list[CompletionItem[str]]
    Source = Callable[[click.Context, str], Items]

# --- How each shell hands over the line that is typed, and how it wants the candidates back ---------------------------

END_OF_LINE = "\x01"
"""Put at the end of the line, so that the last word is the one that is typed, even when it is empty."""
ASSIGNMENT = re.compile(r"\w+=")
UNQUOTED_WORD = re.compile(r"[\w./\\:=,+~-]+")
SINGLE_QUOTES = re.compile("['\u2018-\u201b]")
"""What ends a text in single quotes for PowerShell, unless it stands twice: typographic ones do as well."""


class Shell(ShellComplete):
    """What the shells have in common: the line up to the cursor in ``COMP_WORDS``, and silence when all goes wrong."""

    word_breaks = "="
    """Characters after which the shell begins a new word of its own."""
    escape = "\\"
    word_head = ""
    """What stands before the shell's own word in the word that is typed."""

    def source(self) -> str:
        """The script that `pidcfg completion` prints."""
        return completion_script(self.name)

    def complete(self) -> str:
        """The candidates; a shell that waits for them has no use for a traceback."""
        try:
            return super().complete()
        except Exception:  # noqa: BLE001 - whatever happens, the user is typing
            return ""

    def get_completion_args(self) -> tuple[list[str], str]:
        """The words before the one that is typed, and that one."""
        words = split_line(os.environ.get("COMP_WORDS", "") + END_OF_LINE, self.escape)
        while len(words) > 1 and ASSIGNMENT.match(words[0]):
            del words[0]
        last_word = words[-1].removesuffix(END_OF_LINE)
        match = re.match(rf".*[{self.word_breaks}]", last_word)
        self.word_head = match.group() if match else ""
        return words[1:-1], last_word

    def get_completions(self, args: list[str], incomplete: str) -> list[CompletionItem[str]]:
        """The candidates, with those that only pidcfg knows."""
        self.ctx_args = {**self.ctx_args, "obj": list(args)}
        return super().get_completions(args, incomplete)

    def inserted_part(self, item: CompletionItem[object]) -> str:
        """The part of a value that the shell inserts after what stands there."""
        return str(item.value).removeprefix(self.word_head)

    def whole_word(self, item: CompletionItem[object]) -> str:
        """The value as the shell's whole word."""
        value = str(item.value)
        return value if value.startswith(self.word_head) else self.word_head + value


class Bash(Shell):
    """bash has no room for a help, and words of its own after ``=`` and ``:``."""

    name = "bash"
    word_breaks = "=:"

    def format_completion(self, item: CompletionItem[object]) -> str:
        """The kind and the value."""
        return f"{item.type},{self.inserted_part(item)}"


class Zsh(Shell):
    """zsh wants the whole word, and takes a colon for the beginning of the help."""

    name = "zsh"

    def format_completion(self, item: CompletionItem[object]) -> str:
        """Three lines; a colon is escaped where a help follows."""
        value = self.whole_word(item)
        if item.help and item.type == "plain":
            value = value.replace(":", r"\:")
        return f"{item.type}\n{value}\n{one_line(item.help)}"


class Fish(Shell):
    """fish wants the whole word, and the help behind a tab."""

    name = "fish"

    def format_completion(self, item: CompletionItem[object]) -> str:
        """The kind, the value and the help."""
        return f"{item.type},{self.whole_word(item)}" + (f"\t{one_line(item.help)}" if item.help else "")


class PowerShell(Shell):
    """PowerShell escapes nothing with a backslash, wants the whole word, and may read any code page."""

    name = "powershell"
    escape = ""

    def format_completion(self, item: CompletionItem[object]) -> str:
        """Three lines; a value with spaces is quoted."""
        value = self.whole_word(item)
        if not UNQUOTED_WORD.fullmatch(value):
            value = f"'{SINGLE_QUOTES.sub(lambda quote: 2 * quote.group(), value)}'"
        return f"{item.type}\n{value}\n{encodable(one_line(item.help), 'ascii')}"


def split_line(line: str, escape: str) -> list[str]:
    """The words of a line in which a quote may still be open."""
    lexer = shlex.shlex(line, posix=True)
    lexer.whitespace_split, lexer.commenters, lexer.escape = True, "", escape
    words: list[str] = []
    try:
        words.extend(lexer)
    except ValueError:
        words.append(lexer.token)
    return words


def one_line(text: str | None) -> str:
    """A help as the scripts expect it: one line, or ``_`` for none."""
    return " ".join((text or "_").split())


SHELLS: Sequence[type[Shell]] = (Bash, Zsh, Fish, PowerShell)


def register_shells() -> None:
    """Tells click of them."""
    for shell in SHELLS:
        add_completion_class(shell)


# --- What completes a word that is typed: files by what they hold, rule codes with their titles -----------------------
#
# Rows name the parameter that they are for; a command needs to know nothing of it. Nothing here complains: a file
# that cannot be read says nothing.

SCENARIO_KEY = re.compile(rb"^(?:\xef\xbb\xbf)?scenario\s*:", re.MULTILINE)
HEAD_BYTES = 65_536
"""Bytes of a file in which its kind is looked for."""
SPECIAL_SIGNS = ("-", "~")
"""How names of files begin that commands take for options, and shells for homes."""
MAX_OPENED_FILES = 500
"""Files of a folder that are opened to see what they hold; after so many every one is offered."""


# --- files -----------------------------------------------------------------------------------------------------------


def any_file(ctx: click.Context, incomplete: str) -> Items:
    """Every file."""
    del ctx
    return _file_items(incomplete, lambda _: True)


def yaml_file(ctx: click.Context, incomplete: str) -> Items:
    """YAML files."""
    del ctx
    return _file_items(incomplete, is_yaml)


def scenario_file(ctx: click.Context, incomplete: str) -> Items:
    """YAML files that are scenarios."""
    del ctx
    return _file_items(incomplete, is_scenario)


def configuration_file(ctx: click.Context, incomplete: str) -> Items:
    """YAML files that are no scenarios."""
    del ctx
    return _file_items(incomplete, lambda path: is_yaml(path) and not is_scenario(path))


def is_yaml(path: Path) -> bool:
    """Whether a file is named like YAML."""
    return path.suffix.lower() in SUFFIXES


def is_scenario(path: Path) -> bool:
    """Whether a file says that it is a scenario."""
    return is_yaml(path) and SCENARIO_KEY.search(_file_head(path)) is not None


def _file_items(incomplete: str, is_wanted: Callable[[Path], bool]) -> Items:
    """Folders, and files that fit, whose names begin as typed."""
    path = os.path.expanduser(incomplete)  # noqa: PTH111 - a Path would lose `./` and `/`
    folder, prefix = os.path.split(path)
    folder_part = path[: len(path) - len(prefix)]
    is_empty = not incomplete
    items: Items = []
    for entry in sorted(_folder_entries(folder or "."), key=lambda entry: entry.name):
        is_hidden = entry.name.startswith(".") and not prefix.startswith(".")
        if is_hidden or not entry.name.startswith(prefix) or not entry.name.isprintable():
            continue
        name = f"./{entry.name}" if is_empty and entry.name.startswith(SPECIAL_SIGNS) else f"{folder_part}{entry.name}"
        if entry.is_dir():
            items.append(CompletionItem(f"{name}/", type="folder"))
        elif len(items) > MAX_OPENED_FILES or is_wanted(Path(entry.path)):
            items.append(CompletionItem(name, type="path"))
    return items


def _folder_entries(folder: str) -> list[os.DirEntry[str]]:
    try:
        with os.scandir(folder) as entries:
            return list(entries)
    except OSError:
        return []


def _file_head(path: Path) -> bytes:
    try:
        return read_file(path, HEAD_BYTES)
    except OSError:
        return b""


# --- words -----------------------------------------------------------------------------------------------------------


def code_items(ctx: click.Context, incomplete: str) -> Items:
    """Rule codes with their titles; the last one of a list."""
    del ctx
    codes_before, comma, prefix = incomplete.rpartition(",")
    codes_named = set(codes_before.upper().split(","))
    return [
        CompletionItem(f"{codes_before}{comma}{code}", help=title)
        for code, title in rule_titles()
        if code.startswith(prefix.upper()) and code not in codes_named
    ]


def rule_titles() -> Iterator[tuple[str, str]]:
    """Code and title of every rule, from a list made by docs/generate.py: loading the rules takes a second."""
    for line in files("pidcfg").joinpath("cli/completions/codes.txt").read_text(encoding="utf-8").splitlines():
        code, _, title = line.partition("\t")
        yield code, title


def limit_items(ctx: click.Context, incomplete: str) -> Items:
    """Names of limits."""
    del ctx
    return [
        CompletionItem(f"{field.name}=", type="part")
        for field in fields(Limits)
        if field.name.startswith(incomplete) and "=" not in incomplete
    ]


def report_file_items(ctx: click.Context, incomplete: str) -> Items:
    """``FORMAT=PATH``: the formats of the command, then any file."""
    fmt, equals, file_begin = incomplete.partition("=")
    if equals:
        return [CompletionItem(f"{fmt}={item.value}", type=item.type) for item in any_file(ctx, file_begin)]
    formats = next((p.type for p in ctx.command.params if p.name in {"fmt", "report"}), None)
    names = formats.choices if isinstance(formats, click.Choice) else ()
    return [CompletionItem(f"{name}=", type="part") for name in names if name.startswith(incomplete)]


def preceding_words(ctx: click.Context) -> list[str]:
    """The words on the line before the one that is typed; of ``--option=VALUE`` the value."""
    words: list[str] = ctx.find_root().obj or []
    return [word.partition("=")[2] or word if word.startswith("--") else word for word in words]


def format_items(ctx: click.Context, incomplete: str) -> Items:
    """The formats of the vendor of the file on the line; of all vendors when the file cannot be read."""
    vendor = next(filter(None, map(_vendor_of, preceding_words(ctx))), None)
    names = vendor.load("format_names") if vendor is not None else format_names()
    return [CompletionItem(name) for name in names if name.startswith(incomplete)]


def _vendor_of(name: str) -> Vendor | None:
    """The vendor that a configuration names."""
    return VENDORS.get(str(_read_yaml(Path(name)).get("vendor")))


def _read_yaml(path: Path) -> Mapping[str, object]:
    """The keys and values of a YAML file; none of what cannot be read."""
    if not is_yaml(path) or not path.is_file():
        return {}
    from pidcfg.cli.inputs import read_input
    from pidcfg.text.source import read_document

    entry = read_input(path.as_posix(), DEFAULT)
    data = read_document(entry.data, entry.name, DEFAULT).data
    return data if isinstance(data, dict) else {}


# --- which of them ---------------------------------------------------------------------------------------------------


SOURCES: dict[tuple[str, str], Source] = {
    ("validate", "paths"): yaml_file,
    ("simulate", "paths"): scenario_file,
    ("certify", "paths"): scenario_file,
    ("encode", "file"): configuration_file,
    ("convert", "file"): configuration_file,
    ("export", "file"): configuration_file,
    ("init", "sheet"): any_file,
    ("rule", "code"): code_items,
    ("*", "select"): code_items,
    ("*", "ignore"): code_items,
    ("*", "limits"): limit_items,
    ("*", "reports"): report_file_items,
    ("explain", "things"): code_items,
    ("encode", "fmt"): format_items,
    ("*", "config"): configuration_file,
    **{("*", name): any_file for name in ("into", "from_csv", "resume", "baseline", "plot", "csv", "xlsx", "out")},
}
"""Command (or any) and parameter, and what completes it; an argument without a row and a choice takes any file."""


class CompletedType(click.ParamType[object, object]):
    """A parameter whose values are completed from a source; nothing is converted while a line is typed."""

    name = "completed"

    def __init__(self, source: Source) -> None:
        self.source = source

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> object:
        """The value as it is."""
        del param, ctx
        return value

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> Items:
        """The source's candidates."""
        del param
        return self.source(ctx, incomplete)


def source_of(command: str, param: click.Parameter) -> Source | None:
    """What completes a parameter, when its type does not."""
    if isinstance(param, click.Option) and param.is_flag:
        return None
    source = SOURCES.get((command, param.name or "")) or SOURCES.get(("*", param.name or ""))
    if source is not None or isinstance(param.type, click.Choice):
        return source
    takes_file = isinstance(param.type, click.Path) or isinstance(param, click.Argument)
    return any_file if takes_file else None


def with_candidates(command: click.Command) -> click.Command:
    """A copy of a command whose parameters know their candidates."""
    copied = copy(command)
    copied.params = [copy(param) for param in command.params]
    for param in copied.params:
        source = source_of(command.name or "", param)
        if source is not None:
            param.type = CompletedType(source)
    return copied
