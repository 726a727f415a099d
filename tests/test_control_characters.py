"""No text of a file reaches a terminal, a log or a page as anything but text: every row of every table of formats."""

from __future__ import annotations

import csv
import io
import json
import os
import re
import subprocess
import sys
import unicodedata
from contextlib import chdir
from html.parser import HTMLParser
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
from ruamel.yaml import YAML

import pidcfg as api
from pidcfg.cli import terminal as glyphs
from pidcfg.cli.formats import FORMATS, Kind, formats_of, load_format
from pidcfg.cli.formats.findings import markdown_cell
from pidcfg.cli.main import main
from pidcfg.text.signs import UNPRINTABLE, pad_left, pad_right, to_printable, width_of
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


READERS = {Kind.JSON: json.loads, Kind.XML: ET.fromstring, Kind.PLAIN: str, Kind.LINES: str, Kind.CI_COMMANDS: str}
READ = {"markdown": check_markdown, "github": check_github}


def check(fmt, text):
    """Ends the test where a text is none of its format."""
    READ.get(fmt, READERS[load_format(fmt).kind])(text)


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
    assert markdown_cell("a|b\\|c\n<i> &lt; ![x](y) f(x)") == r"a\|b\\\|c &lt;i> &amp;lt; ![x]\(y) f(x)"
    assert rows(f"| {markdown_cell('a|b')} | {markdown_cell(chr(92))} |") == [[r" a\|b ", r" \\ "]]


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
    if not (kind.is_complete and '"loop": ' in there.text):  # nothing of what no register holds
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
    assert to_printable("a\tb\nü\N{PILE OF POO}\x1b[0m\u202e") == "a\tb\nü\N{PILE OF POO}\ufffd[0m\ufffd"


# --- Umlauts, Cyrillic and Chinese signs in loops, files and paths, under every command and on consoles ---------------
# What a console lacks is replaced on the console alone: files, and what programs read, are the same everywhere.


ROOT = Path(__file__).parents[1]
PAGES = ("cp1252", "cp932", "cp437")
NAMES = {"dl06": "Öfen 加熱炉 Печь", "click": "OVEN1", "ezlogix": "Öfen 加熱炉 Печь", "generic": "Öfen 加熱炉 Печь"}
"""Names of loops where the family takes any letter; the others have them in their descriptions."""
FORMER = {"dl06": "TIC-101", "ezlogix": "OVEN1", "generic": "TIC-101"}
ALPHABETS = "Öfen № 1: 加熱炉, Печь “links” ≤ 5 €"
FOLDER = "Anlage Öfen 加熱炉 Печь"
SCENARIO = """\
pidcfg: 1
scenario: {text}
config: Öfen 加熱炉.yaml
duration: 20
step: 0.5
plants: {{{name}: {{model: first_order, gain: 2, time_constant: 20}}}}
expect: [{{signal: {name}.PV, max: 1}}]
"""


class CodePage(io.TextIOWrapper):
    """Standard output or error of a console with a code page."""

    def __init__(self, code_page):
        super().__init__(io.BytesIO(), encoding=code_page, errors="strict", newline="")

    def data(self):
        self.flush()
        return self.buffer.getvalue()


def ran(code_page, *arguments):
    """Exit code, standard output and error of a command, in this process and from its entry point."""
    out, err = CodePage(code_page), CodePage(code_page)
    before = sys.stdout, sys.stderr, sys.argv
    sys.stdout, sys.stderr, sys.argv = out, err, ["pidcfg", *arguments]
    try:
        main()
    except SystemExit as end:
        code = int(end.code or 0)
    finally:
        sys.stdout, sys.stderr, sys.argv = before
    said = err.data()
    assert b"Traceback" not in said, said.decode(code_page)
    return code, out.data(), said


@pytest.fixture(params=VENDORS)
def plant(request, tmp_path, monkeypatch):
    """A folder with a starter file of one family in many alphabets; its vendor."""
    vendor = request.param
    text = (ROOT / f"src/pidcfg/cli/starters/{vendor}.yaml").read_text("utf-8")
    name = NAMES.get(vendor, "")
    if name and vendor in FORMER:
        text = text.replace(FORMER[vendor], name)
    text = text.replace("description: ", f'description: "{ALPHABETS}"  # ')
    assert ALPHABETS in text
    folder = tmp_path / FOLDER
    folder.mkdir()
    (folder / "Öfen 加熱炉.yaml").write_text(text, "utf-8")
    monkeypatch.setenv("NO_COLOR", "1")
    monkeypatch.setenv("COLUMNS", "100")
    monkeypatch.delenv("GITHUB_ACTIONS", raising=False)
    with chdir(folder):
        yield vendor


