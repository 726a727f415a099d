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
    LIST_STORAGE,
    LOG_COLUMNS,
    LOG_ROWS,
    Log,
    Loops,
    Meters,
    NoiseRows,
    Reference,
    Span,
    Storage,
    World,
)
from pidcfg.sim.engine.plants import Normals, draw_normals, draw_uniform, draw_word, draws_as_python, step_plants
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
from pidcfg.text.store import KERNEL_FOLDER, holds_entries

if TYPE_CHECKING:
    from collections.abc import Callable, MutableSequence, Sequence

    from pidcfg.schemas.scenario import Scenario
    from pidcfg.sim.controllers.plc import Controller, Plc, Scan
    from pidcfg.sim.engine.network import Network
    from pidcfg.sim.engine.reference import HeldNetwork
    from pidcfg.sim.judgement.meters import Meter, Onset

EngineName = Literal["auto", "python", "numba"]
COPYING_TIME, LOADING_TIME = 15_000, 620_000
"""µs of CPython from which on compiled kernels pay: those that the process has kept, and those that lie in the cache.
What a run takes there, and what compiling takes, stands in `pidcfg.sim.costs`."""
CHUNK = 65_536
"""Base steps between two looks of Python: what noise and trend take of the memory."""


def choose_engine(
    engine: EngineName,
    loop_steps: int,
    controller: Controller,
    kernels: tuple[Callable[..., object], ...] = (),
    runs: int | None = None,
) -> Literal["python", "numba"]:
    """The engine of a run of ``loop_steps`` that ``kernels`` these kernels beside `kernel.advance`.

    ``runs``: of a call in which others follow that are taken to be like this one; what has run before it, in this
    process or another, then has no part in the choice. None: it stands alone, and kernels that were kept count.
    """
    if engine != "auto":
        return engine
    work = loop_steps * controller.COST.loop_step * (runs or 1)
    if runs is None and controller.scan in KEPT_KERNELS:
        return "numba" if work >= COPYING_TIME else "python"
    if work < LOADING_TIME or not is_installed():
        return "python"
    compiles = work >= LOADING_TIME + 1_000_000 * controller.COST.compile_seconds
    return "numba" if compiles or _in_cache(controller.scan, inlined_kernels(controller), kernels) else "python"


@cache
def _in_cache(
    scan: Scan, inlined: tuple[Callable[..., object], ...], kernels: tuple[Callable[..., object], ...]
) -> bool:
    """Whether the compiled kernels of a run lay in the cache when this process first asked."""
    if not holds_entries(KERNEL_FOLDER):
        return False
    from pidcfg.sim.engine import compile as compiler

    vendor_kernels = (kernel.advance, *(f for f in kernels if f in ENTRY_KERNELS))
    return compiler.is_cached(vendor_kernels, ENTRY_KERNELS, {kernel.scan: scan}, inlined) and (
        draw_normals not in kernels or compiler.is_cached([draw_normals], [draw_normals], {}, NOISE_KERNELS)
    )


def calls_of(scenario: Scenario, net: Network) -> tuple[Callable[..., object], ...]:
    """The kernels that a run calls beside `kernel.advance`."""
    return (kernel.settle,) * (scenario.initial == "steady") + (draw_normals,) * bool(net.noisy_plants)


def is_installed() -> bool:
    """Whether the optional extra ``fast`` is there."""
    try:
        import pidcfg.sim.engine.compile  # noqa: F401 - whether it can be imported is the question
    except ImportError:
        return False
    return True


