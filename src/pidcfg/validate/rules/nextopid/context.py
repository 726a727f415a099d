"""What the NextoPID rules look at: the blocks one by one, and what their wires lead to.

A literal is known. Of a wire the value is known where it is nothing but a name: of a signal, whose first value counts
and is quoted as such, or of another block's parameter that has a value (D208). All other wires are judged by nobody.
"""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from decimal import Decimal
from functools import cached_property
from typing import TYPE_CHECKING, Any

from pidcfg.encoders.maps.nextopid import LOOP_TYPES
from pidcfg.encoders.parameters import store
from pidcfg.encoders.words import EncodeError
from pidcfg.refs import Decision
from pidcfg.schemas.iec import Timed, Wire
from pidcfg.validate.rules.nextopid.links import Network
from pidcfg.validate.rules.nextopid.view import BlockView, Known

if TYPE_CHECKING:
    from pidcfg.diagnostics import Path
    from pidcfg.encoders.nextopid.encode import NextopidEncoding
    from pidcfg.encoders.parameters import Parameter
    from pidcfg.schemas.iec import IecType
    from pidcfg.schemas.nextopid import NextopidFile

D208 = Decision(
    208,
    "rules judge a signal by its first value",
    "A parameter that is wired to nothing but a signal is judged by the signal's first value, which the message names; "
    "one that is wired to a parameter with a value, by that. Expressions and outputs are not judged.",
    "The first value is what the program starts with; what comes later is not in the file.",
)


@dataclass(frozen=True)
class NextopidContext:
    """A configuration with its encoding, and its blocks one by one."""

    config: NextopidFile
    encoding: NextopidEncoding

    @cached_property
    def views(self) -> tuple[BlockView, ...]:
        """All blocks, then all loops, in the order of the file."""
        return tuple(BlockView(self, i, own) for i, own in enumerate(self.encoding.items))

    @cached_property
    def pids(self) -> tuple[BlockView, ...]:
        """The PID controllers."""
        return tuple(view for view in self.views if view.is_pid)

    @cached_property
    def controllers(self) -> tuple[BlockView, ...]:
        """All controllers, with those that switch."""
        return tuple(view for view in self.views if view.type in LOOP_TYPES)

    def of(self, *types: str) -> list[BlockView]:
        """The blocks of some types."""
        return [view for view in self.views if view.type in types]

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The name of everything that has a number; of two blocks with one name both."""
        layout = self.encoding.layout
        inner = (f"{own.name}.{row.name}" for own in layout.instances for row in own.kind.table.rows)
        return (*layout.signals, *inner)

    @cached_property
    def _bases(self) -> list[int]:
        """The number of each block's first parameter."""
        return [own.base for own in self.encoding.layout.instances]

    @cached_property
    def _rows(self) -> dict[str, dict[str, int]]:
        """Where the parameters of each type stand among its rows."""
        kinds = {own.kind.name: own.kind for own in self.encoding.items}
        return {name: {row.name: i for i, row in enumerate(kind.table.rows)} for name, kind in kinds.items()}

    def number(self, view: BlockView, key: str) -> int:
        """The number of a parameter."""
        return self._bases[view.number] + self._rows[view.type][key]

    def owner(self, number: int) -> tuple[BlockView, Parameter] | None:
        """The block and the parameter that a number stands for; None: a signal."""
        i = bisect_right(self._bases, number) - 1
        if i < 0:
            return None
        return self.views[i], self.views[i].own.kind.table.rows[number - self._bases[i]]

    def pid_output(self, number: int) -> BlockView | None:
        """The PID controller whose MV a number is."""
        found = self.owner(number)
        return found[0] if found is not None and found[0].is_pid and found[1].name == "MV" else None

    @cached_property
    def _found(self) -> dict[int, Known | None]:
        """What has been asked for already."""
        return {}

    def known(self, number: int) -> Known | None:
        """The value of a signal or parameter, as far as it is in the file."""
        if number not in self._found:
            self._found[number] = self._look_up(number)
        return self._found[number]

    def _look_up(self, number: int) -> Known | None:
        source = ""
        seen: set[int] = set()
        while number not in seen:
            seen.add(number)
            found = self.owner(number)
            if found is None:
                return self._first_value(self.names[number])
            view, row = found
            value = getattr(view.item, row.name, None) if row.access == "input" else None
            if not isinstance(value, Wire):
                content = held(row.type, value)
                return None if content is None else Known(content, source)
            expression = view.wire(row.name)
            if expression is None or expression.signal is None:
                return None
            number = expression.signal
            source = f" (of {self.names[number]})"
        return None

    def _first_value(self, name: str) -> Known | None:
        content = held(self.encoding.layout.signals[name], self.config.signals[name])
        return None if content is None else Known(content, f" (first value of {name})")

    @cached_property
    def network(self) -> Network:
        """Its cascades and overrides."""
        return Network(self)

    @cached_property
    def explained(self) -> frozenset[Path]:
        """Places whose limits a rule of NextoPID's own explains better than the rules for every vendor."""
        return frozenset(
            (*view.own.place, key)
            for view in self.pids
            for key in ("Ti_Ki", "Td_Kd")
            if self.has_time_as_gain(view, key)
        )

    def has_time_as_gain(self, view: BlockView, key: str) -> bool:
        """Whether a gain of the independent form is written with a unit of time."""
        return view.is_on("Indep") is True and isinstance(getattr(view.item, key), Timed)


def held(kind: IecType, value: Any) -> Any:
    """A value as the PLC holds it: a Decimal or a switch; None for one that it cannot hold, or for none at all."""
    if value is None:
        return None
    try:
        content = store(kind, value)
    except EncodeError:
        return None
    return content if isinstance(content, bool) else Decimal(repr(content))
