"""The commissioning report in a real browser: on a screen, on a telephone, and printed."""

from __future__ import annotations

import io
import re
from itertools import pairwise
from pathlib import Path

import pytest
from click.testing import CliRunner

from browser import BEYOND, NARROW, WIDE, opened, width_of
from pidcfg.cli.main import cli

EXAMPLES = Path(__file__).parents[1] / "examples"
SCENARIOS = ("dl06/reactor", "click/tank", "ezlogix/oven", "nextopid/autotune", "dpide/oven")
LOOPS = ("FIC-102", "TIC-101", "LIC-103", "TANK1", "OVEN1", "EXHAUST", "TIC_1", "OVEN")
A4 = (595.28, 841.89)
PRINTABLE = 680
"""Pixels between the margins of an A4 page: 180 mm."""
CONTRAST = """() => {
  const parts = c => (c.match(/[\\d.]+/g) || []).map(Number);
  const light = c => { const [r, g, b] = parts(c).slice(0, 3).map(v => v / 255)
    .map(v => v <= .04045 ? v / 12.92 : ((v + .055) / 1.055) ** 2.4); return .2126 * r + .7152 * g + .0722 * b; };
  const behind = e => { for (; e; e = e.parentElement) { const c = getComputedStyle(e).backgroundColor, p = parts(c);
    if (p.length < 4 || p[3] > 0) return c; } return 'rgb(255, 255, 255)'; };
  const poor = [];
  for (const e of document.querySelectorAll('body *')) {
    if (e.closest('svg') || ![...e.childNodes].some(n => n.nodeType === 3 && n.data.trim())) continue;
    const [a, b] = [light(getComputedStyle(e).color), light(behind(e))].sort((x, y) => y - x);
    if ((a + .05) / (b + .05) < 4.5) poor.push(e.tagName + '.' + e.className + ' ' + e.textContent.slice(0, 30));
  }
  return poor;
}"""

HOSTILE = """\
pidcfg: 1
vendor: click
name: "<script>window.pwned = 1</script>"
loops:
  - name: مضخة-7
    description: "=1+1 \\"quoted\\" 'single' <img src=x onerror=window.pwned=1> & 🔥 {{ 7 * 7 }} LONGWORD"
    bits: C101
    integers: DS101
    floats: DF101
    action: direct
    action_verified: true
    sample_rate: 500 ms
    tuning: {proportional_gain: 2, reset_time: 50}
    pv: {range: [0, 100], unit: "</td><script>window.pwned=1</script>"}
    setpoint: {value: 50}
    output: {unit: "%"}
""".replace("LONGWORD", "W" * 400)
PROJECT = '"}</style><script>window.pwned=1</script>\\'


def made(folder, *args):
    """A report in a folder."""
    path = folder / "report.html"
    result = CliRunner().invoke(cli, ["report", *args, "-o", str(path), "-q"])
    assert not result.exception, result.output
    return path


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    """One report on an example of every vendor."""
    names = [str(EXAMPLES / f"{name}.scenario.yaml") for name in SCENARIOS]
    return made(tmp_path_factory.mktemp("report"), *names, "--project", "Works 7", "--document", "PID-0042")


@pytest.fixture(scope="module")
def hostile(tmp_path_factory):
    """A report whose names and texts are made to break it."""
    folder = tmp_path_factory.mktemp("hostile")
    (folder / "hostile.yaml").write_text(HOSTILE, "utf-8")
    return made(folder, str(folder / "hostile.yaml"), "--project", PROJECT, "--author", "<b>bold</b>", "--exit-zero")


@pytest.mark.parametrize("width", [WIDE, NARROW])
def test_the_page_opens_alone_and_fits_the_window(browser, report, width):
    with opened(browser, report, width) as seen:
        assert seen.errors == []
        assert seen.requests == [report.as_uri()]
        assert width_of(seen.page) <= width
        assert seen.page.evaluate(BEYOND) == []


@pytest.mark.parametrize("width", [WIDE, NARROW])
def test_every_loop_has_one_chart_at_every_width(browser, report, width):
    with opened(browser, report, width) as seen:
        boxes = [chart.bounding_box() for chart in seen.page.query_selector_all("figure.chart")]
        assert len(boxes) == len(LOOPS)
        assert all(box["width"] > width / 2 and box["height"] > 100 for box in boxes)
        panel = seen.page.locator(".panel svg").first.bounding_box()
        assert panel["height"] > 100
        assert panel["width"] > width / 2
        size = "e => parseFloat(getComputedStyle(e).fontSize)"
        assert seen.page.locator(".times .x").first.evaluate(size) >= 12, "letters keep their size"


