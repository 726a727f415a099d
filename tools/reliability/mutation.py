"""Mutants against the tests that reach them: `python tasks.py mutants --package encoders --count 150`.

First a map is made, once: which functions each test calls; `--map FILES` makes parts of it. Then each mutant runs the
tests that call its function, the quick and particular ones first, until one fails. It is put into the code of a copy of
this process; one that changes what a module does while it is loaded runs as a file in a copy of the tree.
"""

from __future__ import annotations

import argparse
import ast
import functools
import gc
import importlib
import os
import resource
import shutil
import subprocess
import sys
import tempfile
from collections import Counter, defaultdict
from itertools import islice
from pathlib import Path
from types import FunctionType, MappingProxyType
from typing import TYPE_CHECKING, Any

import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))
sys.path.insert(0, str(Path(__file__).parents[1]))

from reliability import figures
from reliability.copies import BROKEN, WAITING, in_a_copy
from reliability.mutants import PACKAGES, SOURCE, Mutant, changed_codes, drawn, equal, mutants, tree_of
from reliability.reached import BUDGET, MAP, ROOT, Reached, Session, key_of, make_map, mapped_files, test_files

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

SECONDS = 60
"""Of CPU for a mutant's tests; one that needs more does not end."""
PATIENT = 40.0
"""Seconds of the tests of a mutant that is tried again: there are few of them."""
QUIET = ("-q", "-p", "no:cacheprovider", "-p", "reliability.plain", "--assert=plain", "--tb=no")
"""Options of pytest: that a test fails is enough."""
LEFT = ("lives", "unreached")
"""Ends of a mutant that no test has ended."""
FILES = 8
"""Test files that are loaded for a mutant in a copy of the tree."""


class Runner:
    """Tries mutants: in this process's copies, and as files in a copy of the tree."""

    def __init__(self, session: Session, folder: Path, budget: float) -> None:
        self.session, self.reached, self.folder = session, Reached(budget, session.loaded), folder
        for part in PACKAGES.values():
            for path in sorted((SOURCE / part).rglob("*.py")):
                importlib.import_module(".".join(path.relative_to(SOURCE).with_suffix("").parts))
        self.functions = defaultdict[Any, list[FunctionType]](list)
        gc.unfreeze()  # what the tests' collection has frozen is looked through as well
        for thing in gc.get_objects():
            if isinstance(thing, FunctionType) and thing.__code__.co_filename.startswith(str(SOURCE)):
                code = thing.__code__
                self.functions[code.co_filename, code.co_qualname, code.co_firstlineno].append(thing)
        self.caches = [thing for thing in gc.get_objects() if isinstance(thing, functools._lru_cache_wrapper)]
        gc.freeze()

    def judge(self, mutant: Mutant) -> str:
        """How a mutant ends: ``failed``, ``time``, ``lives``, or ``unreached`` where no test calls its function."""
        names = [name for name in self.reached.tests(mutant) if name in self.session.items]
        if not names:
            return "unreached"
        if mutant.scope[0]:
            code, _ = in_a_copy(lambda: self._changed(mutant, names), SECONDS, silent=True)
            if code not in {0, BROKEN}:
                return "time" if code < 0 else "failed"
            if not code and key_of(mutant.path, mutant.scope[0]) not in self.session.loaded:
                return "lives"
        return self._as_file(mutant, names)

    def control(self, mutant: Mutant) -> str:
        """The same tests on the code as it is; ``unreached`` where there are none."""
        names = [name for name in self.reached.tests(mutant) if name in self.session.items]
        if not names:
            return "unreached"
        code, _ = in_a_copy(lambda: self.session.run(names), SECONDS, silent=True)
        return "lives" if not code else "failed"

    def _changed(self, mutant: Mutant, names: list[str]) -> None:
        put = 0
        for (name, line), code in changed_codes(mutant).items():
            for function in self.functions[str(SOURCE / mutant.path), name, line]:
                function.__code__ = code
                put += 1
        if not put:
            raise LookupError(mutant)
        for cached in self.caches:
            cached.cache_clear()
        self.session.run(names)

    def _as_file(self, mutant: Mutant, names: Sequence[str]) -> str:
        """The mutant in a copy of the tree, with the tests of a few files."""
        files = list(dict.fromkeys(name.partition("::")[0] for name in names))[:FILES]
        chosen = [name for name in names if name.partition("::")[0] in files]
        path, arguments = self.folder / "src" / mutant.path, self.folder / "names.txt"
        arguments.write_text("".join(f"{name}\n" for name in chosen), "utf-8")
        before = path.read_text("utf-8")
        path.write_text(ast.unparse(tree_of(mutant, mutant.path)), "utf-8")
        command = [sys.executable, "-m", "pytest", "-x", *QUIET, f"@{arguments}"]
        limit = functools.partial(resource.setrlimit, resource.RLIMIT_CPU, (2 * SECONDS, 2 * SECONDS))
        environment = {
            **os.environ,
            "PYTHONPATH": os.pathsep.join(str(self.folder / part) for part in ("src", "tools", "tests")),
        }
        try:
            code = subprocess.run(
                command, cwd=self.folder, env=environment, capture_output=True, check=False, preexec_fn=limit,
                timeout=WAITING * SECONDS,
            ).returncode  # fmt: skip
        except subprocess.TimeoutExpired:
            code = -1
        path.write_text(before, "utf-8")
        return "time" if code < 0 else "failed" if code else "lives"


def copied(folder: Path) -> Path:
    """A copy of the tree for mutants to stand in."""
    for name in ("src", "tests", "tools", "examples", "docs"):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    for path in ROOT.glob("*.*"):
        if path.is_file():
            shutil.copy(path, folder)
    return folder


