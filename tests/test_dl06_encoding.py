"""DL06 configurations to V-memory words and back."""

from __future__ import annotations

from decimal import Decimal
from itertools import product
from pathlib import Path

import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from dl06_strategies import configurations, loop_words
from pidcfg.encoders.codecs import Bcd, DecodeError, EncodeError, Scale
from pidcfg.encoders.dl06 import DATA_FORMATS
from pidcfg.encoders.dl06.files import FORMATS, checklist
from pidcfg.encoders.dl06.image import decode, encode, mode_of, tuning_of
from pidcfg.encoders.listing import ListingError, detect_kind
from pidcfg.encoders.maps.dl06 import FORMATS as FORMATS_OF_DATA
from pidcfg.encoders.maps.dl06 import LOOP_TABLE, LOOP_TABLES, RAMP_SOAK_PAIR, SETUP_WORDS
from pidcfg.schemas.base import Quantity
from pidcfg.schemas.dl06 import Dl06File
from pidcfg.text.source import read_document
from pidcfg.text.writer import yaml_text
from pidcfg.validate.engine import check_document

EXAMPLES = Path(__file__).parents[1] / "examples" / "dl06"
SLOW = settings(deadline=None, suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large])

LOOP = {"name": "L", "sample_rate": 0.2, "action": "direct", "tuning": {"gain": 1}}


def configuration(*loops: dict, **plc) -> Dl06File:
    """A file of loops that differ from a plain one by the keys given."""
    entries = [{**LOOP, "name": f"L{i}", **loop} for i, loop in enumerate(loops, start=1)]
    return Dl06File.model_validate(
        {"pidcfg": 1, "vendor": "dl06", "plc": {"loop_table": "V2000", **plc}, "loops": entries}
    )


def words(*loops: dict, **plc) -> dict[int, int]:
    """Their words by address; nothing may misfit."""
    encoding = encode(configuration(*loops, **plc))
    assert encoding.misfits == ()
    return encoding.image.words


def example(name: str) -> Dl06File:
    """An example file as a model."""
    return Dl06File.model_validate(read_document((EXAMPLES / name).read_bytes(), name).data)


def test_the_data_formats_of_a_conversion_are_those_of_the_registers():
    assert tuple(FORMATS_OF_DATA) == DATA_FORMATS


def test_four_loops_from_v2000_end_at_v2177():
    """Manual, Establishing the Loop Table Size and Location."""
    image = words({}, {}, {}, {})
    assert [a for a in image if a < 0o7640] == list(range(0o2000, 0o2200))
    assert image[0o7640] == 0o2000
    assert image[0o7641] == 0x0004


def test_ramp_soak_pointer_of_the_manual():
    """Manual: V2034 = 3000 octal, held as the plain number 0x0600."""
    assert words({"ramp_soak": {"table": "V3000"}})[0o2034] == 0x0600


