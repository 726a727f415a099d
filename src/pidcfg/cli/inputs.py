"""Paths from the command line to documents: files, folders and what is left out of them, patterns, standard input."""

from __future__ import annotations

import glob
import os
import re
import stat
import sys
import warnings
from dataclasses import dataclass, field
from math import comb
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import click

from pidcfg.cli.console import write_remark
from pidcfg.cli.terminal import hold_line
from pidcfg.text.diagnostics import Diagnostic, Severity
from pidcfg.text.document import Document, Node
from pidcfg.text.frozen import frozen
from pidcfg.text.reader import DEFAULT, SUFFIXES, Disk, read_failure, read_file, similar_file
from pidcfg.text.signs import UTF16_MARKS
from pidcfg.text.source import read_document

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence
    from typing import IO

    from pidcfg.text.reader import Limits
    from pidcfg.vendors import Vendor

# --- What tells files apart, by whatever name they are called, and which of them the running command has read ---------

Identity: TypeAlias = "str | tuple[int, int]"
FILES_READ_KEY = "pidcfg.files_read"
"""Where a command keeps the identities of its inputs."""
NAMES_READ_KEY = "pidcfg.names_read"
"""Where it keeps their names, and those of files that it looked for."""
EXCLUSION_KEY = "pidcfg.files_excluded"
"""Where it keeps what it leaves out of folders."""


class Exclusion(NamedTuple):
    """Patterns of files that are left out, the folder that they begin at, and what reasons call them."""

    root: Path
    origin: str
    patterns: tuple[str, ...]


def file_identity(name: str) -> Identity:
    """A file's own number; where there is none yet, the place where it would be."""
    try:
        status = Path(name).stat()
    except (OSError, ValueError):
        return os.path.normcase(os.path.realpath(name))
    return (status.st_dev, status.st_ino)


def equal_file_fault(names: Iterable[str]) -> str | None:
    """What is wrong with the names of outputs where two of them mean one file."""
    names_by_identity: dict[Identity, str] = {}
    for name in names:
        identity = file_identity(name)
        if identity in names_by_identity:
            return f"{names_by_identity[identity]} and {name} are one file; name two"
        names_by_identity[identity] = name
    return None


def note_open_file(stream: IO[bytes]) -> None:
    """Notes an open file as an input of the running command."""
    ctx = click.get_current_context(silent=True)
    if ctx is None:
        return
    try:
        status = os.fstat(stream.fileno())
    except (OSError, ValueError):  # standard input that is no file
        return
    files_read(ctx).add((status.st_dev, status.st_ino))


def note_name(name: str) -> None:
    """Notes the name of a file that the running command reads or looks for."""
    ctx = click.get_current_context(silent=True)
    if ctx is not None:
        ctx.meta.setdefault(NAMES_READ_KEY, set()).add(name)


def note_read(name: str) -> None:
    """Notes a file that another process has read for the running command."""
    ctx = click.get_current_context(silent=True)
    if ctx is not None and name:
        note_name(name)
        files_read(ctx).add(file_identity(name))


def was_read(name: str) -> bool:
    """Whether the running command has read this file."""
    ctx = click.get_current_context(silent=True)
    return ctx is not None and file_identity(name) in files_read(ctx)


def files_read(ctx: click.Context) -> set[Identity]:
    """The identities of the command's inputs so far."""
    identities: set[Identity] = ctx.meta.setdefault(FILES_READ_KEY, set())
    return identities


def relative_path(file: str, folder: Path) -> str:
    """A file's path seen from a folder, with forward slashes; as it is where there is no such path."""
    try:
        return Path(os.path.relpath(file, folder)).as_posix()
    except ValueError:
        return Path(file).as_posix()


# ----------------------------------------------------------------------------------------------------------------------
# Patterns as git reads them in a ``.gitignore``: each line by itself, and which line of a file counts for an entry.
# pathspec turns a line into a regular expression. It is asked for one entry at a time, whose folders are not left
# out; so nothing below a folder that is left out can be taken back, as with git.

