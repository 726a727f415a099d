"""How a program calls a DPIDE instruction: what stands around it in the manual's examples."""

from __future__ import annotations

import re
from typing import Annotated

from pydantic import WithJsonSchema

from pidcfg.refs import DPIDE, Decision
from pidcfg.schemas.base import DURATION_TEXT, Model, Parser, parse_duration
from pidcfg.schemas.dpide_devices import DIGITS, Flag
from pidcfg.schemas.iec import INT, Identifier
from pidcfg.schemas.limits import Limits
from pidcfg.schemas.numbers import refuse, text_schema

D600 = Decision(
    600,
    "how the program calls an instruction is a section of the loop",
    "`call` has the bit at EN, the function block that the instruction stands in, the timer that calls it, and GPWM "
    "behind it. Without it the instruction is executed in every scan. Program text alone has it; the calculation is "
    "the same.",
    "The manual's examples 1, 3 and 4 have these around the instruction, and none is an operand.",
)
D601 = Decision(
    601,
    "timers are T0 to T511",
    "Other numbers of `call.timer` are refused.",
    "The manual names T0 alone; this is the range of the AS300, as with other devices (D250).",
)

LAST_TIMER = 511
TIMER = re.compile(f"T{DIGITS}")


def parse_timer(value: object) -> str:
    """``T0``: a timer."""
    match = TIMER.fullmatch(value) if isinstance(value, str) else None
    if match is None:
        refuse("address_form", f"{value!r} is not a timer", help="write it like T0")
    if int(match.group(1)) > LAST_TIMER:
        refuse("address_form", f"{value} does not exist", help=f"timers go from T0 to T{LAST_TIMER}")
    return match.group()


def parse_milliseconds(value: object) -> int:
    """A whole number of ms; a text may carry another unit."""
    duration = parse_duration(value)
    number = duration.seconds("ms") * 1000
    if number != number.to_integral_value():
        refuse("number_type", f"{value} is not a whole number of ms")
    return int(number)


MILLISECONDS_SCHEMA = {"anyOf": [DURATION_TEXT, {"type": "integer"}]}
Timer = Annotated[str, Parser(parse_timer), WithJsonSchema(text_schema(TIMER.pattern, "T0"))]
PulseCycle = Annotated[
    int,
    Parser(parse_milliseconds),
    WithJsonSchema(MILLISECONDS_SCHEMA),
    INT,
    Limits("1", str(INT.high), "ms", DPIDE.at("Example 3")),
]


class Gpwm(Model):
    """GPWM behind the instruction: in each cycle the output is on for as long as MV says."""

    cycle: PulseCycle
    """Cycle of the pulses in ms; MV is the time on in it, so that MV_MAX is the cycle."""
    output: Flag
    """Bit of the pulses."""


class Call(Model):
    """How the program calls the instruction, as program text has it."""

    EN: Flag | None = None
    """Bit that enables the instruction; while it is FALSE nothing is executed and all data stay. Without: always."""
    function_block: Identifier | None = None
    """Name of the function block that the instruction stands in, such as `AS_DPIDE`."""
    timer: Timer | None = None
    """Timer (TMRH) that calls it every CYCLE. Without: it is called in every scan."""
    GPWM: Gpwm | None = None
    """Pulses of the width that MV says."""
