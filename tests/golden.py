"""The committed images, trends and reports of the examples, and reports in every format; `generated` renews them."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from contextlib import chdir
from pathlib import Path
from typing import TYPE_CHECKING

from pidcfg.cli.formats import FORMATS, formats_of, load_format

if TYPE_CHECKING:
    from collections.abc import Callable

EXAMPLES = Path(__file__).parents[1] / "examples"
LISTINGS = {"text": "txt", "csv": "csv", "json": "json", "modbus": "modbus.csv"}
NAMED = {"text": "txt", "csv": "csv", "json": "json"}
IMAGES = {
    "dl06/reactor": {**LISTINGS, "ihex": "hex"},
    "dl06/oven": {"text": "txt", "ihex": "hex"},
    "dl06/flow": {"text": "txt", "ihex": "hex"},
    "dl06/extruder": {"text": "txt", "ihex": "hex"},
    "dl06/feedpump": {"text": "txt"},
    "dl06/kettle": {"text": "txt"},
    "click/tank": {**LISTINGS, "nickname-csv": "nicknames.csv", "cdv": "cdv"},
    "click/brewery": {"text": "txt", "cdv": "cdv"},
    "click/booster": {"text": "txt"},
    "ezlogix/oven": {"text": "txt", "csv": "csv", "json": "json", "tags": "tags.csv"},
    "ezlogix/coldstore": {"text": "txt", "tags": "tags.csv"},
    "ezlogix/dosing": {"text": "txt"},
    "ezlogix/greenhouse": {"text": "txt"},
    "nextopid/heatexchanger": {"text": "txt", "csv": "csv", "json": "json", "st": "st", "plcopen": "xml"},
    "nextopid/cascade": {"text": "txt", "st": "st", "plcopen": "xml"},
    "nextopid/override": {"text": "txt", "st": "st"},
    "nextopid/pump": {"st": "st"},
    "nextopid/diagnostics": {"st": "st"},
    "nextopid/ratio": {"st": "st"},
    "nextopid/splitrange": {"st": "st"},
    "nextopid/autotune": {"st": "st"},
    "nextopid/furnace": {"text": "txt", "st": "st"},
    "dpide/oven": {**NAMED, "st": "st", "operands": "operands.csv", "symbols": "symbols.csv"},
    "dpide/chiller": {"text": "txt", "symbols": "symbols.csv"},
    "dpide/dryer": {"text": "txt", "st": "st", "operands": "operands.csv"},
    "dpide/dyeing": {"text": "txt"},
    "generic/boiler": {"text": "txt", "csv": "csv", "json": "json"},
}
"""Each example by its path below ``examples``, and the ends of the files for each format."""
TREND_EVERY = {
    "dl06/reactor": 50,
    "dl06/oven": 60,
    "dl06/flow": 10,
    "dl06/extruder": 100,
    "dl06/feedpump": 20,
    "dl06/kettle": 30,
    "click/tank": 100,
    "click/brewery": 30,
    "click/booster": 60,
    "ezlogix/oven": 150,
    "ezlogix/coldstore": 120,
    "ezlogix/dosing": 20,
    "ezlogix/greenhouse": 20,
    "nextopid/heatexchanger": 20,
    "nextopid/cascade": 50,
    "nextopid/override": 50,
    "nextopid/pump": 50,
    "nextopid/diagnostics": 50,
    "nextopid/ratio": 5,
    "nextopid/splitrange": 50,
    "nextopid/autotune": 5,
    "nextopid/furnace": 60,
    "dpide/oven": 20,
    "dpide/chiller": 10,
    "dpide/dryer": 15,
    "dpide/dyeing": 30,
    "generic/boiler": 30,
}
"""Base steps between two rows of a trend: each file has a few hundred."""


def golden(example: str, file: str) -> Path:
    """Where a committed file of an example is."""
    return EXAMPLES / example.partition("/")[0] / "golden" / file


def pidcfg(example: str, *args: str) -> str:
    """What a command prints, run in the folder of the example; in this process, as there are hundreds of them."""
    from click.testing import CliRunner

    from pidcfg.cli.main import cli

    with chdir((EXAMPLES / example).parent):
        result = CliRunner(env={"NO_COLOR": "1"}).invoke(cli, args, standalone_mode=False)
    if result.exception or result.return_value:
        sys.exit(f"{example}: {' '.join(args)}: {result.exception or ''}{result.stderr}{result.stdout}")
    return result.stdout


def images(example: str) -> dict[str, bytes]:
    """The listings of one example by file name; a format may write several files."""
    name, _found = Path(example).name, {}
    with tempfile.TemporaryDirectory() as folder:
        for kind, end in IMAGES[example].items():
            pidcfg(example, "encode", f"{name}.yaml", "--format", kind, "-o", str(Path(folder) / f"{name}.{end}"))
        return {path.name: path.read_bytes() for path in sorted(Path(folder).iterdir())}


def run(example: str) -> dict[str, bytes]:
    """The trend and the JSON report of one example's scenario by file name."""
    name, every = Path(example).name, str(TREND_EVERY[example])
    with tempfile.TemporaryDirectory() as folder:
        trend = Path(folder) / "trend.csv"
        report = pidcfg(
            example,
            "simulate",
            f"{name}.scenario.yaml",
            "--csv",
            str(trend),
            "--every",
            every,
            "--engine",
            "python",
            "--format",
            "json",
        )
        json.loads(report)
        return {f"{name}.trend.csv": trend.read_bytes(), f"{name}.report.json": report.encode()}


REPORTS = Path(__file__).parent / "data" / "formats"
"""What the reports of a file with mistakes and of a run that fails look like in each format."""
REPORTED = "dl06"
"""The vendor of those files."""


def report_name(command: str, fmt: str) -> str:
    """The name of a committed report of `validate` or `simulate`; of formats with one ending the first has it alone."""
    stem, ending = "oven" if command == "validate" else "fails", load_format(fmt).ending
    first = next(name for name in FORMATS if load_format(name).ending == ending)
    return f"{stem}.{ending}" if fmt == first else f"{stem}.{fmt}.{ending}"


def reports() -> dict[str, bytes]:
    """The committed reports by file name; the commands run in the folder of what they are about."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        copies = (EXAMPLES / "mistakes" / "oven.yaml", REPORTS / "fails.scenario.yaml", REPORTS / "flow.yaml")
        for path in copies:
            (folder / path.name).write_bytes(path.read_bytes())
        for command, file in (("validate", "oven.yaml"), ("simulate", "fails.scenario.yaml")):
            options = [f"--output={fmt}={report_name(command, fmt)}" for fmt in formats_of(command)]
            arguments = [sys.executable, "-m", "pidcfg", command, file, *options]
            result = subprocess.run(arguments, cwd=folder, capture_output=True, check=False)
            if result.returncode != 1:
                sys.exit(f"{file}: {result.stderr.decode()}")
        return {path.name: path.read_bytes() for path in sorted(folder.iterdir()) if path.suffix != ".yaml"}


def report_files(wanted: Callable[[str], bool] = bool) -> dict[Path, bytes]:
    """The committed reports by their paths, where the vendor of the files that they are about is wanted."""
    return {REPORTS / file: data for file, data in reports().items()} if wanted(REPORTED) else {}


def example_files(wanted: Callable[[str], bool] = bool) -> dict[Path, bytes]:
    """The committed images, trends and reports of the examples that are wanted by their paths."""
    examples = filter(wanted, IMAGES)
    return {
        golden(example, file): data for example in examples for file, data in (images(example) | run(example)).items()
    }
