"""Mistakes in the example configurations that only a run that was accepted can know, and what they do to a run."""

from __future__ import annotations

from pathlib import Path

from pidcfg import simulate

EXAMPLES = Path(__file__).parents[1] / "examples"

SPOILS = {
    "dl06/reactor": [
        ("gain: 0.80", "gain: 1.60"),
        ("gain: 2.50", "gain: 1.00"),
        ("reset: 180.0", "reset: 60.0"),
        ("reset: 2.0", "reset: 8.0"),
        ("range: [0, 200]", "range: [0, 250]"),
        ("rate: 6.0", "rate: 30.0"),
        ("mode: cascade", "mode: auto"),
    ],
    "dl06/flow": [
        ("gain: 0.60", "gain: 0.30"),
        ("reset: 3.0", "reset: 9.0"),
        ("range: [0, 120]", "range: [0, 150]"),
        ("square_root: true", "square_root: false"),
        ("value: 75", "value: 70"),
        ("filter: 0.5", "filter: 0.1"),
        ("high: 105", "high: 60"),
    ],
    "dl06/feedpump": [
        ("gain: 3.00", "gain: 9.00"),
        ("reset: 240", "reset: 60"),
        ("gain: 0.60", "gain: 0.06"),
        ("reset: 5.0", "reset: 50.0"),
        ("range: [-300, 300]", "range: [-300, 400]"),
        ("value: 15", "value: 20"),
        ("low: -200", "low: -5"),
        ("mode: auto", "mode: manual"),
    ],
    "click/brewery": [
        ("proportional_gain: 9,", "proportional_gain: 3,"),
        ("reset_time: 260", "reset_time: 2600"),
        ("limits: [0, 85]", "limits: [0, 60]"),
        ("value: 52", "value: 55"),
        ("range: [15, 110]", "range: [0, 110]"),
        ("proportional_gain: 30", "proportional_gain: 3"),
        ("high: 26", "high: 19"),
        ("filter: 60", "filter: 99"),
    ],
    "dpide/chiller": [
        ("Kc_Kp: 6.0", "Kc_Kp: 2.0"),
        ("Ti_Ki: 0.05", "Ti_Ki: 0.01"),
        ("Td_Kd: 30.0", "Td_Kd: 0"),
        ("ERR_DBW: 0.1", "ERR_DBW: 1.0"),
        ("MV_MAX: 100", "MV_MAX: 55"),
        ("range: [0, 30]", "range: [-10, 30]"),
        ("PID_EQ: false", "PID_EQ: true"),
        ("SV: 6.5", "SV: 7.5"),
    ],
    "ezlogix/dosing": [
        ("proportional_gain: 0.40", "proportional_gain: 0.10"),
        ("integral_time: 1.5", "integral_time: 15"),
        ("square_root: true", "square_root: false"),
        ("range: [0, 50]", "range: [0, 60]"),
        ("proportional_gain: 2.50", "proportional_gain: 0.25"),
        ("integral_time: 300.0", "integral_time: 3000.0"),
        ("value: 70", "value: 68"),
    ],
    "nextopid/heatexchanger": [
        ("BIAS: (TIC_1.SP - LL_Inlet.OutVar)", "BIAS: (TIC_1.SP + LL_Inlet.OutVar)"),
        ("LL_Flow.OutVar / 2", "LL_Flow.OutVar / 4"),
        ("* LL_Flow.OutVar / 2", "/ LL_Flow.OutVar * 2"),
        ("Tlead: 10, Tlag: 5", "Tlead: 5, Tlag: 10"),
        ("Kp: 1.0", "Kp: 0.1"),
        ("Ti_Ki: 10.0", "Ti_Ki: 100.0"),
        ("MaxPV: 100.0", "MaxPV: 120.0"),
        ("SP: 50.0", "SP: 52.0"),
    ],
    "nextopid/ratio": [
        ("SP_CASC: Ratio * GAS_F.OutVar", "SP_CASC: GAS_F.OutVar / Ratio * 100"),
        ("SP_CASC: Ratio * GAS_F.OutVar", "SP_CASC: (Ratio - 1) * GAS_F.OutVar"),
        ("Ratio: 10.4", "Ratio: 9.4"),
        ("Ratio_on: true", "Ratio_on: false"),
        ("Tc: 0.5", "Tc: 10"),
        ("Kp: 0.25", "Kp: 0.05"),
        ("Ti_Ki: 1.5", "Ti_Ki: 8.0"),
        ("MaxPV: 300.0", "MaxPV: 400.0"),
        ("MaxVarMV: 2.0", "MaxVarMV: 0.1"),
    ],
    "generic/boiler": [
        ("gain: 1.2", "gain: 0.4"),
        ("integral_time: 4 min", "integral_time: 40 min"),
        ("range: [0, 150]", "range: [0, 120]"),
        ("gain: 0.8", "gain: 0.2"),
        ("limits: [4, 36]", "limits: [4, 20]"),
        ("low: 50", "low: 84"),
        ("mode: cascade", "mode: auto"),
        ("max_rate: 10", "max_rate: 0.5"),
    ],
}
"""What is replaced in each example's configuration: gains, times, ranges, signs, ratios, alarms, modes."""


