"""The equation of DPIDE against textbook formulas, a continuous simulation, NumPy's single precision and the manual."""

from __future__ import annotations

import itertools
import math
import random
from decimal import Decimal

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dpide_rig import Rig, program_of
from pidcfg.schemas.base import Quantity
from pidcfg.sim.controllers.dpide.scan import load
from pidcfg.sim.controllers.kernels import single
from rig_plants import FirstOrder

WIDE = {"MV_MAX": 1e6, "MV_MIN": -1e6}
KINDS = list(itertools.product((False, True), repeat=3))
"""PID_EQ, PID_DE, PID_DIR."""
NAMES = ("PID_EQ", "PID_DE", "PID_DIR")


# --- the formulas ----------------------------------------------------------------------------------------------------


def textbook(kind, pvs, sv, kc, ti, td, tf, bias, ts):  # noqa: PLR0917 - the letters of the formula
    """MV after each sample, in double precision and in the words of the manual."""
    dependent, of_pv, forward = kind
    kp, ki, kd = (kc, kc / ti, kc * td) if dependent else (kc, ti, td)
    integral = y = 0.0
    past = None
    found = []
    for pv in pvs:
        e = sv - pv if forward else pv - sv
        e1, pv1 = past or (e, pv)
        past = e, pv
        integral += e * ts
        rate = (e - e1) / ts
        if of_pv:
            rate = -(pv - pv1) / ts if forward else (pv - pv1) / ts
        y += (rate - y) * ts / (tf + ts)
        found.append(kp * e + ki * integral + kd * y + bias)
    return found


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("tf", [0.0, 0.7])
def test_every_form_is_the_textbooks(kind, tf):
    rng = random.Random(f"{kind}")
    pvs = [rng.uniform(10, 30) for _ in range(60)]
    numbers = {"Kc_Kp": 2.5, "Ti_Ki": 4.0, "Td_Kd": 0.3, "Tf": tf, "BIAS": 7.25, "SV": 21.5}
    rig = Rig({**WIDE, **numbers, **dict(zip(NAMES, kind, strict=True))})
    found = rig.play(pvs, "MV")

    assert found == pytest.approx(textbook(kind, pvs, 21.5, 2.5, 4.0, 0.3, tf, 7.25, 0.1), rel=1e-5, abs=1e-3)


@pytest.mark.parametrize("name", ["Kc_Kp", "Ti_Ki", "Td_Kd", "Tf"])
@pytest.mark.parametrize("dependent", [False, True])
def test_a_coefficient_below_0_counts_as_0(name, dependent):
    numbers = {"Kc_Kp": 2, "Ti_Ki": 3, "Td_Kd": 1, "Tf": 0.5, "SV": 10, "PID_EQ": dependent}
    pvs = [1.0, 2.0, 4.0, 3.0]
    rigs = [Rig({**WIDE, **numbers, name: value}) for value in (-5, 0)]
    below, none, plain = (rig.play(pvs, "MV") for rig in (*rigs, Rig({**WIDE, **numbers})))

    assert below == none != plain


# --- limits and sampling time ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("cycle", "ticks"), [(-3, 1000), (0, 1000), (1, 1000), (40000, 40_000_000), (40001, 40_000_000), (250, 250_000)]
)
def test_cycle_counts_as_1_to_40000_ms(cycle, ticks):
    assert load(program_of({"CYCLE": cycle})).periods == [ticks]


def test_an_interrupt_task_has_its_own_sampling_time():
    plc = load(program_of({"CYCLE": 100}, {"CYCLE": 3000}, plc={"interrupt_task": 20}))

    assert (plc.periods, plc.base_ticks) == ([20_000, 20_000], 20_000)
    assert plc.states[0].sampling_time == single(0.02)
    assert plc.new_period(0, ("CYCLE",), 500) == 0
    effect = plc.set(0, ("CYCLE",), 500, plc.signal_values)
    assert effect == "has no effect: the interval of the interrupt task is the sampling time"
    assert plc.periods == [20_000, 20_000]


# --- single precision ------------------------------------------------------------------------------------------------


