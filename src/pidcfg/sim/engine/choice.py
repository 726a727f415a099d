"""Who runs the kernels: CPython on lists of objects, or numba on arrays of records, with the same results to the bit.

The data stay lists; a compiled run copies them into arrays and back for each call, which spans thousands of base steps.
What is long (noise, trend, log, delay lines) is an ``array`` from the start, which both work on as it is.
"""

from __future__ import annotations

from array import array
from dataclasses import dataclass, field
from functools import cache
from types import FunctionType
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from pidcfg.sim.engine import kernel
from pidcfg.sim.engine.kernel import LOG_COLUMNS, LOG_ROWS, Log, Loops, Meters, Reference, Span, World
from pidcfg.sim.engine.plants import Normals, draws_alike, normals, step_plants, uniform, word
from pidcfg.sim.judgement.meters import Band, Gauge, measure_loop, read_gauges, watch_bands, watch_end, watch_swings
from pidcfg.text.store import KERNELS, holds_entries

if TYPE_CHECKING:
    from collections.abc import Callable, MutableSequence, Sequence

    from pidcfg.schemas.scenario import Scenario
    from pidcfg.sim.controllers.plc import Controller, Plc, Scan
    from pidcfg.sim.engine.network import Network
    from pidcfg.sim.engine.reference import HeldNetwork
    from pidcfg.sim.judgement.meters import Meter, Onset

EngineName = Literal["auto", "python", "numba"]
COPYING, LOADING = 15_000, 450_000
"""µs of CPython from which on compiled kernels pay: those that the process has kept, and those that lie in the cache.
What a run takes there, and what compiling takes, stands in `pidcfg.sim.costs`."""
CHUNK = 65_536
"""Base steps between two looks of Python: what noise and trend take of the memory."""


def choose(
    wanted: EngineName,
    loop_steps: int,
    controller: Controller,
    calls: tuple[Callable[..., Any], ...] = (),
    runs: int | None = None,
) -> Literal["python", "numba"]:
    """The engine of a run of ``loop_steps`` that ``calls`` these kernels beside `kernel.advance`.

    ``runs``: of a call in which others follow that are taken to be like this one; what has run before it, in this
    process or another, then has no part in the choice. None: it stands alone, and kernels that were kept count.
    """
    if wanted != "auto":
        return wanted
    work = loop_steps * controller.COST.loop_step * (runs or 1)
    if runs is None and controller.scan in KEPT:
        return "numba" if work >= COPYING else "python"
    if work < LOADING or not is_installed():
        return "python"
    compiles = work >= LOADING + 1_000_000 * controller.COST.compiling
    return "numba" if compiles or _in_cache(controller.scan, inlined_kernels(controller), calls) else "python"


@cache
def _in_cache(scan: Scan, inlined: tuple[Callable[..., Any], ...], calls: tuple[Callable[..., Any], ...]) -> bool:
    """Whether the compiled kernels of a run lay in the cache when this process first asked."""
    if not holds_entries(KERNELS):
        return False
    from pidcfg.sim.engine import compile as compiler

    of_vendor = (kernel.advance, *(f for f in calls if f in ENTRIES))
    return compiler.is_kept(of_vendor, ENTRIES, {kernel.scan: scan}, inlined) and (
        normals not in calls or compiler.is_kept([normals], [normals], {}, DRAWN)
    )


def calls_of(scenario: Scenario, net: Network) -> tuple[Callable[..., Any], ...]:
    """The kernels that a run calls beside `kernel.advance`."""
    return (kernel.settle,) * (scenario.initial == "steady") + (normals,) * bool(net.noisy)


def is_installed() -> bool:
    """Whether the optional extra ``fast`` is there."""
    try:
        import pidcfg.sim.engine.compile  # noqa: F401 - whether it can be imported is the question
    except ImportError:
        return False
    return True


NO_REFERENCE = Reference([], [], array("d"), [], [], [])


