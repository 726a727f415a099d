"""Memory listings: spellings and Intel HEX."""

from __future__ import annotations

import csv
import io
import json
import re
from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st

import golden
from command import run
from pidcfg import api
from pidcfg.cli.commands.decode import command
from pidcfg.encoders.codecs import DecodeError
from pidcfg.encoders.contract import formats_of, tables_of
from pidcfg.encoders.decoding import decode_listing, read_listing
from pidcfg.encoders.dl06.files import read_bytes, read_ihex, write_records
from pidcfg.encoders.image import LoopOption, with_options
from pidcfg.encoders.listing import ListingError, read_text
from pidcfg.text.reader import DEFAULT
from pidcfg.vendors import VENDORS

# --- Listings as spreadsheets and people leave them: other letters, other separators, cells in quotes, lines cut ------

EXAMPLES = Path(__file__).parents[1] / "examples"
FILES = {
    "dl06": "oven",
    "click": "tank",
    "ezlogix": "oven",
    "generic": "boiler",
    "nextopid": "furnace",
    "dpide": "oven",
}
TABLES = [
    (vendor, kind)
    for vendor in FILES
    for kind in ("csv", "modbus", "tags", "operands")
    if kind in VENDORS[vendor].load("formats")
]
"""Every listing whose columns are found by their header."""


def written(vendor: str, kind: str) -> str:
    """The listing of an example."""
    text = api.encode(EXAMPLES / vendor / f"{FILES[vendor]}.yaml", kind).text
    assert isinstance(text, str)
    return text


def read_spelling(vendor: str, text: str, kind: str | None = None):
    """What a listing holds, its kind found by its first line."""
    return read_listing(text.encode(), VENDORS[vendor], DEFAULT, kind)


def header_and_rows(text: str) -> tuple[list[str], list[list[str]]]:
    """Comment lines; header and rows as cells."""
    lines = text.splitlines()
    return [x for x in lines if x.startswith("#")], list(csv.reader(x for x in lines if not x.startswith("#")))


def titled(text: str) -> str:
    above, (head, *rows) = header_and_rows(text)
    return joined(above, [[cell.title() for cell in head], *rows])


def joined(above: list[str], rows: list[list[str]], delimiter: str = ",", quoting: int = csv.QUOTE_MINIMAL) -> str:
    """A file of these rows."""
    out = io.StringIO()
    csv.writer(out, delimiter=delimiter, quoting=quoting, lineterminator="\r\n").writerows(rows)
    return "".join(f"{line}\r\n" for line in above) + out.getvalue()


def upper(text: str) -> str:
    above, (head, *rows) = header_and_rows(text)
    return joined(above, [[cell.upper() for cell in head], *rows])


def spaced(text: str) -> str:
    above, (head, *rows) = header_and_rows(text)
    return joined(above, [[f" {cell} " for cell in head], *rows])


def quoted(text: str) -> str:
    above, rows = header_and_rows(text)
    return joined(above, rows, quoting=csv.QUOTE_ALL)


def semicolons(text: str) -> str:
    above, rows = header_and_rows(text)
    return joined(above, rows, ";")


def tabs(text: str) -> str:
    above, rows = header_and_rows(text)
    return joined(above, rows, "\t")


def empty_columns(text: str) -> str:
    """What a spreadsheet adds when somebody once wrote beside the table."""
    above, rows = header_and_rows(text)
    return joined(above, [[*cells, "", ""] for cells in rows])


def cells_of_comments(text: str) -> str:
    """Comment lines as cells, which a spreadsheet makes of them."""
    above, rows = header_and_rows(text)
    return joined([], [*([line] for line in above), *rows])


CHANGES = (titled, upper, spaced, quoted, semicolons, tabs, empty_columns, cells_of_comments)


@pytest.mark.parametrize("change", CHANGES)
@pytest.mark.parametrize(("vendor", "kind"), TABLES)
def test_a_table_is_read_however_a_spreadsheet_saved_it(vendor, kind, change):
    text = written(vendor, kind)
    wanted, found = read_spelling(vendor, text), read_spelling(vendor, change(text))
    assert found.words == wanted.words != {}
    assert found.settings == wanted.settings != ()
    assert found.plc == wanted.plc


@pytest.mark.parametrize("vendor", ["dl06", "click", "ezlogix"])
@pytest.mark.parametrize("kind", ["text", "csv", "json"])
def test_addresses_in_small_letters_are_those_in_large_ones(vendor, kind):
    text = written(vendor, kind)
    wanted = read_spelling(vendor, text)
    names = "|".join(wanted.shown_addresses.values())
    small = re.sub(rf'(^|"address": ")({names})(?=[\s,"])', lambda m: m[1] + m[2].lower(), text, flags=re.MULTILINE)
    assert small != text
    assert read_spelling(vendor, small).words == wanted.words


