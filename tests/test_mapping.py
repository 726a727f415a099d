"""The walk of a register map, on a loop with one field of each kind: what follows, and what is left out."""

from __future__ import annotations

import struct
from decimal import Decimal
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pidcfg.encoders.codecs import FLAG, Choice, Implied
from pidcfg.encoders.contract import tables_of
from pidcfg.encoders.image import (
    default_of,
    defaults_of,
    file_data,
    is_enabled,
    settings_of,
    settings_values,
    values_of,
)
from pidcfg.encoders.parameters import raw_of, types_of
from pidcfg.encoders.parameters import register_content as content_of
from pidcfg.encoders.regmap import Bits, RegisterMap, Word, writer_of
from pidcfg.schemas.base import Flag, Integer, Model, Name, Number, Range, Text
from pidcfg.schemas.iec import IecType, Wire
from pidcfg.text.references import CLICK
from pidcfg.text.source import read_document
from pidcfg.validate.engine import check_document
from pidcfg.vendors import VENDORS

# --- The walk of a register map, on a loop with one field of each kind: what follows, and what is left out ------------

BASIS = CLICK.cite("PV Alarm")
WHOLE = Implied(low_count=-1000, high_count=1000)


class Setpoint(Model):
    value: Number | None = None
    limits: Range | None = None
    limits_enabled: Flag | None = None


class Alarms(Model):
    low: Number | None = None
    high: Number | None = None
    enabled: Flag | None = None


class Pulse(Model):
    bit: Text
    period: Integer = 10


class Output(Model):
    unit: Text | None = None
    pulse: Pulse | None = None
    limits: Range = (Decimal(0), Decimal(100))


class Loop(Model):
    name: Name
    gain: Number
    mode: str = "manual"
    verified: Flag = False
    setpoint: Setpoint = Setpoint()
    alarms: Alarms | None = None
    output: Output = Output()
    hysteresis: Number = Decimal(1)


class PulseSettings(Model):
    bit: Text


class OutputSettings(Model):
    unit: Text | None = None
    pulse: PulseSettings | None = None


class LoopSettings(Model):
    loop: Name
    output: OutputSettings = OutputSettings()
    verified: Flag = False
    setpoint: Flag = True


PATHS = {
    "gain": WHOLE,
    "mode": Choice({0: "manual", 1: "auto"}),
    "setpoint.limits.0": WHOLE,
    "setpoint.limits.1": WHOLE,
    "setpoint.limits_enabled": FLAG,
    "alarms.low": WHOLE,
    "alarms.high": WHOLE,
    "output.limits.0": WHOLE,
    "output.limits.1": WHOLE,
    "output.pulse.period": WHOLE,
    "hysteresis": WHOLE,
}
TABLE = RegisterMap(
    title="Test",
    size=len(PATHS) + 1,
    words=tuple(
        Word(n, path.replace(".", "_"), path, codec, "", path, "-", BASIS)
        for n, (path, codec) in enumerate(PATHS.items())
    ),
    bits=(Bits(len(PATHS), (3,), "alarms.enabled", {0: False, 1: True}, "Alarms"),),
)
UNSET = {
    "output.pulse.period": Decimal(3),
    "alarms.low": Decimal(7),
    "setpoint.limits.0": Decimal(5),
    "setpoint.limits.1": Decimal(50),
}


def loop_of(**data):
    return Loop.model_validate({"name": "L", "gain": 2, **data})


def back(loop, always=frozenset()):
    """A loop as a file gives it, from its registers and its settings."""
    words = TABLE.encode(values_of(loop, [TABLE], UNSET), {}).words
    settings = LoopSettings(
        loop=loop.name,
        verified=loop.verified,
        output=OutputSettings(unit=loop.output.unit, pulse=loop.output.pulse and PulseSettings(bit="Y1")),
    )
    values = settings_values(settings) | TABLE.decode(words, {})
    if loop.output.pulse is None:
        values["output.pulse"] = None
    return file_data(Loop, values, TABLE.read_back(defaults_of(Loop, [TABLE], UNSET), {}), always)


@pytest.mark.parametrize("offsets", [(0, 0), (0, 2), (-1, 0)])
def test_a_map_has_room_for_each_of_its_registers_and_the_rest_is_reserved(offsets):
    words = tuple(Word(n, f"w{n}", None, WHOLE, "", "A word", "-", BASIS) for n in offsets)
    with pytest.raises(ValueError, match=f"w{offsets[1]} at |w-1 at .* is taken, or outside the 2 registers"):
        RegisterMap("Test", 2, words).fill_reserved(BASIS)
    kept = RegisterMap("Test", 3, words[:1] if offsets[0] == 0 else words[1:]).fill_reserved(BASIS).words
    assert [(word.offset, word.access) for word in kept] == [(0, "setting"), (1, "reserved"), (2, "reserved")]


