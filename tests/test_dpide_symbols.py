"""A symbol table of ISPSoft is read back, alone or beside a program that says which symbols are operands."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import pidcfg
from dpide_strategies import configurations
from pidcfg.api import decode
from pidcfg.encoders.dpide.files import FORMATS
from pidcfg.encoders.dpide.image import encode
from pidcfg.encoders.listing import ListingError, detect_kind
from pidcfg.encoders.maps.dpide import PROCESS_OPERANDS, ROWS
from pidcfg.schemas.dpide import DpideFile
from test_dpide_encoding import configuration
from test_dpide_files import USERS, merged
from test_dpide_st import DATA, NAMES, by_name

SLOW = settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.too_slow])
HEAD = "Class,Identifiers,Address,Type,Initial Value,Comment\r\n"


def table(config: DpideFile) -> str:
    return FORMATS["symbols"].write(encode(config).image, ())


def words(config: DpideFile) -> dict:
    """What operands hold, by operand and number of the loop; PV is the process's."""
    image = encode(config).image
    order = {entry["loop"]: i for i, entry in enumerate(image.settings)}
    return {(order[cell.loop], cell.field): cell.raw for cell in image.cells if cell.field != "PV"}


@SLOW
@given(config=configurations(NAMES))
def test_every_operand_and_device_comes_back(config):
    text = table(config)
    assert detect_kind(text, FORMATS) is FORMATS["symbols"]
    result = decode(text.encode("gbk"), "dpide")
    assert result.ok
    found = DpideFile.model_validate(result.data)
    assert words(found) == words(config)
    assert [(loop.device, loop.devices) for loop in found.loops] == [
        (loop.device, loop.devices) for loop in config.loops
    ]
    assert table(found).replace("; ", ",").count("\n") == text.count("\n")


@pytest.mark.parametrize("count", [1, 2, 3, len(ROWS) - 1, len(ROWS)])
def test_a_loop_is_a_block_with_the_symbols_of_other_operands_beside_it(count):
    """D610: a symbol in _IMV alone may be anything; one that is missing beside others would leave a default."""
    head, *rows = table(configuration()).splitlines(keepends=True)
    block = next(row for row in rows if ",OVEN_IMV," in row)
    others = [row for row in rows if row is not block][: count - 1]
    text = head + block + "".join(others)
    if count in {1, len(ROWS)}:
        assert [entry["loop"] for entry in FORMATS["symbols"].read(text).settings] == ["OVEN"] * (count > 1)
        return
    with pytest.raises(
        ListingError, match=r"OVEN has no symbol OVEN_\w+.*; a loop has one for each operand"
    ) as refused:
        FORMATS["symbols"].read(text)
    assert refused.value.line == 2


@pytest.mark.parametrize(("value", "held"), [("", None), ("5.5", 5.5), ("7", 7.0), ("0", 0.0)])
def test_a_pv_may_begin_with_a_value_and_need_not(value, held):
    text = re.sub(r"(?m)^(VAR,OVEN_PV,[^,]*,REAL),[^,]*,", rf"\1,{value},", table(configuration()))
    assert FORMATS["symbols"].read(text).words.get("OVEN.PV") == held


def test_units_come_back_from_comments_that_are_all_ours():
    config = configuration(pv={"unit": "degC"}, output={"unit": "%"})
    text = table(config)
    found = decode(text.encode("gbk"), "dpide")
    assert table(DpideFile.model_validate(found.data)) == text
    other = decode(text.replace("SV: Target value; degC", "SV: as on the panel; degC").encode("gbk"), "dpide")
    assert [sorted({"pv", "output"} & set(loop)) for loop in other.data["loops"]] == [["output"]]


def test_symbols_that_were_added_to_a_table_of_the_users_are_read_out_of_it():
    text, _ = merged(USERS)
    result = decode(text.encode("gbk"), "dpide")

    assert result.ok
    assert (
        result.data["loops"]
        == decode(table(configuration(devices={"SV": "D100", "PID_RUN": "M10"})), "dpide").data["loops"]
    )
    assert not any("Door" in note for note in result.notes)


@pytest.mark.parametrize("blank", ["\n", " \n", ",,,,,\n"])
def test_lines_without_a_symbol_are_passed_over(blank):
    text = pidcfg.encode(Path(__file__).parents[1] / "examples/dpide/oven.yaml", "symbols").text
    rows = text.splitlines(keepends=True)
    spaced = "".join([rows[0], blank, *rows[1:], blank])
    assert pidcfg.decode(spaced, "dpide").text == pidcfg.decode(text, "dpide").text


def test_a_table_without_loops_says_what_is_wanted():
    (finding,) = decode(USERS.encode("gbk"), "dpide").findings
    assert "holds no operand of a DPIDE instruction" in finding.message


@pytest.mark.parametrize("operand", [name for name in ROWS if name != "I_MV"])
def test_a_missing_symbol_is_refused(operand):
    lines = table(configuration()).splitlines(keepends=True)
    (gone,) = [line for line in lines if f",{operand}: " in line]
    (finding,) = decode("".join(line for line in lines if line != gone), "dpide").findings

    assert f"OVEN has no symbol {gone.split(',')[1]}" in finding.message


@pytest.mark.parametrize(
    ("operand", "value"),
    [(name, bad) for name in ROWS if name not in PROCESS_OPERANDS for bad in ("x", "1.5.2", "T#1s", "5 5")],
)
def test_an_initial_value_that_is_none_is_refused_with_its_line(operand, value):
    text = table(configuration())
    number, line = next((i, line) for i, line in enumerate(text.splitlines(), 1) if f",{operand}: " in line)
    cells = line.split(",")
    cells[4] = value
    (finding,) = decode(text.replace(line, ",".join(cells)), "dpide").findings
    assert finding.span.line == number


