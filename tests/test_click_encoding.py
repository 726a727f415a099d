"""CLICK configurations to C, DS and DF registers and back."""

from __future__ import annotations

import struct
from dataclasses import replace
from decimal import Decimal
from pathlib import Path

import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

import pidcfg
from click_strategies import configurations, registers
from pidcfg.encoders.click.files import FORMATS
from pidcfg.encoders.click.image import decode, encode, mode_of
from pidcfg.encoders.codecs import DecodeError
from pidcfg.encoders.listing import Place, reference
from pidcfg.encoders.maps.click import BLOCKS, C_BLOCK, DF_BLOCK, DS_BLOCK, ERRORS, MODE_BITS, SPACE, SUFFIXES, TABLES
from pidcfg.schemas.click import ClickFile
from pidcfg.text.source import read_document
from pidcfg.text.writer import yaml_text

SLOW = settings(deadline=None, suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large])
LOOP = {
    "bits": "C101",
    "integers": "DS201",
    "floats": "DF301",
    "action": "direct",
    "sample_rate": "500 ms",
    "tuning": {"proportional_gain": 1, "reset_time": 10},
    "pv": {"range": [0, 100]},
}
LISTINGS = ("text", "csv", "json", "modbus")


def configuration(**changes) -> ClickFile:
    """A file of one plain loop with some keys changed."""
    loop = {"name": "L1", **LOOP, **changes}
    return ClickFile.model_validate({"pidcfg": 1, "vendor": "click", "loops": [loop]})


def value(address: str, **changes):
    """What an address shows of a plain loop with some keys changed."""
    encoding = encode(configuration(**changes))
    assert encoding.misfits == ()
    return next(c.value for c in encoding.image.cells if c.address == address)


@pytest.mark.parametrize(
    ("changes", "address", "shown"),
    [
        ({}, "DS206", 500),
        ({"sample_rate": "30 s"}, "DS206", 30000),
        ({"sample_rate": "0.1 s"}, "DS206", 100),
        ({}, "C110", False),
        ({"action": "reverse"}, "C110", True),
        ({"bumpless": 1}, "C109", False),
        ({"bumpless": 2}, "C109", True),
        ({"freeze_bias": True}, "C106", True),
        ({"error": {"curve": "squared"}}, "C103", True),
        ({"error": {"deadband": 0.5}}, "C104", True),
        ({"error": {"deadband": 0.5}}, "DF304", 0.5),
        ({"error": {"deadband": 0.5, "deadband_enabled": False}}, "C104", False),
        ({"derivative_gain_limit": 10}, "C105", True),
        ({"derivative_gain_limit": 10}, "DS207", 10),
        ({"autotune": {"method": "closed"}}, "C107", True),
        ({"autotune": {"method": "open", "type": "PI"}}, "C107", False),
        ({"autotune": {"type": "PI"}}, "C108", True),
        ({"pv": {"range": [0, 100], "filter": 80}}, "C112", True),
        ({"pv": {"range": [0, 100], "filter": 80}}, "DS209", 80),
        ({}, "DS209", 100),
        ({}, "DS208", 10),
        ({"output": {"pwm": {"bit": "Y001", "period": 600}}}, "DS208", 600),
        ({}, "DF322", 1.0),
        ({"setpoint": {"value": 105.1}}, "DF301", 105.1),
        ({"setpoint": {"lower_limit": 5}}, "C101", True),
        ({"setpoint": {"lower_limit": 5}}, "C102", False),
        ({"setpoint": {"upper_limit": 95}}, "DF303", 95.0),
        ({"tuning": {"proportional_gain": 2.4, "reset_time": 30, "derivative_gain": 4}}, "DF306", 2.4),
        ({"tuning": {"proportional_gain": 2.4, "reset_time": 30, "derivative_gain": 4}}, "DF307", 30.0),
        ({"tuning": {"proportional_gain": 2.4, "reset_time": 30, "derivative_gain": 4}}, "DF308", 4.0),
        ({"output": {"limits": [5, 95]}}, "DF310", 5.0),
        ({"output": {"limits": [5, 95]}}, "DF311", 95.0),
        ({"pv": {"range": [40, 140]}}, "DF323", 40.0),
        ({"pv": {"range": [40, 140]}}, "DF324", 140.0),
        ({"alarms": {"pv": {"high": 9}}}, "C113", True),
        ({"alarms": {"pv": {"high": 9}}}, "DF316", 9.0),
        ({"alarms": {"deviation": {"high_high": 9}}}, "C114", True),
        ({"alarms": {"deviation": {"high_high": 9}}}, "DF319", 9.0),
        ({"alarms": {"hysteresis": 0.25}}, "DF321", 0.25),
    ],
)
def test_every_parameter_stands_where_the_help_puts_it(changes, address, shown):
    assert value(address, **changes) == shown


