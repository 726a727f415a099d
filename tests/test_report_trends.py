"""The trends of a page: levels of alarms and limits, zoom, cursor, and what no name may do to them."""

from __future__ import annotations

import re
from dataclasses import replace
from fractions import Fraction
from html.parser import HTMLParser
from itertools import pairwise
from math import isnan, nan
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from browser import opened
from pidcfg.cli.inputs import RECORDED_DISK
from pidcfg.pictures import Bar, Chart, Line, Mark, Panel, Strip, page
from pidcfg.pictures.layout import axis_limits, level_names, ticks
from pidcfg.pictures.page import SQUARE_SIZE, line_points, render_figure
from pidcfg.sim.engine.run import Settings
from pidcfg.sim.judgement.report import FLAG_WORDS, LOWER_FLAGS, UPPER_FLAGS, flag_words
from pidcfg.study.outcome import charts_of, level_lines, levels_around, simulate_document
from pidcfg.text.source import read_document
from pidcfg.vendors import VENDORS

EXAMPLES = Path(__file__).parents[1] / "examples"
HOSTILE = "a<b>&\"c'</svg></script><script>window.pwned=1</script> onload=x\x07"
NO_LEVEL = {"PV rate of change"}
"""Alarms that have no place beside a PV."""


def outcome(name, change=("", "")):
    """A run of an example, recorded for its trend; ``change``: a text of the scenario and what stands for it."""
    path = EXAMPLES / f"{name}.scenario.yaml"
    text = path.read_text("utf-8").replace(*change) if change[0] else path.read_text("utf-8")
    return simulate_document(read_document(text.encode(), str(path)), Settings(), RECORDED_DISK, record=True)


def levels(chart, panel=0):
    """The levels of a panel: names, and values by times."""
    rows = {}
    for line in chart.panels[panel].lines:
        if line.role == "level":
            rows.setdefault(line.name, []).append(list(zip(line.times, line.values, strict=True)))
    return rows


def bars(chart, kind):
    """The rows of one kind."""
    return {strip.title for strip in chart.strips if strip.kind == kind}


class Elements(HTMLParser):
    """Elements with their attributes, and the texts."""

    def __init__(self, text):
        super().__init__()
        self.elements, self.texts = [], []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))

    def handle_data(self, data):
        self.texts.append(data)

    def of(self, name):
        """The attributes of all elements of a class."""
        return [attrs for _, attrs in self.elements if name in (attrs.get("class") or "").split()]


# --- levels ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["dl06/oven", "dl06/extruder", "click/tank", "generic/boiler"])
def test_every_alarm_with_a_bar_has_its_level_in_the_trend(name):
    charts = charts_of(outcome(name))
    assert any(bars(chart, "alarm") for chart in charts)
    for chart in charts:
        assert bars(chart, "alarm") - NO_LEVEL == set(levels(chart))


def test_a_level_is_where_the_configuration_has_it():
    (chart,) = charts_of(outcome("click/tank"))
    assert levels(chart)["PV low"] == [[(0.0, 62.0), (2400.0, 62.0)]]
    assert levels(chart)["deviation high"] == [[(0.0, 225.0), (2400.0, 225.0)], [(0.0, 55.0), (2400.0, 55.0)]]


def test_a_word_of_a_dl06_is_a_level_in_the_unit_of_the_pv():
    (chart,) = charts_of(outcome("dl06/oven"))
    ((begin, end),) = levels(chart)["PV high"]
    assert (begin[0], end[0]) == (0.0, chart.end)
    assert begin[1] == end[1] == pytest.approx(960, abs=1200 / 32767)


def test_a_bipolar_format_has_its_level_at_its_place(tmp_path):
    alarms = "    alarms: {pv: {low_low: -58, low: -55, high: 50, high_high: 58}, hysteresis: 1}\n"
    text = (EXAMPLES / "dl06/extruder.yaml").read_text("utf-8")
    (tmp_path / "extruder.yaml").write_text(f"{text.rstrip()}\n{alarms}", "utf-8")
    scenario = (EXAMPLES / "dl06/extruder.scenario.yaml").read_text("utf-8")
    path = tmp_path / "extruder.scenario.yaml"
    doc = read_document(scenario.replace("duration: 40 min", "duration: 20").encode(), str(path))
    done = simulate_document(doc, Settings(), RECORDED_DISK, record=True)
    assert done.report is not None, done.findings
    found = {name: rows[0][1] for (loop, name), rows in done.recording.levels.items() if loop == "SIC-HAUL"}
    assert found["pv_high"] == pytest.approx(50, abs=0.1)
    assert found["pv_low"] == pytest.approx(-55, abs=0.1)
    assert found["output high"] == pytest.approx(100, abs=0.1)
    assert isnan(found["deviation_red"]), "an alarm that is off has no level"


