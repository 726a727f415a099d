"""What a vendor's controller module offers to the runner, and nothing else.

A module of `pidcfg.sim.controllers` has a kernel ``scan(tick, cfg, st, aux, sig)`` that runs every controller that is
due, and ``load(image, options)`` that makes a `Plc` of an image's words. Times are integer microseconds (ticks) since
the program-to-run transition.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, MutableSequence, Sequence
from math import ceil
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from decimal import Decimal

    from pidcfg.schemas.base import Quantity
    from pidcfg.sim.report import ScanTime

TICKS = 1_000_000
"""Ticks in a second."""

Scan = Callable[[int, Sequence[Any], Sequence[Any], MutableSequence[float], MutableSequence[float]], None]


def steps_until(time: Decimal, step: int) -> int:
    """The first base step of ``step`` ticks that is not before a time."""
    return -(-ceil(time * TICKS) // step)


class Plc(Protocol):
    """A PLC as loaded from its words, ready for the program-to-run transition."""

    cfg: Sequence[Any]
    """The runner reads of each loop ``period`` (in ticks, as at the start) and the signals ``sig_in``, ``sig_pv``,
    ``sig_sp``, ``sig_out``, ``sig_bias``."""
    st: MutableSequence[Any]
    """The runner reads ``status`` (bits by name in `alarm_bits` and `flag_bits`), ``aux_status`` (`aux_bits`) and
    ``notice``, a refusal or an override since its last look as a number that `describe` knows; 0: none."""
    aux: MutableSequence[float]
    sig: Sequence[float]
    """The value of every signal at the start; the runner works on a copy that it hands to ``scan``."""
    signals: Sequence[str]
    """The name of every signal, ``TIC-101.PV``; the ones that are nobody's business are empty."""
    loops: Sequence[str]
    """In the order of ``cfg`` and ``st``."""
    scales: Sequence[tuple[float, float, int]]
    """For each loop its PV at 0 % and 100 % in engineering units, and the counts between."""
    longest: float
    """The longest time of a block of the PLC's program, in s; what the pre-roll has to wait for."""
    roots: Sequence[float | None]
    """For each loop whose signals are those before the PLC takes the root of its PV, where the PV's counts begin, as a
    share of the span; None for another loop, nothing where no PLC of the vendor tells them so."""
    outputs: Sequence[tuple[float, float]]
    """For each loop the value of its output signal at 0 % and 100 %; empty where the configuration's range says it."""
    rises: Sequence[bool]
    """For each loop whether its action takes for granted that the PV rises with the output."""
    pulses: Sequence[str]
    """Names of the signals that follow the output as pulses."""
    inputs: Mapping[str, int]
    """Signals from outside that are no loop's PV, by name: events may set them, plants may be wired to them."""
    wired: Collection[str]
    """Loops whose PV comes from within the PLC's program: no plant is wired to it."""
    inlets: Mapping[str, str]
    """For loops whose PV the program only filters, the one of `inputs` that it filters."""
    out_name: str
    """What the vendor calls a loop's output: OUT, CV, CO, MV."""
    modes: Sequence[str]
    """Every mode by the vendor's name."""
    goals: Sequence[str]
    """For each loop the mode it is meant to reach."""
    base: int
    """The greatest common step of the sample rates, in ticks."""
    periods: Sequence[int]
    """The present sample rate of each loop, in ticks; 0: the loop is not calculated."""
    running: bool
    """Whether the loop task runs; a set-up error stops it."""
    flags: Mapping[str, int]
    """Error registers by name, ``V7642``."""
    word_of_flags: str
    """How the vendor writes their content, as a format: ``0x{:04X}``."""
    alarm_bits: Mapping[str, int]
    """Alarms by name, as masks of ``status``, in order of severity."""
    flag_bits: Mapping[str, int]
    """Other conditions by name, as masks of ``status``."""
    aux_bits: Mapping[str, int]
    """Conditions by name, as masks of ``aux_status``."""

    options: Sequence[str]
    """What a scenario may choose about it, by the keys of ``plc``."""
    commands: Mapping[str, Sequence[str]]
    """What the events ``ramp_soak``, ``autotune`` and ``plc`` may say; nothing where the PLC has no such thing."""
    problems: Sequence[str]
    """Words that are no value of their format, and what they are taken for."""
    tuned_names: Sequence[str]
    """What auto-tune finds, by the vendor's names of the parameters."""

    def faults(self) -> Iterable[tuple[int, str, str]]:
        """Expressions of the PLC's program that had no value: the tick of the first time, where, and why."""

    def check_input(self, name: str, value: object) -> float:
        """The value of one of `inputs` as an event gives it; raises ``PydanticCustomError`` for an unusable one."""

    def mode(self, status: int) -> str:
        """The mode that a status word tells."""

    def profile_step(self, aux_status: int) -> str:
        """The step of a set-point profile that an auxiliary status tells, for people; empty: none."""

    def requested(self, notice: int) -> str | None:
        """The mode that was asked for when a notice was left; None: nobody asked."""

    def describe(self, notice: int) -> tuple[str, str]:
        """What happened in words: to the mode (a refusal, an override), and apart from it; empty: nothing."""

    def set_output(self, loop: int, value: Quantity, sig: MutableSequence[float]) -> None:
        """The output that a loop in Manual starts with."""

    def check_set(self, loop: int, path: tuple[str, ...], value: object) -> object:
        """The value of a ``set`` event as `set` takes it; raises ``PydanticCustomError`` for one that is unusable.

        Every vendor knows the keys ``output``, the output itself, and ``setpoint`` (or ``setpoint.value``).
        """

    def period_set(self, loop: int, path: tuple[str, ...], value: object) -> int:
        """The sample rate in ticks that `set` makes of a checked value; 0: the key is something else."""

    def set(self, loop: int, path: tuple[str, ...], value: object, sig: MutableSequence[float]) -> str | None:
        """Writes a parameter by its key in the configuration; returns why it has no effect yet, if so."""

    def request(self, loop: int, mode: str) -> None:
        """A one-shot mode request."""

    def ramp_soak(self, loop: int, command: str) -> None:
        """One of ``commands["ramp_soak"]``."""

    def autotune(self, loop: int, command: str) -> None:
        """One of ``commands["autotune"]``."""

    def tuned(self, loop: int) -> Mapping[str, Any] | None:
        """``done``, ``error``, ``status`` and ``results`` of a loop's auto-tune; None when there was none."""

    def program(self, sig: MutableSequence[float]) -> None:
        """The CPU stops (program mode): loops stop, except those that are independent of the CPU mode."""

    def scan_time(self, without_loops: float) -> ScanTime | None:
        """How long a scan becomes with the loops that are calculated, in s; None: the vendor does not say."""

    def run(self, tick: int) -> None:
        """The program-to-run transition, with the set-up check."""


