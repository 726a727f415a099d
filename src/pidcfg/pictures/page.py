"""Charts as one HTML file that needs nothing else: no script, no font, no network."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

from pidcfg.pictures.draw import svg
from pidcfg.pictures.style import plain

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.pictures.chart import Chart

POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'"
"""What a browser may load for the page: nothing."""
FIGURE_STYLE = """\
.chart { margin: 0 0 1.5rem; padding: .5rem; background: #fff; border: 1px solid #d0d0d0; border-radius: 6px; }
.chart svg { display: block; width: 100%; height: auto; max-width: 60rem; margin: 0 auto; }
.chart .narrow { display: none; }
@media (max-width: 640px) {
  .chart { padding: .25rem; }
  .chart .wide { display: none; }
  .chart .narrow { display: block; }
  .chart .narrow svg { max-width: 26rem; }
}
@media print {
  .chart { break-inside: avoid; border: 0; padding: 0; margin: 0 0 .5rem; }
  .chart .wide { display: block; }
  .chart .narrow { display: none; }
}
"""
"""For a page that holds `figures`: the wide drawing, or on a telephone the narrow one."""
STYLE = """\
:root { color-scheme: light dark; }
body { margin: 0 auto; padding: 1rem; max-width: 64rem; background: #f4f4f4; color: #1a1a1a;
  font: 16px/1.5 system-ui, 'Segoe UI', Roboto, Arial, sans-serif; overflow-wrap: anywhere; }
h1 { font-size: 1.5rem; line-height: 1.2; margin: .5rem 0 1rem; }
@media (prefers-color-scheme: dark) {
  body { background: #1b1d20; color: #ececec; }
  .chart { border-color: #444; }
}
@media (max-width: 640px) { body { padding: .5rem; } }
@media print {
  body { background: #fff; color: #000; max-width: none; padding: 0; }
  @page { size: A4; margin: 15mm; }
}
"""


def html(charts: Sequence[Chart], *, title: str, intro: Sequence[str] = ()) -> str:
    """A page with the charts; ``intro``: paragraphs of plain text above them."""
    paragraphs = "".join(f"<p>{escape(plain(text))}</p>\n" for text in intro)
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(plain(title))}</title>\n<style>\n{STYLE}{FIGURE_STYLE}</style>\n</head>\n<body>\n"
        f"<main>\n<h1>{escape(plain(title))}</h1>\n{paragraphs}{figures(charts)}</main>\n</body>\n</html>\n"
    )


def figures(charts: Sequence[Chart]) -> str:
    """The charts as parts of a page that has `FIGURE_STYLE`, each in a wide and a narrow drawing."""
    parts = []
    for chart in charts:
        wide, narrow = (svg([chart], title=chart.title, narrow=narrow) for narrow in (False, True))
        parts.append(
            f'<figure class="chart">\n<div class="wide">\n{wide}</div>\n'
            f'<div class="narrow">\n{narrow}</div>\n</figure>\n'
        )
    return "".join(parts)
