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
