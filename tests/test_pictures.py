"""Charts as data drawn as SVG, PNG, a page and characters: read back by XML and HTML parsers, Pillow and the eye."""

from __future__ import annotations

import base64
import hashlib
import io
import re
from html.parser import HTMLParser
from itertools import pairwise
from math import inf, nan, sin
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from pidcfg.pictures import Band, Bar, Chart, Line, Mark, Panel, Strip, page
from pidcfg.pictures import figure as draw
from pidcfg.pictures.characters import can_encode_signs, draw_rows
from pidcfg.pictures.figure import draw_png
from pidcfg.pictures.layout import group_numbers, plain_text, shorten, spread_apart, time_text

SVG = "{http://www.w3.org/2000/svg}"
TAGS = {"svg", "title", "desc", "defs", "clipPath", "path", "text"}
"""All that an SVG of ours is made of."""
GOLDEN = Path(__file__).parent / "data" / "pictures"
HOSTILE = "a<b>&\"c'</svg><script>alert(1)</script> $x^2$ \\frac ${7*7}"
TIMES = tuple(2.0 * i for i in range(601))


def chart(name="TIC-101", **changes):
    """A loop with everything that a chart can show."""
    values = {
        "title": f"{name}: Reactor",
        "loop": name,
        "panels": (
            Panel(
                "PV, SP",
                "degC",
                (
                    Line("SP", "setpoint", TIMES, [60.0 if t < 100 else 85.0 for t in TIMES]),
                    Line("PV", "pv", TIMES, [70 + 15 * sin(t / 150) for t in TIMES]),
                ),
            ),
            Panel("OUT", "%", (Line("OUT", "output", TIMES, [50 + 20 * sin(t / 90) for t in TIMES]),), (0, 100)),
        ),
        "strips": (
            Strip("mode", (Bar("manual", 0, 300), Bar("auto", 300, 1200)), "mode"),
            Strip("pv_high", (Bar("pv_high", 200, 330), Bar("pv_high", 900, 900)), "alarm"),
            Strip("ramp/soak", (Bar("1 ramp", 300, 600), Bar("2 soak", 600, 1000)), "step"),
        ),
        "marks": (Mark("set setpoint to 85", 100), Mark("PV is 80 at 700 s", 700, "failure")),
        "notes": ("failed: overshoot at most 5 % (12.3)",),
    }
    return Chart(**{**values, **changes})


def overlay():
    """Two runs in one chart."""
    both = [
        Line("PV", "pv", TIMES, [70 + 15 * sin(t / d) for t in TIMES], side)
        for d, side in ((150, "before"), (140, "after"))
    ]
    sp = Line("SP", "setpoint", TIMES, [80.0] * len(TIMES))
    return Chart("TIC", "TIC", (Panel("PV, SP", "degC", (sp, *both)),), sides=("old.yaml (dl06)", "new.yaml (click)"))


def tree(svg):
    """An SVG as elements."""
    return ET.fromstring(svg)  # noqa: S314 - our own


def texts(svg):
    """What an SVG says, in order."""
    return [element.text for element in tree(svg).iter(f"{SVG}text")]


def classes(svg, first):
    """The classes of an SVG's parts of one kind."""
    found = [element.get("class", "") for element in tree(svg).iter()]
    return [name for name in found if name.split(" ")[0] == first]


# --- SVG -------------------------------------------------------------------------------------------------------------


def test_an_svg_says_what_its_axes_lines_and_bars_are():
    svg = draw.draw_svg([chart()], title="Reactor 2")
    said = texts(svg)
    assert {"Reactor 2", "TIC-101: Reactor", "PV, SP (degC)", "OUT (%)", "time (min)", "SP", "PV", "OUT", "mode"} <= {
        *said
    }
    assert {"manual", "auto", "pv_high", "1 ramp", "2 soak", "ramp/soak"} <= {*said}
    assert "1 at 1.667 min: set setpoint to 85" in said
    assert "2 at 11.67 min: failed: PV is 80 at 700 s" in said
    assert "failed: overshoot at most 5 % (12.3)" in said


def test_an_svg_has_one_line_a_signal_and_one_bar_a_span():
    svg = draw.draw_svg([chart(), chart("LIC-1")], title="two")
    assert classes(svg, "line") == ["line pv only", "line setpoint only", "line output only"] * 2
    assert classes(svg, "bar") == 2 * (["bar mode"] * 2 + ["bar alarm"] * 2 + ["bar step"] * 2)
    assert sorted(classes(svg, "mark")) == ["mark event"] * 6 + ["mark failure"] * 6


