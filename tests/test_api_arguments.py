"""Every argument of every public call with values of other types; and results that travel to other processes."""

from __future__ import annotations

import copy
import inspect
import pickle
from decimal import Decimal
from pathlib import Path

import pytest

import pidcfg
from pidcfg.encoders.regmap import BIT
from pidcfg.output.arguments import KINDS, OPTIONAL, ArgumentError, ArgumentTypeError
from pidcfg.tuning.rules import METHODS
from pidcfg.vendors import VENDORS
from test_vendors import scenario, starter

CALLS = (
    "load",
    "check",
    "fix",
    "encode",
    "decode",
    "convert",
    "diff",
    "simulate",
    "certify",
    "tune",
    "explain",
    "report",
    "plot",
    "gains",
    "change",
)
FIRST = next(iter(VENDORS.values()))
TEXT = starter(FIRST)
GOOD = {
    "load": {"source": TEXT},
    "check": {"source": TEXT},
    "fix": {"source": TEXT},
    "encode": {"source": TEXT},
    "decode": {"source": pidcfg.encode(TEXT).text, "vendor": FIRST.key},
    "convert": {"source": TEXT, "to": FIRST.key},
    "diff": {"before": TEXT, "after": TEXT},
    "simulate": {"source": scenario(FIRST), "name": "x.yaml", "files": {"starter.yaml": TEXT}},
    "certify": {
        "source": scenario(FIRST),
        "samples": 1,
        "jobs": 1,
        "keep_worst": 1,
        "record": False,
        "name": "x.yaml",
        "files": {"starter.yaml": TEXT},
    },
    "tune": {"method": "zn-open", "gain": 2, "time_constant": 60, "dead_time": 5},
    "explain": {},
    "report": {},
    "plot": {"result": pidcfg.check(TEXT)},
    "gains": {"source": TEXT},
    "change": {"source": TEXT, "values": {"name": "other"}},
}
VALUES = [3, 1.5, -1, True, None, b"x", "x", (), (5,), ("a",), ["a"], {}, {"a": 3}, {3: "a"}, {"x": None}]
VALUES += [object(), Path("nowhere"), float("nan"), Decimal("NaN"), (None, None), (float("nan"), 1), ("a", "b"), [[]]]
PARAMETERS = [
    pytest.param(call, parameter, id=f"{call}-{parameter.name}")
    for call in CALLS
    for parameter in inspect.signature(getattr(pidcfg, call)).parameters.values()
]


def called(call, parameter, value):
    """A call with one argument in the place of a good one."""
    if parameter.kind is parameter.VAR_POSITIONAL:
        return getattr(pidcfg, call)(value)
    return getattr(pidcfg, call)(**{**GOOD[call], parameter.name: value})


@pytest.mark.parametrize(("call", "parameter"), PARAMETERS)
def test_an_argument_of_another_type_is_refused_by_its_name(call, parameter):
    annotation = str(parameter.annotation)
    is_kind, wanted = KINDS[annotation.removesuffix(OPTIONAL)]
    refused = 0
    for value in VALUES:
        message = ""
        try:
            called(call, parameter, value)
        except ArgumentTypeError as error:
            refused += 1
            message = str(error)
        except (ValueError, OSError):
            pass
        if message:
            assert not is_kind(value)
            assert message.startswith(f"`{parameter.name}` is ")
            assert message.endswith(f"; give {wanted}")
        else:
            assert is_kind(value) or (value is None and annotation.endswith(OPTIONAL))
    assert refused > 2


def test_every_annotation_has_a_row_and_every_row_is_used():
    live = [
        p for call in pidcfg.NAMES["live.calls"] for p in inspect.signature(getattr(pidcfg, call)).parameters.values()
    ]
    annotations = [*(param.values[1].annotation for param in PARAMETERS), *(parameter.annotation for parameter in live)]
    used = {str(annotation).removesuffix(OPTIONAL) for annotation in annotations}
    assert used == {*KINDS}


