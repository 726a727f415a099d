"""Findings and runs in every format, read by what reads them: schemas, an XML parser, GitHub's unescaping."""

from __future__ import annotations

import io
import json
import os
import re
import shutil
import sys
from functools import cache
from pathlib import Path, PureWindowsPath
from xml.etree import ElementTree as ET

import pytest
from click.testing import CliRunner

import golden
from pidcfg.cli import formats
from pidcfg.cli.console import echo_json, echo_xml
from pidcfg.cli.formats import Kind, report_options, reports, runs
from pidcfg.cli.formats import findings as basics
from pidcfg.cli.formats.findings import Findings
from pidcfg.cli.formats.runs import render_runs
from pidcfg.cli.main import cli
from pidcfg.output.findings import finding_data
from pidcfg.output.json_schemas import OUTPUT_SCHEMAS
from pidcfg.sim.judgement.report import STANDING_KINDS, Note, Report
from pidcfg.study.outcome import Outcome
from pidcfg.text.diagnostics import START, Diagnostic, Edit, Severity, Span, without_word
from pidcfg.text.document import Document, Node
from pidcfg.validate import catalog
from pidcfg.validate.catalog import GROUPS, find_rules
from verdict_formats import disagreements, shortened

ROOT = Path(__file__).parents[1]
DATA = Path(__file__).parent / "data"
MISTAKE = (ROOT / "examples" / "mistakes" / "oven.yaml").read_text("utf-8")
VALIDATE = formats.formats_of("validate")
MACHINE = [fmt for fmt in VALIDATE if formats.load_format(fmt).kind in {Kind.JSON, Kind.XML}]
AWKWARD = "my ovens/100 %, #2 ü.yaml"
NASTY = "50 %, a: b\r\nsecond :: line, with \x1b[31m <tag> & \x00 \ud800"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty folder that commands run in."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def oven(folder):
    """The file with mistakes."""
    (folder / "oven.yaml").write_text(MISTAKE, "utf-8")
    return folder / "oven.yaml"


def run(*args, **kwargs):
    """A command in this process."""
    return CliRunner().invoke(cli, args, catch_exceptions=False, **kwargs)


def diagnostic(**changes):
    """A finding."""
    values = {"code": "PID101", "severity": Severity.ERROR, "message": "too much", "file": "a.yaml"}
    values |= {"span": Span(3, 5, 3, 9), "path": ("loops", 0, "tuning", "gain"), "loop": "TIC-1"}
    return Diagnostic(**{**values, **changes})


def rendered(name, *found, files=(), fails=Severity.ERROR):
    """Findings in a format, and what a file or an encoded stream would hold of it."""
    documents = {file: Document(file, "", None, Node(None), ()) for file in files}
    return formats.render_findings(name, Findings(found, documents, fails)).encode("utf-8", "replace").decode()


@cache
def log_schema():
    """What a SARIF log is held to."""
    validator = pytest.importorskip("jsonschema").Draft202012Validator
    schema = json.loads((DATA / "sarif" / "sarif-2.1.0.json").read_text("utf-8"))
    return validator(schema, format_checker=validator.FORMAT_CHECKER)


def sarif(*found):
    """The only run of a log that is valid."""
    log = json.loads(rendered("sarif", *found))
    log_schema().validate(log)
    (only,) = log["runs"]
    return only


def artifact(file):
    """Where SARIF says that a finding is."""
    return sarif(diagnostic(file=file))["results"][0]["locations"][0]["physicalLocation"]["artifactLocation"]


def github(line):
    """Severity, properties and message of a workflow command, read as GitHub's runner does."""
    head, _, message = line.removeprefix("::").partition("::")
    command, _, text = head.partition(" ")
    pairs = (pair.split("=", 1) for pair in text.split(","))
    back = (("%2C", ","), ("%3A", ":"), ("%0A", "\n"), ("%0D", "\r"), ("%25", "%"))
    properties = {}
    for key, value in pairs:
        for code, character in back:
            value = value.replace(code, character)  # noqa: PLW2901
        properties[key] = value
    for code, character in back[2:]:
        message = message.replace(code, character)
    return command, properties, message


# --- SARIF -----------------------------------------------------------------------------------------------------------


def test_sarif_is_valid_and_says_what_the_findings_say(oven):
    log = json.loads(run("validate", "oven.yaml", "--format", "sarif").stdout)
    log_schema().validate(log)
    (only,) = log["runs"]
    driver = only["tool"]["driver"]
    assert (driver["name"], only["columnKind"]) == ("pidcfg", "unicodeCodePoints")
    told = json.loads(run("validate", "oven.yaml", "--format", "json").stdout)["findings"]
    assert [r["ruleId"] for r in only["results"]] == [f["code"] for f in told]
    assert {r["ruleId"]: driver["rules"][r["ruleIndex"]]["id"] for r in only["results"]} == {
        f["code"]: f["code"] for f in told
    }
    levels = {"error": "error", "warning": "warning", "info": "note"}
    for result, found in zip(only["results"], told, strict=True):
        place = result["locations"][0]["physicalLocation"]
        assert result["level"] == levels[found["severity"]]
        assert (place["region"]["startLine"], place["region"]["startColumn"]) == (found["line"], found["column"])
        assert place["artifactLocation"] == {"uri": "oven.yaml", "uriBaseId": "%SRCROOT%"}
        assert result["locations"][0]["logicalLocations"][0]["fullyQualifiedName"] == found["path"]
        assert found["help"] in result["message"]["text"]
    for rule in driver["rules"]:
        assert rule["help"]["markdown"].startswith(f"# {rule['id']} {rule['name']}")
        assert rule["shortDescription"]["text"] in rule["fullDescription"]["text"]


