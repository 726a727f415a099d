"""NextoPID's blocks beside the PID blocks, one at a time: the manual's figures, closed forms, edges of every error."""

from __future__ import annotations

import math
import random
import struct
from dataclasses import astuple
from itertools import pairwise
from pathlib import Path

import pytest

pytest.importorskip("numba")
import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from compile_rig import vector
from nextopid_blocks_rig import IN_FLOAT32, UNTOUCHED, Block, call
from pidcfg.sim.controllers import nextopid as block_decisions
from pidcfg.sim.controllers.kernels import single
from pidcfg.sim.controllers.nextopid import terms as slots
from pidcfg.sim.controllers.nextopid.terms import (
    AUTO_MODE,
    BAD_DEAD_BAND,
    BAD_PV_LIMITS,
    ERROR_BASE,
    LARGEST_RATIO,
    MANUAL_MODE,
    Config,
    State,
    lag_share,
)
from pidcfg.sim.engine.compile import Rows, compile_functions, record_array
from rig_plants import FirstOrder

MOST = 3.4e38
OUTPUTS = {
    "ControlON_OFF": "MV",
    "ControlPWM": "PWM",
    "ControlLowFilter": "OutVar",
    "ControlDelay": "OutVar",
    "ControlLag": "OutVar",
    "ControlDelayLag": "OutVar",
    "ControlLeadLag": "OutVar",
    "ControlSelectMax": "MV",
    "ControlSelectMin": "MV",
    "ControlSplitRange": "MV1",
}
FUNCTIONS = ("ControlSelectMax", "ControlSelectMin", "ControlSplitRange")
LAG = {"Gs": 2, "Offset": 20, "Tc": 10, "Init_OutVar": 20, "Min_OutVar": -1000, "Max_OutVar": 1000}
LEAD_LAG = {"G": 2, "Tlead": 4, "Tlag": 2, "Min_OutVar": -1000, "Max_OutVar": 1000}
ON_OFF = {"SP": 20, "PV": 20, "DeadBand": 3, "MaxPV": 100, "MinPV": 0}
PWM = {"MV": 36, "MaxMV": 100, "MinMV": 0, "Period": 10}
SPLIT = {"MV": 30, "SPLIT": 40, "Mode": 1}
GOOD = {
    "ControlON_OFF": ON_OFF,
    "ControlPWM": PWM,
    "ControlLowFilter": {"InVar": 3, "Tc": 0.5},
    "ControlDelay": {"InVar": 3, "DelayTime": 2},
    "ControlLag": {"InVar": 3} | LAG,
    "ControlDelayLag": {"InVar": 3, "DelayTime": 2} | LAG,
    "ControlLeadLag": {"InVar": 3} | LEAD_LAG,
    "ControlSplitRange": SPLIT,
}


def below(x):
    """The next smaller single-precision number."""
    return float(np.nextafter(np.float32(x), np.float32(-np.inf)))


def above(x):
    """The next larger one."""
    return float(np.nextafter(np.float32(x), np.float32(np.inf)))


# --- ControlON_OFF ---------------------------------------------------------------------------------------------------


def test_on_off_switches_where_figure_6_2_has_it():
    block = Block("ControlON_OFF", **ON_OFF)
    down, up = [20 - k / 10 for k in range(60)], [14 + k / 10 for k in range(100)]

    assert [pv for pv in down if block(PV=pv)["MV"]] == [pv for pv in down if pv < 17]
    assert [pv for pv in up if block(PV=pv)["MV"]] == [pv for pv in up if pv <= 23]
    assert [pv for pv in up[::-1] if block(PV=pv)["MV"]] == [pv for pv in up[::-1] if pv < 17]


@pytest.mark.parametrize(
    ("pv", "before", "reverse", "direct"),
    [
        (17, 0, 0, 0),
        (17, 1, 1, 1),
        (23, 0, 0, 0),
        (23, 1, 1, 1),
        (20, 0, 0, 0),
        (20, 1, 1, 1),
        (below(17), 0, 1, 0),
        (below(17), 1, 1, 0),
        (above(23), 0, 0, 1),
        (above(23), 1, 0, 1),
    ],
)
def test_on_off_acts_only_outside_its_dead_band(pv, before, reverse, direct):
    for key, expected in ((0, reverse), (1, direct)):
        block = Block("ControlON_OFF", **ON_OFF, Manual=1, ManualMV=before)
        assert block()["MV"] == before
        assert block(PV=pv, Manual=0, Direct=key)["MV"] == expected
        assert block.s.out == expected


def test_on_off_holds_at_an_error_of_0_with_a_dead_band_of_0():
    block = Block("ControlON_OFF", **ON_OFF | {"DeadBand": 0})

    assert [block(PV=pv)["MV"] for pv in (20, below(20), 20, above(20), 20)] == [0, 1, 1, 0, 0]
    assert block["ErrBits.DeadBand"] == 0
    assert block.s.status == AUTO_MODE


def test_on_off_in_manual_copies_its_manual_output_and_goes_on_from_it():
    block = Block("ControlON_OFF", **ON_OFF | {"PV": 50}, Manual=1, ManualMV=1)

    assert block()["MV"] == 1
    assert block.s.status == MANUAL_MODE
    assert block(ManualMV=0)["MV"] == 0
    assert block(ManualMV=1, Manual=0, PV=20)["MV"] == 0
    assert block.s.status == AUTO_MODE


