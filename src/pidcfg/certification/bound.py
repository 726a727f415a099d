"""How sure one may be of a share: the one-sided lower bound of Clopper and Pearson (1934), at 95 %."""

from __future__ import annotations

from math import ceil, exp, lgamma, log, log1p

RISK = 0.05
"""How often a bound may lie above the true share."""
NOTHING = 1e-17
"""A share of a sum that does not change it."""


def lower_bound(passed: int, samples: int) -> float:
    """The smallest share at which at least ``passed`` of so many ``samples`` are as likely as the risk.

    By bisection on the logarithm of the exact binomial tail; the lower of the last two numbers.
    """
    if not passed:
        return 0.0
    low, high = 0.0, passed / samples
    while low < (middle := (low + high) / 2) < high:
        if log_tail(passed, samples, middle) < log(RISK):
            low = middle
        else:
            high = middle
    return low


def log_tail(passed: int, samples: int, share: float) -> float:
    """The logarithm of the probability that at least so many pass; ``share`` is not above passed / samples."""
    failed = samples - passed
    first = lgamma(samples + 1) - lgamma(passed + 1) - lgamma(failed + 1)
    first += passed * log(share) + failed * log1p(-share)
    odds, term, total = share / (1 - share), 1.0, 1.0
    for k in range(passed, samples):
        term *= (samples - k) / (k + 1) * odds
        total += term
        if term < total * NOTHING:
            break
    return first + log(total)


def samples_needed(share: float) -> int:
    """How many samples show a share, if none fails: 299 for 0.99, 2,995 for 0.999."""
    needed = max(1, ceil(log(RISK) / log(share)) - 1)
    while exp(log(RISK) / needed) < share:
        needed += 1
    return needed
