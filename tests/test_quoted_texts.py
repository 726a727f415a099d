"""What a message quotes of a file is cut, so that a line of a damaged file does not fill the screen."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest

import pidcfg
from pidcfg.encoders.click.nicknames import merge_nicknames
from pidcfg.encoders.codecs import DecodeError
from pidcfg.encoders.contract import formats_of
from pidcfg.encoders.dpide.image import decode
from pidcfg.encoders.dpide.st_read import read_st
from pidcfg.encoders.listing import ListingError
from pidcfg.encoders.parameters import UnknownContent
from pidcfg.vendors import VENDORS
from test_dpide_st import by_name
from test_listings import EXAMPLES, written

NICKNAMES = "Address,Data Type,Nickname,Initial Value,Retentive,Address Comment\n"
MODBUS_NICKNAMES = NICKNAMES.replace("Type,", "Type,Modbus Address,Function Code,")
SYMBOLS = "Class,Identifiers,Address,Type,Initial Value,Comment\n"
PROJECT = '<project xmlns="http://www.plcopen.org/xml/tc6_0201"><types><pous>{}</pous></types></project>'


CUT = [
    ("ezlogix", "csv", "address,hex,{x},{x}\n", 40),
    ("dl06", "text", "V2000 {x}\n", 40),
    ("dl06", "text", "{x} 0001\n", 40),
    ("dl06", "text", "V2000 0001 {9}\n", 40),
    ("dl06", "text", "V2000: {x}\n", 40),
    ("dl06", "csv", "address,value\n{x},1\n", 40),
    ("dl06", "csv", "address,decimal\nV2000,{x}\n", 40),
    ("dpide", "operands", "operand,value\n{x},1\n", 60),
    ("dpide", "operands", "operand,type,value\nL.SV,{x},1\n", 20),
    ("dpide", "symbols", f"{SYMBOLS}VAR,{{x}},,INT,,\nVAR,{{x}},,INT,,\n", 60),
    ("dpide", "st", by_name().replace("SV := 80.0", "{x}"), 40),
    ("dpide", "st", by_name().replace("SV := 80.0", "SV => {x}"), 40),
    ("dpide", "st", by_name(SV="(({x}))").replace("((", "").replace("))", "*"), 60),
    ("dpide", "st", by_name(SV="++{9}"), 40 - len("++")),
    ("dpide", "st", by_name(CYCLE="5{_}.5"), 40 - len("5")),
    ("dpide", "st", by_name(CYCLE="K-{9}.5"), 40 - len("K-")),
    ("dpide", "st", by_name(SV="F{9}.5.5"), 40 - len("F")),
    ("dpide", "st", f"VAR a AT {{x}} : REAL; END_VAR {by_name()}", 40),
    ("dpide", "st", f"VAR a : {{X}}; END_VAR {by_name(SV='a')}", 40),
    ("click", "nickname-csv", f'{NICKNAMES}{{x}},INT,"a",0,Yes,""\n', 40),
    ("click", "nickname-csv", f'{NICKNAMES}DS1,{{x}},"a",0,Yes,""\n', 40),
    ("click", "nickname-csv", f'{NICKNAMES}DS1,INT,"a",{{x}},Yes,""\n', 40),
    ("click", "nickname-csv", f'{NICKNAMES}DS1,INT,"a",0,{{x}},""\n', 40),
    ("click", "cdv", "-1,0,0\n{x}\n", 60),
    ("click", "data-dump", "<DS=START>\nAddress,1\n{x},1\n</DS=END>\n", 40),
    ("click", "data-dump", "<DS=START>\nAddress,1\nDS1,{x}\n</DS=END>\n", 40),
    ("ezlogix", "tags", "tag,address,value\na,R1,{x}\n", 40),
    ("ezlogix", "tags", "tag,address,value\n{x},R1,1\n{x},R2,1\n", 60),
    ("nextopid", "st", '(* loop: {"block": "A", "type": "PID{x}"} *)', 80 - len('{"block": "A", "type": "PID')),
]


def fill(text: str, count: int) -> str:
    """A text with so many of the sign in braces."""
    return re.sub(r"\{(.)\}", lambda found: found[1] * count, text)


def refusal(vendor: str, name: str, text: str) -> str:
    """Why a format refuses a text."""
    with pytest.raises(ListingError) as refused:
        formats_of(VENDORS[vendor]).FORMATS[name].read(text)
    return str(refused.value)


def assert_cut(text: str, length: int, messages: Callable[[str], str]) -> None:
    """So many signs in braces are quoted, and one more is not."""
    sign = re.search(r"\{(.)\}", text)[1]
    for count in (length, length + 1):
        quoted = re.findall(f"{re.escape(sign)}+", messages(fill(text, count)))
        assert max(map(len, quoted)) == length


@pytest.mark.parametrize(("vendor", "name", "text", "length"), CUT)
def test_a_refused_text_is_quoted_up_to_a_length(vendor, name, text, length):
    assert_cut(text, length, lambda filled: refusal(vendor, name, filled))


@pytest.mark.parametrize(
    ("text", "length"),
    [
        (f"IF {{X}} THEN {by_name()} END_IF;", 60),
        (f"TMRH(SM400, T0, {{X}}); IF T0 THEN {by_name()} END_IF;", 40),
        (f"TMRH(SM400, T0, 5); IF T0 THEN {by_name(CYCLE='{X}')} END_IF;", 40),
    ],
)
def test_a_note_quotes_a_condition_or_a_time_up_to_a_length(text, length):
    assert_cut(text, length, lambda filled: " ".join(read_st(filled).notes))


def _decode_error(words: dict[str, object], settings=()) -> str:
    with pytest.raises(DecodeError) as refused:
        decode(words, settings)
    return str(refused.value)


def test_a_symbol_whose_content_is_not_known_is_quoted_up_to_a_length():
    assert_cut("{X}", 40, lambda symbol: _decode_error({"L.SV": UnknownContent(symbol)}))


def test_a_name_and_a_content_that_are_none_are_quoted_up_to_60_characters():
    settings = [{"loop": "L", "device": "D500"}]
    for count in (60, 61):
        message = _decode_error({f"L.{'X' * count}": 1.0}, settings)
        assert message.startswith(f"L.{'X' * 58}: '{'X' * 60}' is not ")
    assert_cut("{X}", 59, lambda filled: _decode_error({"L.PID_RUN": True, "L.SV": filled}, settings))


def test_the_initial_value_of_an_operands_symbol_is_quoted_up_to_a_length():
    table = re.sub(r"(_SV,[^,]*,REAL),[^,]*,", r"\1,{x},", written("dpide", "symbols"), count=1)
    assert_cut(table, 40, lambda filled: refusal("dpide", "symbols", filled))


def test_a_modbus_address_of_a_nickname_is_quoted_up_to_a_length():
    image = pidcfg.encode(EXAMPLES / "click/tank.yaml").image

    def merged(text: str) -> str:
        with pytest.raises(ListingError) as refused:
            merge_nicknames(image, text)
        return str(refused.value)

    assert_cut(f'{MODBUS_NICKNAMES}C1,BIT,{{9}},"FC","a",0,Yes,""\n', 40, merged)


@pytest.mark.parametrize("count", [0, 2])
def test_the_name_of_a_program_of_a_project_is_quoted_up_to_a_length(count):
    def missing(name: str) -> str:
        pous = f'<pou name="{name}" pouType="program"/>' * count or '<pou name="A" pouType="program"/>'
        with pytest.raises(ListingError) as refused:
            formats_of(VENDORS["nextopid"]).FORMATS["plcopen"].read_program(PROJECT.format(pous), name)
        return str(refused.value)

    assert_cut("{X}", 40, missing)
