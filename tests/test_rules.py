"""Every rule against its case files and in the catalog: findings on the marked lines and on no others."""

import importlib
import pkgutil
import re
import subprocess
import sys
from pathlib import Path

import pytest

import pidcfg
from case_messages import FOLDER, GOLDEN, lines, said_of
from pidcfg.text.diagnostics import Diagnostic, Severity, number_of
from pidcfg.text.reader import Limits
from pidcfg.text.references import Decision, Manual
from pidcfg.text.source import read_document
from pidcfg.validate import TABLE_FILE, list_texts, rule_texts, table_of, text_by_code
from pidcfg.validate.catalog import (
    CODE_PATTERN,
    COMMON_GROUP,
    FILE_GROUP,
    GROUPS,
    find_rules,
    group_of,
    is_ignorable,
    is_unusable,
    rule_of,
    suggest_code,
    text_of,
)
from pidcfg.validate.engine import check_document
from pidcfg.validate.rule import IGNORE_RULES, READING_RULES, SCHEMA_RULES, Rule
from pidcfg.validate.rules import collect_rules
from pidcfg.vendors import VENDORS
from shell import captured
from shell import pidcfg as command

CASES = sorted(FOLDER.glob("**/*.yaml"))
COMMITTED = GOLDEN.read_text("utf-8").splitlines()
"""What the rules said about the case files when their messages were read."""
MARK = re.compile(rf"\b(expect|ok): ({CODE_PATTERN.pattern}(?:, {CODE_PATTERN.pattern})*)")
NOT_TEXT = {
    "PID002": "loops: [ä]".encode("latin-1"),
    "PID003": b"pidcfg: 1\0",
    "PID013": b"[" * 100,
}
"""Files that cannot be written down as text, or would fill a screen."""
FROM_THE_COMMAND = {"PID040"}
"""A path that cannot be opened never reaches the reader; tests/test_cli.py has it."""

RULES = {code: rule for vendor in VENDORS.values() for code, rule in vendor.load("rules").items()}
"""The rules of all vendors; those for every vendor are in each vendor's table, and once here."""
EXPLAINED = [*READING_RULES, *SCHEMA_RULES, *IGNORE_RULES, *RULES.values()]


def check(text):
    """What the rules say of a text: its findings, and the lines that it gives the checklist."""
    checked = check_document(read_document(text if isinstance(text, bytes) else text.encode(), "case.yaml"))
    return (*checked.findings, *checked.to_check)


def marks(text, kind):
    """Pairs of line and code that the comments of one kind name."""
    return [
        (number, code)
        for number, line in enumerate(text.split("\n"), 1)
        if "#" in line
        for found, codes in MARK.findall(line.partition("#")[2])
        if found == kind
        for code in CODE_PATTERN.findall(codes)
    ]


def cases_of(code):
    return [case.read_text("utf-8") for case in CASES if case.stem.startswith(code)]


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.stem)
def test_findings_are_on_the_marked_lines_and_nowhere_else(case):
    text = case.read_text("utf-8")
    own = CODE_PATTERN.match(case.stem).group()
    found = [(d.span.line, d.code) for d in said_of(case) if d.severity > Severity.INFO or d.code == own]

    assert sorted(found) == sorted(marks(text, "expect"))
    assert not set(found) & set(marks(text, "ok"))


@pytest.mark.parametrize("rule", EXPLAINED, ids=lambda rule: rule.code)
def test_every_rule_is_explained_and_named_after_what_is_wrong(rule):
    assert rule.title.endswith(".")
    assert len(rule.title) < 120, "the first line of the documentation is one line"
    assert rule.doc_part("Why")
    assert rule.doc_part("Fix")
    assert re.fullmatch(r"[a-z0-9]+(-[a-z0-9]+)*", rule.name)
    assert not rule.name.startswith(("avoid-", "do-not-", "use-"))


@pytest.mark.parametrize("rule", RULES.values(), ids=lambda rule: rule.code)
def test_every_rule_has_a_failing_line_and_a_neighbour_that_passes(rule):
    texts = cases_of(rule.code)

    assert any(code == rule.code for text in texts for _, code in marks(text, "expect"))
    assert any(code == rule.code for text in texts for _, code in marks(text, "ok"))


