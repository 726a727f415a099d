"""The files of Delta AS operands: listings, the operand table, and the symbol table of ISPSoft."""

from __future__ import annotations

import csv
import io
import json
import re
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from command import run
from dpide_strategies import configurations
from pidcfg.encoders.codecs import DecodeError
from pidcfg.encoders.decoding import decode_listing
from pidcfg.encoders.dpide import DECODE_OPTIONS
from pidcfg.encoders.dpide import symbols as symbol_table
from pidcfg.encoders.dpide.files import FORMATS, checklist
from pidcfg.encoders.dpide.image import MAX_LOOP_NAME, decode, encode
from pidcfg.encoders.dpide.symbols import OPERAND_COLUMNS as COLUMNS
from pidcfg.encoders.listing import ListingError, UnwritableError, detect_kind
from pidcfg.encoders.maps.dpide import ROWS
from pidcfg.schemas.dpide import DpideFile
from pidcfg.vendors import VENDORS
from test_dpide_encoding import configuration

SLOW = settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.too_slow])
READABLE = ("text", "csv", "json", "operands")
SYMBOL_NAMES = st.from_regex(r"[A-Za-z][A-Za-z0-9_]{0,9}", fullmatch=True)


def written(kind: str, config: DpideFile | None = None, checks: tuple[str, ...] = ()) -> str:
    """A configuration in one of the formats."""
    return FORMATS[kind].write(encode(config or configuration(PID_DIR=True)).image, checks)


def read_back(kind: str, text: str, **options) -> DpideFile:
    """The configuration that a text of a format holds."""
    listing = FORMATS[kind].read(text)
    return DpideFile.model_validate(decode(listing.words, listing.settings, listing.plc, options).data)


def rows(text: str) -> list[dict[str, str]]:
    """The rows of a CSV text, without comments."""
    body = "".join(line for line in text.splitlines(keepends=True) if not line.startswith("#"))
    return list(csv.DictReader(io.StringIO(body, newline="")))


@pytest.mark.parametrize(
    ("header", "kind"),
    [
        ("operand,value", "operands"),
        ("Value;Loop;Operand", "operands"),
        ("operand,type", None),
        ("name,type", "csv"),
        ("name,value", None),
        ("class,identifiers,address", "symbols"),
        ("Class,Identifiers,Type", None),
    ],
)
def test_a_table_is_known_by_the_columns_that_it_must_have(header, kind):
    found = detect_kind(f"{header}\nx,y,z\n", FORMATS)
    assert (found and found.name) == kind


def test_a_comment_of_a_symbol_table_has_commas_of_its_own():
    table = symbol_table.parse_symbols(
        ",".join(symbol_table.COLUMNS) + "\nVAR,A,D0,ARRAY [0..1, 0..2] OF INT,0,a, b, c\n"
    )
    (row,) = table.rows
    assert (row.cells[3:], row.comment) == (("ARRAY [0..1, 0..2] OF INT", "0", "a, b, c"), "a, b, c")


@pytest.mark.parametrize("kind", READABLE)
@SLOW
@given(config=configurations())
def test_every_format_comes_back_with_the_same_text(kind, config):
    text = written(kind, config, ("one, two",))

    assert detect_kind(text, FORMATS) is FORMATS[kind]
    again = read_back(kind, text)
    assert encode(again).image == encode(config).image
    assert written(kind, again, ("one, two",)) == text


def test_a_value_takes_a_register_for_each_16_bits():
    bits = {16: {"WORD", "INT", "UINT"}, 32: {"DWORD", "DINT", "UDINT", "REAL"}, 64: {"LWORD", "LREAL"}}
    assert {"BOOL": 0} | {
        name: size // 16 for size, names in bits.items() for name in names
    } == symbol_table.TYPE_REGISTERS


def test_a_table_without_values_is_known_for_what_it_is():
    text = "name,type\nA,REAL\n"
    assert detect_kind(text, FORMATS) is FORMATS["csv"]
    with pytest.raises(ListingError, match="the header has no column value or expression"):
        FORMATS["csv"].read(text)