def test_the_levels_of_a_deviation_follow_the_set_point():
    charts = {chart.loop: chart for chart in charts_of(outcome("dl06/reactor"))}
    above, below = levels(charts["TIC-101"])["deviation yellow"]
    setpoint = {line.name: line for line in charts["TIC-101"].panels[0].lines}["SP"]
    at = dict(zip(setpoint.times, setpoint.values, strict=True))
    assert len({round(value, 3) for _, value in above}) > 1
    for (time, high), (same, low) in zip(above, below, strict=True):
        assert time == same
        assert (high + low) / 2 == pytest.approx(at[time] if time in at else setpoint.values[-1])
        assert (high - low) / 2 == pytest.approx(5, abs=0.05)


def test_a_level_moves_when_an_event_writes_it():
    event = "  - {at: 100, loop: TANK1, set: {alarms.pv.low: 70}}\n"
    (chart,) = charts_of(outcome("click/tank", ("events:\n", f"events:\n{event}")))
    assert levels(chart)["PV low"] == [[(0.0, 62.0), (100.0, 70.0), (2400.0, 70.0)]]


@pytest.mark.parametrize(
    ("name", "loop", "title", "value"),
    [
        ("generic/boiler", "TIC-1", "upper limit", 36),
        ("generic/boiler", "TIC-1", "lower limit", 4),
        ("nextopid/cascade", "TIC_2", "upper limit", 80),
        ("dpide/dyeing", "VAT", "upper limit", 100),
    ],
)
def test_a_limited_output_has_its_limit_in_the_trend(name, loop, title, value):
    chart = next(chart for chart in charts_of(outcome(name)) if chart.loop == loop)
    assert {at for rows in levels(chart, 1)[title] for _, at in rows} == {value}


def test_an_output_that_is_not_limited_has_no_limit_in_the_trend():
    assert not levels(charts_of(outcome("dl06/extruder"))[0], 1)


def test_an_alarm_that_is_off_has_a_gap():
    assert [(line.times, line.values) for line in level_lines("x", [(0.0, 5.0), (3.0, nan), (7.0, 6.0)], 9.0)] == [
        ([0.0, 3.0], [5.0, 5.0]),
        ([7.0, 9.0], [6.0, 6.0]),
    ]
    assert not list(level_lines("x", [(0.0, nan)], 9.0))


def test_a_distance_goes_with_its_centre_and_with_itself():
    assert levels_around([(0.0, 10.0), (2.0, 20.0)], [(0.0, 1.0), (4.0, 3.0)], -1.0) == [
        (0.0, 9.0),
        (2.0, 19.0),
        (4.0, 17.0),
    ]


@pytest.mark.parametrize("vendor", ["dl06", "click", "ezlogix", "generic", "nextopid", "dpide"])
def test_every_alarm_and_flag_has_a_name_in_words(vendor):
    plc = VENDORS[vendor].load("controller")
    names = [*plc.alarm_bits, *plc.flag_bits, *plc.aux_bits]
    assert names
    for name in names:
        assert "_" not in flag_words(name) or "." in name or "SP_CASC" in name
        assert name in FLAG_WORDS or name.startswith("ErrBits.") or flag_words(name) == name.replace("_", " ")


def test_names_that_nobody_lists_stay_readable():
    assert flag_words("pv_high_high") == "PV high-high"
    assert flag_words("some_flag") == "some flag"
    assert flag_words("ErrBits.Kp") == "ErrBits.Kp"
    assert FLAG_WORDS.keys() >= UPPER_FLAGS | LOWER_FLAGS


def test_a_far_level_does_not_flatten_the_signal():
    def panel(level):
        line = Line("PV", "pv", [0, 1], [50, 60])
        return Panel("PV", "", (line, Line("PV high", "level", [0, 1], [level, level])))

    assert axis_limits(panel(1000))[1] < 62
    assert axis_limits(panel(61))[1] > 61
    assert level_names(panel(1000)) == []
    assert level_names(panel(61)) == [(61, "PV high")]


def test_ticks_are_round_numbers_within_the_axis():
    assert ticks(0.0, 100.0, 5) == [0, 20, 40, 60, 80, 100]
    assert ticks(-0.3, 1.1, 5) == pytest.approx([0, 0.5, 1.0])
    assert ticks(169.2, 174.8, 5) == [170, 172, 174]


# --- the drawing -----------------------------------------------------------------------------------------------------


