"""The line that names what is usually done next: for a person at a terminal, and for nobody else."""

from __future__ import annotations

import sys

import pytest

from pidcfg.cli import console as module
from pidcfg.cli.console import next_step


@pytest.fixture
def terminal(monkeypatch):
    monkeypatch.delenv("CI", raising=False)
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    lines = []
    monkeypatch.setattr(module, "remark", lines.append)
    return lines


def test_it_names_the_command(terminal):
    next_step("validate", "my loops.yaml")
    next_step("simulate", "a/b.yaml")
    assert terminal == ['next: pidcfg validate "my loops.yaml"', "next: pidcfg simulate a/b.yaml"]


def test_it_is_silent_for_programs_and_where_it_is_not_wanted(terminal, monkeypatch):
    next_step("validate", "x", quiet=True)
    next_step("validate", "x", fmt="json")
    monkeypatch.setenv("CI", "1")
    next_step("validate", "x")
    monkeypatch.delenv("CI")
    monkeypatch.setattr(sys.stderr, "isatty", lambda: False, raising=False)
    next_step("validate", "x")
    assert terminal == []