def test_the_sarif_schema_refuses_what_is_no_sarif():
    log = json.loads(rendered("sarif", diagnostic()))
    log["runs"][0]["results"][0]["locations"][0]["physicalLocation"]["region"]["startLine"] = 0
    assert not log_schema().is_valid(log)


def test_sarif_names_files_as_relative_uris(folder):
    assert artifact(AWKWARD) == {"uri": "my%20ovens/100%20%25%2C%20%232%20%C3%BC.yaml", "uriBaseId": "%SRCROOT%"}
    assert artifact(str(folder / "sub" / "x.yaml")) == {"uri": "sub/x.yaml", "uriBaseId": "%SRCROOT%"}
    assert artifact("sub/../x.yaml") == {"uri": "x.yaml", "uriBaseId": "%SRCROOT%"}
    assert artifact("a:b.yaml")["uri"] == "a%3Ab.yaml", "no scheme"


def test_sarif_names_files_outside_as_they_were_given(folder):
    assert artifact("../other/x y.yaml") == {"uri": "../other/x%20y.yaml"}
    outside = (folder.parent / "other dir" / "x.yaml").as_posix()
    assert artifact(outside) == {"uri": Path(outside).as_uri()}
    assert "other%20dir" in artifact(outside)["uri"]


def test_standard_input_is_no_file_of_the_checkout(folder):
    result = run("validate", "-", "--format", "sarif", input=MISTAKE)
    log = json.loads(result.stdout)
    log_schema().validate(log)
    place = log["runs"][0]["results"][0]["locations"][0]["physicalLocation"]["artifactLocation"]
    assert place == {"uri": "stdin", "description": {"text": "standard input"}}
    command, properties, message = github(run("validate", "-", "--format", "github", input=MISTAKE).stdout)
    assert (command, set(properties)) == ("error", {"title"})
    assert message.startswith("<stdin>:5:19: the loop table")
    assert (
        json.loads(run("validate", "-", "--format", "gitlab", input=MISTAKE).stdout)[0]["location"]["path"] == "stdin"
    )


def test_a_file_that_a_link_leads_to_keeps_its_name(folder):
    (folder / "real").mkdir()
    (folder / "link").symlink_to(folder / "real")
    assert artifact("link/x.yaml")["uri"] == "link/x.yaml"


def test_a_finding_about_a_whole_file_has_no_columns():
    place = sarif(Diagnostic("PID040", Severity.ERROR, "gone", "gone.yaml"))["results"][0]["locations"][0]
    assert place["physicalLocation"]["region"] == {"startLine": 1}
    assert "logicalLocations" not in place


def test_sarif_carries_fixes():
    edit = Edit(Span(3, 5, 3, 9), "102")
    start = Edit(Span(1, 1, 1, 1), "pidcfg: 1\n")
    fixed, plain = sarif(diagnostic(edits=(edit, start), help="write 102"), diagnostic(message="other"))["results"]
    (fix,) = fixed["fixes"]
    (change,) = fix["artifactChanges"]
    assert fix["description"]["text"] == "write 102"
    assert change["artifactLocation"] == {"uri": "a.yaml", "uriBaseId": "%SRCROOT%"}
    assert [r["insertedContent"]["text"] for r in change["replacements"]] == ["102", "pidcfg: 1\n"]
    regions = [tuple(r["deletedRegion"].values()) for r in change["replacements"]]
    assert regions == [(3, 5, 3, 9), (1, 1, 1, 1)]
    assert "fixes" not in plain


# --- names and fingerprints ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("variable", basics.CHECKOUT_VARIABLES)
def test_names_are_relative_to_the_checkout_that_ci_names(folder, monkeypatch, variable):
    (folder / "loops").mkdir()
    monkeypatch.chdir(folder / "loops")
    assert basics.display_name("x.yaml") == "x.yaml"
    monkeypatch.setenv(variable, str(folder))
    assert basics.display_name("x.yaml") == "loops/x.yaml"
    monkeypatch.setenv(variable, str(folder / "elsewhere"))
    assert basics.display_name("x.yaml") == "x.yaml", "we do not run inside of it"


def test_a_file_name_that_no_system_takes_is_shown_as_it_is():
    assert basics.display_name("a\0b") in {"a\0b", "/a\0b"}
    assert basics.path_in_checkout(f"/{chr(0)}") is None


def test_fingerprints_stay_when_lines_and_loops_are_inserted_above(oven):
    def prints():
        log = json.loads(run("validate", "oven.yaml", "--format", "sarif").stdout)
        return {r["ruleId"]: r["partialFingerprints"]["pidcfgFinding/v1"] for r in log["runs"][0]["results"]}

    before = prints()
    oven.write_text("# one\n# two\n" + MISTAKE, "utf-8")
    assert prints() == before
    loop = MISTAKE[MISTAKE.index("  - name") :].replace("TIC-101", "TIC-100")
    oven.write_text(MISTAKE.replace("loops:\n", f"loops:\n{loop}"), "utf-8")
    assert prints()["DL201"] == before["DL201"]
    log = json.loads(run("validate", "oven.yaml", "--format", "sarif").stdout)
    own = [r for r in log["runs"][0]["results"] if r["ruleId"] == "DL242"]
    assert own[1]["partialFingerprints"]["pidcfgFinding/v1"] == before["DL242"], "the loop is told by its name"
    oven.write_text(MISTAKE.replace("low: 15,", "low: 14,"), "utf-8")
    assert prints()["DL242"] != before["DL242"], "another wrong value is another finding"
    oven.write_text(MISTAKE.replace("V7350", "V7351"), "utf-8")
    assert prints()["DL201"] != before["DL201"], "an address too"


