"""NextoPID's conditions, limits, names and notices."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nextopid_rig import GAINS, HEAD, findings, image_of, run
from pidcfg.api import check_text
from pidcfg.encoders.nextopid.files import FORMATS
from pidcfg.encoders.nextopid.image import decode, encode
from pidcfg.encoders.nextopid.st_read import read_st
from pidcfg.encoders.nextopid.st_scope import Wiring
from pidcfg.encoders.nextopid.st_write import PLAIN_DIALECT, print_expression, write_st
from pidcfg.encoders.structured_text import tokens_of
from pidcfg.schemas.expressions import ExpressionError, TypedParser, lengths_of
from pidcfg.schemas.iec import BOOL, INT, REAL, TIME
from pidcfg.schemas.nextopid import NextopidFile
from pidcfg.sim.controllers.nextopid.memory import value_of
from pidcfg.sim.controllers.nextopid.plc import REASONS
from pidcfg.sim.controllers.nextopid.terms import FALL_LIMITED, MV_HIGH, MV_LOW, RISE_LIMITED, State, accepted_increment

# --- Conditions in wires, signals of other types and wired AutoTuneParam: from the file to the program and the engine -

SIGNALS = "signals: {Man: false, Fault: true, Level: 3.0, Count: INT#7, Delay: 1500 ms, Long: T#1m30s}\n"
CONDITION_GAINS = "Kp: 1.0, Ti_Ki: 10.0, Td_Kd: 0.0, MinMV: 0.0, MaxMV: 100.0, MinPV: 0.0, MaxPV: 100.0"
TYPES = {"Man": BOOL, "Fault": BOOL, "Level": REAL, "Count": INT, "Delay": TIME, "Long": TIME}
NUMBERS = {name: i for i, name in enumerate(TYPES)}
KINDS = list(TYPES.values())


def loop(manual: str) -> str:
    block = f"{{name: A, type: PIDA_REAL, SP: 5, {CONDITION_GAINS}, PV: Level, Manual: {manual!r}}}"
    return f"{SIGNALS}loops:\n  - {block}\n"


def parsed(text: str) -> TypedParser:
    parser = TypedParser(text, NUMBERS, lengths_of(NUMBERS), types=KINDS.__getitem__)
    parser.read()
    return parser


def value(text: str, signals: list[float]) -> tuple[float, float]:
    """The value in the engine, and the fault."""
    parser = parsed(text)
    aux = [0.0, *(float(x) for x in with_constants(parser))]
    stack, code = len(aux), len(aux)
    aux[0] = float(stack)
    aux += [0.0] * (parser.max_stack_height + 2)
    found = value_of(aux, 1, code, signals)
    return found, aux[stack]


def with_constants(parser: TypedParser):
    """The code as the PLC's memory has it."""
    from pidcfg.schemas.expressions import Expression
    from pidcfg.sim.controllers.nextopid.memory import _expression_code

    return list(
        _expression_code(
            Expression("", tuple(parser.code), tuple(parser.constants), frozenset(), parser.max_stack_height)
        )
    )


@pytest.mark.parametrize(
    ("text", "holds"),
    [
        ("Man OR Fault", True),
        ("NOT Man", True),
        ("Level < 4.0", True),
        ("NOT Man AND Man", False),
        ("NOT (Man AND Man)", True),
        ("Man OR Fault AND Man", False),
        ("(Fault OR Man) AND Man", False),
        ("Fault OR Man AND Man", True),
        ("Fault XOR Fault OR Fault", True),
        ("Fault XOR Fault AND Man", True),
        ("NOT Man = Fault", True),
        ("Man = FALSE", True),
        ("Man <> Fault", True),
        ("Level + 1 = 4", True),
        ("Level >= Count", False),
        ("Count = 7 AND Level <= 3", True),
        ("Delay > 1.4 AND Delay < 1.6", True),
        ("Long = 90", True),
        ("Level < Count = Fault", True),
        ("NOT NOT NOT Fault", False),
        ("TRUE AND not false", True),
        ("-Level < -2.5", True),
        ("min(Level, Count) * 2 > 5.9", True),
    ],
)
def test_conditions_mean_what_iec_61131_says(text, holds):
    signals = [0.0, 1.0, 3.0, 7.0, 1.5, 90.0]
    assert value(text, signals) == (float(holds), 0.0)


