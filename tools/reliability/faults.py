"""Disks that are full, folders that may not be written, links that move, and many writers: nothing but whole files.

Every fault is tried with the commands of `kills.COMMANDS`. What is left must be the old file or the new one.
"""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
import tempfile
import threading
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from reliability import kills
from reliability.kills import COMMANDS, Files, content, environment, prepared, whole

if TYPE_CHECKING:
    from collections.abc import Callable

QUOTA = (1, 100, 4096)
"""Bytes that a file may have."""
WRITERS = 12
SWAPS = 20
"""Commands that run while a link moves."""
WRITING = ("encode", "a.yaml", "-o", "out.txt", "--force")


@dataclass
class Faults:
    """How many runs each fault had, and what was not as it must be."""

    runs: dict[str, int] = field(default_factory=dict)
    failures: list[str] = field(default_factory=list)


def run_all() -> dict[str, Any]:
    """Every fault that this machine lets be made."""
    found = Faults()
    with tempfile.TemporaryDirectory() as name:
        for number, (fault, work) in enumerate(FAULTS.items()):
            before = len(found.failures)
            folder = Path(name) / str(number)
            folder.mkdir()
            found.runs[fault] = work(found, folder)
            found.failures[before:] = [f"{fault}: {text}" for text in found.failures[before:]]
    return vars(found)


def done(
    words: tuple[str, ...], folder: Path, prepare: Callable[[], object] = lambda: None, **options: Any
) -> subprocess.CompletedProcess[bytes]:
    """A command as a process of its own; ``prepare`` runs in it before the program is loaded."""
    command = [sys.executable, "-m", "pidcfg", *words]
    environs = options.pop("env", environment())
    streams = {"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | options
    return subprocess.run(command, cwd=folder, env=environs, check=False, preexec_fn=prepare, timeout=120, **streams)


def judged(
    found: Faults, label: str, outcome: subprocess.CompletedProcess[bytes], folder: Path, allowed: Files
) -> None:
    """The exit code is declared, no traceback shows, and the folder holds nothing but allowed contents."""
    shown = (outcome.stdout or b"") + (outcome.stderr or b"")
    if outcome.returncode not in {0, 1, 2} or b"Traceback" in shown:
        found.failures.append(f"{label}: exit {outcome.returncode}, {shown[-200:]!r}")
    for name, data in content(folder).items():
        if data not in {allowed.get(name), allowed.get(f"new {name}")}:
            found.failures.append(f"{label}: {name} is neither old nor new, or left")


def allowed_of(words: tuple[str, ...]) -> Files:
    """The old contents of every file, and the new ones under ``new NAME``."""
    before, after, _ = whole(words)
    return before | {f"new {name}": data for name, data in after.items()}


def full_disk(found: Faults, folder: Path) -> int:
    """A file system in memory with less room than the files take, where root may mount one."""
    size = 16 + sum(4 * (1 + len(data) // 4096) for data in content_of_prepared().values())
    if not mounted(folder, f"size={size}k"):
        return 0
    try:
        for words in COMMANDS:
            emptied(folder)
            prepared(folder)
            filled(folder / "rest")
            judged(
                found,
                " ".join(words[:2]),
                done(words, folder),
                folder,
                allowed_of(words) | {"rest": content(folder)["rest"]},
            )
    finally:
        subprocess.run(["umount", folder], check=True)
    return len(COMMANDS)


def filled(path: Path) -> None:
    """A file that takes the room that is left, but for a page: what is to be written then fits in part."""
    with path.open("wb", buffering=0) as file, suppress(OSError):
        while file.write(bytes(4096)):
            pass
    os.truncate(path, max(0, path.stat().st_size - 4096))


def content_of_prepared() -> Files:
    """The files that every command begins with."""
    return whole(WRITING)[0]


def quota(found: Faults, folder: Path) -> int:
    """No file may grow beyond some bytes; the signal of it is ignored, as where a quota answers with an error."""

    def limited(size: int) -> None:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))

    for words in COMMANDS:
        for size in QUOTA:
            prepared(folder)
            outcome = done(words, folder, lambda size=size: limited(size))
            judged(found, f"{' '.join(words[:2])} {size} B", outcome, folder, allowed_of(words))
            emptied(folder)
    return len(COMMANDS) * len(QUOTA)


def emptied(folder: Path) -> None:
    """The folder without its files."""
    subprocess.run(["rm", "-rf", *folder.iterdir()], check=True)


def no_permission(found: Faults, folder: Path) -> int:
    """A folder in which nothing may be written: root may write everywhere but to a file system that is read alone."""
    for words in COMMANDS:
        if os.geteuid() == 0 and not mounted(folder, "size=4m"):
            return 0
        prepared(folder)
        read_only(folder, on=True)
        outcome = done(words, folder)
        read_only(folder, on=False)
        judged(found, " ".join(words[:2]), outcome, folder, content_of_prepared())
        if outcome.returncode == 0:
            found.failures.append(f"{' '.join(words[:2])}: exit 0, and nothing could be written")
        emptied(folder)
        if os.geteuid() == 0:
            subprocess.run(["umount", folder], check=True)
    return len(COMMANDS)


def mounted(folder: Path, options: str) -> bool:
    """Whether a file system in memory now stands at the folder; only root may, and not in every container."""
    command = ["mount", "-t", "tmpfs", "-o", options, "tmpfs", folder]
    return os.geteuid() == 0 and subprocess.run(command, capture_output=True, check=False).returncode == 0


def read_only(folder: Path, *, on: bool) -> None:
    """Lets nobody write to the folder, or everybody again."""
    if os.geteuid():
        folder.chmod(0o555 if on else 0o755)
    else:
        subprocess.run(["mount", "-o", f"remount,{'ro' if on else 'rw'}", folder], check=True)


def moving_link(found: Faults, folder: Path) -> int:
    """The target is a link that leads now to one file, now to another, while it is written."""
    prepared(folder)
    (folder / "out.txt").unlink()
    allowed = allowed_of(WRITING)
    for name in ("one", "two"):
        (folder / name).write_text(kills.OLD, "utf-8")
    ended = threading.Event()

    def move() -> None:
        number = 0
        while not ended.is_set():
            number += 1
            with suppress(OSError):
                (folder / "link").symlink_to(folder / ("one", "two")[number % 2])
                (folder / "link").replace(folder / "out.txt")

    mover = threading.Thread(target=move)
    mover.start()
    for number in range(SWAPS):
        outcome = done(WRITING, folder)
        if outcome.returncode not in {0, 1, 2} or b"Traceback" in outcome.stderr:
            found.failures.append(f"{number}: exit {outcome.returncode}, {outcome.stderr[-200:]!r}")
    ended.set()
    mover.join()
    whole_files = {allowed["out.txt"], allowed["new out.txt"]}
    for name, data in content(folder).items():
        if name not in {"link"} | set(content_of_prepared()) and data not in whole_files:
            found.failures.append(f"{name} is neither old nor new, or left")
    return SWAPS


def twelve_writers(found: Faults, folder: Path) -> int:
    """Twelve commands at one file at the same time; two contents, and one of them in the end."""
    prepared(folder)
    targets = [("encode", "a.yaml", "-o", "out.txt", "--force"), ("export", "a.yaml", "-o", "out.txt", "--force")]
    wholes = {allowed_of(words)["new out.txt"] for words in (WRITING, ("export", "a.yaml", "-o", "out.txt", "--force"))}
    children = [kills.started(targets[number % 2], folder) for number in range(WRITERS)]
    codes = [os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) for child in children]
    if set(codes) - {0, 1, 2}:
        found.failures.append(f"exit codes {codes}")
    if (folder / "out.txt").read_bytes() not in wholes:
        found.failures.append("out.txt is none of what the writers wrote")
    left = set(content(folder)) - set(content_of_prepared())
    if left:
        found.failures.append(f"{sorted(left)} are left")
    return WRITERS