@dataclass(slots=True)
class Machine:
    """The data of a run as the kernels see them, and the kernels."""

    net: Network
    plc: Plc
    step: int
    meters: list[Meter]
    bands: list[Band]
    gauges: list[Gauge]
    onsets: list[Onset]
    shown: list[int]
    kernels: Kernels
    stack: list[float] = field(default_factory=list)
    log: array[int] = field(init=False)
    counts: list[int] = field(default_factory=lambda: [0, 0, 0])
    noise: array[float] = field(default_factory=lambda: array("d"))
    trend: array[float] = field(default_factory=lambda: array("d"))
    outputs: list[int] = field(default_factory=list)
    """Slots of the signals that the PLC writes."""
    held: dict[int, float] = field(default_factory=dict)
    """What stood in those that events have written since the last base step."""
    reached: int = 0
    """The base step to which the plants have come."""
    reference: HeldNetwork | None = None

    def __post_init__(self) -> None:
        self.stack = self.net.pool.stack()
        self.net.delay = array("d", self.net.delay)
        self.log = array("q", bytes(8 * LOG_COLUMNS * (LOG_ROWS + len(self.meters))))
        given = set(self.net.outside.values())
        self.outputs = [slot for slot, name in enumerate(self.plc.signals) if name and slot not in given]

    def hold(self, before: Sequence[float]) -> None:
        """An event has written signals of the PLC: up to its base step the plants see what stood there (D82)."""
        new = {slot: before[slot] for slot in self.outputs if self.net.signal_values[slot] != before[slot]}
        self.held = new | self.held

    def move_plants(self, k: int) -> None:
        """Bring the plants to base step ``k`` with the outputs of the step before, which events have overwritten."""
        net, signals, pool = self.net, self.net.signal_values, self.net.pool
        written = {slot: signals[slot] for slot in self.held}
        if k > self.reached:
            for slot, value in self.held.items():
                signals[slot] = value
            step_plants(k, net.parts, net.plants, net.delay, signals, pool.code, pool.constants, self.stack)
            self.reached = k
        for slot, value in written.items():
            signals[slot] = value
        self.held.clear()

    def advance(self, k: int, last: int, zero: int, every: int, noise_from: int) -> int:
        """`kernel.advance` with this run's data."""
        if self.held:
            self.move_plants(k)
        meters = Meters(self.meters, self.bands, self.gauges, self.onsets)
        log = Log(self.log, self.trend, self.counts, self.shown, every)
        if self.reference is not None:
            self.reference.follow()
        reference = NO_REFERENCE if self.reference is None else self.reference.arguments()
        return self.kernels.advance(k, last, zero, self._world(noise_from), self._loops(), meters, log, reference)

    def settle(self, k: int, last: int, spans: list[Span]) -> int:
        """`kernel.settle` with this run's data."""
        return self.kernels.settle(k, last, self._world(0), self._loops(), spans)

    def _world(self, noise_from: int) -> World:
        net, pool = self.net, self.net.pool
        columns = len(net.noisy) if self.noise else 0
        signals = net.delay, net.signal_values, pool.code, pool.constants, self.stack
        noise = self.noise, columns, noise_from, self.reached
        return World(self.step, net.parts, net.plants, net.channels, *signals, *noise)

    def _loops(self) -> Loops[Any, Any]:
        return Loops(self.plc.configs, self.plc.states, self.plc.aux)


class Kernels(NamedTuple):
    """`kernel.advance` and `kernel.settle` with a vendor's ``scan``."""

    advance: Callable[[int, int, int, World, Loops[Any, Any], Meters, Log, Reference], int]
    settle: Callable[[int, int, World, Loops[Any, Any], MutableSequence[Span]], int]
    normals: Callable[[], Normals | None] = lambda: None
    """`pidcfg.sim.engine.plants.normals`, compiled for the first run that has noise; None: Python draws it."""


def python_kernels(controller: Controller) -> Kernels:
    """The vendor's ``scan`` in the place of the empty one."""
    names = {**vars(kernel), "scan": controller.scan}
    return Kernels(*(FunctionType(f.__code__, names, f.__name__) for f in ENTRIES))


HOT = (step_plants, measure_loop, watch_bands, read_gauges, watch_end, watch_swings)
"""Kernels whose calls would cost more than their code takes room."""
ENTRIES = (kernel.advance, kernel.settle)
DRAWN = (word, uniform)
"""Kernels within `pidcfg.sim.engine.plants.normals`."""


def inlined_kernels(controller: Controller) -> tuple[Callable[..., Any], ...]:
    """The kernels on the hot path of a vendor."""
    return (*controller.INLINED, *HOT)


KEPT: dict[Scan, Kernels] = {}
"""Compiled kernels by the vendor's ``scan``: loading them costs more than a short run."""


def numba_kernels(controller: Controller) -> Kernels:
    """The same two, compiled, each call between copies of its data into arrays and back; kept for the process."""
    if controller.scan in KEPT:
        return KEPT[controller.scan]
    from pidcfg.sim.engine import compile as compiler

    built = compiler.compile_functions(ENTRIES, {kernel.scan: controller.scan}, inlined_kernels(controller))
    vendor = {kernel.Config: controller.Config, kernel.State: controller.State}
    advance, settle = (compiler.on_lists(built[f], f, vendor) for f in ENTRIES)
    KEPT[controller.scan] = Kernels(advance, settle, fast_normals)
    return KEPT[controller.scan]


@cache
def fast_normals() -> Normals | None:
    """`pidcfg.sim.engine.plants.normals` compiled, where it draws what Python draws."""
    from pidcfg.sim.engine import compile as compiler

    fast = compiler.on_lists(compiler.compile_functions([normals], inlined=DRAWN)[normals], normals, {})
    return fast if draws_alike(fast) else None
