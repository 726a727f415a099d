"""The auto-tuning of PIDA_TUNE_REAL and PIDA_TUNE_INT, from chapter 4 and decisions D230 to D234."""

from __future__ import annotations

import math

from reference.single import F

NUMBERS = ("PercAmpMV", "PercHystPV", "PercMaxPeakPV", "NumCycles", "Mode")
RANGES = {
    "PercAmpMV": (0.1, 50),
    "PercHystPV": (0.01, 1),
    "PercMaxPeakPV": (0.1, 50),
    "NumCycles": (1, 10),
    "Mode": (0, 2),
}
P, PI, PID = range(3)
FLAGS = [
    "Bad_PercAmpMV",
    "Bad_PercHystPV",
    "Bad_PercMaxPeakPV",
    "Bad_NumCycles",
    "Bad_Mode",
    "MV_TOO_HIGH",
    "MV_TOO_LOW",
    "PV_TOO_HIGH",
    "PV_TOO_LOW",
    "PEAK_TOO_HIGH",
    "PEAK_TOO_LOW",
    "PV_NOT_STEADY",
    "CYCLE_TOO_FAST",
    "HIGH_DEAD_TIME",
]
GAINS = ("Kp", "Ti_Ki", "Td_Kd")
LISTENING = 3
"""Seconds in which PV has to be steady."""
OFF, LISTEN, RELAY, DONE = "off", "listening", "relay", "done"


