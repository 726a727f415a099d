"""Pages of the documentation: what they show is true, what is generated is up to date."""

from __future__ import annotations

import doctest
import functools
import json
import re
import subprocess
import sys
import threading
from contextlib import contextmanager
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer

import pytest

import case_messages
import generated
import mistakes
from pages import NOT_RUN, PAGES, ROOT, blocks, follow, python_session, skipped, steps, unlike, workshop
from shell import captured, pidcfg

# --- What README.md and docs/ say is true: commands and their outputs, files, links -----------------------------------

TEXTS = {page: path.read_text("utf-8") for page, path in PAGES.items()}
SESSIONS = {
    page: [step for block in blocks(text) if block.language == "console" for step in steps(block)]
    for page, text in TEXTS.items()
}


@pytest.mark.parametrize("page", [page for page, found in SESSIONS.items() if found])
def test_commands_print_what_is_shown(page, tmp_path):
    with workshop(TEXTS[page], tmp_path):
        done = list(follow(TEXTS[page]))
    for (step, terminal, out, code), after in zip(done, [*done[1:], None], strict=False):
        where = f"{page}, line {step.begin}: $ {step.command}"
        if step.shown:
            wrong = unlike(step.shown, terminal)
            assert not wrong or not unlike(step.shown, out), f"{where}\n{wrong}\n\n{terminal}"
        told = int(after[1]) if after and after[0].command == "echo $?" else 0
        assert code == told, f"{where}\nends with {code}, which the page does not tell\n\n{terminal}"


@pytest.mark.parametrize("page", [page for page, text in TEXTS.items() if python_session(text)])
def test_python_prints_what_is_shown(page, tmp_path):
    session = doctest.DocTestParser().get_doctest(python_session(TEXTS[page]), {}, page, page, 0)
    wrong: list[str] = []
    with workshop(TEXTS[page], tmp_path):
        doctest.DocTestRunner(optionflags=doctest.ELLIPSIS).run(session, out=wrong.append)
    assert session.examples
    assert not wrong, "".join(wrong)


def test_what_is_not_run_has_a_reason_and_is_on_a_page():
    shown = {skipped(step.command) for found in SESSIONS.values() for step in found}
    assert shown - {None} == set(NOT_RUN)


SNIPPETS = [
    (page, block)
    for page, text in TEXTS.items()
    for block in blocks(text)
    if block.language == "yaml" and not block.file and "pidcfg: 1" in block.lines
]


@pytest.mark.parametrize(("page", "block"), SNIPPETS, ids=[f"{page}:{block.begin}" for page, block in SNIPPETS])
def test_files_shown_are_valid(page, block, tmp_path):
    (tmp_path / "reactor.yaml").write_bytes((ROOT / "examples" / "dl06" / "reactor.yaml").read_bytes())
    (tmp_path / "shown.yaml").write_text("\n".join(block.lines) + "\n", "utf-8")
    code, terminal, _ = captured(pidcfg, ["validate", str(tmp_path / "shown.yaml"), "--severity", "error"])
    assert code == 0, terminal


@pytest.mark.parametrize("path", sorted((ROOT / "docs" / "schemas").glob("*.json")), ids=lambda path: path.stem)
def test_editors_of_an_older_draft_read_the_schemas(path):
    schema = json.loads(path.read_text("utf-8"))
    del schema["$schema"]
    validator = pytest.importorskip("jsonschema").Draft7Validator
    validator.check_schema(schema)
    assert not validator(schema).is_valid({"no such key": 1})


def test_the_readme_shows_outputs():
    assert sum(bool(step.shown) for step in SESSIONS["README.md"]) >= 5
    assert len(TEXTS["README.md"].splitlines()) <= 150


@pytest.mark.parametrize(
    ("shown", "printed", "same"),
    [
        (["a", "b"], "a\nb\n", True),
        (["a"], "a\nb\n", False),
        (["a", "b"], "a\n", False),
        (["a", "..."], "a\nb\nc\n", True),
        (["b", "..."], "a\nb\nc\n", False),
        (["a", "...", "c"], "a\nb\nc\n", True),
        (["a", "...", "b"], "a\nb\nc\n", False),
        (["...", "b", "...", "d"], "a\nb\nc\nd\n", True),
        (["...", "x", "...", "d"], "a\nb\nc\nd\n", False),
    ],
)
def test_a_wrong_output_is_noticed(shown, printed, same):
    assert (unlike(shown, printed) is None) == same


# --- links -----------------------------------------------------------------------------------------------------------

LINK = re.compile(r"\]\(<?(?P<file>[^)#:\s>]*)(?:#(?P<anchor>[^)>]+))?>?\)")


def prose(text):
    """A page without its blocks and its code."""
    lines = text.splitlines()
    for block in blocks(text):
        lines[block.begin - 1 : block.begin + len(block.lines) + 1] = [""] * (len(block.lines) + 2)
    return re.sub(r"`[^`\n]+`", "", "\n".join(lines))


