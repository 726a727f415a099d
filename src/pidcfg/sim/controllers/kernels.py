"""What the vendors' kernels share: records of a loop, terms, and notices for the log."""

from __future__ import annotations

from array import array
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cache
from math import isfinite
from typing import Any, NamedTuple, TypeVar

# --- Records of a loop that every vendor has, as flat dataclasses that each vendor's `Config` and `State` extend ------
#
# Ints and floats only: the same fields become a NumPy record for numba. A field that is nothing but what a register
# (or a parameter) holds names it by `register`, and `read_registers` fills it; what is calculated stands in a
# vendor's ``configure_loop``.

NEVER = 1 << 60
"""A tick that does not come."""

Number = TypeVar("Number", int, float)


class Register(NamedTuple):
    """A field of a record and the register that it comes from."""

    field: str
    is_integer: bool
    default: Any
    name: str
    equals: object
    enabled_by: str | None


def register(name: str, default: Number, *, equals: object = None, enabled_by: str | None = None) -> Number:
    """A field that holds what a register does.

    It keeps its ``default`` where the register has no value or another one, ``enabled_by``, is off. With ``equals`` it
    is 1 where the register has that value, else 0.
    """
    value: Number = field(default=default, metadata={"name": name, "equals": equals, "enabled_by": enabled_by})
    return value


def registers(record: object) -> Sequence[Register]:
    """The fields of a record, or of its class, that come from registers."""
    return _registers(record if isinstance(record, type) else type(record))


@cache
def _registers(kind: type[Any]) -> Sequence[Register]:
    rows = [f for f in fields(kind) if f.metadata]
    return [Register(f.name, f.type in {int, "int"}, f.default, **f.metadata) for f in rows]


def read_registers(record: object, values: Mapping[str, Any], real: Callable[[Any], float] = float) -> None:
    """Fills the fields of a record that come from registers, from the registers' values by name."""
    for row in registers(record):
        value = values.get(row.name) if row.enabled_by is None or values[row.enabled_by] else None
        if value is None:
            number = row.default
        elif row.equals is not None:
            number = int(value == row.equals)
        else:
            number = int(value) if row.is_integer else real(value)
        setattr(record, row.field, number)


def register_values(record: object) -> dict[str, float]:
    """The values of a record's registers, by name."""
    return {row.name: getattr(record, row.field) for row in registers(record)}


@dataclass(slots=True)
class LoopConfig:
    """What the runner reads of a loop; each vendor adds fields. Changed only between two segments of a run."""

    period: int = 100_000
    """Sample rate in ticks, as at the start."""
    halt: int = 0
    """The loop is not calculated."""
    # where its signals stand in the vector of all signals
    in_slot: int = 0
    """What the plant writes."""
    pv_slot: int = 1
    sp_slot: int = 2
    """The set point in force."""
    out_slot: int = 3
    bias_slot: int = 4


@dataclass(slots=True)
class CountsConfig(LoopConfig):
    """A loop whose registers hold PV and output in counts, for values in engineering units."""

    fetches_pv: int = 0
    """The PV comes from an input module, without the ladder program."""
    carries_output: int = 0
    """The output goes to an output module, without the ladder program."""
    # ends of the ranges in engineering units, and the counts between
    pv_low: float = 0.0
    pv_width: float = 4095.0
    pv_min: float = 0.0
    pv_max: float = 4095.0
    pv_span: float = 4095.0
    out_low: float = 0.0
    out_width: float = 4095.0
    square_root: int = 0
    """The PV is the root of what the input shows."""
    tune_buffer: int = 0
    """Offset in `aux` of `autotune.POINTS` floats."""


@dataclass(slots=True)
class LoopState:
    """What the runner reads of a loop, its registers, and the factors calculated from them."""

    due: int = 0
    """Tick of the next calculation."""
    period: int = 100_000
    """Present sample rate in ticks."""
    pending: int = 0
    """What is pending, as bits; 0 in undisturbed operation."""
    status: int = 1
    """Mode, alarms and conditions, as bits."""
    aux_status: int = 0
    """Further conditions, as bits."""
    notice: int = 0
    """What happened since the runner last looked: see `pidcfg.sim.controllers.kernels`."""
    sp: float = 0.0
    pv: float = 0.0
    out: float = 0.0
    gain: float = 1.0
    """As the register has it, likewise the next two."""
    reset: float = 0.0
    """In s."""
    rate: float = 0.0
    """In s."""
    kp: float = 0.0
    ki: float = 0.0
    kd: float = 0.0


@dataclass(slots=True)
class CurveState(LoopState):
    """A loop that measures the noise of its PV and records a reaction curve."""

    tune_phase: int = 0
    tune_count: int = 0
    """Samples in this phase."""
    tune_points: int = 0
    """Points of the reaction curve; under a relay the sample of the last switch."""
    tune_stride: int = 1
    """Samples a point."""
    tune_sum: float = 0.0
    tune_noise: float = 0.0
    """Estimated standard deviation of the PV."""
    tune_base: float = 0.0
    """PV at rest."""
    tune_drift: float = 0.0
    """How far the PV moved each sample before the step."""
    tune_out: float = 0.0
    """Output before the autotune."""
    tune_pv_1: float = 0.0
    """PV at n-1 and n-2."""
    tune_pv_2: float = 0.0


