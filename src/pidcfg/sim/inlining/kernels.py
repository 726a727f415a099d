"""What the source of a kernel says: its text, the names it stores, the fields of records it reads and writes."""

from __future__ import annotations

import ast
import inspect
import linecache
from dataclasses import dataclass, field
from functools import cache
from types import FunctionType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping

Kernel = Any
"""A plain function that is also compiled; see `pidcfg.sim.compile.Kernel`."""


class NotInlinedError(Exception):
    """A piece of source that stays a call."""


@dataclass(frozen=True, slots=True)
class Effects:
    """Names of record fields that a kernel, with all that it calls, reads and writes."""

    reads: frozenset[str]
    writes: frozenset[str]

    @property
    def all(self) -> frozenset[str]:
        """Both."""
        return self.reads | self.writes


@dataclass(slots=True)
class Source:
    """A kernel's definition, and what a look through it finds."""

    body: list[ast.stmt]
    parameters: list[str]
    stores: dict[str, int] = field(default_factory=dict)
    """How often each name is assigned, as the variable of a loop aside."""
    reads: set[str] = field(default_factory=set)
    writes: set[str] = field(default_factory=set)
    size: int = 0
    """Expressions and statements."""
    returns_early: bool = False
    """Whether it returns out of a loop."""


@cache
def module_tree(path: str) -> dict[int, ast.FunctionDef]:
    """The functions of a module by their first line."""
    tree = ast.parse("".join(linecache.getlines(path)))
    return {node.lineno: node for node in tree.body if isinstance(node, ast.FunctionDef)}


@cache
def source_of(kernel: Kernel) -> Source:
    """A kernel's source; raises `NotInlinedError` where there is none to read."""
    path = inspect.getsourcefile(kernel)
    node = module_tree(path).get(kernel.__code__.co_firstlineno) if path else None
    if node is None or node.name != kernel.__name__:
        raise NotInlinedError(kernel.__name__)
    source = Source(node.body, [a.arg for a in node.args.args])
    for part in ast.walk(node):
        source.size += isinstance(part, ast.expr | ast.stmt)
        _look(part, source)
    return source


def _look(part: ast.AST, source: Source) -> None:
    if isinstance(part, ast.Name) and isinstance(part.ctx, ast.Store):
        source.stores[part.id] = source.stores.get(part.id, 0) + 1
    elif isinstance(part, ast.For) and isinstance(part.target, ast.Name):
        source.stores[part.target.id] = source.stores.get(part.target.id, 0) - 1
    elif isinstance(part, ast.AugAssign) and isinstance(part.target, ast.Name):
        source.stores[part.target.id] = source.stores.get(part.target.id, 0) + 1
    elif isinstance(part, ast.AugAssign) and isinstance(part.target, ast.Attribute):
        source.reads.add(part.target.attr)
    elif isinstance(part, ast.Attribute):
        (source.writes if isinstance(part.ctx, ast.Store) else source.reads).add(part.attr)
    if isinstance(part, ast.For | ast.While):
        source.returns_early |= any(isinstance(inner, ast.Return) for inner in ast.walk(part))


def callee(kernel: Kernel, name: str, swap: Mapping[Kernel, Kernel]) -> Kernel | None:
    """The kernel that another one calls by that name; ``swap`` puts one in the place of another."""
    value = kernel.__globals__.get(name)
    return swap.get(value, value) if isinstance(value, FunctionType) else None


def reached(kernel: Kernel, swap: Mapping[Kernel, Kernel]) -> list[Kernel]:
    """The kernel and all that it calls."""
    seen: dict[Kernel, None] = {}
    waiting = [kernel]
    while waiting:
        one = waiting.pop()
        if one not in seen:
            seen[one] = None
            waiting += [other for name in one.__code__.co_names if (other := callee(one, name, swap)) is not None]
    return list(seen)


def effects_of(kernel: Kernel, swap: Mapping[Kernel, Kernel]) -> Effects:
    """What a call of the kernel may read and write in records."""
    sources = [source_of(one) for one in reached(kernel, swap)]
    reads, writes = (frozenset().union(*part) for part in ([s.reads for s in sources], [s.writes for s in sources]))
    return Effects(reads, writes)


def constant(kernel: Kernel, name: str) -> Any:
    """A module's number or tuple of numbers that a kernel names; None for anything else."""
    value = kernel.__globals__.get(name)
    return value if isinstance(value, int | float | tuple) else None
