"""What `tune --write` forecasts, against a run of the written file on the same process."""

import io
import json
import random

import pytest

import pidcfg
from pidcfg.cli.formats.tuning import as_text
from pidcfg.output.arguments import ArgumentError
from scenario_rig import rows
from test_tune_write import starter

FILES = {
    "dl06": (
        "pidcfg: 1\nvendor: dl06\nplc: {loop_table: V2000, reset_decimals: 1}\nloops:\n  - name: A\n    mode: auto\n"
        "    sample_rate: TS\n    action: ACTION\n    tuning: {gain: 1, reset: 100}\n"
        "    pv: {range: [0, 400], filter: 0.5}\n    setpoint: {value: 85}\n    output: {range: [0, 100]}\n"
    ),
    "generic": (
        "pidcfg: 1\nvendor: generic\nloops:\n  - name: A\n    mode: auto\n    output_raises_pv: RAISES\n"
        "    sample_time: TS\n    tuning: {gain: 1, integral_time: 50}\n    pv: {range: [0, 400], filter: 4}\n"
        "    setpoint: {value: 85}\n    output: {range: [0, 100], limits: [0, 100]}\n"
    ),
}


def file_of(vendor, sample=5, *, raises=True):
    text = FILES[vendor].replace("TS", str(sample)).replace("RAISES", str(raises).lower())
    return text.replace("ACTION", "direct" if raises else "reverse").encode()


def of_simulate(data, process, step, length):
    """Overshoot, and IAE per unit of the step, as a person would measure them with a scenario."""
    gain, integrates = process["gain"], process.get("model") == "integrating"
    text = f"gain: {gain!r}, dead_time: {process['dead_time']!r}, initial: 85"
    if integrates:
        plant = f"{{model: integrator, {text}, load: {-gain * 50!r}}}"
    elif "second_time_constant" in process:
        lags = [process["time_constant"], process["second_time_constant"]]
        plant = f"{{model: second_order, time_constants: {lags}, {text}, load: {85 - gain * 50!r}}}"
    else:
        lag = process["time_constant"]
        plant = f"{{model: first_order, time_constant: {lag!r}, {text}, load: {85 - gain * 50!r}}}"
    scenario = (
        f"pidcfg: 1\nscenario: step\nconfig: c.yaml\nduration: {length + 50}\n"
        f"initial: {{A: 50}}\nplants: {{A: {plant}}}\n"
        f"events:\n  - {{at: 50, loop: A, set: {{setpoint: {85 + step!r}}}}}\n"
    )
    trend = io.StringIO()
    ran = pidcfg.simulate(scenario.encode(), name="s.yaml", files={"c.yaml": data}, trend=trend, reference=False)
    found = rows(trend.getvalue())
    dt = found["time"][1] - found["time"][0]
    errors = [abs(a - b) for t, a, b in zip(found["time"], found["A.SP"], found["A.PV"], strict=True) if t >= 50]
    return ran.report.loops["A"].metrics["overshoot"], sum(errors[:-1]) * dt / step


def random_case(seed):
    """A vendor, a rule, a form and a process."""
    rng = random.Random(seed)
    constant = 10 ** rng.uniform(1, 1.8)
    sign = rng.choice([1, -1])
    process = {"gain": sign * 10 ** rng.uniform(0, 0.6), "dead_time": constant * 10 ** rng.uniform(-1, 0)}
    kind = rng.choice(["lag", "lags", "integrator"])
    if kind == "integrator":
        process |= {"model": "integrating", "gain": process["gain"] / constant}
    else:
        process["time_constant"] = constant
        process |= {"second_time_constant": constant * rng.uniform(0.1, 0.8)} if kind == "lags" else {}
    return rng.choice(["dl06", "generic"]), rng.choice(["simc", "lambda", "amigo"]), rng.choice([1, 2, 5]), process


