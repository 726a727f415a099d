"""Every public call: its arguments, results that travel, the command of its name, gains and changes."""

from __future__ import annotations

import copy
import inspect
import json
import pickle
from decimal import Decimal
from pathlib import Path

import pytest

import pidcfg
from pidcfg.encoders.regmap import BIT
from pidcfg.output.arguments import ANNOTATION_KINDS, OPTIONAL_SUFFIX, ArgumentError, ArgumentTypeError
from pidcfg.tuning.rules import METHODS
from pidcfg.vendors import VENDORS
from shell import captured
from shell import pidcfg as command_line
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
    is_kind, wanted = ANNOTATION_KINDS[annotation.removesuffix(OPTIONAL_SUFFIX)]
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
            assert is_kind(value) or (value is None and annotation.endswith(OPTIONAL_SUFFIX))
    assert refused > 2


def test_every_annotation_has_a_row_and_every_row_is_used():
    calls = (pidcfg.pull, pidcfg.compare, pidcfg.trend, pidcfg.serve)
    live = [parameter for call in calls for parameter in inspect.signature(call).parameters.values()]
    annotations = [*(param.values[1].annotation for param in PARAMETERS), *(parameter.annotation for parameter in live)]
    used = {str(annotation).removesuffix(OPTIONAL_SUFFIX) for annotation in annotations}
    assert used == {*ANNOTATION_KINDS}


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


# --- A command and the public call of its name: the same data, on the examples and some cases of every vendor ---------


ROOT = Path(__file__).parents[1]
CONFIGURATIONS = sorted(p for p in ROOT.glob("examples/*/*.yaml") if ".scenario" not in p.name)
SCENARIOS = sorted(ROOT.glob("examples/*/*.scenario.yaml"))
CASES = [
    path
    for prefix in ("PID1", *(vendor.prefix for vendor in VENDORS.values()))
    for path in sorted(ROOT.glob(f"tests/cases/{prefix}*.yaml"))[::25]
]
SHORT = [ROOT / "examples" / name for name in ("click/tank.scenario.yaml", "dl06/flow.scenario.yaml")]
OTHER = {"dl06": "click", "click": "ezlogix", "ezlogix": "nextopid", "nextopid": "dpide", "dpide": "generic"}
"""To which vendor the examples are converted here."""


def named(paths):
    """Parameters of a test with the files as their names, which are relative to the current folder."""
    return [pytest.param(path.relative_to(ROOT), id=path.relative_to(ROOT).as_posix()) for path in paths]


@pytest.fixture
def in_the_checkout(monkeypatch):
    monkeypatch.chdir(ROOT)


def printed(command, *args):
    """Standard output of a command."""
    return captured(command_line, [command, *map(str, args)])[2]


@pytest.mark.usefixtures("in_the_checkout")
@pytest.mark.parametrize("path", named([*CONFIGURATIONS, *SCENARIOS, *CASES]))
def test_validate(path):
    assert json.loads(printed("validate", path, "--format", "json", "--isolated")) == pidcfg.check(path).to_json()


@pytest.mark.usefixtures("in_the_checkout")
@pytest.mark.parametrize("path", named([*CONFIGURATIONS, *CASES]))
def test_encode(path):
    result = pidcfg.encode(path, "json")
    assert json.loads(printed("encode", path, "--format", "json")) == result.to_json()
    if result.ok:
        assert printed("encode", path) == pidcfg.encode(path).text


@pytest.mark.usefixtures("in_the_checkout")
@pytest.mark.parametrize("path", named(CONFIGURATIONS))
def test_decode(path, tmp_path):
    listing = tmp_path / "listing.txt"
    encoded = pidcfg.encode(path, allow_errors=True)
    listing.write_text(encoded.text, "utf-8")
    result = pidcfg.decode(listing, encoded.vendor)
    text = printed("decode", listing, "--vendor", encoded.vendor)
    assert text == result.text
    assert pidcfg.encode(text, allow_errors=True).image.words == pidcfg.encode(path, allow_errors=True).image.words
    assert json.loads(json.dumps(result.to_json())) == result.to_json()


@pytest.mark.usefixtures("in_the_checkout")
@pytest.mark.parametrize("path", named([*CONFIGURATIONS, *CASES]))
def test_convert(path, tmp_path):
    target = OTHER.get(pidcfg.load(path).vendor, "dl06")
    out, result = tmp_path / "out.yaml", pidcfg.convert(path, target)
    report = json.loads(printed("convert", path, "--to", target, "-o", out, "--report", "json", "--allow-loss"))
    assert report == result.to_json()
    assert out.exists() == result.ok
    if result.ok:
        assert out.read_bytes() == result.text.encode()