def prints_of(*found):
    """Fingerprints of findings in a file that nothing is known of."""
    return basics.fingerprints(Findings(found, {}))


def test_equal_findings_have_fingerprints_of_their_own():
    again = "the key 'a' stands here again; it was first given in line {}"
    found = [diagnostic(message=again.format(n), span=Span(n + 1, 1, n + 1, 2)) for n in (4, 9)]
    first, second = prints_of(*found)
    assert first != second
    assert prints_of(diagnostic(message=again.format(5))) == [first], "line numbers do not count"
    rows = json.loads(rendered("gitlab", *found))
    assert [row["fingerprint"] for row in rows] == [first, second]


def test_what_a_failed_expectation_measured_is_not_its_fingerprint():
    failed = [diagnostic(code="PID061", message=f"expected: x; measured: {n}") for n in (1, 2)]
    assert prints_of(failed[0]) == prints_of(failed[1])


@pytest.mark.skipif(os.name != "nt", reason="a backslash is part of a name except on Windows")
def test_backslashes_of_windows(oven):  # pragma: no cover
    (oven.parent / "sub").mkdir()
    oven.rename(oven.parent / "sub" / "oven.yaml")
    for fmt in VALIDATE:
        assert "sub/oven.yaml" in run("validate", "sub\\oven.yaml", "--format", fmt).stdout


def test_names_with_forward_slashes_are_what_windows_paths_become():
    assert PureWindowsPath("sub\\oven.yaml").as_posix() == "sub/oven.yaml"
    assert artifact(PureWindowsPath("sub\\oven.yaml").as_posix())["uri"] == "sub/oven.yaml"


# --- one line, GitHub, GitLab ----------------------------------------------------------------------------------------


def test_concise_is_one_line_a_finding():
    warning = diagnostic(severity=Severity.WARNING, loop=None)
    lines = rendered("concise", diagnostic(), warning, diagnostic(message=NASTY)).splitlines()
    assert lines[:2] == ["a.yaml:3:5: error PID101 too much [TIC-1]", "a.yaml:3:5: warning PID101 too much"]
    assert len(lines) == 3
    assert "\x1b" not in lines[2]
    assert "\x00" not in lines[2]


def test_github_commands_are_read_back_as_they_were(folder):
    found = diagnostic(message="50 %, a: b\nsecond :: line", file=AWKWARD, help="100 %25\r\ncure")
    text = rendered("github", found)
    assert text.count("\n") == 1
    command, properties, message = github(text.rstrip("\n"))
    assert command == "error"
    assert properties == {
        "file": AWKWARD,
        "line": "3",
        "endLine": "3",
        "col": "5",
        "title": "pidcfg PID101 [TIC-1]",
    }
    assert message == "50 %, a: b\nsecond :: line [TIC-1]\ncure: 100 %25\r\ncure"


def test_github_severities_and_places():
    commands = [github(rendered("github", diagnostic(severity=s)))[0] for s in Severity]
    assert commands == ["notice", "warning", "error"]
    _, properties, _ = github(rendered("github", diagnostic(span=Span(3, 5, 4, 2))))
    assert (properties["line"], properties["endLine"], "col" in properties) == ("3", "4", False)


def test_no_control_character_reaches_a_log():
    for name in ("github", "concise"):
        assert not {"\x1b", "\x00"} & set(rendered(name, diagnostic(message=NASTY)))


def test_gitlab_issues(folder):
    found = [diagnostic(severity=s, file=AWKWARD, message=f"{s}") for s in Severity]
    rows = json.loads(rendered("gitlab", *found))
    assert [row["severity"] for row in rows] == ["info", "minor", "major"]
    assert rows[0]["location"] == {"path": AWKWARD, "lines": {"begin": 3, "end": 3}}
    (absolute,) = json.loads(rendered("gitlab", diagnostic(file=str(folder / "sub" / "x.yaml"))))
    assert absolute["location"]["path"] == "sub/x.yaml"
    assert set(rows[0]) == {"description", "check_name", "fingerprint", "severity", "location"}
    assert len({row["fingerprint"] for row in rows}) == 3


# --- reviewdog --------------------------------------------------------------------------------------------------------


def rdjson(*found, **texts):
    """The diagnostics of reviewdog's format, of files with these texts."""
    documents = {file: Document(file, text, None, Node(None), ()) for file, text in texts.items()}
    (source, rows) = json.loads(formats.render_findings("rdjson", Findings(found, documents))).values()
    assert source == {"name": "pidcfg"}
    return rows


def test_reviewdog_gets_places_in_bytes_of_utf_8():
    text = "name: Öl 🔥 heiß\n"
    value = diagnostic(file="a", span=Span(1, 7, 1, 16), edits=(Edit(Span(1, 10, 1, 11), "x"),))
    (row,) = rdjson(value, a=text)
    assert row["location"]["range"] == {"start": {"line": 1, "column": 7}, "end": {"line": 1, "column": 21}}
    assert text.encode()[7 - 1 : 21 - 1].decode() == "Öl 🔥 heiß"
    (suggestion,) = row["suggestions"]
    at = {end: suggestion["range"][end]["column"] - 1 for end in ("start", "end")}
    assert text.encode()[at["start"] : at["end"]].decode() == "🔥"
    assert suggestion["text"] == "x"


