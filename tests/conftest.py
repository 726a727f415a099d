"""The same surroundings for every test, whatever terminal or CI runs them."""

import gc
import ipaddress
import os
import signal
import socket
import sys

import pytest
from hypothesis import settings

from browser import browser  # noqa: F401 - a fixture, for every test that opens a page
from pidcfg.__main__ import FEW_COLLECTIONS
from pidcfg.cli import findings as collect
from pidcfg.text import processes

pytest_plugins = ("fast",)

SCRUBBED = (
    "NO_COLOR",
    "FORCE_COLOR",
    "CLICOLOR",
    "CLICOLOR_FORCE",
    "COLUMNS",
    "LINES",
    "CI",
    "GITHUB_ACTIONS",
    "TF_BUILD",
    "TEAMCITY_VERSION",
    "GITHUB_WORKSPACE",
    "CI_PROJECT_DIR",
)
"""Variables that change what a command prints, beside those of its own options."""

gc.set_threshold(*FEW_COLLECTIONS)

# A slow machine is no failure; random tests are about values, not about time. In CI they draw the same values each
# time, and fewer of them: what stops a change there is the change itself. New values are drawn by those who develop.
settings.register_profile("pidcfg", deadline=None)
settings.register_profile("pidcfg-ci", deadline=None, derandomize=True, database=None, max_examples=60)
settings.load_profile("pidcfg-ci" if os.environ.get("CI") else "pidcfg")


class Missing:
    """Skips a test that comes upon a package of the extras `report` and `png`, by itself or by pidcfg, without it."""

    PACKAGES = ("jinja2", "matplotlib", "openpyxl", "xlsxwriter")

    def find_spec(self, name, *_):
        if name in self.PACKAGES:
            raise pytest.skip.Exception(f"{name} is not installed", allow_module_level=True)


sys.meta_path.append(Missing())  # the last one that is asked


CONNECT = socket.socket.connect


def connect_here(self, address):
    """Tests talk to this machine and no other: the address of an example is nobody's to try."""
    is_network = self.family in {socket.AF_INET, socket.AF_INET6} and self.type & socket.SOCK_STREAM
    if is_network and address[0] != "localhost" and not ipaddress.ip_address(address[0]).is_loopback:
        raise AssertionError(f"a test connects to {address[0]}")
    return CONNECT(self, address)


socket.socket.connect = connect_here


@pytest.hookimpl(wrapper=True)
def pytest_collection():
    """What is collected stays to the end: nobody searches it for cycles, neither now nor later."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


@pytest.fixture(autouse=True)
def plain_environment(monkeypatch):
    for name in (*SCRUBBED, *(name for name in os.environ if name.startswith("PIDCFG_"))):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(
        collect, "_open_cache", lambda _: None
    )  # no findings are kept: tests change rules while they run
    monkeypatch.setenv("PYTHONUTF8", "1")
    monkeypatch.setattr(processes, "cores", lambda: 1)  # the others are busy with tests; who means more says --jobs


@pytest.fixture
def heeding_interrupts():
    """A shell starts what it puts into the background deaf to Ctrl-C, and children inherit that."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture(scope="module")
def desk():
    """Modbus servers that answer as a test wants, in a thread of their own."""
    from live_rig import Desk

    desk = Desk()
    yield desk
    desk.close()
