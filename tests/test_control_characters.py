"""No text of a file reaches a terminal, a log or a page as anything but text: every row of every table of formats."""

from __future__ import annotations

import csv
import io
import json
import re
import sys
import unicodedata
from html.parser import HTMLParser
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
from ruamel.yaml import YAML

import pidcfg as api
from pidcfg.cli.formats import FORMATS, Kind, formats_of, load
from pidcfg.cli.formats.reports import cell
from pidcfg.text.signs import UNPRINTABLE, printable
from pidcfg.text.writer import json_line, json_text
from pidcfg.vendors import VENDORS
from shell import captured, pidcfg
from test_vendors import scenario, starter

SIGNS = "\x00\x07\x08\x0b\x1b[31m\x7f\x85\x9b2J\u2028\u2029\u202e\u2066"
"""What none of the outputs may hold."""
TEXT = (
    "=1+1 | \"q\" 'a' `c` ]]> --> *) (* // # %d {x} ::error:: &lt; <b> <script>alert(1)</script> ![p](http://e/x) \\| "
    "\N{PILE OF POO}\n::warning::second\u2028line\u2029\u202egnp\u2066"
)
"""A description, as a file may have it."""
NAME = "=1 ] ]]> <b> \x1b[31m\x07\r\n::error ::x\r\x9b2J\u2028\u202e.yaml"
"""The name of a file, as systems other than Windows allow it."""
COMMANDS = ("::warning::second", "::error ::x")
"""What of these texts GitHub's runner would obey, if it began a line."""
every_vendor = pytest.mark.parametrize("vendor", VENDORS.values(), ids=list(VENDORS))
some_vendors = pytest.mark.parametrize("vendor", [*VENDORS.values()][::3], ids=[*VENDORS][::3])
"""Enough where nothing of the vendor's own writes the texts."""


def nasty(vendor):
    """The starter with such texts wherever it has a text."""
    said = json.dumps(TEXT, ensure_ascii=False).replace("\u2028", "\\L").replace("\u2029", "\\P")
    text = re.sub(r"description: .*", lambda _: f"description: {said}", starter(vendor))
    text = text.replace("name: My machine", f"name: {said}")
    return re.sub(r"\bunit: [A-Za-z0-9/]+", lambda _: f"unit: {said}", text)