def test_an_overlay_has_both_sides_named_before_thin_dashed_after_thick_solid():
    svg = draw.draw_svg([overlay()], title="both")
    assert {"before: old.yaml (dl06)", "after: new.yaml (click)"} <= {*texts(svg)}
    lines = {name: path for path in tree(svg).iter(f"{SVG}path") if (name := path.get("class", "")).startswith("line")}
    assert set(lines) == {"line pv before", "line pv after", "line setpoint only"}
    before, after = (lines[f"line pv {side}"] for side in ("before", "after"))
    assert float(before.get("stroke-width")) < float(after.get("stroke-width"))
    assert before.get("stroke-dasharray")
    assert not after.get("stroke-dasharray")


def test_lines_bands_bars_and_marks_stand_where_their_axes_say():
    panel = Panel("PV", "", (Line("PV", "pv", [0, 60], [5, 5]),), (0, 10), (Band("pv", [0, 60], [0, 0], [10, 10]),))
    strips, marks = (Strip("mode", (Bar("auto", 10, 50),), "mode"),), (Mark("a", 30),)
    root = tree(draw.draw_svg([Chart("x", "x", (panel,), strips, marks)], title="x"))
    across, up = {}, {}
    for text in root.iter(f"{SVG}text"):
        if text.get("class") == "tick":
            if text.get("text-anchor") == "middle":
                across[text.text] = float(text.get("x"))
            else:
                up[text.text] = round(float(text.get("y")) - draw.BASELINE_DROP * float(text.get("font-size")), 1)

    def corners(name):
        path = next(path for path in root.iter(f"{SVG}path") if path.get("class") == name)
        pairs = [pair.split(",") for pair in path.get("d").strip("MZ").split()]
        return {float(x) for x, _ in pairs}, {round(float(y), 1) for _, y in pairs}

    left, right = across["0"], across["60"]
    assert corners("line pv only") == ({left, right}, {up["5"]})
    assert corners("band") == ({left, right}, {up["0"], up["10"]})
    assert corners("bar mode")[0] == {across["10"], across["50"]}
    assert corners("mark event")[0] == {across["30"]}


def test_a_band_is_seen_in_every_kind_of_picture():
    bands = tuple(Band("pv", TIMES, [0] * 601, [4 + 4 * i] * 601) for i in range(2))
    one = Chart("x", "x", (Panel("PV", "", (Line("PV", "pv", TIMES, [1] * 601),), None, bands),))
    assert classes(draw.draw_svg([one], title="x"), "band") == ["band", "band"]
    assert [a["class"] for tag, a in Reader(page.render_page([one], title="x")).found if tag == "polygon"] == [
        "band pv"
    ] * 2
    picture = pytest.importorskip("PIL.Image").open(io.BytesIO(draw_png([one], title="x"))).convert("RGB")
    assert {(209, 229, 241), (171, 208, 229)} <= {colour for _, colour in picture.getcolors(maxcolors=1 << 20)}


def test_an_svg_is_an_image_with_a_title_and_a_description():
    root = tree(draw.draw_svg([chart()], title="Reactor 2"))
    assert root.get("role") == "img"
    by_id = {element.get("id"): element for element in root.iter() if element.get("id")}
    title, description = (by_id[name] for name in root.get("aria-labelledby").split())
    assert title.text == "Reactor 2"
    assert "PV, SP (degC): SP between 60 and 85, at the end 85" in description.text
    assert "pv_high from 3.333 min to 5.5 min" in description.text
    assert not [element for element in root.iter() if element.tag.endswith("metadata")]


def test_drawings_share_no_identifier_and_refer_to_their_own():
    one, two = draw.draw_svg([chart()], title="one"), draw.draw_svg([chart()], title="two")
    ids = [set(re.findall(r' id="([^"]*)"', svg)) for svg in (one, two)]
    assert ids[0]
    assert not ids[0] & ids[1]
    assert set(re.findall(r'url\(#([^)]*)\)|href="#([^"]*)"', one)) <= {(i, "") for i in ids[0]} | {
        ("", i) for i in ids[0]
    }


@pytest.mark.parametrize("form", ["svg", "png", "html"])
def test_the_same_charts_give_the_same_bytes_whatever_the_user_has_set(form):
    mpl = pytest.importorskip("matplotlib")

    def made():
        charts = [chart(), overlay()]
        return {"svg": draw.draw_svg, "png": draw_png, "html": page.render_page}[form](charts, title="Reactor")

    first = made()
    with mpl.rc_context({"font.size": 30, "axes.grid": True, "lines.linewidth": 9, "svg.fonttype": "path"}):
        assert made() == first
    text = first if isinstance(first, str) else first.decode("latin-1")
    assert mpl.__version__ not in text
    assert not re.search(r"20\d\d-\d\d-\d\d", text)


def test_painting_leaves_the_settings_of_the_library_alone():
    mpl = pytest.importorskip("matplotlib")

    before = dict(mpl.rcParams)
    draw_png([chart()], title="x")
    assert dict(mpl.rcParams) == before


