"""What the report prints and what it leaves out: a page a loop, nothing at its default, numbers that people read."""

from __future__ import annotations

import io
import json
import re
import stat
from dataclasses import replace
from html.parser import HTMLParser
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import pytest
from click.testing import CliRunner

from browser import BEYOND, IN_CI, NARROW, WIDE, opened, width_of
from pidcfg.cli.main import cli
from pidcfg.output.report import (
    Expectation,
    Run,
    RunSheet,
    StandingRow,
    Title,
    Units,
    contents_of,
    measured_quantity,
    measurement_text,
    metric_unit,
    worst_trend,
)
from pidcfg.output.report.formats import (
    BROWSER_VARIABLE,
    FindingGroup,
    PdfError,
    compared_words,
    door_sheet,
    find_browser,
    first_clause,
    group_findings,
    print_pdf,
    report_page,
)
from pidcfg.output.report.sheets import compose_report, plc_sheet
from pidcfg.pictures import Chart, Line, Panel
from pidcfg.sim.judgement.report import Verdict
from pidcfg.text.source import read_document
from pidcfg.validate.engine import check_document

# --- What the report prints and what it leaves out: a page a loop, nothing at its default, numbers that people read ---

EXAMPLES = Path(__file__).parents[1] / "examples"
EIGHT = EXAMPLES / "dl06/extruder.scenario.yaml"
HOSTILE = "<script>window.pwned=1</script>\"'</td>"


def run(*args):
    """The command's result; a traceback is a failure of the test."""
    result = CliRunner().invoke(cli, ["report", *map(str, args)])
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result


def content(name, change=("", "")):
    """The content of a report on an example's configuration."""
    text = (EXAMPLES / f"{name}.yaml").read_text("utf-8")
    text = text.replace(*change) if change[0] else text
    checked = check_document(read_document(text.encode(), f"{name}.yaml"))
    return compose_report(Title("T", version="1"), [], [plc_sheet(checked)], [], checked.findings)


class Page(HTMLParser):
    """Rows of tables by the class of their table, and all elements."""

    def __init__(self, text):
        super().__init__()
        self.elements, self.rows, self.table, self.cells = [], {}, "", None
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attrs):
        names = dict(attrs).get("class") or ""
        self.elements.append((tag, dict(attrs)))
        if tag == "table":
            self.table = names
        elif tag == "tr":
            self.cells = []
            self.rows.setdefault(self.table, []).append(self.cells)
        elif tag in {"td", "th"} and self.cells is not None:
            self.cells.append("")

    def handle_endtag(self, tag):
        if tag == "tr":
            self.cells = None

    def handle_data(self, data):
        if self.cells:
            self.cells[-1] += data


def settings_of(text):
    """The rows of all tables of settings by their paths."""
    rows = Page(text).rows
    return {row[0]: row[1:] for name in rows if "settings" in name for row in rows[name] if len(row) > 3}


@pytest.fixture
def printer():
    """The browser that prints; without one the test is skipped, in CI it fails."""
    try:
        return find_browser()
    except PdfError as error:
        (pytest.fail if IN_CI else pytest.skip)(str(error))


# --- what is printed -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["dl06/extruder", "click/tank", "ezlogix/oven", "nextopid/cascade", "dpide/oven"])
def test_a_default_is_printed_with_full_only(name):
    report = content(name)
    given = {s.path for _, loop in report.loops for g in loop.groups for s in g.settings if s.is_given}
    default = {s.path for _, loop in report.loops for g in loop.groups for s in g.settings} - given
    assert default
    short, full = settings_of(report_page(report)), settings_of(report_page(report, full=True))
    units = {path for path in given if path.endswith(".unit")}
    assert given - units <= short.keys()
    assert not (default | units) & short.keys()
    assert given | default <= full.keys()


def test_a_value_stands_with_its_unit_place_and_first_clause():
    row = settings_of(report_page(content("dl06/reactor")))["tuning.gain"]
    assert row[:3] == ["Gain Kc", "2.5 %/%", "V2050"]


