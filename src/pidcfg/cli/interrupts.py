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


class _Waiting:
    """How many parts must not be cut in two, the signal that came meanwhile, and what the command has come to."""

    begun = False
    parts = 0
    number: int | None = None
    over = False
    ended: int | None = None
    """The signal that has ended the command."""


def install() -> None:
    """Takes both signals, unless whoever started the command has them ignored, or it is no main thread that runs.

    Until the command begins, one ends the process where it stands: an exception would be shown from wherever it rises.
    """
    with suppress(ValueError):
        if signal.getsignal(signal.SIGTERM) is signal.SIG_DFL:
            signal.signal(signal.SIGTERM, _take)
        if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
            signal.signal(signal.SIGINT, _take)


def begin() -> None:
    """From here on a signal ends the command where it may be ended."""
    install()
    _Waiting.begun, _Waiting.over, _Waiting.ended = True, False, None
    if hasattr(os, "register_at_fork"):
        os.register_at_fork(after_in_child=_restore_default)


@contextmanager
def keep_signal() -> Iterator[None]:
    """A signal that has ended the work stays one, although a library may make an error of its own of that."""
    try:
        yield
    except Exception:
        if _Waiting.ended is not None:
            _end(_Waiting.ended)
        raise


def finish() -> None:
    """From here on a signal comes too late: how the command ends is known, and is about to be said."""
    _Waiting.over = True


def _restore_default() -> None:
    """What a process of a pool does: it dies of SIGTERM."""
    if signal.getsignal(signal.SIGTERM) is _take:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)


def _take(number: int, frame: object) -> None:
    """What Python calls between two steps of the program."""
    del frame
    if not _Waiting.begun:
        os._exit(128 + number)
    if _Waiting.parts:
        _Waiting.number = number
    elif not _Waiting.over:
        _end(number)


def _end(number: int) -> None:
    _Waiting.ended = number
    raise Terminated if number == signal.SIGTERM else KeyboardInterrupt


@contextmanager
def uninterrupted() -> Iterator[None]:
    """A part of the program that no signal cuts in two: one that comes meanwhile counts at its end."""
    _Waiting.parts += 1
    try:
        yield
    finally:
        _Waiting.parts -= 1
        if not _Waiting.parts and (number := _Waiting.number) is not None:
            _Waiting.number = None
            _end(number)
