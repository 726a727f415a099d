"""The registers of the virtual PLCs: each belongs to one loop or to none, and holds what the configuration gives."""

from __future__ import annotations

import struct
from decimal import Decimal
from pathlib import Path

import pytest

from pidcfg.schemas.iec import Wire
from pidcfg.text.source import read_document
from pidcfg.validate.engine import check_document
from pidcfg.vendors import VENDORS

EXAMPLES = Path(__file__).parents[1] / "examples"
MODE_WORDS = {0o2006, 0o2046, 0o2106}
"""+06 of the three loops of a DL06, in which the PLC shows their modes."""


def raw(content):
    """A content as a register holds it."""
    return struct.unpack("<I", struct.pack("<f", content))[0] if isinstance(content, Decimal | float) else int(content)


@pytest.mark.parametrize(
    ("example", "shared"),
    [
        ("click/brewery", False),
        ("dl06/reactor", True),
        ("dpide/dyeing", False),
        ("ezlogix/greenhouse", False),
        ("nextopid/cascade", True),
    ],
)
def test_every_register_has_its_loop_and_its_content(example, shared):
    vendor = VENDORS[example.partition("/")[0]]
    image = check_document(read_document((EXAMPLES / f"{example}.yaml").read_bytes(), "x.yaml")).encoding.image
    module = vendor.module("controller")
    plc = module.load(image, module.Options())
    registers = vendor.load("virtual")(plc)
    places = registers.places()
    held = {loop: registers.contents(loop, plc.sig) for loop in {*places.values()}}

    assert {*held} == {*range(-shared, len(plc.loops))}
    assert all({n for n, place in places.items() if place == loop} == {*contents} for loop, contents in held.items())
    given = {n: raw(content) for n, content in image.words.items() if not isinstance(content, Wire)}
    wrong = {n for n, content in given.items() if held[places[n]][n] != content}
    assert wrong == (MODE_WORDS if vendor.key == "dl06" else set())
    if vendor.key == "dpide":
        assert next(iter(places)) == "VAT.MV", "of several operands in one device MV says what it holds"


def test_the_request_bit_of_the_auto_tune_starts_it():
    """DL06, bit 7 of +01."""
    image = check_document(read_document((EXAMPLES / "dl06/reactor.yaml").read_bytes(), "x.yaml")).encoding.image
    module = VENDORS["dl06"].module("controller")
    plc = module.load(image, module.Options())
    begun = []
    plc.autotune = begun.append
    registers = VENDORS["dl06"].load("virtual")(plc)
    setting = registers.contents(0, plc.sig)[0o2001]
    assert "auto-tune start" not in registers.write(0o2001, setting, plc.sig).text
    assert begun == []
    assert registers.write(0o2001, setting | 0x80, plc.sig).text == "auto-tune start"
    assert begun == [0]
