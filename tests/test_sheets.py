"""Loops as sheets: what is written is read back the same, and what is wrong is told by row and cell."""

from __future__ import annotations

import csv
import io
import json
import random
import time
import zipfile
from contextlib import suppress
from datetime import date, datetime, timedelta
from decimal import Decimal
from pathlib import Path

import pytest
from click.testing import CliRunner

import pidcfg
from pidcfg.cli.main import cli
from pidcfg.output.report import Title
from pidcfg.output.report.formats import write_workbook
from pidcfg.output.sheet_reader import SheetFaultsError, cell_word, read_configuration
from pidcfg.output.sheets import as_csv, as_workbook, expanded_text, key_of, number_or_text
from pidcfg.text.reader import DEFAULT, Limits
from pidcfg.text.signs import FORMULA_STARTS
from pidcfg.text.source import read_document
from pidcfg.validate.engine import check_source
from pidcfg.vendors import VENDORS

EXAMPLES = Path(__file__).parents[1] / "examples"
CONFIGURATIONS = sorted(
    path for path in EXAMPLES.glob("*/*.yaml") if ".scenario" not in path.name and path.parent.name != "mistakes"
)
HEAD = "tag,description,action,sample rate,gain,reset,range low,range high,unit,setpoint\n"
ROW = "TIC-1,Oven,direct,2,2.5,180,0,200,degC,85\n"


def sheets(path):
    doc = read_document(path.read_bytes(), path.name)
    vendor = VENDORS[doc.data["vendor"]]
    return as_csv(doc, vendor).encode(), as_csv(doc, vendor, comma=True).encode(), as_workbook(doc, vendor)


def made(text, vendor="dl06", limits=DEFAULT):
    return read_configuration(text.encode() if isinstance(text, str) else text, "loops.csv", vendor, limits)


def config(text):
    return check_source(text, "x.yaml", None, DEFAULT).config


def faults(text, vendor="dl06", limits=DEFAULT):
    with pytest.raises(SheetFaultsError) as error:
        made(text, vendor, limits)
    return error.value.faults


