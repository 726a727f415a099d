"""Writing commands that are ended at random moments: an old file or a new one stays, and nothing else."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).parents[2]
REACTOR = ROOT / "examples/dl06/reactor.yaml"
COMMANDS = (
    ("encode", "a.yaml", "-o", "out.txt", "--force"),
    ("convert", "a.yaml", "--to", "generic", "--allow-loss", "-o", "out.txt", "--force"),
    ("report", "a.yaml", "-o", "out.txt", "--csv", "tables", "--force"),
    ("validate", "a.yaml", "--report-output", "json=out.txt"),
    ("decode", "a.lst", "--vendor", "dl06", "-o", "out.txt", "--force"),
    ("init", "--scenario", "a.yaml", "-o", "out.txt", "--force"),
    ("simulate", "a.yaml", "--trend", "out.txt", "--force"),
)
SIGNALS = {signal.SIGTERM: 143, signal.SIGINT: 130, signal.SIGKILL: -9}
OLD = "old\n"


@dataclass
class Kills:
    """How many commands were ended by what, and what was left that must not be."""

    ended: dict[str, int] = field(default_factory=dict)
    finished: int = 0
    failures: list[str] = field(default_factory=list)


def environment() -> dict[str, str]:
    """The product of this folder, without a cache."""
    return {**os.environ, "PYTHONPATH": str(ROOT / "src"), "PIDCFG_CACHE_DIR": __file__}


def prepared(folder: Path) -> None:
    """A configuration, a listing of it, and the file that is there before."""
    (folder / "a.yaml").write_bytes(REACTOR.read_bytes())
    golden = next((ROOT / "examples/dl06/golden").glob("reactor*.txt"), None)
    if golden is not None:
        (folder / "a.lst").write_bytes(golden.read_bytes())


def run(kills: Kills, seed: int, number: int) -> None:
    """One command that is ended after a random time, and what its folder then holds."""
    rng = random.Random(f"{seed} {number}")
    words, (ending, code) = rng.choice(COMMANDS), rng.choice(list(SIGNALS.items()))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        prepared(folder)
        (folder / "out.txt").write_text(OLD, "utf-8")
        before = {path.name for path in folder.iterdir()}
        process = subprocess.Popen(
            [sys.executable, "-m", "pidcfg", *words], cwd=folder, env=environment(),
            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
        )  # fmt: skip
        time.sleep(rng.uniform(0.05, 1.5))
        process.send_signal(ending)
        _, err = process.communicate(timeout=60)
        label = f"{seed} {number} {words[0]} {ending.name}: exit {process.returncode}"
        if process.returncode in {0, 1}:
            kills.finished += 1
        elif process.returncode in {code, -ending}:
            kills.ended[ending.name] = kills.ended.get(ending.name, 0) + 1
        else:
            kills.failures.append(f"{label}: {err.decode()[-200:]}")
        left = {path.name for path in folder.iterdir()} - before - {"tables"}
        if left and ending is not signal.SIGKILL:
            kills.failures.append(f"{label}: {sorted(left)} are left")
        content = (folder / "out.txt").read_text("utf-8")
        whole = content == OLD or content.endswith("\n") or content.rstrip().endswith(">")
        if not content or not whole:
            kills.failures.append(f"{label}: the file is neither old nor whole: {content[-60:]!r}")