@dataclass(slots=True)
class RelayState(CurveState):
    """A loop with a relay autotune."""

    tune_done: int = 0
    tune_step: float = 0.0
    """Step of the output, with its sign, as the vendor counts it."""
    tune_low: float = 0.0
    tune_high: float = 0.0
    tune_relay_sign: int = 0
    """1 while the relay drives the PV up and -1 while down: the sign of the error that switched it; 0: none has."""
    tune_turns: int = 0
    """Times the relay has switched."""
    tune_start: int = 0
    """Sample of the first switch that counts."""
    tune_swing: float = 0.0
    """Sum of the PV's peak-to-peak amplitudes."""


@dataclass(slots=True)
class RequestState(RelayState):
    """A loop whose mode is requested: once by an event, and at every sample until its goal is reached."""

    request: int = 0
    """One-shot requested mode bit."""
    goal: int = 0
    """The mode to be requested every sample until it is granted."""
    goal_sp: float = 0.0
    """Set point that is written when the goal is reached for the first time."""
    goal_has_sp: int = 0
    """Whether there is a set point to write: configured, or set by an event."""
    requested_mode: int = 0
    """The mode that was requested last, for the log."""
    refused_reasons: int = 0
    """Reasons, as bits, for which the goal has been refused so far."""


# --- Kernels that the vendors' algorithms share: plain functions of numbers, compiled by numba as they are ------------

ROUNDING_MAGIC = 6755399441055744.0
"""1.5 * 2**52: adding and subtracting it rounds to a whole number, half to even, without a call."""

SINGLE_CELL = array("f", [0.0])
"""A number that is stored here is rounded to single precision."""


def clamp(value: float, low: float, high: float) -> float:
    """The value within its limits; where they contradict each other, the low limit wins."""
    if value > high:
        value = high
    if value < low:
        value = low
    return value


def round_half_even(value: float) -> float:
    """The nearest whole number, half to even; exact below 2**51."""
    return value + ROUNDING_MAGIC - ROUNDING_MAGIC


def finite_or(value: float, otherwise: float) -> float:
    """The number itself if it is finite, else ``otherwise``."""
    return value if isfinite(value) else otherwise


def step_to(value: float, target: float, step: float) -> float:
    """From ``value`` towards ``target`` by at most ``step``."""
    if value < target:
        return target if target - value <= step else value + step
    return target if value - target <= step else value - step


def single(value: float) -> float:
    """The nearest single-precision number, half to even; infinite beyond them.

    Compiled code has `pidcfg.sim.engine.compile.native_single` in its place.
    """
    SINGLE_CELL[0] = value
    return SINGLE_CELL[0]


def renew_alarm(status: int, bit: int, excess: float, hysteresis: float) -> int:
    """The status with one alarm bit renewed; ``excess`` is how far the PV is beyond the limit.

    Hysteresis acts on the way back (D46, D122).
    """
    if excess > 0.0:
        return status | bit
    if excess <= -hysteresis:
        return status & ~bit
    return status


# --- Notices that a kernel leaves for the log: numbered reasons, each with the requested mode -------------------------
#
# A notice is one number in a loop's state; several of them are its digits, the first one highest.

NOTICE_BASE = 4096
"""A notice is below this."""
NOTICE_LIMIT = 4096**4
"""Five notices fill a number; what comes after them is left out until the log has been read."""
REASON_BITS = 9
"""A notice is a reason, and above these bits the requested mode (`Plc.request_code`; 0: nobody requested one)."""
REQUEST_BITS = 3
"""Room for the requested mode: a bit for each of three modes, or a number up to 7."""
GOAL_ENDED = (
    "the loop had not yet been in its configured mode for a sample: that mode is not requested any more, and a "
    "configured set point is not written"
)
"""What a mode request of an event puts an end to (D643); the reason's number is the vendor's."""


def add_notice(notice: int, requested_mode: int, reason: int) -> int:
    """The notices with one more (kernel)."""
    if notice < NOTICE_LIMIT:
        return notice * NOTICE_BASE + (requested_mode << REASON_BITS) + reason
    return notice


def tell_request(state: RequestState, reason: int) -> None:
    """Leave a notice about the mode that was requested last (kernel)."""
    state.notice = add_notice(state.notice, state.requested_mode, reason)


def leave_notice(state: LoopState, reason: int, requested_mode: int = 0) -> None:
    """Leave a notice for the log, from outside the kernels."""
    state.notice = add_notice(state.notice, requested_mode, reason)


def split_notices(notice: int) -> list[tuple[int, int]]:
    """A notice number as requested mode bits and reasons, in the order in which they were left."""
    pairs: list[tuple[int, int]] = []
    while notice:
        notice, digit = divmod(notice, NOTICE_BASE)
        pairs.insert(0, divmod(digit, 1 << REASON_BITS))
    return pairs
