"""What all conversions share: rows of fields that stay the same, the builders, and what registers make of values."""

from __future__ import annotations

from collections import Counter
from decimal import Decimal
from types import SimpleNamespace

import pytest

from pidcfg.api import check_text
from pidcfg.conversion.builder import NeutralBuilder, Same, TargetBuilder, apply_table
from pidcfg.conversion.ledger import Change, ConvertError, SourceField, TargetField, changes
from pidcfg.conversion.pipeline import convert
from pidcfg.conversion.settle import read_back
from pidcfg.encoders.contract import encoder_of
from pidcfg.schemas.generic import GenericFile
from pidcfg.text.writer import yaml_text
from pidcfg.vendors import VENDORS

LOOP = {
    "name": "TIC1",
    "output_raises_pv": True,
    "sample_time": 0.5,
    "tuning": {"gain": 2.5, "integral_time": 60},
    "pv": {"range": [0, 400], "unit": "degC"},
    "setpoint": {"value": 180},
    "output": {"range": [0, 100], "unit": "%"},
}


def neutral(**changed):
    """A neutral file of one loop."""
    return GenericFile.model_validate({"pidcfg": 1, "vendor": "generic", "loops": [{**LOOP, **changed}]})


# --- rows ------------------------------------------------------------------------------------------------------------

TABLE = (
    Same("name"),
    Same("text"),
    Same("side.way", "raises", {"up": True, "down": False}),
    Same("band", "deadband", skip_falsy=True, note="why"),
    lambda b, context: b.put("twice", context, "double", 2 * context),
)


def test_rows_and_steps_go_over_in_the_order_of_the_table():
    b = NeutralBuilder(0)
    loop = SimpleNamespace(name="A", text=None, side=SimpleNamespace(way="down"), band=3)
    apply_table(b, loop, 7, TABLE)
    assert b.loop.data == {"name": "A", "raises": False, "deadband": 3, "double": 14}
    assert b.loop.fields == [
        SourceField("name", "A", ("name",)),
        SourceField("side.way", "down", ("raises",)),
        SourceField("band", 3, ("deadband",), "why"),
        SourceField("twice", 7, ("double",)),
    ]


@pytest.mark.parametrize("band", [0, None, False])
def test_what_is_off_says_nothing_where_the_row_says_so(band):
    b = TargetBuilder()
    apply_table(b, SimpleNamespace(band=band), None, (Same("band", skip_falsy=True),))
    assert (b.data, b.fields) == ({}, [])
    apply_table(b, SimpleNamespace(band=0), None, (Same("band"),))
    assert b.data == {"band": 0}


# --- builders --------------------------------------------------------------------------------------------------------


def test_a_target_gets_plain_numbers_in_sections():
    b = TargetBuilder(3)
    b.put("pv.range", (Decimal(0), Decimal("0.1234567890123456")), "pv.range", "why", assumed=True)
    b.same(Same("output.limits", is_pair=True), (Decimal(1), Decimal("2.50")))
    b.drop("output.max_rate", "by program")
    assert b.data == {"pv": {"range": [0, 0.123456789012]}, "output": {"limits": [1, 2.5]}}
    assert b.fields == [
        TargetField("pv.range", "pv.range", "why", assumed=True),
        TargetField("output.limits.0", "output.limits.0"),
        TargetField("output.limits.1", "output.limits.1"),
        TargetField("", "output.max_rate", "by program"),
    ]
    with pytest.raises(ConvertError, match="no place") as refused:
        b.refuse("alarms.pv.high", "no place")
    assert refused.value.missing[0].path == ("loops", 3, "alarms", "pv", "high")


def test_what_the_source_must_say_has_its_place():
    b = NeutralBuilder(2)
    b.require("pv.range", "add it")
    b.require("", "all of it")
    assert [entry.path for entry in b.loop.missing] == [("loops", 2, "pv", "range"), ("loops", 2)]


def test_a_field_that_goes_nowhere_is_dropped_and_one_that_comes_from_nowhere_assumed():
    source = [SourceField("a", 1, ("x",)), SourceField("b", 2, ("y",)), SourceField("c", 3, note="by program")]
    target = [TargetField("p", "x"), TargetField("q", None, "chosen")]
    assert list(changes(source, target, {})) == [
        Change("a", "exact", 1, None, neutral=("x",), target_field="p"),
        Change("b", "dropped", 2, None, note="the target has no such field", loss=True, neutral=("y",)),
        Change("c", "dropped", 3, None, note="by program", loss=True),
        Change("q", "assumed", None, None, note="chosen", target_field="q"),
    ]


def test_what_the_target_has_besides_is_told_unless_every_loop_is_like_that():
    target = [TargetField("p", "x"), TargetField("q", "y"), TargetField("r", None)]
    assert list(changes([], target, {}, lambda name: name == "x")) == [
        Change("q", "assumed", None, None, neutral=("y",), target_field="q"),
        Change("r", "assumed", None, None, target_field="r"),
    ]


# --- what registers hold ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("loops", 0, "tuning", "gain"), Decimal("2.25")),
        (("loops", 0, "sample_time"), Decimal(120)),
        (("loops", 0, "pv", "range", 1), Decimal(300)),
        (("loops", 0, "tuning", "integral_time"), Decimal(0)),
        (("loops", 0, "setpoint", "value"), None),
        (("loops", 0, "nothing"), None),
    ],
    ids=lambda case: str(case[-1]) if isinstance(case, tuple) else "",
)
def test_a_field_is_read_back_as_its_own_type_and_by_its_default(path, value):
    data = {
        "loops": [{**LOOP, "sample_time": "2 min", "tuning": {"gain": 2.25}, "pv": {"range": [0, 300]}, "setpoint": {}}]
    }
    assert read_back(neutral(), data, path) == value


def test_a_field_is_read_back_whatever_is_wrong_beside_it():
    data = {"loops": [{**LOOP, "mode": "no mode", "tuning": {"gain": 2.25, "integral_time": -1}}]}
    assert read_back(neutral(), data, ("loops", 0, "tuning", "gain")) == Decimal("2.25")


@pytest.fixture
def counts(monkeypatch):
    """How often each vendor's files are validated and encoded."""
    counts = Counter()

    def counting(kind, key, call):
        def counted(*args, **kwargs):
            counts[kind, key] += 1
            return call(*args, **kwargs)

        return counted

    for key, vendor in VENDORS.items():
        image = encoder_of(vendor)
        monkeypatch.setattr(image, "encode", counting("encoded", key, image.encode))
        monkeypatch.setattr(vendor.model, "model_validate", counting("validated", key, vendor.model.model_validate))
    return counts


@pytest.mark.parametrize("target", [key for key in VENDORS if key != "generic"])
def test_a_target_is_validated_and_encoded_once_and_once_more_as_it_is_written(counts, target):
    source = neutral()
    converted = convert(source, VENDORS["generic"], VENDORS[target], {})
    assert (counts["validated", target], counts["encoded", target]) == (1, 1)
    checked = check_text(yaml_text(converted.data))
    assert not checked.failed
    assert (counts["validated", target], counts["encoded", target]) == (2, 2)
    assert converted.config == checked.config
    assert converted.encoding.image == checked.encoding.image


def test_what_is_clamped_is_encoded_again(counts):
    converted = convert(neutral(tuning={"gain": 2, "derivative_time": 7000}), VENDORS["generic"], VENDORS["click"], {})
    assert converted.losses
    assert (counts["validated", "click"], counts["encoded", "click"]) == (2, 2)
