"""Objects of a run as an array of records, which compiled code works on, and back."""

from __future__ import annotations

import math
from array import array
from collections.abc import MutableSequence
from dataclasses import astuple, fields
from typing import NamedTuple

import pytest

pytest.importorskip("numba")

from pidcfg.sim.controllers.generic.equation import State
from pidcfg.sim.controllers.kernels import single
from pidcfg.sim.engine.compile import Rows, call_on_arrays, native_single, record_array


def test_what_compiled_code_has_written_comes_back():
    states = Rows.from_objects([State(sp=1.5, status=2), State(sp=-3.0, due=1 << 40)])
    assert states.array["sp"].tolist() == [1.5, -3.0]
    assert states.array["due"].tolist() == [0, 1 << 40]

    states.array["sp"] += 1.0
    states.array["status"][1] = 7
    assert list(map(astuple, states)) == [
        astuple(State(sp=2.5, status=2)),
        astuple(State(sp=-2.0, due=1 << 40, status=7)),
    ]
    assert {type(state.sp) for state in states} | {type(state.due) for state in states} == {float, int}


def test_no_objects_are_an_array_without_rows():
    assert len(record_array([], State)) == 0


@pytest.mark.filterwarnings("ignore:overflow encountered in cast")
@pytest.mark.parametrize("value", [0.0, 0.1, -1 / 3, 16777217.0, 3.4028235677973366e38, 1e39, 1e-46, -math.inf])
def test_compiled_code_rounds_to_single_precision_as_python_does(value):
    assert native_single(value) == single(value)
    assert type(native_single(value)) is float


def doubled(k: int, values: MutableSequence[float], states: MutableSequence[State]) -> int:
    for i in range(len(values)):
        values[i] *= 2
        states[i]["sp"] += values[i]
    return k + len(values)


def test_a_function_of_arrays_is_called_with_what_lies_in_them():
    values, states = array("d", [1.0, 2.5]), Rows.from_objects([State(sp=1.0), State(sp=2.0)])
    assert call_on_arrays(doubled, doubled, {})(3, values, states) == 5
    assert (values.tolist(), [state.sp for state in states]) == ([2.0, 5.0], [3.0, 7.0])


def test_what_lies_in_no_array_is_refused_since_nobody_would_see_what_is_written():
    with pytest.raises(TypeError, match="lies in no array"):
        call_on_arrays(doubled, doubled, {})(3, [1.0], Rows.from_objects([State()]))


def test_objects_in_an_array_are_written_from_either_side():
    states = Rows.from_objects([State(sp=1.5, status=2), State(sp=-3.0, due=1 << 40)])
    assert call_on_arrays(doubled, doubled, {})(0, array("d", [0.25, 2.0]), states) == 2
    assert [state.sp for state in states] == [2.0, 1.0]
    assert states[1].due == 1 << 40

    states[0].sp = 8
    assert states.array["sp"].tolist() == [8.0, 1.0]
    assert type(states[0].sp) is float
    assert [f.name for f in fields(states[0])] == [f.name for f in fields(State)]


def test_copies_of_objects_in_an_array_lie_in_another():
    states = Rows.from_objects([State(sp=1.5)])
    more = Rows.from_objects(states)
    more[0].sp = 7.0
    assert (states[0].sp, more[0].sp) == (1.5, 7.0)
    assert Rows.from_objects([]) == []


class Pair(NamedTuple):
    values: MutableSequence[float]
    states: MutableSequence[State]


def raised(k: int, pair: Pair) -> int:
    for i in range(len(pair.states)):
        pair.states[i]["sp"] += pair.values[i]
    pair.values[0] = 7.0
    return k


def test_a_group_that_lies_in_arrays_has_the_same_ones_in_each_call():
    pair, call = Pair(array("d", [1.0]), Rows.from_objects([State(sp=1.0)])), call_on_arrays(raised, raised, {})
    call(0, pair)
    pair.values[0] = 3.0
    pair.states[0].sp = 20.0
    call(0, pair)
    assert (pair.states[0].sp, pair.values[0]) == (23.0, 7.0)

    other = Pair(array("d", [5.0]), Rows.from_objects([State()]))
    call(0, other)
    assert (pair.states[0].sp, other.states[0].sp) == (23.0, 5.0)
