"""How many mistakes a run of `simulate` does not notice: the measure of its standing expectations.

Run it with ``python tests/spoil_runs.py [EXAMPLE…]``, such as ``dl06/oven``. Every example scenario is run as it is and
with each mistake of `spoils`, written expectations taken out. A mistake counts where the run is another one: a PV
differs by more than `SHARE` of its span (or `RESPONSE` of how far it went) for more than `LONG` of the time, or another
mode, alarm or error of the set-up appears. Of these runs nearly all have to fail by a standing expectation; those of
the good files must not. What the configuration's own rules refuse does not run, and is not counted.
"""

from __future__ import annotations

import argparse
import io
import json
import math
import sys
from bisect import bisect_right
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from statistics import mean
from typing import TYPE_CHECKING, Any

from ruamel.yaml import YAML

import pidcfg
from pidcfg.sim.engine.choice import is_installed
from spoils import VENDORS, Data, ends, spoils

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from pidcfg.sim.engine.choice import EngineName

EXAMPLES = Path(__file__).parents[1] / "examples"
SHARE, RESPONSE, LEAST = 0.05, 0.2, 0.01
"""Of the span, and of the response but at least so much of the span: a difference that counts."""
WORSE = 1.25
"""Times the mean error of the good run: what is no larger is controlled as well as that."""
LONG = 0.1
"""Of the run: how long it must last."""
ROWS = 400
MOST = 100
"""Mistakes of one example: one of eight loops is not the whole measure."""
LONG_RUN = 50_000
"""Loop-steps of a run from which on compiled kernels pay, as it is repeated so often; they give the same results."""
GOAL = 0.95
"""Of the mistakes that count."""


@dataclass
class Run:
    """What is compared of a run."""

    times: list[float] = field(default_factory=list)
    pvs: dict[str, list[float]] = field(default_factory=dict)
    errors: dict[str, float] = field(default_factory=dict)
    """The mean of |SP − PV| of each loop."""
    happened: frozenset[tuple[str, ...]] = frozenset()
    """Modes, alarms and errors of the set-up by loop."""
    failures: tuple[str, ...] = ()
    """Standing expectations that fail, with what they say."""
    unjudged: tuple[str, ...] = ()
    other: tuple[str, ...] = ()
    """Whatever else makes the run fail: errors of the configuration, of the action, of an expression."""
    steps: int = 0
    ran: bool = True


@dataclass(frozen=True)
class Result:
    """What became of one mistake; ``differs``: why it counts, empty where it does not."""

    example: str
    spoil: str
    intent: bool
    ran: bool
    differs: str
    figure: float
    worse: str
    """The loop that is controlled worse than in the good run, and by how much; empty: none is."""
    failures: tuple[str, ...]
    unjudged: tuple[str, ...]
    other: tuple[str, ...]


def read(path: Path) -> Data:
    """A file's data; what YAML shares by anchors is no longer shared."""
    data: Data = json.loads(json.dumps(YAML(typ="safe", pure=True).load(path)))
    return data


def run(config: Data, scenario: Data, every: int, engine: EngineName = "python") -> Run:
    """Runs both files from memory."""
    trend = io.StringIO()
    files = {"x.scenario.yaml": json.dumps(scenario), str(scenario["config"]): json.dumps(config)}
    result = pidcfg.simulate(Path("x.scenario.yaml"), files=files, every=every, trend=trend, engine=engine)
    report = result.report
    errors = tuple(f"{d.code}: {d.message}" for d in result.findings if d.severity.label == "error")
    if report is None:
        return Run(other=errors, ran=False)
    rows = [line.split(",") for line in trend.getvalue().splitlines()]
    columns = {name: [float(row[i]) for row in rows[1:]] for i, name in enumerate(rows[0])}
    standing = getattr(report, "standing", ())
    failures = tuple(
        f"{v.kind} {v.loop}: {v.text}" for v in standing if v.is_judged and not v.passed and v.allowed is None
    )
    unjudged = tuple(f"{v.kind} {v.loop}: {v.text}" for v in standing if not v.is_judged)
    notes = tuple(note.text for note in report.notes if note.error)
    return Run(
        columns["time"],
        {loop: columns[f"{loop}.PV"] for loop in report.loops},
        {loop: mean_error(columns, loop) for loop in report.loops},
        frozenset(happenings(report)),
        failures,
        unjudged,
        errors + notes,
        report.steps,
    )


