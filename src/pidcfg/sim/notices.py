"""Notices that a kernel leaves for the log: numbered reasons, each with the requested mode.

A notice is one number in a loop's state; several of them are its digits, the first one highest.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pidcfg.sim.records import LoopState, RequestState

NOTICES = 4096
"""A notice is below this."""
NOTICE_LIMIT = 4096**4
"""Five notices fill a number; what comes after them is left out until the log has been read."""
REASON_BITS = 9
"""A notice is a reason, and above these bits the requested mode (`Plc.request_code`; 0: nobody requested one)."""
REQUEST_BITS = 3
"""Room for the requested mode: a bit for each of three modes, or a number up to 7."""
GOAL_ENDS = (
    "the loop had not yet been in its configured mode for a sample: that mode is not requested any more, and a "
    "configured set point is not written"
)
"""What a mode request of an event puts an end to (D643); the reason's number is the vendor's."""


def noticed(notice: int, requested: int, reason: int) -> int:
    """The notices with one more (kernel)."""
    if notice < NOTICE_LIMIT:
        return notice * NOTICES + (requested << REASON_BITS) + reason
    return notice


def tell_request(s: RequestState, reason: int) -> None:
    """Leave a notice about the mode that was requested last (kernel)."""
    s.notice = noticed(s.notice, s.requested, reason)


def tell(s: LoopState, reason: int, requested: int = 0) -> None:
    """Leave a notice for the log, from outside the kernels."""
    s.notice = noticed(s.notice, requested, reason)


def notices(notice: int) -> list[tuple[int, int]]:
    """A notice number as requested mode bits and reasons, in the order in which they were left."""
    pairs: list[tuple[int, int]] = []
    while notice:
        notice, digit = divmod(notice, NOTICES)
        pairs.insert(0, divmod(digit, 1 << REASON_BITS))
    return pairs