class Native:
    """The same equation in NumPy's single precision, written anew."""

    def __init__(self, operands, ts):
        self.f = f = pytest.importorskip("numpy").float32
        self.n = {k: f(v) if isinstance(v, float) else v for k, v in operands.items()}
        self.ts = f(ts)
        self.integral, self.y, self.past = f(0), f(0), None

    def step(self, pv):
        n, f = self.n, self.f
        pv = f(pv)
        e = n["SV"] - pv if n["PID_DIR"] else pv - n["SV"]
        e1, pv1 = self.past or (e, pv)
        self.past = e, pv
        kp, kd = n["Kc_Kp"], n["Td_Kd"]
        ki = n["Ti_Ki"] * self.ts
        if n["PID_EQ"]:
            ki, kd = kp * self.ts / n["Ti_Ki"], kp * n["Td_Kd"]
        change = e - e1
        if n["PID_DE"]:
            change = pv1 - pv if n["PID_DIR"] else pv - pv1
        x = change / self.ts
        lag = self.ts / (n["Tf"] + self.ts)
        self.y = self.y + lag * (x - self.y) if n["Tf"] else x
        p, d = kp * e, kd * self.y
        total = self.integral + ki * e
        mv = p + total + d + n["BIAS"]
        out = min(max(mv, n["MV_MIN"]), n["MV_MAX"])
        assert type(out) is f
        if out == mv:
            self.integral = total
        elif n["PID_MODE"] == 2:
            self.integral = out - p - d - n["BIAS"]
        return float(out), float(self.integral)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("mode", [0, 2])
def test_every_operation_is_that_of_single_precision(kind, mode):
    rng = random.Random(f"{kind}{mode}")
    limited = 0
    for _ in range(20):
        operands = {
            "SV": rng.uniform(-9, 90),
            "Kc_Kp": rng.uniform(0.01, 9),
            "Ti_Ki": rng.uniform(0.01, 30),
            "Td_Kd": rng.choice([0.0, rng.uniform(0, 3)]),
            "Tf": rng.choice([0.0, rng.uniform(0, 2)]),
            "BIAS": rng.uniform(-5, 5),
            "MV_MIN": rng.uniform(-30, 0),
            "MV_MAX": rng.uniform(50, 200),
            "PID_MODE": mode,
            **dict(zip(NAMES, kind, strict=True)),
        }
        rig, native = Rig({**operands, "CYCLE": 330}, base=0.33), Native(operands, 0.33)
        pv = operands["SV"]
        for _ in range(100):
            pv += rng.uniform(-4, 4)
            expected = native.step(pv)
            assert rig.play([pv], "MV", "I_MV") == [expected]
            limited += expected[0] in {rig.configs[0].lowest_mv, rig.configs[0].highest_mv}

    assert limited > 50


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("mode", [0, 2])
def test_values_beyond_single_precision_do_no_harm(kind, mode):
    wild = [1e39, -1e39, math.inf, -math.inf, math.nan, 3e38, -3e38, 0.0]
    rng = random.Random(5)
    rig = Rig(
        {
            "Kc_Kp": 3e38,
            "Ti_Ki": 1e-30,
            "Td_Kd": 3e38,
            "PID_MODE": mode,
            "SV": 1e38,
            "BIAS": -3e38,
            "Tf": 1,
            **dict(zip(NAMES, kind, strict=True)),
        }
    )
    for _ in range(200):
        rig.play([rng.choice(wild)], "MV")
        assert all(map(math.isfinite, rig.signal_values[1:]))
        assert 0.0 <= rig.signal("MV") <= 100.0


def test_what_is_no_measurement_leaves_mv_and_i_mv_as_they_are():
    rig = Rig({"Ti_Ki": 1, "Td_Kd": 3, "SV": 5, "PID_MODE": 2})
    before = rig.play([1.0], "MV", "I_MV")

    assert rig.play([math.nan] * 2, "MV", "I_MV") == before * 2
    assert rig.play([math.nan], "PV", "E") == [(0.0, 0.0)]
    assert rig.play([1.0], "I_MV") == pytest.approx([0.8])


# --- modes ------------------------------------------------------------------------------------------------------------

PI = {"Kc_Kp": 2, "Ti_Ki": 1, "SV": 10}
"""0.1 s: I_MV grows by a tenth of the error."""


