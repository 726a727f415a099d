"""Which signals a `min` or `max` takes now, and which it leaves out, wherever it stands in an expression."""

from __future__ import annotations

from types import SimpleNamespace as Facts

import pytest

from pidcfg.schemas.expressions import parse
from pidcfg.sim.engine.expressions import Pool
from pidcfg.sim.judgement.evidence import _choices

NAMES = {"a": 0, "b": 1, "c": 2, "d": 3}


@pytest.mark.parametrize(
    ("text", "choices"),
    [
        ("min(a, b)", [("a", "b")]),
        ("max(a, b)", [("b", "a")]),
        ("min(b, a)", [("a", "b")]),
        ("max(b, a)", [("b", "a")]),
        ("min(a, a + 0)", [("a", "a")]),
        ("max(a * 5, b)", [("a", "b")]),
        ("max(a, d - 8)", [("a", "d")]),
        ("min(a, d - 8)", [("a", "d")]),
        ("max(d - 8, a)", [("d", "a")]),
        ("min(-a, b)", [("a", "b")]),
        ("max(abs(c), b)", [("c", "b")]),
        ("min(sqrt(d), b)", [("b", "d")]),
        ("1 + 2 * min(a - d, b) - 3", [("a d", "b")]),
        ("min(a, b, c)", [("a", "b"), ("c", "a b")]),
        ("max(min(a, b), c + d)", [("a", "b"), ("c d", "a b")]),
        ("min(7, a) + max(b, 1)", [("a", ""), ("b", "")]),
        ("(a + b) * c", []),
    ],
)
def test_a_choice_is_between_what_its_two_sides_read(text, choices):
    pool = Pool()
    pool.add(parse("d + 1", NAMES))
    first, last = pool.add(parse(text, NAMES))
    e = Facts(net=Facts(pool=pool), sig=[1.0, 2.0, -3.0, 9.0])

    wanted = [
        ({NAMES[name] for name in taken.split()}, {NAMES[name] for name in lost.split()}) for taken, lost in choices
    ]
    assert list(_choices(e, first, last)) == wanted
