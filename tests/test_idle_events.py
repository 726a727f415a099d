"""Which events of a scenario change nothing: what each kind writes is looked at in the order of time."""

from __future__ import annotations

import pytest

from pidcfg.sim.engine.events import idle_events
from pidcfg.sim.engine.run import prepare
from scenario_rig import Controller, scenario

WIRED = """\
signals: {load: 5}
plants:
  A: {model: first_order, gain: 2, time_constant: 3}
  B: {model: dead_time}
"""
EVENTS = [
    # events, each with whether it changes anything
    ["loop: A, set: {setpoint: 50} -", "loop: A, set: {setpoint: 51} +", "loop: A, set: {setpoint: 50} +"],
    ["loop: A, set: {setpoint: 51} +", "loop: A, set: {setpoint: 51} -", "loop: B, set: {setpoint: 51} +"],
    ["loop: A, set: {setpoint: 50, gain: 2} -", "loop: A, set: {setpoint: 50, gain: 3} +"],
    ["loop: A, set: {gain: 3, setpoint: 50} +", "loop: A, set: {gain: 3} -"],
    ["loop: A, disturb: {gain: 2} -", "loop: A, disturb: {gain: 3} +", "loop: A, disturb: {gain: 3} -"],
    ["loop: A, disturb: {gain: 2, load: 1} +", "loop: A, disturb: {load: 1} -", "loop: B, disturb: {gain: 2} +"],
    ["set: {load: 5} -", "set: {load: 6} +", "set: {load: 6} -"],
    ["loop: A, pv: 3 +", "loop: A, set: {setpoint: 50} +", "loop: B, set: {setpoint: 50} -"],
    ["loop: A, mode: auto +", "loop: A, set: {setpoint: 50} +", "loop: B, set: {setpoint: 50} -"],
    ["loop: A, autotune: start +", "loop: A, set: {gain: 2} +", "loop: B, set: {gain: 2} -"],
    ["plc: run -", "loop: A, set: {setpoint: 50} -", "plc: program +", "loop: A, set: {setpoint: 50} +"],
    ["plc: program +", "plc: program -", "plc: run +", "plc: run -", "loop: B, set: {setpoint: 50} +"],
]


def shown():
    """A PLC whose signals show the set points that its loops have."""
    plc = Controller.load()
    for c, s in zip(plc.cfg, plc.st, strict=True):
        plc.sig[c.sig_sp] = s.sp
    return plc


@pytest.mark.parametrize("events", EVENTS, ids=[" / ".join(row) for row in EVENTS])
def test_an_event_that_writes_what_is_there_changes_nothing(events):
    rows = [(at, event[:-2], event[-1] == "-") for at, event in enumerate(events, 1)]
    text = "".join(f"  - {{at: {at}, {event}}}\n" for at, event, _ in reversed(rows))
    read = scenario(f"{WIRED}events:\n{text}")
    net = prepare(read, shown())
    assert not net.problems

    assert [float(event.at) for event in idle_events(read, shown, net)] == [at for at, _, idle in rows if idle]
