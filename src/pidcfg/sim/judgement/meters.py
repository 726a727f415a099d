"""What is counted about a loop while it runs: meters, swings, and how well it did."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

# --- What is counted about a loop while it runs, so that verdicts need nothing but numbers that a kernel keeps --------
#
# Design. A `Meter` a loop. What depends on the loop's status (time in Auto or Cascade, time in alarm, every mode and
# flag that there was) is counted when the status changes, and costs nothing between. What depends on its signals is
# looked at at each base step, swings of the PV (`pidcfg.sim.judgement.meters`) from the last event before the last
# third on.
# The journal lists the same happenings for people; no verdict reads it, so that a batch of runs without a journal is
# judged alike.

NEVER = 1 << 62
"""A base step that no run reaches."""


@dataclass(slots=True)
class Meter:
    """What is known about one loop so far; ``pv``, ``sp``, ``out`` are signals, times are base steps (−1: not yet)."""

    pv: int
    sp: int
    out: int
    status: int = -1
    aux_status: int = -1
    iae: float = 0.0
    ise: float = 0.0
    itae: float = 0.0
    """Sums over base steps in Auto or Cascade: the integrals are these times dt, and times dt² for ``itae``."""
    variation: float = 0.0
    last_out: float = 0.0
    last_sp: float = 0.0
    pv_low: float = 0.0
    pv_high: float = 0.0
    sp_low: float = 0.0
    sp_high: float = 0.0
    out_low: float = 0.0
    out_high: float = 0.0
    event_at: int = -1
    step_until: int = NEVER
    """The next event that moves the loop, up to which the answer to its step is measured."""
    sp_before: float = 0.0
    sp_after: float = 0.0
    has_step: int = 0
    locked_until: int = 0
    """Until this base step the new set point may still be limited by the controller."""
    peak_low: float = 0.0
    peak_high: float = 0.0
    rise_from: int = -1
    rise_to: int = -1
    # modes
    control_bits: int = 0
    """The bits of ``status`` that mean Auto or Cascade."""
    in_control: int = 0
    """Whether one of them is on."""
    control_since: int = 0
    """When that changed last."""
    control_steps: int = 0
    """Base steps in Auto or Cascade, up to the last change."""
    wanted_bits: int = 0
    """The mode bits that are to be reached; 0: the loop is meant for none of ``control_bits``."""
    wanted_since: int = 0
    bits_since_wanted: int = 0
    """Every status bit since the mode was wanted."""
    left_at: int = -1
    """When a loop that was in its wanted mode left it last."""
    missed_at: int = -1
    """When a wanted mode that had not been reached was given up for another."""
    all_status: int = 0
    """Every status bit of the run, and every auxiliary one."""
    all_aux: int = 0
    # how close to the set point, while in Auto or Cascade
    band: float = 0.0
    """How far from its set point the PV may come to rest, with its noise and the ripple of its pulses."""
    last_outside: int = -1
    """When it was further away last."""
    sp_moved_at: int = 0
    """When the set point was last more than ``band`` from ``sp_anchor``, which it then became."""
    sp_anchor: float = 0.0
    reached_at: int = -1
    """When the PV had come 63 % of the way to the last new set point."""
    step_error: float = 0.0
    """|new set point - PV| since then, where it is more than ``band``, summed over base steps."""
    # alarms of the outermost kind, with the sensor sound, once there was none
    outer_bits: int = 0
    level_bits: int = 0
    """Those of them that count in Manual, too: of the PV alone."""
    armed: int = 0
    """There was none before: a cold start is over."""
    sensor_broken: int = 0
    """The loop's sensor is broken by an event."""
    blind_from: int = -1
    """The time in Auto or Cascade at which it broke for good; −1: it has not, or has been repaired."""
    blind_steps: int = 0
    """Base steps in Auto or Cascade with a sensor that had broken for good, up to its repair."""
    cut_from: int = -1
    """The time in Auto or Cascade at which a plant lost its gain, so that nothing moves the PV; −1: it has one."""
    in_alarm: int = 0
    alarm_since: int = 0
    alarm_steps: int = 0
    past_alarms: int = 0
    """The bits of those that came."""
    # the end of the run, and of what comes before an event
    watch_from: int = NEVER
    """From here on the loop is looked at."""
    window_start: int = NEVER
    """Where the error begins to be summed up, for whether it gets smaller."""
    window_middle: int = NEVER
    """Where the second half of that begins."""
    last_third: int = NEVER
    """Where the last third begins."""
    last_third_status: int = 0
    """Every status bit of the last third, and every auxiliary one."""
    last_third_aux: int = 0
    early_error: float = 0.0
    """The sum of the error over the first half of the window, and over the second."""
    final_error: float = 0.0
    early_sp: float = 0.0
    """The same of the set point."""
    final_sp: float = 0.0
    error_sign: int = 0
    """The set point is above the PV (1) or below it (−1); 0: it has not been looked at yet."""
    sign_since: int = 0
    """From when on."""
    # swings of the PV: in the last third, and since the last event
    swings_from: int = NEVER
    """From here on they are looked at."""
    min_swing: float = 0.0
    """A move of the PV that is no larger is no swing."""
    direction: int = 1
    """The PV rises (1) or falls (−1)."""
    extreme: float = 0.0
    extreme_at: int = -1
    turn_value: float = 0.0
    last_turn: int = 0
    turn_before: int = 0
    """The turning point before the last one."""
    last_swing: float = 0.0
    turns: int = 0
    """Turning points of the last third, the first of which may be none: the run was cut there."""
    first_turn: int = 0
    first_swing: float = 0.0
    swing_sum: float = 0.0
    """The sum of all."""
    shortest_period: int = 0
    """Base steps of the shortest whole period, and of the longest."""
    longest_period: int = 0
    calm_turns: int = 0
    """The same since the last event, also from before the last third."""
    calm_first_turn: int = 0
    calm_first_swing: float = 0.0
    calm_swing_sum: float = 0.0
    calm_shortest_period: int = 0
    calm_longest_period: int = 0
    growing_swings: int = 0
    """Swings in a row each of which was larger than the one before, up to the last one."""
    max_growing_swings: int = 0
    """The most of them since the last event."""
    widest_swing: float = 0.0
    """The largest swing since the last event."""


