"""One HTML file that carries Python, pidcfg and the files of a scenario: it opens by a double click."""

from __future__ import annotations

import base64
import hashlib
import io
import json
import zipfile
from html import escape
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING

import pidcfg
from pidcfg.desk.runtime import own_modules, pack
from pidcfg.pictures.layout import plain
from pidcfg.pictures.page import SCRIPT, STYLE
from pidcfg.text.references import Decision

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pidcfg.desk.runtime import Runtime
    from pidcfg.desk.session import Session

D1002 = Decision(
    1002,
    "what a what-if page may do",
    "Its policy lets it run its own scripts, by their hashes, modules and a worker from blobs, and WebAssembly; it "
    "lets it load nothing, send nothing and show no frame. 'unsafe-eval' is in it, since Pyodide makes a few functions "
    "from texts of its own.",
    "The files of a plant stay in the page. A policy cannot be stricter from file://, where scripts have no address.",
)
HERE = Path(__file__).parent
LEFT_OUT = (
    *("pidcfg/cli/", "pidcfg/live/", "pidcfg/__main__.py", "pidcfg/desk/page.py", "pidcfg/desk/runtime.py"),
    *("pidcfg/output/report/", "pidcfg/output/explanation/", "pidcfg/study/certification/"),
)
"""Of pidcfg: what a what-if page does not ask for."""
EPOCH = (1980, 1, 1, 0, 0, 0)


def whatif_page(session: Session, runtime: Runtime) -> str:
    """The page of a scenario that runs."""
    scenario, against, config = session.name, session.against, session.config
    sides = "as it is now (solid) against as filed (dashed)" if against is None else f"solid, against {against}, dashed"
    intro = f"{scenario} runs {config}: {sides}. The engine runs the words of the PLC."
    versions = (
        f"pidcfg {pidcfg.__version__}, Pyodide {runtime.versions['pyodide']}, Python {runtime.versions['python']}"
    )
    data = {"scenario": scenario, "files": session.files, "against": against}
    title = str(session.model.scenario)
    shown = {"title": title, "intro": intro, "config": config, "versions": versions}
    middle = Template(_text("whatif.html")).substitute({key: escape(plain(text)) for key, text in shown.items()})
    return page(f"What if: {title}", middle, (_text("whatif.css"),), (SCRIPT, _text("whatif.js")), data, runtime)


def page(
    title: str,
    body: str,
    styles: tuple[str, ...],
    scripts: tuple[str, ...],
    data: Mapping[str, object],
    runtime: Runtime,
) -> str:
    """A page with a worker: HTML of its body, scripts that may run, and plain data for them."""
    hashes = " ".join(f"'{_hash(script)}'" for script in scripts)
    policy = (
        f"default-src 'none'; script-src {hashes} 'unsafe-eval' 'wasm-unsafe-eval' blob:; worker-src blob:; "
        "style-src 'unsafe-inline'; img-src data:; connect-src 'none'; base-uri 'none'; form-action 'none'"
    )
    carried = json.dumps(data, ensure_ascii=True).replace("<", "\\u003c")
    blocks = "".join(f"<script>{script}</script>\n" for script in scripts)
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(plain(title))}</title>\n<style>\n{STYLE}{''.join(styles)}</style>\n</head>\n"
        f'<body data-state="starting">\n{body}'
        f'<script type="application/json" id="files">{carried}</script>\n'
        f'<script type="text/plain" id="worker">{_text("worker.js")}</script>\n'
        f'<script type="text/plain" id="python">{base64.b64encode(runtime.python).decode()}</script>\n'
        f'<script type="text/plain" id="pidcfg">{base64.b64encode(own(runtime)).decode()}</script>\n'
        f"{blocks}</body>\n</html>\n"
    )


def own(runtime: Runtime) -> bytes:
    """The installed pidcfg as a part of a page: a zip that is stored as it is, since everything is packed once."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name, data in own_modules(runtime, Path(pidcfg.__file__).parent, LEFT_OUT).items():
            archive.writestr(zipfile.ZipInfo(name, EPOCH), data)
    return pack({"pidcfg.zip": buffer.getvalue()})


def _text(name: str) -> str:
    return (HERE / name).read_text("utf-8")


def _hash(script: str) -> str:
    return "sha256-" + base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