def test_no_word_is_broken_on_a_telephone(browser, report):
    with opened(browser, report, NARROW) as seen:
        broken = """() => [...document.querySelectorAll('.settings td, .settings code, dt, dd, .tag, h1, h2, h3')]
            .filter(e => e.getClientRects().length && e.children.length === 0)
            .flatMap(e => { const node = e.firstChild; if (!node || node.nodeType !== 3) return [];
              return [...node.data.matchAll(/[A-Za-z]{3,}/g)].filter(m => { const r = document.createRange();
                r.setStart(node, m.index); r.setEnd(node, m.index + m[0].length);
                return new Set([...r.getClientRects()].map(q => Math.round(q.top))).size > 1; }).map(m => m[0]); })"""
        assert seen.page.evaluate(broken) == []


def test_the_page_can_be_read_without_seeing_it(browser, report):
    with opened(browser, report) as seen:
        page = seen.page
        assert page.evaluate("document.documentElement.lang") == "en"
        levels = page.evaluate("[...document.querySelectorAll('h1,h2,h3,h4,h5,h6')].map(h => +h.tagName[1])")
        assert levels[0] == 1
        assert levels.count(1) == 1
        assert all(below - above <= 1 for above, below in pairwise(levels))
        assert page.evaluate("document.querySelectorAll('th:not([scope])').length") == 0
        assert page.evaluate("[...document.querySelectorAll('table')].filter(t => !t.caption).length") == 0
        broken = "[...document.querySelectorAll('a')].filter(a => !document.getElementById(a.hash.slice(1))).length"
        assert page.evaluate(broken) == 0
        assert page.evaluate("[...document.querySelectorAll('[id]')].length") == page.evaluate(
            "new Set([...document.querySelectorAll('[id]')].map(e => e.id)).size"
        )
        assert page.evaluate("document.querySelectorAll('script').length") == 1


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_every_text_stands_out_from_what_is_behind_it(browser, report, scheme):
    with opened(browser, report, scheme=scheme) as seen:
        assert seen.page.evaluate(CONTRAST) == []


def test_printed_it_is_a_document_on_a4(browser, report):
    with opened(browser, report) as seen:
        pdf = pytest.importorskip("pypdf").PdfReader(io.BytesIO(seen.page.pdf(prefer_css_page_size=True)))
    sizes = {(round(float(page.mediabox.width)), round(float(page.mediabox.height))) for page in pdf.pages}
    assert all(abs(w - A4[0]) < 1 and abs(h - A4[1]) < 1 for w, h in sizes)
    texts = [re.sub(r"\s+", " ", page.extract_text()) for page in pdf.pages]
    assert len(texts) <= 2 * len(SCENARIOS) + len(LOOPS) + 6
    for number, text in enumerate(texts, start=1):
        assert f"Page {number} of {len(texts)}" in text
        assert "Works 7" in text
        assert "PID-0042" in text
    for loop in LOOPS:
        (sheet,) = [text for text in texts if f"Loop {loop} " in text]
        assert sum(f"Commissioning of {name} " in sheet for name in LOOPS) == 1
        assert f"Commissioning of {loop} " in sheet, "the sheet ends on the page on which it begins"


def test_nothing_is_cut_off_on_paper(browser, report):
    with opened(browser, report, PRINTABLE) as seen:
        seen.page.emulate_media(media="print")
        assert width_of(seen.page) <= PRINTABLE
        beyond = BEYOND.replace("!e.closest('.scroll') && ", "")
        assert seen.page.evaluate(beyond) == []


@pytest.mark.parametrize("width", [WIDE, NARROW])
def test_hostile_texts_are_shown_as_they_are(browser, hostile, width):
    with opened(browser, hostile, width) as seen:
        page = seen.page
        assert seen.errors == []
        assert seen.requests == [hostile.as_uri()]
        assert page.evaluate("typeof window.pwned") == "undefined"
        assert page.evaluate("document.querySelectorAll('img, b b, script[src]').length") == 0
        assert page.evaluate("document.querySelectorAll('script').length") == 1
        text = page.inner_text("body")
        for shown in (
            "<script>window.pwned = 1</script>",
            "مضخة-7",
            "🔥",
            "{{ 7 * 7 }}",
            "<b>bold</b>",
            "onerror=",
            "W" * 400,
            "</td><script>",
            PROJECT,
        ):
            assert shown in text, shown
        assert width_of(page) <= width


def test_a_hostile_project_is_printed_as_it_is(browser, hostile):
    with opened(browser, hostile, PRINTABLE) as seen:
        pdf = pytest.importorskip("pypdf").PdfReader(io.BytesIO(seen.page.pdf(prefer_css_page_size=True)))
        seen.page.emulate_media(media="print")
        assert width_of(seen.page) <= PRINTABLE
    assert "</style><script>window.pwned=1</script>\\" in pdf.pages[1].extract_text()