@dataclass(slots=True)
class Onset:
    """When a bit of a loop's status came on for the first time (−1: not yet)."""

    loop: int
    bit: int
    first: int = -1


@dataclass(slots=True)
class Benefit:
    """What a loop does, and what its plant would do with the loop's output held, against one set point."""

    loop: int
    slot: int
    """The signal that its sensor shows, in both networks."""
    margin: float = 0.0
    """What of an error is noise."""
    error: float = 0.0
    """The sums of the errors over the base steps in Auto or Cascade with a sound sensor."""
    held_error: float = 0.0
    widest_error: float = 0.0
    """The largest error with the output held."""


def change_status(k: int, m: Meter, status: int, aux_status: int) -> None:
    """A loop's status has changed with base step ``k`` (kernel)."""
    if m.status & m.wanted_bits and m.status > 0 and status & m.wanted_bits == 0:
        m.left_at = k
    m.status = status
    m.aux_status = aux_status
    m.bits_since_wanted |= status
    m.all_status |= status
    m.all_aux |= aux_status
    if k >= m.last_third:
        m.last_third_status |= status
        m.last_third_aux |= aux_status
    control = 1 if status & m.control_bits else 0
    if control != m.in_control:
        if m.in_control == 1:
            m.control_steps += k - m.control_since
        m.in_control = control
        m.control_since = k
        if control == 1:
            m.armed = 0
    count_alarm(k, m)


def note_onsets(k: int, loop: int, status: int, onsets: Sequence[Onset]) -> None:
    """Bits that somebody waits for, with a loop's new status at base step ``k`` (kernel)."""
    for i in range(len(onsets)):
        onset = onsets[i]
        if onset.loop == loop and onset.first < 0 and status & onset.bit:
            onset.first = k


def count_alarm(k: int, m: Meter) -> None:
    """An alarm of the outermost kind has come or gone, or no longer counts (kernel)."""
    wanted = m.outer_bits if m.in_control == 1 else m.level_bits
    bits = m.status & wanted if m.sensor_broken == 0 and m.status > 0 else 0
    if bits == 0 and m.status > 0:
        m.armed = 1
    if m.armed == 0:
        bits = 0
    m.past_alarms |= bits
    alarm = 1 if bits else 0
    if alarm != m.in_alarm:
        if m.in_alarm == 1:
            m.alarm_steps += k - m.alarm_since
        m.in_alarm = alarm
        m.alarm_since = k


