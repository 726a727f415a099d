"""What an editor waits for: from a key to the findings, by loops, and from the start of the server to its first answer.

Run it with ``python tests/benchmarks/bench_editor.py [--quick]``. Findings are timed in this process, by the clock; the
pipe to the editor takes a millisecond or two more.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from typing import TYPE_CHECKING

from rounds import QUICK_ROUNDS, ROUNDS, Times, beside, is_quick

from pidcfg.cli.lsp.answers import diagnostics
from pidcfg.cli.lsp.files import Files
from pidcfg.cli.lsp.server import set_collector

if TYPE_CHECKING:
    from collections.abc import Callable

GOALS = {1: 100, 8: 100, 300: 500}
"""Milliseconds from a key to the findings, by loops."""
START_GOAL = 1500
"""Milliseconds until `initialize` is answered."""
LOOP = """\
  - name: TIC-{n}
    sample_time: 500 ms
    output_raises_pv: true
    tuning: {{gain: 2.5, integral_time: 2 min, derivative_time: 10 s}}
    pv: {{range: [0, 150], unit: degC}}
    setpoint: {{value: {value}, limits: [0, 120]}}
    output: {{range: [0, 100], limits: [0, 90]}}
    alarms: {{pv: {{low_low: 5, low: 10, high: 120, high_high: 130}}}}
"""
URI = "file:///loops/line.yaml"


def keys(loops: int) -> Callable[[], float]:
    """A key in a file of so many loops, and everything up to its findings."""
    files, version = Files(), 0

    def key() -> float:
        nonlocal version
        version += 1
        values = (80 + version % 9 if n == 1 else 85 for n in range(1, loops + 1))
        text = "".join(LOOP.format(n=n, value=value) for n, value in enumerate(values, 1))
        started = time.perf_counter()
        files.put_buffer(URI, version, f"pidcfg: 1\nvendor: generic\nloops:\n{text}")
        diagnostics(files.analyse(URI))
        return time.perf_counter() - started

    return key


def first_answer() -> float:
    """The server as a process, up to its first answer."""
    params: dict[str, object] = {"processId": None, "rootUri": None, "capabilities": {}}
    body = json.dumps({"jsonrpc": "2.0", "id": 1, "method": "initialize", "params": params}).encode()
    started = time.perf_counter()
    command = [sys.executable, "-m", "pidcfg", "lsp"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as server:
        if server.stdin is None or server.stdout is None:
            raise RuntimeError("no pipes")
        server.stdin.write(b"Content-Length: %d\r\n\r\n%s" % (len(body), body))
        server.stdin.flush()
        server.stdout.readline()
        seconds = time.perf_counter() - started
        server.stdin.close()
        server.stdout.read()
    return seconds


def main() -> None:
    """Prints a line for each, beside its goal."""
    rounds = QUICK_ROUNDS if is_quick(__doc__ or "") else ROUNDS
    set_collector()
    rows = [(f"a key in {loops} loops", keys(loops), goal) for loops, goal in GOALS.items()]
    for what, side, goal in (*rows, ("initialize", first_answer, START_GOAL)):
        side()
        times = Times(tuple(side() for _ in range(rounds)))
        median, least = times.median * 1000, times.least * 1000
        print(f"{what:<22} {median:6.0f} ms, at best {least:.0f}; {beside(median, goal, most=True)}")


if __name__ == "__main__":
    main()
