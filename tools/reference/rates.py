"""DPIDE and NextoPID once more, for what depends on time and on wires; written from the manuals, not from `dpide` or
`nextopid`, and without NumPy.

DPIDE: CYCLE that is changed, that is no multiple of the scan, that is beyond its ends; the interrupt task, in which
CYCLE says nothing. NextoPID: loops and filters that are called every n-th cycle, wired across their rates, by
expressions of any depth. Each is rounded to single precision after every operation.
"""

from __future__ import annotations

import math
import re
import struct

from reference.rates_cases import random_case

__all__ = ["COUNT", "FEATURES", "TOLERANCE", "random_case", "run"]

COUNT = 300
TOLERANCE = {}
DPIDE = ("new CYCLE", "longer CYCLE", "shorter CYCLE", "CYCLE no multiple of the scan", "CYCLE at its end")
TASK = ("interrupt task", "interval no multiple of the scan", "CYCLE without effect")
NEXTOPID = (
    "called every n-th cycle",
    "reads a slower loop",
    "is read by a slower loop",
    "expression",
    "without value",
)
FEATURES = (*DPIDE, *TASK, *NEXTOPID)


def single(number):
    """A number rounded to single precision; beyond it, infinite."""
    if math.isnan(number) or math.isinf(number):
        return number
    try:
        return struct.unpack("<f", struct.pack("<f", number))[0]
    except OverflowError:
        return math.copysign(math.inf, number)


def run(configuration, scenario, inputs, reached):
    """The signals of each base step."""
    make = Instructions if configuration["vendor"] == "dpide" else Program
    plc = make(configuration, reached)
    rows = []
    for k, measured in enumerate(inputs.rows):
        for event in inputs.due(scenario, k):
            plc.happen(event, k * inputs.step)
        rows.append(plc.scan(k * inputs.step, measured, inputs.step))
    return rows


# --- DPIDE: CYCLE and the interrupt task ------------------------------------------------------------------------------


class Instruction:
    """One DPIDE: MV = P + I + D + BIAS of the error that PID_DIR chooses."""

    def __init__(self, given):
        self.name = given["name"]
        self.p = {"PID_RUN": True, "PID_MAN": False, "MOUT": 0.0} | given
        self.mv = self.integral = self.error = self.pv = 0.0
        self.last = None
        """Error and PV of the calculation before, as long as the algorithm goes on without a pause."""
        self.smooth = 0.0
        self.by_hand = False
        self.side = 0
        """The side of SV on which PV was last."""
        self.crossed = self.limited = False
        self.shown_mode = self.mode()
        self.next = 0

    def mode(self):
        """The mode by name."""
        if not self.p["PID_RUN"]:
            return "off"
        return "manual" if self.p["PID_MAN"] else "auto"

    def pause(self):
        """What comes next has no past (D267)."""
        self.last, self.smooth = None, 0.0

    def stop(self):
        """PID_RUN is FALSE: MV is reset, the algorithm is not used."""
        self.mv, self.shown_mode, self.limited = 0.0, "off", False
        self.by_hand, self.crossed, self.side = False, False, 0
        self.pause()

    def calculate(self, ts):
        """Additional remark 6, then the formula that PID_EQ and PID_DE choose."""
        p = {key: single(value) if isinstance(value, float) else value for key, value in self.p.items()}
        error = single(p["SV"] - self.pv) if p["PID_DIR"] else single(self.pv - p["SV"])
        band = abs(p["ERR_DBW"])
        side = (error > 0) - (error < 0)
        if abs(error) >= band:
            self.crossed = False
        elif side * self.side < 0:
            self.crossed = True
        self.side = side or self.side
        if self.crossed:
            error = 0.0
        self.shown_mode = self.mode()
        low, high = sorted((p["MV_MIN"], p["MV_MAX"]))
        if p["PID_MAN"]:
            self.mv = min(max(p["MOUT"], low), high)
            self.limited = self.mv != p["MOUT"]
            self.by_hand = True
            self.pause()
        else:
            self.automatic(p, error, ts, low, high)
            self.last = error, self.pv
        self.error = error
        if p["MOUT_AUTO"]:
            self.p["MOUT"] = self.mv

    def automatic(self, p, error, ts, low, high):
        """The algorithm."""
        gain, integral, rate = p["Kc_Kp"], p["Ti_Ki"], p["Td_Kd"]
        if p["PID_EQ"]:
            part = single(single(gain * ts) / integral)
            rate = single(gain * rate)
        else:
            part = single(integral * ts)
        proportional = single(gain * error)
        derivative = single(rate * self.slope(p, error, ts))
        if self.by_hand:  # the MV of manual goes into the algorithm
            self.integral = single(single(single(self.mv - proportional) - derivative) - p["BIAS"])
        before = self.integral
        after = single(before + single(part * error))
        mv = single(single(single(proportional + after) + derivative) + p["BIAS"])
        self.mv = min(max(mv, low), high)
        self.limited = self.mv != mv
        if not self.limited:
            self.integral = after
        elif p["PID_MODE"] == 2:
            self.integral = single(single(single(self.mv - proportional) - derivative) - p["BIAS"])
        self.by_hand = False

    def slope(self, p, error, ts):
        """dE/dt, or dPV/dt with the sign of E, smoothed by Tf."""
        change = 0.0
        if self.last is not None:
            error_before, pv_before = self.last
            if not p["PID_DE"]:
                change = single(error - error_before)
            elif not self.crossed:
                change = single(pv_before - self.pv) if p["PID_DIR"] else single(self.pv - pv_before)
        slope = single(change / ts)
        if p["Tf"] > 0:
            share = single(ts / single(p["Tf"] + ts))
            slope = single(self.smooth + single(single(slope - self.smooth) * share))
        self.smooth = slope
        return slope


