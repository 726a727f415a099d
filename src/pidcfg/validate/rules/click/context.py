"""What the CLICK rules look at: the file, and each loop with what its registers hold.

Values are worked out from the model's own blocks, not read back from the image: where blocks overlap, the image holds
only one of them. Each is worked out once, when the first rule asks for it.
"""

from __future__ import annotations

from decimal import Decimal
from functools import cached_property
from typing import Any

from pidcfg.encoders.click.image import deviation_alarms_on, pv_alarms_on, values_of
from pidcfg.encoders.image import Block, Encoding, switched_on
from pidcfg.encoders.maps.click import BLOCKS, ERRORS, PidError
from pidcfg.schemas.click import ClickFile, Loop
from pidcfg.text.frozen import frozen
from pidcfg.validate.shared_checks import Context, Extent, Pair, View, all_or_none, extents_of, number_with_unit

PLACES = {word.name: (i, word) for i, (_, table) in enumerate(BLOCKS.values()) for word in table.words}
"""Each register's block, counted in the order of the banks, and its row."""
PREFIXES = tuple(BLOCKS.items())
NO_LIMIT = 100
"""Filter constant and derivative gain limit that filter nothing."""
NO_INTEGRAL = Decimal(1000)
"""The reset time in s from which the help takes the integral for removed."""


@frozen
class LoopView(View[Loop]):
    """A loop, its place in the file, and what its registers hold."""

    blocks: tuple[Block, ...]

    @cached_property
    def values(self) -> dict[str, Any]:
        """Every register's value by its path, defaults included."""
        return values_of(self.loop)

    def value(self, name: str) -> Any:
        """The value of a register, from the file or by default; None when there is none."""
        return self.values.get(str(PLACES[name][1].path))

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
            block, word = PLACES[name]
            self._register_values[name] = Decimal(word.decode(self.blocks[block].encoded.words[word.offset]))
        return self._register_values[name]

    def register_values(self, *names: str) -> list[Decimal]:
        """The numbers of several registers; empty as soon as one does not fit (which another rule reports)."""
        return all_or_none(map(self.register_value, names))

    def register(self, name: str) -> str:
        """The address of one of the loop's registers: ``DF107``."""
        block, word = PLACES[name]
        key, (prefix, _) = PREFIXES[block]
        return f"{prefix}{getattr(self.loop, key) + word.offset}"

    def shown(self, name: str) -> str:
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

    def co(self, value: Decimal) -> str:
        """A number in the output's unit."""
        return number_with_unit(value, self.loop.output.unit or "%")

    @property
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
        if error.above is not None:
            ends = self.register_values(error.register, error.above)
            return (
                bool(ends) and ends[0] > ends[1] and self.setpoint_limit_on("lower") and self.setpoint_limit_on("upper")
            )
        return (error.low is not None and value < error.low) or (error.high is not None and value > error.high)

    @cached_property
    def pv_alarms_on(self) -> bool:
        """Whether the bit of the four PV alarms is set."""
        return pv_alarms_on(self.loop)

    @cached_property
    def deviation_alarms_on(self) -> bool:
        """Whether the bit of the two deviation alarms is set."""
        return deviation_alarms_on(self.loop)

    @property
    def rate_alarm_on(self) -> bool:
        """Whether the bit of the rate-of-change alarm is set."""
        alarms = self.loop.alarms
        return switched_on(alarms.rate_of_change_enabled, alarms.rate_of_change)

    @property
    def pv_filter_on(self) -> bool:
        """Whether the PV filter's bit is set."""
        return switched_on(self.loop.pv.filter_enabled, self.loop.pv.filter)

    @property
    def derivative_limit_on(self) -> bool:
        """Whether the derivative gain limit's bit is set."""
        return switched_on(self.loop.derivative_gain_limit_enabled, self.loop.derivative_gain_limit)

    def setpoint_limit_on(self, end: str) -> bool:
        """Whether the set point's ``lower`` or ``upper`` limit is enabled."""
        setpoint = self.loop.setpoint
        return switched_on(getattr(setpoint, f"{end}_limit_enabled"), getattr(setpoint, f"{end}_limit"))

    @property
    def deadband_on(self) -> bool:
        """Whether the deadband's bit is set."""
        return switched_on(self.loop.error.deadband_enabled, self.loop.error.deadband)

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