class Tuning:
    """The auto-tuning of one block."""

    def __init__(self, block):
        self.block = block
        block.p |= {f"AutoTuneParam.{name}": F(0) for name in NUMBERS} | {"AutoTune": False}
        self.state = OFF
        self.reset()

    def reset(self):
        """Without AutoTune the outputs are reset."""
        out = self.block.out
        out["AutoTuneDone"] = out["AutoTuneError"] = False
        out |= {f"AutoTuneResult.{name}": F(0) for name in GAINS}
        out |= {f"AutoTuneResult.{name}": False for name in FLAGS}

    def takes(self, pv):
        """Whether the auto-tuning owns MV in this call; then ``mv`` is what it gives."""
        block = self.block
        if not block.p["AutoTune"]:
            if self.state == OFF:
                return False
            ended = self.state == DONE
            self.state = OFF
            self.reset()
            self.mv = self.ref_mv
            # after an abort this call still sets RefMV; after an end only automatic does (D231)
            return not (ended and (block.p["Manual"] or block.p["TRK_IN"] or block.p["OVERR"]))
        if self.state == OFF:
            self.begin()
        if self.state == LISTEN:
            self.listen(pv)
        elif self.state == RELAY:
            self.relay(pv)
        return True

    def begin(self):
        """The rising edge of AutoTune (D230)."""
        block, p = self.block, self.block.p
        block.reached["auto-tuning"] += 1
        self.ref_mv = self.mv = block.out["MV"]
        values = {name: p[f"AutoTuneParam.{name}"] for name in NUMBERS}
        bad = [name for name, (low, high) in RANGES.items() if not F(low) <= values[name] <= F(high)]
        self.m = values["PercAmpMV"] * (p["MaxMV"] - p["MinMV"]) / F(100)
        if block.whole:
            self.m = F(round(float(self.m)))
            if self.m == 0 and "PercAmpMV" not in bad:
                bad.append("PercAmpMV")
        self.h = values["PercHystPV"] * (p["MaxPV"] - p["MinPV"]) / F(100)
        self.s = values["PercMaxPeakPV"] * (p["MaxPV"] - p["MinPV"]) / F(100)
        self.cycles, self.rule = int(values["NumCycles"]), int(values["Mode"])
        flags = [f"Bad_{name}" for name in bad]
        # a bad amplitude makes no step (D687)
        if "PercAmpMV" not in bad and self.ref_mv + self.m > p["MaxMV"]:
            flags.append("MV_TOO_HIGH")
        if "PercAmpMV" not in bad and self.ref_mv - self.m < p["MinMV"]:
            flags.append("MV_TOO_LOW")
        self.state = LISTEN
        self.heard = []
        if flags:
            self.end(*flags)

    def end(self, *flags):
        """The end, with errors or none; MV returns to RefMV."""
        out = self.block.out
        self.state = DONE
        self.mv = self.ref_mv
        out["AutoTuneDone"] = True
        out["AutoTuneError"] = bool(flags)
        for flag in flags:
            out[f"AutoTuneResult.{flag}"] = True
            self.block.reached[flag] += 1

    def listen(self, pv):
        """The mean of 3 s of PV, which has to be steady; the relay begins when they have passed."""
        if len(self.heard) * round(float(self.block.ts) * 1e6) < LISTENING * 1_000_000:
            self.heard.append(pv)
            return
        away = [value - self.heard[0] for value in self.heard]
        middle = mean(away)
        self.ref = self.heard[0] + middle
        flags = []
        if max(away) - middle > self.h or middle - min(away) > self.h:
            flags.append("PV_NOT_STEADY")
        if self.ref + self.h > self.block.p["MaxPV"]:
            flags.append("PV_TOO_HIGH")
        if self.ref - self.h < self.block.p["MinPV"]:
            flags.append("PV_TOO_LOW")
        if abs(pv - self.ref) > self.s:
            flags.append("PEAK_TOO_HIGH")
        if flags:
            self.end(*flags)
            return
        self.state = RELAY
        self.rising = True
        self.switches = []
        """Calls at which the relay switched."""
        self.calls = 0
        self.extremes = []
        """Of each half cycle that counts: how far PV went, and how many calls after the switch it came there last."""
        self.step()

    def step(self):
        """MV for the way that PV has to go."""
        up = self.rising != self.block.p["Direct"]
        self.mv = self.ref_mv + self.m if up else self.ref_mv - self.m

    def relay(self, pv):
        """One call of the relay test (D232); PV counts from RefPV."""
        self.calls += 1
        away = pv - self.ref
        if abs(away) > self.s:
            self.end("PEAK_TOO_HIGH")
        elif away >= self.h if self.rising else away <= -self.h:
            self.switch(away)
        elif self.extremes and (away <= self.extremes[-1][0] if self.rising else away >= self.extremes[-1][0]):
            self.extremes[-1] = [away, self.calls - self.switches[-1]]

    def switch(self, away):
        """PV has reached the hysteresis; the first cycle that counts begins with the second switch."""
        self.rising = not self.rising
        self.switches.append(self.calls)
        if len(self.switches) == 2 * self.cycles + 2:
            self.measure()
            return
        if len(self.switches) >= 2:
            self.extremes.append([away, 0])
        self.step()

    def measure(self):
        """The results (D233, D234)."""
        block, ts = self.block, self.block.ts
        amplitude = mean([abs(away) for away, _ in self.extremes])
        samples = self.switches[-1] - self.switches[1]
        period = F(samples) * ts / F(self.cycles)
        flags = []
        if amplitude < F(2) * self.h:
            flags.append("PEAK_TOO_LOW")
        if samples < 10 * self.cycles:
            flags.append("CYCLE_TOO_FAST")
        if samples < 1.5 * sum(since for _, since in self.extremes):
            flags.append("HIGH_DEAD_TIME")
        ku = F(4) * self.m / (F(math.pi) * amplitude)
        kp = F(0.5) * ku if self.rule == P else ku / F(3.2)
        ti = F(0) if self.rule == P else F(2.2) * period
        td = period / F(6.3) if self.rule == PID else F(0)
        if block.p["Indep"]:
            ti, td = (kp / ti if ti else F(0)), kp * td
        for name, value in zip(GAINS, (kp, ti, td), strict=True):
            block.out[f"AutoTuneResult.{name}"] = value
        self.end(*flags)
        block.reached["tuned"] += 1


def mean(values):
    """The mean, added up in single precision."""
    total = F(0)
    for value in values:
        total = total + value
    return total / F(len(values))
