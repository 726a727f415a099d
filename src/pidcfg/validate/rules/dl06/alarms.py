"""What the DL06 rules look at; alarm points in counts: their order, what is missing, and the hysteresis.

Worked out from the model, each value once: where blocks overlap, the image holds only one of them.
"""

from __future__ import annotations

from decimal import Decimal
from functools import cached_property
from typing import Any

from pidcfg.encoders.codecs import Position, Scale, bcd_digits, bcd_word, round_to_integer
from pidcfg.encoders.dl06.image import (
    LOOP_SIZE,
    OUTPUT_OFFSET,
    Setup,
    check_setup,
    loop_start,
    remote_setpoint,
    reset_value,
    scales_of,
)
from pidcfg.encoders.image import Block, Encoding, is_switched_on
from pidcfg.encoders.maps.dl06 import CPU, LOOP_TABLE, RESET
from pidcfg.schemas.base import Quantity, v_name
from pidcfg.schemas.dl06 import Dl06File, Loop, RampSoakStep
from pidcfg.schemas.numbers import decimal_text
from pidcfg.text.diagnostics import Severity
from pidcfg.text.frozen import frozen
from pidcfg.text.paths import Path
from pidcfg.text.references import DL06, Decision
from pidcfg.validate import shared_checks
from pidcfg.validate.rule import Finding, Findings, error, info, per_loop, warning
from pidcfg.validate.shared_checks import (
    PV_POINTS,
    Context,
    SwitchedView,
    all_or_none,
    exceeded_alarm,
    list_names,
    neighbours_out_of_order,
    number_text,
    value_or_switch_key,
)

WORDS = {word.name: word for word in LOOP_TABLE.words}
MAX_BCD = 9999


def counts_text(counts: Decimal | int) -> str:
    """``1 count``, ``205 counts``."""
    return f"{decimal_text(Decimal(counts))} count{'' if counts == 1 else 's'}"


@frozen
class RampSoakPair:
    """A ramp and its soak: their place in the list of steps, and what their four words hold (None: does not fit)."""

    index: int
    step: RampSoakStep
    target: int | None
    slope: Decimal | None
    soak: Decimal | None


