"""Modbus maps that the user states, of three vendors whose manuals print none, and of a CLICK behind a gateway."""

import io
import re
import shutil
import struct
import subprocess
from dataclasses import replace

import pytest

import pidcfg
from live_rig import CLICK, Registers, run, words_of
from map_rig import EXAMPLES, OFFERED, example, filled, numbered, virtual, words_by
from pidcfg.encoders import modbus_map as map_template
from pidcfg.encoders.codecs import DecodeError
from pidcfg.encoders.dpide.files import device_of
from pidcfg.encoders.listing import Place, named_modbus_kind
from pidcfg.encoders.maps.click import SPACE as CLICK_SPACE
from pidcfg.encoders.maps.ezlogix import MAP_SPACE
from pidcfg.encoders.modbus_map import (
    MapError,
    NamedNumbering,
    Point,
    Symbols,
    UnusableMapError,
    bits_of_place,
    read_map,
    read_map_rows,
    read_symbol_map,
)
from pidcfg.encoders.parameters import Entry, Program, raw_of, types_of
from pidcfg.encoders.parameters import register_content as content_of
from pidcfg.live.link import PlcError
from pidcfg.live.reading import NamedRegisters
from pidcfg.schemas.iec import AUTOTUNE_MODE, BOOL, DINT, INT, REAL, TIME, UINT, USINT, Wire
from pidcfg.sim.controllers.settings import RegisterError
from pidcfg.text.diagnostics import Severity
from pidcfg.text.reader import DEFAULT
from pidcfg.validate.map_files import MapFile, map_of_data, numbering_of
from pidcfg.vendors import VENDORS
from test_serve import served

OVEN = example("ezlogix")
MAP = "symbol,table,register,type\nR1,holding,1000,uint16\n# the discretes\nS1,coil,200,bool\nR140,input,7,uint16\n"
GATEWAY = "C1,discrete,0,bool\nDS1,input,5000,int16\nDF1,holding,0,float32,high-first\n"
NOBODY = "modbus://127.0.0.1:1"
KINDS = [
    ("ezlogix", None),
    ("dpide", None),
    ("dpide", "dryer"),
    ("nextopid", None),
    ("nextopid", "autotune"),  # an enumeration, UINT
    ("nextopid", "furnace"),  # INT
]


@pytest.mark.parametrize("order", ["low-first", "high-first"])
@pytest.mark.parametrize(("vendor", "name"), KINDS)
def test_what_a_map_encodes_is_pulled_and_compared(desk, vendor, name, order):
    path = example(vendor, name)
    text = filled(path, order, bits=order == "high-first")
    with desk.plc(Registers(words_by(path, text))) as url:
        assert pidcfg.compare(path, url, map=text).same
        result = pidcfg.pull(url, like=path, map=text)
    assert result.image.words == pidcfg.encode(path).image.words
    assert pidcfg.encode(result.text).image.words == result.image.words


@pytest.mark.parametrize(
    ("kind", "content", "raw"),
    [
        (BOOL, True, 1),
        (REAL, -2.4, 0xC019999A),
        (INT, -2, 0xFFFE),
        (INT, 32767, 0x7FFF),
        (UINT, 65535, 0xFFFF),
        (USINT, 255, 0xFF),
        (DINT, -2, 0xFFFFFFFE),
        (DINT, 2147483647, 0x7FFFFFFF),
        (TIME, "T#4294967295ms", 0xFFFFFFFF),
        (AUTOTUNE_MODE, "AUTOTUNE_PID", 2),
    ],
)
def test_what_a_type_is_in_registers(kind, content, raw):
    assert raw_of(kind, content) == raw
    assert content_of(kind, raw) == content
    assert types_of(kind)


@pytest.mark.parametrize(("kind", "raw"), [(USINT, 256), (AUTOTUNE_MODE, 3), (REAL, 0x7FC00000)])
def test_what_is_no_value_of_a_type(kind, raw):
    with pytest.raises(DecodeError):
        content_of(kind, raw)


def test_words_of_a_program_are_data_too(desk):
    path = example("nextopid")
    text = filled(path)
    with desk.plc(Registers(words_by(path, text))) as url:
        data = pidcfg.pull(url, like=path, map=text, format="json").to_json()
    assert (data["version"], data["plc"], data["vendor"]) == (1, url.removeprefix("modbus://"), "nextopid")
    assert {"TIC_1.Kp", "TIC_1.SP"} <= {row["address"] for row in data["words"]}


def test_signals_of_a_program_have_registers_too(desk):
    path = example("nextopid", "diagnostics")
    text = f"{filled(path)}TT_101,input,5,float32,high-first\nHold,holding,9900,int16\nAlarm_1,discrete,3,bool\n"
    words = words_by(path, text)
    assert words["input", 5] == 0x4220
    with desk.plc(Registers(words | {("holding", 9900): 0xFFFE})) as url:
        assert pidcfg.pull(url, like=path, map=text).image.words["Hold"] == -2


@pytest.mark.parametrize("vendor", EXAMPLES)
@pytest.mark.parametrize("order", ["low-first", "high-first"])
def test_what_serve_holds_is_what_was_encoded(vendor, order):
    path = example(vendor)
    text = filled(path, order, bits=order == "high-first")
    plc = virtual(vendor, text)
    for (table, register), content in words_by(path, text).items():
        assert plc.read(table, register, 1) == [content]


@pytest.mark.parametrize("vendor", EXAMPLES)
def test_a_map_of_the_other_order_is_seen(desk, vendor):
    path = example(vendor)
    text = filled(path)
    with desk.plc(Registers(words_by(path, text))) as url:
        other = text.replace("low-first", "high-first")
        assert other == text or not pidcfg.compare(path, url, map=other).same


def test_a_difference_names_its_register(desk):
    path = example("nextopid")
    text = filled(path)
    (gain,) = (place for cell, place in numbered(path, text) if cell.address == "TIC_1.Kp")
    words = words_by(path, text)
    with desk.plc(Registers(words | {(gain.table, gain.register): words[gain.table, gain.register] ^ 1})) as url:
        (finding,) = pidcfg.compare(path, url, map=text).findings
        at = f"at holding {gain.register} ({40001 + gain.register})"
        assert f"(TIC_1.Kp 3.0000002 {at})" in finding.message
    with (
        desk.plc(Registers(words | {(gain.table, gain.register + 1): 0x7F80})) as url,
        pytest.raises(PlcError, match=r"TIC_1.Kp, holding \d+ \(\d+\), is no REAL: 0x7F800000 is not a finite"),
    ):
        pidcfg.compare(path, url, map=text)


