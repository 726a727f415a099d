"""``python tasks.py torture [--minutes N]``: hostile files, mutants and kills until the time is over, and the page.

The figures of the last run stand in ``docs/reliability.md``, which this program writes.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import select
import signal
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from reliability import fuzz, hostile, kills

PAGE = Path(__file__).parents[2] / "docs" / "reliability.md"
MOST = 60
"""Seconds of a mutant."""
TEXT = """\
# Reliability

What was thrown at pidcfg, and what came of it: the figures of the last run of `python tasks.py torture`, which writes
this page.

| | |
|---|---|
| seed | {seed} |
| time | {minutes:.0f} min of one processor |
| hostile files | {files} of {kinds} kinds of input, each spoiled in up to {spoils} ways |
| commands run on them, as UTF-8, ASCII, cp1252 and in the locale C | {executions} |
| tracebacks, exit code 3, hangs (over {seconds} s of CPU) | {tracebacks}, {bugs}, {hangs} |
| slowest of these commands; most memory of the process that ran all of them | {slowest:.1f} s; {memory:.0f} MB |
| changed examples | {mutants}, of which {valid} are valid |
| encoded and decoded; converted; simulated twice; corrected | {codecs}; {conversions}; {simulations}; {fixes} |
| not true of them | {untrue} |
| commands ended by SIGTERM, SIGINT and SIGKILL; come to their end before | {ended}; {finished} |
| files in part, or left behind by SIGTERM and SIGINT | {parts} |

True of every changed example: only declared errors; what validates without an error encodes, and what encodes decodes
to the same words, or a note says which differ; `--fix` twice is as once, and removes what it claims; a file does not
differ from itself; what is converted can be read; twice is as once.

Not covered: coverage-guided fuzzing, a full disk or quota, several writers at one file, and programs of ISPSoft,
CODESYS and DirectSOFT that read what pidcfg writes.
"""


def main(arguments: list[str]) -> int:
    """Hostile files, mutants and kills for so many minutes; 1 where something was found."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=60)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args(arguments)
    os.environ["PIDCFG_CACHE_DIR"] = __file__
    begin, here = time.monotonic(), Path.cwd()
    end = begin + 60 * options.minutes
    figures, mutants, ended = hostile.Figures(), fuzz.Fuzz(options.seed), kills.Kills()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        hostile.prepare(Path())
        cases = hostile.cases(options.seed)
        random.Random(options.seed).shuffle(cases)
        for number, case in enumerate(cases):
            if time.monotonic() > begin + 0.6 * (end - begin):
                break
            hostile.judge(case, Path(), hostile.CODE_PAGES[number % 4], figures, number)
        os.chdir(here)
    number, last = 0, (time.monotonic() + 2 * end) / 3
    while time.monotonic() < last:
        guarded(mutants, number)
        number += 1
    number = 0
    while time.monotonic() < end:
        kills.run(ended, options.seed, number)
        number += 1
    failures = [*figures.failures, *mutants.found.failures, *ended.failures]
    sys.stdout.writelines(f"{failure}\n" for failure in failures)
    PAGE.write_text(page(options, (time.monotonic() - begin) / 60, figures, mutants.found, ended), "utf-8")
    return int(bool(failures))


def guarded(rig: fuzz.Fuzz, number: int) -> None:
    """A mutant in a process of its own, which is ended where it takes too long: compiled code hears no signal."""
    reading, writing = os.pipe()
    child = os.fork()
    if not child:
        rig.found = fuzz.Found()
        rig.run(number)
        with os.fdopen(writing, "w", encoding="utf-8") as stream:
            json.dump(vars(rig.found), stream)
        os._exit(0)
    os.close(writing)
    with os.fdopen(reading, encoding="utf-8") as stream:
        ready, _, _ = select.select([stream], [], [], MOST)
        if not ready:
            os.kill(child, signal.SIGKILL)
        text = stream.read()
    os.waitpid(child, 0)
    hang = {"mutants": 1, "failures": [f"{rig.seed} {number}: takes more than {MOST} s"]}
    for key, value in (json.loads(text) if text else hang).items():
        setattr(rig.found, key, getattr(rig.found, key) + value)


def page(
    options: argparse.Namespace, minutes: float, figures: hostile.Figures, found: fuzz.Found, ended: kills.Kills
) -> str:
    """The page with its figures."""
    values = {**vars(figures), **vars(found), "memory": figures.memory / 1024}
    return TEXT.format(
        **values,
        seed=options.seed,
        minutes=minutes,
        kinds=len(hostile.sources()),
        spoils=len(hostile.SPOILS),
        seconds=hostile.SECONDS,
        untrue=len(found.failures),
        ended=", ".join(f"{count} by {name}" for name, count in sorted(ended.ended.items())) or "none",
        finished=ended.finished,
        parts=len(ended.failures),
    )


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
