"""Ctrl-C and SIGTERM: what is to end with a result ends with it, and everything else as any command does."""

import asyncio
import errno
import gc
import io
import os
import signal
import threading
import warnings

import pytest

import pidcfg
from live_rig import CLICK, Registers, run, words_of
from pidcfg.cli import interrupts

SCENARIO = CLICK.with_name("tank.scenario.yaml")
BOTH = [signal.SIGINT, signal.SIGTERM]


@pytest.fixture
def handlers(monkeypatch):
    """The handlers of the command line, which are there again after the work."""
    before = {number: signal.getsignal(number) for number in BOTH}
    running = asyncio._get_running_loop()
    asyncio._set_running_loop(None)  # that of a browser, if a test before this one has begun it
    monkeypatch.setattr(os, "register_at_fork", lambda **_: None)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    interrupts.begin()
    installed = {number: signal.getsignal(number) for number in BOTH}
    yield
    assert {number: signal.getsignal(number) for number in BOTH} == installed
    for number, handler in before.items():
        signal.signal(number, handler)
    asyncio._set_running_loop(running)


@pytest.mark.usefixtures("handlers")
@pytest.mark.parametrize("number", BOTH)
def test_a_server_that_is_ended_gives_its_report(number):
    result = pidcfg.serve(SCENARIO, listen="127.0.0.1:0", ready=lambda _: signal.raise_signal(number))
    assert result.ok
    assert result.outcome.report is not None


@pytest.mark.usefixtures("handlers")
def test_a_server_in_a_notebook_is_ended_by_ctrl_c():
    main = threading.main_thread().ident

    async def cell():
        ready = lambda _: signal.pthread_kill(main, signal.SIGINT)  # noqa: E731
        return pidcfg.serve(SCENARIO, listen="127.0.0.1:0", ready=ready)

    assert asyncio.run(cell()).outcome.report is not None


def test_where_no_loop_can_be_made_the_error_is_all_that_is_told(monkeypatch):
    def refuse(*_, **__):
        raise OSError(errno.EMFILE, "Too many open files")

    monkeypatch.setattr(asyncio.events, "new_event_loop", refuse)
    monkeypatch.setattr(asyncio, "_get_running_loop", lambda: None)
    with warnings.catch_warnings(record=True, action="always") as told:
        with pytest.raises(OSError, match="Too many"):
            pidcfg.serve(SCENARIO, listen="127.0.0.1:0")
        gc.collect()
    assert [str(one.message) for one in told] == []


@pytest.mark.usefixtures("handlers")
def test_ctrl_c_before_the_work_has_begun_ends_it_in_a_notebook_too(monkeypatch):
    from concurrent.futures import ThreadPoolExecutor

    submit = ThreadPoolExecutor.submit

    def late(pool, *work):
        signal.raise_signal(signal.SIGINT)
        return submit(pool, *work)

    async def cell():
        return pidcfg.serve(SCENARIO, listen="127.0.0.1:0", seconds=20)

    monkeypatch.setattr(ThreadPoolExecutor, "submit", late)
    with warnings.catch_warnings(record=True, action="always") as told:
        with pytest.raises(KeyboardInterrupt):
            asyncio.run(cell())
        gc.collect()
    assert told == []


@pytest.mark.usefixtures("handlers")
@pytest.mark.parametrize("number", BOTH)
def test_a_trend_that_is_ended_keeps_its_rows(desk, number):
    out = io.StringIO()

    def taken(*_):
        if out.getvalue().count("\n") == 3:
            signal.raise_signal(number)

    with desk.plc(Registers(words_of(CLICK))) as url:
        result = pidcfg.trend(url, out, like=CLICK, interval=0.001, taken=taken)
    assert (result.rows, out.getvalue().count("\n")) == (2, 3)


@pytest.mark.usefixtures("handlers")
@pytest.mark.parametrize(
    ("number", "ending"), [(signal.SIGINT, KeyboardInterrupt), (signal.SIGTERM, interrupts.Terminated)]
)
def test_a_reading_that_is_ended_is_no_result(desk, number, ending):
    with desk.plc(Registers(words_of(CLICK), lambda _: os.kill(os.getpid(), number))) as url, pytest.raises(ending):
        pidcfg.pull(url, like=CLICK)


@pytest.mark.usefixtures("handlers")
def test_the_command_ends_with_the_report(monkeypatch):
    monkeypatch.setattr("pidcfg.cli.commands.serve._who", lambda _: signal.raise_signal(signal.SIGINT))
    done = run("serve", SCENARIO, "--listen", "127.0.0.1:0")
    assert done.exit_code == 0, done
    assert "in steps of 0.1 s" in done.stdout
    assert done.stdout.rstrip().splitlines()[-1].startswith("nothing was expected of this run")