def anchors(text):
    """The anchors of a page, made from its headings as code-hosting sites make them."""
    lines = text.splitlines()
    for block in blocks(text):
        lines[block.begin : block.begin + len(block.lines)] = [""] * len(block.lines)
    found = set(re.findall(r'<a id="([^"]+)"', text))
    for line in lines:
        if heading := re.match(r"#+ (.+)", line):
            plain = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading[1]).replace("`", "").strip().lower()
            slug = re.sub(r"[^\w\- ]", "", plain).replace(" ", "-")
            assert slug not in found, f"two headings {line}"
            found.add(slug)
    return found


ANCHORS = {page: anchors(text) for page, text in TEXTS.items()}


@pytest.mark.parametrize("page", TEXTS)
def test_links_lead_somewhere(page):
    for link in LINK.finditer(prose(TEXTS[page])):
        target = (PAGES[page].parent / link["file"]).resolve() if link["file"] else PAGES[page]
        assert target.exists(), link[0]
        if link["anchor"]:
            assert link["anchor"] in ANCHORS[target.relative_to(ROOT).as_posix()], link[0]


def test_commands_of_the_table_exist():
    from pidcfg.cli.main import COMMANDS

    table = [row for row in TEXTS["README.md"].splitlines() if row.startswith("| `pidcfg ")]
    named = {name for row in table for name in re.findall(r"`pidcfg (\w+)", row)}
    assert named == set(COMMANDS)


# --- The command that renews what is generated: it writes what differs, removes what is left over, and says so --------


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


RULE = "src/pidcfg/validate/rules/dl06/setup.py"


@pytest.mark.parametrize(
    ("changed", "vendors"),
    [
        ([], set()),
        ([RULE], {"dl06"}),
        ([RULE, "src/pidcfg/validate/rules/generic.py"], {"dl06", "generic"}),
        ([RULE, "src/pidcfg/validate/rules/__init__.py"], set()),
        ([RULE, "src/pidcfg/validate/rule.py"], set()),
        ([RULE, "tests/cases/DL201.yaml", "tests/test_fixes.py", "docs/decisions.md", "CHANGELOG.md"], {"dl06"}),
        ([RULE, "src/pidcfg/validate/rules.json", "docs/rules-dl06.md", "docs/dl06-coverage.md"], {"dl06"}),
        ([RULE, "examples/dl06/golden/oven.txt", "tests/data/configurations/click-to-dl06.txt"], {"dl06"}),
        ([RULE, "examples/click/golden/tank.txt"], set()),
        ([RULE, "examples/dl06/oven.yaml"], set()),
        ([RULE, "tests/golden.py"], set()),
        ([RULE, "tests/test_pictures.py"], set()),
        ([RULE, "tests/typical/vendors.yaml"], set()),
        (["tests/cases/DL201.yaml"], set()),
    ],
)
def test_a_rule_leaves_alone_what_is_made_of_other_vendors(changed, vendors):
    assert generated.vendors_of_rules(changed) == vendors


def test_of_a_vendors_rules_the_files_are_made_that_name_it(monkeypatch):
    names = ["dl06-oven", "click-to-dl06", "dl06/oven", "click-tank", "click/tank", "dl06"]
    monkeypatch.setitem(generated.BY_VENDOR, "examples", lambda wanted: dict.fromkeys(filter(wanted, names), b""))
    monkeypatch.setitem(generated.PARTS, "pictures", lambda: {"pictures": b""})
    assert [*generated.make({"dl06"}, "examples")] == ["dl06-oven", "click-to-dl06", "dl06/oven", "dl06"]
    assert [*generated.make({"dl06"}, "pictures")] == ["pictures"]


def test_what_no_rule_of_a_vendor_changes_is_not_made_anew(monkeypatch):
    monkeypatch.setattr(case_messages, "lines", lambda case: [f"{case.name}: anew"])
    rows = case_messages.messages(lambda vendor: vendor == "click").splitlines()
    anew = {row.partition(":")[0] for row in rows if row.endswith(": anew")}
    assert {"CK301.yaml", "CK375.yaml"} <= anew
    assert "DL256.yaml" not in anew
    committed = case_messages.GOLDEN.read_text("utf-8").splitlines()
    assert {row for row in committed if row.startswith("DL256.")} <= {*rows}
    assert mistakes.subjects("numbers") == ["numbers", "dl06"]
    assert generated.make({"click"}, "reports") == {}


def test_an_unknown_part_is_refused():
    with pytest.raises(SystemExit) as end:
        generated.main(["page"])
    assert str(end.value.code) == f"the parts are {', '.join(generated.PARTS)}"


# --- The documentation site in a real browser: complete, quiet, offline, readable on a phone --------------------------


