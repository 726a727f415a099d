"""The set-up of a DL06: areas, limits, decisions and the error word V7642."""

from __future__ import annotations

import json
import re
from decimal import Decimal
from pathlib import Path

import pytest

import golden
import pidcfg
from command import run_text
from pidcfg.encoders.codecs import Bcd, DecodeError, bcd_word
from pidcfg.encoders.dl06.image import Setup, areas, check_ramp_soak, check_setup, is_alarm_order_broken
from pidcfg.encoders.image import Area, AreaError
from pidcfg.encoders.maps.dl06 import (
    LOOP_COUNT,
    LOOP_TABLE,
    LOOP_TABLES,
    RAMP_SOAK_PAIR,
    SETUP_WORDS,
    TABLE_POINTER,
    WRITERS,
)
from pidcfg.sim.controllers import dl06 as dl06_decisions
from pidcfg.sim.controllers.dl06 import ENGINE_DECISIONS
from pidcfg.text.source import read_document
from pidcfg.validate.engine import check_document

# --- V7642, +35 and the alarm order as the CPU works them out, at every edge ------------------------------------------


def flags(start, count):
    return check_setup(start, bcd_word(count)).flags


@pytest.mark.parametrize(
    ("start", "expected"),
    [
        (0o0, 1),
        (0o1177, 1),
        (0o1200, 0),
        (0o7340, 0),
        (0o7341, 1),
        (0o7577, 1),
        (0o7640, 1),
        (0o7777, 1),
        (0o10000, 0),
        (0o17740, 0),
        (0o17741, 2),
        (0o20000, 2),
        (0o177777, 2),
    ],
)
def test_the_start_of_the_table_sets_bit_0_below_v10000_and_bit_1_from_there(start, expected):
    assert flags(start, 1) == expected


@pytest.mark.parametrize(("count", "expected"), [(0, 0), (1, 0), (8, 0), (9, 4), (10, 4)])
def test_more_than_eight_loops_set_bit_2(count, expected):
    assert flags(0o2000, count) == expected


@pytest.mark.parametrize(
    ("start", "count", "expected"),
    [
        (0o7340, 5, 0),  # ends at V7577
        (0o7340, 6, 8),
        (0o7000, 8, 0),  # ends at V7377
        (0o7577 - 0o37, 1, 1),  # V7540 is no start, however short the table
        (0o17740, 8, 0),  # past V17777, which the CPU does not look at
    ],
)
def test_a_table_past_v7577_sets_bit_3_in_the_lower_range_only(start, count, expected):
    assert flags(start, count) == expected


def test_the_last_fitting_start_of_eight_loops_is_v7200():
    assert flags(0o7200, 8) == 0
    assert flags(0o7201, 8) == 8


def test_faults_add_up():
    assert flags(0o7340, 9) == 4 | 8
    assert flags(0o1000, 9) == 1 | 4
    assert flags(0o17777, 9) == 2 | 4


@pytest.mark.parametrize("word", [0x000A, 0x00F0, 0xFFFF])
def test_a_count_that_is_no_bcd_number_counts_as_too_many(word):
    assert check_setup(0o2000, word) == Setup(0o2000, 0, 4)


def test_no_word_makes_the_check_fail():
    """Any 16-bit words can be read; each start belongs to one range, so bits 0 and 1 exclude each other."""
    for start in range(0x10000):
        found = check_setup(start, start ^ 0x1234).flags
        assert 0 <= found < 16
        assert found & 3 != 3


def test_the_loop_task_runs_with_loops_and_without_flags():
    assert check_setup(0o2000, 4).is_running
    assert not check_setup(0o2000, 0).is_running
    assert not check_setup(0o2000, 9).is_running


@pytest.mark.parametrize(
    ("start", "expected"),
    [
        (0o1177, 1),
        (0o1200, 0),
        (0o3000, 0),
        (0o7540, 0),
        (0o7541, 1),
        (0o7577, 1),
        (0o7600, 16),
        (0o7777, 16),
        (0o10000, 0),
        (0o17740, 0),
        (0o17741, 2),
        (0o20000, 2),
        (0, 1),
    ],
)
def test_a_ramp_soak_table_outside_user_memory_sets_one_bit_of_35(start, expected):
    assert check_ramp_soak(start) == expected