@frozen
class LoopView(SwitchedView[Loop]):
    """A loop, its place in the file and in memory, and what its words hold."""

    config: Dl06File
    block: Block
    steps: tuple[Block, ...]

    @property
    def number(self) -> int:
        """The loop's number as the manual counts: from 1."""
        return self.index + 1

    @cached_property
    def scales(self) -> dict[str, Scale]:
        """The scales its registers are on: ``pv``, ``sp``, ``output``."""
        return scales_of(self.loop)

    def value(self, name: str) -> Any:
        """The value of a register, from the file or by default; None when there is none."""
        return self.block.encoded.values.get(str(WORDS[name].path))

    @cached_property
    def misfits(self) -> frozenset[str]:
        """The registers that their values do not fit."""
        return frozenset(misfit.word.name for misfit in self.block.encoded.misfits)

    def counts(self, name: str) -> int | None:
        """What a scaled register holds: signed counts, 0 where nothing is given; None when the value does not fit."""
        if name in self.misfits:
            return None
        word, codec = self.block.encoded.words[WORDS[name].offset], WORDS[name].codec
        return int(self.scales[codec.scale].format.codec.decode(word)) if isinstance(codec, Position) else word

    def digits(self, name: str) -> int:
        """What a BCD register holds, without its decimal point."""
        return bcd_digits(self.block.encoded.words[WORDS[name].offset])

    def register_values(self, *names: str) -> list[int]:
        """The counts of several registers; empty as soon as one of them does not fit (which another rule reports)."""
        return all_or_none(map(self.counts, names))

    @cached_property
    def pairs(self) -> tuple[RampSoakPair, ...]:
        """The steps of the ramp/soak profile that are written."""
        profile = self.loop.ramp_soak
        steps = () if profile is None or profile.steps is None else profile.steps
        return tuple(self._make_pair(j, step, self.steps[j]) for j, step in enumerate(steps))

    def _make_pair(self, j: int, step: RampSoakStep, block: Block) -> RampSoakPair:
        misfits = {misfit.word.name for misfit in block.encoded.misfits}
        target, slope, soak, _ = block.encoded.words
        codec = self.scales["sp"].format.codec
        return RampSoakPair(
            j,
            step,
            None if "ramp_to" in misfits else int(codec.decode(target)),
            None if "slope" in misfits else Decimal(bcd_digits(slope)) / 100,
            None if "soak" in misfits else Decimal(bcd_digits(soak)) / 10,
        )

    def quote(self, name: str) -> str:
        """A register's value as a message quotes it: ``2.5 m3/h (205 counts)``."""
        value = self.value(name)
        if value is None:
            return "0 counts (not given)"
        scale = WORDS[name].scale
        return str(value) if scale is None else self.text(value, scale, self.counts(name))

    def text(self, value: Quantity, scale: str, counts: int | None) -> str:
        """A quantity on one of the scales, with its counts."""
        if value.counts or self.scales[scale].range is None:
            return counts_text(value.value)
        part = self.loop.output if scale == "output" else self.loop.pv
        unit = f" {part.unit}" if part.unit else ""
        return f"{decimal_text(value.value)}{unit}" + ("" if counts is None else f" ({counts_text(counts)})")

    def eu(self, counts: int, scale: str = "pv") -> str:
        """Counts as a position in the user's unit."""
        return self.text(self.scales[scale].value(counts), scale, counts)

    def distance(self, counts: int) -> str:
        """Counts as a difference on the PV's scale in the user's unit."""
        return self.text(self.scales["pv"].span_value(counts), "pv", counts)

    def address_of(self, name: str) -> str:
        """The address of one of the loop's registers: ``V2013``."""
        return v_name(loop_start(self.config.plc, self.index) + WORDS[name].offset)

    def status_text(self, bit: int, meaning: str) -> str:
        """An effect that the loop's status word +06 shows."""
        return f"bit {bit} of {self.address_of('mode_and_alarm_status')} ({meaning})"

    @property
    def reset(self) -> Decimal | None:
        """The reset time in seconds; None when the integral term is off."""
        value = reset_value(self.loop)
        seconds = value * (60 if self.loop.tuning.reset_unit == "minutes" else 1)
        return seconds if value and value not in self.off_resets else None

    @property
    def off_resets(self) -> tuple[Decimal, ...]:
        """Reset times that are the off code 9999: as its digits read, and as the manual's text writes it."""
        return MAX_BCD * RESET[self.config.plc.reset_decimals].step, Decimal(MAX_BCD)

    @property
    def setpoint_limit_on(self) -> bool:
        """Whether the set point limits' bit is set."""
        return is_switched_on(self.loop.setpoint.limits_enabled, self.loop.setpoint.limits)

    def pv_counts_at(self, setpoint: int) -> int:
        """The counts of the PV at a set point: its square where the PV's root is taken."""
        return setpoint * abs(setpoint) if self.loop.pv.square_root else setpoint

    @property
    def is_bipolar(self) -> bool:
        """Whether the PV's format has a sign."""
        return self.scales["pv"].format.minimum < 0