@pytest.mark.parametrize(
    "hostile", [HOSTILE, "$\\undefined{$", "名前 温度 🔥", "x" * 500, "a\x00\x1b[2J\nb", "\u202eabc", "_hidden"]
)
def test_no_name_or_unit_breaks_a_picture(hostile):
    one = chart(
        hostile,
        title=hostile,
        panels=(Panel(hostile, hostile, (Line(hostile, "pv", TIMES, TIMES),)),),
        strips=(Strip(hostile, (Bar(hostile, 0, 1200),), "mode"),),
        marks=(Mark(hostile, 5),),
        notes=(hostile,),
        sides=(hostile, hostile),
    )
    svg = draw.draw_svg([one], title=hostile)
    said = texts(svg)
    assert tree(svg)[0].text == plain_text(hostile)
    beginning = plain_text(hostile)[:3]
    assert sum(text.removeprefix("1 at 5 s: ").startswith(beginning) for text in said) >= 5
    assert not list(tree(svg).iter(f"{SVG}script"))
    assert {element.tag for element in tree(svg).iter()} <= {SVG + tag for tag in TAGS}
    pytest.importorskip("PIL.Image").open(io.BytesIO(draw_png([one], title=hostile))).verify()
    found = Reader(page.render_page([one], title=hostile))
    assert [tag for tag, _ in found.found].count("script") == 1
    assert not {"b>", "alert"} & {tag for tag, _ in found.found}
    assert not [key for _, attributes in found.found for key in attributes if key.startswith("on")]
    for row in draw_rows(one, 80, 8, ascii_only=True):
        assert row.isascii()
        assert row.isprintable()
        assert len(row) <= 80


def test_letters_of_formulas_are_not_interpreted():
    one = chart("$x^2$", title="$x^2$")
    assert "$x^2$" in texts(draw.draw_svg([one], title="y"))


# --- values ----------------------------------------------------------------------------------------------------------

ODD = {
    "flat": ([0.0, 1.0], [5.0, 5.0]),
    "flat at zero": ([0.0, 1.0], [0.0, 0.0]),
    "one sample": ([0.0], [7.0]),
    "none": ([], []),
    "nearly flat": ([0.0, 1.0], [1e6, 1e6 + 1e-9]),
    "large": ([0.0, 1.0], [-1e99, 1e99]),
    "not numbers": ([0.0, 1.0, 2.0, 3.0], [1.0, nan, inf, 2.0]),
    "small": ([0.0, 1e-6], [1e-12, 2e-12]),
    "months": ([0.0, 1e7], [0.0, 1.0]),
}


@pytest.mark.parametrize(("times", "values"), ODD.values(), ids=list(ODD))
def test_odd_values_are_drawn(times, values):
    one = Chart("x", "x", (Panel("PV", "degC", (Line("PV", "pv", times, values),)),))
    svg = draw.draw_svg([one], title="x")
    assert "nan" not in svg.replace("Segoe", "")
    assert " inf" not in svg
    assert {"PV (degC)", "x"} <= {*texts(svg)}
    assert classes(svg, "line") == (["line pv only"] if times else [])
    assert draw_rows(one, 60, 6, ascii_only=True)


def test_a_flat_line_stands_in_the_middle_of_an_axis_with_numbers():
    one = Chart("x", "x", (Panel("PV", "", (Line("PV", "pv", [0, 60], [5, 5]),)),))
    assert "5" in texts(draw.draw_svg([one], title="x"))


@pytest.mark.parametrize(
    ("end", "label", "shown"),
    [(60, "time (s)", "60 s"), (180, "time (s)", "180 s"), (3600, "time (min)", "60 min"), (90000, "time (h)", "25 h")],
)
def test_time_has_the_unit_that_suits_it(end, label, shown):
    one = Chart("x", "x", (Panel("PV", "", (Line("PV", "pv", [0, end], [1, 2]),)),))
    assert label in texts(draw.draw_svg([one], title="x"))
    assert time_text(one, end) == shown


def test_names_of_lines_do_not_cover_each_other():
    assert spread_apart([5.0, 30.0], 100, 10) == [5.0, 30.0]
    moved = spread_apart([50.0, 50.0, 51.0, 99.0, 99.5], 100, 10)
    assert all(b - a >= 9.999 for a, b in pairwise(moved))
    assert moved[-1] <= 100


def test_numbers_of_close_marks_are_one_text():
    marks = [(1.0, "1", False), (1.1, "2", False), (1.2, "3", True), (9.0, "4", False)]
    assert group_numbers(marks, 0.5) == [(1.0, "1-3", True), (9.0, "4", False)]


