"""DL06: chapter 8 of its manual and decisions D30 to D68 and D643 to D679, sample by sample, from its loop table."""

from __future__ import annotations

import math

from reference.dl06_cases import random_case
from reference.dl06_memory import Words, bcd
from reference.dl06_profile import Profile
from reference.dl06_tune import Tuning
from reference.engine import first_outputs
from reference.words import with_set, words, written

__all__ = ["COUNT", "FEATURES", "TOLERANCE", "random_case", "run"]

COUNT = 2000
TOLERANCE = {}
MANUAL, AUTO, CASCADE = 1, 2, 4
MODES = {"manual": MANUAL, "auto": AUTO, "cascade": CASCADE}
PV_ALARMS = {8: (0o13, False), 16: (0o14, False), 32: (0o15, True), 64: (0o16, True)}
YELLOW, RED, CHANGE, ALARM_ERROR, OVERFLOW = 128, 256, 512, 1024, 2048
FEATURES = (
    "direct", "reverse", "position", "velocity", "squared", "deadband", "square root", "gain 0", "reset off",
    "derivative", "derivative limited", "derivative of the PV", "freeze", "bias at an end", "output limit", "PV filter",
    "SP limit", "bumpless I", "bumpless II", "manual", "auto", "cascade", "auto refused", "major stays in manual",
    "major to manual", "alarm programming error", "low-low", "low", "high", "high-high", "yellow", "red",
    "rate of change", "held by hysteresis", "alarm words read late", "output words read late", "program",
    "step bias", "12-bit unipolar", "12-bit bipolar", "15-bit unipolar", "15-bit bipolar", "16-bit unipolar",
    "output format", "reset in minutes", "ramp", "soak", "hold", "resume", "jog", "soak deviation", "profile complete",
    "overflow", "form changed", "independent", "tuned", "tuning refused", "tuning stopped", "tuning at the ends",
)  # fmt: skip
NAMES = {8: "low-low", 16: "low", 32: "high", 64: "high-high", YELLOW: "yellow", RED: "red", CHANGE: "rate of change"}


