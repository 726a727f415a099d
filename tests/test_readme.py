"""What the README shows is what the command prints."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text("utf-8")
RUNS = re.findall(r"```console\n\$ (pidcfg [^\n]*)\n(.*?)```", README, re.DOTALL)


@pytest.mark.parametrize(("line", "shown"), RUNS, ids=[line for line, _ in RUNS])
def test_outputs_are_true(line, shown):
    command = [sys.executable, "-m", "pidcfg", *shlex.split(line)[1:]]
    environment = {**os.environ, "NO_COLOR": "1"}
    result = subprocess.run(command, cwd=ROOT / "examples/dl06", capture_output=True, check=False, env=environment)
    text = result.stdout.decode("utf-8")
    whole, _, cut = shown.partition("...\n")
    assert text.startswith(whole) if not cut and "...\n" in shown else text.rstrip("\n") == whole.rstrip("\n")


def test_there_are_outputs_to_check():
    assert len(RUNS) >= 3


def test_links_lead_somewhere():
    for target in re.findall(r"\]\(([^)#:]+)\)", README):
        assert (ROOT / target).exists(), target


def test_commands_of_the_table_exist():
    from pidcfg.cli.main import COMMANDS

    named = set(re.findall(r"^\| `pidcfg (\w+)", README, re.MULTILINE))
    assert named == set(COMMANDS)
