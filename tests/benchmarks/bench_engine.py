"""How fast runs are, as `pidcfg simulate` does them: plants, metrics, log, and noise and trend where they are wanted.

Run it with ``python tests/benchmarks/bench_engine.py [--quick]``, or all benchmarks with ``python tasks.py bench``. The
yardsticks are the same run by hand in C (dl06_twin.c, where a compiler is) and simple-pid with the same plants. Before
a time counts, all that calculate the same have left the same bits: the report and every signal of every base step.
"""

from __future__ import annotations

import contextlib
import hashlib
import tempfile
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import production
from rounds import QUICK_ROUNDS, ROUNDS, Times, beside, cpu, is_quick, race, ratio
from twin import Twin, compiler

from pidcfg.sim.engine import choice as engine

if TYPE_CHECKING:
    from array import array
    from collections.abc import Callable, Sequence

    from pidcfg.sim.engine.choice import EngineName
    from pidcfg.sim.engine.recording import Recording
    from pidcfg.study.scenario import LoadedScenario

PLAIN, FAST, WRITTEN, LONG = 60_000, 1_000_000, 100_000, 8_000_000
"""Loop-steps of a run: in CPython, compiled, compiled with a trend (text for the most part), and beside C: from so many
on `auto` compiles in any case."""
KERNEL_GOAL, CYCLE_GOAL = 1.0, 20.0
WHOLE_GOALS = {False: 0.8, True: 0.7}
"""C's time over that of the whole compiled run, by whether there is noise."""


class Nowhere:
    """Takes text and forgets it."""

    def write(self, text: str, /) -> object:
        """As an open file does."""
        return len(text)


class Bits:
    """A recording that keeps nothing but the hash of every signal at every base step."""

    def __init__(self) -> None:
        self.digest, self.width = hashlib.sha256(), 0

    def begin(self, names: Sequence[str], steps: int, dt: float) -> None:
        """As `Recording.begin`."""
        del steps, dt
        self.width = len(names)

    def note_levels(self, *_: object) -> None:
        """As `Recording.note_levels`."""

    def add_rows(self, values: array[float], rows: int) -> None:
        """As `Recording.add_rows`."""
        self.digest.update(values[: rows * self.width].tobytes())

    def end(self) -> None:
        """As `Recording.end`."""


def outcome(case: LoadedScenario, name: EngineName, *, judged: bool = True) -> tuple[dict[str, Any], str]:
    """The report without its engine, and the hash of all signals."""
    bits = Bits()
    report = asdict(production.ours(case, name, recording=cast("Recording", bits), judged=judged))
    del report["engine"]
    return report, bits.digest.hexdigest()


def must_agree(what: str, *outcomes: tuple[dict[str, Any], str]) -> None:
    """Ends the benchmark when two sides have not calculated the same."""
    if any(one != outcomes[0] for one in outcomes):
        raise SystemExit(f"{what}: the results differ")