@pytest.mark.parametrize(
    ("pv", "sp", "seen", "bits"),
    [
        (0, 100, (0, 100), []),
        (100, 0, (100, 0), []),
        (above(100), 50, (100, 50), ["PV_MaxPV"]),
        (below(0), 50, (0, 50), ["PV_MinPV"]),
        (50, above(100), (50, 100), ["SP_MaxPV"]),
        (50, below(0), (50, 0), ["SP_MinPV"]),
        (130, -7, (100, 0), ["PV_MaxPV", "SP_MinPV"]),
        (-7, 130, (0, 100), ["PV_MinPV", "SP_MaxPV"]),
    ],
)
def test_on_off_limits_pv_and_set_point_and_says_so(pv, sp, seen, bits):
    names = ["PV_MaxPV", "PV_MinPV", "SP_MaxPV", "SP_MinPV"]
    for manual in (0, 1):
        block = Block("ControlON_OFF", **ON_OFF, Manual=manual)(PV=pv, SP=sp)
        assert (block.s.pv, block.s.sp) == seen
        assert [name for name in names if block[f"WarnBits.{name}"]] == bits
        assert block.s.aux_status == sum(1 << names.index(name) for name in bits)
        assert not any(block(PV=50, SP=50)[f"WarnBits.{name}"] for name in names)


def test_on_off_compares_limited_values():
    assert Block("ControlON_OFF", **ON_OFF)(SP=104, PV=98)["MV"] == 0
    assert Block("ControlON_OFF", **ON_OFF)(SP=104, PV=96)["MV"] == 1


def test_on_off_calculates_the_error_in_single_precision():
    wide = {"SP": 2**24, "PV": -1, "MaxPV": 2**25, "MinPV": -(2**25)}

    assert Block("ControlON_OFF", **ON_OFF | wide)(DeadBand=2**24)["MV"] == 0
    assert Block("ControlON_OFF", **ON_OFF | wide)(DeadBand=2**24 - 1)["MV"] == 1


def test_on_off_has_both_error_bits_at_once():
    block = Block("ControlON_OFF", **ON_OFF)(MaxPV=-1, DeadBand=-1)

    assert (block["ErrBits.MaxMinPV"], block["ErrBits.DeadBand"]) == (1, 1)
    assert block.s.status == MANUAL_MODE | (BAD_PV_LIMITS | BAD_DEAD_BAND) * ERROR_BASE


def test_on_off_keeps_a_process_in_its_band():
    block, y, seen = Block("ControlON_OFF", **ON_OFF), 0.0, []
    for _ in range(3000):
        mv = block(PV=y)["MV"]
        y += (40.0 * mv - y) * -math.expm1(-0.1 / 10.0)
        seen.append(y)

    assert 16.8 < min(seen[1000:]) < 17.0
    assert 23.0 < max(seen) < 23.3


# --- ControlPWM ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("mv", "on"), [(36, 4), (34, 3), (0, 0), (100, 10), (5, 0), (15, 2), (35, 4), (5.001, 1)])
def test_pulses_are_those_of_figure_7_2(mv, on):
    block = Block("ControlPWM", **PWM)

    assert [block(MV=mv)["PWM"] for _ in range(30)] == ([1] * on + [0] * (10 - on)) * 3
    assert (block["Error"], block["Warning"]) == (0, 0)


@pytest.mark.parametrize("period", [1, 2, 3, 7, 10, 100, 199])
@pytest.mark.parametrize(("low", "high"), [(0, 100), (-40, 60), (20, 27648)])
def test_every_duty_of_a_period_is_reached(period, low, high):
    block = Block("ControlPWM", MinMV=low, MaxMV=high, Period=period)
    for on in range(period + 1):
        mv = low + (high - low) * on / period
        assert [block(MV=mv)["PWM"] for _ in range(period)] == [1] * on + [0] * (period - on)


def test_mv_and_period_count_where_a_period_begins():
    block = Block("ControlPWM", **PWM)
    seen = [block(MV=30)["PWM"], *(block(MV=90, Period=4)["PWM"] for _ in range(9))]

    assert seen == [1, 1, 1, 0, 0, 0, 0, 0, 0, 0]
    assert [block()["PWM"] for _ in range(8)] == [1, 1, 1, 1] * 2


@pytest.mark.parametrize(
    ("mv", "warning", "on"),
    [
        (100, 0, 10),
        (above(100), 1, 10),
        (1e9, 1, 10),
        (0, 0, 0),
        (below(0), 1, 0),
        (-1e9, 1, 0),
    ],
)
def test_a_limited_mv_is_warned_of_in_every_cycle(mv, warning, on):
    block = Block("ControlPWM", **PWM)
    assert block()["Warning"] == 0
    assert block(MV=mv)["Warning"] == warning
    for _ in range(8):
        block()
    assert sum(block()["PWM"] for _ in range(10)) == on
    assert block(MV=50)["Warning"] == 0