FILE = "Öfen 加熱炉.yaml"


def commands(vendor):
    """Command lines for every command, each with the format of what it prints, and what it writes."""
    lines = [(("validate", FILE, "--format", fmt), fmt) for fmt in ("text", "concise", "json", "sarif", "github")]
    lines += [(("validate", FILE, "--format", fmt), fmt) for fmt in ("gitlab", "junit")]
    lines += [
        (("encode", FILE, "--allow-errors", "--format", fmt), fmt) for fmt in VENDORS[vendor].load("format_names")
    ]
    other = "generic" if vendor != "generic" else "dl06"
    lines += [(("convert", FILE, "--to", other, "--allow-loss"), "text")]
    lines += [(("diff", FILE, FILE, "--format", fmt), fmt) for fmt in ("text", "json", "markdown")]
    lines += [(("explain", "gain", "--in", FILE, "--vendor", vendor), "text"), (("validate", "Печь 1.yaml"), "text")]
    return lines


def same(fmt, page, expected, got):
    """Whether a code page shows what UTF-8 shows: a file or JSON the same, a text with its fallback."""
    if got == expected:
        return True
    if fmt in {"json", "sarif", "gitlab"}:
        return json.loads(got.decode(page)) == json.loads(expected)
    if fmt in {"junit", "plcopen"}:
        return ET.canonicalize(got.decode(page)) == ET.canonicalize(expected.decode())
    return got.decode(page) == glyphs.encodable(expected.decode(), page)


def test_every_format_of_a_file_in_many_alphabets(plant):
    for arguments, fmt in commands(plant):
        code, expected, _ = ran("utf-8", *arguments)
        for page in PAGES:
            again, got, said = ran(page, *arguments)
            assert again == code, (arguments, said.decode(page))
            assert same(fmt, page, expected, got), arguments


def test_files_are_the_same_on_every_console(plant):
    made = {}
    formats = VENDORS[plant].load("format_names")
    for console in ("utf-8", *PAGES):
        Path(console).mkdir()
        for fmt in formats:
            code, _, said = ran(console, "encode", FILE, "--format", fmt, "-o", f"{console}/Печь.{fmt}")
            assert code == 0 or fmt == "data-dump", said.decode(console)
        other = "generic" if plant != "generic" else "dl06"
        ran(console, "convert", FILE, "--to", other, "--allow-loss", "-o", f"{console}/炉.yaml", "-q")
        for fmt in ("text", "json", "junit", "sarif"):
            ran(console, "validate", FILE, "--output", f"{fmt}={console}/Öfen.{fmt}")
        ran(console, "report", FILE, "-o", f"{console}/炉.html", "--title", "Печь", "--exit-zero")
        made[console] = {path.name: path.read_bytes() for path in Path(console).iterdir()}
    first, *others = made.values()
    assert others == [first] * len(PAGES)
    assert "炉.html" in first
    assert ALPHABETS.encode() in first["Печь.text"]
    for name, data in first.items():
        if not name.endswith((".cdv", ".symbols", ".nickname-csv")):
            data.decode("utf-8")


@pytest.mark.parametrize("plant", ["dl06", "generic"], indirect=True)
def test_a_run_and_its_pictures(plant):
    Path("Печь.scenario.yaml").write_text(
        SCENARIO.format(text=ALPHABETS.replace(": ", " "), name=NAMES[plant]), "utf-8"
    )
    for fmt in ("text", "json", "junit", "gitlab"):
        arguments = ("simulate", "Печь.scenario.yaml", "--engine", "python", "--format", fmt)
        code, expected, _ = ran("utf-8", *arguments)
        for page in PAGES:
            again, got, said = ran(page, *arguments)
            assert again == code == 1, said.decode(page)
            assert same(fmt, page, expected, got), fmt
    made = {}
    for console in ("utf-8", *PAGES):
        files = [f"{console}-炉.csv", f"{console}-炉.svg"]
        code, _, said = ran(
            console, "simulate", "Печь.scenario.yaml", "--trend", files[0], "--plot", files[1], "--plot", "-"
        )
        assert code == 1, said.decode(console)
        made[console] = [Path(name).read_bytes() for name in files]
    first, *others = made.values()
    assert others == [first] * len(PAGES)
    assert NAMES[plant].encode() in first[0]