def closed_streams(found: Faults, folder: Path) -> int:
    """Standard input, output and error closed, one and all; a reader that is gone."""
    sets = [(0,), (1,), (2,), (1, 2), (0, 1, 2)]
    for words in COMMANDS:
        for numbers in sets[len(words) % len(sets) :][:2]:
            prepared(folder)
            outcome = done(words, folder, lambda numbers=numbers: [os.close(number) for number in numbers])
            judged(found, f"{' '.join(words[:2])} without {numbers}", outcome, folder, allowed_of(words))
            emptied(folder)
    return 2 * len(COMMANDS)


def broken_pipe(found: Faults, folder: Path) -> int:
    """Whoever reads the output ends after a byte, as ``| head -c 1`` does."""
    prepared(folder)
    commands = (("encode", "a.yaml"), ("validate", "a.yaml", "--format", "json"), ("export", "a.yaml"), ("--help",),
                ("schema", "dl06"), ("simulate", "a.scenario.yaml", "--engine", "python"))  # fmt: skip
    for words in commands:
        command = [sys.executable, "-m", "pidcfg", *words]
        process = subprocess.Popen(
            command, cwd=folder, env=environment(), stdout=subprocess.PIPE, stderr=subprocess.PIPE
        )
        process.stdout.close()
        text = process.stderr.read()
        if process.wait(120) not in {0, 1, 2, 141, -signal.SIGPIPE} or b"Traceback" in text:
            found.failures.append(f"{' '.join(words)}: exit {process.returncode}, {text[-200:]!r}")
    return len(commands)


def no_home(found: Faults, folder: Path) -> int:
    """No HOME, and none of the folders that stand for it."""
    bare = {"PATH": os.environ["PATH"], "PYTHONPATH": environment()["PYTHONPATH"]}
    for words in COMMANDS:
        prepared(folder)
        outcome = done(words, folder, env={**bare, **({} if len(words) % 2 else {"HOME": "/nowhere"})})
        judged(found, " ".join(words[:2]), outcome, folder, allowed_of(words))
        if outcome.returncode and words[0] not in {"validate", "diff", "simulate"}:
            found.failures.append(f"{' '.join(words[:2])}: exit {outcome.returncode}")
        emptied(folder)
    return len(COMMANDS)


BACK = "import time, itertools; n = itertools.count(); time.time = lambda: 1e9 - next(n)\n"


def clock_back(found: Faults, folder: Path) -> int:
    """A clock that goes back a second each time it is read."""
    for words in COMMANDS:
        prepared(folder)
        code = f"{BACK}import sys; sys.argv[1:] = {list(words)!r}\nfrom pidcfg.__main__ import main; main()"
        outcome = subprocess.run(
            [sys.executable, "-c", code], cwd=folder, env=environment(), capture_output=True, check=False, timeout=120
        )
        judged(found, " ".join(words[:2]), outcome, folder, allowed_of(words))
        emptied(folder)
    return len(COMMANDS)


FAULTS: dict[str, Callable[[Faults, Path], int]] = {
    "full disk": full_disk,
    "quota": quota,
    "no permission": no_permission,
    "moving link": moving_link,
    "twelve writers": twelve_writers,
    "closed streams": closed_streams,
    "broken pipe": broken_pipe,
    "no HOME": no_home,
    "clock goes back": clock_back,
}