def test_a_difference_names_its_device_and_register(desk):
    path = example("dpide")
    text = filled(path)
    words = words_by(path, text)
    with desk.plc(Registers(words | {("holding", 1112): 1})) as url:
        (finding,) = pidcfg.compare(path, url, map=text).findings
    assert "(D112 40.000004 at holding 1112 (41113))" in finding.message
    with desk.plc(Registers(words_by(OVEN, MAP) | {("holding", 1102): 801})) as url:
        (finding,) = pidcfg.compare(OVEN, url, map=MAP).findings
    assert "(R103 801 at holding 1102 (41103))" in finding.message


def saved(folder, text):
    """The file of a map."""
    (folder / "map.csv").write_text(text, "utf-8")
    return folder / "map.csv"


def test_what_no_register_has_is_told(desk, tmp_path):
    path = example("nextopid")
    text = re.sub(r"PidLoops.TIC_1.Direct,.*", "TIC_1.Direct,none", filled(path))
    with desk.plc(Registers(words_by(path, text))) as url:
        result = pidcfg.compare(path, url, map=text)
        said = run("compare", path, "--plc", url, "--map", saved(tmp_path, text)).stderr
    assert result.same
    assert result.unread[0] == "TIC_1.Direct"
    assert result.notes == ()
    first = next(d for d in result.warnings if "map says" in d.message)
    assert (first.code, first.severity, first.loop) == ("PID069", Severity.WARNING, "TIC_1")
    assert first.message == "could not be read, since the map says that no register has them: Direct"
    assert said.endswith(f": alike as far as read; {len(result.unread)} settings could not be read\n")


UNSEEN = [
    ("ezlogix/dosing", "action: reverse", "action: direct", "FLOW.action"),
    ("ezlogix/oven", "algorithm: position", "algorithm: velocity", "OVEN1.algorithm"),
    ("ezlogix/oven", "tag: IR1", "tag: IR7", "OVEN1.pv.tag"),
    ("ezlogix/dosing", "process_when_stopped: true", "process_when_stopped: false", "plc.process_when_stopped"),
    ("click/tank", "bit: Y001", "bit: Y002", "TANK1.output.pwm.bit"),
    ("dpide/dryer", "Kc_Kp: 1.6", "Kc_Kp: 3.2", "AIR.Kc_Kp"),
    ("dpide/dryer", "PID_DIR: true", "PID_DIR: false", "AIR.PID_DIR"),
    ("dpide/dryer", "interrupt_task: 500", "interrupt_task: 600", "plc.interrupt_task"),
    ("dpide/oven", "cycle: 4000", "cycle: 8000", "OVEN.call.GPWM"),
    ("nextopid/heatexchanger", "sample_time: 0.1", "sample_time: 0.2", "plc.sample_time"),
]
"""By vendor a setting of an example that the PLC's registers do not show, another value of it, and what is told."""


@pytest.mark.parametrize(("file", "old", "new", "told"), UNSEEN)
def test_a_setting_that_no_register_shows_is_told_whatever_its_value(desk, tmp_path, file, old, new, told):
    """The PLC holds the example, and the file another value: alike as far as read, and 1 with --strict."""
    path = example(*file.split("/"))
    text = "" if file.startswith("click") else needed(path)
    changed = tmp_path / path.name
    whole = path.read_text("utf-8")
    assert old in whole
    changed.write_text(whole.replace(old, new, 1), "utf-8")
    stated = ("--map", saved(tmp_path, text)) if text else ()
    words = words_by(path, text) if text else words_of(path)
    with desk.plc(Registers(words)) as url:
        found = pidcfg.compare(changed, url, map=text or None)
        plain, strict = (run("compare", changed, "--plc", url, *stated, *more) for more in ((), ("--strict",)))
        formats = {
            name: run("compare", changed, "--plc", url, *stated, "--strict", "--format", name).stdout
            for name in ("text", "json", "sarif", "junit", "github", "gitlab", "markdown")
        }
    assert found.same
    assert told in found.unread
    assert (plain.exit_code, strict.exit_code) == (0, 1)
    count = f"{len(found.unread)} setting{'s' * (len(found.unread) != 1)}"
    assert plain.stderr.endswith(f": alike as far as read; {count} could not be read\n")
    key = told.removeprefix("plc.") if told.startswith("plc.") else told.partition(".")[2]
    assert [name for name, output in formats.items() if "PID069" not in output or key not in output] == []
    assert "<failure" in formats["junit"]


def needed(path):
    """A map of what every configuration like this one has to state."""
    offered = [
        line.removeprefix(OFFERED).partition(",")[0]
        for line in pidcfg.encode(path, "modbus-map").text.splitlines()
        if line.startswith(OFFERED)
    ]
    rows = filled(path).splitlines()
    return "\n".join(row for row in rows if row.partition(",")[0] not in offered) + "\n"


def test_what_the_program_holds_is_told(desk):
    path = example("dpide", "dryer")
    text = filled(path)
    with desk.plc(Registers(words_by(path, text))) as url:
        result = pidcfg.compare(path, url, map=text)
        told = {(d.loop, d.message) for d in result.warnings}
        assert [
            d for d in told if d[0] == "AIR" and "numbers of the program, without a device: MOUT_AUTO, CYCLE" in d[1]
        ]
        more = f"{text}AIR.Kc_Kp,holding,9500,float32\nAIR.CYCLE,none\n"
    with desk.plc(Registers(words_by(path, more))) as url:
        result = pidcfg.compare(path, url, map=more)
    without, rest, *_ = (d.message for d in result.warnings if d.loop == "AIR")
    assert "map says" in without
    assert "CYCLE" in without
    assert "Kc_Kp" not in rest


def test_words_in_the_other_order(desk):
    with desk.plc(Registers(words_of(CLICK, read_map(GATEWAY, CLICK_SPACE)))) as url:
        assert pidcfg.compare(CLICK, url, map=GATEWAY).same
        assert not pidcfg.compare(CLICK, url, map=GATEWAY.replace("high-first", "low-first")).same