def test_reviewdog_gets_what_a_finding_says():
    found = [diagnostic(severity=severity) for severity in Severity]
    assert [row["severity"] for row in rdjson(*found)] == ["INFO", "WARNING", "ERROR"]
    (row,) = rdjson(diagnostic(file=AWKWARD, span=START, help="less"))
    assert row == {
        "message": "too much [TIC-1]\ncure: less",
        "location": {"path": AWKWARD, "range": {"start": {"line": 1}}},
        "severity": "ERROR",
        "code": {"value": "PID101"},
    }
    assert rdjson(diagnostic(file="<stdin>"))[0]["location"]["path"] == "stdin"
    both = (Edit(Span(3, 5, 3, 9), "a"), Edit(Span(4, 1, 4, 2), "b"))
    assert "suggestions" not in rdjson(diagnostic(edits=both))[0], "each suggestion is applied by itself"


@pytest.mark.parametrize("code", [next(iter(find_rules(begin))) for begin in GROUPS.values()])
def test_a_finding_names_the_page_of_its_rule(code, monkeypatch):
    page, _, heading = finding_data(diagnostic(code=code))["url"].partition("#")
    text = (ROOT / "docs" / page.replace(".html", ".md")).read_text("utf-8")
    anchors = {
        re.sub("[^a-z0-9 -]", "", line.lower()).strip().replace(" ", "-") for line in re.findall("## (.+)", text)
    }
    assert heading in anchors
    assert "url" not in rdjson(diagnostic(code=code))[0]["code"]
    monkeypatch.setattr(catalog, "SITE", "https://example.org/pidcfg/")
    assert finding_data(diagnostic(code=code))["url"] == f"https://example.org/pidcfg/{page}#{heading}"
    assert rdjson(diagnostic(code=code))[0]["code"]["url"] == f"https://example.org/pidcfg/{page}#{heading}"


# --- JUnit -----------------------------------------------------------------------------------------------------------


def suites(text):
    """The suites as junitparser reads them."""
    return {suite.name: list(suite) for suite in pytest.importorskip("junitparser").JUnitXml.fromstring(text.encode())}


def test_junit_compares_no_finding_with_the_others(monkeypatch):
    found = [diagnostic(message=f"{n}", severity=severity) for n in range(4) for severity in Severity]
    monkeypatch.setattr(Diagnostic, "__eq__", lambda *_: pytest.fail("the time grows with their square"))
    (case,) = ET.fromstring(rendered("junit", *found)).iter("testcase")  # noqa: S314 - our own
    assert [len(case.findall("failure")), case.find("system-out").text.count("PID101")] == [4, 8]


def test_junit_has_a_case_a_rule_and_file_and_one_for_a_file_without_findings():
    found = [
        diagnostic(),
        diagnostic(message="also too much"),
        diagnostic(code="DL220", severity=Severity.WARNING),
        diagnostic(code="PID001", file="b.yaml"),
    ]
    text = rendered("junit", *found, files=["a.yaml", "b.yaml", "c.yaml"])
    found = suites(text)
    assert list(found) == ["a.yaml", "b.yaml", "c.yaml"]
    error, warning = found["a.yaml"]
    assert error.name == "PID101 value-out-of-range"
    assert [type(result).__name__ for result in error.result] == ["Failure"] * 2
    assert error.result[0].message == "3:5: too much"
    assert error.result[0].type == "error PID101"
    assert warning.is_passed
    assert "a.yaml:3:5: warning DL220: too much [TIC-1]" in warning.system_out
    (unusable,) = found["b.yaml"]
    assert [type(result).__name__ for result in unusable.result] == ["Error"]
    (clean,) = found["c.yaml"]
    assert (clean.name, clean.classname, clean.is_passed) == ("no findings", "c.yaml", True)
    root = ET.fromstring(text)  # noqa: S314
    assert root.attrib == {"name": "pidcfg validate", "tests": "4", "failures": "1", "errors": "1"}


def test_warnings_fail_their_case_when_they_fail_the_run(oven):
    text = MISTAKE.replace("V7350", "V7001").replace("low: 15, high", "low: 20, high")
    extra = text[text.index("  - name") :]
    oven.write_text(text + "".join(extra.replace("TIC-101", f"TIC-{n}") for n in range(102, 109)), "utf-8")
    assert json.loads(run("validate", "oven.yaml", "--format", "json").stdout)["summary"]["warnings"] == 1, "DL206"
    for strict, code in (((), 0), (("--strict",), 1)):
        result = run("validate", "oven.yaml", "--format", "junit", *strict)
        root = ET.fromstring(result.stdout)  # noqa: S314
        assert (result.exit_code, bool(int(root.get("failures")))) == (code, bool(code))


def test_junit_is_xml_whatever_a_message_holds(folder):
    (suite,) = suites(rendered("junit", diagnostic(message=NASTY, file=AWKWARD))).values()
    (case,) = suite
    assert case.classname == AWKWARD
    assert case.result[0].message == "3:5: 50 %, a: b\r\nsecond :: line, with [31m <tag> &  "
    assert "second :: line, with [31m <tag> &" in case.result[0].text


# --- the command -----------------------------------------------------------------------------------------------------

READERS = {Kind.JSON: json.loads, Kind.XML: ET.fromstring, Kind.PLAIN: str, Kind.LINES: str, Kind.CI_COMMANDS: str}
READ = {
    **{fmt: READERS[formats.load_format(fmt).kind] for fmt in VALIDATE},
    "sarif": lambda text: log_schema().validate(json.loads(text)),
    "junit": suites,
}
"""What reads each format, and complains of what is none."""