@pytest.mark.parametrize("path", CONFIGURATIONS, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_there_and_back_is_the_same(path):
    wanted = check_source(path, None, None, DEFAULT).config
    for data in sheets(path):
        back = read_configuration(data, "loops", None, DEFAULT)
        assert config(back.text) == wanted
        assert (back.vendor.key, back.loops) == (path.parent.name, len(wanted.loops))


def test_common_words_and_units_in_brackets():
    header = "Tag,Text,Action,Sample rate [s],Gain,Reset (s),Range low,Range high,Unit,Setpoint\n"
    loop = config(made(header + ROW).text).loops[0]
    assert (loop.sample_rate, loop.tuning.reset.duration.seconds()) == (2, 180)
    loop = config(made(HEAD + ROW).text).loops[0]
    assert (loop.name, loop.description, str(loop.tuning.gain), loop.pv.unit) == ("TIC-1", "Oven", "2.5", "degC")
    assert [float(end) for end in loop.pv.range] == [0, 200]


def test_german_words_semicolons_and_decimal_commas():
    text = (
        "Messstelle;Beschreibung;Wirkrichtung;Abtastzeit;Verstärkung;Nachstellzeit;"
        "Messbereich von;Messbereich bis;Einheit;Sollwert\n"
        "TIC-1;Oven;direct;2;2,5;180;0;200;degC;85\n"
        "TIC-2;Big;direct;0,5;1;180;-20;1.200,5;degC;85\n"
    )
    one, two = config(made("\ufeff" + text).text).loops
    assert one == config(made(HEAD + ROW).text).loops[0]
    assert [float(end) for end in two.pv.range] == [-20, 1200.5]
    assert float(two.sample_rate) == 0.5


def test_a_number_of_two_readings_is_refused():
    text = HEAD.replace(",", ";") + "A;x;direct;2;2,5;1.800;0;200;degC;85\n"
    (fault,) = faults(text)
    assert fault.startswith("loops.csv, row 2, cell F2: 1.800 can be two numbers")


def test_the_same_point_is_a_decimal_one_where_there_is_no_comma():
    text = HEAD.replace(",", ";") + "A;x;direct;2;2.5;1.800;0;200;degC;85\n"
    assert read_document(made(text).text.encode(), "x").data["loops"][0]["tuning"]["reset"] == "1.8"


@pytest.mark.parametrize("vendor", VENDORS)
def test_every_vendor_knows_the_common_words(vendor):
    from pidcfg.output.sheets import key_of

    family = VENDORS[vendor]
    assert key_of("Tag", family) == "name"
    for word in ("gain", "reset", "rate", "setpoint", "unit", "range low"):
        if (vendor, word) == ("dpide", "range low"):
            continue
        key = key_of(word, family)
        assert key
        assert key_of(key.upper(), family) == key


def test_an_unknown_column_is_named_with_the_nearest_key_and_its_cells_are_left_alone():
    (fault,) = faults(HEAD.replace("setpoint", "tuning.gian") + ROW)
    assert fault == (
        "loops.csv, row 1, cell J1: 'tuning.gian' is no key of a loop of AutomationDirect DirectLOGIC DL06; "
        "did you mean tuning.gain?"
    )


@pytest.mark.parametrize(
    ("vendor", "header", "cure"),
    [
        ("dl06", "Cascade", "a cascade is cascade_from"),
        ("dl06", "Soak 1", "a profile stands in the file, under ramp_soak.steps"),
        ("generic", "Secondary", "a cascade is setpoint.source"),
        ("nextopid", "Führungsgröße", "a cascade is SP_CASC"),
        ("click", "Master", "loops of click have no key for a cascade"),
        ("ezlogix", "Ramp", "loops of ezlogix have no key for a profile"),
    ],
)
def test_a_header_that_is_no_key_has_a_cure_of_its_topic(vendor, header, cure):
    from pidcfg.output.sheets import UnknownColumnError, key_of

    with pytest.raises(UnknownColumnError) as caught:
        key_of(header, VENDORS[vendor])
    assert str(caught.value).partition("; ")[2] == cure


def test_a_master_is_the_loop_that_a_cascade_comes_from():
    text = "Tag,Action,Sample rate,Gain,Reset,Range low,Range high,Setpoint,Master\n"
    loops = config(made(text + "A,direct,2,2,60,0,100,5,\nB,direct,2,2,60,0,100,5,A\n").text).loops
    assert [loop.cascade_from for loop in loops] == [None, "A"]


def test_ends_are_those_of_pairs():
    from pidcfg.output.sheets import UnknownColumnError, key_of

    assert key_of("output.limits high", VENDORS["dl06"]) == "output.limits high"
    with pytest.raises(UnknownColumnError):
        key_of("tuning.gain low", VENDORS["dl06"])


def test_a_line_above_the_header_may_be_two_words_that_columns_have():
    assert config(made("description,Tag\n" + HEAD + ROW).text).description == "Tag"
    (fault, *_) = faults("name,gain\nA,2\n")
    assert "row 2" in fault
    with pytest.raises(SheetFaultsError, match="has no header"):
        made("name,wrong\nA,2\n")


def test_the_name_of_a_file_may_be_a_word_that_columns_have():
    text = (EXAMPLES / "dpide/oven.yaml").read_text("utf-8")
    doc = read_document(text.replace("name: Curing oven", "name: manual", 1).encode(), "a.yaml")
    assert doc.data["name"] == "manual"
    back = read_configuration(as_csv(doc, VENDORS["dpide"]).encode(), "loops", None, DEFAULT)
    assert config(back.text) == config(expanded_text(doc))


@pytest.mark.parametrize("text", ["0017", "1e3", "+5", "1_000", "0x10", "inf", "nan", ".5", "\uff11", "True ", "yes"])
def test_what_is_not_written_back_the_same_way_stays_a_text(text):
    assert number_or_text(text) == text


def test_a_number_that_no_computer_holds_stays_a_text():
    assert number_or_text("9" * 309) == "9" * 309


@pytest.mark.parametrize(
    ("text", "value"), [("17", 17), ("-2.5", -2.5), ("1.10", 1.1), ("TRUE", True), ("false", False)]
)
def test_numbers_and_switches_are_no_texts(text, value):
    assert (number_or_text(text), type(number_or_text(text))) == (value, type(value))


@pytest.mark.parametrize("number", ["1e3", "1E+03", "1.5e2", "2.5E-01", "+5", ".5", "5.", "1000000000000", "0.00001"])
def test_a_number_comes_back_however_it_is_written(number, tmp_path):
    text = (EXAMPLES / "generic/boiler.yaml").read_text("utf-8").replace("gain: 1.2", f"gain: {number}")
    (tmp_path / "boiler.yaml").write_text(text, "utf-8")
    wanted = config(text)
    assert wanted.loops[0].tuning.gain == Decimal(number)
    for data in sheets(tmp_path / "boiler.yaml"):
        assert config(read_configuration(data, "loops", None, DEFAULT).text) == wanted
    assert config(expanded_text(read_document(text.encode(), "boiler.yaml"))) == wanted


def test_rows_that_fail_alike_are_named_behind_the_first():
    rows = "".join(ROW.replace("2.5", "abc").replace("TIC-1", f"L{i}") for i in range(3))
    (fault,) = faults(HEAD + rows)
    assert fault.endswith("; so it is in rows 3, 4")
    (fault,) = faults(HEAD + "\n".join(rows.splitlines()[:2]) + "\n")
    assert fault.endswith("; so it is in row 3")


def test_a_column_is_left_out_where_its_header_says_so():
    (fault,) = faults("Rack," + HEAD + "17," + ROW)
    assert fault.endswith("remote_setpoint, sample_rate; # before a header leaves it out")
    assert made("# Rack," + HEAD + "17," + ROW).text == made(HEAD + ROW).text


def test_a_column_may_name_the_vendor():
    rows = "Vendor," + HEAD + "DL06," + ROW + "dl06," + ROW.replace("TIC-1", "TIC-2")
    assert made(rows, vendor=None).text == made(HEAD + ROW + ROW.replace("TIC-1", "TIC-2")).text
    (fault,) = faults(rows.replace("dl06,", "click,"), vendor=None)
    assert fault == (
        "loops.csv: cell A2 says DL06 and cell A3 says click; a file has one vendor, so write a sheet for each"
    )
    (fault,) = faults(rows, vendor="click")
    assert fault == "loops.csv is for dl06, and --vendor says click"


def test_two_columns_of_one_key():
    assert faults(HEAD.replace("setpoint", "kp") + ROW)[0].endswith(
        "kp and gain are both tuning.gain; keep one of the two"
    )


@pytest.mark.parametrize("names", [("pv.range", "range low"), ("range low", "pv.range")])
def test_a_pair_and_one_of_its_ends(names):
    cells = {"pv.range": '"[0, 100]"', "range low": "20"}
    text = "tag,action,sample rate,gain,reset," + ",".join(names) + "\nT,direct,2,2.5,180,"
    (fault, *_) = faults(text + ",".join(cells[name] for name in names) + "\n")
    assert fault == f"loops.csv, row 1, cell G1: {names[1]} and {names[0]} are both pv.range; keep the pair or its ends"


def test_errors_are_told_by_row_and_cell():
    bad = faults(HEAD + ROW + ROW.replace("2.5", "abc").replace("direct", "up").replace("TIC-1", "TIC-2"))
    assert [fault.partition(": ")[0] for fault in bad] == [
        "loops.csv, row 3, cell C3 (action)",
        "loops.csv, row 3, cell E3 (gain)",
    ]
    assert "action is 'up', not one of direct, reverse" in bad[0]
    assert "'abc' is not a number" in bad[1]


def test_what_a_row_lacks_is_told_with_its_row():
    (fault,) = faults(HEAD + ROW + ROW.replace("direct", "").replace("TIC-1", "TIC-2"))
    assert "row 3" in fault
    assert "action" in fault


def test_a_cell_beside_the_columns_and_half_a_range():
    assert "cell K2: 'more' has no header above it" in faults(HEAD + ROW.replace("85\n", "85,more\n"))[0]
    assert (
        "pv.range has one end only"
        in faults(HEAD.replace(",range high", ",pv.filter") + ROW.replace(",200", ",0.5"))[0]
    )


def test_findings_of_rules_are_remarks_with_their_cells():
    result = made(HEAD + ROW.replace("2.5", "100"))
    assert config(result.text).loops[0].tuning.gain == 100
    assert any(d.message.startswith("loops.csv, row 2, cell E2 (gain): gain is 100") for d in result.findings)


@pytest.mark.parametrize(
    ("text", "vendor", "message"),
    [
        ("a,b\n1,2\n", "dl06", "has no header"),
        ("", "dl06", "has no header"),
        (HEAD, "dl06", "a header and no loops"),
        (HEAD + ROW, None, "does not say for which vendor"),
        ("vendor,click\n" + HEAD + ROW, "dl06", "is for click, and --vendor says dl06"),
        ("vendor,siemens\n" + HEAD + ROW, None, "there is no vendor siemens"),
        ("plc.loop_table\n" + HEAD + ROW, "dl06", "wants one value"),
        ("colour,red\n" + HEAD + ROW, "dl06", "'colour' stands above the header"),
        (HEAD.encode("utf-8") + b"Ofen-\x81", "dl06", "is neither UTF-8 nor Windows-1252"),
        (b"\0\0\0", "dl06", "is no text"),
        (b"PK\x03\x04nonsense", "dl06", "is no workbook"),
    ],
)
def test_what_is_no_sheet_of_loops(text, vendor, message):
    assert message in faults(text, vendor)[0]


def test_limits():
    assert "is larger than 50 bytes" in faults(HEAD + ROW, limits=Limits(file_bytes=50))[0]
    assert "more than 10 cells" in faults(HEAD + ROW, limits=Limits(nodes=10))[0]


def test_values_that_aliases_stand_for_count_over_all_cells():
    bomb = '"{p: &a [1, 1, 1, 1], q: [*a, *a, *a, *a]}"'
    text = HEAD + "".join(f"TIC-{i},Oven,direct,2,{bomb},180,0,200,degC,85\n" for i in range(9))
    assert faults(text, limits=Limits(nodes=200)) == ("loops.csv: more than 200 values up to cell E9",)
    pairs = 'name,gain,reset,pv.range,sample rate,action\nT,1,1,"[0, 10]",1,direct\nU,1,1,"[0, 10]",1,direct\n'
    assert made(pairs, "dl06", Limits(nodes=40)).loops == 2


def test_a_workbook_that_unpacks_to_too_much():
    doc = read_document((EXAMPLES / "dl06/reactor.yaml").read_bytes(), "x.yaml")
    data = as_workbook(doc, VENDORS["dl06"])
    limits = Limits(file_bytes=len(data), nodes=10**6)
    assert read_configuration(data, "x", None, limits).loops == 3
    book = pytest.importorskip("openpyxl").Workbook()
    book.active.append(["x" * 30000] * 60)
    stream = io.BytesIO()
    book.save(stream)
    assert "when it is unpacked" in faults(stream.getvalue(), limits=Limits(file_bytes=10000))[0]


def repacked(data, change):
    """A workbook, each part of which went through ``change`` with its name."""
    stream = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(data)) as old, zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as new:
        for entry in old.infolist():
            new.writestr(entry.filename, change(entry.filename, old.read(entry)))
    return stream.getvalue()


