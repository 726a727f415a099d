"""What reaches the terminal: results on stdout, all else on stderr, colour and progress where a person watches."""

from __future__ import annotations

import codecs
import os
import re
import sys
import unicodedata
from contextlib import contextmanager
from functools import cache
from io import TextIOWrapper
from typing import TYPE_CHECKING, Any, TypeVar

import click

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator
    from threading import Timer

    from rich.progress import Progress

    from pidcfg.text.paths import Data


# --- Text for code pages that lack some of its characters: what a person would type in their place, never a crash -----

ERROR_HANDLER = "pidcfg"
"""The name under which Python knows the fallback."""

# fmt: off
ASCII_FORMS = {
    "…": "...", "·": "-", "•": "*", "–": "-", "—": "-", "−": "-", "‐": "-", "‑": "-",
    "×": "x", "÷": "/", "±": "+/-", "√": "sqrt", "∞": "inf", "≤": "<=", "≥": ">=", "≠": "!=", "≈": "~",
    "°": "deg", "º": "deg", "℃": "degC", "℉": "degF", "′": "'", "″": '"', "’": "'", "‘": "'", "“": '"', "”": '"',
    "„": '"', "«": '"', "»": '"', "µ": "u", "μ": "u", "Ω": "ohm", "\u2126": "ohm", "π": "pi", "Φ": "phi", "φ": "phi",
    "ζ": "zeta", "τ": "tau", "Δ": "delta", "∆": "delta", "λ": "lambda", "σ": "sigma", "ω": "omega", "α": "alpha",
    "β": "beta", "²": "^2", "³": "^3", "¹": "^1", "⁻": "-", "½": "1/2", "¼": "1/4", "¾": "3/4", "‰": "0/00", "€": "EUR",
    "→": "->", "⟶": "->", "←": "<-", "↔": "<->", "⇒": "=>", "↑": "^", "↓": "v", "▲": "^", "▼": "v", "▶": ">", "◀": "<",
    "✓": "ok", "✔": "ok", "✗": "x", "✘": "x", "■": "#", "□": "#", "◆": "*", "◇": "*",
    "ß": "ss", "ø": "o", "Ø": "O", "æ": "ae", "Æ": "AE", "œ": "oe", "Œ": "OE", "ł": "l", "Ł": "L", "đ": "d", "ı": "i",
    "\u00a0": " ", "\u2009": " ", "\u202f": " ", "\ufeff": "", "\ufffd": "?",
}
# fmt: on
"""What stands for a character that a code page lacks."""
BOXES, BLOCKS, SHAPES = range(0x2500, 0x2580), range(0x2580, 0x25A0), range(0x25A0, 0x2600)
BRAILLE = range(0x2800, 0x2900)
HORIZONTAL, VERTICAL = frozenset("─━┄┅┈┉╌╍═╴╶╸╺╼╾"), frozenset("│┃┆┇┊┋╎╏║╵╷╹╻╽╿")
SLANTED = {"╱": "/", "╲": "\\", "╳": "x"}


def encodable(text: str, encoding: str | None) -> str:
    """The text with what the encoding lacks replaced: as it is for UTF-8."""
    encoding = encoding or "utf-8"
    return text if can_encode(text, encoding) else text.encode(encoding, ERROR_HANDLER).decode(encoding)


def install_fallback() -> None:
    """Lets everything that is printed fall back so, also what click and Python print by themselves."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors=ERROR_HANDLER)


def can_encode(text: str, encoding: str | None) -> bool:
    """Whether an encoding has all characters of a text."""
    try:
        text.encode(encoding or "utf-8")
    except UnicodeEncodeError:
        return False
    return True


def _replace_character(char: str, encoding: str) -> str:
    """What stands for one character: a letter without its accent, else the nearest ASCII, else a question mark."""
    form = ASCII_FORMS.get(char) or _ascii_shape(char)
    if form is None:
        letters = "".join(c for c in unicodedata.normalize("NFKD", char) if not unicodedata.combining(c))
        form = letters if letters != char else None
    return form if form is not None and can_encode(form, encoding) else "" if unicodedata.combining(char) else "?"


def _ascii_shape(char: str) -> str | None:
    """Lines of boxes, bars and dots of pictures."""
    code = ord(char)
    if code in BOXES:
        return SLANTED.get(char) or ("-" if char in HORIZONTAL else "|" if char in VERTICAL else "+")
    if code in BLOCKS:
        return "#"
    if code in SHAPES:
        return "o"
    if code in BRAILLE:
        return "." if code > BRAILLE.start else " "
    return None


def _handle(error: UnicodeError) -> tuple[str, int]:
    """What Python calls when an encoding lacks characters."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    missing_characters = error.object[error.start : error.end]
    return "".join(_replace_character(char, error.encoding) for char in missing_characters), error.end


