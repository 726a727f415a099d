"""Charts as a PNG: the shapes of `figure`, painted by matplotlib, which brings its own letters."""

from __future__ import annotations

import io
import logging
import warnings
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Literal

from pidcfg.pictures.figure import LOWER, WIDTH, Text, drawn
from pidcfg.pictures.layout import describe_charts

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from matplotlib.figure import Figure
    from matplotlib.path import Path as Outline
    from matplotlib.transforms import Transform
    from matplotlib.typing import RcKeyType

    from pidcfg.pictures.chart import Chart
    from pidcfg.pictures.figure import Path, Point

DRAWING_SETTINGS: dict[RcKeyType, Any] = {"font.family": ["DejaVu Sans"], "text.parse_math": False}
"""What differs from matplotlib's defaults; a user's own matplotlibrc has no say."""
POINTS, DPI = 72, 144
"""Of a picture and of a PNG, in an inch: 1382 pixels across."""
SNAPPED = 4
"""Most corners of what stands on whole pixels: axes, grids and bars, no signals."""
ANCHORS: dict[str, Literal["left", "center", "right"]] = {"start": "left", "middle": "center", "end": "right"}
"""By the library's names."""


def png(charts: Sequence[Chart], *, title: str) -> bytes:
    """All charts below each other as one PNG, drawn without global state or a display."""
    with _drawing():
        from matplotlib.figure import Figure
        from matplotlib.transforms import Affine2D

        (height, shapes), sink = drawn(charts, title), io.BytesIO()
        figure = Figure(figsize=(WIDTH / POINTS, height / POINTS), dpi=DPI)
        places = Affine2D().translate(0, -height).scale(DPI / POINTS, -DPI / POINTS)
        for shape in shapes:
            if isinstance(shape, Text):
                _write(figure, places, shape)
            else:
                _paint(figure, places, shape)
        metadata = {"Software": None, "Description": describe_charts(charts)}
        figure.savefig(sink, format="png", metadata=metadata)
    return sink.getvalue()


@contextmanager
def _drawing() -> Iterator[None]:
    """The library with its defaults and `DRAWING_SETTINGS`, silent about letters that its font lacks."""
    logging.getLogger("matplotlib").setLevel(logging.ERROR)
    import matplotlib as mpl

    with mpl.rc_context(), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        mpl.rcdefaults()
        mpl.rcParams.update(DRAWING_SETTINGS)
        yield


def _write(figure: Figure, places: Transform, text: Text) -> None:
    (x, y), lower = text.point, LOWER * text.size
    figure.text(
        x + lower * text.turned,
        y + lower * (not text.turned),
        text.text,
        size=text.size,
        color=text.colour,
        weight="bold" if text.bold else "normal",
        ha=ANCHORS[text.anchor],
        rotation=90 * text.turned,
        rotation_mode="anchor",
        transform=places,
    )


def _paint(figure: Figure, places: Transform, shape: Path) -> None:
    from matplotlib.patches import PathPatch

    patch = PathPatch(_outline(shape.parts, closed=bool(shape.fill)), facecolor="none", linewidth=0, joinstyle="round")
    figure.add_artist(patch)
    patch.set_transform(places)
    if shape.fill:
        patch.set_facecolor((shape.fill, shape.opacity))
    if shape.pen:
        dashes = tuple(dash / shape.pen.width for dash in shape.pen.dashes)
        patch.set(edgecolor=shape.pen.colour, linewidth=shape.pen.width, linestyle=(0, dashes) if dashes else "-")
    if shape.clip:
        patch.set_clip_path(_outline([shape.clip.corners], closed=True), places)
    patch.set_snap(len(shape.parts[0]) <= SNAPPED)


def _outline(parts: Sequence[Sequence[Point]], *, closed: bool) -> Outline:
    from matplotlib.path import Path as Outline

    return Outline.make_compound_path(
        *(Outline([*part, part[0]] if closed else [*part], closed=closed) for part in parts)
    )
