"""The numbers by which controllers say why: two reasons never share one, or one would be told as the other."""

from __future__ import annotations

import ast
import inspect

import pytest

from pidcfg.sim.controllers.click import modes as click_modes
from pidcfg.sim.controllers.click import tune_results as click_results
from pidcfg.sim.controllers.click.state import State as ClickState
from pidcfg.sim.controllers.dl06 import modes as dl06_modes
from pidcfg.sim.controllers.dl06 import ramp_soak as dl06_ramp_soak
from pidcfg.sim.controllers.dl06 import tune_results as dl06_results
from pidcfg.sim.controllers.dl06.state import State as Dl06State
from pidcfg.sim.controllers.dpide import autotune as dpide_autotune
from pidcfg.sim.controllers.dpide.state import Config as DpideConfig
from pidcfg.sim.controllers.dpide.state import State as DpideState
from pidcfg.sim.controllers.ezlogix import autotune as ezlogix_autotune
from pidcfg.sim.controllers.ezlogix import report as ezlogix_report
from pidcfg.sim.controllers.ezlogix.state import Config as EzlogixConfig
from pidcfg.sim.controllers.ezlogix.state import State as EzlogixState
from pidcfg.sim.controllers.generic import report as generic_report
from pidcfg.sim.controllers.nextopid import report as nextopid_report
from pidcfg.sim.notices import noticed, notices

MODULES = (
    click_modes,
    click_results,
    dl06_modes,
    dl06_ramp_soak,
    dl06_results,
    dpide_autotune,
    ezlogix_report,
    generic_report,
    nextopid_report,
)


@pytest.mark.parametrize("module", MODULES, ids=lambda module: module.__name__.removeprefix("pidcfg.sim.controllers."))
def test_every_reason_that_is_written_has_a_number_of_its_own(module):
    (written,) = (
        part.value
        for part in ast.parse(inspect.getsource(module)).body
        if isinstance(part, ast.Assign) and ast.unparse(part.targets[0]) == "REASONS"
    )
    plain = [key for key in written.keys if key is not None]

    assert len(module.REASONS) >= len(plain) > 0
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
        (lambda s: click_results.fail(s, click_results.TUNE_NO_RESPONSE), ClickState, click_results.TUNE_NO_RESPONSE),
        (dpide_autotune.abandon, DpideState, dpide_autotune.ABANDONED),
        (lambda s: dpide_autotune.fail(DpideConfig(), s, 3), DpideState, 3),
        (
            lambda s: ezlogix_autotune.end_tune(EzlogixConfig(), s, ezlogix_autotune.NO_STEP),
            EzlogixState,
            ezlogix_autotune.REASON + ezlogix_autotune.NO_STEP,
        ),
        (lambda s: ezlogix_autotune.tell_moving(s, 0.0), EzlogixState, ezlogix_autotune.MOVING),
        (lambda s: dl06_results.end_tune(s, dl06_results.TUNE_NO_SWING), Dl06State, dl06_results.TUNE_NO_SWING),
    ],
)
def test_the_end_of_an_autotune_leaves_what_was_told_before_it(leave, state, reason):
    s = state(notice=noticed(0, 1, 5), tune_drift=9.0)
    leave(s)
    assert notices(s.notice) == [(1, 5), (0, reason)]
