"""The kit for computers without a network: what its parts do. `python tasks.py kit --check` tries the whole."""

from __future__ import annotations

import ast
import hashlib
import os
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from kit import make, start

ROOT = Path(__file__).parents[1]
KIT = ROOT / "tools" / "kit"
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
needs_sh = pytest.mark.skipif(os.name == "nt" or not shutil.which("sh"), reason="the kit's command for Linux")
PIDCFG = """\
#!{python}
import os, sys
sys.path[:0] = {path!r}
print("PATH begins with", os.environ["PATH"].split(os.pathsep)[0], os.environ.get("PIDCFG_WHATIF_RUNTIME"))
from pidcfg.__main__ import main
main()
"""
"""Stands for what the kit installs."""


@pytest.fixture
def kit(tmp_path):
    """A kit without wheels, unpacked."""
    folder = tmp_path / "the kit"
    folder.mkdir()
    for name in ("start.py", "pidcfg"):
        shutil.copy(KIT / name, folder)
    (folder / "whatif-runtime.zip").write_bytes(b"")
    (folder / "requirements.txt").write_text("# nothing\n", "utf-8")
    (folder / "SHA256SUMS").write_text(make.sums_of(folder), "utf-8")
    return folder


@pytest.fixture
def stranger(kit, tmp_path, monkeypatch):
    """Runs the kit's command with an empty home, as if it were installed; with the page that a browser was given."""
    home, opened = tmp_path / "home", tmp_path / "opened"
    monkeypatch.setattr(start, "SUMS", kit / "SHA256SUMS")
    monkeypatch.setattr(Path, "home", lambda: home)
    monkeypatch.delenv("XDG_DATA_HOME", raising=False)
    programs = start.scripts(start.home())
    programs.mkdir(parents=True)
    (programs.parent / "pidcfg-kit.stamp").touch()
    (programs / "pidcfg").write_text(PIDCFG.format(python=sys.executable, path=sys.path), "utf-8")
    (programs / "pidcfg").chmod(0o755)
    (tmp_path / "python3").symlink_to(sys.executable)
    browser = tmp_path / "browser"
    browser.write_text(f'#!/bin/sh\necho "$1" >> "{opened}"\n', "utf-8")
    browser.chmod(0o755)
    variables = {"HOME": str(home), "PATH": f"{tmp_path}:/usr/bin:/bin", "BROWSER": str(browser)}

    def run(*words, expected=0):
        opened.unlink(missing_ok=True)
        done = subprocess.run(
            [kit / "pidcfg", *words],
            env=variables,
            capture_output=True,
            text=True,
            check=False,
            stdin=subprocess.DEVNULL,
        )
        assert done.returncode == expected, done.stderr
        return done.stdout, opened.read_text("utf-8").strip() if opened.exists() else ""

    return run


# --- the command, which files are dropped on --------------------------------------------------------------------------


@needs_sh
def test_the_report_of_what_is_dropped_opens_also_when_it_has_errors(stranger, tmp_path):
    pytest.importorskip("jinja2")
    folder = tmp_path / "my loops"
    folder.mkdir()
    shutil.copy(ROOT / "examples/mistakes/oven.yaml", folder)
    for dropped, name in ((folder / "oven.yaml", "oven.report.html"), (folder, "pidcfg-report.html")):
        (folder / name).write_text("an earlier one", "utf-8")
        assert stranger(dropped, expected=1)[1] == (folder / name).as_uri()
        assert "<title>" in (folder / name).read_text("utf-8")


@pytest.mark.parametrize(
    ("names", "place"),
    [
        (["loops/tank.yaml"], "loops/tank.report.html"),
        (["loops"], "loops/pidcfg-report.html"),
        (["loops/tank.yaml", "oven.yaml"], "loops/pidcfg-report.html"),
    ],
)
def test_the_report_lies_beside_what_was_dropped(tmp_path, names, place):
    (tmp_path / "loops").mkdir()
    (tmp_path / "loops" / "tank.yaml").touch()
    assert start.report_place([str(tmp_path / name) for name in names]) == tmp_path / place
    assert [path.name for path in (tmp_path / "loops").iterdir()] == ["tank.yaml"]


@needs_sh
def test_what_is_no_whole_path_is_a_command(stranger, kit):
    said, opened = stranger("rule", "DL242")
    assert "DL242" in said
    assert f"PATH begins with {start.scripts(start.home())} {kit / 'whatif-runtime.zip'}" in said
    assert not opened
    assert "Usage: pidcfg" in stranger()[0]
    stranger("validate", "none.yaml", expected=2)


@needs_sh
def test_what_cannot_be_read_opens_nothing(stranger, tmp_path):
    (tmp_path / "notes.txt").write_text("no loops\n", "utf-8")
    assert stranger(tmp_path / "notes.txt", expected=2)[1] == ""


def test_only_whole_paths_that_are_there_were_dropped(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "report").mkdir()
    assert start.is_dropped([str(tmp_path / "report")])
    assert not any(map(start.is_dropped, ([], ["report"], [str(tmp_path / "no")], ["validate", str(tmp_path)])))


def test_the_report_goes_to_another_folder_where_nothing_may_be_written(tmp_path, monkeypatch):
    (tmp_path / "a.yaml").touch()

    def refused(**_):
        raise PermissionError

    monkeypatch.setattr(start.tempfile, "TemporaryFile", refused)
    monkeypatch.setattr(start.tempfile, "gettempdir", lambda: "/elsewhere")
    assert start.report_place([str(tmp_path / "a.yaml")]) == Path("/elsewhere/a.report.html")


# --- the installation ------------------------------------------------------------------------------------------------


