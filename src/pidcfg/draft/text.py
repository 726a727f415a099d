"""A drafted scenario as a file: what belongs on one line stands on one line, and comments stand below each other."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING, Any

from pidcfg.draft.numbers import time_text

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.draft.course import Course

PLAIN = re.compile(r"[A-Za-z_][\w./-]*( [\w./*+-][\w./*+()-]*)*( %)?")
"""Texts that need no quotes, in braces either."""
SHARE = re.compile(r"\d+ %")
FILE = re.compile(r"[\w./][\w./-]*")
RESERVED = frozenset(("true", "false", "null", "yes", "no", "on", "off", "y", "n", "none"))
WIDEST = 100
"""Where a comment still stands behind its line, rather than above it."""
HEAD = """\
# A first scenario for {config}, drafted from its ranges and gains.
# The plants are no model of your process: each is one that the loop's own gains suit. Put in what you know of it,
# or let 'pidcfg tune --from-csv' find gain, time constant and dead time in a recorded step.
"""


def text_of(course: Course, title: str, config: str) -> str:
    """The scenario as YAML."""
    rows = ["pidcfg: 1", f"scenario: {_title(title)}", f"config: {scalar(config)}", _duration(course.duration)]
    if course.initial == "steady":
        rows.append("initial: steady                  # settled at the set points when time starts")
    elif isinstance(course.initial, dict) and course.initial:
        rows.append(f"initial: {flow(course.initial)}   # the output that each loop starts with")
    if course.plants:
        rows.append("plants:                          # each moves its loop's PV, in engineering units")
        rows += _plants(course)
    if course.connect:
        rows += ["connect:                         # what the PVs show"]
        rows += _aligned(
            [(f"  {scalar(line.key)}: {scalar(line.data['to'])}", line.comment) for line in course.connect]
        )
    for part, lines in (("events", course.events), ("expect", course.expect), ("allow", course.allow)):
        if lines:
            rows.append(f"{part}:")
            rows += _aligned([(f"  - {flow(line.data)}", line.comment) for line in lines])
    remarks = [f"# - {remark}" for remark in course.remarks]
    head = HEAD.format(config=config) + ("# What to know:\n" + "\n".join(remarks) + "\n" if remarks else "")
    return head + "\n".join(rows) + "\n"


def _title(text: str) -> str:
    """On a line of its own commas need no quotes."""
    return text if all(PLAIN.fullmatch(part) for part in text.split(", ")) else scalar(text)


def _duration(seconds: float) -> str:
    row = f"duration: {number(seconds)}"
    return f"{row:33}# s, {time_text(seconds)}" if seconds >= 120 else f"{row:33}# s"


def _plants(course: Course) -> list[str]:
    if course.connect:
        return _aligned([(f"  - {flow({'name': line.key, **line.data})}", line.comment) for line in course.plants])
    width = max(len(scalar(line.key)) for line in course.plants) + 1
    return _aligned([(f"  {scalar(line.key) + ':':{width}} {flow(line.data)}", line.comment) for line in course.plants])


def _aligned(rows: Sequence[tuple[str, str]]) -> list[str]:
    """Lines with their comments in one column; above the line where it is long."""
    column = max((len(row) for row, comment in rows if comment and len(row) <= WIDEST), default=0) + 3
    out = []
    for row, comment in rows:
        if comment and len(row) > WIDEST:
            out.append(f"  # {comment}")
            out.append(row)
        else:
            out.append(f"{row:{column}}# {comment}" if comment else row)
    return out


def flow(data: dict[str, Any]) -> str:
    """A mapping in braces."""
    return "{" + ", ".join(f"{scalar(key)}: {scalar(value)}" for key, value in data.items()) + "}"


def scalar(value: Any) -> str:
    """A value as YAML writes it."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int | float):
        return number(value)
    if isinstance(value, dict):
        return flow(value)
    text = str(value)
    file = text.endswith((".yaml", ".yml")) and FILE.fullmatch(text)
    if file or SHARE.fullmatch(text) or (PLAIN.fullmatch(text) and text.lower() not in RESERVED):
        return text
    return json.dumps(text, ensure_ascii=False)


def number(value: float) -> str:
    """A number as people write it."""
    return f"{value:.10g}"
