"""Loop-steps a second of the DL06 step with a first-order plant: CPython, numba and a hand-written C twin.

Run it with ``python tests/benchmarks/bench_engine.py``; aims: CPython at least 0.5 million, numba at least 0.75 of C.
The C twin (dl06_twin.c) is compiled here with ``cc -O2`` where a compiler exists; all three must agree to the last bit.
"""

from __future__ import annotations

import shutil
import subprocess
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pidcfg.sim.compile import compiled, records
from pidcfg.sim.controllers.dl06.equation import coefficients
from pidcfg.sim.controllers.dl06.scan import INLINED, Config, State, scan
from pidcfg.sim.controllers.dl06.state import AUTO

if TYPE_CHECKING:
    from collections.abc import Callable

PERIOD = 500_000
TWIN = Path(__file__).with_name("dl06_twin.c")
REPEATS = 5


def run(steps: int, cfg: Any, st: Any, aux: Any, sig: Any) -> int:
    """Plants and controllers, step by step (kernel)."""
    for k in range(steps):
        load = 5.0 if k // 200 % 2 else 0.0
        for i in range(len(cfg)):
            y = sig[5 * i]
            sig[5 * i] = y + 0.0125 * (sig[5 * i + 3] - y + load)
        scan(k * PERIOD, cfg, st, aux, sig)
    return steps


def setup(loops: int) -> tuple[list[Config], list[State], list[float]]:
    """PID with filter, derivative gain limit, bias freeze, SP limits and all alarms."""
    cfg, st = [], []
    for i in range(loops):
        c = Config(period=PERIOD, freeze=1, pv_width=100.0, out_width=100.0, filter=0.5, sp_min=100.0, sp_max=4000.0)
        c.sig_in, c.sig_pv, c.sig_sp, c.sig_out, c.sig_bias = (5 * i + k for k in range(5))
        c.low_low, c.low, c.high, c.high_high = -2.0, -1.0, 3500.0, 3800.0
        c.yellow, c.red, c.rate_of_change, c.hysteresis = 4000.0, 4090.0, 500.0, 4.0
        c.limited, c.limit = 1, 10.0
        s = State(period=PERIOD, busy=0, status=AUTO, sp=2000.0, gain=2.0, reset=20.0, rate=1.0)
        coefficients(c, s)
        cfg.append(c)
        st.append(s)
    return cfg, st, [0.0] * (5 * loops)


def python(loops: int, steps: int) -> tuple[float, float]:
    """Seconds and checksum of a run in CPython."""
    cfg, st, sig = setup(loops)
    started = time.perf_counter()
    run(steps, cfg, st, [0.0], sig)
    return time.perf_counter() - started, checksum(sig, [(s.bias, s.out) for s in st])


def numba(loops: int, steps: int, kernel: Callable[..., Any]) -> tuple[float, float]:
    """Seconds and checksum of a compiled run, compilation left out."""
    cfg, st, sig = setup(loops)
    c, s, g = records(cfg, Config), records(st, State), np.array(sig)
    kernel(0, c, s, np.array([0.0]), g)
    started = time.perf_counter()
    kernel(steps, c, s, np.array([0.0]), g)
    return time.perf_counter() - started, checksum(g.tolist(), [(r["bias"].item(), r["out"].item()) for r in s])


def twin(loops: int, steps: int, program: Path) -> tuple[float, float]:
    """Seconds and checksum of the C twin."""
    printed = subprocess.run([program, str(loops), str(steps)], check=True, capture_output=True, text=True).stdout
    seconds, total = printed.split()
    return float(seconds), float(total)


def checksum(sig: list[float], outputs: list[tuple[float, float]]) -> float:
    """What all three print when they have calculated the same."""
    total = 0.0
    for i, (bias, out) in enumerate(outputs):
        total += sig[5 * i] + bias + out
    return total


def best(loops: int, steps: int, way: Callable[[int, int], tuple[float, float]]) -> tuple[float, float]:
    """Million loop-steps a second in the best of some runs, and the checksum."""
    runs = [way(loops, steps) for _ in range(REPEATS)]
    return loops * steps / min(seconds for seconds, _ in runs) / 1e6, runs[0][1]


def compare(loops: int, kernel: Callable[..., Any], program: Path | None) -> None:
    """One row of the report, after a check that short runs agree."""
    short = 2000
    sums = [python(loops, short)[1], numba(loops, short, kernel)[1]]
    sums += [twin(loops, short, program)[1]] if program else []
    if len(set(sums)) != 1:
        raise SystemExit(f"{loops} loops: the results differ: {sums}")
    slow, _ = best(loops, 200_000 // loops, python)
    fast, _ = best(loops, 20_000_000 // loops, lambda n, k: numba(n, k, kernel))
    row = f"{loops:5}  {slow:8.2f}  {fast:8.1f}"
    if program:
        hand, _ = best(loops, 20_000_000 // loops, lambda n, k: twin(n, k, program))
        row += f"  {hand:8.1f}  {fast / hand:9.2f}"
    print(row)


def main() -> None:
    """Print million loop-steps a second and the ratios."""
    started = time.perf_counter()
    kernel = compiled([run], inlined=INLINED)[run]
    numba(1, 1, kernel)
    print(f"numba was ready after {time.perf_counter() - started:.1f} s")
    compiler = shutil.which("cc") or shutil.which("gcc")
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder) / "dl06_twin"
        if compiler:
            command = [compiler, "-O2", "-ffp-contract=off", str(TWIN), "-o", str(program), "-lm"]
            subprocess.run(command, check=True)
        print("loops  CPython M/s  numba M/s  C M/s  numba / C")
        for loops in (1, 8):
            compare(loops, kernel, program if compiler else None)


if __name__ == "__main__":
    main()
