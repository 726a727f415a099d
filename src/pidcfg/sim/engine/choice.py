"""Who runs the kernels: CPython on lists of objects, or numba on arrays of records, with the same results to the bit.

The data are lists; those of a compiled run lie in arrays (`pidcfg.sim.engine.compile.Rows`), which Python reads and
writes as it does lists of objects. What is long (noise, trend, log, delay lines) is an ``array`` for both.
"""

from __future__ import annotations

from array import array
from dataclasses import dataclass, field
from functools import cache
from types import FunctionType
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from pidcfg.sim.engine import kernel
from pidcfg.sim.engine.kernel import (
    LISTS,
    LOG_COLUMNS,
    LOG_ROWS,
    Drawn,
    Log,
    Loops,
    Meters,
    Reference,
    Span,
    Storage,
    World,
)
from pidcfg.sim.engine.plants import Normals, draws_alike, normals, step_plants, uniform, word
from pidcfg.sim.judgement.meters import (
    Band,
    Gauge,
    compare_errors,
    measure_loop,
    read_gauges,
    watch_bands,
    watch_end,
    watch_swings,
)
from pidcfg.text.store import KERNELS, holds_entries

if TYPE_CHECKING:
    from collections.abc import Callable, MutableSequence, Sequence

    from pidcfg.schemas.scenario import Scenario
    from pidcfg.sim.controllers.plc import Controller, Plc, Scan
    from pidcfg.sim.engine.network import Network
    from pidcfg.sim.engine.reference import HeldNetwork
    from pidcfg.sim.judgement.meters import Meter, Onset

EngineName = Literal["auto", "python", "numba"]
COPYING, LOADING = 15_000, 620_000
"""µs of CPython from which on compiled kernels pay: those that the process has kept, and those that lie in the cache.
What a run takes there, and what compiling takes, stands in `pidcfg.sim.costs`."""
CHUNK = 65_536
"""Base steps between two looks of Python: what noise and trend take of the memory."""


