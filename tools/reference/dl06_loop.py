"""A loop of the DL06: its words, its samples and its modes (D36, D41 to D45, D66 to D68)."""

from __future__ import annotations

import math

from reference.dl06_alarms import ALARM_ERROR, Alarms
from reference.dl06_equation import OVERFLOW, Equation
from reference.dl06_memory import Words, bcd
from reference.dl06_profile import Profile
from reference.dl06_tune import Tuning

MANUAL, AUTO, CASCADE = 1, 2, 4
MODES = {"manual": MANUAL, "auto": AUTO, "cascade": CASCADE}


class Loop(Alarms, Equation):
    """One loop: its words and what it remembers."""

    def __init__(self, plc, entry, table):
        self.plc, self.name, self.reached = plc, entry["name"], plc.reached
        self.words = Words(plc.memory, table)
        self.independent = bool(self.words.mode(15))
        self.sees_pv, self.drives = self.module(0o36), self.module(0o37)
        self.goal = MODES[entry.get("mode", "manual")]
        self.goal = None if self.goal == MANUAL else self.goal
        self.goal_setpoint = self.words.pv_word(2) if "value" in entry.get("setpoint", {}) else None
        self.status, self.mode, self.due, self.first = MANUAL, MANUAL, 0, True
        self.pv = self.words.pv_word(3)
        self.sp = float(self.words.pv_word(2))
        out = self.words.out_word
        self.out, self.bias = out(5), float(out(4))
        self.m = float(self.out)
        self.shown_sp = self.limited(round(self.sp))
        self.remote, self.wanted, self.prior = None, None, None
        self.profile, self.tuning = Profile(self), Tuning(self)
        self.alarm = {}
        self.read_all_words()
        self.e1 = self.e2 = self.y1 = self.y2 = 0.0

    def module(self, offset):
        """Whether a word of auto transfer names a module's channel."""
        return self.words[offset] != 0 and not self.words[offset] & 0x8000

    def held(self, counts):
        """A number of counts within the data range of the output."""
        low, high = self.words.out_ends()
        return min(max(counts, low), high)

    # --- words that are not read on the fly --------------------------------------------------------------------------

    def read_late_words(self):
        """Those that are read at a change of the CPU's mode."""
        w = self.words
        self.limit, self.out_low, self.out_high = bcd(w[0o25]), w.out_word(0o30), w.out_word(0o31)
        self.profile.read_pointer()

    def read_all_words(self):
        """At the change to Run those of the alarms, too (D648)."""
        self.read_late_words()
        self.read_alarm_words((0o13, 0o14, 0o15, 0o16, 0o17, 0o20, 0o21, 0o22))

    # --- one sample --------------------------------------------------------------------------------------------------

    def sample(self, measured):
        before = self.pv
        low, high = self.words.pv_ends()
        if measured is not None:
            counts = (measured - low) * (high - low) / (high - low) + low  # D679
            self.measure(min(max(round(counts), low), high))
        self.absolute_alarms()
        self.change_mode()
        self.profile.step()
        self.other_alarms(before)
        self.shown_sp = self.setpoint()
        if not self.tuning.sample() and self.mode != MANUAL:
            self.calculate()
        self.reached[{MANUAL: "manual", AUTO: "auto", CASCADE: "cascade"}[self.mode]] += 1
        self.first = False

    def measure(self, counts):
        share = bcd(self.words[0o24]) / 10
        if self.words.mode2(2) and 0 < share <= 1 and not self.first:
            counts = round(self.pv + share * (counts - self.pv))
            self.reached["PV filter"] += 1
        self.pv = counts

    def limited(self, sp):
        if not self.words.mode2(3):
            return sp
        low, high = self.words.pv_word(0o26), self.words.pv_word(0o27)
        limited = max(min(sp, high), low)
        self.reached["SP limit"] += limited != sp
        return limited

    def setpoint(self):
        """The set point in force, a word within its limits."""
        return self.limited(self.remote if self.mode == CASCADE else round(self.sp))

    # --- modes -------------------------------------------------------------------------------------------------------

    def set_mode(self, mode):
        self.mode = mode
        self.status = self.status & ~7 | mode
        if mode != AUTO:
            self.tuning.stop()

    def change_mode(self):
        """Errors, the modes before Program mode, a request, or the configured mode."""
        if self.status & ALARM_ERROR:
            self.reached["alarm programming error"] += 1
            if self.mode != MANUAL:
                self.to_manual()
        if self.mode == CASCADE and self.major() is None:
            self.to_manual()
        if self.wanted is not None:
            wanted, self.wanted, self.goal, self.prior = self.wanted, None, None, None
            self.request(wanted)
        elif self.prior is not None:
            if self.mode == self.prior:
                self.prior = None
            else:
                self.request(AUTO if self.mode == MANUAL else self.prior, restored=True)
                if self.prior == CASCADE and self.mode == AUTO:
                    self.request(CASCADE, restored=True)
                if self.mode == self.prior:
                    self.prior = None
        if self.goal is not None:
            if self.mode == self.goal:
                if self.goal_setpoint is not None:
                    self.sp = float(self.goal_setpoint)
                self.goal = None
            else:
                self.request(AUTO if self.mode == MANUAL else self.goal)
        if self.mode == CASCADE:
            self.remote = self.major().out

    def major(self):
        return self.plc.by_output(self.words[0o32], self)

    def minors(self):
        return [loop for loop in self.plc.loops.values() if loop is not self and loop.major() is self]

    def to_manual(self):
        major = self.major() if self.mode == CASCADE else None
        self.set_mode(MANUAL)
        self.leave_cascade(major)

    def leave_cascade(self, major):
        if major is not None and major.mode != MANUAL:
            major.to_manual()
            self.reached["major to manual"] += 1

    def request(self, mode, *, restored=False):
        """A mode that is requested, as far as it is granted."""
        if mode == self.mode:
            return
        if mode == MANUAL and self.mode == AUTO:
            self.to_manual()
        elif mode == AUTO and self.mode == CASCADE:
            major = self.major()
            self.set_mode(AUTO)
            self.leave_cascade(major)
        elif mode == AUTO:
            alarmed = self.status & 0x78 and self.plc.interlock and not restored
            if self.status & ALARM_ERROR or alarmed:
                self.reached["auto refused"] += 1
            elif not restored and any(minor.mode != CASCADE for minor in self.minors()):
                self.reached["major stays in manual"] += 1
            else:
                self.to_auto()
        elif mode == CASCADE and self.mode == AUTO and self.major() is not None:
            if not self.words.mode(3):
                self.major().out = self.pv
            self.set_mode(CASCADE)

    def to_auto(self):
        w = self.words
        self.set_mode(AUTO)
        self.status &= ~OVERFLOW
        if not w.mode(5):
            self.bias = float(self.out)
        self.m = float(self.out)
        if not w.mode(3):
            self.sp = float(round(math.sqrt(max(self.pv, 0)))) if w.mode(6) else float(self.pv)
        self.reached["bumpless II" if w.mode(3) else "bumpless I"] += 1
        self.past = None

    def period(self):
        return max(bcd(self.words[7]), 5 if len(self.plc.loops) < 5 else 10)

    def shown(self):
        w = self.words
        sp = self.shown_sp
        signals = {
            "PV": self.pv,
            "SP": sp * sp if w.mode(6) else sp,
            "OUT": 0 if self.plc.program and not (self.independent and self.drives) else self.out,
            "BIAS": round(self.bias),
            "status": self.status,
            "aux_status": self.profile.word(),
        }
        return {f"{self.name}.{name}": value for name, value in signals.items()}