@pytest.mark.parametrize(
    ("sign", "holds"),
    [
        # where the left side is smaller, the same, larger
        ("<", (1, 0, 0)),
        ("<=", (1, 1, 0)),
        (">", (0, 0, 1)),
        (">=", (0, 1, 1)),
        ("=", (0, 1, 0)),
        ("<>", (1, 0, 1)),
    ],
)
def test_a_comparison_holds_on_its_side_and_where_both_are_the_same(sign, holds):
    found = [value(f"Level {sign} Count", [0.0, 1.0, level, 7.0, 1.5, 90.0])[0] for level in (6.5, 7.0, 7.5)]
    assert found == [*map(float, holds)]


@pytest.mark.parametrize(
    ("text", "at", "message", "cure"),
    [
        ("Lvel < 4", 0, "'Lvel' is no declared name", "did you mean 'Level'?"),
        ("Mann", 0, "'Mann' is no declared BOOL", "did you mean 'Man'?"),
        ("Level", 0, "Level is REAL; a BOOL is wanted", "compare it, as in PV < 4.0"),
        ("Level + 1", 0, "this is a number; a BOOL is wanted", "compare it, as in PV < 4.0"),
        ("Man AND Level", 8, "Level is REAL; AND takes BOOLs", "compare it, as in PV < 4.0"),
        ("Level < Man", 8, "Man is BOOL; numbers are wanted", "wire a REAL or an INT"),
        ("Man = Count", 6, "Count is INT; a BOOL is wanted", "compare it, as in PV < 4.0"),
        ("NOT Level < 4", 4, "Level is REAL; NOT takes BOOLs", "put a comparison into parentheses: NOT (PV < 4)"),
        ("1 < Level < 4", 0, "this is a BOOL; numbers are wanted", "wire a REAL or an INT"),
        ("Man == Fault", 4, "unexpected '='", "write ="),
        ("Man && Fault", 4, "unexpected '&'", "write AND"),
        ("Man | Fault", 4, "unexpected '|'", "write OR"),
        ("!Man", 0, "a number or a name is missing before '!'", "write NOT"),
        ("Man OR", 6, "a number or a name is missing before the end", "allowed are NOT, AND"),
        ("(Man", 4, "a closing parenthesis is missing before the end", "allowed are"),
        ("Level / 0 > 1", 0, "division by zero", "correct the numbers"),
    ],
)
def test_what_cannot_be_read_is_named_at_its_character(text, at, message, cure):
    text = loop(text)
    found = [d for d in check_text(HEAD + text).findings if d.code == "NX601"]
    assert len(found) == 1
    assert message in found[0].message
    assert cure in found[0].help
    begin = (
        next(line for line in (HEAD + text).splitlines() if "Manual" in line).index("Manual: ") + len("Manual: '") + 1
    )
    assert found[0].span.column == begin + at


def test_numbers_do_not_take_conditions():
    with pytest.raises(ExpressionError, match="numbers are wanted"):
        encode_wire("SP", "Level < 4")
    with pytest.raises(ExpressionError, match="Man is BOOL; numbers are wanted"):
        encode_wire("SP", "Man")


def encode_wire(key: str, text: str):
    data = {"pidcfg": 1, "vendor": "nextopid", "plc": {"sample_time": 0.1}, "signals": {"Man": True, "Level": 3.0}}
    data["loops"] = [dict.fromkeys(["SP", "Kp", "Ti_Ki", "Td_Kd", "MinMV", "MinPV"], 0) | {"MaxMV": 1, "MaxPV": 1}]
    data["loops"][0] |= {"name": "A", "type": "PIDA_REAL", key: text}
    found = encode(NextopidFile.model_validate(data))
    for _, misfit in found.misfits:
        raise ExpressionError(misfit.error.args[0] if misfit.error.args else str(misfit.error), misfit.error.offset)
    return found


# --- random conditions: one meaning in the file, in Structured Text, in the engine and in Python ---------------------

LEAVES = {
    "number": st.sampled_from(["Level", "Count", "Delay", "2", "0.5", "7"]),
    "bool": st.sampled_from(["Man", "Fault", "TRUE", "false"]),
}
PYTHON = {"AND": "and", "OR": "or", "XOR": "!=", "=": "==", "<>": "!="}