built = pytest.mark.long("Sphinx builds the whole site once, as a reader gets it")
NARROW, WIDE = 400, 1280
BEYOND = (
    "Math.max(...[document.documentElement, document.querySelector('article')].map(e => e.scrollWidth - e.clientWidth))"
)
"""How far the page, or its text inside it, is wider than there is room."""
AROUND_HEADINGS = 8
"""The theme lets a heading stand out by this much, to colour it when it is the target of a link."""


class Quiet(SimpleHTTPRequestHandler):
    """Files of a folder, without a line for each request."""

    def log_message(self, format, *args):  # noqa: A002 - the base class's name
        pass


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The site as `python tasks.py docs` builds it: a warning is an error."""
    for package in ("sphinx", "furo", "myst_parser"):
        pytest.importorskip(package)
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-d", str(folder / "doctrees"), "docs"]
    result = subprocess.run([*command, str(folder / "site")], cwd=ROOT, capture_output=True, check=False, text=True)
    assert result.returncode == 0, result.stderr
    return folder / "site"


@pytest.fixture(scope="module")
def address(site):
    """The site on a server of this computer."""
    server = ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=str(site)))
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    yield f"http://127.0.0.1:{server.server_port}"
    server.shutdown()
    thread.join()
    server.server_close()


def is_left(request):
    """Whether the browser gave up an icon of a page that it has left: it asks for them late, and for itself."""
    return request.failure == "net::ERR_ABORTED" and request.url.endswith("favicon.svg")


@contextmanager
def page_of(browser, width, complaints, address):
    """A page of this width that notes what the console says, what does not arrive, and what comes from elsewhere."""
    page = browser.new_page(viewport={"width": width, "height": 900})
    page.on("console", lambda said: complaints.append(said.text) if said.type in {"error", "warning"} else None)
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.on("requestfailed", lambda gone: None if is_left(gone) else complaints.append(f"failed: {gone.url}"))
    page.on("response", lambda got: complaints.append(f"{got.status}: {got.url}") if got.status >= 400 else None)
    page.on(
        "request",
        lambda request: (
            None if request.url.startswith((address, "data:")) else complaints.append(f"elsewhere: {request.url}")
        ),
    )
    yield page
    page.close()


@built
def test_every_page_of_the_folder_is_in_the_site_and_in_its_list(site):
    index = (site / "index.html").read_text("utf-8")
    for path in (ROOT / "docs").glob("*.md"):
        assert (site / f"{path.stem}.html").is_file(), path.name
        assert path.stem == "index" or f'href="{path.stem}.html"' in index, path.name


@built
def test_the_schemas_are_there_to_be_downloaded(site):
    for path in (ROOT / "docs" / "schemas").iterdir():
        assert (site / "schemas" / path.name).read_bytes() == path.read_bytes()


@built
def test_pages_are_quiet_and_never_wider_than_the_screen(browser, site, address):
    complaints = []
    with page_of(browser, NARROW, complaints, address) as page:
        for path in sorted(site.glob("*.html")):
            page.goto(f"{address}/{path.name}")
            for width in (NARROW, WIDE):
                page.set_viewport_size({"width": width, "height": 900})
                if page.evaluate(BEYOND) > AROUND_HEADINGS:
                    complaints.append(f"{path.name} is wider than {width}")
    assert not complaints


@built
def test_wide_tables_and_code_scroll_inside_themselves(browser, address):
    with page_of(browser, NARROW, [], address) as page:
        for name, what in (("dl06-registers", ".table-wrapper"), ("tutorial", ".highlight pre")):
            page.goto(f"{address}/{name}.html")
            boxes = page.eval_on_selector_all(what, "all => all.map(e => [e.scrollWidth, e.clientWidth])")
            assert any(inside > outside for inside, outside in boxes)
            assert all(outside <= NARROW for _, outside in boxes)


@built
def test_search_finds_without_a_network(browser, address):
    complaints = []
    with page_of(browser, WIDE, complaints, address) as page:
        page.goto(f"{address}/index.html")
        page.fill(".sidebar-search", "ultimate cycle")
        page.press(".sidebar-search", "Enter")
        page.wait_for_selector("ul.search li a")
        found = page.eval_on_selector_all("ul.search li a", "all => all.map(a => a.getAttribute('href'))")
    assert any(link.startswith("tuning.html") for link in found)
    assert not complaints


@built
def test_the_site_works_from_a_folder_too(browser, site):
    complaints = []
    with page_of(browser, WIDE, complaints, site.as_uri()) as page:
        page.goto(f"{site.as_uri()}/index.html")
        page.click("text=first hour")
        assert page.title().startswith("First hour")
    assert not complaints


@built
def test_dark_mode_is_readable(browser, address):
    context = browser.new_context(color_scheme="dark")
    page = context.new_page()
    page.goto(f"{address}/index.html")
    colours = page.evaluate("[getComputedStyle(document.body).color, getComputedStyle(document.body).backgroundColor]")
    context.close()
    light, dark = ([int(n) for n in colour[4:-1].split(",")[:3]] for colour in colours)
    assert min(light) > 150
    assert max(dark) < 60
