"""Rates of change of a PV, for the alarms of every vendor."""

from __future__ import annotations

from decimal import Decimal
from typing import Annotated, Literal, NamedTuple

from pydantic import WithJsonSchema

from pidcfg.schemas.base import COUNTS_TEXT, Parser, Quantity, parse_quantity
from pidcfg.schemas.numbers import EXACT, NUMBER, SIGNED, number_schema, number_text, refuse, text_schema


class Rate(NamedTuple):
    """A rate of change of the PV: per sample, or per a unit of time (``"15 /min"``)."""

    value: Decimal
    counts: bool = False
    per: Literal["sample", "s", "min"] = "sample"

    def per_sample(self, sample_rate: Decimal) -> Quantity:
        """The change in one sample of ``sample_rate`` seconds (manual: rate / 60 x counts per unit x sample rate)."""
        if self.per == "sample":
            return Quantity(self.value, self.counts)
        change = EXACT.multiply(self.value, sample_rate)
        return Quantity(EXACT.divide(change, Decimal(60)) if self.per == "min" else change, self.counts, derived=True)

    def __str__(self) -> str:
        return f"{Quantity(self.value, self.counts)} /{self.per}"


def parse_rate(value: object) -> Rate:
    """A quantity per sample, or a text ``15 /min``, ``0.25 /s``, ``40 counts/min``."""
    if isinstance(value, Rate):
        return value
    if isinstance(value, str) and "/" in value:
        amount, _, unit = value.partition("/")
        amount, per = amount.strip(), {"min": "min", "s": "s", "sample": "sample"}.get(unit.strip())
        number = amount.removesuffix("counts").strip()
        if per is None or not NUMBER.fullmatch(number):
            refuse("duration_form", f"{value!r} is not a rate", help="write 0.5 (per sample), 15 /min or 0.25 /s")
        return Rate(number_text(number), number != amount, per)  # type: ignore[arg-type]  # one of the Literal's words
    quantity = parse_quantity(value)
    return Rate(quantity.value, quantity.counts)


PER_TIME = r"\s*/\s*(?:sample|s|min)\s*"
UNIT_RATE_SCHEMA = number_schema(text_schema(rf"\s*{SIGNED}{PER_TIME}", "15 /min", "0.25 /s"))
COUNT_RATE_TEXT = text_schema(rf"\s*{SIGNED}\s*(?:counts)?{PER_TIME}", "15 /min", "0.25 /s", "40 counts/min")
AnyRate = Annotated[Rate, Parser(parse_rate), WithJsonSchema(number_schema(COUNT_RATE_TEXT, COUNTS_TEXT))]
