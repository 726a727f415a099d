"""DPIDE program text: what is written, what is read of it and of programs by hand, and what is refused."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from dpide_strategies import configurations
from pidcfg.api import check, decode
from pidcfg.encoders.decoding import decode_listing
from pidcfg.encoders.dpide.files import FORMATS, write_st
from pidcfg.encoders.dpide.image import encode
from pidcfg.encoders.dpide.st_read import read_st
from pidcfg.encoders.listing import ListingError, UnwritableError, detect_kind
from pidcfg.encoders.maps.dpide import PROCESS_OPERANDS, ROWS
from pidcfg.schemas.dpide import DpideFile
from pidcfg.schemas.iec import BOOL, DINT, REAL
from pidcfg.vendors import VENDORS
from test_dpide_encoding import configuration

# --- DPIDE program text: what is written, what is read of it and of programs by hand, and what is refused -------------

DATA = Path(__file__).parent / "data" / "dpide"
EXAMPLES = (1, 2, 3, 4, 5)
SLOW = settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.too_slow])
NAMES = st.from_regex(r"[A-Za-z][A-Za-z0-9]{0,4}(?:[ .\-/#][0-9]{1,3})?", fullmatch=True).map(str.upper)


def written(config: DpideFile) -> str:
    return write_st(encode(config).image)


def found(text: str):
    """What a program gives: data and notes."""
    return decode_listing(read_st(text), VENDORS["dpide"], {})


def again(text: str) -> DpideFile:
    """The configuration of a program."""
    return DpideFile.model_validate(found(text).data)


def refused(text: str) -> ListingError:
    """Why a program is refused."""
    with pytest.raises(ListingError) as error:
        again(text)
    return error.value


# --- both ways -------------------------------------------------------------------------------------------------------


def one_timer_a_loop(config: DpideFile) -> DpideFile:
    """The same with timers of their own; one timer cannot run for several times."""
    data = config.model_dump()
    for i, loop in enumerate(data["loops"]):
        if loop["call"]["timer"]:
            loop["call"]["timer"] = f"T{i}"
    return DpideFile.model_validate(data)


@SLOW
@given(config=configurations(NAMES))
def test_any_configuration_comes_back(config):
    image = encode(one_timer_a_loop(config)).image
    text = write_st(image, ("one *) (* two",))

    assert detect_kind(text, FORMATS) is FORMATS["st"]
    assert read_st(text).notes == ()
    assert encode(again(text)).image == image
    assert write_st(encode(again(text)).image, ("one *) (* two",)) == text


def example(number: int) -> DpideFile:
    """The configuration of an example of the manual."""
    result = check(DATA / f"manual-{number}.yaml")
    assert result.ok
    return DpideFile.model_validate(decode((DATA / f"manual-{number}.st").read_text(), "dpide").data)


@pytest.mark.parametrize("number", EXAMPLES)
def test_the_manuals_examples_are_read_and_written(number):
    by_hand = decode((DATA / f"manual-{number}.hand.st").read_text(), "dpide")
    assert by_hand.text == (DATA / f"manual-{number}.yaml").read_text()

    text = (DATA / f"manual-{number}.st").read_text()
    config = DpideFile.model_validate(by_hand.data)
    checks = VENDORS["dpide"].load("checklist")(config)
    assert [line for line in FORMATS["st"].write(encode(config).image, checks).splitlines() if "(DP" not in line] == [
        line for line in text.splitlines() if "(DP" not in line
    ]
    assert decode(text, "dpide").data == by_hand.data


def test_what_the_examples_have_around_the_instruction():
    calls = {number: example(number).loops[0].call.model_dump(exclude_none=True) for number in EXAMPLES}

    assert calls == {
        1: {"EN": "M0"},
        2: {},
        3: {"GPWM": {"cycle": 4000, "output": "Y0.0"}},
        4: {"function_block": "AS_DPIDE", "timer": "T0"},
        5: {},
    }
    assert example(5).plc.interrupt_task == 1000


def test_the_function_block_has_what_the_manual_lists_as_in_out():
    text = (DATA / "manual-4.st").read_text()
    in_out = re.search(r"VAR_IN_OUT\n(.*?)END_VAR", text, re.DOTALL)

    assert re.findall(r"^ *(\w+) :", in_out[1], re.MULTILINE) == [
        *("PID_MODE", "Kc_Kp", "Ti_Ki", "Td_Kd", "Tf", "MOUT", "I_MV")
    ]


# --- writing ---------------------------------------------------------------------------------------------------------


def arguments(text: str) -> dict[str, str]:
    """What stands at each operand of the last call."""
    return dict(re.findall(r"^ +(\w+) (?::=|=>) ([^,\n]+),?$", text, re.MULTILINE))


def test_numbers_stand_in_the_call_and_what_is_written_has_a_symbol():
    shown = arguments(written(configuration(devices={"SV": "D100"}, PID_DIR=True)))

    assert tuple(shown) == ("EN", *ROWS)
    symbols = {name for name, value in shown.items() if value.startswith("OVEN_")}
    assert symbols == {"SV", *PROCESS_OPERANDS}
    assert (shown["CYCLE"], shown["Kc_Kp"], shown["PID_DIR"], shown["EN"]) == ("1000", "12.0", "TRUE", "SM400")


@pytest.mark.parametrize(
    ("given", "more"),
    [
        ({"PID_MODE": 1}, {"PID_MODE", "Kc_Kp", "Ti_Ki", "Td_Kd", "Tf"}),
        ({"devices": {"PID_MODE": "D10"}}, {"PID_MODE", "Kc_Kp", "Ti_Ki", "Td_Kd", "Tf"}),
        ({"MOUT_AUTO": True}, {"MOUT"}),
        ({"devices": {"MOUT_AUTO": "M1"}}, {"MOUT_AUTO", "MOUT"}),
        ({"call": {"function_block": "FB1"}}, {"PID_MODE", "Kc_Kp", "Ti_Ki", "Td_Kd", "Tf", "MOUT"}),
    ],
)
def test_what_the_instruction_may_write_is_a_symbol(given, more):
    shown = arguments(written(configuration(**given)))

    assert {name for name, value in shown.items() if value.startswith("OVEN_")} == {*PROCESS_OPERANDS, *more}


@pytest.mark.parametrize(
    ("loops", "message"),
    [
        ([{"name": "7 UP"}], "no symbols can be made of the name"),
        (
            [{"call": {"timer": "T1"}}, {"call": {"timer": "T1"}, "CYCLE": 500}],
            "L1: T1 cannot run for 500 ms and 1000 ms of L0; give",
        ),
        ([{"call": {"function_block": "DPIDE"}}], "a name that something else has"),
        ([{"call": {"function_block": "L0_SV"}}], "a name that something else has"),
        ([{"call": {"function_block": "L0_WIDTH"}}], "a name that something else has"),
        ([{"call": {"function_block": "l0_fb"}}], "a name that something else has"),
        ([{"call": {"function_block": "A"}}, {"call": {"function_block": "a"}}], "a name that something else has"),
    ],
)
def test_what_a_program_cannot_have_is_refused(loops, message):
    plain = configuration().loops[0].model_dump(exclude_unset=True)
    data = [{**plain, "name": f"L{i}", "device": f"D{30 * i}", **loop} for i, loop in enumerate(loops)]
    with pytest.raises(UnwritableError, match=message):
        written(DpideFile.model_validate({"pidcfg": 1, "vendor": "dpide", "loops": data}))


def test_loops_of_one_timer_run_it_once_and_reset_it_once():
    plain = configuration(call={"timer": "T7"}).loops[0].model_dump(exclude_unset=True)
    data = [{**plain, "name": name, "device": f"D{at}"} for name, at in (("A", 0), ("B", 30), ("C", 60))]
    config = DpideFile.model_validate({"pidcfg": 1, "vendor": "dpide", "loops": data})
    text = written(config)

    assert [text.count(part) for part in ("TMRH(SM400, T7, 1000)", "IF T7 THEN", "T7 := FALSE")] == [1, 3, 1]
    assert text.index("TMRH") < text.index("(* A *)") + 10
    assert text.index("T7 := FALSE") > text.index("C_MV\n")
    assert encode(again(text)).image == encode(config).image


# --- programs by hand ------------------------------------------------------------------------------------------------

NAMED = {
    "PID_RUN": "M10",
    "SV": "80.0",
    "PV": "D102",
    "PID_MODE": "0",
    "PID_MAN": "FALSE",
    "MOUT_AUTO": "FALSE",
    "CYCLE": "1000",
    "Kc_Kp": "12.5",
    "Ti_Ki": "180.0",
    "Td_Kd": "20.0",
    "Tf": "2.0",
    "PID_EQ": "TRUE",
    "PID_DE": "TRUE",
    "PID_DIR": "TRUE",
    "ERR_DBW": "0.5",
    "MV_MAX": "100.0",
    "MV_MIN": "0.0",
    "MOUT": "10.0",
    "BIAS": "5.0",
    "I_MV": "D500",
    "MV": "D104",
}


def by_name(**changes: str | None) -> str:
    """A call with named operands; None leaves one out."""
    shown = {name: value for name, value in {**NAMED, **changes}.items() if value is not None}
    return "DPIDE(" + ", ".join(f"{n} {'=>' if n == 'MV' else ':='} {v}" for n, v in shown.items()) + ");"


def by_position(values=None) -> str:
    return f"DPIDE({', '.join(NAMED.values() if values is None else values)});"


PLAIN = again(by_name())


def test_a_call_by_hand():
    loop = PLAIN.loops[0]
    assert (loop.name, loop.device, loop.devices.by_operand()) == (
        "LOOP-1",
        "D500",
        {"PID_RUN": "M10", "PV": "D102", "MV": "D104"},
    )
    assert (loop.SV, loop.CYCLE, loop.Ti_Ki, loop.PID_DIR, loop.BIAS) == (80, 1000, 180, True, 5)


@pytest.mark.parametrize(
    "text",
    [
        by_position(),
        by_position(["SM400", *NAMED.values()]),
        by_position(["TRUE", *NAMED.values()]),
        by_name().lower(),
        by_name().replace(" ", ""),
        by_name().replace(" ", "\r\n\t(* (* in *) *)"),
        by_name().replace(",", ", // note: DPIDE(\n"),
        by_name(EN="SM400"),
        "PROGRAM P\n" + by_name() + "\nEND_PROGRAM",
        "DPIDE(" + ", ".join(reversed(by_name()[6:-2].split(", "))) + ");",
        by_name(CYCLE="K1000", SV="F80.0", BIAS="+5.0", MV_MIN="-0.0", Ti_Ki="1.8E2", PID_MODE="DINT#0"),
        by_name(CYCLE="16#3E8", SV="REAL#80.0", PID_DIR="BOOL#1", Kc_Kp="1_2.5"),
        "IF TRUE THEN " + by_name() + " END_IF;",
        "\ufeff{pragma}\n" + by_name(),
    ],
)
def test_the_same_call_written_otherwise(text):
    assert again(text) == PLAIN
    assert detect_kind(text, FORMATS) is FORMATS["st"]


def test_a_condition_that_is_one_bit_enables():
    for text in (by_name(EN="M3"), f"IF m3 THEN {by_name()} END_IF;", by_position(["M3", *NAMED.values()])):
        assert again(text).loops[0].call.EN == "M3"
    assert again(f"VAR_GLOBAL Go AT X0.1 : BOOL; END_VAR {by_name(EN='go')}").loops[0].call.EN == "X0.1"


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        (f"\nIF M1 AND M2 THEN {by_name()} END_IF;", "line 2, M1 AND M2"),
        (f"IF M1 THEN ; ELSE\n{by_name()} END_IF;", "line 1, ELSE"),
        (f"IF M1 THEN ; ELSIF M2 THEN\n{by_name()} END_IF;", "line 1, M2"),
        (f"IF M1 THEN {by_name(EN='M2')} END_IF;", "line 1, M1"),
        (by_name(EN="NOT M2"), "line 1, NOT M2"),
        (by_name(EN="Go"), "line 1, Go"),
        (f"IF T3 THEN {by_name()} END_IF;", "line 1, T3"),
    ],
)
def test_another_condition_is_named(text, shown):
    assert found(text).notes[0] == f"LOOP-1 is executed on a condition in {shown}, which is not carried over"


def test_what_else_a_program_has_is_named_by_line():
    text = f"""TYPE T : INT; END_TYPE