MAX_PATTERNS = 2000
"""Lines of a ``.gitignore``, and patterns of a settings file."""
MAX_PATTERN_WAYS = 10_000
"""In which the ``**`` of a pattern may lie over the folders of a path."""
ANY_FOLDERS, PARENT_FOLDER = "**", ".."
STAR, SIGN = r"\[\^/\]\*", r"(?:\\.|\[\^?\]?[^\]]*\]|[^/\\\[(])"
STARS = re.compile(rf"(?:{STAR}){{2,}}")
BETWEEN_STARS = re.compile(rf"{STAR}((?:(?!{STAR}){SIGN})+)(?={STAR})", re.DOTALL)
"""In a regular expression of pathspec: a star, and what stands between it and the next one of the same name."""


class Pattern(NamedTuple):
    """One line that names entries, or takes some back."""

    reason: str
    """Why an entry that it names is left out."""
    regex: re.Pattern[str]
    excludes: bool
    folders_only: bool
    """Whether it ends with a slash."""
    names_only: bool
    """Whether it has no other slash, and so is compared with the name in whatever folder."""
    double_stars: int
    """How many ``**`` it has."""

    def matches(self, path: str, *, folder: bool) -> bool:
        """Whether it names this entry itself; one that would take very long is taken for what leaves nothing out."""
        if self.folders_only and not folder:
            return False
        text = path.rpartition("/")[2] if self.names_only else path
        if self.double_stars and comb(text.count("/") + self.double_stars, self.double_stars) > MAX_PATTERN_WAYS:
            return not self.excludes
        match = self.regex.search(text)
        return match is not None and match.lastindex is None  # its group is the slash behind a folder above


class Patterns(NamedTuple):
    """The patterns of one origin, which begin at a folder."""

    base: str
    """The folder, with a slash at its end."""
    rows: list[Pattern]

    def deciding_pattern(self, path: str, *, folder: bool) -> Pattern | None:
        """The last pattern that names an entry; None for what lies elsewhere, too."""
        if not path.startswith(self.base):
            return None
        relative = path[len(self.base) :]
        return next((row for row in reversed(self.rows) if row.matches(relative, folder=folder)), None)


def parse_patterns(base: str, origin: str, lines: Iterable[str], *, numbered: bool = False) -> Patterns:
    """The patterns of some lines; a line that is none is passed over, as git does."""
    rows = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FutureWarning)  # "[[" in a regular expression
        for number, line in enumerate(lines, 1):
            row = _parse_pattern(f"{origin}:{number}" if numbered else origin, line)
            rows += [row] if row is not None else []
    return Patterns(base, rows)


def _parse_pattern(origin: str, line: str) -> Pattern | None:
    from pathspec.patterns.gitignore.spec import GitIgnoreSpecPattern

    stripped = line.rstrip(" ")
    line = f"{stripped} " if stripped.endswith("\\") and stripped != line else stripped
    body = line.removesuffix("/")
    try:
        regex, excludes = GitIgnoreSpecPattern.pattern_to_regex(body)
        if regex is None or excludes is None:
            return None
        compiled = re.compile(BETWEEN_STARS.sub(r"(?>[^/]*?\1)", STARS.sub("[^/]*", regex)))
    except (ValueError, re.error):
        return None
    return Pattern(f"{origin}: {line}", compiled, excludes, body != line, "/" not in body, body.count(ANY_FOLDERS))


def pattern_fault(line: str) -> str | None:
    """What is wrong with a pattern of the command line or of a settings file, and its cure."""
    if PARENT_FOLDER in line.split("/"):
        return f"{line!r} leads out of the folder that patterns begin at; run there, or put the settings there"
    if re.search(r"\\\w", line):
        return f"{line!r} is no pattern of paths; write it with forward slashes"
    if not parse_patterns("/", "", [line]).rows:
        return f"{line!r} is no pattern of paths; write it as a line of .gitignore, such as 'old/' or '*.bak.yaml'"
    return None


