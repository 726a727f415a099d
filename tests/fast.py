"""`python tasks.py test --fast`: the tests without those that take long, and how it is known which these are.

``tests/slow.txt`` names them, a function a line, with all of its cases. `pytest --numprocesses auto --write-slow`
runs everything and writes it anew: the functions that took most, until what is left fits into `FAST`.
"""

from __future__ import annotations

from collections import Counter
from pathlib import Path

SLOW = Path(__file__).with_name("slow.txt")
FAST = 20.0
"""Seconds of one processor that the fast tests may take, collecting them aside."""


def pytest_addoption(parser):
    group = parser.getgroup("pidcfg")
    group.addoption("--fast", action="store_true", help="leave out the tests that tests/slow.txt names")
    group.addoption("--write-slow", action="store_true", help="write tests/slow.txt by what this run takes")


def function_of(nodeid):
    """A test without its case: ``test_x.py::test_y``."""
    return nodeid.partition("[")[0].removeprefix("tests/")


def pytest_collection_modifyitems(config, items):
    if not config.getoption("--fast"):
        return
    slow = {*SLOW.read_text("utf-8").split()}
    left_out = [item for item in items if function_of(item.nodeid) in slow]
    config.hook.pytest_deselected(items=left_out)
    items[:] = [item for item in items if function_of(item.nodeid) not in slow]


class Durations:
    """What each test function takes; with several processes the one that hands out the tests sees them all."""

    def __init__(self):
        self.seconds = Counter()

    def pytest_runtest_logreport(self, report):
        self.seconds[function_of(report.nodeid)] += report.duration

    def pytest_sessionfinish(self):
        rest, slow = sum(self.seconds.values()), []
        for name, seconds in self.seconds.most_common():
            if rest <= FAST:
                break
            slow.append(name)
            rest -= seconds
        SLOW.write_text("".join(f"{name}\n" for name in sorted(slow)), "utf-8")


def pytest_configure(config):
    if config.getoption("--write-slow") and not hasattr(config, "workerinput"):
        config.pluginmanager.register(Durations())


def pytest_report_header(config):
    if config.getoption("--fast"):
        return f"fast: without the {len(SLOW.read_text('utf-8').split())} test functions of tests/slow.txt"
    return None
