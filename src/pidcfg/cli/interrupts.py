"""Ctrl-C and SIGTERM: where a command may be ended, it ends with its exit code and leaves no file behind.

The command line sets these handlers; a program that imports pidcfg keeps its own.
"""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager, suppress


class Terminated(BaseException):
    """SIGTERM: the command ends with exit code 143."""


class _SignalState:
    """How many parts must not be cut in two, the signal that came meanwhile, and what the command has come to."""

    has_begun = False
    open_parts = 0
    pending_signal: int | None = None
    is_over = False
    ending_signal: int | None = None
    """The signal that has ended the command."""


def install_handlers() -> None:
    """Takes both signals, unless whoever started the command has them ignored, or it is no main thread that runs.

    Until the command begins, one ends the process where it stands: an exception would be shown from wherever it rises.
    """
    with suppress(ValueError):
        if signal.getsignal(signal.SIGTERM) is signal.SIG_DFL:
            signal.signal(signal.SIGTERM, _take_signal)
        if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
            signal.signal(signal.SIGINT, _take_signal)


def begin_command() -> None:
    """From here on a signal ends the command where it may be ended."""
    install_handlers()
    _SignalState.has_begun, _SignalState.is_over, _SignalState.ending_signal = True, False, None
    if hasattr(os, "register_at_fork"):
        os.register_at_fork(after_in_child=_restore_default)


@contextmanager
def keep_signal() -> Iterator[None]:
    """A signal that has ended the work stays one, although a library may make an error of its own of that."""
    try:
        yield
    except Exception:
        if _SignalState.ending_signal is not None:
            _end_command(_SignalState.ending_signal)
        raise


def finish_command() -> None:
    """From here on a signal comes too late: how the command ends is known, and is about to be said."""
    _SignalState.is_over = True


def _restore_default() -> None:
    """What a process of a pool does: it dies of SIGTERM."""
    if signal.getsignal(signal.SIGTERM) is _take_signal:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)


def _take_signal(number: int, frame: object) -> None:
    """What Python calls between two steps of the program."""
    del frame
    if not _SignalState.has_begun:
        os._exit(128 + number)
    if _SignalState.open_parts:
        _SignalState.pending_signal = number
    elif not _SignalState.is_over:
        _end_command(number)


def _end_command(number: int) -> None:
    _SignalState.ending_signal = number
    raise Terminated if number == signal.SIGTERM else KeyboardInterrupt


@contextmanager
def defer_signals() -> Iterator[None]:
    """A part of the program that no signal cuts in two: one that comes meanwhile counts at its end."""
    _SignalState.open_parts += 1
    try:
        yield
    finally:
        _SignalState.open_parts -= 1
        if not _SignalState.open_parts and (number := _SignalState.pending_signal) is not None:
            _SignalState.pending_signal = None
            _end_command(number)