class Loop:
    """One loop: its words and what it remembers."""

    def __init__(self, plc, entry, table):
        self.plc, self.name, self.reached = plc, entry["name"], plc.reached
        self.words = Words(plc.memory, table)
        self.independent, self.frozen = bool(self.words.mode(15)), False
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

    def read_alarm_words(self, offsets):
        for offset in offsets:
            self.alarm[offset] = self.words.pv_word(offset) if offset < 0o17 else self.words.distance(offset)
        self.check_alarms()

    def check_alarms(self):
        """Bit 10: the alarms that are on are out of order."""
        points = [self.alarm[offset] for offset in (0o13, 0o14, 0o15, 0o16)]
        wrong = self.words.mode(12) and not points[0] < points[1] < points[2] < points[3]
        wrong = wrong or (self.words.mode(13) and not self.alarm[0o17] < self.alarm[0o20])
        self.status = self.status | ALARM_ERROR if wrong else self.status & ~ALARM_ERROR

    def written(self, old_mode):
        """Words were written: alarm words are read where their bit has gone from 0 to 1."""
        new = [bit for bit in (12, 13, 14) if self.words.mode(bit) and not old_mode >> bit & 1]
        groups = {12: (0o13, 0o14, 0o15, 0o16, 0o22), 13: (0o17, 0o20, 0o22), 14: (0o21,)}  # D682
        for bit in new:
            self.read_alarm_words(groups[bit])
        self.check_alarms()

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

    # --- alarms ------------------------------------------------------------------------------------------------------

    def absolute_alarms(self):
        band = self.alarm[0o22]
        for bit, (offset, rises) in PV_ALARMS.items():
            limit = self.alarm[offset]
            beyond = self.pv > limit if rises else self.pv < limit
            back = self.pv <= limit - band if rises else self.pv >= limit + band
            self.switch(bit, self.words.mode(12), beyond=beyond, back=back)

    def other_alarms(self, before):
        sp = self.setpoint()
        away = abs(self.pv - (sp * sp if self.words.mode(6) else sp))
        for bit, offset in ((YELLOW, 0o17), (RED, 0o20)):
            limit = self.alarm[offset]
            self.switch(bit, self.words.mode(13), beyond=away > limit, back=away <= limit - self.alarm[0o22])
        fast = not self.first and abs(self.pv - before) > self.alarm[0o21]
        self.switch(CHANGE, self.words.mode(14), beyond=fast, back=not fast)

    def switch(self, bit, enabled, *, beyond, back):
        on = enabled and (beyond or (self.status & bit and not back))
        self.reached["held by hysteresis"] += bool(on and not beyond)
        self.reached[NAMES[bit]] += bool(on)
        self.status = self.status | bit if on else self.status & ~bit

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

    past = None

    # --- the equation ------------------------------------------------------------------------------------------------

    def counted_error(self):
        w = self.words
        low, high = w.pv_ends()
        span = high - low
        if w.mode(6):
            scale = math.sqrt(span)
            e = (self.setpoint() - math.sqrt(max(self.pv, 0))) / scale
        else:
            scale = span
            e = (self.setpoint() - self.pv) / span
        if w.mode(7):
            e = e * abs(e)
        if w.mode(8) and abs(e) <= w.distance(0o23) / scale and w.distance(0o23):
            self.reached["deadband"] += 1
            e = 0.0
        return e

    def calculate(self):
        w, reached = self.words, self.reached
        ts, ti, td = self.period() / 100, bcd(w[0o11]), bcd(w[0o12]) / 100
        out_low, out_high = w.out_ends()
        gain = bcd(w[0o10]) / 100 * (out_high - out_low)
        factor = gain or 1.0 * (out_high - out_low)
        seconds = 60 if w.mode2(4) else 1
        ki = 0.0 if ti in {0, 9999} else factor * ts / (ti / 10**self.plc.decimals * seconds)
        kr = factor * td / ts
        sign = -1 if w.mode(4) else 1
        e = self.counted_error()
        low, high = w.pv_ends()
        on_pv = self.plc.on_pv
        x = -self.pv / (high - low) if on_pv else e
        if on_pv and w.mode(6):
            x = -math.sqrt(max(self.pv, 0)) / math.sqrt(high - low)
        if self.past is None:
            self.e1 = e
            self.y1 = self.y2 = x
            self.past = True
            self.last_sp = self.shown_sp
        y = x
        if w.mode(9):
            limit = self.limit
            if limit == 0:
                kr = 0.0
            elif td:
                y = self.y1 + ts / (ts + td / limit) * (x - self.y1)
                reached["derivative limited"] += 1
        self.step_bias()
        if w.mode(5):
            slope = y - 2 * self.y1 + self.y2
            result = self.m + sign * (gain * (e - self.e1) + ki * e + kr * slope)
        else:
            self.integrate(sign * ki * e)
            result = self.bias + sign * (gain * e + kr * (y - self.y1))
        self.e1, self.y2, self.y1 = e, self.y1, y
        m = self.held(result)
        if abs(result) > 2**31 - 1:
            self.status |= OVERFLOW
            reached["overflow"] += 1
            self.to_manual()
            return
        self.m = max(min(m, self.out_high), self.out_low)
        self.out = round(self.m)
        reached["output limit"] += self.m != m
        for name, happened in (
            ("reverse" if w.mode(4) else "direct", True), ("velocity" if w.mode(5) else "position", True),
            ("squared", w.mode(7)), ("square root", w.mode(6)), ("gain 0", not gain), ("reset off", not ki),
            ("derivative", td), ("derivative of the PV", on_pv and td), ("reset in minutes", w.mode2(4)),
            (w.pv_format(), True), ("output format", w.mode2(10)),
        ):  # fmt: skip
            reached[name] += bool(happened)

    def step_bias(self):
        old, new, self.last_sp = self.last_sp, self.shown_sp, self.shown_sp
        if not self.plc.step_bias or self.words.mode(5) or old == new or old * new <= 0:
            return
        self.reached["step bias"] += 1
        ratio = old / new if self.words.mode(4) else new / old
        self.bias *= ratio

    def integrate(self, step):
        low, high = self.words.out_ends()
        if self.words.mode(10) and ((self.out >= high and step > 0) or (self.out <= low and step < 0)):
            self.reached["freeze"] += 1
            step = 0.0
        bias = self.bias + step
        self.bias = self.held(bias)
        self.reached["bias at an end"] += self.bias != bias

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