def test_a_short_table_with_a_header_in_capitals():
    assert read_spelling("dl06", "Address,Hex\nV2000,0000\nv2007,0020\n").words == {0o2000: 0, 0o2007: 0x20}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("Address,Hex,hex\nV2000,0000,0000\n", "the header has the column hex twice"),
        ("Address;Hex\nV2000;0,5\n", "'0,5' is not word content"),
        ("Address;Hex\nV2000,0000\n", "1 cell stands under a header of 2 columns"),
        ("Address,Hex\nV2000,0000,7\n", "3 cells stand under a header of 2 columns"),
        ("Address,Hex\nv2008,0000\n", "'v2008' is not an address of this vendor"),
        ("Element,Value\nV2000,0050\n", "0050 looks hexadecimal and stands in a column of decimal values"),
        ("Address,Words\nV2000,0000\n", "the header has no column hex or value"),
    ],
)
def test_what_stays_refused(text, message):
    with pytest.raises(ListingError, match=message.replace("(", r"\(")):
        read_spelling("dl06", text)


@pytest.mark.parametrize("head", ["Element,Hex", "ELEMENT,Decimal", "Address,Hex,Dec", "element;hex;decimal"])
def test_columns_as_programming_software_names_them(head):
    between = ";" if ";" in head else ","
    rows = {"hex": "0100", "decimal": "256", "dec": "256"}
    cells = [rows.get(name.lower(), "V2000") for name in head.split(between)]
    assert read_spelling("dl06", f"{head}\n{between.join(cells)}\n").words == {0o2000: 256}


@pytest.mark.parametrize("name", ["Decimal", "dec", "value"])
def test_two_columns_that_differ_are_refused_whatever_they_are_called(name):
    with pytest.raises(ListingError, match="hex 0100 is 256, but the value says 255"):
        read_spelling("dl06", f"Address,Hex,{name}\nV2000,0100,255\n")


@pytest.mark.parametrize(
    ("vendor", "row", "name", "sign"),
    [
        ("dl06", "V2000,0408", "V2000", ","),
        ("dl06", "V2000: 0408", "V2000", ":"),
        ("dl06", '# upload\n"V2000";"1408"', "V2000", ";"),
        ("click", "C101=1", "C101", "="),
        ("ezlogix", "R101,5", "R101", ","),
    ],
)
def test_a_row_without_a_header_is_told_which_forms_are_read(vendor, row, name, sign):
    with pytest.raises(ListingError, match=f"write blanks in place of '{sign}' behind {name}, or begin a table with"):
        read_spelling(vendor, row)


@pytest.mark.parametrize("row", ["Hello, world", "V2000", "C101,1", "V,1", ""])
def test_a_text_without_an_address_of_the_vendor_is_told_no_form_of_rows(row):
    with pytest.raises(ListingError) as error:
        read_spelling("dl06", row)
    assert "write blanks" not in str(error.value)


def test_the_forms_that_the_message_names_are_read():
    for text in ("V2000 0408", "address,hex\nV2000,0408", "address,value\nV2000,1032"):
        assert [*read_spelling("dl06", text).words.values()] == [0x0408]


# --- DL06 listings as other programs and people write them: each shape with all words of an example (D991) ------------

WORDS = read_spelling("dl06", written("dl06", "text")).words
REFERENCE, LONG_REFERENCE = 40_001, 400_001


def lines(row, head: str = "") -> str:
    """A file with a row for each word of the example."""
    return (f"{head}\n" if head else "") + "".join(f"{row(f'V{n:o}', n, word)}\n" for n, word in sorted(WORDS.items()))


def dump(sign: str) -> str:
    """Eight words a row."""
    rows: list[list[int]] = []
    for n in sorted(WORDS):
        if rows and n == rows[-1][-1] + 1 and len(rows[-1]) < 8:
            rows[-1].append(n)
        else:
            rows.append([n])
    return "".join(f"V{row[0]:o}{sign} {' '.join(f'{WORDS[n]:04X}' for n in row)}\n" for row in rows)