@pytest.mark.parametrize(
    ("pv", "deviation", "broken"),
    [
        ([1, 2, 3, 4], None, False),
        ([1, 1, 3, 4], None, True),
        ([1, 2, 2, 4], None, True),
        ([1, 2, 4, 4], None, True),
        ([4, 3, 2, 1], None, True),
        (None, [1, 2], False),
        (None, [2, 2], True),
        (None, [3, 2], True),
        (None, None, False),
        ([1, 2, 3, 4], [2, 1], True),
        ([0, 0, 0, 0], None, True),
    ],
)
def test_alarms_must_be_in_order_when_their_group_is_on(pv, deviation, broken):
    assert is_alarm_order_broken(pv, deviation) is broken


# --- The blocks of a DL06 that a client reads, from the words that say where they are ---------------------------------

EXAMPLES = Path(__file__).parents[1] / "examples"
SETUP = Area(TABLE_POINTER, SETUP_WORDS)
WORDS = {TABLE_POINTER: 0o2000, LOOP_COUNT: 2}
PROFILE = 0o2000 + LOOP_TABLE.offset_of("ramp_soak_table")


def test_the_set_up_words_come_first_and_the_loops_from_them():
    assert areas({}, None, {}) == [SETUP]
    tables = [Area(0o2000, LOOP_TABLES[1], "LOOP-1"), Area(0o2040, LOOP_TABLES[1], "LOOP-2")]
    assert areas(WORDS, None, {}) == [SETUP, *tables]
    assert areas(WORDS, None, {"number_of_loops": 1, "reset_decimals": 2}) == [
        SETUP,
        Area(0o2000, LOOP_TABLES[2], "LOOP-1"),
    ]


def test_a_configuration_names_the_loops_as_far_as_it_has_them():
    like = pidcfg.encode((EXAMPLES / "dl06/oven.yaml").read_text("utf-8")).image
    found = areas({**WORDS, LOOP_COUNT: 3}, like, {})
    assert [area.loop for area in found[1:]] == [*(entry["loop"] for entry in like.settings), "LOOP-2", "LOOP-3"]


@pytest.mark.parametrize(
    ("start", "there"),
    [
        (0o377, False),
        (0o400, True),
        (0o640, True),
        (0o641, False),
        (0o7540, True),
        (0o7541, False),
        (0o17740, True),
        (0o17741, False),
    ],
)
def test_a_profile_is_read_where_its_32_words_are_user_memory(start, there):
    """User memory: V400 to V677 and V10000 to V17777 (Addr + 36), V1200 up to the boundary at V7577 (V7642, bit 3)."""
    pairs = [Area(start + 4 * k, RAMP_SOAK_PAIR, "LOOP-1", f"ramp_soak[{k}].") for k in range(8)] if there else []
    found = areas({**WORDS, PROFILE: start}, None, {"number_of_loops": 1})
    assert found == [SETUP, Area(0o2000, LOOP_TABLES[1], "LOOP-1"), *pairs]


@pytest.mark.parametrize("loop", range(4))
def test_each_loop_has_the_profile_that_its_own_word_points_at(loop):
    found = areas({**WORDS, LOOP_COUNT: 4, PROFILE + 0o40 * loop: 0o3000}, None, {})
    tables = [Area(0o2000 + 0o40 * i, LOOP_TABLES[1], f"LOOP-{i + 1}") for i in range(4)]
    pairs = [Area(0o3000 + 4 * k, RAMP_SOAK_PAIR, f"LOOP-{loop + 1}", f"ramp_soak[{k}].") for k in range(8)]
    assert found == [SETUP, *tables[: loop + 1], *pairs, *tables[loop + 1 :]]


def test_what_a_client_compares_of_a_loop_is_what_neither_the_plc_nor_the_operator_writes():
    """+00: bits 0 to 2 are requests; +01: bit 7 starts an auto-tune, 8 is the PLC's, 14 and 15 are nobody's."""
    masks = Area(0o2000, LOOP_TABLE, "L").kept_masks(WRITERS)
    assert sorted(masks) == [*range(0o2000, 0o2040)]
    kept = {number - 0o2000: mask & 0xFFFF for number, mask in masks.items()}
    nothing = dict.fromkeys((0o02, 0o03, 0o04, 0o05, 0o06, 0o33, 0o35), 0)
    assert {offset: mask for offset, mask in kept.items() if mask != 0xFFFF} == {0: 0xFFF8, 1: 0x3E7F, **nothing}