def test_the_help_s_example_of_a_rate_alarm():
    """15 degrees a minute at a sample rate of 2 s are half a degree a sample."""
    shown = value("DF320", sample_rate="2 s", alarms={"rate_of_change": plain("15 /min")})
    assert shown == 0.5


def plain(text: str):
    """A text as it comes from a file without quotes."""
    return read_document(f"a: {text}\n".encode(), "t").data["a"]


def test_blocks_have_the_sizes_of_the_help_and_every_register_once():
    assert [(t.size, len(t.words)) for t in TABLES] == [(40, 40), (15, 15), (25, 25)]
    for table in TABLES:
        assert [w.offset for w in table.words] == list(range(table.size))
    cells = encode(configuration()).image.cells
    assert (cells[0].address, cells[40].address, cells[55].address, cells[-1].address) == (
        "C101",
        "DS201",
        "DF301",
        "DF325",
    )


def test_requests_are_never_encoded_and_what_the_controller_owns_only_when_the_file_states_it():
    cells = encode(configuration(mode="auto")).image.cells
    assert not any(c.raw for c in cells if c.access != "setting")
    assert value("DF309", state={"output": 12.5}) == 12.5


def test_every_path_of_the_map_exists_in_the_schema():
    model = configuration(alarms={"pv": {"low": 1}, "deviation": {"high": 1}}, output={"pwm": {"bit": "Y001"}}).loops[0]
    for table in TABLES:
        for path in table.paths():
            found: object = model
            for key in (k for k in path.split(".") if not k.isdigit()):
                assert hasattr(found, key), path
                found = getattr(found, key)


def test_the_table_of_errors_is_in_the_order_of_its_numbers_and_names_registers():
    numbers = [error.number for error in ERRORS]
    assert numbers == sorted(set(numbers))
    names = {w.name for table in TABLES for w in table.words}
    assert {e.register for e in ERRORS} | {e.upper_register for e in ERRORS if e.upper_register} <= names
    named = {w.name for t in (C_BLOCK, DS_BLOCK, DF_BLOCK) for w in t.words if w.access != "reserved"}
    assert named - {*MODE_BITS} | {"reserved_10"} == set(SUFFIXES)


@pytest.mark.parametrize(
    ("bits", "told", "mode"),
    [
        ((0, 0), "", ""),
        ((1, 0), "Manual by C126", "manual (unconfirmed)"),
        ((0, 1), "Auto by C127", "auto (unconfirmed)"),
        ((1, 1), "Manual by C126 and Auto by C127", ""),
    ],
)
def test_the_mode_bits_are_told_as_unconfirmed_and_no_mode_is_taken_from_them(bits, told, mode):
    image = encode(configuration(mode="auto")).image
    words = image.words | {SPACE.number_of("C", 126 + k): bit for k, bit in enumerate(bits)}
    found = decode(words, image.settings)
    start = f"L1: {told}, unconfirmed (D952): if these bits mean something else"
    assert [note[: len(start)] for note in found.notes] == ([start] if told else [])
    assert found.data == decode(image.words, image.settings).data
    assert found.data["loops"][0]["mode"] == "auto"
    assert mode_of(*bits) == mode
    assert not any(image.words[SPACE.number_of("C", 126 + k)] for k in (0, 1))


