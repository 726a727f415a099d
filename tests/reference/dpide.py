"""DPIDE of the Delta AS (API 0708), from its manual and decisions D250 to D279."""

from __future__ import annotations

import numpy as np

from reference.dpide_cases import random_case
from reference.single import F, finite, real, shown

__all__ = ["COUNT", "FEATURES", "TOLERANCE", "random_case", "run"]

COUNT = 600
TOLERANCE = {}
"""Everything agrees to the bit."""
FEATURES = (
    "dependent",
    "independent",
    "derivative of PV",
    "derivative of E",
    "smoothed",
    "reverse",
    "mode 0 holds I_MV",
    "mode 2 works I_MV out",
    "no integral",
    "crossed the set point in the band",
    "left the band",
    "limits swapped",
    "manual",
    "MOUT follows",
    "manual to auto",
    "off",
    "cascade by a device",
    "shared device",
    "MOUT is MV",
    "interrupt task",
    "new CYCLE",
    "stopped",
    "coefficient below 0",
    "result that is no number",
)

REALS = ("SV", "Kc_Kp", "Ti_Ki", "Td_Kd", "Tf", "ERR_DBW", "MV_MAX", "MV_MIN", "MOUT", "BIAS")
FLAGS = ("PID_RUN", "PID_MAN", "MOUT_AUTO", "PID_EQ", "PID_DE", "PID_DIR")
WHOLE = ("PID_MODE", "CYCLE")
SHORTEST, LONGEST = 1, 40_000
"""CYCLE in ms: what is beyond counts as the end (operand table)."""
FOLLOWING = ("SV", "BIAS", "MOUT")
"""Operands that may stand in the device of another loop's MV."""
MS = 1000
"""Microseconds."""


class Loop:
    """One instruction: its operands, and what it remembers."""

    def __init__(self, given):
        self.name = given["name"]
        self.devices = dict(given.get("devices", {}).items())
        self.operands = {name: F(0) for name in REALS} | dict.fromkeys(FLAGS, False) | dict.fromkeys(WHOLE, 0)
        self.operands["PID_RUN"] = True
        for name in self.operands:
            if name in given:
                self.operands[name] = typed(name, given[name])
        self.mv = self["MOUT"] if self.mout_is_mv and self["PID_RUN"] else F(0)
        self.i_mv = self.error = self.pv = F(0)
        self.sign = 0.0
        """Of the last error that was not 0."""
        self.crossed = False
        self.mode_shown = self.mode
        self.limited = False
        self.due = 0
        self.mode_before_tune = 0
        self.forget()

    def __getitem__(self, operand):
        return self.operands[operand]

    def forget(self):
        """The next calculation has no past (D267)."""
        self.past = False
        self.smooth = F(0)
        self.was_manual = False

    @property
    def mode(self):
        """The mode that the operands choose, by name (D275)."""
        if not self["PID_RUN"]:
            return "off"
        if self["PID_MODE"] == 1:
            return "autotune"
        return "manual" if self["PID_MAN"] else "auto"

    @property
    def limits(self):
        """The lower limit and the upper one; the PLC swaps those that are crossed."""
        low, high = self["MV_MIN"], self["MV_MAX"]
        return (low, high) if low <= high else (high, low)

    def held(self, value):
        """A value within the limits."""
        low, high = self.limits
        return min(max(value, low), high)

    def set_mv(self, value):
        """The output, and what stands in its device."""
        self.mv = value
        if self.mout_is_mv:
            self.operands["MOUT"] = value

    @property
    def mout_is_mv(self):
        """Whether MOUT stands in the device of its own MV."""
        return "MV" in self.devices and self.devices.get("MOUT") == self.devices["MV"]


def typed(operand, value):
    """A value as its operand holds it."""
    if operand in FLAGS:
        return bool(value)
    return int(value) if operand in WHOLE else real(value)


