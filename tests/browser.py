"""A headless Chromium for tests of what people open in a browser.

Without one the tests are skipped and say so; where the variable CI is set they fail instead, since there it must be.
"""

from __future__ import annotations

import os
import shutil
from contextlib import contextmanager
from dataclasses import dataclass, field

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "msedge")
QUIET = (
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)
IN_CI = bool(os.environ.get("CI"))
"""Asked for before the tests' surroundings are made the same everywhere."""
WIDE, NARROW = 1280, 400


@dataclass
class Seen:
    """What a page did while it was open."""

    page: object
    errors: list[str] = field(default_factory=list)
    requests: list[str] = field(default_factory=list)


@pytest.fixture(scope="session")
def browser():
    """A Chromium that is on this computer; it never asks the network for one."""
    sync_api = pytest.importorskip("playwright.sync_api")
    path = next((found for found in map(shutil.which, NAMES) if found), None)
    if path is None:
        told = f"no browser: none of {', '.join(NAMES)} is on the PATH"
        (pytest.fail if IN_CI else pytest.skip)(told)
    with sync_api.sync_playwright() as playwright:
        found = playwright.chromium.launch(executable_path=path, args=list(QUIET))
        yield found
        found.close()


@contextmanager
def opened(browser, path, width=WIDE, scheme="light"):
    """A file in a page of its own, with what it asked for and complained about."""
    page = browser.new_page(viewport={"width": width, "height": 900}, color_scheme=scheme)
    seen = Seen(page)
    page.on("console", lambda message: seen.errors.append(message.text) if message.type == "error" else None)
    page.on("pageerror", lambda error: seen.errors.append(str(error)))
    page.on("dialog", lambda dialog: (seen.errors.append(dialog.message), dialog.dismiss()))
    page.on("request", lambda request: seen.requests.append(request.url))
    page.goto(path.as_uri())
    try:
        yield seen
    finally:
        page.close()


BEYOND = """() => [...document.querySelectorAll('body *')]
    .filter(e => !e.closest('.scroll') && !e.closest('svg') && e.getClientRects().length)
    .filter(e => e.getBoundingClientRect().right > innerWidth + 1 || e.getBoundingClientRect().left < -1)
    .map(e => e.tagName + '.' + e.className + ' ' + e.textContent.slice(0, 40))"""
"""Elements that reach beyond the window, unless they stand in a part that scrolls by itself."""


def width_of(page):
    """How wide the page is, scrolled or not."""
    return page.evaluate("document.documentElement.scrollWidth")
