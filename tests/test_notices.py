"""The numbers by which controllers say why: two reasons never share one, or one would be told as the other."""

from __future__ import annotations

import ast
import inspect

import pytest

from pidcfg.sim.controllers.click import modes as click_modes
from pidcfg.sim.controllers.click import tune_results as click_results
from pidcfg.sim.controllers.dl06 import modes as dl06_modes
from pidcfg.sim.controllers.dl06 import ramp_soak as dl06_ramp_soak
from pidcfg.sim.controllers.dl06 import tune_results as dl06_results
from pidcfg.sim.controllers.dpide import autotune as dpide_autotune
from pidcfg.sim.controllers.ezlogix import report as ezlogix_report
from pidcfg.sim.controllers.generic import report as generic_report
from pidcfg.sim.controllers.nextopid import report as nextopid_report

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
