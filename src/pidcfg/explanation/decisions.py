"""The numbered decisions, wherever in the program they stand."""

from __future__ import annotations

import pkgutil
from importlib import import_module
from typing import TYPE_CHECKING

from pidcfg.refs import Decision

if TYPE_CHECKING:
    from collections.abc import Iterator


class SameNumberError(ValueError):
    """Two decisions have one number."""


def all_decisions() -> list[Decision]:
    """Every decision, in the order of their numbers."""
    return [decision for _, decision in placed_decisions()]


def placed_decisions() -> list[tuple[str, Decision]]:
    """Every decision with the first module that names it, in the order of their numbers."""
    places: dict[int, tuple[str, Decision]] = {}
    for module, decision in _everywhere():
        if places.setdefault(decision.number, (module, decision))[1] is not decision:
            raise SameNumberError(f"two decisions have the number D{decision.number:02d}")
    return [places[number] for number in sorted(places)]


def _everywhere() -> Iterator[tuple[str, Decision]]:
    """The decisions of every module; those that an extra is missing for have none of their own."""
    package = import_module("pidcfg")
    for info in pkgutil.walk_packages(package.__path__, "pidcfg."):
        if info.name.endswith("__main__"):
            continue
        try:
            module = import_module(info.name)
        except ModuleNotFoundError as error:
            if (error.name or "").startswith("pidcfg"):
                raise
            continue
        for value in vars(module).values():
            for entry in value if isinstance(value, tuple | list) else (value,):
                if isinstance(entry, Decision):
                    yield info.name, entry
