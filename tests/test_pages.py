"""Pages of the documentation: what they show is true, what is generated is up to date."""

from __future__ import annotations

import doctest
import json
import re

import pytest

import generated
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


def test_an_unknown_part_is_refused():
    with pytest.raises(SystemExit) as end:
        generated.main(["page"])
    assert str(end.value.code) == f"the parts are {', '.join(generated.PARTS)}"
