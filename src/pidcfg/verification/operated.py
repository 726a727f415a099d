"""Whether a loop does what its operator asks: one whose mode the program gives it shows nothing of the other modes."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

from pidcfg.verification.comparison import IN_AUTO

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.verification.acts import Stage
    from pidcfg.verification.trial import Trial


def refused(stage: Stage, trial: Trial, sample: float) -> str:
    """The first mode that a stage asks for and the loop does not go to before the next is asked; empty: none."""
    for mode, first, last in _asked(stage, sample):
        wanted = mode if trial.cascades else IN_AUTO.get(mode, mode)
        if wanted not in trial.modes[first:last]:
            return mode
    return ""


def _asked(stage: Stage, sample: float) -> Iterator[tuple[str, int, int]]:
    """The modes of a stage, each with the samples in which it is the one that is wanted."""
    acts = [(act.mode, round(act.at / sample)) for act in stage.acts if act.mode is not None]
    for (mode, first), (_, last) in pairwise([*acts, ("", round(stage.end / sample) + 1)]):
        if last > first:
            yield mode, first, last