@pytest.mark.parametrize(
    ("meaning", "first"),
    [
        ("Gain Kc, fraction of output span.", "Gain Kc"),
        ("High alarm: on while the PV is above.", "High alarm"),
        ("Lower limit (DFn+01).", "Lower limit"),
        ("High alarm (DFn+15, status Cn+33).", "High alarm"),
        ("Integral (reset) time Ti in s; 0 removes it.", "Integral (reset) time Ti in s"),
        ("Wait 0.5 s", "Wait 0.5 s"),
    ],
)
def test_a_meaning_is_cut_after_its_first_clause(meaning, first):
    assert first_clause(meaning) == first


def test_words_are_compared_as_the_plc_shows_them():
    words = contents_of(content("dl06/reactor").loops[0][1].blocks)
    assert words["V2010"] == "0080", "BCD digits of a gain of 0.80"
    assert words["V2002"] == "0666", "1638 counts"
    assert "V2003" not in words, "the PLC writes the PV"
    assert contents_of(content("ezlogix/oven").loops[0][1].blocks)["R102"] == "1843"
    assert contents_of(content("click/tank").loops[0][1].blocks)["DF101"] == "140"


def test_many_zeros_stand_as_one():
    rows = dict(compared_words(content("dl06/extruder").loops[4][1].blocks))
    assert rows["V17350 to V17377"] == "0000"
    assert "V17351" not in rows
    assert rows["V17610"] == "0250"


def test_digits_and_bits_have_no_decimal_number():
    rows = {row[0]: row for row in Page(report_page(content("dl06/reactor"), full=True)).rows["words"] if len(row) == 6}
    assert rows["V2010"][2:5] == ["0080", "", "0.8 %/%"]
    assert rows["V2000"][3] == ""
    assert rows["V2002"][2:4] == ["0666", "1638"]
    assert rows["V2032"][3] == "", "an address"


def test_cascade_from_has_its_register():
    assert settings_of(report_page(content("dl06/reactor")))["cascade_from"][2] == "V2032"


def test_findings_that_are_explained_alike_are_explained_once():
    report = content("dl06/extruder")
    groups = group_findings(report.findings)
    assert sum(len(group.findings) for group in groups) == len(report.findings) == 19
    assert len(groups) < 10
    text = report_page(report)
    assert text.count(groups[0].first.help.split("`")[0]) == 1
    assert all(f'id="finding-{i}"' in text for i in range(1, 20))


@pytest.mark.parametrize(
    ("name", "pulses", "duty"),
    [
        ("ezlogix/oven", "every 10 s, on O1, on at least 0.5 s, off at least 0.5 s", "0 to 100 %"),
        ("click/tank", "every 5 s, on Y001", "0 to 100 %"),
        ("dpide/oven", "every 4000 ms, on Y0.0", "0 to 100 %"),
    ],
)
def test_pulses_and_their_duty_cycle_are_told(name, pulses, duty):
    facts = {fact.title: fact.text for fact in content(name).loops[0][1].facts}
    assert (facts["Pulses"], facts["Duty cycle"]) == (pulses, duty)


def test_a_duty_cycle_is_that_of_the_limits():
    report = content("click/tank", ("limits: [0, 100]", "limits: [20, 90]"))
    assert {fact.title: fact.text for fact in report.loops[0][1].facts}["Duty cycle"] == "20 to 90 %"


@pytest.mark.parametrize("name", ["dl06/reactor", "click/brewery"])
def test_an_analog_output_has_no_pulses(name):
    assert not {"Pulses", "Duty cycle"} & {fact.title for _, loop in content(name).loops for fact in loop.facts}


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (4147102619, "4.1471×10⁹"),
        (-0.0001234, "-123.4×10⁻⁶"),
        (999_999_900.0, "1×10⁹"),
        (179.99432, "179.99"),
        (123456.7, "123457"),
        (999999.9, "1000000"),
        (0.0, "0"),
        (5e-324, "4.9407×10⁻³²⁴"),
        (float("inf"), "inf"),
    ],
)
def test_a_measured_number_has_engineering_digits(value, text):
    assert measurement_text(value) == text