@pytest.mark.usefixtures("in_the_checkout")
def test_convert_and_verify(tmp_path):
    path = Path("examples/dpide/chiller.yaml")
    args = (path, "--to", "click", "-o", tmp_path / "x.yaml", "--report", "json", "--allow-loss", "--verify")
    result = pidcfg.convert(path, "click", verify=True)
    assert json.loads(printed("convert", *args)) == result.to_json()
    assert result.verified


@pytest.mark.usefixtures("in_the_checkout")
@pytest.mark.parametrize(
    ("before", "after"), list(zip(named(CONFIGURATIONS), named([*CONFIGURATIONS[1:], *CASES[:1]]), strict=True))[::2]
)
def test_diff(before, after):
    one, two = before.values[0], after.values[0]
    assert json.loads(printed("diff", one, two, "--format", "json")) == pidcfg.diff(one, two).to_json()


@pytest.mark.usefixtures("in_the_checkout")
@pytest.mark.parametrize("path", named(CONFIGURATIONS))
def test_diff_with_a_listing(path, tmp_path):
    (tmp_path / "upload.txt").write_text(pidcfg.encode(path, allow_errors=True).text, "utf-8")
    result = pidcfg.diff(path, tmp_path / "upload.txt")
    assert json.loads(printed("diff", path, tmp_path / "upload.txt", "--format", "json")) == result.to_json()


@pytest.mark.usefixtures("in_the_checkout")
@pytest.mark.parametrize("path", named(SHORT))
def test_simulate(path):
    shown = json.loads(printed("simulate", path, "--format", "json", "--engine", "python"))
    assert shown == pidcfg.simulate(path, engine="python").to_json()


@pytest.mark.usefixtures("in_the_checkout")
@pytest.mark.parametrize("path", named([ROOT / "examples/click/tank.yaml", *CASES[:2]]))
def test_simulate_what_is_no_scenario(path):
    shown = json.loads(printed("simulate", path, "--format", "json", "--engine", "python"))
    assert shown == pidcfg.simulate(path, engine="python").to_json()


@pytest.mark.usefixtures("in_the_checkout")
@pytest.mark.parametrize("vendor", VENDORS)
@pytest.mark.parametrize("method", ["zn-closed", "tyreus-luyben"])
def test_tune(vendor, method):
    args = ("--method", method, "--ultimate-gain", 8, "--ultimate-period", 4, "--for", vendor, "--pv-range", 0, 200)
    result = pidcfg.tune(method, ultimate_gain=8, ultimate_period=4, vendor=vendor, pv_range=(0, 200))
    assert json.loads(printed("tune", *args, "--format", "json")) == result.to_json()


@pytest.mark.usefixtures("in_the_checkout")
def test_tune_by_a_record(tmp_path):
    record = tmp_path / "step.csv"
    rows = (f"{t},{20 if t < 10 else 40},{50 if t < 12 else 90 - 40 * 0.8 ** (t - 12):.6f}\n" for t in range(60))
    record.write_text("".join(rows), "utf-8")
    shown = printed("tune", "--method", "zn-open", "--from-csv", record, "--format", "json")
    assert json.loads(shown) == pidcfg.tune("zn-open", record=record).to_json()


@pytest.mark.usefixtures("in_the_checkout")
@pytest.mark.parametrize("thing", ["V7642=0008", "CK27", "gain", "DL242", "D46", "addr+06.10"])
def test_explain(thing):
    assert json.loads(printed("explain", thing, "--format", "json")) == pidcfg.explain(thing).to_json()


@pytest.mark.usefixtures("in_the_checkout")
def test_explain_what_nobody_knows():
    with pytest.raises(ValueError, match="nothing is known") as error:
        pidcfg.explain("nonsense")
    code, shown, _ = captured(command_line, ["explain", "nonsense"])
    assert (code, shown.splitlines()[0]) == (2, f"Error: {error.value}")


@pytest.mark.usefixtures("in_the_checkout")
@pytest.mark.parametrize("path", named(CONFIGURATIONS))
def test_explain_in_a_configuration(path):
    thing = pidcfg.encode(path, allow_errors=True).image.cells[-1].address
    result = pidcfg.explain(thing, config=path)
    assert json.loads(printed("explain", thing, "--in", path, "--format", "json")) == result.to_json()


