"""The engine against implementations of the same algorithms that know nothing of it: a sample of the cases.

All of them: ``python tools/reference``.
"""

import pytest

pytest.importorskip("numpy")

from reference.compare import compare, vendors

SAMPLE = 8
"""Cases of each vendor."""


@pytest.mark.parametrize("vendor", vendors())
def test_engine_and_reference_agree(vendor):
    outcome = compare(vendor, range(SAMPLE), seed=1)
    assert outcome.cases == SAMPLE
    assert outcome.loop_samples > 0
    assert not outcome.differences


@pytest.mark.parametrize(
    ("vendor", "seed", "numbers"),
    [
        pytest.param("dl06", 0, (4, 8, 74, 140), id="the end of a DL06 auto-tune, and its gains with noise"),
        pytest.param("rates", 0, (6, 10), id="a CYCLE below the scan, the share of a filter"),
    ],
)
def test_cases_that_once_differed_agree(vendor, seed, numbers):
    outcome = compare(vendor, numbers, seed)
    assert outcome.cases == len(numbers)
    assert not outcome.differences