@pytest.mark.parametrize("page", [*PAGES, "ascii"])
def test_commands_that_read_no_file_of_yours(page):
    for arguments in (
        ("rule", "DL212"),
        ("schema",),
        ("init", "--vendor", "dpide"),
        ("completion", "bash"),
        ("explain",),
    ):
        code, expected, _ = ran("utf-8", *arguments)
        again, got, said = ran(page, *arguments)
        assert (again, code) == (0, 0), said
        assert got.decode(page) == glyphs.encodable(expected.decode(), page)
    for arguments in (("validate", "--печь"), ("печь",), ("explain", "加熱炉"), ("rule", "Öfen")):
        assert ran(page, *arguments)[0] == 2


@pytest.mark.parametrize(
    "settings",
    [
        {"PYTHONIOENCODING": "cp932", "PYTHONUTF8": "0"},
        {"PYTHONIOENCODING": "cp1252:strict", "PYTHONUTF8": "0"},
        {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"},
    ],
    ids=lambda settings: " ".join(settings.values()),
)
@pytest.mark.parametrize("plant", ["dl06"], indirect=True)
def test_a_process_of_its_own(plant, settings):
    environment = {**os.environ, **settings, "PYTHONPATH": str(ROOT / "src")}
    Path("listing").mkdir()
    for arguments, expected in (
        (["validate", "."], 0),
        (["encode", FILE, "-o", "listing/炉.txt"], 0),
        (["validate", "печь.yaml"], 2),
    ):
        command = [sys.executable, "-m", "pidcfg", *arguments]
        result = subprocess.run(command, capture_output=True, env=environment, check=False)
        assert result.returncode == expected, result.stderr
        assert b"Traceback" not in result.stderr
    assert ALPHABETS in Path("listing/炉.txt").read_text("utf-8")


# --- columns ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "columns"),
    [
        ("abc", 3),
        ("", 0),
        ("Öfen", 4),
        ("O\N{COMBINING DIAERESIS}fen", 4),
        ("Печь", 4),
        ("加熱炉", 6),
        ("\N{FULLWIDTH LATIN CAPITAL LETTER A}", 2),
        ("ｱ", 1),
    ],
)
def test_the_columns_of_a_text(text, columns):
    assert width_of(text) == columns
    assert width_of(pad_right(text, 9)) == width_of(pad_left(text, 9)) == 9
    assert pad_right(text, 9).startswith(text)
    assert pad_left(text, 9).endswith(text)
    assert pad_right(text, 1) == text or columns < 2


def places(lines, sign):
    """The columns in which a sign begins in each line."""
    return {width_of(line.partition(sign)[0]) for line in lines}


def test_tables_and_carets_stand_below_each_other(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = (ROOT / "src/pidcfg/cli/starters/dl06.yaml").read_text("utf-8")
    loop = text[text.index("  - name: TIC-101") :]
    Path("a.yaml").write_text(text + loop.replace("TIC-101", "加熱炉").replace("slot: 1", "slot: 3"), "utf-8")
    listing = ran("utf-8", "encode", "a.yaml", "--allow-errors")[1].decode().splitlines()
    rows = [line for line in listing if line.startswith("V2") and line.endswith(("  gain", "  rate"))]
    assert len(rows) == 4
    assert len(places(rows, "gain")) <= 2
    assert {width_of(row.rpartition(" ")[0]) for row in rows} == {width_of(rows[0].rpartition(" ")[0])}
    Path("l.txt").write_text("\n".join(listing), "utf-8")
    meanings = ran("utf-8", "decode", "l.txt", "--vendor", "dl06", "--annotate")[1].decode().splitlines()
    head = next(line for line in meanings if line.endswith("meaning"))
    at = width_of(head.removesuffix("meaning"))
    row = next(line for line in meanings if "加熱炉" in line and " gain " in line)
    before = ""
    while width_of(before) < at:
        before = row[: len(before) + 1]
    assert (width_of(before), before[-1], row[len(before)] != " ") == (at, " ", True)


def test_a_caret_stands_below_its_value(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = "pidcfg: 1\nvendor: generic\nname: 加熱炉\nloops: [{name: 加熱炉, description: 炉, sample_time: high}]\n"
    Path("a.yaml").write_text(text, "utf-8")
    lines = ran("utf-8", "validate", "a.yaml")[1].decode().splitlines()
    at = next(i for i, line in enumerate(lines) if "PID022" in line)
    shown, caret = lines[at + 1], lines[at + 2]
    assert width_of(shown.partition("high")[0]) == caret.index("^")
    assert caret.count("^") == len("high")
