"""What the CLICK rules look at; where registers lie, names, whether a loop runs at all, and what its autotune needs.

Values are worked out from the model's own blocks, not read back from the image: where blocks overlap, the image holds
only one of them. Each is worked out once, when the first rule asks for it.
"""

from __future__ import annotations

from decimal import Decimal
from functools import cache, cached_property
from typing import Any

from pidcfg.encoders.image import Block, Encoding, is_switched_on
from pidcfg.encoders.maps.click import BLOCKS, ERRORS, MAX_LOOPS, SPACE, SUFFIXES, PidError
from pidcfg.schemas import click as schema
from pidcfg.schemas.click import D100, ERROR_PREFIX, ClickFile, Loop
from pidcfg.schemas.numbers import decimal_text
from pidcfg.text.frozen import frozen
from pidcfg.text.references import CLICK, Decision
from pidcfg.validate import shared_checks
from pidcfg.validate.rule import Findings, checklist, error, info, per_loop, warning
from pidcfg.validate.shared_checks import (
    Context,
    Extent,
    Pair,
    SwitchedView,
    all_or_none,
    extents_of,
    find_shared_keys,
    list_names,
    number_with_unit,
)

WORDS_BY_NAME = {word.name: (i, word) for i, (_, table) in enumerate(BLOCKS.values()) for word in table.words}
"""Each register's block, counted in the order of the banks, and its row."""
BLOCK_ITEMS = tuple(BLOCKS.items())
NO_LIMIT = 100
"""Filter constant and derivative gain limit that filter nothing."""
NO_INTEGRAL = Decimal(1000)
"""The reset time in s from which the help takes the integral for removed."""


@frozen
class LoopView(SwitchedView[Loop]):
    """A loop, its place in the file, and what its registers hold."""

    blocks: tuple[Block, ...]

    def value(self, name: str) -> Any:
        """The value of a register, from the file or by default; None when there is none."""
        return self.blocks[0].encoded.values.get(str(WORDS_BY_NAME[name][1].path))

    @cached_property
    def misfits(self) -> frozenset[str]:
        """The registers that their values do not fit."""
        return frozenset(misfit.word.name for block in self.blocks for misfit in block.encoded.misfits)

    @cached_property
    def _register_values(self) -> dict[str, Decimal]:
        return {}

    def register_value(self, name: str) -> Decimal | None:
        """The number that a register holds, 0 where nothing is given; None when the value does not fit."""
        if name in self.misfits:
            return None
        if name not in self._register_values:
            block, word = WORDS_BY_NAME[name]
            self._register_values[name] = Decimal(word.decode(self.blocks[block].encoded.words[word.offset]))
        return self._register_values[name]

    def register_values(self, *names: str) -> list[Decimal]:
        """The numbers of several registers; empty as soon as one does not fit (which another rule reports)."""
        return all_or_none(map(self.register_value, names))

    def register(self, name: str) -> str:
        """The address of one of the loop's registers: ``DF107``."""
        block, word = WORDS_BY_NAME[name]
        key, (prefix, _) = BLOCK_ITEMS[block]
        return f"{prefix}{getattr(self.loop, key) + word.offset}"

    def quote(self, name: str) -> str:
        """A register's value as a message quotes it, marked where the file does not give it."""
        value = self.register_value(name)
        text = "out of its range" if value is None else self.eu(value)
        return f"{text} (not given)" if self.value(name) is None else text

    def eu(self, value: Decimal) -> str:
        """A number in the PV's unit."""
        return number_with_unit(value, self.loop.pv.unit)

    def distance(self, value: Decimal) -> str:
        """A difference in the PV's unit."""
        return self.eu(value)

    def co_text(self, value: Decimal) -> str:
        """A number in the output's unit."""
        return number_with_unit(value, self.loop.output.unit or "%")

    @cached_property
    def extents(self) -> tuple[Extent, ...]:
        """The registers of its three blocks."""
        return extents_of(self.loop, BLOCKS)

    @cached_property
    def errors(self) -> tuple[PidError, ...]:
        """The PID errors that the loop's values cause, in the order of their numbers."""
        return tuple(error for error in ERRORS if self._is_caused(error))

    def has_no_error_at(self, *names: str) -> bool:
        """Whether none of these registers causes a PID error, which is reported by itself."""
        return not {error.register for error in self.errors} & set(names)

    def _is_caused(self, error: PidError) -> bool:
        value = self.value(error.register) or Decimal(0)
        if value and (held := self.register_value(error.register)) is not None:
            value = held
        if error.upper_register is not None:
            ends = self.register_values(error.register, error.upper_register)
            return (
                bool(ends) and ends[0] > ends[1] and self.setpoint_limit_on("lower") and self.setpoint_limit_on("upper")
            )
        return (error.low is not None and value < error.low) or (error.high is not None and value > error.high)

    @property
    def rate_alarm_on(self) -> bool:
        """Whether the bit of the rate-of-change alarm is set."""
        alarms = self.loop.alarms
        return is_switched_on(alarms.rate_of_change_enabled, alarms.rate_of_change)

    def setpoint_limit_on(self, end: str) -> bool:
        """Whether the set point's ``lower`` or ``upper`` limit is enabled."""
        setpoint = self.loop.setpoint
        return is_switched_on(getattr(setpoint, f"{end}_limit_enabled"), getattr(setpoint, f"{end}_limit"))

    @property
    def error_squared_on(self) -> bool:
        """Whether the error is squared."""
        return self.loop.error.curve == "squared"

    @property
    def integrates(self) -> bool:
        """Whether the reset time is short enough to mean an integral."""
        return self.loop.tuning.reset_time < NO_INTEGRAL

    @property
    def process_range(self) -> Pair | None:
        """The ends of the PV's range; None where it does not ascend (which a rule reports)."""
        low, high = self.loop.pv.range
        return (low, high) if low < high else None

    @property
    def span(self) -> Decimal | None:
        """The width of the PV's range; None where it does not ascend."""
        ends = self.process_range
        return None if ends is None else ends[1] - ends[0]


