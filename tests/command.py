"""The command as a process of its own: streams, exit code and working folder as a shell would give them.

Where the system can fork, the process is a copy of this one: what is imported already is not imported again, which is
most of what a short command takes. The copy ends without a word to pytest.
"""

from __future__ import annotations

import gc
import io
import os
import subprocess
import sys
import tempfile
import traceback
from contextlib import ExitStack
from typing import TYPE_CHECKING, BinaryIO, NoReturn

from pidcfg.__main__ import main

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

CRASHED = 70
"""The exit code of what `main` itself lets through, which no command ends with."""


def run(*args: str, cwd: Path | None = None, stdin: bytes = b"", **env: str) -> subprocess.CompletedProcess[bytes]:
    """``pidcfg`` with some arguments; ``env``: variables beside those of this process."""
    command = [sys.executable, "-m", "pidcfg", *args]
    if not hasattr(os, "fork"):
        environment = {**os.environ, **env}
        return subprocess.run(command, cwd=cwd, input=stdin, capture_output=True, check=False, env=environment)
    with ExitStack() as stack:
        files = [stack.enter_context(tempfile.TemporaryFile()) for _ in range(3)]
        files[0].write(stdin)
        files[0].seek(0)
        child = os.fork()
        if not child:
            _be_the_command(args, cwd, env, files)
        _, status = os.waitpid(child, 0)
        texts = [_content(file) for file in files[1:]]
    return subprocess.CompletedProcess(command, os.waitstatus_to_exitcode(status), *texts)


def run_text(*args: str, cwd: Path | None = None, **env: str) -> subprocess.CompletedProcess[str]:
    """The same, with what it prints as text."""
    done = run(*args, cwd=cwd, **env)
    return subprocess.CompletedProcess(done.args, done.returncode, *(t.decode() for t in (done.stdout, done.stderr)))


def _content(file: BinaryIO) -> bytes:
    file.seek(0)
    return file.read()


def _be_the_command(args: Sequence[str], cwd: Path | None, env: dict[str, str], files: Sequence[BinaryIO]) -> NoReturn:
    code: object = CRASHED
    gc.freeze()  # what pytest holds is not searched for cycles, and so stays shared
    try:
        if cwd is not None:
            os.chdir(cwd)
        os.environ.update(env)
        for number, file in enumerate(files):
            os.dup2(file.fileno(), number)
        encoding, _, errors = os.environ.get("PYTHONIOENCODING", "utf-8").partition(":")
        sys.stdin = sys.__stdin__ = io.TextIOWrapper(
            io.BufferedReader(io.FileIO(0, "r", closefd=False)), encoding, errors or "strict"
        )
        sys.stdout = sys.__stdout__ = _writer(1, encoding, errors or "strict")
        sys.stderr = sys.__stderr__ = _writer(2, encoding, "backslashreplace")
        sys.argv = ["pidcfg", *args]
        main()
    except SystemExit as end:
        code = end.code
    except BaseException:  # noqa: BLE001 - a copy of pytest must not go on
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code if isinstance(code, int) else int(code is not None))


def _writer(number: int, encoding: str, errors: str) -> io.TextIOWrapper:
    return io.TextIOWrapper(io.BufferedWriter(io.FileIO(number, "w", closefd=False)), encoding, errors)
