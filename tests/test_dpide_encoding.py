"""Delta AS configurations to the operands of DPIDE instructions and back."""

from __future__ import annotations

from decimal import Decimal
from typing import get_args

import pytest
from hypothesis import HealthCheck, given, settings
from pydantic import ValidationError

from dpide_strategies import configurations
from pidcfg import api
from pidcfg.encoders.codecs import DecodeError, single_bits
from pidcfg.encoders.dpide.files import device_of, points
from pidcfg.encoders.dpide.image import decode, encode
from pidcfg.encoders.maps.dpide import DPIDE_TABLE, REQUIRED_OPERANDS, ROWS
from pidcfg.encoders.modbus_map import symbol_template_rows
from pidcfg.schemas.dpide import BLOCK_REGISTERS, WORD_REGISTERS, DeviceRange, Devices, DpideFile, Loop, device_range
from pidcfg.schemas.iec import BOOL, DINT, TimeNumber, Wire
from pidcfg.text.source import read_document
from pidcfg.text.writer import yaml_text
from pidcfg.vendors import VENDORS
from standing_rig import SIDES

OPERANDS = (
    "PID_RUN",
    "SV",
    "PV",
    "PID_MODE",
    "PID_MAN",
    "MOUT_AUTO",
    "CYCLE",
    "Kc_Kp",
    "Ti_Ki",
    "Td_Kd",
    "Tf",
    "PID_EQ",
    "PID_DE",
    "PID_DIR",
    "ERR_DBW",
    "MV_MAX",
    "MV_MIN",
    "MOUT",
    "BIAS",
    "I_MV",
    "MV",
)
"""In the order of the instruction."""
SLOW = settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.too_slow])
LOOP = {"device": "D500", "SV": 80, "CYCLE": 1000, "Kc_Kp": 12, "Ti_Ki": 180, "Td_Kd": 20, "MV_MAX": 4000, "MV_MIN": 0}


def configuration(plc: dict | None = None, **changes) -> DpideFile:
    """A file of one plain loop with some keys changed."""
    loop = {"name": "OVEN", **LOOP, **changes}
    return DpideFile.model_validate({"pidcfg": 1, "vendor": "dpide", "plc": plc or {}, "loops": [loop]})


def words(**changes) -> dict:
    """All contents of a plain loop with some keys changed."""
    encoding = encode(configuration(**changes))
    assert encoding.misfits == ()
    return encoding.image.words


def decoded(contents: dict, **beside) -> dict:
    """The only loop of a listing with the device of I_MV beside it."""
    given = {"options": {"device": ["D500"]}} | beside
    return decode(contents, **given).data["loops"][0]


def test_an_instruction_has_all_operands_in_its_order_but_those_from_outside():
    names = [cell.address for cell in encode(configuration()).image.cells]

    assert names == [f"OVEN.{name}" for name in OPERANDS if name not in {"PV", "MV"}]
    assert tuple(ROWS) == OPERANDS
    assert [cell.address for cell in encode(configuration(PV=20)).image.cells][2] == "OVEN.PV"


def test_what_is_not_given_is_false_or_0_and_the_loop_runs():
    found = {name: value for name, value in words().items() if name.removeprefix("OVEN.") not in LOOP}

    assert found.pop("OVEN.PID_RUN") is True
    assert set(map(float, found.values())) == {0.0}
    assert {name.removeprefix("OVEN.") for name, value in found.items() if value is False} == {
        "PID_MAN",
        "MOUT_AUTO",
        "PID_EQ",
        "PID_DE",
        "PID_DIR",
    }


@pytest.mark.parametrize("operand", [row.name for row in DPIDE_TABLE.rows if row.name in Loop.model_fields])
def test_every_operand_is_a_key_and_goes_into_the_operand_of_its_name(operand):
    kind = ROWS[operand].type
    value = True if kind.kind == "bool" else 7
    other = False if kind.kind == "bool" else 9

    assert words(**{operand: value})[f"OVEN.{operand}"] == value
    assert words(**{operand: other})[f"OVEN.{operand}"] == other
    told = decoded(words(**{operand: value}))
    assert told.get(operand, Loop.model_fields[operand].default) == value


