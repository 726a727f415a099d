"""Charts as SVG and PNG: the only place that draws with matplotlib, on figures of its own without global state."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.pictures.chart import Chart


class MissingError(Exception):
    """The library that draws is not installed."""


def svg(charts: Sequence[Chart], *, title: str, narrow: bool = False) -> str:
    """All charts below each other as one SVG, without an XML declaration: a file, or a part of a page.

    Its identifiers are its own, so that a page can hold several. ``narrow``: for the width of a telephone.
    """
    raise NotImplementedError


def png(charts: Sequence[Chart], *, title: str) -> bytes:
    """All charts below each other as one PNG."""
    raise NotImplementedError
