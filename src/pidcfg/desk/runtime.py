"""What a page needs to run Python in a browser: one file that `python tasks.py whatif-runtime` makes."""

from __future__ import annotations

import gzip
import hashlib
import json
import zipfile
from pathlib import Path
from typing import Any

from pidcfg.text.frozen import frozen
from pidcfg.text.references import Decision
from pidcfg.text.store import cache_folder

D1001 = Decision(
    1001,
    "Python for the browser is made beside pidcfg, and is no part of it",
    "Pyodide and six wheels (13 MB) are neither in the repository nor in the wheel: `python tasks.py whatif-runtime` "
    "collects them from npm and PyPI by locked versions and hashes, compiles them, and writes one file into the user's "
    "cache and into build/. `pidcfg whatif` takes it from there, or by `--runtime FILE`, and needs no network.",
    "Who never makes such a page should not load it with every installation, and a file can be carried to a PC that "
    "has no network.",
)
FILE = "whatif-runtime.zip"
FOLDER = "whatif"
"""In the user's cache."""
FORMAT = 1
MANIFEST = "manifest.json"
PYTHON = "python.gz"
"""Python, its library and the wheels, packed by `pack`."""
STARTERS = "pidcfg/cli/starters/"
"""What `convert` reads of a part that is left out."""
READ = ("pidcfg/schemas/",)
"""Modules whose sources are read by pidcfg itself: what stands beside a key is its explanation."""
MAKE = "in a clone of pidcfg, 'python tasks.py whatif-runtime' makes it (npm, PyPI and Node are needed for that once)"


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


def usual_place() -> Path:
    """Where the file is looked for; raises `OSError` where there can be no cache."""
    return cache_folder(FOLDER) / FILE


def read_runtime(path: Path) -> Runtime:
    """The file; raises `RuntimeFileError`."""
    try:
        with zipfile.ZipFile(path) as archive:
            manifest: dict[str, Any] = json.loads(archive.read(MANIFEST))
            if manifest.get("format") != FORMAT:
                raise RuntimeFileError(f"{path} is of another version of pidcfg; {MAKE} anew")
            python = archive.read(PYTHON)
            names = [name for name in archive.namelist() if name.startswith("compiled/")]
            compiled = {Path(name).stem: archive.read(name) for name in names}
    except FileNotFoundError:
        raise RuntimeFileError(f"there is no Python for the browser in {path}; {MAKE}") from None
    except (OSError, KeyError, ValueError, zipfile.BadZipFile) as error:
        if isinstance(error, RuntimeFileError):
            raise
        raise RuntimeFileError(f"{path} is no file of Python for the browser ({error}); {MAKE}") from None
    return Runtime(manifest["versions"], python, compiled)


def entries(versions: dict[str, str], parts: dict[str, bytes], compiled: dict[str, bytes]) -> dict[str, bytes]:
    """The entries of such a file."""
    manifest = json.dumps({"format": FORMAT, "versions": versions}, indent=1).encode()
    modules = {f"compiled/{name}.pyc": data for name, data in sorted(compiled.items())}
    return {MANIFEST: manifest, PYTHON: pack(parts), **modules}


def pack(parts: dict[str, bytes], level: int = 9) -> bytes:
    """Files for the worker: the length of a list of names and sizes, the list, and the contents, compressed."""
    rows = json.dumps([[name, len(data)] for name, data in parts.items()]).encode()
    return gzip.compress(len(rows).to_bytes(4, "big") + rows + b"".join(parts.values()), level, mtime=0)


def own_modules(runtime: Runtime, package: Path, left_out: tuple[str, ...]) -> dict[str, bytes]:
    """The files of the installed package, compiled where the runtime knows them, without some of its parts."""
    files = {}
    for path in sorted(package.rglob("*")):
        name = path.relative_to(package.parent).as_posix()
        is_left_out = name.startswith(left_out) and not name.startswith(STARTERS)
        if not path.is_file() or "__pycache__" in path.parts or is_left_out:
            continue
        data = path.read_bytes()
        found = runtime.compiled.get(hashlib.sha256(data).hexdigest()) if path.suffix == ".py" else None
        if found is None or name.startswith(READ):
            files[name] = data
        if found is not None and name.startswith(READ):
            folder, _, file = name.rpartition("/")
            files[f"{folder}/__pycache__/{file.removesuffix('.py')}.{runtime.tag}.pyc"] = found
        elif found is not None:
            files[f"{name}c"] = found
    return files