NO_REFERENCE = Reference([], [], array("d"), [], [], [])
NO_NOISE = NoiseRows(array("d"), 0, 0)


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
    trend_slots: Sequence[int]
    kernels: Kernels
    stack: MutableSequence[float] = field(default_factory=list)
    plant_group: World = field(init=False)
    loop_group: Loops[Any, Any] = field(init=False)
    meter_group: Meters = field(init=False)
    """What the kernels get in every call."""
    log_group: Log | None = None
    """The same, as of the last call."""
    log: array[int] = field(init=False)
    counts: MutableSequence[int] = field(default_factory=lambda: [0, 0, 0])
    noise: NoiseRows = NO_NOISE
    trend: array[float] = field(default_factory=lambda: array("d"))
    outputs: list[int] = field(default_factory=list)
    """Slots of the signals that the PLC writes."""
    held_signals: dict[int, float] = field(default_factory=dict)
    """What stood in those that events have written since the last base step."""
    plants_step: int = 0
    """The base step to which the plants have come."""
    reference: HeldNetwork | None = None

    def __post_init__(self) -> None:
        self._place_data()
        self.log = array("q", bytes(8 * LOG_COLUMNS * (LOG_ROWS + len(self.meters))))
        given = set(self.net.outside_signals.values())
        self.outputs = [slot for slot, name in enumerate(self.plc.signals) if name and slot not in given]

    def _place_data(self) -> None:
        """Puts the data where the kernels work on them as they are."""
        net, plc, (rows, numbers, _) = self.net, self.plc, self.kernels.storage
        net.plants, net.channels = rows(net.plants), rows(net.channels)
        plc.configs, plc.states, plc.aux = rows(plc.configs), rows(plc.states), numbers("d", plc.aux)
        self.meters, self.bands, self.gauges = rows(self.meters), rows(self.bands), rows(self.gauges)
        self.onsets, self.trend_slots, self.counts = (
            rows(self.onsets),
            numbers("q", self.trend_slots),
            numbers("q", self.counts),
        )
        net.signal_values, self.stack = numbers("d", net.signal_values), numbers("d", net.pool.new_stack())
        net.delay = array("d", net.delay)
        code, constants = numbers("q", net.pool.code), numbers("d", net.pool.constants)
        signals = net.delay, net.signal_values, code, constants, self.stack
        self.plant_group = World(self.step, net.parts, net.plants, net.channels, *signals)
        self.loop_group = Loops(plc.configs, plc.states, plc.aux)
        self.meter_group = Meters(self.meters, self.bands, self.gauges, self.onsets)

    def restart(self) -> None:
        """Stands before the first base step again, with the network as it is now."""
        net = self.net
        if not isinstance(net.delay, array):
            net.delay = array("d", net.delay)
        if self.plant_group.parts != net.parts or self.plant_group.delay is not net.delay:
            self.plant_group = self.plant_group._replace(parts=net.parts, delay=net.delay)
        self.counts[0] = self.counts[1] = self.counts[2] = self.plants_step = 0
        self.held_signals.clear()
        self.noise = NO_NOISE

    def hold_signals(self, before: Sequence[float]) -> None:
        """An event has written signals of the PLC: up to its base step the plants see what stood there (D82)."""
        new = {slot: before[slot] for slot in self.outputs if self.net.signal_values[slot] != before[slot]}
        self.held_signals = new | self.held_signals

    def move_plants(self, k: int) -> None:
        """Bring the plants to base step ``k`` with the outputs of the step before, which events have overwritten."""
        net, signals, pool = self.net, self.net.signal_values, self.net.pool
        event_values = {slot: signals[slot] for slot in self.held_signals}
        if k > self.plants_step:
            for slot, value in self.held_signals.items():
                signals[slot] = value
            step_plants(k, net.parts, net.plants, net.delay, signals, pool.code, pool.constants, self.stack)
            self.plants_step = k
        for slot, value in event_values.items():
            signals[slot] = value
        self.held_signals.clear()

    def advance(self, k: int, last: int, zero: int, final: int, interval: int) -> int:
        """`kernel.advance` with this run's data."""
        if self.held_signals:
            self.move_plants(k)
        if self.log_group is None or self.log_group.trend is not self.trend or self.log_group.interval != interval:
            self.log_group = Log(self.log, self.trend, self.counts, self.trend_slots, interval)
        if self.reference is not None:
            self.reference.follow_events()
        reference = NO_REFERENCE if self.reference is None else self.reference.kernel_arguments
        groups = self.plant_group, self.noise, self.loop_group, self.meter_group, self.log_group, reference
        return self.kernels.advance(k, last, zero, final, self.plants_step, *groups)

    def settle(self, k: int, steps: int, max_windows: int, spans: Sequence[Span]) -> int:
        """`kernel.settle` with this run's data."""
        return self.kernels.settle(k, steps, max_windows, self.plants_step, self.plant_group, self.loop_group, spans)


class Kernels(NamedTuple):
    """`kernel.advance` and `kernel.settle` with a vendor's ``scan``."""

    advance: Callable[[int, int, int, int, int, World, NoiseRows, Loops[Any, Any], Meters, Log, Reference], int]
    settle: Callable[[int, int, int, int, World, Loops[Any, Any], Sequence[Span]], int]
    normals: Callable[[], Normals | None] = lambda: None
    """`pidcfg.sim.engine.plants.draw_normals`, compiled for the first run that has noise; None: Python draws it."""
    storage: Storage = LIST_STORAGE
    """How the data lie on which they work."""


def python_kernels(controller: Controller) -> Kernels:
    """The vendor's ``scan`` in the place of the empty one."""
    names = {**vars(kernel), "scan": controller.scan}
    names |= {f.__name__: FunctionType(f.__code__, names, f.__name__) for f in (*ENTRY_KERNELS, kernel.run_window)}
    return Kernels(*(names[f.__name__] for f in ENTRY_KERNELS))


HOT_KERNELS = (
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
ENTRY_KERNELS = (kernel.advance, kernel.settle)
NOISE_KERNELS = (draw_word, draw_uniform)
"""Kernels within `pidcfg.sim.engine.plants.draw_normals`."""


def inlined_kernels(controller: Controller) -> tuple[Callable[..., object], ...]:
    """The kernels on the hot path of a vendor."""
    return (*controller.INLINED, *HOT_KERNELS)


KEPT_KERNELS: dict[Scan, Kernels] = {}
"""Compiled kernels by the vendor's ``scan``: loading them costs more than a short run."""


def numba_kernels(controller: Controller) -> Kernels:
    """The same two, compiled; kept for the process."""
    if controller.scan in KEPT_KERNELS:
        return KEPT_KERNELS[controller.scan]
    from pidcfg.sim.engine import compile as compiler

    built = compiler.compile_functions(ENTRY_KERNELS, {kernel.scan: controller.scan}, inlined_kernels(controller))
    vendor = {kernel.Config: controller.Config, kernel.State: controller.State}
    advance, settle = (compiler.call_on_arrays(built[f], f, vendor) for f in ENTRY_KERNELS)
    KEPT_KERNELS[controller.scan] = Kernels(
        advance, settle, fast_normals, Storage(compiler.Rows.from_objects, array, compiler.copy_into_arrays)
    )
    return KEPT_KERNELS[controller.scan]


@cache
def fast_normals() -> Normals | None:
    """`pidcfg.sim.engine.plants.draw_normals` compiled, where it draws what Python draws."""
    from pidcfg.sim.engine import compile as compiler

    fast = compiler.call_on_arrays(
        compiler.compile_functions([draw_normals], inlined_kernels=NOISE_KERNELS)[draw_normals], draw_normals, {}
    )
    return fast if draws_as_python(fast) else None