@SLOW
@given(configurations())
def test_encode_decode_encode_is_identical(config):
    """For random configurations, through every listing; what two of them hold alike is decoded once."""
    image = encode(config).image
    decoded = []
    for name in LISTINGS:
        kind = FORMATS[name]
        listing = kind.read(kind.write(image, ()))
        assert listing.words == image.words, name
        if (listing.settings, listing.plc) in decoded:
            continue
        decoded.append((listing.settings, listing.plc))
        again = decode(listing.words, listing.settings, listing.plc)
        model = ClickFile.model_validate(read_document(yaml_text(again.data).encode(), "again").data)
        back = encode(model).image
        assert (back.words, back.settings) == (image.words, image.settings), name


@SLOW
@given(registers())
def test_registers_come_back_but_for_what_is_not_the_engineer_s(image):
    """Whatever a PLC holds: every setting is in the configuration."""
    beside = [{"loop": "L", "bits": "C1", "integers": "DS1", "floats": "DF1", "output": {"pwm": {"bit": "Y001"}}}]
    data = decode(image, beside).data
    text = yaml_text(data)
    document = read_document(text.encode(), "again")
    assert document.data is not None, text
    encoding = encode(ClickFile.model_validate(document.data))
    again, lost = encoding.image.words, {m.word.name for _, m in encoding.misfits}
    assert not lost
    for prefix, table in BLOCKS.values():
        for row in table.words:
            address = SPACE.number_of(prefix, 1 + row.offset)
            if row.path is not None:
                assert again[address] == image[address], row.name


@SLOW
@given(st.integers(0, 0xFFFFFFFF))
def test_every_float_register_is_read_exactly_or_refused(raw):
    settings_beside = encode(configuration()).image.settings
    image = encode(configuration()).image.words | {SPACE.number_of("DF", 306): raw}
    exact = struct.unpack(">f", raw.to_bytes(4, "big"))[0]
    if raw >> 23 & 0xFF == 0xFF:
        with pytest.raises(DecodeError, match=r"L1, DF306: .* is not a finite number"):
            decode(image, settings_beside)
        return
    assume(raw != 0x80000000)
    gain = decode(image, settings_beside).data["loops"][0]["tuning"]["proportional_gain"]
    assert struct.pack(">f", float(gain)) == struct.pack(">f", exact)


def test_a_value_that_single_precision_cannot_hold_is_a_misfit():
    for gain in ("1e39", "1e-60"):
        config = configuration(tuning={"proportional_gain": Decimal(gain), "reset_time": 1})
        assert [m.path for _, m in encode(config).misfits] == ["tuning.proportional_gain"]


def test_modbus_numbers_are_those_of_the_click():
    """0-based: C1 is coil 16384, DS1 register 0, DF1 registers 28672 and 28673, low word first."""
    rows = FORMATS["modbus"].write(encode(configuration(setpoint={"value": 1.5})).image, ()).splitlines()
    assert "coil,16484,16485,C101,0,0,setting,L1,setpoint_lower_enable" in rows
    assert any(row.startswith("holding,205,40206,DS206,500,01F4,") for row in rows)
    assert any(row.startswith("holding,29272,429273,DF301,0,0000,") for row in rows)
    assert any(row.startswith("holding,29273,429274,DF301,16320,3FC0,") for row in rows), "1.5 is 3FC00000"


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"bits": None}, "where the C bits begin; give --bits"),
        ({"floats": None}, "where the DF registers begin of L1; give --floats"),
        ({"output": {}}, "whether the output is pulsed (PWM) of L1, which no register holds; give --pwm-bit"),
    ],
)
def test_what_a_listing_does_not_say_is_asked_for(changes, message):
    image = encode(configuration()).image
    beside = {k: v for k, v in (dict(image.settings[0]) | changes).items() if v is not None}
    with pytest.raises(DecodeError) as error:
        decode(image.words, [] if "bits" in changes else [beside])
    assert message in str(error.value)