def case_of(vendor: str, loops: int, loop_steps: int, *, noise: bool) -> LoadedScenario:
    """A production run of so many loop-steps."""
    text = production.scenario(vendor, loops, loop_steps // loops, noise=noise)
    return production.loaded(production.configuration(vendor, loops), text)


def work_of(case: LoadedScenario, name: EngineName, *, trend: bool = False, judged: bool = True) -> Callable[[], Any]:
    """A run of it."""
    return lambda: production.ours(case, name, trend=Nowhere() if trend else None, judged=judged)


# --- CPython and compiled, all vendors -------------------------------------------------------------------------------


def compare_vendor(vendor: str, loops: int, rounds: int, *, noise: bool, trend: bool) -> str:
    """One row of the table of vendors."""
    short = case_of(vendor, loops, PLAIN, noise=noise)
    must_agree(f"{vendor}, {loops} loops", outcome(short, "python"), outcome(short, "numba"))
    steps = WRITTEN if trend else FAST
    long = case_of(vendor, loops, steps, noise=noise)
    sides = {"python": cpu(work_of(short, "python", trend=trend)), "numba": cpu(work_of(long, "numba", trend=trend))}
    with contextlib.suppress(ImportError):
        sides["simple-pid"] = cpu(production.simple_pid(loops, PLAIN // loops, noise=noise))
    times = race(sides, rounds)
    speedup = ratio(times["python"], times["numba"], steps / PLAIN)
    row = f"{vendor:9} {loops:2}  {'noise' if noise else '-':5}  {'trend' if trend else '-':5}"
    row += f" {nanoseconds(times['python'], PLAIN):8.0f} {nanoseconds(times['numba'], steps):8.1f} {both(speedup)}"
    if "simple-pid" in times:
        against = ratio(times["simple-pid"], times["python"])
        row += f"  {both(against)}"
    return row


def nanoseconds(times: Times, loop_steps: int) -> float:
    """The median of a loop-step."""
    return times.median / loop_steps * 1e9


def both(values: tuple[float, float]) -> str:
    """The ratio of the medians, and that of the minima."""
    return f"{values[0]:6.2f} ({values[1]:.2f})"


def vendors(rounds: int, *, quick: bool) -> None:
    """The table of vendors."""
    print("\nWhole runs, a loop-step; ratios of the medians (of the minima)")
    print("vendor  loops                  CPython    numba  CPython/numba   simple-pid/CPython")
    for vendor in production.VENDORS:
        for loops in (1,) if quick else (1, 8):
            for noise in (False, True):
                for trend in (False,) if quick else (False, True):
                    print(compare_vendor(vendor, loops, rounds, noise=noise, trend=trend), flush=True)


def limit_cycle(rounds: int) -> None:
    """A loop whose alarms come and go all the time."""
    short, long = (production.loaded(*production.limit_cycle(steps)) for steps in (PLAIN, FAST))
    must_agree("the limit cycle", outcome(short, "python"), outcome(short, "numba"))
    times = race({"python": cpu(work_of(short, "python")), "numba": cpu(work_of(long, "numba"))}, rounds)
    speedup = ratio(times["python"], times["numba"], FAST / PLAIN)
    print(f"\nA limit cycle with alarms (dl06), CPython / numba: {both(speedup)}  {beside(speedup[0], CYCLE_GOAL)}")


# --- compiled and C --------------------------------------------------------------------------------------------------


def against_c(rounds: int, *, quick: bool) -> None:
    """Compiled runs of the DL06 beside the same by hand."""
    if compiler() is None:
        print("\nno C compiler here: compiled runs are not held to C")
        return
    print("\nDL06: C / whole compiled run, and C / compiled kernels alone; ratios of the medians (of the minima)")
    with tempfile.TemporaryDirectory() as folder:
        twin = Twin(Path(folder))
        for loops in (1, 8):
            for noise in (False, True):
                print(race_c(twin, loops, QUICK_ROUNDS if quick else rounds, noise=noise), flush=True)


def race_c(twin: Twin, loops: int, rounds: int, *, noise: bool) -> str:
    """One row of it; C must have left the same bits over the whole run."""
    case = case_of("dl06", loops, LONG, noise=noise)
    hand: list[Any] = []
    twin.run(lambda: hand.append(outcome(case, "numba", judged=False)))
    must_agree(f"C, {loops} loops", outcome(case, "numba", judged=False), hand[0])
    work = work_of(case, "numba", judged=False)
    times = race(
        {"whole": cpu(work), "kernels": lambda: twin.kernel_seconds(work), "C": lambda: twin.run(work)}, rounds
    )
    whole, kernel = ratio(times["C"], times["whole"]), ratio(times["C"], times["kernels"])
    row = f"{loops:2} loops  {'noise' if noise else '-':5}  C {nanoseconds(times['C'], LONG):6.1f} ns"
    row += f"   whole {both(whole)} {beside(whole[0], WHOLE_GOALS[noise])}"
    return f"{row}   kernels {both(kernel)} {beside(kernel[0], KERNEL_GOAL)}"


def main() -> None:
    """All of them."""
    quick = is_quick("how fast runs are")
    rounds = QUICK_ROUNDS if quick else ROUNDS
    drawn = "compiled code" if engine.fast_normals() is not None else "Python: compiled code draws other bits here"
    print(f"noise of compiled runs is drawn by {drawn}")
    against_c(rounds, quick=quick)
    limit_cycle(rounds)
    vendors(rounds, quick=quick)


if __name__ == "__main__":
    main()
