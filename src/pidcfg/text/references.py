"""What a fact rests on: a place in a manual, or a numbered decision where the manual is silent.

Tables and rules carry these as data, so that documentation can quote them and a reader can look them up.
"""

from __future__ import annotations

from pidcfg.text.frozen import frozen


@frozen
class Manual:
    """A vendor's text that facts are taken from."""

    title: str
    short: str

    def cite(self, place: str) -> Ref:
        """A place in this manual: a page or the heading of a section."""
        return Ref(self, place)


@frozen
class Ref:
    """A place in a manual."""

    manual: Manual
    place: str

    def __str__(self) -> str:
        return f"{self.manual.short}, {self.place}"


@frozen
class Decision:
    """What pidcfg does where a manual is silent, misprinted or contradicts itself.

    ``number`` is stable and never reused; ``why`` names the evidence.
    """

    number: int
    title: str
    text: str
    why: str

    def __str__(self) -> str:
        return f"decision D{self.number:02d} ({self.title})"


Basis = Ref | Decision

DL06 = Manual("DL06 Micro PLC User Manual, 1st Ed., Rev. B, 6/03, chapter 8: PID Loop Operation", "DL06 manual ch. 8")
CLICK = Manual("CLICK PLC help, topic CL246: PID Control in CLICK", "CLICK help CL246")
CLICK_ERRORS = Manual("CLICK PLC help, topic CL248: CLICK PID Errors", "CLICK help CL248")
CLICK_ADDRESSES = Manual("CLICK PLC help, topic CL254: PID Address Descriptions", "CLICK help CL254")
EZLOGIX = Manual("EZLogix PLC user manual, chapter 6: PID Loop", "EZLogix manual ch. 6")
NEXTOPID = Manual("NextoPID Function Blocks User Manual (Altus)", "NextoPID manual")
DPIDE = Manual("Delta AS Series Programming Manual, chapter 6: API 0708 DPIDE", "DPIDE manual ch. 6")
