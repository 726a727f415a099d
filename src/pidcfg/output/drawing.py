"""Results as pictures: what `pidcfg.plot` returns."""

from __future__ import annotations

from base64 import b64encode
from typing import TYPE_CHECKING, Any, Literal

from pidcfg.output.arguments import ArgumentError
from pidcfg.output.findings import short_repr
from pidcfg.output.runs import CertifyResult, SimulateResult
from pidcfg.text.frozen import frozen
from pidcfg.text.references import Decision

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from pidcfg.pictures import Chart
    from pidcfg.text.diagnostics import Diagnostic
    from pidcfg.text.paths import Data

D1030 = Decision(
    1030,
    "a picture is drawn once, as shapes",
    "`pictures.figure` makes lines, surfaces and texts of a chart. An SVG prints them, and a PNG paints them by "
    "matplotlib, which is the extra `png` and needed for nothing else.",
    "One drawer has one set of looks. A smaller painter of SVG (resvg_py, 3 MB for 180) takes the letters of the "
    "computer: other ones on each, and in a container without fonts none.",
)
PictureFormat = Literal["svg", "png", "html"]
"""How a picture is written."""
Result = Any
"""A result of `simulate` or `certify` with its record, of `diff` or `convert` with its verdict."""

# --- Pictures: the charts of a result, drawn --------------------------------------------------------------------------


@frozen
class PlotResult:
    """A picture of a result."""

    __repr__ = short_repr

    format: PictureFormat
    data: bytes
    """What a file of it holds."""
    loops: tuple[str, ...]
    """What it shows, in this order."""
    findings: tuple[Diagnostic, ...] = ()
    """Of the result that is drawn."""

    @property
    def ok(self) -> bool:
        """There is a picture."""
        return bool(self.data)

    @property
    def text(self) -> str:
        """An svg or an html as text; raises `ValueError` for a png."""
        if self.format == "png":
            raise ValueError("a png is no text; take `data`")
        return self.data.decode()

    def _repr_html_(self) -> str:
        """What notebooks show."""
        from pidcfg.output.notebook import frame_of_page, image_html

        return frame_of_page(self.text) if self.format == "html" else image_html(self.format, self.data)

    def to_json(self) -> Data:
        """The picture, a png in base64."""
        text = b64encode(self.data).decode() if self.format == "png" else self.text
        return {"version": 1, "format": self.format, "loops": list(self.loops), "data": text}


def draw_result(result: Result, fmt: PictureFormat, loops: Collection[str], title: str | None) -> PlotResult:
    """The charts of a result in a format; raises `ArgumentError` where there is nothing to be drawn."""
    charts = charts_of(result, loops)
    heading = title if title is not None else heading_of(result)
    return PlotResult(
        fmt, _draw_charts(charts, fmt, heading), tuple(chart.loop for chart in charts), tuple(result.findings)
    )


def _draw_charts(charts: Sequence[Chart], fmt: PictureFormat, title: str) -> bytes:
    if fmt == "html":
        from pidcfg.pictures.page import render_page

        return render_page(charts, title=title).encode()
    if fmt == "svg":
        from pidcfg.pictures.figure import draw_svg

        return draw_svg(charts, title=title).encode()
    from pidcfg.pictures.figure import draw_png

    try:
        return draw_png(charts, title=title)
    except ImportError:
        cure = "install pidcfg[png], or take svg or html, which need nothing"
        raise ArgumentError(f"`format` is 'png', which matplotlib paints: {cure}", "format") from None


def charts_of(result: Any, loops: Collection[str] = ()) -> list[Chart]:
    """The charts of a result, of these ``loops`` alone; raises `ArgumentError` where it has none, or lacks a loop."""
    all_charts = _all_charts(result)
    if not all_charts:
        raise ArgumentError(f"`result` has nothing to be drawn: {_no_charts_reason(result)}", "result")
    drawn_loops = list(dict.fromkeys(chart.loop for chart in all_charts))
    if unknown := [loop for loop in loops if loop not in drawn_loops]:
        raise ArgumentError(f"`loops` has {unknown[0]!r}; there are {', '.join(drawn_loops)}", "loops")
    return [chart for chart in all_charts if not loops or chart.loop in loops]


def _all_charts(result: Any) -> list[Chart]:
    """By the kind of the result."""
    if isinstance(result, SimulateResult):
        from pidcfg.study.outcome import charts_of as charts_of_run

        return charts_of_run(result.outcome)
    if isinstance(result, CertifyResult):
        from pidcfg.study.certification.certify import charts_of as charts_of_batch

        return charts_of_batch(result.outcome)
    return [loop.chart for loop in getattr(result, "verified", None) or ()]


def _no_charts_reason(result: Any) -> str:
    if isinstance(result, SimulateResult | CertifyResult):
        return "it has not run; see `findings`" if not _has_run(result) else "run it with record=True"
    if hasattr(result, "verified"):
        return "run both sides with verify=True"
    return "plot takes a result of simulate, certify, diff or convert"


def _has_run(result: SimulateResult | CertifyResult) -> bool:
    report = getattr(result, "report", None)
    return report is not None or getattr(result, "certification", None) is not None


def heading_of(result: Any) -> str:
    """What a picture of a result is called."""
    for part in (getattr(result, "report", None), getattr(result, "certification", None)):
        if part is not None:
            return str(part.scenario)
    return " → ".join(str(getattr(result, side, "")) for side in ("before", "after") if hasattr(result, side))
