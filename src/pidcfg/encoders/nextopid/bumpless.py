"""The two moves of figure 16-1 in a configuration: MV into ManualMV in automatic, PV into SP in manual."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from pidcfg.schemas.expressions import NOT, SIGNAL

if TYPE_CHECKING:
    from pidcfg.encoders.nextopid.encode import NextopidEncoding
    from pidcfg.schemas.expressions import Expression


class Bumpless(NamedTuple):
    """The numbers of the moves of a loop; None: it has none of this kind."""

    holds_mv: int | None
    """MV is copied into ManualMV while the loop is not in manual."""
    follows_pv: int | None
    """PV is copied into SP while it is."""


def bumpless_moves(encoding: NextopidEncoding, i: int) -> Bumpless:
    """The moves of figure 16-1 around an item: by what they read and write, whatever their signals are called."""
    return Bumpless(
        _find(encoding, i, "MV", "ManualMV", in_manual=False), _find(encoding, i, "PV", "SP", in_manual=True)
    )


def _find(encoding: NextopidEncoding, i: int, source: str, target: str, *, in_manual: bool) -> int | None:
    """The move from one parameter to another that is executed behind the blocks, in manual or else."""
    manual = _codes(encoding, i, "Manual")
    wanted = manual if in_manual else {((*code, NOT, 0), constants) for code, constants in manual}
    sources, targets = _codes(encoding, i, source), {code for code, _ in _codes(encoding, i, target)}
    for number, copy in enumerate(encoding.copies):
        if copy is None or copy.when is None or copy.at_start:
            continue
        fits = _code(copy.when) in wanted and _code(copy.value) in sources
        if fits and (SIGNAL, copy.target) in targets:
            return number
    return None


Code = tuple[tuple[int, ...], tuple[float, ...]]


def _code(expression: Expression) -> Code:
    return expression.code, expression.constants


def _codes(encoding: NextopidEncoding, i: int, key: str) -> set[Code]:
    """A parameter, and what it is wired to: both have its value behind its call."""
    numbers = encoding.layout.numbers
    number = numbers.get(f"{encoding.layout.instances[i].name}.{key}")
    wire = encoding.wires.get((i, key))
    own: set[Code] = set() if number is None else {((SIGNAL, number), ())}
    return own if wire is None else own | {_code(wire)}
