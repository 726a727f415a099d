"""Memory listings: spellings and Intel HEX."""

from __future__ import annotations

import csv
import io
import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from command import run
from pidcfg import api
from pidcfg.encoders.decoding import read_listing
from pidcfg.encoders.dl06.files import read_bytes, write
from pidcfg.encoders.listing import ListingError
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
    names = "|".join(wanted.shown.values())
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


UNDECIDED = {
    # a file: line, column, and what its error says
    "V2000: 7E08\nV2001: 100": (2, 8, "V2001: 100 may be hexadecimal or decimal, and 7E08 in line 1 is hexadecimal"),
    "V2000 = 0408h\nV2001 = 100": (2, 9, "V2001: 100 may be hexadecimal or decimal; write blanks in place of '='"),
    "Address,Value\nV2000,7E08\nV2001,100": (3, 1, "V2001: 100 may be hexadecimal or decimal, and 7E08 in line 2"),
    "Address,Value\nV2000,0408": (2, 1, "0408 looks hexadecimal and stands in a column of decimal values; call"),
    "Address,Decimal\nV2000,0408": (2, 1, "0408 looks hexadecimal and stands in a column of decimal values; call"),
    "Address,Value\nV2000,5E+08": (2, 1, "V2000: '5E+08' is not a word of 0 to 65535"),
    "Address,Value\nV2000,65536": (2, 1, "V2000: '65536' is not a word of 0 to 65535"),
    "Address,Value\nV2000,": (2, 1, "is not a word of 0 to 65535"),
    "V2000 0x10000": (1, 7, "'0x10000' is not word content"),
    "V2000 7E08 0102": (1, 1, "V2000: hex 7E08 is 32264, but the value says 0102"),
    "V2000, 7E08, 100": (1, 1, "V2000: hex 7E08 is 32264, but the value says 100"),
    "V2000:": (1, 7, "the word of V2000 is missing"),
    "V2000: 7E08\nHello": (2, 1, "'Hello' is not an address of this vendor"),
    "V2008: 7E08": (1, 1, "'V2008' is not an address of this vendor"),
    'V2000,"7E08': (1, 1, "not CSV"),
    "V2000 7E08\nV2000: 7E09": (2, 1, "V2000 stands here again; first in line 1"),
    "V2000: 7E08 7E09\nV2001: 7E08": (2, 1, "V2001 stands here again; first in line 1"),
    f"V{0xFFFF:o}: 7E08 7E09": (1, 15, "there is no word 1 behind V177777"),
    "register,value\n1024,5": (2, 1, "register 1024 may count from 0 or from 1, and no V7640 in the file tells which"),
    "register,value\n1024,1\n4000,1024\n4001,1\n2,1\n4002,1": (2, 1, "register 1024 may count from 0 or from 1"),
    "address,hex\n41025,7E08\n1025,7E08": (2, 1, "register 41025 may count from 0 or from 1"),
}


@pytest.mark.parametrize("text", UNDECIDED)
def test_digits_of_two_readings_are_refused_with_a_cure(text):
    line, column, message = UNDECIDED[text]
    with pytest.raises(ListingError) as refused:
        read_spelling("dl06", text)
    assert message in str(refused.value)
    assert (refused.value.line, refused.value.column) == (line, column)


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
    text = write(memory)
    assert text == other(memory)
    assert read_bytes(text) == memory
    assert pytest.importorskip("intelhex").IntelHex(io.StringIO(text)).todict() == memory


@given(MEMORIES.filter(bool), st.data())
def test_a_digit_that_is_changed_is_refused(memory, data):
    text = write(memory)
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


def test_extended_and_start_addresses_are_those_of_the_specification():
    text = ":020000021200EA\n:0100100001EE\n:020000040001F9\n:0100000002FD\n:0400000300003800C1\n" + END
    assert read_bytes(text.replace("\n", "\r\n").lower()) == {0x12010: 1, 0x10000: 2}
    found = pytest.importorskip("intelhex").IntelHex(io.StringIO(text)).todict()
    assert found == {0x12010: 1, 0x10000: 2, "start_addr": {"CS": 0, "IP": 0x3800}}
