"""A share of the torture with fixed seeds: hostile files, changed examples and ended commands."""

from __future__ import annotations

import sys

import pytest

from reliability import fuzz, hostile, kills
from reliability.torture import PAGE, TEXT

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="timers and signals of POSIX")
SEED = 1
EVERY = 14
"""A case of so many is run: each kind of input and each way of spoiling comes up."""


@pytest.fixture
def _as_before():
    import signal

    handlers = {number: signal.getsignal(number) for number in (signal.SIGVTALRM, signal.SIGTERM, signal.SIGINT)}
    yield
    for number, handler in handlers.items():
        signal.signal(number, handler)


def test_there_are_enough_hostile_files_and_they_are_the_same_each_time():
    one, two = hostile.cases(SEED), hostile.cases(SEED)
    assert len(one) >= 700
    assert [case.data for case in one] == [case.data for case in two]
    assert len({case.name for case in one}) == len(one)


@pytest.mark.usefixtures("_as_before")
def test_hostile_files_end_in_findings(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    hostile.prepare(tmp_path)
    figures = hostile.Figures()
    for number, case in enumerate(hostile.cases(SEED)[::EVERY]):
        hostile.judge(case, tmp_path, hostile.CODE_PAGES[number % 4], figures, number)
    assert figures.failures == []
    assert (figures.tracebacks, figures.bugs, figures.hangs) == (0, 0, 0)
    assert figures.executions == figures.files >= 50


@pytest.mark.usefixtures("_as_before")
def test_a_traceback_a_bug_and_an_escape_are_seen(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    case = hostile.Case("a.yaml", b"a: 1\n", (("validate", "{}"),))
    figures = hostile.Figures()
    monkeypatch.setattr("pidcfg.cli.findings.collect.check_input", lambda *_: 1 / 0)
    hostile.judge(case, tmp_path, hostile.CODE_PAGES[0], figures)
    assert (figures.tracebacks, figures.bugs, len(figures.failures)) == (1, 1, 1)


def test_changed_examples_keep_what_must_be_true():
    rig = fuzz.Fuzz(SEED)
    for number in range(12):
        rig.run(number, deep=number == 0)
    assert rig.found.failures == []
    assert rig.found.mutants == 12
    assert rig.found.valid > 0


def test_what_is_not_true_of_a_changed_example_is_seen(monkeypatch):
    rig = fuzz.Fuzz(SEED)
    monkeypatch.setattr(fuzz, "words_of", lambda _: object())
    for number in range(12):
        rig.run(number, deep=False)
    assert len(rig.found.failures) == rig.found.valid > 0


def test_a_command_that_is_ended_leaves_an_old_file_or_a_new_one():
    found = kills.Kills()
    for number in range(3):
        kills.run(found, SEED, number)
    assert found.failures == []
    assert sum(found.ended.values()) + found.finished == 3


def test_the_page_is_that_of_the_programme_with_figures_in_it():
    def first(text: str) -> list[str]:
        return [line.partition(" | ")[0] for line in text.splitlines() if line.startswith("| ")]

    page = PAGE.read_text("utf-8")
    assert first(page) == first(TEXT.replace("{seconds}", str(hostile.SECONDS)))
    assert "{" not in page