class Plc:
    """The loops, in the order of the file."""

    def __init__(self, configuration, reached):
        self.loops = [Loop(given) for given in configuration["loops"]]
        self.interval = configuration.get("plc", {}).get("interrupt_task")
        self.reached = reached
        self.running = True
        self.start = 0
        """When the PLC began to run, in microseconds."""

    def period(self, loop):
        """The sampling time in microseconds: in an interrupt task its interval, else CYCLE."""
        return (self.interval or min(max(loop["CYCLE"], SHORTEST), LONGEST)) * MS

    # --- events -------------------------------------------------------------------------------------------------------

    def happen(self, event, now):
        """Carries out an event."""
        if "plc" in event:
            self.switch(event["plc"], now)
        elif "loop" in event and ("set" in event or "mode" in event):
            loop = next(loop for loop in self.loops if loop.name == event["loop"])
            for key, value in event.get("set", {}).items():
                self.write(loop, "MOUT" if key == "output" else key, value)
            if "mode" in event:
                self.request(loop, event["mode"])

    def switch(self, to, now):
        """The PLC stops, or runs again (D278)."""
        if to == "stop":
            self.running = False
        elif not self.running:
            self.running, self.start = True, now
            for loop in self.loops:
                loop.due = now
                loop.past = False
                loop.sign, loop.crossed = 0.0, False
        self.reached["stopped"] += to == "stop"

    def write(self, loop, operand, value):
        """Writes an operand and all others in its device (D266)."""
        value = typed(operand, value)
        device = loop.devices.get(operand)
        for other in self.loops:
            for name in other.operands:
                if (other is loop and name == operand) or (device and other.devices.get(name) == device):
                    self.reached["shared device"] += other is not loop or name != operand
                    other.operands[name] = value
            if other.mout_is_mv and other.mode_shown != "off":
                other.mv = other["MOUT"]
            elif other.mout_is_mv:
                other.operands["MOUT"] = other.mv
        self.reached["new CYCLE"] += operand == "CYCLE"

    def request(self, loop, mode):
        """Writes what makes a mode (D275)."""
        self.write(loop, "PID_RUN", mode != "off")
        if mode == "manual":
            self.write(loop, "PID_MAN", True)
        elif mode == "auto":
            self.write(loop, "PID_MAN", False)

    # --- calculations -------------------------------------------------------------------------------------------------

    def scan(self, now, measured):
        """A base step: what is due is calculated, in the order of the file."""
        for loop in self.loops if self.running else ():
            if not loop["PID_RUN"]:
                self.off(loop)
            if now < loop.due:
                continue
            period = self.period(loop)
            while loop.due <= now:
                loop.due += period
            loop.pv = real(measured[f"{loop.name}.PV"])
            if loop["PID_RUN"]:
                self.follow(loop)
                self.calculate(loop, F(period / 1e6))
        rows = {}
        for loop in self.loops:
            rows |= self.signals(loop)
        return rows

    def off(self, loop):
        """PID_RUN is FALSE: MV is 0, and all else stands still (D273)."""
        loop.set_mv(F(0))
        loop.mode_shown, loop.limited, loop.crossed, loop.sign = "off", False, False, 0.0
        loop.forget()
        self.reached["off"] += 1

    def follow(self, loop):
        """Operands in the device of another loop's MV take that MV (D266)."""
        for operand in FOLLOWING:
            device = loop.devices.get(operand)
            for other in self.loops:
                if device and other is not loop and other.devices.get("MV") == device:
                    loop.operands[operand] = other.mv
                    self.reached["cascade by a device"] += 1

    def calculate(self, loop, ts):
        """One calculation of the instruction."""
        raw = loop["SV"] - loop.pv if loop["PID_DIR"] else loop.pv - loop["SV"]
        self.reached["reverse"] += not loop["PID_DIR"]
        self.dead_band(loop, raw)
        error = F(0) if loop.crossed else raw
        mode = loop.mode
        loop.mode_shown = mode
        loop.lost = False
        self.reached["limits swapped"] += bool(loop["MV_MIN"] > loop["MV_MAX"])
        if mode == "manual":
            self.manual(loop)
        elif mode == "auto":
            self.automatic(loop, error, ts)
        loop.error = error
        loop.pv_before = loop.pv
        loop.past = mode == "auto" and not loop.lost
        if loop["MOUT_AUTO"]:
            loop.operands["MOUT"] = loop.mv
            self.reached["MOUT follows"] += 1

    def dead_band(self, loop, raw):
        """Whether the error counts as 0: from the crossing of SV until PV leaves the band (D268)."""
        sign = float(raw > 0) - float(raw < 0)
        band = abs(loop["ERR_DBW"])
        inside = bool(abs(raw) < band)
        if not inside:
            self.reached["left the band"] += loop.crossed
            loop.crossed = False
        elif sign and loop.sign and sign != loop.sign:
            loop.crossed = True
            self.reached["crossed the set point in the band"] += 1
        if sign:
            loop.sign = sign

    def manual(self, loop):
        """MV is MOUT within the limits (D274)."""
        mout = loop["MOUT"]
        loop.set_mv(loop.held(mout))
        loop.limited = bool(loop.mv != mout)
        loop.forget()
        loop.was_manual = True
        self.reached["manual"] += 1
        self.reached["MOUT is MV"] += loop.mout_is_mv

    def automatic(self, loop, error, ts):
        """The PID algorithm (D265, D269 to D272)."""
        gain, reset, rate = (max(loop[name], F(0)) for name in ("Kc_Kp", "Ti_Ki", "Td_Kd"))
        self.reached["coefficient below 0"] += any(loop[name] < 0 for name in ("Kc_Kp", "Ti_Ki", "Td_Kd", "Tf"))
        bias = loop["BIAS"]
        if loop["PID_EQ"]:
            self.reached["dependent"] += 1
            share = gain * ts / reset if reset > 0 else F(0)
            rate = gain * rate
        else:
            self.reached["independent"] += 1
            share = reset * ts
        integrates = bool(reset > 0) and not (loop["PID_EQ"] and gain == 0)
        p = gain * error
        d = self.derivative(loop, error, rate, ts)
        i_mv = loop.i_mv
        if not integrates:
            i_mv = F(0)
            self.reached["no integral"] += 1
        elif loop.was_manual:
            i_mv = loop.mv - p - d - bias
            self.reached["manual to auto"] += 1
        before = i_mv
        if integrates:
            i_mv = i_mv + share * error
        mv = p + i_mv + d + bias
        if np.isnan(mv):
            loop.set_mv(loop.held(loop.mv))
            loop.lost = True
            self.reached["result that is no number"] += 1
            return
        limited = loop.held(mv)
        loop.limited = bool(limited != mv)
        if integrates and loop.limited:
            if loop["PID_MODE"] == 2:
                i_mv = limited - p - d - bias
                self.reached["mode 2 works I_MV out"] += 1
            else:
                i_mv = before
                self.reached["mode 0 holds I_MV"] += 1
        if finite(i_mv):
            loop.i_mv = i_mv
        loop.set_mv(limited)
        loop.was_manual = False

    def derivative(self, loop, error, rate, ts):
        """The derivative action: of the error, or of PV with the sign that the error has."""
        if not loop.past:
            loop.smooth = F(0)
        if loop["PID_DE"]:
            self.reached["derivative of PV"] += 1
            change = F(0)
            if loop.past and not loop.crossed:
                change = loop.pv_before - loop.pv if loop["PID_DIR"] else loop.pv - loop.pv_before
        else:
            self.reached["derivative of E"] += 1
            change = error - loop.error if loop.past else F(0)
        x = change / ts
        smoothing = max(loop["Tf"], F(0))
        if smoothing > 0:
            self.reached["smoothed"] += 1
            x = loop.smooth + (x - loop.smooth) * (ts / (smoothing + ts))
        if finite(x):
            loop.smooth = x
        return rate * loop.smooth

    def signals(self, loop):
        """What the PLC shows."""
        values = {
            "PV": loop.pv,
            "SV": loop["SV"],
            "MV": loop.mv,
            "MOUT": loop["MOUT"],
            "I_MV": loop.i_mv,
            "E": loop.error,
        }
        flags = {"mode": loop.mode_shown, "mv_limited": loop.limited, "in_dead_band": loop.crossed}
        return {f"{loop.name}.{name}": shown(value) for name, value in values.items()} | {
            f"{loop.name}.{name}": value for name, value in flags.items()
        }


def run(configuration, scenario, inputs, reached):
    """The signals of each base step."""
    plc = Plc(configuration, reached)
    reached["interrupt task"] += plc.interval is not None
    rows = []
    for k, measured in enumerate(inputs.rows):
        for event in inputs.due(scenario, k):
            plc.happen(event, k * inputs.step)
        rows.append(plc.scan(k * inputs.step, measured))
    return rows
