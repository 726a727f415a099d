"""Which functions need what stands at the top of a module: by the names that modules define, import and mention."""

from __future__ import annotations

import ast
from functools import cache
from typing import TYPE_CHECKING, NamedTuple

from reliability.mutants import SOURCE, text_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from reliability.mutants import Mutant

Name = tuple[str, str]
"""A module's path and a name at its top."""


class Part(NamedTuple):
    """A statement at the top of a module, or a method of a class there."""

    path: str
    function: str
    """The qualified name of a function; empty: something else."""
    defines: frozenset[str]
    mentions: frozenset[Name]
    first: int
    last: int


def users(mutant: Mutant, is_called: Callable[[str, str], bool]) -> set[Name]:
    """The functions that tests call and that mention what a mutant changes, or what is made from that, and so on."""
    found, seen = set[Name](), set[Name]()
    waiting = [part for part in _parts(mutant.path) if part.first <= mutant.line <= part.last]
    while waiting:
        part = waiting.pop()
        if part.function and is_called(part.path, part.function):
            found.add((part.path, part.function))
            continue
        for name in sorted(part.defines):
            if (part.path, name) not in seen:
                seen.add((part.path, name))
                waiting += _mentioning((part.path, name))
    return found


@cache
def _mentioning(name: Name) -> list[Part]:
    """Every part of the product that mentions a name of a module."""
    return [part for path in _paths() if name[1] in text_of(path) for part in _parts(path) if name in part.mentions]


@cache
def _paths() -> list[str]:
    return sorted(file.relative_to(SOURCE).as_posix() for file in SOURCE.rglob("*.py"))


@cache
def _parts(path: str) -> tuple[Part, ...]:
    """The parts of a module."""
    body = ast.parse(text_of(path)).body
    imported = _imported(body)

    def part(nodes: Sequence[ast.AST], function: str, defines: frozenset[str], within: ast.stmt) -> Part:
        mentions = frozenset(name for node in nodes for name in _mentions(node, path, imported))
        first = min([within.lineno, *(one.lineno for one in getattr(within, "decorator_list", ()))])
        return Part(path, function, defines, mentions, first, within.end_lineno or first)

    found = []
    for statement in body:
        if isinstance(statement, ast.FunctionDef | ast.AsyncFunctionDef):
            found.append(part([statement], statement.name, frozenset({statement.name}), statement))
        elif isinstance(statement, ast.ClassDef):
            own, others = frozenset({statement.name}), [*statement.bases, *statement.decorator_list]
            for inner in statement.body:
                is_function = isinstance(inner, ast.FunctionDef | ast.AsyncFunctionDef)
                name = f"{statement.name}.{inner.name}" if is_function else ""
                found.append(part([inner], name, own, inner))
            found.append(part(others, "", own, statement)._replace(last=statement.lineno))
        elif not isinstance(statement, ast.Import | ast.ImportFrom | ast.If):
            found.append(part([statement], "", _defined(statement), statement))
    return tuple(found)


def _imported(body: Sequence[ast.stmt]) -> dict[str, Name]:
    """What the product's own names in a module stand for; of a module: its path and no name."""
    found = {}
    for node in (node for statement in body for node in ast.walk(statement)):
        if isinstance(node, ast.ImportFrom) and (node.module or "").partition(".")[0] == "pidcfg":
            for alias in node.names:
                whole, holder = _path_of(f"{node.module}.{alias.name}"), _path_of(node.module or "")
                found[alias.asname or alias.name] = (whole, "") if whole else (holder, alias.name)
    return found


def _path_of(module: str) -> str:
    """A module's path; empty: there is none."""
    path = module.replace(".", "/")
    return next((name for name in (f"{path}.py", f"{path}/__init__.py") if (SOURCE / name).is_file()), "")


def _mentions(tree: ast.AST, path: str, imported: dict[str, Name]) -> Iterator[Name]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Name):
            yield imported.get(node.id, (path, node.id))
        elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id in imported:
            yield imported[node.value.id][0], node.attr


def _defined(statement: ast.stmt) -> frozenset[str]:
    """The names that a statement gives a value; what it calls a method of gets one, too."""
    if isinstance(statement, ast.Assign | ast.AnnAssign | ast.AugAssign):
        targets: list[ast.AST] = [*(statement.targets if isinstance(statement, ast.Assign) else [statement.target])]
    else:
        targets = [statement]
    return frozenset(node.id for target in targets for node in ast.walk(target) if isinstance(node, ast.Name))
