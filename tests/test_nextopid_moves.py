"""Moves: the MOVE instructions of figures 4-6 and 16-1, from the file to the program, to the engine, and back."""

import re

import pytest

from nextopid_rig import HEAD, findings, image_of, plc_of, run
from pidcfg.api import check_text
from pidcfg.encoders.listing import ListingError
from pidcfg.encoders.nextopid.files import FORMATS, checklist
from pidcfg.encoders.nextopid.image import bumpless_moves, decode, encode
from pidcfg.encoders.nextopid.st_read import read_st
from pidcfg.encoders.nextopid.st_write import write_st
from pidcfg.schemas.nextopid import NextopidFile

GAINS = "Kp: 1.0, Ti_Ki: 10.0, Td_Kd: 0.0, MinMV: 0.0, MaxMV: 100.0, MinPV: 0.0, MaxPV: 100.0"
PLANT = "initial: steady\nplants:\n  A: {model: first_order, gain: 2, time_constant: 10, dead_time: 1, initial: 40}\n"
BUMPLESS = (
    "signals: {Man: false, Manual_MV: 0.0, SP_1: 40.0}\nloops:\n"
    f"  - {{name: A, type: PIDA_REAL, SP: SP_1, {GAINS}, Manual: Man, ManualMV: Manual_MV}}\n"
    "moves:\n"
    "  - {move: A.MV, to: Manual_MV, when: NOT Man}\n"
    "  - {move: A.PV, to: SP_1, when: Man}\n"
)
"""Figure 16-1."""


def moves(*rows: str, loop: str = "") -> str:
    """A program with some signals, a loop, a selector, and these moves."""
    return (
        "signals: {Man: false, Level: 3.0, N: INT#2, T: 5 s}\nblocks:\n"
        "  - {name: SEL_1, type: ControlSelectMin, MV1: A.MV, MV2: 50}\n"
        f"loops:\n  - {{name: A, type: PIDA_REAL, SP: 40, {GAINS}, ManualMV: 5, Manual: Man{loop}}}\n"
        "moves:\n" + "".join(f"  - {{{row}}}\n" for row in rows)
    )


def model_of(text: str) -> NextopidFile:
    from pidcfg.text.source import read_document

    return NextopidFile.model_validate(read_document((HEAD + text).encode(), "x.yaml").data)


def test_the_bumpless_moves_of_figure_16_1():
    events = (
        "events:\n  - {at: 20, set: {SP_1: 60}}\n  - {at: 90, set: {Man: true}}\n  - {at: 120, set: {Manual_MV: 35}}\n"
        "  - {at: 200, set: {Man: false}}\n"
    )
    scenario = f"duration: 260\n{PLANT}{events}"
    moved = run(BUMPLESS, scenario)
    assert moved.signals["A.MV"].low > 19.9
    assert abs(moved.signals["A.SP"].final - 70) < 0.1
    assert abs(moved.signals["A.MV"].final - 35) < 0.1
    jumps = run(BUMPLESS.partition("moves:")[0], scenario)
    assert jumps.signals["A.MV"].low == 0


def test_a_move_at_the_start_acts_in_the_same_cycle():
    text = moves("move: 20, to: A.ManualMV, when: Man, at: start")
    late = moves("move: 20, to: A.ManualMV, when: Man")
    scenario = f"duration: 30\n{PLANT}events:\n  - {{at: 10, set: {{Man: true}}}}\n"
    assert run(text, scenario).signals["A.MV"].low > 19.9
    assert run(late, scenario).signals["A.MV"].low == 5


def test_moves_are_executed_in_the_order_of_the_file():
    text = moves("move: N + 1, to: N", "move: N * 2, to: Level", "move: false, to: Man, when: Man")
    report = run(text, "duration: 1\n")
    assert (report.signals["N"].final, report.signals["Level"].final) == (13, 26)


@pytest.mark.parametrize(("value", "held"), [("N * 30000", 32767), ("N * -30000", -32768), ("N * 3.3", 7)])
def test_a_move_to_an_int_holds_what_its_word_holds(value, held):
    report = run(moves(f"move: {value}, to: N, when: N = 2"), "duration: 1\n")
    assert report.signals["N"].final == held