@st.composite
def conditions(draw, kind="bool", depth=0):
    """A condition as text and as Python's, with parentheses that make both mean the same, and some more."""
    if depth > 3 or draw(st.integers(0, 3)) == 0:
        text = draw(LEAVES[kind])
        return text, {"TRUE": "True", "false": "False"}.get(text, text)
    if kind == "number":
        (a, pa), (b, pb) = (draw(conditions("number", depth + 1)) for _ in "ab")
        op = draw(st.sampled_from(["+", "-", "*"]))
        return f"({a} {op} {b})", f"f32({pa} {op} {pb})"
    form = draw(st.sampled_from(["not", "compare", "join", "same"]))
    if form == "not":
        a, pa = draw(conditions("bool", depth + 1))
        return f"NOT ({a})", f"(not ({pa}))"
    inner = "number" if form == "compare" else "bool"
    (a, pa), (b, pb) = (draw(conditions(inner, depth + 1)) for _ in "ab")
    ops = {"compare": ["<", "<=", ">", ">=", "=", "<>"], "join": ["AND", "OR", "XOR"], "same": ["=", "<>"]}[form]
    op = draw(st.sampled_from(ops))
    return f"({a}) {op} ({b})", f"(({pa}) {PYTHON.get(op, op)} ({pb}))"


@given(conditions(), st.booleans(), st.booleans(), st.floats(-50, 50, width=32), st.integers(-9, 9))
def test_the_engine_finds_what_python_finds(condition, man, fault, level, count):
    np = pytest.importorskip("numpy")
    text, python = condition
    values = {"Man": man, "Fault": fault, "Level": np.float32(level), "Count": np.float32(count)}
    values |= {"Delay": np.float32(1.5), "f32": np.float32}
    wanted = eval(python, {"__builtins__": {}}, values)  # noqa: S307 - of this test's own making
    signals = [float(man), float(fault), float(np.float32(level)), float(count), 1.5, 90.0]
    found, failed = value(text, signals)
    assert failed == 0.0
    assert found == float(wanted)


@given(conditions())
def test_what_is_printed_reads_back_to_the_same_code(condition):
    code = parsed(condition[0])
    names = list(TYPES)
    text = print_expression(code.code, code.constants, names.__getitem__, PLAIN_DIALECT)
    again = parsed(text)
    assert (again.code, again.constants) == (code.code, code.constants)


@given(conditions())
def test_yaml_to_structured_text_and_back(condition):
    data = NextopidFile.model_validate(_data(loop(f"({condition[0]})")))
    image = encode(data).image
    listing = read_st(write_st(image))
    again = NextopidFile.model_validate(decode(listing.words, listing.settings, listing.plc).data)
    one, two = parsed(image.words["A.Manual"].text), parsed(again.loops[0].Manual.text)
    assert (one.code, one.constants) == (two.code, two.constants)
    assert again.signals == data.signals
    assert write_st(encode(again).image) == write_st(image)


def _data(text: str):
    from pidcfg.text.source import read_document

    return read_document((HEAD + text).encode(), "x.yaml").data


@pytest.mark.parametrize(
    ("program", "wire"),
    [
        ("X1 AND NOT B1", "X1 AND NOT B1"),
        ("X1 & B1", "X1 AND B1"),
        ("NOT(Level < 4.0) or X1", "NOT (Level < 4) OR X1"),
        ("TIME_TO_REAL(T1) / 1000.0 > 5.0", "T1 > 5"),
        ("T1 > T#5s", "T1 > 5"),
        ("T1 - T#1s500ms >= T2", "T1 - 1.5 >= T2"),
        ("2.0 * TIME_TO_REAL(T1) / 1000.0 > Level", ""),
        ("INT_TO_REAL(N) + 0.5 > Level", "N + 0.5 > Level"),
        ("N > 3", "N > 3"),
        ("BOOL#1 XOR X1", "TRUE XOR X1"),
        ("X1 = TRUE", "X1 = TRUE"),
    ],
)
def test_conditions_of_a_program_written_by_hand(program, wire):
    names = {"X1": BOOL, "B1": BOOL, "Level": REAL, "N": INT, "T1": TIME, "T2": TIME}
    tokens = tokens_of(program)[0][:-1]
    if not wire:
        with pytest.raises(ValueError, match="write TIME_TO_REAL"):
            Wiring.parse(tokens, BOOL, lambda parts: (parts[0].text, names[parts[0].text]))
        return
    found = Wiring.parse(tokens, BOOL, lambda parts: (parts[0].text, names[parts[0].text]))
    assert print_expression(found.code, found.constants, found.names.__getitem__, PLAIN_DIALECT) == wire