HEXADECIMAL = "words are read as hexadecimal, as 7E08 of {} must be (D991)"
AS_REFERENCE = "{} is read as the reference of V2000 (D991)"
SHAPES = {
    # shape: the file, and what the notes say
    "0x": (lines(lambda v, _, w: f"{v} 0x{w:04X}"), ()),
    "h": (lines(lambda v, _, w: f"{v} = {w:04X}h"), ()),
    "16#": (lines(lambda v, _, w: f"{v};16#{w:04X}"), ()),
    "$": (lines(lambda v, _, w: f"{v} ${w:X}"), ()),
    "K": (
        lines(lambda v, _, w: f"{v} K{w:04X}"),
        ("K before digits is the constant of a ladder program: K0100 is the word 0100 (D991)",),
    ),
    "eight a row": (dump(":"), (HEXADECIMAL.format("V2000"),)),
    "comma": (lines(lambda v, _, w: f"{v},{w:04X}"), (HEXADECIMAL.format("V2000"),)),
    "comma, decimal beside": (lines(lambda v, _, w: f"{v}, {w:04X}, {w}, remark"), ()),
    "element": (lines(lambda v, _, w: f"{v},{w:04X}", "Element,Value"), (HEXADECIMAL.format("V2000"),)),
    "address": (lines(lambda v, _, w: f"{v};{w:04X}", "Address;Value"), (HEXADECIMAL.format("V2000"),)),
    "address, decimal": (
        lines(lambda v, _, w: f"{v},{w}", "Address,Value"),
        ("values are read as decimal, as 32264 of V2000 must be (D991)",),
    ),
    "decimal": (lines(lambda v, _, w: f"{v},{w}", "Address,Decimal"), ()),
    "Data View": (lines(lambda v, _, w: f'"{v}","{w:04X}"', '"Element","Status"'), (HEXADECIMAL.format("V2000"),)),
    "Data View without a header": (lines(lambda v, _, w: f'"{v}","{w:04X}"'), (HEXADECIMAL.format("V2000"),)),
    "hex with marks": (lines(lambda v, _, w: f"{v},0x{w:04X}", "Address,Hex"), ()),
    "hex and decimal": (lines(lambda v, _, w: f"{v},0x{w:04X},{w}", "Address,Hex,Decimal"), ()),
    "references": (lines(lambda _, n, w: f"{REFERENCE + n} {w:04X}"), (AS_REFERENCE.format(41025),)),
    "six digits": (
        lines(lambda _, n, w: f"{LONG_REFERENCE + n},{w}", "reference,decimal"),
        (AS_REFERENCE.format(401025),),
    ),
    "register, from 0": (
        lines(lambda _, n, w: f"{n},{w}", "register,value"),
        (
            "values are read as decimal, as 32264 of 1024 must be (D991)",
            "registers count from 0: so V7640 finds the loop table (D991)",
        ),
    ),
    "register, from 1": (
        lines(lambda _, n, w: f"{n + 1},{w:04X}", "Register,Hex"),
        ("registers count from 1: so V7640 finds the loop table (D991)",),
    ),
}


@pytest.mark.parametrize("shape", SHAPES)
def test_a_dl06_listing_is_read_as_others_write_it(shape):
    text, notes = SHAPES[shape]
    listing = read_spelling("dl06", text)
    assert listing.words == WORDS
    assert listing.notes == notes


def test_rows_of_words_need_no_sign():
    row = dump("").splitlines()[0]
    assert [*read_spelling("dl06", row).words.values()] == [WORDS[0o2000 + i] for i in range(8)]


A_FORM = (
    "; write blanks in place of '{}' behind V2001, or begin a table with the header 'address,hex', or 'address,value' "
    "where the numbers are decimal"
)
CALL_IT_HEX = "; call the column Hex, or write it without the zeros before it"
LOOKS_HEXADECIMAL = f"V2000: 0408 looks hexadecimal and stands in a column of decimal values{CALL_IT_HEX}"
FROM_0_OR_1 = (
    "register {} may count from 0 or from 1, and no V7640 in the file tells which by the loop table that it points to; "
    "write references, 41025 for V2000, or addresses"
)
EITHER_BASE = "V2001: 100 may be hexadecimal or decimal"
UNDECIDED = {
    # a file: line, column, and its error
    "V2000: 7E08\nV2001: 100": (2, 8, f"{EITHER_BASE}, and 7E08 in line 1 is hexadecimal{A_FORM.format(':')}"),
    "V2000 = 0408h\nV2001 = 100": (2, 9, EITHER_BASE + A_FORM.format("=")),
    "Address,Value\nV2000,7E08\nV2001,100": (3, 1, f"{EITHER_BASE}, and 7E08 in line 2 is hexadecimal{CALL_IT_HEX}"),
    "Address,Value\nV2000,0408": (2, 1, LOOKS_HEXADECIMAL),
    "Address,Decimal\nV2000,0408": (2, 1, LOOKS_HEXADECIMAL),
    "Address,Value\nV2000,5E+08": (2, 1, "V2000: '5E+08' is not a word of 0 to 65535"),
    "Address,Value\nV2000,65536": (2, 1, "V2000: '65536' is not a word of 0 to 65535"),
    "Address,Value\nV2000,": (2, 1, "V2000: ' ' is not a word of 0 to 65535"),
    "V2000 0x10000": (1, 7, "'0x10000' is not word content of up to 4 hexadecimal digits"),
    "V2000 7E08 0102": (1, 1, "V2000: hex 7E08 is 32264, but the value says 0102"),
    "V2000, 7E08, 100": (1, 1, "V2000: hex 7E08 is 32264, but the value says 100"),
    "V2000:": (1, 7, "the word of V2000 is missing"),
    "V2000: 7E08\nHello": (2, 1, "'Hello' is not an address of this vendor"),
    "V2008: 7E08": (1, 1, "'V2008' is not an address of this vendor; its digits are octal, 0 to 7"),
    'V2000,"7E08': (1, 1, "not CSV: unexpected end of data"),
    "V2000 7E08\nV2000: 7E09": (2, 1, "V2000 stands here again; first in line 1"),
    "V2000: 7E08 7E09\nV2001: 7E08": (2, 1, "V2001 stands here again; first in line 1"),
    f"V{0xFFFF:o}: 7E08 7E09": (1, 15, "there is no word 1 behind V177777"),
    "register,value\n1024,5": (2, 1, FROM_0_OR_1.format(1024)),
    "register,value\n1024,1\n4000,1024\n4001,1\n2,1\n4002,1": (2, 1, FROM_0_OR_1.format(1024)),
    "address,hex\n41025,7E08\n1025,7E08": (2, 1, FROM_0_OR_1.format(41025)),
}