def test_a_move_without_a_value_writes_nothing_and_is_told():
    report = run(moves("move: 1 / (Level - 3), to: Level"), "duration: 1\n")
    assert report.signals["Level"].final == 3
    assert any("Level" in note.text and "division by zero" in note.text for note in report.notes)


def test_results_of_the_auto_tuning_are_accepted_as_figure_4_6_has_it():
    text = (
        "signals: {Start: false, Accept: false, Kp_1: 1.0, Ti_1: 10.0, Td_1: 0.0}\nloops:\n"
        "  - {name: A, type: PIDA_TUNE_REAL, SP: 40, Kp: Kp_1, Ti_Ki: Ti_1, Td_Kd: Td_1, MinMV: 0, MaxMV: 100, "
        "MinPV: 0, MaxPV: 100, Manual: true, ManualMV: 20, AutoTune: Start, "
        "AutoTuneParam: {PercAmpMV: 5, PercHystPV: 0.1, PercMaxPeakPV: 10, NumCycles: 3, Mode: PID}}\n"
        "moves:\n"
    )
    done = "Accept AND A.AutoTuneDone AND NOT A.AutoTuneError"
    for key, name in (("Kp", "Kp_1"), ("Ti_Ki", "Ti_1"), ("Td_Kd", "Td_1")):
        text += f"  - {{move: A.AutoTuneResult.{key}, to: {name}, when: {done}}}\n"
    text += "  - {move: false, to: Start, when: Accept}\n  - {move: false, to: Accept, when: Accept}\n"
    events = "events:\n  - {at: 5, set: {Start: true}}\n  - {at: 60, set: {Accept: true}}\n"
    report = run(text, f"duration: 80\n{PLANT}{events}")
    results = report.loops["A"].autotune["results"]
    assert results["Kp"] > 1.5
    finals = [report.signals[name].final for name in ("Kp_1", "Ti_1", "Td_1")]
    assert finals == pytest.approx([results["Kp"], results["Ti_Ki"], results["Td_Kd"]])
    assert report.signals["Start"].final == report.signals["Accept"].final == 0
    before = run(text, f"duration: 80\n{PLANT}{events.replace('at: 60', 'at: 20')}")
    assert before.signals["Kp_1"].final == 1


@pytest.mark.parametrize(
    ("row", "key", "says", "cure"),
    [
        ("move: 1, to: A.MV", "to", "A.MV is an output of its block", "move it to a signal, or to an input"),
        (
            "move: A.MV, to: A.ManulMV",
            "to",
            "'A.ManulMV' is no declared signal, and no parameter of a block",
            "did you mean 'A.ManualMV'?",
        ),
        (
            "move: A.MV, to: A.setpoint",
            "to",
            "'A.setpoint' is no declared signal, and no parameter of a block",
            "did you mean 'A.SP'?",
        ),
        (
            "move: A.MV, to: SEL_1.MV2",
            "to",
            "SEL_1.MV2: ControlSelectMin is a function, which keeps nothing",
            "wire it to a signal, and move there",
        ),
        (
            "move: true, to: A.Manual",
            "to",
            "A.Manual is wired, and its wire writes it at every call",
            "move to what it is wired to",
        ),
        ("move: 40, to: A.PV", "to", "A.PV is left to the program around", "wire it to a signal, and move there"),
        ("move: 4, to: T", "to", "T is TIME", "numbers and BOOLs can be moved"),
        (
            "move: 4, to: A.BIAS, at: start",
            "to",
            "A.BIAS is written before every call, which is what a wire does",
            "wire it: BIAS: 4.0",
        ),
        ("move: Level, to: Man", "move", "Level is REAL; a BOOL is wanted", "compare it, as in PV < 4.0"),
        ("move: Man, to: Level", "move", "Man is BOOL; numbers are wanted", "wire a REAL or an INT"),
        ("move: true, to: Level", "move", "Level is REAL, and TRUE is none", "write a value of its type"),
        ("move: 1, to: Man", "move", "Man is BOOL, and 1 is none", "write a value of its type"),
        ("move: 40000, to: N", "move", "is outside the range of INT", "write a value of its type"),
        ("move: 5, to: Level, when: Level", "when", "Level is REAL; a BOOL is wanted", "compare it, as in PV < 4.0"),
        ("move: 5, to: Level, when: Mann", "when", "'Mann' is no declared BOOL", "did you mean 'Man'?"),
    ],
)
def test_a_move_that_means_nothing_is_named_at_its_key(row, key, says, cure):
    text = HEAD + moves(row)
    (found,) = [d for d in check_text(text).findings if d.code == "NX601"]
    assert (found.where, found.message, found.help) == (f"moves[0].{key}", f"{key}: {says}", cure)
    marked = text.splitlines()[found.span.line - 1][found.span.column - 1 :]
    assert marked.startswith(row.partition(f"{key}: ")[2])


