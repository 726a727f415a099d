"""Decimal addresses with a prefix, ``DS101``: a bank with its limits, and the field type that it gives."""

from __future__ import annotations

import re
from typing import Any, NamedTuple

from pidcfg.schemas.base import refuse

LONGEST = 9
"""Digits of an address that still reads as one."""
ADDRESS = re.compile(r"([A-Z]+)([0-9]+)")
LIKE_ADDRESS = re.compile(r" *([A-Z]+) *([0-9]+) *")
"""Blanks between digits may stand for anything: ``C10 1`` is no address."""


class BankRange(NamedTuple):
    """The addresses of one bank, first and last inclusive; ``what`` names them for messages."""

    prefix: str
    first: int
    last: int
    what: str

    def parse(self, value: object) -> int:
        """The number of an address of this bank; every other spelling is refused with the right one."""
        example = f"write it like {self.prefix}{self.first + 100}"
        if isinstance(value, int) and not isinstance(value, bool):
            return self._inside(value)
        if not isinstance(value, str):
            refuse("address_form", f"{self.what} is wanted", help=example)
        match = ADDRESS.fullmatch(value)
        if match is None or match.group(1) != self.prefix:
            upper = LIKE_ADDRESS.fullmatch(value.upper())
            likely = upper is not None and upper.group(1) == self.prefix
            only = self._spelled(upper.group(2)) if likely and upper else None
            refuse(
                "address_form", f"{value!r} is not {self.what}", help=f"write {only}" if only else example, only=only
            )
        if match.group(2)[0] == "0" or len(match.group(2)) > LONGEST:
            only = self._spelled(match.group(2))
            refuse(
                "address_form",
                f"{value} is not spelled as an address",
                help=f"write {only}" if only else example,
                only=only,
            )
        return self._inside(int(match.group(2)))

    def _spelled(self, digits: str) -> str | None:
        """An address as it should be written; None when there are too many digits to mean one."""
        return f"{self.prefix}{int(digits)}" if len(digits) <= LONGEST else None

    def _inside(self, number: int) -> int:
        if not self.first <= number <= self.last:
            refuse(
                "address_form",
                f"{self.prefix}{number} does not exist",
                help=f"addresses go from {self.prefix}{self.first} to {self.prefix}{self.last}",
            )
        return number

    @property
    def schema(self) -> dict[str, Any]:
        """The JSON Schema of an address."""
        return {"type": "string", "pattern": f"^{self.prefix}[1-9][0-9]*$"}
