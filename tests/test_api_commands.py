"""A command and the public call of its name: the same data, on the examples and some cases of every vendor."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import pidcfg as api
from pidcfg.vendors import VENDORS
from shell import captured, pidcfg

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


@pytest.fixture(autouse=True)
def in_the_checkout(monkeypatch):
    monkeypatch.chdir(ROOT)


def printed(command, *args):
    """Standard output of a command."""
    return captured(pidcfg, [command, *map(str, args)])[2]


@pytest.mark.parametrize("path", named([*CONFIGURATIONS, *SCENARIOS, *CASES]))
def test_validate(path):
    assert json.loads(printed("validate", path, "--format", "json", "--isolated")) == api.check(path).to_json()


@pytest.mark.parametrize("path", named([*CONFIGURATIONS, *CASES]))
def test_encode(path):
    result = api.encode(path, "json")
    assert json.loads(printed("encode", path, "--format", "json")) == result.to_json()
    if result.ok:
        assert printed("encode", path) == api.encode(path).text


@pytest.mark.parametrize("path", named(CONFIGURATIONS))
def test_decode(path, tmp_path):
    listing = tmp_path / "listing.txt"
    encoded = api.encode(path, allow_errors=True)
    listing.write_text(encoded.text, "utf-8")
    result = api.decode(listing, encoded.vendor)
    text = printed("decode", listing, "--vendor", encoded.vendor)
    assert text == result.text
    assert api.encode(text, allow_errors=True).image.words == api.encode(path, allow_errors=True).image.words
    assert json.loads(json.dumps(result.to_json())) == result.to_json()


@pytest.mark.parametrize("path", named([*CONFIGURATIONS, *CASES]))
def test_convert(path, tmp_path):
    target = OTHER.get(api.load(path).vendor, "dl06")
    out, result = tmp_path / "out.yaml", api.convert(path, target)
    report = json.loads(printed("convert", path, "--to", target, "-o", out, "--report", "json", "--allow-loss"))
    assert report == result.to_json()
    assert out.exists() == result.ok
    if result.ok:
        assert out.read_bytes() == result.text.encode()


def test_convert_and_verify(tmp_path):
    path = Path("examples/dpide/chiller.yaml")
    args = (path, "--to", "click", "-o", tmp_path / "x.yaml", "--report", "json", "--allow-loss", "--verify")
    result = api.convert(path, "click", verify=True)
    assert json.loads(printed("convert", *args)) == result.to_json()
    assert result.verified


@pytest.mark.parametrize(
    ("before", "after"), list(zip(named(CONFIGURATIONS), named([*CONFIGURATIONS[1:], *CASES[:1]]), strict=True))[::2]
)
def test_diff(before, after):
    one, two = before.values[0], after.values[0]
    assert json.loads(printed("diff", one, two, "--format", "json")) == api.diff(one, two).to_json()


@pytest.mark.parametrize("path", named(CONFIGURATIONS))
def test_diff_with_a_listing(path, tmp_path):
    (tmp_path / "upload.txt").write_text(api.encode(path, allow_errors=True).text, "utf-8")
    result = api.diff(path, tmp_path / "upload.txt")
    assert json.loads(printed("diff", path, tmp_path / "upload.txt", "--format", "json")) == result.to_json()


@pytest.mark.parametrize("path", named(SHORT))
def test_simulate(path):
    shown = json.loads(printed("simulate", path, "--format", "json", "--engine", "python"))
    assert shown == api.simulate(path, engine="python").to_json()


@pytest.mark.parametrize("path", named([ROOT / "examples/click/tank.yaml", *CASES[:2]]))
def test_simulate_what_is_no_scenario(path):
    shown = json.loads(printed("simulate", path, "--format", "json", "--engine", "python"))
    assert shown == api.simulate(path, engine="python").to_json()


@pytest.mark.parametrize("vendor", VENDORS)
@pytest.mark.parametrize("method", ["zn-closed", "tyreus-luyben"])
def test_tune(vendor, method):
    args = ("--method", method, "--ultimate-gain", 8, "--ultimate-period", 4, "--for", vendor, "--pv-range", 0, 200)
    result = api.tune(method, ultimate_gain=8, ultimate_period=4, vendor=vendor, pv_range=(0, 200))
    assert json.loads(printed("tune", *args, "--format", "json")) == result.to_json()


def test_tune_by_a_record(tmp_path):
    record = tmp_path / "step.csv"
    rows = (f"{t},{20 if t < 10 else 40},{50 if t < 12 else 90 - 40 * 0.8 ** (t - 12):.6f}\n" for t in range(60))
    record.write_text("".join(rows), "utf-8")
    shown = printed("tune", "--method", "zn-open", "--from-csv", record, "--format", "json")
    assert json.loads(shown) == api.tune("zn-open", record=record).to_json()


@pytest.mark.parametrize("thing", ["V7642=0008", "CK27", "gain", "DL242", "D46", "addr+06.10"])
def test_explain(thing):
    assert json.loads(printed("explain", thing, "--format", "json")) == api.explain(thing).to_json()


def test_explain_what_nobody_knows():
    with pytest.raises(ValueError, match="nothing is known") as error:
        api.explain("nonsense")
    code, shown, _ = captured(pidcfg, ["explain", "nonsense"])
    assert (code, shown.splitlines()[0]) == (2, f"Error: {error.value}")


@pytest.mark.parametrize("path", named(CONFIGURATIONS))
def test_explain_in_a_configuration(path):
    thing = api.encode(path, allow_errors=True).image.cells[-1].address
    result = api.explain(thing, config=path)
    assert json.loads(printed("explain", thing, "--in", path, "--format", "json")) == result.to_json()


def test_explain_nothing():
    assert json.loads(printed("explain", "--format", "json")) == api.explain().to_json()