# --- The folders below one, without those that hold other people's files and without what patterns leave out ----------

ENVIRONMENT_FILE = "pyvenv.cfg"
"""What the folder of a virtual environment holds."""
PACKAGE_FOLDERS = frozenset({"node_modules", "site-packages"})
"""Folders of packages, by name."""
GITIGNORE, REPOSITORY = ".gitignore", ".git"
MAX_GITIGNORE = 128 << 10
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
    excluded: Reasons
    """Folders, with a slash at the end, and YAML files that are not looked at."""
    unused_patterns: Reasons
    """Files of patterns that do not count."""


def walk_folders(name: str, on_error: Callable[[OSError], None] | None = None) -> Iterator[Folder]:
    """The folder, whatever patterns say of it, and those below it; ``on_error`` hears of those that cannot be read."""
    excluded, unused = _excluded_patterns(), Reasons()
    levels = {name: _gitignores_above(name, unused)}
    for folder, folders, files in os.walk(name, onerror=on_error):
        levels_here = levels.pop(folder)
        if folder != name and REPOSITORY in {*folders, *files}:
            levels_here = ()  # a repository of its own
        if GITIGNORE in files:
            levels_here = (*_gitignore_patterns(folder, unused), *levels_here)
        folder_reasons = {
            f: _folder_reason(folder, f, excluded, levels_here) for f in sorted(folders) if not f.startswith(".")
        }
        yaml = (f for f in sorted(files) if Path(f).suffix.lower() in SUFFIXES)
        file_reasons = {f: _pattern_reason(folder, f, excluded, levels_here) for f in yaml}
        folders[:] = (f for f, reason in folder_reasons.items() if reason is None)
        levels |= {os.path.join(folder, f): levels_here for f in folders}  # noqa: PTH118 - as os.walk spells it
        skipped = [(f"{f}/", reason) for f, reason in folder_reasons.items() if reason is not None]
        skipped += ((f, reason) for f, reason in file_reasons.items() if reason is not None)
        yield Folder(folder, folders, [f for f, reason in file_reasons.items() if reason is None], skipped, unused)
        unused = Reasons()


def _folder_reason(folder_path: str, name: str, excluded: Patterns | None, levels: Levels) -> str | None:
    """Why a folder is left out, if it is; a link to one is no folder for patterns."""
    path = Path(folder_path, name)
    if name in PACKAGE_FOLDERS:
        return "packages of others"
    if os.path.lexists(path / ENVIRONMENT_FILE):
        return f"holds {ENVIRONMENT_FILE}"
    return _pattern_reason(folder_path, name, excluded, levels, folder=not path.is_symlink())


def _pattern_reason(
    folder_path: str, name: str, excluded: Patterns | None, levels: Levels, *, folder: bool = False
) -> str | None:
    """Why patterns leave an entry out, if they do: of those of git, the last of the deepest file counts."""
    if excluded is None and not levels:
        return None
    path = _pattern_base(folder_path) + name
    row = None if excluded is None else excluded.deciding_pattern(path, folder=folder)
    if row is None or not row.excludes:
        rows = (level.deciding_pattern(path, folder=folder) for level in levels)
        row = next((row for row in rows if row is not None), None)
    return row.reason if row is not None and row.excludes else None


def _pattern_base(folder: str) -> str:
    """A folder as patterns begin at it: from the root, links not followed, with a slash at the end."""
    return Path(os.path.abspath(folder)).as_posix().rstrip("/") + "/"


