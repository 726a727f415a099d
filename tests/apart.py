"""Asynchronous work of a test, in a thread of its own: where a browser is open, its loop runs in the test's."""

from __future__ import annotations

import asyncio
from concurrent.futures import ThreadPoolExecutor


def apart(work):
    """What the work returns."""
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(asyncio.run, work).result()
