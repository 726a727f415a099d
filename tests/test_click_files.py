"""CLICK's own files: nickname CSV, DataView and data dump; pyclickplc writes the same bytes, and reads the same."""

from __future__ import annotations

import json
import random
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import pytest

pytest.importorskip("pyclickplc")
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pyclickplc import modbus_to_plc, plc_to_modbus
from pyclickplc.addresses import make_address_record, normalize_address, parse_address
from pyclickplc.banks import MEMORY_TYPE_TO_DATA_TYPE
from pyclickplc.dataview import (
    _DATA_TYPE_TO_CDV_CODE,
    DataViewFile,
    check_cdv_file,
    datatype_to_storage,
    make_dataview_record,
    read_cdv,
)
from pyclickplc.modbus import modbus_to_plc_register
from pyclickplc.nicknames import CSV_COLUMNS, DATA_TYPE_CODE_TO_STR, read_csv, write_csv
from pyclickplc.plcdata import read_plc_data, write_plc_data
from pyclickplc.validation import validate_comment, validate_nickname

from click_exports import export
from click_strategies import configurations
from command import run
from pidcfg.encoders.click.files import CODES, DATAVIEW_ROWS, FORMATS, Numbering, _view_row, checklist, write_dataviews
from pidcfg.encoders.click.image import encode
from pidcfg.encoders.click.nicknames import HEADER, MAX_LOOP_NAME, NAMED_REGISTERS, nicknames
from pidcfg.encoders.listing import Listing, ListingError, UnwritableError, detect_kind
from pidcfg.encoders.maps.click import ALL_BANKS, SPACE, address_of
from pidcfg.schemas.click import ClickFile
from pidcfg.text.source import read_document

NICKNAMES, DATAVIEW, DUMP = FORMATS["nickname-csv"], FORMATS["cdv"], FORMATS["data-dump"]
HEAD = ",".join(HEADER)
NUMBERING = Numbering()
SLOW = settings(
    max_examples=25, deadline=None, suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much]
)
LOOP = {
    "name": "TANK1",
    "bits": "C101",
    "integers": "DS101",
    "floats": "DF101",
    "action": "reverse",
    "sample_rate": "500 ms",
    "tuning": {"proportional_gain": 2.4, "reset_time": 30, "derivative_gain": 4},
    "pv": {"range": [40, 140], "unit": "degF"},
    "setpoint": {"value": 105},
}
SECOND = {**LOOP, "name": "VAT_2", "bits": "C201", "integers": "DS201", "floats": "DF201", "action": "direct"}
BLOCKS = ("--bits", "C101,C201", "--integers", "DS101,DS201", "--floats", "DF101,DF201")


def image_of(*loops: dict):
    """The image of some loops."""
    return encode(ClickFile.model_validate({"pidcfg": 1, "vendor": "click", "loops": list(loops)})).image


def setting_words(image) -> dict[int, int]:
    """What a file carries: all that a configuration sets."""
    return {c.number: c.raw for c in image.cells if c.access == "setting"}


@pytest.fixture
def image():
    """Two loops."""
    return image_of(LOOP, SECOND)


@pytest.fixture
def dump(tmp_path) -> str:
    """A dump as the PLC's software saves it, with values of the user's."""
    path = tmp_path / "dump.csv"
    data = {
        "X001": True,
        "C1": True,
        "C116": True,
        "C2000": True,
        "DS1": -7,
        "DS101": 26,
        "DD1": 70000,
        "DH1": 0xBEEF,
        "DF1": 1.5,
        "DF113": 98.6,
        "TXT1": "A",
        "TXT2": "<",
    }
    write_plc_data(path, data, banks=["X", "Y", "C", "T", "CT", "DS", "DD", "DH", "DF", "TD", "CTD", "TXT"])
    return path.read_text("ascii")


@pytest.fixture
def folder(tmp_path) -> Path:
    """A folder with a configuration of two loops."""
    text = json.dumps({"pidcfg": 1, "vendor": "click", "loops": [LOOP, SECOND]})
    (tmp_path / "plant.yaml").write_text(text, "utf-8")
    return tmp_path


# --- nickname CSV: writing --------------------------------------------------------------------------------------------


def rows_of(text: str) -> dict[str, str]:
    """The lines of a nickname CSV by address."""
    return {line.split(",")[0]: line for line in text.splitlines()[1:]}


def test_a_nickname_row_reads_as_the_softwares_own(image):
    rows = rows_of(NICKNAMES.write(image, ()))
    assert rows["C110"] == 'C110,BIT,"TANK1_SEL_DirectReverse",1,No,"Forward (direct) or reverse action"'
    assert rows["C210"] == 'C210,BIT,"VAT_2_SEL_DirectReverse",0,No,"Forward (direct) or reverse action"'
    assert rows["DF106"] == 'DF106,FLOAT,"TANK1_P",2.4,Yes,"Proportional gain (P)"'
    assert rows["DF101"] == 'DF101,FLOAT,"TANK1_SP",105,Yes,"Setpoint (SP), degF"'
    assert rows["DS106"] == 'DS106,INT,"TANK1_SampleRate",500,Yes,"Sample rate in ms"'
    assert rows["C111"] == 'C111,BIT,"TANK1_C_Reserved_01",0,No,"Reserved"'
    assert "DS111" not in rows  # called reserved_10 as C111 is, but nobody gave it a nickname


def test_every_setting_has_its_value_and_nothing_else_has_one(image, tmp_path):
    path = tmp_path / "n.csv"
    path.write_text(NICKNAMES.write(image, ()), "utf-8")
    records = {r.display_address: r for r in read_csv(path).values()}
    for cell in image.cells:
        if cell.access == "setting":
            assert (
                SPACE.kind_of(cell.number).read(
                    float(records[cell.address].initial_value)
                    if cell.address.startswith("DF")
                    else int(records[cell.address].initial_value)
                )
                == cell.raw
            )
        elif cell.address in records:
            assert records[cell.address].initial_value == "0", cell


def test_what_the_controller_writes_gets_no_initial_value():
    rows = rows_of(NICKNAMES.write(image_of({**LOOP, "state": {"bias": 12.5, "output": 40}}), ()))
    assert rows["DF105"] == 'DF105,FLOAT,"TANK1_Bias",0,Yes,"Bias, %"'


def test_a_switch_is_commented_with_the_meaning_of_0_first():
    by_field = {row.address: row.comment for row in nicknames(image_of(LOOP))}
    assert by_field["C107"].startswith("Open or closed")
    assert by_field["C108"].startswith("PID or PI")
    assert by_field["C109"].startswith("1 or 2")
    assert by_field["C110"].startswith("Forward")
    assert by_field["C103"].startswith("Linear or squared")
    assert by_field["C113"].startswith("Off or on")


def test_nicknames_are_legal_and_no_suffix_is_the_end_of_another():
    for row in nicknames(image_of(LOOP)):
        assert validate_nickname(row.nickname) == (True, "")
        assert validate_comment(row.comment) == (True, "")
    for row in NAMED_REGISTERS:
        for other in NAMED_REGISTERS:
            assert row == other or row.bank != other.bank or not row.suffix.endswith(other.suffix)


def test_the_longest_loop_name_fits_and_one_more_character_is_refused():
    name = "A" * MAX_LOOP_NAME
    assert max(len(row.nickname) for row in nicknames(image_of({**LOOP, "name": name}))) == 24
    with pytest.raises(UnwritableError, match=r"loop AAAAAAA: the nickname 'AAAAAAA_SEL_AutotunePIDPI' has 25 char"):
        nicknames(image_of({**LOOP, "name": name + "A"}))


