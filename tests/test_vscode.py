"""The extension for VS Code: built and started in a fake editor, with the real server."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import pidcfg
from editor import NODE
from pidcfg.lsp import RUN, WORDS

FOLDER = Path(__file__).parents[1] / "editors/vscode"
PACKAGE = json.loads((FOLDER / "package.json").read_text("utf-8"))
SOURCE = (FOLDER / "src/extension.js").read_text("utf-8")
needs_packages = pytest.mark.skipif(
    NODE is None or not (FOLDER / "node_modules").is_dir() or os.name != "posix",
    reason="the extension's packages are not installed: npm ci --ignore-scripts in editors/vscode",
)


def test_the_extension_is_of_this_version_and_knows_the_commands_of_the_server():
    assert PACKAGE["version"] == pidcfg.__version__
    assert dict(re.findall(r'const (RUN|WORDS) = "(.+)";', SOURCE)) == {"RUN": RUN, "WORDS": WORDS}
    lock = json.loads((FOLDER / "package-lock.json").read_text("utf-8"))["packages"][""]
    assert lock["devDependencies"] == PACKAGE["devDependencies"]
    assert all(re.fullmatch(r"[0-9.]+", version) for version in PACKAGE["devDependencies"].values()), "one version each"


@needs_packages
def test_the_extension_starts_the_server_and_shows_what_it_answers(tmp_path):
    pytest.importorskip("pygls", reason="pygls is not installed: the extra lsp")
    program = tmp_path / "pidcfg"
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m pidcfg "$@"\n', "utf-8")
    program.chmod(0o755)
    npm = shutil.which("npm") or pytest.skip("npm is not installed")
    subprocess.run([npm, "run", "--silent", "build"], cwd=FOLDER, check=True, capture_output=True)
    told = subprocess.run(
        [str(NODE), "--test", "test/extension.test.js"],
        cwd=FOLDER,
        env={**os.environ, "PIDCFG_PROGRAM": str(program)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert told.returncode == 0, told.stdout