@pytest.mark.parametrize(("vendor", "address"), [("click", "C1"), ("ezlogix", "R1"), ("dl06", "V2000")])
def test_a_word_that_is_missing_is_refused_behind_its_address(vendor, address):
    with pytest.raises(ListingError, match=f"the word of {address} is missing") as refused:
        read_text(f"  {address}  ", VENDORS[vendor].module("registers").SPACE)
    assert (refused.value.line, refused.value.column) == (1, len(address) + 3)


@pytest.mark.parametrize("text", UNDECIDED)
def test_digits_of_two_readings_are_refused_with_a_cure(text):
    line, column, message = UNDECIDED[text]
    with pytest.raises(ListingError) as refused:
        read_spelling("dl06", text)
    assert (refused.value.line, refused.value.column, str(refused.value)) == (line, column, message)


def test_values_that_may_be_hexadecimal_are_read_as_decimal_and_said_to_be():
    listing = read_spelling("dl06", "Element,Value\nV2000,250\nV2001,7\n")
    assert listing.words == {0o2000: 250, 0o2001: 7}
    assert listing.notes == ("values are read as decimal; call their column Hex if they are not (D991)",)
    assert read_spelling("dl06", "Element,Value\nV2000,5\nV2001,7\n").notes == ()


def test_the_shape_of_a_listing_is_told_by_the_command(tmp_path):
    (tmp_path / "upload.txt").write_text(SHAPES["eight a row"][0], "utf-8")
    result = run("decode", "upload.txt", "--vendor", "dl06", cwd=tmp_path)
    assert result.returncode == 0
    assert "note: words are read as hexadecimal, as 7E08 of V2000 must be (D991)" in result.stderr.decode()


# --- Intel HEX: the bytes are those of intelhex, both ways, and whatever is not as it must be is refused at its line --

PLACES = st.one_of(st.integers(0, 90), st.integers(0xFFF0, 0x10010), st.integers(0x2FFF8, 0x30008))
MEMORIES = st.dictionaries(PLACES, st.integers(0, 255), max_size=90)
END = ":00000001FF\n"
DATA = ":021000000004EA\n"


def other(memory):
    """What intelhex writes."""
    file = io.StringIO()
    pytest.importorskip("intelhex").IntelHex(dict(memory)).write_hex_file(file, eolstyle="native")
    return file.getvalue().replace("\r\n", "\n")


@given(MEMORIES)
def test_bytes_are_those_of_intelhex_both_ways(memory):
    text = write_records(memory)
    assert text == other(memory)
    assert read_bytes(text) == memory
    assert pytest.importorskip("intelhex").IntelHex(io.StringIO(text)).todict() == memory


@given(MEMORIES.filter(bool), st.data())
def test_a_digit_that_is_changed_is_refused(memory, data):
    text = write_records(memory)
    at = data.draw(st.sampled_from([i for i, c in enumerate(text) if c.isalnum()]))
    digit = data.draw(st.sampled_from([c for c in "0123456789ABCDEF" if c != text[at]]))
    with pytest.raises(ListingError):
        read_bytes(text[:at] + digit + text[at + 1 :])


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        ("", 1, "without its end-of-file record"),
        (DATA, 1, "without its end-of-file record"),
        (END + DATA, 2, "behind the end-of-file record"),
        (DATA + DATA + END, 2, "byte 0x1000 stands there twice"),
        ("junk\n" + END, 1, "a record is a colon and pairs"),
        (": 02 1000 00 0004 EA\n" + END, 1, "a record is a colon and pairs"),
        (":0000\n" + END, 1, "five at least"),
        (DATA.replace("EA", "EB") + END, 1, "the checksum is EB, not EA"),
        (":0310000000040 EA\n" + END, 1, "a record is a colon and pairs"),
        (":031000000004E9\n" + END, 1, "says 3 bytes of data and has 2"),
        (":02FFFF000102FD\n" + END, 1, "byte 0x10000 is beyond the 64 KiB of its record"),
        (":00000006FA\n" + END, 1, "no record of type 06 has 0 bytes"),
        (":0100000400FB\n" + END, 1, "no record of type 04 has 1 bytes"),
        (":020001040001F8\n" + END, 1, "no record of type 04 has 2 bytes of data at 0001"),
    ],
)
def test_what_is_no_record_is_refused_at_its_line(text, line, message):
    with pytest.raises(ListingError, match=message) as caught:
        read_bytes(text)
    assert caught.value.line == line