@pytest.mark.parametrize("name", ["TIC-1", "T/1", "T.1", "T#1", "Öl"])
def test_a_character_that_a_nickname_may_not_have_is_refused(name):
    with pytest.raises(UnwritableError, match=f"loop {name}: CLICK allows no"):
        NICKNAMES.write(image_of({**LOOP, "name": name}), ())


def test_a_nickname_that_would_begin_like_those_of_the_system_is_refused():
    with pytest.raises(UnwritableError, match=r"loop _T1: the nickname '_T1_\w+' begins with _, which CLICK keeps"):
        NICKNAMES.write(image_of({**LOOP, "name": "_T1"}), ())


def test_names_that_differ_in_case_only_are_refused():
    with pytest.raises(UnwritableError, match="whose case CLICK ignores"):
        NICKNAMES.write(image_of(LOOP, {**SECOND, "name": "tank1"}), ())


def test_a_unit_of_several_lines_or_pages_spoils_no_comment():
    rows = rows_of(NICKNAMES.write(image_of({**LOOP, "pv": {"range": [0, 1], "unit": 'a "b"\n c'}}), ()))
    assert rows["DF101"].endswith(',"Setpoint (SP), a ""b"" c"')
    room = 128 - len("Setpoint (SP), ")  # CLICK takes comments of 128 characters
    for length, comment in ((room, f"Setpoint (SP), {'x' * room}"), (room + 1, "Setpoint (SP)")):
        rows = rows_of(NICKNAMES.write(image_of({**LOOP, "pv": {"range": [0, 1], "unit": "x" * length}}), ()))
        assert rows["DF101"].endswith(f',"{comment}"')


def test_a_unit_comes_back_from_comments_that_are_all_ours():
    text = NICKNAMES.write(image_of(LOOP), ())
    assert NICKNAMES.read(text).settings[0]["pv"] == {"unit": "degF"}
    assert "pv" not in NICKNAMES.read(text.replace('"Setpoint (SP), degF"', '"Setpoint (SP), by hand"')).settings[0]
    assert "pv" not in NICKNAMES.read(text.replace(", degF", "")).settings[0]


# --- nickname CSV: reading --------------------------------------------------------------------------------------------


def test_loops_and_blocks_are_recovered_from_the_nicknames(image):
    found = NICKNAMES.read(NICKNAMES.write(image, ()))
    assert found.settings == (
        {"loop": "TANK1", "bits": "C101", "integers": "DS101", "floats": "DF101", "pv": {"unit": "degF"}},
        {"loop": "VAT_2", "bits": "C201", "integers": "DS201", "floats": "DF201", "pv": {"unit": "degF"}},
    )
    assert setting_words(image).items() <= found.words.items()


def test_nicknames_that_do_not_agree_are_refused(image):
    text = NICKNAMES.write(image, ()).replace('"TANK1_P"', '"swapped"').replace('"TANK1_I"', '"TANK1_P"')
    with pytest.raises(ListingError, match=r"TANK1 do not agree: TANK1_SP at DF101 .* TANK1_P at DF107") as refused:
        NICKNAMES.read(text)
    assert text.splitlines()[refused.value.line - 1].startswith("DF107,")


def test_nicknames_that_leave_no_room_for_the_block_are_refused():
    text = f'{HEAD}\nC5,BIT,"A_SEL_DirectReverse",0,No,""\n'
    with pytest.raises(ListingError, match="A_SEL_DirectReverse at C5 leaves no room"):
        NICKNAMES.read(text)


def test_other_nicknames_with_a_suffix_are_no_loops(image):
    text = (
        NICKNAMES.write(image, ()) + 'DF7,FLOAT,"Pump_P",3,Yes,""\nDF9,FLOAT,"Pump_SP",3,Yes,""\nX001,BIT,"Go",0,No,\n'
    )
    assert [entry["loop"] for entry in NICKNAMES.read(text).settings] == ["TANK1", "VAT_2"]
    assert NICKNAMES.read(text).notes == ()


@pytest.mark.parametrize(
    ("gone", "place"), [("C110,", " at C110"), ("C", "")], ids=["the nickname of the action", "all C nicknames"]
)
def test_a_loop_without_the_nickname_of_its_action_is_told(image, gone, place):
    lines = NICKNAMES.write(image, ()).splitlines(keepends=True)
    kept = [line for line in lines if not (line.startswith(gone) and "TANK1_" in line)]
    assert len(kept) < len(lines)
    found = NICKNAMES.read("".join(kept))
    assert [entry["loop"] for entry in found.settings] == ["VAT_2"]
    (note,) = found.notes
    assert note.startswith("TANK1: ")
    assert f"TANK1_SEL_DirectReverse is missing{place}, so it is not read as one" in note
    assert NICKNAMES.read("".join(lines)).notes == ()


def test_what_the_reader_passed_over_stands_beside_an_error(image, tmp_path):
    lines = NICKNAMES.write(image, ()).splitlines(keepends=True)
    (tmp_path / "n.csv").write_text("".join(line for line in lines if "_SEL_DirectReverse" not in line), "utf-8")
    result = run("decode", "n.csv", "--vendor", "click", cwd=tmp_path)
    assert result.returncode == 2
    told = result.stderr.decode()
    assert "give --bits" in told
    assert "TANK1_SEL_DirectReverse is missing at C110" in told
    assert "VAT_2_SEL_DirectReverse is missing at C210" in told


def test_a_bank_without_known_nicknames_is_asked_for(folder, image):
    text = "".join(line for line in NICKNAMES.write(image, ()).splitlines(keepends=True) if not line.startswith("DF"))
    (folder / "n.csv").write_text(text, "utf-8")
    result = run("decode", "n.csv", "--vendor", "click", "--pwm-bit", "none", cwd=folder)
    assert result.returncode == 2
    assert "does not say where the DF registers begin of TANK1; give --floats" in result.stderr.decode()


HOSTILE_ROWS = {
    # row                                         what the message says
    'Z9,BIT,"a",0,No,""': "'Z9' is not an address of CLICK",
    'DF501,FLOAT,"a",0,No,""': "'DF501' is not an address of CLICK",
    ',BIT,"a",0,No,""': "'' is not an address of CLICK",
    'DF1,FLOAT,"a",NaN,No,""': "initial value 'NaN' is not a finite",
    'DF1,FLOAT,"a",1e999,No,""': "initial value '1e999' is not a finite",
    'DF1,FLOAT,"a",4e38,No,""': "initial value '4e38' is not a finite",
    'DF1,FLOAT,"a",-inf,No,""': "initial value '-inf'",
    'DF1,FLOAT,"a",1_0,No,""': "initial value '1_0'",
    'DS1,INT,"a",40000,No,""': "initial value '40000' is not an integer of -32768 to 32767",
    'DS1,INT,"a",1.5,No,""': "initial value '1.5' is not an integer",
    'C1,BIT,"a",2,No,""': "initial value '2' is not true or false",
    'C1,INT,"a",0,No,""': "C1 is of type BIT, but the file says 'INT'",
    'DS1,WORD,"a",0,No,""': "DS1 is of type INT, but the file says 'WORD'",
    'DS1,INT,"a",0,Maybe,""': "'Maybe' stands where Yes or No is wanted",
    'DS1,INT,"a",0,No': "5 cells stand under a header of 6 columns",
    'DS1,INT,"a",0,No,"",1': "7 cells stand under a header of 6 columns",
    'DS1,INT,"a,0,No,""': "not CSV",
    'DS1,INT,"a"b,0,No,""': "not CSV",
    "DS1,INT,a,0,No,\0": "a NUL character",
    "DS1,INT,a,0,No,\ud800": "a character that is not Unicode",
}


