"""What a loop does when it is switched or limited: the same on both sides, or a line of the report."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import Enum
from typing import TYPE_CHECKING, Any, Protocol

from pidcfg.conversion import Change
from pidcfg.conversion.builder import ZERO, backward_factor, filter_factor, filter_time, quotient, round_computed
from pidcfg.text.frozen import frozen
from pidcfg.text.references import Decision

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence
    from decimal import Decimal

    from pidcfg.conversion import Kind, NeutralLoop, TargetFile
    from pidcfg.encoders.contract import HasModules
    from pidcfg.encoders.image import Settings
    from pidcfg.schemas.generic import GenericFile, Loop
    from pidcfg.text.paths import Data

# --- Decisions on what a conversion says of a loop that is switched, limited or stopped -------------------------------

D341 = Decision(
    341,
    "a conversion compares what an operator sees",
    "How a loop starts, what its output does on the way to Manual and to Auto, what its integral does at a limit, what "
    "a deadband does, what refuses Auto, and what a master does while its slave has another set point. An output that "
    "jumps where it stayed, a bias that is not taken over, an integral that runs further and a master that no longer "
    "follows are losses; a start in another mode, a change to Auto with the error's action on top, and other rules "
    "are named.",
    "The first can move a valve to 0 or leave an offset for good; the others an operator sees and can wait for.",
)
D342 = Decision(
    342,
    "an integral that has an end gets anti-windup where it would have none",
    "DL06 and CLICK keep their bias within the range or the limits of the output without their freeze, too; EZLogix "
    "and the neutral form without anti-windup let it run without end. Their anti-windup is therefore switched on, and "
    "the report says so.",
    "An integral that runs without end holds the output at its limit for as long again as it was there.",
)
D343 = Decision(
    343,
    "the filter of a derivative keeps its time constant, and its first sample is named",
    "Of a step NextoPID and the neutral form let 1 - e^(-Ts/Tf) through in a sample, DL06, CLICK and DPIDE "
    "Ts/(Ts + Tf). The time constant is converted as it is; a line of the report names both shares, and the time "
    "constant with which the target's would be the source's.",
    "Both are first-order lags of the same time, and alike where Tf is many samples. With a Tf of one sample 63 % pass "
    "instead of 50 %: a kick that is a quarter larger is to be seen on a valve, and nothing is lost.",
)
D581 = Decision(
    581,
    "a conversion tells what a loop does from the start, in Manual, in each cycle and while its PLC is stopped",
    "A loop that begins in its mode begins with an integral of 0, one that waits in Manual goes on from its output. "
    "NextoPID and the neutral form keep the derivative up in Manual, the others begin it anew with Auto. A NextoPID "
    "filter is worked out in each cycle of its task, not with the samples of a slower loop. A DL06 loop that is "
    "independent of the CPU mode and an EZLogix with process_when_stopped control a process whose PLC is stopped: "
    "it is a loss where the source asks for it and the target stands still, else it is named.",
    "Each was found by running both sides: outputs differ by up to the whole range at the start, by gain x Td x the "
    "rate of the PV after Manual, and by what the PV does in half a sample. Only the EZLogix goes on by default, which "
    "nobody asked for: from it a conversion names that, to it the check box is cleared (D760).",
)
D928 = Decision(
    928,
    "a loop in Manual begins in the target with the output that it has in the source",
    "NextoPID, DPIDE and the neutral form hold their limits in Manual, too, and begin at 0 of the output's unit; DL06, "
    "EZLogix and CLICK have no limits there and begin at 0 % of the range. Where the target would begin with another "
    "output, the one of the source is written; a line names the rule.",
    "A NextoPID loop in Manual with MinMV 12.5 sends 12.5 %; the CLICK that was made of it sent 0 %, and every line "
    "said exact.",
)

# --- What a loop does when it is switched or limited: the same on both sides, or a line of the report -----------------
#
# Design. Each vendor says of each of its loops how it starts, what becomes of its output on the way to Manual and
# back, what its integral does at a limit, and so on (`operations`, one module a vendor). The source's answers are
# held against those of the file that was written, rule by rule (`differing_rules`); no adapter has to remember
# another vendor's habits. Answers have a rank: a target that does worse than the source is a loss, another difference
# is named.

PREFIX = "operation."
"""Of the fields of the report's lines."""
ADDED_ANTI_WINDUP = "without it the integral would run without end, which the source's does not"