# --- signals ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("form", ["text", "csv", "json", "st", "plcopen"])
def test_signals_keep_their_types_in_every_format(form):
    image = image_of(loop("Count > 3 AND Delay > 1"))
    listing = FORMATS[form].read(FORMATS[form].write(image))
    found = decode(listing.words, listing.settings, listing.plc).data["signals"]
    assert found == {
        "Man": False,
        "Fault": True,
        "Level": 3,
        "Count": "INT#7",
        "Delay": "T#1500ms",
        "Long": "T#90000ms",
    }
    assert (
        NextopidFile.model_validate(_data(loop("Man"))).signals
        == NextopidFile.model_validate(_data(loop("Man")) | {"signals": found}).signals
    )


@pytest.mark.parametrize(
    ("value", "says"),
    [
        ("INT#40000", "Count is 40000, but its word holds -32768 to 32767"),
        ("INT#1.5", "Count is 1.5, but raw counts are whole numbers"),
        ("INT#x", "'x' is"),
        ("T#5s3m", "'T#5s3m' is not a TIME"),
        ("T#", "'T#' is not a TIME"),
        ("T#1us", "'T#1us' is not a TIME"),
        ("0.4 ms", "Count is 0.0004, but raw counts are whole numbers"),
        ("T#50d", "its word holds 0 to 4294967.295"),
        ("BOOL#2", "'2' is not true or false"),
        ("T#5\u017f", "'T#5\u017f' is not a TIME"),
        ("T#\uff11s", "'T#\uff11s' is not a TIME"),
        ("t\u0131me#5s", "'t\u0131me#5s' is not a number"),
    ],
)
def test_first_values_that_a_type_does_not_hold(value, says):
    text = loop("Man").replace("INT#7", value)
    messages = [d.message + (d.help or "") for d in check_text(HEAD + text).findings if d.severity.name == "ERROR"]
    assert any(says in message for message in messages), messages


@pytest.mark.parametrize(
    ("value", "meant"), [("BOOL#1", True), ("BOOL#0", False), ("bool#TRUE", True), ("BOOL#false", False)]
)
def test_a_first_value_may_say_that_it_is_a_bool(value, meant):
    text = loop("Man").replace("Man: false", f"Man: {value}")
    assert NextopidFile.model_validate(_data(text)).signals["Man"] is meant


def test_a_condition_decides_the_mode_of_a_run():
    text = loop("Level < 4 OR Count > 10").replace("PV: Level, ", "PV: Level, ManualMV: 30, ")
    report = run(text, "duration: 20\nevents:\n  - {at: 5, set: {Level: 6}}\n  - {at: 12, set: {Count: 11}}\n")
    assert [(round(m.at), m.mode) for m in report.loops["A"].modes] == [(5, "auto"), (12, "manual")]
    assert report.signals["A.MV"].final == 30


# --- AutoTuneParam ---------------------------------------------------------------------------------------------------

TUNED = (
    "signals: {Amp: 5.0, Cycles: INT#2}\nloops:\n"
    f"  - {{name: A, type: PIDA_TUNE_REAL, SP: 5, {CONDITION_GAINS}, Manual: true, ManualMV: 20, "
    "AutoTuneParam: {PercAmpMV: Amp * 2, PercHystPV: 0.1, PercMaxPeakPV: 20, NumCycles: Cycles, Mode: PI}}\n"
)


def test_a_member_of_auto_tune_param_is_assigned_before_the_call():
    text = write_st(image_of(TUNED))
    lines = text.splitlines()
    at = lines.index("A.AutoTuneParam.PercAmpMV := Amp * 2.0;")
    assert lines[at + 1] == "A.AutoTuneParam.NumCycles := REAL_TO_UINT(INT_TO_REAL(Cycles));"
    assert lines[at + 2] == "A();"
    listing = read_st(text)
    assert listing.words["A.AutoTuneParam.PercAmpMV"].text == "Amp * 2"
    assert listing.words["A.AutoTuneParam.NumCycles"].text == "Cycles"
    again = NextopidFile.model_validate(decode(listing.words, listing.settings, listing.plc).data)
    assert write_st(encode(again).image) == text


def test_the_auto_tuning_takes_what_is_wired():
    plant = (
        "initial: steady\nplants:\n  A: {model: first_order, gain: 2, time_constant: 10, dead_time: 1, initial: 40}\n"
    )
    events = "events:\n  - {at: 100, loop: A, autotune: start}\n"
    wired = run(TUNED, f"duration: 300\n{plant}{events}")
    plain = run(
        TUNED.replace("Amp * 2", "10").replace("NumCycles: Cycles", "NumCycles: 2"), f"duration: 300\n{plant}{events}"
    )
    assert wired.loops["A"].autotune == plain.loops["A"].autotune
    assert wired.loops["A"].autotune["results"]["Kp"] > 0