@pytest.mark.parametrize("row", HOSTILE_ROWS)
def test_a_bad_row_is_refused_with_its_line(row):
    with pytest.raises(ListingError) as refused:
        NICKNAMES.read(f'{HEAD}\nC7,BIT,"ok",1,No,"two\nlines"\n{row}\n')
    assert HOSTILE_ROWS[row] in str(refused.value)
    assert refused.value.line == 4


def test_duplicates_are_refused_with_both_lines():
    row = 'DF1,FLOAT,"a",1,Yes,""\n'
    with pytest.raises(ListingError, match="DF1 stands here again, after line 2"):
        NICKNAMES.read(f"{HEAD}\n{row}{row}")
    with pytest.raises(ListingError, match="DF1 stands here again"):
        NICKNAMES.read(f'{HEAD}\n{row}df01,FLOAT,"b",2,Yes,""\n')
    with pytest.raises(ListingError, match="the nickname 'A' of DF2 is that of DF1 in line 2 too"):
        NICKNAMES.read(f'{HEAD}\n{row}DF2,FLOAT,"A",2,Yes,""\n')


def test_the_systems_own_nicknames_may_be_there_twice():
    text = f'{HEAD}\nSC1,BIT,"_Always_ON",0,No,""\nSC2,BIT,"_Always_ON",0,No,""\nDF1,FLOAT,"a",1,Yes,""\n'
    assert NICKNAMES.read(text).words == {SPACE.parse("DF1"): 0x3F800000}


@pytest.mark.parametrize("text", ["", "\n\n", "Address,Nickname\nDF1,a\n", "\ufeff", "x" * 10_000_000, '"', "a,b\0"])
def test_what_is_no_nickname_csv_is_refused(text):
    with pytest.raises(ListingError):
        NICKNAMES.read(text)


def test_a_line_of_ten_megabytes_is_refused():
    with pytest.raises(ListingError, match="not CSV: field larger than field limit"):
        NICKNAMES.read(f'{HEAD}\nDF1,FLOAT,"a",1,Yes,"{"x" * 10_000_000}"\n')


def test_a_byte_order_mark_loses_nothing(image, tmp_path):
    """pyclickplc alone reads nothing from such a file."""
    text = NICKNAMES.write(image, ())
    path = tmp_path / "marked.csv"
    path.write_text("\ufeff" + text, "utf-8")
    assert len(read_csv(path)) == 0
    assert NICKNAMES.read("\ufeff" + text).words == NICKNAMES.read(text).words != {}


def test_mutilated_nickname_lists_are_read_or_refused_but_never_crash(image):
    text, chance = NICKNAMES.write(image, ()), random.Random(7)
    for _ in range(40):
        at, length = chance.randrange(len(text)), chance.randrange(1, 30)
        rubbish = "".join(chance.choice('",\n\r0;=\ufeffÄ\x1c\u2028') for _ in range(length))
        with suppress(ListingError):
            NICKNAMES.read(text[:at] + rubbish + text[at + length :])


# --- nickname CSV: into a file of the user's --------------------------------------------------------------------------

USERS = (
    "Address,Data Type,Nickname,Initial Value,Retentive,Address Comment\r\n"
    'X001,BIT,"Start ""now""",0,No,"two\r\nlines, and a comma"\r\n'
    'DF1,FLOAT,"Speed",1.50,Yes,""\r\n'
)


def test_new_rows_follow_the_users_which_stay_as_they_are(image):
    merged, report = NICKNAMES.merge(image, USERS)
    assert merged.startswith(USERS)
    added = merged.removeprefix(USERS)
    assert added == NICKNAMES.write(image, ()).split("\n", 1)[1].replace("\n", "\r\n")
    assert report == (f"created {len(added.splitlines())}, already there: 0",)


def test_a_byte_order_mark_and_a_missing_last_line_end_stay():
    users = "\ufeff" + USERS.replace("\r\n", "\n").removesuffix("\n")
    merged, _ = NICKNAMES.merge(image_of(LOOP), users)
    assert merged.startswith(users + "\nC101,BIT,")
    assert "\r" not in merged


def test_the_second_time_nothing_is_created(image):
    once, _ = NICKNAMES.merge(image, USERS)
    twice, report = NICKNAMES.merge(image, once)
    assert twice == once
    assert report == (f"created 0, already there: {len(nicknames(image))}",)


def test_a_row_of_the_loop_gets_the_new_initial_value_and_keeps_the_rest():
    users = f'{HEAD}\nDF106,FLOAT,"tank1_p",2,No,"my, own"\nDF105,FLOAT,"TANK1_Bias",33,Yes,""\n'
    merged, report = NICKNAMES.merge(image_of(LOOP), users)
    assert merged.splitlines()[1:3] == ['DF106,FLOAT,"tank1_p",2.4,No,"my, own"', 'DF105,FLOAT,"TANK1_Bias",33,Yes,""']
    assert report[1:] == ("initial value renewed: TANK1_P (DF106), 2 to 2.4",)
    assert "already there: 2" in report[0]


def test_rows_of_others_are_never_touched_but_told():
    users = f'{HEAD}\nDF106,FLOAT,"Speed",7,Yes,""\nDF7,FLOAT,"TANK1_I",8,Yes,""\nDF102,FLOAT,"",5,Yes,"mine"\n'
    merged, report = NICKNAMES.merge(image_of(LOOP), users)
    assert merged.startswith(users)
    for address in ("DF106", "DF107", "DF102"):
        assert f"\n{address}," not in merged.removeprefix(users)
    assert report[1:] == (
        "conflict, left as it is: TANK1_SP_LimitLower (DF102) was not created, since DF102 has no nickname there",
        "conflict, left as it is: TANK1_P (DF106) was not created, since DF106 is 'Speed'",
        "conflict, left as it is: TANK1_I (DF107) was not created, since the nickname is that of DF7",
    )


def test_a_bad_file_of_the_users_is_not_added_to(folder):
    (folder / "mine.csv").write_text(f"{HEAD}\nDF1,FLOAT,a,nan,Yes,\n", "utf-8")
    result = run("encode", "plant.yaml", "--format", "nickname-csv", "--into", "mine.csv", "-o", "new.csv", cwd=folder)
    assert result.returncode == 2
    assert "mine.csv:2:1: DF1: the initial value 'nan'" in result.stderr.decode()
    assert not (folder / "new.csv").exists()


@pytest.mark.parametrize("content", [USERS.encode("utf-16"), USERS.replace("now", "für").encode("latin-1")])
def test_a_file_in_another_encoding_is_refused(folder, content):
    (folder / "mine.csv").write_bytes(content)
    result = run("encode", "plant.yaml", "--format", "nickname-csv", "--into", "mine.csv", "-o", "new.csv", cwd=folder)
    assert result.returncode == 2
    assert "is not UTF-8; save the file as UTF-8" in result.stderr.decode()


def test_a_file_over_the_limit_is_refused_and_not_cut(folder):
    (folder / "mine.csv").write_bytes((USERS + USERS.split("\r\n", 1)[1] * 20).encode())
    result = run(
        "encode",
        "plant.yaml",
        "--format",
        "nickname-csv",
        "--into",
        "mine.csv",
        "-o",
        "new.csv",
        "--limit",
        "file_bytes=300",
        cwd=folder,
    )
    assert result.returncode == 2
    assert "mine.csv is larger than 900 bytes" in result.stderr.decode()
    assert not (folder / "new.csv").exists()


# --- nickname CSV with the columns of Modbus --------------------------------------------------------------------------

WITH_MODBUS = "Address,Data Type,Modbus Address,Function Code,Nickname,Initial Value,Retentive,Address Comment"