@pytest.mark.parametrize("fmt", MACHINE)
def test_standard_output_is_one_document_even_if_nothing_can_be_read(folder, fmt):
    (folder / "bad.yaml").write_bytes(b"pidcfg: 1\nvendor: [\n")
    (folder / "binary.yaml").write_bytes(b"pidcfg: 1\n\xff\x00")
    (folder / "fine.yaml").write_text((ROOT / "examples/dl06/reactor.yaml").read_text("utf-8"), "utf-8")
    result = run("validate", "none.yaml", "bad.yaml", "binary.yaml", "fine.yaml", "--format", fmt)
    assert result.exit_code == 2
    READ[fmt](result.stdout)
    for name in ("none.yaml", "bad.yaml", "binary.yaml"):
        assert name in result.stdout
    assert result.stderr.startswith("3 files checked: "), "the totals, and nothing else"
    assert result.stderr.count("\n") == 1
    quiet = run("validate", "none.yaml", "bad.yaml", "binary.yaml", "fine.yaml", "--format", fmt, "--quiet")
    assert quiet.stdout == result.stdout


@pytest.mark.parametrize("fmt", VALIDATE)
def test_quiet_says_nothing_of_files_that_are_fine(folder, fmt):
    (folder / "a.yaml").write_text((ROOT / "examples/dl06/flow.yaml").read_text("utf-8"), "utf-8")
    result = run("validate", "a.yaml", "-q", "--format", fmt, "--severity", "error")
    assert (result.exit_code, result.stderr) == (0, "")
    assert result.stdout == rendered(fmt, files=["a.yaml"])


def test_totals_follow_formats_for_people(oven):
    for fmt in sorted({*VALIDATE} - {*MACHINE}):
        assert run("validate", "oven.yaml", "--format", fmt).stderr.startswith("1 file checked: 2 errors")


@pytest.mark.parametrize("fmt", VALIDATE)
def test_names_that_need_care(folder, fmt):
    path = folder / AWKWARD
    path.parent.mkdir()
    path.write_text(MISTAKE, "utf-8")
    result = run("validate", "my ovens", "--format", fmt)
    assert result.exit_code == 1
    READ[fmt](result.stdout)
    names = {"sarif": "my%20ovens/100%20%25%2C%20%232%20%C3%BC.yaml", "github": "my ovens/100 %25%2C #2 ü.yaml"}
    assert names.get(fmt, AWKWARD) in result.stdout


def test_github_is_the_format_in_github_actions_unless_another_is_named(oven, monkeypatch):
    assert run("validate", "oven.yaml").stdout.startswith("oven.yaml:5:19: error")
    monkeypatch.setenv("GITHUB_ACTIONS", "true")
    assert run("validate", "oven.yaml").stdout.startswith("::error file=oven.yaml,line=5")
    assert run("validate", "oven.yaml", "--format", "text").stdout.startswith("oven.yaml:5:19: error")
    monkeypatch.setenv("GITHUB_ACTIONS", "false")
    assert run("validate", "oven.yaml").stdout.startswith("oven.yaml:5:19: error")


def test_further_formats_go_to_files_beside_what_is_printed(oven, folder):
    options = [f"--output={fmt}={fmt}.out" for fmt in VALIDATE]
    result = run("validate", "oven.yaml", *options)
    assert result.exit_code == 1
    assert result.stdout == run("validate", "oven.yaml").stdout
    for fmt in VALIDATE:
        printed = run("validate", "oven.yaml", "--format", fmt).stdout
        assert (folder / f"{fmt}.out").read_text("utf-8") == printed, fmt


def test_reports_are_written_anew_on_every_run_and_for_unusable_input(oven, folder):
    (folder / "r.xml").write_text("of the last run", "utf-8")
    assert run("validate", "none.yaml", "--output", "junit=r.xml").exit_code == 2
    assert "PID040" in (folder / "r.xml").read_text("utf-8")
    assert run("validate", "oven.yaml", "--output", "junit=r.xml").exit_code == 1
    assert "PID040" not in (folder / "r.xml").read_text("utf-8")


BAD_REPORTS = {
    "pdf=x": "'pdf=x'; write FORMAT=PATH with one of " + ", ".join(VALIDATE),
    "x.json": "write FORMAT=PATH",
    "json=": "names no file; --format json prints",
    "json=-": "names no file; --format json prints",
    "json=none/x.json": "the folder none of none/x.json does not exist; make it first",
    "json=sub": "sub is a folder; name a file",
    "json=other.yaml": "other.yaml exists and may be a configuration; give the report another name",
}


@pytest.mark.parametrize("option", BAD_REPORTS)
def test_reports_that_cannot_be_written_are_refused_before_anything_runs(oven, folder, option):
    (folder / "sub").mkdir()
    (folder / "other.yaml").write_text("mine", "utf-8")
    before = sorted(path.name for path in folder.iterdir())
    result = run("validate", "oven.yaml", "--output", "text=ok.txt", "--output", option)
    assert (result.exit_code, result.stdout) == (2, "")
    assert BAD_REPORTS[option] in " ".join(result.stderr.split())
    assert sorted(path.name for path in folder.iterdir()) == before
    assert (folder / "other.yaml").read_text("utf-8") == "mine"


def test_two_reports_need_two_files(oven, folder):
    result = run("validate", "oven.yaml", "--output", "json=a.json", "--output", "sarif=./a.json")
    assert (result.exit_code, result.stdout) == (2, "")
    assert "a.json and ./a.json are one file; name two" in result.stderr
    assert not (folder / "a.json").exists()


