"""What every public call does first: it refuses arguments of other types, and sets decimals as it needs them."""

from __future__ import annotations

from decimal import Context, localcontext
from functools import wraps
from typing import TYPE_CHECKING, ParamSpec, TypeVar

from pidcfg.results.argument_types import refuse_types

if TYPE_CHECKING:
    from collections.abc import Callable

P = ParamSpec("P")
R = TypeVar("R")
DECIMALS = Context()
"""How the calls calculate, whatever the caller has set: 28 digits, half to even."""


def exact(call: Callable[P, R]) -> Callable[P, R]:
    """Arguments are of their types; the rounding of decimals is not that of the caller's thread, nor left there."""

    @wraps(call)
    def in_context(*args: P.args, **kwargs: P.kwargs) -> R:
        refuse_types(call, args, kwargs)
        with localcontext(DECIMALS):
            return call(*args, **kwargs)

    return in_context