NUMBERS = st.integers(-9, 9)
PAIRS = st.tuples(st.integers(-9, 0), st.integers(1, 9)).map(list)
LOOPS = st.fixed_dictionaries(
    {"gain": NUMBERS},
    optional={
        "mode": st.sampled_from(["manual", "auto"]),
        "verified": st.booleans(),
        "setpoint": st.fixed_dictionaries({}, optional={"limits": PAIRS, "limits_enabled": st.booleans()}),
        "alarms": st.fixed_dictionaries({}, optional={"low": NUMBERS, "high": NUMBERS, "enabled": st.booleans()}),
        "output": st.fixed_dictionaries(
            {},
            optional={
                "unit": st.just("%"),
                "limits": PAIRS,
                "pulse": st.fixed_dictionaries({"bit": st.just("Y1")}, optional={"period": NUMBERS}),
            },
        ),
        "hysteresis": NUMBERS,
    },
)


def encoded(loop):
    """The words of a loop, and what did not go in as written."""
    found = TABLE.encode(values_of(loop, [TABLE], UNSET), {})
    return found.words, found.misfits, found.rounded


@given(LOOPS)
def test_a_file_gives_the_registers_that_it_was_read_from(data):
    loop = loop_of(**data)
    assert encoded(loop_of(**back(loop))) == encoded(loop)


@given(LOOPS)
def test_a_file_is_in_the_order_of_its_schema_and_none_is_shorter(data):
    written = back(loop_of(**data))
    assert list(written) == [key for key in Loop.model_fields if key in written]
    assert back(loop_of(**written)) == written


@pytest.mark.parametrize(
    ("data", "path", "on"),
    [
        ({}, "setpoint.limits_enabled", False),
        ({"setpoint": {"limits": [1, 2]}}, "setpoint.limits_enabled", True),
        ({"setpoint": {"limits": [1, 2], "limits_enabled": False}}, "setpoint.limits_enabled", False),
        ({"setpoint": {"limits_enabled": True}}, "setpoint.limits_enabled", True),
        ({}, "alarms.enabled", False),
        ({"alarms": {}}, "alarms.enabled", False),
        ({"alarms": {"low": 0}}, "alarms.enabled", True),
        ({"alarms": {"low": 1, "enabled": False}}, "alarms.enabled", False),
    ],
)
def test_an_enable_bit_follows_from_its_value_unless_it_is_given(data, path, on):
    assert is_enabled(loop_of(**data), path) is on
    assert values_of(loop_of(**data), [TABLE])[path] is on


def test_a_value_that_is_not_given_is_its_default_then_what_the_map_says():
    values = values_of(loop_of(), [TABLE], UNSET)
    assert values["hysteresis"] == 1
    assert (values["output.limits.0"], values["output.limits.1"]) == (0, 100)
    assert (values["setpoint.limits.0"], values["setpoint.limits.1"]) == (5, 50)
    assert values["output.pulse.period"] == 10
    assert values["alarms.low"] == 7
    assert values["alarms.high"] is None
    assert TABLE.read_back(values, {})["alarms.high"] == 0


@pytest.mark.parametrize(
    ("data", "written"),
    [
        ({}, {}),
        ({"mode": "manual", "hysteresis": 1, "output": {"limits": [0, 100]}}, {}),
        ({"hysteresis": 0}, {"hysteresis": 0}),
        ({"setpoint": {"limits": [5, 50], "limits_enabled": False}}, {}),
        ({"setpoint": {"limits": [5, 50]}}, {"setpoint": {"limits": [5, 50]}}),
        ({"alarms": {"high": 3}}, {"alarms": {"low": 7, "high": 3}}),
        ({"alarms": {"high": 3, "enabled": False}}, {"alarms": {"high": 3, "enabled": False}}),
        (
            {"output": {"unit": "%", "pulse": {"bit": "Y1", "period": 10}}},
            {"output": {"unit": "%", "pulse": {"bit": "Y1"}}},
        ),
        ({"verified": True}, {"verified": True}),
    ],
)
def test_what_is_a_default_is_left_out(data, written):
    assert back(loop_of(**data)) == {"name": "L", "gain": 2, **written}


def test_some_fields_are_written_although_they_are_defaults():
    always = frozenset({"mode", "output.pulse.period"})
    assert back(loop_of(), always) == {"name": "L", "gain": 2, "mode": "manual"}
    pulse = {"output": {"pulse": {"bit": "Y1"}}}
    assert back(loop_of(**pulse), always)["output"]["pulse"]["period"] == 10


