"""The blocks and functions beside the PID controllers, from chapters 6 to 15 and decisions D235 to D247."""

from __future__ import annotations

from collections import deque

from reference.nextopid_pid import share
from reference.single import F, finite

MOST_SAMPLES = 100
"""Samples that a delay holds."""
LAST_DIGITS = 1e-6
"""Relative; by how much DelayTime may seem to exceed 100 samples (D239)."""


class Block:
    """A block: ``p`` are its parameters, ``out`` its outputs."""

    REALS = BOOLS = OUT_REALS = OUT_BOOLS = ()

    def __init__(self, ts, reached):
        self.ts, self.reached = F(ts), reached
        self.p = {name: F(0) for name in self.REALS} | dict.fromkeys(self.BOOLS, False)
        self.out = {name: F(0) for name in self.OUT_REALS} | dict.fromkeys(self.OUT_BOOLS, False)
        self.begun = False
        self.start()

    def start(self):
        """What the block remembers at first."""

    def call(self):
        """One call; an error stops it where it is (D235)."""
        if "SampleTime" in self.out:
            self.out["SampleTime"] = self.ts
        self.out["Error"] = bool(self.wrong())
        self.reached[f"{type(self).__name__} in error"] += self.out["Error"]
        if not self.out["Error"]:
            self.step()
            self.begun = True

    def put(self, name, value):
        """An output, unless it is no number (D247)."""
        if finite(value):
            self.out[name] = value


class ControlLowFilter(Block):
    """Chapter 8."""

    REALS, OUT_REALS, OUT_BOOLS = ("InVar", "Tc"), ("OutVar", "SampleTime"), ("Error",)

    def wrong(self):
        return self.p["Tc"] <= 0

    def step(self):
        x, y = self.p["InVar"], self.out["OutVar"]
        self.put("OutVar", y + (x - y) * share(self.ts, self.p["Tc"]) if self.begun else x)


class Line:
    """The samples that are on their way (D239, D240)."""

    def __init__(self):
        self.length = None

    def pass_on(self, value, length, initial, shown):
        """What went in ``length`` calls ago; a new length begins with what is ``shown`` now."""
        if self.length is None:
            self.samples = deque([initial] * length)
        elif length != self.length:
            self.samples = deque([shown] * length)
        self.length = length
        self.samples.append(value)
        return self.samples.popleft()


def samples_of(delay, ts):
    """How many samples a delay is."""
    return round(float(delay / ts))


def too_long(delay, ts):
    """Whether a delay is none."""
    return delay < 0 or float(delay) > MOST_SAMPLES * float(ts) * (1 + LAST_DIGITS)


class ControlDelay(Block):
    """Chapter 9."""

    REALS = ("InVar", "DelayTime", "InitDelayedVar")
    OUT_REALS, OUT_BOOLS = ("OutVar", "SampleTime"), ("Error",)

    def start(self):
        self.line = Line()

    def wrong(self):
        return too_long(self.p["DelayTime"], self.ts)

    def step(self):
        p = self.p
        length = samples_of(p["DelayTime"], self.ts)
        self.reached["delay changed"] += self.line.length not in {None, length}
        self.out["OutVar"] = self.line.pass_on(p["InVar"], length, p["InitDelayedVar"], self.out["OutVar"])


class ControlLag(Block):
    """Chapter 10."""

    REALS = ("InVar", "Gs", "Offset", "Tc", "Init_OutVar", "Min_OutVar", "Max_OutVar")
    OUT_REALS, OUT_BOOLS = ("OutVar", "SampleTime"), ("Error",)

    def wrong(self):
        p = self.p
        return (
            p["Tc"] <= 0
            or p["Min_OutVar"] > p["Max_OutVar"]
            or not p["Min_OutVar"] <= p["Init_OutVar"] <= p["Max_OutVar"]
        )

    def lag(self, x):
        """The lag of a value, from Init_OutVar on (D237, D238)."""
        p, y = self.p, self.out["OutVar"]
        if not self.begun:
            self.put("OutVar", p["Init_OutVar"])
            return
        y = y + (p["Gs"] * x + p["Offset"] - y) * share(self.ts, p["Tc"])
        held = min(max(y, p["Min_OutVar"]), p["Max_OutVar"])
        self.reached["lag limited"] += bool(held != y)
        self.put("OutVar", held)

    def step(self):
        self.lag(self.p["InVar"])


class ControlDelayLag(ControlLag):
    """Chapter 11."""

    REALS = (*ControlLag.REALS, "DelayTime", "InitDelayedVar")

    def start(self):
        self.line, self.delayed = Line(), F(0)

    def wrong(self):
        return too_long(self.p["DelayTime"], self.ts) or super().wrong()

    def step(self):
        p = self.p
        length = samples_of(p["DelayTime"], self.ts)
        self.reached["delay changed"] += self.line.length not in {None, length}
        self.delayed = self.line.pass_on(p["InVar"], length, p["InitDelayedVar"], self.delayed)
        self.lag(self.delayed)