@frozen
class Dl06Context(Context[Dl06File, Encoding]):
    """A configuration, its image, and its loops one by one."""

    @cached_property
    def loops(self) -> tuple[LoopView, ...]:
        """The loops in the order of the table."""
        loops, blocks = self.config.loops, self.encoding.blocks
        steps: dict[int, list[Block]] = {i: [] for i in range(len(loops))}
        for block in blocks[len(loops) : -1]:
            steps[int(block.path[1])].append(block)
        return tuple(LoopView(i, loop, self.config, blocks[i], tuple(steps[i])) for i, loop in enumerate(loops))

    @property
    def count(self) -> int:
        """The number of loops that V7641 holds."""
        count = self.config.plc.number_of_loops
        return len(self.config.loops) if count is None else count

    @cached_property
    def setup(self) -> Setup:
        """What the CPU makes of V7640 and V7641."""
        return check_setup(self.config.plc.loop_table, bcd_word(min(max(self.count, 0), MAX_BCD)))

    @property
    def counted_table(self) -> tuple[int, int]:
        """First and last address of the loop table as the CPU counts its loops."""
        return self.setup.start, self.setup.start + self.setup.count * LOOP_SIZE - 1

    @cached_property
    def table(self) -> tuple[int, int]:
        """First and last address of the loop table, of all loops that are listed or counted."""
        start = self.config.plc.loop_table
        return start, start + max(len(self.config.loops), self.count, 1) * LOOP_SIZE - 1

    @cached_property
    def majors(self) -> tuple[int | None, ...]:
        """For each loop the index of the loop whose output is its remote set point; None when there is none."""
        outputs = {loop_start(self.config.plc, i) + OUTPUT_OFFSET: i for i in range(len(self.config.loops))}
        pointers = (remote_setpoint(self.config, loop) for loop in self.config.loops)
        return tuple(None if pointer is None else outputs.get(pointer) for pointer in pointers)

    @cached_property
    def cascades(self) -> tuple[tuple[LoopView, LoopView], ...]:
        """Every pair of a major loop and its minor loop."""
        pairs = ((major, minor) for minor, major in enumerate(self.majors))
        return tuple((self.loops[m], self.loops[i]) for m, i in pairs if m is not None and m != i)

    @cached_property
    def explained_paths(self) -> frozenset[Path]:
        """Places whose limits a rule of the DL06's own explains better than the rules for every vendor."""
        resets = {
            ("loops", view.index, "tuning", "reset")
            for view in self.loops
            if reset_value(view.loop) in view.off_resets or "reset" in view.misfits
        }
        sides = [("loops", view.index, side) for view in self.loops for side in ("pv", "output")]
        transfers = {(*side, "transfer", "address") for side in sides}
        count = {("plc", "number_of_loops")} if self.count > CPU.loops else set()
        return frozenset({*resets, *transfers, *count})


# --- Alarm points: their order in counts, what is missing, and set points and rates that do not fit them --------------

ERROR = DL06.cite("Alarm Programming Error")
RATE = DL06.cite("PV Rate-of-Change Alarm")
HYSTERESIS = DL06.cite("PV Alarm Hysteresis")
RESOLUTION = DL06.cite("Determining a suitable sample rate (Addr+07), NOTE")
TROUBLE_TIPS = DL06.cite("Troubleshooting Tips")

D20 = Decision(
    20,
    "an alarm point that is not given is 0 counts",
    "One bit enables all four PV alarms, another both deviation alarms; the word of a point that is not given holds "
    "0 and is compared like any other.",
    "The loop table has no bit for a single alarm, and no value that means none.",
)
D21 = Decision(
    21,
    "a rate-of-change limit should be stored within 10 %",
    "A limit whose whole counts per sample differ from what is written by more than a tenth is a warning.",
    "The manual warns that fast sample rates diminish the resolution, and gives no number.",
)
MAX_RATE_ERROR = Decimal("0.1")

DEVIATION_POINTS = ("yellow", "red")


def manual_mode_effect(view: LoopView) -> str:
    """What the PLC does about alarm points in the wrong order."""
    return view.status_text(10, "alarm programming error") + ": the loop stays in Manual"


def order_finding(view: LoopView, group: str, low: str, high: str) -> Finding:
    """Two alarm points in the wrong order, both with their addresses."""
    low_name, high_name = f"{group}_{low}", f"{group}_{high}"
    texts = {name: f"{view.quote(name)} in {view.address_of(name)}" for name in (low_name, high_name)}
    return view.report(
        "alarms",
        group,
        high,
        plc_effect=manual_mode_effect(view),
        above=high,
        below=low,
        high=texts[high_name],
        low=texts[low_name],
    )