def test_a_wired_member_is_judged_by_its_first_value():
    text = TUNED.replace("Amp * 2", "Amp")
    assert "NX613" not in [code for code, _ in findings(text)]
    found = dict(findings(text.replace("Amp: 5.0", "Amp: 60.0")))
    assert found["NX613"] == "AutoTuneParam.PercAmpMV is 60 (first value of Amp); it must be 0.1 to 50"


# --- constant conditions ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("Level < 4.0 OR Level > 3.0", "TRUE"),
        ("Level < 3.0 AND Level > 4.0", "FALSE"),
        ("Level <= 3 OR Level > 3", "TRUE"),
        ("Level < 3 OR Level > 3", ""),
        ("Level < 4 OR Level > 5", ""),
        ("Man OR NOT Man", "TRUE"),
        ("Man AND Fault AND NOT Man", "FALSE"),
        ("Man XOR Fault", ""),
        ("Man OR TRUE", "TRUE"),
        ("(TRUE)", "TRUE"),
        ("NOT TRUE", "FALSE"),
        ("Man = Man", "TRUE"),
        ("Count > 3 OR Count < 4", "TRUE"),
        ("Count > 3 AND Count < 4", "FALSE"),
        ("Level > 3 AND Level < 4", ""),
        ("Count > 40000", "FALSE"),
        ("Delay >= 0", "TRUE"),
        ("Delay > 0", ""),
        ("4 > Level OR 3 < Level", "TRUE"),
        ("Level + 1 > 3 OR Level < 4", ""),
        ("(Level + 1 > 3) OR NOT (Level + 1 > 3)", "TRUE"),
        ("(Level < 4) = (Level < 4)", "TRUE"),
        ("Man", ""),
        (" OR ".join(f"Level > {i}" for i in range(13)) + " OR Man OR Fault", ""),
    ],
)
def test_a_condition_that_no_value_changes_is_a_warning(text, value):
    found = [message for code, message in findings(loop(text)) if code == "NX686"]
    assert found == ([f"Manual is always {value}: {text}"] if value else [])


# --- How much of an increment of the integral action counts at a limit of MV (D222) -----------------------------------


@pytest.mark.parametrize(
    ("bits", "change", "out", "accepted"),
    [
        (0, 4.0, 41.0, 4.0),
        (0, -4.0, 39.0, -4.0),
        (MV_HIGH, 4.0, 41.0, 1.0),
        (RISE_LIMITED, 4.0, 41.0, 1.0),
        (MV_HIGH, 4.0, 39.0, 0.0),
        (MV_HIGH, 4.0, 49.0, 4.0),
        (MV_HIGH, -4.0, 41.0, -4.0),
        (MV_LOW, -4.0, 39.0, -1.0),
        (FALL_LIMITED, -4.0, 39.0, -1.0),
        (MV_LOW, -4.0, 41.0, 0.0),
        (MV_LOW, -4.0, 31.0, -4.0),
        (MV_LOW, 4.0, 39.0, 4.0),
        (MV_HIGH, 0.0, 41.0, 0.0),
    ],
)
def test_an_increment_counts_up_to_the_limit_and_wholly_away_from_it(bits, change, out, accepted):
    """Without it MV would be 40."""
    assert accepted_increment(State(out=out), bits, 40.0, change) == accepted


# --- Names that the programming language or CODESYS has for itself ----------------------------------------------------

LOOP = "type: PIDA_REAL, SP: 1, Kp: 1, Ti_Ki: 1, Td_Kd: 0, MinMV: 0, MaxMV: 100, MinPV: 0, MaxPV: 100"


def errors(name: str) -> set[str]:
    """Codes of the errors about a loop with this name."""
    found = check_text(f"{HEAD}loops:\n  - {{name: {name}, {LOOP}}}\n").findings
    return {finding.code for finding in found if finding.severity.name == "ERROR"}


@pytest.mark.parametrize("name", ["DT", "TOD", "ltime", "DATE_AND_TIME", "Time_Of_Day", "LDATE", "LTOD", "LDT", "REAL"])
def test_types_are_no_names(name):
    assert errors(name) == {"PID033"}


