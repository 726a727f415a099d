"""The memory of a virtual EZLogix: every loop's registers and discretes, and the records that the kernels work with."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.encoders.maps.ezlogix import R_BLOCK, SPACE
from pidcfg.encoders.settings import read_settings
from pidcfg.schemas.ezlogix import CV_FULL, LoopSettings
from pidcfg.sim.controllers.ezlogix import state as bits
from pidcfg.sim.controllers.ezlogix.equation import coefficients
from pidcfg.sim.controllers.ezlogix.report import SIGNALS, WAITS_FOR_RATE, WAITS_FOR_RUN
from pidcfg.sim.controllers.ezlogix.signals import show
from pidcfg.sim.controllers.ezlogix.state import Config, State
from pidcfg.sim.controllers.ezlogix.words import configure, loop_of, tag_number, tuning
from pidcfg.sim.notices import tell
from pidcfg.sim.plc import CountsPlc
from pidcfg.sim.reaction_curve import POINTS
from pidcfg.sim.records import NEVER
from pidcfg.sim.terms import clamp

if TYPE_CHECKING:
    from collections.abc import Mapping, MutableSequence

    from pidcfg.encoders.image import Image


class Memory(CountsPlc):
    """The registers of an image, and what the kernels make of them."""

    cfg: list[Config]
    st: list[State]

    def __init__(self, image: Image) -> None:
        words = image.words
        self._goes_on = bool(image.plc.get("process_when_stopped", True))
        dialogs = [read_settings(LoopSettings, entry, f"settings[{i}]") for i, entry in enumerate(image.settings)]
        self._loops = [loop_of(words, dialog) for dialog in dialogs]
        self.loops = [dialog.loop for dialog in dialogs]
        self.goals = ["auto" if loop.bit("mode") else "manual" for loop in self._loops]
        self.place_loops(Config, State, SIGNALS, POINTS)
        for i in range(len(dialogs)):
            self._begin(i, words)

    def _begin(self, i: int, words: Mapping[int, int]) -> None:
        """What a loop starts with: its places in the shared vectors, its registers, and a request for its mode."""
        c, s, loop = self.cfg[i], self.st[i], self._loops[i]
        if loop.dialog.output.pulse is None:
            self.signals[c.sig_pulse] = ""
        c.tune_buffer = i * POINTS
        number = tag_number(loop.dialog.output.tag)
        c.feeds = self._setpoint_at(number, i)
        s.out = s.whole = clamp(float(words.get(number, 0)), 0.0, float(CV_FULL)) if number is not None else 0.0
        s.sp = float(loop.word("setpoint"))
        self._apply(i)
        s.pv, s.tune_left = c.pv_min, c.timeout
        if self.goals[i] == "auto":
            self._request_mode(i, bits.AUTO)
        self._show(i, self.sig)

    def _setpoint_at(self, number: int | None, i: int) -> int:
        """The other loop whose set point register has this number; -1: none."""
        places = [SPACE.number("R", loop.dialog.registers) + R_BLOCK.offset("setpoint") for loop in self._loops]
        return next((j for j, place in enumerate(places) if place == number and j != i), -1)

    def _apply(self, i: int) -> None:
        """Make the registers the controller's configuration."""
        c, s, loop = self.cfg[i], self.st[i], self._loops[i]
        halted = c.halt
        configure(c, loop, goes_on=self._goes_on)
        tuning(c, s, loop)
        coefficients(s)
        if c.halt:
            s.due = NEVER
        elif halted and not s.busy & bits.STOPPED:
            s.due = 0

    def _request_mode(self, i: int, mode: int) -> None:
        """Write discrete +0, which nothing refuses."""
        s = self.st[i]
        s.wanted = mode
        s.busy |= bits.REQUEST
        self._note_waiting(i, mode)

    def _note_waiting(self, i: int, mode: int = 0) -> None:
        """Leaves a notice that a request waits, as the loop is not calculated."""
        if self.cfg[i].halt:
            tell(self.st[i], WAITS_FOR_RATE, mode)
        elif self.st[i].busy & bits.STOPPED:
            tell(self.st[i], WAITS_FOR_RUN, mode)

    def _show(self, i: int, sig: MutableSequence[float]) -> None:
        """The signals that an operator's change affects at once: SP is limited, its register later."""
        c, s = self.cfg[i], self.st[i]
        written, s.sp = s.sp, clamp(s.sp, c.sp_low, c.sp_high)
        show(c, s, sig)
        s.sp = written
