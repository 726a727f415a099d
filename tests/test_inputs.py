"""Which files a command line stands for: none is left out unseen, and none is taken twice."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from living_rig import GOOD, run
from pidcfg.cli.files.folders import has_key
from pidcfg.cli.files.inputs import gather
from pidcfg.limits import DEFAULT, Limits

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
        assert len(list(gather(order, DEFAULT))) == 1


def test_the_limit_of_files_holds_inside_of_folders(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in "abcd":
        (tmp_path / f"{name}.yaml").write_text(GOOD, "utf-8")
    found = list(gather(["."], Limits(files=2)))
    assert [entry.problem is None for entry in found] == [True, True, False]
    assert "more than 2 files" in found[-1].problem
    assert [entry.problem for entry in gather(["."], Limits(files=4))] == [None] * 4
    assert [entry.problem for entry in gather(["a.yaml", "b.yaml"], Limits(files=2))] == [None] * 2
