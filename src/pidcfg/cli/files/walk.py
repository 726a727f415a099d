"""The folders below one, without those that hold other people's files and without what patterns leave out."""

from __future__ import annotations

import os
import stat
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import click

from pidcfg.cli.files.identity import EXCLUDED, relative
from pidcfg.cli.files.patterns import MOST, Patterns, patterns
from pidcfg.reader import SUFFIXES, read_file

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

ENVIRONMENT = "pyvenv.cfg"
"""What the folder of a virtual environment holds."""
PACKAGES = frozenset({"node_modules", "site-packages"})
"""Folders of packages, by name."""
GITIGNORE, REPOSITORY = ".gitignore", ".git"
LARGEST = 128 << 10
"""Bytes of a ``.gitignore``."""

Reasons = list[tuple[str, str]]
"""Names, each with the reason why it is left out or not used."""
Levels = tuple[Patterns, ...]
"""The patterns of ``.gitignore`` files, those of the deepest folder first."""


class Folder(NamedTuple):
    """One folder on the way."""

    path: str
    folders: list[str]
    """Names of the folders that are entered next, and of links, which are not."""
    files: list[str]
    """Names of YAML files, and of whatever else is called so."""
    left_out: Reasons
    """Folders, with a slash at the end, and YAML files that are not looked at."""
    unused: Reasons
    """Files of patterns that do not count."""


def walk(name: str, closed: Callable[[OSError], None] | None = None) -> Iterator[Folder]:
    """The folder, whatever patterns say of it, and those below it; ``closed`` is told of those that cannot be read."""
    excluded, unused = _excluded(), Reasons()
    levels = {name: _above(name, unused)}
    for place, folders, files in os.walk(name, onerror=closed):
        ignored = levels.pop(place)
        if place != name and REPOSITORY in {*folders, *files}:
            ignored = ()  # a repository of its own
        if GITIGNORE in files:
            ignored = (*_ignored(place, unused), *ignored)
        inside = {f: _folder(place, f, excluded, ignored) for f in sorted(folders) if not f.startswith(".")}
        yaml = (f for f in sorted(files) if Path(f).suffix.lower() in SUFFIXES)
        read = {f: _named(place, f, excluded, ignored) for f in yaml}
        folders[:] = (f for f, reason in inside.items() if reason is None)
        levels |= {os.path.join(place, f): ignored for f in folders}  # noqa: PTH118 - as os.walk spells it
        left_out = [(f"{f}/", reason) for f, reason in inside.items() if reason is not None]
        left_out += ((f, reason) for f, reason in read.items() if reason is not None)
        yield Folder(place, folders, [f for f, reason in read.items() if reason is None], left_out, unused)
        unused = Reasons()


def _folder(place: str, name: str, excluded: Patterns | None, ignored: Levels) -> str | None:
    """Why a folder is left out, if it is; a link to one is no folder for patterns."""
    path = Path(place, name)
    if name in PACKAGES:
        return "packages of others"
    if os.path.lexists(path / ENVIRONMENT):
        return f"holds {ENVIRONMENT}"
    return _named(place, name, excluded, ignored, folder=not path.is_symlink())


def _named(place: str, name: str, excluded: Patterns | None, ignored: Levels, *, folder: bool = False) -> str | None:
    """Why patterns leave an entry out, if they do: of those of git, the last of the deepest file counts."""
    if excluded is None and not ignored:
        return None
    path = _base(place) + name
    row = None if excluded is None else excluded.decisive(path, folder=folder)
    if row is None or not row.leaves_out:
        rows = (level.decisive(path, folder=folder) for level in ignored)
        row = next((row for row in rows if row is not None), None)
    return row.reason if row is not None and row.leaves_out else None


def _base(folder: str) -> str:
    """A folder as patterns begin at it: from the root, links not followed, with a slash at the end."""
    return Path(os.path.abspath(folder)).as_posix().rstrip("/") + "/"  # noqa: PTH100 - links are not followed


def _excluded() -> Patterns | None:
    """The patterns of ``--exclude``, or of the settings."""
    ctx = click.get_current_context(silent=True)
    kept = None if ctx is None else ctx.meta.get(EXCLUDED)
    return None if kept is None else patterns(_base(kept.root), kept.origin, kept.patterns)


def _above(name: str, unused: Reasons) -> Levels:
    """The patterns of the folders above one, up to the root of its repository; outside of one there are none."""
    start = Path(os.path.abspath(name))  # noqa: PTH100 - links are not followed
    above: list[Path] = []
    for folder in (start, *start.parents):
        if folder != start:
            above.append(folder)
        if (folder / REPOSITORY).exists():
            return tuple(level for folder in above for level in _ignored(str(folder), unused))
    return ()


def _ignored(folder: str, unused: Reasons) -> Iterable[Patterns]:
    """The patterns of a folder's ``.gitignore``, none or one; a link or a pipe is none, for git neither."""
    path = Path(folder, GITIGNORE)
    shown = relative(str(path), Path.cwd())
    try:
        if not stat.S_ISREG(path.lstat().st_mode):
            return
        data = read_file(path, LARGEST + 1)
    except FileNotFoundError:
        return
    except OSError as error:
        unused.append((shown, f"cannot be read ({error.strerror}): what it names is not left out"))
        return
    lines = data.removeprefix(b"\xef\xbb\xbf").decode("utf-8", "surrogateescape").split("\n")
    if len(data) > LARGEST or len(lines) > MOST:
        unused.append((shown, f"has more than {LARGEST} bytes or {MOST} lines: what it names is not left out"))
        return
    yield patterns(_base(folder), shown, (line.removesuffix("\r") for line in lines), numbered=True)