class LoopsOnly:
    """What every PLC has whose program is not known: nothing comes from outside but the PVs of its loops."""

    inputs: Mapping[str, int] = {}
    wired: Collection[str] = ()
    inlets: Mapping[str, str] = {}
    longest = 0.0
    outputs: Sequence[tuple[float, float]] = ()
    roots: Sequence[float | None] = ()

    @staticmethod
    def profile_step(aux_status: int) -> str:  # noqa: ARG004 - as `Plc` has it
        """There are no profiles."""
        return ""

    @staticmethod
    def faults() -> Iterable[tuple[int, str, str]]:
        """Without expressions there are none."""
        return ()

    @staticmethod
    def check_input(name: str, _value: object) -> float:
        """There is none."""
        raise KeyError(name)


class Controller(Protocol):
    """A vendor's controller module."""

    Options: type[Any]
    """A dataclass: what a scenario may choose about the PLC (its key ``plc``); times in ticks."""
    Config: type[Any]
    State: type[Any]
    """The records of a loop: flat slots dataclasses of ints and floats."""
    load: Callable[..., Plc]
    """A `Plc` of an image and options, as it stands at the program-to-run transition."""
    scan: Scan
    INLINED: tuple[Callable[..., Any], ...]
    """The kernels of its hot path, which compiled code puts into the scan itself."""