PARTS = ("[Content_Types].xml", "xl/workbook.xml", "xl/styles.xml", "docProps/core.xml", "xl/worksheets/sheet1.xml")


@pytest.mark.parametrize("part", PARTS)
@pytest.mark.parametrize(
    "damage", [lambda text: text[:-9], lambda text: text.replace(b"<", b"<&", 1), lambda _: b"", lambda _: b"<x/>"]
)
def test_a_damaged_workbook_is_no_workbook(part, damage):
    data = repacked(book_of(), lambda name, text: damage(text) if name == part else text)
    assert data != book_of()
    with suppress(SheetFaultsError):  # without its properties a workbook may be whole
        read_configuration(data, "l.xlsx", "dl06", DEFAULT)


def test_a_workbook_with_a_changed_byte_is_no_workbook():
    rng, book = random.Random(1), book_of()
    for _ in range(20):
        data = bytearray(book)
        data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
        with suppress(SheetFaultsError):
            read_configuration(bytes(data), "l.xlsx", "dl06", DEFAULT)


@pytest.mark.parametrize("other", [False, True])
def test_a_cell_far_out_is_told_and_not_reached_cell_by_cell(other):
    def change(sheet):
        (sheet.parent.create_sheet("far") if other else sheet)["XFD1048576"] = 1

    if other:
        assert made(book_of(change)).remarks[0] == "only the first sheet is read; also there: far"
    else:
        assert "its cells reach to XFD1048576, and it may have 50000" in faults(book_of(change))[0]