@pytest.mark.parametrize(
    ("change", "offset", "word"),
    [
        ({"sample_rate": 0.05}, 0o07, 0x0005),
        ({"sample_rate": 99.99}, 0o07, 0x9999),
        ({"tuning": {"gain": 0.8}}, 0o10, 0x0080),
        ({"tuning": {"gain": 1, "reset": 180.0}}, 0o11, 0x1800),
        ({"tuning": {"gain": 1, "reset": "off"}}, 0o11, 0x0000),
        ({"tuning": {"gain": 1, "rate": 6}}, 0o12, 0x0600),
        ({"tuning": {"gain": 1, "rate": 0.01}}, 0o12, 0x0001),
        ({"tuning": {"gain": 1, "rate": 99.99}}, 0o12, 0x9999),
        ({"tuning": {"gain": 1, "rate": 0}}, 0o12, 0x0000),
        ({"tuning": {"gain": 0}}, 0o10, 0x0000),
        ({"tuning": {"gain": 0.01}}, 0o10, 0x0001),
        ({"tuning": {"gain": 1, "reset": 2, "reset_unit": "minutes"}}, 0o11, 0x0020),
        ({"tuning": {"gain": 1, "reset": 2, "reset_unit": "minutes"}}, 0o01, 0b1_0000),
        ({"setpoint": {"value": 2048}}, 0o02, 0x0800),
        ({"pv": {"filter": 0.5}}, 0o24, 0x0005),
        ({"pv": {"filter": 0.5}}, 0o01, 0b100),
        ({"pv": {"format": "12-bit bipolar"}}, 0o01, 0b1),
        ({"pv": {"format": "15-bit unipolar"}}, 0o01, 0b10),
        ({"pv": {"format": "15-bit bipolar"}}, 0o01, 0b11),
        ({"pv": {"format": "16-bit unipolar"}}, 0o01, 1 << 9),
        ({"output": {"format": "12-bit unipolar"}}, 0o01, 1 << 10),
        ({"output": {"format": "12-bit bipolar"}}, 0o01, 1 << 10 | 1 << 11),
        ({"output": {"format": "15-bit unipolar"}}, 0o01, 1 << 10 | 1 << 12),
        ({"output": {"format": "16-bit unipolar"}}, 0o01, 1 << 10 | 1 << 13),
        ({"pv": {"transfer": {"slot": 1, "channel": 2}}}, 0o36, 0x0102),
        ({"pv": {"transfer": {"address": "V400"}}}, 0o36, 0x8100),
        ({"output": {"transfer": {"slot": 2, "channel": 16}}}, 0o37, 0x0210),
        ({"bumpless": "II"}, 0o00, 1 << 3),
        ({"action": "reverse"}, 0o00, 1 << 4),
        ({"algorithm": "velocity"}, 0o00, 1 << 5),
        ({"pv": {"square_root": True}}, 0o00, 1 << 6),
        ({"error": {"curve": "squared"}}, 0o00, 1 << 7),
        ({"error": {"deadband": 4}}, 0o00, 1 << 8),
        ({"error": {"deadband": 4}}, 0o23, 4),
        ({"derivative_gain_limit": 20}, 0o25, 0x0020),
        ({"derivative_gain_limit": 20}, 0o00, 1 << 9),
        ({"bias_freeze": True}, 0o00, 1 << 10),
        ({"ramp_soak": {"table": "V3000"}}, 0o00, 1 << 11),
        ({"alarms": {"pv": {"low_low": 1, "low": 2, "high": 3, "high_high": 4}}}, 0o00, 1 << 12),
        ({"alarms": {"deviation": {"yellow": 1, "red": 2}}}, 0o00, 1 << 13),
        ({"alarms": {"rate_of_change": 5}}, 0o00, 1 << 14),
        ({"independent_of_cpu_mode": True}, 0o00, 1 << 15),
        ({"setpoint": {"limits": [0, 100]}}, 0o01, 1 << 3),
        ({"autotune": {"method": "open"}}, 0o01, 1 << 5),
        ({"autotune": {"type": "PI"}}, 0o01, 1 << 6),
        ({"autotune": {"start": True}}, 0o01, 1 << 7),
        ({"mode": "auto"}, 0o00, 0),
    ],
)
def test_words_worked_out_by_hand(change, offset, word):
    """Each key against the manual's word and bit tables (numbers are raw counts: there is no range)."""
    assert words(change)[0o2000 + offset] == word


def data_format(*, bipolar: int, fifteen: int, sixteen: int) -> str:
    """Notes 1 and 3 of the manual's table of +01: with the bit of 16 bits on, the other two are not read."""
    return "16-bit unipolar" if sixteen else f"{15 if fifteen else 12}-bit {'bipolar' if bipolar else 'unipolar'}"