@per_loop
@error("DL242", ERROR, "{above} is {high}, not above {below}, {low}")
def pv_alarms_out_of_order(view: LoopView) -> Findings:
    """The PV alarm points do not ascend: the PLC wants low_low < low < high < high_high.

    Why: the comparison is made on the words. Points that differ in the file but round to the same counts are as wrong
    as crossed ones. The CPU sets the alarm programming error bit, and the loop will not go into Automatic mode.

    Fix: put the points in order, at least one count apart. To do without an outer alarm, place it at the end of the
    range.
    """
    if view.pv_alarms_on:
        for low, high, _ in neighbours_out_of_order(view, "pv"):
            if has_points(view, low, high):
                yield order_finding(view, "pv", low, high)


def has_points(view: LoopView, low: str, high: str) -> bool:
    """Whether the file gives two alarm points of the PV; others are 0 counts."""
    return view.value(f"pv_{low}") is not None and view.value(f"pv_{high}") is not None


@per_loop
@error("DL243", D20, "{missing} not given, so {words} {zero}, and one bit enables all four PV alarms: {effect}")
def pv_alarms_incomplete(view: LoopView) -> Findings:
    """Some of the four PV alarms are given, and the others count as 0.

    Why: bit 12 of +00 enables low_low, low, high and high_high together. A point that is left out is 0 counts: it
    breaks the order and keeps the loop in Manual, or, in a bipolar format, alarms in the middle of the range. Only a
    missing low_low of a unipolar PV does no harm (an info).

    Fix: give all four. An alarm that is not wanted goes to the end of the range, where the PV cannot pass it.
    """
    if not view.pv_alarms_on:
        return
    missing = [key for key in PV_POINTS if view.value(f"pv_{key}") is None]
    if missing:
        yield _missing_points_finding(view, missing)


def _missing_points_finding(view: LoopView, missing: list[str]) -> Finding:
    is_broken = any(not has_points(view, low, high) for low, high, _ in neighbours_out_of_order(view, "pv"))
    severity = Severity.ERROR if is_broken else Severity.WARNING if view.is_bipolar else Severity.INFO
    effect = {
        Severity.ERROR: "the order is broken",
        Severity.WARNING: "it alarms there",
        Severity.INFO: "it never alarms",
    }[severity]
    verb = "is" if len(missing) == 1 else "are"
    words = list_names([view.address_of(f"pv_{key}") for key in missing])
    return view.report(
        "alarms",
        "pv",
        missing[0],
        plc_effect=manual_mode_effect(view) if is_broken else None,
        severity=severity,
        missing=f"{list_names(missing)} {verb}",
        words=f"{words} {verb}",
        zero=view.eu(0),
        effect=effect,
    )


@per_loop
@error("DL244", ERROR, "{above} is {high}, not above {below}, {low}")
def deviation_alarms_out_of_order(view: LoopView) -> Findings:
    """The red deviation limit is not above the yellow one.

    Why: yellow is the caution, red the strong error, and the PLC wants yellow < red in counts. Otherwise it sets the
    alarm programming error bit, and the loop will not go into Automatic mode. A red limit that is left out is 0 counts.

    Fix: give both limits, red at least one count above yellow.
    """
    if view.deviation_alarms_on:
        for low, high, _ in neighbours_out_of_order(view, "deviation", DEVIATION_POINTS):
            yield order_finding(view, "deviation", low, high)


@per_loop
@error(
    "DL245",
    HYSTERESIS,
    "the yellow deviation limit is {value}: no hysteresis is less, and once on, the alarm stays on",
)
def deviation_alarm_of_zero(view: LoopView) -> Findings:
    """The yellow deviation limit is 0 counts, given so or left out.

    Why: one bit enables both deviation alarms. The hysteresis, 1 count at least, must be less than the limit. With 0
    the yellow alarm comes with the first count off the set point, and no PV is near enough to clear it.

    Fix: give a yellow limit that the loop normally keeps.
    """
    words = view.register_values("deviation_yellow", "deviation_red")
    if view.deviation_alarms_on and words and words[0] == 0 < words[1]:
        yield view.report("alarms", "deviation", "yellow", value=view.quote("deviation_yellow"))


