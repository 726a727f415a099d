"""The calls from several threads at once, with the parser in C and with the one in Python."""

from __future__ import annotations

import sys
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from threading import local

import pytest
import ruamel.yaml

import pidcfg
from pidcfg.text import source

ROOT = Path(__file__).parents[1]
FILES = [
    *(path for path in sorted(ROOT.glob("examples/*/*.yaml")) if path.parent.name != "nextopid"),
    *sorted(ROOT.glob("tests/cases/PID0*.yaml")),
    *sorted(ROOT.glob("tests/cases/PID1*.yaml"))[::6],
]


@pytest.fixture(params=[False, True], ids=["c", "python"])
def parsers(request, monkeypatch):
    """New readers, of one kind; threads take turns as often as Python can."""
    monkeypatch.setattr(ruamel.yaml, "YAML", partial(ruamel.yaml.YAML, pure=request.param))
    monkeypatch.setattr(source, "THREAD", local())
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(interval)


def findings(path):
    """What a check says of a file, comments of the file included."""
    return pidcfg.check(path).to_json()


def test_files_that_are_checked_at_once_have_their_own_findings(parsers):
    alone = [findings(path) for path in FILES]
    assert sum(bool(result["findings"]) for result in alone) > 5
    with ThreadPoolExecutor(8) as pool:
        assert list(pool.map(findings, FILES)) == alone


def test_a_text_that_breaks_off_leaves_nothing_to_the_next(parsers):
    good = findings(FILES[0])
    for text in ("a: [1, {b: 'c", "a: b: c", "- 1\n\t- 2", "&a [*a", "a: |\n  b\n c"):
        assert not pidcfg.check(text).ok
        assert findings(FILES[0]) == good
