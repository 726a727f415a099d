"""A frozen record is a data class with the same fields: whatever can be asked of one, the other answers alike."""

import copy
import pickle
import sys
from dataclasses import FrozenInstanceError, dataclass, field, fields, replace
from functools import cached_property
from inspect import signature

import pytest

from pidcfg.text.frozen import frozen


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
