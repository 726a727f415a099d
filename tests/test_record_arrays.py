"""Objects of a run as an array of records, which compiled code works on, and back."""

from __future__ import annotations

from pidcfg.sim.compile import records, write_back
from pidcfg.sim.controllers.generic.state import State


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
