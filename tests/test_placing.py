"""Values that are written into a file: in the place of others, or as new keys behind a neighbour."""

from __future__ import annotations

import pytest

from pidcfg.text.source import read_document
from pidcfg.validate.fixes import with_values

BLOCK = "loops:\n  - name: A  # the first\n    tuning:\n      gain: 1  # as found\n    mode: auto\n"
FLOW = "loops:\n  - {name: A, tuning: {gain: 1}, mode: auto}\n"
GAIN, RATE, RESET = (("loops", 0, "tuning", key) for key in ("gain", "rate", "reset"))


@pytest.mark.parametrize(
    ("text", "values", "written"),
    [
        (BLOCK, {GAIN: "2.5"}, BLOCK.replace("gain: 1", "gain: 2.5")),
        (FLOW, {GAIN: "2.5"}, FLOW.replace("gain: 1", "gain: 2.5")),
        (BLOCK, {RATE: "3"}, BLOCK.replace("# as found\n", "# as found\n      rate: 3\n")),
        (FLOW, {RATE: "3"}, FLOW.replace("gain: 1", "gain: 1, rate: 3")),
        (BLOCK, {RESET: "2 min", RATE: "3"}, BLOCK.replace("found\n", "found\n      reset: 2 min\n      rate: 3\n")),
        (FLOW, {GAIN: "2", RESET: "4", RATE: "3"}, FLOW.replace("gain: 1", "gain: 2, reset: 4, rate: 3")),
        (BLOCK.replace("gain: 1", "gain: '1 s'"), {GAIN: "2 s"}, BLOCK.replace("gain: 1", "gain: '2 s'")),
        (BLOCK.replace("gain: 1", "gain: '1'"), {GAIN: "2"}, BLOCK.replace("gain: 1", "gain: 2")),
    ],
)
@pytest.mark.parametrize("mark", ["", "\N{ZERO WIDTH NO-BREAK SPACE}"])
def test_a_key_that_is_not_there_goes_behind_its_neighbour(text, values, written, mark):
    data = (mark + text).encode()
    made = with_values(data, read_document(data, "a.yaml"), values, dict.fromkeys((RATE, RESET), GAIN))
    assert made.decode() == mark + written