@pytest.mark.parametrize(
    ("value", "stored"),
    [
        ("0.1", 0.1),
        ("16777217", 16777216.0),
        ("1.00000005", 1.0),
        ("1.0000001", 1.0000001),
        ("3.4028234663852886e38", 3.4028235e38),
        ("1e-45", 1e-45),
    ],
)
def test_a_real_is_the_nearest_single_and_shown_as_the_shortest_decimal_that_means_it(value, stored):
    content = words(SV=Decimal(value))["OVEN.SV"]

    assert content == stored
    assert str(content) == str(stored)
    assert single_bits(content) == single_bits(float(value))


def test_minus_0_is_0():
    assert str(words(SV=Decimal("-0.0"))["OVEN.SV"]) == "0.0"


@pytest.mark.parametrize(("value", "fault"), [("3.5e38", "range"), ("-3.5e38", "range"), ("1e-60", "off")])
def test_a_real_that_no_single_can_hold_is_a_misfit_with_its_place(value, fault):
    ((place, misfit),) = encode(configuration(BIAS=Decimal(value))).misfits

    assert place == ("loops", 0, "BIAS")
    assert misfit.error.fault == fault
    assert misfit.word.name == "BIAS"


def test_a_misfit_is_at_its_own_loop():
    """Neutral loops have none: every number that can be written is a double."""
    one = configuration(BIAS=Decimal("3.5e38")).loops[0]
    config = configuration().model_copy(update={"loops": (configuration().loops[0], one, one)})
    assert [place[:2] for place, _ in encode(config).misfits] == [("loops", 1), ("loops", 2)]


@pytest.mark.parametrize("operand", ["CYCLE", "PID_MODE"])
def test_a_double_integer_goes_to_both_its_ends_and_no_further(operand):
    assert words(**{operand: DINT.low})[f"OVEN.{operand}"] == -(2**31)
    assert words(**{operand: DINT.high})[f"OVEN.{operand}"] == 2**31 - 1
    for beyond in (DINT.low - 1, DINT.high + 1):
        ((place, misfit),) = encode(configuration(**{operand: beyond})).misfits
        assert (place[-1], misfit.error.fault) == (operand, "range")


@pytest.mark.parametrize(
    ("written", "ms"), [(1000, 1000), ("1 s", 1000), ("250 ms", 250), ("0.1 min", 6000), ("40 s", 40000)]
)
def test_cycle_is_ms_unless_it_carries_a_unit(written, ms):
    found = configuration(CYCLE=written).loops[0].CYCLE

    assert found == ms
    assert configuration(plc={"interrupt_task": written}).plc.interrupt_task == ms


@pytest.mark.parametrize("written", [0.5, "1.5 ms", "0.0001 s", "1 ks", True, None, [1]])
def test_a_cycle_that_is_no_whole_number_of_ms_is_refused(written):
    with pytest.raises(ValidationError):
        configuration(CYCLE=written)


@pytest.mark.parametrize(("written", "seconds"), [("3 min", 180), ("500 ms", Decimal("0.5")), ("1 h", 3600)])
@pytest.mark.parametrize("operand", ["Ti_Ki", "Td_Kd", "Tf"])
def test_times_may_carry_a_unit_and_are_known_as_times_then(operand, written, seconds):
    found = getattr(configuration(**{operand: written}).loops[0], operand)

    assert found == seconds
    assert isinstance(found, TimeNumber)
    assert not isinstance(getattr(configuration(**{operand: 5}).loops[0], operand), TimeNumber)


