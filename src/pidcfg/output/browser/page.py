"""One HTML file that carries Python, pidcfg and the files of a scenario, and Python for the browser, which it needs.

The page opens by a double click; `python tasks.py whatif-runtime` makes the file with Python.
"""

from __future__ import annotations

import base64
import gzip
import hashlib
import io
import json
import zipfile
from html import escape
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING

import pidcfg
from pidcfg.about import VERSION
from pidcfg.pictures.layout import plain_text
from pidcfg.pictures.page import SCRIPT, STYLE
from pidcfg.text.frozen import frozen
from pidcfg.text.references import Decision
from pidcfg.text.store import cache_folder

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from pidcfg.output.browser.session import Session

# --- Python for the browser: one file beside pidcfg -------------------------------------------------------------------

D1001 = Decision(
    1001,
    "Python for the browser is made beside pidcfg, and is no part of it",
    "Pyodide and six wheels (13 MB) are neither in the repository nor in the wheel: `python tasks.py whatif-runtime` "
    "collects them from npm and PyPI by locked versions and hashes, compiles them, and writes one file into the user's "
    "cache and into build/. `pidcfg whatif` takes it from there, or by `--runtime FILE`, and needs no network.",
    "Who never makes such a page should not load it with every installation, and a file can be carried to a PC that "
    "has no network.",
)
RUNTIME_FILE = "whatif-runtime.zip"
CACHE_FOLDER = "whatif"
"""In the user's cache."""
FORMAT_VERSION = 1
MANIFEST_NAME = "manifest.json"
PYTHON_NAME = "python.gz"
"""Python, its library and the wheels, packed by `pack_files`."""
STARTER_FOLDER = "pidcfg/cli/starters/"
"""What `convert` reads of a part that is left out."""
SOURCES_READ = ("pidcfg/schemas/",)
"""Modules whose sources are read by pidcfg itself: what stands beside a key is its explanation."""
MAKE_HINT = (
    "in a clone of pidcfg, 'python tasks.py whatif-runtime' makes it (npm, PyPI and Node are needed for that once)"
)


class RuntimeFileError(ValueError):
    """A file that is no such runtime, or not there: why, and what to do."""


@frozen
class Runtime:
    """Python for the browser, packed, and compiled modules of pidcfg by the SHA-256 of their sources."""

    versions: dict[str, str]
    python: bytes
    compiled: dict[str, bytes]

    @property
    def tag(self) -> str:
        """What the names of compiled modules have in them: ``cpython-314``."""
        return "cpython-" + "".join(self.versions["python"].split(".")[:2])


def runtime_path() -> Path:
    """Where the file is looked for; raises `OSError` where there can be no cache."""
    return cache_folder(CACHE_FOLDER) / RUNTIME_FILE


def read_runtime(path: Path) -> Runtime:
    """The file; raises `RuntimeFileError`."""
    try:
        with zipfile.ZipFile(path) as archive:
            manifest = json.loads(archive.read(MANIFEST_NAME))
            if manifest.get("format") != FORMAT_VERSION:
                raise RuntimeFileError(f"{path} is of another version of pidcfg; {MAKE_HINT} anew")
            python = archive.read(PYTHON_NAME)
            names = [name for name in archive.namelist() if name.startswith("compiled/")]
            compiled = {Path(name).stem: archive.read(name) for name in names}
    except FileNotFoundError:
        raise RuntimeFileError(f"there is no Python for the browser in {path}; {MAKE_HINT}") from None
    except (OSError, KeyError, ValueError, zipfile.BadZipFile) as error:
        if isinstance(error, RuntimeFileError):
            raise
        raise RuntimeFileError(f"{path} is no file of Python for the browser ({error}); {MAKE_HINT}") from None
    return Runtime(manifest["versions"], python, compiled)


def runtime_entries(versions: dict[str, str], parts: dict[str, bytes], compiled: dict[str, bytes]) -> dict[str, bytes]:
    """The entries of such a file."""
    manifest = json.dumps({"format": FORMAT_VERSION, "versions": versions}, indent=1).encode()
    modules = {f"compiled/{name}.pyc": data for name, data in sorted(compiled.items())}
    return {MANIFEST_NAME: manifest, PYTHON_NAME: pack_files(parts), **modules}


