"""The Structured Text that pidcfg writes, executed by an interpreter of its own beside the virtual PLC."""

from __future__ import annotations

import random
from functools import cache
from pathlib import Path

import pytest

from iec.machine import Block, Machine, Parameter, RunError, Surroundings
from iec.syntax import StError
from pidcfg.api import encode
from st_rig import EXAMPLES, example, replay, spoils, text_of_plcopen

# --- The interpreter: cases of IEC 61131-3 ----------------------------------------------------------------------------

COUNTED = Block(
    "Sum",
    (Parameter("A", "REAL", "input"), Parameter("Total", "REAL", "output", 0.0)),
    lambda cells: setattr(cells["TOTAL"], "value", cells["TOTAL"].value + cells["A"].value),
)
HALVES = Block(
    "Halve",
    (Parameter("X", "INT", "input"), Parameter("Low", "INT", "output"), Parameter("Odd", "BOOL", "output", False)),
    lambda cells: (
        setattr(cells["LOW"], "value", cells["X"].value // 2),
        setattr(cells["ODD"], "value", bool(cells["X"].value % 2)),
    ),
    function=True,
)
AROUND = Surroundings(
    {"Sum": COUNTED, "Halve": HALVES}, {"COLOR": ("RED", "GREEN")}, lambda name: "BOOL" if name == "SM400" else ""
)
VARIABLES = """
    r : REAL; s : REAL := 3.0; i : INT; j : INT := 7; d : DINT; b : BOOL; c : BOOL := TRUE; t : TIME := T#1m2s500ms;
    u : UINT := 4; k : COLOR := COLOR.GREEN; f : Sum := (A := 1.5); x AT D2 : REAL := 1.0; y AT D2 : REAL;
"""


def machine_of(body, variables=VARIABLES, before=""):
    return Machine(f"{before}\nPROGRAM P\nVAR {variables} END_VAR\n{body}\nEND_PROGRAM\n", AROUND)


@pytest.mark.parametrize(
    ("body", "name", "wanted"),
    [
        ("i := 2 + 3 * 4;", "I", 14),
        ("i := (2 + 3) * 4;", "I", 20),
        ("i := 20 - 5 - 3;", "I", 12),
        ("i := -7 / 2;", "I", -3),
        ("i := -7 MOD 3;", "I", -1),
        ("i := j MOD 0;", "I", 0),
        ("i := 16#1F + 2#101;", "I", 36),
        ("i := j / 2;", "I", 3),
        ("r := s / 2.0;", "R", 1.5),
        ("r := 0.1;", "R", 0.10000000149011612),
        ("r := 16777216.0 + 1.0;", "R", 16777216.0),
        ("r := s * 0.1;", "R", 0.30000001192092896),
        ("r := -2.0 ** 2.0;", "R", 4.0),
        ("r := REAL#2;", "R", 2.0),
        ("d := DINT#70000;", "D", 70000),
        ("r := 1.5E3;", "R", 1500.0),
        ("r := MIN(s, 2.0, 1.0) + MAX(s, 5.0);", "R", 6.0),
        ("r := LIMIT(0.0, s, 2.5);", "R", 2.5),
        ("r := SQRT(ABS(-s * s));", "R", 3.0),
        ("r := INT_TO_REAL(j) / 2.0;", "R", 3.5),
        ("i := REAL_TO_INT(2.5);", "I", 2),
        ("i := REAL_TO_INT(3.5);", "I", 4),
        ("i := REAL_TO_INT(-0.6);", "I", -1),
        ("r := TIME_TO_REAL(t) / 1000.0;", "R", 62.5),
        ("d := INT_TO_DINT(j) * 100000;", "D", 700000),
        ("u := (u + 1) MOD 5;", "U", 0),
        ("b := c OR c AND FALSE;", "B", True),
        ("b := c OR c XOR c;", "B", True),
        ("b := (c OR c) XOR c;", "B", False),
        ("b := NOT c = FALSE;", "B", True),
        ("b := s > 1.0 = c;", "B", True),
        ("b := 1.0 < s AND j <> 7;", "B", False),
        ("b := c & SM400;", "B", False),
        ("b := k = COLOR.GREEN;", "B", True),
        ("IF j > 9 THEN i := 1; ELSIF j > 5 THEN i := 2; ELSE i := 3; END_IF;", "I", 2),
        ("IF FALSE THEN i := 1; ELSE i := 3; END_IF;", "I", 3),
        ("f(); f(); r := f.Total;", "R", 3.0),
        ("f(A := 4.0); f(); r := f.Total;", "R", 8.0),
        ("f(A := 1.0, Total => r);", "R", 1.0),
        ("f(A := 1.0, EN := FALSE, Total => r);", "R", 0.0),
        ("f.A := 2.0; f(); r := f.Total;", "R", 2.0),
        ("Halve(X := j, Low => i, Odd => b);", "I", 3),
        ("Halve(X := j, Odd => b);", "B", True),
        ("Halve(j, i, b);", "I", 3),
        ("x := 5.0; r := y;", "R", 5.0),
        ("R := 1.0; r := r + 1.0; (* a (* b *) c *) // R := 7.0;", "R", 2.0),
    ],
)
def test_what_a_text_does(body, name, wanted):
    machine = machine_of(body)
    machine.run("P")
    assert machine.programs["P"].cells[name].value == wanted


OWN_BLOCK = """
VAR_GLOBAL CONSTANT
    Step : INT := 2;
END_VAR
FUNCTION_BLOCK Count
VAR_INPUT by : INT; END_VAR
VAR_IN_OUT total : INT; END_VAR
VAR_OUTPUT calls : INT; END_VAR
    total := total + by * Step;
    calls := calls + 1;
END_FUNCTION_BLOCK
"""


def test_a_block_of_the_text_keeps_its_values_and_changes_what_it_is_given():
    machine = machine_of("one(by := 3, total := i); one(total := i, calls => j); two(by := 1, total := i);",
                         "i, j : INT; one, two : Count;", OWN_BLOCK)  # fmt: skip
    machine.run("P")
    assert [machine.programs["P"].cells[name].value for name in ("I", "J")] == [14, 2]


@pytest.mark.parametrize(
    ("body", "message"),
    [
        ("r := 1;", "line 7: a whole number stands where REAL must stand"),
        ("r := j;", "INT stands where REAL must stand"),
        ("i := 1.0;", "a number with a point stands where INT must stand"),
        ("d := j;", "INT stands where DINT must stand"),
        ("b := 1;", "a whole number stands where BOOL must stand"),
        ("r := s + j;", "INT stands where REAL must stand"),
        ("b := j AND 1;", "AND has no meaning for INT"),
        ("r := s MOD 2.0;", "MOD has no meaning for REAL"),
        ("b := k = j;", "INT stands where COLOR must stand"),
        ("k := COLOR.BLUE;", "COLOR.BLUE is no word of COLOR"),
        ("IF j THEN i := 1; END_IF;", "INT stands where BOOL must stand"),
        ("IF FALSE THEN nothing := 1; END_IF;", "NOTHING is not declared"),
        ("f(B := 1.0);", "F takes no B here"),
        ("f(Total := 1.0);", "F takes no TOTAL here"),
        ("f(A := 1.0, A := 2.0);", "F takes no A here"),
        ("f(A := j);", "INT stands where REAL must stand"),
        ("f(Total => i);", "INT stands where REAL Total must stand"),
        ("Halve(X := j, Low => r);", "REAL stands where INT LOW must stand"),
        ("Halve(j, i);", "HALVE has 3 arguments, and not 2"),
        ("Sum(A := 1.0);", "SUM is neither an instance nor a function"),
        ("r := INT_TO_REAL(s);", "REAL stands where INT must stand"),
        ("r := LIMIT(s, 1.0);", "LIMIT has 3 arguments"),
        ("r := 1.0", "END_PROGRAM stands where ; must stand"),
        ("r := ;", "; stands where a value must stand"),
        ("WHILE c DO i := 1; END_WHILE;", "WHILE stands where a name must stand"),
        ("r := 1.0; (* open", "a comment without an end"),
        ("i := 40000;", "40000 is no INT"),
        ("i := INT#2.5;", "2.5 is no INT"),
        ("i := DINT#2;", "DINT stands where INT must stand"),
    ],
)
def test_what_is_refused_when_a_text_is_loaded(body, message):
    with pytest.raises((StError, RunError)) as caught:
        machine_of(body)
    assert message.lower() in str(caught.value).lower()


@pytest.mark.parametrize(
    ("variables", "message"),
    [
        ("a : REAL; A : INT;", "A is declared twice"),
        ("a : WORDS;", "WORDS is no type"),
        ("a : REAL := 5;", "a whole number stands where REAL must stand"),
        ("a : Sum := (Wrong := 1.0);", "WRONG has no value of its own"),
        ("a AT D1 : REAL; b AT D1 : INT;", "D1 is REAL elsewhere, and not INT"),
        ("a AT D1 : REAL := 1.0; b AT D1 : REAL := 2.0;", "D1 begins with 1.0 elsewhere"),
    ],
)
def test_what_is_refused_of_declarations(variables, message):
    with pytest.raises(StError, match=message):
        machine_of("", variables)


def test_a_constant_is_not_written():
    with pytest.raises(StError, match="STEP is a constant"):
        machine_of("Step := 3;", " i : INT; ", OWN_BLOCK)


@pytest.mark.parametrize(
    "body", ["i := j / i;", "r := s / r;", "i := j * 10000;", "i := REAL_TO_INT(s * 1.0E9);", "r := SQRT(-s);"]
)
def test_what_a_plc_has_no_result_for_ends_the_run(body):
    with pytest.raises(RunError):
        machine_of(body).run("P")


# --- The examples -----------------------------------------------------------------------------------------------------

SAMPLES = 2200
NAMES = [
    (vendor, path.name.partition(".")[0])
    for vendor in ("nextopid", "dpide")
    for path in sorted((EXAMPLES / vendor).glob("*.scenario.yaml"))
]


@cache
def recorded(vendor, name):
    return example(vendor, name, SAMPLES)


@pytest.mark.parametrize(("vendor", "name"), NAMES)
def test_the_text_of_an_example_does_what_the_virtual_plc_does(vendor, name):
    record = recorded(vendor, name)
    assert len(record.steps) > SAMPLES
    assert replay(record) is None


@pytest.mark.parametrize("name", [name for vendor, name in NAMES if vendor == "nextopid"])
def test_the_plcopen_document_of_an_example_does_the_same(name):
    document = encode(EXAMPLES / "nextopid" / f"{name}.yaml", "plcopen").text
    assert replay(recorded("nextopid", name), text_of_plcopen(document)) is None


def test_every_example_with_a_text_is_run():
    written = {(path.parent.name, path.stem) for v in ("nextopid", "dpide") for path in (EXAMPLES / v).glob("*.yaml")}
    assert {(vendor, name) for vendor, name in written if "." not in name} == set(NAMES)


def test_spoiled_statements_are_seen():
    rng = random.Random(20)
    drawn = []
    while len(drawn) < 20:
        vendor, name = rng.choice(NAMES)
        by_kind = {}
        for what, text in spoils(recorded(vendor, name).text):
            by_kind.setdefault(what.partition(",")[0], []).append((what, text))
        drawn.append((vendor, name, *rng.choice(by_kind[rng.choice(sorted(by_kind))])))
    unseen = [
        (vendor, name, what) for vendor, name, what, text in drawn if replay(recorded(vendor, name), text) is None
    ]
    assert len(unseen) <= 1, unseen


def test_the_interpreter_knows_nothing_of_pidcfg():
    modules = sorted((Path(__file__).parents[1] / "tools" / "iec").glob("*.py"))
    texts = [path.read_text("utf-8") for path in modules]
    assert not [
        line for text in texts for line in text.splitlines() if line.startswith(("import pidcfg", "from pidcfg"))
    ]
    assert sum(text.count("\n") for text in texts) <= 1500
