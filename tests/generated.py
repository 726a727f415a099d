"""Everything that is generated and committed; ``python tasks.py generate`` writes anew what differs, and names it.

Where nothing but rules of some vendors has changed since the branch left its main line, what is made of other vendors
alone stays as it is; ``--all`` renews that, too. ``--check`` writes nothing and ends with 1 where a file differs. Names
of parts renew these alone: ``python tests/generated.py pages messages``. Read the difference before committing it: a
golden file says what the words, the trend or the message were when somebody looked.
"""

from __future__ import annotations

import re
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import case_messages
import changed_runs
import explained
import golden
import mistakes
import refused
import spoiled_configurations
import spoiled_listings
import test_pictures
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

ROOT = Path(__file__).parents[1]
sys.path += [str(ROOT / "docs"), str(ROOT / "tools")]


def pages(*, of_rules: bool = False) -> dict[Path, bytes]:
    """Pages and schemas of docs/, and the codes that shells complete; or those alone that rules stand in."""
    import generate

    found = generate.pages_of_rules() if of_rules else generate.pages()
    return {(generate.DOCS / name).resolve(): text.encode() for name, text in found.items()}


def messages(wanted: Callable[[str], bool] = bool) -> dict[Path, bytes]:
    """What every rule says about its case files."""
    return {case_messages.GOLDEN: case_messages.messages(wanted).encode()}


def places() -> dict[Path, bytes]:
    """Files that repeat the version or an address of the project."""
    from release import places

    return places.files()


PARTS: dict[str, Callable[[], Mapping[Path, bytes]]] = {
    "pages": pages,
    "places": places,
    "messages": messages,
    "typical": mistakes.golden_files,
    "refused": refused.golden_files,
    "listings": spoiled_listings.golden_files,
    "configurations": spoiled_configurations.golden_files,
    "runs": changed_runs.golden_files,
    "explained": explained.golden_files,
    "reports": golden.report_files,
    "pictures": test_pictures.golden_files,
    "examples": golden.example_files,
}
"""Each part by the name that renews it alone, those first that most changes touch."""
BY_VENDOR: dict[str, Callable[[Callable[[str], bool]], Mapping[Path, bytes]]] = {
    "messages": messages,
    "typical": mistakes.golden_files,
    "reports": golden.report_files,
    "listings": spoiled_listings.golden_files,
    "configurations": spoiled_configurations.golden_files,
    "runs": changed_runs.golden_files,
    "explained": explained.golden_files,
    "examples": golden.example_files,
}
"""Parts of whose files it can be told which vendors they are made of."""
WHOLE = {"configurations", "examples", "explained", "listings", "refused", "reports", "runs"}
"""Parts whose folders hold nothing else, but for the configurations that they are made of."""

BRANCHES = ("origin/HEAD", "origin/main", "main")
"""Names that the main line may have, the first that there is."""
RULES = re.compile(rf"src/pidcfg/validate/rules/({'|'.join(VENDORS)})(\.py|/.*)")
UNREAD = re.compile(
    r"tests/(test_(?!pictures)\w+\.py|cases/.*|slow\.txt|typical/\w+\.txt)|CHANGELOG\.md"
    r"|docs/(rules[\w-]*|decisions|[\w-]*coverage|adding-[\w-]+)\.md|src/pidcfg/(validate/rules\.json|cli/completions/.*)"
)
"""What golden files are not made of, and what is made anew for any rule."""
GOLDEN = re.compile(r"tests/data/.*\.txt|examples/\w+/golden/.*")


def changed_files() -> list[str]:
    """The files that differ from the commit at which the branch left its main line; none: nobody knows."""
    for branch in BRANCHES:
        base = _git("merge-base", "HEAD", branch)
        if base:
            return [
                *_git("diff", "--name-only", "--no-renames", *base),
                *_git("ls-files", "--others", "--exclude-standard"),
            ]
    return []


def _git(*words: str) -> list[str]:
    try:
        done = subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=False, encoding="utf-8")
    except OSError:
        return []
    return [] if done.returncode else done.stdout.splitlines()


def vendors_of_rules(changed: Sequence[str]) -> set[str]:
    """The vendors whose rules have changed; none: something else has, too, or nothing has."""
    vendors = {found[1] for path in changed if (found := RULES.fullmatch(path))}

    def is_made_of_them(path: str) -> bool:
        return bool(GOLDEN.fullmatch(path)) and concerns(vendors, path)

    others = (path for path in changed if not RULES.fullmatch(path) and not UNREAD.fullmatch(path))
    return vendors if all(map(is_made_of_them, others)) else set()


def concerns(vendors: set[str], name: str) -> bool:
    """Whether one of the vendors is in the name of a golden file, or of what it is made of."""
    return bool(vendors & {*re.split(r"[-/.]", name)})


def make(vendors: set[str], part: str) -> Mapping[Path, bytes]:
    """The files of a part, as they ought to be; of some vendors alone where there are any."""
    if vendors and part == "pages":
        return pages(of_rules=True)
    if vendors and part in BY_VENDOR:
        return BY_VENDOR[part](partial(concerns, vendors))
    return PARTS[part]()


def make_all(parts: Sequence[str], vendors: set[str]) -> Iterator[Mapping[Path, bytes]]:
    """The files of each part; several are made beside each other, since none is made of what another one writes."""
    if len(parts) == 1:
        yield make(vendors, parts[0])
        return
    with ProcessPoolExecutor() as pool:
        yield from pool.map(partial(make, vendors), parts)


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
    named = [name for name in arguments if name not in {"--check", "--all"}]
    if not {*named} <= {*PARTS}:
        sys.exit(f"the parts are {', '.join(PARTS)}")
    parts, differing = named or list(PARTS), []
    vendors = set[str]() if arguments else vendors_of_rules(changed_files())
    if vendors:
        print(f"nothing but rules of {', '.join(sorted(vendors))} has changed; --all renews what others have, too")  # noqa: T201
    for part, files in zip(parts, make_all(parts, vendors), strict=True):
        names = renew(files, check=check, whole=part in WHOLE and not vendors)
        print(f"{part}: {', '.join(names) if names else 'up to date'}", flush=True)  # noqa: T201 - a script
        differing += names
    if check and differing:
        sys.exit("stale; run python tasks.py generate")


if __name__ == "__main__":
    main(sys.argv[1:])