def test_every_combination_of_the_bits_of_a_data_format_means_one():
    """Note 2: with bit 10 off the output has the format of the PV."""
    for bits in product((0, 1), repeat=7):
        word = sum(bit << place for bit, place in zip(bits, (0, 1, 9, 10, 11, 12, 13), strict=True))
        pv = data_format(bipolar=bits[0], fifteen=bits[1], sixteen=bits[2])
        output = data_format(bipolar=bits[4], fifteen=bits[5], sixteen=bits[6]) if bits[3] else None
        found = [LOOP_TABLE.find_bits(path).decode(word) for path in ("pv.format", "output.format")]
        assert found == [pv, output], f"{word:014b}"


def test_a_profile_is_in_one_of_16_steps_or_in_none():
    (row,) = (row for row in LOOP_TABLE.bits if row.title.startswith("Current step"))
    assert [row.decode(step << 8 | 0xFF) for step in range(17)] == list(range(17))
    with pytest.raises(DecodeError):
        row.decode(17 << 8)


def test_limits_that_are_not_given_are_the_ends_of_the_data_range():
    image = words({"pv": {"format": "15-bit bipolar"}, "output": {"format": "12-bit unipolar"}})
    assert [image[0o2000 + o] for o in (0o26, 0o27, 0o30, 0o31)] == [0xFFFF, 0x7FFF, 0, 0x0FFF]


def test_hysteresis_that_is_not_given_is_one_count_once_alarms_are_on():
    alarms = {"pv": {"low_low": 1, "low": 2, "high": 3, "high_high": 4}}
    assert words({"alarms": alarms})[0o2022] == 1
    assert words({})[0o2022] == 0


def test_rate_of_change_example_of_the_manual():
    """15 degrees a minute at 10 counts a degree and a sample rate of 2 s is 5 counts a sample."""
    loop = {"sample_rate": 2.0, "pv": {"range": [0, 409.5]}, "alarms": {"rate_of_change": plain("15 /min")}}
    assert words(loop)[0o2021] == 5


@pytest.mark.parametrize(
    ("rate", "word"), [("30 /min", 0), ("90 /min", 2), ("270 /min", 4), ("390 /min", 6), ("0.5 /s", 0)]
)
def test_rates_of_change_round_ties_to_even_exactly(rate, word):
    """One count per unit and one second: 30 a minute is exactly half a count."""
    assert (
        words({"sample_rate": 1, "pv": {"range": [0, 4095]}, "alarms": {"rate_of_change": plain(rate)}})[0o2021] == word
    )


@pytest.mark.parametrize("rate", ["40 counts/min", "40 /min"])
def test_raw_rates_need_not_be_whole_counts_a_sample(rate):
    """40 counts a minute at one second is two thirds of a count, stored as 1."""
    assert words({"sample_rate": 1, "alarms": {"rate_of_change": plain(rate)}})[0o2021] == 1


@pytest.mark.parametrize(
    ("loop", "word"),
    [
        ({"setpoint": {"value": 60}}, "setpoint"),
        ({"setpoint": {"value": "65 counts"}}, "setpoint"),
        ({"setpoint": {"limits": [0, 500]}}, "setpoint_high"),
        ({"error": {"deadband": 51}}, "deadband"),
        ({"ramp_soak": {"table": "V3000", "steps": [{"ramp_to": 200, "slope": 1}]}}, "ramp_to"),
    ],
)
def test_full_scale_of_a_square_root_loop_is_the_end_of_its_range(loop, word):
    """The root of 4095 is 64 counts; a range of 0 to 50 ends there, whatever the word could hold."""
    loop = {**loop, "pv": {"range": [0, 50], "square_root": True}}
    assert [m.word.name for _, m in encode(configuration(loop)).misfits] == [word]
    assert words({"setpoint": {"value": 50}, "pv": loop["pv"]})[0o2002] == 64


def plain(text: str):
    """A text as it comes from a file without quotes."""
    return read_document(f"a: {text}\n".encode(), "t").data["a"]


