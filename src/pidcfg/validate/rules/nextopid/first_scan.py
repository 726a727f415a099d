"""The first scan of a NextoPID program: what its parameters, wires and outputs hold then, as far as the file says it.

The rules judge what comes out here as they judge a number that is written in the file (D208). Each result is what the
virtual PLC has after its first scan, in single precision and in its order; what cannot be known stays unknown (D920).
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from decimal import ROUND_HALF_EVEN, Decimal
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

from pidcfg.encoders.codecs import EncodeError
from pidcfg.encoders.maps.nextopid import LOOP_TYPES, MAX_DELAY_SAMPLES
from pidcfg.encoders.nextopid.wiring import NoValueError, reachable_blocks, value_of
from pidcfg.encoders.parameters import shortest_single, store_content
from pidcfg.schemas.iec import BOOL, INT, Wire
from pidcfg.text.paths import parse_path, value_at
from pidcfg.text.references import Decision

if TYPE_CHECKING:
    from pidcfg.encoders.nextopid.image import NextopidEncoding
    from pidcfg.encoders.parameters import Parameter
    from pidcfg.schemas.expressions import Expression
    from pidcfg.schemas.iec import IecType
    from pidcfg.schemas.nextopid import NextopidFile

D208 = Decision(
    208,
    "rules judge a signal by its first value",
    "A parameter that is wired is judged by the value that it has in the first scan: that of a signal, of a parameter "
    "of another block, of an expression. The message says where the value is from.",
    "The first value is what the program starts with, and the block reports it as it reports a number of the file; "
    "what comes later is not in the file.",
)
D920 = Decision(
    920,
    "what is known of the first scan",
    "Expressions are worked out from first values of signals, what moves at the start have written, parameters, and "
    "outputs of selectors, filters, lags and delays in their first call, in single precision. Unknown are "
    "other outputs, what is read from a later block of the same ring, what has no value (a division by "
    "zero), and expressions and outputs of a signal that a PV is made of. The first output of a lag or delay counts "
    "for settings that the block checks, not for set points, offsets and switches.",
    "A PV comes from the plant, and its first value in a file is a stopgap. A lag leaves its first output at once: an "
    "error of its first call is reported, but what an operator sees of it is over before he looks.",
)

PERMANENT, INITIAL, TRANSIENT, MEASURED = 3, 2, 1, 0
"""How long a value holds: numbers of the file; what a signal begins with; a first output; what comes from the plant."""
_CHECKED_WORDS = """
    Kp Ti_Ki Td_Kd Tfd MaxVarMV DeadBand MinMV MaxMV MinPV MaxPV Indep SPLIT Tc Tlead Tlag DelayTime
    Min_OutVar Max_OutVar Init_OutVar
