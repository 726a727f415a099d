"""Literals of Structured Text, and the names of functions that no comment speaks of."""

from __future__ import annotations

from decimal import Decimal

import pytest

from pidcfg.encoders.listing import ListingError
from pidcfg.encoders.maps.nextopid import BLOCK_TYPES
from pidcfg.encoders.nextopid.st_scope import Scope
from pidcfg.encoders.structured_text import Token, number_of


def token(text):
    return Token("number", text, 3, 5)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("5", 5),
        ("1_000", 1000),
        ("5.0", Decimal("5.0")),
        ("REAL#5", Decimal(5)),
        ("lreal#-2.5", Decimal("-2.5")),
        ("INT#5", 5),
        ("16#FF", 255),
        ("INT#16#fF", 255),
        ("2#101", 5),
        ("BOOL#1", True),
        ("BOOL#FALSE", False),
        ("T#1m30s", Decimal(90)),
    ],
)
def test_a_literal_means_a_number(text, value):
    found = number_of(token(text))
    assert found == value
    assert isinstance(found, Decimal) == isinstance(value, Decimal)
    assert isinstance(found, bool) == isinstance(value, bool)


@pytest.mark.parametrize("text", ["X#5", "X#INT#5", "INT#REAL#5", "REAL#16#F", "BOOL#2", "INT#5.5", "16#G", "T#5"])
def test_what_is_no_literal_is_refused_at_its_place(text):
    with pytest.raises(ListingError) as caught:
        number_of(token(text))
    assert (caught.value.line, caught.value.column) == (3, 5)


def test_functions_without_a_name_are_numbered_from_1():
    kind = next(iter(BLOCK_TYPES.values()))
    plain, scope = kind.name.removeprefix("Control"), Scope()
    names = [scope.new_function(kind, wanted, token("x")).name for wanted in (None, None, "Mine", "MINE", None)]
    assert names == [f"{plain}_1", f"{plain}_2", "Mine", f"{plain}_3", f"{plain}_4"]