def modbus_row(address: str, rest: str, style: str) -> str:
    """A row as CLICK exports it: hexadecimal or with the number that people count by."""
    kind = {"C": "BIT", "DS": "INT", "DF": "FLOAT"}[address.rstrip("0123456789")]
    place = NUMBERING.place(SPACE.parse(address))
    first = {"coil": 1, "holding": 400_001}[place.table]
    register = f"{place.register:04X}h" if style == "hex" else str(first + place.register)
    codes = {"coil": "FC=01,05,15", "holding": "FC=03,06,16"}[place.table]
    return f'{address},{kind},{register},"{codes}",{rest}'


@pytest.mark.parametrize("style", ["hex", "984"])
def test_the_columns_of_modbus_are_read_and_kept(image, style):
    """The addresses are facts of CLICK's help: C1 is 4000h and 16385, DS1 0000h and 400001, DF1 7000h and 428673."""
    rows = [
        modbus_row("C1", '"Start",1,No,"by, hand"', style),
        modbus_row("DS1", '"Count",7,Yes,""', style),
        modbus_row("DF1", '"Speed",1.50,Yes,"a ""b"""', style),
        modbus_row("DF106", '"tank1_p",2,No,"my, own"', style),
    ]
    first = {"hex": ("4000h", "0000h", "7000h"), "984": ("16385", "400001", "428673")}[style]
    assert tuple(row.split(",")[2] for row in rows[:3]) == first
    users = "".join(f"{line}\r\n" for line in (WITH_MODBUS, *rows))
    assert NICKNAMES.looks_like(users)
    assert NICKNAMES.read(users).words[SPACE.parse("DF1")] == 0x3FC00000
    merged, report = NICKNAMES.merge(image, users)
    lines = merged.split("\r\n")
    assert lines[:4] == users.split("\r\n")[:4]
    assert lines[4] == modbus_row("DF106", '"tank1_p",2.4,No,"my, own"', style)
    assert report[1:] == ("initial value renewed: TANK1_P (DF106), 2 to 2.4",)
    plain = {line.split(",")[0]: line for line in NICKNAMES.write(image, ()).splitlines()[1:]}
    for line in lines[5:-1]:
        address = line.split(",")[0]
        assert line == modbus_row(address, plain[address].split(",", 2)[2], style)
    read = NICKNAMES.read(merged)
    assert read.settings == NICKNAMES.read(NICKNAMES.write(image, ())).settings
    assert setting_words(image).items() <= read.words.items()
    assert NICKNAMES.merge(image, merged)[0] == merged


@pytest.mark.parametrize("head", [HEAD, WITH_MODBUS])
def test_rows_of_an_export_of_all_addresses_that_nobody_uses_become_the_loops(image, head):
    """Such an export has a row for every address, most of them without a nickname."""
    modbus = head == WITH_MODBUS
    rows = [
        modbus_row(f"DF{n}", '"",0,Yes,""', "hex") if modbus else f'DF{n},FLOAT,"",0,Yes,""' for n in range(95, 135)
    ]
    users = "".join(f"{line}\n" for line in (head, *rows))
    merged, report = NICKNAMES.merge(image, users)
    assert report == (f"created {len(nicknames(image))}, already there: 0",)
    found = merged.splitlines()
    assert found[:7] == users.splitlines()[:7]
    assert found[7].startswith("DF101,FLOAT,")
    assert '"TANK1_SP",105' in found[7]
    assert found[1 : len(rows) + 1] != rows
    assert [line.split(",")[0] for line in found[1 : len(rows) + 1]] == [line.split(",")[0] for line in rows]


def test_a_modbus_address_that_is_another_registers_is_refused_before_rows_are_added(image):
    users = f'{WITH_MODBUS}\nDF7,FLOAT,700Ch,"FC=03,06,16","a",1,Yes,""\nDF8,FLOAT,700Ch,"FC=03,06,16","b",1,Yes,""\n'
    with pytest.raises(ListingError, match="DF8 has the Modbus Address 700Eh, but the file says '700Ch'") as refused:
        NICKNAMES.merge(image, users)
    assert refused.value.line == 3


# --- nickname CSV: rows that no loop can touch ------------------------------------------------------------------------

FOREIGN = (
    'X001,BIT,100001,"FC=02","",0,No,""',
    'X002,BIT,100002,"FC=02","Start",0,No,"two\r\nlines"',
    'Y001,INT,8193,"FC=01,05,15","",0,Maybe,""',
    'T1,BIT,145057,"FC=02","start",0,No,""',
    'SC1,BIT,161441,"FC=02","_Always_ON",0,No,""',
    'SC2,BIT,161442,"FC=02","_Always_ON",0,No,""',
    'SD1,FLOAT,361441,"FC=03,06,16","PLC_Error_Code",0,Yes,""',
    'SD1,INT,361441,"FC=04","",7,No,""',
    ',HEX,357348,"FC=04","",0,No,""',
    ',HEX,E003h,"FC=04","",0,No,""',
    'TXT1,TEXT,436865,"FC=03,06,16","",,Yes,""',
    'DD1,INT2,416385,"FC=03,06,16","Total",many,Yes,""',
)
"""Rows of exports and tag lists that are no loop's, as CLICK writes them and otherwise."""


@given(foreign=st.lists(st.sampled_from(FOREIGN), max_size=30), chance=st.randoms())
@SLOW
def test_rows_that_no_loop_touches_change_nothing_and_stay_in_place(foreign, chance):
    """Any of them, as often as one likes, in any order between the rows of two loops."""
    image = image_of(LOOP, SECOND)
    own = [
        modbus_row(line.split(",")[0], line.split(",", 2)[2], "984")
        for line in rows_of(NICKNAMES.write(image, ())).values()
    ]
    mixed = [*own, *foreign]
    chance.shuffle(mixed)
    users = "".join(f"{line}\r\n" for line in (WITH_MODBUS, *mixed))
    bare = "".join(f"{line}\r\n" for line in (WITH_MODBUS, *(line for line in mixed if line not in FOREIGN)))
    read, wanted = NICKNAMES.read(users), NICKNAMES.read(bare)
    assert (read.words, read.settings) == (wanted.words, wanted.settings)
    assert len(read.notes) <= 1
    changed = image_of({**LOOP, "tuning": {**LOOP["tuning"], "proportional_gain": 3}}, SECOND)
    merged, report = NICKNAMES.merge(changed, users)
    assert merged == users.replace('"TANK1_P",2.4,', '"TANK1_P",3,')
    assert report[-len(read.notes) or len(report) :] == read.notes
    few = "".join(f"{line}\r\n" for line in (WITH_MODBUS, *foreign))
    assert NICKNAMES.merge(image, few)[0].startswith(few)


@pytest.mark.parametrize("system", ["SC1,BIT", "SD1,INT"])
@pytest.mark.parametrize("first", [True, False])
def test_a_nickname_of_the_system_that_is_a_loops_too_hides_no_row_of_the_loop(first, system):
    image = image_of(LOOP)
    head, *own = NICKNAMES.write(image, ()).splitlines(keepends=True)
    for row in own[::30]:
        name = row.split(",")[2]
        rows = [f'{system},{name},0,No,""\n', *own] if first else [*own, f'{system},{name},0,No,""\n']
        merged, report = NICKNAMES.merge(image, "".join((head, *rows)))
        assert (merged, report[0]) == ("".join((head, *rows)), f"created 0, already there: {len(own)}")


def test_what_is_odd_about_rows_of_others_is_told_in_their_order_and_what_has_no_address_first():
    rows = (
        'Y001,INT,"Start",0,Maybe,""',
        'X002,BIT,"start",0,No,""',
        ',HEX,"",0,No,""',
        'SC1,BIT,"_Always_ON",0,No,""',
        'SC2,BIT,"_Always_ON",0,No,""',
        'X002,BIT,"",0,No,""',
        ',HEX,"",0,No,""',
    )
    odd = "Y001 is of type BIT, but the file says 'INT', X002 has the nickname of Y001, X002 stands here again"
    note = f"rows that no loop uses are left as they are: 2 without an address (lines 4 to 8), {odd} (D990)"
    assert NICKNAMES.read("\n".join((HEAD, *rows))).notes[0] == note