@pytest.mark.parametrize("key", REQUIRED_OPERANDS)
def test_operands_without_a_default_must_be_given(key):
    loop = {"name": "OVEN", **LOOP}
    del loop[key]
    with pytest.raises(ValidationError, match=key):
        DpideFile.model_validate({"pidcfg": 1, "vendor": "dpide", "loops": [loop]})
    contents = words()
    del contents[f"OVEN.{key}"]
    with pytest.raises(DecodeError, match=f"OVEN.{key}"):
        decoded(contents)


@pytest.mark.parametrize(
    ("operand", "device"),
    [
        ("SV", "D0"),
        ("SV", "D29999"),
        ("PID_RUN", "M8191"),
        ("PID_RUN", "S2047"),
        ("PID_RUN", "SM4095"),
        ("PID_RUN", "X0.0"),
        ("PID_RUN", "Y63.15"),
        ("PID_RUN", "D29999.15"),
    ],
)
def test_devices_that_exist(operand, device):
    config = configuration(devices={operand: device})

    assert config.loops[0].devices.by_operand() == {operand: device}
    assert next(c.device for c in encode(config).image.cells if c.field == operand) == device


@pytest.mark.parametrize(
    ("operand", "device"),
    [
        ("SV", "D30000"),
        ("SV", "M0"),
        ("SV", "D01"),
        ("SV", "d1"),
        ("SV", "D1.0"),
        ("SV", 100),
        ("PID_RUN", "M8192"),
        ("PID_RUN", "S2048"),
        ("PID_RUN", "SM4096"),
        ("PID_RUN", "X64.0"),
        ("PID_RUN", "Y0.16"),
        ("PID_RUN", "D5"),
        ("PID_RUN", "T0"),
        ("PID_RUN", "X0"),
        ("PID_RUN", "M0\n"),
        ("SV", "D1\n"),
        ("SV", "D\u0661"),
        ("I_MV", "D1"),
        ("PID_RNU", "M1"),
    ],
)
def test_devices_that_do_not_exist_or_are_of_the_wrong_kind_are_refused(operand, device):
    with pytest.raises(ValidationError):
        configuration(devices={operand: device})


def test_every_operand_but_the_block_has_a_device_key():
    assert list(Devices.model_fields) == [name for name in ROWS if name != "I_MV"]


def test_a_flag_stands_in_a_bit_and_every_other_operand_in_registers():
    for name in Devices.model_fields:
        bit, register = ROWS[name].type is BOOL, "D100"
        good, bad = ("M10", register) if bit else (register, "M10")
        assert Devices.model_validate({name: good}).by_operand() == {name: good}
        with pytest.raises(ValidationError):
            Devices.model_validate({name: bad})


def test_fields_of_a_loop_are_of_the_types_of_the_operands():
    for name in set(Loop.model_fields) & set(ROWS):
        assert ROWS[name].type in {*Loop.model_fields[name].metadata, *_metadata(Loop.model_fields[name].annotation)}


def _metadata(annotation):
    """What stands beside the type of an optional field."""
    return [item for part in get_args(annotation) for item in getattr(part, "__metadata__", ())]


def test_devices_are_given_in_the_order_of_the_instruction():
    given = {name: "M1" if row.type is BOOL else "D1" for name, row in ROWS.items() if name != "I_MV"}

    assert list(Devices.model_validate(dict(reversed(given.items()))).by_operand()) == list(given)


def test_a_block_takes_30_registers_a_number_2_and_a_flag_its_bit():
    assert device_range("I_MV", "D500") == DeviceRange("D", 500, 529)
    assert device_range("SV", "D500") == DeviceRange("D", 500, 501)
    assert (BLOCK_REGISTERS, WORD_REGISTERS) == (30, 2)
    assert device_range("PID_RUN", "D500.15") == DeviceRange("D", 500, 500, 15)
    assert device_range("PID_RUN", "SM400") == DeviceRange("SM", 400, 400)
    assert device_range("I_MV", "D500").overlaps(device_range("PID_RUN", "D529.0"))
    assert not device_range("I_MV", "D500").overlaps(device_range("SV", "D530"))
    assert not device_range("PID_RUN", "M1").overlaps(device_range("PID_RUN", "SM1"))
    assert not device_range("PID_RUN", "D1.0").overlaps(device_range("PID_MAN", "D1.1"))


