"""A what-if page in Chromium, opened from a disk without a network: words, trend, snapping, stopping, and its looks.

`python tasks.py whatif-runtime` makes the Python that it carries; without it, or without a browser, the tests skip and
say so.
"""

from __future__ import annotations

import re
from contextlib import contextmanager
from html import unescape
from pathlib import Path

import pytest

import pidcfg
from browser import BEYOND, IN_CI, opened, width_of
from command import run_text
from pidcfg.output.browser.page import RUNTIME_FILE
from pidcfg.output.browser.session import Session
from test_whatif import EXAMPLES, ONE_A_VENDOR, files_of

ROOT = Path(__file__).parents[1]
RUNTIME = ROOT / "build" / "whatif" / RUNTIME_FILE
AXE = ROOT / "tests" / "node" / "node_modules" / "axe-core" / "axe.min.js"
PATIENCE = 120_000
"""ms: a loaded machine is no failure."""


def made(tmp_path, name, *options, **changes):
    """The page of an example; ``changes``: other texts for words of the scenario."""
    if not RUNTIME.is_file():
        told = f"no Python for the browser in {RUNTIME}: python tasks.py whatif-runtime makes it"
        (pytest.fail if IN_CI else pytest.skip)(told)
    folder = (EXAMPLES / name).parent
    for file, text in files_of(name).items():
        (tmp_path / file).write_text(text, "utf-8")
    scenario = tmp_path / f"{Path(name).name}.scenario.yaml"
    text = (folder / scenario.name).read_text("utf-8")
    for key, value in changes.items():
        text = re.sub(rf"(?m)^{key}:.*", f"{key}: {value}", text)
    scenario.write_text(text, "utf-8")
    done = run_text("whatif", str(scenario), "-o", str(tmp_path / "w.html"), "--runtime", str(RUNTIME), *options)
    assert done.returncode == 0, done.stderr
    return tmp_path / "w.html"


@contextmanager
def ready(browser, path, **look):
    """The page once Python has run the scenario as filed."""
    with opened(browser, path, **look) as seen:
        seen.page.context.set_offline(True)
        settle(seen.page)
        yield seen
    assert seen.errors == []
    assert {re.sub(r"[0-9a-f-]{36}", "", address) for address in seen.requests} <= {path.as_uri(), "blob:null/"}


def settle(page):
    """Waits until nothing runs."""
    page.wait_for_function("['idle', 'failed'].includes(document.body.dataset.state)", timeout=PATIENCE)
    assert page.evaluate("document.body.dataset.state") == "idle", page.inner_text("#status")


def rows(page, table):
    """The texts of a table's cells."""
    read = "rows => rows.map(row => [...row.cells].map(cell => cell.textContent))"
    return page.eval_on_selector_all(f"#{table} tr", read)


def test_words_and_the_trend_are_those_of_encode_and_simulate(browser, tmp_path):
    here = Session("flow.scenario.yaml", files_of("dl06/flow"))
    shown = here.describe()
    knob = next(one for one in shown["knobs"] if one["loop"] == shown["first"] and one["group"] == "number")
    place = knob["positions"].index(knob["value"]) + 3
    said = here.move({knob["id"]: knob["positions"][place]})
    with ready(browser, made(tmp_path, "dl06/flow")) as seen:
        page = seen.page
        assert page.input_value("#loop") == shown["first"]
        assert rows(page, "words") == []
        page.locator("input[type=range]").first.focus()
        for _ in range(3):
            page.keyboard.press("ArrowRight")
        settle(page)
        assert float(page.locator(".knob input[type=text]").first.input_value()) == knob["positions"][place]
        assert page.text_content("#yaml") == said["yaml"]
        gain = {cell.address: cell.hex for cell in pidcfg.encode(said["yaml"]).image.cells}["V10010"]
        assert rows(page, "words") == [["V10010", "FIC-301 gain", f"0060 → {gain}"]]
        picture = here.picture(shown["first"])
        told = unescape(re.search(r'<p class="said">(.*?)</p>', picture)[1])
        assert page.text_content("#picture .said") == told
        lines = page.eval_on_selector_all("#picture polyline", "all => all.map(one => one.getAttribute('points'))")
        assert lines == re.findall(r'points="(.*?)"', picture)
        for name in ONE_A_VENDOR[1:]:  # the same Python, other files
            same_in_the_browser(page, name)