def mean_error(columns: dict[str, list[float]], loop: str) -> float:
    """The mean of |SP − PV| of a loop."""
    targets = next(columns[name] for name in (f"{loop}.SP", f"{loop}.SV") if name in columns)
    return mean(abs(sp - pv) for sp, pv in zip(targets, columns[f"{loop}.PV"], strict=True))


def happenings(report: Any) -> Iterator[tuple[str, ...]]:
    """Modes that loops reach, those refused, alarms and errors of the set-up."""
    for name, loop in report.loops.items():
        yield from ((name, "mode", entry.mode, "refused" * bool(entry.reason)) for entry in loop.modes)
        yield from ((name, "alarm", alarm.alarm) for alarm in loop.alarms)
        yield from ((name, flag) for flag, on in loop.flags.items() if on and "rror" in flag)
    yield from ((word, value) for word, value in report.plc_flags.items() if int(value, 16))


def difference(good: Run, bad: Run, spans: dict[str, float]) -> tuple[str, float]:
    """Why a mistake counts, and the longest share of the time for which a PV differs."""
    share, name = max((apart(good, bad, loop, span), loop) for loop, span in spans.items())
    if bad.happened != good.happened:
        what = min(bad.happened ^ good.happened)
        return " ".join(filter(None, what)), share
    return (f"PV of {name}" if share > LONG else ""), share


def apart(good: Run, bad: Run, loop: str, span: float) -> float:
    """The share of the time for which a PV is elsewhere than in the good run."""
    mine, theirs = good.pvs[loop], bad.pvs[loop]
    response = max(mine) - min(mine)
    limit = min(SHARE * span, max(RESPONSE * response, LEAST * span))
    places = (bisect_right(bad.times, time) - 1 for time in good.times)
    off = sum(not math.isclose(a, theirs[k], rel_tol=0, abs_tol=limit) for a, k in zip(mine, places, strict=True))
    return off / len(mine)


def worst(good: Run, bad: Run, spans: dict[str, float]) -> str:
    """The loop whose mean error has grown most, by `LEAST` of its span at least beyond `WORSE` times what it was."""
    rows = [(bad.errors[loop] / span, good.errors[loop] / span, loop) for loop, span in spans.items()]
    worse = [(mine - was, loop, mine, was) for mine, was, loop in rows if mine > WORSE * was + LEAST]
    return "" if not worse else "mean error of {1} {2:.1%} of span, was {3:.1%}".format(*max(worse))


