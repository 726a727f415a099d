"""What a vendor's controller offers to the runner, and nothing else; what signals are called and counted in."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Iterable, Mapping, MutableSequence, Sequence
from math import ceil, gcd, isfinite, sqrt
from typing import TYPE_CHECKING, Any, ClassVar, Protocol

from pidcfg.sim.controllers.kernels import REQUEST_BITS, CountsConfig, LoopConfig, LoopState, split_notices
from pidcfg.sim.engine.expressions import BadValue
from pidcfg.text.frozen import frozen

if TYPE_CHECKING:
    from collections.abc import Iterator
    from decimal import Decimal

    from pidcfg.encoders.parameters import NamedLoops, Program
    from pidcfg.schemas.base import Quantity
    from pidcfg.sim.controllers.settings import NamedKeys
    from pidcfg.sim.costs import Cost
    from pidcfg.sim.judgement.report import ScanTime, TuneReport

# --- What the standing expectations ask of a PLC, with the answers of one that has no such thing ----------------------
#
# Design. Names and masks are tables; what follows from the present registers and signals is a method. A vendor
# overrides what is so with it, next to the attributes of `pidcfg.sim.controllers.plc.Plc` that the names come from.

CONTROL_MODES = ("auto", "cascade")
"""The modes in which a loop controls, as every vendor calls them."""


class LoopFacts(ABC):
    """What verdicts have to know of a PLC's loops, besides what the report shows."""

    configs: Sequence[LoopConfig]
    states: Sequence[LoopState]
    loops: Sequence[str]
    initial_modes: Sequence[str]
    scales: Sequence[tuple[float, float, int]]
    modes: Mapping[str, int]
    alarm_bits: Mapping[str, int]
    outer_alarms: Sequence[str] = ()
    """The outermost alarms of ``alarm_bits``: high-high, low-low, red."""
    alarm_limits: Mapping[str, str] = {}
    """Where the configuration of a loop has the limit of each alarm."""
    no_limit: float = 0.0
    """A limit from which on, either way, an alarm is off."""
    error_flags: Sequence[str] = ()
    """Flags that mean an error of the set-up."""
    tuning_flags: Sequence[str] = ()
    """Flags that are on while an auto-tune runs, where that is no mode."""
    problems: Sequence[BadValue] = ()
    """Words and parameters that are no value of their format."""
    mode_keys: Collection[str] = ()
    """Parameters that choose the mode, which an event may set."""
    form_key: str = ""
    """The parameter by which the times of the equation are gains; an event that sets it, too, sets it first."""

    @property
    def control_bits(self) -> int:
        """The bits of a status that mean Auto or Cascade."""
        return sum(self.modes.get(mode, 0) for mode in CONTROL_MODES)

    @property
    def outer_bits(self) -> int:
        """The bits of a status that are outermost alarms."""
        return sum(self.alarm_bits[name] for name in self.outer_alarms)

    @property
    def error_loops(self) -> Mapping[str, int]:
        """Error registers that belong to one loop, with its number; the others concern them all."""
        return {}

    @property
    def masters(self) -> Sequence[int]:
        """For each loop the one whose output is its set point; −1: there is none."""
        return [-1] * len(self.loops)

    @property
    def signal_links(self) -> Iterable[tuple[int, int]]:
        """Pairs of signals within the PLC, the first of which moves the second, besides the loops' own."""
        for config, master in zip(self.configs, self.masters, strict=False):
            if master >= 0:
                yield self.configs[master].out_slot, config.sp_slot

    def intended_mode(self, loop: int, signals: Sequence[float]) -> str:
        """The mode that a loop shall be in, as its configuration and its inputs say now."""
        return self.initial_modes[loop]

    def pv_range(self, loop: int) -> tuple[float, float] | None:
        """The ends of a PV's range; None: the configuration gives none."""
        return self.scales[loop][:2]

    def alarm_is_on(self, loop: int, alarm: str) -> bool:
        """Whether an alarm can come: it is switched on and has a limit."""
        limit = self.alarm_limits.get(alarm)
        return limit is None or bool(abs(getattr(self.configs[loop], limit)) < self.no_limit)

    def alarm_level(self, loop: int, alarm: str) -> float | None:
        """Where an alarm comes on, in the unit of the PV's signal: a PV, or a distance from the set point.

        None: the alarm is off, or is about no level.
        """
        limit = self.alarm_limits.get(alarm)
        if limit is None or not self.alarm_is_on(loop, alarm):
            return None
        return float(getattr(self.configs[loop], limit))

    def given_set_point(self, loop: int, signals: Sequence[float]) -> float:
        """At the start: the set point that the configuration gives a loop, before the PLC limits it."""
        return float(signals[self.configs[loop].sp_slot])

    def mode_inputs(self, loop: int) -> Collection[int]:
        """The signals of the program that choose a loop's mode."""
        return ()

    @abstractmethod
    def output_limits(self, loop: int, signals: Sequence[float]) -> tuple[float, float]:
        """The present limits of a loop's output, in the unit of its signal."""

    def inner_deviation(self, loop: int) -> float | None:
        """The inner deviation alarm, in the unit of the PV's signal; None: it is off."""
        return None

    def integrates(self, loop: int, signals: Sequence[float]) -> bool:
        """Whether a loop has an integral, so that no error may last."""
        return bool(self.states[loop].reset > 0.0)

    def dead_band(self, loop: int, signals: Sequence[float]) -> float:
        """The error within which a loop does nothing, in the unit of the PV's signal."""
        return 0.0

    def set_up_errors(self, loop: int) -> Iterator[str]:
        """Errors of a loop's set-up that are no flag, in words: what is no value of its format (D338)."""
        yield from (problem.text for problem in self.problems if problem.is_setting and problem.loop == loop)

    def program_errors(self, signals: Sequence[float]) -> Iterable[str]:
        """Errors of what is no loop, in words."""
        return ()

    def is_on_off(self, loop: int) -> bool:
        """Whether a loop's output is nothing but on or off."""
        return False

    def pulse_cycle(self, loop: int) -> float:
        """The period of the pulses that a loop's output makes, in s; 0: it makes none."""
        return 0.0

    def windup_input(self, loop: int, signals: Sequence[float]) -> bool:
        """Whether a loop is told from outside that its output is limited."""
        return False

    def is_deselected(
        self,
        loop: int,
        signals: Sequence[float],
        own_signals: Collection[int],
        other_signals: Collection[int],
    ) -> bool:
        """Whether a selector of the program leaves a loop's output out and takes that of another loop.

        ``own_signals`` are the signals that follow the loop's output, ``other_signals`` those that follow others.
        """
        return False

    def unwire_operator_inputs(self, image: Any) -> Any:
        """The same image with the operator's inputs of each loop in his own hand; most PLCs have no others."""
        return image