@pytest.mark.usefixtures("in_the_checkout")
def test_explain_nothing():
    assert json.loads(printed("explain", "--format", "json")) == pidcfg.explain().to_json()


# --- `pidcfg.gains` and `pidcfg.change`: what registers hold, how robust it is, and other values in a file ------------


EXAMPLES = Path(__file__).parents[1] / "examples"
EXAMPLE_SCENARIOS = sorted(EXAMPLES.glob("*/*.scenario.yaml"))
HELD = {
    # file and loop            a wish for each number              what the register holds of it
    ("dl06/flow", "FIC-301"): ((0.614, 3.04, 0.004), ("0.61", "3", "0")),
    ("dl06/reactor", "LIC-103"): ((500, 2.06, 0.006), ("99.99", "2.1", "0.01")),
    ("click/brewery", "KETTLE"): ((0.1, 7000, 0.3), ("0.1", "6000", "0.3")),
    ("ezlogix/coldstore", "STORE"): ((12.006, 0.02, 3.17), ("12.01", "0", "3.2")),
    ("nextopid/ratio", "FIC_AIR"): ((0.1, 1.23456789, 0), ("0.1", "1.2345679", "0")),
    ("dpide/chiller", "TIC-21"): ((1e-3, 0.1, 5), ("0.001", "0.1", "5")),
    ("generic/boiler", "FIC-1"): ((0.1, 6.123456789, 0), ("0.1", "6.123456789", "0")),
}


def numbers(source, loop):
    """The three numbers of a loop."""
    return next(one for one in pidcfg.gains(source).loops if one.loop == loop).numbers


@pytest.mark.parametrize(("name", "loop"), HELD)
def test_a_number_is_what_the_register_holds_of_it(name, loop):
    wishes, held = HELD[name, loop]
    found = numbers(EXAMPLES / f"{name}.yaml", loop)
    assert [one.part for one in found] == ["gain", "integral", "derivative"]
    for one, wish, text in zip(found, wishes, held, strict=True):
        assert float(one.hold(wish)) == pytest.approx(float(text), rel=1e-8), one.key
        assert one.hold(float(one.hold(wish))) == one.hold(wish)


@pytest.mark.parametrize("path", EXAMPLE_SCENARIOS, ids=lambda path: path.stem.removesuffix(".scenario"))
def test_what_is_written_is_what_is_held_and_nothing_else_changes(path):
    config = path.parent / pidcfg.load(path).model.config
    text = config.read_text("utf-8")
    for loop in pidcfg.gains(config).loops:
        held = {one.path: one.hold(float(one.value) * 1.37 + 0.2) for one in loop.numbers}
        texts = {one.path: one.written(held[one.path]) for one in loop.numbers}
        if loop.loop.startswith("TIC-Z"):  # these share their numbers
            with pytest.raises(ValueError, match="shares what stands there"):
                pidcfg.change(config, texts)
            continue
        changed = pidcfg.change(config, texts)
        after = numbers(changed.document, loop.loop)
        assert [one.value for one in after] == [pytest.approx(held[one.path]) for one in loop.numbers]
        back = {one.path: one.text for one in loop.numbers if one.text is not None}
        if len(back) == len(texts):
            assert pidcfg.change(changed.document, back).text == text
        others = [one.numbers for one in pidcfg.gains(changed.document).loops if one.loop != loop.loop]
        assert [[one.value for one in row] for row in others] == [
            [one.value for one in row.numbers] for row in pidcfg.gains(config).loops if row.loop != loop.loop
        ]


def test_times_keep_the_unit_that_stands_there():
    found = {one.part: one for one in numbers(EXAMPLES / "dpide" / "dyeing.yaml", "VAT")}
    assert (found["integral"].text, found["integral"].value) == ("12 min", Decimal(720))
    assert found["integral"].written(Decimal(660)) == "11 min"
    assert numbers(EXAMPLES / "ezlogix" / "coldstore.yaml", "STORE")[2].written(Decimal(0)) == "off"


def test_a_loop_that_switches_has_no_numbers():
    fan = next(one for one in pidcfg.gains(EXAMPLES / "nextopid" / "furnace.yaml").loops if one.loop == "FAN")
    assert fan.numbers == ()