def test_a_map_and_its_way_back():
    for text, space in ((MAP, MAP_SPACE), (GATEWAY, CLICK_SPACE)):
        numbering = read_map(text, space)
        for start, _ in numbering.rows:
            for number in range(start, start + 5):
                place = numbering.place(number)
                for part in range(place.width):
                    assert numbering.find(place.table, place.register + part) == (number, place.shift(part) // 16)
    assert read_map(MAP, MAP_SPACE).find("coil", 199) is None


@pytest.mark.parametrize("row", ["R1,holding,50000,uint16", "R1,input,40000,uint16", "S1,discrete,20000,bool"])
def test_a_number_behind_the_five_digit_references_is_none(row):
    (only,) = read_map_rows(row)
    assert only.register == int(row.split(",")[2])


def test_a_hexadecimal_number_is_no_reference():
    first = MAP_SPACE.number_of("R", 1)
    assert read_map("R1,holding,0x0A,uint16", MAP_SPACE).place(first).register == 10


def test_a_parameter_that_no_row_places_has_no_place():
    path = example("dpide")
    numbering = numbering_of(VENDORS["dpide"], MapFile(filled(path), "map.csv"), pidcfg.encode(path).image)
    with pytest.raises(LookupError, match=r"no row of the map says where NOBODY.SV is"):
        numbering.place("NOBODY.SV")
    assert not named_modbus_kind(numbering.cells).looks_like(filled(path))


@pytest.mark.parametrize("vendor", EXAMPLES)
def test_without_a_map_there_is_one_error_that_shows_one(vendor):
    path = example(vendor)
    for call in (
        lambda: pidcfg.compare(path, NOBODY),
        lambda: pidcfg.encode(path, "modbus"),
        lambda: pidcfg.serve(path.with_suffix(".scenario.yaml"), seconds=0.1),
    ):
        with pytest.raises(
            UnusableMapError, match=r"rows of symbol, table, register .* '\S+,(holding|coil),0,"
        ) as error:
            call()
        assert "--format modbus-map" in str(error.value)
        assert (error.value.name, error.value.line, error.value.column) == ("", 1, 1)
    done = run("encode", path, "--format", "modbus")
    assert (done.exit_code, done.stdout, done.stderr.count("\n")) == (2, "", 1)


@pytest.mark.parametrize("data", [b"\xff\xfe\xff", b"x" * 999])
def test_a_map_that_is_no_text_or_too_large_is_refused_by_its_name(data):
    with pytest.raises(UnusableMapError) as error:
        map_of_data(data, "map.csv", replace(DEFAULT, file_bytes=100))
    assert error.value.name == "map.csv"


@pytest.mark.parametrize("vendor", EXAMPLES)
def test_without_a_map_and_a_configuration_one_error_says_where_to_state_it(vendor):
    with pytest.raises(UnusableMapError, match=r"prints no Modbus map, and none is made up; state one by --map FILE"):
        numbering_of(VENDORS[vendor], None, None)


def test_a_plc_without_parameters_that_a_map_could_name():
    boiler = example("generic", "boiler")
    for text in (None, MAP):
        with pytest.raises(UnusableMapError, match="is no PLC"):
            pidcfg.compare(boiler, NOBODY, map=text)
    with pytest.raises(UnusableMapError, match="name a configuration"):
        pidcfg.pull(NOBODY, vendor="dpide", map="D0,holding,0,float32")


@pytest.mark.parametrize(
    ("text", "place", "said"),
    [
        ("", (1, 1), "no row"),
        ("# nothing\n\n", (1, 1), "no row"),
        ("R1,holding", (1, 12), "type is missing"),
        ("R1,holding,,uint16", (1, 12), r"holding 0 is what references call 40001"),
        (",holding,0,uint16", (1, 1), "names no symbol"),
        ("D0,holding,0,uint16", (1, 1), "no register of this vendor, which has R1 to R65535, S1"),
        ("R1,Registers,0,uint16", (1, 4), "^'Registers' is no table; write coil, discrete, holding, input"),
        ("DF1,holding,0,float32,sideways", (1, 23), "'sideways' is no order; write low-first or high-first"),
        ("R1,holding,0,uint16\nsymbol,table,register,type", (2, 8), "'table' is no table"),
        ("device,table,register", (1, 1), "'device' is none of the columns"),
        ("R1,holding,00,uint16", (1, 12), "00 may be a number or a reference; write 0"),
        ("R1,none", (1, 4), "cannot be without"),
        ("R1,none,5", (1, 4), "but the row says more"),
        ("R1,holding,x,uint16", (1, 12), "no register; write 0 to 65535"),
        ("R1,holding,70000,uint16", (1, 12), "beyond 65535"),
        ("R1,holding,65535,uint16\nR2,holding,65536,uint16", (2, 12), "R2 would end at 65536, beyond 65535"),
        ("R1,holding,-1,uint16", (1, 12), "no register"),
        ("R1,holding,40001,uint16", (1, 12), "how references call holding 0; write 0, or 0x9C41 if 40001"),
        ("R1,holding,400101,uint16", (1, 12), "how references call holding 100; write 100$"),
        ("R1,holding,49999,uint16", (1, 12), "write 9998, or 0xC34F if 49999 itself is meant"),
        ("R1,input,30001,uint16", (1, 10), "write 0, or 0x7531"),
        ("S1,discrete,10009,bool", (1, 13), "write 8, or 0x2719"),
        ("R1,holding,010,uint16", (1, 12), "write 10 or 9"),
        ("S1,coil,00001,bool", (1, 9), "write 1 or 0"),
        ("R1,holding,01,uint16", (1, 12), "01 may be a number or a reference; write 1 or 0"),
        ("R1,holding,0,float32", (1, 14), "uint16 or int16, not float32"),
        ("R1,holding,0,float", (1, 14), "did you mean float32"),
        ("R1,holding,0.3,uint16", (1, 12), "is a bit"),
        ("R1,coil,0,uint16", (1, 11), "a coil holds a bool"),
        ("S1,holding,0,bool", (1, 12), "say its bit, such as 0.0"),
        ("S1,holding,0.16,bool", (1, 12), "bits of a register are 0 to 15"),
        ("R1,holding,0,uint16,sideways", (1, 21), "has no order"),
        ("R1,holding,0,uint16,low-first", (1, 21), "has no order"),
        ("\ufeff R1 ; holding ; 0 ; uint16\nR1;holding;5;uint16", (2, 1), "again; first in line 1"),
        ('"R1","holding","0","uint16","","",more', (1, 35), "7 cells"),
        ('R1,"holding"x,0,uint16', (1, 4), "behind a quotation mark"),
        ("register,symbol\n", (1, 1), "no column table"),
        ("symbol,register,table\n", (1, 1), "no column type"),
        ("symbol,register,table,kind\n", (1, 23), "'kind' is none of the columns"),
        ("symbol,table,table,type\n", (1, 8), "twice"),
        ("device,table,register,type\nR1,holding,0,uint16", (1, 1), "'device' is none of the columns"),
        ("register,holding,0,uint16", (1, 1), "'register' is no register"),
    ],
)
def test_maps_that_are_none(text, place, said):
    with pytest.raises(MapError, match=said) as error:
        read_map(text, MAP_SPACE)
    assert (error.value.line, error.value.column) == place


@pytest.mark.parametrize(
    ("row", "last"),
    [
        ("DS1,holding,{},int16", 65535),
        ("C1,coil,{},bool", 65535),
        ("C1,holding,{}.15,bool", 65535),
        ("DF1,holding,{},float32", 65534),
    ],
)
def test_a_value_ends_at_the_last_register_at_the_latest(row, last):
    (only,) = read_map_rows(row.format(last))
    assert (only.register, only.place(0).register) == (last, last)
    with pytest.raises(MapError, match="beyond 65535") as error:
        read_map_rows(row.format(last + 1))
    assert error.value.column == row.index("{") + 1


def test_an_example_of_a_map_has_room_for_a_float_in_two_registers():
    rows = ["A,holding,,float32", "B,holding,,uint16", "# C,holding,,int16", "M0,coil,,bool", "M1,coil,,bool"]
    assert list(map_template.fill_rows(rows)) == [
        "A,holding,0,float32",
        "B,holding,2,uint16",
        "M0,coil,0,bool",
        "M1,coil,1,bool",
    ]


TEMPLATE_HEAD = """\
# Write the register of each row behind its table, counted from 0:
# input 0 is 30001, holding 0 is 40001, discrete 0 is 10001, coil 0 is 00001. A switch in a register has its bit \
behind a point: holding,40.3.
symbol,table,register,type,order
"""


@pytest.mark.parametrize(
    ("vendor", "rows"),
    [
        ("ezlogix", ["R1,holding,,uint16", "S1,coil,,bool", "# IR1,holding,,uint16", "# OR1,holding,,uint16"]),
        ("dpide", ["M0,coil,,bool", "D0,holding,,float32,low-first", "D0,holding,,int32,low-first"]),
    ],
)
def test_a_map_to_be_filled_in_has_a_row_for_each_bank_and_type(vendor, rows):
    assert pidcfg.encode(example(vendor), "modbus-map").text == TEMPLATE_HEAD + "".join(f"{row}\n" for row in rows)


@pytest.mark.parametrize(("count", "more"), [(3, ""), (4, " and 1 more"), (9, " and 6 more")])
def test_an_example_of_a_map_shows_three_rows_and_how_many_more_there_are(count, more):
    rows = [f"A{i},holding,,uint16" for i in range(count)]
    shown = "'A0,holding,0,uint16' 'A1,holding,2,uint16' 'A2,holding,4,uint16'"
    assert map_template.example_text([*rows, "# offered,coil,,bool"]) == shown + more


def test_how_a_map_may_be_written():
    plain = read_map_rows("DF1,holding,40001,float32\n".replace("40001", "0x9C41"))
    (row,) = plain
    assert (row.register, row.high_first) == (40001, False)
    spread = ("\ufeff# map", '"# a, comment",,', "Type;Symbol;Order;Register;Table;Comment;;", ";;;", "")
    (other,) = read_map_rows("\r\n".join((*spread[:3], 'Float32;DF1;;0x9c41;Holding;"a;b"', *spread[3:])))
    assert other._replace(line=1, columns={}) == row._replace(columns={})
    for text in ('"DF1","holding","0x9C41","float32","",""', "DF1,holding,0x9C41,float32,,,,,,"):
        (quoted,) = read_map_rows(text)
        assert quoted._replace(columns={}) == row._replace(columns={})
    (named,) = read_map_rows('"the ""first"" one",holding,0,uint16')
    assert named.symbol == 'the "first" one'


def test_a_place_takes_every_bit_of_its_registers_or_its_own():
    assert bits_of_place(Place("holding", 40)) == [("holding", 40, bit) for bit in range(16)]
    assert bits_of_place(Place("input", 40, 2)) == [("input", at, bit) for at in (40, 41) for bit in range(16)]
    assert bits_of_place(Place("holding", 40, 1, False, 15)) == [("holding", 40, 15)]


def test_a_parameter_is_a_bit_a_word_or_two_by_its_place():
    entries = (("A", BOOL, True), ("B", INT, -5), ("C", REAL, 1.5), ("D", REAL, Wire("X")), ("E", DINT, 70000))
    program = Program("dpide", tuple(Entry(name, kind, raw, name, "L") for name, kind, raw in entries))
    places = {
        name: Place("holding", at, width) for name, at, width in (("A", 0, 1), ("B", 1, 1), ("D", 2, 2), ("E", 4, 2))
    }
    cells = [cell for cell, _ in NamedNumbering({}, places).cells(program)]
    assert [(cell.address, cell.number, cell.raw, cell.kind.name, cell.loop) for cell in cells] == [
        ("A", 0, 1, "bit", "L"),
        ("B", 1, 0xFFFB, "word", "L"),
        ("E", 4, 70000, "float", "L"),
    ]


SYMBOLS = Symbols(
    "an operand",
    {
        point.name: point
        for point in (
            Point("L.SV", REAL, "L", needed=True, device="D100"),
            Point("L.CYCLE", DINT, "L", needed=True, device="D102"),
            Point("L.PID_DIR", BOOL, "L", needed=True, device="M5"),
            Point("L.BIAS", REAL, "L", literal=True),
        )
    },
    frozenset({"SV", "CYCLE", "PID_DIR", "BIAS"}),
    device_of,
)
BANKS = "D0,holding,0,float32\nD0,holding,0,int32\nM0,coil,0,bool"


@pytest.mark.parametrize(
    ("text", "place", "said"),
    [
        (f"{BANKS}\nD0,holding,0,float32", (4, 1), "D0 stands here again; first in line 1"),
        (
            f"{BANKS}\nL.SV,holding,500,float32\nX.L.SV,holding,502,float32",
            (5, 1),
            "X.L.SV stands here again; first in",
        ),
        (f"{BANKS}\nL.BIAS,holding,0,uint16", (4, 18), "L.BIAS is REAL: float32, not uint16"),
        (f"{BANKS}\nL.BIAS,holding,102,float32", (4, 16), r"D102 \(L.CYCLE\) and L.BIAS are both at holding 102"),
        (f"{BANKS}\nL.BIAS,holding,99,float32", (4, 16), r"D100 \(L.SV\) and L.BIAS are both at holding 99"),
        (
            f"L.BIAS,holding,102,float32\n{BANKS}",
            (3, 12),
            r"D102 \(L.CYCLE\) and L.BIAS are both at .* by lines 1 and 3",
        ),
        (BANKS.replace("coil,0", "coil,65531"), (3, 9), r"M5 \(L.PID_DIR\) would be at 65536"),
        (BANKS.replace("0,int32", "2,int32"), (2, 12), "D0 is at holding 0 by line 1, and cannot be elsewhere"),
        (BANKS.replace("D0,holding,0,int32", "D0,input,0,int32"), (2, 10), "D0 is at holding 0 by line 1"),
        (
            BANKS.replace("M0", "M6"),
            (3, 1),
            r"no row says where M5 \(L.PID_DIR\) is; add M5,coil,REGISTER,bool, or L.PID",
        ),
        (f"M5,none\n{BANKS}", (1, 4), "M5 begins a bank; write L.PID_DIR,none$"),
        (f"M9,none\n{BANKS}", (1, 4), "M9 begins a bank$"),
        (f"{BANKS}\nD102,holding,0,float32", (4, 16), "D102 is L.CYCLE of type DINT: int32.*, not float32"),
        ("L.Bias,none", (1, 1), "'L.Bias' is not an operand; did you mean L.BIAS"),
        ("M.SV,none", (1, 1), r"no row says where D100 \(L.SV\), D102 \(L.CYCLE\), M5 \(L.PID_DIR\) is; add D100,"),
    ],
)
def test_a_map_of_names_and_devices_is_refused_where_it_is_wrong(text, place, said):
    with pytest.raises(MapError, match=said) as error:
        read_symbol_map(text, SYMBOLS)
    assert (error.value.line, error.value.column) == place


def test_a_map_of_names_and_devices_says_where_each_parameter_is():
    found = read_symbol_map(f"{BANKS}\nL.SV,none", SYMBOLS)
    assert {name: place.register for name, place in found.places.items()} == {"L.CYCLE": 102, "L.PID_DIR": 5}
    assert (found.unmapped, found.literals) == (("L.SV",), ("L.BIAS",))
    nearer = read_symbol_map(f"{BANKS}\nD102,holding,700,int32\nL.BIAS,holding,800,float32", SYMBOLS)
    assert {name: place.register for name, place in nearer.places.items()} == {
        "L.SV": 100, "L.CYCLE": 700, "L.PID_DIR": 5, "L.BIAS": 800,
    }  # fmt: skip
    assert (nearer.unmapped, nearer.literals) == ((), ())
    with pytest.raises(LookupError, match=r"no row of the map says where L\.MV is"):
        nearer.place("L.MV")


def test_the_nearest_row_before_a_device_counts_by_its_number():
    rows = "\n".join(f"D{start},holding,{register},int32" for start, register in ((9, 9000), (20, 2000), (101, 700)))
    places = read_symbol_map(f"{BANKS.replace('D0,holding,0,int32', rows)}", SYMBOLS).places
    assert places["L.CYCLE"].register == 701


@pytest.mark.parametrize(("count", "more"), [(1, ""), (5, ""), (6, " and 1 more"), (9, " and 4 more")])
def test_five_parameters_without_a_row_are_named_and_the_others_counted(count, more):
    points = {f"L.P{i}": Point(f"L.P{i}", REAL, "L", needed=True) for i in range(count)}
    with pytest.raises(MapError) as error:
        read_symbol_map("M.P0,none", Symbols("a parameter", points, frozenset({"P0"})))
    add = "add L.P0,holding,REGISTER,float32,low-first, or L.P0,none where no register has it"
    assert str(error.value) == f"no row says where {', '.join([*points][:5])}{more} is; {add}"


def test_switches_behind_that_of_a_row_go_on_in_the_next_register():
    (row,) = read_map_rows("M0,holding,40.3,bool")
    places = {steps: (row.place(steps).register, row.place(steps).bit) for steps in (0, 1, 12, 13, 28, 29)}
    assert places == {0: (40, 3), 1: (40, 4), 12: (40, 15), 13: (41, 0), 28: (41, 15), 29: (42, 0)}
    (coil,) = read_map_rows("M0,coil,40,bool")
    assert [(coil.place(steps).register, coil.place(steps).bit) for steps in (0, 1, 17)] == [
        (40, None),
        (41, None),
        (57, None),
    ]


@pytest.mark.parametrize(
    ("vendor", "change", "said"),
    [
        ("ezlogix", (r"S1,.*", ""), r"^map:\d+:1: S101 \(mode of OVEN1\): no row .* add one like S1,coil,0,bool"),
        ("ezlogix", (r"R1,.*", "R1,holding,65400,uint16"), r"R236? \(|R137 .* by line 2 of the map R137 is at 65536"),
        (
            "ezlogix",
            (r"R1,.*", "R1,holding,0,uint16\nR140,holding,100,uint16"),
            "R101 and R140 are both at holding 100",
        ),
        ("dpide", (r"D0,holding,1000,int32.*", ""), r"D110 \(OVEN.PID_MODE\).* is; add D110,holding,REGISTER,int32"),
        ("dpide", (r"D0,(.*)int32,low-first", r"D0,\1int16"), r"D500 \(OVEN.I_MV\)|D110 \(OVEN.PID_MODE\)"),
        ("dpide", (r"D0,(.*)1000,int32", r"D0,\g<1>1002,int32"), "D0 is at holding 1000 by line"),
        ("dpide", (r"D0,(.*float32.*)", r"D0,\1\nD112,holding,1100,float32"), r"D100 \(OVEN.SV\) and D112 \(OVEN.Kc"),
        ("dpide", (r"M0,.*", "M0,coil,65530,bool"), r"M10 \(OVEN.PID_RUN\) would be at 65540"),
        ("dpide", (r"M0,.*", "M0,none"), "M0 begins a bank$"),
        ("dpide", (r"M0,.*", "M10,none"), "M10 begins a bank; write OVEN.PID_RUN,none$"),
        ("nextopid", (r"(TIC_1.Kp,holding,\d+,)float32,low-first", r"\1int32"), "TIC_1.Kp is REAL: float32, not int32"),
        ("nextopid", (r"PidLoops.TIC_1.Kp,.*", ""), "no row says where TIC_1.Kp is; add TIC_1.Kp,holding,REGISTER"),
        ("nextopid", (r"PidLoops.TIC_1.Kp,", "Kp,"), "map:3:1: 'Kp' is not a parameter or a sig.*; write the name of"),
        ("nextopid", (r"TIC_1.Kp,", "TIC_1.Kpp,"), "'PidLoops.TIC_1.Kpp' is not a parameter.*did you mean TIC_1.Kp"),
        ("nextopid", (r"TIC_1.Kp,holding,\d+", "TIC_1.Kp,holding,700"), "are both at holding 700 .* by lines 2 and 3"),
        ("nextopid", (r"PidLoops.TIC_2.Kp", "Other.TIC_1.Kp"), "Other.TIC_1.Kp stands here again; first in line 3"),
        ("nextopid", (r"PidLoops.TIC_2.Kp", "TIC_9.Kp"), "no row says where TIC_2.Kp is"),
    ],
)
def test_maps_that_do_not_fit_a_configuration(vendor, change, said):
    text = filled(example(vendor))
    changed = re.sub(*change, text, count=1)
    assert changed != text
    with pytest.raises(UnusableMapError, match=said):
        pidcfg.compare(example(vendor), NOBODY, map=changed)


# --- a map that the configuration names ---------------------------------------------------------------------------


def named(tmp_path, vendor, text):
    """A configuration that names its map, which stands beside it."""
    config = example(vendor).read_text("utf-8")
    plc = re.search(r"^plc:.*\n((?:  .*\n)*)", config, re.MULTILINE)
    inner = "  map: maps/plc.csv\n"
    if plc is None:
        config = config.replace("loops:\n", f"plc:\n{inner}loops:\n", 1)
    elif "{" in plc.group(0).splitlines()[0]:
        config = config.replace("plc: {", "plc: {map: maps/plc.csv, ", 1)
    else:
        config = config.replace(plc.group(0), plc.group(0) + inner)
    (tmp_path / "maps").mkdir()
    (tmp_path / "maps/plc.csv").write_text(text, "utf-8")
    (tmp_path / "plc.yaml").write_text(config, "utf-8")
    return tmp_path / "plc.yaml"


@pytest.mark.parametrize("vendor", EXAMPLES)
def test_a_configuration_names_its_map(desk, tmp_path, vendor):
    text = filled(example(vendor))
    path = named(tmp_path, vendor, text)
    assert not [d for d in pidcfg.check(path).findings if d.code == "PID067"]
    with desk.plc(Registers(words_by(example(vendor), text))) as url:
        assert pidcfg.compare(path, url).same
        pulled = pidcfg.pull(url, like=path)
    assert pulled.data["plc"]["map"] == "maps/plc.csv"
    rows = pidcfg.encode(path, "modbus").text
    assert rows == pidcfg.encode(path, "modbus", map=text).text
    assert rows.count("\nholding,") + rows.count("\ncoil,") == len(words_by(example(vendor), text))
    again = pidcfg.decode(pidcfg.encode(path, "json").text, vendor).text
    assert pidcfg.encode(again, "json").text == pidcfg.encode(path, "json").text


@pytest.mark.parametrize("link", [False, True])
def test_a_map_outside_of_the_folder_is_used_and_never_quoted(tmp_path, link):
    (tmp_path / "inner").mkdir()
    path, secret = named(tmp_path / "inner", "dpide", ""), tmp_path / "secret.env"
    place = path.parent / "maps/plc.csv"
    for text, quoted in (("KEY=hunter2,abc", "hunter2"), (filled(example("dpide")), "")):
        secret.write_text(text, "utf-8")
        if link:
            place.unlink()
            place.symlink_to(secret)
        else:
            path.write_text(path.read_text("utf-8").replace("maps/plc.csv", "../secret.env"), "utf-8")
        found = [d for d in pidcfg.check(path).findings if d.code == "PID067"]
        assert len(found) == bool(quoted)
        assert not quoted or "outside of the configuration's folder is not quoted" in found[0].message
        assert not [d for d in found if "hunter2" in repr(d)]
        if quoted:
            with pytest.raises(UnusableMapError, match="hunter2"):
                pidcfg.encode(path, "modbus", map=secret)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (None, "cannot read .*plc.csv: No such file"),
        ("M0,coil,0,bool", r"plc.csv:1:1: no row says where D100 \(OVEN.SV\)"),
        ("D0,holding,9", r"plc.csv:1:14: the type is missing"),
    ],
)
def test_a_map_that_is_named_is_looked_at(tmp_path, text, said):
    path = named(tmp_path, "dpide", text or "")
    if text is None:
        (tmp_path / "maps/plc.csv").unlink()
    (finding,) = (d for d in pidcfg.check(path).findings if d.code == "PID067")
    assert re.search(said, finding.message)
    assert path.read_text("utf-8").splitlines()[finding.span.line - 1].strip() == "map: maps/plc.csv"
    with pytest.raises(UnusableMapError, match=said):
        pidcfg.compare(path, NOBODY)
    assert run("compare", path, "--plc", NOBODY).exit_code != 0


