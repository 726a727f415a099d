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
    """The loops whose verdicts follow from a fault that a written expectation names (−1: all), and which it is."""
    plc = e.plc
    for wanted in e.scenario.expect:
        loop = -1 if wanted.loop is None else plc.loops.index(wanted.loop)
        if isinstance(wanted.mode, Never) and e.is_control(wanted.mode.mode):
            yield from ((j, f"{wanted.loop} is expected never to be in {wanted.mode.mode}") for j in e.family(loop))
        elif wanted.flag is not None and wanted.value is not False and wanted.value != 0:
            owner = plc.word_owners.get(wanted.flag, -1) if wanted.loop is None else loop
            if wanted.loop is None and owner < 0:
                yield -1, f"{wanted.flag} is expected"
            elif wanted.loop is None or wanted.flag in plc.error_flags:
                yield from ((j, f"{wanted.flag} of {plc.loops[owner]} is expected") for j in e.family(owner))
