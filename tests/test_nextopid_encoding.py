"""NextoPID configurations to parameters with names, in every listing, and back."""

from __future__ import annotations

import copy
import json

import pytest
from hypothesis import given, settings

from nextopid_networks import NETWORKS, OVERRIDE, network
from nextopid_strategies import configurations
from pidcfg.encoders.decoding import decode_listing
from pidcfg.encoders.listing import ListingError
from pidcfg.encoders.maps.nextopid import BLOCK_TYPES
from pidcfg.encoders.nextopid import DECODE_OPTIONS
from pidcfg.encoders.nextopid.files import FORMATS, checklist
from pidcfg.encoders.nextopid.image import encode
from pidcfg.schemas.iec import Wire
from pidcfg.schemas.nextopid import NextopidFile
from pidcfg.vendors import VENDORS

VENDOR = VENDORS["nextopid"]
LISTINGS = ("text", "csv", "json")


def again(text: str, kind: str, **options):
    """The configuration that a listing of this kind decodes to, and the notes."""
    decoded = decode_listing(FORMATS[kind].read(text), VENDOR, options)
    return NextopidFile.model_validate(decoded.data), decoded.notes


@pytest.mark.parametrize("kind", LISTINGS)
@settings(max_examples=25, deadline=None)
@given(config=configurations())
def test_encode_decode_encode_is_identical(kind, config):
    text = FORMATS[kind].write(encode(config).image, checklist(config))
    back, notes = again(text, kind)
    assert FORMATS[kind].write(encode(back).image, checklist(back)) == text
    assert not notes


READ_BACK = [kind for kind in FORMATS if kind != "modbus-map"]
"""Formats that hold contents, and not only where they are."""


@pytest.mark.parametrize("kind", READ_BACK)
@pytest.mark.parametrize("name", NETWORKS)
def test_every_format_gives_the_same_network(kind, name):
    config = network(name)
    back, notes = again(FORMATS[kind].write(encode(config).image, ()), kind)
    wanted, found = encode(config), encode(back)
    assert found.image.settings == wanted.image.settings
    assert found.image.plc == wanted.image.plc
    assert found.order == wanted.order
    assert {key: (wire.code, wire.constants) for key, wire in found.wires.items()} == {
        key: (wire.code, wire.constants) for key, wire in wanted.wires.items()
    }
    values = [{k: v for k, v in e.image.words.items() if not isinstance(v, Wire)} for e in (found, wanted)]
    assert values[0] == values[1]
    assert not notes


@pytest.mark.parametrize("kind", READ_BACK)
@pytest.mark.parametrize("name", NETWORKS)
def test_a_listing_is_known_by_how_it_begins(kind, name):
    text = FORMATS[kind].write(encode(network(name)).image, ())
    assert next(other for other, of in FORMATS.items() if of.looks_like(text)) == kind


def test_every_parameter_of_the_library_has_a_field_or_is_an_output():
    for kind in BLOCK_TYPES.values():
        names = {row.name.partition(".")[0] for row in kind.inputs}
        assert names <= set(kind.model.model_fields)
        assert len({row.name.upper() for row in kind.table.rows}) == len(kind.table.rows)


def test_what_an_int_cannot_hold_is_a_misfit_at_its_place():
    config = copy.deepcopy(OVERRIDE)
    config["loops"][1]["SP"], config["loops"][1]["MaxMV"] = 40000, 0.5
    found = encode(NextopidFile.model_validate(config)).misfits
    assert [(place, str(misfit.error)) for place, misfit in found] == [
        (("loops", 1, "SP"), "is outside the range of INT"),
        (("loops", 1, "MaxMV"), "INT holds whole numbers"),
    ]


@pytest.mark.parametrize(
    ("wire", "says"),
    [
        ("PIC.MVV", "'PIC.MVV' is no declared name"),
        ("Hold", "Hold is BOOL; numbers are wanted"),
        ("PIC.PV + 1", "PIC.PV is wired itself and of the same call"),
    ],
)
def test_a_wire_without_meaning_is_a_misfit(wire, says):
    config = copy.deepcopy(OVERRIDE)
    config["loops"][0]["BIAS"] = wire
    (place, misfit), *_ = encode(NextopidFile.model_validate(config)).misfits
    assert place == ("loops", 0, "BIAS")
    assert says in str(misfit.error)


def test_the_interval_of_the_task_may_come_from_the_command_line():
    document = json.loads(FORMATS["json"].write(encode(network("override")).image, ()))
    del document["plc"]
    text = json.dumps(document)
    with pytest.raises(ListingError, match="give --sample-time"):
        again(text, "json")
    (option,) = DECODE_OPTIONS
    assert again(text, "json", sample_time=option.read("100 ms"))[0].plc == network("override").plc
    assert option.read("fast") is None


def test_an_image_is_complete_without_what_the_program_around_assigns():
    words = encode(network("override")).image.words
    assert "HEAT.PV" not in words
    assert words["HEAT.ManualMV"] is False
    assert words["FIC.BIAS"] == Wire("(- 1)")
    assert checklist(network("override"))[1].endswith("HEAT.PV")


def test_a_literal_that_is_wired_is_refused():
    document = json.loads(FORMATS["json"].write(encode(network("override")).image, ()))
    (entry,) = [word for word in document["words"] if word["address"] == "PULSES.Period"]
    entry["expression"] = str(entry.pop("value"))
    with pytest.raises(ListingError, match=r"the listing gives no configuration: blocks.2.ControlPWM.Period"):
        again(json.dumps(document), "json")
