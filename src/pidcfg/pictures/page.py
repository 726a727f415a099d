"""Charts as one HTML file that needs nothing else: its script stands in it, and no font or network is asked for."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

from pidcfg.pictures.style import plain
from pidcfg.pictures.trend import POLICY, SCRIPT, STYLE, figures

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.pictures.chart import Chart

PAGE_STYLE = """\
:root { color-scheme: light dark; }
body { margin: 0 auto; padding: 1rem; max-width: 66rem; background: #f4f4f4; color: #1a1a1a;
  font: 16px/1.5 system-ui, 'Segoe UI', Roboto, Arial, sans-serif; overflow-wrap: anywhere; }
h1 { font-size: 1.5rem; line-height: 1.2; margin: .5rem 0 1rem; }
@media (prefers-color-scheme: dark) { body { background: #0f1317; color: #ececec; } }
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
        f"<title>{escape(plain(title))}</title>\n<style>\n{STYLE}{PAGE_STYLE}</style>\n</head>\n<body>\n"
        f"<main>\n<h1>{escape(plain(title))}</h1>\n{paragraphs}{figures(charts)}</main>\n"
        f"<script>{SCRIPT}</script>\n</body>\n</html>\n"
    )
