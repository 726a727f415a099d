"""Fields of records that name the register they are made of."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module

import pytest

from pidcfg.encoders.maps import click, dl06, dpide, ezlogix, generic
from pidcfg.sim.controllers.kernels import read_registers, register, register_values, registers

KNOWN = {
    "dl06": set(dl06.LOOP_TABLE.paths()),
    "click": {word.name for table in click.TABLES for word in table.words},
    "ezlogix": {word.name for table in (ezlogix.R_BLOCK, ezlogix.S_BLOCK) for word in table.words}
    | {"action", "algorithm"},  # the dialog's
    "dpide": set(dpide.ROWS),
    "generic": set(generic.ROWS),
}
"""Every register, or parameter, by the name that a vendor's records use."""


@pytest.mark.parametrize("vendor", KNOWN)
@pytest.mark.parametrize("record", ["Config", "State"])
def test_every_register_that_a_field_names_exists(vendor, record):
    rows = list(registers(getattr(import_module(f"pidcfg.sim.controllers.{vendor}.equation"), record)))

    assert {row.name for row in rows} | {row.enabled for row in rows} <= KNOWN[vendor] | {None}
    assert rows or record == "State"


@dataclass(slots=True)
class Record:
    gain: float = register("gain", 1.0)
    whole: int = register("count", 0)
    limit: float = register("limit", 99.0, enabled="limited")
    reverse: int = register("action", 0, equals="reverse")
    worked_out: float = 7.0


def test_registers_fill_their_fields_and_what_has_no_register_stays():
    record = Record(worked_out=3.0)
    read_registers(record, {"gain": 2, "count": 4.0, "limit": 5.0, "limited": True, "action": "reverse"})

    assert record == Record(2.0, 4, 5.0, 1, 3.0)
    assert [type(value) for value in (record.gain, record.whole)] == [float, int]
    assert register_values(record) == {"gain": 2.0, "count": 4, "limit": 5.0, "action": 1}


def test_a_register_without_a_value_or_that_is_not_enabled_leaves_the_default():
    record = Record(5.0, 5, 5.0, 1)
    read_registers(record, {"limit": 5.0, "limited": False, "action": "direct"})

    assert record == Record(1.0, 0, 99.0, 0)


def test_numbers_are_rounded_as_the_vendor_holds_them():
    record = Record()
    read_registers(record, {"gain": 2.6, "limited": 0}, round)

    assert record.gain == 3
