"""Makes a release of what is committed: ``python tasks.py release``; with ``--dry-run`` it only says what it would be.

Files are built twice, from exports of the commit that differ in folder, umask, clock zone and hash seed, and a third
wheel from the sdist; only where all are the same bytes, and every other step holds, is anything written: the date in
CHANGELOG.md, a commit, a tag, and dist/. Nothing is sent anywhere.
"""

from __future__ import annotations

import hashlib
import io
import os
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
import zipfile
from datetime import UTC, datetime
from email.parser import Parser
from pathlib import Path
from typing import TYPE_CHECKING

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import pidcfg
from release.metadata import ROOT, addresses
from release.places import stale

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from markdown_it.token import Token

CHANGELOG = "CHANGELOG.md"
HEADING = re.compile(r"^## (?P<version>\S+) \((?P<date>[^)]+)\)$", re.MULTILINE)
NOT_YET = "unreleased"
SBOM = "pidcfg.cdx.json"
SURROUNDINGS = (
    ("one", 0o022, {"TZ": "UTC", "PYTHONHASHSEED": "1", "LC_ALL": "C.UTF-8"}),
    ("a/deeper/two", 0o077, {"TZ": "Pacific/Auckland", "PYTHONHASHSEED": "2", "LC_ALL": "C"}),
)
"""Folder, umask and environment of the two builds."""


class ReleaseError(Exception):
    """What a release cannot be made with."""


def git(*words: str) -> str:
    """What git answers."""
    done = subprocess.run(("git", *words), cwd=ROOT, check=False, capture_output=True, text=True)
    if done.returncode:
        raise ReleaseError(f"git {' '.join(words)}: {done.stderr.strip()}")
    return done.stdout.strip()


# --- the commit -------------------------------------------------------------------------------------------------------


def committed() -> str:
    """The commit that is released: the one that the folder holds, and nothing else."""
    if changed := git("status", "--porcelain"):
        raise ReleaseError(f"commit or remove first:\n{changed}")
    return f"commit {git('rev-parse', '--short', 'HEAD')}, nothing else in the folder"


def version() -> str:
    """The version, which every file repeats."""
    if files := stale():
        raise ReleaseError(f"{', '.join(files)} say something else; run python tasks.py generate and commit")
    return f"version {pidcfg.__version__} in all files that repeat it"


def dated(text: str, today: str) -> str:
    """The changelog with the date of the release at its newest heading."""
    newest = HEADING.search(text)
    if newest is None or newest["version"] != pidcfg.__version__:
        raise ReleaseError(f"the newest heading of {CHANGELOG} is not '## {pidcfg.__version__} ({NOT_YET})'")
    if newest["date"] != NOT_YET:
        raise ReleaseError(f"{CHANGELOG} has a date at {pidcfg.__version__} already: it is released")
    return text[: newest.start("date")] + today + text[newest.end("date") :]


def changelog(today: str) -> str:
    """The newest heading, which the release gives its date."""
    text = dated((ROOT / CHANGELOG).read_text("utf-8"), today)
    lines = text[HEADING.search(text).end() :].partition("\n## ")[0].splitlines()  # type: ignore[union-attr]
    count = sum(line.startswith("- ") for line in lines)
    if not count:
        raise ReleaseError(f"{CHANGELOG} says nothing of {pidcfg.__version__}")
    return f"changelog: {count} lines below {pidcfg.__version__}, to be dated {today}"


def tag() -> str:
    """The tag, which must not be there yet."""
    name = f"v{pidcfg.__version__}"
    if git("tag", "--list", name):
        raise ReleaseError(f"the tag {name} is there already: raise VERSION in src/pidcfg/about.py")
    return f"tag {name} is free"


# --- the files --------------------------------------------------------------------------------------------------------


def export(folder: Path, umask: int, today: str) -> None:
    """The commit in a folder, as a clone under a umask has it, with its changelog dated."""
    archive = subprocess.run(("git", "archive", "HEAD"), cwd=ROOT, check=True, capture_output=True).stdout
    folder.mkdir(parents=True)
    with tarfile.open(fileobj=io.BytesIO(archive)) as files:
        for member in files.getmembers():
            member.mode &= ~umask
        files.extractall(folder, filter="tar")
    log = folder / CHANGELOG
    log.write_text(dated(log.read_text("utf-8"), today), "utf-8", newline="\n")


def build(source: Path, target: Path, umask: int, variables: dict[str, str], *options: str) -> None:
    """A build by hatchling, as any front end starts it."""
    command = (sys.executable, "-m", "hatchling", "build", "-d", str(target), *options)
    done = subprocess.run(
        command, cwd=source, check=False, capture_output=True, text=True, env={**os.environ, **variables}, umask=umask
    )
    if done.returncode:
        raise ReleaseError(done.stdout + done.stderr)