def test_remote_setpoint_points_at_the_output_of_the_major_loop():
    """Manual: the address of the major loop's table plus offset +05."""
    assert words({"cascade_from": "L2"}, {})[0o2032] == 0o2045


def test_overlapping_set_up_words_win():
    image = encode(configuration({}, loop_table="V7640")).image.words
    assert (image[0o7640], image[0o7641]) == (0o7640, 1)


@pytest.mark.parametrize(
    ("loop", "path"), [({"tuning": {"gain": 120}}, "tuning.gain"), ({"setpoint": {"value": 4096}}, "setpoint.value")]
)
def test_what_does_not_fit_is_reported_and_not_truncated(loop, path):
    encoding = encode(configuration(loop))
    assert [m.path for _, m in encoding.misfits] == [path]


def test_every_writable_word_and_bit_of_the_manual_has_a_key():
    """What the manual's Read/Write column calls writable has a path, but for momentary requests (decision D04)."""
    for table in (LOOP_TABLE, RAMP_SOAK_PAIR, SETUP_WORDS):
        for word in table.words:
            rows = [b for b in table.bits if b.offset == word.offset]
            assert word.path or rows, f"{word.name} cannot be written"
        assert all(b.path or b.access in {"status", "reserved", "request"} for b in table.bits)
    requests = [b.title for b in LOOP_TABLE.bits if b.path is None and b.access == "request"]
    assert requests == ["Manual mode request", "Automatic mode request", "Cascade mode request"]


def test_the_map_covers_every_word_and_every_bit_once():
    assert [w.offset for w in LOOP_TABLE.words] == list(range(0o40))
    for offset in (0o00, 0o01, 0o06, 0o33, 0o35):
        bits = sorted(b for row in LOOP_TABLE.bits if row.offset == offset for b in row.bits)
        assert bits == list(range(16)), f"+{offset:02o}"


def test_every_path_of_the_map_exists_in_the_schema():
    """Each path is settable: a configuration that sets it changes exactly its word or bits."""
    base = {"pidcfg": 1, "vendor": "dl06", "plc": {"loop_table": "V2000"}}
    for row in (*LOOP_TABLE.words, *LOOP_TABLE.bits):
        if row.path is None:
            continue
        keys = [k for k in row.path.split(".") if not k.isdigit()]
        model: object = Dl06File.model_validate(
            {
                **base,
                "loops": [
                    {**LOOP, "ramp_soak": {"table": "V3000"}, "alarms": {"pv": {"low": 1}, "deviation": {"red": 1}}}
                ],
            }
        ).loops[0]
        for key in keys:
            assert hasattr(model, key), row.path
            model = getattr(model, key)


@SLOW
@given(configurations())
def test_encode_decode_encode_is_identical(config):
    """For random configurations, through every file that carries all words; what two hold alike is decoded once."""
    image, decoded = encode(config).image, []
    for kind in FORMATS.values():
        listing = kind.read(kind.write(image, ()))
        assert listing.words == image.words, kind.name
        if (listing.settings, listing.plc) in decoded:
            continue
        decoded.append((listing.settings, listing.plc))
        again = decode(
            listing.words,
            listing.settings,
            listing.plc,
            {"reset_decimals": config.plc.reset_decimals, "number_of_loops": len(config.loops)},
        )
        text = yaml_text(again.data)
        model = Dl06File.model_validate(read_document(text.encode(), "again").data)
        assert encode(model).image.words == image.words, kind.name


@SLOW
@given(loop_words())
def test_every_loop_table_that_means_something_comes_back(table):
    """Decode is lossless: any 32 valid words give a configuration that encodes to them."""
    assume(table[LOOP_TABLE.offset_of("ramp_soak_table")] != 0o2000)  # a profile on top of the loop table: DL276
    image = {0o2000 + i: word for i, word in enumerate(table)} | {0o7640: 0o2000, 0o7641: 1}
    again = encode(Dl06File.model_validate(decode(image).data))
    assert all(m.error.stored is not None for _, m in again.misfits), "beyond full scale of a square-root loop only"
    assert {a: again.image.words[a] for a in image} == image