def drawn(**changes):
    """A chart with one of everything."""
    values = {
        "title": "TIC-1: Oven",
        "loop": "TIC-1",
        "panels": (
            Panel(
                "PV, SP",
                "degC",
                (
                    Line("SP", "setpoint", [0, 40, 100], [50, 70, 70]),
                    Line("PV", "pv", [0, 50, 100], [50, 50, 70]),
                    Line("PV high", "level", [0, 100], [68, 68]),
                ),
            ),
            Panel("OUT", "%", (Line("OUT", "output", [0, 100], [20, 40]),), (0, 100)),
        ),
        "strips": (
            Strip("mode", (Bar("manual", 0, 25), Bar("auto", 25, 100)), "mode"),
            Strip("PV high", (Bar("PV high", 95, 100),), "alarm"),
        ),
        "marks": (Mark("set point 70", 40), Mark("too slow", 80, "failure")),
        "begin": 0,
        "end": 100,
        "notes": ("failed: overshoot",),
    }
    return Chart(**{**values, **changes})


def test_a_drawing_has_lines_levels_bars_and_marks_at_their_places():
    found = Elements(render_figure(drawn()))
    lines = {attrs["data-name"]: attrs for attrs in found.of("line")}
    assert list(lines) == ["PV high", "PV", "SP", "OUT"]
    assert lines["PV high"]["class"] == "line level only"
    high = round((71.2 - 68) / (71.2 - 48.8) * SQUARE_SIZE)
    assert lines["PV high"]["points"] == f"0,{high} {SQUARE_SIZE},{high}"
    assert [attrs["data-at"] for attrs in found.of("mark")] == ["40000", "80000"]
    assert [attrs["class"] for attrs in found.of("mark")] == ["mark event", "mark failure"]
    assert [(a["class"], a["data-from"], a["data-to"]) for a in found.of("bar")] == [
        ("bar mode manual", "0", "25000"),
        ("bar mode auto", "25000", "100000"),
        ("bar alarm a", "95000", "100000"),
    ]
    assert found.of("bar")[1]["style"] == "left:25%;width:75%"
    texts = [text.strip() for text in found.texts if text.strip()]
    assert {"PV, SP (degC)", "OUT (%)", "time (s)", "manual", "auto", "1", "2", "failed: overshoot"} <= {*texts}
    assert "1 at 40 s: set point 70" in texts
    assert "2 at 80 s: failed: too slow" in texts
    assert texts.count("PV high") == 2, "above its level and beside its row, not in the bar"


DOWN = SQUARE_SIZE, 0.0
"""Ends of a panel in which a value is its own place."""


def test_a_held_value_changes_at_once_and_a_pv_moves():
    (setpoint, pv, _), chart = drawn().panels[0].lines, drawn()

    assert line_points(chart, setpoint, *DOWN) == [(0, 50), (40_000, 50), (40_000, 70), (100_000, 70)]
    assert line_points(chart, pv, *DOWN) == [(0, 50), (50_000, 50), (100_000, 70)]


def test_values_that_change_nothing_are_left_out():
    chart = drawn()
    line = Line("PV", "pv", list(range(101)), [5.0] * 100 + [6.0])
    assert line_points(chart, line, *DOWN) == [(0, 5), (99_000, 5), (100_000, 6)]


@given(st.lists(st.tuples(st.integers(0, 3), st.integers(0, 2)), min_size=1), st.sampled_from(["setpoint", "pv"]))
def test_the_points_draw_the_whole_line_and_no_corner_twice(moves, role):
    times = [sum(step for step, _ in moves[: i + 1]) for i in range(len(moves))]
    line = Line("x", role, times, [float(value) for _, value in moves])
    chart = replace(drawn(), begin=0, end=SQUARE_SIZE)
    wanted = []
    for x, (_, y) in zip(times, moves, strict=True):
        if wanted and role == "setpoint" and wanted[-1][1] != y:
            wanted.append((x, wanted[-1][1]))
        wanted.append((x, y))
    corners = line_points(chart, line, *DOWN)
    assert corners[0] == wanted[0]
    assert corners[-1] == wanted[-1]
    assert all(a != b for a, b in pairwise(corners))
    assert all(not a[1] == b[1] == c[1] for a, b, c in zip(corners, corners[1:], corners[2:], strict=False))
    assert course(corners) == course(wanted)


def course(corners):
    """What a line covers: its vertical pieces, and its places at each time."""
    covered = {corners[0]}
    for (x0, y0), (x1, y1) in pairwise(corners):
        if x0 == x1:
            covered |= {(x0, y) for y in range(min(y0, y1), max(y0, y1) + 1)}
        else:
            covered |= {(x, y0 + Fraction(y1 - y0, x1 - x0) * (x - x0)) for x in range(x0, x1 + 1)}
    return covered


def test_both_sides_of_an_overlay_are_named():
    line = Line("PV", "pv", [0, 1], [1, 2], "before")
    chart = Chart("x", "x", (Panel("PV", "", (line, Line("PV", "pv", [0, 1], [1, 3], "after"))),), sides=("old", "new"))
    found = Elements(render_figure(chart))
    assert [attrs["class"] for attrs in found.of("line")] == ["line pv after", "line pv before"]
    assert {"old", "new"} <= {*found.texts}


