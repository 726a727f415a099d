"""Everything that is generated and committed; ``python tasks.py generate`` writes anew what differs, and names it.

``--check`` writes nothing and ends with 1 where a file differs. Names of parts renew these alone:
``python tests/generated.py pages messages``. Read the difference before committing it: a golden file says what the
words, the trend or the message were when somebody looked.
"""

from __future__ import annotations

import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING

import case_messages
import changed_runs
import explained
import golden
import mistakes
import spoiled_configurations
import spoiled_listings
import test_pictures

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

ROOT = Path(__file__).parents[1]
sys.path += [str(ROOT / "docs"), str(ROOT / "tools")]


def pages() -> dict[Path, bytes]:
    """Pages and schemas of docs/, and the codes that shells complete."""
    import generate

    return {(generate.DOCS / name).resolve(): text.encode() for name, text in generate.pages().items()}


def messages() -> dict[Path, bytes]:
    """What every rule says about its case files."""
    return {case_messages.GOLDEN: case_messages.messages().encode()}


def places() -> dict[Path, bytes]:
    """Files that repeat the version or an address of the project."""
    from release import places

    return places.files()


PARTS: dict[str, Callable[[], Mapping[Path, bytes]]] = {
    "pages": pages,
    "places": places,
    "messages": messages,
    "typical": mistakes.golden_files,
    "listings": spoiled_listings.golden_files,
    "configurations": spoiled_configurations.golden_files,
    "runs": changed_runs.golden_files,
    "explained": explained.golden_files,
    "reports": golden.report_files,
    "pictures": test_pictures.golden_files,
    "examples": golden.example_files,
}
"""Each part by the name that renews it alone, those first that most changes touch."""
WHOLE = {"configurations", "examples", "explained", "listings", "reports", "runs"}
"""Parts whose folders hold nothing else, but for the configurations that they are made of."""


def make(part: str) -> Mapping[Path, bytes]:
    """The files of a part, as they ought to be."""
    return PARTS[part]()


def make_all(parts: Sequence[str]) -> Iterator[Mapping[Path, bytes]]:
    """The files of each part; several are made beside each other, since none is made of what another one writes."""
    if len(parts) == 1:
        yield make(parts[0])
        return
    with ProcessPoolExecutor() as pool:
        yield from pool.map(make, parts)


def renew(files: Mapping[Path, bytes], *, check: bool = False, whole: bool = False) -> list[str]:
    """Writes the files that differ and removes those that are no longer made; the names of all of them."""
    folders = {path.parent for path in files} if whole else set()
    left_over = {path for folder in folders for path in folder.iterdir() if path.suffix != ".yaml"} - {*files}
    differing = [path for path, data in files.items() if not path.exists() or path.read_bytes() != data]
    if not check:
        for path in differing:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(files[path])
        for path in left_over:
            path.unlink()
    return sorted(
        path.relative_to(ROOT).as_posix() if path.is_relative_to(ROOT) else str(path)
        for path in (*differing, *left_over)
    )


def main(arguments: Sequence[str]) -> None:
    """Renews the named parts, or all."""
    check = "--check" in arguments
    named = [name for name in arguments if name != "--check"]
    if not {*named} <= {*PARTS}:
        sys.exit(f"the parts are {', '.join(PARTS)}")
    parts, differing = named or list(PARTS), []
    for part, files in zip(parts, make_all(parts), strict=True):
        names = renew(files, check=check, whole=part in WHOLE)
        print(f"{part}: {', '.join(names) if names else 'up to date'}", flush=True)  # noqa: T201 - a script
        differing += names
    if check and differing:
        sys.exit("stale; run python tasks.py generate")


if __name__ == "__main__":
    main(sys.argv[1:])
