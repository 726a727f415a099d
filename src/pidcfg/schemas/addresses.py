"""Decimal addresses with a prefix, ``DS101``: a bank with its limits, and the field type that it gives."""

from __future__ import annotations

import re
from typing import Any, NamedTuple

from pidcfg.schemas.numbers import refuse, text_schema

LONGEST = 9
"""Digits of an address that still reads as one."""
LIKE_ADDRESS = re.compile(r" *([A-Z]+) *([0-9]+) *")
"""Blanks between digits may stand for anything: ``C10 1`` is no address."""


class BankRange(NamedTuple):
    """The addresses of one bank, first and last inclusive; ``what`` names them for messages."""

    prefix: str
    first: int
    last: int
    what: str

    def parse(self, value: object) -> int:
        """The number of an address of this bank; another spelling of one is refused with the right one."""
        if isinstance(value, int) and not isinstance(value, bool):
            return self._inside(value)
        example = f"write it like {self._example}"
        if not isinstance(value, str):
            refuse("address_form", f"{self.what} is wanted", help=example)
        match = LIKE_ADDRESS.fullmatch(value.upper())
        if match is None or match.group(1) != self.prefix or len(match.group(2)) > LONGEST:
            refuse("address_form", f"{value!r} is not {self.what}", help=example)
        number = self._inside(int(match.group(2)))
        only = f"{self.prefix}{number}"
        if value != only:
            refuse("address_form", f"{value!r} is not spelled as an address", help=f"write {only}", only=only)
        return number

    def _inside(self, number: int) -> int:
        if not self.first <= number <= self.last:
            refuse(
                "address_form",
                f"{self.prefix}{number} does not exist",
                help=f"addresses go from {self.prefix}{self.first} to {self.prefix}{self.last}",
            )
        return number

    @property
    def _example(self) -> str:
        return f"{self.prefix}{self.first + 100}"

    @property
    def schema(self) -> dict[str, Any]:
        """The JSON Schema of an address."""
        return text_schema(f"{self.prefix}[1-9][0-9]{{0,{len(str(self.last)) - 1}}}", self._example)
