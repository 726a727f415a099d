"""Random programs of several rates: DPIDE with a CYCLE that changes, NextoPID with blocks called every n-th cycle."""

from __future__ import annotations

import json

from pidcfg.api import check


def random_case(rng):
    """A configuration that can be encoded and a scenario, as plain data."""
    make = rng.choice((dpide_case, nextopid_case))
    while True:
        configuration, scenario = make(rng)
        if check(json.dumps(configuration), name="case.yaml").ok:
            return configuration, scenario


def dpide_case(rng):
    """Loops whose CYCLE changes, or which stand in an interrupt task."""
    loops = []
    for i in range(rng.choice((1, 2, 3))):
        loop = {
            "name": f"L{i}",
            "device": f"D{500 + 40 * i}",
            "SV": rng.choice((30.0, 50.0)),
            "PID_MODE": rng.choice((0, 2)),
            "PID_MAN": rng.random() < 0.1,
            "CYCLE": rng.choice((0, 1, 30, 70, 100, 130, 250, 333, 1000, 1001, 2500, 45000)),
            "Kc_Kp": rng.choice((0.4, 1.0, 2.7)),
            "Ti_Ki": rng.choice((0.05, 0.8, 3.0, 12.0)),
            "Td_Kd": rng.choice((0.0, 0.3, 1.5)),
            "Tf": rng.choice((0.0, 0.2, 1.1)),
            "MV_MIN": rng.choice((0.0, -20.0)),
            "MV_MAX": rng.choice((100.0, 60.0)),
            "BIAS": rng.choice((0.0, 7.5)),
            "ERR_DBW": rng.choice((0.0, 0.0, 1.5)),
        }
        loops.append(loop | {name: rng.random() < 0.5 for name in ("PID_EQ", "PID_DE", "PID_DIR", "MOUT_AUTO")})
    configuration = {"pidcfg": 1, "vendor": "dpide", "loops": loops}
    if rng.random() < 0.35:
        configuration["plc"] = {"interrupt_task": rng.choice((10, 35, 100, 150, 1000))}
    duration = 90
    events = []
    for _ in range(rng.randrange(2, 16)):
        name = rng.choice(loops)["name"]
        given = rng.choice(
            (
                *(({"CYCLE": rng.choice((0, 1, 30, 90, 100, 130, 300, 777, 1000, 4000, 41000))},) * 4),
                {"SV": rng.choice((20.0, 44.4, 70.0))},
                {"Td_Kd": rng.choice((0.0, 0.9))},
                {"PID_RUN": rng.random() < 0.7},
                {"PID_MAN": rng.random() < 0.3},
            )
        )
        events.append({"at": round(rng.uniform(0, duration), rng.choice((0, 1, 2))), "loop": name, "set": given})
    plants = {
        loop["name"]: {
            "model": "first_order",
            "gain": 1.0 if loop["PID_DIR"] else -1.0,
            "load": 0.0 if loop["PID_DIR"] else 80.0,
            "time_constant": rng.choice((2.0, 9.0)),
            "initial": rng.choice((20.0, 49.0)),
            "noise": rng.choice((0.0, 0.1)),
        }
        for loop in loops
    }
    events.sort(key=lambda event: event["at"])
    scenario = {"duration": duration, "step": rng.choice((0.05, 0.1)), "plants": plants, "events": events}
    if any(min(max(loop["CYCLE"], 1), 40000) > 8000 for loop in loops) and "plc" not in configuration:
        scenario["duration"] = 450  # ten of the longest sampling times
    return configuration, scenario