def test_the_table_has_a_row_for_every_operand_with_device_value_and_unit():
    config = configuration(
        devices={"SV": "D100", "PV": "D102", "MV": "D104", "PID_RUN": "M10"},
        PID_EQ=True,
        pv={"range": [0, 400], "unit": "degC"},
        output={"unit": "%"},
    )
    table = {row["operand"]: row for row in rows(written("operands", config))}

    assert tuple(table) == tuple(ROWS)
    assert tuple(table["SV"]) == COLUMNS
    shown = {name: (row["type"], row["device"], row["value"], row["unit"]) for name, row in table.items()}
    assert shown["PID_RUN"] == ("BOOL", "M10", "TRUE", "")
    assert shown["SV"] == ("REAL", "D100", "80.0", "degC")
    assert shown["PV"] == ("REAL", "D102", "", "degC")
    assert shown["CYCLE"] == ("DINT", "", "1000", "ms")
    assert shown["Ti_Ki"] == ("REAL", "", "180.0", "s")
    assert shown["MV_MAX"] == ("REAL", "", "4000.0", "%")
    assert shown["I_MV"] == ("REAL", "D500", "", "%")
    assert shown["MV"] == ("REAL", "D104", "", "%")


def test_the_integral_is_a_time_or_a_gain():
    units = [
        next(r["unit"] for r in rows(written("operands", configuration(PID_EQ=form))) if r["operand"] == "Ti_Ki")
        for form in (True, False)
    ]

    assert units == ["s", "1/s"]


def test_a_unit_that_a_spreadsheet_would_calculate_is_put_in_parentheses():
    text = written("operands", configuration(pv={"unit": "=1+1\nx"}))

    assert {row["unit"] for row in rows(text) if row["operand"] == "SV"} == {"(=1+1 x)"}
    assert read_back("operands", text).loops[0].pv.unit == "=1+1\nx"


def test_a_table_that_a_spreadsheet_has_saved_is_read_with_its_settings():
    config = configuration({"interrupt_task": 500}, devices={"SV": "D100"}, pv={"range": [0, 400], "unit": "degC"})
    text = written("operands", config, ("first, second",))
    cells = [line.split(",") if line.startswith("#") else next(csv.reader([line])) for line in text.splitlines()]
    out = io.StringIO()
    csv.writer(out, lineterminator="\r\n").writerows(row + [""] * (max(map(len, cells)) - len(row)) for row in cells)
    saved = out.getvalue()
    assert '"# loop: {""loop"": ""OVEN""",' in saved

    assert encode(read_back("operands", saved)).image == encode(config).image


BY_HAND = """operand,value,device
OVEN.SV,80,D100
OVEN.CYCLE,1000,
OVEN.Kc_Kp,12.0,
OVEN.Ti_Ki,180,
OVEN.Td_Kd,20,
OVEN.MV_MAX,4000,
OVEN.MV_MIN,0,
OVEN.PID_DIR,TRUE,M7
OVEN.PV,,D102
"""
BLOCK_ROW = "OVEN.I_MV,,D500\n"


def test_a_table_that_somebody_wrote_is_read_with_its_devices():
    loop = read_back("operands", BY_HAND + BLOCK_ROW).loops[0]

    assert (loop.name, loop.device, loop.SV, loop.PID_DIR) == ("OVEN", "D500", 80, True)
    assert loop.devices.by_operand() == {"PID_DIR": "M7", "SV": "D100", "PV": "D102"}


def test_a_table_without_the_block_needs_its_device_as_an_option():
    with pytest.raises(DecodeError, match="--device"):
        read_back("operands", BY_HAND)
    assert read_back("operands", BY_HAND, device=["D600"]).loops[0].device == "D600"