def measure(example: str, most: int = MOST, names: Sequence[str] = ("",)) -> list[Result]:
    """One example: as it is, and with its mistakes, of which at most so many are taken, evenly.

    ``names``: only mistakes whose name has one of these in it.
    """
    scenario = read(EXAMPLES / f"{example}.scenario.yaml")
    config = read(EXAMPLES / example.partition("/")[0] / scenario["config"])
    keys = VENDORS[config["vendor"]]
    spans = {str(loop["name"]): abs(ends(loop, keys.span)[1] - ends(loop, keys.span)[0]) for loop in config["loops"]}
    steps = run(config, scenario, 10**9).steps
    every = max(1, steps // ROWS)
    engine: EngineName = "numba" if is_installed() and steps * len(spans) >= LONG_RUN else "python"
    whole = {key: value for key, value in scenario.items() if key != "expect"}
    good = run(config, whole, every, engine)
    results = [Result(example, "", False, good.ran, "", 0.0, "", good.failures, good.unjudged, good.other)]
    every_spoil = [spoil for spoil in spoils(config, scenario) if any(name in spoil.name for name in names)]
    for spoil in every_spoil[:: max(1, -(-len(every_spoil) // most))]:
        bad = run(spoil.config, spoil.scenario, every, engine)
        why, figure = difference(good, bad, spans) if bad.ran else ("", 0.0)
        worse = worst(good, bad, spans) if bad.ran else ""
        results.append(
            Result(
                example, spoil.name, spoil.intent, bad.ran, why, figure, worse, bad.failures, bad.unjudged, bad.other
            )
        )
    return results


def report(results: Sequence[Result]) -> bool:
    """Prints the figures; whether the goal is reached."""
    good = [r for r in results if not r.spoil]
    ran = [r for r in results if r.spoil and r.ran]
    counting = [r for r in ran if r.differs and not r.intent]
    wrong = [r for r in good if r.failures or not r.ran]
    failed = [r for r in counting if r.failures]
    sys.stdout.writelines(f"{line}\n" for line in figures(results, ran, counting))
    sys.stdout.writelines(f"{r.example} is good, and fails: {'; '.join(r.failures or r.other)}\n" for r in wrong)
    return len(failed) >= GOAL * len(counting) and not wrong


def survivors(ran: Sequence[Result]) -> Iterator[str]:
    """Mistakes that make no difference, and those that do and are not found."""
    for r in ran:
        what = f"{r.example}  {r.spoil}: {r.differs or 'nothing'} differs, {r.figure:.1%} of the time"
        if not r.differs:
            yield f"  no difference  {what}"
        elif not r.failures:
            word = "may be meant" if r.intent else "other error" if r.other else "survives"
            why = [r.worse or "controls no worse", *r.other[:1], *r.unjudged[:2]]
            yield f"  {word:13}  {what}  [{'; '.join(why)}]"


def sort_of(r: Result) -> str:
    """What a mistake is about: a plant that is not as it was thought is no mistake of the configuration."""
    what = r.spoil.partition(": ")[2] or r.spoil
    if r.spoil.startswith("plant "):
        return "plant"
    wiring = ("PV connected", "PV not", "no plant", "plant changed", "its output wired", "sensor")
    return "sensors and wiring" if what.startswith(wiring) else "configuration"


def figures(results: Sequence[Result], ran: Sequence[Result], counting: Sequence[Result]) -> Iterator[str]:
    """How many, of how many."""
    good, bad = [r for r in results if not r.spoil], sum(bool(r.spoil) for r in results)
    failed = [r for r in counting if r.failures]
    share = len(failed) / max(1, len(counting))
    other = sum(bool(r.other) for r in counting if not r.failures)
    intents = [r for r in ran if r.differs and r.intent]
    yield f"{len(good)} good runs, of which {sum(bool(r.failures or not r.ran) for r in good)} fail (goal 0)"
    yield f"{bad} mistakes, of which {bad - len(ran)} do not run at all, {len(counting)} count"
    yield f"{len(failed)} of them fail by a standing expectation: {share:.1%} (goal {GOAL:.0%})"
    yield f"{other} of the others fail by another error"
    worse = sum(bool(r.worse or r.failures) for r in counting)
    yield f"{worse} of those that count fail or control worse: {len(failed) / max(1, worse):.1%} of these fail"
    yield f"{len(intents)} edits may be meant so, {sum(bool(r.failures) for r in intents)} of them fail"
    for title, names in (
        ("sort", [(sort_of(r), bool(r.failures)) for r in counting]),
        ("vendor", [(r.example.partition("/")[0], bool(r.failures)) for r in counting]),
        ("first kind", [(r.failures[0].partition(" ")[0], True) for r in failed]),
    ):
        counts, found = Counter(name for name, _ in names), Counter(name for name, yes in names if yes)
        yield f"by {title}: " + ", ".join(f"{name} {found[name]} of {n}" for name, n in counts.most_common())


def main(arguments: Sequence[str]) -> int:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("examples", nargs="*", help="such as dl06/oven; all when none is named")
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    parser.add_argument("--most", type=int, default=MOST, help="mistakes of one example")
    options = parser.parse_args(arguments)
    every = sorted(path.parent.name + "/" + path.name.partition(".")[0] for path in EXAMPLES.glob("*/*.scenario.yaml"))
    results: list[Result] = []
    with ProcessPoolExecutor(options.jobs) as pool:
        for part in pool.map(partial(measure, most=options.most), options.examples or every):
            sys.stdout.writelines(f"{line}\n" for line in survivors([r for r in part if r.spoil and r.ran]))
            sys.stdout.flush()
            results += part
    return 0 if report(results) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