def test_what_is_written_to_a_mout_that_is_the_mv_shows_at_once():
    rig = Rig({"SV": 30, "MOUT": 7, "PID_MAN": True}, devices=({"MV": "D304", "MOUT": "D304"},))
    for mout, shown in ((7, 7.0), (130, 130.0)):
        assert rig.set("MOUT", mout) is None
        assert (rig.signal("MV"), rig.signal("MOUT")) == (shown, shown)
    rig.step()
    rig.set("Kc_Kp", 2)
    assert (rig.signal("MV"), rig.signal("MOUT")) == (100.0, 100.0)
    rig.plc.request(0, "off")
    rig.step()
    rig.set("MOUT", 30)
    assert (rig.signal("MV"), rig.signal("MOUT")) == (0.0, 0.0)


def test_a_request_waits_for_the_next_calculation():
    rig = Rig(PI).step()
    rig.plc.request(0, "manual")

    assert rig.mode() == "auto"


def test_an_end_of_manual_without_a_measurement_is_forgotten_when_pid_run_is_false():
    rig = Rig({**PI, "PID_MAN": True, "MOUT": 60, "PID_MODE": 2})
    rig.play([9.0], "MV")
    rig.plc.request(0, "auto")
    assert rig.play([math.nan], "MV") == [60.0]
    rig.plc.request(0, "off")
    rig.step()
    rig.plc.request(0, "auto")

    assert rig.play([9.0], "I_MV") == pytest.approx([0.1])


def test_start_in_automatic_is_no_end_of_manual():
    """In PID_MODE 2 nothing is worked out of the MV that the loop starts with."""
    rig = Rig({**PI, "PID_MODE": 2, "MV": 77})

    assert rig.signal("MV") == 77.0
    assert rig.play([9.0], "MV", "I_MV") == [pytest.approx((2.1, 0.1), rel=1e-5, abs=1e-5)]
    assert rig.log == []


def test_automatic_keeps_pid_mode_2():
    rig = Rig({**PI, "PID_MODE": 2, "PID_MAN": True}).step()
    rig.plc.request(0, "auto")

    assert (rig.step().mode(), rig.states[0].mode) == ("auto", 2)


def test_an_mv_of_its_own_is_no_writer():
    rig = Rig({"SV": 30, "MOUT": 7}, devices=({"MV": "D304", "MOUT": "D304"},))

    assert rig.configs[0].mout_writer == -1


def test_a_mout_that_is_the_mv_begins_there_and_is_told_to_be_overwritten():
    devices = ({"MV": "D304", "MOUT": "D304"},)
    rig = Rig({"SV": 30, "MOUT": 7}, devices=devices)
    rig.plc.set_output(0, Quantity(Decimal(150)), rig.signal_values)

    assert (rig.signal("MV"), rig.signal("MOUT")) == (100.0, 100.0)
    assert rig.set("MOUT", 30) == "MOUT acts in manual only; it stands in the device of MV, which overwrites it"
    off = Rig({"PID_RUN": False, "MOUT": 7}, devices=devices)
    assert (off.signal("MV"), off.signal("MOUT")) == (0.0, 0.0)
    assert off.step().signal("MOUT") == 0.0


# --- closed loops ----------------------------------------------------------------------------------------------------


def continuous(kind, gain, kc, ti, td, tf):
    """PV each ms of dPV/dt = gain MV - PV under the continuous law; SV 1, from 1.5 s on 2 (Runge-Kutta)."""
    dependent, of_pv, forward = kind
    kp, ki, kd = (kc, kc / ti, kc * td) if dependent else (kc, ti, td)
    sign = 1.0 if forward else -1.0

    def slope(x, sv):
        pv, integral, z = x
        e = sign * (sv - pv)
        mv = kp * e + ki * integral + kd * z
        rise = gain * mv - pv
        return rise, e, (-sign * rise - z) / tf

    x, h, found = (0.0, 0.0, 0.0), 0.001, []
    for k in range(4000):
        sv = 1.0 if k < 1500 else 2.0
        if k == 1500 and not of_pv:
            x = (x[0], x[1], x[2] + sign * 1.0 / tf)
        found.append(x[0])
        a = slope(x, sv)
        b = slope(tuple(v + h / 2 * d for v, d in zip(x, a, strict=True)), sv)
        c = slope(tuple(v + h / 2 * d for v, d in zip(x, b, strict=True)), sv)
        e = slope(tuple(v + h * d for v, d in zip(x, c, strict=True)), sv)
        x = tuple(v + h / 6 * (p + 2 * q + 2 * r + w) for v, p, q, r, w in zip(x, a, b, c, e, strict=True))
    return found


