"""Random DL06 loops with plants and events, in raw counts."""

from __future__ import annotations

import math

from reference.cases import Counts, chance, in_order, moment, number, plant, rates, sensor_events, stands_at, within

ENDS = {
    "12-bit unipolar": (0, 4095), "12-bit bipolar": (-4095, 4095), "15-bit unipolar": (0, 32767),
    "15-bit bipolar": (-32767, 32767), "16-bit unipolar": (0, 65535),
}  # fmt: skip
FORMATS = tuple(ENDS)


def random_case(rng):
    """A PLC of one to three loops with their plants, and events."""
    count = rng.choice((1, 1, 2, 2, 3))
    base, sample_rates = rates(rng, count)
    duration = round(base * rng.randint(60, 160), 4)
    cascade = count > 1 and chance(rng, 0.5)
    shared = rng.choice(FORMATS)
    loops, tuned, plants, events, initial = [], [], {}, [], {}
    for i, rate in enumerate(sample_rates):
        name = "ABC"[i]
        entry = loop_entry(rng, name, i, rate, shared if cascade and i < 2 else rng.choice(FORMATS))
        if cascade and i < 2:
            entry["output"].pop("format", None)
            entry["output"].pop("limits", None)
        loops.append(entry)
        if not cascade and chance(rng, 0.2):
            tuned.append(entry)
    if cascade:
        minor, major = (loops[0], loops[1]) if chance(rng, 0.5) else (loops[1], loops[0])
        minor |= {"cascade_from": major["name"], "mode": rng.choice(("cascade", "cascade", "auto"))}
        major["mode"] = rng.choice(("auto", "auto", "manual"))
        minor["pv"]["square_root"] = False
        ends = ends_of(minor)
        limits = [within(rng, ends, 0, 0.4), within(rng, ends, 0.6, 1)]
        minor["setpoint"] |= {"value": within(rng, ends), "limits": limits}
    for i, entry in enumerate(loops):
        pv, out = Counts(ENDS[entry["pv"]["format"]]), out_ends(entry)
        right = (entry["action"] == "direct") != chance(rng, 0.15)
        plants[entry["name"]] = plant(rng, pv, out, sample_rates[i], rises=right)
        if entry in tuned:
            plants[entry["name"]], initial[entry["name"]] = tuning(rng, entry, pv, out, sample_rates[i])
            events += tuning_events(rng, entry, base, duration)
            continue
        if chance(rng, 0.5):
            initial[entry["name"]] = within(rng, out)
        events += loop_events(rng, entry, base, duration) + sensor_events(rng, entry["name"], pv, duration)
        events += stands_at(rng, entry["name"], edges(entry), base, duration)
    if chance(rng, 0.15):
        at = moment(rng, base, duration)
        events += [{"at": at, "plc": "program"}, {"at": number(rng, at, duration), "plc": "run"}]
    plc = {"loop_table": "V2000", "reset_decimals": rng.choice((1, 2)), "derivative": rng.choice(("error", "pv"))}
    configuration = {"pidcfg": 1, "vendor": "dl06", "plc": plc, "loops": loops}
    scenario = {"duration": duration, "plants": plants, "events": in_order(events), "seed": rng.randint(0, 9999)}
    if initial:
        scenario["initial"] = initial
    scenario["plc"] = {"auto_interlock": chance(rng, 0.5), "step_bias": chance(rng, 0.2)}
    return configuration, scenario


def tuning(rng, entry, pv, out, rate):
    """A loop that tunes itself by a relay: the PV begins at the set point, and answers to the output."""
    entry |= {"mode": "auto", "bumpless": "I", "autotune": {"method": "closed", "type": rng.choice(("PID", "PI"))}}
    entry["setpoint"] = {"limits": entry["setpoint"]["limits"], "limits_enabled": chance(rng, 0.1)}
    entry["tuning"] |= {"gain": 0.5, "rate": 0}
    entry["alarms"]["pv"]["enabled"] = False
    start, middle = within(rng, out, 0.4, 0.6), within(rng, pv, 0.35, 0.65)
    gain = rng.uniform(0.2, 1.2) * (pv[1] - pv[0]) / (out[1] - out[0]) * (1 if entry["action"] == "direct" else -1)
    plant = {"model": "first_order", "gain": gain, "load": round(middle - gain * start), "initial": middle}
    plant |= {"time_constant": round(rate * rng.uniform(2, 12), 3), "dead_time": round(rate * rng.randint(0, 3), 4)}
    plant["noise"] = round((pv[1] - pv[0]) * rng.choice((0, 0, 0.0003, 0.005)), 3)
    return plant, start


def tuning_events(rng, entry, base, duration):
    """The start of an auto-tune, and what may come between."""
    made = [{"at": moment(rng, base, duration / 8), "loop": entry["name"], "autotune": "start"}]
    more = [*rng.choice(((), (), (), ({"mode": "manual"}, {"mode": "auto"}), ({"autotune": "start"},)))]
    if chance(rng, 0.1):
        more.append({"set": {"setpoint": within(rng, ends_of(entry))}})
    return made + [{"at": moment(rng, base, duration), "loop": entry["name"], **event} for event in more]


