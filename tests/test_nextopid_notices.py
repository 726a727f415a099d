"""What a NextoPID says to an event that it cannot do: each of its reasons, at the loop that it concerns."""

from __future__ import annotations

import pytest

from nextopid_rig import GAINS, run
from pidcfg.sim.controllers.nextopid.operate import REASONS

LOOPS = f"""\
signals: {{Hand: false, Tune: false, Casc: false}}
loops:
  - {{name: PLAIN, type: PIDA_TUNE_REAL, SP: 50, {GAINS}}}
  - {{name: HAND, type: PIDA_TUNE_REAL, SP: 50, {GAINS}, Manual: Hand}}
  - {{name: CASC, type: PIDA_TUNE_REAL, SP: 50, {GAINS}, CASC: Casc}}
  - {{name: TUNE, type: PIDA_TUNE_REAL, SP: 50, {GAINS}, AutoTune: Tune}}
  - {{name: PID, type: PIDA_REAL, SP: 50, {GAINS}}}
  - {{name: SWITCH, type: ControlON_OFF, SP: 50, DeadBand: 1, MinPV: 0, MaxPV: 100}}
"""
SAID = [
    # loop, event, the reason's beginning, whether it is about a requested mode
    ("HAND", "mode: manual", "Manual is wired in the program", True),
    ("HAND", "mode: auto", "Manual is wired in the program", True),
    ("HAND", "mode: cascade", "Manual is wired in the program", True),
    ("CASC", "mode: auto", "CASC is wired in the program", True),
    ("CASC", "mode: cascade", "CASC is wired in the program", True),
    ("SWITCH", "mode: cascade", "ControlON_OFF has no cascade mode", True),
    ("PLAIN", "mode: tracking", "this mode comes about by itself", True),
    ("PLAIN", "mode: autotune", "this mode comes about by itself", True),
    ("TUNE", "autotune: start", "AutoTune is wired in the program", False),
    ("TUNE", "autotune: accept", "AutoTune is wired in the program", False),
    ("PID", "autotune: start", "this block has no auto-tuning", False),
    ("SWITCH", "autotune: start", "this block has no auto-tuning", False),
    ("PLAIN", "autotune: accept", "there are no results without error to accept", False),
]


@pytest.fixture(scope="module")
def report():
    """A run in which the events come one after the other, a second each."""
    loops = dict.fromkeys(loop for loop, *_ in SAID)
    plants = "".join(f"  {loop}: {{model: first_order, gain: 1, time_constant: 5}}\n" for loop in loops)
    events = "".join(f"  - {{at: {at}, loop: {row[0]}, {row[1]}}}\n" for at, row in enumerate(SAID, start=1))
    return run(LOOPS, f"duration: {len(SAID) + 2}\nplants:\n{plants}events:\n{events}")


@pytest.mark.parametrize("at", range(1, len(SAID) + 1), ids=[f"{row[0]} {row[1]}" for row in SAID])
def test_an_event_that_cannot_be_done_says_why(report, at):
    loop, _, text, about_mode = SAID[at - 1]
    found = report.loops[loop]
    reasons = [change.reason for change in found.modes if change.at == pytest.approx(at, abs=0.5) and change.reason]
    notes = [note.text for note in found.notes if note.at == pytest.approx(at, abs=0.5)]
    assert [said.startswith(text) for said in (reasons if about_mode else notes)] == [True]
    assert not (notes if about_mode else reasons)


def test_every_reason_is_said_once():
    assert {
        reason for reason in REASONS.values() if not any(reason.startswith(text) for _, _, text, _ in SAID)
    } == set()
    assert len({text for _, _, text, _ in SAID}) == len(REASONS)


def test_a_casc_that_is_wired_leaves_manual_free(report):
    assert report.loops["CASC"].modes[0].mode == "auto"
    found = run(
        LOOPS,
        "duration: 3\nevents: [{at: 1, loop: CASC, mode: manual}, {at: 1, loop: PLAIN, mode: cascade}]\n"
        "connect: {PLAIN.PV: 50, HAND.PV: 50, CASC.PV: 50, TUNE.PV: 50, PID.PV: 50, SWITCH.PV: 50}\n",
    )
    assert [change.mode for change in found.loops["CASC"].modes] == ["auto", "manual"]
    assert [change.mode for change in found.loops["PLAIN"].modes] == ["auto", "cascade"]