@pytest.mark.parametrize("kind", KINDS)
def test_a_fast_loop_is_the_continuous_one(kind):
    """Within 0.5 % of the step, with the form, derivative and direction of each kind."""
    numbers = (
        {"Kc_Kp": 3.0, "Ti_Ki": 0.8, "Td_Kd": 0.05, "Tf": 0.1}
        if kind[0]
        else {"Kc_Kp": 3.0, "Ti_Ki": 4.0, "Td_Kd": 0.15, "Tf": 0.1}
    )
    gain = 1.0 if kind[2] else -1.0
    operands = {**WIDE, **numbers, **dict(zip(NAMES, kind, strict=True)), "CYCLE": 1, "SV": 1}
    rig = Rig(operands, plants=[FirstOrder(gain, 1.0)], base=0.001)
    found = rig.trace(1500, "PV")
    rig.set("SV", 2)
    found += rig.trace(2500, "PV")
    exact = continuous(kind, gain, *numbers.values())

    worst = max(abs(a - b) for a, b in zip(found, exact, strict=True))
    assert worst <= 0.005
    assert max(exact) > 1.9


@pytest.mark.parametrize(("kp", "overshoots"), [(5, False), (10, False), (20, False), (40, True)])
def test_the_manuals_example_of_tuning_kp(kp, overshoots):
    """1/(s + 1), every 10 ms, PV converted one sample late: only 40 overshoots, and 5 is the slowest."""
    rig = Rig(
        {"MV_MAX": 1000, "MV_MIN": -1000, "Kc_Kp": kp, "SV": 1, "CYCLE": 10},
        plants=[FirstOrder(1.0, 1.0, 0.01)],
        base=0.01,
    )
    rows = rig.trace(101, "PV", "MV")
    pvs = [pv for pv, _ in rows]

    assert rows[0] == (0.0, float(kp)), "the transient MV is big where Kp is"
    assert (max(pvs) > pvs[-1] * 1.01) == overshoots
    assert pvs[-1] == pytest.approx(kp / (kp + 1.0), rel=0.01)
    assert (pvs[20] < 0.75) == (kp == 5)


def test_the_manuals_final_tuning_brings_pv_to_sv():
    rig = Rig(
        {"MV_MAX": 1000, "MV_MIN": -1000, "Kc_Kp": 10, "Ti_Ki": 8, "Td_Kd": 0.2, "SV": 1, "CYCLE": 10},
        plants=[FirstOrder(1.0, 1.0, 0.01)],
        base=0.01,
    )
    pvs = rig.trace(1001, "PV")

    assert max(pvs) < 1.05
    assert 0.93 < pvs[100] < 1.0
    assert pvs[-1] == pytest.approx(1.0, abs=0.001)


@settings(max_examples=60, deadline=None)
@given(
    low=st.floats(-1e3, 1e3, width=32),
    high=st.floats(-1e3, 1e3, width=32),
    gains=st.tuples(*[st.floats(0, 1e3, width=32)] * 4),
    kind=st.sampled_from(KINDS),
    mode=st.sampled_from([0, 2]),
    band=st.floats(-9, 9, width=32),
    pvs=st.lists(st.floats(-1e4, 1e4), min_size=8, max_size=20),
    bias=st.floats(-500, 500, width=32),
    events=st.lists(
        st.sampled_from(
            [("PID_MAN", True), ("PID_MAN", False), ("MOUT", 5e4), ("MOUT", -7), ("SV", 3), ("MOUT_AUTO", True)]
        )
    ),
)
def test_mv_stays_within_its_limits(low, high, gains, kind, mode, band, pvs, bias, events):  # noqa: PLR0917 - drawn by name
    operands = dict(zip(("Kc_Kp", "Ti_Ki", "Td_Kd", "Tf"), gains, strict=True)) | dict(zip(NAMES, kind, strict=True))
    rig = Rig({**operands, "MV_MIN": low, "MV_MAX": high, "PID_MODE": mode, "ERR_DBW": band, "BIAS": bias})
    for i, pv in enumerate(pvs):
        if i < len(events):
            rig.set(*events[i])
        (mv,) = rig.play([pv], "MV")
        assert min(low, high) <= mv <= max(low, high)
