"""Templates: values come to every loop that uses one, and everything that is said points at where they are written."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner
from ruamel.yaml import YAML

import pidcfg
from pidcfg.cli.commands.schema import document_schema
from pidcfg.cli.main import cli
from pidcfg.text import document as templates
from pidcfg.text.diagnostics import Diagnostic
from pidcfg.text.reader import Limits
from pidcfg.text.source import read_document
from pidcfg.validate.engine import check_document
from pidcfg.vendors import VENDORS

TEXT = """pidcfg: 1
vendor: dl06
plc: {loop_table: V2000, reset_decimals: 1}
templates:
  zone:
    sample_rate: 2
    action: direct
    bias_freeze: true
    tuning: {gain: 4, reset: 150, rate: 20}
    pv: {range: [0, 400], unit: degC}
    setpoint: {value: 180, limits: [20, 350]}
  die:
    use: zone
    tuning: {gain: 5}
loops:
  - {name: Z1, use: zone}
  - name: Z2
    use: zone
    setpoint: {value: 190}
  - {name: DIE, use: die, setpoint: {limits: [0, 300]}}
  - {name: P, sample_rate: 1, action: direct, tuning: {gain: 1, reset: 8}, pv: {range: [0, 4]}, bias_freeze: true}
"""
LINES = TEXT.split("\n")


def line_of(text):
    return next(i for i, line in enumerate(LINES, start=1) if text in line)


def check(text, limits=None):
    return check_document(read_document(text.encode(), "t.yaml", *([limits] if limits else [])))


def errors(text):
    return [(d.code, d.span.line, d.message) for d in check(text).findings if d.severity.label == "error"]


def test_values_are_joined_key_by_key_and_lists_are_replaced():
    z1, z2, die, pump = check(TEXT).config.loops
    assert [float(loop.tuning.gain) for loop in (z1, z2, die, pump)] == [4, 4, 5, 1]
    assert [str(loop.tuning.reset) for loop in (z1, die)] == [str(z2.tuning.reset)] * 2
    assert [float(loop.setpoint.value.value) for loop in (z1, z2, die)] == [180, 190, 180]
    assert [float(end.value) for end in die.setpoint.limits] == [0, 300]
    assert [float(end.value) for end in z2.setpoint.limits] == [20, 350]


def test_a_file_with_templates_encodes_as_its_plain_form():
    plain = CliRunner().invoke(cli, ["export", "-"], input=TEXT).stdout
    assert "use:" not in plain
    assert "templates:" not in plain
    assert pidcfg.encode(TEXT).text.split("\n")[3:] == pidcfg.encode(plain).text.split("\n")[3:]
    assert pidcfg.diff(TEXT, plain).same


def test_findings_point_at_the_template_and_name_each_loop():
    found = [d for d in check(TEXT.replace("gain: 4", "gain: 100")).findings if d.code == "PID101"]
    assert [(d.loop, d.span.line, d.span.column, d.where) for d in found] == [
        ("Z1", line_of("gain: 4"), 20, "loops[0].tuning.gain"),
        ("Z2", line_of("gain: 4"), 20, "loops[1].tuning.gain"),
    ]


def test_findings_of_a_nested_template_and_of_an_override_point_at_theirs():
    nested = [d for d in check(TEXT.replace("gain: 5", "gain: 100")).findings if d.code == "PID101"]
    assert [(d.loop, d.span.line) for d in nested] == [("DIE", line_of("gain: 5"))]
    own = errors(TEXT.replace("value: 190", "value: abc"))
    assert [(code, line) for code, line, _ in own] == [("PID022", line_of("value: 190"))]


def test_a_missing_key_is_missed_in_the_loop():
    text = TEXT.replace("    sample_rate: 2\n", "")
    assert {(code, line) for code, line, _ in errors(text)} == {("PID021", line - 1) for line in (16, 17, 20)}


@pytest.mark.parametrize(
    ("old", "new", "code", "line", "message"),
    [
        ("use: zone}", "use: zon}", "PID015", 16, "there is no template zon"),
        ("use: zone}", "use: [zone]}", "PID015", 16, "use names one template"),
        ("    use: zone\n    tuning", "    use: die\n    tuning", "PID015", 13, "uses itself: die uses die"),
        ("  zone:\n", "  zone:\n    use: die\n", "PID015", 14, "itself: zone uses die uses zone"),
        ("  die:\n", "  die:\n    name: D\n", "PID016", 13, "has a name"),
        ("  die:\n    use: zone\n    tuning: {gain: 5}\n", "  die: 5\n", "PID016", 12, "is no loop"),
        ("limits: [0, 300]", "limits: 300", "PID016", 20, "a list at limits"),
        ("  - {name: P", "templates: {}\nloops:\n  - {name: P", "PID004", 21, "stands here again"),
    ],
)
def test_what_templates_cannot_be(old, new, code, line, message):
    assert old in TEXT
    found = errors(TEXT.replace(old, new, 1))
    assert (code, line) in {(c, at) for c, at, _ in found}, found
    assert any(message in text for _, _, text in found)


def test_templates_that_are_no_mapping():
    head, _, tail = TEXT.partition("templates:\n")
    loops = tail[tail.index("loops:") :]
    assert errors(f"{head}templates: [1]\n{loops}")[0][:2] == ("PID016", 4)
    assert errors(f"{head}templates:\n{loops}")[0][:2] == ("PID016", 4)


def test_use_without_templates_says_what_to_write():
    text = TEXT[: TEXT.index("templates:")] + TEXT[TEXT.index("loops:") :]
    (found, *_) = check(text).findings
    assert (found.code, found.help) == ("PID015", "there is none: add 'templates:' above the loops")


def test_the_nearest_template_is_named():
    (found,) = (d for d in check(TEXT.replace("use: zone}", "use: zon}")).findings if d.code == "PID015")
    assert found.help == "did you mean zone?"


def test_an_unused_template_is_a_warning_and_stays_one():
    text = TEXT.replace("use: die,", "use: zone,")
    (found,) = (d for d in check(text).findings if d.code == "PID017")
    assert (found.severity.label, found.span.line, found.message) == ("warning", 12, "no loop uses the template die")
    assert check(text).config is not None


def test_every_unused_template_is_told():
    text = TEXT.replace("use: die,", "use: zone,").replace("  die:\n", "  spare: {bias_freeze: true}\n  die:\n")
    found = [d.message for d in check(text).findings if d.code == "PID017"]
    assert found == [f"no loop uses the template {name}" for name in ("spare", "die")]


def test_expanded_values_count_against_the_limit():
    many = TEXT + "".join(f"  - {{name: N{i}, use: zone}}\n" for i in range(20))
    found = check(many, Limits(nodes=300)).findings
    assert [d.code for d in found] == ["PID013"]
    assert check(many, Limits(nodes=2000)).config is not None


@pytest.fixture
def file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return Path("t.yaml")


def call(*words):
    return CliRunner().invoke(cli, list(words))


def test_fix_corrects_the_template_once(file):
    file.write_text(TEXT.replace("reset: 150", 'reset: "150"').replace("action: direct\n", "Action: direct\n"), "utf-8")
    result = call("validate", "t.yaml", "--fix")
    assert result.exit_code == 0, result.output
    assert file.read_text("utf-8") == TEXT


def test_fix_corrects_an_override(file):
    file.write_text(TEXT.replace("value: 190", 'value: "190"'), "utf-8")
    assert call("validate", "t.yaml", "--fix").exit_code == 0
    assert file.read_text("utf-8") == TEXT


def test_a_comment_in_the_template_ignores_for_all_its_loops(file):
    pv = "pv: {range: [0, 400], unit: degC}"
    filtered = TEXT.replace(pv, "pv: {range: [0, 400], unit: degC, filter: 0.5}")

    def found(text):
        file.write_text(text, "utf-8")
        findings = json.loads(call("validate", "t.yaml", "--format", "json").stdout)["findings"]
        return {d["loop"] for d in findings if d["code"] in {"DL273", "PID043"}}

    assert found(filtered) == {"Z1", "Z2", "DIE"}
    assert found(filtered.replace("filter: 0.5}", "filter: 0.5}  # pidcfg: ignore[DL273] seen")) == set()


def test_a_baseline_knows_findings_of_templates(file):
    file.write_text(TEXT.replace("gain: 4", "gain: 100"), "utf-8")
    assert call("validate", "t.yaml").exit_code == 1
    call("validate", "t.yaml", "--baseline", "b.json", "--create-baseline")
    assert call("validate", "t.yaml", "--baseline", "b.json").exit_code == 0
    file.write_text(TEXT.replace("gain: 4", "gain: 101"), "utf-8")
    assert call("validate", "t.yaml", "--baseline", "b.json").exit_code == 1


def test_convert_report_and_simulate_see_every_loop(file):
    file.write_text(TEXT, "utf-8")
    names = ["Z1", "Z2", "DIE", "P"]
    assert [loop.name for loop in check(pidcfg.convert(file, "generic").text).config.loops] == names
    assert list(pidcfg.simulate(file).report.loops) == names
    assert call("report", "t.yaml", "-o", "r.html").exit_code == 0
    assert all(name in Path("r.html").read_text("utf-8") for name in names)


def test_explain_names_the_line_of_the_template(file):
    file.write_text(TEXT, "utf-8")
    page = call("explain", "Z2.gain", "--config", "t.yaml").stdout
    assert f"t.yaml:{line_of('gain: 4')}:20" in page


@pytest.mark.parametrize("vendor", VENDORS)
def test_the_schema_takes_templates(vendor):
    validator = pytest.importorskip("jsonschema").Draft202012Validator
    schema = document_schema(vendor)
    validator.check_schema(schema)
    starter = Path(pidcfg.__file__).parent / VENDORS[vendor].starter
    data = YAML(typ="safe", pure=True).load(starter.read_text("utf-8"))
    loop = data["loops"][0]
    data["templates"] = {"all": {key: value for key, value in loop.items() if key not in {"name", "type"}}}
    data["loops"] = [{key: loop[key] for key in ("name", "type") if key in loop} | {"use": "all"}]
    valid = validator(schema)
    assert list(valid.iter_errors(data)) == []
    data["templates"]["all"]["nonsense"] = 1
    assert list(valid.iter_errors(data)) != []
    del data["templates"]["all"]["nonsense"]
    data["loops"][0]["use"] = 5
    assert list(valid.iter_errors(data)) != []
    del data["loops"][0]["use"]
    assert list(valid.iter_errors(data)) != []


def test_the_schema_wants_a_name_beside_use():
    data = YAML(typ="safe", pure=True).load(TEXT)
    valid = pytest.importorskip("jsonschema").Draft202012Validator(document_schema("dl06"))
    assert list(valid.iter_errors(data)) == []
    del data["loops"][0]["name"]
    assert [error.json_path for error in valid.iter_errors(data)] == ["$.loops[0]"]


def test_a_key_that_both_have_stands_in_the_loop():
    doc = check(TEXT).document
    assert doc.locate(("loops", 1, "setpoint"), key=True).line == line_of("value: 190")
    assert doc.locate(("loops", 1, "setpoint", "limits"), key=True).line == line_of("limits: [20, 350]")


def test_an_unknown_template_is_pointed_at_and_nothing_is_called_unused():
    found = check(TEXT.replace("use: die,", "use: dye,")).findings
    assert [(d.code, d.span.line, d.span.column) for d in found] == [("PID015", 20, 22)]


def test_values_of_templates_in_templates_count_too():
    many = TEXT + "".join(f"  - {{name: N{i}, use: die}}\n" for i in range(20))
    assert [d.code for d in check(many, Limits(nodes=330)).findings] == ["PID013"]


def test_explain_finds_tags_and_no_words_of_descriptions(file):
    file.write_text(TEXT.replace("name: P,", "name: P, description: Pump of Z9,"), "utf-8")
    assert "a loop of this configuration" in call("explain", "DIE", "--in", "t.yaml").stdout
    assert call("explain", "Z9", "--in", "t.yaml").exit_code != 0


HEAD = "pidcfg: 1\nvendor: dl06\nplc: {loop_table: V2000, reset_decimals: 1}\ntemplates:\n"
SOUND = "{sample_rate: 1, action: direct, tuning: {gain: 1, reset: 10}}"
WIDE = "  b:\n" + "".join(f"    k{i}: 1\n" for i in range(40))


def users(name, count):
    return "loops:\n" + "".join(f"  - {{name: L{i}, use: {name.format(i)}}}\n" for i in range(count))


@pytest.mark.parametrize(
    ("text", "line"),
    [
        (WIDE + users("b", 50), 56),
        (WIDE + "".join(f"  t{i}: {{use: b}}\n" for i in range(50)) + users("t{}", 50), 101),
        (WIDE + "".join(f"  t{i}: {{use: {f't{i - 1}' if i else 'b'}}}\n" for i in range(50)) + users("t49", 50), 55),
    ],
    ids=["loops", "templates", "a row of templates"],
)
def test_nothing_is_copied_beyond_the_limit(text, line, monkeypatch):
    copied = []
    merged = templates._Resolver._merge

    def counted(self, base, own, path):
        copied.append(base[1].size)
        return merged(self, base, own, path)

    monkeypatch.setattr(templates._Resolver, "_merge", counted)
    (found,) = check(HEAD + text, Limits(nodes=400)).findings
    assert (found.code, found.message) == ("PID013", "more than 400 values with those of templates")
    assert (found.span.line, sum(copied) <= 400) == (line, True)


def test_a_long_row_of_templates_is_used_as_far_as_the_limit_allows():
    row = "".join(f"  t{i}: {{use: t{i - 1}}}\n" for i in range(1, 2000))
    text = f"{HEAD}  t0: {SOUND}\n{row}{users('t1999', 2)}"
    assert [loop.tuning.gain for loop in check(text).config.loops] == [1, 1]
    (found,) = check(text, Limits(nodes=10_000)).findings
    assert (found.code, found.message) == ("PID013", "more than 10000 values with those of templates")


def test_a_long_ring_of_templates_is_one_short_error():
    ring = "".join(f"  t{i}: {{use: t{(i or 2000) - 1}}}\n" for i in range(2000))
    (found,) = check(HEAD + ring + users("t{}", 100)).findings
    shortened = "t0 uses t1999 uses t1998 uses t1997 uses … uses t2 uses t1 uses t0"
    assert (found.code, found.message) == ("PID015", f"a template uses itself: {shortened}")


def test_of_many_templates_some_are_named():
    many = "".join(f"  template{i}: {SOUND}\n" for i in range(600))
    found = check(HEAD + many + users("templat{}", 60)).findings
    assert len(found) == 60
    assert {d.code for d in found} == {"PID015"}
    named = ", ".join(f"template{i}" for i in range(50))
    assert {d.help for d in found} == {f"there are {named}, and 550 more"}


def test_many_templates_that_are_no_loops_are_each_told_once(monkeypatch):
    compared = []
    same = Diagnostic.__eq__
    monkeypatch.setattr(Diagnostic, "__eq__", lambda one, other: compared.append(one) or same(one, other))
    found = check(HEAD + "".join(f"  t{i}: 1\n" for i in range(300)) + users("t1", 3)).findings
    assert (len(found), len(compared) < 1000) == (300, True)