def test_a_small_workbook_of_many_cells_is_refused_before_they_are_read():
    cells = b"<row>" + b"<c/>" * 10**6 + b"</row></sheetData>"
    data = repacked(book_of(), lambda _, text: text.replace(b"</sheetData>", cells))
    assert len(data) < 20_000
    assert "more than 500000 elements" in faults(data)[0]


def sheet_of(book):
    """The sheet of a workbook as another library reads it."""
    return pytest.importorskip("openpyxl").load_workbook(io.BytesIO(book)).active


def test_names_that_are_formulas_are_texts_in_the_sheet_and_the_same_when_read():
    text = (EXAMPLES / "dl06/reactor.yaml").read_text("utf-8")
    text = text.replace("Jacket flow, inner loop", '"=HYPERLINK(\\"x\\")"').replace("Reactor 2", '"@SUM(A1)"')
    doc = read_document(text.encode(), "x.yaml")
    text_csv, book = as_csv(doc, VENDORS["dl06"]), as_workbook(doc, VENDORS["dl06"])
    assert "\nname,'@SUM(A1)\n" in text_csv
    assert "\"'=HYPERLINK(" in text_csv
    cells = [cell for row in sheet_of(book).iter_rows() for cell in row]
    assert "f" not in {cell.data_type for cell in cells}
    assert {'=HYPERLINK("x")', "@SUM(A1)"} <= {cell.value for cell in cells}
    for data in (text_csv.encode(), book):
        assert config(read_configuration(data, "x", None, DEFAULT).text) == config(text)