def test_what_a_move_writes_is_used():
    unused = [message for code, message in findings(moves("move: Level + N, to: Level")) if code == "NX605"]
    assert unused == ["no wire reads the signal T"]
    assert "NX605" not in dict(findings(moves("move: Level + N, to: Level", "move: T > 3 AND Man, to: Man")))


def test_signals_that_the_program_writes_are_not_assigned_from_outside():
    items = checklist(model_of(moves("move: A.MV, to: Level", "move: 5, to: N, when: Man")))
    assert items[-1] == "assign the signals from outside: Man, N, T"


def test_a_constant_condition_of_a_move_is_a_warning():
    found = dict(findings(moves("move: 5, to: Level, when: Man OR NOT Man")))
    assert found["NX686"] == "when is always TRUE: Man OR NOT Man"
    behind_one_that_means_nothing = moves("move: 1, to: A.MV", "move: 5, to: Level, when: Man OR NOT Man")
    (found,) = [d for d in check_text(HEAD + behind_one_that_means_nothing).findings if d.code == "NX686"]
    assert found.where == "moves[1].when"


# --- Structured Text -------------------------------------------------------------------------------------------------


def test_figure_16_1_as_structured_text():
    lines = write_st(image_of(BUMPLESS)).splitlines()
    at = lines.index("A(SP := SP_1, ManualMV := Manual_MV, Manual := Man);")
    assert lines[at + 1 :] == [
        "IF NOT Man THEN",
        "    Manual_MV := A.MV;",
        "END_IF;",
        "IF Man THEN",
        "    SP_1 := A.PV;",
        "END_IF;",
        "END_PROGRAM",
    ]


@pytest.mark.parametrize("form", sorted({*FORMATS} - {"modbus-map"}))
def test_moves_come_back_from_every_format(form):
    rows = (
        "move: 20, to: A.ManualMV, when: Man, at: start",
        "move: A.MV * 2, to: Level",
        "move: (N), to: N, when: Man",
    )
    config = model_of(moves(*rows, "move: false, to: Man, when: Man AND Level > 4"))
    listing = FORMATS[form].read(FORMATS[form].write(encode(config).image))
    again = NextopidFile.model_validate(decode(listing.words, listing.settings, listing.plc).data)
    assert again.moves == config.moves
    assert write_st(encode(again).image) == write_st(encode(config).image)


def test_assignments_of_one_condition_stand_together_unless_one_changes_it():
    rows = ["move: 1, to: Level, when: Man", "move: false, to: Man, when: Man", "move: 2, to: N, when: Man"]
    text = write_st(image_of(moves(*rows)))
    assert text.count("IF Man THEN") == 2
    assert "    Level := 1.0;\n    Man := FALSE;\nEND_IF;\nIF Man THEN\n    N := 2;\nEND_IF;" in text


HAND = """PROGRAM Main
VAR
  A : PIDA_REAL := (SP := 40.0, MaxMV := 100.0, MaxPV := 100.0, Kp := 1.0);
  B : ControlLag := (Gs := 1.0, Tc := 2.0, Max_OutVar := 100.0);
  Man, Fault : BOOL; SP1 : REAL := 40.0; MV1 : REAL; AI : INT; AO : INT; Mode : INT; Text : STRING; Q : BOOL;
END_VAR
{}
END_PROGRAM
"""


