"""Asynchronous work from synchronous calls, also where a loop runs already, as in a notebook."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from collections.abc import Coroutine

R = TypeVar("R")


def run(work: Coroutine[Any, Any, R]) -> R:
    """The result of the work, in an event loop of its own."""
    try:
        asyncio.get_running_loop()
    except RuntimeError:
        return asyncio.run(_quiet(work))
    from concurrent.futures import ThreadPoolExecutor

    with ThreadPoolExecutor(1) as pool:
        return pool.submit(asyncio.run, _quiet(work)).result()


async def _quiet(work: Coroutine[Any, Any, R]) -> R:
    """What a malformed answer breaks inside of the library is told by the request that gets none."""
    asyncio.get_running_loop().set_exception_handler(lambda _loop, _context: None)
    return await work
