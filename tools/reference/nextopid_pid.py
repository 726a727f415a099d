"""PIDA_REAL, PIDA_INT, PIDA_TUNE_REAL and PIDA_TUNE_INT, from chapters 2 to 5 and decisions D220 to D231."""

from __future__ import annotations

import math

from reference.nextopid_tune import Tuning
from reference.single import F, finite

WHOLE = (
    *("SP", "SP_CASC", "PV", "BIAS", "ManualMV", "TRK_VAL", "MaxVarMV", "MaxMV", "MinMV", "DeadBand"),
    *("MaxPV", "MinPV"),
)
"""What is INT in the INT blocks."""
REALS = ("Kp", "Td_Kd", "Ti_Ki", "Tfd", *WHOLE)
BOOLS = ("Indep", "DisableP", "DerivEr", "CASC", "TRK_IN", "Windup_H_IN", "Windup_L_IN", "OVERR", "Manual", "Direct")
ERRORS = ("MaxMinMV", "MaxMinPV", "Kp", "Td_Kd", "Ti_Ki", "Tfd", "MaxVarMV", "DeadBand", "SampleTime")
WARNINGS = (
    *(f"{value}_{end}" for value in ("PV", "SP", "SP_CASC") for end in ("MaxPV", "MinPV")),
    *("MV_MaxMV", "MV_MinMV", "MV_P_MaxVarMV", "MV_N_MaxVarMV"),
)
SLOWEST = 60
"""Seconds; a longer SampleTime is an error."""
LEAST_TI = F(0.001)
"""Seconds; below it the dependent form has no integral."""


def share(ts, time_constant):
    """The share of the way of a first-order lag in one sample, rounded once (D236)."""
    return F(-math.expm1(-float(ts / time_constant)))


