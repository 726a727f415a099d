"""CPU and memory by the size of the input: twice the input may take 2.4 times the CPU, over three doublings."""

from __future__ import annotations

import resource
import statistics
import time
from contextlib import suppress
from itertools import count, pairwise
from typing import TYPE_CHECKING, Any

from pidcfg.api import check_text
from pidcfg.encoders.dl06.files import read_ihex
from pidcfg.encoders.nextopid.st_read import read_st
from pidcfg.output.sheet_reader import read_configuration
from pidcfg.text.reader import DEFAULT
from reliability.copies import in_a_copy

if TYPE_CHECKING:
    from collections.abc import Callable

MOST = 2.4
"""Times the CPU for twice the input."""
DOUBLINGS = 3
TIMES = 5
MEGABYTES = 256
"""Above the process on an empty input."""
SECONDS = 300
LOOP = "  - {{name: L{}, sample_rate: 1, action: direct, tuning: {{gain: 1, reset: 10}}}}\n"
HEAD = "pidcfg: 1\nvendor: dl06\nplc: {loop_table: V2000, reset_decimals: 1}\nloops:\n"
ONE = HEAD + LOOP.format(0)
PROGRAM = "PROGRAM P\nVAR\n{}L : ControlPID;\nEND_VAR\n{}L(SP := 1.0);\nEND_PROGRAM\n"
GENERIC = HEAD.replace("dl06", "generic").replace("plc: {loop_table: V2000, reset_decimals: 1}\n", "")
NEUTRAL = (
    "  - {{name: L{}, output_raises_pv: true, sample_time: 1, tuning: {{gain: 1}}, pv: {{range: [0, 100]}}, "
    "output: {{range: [0, 100]}}}}\n"
)


COUNT = count()


def fresh() -> str:
    """A comment that no text before had: what was read once is remembered."""
    return f"# {next(COUNT)}\n"


def record(number: int) -> str:
    """A data record of Intel HEX with two bytes."""
    body = bytes([2, *(0x1000 + 2 * number).to_bytes(2, "big"), 0, number & 0xFF, 0])
    return f":{body.hex().upper()}{-sum(body) & 0xFF:02X}\n"


def sheet(n: int) -> None:
    """A sheet of neutral loops."""
    rows = "".join(f"L{i},1,1,0,100,0,100,true\n" for i in range(n))
    head = "name,sample_time,tuning.gain,pv.range low,pv.range high,output.range low,output.range high,output_raises_pv"
    read_configuration(f"vendor,generic\n{head}\n{rows}".encode(), "a.csv", None, DEFAULT)


KINDS: dict[str, tuple[int, Callable[[int], object]]] = {
    "loops of a configuration": (
        125, lambda n: check_text(fresh() + GENERIC + "".join(NEUTRAL.format(i) for i in range(n))),
    ),
    "comments": (1500, lambda n: check_text(fresh() + ONE + "# nothing\n" * n)),
    "comments that ignore a rule": (1000, lambda n: check_text(fresh() + ONE + "# pidcfg: ignore[DL999]\n" * n)),
    "the same key again": (1000, lambda n: check_text(fresh() + ONE + "k: 1\n" * n)),
    "unknown keys in a line": (
        300, lambda n: check_text(fresh() + ONE.replace("tuning", "".join(f"k{i}: 1, " for i in range(n)) + "tuning")),
    ),
    "items of a list": (1500, lambda n: check_text(fresh() + ONE + f"k: [{'1, ' * n}1]\n")),
    "records of Intel HEX": (2000, lambda n: read_ihex("".join(map(record, range(n))) + ":00000001FF\n")),
    "variables of a program": (
        400, lambda n: read_st(PROGRAM.format("".join(f"v{i} : REAL;\n" for i in range(n)), "")),
    ),
    "statements of a program": (
        400, lambda n: read_st(PROGRAM.format("v : REAL;\n", "v := 1.0 + v;\n" * n)),
    ),
    "rows of a sheet": (60, sheet),
}  # fmt: skip
"""The smallest size, and what reads an input of a size; the largest is within the limits of inputs."""
LEAST = 0.1
"""Seconds of CPU that are measured: the clock of a process is a coarse one."""


def seconds_of(work: Callable[[int], object], n: int, times: int = 1) -> float:
    """CPU of so many readings."""
    begin = time.process_time()
    for _ in range(times):
        with suppress(ValueError):  # a limit of the reader is an answer as well
            work(n)
    return time.process_time() - begin


def measured(kind: str) -> dict[str, float]:
    """The largest factor of the CPU for twice the size, medians compared, and the memory for the largest size."""
    first, work = KINDS[kind]
    sizes = [first << doubling for doubling in range(DOUBLINGS + 1)]
    seconds_of(work, first)  # what is loaded at the first time
    times = 1
    while seconds_of(work, first, times) < LEAST:
        times *= 2
    rested = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    taken = [statistics.median(seconds_of(work, n, times) for _ in range(TIMES)) / times for n in sizes]
    factors = [after / before for before, after in pairwise(taken)]
    memory = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - rested) / 1024
    return {"size": sizes[-1], "seconds": taken[-1], "factor": max(factors), "memory": memory}


def run_all() -> dict[str, Any]:
    """Every kind of input, each in a process of its own; a factor beyond the limit is measured once more."""
    kinds, failures = {}, []
    for kind in KINDS:
        for _ in range(2):
            _, found = in_a_copy(lambda kind=kind: measured(kind), SECONDS)
            if found is None or (found["factor"] <= MOST and found["memory"] <= MEGABYTES):
                break
        if found is None:
            failures.append(f"{kind}: takes more than {SECONDS} s, or crashes")
            continue
        kinds[kind] = found
        if found["factor"] > MOST:
            failures.append(f"{kind}: twice the input takes {found['factor']:.2f} times the CPU")
        if found["memory"] > MEGABYTES:
            failures.append(f"{kind}: {found['memory']:.0f} MB")
    return {"kinds": kinds, "failures": failures}