def _excluded_patterns() -> Patterns | None:
    """The patterns of ``--exclude``, or of the settings."""
    ctx = click.get_current_context(silent=True)
    exclusion = None if ctx is None else ctx.meta.get(EXCLUSION_KEY)
    return (
        None
        if exclusion is None
        else parse_patterns(_pattern_base(exclusion.root), exclusion.origin, exclusion.patterns)
    )


def _gitignores_above(name: str, unused: Reasons) -> Levels:
    """The patterns of the folders above one, up to the root of its repository; outside of one there are none."""
    start = Path(os.path.abspath(name))
    folders_above: list[Path] = []
    for folder in (start, *start.parents):
        if folder != start:
            folders_above.append(folder)
        if (folder / REPOSITORY).exists():
            return tuple(level for folder in folders_above for level in _gitignore_patterns(str(folder), unused))
    return ()


def _gitignore_patterns(folder: str, unused: Reasons) -> Iterable[Patterns]:
    """The patterns of a folder's ``.gitignore``, none or one; a link or a pipe is none, for git neither."""
    path = Path(folder, GITIGNORE)
    shown_path = relative_path(str(path), Path.cwd())
    try:
        if not stat.S_ISREG(path.lstat().st_mode):
            return
        data = read_file(path, MAX_GITIGNORE + 1)
    except FileNotFoundError:
        return
    except OSError as error:
        unused.append((shown_path, f"cannot be read ({error.strerror}): what it names is not left out"))
        return
    lines = data.removeprefix(b"\xef\xbb\xbf").decode("utf-8", "surrogateescape").split("\n")
    if len(data) > MAX_GITIGNORE or len(lines) > MAX_PATTERNS:
        unused.append(
            (shown_path, f"has more than {MAX_GITIGNORE} bytes or {MAX_PATTERNS} lines: what it names is not left out")
        )
        return
    yield parse_patterns(_pattern_base(folder), shown_path, (line.removesuffix("\r") for line in lines), numbered=True)


# --- Which YAML files in a folder are for pidcfg: those with its key, and those of which nobody can tell --------------

MAX_SNIFF_SIZE = 64 << 20
"""Bytes of a file that is searched for the key; a larger one is read, and complained about."""
LINE_BREAK = re.compile(rb"\r\n?|\xc2\x85|\xe2\x80[\xa8\xa9]")
BYTE_ORDER_MARK = b"\xef\xbb\xbf"
FIRST_LINE = re.compile(rb"^([ \t]*)(?!%|#|\.\.\.|[ \t])(?:---(?:[ \t]+|$))?(?:#.*$)?([^\s#].*)", re.MULTILINE)
"""The first line that says something, and how far it is indented: there the keys at the top stand."""
BLOCK_START = re.compile(rb"(?:[\w.$/+-]+|\"[^\"\\\n]*\"|'[^'\n]*')[ \t]*:(?:\s|$)|-(?:[ \t]|$)")
"""A key or an item in a block: what follows is read line by line. Anything else may hold keys anywhere."""
OPENING_BRACKET = re.compile(rb"[{,?]\s*")
PIDCFG_KEY = re.compile(rb"^(?:\?[ \t]+)?\t*[\"']?pidcfg[\"']?[ \t]*(?::|$)", re.MULTILINE)
"""The key at the top; also after a tab."""
ESCAPED_KEY = re.compile(rb"^(?:\?[ \t]+)?\"[^\"\n:]*\\", re.MULTILINE)
"""A key that is spelled with escapes may be any."""
SIMILAR_KEYS = (
    re.compile(rb"^[\"']?(?:vendor|scenario)[\"']?\s*:", re.MULTILINE),
    re.compile(rb"^[\"']?(?:loops|config|plants|expect)[\"']?\s*:", re.MULTILINE),
)
"""Keys at the top by which a file is for pidcfg although that key is missing or misspelt."""