@pytest.mark.parametrize(
    "name", ["CONTINUE", "jmp", "POINTER", "Reference", "INTERFACE", "UNION", "SEL", "DINT_TO_REAL", "to_real"]
)
def test_names_that_codesys_does_not_compile_are_errors(name):
    assert errors(name) == {"NX606"}


def test_other_names_are_none():
    assert errors("DT_1") == errors("TIC") == errors("TO_WORDS") == errors("LEN") == set()


# --- What a NextoPID says to an event that it cannot do: each of its reasons, at the loop that it concerns ------------

LOOPS = f"""\
signals: {{Hand: false, Tune: false, Casc: false}}
loops:
  - {{name: PLAIN, type: PIDA_TUNE_REAL, SP: 50, {GAINS}}}
  - {{name: HAND, type: PIDA_TUNE_REAL, SP: 50, {GAINS}, Manual: Hand}}
  - {{name: CASC, type: PIDA_TUNE_REAL, SP: 50, {GAINS}, CASC: Casc}}
  - {{name: TUNE, type: PIDA_TUNE_REAL, SP: 50, {GAINS}, AutoTune: Tune}}
  - {{name: PID, type: PIDA_REAL, SP: 50, {GAINS}}}
  - {{name: SWITCH, type: ControlON_OFF, SP: 50, DeadBand: 1, MinPV: 0, MaxPV: 100}}
"""
SAID = [
    # loop, event, the reason's beginning, whether it is about a requested mode
    ("HAND", "mode: manual", "Manual is wired in the program", True),
    ("HAND", "mode: auto", "Manual is wired in the program", True),
    ("HAND", "mode: cascade", "Manual is wired in the program", True),
    ("CASC", "mode: auto", "CASC is wired in the program", True),
    ("CASC", "mode: cascade", "CASC is wired in the program", True),
    ("SWITCH", "mode: cascade", "ControlON_OFF has no cascade mode", True),
    ("PLAIN", "mode: tracking", "this mode comes about by itself", True),
    ("PLAIN", "mode: autotune", "this mode comes about by itself", True),
    ("TUNE", "autotune: start", "AutoTune is wired in the program", False),
    ("TUNE", "autotune: accept", "AutoTune is wired in the program", False),
    ("PID", "autotune: start", "this block has no auto-tuning", False),
    ("SWITCH", "autotune: start", "this block has no auto-tuning", False),
    ("PLAIN", "autotune: accept", "there are no results without error to accept", False),
]


@pytest.fixture(scope="module")
def report():
    """A run in which the events come one after the other, a second each."""
    loops = dict.fromkeys(loop for loop, *_ in SAID)
    plants = "".join(f"  {loop}: {{model: first_order, gain: 1, time_constant: 5}}\n" for loop in loops)
    events = "".join(f"  - {{at: {at}, loop: {row[0]}, {row[1]}}}\n" for at, row in enumerate(SAID, start=1))
    return run(LOOPS, f"duration: {len(SAID) + 2}\nplants:\n{plants}events:\n{events}")


@pytest.mark.parametrize("at", range(1, len(SAID) + 1), ids=[f"{row[0]} {row[1]}" for row in SAID])
def test_an_event_that_cannot_be_done_says_why(report, at):
    loop, _, text, about_mode = SAID[at - 1]
    found = report.loops[loop]
    reasons = [change.reason for change in found.modes if change.at == pytest.approx(at, abs=0.5) and change.reason]
    notes = [note.text for note in found.notes if note.at == pytest.approx(at, abs=0.5)]
    assert [said.startswith(text) for said in (reasons if about_mode else notes)] == [True]
    assert not (notes if about_mode else reasons)


def test_every_reason_is_said_once():
    assert {
        reason for reason in REASONS.values() if not any(reason.startswith(text) for _, _, text, _ in SAID)
    } == set()
    assert len({text for _, _, text, _ in SAID}) == len(REASONS)


def test_a_casc_that_is_wired_leaves_manual_free(report):
    assert report.loops["CASC"].modes[0].mode == "auto"
    found = run(
        LOOPS,
        "duration: 3\nevents: [{at: 1, loop: CASC, mode: manual}, {at: 1, loop: PLAIN, mode: cascade}]\n"
        "connect: {PLAIN.PV: 50, HAND.PV: 50, CASC.PV: 50, TUNE.PV: 50, PID.PV: 50, SWITCH.PV: 50}\n",
    )
    assert [change.mode for change in found.loops["CASC"].modes] == ["auto", "manual"]
    assert [change.mode for change in found.loops["PLAIN"].modes] == ["auto", "cascade"]