@pytest.mark.parametrize(("there", "missing"), [(0x1000, 0x1001), (0x1001, 0x1000)])
def test_half_a_word_is_refused(there, missing):
    with pytest.raises(ListingError) as error:
        read_ihex(write_records({0xFFE: 1, 0xFFF: 2, there: 3}))
    assert str(error.value) == f"byte 0x{missing:X} is missing, so the word at 0x800 is incomplete"


def test_extended_and_start_addresses_are_those_of_the_specification():
    text = ":020000021200EA\n:0100100001EE\n:020000040001F9\n:0100000002FD\n:0400000300003800C1\n" + END
    assert read_bytes(text.replace("\n", "\r\n").lower()) == {0x12010: 1, 0x10000: 2}
    found = pytest.importorskip("intelhex").IntelHex(io.StringIO(text)).todict()
    assert found == {0x12010: 1, 0x10000: 2, "start_addr": {"CS": 0, "IP": 0x3800}}


# --- `decode --annotate`: a meaning beside every word of every listing ------------------------------------------------


LISTINGS = [
    (example.partition("/")[0], f"{Path(example).name}.{end}")
    for example, kinds in golden.IMAGES.items()
    for kind_of, end in kinds.items()
    if kind_of not in {"cdv", "symbols", "tags", "operands"}
]
PARTIAL = [("click", "tank.cdv"), ("dpide", "oven.symbols.csv"), ("ezlogix", "oven.tags.csv")]


def annotate(path, vendor, *options):
    """The command in this process."""
    return CliRunner().invoke(command, [str(path), "--vendor", vendor, "--annotate", *options])


@pytest.mark.parametrize(("vendor", "file"), LISTINGS)
def test_every_word_of_the_examples_has_a_meaning(vendor, file):
    result = annotate(EXAMPLES / vendor / "golden" / file, vendor)
    if file.endswith((".modbus.csv", ".hex", ".nicknames.csv")) and vendor == "click":
        result = annotate(
            EXAMPLES / vendor / "golden" / file, vendor, "--bits", "C101", "--integers", "DS101", "--floats", "DF101"
        )
    assert result.exit_code == 0, result.stderr
    head, *lines = result.stdout.splitlines()
    at = head.index("meaning")
    assert max(map(len, lines)) <= max(120, at + 40)
    words = [line for line in lines if not line.startswith(" ")]
    assert words
    assert all(len(line) > at and line[at] != " " for line in words)
    assert not [line for line in words if "belongs to no loop" in line]
    assert not [line for line in words if "no value" in line]


@pytest.mark.parametrize(("vendor", "file"), PARTIAL)
def test_files_that_hold_a_part_of_the_words_are_read_too(vendor, file):
    result = annotate(EXAMPLES / vendor / "golden" / file, vendor)
    assert result.exit_code == 0 or "error PID041" in result.stderr
    assert "Traceback" not in result.output


REACTOR = (EXAMPLES / "dl06/golden/reactor.txt").read_text("utf-8")


def lines_of(tmp_path, text, vendor="dl06", *options):
    """The annotated lines by address."""
    path = tmp_path / "listing.txt"
    path.write_text(text, "utf-8")
    result = annotate(path, vendor, *options)
    assert result.exit_code == 0, result.stderr
    found, last = {}, ""
    for line in result.stdout.splitlines()[1:]:
        last = last if line.startswith(" ") else line.split()[0]
        found[last] = f"{found.get(last, '')} {line.strip()}".strip()
    return found


def test_values_are_in_engineering_units(tmp_path):
    found = lines_of(tmp_path, REACTOR)
    assert found["V2002"] == "V2002    0666   1638  FIC-102  setpoint                Set point (SP): 20 m3/h"
    assert found["V2007"].endswith("Sample rate: 0.2 s")
    assert found["V2032"].endswith("Remote SP V-memory address pointer: V2045")
    assert found["V7640"].endswith("Loop parameter table pointer: V2000, room for 8 loops")
    assert "action direct" in found["V2000"]
    assert "PV alarm monitor (bit 12)" in found["V2000"]


def test_words_that_are_no_values_say_why_and_the_others_are_told(tmp_path):
    text = REACTOR.replace("V2007   0020     32", "V2007   0A20   2592").replace(
        "V7641   0003      3", "V7641   00FF    255"
    )
    found = lines_of(tmp_path, text.replace("V2001   0008      8", "V2001   C008  49160"))
    assert found["V2007"].endswith(
        "Sample rate: no value, 0x0A20 has a digit above 9; it is 2592 (typed in decimal? 25.92 would be 2592)"
    )
    assert found["V7641"].endswith("Number of loops: FF, no BCD number: no loop runs; bit 2 of V7642 goes on")
    assert "0xC008 has a combination of bits (14, 15) that means nothing" in found["V2001"]
    assert found["V2010"].endswith("Gain (proportional): 0.8 %/%")


