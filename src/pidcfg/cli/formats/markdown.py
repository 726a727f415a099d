"""Format ``markdown``: tables for the comments of pull requests, which commands that compare write."""

from __future__ import annotations

from pidcfg.cli.formats.format import Format, Kind

FORMAT = Format("comments of pull requests", "md", Kind.LINES)


def cell(text: str) -> str:
    """Text that stays in its cell of a Markdown table."""
    return text.replace("|", "\\|").replace("\n", " ").replace("<", "&lt;")
