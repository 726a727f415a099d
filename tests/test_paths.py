"""Dotted keys: there and back, and what stands at them."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pidcfg.schemas.generic import Loop
from pidcfg.text.paths import dotted, given_fields, has_key, is_given, leaves, put, steps, value_at

KEYS = st.from_regex(r"[a-z_]+", fullmatch=True)
LOOP = Loop.model_validate(
    {
        "name": "TIC-101",
        "output_raises_pv": True,
        "sample_time": 1,
        "tuning": {"gain": 2},
        "pv": {"range": [0, 100]},
        "output": {"range": [0, 100]},
        "setpoint": {"limits": [10, 90]},
    }
)


@given(st.lists(st.one_of(KEYS, st.integers(0, 99)), max_size=5))
def test_a_path_comes_back_from_its_text(path):
    assert steps(dotted(path)) == tuple(path)


def test_only_numbers_are_indices():
    assert steps("x.²") == ("x", "²")
    assert steps("x.2") == ("x", 2)


@given(st.lists(KEYS, min_size=1, max_size=5), st.integers())
def test_what_is_put_is_found(path, value):
    data = {}
    put(data, path, value)
    assert value_at(data, path) == value
    assert has_key(data, path)


def test_sections_that_are_there_are_kept_and_items_of_lists_are_reached():
    data = {"a": {"b": 1}, "l": [{"x": 1}]}
    put(data, ("a", "c"), 2)
    put(data, ("l", 0, "x"), 3)
    assert data == {"a": {"b": 1, "c": 2}, "l": [{"x": 3}]}


def test_a_list_that_stands_where_a_section_belongs_gives_way():
    data = {"output": [1]}
    put(data, ("output", "unit"), "%")
    assert data == {"output": {"unit": "%"}}


@pytest.mark.parametrize("path", [("b",), ("a", "b"), ("l", 5), ("l", "x"), ("a", 0, "c")])
def test_where_there_is_nothing_there_is_none(path):
    data = {"a": None, "l": [1]}
    assert value_at(data, path) is None
    assert not has_key(data, path)


def test_models_are_walked_by_their_fields():
    assert value_at(LOOP, steps("setpoint.limits.1")) == 90
    assert value_at(LOOP, steps("setpoint.limits.2")) is None
    assert is_given(LOOP, ("tuning", "gain"))
    assert not is_given(LOOP, ("tuning", "integral_time"))
    assert [dotted(path) for path, _ in given_fields(LOOP)] == [
        "name",
        "output_raises_pv",
        "sample_time",
        "tuning.gain",
        "pv.range",
        "setpoint.limits",
        "output.range",
    ]


def test_a_key_that_is_dotted_itself_counts_as_several_and_its_path_is_as_written():
    data = {"tuning": {"gain": 2, "a.b": {}}, "alarms.pv": {"high": [1]}, 5: "x"}

    assert list(leaves(data)) == [
        (("tuning", "gain"), 2, ("tuning", "gain")),
        (("alarms", "pv", "high"), [1], ("alarms.pv", "high")),
        (("5",), "x", (5,)),
    ]
