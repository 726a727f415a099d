"""The units of a vendor's registers and parameters, from the tables that hold them."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any, Protocol

from pidcfg.encoders.parameters import ParameterTable

if TYPE_CHECKING:
    from collections.abc import Mapping


class Parts(Protocol):
    """What has tables: a vendor."""

    def load(self, what: str) -> Any:
        """One of its parts by name."""


@cache
def units_by_path(vendor: Parts) -> Mapping[str, str]:
    """The units of the vendor's registers and parameters by the path of their value."""
    units: dict[str, str] = {}
    for table in vendor.load("registers"):
        if isinstance(table, ParameterTable):
            rows = [(row.name, row.unit) for row in table.rows]
        else:
            rows = [(word.path, word.unit) for word in table.words if word.path is not None]
        for path, unit in rows:
            if unit:
                units.setdefault(path, unit)
    return units