@per_loop
@error(
    "DL246",
    RESOLUTION,
    "the rate-of-change limit {value} is {exact} counts a sample of {sample} s and is stored as 0: every "
    "change of the PV alarms; one count a sample is {least} /min",
)
def rate_of_change_limit_of_zero(view: LoopView) -> Findings:
    """The rate-of-change limit is less than half a count per sample and rounds to 0.

    Why: the limit is specified in PV counts per sample period. At 50 ms one count is already 1200 counts a minute:
    nothing slower can be told from 0, and with 0 any movement is an alarm.

    Fix: sample more slowly, use the 15-bit format, or raise the limit.
    """
    if rate_alarm_on(view) and view.counts("rate_of_change") == 0:
        yield view.report(
            "alarms",
            value_or_switch_key(view.loop.alarms, "rate_of_change"),
            value=rate_text(view),
            exact=f"{float(rate_in_counts(view)):.2g}",
            sample=decimal_text(view.loop.sample_rate),
            least=one_count_per_minute(view),
            fix=None
            if rate_in_counts(view)
            else "give a limit, of one count a sample at least, or switch the alarm off",
        )


def rate_alarm_on(view: LoopView) -> bool:
    """Whether the bit of the rate-of-change alarm is set."""
    alarms = view.loop.alarms
    return view.loop.sample_rate > 0 and is_switched_on(alarms.rate_of_change_enabled, alarms.rate_of_change)


def rate_text(view: LoopView) -> str:
    """The limit as it is written."""
    rate = view.loop.alarms.rate_of_change
    counts = " counts" if rate is not None and rate.counts else ""
    return "(no value)" if rate is None else f"{number_text(rate.value)}{counts} /{rate.per}"


def rate_in_counts(view: LoopView) -> Decimal:
    """The limit in counts per sample, not yet rounded."""
    rate = view.loop.alarms.rate_of_change
    return Decimal(0) if rate is None else view.scales["pv"].distance(rate.per_sample(view.loop.sample_rate))


def one_count_per_minute(view: LoopView) -> str:
    """What one count per sample is in a minute, in the user's unit."""
    scale, counts = view.scales["pv"], 60 / view.loop.sample_rate
    if scale.range is None:
        return f"{float(counts):.4g} counts"
    unit = f" {view.loop.pv.unit}" if view.loop.pv.unit else ""
    return f"{float(counts * scale.width / scale.full_counts):.4g}{unit}"


@per_loop
@warning("DL507", RATE, "the rate-of-change limit {value} is {counts} counts a sample, the whole range: it never trips")
def rate_of_change_limit_never_reached(view: LoopView) -> Findings:
    """The rate-of-change limit is as wide as the span of the PV.

    Why: the alarm comes when the PV changes by more than the limit within one sample, and no PV can. A broken wire,
    which this alarm is for, stays unseen.

    Fix: choose a limit that a broken sensor passes and the process does not; or switch the alarm off.
    """
    counts = view.counts("rate_of_change")
    if rate_alarm_on(view) and counts is not None and counts >= view.scales["pv"].format.span:
        yield view.report("alarms", "rate_of_change", value=rate_text(view), counts=counts)


@per_loop
@warning(
    "DL247",
    D21,
    "the rate-of-change limit {value} is {exact} counts a sample of {sample} s and is stored as {counts}, "
    "{percent} % off; one count a sample is {least} /min",
)
def rate_of_change_limit_coarse(view: LoopView) -> Findings:
    """The rate-of-change limit is so few counts per sample that rounding changes it by more than a tenth.

    Why: an excessively fast sample rate diminishes the resolution of this alarm, because its value is the change per
    sample period in whole counts.

    Fix: sample more slowly, use the 15-bit format, or choose a limit that is a whole number of counts.
    """
    counts = view.counts("rate_of_change")
    if rate_alarm_on(view) and counts:
        exact = rate_in_counts(view)
        error = abs(counts - exact) / exact
        if error > MAX_RATE_ERROR:
            yield view.report(
                "alarms",
                "rate_of_change",
                value=rate_text(view),
                exact=f"{float(exact):.2f}",
                sample=decimal_text(view.loop.sample_rate),
                counts=counts,
                percent=f"{100 * float(error):.0f}",
                least=one_count_per_minute(view),
            )