@SLOW
@given(st.lists(st.integers(0, 0xFFFF), min_size=0o40, max_size=0o40))
def test_arbitrary_words_decode_or_are_refused_by_name(table):
    image = {0o2000 + i: word for i, word in enumerate(table)} | {0o7640: 0o2000, 0o7641: 1}
    outcome = attempt(image)
    assert isinstance(outcome, Dl06File) or "LOOP-1" in str(outcome)


def attempt(image: dict[int, int]) -> Dl06File | DecodeError:
    """The configuration of some words, or why they are none."""
    try:
        return Dl06File.model_validate(decode(image).data)
    except DecodeError as error:
        return error


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.yaml")), ids=lambda p: p.stem)
def test_examples_come_back_with_names_modes_and_units(path):
    if "scenario" in path.name:
        return
    config = example(path.name)
    image = encode(config).image
    again = Dl06File.model_validate(decode(image.words, image.settings, image.plc).data)
    assert encode(again).image == image
    assert [(x.name, x.mode, x.pv.unit) for x in again.loops] == [(x.name, x.mode, x.pv.unit) for x in config.loops]


def test_mode_comes_from_the_status_word_first_then_from_beside_the_words():
    image = encode(configuration({"mode": "auto"})).image
    assert decode(image.words, image.settings).data["loops"][0]["mode"] == "auto"
    assert decode(image.words).data["loops"][0]["mode"] == "manual"
    assert decode({**image.words, 0o2006: 0b100}, image.settings).data["loops"][0]["mode"] == "cascade"


def test_decode_says_what_it_cannot_carry():
    image = encode(configuration({})).image.words
    notes = decode({**image, 0o2006: 0b1000_0000_1010, 0o2000: 1}).notes
    assert [n.partition(": ")[2] for n in notes] == [
        "V2000 0001: Manual mode request is not carried over",
        "V2006 080A: PV low-low alarm is not carried over",
        "V2006 080A: Loop calculation overflow/underflow is not carried over",
    ]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({0o2010: 0x0A00}, "gain (+10): 0x0A00 has a digit above 9"),
        ({0o2002: 0x1000}, "setpoint (+02): 0x1000 is above 0x0FFF"),
        ({0o2033: 0b11}, "combination of bits"),
        ({0o7641: 0x000A}, "V7641: 0x000A has a digit above 9"),
    ],
)
def test_words_that_are_no_values_are_refused_with_their_register(change, message):
    with pytest.raises(DecodeError) as error:
        decode({**words({}), **change})
    assert message in str(error.value)


def test_a_table_of_zeros_and_an_address_in_octal_digits_are_told():
    table = dict.fromkeys(range(0o2000, 0o2040), 0)
    assert any("every word of LOOP-1 is 0" in note for note in decode({0o7640: 0o2000, 0o7641: 1, **table}).notes)
    assert not any("every word" in note for note in decode(words({})).notes)
    with pytest.raises(DecodeError, match=r"V20000 of loop 1: V7640 is 2000, hexadecimal; V2000 is 0400 \(or --loop-"):
        decode({0o7640: 0x2000, 0o7641: 1, **table})
    with pytest.raises(DecodeError, match=r"V2040 of loop 1$"):
        decode({0o7640: 0o2040, 0o7641: 1, **table})


NO_LOOP = "V7641 is 0: the PLC calculates no loop"
ONE_DECIMAL = "the reset words are read with 1 decimal (decision D01); --reset-decimals 2 reads them with two"