def test_the_loop_may_stand_in_a_column_of_its_own():
    lines = ["operand,type,value,loop"]
    lines += [
        f"{line.split(',')[0].removeprefix('OVEN.')},,{line.split(',')[1]},OVEN" for line in BY_HAND.splitlines()[1:]
    ]
    lines[1] = "OVEN.SV,REAL,80,OVEN"
    lines[2] = "CYCLE,DWORD,1000,OVEN"

    loop = read_back("operands", "\n".join(lines), device=["D0"]).loops[0]

    assert (loop.name, loop.SV, loop.CYCLE) == ("OVEN", 80, 1000)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("OVEN.SV,80,D100", "OVEN.SV,80,M1", "D register"),
        ("OVEN.SV,80,D100", "OVEN.SV,80,D30000", "does not exist"),
        ("OVEN.PID_DIR,TRUE,M7", "OVEN.PID_DIR,TRUE,D7", "bit"),
        ("OVEN.PID_DIR,TRUE,M7", "OVEN.PID_DIR,1,M7", "BOOL"),
        ("OVEN.CYCLE,1000,", "OVEN.CYCLE,1000.5,", "DINT"),
        ("OVEN.CYCLE,1000,", "OVEN.CYCLE,2147483648,", "DINT"),
        ("OVEN.SV,80,D100", "OVEN.SV,nan,D100", "REAL"),
        ("OVEN.SV,80,D100", "OVEN.SV,1e39,D100", "REAL"),
        ("OVEN.SV,80,D100", "OVEN.SV,,D100", "no value"),
        ("OVEN.SV,80,D100", "OVEN.SW,80,D100", "operand"),
        ("OVEN.SV,80,D100", "SV,80,D100", "operand"),
        ("OVEN.SV,80,D100", "=1.SV,80,D100", "operand"),
        ("OVEN.SV,80,D100", "OVEN.SV,80,D100\nOVEN.SV,80,D100", "again"),
        ("OVEN.SV,80,D100", "OVEN.SV,80", "cells"),
        ("operand,value,device", "operand,device,device", "column value"),
    ],
)
def test_a_table_that_is_wrong_is_refused_with_its_line(old, new, message):
    with pytest.raises(ListingError, match=message) as caught:
        FORMATS["operands"].read((BY_HAND + BLOCK_ROW).replace(old, new))

    lines = (BY_HAND + BLOCK_ROW).replace(old, new).splitlines()
    assert lines[caught.value.line - 1].startswith(new.splitlines()[-1])


def test_a_type_that_is_not_the_operands_is_refused():
    text = written("operands").replace("SV,REAL", "SV,DINT", 1)

    with pytest.raises(ListingError, match="SV is REAL"):
        FORMATS["operands"].read(text)


@pytest.mark.parametrize("kind", ["csv", "json", "operands"])
def test_a_device_in_a_row_that_differs_from_the_settings_is_refused(kind):
    config = configuration(devices={"SV": "D100"})
    text = written(kind, config)
    changed = (
        json.dumps(
            json.loads(text)
            | {
                "words": [
                    {**word, "device": "D102"} if word["address"] == "OVEN.SV" else word
                    for word in json.loads(text)["words"]
                ]
            }
        )
        if kind == "json"
        else "".join(
            line if line.startswith("#") else line.replace("D100", "D102") for line in text.splitlines(keepends=True)
        )
    )

    with pytest.raises(ListingError, match="D102, but the settings say D100"):
        FORMATS[kind].read(changed)


@pytest.mark.parametrize("kind", ["csv", "json"])
def test_devices_are_taken_from_the_rows_where_nothing_stands_beside_them(kind):
    config = configuration(devices={"SV": "D100", "PID_RUN": "M1"})
    text = written(kind, config)
    if kind == "json":
        bare = json.dumps({"words": json.loads(text)["words"]})
    else:
        bare = "".join(line for line in text.splitlines(keepends=True) if not line.startswith("#"))

    assert encode(read_back(kind, bare)).image.words == encode(config).image.words
    assert read_back(kind, bare).loops[0].device == "D500"
    assert read_back(kind, bare).loops[0].devices == config.loops[0].devices