@pytest.mark.parametrize(("low", "high"), [(-MOST, MOST), (0, 1e-45), (1, above(1))])
def test_the_widest_and_the_narrowest_range_make_pulses(low, high):
    block = Block("ControlPWM", MinMV=low, MaxMV=high, Period=10)
    assert block(MV=low)["PWM"] == 0
    assert block["Error"] == 0


def test_half_a_cycle_is_rounded_as_native_single_precision_has_it():
    rng = random.Random(4)
    seen = set()
    for _ in range(3000):
        low, width, period = np.float32(rng.uniform(-90, 90)), np.float32(rng.uniform(1, 300)), rng.randint(1, 300)
        high = low + width
        mv = low + width * np.float32((rng.randrange(period) + 0.5) / period)
        block = Block("ControlPWM", MV=mv, MinMV=low, MaxMV=high, Period=period)()
        clipped = min(max(mv, low), high)
        assert block.s.on_cycles == round(float((clipped - low) / (high - low) * np.float32(period)))
        seen.add(block.s.on_cycles % 2)
    assert seen == {0, 1}


@given(
    st.floats(-1e6, 1e6, width=32), st.floats(-1e6, 1e6, width=32), st.floats(-1e6, 1e6, width=32), st.integers(1, 300)
)
def test_the_share_of_pulses_is_the_share_of_the_range_to_half_a_cycle(a, b, mv, period):
    low, high = min(a, b), max(a, b)
    if low == high:
        return
    block = Block("ControlPWM", MinMV=low, MaxMV=high, Period=period)
    on = sum(block(MV=mv)["PWM"] for _ in range(period))

    share = (min(max(mv, low), high) - low) / (high - low)
    assert abs(on - share * period) <= 0.5 + 1e-4
    assert block["Warning"] == (not low <= mv <= high)


# --- ControlLowFilter, ControlLag, ControlLeadLag --------------------------------------------------------------------


def times(n, ts=0.1):
    return [k * ts for k in range(n)]


@pytest.mark.parametrize("tc", [0.5, 10, 300])
def test_the_filter_starts_at_its_input_and_follows_a_step_exactly(tc):
    block = Block("ControlLowFilter", Tc=tc)

    assert block.run("OutVar", "InVar", [7, 7, 7]) == [7, 7, 7]
    response = block.run("OutVar", "InVar", [17] * 600)
    assert response == pytest.approx([7 - 10 * math.expm1(-t / tc) for t in times(601)[1:]], abs=2e-4)


def test_the_filter_takes_most_of_a_fast_triangle_as_in_figure_8_2():
    block = Block("ControlLowFilter", Tc=0.5)
    seen = block.run("OutVar", "InVar", [50 + 5 * (-1) ** k for k in range(200)])

    assert max(seen[100:]) - min(seen[100:]) == pytest.approx(10 * math.tanh(0.1), rel=1e-4)
    assert sum(seen[100:]) / 100 == pytest.approx(50, abs=0.01)


def test_the_lag_has_the_step_response_of_figure_10_2():
    block = Block("ControlLag", **LAG)
    seen = block.run("OutVar", "InVar", [10] * 801)

    assert seen == pytest.approx([20 - 20 * math.expm1(-t / 10) for t in times(801)], abs=2e-4)
    assert seen[0] == 20
    assert seen[100] == pytest.approx(20 + 20 * 0.632121, abs=1e-4)
    assert block["SampleTime"] == single(0.1)


def test_the_lag_of_a_second_step_begins_with_the_call_that_sees_it():
    block = Block("ControlLag", **LAG | {"Offset": 0, "Init_OutVar": 0})
    assert block.run("OutVar", "InVar", [0] * 5) == [0] * 5
    assert block(InVar=10)["OutVar"] == pytest.approx(-20 * math.expm1(-0.01))


def test_a_negative_gain_falls():
    seen = Block("ControlLag", **LAG | {"Gs": -2}).run("OutVar", "InVar", [10] * 2000)
    assert seen == sorted(seen, reverse=True)
    assert seen[-1] == pytest.approx(0, abs=1e-3)


def test_the_lag_leaves_a_limit_at_once():
    block = Block("ControlLag", **LAG | {"Max_OutVar": 30, "Min_OutVar": 10})
    assert max(block.run("OutVar", "InVar", [100] * 200)) == 30
    assert block(InVar=0)["OutVar"] == pytest.approx(30 + 10 * math.expm1(-0.01))
    assert min(block.run("OutVar", "InVar", [-100] * 200)) == 10
    assert block(InVar=0)["OutVar"] == pytest.approx(10 - 10 * math.expm1(-0.01))


@pytest.mark.parametrize(
    ("kind", "key", "first"),
    [
        ("ControlLowFilter", "Tc", 0),
        ("ControlLag", "Tc", 0),
        ("ControlDelayLag", "Tc", 0),
        ("ControlLeadLag", "Tlag", 1),
    ],
)
def test_a_time_constant_counts_from_the_call_that_changes_it(kind, key, first):
    plain = {"InVar": 0, "DelayTime": 0, "Tlead": 0, "G": 1, "Gs": 1, "Offset": 0, "Init_OutVar": 0}
    block = Block(kind, **GOOD[kind] | {name: value for name, value in plain.items() if name in slots.OFFSETS[kind]})
    block()
    for tc in (10, 2, 2, 10, 0.5):
        y = block.s.lag_output
        seen = block(InVar=8, **{key: tc})["OutVar"]
        moved = y - (8 - y) * math.expm1(-0.1 / tc)
        assert block.s.lag_output == pytest.approx(moved, abs=1e-6)
        assert seen == pytest.approx(y if first else moved, abs=1e-6)


