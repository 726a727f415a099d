"""Who runs the kernels: CPython on lists of objects, or numba on arrays of records, with the same results to the bit.

The data stay lists; a compiled run copies them into arrays and back for each call, which spans thousands of base steps.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from inspect import signature
from types import FunctionType
from typing import TYPE_CHECKING, Any, Literal

from pidcfg.sim import kernel
from pidcfg.sim.kernel import LOG_COLUMNS, LOG_ROWS, Channel, Span
from pidcfg.sim.metrics import Band, Gauge, Meter, measure_loop
from pidcfg.sim.plants import Plant, step_plants

if TYPE_CHECKING:
    from collections.abc import Callable

    from pidcfg.sim.network import Network
    from pidcfg.sim.plc import Controller, Plc

EngineName = Literal["auto", "python", "numba"]
WORTH_LOADING, WORTH_COMPILING = 400_000, 8_000_000
"""Loop-steps from which on compiled kernels pay: loading them takes a second, compiling a quarter of a minute."""
CHUNK = 16_384
"""Base steps between two looks of Python: what noise and trend take of the memory."""


def choose(wanted: EngineName, loop_steps: int, controller: Controller) -> Literal["python", "numba"]:
    """The engine of a run of ``loop_steps``."""
    if wanted != "auto":
        return wanted
    if loop_steps < WORTH_LOADING or not installed():
        return "python"
    from pidcfg.sim import compile as compiler

    if loop_steps >= WORTH_COMPILING or compiler.kept(ENTRIES, {kernel.scan: controller.scan}):
        return "numba"
    return "python"


def installed() -> bool:
    """Whether the optional extra ``fast`` is there."""
    try:
        import pidcfg.sim.compile  # noqa: F401 - whether it can be imported is the question
    except ImportError:
        return False
    return True


@dataclass(slots=True)
class Machine:
    """The data of a run as the kernels see them, and the kernels."""

    net: Network
    plc: Plc
    step: int
    meters: list[Meter]
    bands: list[Band]
    gauges: list[Gauge]
    shown: list[int]
    run: Callable[..., int]
    settle_run: Callable[..., int]
    stack: list[float] = field(default_factory=list)
    log: list[int] = field(default_factory=list)
    head: list[int] = field(default_factory=lambda: [0, 0, 0])
    noise: list[float] = field(default_factory=list)
    trend: list[float] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.stack = self.net.pool.stack()
        self.log = [0] * (LOG_COLUMNS * (LOG_ROWS + len(self.meters)))

    def advance(self, k: int, last: int, zero: int, every: int, noise_from: int) -> int:
        """`kernel.advance` with this run's data."""
        net, plc = self.net, self.plc
        return self.run(
            k,
            last,
            zero,
            self.step,
            every,
            noise_from,
            len(net.noisy) if self.noise else 0,
            net.plants,
            net.channels,
            net.delay,
            self.noise,
            net.sig,
            net.pool.code,
            net.pool.constants,
            self.stack,
            plc.cfg,
            plc.st,
            plc.aux,
            self.meters,
            self.bands,
            self.gauges,
            self.log,
            self.head,
            self.shown,
            self.trend,
        )

    def settle(self, k: int, last: int, spans: list[Span]) -> int:
        """`kernel.settle` with this run's data."""
        net, plc = self.net, self.plc
        return self.settle_run(
            k,
            last,
            self.step,
            net.plants,
            net.channels,
            net.delay,
            net.sig,
            net.pool.code,
            net.pool.constants,
            self.stack,
            plc.cfg,
            plc.st,
            plc.aux,
            spans,
        )


def python_kernels(controller: Controller) -> tuple[Callable[..., int], Callable[..., int]]:
    """`kernel.advance` and `kernel.settle` with the vendor's ``scan`` in the place of the empty one."""
    names = {**vars(kernel), "scan": controller.scan}
    advance = FunctionType(kernel.advance.__code__, names, "advance")
    return advance, FunctionType(kernel.settle.__code__, names, "settle")


RECORDS = {"plants": Plant, "channels": Channel, "meters": Meter, "bands": Band, "gauges": Gauge, "spans": Span}
"""Arguments of the kernels that are lists of objects; the vendor's cfg and st come to these."""
WHOLE = ("code", "log", "head", "shown")
"""Arguments that are lists of integers; other lists hold floats."""
HOT = (step_plants, measure_loop)
"""Kernels whose calls would cost more than their code takes room."""
ENTRIES = (kernel.advance, kernel.settle)
READ_ONLY = ("cfg", "code", "constants", "shown", "noise")


def numba_kernels(controller: Controller) -> tuple[Callable[..., int], Callable[..., int]]:
    """The same two, compiled, each call between copies of its data into arrays and back."""
    from pidcfg.sim import compile as compiler

    built = compiler.compiled(ENTRIES, {kernel.scan: controller.scan}, (*controller.INLINED, *HOT))
    kinds = {**RECORDS, "cfg": controller.Config, "st": controller.State}

    def to_array(name: str, value: Any) -> Any:
        if name in kinds:
            return compiler.records(value, kinds[name])
        if isinstance(value, list):
            return compiler.integers(value) if name in WHOLE else compiler.vector(value)
        return value

    def wrapped(original: Callable[..., int]) -> Callable[..., int]:
        names = signature(original).parameters
        function = built[original]

        def call(*arguments: Any) -> int:
            arrays = [to_array(name, value) for name, value in zip(names, arguments, strict=True)]
            result = function(*arrays)
            for name, array, value in zip(names, arrays, arguments, strict=True):
                if name in kinds and name not in READ_ONLY:
                    compiler.write_back(array, value)
                elif isinstance(value, list) and name not in READ_ONLY:
                    value[:] = array.tolist()
            return int(result)

        return call

    return wrapped(kernel.advance), wrapped(kernel.settle)
