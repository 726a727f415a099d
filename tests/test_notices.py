"""The numbers by which controllers say why: two reasons never share one, or one would be told as the other."""

from __future__ import annotations

import ast
import inspect

import pytest

from pidcfg.sim.controllers.click import autotune as click_autotune
from pidcfg.sim.controllers.click import operate as click_operate
from pidcfg.sim.controllers.click.equation import State as ClickState
from pidcfg.sim.controllers.dl06 import autotune as dl06_autotune
from pidcfg.sim.controllers.dl06 import operate as dl06_operate
from pidcfg.sim.controllers.dl06.equation import State as Dl06State
from pidcfg.sim.controllers.dpide import autotune as dpide_autotune
from pidcfg.sim.controllers.dpide.equation import Config as DpideConfig
from pidcfg.sim.controllers.dpide.equation import State as DpideState
from pidcfg.sim.controllers.ezlogix import autotune as ezlogix_autotune
from pidcfg.sim.controllers.ezlogix import operate as ezlogix_operate
from pidcfg.sim.controllers.ezlogix.equation import Config as EzlogixConfig
from pidcfg.sim.controllers.ezlogix.equation import State as EzlogixState
from pidcfg.sim.controllers.generic import operate as generic_operate
from pidcfg.sim.controllers.kernels import noticed, notices
from pidcfg.sim.controllers.nextopid import operate as nextopid_operate

TABLES = (
    (click_operate, "MODE_REASONS"),
    (click_autotune, "REASONS"),
    (dl06_operate, "MODE_REASONS"),
    (dl06_operate, "RAMP_SOAK_REASONS"),
    (dl06_autotune, "REASONS"),
    (dpide_autotune, "REASONS"),
    (ezlogix_operate, "REASONS"),
    (generic_operate, "REASONS"),
    (nextopid_operate, "REASONS"),
)


@pytest.mark.parametrize(("module", "name"), TABLES)
def test_every_reason_that_is_written_has_a_number_of_its_own(module, name):
    (written,) = (
        part.value
        for part in ast.parse(inspect.getsource(module)).body
        if isinstance(part, ast.Assign) and ast.unparse(part.targets[0]) == name
    )
    plain = [key for key in written.keys if key is not None]

    assert len(getattr(module, name)) >= len(plain) > 0
    assert len({eval(ast.unparse(key), vars(module)) for key in plain}) == len(plain)  # noqa: S307 - our own names


@pytest.mark.parametrize("left", [[(0, 1)], [(7, 511)], [(7, 511), (0, 1), (1, 511), (7, 1), (7, 511)]])
def test_notices_are_read_as_they_were_left(left):
    """Up to five of them, of any reason and request that have room."""
    number = 0
    for requested, reason in left:
        number = noticed(number, requested, reason)
    assert notices(number) == left
    for _ in range(5 - len(left)):
        number = noticed(number, 0, 3)
    assert notices(noticed(number, 1, 2)) == [*left, *[(0, 3)] * (5 - len(left))], "there is no room for a sixth"


@pytest.mark.parametrize(
    ("leave", "state", "reason"),
    [
        (
            lambda s: click_autotune.fail(s, click_autotune.TUNE_NO_RESPONSE),
            ClickState,
            click_autotune.TUNE_NO_RESPONSE,
        ),
        (dpide_autotune.abandon, DpideState, dpide_autotune.ABANDONED),
        (lambda s: dpide_autotune.fail(DpideConfig(), s, 3), DpideState, 3),
        (
            lambda s: ezlogix_autotune.end_tune(EzlogixConfig(), s, ezlogix_autotune.NO_STEP),
            EzlogixState,
            ezlogix_autotune.REASON + ezlogix_autotune.NO_STEP,
        ),
        (lambda s: ezlogix_autotune.tell_moving(s, 0.0), EzlogixState, ezlogix_autotune.MOVING),
        (lambda s: dl06_autotune.end_tune(s, dl06_autotune.TUNE_NO_SWING), Dl06State, dl06_autotune.TUNE_NO_SWING),
    ],
)
def test_the_end_of_an_autotune_leaves_what_was_told_before_it(leave, state, reason):
    s = state(notice=noticed(0, 1, 5), tune_drift=9.0)
    leave(s)
    assert notices(s.notice) == [(1, 5), (0, reason)]