# --- What a vendor's controller module offers to the runner, and nothing else -----------------------------------------
#
# A module of `pidcfg.sim.controllers` has a kernel ``scan(tick, configs, states, aux, signals)`` that runs every
# controller that is due, and ``load(image, options)``, which makes a `Plc`. Times are whole µs (ticks) since the
# program-to-run transition.

TICKS = 1_000_000
"""Ticks in a second."""
SETPOINT = ("setpoint", "setpoint.value")
"""The keys of a loop's set point with every vendor; the vendor's own is the third."""
COUNTS_PER_RANGE = 1 << 20
"""Counts of a PV's range where the PLC has floats: finer than any transmitter."""

Scan = Callable[[int, list[Any], list[Any], list[float], list[float]], None]


def steps_until(time: Decimal, step: int) -> int:
    """The first base step of ``step`` ticks that is not before a time."""
    return -(-ceil(time * TICKS) // step)


class Plc(LoopFacts):
    """A PLC as loaded from its words, ready for the program-to-run transition.

    Vendors derive theirs; attributes that have a value here are those of most PLCs.
    """

    configs: Sequence[LoopConfig]
    states: Sequence[LoopState]
    """Of each loop: the runner reads ``status`` (bits by name in `alarm_bits` and `flag_bits`),
    ``aux_status`` (`aux_bits`) and ``notice``, a refusal or an override since its last look as a number that `describe`
    knows; 0: none."""
    aux: MutableSequence[float]
    signal_values: MutableSequence[float]
    """The value of every signal at the start; the runner works on a copy that it hands to ``scan``."""
    signals: MutableSequence[str]
    """The name of every signal, ``TIC-101.PV``; internal ones are empty."""
    loops: Sequence[str]
    """In the order of ``configs`` and ``states``."""
    initial_modes: Sequence[str]
    """For each loop the mode that it shall reach."""
    scales: Sequence[tuple[float, float, int]]
    """For each loop its PV at 0 % and 100 % in engineering units, and the counts between."""
    units: Mapping[str, str] = {}
    """The unit of each loop's PV by the loop's name, where the configuration gives one."""
    root_zeros: Sequence[float | None] = ()
    """For each loop whose signals are those before the PLC takes the root of its PV, where the PV's counts begin, as a
    share of the span; None for another loop, empty where the vendor has no such signals."""
    longest_time = 0.0
    """The longest time of a block of the PLC's program, in s; what the pre-roll has to wait for."""
    pulses: Sequence[str] = ()
    """Names of the signals that follow the output as pulses."""
    inputs: Mapping[str, int] = {}
    """Signals from outside that are no loop's PV, by name: events may set them, plants may be wired to them."""
    wired_loops: Collection[str] = ()
    """Loops whose PV comes from within the PLC's program: no plant is wired to it."""
    pv_inputs: Mapping[str, str] = {}
    """For loops whose PV the program only filters, the one of `inputs` that it filters."""
    setpoint = "setpoint.value"
    """The key of the set point in the vendor's configuration, for which ``setpoint`` is short in events."""
    out_name: str
    """What the vendor calls a loop's output: OUT, CV, CO, MV."""
    output_unit = ""
    """The unit of an output for which the configuration gives none."""
    modes: Mapping[str, int]
    """Every mode by the vendor's name, as a mask of ``status``."""
    error_format = "{}"
    """How the vendor writes the content of an error register, as a format: ``0x{:04X}``."""
    alarm_bits: Mapping[str, int] = {}
    """Alarms by name, as masks of ``status``, in order of severity."""
    flag_bits: Mapping[str, int] = {}
    """Other conditions by name, as masks of ``status``."""
    aux_bits: Mapping[str, int] = {}
    """Conditions by name, as masks of ``aux_status``."""
    in_run = True
    """The CPU's switch is at run."""
    options: Sequence[str] = ()
    """What a scenario may choose about it, by the keys of ``plc``."""
    tune_rule = ""
    """What the results of an auto-tune rest on where no manual prints its rule."""
    commands: Mapping[str, Sequence[str]] = {"ramp_soak": (), "autotune": (), "plc": ()}
    """What the events ``ramp_soak``, ``autotune`` and ``plc`` may say; nothing where the PLC has no such thing."""
    tuned_names: Sequence[str] = ()
    """Results of the auto-tune, by the vendor's names of the parameters."""
    reasons: Mapping[int, str]
    """Reasons of notices in words."""
    mode_codes: Collection[int] = ()
    """Reasons that concern the mode."""

    @property
    def base_ticks(self) -> int:
        """The greatest common step of the sample rates, in ticks."""
        return gcd(*(config.period for config in self.configs if not config.halt)) or TICKS

    @property
    def periods(self) -> Sequence[int]:
        """The present sample rate of each loop, in ticks; 0: the loop is not calculated."""
        return [0 if config.halt else state.period for config, state in zip(self.configs, self.states, strict=True)]

    @property
    def running(self) -> bool:
        """Whether the loop task runs; a set-up error stops it."""
        return True

    @property
    def error_words(self) -> Mapping[str, int]:
        """Error registers by name, ``V7642``."""
        return {}

    @property
    def out_ranges(self) -> Sequence[tuple[float, float]]:
        """For each loop the value of its output signal at 0 % and 100 %; empty where the configuration says it."""
        return ()

    @property
    @abstractmethod
    def output_raises_pv(self) -> Sequence[bool]:
        """For each loop whether its action takes for granted that the PV rises with the output."""

    def place_loops(
        self, config: type[LoopConfig], state: type[LoopState], signals: Mapping[str, str], aux: int = 0
    ) -> None:
        """The records of all loops, their ``signals`` by the field that has the slot, and ``aux`` floats for each."""
        self.configs = [config() for _ in self.loops]
        self.states = [state() for _ in self.loops]
        self.aux = [0.0] * (len(self.loops) * aux)
        self.signal_values = [0.0] * (len(self.loops) * len(signals))
        self.signals = [f"{loop}.{name}" if name else "" for loop in self.loops for name in signals.values()]
        for i, record in enumerate(self.configs):
            for slot, field in enumerate(signals, i * len(signals)):
                setattr(record, field, slot)

    # --- what the log tells ------------------------------------------------------------------------------------------

    @classmethod
    def mode(cls, status: int) -> str:
        """The mode that a status word tells."""
        return next((name for name, bit in cls.modes.items() if status & bit), "manual")

    @classmethod
    def profile_step(cls, aux_status: int) -> str:
        """The step of a set-point profile that an auxiliary status tells, for people; empty: none."""
        return ""

    @classmethod
    def requested_mode(cls, notice: int) -> str | None:
        """The mode that was requested when a notice was left; None: none was."""
        codes = [code for code, _ in split_notices(notice) if code]
        return next((mode for mode in cls.modes if cls.request_code(mode) == codes[-1]), None) if codes else None

    @classmethod
    def request_code(cls, mode: str) -> int:
        """A requested mode as a notice holds it: its bit, or its number from 1 where the vendor has more modes."""
        return cls.modes[mode] if len(cls.modes) <= REQUEST_BITS else [*cls.modes].index(mode) + 1

    @classmethod
    def describe(cls, notice: int) -> tuple[str, str]:
        """What happened in words: to the mode (a refusal, an override), and apart from it; empty: nothing."""
        texts: tuple[list[str], list[str]] = [], []
        for requested_mode, reason in split_notices(notice):
            texts[not cls.is_about_mode(requested_mode, reason)].append(cls.reasons[reason])
        return "; ".join(texts[0]), "; ".join(texts[1])

    @classmethod
    def is_about_mode(cls, requested_mode: int, reason: int) -> bool:
        """Whether a notice concerns the mode."""
        return reason in cls.mode_codes

    def faults(self) -> Iterable[tuple[int, str, str]]:
        """Expressions of the PLC's program that had no value: the tick of the first time, where, and why."""
        return ()

    # --- the operator ------------------------------------------------------------------------------------------------

    def check_input(self, name: str, value: object) -> float:
        """The value of one of `inputs` as an event gives it; raises ``PydanticCustomError`` for an unusable one."""
        raise KeyError(name)

    @abstractmethod
    def set_output(self, loop: int, value: Quantity, signals: MutableSequence[float]) -> str | None:
        """The output that a loop starts with; returns why it has no effect, if so."""

    @abstractmethod
    def check_set(self, loop: int, path: tuple[str, ...], value: object) -> object:
        """The value of a ``set`` event as `set` takes it; raises ``PydanticCustomError`` for one that is unusable.

        Every vendor knows the keys ``output``, the output itself, and ``setpoint`` (or ``setpoint.value``).
        """

    @abstractmethod
    def new_period(self, loop: int, path: tuple[str, ...], value: Any) -> int:
        """The sample rate in ticks that `set` makes of a checked value; 0: the key is something else."""

    @abstractmethod
    def set(self, loop: int, path: tuple[str, ...], value: Any, signals: MutableSequence[float]) -> str | None:
        """Writes a parameter by its key in the configuration; returns why it has no effect yet, if so."""

    @abstractmethod
    def request(self, loop: int, mode: str) -> None:
        """A one-shot mode request."""

    def ramp_soak(self, loop: int, command: str) -> None:
        """One of ``commands["ramp_soak"]``."""

    def autotune(self, loop: int, command: str) -> None:
        """One of ``commands["autotune"]``."""

    def tuning_result(self, loop: int) -> TuneReport | None:
        """What `tune_report` makes of a loop's auto-tune; None when there was none."""
        return None

    def tune_report(self, status: str, results: Sequence[float], *, done: bool, error: bool) -> TuneReport:
        """How an auto-tune went; only one that is done shows its ``results``, in the order of ``tuned_names``."""
        values = dict(zip(self.tuned_names, results, strict=True)) if done and results else {}
        report: TuneReport = {"done": done, "error": error, "status": status, "results": values}
        if values and self.tune_rule:
            report["rule"] = self.tune_rule
        return report

    # --- the CPU -----------------------------------------------------------------------------------------------------

    def run(self, tick: int) -> None:
        """The CPU's switch goes to run; in run mode nothing happens."""
        if not self.in_run:
            self.in_run = True
            self.start(tick)

    def program(self, signals: MutableSequence[float]) -> None:
        """The CPU's switch goes to program (stop) mode; there nothing happens."""
        if self.in_run:
            self.in_run = False
            self.stop(signals)

    def start(self, tick: int) -> None:
        """The program-to-run transition, with the set-up check."""

    def stop(self, signals: MutableSequence[float]) -> None:
        """The run-to-program transition: loops stop, except those that are independent of the CPU mode."""

    def scan_time(self, without_loops: float) -> ScanTime | None:
        """How long a scan becomes with the loops that are calculated, in s; None: the vendor does not say."""
        return None


SWITCH_AND_TUNE: Mapping[str, Sequence[str]] = {
    "ramp_soak": (),
    "autotune": ("start", "cancel"),
    "plc": ("stop", "run"),
}
"""`Plc.commands` of a PLC with a switch and an autotune."""


@frozen
class ScanOptions:
    """What a scenario chooses about a PLC that calculates with its scans; no register holds it."""

    scan_time: int = 0
    """Length of a scan in ticks: the base step; samples come with the next scan (D641)."""


@frozen
class NoOptions:
    """A scenario chooses nothing about the PLC: its configuration says everything."""


def low_and_width(pair: tuple[Decimal, Decimal] | None, minimum: float, span: float) -> tuple[float, float]:
    """Low end and width of a range in engineering units; without one, of the counts."""
    return (minimum, span) if pair is None else (float(pair[0]), float(pair[1] - pair[0]))


class CountsPlc(Plc):
    """A PLC whose loops have the ends of PV and output in engineering units, and its PV's counts."""

    configs: Sequence[CountsConfig]

    def scale_loops(self) -> None:
        """Makes `scales` and `roots`."""
        self.scales = [(config.pv_low, config.pv_low + config.pv_width, int(config.pv_span)) for config in self.configs]
        self.root_zeros = [config.pv_min / config.pv_span if config.square_root else None for config in self.configs]

    @property
    def out_ranges(self) -> Sequence[tuple[float, float]]:
        """Engineering units, counts without a range."""
        return [(config.out_low, config.out_low + config.out_width) for config in self.configs]


class Controller(Protocol):
    """A vendor's controller module; compiled code puts ``INLINED`` into the scan."""

    Options: type[Any]
    """A dataclass: what a scenario may choose about the PLC (its key ``plc``); times in ticks."""

    @property
    def Config(self) -> type[LoopConfig]:  # noqa: N802 - a class of the module
        """The record of a loop, set between two segments of a run: a flat slots dataclass of ints and floats."""

    @property
    def State(self) -> type[LoopState]:  # noqa: N802 - a class of the module
        """What a loop's samples change, the same."""

    @property
    def load(self) -> Callable[..., Plc]:
        """A `Plc` of an image and options, as it stands at the program-to-run transition."""

    @property
    def scan(self) -> Scan:
        """One base step of every loop."""

    @property
    def COST(self) -> Cost:  # noqa: N802 - a constant of the module
        """What a step takes."""

    @property
    def INLINED(self) -> tuple[Callable[..., object], ...]:  # noqa: N802 - a constant of the module
        """Functions that the scan calls."""


# --- A PLC whose loops are rows of one table of named parameters: how it begins, and what ``set`` may write -----------
#
# A vendor derives its own from `NamedPlc` and says how a loop's parameters become its records.


class NamedPlc(Plc):
    """A PLC as loaded from a program's parameters; its base step is the runner's."""

    options = ("scan_time",)
    table: ClassVar[NamedLoops]
    """The table of its parameters."""
    keys: ClassVar[NamedKeys]
    """What can be set while it runs."""
    sample_key: ClassVar[str]
    """The parameter that is the time between two samples."""
    config: ClassVar[type[LoopConfig]]
    state: ClassVar[type[LoopState]]
    """The records of a loop."""
    slots: ClassVar[Mapping[str, str]]
    """Signals of a loop by their slots in ``config``."""

    def __init__(self, program: Program, options: ScanOptions | None = None) -> None:
        self.loops = [str(entry["loop"]) for entry in program.settings] or self.table.loop_names(program.words)
        self._settings: Sequence[Mapping[str, Any]] = program.settings or [{}] * len(self.loops)
        found = [self.contents_of(program.words, loop) for loop in self.loops]
        self._contents = [contents for contents, _ in found]
        self.problems = [BadValue(i, text) for i, (_, problems) in enumerate(found) for text in problems]
        self.place_loops(self.config, self.state, self.slots)
        self._plc_settings = program.plc
        self.prepare()
        for i, config in enumerate(self.configs):
            self.begin(i)
            config.period = self.states[i].period
        self.initial_modes = [self.mode(state.status) for state in self.states]

    @abstractmethod
    def contents_of(self, words: Mapping[str, Any], loop: str) -> tuple[dict[str, Any], list[str]]:
        """The contents of a loop's parameters by name, and which are missing or no value of their type."""

    def prepare(self) -> None:
        """What all loops need before the first of them begins."""

    @abstractmethod
    def begin(self, loop: int) -> None:
        """What a loop starts with."""

    @abstractmethod
    def sample_ticks(self, value: Any) -> int:
        """The time between two samples in ticks, of a content of ``sample_key``; 0: that has no effect."""

    def check_set(self, loop: int, path: tuple[str, ...], value: object) -> object:
        """The content that a ``set`` event makes of its parameter; a ``PydanticCustomError`` says what is wrong."""
        return self.keys.check(path, value)

    def new_period(self, loop: int, path: tuple[str, ...], value: Any) -> int:
        """The time between two samples that a value for this key makes, in ticks; 0: another key, or without effect."""
        return self.sample_ticks(value) if self.keys.find(path).name == self.sample_key else 0


# --- What a loop's signals are called and counted in: names, units and ranges, for pictures and comparisons -----------

PERCENT = (0.0, 100.0)


@frozen
class RootScale:
    """The PV's scale of a loop that takes the root of it: its signals are recorded as they are before."""

    low: float
    width: float
    zero: float
    """Where the PV's counts begin, as a share of the span."""

    def take_root(self, value: float) -> float:
        """The PV for a value before the root."""
        return self.low + self.width * sqrt(max((value - self.low) / self.width + self.zero, 0.0))

    def remark(self, name: str, last: float, unit: str) -> str:
        """A remark on what the axis shows, with the value of ``name`` at the end as the example."""
        stands = f"{self.take_root(last):.4g} {unit}".rstrip()
        return f"PV and {name} are before the root: {last:.4g} at the end stands for {stands}"


def root_of(plc: Plc, loop: int) -> RootScale | None:
    """The scale of a loop, by its number, whose signals are those before its root is taken; None for another one."""
    low, high, _ = plc.scales[loop]
    zero = plc.root_zeros[loop] if plc.root_zeros else None
    return None if zero is None else RootScale(low, high - low, zero)


@frozen
class Axes:
    """What a loop's signals are called and counted in."""

    pv: str
    setpoint: str
    output: str
    """Names of the signals; empty: the PLC shows no such signal."""
    pv_unit: str = ""
    output_unit: str = ""
    output_range: tuple[float, float] | None = None
    output_counts: tuple[float, float] | None = None
    """Counts of the output at 0 % and 100 %, where no range says what they stand for."""
    pv_range: tuple[float, float] = PERCENT
    sample_time: float = 0.0
    """In s; 0: each base step."""
    root: RootScale | None = None
    """Given where the loop takes the root of its PV."""
    description: str = ""


def axes_of(plc: Plc, settings: Sequence[Mapping[str, Any]]) -> dict[str, Axes]:
    """The axes of each loop; units, ranges and descriptions come from the ``settings`` of its image."""
    by_name = {str(entry["loop"]): entry for entry in settings if "loop" in entry}
    axes = {}
    for i, loop in enumerate(plc.loops):
        entry, config = by_name.get(loop, {}), plc.configs[i]
        pv, out = (dict(entry.get(key) or {}) for key in ("pv", "output"))
        unit = out.get("unit") or plc.output_unit
        output_range = (
            plc.out_ranges[i] if plc.out_ranges else out.get("range") or (PERCENT if unit == "%" else limits_of(plc, i))
        )
        low, high, counts = plc.scales[i]
        raw = "range" not in pv and high - low == counts
        axes[loop] = Axes(
            plc.signals[config.pv_slot],
            plc.signals[config.sp_slot],
            plc.signals[config.out_slot],
            pv_unit=str(pv.get("unit") or ("counts" if raw else "")),
            output_unit=str(unit or ("counts" if plc.out_ranges and "range" not in out else "")),
            output_range=None if output_range is None else (float(output_range[0]), float(output_range[1])),
            output_counts=plc.out_ranges[i] if plc.out_ranges and "range" not in out else None,
            pv_range=(low, high),
            sample_time=config.period / TICKS,
            root=root_of(plc, i),
            description=str(entry.get("description") or ""),
        )
    return axes


def limits_of(plc: Plc, loop: int) -> tuple[float, float] | None:
    """The limits of an output without a range, as they are at the start; None where they are no range to show."""
    low, high = plc.output_limits(loop, plc.signal_values)
    return (low, high) if isfinite(high - low) and low < high else None


def signals_of(axes: Mapping[str, Axes]) -> frozenset[str]:
    """The signals that a picture needs."""
    return frozenset(name for one in axes.values() for name in (one.pv, one.setpoint, one.output) if name)