@pytest.mark.parametrize(
    ("metric", "unit"),
    [
        ("iae", "degC·s"),
        ("ise", "degC²·s"),
        ("itae", "degC·s²"),
        ("final_error", "degC"),
        ("total_variation", "%"),
        ("overshoot", ""),
    ],
)
def test_a_metric_has_the_unit_of_its_loop(metric, unit):
    assert metric_unit(metric, Units("degC", "%")) == unit
    assert metric_unit(metric, Units()) == metric_unit(metric, None) == ""


@pytest.mark.parametrize(
    ("text", "value", "shown"),
    [
        ("TIC-1 overshoot at most 5 %", 3.2, "3.2 %"),
        ("TIC-1 settling_time (band 5 %) at most 60 s", 41.0, "41 s"),
        ("TIC-1 iae at most 900", 812.5, "812.5 degC·s"),
        ("TIC-1.PV 85 ± 1 at the end", 85.25, "85.25 degC"),
        ("TIC-1.OUT at least 0 and at most 90", [3.0, 80.5], "3 to 80.5 %"),
        ("TIC-1 mode is auto at the end", "manual", "manual"),
        ("TIC-1 alarm pv_high never", None, "none"),
        ("TIC-1 flag overflow is false", True, "true"),
    ],
)
def test_what_was_found_has_its_unit(text, value, shown):
    units = {"TIC-1": Units("degC", "%", {"TIC-1.PV": "degC", "TIC-1.OUT": "%"})}
    assert measured_quantity(Verdict(text, passed=True, value=value, loop="TIC-1"), units) == shown


def test_the_metrics_of_a_run_have_units(tmp_path):
    run(EXAMPLES / "dl06/reactor.scenario.yaml", "-o", tmp_path / "r.html", "-q")
    text = (tmp_path / "r.html").read_text("utf-8")
    assert "degC·s²" in text
    cells = [cell for rows in Page(text).rows.values() for row in rows for cell in row]
    assert not [cell for cell in cells if re.search(r"\d{7,}|\d[.]\d{6,}", cell)], "numbers that nobody can read"


def test_full_shows_every_signal_with_its_unit(tmp_path):
    run(EXAMPLES / "click/tank.scenario.yaml", "-o", tmp_path / "short.html", "-q")
    run(EXAMPLES / "click/tank.scenario.yaml", "--full", "-o", tmp_path / "full.html", "-q")
    short, full = (Page((tmp_path / f"{name}.html").read_text("utf-8")).rows for name in ("short", "full"))
    rows = {row[0]: row[-1] for rows in full.values() for row in rows if len(row) == 5}
    assert (rows["TANK1.PV"], rows["TANK1.SP"], rows["TANK1.CO"]) == ("degF", "degF", "%")
    assert "TANK1.PV" not in {row[0] for rows in short.values() for row in rows if row}


# --- the cover -------------------------------------------------------------------------------------------------------


def test_the_cover_shows_the_alarms_that_stand_beside_the_verdict(tmp_path):
    for name in ("tank.yaml", "tank.scenario.yaml"):
        text = (EXAMPLES / "click" / name).read_text("utf-8")
        (tmp_path / name).write_text(text.replace("for: 60", "for: 3000"), "utf-8")
    run(tmp_path / "tank.scenario.yaml", "-o", tmp_path / "r.html", "-q", "--exit-zero")
    (row,) = Page((tmp_path / "r.html").read_text("utf-8")).rows["runs"][1:]
    assert "passed" in row[1]
    assert "TANK1 PV low-low since 2100.5 s" in " ".join(row[2].split())
    assert "TANK1 deviation high-high since" in row[2]


def test_a_run_without_standing_alarms_says_so(tmp_path):
    run(EXAMPLES / "dl06/reactor.scenario.yaml", "-o", tmp_path / "r.html", "-q")
    (row,) = Page((tmp_path / "r.html").read_text("utf-8")).rows["runs"][1:]
    assert row[2] == "none"