@pytest.mark.parametrize("empty", ["", ",,,,,", '"","","","","",""'])
def test_lines_without_anything_stay_where_they_are(empty):
    image = image_of(LOOP)
    head, *own = NICKNAMES.write(image, ()).splitlines()
    users = "".join(f"{line}\n" for line in (head, *own[:3], empty, *own[3:], empty, empty))
    assert NICKNAMES.merge(image, users) == (users, (f"created 0, already there: {len(own)}",))


@pytest.mark.parametrize(("action", "renewed"), [("direct", False), ("reverse", True)])
def test_an_initial_value_that_is_missing_is_0(action, renewed):
    image = image_of({**LOOP, "action": action})
    users = NICKNAMES.write(image, ()).replace(f'DirectReverse",{int(renewed)},', 'DirectReverse",,')
    merged, report = NICKNAMES.merge(image, users)
    assert (merged != users) == renewed
    assert [line for line in report if "renewed" in line] == (
        ["initial value renewed: TANK1_SEL_DirectReverse (C110), 0 to 1"] if renewed else []
    )


def test_only_rows_with_an_initial_value_say_what_a_register_holds():
    rows = (
        'DS1,INT,"a",5,Yes,""',
        'DS2,INT,"b",,Yes,""',
        'DF1,FLOAT,"c",0,Yes,""',
        'C1,BIT,"d",,No,""',
        'DH1,HEX,"e",7,No,""',
    )
    listing = NICKNAMES.read("\n".join((HEAD, *rows)))
    assert {SPACE.name(number): raw for number, raw in listing.words.items()} == {"DS1": 5, "DF1": 0}
    assert listing.lines == {SPACE.parse("DS1"): 2, SPACE.parse("DF1"): 4}


def test_a_nickname_is_a_loops_in_its_own_bank_and_behind_a_name():
    """DF alone has a gain (_P), C alone an action."""
    rows = ('C50,BIT,"L_SEL_DirectReverse",1,No,""', 'DS50,INT,"L_P",1,Yes,""', 'DF50,FLOAT,"_P",1,Yes,""')
    others = ('C60,BIT,"_SEL_DirectReverse",1,No,""', 'DS60,INT,"M_SEL_DirectReverse",1,No,""')
    assert NICKNAMES.read("\n".join((HEAD, *rows, *others))).settings == ({"loop": "L", "bits": "C41"},)


@pytest.mark.parametrize("count", [2, 3, 4])
def test_three_nicknames_that_agree_are_taken_for_those_of_a_loop_without_its_action(count):
    rows = [line for line in NICKNAMES.write(image_of(LOOP), ()).splitlines() if line.startswith("DF")]
    (note,) = NICKNAMES.read("\n".join((HEAD, *rows[:count]))).notes
    assert note.startswith(
        f"TANK1: {count} nicknames are those of a loop" if count > 2 else "no nickname of the list is"
    )


@pytest.mark.parametrize(("count", "lines"), [(1, "line 2"), (2, "lines 2 to 3"), (3, "lines 2 to 4")])
def test_rows_without_an_address_are_told_by_their_lines(count, lines):
    text = "\r\n".join((WITH_MODBUS, *[',HEX,E003h,"FC=04","",0,No,""'] * count, ""))
    note = f"rows that no loop uses are left as they are: {count} without an address ({lines}) (D990)"
    assert NICKNAMES.read(text).notes[0] == note


@pytest.mark.parametrize("style", ["hex", "984"])
def test_an_export_of_all_addresses_is_read_and_added_to(image, style):
    text = export(style)
    lines = text.splitlines(keepends=True)
    assert len(lines) == 13_357
    assert sum(line.startswith(",") for line in lines) == 16
    note = "rows that no loop uses are left as they are: 16 without an address (lines 10575 to 10607) (D990)"
    read = NICKNAMES.read(text)
    assert len(read.words) == 2000 + 4500 + 500
    assert read.settings == ()
    assert read.notes[0] == note
    assert "no nickname of the list is <loop>_SEL_DirectReverse" in read.notes[1]
    merged, report = NICKNAMES.merge(image, text)
    assert report == (f"created {len(nicknames(image))}, already there: 0", note)
    ours = {row.address for row in nicknames(image)}
    kept = merged.splitlines(keepends=True)
    assert [new for old, new in zip(lines, kept, strict=True) if old.split(",")[0] not in ours] == [
        old for old in lines if old.split(",")[0] not in ours
    ]
    again = NICKNAMES.read(merged)
    assert again.notes == (note,)
    assert [entry["loop"] for entry in again.settings] == ["TANK1", "VAT_2"]
    assert setting_words(image).items() <= again.words.items()


def test_a_tag_list_with_a_type_that_click_does_not_give_is_read(folder, image):
    rows = [FOREIGN[6], modbus_row("DF1", '"TI_101",0,Yes,""', "984")]
    users = "".join(f"{line}\n" for line in (WITH_MODBUS, *rows))
    (folder / "tags.csv").write_text(NICKNAMES.merge(image, users)[0], "utf-8")
    result = run("decode", "tags.csv", "--vendor", "click", "--pwm-bit", "none,none", cwd=folder)
    assert result.returncode == 0
    told = result.stderr.decode()
    assert told.count("D990") == 1
    assert "SD1 is of type INT, but the file says 'FLOAT'" in told


def test_a_nickname_without_an_address_and_one_of_a_loops_bank_twice_stay_refused():
    for row, message in (
        (',HEX,357348,"FC=04","lost",0,No,""', "'' is not an address of CLICK"),
        ('X003,BIT,100003,"FC=02","speed",0,No,""', "the nickname 'speed' of X003 is that of DF1 in line 2 too"),
    ):
        text = "".join(f"{line}\n" for line in (WITH_MODBUS, modbus_row("DF1", '"Speed",0,Yes,""', "984"), row))
        with pytest.raises(ListingError) as refused:
            NICKNAMES.read(text)
        assert message in str(refused.value)
        assert refused.value.line == 3


def test_a_header_counts_whatever_its_letters(image):
    text = NICKNAMES.write(image, ())
    lower = text.replace(HEAD, HEAD.lower())
    assert NICKNAMES.looks_like(lower)
    assert NICKNAMES.read(lower).words == NICKNAMES.read(text).words != {}


def test_another_header_is_refused_and_says_what_it_is():
    with pytest.raises(ListingError, match="Modbus Address and Function Code behind Data Type or without"):
        NICKNAMES.read(f'{WITH_MODBUS.replace("Function Code,", "")}\nC1,BIT,4000h,"a",0,No,""\n')


# --- DataView ---------------------------------------------------------------------------------------------------------


def test_one_dataview_a_loop_with_new_values_for_settings_only(image, tmp_path):
    views = DATAVIEW.write(image, ())
    assert list(views) == ["TANK1", "VAT_2"]
    path = tmp_path / "view.cdv"
    path.write_bytes(views["TANK1"].encode(DATAVIEW.encoding))
    assert check_cdv_file(path) == []
    rows = {row.address: row.new_value for row in read_cdv(path).rows if row.address}
    cells = [c for c in image.cells if c.loop == "TANK1"]
    assert list(rows) == [c.address for c in cells if c.access != "reserved"]
    assert {a for a, value in rows.items() if value is not None} == {c.address for c in cells if c.access == "setting"}
    assert rows["C110"] is True
    assert rows["C117"] is rows["DF113"] is rows["DS101"] is None
    assert rows["DS106"] == 500