@pytest.fixture
def here(kit, monkeypatch):
    monkeypatch.setattr(start, "HERE", kit)
    monkeypatch.setattr(start, "SUMS", kit / "SHA256SUMS")
    return kit


def test_a_file_that_is_damaged_or_gone_is_told_before_anything_is_installed(here, tmp_path, monkeypatch):
    monkeypatch.setattr(start.subprocess, "run", lambda *_args, **_options: pytest.fail("installs"))
    assert start.damaged() == []
    (here / "requirements.txt").write_text("other\n", "utf-8")
    (here / "whatif-runtime.zip").unlink()
    with pytest.raises(SystemExit, match=r"not as they were packed: requirements\.txt, whatif-runtime\.zip; copy"):
        start.install(tmp_path / "environment")
    assert not (tmp_path / "environment").exists()


def test_what_is_installed_comes_from_the_kit_alone_and_by_its_sum(here, tmp_path, monkeypatch):
    ran = []
    monkeypatch.setattr(
        start.subprocess, "run", lambda line, **_: ran.append(line) or subprocess.CompletedProcess(line, 0)
    )
    (tmp_path / "environment").mkdir()
    start.install(tmp_path / "environment")
    start.install(tmp_path / "environment")
    venv, pip = ran
    assert venv[1:3] == ["-m", "venv"]
    assert {"--isolated", "--no-index", "--require-hashes", "--no-deps", str(here / "requirements.txt")} < set(pip)
    assert pip[pip.index("--find-links") + 1] == str(here / "wheels")


@pytest.mark.parametrize(("version", "machine"), [((3, 10), "x86_64"), ((3, 15), "AMD64"), ((3, 12), "arm64")])
def test_another_computer_is_told_which_ones_the_kit_is_for(here, tmp_path, monkeypatch, version, machine):
    monkeypatch.setattr(start.sys, "version_info", version)
    monkeypatch.setattr(start.platform, "machine", lambda: machine)
    with pytest.raises(SystemExit, match=r"Python 3\.11 to 3\.\d+ on Windows and Linux, 64 bit"):
        start.install(tmp_path)


def test_an_old_python_can_read_far_enough_to_be_refused():
    ast.parse((KIT / "start.py").read_text("utf-8"), feature_version=(3, 8))


def test_the_kit_has_files_for_every_python_that_is_supported():
    assert f">={make.PYTHONS[0]}" == PROJECT["requires-python"]
    named = {text.rpartition(" :: ")[2] for text in PROJECT["classifiers"]}
    assert {one for one in named if re.fullmatch(r"3\.\d+", one)} <= {*make.PYTHONS}


def test_the_kit_installs_what_is_locked_for_its_extras():
    names = make.locked()
    assert "matplotlib" not in names
    wanted = [
        *PROJECT["dependencies"],
        *(line for extra in make.LOCKS[1:] for line in PROJECT["optional-dependencies"][extra]),
    ]
    missing = {canonicalize_name(Requirement(line).name) for line in wanted} - {*names}
    assert not missing
    assert 'sys_platform == "win32"' in names["colorama"][0]


# --- the files -------------------------------------------------------------------------------------------------------


def test_requirements_name_the_sums_of_the_files_that_are_there(tmp_path, monkeypatch):
    monkeypatch.setattr(make, "locked", lambda: {"a-b": ('a-b==1 ; sys_platform == "win32"', ["0"])})
    for name in ("a_b-1-cp311-win_amd64.whl", "a_b-1-cp312-win_amd64.whl", "pidcfg-9-py3-none-any.whl"):
        (tmp_path / name).write_text(name, "utf-8")
    one, two, own = (hashlib.sha256(path.read_bytes()).hexdigest() for path in sorted(tmp_path.iterdir()))
    first, second = make.requirements(tmp_path).replace(" \\\n    ", " ").splitlines()
    assert first == f'a-b==1 ; sys_platform == "win32" --hash=sha256:{one} --hash=sha256:{two}'
    assert second == f"pidcfg=={make.pidcfg.__version__} --hash=sha256:{own}"


def test_a_packed_kit_is_the_same_bytes_and_its_command_may_be_run(kit, tmp_path):
    packed = [tmp_path / "one.zip", tmp_path / "two.zip"]
    for path in packed:
        make.pack(kit.iterdir(), kit, path)
        os.utime(kit / "start.py", (10**9, 10**9))
    assert packed[0].read_bytes() == packed[1].read_bytes()
    with zipfile.ZipFile(packed[0]) as archive:
        rights = {Path(entry.filename).name: entry.external_attr >> 16 & 0o777 for entry in archive.infolist()}
    assert {name for name, mode in rights.items() if mode == 0o755} == {"pidcfg"}


@needs_sh
def test_the_sums_are_those_that_sha256sum_reads(kit):
    if not shutil.which("sha256sum"):
        pytest.skip("no sha256sum")
    subprocess.run(["sha256sum", "--quiet", "-c", "SHA256SUMS"], cwd=kit, check=True)
    named = [line.split("  ")[1] for line in (kit / "SHA256SUMS").read_text("utf-8").splitlines()]
    assert named == ["pidcfg", "requirements.txt", "start.py", "whatif-runtime.zip"]


def test_the_commands_of_both_systems_start_the_same():
    """Windows is not here: pidcfg.cmd was looked at, and run by Wine's cmd with a program in the place of Python."""
    for name in ("pidcfg", "pidcfg.cmd"):
        text = (KIT / name).read_text("utf-8")
        assert "start.py" in text
        assert "Python 3.11 or newer" in text
    assert '%FOUND% "%~dp0start.py" %*\n' in (KIT / "pidcfg.cmd").read_text("utf-8")
