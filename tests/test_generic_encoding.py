"""Neutral files to named parameters and back."""

from __future__ import annotations

from decimal import Decimal
from itertools import permutations
from pathlib import Path
from typing import get_args

import pytest
from hypothesis import given, settings
from pydantic import BaseModel

from generic_rig import PLAIN, configurations, file_of
from pidcfg.encoders.codecs import DecodeError
from pidcfg.encoders.generic import DECODE_OPTIONS
from pidcfg.encoders.generic.files import FORMATS, checklist
from pidcfg.encoders.generic.image import decode, encode
from pidcfg.encoders.maps.generic import LOOPS, REQUIRED_FIELDS, ROWS, TUNING_NUMBERS
from pidcfg.encoders.parameters import TYPES, store_content
from pidcfg.schemas.generic import GenericFile, Loop
from pidcfg.schemas.iec import LREAL, Wire

STARTER = Path(__file__).parents[1] / "src/pidcfg/cli/starters/generic.yaml"
BESIDE = {"name", "description", "pv.unit", "output.unit", "setpoint.source", "setpoint.follows_pv"}
"""Fields that no parameter holds."""


def leaves(model, above=""):
    """The paths of all fields; pairs are two."""
    for name, field in model.model_fields.items():
        kinds = (field.annotation, *get_args(field.annotation))
        inner = next((k for k in kinds if isinstance(k, type) and issubclass(k, BaseModel)), None)
        if inner is not None:
            yield from leaves(inner, f"{above}{name}.")
        elif "tuple" in str(field.annotation):
            yield from (f"{above}{name}.{i}" for i in range(2))
        else:
            yield above + name


def back(config, kind=None):
    """What comes back, through a file of some format."""
    image = encode(config).image
    if kind is None:
        found = decode(image.words, image.settings, image.plc)
    else:
        listing = FORMATS[kind].read(FORMATS[kind].write(image, checklist(config)))
        found = decode(listing.words, listing.settings, listing.plc)
    assert found.notes == ()
    return GenericFile.model_validate(found.data)


def image_of(**changes):
    image = encode(file_of(changes)).image
    return dict(image.words), image.settings


def test_the_table_has_every_field_once():
    assert sorted([*ROWS, *BESIDE]) == sorted(leaves(Loop))
    assert {path for path in ROWS if path.partition(".")[0] in REQUIRED_FIELDS} | set(REQUIRED_FIELDS) == set(
        REQUIRED_FIELDS
    )


def test_no_path_is_the_end_of_another_so_that_names_with_dots_are_clear():
    assert not [(a, b) for a, b in permutations(ROWS, 2) if a.endswith(f".{b}")]
    assert LOOPS.split_name("A.pv.pv.range.0") == ("A.pv", "pv.range.0")
    assert LOOPS.split_name("TIC-101.tuning.gain") == ("TIC-101", "tuning.gain")
    assert LOOPS.split_name("tuning.gain") == ("", "")
    assert LOOPS.split_name("TIC-101.tuning.gian") == ("", "")


@settings(max_examples=40)
@given(configurations())
def test_every_way_there_and_back_gives_the_same_file(config):
    for kind in (None, "text", "csv", "json"):
        again = back(config, kind)
        assert again == config
    assert encode(again).image == encode(config).image


def test_a_double_is_kept_to_the_last_bit():
    value = Decimal("0.1234567890123456")
    config = file_of({"tuning": {"gain": value}})

    assert encode(config).image.words["L1.tuning.gain"] == 0.1234567890123456
    assert back(config, "text").loops[0].tuning.gain == value


def test_what_is_not_given_is_no_parameter():
    words, settings = image_of()

    assert "L1.output.max_rate" not in words
    assert "L1.alarms.pv.high" not in words
    assert words["L1.tuning.integral_time"] == 0.0
    assert words["L1.mode"] == "auto"
    assert settings == ({"loop": "L1"},)


