"""What each format says of a run: where two of them disagree about a loop, or about the run.

Run it with ``python tests/verdict_formats.py``: the scenarios of the examples, each as it is and shortened to a third,
in every format of `simulate`, and in the tables and the page of `report`.
"""

from __future__ import annotations

import csv
import html
import json
import re
import shutil
import sys
import tempfile
from pathlib import Path

import pytest
from click.testing import CliRunner

from pidcfg.cli.formats.runs import VERDICT_WORDS, render_runs
from pidcfg.cli.main import cli
from pidcfg.sim.engine.run import Settings
from pidcfg.sim.judgement.report import STANDING_KINDS
from pidcfg.study.outcome import simulate_document as simulate
from pidcfg.text.source import read_document

ROOT = Path(__file__).parents[1]
UNITS = {"": 1, "s": 1, "min": 60, "h": 3600}
FAILING = {"failed": "failed", "not-proven": "not-proven"}


def worst(words) -> str:
    """The verdict of a loop of which several things are said."""
    return next((word for word in FAILING if word in words), "fine")


def of_json(text):
    """The loops, and whether the run has passed."""
    data = json.loads(text)
    return {name: worst({loop["verdict"]}) for name, loop in data["loops"].items()}, data["passed"]


def of_text(text, loops):
    """The same, from the line of each loop and the last one."""
    said = {}
    for name in loops:
        row = re.search(rf"^  {re.escape(name)} +({'|'.join(VERDICT_WORDS.values())})(?:  |$)", text, re.MULTILINE)
        said[name] = worst({word for word, shown in VERDICT_WORDS.items() if row is not None and shown == row[1]})
    return said, text.rstrip().splitlines()[-1].startswith("passed:")


def of_rows(rows, loops):
    """The same, from texts that say ``not proven, kind: loop: …`` or ``kind: loop: …`` of what fails."""
    said = {name: set() for name in loops}
    for row in rows:
        found = re.search(
            rf"(not proven, )?\b({'|'.join(STANDING_KINDS)}): (?:({'|'.join(map(re.escape, loops))}): )?", row
        )
        if found and found[3]:
            said[found[3]].add("not-proven" if found[1] else "failed")
    return {name: worst(words) for name, words in said.items()}, not rows


def of_junit(text, loops):
    """The same, from the kinds of failures."""
    said, failures = {name: set() for name in loops}, 0
    for suite in pytest.importorskip("junitparser").JUnitXml.fromstring(text.encode()):
        for case in suite:
            name = case.name.rpartition(" ")[0]
            for failure in case.result:
                if failure._tag == "failure":
                    failures += 1
                    if name in said and failure.type in FAILING:
                        said[name].add(failure.type)
    return {name: worst(words) for name, words in said.items()}, not failures


def of_tables(folder, page, loops):
    """The same, from the tables of a report, and from the words on its page."""
    said, shown = {name: set() for name in loops}, {value.upper(): key for key, value in FAILING.items()}
    shown |= {"NOT PROVEN": "not-proven", "FAILED": "failed"}
    with (folder / "standing.csv").open(encoding="utf-8-sig") as lines:
        verdicts = [(row["Loop"], shown.get(row["Verdict"].upper())) for row in csv.DictReader(lines)]
    with (folder / "expectations.csv").open(encoding="utf-8-sig") as lines:
        passed = all(row["Verdict"] == "passed" for row in csv.DictReader(lines))
    for loop, verdict in verdicts:
        if loop in said and verdict:
            said[loop].add(verdict)
    words = html.unescape(page)
    for word in ("NOT PROVEN", "FAILED"):
        wanted = any(shown[word] == verdict for _, verdict in verdicts) or (word == "FAILED" and not passed)
        assert (word in words.upper()) >= wanted, f"the page does not say {word}"
    return {name: worst(words) for name, words in said.items()}, passed and not any(v for _, v in verdicts)


def disagreements(folder, scenario, *, report=True):
    """Where formats say something else than the JSON does, each as a line."""
    path = folder / scenario
    outcome = simulate(read_document(path.read_bytes(), path.as_posix()), Settings())
    if outcome.report is None:
        return None
    truth, passed = of_json(render_runs("json", [outcome]))
    loops = list(truth)
    sarif = json.loads(render_runs("sarif", [outcome]))["runs"][0]["results"]
    github = [row for row in render_runs("github", [outcome]).splitlines() if row.startswith("::error")]
    gitlab = [row for row in json.loads(render_runs("gitlab", [outcome])) if row["severity"] not in {"info", "minor"}]
    found = {
        "text": of_text(render_runs("text", [outcome]), loops),
        "junit": of_junit(render_runs("junit", [outcome]), loops),
        "sarif": of_rows([row["message"]["text"] for row in sarif if row["level"] == "error"], loops),
        "github": of_rows(github, loops),
        "gitlab": of_rows([row["description"] for row in gitlab], loops),
    }
    if report:
        arguments = [
            "report",
            str(path),
            "-o",
            str(folder / "page.html"),
            "--tables",
            str(folder / "tables"),
            "--force",
        ]
        done = CliRunner().invoke(cli, arguments)
        assert done.exit_code in {0, 1}, done.output
        found["report"] = of_tables(folder / "tables", (folder / "page.html").read_text("utf-8"), loops)
    return [
        f"{scenario}: {name} says {said}, and json {(truth, passed)}"
        for name, said in found.items()
        if said != (truth, passed)
    ]


def shortened(path, share):
    """A scenario in its place, of a part of its duration."""
    text = path.read_text("utf-8")
    given = re.search(r"^duration: *([\d.]+) *(s|min|h|)", text, re.MULTILINE)
    path.write_text(text.replace(given[0], f"duration: {UNITS[given[2]] * float(given[1]) / share:g} s", 1), "utf-8")
    return path


def main() -> int:
    """Prints what disagrees, and how many scenarios were looked at."""
    looked, lines = 0, []
    for path in sorted((ROOT / "examples").glob("*/*.scenario.yaml")):
        for share in (1, 3):
            with tempfile.TemporaryDirectory() as name:
                folder = Path(name) / "runs"
                shutil.copytree(path.parent, folder)
                shortened(folder / path.name, share)
                found = disagreements(folder, path.name)
                if found is not None:
                    looked += 1
                    lines += found
    print(*lines, f"{len(lines)} disagreements in {looked} scenarios", sep="\n")  # noqa: T201
    return bool(lines)


if __name__ == "__main__":
    sys.exit(main())