class Instructions:
    """The instructions of a program, scanned once a base step."""

    def __init__(self, configuration, reached):
        self.loops = {given["name"]: Instruction(given) for given in configuration["loops"]}
        self.task = configuration.get("plc", {}).get("interrupt_task")
        self.reached = reached
        reached["interrupt task"] += self.task is not None

    def happen(self, event, _now):
        """An event writes operands, or changes a mode."""
        loop = self.loops[event["loop"]]
        for key, value in event.get("set", {}).items():
            if key == "CYCLE":
                old, new = loop.p["CYCLE"], value
                names = ["CYCLE without effect"] if self.task else ["new CYCLE"]
                names += ["longer CYCLE"] * (new > old) + ["shorter CYCLE"] * (new < old) if not self.task else []
                for name in names:
                    self.reached[name] += 1
            loop.p[key] = value

    def interval(self, loop):
        """Ts in microseconds: that of the interrupts, else CYCLE; what is beyond its ends counts as the end."""
        if self.task:
            return self.task * 1000
        self.reached["CYCLE at its end"] += not 1 <= loop.p["CYCLE"] <= 40000
        return min(max(loop.p["CYCLE"], 1), 40000) * 1000

    def scan(self, now, measured, step):
        """Scans each instruction: it calculates where its sampling time has come, with Ts (D266, D685, D1016)."""
        for loop in self.loops.values():
            if not loop.p["PID_RUN"]:
                loop.stop()
            if now >= loop.next:
                ts = self.interval(loop)
                name = "interval no multiple of the scan" if self.task else "CYCLE no multiple of the scan"
                self.reached[name] += ts % step != 0
                loop.next = loop.next + ts if loop.next + ts > now else now + ts
                loop.pv = single(measured[f"{loop.name}.PV"])
                if loop.p["PID_RUN"]:
                    loop.calculate(single(ts / 1e6))
        return {
            f"{loop.name}.{name}": value
            for loop in self.loops.values()
            for name, value in {
                "PV": loop.pv,
                "MV": loop.mv,
                "I_MV": loop.integral,
                "E": loop.error,
                "mode": loop.shown_mode,
                "mv_limited": loop.limited,
                "in_dead_band": loop.crossed,
            }.items()
        }


# --- NextoPID: rates and expressions ----------------------------------------------------------------------------------


class LostError(Exception):
    """An expression has no value (D206)."""


SYMBOLS = re.compile(r"\d+(?:\.\d+)?(?:e[+-]?\d+)?|[A-Za-z_][\w.]*|<=|>=|<>|[^\s]")
BINDING = {
    "OR": 1,
    "XOR": 2,
    "AND": 3,
    "=": 4,
    "<>": 4,
    "<": 5,
    ">": 5,
    "<=": 5,
    ">=": 5,
    "+": 6,
    "-": 6,
    "*": 7,
    "/": 7,
}
"""The order of IEC 61131-3: the larger, the tighter."""


class Expression:
    """An expression, worked out while it is read from left to right; every operand is worked out."""

    def __init__(self, text, lookup):
        self.symbols, self.lookup = [*SYMBOLS.findall(text), "end"], lookup

    def take(self, expected=None):
        """The next symbol."""
        symbol = self.symbols.pop(0)
        assert expected in {None, symbol}, (expected, symbol)
        return symbol

    def value(self, tight=0):
        """Operands that are joined by operators which bind more tightly than ``tight``."""
        left = self.operand()
        while BINDING.get(self.symbols[0], 0) > tight:
            operator = self.take()
            left = join(operator, left, self.value(BINDING[operator]))
        return left

    def operand(self):
        """What has a sign or NOT, stands in parentheses or behind the name of a function, or by itself."""
        symbol = self.take()
        if symbol == "-":
            return -self.operand()
        if symbol == "NOT":
            return not self.operand()
        if symbol == "(":
            inner = self.value()
            self.take(")")
            return inner
        if symbol in {"min", "max", "abs", "sqrt"}:
            self.take("(")
            operands = [self.value()]
            while self.symbols[0] == ",":
                self.take()
                operands.append(self.value())
            self.take(")")
            return function(symbol, operands)
        return single(float(symbol)) if symbol[0].isdigit() else self.lookup(symbol)


