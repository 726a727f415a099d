"""The same hostile YAML files given to other checkers of files: yamllint, check-jsonschema and zizmor.

They are tools of development, found on the PATH or in the folder that PIDCFG_OTHERS names; one that is missing is
told, and has no row.
"""

from __future__ import annotations

import os
import random
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from reliability import hostile, kills

FILES = 340
SECONDS = 20
"""By the clock for one file; what takes longer counts as a time-out."""
CRASHES = (b"Traceback (most recent call last)", b"panicked at", b"internal error")
SCHEMA = "schema.json"
TOOLS: dict[str, tuple[str, ...]] = {
    "pidcfg validate": (sys.executable, "-m", "pidcfg", "validate"),
    "yamllint": ("yamllint", "-f", "parsable"),
    "check-jsonschema": ("check-jsonschema", "--schemafile", SCHEMA),
    "zizmor": ("zizmor", "--offline", "--no-progress", "--collect=workflows"),
}


def files(seed: int, count: int) -> list[hostile.Case]:
    """Hostile YAML files, drawn from all."""
    rounds = 1 + count // 150
    cases = [case for case in hostile.cases(seed, rounds) if case.name.endswith(".yaml")]
    return random.Random(seed).sample(cases, min(count, len(cases)))


def found_tool(command: tuple[str, ...]) -> tuple[str, ...] | None:
    """The command with the place of its program; None where there is none."""
    folders = os.pathsep.join(
        (os.environ.get("PIDCFG_OTHERS", ""), str(Path(sys.executable).parent), os.environ["PATH"])
    )
    program = shutil.which(command[0], path=folders)
    return None if program is None else (program, *command[1:])


def outcome(command: tuple[str, ...], file: str, folder: Path) -> str:
    """How a tool ends with a file: ``answer``, ``crash``, ``time-out``."""
    try:
        done = subprocess.run(
            [*command, file], cwd=folder, env=kills.environment(), capture_output=True, check=False, timeout=SECONDS
        )
    except subprocess.TimeoutExpired:
        return "time-out"
    shown = done.stdout + done.stderr
    crashed = done.returncode < 0 or (done.returncode == 3 and command[0] == sys.executable)
    return "crash" if crashed or any(sign in shown for sign in CRASHES) else "answer"


def run_all(seed: int, count: int = FILES) -> dict[str, Any]:
    """Every tool with every file."""
    tools = {name: found_tool(command) for name, command in TOOLS.items()}
    rows: dict[str, dict[str, int]] = {}
    cases = files(seed, count)
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        hostile.command(["schema", "dl06", "-o", str(place / SCHEMA)])
        (place / ".github" / "workflows").mkdir(parents=True)
        for name, command in tools.items():
            if command is None:
                continue
            row = rows[name] = {"answer": 0, "crash": 0, "time-out": 0}
            file = ".github/workflows/a.yaml" if name == "zizmor" else "a.yaml"
            for case in cases:
                (place / file).write_bytes(case.data)
                row[outcome(command, file, place)] += 1
                (place / file).unlink()
    own = rows["pidcfg validate"]
    failures = [f"pidcfg validate: {own[end]} x {end}" for end in ("crash", "time-out") if own[end]]
    missing = [name for name, command in tools.items() if command is None]
    return {"files": len(cases), "tools": rows, "missing": missing, "failures": failures}