@pytest.mark.parametrize(
    ("path", "default"),
    [
        ("gain", None),
        ("mode", "manual"),
        ("output.limits.1", Decimal(100)),
        ("output.pulse.period", 10),
        ("alarms.low", None),
        ("setpoint.limits.0", None),
    ],
)
def test_defaults_are_found_by_path(path, default):
    assert default_of(Loop, path) == default


def test_settings_are_what_no_register_holds():
    loop = loop_of(output={"unit": "%", "pulse": {"bit": "Y1"}})
    entry = {"loop": "L", "output": {"unit": "%", "pulse": {"bit": "Y1"}}, "setpoint": False}
    assert settings_of(LoopSettings, loop) == entry
    loop = loop_of(setpoint={"value": 0}, verified=True)
    assert settings_of(LoopSettings, loop) == {"loop": "L", "verified": True}
    explicit = {"loop": "L", "output": {"pulse": None}, "verified": True}
    assert settings_of(LoopSettings, loop, explicit=frozenset({"output.pulse"})) == explicit


# --- Elementary types in registers of 16 bits: what a content is there, and back --------------------------------------

INT, UINT = IecType("INT", "whole", -32768, 32767), IecType("UINT", "whole", 0, 65535)
DINT = IecType("DINT", "whole", -(2**31), 2**31 - 1)
KINDS = IecType("KINDS", "word", words=("P", "PI", "PID"))


@pytest.mark.parametrize(
    ("kind", "content", "raw", "first"),
    [
        (INT, -1, 0xFFFF, "int16"),
        (INT, -32768, 0x8000, "int16"),
        (INT, 32767, 0x7FFF, "int16"),
        (UINT, 65535, 0xFFFF, "uint16"),
        (DINT, -1, 0xFFFFFFFF, "int32"),
        (DINT, -(2**31), 0x80000000, "int32"),
        (DINT, 65536, 0x10000, "int32"),
        (KINDS, "PID", 2, "int16"),
        (IecType("BOOL", "bool"), True, 1, "bool"),
        (IecType("REAL", "real"), -1.5, 0xBFC00000, "float32"),
        (IecType("TIME", "time"), "T#1500ms", 1500, "uint32"),
    ],
)
def test_a_content_is_held_in_the_registers_of_its_size(kind, content, raw, first):
    assert raw_of(kind, content) == raw
    assert content_of(kind, raw) == content
    assert types_of(kind)[0] == first


# --- The registers of the virtual PLCs: each belongs to one loop or to none, and holds what the configuration gives ---

EXAMPLES = Path(__file__).parents[1] / "examples"
MODE_WORDS = {"dl06": {0o2006, 0o2046, 0o2106}, "click": {126, 226}}
"""Where the PLC shows the modes of loops: +06 of those of a DL06, Cn+25 or Cn+26 of those of a CLICK (D952)."""


def raw(content):
    """A content as a register holds it."""
    return struct.unpack("<I", struct.pack("<f", content))[0] if isinstance(content, Decimal | float) else int(content)


@pytest.mark.parametrize(
    ("example", "shared"),
    [
        ("click/brewery", False),
        ("dl06/reactor", True),
        ("dpide/dyeing", False),
        ("ezlogix/greenhouse", False),
        ("nextopid/cascade", True),
    ],
)
def test_every_register_has_its_loop_and_its_content(example, shared):
    vendor = VENDORS[example.partition("/")[0]]
    image = check_document(read_document((EXAMPLES / f"{example}.yaml").read_bytes(), "x.yaml")).encoding.image
    module = vendor.module("controller")
    plc = module.load(image, module.Options())
    registers = vendor.load("virtual")(plc)
    places = registers.loops_by_register()
    held = {loop: registers.contents(loop, plc.signal_values) for loop in {*places.values()}}

    assert {*held} == {*range(-shared, len(plc.loops))}
    assert all({n for n, place in places.items() if place == loop} == {*contents} for loop, contents in held.items())
    given = {n: raw(content) for n, content in image.words.items() if not isinstance(content, Wire)}
    wrong = {n for n, content in given.items() if held[places[n]][n] != content}
    assert wrong == MODE_WORDS.get(vendor.key, set())
    if vendor.key == "dpide":
        assert next(iter(places)) == "VAT.MV", "of several operands in one device MV says what it holds"


# --- Who writes a register or parameter beside the engineer, by the manuals -------------------------------------------

