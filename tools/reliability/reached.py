"""Which functions of the packages each test calls: a map that is made once, and read for each mutant."""

from __future__ import annotations

import ast
import cProfile
import functools
import json
import os
import re
import signal
import sys
import threading
from collections import Counter, defaultdict
from pathlib import Path
from types import CodeType
from typing import TYPE_CHECKING

import pytest

from reliability.copies import cpu, in_a_copy
from reliability.mutants import PACKAGES, SOURCE, Mutant, text_of
from reliability.users import users

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Sequence

ROOT = SOURCE.parent
MAP = ROOT / "build" / "reached.json"
BUDGET = 8.0
"""Seconds of CPU that the tests of a mutant took when the map was made: one of the first ends it, or hardly any."""
SLOWEST = 3.0
"""Seconds of CPU of a test that is in the map at all; one that takes longer is ended."""
CODE = re.compile(r"\b[A-Z]{2,3}\d{3}\b")
"""The code of a rule."""
LEFT_OUT = frozenset((
    "browser", "site", "cluster", "live", "live_endings", "watch", "ci", "setup", "pages", "repository",
    "layers", "generated", "code_pages", "coverage_pages", "report_pages", "pictures", "reliability", "compile",
    "click_compile", "dl06_compile", "dpide_compile", "ezlogix_compile", "generic_compile", "nextopid_compile",
    "engines", "jobs", "threads", "environment",
))  # fmt: skip
"""Tests of other things: documents, processes, compiled copies of the code, which would differ from what is changed."""


def test_files() -> list[str]:
    """The files whose tests may end a mutant."""
    paths = sorted((ROOT / "tests").glob("test_*.py"))
    return [str(path.relative_to(ROOT)) for path in paths if path.stem.removeprefix("test_") not in LEFT_OUT]


def mapped_files() -> list[str]:
    """Those of the map."""
    return sorted({name.partition("::")[0] for name in json.loads(MAP.read_text("utf-8"))})


def key_of(path: str, name: str) -> str:
    """A function of a module, whatever is defined in it."""
    return f"{path}::{name.partition('.<locals>')[0]}"


class Session:
    """A pytest session that does its own work with the tests that were collected."""

    def __init__(self, work: Callable[[Session], None]) -> None:
        self.work, self.items = work, dict[str, pytest.Item]()
        self.failed, self.mapping = False, False
        self.loaded = set[str]()
        """Functions that were called while the tests and what they import were loaded."""
        self.profile = cProfile.Profile(builtins=False)
        self.profile.enable()

    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        self.profile.disable()
        self.loaded = _called(self.profile)
        self.items = {item.nodeid: item for item in session.items}
        self.work(self)
        return True

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        self.failed |= report.failed
        if report.failed and not self.mapping:
            os._exit(1)

    def run(self, names: Sequence[str]) -> None:
        """The tests one after the other; ends the process where one fails."""
        items = [self.items[name] for name in names]
        for item, following in zip(items, [*items[1:], None], strict=True):
            item.config.hook.pytest_runtest_protocol(item=item, nextitem=following)


# --- the map ---------------------------------------------------------------------------------------------------------


def make_map(session: Session) -> None:
    """Which functions of the packages each test calls, a test file in each copy of the process."""
    files = defaultdict(list)
    for name in session.items:
        files[name.partition("::")[0]].append(name)
    MAP.parent.mkdir(exist_ok=True)
    for file, names in files.items():
        code, part = in_a_copy(functools.partial(_reached, session, names), 1200, silent=True)
        sys.stdout.write(f"{file} {len(names)} {len(part or ())} {code}\n")
        sys.stdout.flush()
        found = json.loads(MAP.read_text("utf-8")) if MAP.exists() else {}
        MAP.write_text(json.dumps(found | (part or {})), "utf-8")


def _reached(session: Session, names: Sequence[str]) -> dict[str, tuple[float, list[str]]]:
    """Seconds of CPU and functions of each test that passes."""
    found, session.mapping = {}, True
    elsewhere = set[CodeType]()
    threading.setprofile(lambda frame, *_: elsewhere.add(frame.f_code))
    signal.signal(signal.SIGPROF, lambda *_: pytest.fail("takes too long"))
    for name, following in zip(names, [*names[1:], None], strict=True):
        after = session.items[following] if following else None
        profile, before, session.failed = cProfile.Profile(builtins=False), cpu(), False
        elsewhere.clear()
        signal.setitimer(signal.ITIMER_PROF, SLOWEST)
        profile.enable()
        session.items[name].config.hook.pytest_runtest_protocol(item=session.items[name], nextitem=after)
        profile.disable()
        signal.setitimer(signal.ITIMER_PROF, 0)
        seconds = cpu() - before
        if not session.failed and seconds < SLOWEST:
            found[name] = (round(seconds, 4), sorted(_called(profile, *elsewhere)))
    return found


