"""Elementary types in registers of 16 bits: what a content is there, and back."""

from __future__ import annotations

import pytest

from pidcfg.encoders.parameters import raw_of, types_of
from pidcfg.encoders.parameters import register_content as content_of
from pidcfg.schemas.iec import IecType

INT, UINT = IecType("INT", "whole", -32768, 32767), IecType("UINT", "whole", 0, 65535)
DINT = IecType("DINT", "whole", -(2**31), 2**31 - 1)
KINDS = IecType("KINDS", "word", words=("P", "PI", "PID"))


@pytest.mark.parametrize(
    ("kind", "content", "raw", "first"),
    [
        (INT, -1, 0xFFFF, "int16"),
        (INT, -32768, 0x8000, "int16"),
        (INT, 32767, 0x7FFF, "int16"),
        (UINT, 65535, 0xFFFF, "uint16"),
        (DINT, -1, 0xFFFFFFFF, "int32"),
        (DINT, -(2**31), 0x80000000, "int32"),
        (DINT, 65536, 0x10000, "int32"),
        (KINDS, "PID", 2, "int16"),
        (IecType("BOOL", "bool"), True, 1, "bool"),
        (IecType("REAL", "real"), -1.5, 0xBFC00000, "float32"),
        (IecType("TIME", "time"), "T#1500ms", 1500, "uint32"),
    ],
)
def test_a_content_is_held_in_the_registers_of_its_size(kind, content, raw, first):
    assert raw_of(kind, content) == raw
    assert content_of(kind, raw) == content
    assert types_of(kind)[0] == first