@frozen
class ClickContext(Context[ClickFile, Encoding]):
    """A configuration with its encoding, and its loops one by one."""

    @cached_property
    def loops(self) -> tuple[LoopView, ...]:
        """The loops in the order of the file."""
        count, blocks = len(BLOCKS), self.encoding.blocks
        return tuple(LoopView(i, loop, blocks[i * count : (i + 1) * count]) for i, loop in enumerate(self.config.loops))


# --- The blocks of registers: where they end, what they share, and how many loops there may be ------------------------

AREAS = CLICK.cite("C, DS and DF memory areas")
PWM = CLICK.cite("PWM Control")

D130 = Decision(
    130,
    "the banks end at C2000, DS4500 and DF500, and eight loops are the most",
    "A block that reaches past the last register of its bank is an error, and so is a ninth loop.",
    "The topic prints how long the blocks are; how large the banks are, and how many loops there may be, are the PLC's "
    "own figures.",
)
LAST_ADDRESSES = {bank.prefix: bank.last for bank in SPACE.banks}


@per_loop
@error(
    "CK301",
    D130,
    "{block} would occupy {extent}, but the bank ends at {prefix}{last}: it may begin at {prefix}{latest} at "
    "the latest",
)
def block_beyond_bank(view: LoopView) -> Findings:
    """A block of registers reaches past the end of its bank.

    Why: a loop needs 40 consecutive C bits, 15 consecutive DS registers and 25 consecutive DF registers. What lies past
    the last register does not exist: the programming software refuses the loop, and a writer of the image fails.

    Fix: let the block begin no later than C1961, DS4486 or DF476.
    """
    return shared_checks.block_beyond_bank(view, LAST_ADDRESSES)


@error("CK302", AREAS, "{block} {extent} of {loop} overlap {other_extent} of {other}")
def blocks_overlap(context: ClickContext) -> Findings:
    """Two loops share registers.

    Why: each loop writes its own output, error number and alarm bits into its block, and reads its tuning from there.
    Two loops in one block change each other's gains and set points.

    Fix: leave 40 C bits, 15 DS registers and 25 DF registers to every loop. Steps of 100 in all three banks are easy to
    remember.
    """
    return shared_checks.blocks_overlap(context.loops)


