"""The same surroundings for every test, whatever terminal or CI runs them."""

import pytest
from hypothesis import settings

from browser import browser

__all__ = ["browser"]  # fixtures that stand in modules of their own

SCRUBBED = ("NO_COLOR", "FORCE_COLOR", "CLICOLOR", "CLICOLOR_FORCE", "COLUMNS", "LINES", "CI", "GITHUB_ACTIONS")
"""Variables that change what a command prints."""

# A slow machine is no failure; random tests are about values, not about time.
settings.register_profile("pidcfg", deadline=None)
settings.load_profile("pidcfg")


@pytest.fixture(autouse=True)
def plain_environment(monkeypatch):
    for name in SCRUBBED:
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("PYTHONUTF8", "1")
