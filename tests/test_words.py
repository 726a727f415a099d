"""Codecs of single words: all 65,536 of them."""

from __future__ import annotations

import copy
from decimal import Decimal
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pidcfg.encoders.codecs import (
    FLAG,
    Bcd,
    Binary,
    Choice,
    DecodeError,
    Distance,
    EncodeError,
    Implied,
    Pointer,
    Position,
    Scale,
    SignMagnitude,
    Single,
    pv_before_root,
    round_to_integer,
    shortest_quantity,
    single_bits,
    typed_digits,
)
from pidcfg.encoders.listing import ListingError, read_csv
from pidcfg.encoders.maps.dl06 import FORMATS, LOOP_TABLE, SPACE, Source
from pidcfg.encoders.regmap import BIT, INT16, SINGLE, WORD, Writer, writer_of
from pidcfg.schemas.base import Quantity
from pidcfg.text.references import DL06

BASIS = DL06.cite("Loop Table Word Definitions")

WORDS = range(0x10000)


def accepted(codec) -> int:
    """How many words decode; each of them must encode to itself, every other must be refused."""
    valid = 0
    for word in WORDS:
        try:
            value = codec.decode(word)
        except DecodeError:
            continue
        assert codec.encode(value) == word
        valid += 1
    return valid


@pytest.mark.parametrize("decimals", range(4))
def test_bcd_takes_ten_thousand_words_and_refuses_every_digit_above_nine(decimals):
    codec = Bcd(decimals)
    for word in WORDS:
        if max(f"{word:04X}") >= "A":
            with pytest.raises(DecodeError, match="digit above 9"):
                codec.decode(word)
    assert accepted(codec) == 10_000


@pytest.mark.parametrize(("high", "count"), [(0x0FFF, 4096), (0x7FFF, 32768), (0xFFFF, 65536)])
def test_unsigned_formats_take_exactly_their_counts(high, count):
    assert accepted(Binary(high)) == count


@pytest.mark.parametrize(("high", "count"), [(0x0FFF, 8191), (0x7FFF, 65535)])
def test_sign_magnitude_refuses_minus_zero_and_stray_bits(high, count):
    assert accepted(SignMagnitude(high)) == count
    with pytest.raises(DecodeError, match="minus zero"):
        SignMagnitude(high).decode(0x8000)


def test_bipolar_words_are_those_of_the_sister_manuals():
    assert [SignMagnitude(0x0FFF).encode(n) for n in (0, 4095, -1, -4095)] == [0, 0x0FFF, 0x8001, 0x8FFF]
    assert [SignMagnitude(0x7FFF).encode(n) for n in (32767, -1, -32767)] == [0x7FFF, 0x8001, 0xFFFF]


def test_every_transfer_word_comes_back():
    codec = Source()
    assert codec.decode(0) is None, "0000 means no transfer"
    assert all(codec.encode(codec.decode(word)) == word for word in WORDS if word)


@pytest.mark.parametrize("digit", range(3))
def test_a_place_with_a_digit_too_many_is_refused(digit):
    most = (7, 15, 255)
    assert Source().encode(most) == 0x7FFF
    for value in (-1, most[digit] + 1):
        place = tuple(value if number == digit else 1 for number in range(3))
        with pytest.raises(EncodeError, match="does not fit its digits"):
            Source().encode(place)


def test_an_address_of_a_transfer_has_15_bits():
    assert [Source().encode(address) for address in (0, 0x7FFF)] == [0x8000, 0xFFFF]
    for address in (-1, 0x8000):
        with pytest.raises(EncodeError, match="does not fit the lower 15 bits"):
            Source().encode(address)


def test_auto_transfer_example_of_the_manual():
    assert Source().encode((0, 1, 2)) == 0x0102
    assert Source().encode((0, 1, 16)) == 0x0110
    assert Source().encode(0o2000) == 0x8400


@pytest.mark.parametrize(
    ("codec", "notation"),
    [
        (Bcd(0), "BCD"),
        (Bcd(1), "BCD, 1 decimal"),
        (Bcd(2), "BCD, 2 decimals"),
        (Bcd(2, off=(0,)), "BCD, 2 decimals, 0000 off"),
        (Bcd(1, off=(0, 9999)), "BCD, 1 decimal, 0000 and 9999 off"),
        (Bcd(0, off=(0,)), "BCD, 0000 off"),
    ],
)
def test_a_word_of_decimal_digits_is_told_with_its_decimals_and_what_is_off(codec, notation):
    assert codec.notation == notation