def hand(body: str):
    """The moves, the words and the notes of a program written by hand, which begins in line 7."""
    listing = read_st(HAND.format(body))
    return listing.plc.get("moves", []), listing.words, listing.notes


@pytest.mark.parametrize(
    ("body", "wanted"),
    [
        ("A(Manual := Man); IF Man THEN A.SP := A.PV; END_IF", [("A.PV", "A.SP", "Man", "end")]),
        ("A(Manual := Man); IF NOT Man THEN ; ELSE A.SP := A.PV; END_IF", [("A.PV", "A.SP", "Man", "end")]),
        (
            "A(); IF NOT (Man OR Fault) THEN ; ELSIF Man THEN A.SP := 1; END_IF",
            [(1.0, "A.SP", "(Man OR Fault) AND Man", "end")],
        ),
        (
            "A(Manual := Man, ManualMV := MV1); IF Man THEN ; ELSE MV1 := A.MV; END_IF",
            [("A.MV", "MV1", "NOT Man", "end")],
        ),
        (
            "IF Man THEN A.SP := 1; ELSIF Fault THEN A.SP := 2; ELSE A.SP := 3; END_IF A();",
            [
                (1.0, "A.SP", "Man", "start"),
                (2.0, "A.SP", "NOT Man AND Fault", "start"),
                (3.0, "A.SP", "NOT Man AND NOT Fault", "start"),
            ],
        ),
        (
            "CASE Mode OF 1: A.SP := 1; 2, 4..6: A.SP := 2; -1: ; ELSE A.SP := 3; END_CASE A();",
            [
                (1.0, "A.SP", "Mode = 1", "start"),
                (2.0, "A.SP", "Mode = 2 OR Mode >= 4 AND Mode <= 6", "start"),
                (
                    3.0,
                    "A.SP",
                    "NOT (Mode = 1) AND NOT (Mode = 2 OR Mode >= 4 AND Mode <= 6) AND NOT (Mode = (-1))",
                    "start",
                ),
            ],
        ),
        (
            "A(SP := SP1, BIAS := MV1); IF Man THEN SP1 := 1; END_IF IF Fault THEN MV1 := 2; SP1 := 3; END_IF",
            [(1.0, "SP1", "Man", "end"), (2.0, "MV1", "Fault", "end"), (3.0, "SP1", "Fault", "end")],
        ),
        (
            "CASE Mode OF 9..1: A.SP := 1; 2: A.SP := 2; END_CASE A();",
            [(1.0, "A.SP", "Mode >= 9 AND Mode <= 1", "start"), (2.0, "A.SP", "Mode = 2", "start")],
        ),
        (
            "A.SP := SP1; IF Man THEN A.SP := 5; END_IF A();",
            [("SP1", "A.SP", "", "start"), (5.0, "A.SP", "Man", "start")],
        ),
        ("MV1 := AI / 100.0; A(PV := MV1);", [("AI / 100", "MV1", "", "start")]),
        ("A(Manual := Man); B(InVar := A.MV); Man := Fault;", [("Fault", "Man", "", "end")]),
        (
            "A(SP := MV1); MV1 := A.MV; SP1 := 3.0; B(InVar := SP1);",
            [(3.0, "SP1", "", "start"), ("A.MV", "MV1", "", "end")],
        ),
        ("A(); Man := A.MV > 5.0; B(); C(); A.SP := 5;", None),
        (
            "IF Man THEN IF Fault THEN A.SP := 5; END_IF A.BIAS := 2; END_IF A();",
            [(5.0, "A.SP", "Man AND Fault", "start"), (2.0, "A.BIAS", "Man", "start")],
        ),
    ],
)
def test_programs_written_by_hand(body, wanted):
    if wanted is None:
        moves, _, _ = hand(body)
        assert [(m["move"], m["to"], m.get("at", "end")) for m in moves] == [(5.0, "A.SP", "end")]
        return
    moves, _, _ = hand(body)
    assert [(m["move"], m["to"], m.get("when", ""), m.get("at", "end")) for m in moves] == wanted