@pytest.mark.parametrize(("lead", "lag"), [(4, 2), (2, 4), (0, 3), (3, 3)], ids=["12-2", "12-3", "lag", "none"])
def test_the_lead_lag_has_the_step_responses_of_its_figures(lead, lag):
    block = Block("ControlLeadLag", **LEAD_LAG | {"Tlead": lead, "Tlag": lag})

    assert block.run("OutVar", "InVar", [5, 5, 5]) == [10, 10, 10]
    seen = block.run("OutVar", "InVar", [15] * 400)
    assert seen == pytest.approx([30 + 20 * (lead / lag - 1) * math.exp(-t / lag) for t in times(400)], abs=3e-4)
    assert seen[0] == pytest.approx(10 + 20 * lead / lag, rel=1e-6)


def test_the_lead_lag_limits_its_output_and_not_its_memory():
    free, held = (Block("ControlLeadLag", **LEAD_LAG | limits) for limits in ({}, {"Min_OutVar": 0, "Max_OutVar": 12}))
    inputs = [5, 5, *[15] * 50, *[2] * 50, *[-9] * 50]

    seen = held.run("OutVar", "InVar", inputs)
    assert seen == [min(max(y, 0), 12) for y in free.run("OutVar", "InVar", inputs)]
    assert {0, 12} < {*seen}
    assert held(Min_OutVar=14)["OutVar"] == 14


def test_a_disabled_lead_lag_gives_0_whatever_its_limits_and_goes_on_inside():
    on, off = (Block("ControlLeadLag", **LEAD_LAG | {"Min_OutVar": 5}) for _ in range(2))
    inputs = [5, 5, *[15] * 50]

    on.run("OutVar", "InVar", inputs)
    off.set(Disable=1)
    assert {*off.run("OutVar", "InVar", inputs)} == {0}
    assert off["Error"] == 0
    assert off(Disable=0)["OutVar"] == on()["OutVar"] > 30


# --- ControlDelay, ControlDelayLag -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("time", "samples"),
    [
        (0, 0),
        (0.04, 0),
        (0.06, 1),
        (0.1, 1),
        (0.25, 2),
        (0.35, 4),
        (0.3, 3),
        (2, 20),
        (2.04, 20),
        (2.06, 21),
        (9.9, 99),
        (10, 100),
    ],
)
def test_the_output_is_the_input_of_so_many_samples_ago(time, samples):
    block = Block("ControlDelay", DelayTime=time, InitDelayedVar=-5)
    ramp = [float(k) for k in range(1, 301)]

    assert block.run("OutVar", "InVar", ramp) == ([-5.0] * samples + ramp)[:300]
    assert (block["Error"], block["SampleTime"]) == (0, single(0.1))


def test_100_samples_of_any_task_are_allowed_and_half_a_sample_more_is_not():
    for ms in range(1, 3001):
        block = Block("ControlDelay", ts=ms / 1000, DelayTime=ms / 10)
        assert block()["Error"] == 0, ms
        assert block.s.samples == 100, ms
        assert block(DelayTime=ms / 10 * 1.000001)["Error"] == 1, ms
        assert Block("ControlDelayLag", ts=ms / 1000, DelayTime=ms / 10, **LAG)()["Error"] == 0, ms


@pytest.mark.parametrize(("before", "after"), [(2, 1), (1, 2), (0.3, 10), (10, 0.3), (2, 0), (0, 2)])
def test_a_changed_delay_holds_the_output_and_then_delays_again(before, after):
    block = Block("ControlDelay", DelayTime=before, InitDelayedVar=-5)
    ramp = [float(k) for k in range(1, 401)]
    old, new = round(before * 10), round(after * 10)

    held = block.run("OutVar", "InVar", ramp[:200])[-1]
    assert held == 200 - old
    block.set(DelayTime=after)
    assert block.run("OutVar", "InVar", ramp[200:]) == [held] * new + ramp[200 : 400 - new]


def test_a_change_of_less_than_a_sample_does_not_hold_the_output():
    block = Block("ControlDelay", DelayTime=1)
    block.run("OutVar", "InVar", range(50))
    block.set(DelayTime=1.04)
    assert block.run("OutVar", "InVar", range(50, 60)) == list(range(40, 50))


def test_a_delay_that_changes_while_it_holds_goes_on_holding():
    block = Block("ControlDelay", DelayTime=1)
    block.run("OutVar", "InVar", range(50))
    assert block(DelayTime=0.5, InVar=50)["OutVar"] == 39
    block.set(DelayTime=0.3)
    assert block.run("OutVar", "InVar", range(51, 57)) == [39, 39, 39, 51, 52, 53]


def test_delay_and_lag_have_the_step_response_of_figure_11_2():
    block = Block("ControlDelayLag", DelayTime=2, **LAG)
    seen = [*block.run("OutVar", "InVar", [0]), *block.run("OutVar", "InVar", [10] * 800)]

    assert seen[:21] == [20] * 21
    # the input rises at 0.1 s and comes out at 2.1 s
    assert seen[21:] == pytest.approx([20 - 20 * math.expm1(-t / 10) for t in times(781)[1:]], abs=2e-4)


