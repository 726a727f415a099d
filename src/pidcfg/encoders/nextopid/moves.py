"""What a program copies beside the calls of its blocks: the MOVE instructions of figures 4-6 and 16-1.

Design. A move writes a signal, or an input of a block that nothing is wired to, where its condition holds: before the
first call of a cycle or behind the last one, one after the other in the order of the file. It is read against the
`Layout` as wires are. In a listing the moves stand beside the parameters, with the settings of the PLC; in a program
they are assignments, most of them inside IF.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from pidcfg.encoders.maps.nextopid import BLOCK_TYPES
from pidcfg.encoders.parameters import store
from pidcfg.encoders.st.text import st_real
from pidcfg.encoders.values import plain
from pidcfg.encoders.words import EncodeError
from pidcfg.refs import NEXTOPID, Decision
from pidcfg.schemas.expressions import ExpressionError
from pidcfg.schemas.iec import BOOL, Wire
from pidcfg.schemas.names import nearest

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable

    from pidcfg.encoders.nextopid.wiring import Layout
    from pidcfg.encoders.parameters import Content
    from pidcfg.schemas.expressions import Expression
    from pidcfg.schemas.iec import IecType
    from pidcfg.schemas.nextopid import Move

FIGURES = NEXTOPID.at("figures 4-6 and 16-1")
D551 = Decision(
    551,
    "moves are executed before all blocks, or behind all of them",
    "`at: start` is before the first call of a cycle, `at: end`, which is the default, behind the last; moves of one "
    "place are executed in the order of the file, and each sees what the one before has written. A move whose "
    "condition or value cannot be worked out writes nothing.",
    "Figure 16-1 has its MOVE instructions below the blocks. Between two blocks there is no place of its own: the "
    "order of the blocks follows from their wires.",
)


class Copy(NamedTuple):
    """A move as it is executed: into which number of which type, when, and what."""

    target: int
    type: IecType
    value: Expression
    when: Expression | None
    """None: in every cycle."""
    at_start: bool
    literal: Content | None
    """The value, where it is no expression."""


class MoveError(Exception):
    """A move that means nothing: the key at fault, and what is wrong there."""

    def __init__(self, key: str, error: ExpressionError) -> None:
        super().__init__(f"{key}: {error.message}")
        self.key, self.error = key, error


def read_move(layout: Layout, move: Move, wired: Collection[str], given: Collection[str]) -> Copy:
    """What a move means; ``wired``: names of parameters that have a wire, ``given``: those that are in the file."""
    target = _target(layout, move.to, wired, given)
    kind, literal = layout.types[move.to], None
    try:
        if not isinstance(move.move, Wire):
            literal = _stored(move, kind)
        text = move.move.text if isinstance(move.move, Wire) else _text(literal)
        value = layout.read(kind, text)
    except (ExpressionError, EncodeError) as error:
        raise MoveError("move", _as_expression(error)) from None
    try:
        when = None if move.when is True else layout.read(BOOL, _when_text(move))
    except ExpressionError as error:
        raise MoveError("when", error) from None
    if when is None and move.at == "start" and layout.owner(target) is not None:
        message = f"{move.to} is written before every call, which is what a wire does"
        raise MoveError("to", ExpressionError(message, 0, f"wire it: {move.to.partition('.')[2]}: {text}"))
    return Copy(target, kind, value, when, move.at == "start", literal)


def _stored(move: Move, kind: IecType) -> Content:
    """What a target of this type holds of a value."""
    value = str(move.move).upper()
    if isinstance(move.move, Wire) or isinstance(move.move, bool) != (kind.kind == "bool"):
        raise ExpressionError(f"{move.to} is {kind.name}, and {value} is none", 0, "write a value of its type")
    return store(kind, move.move)


def _text(content: Content | None) -> str:
    """A content as an expression."""
    return str(content).upper() if isinstance(content, bool) else st_real(float(content or 0))


def _when_text(move: Move) -> str:
    return move.when.text if isinstance(move.when, Wire) else "FALSE"


def _as_expression(error: Exception) -> ExpressionError:
    return error if isinstance(error, ExpressionError) else ExpressionError(str(error), 0, "write a value of its type")


def _target(layout: Layout, name: str, wired: Collection[str], given: Collection[str]) -> int:
    """The number of what is written; refuses what another one writes."""
    problem = cure = ""
    number = layout.numbers.get(name)
    owner = None if number is None else layout.owner(number)
    if number is None:
        near = nearest(name, [*layout.numbers])
        problem = f"{name!r} is no declared signal, and no parameter of a block"
        cure = f"did you mean {near!r}?" if near else "declare it among the signals"
    elif layout.types[name].kind not in {"bool", "real", "whole"}:
        problem, cure = f"{name} is {layout.types[name].name}", "numbers and BOOLs can be moved"
    elif owner is not None and not layout.is_input(number):
        problem, cure = f"{name} is an output of its block", "move it to a signal, or to an input"
    elif owner is not None and layout.instances[owner].kind.function:
        kind = layout.instances[owner].kind.name
        problem, cure = f"{name}: {kind} is a function, which keeps nothing", "wire it to a signal, and move there"
    elif name in wired:
        problem, cure = f"{name} is wired, and its wire writes it at every call", "move to what it is wired to"
    elif owner is not None and name not in given and _is_open(layout.instances[owner].kind.name, name):
        problem, cure = f"{name} is left to the program around", "wire it to a signal, and move there"
    if problem or number is None:
        raise MoveError("to", ExpressionError(problem, 0, cure))
    return number


def _is_open(kind: str, name: str) -> bool:
    """Whether an input that is not given is one that the program around assigns."""
    field = BLOCK_TYPES[kind].model.model_fields.get(name.partition(".")[2])
    return field is not None and field.default is None and not field.is_required()


def read_moves(layout: Layout, moves: Iterable[Move], wired: Collection[str], given: Collection[str]) -> list[Copy]:
    """All moves of a listing, in the order of execution; raises `MoveError` for one that means nothing."""
    copies = [read_move(layout, move, wired, given) for move in moves]
    return sorted(copies, key=lambda copy: not copy.at_start)


def entry_of(move: Move) -> dict[str, Any]:
    """A move as it stands beside the parameters of a listing."""
    value = move.move.text if isinstance(move.move, Wire) else plain(move.move)
    entry: dict[str, Any] = {"move": value, "to": move.to}
    if move.when is not True:
        entry["when"] = move.when.text if isinstance(move.when, Wire) else move.when
    return entry | ({"at": move.at} if move.at == "start" else {})