@pytest.mark.parametrize("name", ["plain", "./plain", "link"])
def test_a_report_never_takes_the_place_of_an_input(folder, name):
    (folder / "plain").write_text(MISTAKE, "utf-8")
    (folder / "link").symlink_to("plain")
    result = run("validate", "plain", "--output", f"json={name}")
    assert (result.exit_code, result.stdout) == (2, "")
    assert "is a file that is read; give the report another name" in result.stderr
    assert (folder / "plain").read_text("utf-8") == MISTAKE


def test_a_file_that_cannot_be_written_leaves_none_and_the_result_is_printed(oven, folder, monkeypatch):
    real = Path.replace

    def broken(self, target):
        if Path(target).name == "b.json":
            raise OSError(28, "No space left on device")
        return real(self, target)

    monkeypatch.setattr(Path, "replace", broken)
    result = run("validate", "oven.yaml", "--output", "json=b.json", "--output", "sarif=c.sarif")
    assert result.exit_code != 0
    assert "cannot write b.json: No space left on device" in result.stderr
    assert result.stdout.startswith("oven.yaml:5:19: error")
    assert sorted(path.name for path in folder.iterdir()) == ["oven.yaml"]


def test_a_name_that_is_no_utf8_can_be_reported(folder):
    found = diagnostic(file="a\udcff.yaml")
    report_options.write_reports(
        tuple(report_options.Report(fmt, fmt) for fmt in VALIDATE),
        lambda fmt: formats.render_findings(fmt, Findings([found], {})),
    )
    for fmt in VALIDATE:
        text = (folder / fmt).read_text("utf-8")
        READ[fmt](text)
    assert "a%FF.yaml" in (folder / "sarif").read_text("utf-8")


DECLARATION = '<?xml version="1.0" encoding="UTF-8"?>'


@pytest.mark.parametrize("value", ["ü", "ü ✓"])
@pytest.mark.parametrize("encoding", ["cp1252", "cp437", "ascii", "utf-8"])
def test_machine_formats_are_utf8_on_every_code_page(monkeypatch, encoding, value):
    """A code page has an ü, but in a byte that no reader of JSON or of this XML would take for one."""
    for put, text in ((echo_json, f'{{"a": "{value}"}}\n'), (echo_xml, f"{DECLARATION}\n<a>{value}</a>\n")):
        stream = io.TextIOWrapper(io.BytesIO(), encoding)
        monkeypatch.setattr(sys, "stdout", stream)
        put(text)
        stream.flush()
        data = stream.buffer.getvalue().decode("utf-8")
        read = json.loads(data)["a"] if put is echo_json else ET.fromstring(data).text  # noqa: S314
        assert read == value


# --- simulate --------------------------------------------------------------------------------------------------------


@pytest.fixture
def failing(folder):
    """A run of which some expectations fail."""
    for name in ("fails.scenario.yaml", "flow.yaml"):
        (folder / name).write_bytes((DATA / "formats" / name).read_bytes())
    return folder / "fails.scenario.yaml"


def test_failed_expectations_are_findings_at_their_lines(failing):
    rows = failing.read_text("utf-8").splitlines()
    result = run("simulate", failing.name, "--format", "github")
    assert result.exit_code == 1
    told = [github(line) for line in result.stdout.splitlines()]
    assert [message.partition(" [")[0].partition("; measured")[0] for _, _, message in told] == [
        "expected: FIC-301 iae at most 5",
        "expected: FIC-301.PV 20 ± 1 at the end",
        "expected: V7642 is set",
        "saturated: FIC-301: ends at its upper output limit with an error of 48.99 m3/h, which was 49.2 from 17.5 s on",
        "not proven, not-settled: FIC-301: is 48.99 m3/h away from its set point, 15.05 s after what moved it last",
        (
            "not proven, no-better: FIC-301: no better than without control: the PV has not come 63 % of the way to "
            "its new set point after 15 s, later than 5 s (D912); where it may, expect a settling_time"
        ),
    ]
    assert told[3][1]["file"] == "flow.yaml"
    assert [rows[int(properties["line"]) - 1].strip(" -{").partition(",")[0] for _, properties, _ in told[:3]] == [
        "loop: FIC-301",
        "signal: FIC-301.PV",
        "flag: V7642",
    ]
    assert result.stderr == "fails.scenario.yaml: FAILED: 3 of 4 expectations, 1 of 11 always checked, 2 not proven\n"
    assert run("simulate", failing.name, "--format", "github", "-q").stderr == ""


def test_runs_in_the_formats_of_ci(failing, folder, monkeypatch):
    reports = ("sarif", "gitlab", "junit", "json", "text")
    monkeypatch.setenv("GITHUB_ACTIONS", "true")
    result = run("simulate", failing.name, *(f"--output={fmt}={fmt}.out" for fmt in reports))
    assert result.stdout.startswith("::error file=fails.scenario.yaml,line=15")
    text = {fmt: (folder / f"{fmt}.out").read_text("utf-8") for fmt in reports}
    log = json.loads(text["sarif"])
    log_schema().validate(log)
    assert [r["ruleId"] for r in log["runs"][0]["results"]] == ["PID061"] * 3 + ["PID063"] * 3
    assert log["runs"][0]["results"][1]["locations"][0]["logicalLocations"] == [
        {"name": "expect", "fullyQualifiedName": "expect[1]", "kind": "property"},
        {"name": "FIC-301", "kind": "object"},
    ]
    assert len(json.loads(text["gitlab"])) == 6
    assert json.loads(text["json"])["findings"] == [], "the layout of JSON stays"
    (cases,) = suites(text["junit"]).values()
    assert [(case.name, case.is_passed) for case in cases] == [
        ("the run is sound", True),
        ("FIC-301 iae at most 5", False),
        ("FIC-301.PV 20 ± 1 at the end", False),
        ("FIC-301 mode is auto at the end", True),
        ("V7642 is set", False),
        ("set-up-error", True),
        *((f"FIC-301 {kind}", kind not in {"saturated", "not-settled", "no-better"}) for kind in STANDING_KINDS),
    ]
    assert [case.result[0].type for case in cases if not case.is_passed][-3:] == ["failed", "not-proven", "not-proven"]
    assert text["text"].endswith("FAILED: 3 of 4 expectations, 1 of 11 always checked, 2 not proven\n")


