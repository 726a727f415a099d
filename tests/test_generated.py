"""The command that renews what is generated: it writes what differs, removes what is left over, and says so."""

from __future__ import annotations

import pytest

import generated


@pytest.fixture
def folder(tmp_path):
    """A folder with a generated file that is stale, one that is not, one that is left over, and an input."""
    for name in ("stale.txt", "same.txt", "gone.txt", "input.yaml"):
        (tmp_path / name).write_text(name, "utf-8")
    return tmp_path


def files(folder):
    """What the folder should hold."""
    return {folder / "stale.txt": b"new", folder / "same.txt": b"same.txt", folder / "sub" / "added.txt": b"added"}


def test_what_differs_is_written_and_named(folder):
    names = generated.renew(files(folder))
    assert [name.rpartition("/")[2] for name in names] == ["stale.txt", "added.txt"]
    assert all(path.read_bytes() == data for path, data in files(folder).items())
    assert (folder / "gone.txt").exists(), "the folder may hold files of others"
    assert generated.renew(files(folder)) == []


def test_what_is_left_over_in_a_folder_of_generated_files_goes(folder):
    wanted = {path: data for path, data in files(folder).items() if path.parent == folder}
    assert [name.rpartition("/")[2] for name in generated.renew(wanted, whole=True)] == ["gone.txt", "stale.txt"]
    assert sorted(path.name for path in folder.iterdir()) == ["input.yaml", "same.txt", "stale.txt"]


def test_a_check_writes_nothing_and_fails(folder, monkeypatch, capsys):
    monkeypatch.setattr(generated, "PARTS", {"pages": lambda: files(folder)})
    with pytest.raises(SystemExit) as end:
        generated.main(["--check"])
    assert end.value.code == "stale; run python tasks.py generate"
    assert "stale.txt" in capsys.readouterr().out
    assert (folder / "stale.txt").read_bytes() == b"stale.txt"
    generated.main(["pages"])
    generated.main(["pages", "--check"])
    assert capsys.readouterr().out.endswith("pages: up to date\n")


def test_an_unknown_part_is_refused():
    with pytest.raises(SystemExit) as end:
        generated.main(["page"])
    assert end.value.code == "the parts are pages, messages, typical, reports, pictures, examples"
