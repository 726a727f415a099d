"""A pytest plugin: random values that fail a test are not made smaller, since only that it fails counts here."""

from __future__ import annotations

from hypothesis import Phase, settings


def pytest_collection() -> None:
    """Before the test files are loaded, and after conftest.py has chosen how many values are drawn."""
    profile = settings.get_profile("pidcfg-ci")
    settings.register_profile("mutants", profile, phases=(Phase.explicit, Phase.generate))
    settings.load_profile("mutants")