@pytest.mark.parametrize(
    "name", ["http://plc/map.csv", "modbus://10.0.0.5", "//server/map.csv", r"\\server\map.csv", " "]
)
def test_a_map_is_no_host(name):
    text = example("dpide").read_text("utf-8").replace("loops:\n", f"plc: {{map: '{name}'}}\nloops:\n", 1)
    (finding,) = (d for d in pidcfg.check(text).findings if d.severity.label == "error")
    assert finding.where == "plc.map"


# --- the virtual PLC ----------------------------------------------------------------------------------------------


def place_of(vendor, name, text):
    """The virtual PLC, and table and register of a parameter."""
    plc = virtual(vendor, text)
    return plc, next(where for where, parts in plc._map.items() if parts[0].number == name)


def float32(value):
    """The two words of a number, the low one first."""
    return struct.unpack("<HH", struct.pack("<f", value))


@pytest.mark.parametrize(
    ("vendor", "name", "contents", "code"),
    [
        ("dpide", "OVEN.PV", [0, 0], 2),
        ("dpide", "OVEN.MV", [0, 0], 2),
        ("dpide", "OVEN.SV", [0, 0x7F80], 3),
        ("dpide", "OVEN.PID_MODE", [3, 0], 3),
        ("nextopid", "TIC_1.PV", [0, 0], 2),
        ("nextopid", "TIC_1.MV", [0, 0], 2),
        ("nextopid", "TIC_2.SP_CASC", [0, 0], 2),
        ("nextopid", "TIC_1.Kp", [0, 0x7FC0], 3),
        ("ezlogix", 112, [1], 2),  # the error
        ("ezlogix", 118, [1], 2),  # reserved
        ("ezlogix", 65536 + 104, [1], 2),  # saturation
        ("ezlogix", 2 * 65536 + 1, [1], 2),  # PV
        ("ezlogix", 3 * 65536 + 1, [1], 4),  # CV in Auto
    ],
)
def test_what_the_plc_refuses(vendor, name, contents, code):
    plc, (table, register) = place_of(vendor, name, filled(example(vendor)))
    plc.advance(50)
    before = {where: plc.read(*where, 1) for where in plc._map}
    with pytest.raises(RegisterError) as error:
        plc.write(table, register, contents)
    assert error.value.code == code
    assert {where: plc.read(*where, 1) for where in plc._map} == before


