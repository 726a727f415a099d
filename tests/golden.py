"""The committed images, trends and reports of the examples; ``python tests/golden.py`` writes them anew.

Read the difference before committing it: a golden file says what the words and the trend were when somebody looked.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

FOLDER = Path(__file__).parents[1] / "examples" / "dl06"
GOLDEN = FOLDER / "golden"
IMAGES = {
    "reactor": {"text": "txt", "csv": "csv", "json": "json", "ihex": "hex", "modbus": "modbus.csv"},
    "oven": {"text": "txt", "ihex": "hex"},
    "flow": {"text": "txt", "ihex": "hex"},
    "extruder": {"text": "txt", "ihex": "hex"},
}
TREND_EVERY = {"reactor": 50, "oven": 60, "flow": 10, "extruder": 100}
"""Base steps between two rows of a trend: each file has a few hundred."""


def pidcfg(*args: str) -> str:
    """What a command prints, run in the folder of the examples."""
    command = [sys.executable, "-m", "pidcfg", *args]
    result = subprocess.run(command, cwd=FOLDER, capture_output=True, check=False, env={**os.environ, "NO_COLOR": "1"})
    if result.returncode:
        sys.exit(f"{' '.join(args)}: {result.stderr.decode()}{result.stdout.decode()}")
    return result.stdout.decode("utf-8")


def images(name: str) -> dict[str, str]:
    """The listings of one example by file name."""
    return {f"{name}.{end}": pidcfg("encode", f"{name}.yaml", "--format", kind) for kind, end in IMAGES[name].items()}


def run(name: str) -> dict[str, str]:
    """The trend and the JSON report of one example's scenario by file name."""
    with tempfile.TemporaryDirectory() as folder:
        trend = Path(folder) / "trend.csv"
        every = str(TREND_EVERY[name])
        report = pidcfg("simulate", f"{name}.scenario.yaml", "--csv", str(trend), "--every", every,
                        "--engine", "python", "--format", "json")  # fmt: skip
        json.loads(report)
        return {f"{name}.trend.csv": trend.read_text("utf-8"), f"{name}.report.json": report}


def main() -> None:
    """Writes every golden file."""
    GOLDEN.mkdir(exist_ok=True)
    for name in IMAGES:
        for file, text in (images(name) | run(name)).items():
            (GOLDEN / file).write_text(text, "utf-8", newline="\n")


if __name__ == "__main__":
    main()