def test_what_does_not_concern_the_blocks_is_named_by_line():
    body = "A(Manual := Man);\nAO := REAL_TO_INT(A.MV * 300.0);\nIF Fault THEN\nText := 'x';\nEND_IF\n"
    body += "FOR AI := 1 TO 3 DO\nQ := TRUE;\nEND_FOR"
    moves, _, notes = hand(body)
    assert moves == []
    assert "statements that are not about blocks of the library are left out: lines 8, 10, 12" in notes


@pytest.mark.parametrize(
    ("body", "line", "says"),
    [
        (
            "A(SP := SP1);\nIF Man THEN A.SP := 5; END_IF",
            8,
            "A.SP is an argument of the call in line 7, which writes over",
        ),
        ("A(PV := MV1);\nMV1 := A.MV;\nB(InVar := MV1);", 8, "MV1 is assigned between two calls"),
        ("A(SP := MV1);\nMV1 := A.MV * SP1;\nSP1 := 3.0;\nB(InVar := SP1);", 9, "SP1 is assigned between two calls"),
        ("A(SP := MV1);\nMV1 := A.MV;\nSP1 := MV1;\nB(InVar := SP1);", 9, "SP1 is assigned between two calls"),
        ("A();\nMV1 := A.MV;\nMV1 := SP1;\nB();\nA.SP := MV1;", 9, "MV1 is assigned between two calls"),
        ("IF Man THEN\nMan := FALSE; A.SP := 5;\nEND_IF A(Manual := Man);", 8, "Man is assigned inside the statement"),
        ("IF Man THEN A.SP := FOO(3); END_IF A();", 7, "FOO is a function that cannot be wired"),
        (
            "A(SP := SP1, BIAS := MV1);\nIF Man THEN SP1 := FOO(3); END_IF\nIF Man THEN MV1 := BAR(3); END_IF",
            8,
            "FOO is a function that cannot be wired",
        ),
        ("IF SP1 THEN A.SP := 3; END_IF A();", 7, "SP1 is a REAL; a BOOL is wanted"),
        ("IF Man THEN A.SP := Man; END_IF A();", 7, "Man is a BOOL; numbers are wanted"),
        ("IF Man A.SP := 3; END_IF A();", 7, "unexpected ';'"),
        ("CASE Mode OF 1: A.SP := 3; 1: A.SP := 4; END_CASE A();", 7, "this value stands in the CASE again"),
        ("CASE Mode OF 9, 1..3, 2..6: ; 4: A.SP := 4; END_CASE A();", 7, "this value stands in the CASE again"),
        ("CASE Mode OF 0..9, 5: ; 4..2: ; 7: A.SP := 4; END_CASE A();", 7, "this value stands in the CASE again"),
        (f"IF Man THEN A.SP := SP1{' + SP1' * 300}; END_IF A();", 7, "the expression is longer than 1000 characters"),
        (f"IF SP1 > 1.0{' OR Man' * 200} THEN A.SP := 1; END_IF A();", 7, "is longer than 1000 characters"),
        ("CASE Mode OF Big: A.SP := 3; END_CASE A();", 7, "only numbers are read as values of CASE"),
        ("IF Man THEN A(SP := 5); END_IF", 7, "A is called inside another statement"),
        ("WHILE Man DO A.SP := 5; END_WHILE A();", 7, "a parameter of A is assigned inside another statement"),
        ("IF Man THEN RETURN; END_IF A();", 7, "what stands behind is not always executed"),
        ("IF Man THEN Text := 'x'; END_IF A(SP := Text);", 7, "neither a number nor a TIME nor a BOOL"),
    ],
)
def test_what_a_configuration_cannot_have_is_refused_at_its_line(body, line, says):
    with pytest.raises(ListingError, match=re.escape(says)) as error:
        hand(body)
    assert error.value.line in {line, 5}


