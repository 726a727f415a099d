"""Runs in Pyodide, started by compile.mjs: modules as .pyc, which do not look for their sources, in zip files.

A zip is stored as it is: the page packs everything once.
"""

import hashlib
import io
import marshal
import zipfile
from collections.abc import Iterator
from importlib.util import MAGIC_NUMBER
from pathlib import Path

WORK = Path("/work")
EPOCH = (1980, 1, 1, 0, 0, 0)
UNCHECKED = MAGIC_NUMBER + (0b01).to_bytes(4, "little") + bytes(8)
"""The head of a .pyc that is taken as it is."""
LEFT_OUT = ("_pyrepl", "unittest", "wsgiref", "xmlrpc", "ensurepip", "venv", "http/cookiejar.py", "imaplib.py")
LEFT_OUT += ("mailbox.py", "pdb.py", "doctest.py", "pydoc.py", "pydoc_data", "optparse.py", "pickletools.py")
LEFT_OUT += ("multiprocessing", "_pyio.py", "_pydatetime.py", "_pydecimal.py", "turtle", "sqlite3", "tkinter")
LEFT_OUT += ("smtplib.py", "ftplib.py", "poplib.py", "webbrowser.py", "cProfile.py", "profile.py", "pstats.py")
"""Of Python's library: what nothing here asks for."""
COMPILED = "pydantic_core"
"""A module in machine code is loaded from a file, not from a zip."""


def compiled(source: bytes, name: str, level: int) -> bytes:
    """A module as a .pyc; ``level`` 2 leaves out docstrings."""
    return UNCHECKED + marshal.dumps(compile(source, name, "exec", dont_inherit=True, optimize=level))


def add(target: zipfile.ZipFile, name: str, data: bytes) -> None:
    """A file without a time: the same bytes whenever it is made."""
    if name.endswith(".py"):
        name, data = f"{name}c", compiled(data, name, 2)
    target.writestr(zipfile.ZipInfo(name, EPOCH), data)


def rows(archive: zipfile.ZipFile) -> Iterator[tuple[str, bytes]]:
    """Names and contents, in order."""
    for name in sorted(archive.namelist()):
        if not name.endswith("/"):
            yield name, archive.read(name)


def main() -> None:
    """All that compile.mjs promises."""
    with (
        zipfile.ZipFile("/library/python_stdlib.zip") as library,
        zipfile.ZipFile(WORK / "stdlib.zip", "w") as target,
    ):
        for name, data in rows(library):
            if not name.startswith(LEFT_OUT):
                add(target, name, data)
    with zipfile.ZipFile(WORK / "site.zip", "w") as site, zipfile.ZipFile(WORK / "core.zip", "w") as core:
        for wheel in sorted(WORK.glob("wheels/*.whl")):
            for name, data in rows(zipfile.ZipFile(io.BytesIO(wheel.read_bytes()))):
                if not name.endswith((".pyi", "/RECORD", "/WHEEL", "py.typed")):
                    add(core if name.startswith(f"{COMPILED}/") else site, name, data)
    (WORK / "compiled").mkdir(exist_ok=True)
    for path in sorted(WORK.glob("source/**/*.py")):
        source, name = path.read_bytes(), f"pidcfg/{path.relative_to(WORK / 'source').as_posix()}"
        (WORK / "compiled" / f"{hashlib.sha256(source).hexdigest()}.pyc").write_bytes(
            compiled(source, name, 0)
        )  # docstrings of rules are shown


if __name__ == "__main__":
    main()
