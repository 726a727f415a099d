"""Random EZLogix loops with plants and events."""

from __future__ import annotations

import math

from reference.cases import Counts, chance, in_order, moment, number, plant, rates, sensor_events, stands_at, within

SETPOINT = 1
"""The register of the set point in a loop's block."""
FULL = 4095
"""The CV's highest count."""


PV_COUNTS = [0, FULL], [819, FULL], [0, 32000]
ROOT_COUNTS = [0, FULL], [0, FULL], [0, 16383], [0, 65535]


def random_case(rng):
    """A PLC of one to three loops with their plants, and events."""
    count = rng.choice((1, 1, 2, 3))
    base, sample_rates = rates(rng, count)
    duration = round(base * rng.randint(60, 160), 4)
    loops, plants, events, initial = [], {}, [], {}
    cascade = count > 1 and chance(rng, 0.3)
    outer, inner = (0, 1) if chance(rng, 0.5) else (1, 0)
    for i, rate in enumerate(sample_rates):
        name = "ABC"[i]
        entry = loop_entry(rng, name, i, rate, raw=cascade and i == inner)
        loops.append(entry)
        pv = entry["pv"].get("range", Counts(entry["pv"].get("counts", [0, FULL])))
        out = entry["output"].get("range", Counts([0, FULL]))
        right = (entry["action"] == "reverse") != chance(rng, 0.15)
        plants[name] = plant(rng, pv, out, rate, rises=right)
        if chance(rng, 0.5):
            initial[name] = rng.choice((*out, *entry["output"].get("limits", out), *[within(rng, out)] * 4))
        events += loop_events(rng, entry, base, duration) + sensor_events(rng, name, pv, duration)
        events += stands_at(rng, name, edges(entry), base, duration)
    if cascade:
        loops[outer]["output"]["tag"] = f"R{int(loops[inner]['registers'][1:]) + SETPOINT}"
    if chance(rng, 0.25):
        at = moment(rng, base, duration)
        events += [{"at": at, "plc": "stop"}, {"at": number(rng, at, duration), "plc": "run"}]
    configuration = {
        "pidcfg": 1,
        "vendor": "ezlogix",
        "plc": {"process_when_stopped": chance(rng, 0.5)},
        "loops": loops,
    }
    scenario = {"duration": duration, "plants": plants, "events": in_order(events), "seed": rng.randint(0, 9999)}
    if initial:
        scenario["initial"] = initial
    return configuration, scenario


def loop_entry(rng, name, index, rate, *, raw):
    """The configuration of a loop; ``raw``: one with 0 to 4095 counts, as a cascade wants it."""
    root = chance(rng, 0.2) and not raw
    counts = rng.choice(
        ([0, FULL], [0, FULL], [0, 16383], [0, 65535]) if root else ([0, FULL], [819, FULL], [0, 32000])
    )
    pv = {"tag": rng.choice(("IR", "R")) + str(900 + index), "square_root": root}
    if counts != [0, FULL] and not raw:
        pv["counts"] = counts
    ends = Counts(counts)
    if chance(rng, 0.5) and not raw:
        ends = [0 if root else number(rng, -100, 100, 1), 0]
        ends[1] = ends[0] + number(rng, 5, 900, 1)
        pv["range"] = ends = [round(x, 1) for x in ends]
    output = {"tag": rng.choice(("OR", "R")) + str(950 + index)}
    out = Counts([0, FULL])
    if chance(rng, 0.4):
        output["range"] = out = rng.choice(([0, 100], [20.5, 80], [-50, 50]))
    if chance(rng, 0.4):
        output["limits"] = [within(rng, out, 0, 0.4), within(rng, out, 0.6, 1)]
    if chance(rng, 0.4):
        output["offset"] = within(rng, out, 0, 0.5)
    if chance(rng, 0.3):
        cycle = round(rate * rng.choice((4, 10, 25)), 1) or 0.1
        output["pulse"] = {"tag": f"O{1 + index}", "cycle_time": cycle}
        if chance(rng, 0.7):
            output["pulse"] |= {"min_on": round(cycle * 0.3, 1), "min_off": round(cycle * 0.2, 1)}
    ends = scale_of_setpoint(pv)
    entry = {
        "name": name,
        "registers": f"R{100 + 50 * index}",
        "discretes": f"S{100 + 10 * index}",
        "mode": rng.choice(("auto", "auto", "manual")),
        "algorithm": rng.choice(("position", "velocity")),
        "action": rng.choice(("direct", "reverse")),
        "sample_rate": rate,
        "tuning": {
            "proportional_gain": rng.choice((0, number(rng, 0.05, 3), number(rng, 0.05, 20))),
            "integral_time": rng.choice((0, number(rng, 1, 20, 1), number(rng, 0.1, 300, 1))),
            "derivative_time": rng.choice((0, 0, number(rng, 0.1, 10, 1))),
        },
        "pv": pv,
        "setpoint": {"value": within(rng, ends)},
        "output": output,
        "anti_windup": chance(rng, 0.6),
    }
    if chance(rng, 0.4):
        entry["setpoint"]["limits"] = [within(rng, ends, 0, 0.4), within(rng, ends, 0.6, 1)]
    if chance(rng, 0.3):
        entry["deadband"] = distance(ends, rng.choice((0.01, 0.05, 0.15)))
    return entry


