"""The catalog of rules: every code is in the group that it begins like, and looking one up imports no other vendor."""

import importlib
import pkgutil
import subprocess
import sys
from pathlib import Path

import pytest

from pidcfg.text.diagnostics import Diagnostic, Severity, number_of
from pidcfg.validate.catalog import (
    CODE,
    COMMON,
    FILES,
    GROUPS,
    group_of,
    ignorable,
    rule_of,
    rules,
    suggestion,
    text_of,
    unusable,
)
from pidcfg.validate.rule import READING, Rule
from pidcfg.validate.rules import collect, common
from pidcfg.validate.texts import TABLE, listed, table_of, text_by_code, texts
from pidcfg.vendors import VENDORS
from shell import captured, pidcfg

ROOT = Path(__file__).parents[1]


def test_every_vendor_has_a_group_and_no_two_groups_share_a_beginning():
    beginnings = list(GROUPS.values())

    assert {*GROUPS} == {FILES, COMMON, *VENDORS}
    assert not [(a, b) for a in beginnings for b in beginnings if a != b and a.startswith(b)]


@pytest.mark.parametrize("vendor", VENDORS.values(), ids=lambda vendor: vendor.key)
def test_the_rules_of_a_vendor_have_its_codes(vendor):
    codes = vendor.load("rules").keys() - collect(common).keys()

    assert codes
    assert {group_of(code) for code in codes} == {vendor.key}


@pytest.mark.parametrize(
    ("text", "cure"),
    [
        ("PID 242", "did you mean DL242?"),
        ("PID2999", "did you mean DL299?"),
        ("DL-242", "did you mean DL242?"),
        ("DL2420", "did you mean DL242?"),
        ("242", "did you mean DL242?"),
        ("CL301", "did you mean CK301?"),
        ("DL24x", "did you mean DL24?"),
        ("PID24x", "did you mean DL24?"),
        ("DL2O2", "did you mean DL202?"),
        ("pv-alarms-out-of-order", "did you mean DL242?"),
        ("PID9", "'pidcfg rule' lists all"),
        ("", "'pidcfg rule' lists all"),
        ("hello", "'pidcfg rule' lists all"),
    ],
)
def test_a_code_that_no_rule_has_is_told_the_one_that_was_meant(text, cure):
    assert suggestion(text) == cure


@pytest.mark.parametrize(
    "words",
    [("rule", "PID 242"), ("validate", "--select", "PID 242", "x"), ("validate", "--ignore", "DL 242", "x")],
)
def test_commands_name_the_code_that_was_meant(words):
    code, shown, _ = captured(pidcfg, list(words))
    assert code == 2
    assert "did you mean DL242?" in " ".join(shown.split())


def test_no_two_rules_have_one_number():
    numbers = [number_of(code) for code in rules()]
    assert len(numbers) == len({*numbers})


def test_every_rule_is_found_by_its_code():
    table = rules()

    assert list(table) == sorted(table, key=number_of)
    assert all(CODE.fullmatch(code) and rule_of(code) is rule for code, rule in table.items())
    assert len(table) == len(collect(common)) + sum(
        len(rules(beginning)) for group, beginning in GROUPS.items() if group != COMMON
    )


@pytest.mark.parametrize(
    ("begin", "least", "groups"),
    [
        ("", 400, set(GROUPS)),
        ("PID", 400, set(GROUPS)),
        ("DL24", 10, {"dl06"}),
        ("CK314", 1, {"click"}),
        ("PID3140", 0, set()),
        ("PID9", 0, set()),
        ("high", 0, set()),
    ],
)
def test_rules_are_listed_by_the_beginning_of_their_codes(begin, least, groups):
    found = rules(begin)

    assert len(found) >= least
    assert {group_of(code) for code in found} == groups


@pytest.mark.parametrize("code", ["PID999", "PID9", "", "D46"])
def test_what_is_no_code_has_no_rule(code):
    with pytest.raises(KeyError):
        rule_of(code)


@pytest.mark.parametrize(("code", "vendor"), [("CK314", "click"), ("PID001", None), ("PID101", None)])
def test_looking_up_a_rule_imports_the_rules_of_its_vendor_alone(code, vendor):
    program = f"""
import sys
from pidcfg.validate.catalog import rule_of
assert rule_of({code!r}).code == {code!r}
print(*sorted({{name.split(".")[3] for name in sys.modules if name.startswith("pidcfg.validate.rules.")}}))
"""
    run = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True)

    assert set(run.stdout.split()) <= {"common", vendor}


def test_only_errors_of_a_file_itself_and_names_that_stand_twice_cannot_be_ignored():
    fixed = {rule.code for rule in rules().values() if not rule.ignorable} - {"PID106"}

    assert {group_of(code) for code in fixed} == {FILES}
    assert all(rule.ignorable == (rule.severity is not Severity.ERROR) for rule in rules("PID0").values())


@pytest.mark.parametrize(
    ("code", "severity", "may"),
    [
        ("PID020", Severity.ERROR, False),
        ("PID020", Severity.WARNING, True),
        ("PID054", Severity.WARNING, True),
        ("DL242", Severity.ERROR, True),
    ],
)
def test_a_finding_may_be_ignored_unless_its_rule_forbids_it_and_it_is_an_error(code, severity, may):
    assert ignorable(Diagnostic(code, severity, "", "")) is may


def test_a_text_that_cannot_be_read_is_unusable_and_nothing_else():
    found = {code for code in rules() if unusable(Diagnostic(code, Severity.ERROR, "", ""))}

    assert found == {rule.code for rule in READING} | {"PID041", "PID066"}


@pytest.mark.parametrize("vendor", VENDORS)
def test_every_rule_of_a_vendor_is_in_its_list(vendor):
    listed = VENDORS[vendor].load("rules")
    package = importlib.import_module(f"pidcfg.validate.rules.{vendor}")
    topics = pkgutil.iter_modules(getattr(package, "__path__", ()), f"{package.__name__}.")
    for name in (package.__name__, *(topic.name for topic in topics)):
        rules_there = [value for value in vars(importlib.import_module(name)).values() if isinstance(value, Rule)]
        assert not [rule.code for rule in rules_there if rule.code not in listed], f"{name} is not collected"


def test_the_table_of_texts_is_that_of_the_rules():
    told = {code: text_of(rule) for code, rule in rules().items()}
    assert texts() == told, "python tasks.py generate pages"
    assert TABLE.read_text("utf-8") == table_of(list(told.values()))
    assert [text_by_code(code) for code in told] == [*told.values()]
    assert text_by_code("DL2") is text_by_code("") is text_by_code('DL242", "') is None


@pytest.mark.parametrize("begin", ["", "P", "PID", "PID1", "DL", "DL24", "NX690", "X", "DL2422"])
def test_texts_are_listed_by_the_beginnings_that_rules_have(begin):
    assert [*listed(begin)] == [*rules(begin)]