codecs.register_error(ERROR_HANDLER, _handle)

# --- Colour for finished text: what a person looks for first stands out; the reporters know nothing of it -------------
#
# ``NO_COLOR`` switches it off, then ``FORCE_COLOR`` or ``CLICOLOR_FORCE`` on, then a terminal decides; ``--color``
# outranks them all.

SEVERITIES: dict[str, Data] = {
    "error": {"fg": "red", "bold": True},
    "warning": {"fg": "yellow", "bold": True},
    "info": {"fg": "cyan", "bold": True},
}
STYLES: dict[str, Data] = {
    "head": {"bold": True},
    "place": {"bold": True},
    "dim": {"dim": True},
    "gutter": {"fg": "blue"},
    "label": {"fg": "cyan"},
    "bad": {"fg": "red", "bold": True},
    "doubtful": {"fg": "yellow"},
    "good": {"fg": "green", "bold": True},
    "added": {"fg": "green"},
}
"""How a group of a pattern is drawn; a group that is named after no style is drawn in the colour of its severity."""

SEVERITY_PATTERN = r"(?P<severity>error|warning|info)"


def _count_pattern(group: str, word: str) -> str:
    """A pattern of a number of things that stands out unless it is 0."""
    return rf"(?:(?P<{group}>[1-9]\d* {word}s?)|0 {word}s)"


@cache
def paint_patterns() -> tuple[re.Pattern[str], ...]:
    """What stands out in a line, by named groups; most commands colour nothing, and need no pattern."""
    from pidcfg.validate.catalog import CODE_PATTERN

    return tuple(
        re.compile(pattern)
        for pattern in (
            # a finding: its place, its line of the file with a caret, and what belongs to it
            rf"^(?P<place>\S.*?:\d+(?::\d+)?:) {SEVERITY_PATTERN} (?P<code>{CODE_PATTERN.pattern})",
            r"^(?P<gutter> *\d+ \|)",
            r"^(?P<gutter>      \|)\s+(?P<caret>\^+)$",
            r"^      (?P<label>= (?:PLC|see|cure|also):)",
            rf"^(?P<code>{CODE_PATTERN.pattern})  {SEVERITY_PATTERN} +(?P<dim>\S+)",
            # the line that counts them
            rf"^\d+ files? checked: {_count_pattern('bad', 'error')}, {_count_pattern('doubtful', 'warning')}",
            # a simulation
            r"^(?P<head>What happened|Metrics|Signals|Flags|Expectations)$",
            r"^ {2,}(?:(?P<good>passed)|(?P<bad>FAILED)|(?P<doubtful>NOT PROVEN))  ",
            r"^(?:(?P<good>passed:)|(?P<bad>FAILED:)|(?P<doubtful>NOT PROVEN:)|\S+: (?P<bad_end>cannot run)$)",
            r"^ +[\d.e+]+ s  .*?  (?:(?P<bad>error:)|(?P<doubtful>alarm \S+),)",
            # a comparison and a conversion
            r"^  (?:(?P<bad>critical|high)|(?P<doubtful>medium)|(?P<dim>low|cosmetic)) +\S+:",
            r"^(?P<head>\S.*?): (?:(?P<added>added)|(?P<bad>removed))$",
            r"^ (?:!| )(?:(?P<bad>dropped)|(?P<doubtful>clamped|assumed|rounded)|(?P<dim>exact)) +\S+:",
            r"^(?:(?P<bad>Error:)|(?P<doubtful>warning:|note:))",
        )
    )


def is_coloured(stream: object) -> bool:
    """Whether text on this stream is coloured."""
    context = click.get_current_context(silent=True)
    if context is not None and context.color is not None:
        return context.color
    if os.environ.get("NO_COLOR"):
        return False
    if any(os.environ.get(name, "0") not in {"", "0"} for name in ("FORCE_COLOR", "CLICOLOR_FORCE")):
        return True
    return is_terminal(stream)


def is_terminal(stream: Any) -> bool:
    """Whether a stream is a terminal that knows more than lines."""
    return stream is not None and bool(stream.isatty()) and os.environ.get("TERM") != "dumb"


def paint_report(text: str) -> str:
    """A report with its severities, codes, places, carets and verdicts in colour."""
    lines, severity = [], "error"
    for line in text.split("\n"):
        match = next(filter(None, (pattern.match(line) for pattern in paint_patterns())), None)
        if match is not None:
            severity = match.groupdict().get("severity") or severity
        lines.append(line if match is None else _paint_line(line, match, severity))
    return "\n".join(lines)