@pytest.mark.parametrize(
    ("changes", "options", "notes"),
    [
        ({}, {}, []),
        ({}, {"reset_decimals": 1}, []),
        ({0o2051: 0x0001}, {}, [ONE_DECIMAL]),
        ({0o2051: 0x0001}, {"reset_decimals": 1}, []),
        ({0o2051: 0x0001}, {"reset_decimals": 2}, []),
        ({0o7642: 0x0004}, {}, ["V7642 0004: the PLC's error flags of the set-up are not carried over"]),
        ({0o7641: 0x0000}, {"number_of_loops": 2}, [NO_LOOP]),
        ({0o7641: 0x0000}, {}, [f"{NO_LOOP}; --number-of-loops reads the table all the same"]),
        (
            {0o7641: 0x000A},
            {"number_of_loops": 2},
            ["V7641 is no BCD number: the PLC sets bit 2 of V7642 and calculates no loop (D53)"],
        ),
    ],
)
def test_what_the_set_up_of_a_listing_says_is_told(changes, options, notes):
    assert [*decode({**words({}, {}), **changes}, options=options).notes] == notes


@pytest.mark.parametrize(("word", "stated"), [(2, None), (1, 1), (0, 0), (8, 8), (0x12, 12), (0x000A, None)])
def test_a_number_of_loops_that_is_not_that_of_the_file_is_kept(word, stated):
    data = decode({**words({}, {}), 0o7641: word}, options={"number_of_loops": 2}).data
    assert data["plc"].get("number_of_loops") == stated


OFF_CODES = {
    **dict.fromkeys(("sample_rate", "gain", "rate", "filter", "derivative_gain_limit", "slope", "soak"), (0,)),
    "reset": (0, 9999),
}
"""Digits of the manual that mean something else than their number."""


@pytest.mark.parametrize("decimals", LOOP_TABLES)
def test_each_bcd_word_has_the_off_codes_of_the_manual(decimals):
    codecs = {
        word.name: getattr(word.codec, "bcd", word.codec)
        for table in (LOOP_TABLES[decimals], RAMP_SOAK_PAIR)
        for word in table.words
    }
    found = {name: codec for name, codec in codecs.items() if isinstance(codec, Bcd)}
    assert {name: codec.off for name, codec in found.items()} == OFF_CODES
    places = {"filter": 1, "soak": 1, "derivative_gain_limit": 0, "reset": decimals}
    assert {name: codec.decimals for name, codec in found.items()} == {name: places.get(name, 2) for name in OFF_CODES}


@pytest.mark.parametrize(
    ("pv", "share"),
    [
        ({}, 1.0),
        ({"filter": 0.5}, 0.5),
        ({"filter": 1}, 1.0),
        ({"filter": 0, "filter_enabled": True}, 1.0),
        ({"filter": 0.2, "filter_enabled": False}, 1.0),
        ({"filter": 5}, 1.0),
    ],
)
def test_a_filter_takes_its_share_of_each_difference_where_it_is_on(pv, share):
    config = configuration({"pv": pv})
    assert tuning_of(config, config.loops[0]).pv_share == share


def test_a_value_that_its_word_rounds_is_told_with_its_place():
    encoding = encode(configuration({}, {"tuning": {"gain": 1.234}, "pv": {"filter": 0.54}}))
    found = [(path, row.path, row.word.name, row.value, row.stored) for path, row in encoding.rounded]
    assert found == [
        (("loops", 1, "tuning", "gain"), "tuning.gain", "gain", Decimal("1.234"), Decimal("1.23")),
        (("loops", 1, "pv", "filter"), "pv.filter", "filter", Decimal("0.54"), Decimal("0.5")),
    ]


@pytest.mark.parametrize(
    ("value", "fault", "high"),
    [
        (Quantity(Decimal(10)), "range", "9.999"),
        (Quantity(Decimal(100), counts=True), "range", "99.99"),
        (Quantity(Decimal("0.0001")), "off", "99.99"),
    ],
)
def test_a_slope_that_its_word_does_not_hold_is_told_in_its_own_unit(value, fault, high):
    """Ten counts a unit; the word has two decimals of a count."""
    scale = Scale(FORMATS_OF_DATA["12-bit unipolar"], (Decimal(0), Decimal("409.5")))
    with pytest.raises(EncodeError) as error:
        RAMP_SOAK_PAIR.find_word("slope").encode(value, {"sp": scale})
    assert (error.value.fault, error.value.low, error.value.high) == (fault, 0, Decimal(high))