def test_units_names_and_sources_stand_beside_the_parameters():
    config = file_of({}, {"setpoint": {"source": "L1"}, "pv": {"range": [0, 1], "unit": "bar"}, "description": "x"})

    assert encode(config).image.settings[1] == {
        "loop": "L2",
        "description": "x",
        "pv": {"unit": "bar"},
        "setpoint": {"source": "L1"},
    }


def test_whether_the_set_point_follows_stands_there_too():
    config = file_of({"setpoint": {"follows_pv": False}}, {"setpoint": {"follows_pv": True}})

    assert [entry["setpoint"]["follows_pv"] for entry in encode(config).image.settings] == [False, True]
    assert back(config, "text") == config


def test_a_listing_alone_is_a_configuration():
    words, _ = image_of(output={"range": [0, 10], "pulse": {"period": 5}})

    data = decode(words).data

    assert data["loops"][0]["output"] == {"range": [0, 10], "pulse": {"period": 5}}
    assert data["loops"][0]["name"] == "L1"


@pytest.mark.parametrize("path", REQUIRED_FIELDS)
def test_what_every_loop_has_must_stand_in_the_listing(path):
    words, settings = image_of()
    del words[f"L1.{path}"]

    with pytest.raises(DecodeError, match=rf"L1\.{path}"):
        decode(words, settings)


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("L1.tuning.gian", 1.0, "did you mean tuning.gain"),
        ("L1.tuning.gain", True, "is not a value of LREAL"),
        ("L1.tuning.gain", 10**309, "is not a value of LREAL"),
        ("L1.tuning.gain", float("nan"), "is not a value of LREAL"),
        ("L1.tuning.gain", Wire("A + 1"), "expression"),
        ("L1.mode", "autotune", "is not a value of LOOP_MODE"),
        ("L1.output.limits.0", 1.0, "L1.output.limits.1"),
        ("L1.setpoint.limits.1", 1.0, "L1.setpoint.limits.0"),
    ],
)
def test_a_wrong_parameter_is_refused_by_name(name, content, said):
    words, settings = image_of()

    with pytest.raises(DecodeError, match=said):
        decode(words | {name: content}, settings)


def test_an_empty_listing_is_refused():
    with pytest.raises(DecodeError, match="holds no parameter"):
        decode({"X.y": 1.0})


def test_loops_that_the_settings_do_not_name_are_told():
    words, settings = image_of()

    notes = decode(words | {"X.tuning.gain": 1.0}, settings).notes

    assert notes == ("X is not carried over: the settings do not name it",)


def test_words_and_doubles_are_types_of_listings():
    assert {"LREAL", "LOOP_MODE", "DERIVATIVE_OF"} <= set(TYPES)
    assert store_content(LREAL, Decimal("0.1")) == 0.1
    assert DECODE_OPTIONS == ()


def test_the_checklist_says_the_direction():
    assert (
        "L1 the PV rises when the output rises; L2 the PV falls"
        in checklist(file_of({}, {"output_raises_pv": False}))[1]
    )
    assert checklist(GenericFile.model_validate({"pidcfg": 1, "vendor": "generic", "loops": []})) == ()


def test_tuning_finds_its_fields():
    assert [TUNING_NUMBERS.key(name) for name in TUNING_NUMBERS.names] == [*TUNING_NUMBERS.names]
    assert [TUNING_NUMBERS.unit(name) for name in TUNING_NUMBERS.names] == ["", "s", "s"]
    assert TUNING_NUMBERS.gain_unit == "engineering"
    assert TUNING_NUMBERS.limits(GenericFile, "tuning.gain").low == "0"
    assert TUNING_NUMBERS.limits(GenericFile, "tuning.derivative_on") is None
    for name in ("nothing", "nothing.gain"):
        with pytest.raises(KeyError, match=name):
            TUNING_NUMBERS.limits(GenericFile, name)
    assert TUNING_NUMBERS.stored_value("tuning.gain", Decimal("0.1")) == Decimal("0.1")
    assert set(PLAIN) <= set(Loop.model_fields)
