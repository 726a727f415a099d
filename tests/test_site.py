"""The documentation site in a real browser: complete, quiet, offline, readable on a phone."""

from __future__ import annotations

import functools
import subprocess
import sys
import threading
from contextlib import contextmanager
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest

pytestmark = pytest.mark.long("Sphinx builds the whole site once, as a reader gets it")

ROOT = Path(__file__).parents[1]
NARROW, WIDE = 400, 1280
BEYOND = (
    "Math.max(...[document.documentElement, document.querySelector('article')].map(e => e.scrollWidth - e.clientWidth))"
)
"""How far the page, or its text inside it, is wider than there is room."""
AROUND_HEADINGS = 8
"""The theme lets a heading stand out by this much, to colour it when it is the target of a link."""


class Quiet(SimpleHTTPRequestHandler):
    """Files of a folder, without a line for each request."""

    def log_message(self, format, *args):  # noqa: A002 - the base class's name
        pass


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The site as `python tasks.py docs` builds it: a warning is an error."""
    for package in ("sphinx", "furo", "myst_parser"):
        pytest.importorskip(package)
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-d", str(folder / "doctrees"), "docs"]
    result = subprocess.run([*command, str(folder / "site")], cwd=ROOT, capture_output=True, check=False, text=True)
    assert result.returncode == 0, result.stderr
    return folder / "site"


@pytest.fixture(scope="module")
def address(site):
    """The site on a server of this computer."""
    server = ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=str(site)))
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    yield f"http://127.0.0.1:{server.server_port}"
    server.shutdown()
    thread.join()
    server.server_close()


def is_left(request):
    """Whether the browser gave up an icon of a page that it has left: it asks for them late, and for itself."""
    return request.failure == "net::ERR_ABORTED" and request.url.endswith("favicon.svg")


@contextmanager
def page_of(browser, width, complaints, address):
    """A page of this width that notes what the console says, what does not arrive, and what comes from elsewhere."""
    page = browser.new_page(viewport={"width": width, "height": 900})
    page.on("console", lambda said: complaints.append(said.text) if said.type in {"error", "warning"} else None)
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.on("requestfailed", lambda gone: None if is_left(gone) else complaints.append(f"failed: {gone.url}"))
    page.on("response", lambda got: complaints.append(f"{got.status}: {got.url}") if got.status >= 400 else None)
    page.on(
        "request",
        lambda request: (
            None if request.url.startswith((address, "data:")) else complaints.append(f"elsewhere: {request.url}")
        ),
    )
    yield page
    page.close()


def test_every_page_of_the_folder_is_in_the_site_and_in_its_list(site):
    index = (site / "index.html").read_text("utf-8")
    for path in (ROOT / "docs").glob("*.md"):
        assert (site / f"{path.stem}.html").is_file(), path.name
        assert path.stem == "index" or f'href="{path.stem}.html"' in index, path.name


def test_the_schemas_are_there_to_be_downloaded(site):
    for path in (ROOT / "docs" / "schemas").iterdir():
        assert (site / "schemas" / path.name).read_bytes() == path.read_bytes()


def test_pages_are_quiet_and_never_wider_than_the_screen(browser, site, address):
    complaints = []
    with page_of(browser, NARROW, complaints, address) as page:
        for path in sorted(site.glob("*.html")):
            page.goto(f"{address}/{path.name}")
            for width in (NARROW, WIDE):
                page.set_viewport_size({"width": width, "height": 900})
                if page.evaluate(BEYOND) > AROUND_HEADINGS:
                    complaints.append(f"{path.name} is wider than {width}")
    assert not complaints


def test_wide_tables_and_code_scroll_inside_themselves(browser, address):
    with page_of(browser, NARROW, [], address) as page:
        for name, what in (("dl06-registers", ".table-wrapper"), ("tutorial", ".highlight pre")):
            page.goto(f"{address}/{name}.html")
            boxes = page.eval_on_selector_all(what, "all => all.map(e => [e.scrollWidth, e.clientWidth])")
            assert any(inside > outside for inside, outside in boxes)
            assert all(outside <= NARROW for _, outside in boxes)


def test_search_finds_without_a_network(browser, address):
    complaints = []
    with page_of(browser, WIDE, complaints, address) as page:
        page.goto(f"{address}/index.html")
        page.fill(".sidebar-search", "ultimate cycle")
        page.press(".sidebar-search", "Enter")
        page.wait_for_selector("ul.search li a")
        found = page.eval_on_selector_all("ul.search li a", "all => all.map(a => a.getAttribute('href'))")
    assert any(link.startswith("tuning.html") for link in found)
    assert not complaints


def test_the_site_works_from_a_folder_too(browser, site):
    complaints = []
    with page_of(browser, WIDE, complaints, site.as_uri()) as page:
        page.goto(f"{site.as_uri()}/index.html")
        page.click("text=first hour")
        assert page.title().startswith("First hour")
    assert not complaints


def test_dark_mode_is_readable(browser, address):
    context = browser.new_context(color_scheme="dark")
    page = context.new_page()
    page.goto(f"{address}/index.html")
    colours = page.evaluate("[getComputedStyle(document.body).color, getComputedStyle(document.body).backgroundColor]")
    context.close()
    light, dark = ([int(n) for n in colour[4:-1].split(",")[:3]] for colour in colours)
    assert min(light) > 150
    assert max(dark) < 60