@per_loop
@warning(
    "DL248",
    TROUBLE_TIPS,
    "the set point {value} is beyond the {alarm} alarm at {limit}: on its set point the loop is in alarm",
)
def setpoint_in_alarm(view: LoopView) -> Findings:
    """The set point lies beyond a PV alarm point.

    Why: a loop that controls well then stands in alarm. While a PV alarm exists, the loop will not go into Automatic
    mode: it is the first cause in the manual's troubleshooting section.

    Fix: move the set point or the alarm.
    """
    setpoint = view.counts("setpoint")
    if view.loop.setpoint.value is None or setpoint is None:
        return
    raw = view.pv_counts_at(setpoint)
    alarm = exceeded_alarm(view, raw)
    if alarm is not None:
        squared = f", a raw PV of {counts_text(raw)}," if view.loop.pv.square_root else ""
        yield view.report(
            "setpoint", "value", value=view.quote("setpoint") + squared, alarm=alarm, limit=view.quote(f"pv_{alarm}")
        )


# --- The alarm hysteresis: its range, and what it must stay below -----------------------------------------------------

FEATURES = DL06.cite("Alarm Feature Specifications, Deadband")

D22 = Decision(
    22,
    "hysteresis 1 to 200 hex is counts, perhaps of 12 bit",
    "More than 5 % of the span or more than 512 counts is a warning, more than 12.5 % of the span (0x200 of 4095 "
    "counts) an error; without a value it is 1 count.",
    "The manual says 1 to 200 (hex) in the text and 0.1 % to 5 % in the feature table, which is 4 to 205 of 4095 "
    "counts. Whether the 512 counts grow with the format it does not say: 4097 of 15 bit are the same share.",
)
D23 = Decision(
    23,
    "the hysteresis must leave a zone without alarm",
    "A hysteresis as wide as the zone between low and high alarm is a warning.",
    "The high alarm would go off only where the low alarm is already on.",
)

WIDE_HYSTERESIS = Decimal("0.05")
MAX_COUNTS = 0x200
LARGEST_HYSTERESIS = Decimal(MAX_COUNTS) / 4095


def hysteresis_in_use(view: LoopView) -> int | None:
    """The counts of a hysteresis that some alarm uses."""
    return view.counts("hysteresis") if view.pv_alarms_on or view.deviation_alarms_on else None


def span_share(view: LoopView, share: Decimal) -> int:
    """A part of the PV's span in whole counts."""
    return round_to_integer(share * view.scales["pv"].format.span)


@per_loop
@error("DL249", HYSTERESIS, "hysteresis is {value}; its range begins at {least}")
def hysteresis_of_zero(view: LoopView) -> Findings:
    """The hysteresis is 0 counts while alarms are on.

    Why: the amount is programmable from 1. With 0, or a value of less than half a count, noise at a threshold switches
    the alarm on and off and annoys the operators, which is what the hysteresis is for.

    Fix: give at least one count; 0.1 % to 5 % of the range is the feature table's advice.
    """
    if view.loop.alarms.hysteresis is not None and hysteresis_in_use(view) == 0:
        yield view.report("alarms", "hysteresis", value=view.quote("hysteresis"), least=view.distance(1))


@per_loop
@warning("DL250", D22, "hysteresis is {value}, {passed}")
def hysteresis_wide(view: LoopView) -> Findings:
    """The hysteresis is wider than 5 % of the span, or than the 200 hex of the manual's text if they are counts.

    Why: the feature table ends at 5 %, the text at 200 hex, which are 512 counts. Whether these grow with the data
    format the manual does not say; if not, a loop of 15 or 16 bits has a value that the CPU does not take. An alarm
    with a wide hysteresis stays on long after its cause has gone.

    Fix: choose 0.1 % to 5 % of the range, at most 512 counts.
    """
    counts = hysteresis_in_use(view)
    advised_max, absolute_max = span_share(view, WIDE_HYSTERESIS), span_share(view, LARGEST_HYSTERESIS)
    if counts is None or not min(advised_max, MAX_COUNTS) < counts <= absolute_max:
        return
    limit_text = f"more than 5 % of the span ({view.distance(advised_max)})"
    if counts > MAX_COUNTS:
        as_counts = f"more than 200 hex if these are counts ({MAX_COUNTS})"
        readings = f"{as_counts}, within them if they grow with the format ({absolute_max})"
        limit_text = readings if counts <= advised_max else f"{limit_text}, {readings}"
    yield view.report("alarms", "hysteresis", value=view.quote("hysteresis"), passed=limit_text)