def function(name, operands):
    """A standard function."""
    if name == "sqrt":
        if operands[0] < 0:
            raise LostError
        return single(math.sqrt(operands[0]))
    return abs(operands[0]) if name == "abs" else {"min": min, "max": max}[name](operands)


def join(operator, left, right):
    """An operator with its two operands."""
    if operator == "/":
        if right == 0:
            raise LostError
        return single(left / right)
    arithmetic = {"+": lambda: left + right, "-": lambda: left - right, "*": lambda: left * right}
    if operator in arithmetic:
        return single(arithmetic[operator]())
    return {
        "OR": left or right,
        "AND": left and right,
        "XOR": left != right,
        "=": left == right,
        "<>": left != right,
        "<": left < right,
        ">": left > right,
        "<=": left <= right,
        ">=": left >= right,
    }[operator]


def share(ts, time_constant):
    """The share of its way that a first-order lag goes in a sample (D236)."""
    return single(-math.expm1(-single(ts / time_constant)))


class Filter:
    """ControlLowFilter."""

    outputs = ("OutVar",)

    def __init__(self, given, ts):
        self.p = {"InVar": 0.0, "Tc": 0.0} | given
        self.share = share(ts, single(given["Tc"]))
        self.o = {"OutVar": 0.0}
        self.begun = False

    def call(self):
        """A first-order lag; it begins at its input (D236, D237)."""
        x, y = self.p["InVar"], self.o["OutVar"]
        y = single(y + single(single(x - y) * self.share)) if self.begun else x
        if math.isfinite(y):
            self.o["OutVar"] = y
        self.begun = True


class Pida:
    """PIDA_REAL, chapter 2, in automatic and manual; calculated as D220 to D224, D229 and D691 say."""

    outputs = ("MV", "IntegralAction")

    def __init__(self, given, ts):
        self.p = {"PV": 0.0} | given
        self.ts = ts
        self.o = {"MV": 0.0, "IntegralAction": 0.0, "WarnBits.MV_MaxMV": False}
        self.before = None
        self.filtered = 0.0
        self.sp = 0.0
        self.mode = "auto"

    def call(self):
        """One call."""
        p = {key: single(v) if not isinstance(v, bool | str) else v for key, v in self.p.items()}
        low, high = p["MinPV"], p["MaxPV"]
        pv, sp = (min(max(p[key], low), high) for key in ("PV", "SP"))
        self.sp = sp
        self.mode = "manual" if p["Manual"] else "auto"
        error = single(sp - pv)
        ki, kd = p["Ti_Ki"], p["Td_Kd"]
        if not p["Indep"]:
            ki = single(p["Kp"] / ki) if ki >= single(0.001) else 0.0
            kd = single(p["Kp"] * kd)
        sign = -1.0 if p["Direct"] else 1.0
        proportional = sign * single(p["Kp"] * error)
        now = error if p["DerivEr"] else -pv
        change = 0.0 if self.before is None else single(now - self.before[p["DerivEr"]])
        self.before = -pv, error
        derivative = sign * single(single(kd * change) / self.ts)
        if p["Tfd"] > 0:
            way = single(derivative - self.filtered)
            derivative = single(self.filtered + single(way * share(self.ts, p["Tfd"])))
        self.filtered = derivative
        if p["Manual"]:
            self.by_hand(p, proportional, derivative, ki)
        else:
            self.automatic(p, proportional, derivative, sign * single(single(ki * error) * self.ts), ki)

    def by_hand(self, p, proportional, derivative, ki):
        """ManualMV is copied to MV, within the limits; the integral action follows."""
        mv = min(max(p["ManualMV"], p["MinMV"]), p["MaxMV"])
        self.o["WarnBits.MV_MaxMV"] = p["ManualMV"] > p["MaxMV"]
        self.o["MV"] = mv
        rest = single(single(single(mv - proportional) - derivative) - p["BIAS"])
        self.o["IntegralAction"] = rest if ki > 0 else 0.0

    def automatic(self, p, proportional, derivative, increment, ki):
        """The sum of the actions within MaxVarMV and the limits; an increment that leads out of them is cut."""
        last = self.o["MV"]
        low, high = p["MinMV"], p["MaxMV"]
        reach_low, reach_high = low, high
        if p["MaxVarMV"] > 0:
            reach_low = min(max(single(last - p["MaxVarMV"]), low), high)
            reach_high = min(max(single(last + p["MaxVarMV"]), low), high)
        before = self.o["IntegralAction"] if ki > 0 else 0.0
        after = single(before + increment) if ki > 0 else 0.0

        def total(integral):
            return single(single(single(proportional + integral) + derivative) + p["BIAS"])

        whole, stood = total(after), total(before)
        held = whole
        if p["MaxVarMV"] > 0:
            held = min(max(held, single(last - p["MaxVarMV"])), single(last + p["MaxVarMV"]))
        self.o["WarnBits.MV_MaxMV"] = held > high
        self.o["MV"] = min(max(held, low), high)
        # of an increment what would push MV past its limits is left out
        if increment > 0 and whole > reach_high:
            after = single(before + max(single(reach_high - stood), 0.0))
        elif increment < 0 and whole < reach_low:
            after = single(before + min(single(reach_low - stood), 0.0))
        self.o["IntegralAction"] = after


