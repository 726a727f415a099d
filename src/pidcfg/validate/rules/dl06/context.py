"""What the DL06 rules look at: the set-up, and each loop with its addresses and the counts that its words hold.

Everything is worked out from the model, not read back from the image: where blocks overlap, the image holds only one of
them. Each value is worked out once, when the first rule asks for it.
"""

from __future__ import annotations

from decimal import Decimal
from functools import cached_property
from typing import TYPE_CHECKING, Any

from pidcfg.encoders.codecs import Position, Scale, bcd_digits, bcd_word
from pidcfg.encoders.dl06.image import (
    LOOP_SIZE,
    OUTPUT_OFFSET,
    Setup,
    check_setup,
    deviation_alarms_on,
    loop_start,
    pv_alarms_on,
    remote_setpoint,
    reset_value,
    scales_of,
    values_of,
)
from pidcfg.encoders.image import Block, Encoding, switched_on
from pidcfg.encoders.maps.dl06 import CPU, LOOP_TABLE, RESET
from pidcfg.schemas.base import v_name
from pidcfg.schemas.dl06 import Dl06File, Loop, RampSoakStep
from pidcfg.schemas.numbers import decimal_text
from pidcfg.text.frozen import frozen
from pidcfg.validate.shared_checks import Context, View, all_or_none

if TYPE_CHECKING:
    from pidcfg.schemas.base import Quantity
    from pidcfg.text.paths import Path

WORDS = {word.name: word for word in LOOP_TABLE.words}
NINES = 9999


def counts_text(counts: Decimal | int) -> str:
    """``1 count``, ``205 counts``."""
    return f"{decimal_text(Decimal(counts))} count{'' if counts == 1 else 's'}"


@frozen
class Pair:
    """A ramp and its soak: their place in the list of steps, and what their four words hold (None: does not fit)."""

    index: int
    step: RampSoakStep
    target: int | None
    slope: Decimal | None
    soak: Decimal | None


@frozen
class LoopView(View[Loop]):
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

    @cached_property
    def values(self) -> dict[str, Any]:
        """Every register's value by its path, defaults included."""
        return values_of(self.config, self.loop)

    def value(self, name: str) -> Any:
        """The value of a register, from the file or by default; None when there is none."""
        return self.values.get(str(WORDS[name].path))

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
    def pairs(self) -> tuple[Pair, ...]:
        """The steps of the ramp/soak profile that are written."""
        profile = self.loop.ramp_soak
        steps = () if profile is None or profile.steps is None else profile.steps
        return tuple(self._pair(j, step, self.steps[j]) for j, step in enumerate(steps))

    def _pair(self, j: int, step: RampSoakStep, block: Block) -> Pair:
        misfits = {misfit.word.name for misfit in block.encoded.misfits}
        target, slope, soak, _ = block.encoded.words
        codec = self.scales["sp"].format.codec
        return Pair(
            j,
            step,
            None if "ramp_to" in misfits else int(codec.decode(target)),
            None if "slope" in misfits else Decimal(bcd_digits(slope)) / 100,
            None if "soak" in misfits else Decimal(bcd_digits(soak)) / 10,
        )

    def shown(self, name: str) -> str:
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

    def status(self, bit: int, meaning: str) -> str:
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
        return NINES * RESET[self.config.plc.reset_decimals].step, Decimal(NINES)

    @cached_property
    def pv_alarms_on(self) -> bool:
        """Whether the bit of the four PV alarms is set."""
        return pv_alarms_on(self.loop)

    @cached_property
    def deviation_alarms_on(self) -> bool:
        """Whether the bit of the two deviation alarms is set."""
        return deviation_alarms_on(self.loop)

    @property
    def pv_filter_on(self) -> bool:
        """Whether the PV filter's bit is set."""
        return switched_on(self.loop.pv.filter_enabled, self.loop.pv.filter)

    @property
    def deadband_on(self) -> bool:
        """Whether the deadband's bit is set."""
        return switched_on(self.loop.error.deadband_enabled, self.loop.error.deadband)

    @property
    def derivative_limit_on(self) -> bool:
        """Whether the derivative gain limit's bit is set."""
        return switched_on(self.loop.derivative_gain_limit_enabled, self.loop.derivative_gain_limit)

    @property
    def setpoint_limit_on(self) -> bool:
        """Whether the set point limits' bit is set."""
        return switched_on(self.loop.setpoint.limits_enabled, self.loop.setpoint.limits)

    def pv_counts_at(self, setpoint: int) -> int:
        """The counts of the PV at a set point: its square where the PV's root is taken."""
        return setpoint * abs(setpoint) if self.loop.pv.square_root else setpoint

    @property
    def bipolar(self) -> bool:
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
            steps[int(block.place[1])].append(block)
        return tuple(LoopView(i, loop, self.config, blocks[i], tuple(steps[i])) for i, loop in enumerate(loops))

    @property
    def count(self) -> int:
        """The number of loops that V7641 holds."""
        count = self.config.plc.number_of_loops
        return len(self.config.loops) if count is None else count

    @cached_property
    def setup(self) -> Setup:
        """What the CPU makes of V7640 and V7641."""
        return check_setup(self.config.plc.loop_table, bcd_word(min(max(self.count, 0), NINES)))

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
    def explained(self) -> frozenset[Path]:
        """Places whose limits a rule of the DL06's own explains better than the rules for every vendor."""
        resets = {
            ("loops", view.index, "tuning", "reset")
            for view in self.loops
            if reset_value(view.loop) in view.off_resets or "reset" in view.misfits
        }
        return frozenset({("plc", "number_of_loops"), *resets}) if self.count > CPU.loops else frozenset(resets)