@pytest.mark.parametrize("count", [0, 9, 0x0A])
def test_a_number_of_loops_that_is_none_is_told_with_the_way_round_it(count):
    with pytest.raises(AreaError, match=f"V7641 holds 0x{count:04X}.*--number-of-loops"):
        areas({**WORDS, LOOP_COUNT: count}, None, {})


# --- Rules of DL06 alarms and tuning at their limits, and the numbers in their messages -------------------------------

LOOP = {
    "name": "A",
    "sample_rate": 1,
    "action": "direct",
    "tuning": {"gain": 2, "reset": "10 s"},
    "pv": {"range": [0, 4095]},
}


def told(**changes):
    """The messages of a loop with other values, by their codes."""
    plc = {"loop_table": "V2000", "reset_decimals": changes.pop("decimals", 1)}
    data = {"pidcfg": 1, "vendor": "dl06", "plc": plc, "loops": [{**LOOP, **changes}]}
    return {d.code: d.message for d in check_document(read_document(json.dumps(data).encode(), "a.yaml")).findings}


def tuned(decimals=1, **tuning):
    return told(tuning={"gain": 2, "reset": "10 s", **tuning}, decimals=decimals)


@pytest.mark.parametrize(
    ("limit", "cure"), [({"rate_of_change": 0}, "give a limit,"), ({"rate_of_change": "1 /min"}, "sample more slowly,")]
)
def test_a_rate_of_change_limit_that_nobody_gave_is_not_cured_by_slower_samples(limit, cure):
    loop = {**LOOP, "alarms": limit}
    data = {"pidcfg": 1, "vendor": "dl06", "plc": {"loop_table": "V2000"}, "loops": [loop]}
    found = check_document(read_document(json.dumps(data).encode(), "a.yaml")).findings

    assert [d.help.startswith(cure) for d in found if d.code == "DL246"] == [True]


def test_a_sample_rate_of_zero_has_no_rate_of_change():
    assert not {"DL246", "DL247", "DL507", "DL219"} & set(told(sample_rate=0, alarms={"rate_of_change": "5 /s"}))
    assert "DL219" not in told(sample_rate=0, tuning={"gain": 2, "reset": "10 s", "rate": 1})


def test_deviation_points_of_zero_are_told_once():
    assert {"DL244", "DL245"} & set(told(alarms={"deviation": {"yellow": 0, "red": 0}})) == {"DL244"}
    assert {"DL244", "DL245"} & set(told(alarms={"deviation": {"yellow": 0, "red": 1}})) == {"DL245"}
    assert {"DL244", "DL245"} & set(told(alarms={"deviation": {"yellow": 1, "red": 2}})) == set()


@pytest.mark.parametrize(
    ("tuning", "decimals", "said"),
    [
        ({"reset": "1000 s"}, 1, "reset is 1000 s; its word holds 0.1 s to 999.8 s; write `reset: 16.7 min`"),
        ({"reset": "1000 s"}, 2, "reset is 1000 s; its word holds 0.01 s to 99.98 s; write `reset: 16.67 min`"),
        ({"reset": "59988 s"}, 1, "write `reset: 999.8 min` and `reset_unit: minutes`"),
        ({"reset": "59994 s"}, 1, "its word holds 0.1 s to 999.8 s"),
        ({"reset": "0.01 min", "reset_unit": "minutes"}, 1, "holds 0.1 min to 999.8 min; write `reset: 0.6 s` and"),
        ({"reset": "0.0005 min", "reset_unit": "minutes"}, 1, "holds 0.1 min to 999.8 min"),
        (
            {"reset": "2.9 s", "reset_unit": "minutes"},
            1,
            "reset is 0.0483333 min; its word holds 0.1 min to 999.8 min; write",
        ),
        ({"reset": "-5 s"}, 1, "a time is not negative"),
    ],
)
def test_a_reset_beyond_its_word_is_met_with_what_the_word_holds(tuning, decimals, said):
    found = tuned(decimals, **tuning)
    assert said in found["DL502"]
    assert ("write" in found["DL502"]) == ("write" in said)
    assert "DL216" not in found