def test_what_no_operand_holds_stands_beside_them():
    config = configuration(
        {"interrupt_task": 500}, description="Oven", devices={"PV": "D10"}, pv={"range": [0, 400], "unit": "degC"}
    )
    image = encode(config).image

    assert image.settings == (
        {
            "loop": "OVEN",
            "description": "Oven",
            "device": "D500",
            "devices": {"PV": "D10"},
            "pv": {"range": [0, 400], "unit": "degC"},
        },
    )
    assert image.plc == {"interrupt_task": 500}
    assert next(c.device for c in image.cells if c.field == "I_MV") == "D500"


@SLOW
@given(configurations())
def test_a_configuration_comes_back_with_the_same_operands(config):
    first = encode(config)
    assert first.misfits == ()
    data = decode(first.image.words, first.image.settings, first.image.plc).data
    document = read_document(yaml_text(data).encode(), "again.yaml")
    assert document.problems == ()

    again = encode(DpideFile.model_validate(document.data))

    assert again.image == first.image


def test_defaults_are_left_out_but_never_the_direction_and_the_form():
    data = decoded(words())

    assert {*data} == {"name", *LOOP, "PID_EQ", "PID_DIR"}
    assert data["PID_EQ"] is False
    assert data["PID_DIR"] is False


def test_operands_without_anything_beside_them_need_the_device_of_the_block():
    with pytest.raises(DecodeError, match="--device"):
        decode(words())
    assert decode(words(), options={"device": ["D60"]}).data["loops"][0]["device"] == "D60"


def test_loops_are_found_by_the_names_of_their_operands():
    contents = {**words(), **{name.replace("OVEN", "A.B C"): value for name, value in words().items()}}

    loops = decode(contents, options={"device": ["D0", "D30"]}).data["loops"]

    assert [(loop["name"], loop["device"]) for loop in loops] == [("OVEN", "D0"), ("A.B C", "D30")]
    with pytest.raises(DecodeError, match="names 3 for 2 loops"):
        decode(contents, options={"device": ["D0", "D30", "D60"]})


def test_a_direction_that_a_listing_does_not_hold_is_told():
    contents = words(PID_DIR=True)
    del contents["OVEN.PID_DIR"]
    found = decode(contents, options={"device": ["D500"]})

    assert "PID_DIR" not in found.data["loops"][0]
    assert found.notes == ("OVEN: the listing does not hold PID_DIR, which then is FALSE",)


@pytest.mark.parametrize("name", ["I_MV", "MV"])
def test_what_the_plc_writes_is_told_and_left_out(name):
    found = decode({**words(), f"OVEN.{name}": 12.5}, options={"device": ["D500"]})

    assert name not in found.data["loops"][0]
    assert any(note.startswith(f"OVEN.{name} = 12.5") for note in found.notes)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"OVEN.PID_DRI": True}, "did you mean PID_DIR"),
        ({"OVEN.sv": 1.0}, "not an operand"),
        ({"OVEN.SV": True}, "OVEN.SV"),
        ({"OVEN.SV": "80"}, "OVEN.SV"),
        ({"OVEN.SV": float("nan")}, "OVEN.SV"),
        ({"OVEN.SV": float("inf")}, "OVEN.SV"),
        ({"OVEN.SV": 1e39}, "OVEN.SV"),
        ({"OVEN.SV": None}, "OVEN.SV"),
        ({"OVEN.CYCLE": 0.5}, "OVEN.CYCLE"),
        ({"OVEN.CYCLE": 2**31}, "OVEN.CYCLE"),
        ({"OVEN.PID_RUN": 1}, "OVEN.PID_RUN"),
        ({"OVEN.SV": Wire("a + b")}, "expression"),
        ({"OVEN.SV": [1]}, "OVEN.SV"),
    ],
)
def test_content_that_is_none_is_refused_by_name(changes, message):
    with pytest.raises(DecodeError, match=message) as caught:
        decoded({**words(), **changes})

    assert caught.value.address == next(iter(changes)), "the command names its line"