def edges(entry):
    """PVs at which something begins or ends, and those beside them."""
    low, high = ENDS[entry["pv"]["format"]]
    alarms, root = entry["alarms"], entry["pv"]["square_root"]
    band, sp = alarms["hysteresis"], entry["setpoint"].get("value", 0)
    values = [low, high, low - 1, high + 1, low + 0.5, high - 0.5, 0, -1, 1.5, 2.5]
    for name in ("low_low", "low", "high", "high_high"):
        point = alarms["pv"][name]
        values += [point + n for n in (-1, 0, 1, 0.5, band, band + 1, band - 1, -band, 1 - band, -1 - band)]
    for dead in (0, entry["error"]["deadband"]):
        values += [(x * abs(x) if root else x) + n for x in (sp - dead, sp + dead) for n in (-1, 0, 1)]
    centre = sp * abs(sp) if root else sp
    for limit in (alarms["deviation"]["yellow"], alarms["deviation"]["red"], alarms["rate_of_change"]):
        values += [centre + side * (limit + n) for side in (-1, 1) for n in (0, 1, -band, 1 - band)]
    return values


def ends_of(entry):
    """Both ends of what a set point can be."""
    low, high = ENDS[entry["pv"]["format"]]
    if not entry["pv"].get("square_root"):
        return Counts([low, high])
    return Counts([0, math.isqrt(high - low) if low == 0 else math.isqrt(high)])


def out_ends(entry):
    """Both ends of the output."""
    return Counts(ENDS[entry["output"].get("format", entry["pv"]["format"])])


def share(ends, part):
    """A distance on a scale, in counts."""
    return max(round(part * (ends[1] - ends[0])), 1)


def loop_entry(rng, name, index, rate, form):
    """The configuration of a loop; every switch is written, so that an event on its value leaves it alone."""
    entry = {
        "name": name,
        "mode": rng.choice(("auto", "auto", "auto", "manual")),
        "sample_rate": rate,
        "algorithm": rng.choice(("position", "position", "velocity")),
        "action": rng.choice(("direct", "reverse")),
        "bumpless": rng.choice(("I", "II")),
        "bias_freeze": chance(rng, 0.5),
        "tuning": {
            "gain": rng.choice((0, 0.5, 1, number(rng, 0.1, 5), number(rng, 0.1, 40), 99.99)),
            "reset": rng.choice(("off", "off 9999", number(rng, 0.5, 30, 1), number(rng, 0.5, 90, 1))),
            "reset_unit": rng.choice(("seconds", "seconds", "minutes")),
            "rate": rng.choice((0, 0, 0, 0, number(rng, 0.05, 5), number(rng, 0.05, 5), 99.99)),
        },
        "derivative_gain_limit": rng.choice((0, 1, 5, 20)),
        "derivative_gain_limit_enabled": chance(rng, 0.5),
        "pv": {
            "format": form,
            "square_root": chance(rng, 0.2),
            "filter": rng.choice((0.1, 0.3, 0.5, 0.9, 1.0)),
            "filter_enabled": chance(rng, 0.4),
        },
        "output": {},
    }
    if chance(rng, 0.3):
        entry["output"]["format"] = rng.choice(FORMATS)
    if chance(rng, 0.4):
        out = out_ends(entry)
        entry["output"]["limits"] = [
            rng.choice((out[0], out[0] + 1, within(rng, out, 0, 0.4))),
            rng.choice((out[1], within(rng, out, 0.6, 1))),
        ]
    if chance(rng, 0.15):
        independent(rng, entry, index)
    ends = ends_of(entry)
    pv = Counts(ENDS[form])
    entry["setpoint"] = {
        "limits": [within(rng, ends, 0, 0.4), within(rng, ends, 0.6, 1)],
        "limits_enabled": chance(rng, 0.4),
    }
    if chance(rng, 0.85):
        entry["setpoint"]["value"] = rng.choice((*ends, *entry["setpoint"]["limits"], *[within(rng, ends)] * 6))
    entry["error"] = {
        "curve": rng.choice(("linear", "linear", "squared")),
        "deadband": share(ends, rng.choice((0, 0.01, 0.05))),
        "deadband_enabled": chance(rng, 0.4),
    }
    points = sorted(within(rng, pv) for _ in range(4))
    if chance(rng, 0.05):
        points[rng.randrange(3)] = points[rng.randrange(4)]
    yellow = share(pv, rng.uniform(0.01, 0.2))
    entry["alarms"] = {
        "pv": {
            **dict(zip(("low_low", "low", "high", "high_high"), points, strict=True)),
            "enabled": chance(rng, 0.4),
        },
        "deviation": {
            "yellow": yellow,
            "red": yellow + rng.choice((0, 1, *[round(share(pv, 0.2) * rng.uniform(-0.05, 1))] * 8)),
            "enabled": chance(rng, 0.5),
        },
        "rate_of_change": share(pv, rng.choice((0.002, 0.01, 0.1))),
        "rate_of_change_enabled": chance(rng, 0.5),
        "hysteresis": share(pv, rng.choice((0, 0.005, 0.03))),
    }
    if chance(rng, 0.4):
        entry["ramp_soak"] = profile(rng, index, ends, rate)
    return entry