def test_alarms_have_names_in_words_where_a_run_tells_them(tmp_path):
    run(EXAMPLES / "click/tank.scenario.yaml", "-o", tmp_path / "r.html", "-q")
    rows = [row for rows in Page((tmp_path / "r.html").read_text("utf-8")).rows.values() for row in rows]
    alarms = [row for row in rows if len(row) == 5 and row[3] == "alarm"]
    assert {row[4] for row in alarms} >= {"PV low", "PV low-low", "deviation high"}


def test_page_one_has_the_verdict_and_the_trend_to_look_at_first(tmp_path):
    run(EXAMPLES / "dl06/reactor.scenario.yaml", "-o", tmp_path / "r.html", "-q")
    text = (tmp_path / "r.html").read_text("utf-8")
    order = [text.index(part) for part in ('class="verdict"', 'class="worst"', 'id="contents"', 'id="findings"')]
    assert order == sorted(order)
    assert "no errors, the run passed" in text[order[0] : order[1]]
    first = text[order[1] : order[2]]
    assert first.count("<figcaption") == 1
    assert "TIC-101: Reactor temperature" in first, "the only one with an overshoot"


def chart_of(loop):
    return Chart(loop, loop, (Panel("PV", "", (Line("PV", "pv", [0.0, 1.0], [0.0, 1.0]),)),))


@pytest.mark.parametrize(
    ("verdicts", "first"),
    [
        ({"A": ("proven", 5.0), "B": ("proven", 9.0)}, "B"),
        ({"A": ("not-proven", None), "B": ("proven", 9.0)}, "A"),
        ({"A": ("not-proven", 90.0), "B": ("failed", None)}, "B"),
        ({"A": ("not-judged", None), "B": ("proven", None)}, "B"),
        ({}, None),
    ],
)
def test_the_gravest_verdict_and_then_the_largest_overshoot_come_first(verdicts, first):
    loops = {
        loop: SimpleNamespace(verdict=verdict, metrics={"overshoot": overshoot})
        for loop, (verdict, overshoot) in verdicts.items()
    }
    run = Run("a.yaml", "b.yaml", charts=[chart_of(loop) for loop in verdicts])
    found = worst_trend(run, SimpleNamespace(loops=loops))
    assert (found and re.search(r"<figcaption[^>]*>(\w)<", found.picture)[1]) == first


def test_the_verdict_of_a_report_names_errors_and_runs_that_did_not_pass():
    good, bad = content("dl06/reactor"), content("mistakes/oven")
    ran = RunSheet("s.yaml", "a.yaml", "s", has_run=True, passed=True, verdict="")
    assert good.verdict == ("", "No errors; nothing was run.")
    assert replace(good, runs=(ran, ran)).verdict == ("passed", "no errors, all 2 runs passed")
    assert replace(good, runs=(ran, replace(ran, passed=False))).verdict == ("FAILED", "1 of 2 runs not passed")
    assert bad.verdict == ("FAILED", "2 errors")


def test_findings_that_several_loops_share_are_one_row_with_its_loops():
    group = next(group for group in group_findings(content("dl06/extruder").findings) if len(group.findings) > 1)
    assert [d for row in group.rows for d in row] != []
    assert sum(map(len, group.rows)) == len(group.findings)
    said = [row[0].message for row in group.rows]
    assert len(said) == len({*said})
    alike = [replace(group.first, loop=loop, message=f"{loop} waits") for loop in ("A", "B")]
    assert FindingGroup(alike[0], tuple(alike)).rows == [alike]


# --- the sheet for the door ------------------------------------------------------------------------------------------