def same_in_the_browser(page, name):
    """What the worker answers for the files of another vendor is what Python answers here."""
    given = {"scenario": f"{Path(name).name}.scenario.yaml", "files": files_of(name), "against": None}
    here = Session(given["scenario"], given["files"])
    shown = here.describe()
    knob = next(one for one in shown["knobs"] if one["group"] == "number")
    move = {"knobs": {knob["id"]: knob["positions"][-9]}, "loop": shown["first"]}
    begun = page.evaluate("given => call('begin', given)", given)
    assert {key: begun[key] for key in shown} == shown, name
    answer = page.evaluate("given => call('move', given)", move)
    said = {**here.move(move["knobs"]), "picture": here.picture(shown["first"])}
    assert said["words"], name
    assert {key: answer[key] for key in said} == said, name
    assert page.evaluate("call('margins', {})")["margins"] == here.margins(), name


def test_a_number_snaps_to_the_word_and_the_last_value_wins(browser, tmp_path):
    with ready(browser, made(tmp_path, "dl06/flow")) as seen:
        page = seen.page
        box, slider = page.locator(".knob input[type=text]").first, page.locator("input[type=range]").first
        for typed, held, word in (("0.7549", "0.75", "0060 → 0075"), ("1,2", "1.2", "0060 → 0120")):
            box.fill(typed)
            box.press("Enter")
            settle(page)
            assert (box.input_value(), rows(page, "words")[0][2]) == (held, word)
        box.fill("no number")
        box.press("Enter")
        assert box.input_value() == "1.2"
        box.press("ArrowUp")
        settle(page)
        assert rows(page, "words")[0][2] == "0060 → 0121"
        slider.focus()
        page.evaluate(  # as fast as no hand is
            """() => { const slider = document.querySelector("input[type=range]");
            for (let i = 0; i < 40; i += 1) { slider.value = i; slider.dispatchEvent(new Event("input")); } }"""
        )
        settle(page)
        last = page.evaluate("model.knobs.find((knob) => knob.group === 'number').positions[39]")
        assert float(box.input_value()) == last
        assert rows(page, "words")[0][2] == f"0060 → {round(last * 100):04}"
        page.click("#filed")
        settle(page)
        assert (rows(page, "words"), page.text_content("#no-words"), box.input_value()) == ([], "None.", "0.6")


def test_a_run_can_be_stopped(browser, tmp_path):
    with ready(browser, made(tmp_path, "dl06/flow", duration="1 h")) as seen:
        page = seen.page
        page.locator("input[type=range]").first.focus()
        drawn = page.inner_html("#picture .stack")
        page.keyboard.press("PageUp")
        page.wait_for_function("document.getElementById('share').value > 0", timeout=PATIENCE)
        page.keyboard.press("Escape")
        settle(page)
        assert "Stopped" in page.inner_text("#status")
        assert page.inner_html("#picture .stack") == drawn
        page.evaluate(
            "running = 99; mark('busy'); halted = true; restart().then(() => { running = 0; })"
        )  # as where Python cannot be halted
        page.wait_for_function("document.body.dataset.state === 'idle'", timeout=PATIENCE)
        assert "Python was started anew" in page.inner_text("#status")


def test_everybody_can_use_it(browser, tmp_path):
    text = (EXAMPLES / "click" / "brewery.yaml").read_text("utf-8").replace("reset_time: 260", "reset_time: 130")
    (tmp_path / "other.yaml").write_text(text, "utf-8")
    path = made(tmp_path, "click/brewery", "--against", str(tmp_path / "other.yaml"))
    with ready(browser, path, width=390, scheme="dark") as seen:
        page = seen.page
        assert page.text_content("#before-title") == "other.yaml"
        assert rows(page, "words") == [["DF107", "KETTLE reset_time", "130 → 260"]]
        page.keyboard.press("Tab")
        assert page.evaluate("document.activeElement.id") == "loop"
        for width, scheme, loop in ((390, "dark", "GLYCOL"), (1280, "light", "KETTLE")):
            page.set_viewport_size({"width": width, "height": 900})
            page.emulate_media(color_scheme=scheme)
            assert width_of(page) <= width
            assert page.evaluate(BEYOND) == []
            page.select_option("#loop", loop)
            page.wait_for_function(f"document.querySelector('#picture figcaption').textContent.startsWith('{loop}')")
            assert violations(page) == []


def violations(page):
    """What axe-core finds that somebody cannot see or reach."""
    if not AXE.is_file():
        pytest.skip("no axe-core: npm ci --prefix tests/node --ignore-scripts")
    page.evaluate(AXE.read_text("utf-8"))
    found = page.evaluate("axe.run(document)")["violations"]
    return [(one["id"], [node["html"] for node in one["nodes"]]) for one in found]
