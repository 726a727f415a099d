"""Codes from before every vendor had a prefix: understood wherever a person wrote them, with one remark a run."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from command import run_text
from pidcfg.cli.formats.findings import Findings, fingerprints
from pidcfg.text.diagnostics import Diagnostic, Severity
from pidcfg.text.source import read_document
from pidcfg.validate.baseline import former_codes
from pidcfg.validate.catalog import CODE, current, former, matches, rules
from pidcfg.validate.fixes import splice
from pidcfg.vendors import VENDORS

REMARK = re.compile(r"^(\S+) is called (\S+) now: .* understood until 1\.0$", re.MULTILINE)
OVEN = """\
pidcfg: 1
vendor: dl06
plc: {loop_table: V2000, reset_decimals: 1}
loops:
  - name: OVEN
    sample_rate: 2
    action: direct
    bias_freeze: true
    tuning: {gain: 2.5, reset: 8}
    pv: {range: [0, 400], unit: degC}
    alarms: {pv: {low_low: 15, low: 15, high: 300, high_high: 350}, hysteresis: 2}COMMENT
"""
PREFIXES = {"2": "DL", "3": "CK", "4": "EZ", "5": "DL", "6": "NX", "7": "DP", "8": "GN"}


def run(folder, *arguments):
    return run_text(*arguments, cwd=folder)


def oven(folder, comment=""):
    (folder / "oven.yaml").write_text(OVEN.replace("COMMENT", comment and f"  # {comment}"), "utf-8")


def test_every_rule_has_the_prefix_of_its_vendor_and_kept_its_number():
    for code in rules():
        old = former(code)
        assert CODE.fullmatch(code)
        if old[3] in PREFIXES:
            assert current(old) == code, f"{code}: a number that begins with {old[3]} is for {PREFIXES[old[3]]}"
    assert len({former(code) for code in rules()}) == len(rules())


@pytest.mark.parametrize("key", VENDORS)
def test_a_bare_prefix_is_one_vendor(key):
    prefix = VENDORS[key].prefix
    assert set(rules(prefix)) == {code for code in rules() if code[:2] == prefix}
    assert rules(prefix)


@pytest.mark.parametrize("begin", ["", "P", "PI", "PID"])
def test_the_prefix_that_all_codes_had_means_all_of_them(begin):
    assert list(rules(begin)) == list(rules())
    assert all(matches(code, begin) for code in rules())


@pytest.mark.parametrize(
    ("old", "new"),
    [("PID2", "DL2"), ("PID24", "DL24"), ("PID501", "DL501"), ("PID8", "GN8"), ("PID1", "PID1"), ("PID", "PID")],
)
def test_beginnings_are_understood_too(old, new):
    assert current(old) == new


@pytest.mark.parametrize(("old", "new"), [("PID24", "DL24"), ("pid242", "DL242")])
@pytest.mark.parametrize("option", ["--select", "--ignore"])
def test_options(tmp_path, option, old, new):
    oven(tmp_path)
    before, after = (run(tmp_path, "validate", "oven.yaml", option, name, "--format", "json") for name in (old, new))
    assert (before.stdout, before.returncode) == (after.stdout, after.returncode)
    assert REMARK.findall(before.stderr) == [(old.upper(), new)]
    assert not REMARK.search(after.stderr)


def test_one_remark_a_run_and_none_when_quiet(tmp_path):
    oven(tmp_path, "pidcfg: ignore[PID242] known")
    options = ("validate", "oven.yaml", "--select", "PID2,PID3", "--ignore", "PID254", "--strict")
    loud, quiet = run(tmp_path, *options), run(tmp_path, *options, "-q")
    assert len(REMARK.findall(loud.stderr)) == 1
    assert not REMARK.search(quiet.stderr)
    assert loud.returncode == quiet.returncode == 0


def test_comments(tmp_path):
    for code, remarks in (("PID242", [("PID242", "DL242")]), ("DL242", [])):
        oven(tmp_path, f"pidcfg: ignore[{code}] known")
        result = run(tmp_path, "validate", "oven.yaml", "--strict")
        assert "1 ignored" in result.stdout + result.stderr
        assert result.returncode == 0, result.stdout
        assert REMARK.findall(result.stderr) == remarks


def test_fix_writes_them_as_they_are_called_now_and_nothing_else(tmp_path):
    oven(tmp_path, "pidcfg: ignore[ pid242,PID254 ] known")
    before = (tmp_path / "oven.yaml").read_text("utf-8")
    shown = run(tmp_path, "validate", "oven.yaml", "--diff", "--ignore", "PID043")
    assert shown.returncode == 0
    assert (tmp_path / "oven.yaml").read_text("utf-8") == before
    assert run(tmp_path, "validate", "oven.yaml", "--fix", "--ignore", "PID043").returncode == 0
    expected = before.replace("[ pid242,PID254 ]", "[ DL242,DL254 ]")
    assert (tmp_path / "oven.yaml").read_text("utf-8") == expected
    assert "+    alarms" in shown.stdout


def test_fix_leaves_text_that_only_looks_like_a_comment(tmp_path):
    text = OVEN.replace("COMMENT", "").replace(
        "name: OVEN", "name: OVEN\n    description: '# pidcfg: ignore[PID242] text'"
    )
    (tmp_path / "oven.yaml").write_text(text, "utf-8")
    run(tmp_path, "validate", "oven.yaml", "--fix")
    assert (tmp_path / "oven.yaml").read_text("utf-8") == text


@pytest.mark.parametrize(
    "comment",
    [
        "heater # pidcfg: ignore[PID242] r",
        "pidcfg: ignore[PID599] r",
        "pidcfg: ignore[PID24] r",
        "pidcfg: ignore[PID242 PID211] r",
    ],
)
def test_fix_leaves_what_ignores_nothing(tmp_path, comment):
    oven(tmp_path, comment)
    before = (tmp_path / "oven.yaml").read_text("utf-8")
    run(tmp_path, "validate", "oven.yaml", "--fix", "--ignore", "PID04")
    assert (tmp_path / "oven.yaml").read_text("utf-8") == before


def test_fix_leaves_files_that_cannot_be_used_and_codes_that_were_not_chosen(tmp_path):
    oven(tmp_path, "pidcfg: ignore[PID242] r")
    before = (tmp_path / "oven.yaml").read_text("utf-8")
    run(tmp_path, "validate", "oven.yaml", "--fix", "--select", "PID0")
    assert (tmp_path / "oven.yaml").read_text("utf-8") == before
    (tmp_path / "oven.yaml").write_text(before + "vendor: dl06\n", "utf-8")
    run(tmp_path, "validate", "oven.yaml", "--fix")
    assert (tmp_path / "oven.yaml").read_text("utf-8") == before + "vendor: dl06\n"


def test_a_patch_of_old_codes_alone_fails_nothing(tmp_path):
    oven(tmp_path, "pidcfg: ignore[PID242] known")
    shown = run(tmp_path, "validate", "oven.yaml", "--diff")
    assert "DL242" in shown.stdout
    assert shown.returncode == 0
    assert "0 findings in 0 files" in shown.stderr


def test_settings(tmp_path):
    oven(tmp_path)
    (tmp_path / "pidcfg.toml").write_text("[per-file-ignores]\n'*.yaml' = ['PID242']\n", "utf-8")
    result = run(tmp_path, "validate", "oven.yaml")
    assert result.returncode == 0
    assert REMARK.findall(result.stderr) == [("PID242", "DL242")]


def test_baselines_of_the_first_format(tmp_path):
    oven(tmp_path)
    message = "low is 15 degC (154 counts) in V2014, not above low_low, 15 degC (154 counts) in V2013"
    row = {
        "code": "PID242",
        "severity": "error",
        "file": "oven.yaml",
        "path": "loops[OVEN].alarms.pv.low",
        "message": message,
    }
    (tmp_path / "known.json").write_text(json.dumps({"version": 1, "findings": [row]}), "utf-8")
    result = run(tmp_path, "validate", "oven.yaml", "--baseline", "known.json", "--select", "DL242", "--strict")
    assert (result.returncode, result.stdout) == (0, "")
    assert "1 entry of a former format renewed" in result.stderr
    assert '"DL242"' in (tmp_path / "known.json").read_text("utf-8")


@pytest.mark.parametrize("command", ["rule", "explain"])
def test_pages_of_old_codes_are_those_of_the_new_ones(tmp_path, command):
    before, after = run(tmp_path, command, "PID242"), run(tmp_path, command, "DL242")
    assert before.stdout == after.stdout
    assert before.returncode == after.returncode == 0
    assert "DL242" in after.stdout
    assert REMARK.findall(before.stderr) == [("PID242", "DL242")]


def test_old_links_lead_to_the_new_places():
    page = Path(__file__).parents[1].joinpath("docs", "rules.md").read_text("utf-8")
    for code in rules():
        assert f'<a id="{former(code).lower()}"></a>' in page
        assert f'<a id="{code.lower()}"></a>' in page
    pages = "".join(path.read_text("utf-8") for path in Path(__file__).parents[1].glob("docs/rules-*.md"))
    for code, rule in rules().items():
        if former(code) != code:
            assert f'<a id="{former(code).lower()}-{rule.name}-{rule.severity.label}"></a>' in pages


OLD_FINGERPRINTS = ["0572e7b2b34955fa737a49338e112cb4", "e42d8c78db529e454cb4cec4889e80f3"]
"""What version 0.1.0 gives for these two findings."""


def test_fingerprints_are_those_of_the_old_codes():
    found = [
        Diagnostic("DL242", Severity.ERROR, "low is 15 degC", "oven.yaml", path=("loops", 0), loop="OVEN"),
        Diagnostic("PID043", Severity.WARNING, "DL242: no such finding on this line", "oven.yaml"),
    ]
    findings = Findings(found, {})
    assert fingerprints(findings) == OLD_FINGERPRINTS


def test_the_edit_of_a_former_code_writes_that_code_alone():
    text = OVEN.replace("COMMENT", "  # pidcfg: ignore[DL254, PID242] why")
    found = list(former_codes(read_document(text.encode(), "oven.yaml")))

    assert [code for code, _ in found] == ["PID242"]
    assert splice(text, [edit for _, edit in found]) == text.replace("PID242", "DL242")
