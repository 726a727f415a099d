"""The DL06's ramp/soak generator (D54 to D56)."""

from __future__ import annotations

import math

from reference.dl06_memory import bcd, signed

COMPLETE, DEVIATION, HELD = 16, 32, 64
SEGMENTS = 16
CASCADE = 4


class Profile:
    """The generator of a loop: its present segment and what is requested."""

    def __init__(self, loop):
        self.loop, self.commands = loop, set()
        self.segment, self.left, self.pointer, self.sp = 0, 0, 0, 0.0
        self.complete = self.held = self.deviating = False

    def read_pointer(self):
        """Read at a change of the CPU's mode only."""
        self.pointer = self.loop.words[0o34]

    def word(self):
        """+33 as the controller writes it."""
        return self.complete * COMPLETE | self.deviating * DEVIATION | self.held * HELD | self.segment << 8

    def entry(self, offset):
        """A word of the present pair of ramp and soak."""
        return self.loop.plc.memory[self.pointer + 4 * ((self.segment - 1) // 2) + offset]

    def step(self):
        """One sample: commands, then the present segment; one that a command has begun moves from the next one on."""
        loop = self.loop
        commands, self.commands = self.commands, set()
        if not loop.words.mode(11):
            self.segment, self.held, self.deviating = 0, False, False
            return
        begun = loop.mode != CASCADE and not loop.plc.program and self.obey(commands)
        if loop.mode == CASCADE and self.segment:
            self.held = True
        if self.segment and not self.held and not begun and not loop.plc.program:
            self.move()
        soaking = self.segment and self.segment % 2 == 0
        allowed = self.entry(3) if soaking else 0
        pv = round(math.sqrt(max(loop.pv, 0))) if loop.words.mode(6) else loop.pv
        self.deviating = bool(allowed and abs(pv - round(loop.sp)) > allowed)
        loop.reached["soak deviation"] += self.deviating

    def obey(self, commands):
        """Start works alone, hold comes before the others (D56); whether a segment has begun."""
        reached = self.loop.reached
        if commands == {"start"}:
            self.segment, self.held, self.complete = 1, False, False
            self.sp = self.loop.sp
            self.enter()
            return True
        if not self.segment or not commands:
            return False
        if "hold" in commands:
            self.held = True
            reached["hold"] += 1
        elif "resume" in commands:
            self.held = False
            reached["resume"] += 1
            if round(self.sp) != self.loop.sp:
                self.sp = self.loop.sp
        elif "jog" in commands:
            reached["jog"] += 1
            self.advance()
            return True
        return False

    def enter(self):
        """A segment begins; a ramp without a slope ends the profile (D55)."""
        if self.segment > SEGMENTS or (self.segment % 2 and bcd(self.entry(1)) == 0):
            self.segment, self.complete, self.held = 0, True, False
            self.loop.reached["profile complete"] += 1
        elif self.segment % 2 == 0:
            self.left = bcd(self.entry(2)) * 600

    def advance(self):
        """The next segment; a profile in hold stays there."""
        self.segment += 1
        self.enter()

    def move(self):
        """One more sample of the present segment."""
        loop = self.loop
        if self.segment % 2 == 0:
            loop.reached["soak"] += 1
            self.left -= loop.period()
            if 2 * self.left < loop.period():  # the nearest number of samples (D652)
                self.advance()
            return
        loop.reached["ramp"] += 1
        low, high = loop.words.pv_ends()
        target = signed(self.entry(0), high) if low else self.entry(0)
        step = bcd(self.entry(1)) / 100 * (loop.period() / 100)
        if abs(target - self.sp) <= step:
            self.sp = float(target)
        else:
            self.sp += step if target > self.sp else -step
        loop.sp = float(round(self.sp))
        if self.sp == target:
            self.advance()