def test_delay_and_lag_are_a_delay_before_a_lag():
    both = Block("ControlDelayLag", DelayTime=1.5, InitDelayedVar=4, **LAG)
    first = Block("ControlDelay", DelayTime=1.5, InitDelayedVar=4)
    second = Block("ControlLag", **LAG)
    rng = random.Random(5)
    for k in range(400):
        x = rng.uniform(-50, 50)
        if k == 200:
            both.set(DelayTime=0.7)
            first.set(DelayTime=0.7)
        assert both(InVar=x)["OutVar"] == second(InVar=first(InVar=x)["OutVar"])["OutVar"]


def test_a_process_of_blocks_goes_the_way_of_a_plant():
    block = Block("ControlDelayLag", DelayTime=1, **LAG)
    plant = FirstOrder(gain=2, time_constant=10, dead_time=1, initial=20, offset=20)
    rng = random.Random(8)
    assert block(InVar=0)["OutVar"] == plant.value
    for _ in range(500):
        u = rng.uniform(-50, 50)
        assert block(InVar=u)["OutVar"] == pytest.approx(plant.step(u, 0.1), abs=2e-4)


def test_the_places_of_a_delay_and_lag_are_those_of_delay_and_lag():
    both, one, other = (slots.OFFSETS[kind] for kind in ("ControlDelayLag", "ControlDelay", "ControlLag"))
    shift = both["Gs"] - other["Gs"]

    assert {name: both[name] for name in one if name in ("InVar", "DelayTime", "InitDelayedVar")} == {
        name: at for name, at in one.items() if at < 3
    }
    assert {name: both[name] - shift for name in other if name != "InVar"} == {
        name: at for name, at in other.items() if name != "InVar"
    }


# --- selectors -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("first", "second", "least", "most"),
    [
        (30, 40, (30, 0, 1), (40, 1, 0)),
        (40, 30, (30, 1, 0), (40, 0, 1)),
        (40, 40, (40, 1, 0), (40, 1, 0)),
        (-1, 1, (-1, 0, 1), (1, 1, 0)),
        (above(40), 40, (40, 1, 0), (above(40), 0, 1)),
    ],
)
def test_selectors_tell_the_other_controller_that_it_is_overridden(first, second, least, most):
    for kind, expected in (("ControlSelectMin", least), ("ControlSelectMax", most)):
        block = Block(kind, MV1=first, MV2=second)()
        assert (block["MV"], block["OVERR1"], block["OVERR2"]) == expected
    assert slots.OFFSETS["ControlSelectMin"] == slots.OFFSETS["ControlSelectMax"]


@given(st.floats(width=32, allow_nan=False), st.floats(width=32, allow_nan=False))
def test_one_of_two_is_selected_and_just_the_other_one_overridden(first, second):
    for kind, choice in (("ControlSelectMin", min), ("ControlSelectMax", max)):
        block = Block(kind, MV1=first, MV2=second)()
        assert block["MV"] == choice(first, second) == (second if block["OVERR1"] else first)
        assert block["OVERR1"] + block["OVERR2"] == 1


# --- ControlSplitRange -----------------------------------------------------------------------------------------------

CORNERS = {  # MV1 and MV2 at 0 %, at the split point and at 100 %
    1: ((0, 100), (100, 0), (100, 0)),
    2: ((0, 0), (100, 0), (100, 100)),
    3: ((0, 100), (100, 100), (100, 0)),
    4: ((100, 0), (0, 0), (0, 100)),
}


@pytest.mark.parametrize("point", [40, 50, 0.1, 99.9, 33.3])
@pytest.mark.parametrize("mode", CORNERS, ids=["15-2", "15-3", "15-4", "15-5"])
def test_a_ramp_is_split_as_in_the_figures(mode, point):
    block = Block("ControlSplitRange", SPLIT=point, Mode=mode)
    ends = [0.0, single(point), 100.0]
    for mv in [*(k / 4 for k in range(401)), single(point), below(point), above(point)]:
        block(MV=mv)
        expected = [np.interp(mv, ends, [corner[i] for corner in CORNERS[mode]]) for i in (0, 1)]
        assert [block["MV1"], block["MV2"]] == pytest.approx(expected, abs=2e-4 if 1 < point < 99 else 2e-2)
        assert block["Error"] == 0
    for mv, corner in zip(ends, CORNERS[mode], strict=True):
        assert (block(MV=mv)["MV1"], block["MV2"]) == corner


@given(st.floats(0, 100, width=32), st.floats(0, 100, width=32, exclude_min=True, exclude_max=True), st.integers(1, 4))
def test_split_outputs_stay_within_0_to_100(mv, point, mode):
    block = Block("ControlSplitRange", MV=mv, SPLIT=point, Mode=mode)()
    assert 0 <= block["MV1"] <= 100
    assert 0 <= block["MV2"] <= 100