class Answer(Enum):
    """What a loop does, in words, and what to do about it in a target that does it."""

    def __init__(self, text: str, advice: str = "") -> None:
        self.text, self.advice = text, advice


class Start(Answer):
    """Which mode a loop has when its PLC begins to run."""

    WAITS = "it waits in Manual", "request its mode after each start of the PLC"
    RETURNS = (
        "it waits in Manual after the download, and later begins in the mode that it had",
        "request its mode once; switch it to Manual before the PLC stops where it has to wait for somebody",
    )
    RUNS = (
        "it begins in its mode, with an integral of 0",
        "keep it in Manual in the program where it has to wait for somebody",
    )


class Manual(Answer):
    """What the output does on the way from Auto to Manual."""

    STAYS = "the output stays where it is", "write the value that stood ready after the change to Manual"
    JUMPS = "the output goes to the value that stands ready", "copy MV to ManualMV in the program while in automatic"


class Hand(Answer):
    """What limits an output in Manual."""

    LIMITED = "the limits of the output hold in Manual, too", "set an output within the limits"
    FREE = "in Manual the output may be beyond its limits", "set an output within the limits"


class Zero(Answer):
    """With which output and integral a loop begins that is given none."""

    OF_RANGE = "it begins at 0 % of the output's range, whatever its bias", "set the output in Manual"
    OF_UNIT = "it begins at 0 in the output's unit, with its bias on top", "set the output in Manual"


class Transfer(Answer):
    """What the output does on the way from Manual to Auto."""

    GOES_ON = "the output goes on from where it stands"
    ON_TOP = "the integral becomes the output, and gain x error comes on top", "bring the PV to the set point before"
    AS_BEFORE = "the integral is what it was before Manual", "bring the output back to where it was before"


class WithoutIntegral(Answer):
    """What the output of a loop without an integral does on the way from Manual to Auto."""

    TAKEN_OVER = "the bias becomes the output", "bring the output to the bias in Manual before going to Auto"
    CONSTANT = "the output becomes gain x error + bias", "write the output that holds the set point into the bias"


class Rate(Answer):
    """What the derivative does in Manual."""

    KEPT_UP = "it is kept up in Manual", "bring the PV to rest in Manual before going to Auto"
    ANEW = "it begins anew with Auto", "bring the PV to rest in Manual before going to Auto"


class Filter(Answer):
    """How often the filter of the PV is worked out."""

    SAMPLED = "with each sample of the loop"
    CYCLIC = "in each cycle of the task, so that a PV on its way comes later by up to half a sample"


STOP_ADVICE = "switch that off where the process must stand still with the PLC"


class Stopped(Answer):
    """What a loop does while its PLC is stopped."""

    UNSAID = "nothing says whether it goes on", "see to it in the PLC"
    STANDS = "it stands still", "let the output module hold, or bring to a safe value, what the process needs"
    GOES_ON = "it goes on controlling", STOP_ADVICE
    AS_GIVEN = "it goes on controlling, as a PLC of this family does", STOP_ADVICE

    @property
    def goes_on(self) -> bool:
        """Whether it controls."""
        return self in {Stopped.GOES_ON, Stopped.AS_GIVEN}


OVERSHOOT_ADVICE = "expect more overshoot after the output was at a limit"