HOSTILE = (
    # document, what is said of it
    (
        {"words": [{"address": "OVEN.SV", "type": "REAL", "value": 80, "device": 5}]},
        "OVEN.SV: the device is not a text",
    ),
    (
        {"words": [{"address": "OVEN.SV", "type": "REAL", "value": 80, "device": "M5"}]},
        "SV: 'M5' is not the address of a D register",
    ),
    ({"words": [{"address": "OVEN.SV", "type": "REAL", "value": "80"}]}, 'the value "80" is not one of REAL'),
    ({"words": [{"address": "OVEN.SV", "type": "REAL", "value": True}]}, "the value true is not one of REAL"),
    ({"words": [{"address": "OVEN.SV", "type": "REAL", "value": 1e39}]}, "the value 1e+39 is not one of REAL"),
    ({"words": [{"address": "OVEN.SV", "type": "LREAL", "value": 80}]}, "does not say the device of I_MV"),
    ({"words": [{"address": "OVEN.SV", "type": ["REAL"], "value": 80}]}, '["REAL"] is not one of the types'),
    ({"words": [{"address": "OVEN.SV", "type": "REAL", "value": [80]}]}, "the value [80] is not one of REAL"),
    *(
        ({"words": [{"address": "A.SV", "type": "REAL", **both}]}, "an expression is a text, and stands in place of a")
        for both in ({"expression": 5}, {"expression": "B", "value": 80})
    ),
    ({"words": [{"address": ["OVEN.SV"], "type": "REAL", "value": 80}]}, "words[0] has no text 'address'"),
    ({"words": [{"address": "OVEN.SV", "type": "REAL", "value": 80}] * 2}, "OVEN.SV stands here again"),
    (
        {
            "words": [{"address": "OVEN.SV", "type": "REAL", "expression": "a"}],
            "settings": [{"loop": "L", "device": "D0"}],
        },
        "the listing does not hold L.SV",
    ),
    (
        {
            "words": [{"address": "OVEN.XX", "type": "REAL", "value": 80}],
            "settings": [{"loop": "OVEN", "device": "D0"}],
        },
        "'XX' is not an operand of DPIDE",
    ),
    (
        {
            "words": [{"address": "OVEN.SV", "type": "REAL", "value": 80}],
            "settings": [{"loop": ["OVEN"], "device": "D0"}],
        },
        "a list stands where text is wanted",
    ),
    (
        {
            "words": [{"address": "OVEN.SV", "type": "REAL", "value": 80}],
            "settings": [{"loop": "OVEN", "devices": [1]}],
        },
        "does not say the device of I_MV",
    ),
    (
        {"words": [{"address": "OVEN.SV", "type": "REAL", "value": 80}], "settings": [{"loop": {}}], "plc": {"x": 1}},
        "plc: x: Extra inputs",
    ),
    *(
        (
            {
                "words": [{"address": "OVEN.SV", "type": "REAL", "value": 80, "device": "D100"}],
                "settings": [{"loop": "OVEN", "device": "D0", "devices": devices}],
            },
            "settings[0]: devices: ",
        )
        for devices in (5, [1], "D100")
    ),
    ({"words": [{"address": ".SV", "type": "REAL", "value": 80}]}, "holds no operand of a DPIDE instruction"),
    ({"words": [{"address": "OVEN.", "type": "REAL", "value": 80}]}, "holds no operand of a DPIDE instruction"),
    ({"words": [1]}, "words[0] has no text 'address'"),
    ({"words": [], "settings": [[]]}, "not a list of mappings"),
    ({"words": {}}, "no list 'words'"),
    ([], "no list 'words'"),
)


@pytest.mark.parametrize(("document", "message"), HOSTILE, ids=range(len(HOSTILE)))
def test_a_document_that_makes_no_sense_is_refused_and_never_a_traceback(document, message):
    with pytest.raises((ListingError, DecodeError), match=re.escape(message)):
        read_back("json", json.dumps(document))


@pytest.mark.parametrize("kind", READABLE)
@settings(max_examples=120, deadline=None)
@given(data=st.data())
def test_damaged_listings_are_read_or_refused(kind, data):
    text = written(kind, configuration(devices={"SV": "D100"}, pv={"unit": "degC"}))
    start = data.draw(st.integers(0, len(text)))
    end = data.draw(st.integers(start, min(len(text), start + 12)))
    damaged = text[:start] + data.draw(st.text(max_size=3)) + text[end:]
    with suppress(ListingError):
        found = decode_listing(FORMATS[kind].read(damaged), VENDORS["dpide"], {"device": ["D500"]})
        assert found.data["loops"]


