"""Which functions of the four packages each test calls: a map that is made once, and read for each mutant."""

from __future__ import annotations

import functools
import json
import os
import sys
from collections import defaultdict
from typing import TYPE_CHECKING, Any

import pytest

from reliability.copies import in_a_copy
from reliability.mutants import PACKAGES, SOURCE, Mutant, text_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from pathlib import Path

ROOT = SOURCE.parent
MAP = ROOT / "build" / "reached.json"
BUDGET = 25.0
"""Seconds that the tests of a mutant took when the map was made."""
SLOWEST = 8.0
"""Seconds of a test that is in the map at all."""
LEFT_OUT = (
    "browser", "site", "cluster", "live", "serve", "watch", "ci", "setup", "pages", "repository", "layers", "generated",
    "code_pages", "reliability", "compile", "engines", "jobs", "threads", "environment", "report_pages", "pictures",
)  # fmt: skip
"""Tests of other things: documents, processes, compiled copies of the code, which would differ from what is changed."""


def test_files() -> list[Path]:
    """The files whose tests may end a mutant."""
    return [
        path for path in sorted((ROOT / "tests").glob("test_*.py")) if not any(word in path.stem for word in LEFT_OUT)
    ]


def key_of(path: str, name: str) -> str:
    """A function of a module, whatever is defined in it."""
    return f"{path}::{name.partition('.<locals>')[0]}"


class Session:
    """A pytest session that does its own work with the tests that were collected."""

    def __init__(self, work: Callable[[Session], None]) -> None:
        self.work, self.items = work, dict[str, pytest.Item]()
        self.failed, self.seconds = False, 0.0
        self.called: set[Any] | None = None

    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        self.items = {item.nodeid: item for item in session.items}
        self.work(self)
        return True

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        self.failed |= report.failed
        self.seconds += report.duration
        if report.failed and self.called is None:
            os._exit(1)

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_setup(self) -> Iterator[None]:
        return (yield from self._traced())

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_call(self) -> Iterator[None]:
        return (yield from self._traced())

    def _traced(self) -> Iterator[None]:
        called = self.called
        if called is not None:
            sys.settrace(lambda frame, *_: called.add(frame.f_code))
        try:
            return (yield)
        finally:
            sys.settrace(None)

    def run(self, names: Sequence[str]) -> None:
        """The tests one after the other; ends the process where one fails."""
        items = [self.items[name] for name in names]
        for item, following in zip(items, [*items[1:], None], strict=True):
            item.config.hook.pytest_runtest_protocol(item=item, nextitem=following)


# --- the map ---------------------------------------------------------------------------------------------------------


def make_map(session: Session) -> None:
    """Which functions of the four packages each test calls, a test file in each copy of the process."""
    files = defaultdict(list)
    for name in session.items:
        files[name.partition("::")[0]].append(name)
    found: dict[str, Any] = json.loads(MAP.read_text("utf-8")) if MAP.exists() else {}
    MAP.parent.mkdir(exist_ok=True)
    for file, names in files.items():
        code, part = in_a_copy(functools.partial(_reached, session, names), 1200, silent=True)
        sys.stdout.write(f"{file} {len(names)} {len(part or ())} {code}\n")
        found |= part or {}
        MAP.write_text(json.dumps(found), "utf-8")


def _reached(session: Session, names: Sequence[str]) -> dict[str, tuple[float, list[str]]]:
    """Seconds and functions of each test that passes; what fixtures call counts for all tests of the file."""
    found, folders = {}, tuple(f"{SOURCE / folder}/" for folder in PACKAGES.values())
    for name, following in zip(names, [*names[1:], None], strict=True):
        session.called, session.failed, session.seconds = set(), False, 0.0
        after = session.items[following] if following else None
        session.items[name].config.hook.pytest_runtest_protocol(item=session.items[name], nextitem=after)
        calls = {code for code in session.called if code.co_filename.startswith(folders)}
        if not session.failed and session.seconds < SLOWEST:
            length = len(str(SOURCE)) + 1
            keys = {key_of(code.co_filename[length:], code.co_qualname) for code in calls}
            found[name] = (round(session.seconds, 4), sorted(keys))
    return found


class Reached:
    """The map: tests by function."""

    def __init__(self) -> None:
        tests = json.loads(MAP.read_text("utf-8"))
        self.seconds = {name: seconds for name, (seconds, _) in tests.items()}
        self.width = {name: len(keys) for name, (_, keys) in tests.items()}
        self.by_key = defaultdict[str, list[str]](list)
        for name, (_, keys) in tests.items():
            for key in keys:
                self.by_key[key].append(name)

    def tests(self, mutant: Mutant) -> list[str]:
        """The tests of a mutant, the most particular first, as many as the budget holds."""
        key = key_of(mutant.path, mutant.scope[0])
        names = self.by_key.get(key) if mutant.scope[0] else None
        chosen, spent = [], 0.0
        order = 1 if names else -1  # a table concerns the tests that go all the way through
        for name in sorted(names or self._of_module(mutant.path), key=lambda name: (order * self.width[name], name)):
            if spent + self.seconds[name] <= BUDGET:
                chosen.append(name)
                spent += self.seconds[name]
        return chosen

    def _of_module(self, path: str) -> list[str]:
        """The tests that call anything in a module, or in those that import it where it has no functions."""
        found = self._calling(path)
        return found or sorted({name for other in importers(path) for name in self._calling(other)})

    def _calling(self, path: str) -> list[str]:
        prefix = f"{path}::"
        return sorted({name for key, names in self.by_key.items() if key.startswith(prefix) for name in names})


@functools.cache
def importers(path: str) -> list[str]:
    """The modules that import one."""
    name = path.removesuffix(".py").removesuffix("/__init__").replace("/", ".")
    words = (f"from {name} import", f"import {name}\n")
    paths = (file.relative_to(SOURCE).as_posix() for file in sorted(SOURCE.rglob("*.py")))
    return [other for other in paths if any(word in text_of(other) for word in words)]