PLANT = "pidcfg: 1\nscenario: one plant\nconfig: loop.yaml\nduration: 1 h\nplants:\n  A: {plant}\n"
LOOP = """\
pidcfg: 1
vendor: generic
loops:
  - name: A
    sample_time: 1
    output_raises_pv: true
    tuning: {gain: GAIN, integral_time: TIME, derivative_time: off}
    pv: {range: [0, 100]}
    setpoint: {value: 50}
    output: {range: [0, 100]}
"""


@pytest.mark.parametrize(
    ("plant", "process"),
    [
        ("{model: first_order, gain: 2, time_constant: 100, dead_time: 10}", {"gain": 2, "time_constant": 100}),
        ("{model: integrator, gain: 0.02, dead_time: 10}", {"gain": 0.02, "model": "integrating"}),
    ],
)
def test_ms_is_that_of_the_rule_that_made_the_gains(plant, process):
    tuned = pidcfg.tune("simc", "PI", dead_time=10, sample_time=1, **process)
    gains = tuned.gains
    text = LOOP.replace("GAIN", f"{gains.gain:.12g}").replace("TIME", f"{gains.integral_time:.12g}")
    files = {"loop.yaml": text}
    (loop,) = pidcfg.gains(PLANT.replace("{plant}", plant), files=files).loops
    assert loop.margins.ms == pytest.approx(tuned.judgement.margins.ms, rel=1e-6)
    assert loop.to_json()["margins"]["ms"] == loop.margins.ms


@pytest.mark.parametrize(
    ("plant", "why"),
    [
        ("{model: first_order, gain: 2, time_constant: 100, input: A.OUT * 2}", "its plant reads A.OUT * 2"),
        ("{model: second_order, gain: 2, time_constant: 9, damping: 0.3}", "model second_order"),
        ("{model: first_order, gain: 2, time_constant: 100, dead_time: 900}", "unstable"),
    ],
)
def test_why_there_is_no_ms(plant, why):
    files = {"loop.yaml": LOOP.replace("GAIN", "20").replace("TIME", "20")}
    (loop,) = pidcfg.gains(PLANT.replace("{plant}", plant), files=files).loops
    assert loop.margins is None
    assert why in loop.why


def test_a_key_that_is_missing_comes_behind_the_last_one_beside_it():
    text = "a: {b: 1}  # one\nc:\n  d: 2\n  e: 3\nf: 4\n"
    assert pidcfg.change(text, {"a.x": 7, "c.d": "2.5", "c.y": 0.125}).text == (
        "a: {b: 1, x: 7}  # one\nc:\n  d: 2.5\n  e: 3\n  y: 0.125\nf: 4\n"
    )
    assert pidcfg.change(text, {}).text == text


@pytest.mark.parametrize(
    ("source", "values", "message"),
    [
        ("a: [", {"a": 1}, "`source`: <text> cannot be read"),
        ("a: 1\n", {"b.c": 1}, "`values`: <text> has no b.c"),
        ("a: 1\n", {3: 1}, "`values`: 3 is no path; write it like loops.0.name"),
        ("a: 1\n", {"a": float("nan")}, "`values`: a is nan; write a text or a number"),
        ("a: 1\n", {"a": True}, "`values`: a is True"),
        ("a: &x {b: 1}\nc: *x\n", {"a.b": 2}, "`values`: the file shares what stands there"),
        ("a: 1\n", {"a": "1, b: 2\nc: 3"}, "`values`: the file shares"),
    ],
)
def test_what_cannot_be_changed_is_a_value_error(source, values, message):
    with pytest.raises(ValueError, match=r".") as error:
        pidcfg.change(source, values)
    assert str(error.value).startswith(message)


def test_a_run_over_another_one():
    path = EXAMPLES / "dl06" / "flow.scenario.yaml"
    before = pidcfg.simulate(path, record=True)
    files = {"flow.yaml": (path.parent / "flow.yaml").read_text("utf-8").replace("gain: 0.60", "gain: 0.30")}
    after = pidcfg.simulate(path.read_text("utf-8"), name="flow.scenario.yaml", files=files, record=True)
    html = after.html(before, names=("old <b>", "new"))
    assert html.count("<figure") == 1
    for line in ("line pv before", "line pv after", "line output before", "line output after"):
        assert f'"{line}"' in html
    assert "line setpoint before" not in html  # it went the same way
    assert "before: <bdi>old &lt;b&gt;</bdi>" in html
    assert 'class="line pv only"' in after.html()
    assert after.html(loops=("none",)) == ""
    assert pidcfg.simulate(path).html() == ""