def test_options_complete_a_bare_listing_for_every_loop_in_turn():
    image = encode(configuration()).image
    given_options = {"bits": ["C101"], "integers": ["DS201"], "floats": ["DF301"], "pwm_bit": [None]}
    assert decode(image.words, options=given_options).data["loops"][0]["name"] == "LOOP1"
    with pytest.raises(DecodeError, match="--bits names 2 for 1 loops"):
        decode(image.words, image.settings, options={"bits": ["C101", "C201"]})


def test_decode_says_what_it_cannot_carry():
    image = encode(configuration()).image
    words = {**image.words, SPACE.number_of("C", 117): 1, SPACE.number_of("DS", 201): 27, SPACE.number_of("C", 119): 1}
    assert decode(words, image.settings).notes == (
        "L1: C117 = 1 (Auto mode start request) is not carried over",
        "L1: C119 = 1 (Reserved) is not carried over",
        "L1: DS201 = 27 (PID error number, the lowest active) is not carried over",
    )


def test_a_missing_setting_is_named_and_what_the_controller_writes_may_be_missing():
    image = encode(configuration()).image
    words = {
        a: raw for a, raw in image.words.items() if a not in {SPACE.number_of("C", 132), SPACE.number_of("DF", 309)}
    }
    assert decode(words, image.settings).data == decode(image.words, image.settings).data
    del words[SPACE.number_of("DF", 306)]
    with pytest.raises(DecodeError, match=r"does not hold DF306 \(Proportional gain \(P\)\) of L1"):
        decode(words, image.settings)


def test_the_numbering_finds_what_it_places():
    from pidcfg.encoders.click.files import Numbering

    for prefix, n in (("C", 1), ("C", 2000), ("DS", 1), ("DS", 4500), ("DF", 1), ("DF", 500)):
        place = Numbering.place(SPACE.number_of(prefix, n))
        for part in range(place.width):
            assert Numbering.find(place.table, place.register + part) == (SPACE.number_of(prefix, n), part)
    assert Numbering.place(SPACE.number_of("DF", 1)) == Place("holding", 28672, 2)
    assert Numbering.find("coil", 0) is None, "X001"
    assert Numbering.find("holding", 0xFFFF) is None
    assert Numbering.find("else", 0) is None


@pytest.mark.parametrize("name", ["click"])
def test_the_starter_comes_back(name):
    path = Path(__file__).parents[1] / "src" / "pidcfg" / "cli" / "starters" / f"{name}.yaml"
    config = ClickFile.model_validate(read_document(path.read_bytes(), path.name).data)
    image = encode(config).image
    assert encode(ClickFile.model_validate(decode(image.words, image.settings, image.plc).data)).image == image


@pytest.mark.parametrize("offset", [23, 25])
def test_a_register_that_is_taken_or_outside_its_block_is_refused(offset):
    words = (*(word for word in DF_BLOCK.words if word.access != "reserved"), replace(DF_BLOCK.words[0], offset=offset))
    with pytest.raises(ValueError, match=r"DFn\+2[35] is taken, or outside the 25 registers"):
        replace(DF_BLOCK, words=words).fill_reserved(DF_BLOCK.words[0].basis)


def test_every_setting_of_the_map_has_a_place_in_the_file():
    """Of a register without one, what is written would be lost without a word."""
    assert [w.name for t in TABLES for w in t.words if w.access == "setting" and w.path is None and not t.bits] == []


@pytest.mark.parametrize(("value", "fits"), [(0, True), (1, True), (2, False), (65535, False)])
def test_a_coil_of_a_modbus_map_is_on_or_off(value, fits):
    table, row = "table,register,value", f"coil,16384,{value}"
    found = pidcfg.decode(f"{table}\n{row}\n", "click", format="modbus", annotate=True)
    said = [d.message for d in found.findings]
    assert any(f"{value} is not the state of a switch" in message for message in said) is not fits


@pytest.mark.parametrize(
    ("table", "last", "next_one"),
    [
        ("coil", "09999", "10000"),
        ("discrete", "19999", "110000"),
        ("input", "39999", "310000"),
        ("holding", "49999", "410000"),
    ],
)
def test_a_reference_has_five_digits_up_to_9999_and_six_from_there(table, last, next_one):
    assert (reference(table, 9_998), reference(table, 9_999)) == (last, next_one)