def test_a_dataview_is_utf_16_with_a_mark_and_crlf(image):
    content = DATAVIEW.write(image, ())["VAT_2"].encode(DATAVIEW.encoding)
    assert content.startswith(b"\xff\xfe-\0001\000,\0000\000,\0000\000\r\000\n\000C\000")
    text = content.decode("utf-16")
    assert text.count("\n") == text.count("\r\n") == DATAVIEW_ROWS + 1
    assert "\r\nDF206,257,1075419546\r\n" in text  # 2.4 is 0x4019999A


def test_a_single_loop_has_a_single_file_without_its_name():
    assert list(write_dataviews(image_of(LOOP))) == [""]


def test_loop_names_become_file_names_that_stay_in_their_folder(folder):
    loops = [{**LOOP, "name": "A/B.1"}, {**SECOND, "name": "CON"}]
    assert list(write_dataviews(image_of(*loops))) == ["A_B_1", "CON"]
    assert list(write_dataviews(image_of({**LOOP, "name": "A/B"}, {**SECOND, "name": "a b"}))) == ["1-A_B", "2-a_b"]
    (folder / "plant.yaml").write_text(json.dumps({"pidcfg": 1, "vendor": "click", "loops": loops}), "utf-8")
    result = run("encode", "plant.yaml", "--format", "cdv", "-o", "view.cdv", cwd=folder)
    assert result.returncode == 0, result.stderr
    assert sorted(path.name for path in folder.glob("*.cdv")) == ["view-A_B_1.cdv", "view-CON.cdv"]


def test_dataviews_are_not_for_a_terminal(folder):
    result = run("encode", "plant.yaml", "--format", "cdv", cwd=folder)
    assert (result.returncode, result.stdout) == (2, b"")
    assert b"name its file with -o" in result.stderr


def test_a_loop_of_more_than_a_hundred_rows_is_split():
    """Two loops of one name, as only --allow-errors lets through, are 106 rows."""
    views = write_dataviews(image_of(LOOP, {**SECOND, "name": "TANK1"}))
    assert list(views) == ["TANK1", "TANK1-2"]
    words = {}
    for text in views.values():
        words |= DATAVIEW.read(text).words
    assert words == setting_words(image_of(LOOP, SECOND))


def test_new_values_are_read_back(image):
    words = {}
    for text in DATAVIEW.write(image, ()).values():
        words |= DATAVIEW.read(text).words
    assert words == setting_words(image)


def test_the_type_codes_are_those_of_the_package():
    assert {DATA_TYPE_CODE_TO_STR[kind]: code for kind, code in _DATA_TYPE_TO_CDV_CODE.items()} == CODES
    assert list(HEADER) == CSV_COLUMNS


@pytest.mark.parametrize("raw", [0, 1, 0x7FFF, 0x8000, 0xFFFF])
def test_negative_integers_have_their_sign_in_32_bits(raw, image):
    cell = replace(next(cell for cell in image.cells if cell.address == "DS106"), raw=raw)
    record = make_dataview_record("DS106", new_value=cell.value)
    assert _view_row(cell) == f"DS106,0,{datatype_to_storage(record.new_value, record.data_type)}"
    assert DATAVIEW.read(f"-1,0,0\r\n{_view_row(cell)}\r\n").words == {cell.number: raw}


HOSTILE_VIEWS = {
    "DF1,257,2143289344": "the new value 2143289344 is not a finite",  # NaN
    "DF1,257,2139095040": "the new value 2139095040 is not a finite",  # infinity
    "DF1,257,4294967296": "the new value 4294967296 is not a finite",
    "DF1,257,1.5": "is not a row of a DataView",
    "DF1,257,-1": "is not a row of a DataView",
    "DS1,0,70000": "the new value 70000 is not an integer",
    "DS1,0,4294934527": "the new value 4294934527 is not an integer",
    "C1,768,2": "the new value 2 is not true or false",
    "C1,0,1": "C1 has the type 768, but the row says 0",
    "DF1,999,1": "DF1 has the type 257, but the row says 999",
    "DF999,257,1": "DF999 is not an address of CLICK",
    "Q1,257,1": "Q1 is not an address of CLICK",
    "DF01,257,1": "DF01 is not an address of CLICK",
    "df1,257,1": "is not a row of a DataView",
    "DF1": "is not a row of a DataView",
    "DF1,257,1,1": "is not a row of a DataView",
    "DF1,257,1\x0bDF2,257,1": "is not a row of a DataView",
    "DF1,257,\0": "is not a row of a DataView",
    "DF1,257,\ud800": "is not a row of a DataView",
    "DF1,257,\u0661": "is not a row of a DataView",
    "DF9,257,1": "DF9 stands here again",
}


@pytest.mark.parametrize("row", HOSTILE_VIEWS)
def test_a_bad_dataview_row_is_refused_with_its_line(row):
    with pytest.raises(ListingError) as refused:
        DATAVIEW.read(f"-1,0,0\r\nDF9,257,0\r\n{row}\r\n,0\r\n")
    assert HOSTILE_VIEWS[row] in str(refused.value)
    assert refused.value.line == 3


def test_rows_beyond_the_hundredth_are_refused_not_dropped(tmp_path):
    lines = ["-1,0,0", *(f"DF{n},257,0" for n in range(1, 102))]
    path = tmp_path / "long.cdv"
    path.write_bytes(("\ufeff" + "\r\n".join(lines)).encode("utf-16-le"))
    assert len([row for row in DataViewFile.load(path).rows if row.address]) == DATAVIEW_ROWS
    with pytest.raises(ListingError, match="at most 100 rows; the address DF101 is beyond") as refused:
        DATAVIEW.read("\r\n".join(lines))
    assert refused.value.line == 102
    assert len(DATAVIEW.read("\r\n".join(lines[:-1])).words) == DATAVIEW_ROWS


def test_a_header_that_denies_its_new_values_is_refused():
    with pytest.raises(ListingError, match="says that no row has a new value"):
        DATAVIEW.read("0,0,0\r\nDF1,257,1\r\n")
    assert DATAVIEW.read("0,0,0\r\nDF1,257\r\n").words == {}


@pytest.mark.parametrize(
    "text", ["", "\ufeff", "\r\n", "hello", "-1,0", "-1,0,0,0", "\0", "-1;0;0\n", "x" * 10_000_000]
)
def test_what_is_no_dataview_is_refused(text):
    with pytest.raises(ListingError, match="this is no DataView"):
        DATAVIEW.read(text)


def test_other_banks_may_be_watched_and_are_left_out():
    text = "-1,0,0\nX001,768\nTXT1,1024,65\nDD1,256,5\nXD0u,3\n\n,0\nDF1,257,1065353216\n"
    assert DATAVIEW.read(text).words == {SPACE.parse("DF1"): 0x3F800000}


# --- data dump --------------------------------------------------------------------------------------------------------


def test_only_cells_of_settings_and_requests_change(image, dump):
    merged, report = DUMP.merge(image, dump)
    before, after = DUMP.read(dump).words, DUMP.read(merged).words
    requests = {c.number for c in image.cells if c.access == "request"}
    assert after == before | setting_words(image) | dict.fromkeys(requests, 0)
    assert before[SPACE.parse("C116")] == 1  # a request caught in the dump
    assert after[SPACE.parse("C116")] == 0
    assert after[SPACE.parse("DF113")] == before[SPACE.parse("DF113")] != 0  # the PV that the PLC wrote
    changed = sum(before[n] != after[n] for n in before)
    assert report == (f"{len(setting_words(image)) + len(requests)} values are in the dump, {changed} of them changed",)


