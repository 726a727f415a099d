"""What reaches the terminal: results on stdout, all else on stderr, colour and progress where a person watches."""

from __future__ import annotations

import codecs
import json
import os
import platform
import re
import stat
import sys
import time
import unicodedata
from contextlib import contextmanager
from functools import cache
from io import TextIOWrapper
from typing import TYPE_CHECKING, Any, TypeVar

import click

from pidcfg import __version__
from pidcfg.cli import environment
from pidcfg.text.signs import ORDER, first_order, one_line, printable, without_orders

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator
    from threading import Timer
    from typing import TextIO

    from rich.progress import Progress

    from pidcfg.study.outcome import Outcome

# --- Text for code pages that lack some of its characters: what a person would type in their place, never a crash -----

HANDLER = "pidcfg"
"""The name under which Python knows the fallback."""

# fmt: off
PLAIN = {
    "…": "...", "·": "-", "•": "*", "–": "-", "—": "-", "−": "-", "‐": "-", "‑": "-",
    "×": "x", "÷": "/", "±": "+/-", "√": "sqrt", "∞": "inf", "≤": "<=", "≥": ">=", "≠": "!=", "≈": "~",
    "°": "deg", "º": "deg", "℃": "degC", "℉": "degF", "′": "'", "″": '"', "’": "'", "‘": "'", "“": '"', "”": '"',
    "„": '"', "«": '"', "»": '"', "µ": "u", "μ": "u", "Ω": "ohm", "\u2126": "ohm", "π": "pi", "Φ": "phi", "φ": "phi",
    "ζ": "zeta", "τ": "tau", "Δ": "delta", "∆": "delta", "λ": "lambda", "σ": "sigma", "ω": "omega", "α": "alpha",
    "β": "beta", "²": "^2", "³": "^3", "¹": "^1", "⁻": "-", "½": "1/2", "¼": "1/4", "¾": "3/4", "‰": "0/00", "€": "EUR",
    "→": "->", "←": "<-", "↔": "<->", "⇒": "=>", "↑": "^", "↓": "v", "▲": "^", "▼": "v", "▶": ">", "◀": "<",
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
    return text if fits(text, encoding) else text.encode(encoding, HANDLER).decode(encoding)


def install() -> None:
    """Lets everything that is printed fall back so, also what click and Python print by themselves."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors=HANDLER)


def fits(text: str, encoding: str | None) -> bool:
    """Whether an encoding has all characters of a text."""
    try:
        text.encode(encoding or "utf-8")
    except UnicodeEncodeError:
        return False
    return True


def _replaced(char: str, encoding: str) -> str:
    """What stands for one character: a letter without its accent, else the nearest ASCII, else a question mark."""
    plain = PLAIN.get(char) or _drawn(char)
    if plain is None:
        bare = "".join(c for c in unicodedata.normalize("NFKD", char) if not unicodedata.combining(c))
        plain = bare if bare != char else None
    return plain if plain is not None and fits(plain, encoding) else "" if unicodedata.combining(char) else "?"


def _drawn(char: str) -> str | None:
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
    lacking = error.object[error.start : error.end]
    return "".join(_replaced(char, error.encoding) for char in lacking), error.end


codecs.register_error(HANDLER, _handle)

# --- Colour for finished text: what a person looks for first stands out; the reporters know nothing of it -------------
#
# ``NO_COLOR`` switches it off, then ``FORCE_COLOR`` or ``CLICOLOR_FORCE`` on, then a terminal decides; ``--color``
# outranks them all.

SEVERITIES: dict[str, dict[str, Any]] = {
    "error": {"fg": "red", "bold": True},
    "warning": {"fg": "yellow", "bold": True},
    "info": {"fg": "cyan", "bold": True},
}
STYLES: dict[str, dict[str, Any]] = {
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

SEVERITY = r"(?P<severity>error|warning|info)"


def _counted(group: str, word: str) -> str:
    """A pattern of a number of things that stands out unless it is 0."""
    return rf"(?:(?P<{group}>[1-9]\d* {word}s?)|0 {word}s)"


@cache
def patterns() -> tuple[re.Pattern[str], ...]:
    """What stands out in a line, by named groups; most commands colour nothing, and need no pattern."""
    from pidcfg.validate.catalog import CODE

    return tuple(
        re.compile(pattern)
        for pattern in (
            # a finding: its place, its line of the file with a caret, and what belongs to it
            rf"^(?P<place>\S.*?:\d+(?::\d+)?:) {SEVERITY} (?P<code>{CODE.pattern})",
            r"^(?P<gutter> *\d+ \|)",
            r"^(?P<gutter>      \|)\s+(?P<caret>\^+)$",
            r"^      (?P<label>= (?:PLC|see|cure|also):)",
            rf"^(?P<code>{CODE.pattern})  {SEVERITY} +(?P<dim>\S+)",
            # the line that counts them
            rf"^\d+ files? checked: {_counted('bad', 'error')}, {_counted('doubtful', 'warning')}",
            # a simulation
            r"^(?P<head>What happened|Metrics|Signals|Flags|Expectations)$",
            r"^  (?:(?P<good>passed)|(?P<bad>FAILED))  ",
            r"^(?:(?P<good>passed:)|(?P<bad>FAILED:)|\S+: (?P<bad_end>cannot run)$)",
            r"^ +[\d.e+]+ s  .*?  (?:(?P<bad>error:)|(?P<doubtful>alarm \S+),)",
            # a comparison and a conversion
            r"^  (?:(?P<bad>critical|high)|(?P<doubtful>medium)|(?P<dim>low|cosmetic)) +\S+:",
            r"^(?P<head>\S.*?): (?:(?P<added>added)|(?P<bad>removed))$",
            r"^ (?:!| )(?:(?P<bad>dropped)|(?P<doubtful>clamped|assumed|rounded)|(?P<dim>exact)) +\S+:",
            r"^(?:(?P<bad>Error:)|(?P<doubtful>warning:|note:))",
        )
    )


def enabled(stream: Any) -> bool:
    """Whether text on this stream is coloured."""
    context = click.get_current_context(silent=True)
    if context is not None and context.color is not None:
        return context.color
    if os.environ.get("NO_COLOR"):
        return False
    if any(os.environ.get(name, "0") not in {"", "0"} for name in ("FORCE_COLOR", "CLICOLOR_FORCE")):
        return True
    return terminal(stream)


def terminal(stream: Any) -> bool:
    """Whether a stream is a terminal that knows more than lines."""
    return stream is not None and bool(stream.isatty()) and os.environ.get("TERM") != "dumb"


def painted(text: str) -> str:
    """A report with its severities, codes, places, carets and verdicts in colour."""
    lines, severity = [], "error"
    for line in text.split("\n"):
        match = next(filter(None, (pattern.match(line) for pattern in patterns())), None)
        if match is not None:
            severity = match.groupdict().get("severity") or severity
        lines.append(line if match is None else _line(line, match, severity))
    return "\n".join(lines)


def _line(line: str, match: re.Match[str], severity: str) -> str:
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


def option(*, hidden: bool = False) -> Callable[[Any], Any]:
    """``--color``, which every command understands."""
    return click.option(
        "--color",
        type=click.Choice(["auto", "always", "never"]),
        default="auto",
        hidden=hidden,
        expose_value=False,
        is_eager=True,
        callback=_choose,
        show_default=True,
        help="Colour; auto: on a terminal, and as NO_COLOR and FORCE_COLOR say.",
    )


def _choose(ctx: click.Context, param: click.Parameter, value: str) -> None:
    """Tells the context, which hands it on to the commands below."""
    del param
    if value != "auto":
        ctx.color = value == "always"


def with_option(command: click.Command) -> click.Command:
    """A command that takes ``--color`` after its name as well."""
    if not any(param.name == "color" for param in command.params):
        option(hidden=True)(command)
    return command


# ----------------------------------------------------------------------------------------------------------------------
# What a person sees of a command that takes longer than a second: one line on stderr that is gone when it ends.
# One line serves all commands. `main` begins it, whoever knows how far the work has come tells `update`, and
# everything that writes to the terminal takes the line away first. Nobody is shown anything where stderr is no
# terminal, or after ``--quiet``.

T = TypeVar("T")
AFTER = 1.0
"""Seconds of silence."""


class Line:
    """The line: a timer waits for its second, then a bar is there until the line ends."""

    def __init__(self) -> None:
        self.label = "working"
        self.share: float | None = None
        self.silent = False
        self._timer: Timer | None = None
        self._bar: Progress | None = None

    def begin(self) -> None:
        """From now on the second counts, if a person watches."""
        if self.silent or self._timer is not None or not watched():
            return
        from threading import Timer

        self._timer = Timer(AFTER, self._show)
        self._timer.daemon = True
        self._timer.start()

    def _show(self) -> None:
        """Draws the bar; the timer's thread does this, while the work goes on."""
        bar = _bar()
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


LINE = Line()


def watched() -> bool:
    """Whether stderr is a terminal: progress is shown nowhere else."""
    return sys.stderr is not None and terminal(sys.stderr)


def _bar() -> Progress:
    """A bar on stderr that leaves nothing behind."""
    from rich.console import Console
    from rich.progress import Progress

    plain = not enabled(sys.stderr)
    console = Console(file=sys.stderr, no_color=plain)
    return Progress(console=console, transient=True, redirect_stdout=False, redirect_stderr=False)


def progress(items: Iterable[T], label: str, total: int) -> Iterator[T]:
    """The items, while the line shows how many have come."""
    LINE.update(label)
    for done, item in enumerate(items, start=1):
        yield item
        LINE.update(label, done / max(total, 1))


@contextmanager
def held() -> Iterator[None]:
    """Without the line: while somebody types, or processes are forked, which no thread survives."""
    begun = LINE.end()
    try:
        yield
    finally:
        if begun:
            LINE.begin()


# ----------------------------------------------------------------------------------------------------------------------
# What reaches the terminal: results on stdout, everything else on stderr, and rich only where a person watches.

WIDEST = 1000
"""Columns of a page: COLUMNS may say any number."""
OBEYING = ("GITHUB_ACTIONS", "TF_BUILD", "TEAMCITY_VERSION")
"""Variables of the CI systems that look for orders in a log."""
NOT_ASCII = re.compile(r"[^\x00-\x7f]")


def echo(text: str) -> None:
    """A result as it is, a file's text that nothing may be put into: where a line of it would be an order, none."""
    _refuse_orders(encodable(text, sys.stdout.encoding))
    show_orders(text)


def hand_on(data: bytes) -> None:
    """The bytes of a user's own file, as `echo` prints texts."""
    _refuse_orders(data.decode("utf-8", "replace"))
    sys.stdout.buffer.write(data)


def show_lines(text: str) -> None:
    """A result that a program takes from a log: never coloured, and no order."""
    show_orders(without_orders(encodable(text, sys.stdout.encoding)))


def show_orders(text: str) -> None:
    """A result as it is, with orders that are meant; where a code page lacks some of it, a note says so.

    Where a person watches, control characters in it are shown and not obeyed.
    """
    if sys.stdout.isatty():
        text = printable(text.replace("\r\n", "\n"))
    _put(text, color=False)
    if not fits(text, sys.stdout.encoding):
        lacking = "".join(dict.fromkeys(c for c in text if not fits(c, sys.stdout.encoding)))
        note(
            f"note: the code page {sys.stdout.encoding} lacks {lacking!a}: that text was replaced; "
            "a file is written in UTF-8, and so is standard output with PYTHONUTF8=1"
        )


def show(text: str) -> None:
    """A result for people: in colour where that is wanted."""
    text, coloured = _for_people(text, sys.stdout), enabled(sys.stdout)
    _put(painted(text) if coloured else text, color=coloured)


def echo_json(text: str) -> None:
    """A JSON result; JSON is UTF-8, so on another code page JSON's own escapes stand for what is not ASCII."""
    if not (text.isascii() or _is_utf8(text)):
        text = NOT_ASCII.sub(lambda sign: json.dumps(sign[0])[1:-1], text)
    echo(text)


def echo_xml(text: str) -> None:
    """XML or HTML that says it is UTF-8; on another code page numbers stand for characters that are not ASCII."""
    if not (text.isascii() or _is_utf8(text)):
        text = text.encode("ascii", "xmlcharrefreplace").decode()
    if first_order(text) is not None:
        text = ORDER.sub(lambda begin: f"{begin[0][:-1]}&#{ord(begin[0][-1])};", text)
    echo(text)


def _is_utf8(text: str) -> bool:
    """Whether a text reaches standard output as UTF-8."""
    encoding = sys.stdout.encoding or "utf-8"
    return codecs.lookup(encoding).name == "utf-8" and fits(text, encoding)


def note(text: str) -> None:
    """A remark for people, on stderr."""
    LINE.end()
    coloured = enabled(sys.stderr)
    text = _for_people(text, sys.stderr)
    try:
        click.echo(painted(text) if coloured else text, err=True, color=coloured)
    except OSError:  # nobody reads it, or the disk is full: a remark that is lost changes no exit code
        drop(sys.stderr)


def remark(text: str) -> None:
    """A note that has one line to itself, whatever the names and values in it hold."""
    note(one_line(text))


def _for_people(text: str, stream: TextIO) -> str:
    """Text that hides nothing and orders nothing, also once a code page has replaced some of it."""
    return without_orders(encodable(printable(text), stream.encoding))


def _refuse_orders(text: str) -> None:
    """Ends the command where a line of a result would be an order to a CI system that reads it; a file is no log."""
    order = None if set(OBEYING).isdisjoint(os.environ) else first_order(text)
    if order is None:
        return
    try:
        if stat.S_ISREG(os.fstat(sys.stdout.fileno()).st_mode):
            return
    except OSError:  # no file at all
        pass
    line = text.count("\n", 0, order.end()) + 1
    said = f"line {line} of the result would be an order to the CI job that keeps this log"
    raise click.ClickException(f"{said}; send the result to a file: > FILE")


def _put(text: str, *, color: bool) -> None:
    """Prints; when the reader has gone (as `| head` does) the command goes on, with its files and its exit code."""
    LINE.end()
    try:
        click.echo(encodable(text, sys.stdout.encoding), nl=False, color=color)
    except BrokenPipeError:
        drop(sys.stdout)


def drop(stream: TextIO) -> None:
    """Sends what is still to be written to nowhere: Python would complain again when it closes the stream."""
    os.close(stream.fileno())  # first: no more files may be open than are now
    nowhere = os.open(os.devnull, os.O_WRONLY)
    if nowhere != stream.fileno():
        os.dup2(nowhere, stream.fileno())
        os.close(nowhere)


def markdown(text: str) -> None:
    """A page of documentation: formatted where colour is wanted, as it is elsewhere."""
    if not enabled(sys.stdout):
        _put(without_orders(encodable(text, sys.stdout.encoding)), color=False)
        return
    import shutil
    from io import StringIO

    from rich.console import Console
    from rich.markdown import Markdown

    page, width = StringIO(), min(shutil.get_terminal_size().columns, WIDEST)
    Console(file=page, force_terminal=True, color_system="standard", legacy_windows=False, width=width).print(
        Markdown(text)
    )
    _put(without_orders(encodable(page.getvalue(), sys.stdout.encoding)), color=True)


# --- What is usually done next: one line for a person at a terminal, never for a file, a pipe or CI -------------------

SAFE = re.compile(r"[\w@%+=:,./-]+")
"""A word that a shell takes as it is."""


def next_step(*words: str, quiet: bool = False, fmt: str = "text") -> None:
    """Names the command that is usually next, ``words`` behind ``pidcfg``."""
    if quiet or fmt != "text" or "CI" in os.environ or not sys.stderr.isatty():
        return
    remark(f"next: pidcfg {' '.join(word if SAFE.fullmatch(word) else _quoted(word) for word in words)}")


def _quoted(word: str) -> str:
    """In double quotes, which every shell knows."""
    return '"' + word.replace('"', '\\"') + '"'


# --- ``--verbose``: what a command has read, left out and taken from elsewhere, on standard error ---------------------


class Detail:
    """What is said with ``--verbose``, and nothing without it."""

    def __init__(self, ctx: click.Context, *, wanted: bool, quiet: bool) -> None:
        if wanted and quiet:
            raise click.UsageError("--verbose and --quiet exclude each other", ctx)
        self.wanted = wanted
        self._begin = self._last = time.perf_counter()
        self.say(f"pidcfg {__version__}, Python {platform.python_version()}, {platform.system()}")
        self.say(*(f"environment: {setting}" for setting in environment.in_force(ctx.command)))

    def say(self, *lines: str) -> None:
        """Lines for whoever wants to know."""
        for line in lines if self.wanted else ():
            remark(line)

    def listed(self, what: str, names: Iterable[str]) -> None:
        """A line for each name."""
        self.say(*(f"{what} {name}" for name in names))

    def ran(self, outcome: Outcome) -> None:
        """What a run read, and how fast it was."""
        self.say(*(f"read {name}" for name in dict.fromkeys((outcome.file, outcome.config)) if name))
        now = time.perf_counter()
        took, self._last = now - self._last, now
        if outcome.report is not None:
            duration = outcome.report.duration
            self.say(f"ran {outcome.file}: {duration:g} s in {took:.2f} s, engine {outcome.report.engine}")

    def end(self) -> None:
        """How long it took."""
        self.say(f"took {time.perf_counter() - self._begin:.2f} s")
