"""Statements of a kernel, written anew, and kernels put in the place of their calls."""

from __future__ import annotations

import ast
from dataclasses import dataclass
from typing import TYPE_CHECKING

from pidcfg.sim.inlining import facts
from pidcfg.sim.inlining.expressions import Expressions
from pidcfg.sim.inlining.facts import BINARY, Frame, Known, Record, Records, literal
from pidcfg.sim.inlining.kernels import Kernel, NotInlinedError, source_of
from pidcfg.sim.inlining.lines import Block, Leave, Lines, Sync, ends, once

if TYPE_CHECKING:
    from collections.abc import Sequence


@dataclass(slots=True)
class Statements(Expressions):
    """The text of a kernel and of those that are put into it."""

    def in_place(self, kernel: Kernel, node: ast.Call, frame: Frame, out: Lines) -> str:
        """The lines of a kernel in the place of its call."""
        source = source_of(kernel)
        self.count += 1
        inner = Frame(kernel, self.count)
        known = [self.facts.of(one, frame) for one in node.args]
        texts = self.all(node.args, frame, out)
        for name, fact, text in zip(source.parameters, known, texts, strict=True):
            kept = name not in source.stores
            if isinstance(fact, Record | Records) or (kept and isinstance(fact, Known) and fact.safe):
                inner.names[name] = fact
            elif kept and self.kept(text):
                inner.names[name] = text
            else:
                inner.names[name] = self.local(name, inner)
                out.append(f"{inner.names[name]} = {text}")
        lines = self.block(source.body, inner)
        result = f"{self.result(inner)} = "
        whole = once(lines, inner)
        last = whole[-1] if whole else None
        if isinstance(last, str) and last.startswith(result):
            out += whole[:-1]
            return last.removeprefix(result)
        out += whole
        return self.result(inner)

    def result(self, frame: Frame) -> str:
        """The variable that takes what a kernel returns."""
        return f"r_{frame.number}"

    def block(self, nodes: Sequence[ast.stmt], frame: Frame, turn: object = None) -> Lines:
        """Statements; ``turn`` is the turn of a loop that is written out around them."""
        out: Lines = []
        self.add(nodes, frame, out, turn)
        return out

    def add(self, nodes: Sequence[ast.stmt], frame: Frame, out: Lines, turn: object) -> None:
        """The same behind what is there already."""
        for node in nodes:
            if ends(out):
                return
            self._statement(node, frame, out, turn)

    def _statement(self, node: ast.stmt, frame: Frame, out: Lines, turn: object) -> None:
        match node:
            case ast.Expr(value=ast.Constant()) | ast.Pass():
                pass
            case ast.Expr(value=value):
                text = self.text(value, frame, out)
                if text.endswith(")"):
                    out.append(text)
            case ast.Assign(targets=[target], value=value):
                self._assign(target, value, frame, out)
            case ast.AugAssign():
                self._change(node, frame, out)
            case ast.If():
                self._if(node, frame, out, turn)
            case ast.For(target=ast.Name(id=name), iter=ast.Call(func=ast.Name(id="range"), args=bounds)):
                self._for(name, bounds, node.body, frame, out)
            case ast.While(test=test):
                inner: Lines = []
                head = f"while {self.text(test, frame, inner)}:"
                if inner:
                    raise NotInlinedError("a call in the condition of a loop")
                out.append(Block(head, self.block(node.body, frame)))
            case ast.Return(value=value):
                self._return(value, frame, out)
            case ast.Continue() if turn is not None:
                out.append(Leave(turn))
            case ast.Continue() | ast.Break():
                out.append("continue" if isinstance(node, ast.Continue) else "break")
            case _:
                raise NotInlinedError(ast.unparse(node))

    def _if(self, node: ast.If, frame: Frame, out: Lines, turn: object) -> None:
        truth = self.facts.truth(node.test, frame)
        if truth is not None:
            self.add(node.body if truth else node.orelse, frame, out, turn)
            return
        test = self.text(node.test, frame, out)
        yes, no = self.block(node.body, frame, turn), self.block(node.orelse, frame, turn)
        out.append(Block(f"if {test}:", yes))
        if no:
            out.append(Block("else:", no))

    def _return(self, value: ast.expr | None, frame: Frame, out: Lines) -> None:
        text = "None" if value is None else self.text(value, frame, out)
        if frame.number == 0:
            out += [Sync(None, None, store=True), f"return {text}"]
            return
        if value is not None:
            out.append(f"{self.result(frame)} = {text}")
        out.append(Leave(frame))

    def _assign(self, target: ast.expr, value: ast.expr, frame: Frame, out: Lines) -> None:
        match target, value:
            case ast.Tuple(elts=targets), ast.Tuple(elts=values) if _independent(targets, values):
                for one, its in zip(targets, values, strict=True):
                    self._assign(one, its, frame, out)
            case ast.Tuple(elts=targets), _:
                text = self.text(value, frame, out)
                out.append(f"{', '.join(self._target(one, frame) for one in targets)} = {text}")
            case ast.Subscript(value=base, slice=index), _:
                text, first, place = self.all([value, base, index], frame, out)
                out.append(f"{first}[{place}] = {text}")
            case ast.Name(id=name), _ if self._fact(name, value, frame):
                pass
            case _:
                text = self.text(value, frame, out)
                out.append(f"{self._target(target, frame)} = {text}")

    def _fact(self, name: str, value: ast.expr, frame: Frame) -> bool:
        """Whether a name that is assigned once is known, so that no variable is needed."""
        fact = self.facts.of(value, frame)
        if fact is None or (isinstance(fact, Known) and not fact.safe):
            return False
        if source_of(frame.kernel).stores[name] == 1:
            frame.names[name] = fact
            return True
        if isinstance(fact, Known):
            return False
        raise NotInlinedError(f"{name} names several records")

    def _target(self, node: ast.expr, frame: Frame) -> str:
        match node:
            case ast.Name(id=name):
                meant = frame.names.get(name, self.local(name, frame))
                if isinstance(meant, str):
                    return meant
            case ast.Attribute():
                return self.field(node, frame, store=True)
        raise NotInlinedError(ast.unparse(node))

    def _change(self, node: ast.AugAssign, frame: Frame, out: Lines) -> None:
        """``+=`` and its like; Python reads the target first."""
        sign, target = BINARY[type(node.op)][0], node.target
        if isinstance(target, ast.Subscript):
            self._change_item(target, sign, node.value, frame, out)
            return
        name = self._target(target, frame)
        before, text = self.all([_read(target), node.value], frame, out)
        out.append(f"{name} {sign}= {text}" if before == name else f"{name} = {before} {sign} {text}")

    def _change_item(self, target: ast.Subscript, sign: str, value: ast.expr, frame: Frame, out: Lines) -> None:
        inner: Lines = []
        base, place = self.all([target.value, target.slice], frame, out)
        text = self.text(value, frame, inner)
        if inner:
            at, before = self.new("_t"), self.new("_t")
            out += [f"{at} = {place}", f"{before} = {base}[{at}]", *inner, f"{base}[{at}] = {before} {sign} {text}"]
        else:
            out.append(f"{base}[{place}] {sign}= {text}")

    def _for(self, name: str, bounds: list[ast.expr], body: list[ast.stmt], frame: Frame, out: Lines) -> None:
        known = [one for bound in bounds if isinstance(one := self.facts.of(bound, frame), Known)]
        leaves = any(isinstance(part, ast.Break | ast.Return) for one in body for part in ast.walk(one))
        if len(known) == len(bounds) and not leaves and source_of(frame.kernel).stores[name] == 0:
            turns = range(*(one.value for one in known))
            if len(turns) <= facts.MOST_RECORDS:
                for one in known:
                    self.facts.decide(one)
                self._turns(name, turns, body, frame, out)
                return
        inner: Lines = []
        text = ", ".join(self.all(bounds, frame, inner))
        if inner:
            raise NotInlinedError("a call in the bounds of a loop")
        frame.names.pop(name, None)
        out.append(Block(f"for {self.local(name, frame)} in range({text}):", self.block(body, frame)))

    def _turns(self, name: str, turns: range, body: list[ast.stmt], frame: Frame, out: Lines) -> None:
        """A loop written out, turn by turn; its turns share their variables."""
        first = most = self.count
        for i in turns:
            self.count = first
            frame.names[name] = literal(i)
            turn = object()
            out += once(self.block(body, frame, turn), turn)
            most = max(most, self.count)
        self.count = most


def _independent(targets: list[ast.expr], values: list[ast.expr]) -> bool:
    """Whether assigning one after the other is the same as all at once."""
    names = {one.id for one in targets if isinstance(one, ast.Name)}
    read = {part.id for one in values for part in ast.walk(one) if isinstance(part, ast.Name)}
    return len(names) == len(targets) == len(values) and not names & read


def _read(target: ast.Name | ast.Attribute) -> ast.expr:
    if isinstance(target, ast.Name):
        return ast.Name(target.id, ast.Load())
    return ast.Attribute(target.value, target.attr, ast.Load())