def test_the_sheet_has_every_loop_with_its_main_words():
    rows = [" ".join(" ".join(row).split()) for row in Page(door_sheet(content("dl06/extruder"))).rows["door"][1:]]
    assert len(rows) == 8
    for part in ("TIC-Z1 Barrel zone 1", "PV rises V17400 bit 4", "170 degC V17402 06CC", "Gain 4 %/% V17410 0400"):
        assert part in rows[0]
    for part in ("Reset 150 s V17411 1500", "Rate 20 s V17412 2000", "0 to 400 degC"):
        assert part in rows[0]
    assert "PV falls" in rows[6]


def test_the_alarms_of_the_sheet_are_a_table_of_loops_and_limits():
    head, first, *others = Page(door_sheet(content("dl06/extruder"))).rows["door limits"]
    assert len(others) == 7
    assert head[:5] == ["Loop", "low-low", "low", "high", "high-high"]
    limits = dict(zip(head, (" ".join(text.split()) for text in first), strict=True))
    assert limits["high-high"].startswith("350 degC V1741")


def test_the_sheet_tells_pulses_and_errors():
    assert "pulses every 10 s, on O1" in door_sheet(content("ezlogix/oven"))
    assert "Not for the door" not in door_sheet(content("ezlogix/oven"))
    assert "Not for the door: 2 errors" in door_sheet(content("mistakes/oven"))


def test_no_name_escapes_from_the_sheet_or_the_page():
    report = content("click/tank", ("description: ", f"description: {json.dumps(HOSTILE)} # "))
    assert report.loops[0][1].description == HOSTILE
    for text, scripts in ((door_sheet(report), 0), (report_page(report), 1), (report_page(report, full=True), 1)):
        found = Page(text)
        assert [tag for tag, _ in found.elements].count("script") == scripts
        assert "&lt;script&gt;window.pwned" in text


def test_a_sheet_runs_nothing_and_has_no_trend(tmp_path):
    result = run(EIGHT, "--sheet", "-o", tmp_path / "door.html", "-q")
    text = (tmp_path / "door.html").read_text("utf-8")
    assert result.exit_code == 0
    assert "<script" not in text
    assert "<figure" not in text


def test_a_sheet_is_never_full():
    result = run(EXAMPLES / "dl06/reactor.yaml", "--sheet", "--full")
    assert result.exit_code == 2
    assert "--sheet and --full" in result.stderr


# --- PDF -------------------------------------------------------------------------------------------------------------


def pages_of(path):
    """The texts of a PDF's pages."""
    return [re.sub(r"\s+", " ", one.extract_text()) for one in pytest.importorskip("pypdf").PdfReader(path).pages]


def test_eight_loops_take_a_page_each_and_full_takes_more(tmp_path, printer):
    assert run(EIGHT, "-o", tmp_path / "short.pdf", "-q").exit_code == 0
    texts = pages_of(tmp_path / "short.pdf")
    assert len(texts) <= 16
    assert "Contents" not in texts[0]
    assert "TIC-Z1 Barrel zone 1, feed" in texts[0]
    for loop in ("TIC-Z1", "TIC-Z4", "TIC-DIE", "PIC-MELT", "TIC-WTR", "SIC-HAUL"):
        (sheet,) = [text for text in texts if f"Loop {loop} " in text]
        assert f"Commissioning of {loop} " in sheet
    assert all(f"Page {i} of {len(texts)}" in text for i, text in enumerate(texts, start=1))
    assert run(EXAMPLES / "dl06/extruder.yaml", "--full", "-o", tmp_path / "full.pdf", "-q").exit_code == 0
    assert len(pages_of(tmp_path / "full.pdf")) > 30


def test_the_sheet_of_eight_loops_is_one_page(tmp_path, printer):
    assert run(EIGHT, "--sheet", "-o", tmp_path / "door.pdf", "-q").exit_code == 0
    pdf_file = pytest.importorskip("pypdf").PdfReader(tmp_path / "door.pdf")
    assert len(pdf_file.pages) == 1
    assert float(pdf_file.pages[0].mediabox.width) > float(pdf_file.pages[0].mediabox.height)


