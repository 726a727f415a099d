"""The published JSON Schemas: sound, complete, closed, and true of what every command prints."""

from __future__ import annotations

import copy
import json
from pathlib import Path

import pytest

pytest.importorskip("jsonschema")
import jsonschema
from click.testing import CliRunner

from pidcfg.cli.main import cli
from pidcfg.output.json_schemas import OUTPUT_SCHEMAS, output_schema
from pidcfg.vendors import VENDORS

ROOT = Path(__file__).parents[1]
EXAMPLES = ROOT / "examples"
SCHEMAS = {name: jsonschema.Draft202012Validator(output_schema(name)) for name in OUTPUT_SCHEMAS}
CONFIGURATIONS = sorted(p for p in EXAMPLES.glob("*/*.yaml") if ".scenario" not in p.name)


def run(name, *args, code=0, **kwargs):
    """The one document that a command prints as JSON, judged by its schema."""
    kind = "--report" if name == "output-convert" else "--format"
    arguments = [name.removeprefix("output-"), *map(str, args), kind, "json"]
    result = CliRunner().invoke(cli, arguments, catch_exceptions=False, **kwargs)
    assert result.exit_code == code, result.stderr
    document = json.loads(result.stdout)
    SCHEMAS[name].validate(document)
    return document


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty folder that commands run in."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bad.yaml").write_text("pidcfg: 1\nvendor: [\n", "utf-8")
    return tmp_path


def objects(schema):
    """Every schema of an object within one."""
    if isinstance(schema, dict):
        if schema.get("type") in ("object", ["object", "null"]):
            yield schema
        schema = list(schema.values())
    for part in schema if isinstance(schema, list) else ():
        yield from objects(part)


