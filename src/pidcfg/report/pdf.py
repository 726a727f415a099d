"""A page as a PDF: printed by the Chromium, Chrome or Edge that is on the computer, without a window or a network."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

BROWSERS = (
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
    "chrome",
    "msedge",
    "microsoft-edge",
    "microsoft-edge-stable",
)
"""Names on the path."""
PLACES = (
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    "/Applications/Chromium.app/Contents/MacOS/Chromium",
    "/Applications/Microsoft Edge.app/Contents/MacOS/Microsoft Edge",
    r"C:\Program Files\Google\Chrome\Application\chrome.exe",
    r"C:\Program Files (x86)\Microsoft\Edge\Application\msedge.exe",
    r"C:\Program Files\Microsoft\Edge\Application\msedge.exe",
)
"""Where they are installed on systems that do not put them there."""
VARIABLE = "PIDCFG_BROWSER"
"""Of the environment: the browser to take."""
FLAGS = (
    "--headless",
    "--disable-gpu",
    "--disable-extensions",
    "--disable-background-networking",
    "--disable-sync",
    "--no-first-run",
    "--no-pdf-header-footer",
)
PATIENCE = 300
"""Seconds that a page may take."""
TIMES = re.compile(rb"(/(?:CreationDate|ModDate) \(D:)\d{14}")
EPOCH = b"20000101000000"
"""What stands for the times in every file, so that the same report gives the same bytes."""


class PdfError(Exception):
    """Why there is no PDF, and what to do."""


def browser() -> str:
    """The path of the browser that prints; raises `PdfError` where there is none."""
    wanted = os.environ.get(VARIABLE)
    names = (wanted,) if wanted else (*BROWSERS, *PLACES)
    path = next((path for path in map(shutil.which, names) if path), None)
    if path is not None:
        return path
    if wanted:
        raise PdfError(f"{VARIABLE} names {wanted!r}, which is no program here")
    raise PdfError(
        "a PDF is printed by Chromium, Chrome or Edge, and none of them is here; install one, name it in the variable "
        f"{VARIABLE}, or write report.html and print that from a browser"
    )


def pdf(html: str, path: str) -> bytes:
    """The page, printed by the browser at a path; raises `PdfError` with what the browser says where it fails."""
    with TemporaryDirectory(prefix="pidcfg-", ignore_cleanup_errors=True) as folder:
        page, target = Path(folder) / "report.html", Path(folder) / "report.pdf"
        page.write_text(html, "utf-8")
        root = ["--no-sandbox"] if sys.platform == "linux" and os.geteuid() == 0 else []
        own = [f"--user-data-dir={folder}/profile", f"--print-to-pdf={target}"]
        try:
            result = subprocess.run(  # noqa: S603 - a browser that the user has installed or named, and no shell
                [path, *FLAGS, *root, *own, page.as_uri()], capture_output=True, timeout=PATIENCE, check=False
            )
        except OSError as error:
            raise PdfError(f"{path} cannot be started: {error.strerror}") from None
        except subprocess.TimeoutExpired:
            raise PdfError(f"{path} has not printed the page within {PATIENCE} s") from None
        if not target.is_file():
            words = result.stderr.decode("utf-8", "replace").strip().splitlines()
            raise PdfError(f"{path} has printed nothing: {words[-1] if words else f'exit code {result.returncode}'}")
        return TIMES.sub(rb"\g<1>" + EPOCH, target.read_bytes())