def is_for_pidcfg(name: str, data: bytes, max_bytes: int) -> bool:
    """Whether a file is for pidcfg by its first bytes; when they are more than ``max_bytes``, by all of them."""
    if has_key(data):
        return True
    if len(data) <= max_bytes:
        return False
    try:
        content = read_file(name, MAX_SNIFF_SIZE + 1)
    except (OSError, ValueError):
        return True
    return len(content) > MAX_SNIFF_SIZE or has_key(content)


def has_key(data: bytes) -> bool:
    """Whether a text has the key ``pidcfg`` at the top, or may have it."""
    text = data.decode("utf-16", "replace").encode() if data.startswith(UTF16_MARKS) else data.replace(b"\0", b"")
    text = LINE_BREAK.sub(b"\n", text.removeprefix(BYTE_ORDER_MARK).removeprefix(BYTE_ORDER_MARK))
    first_line = FIRST_LINE.search(text)
    if first_line is None:
        return False
    if not BLOCK_START.match(first_line[2]):
        text = OPENING_BRACKET.sub(b"\n", text)
    elif first_line[1]:
        text = re.sub(rb"^" + re.escape(first_line[1]), b"", text, flags=re.MULTILINE)
    return bool(PIDCFG_KEY.search(text) or ESCAPED_KEY.search(text)) or all(key.search(text) for key in SIMILAR_KEYS)


# --- Paths from the command line to documents: files, folders, patterns and standard input ----------------------------

STDIN = "-"
STDIN_TITLE = "<stdin>"
"""Standard input in findings, unless ``--stdin-filename`` names it."""
STDIN_NAME_KEY = "pidcfg.stdin"
"""Where a command keeps that name."""
MAX_NAMES = 3
"""Names of what was left out."""


@frozen
class Input:
    """A file's name as reports print it, and its bytes; or why there are none."""

    name: str
    data: bytes = b""
    problem: str | None = None
    is_piped: bool = False
    """Whether it is standard input, by whatever name."""
    is_foreign: bool = False
    """A YAML file without the ``pidcfg`` key, in a folder or where such files are to be skipped."""
    remark: str | None = None
    """Why a foreign entry of a folder was not even looked at."""
    reason: str | None = None
    """Why a foreign entry of a folder was to be left out; the name of a folder ends with a slash."""
    limits: Limits = DEFAULT
    """Within which it was read."""


def read_inputs(paths: Sequence[str], limits: Limits) -> Iterator[Document]:
    """The documents that the paths of a command line stand for, each once."""
    return (document_of_input(entry) for entry in read_entries(paths, limits))


def read_entries(paths: Sequence[str], limits: Limits) -> Iterator[Input]:
    """The inputs that are for pidcfg; behind them a remark says what was left out."""
    foreign = []
    for entry in gather_inputs(paths, limits):
        if entry.is_foreign:
            foreign.append(entry)
        else:
            yield entry
    ctx = click.get_current_context(silent=True)
    params = {} if ctx is None else ctx.params
    if (text := excluded_text(foreign)) and not params.get("quiet"):
        write_remark(text)
    for reason in exclusion_reasons(foreign) if params.get("verbose") else ():
        write_remark(reason)


def excluded_text(entries: Iterable[Input]) -> str:
    """How many folders and files were left out, and the names of some; nothing where none was."""
    names = [entry.name for entry in entries if entry.reason is not None]
    folders = sum(name.endswith("/") for name in names)
    counts = ((folders, "folder"), (len(names) - folders, "file"))
    number = " and ".join(f"{n} {noun}{'s' if n != 1 else ''}" for n, noun in counts if n)
    base_names = list(dict.fromkeys(Path(name).name for name in names))
    base_names[MAX_NAMES:] = ["…"] * (len(base_names) > MAX_NAMES)
    return f"{number} left out ({', '.join(base_names)})" if names else ""


def exclusion_reasons(entries: Iterable[Input]) -> Iterator[str]:
    """Each entry that was left out, and why."""
    return (f"left out: {entry.name} ({entry.reason})" for entry in entries if entry.reason is not None)