def test_a_missing_word_is_named():
    image = words({})
    del image[0o2017]
    with pytest.raises(DecodeError, match="V2017 of loop 1"):
        decode(image)


def test_a_listing_without_set_up_words_demands_them():
    image = {a: w for a, w in words({}).items() if a < 0o7640}
    with pytest.raises(DecodeError, match="--loop-table"):
        decode(image)
    again = decode(image, options={"loop_table": 0o2000, "number_of_loops": 1})
    assert again.data["plc"] == {"loop_table": "V2000"}


def test_formats_are_told_apart_by_their_first_characters():
    image = encode(configuration({})).image
    for kind in FORMATS.values():
        assert detect_kind(kind.write(image, ("compare",)), FORMATS) is kind
    assert detect_kind("hello", FORMATS) is None


def test_a_band_beyond_the_bits_of_its_format_is_stored_nowhere():
    alarms = {"deviation": {"yellow": "4096 counts"}}
    [(_, misfit)] = encode(configuration({"alarms": alarms})).misfits
    assert (misfit.path, misfit.error.stored) == ("alarms.deviation.yellow", None)


@pytest.mark.parametrize(
    ("text", "place"), [("  X9 0001\n", (1, 3)), ("V2000  zzzz\n", (1, 8)), ("V2000 0001\n  V2001 \n", (2, 8))]
)
def test_a_listing_is_refused_at_the_column_of_what_is_wrong(text, place):
    with pytest.raises(ListingError) as refused:
        FORMATS["text"].read(text)
    assert (refused.value.line, refused.value.column) == place


def test_modbus_registers_are_the_addresses_themselves():
    """V2000 is register 1024 with reference 41025, V7640 has reference 44001."""
    rows = FORMATS["modbus"].write(encode(configuration({})).image, ()).splitlines()
    assert any(row.startswith("holding,1024,41025,V2000,") for row in rows)
    assert any(row.startswith("holding,4000,44001,V7640,1024,0400") for row in rows)


def test_intel_hex_holds_the_low_byte_first():
    text = FORMATS["ihex"].write(encode(configuration({"setpoint": {"value": 0x0ABC}})).image, ())
    record = next(line for line in text.splitlines() if line.startswith(":10080000"))
    assert record[9:21] == "00000000BC0A"


def test_decimal_values_survive_the_yaml_writer():
    text = yaml_text({"a": [0.1, 1e-05, 100, "2048 counts", "off", "0102"]})
    assert Decimal(read_document(text.encode(), "t").data["a"][1]) == Decimal("0.00001")


def test_a_set_point_that_is_not_given_stays_so():
    image = encode(configuration({}, {"setpoint": {"value": 0}})).image
    assert [entry.get("setpoint") for entry in image.settings] == [False, None]
    loops = decode(image.words, image.settings).data["loops"]
    assert "setpoint" not in loops[0]
    assert loops[1]["setpoint"] == {"value": 0}
    written = {**image.words, 0o2002: 0x0123}
    assert decode(written, image.settings).data["loops"][0]["setpoint"] == {"value": 0x0123}, "no word is dropped"


@pytest.mark.parametrize("decimals", [1, 2])
@pytest.mark.parametrize(("reset", "word"), [("off", 0x0000), ("off 9999", 0x9999)])
def test_both_words_without_integral_come_back_as_they_are(reset, word, decimals):
    """Manual, P-I-D Loop Terms: "0000 or 9999"; its checklist before Auto writes 9999."""
    config = configuration({"tuning": {"gain": 1, "reset": reset}}, reset_decimals=decimals)
    image = encode(config).image
    assert image.words[0o2011] == word

    text = yaml_text(decode(image.words, image.settings, image.plc).data)
    assert f"reset: {reset}, rate" in text
    document = read_document(text.encode(), "again.yaml")
    assert encode(Dl06File.model_validate(document.data)).image.words == image.words
    assert [d.code for d in check_document(document).findings if d.code in {"DL212", "DL502", "DL503"}] == []