def test_all_calls_are_tried():
    models = {"check_file", "check_text", "decode_words"}
    assert {*CALLS} | models == {*pidcfg.api.__all__}


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: pidcfg.explain(3), "`things` is 3; give a text"),
        (lambda: pidcfg.tune("zn-open", pv_range=(5,)), "`pv_range` is (5,); give two numbers"),
        (
            lambda: pidcfg.diff("", "", names=("a",)),
            "`names` is ('a',); give two texts, or None for one without a name",
        ),
        (lambda: pidcfg.simulate("", every=1.5), "`every` is 1.5; give a whole number"),
        (lambda: pidcfg.simulate("", every=True), "`every` is True; give a whole number"),
        (lambda: pidcfg.check("", files={"a": 3}), "`files` is {'a': 3}; give texts by their names, or a reader"),
        (lambda: pidcfg.explain("gain", blocks="DF101"), "`blocks` is 'DF101'; give a list of texts"),
    ],
)
def test_the_message_says_what_is_wanted(call, message):
    with pytest.raises(ArgumentError) as error:
        call()
    assert str(error.value) == message
    assert isinstance(error.value, TypeError)


def test_too_many_arguments_are_python_s_own_error():
    with pytest.raises(TypeError, match="unexpected keyword argument 'sourc'"):
        pidcfg.check("", sourc=3)


# --- results that travel ---------------------------------------------------------------------------------------------


def results(vendor):
    """A result of every call."""
    text, files = starter(vendor), {"starter.yaml": starter(vendor)}
    run = scenario(vendor)
    yield pidcfg.load(text)
    yield pidcfg.load(run)
    yield pidcfg.check(text)
    for name, kind in vendor.load("formats").items():
        if not kind.needs_into:
            yield pidcfg.encode(text, name)
    yield pidcfg.decode(pidcfg.encode(text).text, vendor.key)
    yield pidcfg.convert(text, vendor.key)
    yield pidcfg.diff(text, text)
    yield pidcfg.simulate(run, name="x.yaml", files=files, record=True)
    yield pidcfg.explain(vendor.load("tuned").names[0], config=text)
    process = {"gain": 2, "time_constant": 60, "dead_time": 5, "closed_loop": 9, "sample_time": 0.1}
    for name, method in METHODS.items():
        numbers = {"ultimate_gain": 8, "ultimate_period": 4} if method.of_ultimate else process
        yield pidcfg.tune(name, "PI", **numbers, vendor=vendor.key, pv_range=(0, 9))


def spoil(value):
    """Empties everything of a JSON document."""
    if isinstance(value, dict | list):
        for part in [*value.values()] if isinstance(value, dict) else [*value]:
            spoil(part)
        value.clear()


@pytest.mark.parametrize("vendor", VENDORS.values(), ids=list(VENDORS))
def test_a_result_survives_the_way_to_another_process_and_its_json_is_the_caller_s(vendor):
    for result in results(vendor):
        document = copy.deepcopy(result.to_json())
        for again in (pickle.loads(pickle.dumps(result)), copy.deepcopy(result)):  # noqa: S301 - its own
            assert type(again) is type(result)
            assert again.to_json() == document
            assert again.ok == result.ok
            if isinstance(result, type(pidcfg.encode(""))):
                assert (again.files, again.image, again.kind) == (result.files, result.image, result.kind)
        spoil(result.to_json())
        assert result.to_json() == document, type(result)


def test_a_bit_is_a_bit_after_the_way():
    assert pickle.loads(pickle.dumps(BIT)) is BIT  # noqa: S301 - as above
    assert copy.deepcopy(BIT).highest == 1


def test_a_result_without_an_image_survives_too():
    result = pidcfg.encode("pidcfg: 1\n")
    assert pickle.loads(pickle.dumps(result)).to_json() == result.to_json()  # noqa: S301 - as above


def test_results_are_short_in_a_notebook():
    text = starter(VENDORS["dl06"])
    tuned = pidcfg.tune(method="simc", form="PI", gain=1, time_constant=10, dead_time=1, sample_time=0.1)
    results = (pidcfg.check(text), pidcfg.load(text), pidcfg.encode(text), pidcfg.convert(text, "click"), tuned)
    results += (pidcfg.diff(text, text), pidcfg.explain("V7642"), pidcfg.check("loops: ["))
    for result in results:
        assert repr(result).startswith(f"<{type(result).__name__}: ")
        assert len(repr(result)) < 100
    assert repr(results[-1]) == "<CheckResult: not ok, <text>, 1 finding>"