def test_a_range_is_split_as_in_native_single_precision():
    rng = random.Random(6)
    full = np.float32(100)
    for _ in range(3000):
        mv, point = np.float32(rng.uniform(0, 100)), np.float32(rng.uniform(0, 100))
        low = mv / point * full if mv < point else full
        high = np.float32(0) if mv < point else (mv - point) / (full - point) * full
        wanted = {1: (low, full - low), 2: (low, high), 3: (low, full - high), 4: (full - low, high)}
        for mode, pair in wanted.items():
            block = Block("ControlSplitRange", MV=mv, SPLIT=point, Mode=mode)()
            assert (block["MV1"], block["MV2"]) == pair


# --- errors ----------------------------------------------------------------------------------------------------------

SMALLEST = 1e-45
EDGES = [
    # block, what is just allowed, what is just not
    ("ControlPWM", {"MaxMV": above(0)}, {"MaxMV": 0}),
    ("ControlPWM", {"MinMV": below(100)}, {"MinMV": 100}),
    ("ControlPWM", {}, {"MinMV": 101}),
    ("ControlPWM", {"Period": 1}, {"Period": 0}),
    ("ControlPWM", {"Period": 65535}, {"MaxMV": math.nan}),
    ("ControlLowFilter", {"Tc": SMALLEST}, {"Tc": 0}),
    ("ControlLowFilter", {"Tc": MOST}, {"Tc": -1}),
    ("ControlDelay", {"DelayTime": 0}, {"DelayTime": -SMALLEST}),
    ("ControlDelay", {"DelayTime": 10}, {"DelayTime": 10.00001}),
    ("ControlDelay", {}, {"DelayTime": math.nan}),
    ("ControlLag", {"Tc": SMALLEST}, {"Tc": 0}),
    ("ControlLag", {"Min_OutVar": 20, "Max_OutVar": 20}, {"Min_OutVar": 20, "Max_OutVar": below(20)}),
    ("ControlLag", {"Min_OutVar": 20}, {"Min_OutVar": above(20)}),
    ("ControlLag", {"Max_OutVar": 20}, {"Max_OutVar": below(20)}),
    ("ControlLag", {"Init_OutVar": 1000}, {"Init_OutVar": above(1000)}),
    ("ControlLag", {"Init_OutVar": -1000}, {"Init_OutVar": below(-1000)}),
    ("ControlDelayLag", {"DelayTime": 0}, {"DelayTime": -SMALLEST}),
    ("ControlDelayLag", {"DelayTime": 10}, {"DelayTime": 10.00001}),
    ("ControlDelayLag", {"Tc": SMALLEST}, {"Tc": 0}),
    ("ControlDelayLag", {"Min_OutVar": 20, "Max_OutVar": 20}, {"Min_OutVar": 20, "Max_OutVar": below(20)}),
    ("ControlDelayLag", {"Min_OutVar": 20}, {"Min_OutVar": above(20)}),
    ("ControlDelayLag", {"Max_OutVar": 20}, {"Max_OutVar": below(20)}),
    ("ControlLeadLag", {"Tlead": 0}, {"Tlead": -SMALLEST}),
    ("ControlLeadLag", {"Tlag": SMALLEST}, {"Tlag": 0}),
    ("ControlLeadLag", {"Min_OutVar": 1, "Max_OutVar": 0}, {"Tlag": -1}),
    ("ControlSplitRange", {"Mode": 1}, {"Mode": 0}),
    ("ControlSplitRange", {"Mode": 4}, {"Mode": 5}),
    ("ControlSplitRange", {"MV": 0}, {"MV": -SMALLEST}),
    ("ControlSplitRange", {"MV": 100}, {"MV": above(100)}),
    ("ControlSplitRange", {"SPLIT": SMALLEST}, {"SPLIT": 0}),
    ("ControlSplitRange", {"SPLIT": below(100)}, {"SPLIT": 100}),
    ("ControlSplitRange", {"Mode": 2}, {"SPLIT": math.nan}),
]


@pytest.mark.parametrize(("kind", "allowed", "refused"), EDGES)
def test_every_error_has_its_edge(kind, allowed, refused):
    block = Block(kind, **GOOD[kind])
    assert block()["Error"] == 0
    assert block(**allowed)["Error"] == 0
    assert block(**GOOD[kind] | refused)["Error"] == 1
    assert block(**GOOD[kind])["Error"] == 0


@pytest.mark.parametrize(("kind", "allowed", "refused"), EDGES)
def test_an_error_leaves_the_outputs_and_the_memory_as_they_are(kind, allowed, refused):
    broken, sound = Block(kind, **GOOD[kind]), Block(kind, **GOOD[kind])
    out = OUTPUTS[kind]
    for _ in range(25):
        before = broken()[out]
        assert sound()[out] == before
    for _ in range(3):
        broken(**refused)
        assert broken["Error"] == 1
        assert broken[out] == (0 if kind in FUNCTIONS else before)
        if "SampleTime" in broken.places:
            assert broken["SampleTime"] == single(0.1)
    for _ in range(25):
        assert broken(**GOOD[kind])[out] == sound()[out]


@pytest.mark.parametrize(("kind", "allowed", "refused"), EDGES)
def test_a_block_that_begins_with_errors_gives_0_and_starts_later(kind, allowed, refused):
    broken, fresh = Block(kind, **GOOD[kind] | refused), Block(kind, **GOOD[kind])
    outs = [name for name in broken.places if name in ("PWM", "OutVar", "MV1", "MV2", "Warning")]
    for _ in range(3):
        assert [broken()[name] for name in outs] == [0] * len(outs)
    for _ in range(30):
        assert [broken(**GOOD[kind])[name] for name in outs] == [fresh()[name] for name in outs]