DL06 = {"tuning.reset": 20, "ramp_soak.enabled": False, "remote_setpoint": None}
DPIDE = {"PID_MODE": 0, "MOUT_AUTO": False}
TUNED_BY_DL06 = "sample_rate gain reset rate"
TUNED_BY_DPIDE = "Kc_Kp Ti_Ki Td_Kd Tf"


@pytest.mark.parametrize(
    ("vendor", "values", "live", "operated", "compared"),
    [
        ("dl06", DL06, "pv output bias mode", "setpoint", TUNED_BY_DL06),
        ("dl06", {**DL06, "tuning.reset": 0}, "pv output mode", "setpoint", f"bias {TUNED_BY_DL06}"),
        (
            "dl06",
            {**DL06, "ramp_soak.enabled": True},
            "pv output bias mode setpoint",
            "",
            TUNED_BY_DL06,
        ),
        ("dl06", {**DL06, "remote_setpoint": 1024}, "pv output bias mode setpoint", "", TUNED_BY_DL06),
        (
            "click",
            {},
            "raw_pv output bias mode",
            "setpoint",
            "sample_rate proportional_gain reset_time derivative_gain",
        ),
        (
            "ezlogix",
            {},
            "mode",
            "setpoint",
            "autotune_timeout proportional_gain integral_time derivative_time",
        ),
        ("nextopid", {}, "PV InVar SP_CASC Manual CASC signals", "SP ManualMV", ""),
        ("generic", {}, "mode", "setpoint.value output.manual", ""),
        ("dpide", DPIDE, "PV MV I_MV PID_MAN", "SV PID_RUN MOUT", f"PID_MODE {TUNED_BY_DPIDE}"),
        ("dpide", {**DPIDE, "PID_MODE": 1}, "PV MV I_MV PID_MAN PID_MODE", "SV PID_RUN MOUT", TUNED_BY_DPIDE),
        ("dpide", {**DPIDE, "PID_MODE": 2}, "PV MV I_MV PID_MAN", "SV PID_RUN MOUT", f"PID_MODE {TUNED_BY_DPIDE}"),
        (
            "dpide",
            {**DPIDE, "MOUT_AUTO": True},
            "PV MV I_MV PID_MAN MOUT",
            "SV PID_RUN",
            f"PID_MODE {TUNED_BY_DPIDE}",
        ),
    ],
)
def test_who_writes_a_register(vendor, values, live, operated, compared):
    table = tables_of(VENDORS[vendor]).WRITERS
    writers = {row.name: writer_of(table, row.name, values) for row in table}
    kinds = {name: writer.kind for name, writer in writers.items() if writer is not None}
    wanted = {"live": live, "operated": operated, "compared": compared}
    assert kinds == {name: kind for kind, names in wanted.items() for name in names.split()}


@pytest.mark.parametrize("vendor", VENDORS)
def test_every_writer_is_of_one_of_the_kinds_and_says_who(vendor):
    for row in getattr(tables_of(VENDORS[vendor]), "WRITERS", ()):
        assert row.kind in {"live", "operated", "compared"}, row.name
        assert row.name not in {"live", "operated", "compared"}
        assert " " in row.writer


@pytest.mark.parametrize(
    ("example", "address", "key"),
    [
        ("dl06/reactor", "V2050", ("loops", 1, "tuning", "gain")),
        ("dl06/reactor", "V2040", None),  # many choices of bits
        ("click/brewery", "DF206", ("loops", 1, "tuning", "proportional_gain")),
        ("click/brewery", "C116", None),  # a request
        ("ezlogix/greenhouse", "R103", ("loops", 0, "tuning", "proportional_gain")),
        ("ezlogix/greenhouse", "R113", None),  # the status of an autotune
    ],
)
def test_a_cell_knows_the_key_that_it_comes_from(example, address, key):
    image = check_document(read_document((EXAMPLES / f"{example}.yaml").read_bytes(), "x.yaml")).encoding.image
    assert [cell.path for cell in image.cells if cell.address == address] == [key]


def test_the_request_bit_of_the_auto_tune_starts_it():
    """DL06, bit 7 of +01."""
    image = check_document(read_document((EXAMPLES / "dl06/reactor.yaml").read_bytes(), "x.yaml")).encoding.image
    module = VENDORS["dl06"].module("controller")
    plc = module.load(image, module.Options())
    begun = []
    plc.autotune = begun.append
    registers = VENDORS["dl06"].load("virtual")(plc)
    setting = registers.contents(0, plc.signal_values)[0o2001]
    assert "auto-tune start" not in registers.write(0o2001, setting, plc.signal_values).text
    assert begun == []
    assert registers.write(0o2001, setting | 0x80, plc.signal_values).text == "auto-tune start"
    assert begun == [0]