def watch_end(k: int, m: Meter, pv: float, sp: float) -> None:
    """What only the end of a run, or of a part of it, tells: the error in a window, and swings of the PV (kernel)."""
    if sp > pv:
        if m.error_sign <= 0:
            m.error_sign = 1
            m.sign_since = k
    elif m.error_sign >= 0:
        m.error_sign = -1
        m.sign_since = k
    if k >= m.window_middle:
        m.final_error += sp - pv
        m.final_sp += sp
    elif k >= m.window_start:
        m.early_error += sp - pv
        m.early_sp += sp
    if k == m.last_third:
        m.last_third_status |= m.status
        m.last_third_aux |= m.aux_status


# --- between two segments, and at the end ----------------------------------------------------------------------------


def want_mode(m: Meter, k: int, bits: int, grace: int) -> None:
    """Another mode is wanted from base step ``k`` on.

    The one before is missed if it had not been reached in more than ``grace`` base steps.
    """
    if m.wanted_bits and not m.bits_since_wanted & m.wanted_bits and m.missed_at < 0 and k - m.wanted_since > grace:
        m.missed_at = k
    m.wanted_bits = bits & m.control_bits
    m.wanted_since = k
    m.bits_since_wanted = max(m.status, 0)
    m.left_at = -1


def time_in_control(m: Meter, last: int) -> int:
    """Base steps in Auto or Cascade, of those up to ``last``."""
    return m.control_steps + (last - m.control_since if m.in_control else 0)


def break_sensor(m: Meter, k: int, *, for_good: bool) -> None:
    """A loop's sensor breaks at base step ``k``; if it was broken before, it is otherwise from now on."""
    repair_sensor(m, k)
    m.sensor_broken = 1
    m.blind_from = time_in_control(m, k) if for_good else -1
    count_alarm(k, m)


def repair_sensor(m: Meter, k: int) -> None:
    """A loop's sensor is sound again."""
    if m.blind_from >= 0:
        m.blind_steps += time_in_control(m, k) - m.blind_from
    m.sensor_broken, m.blind_from = 0, -1
    count_alarm(k, m)


def time_blind(m: Meter, last: int) -> int:
    """Base steps in Auto or Cascade with a sensor that had broken for good, of those up to ``last``."""
    return m.blind_steps + (time_in_control(m, last) - m.blind_from if m.blind_from >= 0 else 0)


def cut_off(m: Meter, k: int, *, is_cut: bool) -> None:
    """From base step ``k`` on nothing moves a loop's PV, or something does again."""
    if not is_cut:
        m.cut_from = -1
    elif m.cut_from < 0:
        m.cut_from = time_in_control(m, k)


def time_cut(m: Meter, last: int) -> int:
    """Base steps in Auto or Cascade, of those up to ``last``, since nothing moves the PV any more."""
    return time_in_control(m, last) - m.cut_from if m.cut_from >= 0 else 0


def time_in_alarm(m: Meter, last: int) -> int:
    """Base steps in an alarm of the outermost kind, of those up to ``last``."""
    return m.alarm_steps + (last - m.alarm_since if m.in_alarm else 0)


# --- Swings of a loop's PV: its turning points while it controls, and what makes an oscillation of them ---------------
#
# Design. Two counts run side by side: one over the last third of the run, which the metrics tell, and one since the
# last event that moves the loop, so that what an event stirs up is not taken for what the loop does by itself.

GROWTH_FACTOR = 1.1
"""Times the swing before: one that is larger grows."""
MIN_GROWING_SWINGS = 3
"""Swings in a row that grow, and make an oscillation however few there are."""
MIN_PERIODS = 3
"""Whole periods that make an oscillation."""
MAX_PERIOD_RATIO = 2
"""Times the shortest period that the longest one may last: what noise stirs up is less even."""
TIME_CONSTANT_SHARE = 0.632
"""Of a step: what a first-order lag has gone of it after its time constant."""
SUSTAINED_SHARE = 0.8
"""Of the first swing that the last one must have."""


