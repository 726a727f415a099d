"""Commands that take several files name everything that is wrong with them, in the order of the command line."""

from __future__ import annotations

import json

import pytest

import pidcfg as api
from pidcfg.vendors import VENDORS
from shell import captured, pidcfg
from test_vendors import starter

MERGING = [(vendor, name) for vendor in VENDORS.values() for name, kind in vendor.load("formats").items() if kind.merge]


@pytest.fixture(autouse=True)
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


@pytest.mark.parametrize("vendor", VENDORS)
def test_decode_names_every_file_that_cannot_be_read(vendor):
    shown, out = said("decode", "gone.txt", "words.txt", "lost.txt", "other.json", "--vendor", vendor)
    assert in_order(shown, "cannot read gone.txt", "words.txt:1:1", "cannot read lost.txt", "other.json:1:")
    assert shown.count("Error: ") == 4
    shown, out = said("decode", "other.json", "gone.txt", "--vendor", vendor)
    assert in_order(shown, "other.json:1:", "cannot read gone.txt")
    assert out == ""


@pytest.mark.parametrize("vendor", VENDORS)
def test_decode_names_every_listing_that_is_none(vendor):
    shown, _ = said("decode", "other.json", "words.txt", "--vendor", vendor)
    assert in_order(shown, "other.json:1:", "words.txt:1:1")
    result = api.decode([b"{", b"nothing"], vendor, name=["one", "two"])
    assert [finding.file for finding in result.findings] == ["one", "two"]


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


def test_an_error_in_json_stays_json(folder):
    vendor, _ = MERGING[0]
    (folder / "bad.yaml").write_text(starter(vendor).replace("loops:", "loop:"), "utf-8")
    shown, out = said("encode", "bad.yaml", "--format", "json", "--into", "gone.csv")
    assert json.loads(out)["findings"]
    assert "cannot read gone.csv" in shown