def test_the_same_page_gives_the_same_pdf(printer):
    html = report_page(content("dl06/flow"))
    first = print_pdf(html, printer)
    assert first == print_pdf(html, printer)
    assert pytest.importorskip("pypdf").PdfReader(io.BytesIO(first)).metadata.creation_date.year == 2000


def test_without_a_browser_there_is_one_clear_error_before_anything_runs(tmp_path, monkeypatch):
    monkeypatch.setattr("pidcfg.output.report.formats.shutil.which", lambda _: None)
    result = run(EIGHT, "-o", tmp_path / "r.pdf")
    assert result.exit_code != 0
    assert "a PDF is printed by Chromium, Chrome or Edge, and none of them is here; install one" in result.stderr
    assert BROWSER_VARIABLE in result.stderr
    assert not list(tmp_path.iterdir())
    monkeypatch.setenv(BROWSER_VARIABLE, "no-such-browser")
    assert "PIDCFG_BROWSER names 'no-such-browser', which is no program here" in run(EIGHT, "-o", "r.pdf").stderr


def test_what_a_browser_says_when_it_fails_is_told(tmp_path, monkeypatch):
    fake = tmp_path / "browser"
    fake.write_text("#!/bin/sh\necho first >&2\necho the disk is full >&2\nexit 3\n", "utf-8")
    fake.chmod(fake.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setenv(BROWSER_VARIABLE, str(fake))
    result = run(EXAMPLES / "dl06/flow.yaml", "-o", tmp_path / "r.pdf")
    assert result.exit_code != 0
    assert f"{fake} has printed nothing: the disk is full" in result.stderr
    assert not (tmp_path / "r.pdf").exists()
    fake.write_text("not a program", "utf-8")
    assert "cannot be started" in run(EXAMPLES / "dl06/flow.yaml", "-o", tmp_path / "r.pdf").stderr


# --- The commissioning report in a real browser: on a screen, on a telephone, and printed -----------------------------

PAGE_EXAMPLES = Path(__file__).parents[1] / "examples"
SCENARIOS = ("dl06/reactor", "click/tank", "ezlogix/oven", "nextopid/autotune", "dpide/oven")
LOOPS = ("FIC-102", "TIC-101", "LIC-103", "TANK1", "OVEN1", "EXHAUST", "TIC_1", "OVEN")
A4 = (595.28, 841.89)
PRINTABLE = 680
"""Pixels between the margins of an A4 page: 180 mm."""
CONTRAST = """() => {
  const parts = c => (c.match(/[\\d.]+/g) || []).map(Number);
  const light = c => { const [r, g, b] = parts(c).slice(0, 3).map(v => v / 255)
    .map(v => v <= .04045 ? v / 12.92 : ((v + .055) / 1.055) ** 2.4); return .2126 * r + .7152 * g + .0722 * b; };
  const behind = e => { for (; e; e = e.parentElement) { const c = getComputedStyle(e).backgroundColor, p = parts(c);
    if (p.length < 4 || p[3] > 0) return c; } return 'rgb(255, 255, 255)'; };
  const poor = [];
  for (const e of document.querySelectorAll('body *')) {
    if (e.closest('svg') || ![...e.childNodes].some(n => n.nodeType === 3 && n.data.trim())) continue;
    const [a, b] = [light(getComputedStyle(e).color), light(behind(e))].sort((x, y) => y - x);
    if ((a + .05) / (b + .05) < 4.5) poor.push(e.tagName + '.' + e.className + ' ' + e.textContent.slice(0, 30));
  }
  return poor;
}"""

PAGE_HOSTILE = """\
pidcfg: 1
vendor: click
name: "<script>window.pwned = 1</script>"
loops:
  - name: مضخة-7
    description: "=1+1 \\"quoted\\" 'single' <img src=x onerror=window.pwned=1> & 🔥 {{ 7 * 7 }} LONGWORD"
    bits: C101
    integers: DS101
    floats: DF101
    action: direct
    action_verified: true
    sample_rate: 500 ms
    tuning: {proportional_gain: 2, reset_time: 50}
    pv: {range: [0, 100], unit: "</td><script>window.pwned=1</script>"}
    setpoint: {value: 50}
    output: {unit: "%"}
""".replace("LONGWORD", "W" * 400)
PROJECT = '"}</style><script>window.pwned=1</script>\\'


def made(folder, *args):
    """A report in a folder."""
    path = folder / "report.html"
    result = CliRunner().invoke(cli, ["report", *args, "-o", str(path), "-q"])
    assert not result.exception, result.output
    return path


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    """One report on an example of every vendor."""
    names = [str(PAGE_EXAMPLES / f"{name}.scenario.yaml") for name in SCENARIOS]
    return made(tmp_path_factory.mktemp("report"), *names, "--project", "Works 7", "--document", "PID-0042")


@pytest.fixture(scope="module")
def hostile(tmp_path_factory):
    """A report whose names and texts are made to break it."""
    folder = tmp_path_factory.mktemp("hostile")
    (folder / "hostile.yaml").write_text(PAGE_HOSTILE, "utf-8")
    return made(folder, str(folder / "hostile.yaml"), "--project", PROJECT, "--author", "<b>bold</b>", "--exit-zero")


@pytest.mark.parametrize("width", [WIDE, NARROW])
def test_the_page_opens_alone_and_fits_the_window(browser, report, width):
    with opened(browser, report, width) as seen:
        assert seen.errors == []
        assert seen.requests == [report.as_uri()]
        assert width_of(seen.page) <= width
        assert seen.page.evaluate(BEYOND) == []


@pytest.mark.parametrize("width", [WIDE, NARROW])
def test_every_loop_has_one_chart_at_every_width(browser, report, width):
    with opened(browser, report, width) as seen:
        boxes = [chart.bounding_box() for chart in seen.page.query_selector_all(".run figure.chart")]
        assert len(boxes) == len(LOOPS)
        assert all(box["width"] > width / 2 and box["height"] > 100 for box in boxes)
        panel = seen.page.locator(".panel svg").first.bounding_box()
        assert panel["height"] > 100
        assert panel["width"] > width / 2
        size = "e => parseFloat(getComputedStyle(e).fontSize)"
        assert seen.page.locator(".times .x").first.evaluate(size) >= 12, "letters keep their size"


def test_no_word_is_broken_on_a_telephone(browser, report):
    with opened(browser, report, NARROW) as seen:
        broken = """() => [...document.querySelectorAll('.settings td, .settings code, dt, dd, .tag, h1, h2, h3')]
            .filter(e => e.getClientRects().length && e.children.length === 0)
            .flatMap(e => { const node = e.firstChild; if (!node || node.nodeType !== 3) return [];
              return [...node.data.matchAll(/[A-Za-z]{3,}/g)].filter(m => { const r = document.createRange();
                r.setStart(node, m.index); r.setEnd(node, m.index + m[0].length);
                return new Set([...r.getClientRects()].map(q => Math.round(q.top))).size > 1; }).map(m => m[0]); })"""
        assert seen.page.evaluate(broken) == []


def test_the_page_can_be_read_without_seeing_it(browser, report):
    with opened(browser, report) as seen:
        page = seen.page
        assert page.evaluate("document.documentElement.lang") == "en"
        levels = page.evaluate("[...document.querySelectorAll('h1,h2,h3,h4,h5,h6')].map(h => +h.tagName[1])")
        assert levels[0] == 1
        assert levels.count(1) == 1
        assert all(below - above <= 1 for above, below in pairwise(levels))
        assert page.evaluate("document.querySelectorAll('th:not([scope])').length") == 0
        assert page.evaluate("[...document.querySelectorAll('table')].filter(t => !t.caption).length") == 0
        broken = "[...document.querySelectorAll('a')].filter(a => !document.getElementById(a.hash.slice(1))).length"
        assert page.evaluate(broken) == 0
        assert page.evaluate("[...document.querySelectorAll('[id]')].length") == page.evaluate(
            "new Set([...document.querySelectorAll('[id]')].map(e => e.id)).size"
        )
        assert page.evaluate("document.querySelectorAll('script').length") == 1


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_every_text_stands_out_from_what_is_behind_it(browser, report, scheme):
    with opened(browser, report, scheme=scheme) as seen:
        assert seen.page.evaluate(CONTRAST) == []


def test_printed_it_is_a_document_on_a4(browser, report):
    with opened(browser, report) as seen:
        pdf = pytest.importorskip("pypdf").PdfReader(io.BytesIO(seen.page.pdf(prefer_css_page_size=True)))
    sizes = {(round(float(page.mediabox.width)), round(float(page.mediabox.height))) for page in pdf.pages}
    assert all(abs(w - A4[0]) < 1 and abs(h - A4[1]) < 1 for w, h in sizes)
    texts = [re.sub(r"\s+", " ", page.extract_text()) for page in pdf.pages]
    assert len(texts) <= 2 * len(SCENARIOS) + len(LOOPS) + 7
    for number, text in enumerate(texts, start=1):
        assert f"Page {number} of {len(texts)}" in text
        assert "Works 7" in text
        assert "PID-0042" in text
    for loop in LOOPS:
        (sheet,) = [text for text in texts if f"Loop {loop} " in text]
        assert sum(f"Commissioning of {name} " in sheet for name in LOOPS) == 1
        assert f"Commissioning of {loop} " in sheet, "the sheet ends on the page on which it begins"


def test_nothing_is_cut_off_on_paper(browser, report):
    with opened(browser, report, PRINTABLE) as seen:
        seen.page.emulate_media(media="print")
        assert width_of(seen.page) <= PRINTABLE
        beyond = BEYOND.replace("!e.closest('.scroll') && ", "")
        assert seen.page.evaluate(beyond) == []


@pytest.mark.parametrize("width", [WIDE, NARROW])
def test_hostile_texts_are_shown_as_they_are(browser, hostile, width):
    with opened(browser, hostile, width) as seen:
        page = seen.page
        assert seen.errors == []
        assert seen.requests == [hostile.as_uri()]
        assert page.evaluate("typeof window.pwned") == "undefined"
        assert page.evaluate("document.querySelectorAll('img, b b, script[src]').length") == 0
        assert page.evaluate("document.querySelectorAll('script').length") == 1
        text = page.inner_text("body")
        for shown in (
            "<script>window.pwned = 1</script>",
            "مضخة-7",
            "🔥",
            "{{ 7 * 7 }}",
            "<b>bold</b>",
            "onerror=",
            "W" * 400,
            "</td><script>",
            PROJECT,
        ):
            assert shown in text, shown
        assert width_of(page) <= width


def test_a_hostile_project_is_printed_as_it_is(browser, hostile):
    with opened(browser, hostile, PRINTABLE) as seen:
        pdf = pytest.importorskip("pypdf").PdfReader(io.BytesIO(seen.page.pdf(prefer_css_page_size=True)))
        seen.page.emulate_media(media="print")
        assert width_of(seen.page) <= PRINTABLE
    assert "</style><script>window.pwned=1</script>\\" in pdf.pages[1].extract_text()


@pytest.mark.parametrize(
    ("standing", "holds", "word"),
    [
        (("NOT PROVEN",), True, "NOT PROVEN"),
        (("NOT PROVEN", "FAILED"), True, "FAILED"),
        (("NOT PROVEN",), False, "FAILED"),
        ((), True, "FAILED"),
    ],
)
def test_a_run_in_which_nothing_failed_is_not_proven_and_no_failure(standing, holds, word):
    rows = tuple(StandingRow("L", "not-settled", verdict, None, "") for verdict in standing)
    written = (Expectation("L.PV at most 9", holds, "8"),)
    run = RunSheet("s", "c", "t", has_run=True, passed=False, verdict="", standing=rows, expectations=written)
    assert run.verdict_word == word
    assert replace(run, passed=True).verdict_word == "passed"