@pytest.mark.parametrize("begin", [*(sign for sign in FORMULA_STARTS if sign != "\r"), "5'=", "it''s "])
def test_a_text_that_a_spreadsheet_would_calculate_is_the_same_when_read(begin):
    doc = read_document(
        (EXAMPLES / "dl06/reactor.yaml").read_text("utf-8").replace("Reactor 2", json.dumps(f"{begin}1+1")).encode(),
        "x.yaml",
    )
    text = as_csv(doc, VENDORS["dl06"])
    assert not any(cell.startswith(FORMULA_STARTS[:-1]) for row in csv.reader(io.StringIO(text)) for cell in row)
    assert config(read_configuration(text.encode(), "x", None, DEFAULT).text).name == f"{begin}1+1"


class Dates(type):
    """Of a class that stands in for that of all dates."""

    def __instancecheck__(cls, value):
        return isinstance(value, datetime)


class Later(datetime, metaclass=Dates):
    """A clock that is years ahead."""

    @classmethod
    def now(cls, tz=None):
        """Years from now."""
        return datetime.now(tz) + timedelta(days=1000)


def test_a_workbook_does_not_know_what_time_it_is(monkeypatch):
    def books():
        return sheets(EXAMPLES / "dl06/reactor.yaml")[2], write_workbook([], Title("T"))

    first = books()
    monkeypatch.setattr("xlsxwriter.core.datetime", Later)
    monkeypatch.setattr(time, "localtime", lambda _=None, real=time.localtime: real(2e9))
    assert books() == first


def test_numbers_are_numbers_in_a_workbook():
    doc = read_document((EXAMPLES / "dl06/reactor.yaml").read_bytes(), "x.yaml")
    rows = list(sheet_of(as_workbook(doc, VENDORS["dl06"])).iter_rows(values_only=True))
    header = next(row for row in rows if "tuning.gain" in row)
    assert [row[header.index("tuning.gain")] for row in rows[rows.index(header) + 1 :]] == [0.8, 2.5, 1.2]


def test_columns_stand_in_the_order_of_the_schema():
    loop = read_document(
        made(
            "gain,setpoint,unit,tag,out unit,range high,range low,action,sample,reset\n"
            "2,50,degC,A,%,100,0,direct,1,60\n"
        ).text.encode(),
        "x",
    ).data["loops"][0]
    assert list(loop) == ["name", "sample_rate", "action", "tuning", "pv", "setpoint", "output"]


def test_what_a_sheet_does_not_say_of_the_plc_is_told():
    output = "output.range is [0, 100] % in TIC-1, since the sheet says none"
    assert made(HEAD + ROW).remarks == (output, "plc is as in the starter file of dl06; look at it")
    assert made("plc.loop_table,V3000\n" + HEAD + ROW).remarks == (output,)
    assert config(made("plc.loop_table,V3000\n" + HEAD + ROW).text).plc.loop_table is not None


SCALED = {
    "dl06": "name,sample_rate,action,gain,setpoint{}\nA,1,direct,2,50{}\n",
    "ezlogix": "name,registers,discretes,algorithm,sample rate,action,gain,setpoint,pv.tag,output.tag{}\n"
    "A,R101,S101,position,2,reverse,2,50,IR1,OR1{}\n",
}
"""A sheet of each family that holds values in counts, without ranges and units."""


@pytest.mark.parametrize("vendor", SCALED)
@pytest.mark.parametrize(
    ("columns", "cells", "asked"),
    [
        (",unit", ",°C", "pv.unit is °C, and there is no pv.range: add the columns range low and range high"),
        (",output.unit", ",rpm", "there is no output.range: add the columns output.range low and output.range high"),
        (
            ",output.unit,output.limits low,output.limits high",
            ",%,5,95",
            "output.unit is %, and there is no output.range",
        ),
        (",Deadband [K],unit,range low,range high", ",2 K,°C,0,400", "the key is in °C, not in K"),
    ],
)
def test_a_unit_without_a_range_is_asked_for_by_name(vendor, columns, cells, asked):
    with pytest.raises(SheetFaultsError) as caught:
        made(SCALED[vendor].format(columns, cells), vendor)
    assert asked.replace("°C", "degC") in " ".join(caught.value.faults).replace("°C", "degC")


@pytest.mark.parametrize("vendor", SCALED)
def test_a_unit_in_a_header_is_no_range(vendor):
    with pytest.raises(SheetFaultsError, match=r"value is 50 degC, and pv has no range .*; give pv.range"):
        made(SCALED[vendor].replace("setpoint", "Setpoint [°C]").format("", ""), vendor)


