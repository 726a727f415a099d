"""The kernel's loop over base steps in one piece: its text, and what it is right for.

Design. A run spends its time in one loop that calls a dozen small kernels, which read and write fields of records. In
CPython the calls and the fields take more time than the arithmetic. `step_of` writes that loop anew for so many loops
and plants and for the options that are in use: kernels in the place of their calls, fields in local variables, options
that are off left out. No algorithm is written twice: the text is made from the kernels' own source, at run time, and
the results are the same to the bit. It knows no vendor.

A field is put back into its record before a call that is left and reads it, and fetched again after one that writes it.
What the text took for granted (how many loops there are, which options are off) is checked at each call by ``fits``.
"""

from __future__ import annotations

import ast
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, get_args, get_origin, get_type_hints

from pidcfg.sim.inlining.facts import Fact, Facts, Frame, Records
from pidcfg.sim.inlining.kernels import Kernel, effects_of, source_of
from pidcfg.sim.inlining.lines import Lines, Sync, rendered
from pidcfg.sim.inlining.statements import Statements

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping


@dataclass(frozen=True, slots=True)
class Step:
    """A kernel in one piece."""

    text: str
    run: Callable[..., int]
    """Takes what the kernel takes."""
    fits: Callable[..., bool]
    """Whether it may run with these arguments."""


def step_of(
    kernel: Kernel, arguments: Sequence[Any], swap: Mapping[Kernel, Kernel], inlined: Callable[[Kernel], bool]
) -> Step:
    """The kernel written anew for such arguments; raises `NotInlinedError` where that cannot be.

    Args:
        kernel: its arguments are numbers and named tuples of lists, which it takes apart first.
        arguments: of a call that it has to fit.
        swap: kernels that take the place of others.
        inlined: which kernels are put in the place of their calls.
    """
    source = source_of(kernel)
    frame = Frame(kernel, 0, {name: name for name in source.parameters})
    groups = dict(zip(source.parameters, arguments, strict=True))
    head: Lines = []
    rest = [node for node in source.body if not _is_text(node)]
    while rest and _takes_apart(rest[0], groups, frame):
        head.append(ast.unparse(rest.pop(0)))
    unpacked = list(head)
    writer = Statements(swap, inlined, Facts(effects_of(kernel, swap).writes), frozenset(frame.names))
    body = writer.block(rest, frame)
    head += [f"{record.name} = {record.records.name}[{record.index}]" for record in writer.fields.held]
    head += [f"{name} = {text}" for text, name in writer.before.items()]
    head.append(Sync(None, None, store=False))
    parameters = ", ".join(source.parameters)
    lengths = [known for name in frame.names if (known := _length(frame.names[name]))]
    guards = lengths + [f"{text} == {value!r}" for text, value in writer.facts.guards.items()]
    fits = [*unpacked, f"return {' and '.join(guards) or 'True'}"]
    lines = [f"def run({parameters}):", *rendered(head + body, writer.fields)]
    lines += ["", "", f"def fits({parameters}):", *rendered(fits, writer.fields)]
    return _compiled("\n".join(lines) + "\n", kernel.__name__, writer.used)


def _is_text(node: ast.stmt) -> bool:
    """Whether a statement is a docstring."""
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)


def _length(meant: Fact | str) -> str:
    """That a list has as many records as were written out."""
    return f"len({meant.name}) == {len(meant.rows)}" if isinstance(meant, Records) and meant.few else ""


def _takes_apart(node: ast.stmt, groups: Mapping[str, Any], frame: Frame) -> bool:
    """Whether a statement takes a named tuple apart; notes what its names are then."""
    match node:
        case ast.Assign(targets=[ast.Tuple(elts=targets)], value=ast.Name(id=name)) if name in groups:
            group = groups[name]
            kinds = get_type_hints(type(group))
            for target, (part, rows) in zip(map(ast.unparse, targets), group._asdict().items(), strict=True):
                listed = get_args(kinds[part])
                fixed = get_origin(kinds[part]) is Sequence
                records = bool(listed) and listed[0] not in {int, float}
                frame.names[target] = Records(target, rows, fixed) if records else target
            return True
    return False


def _compiled(text: str, name: str, used: Mapping[str, Any]) -> Step:
    """The functions of a text."""
    names = dict(used)
    exec(compile(text, f"<{name} in one piece>", "exec"), names)  # noqa: S102 - our own kernels, written anew
    return Step(text, names["run"], names["fits"])