@pytest.mark.parametrize(
    ("decimals", "value", "word"),
    [(2, "0.05", 0x0005), (2, "99.99", 0x9999), (1, "180.0", 0x1800), (1, "999.8", 0x9998), (0, "20", 0x0020)],
)
def test_bcd_figures_worked_out_by_hand(decimals, value, word):
    assert Bcd(decimals).encode(Decimal(value)) == word


def test_a_number_typed_in_decimal_has_four_digits_at_most():
    numbers = (0, 250, 9999, 10_000, 0xFFFF)
    assert [typed_digits(number) for number in numbers] == [0, 0x0250, 0x9999, None, None]


@pytest.mark.parametrize(("value", "word"), [("0.125", 0x0012), ("0.135", 0x0014), ("0.1250001", 0x0013)])
def test_bcd_ties_go_to_the_even_digit(value, word):
    assert Bcd(2).encode(Decimal(value)) == word


@pytest.mark.parametrize("value", ["0.004", "0.005"])
def test_a_value_that_rounds_onto_an_off_code_is_refused(value):
    with pytest.raises(EncodeError, match="switches it off") as error:
        Bcd(2, off=(0,)).encode(Decimal(value))
    assert error.value.fault == "off"
    assert Bcd(2, off=(0,)).encode(Decimal(0)) == 0, "the off code itself may be written"


def test_the_reset_word_refuses_both_of_its_off_codes():
    reset = Bcd(1, off=(0, 9999))
    with pytest.raises(EncodeError):
        reset.encode(Decimal("999.86"))
    assert reset.encode(Decimal("999.84")) == 0x9998
    assert reset.encode(Decimal("999.9")) == 0x9999


@pytest.mark.parametrize("value", ["-0.01", "-0.001", "100", "99.995"])
def test_bcd_range_is_checked_after_rounding_and_before(value):
    with pytest.raises(EncodeError) as error:
        Bcd(2).encode(Decimal(value))
    assert error.value.fault == "range"
    assert (error.value.low, error.value.high) == (0, Decimal("99.99"))


@pytest.mark.parametrize("name", FORMATS)
@pytest.mark.parametrize("limits", [("0", "50"), ("-40", "160.5"), ("32", "212"), ("0.001", "0.002")])
def test_every_count_has_an_engineering_value_that_encodes_back(name, limits):
    """Exhaustive: each position of each format, on ranges that divide badly."""
    scale = Scale(FORMATS[name], (Decimal(limits[0]), Decimal(limits[1])))
    codec = LOOP_TABLE.find_word("pv").codec
    step = 1 if scale.format.span < 10_000 else 7
    for count in range(scale.format.minimum, scale.format.maximum + 1, step):
        word = scale.format.codec.encode(count)
        assert codec.encode(codec.decode(word, scale), scale) == word