@pytest.mark.parametrize("vendor", SCALED)
@pytest.mark.parametrize(
    ("columns", "cells", "output"),
    [
        ("", "", ("0", "100")),
        (",output.unit", ",%", ("0", "100")),
        (",output.range low,output.range high", ",0,50", ("0", "50")),
        (",output.range low,output.range high", ",,", None),
        (",output.limits low,output.limits high", ",0,4095", None),
    ],
)
def test_an_output_of_which_no_more_is_said_is_in_per_cent(vendor, columns, cells, output):
    result = made(SCALED[vendor].format(columns, cells), vendor)
    given = config(result.text).loops[0].output
    assert given.range == (output and tuple(map(Decimal, output)))
    assert any("output.range is" in remark for remark in result.remarks) == (output == ("0", "100"))


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "reactor.yaml").write_bytes((EXAMPLES / "dl06" / "reactor.yaml").read_bytes())
    return tmp_path


def call(*words):
    return CliRunner().invoke(cli, list(words))


@pytest.mark.parametrize(
    ("name", "options"), [("l.csv", []), ("l.xlsx", []), ("l.csv", ["--decimal-comma"]), ("l.yml", [])]
)
def test_export_and_init(folder, name, options):
    assert call("export", "reactor.yaml", "-o", name, *options).exit_code == 0
    if not name.endswith("yml"):
        assert call("init", "--from", name, "-o", "back.yaml").exit_code == 0
    assert pidcfg.diff(folder / "reactor.yaml", folder / ("back.yaml" if name != "l.yml" else name)).same


def test_export_refuses(folder):
    assert call("export", "reactor.yaml", "--format", "xlsx").exit_code != 0
    assert call("export", "reactor.yaml", "--decimal-comma").exit_code != 0
    (folder / "x.csv").write_text("mine", "utf-8")
    assert call("export", "reactor.yaml", "-o", "x.csv").exit_code != 0
    assert (folder / "x.csv").read_text("utf-8") == "mine"
    (folder / "no.yaml").write_text("pidcfg: 1\nvendor: dl06\n", "utf-8")
    assert "no.yaml could not be read" in call("export", "no.yaml").stderr


def test_init_from_tells_every_fault_and_writes_nothing(folder):
    (folder / "l.csv").write_text(HEAD + ROW.replace("2.5", "abc"), "utf-8")
    result = call("init", "--from", "l.csv", "--vendor", "dl06", "-o", "x.yaml")
    assert result.exit_code != 0
    assert "cell E2 (gain)" in result.stderr
    assert not (folder / "x.yaml").exists()
    assert "cannot read none.csv" in call("init", "--from", "none.csv", "--vendor", "dl06").stderr


def book_of(change=lambda _: None):
    book = pytest.importorskip("openpyxl").Workbook()
    for row in (HEAD, ROW, ROW.replace("TIC-1", "TIC-2")):
        cells = row.strip().split(",")
        book.active.append([float(cell) if cell[0].isdigit() else cell for cell in cells])
    change(book.active)
    stream = io.BytesIO()
    book.save(stream)
    return stream.getvalue()


@pytest.mark.parametrize(
    ("header", "seconds"), [("Reset", 3), ("Reset (s)", 3), ("Reset [min]", 180), ("Ti (h)", 10800)]
)
def test_a_unit_of_time_in_a_header_counts(header, seconds):
    loop = config(made(HEAD.replace("reset", header) + ROW.replace("180", "3")).text).loops[0]
    assert loop.tuning.reset.duration.seconds() == seconds


def test_a_comma_between_thousands_is_no_decimal_comma():
    (fault,) = faults(HEAD + ROW.replace("180", '"1,200"'))
    assert fault.startswith("loops.csv, row 2, cell F2: 1,200 can be two numbers, 1.200 or 1200;")
    semicolons = (HEAD + ROW.replace("180", '"1,200"')).replace(",", ";").replace("1;200", "1,200")
    assert "1,200 can be two numbers" in faults(semicolons)[0]
    german = config(made(semicolons.replace("2.5", "2,5")).text)
    assert str(german.loops[0].tuning.reset) == str(
        config(made(HEAD + ROW.replace("180", "1.2")).text).loops[0].tuning.reset
    )


