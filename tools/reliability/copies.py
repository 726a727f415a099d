"""Work in a copy of this process, which is ended where it takes too long: compiled code hears no signal."""

from __future__ import annotations

import json
import os
import resource
import select
import signal
import time
import traceback
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

BROKEN = 70
"""The exit code of work that ended with an exception."""
WAITING = 6
"""Times the allowed seconds of CPU that a copy may last by the clock: others want the processors too."""


def cpu() -> float:
    """Seconds of CPU of this process and of its ended children."""
    return sum(sum(resource.getrusage(who)[:2]) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))


def keep(path: Path, text: str) -> None:
    """Writes a file as a whole: runs beside each other read and write the same ones."""
    path.parent.mkdir(exist_ok=True)
    part = path.with_name(f"{path.name}.{os.getpid()}")
    part.write_text(text, "utf-8")
    part.replace(path)


def in_a_copy(work: Callable[[], object], seconds: int, *, silent: bool = False) -> tuple[int, Any]:
    """How the copy ended, negative by a signal, and what work gave, as JSON; ``seconds`` are of CPU.

    `BROKEN` and None: with an exception.
    """
    reading, writing = os.pipe()
    child = os.fork()
    if not child:
        os.setsid()
        used = resource.getrusage(resource.RUSAGE_SELF)
        most = int(used.ru_utime + used.ru_stime) + seconds
        resource.setrlimit(resource.RLIMIT_CPU, (most, most))
        if silent:
            null = os.open(os.devnull, os.O_RDWR)
            for number in (0, 1, 2):
                os.dup2(null, number)
        code = BROKEN
        try:
            with os.fdopen(writing, "w", encoding="utf-8") as stream:
                json.dump(work(), stream)
            code = 0
        finally:  # a copy must not go on with what its original does
            if code and not silent:
                traceback.print_exc()
            os._exit(code)
    os.close(writing)
    text, end = b"", time.monotonic() + WAITING * seconds
    while select.select([reading], [], [], max(0.0, end - time.monotonic()))[0]:
        part = os.read(reading, 1 << 20)
        if not part:
            break
        text += part
    else:
        os.killpg(child, signal.SIGKILL)
    os.close(reading)
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    return status, json.loads(text) if text and status >= 0 else None
