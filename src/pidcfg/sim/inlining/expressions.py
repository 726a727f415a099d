"""Expressions of a kernel, written anew: calls in their places, fields in local variables, what is known beforehand.

Python evaluates from the left to the right. Where an operand puts lines before the expression, the operands to its left
are put into variables before those lines, so that each is still read when it was.
"""

from __future__ import annotations

import ast
import builtins
from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from pidcfg.sim.inlining.facts import BINARY, UNARY, Facts, Frame, Known, Record, Records
from pidcfg.sim.inlining.kernels import Effects, Kernel, NotInlinedError, callee, effects_of, source_of
from pidcfg.sim.inlining.lines import Block, Fields, Lines, Sync

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence


@dataclass(slots=True)
class Expressions(ABC):
    """What expressions share; `pidcfg.sim.inlining.statements.Statements` adds statements and calls put in place."""

    swap: Mapping[Kernel, Kernel]
    inlined: Callable[[Kernel], bool]
    facts: Facts
    lists: frozenset[str]
    """Names that the text has for what the kernel takes."""
    fields: Fields = field(default_factory=Fields)
    before: dict[str, str] = field(default_factory=dict)
    """Variables that are worked out before the first step, by what they are."""
    used: dict[str, Any] = field(default_factory=dict)
    """Functions and other objects that the text names."""
    count: int = 0
    effects: dict[Kernel, Effects] = field(default_factory=dict)

    def new(self, name: str) -> str:
        """A name that nothing has yet."""
        self.count += 1
        return f"{name}_{self.count}"

    def local(self, name: str, frame: Frame) -> str:
        """The new name of a kernel's local variable."""
        return f"{name}_{frame.number}"

    def global_(self, name: str, value: Any) -> str:
        """The name by which the text reaches an object."""
        while name in self.lists or self.used.setdefault(name, value) is not value:
            name += "_"
        return name

    def steady(self, text: str) -> bool:
        """Whether a text means the same later: a number, or a variable that is set once."""
        return text[:1].isdigit() or (text.isidentifier() and text.startswith("_"))

    def kept(self, text: str) -> bool:
        """Whether a text is a number or a variable that a kernel in this place cannot change."""
        return self.steady(text) or (text.isidentifier() and text not in self.fields.names.values())

    def ready(self, known: Known) -> str:
        """A known value in the text: itself, or a variable that was worked out before."""
        if known.literal:
            return known.text
        words = "".join(c if c.isalnum() else " " for c in known.text).split()
        return self.before.setdefault(known.text, f"_{len(self.before)}_{'_'.join(words)}"[:60])

    def all(self, nodes: Sequence[ast.expr], frame: Frame, out: Lines) -> list[str]:
        """Operands in their order."""
        done: list[str] = []
        for node in nodes:
            mark = len(out)
            text = self.text(node, frame, out)
            if len(out) > mark:
                for i, earlier in enumerate(done):
                    if not self.steady(earlier):
                        done[i] = self.new("_t")
                        out.insert(mark, f"{done[i]} = {earlier}")
                        mark += 1
            done.append(text)
        return done

    def text(self, node: ast.expr, frame: Frame, out: Lines) -> str:
        """An expression; lines that have to run before it are added to ``out``."""
        match self.facts.of(node, frame):
            case Known(safe=True) as known:
                return self.ready(known)
            case Record() as record:
                self.fields.held[record] = None
                return record.name
            case Records(name=name):
                return name
        match node:
            case ast.Constant(value=value):
                return repr(value)
            case ast.Name(id=name):
                return self._name(name, frame)
            case ast.Attribute():
                return self.field(node, frame, store=False)
            case ast.Subscript(value=base, slice=index):
                first, place = self.all([base, index], frame, out)
                return f"{first}[{place}]"
            case ast.BinOp(left=left, op=op, right=right):
                first, second = self.all([left, right], frame, out)
                return f"({first} {BINARY[type(op)][0]} {second})"
            case ast.UnaryOp(op=op, operand=operand):
                return f"({UNARY[type(op)][0]}{self.text(operand, frame, out)})"
            case ast.Compare(left=left, ops=ops, comparators=others):
                return self._comparison([left, *others], ops, frame, out)
            case ast.Tuple(elts=elements):
                return f"({', '.join(self.all(elements, frame, out))},)"
            case ast.BoolOp(op=op, values=values):
                return self._condition(values, "or" if isinstance(op, ast.Or) else "and", frame, out)
            case ast.IfExp():
                return self._choice(node, frame, out)
            case ast.Call(func=ast.Name(id=name), keywords=[]):
                return self.call(name, node, frame, out)
        raise NotInlinedError(ast.unparse(node))

    def _name(self, name: str, frame: Frame) -> str:
        meant = frame.names.get(name)
        if isinstance(meant, str):
            return meant
        if meant is None and name not in source_of(frame.kernel).stores:
            value = frame.kernel.__globals__.get(name, getattr(builtins, name, None))
            return self.global_(name, value)
        if meant is None:
            return self.local(name, frame)
        raise NotInlinedError(name)

    def field(self, node: ast.Attribute, frame: Frame, *, store: bool) -> str:
        """The variable of a record's field."""
        record = self.facts.of(node.value, frame)
        if isinstance(record, Record):
            name = self.fields.name(record, node.attr)
            if store:
                self.fields.stored.add((record, node.attr))
            return name
        raise NotInlinedError(ast.unparse(node))

    def _comparison(self, nodes: list[ast.expr], ops: list[ast.cmpop], frame: Frame, out: Lines) -> str:
        inner: Lines = out if len(nodes) == 2 else []
        parts = self.all(nodes, frame, inner)
        if inner and inner is not out:
            raise NotInlinedError("a call in a chain of comparisons")
        signs = [BINARY[type(op)][0] for op in ops]
        return f"({parts[0]}{''.join(f' {sign} {part}' for sign, part in zip(signs, parts[1:], strict=True))})"

    def _condition(self, nodes: list[ast.expr], word: str, frame: Frame, out: Lines) -> str:
        """``and`` and ``or``: without the operands that are known to change nothing."""
        kept = []
        for i, node in enumerate(nodes):
            truth = self.facts.truth(node, frame)
            if truth is not (word == "and") or i == len(nodes) - 1:
                kept.append(node)
            if truth is (word == "or"):
                break
        done = [self.text(kept[0], frame, out)]
        for node in kept[1:]:
            inner: Lines = []
            text = self.text(node, frame, inner)
            if inner:
                name = self.new("t")
                out.append(f"{name} = {f' {word} '.join(done)}")
                head = f"if {name}:" if word == "and" else f"if not {name}:"
                out.append(Block(head, [*inner, f"{name} = {text}"]))
                done = [name]
            else:
                done.append(text)
        return done[0] if len(done) == 1 else f"({f' {word} '.join(done)})"

    def _choice(self, node: ast.IfExp, frame: Frame, out: Lines) -> str:
        truth = self.facts.truth(node.test, frame)
        if truth is not None:
            return self.text(node.body if truth else node.orelse, frame, out)
        test = self.text(node.test, frame, out)
        yes: Lines = []
        no: Lines = []
        first, second = self.text(node.body, frame, yes), self.text(node.orelse, frame, no)
        if not yes and not no:
            return f"({first} if {test} else {second})"
        name = self.new("t")
        out += [Block(f"if {test}:", [*yes, f"{name} = {first}"]), Block("else:", [*no, f"{name} = {second}"])]
        return name

    def call(self, name: str, node: ast.Call, frame: Frame, out: Lines) -> str:
        """A call, or the lines of what is called; the text is its result."""
        kernel = callee(frame.kernel, name, self.swap)
        if kernel is None or name in frame.names:
            if any(isinstance(self.facts.of(one, frame), Record | Records) for one in node.args):
                raise NotInlinedError(f"{name} of a record")
            function = self._name(name, frame)
            return f"{function}({', '.join(self.all(node.args, frame, out))})"
        if self.inlined(kernel) and not source_of(kernel).returns_early:
            written, before = list(out), (dict(self.facts.guards), dict(self.before))
            try:
                return self.in_place(kernel, node, frame, out)
            except NotInlinedError:
                out[:] = written
                self.facts.guards, self.before = before
        return self._called(kernel, node, frame, out)

    @abstractmethod
    def in_place(self, kernel: Kernel, node: ast.Call, frame: Frame, out: Lines) -> str:
        """The lines of a kernel in the place of its call."""

    def _called(self, kernel: Kernel, node: ast.Call, frame: Frame, out: Lines) -> str:
        """A call as it is; what it reads in records is put there before, and what it writes is fetched after."""
        arguments = self.all(node.args, frame, out)
        text = f"{self.global_(kernel.__name__, kernel)}({', '.join(arguments)})"
        facts = [self.facts.of(one, frame) for one in node.args]
        touched = [one for one in facts if isinstance(one, Record | Records)]
        if not touched:
            return text
        if kernel not in self.effects:
            self.effects[kernel] = effects_of(kernel, self.swap)
        effects, result = self.effects[kernel], self.new("_t")
        out += [
            Sync(touched, effects.all, store=True),
            f"{result} = {text}",
            Sync(touched, effects.writes, store=False),
        ]
        return result