X := 1;
{by_name()}
FOR i := 1 TO 3 DO Lamp := TRUE; END_FOR;
IF M1 THEN D102 := 7; Other(1); END_IF;
GPWM(M1, D7, 4000, Y0.0);
TMRH(SM400, T9, 5);"""
    assert found(text).notes == (
        "LOOP-1.PV is assigned in line 5, which is not carried over",
        "statements that are not about DPIDE are left out: lines 1, 2, 4, 5, 6, 7",
        "LOOP-1.PID_RUN stands in M10; nothing says what it holds: it is taken for TRUE",
    )


def test_a_number_that_is_assigned_is_what_the_operand_holds():
    for operand in ("target", "D100", "d100"):
        text = f"VAR_GLOBAL Target AT D100 : REAL := 70; END_VAR {by_name(SV=operand, BIAS='D106')} D106 := -3.0;"
        for statement, value in (("", 70), ("Target := 85.0;", 85), ("D100 := 0.0;", 0)):
            loop = again(text + statement).loops[0]
            found_there = loop.SV, loop.BIAS, loop.devices.SV
            assert found_there == (value, -3, "D100")


@pytest.mark.parametrize(
    ("program", "holds"),
    [
        ("VAR {a} END_VAR PROGRAM P {call} END_PROGRAM", True),
        ("PROGRAM Q VAR_GLOBAL {a} END_VAR END_PROGRAM PROGRAM P {call} END_PROGRAM", True),
        ("PROGRAM P {call} END_PROGRAM PROGRAM Q VAR_EXTERNAL {a} END_VAR END_PROGRAM", True),
        ("PROGRAM Q VAR {a} END_VAR END_PROGRAM PROGRAM P {call} END_PROGRAM", False),
        ("VAR {a} END_VAR PROGRAM P VAR a : REAL; END_VAR {call} END_PROGRAM", False),
    ],
)
def test_what_is_declared_outside_of_programs_or_as_global_counts_in_all_of_them(program, holds):
    read = read_st(program.format(a="a AT D100 : REAL := 70;", call=by_name(SV="a")))
    assert (read.words["LOOP-1.SV"] == 70) == holds
    assert read.settings[0]["devices"].get("SV") == ("D100" if holds else None)


@pytest.mark.parametrize(
    ("name", "kind", "value", "held"),
    [
        ("SV", "REAL", "80", 80.0),
        ("SV", "REAL", "-80.5", -80.5),
        ("PID_DIR", "BOOL", "1", True),
        ("PID_DIR", "BOOL", "0", False),
        ("PID_DIR", "BOOL", "FALSE", False),
        ("CYCLE", "DINT", "+500", 500),
        ("PID_DIR", "BOOL", "2", None),
        ("PID_DIR", "BOOL", "1.0", None),
        ("CYCLE", "DINT", "500.0", None),
    ],
)
def test_an_initial_value_may_be_whole_whatever_its_symbol_is(name, kind, value, held):
    text = f"VAR a : {kind} := {value}; END_VAR {by_name(**{name: 'a'})}"
    if held is None:
        assert f"{name} is {kind}, not {value}" in str(refused(text))
    else:
        assert repr(read_st(text).words[f"LOOP-1.{name}"]) == repr(held)


@pytest.mark.parametrize("device", ["", " AT D500"])
@pytest.mark.parametrize(
    ("kind", "taken"),
    [("[0..14] OF REAL", 30), ("[1..30] OF INT", 30), ("[0..13] OF REAL", 28), ("[1..29] OF WORD", 29)],
)
def test_the_block_of_an_instruction_is_an_array_of_30_registers(device, kind, taken):
    text = f"VAR Box{device} : ARRAY {kind}; END_VAR {by_name(I_MV='Box')}"
    if taken < 30:
        assert f"I_MV takes 30 registers; Box has {taken} (line 1)" in str(refused(text))
    else:
        assert "LOOP-1.BIAS" in read_st(text).words


@pytest.mark.parametrize(
    "other", ["Target := Other;", "IF M1 THEN Target := 85.0; END_IF;", "Target := 85.0; D100 := 90.0;"]
)
def test_another_assignment_is_named(other):
    text = f"VAR_GLOBAL Target AT D100 : REAL := 70; END_VAR\n{other}\n{by_name(SV='target')}"
    assert again(text).loops[0].SV == 70
    assert found(text).notes[0] == "LOOP-1.SV is assigned in line 2, which is not carried over"


def test_a_timer_with_another_time_is_named():
    text = f"TMRH(SM400, T1, 500); IF T1 THEN {by_name()} T1 := FALSE; END_IF;"
    assert again(text).loops[0].call.timer == "T1"
    assert found(text).notes[0] == "LOOP-1: T1 runs for 500 in line 1, and CYCLE is 1000"
    assert not any("T1" in note for note in found(text.replace("500", "1000")).notes)


@pytest.mark.parametrize("time", ["1000", "K1000", "16#3E8", "1_000", "Interval", "interval"])
def test_a_time_of_a_timer_may_be_written_otherwise_than_cycle(time):
    declared = "VAR_GLOBAL Interval : DINT := 1000; Other : DINT := 900; END_VAR\n"
    text = f"{declared}TMRH(SM400, T1, {time}); IF T1 THEN {by_name()} T1 := FALSE; END_IF;"
    assert read_st(text).notes == ()
    (note,) = read_st(text.replace(f"T1, {time}", "T1, Other")).notes
    assert note == "LOOP-1: T1 runs for Other in line 2, and CYCLE is 1000"


def test_a_block_that_has_an_input_where_the_manual_wants_in_out_is_named():
    text = (DATA / "manual-4.hand.st").read_text()
    wrong = text.replace("PID_MODE : DINT; KP, KI", "KP, KI").replace(
        "PID_RUN : BOOL; SV", "PID_RUN : BOOL; PID_MODE : DINT; SV"
    )
    assert found(wrong).notes == ("AS_DPIDE: PID_MODE should be VAR_IN_OUT, as the manual says",)
    assert found(text).notes == ()


# --- refused ---------------------------------------------------------------------------------------------------------

AN_EXPRESSION = ": {} is an expression; an operand of DPIDE is a number, a symbol or a device"
NO_BIT = " is BOOL: 'D100' is not the address of a bit; write it like M10, Y0.1 or D100.5"
BITS_THERE = "X0.0 to X63.15, Y0.0 to Y63.15, D0.0 to D29999.15, M0 to M8191, S0 to S2047, SM0 to SM4095"
A_WHOLE_NUMBER = "write a whole number from -2147483648 to 2147483647"
NO_REGISTER = " is {}: '{}' is not the address of a D register; write it like D500"
WRONG = {
    BOOL: {
        **{value: f" is BOOL, not {value}; write TRUE or FALSE" for value in ("1", "0.0", "K1", "-TRUE", "T#1s")},
        "D100": NO_BIT,
        "M8192": f" is BOOL: M8192 does not exist; there are {BITS_THERE}",
        "M1 OR M2": AN_EXPRESSION.format("M1ORM2"),
    },
    DINT: {
        "1000.0": " is DINT, not 1000.0; write 1000",
        "F1.0": " is DINT, not F1.0; write 1",
        **{value: f" is DINT, not {value}; {A_WHOLE_NUMBER}" for value in ("TRUE", "2147483648", "T#1s", "5.5")},
        "M1": NO_REGISTER.format("DINT", "M1"),
        "D100 + 1": AN_EXPRESSION.format("D100+1"),
        "D30000": " is DINT: D30000 does not exist; addresses go from D0 to D29999",
        "--5": ": --5 has several signs",
        "K--5": AN_EXPRESSION.format("K--5"),
    },
    REAL: {
        "80": " is REAL, not 80; write 80.0",
        "K80": " is REAL, not K80; write 80.0",
        **{value: f" is REAL, not {value}; write a number with a point, as in 80.0" for value in ("TRUE", "T#1s")},
        "1E39": " is REAL, not 1E39; single precision goes up to 3.4E38",
        **{device: NO_REGISTER.format("REAL", device) for device in ("M1", "D1.5", "E0")},
        "D100 * 2.0": AN_EXPRESSION.format("D100*2.0"),
        "'x'": AN_EXPRESSION.format("'x'"),
        "F--1.0": AN_EXPRESSION.format("F--1.0"),
        **{value: f": {value} has several signs" for value in ("--5.0", "+-1.0E5", "-+1.0E-5")},
    },
}
"""What an operand of a type cannot be, and what is said behind its name."""


@pytest.mark.parametrize(("name", "value"), [(name, wrong) for name, row in ROWS.items() for wrong in WRONG[row.type]])
def test_an_operand_of_a_wrong_type_is_refused_at_its_place(name, value):
    text = by_name(**{name: value})
    error = refused("\n" + text)

    assert (error.line, error.column) == (2, text.index(f" {value}", text.index(f"{name} ")) + 2)
    said = WRONG[ROWS[name].type][value]
    if name in PROCESS_OPERANDS:
        by = "process" if name == "PV" else "instruction"
        no_number = f": the {by} writes it, so that it cannot be {value}; write a symbol or a device"
        said = re.sub(r"( is REAL, not|.* several signs).*", no_number, said).replace("a number, a symbol", "a symbol")
    assert str(error) == f"{name}{said}"


@pytest.mark.parametrize("name", PROCESS_OPERANDS)
def test_what_is_written_is_no_number(name):
    assert "writes it, so that it cannot be 5.0; write a symbol or a device" in str(refused(by_name(**{name: "5.0"})))


def spoils(text: str, name: str):
    """A call with one operand spoiled in each way."""
    place = re.search(rf"\b{name} (:=|=>) [^,)]+(, )?", text)
    before, part, after = text[: place.start()], place.group(), text[place.end() :]
    other = "=>" if place.group(1) == ":=" else ":="
    yield "left out", (before.rstrip(", ") if not place.group(2) else before) + after
    yield "again", before + part.rstrip(", ") + ", " + part + after
    yield "misspelt", before + part.replace(name, f"{name}X") + after
    yield "without a name", before + part.partition(f"{place.group(1)} ")[2] + after
    yield "the other sign", before + part.replace(place.group(1), other) + after
    yield "without a value", f"{before}{name} {place.group(1)} {place.group(2) or ''}{after}"
    yield "without a comma", before + part.replace(",", "") + after if place.group(2) else before + part + ", )" + after


@pytest.mark.parametrize("name", ROWS)
def test_a_spoiled_operand_of_a_call_by_name_is_refused(name):
    green = [how for how, text in spoils(by_name(), name) if not is_refused(text)]
    assert green == []


def is_refused(text: str) -> bool:
    try:
        again(text)
    except ListingError as error:
        return bool(str(error)) and error.line >= 1
    return False


@pytest.mark.parametrize("number", [1, 3, 4])
@pytest.mark.parametrize("name", ROWS)
def test_a_value_that_is_spoiled_is_seen(name, number):
    """In what pidcfg writes: another number in the call, another initial value, another device."""
    text = (DATA / f"manual-{number}.st").read_text()
    given = example(number)
    call = text.index("(* LOOP" if number != 4 else "(* U1 *)")
    value = re.search(rf"\b{name} (?::=|=>) (\S+?),?\n", text[call:])[1]
    if value.startswith(("LOOP_1_", "U1_")):
        line = re.search(rf"{value}( AT (\w+))? : \w+( := (\S+);)?", text)
        changed = [line.group().replace(line[2], spoiled(line[2]))] if line[2] else []
        changed += [line.group().replace(f":= {line[4]}", f":= {spoiled(line[4])}")] if line[4] else []
        texts = [text.replace(line.group(), change) for change in changed]
        assert texts or name == "MV"
    else:
        at = re.search(rf"\b{name} := {re.escape(value)}", text[call:])
        texts = [text[:call] + text[call:].replace(at.group(), f"{name} := {spoiled(value)}")]
    for other in texts:
        assert other != text
        assert again(other) != given


def spoiled(value: str) -> str:
    if value in {"TRUE", "FALSE"}:
        return "FALSE" if value == "TRUE" else "TRUE"
    match = re.fullmatch(r"([DM]?)(\d+)(\.\d+)?", value)
    return f"{match[1]}{int(match[2]) + 1}{match[3] or ''}"


@pytest.mark.parametrize("number", range(len(NAMED)))
def test_positions_are_counted(number):
    values = [*NAMED.values()]
    few, many = [*values[:number], *values[number + 1 :]], [*values, *values[: number + 2]]
    assert "DPIDE has 21 operands, or 22 with EN before them; 20 stand here" in str(refused(by_position(few)))
    assert f"{len(many)} stand here" in str(refused(by_position(many)))


def test_neighbours_of_other_types_cannot_be_swapped_by_position():
    """What can be swapped is what both operands take; by name nothing can."""
    values, rows, seen = [*NAMED.values()], [*ROWS.values()], 0
    for i in range(20):
        swapped = [*values[:i], values[i + 1], values[i], *values[i + 2 :]]
        if rows[i].type is not rows[i + 1].type:
            assert is_refused(by_position(swapped)), i
            seen += 1
        elif not is_refused(by_position(swapped)) and values[i] != values[i + 1]:
            assert again(by_position(swapped)) != PLAIN, i
    assert seen == 7


@pytest.mark.parametrize("statement", ["Box.DPIDE := 1;", "X := Box.DPIDE + 1;", "IF Box.DPIDE THEN Y := 1; END_IF;"])
def test_a_member_of_the_instructions_name_is_no_call_of_it(statement):
    assert again(f"{by_name()}\n{statement}") == PLAIN
    assert "statements that are not about DPIDE are left out: lines 2" in found(f"{by_name()}\n{statement}").notes


@pytest.mark.parametrize("programs", [1, 2])
def test_an_external_variable_is_the_global_one(programs):
    begin = "VAR_GLOBAL a AT D100 : REAL := 7.0; END_VAR\n"
    external = "PROGRAM P{}\nVAR_EXTERNAL a : REAL; END_VAR\nX := 1;\nEND_PROGRAM\n"
    others = "".join(external.format(i) for i in range(programs))
    call = by_name(SV="a")
    plain, read = (
        found(f"{begin}PROGRAM M\n{call}\nEND_PROGRAM"),
        found(f"{begin}{others}PROGRAM M\n{call}\nEND_PROGRAM"),
    )
    (loop,) = read.data["loops"]
    assert (loop["SV"], loop["devices"]["SV"]) == (7, "D100")
    assert read.data == plain.data
    with pytest.raises(ListingError, match="a is declared again"):
        found(f"{begin}{others.replace('a :', 'a AT D7 :')}PROGRAM M\n{call}\nEND_PROGRAM")
    with pytest.raises(ListingError, match="a is declared with another type than in line 1"):
        found(f"{begin}{others.replace('REAL', 'DINT')}PROGRAM M\n{call}\nEND_PROGRAM")


@pytest.mark.parametrize(
    ("text", "message", "place"),
    [
        ("X := 1;", "no call of DPIDE", (1, 1)),
        (by_name() + "\n" + by_name(), "LOOP-2", None),
        (by_name()[:-2] + ", ENO => M1, Q := 1);", "DPIDE has no operand Q", (1, 333)),
        (f"IF THEN {by_name()} END_IF;", "a condition is missing before THEN", (1, 4)),
        (f"IF M1 THEN ; ELSIF\nTHEN {by_name()} END_IF;", "a condition is missing before THEN", (2, 1)),
        (f"IF M1 THEN ; ELSE ;\nELSIF M2 THEN {by_name()} END_IF;", "'END_IF' is missing after the statements", (2, 1)),
        (f"IF M1 THEN ; ELSE ;\nELSE {by_name()} END_IF;", "'END_IF' is missing after the statements", (2, 1)),
        (f"IF M1 THEN {by_name()} X := 1 END_IF;", "the statement that begins here has no end", (1, 334)),
        (f"FOR i := 1 TO 2 DO\n{by_name()} END_FOR;", "DPIDE stands inside FOR", (2, 1)),
        (f"X := 1 +\nDPIDE({by_name()[6:]}", "DPIDE stands inside another statement", (2, 1)),
        (by_name()[:-2], "has no end", (1, 1)),
        (f"IF M1\n{by_name()} END_IF;", "unexpected ';'", (2, 321)),
        (f"PROGRAM A\n{by_name()}", "PROGRAM A has no END_PROGRAM", (1, 1)),
        (f"PROGRAM\n; {by_name()}\nEND_PROGRAM", "a name is missing after PROGRAM, before ';'", (2, 1)),
        (
            f"FUNCTION_BLOCK 5 {by_name()}\nEND_FUNCTION_BLOCK",
            "a name is missing after FUNCTION_BLOCK, before '5'",
            (1, 16),
        ),
        (f"PROGRAM A\nPROGRAM B {by_name()}\nEND_PROGRAM END_PROGRAM", "PROGRAM A has no END_PROGRAM", (1, 1)),
        (f"TYPE A : INT;\n{by_name()}", "TYPE has no END_TYPE", (1, 1)),
        (f"RETAIN {by_name()}", "RETAIN stands here without its beginning", (1, 1)),
        (f"END_VAR {by_name()}", "END_VAR stands here without its beginning", (1, 1)),
        ("(* open\n" + by_name(), "the comment that begins here with (* has no end", (1, 1)),
        (f"VAR a AT %MD5 : REAL; END_VAR {by_name()}", "%MD5 is no device of the PLC; write it like D100", (1, 10)),
        (f"VAR a AT Q0.5 : BOOL; END_VAR {by_name()}", "Q0.5 is no device of the PLC; write it like D100", (1, 10)),
        (f"VAR a, A : REAL; END_VAR {by_name()}", "A is declared again", (1, 8)),
        (f"VAR a : INT; END_VAR\n{by_name(SV='a')}", "SV is REAL; a is declared as INT in line 1", (2, 29)),
        (f"VAR a : REAL; END_VAR\n{by_name(CYCLE='a')}", "CYCLE is DINT or DWORD; a is declared as REAL", (2, 109)),
        (
            f"VAR a AT D0 : ARRAY [0..13] OF REAL; END_VAR\n{by_name(I_MV='a')}",
            "I_MV takes 30 registers; a has 28 (line 1)",
            None,
        ),
        (f"VAR a AT D0 : REAL := TRUE; END_VAR\n{by_name(SV='a')}", "SV is REAL, not TRUE", (1, 23)),
        (by_name(CYCLE="5.0"), "CYCLE is DINT, not 5.0; write 5", (1, 109)),
        (by_name(CYCLE="5.5"), "CYCLE is DINT, not 5.5; write a whole number from -2147483648 to 2147483647", (1, 109)),
        (by_name(SV="5"), "SV is REAL, not 5; write 5.0", (1, 29)),
        (by_name(CYCLE="K-5.0"), "K-5.0: K stands before whole numbers", (1, 109)),
        (by_name(CYCLE="K-" + "9" * 5000), "K-" + "9" * 38 + " is no number", (1, 109)),
        (f"VAR a AT D0 : REAL := b; END_VAR\n{by_name(SV='a')}", "a begins with something that is no number", (1, 23)),
        (by_name(SV="D100"), "LOOP-1.SV stands in D100, and nothing says what it holds; name a symbol table", None),
        ('(* loop: {"name": 1} *)' + by_name(), "the comment names no loop", (1, 1)),
        ('(* loop: {"loop": } *)' + by_name(), "the settings are not JSON", (1, 1)),
        ('(* loop: {"loop": "A"} *)(* loop: {"loop": "a"} *)' + by_name(), "a stands in a comment again", (1, 26)),
    ],
)
def test_what_cannot_be_read_is_refused_with_its_place(text, message, place):
    if "LOOP-2" in message:
        assert [loop.name for loop in again(text).loops] == ["LOOP-1", "LOOP-2"]
        return
    error = refused(text)
    assert message in str(error)
    assert place is None or (error.line, error.column) == place


MISSING = "an operand of DPIDE is missing before ','"
HALF = by_name()[: by_name().index("SV := ")]
"""A call up to its second operand."""


@pytest.mark.parametrize(
    ("text", "message", "column"),
    [
        (by_name().replace("SV := 80", "5 := 80"), "the name of an operand of DPIDE stands before :=, as", None),
        (by_name().replace("SV := 80", "SV.X := 80"), "the name of an operand of DPIDE stands before :=, as in", None),
        (by_name().replace("SV := 80", "5 => 80"), "the name of an operand of DPIDE stands before =>, as in", None),
        (by_name(SV=""), MISSING, None),
        (by_name().replace("SV := 80.0", ""), MISSING, None),
        (by_name().replace("SV := 80.0", "D700"), "D700 has no name; operands of DPIDE are all named", None),
        (by_name().replace("SV := 80.0", "XSV := 80.0"), "DPIDE has no operand XSV; did you mean SV?", None),
        (by_name().replace("SV := 80.0", "SV => 80.0"), "SV is an input of DPIDE; write SV := 80.0", None),
        (by_name().replace("SV := 80.0", "PID_RUN := M1"), "PID_RUN stands here again", None),
        (by_name()[:-2] + ",);", "an operand of DPIDE is missing after the comma", len(by_name()[:-2]) + 2),
        (by_name()[:-1] + " + 1;", "'+' stands behind the call of DPIDE", len(by_name())+ 1),
        (by_name(SV=None), "DPIDE has 20 of its 21 operands here; write SV, too", 1),
        (by_name(SV=None, CYCLE=None, MV=None), "DPIDE has 18 of its 21 operands here; write SV, CYCLE, MV, too", 1),
        (by_position([*NAMED.values()][:20]), "DPIDE has 21 operands, or 22 with EN before them; 20 stand here", 1),
        (by_position([*NAMED.values(), *["D0"] * 2]), "with EN before them; 23 stand here", len(by_position()) + 5),
    ],
)  # fmt: skip
def test_a_call_that_is_not_one_of_the_instruction_says_where_and_why(text, message, column):
    error = refused(text)
    assert message in str(error)
    assert (error.line, error.column) == (1, len(HALF) + 1 if column is None else column)


@pytest.mark.parametrize(
    ("operand", "tokens", "message"),
    [
        ("SV", ("a", "*", "2"), "a*2 is an expression; an operand of DPIDE is a number, a symbol or a device"),
        ("PV", ("a", "*", "2"), "a*2 is an expression; an operand of DPIDE is a symbol or a device"),
        ("PV", ("-", "5.0"), "the process writes it, so that it cannot be -5.0"),
        ("MV", ("-", "5.0"), "the instruction writes it, so that it cannot be -5.0"),
        ("SV", ("+", "+", "5.0"), "++5.0 has several signs"),
        ("CYCLE", ("-", "5.5"), "CYCLE is DINT, not -5.5"),
        ("CYCLE", ("K", "-", "5.0"), "K-5.0: K stands before whole numbers"),
        ("SV", ("F", "-", "5.0", ".", "5"), "F-5.0.5 is no number"),
        ("SV", ("-", "TRUE"), "SV is REAL, not -TRUE"),
        ("PID_DIR", ("-", "TRUE"), "PID_DIR is BOOL, not -TRUE; write TRUE or FALSE"),
        ("SV", ("a", ".", "b"), "a.b is an expression"),
        ("PID_DIR", ("X0", ".", "16"), "PID_DIR is BOOL: X0.16 does not exist"),
    ],
)
def test_what_stands_at_an_operand_is_refused_at_its_first_word(operand, tokens, message):
    error = refused(by_name(**{operand: "\n".join(("", *tokens))}))
    assert message in str(error)
    assert (error.line, error.column) == (2, 1)


@pytest.mark.parametrize("tokens", [("b", "+", "1"), ("-", "b"), ("(", "5.0", ")")])
def test_an_initial_value_that_is_no_number_is_refused_at_its_first_word(tokens):
    error = refused("VAR a AT D0 : REAL :=" + "\n".join(("", *tokens)) + f"; END_VAR {by_name(SV='a')}")
    assert str(error) == "a begins with something that is no number"
    assert (error.line, error.column) == (2, 1)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("U1(PID_RUN := DPIDE_PID_RUN, ", "U1(", "the call of AS_DPIDE has no PID_RUN, which is PID_RUN of DPIDE"),
        ("KP := DPIDE_KP, ", "", "the call of AS_DPIDE has no KP, which is Kc_Kp of DPIDE"),
        ("ERR := DPIDE_ERR", "ERR := DPIDE_EQ", "ERR_DBW is REAL; DPIDE_EQ is declared as BOOL"),
        ("MV => DPIDE_MV)", "MV := DPIDE_MV)", "MV is an output of AS_DPIDE; write MV => DPIDE_MV"),
        ("KI := DPIDE_KI", "KX := DPIDE_KI", "AS_DPIDE has no operand KX; did you mean K"),
        ("T0 := FALSE;", "U1(); T0 := FALSE;", "U1 is called again, after line"),
        ("U1 : AS_DPIDE", "U1 : OTHER", "no call of DPIDE, and none of a function block"),
        ("END_FUNCTION_BLOCK", "DPIDE(); END_FUNCTION_BLOCK", "DPIDE stands in AS_DPIDE again"),
        (
            ", ERR, MV_MAX, MV_MIN, MOUT, BIAS, I_MV, MV)",
            ")",
            "15 stand here",
        ),
        ("END_VAR\nDPIDE(SM400", "END_VAR\nIF M1 THEN END_IF; DPIDE(SM401 AND", None),
    ],
)
def test_a_spoiled_function_block_is_refused(old, new, message):
    text = (DATA / "manual-4.hand.st").read_text()
    assert text.count(old) == 1
    if message is None:
        assert again(text.replace(old, new)) == example(4)
    else:
        assert message in str(refused(text.replace(old, new)))


@pytest.mark.parametrize(
    ("old", "new", "message", "line"),
    [
        (
            "END_FUNCTION_BLOCK",
            "\nDPIDE(); END_FUNCTION_BLOCK",
            "DPIDE stands in AS_DPIDE again; one function block",
            16,
        ),
        (
            "DPIDE(SM400",
            "IF SM1 THEN\nDPIDE(SM400",
            "DPIDE stands inside the IF of line 13 in AS_DPIDE; call AS_DPIDE",
            14,
        ),
        ("PID_RUN, SV, PV", "PID_RUN, CYCLE, PV", "SV is REAL; CYCLE is declared as DINT in line 4", 13),
        (", BIAS := DIPDE_BIAS", "", "the call of AS_DPIDE has no BIAS, which is BIAS of DPIDE", 33),
    ],
)
def test_what_a_function_block_has_wrong_is_told_at_its_line(old, new, message, line):
    text = (DATA / "manual-4.hand.st").read_text().replace(old, new, 1)
    if "THEN" in new:
        text = text.replace("I_MV, MV);\nEND_FUNCTION_BLOCK", "I_MV, MV); END_IF;\nEND_FUNCTION_BLOCK")
    error = refused(text)
    assert message in str(error)
    assert line is None or error.line == line


@pytest.mark.parametrize(
    ("old", "new", "held"),
    [
        ("PV, PID_MODE", "PV, PID_MODE", 0.0),
        ("MOUT, BIAS : REAL;", "MOUT : REAL; BIAS : REAL := 2.5;", 2.5),
        ("MOUT, BIAS, I_MV, MV)", "MOUT, 3.5, I_MV, MV)", 3.5),
        ("MOUT, BIAS, I_MV, MV)", "MOUT, Own, I_MV, MV)", 4.5),
    ],
)
def test_an_operand_of_a_function_block_is_its_argument_or_what_stands_in_the_block(old, new, held):
    text = (DATA / "manual-4.hand.st").read_text().replace(old, new, 1)
    text = text.replace("END_VAR\nDPIDE(", "END_VAR\nVAR Own : REAL := 4.5; END_VAR\nDPIDE(")
    if held:
        text = text.replace(", BIAS := DIPDE_BIAS", "").replace("DIPDE_BIAS", "Unused")
    loop = again(text).loops[0]
    assert float(loop.BIAS) == held


def test_a_parameter_of_an_instance_that_is_assigned_is_no_call():
    text = (DATA / "manual-4.hand.st").read_text().replace("T0 := FALSE;", "T0 := FALSE;\nU1.SV := 5.0;")
    assert again(text) == example(4)
    assert read_st(text).notes[-1] == "statements that are not about DPIDE are left out: lines 39"


def test_a_function_block_without_the_instruction_is_left_out():
    other = "FUNCTION_BLOCK Other\nVAR_INPUT a : REAL; END_VAR\na := 1.0;\nEND_FUNCTION_BLOCK\n"
    assert read_st(other + by_name()).notes[-1] == "statements that are not about DPIDE are left out: lines 3"


@SLOW
@given(cut=st.integers(0, 3000), length=st.integers(1, 40))
def test_a_text_with_a_hole_gives_a_configuration_or_an_error(cut, length):
    for number in (3, 4):
        text = (DATA / f"manual-{number}.hand.st").read_text()
        at = cut % len(text)
        spoilt = text[:at] + text[at + length :]
        result = decode(spoilt, "dpide", format="st")
        assert result.ok or result.findings[0].span.line >= 1


# --- What a program in Structured Text does with operands of DPIDE besides the call: named with its line --------------

OPERANDS = (
    "PID_RUN := Run, SV := 80.0, PV := D102, PID_MODE := 0, PID_MAN := Man, MOUT_AUTO := FALSE, CYCLE := 1000, "
    "Kc_Kp := Kp, Ti_Ki := 180.0, Td_Kd := 0.0, Tf := 0.0, PID_EQ := TRUE, PID_DE := TRUE, PID_DIR := TRUE, "
    "ERR_DBW := 0.0, MV_MAX := 100.0, MV_MIN := 0.0, MOUT := 0.0, BIAS := 0.0, I_MV := D500, MV => D104"
)
ASSIGNED = "LOOP-1.{} is assigned in line {}, which is not carried over"
PASSED = (
    "LOOP-1.Kc_Kp stands in a call that is not DPIDE's, and may be written there, in line 2, which is not carried over"
)
JUMP = "{} in line 2 is not carried over: what stands behind is not always executed"
LEFT = "statements that are not about DPIDE are left out: lines 2"


def program(statements: str) -> str:
    """A program with one instruction; the statements begin in line 2."""
    declared = "VAR Kp AT D110 : REAL := 2.0; Man : BOOL := FALSE; Run AT Y0.1 : BOOL := TRUE; END_VAR"
    return f"{declared}\n{statements}\nDPIDE({OPERANDS});\n"


@pytest.mark.parametrize(
    ("statements", "note"),
    [
        ("CASE D1 OF 1: Kp := 5.0; END_CASE", ASSIGNED.format("Kc_Kp", 2)),
        ("FOR D1 := 1 TO 3 DO\nD110 := 9.0; END_FOR", ASSIGNED.format("Kc_Kp", 3)),
        ("DMOV(IN := 9.0, OUT => D110);", ASSIGNED.format("Kc_Kp", 2)),
        ("Man S= M3;", ASSIGNED.format("PID_MAN", 2)),
        ("IF M3 THEN Man R= M4; END_IF", ASSIGNED.format("PID_MAN", 2)),
        ("DMOV(9.0, Kp);", PASSED),
        ("DMOV(EN := M0, S := 9.0, D := kp);", PASSED),
        ("CASE D1 OF 1: DMOV(9.0, Kp); END_CASE", PASSED),
        ("X := Kp + 1.0;", LEFT),
        ("Kp\n:= D7;", ASSIGNED.format("Kc_Kp", 2)),
        ("Run := M3;", ASSIGNED.format("PID_RUN", 2)),
        ("Y0.1 := FALSE;", ASSIGNED.format("PID_RUN", 2)),
        ("Kp := Kp + 1.0;", ASSIGNED.format("Kc_Kp", 2)),
        ("CASE D1 OF 1: Kp := 5.0; 2: Kp := 6.0; END_CASE", ASSIGNED.format("Kc_Kp", 2)),
        ("X := ABS(Kp);", LEFT),
        ("X := Kp = 5.0;", LEFT),
        ("X := (Kp) = 5.0;", LEFT),
        ("IF (Kp) = 5.0 THEN X := Man; END_IF", LEFT),
        ("CASE D1 OF 1: X := R; END_CASE", LEFT),
        ("Scale(D104, D300);", LEFT),
        ("Other(Kp := 3.0);", LEFT),
        ("IF M0 THEN RETURN; END_IF", JUMP.format("RETURN")),
        ("CASE D1 OF 1: JMP a; END_CASE", JUMP.format("JMP")),
    ],
)
def test_what_is_left_out_is_named_as_what_it_does(statements, note):
    assert read_st(program(statements)).notes == (note,)


def test_a_program_may_begin_with_a_pragma():
    assert detect_kind("{attribute 'x'}\n" + program(""), FORMATS).name == "st"