def test_what_a_program_writes_in_every_cycle_is_its_own():
    text = f"{filled(example('nextopid', 'diagnostics'))}Alarm_1,coil,900,bool\nManual_1,coil,901,bool\n"
    plc = virtual("nextopid", text, name="diagnostics")
    with pytest.raises(RegisterError, match="Alarm_1 is written by the program") as error:
        plc.write("coil", 900, [1])
    assert error.value.code == 2
    modes = []
    for switch in (0, 1):
        plc.write("coil", 901, [switch])
        assert plc.read("coil", 901, 1) == [switch]
        plc.advance(5)
        modes.append(plc.run.plc.mode(plc.run.plc.states[0].status))
    assert modes == ["auto", "manual"]


def test_an_as_is_asked_for_little_at_once():
    path = example("dpide")
    result = pidcfg.encode(path)
    numbering = numbering_of(VENDORS["dpide"], MapFile(filled(path), "map"), result.image)
    registers = NamedRegisters(VENDORS["dpide"], numbering, result.image)
    assert registers.max_per_request["holding"] == 100
    whole = list(registers._requests(registers.names))
    registers.max_per_request = {"holding": 4, "coil": 1}
    parts = list(registers._requests(registers.names))
    assert max(request.count for request, _ in whole) > 4
    assert max(request.count for request, _ in parts) <= 4
    assert {name for _, places in parts for name in places} == set(registers.names)