@pytest.mark.parametrize("operand", [name for name in ROWS if name not in PROCESS_OPERANDS])
def test_an_initial_value_that_is_spoiled_is_seen(operand):
    config = configuration()
    line = next(line for line in table(config).splitlines() if f",{operand}: " in line)
    cells = line.split(",")
    cells[4] = {"TRUE": "FALSE", "FALSE": "TRUE"}.get(cells[4]) or f"7{cells[4]}"
    result = decode(table(config).replace(line, ",".join(cells)), "dpide")
    assert words(DpideFile.model_validate(result.data)) != words(config)


@pytest.mark.parametrize("operand", ["SV", "CYCLE", "MV_MAX"])
def test_what_must_be_known_and_has_no_initial_value_is_refused(operand):
    text = re.sub(rf"(OVEN_\w+,\w*,\w+),[^,]*,({operand}: )", r"\1,,\2", table(configuration()))
    (finding,) = decode(text, "dpide").findings
    assert f"OVEN.{operand} stands in OVEN_" in finding.message


def test_bytes_that_are_neither_utf_8_nor_gbk_are_refused():
    (finding,) = decode(HEAD.encode() + b"VAR,A,D0,REAL,0,\xff\xff\r\n", "dpide").findings
    assert "is not UTF-8" in finding.message


# --- beside a program ------------------------------------------------------------------------------------------------


def without_values(text: str) -> str:
    """A program that declares nothing but its variables, as ISPSoft has them in its tables."""
    return re.sub(r"(?: AT \S+)?( : \w+)(?: := [^;]+)?;", r"\1;", text)


@SLOW
@given(config=configurations(NAMES), reverse=st.booleans())
def test_a_program_and_its_symbols_give_the_whole(config, reverse):
    config = DpideFile.model_validate({**config.model_dump(), "loops": config.model_dump()["loops"][:1]})
    program = without_values(FORMATS["st"].write(encode(config).image, ()))
    files = [program.encode(), table(config).encode("gbk")]
    result = decode(files[::-1] if reverse else files, "dpide", name=["a", "b"])

    assert result.ok
    found = DpideFile.model_validate(result.data)
    assert words(found) == words(config)
    assert (found.loops[0].device, found.loops[0].devices, found.loops[0].call) == (
        config.loops[0].device,
        config.loops[0].devices,
        config.loops[0].call,
    )


def test_symbols_of_any_name_are_those_that_the_program_calls():
    program = by_name(SV="Target", BIAS="D106", MV="Valve", I_MV="Memory", PID_DIR="Heats")
    rows = "VAR,target,D100,REAL,61.5,\r\nVAR,x,D106,REAL,-4,\r\nVAR,valve,D104,REAL,,\r\nVAR,memory,D500,REAL,,\r\n"
    result = decode([program, f"{HEAD}{rows}VAR,HEATS,M5,BOOL,TRUE,\r\n"], "dpide", name=["p.st", "s.csv"])

    (loop,) = DpideFile.model_validate(result.data).loops
    assert (loop.SV, loop.BIAS, loop.device, loop.PID_DIR) == (61.5, -4, "D500", True)
    assert loop.devices.by_operand() == {
        "SV": "D100",
        "BIAS": "D106",
        "MV": "D104",
        "PV": "D102",
        "PID_RUN": "M10",
        "PID_DIR": "M5",
    }


def test_a_symbol_at_another_device_than_in_the_program_is_refused():
    program = f"VAR_GLOBAL Target AT D100 : REAL; END_VAR\n{by_name(SV='Target')}"
    files = [f"{HEAD}VAR,Target,D110,REAL,5,\r\n", program]
    (finding,) = decode(files, "dpide", name=["s.csv", "p.st"]).findings

    assert finding.message == "Target is D100 in the program, and has D110 in line 2 of the table"
    assert (finding.file, finding.span.line) == ("p.st", 2)


def test_what_the_program_says_counts_and_other_loops_are_named():
    program = f"VAR_GLOBAL Target : REAL := 50.0; END_VAR {by_name(SV='Target')}"
    result = decode([program, table(configuration()) + "VAR,Target,D100,REAL,5,\r\n"], "dpide", name=["a", "b"])

    assert result.data["loops"][0]["SV"] == 50
    assert "the symbol table has symbols of OVEN, which the program does not call" in result.notes


def test_the_manuals_example_with_its_symbols_in_a_table():
    text = (DATA / "manual-4.st").read_text()
    config = DpideFile.model_validate(decode(text, "dpide").data)
    result = decode([without_values(text), table(config)], "dpide", name=["a", "b"])
    assert result.data == {
        **decode(text, "dpide").data,
        "loops": [{key: value for key, value in decode(text, "dpide").data["loops"][0].items() if key != "PV"}],
    }


@pytest.mark.parametrize(("first", "noted"), [("41.0", True), ("40.0", False), ("0", False), ("", False)])
def test_a_first_value_that_contradicts_the_program_is_told(first, noted):
    path = Path(__file__).parents[1] / "examples/dpide/oven.yaml"
    program, table = (pidcfg.encode(path, kind).text for kind in ("st", "symbols"))
    assert "OVEN_KP,D112,REAL,40.0," in table
    table = table.replace("OVEN_KP,D112,REAL,40.0,", f"OVEN_KP,D112,REAL,{first},")
    back = pidcfg.decode([program, table], "dpide", name=["p.st", "s.csv"])
    assert back.data["loops"][0]["Kc_Kp"] == 40
    told = [note for note in back.notes if "the program's counts" in note]
    assert told == (["OVEN.Kc_Kp: the program says 40.0, the symbol table 41.0; the program's counts"] if noted else [])
