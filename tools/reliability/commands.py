"""A command line on a changed example: whatever is in its files, it ends with a declared exit code."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from command import run as pidcfg
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    import random

CONFIG, SCENARIO = "m.yaml", "s.scenario.yaml"
FINDINGS = ("text", "concise", "json", "sarif", "github", "gitlab", "junit", "markdown")
VERDICTS = ("text", "json", "sarif", "github", "gitlab", "junit")
SMALL = "--limit loop_steps=40000"
LINES = (
    *(f"validate m.yaml s.scenario.yaml --no-cache --format {name}" for name in FINDINGS),
    "validate m.yaml --no-cache --statistics --strict",
    "validate m.yaml --no-cache --fix --diff",
    "validate m.yaml --no-cache --fix",
    "encode m.yaml --format {format} -o words.out",
    "encode m.yaml --format {format} --allow-errors -o words.out",
    *(f"convert m.yaml --to {{target}} --allow-loss --report {name} -o c.yaml" for name in ("text", "json")),
    "convert m.yaml --to {target} --report-output markdown=r.md -o c.yaml",
    *(f"export m.yaml --format {name} -o e.{name}" for name in ("yaml", "csv", "xlsx")),
    "export m.yaml --format csv --decimal-comma",
    "init --scenario m.yaml",
    f"report s.scenario.yaml {SMALL} -o r.html --full --tables t --xlsx r.xlsx",
    "report m.yaml -o r.html --sheet",
    *(f"simulate s.scenario.yaml {SMALL} --format {name}" for name in VERDICTS),
    f"simulate s.scenario.yaml {SMALL} --csv t.csv --every 7",
    f"simulate s.scenario.yaml {SMALL} --plot p.svg --plot p.html --plot -",
    f"simulate m.yaml {SMALL} --strict",
    f"certify s.scenario.yaml {SMALL} --samples 4 --jobs 1",
    "diff m.yaml n.yaml --format text",
    "diff m.yaml n.yaml --format json",
    "diff m.yaml n.yaml --format markdown",
    "tune --method simc --gain 2 --time-constant 60 --dead-time 5 --for {vendor} --write m.yaml --diff",
    "tune --method simc --gain 2 --time-constant 60 --dead-time 5 --for {vendor} --write m.yaml",
)  # fmt: skip
ENDINGS = frozenset({0, 1, 2})
"""Exit codes that are declared for what a user gives; 3 is a bug."""
SHOWN = 400


def run(text: str, scenario: str, vendor: str, rng: random.Random, *, ok: bool) -> None:
    """One line of `LINES` in a folder of its own; raises AssertionError where it ends as it must not."""
    target = rng.choice([key for key in VENDORS if key != vendor])
    kind = rng.choice([name for name, kind in VENDORS[vendor].load("formats").items() if not kind.needs_into])
    line = rng.choice(LINES).format(vendor=vendor, target=target, format=kind)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        files = {CONFIG: text, SCENARIO: scenario, "n.yaml": text}
        for file, content in files.items():
            (folder / file).write_text(content, "utf-8")
        done = pidcfg(*line.split(), cwd=folder)
        kept = {file for file, content in files.items() if (folder / file).read_text("utf-8") == content}
        left = [path.name for path in folder.iterdir() if path.name.startswith(".")]
    told = done.stderr.decode("utf-8", "replace")[-SHOWN:]
    assert done.returncode in ENDINGS, f"{line} ends with {done.returncode}: {told}"
    assert "Traceback" not in told, f"{line}: {told}"
    asks = ("has several loops", "or give --pv-range")
    assert "Usage: " not in told or any(text in told for text in asks), f"{line}: {told}"
    assert done.returncode != 2 or (done.stdout + done.stderr).strip(), f"{line} ends with 2 and says nothing"
    changes = ("--fix", "--write") if "--diff" not in line else ()
    assert len(kept) == len(files) or any(word in line for word in changes), f"{line} changes {set(files) - kept}"
    assert not left, f"{line} leaves {left}"
    if line.startswith("encode") and "--allow" not in line and not ok:
        assert done.returncode == 1, f"{line} ends with {done.returncode} although the file has errors"
    if line.startswith(("diff", "init")) and ok:
        assert done.returncode in {0, 2}, f"{line} ends with {done.returncode} although the file has none"