def test_an_operator_of_an_ezlogix():
    plc, mode = place_of("ezlogix", 65536 + 101, filled(example("ezlogix")))
    at = {parts[0].number: where for where, parts in plc._map.items()}
    plc.advance(20)
    plc.write(*at[102], [1700])
    plc.write(*at[103], [333])
    assert plc.read(*at[103], 1) == [333]
    assert plc.run.plc.states[0].gain == 3.33
    plc.write(*mode, [0])
    plc.advance(20)
    assert plc.read(*mode, 1) == [0]
    plc.write(*at[3 * 65536 + 1], [1234])
    plc.advance(5)
    assert plc.read(*at[3 * 65536 + 1], 1) == [1234]
    start = at[65536 + 105]
    plc.write(*start, [1])
    plc.advance(2)
    assert plc.read(*at[113], 1) == [1]
    plc.write(*start, [1])
    plc.write(*start, [0])
    plc.advance(2)
    assert [note.text for note in plc.report().events if note.loop == "OVEN1"] == [
        "set setpoint.value to 1700",
        "set tuning.proportional_gain to 333",
        "request mode manual",
        "set output to 1234 counts",
        "autotune start",
        "start of an autotune stays on",
        "autotune off",
    ]


@pytest.mark.parametrize(
    ("vendor", "setpoint", "manual", "out"),
    [("dpide", "OVEN.SV", "OVEN.PID_MAN", "OVEN.MV"), ("nextopid", "TIC_1.SP", "TIC_1.Manual", "TIC_1.MV")],
)
@pytest.mark.parametrize("bits", [False, True])
def test_an_operator_of_named_parameters(vendor, setpoint, manual, out, bits):
    plc = virtual(vendor, filled(example(vendor), bits=bits))
    at = {part.number: where for where, parts in reversed(plc._map.items()) for part in parts}
    switch = {part.number: part.bit for parts in plc._map.values() for part in parts}[manual]
    plc.advance(40)
    plc.write(*at[setpoint], float32(61.5))
    assert plc.read(*at[setpoint], 2) == [*float32(61.5)]
    (register,) = plc.read(*at[manual], 1)
    plc.write(*at[manual], [register | 1 << switch])
    plc.advance(2)
    held = plc.read(*at[out], 2)
    plc.advance(40)
    assert plc.read(*at[out], 2) == held
    loop = setpoint.partition(".")[0]
    report = plc.report()
    assert [note.text for note in report.events][-2:] == [f"set {setpoint} to 61.5", f"set {manual} to TRUE"]
    assert report.loops[loop].modes[-1].mode == "manual"