def test_the_code_of_no_integral_is_met_with_the_largest_time():
    assert tuned(1, reset="999.9 s")["DL212"].endswith("the largest reset is 999.8 s")
    assert tuned(2, reset="99.99 s")["DL212"].endswith("the largest reset is 99.98 s")
    assert "DL212" not in tuned(1, reset="999.8 s")


def test_a_reset_of_zero_is_a_code_and_no_fast_integral():
    assert {"DL216", "DL502", "DL503"} & set(tuned(reset="0 s")) == {"DL503"}
    assert {"DL216", "DL502", "DL503"} & set(tuned(reset="0.9 s")) == {"DL216"}


@pytest.mark.parametrize(("gain", "counts"), [(2, 50), (0, 25), (0.5, 12)])
def test_what_a_count_of_noise_does_is_said_with_the_gain(gain, counts):
    assert f"moves the output by {counts} counts" in tuned(gain=gain, rate=25)["DL219"]


@pytest.mark.parametrize(
    ("slope", "said"),
    [(0.0152, "stored as 0.02: the ramp takes 24.0 % less"), (0.014, "as 0.01: the ramp takes 40.0 % longer")],
)
def test_a_rounded_slope_makes_the_ramp_shorter_or_longer(slope, said):
    steps = [{"ramp_to": 100, "slope": slope, "soak": 1}]

    assert said in told(ramp_soak={"table": "V3000", "steps": steps})["DL285"]


def test_an_upper_output_limit_of_zero_is_told_once():
    limits = {low: told(output={"limits": [f"{low} counts", "0 counts"]}) for low in (0, 5)}

    assert [{"DL224", "DL226"} & set(found) for found in limits.values()] == [{"DL226"}, {"DL224"}]


def test_the_last_step_of_a_profile_is_looked_at():
    steps = [*[{"ramp_to": 100, "slope": 1, "soak": 1}] * 7, {"ramp_to": 100, "slope": 0.0152, "soak": 1}]

    assert "DL285" in told(ramp_soak={"table": "V3000", "steps": steps})


@pytest.mark.parametrize(("count", "words"), [(8, "V7340-V7737"), (9, "words from V7340")])
def test_a_loop_table_with_more_loops_than_there_are_is_told_by_its_beginning(count, words):
    plc = {"loop_table": "V7340", "reset_decimals": 1, "number_of_loops": count}
    text = json.dumps({"pidcfg": 1, "vendor": "dl06", "plc": plc, "loops": [LOOP]})

    found = {d.code: d.message for d in check_document(read_document(text.encode(), "a.yaml")).findings}
    assert found["DL204"] == f"the loop table of {count} loops occupies {words}, past the boundary at V7577"


def test_a_key_of_another_place_is_told_its_place():
    text = json.dumps(
        {"pidcfg": 1, "vendor": "dl06", "plc": {"reset_decimals": 1}, "loops": [{**LOOP, "loop_table": "V2000"}]}
    )
    (found,) = (d for d in check_document(read_document(text.encode(), "a.yaml")).findings if d.code == "PID020")

    assert "it belongs below plc" in f"{found.message} {found.help}"


# --- The engine's decisions are numbered without a gap, and each is named where it is carried out ---------------------

SOURCE = Path(dl06_decisions.__file__).parents[3]


def test_numbers_go_on_without_a_gap():
    assert [decision.number for decision in ENGINE_DECISIONS] == [*range(30, 69)]


@pytest.mark.parametrize("decision", ENGINE_DECISIONS, ids=lambda decision: f"D{decision.number}")
def test_a_decision_is_named_where_it_is_carried_out(decision):
    modules = [SOURCE / "encoders" / "dl06" / "image.py", *sorted(Path(dl06_decisions.__file__).parent.glob("*.py"))]
    text = "".join(m.read_text("utf-8") for m in modules if m.name != "__init__.py")

    assert f"D{decision.number}" in text


# --- V7642 at every edge: what the validator says, with the line, and what the words themselves give ------------------

