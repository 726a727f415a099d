"""Umlauts, Cyrillic and Chinese signs in loops, files and paths, under every command and on consoles of code pages.

What a console lacks is replaced on the console alone: files, and what programs read, are the same everywhere.
"""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
from contextlib import chdir
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from pidcfg.cli import terminal as glyphs
from pidcfg.cli.main import main
from pidcfg.text.signs import pad_left, pad_right, width_of
from pidcfg.vendors import VENDORS

ROOT = Path(__file__).parents[1]
PAGES = ("cp1252", "cp932", "cp437")
NAMES = {"dl06": "Öfen 加熱炉 Печь", "click": "OVEN1", "ezlogix": "Öfen 加熱炉 Печь", "generic": "Öfen 加熱炉 Печь"}
"""Names of loops where the family takes any letter; the others have them in their descriptions."""
FORMER = {"dl06": "TIC-101", "ezlogix": "OVEN1", "generic": "TIC-101"}
TEXT = "Öfen № 1: 加熱炉, Печь “links” ≤ 5 €"
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


class Page(io.TextIOWrapper):
    """Standard output or error of a console with a code page."""

    def __init__(self, code_page):
        super().__init__(io.BytesIO(), encoding=code_page, errors="strict", newline="")

    def data(self):
        self.flush()
        return self.buffer.getvalue()


def ran(code_page, *arguments):
    """Exit code, standard output and error of a command, in this process and from its entry point."""
    out, err = Page(code_page), Page(code_page)
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
    text = text.replace("description: ", f'description: "{TEXT}"  # ')
    assert TEXT in text
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
    assert TEXT.encode() in first["Печь.text"]
    for name, data in first.items():
        if not name.endswith((".cdv", ".symbols", ".nickname-csv")):
            data.decode("utf-8")


@pytest.mark.parametrize("plant", ["dl06", "generic"], indirect=True)
def test_a_run_and_its_pictures(plant):
    Path("Печь.scenario.yaml").write_text(SCENARIO.format(text=TEXT.replace(": ", " "), name=NAMES[plant]), "utf-8")
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
    assert TEXT in Path("listing/炉.txt").read_text("utf-8")


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