@pytest.mark.parametrize("rule", [*READING_RULES, *SCHEMA_RULES], ids=lambda rule: rule.code)
def test_every_code_of_reading_and_schema_has_a_case(rule):
    if rule.code in NOT_TEXT:
        assert [d.code for d in check(NOT_TEXT[rule.code])] == [rule.code]
    elif rule.code not in FROM_THE_COMMAND:
        assert any(code == rule.code for text in cases_of(rule.code) for _, code in marks(text, "expect"))


def test_codes_are_unique():
    rules = {
        *READING_RULES,
        *SCHEMA_RULES,
        *IGNORE_RULES,
        *(rule for vendor in VENDORS.values() for rule in vendor.load("rules").values()),
    }

    assert len({rule.code for rule in rules}) == len(rules)


@pytest.mark.parametrize("vendor", VENDORS.values(), ids=lambda vendor: vendor.key)
def test_a_vendor_names_every_rule_differently(vendor):
    rules = [*READING_RULES, *SCHEMA_RULES, *vendor.load("rules").values()]

    assert len({rule.name for rule in rules}) == len(rules)


@pytest.mark.parametrize(("group", "least"), [("DL", 45), ("CK", 60)], ids=["dl06", "click"])
def test_a_vendor_has_rules_for_everything_its_manual_warns_of(group, least):
    assert sum(code.startswith(group) for code in RULES) >= least


@pytest.mark.parametrize("rule", EXPLAINED, ids=lambda rule: rule.code)
def test_every_rule_rests_on_a_place_in_the_manual_or_a_decision(rule):
    assert isinstance(rule.basis, Decision) or isinstance(rule.basis.manual, Manual)


def test_no_two_decisions_share_a_number():
    decisions = {rule.basis for rule in EXPLAINED if isinstance(rule.basis, Decision)}

    assert len({decision.number for decision in decisions}) == len(decisions)


@pytest.mark.parametrize("rule", RULES.values(), ids=lambda rule: rule.code)
def test_messages_quote_their_values_and_end_without_a_full_stop(rule):
    found = [d for case in CASES if case.stem.startswith(rule.code) for d in said_of(case) if d.code == rule.code]

    assert found
    for finding in found:
        assert "{" not in finding.message
        assert "None" not in finding.message
        assert not finding.message.endswith(".")
        assert len(finding.message) < 240, "one line of a CI log"
        assert finding.help
        assert finding.reference


@pytest.mark.parametrize("case", sorted(FOLDER.glob("*.yaml")), ids=lambda case: case.stem)
def test_messages_places_and_effects_are_those_that_were_read_and_committed(case):
    assert lines(case) == [line for line in COMMITTED if line.startswith(f"{case.name}:")]


def test_no_message_of_a_case_that_is_gone_is_kept():
    assert {line.partition(":")[0] for line in COMMITTED} <= {case.name for case in CASES}


def test_an_order_that_the_plc_refuses_names_the_status_word_of_its_loop():
    text = next(case for case in CASES if case.stem == "DL242").read_text("utf-8")
    effects = [d.plc_effect for d in check(text) if d.code == "DL242"]

    assert set(effects) == {"bit 10 of V2006 (alarm programming error): the loop stays in Manual"}


def test_a_second_loop_is_named_by_its_own_words():
    text = next(case for case in CASES if case.stem == "DL244").read_text("utf-8")
    first, third = (d for d in check(text) if d.code == "DL244")

    assert "V2020" in first.message
    assert "V2017" in first.message
    assert "bit 10 of V2106" in third.plc_effect


@pytest.mark.parametrize(("table", "bit"), [("V7541", 0), ("V17741", 1), ("V1177", 0)])
def test_a_ramp_soak_table_outside_user_memory_names_the_bit_of_its_error_word(table, bit):
    text = next(case for case in CASES if case.stem == "DL274").read_text("utf-8")
    line = next(n for n, line in enumerate(text.split("\n"), 1) if f"table: {table} " in line)
    effect = next(d.plc_effect for d in check(text) if d.code == "DL274" and d.span.line == line)

    assert re.match(rf"bit {bit} of V2(035|075|135) ", effect)