@error("CK303", D130, "{count} loops are listed; a CLICK PLC calculates at most {limit}")
def too_many_loops(context: ClickContext) -> Findings:
    """The file has more loops than the PLC.

    Why: the programming software offers eight loops; nothing calculates a ninth one.

    Fix: move the loop to another PLC, and to a file of its own.
    """
    return shared_checks.too_many_loops(context.loops, MAX_LOOPS)


@error("CK304", PWM, "{bit} is also the PWM output of {others}: two loops would switch it")
def pwm_output_shared(context: ClickContext) -> Findings:
    """Two loops pulse the same discrete output.

    Why: both write the bit, and what the actuator sees is neither loop's output.

    Fix: give each loop a discrete output of its own.
    """
    pulsed = ((view.loop.output.pwm.bit, view) for view in context.loops if view.loop.output.pwm is not None)
    for bit, view, others in find_shared_keys(pulsed):
        yield view.report("output", "pwm", "bit", bit=bit, others=list_names(others)).with_other_loops(*others)


# --- Names of loops as the beginning of nicknames ---------------------------------------------------------------------

D131 = Decision(
    131,
    "what the PLC accepts as a nickname",
    "At most 24 characters, no underscore at the beginning, none of % \" < > ! # $ & ' ( ) * + - . / : ; = ? @ [ \\ ] "
    "^ ` { | } ~ and nothing but ASCII anywhere; capital and small letters are one. A name that breaks "
    "this is a warning.",
    "The topic is silent; these are the limits of the programming software as pyclickplc, another writer of its files, "
    "knows them. Registers need no nickname, so the loop itself works.",
)

MAX_NICKNAME_LENGTH = 24
REFUSED_CHARS = frozenset("%\"<>!#$&'()*+-./:;=?@[\\]^`{|}~")
MAX_NAME_LENGTH = MAX_NICKNAME_LENGTH - max(map(len, SUFFIXES.values()))
"""How long a name may be so that every nickname fits."""


@cache
def suffixes_by_length() -> tuple[str, ...]:
    """The suffixes, the longest first."""
    return tuple(sorted(SUFFIXES.values(), key=lambda suffix: (-len(suffix), suffix)))


@per_loop
@warning(
    "CK305",
    D131,
    "the name has {length} characters: {count} of its nicknames would have more than 24, as {example} with {longest}",
)
def nickname_too_long(view: LoopView) -> Findings:
    """The name of a loop is too long for its nicknames.

    Why: a nickname is the loop's name and a suffix such as `_SEL_DirectReverse`, and may have 24 characters. The
    software refuses longer ones, or two that are cut off become the same.

    Fix: choose a name of at most 6 characters.
    """
    name = view.name
    long_suffixes = [suffix for suffix in suffixes_by_length() if len(name) + len(suffix) > MAX_NICKNAME_LENGTH]
    if long_suffixes:
        example = name[:MAX_NAME_LENGTH] + "…" if len(name) > MAX_NICKNAME_LENGTH else name
        yield view.report(
            "name",
            length=len(name),
            count=len(long_suffixes),
            example=example + long_suffixes[0],
            longest=len(name) + len(long_suffixes[0]),
        )


@per_loop
@warning("CK306", D131, "nicknames cannot be made of {name}: {reason}")
def name_not_usable_in_nicknames(view: LoopView) -> Findings:
    """The name of a loop has characters that the PLC does not allow in nicknames.

    Why: tags such as FIC-101 are common on drawings, but a nickname may contain none of - . / #, and may not begin with
    an underscore. The software refuses the whole list of nicknames.

    Fix: write the tag with letters, digits, blanks and underscores: `FIC101`. The tag on the drawing can stand in
    `description`.
    """
    name = view.name
    wrong = sorted(c for c in set(name) if c in REFUSED_CHARS or not c.isascii())
    if wrong:
        yield view.report("name", name=name, reason=f"{' '.join(wrong)} {'is' if len(wrong) == 1 else 'are'} refused")
    elif name.startswith("_"):
        yield view.report("name", name=name, reason="it begins with an underscore")


