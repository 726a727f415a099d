"""Format ``markdown``: tables for the comments of pull requests, which commands that compare write."""

from __future__ import annotations

import re

from pidcfg.cli.formats.format import Format, Kind

MARKS = re.compile(r"[\\|]|(?<=\])\(")
"""What would end a cell, and the sign that makes a link of a text in brackets."""
FORMAT = Format("comments of pull requests", "md", Kind.LINES)


def cell(text: str) -> str:
    """Text that stays in its cell of a Markdown table, and is no picture or link there."""
    return MARKS.sub(r"\\\g<0>", text).replace("\n", " ").replace("&", "&amp;").replace("<", "&lt;")
