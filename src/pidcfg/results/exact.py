"""Decimals as the public calls calculate with them, whatever their caller has set."""

from __future__ import annotations

from decimal import Context, localcontext
from functools import wraps
from typing import TYPE_CHECKING, ParamSpec, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable

P = ParamSpec("P")
R = TypeVar("R")
DECIMALS = Context()
"""How the calls calculate, whatever the caller has set: 28 digits, half to even."""


def exact(call: Callable[P, R]) -> Callable[P, R]:
    """Neither takes the rounding of decimals from the caller's thread nor leaves flags there."""

    @wraps(call)
    def in_context(*args: P.args, **kwargs: P.kwargs) -> R:
        with localcontext(DECIMALS):
            return call(*args, **kwargs)

    return in_context