def test_names_that_look_like_numbers_stay():
    rows = "".join(ROW.replace("TIC-1", name) for name in ("1.10", "1.1", "nan", "1.101", "12345678901234567890"))
    for text in (HEAD + rows, (HEAD + rows).replace(",", ";").replace("2.5", "2,5")):
        names = ["1.10", "1.1", "nan", "1.101", "12345678901234567890"]
        whole = made(text).text
        assert [loop.name for loop in config(whole).loops] == names
        doc = read_document(whole.replace("'%'", '"%"').replace("'", "").encode(), "x.yaml")
        assert [loop.name for loop in config(expanded_text(doc)).loops] == names
        for data in (as_csv(doc, VENDORS["dl06"], comma=True).encode(), as_workbook(doc, VENDORS["dl06"])):
            assert [loop.name for loop in config(read_configuration(data, "x", None, DEFAULT).text).loops] == names


@pytest.mark.parametrize("name", ["FALSE", "1.10", "1e3", "007"])
def test_a_name_of_the_whole_file_that_looks_like_another_value_stays(name):
    doc = read_document(made(HEAD + ROW).text.replace("loops:", f"name: {name}\nloops:").encode(), "x.yaml")
    for data in (as_csv(doc, VENDORS["dl06"]).encode(), as_workbook(doc, VENDORS["dl06"])):
        assert config(read_configuration(data, "x", None, DEFAULT).text).name == name


@pytest.mark.parametrize(
    ("place", "value", "form", "message"),
    [
        ("J2", "=E2*34", "General", "row 2, cell J2: the formula has no result in the file"),
        ("J2", "#DIV/0!", "General", "row 2, cell J2: the formula gives #DIV/0!"),
        ("J3", 0.5, "0 %", "row 3, cell J3: the cell shows percent and holds 0.5"),
        ("E2", date(2026, 5, 2), "D.M", "row 2, cell E2: the cell holds a date"),
    ],
)
def test_a_cell_that_shows_something_else_than_it_holds(place, value, form, message):
    def change(sheet):
        sheet[place] = value
        sheet[place].number_format = form

    assert message in faults(book_of(change))[0]


def test_merged_cells_are_refused_and_numbers_of_a_workbook_are_what_they_are():
    assert "the cells I2:I3 are merged" in faults(book_of(lambda sheet: sheet.merge_cells("I2:I3")))[0]

    def change(sheet):
        sheet["F2"], sheet["B2"] = 1.125, "2,5"

    assert str(config(made(book_of(change)).text).loops[0].tuning.reset).startswith("1.125")


def test_another_sheet_of_a_workbook_is_named():
    def change(sheet):
        sheet.parent.create_sheet("empty")
        sheet.parent.create_sheet("Line 2").append(["tag"])

    assert made(book_of(change)).remarks[0] == "only the first sheet is read; also there: Line 2"


# --- units of headers, and loops that are taken for one another -------------------------------------------------------

PLAIN = "name,action,sample_rate,range low,range high,gain,reset,rate,unit,{}\n{},direct,1,0,200,2,60,0,degC,90\n"


@pytest.mark.parametrize("header", ["Setpoint (degC)", "Setpoint [°C]", "Setpoint"])
def test_a_number_under_a_header_with_the_loops_own_unit_is_taken(header):
    assert (
        check_source(made(PLAIN.format(header, "A")).text, None, None, DEFAULT).config.loops[0].setpoint.value.value
        == 90
    )


def test_a_header_with_another_unit_than_the_loops_is_refused():
    (fault,) = faults(PLAIN.format("Setpoint (°F)", "A"))
    assert fault.startswith(
        "loops.csv, row 2, cell J2 (Setpoint (°F)): value: '90 °F' is not a number; the key is in degC"
    )


def test_two_loops_of_one_name_are_refused_at_the_second():
    text = PLAIN.format("Setpoint", "A")
    (fault,) = faults(text + text.splitlines()[1] + "\n")
    assert fault == "loops.csv, row 3, cell A3: A is the name of the loop in row 2, too; give each its own"


def test_errors_that_say_the_same_of_one_column_are_told_once():
    rows = "".join(f"L{i},direct,1,0,200,2,x,0,degC,90\n" for i in range(14))
    told, other = faults(PLAIN.splitlines()[0].format("Setpoint") + "\n" + rows + "Z,direct,y,0,200,2,60,0,degC,90\n")[
        ::-1
    ]
    assert told.endswith("; so it is in rows 3, 4, 5, 6, 7, 8, 9, 10, 11, 12 and 3 more") or other.endswith(
        "and 3 more"
    )
    assert "row 16, cell C16 (sample_rate)" in told + other


MANY = """\
vendor;dl06
plc.loop_table;V9999
farbe;rot
Regler;Beschreibung;Betriebsart;Wirkrichtung;Abtastzeit;Verstärkung;Ti;von;bis;Sollwert
TIC-1;Ofen;Automatik;heizen;1;1,5;60;0;200;85
TIC-2;x;Auto;umgekehrt;zwei;1,5;60;0;200;85
TIC-3;x;foo;bar;drei;1,5;60;0;;85
"""