@pytest.mark.parametrize(
    "settings_",
    [
        [{}],
        [{"loop": "OVEN"}],
        [{"loop": "OVEN", "device": "M5"}],
        [{"loop": "OVEN", "device": 500}],
        [{"loop": ["OVEN"], "device": "D500"}],
        [{"loop": "=OVEN", "device": "D500"}],
        [{"loop": "OTHER", "device": "D500"}],
        [{"loop": "OVEN", "device": "D500", "devices": {"SV": "M0"}}],
        [{"loop": "OVEN", "device": "D500", "devices": []}],
        [{"loop": "OVEN", "device": "D500", "pv": {"range": [1, 0]}}],
        [{"loop": "OVEN", "device": "D500", "action": "direct"}],
    ],
)
def test_settings_that_make_no_sense_are_refused(settings_):
    with pytest.raises(DecodeError):
        decode(words(), settings_)


@pytest.mark.parametrize("plc", [{"interrupt_task": "soon"}, {"interrupt_task": 0.5}, {"cpu": "AS332"}])
def test_settings_of_the_plc_that_make_no_sense_are_refused(plc):
    with pytest.raises(DecodeError, match="plc"):
        decoded(words(), plc=plc)


def test_a_listing_of_nothing_is_refused():
    for contents in ({}, {"OVEN.X": 1.0}, {"SV": 80.0}):
        with pytest.raises(DecodeError, match="no operand"):
            decode(contents)


@pytest.mark.parametrize("vendor", ["dpide", "generic"])
def test_a_loop_that_the_settings_do_not_name_is_named(vendor):
    """Its parameters are not carried over, also where a file holds other names as well."""
    text = SIDES[vendor].config
    other = text[text.index("  - name: TANK") :].replace("TANK", "SPARE").replace("D500", "D600")
    program, decode_loops = api.encode(text + other).image, VENDORS[vendor].load("decode")
    named = [entry for entry in program.settings if entry["loop"] == "TANK"]
    decoded = decode_loops(program.words, named, program.plc)
    assert [loop["name"] for loop in decoded.data["loops"]] == ["TANK"]
    assert "SPARE is not carried over: the settings do not name it" in decoded.notes
    assert not [note for note in decode_loops(program.words, program.settings).notes if "SPARE" in note]


@pytest.mark.parametrize(
    ("text", "device"),
    [
        ("D0", ("D", 0)),
        ("D100", ("D", 100)),
        ("M8191", ("M", 8191)),
        ("SM400", ("SM", 400)),
        ("S7", ("S", 7)),
        ("X0.0", ("X.", 0)),
        ("X0.15", ("X.", 15)),
        ("X1.0", ("X.", 16)),
        ("Y2.3", ("Y.", 35)),
        ("D100.1", ("D.", 1601)),
        ("X0.16", None),
        ("X0", None),
        ("T0", None),
        ("", None),
    ],
)
def test_a_device_is_a_bank_and_a_number_and_bits_of_words_count_on(text, device):
    assert device_of(text) == device


def test_a_map_to_be_filled_in_begins_each_bank_of_bits_as_it_is_written():
    places = {"PID_RUN": "X1.3", "PID_EQ": "Y2.15", "PID_DE": "D7.0", "PID_DIR": "SM9", "SV": "D100"}
    rows = symbol_template_rows(points(encode(configuration(devices=places)).image))
    assert {row for row in rows if "bool" in row} == {f"{bank},coil,,bool" for bank in ("D0.0", "SM0", "X0.0", "Y0.0")}