def test_the_checklist_says_what_no_download_does():
    transfer = {"pv": {"transfer": {"slot": 1, "channel": 1}}, "output": {"transfer": {"slot": 2, "channel": 1}}}
    loops = (
        {"mode": "cascade", "cascade_from": "L2", **transfer},
        {"mode": "auto", "independent_of_cpu_mode": True},
        {"output": {"transfer": {"slot": 2, "channel": 2}}},
    )
    copies, transition, modes, changes, retentive = checklist(configuration(*loops, reset_decimals=1))

    assert copies == (
        "see that the ladder program copies the PV into the word of L2 (V2043), L3 (V2103): no auto transfer does"
    ), "the output of the major loop L2 is a set point, no module's"
    assert "V7640 and V7641" in transition
    assert "L1 (cascade), L2 (auto), inner loops first: new loops begin in Manual" in modes
    assert "in Manual and the PLC stopped; of L2 set bit 15 of +00 to 0 before" in changes
    assert checklist(configuration(transfer, reset_decimals=1))[:2] == (transition, changes.partition(";")[0])
    last = 0o2000 + 32 * len(loops) - 1
    assert retentive.startswith(f"check that V7640, V7641, V2000 to V{last:o} lie in retentive memory")


@pytest.mark.parametrize(
    ("form", "slope", "most"),
    [
        ("15-bit unipolar", "0.7", "0.6103 degC/s"),
        ("12-bit unipolar", "5", "4.8835 degC/s"),
        ("16-bit unipolar", "0.5", "0.30515 degC/s"),
    ],
)
def test_a_slope_beyond_its_word_is_told_the_limit_in_its_own_unit(form, slope, most):
    text = f"""\
pidcfg: 1
vendor: dl06
plc: {{loop_table: V2000}}
loops:
  - name: K
    sample_rate: 0.5
    action: direct
    tuning: {{gain: 2.5, reset: 60}}
    pv: {{range: [0, 200], unit: degC, format: {form}}}
    ramp_soak: {{table: V3000, steps: [{{ramp_to: 100, slope: {slope}, soak: 1}}]}}
"""
    [found] = [d.message for d in check_document(read_document(text.encode(), "a.yaml")).findings if d.code == "PID102"]
    assert found == f"slope is {slope} degC/s, but its word holds 0 to {most}"


@pytest.mark.parametrize(("table", "steps"), [("V2000", None), ("V1741", None), ("V2037", None), ("V3000", [])])
def test_a_pointer_into_the_loop_table_gives_no_steps(table, steps):
    image = dict.fromkeys(range(0o1741, 0o4000), 0) | words({"ramp_soak": {"table": table, "enabled": False}})
    decoded = decode(image)
    assert decoded.data["loops"][0]["ramp_soak"].get("steps") == steps
    said = [note for note in decoded.notes if "over the loop table" in note]
    wanted = [f"LOOP-1: the ramp/soak table at {table} lies over the loop table: its words are no steps"]
    assert said == (wanted if steps is None else [])


@pytest.mark.parametrize(
    ("word", "mode"),
    [(0x0001, "manual"), (0x0002, "auto"), (0x0004, "cascade"), (0x8FFA, "auto"), (0x0000, ""), (0x0003, "")],
)
def test_the_first_three_bits_of_the_status_word_tell_the_mode(word, mode):
    """Mode/Alarm Monitoring Word (addr + 06): Manual, Auto and Cascade are bits 0, 1 and 2; the others are alarms."""
    assert mode_of(word) == mode
