"""Colour for finished text: what a person looks for first stands out; the reporters know nothing of it.

``NO_COLOR`` switches it off, then ``FORCE_COLOR`` or ``CLICOLOR_FORCE`` on, then a terminal decides; ``--color``
outranks them all.
"""

from __future__ import annotations

import os
import re
from functools import cache
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from collections.abc import Callable

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
