"""The DL06 by hand in C, in the place of the compiled kernels: same runner, same arrays, and the same bits after it.

What counts is the time that the C code itself takes: a whole run without any Python. The first base steps, in which
loops come into their mode, are left to the compiled kernels, which do the same at that speed.
"""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import time
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from pidcfg.sim.controllers.dl06 import scan as dl06
from pidcfg.sim.controllers.dl06.equation import Config, State
from pidcfg.sim.engine import choice as engine
from pidcfg.sim.engine import compile as compilation
from pidcfg.sim.engine.compile import to_arrays
from pidcfg.sim.engine.kernel import LOG_COLUMNS, Log, Loops, Meters, NoiseRows, Reference, World
from pidcfg.sim.engine.kernel import Config as AnyConfig
from pidcfg.sim.engine.kernel import State as AnyState
from pidcfg.sim.engine.plants import STATE_WORDS, UNSEEDED_WORDS, Plant, seed_words
from pidcfg.sim.judgement.meters import Band, Gauge, Meter

if TYPE_CHECKING:
    from collections.abc import Callable

    from pidcfg.sim.controllers.plc import Controller
    from pidcfg.sim.engine.compile import Kernel

SOURCE = Path(__file__).with_name("dl06_twin.c")
RECORDS = (Plant, Config, State, Meter, Band, Gauge)
BEGINNING = 64
"""Base steps that are left to the compiled kernels."""
VENDOR = {AnyConfig: Config, AnyState: State}
NUMBERS: tuple[str, ...] = (
    "step",
    "n_plants",
    "n_loops",
    "n_bands",
    "n_gauges",
    "n_shown",
    "columns",
    "noise_from",
    "reached",
)
NUMBERS += ("every", "room")
POINTERS: tuple[str, ...] = ("plants", "configs", "states", "signals", "noise", "meters", "bands")
POINTERS += ("gauges", "rows", "counts", "trend", "shown")


def controller() -> Controller:
    """The DL06's."""
    return cast("Controller", dl06)


class Run(ctypes.Structure):
    """`Run` of the C source."""

    _fields_ = [(name, ctypes.c_int64) for name in NUMBERS] + [(name, ctypes.c_void_p) for name in POINTERS]


def compiler() -> str | None:
    """A C compiler; None where there is none."""
    return shutil.which("gcc") or shutil.which("cc")


def header() -> str:
    """The records as C structures."""
    types = {"int": "int64_t", "float": "double"}
    lines = []
    for record in RECORDS:
        rows = "".join(f" {types[str(getattr(f.type, '__name__', f.type))]} {f.name};" for f in fields(record))
        lines.append(f"typedef struct {{{rows} }} {record.__name__};\n")
    return "".join(lines)


def built(folder: Path) -> ctypes.CDLL:
    """The C code, compiled as a library."""
    (folder / "records.h").write_text(header(), "utf-8")
    library = folder / "dl06_twin.so"
    command = [compiler() or "cc", "-O2", "-ffp-contract=off", "-shared", "-fPIC", f"-I{folder}", str(SOURCE)]
    subprocess.run([*command, "-o", str(library), "-lm"], check=True)
    loaded = ctypes.CDLL(str(library))
    loaded.advance.restype = ctypes.c_int64
    return loaded


class Twin:
    """C in the place of the compiled kernels of the DL06."""

    def __init__(self, folder: Path) -> None:
        self.code = built(folder)
        self.seconds = 0.0
        self.compiled = engine.numba_kernels(controller())
        self.by_hand = self.compiled._replace(advance=self.advance, normals=lambda: self.normals)
        self.timed = self.with_clocks()

    def run(self, work: Callable[[], Any]) -> float:
        """Seconds that C takes of a run with the engine ``numba``."""
        return self.instead(self.by_hand, work)

    def kernel_seconds(self, work: Callable[[], Any]) -> float:
        """Seconds that the compiled kernels take of it, without the copying around them."""
        return self.instead(self.timed, work)

    def instead(self, kernels: engine.Kernels, work: Callable[[], Any]) -> float:
        """Seconds that other kernels count."""
        self.seconds = 0.0
        engine.KEPT_KERNELS[controller().scan] = kernels
        try:
            work()
        finally:
            engine.KEPT_KERNELS[controller().scan] = self.compiled
        return self.seconds

    def with_clocks(self) -> engine.Kernels:
        """The compiled kernels, built once more with a clock inside."""
        plain = compilation.call_on_arrays

        def clocked(function: Kernel, original: Kernel, classes: Any) -> Kernel:
            def timed(*arguments: Any) -> Any:
                started = time.process_time()
                result = function(*arguments)
                self.seconds += time.process_time() - started
                return result

            return plain(timed, original, classes)

        compilation.call_on_arrays = clocked
        try:
            engine.KEPT_KERNELS.clear()
            engine.fast_normals.cache_clear()
            drawn = engine.fast_normals()
            return engine.numba_kernels(controller())._replace(normals=lambda: drawn)
        finally:
            compilation.call_on_arrays = plain
            engine.fast_normals.cache_clear()

    def advance(  # noqa: PLR0917 - as the kernel
        self,
        k: int,
        last: int,
        zero: int,
        final: int,
        reached: int,
        world: World,
        drawn: NoiseRows,
        loops: Any,
        meters: Meters,
        log: Log,
        reference: Reference,
    ) -> int:
        """`pidcfg.sim.engine.kernel.advance`, of a run without a reference."""
        rest = (zero, final, reached, world, drawn, loops, meters, log, reference)
        if k < zero + BEGINNING:
            k = self.compiled.advance(k, min(last, zero + BEGINNING), *rest)
        if k >= last:
            return k
        if k == zero + final:
            return self.compiled.advance(k, last, *rest)
        kinds = (World, NoiseRows, Loops, Meters, Log)
        groups = (world, drawn, loops, meters, log)
        w, d, c, m, g = [to_arrays(kind, value, VENDOR) for kind, value in zip(kinds, groups, strict=True)]
        room = len(g.rows) // LOG_COLUMNS - len(m.loops)
        sizes = [len(x) for x in (w.plants, c.configs, m.bands, m.gauges, g.trend_slots)]
        data = (
            w.plants,
            c.configs,
            c.states,
            w.signal_values,
            d.noise,
            m.loops,
            m.bands,
            m.gauges,
            g.rows,
            g.counts,
            g.trend,
            g.trend_slots,
        )
        run = Run(w.step, *sizes, d.columns, d.first, reached, g.interval, room, *(x.ctypes.data for x in data))
        started = time.process_time()
        k = self.code.advance(*map(ctypes.c_int64, (k, last, zero)), ctypes.byref(run))
        self.seconds += time.process_time() - started
        return k

    def normals(  # noqa: PLR0917 - as the kernel
        self, rows: int, column: int, columns: int, key: Any, state: Any, spare: Any, noise: Any
    ) -> int:
        """`pidcfg.sim.engine.plants.draw_normals`."""
        if state[STATE_WORDS] == UNSEEDED_WORDS:
            seed_words(key, state)
        places = [ctypes.c_void_p(x.buffer_info()[0]) for x in (state, spare, noise)]
        started = time.process_time()
        self.code.normals(*map(ctypes.c_int64, (rows, column, columns)), *places)
        self.seconds += time.process_time() - started
        return rows