def watch_swings(k: int, m: Meter, pv: float) -> None:
    """The PV's turning points while the loop controls (kernel)."""
    if m.in_control == 0 or m.extreme_at < 0:
        m.extreme = pv
        m.extreme_at = k
        m.turns = 0
        m.calm_turns = 0
    elif m.direction > 0:
        if pv > m.extreme:
            m.extreme = pv
            m.extreme_at = k
        elif m.extreme - pv > m.min_swing:
            note_turn(k, m, pv)
    elif pv < m.extreme:
        m.extreme = pv
        m.extreme_at = k
    elif pv - m.extreme > m.min_swing:
        note_turn(k, m, pv)


def note_turn(k: int, m: Meter, pv: float) -> None:
    """The PV has come so far from its last extreme that this was a turning point (kernel)."""
    before, swing = m.last_swing, abs(m.extreme - m.turn_value)
    period = m.extreme_at - m.turn_before
    m.last_swing = swing
    if m.extreme_at >= m.last_third:
        if m.turns == 0 and m.calm_turns > 0:
            m.turns = 1
        if m.turns == 1:
            m.first_turn = m.extreme_at
            m.swing_sum = 0.0
            m.shortest_period = NEVER
            m.longest_period = 0
        elif m.turns > 1:
            m.swing_sum += swing
            if m.turns == 2:
                m.first_swing = swing
            else:
                m.shortest_period = min(m.shortest_period, period)
                m.longest_period = max(m.longest_period, period)
        m.turns += 1
    if m.calm_turns == 1:
        m.calm_first_turn = m.extreme_at
        m.calm_swing_sum = 0.0
        m.widest_swing = 0.0
        m.calm_shortest_period = NEVER
        m.calm_longest_period = 0
    elif m.calm_turns > 1:
        m.calm_swing_sum += swing
        m.widest_swing = max(m.widest_swing, swing)
        if m.calm_turns == 2:
            m.calm_first_swing = swing
            m.growing_swings = 0
            m.max_growing_swings = 0
        else:
            m.calm_shortest_period = min(m.calm_shortest_period, period)
            m.calm_longest_period = max(m.calm_longest_period, period)
            m.growing_swings = m.growing_swings + 1 if swing > GROWTH_FACTOR * before else 0
            m.max_growing_swings = max(m.max_growing_swings, m.growing_swings)
    m.calm_turns += 1
    m.turn_value = m.extreme
    m.turn_before = m.last_turn
    m.last_turn = m.extreme_at
    m.direction = -m.direction
    m.extreme = pv
    m.extreme_at = k


# --- between two segments, and at the end ----------------------------------------------------------------------------


def oscillation(m: Meter, last: int) -> tuple[float, float] | None:
    """Period in base steps and amplitude (half peak to peak) of a sustained oscillation in the last third."""
    halves = m.turns - 2
    if (
        halves < 2 * MIN_PERIODS
        or m.last_swing < SUSTAINED_SHARE * m.first_swing
        or m.longest_period > MAX_PERIOD_RATIO * m.shortest_period
    ):
        return None
    period = 2 * (m.last_turn - m.first_turn) / halves
    return (period, m.swing_sum / halves / 2) if last - m.last_turn <= period else None


def calm_oscillation(m: Meter, k: int) -> tuple[float, float] | None:
    """The same of one since the last event, up to base step ``k``; one that grows need not have three periods."""
    halves = m.calm_turns - 2
    if halves < 2 * MIN_PERIODS and (halves < 1 or m.max_growing_swings < MIN_GROWING_SWINGS):
        return None
    if m.calm_longest_period > MAX_PERIOD_RATIO * m.calm_shortest_period:
        return None
    if m.last_swing < SUSTAINED_SHARE * (
        m.widest_swing if m.max_growing_swings >= MIN_GROWING_SWINGS else m.calm_first_swing
    ):
        return None
    period = 2 * (m.last_turn - m.calm_first_turn) / halves
    return (period, m.calm_swing_sum / halves / 2) if k - m.last_turn <= period else None


def begin_calm(m: Meter) -> None:
    """An event moves the loop: what swings after it, swings anew."""
    m.calm_turns = 0