def test_no_name_escapes_from_a_drawing():
    one = drawn(
        title=HOSTILE,
        panels=(
            Panel(HOSTILE, HOSTILE, (Line(HOSTILE, "pv", [0, 1], [1, 2]), Line(HOSTILE, "level", [0, 1], [1, 1]))),
        ),
        strips=(Strip(HOSTILE, (Bar(HOSTILE, 0, 1), Bar("x" + HOSTILE, 0, 1)), "mode"),),
        marks=(Mark(HOSTILE, 0),),
        notes=(HOSTILE,),
        sides=(HOSTILE, HOSTILE),
    )
    text = page.render_page([one], title=HOSTILE, intro=[HOSTILE])
    found = Elements(text)
    assert [tag for tag, _ in found.elements].count("script") == 1
    assert not [key for _, attrs in found.elements for key in attrs if key.startswith("on")]
    assert "\x07" not in text
    assert sum("onload=x" in words for words in found.texts) >= 8


# --- the script ------------------------------------------------------------------------------------------------------


def trend_page(folder, **changes):
    """A page with one chart."""
    path = folder / "trend.html"
    path.write_text(page.render_page([drawn(**changes)], title="Run"), "utf-8")
    return path


def seen_times(page_seen):
    """The numbers of the time axis."""
    return [float(text) for text in page_seen.locator(".times .x").all_inner_texts()]


def test_the_keyboard_moves_the_cursor_and_zooms(browser, tmp_path):
    with opened(browser, trend_page(tmp_path)) as seen:
        seen.page.focus(".area")
        seen.page.keyboard.press("Home")
        for _ in range(5):
            seen.page.keyboard.press("Shift+ArrowRight")
        words = seen.page.inner_text("output")
        assert re.search(r"50\.\d s", words)
        assert re.search(r"PV 50\.\d+ degC", words)
        assert re.search(r"SP 70\.\d+ degC", words)
        assert "OUT 20.0 %" in words
        assert "mode: auto" in words
        assert "PV high" not in words
        assert seen_times(seen.page)[-1] == 100
        seen.page.keyboard.press("+")
        assert seen_times(seen.page)[0] >= 25
        assert seen_times(seen.page)[-1] <= 75
        assert seen.page.locator(".over .event").is_visible()
        assert not seen.page.locator(".over .failure").is_visible()
        seen.page.keyboard.press("End")
        assert re.search(r"75\.\d+ s", seen.page.inner_text("output"))
        assert re.search(r"PV (59\.9|60\.0)\d* degC", seen.page.inner_text("output")), "between two values"
        seen.page.keyboard.press("Escape")
        seen.page.keyboard.press("End")
        seen.page.keyboard.press("ArrowRight")
        assert "100.0 s" in seen.page.inner_text("output"), "no further than the end"
        assert (seen_times(seen.page)[0], seen_times(seen.page)[-1]) == (0, 100)
        assert seen.errors == []
        assert len(seen.requests) == 1


def test_the_mouse_chooses_a_time_and_buttons_go_back(browser, tmp_path):
    with opened(browser, trend_page(tmp_path)) as seen:
        box = seen.page.locator(".through").bounding_box()
        y = box["y"] + 20
        seen.page.mouse.move(box["x"] + 0.2 * box["width"], y)
        seen.page.mouse.down()
        seen.page.mouse.move(box["x"] + 0.4 * box["width"], y)
        seen.page.mouse.up()
        times = seen_times(seen.page)
        assert times[0] >= 19
        assert times[-1] <= 41
        seen.page.get_by_role("button", name="Whole run").click()
        assert seen_times(seen.page)[-1] == 100
        seen.page.get_by_role("button", name="Zoom in").click()
        assert seen_times(seen.page)[-1] < 80


def test_without_scripts_the_picture_stands(browser, tmp_path):
    context = browser.new_context(java_script_enabled=False)
    try:
        shown = context.new_page()
        shown.goto(trend_page(tmp_path).as_uri())
        assert shown.locator("button").count() == 0
        heights = [panel.bounding_box()["height"] for panel in shown.locator(".panel svg").all()]
        assert len(heights) == 2
        assert min(heights) > 50
        assert shown.locator(".times .x").count() > 3
    finally:
        context.close()


def test_a_hostile_name_runs_nothing(browser, tmp_path):
    path = trend_page(tmp_path, title=HOSTILE, strips=(Strip(HOSTILE, (Bar(HOSTILE, 0, 100),), "mode"),))
    with opened(browser, path) as seen:
        seen.page.focus(".area")
        seen.page.keyboard.press("Home")
        assert seen.page.evaluate("typeof window.pwned") == "undefined"
        assert "a<b>&" in seen.page.inner_text("output"), "as a text, not as HTML"
        assert seen.errors == []
