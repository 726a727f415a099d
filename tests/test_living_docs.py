"""The pages on findings and settings: their files are written, and their commands print what is shown.

``python tests/test_living_docs.py`` writes the outputs anew; read the difference.
"""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

import pytest

from pidcfg.cli.settings_check import KEYS, settings_schema

DOCS = Path(__file__).parents[1] / "docs"
PAGES = ("living-with-findings.md", "settings.md")
BLOCK = re.compile(r"^```(yaml|toml|console)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
FILE = re.compile(r"# ([\w.-]+)\n")
OVEN = "# oven.yaml\npidcfg: 1\nvendor: dl06\nplc: {loop_table: V2000, reset_decimals: 1}\nloops: []\n"


def told(page: str, folder: Path) -> str:
    """A page with the outputs of its commands as they are now, run in order in a folder of their own."""

    def block(found: re.Match[str]) -> str:
        kind, text = found.groups()
        name = FILE.match(text)
        if kind != "console":
            if name:
                (folder / name[1]).write_text(text, "utf-8")
            return found.group()
        line = text.partition("\n")[0]
        command = [sys.executable, "-m", *shlex.split(line.removeprefix("$ "))]
        result = subprocess.run(command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False,
                                env={**os.environ, "NO_COLOR": "1"})  # fmt: skip
        assert result.returncode in {0, 1, 2}
        return f"```console\n{line}\n{result.stdout.decode('utf-8')}```"

    (folder / ".git").mkdir()
    (folder / "oven.yaml").write_text(OVEN, "utf-8")
    return BLOCK.sub(block, (DOCS / page).read_text("utf-8"))


@pytest.mark.parametrize("page", PAGES)
def test_outputs_are_true(page, tmp_path):
    assert told(page, tmp_path) == (DOCS / page).read_text("utf-8")


def test_the_settings_of_the_pages_are_accepted_and_complete():
    import jsonschema

    shown = [tomllib.loads(text) for page in PAGES for kind, text in BLOCK.findall((DOCS / page).read_text("utf-8"))
             if kind == "toml" and "wrong" not in text]  # fmt: skip
    for settings in shown:
        jsonschema.validate(settings, settings_schema())
    assert set().union(*shown) == set(KEYS), "each key is shown"


if __name__ == "__main__":
    for name in PAGES:
        with tempfile.TemporaryDirectory() as scratch:
            (DOCS / name).write_text(told(name, Path(scratch)), "utf-8", newline="\n")