@pytest.mark.parametrize("name", FORMATS)
@pytest.mark.parametrize("limits", [("20", "21"), ("1000", "1010"), ("-1001", "-1000"), ("0", "50"), ("990", "1040")])
def test_what_a_word_means_is_near_it_on_a_scale_far_from_zero_too(name, limits):
    """A value that its word holds is not told as another one, which a conversion would write."""
    scale = Scale(FORMATS[name], (Decimal(limits[0]), Decimal(limits[1])))
    codec = LOOP_TABLE.find_word("pv").codec
    for count in range(scale.format.minimum, scale.format.maximum + 1, scale.format.span // 371):
        value = scale.value(count)
        exact = scale.range[0] + (count - scale.zero_counts) * scale.width / scale.format.span
        assert abs(scale.meaning(count) - exact) <= min(scale.width, abs(exact)) / 10_000
        assert codec.coarse_value(value, scale.format.codec.encode(count), scale) is None


@given(
    low=st.decimals(-1000, 1000, places=3),
    width=st.decimals("0.001", 5000, places=3),
    share=st.decimals(0, 1, places=6),
    name=st.sampled_from(sorted(FORMATS)),
)
def test_counts_are_the_nearest_exactly(low, width, share, name):
    """Against exact fractions: Decimal arithmetic with 100 digits never misses a tie."""
    scale = Scale(FORMATS[name], (low, low + width))
    value = low + share * width
    exact = scale.zero_counts + Fraction(value - low) / Fraction(width) * scale.format.span
    assert round_to_integer(scale.position(Quantity(value))) == round(exact)


SPANS = {
    "12-bit unipolar": 4095,
    "12-bit bipolar": 8190,
    "15-bit unipolar": 32767,
    "15-bit bipolar": 65534,
    "16-bit unipolar": 65535,
}


@pytest.mark.parametrize("name", SPANS)
def test_spans_of_the_formats(name):
    assert FORMATS[name].span == SPANS[name]


def test_bipolar_range_has_its_middle_at_zero():
    scale = Scale(FORMATS["12-bit bipolar"], (Decimal(-100), Decimal(100)))
    assert [round_to_integer(scale.position(Quantity(Decimal(v)))) for v in (-100, 0, 100)] == [-4095, 0, 4095]


def counts(number: int) -> Quantity:
    """A number of counts."""
    return Quantity(Decimal(number), counts=True)


def units(text: str) -> Quantity:
    """A number of engineering units."""
    return Quantity(Decimal(text))


@pytest.mark.parametrize(
    ("name", "limits", "root", "values", "spans"),
    [
        ("12-bit unipolar", ("0", "4095"), False, {0: units("0"), 1: units("1"), 4095: units("4095")}, {}),
        ("12-bit unipolar", ("50", "4145"), False, {0: units("50"), 95: units("145")}, {0: units("0"), 9: units("9")}),
        ("12-bit bipolar", ("-100", "719"), False, {-4095: units("-100"), 0: units("309.5"), 4095: units("719")},
         {10: units("1"), 4095: units("409.5"), 4096: counts(4096)}),
        ("12-bit unipolar", ("0", "64"), True, {0: units("0"), 32: units("32"), 64: units("64"), 65: counts(65)},
         {8: units("8"), 64: units("64"), 65: counts(65)}),
        ("15-bit bipolar", None, False, {-5: units("-5"), 7: units("7")}, {7: units("7")}),
    ],
)  # fmt: skip
def test_what_counts_mean_on_a_scale(name, limits, root, values, spans):
    scale = Scale(FORMATS[name], limits and tuple(map(Decimal, limits)), has_root=root)
    assert {count: scale.value(count) for count in values} == values
    assert {count: scale.span_value(count) for count in spans} == spans
    for count, value in values.items():
        assert round_to_integer(scale.position(value)) == count
        if limits and not value.counts:
            assert abs(scale.meaning(count) - value.value) <= abs(value.value) / 1000
    for count, span in spans.items():
        assert round_to_integer(scale.distance(span)) == count
        if limits and not span.counts:
            assert abs(scale.meaning(count, distance=True) - span.value) <= abs(span.value) / 1000
    zero, top = scale.ends
    assert (zero, top) == (counts(0 if root else scale.format.minimum), counts(64 if root else scale.format.maximum))


@pytest.mark.parametrize(
    ("name", "raw", "percent", "value"),
    [
        ("12-bit unipolar", 0, 0, 20),
        ("12-bit unipolar", 4095, 100, 70),
        ("12-bit unipolar", 1024, 25.006, 45.003),
        ("12-bit bipolar", -4095, 0, 20),
        ("12-bit bipolar", 0, 50, 20),
        ("12-bit bipolar", 4095, 100, 55.355),
    ],
)
def test_what_a_pv_is_before_its_root(name, raw, percent, value):
    """A signal of so many percent, and what its root stands for on the set point's range of 20 to 70."""
    pv, root = (Scale(FORMATS[name], (Decimal(20), Decimal(70)), has_root=root) for root in (False, True))
    assert tuple(map(float, pv_before_root(pv, root, raw))) == pytest.approx((percent, value), abs=0.001)
    assert pv_before_root(pv, Scale(FORMATS[name], None, has_root=True), raw)[1] is None


PLAIN = Scale(FORMATS["12-bit unipolar"], (Decimal(0), Decimal(4095)))
ROOT = Scale(FORMATS["12-bit unipolar"], (Decimal(0), Decimal(100)), has_root=True)
BIPOLAR = Scale(FORMATS["12-bit bipolar"], (Decimal(-4095), Decimal(4095)))


@pytest.mark.parametrize(
    ("codec", "scale", "value", "word", "meaning", "excess"),
    [
        (Position("sp"), ROOT, units("50"), 32, None, 0.004),
        (Position("sp"), ROOT, units("49"), 31, 48.44, -0.356),
        (Position("sp"), ROOT, counts(31), 31, None, 0),
        (Position("sp"), ROOT, units("49")._replace(derived=True), 31, None, -0.356),
        (Position("sp"), Scale(FORMATS["12-bit unipolar"]), units("5"), 5, None, 0),
        (Position("pv"), BIPOLAR, units("-5.4"), 0x8005, None, 0.4),
        (Position("pv"), BIPOLAR, units("-9.9"), 0x800A, None, -0.1),
        (Distance("pv"), PLAIN, units("1.4"), 1, 1, -0.4),
        (Distance("pv"), PLAIN, units("30.4"), 30, 30, -0.4),
        (Distance("pv"), PLAIN, units("60.4"), 60, None, -0.4),
        (Distance("pv"), PLAIN, counts(1), 1, None, 0),
        (Distance("pv"), PLAIN, units("1.4")._replace(derived=True), 1, None, -0.4),
    ],
)
def test_a_word_that_is_far_from_its_value_says_what_it_means(codec, scale, value, word, meaning, excess):
    """Far is half a thousandth of the scale for a position, and a hundredth of itself for a band."""
    assert codec.encode(value, scale) == word
    coarse = codec.coarse_value(value, word, scale)
    assert (coarse if coarse is None else float(coarse)) == (
        meaning if meaning is None else pytest.approx(meaning, abs=0.01)
    )
    assert float(codec.rounding_excess(value, word, scale)) == pytest.approx(excess, abs=0.005)


@pytest.mark.parametrize(
    ("codec", "scale", "value", "ends", "stored"),
    [
        (Distance("pv"), PLAIN, units("4096"), (0, 4095), None),
        (Distance("pv"), PLAIN, units("-1"), (0, 4095), None),
        (Distance("pv"), PLAIN, counts(4096), (0, 4095), None),
        (Distance("pv"), BIPOLAR, units("4096"), (0, 4095), None),
        (Distance("pv"), ROOT, units("102"), (0, 100), 65),
        (Distance("pv"), ROOT, counts(4095), (0, 64), 4095),
        (Distance("pv"), ROOT, counts(4096), (0, 64), None),
        (Position("sp"), PLAIN, units("4096"), (0, 4095), None),
        (Position("sp"), PLAIN, units("-1"), (0, 4095), None),
        (Position("sp"), BIPOLAR, units("-4096"), (-4095, 4095), None),
        (Position("sp"), ROOT, units("102"), (0, 100), 65),
        (Position("sp"), ROOT, counts(65), (0, 64), 65),
    ],
)
def test_what_is_beyond_a_scale_is_told_with_its_ends(codec, scale, value, ends, stored):
    with pytest.raises(EncodeError) as error:
        codec.encode(value, scale)
    assert (error.value.fault, str(error.value)) == ("range", OUTSIDE)
    assert (error.value.low, error.value.high, error.value.stored) == (*ends, stored)


def test_the_ends_of_a_scale_are_on_it_and_counts_are_whole():
    half = Quantity(Decimal("1.5"), counts=True)
    for codec in (Distance("pv"), Position("pv")):
        assert [codec.encode(units(text), PLAIN) for text in ("0", "4095")] == [0, 4095]
        assert [codec.encode(counts(number), ROOT) for number in (0, 64)] == [0, 64]
        with pytest.raises(EncodeError, match="is not a whole number of counts") as error:
            codec.encode(half, PLAIN)
        assert error.value.fault == "form"
    assert Distance("pv").encode(half._replace(derived=True), PLAIN) == 2


@pytest.mark.parametrize(
    ("exact", "accepted_text", "found"),
    [
        ("12.3456", "12.35", units("12.35")),
        ("12.3456", "12", units("12")),
        ("0.1234567890123456", "0.123456789012", units("0.123456789012")),
        ("0.1234567890123456", "0.1234567890123", counts(7)),
        ("1E+87", "1E+87", units("1E+87")),
        ("1E+88", "1E+88", counts(7)),
    ],
)
def test_the_shortest_number_that_means_the_same_has_twelve_places_at_most(exact, accepted_text, found):
    assert shortest_quantity(Decimal(exact), lambda one: one.value == Decimal(accepted_text), 7) == found


def test_the_shortest_number_has_no_sign_where_it_is_zero():
    assert str(shortest_quantity(Decimal("-0.04"), lambda _: True, 7).value) == "0"


def test_square_root_scale_runs_to_the_root_of_the_span():
    """Manual: divide the desired SP by the square root of the span: half of 4095 counts over 63.99 is 32."""
    scale = Scale(FORMATS["12-bit unipolar"], (Decimal(0), Decimal(100)), has_root=True)
    assert [round_to_integer(scale.position(Quantity(Decimal(v)))) for v in (0, 50, 100)] == [0, 32, 64]


def test_every_scaled_word_has_a_codec_that_names_a_scale():
    assert {w.scale for w in LOOP_TABLE.words} - {None} == {"pv", "sp", "output"}


@pytest.mark.parametrize("codec", [Implied(), Implied(1), Implied(2), Implied(3, low_count=-0x8000, high_count=0x7FFF)])
def test_integers_with_an_implied_point_take_every_word(codec):
    assert accepted(codec) == 0x10000


def test_implied_points_are_those_of_the_manuals():
    """EZLogix: 125 is 1.25 as a gain and 12.5 as a time; CLICK: the sample rate is in ms."""
    assert Implied(2).decode(125) == Decimal("1.25")
    assert Implied(1).decode(125) == Decimal("12.5")
    assert Implied(1).encode(Decimal("6000.0")) == 60000, "an unsigned word"
    assert Implied(3, low_count=-0x8000, high_count=0x7FFF).encode(Decimal("0.5")) == 500


@pytest.mark.parametrize(
    ("codec", "value"),
    [
        (Implied(), "65536"),
        (Implied(), "-1"),
        (Implied(1), "6553.55"),
        (Implied(2), "-0.001"),
        (Implied(0, low_count=-0x8000, high_count=0x7FFF), "32768"),
    ],
)
def test_integers_outside_their_word_are_refused(codec, value):
    with pytest.raises(EncodeError) as error:
        codec.encode(Decimal(value))
    assert error.value.fault == "range"


SIGNED = Implied(1, low_count=-0x8000, high_count=0x7FFF)
OUTSIDE = "is outside the word's range"
LARGEST = "3.4028234663852886E+38"


@pytest.mark.parametrize(
    ("codec", "value", "fault", "message", "ends"),
    [
        (Bcd(2), "100", "range", OUTSIDE, ("0", "99.99")),
        (Bcd(2), "-0.001", "range", OUTSIDE, ("0", "99.99")),
        (Bcd(1, off=(5,)), "0.52", "off", "rounds to 0.5, which switches it off", ("0", "999.9")),
        (Implied(1, off=(5,)), "0.52", "off", "rounds to 0.5, which switches it off", ("0", "6553.5")),
        (SIGNED, "3276.8", "range", OUTSIDE, ("-3276.8", "3276.7")),
        (SIGNED, "-3276.81", "range", OUTSIDE, ("-3276.8", "3276.7")),
        (Binary(4095), 4096, "range", OUTSIDE, ("0", "4095")),
        (Binary(4095), -1, "range", OUTSIDE, ("0", "4095")),
        (SignMagnitude(4095), -4096, "range", OUTSIDE, ("-4095", "4095")),
        (Single(), "3.5E38", "range", "is outside the range of single precision", (f"-{LARGEST}", LARGEST)),
        (Single(), "1E-50", "off", "rounds to 0 in single precision", None),
    ],
)
def test_what_a_word_does_not_hold_is_told_with_what_it_holds(codec, value, fault, message, ends):
    with pytest.raises(EncodeError) as error:
        codec.encode(Decimal(value) if isinstance(value, str) else value)
    assert (error.value.fault, str(error.value)) == (fault, message)
    assert (error.value.low, error.value.high) == (tuple(map(Decimal, ends)) if ends else (None, None))


@pytest.mark.parametrize(
    ("codec", "word", "message"),
    [
        (Bcd(0), 0x0A00, "0x0A00 has a digit above 9; it is 2560 (typed in decimal? 2560 would be 2560)"),
        (Bcd(1), 0x00FA, "0x00FA has a digit above 9; it is 250 (typed in decimal? 25.0 would be 0250)"),
        (Bcd(0), 0xFFFF, "0xFFFF has a digit above 9"),
        (Binary(4095), 4096, "0x1000 is above 0x0FFF"),
        (SignMagnitude(4095), 0x9000, "0x9000 has bits set above 0x0FFF and the sign"),
        (SignMagnitude(4095), 0x8000, "0x8000 is minus zero"),
        (FLAG, 2, "2 is not the state of a switch"),
        (Single(), 0x7F800000, "0x7F800000 is not a finite number"),
    ],
)
def test_a_word_that_is_no_value_says_why(codec, word, message):
    with pytest.raises(DecodeError) as error:
        codec.decode(word)
    assert str(error.value) == message


def test_a_time_that_rounds_onto_zero_is_refused():
    for value in ("0.04", "0.05"):
        with pytest.raises(EncodeError, match="switches it off"):
            Implied(1, off=(0,)).encode(Decimal(value))
    assert Implied(1, off=(0,)).encode(Decimal("0.051")) == 1
    assert Implied(1, off=(5,)).encode(Decimal("0.5")) == Bcd(1, off=(5,)).encode(Decimal("0.5")) == 5  # as it is


def test_a_switch_has_two_states():
    assert [FLAG.decode(0), FLAG.decode(1)] == [False, True]
    with pytest.raises(DecodeError):
        FLAG.decode(2)


def test_a_copy_of_a_kind_is_the_kind_itself():
    for kind in (BIT, INT16, SINGLE, WORD):
        assert copy.copy(kind) is copy.deepcopy(kind) is kind


def test_kinds_show_and_read_every_word_alike():
    for kind in (WORD, INT16):
        assert all(kind.read(kind.show(word)) == word for word in WORDS)
    assert [INT16.show(w) for w in (0, 0x7FFF, 0x8000, 0xFFFF)] == [0, 32767, -32768, -1]
    assert [BIT.read(x) for x in (False, True, 0, 1, -1, 2, "1", 1.0)] == [0, 1, 0, 1] + [None] * 4
    assert [WORD.read(x) for x in (65535, 65536, -1, True, 1.0, "1")] == [65535, None, None, None, None, None]
    assert [INT16.read(x) for x in (32767, 32768, -32768, -32769)] == [0x7FFF, None, 0x8000, None]
    assert [SINGLE.read(x) for x in (1.5, 1, float("nan"), 1e39, True, "1")] == [0x3FC00000, 0x3F800000] + [None] * 4
    assert [str(SINGLE.show(raw)) for raw in (0x7F800000, 0xFF800000, 0x7FC00000)] == ["inf", "-inf", "nan"]


@given(st.floats(width=32, allow_nan=False, allow_infinity=False))
def test_single_precision_shows_the_shortest_decimal_that_means_the_same(value):
    raw = single_bits(value)
    shown = SINGLE.show(raw)
    assert SINGLE.read(shown) == raw
    if value:
        assert Single().encode(Single().decode(raw)) == raw
        assert len(Decimal(repr(shown)).normalize().as_tuple().digits) <= 9


@pytest.mark.parametrize(
    ("text", "raw"),
    [
        ("2.4", 0x4019999A),
        ("0.1", 0x3DCCCCCD),
        ("16777217", 0x4B800000),
        ("16777219", 0x4B800002),
        ("-0.5", 0xBF000000),
        ("1.000000059604644775390625", 0x3F800000),  # half way
        ("1.00000005960464477539062501", 0x3F800001),  # and more, which a double does not see
        ("1.000000178813934326171875", 0x3F800002),
        ("1.00000017881393432617187499", 0x3F800001),
        ("-1.00000005960464477539062501", 0xBF800001),
    ],
)
def test_single_precision_rounds_to_the_nearest_ties_to_even(text, raw):
    assert Single().encode(Decimal(text)) == raw


@pytest.mark.parametrize(
    ("codec", "value", "word"),
    [
        (Implied(), "0", 0),
        (Implied(), "65535", 0xFFFF),
        (Implied(1), "6553.5", 0xFFFF),
        (Implied(2), "327.68", 0x8000),
        (SIGNED, "-3276.8", 0x8000),
        (SIGNED, "-0.1", 0xFFFF),
        (SIGNED, "0.5", 5),
        (SIGNED, "3276.7", 0x7FFF),
        (Bcd(2), "0", 0),
        (Bcd(2), "99.99", 0x9999),
        (Single(), "0", 0),
        (Single(), "1E-45", 1),
        (Single(), "16777216", 0x4B800000),
        (Single(), "3.4028235E+38", 0x7F7FFFFF),
    ],
)
def test_each_end_of_a_word_is_a_value_of_it(codec, value, word):
    assert codec.encode(Decimal(value)) == word
    assert codec.decode(word) == Decimal(value)


def test_zero_has_no_sign_in_single_precision():
    assert Single().encode(Decimal("-0")) == 0
    assert Single().decode(0x80000000) == 0


def test_some_numbers_in_single_precision_need_nine_digits():
    needed = {raw: len(Decimal(repr(SINGLE.show(raw))).as_tuple().digits) for raw in range(0x447A0000, 0x447A0040)}
    assert max(needed.values()) == 9
    assert all(SINGLE.read(SINGLE.show(raw)) == raw for raw in needed)


@pytest.mark.parametrize("sign", [1, -1])
def test_a_number_beside_half_way_between_two_is_not_taken_for_half_way(sign):
    """Its double is one digit of a double away from it, and the next one is half way."""
    half, digit = 1 + Decimal(2) ** -24, Decimal(2) ** -52
    for part, raw in (("0.9", 0x3F800001), ("0.1", 0x3F800001), ("0", 0x3F800000), ("-0.1", 0x3F800000)):
        assert Single().encode(sign * (half + Decimal(part) * digit)) == raw | (0x80000000 if sign < 0 else 0)


def test_a_pointer_of_0_points_nowhere():
    assert [Pointer.spell(word, SPACE.name) for word in (0, 1, 0o2000)] == ["none", "V1", "V2000"]


@pytest.mark.parametrize(
    ("codec", "text"),
    [
        (Single(), "float"),
        (Position("pv"), "counts"),
        (Distance("pv"), "counts, a difference"),
        (Binary(), "binary"),
        (FLAG, "0 false, 1 true"),
        (Choice({0: "open", 1: "closed"}), "0 open, 1 closed"),
        (Choice({0: 1, 1: 2}), "0 1, 1 2"),
        (Implied(), "integer"),
        (Implied(low_count=-1), "signed integer"),
        (Implied(2, off=(0, 9999)), "integer of 0.01, 0 and 9999 off"),
    ],
)
def test_a_number_with_an_implied_point_says_how_it_is_written(codec, text):
    assert codec.notation == text


@pytest.mark.parametrize(("name", "auto", "by"), [("mode", True, "a"), ("mode", False, "b"), ("other", True, None)])
def test_the_first_writer_of_a_register_that_holds_for_the_loop_is_named(name, auto, by):
    rows = [
        Writer("mode", "live", "a", BASIS, lambda values: values["auto"]),
        Writer("mode", "live", "b", BASIS),
        Writer("gain", "live", "c", BASIS),
    ]
    found = writer_of(rows, name, {"auto": auto})
    assert (found and found.writer) == by


def test_a_row_of_a_listing_is_refused_at_its_line_and_column():
    for row in ("DS1,0001", "V2001,XYZ"):
        with pytest.raises(ListingError) as found:
            read_csv(f"address,hex\nV2000,0001\n{row}\n", SPACE)
        assert (found.value.line, found.value.column) == (3, 1)
