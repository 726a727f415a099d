"""Objects of a run as an array of records, which compiled code works on, and back."""

from __future__ import annotations

import math
from collections.abc import MutableSequence  # noqa: TC003 - the annotations of `doubled` are read

import pytest

pytest.importorskip("numba")

from pidcfg.sim.controllers.generic.equation import State
from pidcfg.sim.controllers.kernels import single
from pidcfg.sim.engine.compile import native_single, on_lists, records, write_back


def test_what_compiled_code_has_written_comes_back():
    states = [State(sp=1.5, status=2), State(sp=-3.0, due=1 << 40)]
    rows = records(states, State)
    assert rows["sp"].tolist() == [1.5, -3.0]
    assert rows["due"].tolist() == [0, 1 << 40]

    rows["sp"] += 1.0
    rows["status"][1] = 7
    write_back(rows, states)
    assert states == [State(sp=2.5, status=2), State(sp=-2.0, due=1 << 40, status=7)]
    assert {type(state.sp) for state in states} | {type(state.due) for state in states} == {float, int}


def test_no_objects_are_an_array_without_rows():
    assert len(records([], State)) == 0


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


def test_a_function_of_arrays_is_called_with_lists_of_objects():
    values, states = [1.0, 2.5], [State(sp=1.0), State(sp=2.0)]
    assert on_lists(doubled, doubled, {})(3, values, states) == 5
    assert (values, [state.sp for state in states]) == ([2.0, 5.0], [3.0, 7.0])