@pytest.mark.parametrize("name", OUTPUT_SCHEMAS)
def test_schemas_are_sound_and_closed(name):
    schema = output_schema(name)
    jsonschema.Draft202012Validator.check_schema(schema)
    assert schema["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    for part in objects(schema):
        assert part["description"]
        free = part["description"] == "In the terms of the vendor."
        assert part["additionalProperties"] == free or "properties" not in part
        for key in part.get("properties", {}).values():
            assert "$ref" in key or key["description"]


@pytest.mark.parametrize("name", OUTPUT_SCHEMAS)
def test_schemas_are_printed_and_published(name):
    printed = CliRunner().invoke(cli, ["schema", name]).stdout
    assert json.loads(printed) == output_schema(name)
    assert (ROOT / "docs" / "schemas" / f"{name}.schema.json").read_text("utf-8") == printed
    assert f"{name:<16} what pidcfg {OUTPUT_SCHEMAS[name][1]} prints\n" in CliRunner().invoke(cli, ["schema"]).stdout


def leaves(document, path=()):
    """The path of every key in a document, indices and names of the user's left as they are."""
    if isinstance(document, dict):
        for key, value in document.items():
            yield (*path, key)
            yield from leaves(value, (*path, key))
    elif isinstance(document, list):
        for i, value in enumerate(document[:3]):
            yield from leaves(value, (*path, i))


def renamed(document, path):
    """The document with one key called otherwise."""
    changed = copy.deepcopy(document)
    part = changed
    for step in path[:-1]:
        part = part[step]
    part[f"{path[-1]}_x"] = part.pop(path[-1])
    return changed


OPEN = {"plc_flags", "loops", "signals", "flags", "results", "values"}
"""Objects of a run whose keys are names of the user's or the PLC's."""


DL06 = EXAMPLES / "dl06"
FULL = {
    "validate": (EXAMPLES / "mistakes" / "oven.yaml",),
    "simulate": (EXAMPLES / "nextopid" / "autotune.scenario.yaml",),
    "certify": (EXAMPLES / "dpide" / "chiller.scenario.yaml", "--samples", 40, "--jobs", 1),
    "convert": (DL06 / "oven.yaml", "--to", "click", "-o", "o.yaml", "--verify", "--allow-loss"),
    "diff": (DL06 / "oven.yaml", DL06 / "reactor.yaml"),
    "tune": ("--method", "zn-open", "--gain", 2, "--time-constant", 10, "--dead-time", 1, "--for", "click"),
    "rule": ("DL242",),
    "encode": (DL06 / "reactor.yaml",),
}
"""Arguments with which each command prints nearly all of its keys."""


@pytest.mark.parametrize("name", FULL)
def test_a_key_that_is_called_otherwise_is_noticed(name, folder):
    document = run(f"output-{name}", *FULL[name], code=int(name == "validate"))
    for path in leaves(document):
        if {"settings", "plc"} & set(path[:-1]) or (len(path) > 1 and path[-2] in OPEN and isinstance(path[-1], str)):
            continue
        if name == "certify" and path[:-1] == ("metrics",):  # by the names of loops
            continue
        assert not SCHEMAS[f"output-{name}"].is_valid(renamed(document, path)), path


@pytest.mark.parametrize("path", CONFIGURATIONS, ids=lambda p: f"{p.parent.name}-{p.stem}")
def test_what_validate_and_encode_print_of_examples(path):
    wrong = path.parent.name == "mistakes"
    findings = run("output-validate", path, path.with_suffix(".none"), code=2)
    assert findings["summary"]["files"] == 2
    run("output-validate", path, code=int(wrong))
    printed = run("output-encode", path, code=int(wrong))
    assert ("findings" in printed) == wrong
    if wrong:
        run("output-encode", path, "--allow-errors")


def test_what_validate_prints_of_every_case():
    found = run("output-validate", ROOT / "tests" / "cases", code=2)
    assert len({row["code"] for row in found["findings"]}) > 300


def test_what_simulate_printed_of_every_example():
    reports = sorted(EXAMPLES.glob("*/golden/*.report.json"))
    assert len(reports) > 20
    for path in reports:
        SCHEMAS["output-simulate"].validate(json.loads(path.read_text("utf-8")))


def test_what_simulate_prints_of_several_scenarios_and_of_some_that_cannot_run(folder):
    flow = EXAMPLES / "dl06" / "flow.scenario.yaml"
    (folder / "lost.scenario.yaml").write_text("pidcfg: 1\nscenario: x\nconfig: none.yaml\nduration: 1\n", "utf-8")
    several = run("output-simulate", flow, "lost.scenario.yaml", "bad.yaml", "none.yaml", code=2)
    assert [r["scenario"] is None for r in several["runs"]] == [False, True, True, True]
    assert run("output-simulate", "bad.yaml", code=2)["passed"] is False
    assert "runs" in run("output-simulate", flow, "bad.yaml", code=2)


def test_what_simulate_prints_of_a_failed_run_and_of_the_scan_time(folder):
    scenario = ROOT / "tests" / "data" / "formats" / "fails.scenario.yaml"
    assert run("output-simulate", scenario, code=1)["passed"] is False
    (folder / "flow.yaml").write_bytes(scenario.with_name("flow.yaml").read_bytes())
    text = scenario.read_text("utf-8").replace("step: 50 ms\n", "plc: {scan_time: 50 ms}\n")
    (folder / "s.yaml").write_text(text, "utf-8")
    assert run("output-simulate", "s.yaml", code=1)["scan_time"]["typical"] > 0


@pytest.mark.parametrize("source", VENDORS)
def test_what_convert_prints(source, folder):
    path = next(p for p in CONFIGURATIONS if p.parent.name == source)
    for target in VENDORS:
        arguments = [path, "--to", target, "-o", f"{target}.yaml", "--allow-loss"]
        result = CliRunner().invoke(cli, ["convert", *map(str, arguments), "--report", "json"])
        assert result.exit_code in {0, 1}, result.stderr
        SCHEMAS["output-convert"].validate(json.loads(result.stdout))


def test_what_convert_prints_of_a_file_it_cannot_use(folder):
    assert run("output-convert", "bad.yaml", "--to", "click", "-o", "x.yaml", code=2)["findings"]
    text = (EXAMPLES / "mistakes" / "oven.yaml").read_text("utf-8")
    (folder / "oven.yaml").write_text(text, "utf-8")
    assert run("output-convert", "oven.yaml", "--to", "click", "-o", "x.yaml", code=1)["findings"]


def test_what_convert_prints_when_the_source_does_not_say_enough(folder):
    text = (EXAMPLES / "dpide" / "oven.yaml").read_text("utf-8")
    lines = [line for line in text.splitlines() if not line.strip().startswith("pv:")]
    assert len(lines) < len(text.splitlines())
    (folder / "x.yaml").write_text("\n".join(lines) + "\n", "utf-8")
    result = CliRunner().invoke(cli, ["convert", "x.yaml", "--to", "dl06", "-o", "o.yaml", "--report", "json"])
    assert result.exit_code == 1, result.stderr
    document = json.loads(result.stdout)
    SCHEMAS["output-convert"].validate(document)
    assert {row["code"] for row in document["findings"]} == {"PID042"}


def test_what_diff_prints(folder):
    dl06 = EXAMPLES / "dl06"
    assert run("output-diff", dl06 / "oven.yaml", dl06 / "oven.yaml")["summary"]["changed"] == 0
    run("output-diff", dl06 / "oven.yaml", EXAMPLES / "click" / "tank.yaml")
    run("output-diff", EXAMPLES / "nextopid" / "cascade.yaml", EXAMPLES / "nextopid" / "furnace.yaml")
    run("output-diff", dl06 / "reactor.yaml", dl06 / "golden" / "reactor.txt")


@pytest.mark.parametrize("vendor", VENDORS)
def test_what_tune_prints(vendor):
    process = ["--gain", "-2", "--time-constant", "10", "--dead-time", "1", "--pv-range", "0", "200"]
    ultimate = ["--ultimate-gain", "8", "--ultimate-period", "4", "--pv-range", "0", "200"]
    assert run("output-tune", "--method", "zn-open", *process, "--for", vendor)["heating"] is False
    assert run("output-tune", "--method", "zn-closed", *ultimate, "--for", vendor)["for"]["action"] is None
    assert run("output-tune", "--method", "zn-open", "--form", "P", *process)["integral_time"] is None


def test_what_tune_prints_of_a_record(folder):
    rows = [f"{t},{50 if t < 10 else 60},{20 + (0 if t < 12 else 8 * (1 - 0.9 ** (t - 12))):.4f}" for t in range(120)]
    (folder / "step.csv").write_text("time,output,pv\n" + "\n".join(rows) + "\n", "utf-8")
    assert run("output-tune", "--method", "zn-open", "--from-csv", "step.csv")["identified"]["gain"] > 0


def test_what_rule_prints():
    assert len(run("output-rule")["rules"]) > 300
    assert run("output-rule", "DL24")["rules"]
    assert run("output-rule", "DL242")["code"] == "DL242"


def test_what_encode_prints_of_a_file_it_cannot_use(folder):
    assert run("output-encode", "bad.yaml", code=2)["findings"]


def test_what_validate_counts(folder):
    files = [str(ROOT / "examples/mistakes/oven.yaml"), "bad.yaml"]
    result = CliRunner().invoke(cli, ["validate", *files, "--statistics", "--format", "json"], catch_exceptions=False)
    document = json.loads(result.stdout)
    SCHEMAS["output-statistics"].validate(document)
    assert (document["summary"]["files"], bool(document["statistics"])) == (2, True)
    for key in ("version", "statistics", "summary"):
        assert not SCHEMAS["output-statistics"].is_valid({k: v for k, v in document.items() if k != key})