# --- How well a loop did, worked out on the way: memory does not grow with the length of a run ------------------------
#
# Integrals run over the time in Auto or Cascade; overshoot, settling time and rise time count from the last event
# that changed the set point while the loop was there, up to the next one that moves the loop, and are None when there
# was none (or when the loop never got there).

DEFAULT_BAND = 0.05
"""Share of the set-point step within which a loop counts as settled, unless an expectation says otherwise."""


@dataclass(slots=True)
class Band:
    """When a loop was last further from its new set point than ``share`` of the step."""

    loop: int
    share: float
    last_outside: int = -1


@dataclass(slots=True)
class Gauge:
    """The smallest and largest value of a signal from one base step up to another."""

    slot: int
    low: float = 1e300
    high: float = -1e300
    first: int = 0
    last: int = NEVER


def measure_loop(k: int, m: Meter, signals: Sequence[float]) -> None:
    """One loop's signals at base step ``k``, which stand for the time up to the next (kernel)."""
    pv, sp, out = signals[m.pv], signals[m.sp], signals[m.out]
    if m.in_control == 1:
        if sp != pv:
            e = abs(sp - pv)
            m.iae += e
            m.ise += e * e
            m.itae += e * k
            if e > m.band:
                m.last_outside = k
        if m.event_at >= 0 and k < m.step_until:
            if pv > m.peak_high:
                m.peak_high = pv
            elif pv < m.peak_low:
                m.peak_low = pv
            if m.rise_to < 0 or k <= m.locked_until:
                follow_step(k, m, pv, sp)
            if m.has_step == 1 and abs(m.sp_after - pv) > m.band:
                m.step_error += abs(m.sp_after - pv)
    if out != m.last_out:
        m.variation += abs(out - m.last_out)
        m.last_out = out
        if out > m.out_high:
            m.out_high = out
        elif out < m.out_low:
            m.out_low = out
    if pv > m.pv_high:
        m.pv_high = pv
    elif pv < m.pv_low:
        m.pv_low = pv
    if sp != m.last_sp:
        m.last_sp = sp
        if abs(sp - m.sp_anchor) > m.band:
            m.sp_anchor = sp
            m.sp_moved_at = k
        if sp > m.sp_high:
            m.sp_high = sp
        elif sp < m.sp_low:
            m.sp_low = sp
    if k >= m.watch_from:
        watch_end(k, m, pv, sp)
    if k >= m.swings_from:
        watch_swings(k, m, pv)


def follow_step(k: int, m: Meter, pv: float, sp: float) -> None:
    """The answer to the last set-point event: what it is, and when the PV passed 10 % and 90 % of it (kernel)."""
    if (m.has_step == 0 or k <= m.locked_until) and sp != m.sp_before:
        m.has_step = 1
        m.sp_after = sp
    if m.has_step == 1 and m.rise_to < 0:
        share = (pv - m.sp_before) / (m.sp_after - m.sp_before)
        if share >= 0.1 and m.rise_from < 0:
            m.rise_from = k
        if share >= TIME_CONSTANT_SHARE and m.reached_at < 0:
            m.reached_at = k
        if share >= 0.9:
            m.rise_to = k


def watch_bands(k: int, bands: Sequence[Band], meters: Sequence[Meter], signals: Sequence[float]) -> None:
    """Notes for every band whether the loop is outside now (kernel)."""
    for i in range(len(bands)):
        b = bands[i]
        m = meters[b.loop]
        if m.event_at >= 0 and m.in_control == 1 and k < m.step_until:
            after = m.sp_after
            if m.has_step == 0 or abs(signals[m.pv] - after) > b.share * abs(after - m.sp_before):
                b.last_outside = k


def read_gauges(k: int, gauges: Sequence[Gauge], signals: Sequence[float]) -> None:
    """Smallest and largest values (kernel)."""
    for i in range(len(gauges)):
        g = gauges[i]
        value = signals[g.slot]
        if (value < g.low or value > g.high) and g.first <= k <= g.last:
            if value < g.low:
                g.low = value
            if value > g.high:
                g.high = value