def test_of_many_events_the_first_are_explained_and_all_failures():
    marks = [Mark(f"event {i}", i) for i in range(30)] + [Mark("too hot", 25.5, "failure")]
    said = texts(draw.draw_svg([chart(marks=tuple(marks))], title="x"))
    assert "12 at 0.1833 min: event 11" in said
    assert not [text for text in said if "event 12" in text]
    assert "and 18 more events" in said
    assert "27 at 0.425 min: failed: too hot" in said
    assert "and 18 more events" in draw_rows(chart(marks=tuple(marks)), 80, 8, ascii_only=True)


def test_places_far_down_a_long_picture_are_as_fine_as_those_at_its_top():
    found = [
        float(y) for y in re.findall(r'class="loop" x="\S+" y="(\S+)"', draw.draw_svg([chart()] * 400, title="many"))
    ]
    distances = [below - above for above, below in pairwise(found)]
    assert found[-1] > 100_000
    assert max(distances) - min(distances) < 0.03


def test_long_texts_end_with_dots():
    assert shorten("temperature", 6) == "tempe…"
    assert shorten("level", 6) == "level"
    assert plain_text("a\tb\n c\x07") == "a b c�"


# --- PNG -------------------------------------------------------------------------------------------------------------


def test_a_png_shows_all_charts_at_equal_sizes():
    images, sizes = pytest.importorskip("PIL.Image"), []
    for count in (1, 2, 8):
        picture = images.open(io.BytesIO(draw_png([chart(f"TIC-{i}") for i in range(count)], title="x")))
        assert picture.format == "PNG"
        colours = {colour for _, colour in picture.convert("RGB").getcolors(maxcolors=1 << 20)}
        assert {(0, 0x72, 0xB2), (0, 0x7A, 0x5A), (255, 255, 255)} <= colours
        sizes.append(picture.size)
    assert {width for width, _ in sizes} == {1382}
    one, two, eight = (height for _, height in sizes)
    assert abs(eight - one - 7 * (two - one)) <= 4


# --- page ------------------------------------------------------------------------------------------------------------


class Reader(HTMLParser):
    """Elements and their attributes."""

    def __init__(self, text):
        super().__init__()
        self.found, self.words = [], []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.found.append((tag, dict(attrs)))

    def handle_data(self, data):
        self.words.append(data)


def test_a_page_needs_nothing_from_outside_and_says_so():
    text = page.render_page([chart(), overlay()], title="A <b> & c", intro=["x.yaml <i>"])
    found = Reader(text)
    tags = [tag for tag, _ in found.found]
    assert not {"link", "img", "iframe", "object"} & {*tags}
    assert tags.count("script") == 1
    for _, attributes in found.found:
        for key, value in attributes.items():
            if key in {"src", "href", "xlink:href", "action"}:
                assert value.startswith("#")
            assert not key.startswith("on")
            assert "url(http" not in (value or "")
    policy = next(a["content"] for tag, a in found.found if a.get("http-equiv") == "Content-Security-Policy")
    script = re.search("<script>(.*?)</script>", text, re.DOTALL).group(1)
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    assert policy.startswith(
        f"default-src 'none'; style-src 'unsafe-inline'; script-src 'sha256-{digest}'; img-src data:"
    )
    assert "A <b> & c" in found.words
    assert "x.yaml <i>" in found.words
    assert ("html", {"lang": "en"}) in found.found
    assert tags.count("svg") == 3, "one drawing a panel, for every width"
    ids = [attributes["id"] for _, attributes in found.found if "id" in attributes]
    assert len(ids) == len(set(ids))


# --- characters ------------------------------------------------------------------------------------------------------


def golden_files():
    """The committed pictures of characters by their paths."""
    return {
        GOLDEN / f"{name}-{signs}.txt": "".join(
            f"{row}\n" for row in draw_rows(picture, 79, 10, ascii_only=signs == "ascii")
        ).encode()
        for name, picture in (("loop", chart()), ("overlay", overlay()))
        for signs in ("ascii", "fine")
    }


@pytest.mark.parametrize(("path", "data"), golden_files().items(), ids=lambda value: getattr(value, "stem", ""))
def test_characters_are_those_that_somebody_looked_at(path, data):
    assert max(map(len, data.decode().splitlines())) <= 79
    assert path.read_bytes() == data


def test_a_spike_of_one_sample_is_seen_in_characters():
    values = [1.0] * 5000
    values[2501] = 9.0
    one = Chart("x", "x", (Panel("PV", "", (Line("PV", "pv", range(5000), values),)),))
    rows = draw_rows(one, 60, 8, ascii_only=True)
    assert sum("o" in row for row in rows) == 8 + 1  # all rows of the panel, and its legend


@pytest.mark.parametrize(
    ("encoding", "fine"),
    [
        ("utf-8", True),
        ("cp437", False),
        ("cp1252", False),
        ("ascii", False),
        (None, False),
        ("no-such-encoding", False),
    ],
)
def test_code_pages_without_the_finer_signs_get_plain_ones(encoding, fine):
    assert can_encode_signs(encoding) is fine