def pack_files(parts: dict[str, bytes], level: int = 9) -> bytes:
    """Files for the worker: the length of a list of names and sizes, the list, and the contents, compressed."""
    rows = json.dumps([[name, len(data)] for name, data in parts.items()]).encode()
    return gzip.compress(len(rows).to_bytes(4, "big") + rows + b"".join(parts.values()), level, mtime=0)


def package_files(runtime: Runtime, package: Path, excluded: tuple[str, ...]) -> dict[str, bytes]:
    """The files of the installed package, compiled where the runtime knows them, without some of its parts."""
    files = {}
    for path in sorted(package.rglob("*")):
        name = path.relative_to(package.parent).as_posix()
        is_excluded = name.startswith(excluded) and not name.startswith(STARTER_FOLDER)
        if not path.is_file() or "__pycache__" in path.parts or is_excluded:
            continue
        data = path.read_bytes()
        bytecode = runtime.compiled.get(hashlib.sha256(data).hexdigest()) if path.suffix == ".py" else None
        if bytecode is None or name.startswith(SOURCES_READ):
            files[name] = data
        if bytecode is not None and name.startswith(SOURCES_READ):
            folder, _, file = name.rpartition("/")
            files[f"{folder}/__pycache__/{file.removesuffix('.py')}.{runtime.tag}.pyc"] = bytecode
        elif bytecode is not None:
            files[f"{name}c"] = bytecode
    return files


# --- Pages that carry it ----------------------------------------------------------------------------------------------

D1002 = Decision(
    1002,
    "what a what-if page may do",
    "Its policy lets it run its own scripts, by their hashes, modules and a worker from blobs, and WebAssembly; it "
    "lets it load nothing, send nothing and show no frame. 'unsafe-eval' is in it, since Pyodide makes a few functions "
    "from texts of its own.",
    "The files of a plant stay in the page. A policy cannot be stricter from file://, where scripts have no address.",
)
HTML_FOLDER = Path(__file__).parent
WHATIF_EXCLUDES = (
    *("pidcfg/cli/", "pidcfg/live/", "pidcfg/__main__.py", "pidcfg/output/browser/page.py"),
    *("pidcfg/output/report/", "pidcfg/output/explanation/", "pidcfg/study/certification/"),
)
"""Of pidcfg: what a what-if page does not ask for."""
PLAYGROUND_EXCLUDES = ("pidcfg/cli/", "pidcfg/live/", "pidcfg/__main__.py", "pidcfg/output/report/")
"""What the playground does not ask for."""
SCENARIO_ENDING = ".scenario.yaml"
FIRST_EXAMPLE = "reactor.yaml"
"""The example that the playground begins with."""
ZIP_TIME = (1980, 1, 1, 0, 0, 0)


def whatif_page(session: Session, runtime: Runtime) -> str:
    """The page of a scenario that runs."""
    scenario, against, config = session.name, session.other_config, session.config
    sides = "as it is now (solid) against as filed (dashed)" if against is None else f"solid, against {against}, dashed"
    intro = f"{scenario} runs {config}: {sides}. The engine runs the words of the PLC."
    versions = f"pidcfg {VERSION}, Pyodide {runtime.versions['pyodide']}, Python {runtime.versions['python']}"
    data = {"scenario": scenario, "files": session.files, "against": against}
    title = str(session.model.scenario)
    texts = {"title": title, "intro": intro, "config": config, "versions": versions}
    scripts = SCRIPT, text_of("desk.js"), text_of("whatif.js")
    body = Template(text_of("whatif.html")).substitute({key: escape(plain_text(text)) for key, text in texts.items()})
    return render_page(
        f"What if: {title}",
        body,
        (text_of("whatif.css"),),
        scripts,
        data,
        runtime.python,
        pack_package(runtime, WHATIF_EXCLUDES),
    )