@pytest.mark.parametrize(
    ("changed", "bits", "mv"),
    [
        ({"MaxPV": 0}, 1, 1),
        ({"MinPV": 100}, 1, 1),
        ({"MaxPV": above(0)}, 0, 1),
        ({"MinPV": below(100)}, 0, 1),
        ({"DeadBand": 0}, 0, 0),
        ({"DeadBand": -SMALLEST}, 2, 1),
        ({"DeadBand": -1, "MinPV": 101}, 3, 1),
        ({"DeadBand": math.nan}, 2, 1),
        ({"MaxPV": math.nan}, 1, 1),
    ],
)
def test_error_bits_of_on_off(changed, bits, mv):
    block = Block("ControlON_OFF", **ON_OFF | {"PV": -50})
    assert block()["MV"] == 1
    assert block(PV=130, **changed)["MV"] == mv
    assert (block["ErrBits.MaxMinPV"], block["ErrBits.DeadBand"]) == (bits & 1, bits >> 1)
    errors = (bits & 1) * BAD_PV_LIMITS + (bits >> 1) * BAD_DEAD_BAND
    assert block.s.status == AUTO_MODE | errors * ERROR_BASE
    assert (block["WarnBits.PV_MinPV"], block["WarnBits.PV_MaxPV"]) == ((1, 0) if bits else (0, 1))
    assert block(Manual=1, ManualMV=1)["MV"] == 1
    assert block(Manual=1, ManualMV=0)["MV"] == (1 if bits else 0)
    block(**ON_OFF, Manual=0)
    assert block.s.status == AUTO_MODE
    assert (block["ErrBits.MaxMinPV"], block["ErrBits.DeadBand"]) == (0, 0)


@pytest.mark.parametrize(
    ("kind", "given"),
    [
        ("ControlLowFilter", {}),
        ("ControlLag", {"Gs": MOST}),
        ("ControlLag", {"Gs": 0}),
        ("ControlDelayLag", {"Gs": MOST}),
        ("ControlLeadLag", {"G": MOST}),
        ("ControlLeadLag", {"Tlead": MOST, "Tlag": SMALLEST}),
    ],
)
def test_overflows_never_get_out(kind, given):
    block = Block(kind, **GOOD[kind] | given)
    for x in (0, MOST, -MOST, MOST, MOST, 0, -MOST, 5, 5):
        assert math.isfinite(block(InVar=x)["OutVar"])
        assert math.isfinite(block.s.lag_output)


# --- invariants, float32, compiled -----------------------------------------------------------------------------------

NUMBERS = st.floats(-1e6, 1e6, width=32)


@given(
    st.lists(NUMBERS, min_size=1, max_size=40),
    NUMBERS,
    NUMBERS,
    st.floats(0.125, 100, width=32),
    NUMBERS,
    st.floats(0, 10, width=32),
)
def test_outputs_stay_within_their_limits(inputs, a, b, tc, gain, time):
    low, high = min(a, b), max(a, b)
    limits = {"Min_OutVar": low, "Max_OutVar": high}
    more = {"Gs": gain, "Tc": tc, "Init_OutVar": a}
    for block in (
        Block("ControlLag", **limits, **more),
        Block("ControlDelayLag", **limits, **more, DelayTime=time),
        Block("ControlLeadLag", **limits, G=gain, Tlag=tc, Tlead=time),
    ):
        assert all(low <= y <= high for y in block.run("OutVar", "InVar", inputs))
        assert block["Error"] == 0


def random_parameters(rng, kind, ts):
    low, high = -rng.uniform(0, 200), rng.uniform(0, 200)
    wanted = {
        "Tc": 10 ** rng.uniform(-2, 3),
        "Tlag": 10 ** rng.uniform(-2, 3),
        "Tlead": rng.choice([0, 1, 7.3, 50]),
        "Gs": rng.uniform(-4, 4),
        "G": rng.uniform(-4, 4),
        "Offset": rng.uniform(-50, 50),
        "Min_OutVar": low,
        "Max_OutVar": high,
        "Init_OutVar": rng.uniform(low, high),
        "InitDelayedVar": rng.uniform(-50, 50),
        "DelayTime": rng.randint(0, 100) * ts,
    }
    return {name: value for name, value in wanted.items() if name in slots.OFFSETS[kind]}


@pytest.mark.parametrize("kind", IN_FLOAT32)
def test_random_runs_are_those_of_native_single_precision(kind):
    rng = random.Random(kind)
    limited = 0
    for _ in range(60):
        ts = rng.choice([0.01, 0.05, 0.1, 0.25, 1, 2.5])
        given = random_parameters(rng, kind, ts)
        inputs = [rng.uniform(-100, 100) for _ in range(150)]
        seen = Block(kind, ts=ts, **given).run("OutVar", "InVar", inputs)
        assert seen == [float(y) for y in IN_FLOAT32[kind](ts, given, inputs)]
        limited += {single(given.get("Max_OutVar", 0)), single(given.get("Min_OutVar", 0))} & {*seen} != set()
    assert limited > 5 or "Max_OutVar" not in given


