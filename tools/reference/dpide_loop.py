"""One DPIDE instruction and its algorithm; D255, D265 to D275, D685 to D689."""

from __future__ import annotations

import numpy as np

from reference.single import F, finite, real

REALS = ("SV", "Kc_Kp", "Ti_Ki", "Td_Kd", "Tf", "ERR_DBW", "MV_MAX", "MV_MIN", "MOUT", "BIAS")
FLAGS = ("PID_RUN", "PID_MAN", "MOUT_AUTO", "PID_EQ", "PID_DE", "PID_DIR")
WHOLE = ("PID_MODE", "CYCLE")


class Loop:
    """One instruction: its operands, and what it remembers."""

    def __init__(self, given, reached):
        self.name, self.reached = given["name"], reached
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

    def calculate(self, ts):
        """One calculation of the instruction."""
        raw = self["SV"] - self.pv if self["PID_DIR"] else self.pv - self["SV"]
        self.reached["reverse"] += not self["PID_DIR"]
        self.dead_band(raw)
        error = F(0) if self.crossed else raw
        mode = self.mode
        self.mode_shown = mode
        self.lost = False
        self.reached["limits swapped"] += bool(self["MV_MIN"] > self["MV_MAX"])
        if mode == "manual":
            self.by_hand()
        elif mode == "auto":
            self.automatic(error, ts)
        self.error = error
        self.pv_before = self.pv
        self.past = mode == "auto" and not self.lost
        if self["MOUT_AUTO"]:
            self.operands["MOUT"] = self.mv
            self.reached["MOUT follows"] += 1

    def dead_band(self, raw):
        """Whether the error counts as 0: from the crossing of SV until PV leaves the band (D268)."""
        sign = float(raw > 0) - float(raw < 0)
        band = abs(self["ERR_DBW"])
        inside = bool(abs(raw) < band)
        if not inside:
            self.reached["left the band"] += self.crossed
            self.crossed = False
        elif sign and self.sign and sign != self.sign:
            self.crossed = True
            self.reached["crossed the set point in the band"] += 1
        if sign:
            self.sign = sign

    def by_hand(self):
        """MV is MOUT within the limits (D274)."""
        mout = self["MOUT"]
        self.set_mv(self.held(mout))
        self.limited = bool(self.mv != mout)
        self.forget()
        self.was_manual = True
        self.reached["manual"] += 1
        self.reached["MOUT is MV"] += self.mout_is_mv

    def automatic(self, error, ts):
        """The PID algorithm (D265, D269 to D272)."""
        gain, reset, rate = (max(self[name], F(0)) for name in ("Kc_Kp", "Ti_Ki", "Td_Kd"))
        self.reached["coefficient below 0"] += any(self[name] < 0 for name in ("Kc_Kp", "Ti_Ki", "Td_Kd", "Tf"))
        bias = self["BIAS"]
        if self["PID_EQ"]:
            self.reached["dependent"] += 1
            share = gain * ts / reset if reset > 0 else F(0)
            rate = gain * rate
        else:
            self.reached["independent"] += 1
            share = reset * ts
        integrates = bool(reset > 0) and not (self["PID_EQ"] and gain == 0)
        p = gain * error
        d = self.derivative(error, rate, ts)
        i_mv = self.i_mv
        if not integrates:
            i_mv = F(0)
            self.reached["no integral"] += 1
        elif self.was_manual:
            taken = self.mv - p - d - bias
            i_mv = taken if finite(taken) else i_mv
            self.reached["manual to auto"] += 1
        before = i_mv
        if integrates:
            i_mv = i_mv + share * error
        mv = p + i_mv + d + bias
        if np.isnan(mv):
            self.set_mv(self.held(self.mv))
            self.lost = True
            self.reached["result that is no number"] += 1
            return
        limited = self.held(mv)
        self.limited = bool(limited != mv)
        if integrates and self.limited:
            if self["PID_MODE"] == 2:
                i_mv = limited - p - d - bias
                self.reached["mode 2 works I_MV out"] += 1
            else:
                i_mv = before
                self.reached["mode 0 holds I_MV"] += 1
        if finite(i_mv):
            self.i_mv = i_mv
        self.set_mv(limited)
        self.was_manual = False

    def derivative(self, error, rate, ts):
        """The derivative action: of the error, or of PV with the sign that the error has."""
        if not self.past:
            self.smooth = F(0)
        if self["PID_DE"]:
            self.reached["derivative of PV"] += 1
            change = F(0)
            if self.past and not self.crossed:
                change = self.pv_before - self.pv if self["PID_DIR"] else self.pv - self.pv_before
        else:
            self.reached["derivative of E"] += 1
            change = error - self.error if self.past else F(0)
        x = change / ts
        smoothing = max(self["Tf"], F(0))
        if smoothing > 0:
            self.reached["smoothed"] += 1
            x = self.smooth + (x - self.smooth) * (ts / (smoothing + ts))
        if finite(x):
            self.smooth = x
        return rate * self.smooth


def typed(operand, value):
    """A value as its operand holds it."""
    if operand in FLAGS:
        return bool(value)
    return int(value) if operand in WHOLE else real(value)
