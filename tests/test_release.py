"""The release: what an index is told, places that repeat the version, the bill of materials, the same bytes."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys

import pytest
from packaging.utils import canonicalize_name
from ruamel.yaml import YAML

import pidcfg
from release import places
from release.make import ReleaseError, dated, dead_links
from release.metadata import ROOT, addresses, readme, urls
from release.sbom import BILL, EXTRAS, NEEDED, locked

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
