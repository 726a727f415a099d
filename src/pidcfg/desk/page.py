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
    from collections.abc import Iterable, Mapping

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
NOT_PLAYED = ("pidcfg/cli/", "pidcfg/live/", "pidcfg/__main__.py", "pidcfg/output/report/")
"""What the playground does not ask for."""
SCENARIO = ".scenario.yaml"
FIRST = "reactor.yaml"
"""The example that the playground begins with."""
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
    scripts = SCRIPT, text_of("desk.js"), text_of("whatif.js")
    middle = Template(text_of("whatif.html")).substitute({key: escape(plain(text)) for key, text in shown.items()})
    return page(
        f"What if: {title}", middle, (text_of("whatif.css"),), scripts, data, runtime.python, own(runtime, LEFT_OUT)
    )


def playground_page(examples: Iterable[Path], runtime: Runtime) -> str:
    """The page, with the examples in these folders."""
    found = [example for folder in examples for example in examples_in(folder)]
    data = {"examples": found, "first": FIRST}
    shown = {
        "version": pidcfg.__version__,
        "pyodide": runtime.versions["pyodide"],
        "python": runtime.versions["python"],
    }
    body = Template(text_of("playground.html")).substitute(shown)
    styles = text_of("whatif.css"), text_of("playground.css")
    scripts = SCRIPT, text_of("desk.js"), text_of("playground.js")
    return page("pidcfg playground", body, styles, scripts, data, runtime.python, own(runtime, NOT_PLAYED))


def examples_in(folder: Path) -> list[dict[str, object]]:
    """Each scenario of a folder with its configuration, and configurations that have none; with accepted runs."""
    texts = {path.name: path.read_text("utf-8") for path in sorted(folder.glob("*.yaml"))}
    scenarios = [(pidcfg.load(texts[name]).document.data or {}, name) for name in texts if name.endswith(SCENARIO)]
    pairs = [(str(data["config"]), name) for data, name in scenarios]
    run = {config for config, _ in pairs}
    pairs += [(name, name.replace(".yaml", SCENARIO)) for name in texts if name not in run and SCENARIO not in name]
    rows: list[dict[str, object]] = []
    for config, scenario in sorted(pairs):
        accepted = folder / scenario.replace(SCENARIO, ".accepted.json")
        others = {accepted.name: accepted.read_text("utf-8")} if accepted.is_file() else {}
        several = [name for one, name in pairs if one == config][1:]
        title = f"{folder.name}/{config}" + (f", {scenario.removesuffix(SCENARIO)}" if several else "")
        files = {config: texts[config], scenario: texts.get(scenario, ""), **others}
        rows.append({"title": title, "config": config, "scenario": scenario, "files": files})
    return rows


def page(
    title: str,
    body: str,
    styles: tuple[str, ...],
    scripts: tuple[str, ...],
    data: Mapping[str, object],
    *packed: bytes,
) -> str:
    """A page with a worker: HTML of its body, scripts that may run, plain data for them, packed Python and pidcfg."""
    python, own_code = (base64.b64encode(one).decode() for one in packed)
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
        f'<script type="text/plain" id="worker">{text_of("worker.js")}</script>\n'
        f'<script type="text/plain" id="python">{python}</script>\n'
        f'<script type="text/plain" id="pidcfg">{own_code}</script>\n'
        f"{blocks}</body>\n</html>\n"
    )


QUICKLY = 7
"""Compression of a page: a percent larger than the best, and made in a third of the time."""


def own(runtime: Runtime, left_out: tuple[str, ...]) -> bytes:
    """The installed pidcfg as a part of a page: a zip that is stored as it is, since everything is packed once."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name, data in own_modules(runtime, Path(pidcfg.__file__).parent, left_out).items():
            archive.writestr(zipfile.ZipInfo(name, EPOCH), data)
    return pack({"pidcfg.zip": buffer.getvalue()}, QUICKLY)


def text_of(name: str) -> str:
    """A file of this folder."""
    return (HERE / name).read_text("utf-8")


def _hash(script: str) -> str:
    return "sha256-" + base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