@SLOW
@given(configurations(SYMBOL_NAMES))
def test_a_symbol_table_has_six_cells_a_row_and_unique_identifiers(config):
    names = [loop.name.casefold() for loop in config.loops]
    if len(set(names)) < len(names):
        with pytest.raises(UnwritableError, match="share the symbol"):
            written("symbols", config)
        return
    data = written("symbols", config).encode(FORMATS["symbols"].encoding)
    lines = data.decode("gbk").split("\r\n")

    assert lines[0] == "Class,Identifiers,Address,Type,Initial Value,Comment"
    assert lines[-1] == ""
    cells = [line.split(",") for line in lines[1:-1]]
    assert {len(row) for row in cells} == {6}
    assert {row[0] for row in cells} == {"VAR"}
    identifiers = [row[1] for row in cells]
    assert len({name.casefold() for name in identifiers}) == len(ROWS) * len(config.loops)
    assert all(len(name) <= 34 and name[0].isalpha() and name.isascii() for name in identifiers)
    assert "\n" not in "".join(lines)
    assert not data.startswith(b"\xef\xbb\xbf")


def test_a_symbol_has_address_type_and_initial_value_and_what_the_plc_writes_has_none():
    config = configuration(devices={"SV": "D100"}, PV=5, pv={"unit": "°C, real"})
    table = {row["Identifiers"]: row for row in rows(written("symbols", config))}

    assert [*table["OVEN_SV"].values()] == ["VAR", "OVEN_SV", "D100", "REAL", "80.0", "SV: Target value; °C; real"]
    assert [*table["OVEN_IMV"].values()][2:5] == ["D500", "REAL", ""]
    assert "30 registers D500 to D529" in table["OVEN_IMV"]["Comment"]
    assert [*table["OVEN_PV"].values()][2:5] == ["", "REAL", ""]
    assert [*table["OVEN_RUN"].values()][2:5] == ["", "BOOL", "TRUE"]
    assert [*table["OVEN_CYCLE"].values()][2:5] == ["", "DINT", "1000"]


def test_a_character_that_gbk_does_not_have_is_replaced_in_a_comment():
    data = written("symbols", configuration(pv={"unit": "µm ℃ 度\u2028x"})).encode("gbk")

    assert "SV: Target value; ?m ℃ 度 x".encode("gbk") in data


@pytest.mark.parametrize("name", ["101-OVEN", "Öfen", "FIC-101-" + "X" * 21, "炉"])
def test_names_that_give_no_symbols_are_refused(name):
    with pytest.raises(UnwritableError, match=name):
        written("symbols", configuration(name=name))


@pytest.mark.parametrize(("first", "second"), [("A", "a"), ("T-1", "T_1"), ("T.1", "t#1")])
def test_names_that_give_the_same_symbols_are_refused_together(first, second):
    loops = [config.loops[0] for config in (configuration(name=first), configuration(name=second, device="D600"))]

    with pytest.raises(UnwritableError, match="share the symbol"):
        written("symbols", DpideFile(pidcfg=1, vendor="dpide", loops=tuple(loops)))


def test_the_longest_name_gives_symbols_of_34_characters():
    """As long as the longest of an export of ISPSoft with 1,317 symbols."""
    name = "FIC-101-" + "X" * 20
    found = [row["Identifiers"] for row in rows(written("symbols", configuration(name=name)))]

    assert len(name) == MAX_LOOP_NAME
    assert max(map(len, found)) == 34
    assert f"FIC_101_{'X' * 20}_CYCLE" in found


# --- into a symbol table of the user's -------------------------------------------------------------------------------