@pytest.fixture
def folder(vendor, tmp_path, monkeypatch):
    """A folder with files of such texts, right and wrong, and a scenario."""
    said = '"\\e[31m\\a\\x9b2J\\L\\u202e\\n::warning::second"'
    name = api.load(starter(vendor)).model.loops[0].name
    text = nasty(vendor)
    (tmp_path / "good.yaml").write_text(text, "utf-8")
    (tmp_path / "other.yaml").write_text(starter(vendor), "utf-8")
    (tmp_path / "key.yaml").write_text(f"{text}\n{said}: {said}\n", "utf-8")
    (tmp_path / "name.yaml").write_text(text.replace(f"name: {name}", f"name: {said}"), "utf-8")
    run = scenario(vendor).replace("starter.yaml", "good.yaml")
    (tmp_path / "run.scenario.yaml").write_text(run, "utf-8")
    (tmp_path / "title.scenario.yaml").write_text(run.replace("scenario: ", f"scenario: {said} # "), "utf-8")
    if sys.platform != "win32":
        (tmp_path / NAME).write_text(text.replace("loops:", "loop:"), "utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(*words):
    """What a command prints, on both streams, and on standard output alone; a bug of the program ends the test."""
    code, terminal, out = captured(pidcfg, list(words))
    assert code != 3, terminal
    clean(terminal, words)
    assert not any(line.lstrip().startswith(COMMANDS) for line in terminal.splitlines()), (words, terminal)
    return out


def clean(text, where):
    """Ends the test where a text holds a control character."""
    found = UNPRINTABLE.search(text.replace("\r\n", "\n"))
    assert found is None, (where, text[max(0, found.start() - 60) : found.end() + 20])


class Page(HTMLParser):
    """What a browser would run of a page."""

    def __init__(self, text):
        super().__init__()
        self.scripts, self.texts, self.inside = 0, [], ""
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.inside = tag
        self.scripts += tag == "script" or any(key.startswith("on") for key, _ in attrs)

    def handle_data(self, data):
        self.texts.append(data)


def rows(text):
    """The rows of a table in Markdown, each as its cells: a bar ends one unless a backslash stands before it."""
    lines = [line for line in text.splitlines() if line.startswith("|")]
    return [re.findall(r"((?:\\.|[^\\|])*)\|", line[1:]) for line in lines]


def check_markdown(text):
    """All rows of each table are as wide, and nothing in it is HTML, a picture or a link."""
    for table in re.split(r"\n(?!\|)", text):
        assert len({len(row) for row in rows(table)}) <= 1, table
    assert not re.search(r"<(?!br>)[a-z]|\]\(", text), text


def check_github(text):
    """Every line is a command, and each is an annotation."""
    assert all(line.startswith(("::error ", "::warning ", "::notice ")) for line in text.splitlines()), text


READERS = {Kind.JSON: json.loads, Kind.XML: ET.fromstring, Kind.PLAIN: str, Kind.LINES: str, Kind.ORDERS: str}
READ = {"markdown": check_markdown, "github": check_github}


def check(fmt, text):
    """Ends the test where a text is none of its format."""
    READ.get(fmt, READERS[load(fmt).kind])(text)


def test_the_signs_are_control_characters_or_hide_what_is_written():
    assert {unicodedata.category(sign) for sign in SIGNS if UNPRINTABLE.match(sign)} == {"Cc", "Zl", "Zp", "Cf"}
    assert UNPRINTABLE.sub("", SIGNS) == "[31m2J"


# --- reports ---------------------------------------------------------------------------------------------------------


@some_vendors
@pytest.mark.parametrize("fmt", formats_of("validate"))
def test_findings(vendor, fmt, folder):
    for path in sorted(folder.glob("*.yaml")):
        check(fmt, run("validate", path.name, "--format", fmt))


@some_vendors
@pytest.mark.parametrize("fmt", formats_of("simulate"))
def test_runs(vendor, fmt, folder):
    for name in ("run.scenario.yaml", "title.scenario.yaml"):
        check(fmt, run("simulate", name, "--format", fmt, "--engine", "python", "--output", f"{fmt}=out"))
        clean(Path("out").read_text("utf-8"), fmt)


@every_vendor
@pytest.mark.parametrize("fmt", formats_of("diff"))
def test_differences(vendor, fmt, folder):
    text = run("diff", "good.yaml", "other.yaml", "--format", fmt)
    check(fmt, text)
    assert "1+1" in text


@every_vendor
@pytest.mark.parametrize("fmt", formats_of("convert"))
def test_conversions(vendor, fmt, folder):
    for target in VENDORS:
        run(
            "convert",
            "good.yaml",
            "--to",
            target,
            "-o",
            f"{target}.yaml",
            "--allow-loss",
            "--report-output",
            f"{fmt}=o",
        )
        text = Path("o").read_text("utf-8")
        clean(text, (fmt, target))
        check(fmt, text)


@some_vendors
def test_sheets_and_written_configurations(vendor, folder):
    """What hides a text is an escape there, and the text comes back."""
    description = api.load(Path("good.yaml")).model.loops[0].description
    for name in ("good.csv", "written.yaml", "decoded.yaml", "converted.yaml"):
        if name == "decoded.yaml":
            run("encode", "good.yaml", "--format", "json", "-o", "good.json", "--allow-errors")
            run("decode", "good.json", "--vendor", vendor.key, "-o", name)
        elif name == "converted.yaml":
            run("convert", "good.yaml", "--to", "generic", "-o", name, "--allow-loss")
        else:
            run("export", "good.yaml", "-o", name)
        clean(Path(name).read_text("utf-8"), name)
        if name.endswith(".csv"):
            run("init", "--from", name, "-o", (name := "read.yaml"))
        assert api.load(Path(name)).model.loops[0].description == description
    for fmt in ("yaml", "csv"):
        run("export", "good.yaml", "--format", fmt)


def test_every_format_is_tried():
    assert {*FORMATS} == {fmt for command in ("validate", "simulate", "diff", "convert") for fmt in formats_of(command)}


def test_a_cell_stays_a_cell():
    assert cell("a|b\\|c\n<i> &lt; ![x](y) f(x)") == r"a\|b\\\|c &lt;i> &amp;lt; ![x]\(y) f(x)"
    assert rows(f"| {cell('a|b')} | {cell(chr(92))} |") == [[r" a\|b ", r" \\ "]]


def test_a_page_of_a_report_runs_nothing_and_hides_nothing(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for key, vendor in VENDORS.items():
        (tmp_path / f"{key}.yaml").write_text(nasty(vendor), "utf-8")
        text = scenario(vendor).replace("starter.yaml", f"{key}.yaml")
        (tmp_path / f"{key}.scenario.yaml").write_text(text, "utf-8")
    names = [f"{key}.scenario.yaml" for key in VENDORS]
    words = ("--title", f"{TEXT}\x1b[31m", "--project", SIGNS.replace("\x00", ""), "--author", "=cmd|' /C calc'!A0")
    run("report", *names, "-o", "page.html", "--csv", "tables", "--xlsx", "tables.xlsx", *words)
    page = (tmp_path / "page.html").read_text("utf-8")
    clean(page, "page")
    assert Page(page).scripts == page.count("<script>") <= 1, "our own alone, and its hash stands in the page"
    assert "<script>alert(1)</script>" in "".join(Page(page).texts)
    for path in sorted((tmp_path / "tables").iterdir()):
        text = path.read_text("utf-8-sig")
        clean(text, path.name)
        table = list(csv.reader(io.StringIO(text)))
        assert len({len(row) for row in table}) == 1, path.name
        assert not [value for row in table for value in row if re.match(r"[=@]|[-+](?![\d.])", value)], path.name
    check_workbook(tmp_path / "tables.xlsx")


def check_workbook(path):
    """Every text of a workbook is a text, whatever it begins with, and hides nothing."""
    book = pytest.importorskip("openpyxl").load_workbook(path)
    cells = [value for sheet in book for row in sheet.iter_rows() for value in row]
    assert any(str(value.value).startswith("=") for value in cells)
    assert {value.data_type for value in cells} <= {"s", "n", "b", "inlineStr"}
    for value in cells:
        clean(str(value.value), value.coordinate)
    clean(f"{book.properties.title}{book.properties.creator}{book.active.oddHeader.left.text}", "head")


# --- listings --------------------------------------------------------------------------------------------------------

LISTINGS = [(vendor, name) for vendor in VENDORS.values() for name in vendor.load("formats")]
KINDS = pytest.mark.parametrize(("vendor", "name"), LISTINGS, ids=[f"{v.key}-{name}" for v, name in LISTINGS])


@KINDS
def test_a_listing_brings_every_text_back(vendor, name):
    kind = vendor.load("formats")[name]
    if kind.needs_into:
        return
    there = api.encode(nasty(vendor), name)
    for text in there.files.values():
        clean(text, name)
    if not (kind.whole and '"loop": ' in there.text):  # nothing of what no register holds
        return
    back = api.decode(there.text, vendor.key)
    assert back.ok, back.findings
    again = api.encode(back.text)
    assert again.image.settings == there.image.settings
    assert dict(again.image.plc) == dict(there.image.plc)
    clean(api.decode(there.text, vendor.key, annotate=True).text, name)
    assert YAML(typ="safe").load(back.text)["name"] == TEXT


@every_vendor
def test_a_listing_of_somebody_else_is_read_as_strictly_as_a_file(vendor, folder):
    document = json.loads(api.encode(starter(vendor), "json").text)
    for entry in document["settings"]:
        entry["description"] = "\x1b[31m"
    Path("evil.json").write_text(json.dumps(document), "utf-8")
    assert run("decode", "evil.json", "--vendor", vendor.key) == ""
    run("decode", "evil.json", "--vendor", vendor.key, "--annotate")
    run("diff", "good.yaml", "evil.json")
    (first, *_) = document["words"]
    document = {**document, "words": [{**first, "address": f"{SIGNS}{first['address']}"}]}
    Path("evil.json").write_text(json.dumps(document), "utf-8")
    run("decode", "evil.json", "--vendor", vendor.key)


# --- questions and arguments -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "words",
    [
        ("explain", "\x1b[31mV7642"),
        ("rule", "\x1b[31m"),
        ("schema", "\x1b[31m"),
        ("\x1b[31m",),
        ("validate", "\x1b[31m.yaml"),
        ("validate", "--select", "\x1b[31m", "x.yaml"),
        ("encode", "\x9b2J.yaml"),
        ("decode", "\x1b[31m", "--vendor", "\x1b[31m"),
        ("convert", "\x1b[31m.yaml", "--to", "\u202e"),
        ("tune", "--method", "zn-open", "--from-csv", "\x1b[31m"),
    ],
    ids=lambda words: words[0] if words[0].isprintable() else "command",
)
def test_what_a_command_says_of_its_arguments(words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run(*words)


# --- the two functions -----------------------------------------------------------------------------------------------


def test_json_escapes_what_a_terminal_would_take():
    for text in (json_text({SIGNS: SIGNS}), json_line({SIGNS: SIGNS})):
        assert json.loads(text) == {SIGNS: SIGNS}
        assert text.isascii()
    assert json_line({"ü": "\N{PILE OF POO}"}) == '{"ü": "\N{PILE OF POO}"}'


def test_a_text_for_people_keeps_its_lines():
    assert printable("a\tb\nü\N{PILE OF POO}\x1b[0m\u202e") == "a\tb\nü\N{PILE OF POO}\ufffd[0m\ufffd"
