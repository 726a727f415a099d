"""The bits by which controllers remember: each is one bit, and no two of a word share it."""

from __future__ import annotations

import ast
import inspect
from collections import defaultdict
from functools import reduce
from operator import or_

import pytest

from pidcfg.sim.controllers.click import equation as click_state
from pidcfg.sim.controllers.click import operate as click_report
from pidcfg.sim.controllers.dl06 import equation as dl06_state
from pidcfg.sim.controllers.dl06 import operate as dl06_report
from pidcfg.sim.controllers.dpide import equation as dpide_state
from pidcfg.sim.controllers.dpide import operate as dpide_report
from pidcfg.sim.controllers.ezlogix import equation as ezlogix_state
from pidcfg.sim.controllers.ezlogix import operate as ezlogix_report
from pidcfg.sim.controllers.generic import equation as generic_state
from pidcfg.sim.controllers.generic import operate as generic_report
from pidcfg.sim.controllers.nextopid import operate as nextopid_report
from pidcfg.sim.controllers.nextopid import terms as nextopid_state

STATES = (click_state, dl06_state, dpide_state, ezlogix_state, generic_state, nextopid_state)
REPORTS = (click_report, dl06_report, dpide_report, ezlogix_report, generic_report, nextopid_report)


def words(module):
    """The numbers that a module gives names, by the comment above them, which says the word; a mask comes last."""
    source = inspect.getsource(module).partition("\n@dataclass")[0]
    comments = [number for number, line in enumerate(source.splitlines(), start=1) if line.startswith("# ")]
    found = defaultdict(list)
    for statement in ast.parse(source).body:
        above = [number for number in comments if number < statement.lineno]
        if isinstance(statement, ast.Assign) and above:
            values = statement.value.elts if isinstance(statement.value, ast.Tuple) else [statement.value]
            found[above[-1]] += [value.value for value in values if type(getattr(value, "value", None)) is int]
    return list(found.values())


@pytest.mark.parametrize("module", STATES, ids=lambda module: module.__name__)
def test_no_two_bits_of_a_word_are_the_same(module):
    found = words(module)
    assert max(map(len, found)) >= 5
    for bits in found:
        masks = [bit for at, bit in enumerate(bits) if at and bit == reduce(or_, bits[:at]) and bit.bit_count() > 1]
        single = [bit for bit in bits if bit not in masks]
        assert len({*single}) == len(single)
        assert all(bit.bit_count() == 1 for bit in single), single


@pytest.mark.parametrize("report", REPORTS, ids=lambda report: report.__name__)
def test_modes_alarms_and_flags_share_no_bit(report):
    shown = [report.MODE_BITS, getattr(report, "ALARM_BITS", {}), report.FLAG_BITS]
    modes, alarms, flags = ([*one.values()] for one in shown)
    assert len({*modes, *alarms}) == len(modes) + len(alarms)
    assert not {*flags} & {*alarms}
    assert all(bit.bit_count() == 1 for bit in (*modes, *alarms, *flags))
