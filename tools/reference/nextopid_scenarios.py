"""Plants and events of random NextoPID programs, and the moves that show what a run does not show by itself."""

from __future__ import annotations

from reference.cases import stands_at
from reference.nextopid_blocks import KINDS
from reference.nextopid_pid import ERRORS, WARNINGS
from reference.nextopid_tune import FLAGS, GAINS

ACTIONS = ("ProportionalAction", "DerivativeAction", "IntegralAction", "SampleTime")
TOLD = ("TRK_OUT", "Windup_H_OUT", "Windup_L_OUT")
MORE = 8
"""Other outputs of a block that a case shows."""


def mirrors(case):
    """Moves that show the outputs which a run does not show by itself."""
    for block in [*case.blocks, *case.loops]:
        outputs = [("REAL", n) for n in ACTIONS] + [("BOOL", n) for n in TOLD]
        outputs += [("BOOL", f"ErrBits.{n}") for n in ERRORS] + [("BOOL", f"WarnBits.{n}") for n in WARNINGS]
        if "TUNE" in block["type"]:
            outputs += [("BOOL", "AutoTuneDone"), ("BOOL", "AutoTuneError")]
            outputs += [("REAL", f"AutoTuneResult.{n}") for n in GAINS]
            outputs += [("BOOL", f"AutoTuneResult.{n}") for n in FLAGS]
        if block["type"] in KINDS:
            kind = KINDS[block["type"]]
            outputs = [("REAL", n) for n in kind.OUT_REALS] + [("BOOL", n) for n in kind.OUT_BOOLS]
            always = 0
        else:
            always = len(ACTIONS) + len(TOLD)
        more = outputs[always:]
        for kind, output in outputs[:always] + case.rng.sample(more, min(MORE, len(more))):
            mirror = f"M_{block['name']}_{output.replace('.', '_')}"
            case.signals[mirror] = 0.0 if kind == "REAL" else False
            case.moves.append({"move": f"{block['name']}.{output}", "to": mirror})


def random_scenario(case, duration):
    """Plants and events of a `nextopid_cases.Case`."""
    plants = {loop["name"]: random_plant(case, loop) for loop in case.loops if "PV" not in loop} | case.plants
    few = bool(case.plants)  # a loop that tunes itself is left alone, mostly
    events = [random_event(case, duration) for _ in range(case.rng.randrange(2 if few else 12))]
    for loop in case.loops:
        if loop.get("AutoTune") is False:
            events += tune_events(case.rng, loop["name"], duration * (0.1 if few else 0.4), duration)
    for loop in case.loops if not few else ():
        if "PV" not in loop:
            events += stands_at(case.rng, loop["name"], edges(loop), case.task, duration, 0.15)
    events = [event for event in events if event]
    return {"duration": duration, "plants": plants, "events": sorted(events, key=lambda event: event["at"])}


def edges(loop):
    """PVs at the set point, at the ends of the dead band and of the PV's limits, and beside them."""
    plain = {key: value for key, value in loop.items() if isinstance(value, int | float) and value is not True}
    sp, band = plain.get("SP", 50), plain.get("DeadBand", 0)
    points = [sp, sp + band, sp - band, plain.get("MinPV", 0), plain.get("MaxPV", 100)]
    return [*points, *(point + n for point in points for n in (-0.5, 0.5)), 20]


def tune_events(rng, loop, latest, duration):
    """The start of an auto-tuning, and what an operator does then."""
    start = round(rng.uniform(0, latest), 2)
    later = [round(rng.uniform(start, duration), 2) for _ in range(rng.choice([0, 0, 1, 1, 3]))]
    commands = [("start", start), *((rng.choice(["accept", "cancel", "start"]), at) for at in later)]
    return [{"at": at, "loop": loop, "autotune": command} for command, at in commands]


def random_plant(case, loop):
    """A plant that answers, in the direction that the loop takes for granted."""
    rng = case.rng
    gain = rng.choice([0.5, 1.0, 2.0]) * (-1 if loop.get("Direct") is True else 1)
    return {
        "model": "first_order",
        "gain": gain * 50 if loop["type"] == "ControlON_OFF" else gain,
        "load": rng.choice([0.0, 10.0, 60.0]),
        "time_constant": rng.choice([1.0, 4.0]),
        "dead_time": rng.choice([0, 4, 8]) * case.task,
        "initial": rng.choice([10.0, 48.0, 70.0]),
        "noise": rng.choice([0.0, 0.0, 0.02, 0.5]),
    }


def random_event(case, duration):
    """One event; None where it does not fit."""
    rng, loop = case.rng, case.rng.choice(case.loops)
    what = rng.choice([of_signal, of_signal, of_block, of_mode, of_plant, of_parameter, of_parameter])(case, loop)
    return {"at": round(rng.uniform(0, duration), 2)} | what if what else None


def of_signal(case, _loop):
    """A signal changes."""
    values = {"A": [0, 3.3, 60, -8, 30000, 2e38], "B": [5, 20, 24.5, 55.5, 60], "NUM": [1, 3, -7], "T": [0.2, 1.5]}
    values |= {"S1": [True, False], "S2": [True, False]}
    name = case.rng.choice([*values])
    return {"set": {name: case.rng.choice(values[name])}}


def of_block(case, _loop):
    """An input of a block changes that nothing is wired to."""
    if not case.blocks:
        return None
    block = case.rng.choice(case.blocks)
    kind = KINDS[block["type"]]
    free = [key for key in kind.REALS if not isinstance(block.get(key), str)]
    key = case.rng.choice([key for key in free if key not in {"Period", "Mode"}] or [None])
    return {"set": {f"{block['name']}.{key}": case.rng.choice([0, 0.5, 2, 12, 70])}} if key else None


def of_mode(case, loop):
    """A mode is asked for."""
    if any(isinstance(loop.get(key), str) for key in ("Manual", "CASC")):
        return None
    modes = ["manual", "auto"] if loop["type"] == "ControlON_OFF" else ["manual", "auto", "cascade"]
    return {"loop": loop["name"], "mode": case.rng.choice(modes)}


def of_plant(case, loop):
    """A disturbance, or a broken sensor."""
    if "PV" in loop:
        return None
    if case.chance(0.5):
        return {"loop": loop["name"], "pv": case.rng.choice([0, 50, 120]), "for": 1}
    return {"loop": loop["name"], "disturb": {"load": case.rng.choice([0.0, 30.0])}}


def of_parameter(case, loop):
    """A parameter is written."""
    free = [k for k, v in loop.items() if not isinstance(v, str | dict) and k not in {"sample_time", "AutoTune", "PV"}]
    key = case.rng.choice(free)
    if isinstance(loop[key], bool):
        value = case.chance(0.5)
    elif "INT" in loop["type"] or case.chance(0.7):
        value = case.rng.choice([0, 1, 5, 30, 45, 60, 90, -1])
    else:
        value = case.rng.choice([0.3, 0.001, 2.5, 12.25])
    return {"loop": loop["name"], "set": {key: value}}
