"""Charts as one HTML file that needs nothing else: no script, no font, no network."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.pictures.chart import Chart


def html(charts: Sequence[Chart], *, title: str, intro: Sequence[str] = ()) -> str:
    """A page with the charts; ``intro``: paragraphs of plain text above them."""
    raise NotImplementedError