HEAD = "Class,Identifiers,Address,Type,Initial Value,Comment"
USERS = (
    f"{HEAD}\r\n"
    "VAR,Station_North_Conveyor_Ready_Lamp1,M2000,BOOL,FALSE,Lamp, north, of the conveyor\r\n"
    "VAR,Station_North_Temperature_Limit_01,D200,REAL,0,\r\n"
    "VAR,Recipe_Values,D20000,ARRAY [0..9] OF WORD,[1,2,3(0)],ten, of them\r\n"
    "VAR,Door_Is_Open,D20111.0,BOOL,FALSE\r\n"
    "VAR,Counter,D20112,WORD\r\n"
    "VAR,Placed_By_ISPSoft,,DWORD,0,门\r\n"
)


def merged(users, **changes):
    """A table of the user's with the symbols of a loop."""
    config = configuration(**{"devices": {"SV": "D100", "PID_RUN": "M10"}, **changes})
    return FORMATS["symbols"].merge(encode(config).image, users)


def test_symbols_follow_the_users_which_stay_as_they_are():
    text, report = merged(USERS)

    assert text.startswith(USERS)
    assert (
        text.removeprefix(USERS)
        == written("symbols", configuration(devices={"SV": "D100", "PID_RUN": "M10"})).split("\r\n", 1)[1]
    )
    assert report == (f"created {len(ROWS)}, already there: 0",)
    assert merged(text) == (text, (f"created 0, already there: {len(ROWS)}",))


def test_a_missing_last_line_end_and_lines_of_lf_stay():
    users = USERS.replace("\r\n", "\n").removesuffix("\n")
    text, _ = merged(users)

    assert text.startswith(users + "\nVAR,OVEN_RUN,M10,BOOL,TRUE,")
    assert "\r" not in text


@pytest.mark.parametrize(
    ("row", "renewed"),
    [
        ("VAR,oven_sv,d100,REAL,70.0,mine, not yours", "VAR,oven_sv,d100,REAL,80.0,mine, not yours"),
        ("VAR,OVEN_SV,D100,REAL,,", "VAR,OVEN_SV,D100,REAL,80.0,"),
        ("VAR,OVEN_SV,D100,REAL", "VAR,OVEN_SV,D100,REAL,80.0"),
        ("VAR,OVEN_SV,D100,REAL, 70 , x", "VAR,OVEN_SV,D100,REAL,80.0, x"),
    ],
)
def test_a_symbol_of_the_loop_gets_the_new_initial_value_and_keeps_the_rest(row, renewed):
    text, report = merged(f"{USERS}{row}\r\n")

    assert text.startswith(f"{USERS}{renewed}\r\n")
    assert report[0] == f"created {len(ROWS) - 1}, already there: 1"
    assert report[1].startswith("initial value renewed: OVEN_SV (D100), ")


@pytest.mark.parametrize(
    ("row", "left"),
    [
        ("VAR,Mine,D100,REAL,0,", "OVEN_SV (D100) was not created, since D100 is 'Mine' in line 8"),
        ("VAR,Mine,D101,WORD,0,", "OVEN_SV (D100) was not created, since D101 is 'Mine' in line 8"),
        ("VAR,Mine,D99,DWORD,0,", "OVEN_SV (D100) was not created, since D99 is 'Mine' in line 8"),
        ("VAR,Mine,D98,ARRAY [0..2] OF Recipe,,", "OVEN_SV (D100) was not created, since D98 is 'Mine' in line 8"),
        ("VAR,Mine,D505.3,BOOL,0,", "OVEN_IMV (D500) was not created, since D505.3 is 'Mine' in line 8"),
        ("VAR,Mine,D490,ARRAY [0..10] OF INT,,", "OVEN_IMV (D500) was not created, since D490 is 'Mine' in line 8"),
        ("VAR,Mine,M10,BOOL,FALSE,", "OVEN_RUN (M10) was not created, since M10 is 'Mine' in line 8"),
        ("VAR,OVEN_SV,D104,REAL,0,", "OVEN_SV (D100) was not created, since the symbol is that of D104 in line 8"),
    ],
)
def test_what_something_else_has_is_left_out_and_told(row, left):
    text, report = merged(f"{USERS}{row}\r\n")

    assert text.startswith(f"{USERS}{row}\r\n")
    assert report[1:] == (f"conflict, left as it is: {left}",)