def test_the_reactor_has_no_error_and_only_the_warnings_that_it_deserves():
    text = (Path(__file__).parents[1] / "examples/dl06/reactor.yaml").read_text("utf-8")
    found = check(text)

    serious = [(d.code, d.loop) for d in found if d.severity > Severity.INFO]
    assert serious == [("DL222", "FIC-102"), ("DL211", "FIC-102"), ("DL211", "TIC-101"), ("DL211", "LIC-103")]
    assert {d.code for d in found if d.severity is Severity.INFO} == {"DL231", "DL295", "DL521"}


def test_the_start_of_auto_tuning_is_on_the_other_side_for_reverse_action():
    text = next(case for case in CASES if case.stem == "DL299").read_text("utf-8").replace("type: PI", "method: open")
    sides = [
        next(d.message for d in check(text.replace("action: direct", f"action: {action}")) if d.code == "DL299")
        for action in ("direct", "reverse")
    ]

    assert ["below the set point" in side for side in sides] == [True, False]
    assert ["above the set point" in side for side in sides] == [False, True]


@pytest.mark.parametrize("example", ["dl06/reactor", "click/tank", "ezlogix/oven"])
@pytest.mark.parametrize("extreme", ["0", "-1", "0.0001", "65536", "1e300", "-1e300", "1e-300", '"-3 counts"'])
def test_no_number_makes_a_rule_fail(extreme, example):
    text = (Path(__file__).parents[1] / f"examples/{example}.yaml").read_text("utf-8")
    for number in re.finditer(r"(?<=[ \[])\d+(\.\d+)?(?=[,}\] \n])", text):
        check(text[: number.start()] + extreme + text[number.end() :])


@pytest.mark.parametrize("sample_rate", ["0", "-1", "0.0001"])
def test_a_sample_rate_of_nothing_is_out_of_range_and_nothing_worse(sample_rate):
    text = next(case for case in CASES if case.stem == "DL246").read_text("utf-8")
    found = check(text.replace("sample_rate: 1\n", f"sample_rate: {sample_rate}\n"))

    assert "PID101" in {d.code for d in found}


def test_a_limit_of_the_reader_is_named():
    found = check_document(read_document(b"name: " + b"x" * 50, "case.yaml", Limits(scalar_bytes=10))).findings

    assert [(d.code, "10 bytes" in d.message) for d in found] == [("PID013", True)]


@pytest.mark.parametrize(
    ("example", "old", "new", "codes"),
    [
        ("click/tank", "sample_rate: 500 ms", "sample_rate: 99.6 ms", {"PID105"}),
        ("click/tank", "sample_rate: 500 ms", "sample_rate: 99.4 ms", {"PID101", "CK310"}),
        ("dl06/reactor", "gain: 1.20", "gain: 99.994", {"PID105"}),
        ("dl06/reactor", "gain: 1.20", "gain: 99.996", {"PID101"}),
        ("dl06/reactor", "sample_rate: 1.0", "sample_rate: 0.046", {"PID105"}),
        ("dl06/reactor", "sample_rate: 1.0", "sample_rate: 0.04", {"PID101"}),
    ],
)
def test_limits_are_those_of_what_the_register_holds(example, old, new, codes):
    text = (Path(__file__).parents[1] / "examples" / f"{example}.yaml").read_text("utf-8")
    assert old in text
    found = {d.code for d in pidcfg.check(text.replace(old, new)).findings}
    assert found & {"PID101", "PID105", "CK310"} == codes


@pytest.mark.parametrize(("unit", "short"), [("seconds", "s"), ("minutes", "min")])
def test_a_rounded_reset_is_told_in_the_unit_that_its_bit_selects(unit, short):
    text = next(case for case in CASES if case.stem == "PID105").read_text("utf-8")
    found = check(text.replace("{gain: 0.104}", f"{{gain: 1, reset: 0.26, reset_unit: {unit}}}"))

    assert f"reset 0.26 {short} is stored as 0.3 {short}, 15.4 % off" in [d.message for d in found]


