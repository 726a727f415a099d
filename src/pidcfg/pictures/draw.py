"""Charts as SVG and PNG, drawn with matplotlib on figures of its own, without global state or a display."""

from __future__ import annotations

import io
import logging
import warnings
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from pidcfg.pictures.words import described

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from matplotlib.typing import RcKeyType

    from pidcfg.pictures.chart import Chart

OWN: dict[RcKeyType, Any] = {
    "font.family": ["DejaVu Sans"],
    "text.parse_math": False,
    "svg.fonttype": "none",
    "svg.hashsalt": "pidcfg",
    "svg.image_inline": True,
    "axes.unicode_minus": False,
    "path.simplify": True,
    "path.simplify_threshold": 0.1,
}
"""What differs from matplotlib's defaults; a user's own matplotlibrc has no say."""
DPI = 144
"""Of a PNG: 1382 pixels across."""


def svg(charts: Sequence[Chart], *, title: str) -> str:
    """All charts below each other as one SVG, without an XML declaration: a file, or a part of a page.

    Its identifiers are its own, so that a page can hold several.
    """
    from pidcfg.pictures.figure import figure_of
    from pidcfg.pictures.svg import finished

    with _drawing():
        sink = io.StringIO()
        figure_of(charts, title).savefig(sink, format="svg", metadata={"Date": None})
    return finished(sink.getvalue(), title, described(charts))


def png(charts: Sequence[Chart], *, title: str) -> bytes:
    """All charts below each other as one PNG."""
    from pidcfg.pictures.figure import figure_of

    with _drawing():
        sink = io.BytesIO()
        metadata = {"Software": None, "Description": described(charts)}
        figure_of(charts, title).savefig(sink, format="png", dpi=DPI, metadata=metadata)
    return sink.getvalue()


@contextmanager
def _drawing() -> Iterator[None]:
    """The library with its defaults and `OWN`, silent about letters that its font lacks."""
    logging.getLogger("matplotlib").setLevel(logging.ERROR)
    import matplotlib as mpl

    with mpl.rc_context(), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        mpl.rcdefaults()
        mpl.rcParams.update(OWN)
        yield