@per_loop
@error("DL251", D22, "hysteresis is {value}, more than 12.5 % of the span ({limit})")
def hysteresis_beyond_range(view: LoopView) -> Findings:
    """The hysteresis is wider than any reading of the manual allows.

    Why: the text ends at 200 hex, which is 512 of 4095 counts, and no more if it grows with the data format. What the
    CPU does beyond is not documented.

    Fix: choose 0.1 % to 5 % of the range.
    """
    counts = hysteresis_in_use(view)
    if counts is not None and counts > span_share(view, LARGEST_HYSTERESIS):
        limit = view.distance(span_share(view, LARGEST_HYSTERESIS))
        yield view.report("alarms", "hysteresis", value=view.quote("hysteresis"), limit=limit)


@per_loop
@error("DL252", HYSTERESIS, "hysteresis is {value}, not less than the yellow deviation limit {limit} in {word}")
def hysteresis_swallows_deviation_alarm(view: LoopView) -> Findings:
    """The hysteresis is not less than the deviation limits.

    Why: a deviation alarm goes off once the PV is back by the hysteresis. If that is as much as the limit, the PV would
    have to return exactly to the set point or beyond: the alarm, once on, stays on. The manual demands less.

    Fix: make the hysteresis smaller than the yellow limit.
    """
    yellow, counts = view.counts("deviation_yellow"), view.counts("hysteresis")
    if view.deviation_alarms_on and yellow and counts is not None and counts >= yellow:
        key = "hysteresis" if view.loop.alarms.hysteresis is not None else "deviation"
        yield view.report(
            "alarms",
            key,
            value=view.quote("hysteresis"),
            limit=view.quote("deviation_yellow"),
            word=view.address_of("deviation_yellow"),
        )


@per_loop
@warning(
    "DL253",
    D23,
    "hysteresis is {value}, but low and high alarm are only {zone} apart: neither goes off before the other comes",
)
def hysteresis_spans_normal_zone(view: LoopView) -> Findings:
    """The hysteresis is as wide as the zone between the low and the high alarm.

    Why: after a high alarm the PV must fall by the hysteresis to clear it, and by then it is at the low alarm. There is
    no PV without an alarm left.

    Fix: make the hysteresis much smaller than the distance from low to high.
    """
    return shared_checks.hysteresis_spans_normal_zone(view, span_share(view, LARGEST_HYSTERESIS))


@per_loop
@info("DL254", D22, "no hysteresis is given: alarms are released after {least}")
def hysteresis_not_given(view: LoopView) -> Findings:
    """Alarms are on without a hysteresis: 1 count is taken.

    Why: real signals are noisier than one count of 4095. The alarm comes and goes at its threshold.

    Fix: give `alarms.hysteresis`, 0.1 % to 5 % of the range.
    """
    if view.loop.alarms.hysteresis is None and hysteresis_in_use(view) is not None:
        yield view.report("alarms", "hysteresis", least=view.distance(1))


@per_loop
@info(
    "DL255",
    RATE,
    "hysteresis is {value}, but neither PV nor deviation alarms are on, and the rate-of-change alarm has none",
)
def hysteresis_without_effect(view: LoopView) -> Findings:
    """A hysteresis is given for a loop whose only alarm, if any, is the rate of change.

    Why: the hysteresis works with the absolute and the deviation alarms. It does not affect the rate-of-change alarm,
    which may therefore come and go with each sample.

    Fix: remove it, or switch on the alarms it was meant for.
    """
    if view.loop.alarms.hysteresis is not None and not view.pv_alarms_on and not view.deviation_alarms_on:
        yield view.report("alarms", "hysteresis", value=view.quote("hysteresis"))
