"""A pytest plugin: tests as mutants need them.

Random values that fail a test are not made smaller, since only that it fails counts. The simulator runs in CPython
alone: the compiled kernels of a mutant would have to be compiled anew, which takes longer than its tests.
"""

from __future__ import annotations

from hypothesis import Phase, settings

from pidcfg.sim.engine import choice as engine
from pidcfg.sim.engine import run


def pytest_collection() -> None:
    """Before the test files are loaded, and after conftest.py has chosen how many values are drawn."""
    profile = settings.get_profile("pidcfg-ci")
    settings.register_profile("mutants", profile, phases=(Phase.explicit, Phase.generate))
    settings.load_profile("mutants")
    run.numba_kernels = engine.python_kernels
