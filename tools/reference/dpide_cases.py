"""Random DPIDE loops with events."""

from __future__ import annotations

from reference.cases import stands_at

GAINS = (0.0, 0.3, 0.5, 1.0, 2.5, 7.3, -1.0)
BITS = ("PID_EQ", "PID_DE", "PID_DIR")


def random_case(rng):
    """A configuration of one to three loops and a scenario, as plain data."""
    loops = [random_loop(rng, i) for i in range(rng.choice([1, 1, 2, 3]))]
    share_devices(rng, loops)
    configuration = {"pidcfg": 1, "vendor": "dpide", "loops": loops}
    if rng.random() < 0.1:
        configuration["plc"] = {"interrupt_task": rng.choice([100, 250])}
    duration = rng.choice([20, 40])
    scenario = {
        "duration": duration,
        "step": rng.choice([0.1, 0.05]),
        "plants": {loop["name"]: random_plant(rng, loop) for loop in loops},
        "events": [random_event(rng, loops, duration) for _ in range(rng.randrange(14))],
    }
    for loop in loops:
        scenario["events"] += stands_at(rng, loop["name"], edges(loop), scenario["step"], duration, 0.2)
    scenario["events"].sort(key=at)
    return configuration, scenario


def edges(loop):
    """PVs at the set point and at the ends of the dead band, and beside them."""
    sv, band = loop["SV"], loop["ERR_DBW"]
    return [sv + n for n in (0, 0, band, -band, band / 2, -band / 2, band + 0.5, -band - 0.5, 0.5, -0.5, 20)]


def at(event):
    """When an event happens."""
    return event["at"]


def random_loop(rng, number):
    """One instruction."""
    loop = {
        "name": f"L{number}",
        "device": f"D{500 + 30 * number}",
        "SV": rng.choice([30.0, 50.0, 47.3]),
        "PID_MODE": rng.choice([0, 0, 2]),
        "PID_MAN": rng.random() < 0.2,
        "PID_RUN": rng.random() < 0.9,
        "MOUT_AUTO": rng.random() < 0.5,
        "CYCLE": rng.choice([100, 200, 500, 1000, 0]),
        "Kc_Kp": rng.choice(GAINS),
        "Ti_Ki": rng.choice([0.0, 0.2, 3.0, 12.5, 60.0, -2.0]),
        "Td_Kd": rng.choice([0.0, 0.0, 0.4, 2.0, -1.0]),
        "Tf": rng.choice([0.0, 0.0, 0.3, 2.0, -1.0]),
        "ERR_DBW": rng.choice([0.0, 0.0, 2.0, -5.0, 10.0]),
        "MOUT": rng.choice([0.0, 25.0, 110.0]),
        "BIAS": rng.choice([0.0, 0.0, 12.3, -30.0]),
    }
    if rng.random() < 0.02:
        loop[rng.choice(["Kc_Kp", "Ti_Ki", "Td_Kd", "SV", "BIAS"])] = rng.choice([3e38, -3e38, 1e-40])
    if rng.random() < 0.02:
        # P and D of an infinite size against each other
        loop |= {"Kc_Kp": 3e38, "Td_Kd": 2.0, "Tf": 0.3}
    loop |= {name: rng.random() < 0.5 for name in BITS}
    low, high = rng.choice([(0.0, 100.0), (10.0, 90.0), (-50.0, 50.0), (100.0, 0.0), (0.0, 30.0)])
    return loop | {"MV_MIN": low, "MV_MAX": high}


def share_devices(rng, loops):
    """Operands of several loops in one device, a cascade, and a MOUT that is its own MV."""
    for i, loop in enumerate(loops):
        devices = {"MV": f"D{100 + 2 * i}"}
        if rng.random() < 0.15:
            devices["MOUT"] = devices["MV"]
        if rng.random() < 0.3:
            devices["PID_RUN"], loop["PID_RUN"] = "M1", True
        if rng.random() < 0.3:
            devices["SV"], loop["SV"] = "D200", 50.0
        elif i and rng.random() < 0.5:
            devices[rng.choice(["SV", "BIAS", "MOUT"])] = f"D{100 + 2 * rng.randrange(i)}"
        elif i + 1 < len(loops) and rng.random() < 0.3:
            devices[rng.choice(["SV", "BIAS", "MOUT"])] = f"D{102 + 2 * i}"
        loop["devices"] = devices


def random_plant(rng, loop):
    """A plant that answers, mostly in the direction that the loop takes for granted."""
    gain = rng.choice([0.5, 1.0, 2.0]) * (1 if loop["PID_DIR"] == (rng.random() < 0.85) else -1)
    return {
        "model": "first_order",
        "gain": gain,
        "load": rng.choice([0.0, 40.0, 60.0]),
        "time_constant": rng.choice([1.0, 4.0, 15.0]),
        "dead_time": rng.choice([0.0, 0.5]),
        "initial": rng.choice([10.0, 48.0, 70.0]),
        "noise": rng.choice([0.0, 0.0, 0.3]),
    }


def random_event(rng, loops, duration):
    """One event."""
    time = {"at": round(rng.uniform(0, duration), rng.choice([1, 2]))}
    loop = rng.choice(loops)
    kind = rng.random()
    if kind < 0.04:
        return time | {"plc": rng.choice(["stop", "run"])}
    if kind < 0.3:
        return time | {"loop": loop["name"], "mode": rng.choice(["manual", "auto", "auto", "off"])}
    if kind < 0.4:
        return time | {"loop": loop["name"], "disturb": {"load": rng.choice([0.0, 40.0, 80.0])}}
    key = rng.choice(["SV", "SV", "output", *(name for name in loop if name not in {"name", "device", "devices"})])
    if isinstance(loop.get(key), bool):
        value = rng.random() < 0.5
    elif key == "PID_MODE":
        value = rng.choice([0, 2])
    elif key == "CYCLE":
        value = rng.choice([100, 300, 1000, 41000])
    elif key in {"SV", "output", "MOUT"}:
        value = rng.choice([20.0, 50.0, 55.5, 80.0, 120.0])
    else:
        value = random_loop(rng, 0)[key]
    return time | {"loop": loop["name"], "set": {key: value}}
