"""V7642 at every edge: what the validator says, with the line, and what the words themselves give.

Worked out by hand from the manual: start V1200 to V7340 or V10000 to V17740, at most 8 loops of 40 octal words each,
and no table across V7577.
"""

from __future__ import annotations

import pytest

import pidcfg
from pidcfg.encoders.dl06.image import check_setup

LOOP = "  - {{name: L{n}, sample_rate: 0.1, action: direct, tuning: {{gain: 1}}}}"

# start, loops, bits of V7642 (the word), and what is wrong though the PLC does not say so
EDGES = [
    ("V0", 1, 0b0001, None),
    ("V1177", 1, 0b0001, None),
    ("V1200", 1, 0, None),
    ("V1200", 8, 0, None),
    ("V7200", 8, 0, None),  # 7200 + 8 x 40 octal = V7600: the last word is V7577 exactly
    ("V7201", 8, 0b1000, None),
    ("V7340", 1, 0, None),
    ("V7340", 5, 0, None),  # 7340 + 5 x 40 octal = V7600: the last word is V7577 exactly
    ("V7340", 6, 0b1000, None),
    ("V7341", 1, 0b0001, None),
    ("V7577", 1, 0b0001, None),
    ("V7777", 1, 0b0001, None),
    ("V10000", 1, 0, None),
    ("V10000", 8, 0, None),
    ("V17400", 8, 0, None),  # ends at V17777
    ("V17401", 8, 0, "DL205"),
    ("V17740", 1, 0, None),
    ("V17740", 2, 0, "DL205"),
    ("V17741", 1, 0b0010, None),
    ("V20000", 1, 0b0010, None),
    ("V2000", 9, 0b0100, None),
    ("V7340", 9, 0b1100, None),
    ("V1177", 9, 0b0101, None),
]


def text(start: str, loops: int) -> str:
    """A file whose line 3 is the loop table and whose loops begin in line 5."""
    rows = "\n".join(LOOP.format(n=n) for n in range(1, loops + 1))
    return f"pidcfg: 1\nvendor: dl06\nplc: {{loop_table: {start}, reset_decimals: 1}}\nloops:\n{rows}\n"


@pytest.mark.parametrize(("start", "loops", "word", "other"), EDGES)
def test_the_validator_names_each_bit_and_the_line(start, loops, word, other):
    found = pidcfg.check_text(text(start, loops)).findings
    errors = [d for d in found if d.severity.label == "error"]
    effects = {d.plc_effect for d in errors if d.code != "DL205"}
    assert effects == {f"V7642 bit {bit}" for bit in range(4) if word >> bit & 1}
    assert [(d.code, d.plc_effect) for d in errors if d.code == "DL205"] == (
        [(other, "not shown in V7642")] if other else []
    )
    for d in errors:
        # too many loops are pointed at where the ninth is listed, everything else where the table starts
        assert d.span.line == (4 if d.code == "DL203" else 3), (
            d
        )  # the key of the list: which loop is the ninth is no matter


@pytest.mark.parametrize(("start", "loops", "word", "other"), EDGES)
def test_the_words_give_the_same_flags(start, loops, word, other):
    image = pidcfg.check_text(text(start, loops)).encoding.image.words
    assert check_setup(image[0o7640], image[0o7641]).flags == word


@pytest.mark.parametrize("start", ["V7440", "V7576", "V7577", "V7600"])
def test_a_start_between_the_pointer_range_and_the_end_of_the_lower_block_is_outside(start):
    found = pidcfg.check_text(text(start, 1)).findings
    assert any(d.plc_effect == "V7642 bit 0" for d in found)


@pytest.mark.parametrize("start", ["V1208", "V178", "2000", "02000", "v2000", "V2000.1", "V200000"])
def test_starts_that_are_no_addresses_are_refused(start):
    (found,) = pidcfg.check_text(text(start, 1)).findings
    assert (found.code, found.span.line) == ("PID029", 3)