def playground_page(examples: Iterable[Path], runtime: Runtime) -> str:
    """The page, with the examples in these folders."""
    rows = [example for folder in examples for example in examples_in(folder)]
    data = {"examples": rows, "first": FIRST_EXAMPLE}
    versions = {
        "version": VERSION,
        "pyodide": runtime.versions["pyodide"],
        "python": runtime.versions["python"],
    }
    body = Template(text_of("playground.html")).substitute(versions)
    styles = text_of("whatif.css"), text_of("playground.css")
    scripts = SCRIPT, text_of("desk.js"), text_of("playground.js")
    return render_page(
        "pidcfg playground", body, styles, scripts, data, runtime.python, pack_package(runtime, PLAYGROUND_EXCLUDES)
    )


def examples_in(folder: Path) -> list[dict[str, object]]:
    """Each scenario of a folder with its configuration, and configurations that have none; with accepted runs."""
    texts = {path.name: path.read_text("utf-8") for path in sorted(folder.glob("*.yaml"))}
    scenarios = [
        (pidcfg.load(texts[name]).document.data or {}, name) for name in texts if name.endswith(SCENARIO_ENDING)
    ]
    pairs = [(str(data["config"]), name) for data, name in scenarios]
    configured = {config for config, _ in pairs}
    pairs += [
        (name, name.replace(".yaml", SCENARIO_ENDING))
        for name in texts
        if name not in configured and SCENARIO_ENDING not in name
    ]
    rows: list[dict[str, object]] = []
    for config, scenario in sorted(pairs):
        accepted = folder / scenario.replace(SCENARIO_ENDING, ".accepted.json")
        accepted_runs = {accepted.name: accepted.read_text("utf-8")} if accepted.is_file() else {}
        other_scenarios = [name for one, name in pairs if one == config][1:]
        title = f"{folder.name}/{config}" + (f", {scenario.removesuffix(SCENARIO_ENDING)}" if other_scenarios else "")
        files = {config: texts[config], scenario: texts.get(scenario, ""), **accepted_runs}
        rows.append({"title": title, "config": config, "scenario": scenario, "files": files})
    return rows


def render_page(
    title: str,
    body: str,
    styles: tuple[str, ...],
    scripts: tuple[str, ...],
    data: Mapping[str, object],
    *archives: bytes,
) -> str:
    """A page with a worker: HTML of its body, scripts that may run, plain data for them, packed Python and pidcfg."""
    python, package = (base64.b64encode(one).decode() for one in archives)
    hashes = " ".join(f"'{_hash_of(script)}'" for script in scripts)
    policy = (
        f"default-src 'none'; script-src {hashes} 'unsafe-eval' 'wasm-unsafe-eval' blob:; worker-src blob:; "
        "style-src 'unsafe-inline'; img-src data:; connect-src 'none'; base-uri 'none'; form-action 'none'"
    )
    data_text = json.dumps(data, ensure_ascii=True).replace("<", "\\u003c")
    blocks = "".join(f"<script>{script}</script>\n" for script in scripts)
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(plain_text(title))}</title>\n<style>\n{STYLE}{''.join(styles)}</style>\n</head>\n"
        f'<body data-state="starting">\n{body}'
        f'<script type="application/json" id="files">{data_text}</script>\n'
        f'<script type="text/plain" id="worker">{text_of("worker.js")}</script>\n'
        f'<script type="text/plain" id="python">{python}</script>\n'
        f'<script type="text/plain" id="pidcfg">{package}</script>\n'
        f"{blocks}</body>\n</html>\n"
    )


FAST_LEVEL = 7
"""Compression of a page: a percent larger than the best, and made in a third of the time."""


def pack_package(runtime: Runtime, excluded: tuple[str, ...]) -> bytes:
    """The installed pidcfg as a part of a page: a zip that is stored as it is, since everything is packed once."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name, data in package_files(runtime, Path(pidcfg.__file__).parent, excluded).items():
            archive.writestr(zipfile.ZipInfo(name, ZIP_TIME), data)
    return pack_files({"pidcfg.zip": buffer.getvalue()}, FAST_LEVEL)


def text_of(name: str) -> str:
    """A file of this folder."""
    return (HTML_FOLDER / name).read_text("utf-8")


def _hash_of(script: str) -> str:
    return "sha256-" + base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