def document_of_input(entry: Input) -> Document:
    """An input as a document; a file that could not be opened is one with that finding."""
    if entry.problem is None:
        return read_document(entry.data, entry.name, entry.limits)
    nearest = similar_file(entry.name, RECORDED_DISK)
    cure = f"did you mean {nearest}?" if nearest else "check the path"
    finding = Diagnostic("PID040", Severity.ERROR, entry.problem, entry.name, help=cure)
    return Document(entry.name, "", None, Node(None), (finding,), entry.limits)


def gather_inputs(paths: Sequence[str], limits: Limits, *, skip_foreign: bool = False) -> Iterator[Input]:
    """The inputs one by one; a folder stands for the files below it that carry a ``pidcfg`` key.

    ``skip_foreign``: a YAML file without one counts as foreign even when it is named. Standard input comes first: it
    stands for the file that ``--stdin-filename`` names, also in a folder.
    """
    taken_files = _TakenFiles(limits)
    for name in sorted(expand_patterns(paths), key=lambda name: name != STDIN):
        folder = name != STDIN and Path(name).is_dir()
        if not taken_files.add_path(name_of(name), folder=folder):
            continue
        if _is_pattern(name):
            yield Input(name, problem=f"no file matches {name}")
            continue
        if taken_files.is_full:
            yield taken_files.limit_input(name)
            return
        if folder:
            yield from _folder_inputs(name, taken_files)
        else:
            entry = read_input(name, limits)
            foreign = skip_foreign and name != STDIN and not concerns_pidcfg(entry)
            yield Input(name, is_foreign=True) if foreign else entry


@dataclass(slots=True)
class _TakenFiles:
    """What has been taken: each file once, by whatever way its folder is reached, and no more than the limit."""

    limits: Limits
    paths: set[tuple[str, str]] = field(default_factory=set)
    files: int = 0

    def add_path(self, name: str, *, folder: bool = False) -> bool:
        """Takes a file or a folder, unless it has been."""
        parent, file = os.path.split(name)
        key = (os.path.realpath(name), "") if folder else (os.path.realpath(parent), file)
        is_new = key not in self.paths
        self.paths.add(key)
        self.files += is_new and not folder
        return is_new

    @property
    def is_full(self) -> bool:
        """Whether there are more than the limit allows."""
        return self.files > self.limits.files

    def limit_input(self, name: str) -> Input:
        """The input that reports the limit."""
        return Input(name, problem=f"more than {self.limits.files} files; raise it with --limit files=N")


def concerns_pidcfg(entry: Input) -> bool:
    """Whether a file has the ``pidcfg`` key, or is to be reported because it cannot be read."""
    return entry.problem is not None or is_for_pidcfg(entry.name, entry.data, entry.limits.listing_bytes)


def expand_patterns(paths: Sequence[str]) -> Iterator[str]:
    """Patterns that the shell has left alone."""
    for path in paths:
        if _is_pattern(path):
            matches = sorted(glob.glob(path, recursive=True))  # noqa: PTH207 - patterns may be absolute
            yield from (Path(m).as_posix() for m in matches) if matches else [path]
        else:
            yield path if path == STDIN else Path(path).as_posix()


def _is_pattern(path: str) -> bool:
    """Whether a path is a pattern and no file."""
    return any(c in path for c in "*?[") and not Path(path).exists()


def _folder_inputs(name: str, taken_files: _TakenFiles) -> Iterator[Input]:
    """The files below a folder that have the ``pidcfg`` key or cannot be read; other YAML files as foreign."""
    has_files, foreign = False, []
    for entry in _walk_inputs(name, taken_files.limits):
        if entry.is_foreign:
            foreign.append(entry)
            yield entry
        elif taken_files.add_path(entry.name):
            has_files = True
            yield taken_files.limit_input(entry.name) if taken_files.is_full else entry
            if taken_files.is_full:
                return
        else:
            has_files = True
    if not has_files:
        left_out_text = f"; {text}" if (text := excluded_text(foreign)) else ""
        yield Input(name, problem=f"{name} holds no .yaml or .yml file with a pidcfg key{left_out_text}")