def _called(profile: cProfile.Profile, *elsewhere: CodeType) -> set[str]:
    """The functions of the packages that a profile has seen, or other threads have run."""
    folders, length = tuple(f"{SOURCE / folder}/" for folder in PACKAGES.values()), len(str(SOURCE)) + 1
    codes = (*elsewhere, *(entry.code for entry in profile.getstats()))
    return {
        key_of(code.co_filename[length:], code.co_qualname)
        for code in codes
        if isinstance(code, CodeType) and code.co_filename.startswith(folders)
    }


class Reached:
    """The map: tests by function."""

    def __init__(self, budget: float = BUDGET, loaded: Collection[str] = ()) -> None:
        self.budget, self.loaded = budget, loaded
        tests = json.loads(MAP.read_text("utf-8"))
        self.seconds = {name: seconds for name, (seconds, _) in tests.items()}
        self.width = {name: len(keys) for name, (_, keys) in tests.items()}
        self.by_key = defaultdict[str, list[str]](list)
        for name, (_, keys) in tests.items():
            for key in keys:
                self.by_key[key].append(name)

    def tests(self, mutant: Mutant) -> list[str]:
        """The tests of a mutant, the quick and particular ones first, as many as the budget holds.

        Those that call its function; where none does, or it stands in a table or in what makes one while modules are
        loaded, those that call what uses it.
        """
        key = key_of(mutant.path, mutant.scope[0])
        names = self.by_key.get(key) if mutant.scope[0] and key not in self.loaded else None
        chosen, spent = [], 0.0
        for name in self._ordered(names or self._of_users(mutant), mutant, narrow=bool(names)):
            if spent + self.seconds[name] <= self.budget:
                chosen.append(name)
                spent += self.seconds[name]
        return chosen

    def _ordered(self, names: Sequence[str], mutant: Mutant, *, narrow: bool) -> list[str]:
        """By what a test costs, how much else it calls and whether its file is about the module's subject.

        A function's tests with many parameters take turns with the others. Those that name a rule's code come first,
        since every rule is called by every test of its vendor, and of a table those whose file imports it.
        """
        turns, words, cost = Counter[str](), _words(mutant.path), dict[str, float]()
        near, far = codes_near(mutant)
        files = set[str]() if narrow else importing_files(mutant.path)
        for name in sorted(names, key=lambda name: (self.seconds[name], name)):
            file, test = name.partition("[")[0].split("::", 1)
            kin = len(words & _words(Path(file).stem))
            turns[file + test] += 1
            width = self.width[name] if narrow else 1
            cost[name] = (self.seconds[name] + 0.01) * width * turns[file + test] / (1 + 2 * kin) ** 2
            cost[name] *= 0.01 if file in files else 1.0
            named = {*CODE.findall(name)}
            cost[name] *= 0.0001 if named & near else 0.01 if named & far else 1.0
        return sorted(cost, key=lambda name: (cost[name], name))

    def _of_users(self, mutant: Mutant) -> list[str]:
        """The tests that call a function which needs what a mutant changes, and those whose file imports its module."""
        keys = [key_of(*user) for user in users(mutant, self._is_called)]
        keys += [key_of(mutant.path, mutant.scope[0])]
        files = importing_files(mutant.path)
        found = {name for key in keys for name in self.by_key.get(key, ())}
        found |= {name for name in self.seconds if name.partition("::")[0] in files}
        if not found:
            prefix = f"{mutant.path}::"
            found = {name for key, names in self.by_key.items() if key.startswith(prefix) for name in names}
        return sorted(found)

    def _is_called(self, path: str, function: str) -> bool:
        key = key_of(path, function)
        return key in self.by_key and key not in self.loaded


def importing_files(path: str) -> set[str]:
    """The test files that import a module."""
    holder, _, name = path.removesuffix(".py").replace("/", ".").rpartition(".")
    lines = re.compile(rf"^(from {holder}\.{name} import |from {holder} import .*\b{name}\b)", re.MULTILINE)
    files = (ROOT / "tests").glob("test_*.py")
    return {str(file.relative_to(ROOT)) for file in files if lines.search(file.read_text("utf-8"))}


def codes_near(mutant: Mutant) -> tuple[set[str], set[str]]:
    """The codes of rules in the function of a mutant, or none; and in its module."""
    text = text_of(mutant.path)
    parts = [
        part
        for part in ast.parse(text).body
        if isinstance(part, ast.FunctionDef | ast.ClassDef) and part.lineno <= mutant.line <= (part.end_lineno or 0)
    ]
    return {code for part in parts for code in CODE.findall(ast.unparse(part))}, {*CODE.findall(text)}


def _words(path: str) -> set[str]:
    """The words of a file's place that tell its subject."""
    return set(re.split(r"[/_.]", path)) - {"pidcfg", "py", "test", "tests", "encode", "decode", "read", "write"}
