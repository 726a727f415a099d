"""Records with a disturbance, with two lags, and with columns that nobody can tell apart."""

import math
import random

import pytest

import pidcfg
from pidcfg.tuning.identify import Record, RecordError, identify
from pidcfg.tuning.response import Segment, first_order_response, second_order_response
from pidcfg.tuning.sheet import ColumnsError
from test_tuning import run

STEP = [Segment(60.0, 10.0)]
TIMES = [2.0 * i for i in range(350)]


def record(upset=0.0, at=310.0, second=0.0, noise=0.05, seed=3, until=700):
    """A step of 10 at 60 s on gain 1.5, 60 s and 8 s dead time, and a load that steps by so much PV."""
    rng, times = random.Random(seed), [t for t in TIMES if t < until]
    moved = second_order_response(times, STEP, 8.0, 60.0, second)
    load = first_order_response(times, [Segment(at, upset)], 0.0, 60.0)
    pv = [20 + 1.5 * a + b + rng.gauss(0, noise) for a, b in zip(moved, load, strict=True)]
    return Record(times, [40.0 + 10 * (t >= 60) for t in times], pv)


@pytest.mark.parametrize("upset", [12.0, 3.0, 1.5])
def test_a_second_disturbance_is_refused_with_the_part_before_it(upset):
    with pytest.raises(RecordError, match="on the PV moves again") as caught:
        identify(record(upset))
    until = float(caught.value.cure.split("--until ")[1].split(",")[0])
    assert 200 < until <= 310
    found = identify(record(upset, until=until))
    assert found.process.gain == pytest.approx(1.5, rel=0.03)


@pytest.mark.parametrize("seed", range(3))
def test_a_record_without_one_is_not_refused(seed):
    found = identify(record(seed=seed))
    assert found.process.second_time_constant == 0
    truth = (1.5, 60.0, 8.0)
    numbers = (found.process.gain, found.process.time_constant, found.process.dead_time)
    assert all(abs(a - b) <= 1.5 * c for a, b, c in zip(numbers, truth, found.confidence, strict=True))


def test_two_lags_are_identified_as_two_and_simc_uses_the_second():
    samples = record(second=40.0)
    found = identify(samples)
    process = found.process
    assert found.model == "second-order"
    assert (process.time_constant, process.second_time_constant) == pytest.approx((60, 40), rel=0.1)
    assert process.dead_time == pytest.approx(8, abs=1.5)
    rows = zip(samples.time, samples.output, samples.pv, strict=True)
    text = "time,output,pv\n" + "".join(f"{t},{u},{y:.4f}\n" for t, u, y in rows)
    tuned = pidcfg.tune("simc", "PID", record=text.encode(), name="step.csv")
    assert tuned.gains.derivative_time > 15
    assert tuned.to_json()["identified"]["time_constant_2"] == pytest.approx(40, rel=0.1)


# --- columns ---------------------------------------------------------------------------------------------------------


def answer(t, begin, gain, constant):
    return 0.0 if t < begin else gain * (1 - math.exp(-(t - begin) / constant))


def table(head, row):
    return (head + "\n" + "".join(";".join(f"{v:.6g}" for v in row(float(t))) + "\n" for t in range(400))).encode()


def test_two_temperatures_are_a_question(tmp_path):
    data = table("Time;T1;T2", lambda t: (t, 21 + answer(t, 10, 30, 60), 21 + answer(t, 30, 15, 70)))
    with pytest.raises(ColumnsError, match=r"say --columns time=1,output=2,pv=3 or --columns time=1,output=3,pv=2"):
        pidcfg.tune("simc", "PI", record=data, name="log.csv")
    (tmp_path / "log.csv").write_bytes(data)
    done = run("--method", "simc", "--from-csv", "log.csv", cwd=tmp_path)
    assert done.returncode == 2
    assert b"could both be the output" in done.stderr


@pytest.mark.parametrize("order", [(1, 2), (2, 1)])
def test_a_column_that_is_held_and_moves_first_is_the_output(order):
    def row(t):
        both = {1: 40 + 10 * (t >= 60), 2: 20 + answer(t, 68, 15, 40)}
        return t, both[order[0]], both[order[1]]

    found = pidcfg.tune("simc", "PI", record=table("Time;a;b", row), name="log.csv")
    assert found.identified.process.gain == pytest.approx(1.5, rel=0.01)


def test_a_name_is_accepted_as_it_stands_in_the_file():
    head = "Zeit [s];Stellgröße [%];Temperatur [°C];Temperatur [K]"
    data = table(head, lambda t: (t, 40 + 10 * (t >= 60), 20 + answer(t, 68, 15, 40), 290 + answer(t, 68, 15, 40)))
    said = "time=Zeit [s],output=Stellgröße [%],pv=Temperatur [°C]"
    found = pidcfg.tune("simc", "PI", record=data, name="log.csv", columns=said)
    assert found.identified.process.gain == pytest.approx(1.5, rel=0.01)
    assert found.identified.base == pytest.approx(20, abs=0.1)