def _walk_inputs(name: str, limits: Limits) -> Iterator[Input]:
    """Every YAML file below a folder, and whatever may hide some."""
    errors: list[OSError] = []
    root = Path(name).resolve()
    for folder in walk_folders(name, errors.append):
        yield from (Input(path, is_foreign=True, remark=reason) for path, reason in folder.unused_patterns)
        for entry, reason in folder.excluded:
            yield Input(Path(folder.path, entry).as_posix() + "/" * entry.endswith("/"), is_foreign=True, reason=reason)
        for path in (Path(folder.path, f) for f in folder.folders):
            if path.is_symlink() and not path.resolve().is_relative_to(root):
                yield Input(
                    path.as_posix(), is_foreign=True, remark="a link out of the folder is not followed; name it"
                )
        for path in (Path(folder.path, f) for f in folder.files):
            if path.is_file() or not path.exists():
                yield _read_folder_entry(path, limits)
    for error in errors:
        yield Input(Path(error.filename).as_posix(), problem=f"cannot read {error.filename}: {error.strerror}")


def _read_folder_entry(path: Path, limits: Limits) -> Input:
    """One YAML file in a folder; foreign where it has no ``pidcfg`` key."""
    name = path.as_posix()
    entry = read_input(name, limits)
    return entry if concerns_pidcfg(entry) else Input(name, is_foreign=True)


class RememberedFiles(Disk):
    """The files of the disk, which no output of this run takes the place of."""

    def on_open(self, stream: IO[bytes]) -> None:
        """Notes the file as an input of the running command."""
        note_open_file(stream)

    def resolve(self, name: str, other: str) -> str:
        """Notes the file that another one refers to, whether it is there or not."""
        path = super().resolve(name, other)
        note_name(path)
        return path


RECORDED_DISK = RememberedFiles()


def name_of(path: str) -> str:
    """What findings call a path of the command line: standard input goes by the name that it was given."""
    if path != STDIN:
        return path
    ctx = click.get_current_context(silent=True)
    name: str = STDIN_TITLE if ctx is None else ctx.meta.get(STDIN_NAME_KEY, STDIN_TITLE)
    return name


def read_input(name: str, limits: Limits) -> Input:
    """The bytes of one file or of standard input, at most one more than the limit."""
    max_bytes = limits.listing_bytes + 1
    try:
        if name == STDIN:
            if sys.stdin is None:
                return Input(name_of(name), problem="cannot read standard input: it is closed", is_piped=True)
            with hold_line():
                RECORDED_DISK.on_open(sys.stdin.buffer)
                return Input(name_of(name), sys.stdin.buffer.read(max_bytes), is_piped=True, limits=limits)
        return Input(name, RECORDED_DISK.read(name, max_bytes), limits=limits)
    except (OSError, ValueError) as error:
        return Input(name_of(name), problem=read_failure(name_of(name), error), is_piped=name == STDIN)


def readable_input(name: str, limits: Limits) -> Input:
    """The same; a file that cannot be read ends the command."""
    entry = read_input(name, limits)
    if entry.problem is not None:
        raise click.ClickException(entry.problem)
    return entry


def listing_fault(entry: Input, vendor: Vendor, kind: str | None = None) -> str | None:
    """What is wrong with a file by itself that is to be a memory listing."""
    from pidcfg.encoders.decoding import read_listing
    from pidcfg.encoders.listing import ListingError

    if entry.problem is not None:
        return entry.problem
    try:
        read_listing(entry.data, vendor, entry.limits, kind)
    except ListingError as error:
        return f"{entry.name}:{error.line}:{error.column}: {error}"
    return None
