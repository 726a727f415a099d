"""Workers for processes that are started anew: whatever they do stands in a module without further imports."""

from __future__ import annotations

import os
import time


def doubling(add):
    """A worker whose first items take longest, so that results would come back out of order."""

    def work(number):
        time.sleep(0.02 * (number < 2))
        return 2 * number + add, os.getpid()

    return work


def dying():
    """A worker that ends its process at the third item."""
    return lambda number: os._exit(7) if number == 2 else number


def waiting():
    """A worker that says who it is and then is busy for as long as nobody stops it."""
    return lambda number: os.getpid() if number == 0 else time.sleep(600)