def _paint_line(line: str, match: re.Match[str], severity: str) -> str:
    """One line with the groups of its pattern drawn."""
    out, end = [], 0
    for name in match.groupdict():
        start, stop = match.span(name)
        if start < end or start == stop:
            continue
        style = STYLES.get(name.partition("_")[0], SEVERITIES[severity])
        out += [line[end:start], click.style(line[start:stop], **style)]
        end = stop
    return "".join(out) + line[end:]


def color_option(*, hidden: bool = False) -> Callable[[object], Any]:
    """``--color``, which every command understands."""
    return click.option(
        "--color",
        type=click.Choice(["auto", "always", "never"]),
        default="auto",
        hidden=hidden,
        expose_value=False,
        is_eager=True,
        callback=_set_color,
        show_default=True,
        help="Colour; auto: on a terminal, and as NO_COLOR and FORCE_COLOR say.",
    )


def _set_color(ctx: click.Context, param: click.Parameter, value: str) -> None:
    """Tells the context, which hands it on to the commands below."""
    del param
    if value != "auto":
        ctx.color = value == "always"


def add_color_option(command: click.Command) -> click.Command:
    """A command that takes ``--color`` after its name as well."""
    if not any(param.name == "color" for param in command.params):
        color_option(hidden=True)(command)
    return command


# ----------------------------------------------------------------------------------------------------------------------
# What a person sees of a command that takes longer than a second: one line on stderr that is gone when it ends.
# One line serves all commands. `main` begins it, whoever knows how far the work has come tells `update`, and
# everything that writes to the terminal takes the line away first. Nobody is shown anything where stderr is no
# terminal, or after ``--quiet``.

T = TypeVar("T")
DELAY_SECONDS = 1.0
"""Seconds of silence."""


class ProgressLine:
    """The line: a timer waits for its second, then a bar is there until the line ends."""

    def __init__(self) -> None:
        self.label = "working"
        self.share: float | None = None
        self.silent = False
        self._timer: Timer | None = None
        self._bar: Progress | None = None

    def begin(self) -> None:
        """From now on the second counts, if a person watches."""
        if self.silent or self._timer is not None or not is_watched():
            return
        from threading import Timer

        self._timer = Timer(DELAY_SECONDS, self._show)
        self._timer.daemon = True
        self._timer.start()

    def _show(self) -> None:
        """Draws the bar; the timer's thread does this, while the work goes on."""
        bar = _make_bar()
        bar.add_task(self.label, total=None)
        self._bar = bar
        self._draw()
        bar.start()

    def _draw(self) -> None:
        """Brings the bar up to date."""
        if self._bar is not None and self._bar.task_ids:
            total, done = (None, 0.0) if self.share is None else (1.0, self.share)
            self._bar.update(self._bar.task_ids[0], description=self.label, total=total, completed=done)

    def update(self, label: str, share: float | None = None) -> None:
        """What is done, and how much of it; without a share it is unknown."""
        self.label, self.share = label, share
        self._draw()

    def end(self) -> bool:
        """Takes the line away; tells whether there was one, or would have been."""
        timer, self._timer = self._timer, None
        if timer is None:
            return False
        timer.cancel()
        timer.join()
        bar, self._bar = self._bar, None
        if bar is not None:
            bar.stop()
        return True

    def silence(self) -> None:
        """``--quiet``."""
        self.end()
        self.silent = True


LINE = ProgressLine()


def is_watched() -> bool:
    """Whether stderr is a terminal: progress is shown nowhere else."""
    return sys.stderr is not None and is_terminal(sys.stderr)


def _make_bar() -> Progress:
    """A bar on stderr that leaves nothing behind."""
    from rich.console import Console
    from rich.progress import Progress

    no_color = not is_coloured(sys.stderr)
    console = Console(file=sys.stderr, no_color=no_color)
    return Progress(console=console, transient=True, redirect_stdout=False, redirect_stderr=False)


def progress(items: Iterable[T], label: str, total: int) -> Iterator[T]:
    """The items, while the line shows how many have come."""
    LINE.update(label)
    for done, item in enumerate(items, start=1):
        yield item
        LINE.update(label, done / max(total, 1))


@contextmanager
def hold_line() -> Iterator[None]:
    """Without the line: while somebody types, or processes are forked, which no thread survives."""
    was_shown = LINE.end()
    try:
        yield
    finally:
        if was_shown:
            LINE.begin()