class Plc:
    """The loops of a table."""

    def __init__(self, configuration, scenario, reached):
        self.configuration, self.reached = configuration, reached
        self.memory = {int(address[1:], 8): value for address, value in words(configuration).items()}
        plc, options = configuration["plc"], scenario.get("plc", {})
        self.decimals = plc.get("reset_decimals", 1)
        self.on_pv = plc.get("derivative", "error") == "pv"
        self.interlock, self.step_bias = options.get("auto_interlock", True), options.get("step_bias", False)
        self.program = False
        self.loops = {}
        table = self.memory[0o7640]
        for i, entry in enumerate(configuration["loops"]):
            self.loops[entry["name"]] = Loop(self, entry, table + 0o40 * i)
        for name, value in first_outputs(scenario).items():
            self.loops[name].out = value

    def by_output(self, pointer, loop):
        """The loop whose output word a pointer names."""
        return next((x for x in self.loops.values() if x.words.table + 5 == pointer and x is not loop), None)

    def operate(self, event):
        loop = self.loops[event["loop"]]
        if self.program and not loop.independent and "set" not in event:
            loop.goal = None if "mode" in event else loop.goal
        elif "mode" in event:
            loop.wanted = MODES[event["mode"]]
        elif "autotune" in event:
            loop.tuning.request()
        elif "ramp_soak" in event:
            loop.profile.commands.add(event["ramp_soak"])
        elif "set" in event:
            self.write(loop, event["set"])

    def write(self, loop, changes):
        if "output" in changes and not isinstance(changes["output"], dict):
            loop.out = changes["output"]
            loop.m = float(loop.out)
        elif "bias" in changes:
            loop.bias = float(changes["bias"])
        else:
            old_mode = loop.words[0]
            changed = with_set(self.configuration, loop.name, changes)
            new = {int(a[1:], 8): v for a, v in written(self.configuration, changed).items()}
            self.memory.update(new)
            self.configuration = changed
            if "setpoint" in changes and not isinstance(changes["setpoint"], dict):
                loop.sp = float(loop.words.pv_word(2))
                loop.goal_setpoint = loop.words.pv_word(2)
            loop.written(old_mode)
            if (loop.words[0] ^ old_mode) >> 5 & 1:  # another form of the equation (D681)
                loop.past = None
                self.reached["form changed"] += 1
            for offset in new:
                late = offset - loop.words.table
                self.reached["alarm words read late"] += 0o13 <= late <= 0o22 and loop.words[0] == old_mode
                self.reached["output words read late"] += late in {0o30, 0o31, 0o25}
            if loop.mode != CASCADE:
                loop.shown_sp = loop.setpoint()


def run(configuration, scenario, inputs, reached):
    """Every sample of a scenario."""
    plc = Plc(configuration, scenario, reached)
    samples = []
    ticks = inputs.step // 10_000
    for row, measured in enumerate(inputs.rows):
        now = row * ticks
        for event in inputs.due(scenario, row):
            if event.get("plc") == "program":
                plc.program = True
                for loop in plc.loops.values():
                    loop.read_late_words()
                    if not loop.independent:
                        loop.prior = loop.mode if loop.mode != MANUAL else None
                    reached["independent" if loop.independent else "program"] += 1
                for loop in plc.loops.values():
                    if not loop.independent:
                        loop.to_manual()
                        loop.shown_sp = loop.setpoint()
            elif event.get("plc") == "run":
                plc.program = False
                for loop in plc.loops.values():
                    loop.read_all_words()
                    loop.due, loop.first = now, True
            elif "loop" in event:
                plc.operate(event)
        for loop in plc.loops.values():
            if now >= loop.due and (loop.independent or not plc.program):
                loop.due = now + loop.period()
                loop.sample(None if plc.program and not loop.sees_pv else measured[f"{loop.name}.PV"])
        samples.append({name: value for loop in plc.loops.values() for name, value in loop.shown().items()})
    return samples
