"""The alarms of a DL06 loop and the words that they have read (D46 to D48, D648, D682)."""

from __future__ import annotations

PV_ALARMS = {8: (0o13, False), 16: (0o14, False), 32: (0o15, True), 64: (0o16, True)}
YELLOW, RED, CHANGE, ALARM_ERROR = 128, 256, 512, 1024
NAMES = {8: "low-low", 16: "low", 32: "high", 64: "high-high", YELLOW: "yellow", RED: "red", CHANGE: "rate of change"}


class Alarms:
    """The part of a loop that watches its PV."""

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