class Pid:
    """One block: ``p`` are its parameters, ``out`` its outputs."""

    def __init__(self, kind, ts, reached):
        self.ts, self.reached = F(ts), reached
        self.whole, self.tunes = "INT" in kind, "TUNE" in kind
        self.p = {name: F(0) for name in REALS} | dict.fromkeys(BOOLS, False)
        self.out = {name: F(0) for name in ("MV", "ProportionalAction", "IntegralAction", "DerivativeAction")}
        self.out |= dict.fromkeys(("TRK_OUT", "Windup_H_OUT", "Windup_L_OUT"), False) | {"SampleTime": F(0)}
        self.out |= dict.fromkeys((f"ErrBits.{name}" for name in ERRORS), False)
        self.out |= dict.fromkeys((f"WarnBits.{name}" for name in WARNINGS), False)
        self.first = True
        self.pv_before = self.error_before = self.filtered = self.integral = F(0)
        self.mode, self.sp = "manual", F(0)
        self.tuning = Tuning(self) if self.tunes else None

    # --- one call -----------------------------------------------------------------------------------------------------

    def call(self):
        """One call of the block."""
        p = self.p
        self.out["SampleTime"] = self.ts
        if self.find_errors():
            self.reached["error bit"] += 1
            return
        pv, sp = self.measured()
        error = sp - pv
        self.actions(pv, error)
        self.low, self.high = p["MinMV"], p["MaxMV"]
        self.limited_up = self.limited_down = False
        for name in WARNINGS[6:]:
            self.out[f"WarnBits.{name}"] = False
        if self.tuning and self.tuning.takes(pv):
            self.mode = "autotune" if p["AutoTune"] else self.chosen()
            self.set_back(self.tuning.mv)
        else:
            self.mode = self.chosen()
            self.reached[self.mode] += 1
            if self.mode == "manual":
                self.set_back(p["ManualMV"])
            elif self.mode == "tracking":
                self.set_back(p["TRK_VAL"])
            else:
                self.automatic(error)
        self.first = False
        self.tell_master()

    def chosen(self):
        """The mode that the inputs choose, without auto-tuning (D225)."""
        if self.p["Manual"]:
            return "manual"
        if self.p["TRK_IN"]:
            return "tracking"
        return "cascade" if self.p["CASC"] else "auto"

    def find_errors(self):
        """Sets the bits of ErrBits; whether there is one."""
        p = self.p
        bits = {
            "MaxMinMV": p["MaxMV"] <= p["MinMV"],
            "MaxMinPV": p["MaxPV"] <= p["MinPV"],
            "Kp": p["Kp"] < 0 or (p["Kp"] == 0 and not p["Indep"]),
            "SampleTime": self.ts > SLOWEST,
        }
        for name in ("Td_Kd", "Ti_Ki", "Tfd", "MaxVarMV", "DeadBand"):
            bits[name] = p[name] < 0
        for name in ERRORS:
            self.out[f"ErrBits.{name}"] = bool(bits[name])
        return any(bits.values())

    def measured(self):
        """PV and the set point in use, within MinPV and MaxPV; the warnings that tell it (D224)."""
        p = self.p
        used = {"PV": True, "SP": not p["CASC"], "SP_CASC": p["CASC"]}
        for name, counts in used.items():
            self.out[f"WarnBits.{name}_MaxPV"] = bool(counts and p[name] > p["MaxPV"])
            self.out[f"WarnBits.{name}_MinPV"] = bool(counts and p[name] < p["MinPV"])
        self.sp = min(max(p["SP_CASC"] if p["CASC"] else p["SP"], p["MinPV"]), p["MaxPV"])
        pv = min(max(p["PV"], p["MinPV"]), p["MaxPV"])
        self.reached["PV or set point limited"] += bool(pv != p["PV"] or self.sp != p["SP_CASC" if p["CASC"] else "SP"])
        return pv, self.sp

    def actions(self, pv, error):
        """The proportional and the derivative action, and the increment of the integral action (D220, D221)."""
        p = self.p
        kp, ki, kd = p["Kp"], p["Ti_Ki"], p["Td_Kd"]
        if not p["Indep"]:
            ki = kp / ki if ki >= LEAST_TI else F(0)
            kd = kp * kd
            if p["DisableP"]:
                kp = F(0)
                self.reached["P disabled"] += 1
        self.reached["independent" if p["Indep"] else "dependent"] += 1
        sign = F(-1) if p["Direct"] else F(1)
        self.reached["direct"] += p["Direct"]
        change = F(0)
        if not self.first:
            change = error - self.error_before if p["DerivEr"] else self.pv_before - pv
        self.reached["derivative of the error" if p["DerivEr"] else "derivative of PV"] += bool(kd)
        raw = sign * (kd * change / self.ts)
        if self.first:
            self.filtered = F(0)
        elif p["Tfd"] > 0:
            raw = self.filtered + (raw - self.filtered) * share(self.ts, p["Tfd"])
            self.reached["derivative filtered"] += 1
        if finite(raw):
            self.filtered = raw
        self.pv_before, self.error_before = pv, error
        self.integrates = bool(ki != 0)
        self.increment = sign * (ki * error * self.ts)
        self.out["ProportionalAction"] = sign * (kp * error)
        self.out["DerivativeAction"] = self.filtered

    # --- modes --------------------------------------------------------------------------------------------------------

    def back(self, mv, *others):
        """The integral action with which MV comes out as ``mv`` (D229)."""
        for other in others:
            mv = mv - other
        return mv

    def set_integral(self, value):
        """The integral action; 0 without an integral gain, and what is no number is not written."""
        if not self.integrates:
            self.integral = F(0)
        elif finite(value):
            self.integral = value
        self.out["IntegralAction"] = self.integral

    def write(self, mv):
        """MV within its limits, whole in an INT block (D228)."""
        if mv > self.high:
            mv, self.limited_up = self.high, True
            self.out["WarnBits.MV_MaxMV"] = True
        elif mv < self.low:
            mv, self.limited_down = self.low, True
            self.out["WarnBits.MV_MinMV"] = True
        if finite(mv):
            self.out["MV"] = F(np_round(mv)) if self.whole else mv

    def set_back(self, mv):
        """MV is given; the integral action follows it (D229)."""
        self.write(mv)
        out = self.out
        self.set_integral(
            self.back(out["MV"], out["ProportionalAction"], out["DerivativeAction"], self.p["BIAS"]),
        )

    def automatic(self, error):
        """Automatic and cascade, with override and dead band."""
        p, out = self.p, self.out
        proportional, derivative, bias = out["ProportionalAction"], out["DerivativeAction"], p["BIAS"]
        if not p["OVERR"] and abs(error) < p["DeadBand"]:
            self.set_back(out["MV"])
            self.reached["dead band"] += 1
            return
        if p["OVERR"]:
            self.set_integral(self.back(p["TRK_VAL"], derivative, bias))
            self.reached["overridden"] += 1
            increment = F(0)
        else:
            increment = self.allowed_increment()
        if not self.integrates:
            self.set_integral(F(0))
        whole = self.integral + increment
        mv = proportional + whole + derivative + bias
        stood = proportional + self.integral + derivative + bias
        low, high = self.reach()
        # of an increment of I, what would push MV past its limits is left out (D222)
        if increment > 0 and mv > high:
            whole = self.integral + max(high - stood, F(0))
            self.reached["increment cut"] += 1
        elif increment < 0 and mv < low:
            whole = self.integral + min(low - stood, F(0))
            self.reached["increment cut"] += 1
        if increment != 0:
            self.set_integral(whole)
        self.write(self.slowed(mv))

    def allowed_increment(self):
        """The increment of the integral action, unless a windup input or its gain leaves it out."""
        p, increment = self.p, self.increment
        if not self.integrates:
            return F(0)
        if (p["Windup_H_IN"] and increment > 0) or (p["Windup_L_IN"] and increment < 0):
            self.reached["windup input"] += 1
            return F(0)
        return increment

    def reach(self):
        """The lowest and the highest MV of this call: MaxVarMV from the last one, then MinMV and MaxMV (D223)."""
        before, most = self.out["MV"], self.p["MaxVarMV"]
        if most == 0:
            return self.low, self.high
        return tuple(min(max(end, self.low), self.high) for end in (before - most, before + most))

    def slowed(self, mv):
        """MV with the change that MaxVarMV allows."""
        before, most, bits = self.out["MV"], self.p["MaxVarMV"], self.out
        if most > 0 and mv > before + most:
            self.limited_up = bits["WarnBits.MV_P_MaxVarMV"] = True
            self.reached["rise limited"] += 1
            return before + most
        if most > 0 and mv < before - most:
            self.limited_down = bits["WarnBits.MV_N_MaxVarMV"] = True
            self.reached["fall limited"] += 1
            return before - most
        return mv

    def tell_master(self):
        """What a cascade master is told (D226)."""
        p, out = self.p, self.out
        up, down = (self.limited_down, self.limited_up) if p["Direct"] else (self.limited_up, self.limited_down)
        out["Windup_H_OUT"], out["Windup_L_OUT"] = up, down
        out["TRK_OUT"] = self.mode != "cascade"


def np_round(value):
    """The nearest whole number, ties to even."""
    return round(float(value))