def choose(
    wanted: EngineName,
    loop_steps: int,
    controller: Controller,
    calls: tuple[Callable[..., object], ...] = (),
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
def _in_cache(scan: Scan, inlined: tuple[Callable[..., object], ...], calls: tuple[Callable[..., object], ...]) -> bool:
    """Whether the compiled kernels of a run lay in the cache when this process first asked."""
    if not holds_entries(KERNELS):
        return False
    from pidcfg.sim.engine import compile as compiler

    of_vendor = (kernel.advance, *(f for f in calls if f in ENTRIES))
    return compiler.is_kept(of_vendor, ENTRIES, {kernel.scan: scan}, inlined) and (
        normals not in calls or compiler.is_kept([normals], [normals], {}, DRAWN)
    )


def calls_of(scenario: Scenario, net: Network) -> tuple[Callable[..., object], ...]:
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
NO_NOISE = Drawn(array("d"), 0, 0)


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
    shown: Sequence[int]
    kernels: Kernels
    stack: MutableSequence[float] = field(default_factory=list)
    world: World = field(init=False)
    loops: Loops[Any, Any] = field(init=False)
    measured: Meters = field(init=False)
    """What the kernels get in every call."""
    written: Log | None = None
    """The same, as of the last call."""
    log: array[int] = field(init=False)
    counts: MutableSequence[int] = field(default_factory=lambda: [0, 0, 0])
    drawn: Drawn = NO_NOISE
    trend: array[float] = field(default_factory=lambda: array("d"))
    outputs: list[int] = field(default_factory=list)
    """Slots of the signals that the PLC writes."""
    held: dict[int, float] = field(default_factory=dict)
    """What stood in those that events have written since the last base step."""
    reached: int = 0
    """The base step to which the plants have come."""
    reference: HeldNetwork | None = None

    def __post_init__(self) -> None:
        self._place()
        self.log = array("q", bytes(8 * LOG_COLUMNS * (LOG_ROWS + len(self.meters))))
        given = set(self.net.outside.values())
        self.outputs = [slot for slot, name in enumerate(self.plc.signals) if name and slot not in given]

    def _place(self) -> None:
        """Puts the data where the kernels work on them as they are."""
        net, plc, (rows, numbers, _) = self.net, self.plc, self.kernels.storage
        net.plants, net.channels = rows(net.plants), rows(net.channels)
        plc.configs, plc.states, plc.aux = rows(plc.configs), rows(plc.states), numbers("d", plc.aux)
        self.meters, self.bands, self.gauges = rows(self.meters), rows(self.bands), rows(self.gauges)
        self.onsets, self.shown, self.counts = rows(self.onsets), numbers("q", self.shown), numbers("q", self.counts)
        net.signal_values, self.stack = numbers("d", net.signal_values), numbers("d", net.pool.stack())
        net.delay = array("d", net.delay)
        code, constants = numbers("q", net.pool.code), numbers("d", net.pool.constants)
        signals = net.delay, net.signal_values, code, constants, self.stack
        self.world = World(self.step, net.parts, net.plants, net.channels, *signals)
        self.loops = Loops(plc.configs, plc.states, plc.aux)
        self.measured = Meters(self.meters, self.bands, self.gauges, self.onsets)

    def renew(self) -> None:
        """Stands before the first base step again, with the network as it is now."""
        net = self.net
        if not isinstance(net.delay, array):
            net.delay = array("d", net.delay)
        if self.world.parts != net.parts or self.world.delay is not net.delay:
            self.world = self.world._replace(parts=net.parts, delay=net.delay)
        self.counts[0] = self.counts[1] = self.counts[2] = self.reached = 0
        self.held.clear()
        self.drawn = NO_NOISE

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

    def advance(self, k: int, last: int, zero: int, final: int, every: int) -> int:
        """`kernel.advance` with this run's data."""
        if self.held:
            self.move_plants(k)
        if self.written is None or self.written.trend is not self.trend or self.written.every != every:
            self.written = Log(self.log, self.trend, self.counts, self.shown, every)
        if self.reference is not None:
            self.reference.follow()
        reference = NO_REFERENCE if self.reference is None else self.reference.arguments
        groups = self.world, self.drawn, self.loops, self.measured, self.written, reference
        return self.kernels.advance(k, last, zero, final, self.reached, *groups)

    def settle(self, k: int, steps: int, most: int, spans: Sequence[Span]) -> int:
        """`kernel.settle` with this run's data."""
        return self.kernels.settle(k, steps, most, self.reached, self.world, self.loops, spans)


class Kernels(NamedTuple):
    """`kernel.advance` and `kernel.settle` with a vendor's ``scan``."""

    advance: Callable[[int, int, int, int, int, World, Drawn, Loops[Any, Any], Meters, Log, Reference], int]
    settle: Callable[[int, int, int, int, World, Loops[Any, Any], Sequence[Span]], int]
    normals: Callable[[], Normals | None] = lambda: None
    """`pidcfg.sim.engine.plants.normals`, compiled for the first run that has noise; None: Python draws it."""
    storage: Storage = LISTS
    """How the data lie on which they work."""


def python_kernels(controller: Controller) -> Kernels:
    """The vendor's ``scan`` in the place of the empty one."""
    names = {**vars(kernel), "scan": controller.scan}
    names |= {f.__name__: FunctionType(f.__code__, names, f.__name__) for f in (*ENTRIES, kernel.run_window)}
    return Kernels(*(names[f.__name__] for f in ENTRIES))


HOT = (
    step_plants,
    measure_loop,
    watch_bands,
    read_gauges,
    watch_end,
    watch_swings,
    kernel.hold_outputs,
    kernel.step_reference,
    compare_errors,
)
"""Kernels whose calls would cost more than their code takes room."""
ENTRIES = (kernel.advance, kernel.settle)
DRAWN = (word, uniform)
"""Kernels within `pidcfg.sim.engine.plants.normals`."""


def inlined_kernels(controller: Controller) -> tuple[Callable[..., object], ...]:
    """The kernels on the hot path of a vendor."""
    return (*controller.INLINED, *HOT)


KEPT: dict[Scan, Kernels] = {}
"""Compiled kernels by the vendor's ``scan``: loading them costs more than a short run."""


def numba_kernels(controller: Controller) -> Kernels:
    """The same two, compiled; kept for the process."""
    if controller.scan in KEPT:
        return KEPT[controller.scan]
    from pidcfg.sim.engine import compile as compiler

    built = compiler.compile_functions(ENTRIES, {kernel.scan: controller.scan}, inlined_kernels(controller))
    vendor = {kernel.Config: controller.Config, kernel.State: controller.State}
    advance, settle = (compiler.on_arrays(built[f], f, vendor) for f in ENTRIES)
    KEPT[controller.scan] = Kernels(
        advance, settle, fast_normals, Storage(compiler.Rows.of, array, compiler.put_in_arrays)
    )
    return KEPT[controller.scan]


@cache
def fast_normals() -> Normals | None:
    """`pidcfg.sim.engine.plants.normals` compiled, where it draws what Python draws."""
    from pidcfg.sim.engine import compile as compiler

    fast = compiler.on_arrays(compiler.compile_functions([normals], inlined=DRAWN)[normals], normals, {})
    return fast if draws_alike(fast) else None