@pytest.mark.parametrize("encoding", ["utf-8", "cp1252"])
def test_everything_that_is_wrong_is_told_at_once_each_row_with_its_own_value(encoding):
    with pytest.raises(SheetFaultsError) as caught:
        read_configuration(MANY.encode(encoding), "s.csv", None, DEFAULT)
    assert [fault.removeprefix("s.csv, row ").partition(";")[0] for fault in caught.value.faults] == [
        "2, cell B2 (plc.loop_table): loop_table: V9999 is not octal: 9 is not an octal digit",
        "3, cell A3: 'farbe' stands above the header and is no key of a file",
        "6, cell E6 (Abtastzeit): sample_rate: 'zwei' is not a number",
        "7, cell A7: pv.range has one end only",
        "7, cell C7 (Betriebsart): mode is 'foo', not one of manual, auto, cascade",
        "7, cell D7 (Wirkrichtung): action is 'bar', not one of direct, reverse",
        "7, cell E7 (Abtastzeit): sample_rate: 'drei' is not a number",
    ]


def test_a_sheet_as_excel_writes_it_is_read_and_said_to_be_so():
    text = HEAD + ROW.replace("TIC-1", "Ofen grün")
    remark = "it is no UTF-8, so it is read as Windows-1252, as Excel writes CSV"
    old, new = (read_configuration(text.encode(encoding), "l.csv", "dl06", DEFAULT) for encoding in ("cp1252", "utf-8"))
    assert old.text == new.text
    assert (remark in old.remarks, remark in new.remarks) == (True, False)


HEATS = {"dl06": "direct", "click": "direct", "ezlogix": "reverse", "nextopid": "false", "dpide": "true"}
HEATS["generic"] = "true"
COOLS = {"direct": "reverse", "reverse": "direct", "true": "false", "false": "true"}


@pytest.mark.parametrize("vendor", HEATS)
def test_german_values_are_the_vendors_own(vendor):
    key = key_of("Wirkrichtung", VENDORS[vendor])
    for word in ("heizen", "Heizen", "heating"):
        assert cell_word(word, key, VENDORS[vendor]) == HEATS[vendor]
    for word in ("kühlen", "KÜHLEN", "kuehlen", "cooling"):
        assert cell_word(word, key, VENDORS[vendor]) == COOLS[HEATS[vendor]]
    assert cell_word("irgendwie", key, VENDORS[vendor]) == "irgendwie"
    own = {"dpide": ("reverse", "false"), "nextopid": ("direkt", "true"), "generic": ("Ja", "true")}
    text, value = own.get(vendor, ("direkt", "direct"))
    assert cell_word(text, key, VENDORS[vendor]) == value
    text, value = {"dpide": ("vorwärts", "true"), "generic": ("nein", "false"), "nextopid": ("umgekehrt", "false")}.get(
        vendor, ("umgekehrt", "reverse")
    )
    assert cell_word(text, key, VENDORS[vendor]) == value


@pytest.mark.parametrize(
    ("text", "mode"),
    [("Automatik", "auto"), ("AUTO", "auto"), ("Hand", "manual"), ("Manuell", "manual"), ("Kaskade", "cascade")],
)
def test_german_modes(text, mode):
    assert cell_word(text, "mode", VENDORS["dl06"]) == mode
    assert cell_word(text, "description", VENDORS["dl06"]) == text


@pytest.mark.parametrize(("text", "value"), [("ja", "true"), ("WAHR", "true"), ("Nein", "false"), ("falsch", "false")])
def test_german_switches_are_those_of_keys_that_are_switches(text, value):
    assert cell_word(text, "bias_freeze", VENDORS["dl06"]) == value
    assert cell_word(text, "PID_EQ", VENDORS["dpide"]) == value
    assert cell_word(text, "Indep", VENDORS["nextopid"]) == value
    assert cell_word(text, "tuning.gain", VENDORS["dl06"]) == text


def test_a_german_sheet_is_a_configuration():
    text = MANY.replace("V9999", "V2000").replace("farbe;rot\n", "").replace("zwei", "2").replace("drei", "1,5")
    text = text.replace("foo;bar", "Hand;kühlen").replace("0;;85", "0;300;85")
    loops = config(read_configuration(text.encode("cp1252"), "s.csv", None, DEFAULT).text).loops
    assert [(loop.mode, loop.action) for loop in loops] == [
        ("auto", "direct"),
        ("auto", "reverse"),
        ("manual", "reverse"),
    ]
