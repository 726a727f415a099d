"""Which files a command line stands for: none is left out unseen, and none is taken twice."""

from __future__ import annotations

import io
import json
import os
import random
import shutil
import subprocess
from pathlib import Path

import pytest

import pidcfg as api
from living_rig import GOOD, call, run
from pidcfg.cli.inputs import gather_inputs, has_key
from pidcfg.text.reader import DEFAULT, Limits
from pidcfg.vendors import VENDORS
from shell import captured, pidcfg
from test_vendors import starter

BAD = GOOD.replace("gain: 1", "gain: x")
FOREIGN = "services:\n  pidcfg:\n    image: pidcfg\n"


@pytest.fixture
def validate(monkeypatch, capsysbinary, tmp_path):
    """``pidcfg validate`` in a folder with one good file."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "good.yaml").write_text(GOOD, "utf-8")
    return lambda *args: run(monkeypatch, capsysbinary, *args)


FORMS = {
    "indented": "".join(f"  {line}\n" for line in BAD.splitlines()),
    "indented, after a comment": "# x\n\n" + "".join(f"    {line}\n" for line in BAD.splitlines()),
    "flow": "{pidcfg: 1, vendor: dl06, loops: []}",
    "flow below a marker": "--- {vendor: dl06,\n  pidcfg : 1}",
    "flow, misspelt": "{pidcgf: 1, vendor: dl06, loops: []}",
    "JSON": '{"vendor": "dl06", "pidcfg": 1}',
    "a key with a question mark": "? pidcfg\n: 1\n? vendor\n: dl06\n",
    "old line ends": BAD.replace("\n", "\r"),
    "rare line ends": "vendor: dl06\u2028pidcfg: 1\x85loops: []",
    "an anchor before": "&a\npidcfg: 1\n",
    "a tag before": "!!map {pidcfg: 1}\n",
    "an escape": '"pid\\x63fg": 1\nvendor: dl06\n',
    "a blank before the colon": "vendor: dl06\npidcfg : 1\n",
    "quotes": "'pidcfg': 1\n",
    "misspelt": BAD.replace("pidcfg", "pidcgf"),
    "misspelt and indented": "".join(f"  {line}\n" for line in BAD.replace("pidcfg", "pidcgf").splitlines()),
    "a marker and a directive": "%YAML 1.2\n---\npidcfg: 1\n",
    "tabs": "\tpidcfg: 1\n",
    "a byte order mark": "\ufeffpidcfg: 1\n",
}


@pytest.mark.parametrize("form", FORMS)
def test_a_file_of_ours_is_known_in_every_form(validate, tmp_path, form):
    (tmp_path / "odd.yaml").write_bytes(FORMS[form].encode())
    for found in (validate("."), validate("odd.yaml", "--skip-foreign")):
        assert found.code != 0, found.err
        assert "odd.yaml" in found.out
    assert has_key(FORMS[form].encode("utf-16"))


@pytest.mark.parametrize(
    "text",
    [
        FOREIGN,
        "# pidcfg: 1\nname: x\n",
        "- pidcfg: 1\n",
        "run: |\n  pidcfg: 1\n",
        "",
        "a: 1\n",
        "vendor: x\nname: y\n",
        "  services:\n    pidcfg: 1\n",
        "{a: 1}\n",
        "---\n# x\njobs: {a: b}\n",
        "on:\n  pull_request:\n",
    ],
)
def test_other_peoples_files_are_left_out(validate, tmp_path, text):
    (tmp_path / "other.yaml").write_text(text, "utf-8")
    found = validate(".")
    assert found.code == 0
    assert "1 file checked: 0 errors, 0 warnings, 0 infos; 1 without a pidcfg key skipped" in found.err


def test_a_large_file_is_searched_to_its_end(validate, tmp_path):
    filler = "# " + "x" * 78 + "\n"
    (tmp_path / "late.yaml").write_text("a: 1\n" + filler * 20 + "pidcfg: 1\n", "utf-8")
    (tmp_path / "lock.yaml").write_text("a: 1\n" + filler * 20, "utf-8")
    found = validate(".", "--limit", "file_bytes=500")
    assert found.code == 2
    assert "late.yaml" in found.out
    assert "lock.yaml" not in found.out


@pytest.mark.skipif(os.name != "posix", reason="links and pipes of POSIX")
def test_what_cannot_be_read_in_a_folder_is_said(validate, tmp_path):
    (tmp_path / "gone.yaml").symlink_to("nowhere")
    os.mkfifo(tmp_path / "pipe.yml")
    found = validate(".")
    assert found.code == 2
    assert "cannot read gone.yaml" in found.out
    assert "pipe" not in found.out, "a pipe holds nothing to check"


def test_a_folder_that_cannot_be_read_is_an_error(validate, tmp_path, monkeypatch):
    (tmp_path / "shut").mkdir()
    real = os.scandir

    def scandir(path):
        if Path(path).name == "shut":
            raise PermissionError(13, "Permission denied", os.fspath(path))
        return real(path)

    monkeypatch.setattr(os, "scandir", scandir)
    found = validate(".")
    assert found.code == 2
    assert "cannot read ./shut: Permission denied" in found.out


@pytest.mark.skipif(os.name != "posix", reason="links of POSIX")
def test_a_linked_folder_outside_is_mentioned_and_one_inside_needs_not_be(validate, tmp_path):
    for folder in ("in/v1", "out"):
        (tmp_path / folder).mkdir(parents=True)
        (tmp_path / folder / "a.yaml").write_text(GOOD, "utf-8")
    (tmp_path / "in/latest").symlink_to("v1")
    assert "link" not in validate("in").err
    (tmp_path / "in/other").symlink_to("../out")
    found = validate("in")
    assert found.code == 0
    assert "in/other: a link out of the folder is not followed; name it" in found.err
    assert "1 file checked: 0 errors, 0 warnings, 0 infos\n" in found.err
    assert "2 files checked" in validate("in", "in/other").err


@pytest.mark.parametrize(
    "paths", [("sub/d.yaml", "sub/../sub/d.yaml"), ("sub", "./sub/d.yaml"), ("sub/", "sub/../sub")]
)
def test_a_file_is_taken_once_however_it_is_spelled(tmp_path, monkeypatch, paths):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub/d.yaml").write_text(GOOD, "utf-8")
    for order in (paths, paths[::-1]):
        assert len(list(gather_inputs(order, DEFAULT))) == 1


def test_the_limit_of_files_holds_inside_of_folders(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in "abcd":
        (tmp_path / f"{name}.yaml").write_text(GOOD, "utf-8")
    found = list(gather_inputs(["."], Limits(files=2)))
    assert [entry.problem is None for entry in found] == [True, True, False]
    assert "more than 2 files" in found[-1].problem
    assert [entry.problem for entry in gather_inputs(["."], Limits(files=4))] == [None] * 4
    assert [entry.problem for entry in gather_inputs(["a.yaml", "b.yaml"], Limits(files=2))] == [None] * 2


def put(folder, files):
    """Writes files below a folder, each with its text."""
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, "utf-8")


def names(*paths):
    """The files that are read for some paths."""
    return [entry.name for entry in gather_inputs(paths, DEFAULT) if not entry.is_foreign and entry.problem is None]


OTHERS = {
    "venv/pyvenv.cfg": "home = /usr/bin\n",
    "venv/lib/python3.12/site-packages/pidcfg/starters/click.yaml": BAD,
    "my env/pyvenv.cfg": "",
    "my env/a.yaml": BAD,
    "web/node_modules/x/a.yaml": BAD,
    "lib/site-packages/pidcfg/a.yaml": BAD,
}


def test_other_peoples_folders_are_left_out_and_counted(validate, tmp_path):
    put(tmp_path, OTHERS)
    found = validate(".", "--strict")
    assert (found.code, found.out) == (0, "")
    assert (
        "1 file checked: 0 errors, 0 warnings, 0 infos; 4 folders left out (my env, venv, site-packages, …)\n"
        in found.err
    )
    said = validate(".", "-v").err
    assert "left out: venv/ (holds pyvenv.cfg)\n" in said
    assert "left out: web/node_modules/ (packages of others)\n" in said
    assert validate(".", "-q").err == ""


def test_what_is_named_is_read_wherever_it_lies(validate, tmp_path):
    put(tmp_path, {**OTHERS, ".gitignore": "ignored/\n*.bak.yaml\n", "ignored/a.yaml": GOOD, "a.bak.yaml": GOOD})
    assert names("a.bak.yaml", "ignored/a.yaml", "my env/a.yaml") == ["a.bak.yaml", "ignored/a.yaml", "my env/a.yaml"]
    assert names("*.bak.yaml", "*/a.yaml") == ["a.bak.yaml", "ignored/a.yaml", "my env/a.yaml"]
    assert names("ignored", "my env", "lib/site-packages", "web/node_modules") == [
        "ignored/a.yaml",
        "my env/a.yaml",
        "lib/site-packages/pidcfg/a.yaml",
        "web/node_modules/x/a.yaml",
    ]
    assert names(".", "ignored/a.yaml") == ["good.yaml", "ignored/a.yaml"]
    found = validate("venv")
    assert found.code == 2
    assert "venv holds no .yaml or .yml file with a pidcfg key; 1 folder left out (site-packages)" in found.out


def test_a_command_line_leaves_files_out_from_the_working_directory(validate, tmp_path, monkeypatch):
    put(tmp_path, {"loops/old/a.yaml": BAD, "loops/old/b.yaml": BAD, "loops/b.bak.yaml": BAD, "loops/c.yaml": GOOD})
    found = validate(".", "--exclude", "old/", "--exclude", "*.bak.yaml", "-v")
    assert found.code == 0, found.out
    assert "; 1 folder and 1 file left out (old, b.bak.yaml)\n" in found.err
    assert "left out: loops/old/ (--exclude: old/)\n" in found.err
    assert validate(".", "--exclude", "/old/", "--exclude", "*.bak.yaml").code == 1
    assert validate("loops", "--exclude", "loops/*", "--exclude", "!loops/c.yaml").code == 0
    assert validate("loops/old/a.yaml", "--exclude", "old/").code == 1, "it is named"
    monkeypatch.chdir(tmp_path / "loops")
    assert validate("..", "--exclude", "/old/", "--exclude", "/*.bak.yaml").code == 0


@pytest.mark.parametrize(
    ("pattern", "words"),
    [("../x", "leads out of the folder"), ("old\\x", "forward slashes"), ("#x", "no pattern"), ("", "no pattern")],
)
def test_a_pattern_that_fits_nothing_is_refused(validate, pattern, words):
    found = validate(".", "--exclude", pattern)
    assert (found.code, found.out) == (2, "")
    assert "Invalid value for '--exclude'" in found.err
    assert words in found.err


def test_every_command_that_takes_folders_leaves_out_the_same(validate, tmp_path, monkeypatch, capsysbinary):
    bad = "pidcfg: 1\nscenario: x\nconfig: none.yaml\n"
    put(tmp_path, {"node_modules/a.scenario.yaml": bad, "old/b.scenario.yaml": bad})
    for command in (["simulate"], ["certify"], ["report", "-o", "-"], ["export"]):
        exclude = ["--exclude", "old/"] * (command != ["export"])
        found = call(monkeypatch, capsysbinary, *command, ".", *exclude)
        number = "2 folders left out (node_modules, old)" if exclude else "1 folder left out (node_modules)"
        assert number in found.err, found.err
        assert "a.scenario.yaml" not in found.out + found.err
        assert "b.scenario.yaml" not in found.out + found.err
    assert call(monkeypatch, capsysbinary, "simulate", ".", "-q", "--exclude", "old/").err == ""


@pytest.mark.skipif(os.name != "posix", reason="pipes and links of POSIX")
@pytest.mark.parametrize("kind", ["pipe", "link", "folder", "huge", "many", "locked", "bytes"])
def test_an_odd_gitignore_neither_stops_nor_hides_anything(validate, tmp_path, monkeypatch, kind):
    put(tmp_path, {"a.yaml": GOOD, "patterns": "a.yaml\n"})
    path = tmp_path / ".gitignore"
    content = {
        "huge": b"*" * (1 << 20),
        "many": b"a.yaml\n" * 3000,
        "locked": b"a.yaml",
        "bytes": b"\xff\xfea\0.yaml\n[\n\\",
    }
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "link":
        path.symlink_to("patterns")
    elif kind == "folder":
        path.mkdir()
    else:
        path.write_bytes(content[kind])
    real = os.open

    def opened(file, *args, **kwargs):
        if kind == "locked" and str(file).endswith(".gitignore"):
            raise PermissionError(13, "Permission denied", str(file))
        return real(file, *args, **kwargs)

    monkeypatch.setattr(os, "open", opened)
    found = validate(".")
    assert (found.code, found.out) == (0, ""), found.err
    assert "2 files checked: 0 errors, 0 warnings, 0 infos\n" in found.err
    says = {"huge": "has more than", "many": "has more than", "locked": "cannot be read (Permission denied)"}.get(kind)
    assert found.err.count(".gitignore") == (says is not None)
    assert says is None or f".gitignore: {says}" in found.err


def test_no_pattern_of_git_takes_long(tmp_path, monkeypatch):
    """Each of these would take years by a regular expression that tries every way."""
    monkeypatch.chdir(tmp_path)
    deep = "/".join("a" * 90)
    put(tmp_path, {f"{'a' * 200}.yaml": GOOD, f"{deep}/b.yaml": GOOD})
    lines = [
        "*a" * 60 + "b",
        "*?" * 60 + "b",
        "*[a]" * 60 + "b",
        "*" * 60 + "b",
        "/" + "**/a/" * 30 + "c",
        "a*" * 40 + "/x",
    ]
    put(tmp_path, {".gitignore": "\n".join([*lines, "!" + lines[-2]])})
    assert len(names(".")) == 2


def test_nothing_inside_of_what_is_left_out_is_opened(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    opened, listed = [], []
    real_open, real_list = io.open, os.scandir
    monkeypatch.setattr(
        io, "open", lambda file, *args, **kw: (opened.append(str(file)), real_open(file, *args, **kw))[1]
    )
    monkeypatch.setattr(os, "scandir", lambda path=".": (listed.append(os.fspath(path)), real_list(path))[1])
    for size in (10, 40):
        for number in range(size):
            put(tmp_path, {f"f{number}/a.yaml": GOOD, f"f{number}/.gitignore": "old/\n*.bak.yaml\n"})
            put(tmp_path, {f"f{number}/{name}": BAD for name in ("old/a/a.yaml", "a.bak.yaml", "node_modules/a.yaml")})
        opened.clear()
        listed.clear()
        assert len(names(".")) == size
        assert len(opened) == 2 * size, "a file and its patterns, each once"
        assert len(listed) == size + 1, "each folder once"


needs_git = pytest.mark.skipif(shutil.which("git") is None, reason="there is no git to compare with")
FOLDERS = ("a", "b", "ab", "build", "old", "x.y", "foo bar", "a-1")
FILES = (
    "a.yaml",
    "b.yml",
    "ab.yaml",
    "old.yaml",
    "build.yaml",
    "x y.yaml",
    "#c.yaml",
    "!d.yaml",
    "[e].yaml",
    "a.bak.yaml",
)
SEGMENTS = (
    *("*", "*.yaml", "a*", "*b*", "?", "??", "[ab]", "[!a]*", "**", "*.bak.*", "[a-c].yaml", "*a*b*", "\\#c.yaml"),
)


def pattern(chance):
    """A line of a .gitignore."""
    line = "/".join(chance.choice((*FOLDERS, *FILES, *SEGMENTS)) for _ in range(chance.choice((1, 1, 1, 2, 2, 3))))
    line = chance.choice(("", "", "", "/", "**/")) + line + chance.choice(("", "", "", "/", "/**", "/**/"))
    return chance.choice(("", "", "", "!")) + line + " " * (chance.random() < 0.1)


def tree(root, chance):
    """Folders with files, some of them with patterns, and one that may be a repository of its own."""
    folders = [root]
    for _ in range(chance.randint(3, 14)):
        folders.append(chance.choice(folders) / chance.choice(FOLDERS))
    for folder in folders:
        put(folder, dict.fromkeys(chance.sample(FILES, chance.randint(1, 5)), "a: 1\n"))
    for folder in [root, *chance.sample(folders, min(len(folders), 3))]:
        end = chance.choice(("\n", "\r\n"))
        text = chance.choice(("", "\ufeff")) + end.join(pattern(chance) for _ in range(chance.randint(1, 6)))
        (folder / ".gitignore").write_text(text + chance.choice(("", end)), "utf-8", newline="")
    return folders


def ignored_by_git(root, files):
    """Those of some files and folders that git ignores in a new repository."""
    environment = {**os.environ, "GIT_CONFIG_GLOBAL": os.devnull, "GIT_CONFIG_NOSYSTEM": "1"}
    asked = "\0".join(files).encode()
    subprocess.run(["git", "init", "-q"], cwd=root, env=environment, check=True)
    command = ["git", "check-ignore", "--no-index", "-z", "--stdin"]
    done = subprocess.run(command, cwd=root, env=environment, input=asked, capture_output=True, check=True)
    return {*done.stdout.decode().split("\0")} - {""}


@needs_git
def test_files_are_ignored_as_git_ignores_them(tmp_path, monkeypatch):
    """Forty-five trees in one repository, read from its root, each from its own, and from one folder of each."""
    monkeypatch.chdir(tmp_path)
    put(tmp_path, {".gitignore": "ab/*.yaml\n/7/\n/8/a*\n"})
    inside = {}
    for seed in range(45):
        folders = tree(tmp_path / str(seed), random.Random(seed))
        inside[str(seed)] = folders[1].relative_to(tmp_path).as_posix()
    files = {path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*.y*ml")}
    by_git = ignored_by_git(tmp_path, sorted({*files, *inside, *inside.values()}))
    assert len(by_git) > 200
    for start in (".", *inside, *inside.values()):
        if start not in by_git:  # what is named is read, whatever git says
            read = {entry.name for entry in gather_inputs([start], DEFAULT) if entry.reason is entry.problem is None}
            assert read == {file for file in files - by_git if start == "." or file.startswith(f"{start}/")}, start


def test_a_repository_inside_of_another_has_its_own_patterns(tmp_path, monkeypatch):
    put(tmp_path, {".gitignore": "a.yaml\nsecond/\n", "sub/.gitignore": "b.yaml\n", "a.yaml": GOOD, "second/.git": "x"})
    put(tmp_path, {f"sub/{name}.yaml": GOOD for name in "abc"} | {"sub/.git": "gitdir: ../.git/modules/sub\n"})
    monkeypatch.chdir(tmp_path)
    assert names(".") == ["sub/a.yaml", "sub/c.yaml"]
    assert names("sub") == ["sub/a.yaml", "sub/c.yaml"]
    (tmp_path / "sub/.git").unlink()
    assert names(".") == ["sub/c.yaml"]
    assert names("sub") == ["sub/a.yaml", "sub/c.yaml"], "outside of a repository nothing above counts"
    (tmp_path / ".git").mkdir()
    assert names("sub") == ["sub/c.yaml"]


# --- Commands that take several files name everything that is wrong with them, in the order of the command line -------


MERGING = [(vendor, name) for vendor in VENDORS.values() for name, kind in vendor.load("formats").items() if kind.merge]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with listings that cannot be read."""
    (tmp_path / "words.txt").write_text("nothing\n", "utf-8")
    (tmp_path / "other.json").write_text("{", "utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def said(*words):
    """What a command says, which ends with 2 and writes nothing to standard output."""
    code, shown, out = captured(pidcfg, list(words))
    assert code == 2, shown
    return shown, out


def in_order(text, *parts):
    """Whether a text has the parts, each once and in this order."""
    places = [text.index(part) for part in parts]
    return places == sorted(places) and all(text.count(part) == 1 for part in parts)


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize("vendor", VENDORS)
def test_decode_names_every_file_that_cannot_be_read(vendor):
    shown, out = said("decode", "gone.txt", "words.txt", "lost.txt", "other.json", "--vendor", vendor)
    assert in_order(shown, "cannot read gone.txt", "words.txt:1:1", "cannot read lost.txt", "other.json:1:")
    assert shown.count("Error: ") == 4
    shown, out = said("decode", "other.json", "gone.txt", "--vendor", vendor)
    assert in_order(shown, "other.json:1:", "cannot read gone.txt")
    assert out == ""


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize("vendor", VENDORS)
def test_decode_names_every_listing_that_is_none(vendor):
    shown, _ = said("decode", "other.json", "words.txt", "--vendor", vendor)
    assert in_order(shown, "other.json:1:", "words.txt:1:1")
    result = api.decode([b"{", b"nothing"], vendor, name=["one", "two"])
    assert [finding.file for finding in result.findings] == ["one", "two"]


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize(("vendor", "name"), MERGING, ids=[f"{vendor.key}-{name}" for vendor, name in MERGING])
def test_encode_names_the_configuration_and_the_file_that_it_adds_to(vendor, name, folder):
    (folder / "good.yaml").write_text(starter(vendor), "utf-8")
    (folder / "bad.yaml").write_text(starter(vendor).replace("loops:", "loop:"), "utf-8")
    add = ("--format", name, "--into", "gone.csv", "-o", "out.csv")
    assert in_order(said("encode", "good.yaml", *add)[0], "Error: cannot read gone.csv")
    assert in_order(said("encode", "bad.yaml", *add)[0], "unknown key 'loop'", "Error: cannot read gone.csv")
    assert in_order(said("encode", "lost.yaml", *add)[0], "cannot read lost.yaml", "Error: cannot read gone.csv")
    (folder / "run.yaml").write_text("pidcfg: 1\nscenario: x\n", "utf-8")
    assert in_order(said("encode", "run.yaml", *add)[0], "Error: run.yaml is a scenario", "Error: cannot read gone.csv")
    assert in_order(said("encode", "good.yaml", *add, "--limit", "file_bytes=9000")[0], "Error: cannot read gone.csv")
    assert not (folder / "out.csv").exists()


@pytest.mark.usefixtures("folder")
def test_an_error_in_json_stays_json(folder):
    vendor, _ = MERGING[0]
    (folder / "bad.yaml").write_text(starter(vendor).replace("loops:", "loop:"), "utf-8")
    shown, out = said("encode", "bad.yaml", "--format", "json", "--into", "gone.csv")
    assert json.loads(out)["findings"]
    assert "cannot read gone.csv" in shown
