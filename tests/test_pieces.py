"""Kernels written in one piece: the same bits as kernel by kernel, and written where it pays."""

from __future__ import annotations

import math
import random
import token
from collections.abc import MutableSequence, Sequence  # noqa: TC003 - the groups' annotations are read
from dataclasses import astuple, dataclass, replace
from typing import NamedTuple

import pytest

from benchmarks.production import VENDORS, configuration, loaded
from pidcfg.sim import kernel, pieces
from pidcfg.sim.engine import python_kernels
from pidcfg.sim.inlining.kernels import NotInlinedError
from pidcfg.sim.inlining.step import step_of
from pidcfg.sim.pieces import Pieces
from test_engines import outcome, random_scenario


@dataclass(slots=True)
class Setting:
    limit: float = 4.0
    other: int = -1
    on: int = 1


@dataclass(slots=True)
class Memory:
    x: float = 0.0
    y: float = 1.0
    count: int = 0


class Group(NamedTuple):
    cfg: Sequence[Setting]
    st: MutableSequence[Memory]
    sig: MutableSequence[float]


# --- small kernels, each with something that a careless hand would change ---------------------------------------------


def add(s, amount):
    s.x += amount
    return s.x


def early(c, x):
    if x > c.limit:
        return c.limit
    if x < 0.0:
        if c.on:
            return 0.0
        x = -x
    return x + 0.5


def loop_inside(s, n):
    for i in range(n):
        s.count += i
        if s.count > 50:
            return s.count
    return 0


def both(s, a, b):
    s.x, s.y = s.y, s.x
    return a - b


def reads_before(k, group):
    _cfg, st, sig = group
    s = st[0]
    sig[0] = s.x - add(s, 1.0) * s.x
    sig[1] = both(s, s.x, s.y) + s.x
    s.y += add(s, 0.25) + s.y
    sig[2] = sig[2] + add(s, sig[2])
    return k


def skips(k, group):
    cfg, st, sig = group
    for i in range(len(st)):
        if cfg[i].on == 0:
            continue
        s = st[i]
        if s.x > 3.0:
            sig[i] = -1.0
            continue
        s.count += 1
        sig[i] = early(cfg[i], s.x * k)
    return k


def chooses(k, group):
    cfg, st, sig = group
    c = cfg[0]
    s = st[0]
    sig[0] = add(s, 1.0) if s.y > 1.0 else add(s, 10.0)
    if c.on and s.x > 0.0 and add(s, 2.0) > c.limit:
        sig[1] += 1.0
    if s.x < 0.0 or add(s, 0.5) > 7.0:
        sig[2] += loop_inside(s, 3)
    return k


def reaches(k, group):
    cfg, st, sig = group
    for i in range(len(st)):
        s = st[i]
        other = st[cfg[i].other]
        other.y += s.x
        s.x = other.y - s.y
        loop_inside(s, 12)
        if 0.0 <= s.x < cfg[i].limit:
            s.count = -s.count
    at = k % len(sig)
    while at < 3:
        at += 1
        if sig[at] > 6.0:
            continue
        if sig[at] < -6.0:
            break
        sig[at] -= early(cfg[0], sig[at])
    return k + at


def left_in_a_loop(k, group):
    _cfg, st, _sig = group
    return loop_inside(st[0], k)


KERNELS = (reads_before, skips, chooses, reaches, left_in_a_loop)
SMALL = {add, early, both, loop_inside}


def random_group(rng):
    cfg = [Setting(rng.choice([0.5, 4.0]), rng.choice([-1, 0, 1]), rng.choice([0, 1])) for _ in range(2)]
    st = [Memory(rng.uniform(-5, 5), rng.uniform(-5, 5), rng.randint(0, 60)) for _ in cfg]
    return Group(cfg, st, [rng.uniform(-9, 9) for _ in range(4)])


def left(result, group):
    return result, [astuple(one) for one in group.st], group.sig


@pytest.mark.parametrize("function", KERNELS)
def test_a_kernel_in_one_piece_leaves_what_it_leaves_call_by_call(function):
    rng, steps = random.Random(7), []
    for _ in range(300):
        group, k = random_group(rng), rng.randint(0, 5)
        copy = Group(group.cfg, [replace(one) for one in group.st], list(group.sig))
        step = next((one for one in steps if one.fits(k, group)), None)
        if step is None:
            step = step_of(function, (k, group), {}, SMALL.__contains__)
            steps.append(step)
        assert left(step.run(k, copy), copy) == left(function(k, group), group)
    assert "add(" not in steps[0].text
    assert "early(" not in steps[0].text
    assert ("loop_inside(" in steps[0].text) == (function in {chooses, reaches, left_in_a_loop})


def test_a_piece_fits_only_what_it_took_for_granted():
    rng = random.Random(1)
    group = random_group(rng)._replace(cfg=[Setting(on=1), Setting(on=1)])
    step = step_of(skips, (1, group), {}, SMALL.__contains__)

    assert step.fits(1, group)
    assert step.fits(1, group._replace(cfg=[Setting(limit=9.0, on=1), Setting(on=1)]))  # a number, no option
    assert not step.fits(1, group._replace(cfg=[Setting(on=1), Setting(on=0)]))
    assert not step.fits(1, group._replace(st=group.st[:1], cfg=group.cfg[:1]))