def drive(configs, states, aux, signals, noise, second, outs, moved):  # noqa: PLR0917 - numba takes flat arrays
    """Every block in turn, with a random first input and a second one around a value (kernel)."""
    for k in range(200):
        for i in range(len(configs)):
            c = configs[i]
            out = c.base + int(outs[i])
            before = signals[out]
            signals[c.base] = noise[(k * len(configs) + i) % len(noise)]
            if k % 16 == 0:
                signals[c.base + 1] = second[i] * (1.0 + 0.004 * noise[(k + i) % len(noise)])
            call(c, states[i], aux, signals)
            if signals[out] != before:
                moved[i] += 1.0


def test_all_blocks_are_the_same_compiled_to_the_last_bit():
    rng = random.Random(9)
    fast = compile_functions([drive])[drive]
    kinds = list(slots.OFFSETS)[slots.ON_OFF :]
    outs = [slots.OFFSETS[kind][OUTPUTS[kind]] for kind in kinds]
    moved = [0.0] * len(kinds)
    for _ in range(40):
        configs, signals = [], []
        for i, kind in enumerate(kinds):
            ts = rng.choice([0.1, 0.25, 1])
            block = Block(kind, ts=ts, **(GOOD.get(kind, {"MV2": 50}) | random_parameters(rng, kind, ts)))
            configs.append(
                Config(kind=block.c.kind, base=len(signals), sample_time=block.c.sample_time, buffer=100 * i)
            )
            signals += block.signal_values[7:-7]
        states, aux = [State() for _ in configs], [UNTOUCHED] * (100 * len(configs))
        more = [rng.uniform(-20, 120) for _ in range(997)], [signals[c.base + 1] for c in configs], outs
        other = Rows.from_objects(states)
        arrays = record_array(configs, Config), other.array, vector(aux), vector(signals)
        fast(*arrays, *map(vector, more), vector(moved))
        drive(configs, states, aux, signals, *more, moved)
        assert [astuple(s) for s in other] == [astuple(s) for s in states]
        for mine, theirs in ((aux, arrays[2]), (signals, arrays[3])):
            assert struct.pack(f"<{len(mine)}d", *mine) == struct.pack(f"<{len(mine)}d", *theirs.tolist())
    assert min(moved) > 400


# --- decisions -------------------------------------------------------------------------------------------------------


def test_every_decision_is_named_where_it_is_carried_out():
    folder = Path(block_decisions.__file__).parent
    text = (folder / "scan.py").read_text("utf-8")

    assert [d.number for d in block_decisions.BLOCK_DECISIONS] == list(range(235, 248))
    assert [d.number for d in block_decisions.BLOCK_DECISIONS if f"D{d.number}" not in text] == []


# --- The share of a first-order lag: against the library's e^x, and as a number of its own ----------------------------


EXACT = 1e-15


def exact(x):
    """1 − e^(−x)."""
    return -math.expm1(-x)


def off(x):
    """Relative error of the share."""
    return abs(lag_share(x) / exact(x) - 1.0)


def test_it_is_the_share_of_a_lag_from_the_shortest_to_the_longest_time():
    rng = random.Random(1)
    points = [10.0 ** rng.uniform(-12.0, math.log10(50.0)) for _ in range(40_000)]

    assert max(off(x) for x in points) < EXACT


@pytest.mark.parametrize("edge", [0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 50.0])
def test_it_has_no_jump_where_it_is_calculated_in_another_way(edge):
    around = [math.nextafter(edge, 0.0), edge, math.nextafter(edge, 100.0)]

    assert max(off(x) for x in around) < EXACT


def test_nothing_in_no_time_and_everything_in_a_long_one():
    assert lag_share(0.0) == 0.0
    assert lag_share(LARGEST_RATIO) == lag_share(1e300) == lag_share(math.inf) == 1.0
    assert lag_share(5e-324) == 5e-324


@pytest.mark.parametrize(
    ("x", "expected"), [(0.1, 0.09516258196404043), (1.0, 0.6321205588285577), (0.01, 0.009950166250831947)]
)
def test_known_values(x, expected):
    assert lag_share(x) == pytest.approx(expected, rel=EXACT)


def test_it_never_leaves_0_to_1_and_rises_with_the_time():
    rng = random.Random(2)
    points = sorted(10.0 ** rng.uniform(-12.0, 2.0) for _ in range(20_000))
    shares = [lag_share(x) for x in points]

    assert all(0.0 < a <= 1.0 for a in shares)
    assert all(b - a > -EXACT for a, b in pairwise(shares))


def test_two_halves_are_the_whole():
    for x in (1e-9, 0.3, 0.9, 3.0, 20.0):
        half = lag_share(x / 2.0)
        assert half + (1.0 - half) * half == pytest.approx(lag_share(x), rel=2.0 * EXACT)


def test_it_is_the_same_compiled():
    fast = compile_functions([lag_share])[lag_share]
    rng = random.Random(3)
    points = [10.0 ** rng.uniform(-12.0, 2.0) for _ in range(5_000)]

    assert [fast(x) for x in points] == [lag_share(x) for x in points]