class Windup(Answer):
    """What the integral does while the output is at a limit; the further it runs, the higher its rank."""

    def __init__(self, rank: int, text: str) -> None:
        super().__init__(text, OVERSHOOT_ADVICE if rank else "")
        self.rank = rank

    NONE = 0, "the velocity form has no integral of its own"
    FROZEN = 0, "it stops while the output is at a limit"
    HELD_BEYOND = 0, "it takes no step that leaves the output beyond a limit"
    CONDITIONAL = 0, "it stops where the error drives the output further beyond a limit"
    PARTIAL = 0, "it takes what does not push the output beyond a limit"
    WORKED_OUT = 0, "it is worked out of the limited output"
    WITHIN_LIMITS = 1, "it goes on to the limits of the output"
    FROZEN_AT_ENDS = 2, "it stops while the output is at an end of its range"
    CONDITIONAL_AT_ENDS = 2, "it stops where the error drives the output further beyond an end of its range"
    WITHIN_RANGE = 3, "it goes on to the ends of the output's range"
    ENDLESS = 4, "it goes on without end"


class Deadband(Answer):
    """What a deadband does."""

    AS_ZERO = "the error counts as 0"
    CROSSED = "the error counts as 0 once the PV has crossed the set point"
    ONLY_BIAS = "the output is the bias, without the other actions"
    HELD = "the output is held"


class Smoothing(Answer):
    """How the filter of the derivative is worked out: what it lets through of a change in a sample."""

    EXACT = "a sample lets 1 - e^(-Ts/Tf) of a change through"
    BACKWARD = "a sample lets Ts/(Ts + Tf) of a change through"

    def pass_share(self, time: Decimal, sample_time: Decimal) -> Decimal:
        """What a sample lets through with a time constant."""
        return filter_factor(time, sample_time) if self is Smoothing.EXACT else backward_factor(sample_time, time)

    def time(self, factor: Decimal, sample_time: Decimal) -> Decimal:
        """The time constant with which a sample lets a share through."""
        return (
            filter_time(factor, sample_time)
            if self is Smoothing.EXACT
            else round_computed(quotient(sample_time, factor) - sample_time)
        )


class Interlock(Answer):
    """What refuses Auto."""

    GRANTED = "Auto is granted whatever the PV is", "keep the loop in Manual in the program while a PV alarm is on"
    REFUSED = "Auto is refused while a PV alarm is on", "bring the PV between its alarms in Manual"


class Master(Answer):
    """What an outer loop does while its inner loop has another set point."""

    FOLLOWS = "its output follows the inner loop"
    MANUAL = "it goes to Manual", "switch it to Auto again after its inner loop is in Cascade"
    INTEGRATES = "it goes on integrating", "switch it to Manual first, and bring its output to the inner set point"


@frozen
class VendorSettings:
    """What a conversion within a vendor keeps, which the neutral form does not know."""

    addresses: tuple[str, ...] = ()
    """Where loops stand; with an option, which may move them, none of these is kept."""
    choices: Mapping[str, str] = field(default_factory=dict)
    """What belongs to the PLC and its modules, each with the option that says otherwise; empty: none does."""
    scale_options: Callable[[Any, Sequence[int]], Data] = lambda _config, _kept: {}
    """Options that gains and times depend on, as the loops at some places of a file have them."""
    hand: Hand = Hand.LIMITED
    zero: Zero = Zero.OF_UNIT