@pytest.mark.parametrize("row", ["VAR,OVEN_SV,D100,REAL,80,", "VAR,OVEN_SV,D100,REAL,8e1,", "VAR,OVEN_RUN,M10,BOOL,1,"])
def test_an_initial_value_that_is_written_otherwise_stays(row):
    text, report = merged(f"{USERS}{row}\r\n")

    assert text.startswith(f"{USERS}{row}\r\n")
    assert report == (f"created {len(ROWS) - 1}, already there: 1",)


@pytest.mark.parametrize(
    "row",
    [
        "VAR,Mine,D98,DWORD,0,",
        "VAR,Mine,D98,ARRAY [3..4] OF Recipe,,",
        "VAR,Mine,D99,Recipe,,",
        "VAR,Mine,D530,WORD,0,",
        "VAR,Mine,D490,ARRAY [0..9] OF INT,,",
    ],
)
def test_a_neighbour_is_no_conflict(row):
    assert merged(f"{USERS}{row}\r\n")[1] == (f"created {len(ROWS)}, already there: 0",)


@pytest.mark.parametrize(
    ("users", "message", "line"),
    [
        ("", "the file is empty", 1),
        ("Class,Name\r\n", "the header of a symbol table is Class,Identifiers,Address", 1),
        (f"{USERS}VAR,Mine,D5\r\n", "3 cells; a row has Class, Identifiers, Address, Type", 8),
        (f"{USERS}VAR,,D5,WORD,0,\r\n", "the row has no symbol in its second cell", 8),
        (f"{USERS}VAR,counter,D5,WORD,0,\r\n", "the symbol counter stands here again, after line 6", 8),
    ],
)
def test_a_bad_table_of_the_users_is_not_added_to(users, message, line):
    with pytest.raises(ListingError, match=message) as refused:
        merged(users)
    assert refused.value.line == line


def test_the_command_adds_to_a_table_and_leaves_the_users_file(tmp_path):
    (tmp_path / "mine.csv").write_bytes(USERS.encode("gbk"))
    config = Path(__file__).parents[1] / "examples" / "dpide" / "oven.yaml"
    arguments = ["encode", str(config), "--format", "symbols", "--into", "mine.csv", "-o", "new.csv"]
    result = run(*arguments, cwd=tmp_path)

    assert result.returncode == 0, result.stderr
    assert (tmp_path / "mine.csv").read_bytes() == USERS.encode("gbk")
    assert (tmp_path / "new.csv").read_bytes().startswith(USERS.encode("gbk") + b"VAR,OVEN_RUN,")


@pytest.mark.parametrize(
    ("changes", "plc", "told"),
    [
        ({}, {}, "OVEN D500 to D529"),
        ({"PID_DIR": True}, {}, "OVEN PID_DIR TRUE, MV rises while PV is below SV (heating)"),
        ({"PID_DIR": False}, {}, "OVEN PID_DIR FALSE, MV rises while PV is above SV (cooling)"),
        ({}, {}, "OVEN PV, MV"),
        ({"MOUT_AUTO": True}, {}, "OVEN PV, MV, MOUT"),
        ({"PID_MODE": 1}, {}, "OVEN PV, MV, PID_MODE, Kc_Kp, Ti_Ki, Td_Kd, Tf"),
        ({}, {}, "every scan of a cyclic task"),
        ({}, {"interrupt_task": 500}, "interrupt task of 500 ms"),
        ({}, {}, "REAL"),
    ],
)
def test_the_checklist_names_what_no_file_does(changes, plc, told):
    assert any(told in item for item in checklist(configuration(plc, **changes)))


def test_operands_with_devices_are_not_on_the_checklist():
    items = checklist(configuration(devices={"PV": "D0", "MV": "D2"}))

    assert not any("since they change" in item for item in items)


def test_the_option_device_takes_one_register_a_loop():
    (option,) = DECODE_OPTIONS

    assert option.read("D500, D530") == ["D500", "D530"]
    assert option.read(option.example) is not None
    assert option.read("M5") is None
    assert option.read("D30000") is None
