"""Random NextoPID programs with events: loops in cascade, override, split range and ratio, and any wires."""

from __future__ import annotations

import json

from pidcfg.api import check
from reference.nextopid_blocks import KINDS
from reference.nextopid_scenarios import TOLD, mirrors, random_scenario

PIDS = ("PIDA_REAL", "PIDA_INT", "PIDA_TUNE_REAL", "PIDA_TUNE_INT")


def random_case(rng):
    """A configuration that can be encoded and a scenario, as plain data."""
    while True:
        configuration, scenario = Case(rng).whole()
        if check(json.dumps(configuration), name="case.yaml").ok:
            return configuration, scenario


class Case:
    """A program as it grows: ``numbers`` and ``bools`` are the names that wires may read."""

    def __init__(self, rng):
        self.rng = rng
        self.task = rng.choice([0.05, 0.1, 0.2, 0.5])
        self.signals = {
            "A": rng.choice([3.0, 3.0, 3.0, 20000.0]),
            "B": 40.0,
            "NUM": "INT#5",
            "T": "500 ms",
            "S1": True,
            "S2": False,
        }
        self.numbers, self.bools = ["A", "B", "NUM", "T", "0.5", "7"], ["S1", "S2"]
        self.blocks, self.loops, self.moves = [], [], []
        self.plants = {}
        """Plants that are no random ones, by loop."""

    def whole(self):
        """The case."""
        rng = self.rng
        shapes = [self.cascade, self.override, self.split, self.ratio, self.chain]
        shape = rng.choice([self.free, self.free, self.tuning, self.tuning, *shapes])
        shape()
        for _ in range(rng.randrange(4)):
            self.block()
        if rng.random() < 0.5:
            self.more_moves()
        mirrors(self)
        configuration = {
            "pidcfg": 1,
            "vendor": "nextopid",
            "plc": {"sample_time": self.task},
            "signals": self.signals,
            "blocks": self.blocks,
            "loops": self.loops,
            "moves": self.moves,
        }
        cycles = 400 if shape == self.tuning else 150
        return configuration, random_scenario(self, round(self.task * cycles, 3))

    def chance(self, share):
        """Whether something happens."""
        return self.rng.random() < share

    # --- wires --------------------------------------------------------------------------------------------------------

    def sum(self):
        """An expression of numbers."""
        a, b = self.rng.choice(self.numbers), self.rng.choice(self.numbers)
        forms = [a, a, f"{a} + {b} * 0.3", f"max({a}, {b}, 1)", f"-({a}) / 3", f"{a} / ({b})", f"sqrt({a} - {b})"]
        text = self.rng.choice(
            [*forms, f"{a} - {b} - 0.1", f"min({a}, 50) * 1.7", f"abs({a}) / {b} / 3", f"{a} * 2 - {b}"]
        )
        return float(text) if text in {"0.5", "7"} else text

    def condition(self):
        """An expression of a BOOL."""
        a, b, one, two = *self.rng.choices(self.numbers, k=2), *self.rng.choices(self.bools, k=2)
        sign, word = self.rng.choice(["<", "<=", ">", ">=", "=", "<>"]), self.rng.choice(["AND", "OR", "XOR", "="])
        forms = [one, f"NOT {one}", f"{one} {word} NOT {two}", f"{a} {sign} {b} AND {one}", f"{a} {sign} 1 / {b}"]
        return self.rng.choice([*forms, f"{one} OR {two} AND {a} {sign} {b}", f"NOT ({a} {sign} {b}) = {one}"])

    def number(self, *values, wired=0.25):
        """A value, or a wire."""
        return self.sum() if self.chance(wired) else self.rng.choice(values)

    def flag(self, *, true=0.2, wired=0.1):
        """A switch, or a wire."""
        return self.condition() if self.chance(wired) else self.chance(true)

    # --- loops --------------------------------------------------------------------------------------------------------

    def pid(self, kind=None, **given):
        """One PID controller."""
        rng = self.rng
        kind = kind or rng.choice(PIDS)
        name = f"L{len(self.loops)}"
        low, high = rng.choice([(0, 100), (0, 100), (20, 80), (-50, 50)])
        loop = {
            "name": name,
            "type": kind,
            "SP": self.number(40, 60, 47, wired=0.05),
            "Kp": self.number(0, 0.5, 1.3, 2.25, 3.7, wired=0.03),
            "Ti_Ki": self.number(0, 0.0005, 0.001, 0.7, 5, 15, wired=0.03),
            "Td_Kd": self.number(0, 0, 0.4, 2, wired=0.03),
            "Tfd": self.number(0, 0, 0.7, 3, wired=0.03),
            "MinMV": self.number(low, wired=0.03),
            "MaxMV": self.number(high, wired=0.03),
            "MinPV": self.number(0, 0, 30, wired=0.03),
            "MaxPV": self.number(100, 100, 55, wired=0.03),
            "MaxVarMV": self.number(0, 0, 1, 3, wired=0.03),
            "DeadBand": self.number(0, 0, 0, 2, 5, wired=0.03),
            "BIAS": self.number(0, 0, 5, -20, wired=0.1),
            "ManualMV": self.number(30, 110, wired=0.05),
            "TRK_VAL": self.number(10, 70, wired=0.2),
            "SP_CASC": self.number(50, 20, wired=0.2),
            "Indep": self.flag(true=0.4, wired=0.03),
            "DisableP": self.flag(true=0.1, wired=0.03),
            "DerivEr": self.flag(true=0.4, wired=0.03),
            "Direct": self.flag(true=0.4, wired=0.03),
            "CASC": self.flag(true=0.2, wired=0.05),
            "Manual": self.flag(true=0.1, wired=0.05),
            "TRK_IN": self.flag(true=0.05, wired=0.05),
            "OVERR": self.flag(true=0.05, wired=0.05),
            "Windup_H_IN": self.flag(true=0.1, wired=0.1),
            "Windup_L_IN": self.flag(true=0.1, wired=0.1),
        }
        if "TUNE" in kind:
            loop["AutoTuneParam"] = self.tune_parameters()
            loop["AutoTune"] = self.flag(true=0.05, wired=0.05)
        if self.chance(0.25):
            loop["sample_time"] = round(self.task * rng.choice([2, 3]), 3)
        if self.chance(0.15):
            loop["PV"] = self.sum()
        loop |= given
        self.loops.append({key: content for key, content in loop.items() if content is not None})
        self.numbers += [f"{name}.{output}" for output in ("MV", "SP", "PV", "IntegralAction", "DerivativeAction")]
        self.bools += [f"{name}.{output}" for output in (*TOLD, "WarnBits.MV_MaxMV", "ErrBits.Kp", "Manual")]
        return name

    def tune_parameters(self):
        """Parameters of an auto-tuning, one of them sometimes out of its range."""
        rng = self.rng
        given = {
            "PercAmpMV": rng.choice([5, 10, 20]),
            "PercHystPV": rng.choice([0.1, 0.5, 1]),
            "PercMaxPeakPV": rng.choice([10, 40]),
            "NumCycles": rng.choice([1, 2, 3]),
            "Mode": rng.choice(["P", "PI", "PID"]),
        }
        if self.chance(0.1):
            given["PercAmpMV"] = self.sum()
        if self.chance(0.1):
            given["PercHystPV"] = self.sum()
        if self.chance(0.1):
            given["NumCycles"] = "NUM"
        if self.chance(0.1):
            given["PercMaxPeakPV"] = self.sum()
        return given

    def free(self):
        """Any loops, wired in any way."""
        for _ in range(self.rng.randrange(1, 4)):
            if self.chance(0.5):
                self.block()
            if self.chance(0.15):
                self.on_off()
            else:
                self.pid()

    def on_off(self):
        """An on-off controller."""
        rng = self.rng
        name = f"L{len(self.loops)}"
        loop = {
            "name": name,
            "type": "ControlON_OFF",
            "SP": self.number(40, 60),
            "DeadBand": self.number(0, 1.5, 5, wired=0.1),
            "MinPV": rng.choice([0, 30]),
            "MaxPV": rng.choice([100, 55]),
            "Direct": self.flag(),
            "Manual": self.flag(),
            "ManualMV": self.flag(),
        }
        self.loops.append(loop)
        self.bools += [f"{name}.MV", f"{name}.WarnBits.PV_MaxPV"]

    def cascade(self):
        """A cascade with its special connections (figure 16-4)."""
        kind = self.rng.choice(PIDS)
        plain = {"Manual": False, "TRK_IN": False, "OVERR": False, "MinPV": 0, "MaxPV": 100, "MinMV": 0, "MaxMV": 100}
        order = ["L0", "L1"] if self.chance(0.5) else ["L1", "L0"]
        master, slave = order
        for name in ("L0", "L1"):
            if name == master:
                special = {
                    "TRK_IN": f"{slave}.TRK_OUT",
                    "TRK_VAL": f"{slave}.PV",
                    "Windup_H_IN": f"{slave}.Windup_H_OUT",
                    "Windup_L_IN": f"{slave}.Windup_L_OUT",
                    "CASC": False,
                }
            else:
                special = {"CASC": self.rng.choice([True, True, "S1"]), "SP_CASC": f"{master}.MV", "PV": None}
            self.pid(kind, **plain | special)

    def override(self):
        """Two loops and a selector (figure 16-5)."""
        kind = self.rng.choice(["ControlSelectMin", "ControlSelectMax"])
        self.blocks.append({"name": "SEL1", "type": kind, "MV1": "L0.MV", "MV2": "L1.MV"})
        for i in (1, 2):
            self.pid(OVERR=f"SEL1.OVERR{i}", TRK_VAL="SEL1.MV", Manual=False, TRK_IN=False)
        self.numbers.append("SEL1.MV")

    def split(self):
        """A loop with two valves."""
        self.pid(MinMV=0, MaxMV=self.rng.choice([100, 100, 120]), Kp=2)
        mode, point = self.rng.randrange(1, 5), self.number(40, 50, 25.5, wired=0.1)
        self.blocks.append({"name": "SPLIT1", "type": "ControlSplitRange", "MV": "L0.MV", "SPLIT": point, "Mode": mode})
        self.numbers += ["SPLIT1.MV1", "SPLIT1.MV2"]

    def ratio(self):
        """Ratio control with a filter, and a feed-forward (figures 16-6 and 16-7)."""
        lead = {"G": 1.2, "Tlead": 4, "Tlag": self.rng.choice([2, 0.3]), "Min_OutVar": -50, "Max_OutVar": 90}
        self.blocks += [
            {"name": "F1", "type": "ControlLowFilter", "InVar": "B", "Tc": 1.5},
            {"name": "D1", "type": "ControlDelay", "InVar": "A", "DelayTime": self.rng.choice([0.5, "T", 2])},
            {"name": "LL1", "type": "ControlLeadLag", "InVar": "D1.OutVar", **lead},
        ]
        self.pid(SP_CASC="1.3 * F1.OutVar", CASC=True, BIAS="LL1.OutVar * 2")
        self.numbers += ["F1.OutVar", "D1.OutVar", "LL1.OutVar"]

    def chain(self):
        """An on-off controller at the edges of its band, a lag at its limits and a lead/lag that is disabled."""
        rng = self.rng
        band = {"SP": 40, "DeadBand": rng.choice([0, 15.5, 20]), "MinPV": 0, "MaxPV": 100, "PV": "B"}
        self.loops.append({"name": "L0", "type": "ControlON_OFF", "Direct": self.chance(0.5), **band})
        limits = {"Min_OutVar": rng.choice([0, 30]), "Max_OutVar": rng.choice([60, 90])}
        lag = {"Gs": rng.choice([2, -0.7]), "Tc": rng.choice([0.5, 2]), "Init_OutVar": 45, **limits}
        lead = {"G": 1.5, "Tlead": 1, "Tlag": rng.choice([0.5, 3]), "Disable": rng.choice(["S1", "S2"]), **limits}
        self.blocks += [
            {"name": "LAG1", "type": "ControlLag", "InVar": "B", **lag},
            {"name": "LL1", "type": "ControlLeadLag", "InVar": "B - 10", **lead},
        ]
        self.numbers += ["LAG1.OutVar", "LL1.OutVar"]
        self.bools.append("L0.MV")

    def tuning(self):
        """A loop that tunes itself."""
        self.task = self.rng.choice([0.1, 0.2, 0.25])
        kind = self.rng.choice(PIDS[2:])
        given = {"MinPV": 0, "MaxPV": 100, "Manual": self.chance(0.8), "ManualMV": 40, "TRK_IN": False, "OVERR": False}
        direct = self.chance(0.4)
        if self.chance(0.8):
            mode = self.rng.choice(["P", "PI", "PID"])
            steps = {"PercAmpMV": 5, "PercHystPV": self.rng.choice([0.1, 1]), "PercMaxPeakPV": 40}
            given["AutoTuneParam"] = steps | {"NumCycles": self.rng.choice([1, 2]), "Mode": mode}
        self.pid(kind, Kp=0.5, Ti_Ki=10, MinMV=0, MaxMV=100, PV=None, AutoTune=False, Direct=direct, **given)
        gain = self.rng.choice([0.8, 1.5, 2, 6]) * (-1 if direct else 1)
        self.plants["L0"] = {
            "model": "first_order",
            "gain": gain,
            "load": 50 - 40 * gain,
            "time_constant": self.rng.choice([1.0, 4.0, 10.0]),
            "dead_time": self.rng.choice([0, 1, 3, 8, 25]) * self.task,
            "initial": 50.0,
            "noise": self.rng.choice([0.0, 0.02, 0.3]),
        }

    # --- blocks -------------------------------------------------------------------------------------------------------

    def block(self):
        """A block of any type."""
        rng = self.rng
        name = f"B{len(self.blocks)}"
        kind = rng.choice([k for k in KINDS if k != "ControlON_OFF"])
        x = {"InVar": self.sum()} if self.chance(0.9) else {}
        low, high = rng.choice([(-90, 90), (0, 200), (90, -90), (10, 30)])
        delay = {"DelayTime": self.number(0, 0.5, 1.23, 9, wired=0.2), "InitDelayedVar": rng.choice([0, 12])}
        lag = {
            "Gs": self.number(2, -0.7, wired=0.1),
            "Offset": rng.choice([0, 20]),
            "Tc": self.number(3, 0.2, 0, wired=0.1),
            "Init_OutVar": rng.choice([0, 15, -100]) if self.chance(0.2) else 15,
            "Min_OutVar": low,
            "Max_OutVar": high,
        }
        given = {
            "ControlLowFilter": x | {"Tc": self.number(0.2, 3, 0, wired=0.1)},
            "ControlDelay": x | delay,
            "ControlLag": x | lag,
            "ControlDelayLag": x | delay | lag,
            "ControlLeadLag": x
            | {"G": 1.5, "Tlead": self.number(4, 0, 1), "Tlag": self.number(2, 0.5), "Disable": self.flag()}
            | {"Min_OutVar": low, "Max_OutVar": high},
            "ControlPWM": {"MV": self.sum(), "MaxMV": self.number(100, 80, wired=0.1), "MinMV": rng.choice([0, 20])}
            | {"Period": rng.choice([1, 7, 10, 30])},
            "ControlSelectMax": {"MV1": self.sum(), "MV2": self.sum()},
            "ControlSelectMin": {"MV1": self.sum(), "MV2": self.sum()},
            "ControlSplitRange": {"MV": self.sum(), "SPLIT": self.number(40, 99), "Mode": rng.randrange(1, 5)},
        }[kind]
        self.blocks.append({"name": name, "type": kind, **given})
        self.numbers += [f"{name}.{output}" for output in KINDS[kind].OUT_REALS]
        self.bools += [f"{name}.{output}" for output in KINDS[kind].OUT_BOOLS]

    # --- moves and events ---------------------------------------------------------------------------------------------

    def more_moves(self):
        """What a program copies to signals and to inputs that nothing is wired to."""
        rng = self.rng
        for _ in range(rng.randrange(1, 4)):
            row = rng.choice(
                [
                    {"move": self.sum(), "to": rng.choice(["A", "NUM"])},
                    {"move": self.condition(), "to": "S2"},
                    {"move": self.sum(), "to": self.target("ManualMV", "SP", "MaxVarMV", "BIAS")},
                    {"move": self.condition(), "to": self.target("Manual", "Windup_H_IN", "Direct")},
                ]
            )
            if row["to"] is not None:
                if self.chance(0.7):
                    row["when"] = self.condition()
                self.moves.append(row | {"at": rng.choice(["start", "end"])})

    def target(self, *keys):
        """An input of a loop that nothing is wired to; None where there is none."""
        loop, key = self.rng.choice(self.loops), self.rng.choice(keys)
        return f"{loop['name']}.{key}" if key in loop and not isinstance(loop[key], str) else None