def test_a_scenario_does_what_the_same_writes_do():
    """A write between two base steps is the event at that time, to the bit."""
    text = filled(example("dpide"))
    plc, sv = place_of("dpide", "OVEN.SV", text)
    plc.advance(120)
    plc.write(*sv, float32(70.25))
    plc.advance(60)
    twin = virtual("dpide", text, f"  - {{at: {120 * plc.dt:g}, loop: OVEN, set: {{SV: 70.25}}}}\n")
    twin.advance(180)
    assert twin.run.net.signal_values == plc.run.net.signal_values


@pytest.mark.parametrize("vendor", EXAMPLES)
def test_served_pulled_and_recorded(desk, vendor, tmp_path):
    text = filled(example(vendor))
    (tmp_path / "map.csv").write_text(text, "utf-8")
    plc = virtual(vendor, text)
    plc.advance(5)
    with served(desk, plc, speed=1e-6) as (port, _):
        url = f"modbus://127.0.0.1:{port}"
        assert pidcfg.compare(example(vendor), url, map=text).same
        arguments = ("trend", "--plc", url, "--like", example(vendor), "--map", tmp_path / "map.csv", "--for", "0")
        done = run(*arguments)
    assert done.exit_code == 0
    header, values = (line.split(",") for line in done.stdout.splitlines()[:2])
    for loop in plc.run.plc.loops:
        assert {f"{loop}.{signal}" for signal in ("PV", "SP", "OUT", "MODE")} <= set(header)
    row = dict(zip(header, values, strict=True))
    signals, names = plc.run.net.signal_values, plc.run.net.slots
    loop = plc.run.plc.loops[0]
    assert float(row[f"{loop}.PV"]) == pytest.approx(signals[names[f"{loop}.PV"]], abs=0.1)
    assert row[f"{loop}.MODE"] == "auto"