@pytest.mark.parametrize("seed", range(8))
def test_the_forecast_is_what_simulate_shows(seed):
    vendor, rule, sample, process = random_case(seed)
    data = file_of(vendor, sample, raises=process["gain"] > 0)
    found = pidcfg.tune(rule, "PI", **process, into=data, into_name="c.yaml", loop="A")
    assert found.forecast.why == ""
    step = min(40.0, 0.9 * found.forecast.largest)
    ti = found.gains.integral_time
    past, error = of_simulate(found.written.data, process, step, int(12 * max(ti, 100)))
    assert found.judgement.answer.overshoot == pytest.approx(past, abs=3)
    assert found.forecast.hunts or found.judgement.answer.iae_setpoint == pytest.approx(error, rel=0.1)


def test_the_loop_s_own_sample_time_and_filter_are_used_and_told():
    process = {"gain": 2.0, "time_constant": 60.0, "dead_time": 8.0}
    alone, slow, fast = (
        pidcfg.tune("simc", "PI", **process),
        pidcfg.tune("simc", "PI", **process, into=file_of("generic", 5), into_name="c.yaml"),
        pidcfg.tune("simc", "PI", **process, into=file_of("generic", 1), into_name="c.yaml"),
    )
    assert alone.gains.gain == pytest.approx(60 / (2 * 16))
    assert slow.gains.gain == pytest.approx(62 / (2 * 2 * (8 + 2 + 2.5)))
    assert fast.gains.gain == pytest.approx(62 / (2 * 2 * (8 + 2 + 0.5)))
    assert (
        "  loop         samples every 5 s, PV filter 4 s, action output_raises_pv: true, PV 0 to 400, output 0 to 100\n"
        in as_text(slow)
    )
    assert json.loads(json.dumps(slow.to_json()))["loop"]["filter_time"] == pytest.approx(4)
    assert slow.to_json()["forecast"]["of"] == "words"
    assert "loop" not in alone.to_json()


def test_another_sample_time_than_the_loop_s_is_refused():
    with pytest.raises(ArgumentError, match="the loop samples every 5 s: leave it out"):
        pidcfg.tune(
            "simc", gain=2, time_constant=60, dead_time=8, sample_time=2, into=file_of("generic"), into_name="c.yaml"
        )


@pytest.mark.parametrize("vendor", ["dl06", "click", "ezlogix", "nextopid", "dpide", "generic"])
def test_the_words_of_every_vendor_run(vendor):
    found = pidcfg.tune(
        "simc", "PI", gain=2, time_constant=60, dead_time=8, into=starter(vendor).encode(), into_name="c"
    )
    assert found.forecast.why == ""
    assert found.forecast.settled
    assert 0 <= found.judgement.answer.overshoot < 40
    assert 10 < found.judgement.answer.iae_setpoint < 60


@pytest.mark.parametrize(
    ("process", "why"),
    [
        ({"transfer": "2(3s+1)exp(-8s)/((60s+1)(5s+1))"}, "zeros"),
        ({"gain": 2, "time_constant": 1e6, "dead_time": 0.5}, "too long"),
    ],
)
def test_where_nothing_runs_the_forecast_says_why(process, why):
    found = pidcfg.tune("simc", "PI", **process, into=file_of("generic", 1), into_name="c.yaml")
    assert why in found.forecast.why
    assert found.to_json()["forecast"] == {"of": "continuous loop", "why": found.forecast.why}
    assert f"of a continuous loop: {found.forecast.why}" in as_text(found)


def test_lags_in_a_row_run_too():
    chain = "2 exp(-8s)/((60s+1)(9s+1)(3s+1))"
    found = pidcfg.tune("simc", "PI", transfer=chain, into=file_of("generic", 1), into_name="c.yaml")
    assert found.forecast.why == ""
    assert found.judgement.answer.iae_setpoint == pytest.approx(2 * (8 + 7.5 + 0.5 + 4.5), rel=0.4)
