"""Random CLICK loops with plants and events."""

from __future__ import annotations

from reference.cases import chance, halves, in_order, moment, number, plant, rates, sensor_events, stands_at, within

BASES = (0.1, 0.2, 0.25, 0.5, 1.0)
CO = [0, 100]


def random_case(rng):
    """A PLC of one to three loops with their plants, and events."""
    count = rng.choice((1, 1, 2, 3))
    base, sample_rates = rates(rng, count, BASES)
    duration = round(base * rng.randint(60, 160), 4)
    loops, plants, events, initial = [], {}, [], {}
    for i, rate in enumerate(sample_rates):
        name = "ABC"[i]
        entry = loop_entry(rng, name, i, rate)
        if chance(rng, 0.4):
            entry |= {key: halves(entry[key]) for key in ("pv", "setpoint", "output", "error", "alarms")}
        loops.append(entry)
        span = entry["pv"]["range"]
        if chance(rng, 0.15):
            plants[name], initial[name] = tuning(rng, entry, rate)
            events += tuning_events(rng, name, base, duration)
            continue
        plants[name] = plant(rng, span, CO, rate, rises=(entry["action"] == "direct") != chance(rng, 0.15))
        if chance(rng, 0.5):
            initial[name] = rng.choice((*entry["output"]["limits"], *[within(rng, CO, -0.05, 1.05)] * 4))
        events += loop_events(rng, entry, base, duration) + sensor_events(rng, name, span, duration)
        events += stands_at(rng, name, edges(entry), base, duration)
    if chance(rng, 0.25):
        at = moment(rng, base, duration)
        events += [{"at": at, "plc": "stop"}, {"at": number(rng, at, duration), "plc": "run"}]
    configuration = {"pidcfg": 1, "vendor": "click", "loops": loops}
    scenario = {"duration": duration, "plants": plants, "events": in_order(events), "seed": rng.randint(0, 9999)}
    if initial:
        scenario["initial"] = initial
    if chance(rng, 0.7):
        scenario["step"] = base
    return configuration, scenario


def loop_entry(rng, name, index, rate):
    """The configuration of a loop; every switch is written, so that an event on its value leaves it alone."""
    low = number(rng, -100, 100, 1)
    span = [low, round(low + number(rng, 2, 900, 1), 1)]
    width = span[1] - span[0]
    squared = chance(rng, 0.2)
    gain = 100 / width * rng.choice((rng.uniform(0.1, 3), rng.uniform(0.1, 20))) / (width if squared else 1)
    entry = {
        "name": name,
        "bits": f"C{101 + 50 * index}",
        "integers": f"DS{101 + 20 * index}",
        "floats": f"DF{101 + 30 * index}",
        "mode": rng.choice(("auto", "auto", "manual")),
        "action": rng.choice(("direct", "reverse")),
        "action_verified": True,
        "sample_rate": f"{round(rate * 1000)} ms",
        "bumpless": rng.choice((1, 2)),
        "freeze_bias": chance(rng, 0.5),
        "tuning": {
            "proportional_gain": max(round(gain, 4), 0.01),
            "reset_time": rng.choice((number(rng, 0.5, 30), number(rng, 5, 300), 6000)),
            "derivative_gain": rng.choice((0, 0, number(rng, 0.05, 5))),
        },
        "derivative_gain_limit": rng.choice((0, 1, 8, 20, 99, 100)),
        "derivative_gain_limit_enabled": chance(rng, 0.6),
        "pv": {"range": span, "filter": rng.choice((1, 10, 50, 99, 100)), "filter_enabled": chance(rng, 0.4)},
        "setpoint": {
            "value": within(rng, span, -0.1, 1.1),
            "lower_limit": within(rng, span, 0, 0.6),
            "upper_limit": within(rng, span, 0.4, 1),
            "lower_limit_enabled": chance(rng, 0.4),
            "upper_limit_enabled": chance(rng, 0.4),
        },
        "output": {"limits": rng.choice(([0, 100], [0, 100], [within(rng, CO, 0, 0.4), within(rng, CO, 0.6, 1)]))},
        "error": {
            "curve": "squared" if squared else "linear",
            "deadband": round(width * rng.choice((0, 0.01, 0.1)) * (width if squared else 1) ** 0.8, 3),
            "deadband_enabled": chance(rng, 0.4),
        },
        "alarms": alarms(rng, span),
    }
    if chance(rng, 0.15):
        del entry["setpoint"]["value"]
    if chance(rng, 0.3):
        entry["output"]["pwm"] = {"bit": f"Y00{1 + index}", "period": rng.choice((1, 2, 5, 30))}
    if chance(rng, 0.3):
        entry["state"] = {"output": within(rng, CO), "bias": within(rng, CO)}
    return entry


def tuning(rng, entry, rate):
    """A loop that tunes itself by a relay: the PV begins at the set point, and answers to the output."""
    low, high = entry["pv"]["range"]
    entry["autotune"] = {"method": "closed", "type": rng.choice(("PID", "PI")), "hysteresis": rng.choice((1, 2, 10))}
    entry |= {"mode": "auto", "bumpless": 1, "state": {}, "error": entry["error"] | {"curve": "linear"}}
    entry["setpoint"] |= {"lower_limit_enabled": False, "upper_limit_enabled": chance(rng, 0.1)}
    entry["setpoint"].pop("value", None)
    start, middle = within(rng, CO, 0.4, 0.6), within(rng, (low, high), 0.35, 0.65)
    gain = rng.uniform(0.3, 1.2) * (high - low) / 100 * (1 if entry["action"] == "direct" else -1)
    plant = {"model": "first_order", "gain": gain, "load": round(middle - gain * start, 4), "initial": middle}
    plant |= {"time_constant": round(rate * rng.uniform(2, 12), 3), "dead_time": round(rate * rng.randint(0, 3), 4)}
    plant["noise"] = round((high - low) * rng.choice((0, 0, 0.0003, 0.003)), 4)
    return plant, start