def test_the_mode_of_a_trend_is_that_of_the_program_where_no_register_has_it(desk):
    text = example("dpide", "dryer").read_text("utf-8").replace("SV: 120\n", "SV: 120\n    PID_MAN: true\n")
    rows = "M0,coil,500,bool\nD0,holding,1000,float32,low-first\n"
    words = words_by(text, rows) | {("holding", 1000 + k): 0 for k in range(300, 312)}
    out = io.StringIO()
    with desk.plc(Registers(words)) as url:
        pidcfg.trend(url, out, like=text, map=rows, seconds=0.0)
    header, values = (line.split(",") for line in out.getvalue().splitlines())
    row = dict(zip(header, values, strict=True))
    assert (row["AIR.MODE"], row["DUCT.MODE"]) == ("manual", "auto")


def test_what_the_plc_or_its_operator_writes_may_change_while_it_is_read(desk):
    path = example("nextopid")
    text = filled(path)
    image = pidcfg.encode(path).image
    registers = NamedRegisters(VENDORS["nextopid"], numbering_of(VENDORS["nextopid"], MapFile(text, "m"), image), image)
    agreed = [registers._is_same_setting(name, {name: 0}, {name: 1}) for name in ("TIC_1.Direct", "TIC_1.Manual")]
    assert agreed == [False, True], "a switch is one bit, and the lowest one"
    places = {cell.address: (place.table, place.register) for cell, place in numbered(path, text)}

    def restless(name):
        def change(registers):
            registers.words[places[name]] = (registers.words[places[name]] + 1) % 100

        return change

    with desk.plc(Registers(words_by(path, text), restless("TIC_1.SP"))) as url:
        assert pidcfg.compare(path, url, map=text).same
    with (
        desk.plc(Registers(words_by(path, text), restless("TIC_1.Kp"))) as url,
        pytest.raises(PlcError, match=r"settings changed during each of 5 readings: TIC_1.Kp of TIC_1; look who"),
    ):
        pidcfg.pull(url, like=path, map=text)


def test_what_no_register_has_is_no_column_of_a_trend(desk):
    path = example("nextopid")
    text = re.sub(r"PidLoops.TIC_1.(PV|Manual),.*", r"TIC_1.\1,none", filled(path))
    with served(desk, virtual("nextopid", text), speed=1e-6) as (port, _):
        url = f"modbus://127.0.0.1:{port}"
        columns = pidcfg.trend(url, io.StringIO(), like=path, map=text, seconds=0.0).columns
    assert columns[:7] == ("time", "TIC_1.SP", "TIC_1.OUT", "TIC_2.PV", "TIC_2.SP", "TIC_2.OUT", "TIC_2.MODE")


OPERATED = {
    # vendor: its set point, how mbpoll calls its type, another value, its mode, and what makes it manual
    "ezlogix": (102, "4", "1700", 65536 + 101, "0"),
    "dpide": ("OVEN.SV", "4:float", "95.5", "OVEN.PID_MAN", "1"),
    "nextopid": ("TIC_1.SP", "4:float", "64.5", "TIC_1.Manual", "1"),
}


@pytest.mark.skipif(shutil.which("mbpoll") is None, reason="mbpoll, a client in C, is not installed")
@pytest.mark.parametrize("order", ["low-first", "high-first"])
@pytest.mark.parametrize("vendor", ["dpide", "nextopid"])
def test_mbpoll_has_the_word_order_of_the_map(desk, vendor, order):
    """Both programs that know the order, each with its own words for it: -B is the high word first."""
    name, kind, value, *_ = OPERATED[vendor]
    text = filled(example(vendor), order)
    plc, (_, register) = place_of(vendor, name, text)
    with served(desk, plc, speed=1e-6) as (port, _):

        def mbpoll(*more, swapped):
            line = ("mbpoll", "-m", "tcp", "-p", str(port), "-0", "-1", "-q", *(("-B",) if swapped else ()))
            line += ("-t", kind, "-r", str(register), "127.0.0.1", *more)
            return subprocess.run(line, capture_output=True, text=True, check=False).stdout

        mbpoll(value, swapped=order == "high-first")
        assert f"[{register}]: \t{value}\n" in mbpoll(swapped=order == "high-first")
        assert f"[{register}]: \t{value}\n" not in mbpoll(swapped=order != "high-first")
        rows = pidcfg.pull(f"modbus://127.0.0.1:{port}", like=example(vendor), map=text).image.words
    assert rows[name] == float(value)


@pytest.mark.skipif(shutil.which("mbpoll") is None, reason="mbpoll, a client in C, is not installed")
@pytest.mark.parametrize("vendor", OPERATED)
def test_mbpoll_reads_and_operates(desk, vendor):
    name, kind, value, mode, on = OPERATED[vendor]
    text = filled(example(vendor))
    plc, (_, register) = place_of(vendor, name, text)
    _, coil = next(where for where, parts in plc._map.items() if parts[0].number == mode)
    with served(desk, plc, speed=50.0) as (port, _):

        def mbpoll(register, *more, kind):
            line = ("mbpoll", "-m", "tcp", "-p", str(port), "-0", "-1", "-q", "-t", kind, "-r", str(register))
            return subprocess.run([*line, "127.0.0.1", *more], capture_output=True, text=True, check=False).stdout

        mbpoll(register, value, kind=kind)
        assert f"[{register}]: \t{value}\n" in mbpoll(register, kind=kind)
        mbpoll(coil, on, kind="0")
        for _ in range(100):
            rows = pidcfg.pull(f"modbus://127.0.0.1:{port}", like=example(vendor), map=text).image.words
            if plc.run.plc.mode(plc.run.plc.states[0].status) == "manual":
                break
    assert rows[name] == (1700 if vendor == "ezlogix" else float(value))
    assert plc.report().loops[plc.run.plc.loops[0]].modes[-1].mode == "manual"