@pytest.mark.parametrize("fmt", MACHINE)
def test_a_scenario_that_cannot_run_is_one_document_too(failing, fmt):
    failing.write_text(failing.read_text("utf-8").replace("config: flow.yaml", "config: none.yaml"), "utf-8")
    result = run("simulate", failing.name, "nowhere.yaml", "--format", fmt, "--quiet")
    assert result.exit_code == 2
    READ[fmt](result.stdout)
    if fmt == "junit":
        cases = [case for suite in suites(result.stdout).values() for case in suite]
        assert [type(case.result[0]).__name__ for case in cases] == ["Error"] * 2
    assert "none.yaml" in result.stdout
    assert "nowhere.yaml" in result.stdout


def outcome(**changes):
    """A run that nothing is expected of."""
    report = Report("title", 1.0, 1, 1.0, "python", {})
    document = Document("s.yaml", "", {}, Node(None), ())
    return Outcome(
        **{"file": "s.yaml", "config": "c.yaml", "report": report, "documents": {"s.yaml": document}} | changes
    )


def soundness(run_, fails=Severity.ERROR):
    """Whether the case that a run is sound passes."""
    ((case, *_),) = suites(render_runs("junit", [run_], fails)).values()
    return case.is_passed


def test_the_case_of_the_run_fails_as_the_run_does():
    scenario = diagnostic(file="s.yaml")
    config = diagnostic(file="c.yaml")
    warning = diagnostic(file="c.yaml", severity=Severity.WARNING)
    assert soundness(outcome())
    assert not soundness(outcome(findings=[scenario]))
    assert soundness(outcome(findings=[warning]))
    assert not soundness(outcome(findings=[warning]), Severity.WARNING)
    assert not soundness(outcome(findings=[config], config_errors=True)), "nothing is expected of it"
    assert soundness(outcome(findings=[config])), "the expectations judge it"
    noted = outcome()
    noted.report.notes.append(Note(3.5, None, "division by 0 in 'a / b'", error=True))
    assert not soundness(noted)
    (result,) = json.loads(render_runs("sarif", [noted]))["runs"][0]["results"]
    assert (result["ruleId"], result["message"]["text"]) == ("PID062", "at 3.5 s: division by 0 in 'a / b'")


def test_a_run_reports_to_files_of_its_own(failing, folder):
    (folder / "listing").write_text("x", "utf-8")
    failing.write_text(failing.read_text("utf-8").replace("config: flow.yaml", "config: listing"), "utf-8")
    result = run("simulate", failing.name, "--output", "json=listing")
    assert (result.exit_code, result.stdout) == (2, "")
    assert "listing is a file that is read" in result.stderr
    result = run("simulate", failing.name, "--csv", "t.csv", "--output", "json=t.csv")
    assert "t.csv is where the trend goes" in result.stderr
    assert not (folder / "t.csv").exists()


# --- diff and convert ------------------------------------------------------------------------------------------------


@pytest.fixture
def pair(folder):
    """Two DL06 files that differ."""
    text = (ROOT / "examples/dl06/flow.yaml").read_text("utf-8")
    (folder / "a.yaml").write_text(text, "utf-8")
    (folder / "b.yaml").write_text(text.replace("action: direct", "action: reverse"), "utf-8")
    return folder


def test_diff_reports_to_files(pair):
    options = [f"--output={fmt}={fmt}.out" for fmt in ("text", "json", "markdown")]
    result = run("diff", "a.yaml", "b.yaml", "--format", "markdown", *options)
    assert result.stdout.startswith("### PID loops: `a.yaml` → `b.yaml`")
    for fmt in ("text", "json", "markdown"):
        printed = run("diff", "a.yaml", "b.yaml", "--format", fmt).stdout
        assert (pair / f"{fmt}.out").read_text("utf-8") == printed
    (pair / "a").write_bytes((pair / "a.yaml").read_bytes())
    assert "is a file that is read" in run("diff", "a", "b.yaml", "--output", "text=a").stderr


def test_diff_prints_one_document_of_json_for_a_file_it_cannot_use(pair):
    (pair / "bad.yaml").write_text("pidcfg: [", "utf-8")
    result = run("diff", "a.yaml", "bad.yaml", "--format", "json")
    assert json.loads(result.stdout)["findings"][0]["file"] == "bad.yaml"