@dataclass(frozen=True, slots=True, kw_only=True)
class Operation:
    """The rules of one loop."""

    start: Start = Start.RUNS
    manual: Manual = Manual.STAYS
    hand: Hand = Hand.LIMITED
    zero: Zero = Zero.OF_UNIT
    transfer: Transfer = Transfer.GOES_ON
    without_integral: WithoutIntegral = WithoutIntegral.CONSTANT
    windup: Windup
    deadband: Deadband = Deadband.AS_ZERO
    has_edge: bool = False
    """Whether an error as large as the deadband lies in it."""
    squares_error: bool = False
    """Whether the error is squared, as a share of the range and with its sign."""
    slowest_integral: Decimal = ZERO
    """The integral time in s of a loop that has none, where a PLC cannot do without; 0: it can."""
    leads_master: bool = False
    """Whether its PV becomes the output of its master when it goes to Cascade."""
    moves_by_hand: bool = False
    """Whether the fastest change of its output holds in Manual, too."""
    limits_master: bool = False
    """Whether the limits of its set point hold its master's output, too."""
    follows_output: bool = False
    """Whether its integral is worked out of the output all the time in Manual, and not of the first sample in Auto."""
    keeps_following: bool = False
    """Whether a set point that follows the PV does so all the time in Manual, a sample late, and not at Auto alone."""
    smoothing: Smoothing | None = Smoothing.BACKWARD
    """None: the derivative has no filter."""
    rate: Rate = Rate.ANEW
    filter: Filter = Filter.SAMPLED
    interlock: Interlock = Interlock.GRANTED
    master: Master = Master.INTEGRATES
    stopped: Stopped = Stopped.STANDS

    @property
    def bounds_integral(self) -> bool:
        """Whether the integral has an end."""
        return self.windup is not Windup.ENDLESS


def differing_rules(before: Operation, after: Operation, loop: Loop, *, is_master: bool) -> Iterator[Change]:
    """A line for each rule that is another one in the target; ``is_master``: both sides have a loop that reads it."""
    has_integral = bool(loop.tuning.integral_time)
    if loop.mode != "manual":
        yield from _rule_line("start", before.start, after.start)
    if before.stopped.goes_on != after.stopped.goes_on:
        yield from _rule_line("stopped", before.stopped, after.stopped, loss=before.stopped is Stopped.GOES_ON)
    yield from _rule_line("manual", before.manual, after.manual, loss=after.manual is Manual.JUMPS)
    if has_narrow_limits(loop):
        yield from _rule_line("hand", before.hand, after.hand)
    if (loop.output.range[0] or (has_integral and loop.output.bias)) and (
        loop.output.manual is None or loop.mode != "manual"
    ):
        yield from _rule_line("zero", before.zero, after.zero)
    if has_integral:
        jumps_back = after.transfer is Transfer.AS_BEFORE
        yield from _rule_line("transfer", before.transfer, after.transfer, loss=jumps_back)
        is_worse = _windup_rank(after.windup, loop) > _windup_rank(before.windup, loop)
        yield from _windup_lines(before.windup, after.windup, loop, loss=is_worse)
    else:
        bias_before, bias_after = before.without_integral, after.without_integral
        yield from _rule_line("transfer", bias_before, bias_after, loss=True, neutral="output.bias")
    if loop.deadband:
        yield from _rule_line("deadband", before.deadband, after.deadband)
    yield from _smoothing_lines(before.smoothing, after.smoothing, loop)
    if loop.tuning.derivative_time:
        yield from _rule_line("rate", before.rate, after.rate)
    if loop.pv.filter:
        yield from _rule_line("filter", before.filter, after.filter)
    yield from _rule_line("interlock", before.interlock, after.interlock)
    if is_master:
        integrates = after.master is Master.INTEGRATES
        yield from _rule_line("master", before.master, after.master, loss=integrates)


KICK_NOTE = (
    "a kick of the derivative that a limit cuts off goes into the {side} integral: "
    "after a step of the set point the PV goes another way"
)


def _windup_lines(before: Windup, after: Windup, loop: Loop, *, loss: bool) -> Iterator[Change]:
    """A line about the integral at a limit; with a derivative of the error, what becomes of its kick at a step."""
    kicks = bool(loop.tuning.derivative_time) and loop.tuning.derivative_on == "error"
    takes_kick = [side is Windup.WORKED_OUT for side in (before, after)]
    for change in _rule_line("windup", before, after, loss=loss, neutral="anti_windup"):
        if kicks and takes_kick[0] != takes_kick[1]:
            note = KICK_NOTE.format(side="source's" if takes_kick[0] else "target's")
            yield replace(change, note="; ".join(filter(None, (change.note, note))))
        else:
            yield change


