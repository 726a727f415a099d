"""The playground: what its panes say is what the calls say, here and in Chromium."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import pidcfg
from browser import BEYOND, IN_CI, opened, width_of
from pidcfg.output.browser import playground as calls
from pidcfg.output.browser.page import examples_in, playground_page, read_runtime
from test_whatif_page import PATIENCE, RUNTIME, violations

ROOT = Path(__file__).parents[1]
EXAMPLES = ROOT / "examples"
FOLDERS = sorted(path for path in EXAMPLES.iterdir() if path.is_dir())
CASES = sorted(path for path in (ROOT / "tests" / "cases").rglob("*.yaml") if path.name != "PID011.yaml")
"""All but one: the parser in C, which a browser has not, says that a document begins a line earlier."""
MISTAKES = next(one for one in examples_in(EXAMPLES / "mistakes"))


def given(example, **more):
    """What the page gives to a call."""
    return {"files": example["files"], "config": example["config"], "scenario": example["scenario"], **more}


def case(path):
    """A file of the test cases as the text of a pane."""
    text = path.read_bytes().decode("utf-8", "replace")
    return {"files": {"a.yaml": text, "a.scenario.yaml": ""}, "config": "a.yaml", "scenario": "a.scenario.yaml"}


def test_every_example_is_there_with_its_scenario():
    found = [one for folder in FOLDERS for one in examples_in(folder)]
    assert {file for one in found for file in one["files"] if not file.endswith(".json")} >= {
        path.name for path in EXAMPLES.glob("*/*.yaml")
    }
    for one in found:
        assert one["files"][one["config"]]


def test_findings_stand_at_their_lines_and_are_those_of_check():
    said = calls.judge(given(MISTAKES))
    expected = pidcfg.check(MISTAKES["files"]["oven.yaml"], name="oven.yaml").findings
    assert [(row["line"], row["code"]) for row in said["findings"]] == [(d.span.line, d.code) for d in expected]
    assert {row["pane"] for row in said["findings"]} == {"config"}
    assert said["vendor"] == "dl06"
    wrong = {**MISTAKES["files"], "oven.scenario.yaml": "pidcfg: 1\nscenario: x\nconfig: oven.yaml\nduration: x\n"}
    rows = calls.judge(given({**MISTAKES, "files": wrong}))["findings"]
    assert next((row["pane"], row["line"]) for row in rows if row["pane"] == "scenario") == ("scenario", 4)


@pytest.mark.parametrize("name", ["dl06/flow", "nextopid/ratio"])
def test_words_trend_conversion_and_explanation(name):
    one = next(one for one in examples_in(EXAMPLES / name.split("/")[0]) if one["config"] == f"{Path(name).name}.yaml")
    assert calls.judge(given(one))["words"] == pidcfg.encode(EXAMPLES / f"{name}.yaml").text
    ran = calls.trend(given(one))
    assert {row["verdict"] for row in ran["verdicts"]} == {"proven"}
    assert ran["picture"].count("<figure") == len(ran["verdicts"])
    drafted = calls.trend(given({**one, "files": {**one["files"], one["scenario"]: " \n"}}))
    assert drafted["picture"].count("<figure") == len(ran["verdicts"])
    made = calls.convert(given(one, to="generic"))
    assert made["text"] == pidcfg.convert(EXAMPLES / f"{name}.yaml", "generic").text
    assert "exact" not in {row["kind"] for row in made["changes"]}
    told = calls.explain(given(one, asked="PID101 PID102"))
    assert [page.partition(":")[0] for page in told["pages"]] == ["PID101", "PID102"]
    for answer in (ran, made, told):
        assert json.loads(json.dumps(answer, allow_nan=False)) == answer


def test_what_cannot_be_done_is_said():
    broken = {**MISTAKES, "files": {"oven.yaml": "a: [", "oven.scenario.yaml": ""}}
    assert calls.judge(given(broken))["words"] == ""
    assert calls.trend(given(broken)) == {"picture": "", "verdicts": []}
    assert calls.convert(given(broken, to="click"))["text"] == ""
    (page,) = calls.explain(given(broken, asked="V7642=0008"))["pages"]
    assert "bit 3 on: The loop table extends past V7577" in page
    assert "bit 0" not in page
    assert calls.explain(given(broken, asked="nonsense"))["refused"].startswith("nothing is known of 'nonsense'")


# --- in the browser --------------------------------------------------------------------------------------------------


@pytest.fixture
def path(tmp_path):
    """The page with all examples."""
    if not RUNTIME.is_file():
        told = f"no Python for the browser in {RUNTIME}: python tasks.py whatif-runtime makes it"
        (pytest.fail if IN_CI else pytest.skip)(told)
    (tmp_path / "index.html").write_text(playground_page(FOLDERS, read_runtime(RUNTIME)), "utf-8")
    return tmp_path / "index.html"


def settle(page):
    """Waits until nothing runs, nor is about to."""
    page.wait_for_timeout(400)
    page.wait_for_function("document.body.dataset.state === 'idle' && !running && !wanted", timeout=PATIENCE)


def test_the_page_says_what_the_calls_say(browser, path):
    with opened(browser, path) as seen:
        page = seen.page
        page.context.set_offline(True)
        settle(page)
        assert page.input_value("#text") == (EXAMPLES / "dl06" / "reactor.yaml").read_text("utf-8")
        page.select_option("#example", label="mistakes/oven.yaml")
        settle(page)
        expected = calls.judge(given(MISTAKES))["findings"]
        heads = page.eval_on_selector_all("#findings b", "all => all.map(one => one.textContent.trim())")
        assert heads == [f"{row['line']}:{row['column']} {row['severity']} {row['code']}" for row in expected]
        marked = page.eval_on_selector_all("#gutter .error", "all => all.map(one => one.textContent)")
        assert marked == [f"● {row['line']}" for row in expected if row["severity"] == "error"]
        page.fill("#text", MISTAKES["files"]["oven.yaml"].replace("V7350", "V2000"))
        settle(page)
        assert "DL201" not in page.inner_text("#findings")
        page.click("#share-link")
        page.wait_for_function("location.hash.startsWith('#t=')")
        shared = page.evaluate("location.hash")
        page.select_option("#example", label="dl06/flow.yaml")
        settle(page)
        page.evaluate("hash => { location.hash = hash; }", shared)
        settle(page)
        assert "V2000" in page.input_value("#text")
        for file in CASES[::8]:
            answer = page.evaluate("values => call('judge', values)", case(file))
            said = calls.judge(case(file))
            assert {key: answer[key] for key in said} == said, file
    assert seen.errors == []
    assert {address.partition("/")[0] for address in seen.requests} <= {"file:", "blob:null"}


def test_everybody_can_use_it(browser, path):
    with opened(browser, path, width=390, scheme="dark") as seen:
        page = seen.page
        settle(page)
        page.select_option("#example", label="dl06/flow.yaml")
        for width, scheme in ((390, "dark"), (1400, "light")):
            page.set_viewport_size({"width": width, "height": 900})
            page.emulate_media(color_scheme=scheme)
            page.click("#tab-findings")
            for name in ("words", "trend", "convert", "explain"):
                page.keyboard.press("ArrowRight")
                settle(page)
                assert page.is_visible(f"#{name}-panel")
                assert width_of(page) <= width
                assert page.evaluate(BEYOND) == []
            assert "V10010" in page.text_content("#words")
            assert page.locator("#picture figure").count() == 1
            assert "vendor: click" in page.text_content("#converted")
            assert "V7642" in page.text_content("#explained")
            for name in ("trend", "convert"):
                page.click(f"#tab-{name}")
                settle(page)
                assert violations(page) == []
    assert seen.errors == []