def test_a_profile_that_points_into_the_loop_table_hides_no_loop(tmp_path):
    text = REACTOR.replace("V2034   0000      0", "V2034   0420   1056")
    assert text != REACTOR
    found = lines_of(tmp_path, text)
    assert found["V2034"].endswith("Ramp/soak table starting address: V2040")
    assert found["V2050"].endswith("Gain (proportional): 2.5 %/%")


def test_words_without_a_loop_say_so(tmp_path):
    found = lines_of(tmp_path, "V2006 0402\nV5000 1234\n")
    assert found["V2006"].endswith("is not said: give --loop-table V2000 --number-of-loops 1")
    found = lines_of(tmp_path, "V2006 0402\nV7640 0400\n")
    assert found["V2006"].endswith("is not said: give --number-of-loops 1")
    found = lines_of(tmp_path, "R101 0026\nS104 1\n", "ezlogix")
    assert {line.partition("-  ")[2].strip("- ") for line in found.values()} == {
        "where the loops begin is not said: give --registers R101 --discretes S101"
    }
    found = lines_of(tmp_path, "R101 0026\nR999 1\nS104 1\n", "ezlogix", "--registers", "R101")
    assert found["R999"].endswith("belongs to no loop")
    assert found["S104"].endswith("give --discretes S101")
    found = lines_of(tmp_path, "DF101 00000026\n", "click")
    assert found["DF101"].endswith("give --bits C101 --integers DS101 --floats DF101")
    found = lines_of(tmp_path, "V2006 0402\nV5000 1234\n", "dl06", "--loop-table", "V2000", "--number-of-loops", "1")
    assert found["V5000"].endswith("belongs to no loop")
    assert "on: Automatic mode (bit 1), Alarm value programming error (bit 10)" in found["V2006"]


def test_status_words_of_other_vendors(tmp_path):
    click = lines_of(
        tmp_path,
        "DS101 001B\nDF107 42F00000\nC110 1\n",
        "click",
        "--bits",
        "C101",
        "--integers",
        "DS101",
        "--floats",
        "DF101",
    )
    assert click["DS101"].endswith("reset time (DFn+06) is not within 0.01 to 6000 s")
    assert click["DF107"].endswith("Integral or reset time (I): 120 s")
    assert click["C110"].endswith("reverse (inferred, not printed: compare the PID window, D100)")
    ez = lines_of(
        tmp_path, "R113 0005\nR104 0578\nR112 FFFF\n", "ezlogix", "--registers", "R101", "--discretes", "S101"
    )
    assert ez["R113"].endswith("Autotune Status: the CV could not be incremented")
    assert ez["R104"].endswith("Integral (Reset) Time: 140 s")
    assert ez["R112"].endswith("Error: -1 counts of the PV")


def test_loops_that_go_on_behind_the_last_register_are_no_obstacle(tmp_path):
    lines = lines_of(tmp_path, "V7640 FFFF\nV7641 0001\nV177777 0001\n")
    assert lines["V7640"].endswith("(The loop table starts outside the upper V-memory range)")
    assert lines["V7641"].endswith("Number of loops: 1")
    assert "LOOP-1  mode_setting_1" in lines["V177777"]


def test_unreadable_listings_are_refused_as_ever(tmp_path):
    path = tmp_path / "x.txt"
    path.write_text("V2008 1400\n", "utf-8")
    result = annotate(path, "dl06")
    assert (result.exit_code, result.stdout) == (2, "")
    assert "'V2008' is not an address" in result.stderr


def test_a_word_behind_the_last_register_says_so(tmp_path):
    path = tmp_path / "far.hex"
    path.write_text(":020000040002F8\n:020000000102FB\n:00000001FF\n", "utf-8")
    result = annotate(path, "dl06")
    assert result.exit_code == 0
    assert result.stdout.endswith("lies behind the last register\n")


def test_the_result_goes_to_a_file(tmp_path):
    out = tmp_path / "out.txt"
    assert annotate(EXAMPLES / "dl06/golden/reactor.txt", "dl06", "-o", str(out)).exit_code == 0
    assert out.read_text("utf-8").startswith("address")


def test_words_about_the_pv_before_the_root_are_no_flow(tmp_path):
    text = (EXAMPLES / "dl06/golden/flow.txt").read_text("utf-8")
    found = lines_of(tmp_path, text.replace("V10003  0000      0", "V10003  0640   1600"))
    assert found["V10002"].endswith("Set point (SP): 75 m3/h")
    assert found["V10003"].endswith("(PV): 39.07 % of the signal before the root (75.01 m3/h)")
    assert found["V10014"].endswith("PV low alarm: 6.667 % of the signal before the root (30.98 m3/h)")
    assert found["V10022"].endswith("PV alarm hysteresis: 1.661 % of the signal before the root")
    reactor = lines_of(tmp_path, REACTOR)
    assert not [line for line in reactor.values() if "before the root" in line]


