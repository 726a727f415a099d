"""``python tasks.py torture [PART ...] [--minutes N]``: throw at pidcfg what means harm, and write the page.

Without a part all run that need nothing but this machine and pidcfg: `against` wants other tools, `guided` atheris in
a Python of its own, and `order` takes three times as long as the ordinary tests. Each part keeps its figures beside
this file when it ends.
``docs/reliability.md`` is written from the figures of all parts.
"""

from __future__ import annotations

import argparse
import os
import random
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))
sys.path.insert(0, str(Path(__file__).parents[1]))

from reliability import (
    branches,
    codecs,
    copies,
    faults,
    figures,
    fuzz,
    growth,
    guided,
    hostile,
    kills,
    order,
    others,
    words,
)
from reliability.page import PAGE, page

if TYPE_CHECKING:
    from collections.abc import Callable

MOST = 60
"""Seconds of CPU for a mutant of an example, or for a batch of listings."""
WATCHED = 4
"""Times as long takes what is watched for new branches."""
BATCH, SOME = 100, 6
"""Listings and mutants of examples that share a copy of the process."""
KEPT_EVERY = 60
"""Seconds after which a long part keeps its figures: it may be ended at any time."""


def hostile_files(options: argparse.Namespace, end: float) -> dict[str, Any]:
    """Every hostile file once, as far as the time goes."""
    found, here = hostile.Figures(), Path.cwd()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        hostile.prepare(Path())
        cases = hostile.cases(options.seed)
        random.Random(options.seed).shuffle(cases)
        for number, case in enumerate(cases):
            if time.monotonic() > end:
                break
            hostile.judge(case, Path(), hostile.CODE_PAGES[number % len(hostile.CODE_PAGES)], found, number)
        os.chdir(here)
    return {**vars(found), "kinds": len(hostile.sources()), "spoils": len(hostile.SPOILS)}


def changed_examples(options: argparse.Namespace, end: float) -> dict[str, Any]:
    """Changed examples through every step, and whether they still reach anything new."""
    rig = fuzz.Fuzz(options.seed)
    rig.prepare()
    known = branches.Known()
    return {**_rows(rig, "examples", SOME, options, end, known), "quiet": [known.quiet()]}


def changed_listings(options: argparse.Namespace, end: float) -> dict[str, Any]:
    """Changed listings through the codecs."""
    return _rows(codecs.Codecs(options.seed), "codecs", BATCH, options, end)


def register_words(options: argparse.Namespace, end: float) -> dict[str, Any]:
    """Words of every field there and back."""
    return _rows(words.Words(options.seed), "words", 1, options, end)


def _rows(
    rig: Any, part: str, size: int, options: argparse.Namespace, end: float, known: branches.Known | None = None
) -> dict[str, Any]:
    total, number, begin, kept = type(rig.found)(), 0, copies.cpu(), time.monotonic()
    while time.monotonic() < end:
        _batch(rig, total, range(number, number + size), known)
        number += size
        if time.monotonic() > kept + KEPT_EVERY:
            kept = time.monotonic()
            quiet = {} if known is None else {"quiet": [known.quiet()]}
            figures.keep(part, {"seed": options.seed, "cpu": copies.cpu() - begin, **vars(total), **quiet})
    return vars(total)


def _batch(rig: Any, total: Any, numbers: range, known: branches.Known | None = None) -> None:
    """Some numbers of a rig in a copy; one by one where they take too long together.

    ``known``: the branches that were taken before; the first of the numbers shows whether it takes another.
    """

    def work() -> dict[str, Any]:
        rig.found = type(total)()
        new = [] if known is None else known.new(lambda: rig.run(numbers[0]))
        for number in numbers if known is None else numbers[1:]:
            rig.run(number)
        return {**vars(rig.found), "new": new}

    most = MOST if known is None else WATCHED * MOST
    _, found = copies.in_a_copy(work, most)
    if found is None and len(numbers) > 1:
        for number in numbers:
            _batch(rig, total, range(number, number + 1), known)
        return
    slow = {"failures": [f"{rig.seed} {numbers[0]}: takes more than {most} s of CPU, or crashes"]}
    new = (found or {}).pop("new", [])
    if known is not None:
        total.branches += known.add(new)
    for key, value in (found or slow).items():
        setattr(total, key, getattr(total, key) + value)
    for failure in (found or slow)["failures"]:
        sys.stdout.write(f"{failure}\n")
        sys.stdout.flush()


def guided_inputs(options: argparse.Namespace, end: float) -> dict[str, Any]:
    """Inputs that grow towards new branches, for every reader."""
    begin = copies.cpu()

    def keep(found: dict[str, Any]) -> None:
        figures.keep("guided", {"seed": options.seed, "cpu": copies.cpu() - begin, **found})

    return guided.run_all(options.seed, end - time.monotonic(), keep)


def ended_commands(options: argparse.Namespace, end: float) -> dict[str, Any]:
    """Writing commands that are ended at random moments."""
    found = kills.Kills()
    number = 0
    while time.monotonic() < end and sum(found.ended.values()) < options.count:
        kills.run(found, options.seed, number)
        number += 1
    return vars(found)


PARTS: dict[str, Callable[[argparse.Namespace, float], dict[str, Any]]] = {
    "hostile": hostile_files,
    "examples": changed_examples,
    "codecs": changed_listings,
    "words": register_words,
    "guided": guided_inputs,
    "kills": ended_commands,
    "faults": lambda *_: faults.run_all(),
    "growth": lambda *_: growth.run_all(),
    "against": lambda options, _: others.run_all(options.seed, options.files),
    "order": lambda options, _: order.run_all(options.seed, options.tests, options.workers, freely=options.freely),
}


ON_DEMAND = frozenset({"against", "guided", "order"})
"""Parts that run where they are named alone."""


def numbers(text: str) -> tuple[int, ...]:
    """Numbers with commas between them."""
    return tuple(map(int, text.split(",")))


def main(arguments: list[str]) -> int:
    """The parts one after the other, each with its share of the time; 1 where something was found."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("parts", nargs="*", choices=[*PARTS, []], metavar="PART", help=", ".join(PARTS))
    parser.add_argument("--minutes", type=float, default=60)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=300, help="commands that are ended")
    parser.add_argument("--files", type=int, default=others.FILES, help="files for other tools")
    parser.add_argument("--tests", nargs="+", default=["tests"], help="files whose order is changed")
    parser.add_argument("--workers", type=numbers, default=order.WORKERS, help="of each order, such as 2,3,1")
    parser.add_argument("--freely", action="store_true", help="tests leave their file: its fixtures are made again")
    options = parser.parse_args(arguments)
    os.environ["PIDCFG_CACHE_DIR"] = __file__
    failures = []
    parts = options.parts or [part for part in PARTS if part not in ON_DEMAND]
    for part in parts:
        begin = copies.cpu()
        found = PARTS[part](options, time.monotonic() + 60 * options.minutes / len(parts))
        figures.keep(part, {"seed": options.seed, "cpu": copies.cpu() - begin, **found})
        failures += found["failures"]
        PAGE.write_text(page(figures.kept()), "utf-8")
    sys.stdout.writelines(f"{failure}\n" for failure in failures)
    return int(bool(failures))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
