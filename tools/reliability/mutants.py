"""Small faults put into the product's code, one at a time: which there are, and a drawing of them with a fixed seed.

A mutant is a node of a module's syntax tree with another one in its place. The tree is never written into the source:
it is compiled with the places of the original, or unparsed into a copy.
"""

from __future__ import annotations

import ast
import copy
import random
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import CodeType
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator

SOURCE = Path(__file__).parents[2] / "src"
PACKAGES = {
    "encoders": "pidcfg/encoders",
    "conversion": "pidcfg/conversion",
    "rules": "pidcfg/validate",
    "controllers": "pidcfg/sim",
    "verification": "pidcfg/study/verification",
    "live": "pidcfg/live",
    "certification": "pidcfg/study/certification",
}
EQUAL = Path(__file__).with_name("equal_mutants.txt")
"""Survivors that do the same as the original, a line each, with the reason."""
COMPARED = {
    ast.Lt: (ast.LtE, ast.GtE), ast.LtE: (ast.Lt, ast.Gt), ast.Gt: (ast.GtE, ast.LtE), ast.GtE: (ast.Gt, ast.Lt),
    ast.Eq: (ast.NotEq,), ast.NotEq: (ast.Eq,), ast.In: (ast.NotIn,), ast.NotIn: (ast.In,), ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
}  # fmt: skip
CALCULATED = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.FloorDiv: ast.Mult,
    ast.Mod: ast.Mult, ast.BitAnd: ast.BitOr, ast.BitOr: ast.BitAnd, ast.LShift: ast.RShift, ast.RShift: ast.LShift,
}  # fmt: skip
EITHER_WAY = {"min", "max", "zip", "isinstance", "gcd"}
"""Calls whose first two arguments may change places, or never mean anything when they do."""
TOLD = {"Decision", "TypeVar", "NewType", "namedtuple"}
"""Calls that hold words for people and tools, not behaviour."""
NODES = (ast.expr, ast.stmt)


@dataclass(frozen=True)
class Mutant:
    """One change: ``slot`` and ``variant`` find it again in the module's tree."""

    path: str
    slot: int
    variant: int
    line: int
    scope: tuple[str, int]
    """Name and first line of the outermost function around it; ``("", 0)`` in the body of a module or class."""
    change: str
    column: int

    def __str__(self) -> str:
        return f"{self.path}:{self.line} {self.change}"

    @property
    def exact(self) -> str:
        """With its column: a line may have the same change twice."""
        return f"{self} @{self.column}"

    def is_in(self, names: Collection[str]) -> bool:
        """Whether names have it, with or without its column."""
        return str(self) in names or self.exact in names


class Slot(NamedTuple):
    """A place of a tree where a node stands."""

    parent: ast.AST
    field: str
    index: int | None
    node: ast.AST
    scope: tuple[str, int]

    def put(self, node: ast.AST) -> None:
        """Another node in its place."""
        ast.copy_location(node, self.node)
        if self.index is None:
            setattr(self.parent, self.field, node)
        else:
            getattr(self.parent, self.field)[self.index] = node
        ast.fix_missing_locations(self.parent)


@cache
def text_of(path: str) -> str:
    """The source of a module."""
    return (SOURCE / path).read_text("utf-8")


def slots(node: ast.AST, name: str = "", scope: tuple[str, int] = ("", 0)) -> Iterator[Slot]:
    """Every place that holds behaviour, top down; annotations, texts and what only type checkers run are left out."""
    for field, value in ast.iter_fields(node):
        if field in {"annotation", "returns", "format_spec", "decorator_list", "type_params", "bases"}:
            continue
        for index, child in enumerate(value) if isinstance(value, list) else ((None, value),):
            if not isinstance(child, ast.AST) or _silent(child):
                continue
            if isinstance(child, NODES):
                yield Slot(node, field, index, child, scope)
            yield from slots(child, *_scope(child, name, scope))


def _silent(node: ast.AST) -> bool:
    if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
        return True
    if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
        return True
    return isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in TOLD


def _scope(node: ast.AST, name: str, scope: tuple[str, int]) -> tuple[str, tuple[str, int]]:
    if isinstance(node, ast.ClassDef):
        return f"{name}{node.name}.", scope
    if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and not scope[0]:
        first = min([node.lineno, *(decorator.lineno for decorator in node.decorator_list)])
        return name, (f"{name}{node.name}", first)
    return name, scope