def digest(path: Path) -> str:
    """SHA-256 of a file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def build_twice(work: Path, today: str) -> list[Path]:
    """The files of the release; every way to them ends in the same bytes."""
    sums = []
    for name, umask, variables in SURROUNDINGS:
        export(work / name, umask, today)
        build(work / name, work / name / "dist", umask, variables)
        sums.append({path.name: digest(path) for path in (work / name / "dist").iterdir()})
    if sums[0] != sums[1]:
        raise ReleaseError(f"two builds differ: {sums}")
    files = sorted((work / "one" / "dist").iterdir())
    (sdist,) = (path for path in files if path.suffix == ".gz")
    with tarfile.open(sdist) as archive:
        archive.extractall(work / "unpacked", filter="data")
    (source,) = (work / "unpacked").iterdir()
    build(source, work / "again", 0o022, {}, "-t", "wheel")
    if {path.name: digest(path) for path in (work / "again").iterdir()}.items() - sums[0].items():
        raise ReleaseError("the wheel that is built from the sdist is another one")
    return files


def sums_of(files: Sequence[Path]) -> str:
    """The files with their sums."""
    rows = [f"  {digest(path)}  {path.name} ({path.stat().st_size:,} bytes)" for path in files]
    return "\n".join(["built twice, and the wheel from the sdist, with the same bytes:", *rows])


def bill_of_materials(wheel: Path) -> str:
    """What the wheel says of the packages that it was tested with (PEP 770)."""
    from cyclonedx.schema import SchemaVersion
    from cyclonedx.validation.json import JsonStrictValidator

    with zipfile.ZipFile(wheel) as archive:
        names = [name for name in archive.namelist() if ".dist-info/sboms/" in name]
        if [Path(name).name for name in names] != [SBOM]:
            raise ReleaseError(f"{wheel.name} has not one bill of materials: {names}")
        if archive.read(names[0]) != (ROOT / "requirements" / SBOM).read_bytes():
            raise ReleaseError(f"{names[0]} is not that of requirements/")
        error = JsonStrictValidator(SchemaVersion.V1_6).validate_str(archive.read(names[0]).decode())
    if error is not None:
        raise ReleaseError(f"{names[0]} is no CycloneDX 1.6: {error}")
    return f"bill of materials: {names[0]}, CycloneDX 1.6"


def looked_at(*words: str | Path) -> str:
    """A program of others over the files."""
    done = subprocess.run((sys.executable, "-m", *words), check=False, capture_output=True, text=True)
    if done.returncode:
        raise ReleaseError(done.stdout + done.stderr)
    return " ".join(str(word) for word in words if not isinstance(word, Path)).replace("_", "-")


def tokens(found: Sequence[Token]) -> Iterator[Token]:
    """Everything in a page of Markdown."""
    for token in found:
        yield token
        yield from tokens(token.children or ())


def dead_links(text: str) -> list[str]:
    """Links and pictures that lead nowhere when a page stands alone: without an address, or to no heading of it."""
    from markdown_it import MarkdownIt

    page = [*tokens(MarkdownIt("commonmark").enable("table").parse(text))]
    targets = [str(token.attrs.get("href", token.attrs.get("src", ""))) for token in page]
    headings = [re.sub(r"[^\w\- ]", "", line).replace(" ", "-") for line in re.findall(r"(?m)^#+ (.+)$", text.lower())]
    there = re.compile("|".join(["https://.+", "mailto:.+", *(re.escape(f"#{name}") for name in headings)]))
    return [target for target in targets if target and not there.fullmatch(target)]


def index_page(wheel: Path) -> str:
    """README.md as the index shows it."""
    with zipfile.ZipFile(wheel) as archive:
        (name,) = (name for name in archive.namelist() if name.endswith(".dist-info/METADATA"))
        metadata = Parser().parsestr(archive.read(name).decode())
    text = str(metadata.get_payload())
    if dead := dead_links(text):
        raise ReleaseError(f"README.md, when it stands alone, has dead links: {', '.join(dead)}")
    return f"README.md alone: {len(text.splitlines())} lines without a dead link"


def without_address() -> str:
    """The addresses that nobody has given."""
    missing = [name for name, value in addresses().items() if not value]
    return f"not given in src/pidcfg/about.py: {', '.join(missing)}" if missing else "all addresses are given"


# --- the release ------------------------------------------------------------------------------------------------------


def look(work: Path, today: str) -> Iterator[str]:
    """Every step as a line; raises `ReleaseError` at the first one that does not hold."""
    yield committed()
    yield version()
    yield changelog(today)
    yield tag()
    files = build_twice(work, today)
    yield sums_of(files)
    (wheel,) = (path for path in files if path.suffix == ".whl")
    yield bill_of_materials(wheel)
    yield looked_at("twine", "check", "--strict", *files)
    yield looked_at("check_wheel_contents", wheel)
    yield index_page(wheel)
    yield without_address()


def make(work: Path, today: str) -> None:
    """Dates the changelog, commits, tags and puts the files into dist/."""
    log, name = ROOT / CHANGELOG, f"v{pidcfg.__version__}"
    log.write_text(dated(log.read_text("utf-8"), today), "utf-8", newline="\n")
    git("commit", "--quiet", "--message", f"Release {pidcfg.__version__}", CHANGELOG)
    git("tag", "--annotate", "--message", f"pidcfg {pidcfg.__version__}", name)
    shutil.rmtree(ROOT / "dist", ignore_errors=True)
    shutil.copytree(work / "one" / "dist", ROOT / "dist")
    print(f"committed and tagged {name}, files in dist/; docs/release.md says how it is published")


def main(arguments: Sequence[str]) -> None:
    """Looks, and makes the release unless it is a dry run."""
    if not {*arguments} <= {"--dry-run"}:
        sys.exit(__doc__)
    today = datetime.now(UTC).date().isoformat()
    with tempfile.TemporaryDirectory() as name:
        try:
            for line in look(Path(name), today):
                print(line, flush=True)
            if not arguments:
                make(Path(name), today)
        except ReleaseError as error:
            sys.exit(f"no release: {error}")
    if arguments:
        print("a dry run: nothing was changed")


if __name__ == "__main__":
    main(sys.argv[1:])