def compare_errors(
    benefits: Sequence[Benefit], meters: Sequence[Meter], signals: Sequence[float], reference_signals: Sequence[float]
) -> None:
    """The error of each loop, and the one that there would be without it (kernel)."""
    for i in range(len(benefits)):
        r = benefits[i]
        m = meters[r.loop]
        if m.in_control == 1 and m.sensor_broken == 0:
            sp = signals[m.sp]
            error = abs(sp - signals[r.slot]) - r.margin
            if error > 0.0:
                r.error += error
            error = abs(sp - reference_signals[r.slot]) - r.margin
            if error > 0.0:
                r.held_error += error
                r.widest_error = max(r.widest_error, error)


def begin_meter(meter: Meter, signals: Sequence[float]) -> None:
    """What only makes sense from time 0 on starts with the signals as they stand there (kernel)."""
    meter.pv_low = meter.pv_high = signals[meter.pv]
    meter.sp_low = meter.sp_high = meter.last_sp = meter.sp_anchor = signals[meter.sp]
    meter.out_low = meter.out_high = meter.last_out = signals[meter.out]
    meter.variation = 0.0


def begin_step(meter: Meter, k: int, before: float, period: int, signals: Sequence[float]) -> None:
    """A set-point event at base step ``k``, ``before`` it and a sample ``period`` (in base steps) after it."""
    meter.event_at, meter.sp_before, meter.has_step, meter.locked_until, meter.step_until = (
        k,
        before,
        0,
        k + period,
        NEVER,
    )
    meter.peak_low = meter.peak_high = signals[meter.pv]
    meter.rise_from = meter.rise_to = meter.reached_at = -1
    meter.step_error = 0.0


def end_step(m: Meter, k: int) -> None:
    """Something else moves the loop at base step ``k``: what comes then is no answer to its step."""
    if 0 <= m.event_at < k:
        m.step_until = min(m.step_until, k)


def overshoot(m: Meter, band: Band) -> float | None:
    """How far the PV went past the new set point, in % of the step; None where an event came before it had settled."""
    if not m.has_step or band.last_outside == m.step_until - 1:
        return None
    size = m.sp_after - m.sp_before
    past = m.peak_high - m.sp_after if size > 0 else m.sp_after - m.peak_low
    return max(0.0, past / abs(size) * 100)


def rise_time(m: Meter, dt: float) -> float | None:
    """The time from 10 % to 90 % of the step, in s."""
    return None if m.rise_to < 0 else (m.rise_to - m.rise_from) * dt


def settling_time(m: Meter, band: Band, last: int, dt: float) -> float | None:
    """The time from the event until the PV stayed inside the band, in s.

    None when it was outside when the run ended, when the loop left Auto and Cascade, or when the next event came.
    """
    end = min(last if m.in_control else m.control_since - 1, m.step_until - 1)
    if not m.has_step or band.last_outside == end:
        return None
    return max(0, band.last_outside + 1 - m.event_at) * dt


def loop_metrics(m: Meter, band: Band, last: int, dt: float, signals: Sequence[float]) -> dict[str, float | None]:
    """All metrics of a loop by name, in the units of its PV and output; None: there was nothing to measure."""
    was_controlled = time_in_control(m, last) > 0
    swings = oscillation(m, last)
    return {
        "overshoot": overshoot(m, band),
        "settling_time": settling_time(m, band, last, dt),
        "rise_time": rise_time(m, dt),
        "iae": m.iae * dt if was_controlled else None,
        "ise": m.ise * dt if was_controlled else None,
        "itae": m.itae * dt * dt if was_controlled else None,
        "total_variation": m.variation,
        "final_error": signals[m.sp] - signals[m.pv] if m.in_control else None,
        "oscillation_period": None if swings is None else swings[0] * dt,
        "oscillation_amplitude": None if swings is None else swings[1],
    }


METRICS = (
    "overshoot",
    "settling_time",
    "rise_time",
    "iae",
    "ise",
    "itae",
    "total_variation",
    "final_error",
    "oscillation_period",
    "oscillation_amplitude",
)
"""In the order of the report."""
STEP_METRICS = ("overshoot", "settling_time", "rise_time")
"""Metrics of a step of the set point; the others need none."""
SWING_METRICS = ("oscillation_period", "oscillation_amplitude")
"""None when the PV does not swing."""