def variants(slot: Slot) -> list[ast.AST]:  # noqa: C901 - a kind of node a branch
    """What may stand there instead."""
    node, found = slot.node, list[ast.AST]()
    if isinstance(node, ast.Compare) and len(node.ops) >= 1:
        for number, operator in enumerate(node.ops):
            found += [_with(node, "ops", number, other()) for other in COMPARED[type(operator)]]
    elif isinstance(node, ast.BoolOp):
        other = ast.And() if isinstance(node.op, ast.Or) else ast.Or()
        found += [ast.BoolOp(other, node.values)]
    elif isinstance(node, ast.BinOp) and type(node.op) in CALCULATED:
        found += [ast.BinOp(node.left, CALCULATED[type(node.op)](), node.right)]
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not | ast.USub):
        found += [node.operand]
    elif isinstance(node, ast.Constant):
        found += [ast.Constant(value) for value in _other_values(node.value)]
    elif isinstance(node, ast.IfExp):
        found += [ast.IfExp(node.test, node.orelse, node.body)]
    elif isinstance(node, ast.Call):
        found += _swapped(node)
    elif isinstance(node, ast.If | ast.While):
        turned = copy.copy(node)
        turned.test = ast.copy_location(ast.UnaryOp(ast.Not(), node.test), node.test)
        found += [turned]
    elif isinstance(node, ast.Return):
        found += [] if node.value is None or _is_none(node.value) else [ast.Return(ast.Constant(None))]
    elif isinstance(node, ast.Expr | ast.AugAssign | ast.Raise | ast.Continue) and slot.scope[0]:
        found += [ast.Pass()]
    return found


def _with(node: ast.Compare, field: str, number: int, value: ast.AST) -> ast.Compare:
    changed = copy.copy(node)
    items = [*getattr(node, field)]
    items[number] = value
    setattr(changed, field, items)
    return changed


def _other_values(value: object) -> list[object]:
    if isinstance(value, bool):
        return [not value]
    return [value + 1, value - 1] if isinstance(value, int | float) else []


def _is_none(node: ast.AST) -> bool:
    return isinstance(node, ast.Constant) and node.value is None


def _swapped(node: ast.Call) -> list[ast.AST]:
    name = ast.unparse(node.func).rpartition(".")[2]
    plain = len(node.args) > 1 and not any(isinstance(arg, ast.Starred) for arg in node.args[:2])
    if name in EITHER_WAY or not plain or ast.dump(node.args[0]) == ast.dump(node.args[1]):
        return []
    return [ast.Call(node.func, [node.args[1], node.args[0], *node.args[2:]], node.keywords)]


@cache
def mutants(path: str) -> list[Mutant]:
    """All mutants of a module, in the order of its text."""
    found = []
    for number, slot in enumerate(slots(ast.parse(text_of(path)))):
        for variant, node in enumerate(variants(slot)):
            before, after = (_shown(part) for part in (slot.node, node))
            line, column = getattr(slot.node, "lineno", 0), getattr(slot.node, "col_offset", -1) + 1
            found.append(Mutant(path, number, variant, line, slot.scope, f"{before} -> {after}", column))
    return found


def _shown(node: ast.AST) -> str:
    return ast.unparse(ast.fix_missing_locations(copy.deepcopy(node))).splitlines()[0][:70]


def tree_of(mutant: Mutant | None, path: str) -> ast.Module:
    """A module's tree, with the change in it; None: without one."""
    tree = ast.parse(text_of(path))
    if mutant is not None:
        slot = next(slot for number, slot in enumerate(slots(tree)) if number == mutant.slot)
        slot.put(variants(slot)[mutant.variant])
    return tree


Codes = dict[tuple[str, int], CodeType]


def codes(tree: ast.Module, path: str) -> Codes:
    """The code of every function by its qualified name and first line."""
    found: Codes = {}
    waiting = [compile(tree, str(SOURCE / path), "exec")]
    while waiting:
        inner = [part for part in waiting.pop().co_consts if isinstance(part, CodeType)]
        found |= {(code.co_qualname, code.co_firstlineno): code for code in inner}
        waiting += inner
    return found


def changed_codes(mutant: Mutant) -> Codes:
    """The code that a mutant changes; none: it compiles to the same."""
    before, after = codes(tree_of(None, mutant.path), mutant.path), codes(tree_of(mutant, mutant.path), mutant.path)
    return {key: code for key, code in after.items() if key in before and code != before[key]}


def drawn(package: str, seed: int) -> list[Mutant]:
    """All mutants of a package in an order that the seed gives."""
    folder = SOURCE / PACKAGES[package]
    paths = sorted(path.relative_to(SOURCE).as_posix() for path in folder.rglob("*.py"))
    found = [mutant for path in paths for mutant in mutants(path)]
    random.Random(f"{seed} {package}").shuffle(found)
    return found


def equal() -> dict[str, str]:
    """Mutants that were proved equal, with the reasons."""
    lines = EQUAL.read_text("utf-8").splitlines() if EQUAL.exists() else []
    return dict(line.rsplit(" | ", 1) for line in lines if " | " in line)