def scale_of_setpoint(pv):
    """Both ends of what a set point can be written as."""
    if "range" in pv:
        return pv["range"]
    low, high = pv.get("counts", [0, FULL])
    return Counts([0, math.isqrt(high - low)] if pv.get("square_root") else [low, high])


def edges(entry):
    """PVs of whole counts at which something begins or ends, those half-way to the next count, and a count beside."""
    low, high = entry["pv"].get("counts", [0, FULL])
    ends, width = entry["pv"].get("range", [low, high]), high - low
    scale = scale_of_setpoint(entry["pv"])
    sp, dead = entry["setpoint"]["value"], entry.get("deadband", 0)
    counts = [low, high, low + width / 2]
    if entry["pv"]["square_root"]:
        unit = math.isqrt(width) if isinstance(scale, Counts) else 1
        roots = [round(x) if isinstance(scale, Counts) else x / (scale[1] - scale[0]) * width**0.5 for x in (sp, dead)]
        counts += [(roots[0] + n * roots[1]) ** 2 for n in (-1, 0, 1)] + [unit]
    else:
        place = [round((x - n) / (scale[1] - scale[0]) * width) for x, n in ((sp, scale[0]), (dead, 0))]
        counts += [low + place[0] + n * place[1] for n in (-1, 0, 1)]
    counts += [count + n for count in tuple(counts) for n in (-1, -0.5, 0.5, 1)]
    return [ends[0] + (count - low) * (ends[1] - ends[0]) / width for count in counts]


def distance(ends, share):
    """A share of a scale."""
    width = share * (ends[1] - ends[0])
    return round(width) if isinstance(ends, Counts) else round(width, 2)


def loop_events(rng, entry, base, duration):
    """What an operator and a ladder program do to a loop."""
    ends = scale_of_setpoint(entry["pv"])
    out = entry["output"].get("range", Counts([0, FULL]))
    choices = [
        lambda: {"mode": rng.choice(("auto", "manual"))},
        lambda: {"mode": rng.choice(("auto", "manual"))},
        lambda: {"set": {"setpoint": within(rng, ends)}},
        lambda: {"set": {"setpoint": {"limits": [within(rng, ends, 0, 0.6), within(rng, ends, 0.4, 1)]}}},
        lambda: {"set": {"tuning": {"proportional_gain": number(rng, 0, 5)}}},
        lambda: {"set": {"tuning": {"integral_time": number(rng, 0, 30, 1)}}},
        lambda: {"set": {"tuning": {"integral_time": 0}}},
        lambda: {"set": {"tuning": {"derivative_time": number(rng, 0, 5, 1)}}},
        lambda: {"set": {"deadband": distance(ends, rng.uniform(0, 0.2))}},
        lambda: {"set": {"output": {"limits": [within(rng, out, 0, 0.6), within(rng, out, 0.4, 1)]}}},
        lambda: {"set": {"output": {"offset": within(rng, out, 0, 0.5)}}},
        lambda: {"set": {"output": rng.choice((*out, within(rng, out), within(rng, out)))}},
        lambda: {"set": {"anti_windup": chance(rng, 0.5)}},
        lambda: {"set": {"sample_rate": round(base * rng.randint(1, 4), 4)}},
    ]
    made = [rng.choice(choices)() for _ in range(rng.choice((0, 1, 2, 3, 5)))]
    return [{"at": moment(rng, base, duration), "loop": entry["name"], **event} for event in made]
