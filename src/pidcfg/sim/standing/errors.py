"""``set-up-error``: the PLC finds no fault with the set-up; and what follows from a fault that a scenario expects."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.schemas.scenario_fields import Never
from pidcfg.sim.standing.evidence import Evidence, Judgement

if TYPE_CHECKING:
    from collections.abc import Iterator


def set_up_error(e: Evidence, i: int) -> Judgement:
    """Judges one loop, by its flags and its error words."""
    m, plc = e.meters[i], e.plc
    words = [
        f"{name} = {plc.word_of_flags.format(plc.flags[name])}"
        for name, j in plc.word_owners.items()
        if j == i and plc.flags[name]
    ]
    flags = [name for name in plc.error_flags if m.ever & plc.flag_bits.get(name, 0)]
    errors = [*flags, *words, *plc.set_up_errors(i)]
    return Judgement(passed=not errors, text=", ".join(errors) or "no error of the set-up")


def plc_error(e: Evidence) -> Judgement:
    """Judges the PLC: the error words that concern all loops, and blocks that are no loops."""
    plc = e.plc
    words = [
        f"{name} = {plc.word_of_flags.format(word)}"
        for name, word in plc.flags.items()
        if word and name not in plc.word_owners
    ]
    errors = [*words, *plc.program_errors(e.sig)]
    return Judgement(passed=not errors, text=", ".join(errors) or "no error of the set-up")


def expected_errors(e: Evidence) -> Iterator[tuple[int, str]]:
    """The loops whose verdicts follow from a fault that a written expectation names (−1: all), and which it is.

    A fault that does not come excuses nothing; the expectation fails.
    """
    plc = e.plc
    for wanted in e.scenario.expect:
        owner = -1 if wanted.loop is None else plc.loops.index(wanted.loop)
        text = ""
        if isinstance(wanted.mode, Never) and e.is_control(wanted.mode.mode):
            if not e.meters[owner].ever & plc.control_bits:
                text = f"{wanted.loop} is expected never to be in {wanted.mode.mode}"
        elif wanted.flag is not None and wanted.value is not False and wanted.value != 0:
            if wanted.loop is None:
                owner = plc.word_owners.get(wanted.flag, -1)
            if _came(e, wanted.flag, owner, of_loop=wanted.loop is not None):
                text = f"{wanted.flag} {f'of {plc.loops[owner]} ' if owner >= 0 else ''}is expected"
        if text:
            yield from ((j, text) for j in (e.family(owner) if owner >= 0 else (-1,)))


def _came(e: Evidence, flag: str, owner: int, *, of_loop: bool) -> bool:
    """Whether an error has come: a word of the PLC, or a flag of a loop that means an error of its set-up."""
    if not of_loop:
        return bool(e.plc.flags[flag])
    return flag in e.plc.error_flags and bool(e.meters[owner].ever & e.plc.flag_bits.get(flag, 0))