def test_the_rest_of_the_dump_stays_byte_for_byte(image, dump):
    users = dump.replace("\n", "\r\n").replace("DF1,1.50000000", "DF1, 1.5")
    merged, _ = DUMP.merge(image, users)
    theirs, ours = users.split("\r\n"), merged.split("\r\n")
    assert len(theirs) == len(ours)
    differ = [a.split(",")[0] for a, b in zip(theirs, ours, strict=True) if a != b]
    assert set(differ) <= {f"{bank}{n}" for bank in ("C", "DS", "DF") for n in (101, 111, 121, 201, 211, 221)}
    assert "DF1, 1.5,0.00000000" in merged


def test_pyclickplc_reads_the_merged_dump(image, dump, tmp_path):
    path = tmp_path / "merged.csv"
    path.write_text(DUMP.merge(image, dump)[0], "ascii")
    found = read_plc_data(path)
    assert (found["DF106"], found["C110"], found["DS106"], found["DD1"]) == (2.4, True, 500, 70000)


def test_the_second_time_nothing_changes(image, dump):
    once, _ = DUMP.merge(image, dump)
    twice, report = DUMP.merge(image, once)
    assert twice == once
    assert report[0].endswith(" 0 of them changed")


def test_a_value_that_eight_decimals_do_not_hold_is_refused(dump):
    loop = {**LOOP, "error": {"deadband": 0.00000012345}}
    with pytest.raises(UnwritableError, match=r"DF104 = 1.2345e-07 does not fit into a data dump \(eight decimals\)"):
        DUMP.merge(image_of(loop), dump)


def test_a_dump_of_our_own_is_refused(folder, image):
    result = run("encode", "plant.yaml", "--format", "data-dump", "-o", "dump.csv", cwd=folder)
    assert result.returncode == 2
    assert b"written into a file of yours; name it with --into" in result.stderr
    with pytest.raises(UnwritableError):
        DUMP.write(image, ())


def test_a_dump_without_our_cells_is_refused(image, dump):
    begin, end = dump.index("<DF=START>"), dump.index("</DF=END>")
    with pytest.raises(ListingError, match="the dump does not hold DF101; read all data from the PLC"):
        DUMP.merge(image, dump[:begin] + dump[end + len("</DF=END>") :])


HOSTILE_DUMPS = {
    # replaced                    by                        what the message says
    "\nDS41,": ("\n\x85DS41,", "'DS41' is not an address of DS"),
    "\nDS51,": ("\nDS51\xa0,", "'DS51' is not an address of DS"),
    "DF1,1.50000000": ("DF1,nan", "DF1: 'nan' is not a finite"),
    "DF1,1.5": ("DF1,1e9990", "DF1: '1e99900000000' is not a finite"),
    "DF11,0.00000000": ("DF11,inf", "DF11: 'inf' is not a finite"),
    "DF21,0.0": ("DF11,0.0", "DF11 stands here again"),
    "DF31,0.00000000": ("DF31,", "DF31: '' is not a finite"),
    "DF491,0.0": ("DF492,0.0", "DF501 does not exist"),
    "DS1,-7": ("DS1,40000", "DS1: '40000' is not an integer"),
    "DS11,0": ("DS11,0x1", "DS11: '0x1' is not an integer"),
    "DS21,0": ("C2,0", "'C2' is not an address of DS"),
    "DS31,0": ("DS31,0,0", "11 values stand under a header of 10"),
    "DS41,0": ("DS41,1_0", "DS41: '1_0' is not an integer"),
    "C1,1": ("C1,2", "C1: '2' is not true or false"),
    "C11,0": ("C11,\u0661", "C11: '\u0661' is not true or false"),
    "</DS=END>": ("</DD=END>", "the section DD ends here, but DS is open"),
    "<DF=START>": ("<DS=START>", "the section DS stands here again"),
    "</C=END>": ("", "the section T begins inside C"),
    "<DS=START>\nAddress,1,2": ("<DS=START>\nAddress,2,1", "the header of a section is Address,1,2,3"),
    "<DS=START>\n": ("<DS=START>\nDS4491,0,\n", "1 value stands under a header of 0"),
    "<C=START>\n": ("<C=START>\nC1991,0,1,\n", "2 values stand under a header of 0"),
    "<X=START>": ("", "this stands in no section"),
}


@pytest.mark.parametrize("old", HOSTILE_DUMPS)
def test_a_bad_dump_is_refused_with_its_line(old, dump):
    new, message = HOSTILE_DUMPS[old]
    assert old in dump
    with pytest.raises(ListingError) as refused:
        DUMP.read(dump.replace(old, new, 1))
    assert message in str(refused.value)
    assert 1 <= refused.value.line <= dump.count("\n") + 2


def test_a_dump_has_at_most_a_hundred_columns():
    def section(columns):
        return f"<DS=START>\nAddress,{','.join(map(str, range(1, columns + 1)))}\n</DS=END>\n"

    assert DUMP.read(section(100)).words == {}
    with pytest.raises(ListingError, match="the header of a section is Address,1,2,3"):
        DUMP.read(section(101))


def test_a_file_about_more_than_loops_is_that_beside_another_one_too():
    one = Listing(words={1: 5}, lines={1: 3}, shown_addresses={1: "DS1"})
    one.join(Listing(is_mixed=True))
    assert one.is_mixed


def test_a_dump_that_is_cut_off_is_refused(dump):
    with pytest.raises(ListingError, match="the section DF does not end: the file is cut off"):
        DUMP.read(dump[: dump.index("DF101,")])


@pytest.mark.parametrize("text", ["", "\n", "\ufeff", "\0\0\0", "hello", "x" * 10_000_000, "<DS=START>", "</DS=END>"])
def test_what_is_no_dump_is_refused(text):
    with pytest.raises(ListingError):
        DUMP.read(text)


def test_mutilated_dumps_are_read_or_refused_but_never_crash(dump):
    chance = random.Random(11)
    for _ in range(25):
        at, length = chance.randrange(len(dump)), chance.randrange(1, 12)
        rubbish = "".join(chance.choice("<>=/,\n\r09.-eE\ud800\u2028Ä") for _ in range(length))
        with suppress(ListingError):
            DUMP.read(dump[:at] + rubbish + dump[at + length :])


# --- pyclickplc, another reader and writer of these files, has the same addresses, bytes and values -------------------


def test_every_address_of_a_click_is_known_by_its_name_and_type():
    assert list(ALL_BANKS) == list(MEMORY_TYPE_TO_DATA_TYPE)
    numbers = [n for n in range(4600) if n < 1100 or not 50 < n % 500 < 450]  # banks end near multiples of 500
    for bank, code in MEMORY_TYPE_TO_DATA_TYPE.items():
        found = {n: address_of(f"{bank}{n}") for n in numbers}
        assert {n: address.name for n, address in found.items() if address} == {
            n: name for n in numbers if (name := normalize_address(f"{bank}{n}"))
        }
        assert {(one.bank, one.type) for one in found.values() if one} == {(bank, DATA_TYPE_CODE_TO_STR[code])}


@given(st.from_regex(r"[A-Za-z]{0,4}[0-9]{0,8}", fullmatch=True) | st.text(max_size=8))
def test_what_is_no_address_to_one_is_none_to_the_other(text):
    ours, theirs = address_of(text), normalize_address(text) if text.isascii() and text == text.strip() else None
    assert (ours and (ours.bank, ours.name)) == (theirs and (parse_address(theirs)[0], theirs))


@pytest.mark.parametrize(
    "text", ["C1u", "X001U", "XD1u", "YD8U", "D\u017f1", "DS\u0661", " C1", "C1\n", "C999999999", ""]
)
def test_halves_that_there_are_not_and_other_letters_are_no_address(text):
    assert address_of(text) is None
    assert [address_of(half).name for half in ("xd0U", "YD00u")] == ["XD0u", "YD0u"]


