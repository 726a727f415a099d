"""Runs of NextoPID programs for tests: configurations as YAML text, scenarios on them, and what came out."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.api import check_text
from pidcfg.encoders.nextopid.image import encode
from pidcfg.schemas.nextopid import NextopidFile
from pidcfg.schemas.scenario import Scenario
from pidcfg.sim.controllers.nextopid import scan as controller
from pidcfg.sim.engine.run import Settings, simulate
from pidcfg.text.source import read_document

if TYPE_CHECKING:
    import random

HEAD = "pidcfg: 1\nvendor: nextopid\nplc: {sample_time: 0.1}\n"
GAINS = "Kp: 1.0, Ti_Ki: 10.0, Td_Kd: 0.525, MinMV: 0.0, MaxMV: 100.0, MinPV: 0.0, MaxPV: 100.0"


def image_of(text):
    """The program of a configuration, which must be sound."""
    data = read_document((HEAD + text).encode(), "x.yaml").data
    encoding = encode(NextopidFile.model_validate(data))
    assert not encoding.misfits, encoding.misfits
    return encoding.image


def plc_of(text):
    """The virtual PLC of a configuration."""
    return controller.load(image_of(text))


def run(text, scenario):
    """The report of a scenario."""
    data = read_document(f"pidcfg: 1\nscenario: S\nconfig: x.yaml\n{scenario}".encode(), "s.yaml").data
    image = image_of(text)
    return simulate(Scenario.model_validate(data), lambda: controller.load(image), controller, Settings())


def findings(text):
    """Codes and messages of a configuration."""
    return [(d.code, d.message) for d in check_text(HEAD + text).findings]


# --- random programs -------------------------------------------------------------------------------------------------


def random_program(rng: random.Random) -> str:
    """A program with loops of all types, blocks of all types, and wires between them."""
    lines = ["signals: {A: 3.0, B: 40.0, Sw1: true, Sw2: false}", "blocks:"]
    numbers, bools = ["A", "B", "0.5", "7"], ["Sw1", "Sw2"]
    for i in range(rng.randrange(1, 7)):
        kind, given, outputs = rng.choice(BLOCKS)
        lines.append(f"  - {{name: B{i}, type: {kind}, {given(rng, numbers)}}}")
        numbers += [f"B{i}.{name}" for name in outputs]
    lines.append("loops:")
    pids = []
    for i in range(rng.randrange(1, 5)):
        lines.append(f"  - {{name: L{i}, type: {random_loop(rng, numbers, bools)}}}")
        if "ON_OFF" in lines[-1]:
            continue
        numbers.append(f"L{i}.MV")
        bools += [f"L{i}.{name}" for name in ("TRK_OUT", "Windup_H_OUT", "Windup_L_OUT")]
        pids.append(f"L{i}")
    lines += moves(rng, numbers, bools, pids)
    return "\n".join(lines) + "\n"


def condition(rng, numbers, bools):
    """A wire of a BOOL."""
    a, b, one, two = rng.choice(numbers[:2]), rng.choice(numbers), rng.choice(bools), rng.choice(bools)
    sign = rng.choice(["<", "<=", ">", ">=", "=", "<>"])
    word = rng.choice(["AND", "OR", "XOR", "="])
    return (
        f"'{rng.choice([f'NOT {one}', f'{one} {word} NOT {two}', f'{a} {sign} {b} AND {one}', f'{a} {sign} 1 / {b}'])}'"
    )


def moves(rng, numbers, bools, loops):
    """What a program copies: to its signals, and to inputs of its loops."""
    rows = []
    for _ in range(rng.randrange(4)):
        value, target = rng.choice([(expression(rng, numbers), "A"), (condition(rng, numbers, bools), "Sw2")])
        when, place = condition(rng, numbers, bools), rng.choice(["start", "end"])
        rows.append(f"  - {{move: {value}, to: {target}, when: {when}, at: {place}}}")
    if loops:
        rows.append(f"  - {{move: {loops[0]}.MV, to: {loops[0]}.MaxVarMV, when: {condition(rng, numbers, bools)}}}")
    return ["moves:", *rows] if rows else []


def expression(rng, numbers):
    """A wire of numbers."""
    a, b = rng.choice(numbers), rng.choice(numbers)
    forms = [f"{a} + {b} * 0.3", f"max({a}, {b})", f"-({a}) / 3", f"{a} / ({b})", f"sqrt(abs({a}))", f"sqrt({a})"]
    return f"'{rng.choice(forms)}'" if rng.random() < 0.7 else a


BLOCKS = [
    ("ControlLowFilter", lambda r, n: f"InVar: {expression(r, n)}, Tc: {r.choice([0.2, 3, 0])}", ("OutVar",)),
    ("ControlDelay", lambda r, n: f"InVar: {expression(r, n)}, DelayTime: {r.choice([0, 0.5, 9.7, 30])}", ("OutVar",)),
    ("ControlLag", lambda r, n: f"InVar: {expression(r, n)}, Gs: 2, Tc: 3, Max_OutVar: 90", ("OutVar",)),
    (
        "ControlDelayLag",
        lambda r, n: f"InVar: {expression(r, n)}, DelayTime: 1, Gs: 0.7, Tc: 8, Offset: 1, Max_OutVar: 200",
        ("OutVar",),
    ),
    (
        "ControlLeadLag",
        lambda r, n: f"InVar: {expression(r, n)}, G: 1, Tlead: 4, Tlag: 2, Min_OutVar: -90, Max_OutVar: 90",
        ("OutVar",),
    ),
    ("ControlPWM", lambda r, n: f"MV: {expression(r, n)}, MaxMV: 100, Period: {r.choice([1, 10, 30])}", ()),
    ("ControlSelectMax", lambda r, n: f"MV1: {expression(r, n)}, MV2: {expression(r, n)}", ("MV",)),
    ("ControlSelectMin", lambda r, n: f"MV1: {expression(r, n)}, MV2: {expression(r, n)}", ("MV",)),
    ("ControlSplitRange", lambda r, n: f"MV: {expression(r, n)}, SPLIT: 40, Mode: {r.randrange(1, 5)}", ("MV1", "MV2")),
    ("ControlON_OFF", lambda r, n: f"SP: 40, PV: {expression(r, n)}, DeadBand: 2, MinPV: 0, MaxPV: 100", ()),
]


def random_loop(rng, numbers, bools):
    """The parameters of one controller."""
    kind = rng.choice(["PIDA_REAL", "PIDA_INT", "PIDA_TUNE_REAL", "PIDA_TUNE_INT", "ControlON_OFF"])
    if kind == "ControlON_OFF":
        return f"{kind}, SP: 40, DeadBand: 1.5, MinPV: 0, MaxPV: 100, Direct: {rng.choice(['true', 'false'])}"
    wired = numbers[:2] + numbers[4:]
    given = {
        "SP": rng.choice(["40", "60", "B"]),
        "Kp": rng.choice([0, 0.5, 2.25]),
        "Ti_Ki": rng.choice([0, 2, 15]),
        "Td_Kd": rng.choice([0, 0.4]),
        "Tfd": rng.choice([0, 0.7]),
        "MinMV": rng.choice([0, 20]),
        "MaxMV": 100,
        "MinPV": 0,
        "MaxPV": 100,
        "MaxVarMV": rng.choice([0, 0, 3]),
        "DeadBand": rng.choice([0, 0, 4]),
        "BIAS": rng.choice(["0", "5", expression(rng, wired)]),
        "ManualMV": rng.choice(["30", "A"]),
        "TRK_VAL": rng.choice(["10", expression(rng, wired)]),
        "SP_CASC": rng.choice(["50", expression(rng, wired)]),
    }
    for name in ("Indep", "DisableP", "DerivEr", "CASC", "Direct", "TRK_IN", "OVERR", "Windup_H_IN", "Windup_L_IN"):
        given[name] = rng.choice(["false", "false", "true", rng.choice(bools), condition(rng, numbers, bools)])
    if "TUNE" in kind:
        given["AutoTuneParam"] = "{PercAmpMV: 10, PercHystPV: 0.5, PercMaxPeakPV: 40, NumCycles: 2, Mode: PID}"
    if rng.random() < 0.3:
        given["sample_time"] = 0.3
    return f"{kind}, " + ", ".join(f"{key}: {value}" for key, value in given.items())