"""
CHECKED_KEYS = frozenset(_CHECKED_WORDS.split())
"""What a block checks when it is called: an error in its first call is reported, however short it is."""
MAX_BLOCKS = 40
"""Blocks behind each other that are followed; beyond that a value is unknown."""
MAX_QUOTED = 60
"""Characters of an expression that a message quotes."""


class KnownValue(NamedTuple):
    """The value of a parameter, in words where it is from, if not from the parameter itself, and how long it holds."""

    value: Any
    source: str = ""
    life: int = PERMANENT


def value_in_plc(kind: IecType, value: Any) -> Decimal | bool | None:
    """A value as the PLC holds it: a Decimal or a switch; None for one that it cannot hold, or for none at all."""
    if value is None:
        return None
    try:
        content = store_content(kind, value)
    except EncodeError:
        return None
    if kind.kind == "time":
        return Decimal(value)
    return content if isinstance(content, bool) else Decimal(repr(content))


def round_to_single(value: float) -> float:
    """The nearest number of single precision; an ``OverflowError`` beyond them."""
    nearest: float = struct.unpack("f", struct.pack("f", value))[0]
    return nearest


def as_int(value: Decimal) -> Decimal:
    """The whole number that an INT takes of a number."""
    return min(max(value, Decimal(INT.low)), Decimal(INT.high)).to_integral_value(ROUND_HALF_EVEN)


def _typed_content(kind: IecType, result: float) -> Decimal | bool:
    """A result in single precision as a Decimal, or as a switch."""
    return result != 0 if kind is BOOL else Decimal(repr(shortest_single(result)))


# --- Outputs of blocks after their first call without an error, by D237; empty where there is one ---------------------

ReadInput = Callable[[str], float]
Outputs = Mapping[str, float]
"""Outputs by name; a BOOL is 0 or 1."""


def _select_output(read: ReadInput, kind: str, _: float) -> Outputs:
    one, two = read("MV1"), read("MV2")
    is_first = one > two if kind == "ControlSelectMax" else one < two
    return {"MV": one if is_first else two, "OVERR1": not is_first, "OVERR2": is_first}


def _filter_output(read: ReadInput, *_: object) -> Outputs:
    return {"OutVar": read("InVar")} if read("Tc") > 0 else {}


def _lead_lag_output(read: ReadInput, *_: object) -> Outputs:
    if read("Tlead") < 0 or read("Tlag") <= 0:
        return {}
    if read("Disable"):
        return {"OutVar": 0.0}
    out = round_to_single(read("G") * read("InVar"))
    return {"OutVar": max(min(out, read("Max_OutVar")), read("Min_OutVar"))}


def _lag_output(read: ReadInput, kind: str, sample: float) -> Outputs:
    start = read("Init_OutVar")
    is_sound = read("Tc") > 0 and read("Min_OutVar") <= start <= read("Max_OutVar")
    return {"OutVar": start} if is_sound and (kind == "ControlLag" or _delay_samples(read, sample) is not None) else {}


def _delay_output(read: ReadInput, _: str, sample: float) -> Outputs:
    samples = _delay_samples(read, sample)
    return {} if samples is None else {"OutVar": read("InitDelayedVar" if samples else "InVar")}


def _delay_samples(read: ReadInput, sample: float) -> int | None:
    """The samples of a delay; None where it is an error, or almost one."""
    time = read("DelayTime")
    return round(round_to_single(time / sample)) if 0 <= time <= MAX_DELAY_SAMPLES * sample else None


INITIAL_OUTPUT_BLOCKS = frozenset(("ControlLag", "ControlDelay", "ControlDelayLag"))
"""Blocks whose first output is a parameter of their own, which they leave at once."""
FIRST_CALLS: Mapping[str, Callable[[ReadInput, str, float], Outputs]] = {
    "ControlSelectMax": _select_output,
    "ControlSelectMin": _select_output,
    "ControlLowFilter": _filter_output,
    "ControlLeadLag": _lead_lag_output,
    "ControlLag": _lag_output,
    "ControlDelayLag": _lag_output,
    "ControlDelay": _delay_output,
}


def dependencies_of(encoding: NextopidEncoding, number: int) -> set[int]:
    """What a value depends on: the wire of an input; for an output all wires of its block, unless that is a PID."""
    block = encoding.layout.owner_of(number)
    if block is None:
        return set()
    kind, base = encoding.layout.instances[block].kind, encoding.layout.instances[block].base
    row = kind.table.rows[number - base]
    is_pid = kind.name in LOOP_TYPES and kind.name != "ControlON_OFF"
    inputs = [row.name] if row.access == "input" else [] if is_pid else [inner.name for inner in kind.inputs]
    wires = (encoding.wires.get((block, key)) for key in inputs)
    return {number for wire in wires if wire is not None for number in wire.signals}


# --- The values of a program ------------------------------------------------------------------------------------------


class FirstScan:
    """The values of a program in its first scan, worked out when they are asked for."""

    def __init__(self, config: NextopidFile, encoding: NextopidEncoding) -> None:
        self.config, self.encoding, self.layout = config, encoding, encoding.layout
        self._values: dict[int, KnownValue | None] = {}
        self._in_progress: set[int] = set()
        self._sources_by_block: dict[int, set[int]] = {}

    def find_value(self, number: int) -> KnownValue | None:
        """The value of a signal or parameter; None where it is unknown."""
        if number in self._values:
            return self._values[number]
        if number in self._in_progress or len(self._in_progress) > MAX_BLOCKS:
            return None
        self._in_progress.add(number)
        found = self._values[number] = self._work_out_value(number)
        self._in_progress.remove(number)
        return found

    def _find_parameter(self, number: int) -> tuple[int, Parameter] | None:
        """The number of a block, and its parameter that a number stands for; None: a signal."""
        owner = self.layout.owner_of(number)
        if owner is None:
            return None
        block = self.layout.instances[owner]
        return owner, block.kind.table.rows[number - block.base]

    def _file_value(self, block: int, key: str) -> Any:
        """What the file says of an input, or the default is."""
        return value_at(self.encoding.items[block].item, parse_path(key))

    def _work_out_value(self, number: int) -> KnownValue | None:
        owner = self._find_parameter(number)
        if owner is None:
            return self._signal_values[number]
        block, row = owner
        if row.access == "output":
            return self._first_output(block, row)
        value = self._file_value(block, row.name)
        if isinstance(value, Wire):
            expression = self.encoding.wires.get((block, row.name))
            return None if expression is None else self._wire_value(block, expression, row.type)
        content = value_in_plc(row.type, value)
        return None if content is None else KnownValue(content)

    # --- wires and signals -------------------------------------------------------------------------------------------

    def _wire_value(self, block: int, expression: Expression, kind: IecType) -> KnownValue | None:
        """What a wire gives a parameter. A number that an INT cannot hold is given as it is, for NX614 to say so."""
        if expression.signal is None:
            return self._expression_value(expression, kind, lambda number: self._read_value(number, block))
        known = self._read_value(expression.signal, block)
        return None if known is None else known._replace(source=known.source or f" (of {expression.text})")

    def _read_value(self, number: int, reader: int) -> KnownValue | None:
        """What a block reads in its call; nothing that a block of its own ring may write after it."""
        owner, known = self._find_parameter(number), self.find_value(number)
        if owner is None or known is None:
            return known
        block, row = owner
        is_wired = isinstance(self._file_value(block, row.name), Wire)
        is_written = row.access == "output" or is_wired
        if number in self._move_targets or (is_written and reader in self._find_sources(block)):
            return None
        if is_wired and row.type is INT:
            known = known._replace(value=as_int(known.value))
        return known._replace(life=min(known.life, INITIAL))

    def _find_sources(self, block: int) -> set[int]:
        """The block itself, and all whose values it reads, however indirectly."""
        if block not in self._sources_by_block:
            self._sources_by_block[block] = {block, *reachable_blocks(block, self._direct_sources, self._all_blocks)}
        return self._sources_by_block[block]

    @cached_property
    def _direct_sources(self) -> list[set[int]]:
        return self.layout.read_blocks(self.encoding.wires)

    @cached_property
    def _all_blocks(self) -> set[int]:
        return set(range(len(self.layout.instances)))

    def _expression_value(
        self, expression: Expression, kind: IecType, read: Callable[[int], KnownValue | None]
    ) -> KnownValue | None:
        """The value of an expression of known values; None where one of them is unknown, or comes from the plant."""
        inputs = {number: read(number) for number in sorted(expression.signals)}
        life = min((one.life if one is not None else MEASURED for one in inputs.values()), default=PERMANENT)
        if life == MEASURED:
            return None
        values = {number: float(one.value) for number, one in inputs.items() if one is not None}
        try:
            result = value_of(expression, values.get, round_to_single)
        except ArithmeticError:
            return None
        text = expression.text if len(expression.text) <= MAX_QUOTED else f"{expression.text[:MAX_QUOTED]}…"
        source = f" ({text})" if life == PERMANENT else f" ({text} at the first scan)"
        return None if result is None else KnownValue(_typed_content(kind, result), source, life)

    @cached_property
    def _signal_values(self) -> list[KnownValue | None]:
        """What the signals hold when the first block is called: first values, and what moves have written."""
        names, values = list(self.layout.signals), list[KnownValue | None]()
        for i, (name, kind) in enumerate(self.layout.signals.items()):
            content = value_in_plc(kind, self.config.signals[name])
            life = MEASURED if i in self._pv_signals else INITIAL
            values.append(None if content is None else KnownValue(content, f" (first value of {name})", life))

        def read(number: int) -> KnownValue | None:
            return values[number] if number < len(values) else None

        for copy in self.encoding.copies:
            if copy is None or not copy.at_start or copy.target >= len(values):
                continue
            when = KnownValue(value=True) if copy.when is None else self._expression_value(copy.when, BOOL, read)
            moved_value = None if when is None else self._expression_value(copy.value, copy.type, read)
            if moved_value is not None:
                value = as_int(moved_value.value) if copy.type is INT else moved_value.value
                moved_value = KnownValue(value, f" ({names[copy.target]} at the first scan)", INITIAL)
            if when is None or when.value:
                values[copy.target] = moved_value
        return values

    @cached_property
    def _move_targets(self) -> frozenset[int]:
        """What moves at the start write."""
        return frozenset(copy.target for copy in self.encoding.copies if copy is not None and copy.at_start)

    @cached_property
    def _pv_signals(self) -> frozenset[int]:
        """The signals that a PV is made of, through wires and blocks other than loops."""
        signals: set[int] = set()
        pending = [self.layout.numbers[f"{b.name}.PV"] for b in self.layout.instances if b.kind.name in LOOP_TYPES]
        while pending:
            fresh = dependencies_of(self.encoding, pending.pop()) - signals
            signals |= fresh
            pending += fresh
        return frozenset(signals)

    # --- outputs of blocks in their first call -----------------------------------------------------------------------

    def _first_output(self, block: int, row: Parameter) -> KnownValue | None:
        """An output of a block that is no loop, after its first call without an error."""
        kind, name = self.layout.instances[block].kind.name, self.layout.instances[block].name
        first_call = FIRST_CALLS.get(kind)
        if first_call is None:
            return None
        inputs: list[KnownValue] = []

        def read(key: str) -> float:
            known = self.find_value(self.layout.numbers[f"{name}.{key}"])
            if known is None or known.life == MEASURED:
                raise NoValueError(key)
            inputs.append(known)
            return round_to_single(float(known.value))

        try:
            value = first_call(read, kind, round_to_single(float(self.config.plc.sample_time))).get(row.name)
        except ArithmeticError:
            return None
        content = None if value is None else _typed_content(row.type, value)
        if content is None:
            return None
        life = min([TRANSIENT if kind in INITIAL_OUTPUT_BLOCKS else INITIAL, *(known.life for known in inputs)])
        return KnownValue(content, f" ({name}.{row.name} at the first scan)", life)