def of_a_module(k, group):
    cfg, st, sig = group
    if cfg[0].on == token.NAME:
        sig[0] = add(st[0], 1.0)
    else:
        sig[0] = early(cfg[0], st[0].x)
    return k


@pytest.mark.parametrize(("on", "taken", "other"), [(1, "1.0", "0.5"), (0, "0.5", "1.0")])
def test_a_branch_that_a_constant_of_a_module_decides_is_left_out(on, taken, other):
    group = random_group(random.Random(3))._replace(cfg=[Setting(on=on), Setting()])
    step = step_of(of_a_module, (1, group), {}, SMALL.__contains__)
    assert (taken in step.text, other in step.text, "token" in step.text) == (True, False, False)
    copy = Group(group.cfg, [replace(one) for one in group.st], list(group.sig))
    assert of_a_module(1, group) == step.run(1, copy)
    assert (group.sig, group.st) == (copy.sig, copy.st)


def without_end(k, group):
    _cfg, _st, sig = group
    sig[0] = min(math.inf, sig[0])
    return k


def test_an_infinity_of_a_module_has_no_literal_and_its_kernel_is_run_as_it_is():
    with pytest.raises(NotInlinedError):
        step_of(without_end, (1, random_group(random.Random(3))), {}, SMALL.__contains__)


def test_what_is_no_plain_text_is_left_alone():
    with pytest.raises(NotInlinedError):
        step_of(eval("lambda k: k"), (1,), {}, SMALL.__contains__)  # noqa: S307 - a function without a file


# --- when a piece is written -----------------------------------------------------------------------------------------


def pieces_of_skips():
    return Pieces(skips, skips, {}, frozenset(SMALL), 10)


def test_a_long_run_has_pieces_at_once_and_short_ones_after_many():
    group, several = random_group(random.Random(3)), pieces_of_skips()
    long, often = pieces.LONG // 10, pieces.OFTEN // 10

    several.begin(long - 1)
    assert several.step(100, (1, group)) is None
    several.begin(long)
    assert several.step(pieces.FEWEST_STEPS - 1, (1, group)) is None
    step = several.step(pieces.FEWEST_STEPS, (1, group))
    assert step is not None
    several.begin(0)
    assert several.step(100, (1, group)) is step

    several = pieces_of_skips()
    several.begin(pieces.EACH // 10 * 2)
    others = [group._replace(cfg=[Setting(on=a), Setting(on=b)]) for a, b in ((0, 0), (0, 1), (1, 0))]
    assert [several.step(100, (1, one)) is not None for one in others] == [True, True, False]

    several = pieces_of_skips()
    short = [several.step(often // 100, (1, group)) for _ in range(100)]
    assert short[:-1] == [None] * 99
    assert short[-1] is not None


def test_the_pieces_used_last_are_kept_and_what_cannot_be_written_is_run_as_it_is(monkeypatch):
    monkeypatch.setattr(pieces, "MOST_PIECES", 2)
    group, several = random_group(random.Random(3)), pieces_of_skips()
    groups = [group._replace(cfg=[Setting(on=a), Setting(on=b)]) for a, b in ((0, 0), (0, 1), (1, 0))]
    steps = [several.step(10**6, (1, one)) for one in groups]
    assert several.steps == [steps[2], steps[1]]
    assert several.step(10**6, (1, groups[1])) is steps[1]
    assert several.steps == [steps[1], steps[2]]

    many = group._replace(cfg=[Setting()] * 9, st=[Memory() for _ in range(9)])
    assert several.step(10**6, (1, many)) is None


# --- whole runs ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("vendor", VENDORS)
def test_random_runs_leave_the_same_bits_in_pieces_and_not(vendor, monkeypatch):
    monkeypatch.setattr(pieces, "OFTEN", 0)
    rng = random.Random(f"{vendor} in pieces")
    for loops in (1, 2, 1):
        steps = rng.randint(100, 300)
        case = loaded(configuration(vendor, loops), random_scenario(rng, vendor, loops, steps))
        several = python_kernels(case.controller).advance.__self__
        monkeypatch.setattr(pieces, "FEWEST_STEPS", 10**9)
        plain = outcome(case, "python")
        several.steps.clear()
        monkeypatch.setattr(pieces, "FEWEST_STEPS", 1)
        assert repr(outcome(case, "python")) == repr(plain)
        assert several.steps
        assert all("= scan(" not in step.text and "measure_loop(" not in step.text for step in several.steps)


def test_more_loops_run_kernel_by_kernel(monkeypatch):
    monkeypatch.setattr(pieces, "OFTEN", 0)
    monkeypatch.setattr(pieces, "MOST_LOOPS", 1)
    case = loaded(configuration("dl06", 2), random_scenario(random.Random(5), "dl06", 2, 100))
    several = python_kernels(case.controller).advance.__self__
    before = list(several.steps)
    outcome(case, "python")

    assert several.steps == before
    assert several.kernel is kernel.advance