def files_of(example, old="", new=""):
    """The texts of an example, without what the scenario expects or allows, its configuration changed."""
    name = example.rpartition("/")[2]
    config = (EXAMPLES / f"{example}.yaml").read_text("utf-8")
    assert not old or old in config, (example, old)
    scenario = (EXAMPLES / f"{example}.scenario.yaml").read_text("utf-8")
    lines = scenario.splitlines(keepends=True)
    starts = [i for i, line in enumerate(lines) if line.startswith(("expect:", "reference:"))]
    for start in reversed(starts):
        end = next((i for i in range(start + 1, len(lines)) if not lines[i].startswith(" ")), len(lines))
        del lines[start:end]
    return {f"{name}.scenario.yaml": "".join(lines), f"{name}.yaml": config.replace(old, new, 1) if old else config}


def run(example, old="", new="", **options):
    """A run of an example, or of one that is spoiled."""
    files = files_of(example, old, new)
    return simulate(Path(next(iter(files))), files=files, engine="python", **options)


# --- What has changed, by another way than the program's: from the JSON of both runs ----------------------------------

SHARES = {"overshoot": (0.1, 2), "iae": (0.1, 2e-4), "ise": (0.2, 1e-6), "itae": (0.1, 1e-4)}
"""Of a metric's accepted value, and what a difference is at least: in points, or of span times time."""


def least(metric, value, kept, duration):
    """By how much a metric of a loop may differ."""
    low, high = kept["pv_range"]
    bottom, top = kept["output_range"] or (0, 100)
    if metric in {"settling_time", "rise_time", "oscillation_period"}:
        return max(0.05 * value, 2 * kept["sample_time"])
    if metric in {"final_error", "oscillation_amplitude"}:
        return 0.01 * (high - low)
    share, part = SHARES.get(metric, (0.1, 0.02 * (top - bottom)))
    powers = {"iae": (1, 1), "ise": (2, 1), "itae": (1, 2)}.get(metric, (0, 0))
    return max(share * abs(value), part * (high - low) ** powers[0] * duration ** powers[1])


def loops_that_differ(accepted, before, after):
    """The loops in which two runs differ by their JSON; ``accepted`` has the spans and samples."""
    found = set()
    for name, kept in accepted["loops"].items():
        old, new = before["loops"][name], after["loops"][name]
        modes = [[m["mode"] for m in loop["modes"]] for loop in (old, new)]
        alarms = [{a["alarm"] for a in loop["alarms"]} for loop in (old, new)]
        if modes[0] != modes[1] or alarms[0] != alarms[1]:
            found.add(name)
        for metric, value in old["metrics"].items():
            other = new["metrics"][metric]
            if metric.startswith("oscillation"):
                continue
            if value is None or other is None:
                found |= {name} if value is not other else set()
            elif abs(other - value) > 1.001 * least(metric, value, kept, accepted["duration"]):
                found.add(name)
    return found
