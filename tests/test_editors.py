"""The JSON Schemas as editors read them: every pattern in JavaScript, and whole files in yaml-language-server."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from functools import cache
from itertools import product
from pathlib import Path
from typing import Annotated, get_args

import pytest
from pydantic import TypeAdapter, ValidationError
from ruamel.yaml import YAML

import pidcfg
from editor import NODE, LanguageServer, in_node, needs_node, needs_server
from pidcfg.cli import lsp
from pidcfg.cli.commands.schema import SCENARIO, SETTINGS_NAME, document_schema
from pidcfg.output.json_schemas import OUTPUT_SCHEMAS
from pidcfg.schemas.base import Parser
from pidcfg.schemas.document import models_of
from pidcfg.schemas.scenario import Scenario
from pidcfg.text.source import read_document
from pidcfg.validate.catalog import CODE_PATTERN, find_rules
from pidcfg.validate.schema import read_model
from pidcfg.vendors import VENDORS

ROOT = Path(__file__).parents[1]

# --- texts, right and wrong -------------------------------------------------------------------------------------------

NUMBERS = (
    *("5", "+5", "-5", "0", "12.5", "0.5", ".5", "5.", "1e3", "1E-3", "2.5e+2", "9" * 40, "1e999"),
    *("", ".", "-", "--5", "5..5", "5.5.5", "00", "007", "-00.5", "01e1", "1e", "1,5", "1_000", "0x10"),
    *(" 5", "5 ", "\u0665", "\uff15"),  # the digit five of two other scripts
)
UNITS = (
    *("ms", "s", "sec", "second", "seconds", "min", "minute", "minutes", "h", "hour", "hours", "%", "count", "counts"),
    *("/s", "/min", "/sample", "/ min", " / s", "counts/min", "counts / sample", " counts  /  s ", "\t/s", "\u00a0/s"),
    *("", "S", "Min", "msec", "mins", "hrs", "d", "%%", "Counts", "/hour", "/minute", "counts per min", "s\n", "%\n"),
)
BANKS = ("V", "v", "C", "DS", "DF", "R", "S", "IR", "OR", "O", "D", "T", "X", "Y", "M", "SM", "Q", "")
ADDRESSES = (
    *("0", "1", "01", "001", "016", "017", "7", "8", "511", "512", "2000", "30000", "99999", "123456", "177777"),
    *("200000", "1777777", "0.1", "1.15", "1.16", "1.01", "64.0", "-1", "1e2", "\uff11", "1\n", "0.1\n", " 1", ""),
)
TYPES = ("BOOL", "bool", "INT", "Int", "REAL", "real", "TIME", "tIme", "T", "t", "DINT", "t\u0131me", "T ")
VALUES = (
    *("5", "-5", "0", "1", "2", "1.5", "1e3", "007", "5 s", " 5", "5 ", "true", "TRUE", "False", "maybe", "", "1\n"),
    *("1m30s", "500ms", "1.5S", "1H", "1d", "1_0s", "_1s", "1s_", "_", "1s1s", "1.5m3s", "5 ms", "1s\n"),
    *("\uff11s", "5\u017f"),  # a wide one; a long s, which is an s in capitals
)
WORDS = ("off", "off 9999", "OFF", "never", "A", "a_b", "A__B", "_A", "A_", "9A", "Ä", "A B", "A" * 41, "DLX1")


@cache
def texts():
    """Texts of the examples, and spellings of every kind of value."""
    found = set(WORDS)
    for path in (ROOT / "examples").glob("*/*.yaml"):
        found |= texts_in(YAML(typ="safe").load(path))
    found |= {a + b + c for a, b, c in product(NUMBERS, ("", " "), ("s", "%", "counts", "/min", ""))}
    found |= {a + b + c for a, b, c in product(("5", "-1.5"), ("", " ", "  ", "\t"), UNITS)}
    found |= {a + b + c for a, b, c in product(("±", "+-", "+/- ", "-+"), NUMBERS, ("%", " %"))}
    found |= {a + b for a, b in product(BANKS, ADDRESSES)}
    found |= {f"{a}#{b}" for a, b in product(TYPES, VALUES)}
    begins = {code[:length] for code in find_rules() for length in (1, 2, 3)}
    return sorted(
        {*found, *find_rules(), *begins, *map(str.lower, begins)}.union(*map(examples_in, schemas().values()))
    )


def texts_in(value):
    """The short texts of a file, keys among them."""
    if isinstance(value, dict):
        value = [*value, *value.values()]
    if isinstance(value, list):
        return {text for item in value for text in texts_in(item)}
    return {value} if isinstance(value, str) and len(value) < 24 else set()


# --- patterns ---------------------------------------------------------------------------------------------------------


def patterns_in(schema):
    """The patterns of a JSON Schema, and those that keys are held to."""
    if isinstance(schema, dict):
        own = {schema["pattern"]} if isinstance(schema.get("pattern"), str) else set()
        return own.union(schema.get("patternProperties", ()), *map(patterns_in, schema.values()))
    return set().union(*map(patterns_in, schema)) if isinstance(schema, list) else set()


def examples_in(schema):
    """The texts that a JSON Schema gives as examples."""
    if isinstance(schema, dict):
        own = {text for text in schema.get("examples", ()) if isinstance(text, str)}
        return own.union(*map(examples_in, schema.values()))
    return set().union(*map(examples_in, schema)) if isinstance(schema, list) else set()


def kinds_in(annotation, metadata=()):
    """The types of a field that have a parser."""
    if any(isinstance(item, Parser) for item in metadata):
        return [Annotated[(annotation, *metadata)]]
    if hasattr(annotation, "__metadata__"):
        return kinds_in(annotation.__origin__, annotation.__metadata__)
    return [kind for inner in get_args(annotation) for kind in kinds_in(inner)]


def begin_of_rules(text):
    """A code in settings, as far as it is written."""
    if not (text and find_rules(text.upper())):
        raise ValueError("no such rule")


def code(text):
    """A code in what is printed."""
    if not CODE_PATTERN.fullmatch(text):
        raise ValueError("no such rule")


@cache
def readers():
    """What reads a text whose JSON Schema has a pattern, with that schema, by the field where it is first met."""
    found, parts = {}, {}
    for model in (*(vendor.model for vendor in VENDORS.values()), Scenario):
        models_of(model, parts)
    for part in parts:
        for key, field in part.model_fields.items():
            for kind in kinds_in(field.annotation, tuple(field.metadata)):
                schema = TypeAdapter(kind).json_schema()
                (parse,) = (item.parse for item in kind.__metadata__ if isinstance(item, Parser))
                name = getattr(parse, "__qualname__", repr(parse))
                if patterns := frozenset(patterns_in(schema)):
                    row = f"{part.__name__}.{key} {name}", schema, TypeAdapter(kind).validate_python
                    found.setdefault((patterns, name), row)
    settings = schemas()[SETTINGS_NAME]["properties"]["select"]["items"]
    (printed,) = patterns_in(schemas()["output-rule"])
    rows = (*found.values(), ("select", settings, begin_of_rules), ("code", {"pattern": printed}, code))
    return {f"{model_and_key} {number}": row for number, (model_and_key, *row) in enumerate(rows)}


@cache
def schemas():
    """All that ``pidcfg schema`` prints."""
    return {name: document_schema(name) for name in (*VENDORS, SCENARIO, SETTINGS_NAME, *OUTPUT_SCHEMAS)}


@cache
def in_javascript():
    """The texts that each pattern of the schemas fits."""
    return in_node(sorted(set().union(*map(patterns_in, schemas().values()))), texts())


@needs_node
def test_every_pattern_is_a_regular_expression_of_javascript():
    assert not [told for told in in_javascript().values() if isinstance(told, str)]
    assert in_javascript().keys() == set().union(*(patterns_in(schema) for schema, _ in readers().values()))


@needs_node
def test_every_pattern_means_the_same_to_python():
    """But for a line break at the end, which ``$`` of Python lets through."""
    for pattern, fits in in_javascript().items():
        found = {text for text in texts() if re.search(pattern, text)}
        assert {text for text in found ^ set(fits) if not text.endswith("\n")} == set(), pattern
        assert set(fits) <= found, pattern


NOT_IN_A_PATTERN = re.compile(
    r"does not exist|is beyond|word of the programming language|at most \d+ are allowed|more than \d+ digits"
    r"|is too (large|small)|leaves nothing to vary|is not a TIME|is not a whole number of m?s|no such rule"
)
"""Why a text that looks right is refused: how much it says, or what others say."""


def placed(schema, text):
    """A text where its schema has the pattern: alone, as both of a pair, or behind a key."""
    if "items" in schema:
        return [text, text]
    return {"A": text} if any(item.get("additionalProperties") for item in schema.get("anyOf", ())) else text


def refusal(read, value):
    """Why a value is not read; None where it is."""
    try:
        read(value)
    except ValidationError as error:
        return error.errors()[0]["msg"]
    except ValueError as error:
        return str(error)
    return None


@needs_node
@pytest.mark.parametrize("where", readers())
def test_an_editor_marks_what_is_not_read_and_nothing_else(where):
    schema, read = readers()[where]
    fitting = set().union(*(in_javascript()[pattern] for pattern in patterns_in(schema)))
    fitting |= {text for text in WORDS if f'"{text}"' in json.dumps(schema)}
    refused = {text: why for text in texts() if (why := refusal(read, placed(schema, text)))}
    right = set(texts()) - refused.keys()
    assert right >= examples_in(schema)
    assert right - fitting == set()
    assert {why for text, why in refused.items() if text in fitting and not NOT_IN_A_PATTERN.search(why)} == set()


# --- what an editor shows ---------------------------------------------------------------------------------------------


def objects_in(schema):
    """Every object within a JSON Schema."""
    if isinstance(schema, dict):
        yield schema
    for inner in schema.values() if isinstance(schema, dict) else schema if isinstance(schema, list) else ():
        yield from objects_in(inner)


@pytest.mark.parametrize("name", [*VENDORS, SCENARIO])
def test_a_key_with_a_unit_offers_values_that_are_read_and_titles_are_words(name):
    schema = schemas()[name]
    assert schema["$id"] == f"urn:pidcfg:schema:{name}"
    valid = pytest.importorskip("jsonschema").Draft202012Validator
    for part in objects_in(schema):
        if "x-unit" in part:
            assert part["examples"] == [snippet["body"] for snippet in part["defaultSnippets"]] != []
            assert all(valid(part).is_valid(value) for value in part["examples"]), part
        if isinstance(part.get("pattern"), str) and "const" not in part:
            assert part["patternErrorMessage"].startswith("write it like ") or "examples" not in part
    blocks = {kind for part in schema["$defs"].values() if (kind := part["properties"].get("type", {}).get("const"))}
    titles = {part["title"] for part in schema["$defs"].values() if "title" in part}
    assert not [title for title in titles - blocks if re.search("[a-z][A-Z]", title)]
    assert not [key for key, part in schema["$defs"].items() if key.endswith("Part") and "title" in part]


@needs_server
def test_an_editor_shows_a_title_once_and_offers_values_with_their_unit():
    name = "dl06/reactor.yaml"
    text = (ROOT / "examples" / name).read_text("utf-8")
    uri = "file:///hover.yaml"
    with LanguageServer(ROOT / "docs", {schema_of(text): [uri]}) as server:
        server.diagnostics({uri: text})
        line = next(i for i, row in enumerate(text.splitlines()) if "alarms:" in row)
        at = {"line": line, "character": text.splitlines()[line].index("alarms") + 1}
        shown = server.ask("textDocument/hover", {"textDocument": {"uri": uri}, "position": at})
    assert "||" not in shown["contents"]["value"]
    assert "Alarms" in shown["contents"]["value"]


# --- whole files ------------------------------------------------------------------------------------------------------

SHIPPED = sorted([*(ROOT / "examples").glob("**/*.yaml"), *(ROOT / "src/pidcfg/cli/starters").glob("*.yaml")])
SPOILED = {
    # an example: a text of it, what stands in its place
    "dl06/reactor.yaml": (
        ("loop_table: V2000", "looptable: V2000"),
        ("loop_table: V2000", "loop_table: V2080"),
        ("loop_table: V2000", "loop_table: V200000"),
        ("algorithm: position", "algorithm: positional"),
        ("bias_freeze: true", "bias_freeze: yes"),
        ("sample_rate: 0.2 ", "sample_rate: 0.2 msec "),
        ("sample_rate: 0.2 ", "sample_rate: 0..2 s "),
        ("reset: 4.0", "reset: 4.0 counts"),
        ("reset: 4.0", "reset: 007 s"),
        ("gain: 0.80", "gain: high"),
        ("rate_of_change: 0.5", "rate_of_change: 0.5 /hour"),
        ("rate_of_change: 0.5", 'rate_of_change: "0.5"'),
        ('"2048 counts"', '"2048 cts"'),
        ("low_low: 1.0", "low_low: [1.0]"),
    ),
    "click/tank.yaml": (
        ("bits: C101", "bits: DS101"),
        ("bits: C101", "bits: C10100"),
        ("sample_rate: 500 ms", "sample_rate: 500"),
        ("rate_of_change: 120 /min", "rate_of_change: 120 counts/min"),
        ("bumpless: 2", "bumpless: II"),
        ("bit: Y001", "bit: Y1"),
        ("upper_limit: 165", "upper_limt: 165"),
    ),
    "ezlogix/oven.yaml": (
        ("registers: R101", "registers: 101"),
        ("derivative_time: off", "derivative_time: none"),
        ("integral_time: 140.0", "integral_time: 140.0 sek"),
        ("{tag: IR1,", "{tag: OR1,"),
        ("algorithm: velocity", "algorithm: Velocity"),
        ("anti_windup: true", "antiwindup: true"),
    ),
    "nextopid/diagnostics.yaml": (
        ("Hold: INT#0", "Hold: INT#"),
        ("Hold: INT#0", "Hold: WORD#0"),
        ("Hold: INT#0", "9Hold: INT#0"),
        ("type: PIDA_REAL", "type: PID_REAL"),
        ("{sample_time: 0.1}", "{sample_time: 0.1 S}"),
        ("at: start}", "att: start}"),
    ),
    "dpide/dryer.yaml": (
        ("interrupt_task: 500", "interrupt_task: 500 /s"),
        ("device: D1000", "device: D01000"),
        ("PID_RUN: M100, SV: D300", "PID_RUN: D100, SV: D300"),
        ("Td_Kd: 12 s", "Td_Kd: 12 secs"),
        ("PID_DE: true", "PID_DE: 1"),
    ),
    "generic/boiler.yaml": (
        ("sample_time: 500 ms", "sample_time: 500 Ms"),
        ("mode: cascade", "mode: cascaded"),
        ("filter: 2 s", "filters: 2 s"),
    ),
    "dl06/reactor.scenario.yaml": (
        ("duration: 30 min", "duration: 30 mins"),
        ("max: 10 %", "max: 10 percent"),
        ("metric: overshoot", "metric: overshot"),
        ("never: true", "never: always"),
        ("gain: -0.02", "gain: -0.02 %"),
        ("initial: steady", "initial: {TIC-101: 40 %}"),
    ),
    "dpide/chiller.scenario.yaml": (("gain: ±30 %", "gain: 30 %"), ("gain: ±30 %", "gain: ±030 %")),
}
"""Misspelt keys, wrong units, wrong kinds of values and wrong words."""
PAGE = (ROOT / "docs/editors.md").read_text("utf-8")
SETTINGS_SHOWN = json.loads(re.search(r"```json\n(.+?)```", PAGE, re.DOTALL)[1])["yaml.schemas"]
FILE_SHOWN = re.search(r"```yaml\n(.+?)```", PAGE, re.DOTALL)[1]
REACTOR, SCENARIO_OF_IT = (
    (ROOT / "examples/dl06" / name).read_text("utf-8") for name in ("reactor.yaml", "reactor.scenario.yaml")
)
AS_SHOWN = {
    # a file beside the folder of schemas, with or without mistakes: its text, whether it has one
    "first.yaml": (FILE_SHOWN, False),
    "wrong.yaml": (FILE_SHOWN.replace("gain", "gian"), True),
    "loops/first.yaml": (FILE_SHOWN.replace("=schemas", "=../schemas"), False),
    "loops/reactor.yaml": (REACTOR, False),
    "loops/wrong.yaml": (REACTOR.replace("gain", "gian"), True),
    "loops/reactor.scenario.yaml": (SCENARIO_OF_IT, False),
    "loops/wrong.scenario.yaml": (SCENARIO_OF_IT.replace("10 %", "10 percent"), True),
    "tests/wrong.scenario.yaml": (SCENARIO_OF_IT.replace("plants", "plant"), True),
}


def schema_of(text):
    """The schema of a file, as its head says."""
    vendor = re.search(r"^vendor: (\w+)", text, re.MULTILINE)
    return (ROOT / f"docs/schemas/{vendor[1] if vendor else SCENARIO}.schema.json").as_uri()


@cache
def marked():
    """The lines that yaml-language-server marks, with its words, in each shipped file and in each spoiled one."""
    files = {path.as_uri(): path.read_text("utf-8") for path in SHIPPED}
    for name, changes in SPOILED.items():
        text = (ROOT / "examples" / name).read_text("utf-8")
        files |= {f"file:///{name}/{number}": text.replace(*change, 1) for number, change in enumerate(changes)}
    patterns = {**SETTINGS_SHOWN}
    for uri, text in files.items():
        patterns.setdefault(schema_of(text), []).append(uri)
    files |= {(ROOT / "docs" / name).as_uri(): text for name, (text, _) in AS_SHOWN.items()}
    with LanguageServer(ROOT / "docs", patterns) as server:
        found = server.diagnostics(files)
    return {uri: [(d["range"]["start"]["line"], d["message"]) for d in marks] for uri, marks in found.items()}


@needs_server
def test_an_editor_marks_nothing_in_a_shipped_file():
    assert {path.name: marks for path in SHIPPED if (marks := marked()[path.as_uri()])} == {}


@needs_server
@pytest.mark.parametrize("name", SPOILED)
def test_an_editor_marks_a_mistake_where_it_stands(name):
    text = (ROOT / "examples" / name).read_text("utf-8")
    for number, (right, wrong) in enumerate(SPOILED[name]):
        place = text[: text.index(right)].count("\n")
        assert place in {line for line, _ in marked()[f"file:///{name}/{number}"]}, wrong


@pytest.mark.parametrize("name", SPOILED)
def test_what_an_editor_is_to_mark_is_refused(name):
    text = (ROOT / "examples" / name).read_text("utf-8")
    model = Scenario if name.endswith(".scenario.yaml") else VENDORS[name.partition("/")[0]].model
    assert read_model(model, read_document(text.encode(), name))[1] == []
    for change in SPOILED[name]:
        assert read_model(model, read_document(text.replace(*change, 1).encode(), name))[1], change


@needs_server
@pytest.mark.parametrize("name", AS_SHOWN)
def test_the_page_says_how_a_file_gets_its_schema(name):
    assert bool(marked()[(ROOT / "docs" / name).as_uri()]) is AS_SHOWN[name][1]


# --- The extension for VS Code: built and started in a fake editor, with the real server ------------------------------


FOLDER = Path(__file__).parents[1] / "editors/vscode"
PACKAGE = json.loads((FOLDER / "package.json").read_text("utf-8"))
SOURCE = (FOLDER / "src/extension.js").read_text("utf-8")
needs_packages = pytest.mark.skipif(
    NODE is None or not (FOLDER / "node_modules").is_dir() or os.name != "posix",
    reason="the extension's packages are not installed: npm ci --ignore-scripts in editors/vscode",
)


def test_the_extension_is_of_this_version_and_knows_the_commands_of_the_server():
    assert PACKAGE["version"] == pidcfg.__version__
    assert dict(re.findall(r'const (RUN|WORDS) = "(.+)";', SOURCE)) == {
        "RUN": lsp.RUN_COMMAND,
        "WORDS": lsp.WORDS_COMMAND,
    }
    lock = json.loads((FOLDER / "package-lock.json").read_text("utf-8"))["packages"][""]
    assert lock["devDependencies"] == PACKAGE["devDependencies"]
    assert all(re.fullmatch(r"[0-9.]+", version) for version in PACKAGE["devDependencies"].values()), "one version each"


@needs_packages
def test_the_extension_starts_the_server_and_shows_what_it_answers(tmp_path):
    pytest.importorskip("pygls", reason="pygls is not installed: the extra lsp")
    program = tmp_path / "pidcfg"
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m pidcfg "$@"\n', "utf-8")
    program.chmod(0o755)
    npm = shutil.which("npm") or pytest.skip("npm is not installed")
    subprocess.run([npm, "run", "--silent", "build"], cwd=FOLDER, check=True, capture_output=True)
    told = subprocess.run(
        [str(NODE), "--test", "test/extension.test.js"],
        cwd=FOLDER,
        env={**os.environ, "PIDCFG_PROGRAM": str(program)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert told.returncode == 0, told.stdout