@warning("CK307", D131, "{mine} of this loop and {theirs} of loop {other} are one nickname")
def nicknames_collide(context: ClickContext) -> Findings:
    """Two loops have nicknames that are the same for the PLC.

    Why: it does not tell capital from small letters, so `Oven` and `OVEN` have all nicknames in common; and `T1_EN` has
    a nickname of `T1`. A list of nicknames with one twice is refused.

    Fix: rename one of the loops.
    """
    owners: dict[str, dict[str, str]] = {}
    for view in context.loops:
        for suffix in SUFFIXES.values():
            nickname = view.name + suffix
            owners.setdefault(nickname.lower(), {})[view.name] = nickname
    for view in context.loops:
        shared = (owners[(view.name + suffix).lower()] for suffix in SUFFIXES.values())
        pairs = {other: (group[view.name], group[other]) for group in shared for other in group if other != view.name}
        for other, (mine, theirs) in pairs.items():
            yield view.report("name", mine=mine, theirs=theirs, other=other).with_other_loops(other)


# --- What decides whether a loop runs at all, and which way: its action, and the PID errors that its values cause -----

MANUAL = CLICK.cite("Manual Mode")
ACTION_LABELS = {"direct": "Forward", "reverse": "Reverse"}
PV_MOVEMENTS = {"direct": "rises", "reverse": "falls"}


def pid_error_text(number: int) -> str:
    """What the PLC reports."""
    return f"{ERROR_PREFIX}{number}"


@per_loop
@warning(
    "CK308",
    D100,
    "action {action} is written as {bit} to {register}, which the help does not confirm: verify "
    "Forward/Reverse in the PID window before Auto; it must show {shown} (the PV {moves} when the output rises)",
)
def action_not_verified(view: LoopView) -> Findings:
    """The action of a loop rests on a reading of the bit that has not been compared with the PLC.

    Why: the help does not print which state of Cn+09 is forward and which is reverse. The wrong one turns every
    correction round: the loop drives its output to a limit and stays there, which is a runaway heater.

    Fix: before the first Auto, compare Forward/Reverse in the PID window with `action`, then write
    `action_verified: true`; the warning goes away with it.
    """
    action = view.loop.action
    if not view.loop.action_verified:
        yield view.report(
            "action",
            register=view.register("action"),
            bit=int(action == "reverse"),
            action=action,
            shown=ACTION_LABELS[action],
            moves=PV_MOVEMENTS[action],
        )


@per_loop
@error(
    "CK309",
    schema.PID_ERRORS,
    "{register} shows {shown} alone; once that is cured it shows {others}, and until then the loop stays in Manual",
)
def several_pid_errors(view: LoopView) -> Findings:
    """A loop has more than one PID error, of which the PLC shows one.

    Why: the error register holds the lowest number that is active; the next one appears only when it is cleared. Who
    cures what is shown and believes to be done meets the next error.

    Fix: correct all values that are reported for this loop before the download.
    """
    if len(view.errors) > 1:
        first, *more = view.errors
        others = ", then ".join(str(error.number) for error in more)
        yield view.report_key(
            plc_effect=pid_error_text(first.number),
            register=view.register("error_code"),
            shown=f"error {first.number} ({first.title})",
            others=others,
        )


@per_loop
@info("CK310", MANUAL, "mode is auto, but error {number} ({title}) in {register} keeps the loop in Manual")
def auto_with_pid_error(view: LoopView) -> Findings:
    """A loop that is meant for Auto has a value that causes a PID error.

    Why: a PID error puts the loop into Manual, and the request for Auto is granted only when there is none.

    Fix: correct the value that is reported for this loop.
    """
    if view.loop.mode == "auto" and len(view.errors) == 1:
        error = view.errors[0]
        yield view.report(
            "mode",
            plc_effect=pid_error_text(error.number),
            number=error.number,
            title=error.title,
            register=view.register("error_code"),
        )


@per_loop
@info("CK320", MANUAL, "mode is auto, but every start of the PLC leaves the loop in Manual until {register} is set")
def auto_is_not_downloaded(view: LoopView) -> Findings:
    """A loop is meant for Auto, which no download can bring about.

    Why: the change from STOP to RUN puts all loops into Manual, and the request for Auto is a momentary bit, so it is
    written as 0. After a power failure the loops stay in Manual until somebody notices.

    Fix: let the ladder program set the request once the plant is ready, or tell the operators.
    """
    if view.loop.mode == "auto" and not view.errors:
        yield view.report("mode", register=view.register("auto_request"))