class ControlLeadLag(Block):
    """Chapter 12."""

    REALS = ("InVar", "G", "Tlead", "Tlag", "Min_OutVar", "Max_OutVar")
    BOOLS = ("Disable",)
    OUT_REALS, OUT_BOOLS = ("OutVar", "SampleTime"), ("Error",)

    def wrong(self):
        return self.p["Tlead"] < 0 or self.p["Tlag"] <= 0

    def step(self):
        p = self.p
        if not self.begun:
            self.lagged = p["InVar"]
        x, y = p["InVar"], self.lagged
        value = p["G"] * (y + p["Tlead"] / p["Tlag"] * (x - y))
        self.reached["lead/lag limited"] += bool(value > p["Max_OutVar"] or value < p["Min_OutVar"])
        # the low one wins where they contradict each other (D238)
        self.put("OutVar", max(min(value, p["Max_OutVar"]), p["Min_OutVar"]))
        if p["Disable"]:
            self.out["OutVar"] = F(0)
            self.reached["lead/lag disabled"] += 1
        after = y + (x - y) * share(self.ts, p["Tlag"])
        if finite(after):
            self.lagged = after


class ControlPWM(Block):
    """Chapter 7."""

    REALS = ("MV", "MaxMV", "MinMV", "Period")
    OUT_BOOLS = ("PWM", "Error", "Warning")

    def start(self):
        self.cycle = 0

    def wrong(self):
        return self.p["MaxMV"] <= self.p["MinMV"] or self.p["Period"] == 0

    def step(self):
        p = self.p
        mv = min(max(p["MV"], p["MinMV"]), p["MaxMV"])
        self.out["Warning"] = bool(mv != p["MV"])
        self.reached["pulses limited"] += self.out["Warning"]
        if self.cycle == 0:
            self.period = int(p["Period"])
            self.on = round(float((mv - p["MinMV"]) / (p["MaxMV"] - p["MinMV"]) * p["Period"]))
        self.out["PWM"] = self.cycle < self.on
        self.cycle = (self.cycle + 1) % self.period


class ControlON_OFF(Block):  # noqa: N801 - the manual's name
    """Chapter 6."""

    REALS = ("SP", "PV", "DeadBand", "MaxPV", "MinPV")
    BOOLS = ("Direct", "Manual", "ManualMV")
    OUT_BOOLS = (
        "MV",
        *(f"ErrBits.{name}" for name in ("MaxMinPV", "DeadBand")),
        *(f"WarnBits.{name}" for name in ("PV_MaxPV", "PV_MinPV", "SP_MaxPV", "SP_MinPV")),
    )
    mode = "manual"

    def start(self):
        self.sp = F(0)

    def call(self):
        p, out = self.p, self.out
        out["ErrBits.MaxMinPV"] = bool(p["MaxPV"] <= p["MinPV"])
        out["ErrBits.DeadBand"] = bool(p["DeadBand"] < 0)
        if out["ErrBits.MaxMinPV"] or out["ErrBits.DeadBand"]:
            self.reached["ControlON_OFF in error"] += 1
            return
        for name in ("PV", "SP"):
            out[f"WarnBits.{name}_MaxPV"] = bool(p[name] > p["MaxPV"])
            out[f"WarnBits.{name}_MinPV"] = bool(p[name] < p["MinPV"])
        self.sp = min(max(p["SP"], p["MinPV"]), p["MaxPV"])
        error = self.sp - min(max(p["PV"], p["MinPV"]), p["MaxPV"])
        self.mode = "manual" if p["Manual"] else "auto"
        if p["Manual"]:
            out["MV"] = p["ManualMV"]
            self.reached["on-off in manual"] += 1
        elif error > p["DeadBand"]:
            out["MV"] = not p["Direct"]
        elif error < -p["DeadBand"]:
            out["MV"] = p["Direct"]


class ControlSelectMax(Block):
    """Chapter 13."""

    REALS, OUT_REALS, OUT_BOOLS = ("MV1", "MV2"), ("MV",), ("OVERR1", "OVERR2")

    def call(self):
        self.select(first=self.p["MV1"] > self.p["MV2"])

    def select(self, *, first):
        """The one that is selected; equal ones give the second (D245)."""
        self.out["MV"] = self.p["MV1"] if first else self.p["MV2"]
        self.out["OVERR1"], self.out["OVERR2"] = not first, bool(first)
        self.reached[f"{type(self).__name__} {'MV1' if first else 'MV2'}"] += 1


class ControlSelectMin(ControlSelectMax):
    """Chapter 14."""

    def call(self):
        self.select(first=self.p["MV1"] < self.p["MV2"])


class ControlSplitRange(Block):
    """Chapter 15."""

    REALS, OUT_REALS, OUT_BOOLS = ("MV", "SPLIT", "Mode"), ("MV1", "MV2"), ("Error",)

    def wrong(self):
        mv, split, mode = self.p["MV"], self.p["SPLIT"], self.p["Mode"]
        return not 1 <= mode <= 4 or not 0 <= mv <= 100 or not 0 < split < 100

    def call(self):
        super().call()
        if self.out["Error"]:
            self.out["MV1"] = self.out["MV2"] = F(0)

    def step(self):
        mv, split, mode = self.p["MV"], self.p["SPLIT"], int(self.p["Mode"])
        hundred = F(100)
        below = bool(mv < split)
        lower = mv / split * hundred if below else hundred
        upper = F(0) if below else (mv - split) / (hundred - split) * hundred
        self.out["MV1"] = hundred - lower if mode == 4 else lower
        self.out["MV2"] = {1: hundred - lower, 2: upper, 3: hundred - upper, 4: upper}[mode]
        self.reached[f"split range {mode}"] += 1


KINDS = {
    kind.__name__: kind
    for kind in (
        ControlON_OFF,
        ControlPWM,
        ControlLowFilter,
        ControlDelay,
        ControlLag,
        ControlDelayLag,
        ControlLeadLag,
        ControlSelectMax,
        ControlSelectMin,
        ControlSplitRange,
    )
}