def nextopid_case(rng):
    """Loops and filters at several rates, wired to one another by expressions."""
    task = rng.choice((0.05, 0.1, 0.2))
    numbers, truths = ["A", "B", "N", "T"], ["S"]
    blocks, loops = [], []
    for i in range(rng.choice((1, 2, 2, 3))):
        numbers_now = list(numbers)
        blocks.append(
            {
                "name": f"F{i}",
                "type": "ControlLowFilter",
                "InVar": number(rng, numbers_now, truths, 3),
                "Tc": rng.choice((0.3, 2.0)),
            }
        )
        loop = {
            "name": f"L{i}",
            "type": "PIDA_REAL",
            "SP": number(rng, numbers_now, truths, 2),
            "Kp": rng.choice((0.6, 1.7, f"abs({number(rng, ['A', 'B'], truths, 2)}) / 40 + 0.5")),
            "Ti_Ki": rng.choice((0.0, 0.9, 6.0)),
            "Td_Kd": rng.choice((0.0, 0.4)),
            "Tfd": rng.choice((0.0, 0.7)),
            "MinMV": rng.choice((0, -10)),
            "MaxMV": rng.choice((100, 70)),
            "MinPV": -50,
            "MaxPV": 150,
            "BIAS": rng.choice((0, number(rng, [*numbers_now, f"F{i}.OutVar"], truths, 3))),
            "MaxVarMV": rng.choice((0, 0, 3)),
            "Indep": rng.random() < 0.5,
            "Direct": rng.random() < 0.3,
            "DerivEr": rng.random() < 0.5,
            "Manual": truth(rng, numbers_now, truths, 2) if rng.random() < 0.3 else False,
            "ManualMV": number(rng, numbers_now, truths, 2),
        }
        if rng.random() < 0.6:
            loop["sample_time"] = round(task * rng.choice((2, 3, 5, 7)), 3)
        loops.append(loop)
        numbers += [f"L{i}.MV", f"L{i}.PV", f"F{i}.OutVar", f"L{i}.IntegralAction"]
        truths.append(f"L{i}.WarnBits.MV_MaxMV")
    if rng.random() < 0.4:  # the first one reads the last one: a value of the cycle before
        loops[0]["BIAS"] = f"{loops[-1]['name']}.PV / 20 - 1"
    configuration = {
        "pidcfg": 1,
        "vendor": "nextopid",
        "plc": {"sample_time": task},
        "signals": {"A": 3.0, "B": 40.0, "N": "INT#5", "T": "1500 ms", "S": True},
        "blocks": blocks,
        "loops": loops,
    }
    plants = {
        loop["name"]: {
            "model": "first_order",
            "gain": -1.0 if loop["Direct"] else 1.0,
            "load": 80.0 if loop["Direct"] else 0.0,
            "time_constant": rng.choice((1.0, 5.0)),
            "initial": rng.choice((10.0, 48.0)),
            "noise": rng.choice((0.0, 0.2)),
        }
        for loop in loops
    }
    duration = round(task * 700, 3)
    values = {"A": (0, 3.3, 60, -8), "B": (5, 20, 55.5), "N": (-3, 1, 7), "S": (True, False)}
    names = [rng.choice(list(values)) for _ in range(rng.randrange(12))]
    events = [{"at": round(rng.uniform(0, duration), 2), "set": {n: rng.choice(values[n])}} for n in names]
    events.sort(key=lambda event: event["at"])
    return configuration, {"duration": duration, "plants": plants, "events": events}


def number(rng, numbers, truths, depth):
    """A random expression of a number, with as few parentheses as its operators need, or with too many."""
    if depth == 0 or rng.random() < 0.2:
        return rng.choice((*numbers, *numbers, "0.5", "7", "1e1", "2.25"))
    one, two = (number(rng, numbers, truths, depth - 1) for _ in range(2))
    forms = (
        f"{one} + {two}",
        f"{one} - {two} * 0.3",
        f"({one}) * ({two}) / 50",
        f"-({one})",
        f"{one} / {two} / 3 + 20",
        f"max({one}, {two}, 1.5)",
        f"min({one}, 60) - {two}",
        f"abs({one} - {two}) + sqrt({two})",
        f"({one} - ({two})) * 2",
        f"{one} * {two} - -5",
    )
    return rng.choice(forms)


def truth(rng, numbers, truths, depth):
    """A random condition."""
    if depth == 0:
        return rng.choice((*truths, f"{rng.choice(numbers)} {rng.choice(('<', '>=', '<>'))} {rng.choice(numbers)}"))
    one, two = (truth(rng, numbers, truths, depth - 1) for _ in range(2))
    a, b = (number(rng, numbers, truths, 1) for _ in range(2))
    forms = (
        f"{one} AND {two}",
        f"{one} OR NOT {two} AND {one}",
        f"NOT ({one}) XOR {two}",
        f"{a} > {b} OR {two}",
        f"({a} <= {b}) = {one}",
    )
    return rng.choice(forms)