FLAG_LOOP = "  - {{name: L{n}, sample_rate: 0.1, action: direct, tuning: {{gain: 1}}}}"

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
    rows = "\n".join(FLAG_LOOP.format(n=n) for n in range(1, loops + 1))
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


@pytest.mark.parametrize(
    "pv", [{"range": [0, 200], "unit": "degC"}, {}, {"format": "15-bit unipolar", "range": [-5, 3]}]
)
@pytest.mark.parametrize("counts", ["0.1269", "0.0148", "1.234", "0.0062"])
def test_the_two_nearest_slopes_are_told_in_the_unit_of_the_file_and_fit(pv, counts):
    full, width = (32767, 8) if "format" in pv else (4095, 200 if pv else 4095)
    slope = Decimal(counts) * width / full

    def found(value):
        steps = [{"ramp_to": 1, "slope": float(value), "soak": 1, "deviation": 1}]
        loop = {**LOOP, "pv": pv, "ramp_soak": {"table": "V3000", "steps": steps}}
        data = {"pidcfg": 1, "vendor": "dl06", "plc": {"loop_table": "V2000"}, "loops": [loop]}
        checked = check_document(read_document(json.dumps(data).encode(), "a.yaml"))
        return [d for d in checked.findings if d.code == "DL285"]

    cures = [re.findall(r"([\d.e-]+)(?: degC)? a second \(([\d.]+) counts\)", d.help) for d in found(slope)]
    assert bool(cures) == (abs(round(Decimal(counts), 2) / Decimal(counts) - 1) > Decimal("0.01"))
    for cure in cures:
        assert {Decimal(held) for _, held in cure} == {
            step
            for step in (Decimal(counts) // Decimal("0.01") * Decimal("0.01") + k * Decimal("0.01") for k in (0, 1))
            if step
        }
        values = [float(Decimal(held) * width / full) for _, held in cure]
        assert [float(value) for value, _ in cure] == pytest.approx(values, rel=6e-4)
        assert [found(value) for value, _ in cure] == [[]] * len(cure)
    assert all(("15-bit" in d.help) == ("format" not in pv) for d in found(slope))


# --- BCD words that seem typed in decimal, and a loop table that no loop is calculated of: told, and never changed ----


REACTOR = golden.EXAMPLES / "dl06" / "reactor.yaml"


def listing(changes=None, *, bare=False):
    """The words of the reactor as text, some with another content; ``bare``: without what no register holds."""
    lines = pidcfg.encode(REACTOR, format="text").text.splitlines()
    rows = [line.split()[:2] for line in lines if not line.startswith("#")]
    changes = changes or {}
    head = [] if bare else [line for line in lines if line.startswith("#")]
    return "\n".join([*head, *(f"{a} {changes.get(a, word)}" for a, word in rows)]) + "\n"


def decoded(text, **more):
    return pidcfg.decode(text.encode(), "dl06", **more)


@pytest.mark.parametrize(
    ("codec", "word", "said"),
    [
        (Bcd(2), 0x00FA, "it is 250 (typed in decimal? 2.50 would be 0250)"),
        (Bcd(1), 0x070A, "it is 1802 (typed in decimal? 180.2 would be 1802)"),
        (Bcd(0), 0x000A, "it is 10 (typed in decimal? 10 would be 0010)"),
        (Bcd(1, off=(9999,)), 0x270F, "it is 9999 (typed in decimal? 999.9 (off) would be 9999)"),
    ],
)
def test_a_word_that_is_no_bcd_is_told_as_the_number_that_it_is_in_decimal(codec, word, said):
    with pytest.raises(DecodeError, match="has a digit above 9") as error:
        codec.decode(word)
    assert str(error.value).endswith(said)


def test_a_word_beyond_four_digits_was_not_typed_in_decimal():
    with pytest.raises(DecodeError, match=r"has a digit above 9$"):
        Bcd(2).decode(0xFA00)


def test_the_bcd_words_of_the_same_loop_are_suspected_and_nothing_is_changed():
    plain, found = decoded(listing()), decoded(listing({"V2010": "00FA"}))
    assert plain.suggestion == ""
    assert not [note for note in plain.notes if "decimal, too" in note]
    (beside,) = [note for note in found.notes if "typed in decimal, too" in note]
    assert beside.startswith("FIC-102: beside V2010 these may be typed in decimal, too: V2007 0020 is 0.20, or 0.32")
    assert "V2011 0040 is 4.0, or 6.4" in beside
    assert "V2050" not in beside  # another loop
    tuning = [loop["tuning"] for loop in (plain.data["loops"][0], found.data["loops"][0])]
    assert tuning == [{"gain": 0.8, "reset": 4, "rate": 0}, {"gain": 0, "reset": 4, "rate": 0}]
    assert found.data["loops"][1:] == plain.data["loops"][1:]


def test_a_slope_of_a_profile_is_a_bcd_word_of_its_loop():
    found = decoded(listing({"V3001": "00CD"}))
    (beside,) = [note for note in found.notes if "typed in decimal, too" in note]
    assert beside.startswith("TIC-101: beside V3001 ")
    assert "V2050 0250 is 2.50, or 5.92 if 592 was typed in decimal" in beside


@pytest.mark.parametrize("bare", [False, True])
def test_the_suggested_listing_differs_in_the_words_that_are_no_bcd_alone(bare):
    options = {"loop_table": "V2000", "number_of_loops": "3"} if bare else {}
    found = decoded(listing({"V2010": "0050", "V2050": "00FA", "V2047": "00C8"}, bare=bare), options=options)
    assert (
        decoded(found.suggestion, options=options).data
        == decoded(listing({"V2010": "0050"}, bare=bare), options=options).data
    )
    marked = [line.split(None, 1)[0] for line in found.suggestion.splitlines() if "  # " in line]
    assert {"V2047", "V2050", "V2051", "V2052"} <= set(marked)
    assert "V2010" not in marked  # its loop has nothing that is no BCD
    lines = {line.split(None, 1)[0]: line for line in found.suggestion.splitlines()}
    assert lines["V2050"].endswith("# 00FA is no BCD; 2.50 if 250 was typed in decimal")
    assert lines["V2051"].split()[1] == "1800"
    assert lines["V2051"].endswith("# 1800 is 180.0, or 614.4 if 6144 was typed in decimal")


def test_the_command_writes_the_suggestion_on_request_alone(tmp_path):
    (tmp_path / "up.txt").write_text(listing({"V2010": "00FA"}), "utf-8")
    plain = run_text("decode", "up.txt", "--vendor", "dl06", cwd=tmp_path)
    assert "note: --suggest FILE writes the corrected listing, with both readings" in plain.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["up.txt"]
    done = run_text("decode", "up.txt", "--vendor", "dl06", "--suggest", "new.txt", cwd=tmp_path)
    assert (done.returncode, done.stdout) == (0, plain.stdout)
    assert "V2010   0250    592  FIC-102  gain" in (tmp_path / "new.txt").read_text("utf-8")
    again = run_text("decode", "new.txt", "--vendor", "dl06", "--suggest", "none.txt", cwd=tmp_path)
    assert "note: none.txt is not written: no word seems typed in decimal" in again.stderr
    assert not (tmp_path / "none.txt").exists()


@pytest.mark.parametrize("options", [("--suggest", "-"), ("--suggest", "a.txt", "--annotate")])
def test_a_suggestion_needs_a_file_and_no_meanings(tmp_path, options):
    (tmp_path / "up.txt").write_text(listing(), "utf-8")
    done = run_text("decode", "up.txt", "--vendor", "dl06", *options, cwd=tmp_path)
    assert (done.returncode, done.stdout) == (2, "")


def test_a_table_that_no_loop_is_calculated_of_is_told():
    bare = decoded(listing({"V7641": "0000"}, bare=True))
    assert bare.data["loops"] == []
    assert "V7641 is 0: the PLC calculates no loop; --number-of-loops reads the table all the same" in bare.notes
    whole = decoded(listing({"V7641": "0000"}))
    assert len(whole.data["loops"]) == 3
    assert "V7641 is 0: the PLC calculates no loop" in whole.notes
    read = decoded(listing({"V7641": "0000"}, bare=True), options={"number_of_loops": "3"})
    assert len(read.data["loops"]) == 3
    assert "V7641 is 0: the PLC calculates no loop" in read.notes
