"""How each shell hands over the line that is typed, and how it wants the candidates back."""

from __future__ import annotations

import os
import re
import shlex
from typing import TYPE_CHECKING, Any

from click.shell_completion import CompletionItem, ShellComplete, add_completion_class

from pidcfg.cli.commands.completion import script
from pidcfg.cli.terminal.glyphs import encodable

if TYPE_CHECKING:
    from collections.abc import Sequence

END = "\x01"
"""Put at the end of the line, so that the last word is the one that is typed, even when it is empty."""
ASSIGNMENT = re.compile(r"\w+=")
UNQUOTED = re.compile(r"[\w./\\:=,+~-]+")
QUOTES = re.compile("['\u2018-\u201b]")
"""What ends a text in single quotes for PowerShell, unless it stands twice: typographic ones do as well."""


class Shell(ShellComplete):
    """What the shells have in common: the line up to the cursor in ``COMP_WORDS``, and silence when all goes wrong."""

    breaks = "="
    """Characters after which the shell begins a new word of its own."""
    escape = "\\"
    head = ""
    """What stands before the shell's own word in the word that is typed."""

    def source(self) -> str:
        """The script that `pidcfg completion` prints."""
        return script(self.name)

    def complete(self) -> str:
        """The candidates; a shell that waits for them has no use for a traceback."""
        try:
            return super().complete()
        except Exception:  # noqa: BLE001 - whatever happens, the user is typing
            return ""

    def get_completion_args(self) -> tuple[list[str], str]:
        """The words before the one that is typed, and that one."""
        words = split(os.environ.get("COMP_WORDS", "") + END, self.escape)
        while len(words) > 1 and ASSIGNMENT.match(words[0]):
            del words[0]
        typed = words[-1].removesuffix(END)
        match = re.match(rf".*[{self.breaks}]", typed)
        self.head = match.group() if match else ""
        return words[1:-1], typed

    def get_completions(self, args: list[str], incomplete: str) -> list[CompletionItem[str]]:
        """The candidates, with those that only pidcfg knows."""
        self.ctx_args = {**self.ctx_args, "obj": list(args)}
        return super().get_completions(args, incomplete)

    def insertion(self, item: CompletionItem[Any]) -> str:
        """The part of a value that the shell inserts after what stands there."""
        return str(item.value).removeprefix(self.head)

    def whole(self, item: CompletionItem[Any]) -> str:
        """The value as the shell's whole word."""
        value = str(item.value)
        return value if value.startswith(self.head) else self.head + value


class Bash(Shell):
    """bash has no room for a help, and words of its own after ``=`` and ``:``."""

    name = "bash"
    breaks = "=:"

    def format_completion(self, item: CompletionItem[Any]) -> str:
        """The kind and the value."""
        return f"{item.type},{self.insertion(item)}"


class Zsh(Shell):
    """zsh wants the whole word, and takes a colon for the beginning of the help."""

    name = "zsh"

    def format_completion(self, item: CompletionItem[Any]) -> str:
        """Three lines; a colon is escaped where a help follows."""
        value = self.whole(item)
        if item.help and item.type == "plain":
            value = value.replace(":", r"\:")
        return f"{item.type}\n{value}\n{one_line(item.help)}"


class Fish(Shell):
    """fish wants the whole word, and the help behind a tab."""

    name = "fish"

    def format_completion(self, item: CompletionItem[Any]) -> str:
        """The kind, the value and the help."""
        return f"{item.type},{self.whole(item)}" + (f"\t{one_line(item.help)}" if item.help else "")


class PowerShell(Shell):
    """PowerShell escapes nothing with a backslash, wants the whole word, and may read any code page."""

    name = "powershell"
    escape = ""

    def format_completion(self, item: CompletionItem[Any]) -> str:
        """Three lines; a value with spaces is quoted."""
        value = self.whole(item)
        if not UNQUOTED.fullmatch(value):
            value = f"'{QUOTES.sub(lambda quote: 2 * quote.group(), value)}'"
        return f"{item.type}\n{value}\n{encodable(one_line(item.help), 'ascii')}"


def split(line: str, escape: str) -> list[str]:
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


def register() -> None:
    """Tells click of them."""
    for shell in SHELLS:
        add_completion_class(shell)