def test_a_reset_time_has_one_decimal_or_two(tmp_path):
    found = lines_of(tmp_path, REACTOR)
    assert found["V2051"].endswith("Reset (integral) time: 180 s (18 s if the word has two decimals: D01)")
    stated = lines_of(tmp_path, REACTOR, "dl06", "--reset-decimals", "2")
    assert stated["V2051"].endswith("Reset (integral) time: 18 s")


def test_the_direction_of_a_block_is_told_in_words():
    result = annotate(EXAMPLES / "nextopid/golden/furnace.txt", "nextopid")
    lines = {line.split()[0]: line for line in result.stdout.splitlines()}
    assert lines["TIC_1.Direct"].endswith("FALSE  BOOL  reverse: MV falls when PV rises (heating)")
    assert lines["FAN.Direct"].endswith("TRUE  BOOL  direct: MV rises when PV rises (cooling)")
    assert lines["TIC_1.Manual"].endswith("Manual mode: false")
    assert not [line for line in lines.values() if "TRUE:" in line]


def test_the_error_of_a_root_is_counts_of_the_root(tmp_path):
    text = "R112 FFF0\nS103 1\n"
    options = ("--registers", "R101", "--discretes", "S101")
    assert lines_of(tmp_path, text, "ezlogix", *options)["R112"].endswith("-16 counts of the root of the PV")
    plain = text.replace("S103 1", "S103 0")
    assert lines_of(tmp_path, plain, "ezlogix", *options)["R112"].endswith("-16 counts of the PV")


PLAIN = {"is_complete", "may_be_partial"}
TRAITS = {
    "text": PLAIN,
    "csv": PLAIN,
    "json": {*PLAIN, "carries_checklist"},
    "modbus": PLAIN,
    "ihex": PLAIN,
    "nickname-csv": {"merge"},
    "cdv": {"may_be_partial"},
    "data-dump": {"merge", "needs_into"},
    "tags": {"merge"},
    "modbus-map": set(),
    "st": {"is_complete", "carries_checklist"},
    "plcopen": {"is_complete", "carries_checklist", "read_program"},
    "operands": {"is_complete"},
    "symbols": {"merge"},
}
"""What a format does: holds all, may hold a part, goes into a file of the user's, or names what to check."""


@pytest.mark.parametrize("vendor", VENDORS)
def test_every_format_does_what_it_is_for(vendor):
    for name, kind in formats_of(VENDORS[vendor]).FORMATS.items():
        does = {trait for trait in set().union(*TRAITS.values()) if getattr(kind, trait)}
        assert (kind.name, does) == (name, TRAITS[name])
        assert not kind.looks_like("Hello, world")
        assert kind.encoding == {"cdv": "utf-16-le", "symbols": "gbk"}.get(name, "utf-8")


@pytest.mark.parametrize(
    ("vendor", "name", "mixed"),
    [
        ("ezlogix", "tags", True), ("ezlogix", "csv", False), ("click", "nickname-csv", True), ("click", "cdv", True),
        ("click", "json", False), ("dpide", "symbols", True), ("dpide", "operands", False), ("nextopid", "st", False),
        ("dl06", "modbus", False),
    ],
)  # fmt: skip
def test_a_file_of_the_programming_software_holds_more_than_loops(vendor, name, mixed):
    kind = formats_of(VENDORS[vendor]).FORMATS[name]
    assert kind.read(written(vendor, name)).is_mixed == mixed


def test_a_dump_holds_more_than_loops():
    text = "<DS=START>\nAddress,1\nDS1,0\n</DS=END>\n"
    assert formats_of(VENDORS["click"]).FORMATS["data-dump"].read(text).is_mixed


@pytest.mark.parametrize("data", [b"PK\x03\x04" + b"\0" * 40, b"%PDF-1.7\n"], ids=("zip", "pdf"))
@pytest.mark.parametrize("vendor", FILES)
def test_a_file_that_is_no_text_is_told_as_what_it_is(vendor, data):
    with pytest.raises(ListingError, match=r"^the file is .+, no memory listing; .+"):
        read_listing(data, VENDORS[vendor], DEFAULT)


@pytest.mark.parametrize(
    ("first", "place"),
    [(40_001, 0), (41_025, 0o2000), (49_999, 9998), (400_001, 0), (401_025, 0o2000), (465_536, 0xFFFF)],
)
def test_a_reference_of_a_holding_register_is_its_address_and_one(first, place):
    listing = read_listing(f"{first} 0005\n".encode(), VENDORS["dl06"], DEFAULT)
    assert listing.words == {place: 5}
    assert listing.notes == (f"{first} is read as the reference of V{place:o} (D991)",)


@pytest.mark.parametrize("number", [40_000, 400_000, 465_537])
def test_a_number_beside_the_references_is_none(number):
    with pytest.raises(ListingError, match=f"register {number} may count from 0 or from 1"):
        read_listing(f"{number} 0005\n".encode(), VENDORS["dl06"], DEFAULT)