def campaign(session: Session, options: argparse.Namespace) -> None:
    """So many valid mutants of each package, and a control run for every tenth of them."""
    with tempfile.TemporaryDirectory() as name:
        runner, same = Runner(session, copied(Path(name)), options.budget), equal()

        def judge(mutant: Mutant) -> str:
            return "equal" if mutant.is_in(same) else runner.judge(mutant)

        for package in options.package or PACKAGES:
            if options.again:
                for mutant, end in again(package, options.seed, judge):
                    _say(end, mutant)
            else:
                first_run(package, options, runner, judge)
            if not options.only:
                _renew_page()


def _renew_page() -> None:
    """The page with the new figures; loaded here, as it loads the product, which the profile must see."""
    from reliability.page import PAGE, page

    PAGE.write_text(page(figures.kept()), "utf-8")


def first_run(package: str, options: argparse.Namespace, runner: Runner, judge: Callable[[Mutant], str]) -> None:
    """Mutants in the order of the seed, up to the count."""
    found = Figures(options.seed, figures.run_of(f"mutants-{package}", options.seed) if options.on else {})
    for mutant in chosen(package, options):
        if sum(found.ends.values()) == options.count:
            break
        end = judge(mutant)
        found.add(mutant, end)
        _say(end, mutant)
        if sum(found.ends.values()) % 10 == 1:
            found.control[runner.control(mutant)] += 1
        if not options.only:
            figures.keep(f"mutants-{package}", vars(found))
    sys.stdout.write(f"{package} {dict(found.ends)} control {dict(found.control)}\n")


def _say(end: str, mutant: Mutant | None) -> None:
    sys.stdout.write(f"{end:9} {mutant or ''}\n")
    sys.stdout.flush()


class Figures:
    """How the mutants of a package ended, at first and now, and by name those that no test ended."""

    def __init__(self, seed: int, kept: Mapping[str, Any] = MappingProxyType({})) -> None:
        self.seed, self.control = seed, Counter(kept.get("control", ()))
        self.first, self.ends = Counter(kept.get("first", ())), Counter(kept.get("ends", ()))
        self.left = list[str](kept.get("left", ()))

    def add(self, mutant: Mutant, end: str) -> None:
        """One more of a first run."""
        self.first[end] += 1
        self.ends[end] += 1
        self.left += [mutant.exact] if end in LEFT else []

    def change(self, name: str, mutant: Mutant | None, end: str) -> None:
        """One that was left ended like this now."""
        self.ends.subtract([next(one for one in LEFT if self.ends[one])])
        self.ends[end] += 1
        self.ends = +self.ends
        self.left.remove(name)
        self.left += [mutant.exact] if mutant and end in LEFT else []


def again(package: str, seed: int, judge: Callable[[Mutant], str]) -> Iterator[tuple[Mutant | None, str]]:
    """Those that a run left, tried again; ``gone`` where the code is not there any more."""
    found = Figures(seed, figures.run_of(f"mutants-{package}", seed))
    for name in list(found.left):
        mutant = now(name)
        end = judge(mutant) if mutant else "gone"
        found.change(name, mutant, end)
        figures.keep(f"mutants-{package}", vars(found))
        yield mutant, end


def now(name: str) -> Mutant | None:
    """A mutant by an earlier name: lines may stand elsewhere in the module now, but not its code."""
    path, _, rest = name.partition(":")
    line, _, change = rest.partition(" ")
    same = [m for m in mutants(path) if m.exact.partition(" ")[2] == change] if (SOURCE / path).is_file() else []
    return min(same, key=lambda mutant: abs(mutant.line - int(line)), default=None)


def chosen(package: str, options: argparse.Namespace) -> Iterable[Mutant]:
    """The mutants of a package in the order of the seed, or those of a line."""
    if not options.only:
        done = sum(figures.run_of(f"mutants-{package}", options.seed)["ends"].values()) if options.on else 0
        return islice(valid(drawn(package, options.seed)), done, None)
    path, _, line = options.only.partition(":")
    return valid(mutant for mutant in mutants(path) if not line or mutant.line == int(line))


def valid(found: Iterable[Mutant]) -> Iterator[Mutant]:
    """Those that compile to something else."""
    for mutant in found:
        if ast.dump(tree_of(mutant, mutant.path)) != ast.dump(tree_of(None, mutant.path)) and (
            not mutant.scope[0] or changed_codes(mutant)
        ):
            yield mutant


def main(arguments: list[str]) -> int:
    """Make the map or try mutants."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--map", action="store_true", help="make the map of the tests anew")
    parser.add_argument("--package", action="append", choices=[*PACKAGES])
    parser.add_argument("--count", type=int, default=150)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--budget", type=float, help=f"seconds of the tests of a mutant, {BUDGET:g} unless given")
    parser.add_argument("--on", action="store_true", help="go on behind those of the seed's run, up to the count")
    parser.add_argument("--again", action="store_true", help="only those that the seed's run left")
    parser.add_argument("--only", help="the mutants of pidcfg/module.py:line alone")
    parser.add_argument("files", nargs="*", help="test files, instead of all")
    options = parser.parse_args(arguments)
    options.budget = options.budget or (PATIENT if options.again else BUDGET)
    if options.only:
        options.package = [next(iter(PACKAGES))]
    os.environ["CI"] = "true"
    os.chdir(ROOT)
    files = options.files or (test_files() if options.map or not MAP.exists() else mapped_files())
    work = make_map if options.map or not MAP.exists() else lambda session: campaign(session, options)
    return int(pytest.main([*QUIET, "-s", "--import-mode=prepend", *files], plugins=[Session(work)]))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
