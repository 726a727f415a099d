"""Records: frozen ones, flat ones, and arrays of them."""

from __future__ import annotations

import copy
import pickle
import sys
from dataclasses import FrozenInstanceError, dataclass, field, fields, replace
from functools import cached_property
from importlib import import_module
from inspect import signature

import pytest

from pidcfg.encoders.maps import click, dl06, dpide, ezlogix, generic
from pidcfg.sim.controllers.kernels import read_registers, register, register_values, registers
from pidcfg.text.frozen import frozen

# --- Fields of records that name the register they are made of --------------------------------------------------------

KNOWN = {
    "dl06": set(dl06.LOOP_TABLE.paths()),
    "click": {word.name for table in click.TABLES for word in table.words},
    "ezlogix": {word.name for table in (ezlogix.R_BLOCK, ezlogix.S_BLOCK) for word in table.words}
    | {"action", "algorithm"},  # the dialog's
    "dpide": set(dpide.ROWS),
    "generic": set(generic.ROWS),
}
"""Every register, or parameter, by the name that a vendor's records use."""


@pytest.mark.parametrize("vendor", KNOWN)
@pytest.mark.parametrize("record", ["Config", "State"])
def test_every_register_that_a_field_names_exists(vendor, record):
    rows = list(registers(getattr(import_module(f"pidcfg.sim.controllers.{vendor}.equation"), record)))

    assert {row.name for row in rows} | {row.enabled_by for row in rows} <= KNOWN[vendor] | {None}
    assert rows or record == "State"


@dataclass(slots=True)
class Record:
    gain: float = register("gain", 1.0)
    whole: int = register("count", 0)
    limit: float = register("limit", 99.0, enabled_by="limited")
    reverse: int = register("action", 0, equals="reverse")
    worked_out: float = 7.0


def test_registers_fill_their_fields_and_what_has_no_register_stays():
    record = Record(worked_out=3.0)
    read_registers(record, {"gain": 2, "count": 4.0, "limit": 5.0, "limited": True, "action": "reverse"})

    assert record == Record(2.0, 4, 5.0, 1, 3.0)
    assert [type(value) for value in (record.gain, record.whole)] == [float, int]
    assert register_values(record) == {"gain": 2.0, "count": 4, "limit": 5.0, "action": 1}


def test_a_register_without_a_value_or_that_is_not_enabled_leaves_the_default():
    record = Record(5.0, 5, 5.0, 1)
    read_registers(record, {"limit": 5.0, "limited": False, "action": "direct"})

    assert record == Record(1.0, 0, 99.0, 0)


def test_numbers_are_rounded_as_the_vendor_holds_them():
    record = Record()
    read_registers(record, {"gain": 2.6, "limited": 0}, round)

    assert record.gain == 3


# --- A frozen record is a data class with the same fields: whatever can be asked of one, the other answers alike ------


class Rows:
    """The texts of classes that both kinds are made of."""

    word: int
    name: str = "gain"
    seen: list = field(default_factory=list)
    place: dict = field(init=False, compare=False, default_factory=dict)
    note: str = field(default="", repr=False, compare=False)

    def __post_init__(self):
        self.place[self.name] = self.word

    @property
    def twice(self):
        """Something that a class works out."""
        return 2 * self.word


def made(decorate, base, name, *, slots=True):
    """A class with the body of another one, which pickling finds in this module."""
    body = {key: value for key, value in vars(base).items() if key not in {"__dict__", "__weakref__"}}
    if not slots:
        body["kept"] = cached_property(lambda self: [self.word])
        body["kept"].__set_name__(None, "kept")
    cls = decorate(type(name, (), body | {"__qualname__": name, "__module__": __name__}))
    setattr(sys.modules[__name__], name, cls)
    return cls


OURS = made(frozen, Rows, "Ours")
THEIRS = made(dataclass(frozen=True, slots=True), Rows, "Theirs")
KEPT = made(frozen, Rows, "Kept", slots=False)


@frozen
class Wider(OURS):
    """A record that begins with the fields of another one."""

    unit: str = "s"


ARGUMENTS = ([1], [1, "reset"], [1, "reset", [2]], [1, "reset", [2], "a note"])


def pickled(record):
    """A record after the way to another process."""
    return pickle.loads(pickle.dumps(record))  # noqa: S301 - its own bytes


def said(record):
    """A record as text, without the name of its class."""
    return repr(record).partition("(")[2]


@pytest.mark.parametrize("given", ARGUMENTS)
def test_what_a_record_says_and_gives_is_that_of_a_data_class(given):
    ours, theirs = OURS(*given), THEIRS(*given)
    assert said(ours) == said(theirs)
    assert [getattr(ours, f.name) for f in fields(ours)] == [getattr(theirs, f.name) for f in fields(theirs)]
    assert (ours.place, ours.twice) == (theirs.place, theirs.twice)
    assert said(replace(ours, word=7)) == said(replace(theirs, word=7))
    for copied in (copy.copy(ours), copy.deepcopy(ours), pickled(ours)):
        assert copied == ours
        assert said(copied) == said(ours)


def test_records_are_equal_by_the_fields_that_are_compared():
    assert OURS(1, note="a") == OURS(1, note="b")
    assert OURS(1) != OURS(2)
    assert OURS(1) != THEIRS(1)
    assert OURS(1) != Wider(1)
    assert hash(OURS(1, "a", ())) == hash(OURS(1, "a", (), note="b"))
    assert len({OURS(1, "a", ()), OURS(1, "a", ()), OURS(2, "a", ())}) == 2
    with pytest.raises(TypeError, match="unhashable"):
        hash(OURS(1))


def test_each_record_has_its_own_values_where_they_are_made_anew():
    assert OURS(1).seen is not OURS(1).seen


@pytest.mark.parametrize("cls", [OURS, KEPT, Wider])
def test_a_record_cannot_be_changed(cls):
    record = cls(1)
    for name in ("word", "other"):
        with pytest.raises(FrozenInstanceError, match=f"cannot assign to field '{name}'"):
            setattr(record, name, 2)
    with pytest.raises(FrozenInstanceError, match="cannot delete field 'word'"):
        del record.word
    assert record.word == 1


@pytest.mark.parametrize("given", [[], [1, "a", [], "", 5]])
def test_a_call_with_too_few_or_too_many_values_is_refused(given):
    with pytest.raises(TypeError):
        OURS(*given)


def test_the_signature_is_that_of_a_data_class():
    assert str(signature(OURS)) == str(signature(THEIRS))
    assert OURS.__match_args__ == THEIRS.__match_args__
    assert OURS.__slots__ == THEIRS.__slots__


def test_a_record_with_a_cached_property_keeps_what_it_works_out():
    record = KEPT(3)
    assert record.kept is record.kept
    assert pickled(record) == record


def test_a_derived_record_has_the_fields_of_both():
    assert said(Wider(1, unit="min")) == "word=1, name='gain', seen=[], place={'gain': 1}, unit='min')"
    assert pickled(Wider(1, unit="min")).unit == "min"


def test_methods_that_a_class_has_stay():
    @frozen
    class Named:
        """A record that is known by its name in any case."""

        name: str

        def __eq__(self, other):
            return self.name.lower() == other.name.lower()

        def __hash__(self):
            return 7

        def __repr__(self):
            return self.name

    assert Named("a") == Named("A")
    assert (hash(Named("a")), repr(Named("a"))) == (7, "a")