def _windup_rank(windup: Windup, loop: Loop) -> int:
    """How far an integral runs: the ends of the range are the limits of an output that has no narrower ones."""
    narrow = has_narrow_limits(loop)
    at_ends = {Windup.FROZEN_AT_ENDS, Windup.CONDITIONAL_AT_ENDS, Windup.WITHIN_RANGE}
    return windup.rank - 2 if windup in at_ends and not narrow else windup.rank


def has_narrow_limits(loop: Loop) -> bool:
    """Whether the output has limits within its range."""
    return loop.output.limits is not None and loop.output.limits != loop.output.range


def first_output(rules: Operation | VendorSettings, loop: Loop) -> Decimal:
    """The output with which a loop begins in Manual."""
    output = loop.output
    bottom = output.range[0] if rules.zero is Zero.OF_RANGE else ZERO
    value = bottom if output.manual is None else output.manual
    if rules.hand is Hand.FREE:
        return value
    low, high = output.limits or output.range
    return min(max(value, low), high)


def _smoothing_lines(before: Smoothing | None, after: Smoothing | None, loop: Loop) -> Iterator[Change]:
    """A line about the filter of a derivative, with what that means at this sample time."""
    time, sample = loop.tuning.derivative_filter, loop.sample_time
    if before is None or after is None or before is after or not (time and loop.tuning.derivative_time):
        return
    share_before, share_after = (rule.pass_share(time, sample) for rule in (before, after))
    equal_time = after.time(share_before, sample)
    note = (
        f"{100 * share_after:.3g} % instead of {100 * share_before:.3g} %; with {equal_time:.3g} s it would be the same"
    )
    yield Change(f"{PREFIX}smoothing", "assumed", before.text, after.text, note=note)


def _rule_line(rule: str, before: Answer, after: Answer, *, loss: bool = False, neutral: str = "") -> Iterator[Change]:
    """A line where the answers differ; overshoot is to be expected of a loss only."""
    if before is after:
        return
    note = after.advice if loss or not isinstance(after, Windup) else ""
    kind: Kind = "dropped" if loss else "assumed"
    names = (neutral,) if neutral else ()
    yield Change(f"{PREFIX}{rule}", kind, before.text, after.text, note=note, loss=loss, neutral=names)


# --- What a vendor's modules have to give -----------------------------------------------------------------------------


class Source(Protocol):
    """``conversion.<vendor>``: from a configuration to the neutral form."""

    @property
    def OWN_SETTINGS(self) -> VendorSettings:  # noqa: N802 - a constant of the module
        """What a conversion within the vendor keeps."""

    @property
    def HARMLESS_FIELDS(self) -> Mapping[str, str]:  # noqa: N802 - a constant of the module
        """Keys that may be left out, and why nothing is lost then."""

    def to_neutral(self, config: Any, /) -> list[NeutralLoop]:
        """The loops in the neutral form."""

    def operations(self, config: Any, /) -> list[Operation]:
        """How each loop behaves where the neutral form says nothing."""


class Target(Protocol):
    """``conversion.<vendor>``: from the neutral form to a configuration."""

    def from_neutral(self, file: GenericFile, options: Settings, operations: Sequence[Operation] = (), /) -> TargetFile:
        """The configuration with the exact values."""


def source_of(vendor: HasModules) -> Source:
    """How a vendor's configurations become neutral."""
    source: Source = vendor.module("to_neutral")
    return source


def target_of(vendor: HasModules) -> Target:
    """How a vendor's configurations are made of neutral ones."""
    target: Target = vendor.module("from_neutral")
    return target