# --- What the autotune needs, and registers that the controller itself writes -----------------------------------------

TUNING = CLICK.cite("PID Autotuning")
OUTPUT = CLICK.cite("Control Output (DFn+08)")
RAW_PV = CLICK.cite("Raw Process Variable (DFn+11)")

D146 = Decision(
    146,
    "an autotune for PI leaves no derivative",
    "A derivative gain beside `autotune.type: PI` is an info.",
    "That the autotune sets the gains is printed; what it does with the derivative for PI is not.",
)
CO_RANGE = (Decimal(0), Decimal(100))
OUTSIDE_EFFECTS = {
    "bias": "the change to Auto replaces it by the output",
    "output": "the first sample in Auto brings it back",
}


@per_loop
@info("CK391", D146, "autotune.type is PI, but derivative_gain is {gain} s: an autotune would tune a loop without it")
def autotune_drops_derivative(view: LoopView) -> Findings:
    """An autotune for P and I is chosen for a loop with a derivative.

    Why: gains that were found for PI do not fit a loop that has a derivative as well; whether the PLC sets it to 0 is
    not printed.

    Fix: choose `type: PID`, or check the derivative gain after the autotune.
    """
    gain = view.loop.tuning.derivative_gain
    if view.loop.autotune.type == "PI" and gain > 0:
        yield view.report("autotune", "type", gain=decimal_text(gain))


@per_loop
@checklist("CK392", OUTPUT, "a closed-loop autotune moves the output between {low} and {high} only")
def autotune_between_narrow_limits(view: LoopView) -> Findings:
    """A closed-loop autotune is planned for a loop with narrowed output limits.

    Why: the output stays within its limits during the autotune too. Narrow ones make the PV's swing smaller, so that
    noise counts for more.

    Fix: see that the PV moves clearly; otherwise widen the limits while tuning, or use the open-loop method.
    """
    limits = view.register_values("output_lower", "output_upper")
    planned = "autotune" in view.loop.model_fields_set and view.loop.autotune.method == "closed"
    if planned and limits and 0 <= limits[0] < limits[1] and (limits[0] > CO_RANGE[0] or limits[1] < CO_RANGE[1]):
        yield view.report("autotune", "method", low=view.co_text(limits[0]), high=view.co_text(limits[1]))


@per_loop
@info("CK393", OUTPUT, "{register} holds {value}, outside the output limits {low} to {high}: {effect}")
def stored_output_outside_limits(view: LoopView) -> Findings:
    """The output or bias that is stored lies outside the output limits.

    Why: the limits have no effect in Manual, so the output may stand there. On the change to Auto the bias takes the
    output's value, and the output jumps to its limit.

    Fix: bring the output inside its limits before the change to Auto, or leave `state` out.
    """
    limits = view.register_values("output_lower", "output_upper")
    for name in ("bias", "output"):
        value = view.register_value(name)
        inside = not limits or limits[0] >= limits[1] or value is None or limits[0] <= value <= limits[1]
        if getattr(view.loop.state, name) is not None and value is not None and not inside:
            effect = OUTSIDE_EFFECTS[name]
            yield view.report(
                "state",
                name,
                effect=effect,
                register=view.register(name),
                value=view.co_text(value),
                low=view.co_text(limits[0]),
                high=view.co_text(limits[1]),
            )


@per_loop
@info("CK394", RAW_PV, "state.pv is {pv} and state.raw_pv is {raw}, but without a filter both are the same")
def stored_pv_differs_from_raw(view: LoopView) -> Findings:
    """PV and raw PV differ in a loop without a filter.

    Why: when the filter is off the PV equals the raw PV, so one of the two values is from another time. The PLC writes
    its own at the first sample.

    Fix: leave `state` out, or give both the same value.
    """
    state = view.loop.state
    if state.pv is not None and state.raw_pv is not None and state.pv != state.raw_pv and not view.pv_filter_on:
        yield view.report("state", "pv", pv=view.eu(state.pv), raw=view.eu(state.raw_pv))