def tuning_events(rng, name, base, duration):
    """The start of an autotune, and what may come between."""
    made = [{"at": moment(rng, base, duration / 8), "loop": name, "autotune": "start"}]
    more = rng.choice(((), (), (), ({"mode": "manual"}, {"mode": "auto"}), ({"autotune": "cancel"},)))
    return made + [{"at": moment(rng, base, duration), "loop": name, **event} for event in more]


def edges(entry):
    """PVs at which something begins or ends, and those beside them."""
    alarms, band = entry["alarms"], entry["alarms"]["hysteresis"]
    sp, dead = entry["setpoint"].get("value", 0), entry["error"]["deadband"]
    points = [*entry["pv"]["range"], sp, sp + dead, sp - dead]
    points += [x for x in alarms["pv"].values() if not isinstance(x, bool)]
    points += [sp + side * alarms["deviation"][name] for side in (-1, 1) for name in ("high", "high_high")]
    if dead > 0:
        points += [sp + dead**0.5, sp - dead**0.5]
    points += [sp + alarms["rate_of_change"], sp]
    return [round(x + n, 4) for x in points for n in (0, band, -band)]


def alarms(rng, span):
    """Alarms that a PV passes."""
    width = span[1] - span[0]
    points = sorted(within(rng, span) for _ in range(4))
    return {
        "pv": {
            **dict(zip(("low_low", "low", "high", "high_high"), points, strict=True)),
            "enabled": chance(rng, 0.6),
        },
        "deviation": {
            "high": round(width * rng.uniform(0.02, 0.2), 2),
            "high_high": round(width * rng.uniform(0.1, 0.4), 2),
            "enabled": chance(rng, 0.6),
        },
        "rate_of_change": round(width * rng.choice((0.005, 0.02, 0.1)), 3),
        "rate_of_change_enabled": chance(rng, 0.6),
        "hysteresis": round(width * rng.choice((0, 0.005, 0.02, 0.1)), 3),
    }


def loop_events(rng, entry, base, duration):
    """What an operator and a ladder program do to a loop."""
    span = entry["pv"]["range"]
    width = span[1] - span[0]
    choices = [
        lambda: {"mode": rng.choice(("auto", "manual"))},
        lambda: {"mode": "auto"},
        lambda: {"mode": "manual"},
        lambda: {"set": {"setpoint": within(rng, span)}},
        lambda: {"set": {"setpoint": within(rng, span)}},
        lambda: {"set": {"tuning": {"proportional_gain": max(round(100 / width * rng.uniform(0.1, 5), 3), 0.01)}}},
        lambda: {"set": {"tuning": {"reset_time": number(rng, 0.5, 60)}}},
        lambda: {"set": {"tuning": {"derivative_gain": number(rng, 0, 5)}}},
        lambda: {"set": {"derivative_gain_limit": rng.choice((0, 5, 20, 100))}},
        lambda: {"set": {"derivative_gain_limit_enabled": chance(rng, 0.5)}},
        lambda: {"set": {"pv": {"filter": rng.choice((5, 50, 100))}}},
        lambda: {"set": {"setpoint": {"lower_limit": within(rng, span, 0, 0.6)}}},
        lambda: {"set": {"setpoint": {"upper_limit": within(rng, span, 0.4, 1)}}},
        lambda: {"set": {"output": rng.choice((*entry["output"]["limits"], within(rng, CO), within(rng, CO)))}},
        lambda: {"set": {"bias": rng.choice((*entry["output"]["limits"], within(rng, CO), within(rng, CO)))}},
        lambda: {"set": {"output": {"limits": [within(rng, CO, -0.05, 0.5), within(rng, CO, 0.5, 1)]}}},
        lambda: {"set": {"error": {"deadband": round(width * rng.uniform(0, 0.1), 3)}}},
        lambda: {"set": {"error": {"curve": rng.choice(("linear", "squared"))}}},
        lambda: {"set": {"freeze_bias": chance(rng, 0.5)}},
        lambda: {"set": {"bumpless": rng.choice((1, 2))}},
        lambda: {"set": {"action": rng.choice(("direct", "reverse"))}},
        lambda: {"set": {"sample_rate": f"{round(base * rng.randint(1, 4) * 1000)} ms"}},
        lambda: {"set": {"alarms": {"hysteresis": round(width * rng.uniform(0, 0.1), 3)}}},
        lambda: {"set": {"alarms": {"pv": {"high": within(rng, span)}}}},
        lambda: {"set": {"alarms": {"pv": {"enabled": chance(rng, 0.5)}}}},
        lambda: {"set": {"alarms": {"deviation": {"high": round(width * rng.uniform(0, 0.2), 2)}}}},
        lambda: {"set": {"pv": {"filter_enabled": chance(rng, 0.5)}}},
        lambda: {"set": {"setpoint": {"lower_limit_enabled": chance(rng, 0.5)}}},
        lambda: {"set": {"setpoint": {"upper_limit_enabled": chance(rng, 0.5)}}},
        lambda: {"set": {"error": {"deadband_enabled": chance(rng, 0.5)}}},
    ]
    made = [rng.choice(choices)() for _ in range(rng.choice((0, 1, 2, 3, 5, 8)))]
    return [{"at": moment(rng, base, duration), "loop": entry["name"], **event} for event in made]
