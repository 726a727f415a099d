"""``off-set-point``: a loop ends at its set point, or well on its way there.

A loop that is too sluggish for its run, has lost its integral, or has a deadband as wide as its range neither stands at
a limit nor swings; it just is not where it should be.
"""

from __future__ import annotations

from pidcfg.sim.meters import ripple
from pidcfg.sim.standing.evidence import COUNTS, Evidence, Judgement, unjudged
from pidcfg.sim.standing.saturation import exemption, saturated
from pidcfg.sim.standing.watch import noise_of

SHARE = 0.01
"""Of the span: an error up to this is at the set point, as it is for swings."""
NOISES = 6
"""Standard deviations of the noise of a PV that is at its set point."""
LEFT = 0.5
"""Of the error at the beginning of the window: a loop with less left is on its way."""


def off_set_point(e: Evidence, i: int) -> Judgement:
    """Judges one loop, by its error at the end and at the beginning of the window of ``saturated``."""
    m, plc = e.meters[i], e.plc
    error, then = e.error(i), m.error_then
    if error <= allowed_error(e, i) or error <= LEFT * then:
        return Judgement(passed=True, text="ends at its set point, or well on its way there")
    if plc.only_switches(i):
        return unjudged("its output is on or off")
    if plc.profile_step(m.late_aux):
        return unjudged("a profile moves its set point in the last third")
    if not saturated(e, i).passed:
        return unjudged("saturated says it")
    since = e.seconds(m.window)
    text = f"ends with an error of {error:.4g}, which was {then:.4g} at {since:g} s"
    why = exemption(e, i) or next((f"{text}: an event at {time:g} s" for time in e.events_on(i, m.window)), "")
    return unjudged(why) if why else Judgement(passed=False, text=text, at=since)


def allowed_error(e: Evidence, i: int) -> float:
    """An error of a loop that is at its set point: rounding, noise, and what its pulses make of the PV."""
    span = e.span(i)
    waves = ripple(e.meters[i]) if e.plc.pulse_cycle(i) else 0.0
    noise = NOISES * noise_of(e.scenario, e.plc, e.net, i)
    return max(SHARE * span, 2 * COUNTS * span / e.plc.scales[i][2], noise) + waves