class Program:
    """The program in its cyclic task."""

    def __init__(self, configuration, reached):
        self.reached = reached
        self.task = round(configuration["plc"]["sample_time"] * 1e6)
        self.signals = {"A": 3.0, "B": 40.0, "N": 5.0, "T": 1.5, "S": True}
        self.blocks, self.every = {}, {}
        for given in (*configuration["blocks"], *configuration["loops"]):
            period = round(given.get("sample_time", self.task / 1e6) * 1e6)
            self.every[given["name"]] = period // self.task
            make = Pida if given["type"] == "PIDA_REAL" else Filter
            self.blocks[given["name"]] = make(dict(given), single(period / 1e6))
        self.wires = {
            name: {k: v for k, v in block.p.items() if isinstance(v, str) and k not in {"name", "type"}}
            for name, block in self.blocks.items()
        }
        for name, wires in self.wires.items():
            self.blocks[name].p |= dict.fromkeys(wires, 0.0) | ({"Manual": False} if "Manual" in wires else {})
        self.order = self.sequence([given["name"] for given in configuration["loops"]])
        self.count_rates()

    def read(self, name):
        """The blocks that a block reads."""
        texts = " ".join(self.wires[name].values())
        return {word.partition(".")[0] for word in SYMBOLS.findall(texts)} & (set(self.blocks) - {name})

    def sequence(self, loops):
        """Blocks after those that they read; a ring begins with the first loop in it (D204)."""
        left, order = list(self.blocks), []

        def leads(start):
            seen, todo = set(), [start]
            while todo:
                todo += [n for n in self.read(todo.pop()) if n in left and n not in seen and not seen.add(n)]
            return seen

        while left:
            free = [name for name in left if not self.read(name) & set(left)]
            if not free:
                rings = [name for name in left if all(name in leads(other) for other in leads(name))]
                free = [name for name in rings if name in loops]
            order.append(free[0])
            left.remove(free[0])
        return order

    def count_rates(self):
        """How blocks of several rates read each other."""
        for name in self.blocks:
            self.reached["called every n-th cycle"] += self.every[name] > 1
            for other in self.read(name):
                self.reached["reads a slower loop"] += self.every[other] > self.every[name]
                self.reached["is read by a slower loop"] += self.every[other] < self.every[name]

    def happen(self, event, _now):
        """An event writes a signal."""
        for name, value in event["set"].items():
            self.signals[name] = value if isinstance(value, bool) else single(value)

    def lookup(self, name):
        """A signal, an input or an output."""
        if name in self.signals:
            return self.signals[name]
        block, _, key = name.partition(".")
        block = self.blocks[block]
        return block.o[key] if key in block.o else block.p[key]

    def scan(self, now, measured, _step):
        """A cycle, where one falls on this base step: the blocks whose turn it is, in their order."""
        number = now // self.task
        called = [name for name in self.order if now % self.task == 0 and number % self.every[name] == 0]
        for name, block in self.blocks.items():
            if isinstance(block, Pida):  # assigned by the program around, before the calls (D694)
                block.p["PV"] = single(measured[f"{name}.PV"])
        for name in called:
            for key, text in self.wires[name].items():
                self.follow(name, key, text)
            self.blocks[name].call()
        rows = {}
        for name, block in self.blocks.items():
            rows |= {f"{name}.{key}": float(block.o[key]) for key in block.outputs}
            if isinstance(block, Pida):
                rows[f"{name}.mode"] = block.mode
                if name in called:
                    rows |= {f"{name}.SP": block.sp, f"{name}.PV": block.p["PV"]}
        return rows

    def follow(self, name, key, text):
        """A wire renews an input; one without a value leaves it."""
        self.reached["expression"] += 1
        try:
            value = Expression(text, self.lookup).value()
        except LostError:
            value = math.inf
        if not math.isfinite(value):
            self.reached["without value"] += 1
            return
        self.blocks[name].p[key] = value