# --- The catalog of rules: each code is in the group that it begins like, one rule loads no other vendor --------------


ROOT = Path(__file__).parents[1]


def test_every_vendor_has_a_group_and_no_two_groups_share_a_beginning():
    beginnings = list(GROUPS.values())

    assert {*GROUPS} == {FILE_GROUP, COMMON_GROUP, *VENDORS}
    assert not [(a, b) for a in beginnings for b in beginnings if a != b and a.startswith(b)]


@pytest.mark.parametrize("vendor", VENDORS.values(), ids=lambda vendor: vendor.key)
def test_the_rules_of_a_vendor_have_its_codes(vendor):
    codes = vendor.load("rules").keys() - collect_rules().keys()

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
    assert suggest_code(text) == cure


@pytest.mark.parametrize(
    "words",
    [("rule", "PID 242"), ("validate", "--select", "PID 242", "x"), ("validate", "--ignore", "DL 242", "x")],
)
def test_commands_name_the_code_that_was_meant(words):
    code, shown, _ = captured(command, list(words))
    assert code == 2
    assert "did you mean DL242?" in " ".join(shown.split())


def test_no_two_rules_have_one_number():
    numbers = [number_of(code) for code in find_rules()]
    assert len(numbers) == len({*numbers})


def test_every_rule_is_found_by_its_code():
    table = find_rules()

    assert list(table) == sorted(table, key=number_of)
    assert all(CODE_PATTERN.fullmatch(code) and rule_of(code) is rule for code, rule in table.items())
    assert len(table) == len(collect_rules()) + sum(
        len(find_rules(beginning)) for group, beginning in GROUPS.items() if group != COMMON_GROUP
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
    found = find_rules(begin)

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

    assert set(run.stdout.split()) <= {vendor}


def test_only_errors_of_a_file_itself_and_names_that_stand_twice_cannot_be_ignored():
    fixed = {rule.code for rule in find_rules().values() if not rule.is_ignorable} - {"PID106"}

    assert {group_of(code) for code in fixed} == {FILE_GROUP}
    assert all(rule.is_ignorable == (rule.severity is not Severity.ERROR) for rule in find_rules("PID0").values())


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
    assert is_ignorable(Diagnostic(code, severity, "", "")) is may


def test_a_text_that_cannot_be_read_is_unusable_and_nothing_else():
    found = {code for code in find_rules() if is_unusable(Diagnostic(code, Severity.ERROR, "", ""))}

    assert found == {rule.code for rule in READING_RULES} | {"PID041", "PID066"}


@pytest.mark.parametrize("vendor", VENDORS)
def test_every_rule_of_a_vendor_is_in_its_list(vendor):
    listed = VENDORS[vendor].load("rules")
    package = importlib.import_module(f"pidcfg.validate.rules.{vendor}")
    topics = pkgutil.iter_modules(getattr(package, "__path__", ()), f"{package.__name__}.")
    for name in (package.__name__, *(topic.name for topic in topics)):
        rules_there = [value for value in vars(importlib.import_module(name)).values() if isinstance(value, Rule)]
        assert not [rule.code for rule in rules_there if rule.code not in listed], f"{name} is not collected"


def test_the_table_of_texts_is_that_of_the_rules():
    told = {code: text_of(rule) for code, rule in find_rules().items()}
    assert rule_texts() == told, "python tasks.py generate pages"
    assert TABLE_FILE.read_text("utf-8") == table_of(list(told.values()))
    assert [text_by_code(code) for code in told] == [*told.values()]
    assert text_by_code("DL2") is text_by_code("") is text_by_code('DL242", "') is None


@pytest.mark.parametrize("begin", ["", "P", "PID", "PID1", "DL", "DL24", "NX690", "X", "DL2422"])
def test_texts_are_listed_by_the_beginnings_that_rules_have(begin):
    assert [*list_texts(begin)] == [*find_rules(begin)]
