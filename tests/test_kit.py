"""The kit for computers without a network: what its parts do. `python tasks.py kit --check` tries the whole."""

from __future__ import annotations

import ast
import hashlib
import json
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
from ruamel.yaml import YAML

import pidcfg
from kit import make, start
from release import places
from release.make import ReleaseError, dated, dead_links
from release.metadata import ROOT, addresses, readme, urls
from release.sbom import BILL, EXTRAS, NEEDED, locked

KIT = ROOT / "tools" / "kit"
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
needs_sh = pytest.mark.skipif(os.name == "nt" or not shutil.which("sh"), reason="the kit's command for Linux")
PIDCFG = """\
#!{python}
import os, sys
sys.path[:0] = {path!r}
print("PATH begins with", os.environ["PATH"].split(os.pathsep)[0], os.environ.get("PIDCFG_WHATIF_RUNTIME"))
from pidcfg.__main__ import main
from release.metadata import ROOT
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


# --- The release: what an index is told, places that repeat the version, the bill of materials, the same bytes --------


README = (ROOT / "README.md").read_text("utf-8")
NONE = dict.fromkeys(addresses(), "")
GIVEN = {
    "REPOSITORY": "https://example.org/plant/pidcfg",
    "SITE": "https://example.org/site/",
    "INDEX": "https://example.org/project/pidcfg/",
    "IMAGE": "registry.example.org/plant/pidcfg",
    "ACTION": "plant/pidcfg",
}


# --- addresses -------------------------------------------------------------------------------------------------------


def test_the_example_gives_every_address():
    assert {*GIVEN} == {*addresses()}


def test_no_address_claims_to_be_the_home_of_the_project():
    """Nobody has given one. Whoever does fills in the table, and this test goes."""
    assert addresses() == NONE
    assert urls(NONE) == {}


def test_an_address_that_is_given_is_a_link_beside_the_name():
    assert urls(GIVEN) == {
        "Documentation": "https://example.org/site/",
        "Repository": "https://example.org/plant/pidcfg",
        "Changelog": "https://example.org/plant/pidcfg/blob/main/CHANGELOG.md",
        "Issues": "https://example.org/plant/pidcfg/issues",
    }


@pytest.mark.parametrize("table", [NONE, GIVEN, {**GIVEN, "SITE": ""}, {**NONE, "SITE": GIVEN["SITE"]}])
def test_the_readme_alone_has_no_dead_link(table):
    assert not dead_links(readme(README, "1.0", table))


def test_a_dead_link_is_seen():
    assert "docs/tutorial.md" in dead_links(README)
    assert dead_links("# A b\n[x](#a-b) [y](#c) [z](https://example.org) ![p](p.svg)") == ["#c", "p.svg"]


@pytest.mark.parametrize(
    ("text", "alone", "with_repository"),
    [
        ("see [a\nb](docs/x.md).", "see a\nb.", "see [a\nb](R/blob/v1/docs/x.md)."),
        ("one ([more](docs/x.md#y)); two", "one; two", "one ([more](R/blob/v1/docs/x.md#y)); two"),
        ("a\n\n![p](p.svg)\n\nb", "a\n\nb", "a\n\n![p](R/raw/v1/p.svg)\n\nb"),
        ("a\n\n[x](x.md), [y](y.md).", "a", "a\n\n[x](R/blob/v1/x.md), [y](R/blob/v1/y.md)."),
        ("[x](https://example.org), [y](#y)", *["[x](https://example.org), [y](#y)"] * 2),
        ("```\n[x](x.md)\n\n\n[y](y.md)\n```", *["```\n[x](x.md)\n\n\n[y](y.md)\n```"] * 2),
    ],
)
def test_a_link_without_an_address_is_its_text(text, alone, with_repository):
    assert readme(text, "1", NONE) == f"{alone}\n"
    assert readme(text, "1", {**NONE, "REPOSITORY": "R"}) == f"{with_repository}\n"


def test_a_page_is_on_the_site_where_that_has_an_address():
    assert readme("[a](docs/x.md#y) [b](CHANGELOG.md)", "1", {**NONE, "SITE": "S/"}) == "[a](S/x.html#y) b\n"


# --- places that repeat something ------------------------------------------------------------------------------------


def test_every_file_repeats_the_version():
    assert places.stale() == []


@pytest.fixture
def copy(tmp_path):
    """The files that repeat something, in a folder of their own."""
    for place in places.PLACES:
        (tmp_path / place.file).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(ROOT / place.file, tmp_path / place.file)
    return tmp_path


def test_a_new_version_and_addresses_are_written_everywhere_and_can_be_taken_back(copy):
    before = places.files(copy, NONE)
    for path, data in places.files(copy, GIVEN, "9.8.7").items():
        assert pidcfg.__version__.encode() not in re.sub(rb"(?m)^.*(node_modules|resolved|[=^]).*$", b"", data), path
        path.write_bytes(data)
    citation = YAML(typ="safe").load((copy / "CITATION.cff").read_text("utf-8"))
    assert [citation[name] for name in ("version", "repository-code", "url")] == [
        "9.8.7",
        GIVEN["REPOSITORY"],
        GIVEN["SITE"],
    ]
    labels = dict(re.findall(r'image\.(\w+)="(.*)"', (copy / "Dockerfile").read_text("utf-8")))
    assert (labels["version"], labels["source"], labels["documentation"]) == ("9.8.7", *[*GIVEN.values()][:2])
    package = json.loads((copy / "editors/vscode/package.json").read_text("utf-8"))
    assert (package["version"], package["repository"]["url"]) == ("9.8.7", GIVEN["REPOSITORY"])
    page = (copy / "docs/ci.md").read_text("utf-8")
    assert all(text in page for text in ("rev: v9.8.7", "uses: plant/pidcfg@", f"repo: {GIVEN['REPOSITORY']} "))
    workflow = YAML(typ="safe").load((copy / ".github/workflows/release.yml").read_text("utf-8"))
    assert workflow["jobs"]["publish"]["environment"] == {"name": "pypi", "url": GIVEN["INDEX"]}
    assert places.files(copy, NONE, pidcfg.__version__) == before


def test_a_place_that_is_gone_is_told(copy):
    (copy / "CITATION.cff").write_text("title: none\n", "utf-8")
    with pytest.raises(ValueError, match=r"CITATION\.cff has 0 places for VERSION"):
        places.files(copy, NONE)


def test_the_changelog_is_dated_once():
    text = f"# Changelog\n\n## {pidcfg.__version__} (unreleased)\n\n- a\n\n## 0.0.1 (never released)\n"
    once = dated(text, "2031-01-02")
    assert once == text.replace("(unreleased)", "(2031-01-02)")
    with pytest.raises(ReleaseError, match="it is released"):
        dated(once, "2031-01-03")
    with pytest.raises(ReleaseError, match="the newest heading"):
        dated(text.replace(pidcfg.__version__, "0.0.9"), "2031-01-02")


# --- the bill of materials -------------------------------------------------------------------------------------------


def test_the_bill_of_materials_is_the_lock():
    bill = json.loads(BILL.read_text("utf-8"))
    assert (bill["bomFormat"], bill["specVersion"]) == ("CycloneDX", "1.6")
    assert "timestamp" not in bill["metadata"]
    found = {scope: {} for scope in ("required", "optional")}
    for one in bill["components"]:
        found[one["scope"]][canonicalize_name(one["name"])] = one["version"]
        kind, _, name = one["purl"].partition("/")
        assert (kind, *name.split("@")) == ("pkg:pypi", one["name"].lower().replace("_", "-"), one["version"])
        assert one["licenses"], one["name"]
    needed = locked(NEEDED)
    extras = {name: version for lock in EXTRAS for name, version in locked(lock).items() if name not in needed}
    assert found == {"required": needed, "optional": extras}


def test_the_bill_of_materials_knows_what_pidcfg_itself_needs():
    bill = json.loads(BILL.read_text("utf-8"))
    own = bill["metadata"]["component"]
    (row,) = (row for row in bill["dependencies"] if row["ref"] == own["bom-ref"])
    assert {"click==8", "pydantic==2"} <= {name.partition(".")[0] for name in row["dependsOn"]}


# --- the same bytes --------------------------------------------------------------------------------------------------


def test_two_builds_of_a_wheel_are_the_same_bytes_whatever_the_umask(tmp_path):
    if not shutil.which("git") or not (ROOT / ".git").exists():
        pytest.skip("no git: the files of the commit are not known")
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=True).stdout.decode()
    names = [
        name
        for name in listed.split("\0")
        if re.match(r"src/|docs/man/|tools/release/|requirements/|[^/]+$", name) and (ROOT / name).is_file()
    ]
    built = []
    for folder, mode, zone in ((tmp_path / "a", 0o600, "UTC"), (tmp_path / "b" / "deeper", 0o666, "Pacific/Auckland")):
        for name in names:
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(ROOT / name, folder / name)
            (folder / name).chmod(mode)
        command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder / "dist")]
        built.append(subprocess.Popen(command, cwd=folder, env={"TZ": zone, "PATH": ""}, stdout=subprocess.DEVNULL))
    assert [process.wait() for process in built] == [0, 0]
    first, second = (
        next((folder / "dist").glob("*.whl")).read_bytes() for folder in (tmp_path / "a", tmp_path / "b/deeper")
    )
    assert first == second