def test_a_file_may_be_as_large_as_the_limit():
    limits = replace(DEFAULT, file_bytes=8)
    data = b"V1 0001\n".ljust(limits.listing_bytes, b"#")
    assert read_listing(data, VENDORS["dl06"], limits).words == {1: 1}
    with pytest.raises(ListingError, match=f"the file is larger than {limits.listing_bytes} bytes"):
        read_listing(data + b"#", VENDORS["dl06"], limits)


@pytest.mark.parametrize(("length", "named"), [(1000, True), (1001, False)])
def test_a_listing_names_its_vendor_in_its_first_1000_characters(length, named):
    text = "?" * (length - len("click memory listing")) + "click memory listing"
    said = "this is a listing of vendor click, not dl06" if named else "this is no memory listing that pidcfg reads"
    with pytest.raises(ListingError, match=said):
        read_listing(text.encode(), VENDORS["dl06"], DEFAULT)


def test_a_listing_gives_the_image_that_it_is_of():
    listing = read_listing(written("dl06", "text").encode(), VENDORS["dl06"], DEFAULT)
    image = listing.make_image("dl06")
    assert (image.vendor, image.words, image.settings) == ("dl06", listing.words, listing.settings)
    assert image.plc == listing.plc
    assert [cell.number for cell in image.cells] == sorted(listing.words)


@pytest.mark.parametrize("vendor", ["dl06", "click", "ezlogix"])
def test_an_address_is_one_from_the_first_to_the_last_of_its_bank(vendor):
    space = tables_of(VENDORS[vendor]).SPACE
    for bank in space.banks:
        for n, there in ((bank.first, True), (bank.last, True), (bank.last + 1, False), (bank.first - 1, False)):
            if n >= 0:
                number = space.parse(bank.address_name(n))
                assert number == (space.number_of(bank.prefix, n) if there else None)


def test_what_is_missing_altogether_is_told_at_the_first_line():
    for vendor, line in (("ezlogix", "R1 0001"), ("click", "C1 1"), ("dl06", "V1 0001")):
        listing = read_listing(f"# a\n# b\n{line}\n".encode(), VENDORS[vendor], DEFAULT)
        with pytest.raises(ListingError) as error:
            decode_listing(listing, VENDORS[vendor], {})
        assert (error.value.line, error.value.column) == (1, 1)


BITS = LoopOption(("bits",), "bits", "where the C bits begin")
PULSE = LoopOption(("output", "pwm"), "pwm_bit", "whether the output is pulsed (PWM), which no register holds")
PULSED = "the listing does not say whether the output is pulsed"
TOO_FEW, TOO_MANY = (
    f"--bits names {count}; give one for each, with commas between" for count in ("2 for 3 loops", "3 for 2 loops")
)
TWO = [{"loop": "A", "bits": "C9", "output": {"unit": "%"}}, {"loop": "B", "bits": "C49"}]
NOTE = LoopOption(("note",), "note_text", "a note", needed=False)


@pytest.mark.parametrize(
    ("settings", "options", "found"),
    [
        ([], {}, "the listing does not say where the C bits begin; give --bits"),
        ([], {"note_text": ["n"]}, "the listing does not say where the C bits begin of LOOP-1; give --bits"),
        ([], {"bits": ["C1"]}, f"{PULSED} (PWM) of LOOP-1, which no register holds; give --pwm-bit"),
        ([{}], {"pwm_bit": ["Y1"]}, "the listing does not say where the C bits begin of a loop; give --bits"),
        ([], {"bits": ["C1", "C41"], "pwm_bit": ["Y1"]}, [("LOOP-1", "C1", "Y1"), ("LOOP-2", "C41", "Y1")]),
        ([], {"bits": ["C1"], "pwm_bit": ["Y1", "Y2"]}, [("LOOP-1", "C1", "Y1"), ("LOOP-2", "C1", "Y2")]),
        ([], {"bits": ["C1", "C41"], "pwm_bit": ["Y1", "Y2", "Y3"]}, TOO_FEW),
        ([{}, {}], {"bits": ["C1"] * 3, "pwm_bit": ["Y1"]}, TOO_MANY),
        (TWO, {"pwm_bit": ["Y1", "Y2"]}, [("A", "C9", "Y1"), ("B", "C49", "Y2")]),
        ([{"loop": "A", "bits": "C9"}], {"bits": ["C1"], "pwm_bit": ["Y1"]}, [("A", "C1", "Y1")]),
    ],
)  # fmt: skip
def test_options_say_of_each_loop_what_a_listing_does_not(settings, options, found):
    before = json.dumps(settings)
    if isinstance(found, str):
        with pytest.raises(DecodeError) as refused:
            with_options(settings, options, [BITS, PULSE, NOTE])
        assert str(refused.value) == found
    else:
        loops = with_options(settings, options, [BITS, PULSE, NOTE])
        assert [(loop["loop"], loop["bits"], loop["output"]["pwm"]) for loop in loops] == found
    assert json.dumps(settings) == before