FIGURE = """PROGRAM Main
VAR
  PID_1 : PIDA_TUNE_REAL; Process : ControlDelayLag := (Gs := 2.0, Tc := 10.0, DelayTime := 1.0, Max_OutVar := 100.0);
  SP1 : REAL := 40.0; Kp1 : REAL := 1.0; Ti_Ki1 : REAL := 10.0; Td_Kd1, ManualMV1, MV1 : REAL;
  Manual1, AutoTune1, AcceptTuning1, AutoTuneDone1, AutoTuneError1 : BOOL;
  Param : AUTOTUNE_PARAM := (PercAmpMV := 5.0, PercHystPV := 0.1, NumCycles := 3, Mode := AUTOTUNE_PID);
  Result : AUTOTUNE_RESULT;
END_VAR
PID_1(SP := SP1, PV := Process.OutVar, Kp := Kp1, Ti_Ki := Ti_Ki1, Td_Kd := Td_Kd1, ManualMV := ManualMV1,
  MaxMV := 100.0, MaxPV := 100.0, Manual := Manual1, AutoTune := AutoTune1, AutoTuneParam := Param,
  MV => MV1, AutoTuneDone => AutoTuneDone1, AutoTuneError => AutoTuneError1, AutoTuneResult => Result);
Process(InVar := MV1);
IF Manual1 THEN SP1 := Process.OutVar; ELSE ManualMV1 := MV1; END_IF
IF AcceptTuning1 THEN
  IF AutoTuneDone1 AND NOT AutoTuneError1 THEN
    Kp1 := Result.Kp; Ti_Ki1 := Result.Ti_Ki; Td_Kd1 := Result.Td_Kd;
  END_IF
  AutoTune1 := FALSE; AcceptTuning1 := FALSE;
END_IF
END_PROGRAM
"""


def test_figure_16_1_as_an_engineer_writes_it():
    listing = read_st(FIGURE)
    done = "AcceptTuning1 AND (PID_1.AutoTuneDone AND NOT PID_1.AutoTuneError)"
    assert [(m["move"], m["to"], m["when"]) for m in listing.plc["moves"]] == [
        ("Process.OutVar", "SP1", "Manual1"),
        ("PID_1.MV", "ManualMV1", "NOT Manual1"),
        ("PID_1.AutoTuneResult.Kp", "Kp1", done),
        ("PID_1.AutoTuneResult.Ti_Ki", "Ti_Ki1", done),
        ("PID_1.AutoTuneResult.Td_Kd", "Td_Kd1", done),
        (False, "AutoTune1", "AcceptTuning1"),
        (False, "AcceptTuning1", "AcceptTuning1"),
    ]
    assert listing.words["PID_1.AutoTuneParam.PercAmpMV"] == 5.0
    assert listing.words["PID_1.AutoTuneParam.Mode"] == "AUTOTUNE_PID"
    assert listing.notes == ()
    listing.plc["sample_time"] = 0.1
    data = decode(FORMATS["st"].read(FIGURE).words, listing.settings, listing.plc).data
    image = encode(NextopidFile.model_validate(data)).image
    again = read_st(write_st(image))
    assert again.plc["moves"] == listing.plc["moves"]


@pytest.mark.parametrize(
    ("row", "holds"),
    [
        ("move: A.MV, to: A.ManualMV, when: NOT A.Manual", True),
        ("move: A.MV, to: A.ManualMV, when: NOT Man", True),
        ("move: A.MV, to: A.ManualMV, when: NOT A.Manual, at: start", False),
        ("move: A.MV, to: A.ManualMV, when: A.Manual", False),
        ("move: A.MV, to: A.ManualMV", False),
        ("move: A.MV + 1, to: A.ManualMV, when: NOT Man", False),
        ("move: A.MV, to: A.BIAS, when: NOT Man", False),
        ("move: A.MV, to: Level, when: NOT Man", False),
    ],
)
def test_only_the_move_of_figure_16_1_holds_the_output(row, holds):
    encoding = encode(model_of(moves(row)))
    assert (bumpless_moves(encoding, 1).holds_mv == 0) is holds


def test_a_program_without_moves_executes_none():
    plc = plc_of(
        f"loops: [{{name: A, type: PIDA_REAL, SP: 50, {GAINS}}}, {{name: B, type: PIDA_REAL, SP: 5, {GAINS}}}]\n"
    )
    assert [(c.moves_begin, c.early_moves_end, c.moves_end) for c in plc.configs] == [(0, 0, 0)] * 2