def test_convert_reports_to_files_also_when_nothing_is_written(pair):
    options = [f"--report-output={fmt}={fmt}.out" for fmt in ("text", "json", "markdown")]
    result = run("convert", "a.yaml", "--to", "click", "-o", "click.yaml", *options, "-v")
    assert result.exit_code == 1
    assert not (pair / "click.yaml").exists()
    markdown = (pair / "markdown.out").read_text("utf-8")
    assert markdown.startswith("### PID loops: dl06 to click\n\n**FIC-301**: 24 exact, 7 assumed, 4 dropped (")
    assert "| dropped | pv.square_root | true | - | take the root in the program" in markdown
    rows = markdown.splitlines()[6:]
    kinds = [row.split(" | ")[0].removeprefix("| ") for row in rows[: rows.index("")]]
    assert kinds == [*["dropped"] * 4, *["assumed"] * 7, *["exact"] * 3]
    assert json.loads((pair / "json.out").read_text("utf-8"))["to"] == "click"
    assert (pair / "text.out").read_text("utf-8").splitlines()[0] == "dl06 to click"
    assert result.stderr.startswith((pair / "text.out").read_text("utf-8").rstrip())
    result = run("convert", "a.yaml", "--to", "click", "-o", "click.yaml", "--allow-loss", "--verify", *options)
    assert result.exit_code == 0
    (seen,) = json.loads((pair / "json.out").read_text("utf-8"))["verify"]
    row = f"- **FIC-301**: alike in {len(seen['stages'])} stages; PV at most {seen['pv_percent']:.3g} % of its range"
    assert row in (pair / "markdown.out").read_text("utf-8")
    assert (pair / "click.yaml").exists()


def test_convert_writes_the_file_and_its_reports_or_neither(pair):
    (pair / "click.yaml").write_text("mine", "utf-8")
    result = run(
        "convert", "a.yaml", "--to", "click", "-o", "click.yaml", "--allow-loss", "--report-output=json=r.json"
    )
    assert "click.yaml exists and differs" in result.stderr
    assert not (pair / "r.json").exists()
    result = run("convert", "a.yaml", "--to", "click", "-o", "new", "--report-output", "json=new")
    assert (result.exit_code, "new is where the result goes" in result.stderr) == (2, True)


def test_convert_prints_one_document_of_json_for_a_file_it_cannot_use(pair):
    (pair / "bad.yaml").write_text("pidcfg: [", "utf-8")
    result = run("convert", "bad.yaml", "--to", "click", "-o", "x.yaml", "--report", "json")
    assert (result.exit_code, json.loads(result.stdout)["findings"][0]["code"]) == (2, "PID001")


# --- every format ----------------------------------------------------------------------------------------------------


def test_every_module_with_a_format_is_in_the_table():
    found = {
        name.lower() for name, value in {**vars(reports), **vars(runs)}.items() if isinstance(value, formats.Format)
    }
    assert found == set(formats.FORMATS)


def test_formats_may_share_an_ending_and_each_has_golden_files_of_its_own():
    names = [golden.report_name("validate", name) for name in formats.formats_of("validate")]
    assert len({*names}) == len(names)
    assert formats.load_format("gitlab").ending == formats.load_format("json").ending
    assert [golden.report_name("validate", name) for name in ("json", "gitlab")] == ["oven.json", "oven.gitlab.json"]


@pytest.mark.parametrize("fmt", formats.FORMATS)
def test_every_format_is_documented_and_its_golden_files_can_be_read(fmt):
    commands = ", ".join(f"`{command}`" for command in formats.FORMATS[fmt])
    assert f"| `{fmt}` | {formats.load_format(fmt).purpose} | {commands} |\n" in PAGE
    for command in {"validate", "simulate"} & {*formats.FORMATS[fmt]}:
        text = (golden.REPORTS / golden.report_name(command, fmt)).read_text("utf-8")
        assert text
        READ[fmt](text)


@pytest.mark.parametrize("command", ["validate", "simulate", "diff"])
def test_commands_offer_the_formats_of_the_table(command):
    for option in ("--format", "--output"):
        result = run(command, "x", option, "none=x" if option == "--output" else "none")
        assert ", ".join(formats.formats_of(command)) in re.sub(r"[\s']+", " ", result.stderr).replace(" ,", ",")


# --- the documentation -----------------------------------------------------------------------------------------------

PAGE = (ROOT / "docs" / "output-formats.md").read_text("utf-8")
RUNS = re.findall(r"```console\n\$ (pidcfg [^\n]*)\n", PAGE)


def test_the_page_names_every_format_and_schema():
    assert {line.split("--format ")[1].split()[0] for line in RUNS} >= {"concise", "sarif", "github", "gitlab", "junit"}
    for name in OUTPUT_SCHEMAS:
        assert f"[`pidcfg schema {name}`](schemas/{name}.schema.json)" in PAGE


@pytest.mark.parametrize(
    ("text", "word", "left"),
    [
        ("L1 is above L10 and L1", "L1", " is above L10 and "),
        ("xL1 L1_ éL1", "L1", "xL1 L1_ éL1"),
        ("(TIC-101): TIC-101", "TIC-101", "(): "),
        ("a-a-a a", "a-a", "-a a"),
    ],
)
def test_a_word_is_left_out_where_it_stands_alone(text, word, left):
    assert without_word(text, word) == left == re.sub(rf"(?<!\w){re.escape(word)}(?!\w)", "", text)


@pytest.mark.parametrize("name", ["dl06/extruder", "click/booster", "dpide/dyeing"])
@pytest.mark.parametrize("share", [1, 3])
def test_all_formats_say_the_same_of_a_run(tmp_path, name, share):
    shutil.copytree((ROOT / "examples" / name).parent, tmp_path / "runs")
    scenario = shortened(tmp_path / "runs" / f"{Path(name).name}.scenario.yaml", share)
    assert disagreements(scenario.parent, scenario.name, report=share > 1) in ([], None)