def test_modbus_numbers_are_those_of_pyclickplc():
    for bank in SPACE.banks:
        for n in range(bank.first, bank.last + 1):
            place = NUMBERING.place(SPACE.number_of(bank.prefix, n))
            assert (place.register, place.width) == plc_to_modbus(bank.prefix, n)
            assert (place.table == "coil") == (bank.prefix == "C")
    banks = {bank.prefix for bank in SPACE.banks}
    for register in range(0x10000):
        coil, holding = modbus_to_plc(register, is_coil=True), modbus_to_plc_register(register)
        wanted = (SPACE.number_of(*coil), 0) if coil and coil[0] in banks else None
        assert NUMBERING.find("coil", register) == wanted
        wanted = (SPACE.number_of(*holding[:2]), holding[2]) if holding and holding[0] in banks else None
        assert NUMBERING.find("holding", register) == wanted
        assert NUMBERING.find("input", register) is None


def written(save, path) -> bytes:
    """What pyclickplc writes, with the line ends of ours."""
    save(path)
    return path.read_bytes().replace(b"\r\n", b"\n")


@SLOW
@given(configurations())
def test_pyclickplc_writes_the_same_bytes(tmp_path_factory, config):
    image, path = encode(config).image, tmp_path_factory.mktemp("files") / "file"
    records = [
        make_address_record(r.address, nickname=r.nickname, initial_value=r.value, comment=r.comment)
        for r in nicknames(image)
    ]
    assert NICKNAMES.write(image, ()).encode() == written(lambda at: write_csv(at, records), path)
    by_loop = {}
    for cell in image.cells:
        if cell.access != "reserved":
            value = cell.value if cell.access == "setting" else None
            by_loop.setdefault(cell.loop, []).append(make_dataview_record(cell.address, new_value=value))
    for text, rows in zip(DATAVIEW.write(image, ()).values(), by_loop.values(), strict=True):
        saved = written(DataViewFile(rows=rows).save, path).decode("utf-16-le")
        assert text.replace("\r\n", "\n") == saved.replace("\r\n", "\n")


@SLOW
@given(configurations())
def test_pyclickplc_reads_the_same_values(tmp_path_factory, config):
    image, path = encode(config).image, tmp_path_factory.mktemp("files") / "file"
    path.write_text(NICKNAMES.write(image, ()), "utf-8")
    names = {r.display_address: (r.nickname, r.initial_value or "0", r.comment) for r in read_csv(path).values()}
    assert names == {r.address: (r.nickname, r.value or "0", r.comment) for r in nicknames(image)}
    values = {}
    for text in DATAVIEW.write(image, ()).values():
        path.write_bytes(text.encode("utf-16-le"))
        values |= {row.address: row.new_value for row in DataViewFile.load(path).rows if row.new_value is not None}
    assert raw_of(values) == setting_words(image)
    write_plc_data(path, {}, banks=["C", "DS", "DF"])
    with suppress(UnwritableError):  # a float of more decimals than a dump has
        path.write_text(DUMP.merge(image, path.read_text("ascii"))[0], "ascii")
        assert setting_words(image).items() <= raw_of(read_plc_data(path)).items()


def raw_of(values) -> dict[int, int]:
    """Values of pyclickplc as raw contents."""
    return {(number := SPACE.parse(address)): SPACE.kind_of(number).read(value) for address, value in values.items()}


# --- all of them ------------------------------------------------------------------------------------------------------


@SLOW
@given(configurations())
def test_every_format_carries_every_setting(config):
    image = encode(config).image
    assert setting_words(image).items() <= NICKNAMES.read(NICKNAMES.write(image, ())).words.items()
    words = {}
    for text in DATAVIEW.write(image, ()).values():
        words |= DATAVIEW.read(text).words
    assert words == setting_words(image)


def test_formats_are_told_from_their_first_line(image, dump):
    view = DATAVIEW.write(image, ())["TANK1"].removeprefix("\ufeff")
    texts = {"nickname-csv": NICKNAMES.write(image, ()), "cdv": view, "data-dump": dump}
    texts |= {name: FORMATS[name].write(image, ()) for name in ("text", "csv", "json", "modbus")}
    assert {name: detect_kind(text, FORMATS).name for name, text in texts.items()} == {name: name for name in texts}


def test_a_header_in_quotes_is_told_too(image):
    quoted = ",".join(f'"{name}"' for name in HEADER)
    text = NICKNAMES.write(image, ()).replace(HEAD, quoted, 1)
    assert detect_kind(text, FORMATS) is NICKNAMES
    assert NICKNAMES.read(text).words == NICKNAMES.read(NICKNAMES.write(image, ())).words


def words_of(folder: Path, file: str) -> bytes:
    """The register listing of a configuration, without what stands beside it."""
    result = run("encode", file, "--format", "csv", "-q", cwd=folder)
    assert result.returncode == 0, result.stderr
    lines = [line for line in result.stdout.splitlines() if not line.startswith(b"#")]
    return b"\n".join(b",".join(line.split(b",")[:3]) for line in lines)


FORMAT_RUNS = {
    "nickname-csv": ((), ("out",), ("--pwm-bit", "none")),
    "cdv": ((), ("out-TANK1", "out-VAT_2"), (*BLOCKS, "--pwm-bit", "none")),
    "data-dump": (("--into", "dump.csv"), ("out",), (*BLOCKS, "--pwm-bit", "none")),
}


@pytest.mark.parametrize("name", FORMAT_RUNS)
def test_encode_decode_encode_is_identical(name, folder, dump):
    assert "98.60000000" in dump  # the PV, which is no setting but would come back as the state it is
    (folder / "dump.csv").write_text(dump.replace("98.60000000", "0.00000000"), "ascii")
    more, outputs, options = FORMAT_RUNS[name]
    result = run("encode", "plant.yaml", "--format", name, "-o", "out.x", *more, cwd=folder)
    assert result.returncode == 0, result.stderr
    files = [f"{output}.x" for output in outputs]
    result = run("decode", *files, "--vendor", "click", *options, "-o", "back.yaml", cwd=folder)
    assert result.returncode == 0, result.stderr
    assert b"belong to no loop" not in result.stderr
    assert words_of(folder, "back.yaml") == words_of(folder, "plant.yaml")


def test_a_name_that_does_not_fit_writes_nothing(folder):
    loops = [{**LOOP, "name": "REACTOR"}]
    (folder / "plant.yaml").write_text(json.dumps({"pidcfg": 1, "vendor": "click", "loops": loops}), "utf-8")
    result = run("encode", "plant.yaml", "--format", "nickname-csv", "-o", "n.csv", cwd=folder)
    assert result.returncode == 2
    assert (
        "plant.yaml: loop REACTOR: the nickname 'REACTOR_SEL_AutotunePIDPI' has 25 characters" in result.stderr.decode()
    )
    assert not (folder / "n.csv").exists()


def test_the_checklist_names_the_loops_whose_action_nobody_has_verified():
    text = (Path(__file__).parents[1] / "examples/click/booster.yaml").read_bytes()
    config = ClickFile.model_validate(read_document(text, "x.yaml").data)
    names = [f"{loop.name} ({loop.action})" for loop in config.loops]
    loops = [loop.model_copy(update={"action_verified": i == 0}) for i, loop in enumerate(config.loops)]
    verified = config.model_copy(update={"loops": loops})
    (item,) = [item for item in checklist(verified) if "action_verified" in item]
    assert names[0] not in item
    assert all(name in item for name in names[1:])
    done = verified.model_copy(update={"loops": verified.loops[:1]})
    assert not [item for item in checklist(done) if "action_verified" in item]