def independent(rng, entry, index):
    """The loop is independent of the CPU's mode, with or without modules of its own."""
    entry["independent_of_cpu_mode"] = True
    if chance(rng, 0.5):
        entry["pv"]["transfer"] = {"slot": 1, "channel": index + 1}
    if chance(rng, 0.5):
        entry["output"]["transfer"] = {"slot": 2, "channel": index + 1}


def profile(rng, index, ends, rate):
    """A ramp/soak profile that a short run gets through."""
    steps = []
    for _ in range(rng.choice((1, 2, 3, 8))):
        slope = min(max((ends[1] - ends[0]) / rate / rng.uniform(10, 60), 0.5), 99.0)
        steps.append(
            {
                "ramp_to": within(rng, ends),
                "slope": f"{round(slope, 2)} counts",
                "soak": rng.choice((0, 0.1, 0.1, 0.2)),
                "deviation": rng.choice((0, share(ends, 0.02))),
            }
        )
    return {"table": f"V{0o3000 + 0o40 * index:o}", "enabled": chance(rng, 0.9), "steps": steps}


def loop_events(rng, entry, base, duration):
    """What an operator and a ladder program do to a loop."""
    ends, out, pv = ends_of(entry), out_ends(entry), Counts(ENDS[entry["pv"]["format"]])
    choices = [
        lambda: {"mode": rng.choice(("auto", "manual", "cascade"))},
        lambda: {"mode": "auto"},
        lambda: {"mode": "manual"},
        lambda: {"set": {"setpoint": within(rng, ends)}},
        lambda: {"set": {"setpoint": within(rng, ends)}},
        lambda: {"set": {"tuning": {"gain": number(rng, 0.1, 5)}}},
        lambda: {"set": {"tuning": {"reset": number(rng, 0.5, 60, 1)}}},
        lambda: {"set": {"tuning": {"rate": number(rng, 0, 5)}}},
        lambda: {"set": {"pv": {"filter": rng.choice((0.1, 0.5, 1.0))}}},
        lambda: {"set": {"pv": {"filter_enabled": chance(rng, 0.5)}}},
        lambda: {"set": {"setpoint": {"limits": [within(rng, ends, 0, 0.5), within(rng, ends, 0.5, 1)]}}},
        lambda: {"set": {"setpoint": {"limits_enabled": chance(rng, 0.5)}}},
        lambda: {"set": {"output": rng.choice((*out, within(rng, out), within(rng, out)))}},
        lambda: {"set": {"bias": rng.choice((*out, within(rng, out), within(rng, out)))}},
        lambda: {"set": {"algorithm": rng.choice(("position", "velocity"))}},
        lambda: {"set": {"output": {"limits": [within(rng, out, 0, 0.5), within(rng, out, 0.5, 1)]}}},
        lambda: {"set": {"derivative_gain_limit": rng.choice((1, 10))}},
        lambda: {"set": {"derivative_gain_limit_enabled": chance(rng, 0.5)}},
        lambda: {"set": {"error": {"deadband": share(ends, rng.uniform(0, 0.1))}}},
        lambda: {"set": {"error": {"deadband_enabled": chance(rng, 0.5)}}},
        lambda: {"set": {"error": {"curve": rng.choice(("linear", "squared"))}}},
        lambda: {"set": {"bias_freeze": chance(rng, 0.5)}},
        lambda: {"set": {"bumpless": rng.choice(("I", "II"))}},
        lambda: {"set": {"action": rng.choice(("direct", "reverse"))}},
        lambda: {"set": {"sample_rate": round(base * rng.randint(1, 4), 4)}},
        lambda: {"set": {"alarms": {"hysteresis": share(pv, rng.uniform(0, 0.03))}}},
        lambda: {"set": {"alarms": {"pv": {"high": within(rng, pv)}}}},
        lambda: {"set": {"alarms": {"pv": {"enabled": chance(rng, 0.6)}}}},
        lambda: {"set": {"alarms": {"deviation": {"enabled": chance(rng, 0.6)}}}},
        lambda: {"set": {"alarms": {"deviation": {"yellow": share(pv, rng.uniform(0, 0.2))}}}},
        lambda: {"set": {"alarms": {"rate_of_change_enabled": chance(rng, 0.6)}}},
    ]
    made = [rng.choice(choices)() for _ in range(rng.choice((0, 1, 2, 3, 5, 8)))]
    if "ramp_soak" in entry:
        made += [{"ramp_soak": "start"}]
        if chance(rng, 0.2):
            made += [{"set": {"ramp_soak": {"enabled": on}}} for on in (False, True)]
        made += [{"ramp_soak": rng.choice(("start", "hold", "resume", "jog"))} for _ in range(rng.randrange(6))]
    return [{"at": moment(rng, base, duration), "loop": entry["name"], **event} for event in made]
