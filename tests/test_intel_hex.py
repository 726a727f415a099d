"""Intel HEX: the bytes are those of intelhex, both ways, and whatever is not as it must be is refused at its line."""

from __future__ import annotations

import io

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pidcfg.encoders.dl06.files import read, write
from pidcfg.encoders.listing import ListingError

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
    assert read(text) == memory
    assert pytest.importorskip("intelhex").IntelHex(io.StringIO(text)).todict() == memory


@given(MEMORIES.filter(bool), st.data())
def test_a_digit_that_is_changed_is_refused(memory, data):
    text = write(memory)
    at = data.draw(st.sampled_from([i for i, c in enumerate(text) if c.isalnum()]))
    digit = data.draw(st.sampled_from([c for c in "0123456789ABCDEF" if c != text[at]]))
    with pytest.raises(ListingError):
        read(text[:at] + digit + text[at + 1 :])


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
        read(text)
    assert caught.value.line == line


def test_extended_and_start_addresses_are_those_of_the_specification():
    text = ":020000021200EA\n:0100100001EE\n:020000040001F9\n:0100000002FD\n:0400000300003800C1\n" + END
    assert read(text.replace("\n", "\r\n").lower()) == {0x12010: 1, 0x10000: 2}
    found = pytest.importorskip("intelhex").IntelHex(io.StringIO(text)).todict()
    assert found == {0x12010: 1, 0x10000: 2, "start_addr": {"CS": 0, "IP": 0x3800}}
