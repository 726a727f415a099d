"""Expressions of signals: what they mean, what is refused and where, and that nothing is ever run."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pidcfg.schemas.expressions import MAX_DEPTH, MAX_LENGTH, ExpressionError, parse
from pidcfg.sim.engine.expressions import FAULTS, Pool, evaluate

NAMES = {"TIC-101.PV": 0, "TIC-101": 1, "Fi": 2, "FIC-102.gain": 3, "Steam flow": 4, "a/b": 5, "2x": 6, "min": 7}
VALUES = [10.0, 20.0, 4.0, 0.5, 7.0, 3.0, 9.0, 1.5]


def value_and_fault(text, values=VALUES):
    pool = Pool()
    pool.add(parse("1 + Fi * 2", NAMES))  # so that nothing relies on standing first
    first, last = pool.add(parse(text, NAMES))
    stack = pool.new_stack()
    value = evaluate(pool.code, pool.constants, first, last, values, stack)
    return value, FAULTS[int(stack[0])]


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("2", 2.0),
        (".5", 0.5),
        ("1.5e2", 150.0),
        ("Fi", 4.0),
        ("1 / max(Fi, 1)", 0.25),
        ("-(Fi + 1) * 2", -10.0),
        ("--Fi", 4.0),
        ("+-Fi", -4.0),
        ("10 - 3 - 2", 5.0),
        ("100 / 10 / 5", 2.0),
        ("2 + 3 * 4", 14.0),
        ("(2 + 3) * 4", 20.0),
        ("min(3, 1, 2)", 1.0),
        ("max(3, 1, 2)", 3.0),
        ("sqrt(abs(-Fi))", 2.0),
        ("sqrt(0)", 0.0),
    ],
)
def test_arithmetic_means_what_it_means_on_paper(text, value):
    assert value_and_fault(text) == (value, "")


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("TIC-101.PV", 10.0),
        ("TIC-101 - 1", 19.0),
        ("TIC-101.PV-TIC-101", -10.0),
        ("FIC-102.gain*Fi", 2.0),
        ("Steam flow * 2", 14.0),
        ("a/b / a/b", 1.0),
        ("2x + 2", 11.0),
        ("min", 1.5),
        ("min(min, 1)", 1.0),
    ],
)
def test_the_longest_declared_name_wins_over_subtraction_division_and_numbers(text, value):
    assert value_and_fault(text) == (value, "")


@pytest.mark.parametrize(
    ("text", "offset", "message"),
    [
        ("", 0, "missing before the end"),
        ("1 +", 3, "missing before the end"),
        ("(1", 2, "closing parenthesis"),
        ("1)", 1, "unexpected ')'"),
        ("2 3", 2, "unexpected '3'"),
        ("Fi Fi", 3, "unexpected 'F'"),
        ("Fi**2", 3, "missing before '*'"),
        ("Fi // 2", 4, "missing before '/'"),
        ("Fi if 1 else 2", 3, "unexpected 'i'"),
        ("foo(1)", 0, "no function"),
        ("1 + eval('1')", 4, "no function"),
        ("__import__('os')", 0, "no function"),
        ("sqrt", 0, "needs its arguments"),
        ("min(1)", 0, "2 to 16 arguments, not 1"),
        ("abs(1, 2)", 0, "1 argument, not 2"),
        ("1e16", 0, "too large"),
        ("1e400", 0, "too large"),
        ("3abc", 0, "no declared name"),
        ("0x10", 0, "no declared name"),
        ("[1]", 0, "missing before '['"),
        ("Fi.real", 0, "no declared name"),
        ("TIC-101.PX", 0, "no declared name"),
    ],
)
def test_what_is_not_allowed_is_refused_at_its_character(text, offset, message):
    with pytest.raises(ExpressionError) as caught:
        parse(text, NAMES)
    assert message in caught.value.message
    assert caught.value.offset == offset
    assert caught.value.cure


def test_a_misspelt_name_is_met_with_the_one_that_was_meant():
    with pytest.raises(ExpressionError) as caught:
        parse("1 + TIC-101.PW", NAMES)
    assert caught.value.cure == "did you mean 'TIC-101.PV'?"
    assert caught.value.offset == 4


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("1 / (Fi - 4)", "division by zero"),
        ("0 / 0", "division by zero"),
        ("sqrt(Fi - 5)", "square root of a negative number"),
        ("1e15 * 2", "a result beyond 1e15"),
        ("*".join(["1e15"] * 21) + " * 0", "a result beyond 1e15"),
    ],
)
def test_a_result_that_does_not_exist_is_a_fault_and_never_a_nan(text, fault):
    assert value_and_fault(text) == (0.0, fault)


def test_depth_and_length_are_limited():
    parse("(" * MAX_DEPTH + "1" + ")" * MAX_DEPTH, NAMES)
    with pytest.raises(ExpressionError, match="levels of nesting"):
        parse("(" * (MAX_DEPTH + 1) + "1" + ")" * (MAX_DEPTH + 1), NAMES)
    parse("1+" * (MAX_LENGTH // 2 - 1) + "1", NAMES)
    with pytest.raises(ExpressionError, match="longer than"):
        parse("1+" * (MAX_LENGTH // 2) + "1", NAMES)


def test_the_stack_is_as_deep_as_the_deepest_expression_needs():
    pool = Pool()
    pool.add(parse("1 + (2 + (3 + (4 + 5)))", {}))
    assert pool.depth == 5
    assert len(pool.new_stack()) == 6


def test_an_expression_that_is_one_signal_is_known_as_such():
    assert parse("TIC-101.PV", NAMES).signal == 0
    assert parse("-Fi", NAMES).signal is None
    assert parse("Fi + TIC-101.PV", NAMES).signals == {0, 2}


numbers = st.floats(-1e3, 1e3).map(lambda x: round(x, 3))
trees = st.recursive(
    numbers.map(lambda x: f"({x!r})" if x < 0 else f"{x!r}") | st.sampled_from(["Fi", "a_b", "x.y"]),
    lambda inner: (
        st.tuples(inner, st.sampled_from("+-*/"), inner).map(lambda t: f"({t[0]} {t[1]} {t[2]})")
        | st.tuples(st.sampled_from(["min", "max"]), inner, inner).map(lambda t: f"{t[0]}({t[1]}, {t[2]})")
        | inner.map(lambda t: f"abs({t})")
    ),
    max_leaves=12,
)


@given(text=trees, fi=numbers, ab=numbers, xy=numbers)
def test_every_expression_of_the_grammar_has_the_value_that_python_gives_it(text, fi, ab, xy):
    names = {"Fi": 0, "a_b": 1, "x.y": 2}
    pool = Pool()
    first, last = pool.add(parse(text, names))
    stack = pool.new_stack()
    value = evaluate(pool.code, pool.constants, first, last, [fi, ab, xy], stack)
    try:
        wanted = eval(text.replace("x.y", "x_y"), {"Fi": fi, "a_b": ab, "x_y": xy, "min": min, "max": max, "abs": abs})  # noqa: S307
    except ZeroDivisionError:
        assert stack[0] == 1.0
        return
    if math.isfinite(wanted) and abs(wanted) <= 1e15:
        assert (value, stack[0]) == (wanted, 0.0)
    else:
        assert stack[0] == 3.0


@given(st.text(alphabet="0123456789.eE+-*/(), FiTCabsqrtmnx[]{}'\"_", max_size=60))
def test_no_text_brings_anything_but_a_value_or_an_expression_error(text):
    try:
        parse(text, NAMES)
    except ExpressionError as error:
        offset = error.offset
    else:
        offset = 0
        assert math.isfinite(value_and_fault(text)[0])
    assert 0 <= offset <= len(text)


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("1 / 0", "division by zero"),
        ("A / (2 - 2)", "division by zero"),
        ("sqrt(-1)", "square root of a negative number"),
        ("sqrt(min(A, -1) * 0 - 1)", None),
        ("A / (A - A)", None),
        ("sqrt(abs(-4)) + max(1, 2) / min(3, 4)", None),
    ],
)
def test_an_expression_that_can_never_have_a_value_is_known_before_it_runs(text, fault):
    from pidcfg.encoders.nextopid.wiring import no_value_reason

    found = no_value_reason(parse(text, {"A": 0}))
    assert found is None if fault is None else fault in found
